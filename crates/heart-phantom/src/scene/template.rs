//! A scene as a file that explains itself.

use super::Scene;
use serde::Serialize;
use std::fmt::Write;

/// The file's head.
const HEAD: &str = "\
# A scene of heart-phantom. Lengths in cm, volumes in mL, times in seconds, angles in degrees.
# Every line may be left out; what is left out is the study of Rohmer, Sitek and Gullberg (2006). Only sections that are commented
# out below need all of their lines once they are there.
#   heart-phantom check FILE      says what is wrong with it
#   heart-phantom run FILE --out DIR
";

pub(super) fn write(scene: &Scene) -> String {
    let mut page = Page(HEAD.to_owned());
    let heart = &scene.heart;
    page.section("heart", "Two balloons filled with water: inner = endocardium, outer = epicardium, the wall between them.");
    page.field(
        "law",
        &heart.law,
        "per-material-length (the paper's Eq. 3), total-force (Eq. 4) or per-current-length",
    );
    page.field(
        "discretisation",
        &heart.discretisation,
        "{ differences = { nodes = 801 } } or { spectral = { degree = 16, per_piece = 1, tolerance = 1e-4 } }",
    );
    for (name, balloon) in [("heart.inner", heart.inner), ("heart.outer", heart.outer)] {
        page.section(name, "A cylinder closed by a hemisphere, at rest.");
        page.field("length", &balloon.length, "of the cylinder");
        page.field("radius", &balloon.radius, "of cylinder and hemisphere");
        page.field("stiffness", &balloon.stiffness, "of the membrane");
    }

    let cycle = &scene.cycle;
    page.section("cycle", "The beat.");
    page.field("beats_per_minute", &cycle.beats_per_minute, "heart rate");
    page.field(
        "curve",
        &cycle.curve,
        "sinusoid (rest at phase 0), physiological (end-diastole at phase 0) or { sampled = [120.0, 90.0, ...] }",
    );
    page.field(
        "volume",
        &cycle.volume,
        "{ gain = 0.6 }, { ejection_fraction = 0.375 } or { volumes = { edv = 148.9, esv = 93.1 } }",
    );

    let pose = &scene.pose;
    page.section(
        "pose",
        "The heart's axis along z, apex up, turned about x, then y, then z, then shifted.",
    );
    page.optional(
        "centre",
        pose.centre.as_ref(),
        "5.625",
        "axis point to turn about, from the base; middle if left out",
    );
    page.field("turn_x", &pose.turn_x, "degrees, right-handed");
    page.field("turn_y", &pose.turn_y, "degrees");
    page.field("turn_z", &pose.turn_z, "degrees");
    page.field("shift", &pose.shift, "[x, y, z] of the axis point");

    page.section("activity", "{ concentration = C } per mL at every phase, or { total = T } conserved as the volume changes.");
    page.field("cavity", &scene.activity.cavity, "blood");
    page.field("wall", &scene.activity.wall, "myocardium");

    page.background(scene);
    page.defects(scene);
    page.attenuation(scene);

    let camera = &scene.camera;
    page.section(
        "camera",
        "Parallel rays; it turns about z. View k of n looks from start + k arc / n.",
    );
    page.field("views", &camera.views, "number of views");
    page.field(
        "arc",
        &camera.arc,
        "degrees covered, counter-clockwise seen from +z",
    );
    page.field("start", &camera.start, "degrees of the first view");
    page.field("bins", &camera.bins, "in a row");
    page.field("rows", &camera.rows, "one a slice");
    page.field("pitch", &camera.pitch, "[of bins, of rows]");
    page.field("rotation", &camera.rotation, "step-and-shoot or continuous");
    page.field(
        "seconds_per_view",
        &camera.seconds_per_view,
        "from the start of a view to the next",
    );
    page.field(
        "radius",
        &camera.radius,
        "detector to axis; only Interfile asks for it",
    );

    page.detector(scene);

    let acquisition = &scene.acquisition;
    page.section("acquisition", "The time that a view sees.");
    page.field(
        "mode",
        &acquisition.mode,
        "{ static = { phase = 0.0 } }, instants, { exposure = { seconds = 0.3 } }, whole-cycle or { gated = { gates = 16 } }",
    );
    page.field(
        "accuracy",
        &acquisition.accuracy,
        "{ steps = 32 } a cycle, or { tolerance = 0.01 } of the sinograms",
    );

    let reconstruction = &scene.reconstruction;
    page.section(
        "reconstruction",
        "Filtered back-projection, slice by slice.",
    );
    page.field(
        "window",
        &reconstruction.window,
        "ram-lak, shepp-logan, cosine, hamming, hann or { butterworth = { order = 5 } }",
    );
    page.field(
        "cutoff",
        &reconstruction.cutoff,
        "share of the Nyquist frequency of the bins",
    );
    page.optional(
        "pixels",
        reconstruction.pixels.as_ref(),
        "256",
        "along an edge; as many as bins if left out",
    );
    page.optional(
        "pixel",
        reconstruction.pixel.as_ref(),
        "0.0625",
        "edge of a pixel; the pitch of the bins if left out",
    );
    page.optional(
        "region",
        reconstruction.region.as_ref(),
        "{ x = [64, 192], y = [64, 192] }",
        "pixels to reconstruct; all if left out",
    );
    page.field(
        "arc",
        &reconstruction.arc,
        "if directions are missing: complete (refuse), extend, truncate or rescale",
    );

    page.section("truth", "The exact volumes.");
    page.field(
        "tolerance",
        &scene.truth.tolerance,
        "largest error of a voxel's covered fraction",
    );

    let output = &scene.output;
    page.section("output", "What `run` writes, besides report.json.");
    page.field(
        "write",
        &output.write,
        "projections, reconstruction, truth, pictures, and of the static phase, the middle of each gate or else end-diastole and end-systole: labels (0 background, 1 cavity, 2 wall, 3 the first defect, ...), attenuation, meshes",
    );
    page.field(
        "volumes",
        &output.volumes,
        "npy, npz, nifti, nifti-gz, meta-image, meta-image-single, nrrd, interfile-stir, interfile-simind or raw-json",
    );
    page.field(
        "projections",
        &output.projections,
        "npy, npz, nrrd, interfile-stir, interfile-simind or raw-json",
    );
    page.field(
        "mesh_tolerance",
        &output.mesh_tolerance,
        "largest relative error of the volume that a surface (STL) encloses",
    );
    page.0
}

struct Page(String);

impl Page {
    fn section(&mut self, name: &str, comment: &str) {
        // Writing to a String does not fail.
        let _ = write!(self.0, "\n# {comment}\n[{name}]\n");
    }

    fn field(&mut self, name: &str, value: &impl Serialize, comment: &str) {
        let _ = writeln!(self.0, "{name} = {}  # {comment}", inline(value));
    }

    fn background(&mut self, scene: &Scene) {
        let comment = "Activity around the heart, in an elliptic torso along z that holds it at every phase; none if this section is left out.";
        match &scene.background {
            Some(background) => {
                self.section("background", comment);
                self.field("concentration", &background.concentration, "per mL");
                self.field("centre", &background.centre, "[x, y] of its axis");
                self.field(
                    "semi_axes",
                    &background.semi_axes,
                    "along x and y; the bins should see all of it",
                );
            }
            None => {
                let example =
                    "concentration = 0.1\n# centre = [0.0, 0.0]\n# semi_axes = [16.0, 11.0]";
                self.left_out(comment, "background", example);
            }
        }
    }

    fn defects(&mut self, scene: &Scene) {
        let comment = "A piece of the wall with another activity, as many as there are such sections; it moves with the wall. Where they overlap the last one counts.";
        for defect in &scene.defects {
            self.section("[defects]", comment);
            self.field(
                "layers",
                &defect.layers,
                "from 0, the inner membrane, to 1, the outer one",
            );
            self.field("s", &defect.s, "from 0, the base, to 0.5, the apex");
            self.field(
                "azimuths_degrees",
                &defect.azimuths_degrees,
                "degrees about the axis",
            );
            self.field("activity", &defect.activity, "in units of the wall's");
        }
        if scene.defects.is_empty() {
            let example = "layers = [0.0, 0.6]\n# s = [0.25, 0.4]\n# azimuths_degrees = [0.0, 60.0]\n# activity = 0.2";
            self.left_out(comment, "[defects]", example);
        }
    }

    fn detector(&mut self, scene: &Scene) {
        let comment = "Gaussian blur of the detector; none if this section is left out.";
        match &scene.blur {
            Some(blur) => {
                self.section("blur", comment);
                self.field("fwhm", &blur.fwhm, "full width at half maximum");
            }
            None => self.left_out(comment, "blur", "fwhm = 1.0"),
        }
        let comment = "Poisson noise; none if this section is left out.";
        match &scene.noise {
            Some(noise) => {
                self.section("noise", comment);
                self.field(
                    "counts",
                    &noise.counts,
                    "{ total = 1e6 } in all views of a gate, or { per_unit = 10.0 }",
                );
                self.field("seed", &noise.seed, "the same seed gives the same noise");
            }
            None => self.left_out(comment, "noise", "counts = { total = 1e6 }\n# seed = 1"),
        }
    }

    /// A section that is not there, commented out, with an example.
    fn left_out(&mut self, comment: &str, name: &str, example: &str) {
        let _ = write!(self.0, "\n# {comment}\n# [{name}]\n# {example}\n");
    }

    fn attenuation(&mut self, scene: &Scene) {
        let comment = "What weakens the rays; nothing if this section is left out.";
        let torso = "{ torso = { centre = [0.0, 0.0], semi_axes = [16.0, 11.0] } }";
        match &scene.attenuation {
            Some(attenuation) => {
                self.section("attenuation", comment);
                self.field("coefficient", &attenuation.coefficient, "in 1/cm");
                self.field("medium", &attenuation.medium, &format!("heart, or {torso}"));
            }
            None => {
                let example =
                    format!("coefficient = 0.15  # in 1/cm\n# medium = {torso}  # or heart");
                self.left_out(comment, "attenuation", &example);
            }
        }
    }

    /// A field that may be absent: then an example of it, commented out.
    fn optional(
        &mut self,
        name: &str,
        value: Option<&impl Serialize>,
        example: &str,
        comment: &str,
    ) {
        match value {
            Some(value) => self.field(name, value, comment),
            None => {
                let _ = writeln!(self.0, "# {name} = {example}  # {comment}");
            }
        }
    }
}

/// A value on one line. Numbers too large for TOML stay JSON's, which `check` then refuses by their line.
fn inline(value: &impl Serialize) -> String {
    match toml::Value::try_from(value) {
        Ok(value) => value.to_string(),
        Err(_) => serde_json::to_string(value).unwrap_or_default(),
    }
}
