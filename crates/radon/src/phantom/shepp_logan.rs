//! The modified Shepp-Logan head phantom, in the plane and in space.

use super::phantom2::Phantom2;
use super::phantom3::Phantom3;
use super::shape2::Shape2;
use super::shape3::Shape3;
use crate::error::{RadonError, positive};

/// Value, semi-axes along x, y, z, centre and angle about z in degrees, in units of half the field of view.
///
/// The plane entries (all but the third semi-axis and the height) are Toft's, "The Radon Transform: Theory and
/// Implementation", PhD thesis, Technical University of Denmark 1996, table B.3; c and z0 are those of M. Schabel's
/// phantom3d (MATLAB Central 9416, 2005).
const ELLIPSOIDS: [(f64, [f64; 3], [f64; 3], f64); 10] = [
    (1.0, [0.69, 0.92, 0.81], [0.0, 0.0, 0.0], 0.0),
    (-0.8, [0.6624, 0.874, 0.78], [0.0, -0.0184, 0.0], 0.0),
    (-0.2, [0.11, 0.31, 0.22], [0.22, 0.0, 0.0], -18.0),
    (-0.2, [0.16, 0.41, 0.28], [-0.22, 0.0, 0.0], 18.0),
    (0.1, [0.21, 0.25, 0.41], [0.0, 0.35, -0.15], 0.0),
    (0.1, [0.046, 0.046, 0.05], [0.0, 0.1, 0.25], 0.0),
    (0.1, [0.046, 0.046, 0.05], [0.0, -0.1, 0.25], 0.0),
    (0.1, [0.046, 0.023, 0.05], [-0.08, -0.605, 0.0], 0.0),
    (0.1, [0.023, 0.023, 0.02], [0.0, -0.606, 0.0], 0.0),
    (0.1, [0.023, 0.046, 0.02], [0.06, -0.605, 0.0], 0.0),
];

impl Phantom2 {
    /// The modified Shepp-Logan phantom (Toft 1996, table B.3) in the square [-half_width, half_width]²; values 0 to 1.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for `half_width`.
    pub fn shepp_logan(half_width: f64) -> Result<Self, RadonError> {
        positive("half_width", half_width)?;
        let ellipses = ELLIPSOIDS.map(|(value, [a, b, _], [x, y, _], degrees)| {
            let scaled = |v: [f64; 2]| v.map(|x| x * half_width);
            let ellipse = Shape2::ellipse(scaled([x, y]), scaled([a, b]), degrees.to_radians())?;
            Ok((value, ellipse))
        });
        Self::new(ellipses.into_iter().collect::<Result<Vec<_>, _>>()?)
    }
}

impl Phantom3 {
    /// The modified Shepp-Logan phantom in the cube [-half_width, half_width]³: Toft's ellipses with the third semi-axes
    /// and heights of M. Schabel's phantom3d.
    ///
    /// phantom3d's third Euler angle (10 degrees for the two ventricles) also rotates about z, because its second is zero; it is omitted,
    /// so that the ventricles lie as in the plane phantom. Three discs of phantom3d at other heights make the slice z = 0 differ from the
    /// plane phantom.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for `half_width`.
    pub fn shepp_logan(half_width: f64) -> Result<Self, RadonError> {
        positive("half_width", half_width)?;
        let ellipsoids = ELLIPSOIDS.map(|(value, semi_axes, centre, degrees)| {
            let scaled = |v: [f64; 3]| v.map(|x| x * half_width);
            let (sin, cos) = degrees.to_radians().sin_cos();
            let axes = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
            Ok((
                value,
                Shape3::ellipsoid(scaled(centre), scaled(semi_axes), axes)?,
            ))
        });
        Self::new(ellipsoids.into_iter().collect::<Result<Vec<_>, _>>()?)
    }
}
