//! Steps whose length is not given: by the error, or to land on a volume.

use super::Motion;
use crate::error::{ImplicitError, positive};
use crate::scheme::Scheme;

/// What the estimated error of one step may be, in the root mean square over the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Of a position, cm.
    pub position: f64,
    /// Of a velocity, cm/s.
    pub velocity: f64,
    /// Longest step allowed.
    pub longest: f64,
}

impl Tolerance {
    pub(super) fn check(&self) -> Result<(), ImplicitError> {
        positive("position tolerance", self.position)?;
        positive("velocity tolerance", self.velocity)?;
        longest(self.longest)?;
        Ok(())
    }

    /// The same number for positions and velocities, steps of any length.
    pub fn uniform(tolerance: f64) -> Self {
        Self {
            position: tolerance,
            velocity: tolerance,
            longest: f64::INFINITY,
        }
    }
}

impl Motion {
    /// Attempts steps until one passes the error test; leaves it to be accepted.
    pub(super) fn attempt_adaptive(
        &mut self,
        tolerance: &Tolerance,
        most: f64,
    ) -> Result<f64, ImplicitError> {
        tolerance.check()?;
        if self.inner.scheme == Scheme::Splitting6 {
            return Err(ImplicitError::NoErrorEstimate);
        }
        longest(most)?;
        let bounds = (tolerance.position, tolerance.velocity);
        let exponent = self.inner.error_exponent();
        let mut dt = self
            .next_dt
            .unwrap_or_else(|| self.inner.first_step(tolerance.position));
        let mut grow = 4.0;
        loop {
            let wanted = dt.min(tolerance.longest);
            // two equal steps rather than a whole one and a sliver
            let cut = if wanted >= most {
                most
            } else if wanted > 0.5 * most {
                0.5 * most
            } else {
                wanted
            };
            let time = self.time();
            if cut <= 4.0 * f64::EPSILON * time.abs() || cut < f64::MIN_POSITIVE {
                return Err(ImplicitError::StepTooSmall { time, dt: cut });
            }
            let error = match self.attempt(cut) {
                Ok(()) => {
                    let errors = self.steppers_mut().filter_map(|s| s.error(bounds));
                    // without an estimate yet, the first step is taken as it is
                    errors.reduce(f64::max).unwrap_or(1.0)
                }
                Err(
                    ImplicitError::StepNotSolved { .. }
                    | ImplicitError::Unstable { .. }
                    | ImplicitError::Membrane { .. }
                    | ImplicitError::Linear { .. },
                ) => f64::INFINITY,
                Err(error) => return Err(error),
            };
            let factor = (0.9 * error.powf(-exponent)).clamp(0.2, grow);
            if error <= 1.0 {
                // A step that hardly changes keeps its factorisation.
                let factor = if (1.0..1.2).contains(&factor) {
                    1.0
                } else {
                    factor
                };
                self.next_dt = Some(if cut < wanted {
                    wanted.max(cut * factor)
                } else {
                    cut * factor
                });
                return Ok(cut);
            }
            self.inner.work.rejected += 1;
            grow = 1.0;
            dt = cut * factor.min(0.9);
        }
    }

    /// Repeats the attempted step with the length at which the volume is `volume`.
    pub(super) fn land_on_volume(
        &mut self,
        volume: f64,
        ends: (f64, f64),
        dt: f64,
    ) -> Result<(), ImplicitError> {
        // Illinois' regula falsi on the step's length; each trial is a step of the scheme.
        let (mut a, mut fa, mut b, mut fb) = (0.0, ends.0 - volume, dt, ends.1 - volume);
        for _ in 0..60 {
            let middle = (a * fb - b * fa) / (fb - fa);
            self.attempt(middle)?;
            let f = self.inner.end().volume() - volume;
            if f.abs() <= 0.5e-10 * volume.abs() || middle <= a.min(b) || middle >= a.max(b) {
                break;
            }
            if f * fb < 0.0 {
                (a, fa) = (b, fb);
            } else {
                fa *= 0.5;
            }
            (b, fb) = (middle, f);
        }
        Ok(())
    }
}

/// A bound on the step, which may be infinite.
fn longest(step: f64) -> Result<f64, ImplicitError> {
    if step == f64::INFINITY {
        Ok(step)
    } else {
        positive("longest step", step)
    }
}
