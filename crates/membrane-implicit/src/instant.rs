//! A membrane at one instant, and what every step is made from.

use membrane_newton::{DiscreteMembrane, Measure, dot_in_eight as dot};

use crate::body::{MovingMembrane, hold_ends};
use crate::error::ImplicitError;
use crate::work::Work;

/// Position, velocity and acceleration at one instant, flat.
#[derive(Debug, Clone)]
pub(crate) struct Instant {
    pub(crate) time: f64,
    pub(crate) nodes: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    /// Pressure force.
    pub(crate) pressure: Vec<f64>,
    pub(crate) intensity: f64,
    /// Power of the pressure force, and |v|^2, both integrated over s.
    pub(crate) pressure_power: f64,
    pub(crate) speed_squared: f64,
}

/// What every way to make a step needs.
pub(crate) struct Step<'a> {
    pub(crate) body: &'a MovingMembrane,
    /// Stage 0 is the present.
    pub(crate) instants: &'a mut [Instant],
    pub(crate) dt: f64,
    pub(crate) work: &'a mut Work,
}

impl Instant {
    /// Enclosed volume, cm^3.
    pub(crate) fn volume(&self) -> f64 {
        Measure::Volume.of(self.nodes.as_chunks().0)
    }

    /// Forces and acceleration at this state under `intensity`.
    pub(crate) fn respond(
        &mut self,
        body: &MovingMembrane,
        intensity: f64,
    ) -> Result<(), ImplicitError> {
        let (time, given) = (self.time, intensity);
        if !intensity.is_finite() {
            return Err(ImplicitError::BadDrive { time, given });
        }
        self.intensity = intensity;
        body.pressure_into(time, &self.nodes, intensity, &mut self.pressure)?;
        body.differences
            .elastic_force_into(&self.nodes, &mut self.acceleration);
        let (inverse_mass, mu) = (1.0 / body.mass, body.damping);
        let pressures = self.pressure.iter().zip(&self.velocity);
        for (a, (p, v)) in self.acceleration.iter_mut().zip(pressures) {
            *a = (*a + p - mu * v) * inverse_mass;
        }
        hold_ends(&mut self.acceleration);
        self.measure(body.differences.ds());
        Ok(())
    }

    /// Gradient of the enclosed volume by the nodes that move.
    pub(crate) fn volume_gradient(&self) -> Vec<f64> {
        let mut gradient = volume_gradient(&self.nodes);
        hold_ends(&mut gradient);
        gradient
    }

    /// v . H v of the volume, by a difference of its gradient along v.
    pub(crate) fn volume_curvature(&self) -> f64 {
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let speed = largest(&self.velocity);
        if speed == 0.0 {
            return 0.0;
        }
        let step = 1e-5 * largest(&self.nodes) / speed;
        let slope = |sign: f64| {
            let moved = self.nodes.iter().zip(&self.velocity);
            let moved: Vec<f64> = moved.map(|(x, v)| x + sign * step * v).collect();
            dot(&volume_gradient(&moved), &self.velocity)
        };
        (slope(1.0) - slope(-1.0)) / (2.0 * step)
    }

    pub(crate) fn measure(&mut self, ds: f64) {
        self.pressure_power = ds * dot(&self.pressure, &self.velocity);
        self.speed_squared = ds * dot(&self.velocity, &self.velocity);
    }
}

pub(crate) fn volume_gradient(nodes: &[f64]) -> Vec<f64> {
    let mut gradient = vec![0.0; nodes.len()];
    Measure::Volume.gradient_into(nodes.as_chunks().0, gradient.as_chunks_mut().0);
    gradient
}

/// `out` = (`to` - `from`) / h.
pub(crate) fn slope(to: &[f64], from: &[f64], h: f64, out: &mut [f64]) {
    let inverse = 1.0 / h;
    for (out, (to, from)) in out.iter_mut().zip(to.iter().zip(from)) {
        *out = (to - from) * inverse;
    }
}

/// `positions`, `velocities` += dt sum a_j (v_j, a_j).
pub(crate) fn add_slopes(
    before: &[Instant],
    a: &[f64],
    dt: f64,
    positions: &mut [f64],
    velocities: &mut [f64],
) {
    for (instant, a) in before.iter().zip(a) {
        if *a != 0.0 {
            let a = dt * a;
            let axpy = |out: &mut [f64], slope: &[f64]| {
                out.iter_mut()
                    .zip(slope)
                    .for_each(|(out, slope)| *out += a * slope);
            };
            axpy(positions, &instant.velocity);
            axpy(velocities, &instant.acceleration);
        }
    }
}
