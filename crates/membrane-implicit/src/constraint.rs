//! The equation that a load adds to a stage.

use membrane_newton::{DiscreteMembrane, Measure};

use crate::body::{Body, LoadState};
use crate::error::{ImplicitError, Result};
use crate::kinematics::Kinematics;
use crate::load::Load;
use crate::scheme::{LoadKind, Scheme};

/// The quantity that a stage must meet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Constraint<'a> {
    Intensity(f64),
    TotalForce(f64),
    Volume(f64),
    Feedback(&'a Load),
    /// A feedback, linearised.
    Answer(Answer),
}

impl<'a> Constraint<'a> {
    /// Returns the constraint of `load` at `time`.
    pub(crate) fn of(load: &'a Load, time: f64) -> Result<Self> {
        let value = || {
            load.at(&LoadState {
                time,
                volume: f64::NAN,
                volume_rate: f64::NAN,
            })
        };
        Ok(match load.kind() {
            LoadKind::Intensity => Self::Intensity(value()?),
            LoadKind::TotalForce => Self::TotalForce(value()?),
            LoadKind::Volume => Self::Volume(value()?),
            LoadKind::Feedback => Self::Feedback(load),
        })
    }

    /// Returns the intensity at a state of `body`; `of_volume` for a prescribed volume, whose intensity is part of the solution.
    pub(crate) fn intensity(&self, body: &Body, at: &Kinematics, of_volume: f64) -> Result<f64> {
        let now = || at.load_state(body);
        Ok(match self {
            Self::Intensity(value) => *value,
            Self::TotalForce(value) => value / Measure::Surface.of(at.nodes.as_chunks().0),
            Self::Volume(_) => of_volume,
            Self::Feedback(load) => load.at(&now())?,
            Self::Answer(answer) => answer.intensity(&now()),
        })
    }
}

/// f = `intensity` + `by_volume` (V - V0) + `by_rate` (V' - V0'), with V0 and V0' of `at`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Answer {
    at: LoadState,
    intensity: f64,
    pub(crate) by_volume: f64,
    pub(crate) by_rate: f64,
}

impl Answer {
    /// Linearises `load` about `at` by central differences: over a millionth of the volume (or of the membrane's `length` cubed, if it is
    /// flat), and over the rate that causes this change within `h`.
    pub(crate) fn about(load: &Load, at: LoadState, length: f64, h: f64) -> Result<Self> {
        let volume = 1e-6 * at.volume.abs().max(1e-3 * length.powi(3));
        let slope = |volume: f64, volume_rate: f64| {
            let moved = |sign: f64| {
                load.value(&LoadState {
                    time: at.time,
                    volume: at.volume + sign * volume,
                    volume_rate: at.volume_rate + sign * volume_rate,
                })
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * volume.max(volume_rate));
            // the load may be undefined in neighbouring states
            if slope.is_finite() { slope } else { 0.0 }
        };
        Ok(Self {
            at,
            intensity: load.at(&at)?,
            by_volume: slope(volume, 0.0),
            by_rate: slope(0.0, volume / h),
        })
    }

    pub(crate) fn intensity(&self, now: &LoadState) -> f64 {
        self.intensity
            + self.by_volume * (now.volume - self.at.volume)
            + self.by_rate * (now.volume_rate - self.at.volume_rate)
    }
}

/// Rejects a load, law or material that the scheme does not support.
pub(crate) fn check_support(scheme: Scheme, load: LoadKind, body: &Body) -> Result<()> {
    match scheme.unsupported(load, body.discrete.setting().membrane()) {
        None => Ok(()),
        Some(what) => Err(ImplicitError::Unsupported { scheme, what }),
    }
}

/// Returns the value of `load` in the state `now`, its first derivative and its second derivative by time, by differences over `e`.
pub(crate) fn derivatives(load: &Load, now: LoadState, e: f64) -> Result<[f64; 3]> {
    let at = |time: f64| load.at(&LoadState { time, ..now });
    let [v0, v1, v2] = [at(now.time)?, at(now.time + e)?, at(now.time + 2.0 * e)?];
    let v3 = at(now.time + 3.0 * e)?;
    let rate = (18.0 * v1 - 9.0 * v2 + 2.0 * v3 - 11.0 * v0) / (6.0 * e);
    Ok([v0, rate, (2.0 * v0 - 5.0 * v1 + 4.0 * v2 - v3) / (e * e)])
}
