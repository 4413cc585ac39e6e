//! Validation: each section alone, then rules across valid sections, then rules that need the objects of the scene.

use super::finding::{Check, Finding, SceneError, array_of, spelled};
use super::*;
use crate::error::PhantomError;
use crate::model::{Height, without_overlap};
use crate::ranges;
use crate::scan::VOXELS;
use crate::scene::beam::with_rays;
use crate::scene::build;
use crate::text::{Number, enough};
use crate::{
    Attenuation, Camera, Counts, Cycle, Decay, Defect, Heart, Medium, Method, Mode, Uptake,
    VolumeCurve, VolumeRange,
};

/// Validates a scene and builds its objects; `own` replaces `[heart]` and `[pose]`. Solves no shape.
pub(crate) fn parts(scene: Scene, own: Option<Heart>) -> Result<Parts, SceneError> {
    let mut check = Check::default();
    let c = &mut check;
    let own_heart = own.is_some();
    let heart = own.or_else(|| {
        c.at("heart", |c| scene.heart.check(c));
        c.at("pose", |c| scene.pose.check(c));
        (c.is_clean(&["heart", "pose"]))
            .then(|| c.built("heart", build::heart_of(&scene)))
            .flatten()
    });
    let cycle = cycle(&scene, heart.as_ref(), c);
    values(&scene, c);
    let camera = camera(&scene, c);
    if let (Some(cycle), Some(camera)) = (&cycle, &camera)
        && c.is_clean(&["acquisition", "camera"])
    {
        check_time::in_real_time(&scene, cycle, camera, c);
    }
    c.at("output", |c| {
        check_output::output(&scene, camera.as_ref(), c)
    });
    let (Some(heart), Some(cycle), Some(camera)) = (heart, cycle, camera) else {
        return Err(check.into_error());
    };
    check.finish()?;
    let parts = build::parts(scene, (heart, own_heart), cycle, camera)
        .map_err(|error| Finding::new(None, "", error.to_string()))?;
    built(&parts).map(|()| parts)
}

impl Scene {
    /// Validates a scene that was built in Rust.
    ///
    /// # Errors
    /// [`SceneError`] with the field, the value and the allowed range.
    pub fn check(&self) -> Result<(), SceneError> {
        parts(self.clone(), None).map(drop)
    }
}

/// Validates `[cycle]`, `[beats]` and `[breathing]`, and returns the cycle of a heart.
fn cycle(scene: &Scene, heart: Option<&Heart>, c: &mut Check) -> Option<Cycle> {
    c.at("cycle", |c| scene.cycle.check(heart, c));
    let cycle = match (heart, c.is_clean(&["cycle"])) {
        (Some(heart), true) => c.built("cycle", build::cycle_of(scene, heart)),
        _ => None,
    };
    let cycle = match (&scene.beats, cycle) {
        (Some(beats), Some(cycle)) => c.at("beats", |c| motion::beats(beats, cycle, c)),
        (_, cycle) => cycle,
    };
    let Some(breathing) = &scene.breathing else {
        return cycle;
    };
    c.at("breathing", |c| breathing.check(c));
    let cycle = cycle.filter(|_| c.is_clean(&["breathing"]))?;
    c.built("breathing", cycle.with_breathing(breathing))
}

/// Validates the values of all other sections.
fn values(scene: &Scene, c: &mut Check) {
    c.at("activity.cavity", |c| uptake(scene.activity.cavity, c));
    c.at("activity.wall", |c| uptake(scene.activity.wall, c));
    if let Some(background) = &scene.background {
        c.at("background", |c| {
            activity(c, "concentration", background.concentration);
            torso(c, background.centre, background.semi_axes);
        });
    }
    defects(&scene.defects, c);
    if let Some(twist) = &scene.twist {
        c.at("twist", |c| twist.check(c));
    }
    motion::points(&scene.points, c);
    organs(scene, c);
    if let Some(attenuation) = &scene.attenuation {
        c.at("attenuation", |c| attenuation.check(c));
    }
    c.at("camera", |c| scene.camera.check(c));
    check_beam::check(scene, c);
    detector(scene, c);
    scatter(scene, c);
    check_time::acquisition(scene, c);
    check_reconstruction::reconstruction(scene, c);
    let tolerance = scene.truth.tolerance;
    c.within("truth.tolerance", tolerance, ranges::TRUTH_TOLERANCE);
}

/// Returns the camera, with its rays if they are not parallel.
fn camera(scene: &Scene, c: &mut Check) -> Option<Camera> {
    if !c.is_clean(&["camera", "reconstruction"]) {
        return None;
    }
    let camera = match build::camera_of(scene) {
        Err(PhantomError::OutOfRange {
            what, given, most, ..
        }) => {
            let field = match scene.reconstruction.pixels {
                Some(_) if what == VOXELS => "reconstruction.pixels",
                None if what == VOXELS => "camera.bins",
                _ => "camera.views",
            };
            c.fault(
                field,
                "",
                format!("{what} = {given:e} must be at most {most:e}"),
            );
            return None;
        }
        made => c.built("camera", made)?,
    };
    check_reconstruction::directions(scene, &camera, c);
    c.built("camera.geometry", with_rays(scene, camera))
}

/// Validates rules that need the objects of a scene.
fn built(parts: &Parts) -> Result<(), SceneError> {
    let mut c = Check::default();
    if parts.scene.counting.is_some() {
        expected_counts(parts, &mut c);
    }
    if let Method::Osem(osem) = &parts.scene.reconstruction.method {
        // The radii of a contour orbit are known only after the body is solved.
        let radii = parts.nominal_radii().unwrap_or_default();
        if let Err(error) = parts.model_voxels(osem, &radii) {
            c.fault("reconstruction.method", "osem", error.to_string());
        }
    }
    c.finish()
}

fn expected_counts(parts: &Parts, c: &mut Check) {
    const SECONDS: [f64; 2] = [1e-9, 1e9];
    let [least, most] = ranges::COUNTS;
    for gate in 0..parts.n_gates() {
        let times = parts.view_times(gate);
        let lasts = |seconds: f64| (SECONDS[0]..=SECONDS[1]).contains(&seconds);
        if let Some(time) = times.iter().find(|time| !lasts(time.window)) {
            let [seconds, least, most] = [time.window, SECONDS[0], SECONDS[1]].map(Number);
            let wanted = format!(
                "gives views of {seconds} s; with [counting] they must last between {least} and {most} s"
            );
            return c.fault("acquisition.mode", spelled(parts.mode()), wanted);
        }
        let counts = parts.expected_counts(gate).into_iter().flatten();
        if let Some(bad) = { counts }.find(|counts| !(least..=most).contains(counts)) {
            let [bad, least, most] = [bad, least, most].map(Number);
            let wanted = format!(
                "gives {bad} expected counts per unit sample; must be between {least} and {most}"
            );
            let given = parts
                .scene
                .counting
                .map_or(0.0, |counting| counting.sensitivity);
            return c.fault("counting.sensitivity", Number(given), wanted);
        }
    }
}

impl HeartSettings {
    fn check(&self, c: &mut Check) {
        let (inner, outer) = (self.inner, self.outer);
        for (name, balloon) in [("inner", inner), ("outer", outer)] {
            c.at(name, |c| {
                c.within("length", balloon.length, ranges::SIZE);
                c.within("radius", balloon.radius, ranges::SIZE);
                c.within("stiffness", balloon.stiffness, [1e-6, 1e6]);
            });
        }
        material::check(&self.material, [inner, outer], self.law, c);
        let sizes = [
            "heart.inner.length",
            "heart.inner.radius",
            "heart.outer.length",
            "heart.outer.radius",
        ];
        if !c.is_clean(&sizes) {
            return;
        }
        if outer.radius <= inner.radius {
            let wanted = format!("must be greater than heart.inner.radius = {}", inner.radius);
            c.fault("outer.radius", Number(outer.radius), wanted);
        } else if outer.length + outer.radius <= inner.length + inner.radius {
            let least = inner.length + inner.radius - outer.radius;
            let wanted = format!("must be greater than {least}, so that the inner apex is inside");
            c.fault("outer.length", Number(outer.length), wanted);
        }
        c.at("discretisation", |c| match self.discretisation {
            DiscretisationSettings::Differences { nodes } => {
                c.count("differences.nodes", nodes, [11, 100_001]);
            }
            DiscretisationSettings::Spectral {
                degree,
                per_piece,
                tolerance,
            } => {
                c.count("spectral.degree", degree, [4, 64]);
                c.count("spectral.per_piece", per_piece, [1, 64]);
                let size = outer.length + outer.radius;
                c.within("spectral.tolerance", tolerance, [1e-9 * size, 1e-2 * size]);
            }
        });
    }
}

impl CycleSettings {
    /// Validates the section for a heart, if it is known.
    fn check(&self, heart: Option<&Heart>, c: &mut Check) {
        c.within("beats_per_minute", self.beats_per_minute, [1.0, 1000.0]);
        if let (true, Err(error)) = (
            c.is_clean(&["cycle"]),
            Height::new(&self.curve, self.beats_per_minute),
        ) {
            match &self.curve {
                VolumeCurve::Sampled(volumes) => {
                    c.fault("curve.sampled", array_of(volumes.len()), error.to_string());
                }
                _ => c.fault("curve", "physiological", error.to_string()),
            }
        }
        let length = heart.map_or(f64::MAX, Heart::length);
        let displacement = self.av_plane_displacement;
        c.within("av_plane_displacement", displacement, [0.0, length]);
        let rest = heart.map(Heart::reference_volume);
        c.at("volume", |c| match (self.volume, rest) {
            (VolumeRange::Gain(gain), _) => c.within("gain", gain, ranges::GAIN),
            (VolumeRange::Gains([low, high]), _) => {
                c.within("gains", high, ranges::GAIN);
                c.within("gains", low, [0.0, high.max(0.0)]);
            }
            (VolumeRange::EjectionFraction(fraction), _) => {
                c.within("ejection_fraction", fraction, ranges::EJECTION_FRACTION);
            }
            (VolumeRange::Volumes { .. }, None) => {}
            (VolumeRange::Volumes { edv, esv }, Some(rest)) => {
                // NaN fails both comparisons.
                let (is_esv, is_edv) = (esv >= rest, edv >= esv);
                if !is_esv {
                    let least = Number(enough(rest));
                    let wanted = format!(
                        "must be at least {least}, the reference volume of heart.inner in mL"
                    );
                    c.fault("volumes.esv", Number(esv), wanted);
                } else if !is_edv {
                    let wanted = "must be at least the end-systolic volume";
                    c.fault("volumes.edv", Number(edv), wanted);
                } else {
                    c.within("volumes.edv", edv, [rest, rest * (1.0 + ranges::GAIN[1])]);
                }
            }
        });
    }
}

impl PoseSettings {
    fn check(&self, c: &mut Check) {
        c.all_within("centre", self.centre.as_slice(), PLACE);
        for (name, angle) in [
            ("rotate_x", self.rotate_x),
            ("rotate_y", self.rotate_y),
            ("rotate_z", self.rotate_z),
        ] {
            c.within(name, angle, [-360.0, 360.0]);
        }
        c.all_within("shift", &self.shift, PLACE);
    }
}

/// Range of a coordinate.
const PLACE: [f64; 2] = [-ranges::SIZE[1], ranges::SIZE[1]];

fn uptake(uptake: Uptake, c: &mut Check) {
    let (kind, amount) = match uptake {
        Uptake::Concentration(amount) => ("concentration", amount),
        Uptake::Total(amount) => ("total", amount),
    };
    activity(c, kind, amount);
}

/// Validates an activity.
fn activity(c: &mut Check, name: &str, given: f64) {
    c.within(name, given, ranges::ACTIVITY);
    let least = ranges::LEAST_ACTIVITY;
    if given > 0.0 && given < least {
        let wanted = format!("must be 0 or at least {least:e}: samples have single precision");
        c.fault(name, Number(given), wanted);
    }
}

fn defects(defects: &[Defect], c: &mut Check) {
    c.count("defects", defects.len(), ranges::DEFECTS);
    c.each("defects", defects, |c, defect| {
        c.ascending("layers", defect.layers, ranges::LAYER);
        c.ascending("s", defect.s, ranges::S);
        let [from, to] = defect.azimuths_degrees;
        if !(-360.0..=360.0).contains(&from) {
            c.within("azimuths_degrees", from, [-360.0, 360.0]);
        } else if !(from < to && to <= from + 360.0) {
            let given = format!("[{}, {}]", Number(from), Number(to));
            let wanted = "must be [from, to] with from < to <= from + 360";
            c.fault("azimuths_degrees", given, wanted);
        }
        c.within("activity", defect.activity, ranges::DEFECT_ACTIVITY);
    });
    if c.is_clean(&["defects"]) && without_overlap(defects.iter().map(Defect::region)).is_err() {
        let wanted = format!("their overlaps make more than {} pieces", ranges::PIECES[1]);
        c.fault("defects", defects.len(), wanted);
    }
}

/// Validates the sections `[blur]`, `[collimator]`, `[counting]` and `[noise]`.
fn detector(scene: &Scene, c: &mut Check) {
    let camera = &scene.camera;
    if let (Some(blur), true) = (scene.blur, c.is_clean(&["camera"])) {
        // At most the smaller side of the detector that has more than one sample.
        let sides = [camera.bins, camera.rows].into_iter().zip(camera.pitch);
        let widths = (sides.filter(|(n, _)| *n > 1)).map(|(n, pitch)| n as f64 * pitch);
        let widest = widths.fold(ranges::SIZE[1], f64::min);
        c.within("blur.fwhm", blur.fwhm, [0.0, widest]);
    }
    if let Some(collimator) = &scene.collimator {
        c.at("collimator", |c| collimator.check(c));
        if scene.blur.is_some() {
            let wanted = "cannot be combined with [collimator]; collimator.intrinsic_fwhm is the resolution of the crystal";
            c.fault("blur", "", wanted);
        }
    }
    if let Some(counting) = &scene.counting {
        c.within("counting.sensitivity", counting.sensitivity, ranges::COUNTS);
        if let Decay::HalfLifeHours(hours) = counting.decay {
            let field = "counting.decay.half_life_hours";
            c.within(field, hours, Decay::HALF_LIVES);
        }
        match scene.acquisition.mode {
            Mode::Instants => {
                let wanted = "has no acquisition time, which [counting] needs; choose exposure or another mode";
                c.fault("acquisition.mode", "instants", wanted);
            }
            Mode::Exposure { seconds } => {
                c.within("acquisition.mode.exposure.seconds", seconds, [1e-9, 1e9]);
            }
            Mode::Static { .. } | Mode::WholeCycle | Mode::Gated { .. } => {}
        }
    }
    let (field, mean) = match scene.noise.map(|noise| noise.counts) {
        None => return,
        Some(Counts::Expected) => {
            if scene.counting.is_none() {
                c.fault("noise.counts", "expected", "needs a section [counting]");
            }
            return;
        }
        Some(Counts::PerUnit(mean)) => ("noise.counts.per_unit", mean),
        Some(Counts::Total(mean)) => ("noise.counts.total", mean),
    };
    match scene.counting {
        None => c.within(field, mean, ranges::COUNTS),
        Some(_) => {
            let wanted = "must be expected with [counting], which defines the number of counts";
            c.fault("noise.counts", Number(mean), wanted);
        }
    }
}

impl CollimatorSettings {
    fn check(&self, c: &mut Check) {
        let positive = [1e-6, 1e3];
        match self.holes {
            HolesSettings::Parallel(holes) => c.at("holes.parallel", |c| {
                c.within("diameter", holes.diameter, positive);
                c.within("length", holes.length, positive);
                c.within("attenuation", holes.attenuation, [1e-6, 1e6]);
            }),
            HolesSettings::Widths { slope, at_face } => c.at("holes.widths", |c| {
                c.within("slope", slope, [0.0, 10.0]);
                c.within("at_face", at_face, [0.0, 1e3]);
            }),
            HolesSettings::GeLehr
            | HolesSettings::GeLegp
            | HolesSettings::GeVentriLehr
            | HolesSettings::SiemensLehr => {}
        }
        c.within("intrinsic_fwhm", self.intrinsic_fwhm, [0.0, 1e3]);
        if let (true, Err(error)) = (c.is_clean(&["collimator"]), self.response()) {
            // The only errors left: septal penetration leaves no effective length, or holes are wider than long.
            c.fault("holes", "parallel", error.to_string());
        }
    }
}

impl Attenuation {
    fn check(&self, c: &mut Check) {
        c.within("coefficient", self.coefficient, ranges::ATTENUATION);
        if let Medium::Torso { centre, semi_axes } = self.medium {
            c.at("medium.torso", |c| torso(c, centre, semi_axes));
        }
    }
}

fn scatter(scene: &Scene, c: &mut Check) {
    let Some(settings) = &scene.scatter else {
        return;
    };
    for (field, given, range) in [
        (
            "scatter.tolerance",
            settings.tolerance,
            ranges::SCATTER_TOLERANCE,
        ),
        ("scatter.energy", settings.energy, ranges::PHOTON_ENERGY),
        (
            "scatter.resolution",
            settings.resolution,
            ranges::ENERGY_RESOLUTION,
        ),
    ] {
        c.within(field, given, range);
    }
    if c.is_clean(&["scatter"])
        && let Err(error) = settings.spectrum()
    {
        let given = format!("{:?}", settings.windows);
        c.fault("scatter.windows", given, error.to_string());
    }
    if scene.attenuates().is_none() {
        let wanted = "needs a section [attenuation] or [chest]: the medium that scatters";
        c.fault("scatter.tolerance", Number(settings.tolerance), wanted);
    }
}

fn organs(scene: &Scene, c: &mut Check) {
    c.each("organs", &scene.organs, |c, organ| {
        match organ.shape {
            OrganShapeSettings::Cylinder { centre, semi_axes } => {
                c.at("shape.cylinder", |c| torso(c, centre, semi_axes));
            }
            OrganShapeSettings::Ellipsoid { centre, semi_axes } => {
                c.at("shape.ellipsoid", |c| torso(c, centre, semi_axes));
            }
        }
        activity(c, "activity", organ.activity);
        c.within("attenuation", organ.attenuation, ranges::ATTENUATION);
    });
    if let Some(chest) = scene.chest {
        for (field, given) in [
            ("chest.trunk", chest.trunk),
            ("chest.lungs", chest.lungs),
            ("chest.liver", chest.liver),
            ("chest.spine", chest.spine),
        ] {
            activity(c, field, given);
        }
    }
    let around = !scene.organs.is_empty() || scene.chest.is_some();
    if !around || !c.is_clean(&["organs", "chest", "background"]) {
        return;
    }
    if scene.background.is_some() {
        let wanted = "cannot be combined with [chest] or [[organs]]";
        return c.fault("background", "", wanted);
    }
    match scene.attenuates().map(|own| own.medium) {
        Some(Medium::Heart) => {}
        Some(Medium::Torso { .. }) => {
            let wanted =
                "must be heart with [chest] or [[organs]], which have their own attenuation";
            c.fault("attenuation.medium", "torso", wanted);
        }
        None => {
            let wanted = "the heart needs [attenuation] with medium = \"heart\"";
            c.fault("organs.1", "", wanted);
        }
    }
}

fn torso<const N: usize>(c: &mut Check, centre: [f64; N], semi_axes: [f64; N]) {
    c.all_within("centre", &centre, PLACE);
    c.all_within("semi_axes", &semi_axes, ranges::SIZE);
}
