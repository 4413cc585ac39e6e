//! A scene as a file that explains itself.

use super::{
    AttenuationSettings, BackgroundSettings, BlurSettings, Counts, DefectSettings, MediumSettings,
    Noise, Scene,
};
use serde::Serialize;
use std::fmt::Write;

/// Half-widths in cm of a chest, for examples.
const TORSO: [f64; 2] = [16.0, 11.0];
/// The file's head.
const HEAD: &str = "\
# A scene of heart-phantom. Lengths in cm, volumes in mL, times in seconds, angles in degrees.
# Every line may be left out; what is left out is the study of Rohmer, Sitek and Gullberg (2006). Only sections that are commented
# out below need all of their lines once they are there.
#   heart-phantom check FILE      says what is wrong with it
#   heart-phantom run FILE --out DIR
";

/// The file's text.
pub(super) fn write(scene: &Scene) -> String {
    page(scene).text
}

/// What may stand in a field, or in the field of the file that holds it; of a section, its fields. `given` is what stands there.
pub(super) fn advice(path: &str, given: &str) -> Option<String> {
    let is_name = |name: &&str| name.parse::<usize>().is_err();
    let names: Vec<&str> = path.split('.').filter(is_name).collect();
    let path = names.join(".");
    let known = page(&Scene::default()).comments;
    if let Some((field, comment)) = known
        .iter()
        .find(|(field, _)| below(field, &path).is_some())
    {
        let chosen = match path == *field {
            true => given.trim_matches(['"', '\'']),
            false => names.last().copied().unwrap_or_default(),
        };
        let name = field.rsplit('.').next().unwrap_or_default();
        return Some(match choice(comment, chosen) {
            Some(example) => format!("`{chosen}` needs more than that: {name} = {example}"),
            None => format!("may be {comment}"),
        });
    }
    let mut fields: Vec<&str> = (known.iter())
        .filter_map(|(field, _)| below(&path, field)?.split('.').next())
        .collect();
    fields.dedup();
    let section = match path.as_str() {
        "defects" => "[[defects]]".to_owned(),
        _ => format!("[{path}]"),
    };
    (!fields.is_empty()).then(|| format!("must be a section {section} of {}", fields.join(", ")))
}

/// The rest of a path below another one; empty if they are the same.
fn below<'a>(outer: &str, path: &'a str) -> Option<&'a str> {
    let rest = path.strip_prefix(outer)?;
    match rest.is_empty() {
        true => Some(rest),
        false => rest.strip_prefix('.'),
    }
}

/// The example of one of the choices of a comment, if it is a table: `{ gated = { gates = 16 } }`.
fn choice<'a>(comment: &'a str, name: &str) -> Option<&'a str> {
    let from = &comment[comment.find(&format!("{{ {name} = "))?..];
    let mut depth = 0;
    let end = from.find(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        depth == 0
    })?;
    Some(&from[..=end])
}

fn page(scene: &Scene) -> Page {
    let mut page = Page {
        text: HEAD.to_owned(),
        section: String::new(),
        comments: Vec::new(),
    };
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

    page.section("activity", "What blood and myocardium hold.");
    let uptake = "{ concentration = 1.0 } per mL at every phase, or { total = 100.0 }, conserved as the volume changes";
    page.field("cavity", &scene.activity.cavity, uptake);
    page.field("wall", &scene.activity.wall, uptake);

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
        "{ x = [from, to], y = [from, to] } in pixels, `to` not included; all if left out",
    );
    page.field(
        "arc",
        &reconstruction.arc,
        "complete, extend, truncate or rescale: if directions are missing, refuse, let their neighbours stand for them, count them as nothing, or that scaled up",
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
    page
}

/// A page as it grows.
struct Page {
    text: String,
    /// The section that it is in.
    section: String,
    /// The comment on each field.
    comments: Vec<(String, String)>,
}

impl Page {
    fn section(&mut self, name: &str, comment: &str) {
        // Writing to a String does not fail.
        let _ = write!(self.text, "\n# {comment}\n[{name}]\n");
        self.section = name.trim_matches(['[', ']']).to_owned();
    }

    fn field(&mut self, name: &str, value: &impl Serialize, comment: &str) {
        let _ = writeln!(self.text, "{name} = {}  # {comment}", inline(value));
        self.keep(name, comment);
    }

    fn keep(&mut self, name: &str, comment: &str) {
        let field = format!("{}.{name}", self.section);
        self.comments.push((field, comment.to_owned()));
    }

    /// A section that may be absent: then an example of it, commented out.
    fn left_out<T>(&mut self, given: Option<&T>, example: &T, write: impl FnOnce(&mut Self, &T)) {
        let from = self.text.len();
        write(self, given.unwrap_or(example));
        if given.is_none() {
            for line in self.text.split_off(from).lines() {
                let mark = match line {
                    "" => "",
                    line if line.starts_with('#') => "",
                    _ => "# ",
                };
                let _ = writeln!(self.text, "{mark}{line}");
            }
        }
    }

    fn background(&mut self, scene: &Scene) {
        let example = BackgroundSettings {
            concentration: 0.1,
            centre: [0.0; 2],
            semi_axes: TORSO,
        };
        self.left_out(scene.background.as_ref(), &example, |page, background| {
            page.section("background", "Activity around the heart, in an elliptic torso along z that holds it at every phase; none if this section is left out.");
            page.field("concentration", &background.concentration, "per mL");
            page.field("centre", &background.centre, "[x, y] of its axis");
            page.field(
                "semi_axes",
                &background.semi_axes,
                "along x and y; the bins should see all of it",
            );
        });
    }

    fn defects(&mut self, scene: &Scene) {
        let mut write = |given: Option<&DefectSettings>| {
            let example = DefectSettings {
                layers: [0.0, 0.6],
                s: [0.25, 0.4],
                azimuths_degrees: [0.0, 60.0],
                activity: 0.2,
            };
            self.left_out(given, &example, |page, defect| {
                page.section("[defects]", "A piece of the wall with another activity, as many as there are such sections; it moves with the wall. Where they overlap the last one counts.");
                page.field(
                    "layers",
                    &defect.layers,
                    "from 0, the inner membrane, to 1, the outer one: shares of the wall's volume",
                );
                page.field("s", &defect.s, "from 0, the base, to 0.5, the apex");
                page.field(
                    "azimuths_degrees",
                    &defect.azimuths_degrees,
                    "degrees about the axis",
                );
                page.field("activity", &defect.activity, "in units of the wall's");
            });
        };
        for defect in &scene.defects {
            write(Some(defect));
        }
        if scene.defects.is_empty() {
            write(None);
        }
    }

    fn detector(&mut self, scene: &Scene) {
        let example = BlurSettings { fwhm: 1.0 };
        self.left_out(scene.blur.as_ref(), &example, |page, blur| {
            let comment = "Gaussian blur of the detector; none if this section is left out.";
            page.section("blur", comment);
            page.field("fwhm", &blur.fwhm, "full width at half maximum");
        });
        let example = Noise {
            counts: Counts::Total(1e6),
            seed: 1,
        };
        self.left_out(scene.noise.as_ref(), &example, |page, noise| {
            page.section("noise", "Poisson noise; none if this section is left out.");
            page.field(
                "counts",
                &noise.counts,
                "{ total = 1e6 } in all views of a gate, or { per_unit = 10.0 }",
            );
            page.field("seed", &noise.seed, "the same seed gives the same noise");
        });
    }

    fn attenuation(&mut self, scene: &Scene) {
        let example = AttenuationSettings {
            coefficient: 0.15,
            medium: MediumSettings::Torso {
                centre: [0.0; 2],
                semi_axes: TORSO,
            },
        };
        self.left_out(scene.attenuation.as_ref(), &example, |page, attenuation| {
            let comment = "What weakens the rays; nothing if this section is left out.";
            page.section("attenuation", comment);
            page.field("coefficient", &attenuation.coefficient, "in 1/cm");
            let torso = inline(&example.medium);
            page.field("medium", &attenuation.medium, &format!("heart, or {torso}"));
        });
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
                let _ = writeln!(self.text, "# {name} = {example}  # {comment}");
                self.keep(name, comment);
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
