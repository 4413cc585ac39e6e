//! Thickness of a wall: distance of its inner surface from the outer one.
//!
//! The nearest point of a surface of revolution lies in the half-plane of the given point, so only the outer curve is searched. The
//! open end of a wall does not count.

use crate::wall::root::{golden, rising_root};
use crate::{Curve, Shell};

/// Steps of the search for the minimum: to half the digits of s, which gives all digits of the thickness.
const SEARCH: usize = 40;

/// Thickness of a wall, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Thickness {
    /// Smallest thickness.
    pub minimum: f64,
    /// Its parameter on the inner curve.
    pub thinnest_at: f64,
    /// Average over the inner surface.
    pub mean: f64,
}

impl Shell {
    /// Returns the distance from the point of the inner curve at `s`, clamped to its range, to the outer curve, cm; NaN for NaN.
    #[must_use]
    pub fn thickness(&self, s: f64) -> f64 {
        let [first, last] = self.isolines.range;
        let outer = &self.isolines.outer;
        let from = self.isolines.inner.at(s.clamp(first, last)).position;
        let gap = |s: f64| {
            let to = outer.at(s).position;
            (to[0] - from[0]).hypot(to[1] - from[1])
        };
        let places = self.lines.iter().map(|line| line.s);
        let gaps: Vec<f64> = places.map(gap).collect();
        let k = (0..gaps.len()).fold(0, |best, k| if gaps[k] < gaps[best] { k } else { best });
        // The distance decreases before its minimum and increases after it.
        let neighbours = [k.saturating_sub(1), k, (k + 1).min(gaps.len() - 1)];
        let neighbours = neighbours.map(|k| self.lines[k].s);
        neighbours.windows(2).fold(gaps[k], |best, ends| {
            let [low, high] = [ends[0], ends[1]];
            let s = rising_root(|s| slope(outer, from, s), [low, high], 0.5 * (low + high));
            best.min(gap(s))
        })
    }

    /// Returns the smallest and the average thickness of the wall: the minimum over at least 128 points, refined, and the average
    /// by two-point Gauss quadrature between them (relative error 1e-6 for a smooth wall).
    #[must_use]
    pub fn thicknesses(&self) -> Thickness {
        let inner = &self.isolines.inner;
        let places: Vec<f64> = self.lines.iter().map(|line| line.s).collect();
        let (mut weight, mut sum) = (0.0, 0.0);
        for pair in places.windows(2) {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            for side in [-1.0, 1.0] {
                let s = middle + side * half / 3.0_f64.sqrt();
                let at = inner.at(s);
                let area = half * at.position[1] * at.first[0].hypot(at.first[1]);
                weight += area;
                sum += area * self.thickness(s);
            }
        }
        let all: Vec<f64> = places.iter().map(|&s| self.thickness(s)).collect();
        let k = (0..all.len()).fold(0, |best, k| if all[k] < all[best] { k } else { best });
        // Between the neighbours of the minimum.
        let ends = [k.saturating_sub(1), (k + 1).min(places.len() - 1)].map(|k| places[k]);
        let (s, least) = golden(|s| self.thickness(s), ends, false, SEARCH);
        let (minimum, thinnest_at) = match least < all[k] {
            true => (least, s),
            false => (all[k], places[k]),
        };
        Thickness {
            minimum,
            thinnest_at,
            mean: sum / weight,
        }
    }
}

/// Half the derivative of the squared distance from a point with respect to the parameter of the curve, and its derivative.
fn slope(curve: &Curve, from: [f64; 2], s: f64) -> (f64, f64) {
    let at = curve.at(s);
    let d = [0, 1].map(|k| at.position[k] - from[k]);
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    (
        dot(d, at.first),
        dot(at.first, at.first) + dot(d, at.second),
    )
}
