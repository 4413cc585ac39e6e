//! The moving membrane: nodes, mass, damping, and the forces on it.

use membrane_newton::membrane_forces::{FiniteDifferences, Material, Tangent, collapse};
use membrane_newton::{BandMatrix, DiscreteMembrane, Measure, Membrane, MembraneError};

use crate::error::{ImplicitError, Result, positive};

/// Limits of positions (cm) and velocities (cm/s): beyond, volume and energy (cubes and squares times a stiffness) overflow.
pub(crate) const FARTHEST: f64 = 1e100;

/// The state of the (inner) membrane that a load depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadState {
    /// Time, s.
    pub time: f64,
    /// Enclosed volume V, cm^3.
    pub volume: f64,
    /// dV/dt, cm^3/s: the flow into the membrane, negative while it empties.
    pub volume_rate: f64,
}

/// A membrane with mass and damping, discretised by finite differences.
///
/// ```text
/// m c'' = F_e(c) + f n(c) - mu c'                        springs, per unit of s
/// m c'' = -dE/dc + p dV/dc - eta m c',  m = rho v        rubber, at the nodes
/// ```
///
/// The ends are fixed. The mass of a node of rubber is the density rho times half of the volume v of its elements. Moduli in kPa and
/// lengths in cm imply a density in kPa s^2/cm^2 and energies in kPa cm^3 = mJ. 1 g/cm^3 is [`Body::G_PER_CM3`] = 1e-4 kPa s^2/cm^2.
///
/// ```
/// use membrane_implicit::{Body, Membrane, ReferenceShape};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
/// let body = Body::springs(&membrane, 201)?.with_damping(0.5)?;
/// assert!((body.largest_explicit_step() - 0.005).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Body {
    pub(crate) discrete: FiniteDifferences,
    /// Mass per unit s; for rubber the density.
    pub(crate) mass: f64,
    /// Damping per unit s; for rubber per mass.
    damping: f64,
    /// Volume of rubber of each unknown, zero for fixed ones; 1 for springs.
    pub(crate) volumes: Vec<f64>,
    /// Factor of a sum over nodes: ds for springs, whose forces are per unit s, 1 for rubber.
    pub(crate) weight: f64,
    /// dF_e/dc at the start; for springs the same in every state.
    pub(crate) stiffness: BandMatrix,
    /// Length of the curve, cm: the scale of tolerances on positions.
    pub(crate) length: f64,
    largest_frequency: f64,
}

impl Body {
    /// 1 g/cm^3 in kPa s^2/cm^2, the unit of density for moduli in kPa: multiply densities in g/cm^3 by it.
    pub const G_PER_CM3: f64 = 1e-4;

    /// Discretises a `membrane` of springs with `n_nodes` nodes; mass 1 per unit s, no damping.
    ///
    /// # Errors
    /// Fewer than three nodes, a stiffness that is not positive, coinciding nodes, positions beyond 1e100 cm; a membrane of rubber.
    pub fn springs(membrane: &Membrane, n_nodes: usize) -> Result<Self> {
        let discrete = FiniteDifferences::new(membrane, n_nodes)?;
        match membrane.material() {
            Material::Springs { .. } => {
                let volumes = vec![1.0; discrete.start().len()];
                let weight = discrete.ds();
                Self::of(discrete, 1.0, volumes, weight)
            }
            Material::Rubber(_) => {
                let (what, needs) = ("mass per unit s (Body::springs, evolve)", "springs");
                Err(MembraneError::OtherMaterial { what, needs }.into())
            }
        }
    }

    /// Discretises a `membrane` of rubber of this density with `n_nodes` nodes, of which those up to the axis move; no damping.
    ///
    /// The density is in kPa s^2/cm^2 for moduli in kPa: 1.06e-4 for tissue of 1.06 g/cm^3 (1.06 times [`Body::G_PER_CM3`]). A density of 1.06
    /// would be ten thousand times as heavy and is not an error.
    ///
    /// Undamped rubber under a sudden load does not converge at steps that leave its fast modes unresolved: raise the load over some periods
    /// or use [`Body::with_damping`], and repeat the run with half the step ([`TimeStep::Fixed`](crate::TimeStep::Fixed)).
    ///
    /// # Errors
    /// As [`Body::springs`]; a density that is not positive; a membrane of springs.
    pub fn rubber(membrane: &Membrane, n_nodes: usize, density: f64) -> Result<Self> {
        positive("density", density)?;
        let discrete = FiniteDifferences::half(membrane, n_nodes)?;
        let mut mass = discrete.tangent();
        discrete.add_mass_into(1.0, &mut mass)?;
        let diagonal = (0..mass.band.len()).map(|i| mass.band.get(i, i).unwrap_or(0.0));
        Self::of(discrete, density, diagonal.collect(), 1.0)
    }

    fn of(discrete: FiniteDifferences, mass: f64, volumes: Vec<f64>, weight: f64) -> Result<Self> {
        let start = discrete.start();
        for value in start {
            MembraneError::within("reference position", *value, -FARTHEST, FARTHEST)?;
        }
        let mut tangent = discrete.tangent();
        discrete.tangent_into(start, 0.0, &mut tangent)?;
        let stiffness = tangent.band;
        // Upper bound of the spectrum by Gershgorin's circles; for springs in a row it is accurate to O(1/N^2), because the highest mode
        // alternates from node to node.
        let rows = stiffness.rows().zip(&volumes).enumerate();
        let moving = rows.filter(|(i, _)| !discrete.fixed().contains(i));
        let largest = moving
            .map(|(_, (row, volume))| row.iter().map(|v| v.abs()).sum::<f64>() / volume)
            .fold(0.0, f64::max);
        Ok(Self {
            length: discrete.measure(Measure::Length, start)?,
            largest_frequency: largest.sqrt(),
            discrete,
            mass,
            damping: 0.0,
            volumes,
            weight,
            stiffness,
        })
    }

    /// Sets the mass per unit s, or the density of rubber.
    ///
    /// # Errors
    /// Not positive, or not finite.
    pub fn with_mass(mut self, mass: f64) -> Result<Self> {
        self.mass = positive("mass", mass)?;
        Ok(self)
    }

    /// Sets the damping: mu per unit s (Eq. 8), or eta of rubber per mass, 1/s.
    ///
    /// # Errors
    /// Negative, or not finite.
    pub fn with_damping(mut self, damping: f64) -> Result<Self> {
        self.damping = MembraneError::within("damping", damping, 0.0, f64::MAX)?;
        Ok(self)
    }

    /// Returns the mass per unit s, or the density of rubber.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Returns the damping mu per unit s, or eta of rubber per mass.
    #[must_use]
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Returns the discretised forces.
    #[must_use]
    pub fn differences(&self) -> &FiniteDifferences {
        &self.discrete
    }

    /// Returns the volume enclosed at the start, cm^3.
    #[must_use]
    pub fn start_volume(&self) -> f64 {
        self.volume(self.discrete.start())
    }

    /// Returns the largest stable time step of explicit schemes,
    /// 2 sqrt(m) / omega (leapfrog's bound; omega^2 the largest eigenvalue of -dF_e/dc).
    ///
    /// With constant stiffness and no second neighbours it is ds sqrt(m / lambda) up to O(1/N^2). For rubber it applies at the start. Damping,
    /// which allows longer steps, is not counted.
    #[must_use]
    pub fn largest_explicit_step(&self) -> f64 {
        2.0 * self.mass.sqrt() / self.largest_frequency
    }

    /// Time of a wave along the curve.
    pub(crate) fn wave_time(&self) -> f64 {
        self.largest_explicit_step() * self.discrete.n_nodes() as f64
    }

    pub(crate) fn material(&self) -> &Material {
        self.discrete.setting().membrane().material()
    }

    /// Damping of a velocity, a force divided by the node's volume.
    pub(crate) fn friction(&self) -> f64 {
        match self.material() {
            Material::Springs { .. } => self.damping,
            Material::Rubber(_) => self.damping * self.mass,
        }
    }

    /// m + h mu, the factor of a velocity at the end of h in the balance of momentum.
    pub(crate) fn inertia(&self, h: f64) -> f64 {
        self.mass + h * self.friction()
    }

    /// Integral of |v|^2 over the material.
    pub(crate) fn square(&self, velocity: &[f64]) -> f64 {
        let pairs = self.volumes.iter().zip(velocity);
        self.weight * pairs.map(|(w, v)| w * v * v).sum::<f64>()
    }

    /// Volume enclosed, cm^3.
    pub(crate) fn volume(&self, nodes: &[f64]) -> f64 {
        self.copies() * Measure::Volume.of(nodes.as_chunks().0)
    }

    /// Number of times that the curve through the nodes covers the body: 2 for half a curve.
    pub(crate) fn copies(&self) -> f64 {
        if self.discrete.is_half() { 2.0 } else { 1.0 }
    }

    /// Rejects a curve that encloses no body; `order` is a work array.
    pub(crate) fn check_walls(
        &self,
        nodes: &[f64],
        time: f64,
        order: &mut Vec<usize>,
    ) -> Result<()> {
        let start = self.discrete.start().as_chunks().0;
        let node = collapse(start, nodes.as_chunks().0, order);
        node.map_or(Ok(()), |node| {
            let s = self.discrete.positions()[node];
            Err(ImplicitError::Collapsed { time, s })
        })
    }

    /// Returns the state that a load depends on.
    pub(crate) fn load_state(&self, time: f64, nodes: &[f64], velocities: &[f64]) -> LoadState {
        let (points, moving) = (nodes.as_chunks().0, velocities.as_chunks().0);
        let rate = Measure::Volume.rate(points, moving).unwrap_or(f64::NAN);
        LoadState {
            time,
            volume: self.volume(nodes),
            volume_rate: self.copies() * rate,
        }
    }

    /// Sets fixed numbers to zero.
    pub(crate) fn hold(&self, values: &mut [f64]) {
        for &held in self.discrete.fixed() {
            values[held] = 0.0;
        }
    }

    /// `out` = pressure force; `time` is reported in errors.
    pub(crate) fn pressure_into(
        &self,
        time: f64,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<()> {
        let d = &self.discrete;
        d.pressure_force_into(nodes, intensity, out)
            .map_err(|error| ImplicitError::Forces { time, error })
    }

    /// `out` = (m + h mu) - h^2 d(F_e + F_p)/dc at fixed intensity.
    pub(crate) fn stage_matrix_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        h: f64,
        out: &mut Tangent,
    ) -> Result<(), MembraneError> {
        let square = -h * h;
        self.discrete.tangent_into(nodes, intensity, out)?;
        out.band.scale(square);
        // one in the rows of fixed numbers
        for &held in self.discrete.fixed() {
            out.band.add(held, held, 1.0 - square)?;
        }
        let diagonal = self.inertia(h);
        let mut volumes = self.volumes.iter().enumerate();
        volumes.try_for_each(|(i, volume)| out.band.add(i, i, diagonal * volume))
    }
}
