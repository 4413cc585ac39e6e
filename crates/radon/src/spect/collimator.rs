//! Depth-dependent resolution of a parallel-hole collimator.

use crate::RadonError;
use crate::error::{finite, positive, within};

/// 2 sqrt(2 ln 2): the full width at half maximum of a Gaussian in standard deviations.
fn fwhm_in_sigmas() -> f64 {
    (8.0 * std::f64::consts::LN_2).sqrt()
}

/// The Gaussian response of a parallel-hole collimator and crystal at the distance d from the collimator face:
///
/// ```text
/// sigma(d) = sqrt((slope d + at_face)^2 + intrinsic^2)
/// ```
///
/// Given by numbers ([`new`](Self::new)) or by the holes ([`parallel_holes`](Self::parallel_holes)); the default is perfect resolution.
/// Septal penetration and scatter are not included.
///
/// ```
/// use radon::{Collimator, ParallelHoles};
/// let camera = Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38)?;
/// let fwhm = |d: f64| camera.sigma(d) * (8.0 * 2.0_f64.ln()).sqrt();
/// assert!((fwhm(10.0) - 0.70).abs() < 0.01); // cm
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[doc(alias("collimator response", "PSF", "CDR"))]
pub struct Collimator {
    slope: f64,
    at_face: f64,
    intrinsic: f64,
}

impl Collimator {
    /// Returns a response with the standard deviation sqrt((`slope` d + `at_face`)^2 + `intrinsic`^2), lengths in cm.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::OutOfRange`] for a number below zero.
    pub fn new(slope: f64, at_face: f64, intrinsic: f64) -> Result<Self, RadonError> {
        for (what, given) in [
            ("slope of the collimator's response", slope),
            ("width of the response at the face", at_face),
            ("intrinsic width", intrinsic),
        ] {
            within(what, given, 0.0, f64::MAX)?;
        }
        Ok(Self {
            slope,
            at_face,
            intrinsic,
        })
    }

    /// The response of parallel holes in front of a crystal of full width at half maximum `intrinsic_fwhm` (cm):
    ///
    /// ```text
    /// sigma(d)^2 = (c D (L + d) / L)^2 + (intrinsic_fwhm / 2.3548)^2,   L = length - 2 / attenuation
    /// ```
    ///
    /// with D the diameter of a hole and c by its [`HoleResponse`]; without a gap between collimator and crystal.
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for a diameter, a length, an attenuation, or an effective length of zero or
    /// less, [`RadonError::OutOfRange`] for a hole wider than long or an intrinsic width below zero.
    pub fn parallel_holes(holes: &ParallelHoles, intrinsic_fwhm: f64) -> Result<Self, RadonError> {
        positive("hole diameter", holes.diameter)?;
        let length = holes.effective_length()?;
        within(
            "hole diameter (at most the length)",
            holes.diameter,
            0.0,
            holes.length,
        )?;
        within("intrinsic FWHM", intrinsic_fwhm, 0.0, f64::MAX)?;
        let at_face = holes.diameter * holes.response.sigma();
        Self::new(
            finite("slope of the collimator's response", at_face / length)?,
            at_face,
            intrinsic_fwhm / fwhm_in_sigmas(),
        )
    }

    /// Returns the standard deviation (cm) at this distance (cm) from the face; points behind the face have that of the face; NaN for NaN.
    #[must_use]
    pub fn sigma(&self, distance: f64) -> f64 {
        self.variance(distance).sqrt()
    }

    /// Square of [`sigma`](Self::sigma) (cm^2).
    #[must_use]
    pub fn variance(&self, distance: f64) -> f64 {
        (self.slope * distance.clamp(0.0, f64::INFINITY) + self.at_face).powi(2)
            + self.intrinsic.powi(2)
    }

    /// Returns the increase of the geometric standard deviation per cm.
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.slope
    }

    /// Returns the geometric standard deviation (cm) at the collimator face.
    #[must_use]
    pub fn at_face(&self) -> f64 {
        self.at_face
    }

    /// Returns the standard deviation (cm) of the crystal alone.
    #[must_use]
    pub fn intrinsic(&self) -> f64 {
        self.intrinsic
    }
}

/// The holes of a parallel-hole collimator.
///
/// The presets are low-energy collimators of lead with hexagonal holes, for 140 keV; their response is that of Anger's formula.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ParallelHoles {
    /// Diameter (cm); for hexagonal holes the distance between opposite sides.
    pub diameter: f64,
    /// Length (cm).
    pub length: f64,
    /// Linear attenuation coefficient of the septa (1/cm); infinite for opaque septa, `null` in JSON.
    #[cfg_attr(
        feature = "serde",
        serde(deserialize_with = "crate::stored::or_infinity")
    )]
    pub attenuation: f64,
    /// The width of the Gaussian for this diameter.
    #[cfg_attr(feature = "serde", serde(default))]
    pub response: HoleResponse,
}

/// The standard deviation of the Gaussian that represents the geometric response of holes, over D (L + d) / L.
///
/// The response to a point, averaged over the positions of the holes, is the autocorrelation of a hole's cross-section, magnified by (L + d) / L
/// (C. E. Metz, F. B. Atkins, R. N. Beck, Phys. Med. Biol. 25, 1059, 1980). Its variance along an axis is twice that of the cross-section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum HoleResponse {
    /// 0.4247: the full width at half maximum is D (L + d) / L, as Anger's formula has it (Sorenson & Phelps, Physics in Nuclear Medicine,
    /// 2nd ed. 1987, section 16.B).
    #[default]
    Anger,
    /// sqrt(5) / 6 = 0.3727: the variance of the response of hexagonal holes.
    Hexagonal,
    /// sqrt(2) / 4 = 0.3536: the variance of the response of round holes.
    Round,
}

impl HoleResponse {
    fn sigma(self) -> f64 {
        match self {
            Self::Anger => 1.0 / fwhm_in_sigmas(),
            Self::Hexagonal => 5.0_f64.sqrt() / 6.0,
            Self::Round => 2.0_f64.sqrt() / 4.0,
        }
    }
}

impl ParallelHoles {
    /// Lead at 140.5 keV (1/cm): 2.37 cm^2/g, by a power law between 5.549 at 100 keV and 2.015 at 150 keV (NIST XCOM, with coherent
    /// scattering), times 11.35 g/cm^3.
    pub const LEAD_140_KEV: f64 = 26.9;

    /// GE Discovery NM 670, low energy, high resolution: holes of 1.5 mm, 35 mm long, 0.2 mm apart (the camera's model in OpenGATE,
    /// `opengate/contrib/spect/ge_discovery_nm670.py`).
    pub const GE_LEHR: Self = Self::of_lead(0.15, 3.5);

    /// GE Millennium VG, low energy, general purpose: holes of 1.9 mm, 35 mm long, 0.2 mm apart (GV-LEGP of the collimators that come
    /// with SIMIND).
    pub const GE_LEGP: Self = Self::of_lead(0.19, 3.5);

    /// Siemens Symbia Intevo, low energy, high resolution: holes of 1.11 mm, 24.05 mm long, 0.16 mm apart (the camera's model in OpenGATE,
    /// `opengate/contrib/spect/siemens_intevo.py`).
    pub const SIEMENS_LEHR: Self = Self::of_lead(0.111, 2.405);

    /// GE Ventri, low energy, high resolution, a cardiac camera: holes of 1.4 mm, 30 mm long, 0.15 mm apart (GT-LEHR of the collimators
    /// that come with SIMIND).
    pub const GE_VENTRI_LEHR: Self = Self::of_lead(0.14, 3.0);

    const fn of_lead(diameter: f64, length: f64) -> Self {
        Self {
            diameter,
            length,
            attenuation: Self::LEAD_140_KEV,
            response: HoleResponse::Anger,
        }
    }

    /// Returns the length less two mean free paths in the septa, because photons penetrate their ends (cm).
    ///
    /// # Errors
    /// [`RadonError::NotFinite`], [`RadonError::NotPositive`] for the length, the attenuation or the result.
    pub fn effective_length(&self) -> Result<f64, RadonError> {
        positive("hole length", self.length)?;
        if self.attenuation == f64::INFINITY {
            return Ok(self.length);
        }
        let path = 2.0 / positive("attenuation of the septa", self.attenuation)?;
        positive("effective hole length", self.length - path)
    }
}
