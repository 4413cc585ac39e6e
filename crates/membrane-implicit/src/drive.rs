//! What inflates the membrane: pressure, total force or volume as a function of time.

use std::fmt;
use std::sync::Arc;

use membrane_newton::Measure;

use crate::body::MovingMembrane;
use crate::error::ImplicitError;

/// What is prescribed as a function of time; the force intensity f (or p) that belongs to it is
/// part of the solution of each step.
#[derive(Clone)]
pub struct Drive {
    pub(crate) kind: DriveKind,
    signal: Arc<Signal>,
}

type Signal = dyn Fn(f64) -> f64 + Send + Sync;

/// Which quantity a [`Drive`] prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DriveKind {
    /// Force intensity: f per unit of material length, or p per unit of current length.
    Intensity,
    /// Total force: intensity times the lateral surface of revolution (Eq. 4).
    TotalForce,
    /// Enclosed volume of revolution, cm^3.
    Volume,
}

impl fmt::Debug for Drive {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drive")
            .field("kind", &self.kind)
            .finish_non_exhaustive()
    }
}

impl Drive {
    /// Force intensity f(t), or p(t) under the law per current length.
    pub fn intensity(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            kind: DriveKind::Intensity,
            signal: Arc::new(signal),
        }
    }

    /// Total force F(t).
    pub fn total_force(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            kind: DriveKind::TotalForce,
            signal: Arc::new(signal),
        }
    }

    /// Enclosed volume V(t) in cm^3: a pump. The pressure becomes an unknown of each step.
    ///
    /// V and V' at the first instant should be those of the initial shape and velocity; otherwise
    /// the first step makes up for the difference by an impulse.
    pub fn volume(signal: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            kind: DriveKind::Volume,
            signal: Arc::new(signal),
        }
    }

    /// Volume gain: V(t) = (1 + gain(t)) times the volume that `body` encloses at rest.
    pub fn volume_gain(
        body: &MovingMembrane,
        gain: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let rest = Measure::Volume.of(body.differences.start().as_chunks().0);
        Self::volume(move |t| rest * (1.0 + gain(t)))
    }

    /// Which quantity is prescribed.
    pub fn kind(&self) -> DriveKind {
        self.kind
    }

    /// The value prescribed at `time`.
    ///
    /// # Errors
    /// The signal is not finite there, or a volume not positive.
    pub fn at(&self, time: f64) -> Result<f64, ImplicitError> {
        let value = (self.signal)(time);
        if value.is_finite() && (self.kind != DriveKind::Volume || value > 0.0) {
            Ok(value)
        } else {
            Err(ImplicitError::BadDrive { time, value })
        }
    }
}
