//! Means of the unit Gaussian exp(-|q|²/2) over segments, parallelograms and parallelepipeds.

use super::round::{Vec3, add, cross, dot};
use std::f64::consts::FRAC_PI_2;

/// Standard deviations after which a Gaussian counts as zero: exp(-9²/2) = 2.6e-18.
pub(super) const REACH: f64 = 9.0;

/// Positive nodes and weights of the 8-point Gauss-Legendre rule (Abramowitz & Stegun 1964, table 25.4).
const GAUSS_LEGENDRE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Mean of exp(-|c + Σ u_k e_k|²/2) over u_k in [-1, 1].
///
/// Closed form (error functions) for orthogonal edges. Otherwise the last edges that are not orthogonal get an 8-point Gauss-Legendre rule
/// where the line or plane of the other edges is within reach of the origin, on panels of at most one standard deviation, with an error
/// below 1e-15 of the peak. Nearly parallel edges would need more than [`MOST_PANELS`]; their panels are longer.
pub(super) fn mean(c: Vec3, edges: &[Vec3]) -> f64 {
    let Some((&e, rest)) = edges.split_last() else {
        return (-0.5 * dot(c, c)).exp();
    };
    let length_sq = dot(e, e);
    if length_sq == 0.0 {
        return mean(c, rest);
    }
    if length_sq == f64::INFINITY {
        // A finite integral over so long an edge.
        return 0.0;
    }
    let orthogonal = rest
        .iter()
        .all(|&r| dot(e, r).powi(2) <= 1e-30 * length_sq * dot(r, r));
    if orthogonal {
        let length = length_sq.sqrt();
        let along = dot(c, e) / length;
        return segment(along, length) * mean(add(c, -along / length, e), rest);
    }
    let [low, high] = near(across(c, rest), across(e, rest));
    let panels = ((high - low) * length_sq.sqrt())
        .ceil()
        .clamp(1.0, MOST_PANELS);
    let half = 0.5 * (high - low) / panels;
    let mut sum = 0.0;
    for panel in 0..panels as usize {
        let centre = low + (2.0 * panel as f64 + 1.0) * half;
        for (node, weight) in GAUSS_LEGENDRE {
            for side in [-1.0, 1.0] {
                sum += weight * mean(add(c, centre + side * half * node, e), rest);
            }
        }
    }
    sum * half / 2.0
}

/// Mean of exp(-x²/2) from `middle - half` to `middle + half`.
fn segment(middle: f64, half: f64) -> f64 {
    if half > 1e-2 {
        return FRAC_PI_2.sqrt() * between(middle - half, middle + half) / (2.0 * half);
    }
    // The difference of two nearly equal numbers would lose all digits. Taylor's series about the middle, in even Hermite
    // polynomials of it; the next term is below 1e-19.
    let (x, h) = (middle * middle, half * half);
    let value = (-0.5 * x).exp();
    if value == 0.0 {
        return 0.0;
    }
    let second = (x - 1.0) / 6.0;
    let fourth = ((x - 6.0) * x + 3.0) / 120.0;
    let sixth = (((x - 15.0) * x + 45.0) * x - 15.0) / 5040.0;
    value * (1.0 + h * (second + h * (fourth + h * sixth)))
}

/// Largest number of panels of an edge: enough for edges of any length at angles of at least a thousandth of a right angle.
const MOST_PANELS: f64 = 32768.0;

/// The part of `v` across one edge, or across two.
fn across(v: Vec3, edges: &[Vec3]) -> Vec3 {
    let along = |n: Vec3| add([0.0; 3], dot(v, n) / dot(n, n), n);
    match *edges {
        [e] => add(v, -1.0, along(e)),
        [a, b] => along(cross(a, b)),
        _ => v,
    }
}

/// Returns the u in [-1, 1] with |p + u q| <= [`REACH`]; all of them if rounding prevents a decision.
fn near(p: Vec3, q: Vec3) -> [f64; 2] {
    let nearest = -dot(p, q) / dot(q, q);
    let closest = add(p, nearest, q);
    let room = REACH.powi(2) - dot(closest, closest);
    let reach = (room.max(0.0) / dot(q, q)).sqrt();
    if (nearest + reach).is_finite() {
        [nearest - reach, nearest + reach].map(|u| u.clamp(-1.0, 1.0))
    } else {
        [-1.0, 1.0]
    }
}

/// erf(b / √2) - erf(a / √2) for a <= b, without cancellation in the tails.
fn between(a: f64, b: f64) -> f64 {
    let r = std::f64::consts::FRAC_1_SQRT_2;
    if a > 0.0 {
        libm::erfc(a * r) - libm::erfc(b * r)
    } else if b < 0.0 {
        libm::erfc(-b * r) - libm::erfc(-a * r)
    } else {
        libm::erf(b * r) - libm::erf(a * r)
    }
}
