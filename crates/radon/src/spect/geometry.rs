//! Geometry of a SPECT camera.

use crate::error::{RadonError, length, positive, product};
use crate::{ParallelGeometry, SliceAxis};

/// The geometry of a SPECT camera: angles and bins, detector rows, and the distance of the collimator face from the axis of rotation in
/// each view.
///
/// Conventions are those of [`ParallelGeometry`]: in view theta, bins lie along (cos theta, sin theta), and detected photons travel along
/// (-sin theta, cos theta). The collimator face of view v is at R_v (-sin theta, cos theta); a point (x, y, z) is R_v + x sin theta - y cos
/// theta in front of it. Start, direction and order of angles are arbitrary; views are `[view][row][bin]`.
///
/// ```
/// use radon::{ParallelGeometry, SliceAxis, SpectGeometry};
/// let views = ParallelGeometry::full_turn(4, 64, 0.4)?;
/// let rows = SliceAxis::new(64, 0.4)?;
/// // An elliptical orbit: the radius is smaller at the front and the back than at the sides.
/// let geometry = SpectGeometry::new(&views, &rows, [16.0, 24.0, 16.0, 24.0])?;
/// assert_eq!(geometry.data_len(), 4 * 64 * 64);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SpectGeometry {
    views: ParallelGeometry,
    rows: SliceAxis,
    radii: Vec<f64>,
}

impl SpectGeometry {
    /// Returns a geometry with the collimator face at `radii` (cm), one per view, outside the body: counts from behind a face are lost.
    ///
    /// # Errors
    /// [`RadonError::WrongLength`] if the numbers of radii and views differ, [`RadonError::NotFinite`], [`RadonError::NotPositive`],
    /// [`RadonError::TooLarge`].
    pub fn new(
        views: &ParallelGeometry,
        rows: &SliceAxis,
        radii: impl Into<Vec<f64>>,
    ) -> Result<Self, RadonError> {
        let radii = radii.into();
        length("radii of the orbit", radii.len(), views.n_views())?;
        for &radius in &radii {
            positive("radius of the orbit", radius)?;
        }
        product("views", views.sinogram_len(), rows.n_slices())?;
        Ok(Self {
            views: views.clone(),
            rows: *rows,
            radii,
        })
    }

    /// Returns a geometry with a circular orbit.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn circular(
        views: &ParallelGeometry,
        rows: &SliceAxis,
        radius: f64,
    ) -> Result<Self, RadonError> {
        Self::new(views, rows, vec![radius; views.n_views()])
    }

    /// Angles and bins.
    #[must_use]
    pub fn views(&self) -> &ParallelGeometry {
        &self.views
    }

    /// Rows of the detector.
    #[must_use]
    pub fn rows(&self) -> &SliceAxis {
        &self.rows
    }

    /// Distance of the collimator's face from the axis of rotation in each view (cm).
    #[must_use]
    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Samples of one view, rows times bins.
    #[must_use]
    pub fn view_len(&self) -> usize {
        self.rows.n_slices() * self.views.n_bins()
    }

    /// Samples of all views.
    #[must_use]
    pub fn data_len(&self) -> usize {
        self.view_len() * self.views.n_views()
    }
}
