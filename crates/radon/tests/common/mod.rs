//! Closed forms that share no code with the crate.
#![allow(dead_code)] // each test file uses a part

pub(crate) mod dense;
pub(crate) mod spect;

use radon::{ImageGrid, ParallelGeometry, Sample, StackOrder};

/// Index of the first bin of a view of a slice, as documented.
pub(crate) fn row_start(
    order: StackOrder,
    [view, slice]: [usize; 2],
    [n_views, n_slices, n_bins]: [usize; 3],
) -> usize {
    match order {
        StackOrder::ViewSliceBin => (view * n_slices + slice) * n_bins,
        StackOrder::SliceViewBin => (slice * n_views + view) * n_bins,
    }
}

/// An ellipse of value 1: half axes `a`, `b`, the first turned by `phi`.
#[derive(Clone, Copy)]
pub(crate) struct Ellipse {
    pub(crate) centre: [f64; 2],
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) phi: f64,
}

impl Ellipse {
    pub(crate) fn disc(centre: [f64; 2], radius: f64) -> Self {
        Self {
            centre,
            a: radius,
            b: radius,
            phi: 0.0,
        }
    }

    /// Length of the line at signed distance `s` with normal `(cos theta, sin theta)` inside the ellipse.
    pub(crate) fn chord(&self, theta: f64, s: f64) -> f64 {
        let g = theta - self.phi;
        let half_width2 = (self.a * g.cos()).powi(2) + (self.b * g.sin()).powi(2);
        let t = s - self.centre[0] * theta.cos() - self.centre[1] * theta.sin();
        2.0 * self.a * self.b / half_width2 * (half_width2 - t * t).max(0.0).sqrt()
    }

    /// Mean of `chord` over a bin: the area between two parallel lines over their distance.
    pub(crate) fn mean_chord(&self, theta: f64, s: f64, width: f64) -> f64 {
        let g = theta - self.phi;
        let half_width = (self.a * g.cos()).hypot(self.b * g.sin());
        let t = s - self.centre[0] * theta.cos() - self.centre[1] * theta.sin();
        // Area left of a line, for the unit disc; an ellipse is a disc stretched along and across the lines.
        let area = |t: f64| {
            let t = (t / half_width).clamp(-1.0, 1.0);
            t * (1.0 - t * t).sqrt() + t.asin()
        };
        self.a * self.b * (area(t + width / 2.0) - area(t - width / 2.0)) / width
    }

    /// 1 at the boundary, smaller inside.
    pub(crate) fn level(&self, [x, y]: [f64; 2]) -> f64 {
        let (dx, dy) = (x - self.centre[0], y - self.centre[1]);
        let (sin, cos) = self.phi.sin_cos();
        ((dx * cos + dy * sin) / self.a).hypot((dy * cos - dx * sin) / self.b)
    }

    pub(crate) fn mean_sinogram(&self, geometry: &ParallelGeometry) -> Vec<f64> {
        let mut out = Vec::with_capacity(geometry.sinogram_len());
        for &theta in geometry.angles() {
            out.extend(
                (0..geometry.n_bins())
                    .map(|k| self.mean_chord(theta, geometry.bin_centre(k), geometry.pitch())),
            );
        }
        out
    }

    pub(crate) fn sinogram(&self, geometry: &ParallelGeometry) -> Vec<f64> {
        let mut out = Vec::with_capacity(geometry.sinogram_len());
        for &theta in geometry.angles() {
            out.extend((0..geometry.n_bins()).map(|k| self.chord(theta, geometry.bin_centre(k))));
        }
        out
    }
}

/// Mean of the image over the pixels whose centres satisfy `inside`.
pub(crate) fn mean_where(
    image: &[f64],
    grid: &ImageGrid,
    inside: impl Fn([f64; 2]) -> bool,
) -> f64 {
    let (mut sum, mut n) = (0.0, 0);
    for iy in 0..grid.ny() {
        for ix in 0..grid.nx() {
            if inside(grid.pixel_centre(ix, iy)) {
                sum += image[iy * grid.nx() + ix];
                n += 1;
            }
        }
    }
    sum / n as f64
}

pub(crate) fn half_turn(n_views: usize, n_bins: usize, pitch: f64) -> ParallelGeometry {
    ParallelGeometry::half_turn(n_views, n_bins, pitch).unwrap()
}

/// Samples in [-1, 1) from a linear congruential generator (Knuth's MMIX constants).
pub(crate) fn noise<T: Sample>(n: usize, seed: u64) -> Vec<T> {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        T::of((state >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    };
    (0..n).map(|_| next()).collect()
}
