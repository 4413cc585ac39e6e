//! Blur of a detector: a Gaussian of the same width at every depth.
//!
//! Along each axis the samples are convolved with `w_k = exp(-k^2 / (2 sigma^2)) / sum`, `sigma = FWHM / (2 sqrt(2 ln 2))` in
//! bins, for |k| up to 5 sigma (beyond lie 6e-7 of it). The variance of these weights is sigma^2 to 1e-3 of it from a FWHM of
//! 1.7 bins on; a narrower Gaussian is hardly seen by the bins and blurs less than its width says.
//!
//! At the edges the image is continued by its mirror image, edge sample doubled: counts are kept, a uniform image stays
//! uniform, and the blur is its own adjoint.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{at_least, finite, length, positive, product, within, zeros};
use crate::{RadonError, Sample};

/// Weights beyond this many standard deviations are dropped.
const REACH: f64 = 5.0;

/// A Gaussian blur of detector images `[view][row][bin]`: a plan, shared by threads.
///
/// ```
/// use radon::Blur;
/// let blur = Blur::new([9, 1], [0.5, 0.5], 1.5)?;
/// let mut view = vec![0.0_f64; 9];
/// view[4] = 100.0;
/// blur.apply(&mut view)?;
/// assert!((view.iter().sum::<f64>() - 100.0).abs() < 1e-12);
/// // Half of its height, half of 1.5 cm = 1.5 bins to either side.
/// let half = (view[2] * view[3]).sqrt() / view[4];
/// assert!((half - 2.0_f64.powf(-(1.5_f64.powi(2) + 0.25) / 1.5_f64.powi(2))).abs() < 1e-12);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Blur {
    size: [usize; 2],
    /// Weights k = 0, 1, ... along the bins and along the rows.
    weights: [Vec<f64>; 2],
}

impl Blur {
    /// A blur of full width at half maximum `fwhm` (cm) for images of `size` = [bins, rows] at `pitch` = [bin, row] (cm).
    ///
    /// # Errors
    /// [`RadonError::TooFew`] for no bin or row, [`RadonError::NotPositive`], [`RadonError::NotFinite`] for a pitch,
    /// [`RadonError::OutOfRange`] for a width below zero or above the detector's smaller side but one of a single bin or row,
    /// [`RadonError::TooLarge`].
    pub fn new(size: [usize; 2], pitch: [f64; 2], fwhm: f64) -> Result<Self, RadonError> {
        at_least("bins", size[0], 1)?;
        at_least("rows", size[1], 1)?;
        product("bins by rows", size[0], size[1])?;
        let mut weights = [vec![1.0], vec![1.0]];
        for axis in 0..2 {
            positive("pitch", pitch[axis])?;
            let most = pitch[axis] * size[axis] as f64;
            if size[axis] == 1 {
                // Its own mirror image on both sides: nothing to blur.
                within("FWHM of the blur", fwhm, 0.0, f64::MAX)?;
                continue;
            }
            within("FWHM of the blur", fwhm, 0.0, most)?;
            let sigma = fwhm / (8.0 * std::f64::consts::LN_2).sqrt() / pitch[axis];
            let reach = (REACH * sigma).floor() as usize;
            let mut one_side: Vec<f64> = zeros("weights of a blur", reach, 1)?;
            for (k, weight) in one_side.iter_mut().enumerate() {
                *weight = (-0.5 * ((k + 1) as f64 / sigma).powi(2)).exp();
            }
            let sum = 1.0 + 2.0 * one_side.iter().rev().sum::<f64>();
            weights[axis] = vec![1.0 / sum];
            weights[axis].extend(one_side.iter().map(|w| w / sum));
        }
        Ok(Self { size, weights })
    }

    /// The weights of a sample's neighbours k = 0, 1, ... bins (axis 0) or rows (axis 1) away; none along another axis.
    pub fn weights(&self, axis: usize) -> &[f64] {
        self.weights.get(axis).map_or(&[], Vec::as_slice)
    }

    /// Blurs images `[view][row][bin]` in place; views are shared among threads, with the same bits for any number of them.
    ///
    /// # Errors
    /// [`RadonError::WrongLength`] unless there are whole views, [`RadonError::NotFinite`] for a sample, before any is
    /// changed.
    pub fn apply<T: Sample>(&self, samples: &mut [T]) -> Result<(), RadonError> {
        let view = self.size[0] * self.size[1];
        self.check(samples, view)?;
        samples.par_chunks_mut(view).for_each(|image| {
            self.along_bins(image);
            if self.weights[1].len() > 1 {
                let padded = self.padded(image, 0, 0..self.size[1]);
                weigh(image, &padded, self.size[0], &self.weights[1]);
            }
        });
        Ok(())
    }

    /// The rows of an image that some rows of the blurred image are made of.
    pub fn rows_seen(&self, rows: &Range<usize>) -> Range<usize> {
        let reach = self.weights[1].len() - 1;
        rows.start.saturating_sub(reach)..rows.end.saturating_add(reach).min(self.size[1])
    }

    /// Some rows of blurred images `[view][row][bin]`, from images of the rows that [`Blur::rows_seen`] tells and no others: the
    /// bits that [`Blur::apply`] gives them, for the work of these rows.
    ///
    /// ```
    /// use radon::Blur;
    /// let blur = Blur::new([4, 100], [0.5, 0.5], 1.0)?;
    /// let seen = blur.rows_seen(&(50..51));
    /// assert_eq!(seen, 46..55);
    /// let row = blur.rows(vec![1.0_f32; 4 * 9], &(50..51))?;
    /// assert!(row.iter().all(|v| (v - 1.0).abs() < 1e-6));
    /// # Ok::<(), radon::RadonError>(())
    /// ```
    ///
    /// # Errors
    /// [`RadonError::OutOfRange`] for rows that there are not; as [`Blur::apply`].
    pub fn rows<T: Sample>(
        &self,
        mut samples: Vec<T>,
        rows: &Range<usize>,
    ) -> Result<Vec<T>, RadonError> {
        let n_bins = self.size[0];
        within("last row", rows.end as f64, 1.0, self.size[1] as f64)?;
        within("first row", rows.start as f64, 0.0, rows.end as f64 - 1.0)?;
        let seen = self.rows_seen(rows);
        let view = seen.len() * n_bins;
        self.check(&samples, view)?;
        let mut out = vec![T::ZERO; samples.len() / view * rows.len() * n_bins];
        (out.par_chunks_mut(rows.len() * n_bins))
            .zip(samples.par_chunks_mut(view))
            .for_each(|(out, image)| {
                self.along_bins(image);
                let padded = self.padded(image, seen.start, rows.clone());
                weigh(out, &padded, n_bins, &self.weights[1]);
            });
        Ok(out)
    }

    fn check<T: Sample>(&self, samples: &[T], view: usize) -> Result<(), RadonError> {
        let views = samples.len().div_ceil(view);
        length("images", samples.len(), views * view)?;
        for s in samples {
            finite("sample", s.f64())?;
        }
        Ok(())
    }

    fn along_bins<T: Sample>(&self, image: &mut [T]) {
        let weights = &self.weights[0];
        if weights.len() > 1 {
            for row in image.chunks_mut(self.size[0]) {
                let padded = mirrored(row, 1, [0, self.size[0]], 0..self.size[0], weights);
                weigh(row, &padded, 1, weights);
            }
        }
    }

    /// Some rows with all that are within reach, from an image whose first row is number `first` of all.
    fn padded<T: Sample>(&self, image: &[T], first: usize, rows: Range<usize>) -> Vec<T> {
        let [n_bins, n_rows] = self.size;
        mirrored(image, n_bins, [first, n_rows], rows, &self.weights[1])
    }
}

/// Items of `stride` samples, wanted ones and those within reach on either side; beyond the edges of all `n` items lie their
/// mirror images, so that sums need no test. The samples are those of the items from number `first` on.
fn mirrored<T: Sample>(
    samples: &[T],
    stride: usize,
    [first, n]: [usize; 2],
    wanted: Range<usize>,
    weights: &[f64],
) -> Vec<T> {
    let reach = weights.len() - 1;
    let mut padded = Vec::with_capacity((wanted.len() + 2 * reach) * stride);
    for k in wanted.start..wanted.end + 2 * reach {
        let k = (k as isize - reach as isize).rem_euclid(2 * n as isize) as usize;
        let from = (k.min(2 * n - 1 - k) - first) * stride;
        padded.extend_from_slice(&samples[from..from + stride]);
    }
    padded
}

/// Weighs items of `stride` samples with their neighbours.
fn weigh<T: Sample>(out: &mut [T], padded: &[T], stride: usize, weights: &[f64]) {
    let weights: Vec<T> = weights.iter().map(|&w| T::of(w)).collect();
    let reach = weights.len() - 1;
    // Samples at one place of all items are `stride` apart, so one shift of the whole array pairs them all.
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
