//! Along a branch of equilibria of rubber, with what is stable.

use membrane_forces::Measure;

use crate::control::{Control, Target};
use crate::equilibrium::Equilibrium;
use crate::error::NewtonError;
use crate::options::NewtonOptions;
use crate::solver::Solver;

/// How an equilibrium of rubber moves when it is let go.
///
/// Eigenvalues of the second derivative of the energy by the kinetic energy of the rubber, per its density: squares of angular frequencies,
/// times density, of axisymmetric free vibrations. Each is the one nearest to zero, which is the lowest until it has passed zero. Where it
/// does a branch turns back or bulges.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Stability {
    /// While the pressure stays: negative past the limit point.
    pub at_pressure: f64,
    /// While the volume stays.
    pub at_volume: f64,
}

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
    /// Equilibria of rubber at these volumes (cm^3), each from the one before: p(V) also past its maximum, with its stability.
    ///
    /// # Errors
    /// As [`Solver::solve`], and [`MembraneError::OtherMaterial`](membrane_forces::MembraneError::OtherMaterial) for springs.
    pub fn branch(
        &self,
        volumes: &[f64],
        options: &NewtonOptions,
    ) -> Result<Vec<BranchPoint>, NewtonError> {
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

impl Equilibrium {
    /// Its stability, by inverse iteration with the exact tangent.
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`](membrane_forces::MembraneError::OtherMaterial) for springs; an eigenvalue that is zero to
    /// rounding; one that some thousand iterations do not tell from the next.
    pub fn stability(&self) -> Result<Stability, NewtonError> {
        let volume = Target::Measure(Measure::Volume, self.measures.volume);
        Ok(Stability {
            at_pressure: self.eigenvalue(Target::Intensity(self.intensity))?,
            at_volume: self.eigenvalue(volume)?,
        })
    }

    /// The eigenvalue nearest to zero of K x = -lambda M x among changes that leave what is prescribed as it is.
    fn eigenvalue(&self, target: Target) -> Result<f64, NewtonError> {
        let discrete = &*self.resolution.discrete;
        let mut system = self.resolution.system(target);
        system.factor(&self.state)?;
        let last = discrete.start().len();
        let mut x: Vec<f64> = (0..=last).map(|i| 1.0 + (i as f64).sin()).collect();
        let mut momentum = vec![0.0; last];
        let mut eigenvalue = f64::INFINITY;
        for _ in 0..ITERATIONS {
            for &held in discrete.held() {
                x[held] = 0.0;
            }
            discrete.momentum_into(&x[..last], &mut momentum)?;
            let size: f64 = momentum.iter().zip(&x).map(|(m, x)| m * x).sum();
            let scale = 1.0 / size.sqrt();
            let mut next: Vec<f64> = momentum.iter().map(|m| -scale * m).collect();
            for &held in discrete.held() {
                next[held] = 0.0;
            }
            next.push(0.0);
            system.solve_in_place(&mut next)?;
            let along: f64 = momentum.iter().zip(&next).map(|(m, x)| scale * m * x).sum();
            let found = 1.0 / along;
            x = next;
            if (found - eigenvalue).abs() <= 1e-10 * found.abs() {
                return Ok(found);
            }
            eigenvalue = found;
        }
        Err(NewtonError::Unsettled { eigenvalue })
    }
}

const ITERATIONS: usize = 2000;
