//! Volume of a box inside a solid, by cross-sections perpendicular to the axis.
//!
//! A plane perpendicular to the axis intersects the solid in discs and the box in a convex polygon. The area of a polygon inside a
//! disc is a sum over its edges of triangles and sectors, in closed form; the sum over axial positions is a one-dimensional
//! integral. Singularities of the meridian in the box (creases, thin walls, the axis) are at known axial positions, the ends of its
//! segments. Between these and the corners of the box the area is smooth except where the circle passes a corner of the polygon or
//! touches an edge, which bisection finds.

use std::f64::consts::TAU;

use crate::solid::chains::Chain;
use crate::solid::meridian::Meridian;
use crate::solid::wedge::Wedge;
use crate::voxels::breaks::Breaks;
use crate::voxels::disc::{angle, between, cross, sector_sum, within};
use crate::voxels::patch::Cuboid;
use crate::voxels::plane_clip::fraction_below;
use crate::voxels::runs::{COARSE, Run, Runs};
use crate::voxels::wedge_cut::Cut;

/// Half of the distance between the two Gauss points of an interval of half-length one.
const GAUSS: f64 = 0.577_350_269_189_625_8;

/// Largest number of bisections: 2^-20 of a box is below any tolerance.
const DEEPEST: u32 = 20;

/// A box in the body frame, with axial coordinates from the middle of the meridian.
pub(crate) struct Sections<'a> {
    meridian: &'a Meridian,
    centre: [f64; 3],
    /// Half edges, by ascending axial component, which is not negative.
    edges: [[f64; 3]; 3],
    faces: [Face; 3],
    /// Axial coordinates of the corners, ascending.
    corners: [f64; 8],
    /// Bounds of the distance from the axis.
    rho: [f64; 2],
    /// Square of half the diagonal.
    radius2: f64,
    volume: f64,
    tolerance: f64,
    /// Whether the tolerance is coarse.
    coarse: bool,
    wedge: Option<Cut<'a>>,
    /// Segments processed together.
    runs: &'a Runs,
    /// Number of cross-sections.
    pub(crate) evaluations: u64,
}

/// A pair of opposite faces.
#[derive(Clone, Copy, Default)]
struct Face {
    /// Inverse axial components of the steeper edge and of the other.
    inv: [f64; 2],
    /// +1 if the section runs anticlockwise on the first face of the pair; 0 if sections are parallel to it.
    turn: f64,
}

/// For faces perpendicular to edge i: the other edges, the steeper one first.
const OTHERS: [[usize; 2]; 3] = [[2, 1], [2, 0], [1, 0]];

impl<'a> Sections<'a> {
    /// `tolerance` is a fraction of the box, for which the `runs` were made.
    pub(crate) fn new(
        meridian: &'a Meridian,
        runs: &'a Runs,
        cuboid: &Cuboid<'_>,
        tolerance: f64,
    ) -> Self {
        let mut edges = [0, 1, 2].map(|i| {
            let e = cuboid.axes[i] * cuboid.half[i];
            if e.x < 0.0 {
                [-e.x, -e.y, -e.z]
            } else {
                [e.x, e.y, e.z]
            }
        });
        let centre = cuboid.centre;
        edges.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let faces = [0, 1, 2].map(|i| {
            let [j, k] = OTHERS[i].map(|o| edges[o]);
            if j[0] <= 0.0 {
                return Face::default();
            }
            let slope = k[0] / j[0];
            let along = [k[1] - slope * j[1], k[2] - slope * j[2]];
            let turn = edges[i][1] * along[1] - edges[i][2] * along[0];
            Face {
                inv: [1.0 / j[0], 1.0 / k[0]],
                turn: turn.signum(),
            }
        });
        let c = [centre.x - meridian.mid(), centre.y, centre.z];
        let mut corners = [0.0; 8];
        let mut largest = 0.0f64;
        for (corner, x) in corners.iter_mut().enumerate() {
            let mut p = c;
            for (i, e) in edges.iter().enumerate() {
                let s = if corner >> i & 1 == 1 { 1.0 } else { -1.0 };
                for a in 0..3 {
                    p[a] += s * e[a];
                }
            }
            *x = p[0];
            largest = largest.max(p[1] * p[1] + p[2] * p[2]);
        }
        corners.sort_by(f64::total_cmp);
        let volume = 8.0 * cuboid.half.iter().product::<f64>();
        let radius = cuboid.radius;
        Self {
            meridian,
            rho: [(c[1].hypot(c[2]) - radius).max(0.0), largest.sqrt()],
            centre: c,
            edges,
            faces,
            corners,
            radius2: radius * radius,
            volume,
            tolerance: 0.5 * tolerance * volume,
            coarse: tolerance >= COARSE,
            wedge: None,
            runs,
            evaluations: 0,
        }
    }

    /// As `new`, for the part of the box inside a wedge; fractions are still of the whole box.
    pub(crate) fn within(mut self, wedge: &'a Wedge) -> Self {
        let mut stops = self.corners.to_vec();
        let corner = |s: f64, t: f64, [j, k]: [usize; 2]| {
            [0, 1, 2].map(|n| self.centre[n] + s * self.edges[j][n] + t * self.edges[k][n])
        };
        for i in 0..3 {
            let e = &self.edges[i];
            for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let p = corner(s, t, OTHERS[i]);
                for [y, z] in wedge.normals() {
                    // Not finite if the edge runs along the side.
                    let u = -(y * p[1] + z * p[2]) / (y * e[1] + z * e[2]);
                    if u.abs() < 1.0 {
                        stops.push(p[0] + u * e[0]);
                    }
                }
            }
            // Crossings of the axis with the faces.
            for side in [1.0, -1.0] {
                let across = e[1] * self.centre[1] + e[2] * self.centre[2];
                let square: f64 = e.iter().map(|v| v * v).sum();
                stops.push(self.centre[0] + (across + side * square) / e[0]);
            }
        }
        let [low, .., high] = self.corners;
        stops.retain(|x| (low..=high).contains(x));
        stops.sort_by(f64::total_cmp);
        let mut cut = Cut {
            wedge,
            stops: stops.into_iter().map(|x| [x, 0.0]).collect(),
        };
        for k in 1..cut.stops.len() {
            let [from, below] = cut.stops[k - 1];
            cut.stops[k][1] = below + self.slab([from, cut.stops[k][0]], &cut);
        }
        self.wedge = Some(cut);
        self
    }

    /// Volume of the part of the box between two sections with no corner between them: the area is a quadratic.
    fn slab(&self, [a, b]: [f64; 2], cut: &Cut<'_>) -> f64 {
        let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
        let at = |x: f64| {
            let (outline, n) = self.outline(x);
            cut.sum(&outline[..n], cross)
        };
        0.5 * h * (at(m - GAUSS * h) + at(m + GAUSS * h))
    }

    /// Returns the fraction of the box inside the solid.
    pub(crate) fn fraction(&mut self) -> f64 {
        (self.stretch(0) / self.volume).clamp(0.0, 1.0)
    }

    /// Signed volume under a part of the meridian.
    fn stretch(&mut self, node_idx: usize) -> f64 {
        let meridian = self.meridian;
        let node = &meridian.tree()[node_idx];
        let [low, high] = self.rho;
        if node.x[0] >= self.corners[7] || node.x[1] <= self.corners[0] || node.r2[1] <= low * low {
            return 0.0;
        }
        if node.r2[0] >= high * high {
            return self.below(node.path[1]) - self.below(node.path[0]);
        }
        match node.chain {
            Some(k) => {
                let chain = &meridian.chains()[k];
                chain.sign * self.under(chain, self.runs.of(k))
            }
            None => {
                let left = node_idx + 1;
                self.stretch(left) + self.stretch(meridian.tree()[left].after)
            }
        }
    }

    /// Volume of the part of the box below an axial coordinate.
    fn below(&self, x: f64) -> f64 {
        if let Some(cut) = &self.wedge {
            let k = cut.stops.partition_point(|stop| stop[0] <= x).max(1) - 1;
            let [from, below] = cut.stops[k];
            return below + self.slab([from, x.clamp(from, self.corners[7])], cut);
        }
        let edges = self.edges.map(|e| e[0]);
        self.volume * fraction_below(edges, self.centre[0] - x, [1.0; 3])
    }

    /// Volume under a chain, cut into runs at these vertices.
    fn under(&mut self, chain: &Chain, stops: &[u32]) -> f64 {
        let vs = &chain.vertices;
        let [low, high] = self.rho;
        let before = |&stop: &u32| vs[stop as usize].x <= self.corners[0];
        let first = stops.partition_point(before).max(1) - 1;
        let mut sum = 0.0;
        for pair in stops[first..].windows(2) {
            let run = &vs[pair[0] as usize..=pair[1] as usize];
            let (v, w) = (&run[0], &run[run.len() - 1]);
            let (from, to) = (v.x.max(self.corners[0]), w.x.min(self.corners[7]));
            if v.x >= self.corners[7] {
                break;
            }
            // A segment may be too steep for its ends to differ.
            if from >= to {
                continue;
            }
            // The radius is concave.
            if v.r.min(w.r) >= high {
                sum += self.below(to) - self.below(from);
                continue;
            }
            if run.iter().all(|v| v.r <= low) {
                continue;
            }
            let run = Run::new(run);
            let mut breaks = Breaks::new(from, to);
            for &x in &self.corners {
                breaks.add(x);
            }
            self.edge_crossings(run.cone, &mut breaks);
            self.face_touches(run.cone, &mut breaks);
            if let Some(cut) = &self.wedge {
                for &[x, _] in &cut.stops {
                    breaks.add(x);
                }
                self.side_crossings(run.cone, cut.wedge, &mut breaks);
            }
            for panel in breaks.sorted().windows(2) {
                sum += self.panel([panel[0], panel[1]], &run);
            }
        }
        sum
    }

    /// Axial positions at which the cone crosses edges of the box.
    fn edge_crossings(&self, cone: [f64; 2], breaks: &mut Breaks) {
        for i in 0..3 {
            let e = &self.edges[i];
            if e[0] <= 0.0 {
                continue;
            }
            let beta = cone[1] * e[0];
            let a = e[1] * e[1] + e[2] * e[2] - beta * beta;
            let [j, k] = OTHERS[i].map(|o| &self.edges[o]);
            for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                let p = [0, 1, 2].map(|n| self.centre[n] + s * j[n] + t * k[n]);
                let alpha = cone[0] + cone[1] * p[0];
                let b = p[1] * e[1] + p[2] * e[2] - alpha * beta;
                let c = p[1] * p[1] + p[2] * p[2] - alpha * alpha;
                // The sign changes between the ends, or twice.
                let [low, high] = [a - 2.0 * b + c, a + 2.0 * b + c];
                if low * high > 0.0 && b.abs() >= a.abs() {
                    continue;
                }
                let disc = b * b - a * c;
                if disc <= 0.0 {
                    continue;
                }
                let q = -b - disc.sqrt().copysign(b);
                for u in [q / a, c / q] {
                    if u.abs() < 1.0 {
                        breaks.add(p[0] + u * e[0]);
                    }
                }
            }
        }
    }

    /// Axial positions at which the circle of the cone touches a face from within its plane.
    fn face_touches(&self, cone: [f64; 2], breaks: &mut Breaks) {
        for i in 0..3 {
            let e = &self.edges[i];
            let across2 = e[1] * e[1] + e[2] * e[2];
            // The contact point of a circle about the axis is on the normal of the face through the axis.
            let aside = self.centre[1] * e[2] - self.centre[2] * e[1];
            if across2 <= 0.0 || aside * aside > self.radius2 * across2 {
                continue;
            }
            let across = across2.sqrt();
            let dot = |p: &[f64; 3], q: &[f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
            for side in [1.0, -1.0] {
                let plane = dot(&self.centre, e) + side * dot(e, e);
                for sign in [across, -across] {
                    let x = (plane - sign * cone[0]) / (e[0] + sign * cone[1]);
                    let along = (plane - x * e[0]) / across2;
                    let p = [
                        x - self.centre[0],
                        along * e[1] - self.centre[1],
                        along * e[2] - self.centre[2],
                    ];
                    let within = |o: usize| {
                        let other = &self.edges[o];
                        dot(&p, other).abs() < dot(other, other)
                    };
                    if OTHERS[i].into_iter().all(within) {
                        breaks.add(x);
                    }
                }
            }
        }
    }

    /// Axial positions at which the cone crosses the lines of intersection of the sides of the wedge with the faces.
    fn side_crossings(&self, cone: [f64; 2], wedge: &Wedge, breaks: &mut Breaks) {
        for [y, z] in wedge.directions() {
            for e in &self.edges {
                let square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
                let middle: f64 = (0..3).map(|n| e[n] * self.centre[n]).sum();
                let across = y * e[1] + z * e[2];
                for side in [1.0, -1.0] {
                    let plane = middle + side * square;
                    breaks.add((plane - across * cone[0]) / (e[0] + across * cone[1]));
                }
            }
        }
    }

    /// Volume between two adjacent singular points: none, all of the box, or a smooth integrand.
    fn panel(&mut self, [a, b]: [f64; 2], run: &Run<'_>) -> f64 {
        if self.wedge.is_some() {
            // A wedge cuts few boxes, and one may contain a whole solid: each panel has its fraction of the tolerance.
            let share = (b - a) / (self.corners[7] - self.corners[0]);
            let coarse = self.gauss([a, b], run);
            return self.halved([a, b], run, coarse, share * self.tolerance, DEEPEST);
        }
        let x = 0.5 * (a + b);
        self.evaluations += 1;
        let (area, cut) = self.area(x, run.radius(x));
        if !cut {
            return if area > 0.0 {
                self.below(b) - self.below(a)
            } else {
                0.0
            };
        }
        let coarse = self.gauss([a, b], run);
        // The midpoint rule is exact for linear functions, the other rule for cubics. If they agree to a coarse tolerance the other
        // is accurate to it; at a fine one they may agree by chance.
        let agree = (coarse - area * (b - a)).abs() <= self.tolerance;
        if agree && self.coarse {
            return coarse;
        }
        self.halved([a, b], run, coarse, self.tolerance, DEEPEST)
    }

    fn halved(
        &mut self,
        [a, b]: [f64; 2],
        run: &Run<'_>,
        coarse: f64,
        tolerance: f64,
        depth: u32,
    ) -> f64 {
        let m = 0.5 * (a + b);
        let halves = [[a, m], [m, b]];
        let [p, q] = halves.map(|panel| self.gauss(panel, run));
        // At least rounding, otherwise all panels would be bisected completely.
        let least = tolerance.max(f64::EPSILON * self.volume);
        if (p + q - coarse).abs() <= least || depth == 0 {
            return p + q;
        }
        self.halved(halves[0], run, p, 0.5 * tolerance, depth - 1)
            + self.halved(halves[1], run, q, 0.5 * tolerance, depth - 1)
    }

    /// Two-point Gauss-Legendre integral of the area within the cone `r = cone[0] + cone[1] x`.
    fn gauss(&mut self, [a, b]: [f64; 2], run: &Run<'_>) -> f64 {
        let (m, h) = (0.5 * (a + b), 0.5 * (b - a));
        self.evaluations += 2;
        let at = |x: f64| self.area(x, run.radius(x)).0;
        h * (at(m - GAUSS * h) + at(m + GAUSS * h))
    }

    /// The edges of the cross-section at x, anticlockwise, in any order.
    #[inline(always)]
    fn outline(&self, x: f64) -> ([[[f64; 2]; 2]; 6], usize) {
        let mut outline = [[[0.0; 2]; 2]; 6];
        let mut n = 0;
        for i in 0..3 {
            let face = &self.faces[i];
            if face.turn == 0.0 {
                continue;
            }
            let [j, k] = OTHERS[i].map(|o| &self.edges[o]);
            let e = &self.edges[i];
            for side in [1.0, -1.0] {
                let rest = x - self.centre[0] - side * e[0];
                // Positions along edge k between which edge j bounds the cross-section.
                let (low, high) = if k[0] > 0.0 {
                    (
                        ((rest - j[0]) * face.inv[1]).max(-1.0),
                        ((rest + j[0]) * face.inv[1]).min(1.0),
                    )
                } else if rest.abs() < j[0] {
                    (-1.0, 1.0)
                } else {
                    continue;
                };
                if low < high {
                    let point = |u: f64| {
                        let v = (rest - u * k[0]) * face.inv[0];
                        [1, 2].map(|a| self.centre[a] + side * e[a] + u * k[a] + v * j[a])
                    };
                    outline[n] = if side * face.turn > 0.0 {
                        [point(low), point(high)]
                    } else {
                        [point(high), point(low)]
                    };
                    n += 1;
                }
            }
        }
        (outline, n)
    }

    /// Returns the area of the cross-section at x inside the disc of radius r, and whether the circle intersects it.
    fn area(&self, x: f64, r: f64) -> (f64, bool) {
        let (outline, n) = self.outline(x);
        let r2 = r * r;
        if let Some(cut) = &self.wedge {
            return (
                0.5 * cut.sum(&outline[..n], |p, q| sector_sum(p, q, r2)),
                true,
            );
        }
        let mut sum = 0.0;
        let (mut n_enter, mut n_leave, mut n_outside) = (0, 0, 0);
        let (mut enter, mut leave) = ([0.0; 2], [0.0; 2]);
        for &[p, q] in &outline[..n] {
            match within(p, q, r2) {
                None => n_outside += 1,
                Some([low, high]) => {
                    let first = if low > 0.0 { between(p, q, low) } else { p };
                    let last = if high < 1.0 { between(p, q, high) } else { q };
                    sum += cross(first, last);
                    if low > 0.0 {
                        (enter, n_enter) = (first, n_enter + 1);
                    }
                    if high < 1.0 {
                        (leave, n_leave) = (last, n_leave + 1);
                    }
                }
            }
        }
        if n_enter == 1 && n_leave == 1 {
            // One arc, anticlockwise from the exit of the outline from the disc.
            let arc = angle(leave, enter);
            let arc = if arc < 0.0 { arc + TAU } else { arc };
            return (0.5 * (sum + r2 * arc), true);
        }
        if n_outside == 0 && n_enter + n_leave == 0 {
            return (0.5 * sum, false);
        }
        let [_, y, z] = self.centre;
        if n_outside == n && y * y + z * z > self.radius2 {
            return (0.0, false);
        }
        // Several arcs, a whole disc, or a corner on the circle.
        let sum: f64 = (outline[..n].iter())
            .map(|&[p, q]| sector_sum(p, q, r2))
            .sum();
        let cut = n_outside < n || sum > r2;
        (if cut { 0.5 * sum } else { 0.0 }, cut)
    }
}
