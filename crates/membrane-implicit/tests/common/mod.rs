//! The reference problem: R = 1.75, h = 8.5, N = 101, f = 17.5, lambda = mu = m = 1, at rest.
#![allow(dead_code, unreachable_pub)] // each test file uses its part

use membrane_implicit::{Body, Load, Membrane, Motion, RestShape, Scheme};

pub fn balloon() -> Membrane {
    Membrane::new(RestShape::balloon(8.5, 1.75).unwrap())
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
