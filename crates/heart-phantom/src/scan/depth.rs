//! Depth-dependent resolution: thin slabs across the rays, each with its own blur.
//!
//! The collimator face is at `t = R` from the axis in the direction of the rays. Slab `k` lies between the planes `t_k` and `t_(k + 1)` and
//! has exact line integrals. At the distance `d = R - t` the response has the width `sigma(d)`. A slab of thickness `h` is blurred by the
//! variance at its middle less `slope^2 h^2 / 12`. Then the variance of a view is that of its lines plus the average of `sigma(d)^2`, and
//! errors of second order in `h` cancel for content that is smooth in depth (midpoint rule, Euler-Maclaurin).
//!
//! Slabs are computed on sub-bins. The discrete Gaussian of sub-bin averages, averaged over the sub-bins of a bin, is the bin average of the
//! blurred image up to aliases at the frequencies `2 pi / h` of the sub-bin `h`, where the bin average has a zero.

use super::averages::{Averages, STENCIL};
use super::camera::Camera;
use crate::error::{PhantomError, check};
use radon::{Collimator, DepthBlur};
use std::ops::Range;
use std::sync::OnceLock;

/// Fewest and most slabs of a depth-dependent response; even, so that they form pairs.
const FEWEST_SLABS: f64 = 12.0;
const MOST_SLABS: f64 = 2048.0;
/// Allowed reach of the blur in bins.
const MOST_REACH: [f64; 2] = [0.0, 1024.0];
/// Weight of a Gaussian beyond five standard deviations along both axes.
const TAILS: f64 = 1.2e-6;

/// Sub-bins, on which images are computed and blurred.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SubBins {
    /// Sub-bins per bin along the bins, and per row along the rows.
    pub(crate) counts: [usize; 2],
    /// Computation of averages over sub-bins; `None` for line integrals through their centres.
    pub(crate) averages: Option<Averages>,
    /// Bound on the remaining error relative to the largest sample.
    pub(crate) error: f64,
}

impl Default for SubBins {
    /// Returns one line integral per bin.
    fn default() -> Self {
        Self {
            counts: [1; 2],
            averages: None,
            error: 0.0,
        }
    }
}

/// The collimator face of a view and the extent of objects in front of it, cm from the axis towards the face.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Facing {
    pub(crate) radius: f64,
    /// Extent of the activity.
    pub(crate) seen: [f64; 2],
    /// Extent of all objects towards the face.
    pub(crate) body: f64,
}

/// The samples of a view that do not depend on the shape of the heart.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) samples: Vec<f32>,
    /// Bound on the error of the response, and the largest value before the response.
    pub(crate) error: f64,
    pub(crate) unblurred: f64,
}

/// A part of a view.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Window {
    /// Sub-bins, and rows of them, that are projected.
    pub(super) bins: Range<usize>,
    pub(super) rows: Range<usize>,
    /// Rows of sub-bins that samples are averages over, and the first row of samples that is computed.
    out: Range<usize>,
    first: usize,
    pub(super) slabs: Range<usize>,
}

/// Bins and rows of samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Area {
    pub(super) bins: Range<usize>,
    pub(super) rows: Range<usize>,
}

/// From the slabs of views, on sub-bins, to samples: blur by depth, average over the sub-bins of each bin.
#[derive(Debug)]
pub(crate) struct Depth {
    /// The camera of sub-bins, extended by the reach of the blur.
    pub(crate) camera: Camera,
    pub(crate) sub_bins: SubBins,
    /// The same on other sub-bins, for what surrounds the heart.
    surroundings: Option<Box<Self>>,
    /// Bins and rows of the camera whose samples are made.
    size: [usize; 2],
    /// Additional bins and rows on either side.
    margin: [usize; 2],
    /// Largest reach of the blur in sub-bins along bins and rows.
    reach: [usize; 2],
    response: Collimator,
    tolerance: f64,
    views: Vec<Facing>,
    /// Of each view the blur of its slabs, and that of slabs of twice the thickness, once they were made.
    blurs: Vec<OnceLock<[DepthBlur; 2]>>,
    /// Of each view the samples of what surrounds the heart, once they were made.
    pub(crate) fixed: Vec<OnceLock<Fixed>>,
    /// Largest number of slabs of a view, for memory.
    slabs: usize,
    nodes: usize,
}

impl Depth {
    /// Prepares the views with faces `views` for activity within `extent` (from the axis, and from its midpoint, cm). `tolerance` bounds the
    /// relative errors of height and variance of a point's image.
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
            surroundings: None,
            size,
            margin: [0; 2],
            reach: [0; 2],
            response,
            tolerance,
            blurs: views.iter().map(|_| OnceLock::new()).collect(),
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
        depth.margin = [0, 1].map(|axis| {
            let reach = (depth.reach[axis] + depth.stencil()).div_ceil(counts[axis]);
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

    /// The same, with another resolution of what surrounds the heart. Their errors add up.
    pub(crate) fn with_surroundings(mut self, surroundings: Self) -> Self {
        self.sub_bins.error += surroundings.sub_bins.error;
        self.surroundings = Some(Box::new(surroundings));
        self
    }

    pub(super) fn of_surroundings(&self) -> &Self {
        self.surroundings.as_deref().unwrap_or(self)
    }

    /// Bytes that an image takes: its slabs, pairs of them, and the images that are blurred.
    pub(crate) fn view_bytes(&self) -> usize {
        let own = 4 * self.camera.view_len() * (2 * self.slabs + self.nodes + 4);
        (self.surroundings.as_ref()).map_or(own, |around| own.max(around.view_bytes()))
    }

    /// Returns the number of bins per row of samples.
    pub(crate) fn n_bins(&self) -> usize {
        self.size[0]
    }

    /// Returns the number of rows of samples.
    pub(crate) fn n_rows(&self) -> usize {
        self.size[1]
    }

    /// Returns the rows of sub-bins within rows of samples.
    fn fine_rows(&self, rows: &Range<usize>) -> Range<usize> {
        let (above, count) = (self.margin[1], self.sub_bins.counts[1]);
        (rows.start + above) * count..(rows.end + above) * count
    }

    /// Bound on what the kernels' tails that are cut off hold, along both axes.
    pub(crate) fn tails(&self) -> f64 {
        match self.nodes {
            1 if self.reach == [0; 2] => 0.0,
            _ => TAILS,
        }
    }

    /// Returns the planes between the slabs of a view.
    pub(crate) fn planes(&self, view_idx: usize) -> Vec<f64> {
        self.planes_of(&self.views[view_idx])
    }

    fn planes_of(&self, view: &Facing) -> Vec<f64> {
        let (response, [low, high]) = (&self.response, view.seen);
        if response.slope() == 0.0 {
            return Vec::new();
        }
        // slope^2 h^2 / 12 is below half the tolerance of the smallest variance; the Gaussians shared by slabs need the other half.
        let near = response.sigma(view.radius - high);
        let thickest = near * (6.0 * self.tolerance).sqrt() / response.slope();
        let pairs = (0.5 * (high - low) / thickest).ceil();
        let n = (2.0 * pairs).clamp(FEWEST_SLABS, MOST_SLABS);
        let thickness = (high - low) / n;
        (1..n as usize)
            .map(|k| low + k as f64 * thickness)
            .collect()
    }

    /// Returns the variance of the blur of each slab between these planes.
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

    /// The part of a view that contains what reaches, in cm, from `bounds[axis][0]` to `bounds[axis][1]` along the bins, along the rows and towards
    /// the face, for some rows of samples; `None` if it is in none of them.
    pub(super) fn window(
        &self,
        view_idx: usize,
        bounds: [[f64; 2]; 3],
        rows: &Range<usize>,
    ) -> Result<Option<Window>, PhantomError> {
        let [low, high] = self.views[view_idx].seen;
        let slabs = match self.planes(view_idx).len() + 1 {
            1 => 0..1,
            n => {
                // Slabs make pairs for the coarser rule.
                let pair =
                    |t: f64| (0.5 * n as f64 * (t - low) / (high - low)).clamp(0.0, 0.5 * n as f64);
                let [from, to] = bounds[2].map(pair);
                2 * from.floor() as usize..2 * to.ceil() as usize
            }
        };
        if slabs.is_empty() {
            return Ok(None);
        }
        let blurs = self.blurs(view_idx, &slabs)?;
        let reach =
            [0, 1].map(|axis| blurs[0].reach()[axis].max(blurs[1].reach()[axis]) + self.stencil());
        let detector = self.camera.detector();
        let n = [detector.n_bins(), detector.n_rows()];
        let [bins, all_rows] = [0, 1].map(|axis| {
            let count = self.sub_bins.counts[axis];
            let at = |x: f64| {
                (x / detector.pitch()[axis] + 0.5 * n[axis] as f64).clamp(0.0, n[axis] as f64)
            };
            let [from, to] = [at(bounds[axis][0]).floor(), at(bounds[axis][1]).ceil()];
            let from = (from as usize).saturating_sub(reach[axis]) / count * count;
            from..((to as usize + reach[axis]).div_ceil(count) * count).min(n[axis])
        });
        let fine = self.fine_rows(rows);
        let out = fine.start.max(all_rows.start)..fine.end.min(all_rows.end);
        let inner = [self.margin[0], self.margin[0] + self.size[0]]
            .map(|bin| bin * self.sub_bins.counts[0]);
        if out.is_empty() || bins.start.max(inner[0]) >= bins.end.min(inner[1]) {
            return Ok(None);
        }
        let from = out.start.saturating_sub(reach[1]).max(all_rows.start);
        let to = (out.end + reach[1]).min(all_rows.end);
        Ok(Some(Window {
            bins,
            rows: from..to,
            out,
            first: rows.start,
            slabs,
        }))
    }

    /// All of a view, for some rows of samples.
    pub(super) fn everything(
        &self,
        view_idx: usize,
        rows: &Range<usize>,
    ) -> Result<Option<Window>, PhantomError> {
        self.window(view_idx, [[f64::NEG_INFINITY, f64::INFINITY]; 3], rows)
    }

    /// The blur of some slabs of a view, and that of slabs of twice the thickness with four times the tolerance.
    fn blurs(&self, view_idx: usize, slabs: &Range<usize>) -> Result<[DepthBlur; 2], PhantomError> {
        let of_view = match self.blurs[view_idx].get() {
            Some(blurs) => blurs,
            None => {
                let (view, planes) = (&self.views[view_idx], self.planes(view_idx));
                let fine = self.gaussians(&self.variances(view, &planes), self.tolerance)?;
                let coarse = match planes.is_empty() {
                    true => fine.clone(),
                    false => {
                        let every_other: Vec<f64> =
                            planes.iter().skip(1).step_by(2).copied().collect();
                        self.gaussians(&self.variances(view, &every_other), 4.0 * self.tolerance)?
                    }
                };
                self.blurs[view_idx].get_or_init(|| [fine, coarse])
            }
        };
        let [fine, coarse] = of_view;
        Ok(match self.planes(view_idx).is_empty() {
            true => [fine.clone(), coarse.clone()],
            false => [
                fine.slabs(slabs.clone())?,
                coarse.slabs(slabs.start / 2..slabs.end / 2)?,
            ],
        })
    }

    /// The samples of a window from its slabs `[row][slab][bin]`.
    pub(super) fn samples(
        &self,
        view_idx: usize,
        window: &Window,
        slabs: &[f32],
    ) -> Result<Vec<f32>, PhantomError> {
        let [fine, _] = self.blurs(view_idx, &window.slabs)?;
        self.averaged(&fine, window, slabs)
    }

    /// The differences of the samples of a window from those of slabs of twice the thickness and four times the tolerance; they bound the errors
    /// of the samples, which are of first order in the thickness at worst. `None` without slabs.
    pub(super) fn differences(
        &self,
        view_idx: usize,
        window: &Window,
        (slabs, samples): (&[f32], &[f32]),
    ) -> Result<Option<Vec<f32>>, PhantomError> {
        if window.slabs.len() == 1 {
            return Ok(None);
        }
        let pairs: Vec<f32> = (slabs.chunks(2 * window.bins.len()))
            .flat_map(|pair| {
                let (a, b) = pair.split_at(window.bins.len());
                a.iter().zip(b).map(|(a, b)| a + b)
            })
            .collect();
        let [_, coarse] = self.blurs(view_idx, &window.slabs)?;
        let mut differences = self.averaged(&coarse, window, &pairs)?;
        for (difference, sample) in differences.iter_mut().zip(samples) {
            *difference = sample - *difference;
        }
        Ok(Some(differences))
    }

    /// Blurs slabs on sub-bins and averages over the sub-bins of each bin.
    fn averaged(
        &self,
        blur: &DepthBlur,
        window: &Window,
        slabs: &[f32],
    ) -> Result<Vec<f32>, PhantomError> {
        let n_bins = window.bins.len();
        let mut blurred = vec![0.0f32; window.out.len() * n_bins];
        blur.apply(
            slabs,
            n_bins,
            window.out.start - window.rows.start,
            &mut blurred,
        )?;
        let area = self.area(window);
        let [along, across] = self.sub_bins.counts;
        let first = (self.margin[0] + area.bins.start) * along - window.bins.start;
        let each = 1.0 / (along * across) as f64;
        let average = |lines: &[f32], bin: usize| {
            let from = first + bin * along;
            let lines = lines.chunks(n_bins).map(|line| &line[from..from + along]);
            let sum: f64 = lines.flatten().map(|value| f64::from(*value)).sum();
            (each * sum) as f32
        };
        let rows = blurred.chunks(across * n_bins);
        Ok(rows
            .flat_map(|lines| (0..area.bins.len()).map(move |bin| average(lines, bin)))
            .collect())
    }

    /// The bins of the samples of a window, and their rows among those that are computed.
    pub(super) fn area(&self, window: &Window) -> Area {
        let [along, across] = self.sub_bins.counts;
        let [beside, above] = self.margin;
        Area {
            bins: (window.bins.start / along).max(beside) - beside
                ..(window.bins.end / along).min(beside + self.size[0]) - beside,
            rows: window.out.start / across - above - window.first
                ..window.out.end / across - above - window.first,
        }
    }

    /// The number of sub-bins that some rows of samples depend on.
    pub(super) fn n_rays(&self, rows: &Range<usize>) -> usize {
        let (fine, reach) = (self.fine_rows(rows), self.reach[1] + self.stencil());
        let to = (fine.end + reach).min(self.camera.n_rows());
        (to - fine.start.saturating_sub(reach)) * self.camera.n_bins()
    }

    fn stencil(&self) -> usize {
        self.sub_bins.averages.as_ref().map_or(0, |_| STENCIL)
    }
}
