//! Numbers of the report of small systems whose steps are known.

use membrane_newton::{
    LineSearch, NewtonError, NewtonOptions, NewtonScratch, Refactor, ResidualSystem, StopReason,
    newton, newton_with,
};

/// r(x) = 0 of one unknown, with its derivative; counts the residuals.
struct Scalar<F> {
    residual: F,
    slope_at: fn(f64) -> f64,
    slope: f64,
    calls: usize,
}

impl<F: FnMut(f64) -> f64> Scalar<F> {
    fn new(residual: F, slope_at: fn(f64) -> f64) -> Self {
        Self {
            residual,
            slope_at,
            slope: f64::NAN,
            calls: 0,
        }
    }
}

impl<F: FnMut(f64) -> f64> ResidualSystem for Scalar<F> {
    fn len(&self) -> usize {
        1
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        self.calls += 1;
        out[0] = (self.residual)(x[0]);
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        self.slope = (self.slope_at)(x[0]);
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        rhs[0] /= self.slope;
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual[0].abs()
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        step[0].abs()
    }
}

/// Full steps evaluate the residual at the start and after each step but the last one, whose error is known from the contraction. As each step
/// is less than half of the previous one, that error is less than the step.
#[test]
fn full_steps_end_without_another_residual() {
    let options = NewtonOptions::default()
        .with_line_search(LineSearch::FullStep)
        .with_tolerances(0.0, 1e-6);
    for start in [0.5, 1.4, 2.0] {
        let mut system = Scalar::new(f64::ln, |x| 1.0 / x);
        let mut x = [start];
        let report = newton(&mut system, &mut x, &options).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Step));
        assert!(report.iterations > 2, "{report:?}");
        assert_eq!(report.residual_calls, report.iterations, "{report:?}");
        assert_eq!(system.calls, report.residual_calls);
        assert!(report.iteration_error < report.step, "{report:?}");
        assert!((x[0] - 1.0).abs() <= report.iteration_error, "{report:?}");
    }
}

/// The step of the report is the change of x, also if the line search shortens it: Newton's step of the arc tangent from 3 leads to -9.5.
#[test]
fn the_step_of_the_report_is_the_shortened_one() {
    let mut system = Scalar::new(f64::atan, |x| 1.0 / (1.0 + x * x));
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
/// taken, though it is no smaller than expected from the errors.
#[test]
fn a_start_within_rounding_is_not_changed() {
    let options = NewtonOptions::default().with_tolerances(0.0, 0.0);
    for (start, iterations, end, step) in [(1.0, 0, 0.0, 1e-9), (1.5, 2, -3e-9, 5e-9)] {
        let mut calls = 0;
        let residual = |x: f64| {
            calls += 1;
            let sign = if calls % 2 == 1 { 1.0 } else { -1.0 };
            x - 1.0 + sign * 1e-9 * f64::from(calls)
        };
        let mut system = Scalar::new(residual, |_| 1.0);
        let mut x = [start];
        let report = newton(&mut system, &mut x, &options).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Rounding));
        assert_eq!(report.iterations, iterations, "{report:?}");
        // the rounding of x
        assert!((x[0] - 1.0 - end).abs() < 1e-15, "{x:?}");
        assert!((report.step - step).abs() < 1e-15, "{report:?}");
    }
}

/// A step that fails with an old factorisation, here with a slope of the wrong sign, is repeated with a new one, after another evaluation of the
/// residual.
#[test]
fn a_repeated_step_counts_its_residual() {
    let options = NewtonOptions::default().with_refactor(Refactor::WhenContractionAbove(0.5));
    let mut scratch = NewtonScratch::default();
    let mut system = Scalar::new(|x| x * x - 1.0, |x| 2.0 * x);
    for (start, root, factorisations) in [(1.1, 1.0, 1), (-1.1, -1.0, 1)] {
        let (mut x, before) = ([start], system.calls);
        newton_with(&mut system, &mut x, &options, &mut scratch).unwrap();
        // steps of 1e-14
        assert!((x[0] - root).abs() < 1e-13);
        let report = scratch.report();
        assert_eq!(report.residual_calls, system.calls - before, "{start}");
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
