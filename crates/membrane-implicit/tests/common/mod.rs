//! The reference problem: R = 1.75, h = 8.5, N = 101, f = 17.5, lambda = mu = m = 1, zero initial velocity.
#![allow(dead_code, unreachable_pub)] // each test file uses a part

use std::convert::Infallible;
use std::ops::ControlFlow;

use membrane_implicit::{
    Body, ImplicitError, Load, Membrane, Motion, ReferenceShape, Scheme, Stop, TimeStep,
};

pub fn balloon() -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
}

pub fn reference_body() -> Body {
    Body::springs(&balloon(), 101)
        .unwrap()
        .with_damping(1.0)
        .unwrap()
}

pub fn inflate(scheme: Scheme) -> Motion {
    Motion::new(reference_body(), Load::intensity(|_| 17.5), scheme).unwrap()
}

pub fn apex(motion: &Motion) -> f64 {
    let points = motion.state().points;
    points[points.len() / 2][0]
}

/// Largest distance between nodes, cm.
pub fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

/// The state at `end` of y' = slope(t, y), by the classical Runge-Kutta scheme.
pub fn runge_kutta(
    mut state: Vec<f64>,
    end: f64,
    steps: usize,
    mut slope: impl FnMut(f64, &[f64]) -> Vec<f64>,
) -> Vec<f64> {
    let dt = end / steps as f64;
    let moved = |state: &[f64], slope: &[f64], by: f64| -> Vec<f64> {
        state.iter().zip(slope).map(|(x, k)| x + by * k).collect()
    };
    for step in 0..steps {
        let time = step as f64 * dt;
        let k1 = slope(time, &state);
        let k2 = slope(time + 0.5 * dt, &moved(&state, &k1, 0.5 * dt));
        let k3 = slope(time + 0.5 * dt, &moved(&state, &k2, 0.5 * dt));
        let k4 = slope(time + dt, &moved(&state, &k3, dt));
        for (i, x) in state.iter_mut().enumerate() {
            *x += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    state
}

pub trait RunWith {
    /// Runs with an observer that does not end the run.
    fn run_with(
        &mut self,
        steps: TimeStep,
        stops: &[Stop],
        observe: impl FnMut(&Self),
    ) -> Result<usize, ImplicitError>;
}

impl RunWith for Motion {
    fn run_with(
        &mut self,
        steps: TimeStep,
        stops: &[Stop],
        mut observe: impl FnMut(&Self),
    ) -> Result<usize, ImplicitError> {
        let observe = |motion: &Self| {
            observe(motion);
            ControlFlow::<Infallible>::Continue(())
        };
        match self.run_observed(steps, stops, observe)? {
            ControlFlow::Continue(index) => Ok(index),
            ControlFlow::Break(never) => match never {},
        }
    }
}
