//! What a scene may ask of time: modes, steps, gates, a camera that turns.

use super::Scene;
use super::fault::{Checked, count, fault, within};
use crate::scan::MAX_POINTS_OF_ALL;
use crate::scan::{Accuracy, Mode};
use crate::scan::{Camera, Rotation};
use crate::scene::build::{cycle_of, geometry_of};
use crate::text::enough;

/// Samples of all sets of views, or of all their volumes: 1 TiB of `f32`.
const MOST_SAMPLES_OF_ALL: f64 = 274_877_906_944.0;

pub(super) fn acquisition(scene: &Scene) -> Checked {
    let interval = scene.camera.seconds_per_view;
    match scene.acquisition.mode {
        Mode::Static { phase } => within("acquisition.mode.static.phase", phase, [0.0, 1.0])?,
        Mode::Exposure { seconds } => within(
            "acquisition.mode.exposure.seconds",
            seconds,
            [0.0, interval],
        )?,
        Mode::Gated { gates } => all_gates(scene, gates)?,
        Mode::Instants | Mode::WholeCycle => {}
    }
    match scene.acquisition.accuracy {
        Accuracy::Steps(steps) => {
            count("acquisition.accuracy.steps", steps, [2, 4096])?;
            if !steps.is_multiple_of(2) {
                return Err(fault("acquisition.accuracy.steps", steps, "must be even"));
            }
            Ok(())
        }
        Accuracy::Tolerance(tolerance) => {
            within("acquisition.accuracy.tolerance", tolerance, [1e-6, 1.0])
        }
    }
}

/// A view of a turning camera sees what comes in its time. Of a tolerance it is known at work only how many steps it takes.
pub(super) fn turning(scene: &Scene) -> Checked {
    let (field, interval) = ("camera.seconds_per_view", scene.camera.seconds_per_view);
    let refuse = |wanted: String| Err(fault(field, interval, wanted));
    // What is wrong with either of them has been said.
    let (Ok(cycle), Ok(camera)) = (cycle_of(scene), Camera::with_geometry(&geometry_of(scene)))
    else {
        return Ok(());
    };
    let (gates, period) = (scene.acquisition.mode.n_gates(), cycle.period());
    if camera.rotation() == Rotation::StepAndShoot {
        return Ok(());
    }
    if scene.acquisition.mode == Mode::WholeCycle && interval < period {
        return refuse(format!(
            "must be at least one beat, {} s, when a turning camera sees whole beats",
            enough(period)
        ));
    }
    let steps = match scene.acquisition.accuracy {
        Accuracy::Steps(steps) => steps,
        Accuracy::Tolerance(_) => 2,
    };
    for gate in 0..gates {
        let acquisition = scene.acquisition.mode.acquisition(gate, steps);
        if let Some(view_idx) = acquisition.unseen(&cycle, &camera) {
            return refuse(format!(
                "gate {gate} of {gates} does not come in the time of view {view_idx}; one beat, {} s, is always enough",
                enough(period)
            ));
        }
    }
    let points = scene
        .acquisition
        .mode
        .acquisition(0, steps)
        .points_of_all(&cycle, &camera);
    if points > MAX_POINTS_OF_ALL as f64 {
        return refuse(format!(
            "{points:e} points of its quadrature, seen by a turning camera, must be at most {MAX_POINTS_OF_ALL:e}"
        ));
    }
    Ok(())
}

fn all_gates(scene: &Scene, gates: usize) -> Checked {
    let field = "acquisition.mode.gated.gates";
    count(field, gates, [1, 1000])?;
    let camera = &scene.camera;
    let pixels = scene.reconstruction.pixels.unwrap_or(camera.bins) as f64;
    let each = (camera.views as f64 * camera.bins as f64).max(pixels * pixels) * camera.rows as f64;
    let samples = gates as f64 * each;
    if samples > MOST_SAMPLES_OF_ALL {
        let wanted = format!(
            "{gates} sets of views or volumes of {each:e} samples must be at most {MOST_SAMPLES_OF_ALL:e} samples"
        );
        return Err(fault(field, gates, wanted));
    }
    Ok(())
}
