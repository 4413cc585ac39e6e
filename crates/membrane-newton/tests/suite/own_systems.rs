//! Equations of a caller: they combine with the errors of the crates, may be boxed, may return their own errors, and can be stopped.

use std::error::Error;
use std::ops::ControlFlow;

use membrane_forces::{
    DiscreteMembrane, FiniteDifferences, Measure, Membrane, MembraneError, ReferenceShape,
};
use membrane_newton::membrane_forces::Tangent;
use membrane_newton::{
    BandMatrix, BandedLu, Border, Control, Discretisation, LineSearch, NewtonError, NewtonOptions,
    NewtonReport, NewtonScratch, ResidualSystem, Solver, StopReason, newton, newton_with,
};

use crate::reports::root;
use crate::scalar::Scalar;

/// A balloon under a spring-loaded lid: its intensity is `fill` / volume, as of a gas.
struct Gas<'a> {
    forces: &'a FiniteDifferences,
    fill: f64,
    elastic: Vec<f64>,
    tangent: Tangent,
    lu: BandedLu,
    border: Border,
    /// Iterations, residual and unknowns after each iteration, and the number at which the solve ends.
    seen: Vec<(usize, f64, Vec<f64>)>,
    most: usize,
}

impl<'a> Gas<'a> {
    fn new(forces: &'a FiniteDifferences, fill: f64) -> Self {
        let tangent = forces.tangent();
        Self {
            forces,
            fill,
            elastic: vec![0.0; tangent.band.len()],
            lu: BandedLu::for_matrix(&tangent.band),
            border: Border::new(tangent.band.len()),
            tangent,
            seen: Vec::new(),
            most: usize::MAX,
        }
    }
}

impl ResidualSystem for Gas<'_> {
    fn len(&self) -> usize {
        self.elastic.len()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        let volume = self.forces.measure(Measure::Volume, x)?;
        self.forces.elastic_force_into(x, &mut self.elastic);
        self.forces
            .pressure_force_into(x, self.fill / volume, out)?;
        for (out, elastic) in out.iter_mut().zip(&self.elastic) {
            *out += elastic;
        }
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let Self {
            forces,
            tangent,
            lu,
            border,
            ..
        } = self;
        let volume = forces.measure(Measure::Volume, x)?;
        let intensity = self.fill / volume;
        forces.tangent_into(x, intensity, tangent)?;
        // plus n (x) (-fill / V^2 grad V)
        let (column, row) = border.column_and_row_mut();
        forces.pressure_force_into(x, 1.0, column)?;
        forces.measure_gradient_into(Measure::Volume, x, row);
        for &held in forces.fixed() {
            row[held] = 0.0;
        }
        row.iter_mut().for_each(|g| *g *= -intensity / volume);
        lu.factor(&tangent.band)?;
        border.eliminate(-1.0, |column| lu.solve_into(column))
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        self.lu.solve_into(rhs)?;
        self.border.correct(rhs, 0.0).map(drop)
    }

    fn observe(&mut self, report: &NewtonReport, x: &[f64]) -> ControlFlow<()> {
        self.seen
            .push((report.iterations, report.residual, x.to_vec()));
        if self.seen.len() == self.most {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |m: f64, r| m.max(r.abs())) / 20.0
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        step.iter().fold(0.0, |m: f64, s| m.max(s.abs())) / 20.0
    }
}

fn balloon() -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
}

/// f V = 1500 has one shape; the crate's own solver finds its intensity under the same volume. Boxed, by reference and by value the results are
/// bitwise identical.
#[test]
fn custom_forces_compose_and_may_be_boxed() {
    let forces = FiniteDifferences::new(&balloon(), 101).unwrap();
    let options = NewtonOptions::default();
    let mut plain = forces.start().to_vec();
    let report = newton(&mut Gas::new(&forces, 1500.0), &mut plain, &options).unwrap();
    // quadratic: an error in the rank-one part or in the border would cause linear convergence
    assert!(report.iterations <= 6, "{report:?}");

    let volume = forces.measure(Measure::Volume, &plain).unwrap();
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 101 }).unwrap();
    let solved = solver.solve(Control::Volume(volume), &options).unwrap();
    // both stop at corrections of 1e-14 of the size
    assert!((solved.intensity * volume / 1500.0 - 1.0).abs() < 1e-10);

    let mut boxed: Box<dyn ResidualSystem> = Box::new(Gas::new(&forces, 1500.0));
    let mut x = forces.start().to_vec();
    newton(boxed.as_mut(), &mut x, &options).unwrap();
    assert_eq!(x, plain);
    let mut x = forces.start().to_vec();
    let by_reference: &mut dyn ResidualSystem = &mut Gas::new(&forces, 1500.0);
    newton_with(
        by_reference,
        &mut x,
        &options,
        &mut NewtonScratch::default(),
    )
    .unwrap();
    assert_eq!(x, plain);
    assert!(!boxed.is_empty() && boxed.len() == 202);
}

/// Solving is an error before the first factorisation and after a failed one.
#[test]
fn an_unfactored_system_is_an_error() {
    let forces = FiniteDifferences::new(&balloon(), 11).unwrap();
    let mut gas = Gas::new(&forces, 1500.0);
    let solve = |gas: &mut Gas<'_>| gas.solve_in_place(&mut [1.0; 22]);
    assert_eq!(solve(&mut gas), Err(NewtonError::NotFactored));
    gas.factor(forces.start()).unwrap();
    assert_eq!(solve(&mut gas), Ok(()));

    let mut zeros = BandMatrix::zeros(2, 1, 1).unwrap();
    let mut lu = BandedLu::for_matrix(&zeros);
    for i in 0..2 {
        zeros.add(i, i, 1.0).unwrap();
    }
    let unfactored = Err(NewtonError::NotFactored);
    assert_eq!(lu.solve_into(&mut [1.0; 2]), unfactored);
    assert_eq!(lu.factor(&zeros), Ok(()));
    assert_eq!(lu.solve_into(&mut [1.0; 2]), Ok(()));
    assert!(matches!(
        lu.solve_into(&mut [1.0; 3]),
        Err(NewtonError::Membrane(MembraneError::WrongLength {
            given: 3,
            ..
        }))
    ));
    zeros.clear();
    assert!(matches!(
        lu.factor(&zeros),
        Err(NewtonError::Singular { row: 0, pivot: 0.0 })
    ));
    assert_eq!(lu.solve_into(&mut [1.0; 2]), unfactored);
    assert_eq!(lu.determinant_sign(), 0.0);
    let mut border = Border::new(2);
    let solve = |column: &mut [f64]| {
        column.fill(1.0);
        Ok(())
    };
    let is_eliminated =
        |border: &Border| border.correct(&mut [0.0; 2], 0.0) != Err(NewtonError::NotFactored);
    assert!(!is_eliminated(&border) && border.sign() == 0.0);
    border.eliminate(1.0, solve).unwrap();
    assert_eq!((border.solved(), border.sign()), (&[1.0, 1.0][..], 1.0));
    assert!(is_eliminated(&border));
    border.column_and_row_mut().1[0] = 1.0;
    assert!(!is_eliminated(&border));
    let singular = border.eliminate(1.0, solve);
    assert!(matches!(singular, Err(NewtonError::Singular { .. })));
    assert!(!is_eliminated(&border));
    let failing = |_: &mut [f64]| Err(NewtonError::NotFactored);
    assert_eq!(border.eliminate(0.5, failing), unfactored);
    border.eliminate(0.5, solve).unwrap();
    let refused = border.correct(&mut [0.0], 0.0);
    let (given, expected) = (1, 2);
    let what = "unknowns within a border";
    let expected = NewtonError::Membrane(MembraneError::WrongLength {
        what,
        given,
        expected,
    });
    assert_eq!(refused, Err(expected));
}

#[derive(Debug, PartialEq)]
struct Unplugged(usize);

impl std::fmt::Display for Unplugged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "sensor {} is unplugged", self.0)
    }
}

impl Error for Unplugged {}

/// An error of the caller ends the solve and is accessible as the source; a state without forces only shortens the step.
#[test]
fn custom_errors_end_the_solve() {
    // x^2 = 2 by a system that fails at a given call
    let run = |at, how: fn() -> NewtonError| {
        let mut calls = 0;
        let residual = |x: f64| {
            calls += 1;
            if calls == at {
                return Err(how());
            }
            Ok(x * x - 2.0)
        };
        let mut system = Scalar::new(residual, |x| 2.0 * x);
        let mut x = [1.0];
        let outcome = newton(&mut system, &mut x, &NewtonOptions::default());
        (outcome, system.residuals, x[0])
    };
    for at in 1..=4 {
        let (outcome, calls, _) = run(at, || NewtonError::user(Unplugged(3)));
        let error = outcome.unwrap_err();
        assert_eq!(calls, at);
        let source = error.source().and_then(|source| source.downcast_ref());
        assert_eq!(source, Some(&Unplugged(3)));
        assert_eq!(
            chain(&error),
            "the caller's own equations failed: sensor 3 is unplugged"
        );
        assert_eq!(error, error.clone());
        assert_ne!(error, NewtonError::user(Unplugged(3)));
    }
    let index = 7;
    let nowhere: fn() -> NewtonError = || MembraneError::CoincidentPoints { index: 7 }.into();
    let (outcome, calls, x) = run(2, nowhere);
    assert!(outcome.is_ok() && calls > 4 && (x - 2f64.sqrt()).abs() < 1e-14);
    let (outcome, ..) = run(1, nowhere);
    let error = outcome.unwrap_err();
    let expected = MembraneError::CoincidentPoints { index };
    assert_eq!(error, NewtonError::Membrane(expected));
    assert_eq!(error.to_string(), expected.to_string());
}

/// The printed report of an error: each message of the chain once.
fn chain(error: &dyn Error) -> String {
    let mut said = error.to_string();
    let mut next = error.source();
    while let Some(source) = next {
        said = format!("{said}: {source}");
        next = source.source();
    }
    said
}

#[test]
fn a_cause_is_reachable_and_reported_once() {
    let refused = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 2 });
    let error = refused.unwrap_err();
    let said = "nodes: 2 given, at least 3 needed";
    assert_eq!(chain(&error), said);
}

/// A system observes every iteration and the unknowns, and can end the solve.
#[test]
fn a_system_can_stop_newton() {
    let forces = FiniteDifferences::new(&balloon(), 101).unwrap();
    let solve = |most: usize| {
        let mut x = forces.start().to_vec();
        let mut gas = Gas::new(&forces, 1500.0);
        gas.most = most;
        let report = newton(&mut gas, &mut x, &NewtonOptions::default()).unwrap();
        (report, gas.seen, x)
    };
    let (report, all, x) = solve(usize::MAX);
    assert_ne!(report.stopped_by, Some(StopReason::Observer));
    assert_eq!(all.len(), report.iterations);
    assert_eq!(all.last().unwrap().2, x);
    for (k, (iterations, residual, _)) in all.iter().enumerate() {
        assert_eq!(*iterations, k + 1);
        assert_eq!(*residual, report.history[k + 1]);
    }
    let (report, seen, x) = solve(2);
    assert_eq!(report.stopped_by, Some(StopReason::Observer));
    assert_eq!(seen[..], all[..2]);
    assert_eq!(x, all[1].2);
    assert_eq!(report.iterations, 2);
}

/// The message of a solve that fails contains the cause: a wrong tangent, too few iterations, a number that is not finite, or springs.
#[test]
fn messages_contain_the_cause_of_a_failure() {
    let options = NewtonOptions::default();
    for (sign, x, options, cause, said) in [
        (
            -1.0,
            1.0,
            options,
            StopReason::LineSearch,
            "the tangent is not the derivative",
        ),
        (
            1.0,
            1e9,
            options.with_max_iterations(2),
            StopReason::Iterations,
            "iterations are used up",
        ),
        (f64::NAN, 1.0, options, StopReason::NotFinite, "not finite"),
    ] {
        let failed = newton(&mut root(sign, 1.0), &mut [x], &options).unwrap_err();
        assert!(failed.to_string().contains(said), "{failed}");
        let NewtonError::NotConverged { report, .. } = failed else {
            panic!("{failed:?}")
        };
        assert_eq!(report.stopped_by, Some(cause));
    }
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let spectral = Discretisation::Spectral {
        degree: 12,
        per_piece: 1,
    };
    let solver = Solver::new(&membrane, spectral).unwrap();
    let of_springs = solver.solve(Control::Volume(100.0), &options).unwrap();
    let of_springs = of_springs.stability().unwrap_err();
    let said = "stability: defined for a membrane of rubber only";
    assert_eq!(of_springs.to_string(), said);
}

/// `r_0 = sqrt(x_0) - 2`, `r_1 = x_1 - 1`, with norms that ignore NaN, as `f64::max` does.
struct RootAndLine;

impl ResidualSystem for RootAndLine {
    fn len(&self) -> usize {
        2
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        (out[0], out[1]) = (x[0].sqrt() - 2.0, x[1] - 1.0);
        Ok(())
    }

    fn factor(&mut self, _: &[f64]) -> Result<(), NewtonError> {
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        rhs[0] *= 4.0;
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |most: f64, r| most.max(r.abs()))
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        self.residual_norm(step)
    }
}

#[test]
fn a_residual_that_is_not_finite_is_no_solution_whatever_its_norm() {
    for line_search in [
        LineSearch::FullStep,
        LineSearch::Natural { max_halvings: 20 },
    ] {
        let options = NewtonOptions::default().with_line_search(line_search);
        for start in [[-4.0, 1.0], [-4.0, 3.0]] {
            let mut x = start;
            let error = newton(&mut RootAndLine, &mut x, &options).unwrap_err();
            let NewtonError::NotConverged { report, .. } = &error else {
                panic!("{start:?}: {error}")
            };
            assert_eq!(report.stopped_by, Some(StopReason::NotFinite), "{start:?}");
        }
        for start in [f64::NAN, f64::INFINITY] {
            let refused = newton(&mut RootAndLine, &mut [3.0, start], &options);
            let what = "start of an unknown";
            assert!(
                matches!(refused, Err(NewtonError::Membrane(MembraneError::OutOfRange { what: named, .. })) if named == what),
                "{refused:?}"
            );
        }
        let mut x = [3.0, 3.0];
        newton(&mut RootAndLine, &mut x, &options).unwrap();
        assert!(
            (x[0] - 4.0).abs() < 1e-9 && (x[1] - 1.0).abs() < 1e-12,
            "{x:?}"
        );
    }
}
