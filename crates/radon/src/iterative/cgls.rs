//! Conjugate gradients for least squares.

use std::ops::ControlFlow;

use super::operator::{Checked, LinearOperator};
use super::report::{Iteration, IterativeReport};
use super::stopping::{Monitor, Observer, Stopping};
use super::vectors::{check_samples, norm, relative, update};
use crate::Sample;
use crate::error::{RadonError, finite, zeros};

/// Options of [`cgls`].
///
/// ```
/// use radon::{CglsOptions, Stopping};
/// let few = CglsOptions::default().with_stopping(Stopping::default().with_max_iterations(8)); // few steps regularise
/// let exact = CglsOptions::default().with_gradient(1e-10); // an error if fifty steps do not suffice
/// assert_eq!((few.stopping.max_iterations, exact.gradient), (8, Some(1e-10)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CglsOptions {
    /// Stopping rules.
    pub stopping: Stopping,
    /// Stop at ‖Aᵀ(b - A x)‖ <= this times ‖Aᵀ b‖. [`RadonError::NotConverged`] if rounding prevents it; about 1e-5 for `f32` and 1e-13 for
    /// `f64` are attainable if A is well-conditioned.
    pub gradient: Option<f64>,
}

impl CglsOptions {
    setters! {
        /// Sets the stopping rules.
        with_stopping(stopping: Stopping);
        /// Sets the gradient rule.
        with_gradient(gradient: f64);
    }
}

/// CGLS from the given image: the minimiser of ‖A x - b‖² over the growing Krylov space of AᵀA.
///
/// In exact arithmetic it ends at the least-squares solution nearest to the start, after as many steps as A has distinct singular values.
/// Few steps regularise (Hestenes & Stiefel 1952, doi:10.6028/jres.049.044; Björck, Numerical Methods for Least Squares Problems, SIAM
/// 1996, algorithm 7.4.1). Cost of a step: one forward, one adjoint. `watch`: see [`no_observer`](crate::no_observer).
///
/// Residual and gradient are computed by recurrence. Where they meet a rule they are computed from the image, with one more forward and
/// adjoint, and the iteration restarts from there if these do not meet it. It ends where a restart halves neither.
///
/// # Errors
/// A wrong length, an option out of its range, NaN or infinity in the arguments, an error of the operator; [`RadonError::BadSample`] if the
/// operator returns NaN or infinity or the next image overflows, [`RadonError::NotFinite`] if a norm does; [`RadonError::NotConverged`].
/// `image` always contains the last finite iterate.
#[doc(alias("conjugate gradient", "LSQR"))]
pub fn cgls<T: Sample, O: LinearOperator<T> + ?Sized>(
    operator: &O,
    data: &[T],
    image: &mut [T],
    options: &CglsOptions,
    mut watch: impl FnMut(&IterativeReport, &[T]) -> ControlFlow<()>,
) -> Result<IterativeReport, RadonError> {
    run(&operator, data, image, options, &mut watch)
}

fn or_one(norm: f64) -> f64 {
    if norm > 0.0 { norm } else { 1.0 }
}

/// Replaces A x by (b - A x) / unit; returns unit, the norm of b - A x.
fn unit_residual<T: Sample>(data: &[T], residual: &mut [T]) -> Result<f64, RadonError> {
    update(residual, data, |ax, b| b - ax);
    let unit = or_one(finite("norm of the residual", norm(residual))?);
    update(residual, data, |r, _| T::of(r.f64() / unit));
    Ok(unit)
}

/// Moves the image along a direction if the next image, computed in `next`, is finite. Returns the relative change.
fn advance<T: Sample>(
    image: &mut [T],
    direction: &[T],
    step: f64,
    next: &mut [T],
) -> Result<f64, RadonError> {
    next.copy_from_slice(image);
    update(next, direction, |x, d| T::of(x.f64() + step * d.f64()));
    check_samples("next image", next)?;
    let change = relative(step * norm(direction), norm(next));
    let change = finite("change of the image", change)?;
    image.copy_from_slice(next);
    Ok(change)
}

fn run<T: Sample>(
    operator: &dyn LinearOperator<T>,
    data: &[T],
    image: &mut [T],
    options: &CglsOptions,
    observe: Observer<'_, T>,
) -> Result<IterativeReport, RadonError> {
    let operator = Checked(operator);
    operator.check_input(data, image)?;
    let mut monitor = Monitor::new(options.stopping, options.gradient, observe)?;

    let mut direction: Vec<T> = zeros("direction", image.len(), 1)?;
    let mut gradient: Vec<T> = zeros("gradient", image.len(), 1)?;
    let mut residual: Vec<T> = zeros("residual", data.len(), 1)?;
    let mut projected: Vec<T> = zeros("projections", data.len(), 1)?;
    let data_norm = finite("norm of the data", norm(data))?;
    // Residuals and directions are divided by norms, so that products with A neither under- nor overflow in `T`.
    update(&mut residual, data, |_, b| {
        T::of(b.f64() / or_one(data_norm))
    });
    operator.adjoint_into(&residual, &mut gradient)?;
    let gradient_scale = norm(&gradient);

    // The norm of the gradient before the last step; 0 where the residual is computed from the image: at the start, and where the recurrence,
    // which rounding separates from the image, meets a rule.
    let mut previous = 0.0;
    let (mut unit, mut at_restart) = (1.0, [f64::INFINITY; 2]);
    loop {
        let from_image = previous == 0.0;
        if from_image {
            operator.forward_into(image, &mut residual)?;
            unit = unit_residual(data, &mut residual)?;
        }
        operator.adjoint_into(&residual, &mut gradient)?;
        let slope = norm(&gradient);
        let size = finite("norm of the gradient", slope * (unit / or_one(data_norm)))?;
        let mut entry = Iteration::at(relative(unit * norm(&residual), data_norm));
        entry.gradient = Some(relative(size, gradient_scale));
        if let Some(why) = monitor.met(entry.residual, size, gradient_scale) {
            if from_image {
                monitor.stop_at(entry, why);
                break;
            }
            previous = 0.0;
            continue;
        }
        let sizes = [entry.residual, size];
        let stuck = from_image && (0..2).all(|k| sizes[k] > 0.5 * at_restart[k]);
        if stuck || monitor.is_last() {
            break;
        }
        let beta = if from_image { 0.0 } else { slope / previous };
        at_restart = if from_image { sizes } else { at_restart };
        update(&mut direction, &gradient, |d, g| {
            T::of(g.f64() / slope + beta * d.f64())
        });
        previous = slope;

        operator.forward_into(&direction, &mut projected)?;
        let speed = finite("norm of A d", norm(&projected))?;
        if speed == 0.0 {
            // The gradient is rounding noise outside the range of Aᵀ.
            break;
        }
        let alpha = slope / speed / speed;
        // The gradient is no longer needed; its memory takes the next image.
        let change = advance(image, &direction, unit * alpha, &mut gradient)?;
        entry.change = Some(change);
        update(&mut residual, &projected, |r, q| {
            T::of(r.f64() - alpha * q.f64())
        });
        if monitor.step(entry, image) {
            break;
        }
    }
    monitor.finish()
}
