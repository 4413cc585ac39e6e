//! The pose of a body in the lab.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use crate::RevolveError;
use crate::error::{finite, within};
use crate::solid::segment::ROUNDING;

/// Largest angle of a rotation: two turns and their rounding errors; most angles in degrees are larger.
const MOST_ANGLE: f64 = 12.6;

/// A rigid motion from the body frame (x = axis of revolution, base to apex) to the lab frame.
///
/// ```
/// use revolve_voxel::Pose;
/// use std::f64::consts::FRAC_PI_4;
/// let pose = Pose::axis_along_z(5.625)?.rotated_x(FRAC_PI_4)?.rotated_y(FRAC_PI_4)?;
/// let d = pose.axis();
/// assert!((d.x - 0.5).abs() < 1e-15 && (d.y + 0.5f64.sqrt()).abs() < 1e-15 && (d.z - 0.5).abs() < 1e-15);
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    isometry: Isometry3<f64>,
}

/// The identity.
impl Default for Pose {
    fn default() -> Self {
        Self::identity()
    }
}

impl Pose {
    /// The identity: body frame and lab frame coincide.
    #[must_use]
    pub fn identity() -> Self {
        Self {
            isometry: Isometry3::identity(),
        }
    }

    /// A pose from any rigid motion, body to lab.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`] if a component is NaN or infinite; the rotation is renormalised.
    pub fn new(isometry: Isometry3<f64>) -> Result<Self, RevolveError> {
        for v in isometry.translation.vector.iter() {
            finite("translation", *v)?;
        }
        for v in isometry.rotation.coords.iter() {
            finite("rotation", *v)?;
        }
        let norm = isometry.rotation.coords.norm();
        if norm <= 0.0 {
            return Err(RevolveError::NotPositive {
                what: "norm of the rotation",
                given: norm,
            });
        }
        let rotation = UnitQuaternion::from_quaternion(isometry.rotation.into_inner());
        Ok(Self {
            isometry: Isometry3::from_parts(isometry.translation, rotation),
        })
    }

    /// The axis of the body along z of the lab, apex towards +z, with the axis point `axial_point` (distance from x = 0 along the
    /// axis) at the origin. Body y maps to lab x, body z to lab y.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn axis_along_z(axial_point: f64) -> Result<Self, RevolveError> {
        finite("axial point", axial_point)?;
        let columns = nalgebra::Matrix3::from_columns(&[Vector3::z(), Vector3::x(), Vector3::y()]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns));
        Ok(Self {
            isometry: Isometry3::from_parts(Translation3::new(0.0, 0.0, -axial_point), rotation),
        })
    }

    /// Rotates about the x axis of the lab (right-handed), after the previous motions. The angle is in radians: 90.0 is not a quarter turn,
    /// `90f64.to_radians()` is.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`], [`RevolveError::OutOfRange`] beyond two turns.
    pub fn rotated_x(self, angle: f64) -> Result<Self, RevolveError> {
        self.turned(Vector3::x(), angle)
    }

    /// Rotates about the y axis of the lab, as [`rotated_x`](Self::rotated_x).
    ///
    /// # Errors
    /// As [`rotated_x`](Self::rotated_x).
    pub fn rotated_y(self, angle: f64) -> Result<Self, RevolveError> {
        self.turned(Vector3::y(), angle)
    }

    /// Rotates about the z axis of the lab, as [`rotated_x`](Self::rotated_x).
    ///
    /// ```
    /// use revolve_voxel::{Pose, nalgebra::Point3};
    /// let quarter = Pose::identity().rotated_z(90f64.to_radians())?; // not 90.0
    /// assert!((quarter.to_lab(&Point3::new(1.0, 0.0, 0.0)) - Point3::new(0.0, 1.0, 0.0)).norm() < 1e-15);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// As [`rotated_x`](Self::rotated_x).
    pub fn rotated_z(self, angle: f64) -> Result<Self, RevolveError> {
        self.turned(Vector3::z(), angle)
    }

    fn turned(self, axis: Vector3<f64>, angle: f64) -> Result<Self, RevolveError> {
        within("angle (radians)", angle, [-MOST_ANGLE, MOST_ANGLE])?;
        Ok(Self {
            isometry: UnitQuaternion::from_scaled_axis(axis * angle) * self.isometry,
        })
    }

    /// Translates by a lab vector, after the previous motions.
    ///
    /// # Errors
    /// [`RevolveError::NotFinite`].
    pub fn shifted(self, by: Vector3<f64>) -> Result<Self, RevolveError> {
        for v in by.iter() {
            finite("shift", *v)?;
        }
        Ok(Self {
            isometry: Translation3::from(by) * self.isometry,
        })
    }

    /// Returns the rigid motion, body to lab.
    #[must_use]
    pub fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// Returns the direction of the axis of the body (base to apex) in the lab, a unit vector.
    #[must_use]
    pub fn axis(&self) -> Vector3<f64> {
        self.isometry.rotation * Vector3::x()
    }

    /// Maps a body point to the lab.
    #[must_use]
    pub fn to_lab(&self, body: &Point3<f64>) -> Point3<f64> {
        self.isometry * body
    }

    /// Maps a lab point to the body frame.
    #[must_use]
    pub fn to_body(&self, lab: &Point3<f64>) -> Point3<f64> {
        self.isometry.inverse_transform_point(lab)
    }

    /// Returns the largest coordinate in computations of body positions, for lab points with coordinates up to `lab`.
    pub(crate) fn farthest(&self, lab: f64) -> f64 {
        self.isometry.translation.vector.amax().max(lab)
    }

    /// Returns a bound on the rounding error of a lab point in the body frame.
    pub(crate) fn rounding(&self, lab: &Point3<f64>) -> f64 {
        ROUNDING * self.farthest(lab.coords.amax())
    }

    /// Maps a lab vector to the body frame.
    #[must_use]
    pub fn vector_to_body(&self, lab: &Vector3<f64>) -> Vector3<f64> {
        self.isometry.inverse_transform_vector(lab)
    }
}
