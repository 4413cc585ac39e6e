//! Simultaneous iterative reconstruction.

use std::ops::ControlFlow;

use super::operator::{Checked, LinearOperator};
use super::report::{Iteration, IterativeReport, StopReason};
use super::stopping::{Monitor, Observer, Stopping};
use super::vectors::{check_not_negative, check_samples, norm, relative, relative_change, update};
use crate::Sample;
use crate::error::{RadonError, finite, within, zeros};

/// Options of [`sirt`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct SirtOptions {
    /// Stopping rules.
    pub stopping: Stopping,
    /// Factor λ of each step, 0 < λ < 2; 1 by default.
    pub relaxation: f64,
    /// Smallest value a pixel may take, if any.
    pub lower: Option<f64>,
    /// Largest value a pixel may take, if any.
    pub upper: Option<f64>,
}

impl Default for SirtOptions {
    /// Fifty full steps without bounds.
    fn default() -> Self {
        Self {
            stopping: Stopping::default(),
            relaxation: 1.0,
            lower: None,
            upper: None,
        }
    }
}

impl SirtOptions {
    setters! {
        /// Sets the stopping rules.
        with_stopping(stopping: Stopping);
        /// Sets the relaxation factor.
        with_relaxation(relaxation: f64);
        /// Sets the lower bound of pixel values.
        with_lower(lower: f64);
        /// Sets the upper bound of pixel values.
        with_upper(upper: f64);
    }
}

/// SIRT from the given image: x ← x + λ C Aᵀ R (b - A x), then the bounds.
///
/// R and C contain the reciprocals of the row and column sums of A, which must not be negative. Converges for 0 < λ < 2 to a minimum of Σ R
/// (b - A x)² within the bounds (Gregor & Benson 2008, doi:10.1109/TMI.2008.923696). Rows and columns without weight are ignored. Cost of a
/// step: one forward, one adjoint. `watch`: see [`no_observer`](crate::no_observer).
///
/// ```
/// use radon::{ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector, SirtOptions, Stopping, sirt};
/// let geometry = ParallelGeometry::half_turn(30, 24, 1.0)?;
/// let projector = Projector::new(&geometry, &ImageGrid::square(16, 1.0)?, Kernel::Joseph)?;
/// let data = projector.forward(&(0..256).map(|i| f64::from(i % 5)).collect::<Vec<_>>())?;
/// let stopping = Stopping::default().with_max_iterations(500).with_residual(0.03);
/// let options = SirtOptions::default().with_lower(0.0).with_stopping(stopping);
/// let mut image = vec![0.0; 256];
/// let report = sirt(&projector, &data, &mut image, &options, radon::no_observer)?; // an error if 500 steps do not suffice
/// assert!(report.history[report.iterations].residual <= 0.03);
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// As [`cgls`](crate::cgls); [`RadonError::NegativeSample`] for a row or column sum. `image` always contains the last finite iterate.
#[doc(alias = "sart")]
pub fn sirt<T: Sample, O: LinearOperator<T> + ?Sized>(
    operator: &O,
    data: &[T],
    image: &mut [T],
    options: &SirtOptions,
    mut watch: impl FnMut(&IterativeReport, &[T]) -> ControlFlow<()>,
) -> Result<IterativeReport, RadonError> {
    run(&operator, data, image, options, &mut watch)
}

fn run<T: Sample>(
    operator: &dyn LinearOperator<T>,
    data: &[T],
    image: &mut [T],
    options: &SirtOptions,
    observe: Observer<'_, T>,
) -> Result<IterativeReport, RadonError> {
    let operator = Checked(operator);
    operator.check_input(data, image)?;
    let mut monitor = Monitor::new(options.stopping, None, observe)?;
    let most = 2.0_f64.next_down();
    within("relaxation", options.relaxation, f64::MIN_POSITIVE, most)?;
    let least = options.lower.map_or(Ok(f64::MIN), |l| {
        within("lower bound", l, f64::MIN, f64::MAX).map(|()| l)
    })?;
    if let Some(upper) = options.upper {
        within("upper bound", upper, least, f64::MAX)?;
    }

    let mut rows = zeros("row sums", data.len(), 1)?;
    operator.forward_into(&vec![T::ONE; image.len()], &mut rows)?;
    check_not_negative("row sums", &rows)?;
    let mut columns = zeros("column sums", image.len(), 1)?;
    operator.adjoint_into(&vec![T::ONE; data.len()], &mut columns)?;
    check_not_negative("column sums", &columns)?;

    let inverse = |x: T| if x > T::ZERO { T::ONE / x } else { T::ZERO };
    let bounds = (options.lower.map(T::of), options.upper.map(T::of));
    let data_norm = finite("norm of the data", norm(data))?;
    let mut residual = zeros("residual", data.len(), 1)?;
    let mut step = zeros("step", image.len(), 1)?;
    loop {
        let last = monitor.is_last();
        if last && !monitor.wants_residual() {
            break;
        }
        operator.forward_into(image, &mut residual)?;
        update(&mut residual, data, |ax, b| b - ax);
        let size = relative(finite("norm of the residual", norm(&residual))?, data_norm);
        let mut entry = Iteration::at(size);
        if monitor.is_explained(size) {
            monitor.stop_at(entry, StopReason::Residual);
            break;
        }
        if last {
            break;
        }
        update(&mut residual, &rows, |r, sum| r * inverse(sum));
        operator.adjoint_into(&residual, &mut step)?;
        let factor = T::of(options.relaxation);
        update(&mut step, &columns, |s, sum| factor * s * inverse(sum));
        // `step` now contains the new image, then the actual change within the bounds.
        update(&mut step, image, |s, x| {
            let mut new = x + s;
            if let Some(lower) = bounds.0.filter(|&l| new < l) {
                new = lower;
            }
            if let Some(upper) = bounds.1.filter(|&u| new > u) {
                new = upper;
            }
            new
        });
        check_samples("next image", &step)?;
        entry.change = Some(finite(
            "change of the image",
            relative_change(&step, image),
        )?);
        image.copy_from_slice(&step);
        if monitor.step(entry, image) {
            break;
        }
    }
    monitor.finish()
}
