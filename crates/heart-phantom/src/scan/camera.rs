//! The camera: angles and times of the views, detector, and voxel grid.

use super::ray_geometry::RayGeometry;
use super::settings::Rotation;
use crate::error::{PhantomError, check};
use crate::scene::{CameraSettings, HeadsSettings};
use revolve_voxel::{ParallelDetector, VoxelGrid};
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

/// Largest number of samples of a projection set or a volume: 8 GiB of `f32`.
pub(crate) const MOST_SAMPLES: f64 = 2_147_483_648.0;

/// Name of the limited quantity in errors.
pub(crate) const VOXELS: &str = "voxels";

/// Some rows of some views: the views and the rows of each.
pub(crate) type RowsOfViews = (Range<usize>, Range<usize>);

/// The voxels of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Voxels {
    /// Number along x and y; along z it is that of the rows.
    pub(crate) pixels: [usize; 2],
    /// Size in x and y, cm; along z it is the pitch of the rows.
    pub(crate) pixel: f64,
    /// Centre of the slice, cm.
    pub(crate) centre: [f64; 2],
}

/// A camera with parallel rays that rotates about the axis z of the lab, or with those of a [`RayGeometry`] (fan and cone beams,
/// matrices, lines), and the voxel grid of its reconstructions.
///
/// With parallel rays view `k` of `n` has the angle `theta_k = start + k arc / n`: bins lie along `(cos theta, sin theta, 0)`, rays along
/// `(-sin theta, cos theta, 0)`, rows along z. Bins, rows and voxels are centred: number `k` of `m` is at `(k - (m - 1) / 2) * pitch`. Slice `j` of the
/// volume has the height of row `j`. The views of a second head follow those of the first; view `n + k` is simultaneous with view `k`.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    from: CameraSettings,
    voxels: Voxels,
    geometry: radon::ParallelGeometry,
    step: f64,
    detector: ParallelDetector,
    grid: VoxelGrid,
    image: radon::ImageGrid,
    /// `None` for parallel rays.
    rays: Option<Arc<RayGeometry>>,
}

/// Distinct directions below which projections do not determine an image.
pub(crate) const LEAST_DIRECTIONS: usize = 3;

impl Camera {
    /// Returns the camera of a validated section with some voxels.
    ///
    /// # Errors
    /// [`PhantomError::Radon`] or [`PhantomError::Solid`] if a count is zero or a pitch is not finite and positive;
    /// [`PhantomError::OutOfRange`] for more than 2^31 samples of all views or voxels.
    pub(crate) fn new(from: &CameraSettings, voxels: Voxels) -> Result<Self, PhantomError> {
        let [arc, start, apart] = [from.arc, from.start, from.heads.angle()].map(f64::to_radians);
        let n = from.views as f64;
        // Zero counts as one: the checks below report it.
        let product = |counts: [usize; 3]| counts.iter().map(|&n| n.max(1) as f64).product();
        let n_views = from.views.saturating_mul(from.heads.count());
        let samples = product([n_views, from.bins, from.rows]);
        check("views x bins x rows", samples, [0.0, MOST_SAMPLES])?;
        let ([nx, ny], [x, y]) = (voxels.pixels, voxels.centre);
        check(VOXELS, product([nx, ny, from.rows]), [0.0, MOST_SAMPLES])?;
        let angle = |view_idx: usize| {
            let (head, k) = (view_idx / from.views, view_idx % from.views);
            start + head as f64 * apart + k as f64 * arc / n
        };
        let angles: Vec<f64> = (0..n_views).map(angle).collect();
        let [bin, row] = from.pitch;
        Ok(Self {
            from: from.clone(),
            voxels,
            geometry: radon::ParallelGeometry::from_radians(angles, from.bins, bin)?,
            step: arc / n,
            detector: ParallelDetector::new(from.bins, from.rows, from.pitch)?,
            grid: VoxelGrid::centred(
                [nx, ny, from.rows],
                [voxels.pixel, voxels.pixel, row],
                [x, y, 0.0],
            )?,
            image: radon::ImageGrid::new(nx, ny, voxels.pixel)?.with_centre(voxels.centre)?,
            rays: None,
        })
    }

    /// Returns the camera with the views and the detector of a ray geometry; pixels and interval do not change.
    pub(crate) fn along(&self, rays: RayGeometry) -> Result<Self, PhantomError> {
        let detector = rays.detector();
        let angles = (0..rays.n_views()).map(|view_idx| rays.angle(view_idx));
        let angles = angles.collect::<Result<Vec<_>, _>>()?;
        let from = CameraSettings {
            views: rays.n_views(),
            heads: HeadsSettings::One,
            bins: detector.n_bins(),
            rows: detector.n_rows(),
            pitch: detector.pitch(),
            rotation: Rotation::StepAndShoot,
            ..self.from.clone()
        };
        let made = Self::new(&from, self.voxels)?;
        Ok(Self {
            geometry: radon::ParallelGeometry::from_radians(angles, made.n_bins(), made.pitch())?,
            rays: Some(Arc::new(rays)),
            ..made
        })
    }

    /// Returns the rays of the views; `None` if they are parallel.
    pub(crate) fn ray_geometry(&self) -> Option<&RayGeometry> {
        self.rays.as_deref()
    }

    /// Returns the same views with at most so many bins and rows in the same field of view, and the same voxels.
    pub(crate) fn coarse(&self, most: usize) -> Result<Self, PhantomError> {
        let mut coarse = self.clone();
        // A list has no other raster.
        if self.rays.as_ref().is_none_or(|rays| rays.has_bins()) {
            let from = &mut coarse.from;
            let [bins, rows] = [from.bins.min(most), from.rows.min(most)];
            from.pitch[0] *= from.bins as f64 / bins as f64;
            from.pitch[1] *= from.rows as f64 / rows as f64;
            (from.bins, from.rows) = (bins, rows);
            let angles = self.geometry.angles().to_vec();
            coarse.geometry = radon::ParallelGeometry::from_radians(angles, bins, from.pitch[0])?;
            coarse.detector = ParallelDetector::new(bins, rows, from.pitch)?;
        }
        Ok(coarse)
    }

    /// Returns the angle of rotation during a view in radians.
    pub(crate) fn turn(&self) -> f64 {
        match self.rotation() {
            Rotation::StepAndShoot => 0.0,
            Rotation::Continuous => self.step.abs(),
        }
    }

    /// Returns the camera without rotation during a view.
    pub(crate) fn stopped(&self) -> Self {
        let mut camera = self.clone();
        camera.from.rotation = Rotation::StepAndShoot;
        camera
    }

    /// Extends the voxels to `low` and `high` in cm along x and y, and by `layers` below and above. Returns the index of the first original
    /// voxel.
    pub(crate) fn with_voxels_around(
        &self,
        reach: [[f64; 2]; 2],
        layers: f64,
    ) -> Result<([usize; 3], Self), PhantomError> {
        let (mut from, mut wide) = (self.from.clone(), self.voxels);
        let mut first = [0, 0, layers as usize];
        from.rows += 2 * first[2];
        for (axis, [low, high]) in reach.into_iter().enumerate() {
            let (pixel, centre) = (wide.pixel, wide.centre[axis]);
            let half = 0.5 * wide.pixels[axis] as f64 * pixel;
            // Differences within rounding do not count.
            let more = |missing: f64| (missing / pixel - 1e-6).ceil().max(0.0);
            let [before, behind] = [more(centre - half - low), more(high - centre - half)];
            first[axis] = before as usize;
            wide.pixels[axis] += (before + behind) as usize;
            wide.centre[axis] += 0.5 * (behind - before) * pixel;
        }
        Ok((first, Self::new(&from, wide)?))
    }

    /// Returns nominal angles and bins. With continuous rotation the camera is at these angles at the middle of each interval; a view that uses a
    /// part of it is reconstructed at its mean angle ([`Phantom::geometry`](crate::Phantom::geometry)).
    #[must_use]
    pub fn geometry(&self) -> &radon::ParallelGeometry {
        &self.geometry
    }

    /// Returns the detector.
    #[must_use]
    pub fn detector(&self) -> &ParallelDetector {
        &self.detector
    }

    /// Returns the voxel grid, index order `[z][y][x]`.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// Returns the pixel grid of a slice, index order `[y][x]`.
    #[must_use]
    pub fn image(&self) -> &radon::ImageGrid {
        &self.image
    }

    /// Returns the motion between views.
    pub(crate) fn rotation(&self) -> Rotation {
        self.from.rotation
    }

    /// Returns the time `T` between the starts of consecutive views, seconds.
    pub(crate) fn interval(&self) -> f64 {
        self.from.seconds_per_view
    }

    /// Returns the start of a view in seconds after the first view; simultaneous views of both heads have the same start.
    pub(crate) fn view_start(&self, view_idx: usize) -> f64 {
        if let Some(times) = self.ray_geometry().and_then(RayGeometry::times) {
            return times[view_idx];
        }
        (view_idx % self.from.views) as f64 * self.from.seconds_per_view
    }

    /// Returns the end of the last view in seconds after the start of the first.
    pub(crate) fn end(&self) -> f64 {
        self.view_start(self.n_views() - 1) + self.interval()
    }

    /// Returns the number of heads.
    pub(crate) fn n_heads(&self) -> usize {
        self.from.heads.count()
    }

    /// Whether all angle steps between consecutive views are equal; those of two heads may differ.
    pub(crate) fn has_even_steps(&self) -> bool {
        let angles = self.geometry.angles();
        let step = |pair: &[f64]| pair[1] - pair[0];
        (angles.windows(2))
            .all(|pair| (step(pair) - step(angles)).abs() <= 1e-9 * step(angles).abs())
    }

    /// Returns the number of views of all heads.
    #[must_use]
    pub fn n_views(&self) -> usize {
        self.geometry.n_views()
    }

    /// Returns the number of distinct directions of the views; those of opposite parallel projections are the same.
    pub(crate) fn n_directions(&self) -> usize {
        let angles = self.geometry.angles().iter();
        let mut directions: Vec<f64> = angles.map(|angle| angle.rem_euclid(PI)).collect();
        directions.sort_by(f64::total_cmp);
        // Angles in degrees are rounded; the smallest step of a camera is far larger.
        directions.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
        let [first, .., last] = directions[..] else {
            return directions.len();
        };
        directions.len() - usize::from(first + PI - last < 1e-6)
    }

    /// Returns the number of bins per row.
    #[must_use]
    pub fn n_bins(&self) -> usize {
        self.geometry.n_bins()
    }

    /// Returns the number of rows of a view, and of slices of the volume.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.detector.n_rows()
    }

    /// Returns the number of samples of a view.
    #[must_use]
    pub fn view_len(&self) -> usize {
        self.n_bins() * self.n_rows()
    }

    /// Returns all rows of some views.
    pub(crate) fn rows_of(&self, views: Range<usize>) -> RowsOfViews {
        (views, 0..self.n_rows())
    }

    /// Returns all rows of all views.
    pub(crate) fn all_rows(&self) -> RowsOfViews {
        self.rows_of(0..self.n_views())
    }

    /// Returns the pitch of the bins, cm.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.geometry.pitch()
    }

    /// Returns the radius of the disc within all views, less one bin: `(n / 2 - 1) * pitch`.
    pub(crate) fn field_radius(&self) -> f64 {
        (self.n_bins() as f64 / 2.0 - 1.0) * self.pitch()
    }

    /// Returns the angle after a fraction of a view's interval, radians. With continuous rotation the nominal angle is at 1/2.
    pub(crate) fn angle(&self, view_idx: usize, share: f64) -> f64 {
        match self.rotation() {
            Rotation::StepAndShoot => self.geometry.angles()[view_idx],
            Rotation::Continuous => self.geometry.angles()[view_idx] + (share - 0.5) * self.step,
        }
    }
}
