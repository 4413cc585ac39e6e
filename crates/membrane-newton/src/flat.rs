//! Flat sheets of rubber under loads so small that rounding of the nodes hides their strains.
//!
//! A flat sheet that is fixed in its reference configuration has no tension there. Deflected by w it has strains of order (w / R)^2, and to
//! that order the equilibria under all loads have one shape (Hencky 1915; Föppl's membrane):
//!
//! ```text
//! x = t X,     y = y0 + t^2 (Y - y0),     p = t^3 P,     V = t V1
//! ```
//!
//! The error of this is of the order of the strain. That of nodes in double precision is 1e-16 over the strain: 1e-8 at the volume
//! [`SMALLEST`], where the strain is 1e-7.

use membrane_forces::{Measure, Measures};

use crate::constraint::Constraint;
use crate::error::own;
use crate::resolution::{Resolution, swept_by_mean_radius};
use crate::route::Route;

/// Volume below which a shape is scaled, relative to the volume swept by the sheet that moves by its mean distance from the axis.
const SMALLEST: f64 = 2e-4;
/// Largest intensities, over their scale, at such volumes: of the order of their cube.
const SMALL_INTENSITY: f64 = 1e-7;

impl Resolution {
    /// Whether this is flat rubber without tension in the reference configuration.
    fn is_slack_sheet(&self) -> bool {
        let membrane = self.discrete.setting().membrane();
        let rest = [0.0, 1.0].map(|s| membrane.reference().at(s).position);
        let points = self.discrete.start().as_chunks::<2>().0;
        match self.route() {
            Route::Raise => false,
            Route::Inflate => {
                membrane.ends() == rest && points.iter().all(|point| point[0] == points[0][0])
            }
        }
    }

    /// Returns the volume below which the state of a slack sheet is scaled; zero for any other membrane.
    pub(crate) fn smallest_volume(&self) -> f64 {
        match self.is_slack_sheet() {
            true => SMALLEST * swept_by_mean_radius(&self.start),
            false => 0.0,
        }
    }

    /// Returns the equilibrium `state` of a slack sheet, scaled to `constraint`; `None` if that is beyond the state.
    pub(crate) fn scaled(&self, mut state: Vec<f64>, constraint: Constraint) -> Option<Vec<f64>> {
        let last = state.len() - 1;
        let measure = |measure, nodes: &[f64]| own(self.discrete.measure(measure, nodes));
        let wanted = constraint.value();
        let t = match constraint {
            Constraint::Intensity(_) => (wanted / state[last]).cbrt(),
            Constraint::TotalForce(_) => {
                (wanted / (state[last] * measure(Measure::Surface, &state[..last]))).cbrt()
            }
            Constraint::Measure(of, _) => wanted / measure(of, &state[..last]),
        };
        if t.is_nan() || t.abs() >= 1.0 {
            return None;
        }
        let start = self.discrete.start().as_chunks::<2>().0;
        for (point, start) in state.as_chunks_mut::<2>().0.iter_mut().zip(start) {
            *point = [
                start[0] + t * (point[0] - start[0]),
                start[1] + t * t * (point[1] - start[1]),
            ];
        }
        state[last] *= t * t * t;
        // the prescribed value is met to rounding; volumes and areas are linear in x
        match constraint {
            Constraint::Intensity(_) => state[last] = wanted,
            Constraint::TotalForce(_) => {
                state[last] = wanted / measure(Measure::Surface, &state[..last])
            }
            Constraint::Measure(of, _) => {
                let rest = wanted / measure(of, &state[..last]);
                for (point, start) in state.as_chunks_mut::<2>().0.iter_mut().zip(start) {
                    point[0] = start[0] + rest * (point[0] - start[0]);
                }
            }
        }
        Some(state)
    }

    /// Returns the derivative of the state `x` of a slack sheet by the value of `constraint`, if x is scaled.
    pub(crate) fn scaled_rate(&self, x: &[f64], constraint: Constraint) -> Option<Vec<f64>> {
        let last = x.len() - 1;
        let volume = own(self.discrete.measure(Measure::Volume, &x[..last]));
        if volume == 0.0 || volume.abs() >= self.smallest_volume() {
            return None;
        }
        let surface = || own(self.discrete.measure(Measure::Surface, &x[..last]));
        // t' / t
        let by = match constraint {
            Constraint::Intensity(_) => 1.0 / (3.0 * x[last]),
            Constraint::TotalForce(_) => 1.0 / (3.0 * x[last] * surface()),
            Constraint::Measure(of, _) => 1.0 / own(self.discrete.measure(of, &x[..last])),
        };
        let mut rate = x.to_vec();
        let start = self.discrete.start();
        for (i, (rate, start)) in rate[..last].iter_mut().zip(start).enumerate() {
            let power = [1.0, 2.0][i % 2];
            let moved = *rate - start;
            // a change within the rounding of a node counts as zero
            let real = i % 2 == 0 || moved.abs() > 4.0 * f64::EPSILON * start.abs();
            *rate = if real { power * by * moved } else { 0.0 };
        }
        rate[last] *= 3.0 * by;
        Some(rate)
    }

    /// Returns the volume of a state that can be scaled to `constraint`; `None` if that is too large, or for other membranes.
    pub(crate) fn volume_to_scale(&self, constraint: Constraint) -> Option<f64> {
        let smallest = self.smallest_volume();
        let wanted = constraint.value().abs();
        let Measures {
            length, surface, ..
        } = self.start;
        let intensity = SMALL_INTENSITY * self.discrete.intensity_scale(length);
        let most = match constraint {
            Constraint::Intensity(_) => intensity,
            Constraint::TotalForce(_) => intensity * surface,
            Constraint::Measure(Measure::Volume, _) => smallest,
            Constraint::Measure(..) => 100.0 * SMALLEST * length * length,
        };
        (smallest > 0.0 && wanted > 0.0 && wanted < most).then_some(smallest)
    }
}
