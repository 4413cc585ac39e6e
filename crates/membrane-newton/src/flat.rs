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
//! [`SMALLEST`], where the strain is 1e-7. Equilibria under opposite loads of any size are mirror images.

use membrane_forces::Measures;

use crate::constraint::{Constraint, Control, Quantity};
use crate::equilibrium::Equilibrium;
use crate::resolution::{Resolution, swept_by_mean_radius};
use crate::route::Route;

/// Volume below which a shape is scaled, relative to the volume swept by the sheet that moves by its mean distance from the axis.
const SMALLEST: f64 = 2e-4;
/// Largest intensities, over their scale, at such volumes: of the order of their cube.
const SMALL_INTENSITY: f64 = 1e-7;

impl Resolution {
    /// Whether this is flat rubber without tension in the reference configuration.
    pub(crate) fn is_slack_sheet(&self) -> bool {
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

    /// Returns the opposite of a negative control of a slack sheet, under which its equilibrium is the mirror image.
    pub(crate) fn opposite(&self, control: Control) -> Option<Control> {
        let (value, opposite): (f64, fn(f64) -> Control) = match control {
            Control::Load(value) => (value, Control::Load),
            Control::Intensity(value) => (value, Control::Intensity),
            Control::TotalForce(value) => (value, Control::TotalForce),
            Control::Area(value) => (value, Control::Area),
            Control::Volume(_) | Control::VolumeGain(_) => return None,
        };
        let is_negative = value.is_finite() && value < 0.0;
        (is_negative && self.is_slack_sheet()).then(|| opposite(-value))
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
        let Constraint { quantity, value } = constraint;
        let share = value / quantity.of(&*self.discrete, &state);
        let t = match quantity {
            Quantity::Intensity | Quantity::TotalForce => share.cbrt(),
            Quantity::Measure(_) => share,
        };
        if t.is_nan() || t.abs() >= 1.0 {
            return None;
        }
        self.stretch(&mut state, t, t * t);
        state[last] *= t * t * t;
        // the prescribed value is met to rounding; volumes and areas are linear in x
        let rest = value / quantity.of(&*self.discrete, &state);
        match quantity {
            Quantity::Intensity => state[last] = value,
            Quantity::TotalForce => state[last] *= rest,
            Quantity::Measure(_) => self.stretch(&mut state, rest, 1.0),
        }
        Some(state)
    }

    /// Multiplies the displacements of `state` from the start by factors along x and y.
    fn stretch(&self, state: &mut [f64], along_x: f64, along_y: f64) {
        let start = self.discrete.start().as_chunks::<2>().0;
        for (point, start) in state.as_chunks_mut::<2>().0.iter_mut().zip(start) {
            *point = [
                start[0] + along_x * (point[0] - start[0]),
                start[1] + along_y * (point[1] - start[1]),
            ];
        }
    }

    /// Returns the derivative of the state `x` of a slack sheet by the value of `constraint`, if x is scaled.
    pub(crate) fn scaled_rate(&self, x: &[f64], constraint: Constraint) -> Option<Vec<f64>> {
        let last = x.len() - 1;
        let volume = Quantity::VOLUME.of(&*self.discrete, x);
        if volume == 0.0 || volume.abs() >= self.smallest_volume() {
            return None;
        }
        let power = match constraint.quantity {
            Quantity::Intensity | Quantity::TotalForce => 3.0,
            Quantity::Measure(_) => 1.0,
        };
        // t' / t
        let by = 1.0 / (power * constraint.quantity.of(&*self.discrete, x));
        let mut rate = x.to_vec();
        let start = self.discrete.start();
        for (i, (rate, start)) in rate[..last].iter_mut().zip(start).enumerate() {
            let power = [1.0, 2.0][i % 2];
            *rate = power * by * (*rate - start);
        }
        rate[last] *= 3.0 * by;
        Some(rate)
    }

    /// Returns the volume of a state that can be scaled to `constraint`; `None` if that is too large, or for other membranes.
    pub(crate) fn volume_to_scale(&self, constraint: Constraint) -> Option<f64> {
        let smallest = self.smallest_volume();
        let wanted = constraint.value.abs();
        let Measures {
            length, surface, ..
        } = self.start;
        let intensity = SMALL_INTENSITY * self.discrete.intensity_scale(length);
        let most = match constraint.quantity {
            Quantity::Intensity => intensity,
            Quantity::TotalForce => intensity * surface,
            Quantity::VOLUME => smallest,
            Quantity::Measure(_) => 100.0 * SMALLEST * length * length,
        };
        (smallest > 0.0 && wanted > 0.0 && wanted < most).then_some(smallest)
    }
}

impl Equilibrium {
    /// Returns the mirror image of a flat sheet, an equilibrium under the opposite load.
    pub(crate) fn mirrored(&self) -> Self {
        let mut state = self.state.clone();
        self.resolution.stretch(&mut state, -1.0, 1.0);
        if let Some(intensity) = state.last_mut() {
            *intensity = -*intensity;
        }
        self.resolution.equilibrium(state, self.report.clone())
    }
}
