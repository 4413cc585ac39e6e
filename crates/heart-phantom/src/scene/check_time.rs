//! What a scene may ask of time: modes, steps, gates, a camera that turns.

use super::Scene;
use super::fault::{Checked, Section, count, fault, within};
use crate::error::PhantomError;
use crate::ranges;
use crate::scan::{Accuracy, Camera, Mode, Rotation};
use crate::scene::build::{cycle_of, geometry_of, heads_of};
use crate::text::enough;

/// Samples of all sets of views, or of all their volumes: 1 TiB of `f32`.
const MOST_SAMPLES_OF_ALL: f64 = 274_877_906_944.0;

pub(super) fn acquisition(scene: &Scene) -> Checked {
    let interval = scene.camera.seconds_per_view;
    match scene.acquisition.mode {
        Mode::Static { phase } => within("acquisition.mode.static.phase", phase, [0.0, 1.0])?,
        Mode::Exposure { seconds } => {
            Section("acquisition.mode.exposure").within("seconds", seconds, [0.0, interval])?;
        }
        Mode::Gated { gates } => count("acquisition.mode.gated.gates", gates, ranges::GATES)?,
        Mode::Instants | Mode::WholeCycle => {}
    }
    all_gates(scene)?;
    match scene.acquisition.accuracy {
        Accuracy::Steps(steps) => {
            count("acquisition.accuracy.steps", steps, ranges::STEPS)?;
            if !steps.is_multiple_of(2) {
                return Err(fault("acquisition.accuracy.steps", steps, "must be even"));
            }
            Ok(())
        }
        Accuracy::Tolerance(tolerance) => {
            let field = "acquisition.accuracy.tolerance";
            within(field, tolerance, ranges::VIEW_TOLERANCE)
        }
    }
}

/// A view of a turning camera sees what comes in its time. Of a tolerance it is known at work only how many steps it takes.
pub(super) fn turning(scene: &Scene, rest: f64) -> Checked {
    // What is wrong with either of them has been said.
    let (Ok(cycle), Ok(camera)) = (
        cycle_of(scene, rest),
        Camera::with_geometry(&geometry_of(scene)),
    ) else {
        return Ok(());
    };
    if camera.rotation() == Rotation::StepAndShoot && !cycle.in_real_time() {
        return Ok(());
    }
    let (mode, interval) = (scene.acquisition.mode, scene.camera.seconds_per_view);
    let steps = match scene.acquisition.accuracy {
        Accuracy::Steps(steps) => steps,
        Accuracy::Tolerance(_) => 2,
    };
    let beat = enough(cycle.period());
    let (cardiac, gates) = (mode.n_gates(), mode.n_gates() * cycle.breath_gates());
    (0..gates).try_for_each(|gate| {
        let cycle = cycle.clone().in_breath_gate(gate / cardiac);
        let acquisition = mode.acquisition(gate % cardiac, steps);
        let seen = acquisition.validate(&cycle, &camera);
        let wanted = match seen {
            Ok(()) => return Ok(()),
            Err(PhantomError::OutOfRange { .. }) => {
                format!("must be at least one beat, {beat} s, when a turning camera sees whole beats")
            }
            Err(PhantomError::Unseen { view_idx, .. }) if cycle.in_real_time() => format!(
                "gate {gate} of {gates} does not come in the time of view {view_idx}, of beats that count and of breaths"
            ),
            Err(PhantomError::Unseen { gate, view_idx }) => format!(
                "gate {gate} of {gates} does not come in the time of view {view_idx}; one beat, {beat} s, is always enough"
            ),
            Err(PhantomError::Count { given, most, .. }) => format!(
                "{given:e} points of its quadrature, seen in real time, must be at most {most:e}"
            ),
            Err(other) => other.to_string(),
        };
        Err(fault("camera.seconds_per_view", interval, wanted))
    })
}

fn all_gates(scene: &Scene) -> Checked {
    let breathing = scene
        .breathing
        .as_ref()
        .and_then(|breathing| breathing.gates);
    let (field, respiratory) = match breathing {
        None => ("acquisition.mode.gated.gates", 1),
        Some(gates) => ("breathing.gates", gates.count()),
    };
    let gates = scene.acquisition.mode.n_gates() * respiratory;
    let camera = &scene.camera;
    let pixels = scene.reconstruction.pixels.unwrap_or(camera.bins) as f64;
    let views = camera.views as f64 * heads_of(camera.heads).count() as f64;
    let each = (views * camera.bins as f64).max(pixels * pixels) * camera.rows as f64;
    let samples = gates as f64 * each;
    if gates > 1 && samples > MOST_SAMPLES_OF_ALL {
        let wanted = format!(
            "{gates} sets of views or volumes of {each:e} samples must be at most {MOST_SAMPLES_OF_ALL:e} samples"
        );
        return Err(fault(field, gates, wanted));
    }
    Ok(())
}
