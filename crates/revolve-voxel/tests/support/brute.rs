//! Lines through solids by brute force: all candidates for intersections, and a point test half-way between two.
//!
//! No root decides: each piece of a meridian gives all roots of its double cone, on the piece or not; an additional root only divides an
//! interval. The midpoint of an interval decides whether it counts; if it is on the surface, the integral has two bounds.

use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;

/// Points within this distance of the surface count as on it.
const SURFACE: f64 = 1e-13;

/// Displacement of lines that tests the continuity of an integral: well above rounding and well below the grid of the solids. A shorter displacement,
/// as small as rounding, may touch an edge that this one passes.
const STEPS: [f64; 2] = [1e-9, 1e-12];

/// Displacement up the axis of a line along a face, and rotation of a line along a side.
const UP: f64 = 1e-10;
const ON: f64 = 1e-7;

/// Directions this near to a plane are in it; positions, up to a hundred times as much.
const IN_PLANE: f64 = 2e-14;

/// A solid of revolution in the lab: a closed outline in the half-plane (x, r), and its range of azimuths.
#[derive(Debug, Clone)]
pub(crate) struct Solid {
    outline: Vec<[f64; 2]>,
    azimuths: Option<[f64; 2]>,
    to_body: Isometry3<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Line {
    o: Point3<f64>,
    d: Vector3<f64>,
}

/// The limit of a line along plane surfaces of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Nudge {
    /// Along the face here: as a line farther up the axis.
    face: Option<f64>,
    /// Along a side: as a line rotated further about the axis.
    side: bool,
    /// The axis itself, in a side: as a line at azimuth 0.
    axis: bool,
}

const NOT: Nudge = Nudge {
    face: None,
    side: false,
    axis: false,
};

impl Solid {
    /// The solid under a meridian, which discs close where it ends off the axis.
    pub(crate) fn under(points: &[[f64; 2]]) -> Self {
        let mut outline = points.to_vec();
        outline.insert(0, [points[0][0], 0.0]);
        outline.push([points[points.len() - 1][0], 0.0]);
        Self::ring(&outline)
    }

    /// The solid within a closed outline.
    pub(crate) fn ring(points: &[[f64; 2]]) -> Self {
        Self {
            outline: points.to_vec(),
            azimuths: None,
            to_body: Isometry3::identity(),
        }
    }

    pub(crate) fn between(mut self, azimuths: [f64; 2]) -> Self {
        self.azimuths = Some(azimuths);
        self
    }

    /// The solid in a pose, body to lab.
    pub(crate) fn at(mut self, pose: &Isometry3<f64>) -> Self {
        self.to_body = pose.inverse();
        self
    }

    fn pieces(&self) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let n = self.outline.len();
        let pieces = (0..n).map(move |k| [self.outline[k], self.outline[(k + 1) % n]]);
        // On the axis there is no surface.
        pieces.filter(|[p, q]| p != q && p[1].max(q[1]) > 0.0)
    }

    /// A lab line in the body frame, displaced by a fraction of the usual step.
    fn line(&self, line: &Line, nudge: &Nudge, share: f64) -> Line {
        let (mut o, mut d) = (self.to_body * line.o, self.to_body * line.d);
        if nudge.side {
            let on = Isometry3::rotation(Vector3::x() * (ON * share));
            (o, d) = (on * o, on * d);
        }
        if let Some(x) = nudge.face {
            (o.x, d.x) = (x + UP * share, 0.0);
        }
        if nudge.axis {
            o = Point3::new(o.x, ON * share, 0.0);
            d = Vector3::x() * d.x.signum();
        }
        Line { o, d }
    }

    /// Whether a lab line lies in plane surfaces, to rounding.
    fn nudge(&self, line: &Line) -> Nudge {
        let Line { o, d } = self.line(line, &NOT, 0.0);
        let mut nudge = NOT;
        if d.x.abs() < IN_PLANE {
            let flat = self
                .pieces()
                .filter(|[p, q]| p[0] == q[0])
                .map(|[p, _]| p[0]);
            nudge.face = flat
                .into_iter()
                .find(|x| (x - o.x).abs() < 100.0 * IN_PLANE);
        }
        for azimuth in self.azimuths.into_iter().flatten() {
            let (sin, cos) = azimuth.sin_cos();
            let (depth, rate) = (o.z * cos - o.y * sin, d.z * cos - d.y * sin);
            if depth.abs() < 100.0 * IN_PLANE && rate.abs() < IN_PLANE {
                nudge.side = true;
                nudge.axis = d.y.hypot(d.z) < IN_PLANE && o.y.hypot(o.z) < 100.0 * IN_PLANE;
            }
        }
        nudge
    }

    /// Even-odd rule, in the half-plane and in the azimuth; `None` on the surface.
    fn holds(&self, p: &Point3<f64>) -> Option<bool> {
        let (x, r) = (p.x, p.y.hypot(p.z));
        let mut inside = false;
        for [p, q] in self.pieces() {
            let along = [q[0] - p[0], q[1] - p[1]];
            let from = [x - p[0], r - p[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let share = ((from[0] * along[0] + from[1] * along[1]) / square).clamp(0.0, 1.0);
            if (from[0] - share * along[0]).hypot(from[1] - share * along[1]) < SURFACE {
                return None;
            }
            let above = || r < p[1] + along[1] * (from[0] / along[0]);
            inside ^= (p[0] > x) != (q[0] > x) && above();
        }
        let azimuth = || p.z.atan2(p.y);
        let kept = self
            .azimuths
            .is_none_or(|[from, to]| (azimuth() - from).rem_euclid(TAU) < to - from);
        Some(inside && kept)
    }

    /// Parameters at which a line in the body frame may intersect the surface.
    fn cuts(&self, Line { o, d }: &Line, cuts: &mut Vec<f64>) {
        for [p, q] in self.pieces() {
            if p[0] == q[0] {
                cuts.push((p[0] - o.x) / d.x);
                continue;
            }
            // |p + v t|^2 dx^2 = (g0 + g1 t)^2 across the axis; the discriminant is a difference of two squares.
            let (dx, dr) = (q[0] - p[0], q[1] - p[1]);
            let (g0, g1) = (p[1] * dx + dr * (o.x - p[0]), dr * d.x);
            let a = (d.y * d.y + d.z * d.z) * dx * dx - g1 * g1;
            let b = (o.y * d.y + o.z * d.z) * dx * dx - g0 * g1;
            let c = (o.y * o.y + o.z * o.z) * dx * dx - g0 * g0;
            let m = (d.y * g0 - o.y * g1).hypot(d.z * g0 - o.z * g1);
            let k = (dx * (o.y * d.z - o.z * d.y)).abs();
            let root = dx.abs() * ((m - k) * (m + k)).max(0.0).sqrt();
            let q = -b - root.copysign(b);
            cuts.extend([q / a, c / q, -c / (2.0 * b)]);
        }
        for azimuth in self.azimuths.into_iter().flatten() {
            let (sin, cos) = azimuth.sin_cos();
            cuts.push((o.y * sin - o.z * cos) / (d.z * cos - d.y * sin));
        }
    }
}

impl Solid {
    /// Lengths of a lab line inside the solid between successive parameters.
    pub(crate) fn lengths(&self, o: &Point3<f64>, d: &Vector3<f64>, ends: &[f64]) -> Vec<f64> {
        let line = self.line(&Line { o: *o, d: *d }, &NOT, 0.0);
        let mut cuts = ends.to_vec();
        self.cuts(&line, &mut cuts);
        cuts.retain(|t| *t >= ends[0] && *t <= ends[ends.len() - 1]);
        cuts.sort_by(f64::total_cmp);
        let mut lengths = vec![0.0; ends.len() - 1];
        for pair in cuts.windows(2).filter(|pair| pair[1] > pair[0]) {
            let middle = 0.5 * (pair[0] + pair[1]);
            if self.holds(&(line.o + line.d * middle)) == Some(true) {
                // The middle of two neighbouring numbers may be the upper one, which may be the last end.
                let k = ends.partition_point(|end| *end <= middle) - 1;
                lengths[k.min(ends.len() - 2)] += pair[1] - pair[0];
            }
        }
        lengths
    }
}

/// Solids with activities, none negative, that add up where they overlap, in a medium of some attenuation.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) active: Vec<(f64, Solid)>,
    pub(crate) medium: Option<(f64, Solid)>,
}

impl Scene {
    pub(crate) fn of(solid: &Solid) -> Self {
        Self {
            active: vec![(1.0, solid.clone())],
            medium: None,
        }
    }

    fn solids(&self) -> impl Iterator<Item = &Solid> {
        self.active
            .iter()
            .chain(&self.medium)
            .map(|(_, solid)| solid)
    }

    /// Bounds of the integral along a line of the activity, each stretch weighted by `exp(-mu l)` with the length l of medium ahead of it: its range
    /// under small displacements and rotations of the line.
    pub(crate) fn bounds(&self, o: &Point3<f64>, d: &Vector3<f64>) -> [f64; 2] {
        let line = Line { o: *o, d: *d };
        let nudges: Vec<Nudge> = self.solids().map(|solid| solid.nudge(&line)).collect();
        let plain = nudges.iter().all(|nudge| *nudge == NOT);
        let value = |line: &Line, share: f64| self.integral(line, &nudges, share);
        let mut moved = Vec::new();
        for step in STEPS {
            // Along the axes and obliquely, but along no cone of a grid: an edge may be intersected from one side only.
            let by = Vector3::new(1.0, 2f64.sqrt(), 3f64.sqrt()) * step;
            for k in (0..27).filter(|&k| k != 13) {
                let to = Vector3::from([k % 3, k / 3 % 3, k / 9].map(|n| f64::from(n - 1)));
                let o = o + to.component_mul(&by);
                moved.push(value(&Line { o, d: *d }, 1.0));
            }
            for e in [Vector3::x(), Vector3::y(), Vector3::z()] {
                for s in [-step, step] {
                    let d = (d + e * s).normalize();
                    moved.extend(plain.then(|| value(&Line { o: *o, d }, 1.0)));
                }
            }
        }
        if !plain {
            moved.push(value(&line, 0.25));
        }
        let [low, high] = value(&line, 1.0);
        let change = |[a, b]: [f64; 2]| (a - low).abs().max((b - high).abs());
        let most = moved.into_iter().map(change).fold(0.0, f64::max);
        [low - 2.0 * most, high + 2.0 * most]
    }

    fn integral(&self, line: &Line, nudges: &[Nudge], share: f64) -> [f64; 2] {
        let solids = self.solids().zip(nudges);
        let lines: Vec<Line> = solids
            .map(|(solid, n)| solid.line(line, n, share))
            .collect();
        let mut cuts = Vec::new();
        for (solid, line) in self.solids().zip(&lines) {
            solid.cuts(line, &mut cuts);
        }
        // All solids here are a few units wide, and lines start near them.
        cuts.retain(|t| t.abs() < 1e3);
        cuts.sort_by(f64::total_cmp);
        let (mut sums, mut ahead) = ([0.0; 2], [0.0; 2]);
        for pair in cuts.windows(2).rev() {
            let (length, middle) = (pair[1] - pair[0], 0.5 * (pair[0] + pair[1]));
            let held = self
                .solids()
                .zip(&lines)
                .map(|(solid, line)| solid.holds(&(line.o + line.d * middle)));
            let held: Vec<Option<bool>> = held.collect();
            for (bound, on_surface) in [false, true].into_iter().enumerate() {
                let active = self.active.iter().zip(&held);
                let counted = active.filter(|(_, held)| held.unwrap_or(on_surface));
                let activity: f64 = counted.map(|((weight, _), _)| weight).sum();
                // The integral decreases with the length of the medium.
                let mu = match (&self.medium, held.last()) {
                    (Some((mu, _)), Some(held)) if held.unwrap_or(!on_surface) => *mu,
                    _ => 0.0,
                };
                let weakened = if mu > 0.0 {
                    -(-mu * length).exp_m1() / mu
                } else {
                    length
                };
                sums[bound] += activity * f64::exp(-ahead[bound]) * weakened;
                ahead[bound] += mu * length;
            }
        }
        sums
    }
}
