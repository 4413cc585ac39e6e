//! A chest of published sizes around the heart.

use crate::error::{PhantomError, check};
use crate::ranges;
use revolve_voxel::{Organ, OrganShape, Organs};

/// Activities of the trunk, both lungs, the liver and the spine of an adult, per mL. The defaults have no published source.
///
/// ```text
///         shape, centre and half-widths along x, y and z in cm              density   attenuation, 1/cm
/// trunk   cylinder   ( 0, 0)          20, 10                                1.04      0.1585
/// lungs   ellipsoids (-+8.5, 0, 4.5)  5, 7.5, 12                            0.296     0.0451
/// liver   ellipsoid  (-8, -1.5, -14)  9, 7, 6.56                            1.04      0.1585
/// spine   cylinder   ( 0, 5.5)        2, 2.5                                1.4       0.2137
/// ```
///
/// +x is the patient's left, +y the back, +z the head; z = 0 is 51 cm above the lower end of the trunk, at the height of the heart.
/// Trunk, spine and the cross-section and height of the lungs are those of the adult phantom of Oak Ridge (Cristy & Eckerman 1987,
/// ORNL/TM-8381, as in the example `human_phantom` of Geant4), where the lungs are the upper halves of ellipsoids of twice that
/// height. The liver, a cylinder cut by a plane there, is an ellipsoid in its place with the mass of the reference man, 1800 g
/// (ICRP Publication 89). Compositions and densities are those of the example; attenuation at 140.5 keV follows Elam, Ravel &
/// Sieber (2002, doi:10.1016/S0969-806X(01)00227-4), with coherent scattering.
///
/// ```
/// use heart_phantom::Chest;
/// let organs = Chest::default().organs()?;
/// assert_eq!(organs.as_slice().len(), 5); // of two lungs
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Chest {
    /// Activity of the trunk without the organs in it.
    pub trunk: f64,
    /// Activity of both lungs.
    pub lungs: f64,
    /// Activity of the liver.
    pub liver: f64,
    /// Activity of the spine.
    pub spine: f64,
}

impl Default for Chest {
    fn default() -> Self {
        Self {
            trunk: 0.1,
            lungs: 0.03,
            liver: 0.3,
            spine: 0.05,
        }
    }
}

impl Chest {
    /// Attenuation of soft tissue and of the heart at 140.5 keV (1/cm).
    pub const SOFT_TISSUE: f64 = 0.1585;
    const LUNG: f64 = 0.0451;
    const SKELETON: f64 = 0.2137;

    /// Returns the organs; later ones replace earlier ones.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for an activity that is not between 0 and 1e12.
    pub fn organs(&self) -> Result<Organs, PhantomError> {
        let cylinder = |centre, half| Ok::<_, PhantomError>(OrganShape::cylinder(centre, half)?);
        let ellipsoid = |centre, half| Ok::<_, PhantomError>(OrganShape::ellipsoid(centre, half)?);
        let lung = |x: f64| ellipsoid([x, 0.0, 4.5], [5.0, 7.5, 12.0]);
        let shapes = [
            (
                cylinder([0.0, 0.0], [20.0, 10.0])?,
                self.trunk,
                Self::SOFT_TISSUE,
            ),
            (lung(8.5)?, self.lungs, Self::LUNG),
            (lung(-8.5)?, self.lungs, Self::LUNG),
            (
                ellipsoid([-8.0, -1.5, -14.0], [9.0, 7.0, 6.56])?,
                self.liver,
                Self::SOFT_TISSUE,
            ),
            (
                cylinder([0.0, 5.5], [2.0, 2.5])?,
                self.spine,
                Self::SKELETON,
            ),
        ];
        for (_, activity, _) in &shapes {
            check("activity of the chest", *activity, ranges::ACTIVITY)?;
        }
        let organ = |(shape, activity, attenuation)| Organ {
            shape,
            activity,
            attenuation,
        };
        Ok(Organs::new(shapes.into_iter().map(organ).collect())?)
    }
}
