//! Continuation and direct solves of springs and rubber: what their reports count, and where they end.

use std::f64::consts::TAU;

use membrane_newton::membrane_forces::LinearEquilibrium;
use membrane_newton::{
    Control, CurvePoint, Discretisation, Membrane, NewtonError, NewtonOptions, ReferenceShape,
    Rubber, Solver, Stiffness, StopReason, StrainEnergy, Thickness,
};

const SPECTRAL: Discretisation = Discretisation::Spectral {
    degree: 16,
    per_piece: 1,
};

/// Springs of stiffness 1 + `amplitude` cos(2 pi s).
fn springs(rest: ReferenceShape, amplitude: f64) -> Membrane {
    let stiffness = Stiffness::function(move |s| 1.0 + amplitude * (TAU * s).cos(), &[]);
    Membrane::new(rest).with_stiffness(stiffness.unwrap())
}

fn disc(amplitude: f64) -> Membrane {
    springs(ReferenceShape::disc(1.0).unwrap(), amplitude)
}

/// A walk ends at its control: it needs all of its steps, and no other ones; with fewer steps the error reports those that were allowed, and
/// that they are used up.
#[test]
fn a_walk_takes_as_many_steps_as_it_needs() {
    let options = NewtonOptions::default();
    let solver = Solver::new(&disc(0.3), SPECTRAL).unwrap();
    let area = Control::Area(100.0);
    let solved = solver.solve(area, &options).unwrap();
    let steps = solved.report.load_steps;
    // a quarter, then twice as far each time, needs at least three
    assert!((3..30).contains(&steps), "{steps}");
    let enough = options.with_max_load_steps(steps);
    assert_eq!(solver.solve(area, &enough), Ok(solved));
    for few in 1..steps {
        let error = solver.solve(area, &options.with_max_load_steps(few));
        let (NewtonError::OtherBranch { report } | NewtonError::LimitPoint { report, .. }) =
            error.unwrap_err()
        else {
            panic!("{few} steps are not enough");
        };
        assert_eq!(report.stopped_by, Some(StopReason::LoadSteps));
        assert_eq!(report.load_steps, few);
    }
}

/// A flat disc becomes most of a circle, which turns by up to nearly a whole turn more, without continuation.
#[test]
fn a_disc_becomes_a_circle_directly() {
    let solver = Solver::new(&disc(0.0), SPECTRAL).unwrap();
    for load in [5.0, 10.0, 30.0, 100.0] {
        let solved = solver.solve(Control::Load(load), &NewtonOptions::default());
        let solved = solved.unwrap();
        assert_eq!(solved.report.load_steps, 0);
        let circle = LinearEquilibrium::circle(1.0, load).unwrap();
        let [x, y] = circle.at(0.25).position;
        let found = solved.at(0.25).position;
        // polynomials of degree 16 on half of the circle
        let off = (found[0] - x).hypot(found[1] - y) / solved.measures.length;
        assert!(off < 1e-7, "{load}: {off:e}");
    }
}

/// With loose tolerances a last Newton step meets the control. It has a factorisation and two residuals, as each of the others has a factorisation
/// and at least one residual; there are the residual of the start and two for the error by rounding.
#[test]
fn the_step_that_meets_the_control_is_counted() {
    let solver = Solver::new(&disc(0.0), SPECTRAL).unwrap();
    for tolerance in [1e-5, 1e-7] {
        let options = NewtonOptions::default().with_tolerances(tolerance, tolerance);
        let solved = solver.solve(Control::Volume(3.0), &options).unwrap();
        assert!((solved.measures.volume / 3.0 - 1.0).abs() < 1e-12);
        let report = solved.report;
        assert!(report.factorisations >= report.iterations, "{report:?}");
        assert!(
            report.residual_calls >= 1 + (report.iterations - 1) + 2 + 2,
            "{report:?}"
        );
    }
}

/// No total force is no intensity, also from an equilibrium under a load.
#[test]
fn a_total_force_of_zero_is_the_start() {
    let options = NewtonOptions::default();
    for how in [SPECTRAL, Discretisation::FiniteDifferences { nodes: 61 }] {
        let solver = Solver::new(&disc(0.0), how).unwrap();
        let loaded = solver.solve(Control::Load(0.5), &options).unwrap();
        let released = solver.solve_from(&loaded, Control::TotalForce(0.0), &options);
        let (released, start) = (released.unwrap(), solver.start());
        for (a, b) in released.points().iter().zip(start.points()) {
            // steps of 1e-14
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-13);
        }
        assert!(released.intensity.abs() < 1e-13);
    }
}

/// Flat springs between displaced ends have no volume; a solve from their equilibrium is that equilibrium, without iterations.
#[test]
fn a_flat_equilibrium_is_a_start() {
    let options = NewtonOptions::default();
    let drawn = disc(0.5).with_ends([[0.0, 1.5], [0.0, -1.5]]).unwrap();
    for how in [SPECTRAL, Discretisation::FiniteDifferences { nodes: 61 }] {
        let solver = Solver::new(&drawn, how).unwrap();
        let flat = solver.solve(Control::Load(0.0), &options).unwrap();
        assert_eq!(flat.measures.volume, 0.0);
        assert!(flat.report.iterations > 0);
        // the equilibrium has the rounding of the equations
        let options = options.with_tolerances(1e-15, 2.0 * flat.report.iteration_error);
        let again = solver.solve_from(&flat, Control::Load(0.0), &options);
        let report = again.unwrap().report;
        assert_eq!(report.iterations, 0, "{report:?}");
    }
}

/// Polynomials of degree 16 start from the solution of those of degree 8, whose residuals are the first of the report, and need few iterations more.
#[test]
fn rubber_starts_from_polynomials_of_half_the_degree() {
    let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    for (rest, volume) in [
        (ReferenceShape::disc(1.0).unwrap(), 1.2),
        (ReferenceShape::balloon(3.0, 1.0).unwrap(), 20.0),
    ] {
        let membrane = Membrane::new(rest).with_rubber(rubber.clone());
        let history = |degree| {
            let how = Discretisation::Spectral {
                degree,
                per_piece: 1,
            };
            let solver = Solver::new(&membrane, how).unwrap();
            let solved = solver.solve(Control::Volume(volume), &NewtonOptions::default());
            solved.unwrap().report.history
        };
        let (coarse, fine) = (history(8), history(16));
        assert!(fine.starts_with(&coarse));
        // the residual of the carried state, and after each of at most three iterations
        assert!((1..=4).contains(&(fine.len() - coarse.len())));
    }
}

/// A tail equal to the tolerance is within it: a half ellipse whose curvature jumps at no breakpoint is resolved to the tail of its finest elements,
/// and no further.
#[test]
fn a_curve_is_resolved_to_its_tail() {
    let kinked = |s: f64| {
        let (half, jump) = (0.5 * TAU, s - 0.2371);
        let (sin, cos) = (half * s).sin_cos();
        CurvePoint {
            position: [sin + 0.05 * jump * jump.abs(), cos],
            first: [half * cos + 0.1 * jump.abs(), -half * sin],
            second: [-half * half * sin + 0.1 * jump.signum(), -half * half * cos],
        }
    };
    let membrane = Membrane::new(ReferenceShape::from_function(kinked, &[]).unwrap());
    let solver = |tolerance| Solver::new(&membrane, Discretisation::SpectralAdaptive { tolerance });
    let Err(NewtonError::Unresolved { tail, .. }) = solver(1e-12) else {
        panic!("a kink is not resolved");
    };
    assert!(solver(tail).is_ok());
    let less = solver(tail.next_down());
    assert!(
        matches!(less, Err(NewtonError::Unresolved { .. })),
        "{less:?}"
    );
}
