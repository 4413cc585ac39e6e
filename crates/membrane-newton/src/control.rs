//! What a static solve prescribes, and the one equation it adds to the equilibrium.

/// The quantity that is given; the force intensity that belongs to it is found with the shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// The load of the membrane's law: f, F or p.
    Load(f64),
    /// Force intensity, f or p, under any law (under the total-force law: F / S).
    Intensity(f64),
    /// Total force, intensity times the lateral surface of revolution, under any law.
    TotalForce(f64),
    /// Enclosed volume of revolution, cm^3.
    Volume(f64),
    /// Volume over that of the start (rest shape with its ends held), minus one: 0.6 is 60 % more.
    VolumeGain(f64),
    /// Signed area of the 2-D curve, cm^2.
    Area(f64),
}
