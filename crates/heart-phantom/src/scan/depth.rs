//! Resolution that depends on depth: what lies in thin slabs across the rays, each blurred by its own width.
//!
//! The collimator's face is ahead of the rays, at `t = R` from the axis. Slab `k` is between the planes `t_k` and `t_(k + 1)`, its
//! content exact; at the distance `d = R - t` it is seen `sigma(d)` wide. All of a slab is blurred alike, by the variance of its middle
//! less `slope^2 h^2 / 12` for a thickness `h`: the variance of a view is that of its lines plus the mean of `sigma(d)^2`, and of that
//! mean the errors of second order in `h` cancel where content changes smoothly with depth (midpoint rule, Euler-Maclaurin).

use super::camera::Camera;
use super::wide::widened;
use crate::error::{PhantomError, check};
use radon::{Collimator, DepthBlur};
use std::ops::Range;

/// Fewest slabs where depth makes a difference, and most.
const FEWEST_SLABS: f64 = 12.0;
const MOST_SLABS: f64 = 2048.0;

/// What has to be more than anything that is seen is from the axis.
pub(crate) const FACE: &str = "distance of the collimator's face from the axis";

/// Collimator and crystal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collimation {
    /// How wide a point is seen, by its distance from the collimator's face.
    pub response: Collimator,
    /// Error of a view that slabs and shared blurs may cause: of the variance by which any point is blurred, as a share of it, and of
    /// the height of its image.
    pub tolerance: f64,
}

/// The slabs of a camera's views and what blurs them.
#[derive(Debug)]
pub(crate) struct Depth {
    /// As large as all that the blur brings into the views needs; of its views the camera's are the middle.
    pub(crate) camera: Camera,
    /// Bins, and rows, more on either side.
    pub(crate) margin: [usize; 2],
    pub(crate) planes: Vec<f64>,
    blur: DepthBlur,
}

impl Depth {
    /// Where there is anything to see as far as `extent` (from the axis, and from the middle along it, in cm), the collimator's face
    /// `radius` from the axis.
    pub(crate) fn new(
        collimation: &Collimation,
        camera: &Camera,
        radius: f64,
        extent: [f64; 2],
    ) -> Result<Self, PhantomError> {
        check(FACE, radius, [extent[0], f64::MAX])?;
        let (response, side) = (&collimation.response, extent[0]);
        let near = response.sigma(radius - side);
        // slope^2 h^2 / 12 below the tolerance of the smallest variance; one slab where depth makes no difference.
        let thickest = near * (12.0 * collimation.tolerance).sqrt() / response.slope();
        let n = match response.slope() > 0.0 {
            true => (2.0 * side / thickest)
                .ceil()
                .clamp(FEWEST_SLABS, MOST_SLABS),
            false => 1.0,
        };
        let thickness = 2.0 * side / n;
        let n = n as usize;
        let planes = (1..n).map(|k| k as f64 * thickness - side).collect();
        let within = (response.slope() * thickness).powi(2) / 12.0;
        let variances: Vec<f64> = (0..n)
            .map(|k| radius + side - (k as f64 + 0.5) * thickness)
            .map(|distance| (response.variance(distance) - within).max(0.0))
            .collect();
        let pitch = camera.detector().pitch();
        let blur = DepthBlur::new(&variances, pitch, collimation.tolerance)?;
        let (margin, camera) = widened(camera, blur.reach(), extent)?;
        Ok(Self {
            camera,
            margin,
            planes,
            blur,
        })
    }

    /// Bytes that a view under way takes: its slabs, both halves of its rule and one point of it, and the images that are blurred.
    pub(crate) fn view_bytes(&self) -> usize {
        4 * self.camera.view_len() * (3 * (self.planes.len() + 1) + self.blur.n_nodes() + 2)
    }

    /// The rows of the wide camera that some of its rows, once blurred, are made of.
    pub(crate) fn rows_seen(&self, rows: &Range<usize>) -> Range<usize> {
        let reach = self.blur.reach()[1];
        rows.start.saturating_sub(reach)..(rows.end + reach).min(self.camera.n_rows())
    }

    /// Some rows of a view from the slabs `[row][slab][bin]` of those seen.
    pub(crate) fn view(
        &self,
        slabs: &[f32],
        rows: &Range<usize>,
        image: &mut [f32],
    ) -> Result<(), PhantomError> {
        let above = rows.start - self.rows_seen(rows).start;
        Ok(self.blur.apply(slabs, self.camera.n_bins(), above, image)?)
    }
}
