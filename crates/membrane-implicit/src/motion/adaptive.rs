//! Steps of variable length: by the local error, or to reach a volume.

use membrane_newton::MembraneError;

use super::{Motion, view};
use crate::body::{Body, LoadState};
use crate::error::{ImplicitError, Result, positive};
use crate::report::Work;
use crate::scheme::{LoadKind, Scheme};

/// The largest local error allowed in one step, as root mean square over the nodes.
///
/// The scheme estimates the error. A first step, in which the load may begin to rise, is also compared with two steps of half the length
/// and with Simpson's rule. The tolerance does not bound the error of a run: errors of successive steps add up.
///
/// A load that is a function of time is sampled at 64 times within each step; a step is halved if the samples vary by more than four times
/// the values that the scheme uses. A pulse shorter than 1/64 of a step may be missed: set `longest` to its duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Tolerance on a position, cm; at least rounding, 2.2e-16 of the length of the curve.
    pub position: f64,
    /// Tolerance on a velocity, cm/s; at least rounding, 2.2e-16 of that length per time of a wave along it.
    pub velocity: f64,
    /// Longest allowed step.
    pub longest: f64,
}

/// Intervals between samples of the load within a step.
const SAMPLES: u32 = 64;

impl Tolerance {
    /// Rejects tolerances below the rounding of positions, and of velocities of waves that move a node by the length of the curve.
    pub(super) fn check(&self, body: &Body) -> Result<()> {
        let least = f64::EPSILON * body.length;
        let slowest = least / body.wave_time();
        MembraneError::within("position tolerance", self.position, least, f64::MAX)?;
        MembraneError::within("velocity tolerance", self.velocity, slowest, f64::MAX)?;
        longest(self.longest)?;
        Ok(())
    }

    /// Uses the same number for positions and velocities, without a limit on the step: steps become long where nothing moves. With
    /// loads that contain short pulses set `longest` ([`Tolerance`]).
    #[must_use]
    pub fn uniform(tolerance: f64) -> Self {
        Self {
            position: tolerance,
            velocity: tolerance,
            longest: f64::INFINITY,
        }
    }
}

impl Motion {
    /// Attempts steps until one passes the error test, without accepting it.
    pub(super) fn attempt_adaptive(&mut self, tolerance: &Tolerance, most: f64) -> Result<f64> {
        tolerance.check(&self.inner.body)?;
        let scheme = self.inner.scheme;
        if scheme == Scheme::Splitting6 {
            let what = "adaptive steps";
            return Err(ImplicitError::Unsupported { scheme, what });
        }
        longest(most)?;
        let bounds = (tolerance.position, tolerance.velocity);
        let exponent = 1.0 / (scheme.order() as f64 + 1.0);
        let longest_step = tolerance.longest.min(self.inner.longest_step());
        let mut dt = self
            .next_dt
            .unwrap_or_else(|| self.inner.first_step(tolerance.position));
        let mut grow = 3.0;
        loop {
            let wanted = dt.min(longest_step);
            // two equal steps instead of a whole one and a very short one
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
            if !self.resolves_load(cut) {
                self.inner.work.rejected += 1;
                (grow, dt) = (1.0, 0.5 * cut);
                continue;
            }
            let attempted = self.attempt(cut);
            let error = match attempted.and_then(|()| self.local_error(cut, bounds)) {
                Ok(error) => error,
                Err(
                    ImplicitError::Unstable { .. }
                    | ImplicitError::Forces { .. }
                    | ImplicitError::Step { .. },
                ) => f64::INFINITY,
                Err(error) => return Err(error),
            };
            let factor = (0.9 * error.powf(-exponent)).clamp(0.2, grow);
            if error <= 1.0 {
                // A nearly constant step keeps its factorisation.
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

    /// Whether the values that the scheme uses in a step of length `dt` represent a load that is a function of time: samples within the step
    /// vary by at most four times as much, or within rounding.
    fn resolves_load(&self, dt: f64) -> bool {
        match self.load.kind() {
            LoadKind::Intensity | LoadKind::TotalForce | LoadKind::Volume => (),
            LoadKind::Feedback => return true,
        }
        let (volume, volume_rate) = (f64::NAN, f64::NAN);
        let range = |times: &mut dyn Iterator<Item = f64>| {
            times.fold((f64::MAX, f64::MIN), |(least, most), part| {
                let time = self.time() + part * dt;
                let value = self.load.value(&LoadState {
                    time,
                    volume,
                    volume_rate,
                });
                (least.min(value), most.max(value))
            })
        };
        let used = range(&mut [0.0].iter().chain(&self.inner.load_times).copied());
        let all = range(&mut (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES)));
        let rounding = 1e-9 * all.0.abs().max(all.1.abs());
        all.1 - all.0 <= 4.0 * (used.1 - used.0) + rounding
    }

    /// Returns the scaled local error of the attempted step of length `dt`, the larger one of a pair: the scheme's own estimate; for a
    /// first step, during which a load may begin to rise, also that of step doubling in a copy.
    fn local_error(&mut self, dt: f64, bounds: (f64, f64)) -> Result<f64> {
        let estimates = self.movers_mut().filter_map(|s| s.error(bounds));
        let mut error = estimates.fold(0.0, f64::max);
        if self.inner.has_previous() {
            return Ok(error);
        }
        let mut halves = self.clone();
        halves.attempt(0.5 * dt)?;
        halves.accept(None)?;
        halves.attempt(0.5 * dt)?;
        for (stepper, halves) in self.movers_mut().zip(halves.movers_mut()) {
            error = error.max(stepper.error_by_doubling(halves, bounds));
            stepper.work = Work {
                steps: stepper.work.steps,
                ..halves.work
            };
        }
        Ok(error)
    }

    /// Shortens the attempted step of length `dt` so that it ends where the volume first equals `volume`, if it does so within the step.
    /// Returns the length of the remaining step.
    ///
    /// The extrema of the cubic with the volumes and flows of both ends reveal a passage and return within the step.
    pub(super) fn land_on_volume(&mut self, volume: f64, dt: f64) -> Result<f64> {
        let body = &self.inner.body;
        let (start, end) = (view(body, self.inner.now()), view(body, self.inner.end()));
        let gap = [start.volume() - volume, end.volume() - volume];
        let rates = [start.volume_rate() * dt, end.volume_rate() * dt];
        let turns = extrema(gap, rates).into_iter().flatten();
        let passes = |t: &f64| cubic(gap, rates, *t) * gap[0] < 0.0;
        for turn in turns.filter(passes) {
            self.attempt(turn * dt)?;
            let there = self.inner.end_volume() - volume;
            if there * gap[0] < 0.0 {
                return self.bisect_volume(volume, gap[0], (turn * dt, there));
            }
            self.attempt(dt)?;
        }
        if gap[0] * gap[1] < 0.0 {
            self.bisect_volume(volume, gap[0], (dt, gap[1]))
        } else {
            Ok(dt)
        }
    }

    /// Attempts the step that ends at `volume`. The error of the volume is `fa` at its start, and `fb` with the opposite sign after `b`.
    /// Returns its length.
    fn bisect_volume(
        &mut self,
        volume: f64,
        mut fa: f64,
        (mut b, mut fb): (f64, f64),
    ) -> Result<f64> {
        // Illinois method (modified regula falsi) for the length of the step; each trial is a step of the scheme.
        let mut a = 0.0;
        let mut last = b;
        for _ in 0..60 {
            let middle = (a * fb - b * fa) / (fb - fa);
            self.attempt(middle)?;
            last = middle;
            let f = self.inner.end_volume() - volume;
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
        Ok(last)
    }
}

/// Evaluates at `t` the cubic on [0, 1] with these values and slopes at its ends.
fn cubic([a, b]: [f64; 2], [da, db]: [f64; 2], t: f64) -> f64 {
    let s = 1.0 - t;
    s * s * (a * (1.0 + 2.0 * t) + da * t) + t * t * (b * (1.0 + 2.0 * s) - db * s)
}

/// Returns the extrema of that cubic within (0, 1), ascending.
fn extrema([a, b]: [f64; 2], [da, db]: [f64; 2]) -> [Option<f64>; 2] {
    // derivative c2 t^2 + 2 c1 t + da
    let (c2, c1) = (
        6.0 * (a - b) + 3.0 * (da + db),
        3.0 * (b - a) - 2.0 * da - db,
    );
    let discriminant = c1 * c1 - c2 * da;
    if discriminant < 0.0 {
        return [None; 2];
    }
    // without cancellation: the roots are q / c2 and da / q
    let q = -(c1 + discriminant.sqrt().copysign(c1));
    let mut roots = [q / c2, da / q];
    roots.sort_by(f64::total_cmp);
    roots.map(|t| (t > 0.0 && t < 1.0).then_some(t))
}

/// Validates a bound on the step, which may be infinite.
fn longest(step: f64) -> Result<f64> {
    if step == f64::INFINITY {
        Ok(step)
    } else {
        positive("longest step", step)
    }
}
