//! Membranes around each other, each at one resolution, and the finer ones to go to until the polynomials have converged.

use std::sync::Arc;

use membrane_forces::Measure;

use crate::continuation;
use crate::control::{Control, Target};
use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, own};
use crate::inflation;
use crate::limit;
use crate::newton::ResidualSystem;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;
use crate::resolution::Resolution;
use crate::system::System;

/// Finer resolutions, with a state carried over to them, and with their start.
type Refined = (Layers, Vec<f64>, Vec<f64>);

/// How near to where a walk ended the limit that it ended for is.
const AT_LIMIT: f64 = 1e-3;
/// Steps in the volume where the pressure hardly rises, as shares of it from the least to the most, and how many.
const SHALLOWS: [f64; 2] = [1e-5, 0.02];
const MOST_SHALLOWS: usize = 400;

/// Membranes from the inside out: one, or a pair. Their states follow each other.
pub(crate) struct Layers(pub(crate) Vec<Arc<Resolution>>);

impl Layers {
    /// Each membrane with its part of a state.
    pub(crate) fn parts<'a>(
        &'a self,
        mut state: &'a [f64],
    ) -> impl Iterator<Item = (&'a Arc<Resolution>, &'a [f64])> {
        self.0.iter().map(move |resolution| {
            let (part, rest) = state.split_at(resolution.discrete.start().len() + 1);
            state = rest;
            (resolution, part)
        })
    }

    /// Nodes and force intensity of each membrane at the start.
    pub(crate) fn start_state(&self) -> Vec<f64> {
        self.0.iter().flat_map(|r| r.start_state()).collect()
    }

    /// Volumes between membranes at the start, as these resolutions have them.
    pub(crate) fn wall_volumes(&self) -> Vec<f64> {
        let pairs = self.0.windows(2);
        pairs
            .map(|p| p[1].start.volume - p[0].start.volume)
            .collect()
    }

    fn system(&self, control: Control) -> Result<System<'_>, NewtonError> {
        let mut target = self.0[0].target(control)?;
        let mut membranes = Vec::with_capacity(self.0.len());
        for resolution in &self.0 {
            membranes.push(resolution.system(target));
            target = Target::Measure(Measure::Volume, 0.0);
        }
        Ok(System::new(membranes, self.wall_volumes()))
    }

    /// Derivative of an equilibrium `state` by the value of `control`.
    pub(crate) fn rate(&self, state: &[f64], control: Control) -> Result<Vec<f64>, NewtonError> {
        let mut system = self.system(control)?;
        system.factor(state)?;
        let mut rate = vec![0.0; state.len()];
        rate[self.0[0].discrete.start().len()] = self.0[0].target_slope(control);
        system.solve_in_place(&mut rate)?;
        Ok(rate)
    }

    /// Solves at these resolutions, from `state` or, what comes to the same, `start`.
    fn solve_here(
        &self,
        state: &mut [f64],
        (start, from_rest): (&[f64], bool),
        control: Control,
        options: &NewtonOptions,
    ) -> Result<NewtonReport, NewtonError> {
        let mut system = self.system(control)?;
        let target = self.0[0].target(control)?;
        if !self.0.iter().any(|resolution| resolution.is_rubber()) {
            let values = (system.control_value(start), target.value());
            return continuation::solve(&mut system, state, start, values, options);
        }
        let mut outcome = if from_rest {
            inflation::solve(&mut system, state, start, target, options)
        } else {
            system.each().for_each(|m| m.set_least_tension(0.0));
            let values = (system.control_value(start), target.value());
            continuation::solve(&mut system, state, start, values, options)
        };
        let ended = (&mut outcome, target);
        if let (
            Err(NewtonError::LimitPoint {
                reached, report, ..
            }),
            Target::Intensity(wanted),
        ) = ended
            && self.0[0].is_rubber()
        {
            let pressure = self.0[0].discrete.start().len();
            let limit = |state: &[f64]| {
                let most = limit::pressure(&self.0[0], state)?;
                (most <= wanted && (most / state[pressure] - 1.0).abs() < AT_LIMIT).then_some(most)
            };
            match limit(state) {
                Some(most) => *reached = most,
                None => match self.over_shallows(state, wanted, options) {
                    Some(mut further) => {
                        further.add_earlier(report);
                        return Ok(further);
                    }
                    None => *reached = limit(state).unwrap_or(state[pressure]),
                },
            }
        }
        outcome
    }

    /// On from `state` by volume to where the pressure is `wanted`: just before a limit, or where it rises ever so slowly with the volume,
    /// steps in the pressure find no way. None if it ceases to rise; `state` is then the last one in which it did.
    fn over_shallows(
        &self,
        state: &mut [f64],
        wanted: f64,
        options: &NewtonOptions,
    ) -> Option<NewtonReport> {
        let pressure = self.0[0].discrete.start().len();
        if wanted <= state[pressure] {
            return None;
        }
        let mut total = NewtonReport::default();
        let mut share = SHALLOWS[1];
        for _ in 0..MOST_SHALLOWS {
            let volume = own(self.0[0]
                .discrete
                .measure(Measure::Volume, &state[..pressure]));
            let mut next = state.to_vec();
            let further = Control::Volume(volume * (1.0 + share));
            total.add_earlier(&self.step(&mut next, further, options)?);
            // a step may end beyond the maximum, and higher than it began
            let slope = self.rate(&next, further).ok()?[pressure];
            if slope <= 0.0 || next[pressure] <= state[pressure].max(0.0) {
                share *= 0.25;
                if share < SHALLOWS[0] {
                    return None;
                }
                continue;
            }
            let passed = next[pressure] >= wanted;
            if passed {
                total.add_earlier(&self.step(&mut next, Control::Load(wanted), options)?);
            }
            state.copy_from_slice(&next);
            if passed {
                return Some(total);
            }
        }
        None
    }

    /// Along the branch from the equilibrium `state` to what `control` says, at these resolutions.
    fn step(
        &self,
        state: &mut [f64],
        control: Control,
        options: &NewtonOptions,
    ) -> Option<NewtonReport> {
        let mut system = self.system(control).ok()?;
        let target = self.0[0].target(control).ok()?;
        let start = state.to_vec();
        let values = (system.control_value(&start), target.value());
        continuation::solve(&mut system, state, &start, values, options).ok()
    }

    fn check_resolved(&self, state: &[f64]) -> Result<(), NewtonError> {
        let mut parts = self.parts(state);
        parts.try_for_each(|(resolution, part)| resolution.check_resolved(part))
    }

    /// All membranes one resolution finer, as far as each can go, with `state` and with the curves to start `near` or their start;
    /// none if none can.
    fn refine(&self, state: &[f64], near: &[&Equilibrium]) -> Result<Option<Refined>, NewtonError> {
        let (mut finer, mut carried, mut start) = (Vec::new(), Vec::new(), Vec::new());
        let mut any = false;
        for (k, (resolution, part)) in self.parts(state).enumerate() {
            let next = match resolution.finer() {
                None => {
                    carried.extend(part);
                    resolution.clone()
                }
                Some(next) => {
                    let next = next?;
                    carried.extend(next.carry(resolution, part));
                    any = true;
                    next
                }
            };
            start.extend(next.start_near(near.get(k).copied()));
            finer.push(next);
        }
        Ok(any.then_some((Self(finer), carried, start)))
    }

    /// Where coarser polynomials find the membranes at a volume, if there are such. Under a load a coarse curve may be beyond a limit that
    /// fine ones have.
    fn go_ahead(
        &self,
        control: Control,
        options: &NewtonOptions,
    ) -> Option<(Vec<f64>, NewtonReport)> {
        if !matches!(control, Control::Volume(_) | Control::VolumeGain(_)) {
            return None;
        }
        let coarse = self.0.iter().map(|resolution| resolution.coarse.clone());
        let coarse = Self(coarse.collect::<Option<Vec<_>>>()?);
        let start = coarse.start_state();
        let (coarse, state, report) = coarse.solve(start, &[], control, options).ok()?;
        let parts = coarse.parts(&state).zip(&self.0);
        let carried = parts.flat_map(|((from, part), to)| to.carry(from, part));
        Some((carried.collect(), report))
    }

    /// Solves at these resolutions, then at finer ones until the polynomials have converged; each begins with
    /// what the one before has found, unless that failed. `near`: what `start` is of, if it is not the start.
    pub(crate) fn solve(
        mut self,
        mut start: Vec<f64>,
        near: &[&Equilibrium],
        control: Control,
        options: &NewtonOptions,
    ) -> Result<(Self, Vec<f64>, NewtonReport), NewtonError> {
        let mut total = NewtonReport::default();
        let mut state = start.clone();
        if near.is_empty()
            && let Some((ahead, report)) = self.go_ahead(control, options)
        {
            (state, total) = (ahead, report);
        }
        loop {
            let from = (&start[..], near.is_empty());
            let mut outcome = self.solve_here(&mut state, from, control, options);
            if let Some(report) = outcome.as_mut().map_or_else(NewtonError::report_mut, Some) {
                report.add_earlier(&total);
                total.clone_from(report);
            }
            let outcome = outcome.and_then(|_| self.check_resolved(&state));
            let carry = match outcome {
                Ok(()) => return Ok((self, state, total)),
                Err(NewtonError::Unresolved { .. }) => true,
                Err(
                    NewtonError::NotConverged { .. }
                    | NewtonError::OtherBranch { .. }
                    | NewtonError::Singular { .. },
                ) => false,
                // where the curve is resolved it is the branch that ends, not the polynomials
                Err(NewtonError::LimitPoint { .. }) if self.check_resolved(&state).is_err() => {
                    false
                }
                Err(error) => return Err(error),
            };
            match self.refine(&state, near)? {
                Some(finer) => (self, state, start) = finer,
                None => {
                    return Err(outcome
                        .err()
                        .unwrap_or(NewtonError::NotConverged { report: total }));
                }
            }
            if !carry {
                state.copy_from_slice(&start);
            }
        }
    }
}
