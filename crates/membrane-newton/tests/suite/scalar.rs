//! Equations of one unknown.

use membrane_newton::{NewtonError, ResidualSystem};

/// r(x) = 0 with an approximate derivative; counts residuals and factorisations.
pub(crate) struct Scalar<R, S> {
    residual: R,
    slope_at: S,
    /// The norm of a step over its size.
    pub(crate) norm: f64,
    slope: f64,
    pub(crate) residuals: usize,
    pub(crate) factorisations: usize,
}

impl<R, S> Scalar<R, S>
where
    R: FnMut(f64) -> Result<f64, NewtonError>,
    S: Fn(f64) -> f64,
{
    pub(crate) fn new(residual: R, slope_at: S) -> Self {
        Self {
            residual,
            slope_at,
            norm: 1.0,
            slope: f64::NAN,
            residuals: 0,
            factorisations: 0,
        }
    }
}

impl<R, S> ResidualSystem for Scalar<R, S>
where
    R: FnMut(f64) -> Result<f64, NewtonError>,
    S: Fn(f64) -> f64,
{
    fn len(&self) -> usize {
        1
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        self.residuals += 1;
        out[0] = (self.residual)(x[0])?;
        Ok(())
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        self.factorisations += 1;
        self.slope = (self.slope_at)(x[0]);
        Ok(())
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        rhs[0] /= self.slope;
        Ok(())
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        residual[0].abs()
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        self.norm * step[0].abs()
    }
}
