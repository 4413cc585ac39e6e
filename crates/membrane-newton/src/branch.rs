//! Branches of equilibria of rubber, with their stability.

use crate::constraint::Control;
use crate::equilibrium::Equilibrium;
use crate::error::Result;
use crate::options::NewtonOptions;
use crate::solver::Solver;
use crate::stability::Stability;

/// One equilibrium of a branch.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BranchPoint {
    /// Shape, pressure and volume.
    pub equilibrium: Equilibrium,
    /// dp/dV.
    pub slope: f64,
    /// Its stability.
    pub stability: Stability,
}

impl Solver {
    /// Returns the equilibria of rubber at these volumes (cm^3), each solved from the previous one: p(V) with stability, also past its maximum.
    ///
    /// ```
    /// use membrane_newton::{Discretisation, Membrane, NewtonOptions, ReferenceShape, Rubber, Solver, StrainEnergy, Thickness};
    /// let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT)?;
    /// let disc = Membrane::new(ReferenceShape::disc(1.0)?).with_rubber(rubber);
    /// let solver = Solver::new(&disc, Discretisation::Spectral { degree: 16, per_piece: 1 })?;
    /// let branch = solver.branch(&[1.0, 2.0, 3.0, 4.0], &NewtonOptions::default())?;
    /// assert!(branch[1].slope > 0.0 && branch[3].slope < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of the first volume that cannot be solved, as [`Solver::solve`]; calls of [`Solver::solve_from`] keep the equilibria before it.
    /// [`MembraneError::OtherMaterial`](membrane_forces::MembraneError::OtherMaterial) for springs.
    pub fn branch(&self, volumes: &[f64], options: &NewtonOptions) -> Result<Vec<BranchPoint>> {
        let mut points: Vec<BranchPoint> = Vec::with_capacity(volumes.len());
        for &volume in volumes {
            let control = Control::Volume(volume);
            let equilibrium = match points.last() {
                Some(last) => self.solve_from(&last.equilibrium, control, options)?,
                None => self.solve(control, options)?,
            };
            points.push(BranchPoint {
                slope: equilibrium.sensitivity(control)?.intensity,
                stability: equilibrium.stability()?,
                equilibrium,
            });
        }
        Ok(points)
    }
}
