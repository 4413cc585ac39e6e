//! The direct method of section 3.1 as published: plain Newton with either Jacobian of Eq. 14.

use heart_phantom::membrane_newton::membrane_forces::{
    DiscreteMembrane, FiniteDifferences, Tangent,
};
use heart_phantom::membrane_newton::{
    BandedLu, LineSearch, MembraneError, NewtonError, NewtonOptions, NewtonScratch, ResidualSystem,
    newton_with,
};

/// The Jacobian of the Newton method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PaperJacobian {
    /// The exact derivative: Eq. 14 with its signs corrected.
    Exact,
    /// Eq. 14 with the printed signs, which is not the derivative.
    AsPrinted,
}

/// Returns the residuals of plain Newton from the reference configuration, before the first iteration and after each: the largest
/// component of F_p + F_e at any node of a whole curve under the law per material length (force per unit s).
///
/// Stops after `iterations` steps, when the residual is below `tolerance` or not finite, or when the matrix is singular.
pub(super) fn paper_newton(
    differences: &FiniteDifferences,
    load: f64,
    jacobian: PaperJacobian,
    iterations: usize,
    tolerance: f64,
) -> Vec<f64> {
    let tangent = differences.tangent();
    let mut system = Direct {
        differences,
        load,
        jacobian,
        lu: BandedLu::for_matrix(&tangent.band),
        elastic: vec![0.0; tangent.band.len()],
        tangent,
    };
    let options = NewtonOptions::default()
        .with_tolerances(tolerance, 0.0)
        .with_max_iterations(iterations)
        .with_line_search(LineSearch::FullStep);
    let mut scratch = NewtonScratch::default();
    let mut x = differences.start().to_vec();
    // the history is the result in all cases
    let _ = newton_with(&mut system, &mut x, &options, &mut scratch);
    scratch.report().history.clone()
}

struct Direct<'a> {
    differences: &'a FiniteDifferences,
    load: f64,
    jacobian: PaperJacobian,
    tangent: Tangent,
    lu: BandedLu,
    elastic: Vec<f64>,
}

impl Direct<'_> {
    /// Adds the difference of the printed Eq. 14 to the tangent: its entries dF^x/dc_y(n-1) and dF^y/dc_x(n-1) have the wrong sign
    /// of 1/n. Correct is f (1/n - d^2/n^3); printed is f (d^2/n^3 + 1/n), and its negative for the other.
    fn add_misprint(&mut self, x: &[f64]) -> Result<(), MembraneError> {
        let points = x.as_chunks::<2>().0;
        for (n, p) in points.windows(3).enumerate() {
            let d = [p[2][0] - p[0][0], p[2][1] - p[0][1]];
            let f = self.load / d[0].hypot(d[1]).powi(3);
            let row = 2 * (n + 1);
            let band = &mut self.tangent.band;
            band.add(row, row - 1, 2.0 * f * d[1] * d[1])?;
            band.add(row + 1, row - 2, -2.0 * f * d[0] * d[0])?;
        }
        Ok(())
    }
}

impl ResidualSystem for Direct<'_> {
    fn len(&self) -> usize {
        self.elastic.len()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        (self.differences).forces_into(x, self.load, &mut self.elastic, out)?;
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        (self.differences).tangent_into(x, self.load, &mut self.tangent)?;
        match self.jacobian {
            PaperJacobian::Exact => (),
            PaperJacobian::AsPrinted => self.add_misprint(x)?,
        }
        self.lu.factor(&self.tangent.band)
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        self.lu.solve_into(rhs)
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        let finite = residual.iter().all(|r| r.is_finite());
        let largest = residual.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
        if finite { largest } else { f64::NAN }
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        step.iter().fold(0.0, |m, s| m.max(s.abs()))
    }
}
