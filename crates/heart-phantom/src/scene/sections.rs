//! The sections of a scene: plain data, defaults of the paper's study.

use super::material::MaterialSettings;
use crate::scan::{Accuracy, BinSample, Mode, Orbit};
use crate::{Balloon, Compensation, Method, Rotation, VolumeCurve, VolumeRange};
use membrane_forces::PressureLaw;
use radon::{ArcPolicy, Window};
#[cfg(feature = "scene")]
use {
    super::file::exactly,
    serde::{Deserialize, Serialize},
};

/// `[heart]`: the two balloons and how their shapes are found.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct HeartSettings {
    /// Endocardium.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "file::inner"))]
    pub inner: Balloon,
    /// Epicardium; it holds the inner balloon.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "file::outer"))]
    pub outer: Balloon,
    /// What the balloons are made of.
    pub material: MaterialSettings,
    /// How the pressure acts on springs; on rubber it is a pressure.
    pub law: PressureLaw,
    /// How the membranes are discretised.
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
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "snake_case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum DiscretisationSettings {
    /// The paper's second-order finite differences; the body is the polygon through the nodes.
    Differences {
        /// Nodes of a membrane.
        nodes: usize,
    },
    /// Spectral elements; the body follows their polynomials to `tolerance`.
    Spectral {
        /// Polynomial degree of an element.
        degree: usize,
        /// Elements on each smooth piece of the balloon.
        per_piece: usize,
        /// Largest distance in cm of the body's surface from the membrane.
        tolerance: f64,
    },
}

/// `[cycle]`: the beat.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct CycleSettings {
    /// Heart rate.
    pub beats_per_minute: f64,
    /// Form of the cavity's volume over a beat.
    pub curve: VolumeCurve,
    /// Its size. Volumes are taken against the closed form of the inner balloon's rest volume.
    pub volume: VolumeRange,
    /// How far the plane of the base goes down from end-diastole to end-systole, cm, while the outer apex rests.
    pub base_descent: f64,
}

impl Default for CycleSettings {
    fn default() -> Self {
        Self {
            beats_per_minute: 65.0,
            curve: VolumeCurve::Sinusoid,
            volume: VolumeRange::Gain(0.6),
            base_descent: 0.0,
        }
    }
}

/// `[pose]`: the axis along z, turned about the lab's x, then y, then z, then shifted.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct PoseSettings {
    /// Distance from the base of the axis point that the heart turns about, cm; `None` for the middle of the outer balloon.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub centre: Option<f64>,
    /// Degrees about x.
    pub turn_x: f64,
    /// Degrees about y.
    pub turn_y: f64,
    /// Degrees about z.
    pub turn_z: f64,
    /// Where that axis point ends up, `[x, y, z]` in cm.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub shift: [f64; 3],
}

impl Default for PoseSettings {
    fn default() -> Self {
        Self {
            centre: None,
            turn_x: 45.0,
            turn_y: 45.0,
            turn_z: 0.0,
            shift: [0.0; 3],
        }
    }
}

/// One of `[[organs]]`: it replaces those before it, and the heart replaces them all.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct OrganSettings {
    /// What it fills.
    pub shape: OrganShapeSettings,
    /// Activity per mL.
    pub activity: f64,
    /// Attenuation in 1/cm.
    pub attenuation: f64,
}

/// What an organ fills.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum OrganShapeSettings {
    /// An elliptic cylinder along z, without ends.
    Cylinder {
        /// Its axis, `[x, y]` in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        centre: [f64; 2],
        /// Half-widths along x and y in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        semi_axes: [f64; 2],
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Its middle, `[x, y, z]` in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        centre: [f64; 3],
        /// Half-widths along x, y and z in cm.
        #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
        semi_axes: [f64; 3],
    },
}

/// `[blur]`: a detector of finite resolution, the same at all depths.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct BlurSettings {
    /// Full width at half maximum of the Gaussian in cm.
    pub fwhm: f64,
}

/// `[collimator]`: parallel holes and a crystal, where `camera.radius` has them; things are seen the wider the farther away they are.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct CollimatorSettings {
    /// The holes.
    pub holes: HolesSettings,
    /// Full width at half maximum of the crystal alone, cm.
    pub intrinsic_fwhm: f64,
}

/// The holes of a collimator.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum HolesSettings {
    /// [`ParallelHoles::GE_LEHR`](radon::ParallelHoles::GE_LEHR).
    GeLehr,
    /// [`ParallelHoles::GE_LEGP`](radon::ParallelHoles::GE_LEGP).
    GeLegp,
    /// [`ParallelHoles::SIEMENS_LEHR`](radon::ParallelHoles::SIEMENS_LEHR).
    SiemensLehr,
    /// Holes of any size.
    Parallel {
        /// Diameter in cm.
        diameter: f64,
        /// Length in cm.
        length: f64,
        /// Attenuation of the septa in 1/cm.
        attenuation: f64,
    },
    /// A geometric response of standard deviation `slope d + at_face`.
    Widths {
        /// Growth for each cm of distance.
        slope: f64,
        /// At the collimator's face, cm.
        at_face: f64,
    },
}

/// The heads of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(
    feature = "scene",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
pub enum HeadsSettings {
    /// One.
    One,
    /// Two, fixed to each other, which take their views at the same times.
    Two {
        /// Degrees from the first to the second.
        angle: f64,
    },
}

/// `[camera]`: views and detector.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct CameraSettings {
    /// Number of views of a head.
    pub views: usize,
    /// Degrees that they cover, counter-clockwise seen from +z if positive.
    pub arc: f64,
    /// Angle of the first view in degrees.
    pub start: f64,
    /// How many heads take views at a time.
    pub heads: HeadsSettings,
    /// Bins of a row.
    pub bins: usize,
    /// Rows, one for each slice.
    pub rows: usize,
    /// Pitch of bins and of rows in cm.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub pitch: [f64; 2],
    /// The definition of a sample; `None` for averages over bins with `[blur]` or `[collimator]`, and for line integrals without.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub samples: Option<BinSample>,
    /// How it goes from view to view.
    pub rotation: Rotation,
    /// Seconds from the start of a view to the start of the next; a camera that stops takes no time to move.
    pub seconds_per_view: f64,
    /// Distance of the collimator's face from the axis in each view, for `[collimator]`; file formats tell it, too.
    pub radius: Orbit,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            views: 90,
            arc: 180.0,
            start: 0.0,
            heads: HeadsSettings::One,
            bins: 256,
            rows: 256,
            pitch: [0.0625; 2],
            samples: None,
            rotation: Rotation::StepAndShoot,
            seconds_per_view: 1.0,
            radius: Orbit::Circle(20.0),
        }
    }
}

/// `[acquisition]`: when the views are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct AcquisitionSettings {
    /// Over which time.
    pub mode: Mode,
    /// The accuracy of the samples.
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

/// `[reconstruction]`: volumes from views.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct ReconstructionSettings {
    /// How: `window`, `cutoff` and `arc` are those of filtered back-projection.
    pub method: Method,
    /// Whether the heart's motion from one set of views to the next is taken back for it.
    pub compensation: Compensation,
    /// Window of the ramp filter.
    pub window: Window,
    /// Cutoff as a share of the Nyquist frequency of the bins.
    pub cutoff: f64,
    /// Pixels along an edge of a slice; `None` for as many as bins.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub pixels: Option<usize>,
    /// Their edge in cm; `None` for the pitch of the bins.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub pixel: Option<f64>,
    /// The part of each slice to reconstruct; the volumes hold nothing else. `None` for all of it.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub region: Option<PixelRange>,
    /// What to do when the arc leaves directions unmeasured.
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
            region: None,
            arc: ArcPolicy::Complete,
        }
    }
}

/// Pixels `[from, to)` along x and along y.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct PixelRange {
    /// First column and the one after the last.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub x: [usize; 2],
    /// First row and the one after the last.
    #[cfg_attr(feature = "scene", serde(deserialize_with = "exactly"))]
    pub y: [usize; 2],
}

/// `[truth]`: the exact volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct TruthSettings {
    /// Largest error of a voxel's covered fraction.
    pub tolerance: f64,
}

impl Default for TruthSettings {
    fn default() -> Self {
        Self { tolerance: 1e-3 }
    }
}

#[cfg(feature = "scene")]
mod file {
    use crate::Balloon;
    use serde::{Deserialize, Deserializer};

    /// A balloon in a file: what is left out is that of the study, which differs between the two.
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
