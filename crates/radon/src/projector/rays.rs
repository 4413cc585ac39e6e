//! The traversal: pixels and weights of each ray.
//!
//! A view marches along the image axis that crosses more pixels of its rays. At every step `m` along it (a row or a column of pixels) a ray
//! crosses at the fractional pixel index
//!
//! ```text
//! f = base + bin * per_bin + m * per_step,        |per_step| <= 1
//! ```
//!
//! and each kernel distributes the step's path length to the pixels about `f`: pixel `i` gets the fraction of a blurred point at `f`
//! between `i - 1/2` and `i + 1/2`. The blur is a box of one pixel (Joseph), or a box of the pixels that the ray crosses within the
//! step, convolved with the bin's width (strip: exact areas). Forward, adjoint and matrix use the same pairs of pixels and weights.

use std::ops::Range;

use super::kernel::Kernel;
use crate::error::{RadonError, within};
use crate::simd::{InstructionSet, LinearRay, Pairs, Place, Snap, StripRay};
use crate::{ImageGrid, ParallelGeometry, Sample};

/// The part of an image in which rays are followed, and its position in memory.
///
/// A ray may enter and leave between the last pixel and the next: memory contains one more pixel on either side across.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Pixels across the rays, between which rays are interpolated.
    pub(super) across: Range<usize>,
    /// Steps along the rays.
    pub(super) along: Range<usize>,
    /// Distance in memory between neighbours across and along.
    pub(super) strides: [usize; 2],
    /// Position in memory of the first pixel of the first step.
    pub(super) origin: usize,
}

/// The rays that intersect a window: pairs of pixels and their weights.
#[derive(Debug, Default)]
pub(super) struct Rays<T> {
    pub(super) pairs: Pairs<T>,
    /// Each ray's bin and the end of its pairs.
    ends: Vec<(usize, usize)>,
}

impl<T> Rays<T> {
    /// Bin and pairs of the ray in place `i` of the order of bins.
    pub(super) fn get(&self, i: usize) -> Option<(usize, Range<usize>)> {
        let &(bin, end) = self.ends.get(i)?;
        let start = if i == 0 { 0 } else { self.ends[i - 1].1 };
        Some((bin, start..end))
    }

    /// Bin and pairs of each ray.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        (0..self.len()).filter_map(|i| self.get(i))
    }

    /// Number of rays.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }
}

/// Views whose rays are interleaved: neighbours use the same pixels, which then are in the cache.
const TOGETHER: usize = 4;

/// Lists view, bin and pairs of each ray: for each `TOGETHER` views the first ray of each, then the second of each, and so on.
pub(super) fn in_turn<T>(
    views: &[Rays<T>],
) -> impl Iterator<Item = (usize, usize, &Pairs<T>, Range<usize>)> {
    let groups = views.chunks(TOGETHER).enumerate();
    groups.flat_map(|(group, views)| {
        let most = views.iter().map(Rays::len).max().unwrap_or(0);
        (0..most).flat_map(move |i| {
            views.iter().enumerate().filter_map(move |(view, rays)| {
                let (bin, range) = rays.get(i)?;
                Some((group * TOGETHER + view, bin, &rays.pairs, range))
            })
        })
    })
}

/// The rays of one view.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// Whether steps are rows and rays are interpolated along x; otherwise the reverse.
    steps_are_rows: bool,
    base: f64,
    per_bin: f64,
    per_step: f64,
    /// The reciprocal of `per_step`, possibly infinite.
    steps_per_pixel: f64,
    n_bins: usize,
    /// Pixels along the interpolated axis.
    n_across: usize,
    /// Path length of a step.
    length: f64,
    /// Weights of any number of pixels per step; `None` for two pixels with weights linear in f.
    strip: Option<StripRay>,
    /// The first pixel of a step is floor(f + lead).
    lead: f64,
    /// Pixels a step may touch, on the grid or beyond it.
    n_taps: usize,
}

impl View {
    pub(super) fn new(
        geometry: &ParallelGeometry,
        grid: &ImageGrid,
        kernel: Kernel,
        theta: f64,
    ) -> Result<Self, RadonError> {
        let (sin, cos) = theta.sin_cos();
        let ([x, y], [dx, dy]) = (grid.pixel_centre(0, 0), grid.spacing());
        // A unit of length crosses |cos| / dy rows and |sin| / dx columns.
        let steps_are_rows = sin.abs() * (dy / dx) <= cos.abs();
        // Along the ray of bin s: a * across + b * along = s.
        let [a, b, across, along, d_across, d_along] = if steps_are_rows {
            [cos, sin, x, y, dx, dy]
        } else {
            [sin, cos, y, x, dy, dx]
        };
        let (n_across, n_steps) = if steps_are_rows {
            (grid.nx(), grid.ny())
        } else {
            (grid.ny(), grid.nx())
        };
        let per_bin = geometry.pitch() / (a * d_across);
        let per_step = -b / a * (d_along / d_across);
        let base = ((geometry.bin_centre(0) - along * b) / a - across) / d_across;
        // Beyond these limits a ray's pixel index has no fractional bits.
        within("pitch in pixels", per_bin.abs(), 1e-9, 1e9)?;
        let farthest = base.abs() + per_bin.abs() * geometry.n_bins() as f64 + n_steps as f64;
        within("distance of a ray in pixels", farthest, 0.0, 1e12)?;

        let (crossed, length) = (per_step.abs(), d_along / a.abs());
        let (strip, blur) = match kernel {
            Kernel::Joseph => (None, 1.0),
            Kernel::Strip => {
                let ray = StripRay::new([crossed, per_bin.abs()], per_step, length);
                (Some(ray), crossed + per_bin.abs())
            }
        };
        Ok(Self {
            steps_are_rows,
            base,
            per_bin,
            per_step,
            steps_per_pixel: 1.0 / per_step,
            n_bins: geometry.n_bins(),
            n_across,
            length,
            strip,
            lead: 0.5 - 0.5 * blur,
            n_taps: strip.map_or(2, |ray| ray.n_taps),
        })
    }

    /// Whether steps are rows of the image, and rays are interpolated along x.
    pub(super) fn steps_are_rows(&self) -> bool {
        self.steps_are_rows
    }

    /// Returns the ray of bin 0, with pixel 0 at position 1, if every step is distributed to two pixels.
    pub(super) fn linear_ray<T: Sample>(&self) -> Option<LinearRay<T>> {
        self.strip.is_none().then(|| self.linear())
    }

    fn linear<T: Sample>(&self) -> LinearRay<T> {
        let snap = self.snap::<T>();
        LinearRay {
            offset: snap.of(self.offset(0)),
            per_step: self.per_step,
            snap,
            length: T::of(self.length),
        }
    }

    /// Returns the strip of bin 0, with pixel 0 at position 1, if it is narrow.
    pub(super) fn narrow_strip(&self) -> Option<StripRay> {
        let mut ray = self.strip?;
        ray.offset = self.offset(0);
        ray.is_narrow().then_some(ray)
    }

    /// Returns the rounding of positions: a ray of `f32` samples may move by 2^-28 of a pixel.
    fn snap<T: Sample>(&self) -> Snap {
        match self.strip {
            None if size_of::<T>() == size_of::<f32>() => Snap::FINE,
            _ => Snap::NONE,
        }
    }

    /// Distance between the rays of neighbouring bins, in pixels.
    pub(super) fn per_bin(&self) -> f64 {
        self.per_bin
    }

    /// Position of a bin's ray at step 0, whose integer part is one more than its first pixel.
    pub(super) fn offset(&self, bin: usize) -> f64 {
        self.base + (self.lead + 1.0) + bin as f64 * self.per_bin
    }

    /// Collects the given bins whose rays intersect the window in ascending order; pairs of two pixels per step are in the order of the
    /// steps. The weights do not depend on the window.
    pub(super) fn traverse<T: Sample>(
        &self,
        set: InstructionSet,
        window: &Window,
        bins: Range<usize>,
        rays: &mut Rays<T>,
    ) {
        let Window {
            across,
            along,
            strides: [stride_across, stride_along],
            origin,
        } = window;
        // Positions in memory are modulo 2^32; used ones lie in the window or beside it.
        let zero = (*origin as u32).wrapping_sub((across.start * stride_across) as u32);
        let (per_pixel, per_step) = (*stride_across as u32, *stride_along as u32);
        let (linear, snap) = (self.linear::<T>(), self.snap::<T>());
        // Steps that touch a pixel of the window have their position in [low, high).
        let spill = match self.strip {
            None => 1.0,
            // One more for the rounding of the last pixel; unless there is nothing to add.
            Some(ray) => ray.n_taps as f64,
        };
        let (low, high) = ((across.start + 1) as f64 - spill, (across.end + 1) as f64);

        rays.pairs.clear();
        rays.ends.clear();
        for bin in bins {
            let offset = snap.of(self.offset(bin));
            let steps = self.steps_between([low, high], along, offset, snap);
            if steps.is_empty() {
                continue;
            }
            let row = (steps.start - along.start) as u32 * per_step;
            let place = Place {
                zero: zero.wrapping_add(row).wrapping_sub(per_pixel),
                along: per_step,
                across: per_pixel,
            };
            let (m, n) = (steps.start, steps.len());
            match self.strip {
                Some(mut ray) => {
                    ray.offset = offset;
                    // From the pixel before the window to its last one.
                    let pixels = [across.start as i32, across.end as i32 + 1];
                    T::extend_strip(set, &mut rays.pairs, &ray, m, n, place, pixels);
                }
                None => {
                    let ray = LinearRay { offset, ..linear };
                    T::extend(set, &mut rays.pairs, &ray, m, n, place);
                }
            }
            rays.ends.push((bin, rays.pairs.len()));
        }
    }

    /// Returns a bound of the pairs in memory during the traversal of one ray.
    #[cfg(feature = "sprs")]
    pub(super) fn most_pairs(&self, window: &Window) -> usize {
        // More than the pairs of all steps: a strip computes 32 steps at a time and then omits pixels beyond the window.
        (window.along.len() + 32) * (self.n_taps.min(window.across.len()) / 2 + 32)
    }

    /// The bins whose rays cross step `m` between the given pixels; rays beyond the image belong to the nearest pixels. Ranges of
    /// pixels that divide the image divide the bins.
    pub(super) fn bins_between(&self, pixels: Range<usize>, m: usize) -> Range<usize> {
        let bin = |level: usize| {
            let bin = (level as f64 - self.base - m as f64 * self.per_step) / self.per_bin;
            bin.ceil().clamp(0.0, self.n_bins as f64) as usize
        };
        let rising = self.per_bin > 0.0;
        let (first, last) = if rising {
            (0, self.n_bins)
        } else {
            (self.n_bins, 0)
        };
        let a = if pixels.start == 0 {
            first
        } else {
            bin(pixels.start)
        };
        let b = if pixels.end >= self.n_across {
            last
        } else {
            bin(pixels.end)
        };
        a.min(b)..a.max(b)
    }

    /// Returns a range of bins that contains all rays that intersect the window.
    pub(super) fn bins_meeting(&self, window: &Window) -> Range<usize> {
        let ends = [window.along.start as f64, window.along.end as f64]
            .map(|m| self.offset(0) + m * self.per_step);
        let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let low = window.across.start as f64 - self.n_taps as f64;
        let high = (window.across.end + 1) as f64;
        let a = (low - most) / self.per_bin;
        let b = (high - least) / self.per_bin;
        // One more on either side for rounding; `steps_between` decides.
        let clamp = |bin: f64| bin.clamp(0.0, self.n_bins as f64) as usize;
        clamp(a.min(b).floor() - 1.0)..clamp(a.max(b).ceil() + 2.0)
    }

    /// The steps within `along` at which the position lies in [low, high).
    fn steps_between(
        &self,
        [low, high]: [f64; 2],
        along: &Range<usize>,
        offset: f64,
        snap: Snap,
    ) -> Range<usize> {
        let at = |m: usize| offset + snap.of(m as f64 * self.per_step);
        let inside = |m: usize| (low..high).contains(&at(m));
        // The position is monotone.
        if inside(along.start) && inside(along.end - 1) {
            return along.clone();
        }
        let rising = self.per_step >= 0.0;
        // First step at which `at` has passed `level` in its direction: estimated, then corrected with `at` itself.
        let first_past = |level: f64| {
            let past = |m: usize| {
                if rising {
                    at(m) >= level
                } else {
                    at(m) < level
                }
            };
            // Saturating, and 0 for NaN.
            let estimate = ((level - at(along.start)) * self.steps_per_pixel) as usize;
            let mut m = along.start + estimate.min(along.len());
            while m > along.start && past(m - 1) {
                m -= 1;
            }
            while m < along.end && !past(m) {
                m += 1;
            }
            m
        };
        if rising {
            first_past(low)..first_past(high)
        } else {
            first_past(high)..first_past(low)
        }
    }
}
