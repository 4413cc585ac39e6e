//! The evolving method (section 3.2): the inner balloon inflated in time by the total force of its equilibrium in the direct
//! method.

use super::run::Run;
use crate::report::Evolving;
use heart_phantom::membrane_implicit::{Evolution, EvolvingOptions, Frame, Jacobian, evolve};
use heart_phantom::membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, Solver, Stiffness,
};
use heart_phantom::{Balloon, PhantomError};

/// Nodes of the evolving membrane, as in the figures of the paper.
const NODES: usize = 201;
/// Time steps: one with a monotone norm of the forces, one without, and one for the run with the rank-one term, for which large
/// steps approach Newton's method.
const STEPS: [f64; 3] = [2.0, 0.5, 1000.0];
/// Stiffness of the springs to the second neighbours in the run with second neighbours.
const SECOND_NEIGHBOURS: f64 = 0.1;
/// Panels of Fig. 9.
const N_FRAMES: usize = 4;

/// The results of the evolving method.
pub(super) struct EvolvingStudy {
    pub(super) figures: Evolving,
    /// Frames of the monotone run (Fig. 9).
    pub(super) frames: Vec<Frame>,
    /// Norms by iteration (Fig. 10).
    pub(super) histories: Vec<(&'static str, Vec<f64>)>,
}

/// Runs both methods on the same mesh at the gain of the study, and with second neighbours, which the direct method does not have.
pub(super) fn evolving(run: &Run<'_>) -> Result<EvolvingStudy, PhantomError> {
    let membrane = Balloon::INNER.membrane()?;
    let solver = Solver::new(
        &membrane,
        Discretisation::FiniteDifferences { nodes: NODES },
    )?;
    let direct = solver.solve(
        Control::VolumeGain(run.options.gain),
        &NewtonOptions::default(),
    )?;
    let force = direct.intensity * direct.measures.surface;

    let options = EvolvingOptions::default().with_jacobian(Jacobian::Band);
    let inflate = |membrane: &Membrane, options: &EvolvingOptions| -> Result<_, PhantomError> {
        Ok(evolve(membrane, NODES, force, options)?)
    };
    let [large, small, huge] = STEPS;
    let falling = inflate(&membrane, &options.clone().with_dt(large))?;
    let oscillating = inflate(&membrane, &options.clone().with_dt(small))?;
    let rank_one = options.clone().with_dt(huge).with_jacobian(Jacobian::Exact);
    let exact = inflate(&membrane, &rank_one)?;
    let stiffer = membrane
        .clone()
        .with_second_neighbours(Stiffness::constant(SECOND_NEIGHBOURS)?);
    let second = inflate(&stiffer, &options.with_dt(large))?;

    Ok(EvolvingStudy {
        figures: Evolving {
            dt: large,
            steps: falling.steps,
            residual: falling.residual(),
            monotone: falling.is_monotone(),
            distance_to_direct: falling.distance_to(&direct.points())?,
            small_step_monotone: oscillating.is_monotone(),
            second_neighbours_distance: second.distance_to(&direct.points())?,
        },
        frames: some_frames(&falling),
        histories: vec![
            ("time step 2", falling.norms),
            ("time step 2, with second neighbours", second.norms),
            ("time step 1000, with the rank-one term", exact.norms),
            ("time step 0.5", oscillating.norms),
        ],
    })
}

/// The first frames, where the shape changes most, and the last.
fn some_frames(evolution: &Evolution) -> Vec<Frame> {
    let n = evolution.frames.len();
    (0..n.min(N_FRAMES))
        .map(|k| if k + 1 < N_FRAMES { k } else { n - 1 })
        .map(|k| evolution.frames[k].clone())
        .collect()
}
