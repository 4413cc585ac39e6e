//! The state of a membrane at one instant, and the input of a step.

use membrane_newton::{DiscreteMembrane, Measure, dot_in_eight as dot};

use crate::body::{Body, LoadState};
use crate::error::{ImplicitError, Result};
use crate::report::Work;

/// Position, velocity and acceleration at one instant, flat.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics {
    pub(crate) time: f64,
    pub(crate) nodes: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    /// Pressure force.
    pub(crate) pressure: Vec<f64>,
    pub(crate) intensity: f64,
}

/// The common input of all methods of a step.
pub(crate) struct Step<'a> {
    pub(crate) body: &'a Body,
    /// The current state first, the end of the step last.
    pub(crate) stages: &'a mut [Kinematics],
    pub(crate) dt: f64,
    pub(crate) work: &'a mut Work,
}

/// Start and end of a step.
type Ends<'a> = (&'a Kinematics, &'a mut Kinematics);

impl<'a> Step<'a> {
    /// Body, start and end of the step, its length, counters, for schemes without intermediate stages.
    pub(crate) fn ends(self) -> (&'a Body, Ends<'a>, f64, &'a mut Work) {
        let (now, new) = self.stages.split_at_mut(1);
        (self.body, (&now[0], &mut new[0]), self.dt, self.work)
    }
}

impl Kinematics {
    /// Creates the start at zero velocity.
    pub(crate) fn at_rest(body: &Body) -> Self {
        let nodes = body.discrete.start().to_vec();
        let zero = || vec![0.0; nodes.len()];
        Self {
            time: 0.0,
            velocity: zero(),
            acceleration: zero(),
            pressure: zero(),
            intensity: 0.0,
            nodes,
        }
    }

    /// Returns the state that a load depends on.
    pub(crate) fn load_state(&self, body: &Body) -> LoadState {
        body.load_state(self.time, &self.nodes, &self.velocity)
    }

    /// Computes forces and acceleration at this state under `intensity`.
    pub(crate) fn respond(&mut self, body: &Body, intensity: f64) -> Result<()> {
        let (time, given) = (self.time, intensity);
        if !intensity.is_finite() {
            return Err(ImplicitError::BadLoad { time, given });
        }
        self.intensity = intensity;
        body.pressure_into(time, &self.nodes, intensity, &mut self.pressure)?;
        body.discrete
            .elastic_force_into(&self.nodes, &mut self.acceleration);
        let (inverse_mass, mu) = (1.0 / body.mass, body.friction());
        let forces = self.pressure.iter().zip(&self.velocity);
        let nodes = self.acceleration.iter_mut().zip(&body.volumes);
        for ((a, volume), (p, v)) in nodes.zip(forces) {
            *a = ((*a + p) / volume - mu * v) * inverse_mass;
        }
        body.hold(&mut self.acceleration);
        Ok(())
    }

    /// v . H v of the volume, by a difference of its gradient along v.
    pub(crate) fn volume_curvature(&self, body: &Body) -> f64 {
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let speed = largest(&self.velocity);
        if speed == 0.0 {
            return 0.0;
        }
        let step = 1e-5 * largest(&self.nodes) / speed;
        let slope = |sign: f64| {
            let moved = self.nodes.iter().zip(&self.velocity);
            let moved: Vec<f64> = moved.map(|(x, v)| x + sign * step * v).collect();
            dot(&volume_gradient(body, &moved), &self.velocity)
        };
        (slope(1.0) - slope(-1.0)) / (2.0 * step)
    }
}

pub(crate) fn volume_gradient(body: &Body, nodes: &[f64]) -> Vec<f64> {
    let mut gradient = vec![0.0; nodes.len()];
    body.discrete
        .measure_gradient_into(Measure::Volume, nodes, &mut gradient);
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
    stages: &[Kinematics],
    a: &[f64],
    dt: f64,
    positions: &mut [f64],
    velocities: &mut [f64],
) {
    for (stage, a) in stages.iter().zip(a) {
        if *a != 0.0 {
            let a = dt * a;
            let axpy = |out: &mut [f64], slope: &[f64]| {
                out.iter_mut()
                    .zip(slope)
                    .for_each(|(out, slope)| *out += a * slope);
            };
            axpy(positions, &stage.velocity);
            axpy(velocities, &stage.acceleration);
        }
    }
}
