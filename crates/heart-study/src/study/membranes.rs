//! Sections 2 to 4 and the appendix: reference configurations, the direct method, the circle.

use super::paper_newton::{PaperJacobian, paper_newton};
use super::run::Run;
use crate::figures::CircleStudy;
use crate::report::{self, Circle, Direct};
use heart_phantom::membrane_newton::membrane_forces::{FiniteDifferences, LinearEquilibrium};
use heart_phantom::membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, ReferenceShape, Solver,
};
use heart_phantom::{Balloon, PhantomError};

/// Pressures over stiffness of Fig. 8, in cm.
const PRESSURES: [f64; 6] = [0.0, 5.0, 10.0, 17.5, 30.0, 60.0];
/// Nodes, pressure and number of steps for the Jacobian as printed.
const PRINTED: (usize, f64, usize) = (201, 17.5, 60);
/// Tolerance of the runs with the two Jacobians.
const NEWTON_TOLERANCE: f64 = 1e-8;
/// Spectral elements for the mesh-independent values: one on the cylinder, one on half the cap.
const LIMIT: Discretisation = Discretisation::Spectral {
    degree: 20,
    per_piece: 1,
};
/// Numbers of nodes for the circle, each with half the spacing of the one before.
const CIRCLE_NODES: [usize; 8] = [11, 21, 41, 81, 161, 321, 641, 1281];
/// Radius of the disc and pressure over stiffness of the circle.
const CIRCLE: (f64, f64) = (1.0, 10.0);

/// The results of the direct method.
pub(super) struct DirectStudy {
    pub(super) figures: Direct,
    /// The inner balloon at several pressures (Fig. 8).
    pub(super) family: Vec<Equilibrium>,
    /// Newton residuals with the printed and the corrected Jacobian.
    pub(super) histories: [Vec<f64>; 2],
}

/// Reference configurations of Table 1: length, area and volume of the polygon, and closed forms.
pub(super) fn reference(run: &Run<'_>) -> Result<report::Reference, PhantomError> {
    let pair = run.phantom.heart().pair();
    let measure = |solver: &Solver, balloon: Balloon| -> Result<_, PhantomError> {
        let discrete = solver.start_measures();
        let exact =
            LinearEquilibrium::balloon(balloon.length, balloon.radius, 0.0, 1.0)?.measures();
        Ok(report::ReferenceShape {
            length: discrete.length,
            area: discrete.area,
            volume: discrete.volume,
            length_exact: exact.length,
            area_exact: exact.area,
            volume_exact: exact.volume,
        })
    };
    Ok(report::Reference {
        inner: measure(pair.inner(), Balloon::INNER)?,
        outer: measure(pair.outer(), Balloon::OUTER)?,
    })
}

/// The direct method (section 3.1) on the pair and on the inner balloon alone.
pub(super) fn direct(run: &Run<'_>) -> Result<DirectStudy, PhantomError> {
    let options = NewtonOptions::default();
    let dilated = run.phantom.heart().shapes(&[run.options.gain])?.remove(0);
    let solution = dilated.solution();
    let limit = limit(run.options.gain)?;
    let inner = run.phantom.heart().pair().inner();
    let family = PRESSURES
        .iter()
        .map(|&load| inner.solve(Control::Intensity(load), &options))
        .collect::<Result<_, _>>()?;

    let (nodes, pressure, steps) = PRINTED;
    let coarse = FiniteDifferences::new(&Balloon::INNER.membrane()?, nodes)?;
    let history = |jacobian| paper_newton(&coarse, pressure, jacobian, steps, NEWTON_TOLERANCE);
    let printed = history(PaperJacobian::AsPrinted);
    let right = history(PaperJacobian::Exact);
    Ok(DirectStudy {
        figures: Direct {
            f_inner: solution.inner.intensity,
            f_outer: solution.outer.intensity,
            newton_iterations: solution.report.iterations,
            residual: solution.report.residual,
            v_inner: solution.inner.measures.volume,
            v_outer: solution.outer.measures.volume,
            wall_volume_error: solution.wall_volume_error,
            limit,
            printed_jacobian_residual_after_60: printed[printed.len() - 1],
            newton_history: right.clone(),
        },
        family,
        histories: [printed, right],
    })
}

/// The pair at a gain in the limit of fine meshes.
fn limit(gain: f64) -> Result<report::Limit, PhantomError> {
    let solver = |balloon: Balloon| -> Result<Solver, PhantomError> {
        Ok(Solver::new(&balloon.membrane()?, LIMIT)?)
    };
    let pair = Pair::new(solver(Balloon::INNER)?, solver(Balloon::OUTER)?)?;
    let solution = pair.solve_gain(gain, &NewtonOptions::default())?;
    Ok(report::Limit {
        f_inner: solution.inner.intensity,
        f_outer: solution.outer.intensity,
        wall_volume_error: solution.wall_volume_error,
    })
}

/// The circle of the appendix: discrete equilibria of an inflated disc against the closed form.
pub(super) fn circle() -> Result<CircleStudy, PhantomError> {
    let (radius, load) = CIRCLE;
    let exact = LinearEquilibrium::circle(radius, load)?;
    let membrane = Membrane::new(ReferenceShape::disc(radius)?);
    let mut errors = Vec::new();
    let mut shown = (Vec::new(), Vec::new());
    for nodes in CIRCLE_NODES {
        let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes })?;
        let solution = solver.solve(Control::Intensity(load), &NewtonOptions::default())?;
        let points = solution.points();
        let distances = points.iter().enumerate().map(|(n, [x, y])| {
            let at = exact.at(n as f64 / (nodes - 1) as f64).position;
            (x - at[0]).hypot(y - at[1])
        });
        errors.push(distances.fold(0.0, f64::max));
        if nodes == CIRCLE_NODES[1] {
            shown = (solver.start().points(), points);
        }
    }
    let apex = exact.at(0.5).position;
    let arc_radius = radius / (0.5 * exact.kappa()).sin();
    Ok(CircleStudy {
        initial: shown.0,
        solution: shown.1,
        centre: [apex[0] - arc_radius, 0.0],
        radius: arc_radius,
        n_nodes: CIRCLE_NODES.to_vec(),
        errors,
    })
}

/// The numbers of the circle.
pub(super) fn of_circle(study: &CircleStudy) -> Circle {
    let errors = study.errors.clone();
    let last = errors.len() - 1;
    Circle {
        nodes: study.n_nodes.clone(),
        order: (errors[last - 1] / errors[last]).log2(),
        errors,
    }
}
