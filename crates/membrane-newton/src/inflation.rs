//! Inflation of rubber from its reference configuration, where it has no tension and a singular tangent.
//!
//! The first step is that of a membrane under tension: it has the requested volume and approximately the shape. Later tangents have
//! meridional tensions limited to non-negative values. A result without compression has the exact tangent, so that the last steps converge
//! quadratically; a result with compression is not an equilibrium of a membrane.

use crate::constraint::{Constraint, Quantity};
use crate::continuation::Search;
use crate::error::Result;
use crate::newton::ResidualSystem;
use crate::options::NewtonOptions;
use crate::resolution::{swept_by_mean_radius, swept_by_radius};
use crate::turning::Reach;

/// Tension of the first step, for a change of volume equal to that swept by the membrane if it moves by its radius.
const FIRST_TENSION: f64 = 4.0;
/// First change of volume for a prescribed load, in the same unit.
pub(crate) const FIRST_VOLUME: f64 = 0.05;
/// Forces in the reference configuration, over their scale: rounding, which a second derivative of polynomials of degree p multiplies by
/// p^4. Small loads are not treated as rounding: a slack disc moves by their cube root.
const AT_REST: f64 = 1e-11;
/// Largest number of halvings of the first change of volume.
const HALVINGS: usize = 12;

impl Search<'_, '_> {
    /// Solves for `wanted` and writes the result to `state`: from `state` if it differs from `start`, the reference configuration; else
    /// directly; or from the first volume on the way that can be reached directly.
    pub(crate) fn inflate(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        wanted: Constraint,
        options: &NewtonOptions,
    ) -> Result<()> {
        self.system.innermost().constraint = wanted;
        self.system.each().for_each(|m| m.expect_stable());
        let of_start = self.system.innermost().start;
        let (rest, most) = (self.system.volume(start), swept_by_mean_radius(&of_start));
        // The result of a coarser curve may be beyond a limit of this one.
        if state != start
            && self.attempt_taut(state, start, options).is_ok()
            && self.system.volume(state) - rest <= most
        {
            return Ok(());
        }
        state.copy_from_slice(start);
        let mut residual = vec![0.0; start.len()];
        self.system.residual_into(start, &mut residual)?;
        let nothing_asked = self.system.control_value(start) == wanted.value;
        if nothing_asked && self.system.residual_norm(&residual) <= AT_REST {
            return Ok(());
        }
        let change = wanted.value - rest;
        let (first, at_once) = match wanted.quantity {
            Quantity::VOLUME => (change.min(most), change <= most),
            _ => (FIRST_VOLUME * swept_by_radius(&of_start), false),
        };
        let mut launched = Ok(());
        for halving in 0..=HALVINGS {
            let change = first * 0.5f64.powi(halving as i32);
            launched = self.launch(state, start, rest + change, options);
            if launched.is_ok() {
                if halving == 0 && at_once {
                    return Ok(());
                }
                break;
            }
        }
        if launched.is_err() {
            state.copy_from_slice(start);
            return launched;
        }
        self.system.innermost().constraint = wanted;
        self.system.each().for_each(|m| m.expect_stable());
        let launched = state.to_vec();
        let values = (self.system.control_value(&launched), wanted.value);
        self.solve(state, &launched, values, options)
    }

    /// Inflates the membrane from its reference configuration to `volume` in one solve.
    fn launch(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        volume: f64,
        options: &NewtonOptions,
    ) -> Result<()> {
        let system = &mut *self.system;
        let change = (volume - system.volume(start)).abs();
        system.innermost().constraint = Constraint::volume(volume);
        for membrane in system.each() {
            let tension = FIRST_TENSION * change / swept_by_radius(&membrane.start);
            membrane.least_tension = tension.clamp(1e-9, 1.0);
        }
        state.copy_from_slice(start);
        let mut step = vec![0.0; start.len()];
        system.residual_into(start, &mut step)?;
        system.factor(start)?;
        system.solve_in_place(&mut step)?;
        self.report.factorisations += 1;
        self.report.residual_calls += 1;
        for (x, step) in state.iter_mut().zip(&step) {
            *x -= step;
        }
        self.attempt_taut(state, start, options)
    }

    /// Solves by Newton from `state`, with tensions in tangents limited to non-negative values.
    fn attempt_taut(
        &mut self,
        state: &mut [f64],
        start: &[f64],
        options: &NewtonOptions,
    ) -> Result<()> {
        self.system.set_least_tension(0.0);
        self.system.each().for_each(|m| m.expect_stable());
        self.attempt(state, Reach::Direct, start, options)
    }
}
