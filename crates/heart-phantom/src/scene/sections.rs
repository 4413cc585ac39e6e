//! The sections of a scene: plain data with the defaults of the paper's study.

use super::file::exactly;
use super::material::MaterialSettings;
use crate::{Accuracy, Balloon, Compensation, Method, Mode, VolumeCurve, VolumeRange};
use membrane_forces::PressureLaw;
use radon::{ArcPolicy, ParallelHoles, Window};
use serde::{Deserialize, Serialize};

/// `[heart]`: endocardial and epicardial membrane, and the solution method of their shapes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeartSettings {
    /// Endocardium.
    #[serde(deserialize_with = "file::inner")]
    pub inner: Balloon,
    /// Epicardium; it contains the endocardium.
    #[serde(deserialize_with = "file::outer")]
    pub outer: Balloon,
    /// The material of both membranes.
    pub material: MaterialSettings,
    /// The pressure law of springs. The load of rubber is always a pressure.
    pub law: PressureLaw,
    /// The discretisation of the membranes.
    pub discretisation: DiscretisationSettings,
}

impl Default for HeartSettings {
    fn default() -> Self {
        Self {
            inner: Balloon::INNER,
            outer: Balloon::OUTER,
            material: MaterialSettings::Springs,
            law: PressureLaw::PerMaterialLength,
            discretisation: DiscretisationSettings::Differences { nodes: 801 },
        }
    }
}

/// Discretisation of the membranes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum DiscretisationSettings {
    /// Second-order finite differences, as in the paper; the body is the polygon through the nodes.
    Differences {
        /// Number of nodes per membrane.
        nodes: usize,
    },
    /// Spectral elements; the body approximates their polynomials to `tolerance`.
    Spectral {
        /// Polynomial degree of an element.
        degree: usize,
        /// Elements on each smooth piece of a membrane.
        per_piece: usize,
        /// Largest distance between body surface and membrane, cm.
        tolerance: f64,
    },
}

/// `[cycle]`: the cardiac cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CycleSettings {
    /// Heart rate.
    pub beats_per_minute: f64,
    /// Shape of the volume curve over a cycle.
    pub curve: VolumeCurve,
    /// Range of the volume curve. Gains refer to the exact reference volume of the inner membrane, mL to the discretised one.
    pub volume: VolumeRange,
    /// Atrioventricular-plane displacement from end-diastole to end-systole, cm; the outer apex is fixed.
    pub av_plane_displacement: f64,
}

impl Default for CycleSettings {
    fn default() -> Self {
        Self {
            beats_per_minute: 65.0,
            curve: VolumeCurve::Sinusoid,
            volume: VolumeRange::Gain(0.6),
            av_plane_displacement: 0.0,
        }
    }
}

/// `[pose]`: the axis along z, rotated about the lab's x, then y, then z, then shifted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PoseSettings {
    /// Distance of the centre of rotation from the base along the axis, cm; `None` for the middle of the outer membrane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre: Option<f64>,
    /// Rotation about x in degrees.
    pub rotate_x: f64,
    /// Rotation about y in degrees.
    pub rotate_y: f64,
    /// Rotation about z in degrees.
    pub rotate_z: f64,
    /// Final position of the centre of rotation, `[x, y, z]` in cm.
    #[serde(deserialize_with = "exactly")]
    pub shift: [f64; 3],
}

impl Default for PoseSettings {
    fn default() -> Self {
        Self {
            centre: None,
            rotate_x: 45.0,
            rotate_y: 45.0,
            rotate_z: 0.0,
            shift: [0.0; 3],
        }
    }
}

/// One of `[[organs]]`: replaces earlier organs where they overlap; the heart replaces all organs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrganSettings {
    /// The region that it fills.
    pub shape: OrganShapeSettings,
    /// Activity per mL.
    pub activity: f64,
    /// Linear attenuation coefficient, 1/cm.
    pub attenuation: f64,
}

/// The region of an organ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum OrganShapeSettings {
    /// An infinite elliptic cylinder along z.
    Cylinder {
        /// Its axis, `[x, y]` in cm.
        #[serde(deserialize_with = "exactly")]
        centre: [f64; 2],
        /// Semi-axes along x and y, cm.
        #[serde(deserialize_with = "exactly")]
        semi_axes: [f64; 2],
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Centre, `[x, y, z]` in cm.
        #[serde(deserialize_with = "exactly")]
        centre: [f64; 3],
        /// Semi-axes along x, y and z, cm.
        #[serde(deserialize_with = "exactly")]
        semi_axes: [f64; 3],
    },
}

/// `[blur]`: a detector with a finite resolution that does not depend on depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlurSettings {
    /// Full width at half maximum of the Gaussian, cm.
    pub fwhm: f64,
}

/// `[collimator]`: parallel holes and a crystal at `camera.radius`; the resolution degrades with distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollimatorSettings {
    /// The holes.
    pub holes: HolesSettings,
    /// Full width at half maximum of the intrinsic resolution of the crystal, cm.
    pub intrinsic_fwhm: f64,
}

/// The holes of a collimator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum HolesSettings {
    /// [`ParallelHoles::GE_LEHR`].
    GeLehr,
    /// [`ParallelHoles::GE_LEGP`].
    GeLegp,
    /// [`ParallelHoles::GE_VENTRI_LEHR`].
    GeVentriLehr,
    /// [`ParallelHoles::SIEMENS_LEHR`].
    SiemensLehr,
    /// Holes of given dimensions; the width of the response is by default that of Anger's formula.
    Parallel(ParallelHoles),
    /// A geometric response with the standard deviation `slope d + at_face` at the distance d.
    Widths {
        /// Increase of the standard deviation per cm of distance.
        slope: f64,
        /// Standard deviation at the collimator face, cm.
        at_face: f64,
    },
}

/// `[scatter]`: photons that are scattered in the attenuating media of the scene, which are treated as water-equivalent.
///
/// Scatter is interpolated between nodes 0.75 cm or a thirtieth of a row of bins apart, whichever is smaller, and between views up to 12 degrees
/// apart. `tolerance` does not limit the error of this interpolation: [`ViewError::scatter`](crate::ViewError::scatter) contains its upper bound,
/// which can be many times the tolerance and far above the true error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScatterSettings {
    /// Largest standard error of any sample in any window, relative to the largest unscattered or scattered sample of the gate.
    pub tolerance: f64,
    /// Energy of the photons emitted, keV.
    pub energy: f64,
    /// Full width at half maximum of the energy resolution, as a fraction of that energy.
    pub resolution: f64,
    /// Energy windows, from and to in keV. The first is the photopeak window, to which the sensitivity of the camera refers.
    pub windows: Vec<[f64; 2]>,
    /// Seed of the photon histories.
    pub seed: u64,
}

impl Default for ScatterSettings {
    /// Technetium-99m, a window of 20 %, a resolution of 10 %.
    fn default() -> Self {
        Self {
            tolerance: 0.01,
            energy: 140.5,
            resolution: 0.1,
            windows: vec![[126.45, 154.55]],
            seed: 0,
        }
    }
}

/// `[acquisition]`: the timing of the projections.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AcquisitionSettings {
    /// The time interval of a projection.
    pub mode: Mode,
    /// The accuracy of the samples without `[scatter]`, which has its own tolerance.
    pub accuracy: Accuracy,
}

impl Default for AcquisitionSettings {
    fn default() -> Self {
        Self {
            mode: Mode::WholeCycle,
            accuracy: Accuracy::Steps(32),
        }
    }
}

/// `[reconstruction]`: volumes from projections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReconstructionSettings {
    /// The algorithm; `window`, `cutoff` and `arc` belong to filtered back-projection.
    pub method: Method,
    /// Compensation of the cardiac motion between gates.
    pub compensation: Compensation,
    /// Window of the ramp filter.
    pub window: Window,
    /// Cutoff as a fraction of the Nyquist frequency of the bins.
    pub cutoff: f64,
    /// Pixels per side of a slice; `None` for the number of bins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixels: Option<usize>,
    /// Pixel size in cm; `None` for the pitch of the bins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel: Option<f64>,
    /// Full width at half maximum of a three-dimensional Gaussian filter of the volumes, in cm; `None` for none. Voxels outside the volume are
    /// zero; not with a region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter_fwhm: Option<f64>,
    /// The reconstructed part of each slice, which determines the size of the volumes. `None` for all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<PixelRange>,
    /// Treatment of missing directions.
    pub arc: ArcPolicy,
}

impl Default for ReconstructionSettings {
    fn default() -> Self {
        Self {
            method: Method::Fbp,
            compensation: Compensation::None,
            window: Window::RamLak,
            cutoff: 1.0,
            pixels: None,
            pixel: None,
            filter_fwhm: None,
            region: None,
            arc: ArcPolicy::Complete,
        }
    }
}

/// A range of pixels, `[from, to)` along x and along y.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelRange {
    /// First column and one past the last.
    #[serde(deserialize_with = "exactly")]
    pub x: [usize; 2],
    /// First row and one past the last.
    #[serde(deserialize_with = "exactly")]
    pub y: [usize; 2],
}

/// `[truth]`: the voxelised ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TruthSettings {
    /// Largest error of the volume fraction of a voxel, averaged over the time of the gate.
    pub tolerance: f64,
}

impl Default for TruthSettings {
    fn default() -> Self {
        Self { tolerance: 1e-3 }
    }
}

mod file {
    use crate::Balloon;
    use serde::{Deserialize, Deserializer};

    /// A membrane in a file. Absent fields take the values of the study, which differ between the two membranes.
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct PartOfBalloon {
        length: Option<f64>,
        radius: Option<f64>,
        stiffness: Option<f64>,
    }

    impl PartOfBalloon {
        fn or(self, balloon: Balloon) -> Balloon {
            Balloon {
                length: self.length.unwrap_or(balloon.length),
                radius: self.radius.unwrap_or(balloon.radius),
                stiffness: self.stiffness.unwrap_or(balloon.stiffness),
            }
        }
    }

    pub(super) fn inner<'de, D: Deserializer<'de>>(from: D) -> Result<Balloon, D::Error> {
        PartOfBalloon::deserialize(from).map(|given| given.or(Balloon::INNER))
    }

    pub(super) fn outer<'de, D: Deserializer<'de>>(from: D) -> Result<Balloon, D::Error> {
        PartOfBalloon::deserialize(from).map(|given| given.or(Balloon::OUTER))
    }
}
