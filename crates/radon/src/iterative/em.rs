//! Expectation maximisation for Poisson data: MLEM and its ordered subsets.

use std::ops::ControlFlow;

use super::operator::{Checked, LinearOperator};
use super::report::{Iteration, IterativeReport, StopReason};
use super::stopping::{Monitor, Observer, Stopping};
use super::vectors::{
    check_not_negative, check_samples, norm, relative, relative_change, sum2, update,
};
use crate::Sample;
use crate::error::{RadonError, finite, length, zeros};

/// Options of [`mlem`] and [`osem`].
///
/// ```
/// use radon::{EmOptions, Stopping};
/// let options = EmOptions::default()
///     .with_stopping(Stopping::default().with_max_iterations(20))
///     .with_background(vec![0.5_f32; 90 * 64]); // scatter, the same in every bin of 90 views
/// assert_eq!(options.stopping.max_iterations, 20);
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct EmOptions<T> {
    /// Stopping rules; an iteration of OSEM processes all subsets.
    pub stopping: Stopping,
    /// Expected counts that do not come from the image (scatter, randoms), one per datum; empty for none.
    pub background: Vec<T>,
}

impl<T> Default for EmOptions<T> {
    /// Fifty iterations without a background.
    fn default() -> Self {
        Self {
            stopping: Stopping::default(),
            background: Vec::new(),
        }
    }
}

impl<T> EmOptions<T> {
    setters! {
        /// Sets the stopping rules.
        with_stopping(stopping: Stopping);
        /// Sets the expected counts that do not come from the image.
        with_background(background: Vec<T>);
    }
}

/// A subset of the data and its projection operator.
#[derive(Debug, Clone)]
pub struct Subset<O> {
    /// Rows of A.
    pub operator: O,
    /// Indices of the data, in the order of the operator's.
    pub data: Vec<usize>,
}

/// MLEM from the given image: x ← x / (Aᵀ 1) · Aᵀ (b / (A x + s)).
///
/// Each step increases the Poisson likelihood and keeps x >= 0. Without background, the total of A x equals that of b (Shepp & Vardi 1982,
/// doi:10.1109/TMI.1982.4307558). A needs entries >= 0. Pixels that are zero stay zero: start from a positive image. Pixels without data
/// keep their value; data with counts where A x + s = 0 are ignored. Cost of a step: one forward, one adjoint. `watch`: see
/// [`no_observer`](crate::no_observer).
///
/// ```
/// use radon::{EmOptions, ImageGrid, Kernel, ParallelGeometry, Projector, mlem};
/// let geometry = ParallelGeometry::half_turn(30, 16, 1.0)?;
/// let projector = Projector::new(&geometry, &ImageGrid::square(11, 1.0)?, Kernel::Strip)?;
/// let truth: Vec<f64> = (0..121).map(|i| f64::from(i % 3)).collect();
/// let counts = projector.forward(&truth)?;
/// let mut image = vec![1.0; 121];
/// let report = mlem(&projector, &counts, &mut image, &EmOptions::default(), radon::no_observer)?;
/// let seen: f64 = projector.forward(&image)?.iter().sum();
/// assert!((seen / counts.iter().sum::<f64>() - 1.0).abs() < 1e-12); // the counts are kept
/// assert!(report.history[49].residual < 0.5 * report.history[0].residual);
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// As [`cgls`](crate::cgls); [`RadonError::NegativeSample`] for data, image, background or a column sum. `image` always contains the last
/// finite iterate.
#[doc(alias("ML-EM", "Lucy-Richardson"))]
pub fn mlem<T: Sample, O: LinearOperator<T> + ?Sized>(
    operator: &O,
    data: &[T],
    image: &mut [T],
    options: &EmOptions<T>,
    mut watch: impl FnMut(&IterativeReport, &[T]) -> ControlFlow<()>,
) -> Result<IterativeReport, RadonError> {
    let operator = Checked(&operator);
    operator.check_input(data, image)?;
    let all = Part {
        operator,
        indices: None,
    };
    run(&[all], data, image, options, &mut watch)
}

/// OSEM: the step of [`mlem`] with one subset of the data after the other (Hudson & Larkin 1994, doi:10.1109/42.363108).
///
/// An iteration with n subsets advances about as far as n steps of MLEM and costs as much as one. OSEM does not converge in general, but
/// cycles about the solution. Residual and likelihood in the history are sums over the subsets, each before its step; with more than one
/// subset the residual rule stops after the iteration that met it.
///
/// ```
/// use radon::{EmOptions, ImageGrid, Kernel, ParallelGeometry, Projector, StackOrder, Stopping, osem};
/// let geometry = ParallelGeometry::half_turn(60, 24, 1.0)?;
/// let projector = Projector::new(&geometry, &ImageGrid::square(16, 1.0)?, Kernel::Strip)?;
/// let counts = projector.forward(&(0..256).map(|i| f64::from(i % 5)).collect::<Vec<_>>())?;
/// let subsets = projector.stack_operator(1, StackOrder::ViewSliceBin)?.subsets(6)?; // of ten views each
/// let stopping = Stopping::default().with_max_iterations(4); // four passes
/// let mut image = vec![1.0; 256];
/// let report = osem(&subsets, &counts, &mut image, &EmOptions::default().with_stopping(stopping), radon::no_observer)?;
/// assert!(report.history[3].residual < 0.5 * report.history[0].residual);
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// As [`mlem`]; [`RadonError::TooFew`] without a subset, [`RadonError::BadRange`] for an index beyond the data.
#[doc(alias("OS-EM", "ordered subsets"))]
pub fn osem<T: Sample, O: LinearOperator<T>>(
    subsets: &[Subset<O>],
    data: &[T],
    image: &mut [T],
    options: &EmOptions<T>,
    mut watch: impl FnMut(&IterativeReport, &[T]) -> ControlFlow<()>,
) -> Result<IterativeReport, RadonError> {
    crate::error::at_least("subsets", subsets.len(), 1)?;
    check_samples("data", data)?;
    check_samples("image", image)?;
    for subset in subsets {
        length("subset", subset.data.len(), subset.operator.data_len())?;
        length("image", image.len(), subset.operator.image_len())?;
        if let Some(&index) = subset.data.iter().find(|&&i| i >= data.len()) {
            return Err(RadonError::BadRange {
                what: "subset",
                start: index,
                end: index.saturating_add(1),
                len: data.len(),
            });
        }
    }
    let parts: Vec<_> = subsets
        .iter()
        .map(|subset| Part {
            operator: Checked(&subset.operator),
            indices: Some(&subset.data),
        })
        .collect();
    run(&parts, data, image, options, &mut watch)
}

/// A subset, or all data in order.
struct Part<'a, T> {
    operator: Checked<'a, T>,
    indices: Option<&'a [usize]>,
}

impl<T: Sample> Part<'_, T> {
    fn select(&self, from: &[T]) -> Vec<T> {
        match self.indices {
            None => from.to_vec(),
            Some(indices) => indices.iter().map(|&i| from[i]).collect(),
        }
    }

    fn prepare(
        &self,
        data: &[T],
        background: &[T],
        image_len: usize,
    ) -> Result<Prepared<T>, RadonError> {
        let mut sensitivity = zeros("column sums", image_len, 1)?;
        let counts = self.select(data);
        let ones = vec![T::ONE; counts.len()];
        self.operator.adjoint_into(&ones, &mut sensitivity)?;
        check_not_negative("column sums", &sensitivity)?;
        let background = match background.is_empty() {
            true => vec![T::ZERO; counts.len()],
            false => self.select(background),
        };
        Ok(Prepared {
            counts,
            background,
            sensitivity,
        })
    }
}

/// Precomputed arrays of a subset.
struct Prepared<T> {
    counts: Vec<T>,
    background: Vec<T>,
    /// Aᵀ 1.
    sensitivity: Vec<T>,
}

fn run<T: Sample>(
    parts: &[Part<'_, T>],
    data: &[T],
    image: &mut [T],
    options: &EmOptions<T>,
    observe: Observer<'_, T>,
) -> Result<IterativeReport, RadonError> {
    let background = &options.background;
    let mut monitor = Monitor::new(options.stopping, None, observe)?;
    check_not_negative("data", data)?;
    check_not_negative("image", image)?;
    if !background.is_empty() {
        length("background", background.len(), data.len())?;
        check_samples("background", background)?;
        check_not_negative("background", background)?;
    }
    let prepare = |part: &Part<'_, T>| part.prepare(data, background, image.len());
    let prepared: Vec<_> = parts.iter().map(prepare).collect::<Result<_, _>>()?;

    let data_norm = finite("norm of the data", norm(data))?;
    let mut factor = zeros("factors", image.len(), 1)?;
    let mut start = zeros("image", image.len(), 1)?;
    // Without subsets the residual of an image is known before it changes.
    let whole = parts.len() == 1;
    loop {
        let last = monitor.is_last();
        if last && !(whole && monitor.wants_residual()) {
            break;
        }
        start.copy_from_slice(image);
        let (mut misfit_sq, mut log_likelihood) = (0.0, 0.0);
        for (part, prepared) in parts.iter().zip(&prepared) {
            let counts = &prepared.counts;
            let mut expected = vec![T::ZERO; counts.len()];
            part.operator.forward_into(image, &mut expected)?;
            update(&mut expected, &prepared.background, |ax, s| ax + s);
            misfit_sq += sum2(&expected, counts, |e, b| (e - b) * (e - b));
            log_likelihood += sum2(&expected, counts, |e, b| {
                if b > 0.0 && e > 0.0 {
                    b * e.ln() - e
                } else {
                    -e
                }
            });
            let residual = relative(finite("norm of the residual", misfit_sq.sqrt())?, data_norm);
            if whole && (last || monitor.is_explained(residual)) {
                break;
            }
            update(&mut expected, counts, |e, b| {
                if e > T::ZERO { b / e } else { T::ZERO }
            });
            part.operator.adjoint_into(&expected, &mut factor)?;
            update(&mut factor, &prepared.sensitivity, |f, s| {
                if s > T::ZERO { f / s } else { T::ONE }
            });
            update(&mut factor, image, |f, x| x * f);
            check_samples("next image", &factor)?;
            image.copy_from_slice(&factor);
        }
        let residual = relative(misfit_sq.sqrt(), data_norm);
        let met = monitor.is_explained(residual);
        let mut entry = Iteration::at(residual);
        entry.log_likelihood = Some(log_likelihood);
        if met && whole {
            monitor.stop_at(entry, StopReason::Residual);
            break;
        }
        if met {
            monitor.stop_after(StopReason::Residual);
        }
        if last {
            break;
        }
        entry.change = Some(finite(
            "change of the image",
            relative_change(image, &start),
        )?);
        if monitor.step(entry, image) {
            break;
        }
    }
    monitor.finish()
}
