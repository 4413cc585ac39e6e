//! What beats: two balloons with a wall between them, its volume over a beat, what it holds and what is around it.

mod activity;
mod attenuation;
mod chest;
mod cycle;
mod defect;
mod heart;
mod kept;
mod material;
mod shape;
mod strain;
mod twist;
mod volume_curve;

pub use activity::{Activity, Background, Uptake};
pub use attenuation::Attenuation;
pub use chest::Chest;
pub use cycle::Cycle;
pub use defect::Defect;
pub(crate) use defect::{Placed, without_overlap};
pub use heart::{Balloon, Heart};
pub use material::{MaterialPoint, Stretch, Wall, WallRegion};
pub use shape::HeartShape;
pub use strain::{Deformation, GreenStrain};
pub use twist::Twist;
pub(crate) use volume_curve::Height;
pub use volume_curve::{VolumeCurve, VolumeRange};
