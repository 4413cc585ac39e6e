//! One resolution of a membrane, and the finer one to go to when it does not suffice.

use std::sync::{Arc, OnceLock};

use membrane_forces::{
    FiniteDifferences, LoadKind, Measures, Membrane, MembraneError, SpectralElements,
};

use crate::bordered::Bordered;
use crate::continuation;
use crate::control::{Control, Target};
use crate::discrete::Discrete;
use crate::equilibrium::Equilibrium;
use crate::error::NewtonError;
use crate::options::{NewtonOptions, NewtonReport};

#[derive(Debug)]
pub(crate) struct Plan {
    pub(crate) membrane: Membrane,
    pub(crate) discrete: Discrete,
    pub(crate) start: Measures,
    /// What to do when the polynomials leave a tail.
    adaptive: Option<Adaptive>,
}

#[derive(Debug)]
struct Adaptive {
    tolerance: f64,
    level: usize,
    finer: OnceLock<Result<Arc<Plan>, MembraneError>>,
}

/// A finer rung, if there is one, with the solved state carried over to it and with its start.
pub(crate) type Refined<R> = Option<Result<(R, Vec<f64>, Vec<f64>), NewtonError>>;

/// Degree and elements on each smooth piece: first the degree rises, then the elements split.
const LADDER: [(usize, usize); 9] = [
    (8, 1),
    (12, 1),
    (16, 1),
    (24, 1),
    (24, 2),
    (24, 4),
    (24, 8),
    (24, 16),
    (24, 32),
];

impl Plan {
    pub(crate) fn differences(membrane: &Membrane, nodes: usize) -> Result<Self, MembraneError> {
        let discrete = Discrete::Differences(FiniteDifferences::half(membrane, nodes)?);
        Self::new(membrane, discrete, None)
    }

    pub(crate) fn spectral(
        membrane: &Membrane,
        degree: usize,
        per_piece: usize,
    ) -> Result<Self, MembraneError> {
        let discrete = Discrete::Spectral(SpectralElements::new(membrane, degree, per_piece)?);
        Self::new(membrane, discrete, None)
    }

    /// The first rung on which the start itself is resolved.
    pub(crate) fn adaptive(membrane: &Membrane, tolerance: f64) -> Result<Arc<Self>, NewtonError> {
        let mut rung = Arc::new(Self::rung(membrane, tolerance, 0)?);
        while let Err(unresolved) = rung.resolution(&rung.start_state()) {
            rung = rung.finer().unwrap_or(Err(unresolved))?;
        }
        Ok(rung)
    }

    fn rung(membrane: &Membrane, tolerance: f64, level: usize) -> Result<Self, MembraneError> {
        let (degree, per_piece) = LADDER[level];
        let discrete = Discrete::Spectral(SpectralElements::new(membrane, degree, per_piece)?);
        let adaptive = Adaptive {
            tolerance,
            level,
            finer: OnceLock::new(),
        };
        Self::new(membrane, discrete, Some(adaptive))
    }

    fn new(
        membrane: &Membrane,
        discrete: Discrete,
        adaptive: Option<Adaptive>,
    ) -> Result<Self, MembraneError> {
        let start = discrete.measures(discrete.start());
        finite(&start)?;
        Ok(Self {
            membrane: membrane.clone(),
            discrete,
            start,
            adaptive,
        })
    }

    /// The next rung of the ladder, made the first time it is asked for; none at its top, without
    /// a tolerance, or if there is no room for it.
    pub(crate) fn finer(&self) -> Option<Result<Arc<Self>, NewtonError>> {
        let adaptive = self.adaptive.as_ref()?;
        let level = adaptive.level + 1;
        if level == LADDER.len() {
            return None;
        }
        let made = || Self::rung(&self.membrane, adaptive.tolerance, level).map(Arc::new);
        match adaptive.finer.get_or_init(made).clone() {
            Err(MembraneError::TooMany { .. }) => None,
            finer => Some(finer.map_err(NewtonError::from)),
        }
    }

    /// Whether the polynomials of `state` have converged: their degree times their last two
    /// coefficients, over the length of the curve, against the tolerance.
    pub(crate) fn resolution(&self, state: &[f64]) -> Result<(), NewtonError> {
        let Some(Adaptive { tolerance, .. }) = self.adaptive else {
            return Ok(());
        };
        let nodes = &state[..state.len() - 1];
        let scale = self
            .discrete
            .measure(membrane_forces::Measure::Length, nodes);
        let tail = self.discrete.tail(nodes) / scale;
        if tail <= tolerance {
            Ok(())
        } else {
            Err(NewtonError::Unresolved { tail, tolerance })
        }
    }

    pub(crate) fn target(&self, control: Control) -> Result<Target, NewtonError> {
        Target::new(control, &self.discrete, &self.start)
    }

    pub(crate) fn system(&self, target: Target) -> Bordered<'_> {
        Bordered::new(&self.discrete, self.start.length, target)
    }

    /// Nodes, then the force intensity.
    pub(crate) fn start_state(&self) -> Vec<f64> {
        let mut state = self.discrete.start().to_vec();
        state.push(0.0);
        state
    }

    /// The state that follows `curve`, which need not be of this plan.
    pub(crate) fn state_near(self: &Arc<Self>, curve: &Equilibrium) -> (Arc<Self>, Vec<f64>) {
        let mut rung = self.clone();
        loop {
            if Arc::ptr_eq(&rung, &curve.plan) {
                return (rung, curve.state.clone());
            }
            let next = rung
                .adaptive
                .as_ref()
                .and_then(|a| a.finer.get())
                .and_then(|f| f.clone().ok());
            match next {
                Some(finer) => rung = finer,
                None => break,
            }
        }
        (self.clone(), self.follow(curve))
    }

    /// Where the curve `near` is, or the start.
    pub(crate) fn start_near(&self, near: Option<&Equilibrium>) -> Vec<f64> {
        near.map_or_else(|| self.start_state(), |near| self.follow(near))
    }

    /// The nodes of this plan on `curve`, and its intensity.
    fn follow(&self, curve: &Equilibrium) -> Vec<f64> {
        let positions = self.discrete.positions();
        let count = self.discrete.start().len() / 2;
        let mut state = Vec::with_capacity(2 * count + 1);
        for &s in &positions[..count] {
            state.extend(curve.at(s).position);
        }
        self.discrete.hold(&mut state);
        state.push(curve.intensity);
        state
    }

    /// Solves on this rung alone.
    pub(crate) fn solve(
        &self,
        state: &mut [f64],
        start: &[f64],
        control: Control,
        options: &NewtonOptions,
    ) -> Result<NewtonReport, NewtonError> {
        let target = self.target(control)?;
        let mut system = self.system(target);
        let from = system.target_value(start);
        continuation::solve(&mut system, state, start, (from, target.value()), options)
    }

    /// What a solve ended in, unless it is too large for its measures to be numbers.
    pub(crate) fn answer(
        self: &Arc<Self>,
        state: Vec<f64>,
        report: NewtonReport,
    ) -> Result<Equilibrium, NewtonError> {
        let solved = self.equilibrium(state, report);
        finite(&solved.measures)?;
        Ok(solved)
    }

    pub(crate) fn equilibrium(
        self: &Arc<Self>,
        state: Vec<f64>,
        report: NewtonReport,
    ) -> Equilibrium {
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let measures = self.discrete.measures(nodes);
        let load = match self.discrete.law().load_kind() {
            LoadKind::Intensity => intensity,
            LoadKind::TotalForce => intensity * measures.surface,
        };
        Equilibrium {
            intensity,
            load,
            measures,
            report,
            plan: self.clone(),
            state,
        }
    }
}

/// Refuses a curve whose volume, say, is beyond the largest number: one of 1e103 cm.
fn finite(measures: &Measures) -> Result<(), MembraneError> {
    let Measures {
        length,
        area,
        surface,
        volume,
    } = *measures;
    for (quantity, value) in [
        ("length of the curve", length),
        ("area of the curve", area),
        ("surface of the curve", surface),
        ("volume of the curve", volume),
    ] {
        if !value.is_finite() {
            return Err(MembraneError::NotFinite { quantity, value });
        }
    }
    Ok(())
}

/// The next rung, with `state` carried over to it, and with the curve to start `near` or its start.
pub(crate) fn refine(
    plan: &Arc<Plan>,
    state: &[f64],
    near: Option<&Equilibrium>,
) -> Refined<Arc<Plan>> {
    Some(plan.finer()?.map(|finer| {
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let mut carried = finer.discrete.sample(&plan.discrete.pieces(nodes));
        carried.push(intensity);
        let start = finer.start_near(near);
        (finer, carried, start)
    }))
}

/// Solves on a rung, then on finer ones until the polynomials have converged; each begins with
/// what the one before has found, unless that failed. `solve` works on one rung, from its second state or, what
/// comes to the same, its third; `refine` climbs.
pub(crate) fn climb<R>(
    (mut rung, mut start): (R, Vec<f64>),
    solve: impl Fn(&R, &mut [f64], &[f64]) -> Result<NewtonReport, NewtonError>,
    resolution: impl Fn(&R, &[f64]) -> Result<(), NewtonError>,
    refine: impl Fn(&R, &[f64]) -> Refined<R>,
) -> Result<(R, Vec<f64>, NewtonReport), NewtonError> {
    let mut total = NewtonReport::default();
    let mut state = start.clone();
    loop {
        let mut outcome = solve(&rung, &mut state, &start);
        if let Some(report) = outcome.as_mut().map_or_else(NewtonError::report_mut, Some) {
            report.add_earlier(&total);
            total.clone_from(report);
        }
        let outcome = outcome.and_then(|_| resolution(&rung, &state));
        let carry = match outcome {
            Ok(()) => return Ok((rung, state, total)),
            Err(NewtonError::Unresolved { .. }) => true,
            Err(
                NewtonError::NotConverged { .. }
                | NewtonError::OtherBranch { .. }
                | NewtonError::Singular { .. },
            ) => false,
            // where the curve is resolved it is the branch that ends, not the polynomials
            Err(NewtonError::LimitPoint { .. }) if resolution(&rung, &state).is_err() => false,
            Err(error) => return Err(error),
        };
        match refine(&rung, &state) {
            Some(finer) => (rung, state, start) = finer?,
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
