//! What inflates the membrane: pressure, total force or volume as a function of time, or a pressure that answers to the
//! state.

use std::fmt;
use std::sync::Arc;

use membrane_newton::Measure;

use crate::body::MovingMembrane;
use crate::error::ImplicitError;

/// What is prescribed; the force intensity f (or p) that belongs to it is part of the solution of each step.
///
/// ```
/// use membrane_implicit::{Drive, DriveKind, Membrane, Moment, MovingMembrane, RestShape};
/// let body = MovingMembrane::new(&Membrane::new(RestShape::balloon(8.5, 1.75)?), 101)?;
/// let pressure = Drive::intensity(|t| 17.5 * (1.0 - (-t).exp()));
/// let pump = Drive::volume_gain(&body, |t| 0.3 * (1.0 - (6.8 * t).cos()));
/// assert_eq!((pressure.kind(), pump.kind()), (DriveKind::Intensity, DriveKind::Volume));
/// // Outflow through a tube of resistance 0.02 into a vessel at 10
/// let outlet = Drive::feedback(|now: &Moment| 10.0 - 0.02 * now.volume_rate);
/// let now = Moment { time: 0.0, volume: 93.0, volume_rate: -50.0 };
/// assert_eq!(outlet.at(&now)?, 11.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Drive {
    kind: DriveKind,
    source: Source,
}

type Signal = dyn Fn(f64) -> f64 + Send + Sync;

#[derive(Clone)]
enum Source {
    Time(Arc<Signal>),
    State(Box<dyn Model>),
}

/// Which quantity a [`Drive`] prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveKind {
    /// Force intensity: f per unit of material length, or p per unit of current length.
    Intensity,
    /// Total force: intensity times the lateral surface of revolution (Eq. 4).
    TotalForce,
    /// Enclosed volume of revolution, cm^3.
    Volume,
    /// Force intensity, as an answer to volume and flow ([`Feedback`]).
    Feedback,
}

/// The (inner) membrane as a drive sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time, s.
    pub time: f64,
    /// Enclosed volume V, cm^3.
    pub volume: f64,
    /// dV/dt, cm^3/s: the flow into the membrane, negative while it empties.
    pub volume_rate: f64,
}

impl Moment {
    /// Of the membrane through `nodes` at as many `velocities`, flat.
    pub(crate) fn of(time: f64, nodes: &[f64], velocities: &[f64]) -> Self {
        let (points, moving) = (nodes.as_chunks().0, velocities.as_chunks().0);
        Self {
            time,
            volume: Measure::Volume.of(points),
            volume_rate: Measure::Volume.rate(points, moving).unwrap_or(f64::NAN),
        }
    }
}

/// A pressure that answers to the state: an own afterload, valve or vessel.
///
/// Every closure from a [`Moment`] to a number is one. A model with a memory of its own keeps it in `self`, which
/// [`Feedback::accepted`] brings up to date once a step; within a step the memory stays, however often the step is tried.
///
/// ```
/// use membrane_implicit::{Drive, Feedback, Membrane, Moment, Motion, MovingMembrane, RestShape};
/// use membrane_implicit::{Scheme, Stop, TimeStep};
///
/// /// A closed elastic vessel that the membrane empties into: C p' = -V' - p / R, by backward Euler.
/// #[derive(Clone)]
/// struct Windkessel { compliance: f64, resistance: f64, pressure: f64, last: Option<Moment> }
///
/// impl Feedback for Windkessel {
///     fn intensity(&self, now: &Moment) -> f64 {
///         let Some(last) = self.last else { return self.pressure };
///         let ejected = last.volume - now.volume;
///         let leak = (now.time - last.time) / self.resistance;
///         (self.compliance * self.pressure + ejected) / (self.compliance + leak)
///     }
///     fn accepted(&mut self, now: &Moment) {
///         self.pressure = self.intensity(now);
///         self.last = Some(*now);
///     }
/// }
///
/// let body = MovingMembrane::new(&Membrane::new(RestShape::balloon(8.5, 1.75)?), 51)?.with_damping(1.0)?;
/// let vessel = Windkessel { compliance: 4.0, resistance: 5.0, pressure: 10.0, last: None };
/// let mut motion = Motion::new(body, Drive::feedback(vessel), Scheme::TrBdf2)?;
/// motion.run(TimeStep::Fixed(0.01), &[Stop::Time(1.0)])?;
/// assert!(motion.state().intensity < 10.0); // it has emptied into the membrane
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Feedback {
    /// The force intensity f (or p) at this moment. It is asked for several times a step, also at moments that are not
    /// accepted; a value that is not finite is an error of the step.
    fn intensity(&self, now: &Moment) -> f64;

    /// The state at the beginning, then after every step.
    fn accepted(&mut self, now: &Moment) {
        let _ = now;
    }
}

impl<F: Fn(&Moment) -> f64> Feedback for F {
    fn intensity(&self, now: &Moment) -> f64 {
        self(now)
    }
}

/// A [`Feedback`] that a motion and its copies own.
trait Model: Feedback + Send + Sync {
    fn boxed(&self) -> Box<dyn Model>;
}

impl<M: Feedback + Clone + Send + Sync + 'static> Model for M {
    fn boxed(&self) -> Box<dyn Model> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Model> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

impl fmt::Debug for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive")
            .field("kind", &self.kind)
            .finish_non_exhaustive()
    }
}

impl Drive {
    fn signal(kind: DriveKind, signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        let source = Source::Time(Arc::new(signal));
        Self { kind, source }
    }

    /// Force intensity f(t), or p(t) under the law per current length.
    pub fn intensity(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(DriveKind::Intensity, signal)
    }

    /// Total force F(t).
    pub fn total_force(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(DriveKind::TotalForce, signal)
    }

    /// Enclosed volume V(t) in cm^3: a pump. The pressure becomes an unknown of each step.
    ///
    /// V and V' at the first instant should be those of the initial shape and velocity; otherwise
    /// the first step makes up for the difference by an impulse.
    pub fn volume(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(DriveKind::Volume, signal)
    }

    /// Volume gain: V(t) = (1 + gain(t)) times the volume that `body` encloses at rest.
    pub fn volume_gain(
        body: &MovingMembrane,
        gain: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let rest = body.start_volume();
        Self::volume(move |t| rest * (1.0 + gain(t)))
    }

    /// Force intensity as an answer to volume and flow; an implicit scheme solves for both together, with its full order.
    /// Splittings cannot.
    pub fn feedback(model: impl Feedback + Clone + Send + Sync + 'static) -> Self {
        Self {
            kind: DriveKind::Feedback,
            source: Source::State(Box::new(model)),
        }
    }

    /// Which quantity is prescribed.
    pub fn kind(&self) -> DriveKind {
        self.kind
    }

    /// The value prescribed at this moment; functions of time see its time alone.
    ///
    /// # Errors
    /// The value is not finite there, or a volume not positive.
    pub fn at(&self, now: &Moment) -> Result<f64, ImplicitError> {
        let given = self.value(now);
        if given.is_finite() && (self.kind != DriveKind::Volume || given > 0.0) {
            Ok(given)
        } else {
            let time = now.time;
            Err(ImplicitError::BadDrive { time, given })
        }
    }

    pub(crate) fn value(&self, now: &Moment) -> f64 {
        match &self.source {
            Source::Time(signal) => signal(now.time),
            Source::State(model) => model.intensity(now),
        }
    }

    /// Tells a model of its own what state has been reached.
    pub(crate) fn accepted(&mut self, state: impl FnOnce() -> Moment) {
        if let Source::State(model) = &mut self.source {
            model.accepted(&state());
        }
    }
}
