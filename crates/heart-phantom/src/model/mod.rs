//! The model of the heart: membranes, wall, volume over the cycle, activity, and surroundings.

mod activity;
mod around;
mod attenuation;
mod base;
mod breathing;
mod chest;
mod cycle;
mod defect;
mod heart;
mod material;
mod rhythm;
mod shape;
mod shape_cache;
mod strain;
mod surroundings;
mod twist;
mod velocity;
mod volume_curve;

pub use activity::{Activity, Background, Uptake};
pub(crate) use around::Reach;
pub use attenuation::{Attenuation, Medium};
pub use breathing::{Breathing, BreathingCurve, RespiratoryGates, RespiratoryMotion};
pub use chest::Chest;
pub use cycle::Cycle;
pub use defect::Defect;
pub(crate) use defect::{Placed, without_overlap};
pub use heart::{Balloon, Heart};
pub use material::{MaterialPoint, Wall, WallRegion};
pub(crate) use rhythm::Rhythm;
pub use rhythm::{Beats, GatedBy, RrIntervals};
pub use shape::{HeartShape, MMHG_PER_KPA};
pub use strain::{Deformation, GreenStrain};
pub(crate) use surroundings::Surroundings;
pub use twist::Twist;
pub(crate) use volume_curve::Height;
pub use volume_curve::{VolumeCurve, VolumeRange};
