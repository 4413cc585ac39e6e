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
