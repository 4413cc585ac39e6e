//! Isoparametric lines, which connect two curves at equal parameter and fill the wall.

use std::f64::consts::PI;

use crate::solid::curve::{Curve, CurvePoint};
use crate::voxels::disc::cross;
use crate::wall::root::rising_root;

/// An end of the meridian within this distance of the axis, relative to the size, is on it.
pub(crate) const ON_AXIS: f64 = 1e-12;

/// Within this fraction of the parameter range from an end on the axis, the ratio of radii is computed from derivatives, with an
/// error of the square of this.
const NEAR_AXIS: f64 = 5e-7;

/// Two curves with a common parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Isolines {
    pub(crate) inner: Curve,
    pub(crate) outer: Curve,
    pub(crate) range: [f64; 2],
    /// Largest side of the bounding box of the lines.
    pub(crate) size: f64,
    /// Whether each end is on the axis.
    pub(crate) on_axis: [bool; 2],
}

/// The line of one s with its volume element.
pub(crate) struct Isoline {
    pub(crate) inner: CurvePoint,
    pub(crate) outer: CurvePoint,
    pub(crate) line: [f64; 2],
    /// r and J at t = 0 and t = 1; near an end on the axis r over the distance from it in s.
    pub(crate) r: [f64; 2],
    pub(crate) jacobian: [f64; 2],
}

impl Isolines {
    /// The lines of several s, including both ends of the range.
    pub(crate) fn new(inner: Curve, outer: Curve, range: [f64; 2], places: &[f64]) -> Self {
        let mut bounds = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for &s in places {
            for p in [inner.at(s).position, outer.at(s).position] {
                for k in 0..2 {
                    bounds[0][k] = bounds[0][k].min(p[k]);
                    bounds[1][k] = bounds[1][k].max(p[k]);
                }
            }
        }
        let [low, high] = bounds;
        let size = (high[0] - low[0]).max(high[1] - low[1]);
        let on_axis = range.map(|s| {
            [&inner, &outer]
                .iter()
                .all(|c| c.at(s).position[1].abs() <= ON_AXIS * size)
        });
        Self {
            inner,
            outer,
            range,
            size,
            on_axis,
        }
    }

    pub(crate) fn at(&self, s: f64) -> Isoline {
        let (inner, outer) = (self.inner.at(s), self.outer.at(s));
        let line = less(outer.position, inner.position);
        let mut r = [inner.position[1], outer.position[1]];
        let near = NEAR_AXIS * (self.range[1] - self.range[0]);
        for (end, on_axis) in self.range.iter().zip(self.on_axis) {
            let way = end - s;
            if on_axis && way.abs() < near {
                r = [&inner, &outer].map(|c| (c.first[1] + 0.5 * way * c.second[1]).abs());
            }
        }
        Isoline {
            r,
            jacobian: [cross(inner.first, line), cross(outer.first, line)],
            inner,
            outer,
            line,
        }
    }

    /// Signed distance of a point behind the line of `s` (times its length), and its derivative.
    #[inline(always)]
    pub(crate) fn before(&self, p: [f64; 2], s: f64) -> (f64, f64) {
        let (inner, outer) = (self.inner.at(s), self.outer.at(s));
        let line = less(outer.position, inner.position);
        let from = less(p, inner.position);
        let turn = less(outer.first, inner.first);
        (
            cross(from, line),
            cross(inner.first, line) - cross(from, turn),
        )
    }
}

impl Isoline {
    /// Derivatives of r with respect to s.
    pub(crate) fn r_rate(&self) -> [f64; 2] {
        [self.inner.first[1], self.outer.first[1]]
    }

    /// Volume per unit of s.
    pub(crate) fn volume(&self) -> f64 {
        let r = [self.inner.position[1], self.outer.position[1]];
        2.0 * PI * below(r, self.jacobian, 1.0)
    }

    pub(crate) fn point(&self, t: f64) -> [f64; 2] {
        // Exact at both ends.
        let ends = [self.inner.position, self.outer.position];
        [
            mix([ends[0][0], ends[1][0]], t),
            mix([ends[0][1], ends[1][1]], t),
        ]
    }

    /// Returns the fraction of the volume of the element below t.
    pub(crate) fn share(&self, t: f64) -> f64 {
        let whole = below(self.r, self.jacobian, 1.0);
        if whole > 0.0 {
            (below(self.r, self.jacobian, t) / whole).clamp(0.0, 1.0)
        } else {
            t
        }
    }

    /// Returns the t below which the given fraction of the volume of the element lies.
    pub(crate) fn height(&self, share: f64) -> f64 {
        let whole = below(self.r, self.jacobian, 1.0);
        if !(whole > 0.0 && share > 0.0 && share < 1.0) {
            return share;
        }
        let f = |t: f64| {
            (
                below(self.r, self.jacobian, t) / whole - share,
                mix(self.r, t) * mix(self.jacobian, t) / whole,
            )
        };
        rising_root(f, [0.0, 1.0], share)
    }
}

/// A quantity that is linear between both ends.
pub(crate) fn mix(ends: [f64; 2], t: f64) -> f64 {
    (1.0 - t) * ends[0] + t * ends[1]
}

/// The integral from 0 to t of the product of two such quantities.
pub(crate) fn below(a: [f64; 2], b: [f64; 2], t: f64) -> f64 {
    let (da, db) = (a[1] - a[0], b[1] - b[0]);
    t * (a[0] * b[0] + t * ((a[0] * db + da * b[0]) / 2.0 + t * da * db / 3.0))
}

pub(crate) fn less(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

pub(crate) fn norm(a: [f64; 2]) -> f64 {
    (a[0] * a[0] + a[1] * a[1]).sqrt()
}
