//! Two membranes with incompressible wall between them, solved together.

use std::sync::Arc;

use crate::border::dot;
use crate::bordered::{Bordered, nan_max};
use crate::continuation::{self, Controlled, Reach};
use crate::control::{Control, Target};
use crate::equilibrium::Equilibrium;
use crate::error::NewtonError;
use crate::layers::{Refined, refine, solve_refining};
use crate::newton::ResidualSystem;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;
use crate::resolution::Resolution;
use crate::sensitivity::Sensitivity;
use crate::solver::Solver;
use membrane_forces::Measure;

/// An inner and an outer membrane; the volume between them stays what it is at the start.
#[derive(Debug, Clone)]
pub struct Pair {
    inner: Solver,
    outer: Solver,
}

/// Both membranes in equilibrium at the same wall volume as at the start.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct PairEquilibrium {
    /// The inner membrane.
    pub inner: Equilibrium,
    /// The outer membrane.
    pub outer: Equilibrium,
    /// Volume between them, cm^3.
    pub wall_volume: f64,
    /// Relative departure of the wall volume from that of the start.
    pub wall_volume_error: f64,
    /// What the solve did; the reports of `inner` and `outer` are empty.
    pub report: NewtonReport,
}

impl Pair {
    /// Joins two discretised membranes.
    ///
    /// # Errors
    /// [`NewtonError::NotEnclosed`]: the outer one does not enclose more volume than the inner one.
    pub fn new(inner: Solver, outer: Solver) -> Result<Self, NewtonError> {
        let pair = Self { inner, outer };
        if pair.wall_volume() > 0.0 {
            Ok(pair)
        } else {
            Err(NewtonError::NotEnclosed {
                inner: pair.inner.start_measures().volume,
                outer: pair.outer.start_measures().volume,
            })
        }
    }

    /// The inner membrane.
    pub fn inner(&self) -> &Solver {
        &self.inner
    }

    /// The outer membrane.
    pub fn outer(&self) -> &Solver {
        &self.outer
    }

    /// Volume between the membranes at the start, cm^3.
    pub fn wall_volume(&self) -> f64 {
        self.coarsest().wall_volume()
    }

    fn coarsest(&self) -> PairResolution {
        PairResolution {
            inner: self.inner.resolution.clone(),
            outer: self.outer.resolution.clone(),
        }
    }

    /// Both shapes at a volume gain of the inner membrane, from the start.
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve_gain(
        &self,
        gain: f64,
        options: &NewtonOptions,
    ) -> Result<PairEquilibrium, NewtonError> {
        self.solve(Control::VolumeGain(gain), options)
    }

    /// Both shapes under a control of the inner membrane, from the start.
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve(
        &self,
        inner: Control,
        options: &NewtonOptions,
    ) -> Result<PairEquilibrium, NewtonError> {
        let resolution = self.coarsest();
        let state = resolution.join(
            resolution.inner.start_state(),
            &resolution.outer.start_state(),
        );
        solve_on((resolution, state), None, inner, options)
    }

    /// The same from a nearby solution (warm start).
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve_from(
        &self,
        near: &PairEquilibrium,
        inner: Control,
        options: &NewtonOptions,
    ) -> Result<PairEquilibrium, NewtonError> {
        let (inner_resolution, inner_state) = self.inner.resolution.state_near(&near.inner);
        let (outer_resolution, outer_state) = self.outer.resolution.state_near(&near.outer);
        let resolution = PairResolution {
            inner: inner_resolution,
            outer: outer_resolution,
        };
        let state = resolution.join(inner_state, &outer_state);
        solve_on((resolution, state), Some(near), inner, options)
    }
}

fn solve_on(
    (resolution, start): (PairResolution, Vec<f64>),
    near: Option<&PairEquilibrium>,
    control: Control,
    options: &NewtonOptions,
) -> Result<PairEquilibrium, NewtonError> {
    let (resolution, state, report) = solve_refining(
        (resolution, start),
        |resolution, state, start| resolution.solve(state, start, control, options),
        PairResolution::check_resolved,
        |resolution, state| resolution.refine(state, near),
    )?;
    let (inner, outer) = state.split_at(resolution.split());
    // The report is the pair's.
    let answer = |resolution: &Arc<Resolution>, part: &[f64]| {
        resolution.answer(part.to_vec(), NewtonReport::default())
    };
    let (inner, outer) = (
        answer(&resolution.inner, inner)?,
        answer(&resolution.outer, outer)?,
    );
    let wall_volume = outer.measures.volume - inner.measures.volume;
    let wall_volume_error = wall_volume / resolution.wall_volume() - 1.0;
    Ok(PairEquilibrium {
        inner,
        outer,
        wall_volume,
        wall_volume_error,
        report,
    })
}

impl PairEquilibrium {
    /// Derivatives of the inner and of the outer membrane by the value of the inner one's
    /// `control`, the wall keeping its volume; see [`Equilibrium::sensitivity`].
    ///
    /// # Errors
    /// As [`Equilibrium::sensitivity`].
    pub fn sensitivity(&self, control: Control) -> Result<[Sensitivity; 2], NewtonError> {
        let resolution = PairResolution {
            inner: self.inner.resolution.clone(),
            outer: self.outer.resolution.clone(),
        };
        let mut system = resolution.system(resolution.inner.target(control)?);
        system.factor(&resolution.join(self.inner.state.clone(), &self.outer.state))?;
        let (inner, outer) = (self.inner.state.len(), self.outer.state.len());
        let mut change = vec![0.0; inner + outer];
        change[inner - 1] = resolution.inner.target_slope(control);
        system.solve_in_place(&mut change)?;
        let (inner, outer) = change.split_at(inner);
        Ok([
            resolution.inner.sensitivity(inner),
            resolution.outer.sensitivity(outer),
        ])
    }
}

/// Both membranes at one resolution each.
struct PairResolution {
    inner: Arc<Resolution>,
    outer: Arc<Resolution>,
}

impl PairResolution {
    fn split(&self) -> usize {
        self.inner.discrete.start().len() + 1
    }

    fn join(&self, mut inner: Vec<f64>, outer: &[f64]) -> Vec<f64> {
        inner.extend(outer);
        inner
    }

    fn system(&self, target: Target) -> PairSystem<'_> {
        PairSystem {
            inner: self.inner.system(target),
            outer: self.outer.system(Target::Measure(Measure::Volume, 0.0)),
            wall_volume: self.wall_volume(),
            volume_row: vec![0.0; self.split() - 1],
        }
    }

    /// Volume between the membranes at the start, as this resolution has it.
    fn wall_volume(&self) -> f64 {
        self.outer.start.volume - self.inner.start.volume
    }

    fn solve(
        &self,
        state: &mut [f64],
        start: &[f64],
        control: Control,
        options: &NewtonOptions,
    ) -> Result<NewtonReport, NewtonError> {
        let target = self.inner.target(control)?;
        let mut system = self.system(target);
        let from = system.inner.target_value(&start[..self.split()]);
        continuation::solve(&mut system, state, start, (from, target.value()), options)
    }

    fn check_resolved(&self, state: &[f64]) -> Result<(), NewtonError> {
        let (inner, outer) = state.split_at(self.split());
        self.inner.check_resolved(inner)?;
        self.outer.check_resolved(outer)
    }

    /// Both membranes one resolution finer, as far as each can go.
    fn refine(&self, state: &[f64], near: Option<&PairEquilibrium>) -> Refined<Self> {
        let (inner, outer) = state.split_at(self.split());
        let step = |resolution: &Arc<Resolution>, state: &[f64], near: Option<&Equilibrium>| {
            let stay = || {
                Ok((
                    resolution.clone(),
                    state.to_vec(),
                    resolution.start_near(near),
                ))
            };
            let up = refine(resolution, state, near);
            (up.is_some(), up.unwrap_or_else(stay))
        };
        let (up, inner) = step(&self.inner, inner, near.map(|n| &n.inner));
        let (also, outer) = step(&self.outer, outer, near.map(|n| &n.outer));
        (up || also).then(|| {
            let (inner, state, start) = inner?;
            let (outer, outer_state, outer_start) = outer?;
            let resolution = Self { inner, outer };
            let state = resolution.join(state, &outer_state);
            let start = resolution.join(start, &outer_start);
            Ok((resolution, state, start))
        })
    }
}

/// Unknowns (c, f) of the inner and of the outer membrane. The inner border equation is its
/// control; the outer one, V_outer - V_inner = wall volume, couples the two in one direction.
struct PairSystem<'a> {
    inner: Bordered<'a>,
    outer: Bordered<'a>,
    wall_volume: f64,
    /// dV_inner / dc_inner
    volume_row: Vec<f64>,
}

impl PairSystem<'_> {
    fn split(&self) -> usize {
        self.inner.len()
    }

    /// The outer volume that goes with the inner one in state `x`.
    fn couple(&mut self, x: &[f64]) {
        let volume = self.inner.volume(&x[..self.split() - 1]);
        self.outer.target = Target::Measure(Measure::Volume, volume + self.wall_volume);
    }
}

impl ResidualSystem for PairSystem<'_> {
    fn len(&self) -> usize {
        self.inner.len() + self.outer.len()
    }

    fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
        let split = self.split();
        self.couple(x);
        self.inner.residual_into(&x[..split], &mut out[..split])?;
        self.outer.residual_into(&x[split..], &mut out[split..])
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), NewtonError> {
        let split = self.split();
        self.inner.factor(&x[..split])?;
        self.inner
            .volume_gradient_into(&x[..split - 1], &mut self.volume_row);
        self.outer.factor(&x[split..])
    }

    fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        let (inner, outer) = rhs.split_at_mut(self.inner.len());
        self.inner.solve_in_place(inner)?;
        let last = outer.len() - 1;
        outer[last] += dot(&self.volume_row, &inner[..self.volume_row.len()]);
        self.outer.solve_in_place(outer)
    }

    fn residual_norm(&self, residual: &[f64]) -> f64 {
        let (inner, outer) = residual.split_at(self.split());
        nan_max(
            self.inner.residual_norm(inner),
            self.outer.residual_norm(outer),
        )
    }

    fn step_norm(&self, step: &[f64]) -> f64 {
        let (inner, outer) = step.split_at(self.split());
        nan_max(self.inner.step_norm(inner), self.outer.step_norm(outer))
    }
}

impl Controlled for PairSystem<'_> {
    fn set_control(&mut self, value: f64) {
        self.inner.set_control(value);
    }

    fn misses(&mut self, x: &[f64]) -> f64 {
        self.couple(x);
        let (inner, outer) = x.split_at(self.split());
        nan_max(self.inner.misses(inner), self.outer.misses(outer))
    }

    fn keeps_sign(&self) -> bool {
        self.inner.keeps_sign() && self.outer.keeps_sign()
    }

    fn within(&self, reach: Reach, from: &[f64], to: &[f64]) -> bool {
        let split = self.split();
        self.inner.within(reach, &from[..split], &to[..split])
            && self.outer.within(reach, &from[split..], &to[split..])
    }

    fn rate_into(&mut self, out: &mut [f64]) -> Result<(), NewtonError> {
        out.fill(0.0);
        out[self.split() - 1] = 1.0;
        self.solve_in_place(out)
    }

    fn shape_norm(&self, change: &[f64]) -> f64 {
        let (inner, outer) = change.split_at(self.split());
        nan_max(self.inner.shape_norm(inner), self.outer.shape_norm(outer))
    }
}
