//! Covered fraction of a box crossed by one nearly flat part of the surface.
//!
//! A plane near the surface is clipped in closed form. The difference from the surface is integrated over the face most nearly
//! parallel to the plane: in closed form along one side, by Gauss-Legendre quadrature across it.

use nalgebra::{Point3, Vector3};

use crate::voxels::field::Line;
use crate::voxels::plane_clip::fraction_below;

/// Nodes across a face (Gauss-Legendre) and along it (equally spaced). Between the latter the clipped heights have an integral in closed
/// form, also where the surface leaves the box.
const ACROSS: usize = 6;
const ALONG: usize = 8;

/// Gauss-Legendre nodes and weights on [-1, 1].
const NODES: [f64; ACROSS] = [
    -0.932469514203152,
    -0.6612093864662645,
    -0.2386191860831969,
    0.2386191860831969,
    0.6612093864662645,
    0.932469514203152,
];
const WEIGHTS: [f64; ACROSS] = [
    0.1713244923791704,
    0.3607615730481386,
    0.467913934572691,
    0.467913934572691,
    0.3607615730481386,
    0.1713244923791704,
];

/// Columns through a face: positions across and along it, and the weights of columns and of the intervals that begin at them,
/// each with the sum 1.
const COLUMNS: usize = ACROSS * ALONG;
const U: [f64; COLUMNS] = columns(NODES, [1.0; ALONG]);
const V: [f64; COLUMNS] = columns([1.0; ACROSS], EQUAL);
const WEIGHT: [f64; COLUMNS] = columns(WEIGHTS, [0.5 / ALONG as f64; ALONG]);
const INTERVAL: [f64; COLUMNS] = columns(WEIGHTS, {
    let mut intervals = [0.5 / (ALONG - 1) as f64; ALONG];
    intervals[ALONG - 1] = 0.0;
    intervals
});
const EQUAL: [f64; ALONG] = {
    let mut equal = [0.0; ALONG];
    let mut k = 0;
    while k < ALONG {
        equal[k] = -1.0 + 2.0 * k as f64 / (ALONG - 1) as f64;
        k += 1;
    }
    equal
};

const fn columns(u: [f64; ACROSS], v: [f64; ALONG]) -> [f64; COLUMNS] {
    let mut product = [0.0; COLUMNS];
    let mut k = 0;
    while k < COLUMNS {
        product[k] = u[k / ALONG] * v[k % ALONG];
        k += 1;
    }
    product
}

/// Coefficients of the error estimate: of the range of the surface over the plane in box heights, of the bound on its curvature (its square is
/// that of the residual of one step to the surface), and of the largest angle in it. Measured: on 10^7 boxes of random bodies errors
/// above 1e-4 were at most 0.75 of the estimate, with sections as reference.
const OF_SPREAD: f64 = 0.012;
const OF_BENDS: f64 = 0.002;
const OF_BENDS_SQUARED: f64 = 0.045;
const OF_ANGLE: f64 = 0.025;

/// Part of the estimate for a corner of the box beyond the surface, between the columns: up to 6e-5 in those bodies.
const CORNER: f64 = 8e-5;

/// The step to the surface uses the slope at the point nearest to the centre of the box. In a cube the errors on both sides of the
/// centre cancel and are covered by the terms above; this term covers long edges and kinks that leave the plane by more than this
/// fraction of the height of the box.
const KINK: f64 = 0.15;
const OF_KINK: f64 = 0.1;

/// The relation of a nearly flat surface to a box.
pub(crate) enum Patch {
    /// The box is too near to the axis.
    Unknown,
    /// It misses the box, which is inside or outside.
    Clear(bool),
    /// It covers a fraction of the box, with an error estimate.
    Covered { fraction: f64, error: f64 },
}

/// A box in the body frame.
pub(crate) struct Cuboid<'a> {
    pub(crate) centre: &'a Point3<f64>,
    /// Unit vectors along its edges.
    pub(crate) axes: &'a [Vector3<f64>; 3],
    /// Half of its edges' lengths, and of its diagonal's.
    pub(crate) half: [f64; 3],
    pub(crate) radius: f64,
}

/// The surface on which the largest (`reflex`: the smallest) of the heights of the lines is zero, in a box.
pub(crate) struct Surface<'a> {
    pub(crate) lines: &'a [Line],
    pub(crate) reflex: bool,
    pub(crate) cuboid: &'a Cuboid<'a>,
}

impl simd_set::Work for Surface<'_> {
    type Out = Patch;

    #[inline(always)]
    fn run(self) -> Patch {
        let Self {
            lines,
            reflex,
            cuboid,
        } = self;
        let &Cuboid { centre, axes, .. } = cuboid;
        let (half, radius) = (cuboid.half, cuboid.radius);
        let s = if reflex { -1.0 } else { 1.0 };
        let r = (centre.y * centre.y + centre.z * centre.z).sqrt();
        let (height, nearest, lines) = in_box(lines, s, [centre.x, r], radius);
        let Line { a, b, .. } = *nearest;
        let offset = s * height;
        let radial = b / r;
        let gradient = Vector3::new(a, radial * centre.y, radial * centre.z);
        let normal = axes.map(|e| e.dot(&gradient));
        // Bound on the distance of the surface from a plane. Along the meridian it turns; around the axis, a distance from the axis
        // differs from its linear part, within a ball that does not meet the axis, by at most the radius of the ball times the tangent
        // of half its angular size.
        let sine = radius / r;
        if sine >= 1.0 {
            return Patch::Unknown;
        }
        let turned = radius * turn(&lines[0], &lines[lines.len() - 1]);
        let rounding = radius * sine / (1.0 + (1.0 - sine * sine).sqrt());
        let round = b.abs() * rounding;
        // Columns along the edge most nearly perpendicular to the plane, in box units.
        let steep = [0, 1, 2].map(|i| normal[i].abs() * half[i]);
        if height.abs() >= steep[0] + steep[1] + steep[2] + turned + round {
            return Patch::Clear(offset < 0.0);
        }
        let e = match steep {
            [a, b, c] if a > b && a > c => 0,
            [_, b, c] if b > c => 1,
            _ => 2,
        };
        // Nodes are equally spaced along v, the more nearly perpendicular to the plane of the other edges.
        let (u, v) = match ((e + 1) % 3, (e + 2) % 3) {
            (u, v) if steep[u] > steep[v] => (v, u),
            others => others,
        };
        let inv = 1.0 / normal[e];
        let h = half[e];
        let (du, dv) = (axes[u] * half[u], axes[v] * half[v]);
        let level = [
            -offset * inv,
            -normal[u] * half[u] * inv,
            -normal[v] * half[v] * inv,
        ];
        // One loop over the columns per step, for vectorisation.
        let mut plane = [0.0; COLUMNS];
        for k in 0..COLUMNS {
            plane[k] = level[0] + level[1] * U[k] + level[2] * V[k];
        }
        let height = heights_over(lines, s, centre, [&du, &dv, &axes[e]], &plane, h);
        // The plane moves to the average of the surface over the columns.
        let (mut surface, mut rise, mut seen) = ([0.0; COLUMNS], [0.0; COLUMNS], [0.0; COLUMNS]);
        for k in 0..COLUMNS {
            let step = -s * inv * height[k];
            seen[k] = if plane[k].abs() < h { WEIGHT[k] } else { 0.0 };
            rise[k] = seen[k] * step;
            surface[k] = clip(plane[k], h) + step;
        }
        let seen = fold(&seen, |a, b| a + b);
        let lift = if seen > 0.0 {
            fold(&rise, |a, b| a + b) / seen
        } else {
            0.0
        };
        // The mean of a parabola between two nodes is lower than that of its chord by a twelfth of the second difference.
        let mut bend = 0.0;
        for (row, weight) in surface.as_chunks::<ALONG>().0.iter().zip(WEIGHTS) {
            bend += weight * (row[1] - row[0] + row[ALONG - 2] - row[ALONG - 1]);
        }
        let bend = bend / (24 * (ALONG - 2)) as f64;
        let mut change = [0.0; COLUMNS];
        for k in 0..COLUMNS {
            plane[k] += lift;
            surface[k] += bend;
            change[k] = clip(surface[k], h) - clip(plane[k], h);
        }
        let spread = larger(fold(&change, larger), 0.0) - smaller(fold(&change, smaller), 0.0);
        let correction = (mean_within(&surface, h) - mean_within(&plane, h)) / (2.0 * h);
        let spread = spread / (2.0 * h);
        let heights = inv.abs() / (2.0 * h);
        let bends = (0.5 * turned + round) * heights;
        let below = fraction_below(normal, offset - lift * normal[e], half);
        Patch::Covered {
            fraction: (below + correction * inv.signum()).clamp(0.0, 1.0),
            error: error(lines, [spread, bends, rounding], heights, [h, radius]),
        }
    }
}

/// Returns the mean over the face of the heights, clipped to the box of half height `h` and linear between nodes along the face.
#[inline(always)]
fn mean_within(height: &[f64; COLUMNS], h: f64) -> f64 {
    // The integral of the clipped height.
    let mut integral = [0.0; COLUMNS];
    for k in 0..COLUMNS {
        let clipped = clip(height[k], h);
        integral[k] = clipped * (height[k] - 0.5 * clipped);
    }
    let mut mean = [0.0; COLUMNS];
    for k in 0..COLUMNS - 1 {
        let rise = height[k + 1] - height[k];
        let middle = clip(0.5 * (height[k] + height[k + 1]), h);
        let steep = rise.abs() > 1e-8 * h;
        let ratio = (integral[k + 1] - integral[k]) / if steep { rise } else { 1.0 };
        mean[k] = INTERVAL[k] * if steep { ratio } else { middle };
    }
    fold(&mean, |a, b| a + b)
}

/// Returns the largest height of the lines over a point (times `s`), its line, and the lines from the first to the last with a segment in
/// a box of that radius.
#[inline(always)]
fn in_box(lines: &[Line], s: f64, [x, r]: [f64; 2], radius: f64) -> (f64, &Line, &[Line]) {
    let (mut height, mut nearest) = (f64::NEG_INFINITY, 0);
    for (k, l) in lines.iter().enumerate() {
        let h = s * l.height(x, r);
        if h > height {
            (height, nearest) = (h, k);
        }
    }
    let within = |l: &Line| {
        let (dx, dr) = (l.start[0] - x, l.start[1] - r);
        dx * dx + dr * dr < radius * radius
    };
    // Not from the nearest outward: of segments on one line each is as near, and a crease may be at the end of another.
    let (mut first, mut last) = (nearest, nearest);
    for k in 1..lines.len() {
        if within(&lines[k]) {
            (first, last) = (first.min(k - 1), last.max(k));
        }
    }
    (height, &lines[nearest], &lines[first..=last])
}

/// Returns the largest height of the lines (times `s`) at the position of the plane in each column, within half its height `h`.
#[inline(always)]
fn heights_over(
    lines: &[Line],
    s: f64,
    centre: &Point3<f64>,
    [du, dv, along]: [&Vector3<f64>; 3],
    plane: &[f64; COLUMNS],
    h: f64,
) -> [f64; COLUMNS] {
    let (mut x, mut rho) = ([0.0; COLUMNS], [0.0; COLUMNS]);
    for k in 0..COLUMNS {
        let t = clip(plane[k], h);
        x[k] = centre.x + du.x * U[k] + dv.x * V[k] + along.x * t;
        let y = centre.y + du.y * U[k] + dv.y * V[k] + along.y * t;
        let z = centre.z + du.z * U[k] + dv.z * V[k] + along.z * t;
        rho[k] = (y * y + z * z).sqrt();
    }
    let mut height = [f64::NEG_INFINITY; COLUMNS];
    for l in lines {
        let (a, b, c) = (s * l.a, s * l.b, s * l.c);
        for k in 0..COLUMNS {
            height[k] = larger(height[k], a * x[k] + b * rho[k] + c);
        }
    }
    height
}

/// Returns an error estimate of the fraction, for columns of half height `h`; lengths across them are in box `heights`.
#[inline(always)]
fn error(
    lines: &[Line],
    [spread, bends, rounding]: [f64; 3],
    heights: f64,
    [h, radius]: [f64; 2],
) -> f64 {
    // Bound on the relative change of the slope along a column, and the fraction of the diagonal: 0 in a cube.
    let kink = (lines.windows(2)).fold(0.0, |most, pair| larger(most, turn(&pair[0], &pair[1])));
    let kink = kink * radius * heights;
    let most_radial = lines.iter().fold(0.0, |most, l| larger(most, l.b.abs()));
    let slope = (2.0 * kink + 4.0 * most_radial * rounding * heights) * h / radius;
    let long = larger(1.5 * (h / radius) * (h / radius) - 0.5, 0.0);
    let missed = long * bends * slope + OF_KINK * kink * larger(kink - KINK, 0.0);
    let curved = OF_BENDS * bends + OF_BENDS_SQUARED * bends * bends;
    CORNER
        + (1.0 + long) * (OF_SPREAD * spread + curved + OF_ANGLE * kink)
        + missed / larger(1.0 - slope, 1e-6)
}

#[inline(always)]
fn clip(t: f64, h: f64) -> f64 {
    smaller(larger(t, -h), h)
}

/// Sine of the angle between two lines.
#[inline(always)]
fn turn(from: &Line, to: &Line) -> f64 {
    (from.a * to.b - from.b * to.a).abs()
}

/// Four at a time.
#[inline(always)]
fn fold(values: &[f64; COLUMNS], with: impl Fn(f64, f64) -> f64) -> f64 {
    let mut lanes = [values[0], values[1], values[2], values[3]];
    for four in values[4..].as_chunks::<4>().0 {
        for i in 0..4 {
            lanes[i] = with(lanes[i], four[i]);
        }
    }
    with(with(lanes[0], lanes[1]), with(lanes[2], lanes[3]))
}

/// Not `f64::max` and `f64::min`, which handle NaN: these are single instructions.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
