//! The quantities that a load prescribes.

/// The quantity that a [`Load`](crate::Load) prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadKind {
    /// Force intensity: f per unit of material length, or the pressure p per unit of current length ([`PressureLaw`](crate::PressureLaw)).
    Intensity,
    /// Total force: intensity times the lateral surface of revolution (Eq. 4).
    TotalForce,
    /// Enclosed volume of revolution, cm^3.
    Volume,
    /// Force intensity as a function of volume and flow ([`Feedback`](crate::Feedback)).
    Feedback,
}
