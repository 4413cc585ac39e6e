//! Resolution that depends on depth: what lies in thin slabs across the rays, each blurred by its own width.
//!
//! The collimator's face is ahead of the rays, at `t = R` from the axis, `R` of the view. Slab `k` is between the planes `t_k` and
//! `t_(k + 1)`, its content exact; at the distance `d = R - t` it is seen `sigma(d)` wide. All of a slab is blurred alike, by the variance of
//! its middle less `slope^2 h^2 / 12` for a thickness `h`: the variance of a view is that of its lines plus the mean of `sigma(d)^2`, and of
//! that mean the errors of second order in `h` cancel where content changes smoothly with depth (midpoint rule, Euler-Maclaurin).
//!
//! Errors fall at least in proportion to the tolerance, of slabs (`h^2` or faster) as of the Gaussians that they share: what four times the
//! tolerance makes of the same slabs, joined in pairs, differs by three times the error or more.

use super::camera::Camera;
use super::wide::widened;
use crate::error::{PhantomError, check};
use radon::{Collimator, DepthBlur};
use std::ops::Range;

/// Fewest slabs where depth makes a difference, and most; even, so that they make pairs.
const FEWEST_SLABS: f64 = 12.0;
const MOST_SLABS: f64 = 2048.0;
/// Bins over which a sample is spread: far more than any camera has, and few enough to be computed.
const MOST_REACH: [f64; 2] = [0.0, 1024.0];
/// The error is estimated in so many views at most, evenly among all.
const VIEWS_LOOKED_AT: usize = 8;

/// Collimator and crystal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collimation {
    /// How wide a point is seen, by its distance from the collimator's face.
    pub response: Collimator,
    /// Error of a view that slabs and shared blurs may cause: of the variance by which any point is blurred, as a share of it, and of
    /// the height of its image.
    pub tolerance: f64,
}

/// Where a view has its face, and what is in front of it: in cm from the axis, towards the face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Facing {
    pub(crate) radius: f64,
    /// From where to where there is anything to see.
    pub(crate) seen: [f64; 2],
    /// How far anything at all reaches.
    pub(crate) body: f64,
}

/// The slabs of a camera's views and what blurs them.
#[derive(Debug)]
pub(crate) struct Depth {
    /// As large as all that the blur brings into the views needs; of its views the camera's are the middle.
    pub(crate) camera: Camera,
    /// Bins, and rows, more on either side.
    pub(crate) margin: [usize; 2],
    /// Bins, and rows, over which a sample is spread at most.
    reach: [usize; 2],
    collimation: Collimation,
    views: Vec<Facing>,
    /// Of the view that has the most, for memory.
    slabs: usize,
    nodes: usize,
}

/// Sums of squares, over the samples of a view, of the blur's estimated error and of what it is the error of.
pub(crate) type Squares = [f64; 2];

impl Depth {
    /// Of views whose faces are where `views` says, in which there is anything to see as far as `extent` (from the axis, and from the
    /// middle along it, in cm).
    pub(crate) fn new(
        collimation: &Collimation,
        camera: &Camera,
        views: Vec<Facing>,
        extent: [f64; 2],
    ) -> Result<Self, PhantomError> {
        let mut depth = Self {
            camera: camera.clone(),
            margin: [0; 2],
            reach: [0; 2],
            collimation: *collimation,
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
        let ends = depth.gaussians(&[near, far], collimation.tolerance)?;
        (depth.reach, depth.nodes) = (ends.reach(), ends.n_nodes());
        let reach = depth.reach[0].max(depth.reach[1]) as f64;
        check("reach of the collimator's blur in bins", reach, MOST_REACH)?;
        (depth.margin, depth.camera) = widened(camera, depth.reach, extent)?;
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

    /// The rows of the wide camera that some of its rows, once blurred, are made of.
    pub(crate) fn rows_seen(&self, rows: &Range<usize>) -> Range<usize> {
        let reach = self.reach[1];
        rows.start.saturating_sub(reach)..(rows.end + reach).min(self.camera.n_rows())
    }

    /// The planes between the slabs of a view.
    pub(crate) fn planes(&self, view_idx: usize) -> Vec<f64> {
        self.planes_of(&self.views[view_idx])
    }

    fn planes_of(&self, view: &Facing) -> Vec<f64> {
        let (response, [low, high]) = (&self.collimation.response, view.seen);
        if response.slope() == 0.0 {
            return Vec::new();
        }
        // slope^2 h^2 / 12 below half the tolerance of the smallest variance: the Gaussians that slabs share need theirs.
        let near = response.sigma(view.radius - high);
        let thickest = near * (6.0 * self.collimation.tolerance).sqrt() / response.slope();
        let pairs = (0.5 * (high - low) / thickest).ceil();
        let n = (2.0 * pairs).clamp(FEWEST_SLABS, MOST_SLABS);
        let thickness = (high - low) / n;
        (1..n as usize)
            .map(|k| low + k as f64 * thickness)
            .collect()
    }

    /// Of each slab between such planes the variance that blurs it.
    fn variances(&self, view: &Facing, planes: &[f64]) -> Vec<f64> {
        let (response, [low, high]) = (&self.collimation.response, view.seen);
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

    /// Some rows of a view from the slabs `[row][slab][bin]` of those seen; and of views that are looked at for it, the estimated error.
    pub(crate) fn view(
        &self,
        view_idx: usize,
        slabs: &[f32],
        rows: &Range<usize>,
        image: &mut [f32],
    ) -> Result<Option<Squares>, PhantomError> {
        let (view, n_bins) = (&self.views[view_idx], self.camera.n_bins());
        let (planes, tolerance) = (self.planes_of(view), self.collimation.tolerance);
        let above = rows.start - self.rows_seen(rows).start;
        let variances = self.variances(view, &planes);
        self.gaussians(&variances, tolerance)?
            .apply(slabs, n_bins, above, image)?;
        let every = self.views.len().div_ceil(VIEWS_LOOKED_AT);
        if !view_idx.is_multiple_of(every) {
            return Ok(None);
        }
        let square = |sum: f64, v: f64| sum + v * v;
        let all = image.iter().map(|v| f64::from(*v)).fold(0.0, square);
        if planes.is_empty() {
            return Ok(Some([0.0, all]));
        }
        let pairs: Vec<f32> = (slabs.chunks(2 * n_bins))
            .flat_map(|pair| {
                let (a, b) = pair.split_at(n_bins);
                a.iter().zip(b).map(|(a, b)| a + b)
            })
            .collect();
        let every_other: Vec<f64> = planes.iter().skip(1).step_by(2).copied().collect();
        let mut coarse = vec![0.0f32; image.len()];
        self.gaussians(&self.variances(view, &every_other), 4.0 * tolerance)?
            .apply(&pairs, n_bins, above, &mut coarse)?;
        let off = image.iter().zip(&coarse).map(|(a, b)| f64::from(a - b));
        Ok(Some([off.fold(0.0, square) / 9.0, all]))
    }
}
