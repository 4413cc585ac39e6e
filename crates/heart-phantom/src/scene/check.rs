//! What a scene may hold: every field in its range, and the fields with each other.

use super::check_camera::{camera, even_steps};
use super::check_reconstruction::{reconstruction, region_has_a_place};
use super::check_time::{acquisition, turning};
use super::fault::{Checked, Section, all_within, count, fault, spelled, within};
use super::template::formats;
use super::*;
use super::{material, motion};
use crate::model::{Height, without_overlap};
use crate::ranges;
use crate::scene::build::{Rest, collimation_of, defect_of, regular_cycle_of};
use crate::text::{Number, enough};
use crate::{Uptake, VolumeCurve, VolumeRange};

/// Gives what gains are over.
pub(super) fn scene(scene: &Scene) -> Result<Rest, SceneError> {
    heart(&scene.heart)?;
    let rest = Rest::of(scene).unwrap_or(Rest {
        volume: f64::NAN,
        heart: None,
    });
    cycle(&scene.cycle, rest.volume)?;
    if let (Some(beats), Ok(cycle)) = (&scene.beats, regular_cycle_of(scene, rest.volume)) {
        motion::beats(beats, cycle)?;
    }
    pose(&scene.pose)?;
    if let Some(breathing) = &scene.breathing {
        breathing.check()?;
    }
    for (region, uptake) in [
        ("cavity", scene.activity.cavity),
        ("wall", scene.activity.wall),
    ] {
        let (kind, amount) = match uptake {
            Uptake::Concentration(amount) => ("concentration", amount),
            Uptake::Total(amount) => ("total", amount),
        };
        let field = format!("activity.{region}.{kind}");
        within(&field, amount, ranges::ACTIVITY)?;
    }
    if let Some(background) = &scene.background {
        let concentration = background.concentration;
        within("background.concentration", concentration, ranges::ACTIVITY)?;
        torso("background", background.centre, background.semi_axes)?;
    }
    count("defects", scene.defects.len(), ranges::DEFECTS)?;
    for (k, settings) in scene.defects.iter().enumerate() {
        defect(&Section(format!("defects.{}", k + 1)), settings)?;
    }
    let defects = scene.defects.iter().map(defect_of);
    if without_overlap(defects.map(|defect| defect.region)).is_err() {
        let wanted = format!("overlap in more than {} pieces", ranges::PIECES[1]);
        return Err(fault("defects", scene.defects.len(), wanted));
    }
    if let Some(twist) = &scene.twist {
        twist.check()?;
    }
    motion::points(&scene.points)?;
    detector(scene)?;
    organs(scene)?;
    if let Some(settings) = &scene.attenuation {
        attenuation(settings)?;
    }
    camera(&scene.camera)?;
    acquisition(scene)?;
    reconstruction(scene)?;
    turning(scene, rest.volume)?;
    let tolerance = scene.truth.tolerance;
    within("truth.tolerance", tolerance, ranges::TRUTH_TOLERANCE)?;
    if scene.attenuates().is_none() && scene.output.write.contains(&Product::Attenuation) {
        let wanted = "needs a section [attenuation]";
        return Err(fault("output.write", "attenuation", wanted));
    }
    output(&scene.output)?;
    even_steps(scene)?;
    one_file(scene)?;
    region_has_a_place(scene)?;
    Ok(rest)
}

fn heart(heart: &HeartSettings) -> Checked {
    for (name, balloon) in [("heart.inner", heart.inner), ("heart.outer", heart.outer)] {
        let section = Section(name);
        section.within("length", balloon.length, ranges::SIZE)?;
        section.within("radius", balloon.radius, ranges::SIZE)?;
        section.within("stiffness", balloon.stiffness, [1e-6, 1e6])?;
    }
    material::check(&heart.material, [heart.inner, heart.outer], heart.law)?;
    let (inner, outer) = (heart.inner, heart.outer);
    if outer.radius <= inner.radius {
        let wanted = format!("must be more than heart.inner.radius = {}", inner.radius);
        return Err(fault("heart.outer.radius", Number(outer.radius), wanted));
    }
    if outer.length + outer.radius <= inner.length + inner.radius {
        let least = inner.length + inner.radius - outer.radius;
        let wanted = format!("must be more than {least}, or the inner apex is outside");
        return Err(fault("heart.outer.length", Number(outer.length), wanted));
    }
    match heart.discretisation {
        DiscretisationSettings::Differences { nodes } => {
            Section("heart.discretisation.differences").count("nodes", nodes, [11, 100_001])
        }
        DiscretisationSettings::Spectral {
            degree,
            per_piece,
            tolerance,
        } => {
            let section = Section("heart.discretisation.spectral");
            section.count("degree", degree, [4, 64])?;
            section.count("per_piece", per_piece, [1, 64])?;
            let size = outer.length + outer.radius;
            section.within("tolerance", tolerance, [1e-9 * size, 1e-2 * size])
        }
    }
}

fn cycle(cycle: &CycleSettings, rest: f64) -> Checked {
    let rate = cycle.beats_per_minute;
    within("cycle.beats_per_minute", rate, [1.0, 1000.0])?;
    if let Err(error) = Height::new(&cycle.curve, cycle.beats_per_minute) {
        let (field, given) = match &cycle.curve {
            VolumeCurve::Sampled(volumes) => (
                "cycle.curve.sampled",
                format!("an array of {} values", volumes.len()),
            ),
            _ => ("cycle.curve", "physiological".to_owned()),
        };
        return Err(fault(field, given, error.to_string()));
    }
    within("cycle.base_descent", cycle.base_descent, ranges::DESCENT)?;
    match cycle.volume {
        VolumeRange::Gain(gain) => within("cycle.volume.gain", gain, ranges::GAIN),
        VolumeRange::EjectionFraction(fraction) => {
            let field = "cycle.volume.ejection_fraction";
            within(field, fraction, ranges::EJECTION_FRACTION)
        }
        VolumeRange::Volumes { edv, esv } => {
            let section = Section("cycle.volume.volumes");
            let above = |name: &str, given: f64, least: f64, why: &str| {
                if given >= least {
                    Ok(())
                } else {
                    let wanted = format!("must be at least {}, {why}", Number(enough(least)));
                    Err(fault(&section.field(name), Number(given), wanted))
                }
            };
            above("esv", esv, rest, "the rest volume of heart.inner in mL")?;
            above("edv", edv, esv, "the end-systolic volume")?;
            section.within("edv", edv, [rest, rest * (1.0 + ranges::GAIN[1])])
        }
    }
}

fn pose(pose: &PoseSettings) -> Checked {
    if let Some(centre) = pose.centre {
        within("pose.centre", centre, PLACE)?;
    }
    for (field, angle) in [
        ("pose.turn_x", pose.turn_x),
        ("pose.turn_y", pose.turn_y),
        ("pose.turn_z", pose.turn_z),
    ] {
        within(field, angle, [-360.0, 360.0])?;
    }
    all_within("pose.shift", &pose.shift, PLACE)
}

/// Where anything may be along an axis.
const PLACE: [f64; 2] = [-ranges::SIZE[1], ranges::SIZE[1]];

fn defect(section: &Section<String>, defect: &DefectSettings) -> Checked {
    let ascending = |name: &str, [from, to]: [f64; 2], [low, high]: [f64; 2]| {
        if from >= low && from < to && to <= high {
            Ok(())
        } else {
            let (low, high) = (Number(low), Number(high));
            let wanted = format!("must be [from, to] with {low} <= from < to <= {high}");
            let given = format!("[{}, {}]", Number(from), Number(to));
            Err(fault(&section.field(name), given, wanted))
        }
    };
    ascending("layers", defect.layers, ranges::LAYER)?;
    ascending("s", defect.s, ranges::S)?;
    let azimuths = defect.azimuths_degrees;
    let from = azimuths[0];
    section.within("azimuths_degrees", from, [-360.0, 360.0])?;
    ascending("azimuths_degrees", azimuths, [from, from + 360.0])?;
    section.within("activity", defect.activity, ranges::DEFECT_ACTIVITY)
}

fn detector(scene: &Scene) -> Checked {
    let camera = &scene.camera;
    if let Some(blur) = scene.blur {
        // As `radon::Blur` has it: no wider than the smaller side that has more than one sample.
        let sides = [camera.bins, camera.rows].into_iter().zip(camera.pitch);
        let widths = (sides.filter(|(n, _)| *n > 1)).map(|(n, pitch)| n as f64 * pitch);
        let widest = widths.fold(ranges::SIZE[1], f64::min);
        within("blur.fwhm", blur.fwhm, [0.0, widest])?;
    }
    if let Some(collimator) = &scene.collimator {
        check_collimator(collimator)?;
        if scene.blur.is_some() {
            let wanted =
                "has no place beside [collimator], whose crystal is collimator.intrinsic_fwhm";
            return Err(fault("blur", "there", wanted));
        }
    }
    counts(scene)
}

fn counts(scene: &Scene) -> Checked {
    if let Some(counting) = &scene.counting {
        within("counting.sensitivity", counting.sensitivity, ranges::COUNTS)?;
        if let Decay::HalfLifeHours(hours) = counting.decay {
            let field = "counting.decay.half_life_hours";
            within(field, hours, Decay::HALF_LIVES)?;
        }
        match scene.acquisition.mode {
            Mode::Instants => {
                let wanted = "counts nothing, which [counting] needs: choose exposure, or another mode that lasts";
                return Err(fault("acquisition.mode", "instants", wanted));
            }
            Mode::Exposure { seconds } => {
                within("acquisition.mode.exposure.seconds", seconds, [1e-9, 1e9])?;
            }
            _ => {}
        }
    }
    let (field, mean) = match scene.noise.map(|noise| noise.counts) {
        None => return Ok(()),
        Some(Counts::Expected) if scene.counting.is_some() => return Ok(()),
        Some(Counts::Expected) => {
            let wanted = "needs a section [counting]";
            return Err(fault("noise.counts", "expected", wanted));
        }
        Some(Counts::PerUnit(mean)) => ("noise.counts.per_unit", mean),
        Some(Counts::Total(mean)) => ("noise.counts.total", mean),
    };
    if scene.counting.is_some() {
        let wanted = "must be expected beside [counting], which says how many counts there are";
        return Err(fault("noise.counts", Number(mean), wanted));
    }
    within(field, mean, ranges::COUNTS)
}

fn check_collimator(settings: &CollimatorSettings) -> Checked {
    let positive = [1e-6, 1e3];
    match settings.holes {
        HolesSettings::Parallel {
            diameter,
            length,
            attenuation,
        } => {
            let section = Section("collimator.holes.parallel");
            section.within("diameter", diameter, positive)?;
            section.within("length", length, positive)?;
            section.within("attenuation", attenuation, [1e-6, 1e6])?;
        }
        HolesSettings::Widths { slope, at_face } => {
            let section = Section("collimator.holes.widths");
            section.within("slope", slope, [0.0, 10.0])?;
            section.within("at_face", at_face, [0.0, 1e3])?;
        }
        HolesSettings::GeLehr | HolesSettings::GeLegp | HolesSettings::SiemensLehr => {}
    }
    let section = Section("collimator");
    section.within("intrinsic_fwhm", settings.intrinsic_fwhm, [0.0, 1e3])?;
    section.within("tolerance", settings.tolerance, ranges::BLUR_TOLERANCE)?;
    // What is left: holes that the septa leave no length.
    collimation_of(settings)
        .map(drop)
        .map_err(|error| fault("collimator.holes", "parallel", error.to_string()))
}

fn attenuation(settings: &AttenuationSettings) -> Checked {
    let coefficient = settings.coefficient;
    within("attenuation.coefficient", coefficient, ranges::ATTENUATION)?;
    match settings.medium {
        MediumSettings::Torso { centre, semi_axes } => {
            torso("attenuation.medium.torso", centre, semi_axes)
        }
        MediumSettings::Heart => Ok(()),
    }
}

fn organs(scene: &Scene) -> Checked {
    for (k, organ) in scene.organs.iter().enumerate() {
        let section = Section(format!("organs.{}", k + 1));
        match organ.shape {
            OrganShapeSettings::Cylinder { centre, semi_axes } => {
                torso(&section.field("shape.cylinder"), centre, semi_axes)?;
            }
            OrganShapeSettings::Ellipsoid { centre, semi_axes } => {
                torso(&section.field("shape.ellipsoid"), centre, semi_axes)?;
            }
        }
        section.within("activity", organ.activity, ranges::ACTIVITY)?;
        section.within("attenuation", organ.attenuation, ranges::ATTENUATION)?;
    }
    if let Some(chest) = scene.chest {
        for (field, activity) in [
            ("chest.trunk", chest.trunk),
            ("chest.lungs", chest.lungs),
            ("chest.liver", chest.liver),
            ("chest.spine", chest.spine),
        ] {
            within(field, activity, ranges::ACTIVITY)?;
        }
    }
    if scene.organs.is_empty() && scene.chest.is_none() {
        return Ok(());
    }
    if scene.background.is_some() {
        let wanted = "has no place beside [chest] or [[organs]]";
        return Err(fault("background", "there", wanted));
    }
    match scene.attenuates().map(|own| own.medium) {
        Some(MediumSettings::Heart) => Ok(()),
        Some(MediumSettings::Torso { .. }) => {
            let wanted =
                "must be heart beside [chest] or [[organs]], which have attenuations of their own";
            Err(fault("attenuation.medium", "torso", wanted))
        }
        None => {
            let wanted =
                "needs [attenuation] with medium = \"heart\" besides: what the heart attenuates";
            Err(fault("organs.1", "there", wanted))
        }
    }
}

fn torso<const N: usize>(name: &str, centre: [f64; N], semi_axes: [f64; N]) -> Checked {
    let section = Section(name);
    for (c, a) in centre.into_iter().zip(semi_axes) {
        section.within("centre", c, PLACE)?;
        section.within("semi_axes", a, ranges::SIZE)?;
    }
    Ok(())
}

/// The same of a scene as `check_gates` of parts.
fn one_file(scene: &Scene) -> Checked {
    let (output, mode) = (&scene.output, scene.acquisition.mode);
    if let Some((field, format)) = output.without_gates(mode) {
        let wanted = "cannot store all gates in one file: choose another, or gates = \"each\"";
        return Err(fault(field, spelled(format), wanted));
    }
    let turns = scene.camera.rotation == crate::Rotation::Continuous && mode.n_gates() > 1;
    if turns && output.one_file(mode) && output.has(Product::Projections) {
        let wanted = "must be each: a camera that turns sees each gate from other angles";
        return Err(fault("output.gates", "one-file", wanted));
    }
    Ok(())
}

fn output(output: &Output) -> Checked {
    let tolerance = output.mesh_tolerance;
    within("output.mesh_tolerance", tolerance, ranges::MESH_TOLERANCE)?;
    if output.projections.info().projections.is_none() {
        let names = formats(|info| info.projections.is_some());
        let wanted = format!("cannot store the angles of projections; choose one of {names}");
        let given = spelled(output.projections);
        return Err(fault("output.projections", given, wanted));
    }
    if output.write.contains(&Product::Motion) && !output.volumes.info().fields {
        let names = formats(|info| info.fields);
        let wanted = format!("cannot store the components of motion; choose one of {names}");
        return Err(fault("output.volumes", spelled(output.volumes), wanted));
    }
    for (k, product) in output.write.iter().enumerate() {
        if output.write[..k].contains(product) {
            let given = format!("{} twice", spelled(product));
            return Err(fault("output.write", given, "name each product once"));
        }
    }
    Ok(())
}
