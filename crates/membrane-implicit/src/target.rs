//! What a drive asks of a stage.

use membrane_newton::Measure;

use crate::drive::{Drive, DriveKind, Moment};
use crate::error::ImplicitError;

/// What a stage has to meet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Target<'a> {
    Intensity(f64),
    TotalForce(f64),
    Volume(f64),
    Feedback(&'a Drive),
    /// A feedback, linearised.
    Answer(Answer),
}

impl<'a> Target<'a> {
    /// What a stage that ends at `time` has to meet.
    pub(crate) fn of(drive: &'a Drive, time: f64) -> Result<Self, ImplicitError> {
        let value = || {
            drive.at(&Moment {
                time,
                volume: f64::NAN,
                volume_rate: f64::NAN,
            })
        };
        Ok(match drive.kind() {
            DriveKind::Intensity => Self::Intensity(value()?),
            DriveKind::TotalForce => Self::TotalForce(value()?),
            DriveKind::Volume => Self::Volume(value()?),
            DriveKind::Feedback => Self::Feedback(drive),
        })
    }

    /// The intensity at a state; `of_volume` if a volume is prescribed, whose intensity is part of the solution.
    pub(crate) fn intensity(
        &self,
        time: f64,
        nodes: &[f64],
        velocities: &[f64],
        of_volume: f64,
    ) -> Result<f64, ImplicitError> {
        let now = || Moment::of(time, nodes, velocities);
        Ok(match self {
            Self::Intensity(value) => *value,
            Self::TotalForce(value) => value / Measure::Surface.of(nodes.as_chunks().0),
            Self::Volume(_) => of_volume,
            Self::Feedback(drive) => drive.at(&now())?,
            Self::Answer(answer) => answer.intensity(&now()),
        })
    }
}

/// f = `intensity` + `by_volume` (V - V0) + `by_rate` (V' - V0'), V0 and V0' those of `at`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Answer {
    at: Moment,
    intensity: f64,
    pub(crate) by_volume: f64,
    pub(crate) by_rate: f64,
}

impl Answer {
    /// The answer of `drive` about `at`, its slopes by central differences: over a millionth of the volume (or of the
    /// membrane's `length` cubed, if it is flat), and over the rate that makes this change within `h`.
    pub(crate) fn about(
        drive: &Drive,
        at: Moment,
        length: f64,
        h: f64,
    ) -> Result<Self, ImplicitError> {
        let volume = 1e-6 * at.volume.abs().max(1e-3 * length.powi(3));
        let slope = |volume: f64, volume_rate: f64| {
            let moved = |sign: f64| {
                drive.value(&Moment {
                    time: at.time,
                    volume: at.volume + sign * volume,
                    volume_rate: at.volume_rate + sign * volume_rate,
                })
            };
            let slope = (moved(1.0) - moved(-1.0)) / (2.0 * volume.max(volume_rate));
            // beside a state at which the drive has a value it need not have one
            if slope.is_finite() { slope } else { 0.0 }
        };
        Ok(Self {
            at,
            intensity: drive.at(&at)?,
            by_volume: slope(volume, 0.0),
            by_rate: slope(0.0, volume / h),
        })
    }

    pub(crate) fn intensity(&self, now: &Moment) -> f64 {
        self.intensity
            + self.by_volume * (now.volume - self.at.volume)
            + self.by_rate * (now.volume_rate - self.at.volume_rate)
    }
}
