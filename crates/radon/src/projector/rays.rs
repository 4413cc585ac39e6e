//! The one traversal: for each ray, the pixels it meets and their weights.
//!
//! A view marches along the image axis along which its rays cross more pixels. At every step `m` along it (a row or a column
//! of pixels) a ray crosses at the fractional pixel index
//!
//! ```text
//! f = base + bin * per_bin + m * per_step,        |per_step| <= 1
//! ```
//!
//! and each kernel spreads the step's path length over the pixels about `f`: pixel `i` gets the share of a blurred point
//! at `f` that falls between `i - 1/2` and `i + 1/2`. The blur is a box of one pixel (Joseph), of the pixels that the
//! ray crosses within the step (Siddon: exact lengths), or that box and the bin's width one after the other (strip:
//! exact areas). Forward, adjoint and matrix all consume these same taps.

use std::ops::Range;

use super::Kernel;
use crate::error::{RadonError, within};
use crate::simd::{BoxRay, BoxSteps, InstructionSet, Tap};
use crate::{ImageGrid, ParallelGeometry, Sample};

/// The part of the image to traverse, and where it lies in memory.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Columns and rows.
    pub(super) x: Range<usize>,
    pub(super) y: Range<usize>,
    /// Distance in memory between rows; columns are neighbours.
    pub(super) row_stride: usize,
    /// Position in memory of column `x.start`, row `y.start`.
    pub(super) origin: usize,
    /// Which steps belong to the window.
    pub(super) owns: Owner,
}

/// The taps of the rays that meet a window.
#[derive(Debug)]
pub(super) struct RayTaps<T> {
    taps: Vec<Tap<T>>,
    /// Each ray's bin and the end of its taps.
    ends: Vec<(usize, usize)>,
    /// Work arrays of one ray.
    steps: BoxSteps<T>,
    instructions: InstructionSet,
}

impl<T: Sample> RayTaps<T> {
    pub(super) fn new(instructions: InstructionSet) -> Self {
        Self {
            taps: Vec::new(),
            ends: Vec::new(),
            steps: BoxSteps::default(),
            instructions,
        }
    }

    fn clear(&mut self) {
        self.taps.clear();
        self.ends.clear();
    }

    /// Number of rays.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Bin and taps of the ray in place `i` of the order of bins.
    pub(super) fn get(&self, i: usize) -> Option<(usize, &[Tap<T>])> {
        let &(bin, end) = self.ends.get(i)?;
        let start = if i == 0 { 0 } else { self.ends[i - 1].1 };
        Some((bin, &self.taps[start..end]))
    }

    /// Each ray's bin and taps.
    #[cfg(feature = "sprs")]
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &[Tap<T>])> {
        (0..self.len()).filter_map(|i| self.get(i))
    }
}

/// Views whose rays are taken in turn: neighbours meet the same pixels, which then come from the nearest cache.
pub(super) const TOGETHER: usize = 4;

/// The rays of up to `TOGETHER` views that meet a window.
#[derive(Debug)]
pub(super) struct SeveralTaps<T>([RayTaps<T>; TOGETHER]);

impl<T: Sample> SeveralTaps<T> {
    pub(super) fn new(instructions: InstructionSet) -> Self {
        Self(std::array::from_fn(|_| RayTaps::new(instructions)))
    }

    pub(super) fn traverse(&mut self, views: &[View], window: &Window) {
        for (taps, view) in self.0.iter_mut().zip(views) {
            view.traverse(window, taps);
        }
        for taps in &mut self.0[views.len()..] {
            taps.clear();
        }
    }

    /// For each ray the place of its view among those traversed, its bin and its taps: the first ray of each view, then the
    /// second of each, and so on.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, usize, &[Tap<T>])> {
        let most = self.0.iter().map(RayTaps::len).max().unwrap_or(0);
        (0..most).flat_map(move |i| {
            self.0
                .iter()
                .enumerate()
                .filter_map(move |(view, rays)| rays.get(i).map(|(bin, taps)| (view, bin, taps)))
        })
    }
}

/// How the steps of a ray are divided among windows, when its taps may straddle two of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// The window of the step's first pixel owns all its taps: for reading. The windows must tile the image.
    FirstPixel,
    /// Each tap belongs to the window of its pixel: for writing.
    EachPixel,
}

/// How a step's length is spread over the pixels about its crossing.
#[derive(Clone, Copy, Debug)]
enum Spread {
    /// Two pixels, weights linear in f over a box at most one pixel wide: one over its width.
    Box(f64),
    /// Any number of pixels: a box of the first width blurred by one of the second.
    TwoBoxes(f64, f64),
}

/// The rays of one view.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// Steps are rows and rays are interpolated along x; or the other way round.
    steps_are_rows: bool,
    base: f64,
    per_bin: f64,
    per_step: f64,
    /// One over `per_step`, maybe infinite.
    steps_per_pixel: f64,
    n_bins: usize,
    /// Pixels along the interpolated axis.
    n_across: usize,
    /// Path length of a step.
    length: f64,
    spread: Spread,
    /// The first pixel of a step is floor(f + lead).
    lead: f64,
    /// Pixels a step may touch, on the grid or beyond it.
    n_taps: i64,
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
        // Beyond these a ray's pixel index has no digits left behind its point.
        within("pitch in pixels", per_bin.abs(), 1e-9, 1e9)?;
        let farthest = base.abs() + per_bin.abs() * geometry.n_bins() as f64 + n_steps as f64;
        within("distance of a ray in pixels", farthest, 0.0, 1e12)?;

        let crossed = per_step.abs();
        let spread = match kernel {
            Kernel::Joseph => Spread::Box(1.0),
            // Along the steps the box has no width; this much splits a ray on an edge evenly between its pixels.
            Kernel::Siddon => Spread::Box(1.0 / crossed.max(1e-9)),
            Kernel::Strip => Spread::TwoBoxes(crossed, per_bin.abs()),
        };
        let reach = match spread {
            Spread::Box(per_width) => 0.5 / per_width,
            Spread::TwoBoxes(v, w) => 0.5 * (v + w),
        };
        let n_taps = match spread {
            Spread::Box(_) => 2,
            Spread::TwoBoxes(v, w) => (v + w) as i64 + 2,
        };
        Ok(Self {
            steps_are_rows,
            base,
            per_bin,
            per_step,
            steps_per_pixel: 1.0 / per_step,
            n_bins: geometry.n_bins(),
            n_across,
            length: d_along / a.abs(),
            spread,
            lead: 0.5 - reach,
            n_taps,
        })
    }

    /// The rays that meet the window, in ascending order of bins, into `rays`; taps are in the order of the steps, then of
    /// the pixels. The weights are the same numbers whatever the window.
    pub(super) fn traverse<T: Sample>(&self, window: &Window, rays: &mut RayTaps<T>) {
        let (across, along) = if self.steps_are_rows {
            (&window.x, &window.y)
        } else {
            (&window.y, &window.x)
        };
        let (stride_across, stride_along) = if self.steps_are_rows {
            (1, window.row_stride)
        } else {
            (window.row_stride as i64, 1)
        };
        let spill = self.n_taps as f64 - 1.0;
        // Steps whose first pixel lies in [low, high) are visited, and their taps in `clip` kept.
        let (low, high, clip) = match window.owns {
            Owner::EachPixel => (
                across.start as f64 - spill,
                across.end as f64,
                across.clone(),
            ),
            Owner::FirstPixel if across.start == 0 => (-spill, across.end as f64, 0..self.n_across),
            Owner::FirstPixel => (across.start as f64, across.end as f64, 0..self.n_across),
        };
        let clip = clip.start as i64..clip.end as i64;

        rays.clear();
        for bin in self.bins_meeting(low, high, along) {
            let offset = self.base + bin as f64 * self.per_bin;
            let at = |m: usize| offset + m as f64 * self.per_step;
            // First pixel of a step at f, as an index and as a number: the floor of f + lead, in casts.
            let floor = |t: f64| {
                let truncated = t as i64;
                truncated - i64::from(t < truncated as f64)
            };
            let steps = self.steps_between(low, high, along, |m| at(m) + self.lead);
            if steps.is_empty() {
                continue;
            }
            // Position in memory of pixel 0 of step m.
            let zero = window.origin as i64 - across.start as i64 * stride_across;
            let row = |m: usize| zero + ((m - along.start) * stride_along) as i64;
            let tap = |pixel: i64, weight: f64| Tap {
                pixel: pixel as u32,
                weight: T::of(weight),
            };
            match self.spread {
                Spread::Box(per_width) => {
                    // Share of the first pixel, from how far f + lead lies behind its index.
                    let whole = (self.lead + 0.5) * per_width + 0.5;
                    let near = |behind: f64| (whole - behind * per_width).clamp(0.0, 1.0);
                    // f is monotone: the first and the last step tell whether any tap is clipped.
                    let inside = |m: usize| {
                        let first = floor(at(m) + self.lead);
                        clip.contains(&first) && clip.contains(&(first + 1))
                    };
                    if inside(steps.start) && inside(steps.end - 1) {
                        let ray = BoxRay {
                            offset,
                            per_step: self.per_step,
                            lead: self.lead,
                            whole,
                            per_width,
                            length: self.length,
                        };
                        let RayTaps {
                            taps,
                            steps: pairs,
                            instructions,
                            ..
                        } = &mut *rays;
                        pairs.fill(*instructions, &ray, steps.start, steps.len());
                        let weights = pairs.near.iter().zip(&pairs.far);
                        let mut row = row(steps.start);
                        taps.extend(pairs.first.iter().zip(weights).flat_map(
                            |(&first, (&near, &far))| {
                                let pixel = row + i64::from(first) * stride_across;
                                row += stride_along as i64;
                                let tap = |pixel: i64, weight| Tap {
                                    pixel: pixel as u32,
                                    weight,
                                };
                                [tap(pixel, near), tap(pixel + stride_across, far)]
                            },
                        ));
                    } else {
                        for m in steps {
                            let t = at(m) + self.lead;
                            let first = floor(t);
                            let near = near(t - first as f64);
                            for (i, share) in [(first, near), (first + 1, 1.0 - near)] {
                                if clip.contains(&i) {
                                    let pixel = row(m) + i * stride_across;
                                    rays.taps.push(tap(pixel, self.length * share));
                                }
                            }
                        }
                    }
                }
                Spread::TwoBoxes(v, w) => {
                    for m in steps {
                        let f = at(m);
                        let first = floor(f + self.lead);
                        let pixels = first.max(clip.start)..(first + self.n_taps).min(clip.end);
                        let mut below = two_boxes_below(pixels.start as f64 - 0.5 - f, v, w);
                        for i in pixels {
                            let upto = two_boxes_below(i as f64 + 0.5 - f, v, w);
                            let pixel = row(m) + i * stride_across;
                            rays.taps.push(tap(pixel, self.length * (upto - below)));
                            below = upto;
                        }
                    }
                }
            }
            rays.ends.push((bin, rays.taps.len()));
        }
    }

    /// Pixels beyond its first that a step may touch.
    pub(super) fn spill(&self) -> usize {
        self.n_taps as usize - 1
    }

    /// A range of bins that holds all with a step's first pixel in [low, high).
    fn bins_meeting(&self, low: f64, high: f64, along: &Range<usize>) -> Range<usize> {
        let ends = [along.start as f64, along.end as f64]
            .map(|m| self.base + self.lead + m * self.per_step);
        let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        let a = (low - most) / self.per_bin;
        let b = (high - least) / self.per_bin;
        // One more on either side for rounding; `steps_between` decides.
        let clamp = |bin: f64| bin.clamp(0.0, self.n_bins as f64) as usize;
        clamp(a.min(b).floor() - 1.0)..clamp(a.max(b).ceil() + 2.0)
    }

    /// The steps within `along` at which the monotone `at` lies in [low, high).
    fn steps_between(
        &self,
        low: f64,
        high: f64,
        along: &Range<usize>,
        at: impl Fn(usize) -> f64,
    ) -> Range<usize> {
        let rising = self.per_step >= 0.0;
        // First step at which `at` has passed `level` in its direction: estimated, then settled by `at` itself.
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

/// Integral up to `t` of two centred boxes of unit area and widths `v`, `w` convolved with each other (a trapezoid).
fn two_boxes_below(t: f64, v: f64, w: f64) -> f64 {
    let (narrow, wide) = if v < w { (v, w) } else { (w, v) };
    let (flat, foot) = (0.5 * (wide - narrow), 0.5 * (wide + narrow));
    let distance = t.abs();
    let beyond = if distance >= foot {
        0.0
    } else if distance > flat {
        (foot - distance).powi(2) / (2.0 * narrow * wide)
    } else {
        0.5 - distance / wide
    };
    if t < 0.0 { beyond } else { 1.0 - beyond }
}
