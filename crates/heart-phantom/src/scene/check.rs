//! Validation: each section alone, then rules across valid sections, then rules that need the objects of the scene.

use super::finding::{Check, SceneError, array_of, spelled};
use super::*;
use crate::model::Height;
use crate::model::without_overlap;
use crate::ranges;
use crate::scene::build::{self, Rest, regular_cycle_of};
use crate::text::{Number, enough};
use crate::{Heart, Uptake, VolumeCurve, VolumeRange};

/// Validates a scene and builds its objects; `heart` replaces `[heart]` and `[pose]`. Solves no shape.
pub(crate) fn parts(scene: Scene, heart: Option<Heart>) -> Result<Parts, SceneError> {
    let rest = self::scene(&scene, heart.as_ref())?;
    match build::parts(scene, heart, rest) {
        Ok(parts) => built(&parts).map(|()| parts),
        // The pair of membranes is the only part that was not validated.
        Err(error) => {
            let mut c = Check::default();
            c.fault("heart", "", error.to_string());
            Err(c.into_error())
        }
    }
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

/// Validates a scene; `own` replaces `[heart]` and `[pose]`. Returns the reference volume of gains.
fn scene(scene: &Scene, own: Option<&Heart>) -> Result<Rest, SceneError> {
    let mut check = Check::default();
    let c = &mut check;
    if own.is_none() {
        c.at("heart", |c| scene.heart.check(c));
        c.at("pose", |c| scene.pose.check(c));
    }
    let rest = match c.is_clean(&["heart"]) {
        true => Rest::of(scene, own).unwrap_or_default(),
        false => Rest::default(),
    };
    c.at("cycle", |c| {
        scene.cycle.check([rest.volume, rest.length], c)
    });
    if let (Some(beats), true) = (&scene.beats, c.is_clean(&["cycle"]))
        && let Ok(cycle) = regular_cycle_of(scene, rest.volume)
    {
        c.at("beats", |c| motion::beats(beats, cycle, c));
    }
    if let Some(breathing) = &scene.breathing {
        c.at("breathing", |c| breathing.check(c));
    }
    c.at("activity.cavity", |c| uptake(scene.activity.cavity, c));
    c.at("activity.wall", |c| uptake(scene.activity.wall, c));
    if let Some(background) = &scene.background {
        c.at("background", |c| {
            c.within("concentration", background.concentration, ranges::ACTIVITY);
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
    if c.is_clean(&["camera"]) {
        check_beam::check(scene, c);
    }
    detector(scene, c);
    scatter(scene, c);
    check_time::acquisition(scene, c);
    check_reconstruction::reconstruction(scene, c);
    if c.is_clean(&[
        "cycle",
        "beats",
        "breathing",
        "camera",
        "acquisition",
        "reconstruction",
    ]) {
        check_time::in_real_time(scene, rest.volume, c);
    }
    let tolerance = scene.truth.tolerance;
    c.within("truth.tolerance", tolerance, ranges::TRUTH_TOLERANCE);
    c.at("output", |c| check_output::output(scene, c));
    check.finish()?;
    Ok(rest)
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
    /// `rest` is the reference volume of the inner membrane, NaN if unknown, `length` that of the outer one.
    fn check(&self, [rest, length]: [f64; 2], c: &mut Check) {
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
        c.within(
            "av_plane_displacement",
            self.av_plane_displacement,
            [0.0, length],
        );
        c.at("volume", |c| match self.volume {
            VolumeRange::Gain(gain) => c.within("gain", gain, ranges::GAIN),
            VolumeRange::Gains([low, high]) => {
                c.within("gains", high, ranges::GAIN);
                c.within("gains", low, [0.0, high.max(0.0)]);
            }
            VolumeRange::EjectionFraction(fraction) => {
                c.within("ejection_fraction", fraction, ranges::EJECTION_FRACTION);
            }
            VolumeRange::Volumes { .. } if rest.is_nan() => {}
            VolumeRange::Volumes { edv, esv } => {
                let mut above = |name, given: f64, least: f64, why: &str| {
                    let is_above = given >= least;
                    if !is_above {
                        let wanted = format!("must be at least {}, {why}", Number(enough(least)));
                        c.fault(name, Number(given), wanted);
                    }
                    is_above
                };
                let name = "volumes.edv";
                if above(
                    "volumes.esv",
                    esv,
                    rest,
                    "the reference volume of heart.inner in mL",
                ) && above(name, edv, esv, "the end-systolic volume")
                {
                    c.within(name, edv, [rest, rest * (1.0 + ranges::GAIN[1])]);
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
    c.within(kind, amount, ranges::ACTIVITY);
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
        c.within("activity", organ.activity, ranges::ACTIVITY);
        c.within("attenuation", organ.attenuation, ranges::ATTENUATION);
    });
    if let Some(chest) = scene.chest {
        for (field, activity) in [
            ("chest.trunk", chest.trunk),
            ("chest.lungs", chest.lungs),
            ("chest.liver", chest.liver),
            ("chest.spine", chest.spine),
        ] {
            c.within(field, activity, ranges::ACTIVITY);
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
