//! Inflation of rubber from its reference configuration, where it has no tension and a singular tangent.
//!
//! The first step is that of a membrane under tension: it has the requested volume and approximately the shape. Later tangents have
//! meridional tensions limited to non-negative values. A result without compression has the exact tangent, so that the last steps converge
//! quadratically; a result with compression is not an equilibrium of a membrane.

use membrane_forces::Measure;

use crate::constraint::Constraint;
use crate::continuation::{self, Search};
use crate::error::{NewtonError, Result};
use crate::nested_system::NestedSystem;
use crate::newton::ResidualSystem;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;
use crate::resolution::{swept_by_mean_radius, swept_by_radius};
use crate::turning::Reach;

/// Tension of the first step, for a change of volume equal to that swept by the membrane if it moves by its radius.
const FIRST_TENSION: f64 = 4.0;
/// First change of volume for a prescribed load, in the same unit.
const FIRST_VOLUME: f64 = 0.05;
/// Forces in the reference configuration, over their scale: rounding, which a second derivative of polynomials of degree p multiplies by
/// p^4. Small loads are not treated as rounding: a slack disc moves by their cube root.
const AT_REST: f64 = 1e-11;
/// Largest number of halvings of the first change of volume.
const HALVINGS: usize = 12;

/// Solves for `wanted` and writes the result to `state`: from `state` if it differs from `start`, the reference configuration; else
/// directly; or from the first volume on the way that can be reached directly.
pub(crate) fn solve(
    system: &mut NestedSystem<'_>,
    state: &mut [f64],
    start: &[f64],
    wanted: Constraint,
    options: &NewtonOptions,
) -> Result<NewtonReport> {
    options.check()?;
    let mut search = Search::new(system);
    search.system.innermost().constraint = wanted;
    search.system.each().for_each(|m| m.expect_stable());
    let (rest, most) = (
        search.system.volume(start),
        swept_by_mean_radius(search.system.innermost().start()),
    );
    // The result of a coarser curve may be beyond a limit of this one.
    if state != start
        && search.attempt_taut(state, start, options).is_ok()
        && search.system.volume(state) - rest <= most
    {
        return Ok(search.report);
    }
    state.copy_from_slice(start);
    let mut residual = vec![0.0; start.len()];
    search.system.residual_into(start, &mut residual)?;
    let nothing_asked = search.system.control_value(start) == wanted.value();
    if nothing_asked && search.system.residual_norm(&residual) <= AT_REST {
        return Ok(search.report);
    }
    let unit = swept_by_radius(search.system.innermost().start());
    let (first, at_once) = match wanted {
        Constraint::Measure(Measure::Volume, volume) => {
            let change = volume - rest;
            (change.min(most), change <= most)
        }
        Constraint::Measure(..) | Constraint::Intensity(_) | Constraint::TotalForce(_) => {
            (FIRST_VOLUME * unit, false)
        }
    };
    let mut last = None;
    for halving in 0..=HALVINGS {
        let change = first * 0.5f64.powi(halving as i32);
        match search.launch(state, start, rest + change, options) {
            Ok(()) if halving == 0 && at_once => return Ok(search.report),
            Ok(()) => {
                last = None;
                break;
            }
            Err(error) => last = Some(error),
        }
    }
    if let Some(mut error) = last {
        state.copy_from_slice(start);
        if let Some(report) = error.report_mut() {
            report.clone_from(&search.report);
        }
        return Err(error);
    }
    search.continue_to(state, wanted, options)
}

impl Search<'_, '_> {
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
        system.innermost().constraint = Constraint::Measure(Measure::Volume, volume);
        for membrane in system.each() {
            let tension = FIRST_TENSION * change / swept_by_radius(membrane.start());
            membrane.set_least_tension(tension.clamp(1e-9, 1.0));
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
        for membrane in self.system.each() {
            membrane.set_least_tension(0.0);
            membrane.expect_stable();
        }
        self.attempt(state, Reach::Direct, start, options)
    }

    /// Solves from the equilibrium `state` to `wanted`.
    fn continue_to(
        &mut self,
        state: &mut [f64],
        wanted: Constraint,
        options: &NewtonOptions,
    ) -> Result<NewtonReport> {
        let system = &mut *self.system;
        system.innermost().constraint = wanted;
        system.each().for_each(|m| m.expect_stable());
        let launched = state.to_vec();
        let values = (system.control_value(&launched), wanted.value());
        let mut outcome = continuation::solve(system, state, &launched, values, options);
        if let Some(report) = outcome.as_mut().map_or_else(NewtonError::report_mut, Some) {
            report.add_earlier(&self.report);
        }
        outcome
    }
}
