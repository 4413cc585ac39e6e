//! Numbers of the report of small systems whose steps are known, and when iterations end.

use std::cell::Cell;
use std::error::Error;

use membrane_forces::MembraneError;
use membrane_newton::{
    LineSearch, NewtonError, NewtonOptions, NewtonScratch, Refactor, ResidualSystem, StopReason,
    newton, newton_with,
};

use crate::scalar::Scalar;

/// x^2 = 2 with a derivative that is `wrong` times the exact one and a norm of steps scaled by `norm`.
pub(crate) fn root(wrong: f64, norm: f64) -> impl ResidualSystem {
    let mut root = Scalar::new(|x| Ok(x * x - 2.0), move |x| wrong * 2.0 * x);
    root.norm = norm;
    root
}

/// Steps that shrink slowly are not rounding: the solve continues to the tolerance or to the largest number of iterations.
#[test]
fn slow_convergence_is_not_rounding() {
    let natural = NewtonOptions::default();
    for line_search in [natural.line_search, LineSearch::FullStep] {
        for start in [1.0, 2f64.sqrt() + 1e-8] {
            for wrong in [1.0, 1.1, 2.0] {
                let options = natural.with_line_search(line_search);
                let mut x = [start];
                let few = newton(&mut root(wrong, 1.0), &mut x, &options);
                assert!(few.is_ok() || wrong == 2.0, "{wrong}: {few:?}");
                let mut x = [start];
                let options = options.with_max_iterations(100);
                let report = newton(&mut root(wrong, 1.0), &mut x, &options).unwrap();
                let error = (x[0] - 2f64.sqrt()).abs();
                // the tolerance of steps, with the rounding of the last ones
                assert!(error < 4e-14, "{start} {wrong}: {error:e} {report:?}");
                // no estimate is below the rounding of x
                let rounding = f64::EPSILON * x[0];
                assert!(report.iteration_error >= rounding, "{report:?}");
            }
        }
    }
    // without a size of the step no tolerance on it has a meaning
    let zero = newton(&mut root(1.0, 0.0), &mut [1.0], &natural);
    assert!(matches!(
        zero,
        Err(NewtonError::Membrane(MembraneError::OutOfRange {
            what: "norm of a nonzero step",
            ..
        }))
    ));
    let negative = newton(&mut root(1.0, -1.0), &mut [1.0], &natural);
    assert!(
        matches!(&negative, Err(NewtonError::NotConverged { report, .. })
            if report.stopped_by == Some(StopReason::NotFinite)),
        "{negative:?}"
    );
    for most in [f64::NAN, f64::INFINITY, -0.1] {
        let options = natural.with_refactor(Refactor::WhenContractionAbove(most));
        let refused = newton(&mut root(1.0, 1.0), &mut [1.0], &options);
        assert!(
            matches!(
                refused,
                Err(NewtonError::Membrane(MembraneError::OutOfRange { .. }))
            ),
            "{most}: {refused:?}"
        );
    }
}

/// Derivatives that are `wrong` times the exact one make steps shrink by 1 - 1 / `wrong`, multiple roots by about 1 - 1 / power. The error is that of
/// all remaining steps, which the estimate contains, and within the tolerance if that ended the solve.
#[test]
fn the_error_of_slow_convergence_is_within_the_stated_one() {
    let natural = NewtonOptions::default().line_search;
    let solve = |system: &mut dyn ResidualSystem, x: f64, root: f64, line_search, tolerance| {
        let options = NewtonOptions::default()
            .with_line_search(line_search)
            .with_tolerances(0.0, tolerance)
            .with_max_iterations(1000);
        let mut x = [x];
        let report = newton(system, &mut x, &options).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Step));
        let error = (x[0] - root).abs();
        assert!(error <= report.iteration_error, "{error:e} {report:?}");
        assert!(error <= tolerance, "{error:e} {report:?}");
        report
    };
    for (wrong, line_search) in [0.55, 0.7, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0]
        .map(|wrong| (wrong, LineSearch::FullStep))
        .into_iter()
        .chain([0.55, 0.7, 1.5, 2.0, 3.0].map(|wrong| (wrong, natural)))
    {
        for tolerance in [1e-4, 1e-6, 1e-12] {
            let slope = |x: f64| wrong * x.exp();
            let mut system = Scalar::new(|x| Ok(x.exp() - 2.0), slope);
            let root = 2f64.ln();
            let report = solve(&mut system, 1.0, root, line_search, tolerance);
            // the estimate exceeds the tolerance only by its margin for other directions
            assert!(report.iteration_error < 10.0 * tolerance, "{report:?}");
        }
    }
    for power in [1.2, 1.5, 2.0, 3.0, 6.0] {
        for wrong in [1.0, 0.7] {
            for tolerance in [1e-4, 1e-6, 1e-10] {
                let residual = |x: f64| Ok(x.signum() * x.abs().powf(power));
                let slope = |x: f64| wrong * power * x.abs().powf(power - 1.0);
                let mut system = Scalar::new(residual, slope);
                solve(&mut system, 0.9, 0.0, natural, tolerance);
            }
        }
    }
}

/// A tangent that leaves the fraction 1 - 1 / `wrong` of a linear residual passes the natural test up to 3/4; full steps converge with it.
#[test]
fn the_natural_test_rejects_tangents_that_contract_by_more_than_three_quarters() {
    let natural = NewtonOptions::default().with_max_iterations(1000);
    let full = natural.with_line_search(LineSearch::FullStep);
    let solve = |wrong: f64, options| {
        let mut system = Scalar::new(|x| Ok(x - 1.0), move |_| wrong);
        newton(&mut system, &mut [3.0], options)
    };
    assert!(solve(3.9, &natural).is_ok());
    let rejected = solve(4.1, &natural);
    assert!(
        matches!(&rejected, Err(NewtonError::NotConverged { report, .. })
            if report.stopped_by == Some(StopReason::LineSearch)),
        "{rejected:?}"
    );
    assert!(solve(4.1, &full).is_ok());
}

/// Steps that the line search shortens all the way to the root are not rounding: the cube root, whose full steps lead to -2 x, and a derivative
/// that is half of the exact one, with which full steps change the sign of the error.
#[test]
fn shortened_steps_are_not_rounding() {
    let options = NewtonOptions::default();
    let slope = |x: f64| 1.0 / (3.0 * x.cbrt().powi(2));
    let mut x = [1.0];
    let cut_short = newton(&mut Scalar::new(|x| Ok(x.cbrt()), slope), &mut x, &options);
    assert!(
        matches!(&cut_short, Err(NewtonError::NotConverged { report, .. })
            if report.stopped_by == Some(StopReason::Iterations)),
        "{x:?}: {cut_short:?}"
    );
    for wrong in [0.3, 0.45, 0.5, 0.55, 0.6] {
        let slope = |x: f64| wrong * x.exp();
        let mut system = Scalar::new(|x: f64| Ok(x.exp() - 2.0), slope);
        let (mut x, options) = ([1.0], options.with_max_iterations(100));
        let report = newton(&mut system, &mut x, &options).unwrap();
        // a hundred roundings of x, amplified by the derivative, may be rounding
        let error = (x[0] - 2f64.ln()).abs();
        assert!(error < 1.6e-14 / wrong, "{wrong}: {error:e} {report:?}");
    }
}

/// The logarithm, undefined for x <= 0.
fn logarithm(x: f64) -> Result<f64, NewtonError> {
    if x <= 0.0 {
        MembraneError::within("logarithm", x, f64::MIN_POSITIVE, f64::MAX)?;
    }
    Ok(x.ln())
}

/// From 10 times the root every whole step and every shorter one down to a half leads outside the domain of the logarithm.
#[test]
fn an_error_in_the_line_search_is_the_source() {
    let options =
        NewtonOptions::default().with_line_search(LineSearch::Natural { max_halvings: 0 });
    let error = newton(
        &mut Scalar::new(logarithm, f64::recip),
        &mut [10.0],
        &options,
    )
    .unwrap_err();
    let cause = error.source().expect("a cause");
    assert!(
        (cause.to_string()).ends_with("it must be finite and positive"),
        "{cause}"
    );
    // no such error, no source
    let error = newton(
        &mut Scalar::new(logarithm, f64::recip),
        &mut [1.5],
        &options.with_max_iterations(0),
    );
    assert!(error.unwrap_err().source().is_none());
}

#[test]
fn reports_count_every_residual_and_contain_the_stopping_test() {
    let natural = NewtonOptions::default();
    let full = natural.with_line_search(LineSearch::FullStep);
    for options in [&natural, &full] {
        for (tolerances, ended) in [
            ((1e-6, 0.0), StopReason::Residual),
            ((0.0, 1e-6), StopReason::Step),
        ] {
            let options = options.with_tolerances(tolerances.0, tolerances.1);
            let mut system = Scalar::new(logarithm, f64::recip);
            let mut x = [1.4];
            let report = newton(&mut system, &mut x, &options).unwrap();
            assert_eq!(report.residual_calls, system.residuals);
            assert_eq!(report.factorisations, system.factorisations);
            assert_eq!(report.stopped_by, Some(ended), "{options:?}: {report:?}");
            // estimates are correct up to the rounding of x
            let error = (x[0] - 1.0).abs();
            assert!(
                error <= report.iteration_error + 4.0 * f64::EPSILON,
                "{error:e}: {report:?}"
            );
            assert!(report.iteration_error < 1e-2, "{report:?}");
        }
    }
}

/// A factorisation is reused while the root hardly changes, and replaced when the steps no longer contract.
#[test]
fn a_factorisation_may_be_reused_for_many_solves() {
    let options = NewtonOptions::default()
        .with_tolerances(1e-13, 1e-13)
        .with_refactor(Refactor::WhenContractionAbove(0.05));
    let count = |options: &NewtonOptions| {
        let at = Cell::new(1.0);
        let mut system = Scalar::new(|x| logarithm(x / at.get()), f64::recip);
        let (mut x, mut scratch) = ([1.0], NewtonScratch::default());
        // far away at last: the old tangent leads outside the domain of the logarithm
        for root in (1..=100).map(|k| 1.0 + 0.01 * f64::from(k)).chain([0.02]) {
            at.set(root);
            system.norm = 1.0 / root;
            newton_with(&mut system, &mut x, options, &mut scratch).unwrap();
            assert!((x[0] / root - 1.0).abs() < 1e-12);
        }
        system.factorisations
    };
    let kept = count(&options);
    let each = count(&options.with_refactor(Refactor::EachIteration));
    assert!(kept < 40 && each > 100, "{kept} {each}");
}

/// Full steps evaluate the residual at the start and after each step but the last one, whose error is known from the contraction. As each step
/// is less than half of the previous one, that error is less than the step.
#[test]
fn full_steps_end_without_another_residual() {
    let options = NewtonOptions::default()
        .with_line_search(LineSearch::FullStep)
        .with_tolerances(0.0, 1e-6);
    for start in [0.5, 1.4, 2.0] {
        let mut system = Scalar::new(|x| Ok(x.ln()), f64::recip);
        let mut x = [start];
        let report = newton(&mut system, &mut x, &options).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Step));
        assert!(report.iterations > 2, "{report:?}");
        assert_eq!(report.residual_calls, report.iterations, "{report:?}");
        assert_eq!(system.residuals, report.residual_calls);
        assert!(report.iteration_error < report.step, "{report:?}");
        assert!((x[0] - 1.0).abs() <= report.iteration_error, "{report:?}");
    }
}

/// The step of the report is the change of x, also if the line search shortens it: Newton's step of the arc tangent from 3 leads to -9.5.
#[test]
fn the_step_of_the_report_is_the_shortened_one() {
    let mut system = Scalar::new(|x| Ok(x.atan()), |x| 1.0 / (1.0 + x * x));
    let mut x = [3.0];
    let options = NewtonOptions::default().with_max_iterations(1);
    let error = newton(&mut system, &mut x, &options).unwrap_err();
    let NewtonError::NotConverged { report, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(report.iterations, 1);
    assert!((x[0] - 3.0).abs() < 0.6 * 10.0 * 3f64.atan(), "{x:?}");
    // one subtraction and one product, each rounded
    let moved = (x[0] - 3.0).abs();
    assert!((report.step / moved - 1.0).abs() < 1e-14, "{report:?}");
}

/// The residual x - 1 with errors that alternate and grow: 1e-9, -2e-9, 3e-9, ... A start within them is the result; otherwise the last step is
/// taken, though it is no smaller than expected from the errors. So it is if the residual is not defined at the last call, which samples the errors.
#[test]
fn a_start_within_rounding_is_not_changed() {
    let options = NewtonOptions::default().with_tolerances(0.0, 0.0);
    for (start, iterations, end, step) in [(1.0, 0, 0.0, 1e-9), (1.5, 2, -3e-9, 5e-9)] {
        for undefined in [
            usize::MAX,
            2 * iterations + if iterations > 0 { 1 } else { 3 },
        ] {
            let mut calls = 0;
            let residual = |x: f64| {
                calls += 1;
                let sign = if calls % 2 == 1 { 1.0 } else { -1.0 };
                match calls == undefined {
                    true => logarithm(-1.0),
                    false => Ok(x - 1.0 + sign * 1e-9 * calls as f64),
                }
            };
            let mut system = Scalar::new(residual, |_| 1.0);
            let mut x = [start];
            let report = newton(&mut system, &mut x, &options).unwrap();
            assert_eq!(report.stopped_by, Some(StopReason::Rounding));
            assert_eq!(report.iterations, iterations, "{report:?}");
            // the rounding of x
            assert!((x[0] - 1.0 - end).abs() < 1e-15, "{undefined}: {x:?}");
            assert!((report.step - step).abs() < 1e-15, "{report:?}");
        }
    }
}

/// A step that fails with an old factorisation, here with a slope of the wrong sign, is repeated with a new one, after another evaluation of the
/// residual.
#[test]
fn a_repeated_step_counts_its_residual() {
    let options = NewtonOptions::default().with_refactor(Refactor::WhenContractionAbove(0.5));
    let mut scratch = NewtonScratch::default();
    let mut system = Scalar::new(|x| Ok(x * x - 1.0), |x| 2.0 * x);
    for (start, root, factorisations) in [(1.1, 1.0, 1), (-1.1, -1.0, 1)] {
        let (mut x, before) = ([start], system.residuals);
        newton_with(&mut system, &mut x, &options, &mut scratch).unwrap();
        // steps of 1e-14
        assert!((x[0] - root).abs() < 1e-13);
        let report = scratch.report();
        assert_eq!(report.residual_calls, system.residuals - before, "{start}");
        assert_eq!(report.factorisations, factorisations);
    }
}

/// r = (x + a x^2, y (1 + b x)): x converges at once if a is small, so that the size of its steps hides those of y, which contract by the change of
/// the tangent since its factorisation.
struct Hidden {
    a: f64,
    b: f64,
    tangent: [f64; 3],
}

impl ResidualSystem for Hidden {
    fn len(&self) -> usize {
        2
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        out[0] = x[0] + self.a * x[0] * x[0];
        out[1] = x[1] * (1.0 + self.b * x[0]);
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        self.tangent = [
            1.0 + 2.0 * self.a * x[0],
            self.b * x[1],
            1.0 + self.b * x[0],
        ];
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        rhs[0] /= self.tangent[0];
        rhs[1] = (rhs[1] - self.tangent[1] * rhs[0]) / self.tangent[2];
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual[0].abs().max(residual[1].abs())
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        self.residual_norm(step)
    }
}

#[test]
fn the_error_of_a_hidden_direction_is_within_the_stated_one() {
    for line_search in [LineSearch::FullStep, NewtonOptions::default().line_search] {
        // curvatures 1e-1 to 1e-4, couplings 0.2 to 1.6, and y from 1e-1 to 1e-7 of x
        for n in 0..4 * 4 * 7 {
            let a = 0.1f64.powi(1 + n % 4);
            let b = 0.2 * 2f64.powi(n / 4 % 4);
            let start = [0.2, 0.2 * 0.1f64.powi(1 + n / 16)];
            for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
                let options = NewtonOptions::default()
                    .with_line_search(line_search)
                    .with_tolerances(0.0, tolerance)
                    .with_refactor(Refactor::WhenContractionAbove(0.5));
                let mut x = start;
                let mut system = Hidden {
                    a,
                    b,
                    tangent: [0.0; 3],
                };
                let report = newton(&mut system, &mut x, &options).unwrap();
                let error = x[0].abs().max(x[1].abs());
                assert!(
                    error <= report.iteration_error,
                    "{line_search:?} {a:e} {b} {start:?} {tolerance:e}: {error:e} {report:?}"
                );
            }
        }
    }
}

/// e^x = x + 2, with starts from which the first step is as long as 1e16: a reused tangent contracts only the last steps, and a small ratio of two
/// steps says nothing about the next.
#[test]
fn reused_tangents_end_at_a_root_within_the_stated_error() {
    let exponential = || Scalar::new(|x: f64| Ok(x.exp() - x - 2.0), f64::exp_m1);
    let natural = NewtonOptions::default().line_search;
    // a step within the tolerance is not applied: it is the error
    let loose = NewtonOptions::default().with_tolerances(0.0, 1e-6);
    let mut x = [1.146193220620583 + 1e-8];
    let report = newton(&mut exponential(), &mut x, &loose).unwrap();
    assert_eq!(report.iterations, 0);
    let ratio = report.iteration_error / 1e-8;
    assert!((1.0..2.0).contains(&ratio), "{ratio}");
    for line_search in [LineSearch::FullStep, natural] {
        for factor in [0.05, 0.5, 0.9] {
            for (residual, step) in [(1e-15, 1e-14), (0.0, 1e-10), (0.0, 1e-4)] {
                let options = NewtonOptions::default()
                    .with_line_search(line_search)
                    .with_refactor(Refactor::WhenContractionAbove(factor))
                    .with_tolerances(residual, step)
                    .with_max_iterations(100);
                for start in (1..2000).step_by(7).map(|k| 1e-3 * f64::from(k)) {
                    let mut x = [start];
                    let Ok(report) = newton(&mut exponential(), &mut x, &options) else {
                        continue;
                    };
                    let root = if x[0] > 0.0 {
                        1.146193220620583
                    } else {
                        -1.8414056604369606
                    };
                    let (error, stated) = ((x[0] - root).abs(), report.iteration_error);
                    assert!(
                        error <= stated.max(1e-14),
                        "{options:?} from {start}: {error:e}, stated {stated:e}"
                    );
                }
            }
        }
    }
}
