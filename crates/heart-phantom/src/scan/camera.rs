//! The camera: where the views look from, when, how finely they are sampled, and the voxels made from them.

use crate::error::{PhantomError, check, check_count};
use revolve_voxel::{ParallelDetector, ParallelRays, VoxelGrid};
use std::f64::consts::PI;

/// Samples of one set of views or of one volume: 8 GiB of `f32`.
pub(crate) const MOST_SAMPLES: f64 = 2_147_483_648.0;

/// What there are too many of.
pub(crate) const VOXELS: &str = "voxels";

/// How the camera goes from view to view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Rotation {
    /// It stands still while it takes a view, and takes no time to move.
    StepAndShoot,
    /// It turns all the time, and passes a view's angle in the middle of its time ([`ViewTime`](crate::ViewTime)).
    Continuous,
}

/// The heads of a camera, each a detector behind a collimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Heads {
    /// One.
    One,
    /// Two, fixed to each other: they turn together, and view `k` of the one is taken while view `k` of the other is.
    Two {
        /// How far the second is ahead of the first one, in radians.
        angle: f64,
    },
}

impl Heads {
    /// How many.
    pub fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two { .. } => 2,
        }
    }

    /// How far the last one is ahead of the first.
    fn angle(self) -> f64 {
        match self {
            Self::One => 0.0,
            Self::Two { angle } => angle,
        }
    }
}

/// Views, detector and voxels, for [`Camera::with_geometry`].
#[derive(Debug, Clone, PartialEq)]
pub struct CameraGeometry {
    /// Number of views of a head.
    pub views: usize,
    /// Angle that a head covers in radians, counter-clockwise seen from +z; negative turns the other way.
    pub arc: f64,
    /// Angle of the first view in radians.
    pub start: f64,
    /// How many heads take views at a time.
    pub heads: Heads,
    /// Bins of a row.
    pub bins: usize,
    /// Rows, which are also the slices of the volume.
    pub rows: usize,
    /// Pitch of the bins and of the rows in cm.
    pub pitch: [f64; 2],
    /// How the camera goes from view to view.
    pub rotation: Rotation,
    /// Seconds from the start of a view to the start of the next.
    pub interval: f64,
    /// Voxels along x and along y.
    pub pixels: [usize; 2],
    /// Their edge in x and y in cm; along z it is the pitch of the rows.
    pub pixel: f64,
    /// Where in the slice their middle is, cm.
    pub centre: [f64; 2],
}

/// A parallel-hole camera that turns about the lab's z axis, and the voxels that are reconstructed
/// from it.
///
/// View `k` of `n` looks from `theta_k = start + k arc / n`: bins lie along `(cos theta, sin theta, 0)`,
/// rays run along `(-sin theta, cos theta, 0)`, rows lie along z. Bins, rows and voxels are centred:
/// number `k` of `m` at `(k - (m - 1) / 2) * pitch`. Slice `j` of the volume is at the height of row `j`. Of two heads the second one's
/// views come after those of the first, number `n + k` at the time of number `k`.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    from: CameraGeometry,
    geometry: radon::ParallelGeometry,
    step: f64,
    detector: ParallelDetector,
    grid: VoxelGrid,
    image: radon::ImageGrid,
}

impl Camera {
    /// `n_views` views over 180 degrees of `size` bins and `size` rows that fill a field of view `field` cm
    /// wide, and as many voxels.
    ///
    /// # Errors
    /// [`PhantomError::Radon`] or [`PhantomError::Solid`] if a count is zero or `field` is not
    /// finite and positive.
    pub fn new(n_views: usize, size: usize, field: f64) -> Result<Self, PhantomError> {
        let pitch = field / size as f64;
        Self::with_geometry(&CameraGeometry {
            views: n_views,
            arc: PI,
            start: 0.0,
            heads: Heads::One,
            bins: size,
            rows: size,
            pitch: [pitch; 2],
            rotation: Rotation::StepAndShoot,
            interval: 1.0,
            pixels: [size; 2],
            pixel: pitch,
            centre: [0.0; 2],
        })
    }

    /// Any camera.
    ///
    /// # Errors
    /// [`PhantomError::Radon`] or [`PhantomError::Solid`] if a count is zero or a pitch is not finite and positive;
    /// [`PhantomError::OutOfRange`] for angles beyond 1000 radians, an arc of nothing or an interval that is not positive, and for
    /// more than 2^31 samples of all views, or voxels.
    pub fn with_geometry(from: &CameraGeometry) -> Result<Self, PhantomError> {
        check("arc", from.arc.abs(), [f64::MIN_POSITIVE, 1e3])?;
        check("start", from.start, [-1e3, 1e3])?;
        check("angle between the heads", from.heads.angle(), [-1e3, 1e3])?;
        check("interval", from.interval, [f64::MIN_POSITIVE, 1e9])?;
        let n = from.views as f64;
        // None of them counts as one: what comes below says what is missing.
        let product = |counts: [usize; 3]| counts.iter().map(|&n| n.max(1) as f64).product();
        let n_views = from.views.saturating_mul(from.heads.count());
        let samples = product([n_views, from.bins, from.rows]);
        check("views x bins x rows", samples, [0.0, MOST_SAMPLES])?;
        let voxels = product([from.pixels[0], from.pixels[1], from.rows]);
        check(VOXELS, voxels, [0.0, MOST_SAMPLES])?;
        let angle = |view_idx: usize| {
            let (head, k) = (view_idx / from.views, view_idx % from.views);
            from.start + head as f64 * from.heads.angle() + k as f64 * from.arc / n
        };
        let angles: Vec<f64> = (0..n_views).map(angle).collect();
        let ([bin, row], [nx, ny], [x, y]) = (from.pitch, from.pixels, from.centre);
        Ok(Self {
            from: from.clone(),
            geometry: radon::ParallelGeometry::new(angles, from.bins, bin)?,
            step: from.arc / n,
            detector: ParallelDetector::new(from.bins, from.rows, from.pitch)?,
            grid: VoxelGrid::centred(
                [nx, ny, from.rows],
                [from.pixel, from.pixel, row],
                [x, y, 0.0],
            )?,
            image: radon::ImageGrid::new(nx, ny, from.pixel)?.with_centre(from.centre)?,
        })
    }

    /// The same views with no more than so many bins and rows, which see as much.
    pub(crate) fn coarse(&self, most: usize) -> Result<Self, PhantomError> {
        let mut coarse = self.from.clone();
        let [bins, rows] = [coarse.bins.min(most), coarse.rows.min(most)];
        coarse.pitch[0] *= coarse.bins as f64 / bins as f64;
        coarse.pitch[1] *= coarse.rows as f64 / rows as f64;
        (coarse.bins, coarse.rows) = (bins, rows);
        Self::with_geometry(&coarse)
    }

    /// The same views on another raster of bins and rows about the same centre. The voxels stay as they are.
    pub(crate) fn with_raster(
        &self,
        [bins, rows]: [usize; 2],
        pitch: [f64; 2],
    ) -> Result<Self, PhantomError> {
        let angles = self.geometry.angles().to_vec();
        Ok(Self {
            geometry: radon::ParallelGeometry::new(angles, bins, pitch[0])?,
            detector: ParallelDetector::new(bins, rows, pitch)?,
            from: CameraGeometry {
                bins,
                rows,
                pitch,
                ..self.from.clone()
            },
            ..self.clone()
        })
    }

    /// The same with voxels that reach, along x and along y, from `low` to `high` in cm, too, and with as many layers more below and above;
    /// and which of them is the first one of these.
    pub(crate) fn with_voxels_around(
        &self,
        reach: [[f64; 2]; 2],
        layers: f64,
    ) -> Result<([usize; 3], Self), PhantomError> {
        let mut wide = self.from.clone();
        let mut first = [0, 0, layers as usize];
        wide.rows += 2 * first[2];
        for (axis, [low, high]) in reach.into_iter().enumerate() {
            let (pixel, centre) = (wide.pixel, wide.centre[axis]);
            let half = 0.5 * wide.pixels[axis] as f64 * pixel;
            // What only rounding puts outside is inside.
            let more = |missing: f64| (missing / pixel - 1e-6).ceil().max(0.0);
            let [before, behind] = [more(centre - half - low), more(high - centre - half)];
            first[axis] = before as usize;
            wide.pixels[axis] += (before + behind) as usize;
            wide.centre[axis] += 0.5 * (behind - before) * pixel;
        }
        Ok((first, Self::with_geometry(&wide)?))
    }

    /// Angles and bins. A camera that turns all the time stands at these angles in the middle of each view's time; what it saw in a
    /// part of it is reconstructed from the mean angle of that ([`Sinograms::angles`](crate::Sinograms::angles),
    /// [`Phantom::geometry`](crate::Phantom::geometry)).
    pub fn geometry(&self) -> &radon::ParallelGeometry {
        &self.geometry
    }

    /// The detector.
    pub fn detector(&self) -> &ParallelDetector {
        &self.detector
    }

    /// The voxels, index order `[z][y][x]`.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The pixels of one slice, index order `[y][x]`.
    pub fn image(&self) -> &radon::ImageGrid {
        &self.image
    }

    /// How the camera goes from view to view.
    pub fn rotation(&self) -> Rotation {
        self.from.rotation
    }

    /// Seconds from the start of a view to the start of the next, `T`.
    pub fn interval(&self) -> f64 {
        self.from.interval
    }

    /// Seconds from the start of the first view to that of another one, which on two heads start together.
    pub fn view_start(&self, view_idx: usize) -> f64 {
        (view_idx % self.from.views) as f64 * self.from.interval
    }

    /// How many heads take views at a time.
    pub fn heads(&self) -> Heads {
        self.from.heads
    }

    /// Whether each view is as far from the one before as all others, which those of two heads need not be.
    pub(crate) fn has_even_steps(&self) -> bool {
        let angles = self.geometry.angles();
        let step = |pair: &[f64]| pair[1] - pair[0];
        (angles.windows(2))
            .all(|pair| (step(pair) - step(angles)).abs() <= 1e-9 * step(angles).abs())
    }

    /// The same camera with another interval between views.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] unless it is positive and at most 1e9 s.
    pub fn with_interval(mut self, seconds: f64) -> Result<Self, PhantomError> {
        self.from.interval = check("interval", seconds, [f64::MIN_POSITIVE, 1e9])?;
        Ok(self)
    }

    /// Number of views, of all heads.
    pub fn n_views(&self) -> usize {
        self.geometry.n_views()
    }

    /// Bins of a row.
    pub fn n_bins(&self) -> usize {
        self.geometry.n_bins()
    }

    /// Rows of a view, slices of the volume.
    pub fn n_rows(&self) -> usize {
        self.detector.n_rows()
    }

    /// Samples of one view.
    pub fn view_len(&self) -> usize {
        self.n_bins() * self.n_rows()
    }

    /// Pitch of the bins in cm.
    pub fn pitch(&self) -> f64 {
        self.geometry.pitch()
    }

    /// Radius of the disc that every view sees, less one bin: `(n / 2 - 1) * pitch`.
    pub fn field_radius(&self) -> f64 {
        (self.n_bins() as f64 / 2.0 - 1.0) * self.pitch()
    }

    /// Angle in radians at which a view is taken after a share of its interval, if the camera turns; it passes the view's own
    /// angle at the middle, 1/2.
    pub(crate) fn angle(&self, view_idx: usize, share: f64) -> f64 {
        match self.rotation() {
            Rotation::StepAndShoot => self.geometry.angles()[view_idx],
            Rotation::Continuous => self.geometry.angles()[view_idx] + (share - 0.5) * self.step,
        }
    }

    /// The rays of one view, image order `[row][bin]`.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such view.
    pub fn rays(&self, view_idx: usize) -> Result<ParallelRays, PhantomError> {
        check_count("view_idx", view_idx, [0, self.n_views() - 1])?;
        Ok(self.detector.rays(self.geometry.angles()[view_idx])?)
    }
}
