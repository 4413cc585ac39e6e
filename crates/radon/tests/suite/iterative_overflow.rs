//! Solvers whose operator or steps overflow or give NaN: a typed error, and the last finite iterate.

use std::cell::Cell;

use radon::{
    CglsOptions, EmOptions, ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector,
    RadonError, Sample, SirtOptions, StopReason, Stopping, Subset, cgls, mlem, osem, sirt,
};

/// A positive matrix of 5 x 4 that writes `bad` in place of a number in its call number `at`, forward or adjoint.
struct Breaks<T> {
    forward: bool,
    at: usize,
    bad: T,
    calls: Cell<usize>,
}

fn entry(row: usize, column: usize) -> f64 {
    1.0 + ((3 * row + 5 * column) % 7) as f64
}

impl<T: Sample> Breaks<T> {
    fn new(forward: bool, at: usize, bad: T) -> Self {
        let calls = Cell::new(0);
        Self {
            forward,
            at,
            bad,
            calls,
        }
    }

    fn spoil(&self, forward: bool, out: &mut [T]) {
        if forward == self.forward {
            if self.calls.get() == self.at {
                out[2] = self.bad;
            }
            self.calls.set(self.calls.get() + 1);
        }
    }
}

impl<T: Sample> LinearOperator<T> for Breaks<T> {
    fn image_len(&self) -> usize {
        4
    }
    fn data_len(&self) -> usize {
        5
    }
    fn forward_into(&self, x: &[T], y: &mut [T]) -> Result<(), RadonError> {
        for (row, y) in y.iter_mut().enumerate() {
            *y = (0..4)
                .map(|column| T::of(entry(row, column)) * x[column])
                .sum();
        }
        self.spoil(true, y);
        Ok(())
    }
    fn adjoint_into(&self, y: &[T], x: &mut [T]) -> Result<(), RadonError> {
        for (column, x) in x.iter_mut().enumerate() {
            *x = (0..5).map(|row| T::of(entry(row, column)) * y[row]).sum();
        }
        self.spoil(false, x);
        Ok(())
    }
}

type Solve<T> = fn(&Breaks<T>, &[T], &mut [T], usize) -> Result<(), RadonError>;

/// All solvers, for a number of iterations.
fn solvers<T: Sample>() -> [(&'static str, Solve<T>); 4] {
    fn stopping(n: usize) -> Stopping {
        Stopping::default().with_max_iterations(n)
    }
    [
        ("CGLS", |a, b, x, n| {
            let options = CglsOptions::default().with_stopping(stopping(n));
            cgls(a, b, x, &options, radon::no_observer).map(drop)
        }),
        ("SIRT", |a, b, x, n| {
            let options = SirtOptions::default().with_stopping(stopping(n));
            sirt(a, b, x, &options, radon::no_observer).map(drop)
        }),
        ("MLEM", |a, b, x, n| {
            let options = EmOptions::default().with_stopping(stopping(n));
            mlem(a, b, x, &options, radon::no_observer).map(drop)
        }),
        ("OSEM", |a, b, x, n| {
            let all = Subset::new(a, (0..5).collect());
            let options = EmOptions::default().with_stopping(stopping(n));
            osem(&[all], b, x, &options, radon::no_observer).map(drop)
        }),
    ]
}

fn an_operator_that_breaks<T: Sample + PartialEq>() {
    let data: Vec<T> = [3.0, 1.0, 4.0, 1.0, 5.0].map(T::of).to_vec();
    for (name, solve) in solvers::<T>() {
        for forward in [true, false] {
            for at in 0..9 {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let mut image = vec![T::ONE; 4];
                    let operator = Breaks::new(forward, at, T::of(bad));
                    let error = solve(&operator, &data, &mut image, 6);
                    if operator.calls.get() <= at {
                        // Six iterations made fewer calls.
                        assert!(error.is_ok() && at >= 6, "{name} {forward} {at}");
                        continue;
                    }
                    let what = match forward {
                        true => "result of forward_into",
                        false => "result of adjoint_into",
                    };
                    match error {
                        Err(RadonError::BadSample {
                            what: found,
                            index: 2,
                            given,
                        }) => assert!(found == what && !given.is_finite()),
                        other => panic!("{name} {forward} {at}: {other:?}"),
                    }
                    // One of the iterates of the operator without the fault.
                    let sound = Breaks::new(true, usize::MAX, T::ZERO);
                    let is_iterate = (0..=6).any(|n| {
                        let mut expected = vec![T::ONE; 4];
                        solve(&sound, &data, &mut expected, n).unwrap();
                        expected == image
                    });
                    assert!(is_iterate, "{name} {forward} {at}: {image:?}");
                }
            }
        }
    }
}

#[test]
fn an_operator_that_returns_nan_or_infinity_is_an_error_with_the_last_iterate() {
    an_operator_that_breaks::<f32>();
    an_operator_that_breaks::<f64>();
}

/// A product of two numbers.
struct Times<T>(T);

impl<T: Sample> LinearOperator<T> for Times<T> {
    fn image_len(&self) -> usize {
        1
    }
    fn data_len(&self) -> usize {
        1
    }
    fn forward_into(&self, x: &[T], y: &mut [T]) -> Result<(), RadonError> {
        y[0] = self.0 * x[0];
        Ok(())
    }
    fn adjoint_into(&self, y: &[T], x: &mut [T]) -> Result<(), RadonError> {
        x[0] = self.0 * y[0];
        Ok(())
    }
}

#[test]
fn overflow_of_a_step_or_a_norm_is_an_error() {
    // The solution is 1e40, beyond f32.
    let mut x = [1.0_f32];
    let error = cgls(
        &Times(1e-10),
        &[1e30],
        &mut x,
        &CglsOptions::default(),
        radon::no_observer,
    )
    .unwrap_err();
    assert!(
        matches!(
            error,
            RadonError::BadSample {
                what: "next image",
                ..
            }
        ) && x == [1.0]
    );
    let mut x = [1.0_f32];
    let error = sirt(
        &Times(1e-10),
        &[1e30],
        &mut x,
        &SirtOptions::default(),
        radon::no_observer,
    )
    .unwrap_err();
    assert!(
        matches!(error, RadonError::BadSample { .. }) && x == [1.0],
        "{error} {x:?}"
    );
    let mut x = [1.0_f32];
    let error = mlem(
        &Times(1e-10),
        &[1e30],
        &mut x,
        &EmOptions::default(),
        radon::no_observer,
    )
    .unwrap_err();
    assert!(
        matches!(error, RadonError::BadSample { .. }) && x == [1.0],
        "{error} {x:?}"
    );
    // A norm beyond f64.
    for data in [[1.7e308; 5], [f64::MAX; 5]] {
        for (name, solve) in solvers::<f64>() {
            let mut image = vec![1.0; 4];
            let sound = Breaks::new(true, usize::MAX, 0.0);
            let error = solve(&sound, &data, &mut image, 6).unwrap_err();
            assert!(
                matches!(error, RadonError::NotFinite { .. }) && image == [1.0; 4],
                "{name}: {error}"
            );
        }
    }
}

/// Solvers whose squares under- or overflow.
#[test]
fn data_whose_squares_are_no_numbers_are_solved() {
    let few = Stopping::default()
        .with_max_iterations(60)
        .with_residual(1e-10);
    for data in [1e-300, 1e-165, 1e-130, 1e200, 1e300] {
        let options = CglsOptions::default().with_gradient(1e-12);
        let mut x = [[0.0_f64], [0.0], [1.0]];
        let report = cgls(
            &Times(3.0),
            &[data],
            &mut x[0],
            &options,
            radon::no_observer,
        );
        assert_eq!(report.unwrap().stopped_by, Some(StopReason::Gradient));
        let options = SirtOptions::default().with_stopping(few);
        sirt(
            &Times(3.0),
            &[data],
            &mut x[1],
            &options,
            radon::no_observer,
        )
        .unwrap();
        let options = EmOptions::default().with_stopping(few);
        mlem(
            &Times(3.0),
            &[data],
            &mut x[2],
            &options,
            radon::no_observer,
        )
        .unwrap();
        // The rules allow 1e-10.
        for [x] in x {
            assert!((x / (data / 3.0) - 1.0).abs() < 1e-9, "{data}: {x}");
        }
    }
    let report = cgls(
        &Times(1.0),
        &[0.0],
        &mut [0.0_f64],
        &CglsOptions::default(),
        radon::no_observer,
    );
    assert_eq!(report.unwrap().stopped_by, Some(StopReason::Solved));
}

/// Two unknowns and entries of the order of a number.
struct Pair<T>(T);

impl<T: Sample> LinearOperator<T> for Pair<T> {
    fn image_len(&self) -> usize {
        2
    }
    fn data_len(&self) -> usize {
        2
    }
    fn forward_into(&self, x: &[T], y: &mut [T]) -> Result<(), RadonError> {
        y.copy_from_slice(&[self.0 * x[0], self.0 * (x[0] + T::of(2.0) * x[1])]);
        Ok(())
    }
    fn adjoint_into(&self, y: &[T], x: &mut [T]) -> Result<(), RadonError> {
        x.copy_from_slice(&[self.0 * (y[0] + y[1]), self.0 * T::of(2.0) * y[1]]);
        Ok(())
    }
}

/// The scale of A and of the data is arbitrary: neither is a solution.
#[test]
fn cgls_does_not_depend_on_the_scales_of_operator_and_data() {
    fn check<T: Sample>(scales: &[(f64, f64)], rule: f64, tolerance: f64) {
        for &(s, t) in scales {
            let data = [t, 3.0 * t].map(T::of);
            let mut x = [T::ZERO; 2];
            let options = CglsOptions::default().with_gradient(rule);
            let report =
                cgls(&Pair(T::of(s)), &data, &mut x, &options, radon::no_observer).unwrap();
            assert_eq!(report.stopped_by, Some(StopReason::Gradient), "{s} {t}");
            for x in x {
                assert!(
                    (x.f64() / (t / s) - 1.0).abs() < tolerance,
                    "{s} {t}: {x:?}"
                );
            }
        }
    }
    // The rule times the condition of AᵀA, 7, and rounding.
    let scales = [
        (1e-60, 1e-60),
        (1e-80, 1e-50),
        (1e-100, 1e-30),
        (1e-130, 1.0),
        (1e-200, 1e-200),
        (1e150, 1e-100),
    ];
    check::<f64>(&scales, 1e-12, 1e-10);
    check::<f32>(
        &[
            (1.0, 1.0),
            (1e-20, 1e-20),
            (1e-20, 1.0),
            (1e-30, 1e-30),
            (1e15, 1e-15),
        ],
        1e-5,
        1e-3,
    );
}

/// A step of the unscaled recurrence has squares below the smallest f32.
#[test]
fn cgls_reconstructs_in_any_unit_of_length() {
    for unit in [1.0, 1e-12, 1e-16, 1e-20] {
        let geometry = ParallelGeometry::half_turn(24, 24, unit).unwrap();
        let grid = ImageGrid::square(16, unit).unwrap();
        let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
        let truth: Vec<f32> = (0..256).map(|i| (i % 5) as f32).collect();
        let data = projector.forward(&truth).unwrap();
        let mut image = vec![0.0_f32; 256];
        let options = CglsOptions::default().with_gradient(1e-3);
        let report = cgls(&projector, &data, &mut image, &options, radon::no_observer).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Gradient), "{unit:e}");
        // The gradient of the start is the data's; a thousandth of it leaves some per cent of the residual.
        let residual = report.history[report.iterations].residual;
        assert!(residual < 0.05, "{unit:e}: {residual}");
    }
}
