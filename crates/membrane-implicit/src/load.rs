//! Loads of a moving membrane: force intensity, total force or volume as a function of time, or an intensity as a function of the state.

use std::fmt;
use std::sync::Arc;

use crate::body::{Body, LoadState};
use crate::error::{ImplicitError, Result};
use crate::scheme::LoadKind;

/// A prescribed quantity; the force intensity f (or p) that belongs to it is part of the solution of each step. If its function panics in a step, the
/// motion remains in the state before that step and can continue.
///
/// ```
/// use membrane_implicit::{Body, Load, LoadState, Membrane, PressureLaw, ReferenceShape};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
/// let body = Body::springs(&membrane.with_law(PressureLaw::PerCurrentLength), 101)?;
/// let pressure = Load::intensity(|t| 0.7 * (1.0 - (-t).exp()));
/// let pump = Load::volume_gain(&body, |t| 0.3 * (1.0 - (6.8 * t).cos()));
/// // Outflow through a tube of resistance 0.002 into a vessel at the pressure 0.4
/// let outlet = Load::feedback(|now: &LoadState| 0.4 - 0.002 * now.volume_rate);
/// let now = LoadState { time: 0.0, volume: 93.0, volume_rate: -50.0 };
/// assert_eq!((pressure.at(&now)?, outlet.at(&now)?), (0.0, 0.5));
/// assert!((pump.at(&now)? / body.start_volume() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Load {
    kind: LoadKind,
    model: Box<dyn Model>,
}

/// A force intensity that depends on the state: an afterload, a valve or a vessel.
///
/// It is a pressure under [`PressureLaw::PerCurrentLength`](crate::PressureLaw::PerCurrentLength) and for rubber. Under the default law it
/// is a force per unit s: the average pressure times the current length of the curve. The total-force law is rejected.
///
/// Every closure from a [`LoadState`] to a number is a feedback. A model with memory stores it in `self` and updates it in
/// [`Feedback::accepted`], once per step; the memory is constant within a step, which may be tried several times.
///
/// The example `windkessel` is a vessel with such a memory.
#[doc(alias = "afterload", alias = "windkessel")]
pub trait Feedback {
    /// Returns the force intensity f (or p) in this state. A step evaluates it several times, also in states that are not accepted; a
    /// value that is not finite is an error of the step.
    fn intensity(&self, now: &LoadState) -> f64;

    /// Receives the initial state, then the state after every step, in which a panic leaves the motion.
    fn accepted(&mut self, now: &LoadState) {
        let _ = now;
    }
}

impl<F: Fn(&LoadState) -> f64> Feedback for F {
    fn intensity(&self, now: &LoadState) -> f64 {
        self(now)
    }
}

/// A [`Feedback`], or a function of time, owned by a motion and its copies.
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

impl fmt::Debug for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Load")
            .field("kind", &self.kind)
            .finish_non_exhaustive()
    }
}

impl Load {
    fn signal(kind: LoadKind, signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        let signal = Arc::new(signal);
        let model = Box::new(move |now: &LoadState| signal(now.time));
        Self { kind, model }
    }

    /// Force intensity f(t), or p(t) under the law per current length and for rubber. Rejected under the total-force law, whose load is F
    /// ([`Load::total_force`]).
    #[must_use]
    pub fn intensity(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(LoadKind::Intensity, signal)
    }

    /// Total force F(t), intensity times the lateral surface of revolution, under any law of springs.
    #[must_use]
    pub fn total_force(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(LoadKind::TotalForce, signal)
    }

    /// Enclosed volume V(t) in cm^3: a pump. The pressure becomes an unknown of each step.
    ///
    /// V at the start must be that of the initial shape, and V' that of the initial velocity, zero at rest: begin with a flow of zero, such as
    /// 1 - cos(6 t). Otherwise the first step corrects the difference by an impulse, a large intensity that grows as 1/dt.
    /// [`Scheme::SemiImplicitEuler`](crate::Scheme) and [`Scheme::TrBdf2`](crate::Scheme) damp it within a few steps. Under
    /// [`Scheme::Midpoint`](crate::Scheme) it never decays without damping, so that a motion does not start with another V'
    /// ([`ImplicitError::VolumeRateMismatch`], by differences of V).
    #[must_use]
    pub fn volume(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::signal(LoadKind::Volume, signal)
    }

    /// Volume gain: V(t) = (1 + gain(t)) times the volume that `body` encloses at its start.
    #[must_use]
    pub fn volume_gain(body: &Body, gain: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        let start = body.start_volume();
        Self::volume(move |t| start * (1.0 + gain(t)))
    }

    /// Force intensity as a function of volume and flow. An implicit scheme solves for both together; splittings do not support it.
    ///
    /// The scheme keeps its order if the intensity is a smooth function of the [`LoadState`]. A model that integrates an equation of its own
    /// between [`Feedback::accepted`] and the current state limits the order to that of its rule: backward Euler to 1, the trapezoidal rule
    /// (example `windkessel`) to 2.
    #[must_use]
    pub fn feedback(model: impl Feedback + Clone + Send + Sync + 'static) -> Self {
        Self {
            kind: LoadKind::Feedback,
            model: Box::new(model),
        }
    }

    /// Returns the prescribed quantity.
    #[must_use]
    pub fn kind(&self) -> LoadKind {
        self.kind
    }

    /// Returns the prescribed value in this state; functions of time use its time only.
    ///
    /// # Errors
    /// The value is not finite there, or a volume negative.
    pub fn at(&self, now: &LoadState) -> Result<f64> {
        let given = self.value(now);
        if given.is_finite() && (self.kind != LoadKind::Volume || given >= 0.0) {
            Ok(given)
        } else {
            let time = now.time;
            Err(ImplicitError::BadLoad { time, given })
        }
    }

    pub(crate) fn value(&self, now: &LoadState) -> f64 {
        self.model.intensity(now)
    }

    /// Passes the accepted state to a model.
    pub(crate) fn accepted(&mut self, state: impl FnOnce() -> LoadState) {
        if self.kind == LoadKind::Feedback {
            self.model.accepted(&state());
        }
    }
}
