//! Solvers whose operator or steps overflow or give NaN: a typed error, and the last finite iterate.

use std::cell::Cell;

use radon::{
    CglsOptions, EmOptions, LinearOperator, RadonError, Sample, SirtOptions, Stopping, Subset,
    cgls, mlem, osem, sirt,
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
    // Squares beyond f64.
    for data in [1e200, 1e308] {
        let mut x = [1.0_f64];
        let error = cgls(
            &Times(1e10),
            &[data],
            &mut x,
            &CglsOptions::default(),
            radon::no_observer,
        )
        .unwrap_err();
        assert!(x[0].is_finite(), "{error}");
        let mut x = [1.0_f64];
        let error = sirt(
            &Times(1.0),
            &[data],
            &mut x,
            &SirtOptions::default(),
            radon::no_observer,
        )
        .unwrap_err();
        assert!(
            matches!(error, RadonError::NotFinite { .. }) && x == [1.0],
            "{error}"
        );
        let mut x = [1.0_f64];
        let error = mlem(
            &Times(1.0),
            &[data],
            &mut x,
            &EmOptions::default(),
            radon::no_observer,
        )
        .unwrap_err();
        assert!(
            matches!(error, RadonError::NotFinite { .. }) && x == [1.0],
            "{error}"
        );
    }
}

/// Squares below f64 would end CGLS at once, with the start as the solution.
#[test]
fn underflow_of_the_gradient_is_an_error() {
    for data in [1e-160, 1e-170] {
        let mut x = [0.0_f64];
        let options = CglsOptions::default();
        let error = cgls(&Times(1.0), &[data], &mut x, &options, radon::no_observer).unwrap_err();
        assert!(matches!(error, RadonError::OutOfRange { .. }), "{error}");
    }
    for data in [0.0, 1e-130] {
        let mut x = [0.0_f64];
        let options = CglsOptions::default();
        cgls(&Times(1.0), &[data], &mut x, &options, radon::no_observer).unwrap();
        assert!((x[0] - data).abs() <= 1e-15 * data, "{x:?}");
    }
}
