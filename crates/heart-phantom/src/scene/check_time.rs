//! Validation of the section `[acquisition]` and of everything in real time: R-R intervals, respiration, continuous rotation.

use super::Scene;
use super::finding::Check;
use crate::error::PhantomError;
use crate::phantom::Needs;
use crate::ranges;
use crate::scan::{Acquisition, Interpolation, POINTS};
use crate::text::{Number, enough};
use crate::{Accuracy, Camera, Cycle, Mode, Rotation};

/// Largest number of samples of all gated projection sets or volumes: 1 TiB of `f32`.
const MOST_SAMPLES_OF_ALL: f64 = 274_877_906_944.0;

pub(super) fn acquisition(scene: &Scene, c: &mut Check) {
    c.at("acquisition.mode", |c| match scene.acquisition.mode {
        Mode::Static { phase } => c.within("static.phase", phase, [0.0, 1.0]),
        Mode::Exposure { seconds } => {
            let interval = scene.camera.seconds_per_view;
            if !(0.0..=interval).contains(&seconds) {
                let most = Number(interval);
                let wanted = format!("must be between 0 and camera.seconds_per_view, {most}");
                c.fault("exposure.seconds", Number(seconds), wanted);
            }
        }
        Mode::Gated { gates } => c.count("gated.gates", gates, ranges::GATES),
        Mode::Instants | Mode::WholeCycle => {}
    });
    if c.is_clean(&[
        "acquisition.mode",
        "breathing",
        "camera",
        "reconstruction.pixels",
    ]) {
        all_gates(scene, c);
    }
    c.at("acquisition.accuracy", |c| {
        match scene.acquisition.accuracy {
            Accuracy::Steps(steps) => {
                c.count("steps", steps, ranges::STEPS);
                if !steps.is_multiple_of(2) {
                    c.fault("steps", steps, "must be even");
                }
            }
            Accuracy::Tolerance(tolerance) => {
                c.within("tolerance", tolerance, ranges::VIEW_TOLERANCE);
            }
        }
    });
}

/// Validates that every gate occurs during every view. The number of steps of a tolerance is unknown here.
pub(super) fn in_real_time(scene: &Scene, cycle: &Cycle, camera: &Camera, c: &mut Check) {
    if camera.rotation() == Rotation::StepAndShoot && !cycle.in_real_time() {
        return;
    }
    let (mode, interval) = (scene.acquisition.mode, scene.camera.seconds_per_view);
    let steps = match scene.acquisition.accuracy {
        Accuracy::Steps(steps) => steps,
        Accuracy::Tolerance(_) => 2,
    };
    // Other products do not depend on the angles of the camera.
    let rotation = match scene.output.needs(Needs::Views) {
        true => camera.rotation(),
        false => Rotation::StepAndShoot,
    };
    let responds = scene.has_response();
    let beat = enough(cycle.period());
    let gates = mode.n_gates() * cycle.breath_gates();
    for gate in 0..gates {
        let acquisition = Acquisition::new(mode, gate, steps).behind(responds, camera);
        let found = acquisition.validate(cycle, camera, rotation);
        let too_short = matches!(found, Err(PhantomError::EmptyView { .. }));
        let wanted = match found {
            Ok(()) => continue,
            Err(PhantomError::Count { what, .. })
                if what == POINTS && acquisition.interpolation == Interpolation::Polynomial =>
            {
                let wanted = "must be smaller: the views would need too many images of the heart";
                return c.fault("acquisition.accuracy.steps", steps, wanted);
            }
            Err(PhantomError::OutOfRange { .. }) => {
                format!(
                    "must be at least one cardiac cycle, {beat} s, for whole cycles with continuous rotation"
                )
            }
            Err(PhantomError::EmptyView { view_idx, .. }) if cycle.in_real_time() => {
                let time = match scene.beats.as_ref().and_then(|beats| beats.accepted) {
                    Some(_) => "the time that beats.accepted leaves of",
                    None => "the time of",
                };
                format!("gate {gate} of {gates} does not occur in {time} view {view_idx}")
            }
            Err(PhantomError::EmptyView { gate, view_idx }) => format!(
                "gate {gate} of {gates} does not occur during view {view_idx}; one cardiac cycle, {beat} s, is always sufficient"
            ),
            Err(PhantomError::Count {
                what, given, most, ..
            }) => {
                format!("in real time there are {given:e} {what}; the limit is {most:e}")
            }
            Err(other) => other.to_string(),
        };
        return match (mode, too_short) {
            (Mode::Exposure { seconds }, true) => {
                c.fault("acquisition.mode.exposure.seconds", seconds, wanted)
            }
            _ => c.fault("camera.seconds_per_view", interval, wanted),
        };
    }
}

fn all_gates(scene: &Scene, c: &mut Check) {
    let breathing = (scene.breathing.as_ref()).and_then(|breathing| breathing.gates);
    let (field, respiratory) = match breathing {
        None => ("acquisition.mode.gated.gates", 1),
        Some(gates) => ("breathing.gates", gates.count()),
    };
    let gates = scene.acquisition.mode.n_gates() * respiratory;
    let camera = &scene.camera;
    let pixels = scene.reconstruction.pixels.unwrap_or(camera.bins) as f64;
    let views = camera.views as f64 * camera.heads.count() as f64;
    let each = (views * camera.bins as f64).max(pixels * pixels) * camera.rows as f64;
    let samples = gates as f64 * each;
    if gates > 1 && samples > MOST_SAMPLES_OF_ALL {
        let wanted = format!(
            "{gates} gated projection sets or volumes of {each:e} samples exceed the limit of {MOST_SAMPLES_OF_ALL:e} samples"
        );
        c.fault(field, gates, wanted);
    }
}
