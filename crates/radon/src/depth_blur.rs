//! Blur of the slabs of a view, each by a Gaussian of its own width.
//!
//! A slab of variance V is divided between two [nodes](crate::response), which are blurred instead. The kernels are lattice Gaussians, whose
//! variances are exact.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::error::{at_least, finite, length, positive, within};
use crate::response::Nodes;
use crate::{RadonError, Sample};

/// Blurs slabs of views `[row][slab][bin]` and adds them: a plan, shared by threads.
///
/// ```
/// use radon::DepthBlur;
/// // Two slabs, blurred by 0.3 and 0.5 cm (standard deviations), on bins and rows of 0.4 cm.
/// let blur = DepthBlur::new(&[0.3 * 0.3, 0.5 * 0.5], [0.4; 2], 1e-4)?;
/// let [_, above] = blur.reach();
/// let (n_bins, n_rows) = (41, 1 + 2 * above);
/// let mut slabs = vec![0.0_f64; n_rows * 2 * n_bins];
/// slabs[2 * above * n_bins + 20] = 3.0; // a point in the first slab
/// slabs[(2 * above + 1) * n_bins + 20] = 1.0; // one in the second
/// let mut all = vec![0.0; n_rows * n_bins];
/// blur.apply(&slabs, n_bins, 0, &mut all)?;
/// assert!((all.iter().sum::<f64>() - 4.0).abs() < 1e-12);
/// let x = |k: usize| 0.4 * ((k % n_bins) as f64 - 20.0);
/// let variance: f64 = all.iter().enumerate().map(|(k, v)| v / 4.0 * x(k).powi(2)).sum();
/// assert!((variance - (3.0 * 0.09 + 0.25) / 4.0).abs() < 1e-9);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone)]
#[doc(alias = "PSF")]
pub struct DepthBlur {
    /// For each slab the narrower node, and the fraction of the next one.
    slabs: Vec<(usize, f64)>,
    nodes: Arc<Nodes>,
}

impl DepthBlur {
    /// Plans the blur of slabs by these variances (cm^2; one at least, in any order) for bins and rows of `pitch` (cm). `tolerance` bounds
    /// the relative error of the peak of a point's image.
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no slab; [`RadonError::NotFinite`], [`RadonError::NotPositive`] for a pitch; [`RadonError::OutOfRange`]
    /// for a variance below zero, a tolerance outside 1e-12 to 1, or variances that need more than 1e5 blurs or 1e8 weights;
    /// [`RadonError::TooLarge`].
    pub fn new(variances: &[f64], pitch: [f64; 2], tolerance: f64) -> Result<Self, RadonError> {
        at_least("slabs of a blur", variances.len(), 1)?;
        within("tolerance of a blur", tolerance, 1e-12, 1.0)?;
        for axis in 0..2 {
            positive("pitch", pitch[axis])?;
        }
        for &variance in variances {
            within("variance of a slab", variance, 0.0, f64::MAX)?;
        }
        let far = variances.iter().fold(0.0, |m: f64, &v| m.max(v));
        let near = variances.iter().fold(far, |m: f64, &v| m.min(v));
        let nodes = Nodes::new([near, far], pitch, tolerance)?;
        Ok(Self {
            slabs: variances.iter().map(|&v| nodes.fraction(v)).collect(),
            nodes: Arc::new(nodes),
        })
    }

    /// Returns the blur of some of the slabs, which shares the kernels.
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no slab; [`RadonError::WrongLength`] for slabs that there are not.
    pub fn slabs(&self, slabs: Range<usize>) -> Result<Self, RadonError> {
        at_least("slabs of a blur", slabs.len(), 1)?;
        let of = self.slabs.get(slabs.clone());
        length("slabs", self.slabs.len(), slabs.end.max(self.slabs.len()))?;
        Ok(Self {
            slabs: of.unwrap_or_default().to_vec(),
            nodes: Arc::clone(&self.nodes),
        })
    }

    /// Returns the largest numbers of bins and of rows over which a sample is spread.
    #[must_use]
    pub fn reach(&self) -> [usize; 2] {
        let reach = |axis: usize| {
            self.nodes.kernels[self.used()]
                .iter()
                .map(move |k| k[axis].len() - 1)
        };
        [0, 1].map(|axis| reach(axis).max().unwrap_or(0))
    }

    /// Returns an upper bound on the deviation of the image of a point between the nodes from the lattice Gaussian of its variance,
    /// relative to its peak, without the rounding of samples.
    ///
    /// # Errors
    /// [`RadonError::TooLarge`].
    pub fn error(&self) -> Result<f64, RadonError> {
        Ok(self.nodes.deviation()?.peak)
    }

    /// Returns the number of blurs of a view.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.used().len()
    }

    /// The nodes among which the slabs are divided.
    fn used(&self) -> Range<usize> {
        let ends = (self.slabs.iter()).map(|&(node, next)| [node, node + usize::from(next != 0.0)]);
        let all = ends.fold([usize::MAX, 0], |[low, high], [a, b]| {
            [low.min(a), high.max(b)]
        });
        all[0]..all[1] + 1
    }

    /// Adds the blurred slabs `[row][slab][bin]` of a view: `out` is `[row][bin]` and starts at row `above` of the given ones. Samples
    /// beyond the given rows and bins count as zero; rows of a larger view need [`reach`](Self::reach) more on either side.
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no bin; [`RadonError::WrongLength`] for incomplete or missing rows; [`RadonError::NotFinite`] for a sample.
    pub fn apply<T: Sample>(
        &self,
        slabs: &[T],
        n_bins: usize,
        above: usize,
        out: &mut [T],
    ) -> Result<(), RadonError> {
        at_least("bins", n_bins, 1)?;
        let row = n_bins.saturating_mul(self.slabs.len());
        let n_rows = slabs.len() / row;
        length("slabs", slabs.len(), n_rows * row)?;
        length("rows", out.len(), out.len() / n_bins * n_bins)?;
        if (above.saturating_mul(n_bins)).saturating_add(out.len()) > n_rows * n_bins {
            length("rows", out.len(), n_rows.saturating_sub(above) * n_bins)?;
        }
        for sample in slabs {
            finite("sample", sample.f64())?;
        }
        out.fill(T::ZERO);
        if slabs.is_empty() {
            return Ok(());
        }
        self.blur(slabs, [n_bins, above], out);
        Ok(())
    }

    /// [`Self::apply`] for validated samples.
    fn blur<T: Sample>(&self, slabs: &[T], [n_bins, above]: [usize; 2], out: &mut [T]) {
        let n_rows = slabs.len() / (n_bins * self.slabs.len());
        let used = self.used();
        let mut images = vec![T::ZERO; (1 + used.len()) * n_rows * n_bins];
        let (view, images) = images.split_at_mut(n_rows * n_bins);
        for (row, slabs) in slabs.chunks(n_bins * self.slabs.len()).enumerate() {
            for (slab, &(node, next)) in slabs.chunks(n_bins).zip(&self.slabs) {
                for (node, share) in [(node, 1.0 - next), (node + 1, next)] {
                    if share != 0.0 {
                        let at = (node - used.start) * n_rows + row;
                        let image = &mut images[at * n_bins..][..n_bins];
                        let share = T::of(share);
                        for (sum, v) in image.iter_mut().zip(slab) {
                            *sum += share * *v;
                        }
                    }
                }
            }
        }
        let kernels = &self.nodes.kernels[used];
        for (image, [along, across]) in images.chunks_mut(n_rows * n_bins).zip(kernels) {
            let reach = along.len() - 1;
            image.par_chunks_mut(n_bins).for_each(|row| {
                let padded = zero_padded(row, reach);
                weigh(row, &padded, 1, along);
            });
            let padded = zero_padded(image, (across.len() - 1) * n_bins);
            weigh(image, &padded, n_bins, across);
            for (sum, v) in view.iter_mut().zip(&*image) {
                *sum += *v;
            }
        }
        out.copy_from_slice(&view[above * n_bins..][..out.len()]);
    }
}

fn zero_padded<T: Sample>(samples: &[T], beside: usize) -> Vec<T> {
    let mut padded = vec![T::ZERO; samples.len() + 2 * beside];
    padded[beside..beside + samples.len()].copy_from_slice(samples);
    padded
}

/// Computes weighted sums of items of `stride` samples and their neighbours.
fn weigh<T: Sample>(out: &mut [T], padded: &[T], stride: usize, weights: &[f64]) {
    let weights: Vec<T> = weights.iter().map(|&w| T::of(w)).collect();
    let reach = weights.len() - 1;
    // Corresponding samples of all items are `stride` apart, so that one shift of the whole array pairs them all.
    let len = out.len();
    let at = |k: usize| &padded[k * stride..k * stride + len];
    for (out, v) in out.iter_mut().zip(at(reach)) {
        *out = weights[0] * *v;
    }
    for k in 1..=reach {
        for ((out, a), b) in out.iter_mut().zip(at(reach - k)).zip(at(reach + k)) {
            *out += weights[k] * (*a + *b);
        }
    }
}
