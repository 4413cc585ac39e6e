//! One resolution of a membrane, and the finer one to go to when it does not suffice.

use std::sync::{Arc, OnceLock};

use membrane_forces::{FiniteDifferences, Measures, Membrane, MembraneError, SpectralElements};

use crate::bordered::Bordered;
use crate::continuation;
use crate::control::{Control, Target};
use crate::discrete::Discrete;
use crate::error::NewtonError;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;

#[derive(Debug)]
pub(crate) struct Resolution {
    pub(crate) membrane: Membrane,
    pub(crate) discrete: Discrete,
    pub(crate) start: Measures,
    /// What to do when the polynomials leave a tail.
    pub(crate) adaptive: Option<Adaptive>,
}

#[derive(Debug)]
pub(crate) struct Adaptive {
    tolerance: f64,
    level: usize,
    pub(crate) finer: OnceLock<Result<Arc<Resolution>, MembraneError>>,
}

/// Degree and elements on each smooth piece: first the degree rises, then the elements split.
const STEPS: [(usize, usize); 9] = [
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

impl Resolution {
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

    /// The first with which the start itself is resolved.
    pub(crate) fn adaptive(membrane: &Membrane, tolerance: f64) -> Result<Arc<Self>, NewtonError> {
        let mut resolution = Arc::new(Self::step(membrane, tolerance, 0)?);
        while let Err(unresolved) = resolution.check_resolved(&resolution.start_state()) {
            resolution = resolution.finer().unwrap_or(Err(unresolved))?;
        }
        Ok(resolution)
    }

    fn step(membrane: &Membrane, tolerance: f64, level: usize) -> Result<Self, MembraneError> {
        let (degree, per_piece) = STEPS[level];
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

    /// The next finer one, made the first time it is asked for; none past the finest, without
    /// a tolerance, or if there is no room for it.
    pub(crate) fn finer(&self) -> Option<Result<Arc<Self>, NewtonError>> {
        let adaptive = self.adaptive.as_ref()?;
        let level = adaptive.level + 1;
        if level == STEPS.len() {
            return None;
        }
        let made = || Self::step(&self.membrane, adaptive.tolerance, level).map(Arc::new);
        match adaptive.finer.get_or_init(made).clone() {
            Err(MembraneError::TooMany { .. }) => None,
            finer => Some(finer.map_err(NewtonError::from)),
        }
    }

    /// Whether the polynomials of `state` have converged: their degree times their last two
    /// coefficients, over the length of the curve, against the tolerance.
    pub(crate) fn check_resolved(&self, state: &[f64]) -> Result<(), NewtonError> {
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

    /// Solves at this resolution alone.
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
}

/// Refuses a curve whose volume, say, is beyond the largest number: one of 1e103 cm.
pub(crate) fn finite(measures: &Measures) -> Result<(), MembraneError> {
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
