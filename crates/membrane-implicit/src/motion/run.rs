//! Runs until a condition is met.

use std::convert::Infallible;
use std::ops::ControlFlow;

use membrane_newton::MembraneError;

use super::{Motion, Tolerance};
use crate::error::{ImplicitError, Result, positive};

/// The rule for the length of the steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum TimeStep {
    /// Constant, except for a last step shortened to end at a [`Stop::Time`] or a [`Stop::Volume`]. A step longer than the run is shortened to
    /// the run, which then consists of one step.
    ///
    /// The error of the steps is not estimated, and [`Energy::imbalance`](crate::Energy::imbalance) is only the rounding error of the
    /// balance: tiny also for steps that resolve nothing. Repeat the run with half the step; the results differ by (1 - 2^-p) times the
    /// error of the longer step at order p. Without damping, a sudden load excites all modes of the membrane, and results converge only
    /// once the steps resolve them: use a ramp of the load, or damping.
    ///
    /// An explicit scheme rejects steps above its stability limit ([`Scheme`](crate::Scheme)).
    Fixed(f64),
    /// As long as the local error allows.
    Adaptive(Tolerance),
}

/// A condition that ends a run. All except the equilibrium are also tested before the first step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Stop {
    /// Exactly at this time; a run that starts within 1e-12 of it, by rounding of earlier steps, makes no step.
    Time(f64),
    /// When the (inner) volume passes this value, cm^3: the last step ends there, to 1e-10 of the volume. A run to a volume that the motion
    /// never reaches has no end; add a [`Stop::Time`], [`Stop::Steps`] or [`Stop::Equilibrium`] to bound it. A passage and return
    /// within one step counts if the volume goes beyond the value by more than the error, O(dt^4), of a cubic in time between
    /// the volumes and flows at the ends of the step.
    Volume(f64),
    /// When the norms over s of the total force F_p + F_e and of the velocity are at most this, for both membranes of a pair, after the
    /// first or a later step of the run: under a load that begins at zero both norms are initially zero. A load that is still zero after the
    /// first step ends the run there: run to the time at which it rises first ([`Stop::Time`]).
    Equilibrium {
        /// Bound on (integral of |F_p + F_e|^2 ds)^(1/2).
        force: f64,
        /// Bound on (integral of |v|^2 ds)^(1/2).
        speed: f64,
    },
    /// After this number of steps.
    Steps(usize),
}

/// Relative rounding of a time after many steps.
const ROUNDING: f64 = 1e-12;

impl Motion {
    /// Makes steps until the first of `stops` is met; returns its index. Include a [`Stop::Time`] or [`Stop::Steps`]: the others may never be
    /// met.
    ///
    /// ```
    /// # use membrane_implicit::{Load, Membrane, Motion, Body, ReferenceShape, Scheme, Stop, TimeStep};
    /// # let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    /// # let body = Body::springs(&membrane, 51)?.with_damping(1.0)?;
    /// let drive = Load::intensity(|t| 17.5 * (1.0 - (-t).exp())); // no load at t = 0
    /// let mut motion = Motion::new(body, drive, Scheme::TrBdf2)?;
    /// let settled = Stop::Equilibrium { force: 1e-6, speed: 1e-6 };
    /// assert_eq!(motion.run(TimeStep::Fixed(1.0), &[settled, Stop::Time(1000.0)])?, 0);
    /// assert!((motion.state().volume() - 148.8).abs() < 0.2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Motion::step`], of which a fixed step out of range is found before the first step; no stop given.
    pub fn run(&mut self, steps: TimeStep, stops: &[Stop]) -> Result<usize> {
        match self.run_observed(steps, stops, |_| ControlFlow::<Infallible>::Continue(()))? {
            ControlFlow::Continue(index) => Ok(index),
            ControlFlow::Break(never) => match never {},
        }
    }

    /// As [`Motion::run`], with a callback `observe` after every step, which can stop the run by a value. There [`Motion::at_into`] gives
    /// the shape at any time within the step.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// # use membrane_implicit::{Load, Membrane, Motion, Body, ReferenceShape, Scheme, Stop, TimeStep};
    /// # let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    /// # let body = Body::springs(&membrane, 51)?.with_damping(1.0)?;
    /// let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::TrBdf2)?;
    /// let ended = motion.run_observed(TimeStep::Fixed(0.01), &[Stop::Time(10.0)], |motion| {
    ///     println!("{:.2} s: {:.1} cm^3", motion.time(), motion.state().volume());
    ///     // the first time it swings back
    ///     if motion.state().volume_rate() < 0.0 { ControlFlow::Break(motion.time()) } else { ControlFlow::Continue(()) }
    /// })?;
    /// assert!(matches!(ended, ControlFlow::Break(time) if (0.2..2.0).contains(&time)), "{ended:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Motion::run`].
    pub fn run_observed<B>(
        &mut self,
        steps: TimeStep,
        stops: &[Stop],
        mut observe: impl FnMut(&Self) -> ControlFlow<B>,
    ) -> Result<ControlFlow<B, usize>> {
        if stops.is_empty() {
            return Err(ImplicitError::NoStops);
        }
        match steps {
            TimeStep::Fixed(dt) => self.check_fixed(dt)?,
            TimeStep::Adaptive(tolerance) => tolerance.check(&self.inner.body)?,
        }
        let first = self.work().steps;
        let mut end = f64::INFINITY;
        for stop in stops {
            match *stop {
                Stop::Time(time) => {
                    let least = self.time() - ROUNDING * self.time().abs();
                    end = end.min(MembraneError::within("end time", time, least, f64::MAX)?);
                }
                Stop::Volume(volume) => drop(positive("volume", volume)?),
                Stop::Equilibrium { force, speed } => {
                    MembraneError::within("force at equilibrium", force, 0.0, f64::MAX)?;
                    MembraneError::within("speed at equilibrium", speed, 0.0, f64::MAX)?;
                }
                Stop::Steps(_) => (),
            }
        }
        loop {
            if let Some(index) = self.stopped(stops, first)? {
                return Ok(ControlFlow::Continue(index));
            }
            let left = end - self.time();
            let mut dt = match steps {
                TimeStep::Fixed(dt) => {
                    // the last step is shortened, but not because of rounding of the time
                    let dt = if dt * (1.0 - 1e-9) < left { dt } else { left };
                    self.attempt(dt)?;
                    dt
                }
                TimeStep::Adaptive(tolerance) => self.attempt_adaptive(&tolerance, left)?,
            };
            for stop in stops {
                if let Stop::Volume(volume) = *stop {
                    dt = self.land_on_volume(volume, dt)?;
                }
            }
            let reached = self.inner.end().time;
            let rounding = (1e-9 * dt).max(ROUNDING * reached.abs());
            self.accept(((end - reached).abs() <= rounding).then_some(end))?;
            if let ControlFlow::Break(value) = observe(self) {
                return Ok(ControlFlow::Break(value));
            }
        }
    }

    /// Returns the first of `stops` that is met, in a run from the step `first`.
    fn stopped(&mut self, stops: &[Stop], first: usize) -> Result<Option<usize>> {
        let taken = self.work().steps - first;
        for (index, stop) in stops.iter().enumerate() {
            let reached = match *stop {
                Stop::Time(time) => self.time() >= time - ROUNDING * time.abs(),
                Stop::Volume(volume) => (self.state().volume() / volume - 1.0).abs() <= 1e-10,
                Stop::Steps(steps) => taken >= steps,
                Stop::Equilibrium { .. } if taken == 0 => false,
                Stop::Equilibrium { force, speed } => {
                    let (f, s) = self.norms()?;
                    f <= force && s <= speed
                }
            };
            if reached {
                return Ok(Some(index));
            }
        }
        Ok(None)
    }
}
