//! Resolution that depends on depth: what lies in thin slabs across the rays, each blurred by its own width.
//!
//! The collimator's face is ahead of the rays, at `t = R` from the axis, `R` of the view. Slab `k` is between the planes `t_k` and
//! `t_(k + 1)`, its content exact; at the distance `d = R - t` it is seen `sigma(d)` wide. All of a slab is blurred alike, by the variance of
//! its middle less `slope^2 h^2 / 12` for a thickness `h`: the variance of a view is that of its lines plus the mean of `sigma(d)^2`, and of
//! that mean the errors of second order in `h` cancel where content changes smoothly with depth (midpoint rule, Euler-Maclaurin).
//!
//! All this happens on sub-bins. With averages over sub-bins as values, the discrete Gaussian on them and the average over the sub-bins of a bin make
//! the average over the bin of the blurred image, up to aliases at the frequencies `2 pi / h` of the sub-bin `h`, where the average over a bin has a zero.

use super::averages::{Averages, STENCIL};
use super::camera::Camera;
use crate::error::{PhantomError, check};
use radon::{Collimator, DepthBlur};
use std::ops::Range;
use std::sync::OnceLock;

/// Fewest slabs where depth makes a difference, and most; even, so that they make pairs.
const FEWEST_SLABS: f64 = 12.0;
const MOST_SLABS: f64 = 2048.0;
/// Bins over which a sample is spread: far more than any camera has, and few enough to be computed.
const MOST_REACH: [f64; 2] = [0.0, 1024.0];
/// What a Gaussian has beyond five standard deviations, along both axes.
const TAILS: f64 = 1.2e-6;

/// The sub-bins of each bin, on which images are computed and blurred.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SubBins {
    /// Of each bin along the bins, and along the rows.
    pub(crate) counts: [usize; 2],
    /// How averages over sub-bins are computed; `None` for line integrals through their centres.
    pub(crate) averages: Option<Averages>,
    /// Bound on the error that remains, relative to the largest sample.
    pub(crate) error: f64,
}

impl Default for SubBins {
    /// One line integral per bin.
    fn default() -> Self {
        Self {
            counts: [1; 2],
            averages: None,
            error: 0.0,
        }
    }
}

/// Where a view has its face, and what is in front of it: in cm from the axis, towards the face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Facing {
    pub(crate) radius: f64,
    /// From where to where there is anything to see.
    pub(crate) seen: [f64; 2],
    /// How far anything at all reaches.
    pub(crate) body: f64,
}

/// The samples of a view that no shape of the heart changes.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) samples: Vec<f32>,
    /// Bound on the error of the response, and the largest value before it.
    pub(crate) error: f64,
    pub(crate) unblurred: f64,
}

/// From the slabs of views, on sub-bins, to samples: blur by depth, average over the sub-bins of each bin.
#[derive(Debug)]
pub(crate) struct Depth {
    /// The camera of sub-bins, as large as all that the blur brings into the views needs.
    pub(crate) camera: Camera,
    pub(crate) sub_bins: SubBins,
    /// Bins and rows of the camera whose samples are made.
    size: [usize; 2],
    /// Bins, and rows, more on either side.
    margin: [usize; 2],
    /// Sub-bins, and rows of them, over which a sample is spread at most.
    reach: [usize; 2],
    response: Collimator,
    tolerance: f64,
    views: Vec<Facing>,
    /// Of each view the samples of what surrounds the heart, once they were made.
    pub(crate) fixed: Vec<OnceLock<Fixed>>,
    /// Of the view that has the most, for memory.
    slabs: usize,
    nodes: usize,
}

impl Depth {
    /// Of views whose faces are where `views` says, in which there is anything to see as far as `extent` (from the axis, and from the
    /// middle along it, in cm). `tolerance` is that of the height and of the variance of any point's image.
    pub(crate) fn new(
        (response, tolerance): (Collimator, f64),
        camera: &Camera,
        sub_bins: SubBins,
        views: Vec<Facing>,
        extent: [f64; 2],
    ) -> Result<Self, PhantomError> {
        let (counts, pitch) = (sub_bins.counts, camera.detector().pitch());
        let fine = [0, 1].map(|axis| pitch[axis] / counts[axis] as f64);
        let size = [camera.n_bins(), camera.n_rows()];
        let mut depth = Self {
            camera: camera.with_raster([0, 1].map(|axis| size[axis] * counts[axis]), fine)?,
            sub_bins,
            size,
            margin: [0; 2],
            reach: [0; 2],
            response,
            tolerance,
            fixed: views.iter().map(|_| OnceLock::new()).collect(),
            views,
            slabs: 1,
            nodes: 1,
        };
        let (mut near, mut far) = (f64::INFINITY, 0.0f64);
        for view in &depth.views {
            let planes = depth.planes_of(view);
            let variances = depth.variances(view, &planes);
            depth.slabs = depth.slabs.max(variances.len());
            near = variances.iter().fold(near, |least, v| least.min(*v));
            far = variances.iter().fold(far, |most, v| most.max(*v));
        }
        let ends = depth.gaussians(&[near, far], tolerance)?;
        (depth.reach, depth.nodes) = (ends.reach(), ends.n_nodes());
        // Third differences find an edge in a sub-bin if they have neighbours on both sides of it.
        let stencil = depth.sub_bins.averages.as_ref().map_or(0, |_| STENCIL);
        depth.margin = [0, 1].map(|axis| {
            let reach = (depth.reach[axis] + stencil).div_ceil(counts[axis]);
            let free = (0.5 * size[axis] as f64 - reach as f64) * pitch[axis];
            if extent[axis] > free { reach } else { 0 }
        });
        let reach = [0, 1].map(|axis| depth.reach[axis].div_ceil(counts[axis]));
        let farthest = reach[0].max(reach[1]) as f64;
        check(
            "reach of the collimator's blur in bins",
            farthest,
            MOST_REACH,
        )?;
        let wide = [0, 1].map(|axis| (size[axis] + 2 * depth.margin[axis]) * counts[axis]);
        depth.camera = camera.with_raster(wide, fine)?;
        Ok(depth)
    }

    /// Bytes that a view under way takes: its slabs, both halves of its rule and one point of it, and the images that are blurred.
    pub(crate) fn view_bytes(&self) -> usize {
        4 * self.camera.view_len() * (3 * self.slabs + self.nodes + 2)
    }

    /// Slabs of a view, at most.
    pub(crate) fn most_slabs(&self) -> usize {
        self.slabs
    }

    /// Bins in a row of samples.
    pub(crate) fn n_bins(&self) -> usize {
        self.size[0]
    }

    /// Rows of samples.
    pub(crate) fn n_rows(&self) -> usize {
        self.size[1]
    }

    /// The rows of sub-bins that some rows of samples are averages over.
    fn fine_rows(&self, rows: &Range<usize>) -> Range<usize> {
        let (above, count) = (self.margin[1], self.sub_bins.counts[1]);
        (rows.start + above) * count..(rows.end + above) * count
    }

    /// The rows of sub-bins that some rows of samples are computed from.
    pub(crate) fn rows_seen(&self, rows: &Range<usize>) -> Range<usize> {
        let stencil = self.sub_bins.averages.as_ref().map_or(0, |_| STENCIL);
        let (fine, reach) = (self.fine_rows(rows), self.reach[1] + stencil);
        fine.start.saturating_sub(reach)..(fine.end + reach).min(self.camera.n_rows())
    }

    /// Bound on what the kernels' tails that are cut off hold, along both axes.
    pub(crate) fn tails(&self) -> f64 {
        match self.nodes {
            1 if self.reach == [0; 2] => 0.0,
            _ => TAILS,
        }
    }

    /// The planes between the slabs of a view.
    pub(crate) fn planes(&self, view_idx: usize) -> Vec<f64> {
        self.planes_of(&self.views[view_idx])
    }

    fn planes_of(&self, view: &Facing) -> Vec<f64> {
        let (response, [low, high]) = (&self.response, view.seen);
        if response.slope() == 0.0 {
            return Vec::new();
        }
        // slope^2 h^2 / 12 below half the tolerance of the smallest variance: the Gaussians that slabs share need theirs.
        let near = response.sigma(view.radius - high);
        let thickest = near * (6.0 * self.tolerance).sqrt() / response.slope();
        let pairs = (0.5 * (high - low) / thickest).ceil();
        let n = (2.0 * pairs).clamp(FEWEST_SLABS, MOST_SLABS);
        let thickness = (high - low) / n;
        (1..n as usize)
            .map(|k| low + k as f64 * thickness)
            .collect()
    }

    /// Of each slab between such planes the variance that blurs it.
    fn variances(&self, view: &Facing, planes: &[f64]) -> Vec<f64> {
        let (response, [low, high]) = (&self.response, view.seen);
        let thickness = (high - low) / (planes.len() + 1) as f64;
        let within = (response.slope() * thickness).powi(2) / 12.0;
        (0..=planes.len())
            .map(|k| view.radius - low - (k as f64 + 0.5) * thickness)
            .map(|distance| (response.variance(distance) - within).max(0.0))
            .collect()
    }

    fn gaussians(&self, variances: &[f64], tolerance: f64) -> Result<DepthBlur, PhantomError> {
        let pitch = self.camera.detector().pitch();
        Ok(DepthBlur::new(variances, pitch, tolerance)?)
    }

    /// Some rows of samples of a view from the slabs `[row][slab][bin]` of [`Self::rows_seen`].
    pub(crate) fn view(
        &self,
        view_idx: usize,
        slabs: &[f32],
        rows: &Range<usize>,
        image: &mut [f32],
    ) -> Result<(), PhantomError> {
        let variances = self.variances(&self.views[view_idx], &self.planes(view_idx));
        self.blur((&variances, self.tolerance), slabs, rows, image)
    }

    /// The largest difference between the samples of a view and those from slabs of twice the thickness and four times the tolerance; it
    /// bounds their error, which is of first order in the thickness at worst.
    pub(crate) fn error_of(
        &self,
        view_idx: usize,
        slabs: &[f32],
        rows: &Range<usize>,
        image: &[f32],
    ) -> Result<f64, PhantomError> {
        let (view, n_bins) = (&self.views[view_idx], self.camera.n_bins());
        let planes = self.planes_of(view);
        if planes.is_empty() {
            return Ok(0.0);
        }
        let pairs: Vec<f32> = (slabs.chunks(2 * n_bins))
            .flat_map(|pair| {
                let (a, b) = pair.split_at(n_bins);
                a.iter().zip(b).map(|(a, b)| a + b)
            })
            .collect();
        let every_other: Vec<f64> = planes.iter().skip(1).step_by(2).copied().collect();
        let variances = self.variances(view, &every_other);
        let mut coarse = vec![0.0f32; image.len()];
        self.blur(
            (&variances, 4.0 * self.tolerance),
            &pairs,
            rows,
            &mut coarse,
        )?;
        let off = image
            .iter()
            .zip(&coarse)
            .map(|(a, b)| f64::from(a - b).abs());
        Ok(off.fold(0.0, f64::max))
    }

    /// The largest sum over the slabs of a sub-bin of a view.
    pub(crate) fn largest_sum(&self, view_idx: usize, slabs: &[f32]) -> f64 {
        let (n_bins, n) = (self.camera.n_bins(), self.planes(view_idx).len() + 1);
        let sum = |row: &[f32], bin: usize| row.iter().skip(bin).step_by(n_bins).sum::<f32>();
        let rows = slabs.chunks(n * n_bins);
        let sums = rows.flat_map(|row| (0..n_bins).map(move |bin| sum(row, bin)));
        f64::from(sums.fold(0.0, f32::max))
    }

    /// Blurs slabs on sub-bins and averages over the sub-bins of each bin.
    fn blur(
        &self,
        (variances, tolerance): (&[f64], f64),
        slabs: &[f32],
        rows: &Range<usize>,
        image: &mut [f32],
    ) -> Result<(), PhantomError> {
        let (n_bins, fine) = (self.camera.n_bins(), self.fine_rows(rows));
        let above = fine.start - self.rows_seen(rows).start;
        let gaussians = self.gaussians(variances, tolerance)?;
        let [along, across] = self.sub_bins.counts;
        if [along, across, self.margin[0]] == [1, 1, 0] {
            return Ok(gaussians.apply(slabs, n_bins, above, image)?);
        }
        let mut blurred = vec![0.0f32; fine.len() * n_bins];
        gaussians.apply(slabs, n_bins, above, &mut blurred)?;
        let each = 1.0 / (along * across) as f64;
        for (lines, own) in (blurred.chunks(across * n_bins)).zip(image.chunks_mut(self.size[0])) {
            for (bin, sample) in own.iter_mut().enumerate() {
                let from = (self.margin[0] + bin) * along;
                let lines = lines.chunks(n_bins).map(|line| &line[from..from + along]);
                let sum: f64 = lines.flatten().map(|value| f64::from(*value)).sum();
                *sample = (each * sum) as f32;
            }
        }
        Ok(())
    }
}
