//! Nested membranes at a common resolution, and their refinement until the polynomials converge.

use std::sync::Arc;

use crate::constraint::{Constraint, Control, Quantity};
use crate::continuation::{MISSED, Search, WALKING};
use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, Result};
use crate::inflation::FIRST_VOLUME;
use crate::limit;
use crate::nested_system::NestedSystem;
use crate::newton::ResidualSystem;
use crate::options::NewtonOptions;
use crate::report::{NewtonReport, StopReason};
use crate::resolution::{Resolution, swept_by_mean_radius, swept_by_radius};
use crate::route::Route;

/// Finer resolutions, with a state and its start transferred to them.
type Refined = (Nested, Vec<f64>, Vec<f64>);

/// Relative distance from the end of a walk to the limit that ended it.
const AT_LIMIT: f64 = 1e-3;
/// Least and first step of a walk to a pressure relative to the volume, and largest number of steps.
const LEAST_STEP: f64 = 1e-5;
const FIRST_STEP: f64 = 0.02;
const MOST_STEPS: usize = 400;

/// Resolutions, the state that solves them, and the report.
pub(crate) type Solved = (Nested, Vec<f64>, NewtonReport);

/// Membranes from the inside out: one, or a pair. Their states are adjacent.
pub(crate) struct Nested(pub(crate) Vec<Arc<Resolution>>);

impl Nested {
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

    /// Returns the volumes between membranes at the start at these resolutions.
    pub(crate) fn wall_volumes(&self) -> Vec<f64> {
        let pairs = self.0.windows(2);
        pairs
            .map(|p| p[1].start.volume - p[0].start.volume)
            .collect()
    }

    fn system(&self, control: Control) -> Result<NestedSystem<'_>> {
        let mut constraint = self.0[0].constraint(control)?;
        let mut membranes = Vec::with_capacity(self.0.len());
        for resolution in &self.0 {
            membranes.push(resolution.system(constraint));
            constraint = Constraint::volume(0.0);
        }
        Ok(NestedSystem::new(membranes, self.wall_volumes()))
    }

    /// Derivative of an equilibrium `state` by the value of `control`.
    pub(crate) fn rate(&self, state: &[f64], control: Control) -> Result<Vec<f64>> {
        if let [resolution] = &self.0[..]
            && let Some(rate) = resolution.scaled_rate(state, resolution.constraint(control)?)
        {
            // a flat start has no volume gain
            return Ok(rate);
        }
        let mut system = self.system(control)?;
        system.factor(state)?;
        let mut rate = vec![0.0; state.len()];
        rate[self.0[0].discrete.start().len()] = self.0[0].constraint_slope(control);
        system.solve_in_place(&mut rate)?;
        Ok(rate)
    }

    /// Solves at these resolutions from `state` or `start`, which are equivalent, and adds the attempts to `report`.
    fn solve_here(
        &self,
        state: &mut [f64],
        (start, from_rest): (&[f64], bool),
        control: Control,
        options: &NewtonOptions,
        report: &mut NewtonReport,
    ) -> Result<()> {
        let mut system = self.system(control)?;
        let constraint = self.0[0].constraint(control)?;
        let Constraint { quantity, value } = constraint;
        let values = (system.control_value(start), value);
        let mut routes = self.0.iter().map(|resolution| resolution.route());
        let inflates = routes.any(|route| route == Route::Inflate);
        let mut search = Search::new(&mut system, report);
        let outcome = match (inflates, from_rest) {
            (false, _) => search.solve(state, start, values, options),
            (true, true) => search.inflate(state, start, constraint, options),
            (true, false) => {
                search.system.set_least_tension(0.0);
                search.solve(state, start, values, options)
            }
        };
        if outcome.is_ok() {
            // without a factorisation the start is the result
            let _ = search.add_rounding(state);
        }
        if !inflates {
            return outcome;
        }
        let stopped = match outcome {
            Err(NewtonError::LimitPoint { .. }) => true,
            // without load steps there is no solved state to report
            Err(NewtonError::NotConverged { .. } | NewtonError::OtherBranch { .. }) => {
                options.max_load_steps > 0
            }
            _ => false,
        };
        if stopped && let Some(cause) = limit::cause(&mut system, state, constraint) {
            return Err(cause);
        }
        if !stopped || quantity != Quantity::Intensity || self.0[0].route() != Route::Inflate {
            return outcome;
        }
        let mut ended = None;
        if let Err(NewtonError::LimitPoint { report, .. }) = outcome {
            ended = report.stopped_by;
        } else {
            // No step in the pressure left the start, as for a pressure that is far too large: continues from a first volume.
            let rest = &self.0[0].start;
            let volume = Control::Volume(rest.volume + FIRST_VOLUME * swept_by_radius(rest));
            state.copy_from_slice(start);
            let from = (start, from_rest);
            let walks = from_rest && value > 0.0 && options.max_iterations >= WALKING;
            if !walks || (self.solve_here(state, from, volume, options, report)).is_err() {
                return outcome;
            }
        }
        self.pass_limit(state, (value, ended), options, report)
    }

    /// Continues from `state`, at which steps in the pressure `ended`, to the pressure `wanted`.
    ///
    /// # Errors
    /// [`NewtonError::LimitPoint`] with the maximum of the pressure.
    fn pass_limit(
        &self,
        state: &mut [f64],
        (wanted, mut ended): (f64, Option<StopReason>),
        options: &NewtonOptions,
        report: &mut NewtonReport,
    ) -> Result<()> {
        let pressure = self.0[0].discrete.start().len();
        let limit = |state: &[f64]| {
            let most = limit::pressure(&self.0[0], state)?;
            let near = (most / state[pressure] - 1.0).abs() < AT_LIMIT;
            (most <= wanted && near).then_some(most)
        };
        let mut reached = limit(state);
        if reached.is_none() && wanted > state[pressure] {
            match self.walk_by_volume(state, wanted, options, report) {
                Ok(()) => return Ok(()),
                Err(early) => (reached, ended) = (limit(state), early.or(ended)),
            }
        }
        if reached.is_none() && wanted > state[pressure] {
            // near the largest stretch the volume hardly changes with the pressure
            match self.follow(state, Control::Load(wanted), options, report) {
                Err(NewtonError::LimitPoint { report, .. }) => {
                    (reached, ended) = (limit(state), report.stopped_by);
                }
                Err(_) => (),
                found => return found,
            }
        }
        Err(NewtonError::LimitPoint {
            quantity: Quantity::Intensity.name(Route::Inflate),
            reached: reached.unwrap_or(state[pressure]),
            wanted,
            report: NewtonReport::ended(ended.filter(|_| reached.is_none())),
        })
    }

    /// Continues from `state` by volume to the pressure `wanted`: just before a limit, or where the pressure rises very slowly with the
    /// volume, steps in the pressure fail.
    ///
    /// # Errors
    /// `None` if it stops rising, otherwise the steps are used up; `state` is then the last one in which it rose.
    fn walk_by_volume(
        &self,
        state: &mut [f64],
        wanted: f64,
        options: &NewtonOptions,
        report: &mut NewtonReport,
    ) -> Result<(), Option<StopReason>> {
        let pressure = self.0[0].discrete.start().len();
        let mut step = |state: &mut [f64], control| self.follow(state, control, options, report);
        let mut share = FIRST_STEP;
        for _ in 0..MOST_STEPS {
            let volume = Quantity::VOLUME.of(&*self.0[0].discrete, &state[..=pressure]);
            let mut next = state.to_vec();
            let further = Control::Volume(volume * (1.0 + share));
            // a step may pass the maximum and end at a higher pressure, or fail beyond the largest stretch of the rubber
            let rises = step(&mut next, further).is_ok()
                && self
                    .rate(&next, further)
                    .is_ok_and(|rate| rate[pressure] > 0.0)
                && next[pressure] > state[pressure].max(0.0);
            let passed = next[pressure] >= wanted;
            // where the pressure hardly rises with the volume it is met only from near by
            if !rises || passed && step(&mut next, Control::Load(wanted)).is_err() {
                share *= 0.25;
                if share < LEAST_STEP {
                    return Err(None);
                }
                continue;
            }
            state.copy_from_slice(&next);
            if passed {
                return Ok(());
            }
        }
        Err(Some(StopReason::LoadSteps))
    }

    /// Continues along the branch from the equilibrium `state` to the value of a control.
    fn follow(
        &self,
        state: &mut [f64],
        control: Control,
        options: &NewtonOptions,
        report: &mut NewtonReport,
    ) -> Result<()> {
        let mut system = self.system(control)?;
        let start = state.to_vec();
        let (from, to) = (system.control_value(&start), self.0[0].constraint(control)?);
        Search::new(&mut system, report).solve(state, &start, (from, to.value), options)
    }

    fn check_resolved(&self, state: &[f64]) -> Result<()> {
        let mut parts = self.parts(state);
        parts.try_for_each(|(resolution, part)| resolution.check_resolved(part))
    }

    /// Refines all membranes that can be refined, with `state` and with the curves to start `near` or their start; `None` if none can be
    /// refined.
    fn refine(&self, state: &[f64], near: &[&Equilibrium]) -> Result<Option<Refined>> {
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

    /// Returns the solution of coarser polynomials at a volume, if any. Under a load a coarse curve may be beyond a limit that fine ones do
    /// not have.
    fn coarse_start(
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

    /// Returns the solution for flat rubber without tension in the reference configuration, if `control` requires a scaled one that is `near`.
    fn solve_scaled(
        &self,
        near: &[&Equilibrium],
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Option<Solved>> {
        let [resolution] = &self.0[..] else {
            return Ok(None);
        };
        let most = swept_by_mean_radius(&resolution.start);
        let constraint = resolution.constraint(control)?;
        match resolution.volume_to_scale(constraint) {
            Some(volume) if near.iter().all(|near| near.measures.volume.abs() <= most) => {
                let (nested, volume) = (Self(self.0.clone()), Control::Volume(volume));
                let (found, state, report) =
                    nested.solve(self.start_state(), &[], volume, options)?;
                let scaled = found.0[0].scaled(state, constraint);
                Ok(scaled.map(|state| (found, state, report)))
            }
            _ => Ok(None),
        }
    }

    /// Solves at these resolutions, then at finer ones until the polynomials converge; each starts from the previous solution, if it
    /// exists. `near` is the equilibrium of `start`, unless that is the start of the solver.
    pub(crate) fn solve(
        self,
        start: Vec<f64>,
        near: &[&Equilibrium],
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Solved> {
        options.check()?;
        let tolerances = [options.residual_tolerance, options.step_tolerance];
        let [residual, step] = tolerances.map(|tolerance| tolerance.min(MISSED));
        let options = &options.with_tolerances(residual, step);
        if let Some(scaled) = self.solve_scaled(near, control, options)? {
            return Ok(scaled);
        }
        let mut report = NewtonReport::default();
        match self.refine_until_resolved(start, near, control, options, &mut report) {
            Ok((nested, state)) => Ok((nested, state, report)),
            Err(error) => Err(error.with_report(report)),
        }
    }

    fn refine_until_resolved(
        mut self,
        mut start: Vec<f64>,
        near: &[&Equilibrium],
        control: Control,
        options: &NewtonOptions,
        total: &mut NewtonReport,
    ) -> Result<(Self, Vec<f64>)> {
        let mut state = start.clone();
        if near.is_empty()
            && let Some((ahead, report)) = self.coarse_start(control, options)
        {
            (state, *total) = (ahead, report);
        }
        loop {
            let from = (&start[..], near.is_empty());
            let outcome = self.solve_here(&mut state, from, control, options, total);
            let outcome = outcome.and_then(|()| self.check_resolved(&state));
            let (carry, error) = match outcome {
                Ok(()) => return Ok((self, state)),
                Err(error @ NewtonError::Unresolved { .. }) => (true, error),
                Err(
                    error @ (NewtonError::NotConverged { .. }
                    | NewtonError::OtherBranch { .. }
                    | NewtonError::Singular { .. }),
                ) => (false, error),
                // on a resolved curve the branch ends, not the polynomials
                Err(error @ (NewtonError::LimitPoint { .. } | NewtonError::Slack { .. }))
                    if self.check_resolved(&state).is_err() =>
                {
                    (false, error)
                }
                Err(error) => return Err(error),
            };
            match self.refine(&state, near)? {
                Some(finer) => (self, state, start) = finer,
                None => return Err(error),
            }
            if !carry {
                state.copy_from_slice(&start);
            }
        }
    }
}
