//! The moving membrane: nodes, mass, damping, and the forces on it.

use membrane_newton::membrane_forces::FiniteDifferences;
use membrane_newton::{BandMatrix, DiscreteMembrane, Measure, Membrane};

use crate::error::{ImplicitError, positive, within};

/// Positions (cm) and velocities (cm/s) beyond which volume and energy, their cubes and squares times any stiffness, are
/// no numbers.
pub(crate) const FARTHEST: f64 = 1e100;

/// A membrane with mass and damping, discretised by the paper's finite differences.
///
/// ```text
/// m c'' = F_e(c) + f n(c) - mu c'         per unit of s, both ends held
/// ```
///
/// ```
/// use membrane_implicit::{Membrane, MovingMembrane, RestShape};
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
/// let body = MovingMembrane::new(&membrane, 201)?.with_damping(0.5)?;
/// assert!((body.largest_explicit_step() - 0.005).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MovingMembrane {
    pub(crate) differences: FiniteDifferences,
    pub(crate) mass: f64,
    pub(crate) damping: f64,
    /// K = dF_e/dc, the same for every state.
    pub(crate) springs: BandMatrix,
    /// The size of the membrane, cm: what tolerances on positions are relative to.
    pub(crate) length: f64,
    largest_frequency: f64,
}

impl MovingMembrane {
    /// Discretises `membrane` with `n_nodes` nodes; mass 1 and damping 0.
    ///
    /// # Errors
    /// Fewer than three nodes, a stiffness that is not positive, coinciding nodes, or some beyond 1e100 cm.
    pub fn new(membrane: &Membrane, n_nodes: usize) -> Result<Self, ImplicitError> {
        let refused = |error| ImplicitError::Membrane { time: 0.0, error };
        let differences = FiniteDifferences::new(membrane, n_nodes).map_err(refused)?;
        for value in differences.start() {
            within("rest position", *value, -FARTHEST, FARTHEST)?;
        }
        let mut springs = differences.band();
        differences
            .add_elastic_tangent_into(1.0, &mut springs)
            .map_err(refused)?;
        Ok(Self {
            length: Measure::Length.of(differences.start().as_chunks().0),
            largest_frequency: largest_eigenvalue(&springs).sqrt(),
            springs,
            differences,
            mass: 1.0,
            damping: 0.0,
        })
    }

    /// The same with mass `mass` per unit s.
    ///
    /// # Errors
    /// Not positive, or not finite.
    pub fn with_mass(mut self, mass: f64) -> Result<Self, ImplicitError> {
        self.mass = positive("mass", mass)?;
        Ok(self)
    }

    /// The same with damping `mu` per unit s (Eq. 8).
    ///
    /// # Errors
    /// Negative, or not finite.
    pub fn with_damping(mut self, mu: f64) -> Result<Self, ImplicitError> {
        self.damping = within("damping", mu, 0.0, f64::MAX)?;
        Ok(self)
    }

    /// Number of nodes, held ends included.
    pub fn n_nodes(&self) -> usize {
        self.differences.n_nodes()
    }

    /// Mass per unit s.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Damping mu per unit s.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// The discretised forces.
    pub fn differences(&self) -> &FiniteDifferences {
        &self.differences
    }

    /// The largest time step at which an explicit scheme can follow the elastic waves at all,
    /// 2 sqrt(m) / omega (leapfrog's bound; omega^2 the largest eigenvalue of -dF_e/dc).
    ///
    /// With constant stiffness and no second neighbours it is ds sqrt(m / lambda) to within
    /// a part in N^2.
    pub fn largest_explicit_step(&self) -> f64 {
        2.0 * self.mass.sqrt() / self.largest_frequency
    }

    /// The largest time step at which forward Euler amplifies no mode of the unloaded membrane;
    /// 0 without damping.
    ///
    /// Forward Euler multiplies a mode of m c'' + mu c' + k c = 0 by 1 + dt z each step, with
    /// m z^2 + mu z + k = 0. An oscillating mode needs dt <= mu / k, so the stiffest one decides;
    /// an overdamped one decays no faster than mu / m and is safe up to dt = 2 m / mu.
    pub fn forward_euler_step(&self) -> f64 {
        let k = self.largest_frequency * self.largest_frequency;
        (self.damping / k).min(2.0 * self.mass / self.damping)
    }

    /// m + h mu, what a velocity at the end of h is multiplied by in the balance of momentum.
    pub(crate) fn inertia(&self, h: f64) -> f64 {
        self.mass + h * self.damping
    }

    /// Volume enclosed at the start, cm^3.
    pub(crate) fn start_volume(&self) -> f64 {
        Measure::Volume.of(self.differences.start().as_chunks().0)
    }

    /// `out` = pressure force; `time` is when an error says that it happened.
    pub(crate) fn pressure_into(
        &self,
        time: f64,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), ImplicitError> {
        let d = &self.differences;
        d.pressure_force_into(nodes, intensity, out)
            .map_err(|error| ImplicitError::Membrane { time, error })
    }
}

/// Zeroes the four coordinates of the two held nodes.
pub(crate) fn hold_ends(values: &mut [f64]) {
    let n = values.len();
    values[..2].fill(0.0);
    values[n - 2..].fill(0.0);
}

/// Upper bound of the spectrum of `springs` in size by Gershgorin's circles; for springs in a row it is
/// sharp to O(1/N^2), since the highest mode alternates from node to node.
fn largest_eigenvalue(springs: &BandMatrix) -> f64 {
    springs
        .rows()
        .skip(2)
        .take(springs.len() - 4)
        .map(|row| row.iter().map(|v| v.abs()).sum())
        .fold(0.0, f64::max)
}
