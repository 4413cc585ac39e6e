//! The paper's direct method on its own terms: plain Newton with either Jacobian of Eq. 14.

use membrane_forces::{DiscreteMembrane, FiniteDifferences, MembraneError, Tangent};

use crate::banded::BandedLu;
use crate::block::nan_max;
use crate::error::NewtonError;
use crate::newton::{NewtonScratch, ResidualSystem, newton_with};
use crate::options::{LineSearch, NewtonOptions};

/// Which Jacobian Newton uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperJacobian {
    /// The exact derivative: Eq. 14 with its signs corrected.
    Exact,
    /// Eq. 14 with the signs as printed, which is not the derivative.
    AsPrinted,
}

/// Residual after each iteration of plain Newton from the rest shape, the initial one first: the
/// largest component of F_p + F_e at any node (force per unit s).
///
/// Stops after `iterations` steps, or when the residual is not finite or below `tolerance`, or
/// when the matrix is singular. This is the method of section 3.1 of Rohmer et al. 2006 for the
/// laws per material and per current length; it is here to show why the paper saw it oscillate.
///
/// ```
/// use membrane_newton::{Membrane, PaperJacobian, RestShape, paper_newton};
/// use membrane_newton::membrane_forces::FiniteDifferences;
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?);
/// let differences = FiniteDifferences::new(&membrane, 201)?;
/// let exact = paper_newton(&differences, 17.5, PaperJacobian::Exact, 60, 1e-4)?;
/// let printed = paper_newton(&differences, 17.5, PaperJacobian::AsPrinted, 60, 1e-4)?;
/// assert!(exact.len() == 3 && exact[2] < 1e-5);
/// assert!(printed.len() == 61 && printed[60] > 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A load or tolerance that is not finite.
pub fn paper_newton(
    differences: &FiniteDifferences,
    load: f64,
    jacobian: PaperJacobian,
    iterations: usize,
    tolerance: f64,
) -> Result<Vec<f64>, NewtonError> {
    for (what, given) in [("load", load), ("tolerance", tolerance)] {
        if !given.is_finite() {
            return Err(NewtonError::Membrane(MembraneError::NotFinite {
                what,
                given,
            }));
        }
    }
    let tangent = differences.tangent();
    let n = tangent.band.len();
    let mut system = Direct {
        differences,
        load,
        jacobian,
        lu: BandedLu::for_matrix(&tangent.band),
        tangent,
        elastic: vec![0.0; n],
    };
    let options = NewtonOptions {
        residual_tolerance: tolerance,
        step_tolerance: 0.0,
        max_iterations: iterations,
        line_search: LineSearch::FullStep,
        max_load_steps: 0,
        ..NewtonOptions::default()
    };
    let mut scratch = NewtonScratch::default();
    let mut x = differences.start().to_vec();
    // however it ends, the history is the result
    let _ = newton_with(&mut system, &mut x, &options, &mut scratch);
    Ok(scratch.report().history.clone())
}

struct Direct<'a> {
    differences: &'a FiniteDifferences,
    load: f64,
    jacobian: PaperJacobian,
    tangent: Tangent,
    lu: BandedLu,
    elastic: Vec<f64>,
}

impl ResidualSystem for Direct<'_> {
    fn len(&self) -> usize {
        self.elastic.len()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        self.differences.elastic_force_into(x, &mut self.elastic);
        self.differences.pressure_force_into(x, self.load, out)?;
        for (out, elastic) in out.iter_mut().zip(&self.elastic) {
            *out += elastic;
        }
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let Self {
            differences,
            tangent,
            ..
        } = self;
        differences.tangent_into(x, self.load, tangent)?;
        match self.jacobian {
            PaperJacobian::Exact => (),
            PaperJacobian::AsPrinted => {
                differences.add_misprint_into(x, self.load, &mut tangent.band)?;
            }
        }
        self.lu.factor(&tangent.band)?;
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        let lu = self.lu.factored().ok_or(NewtonError::NotFactored)?;
        lu.solve_into(rhs);
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual.iter().fold(0.0, |m, r| nan_max(m, r.abs()))
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        step.iter().fold(0.0, |m, s| m.max(s.abs()))
    }
}
