//! Conjugate gradients for least squares.

use std::ops::ControlFlow;

use super::operator::{Checked, LinearOperator};
use super::report::{Iteration, IterativeReport, StopReason};
use super::stopping::{Monitor, Observer, Stopping};
use super::vectors::{check_samples, norm, relative, update};
use crate::Sample;
use crate::error::{RadonError, finite, within, zeros};

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
    /// Stop at ‖Aᵀ(b - A x)‖ <= this times ‖Aᵀ b‖.
    pub gradient: Option<f64>,
}

/// A norm whose square does not underflow, also after a reduction to rounding.
const LEAST_NORM: f64 = 1e-140;

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
/// # Errors
/// A wrong length, an option out of its range, NaN or infinity in the arguments, an error of the operator; [`RadonError::BadSample`] if the
/// operator returns NaN or infinity or the next image overflows, [`RadonError::NotFinite`] if a norm does, [`RadonError::OutOfRange`] for a
/// gradient at the start whose square underflows (below 1e-140): scale the data; [`RadonError::NotConverged`].
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

fn run<T: Sample>(
    operator: &dyn LinearOperator<T>,
    data: &[T],
    image: &mut [T],
    options: &CglsOptions,
    observe: Observer<'_, T>,
) -> Result<IterativeReport, RadonError> {
    let CglsOptions {
        stopping,
        gradient: gradient_rule,
    } = *options;
    let operator = Checked(operator);
    operator.check_input(data, image)?;
    let mut monitor = Monitor::new(stopping, gradient_rule, observe)?;

    let mut direction: Vec<T> = zeros("direction", image.len(), 1)?;
    let mut gradient: Vec<T> = zeros("gradient", image.len(), 1)?;
    let mut residual: Vec<T> = zeros("residual", data.len(), 1)?;
    let mut projected: Vec<T> = zeros("projections", data.len(), 1)?;
    let data_norm = finite("norm of the data", norm(data))?;
    operator.adjoint_into(data, &mut gradient)?;
    let gradient_scale = norm(&gradient);
    operator.forward_into(image, &mut residual)?;
    update(&mut residual, data, |ax, b| b - ax);

    let mut previous_sq = None;
    loop {
        operator.adjoint_into(&residual, &mut gradient)?;
        let gradient_norm = norm(&gradient);
        if previous_sq.is_none() && gradient.iter().any(|g| *g != T::ZERO) {
            let what = "norm of the gradient at the start";
            within(what, gradient_norm, LEAST_NORM, f64::MAX)?;
        }
        let gradient_sq = finite("squared norm of the gradient", gradient_norm.powi(2))?;
        let residual_norm = finite("norm of the residual", norm(&residual))?;
        let mut entry = Iteration::at(relative(residual_norm, data_norm));
        entry.gradient = Some(relative(gradient_norm, gradient_scale));
        let stopped_by = if monitor.is_explained(entry.residual) {
            Some(StopReason::Residual)
        } else if monitor.is_flat(gradient_norm, gradient_scale) {
            Some(StopReason::Gradient)
        } else if gradient_norm == 0.0 {
            Some(StopReason::Solved)
        } else {
            None
        };
        if let Some(why) = stopped_by {
            monitor.stop_at(entry, why);
            break;
        }
        if monitor.is_last() {
            break;
        }
        let beta = T::of(previous_sq.map_or(0.0, |previous: f64| gradient_sq / previous));
        update(&mut direction, &gradient, |d, g| g + beta * d);
        previous_sq = Some(gradient_sq);

        operator.forward_into(&direction, &mut projected)?;
        let curvature = finite("squared norm of A d", norm(&projected).powi(2))?;
        if curvature == 0.0 {
            // The gradient is rounding noise outside the range of Aᵀ.
            monitor.stop_at(entry, StopReason::Solved);
            break;
        }
        let alpha = gradient_sq / curvature;
        // The gradient is no longer needed; its memory takes the next image, which becomes the caller's only if it is finite.
        let next = &mut gradient;
        next.copy_from_slice(image);
        update(next, &direction, |x, d| x + T::of(alpha) * d);
        check_samples("next image", next)?;
        let change = relative(alpha * norm(&direction), norm(next));
        entry.change = Some(finite("change of the image", change)?);
        image.copy_from_slice(next);
        update(&mut residual, &projected, |r, q| r - T::of(alpha) * q);
        if monitor.step(entry, image) {
            break;
        }
    }
    monitor.finish()
}
