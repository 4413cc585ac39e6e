//! Certified pressures: Krawczyk's interval Newton method for the discrete systems of the study.
//!
//! Enclosed are roots of the equations of spectral elements that `docs/theory.md` states: degree p, one element on the cylinder and one on the
//! cap, with exact nodes, derivatives, reference configuration and volumes. Tables and tangent are computed here. The error of these
//! equations against the membrane, the limit of infinite degree, is not enclosed.

use crate::interval::{Interval, dot, sum};
use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, ReferenceShape, Solver,
};
use nalgebra::DMatrix;

/// Length and radii of the two balloons (cm).
const LENGTH: f64 = 8.5;
const RADII: [f64; 2] = [1.75, 2.75];
/// Volume gain of the study, as the library rounds it.
const GAIN: f64 = 0.6;
/// Pressures of the inner and the outer balloon by degree (`docs/evidence.md`): the integer, and two groups of nine decimals.
const PRESSURES: [(usize, [[usize; 3]; 2]); 2] = [
    (
        16,
        [
            [17, 483_575_277, 621_734_496],
            [10, 309_424_478, 505_082_788],
        ],
    ),
    (
        24,
        [
            [17, 483_575_277, 621_734_116],
            [10, 309_424_478, 505_082_858],
        ],
    ),
];

type Point = [Interval; 2];

fn int(value: usize) -> Interval {
    Interval::point(value as f64)
}

/// The Chebyshev points (1 - cos(pi k / n)) / 2 of [0, 1], with sine and cosine of angles up to pi / 2.
fn nodes(n: usize) -> Vec<Interval> {
    let point = |k: usize| {
        let angle = Interval::PI * int(k) / int(n) - Interval::PI / int(2);
        (Interval::ONE + angle.sin()) / int(2)
    };
    let mut all: Vec<_> = (0..=n).map(point).collect();
    (all[0], all[n]) = (Interval::ZERO, Interval::ONE);
    all
}

/// Barycentric weight of node `k`, up to a common factor.
fn weight(k: usize, degree: usize) -> Interval {
    let size = if k == 0 || k == degree { 0.5 } else { 1.0 };
    Interval::point(if k.is_multiple_of(2) { size } else { -size })
}

/// Row i: derivative at node i of the polynomial through values at the nodes.
fn derivative(nodes: &[Interval]) -> Vec<Vec<Interval>> {
    let degree = nodes.len() - 1;
    let row = |i: usize| {
        let entry = |j: usize| match i == j {
            true => Interval::ZERO,
            false => weight(j, degree) / weight(i, degree) / (nodes[i] - nodes[j]),
        };
        let mut row: Vec<_> = (0..=degree).map(entry).collect();
        row[i] = -sum(row.iter().copied());
        row
    };
    (0..=degree).map(row).collect()
}

/// Weights at the n + 1 Chebyshev points of a rule that integrates polynomials of degree n over [0, 1] (Clenshaw and Curtis).
fn weights(n: usize) -> Vec<Interval> {
    // cos(pi k / n), by an angle between 0 and pi
    let cosine = |k: usize| {
        let folded = (k % (2 * n)).min(2 * n - k % (2 * n));
        (Interval::PI / int(2) - Interval::PI * int(folded) / int(n)).sin()
    };
    let weigh = |k: usize| {
        let term = |j: usize| {
            let part = if 2 * j == n { 1 } else { 2 };
            int(part) * cosine(2 * j * k) / int(4 * j * j - 1)
        };
        let ends = if k == 0 || k == n { 2 } else { 1 };
        (Interval::ONE - sum((1..=n / 2).map(term))) / int(n * ends)
    };
    (0..=n).map(weigh).collect()
}

/// Values at `at` of the polynomials that are 1 at one node and 0 at the others.
fn values(nodes: &[Interval], at: Interval) -> Vec<Interval> {
    let degree = nodes.len() - 1;
    if let Some(hit) = nodes.iter().position(|&node| node == at) {
        return (0..=degree).map(|k| int(usize::from(k == hit))).collect();
    }
    let part = |k: usize| weight(k, degree) / (at - nodes[k]);
    let parts: Vec<_> = (0..=degree).map(part).collect();
    let total = sum(parts.iter().copied());
    parts.into_iter().map(|part| part / total).collect()
}

/// Half of a balloon, from the ring over the cylinder to the apex: two elements of one degree.
///
/// Unknowns are the displacements x, y of nodes 1 to 2 p - 1, x of the apex, and the pressure f.
struct Balloon {
    degree: usize,
    /// Lengths of the elements in s.
    lengths: [Interval; 2],
    derivative: Vec<Vec<Interval>>,
    second: Vec<Vec<Interval>>,
    reference: Vec<Point>,
    /// Points of a rule for the volume: weight, rows of values and of derivatives.
    rule: Vec<(Interval, Vec<Interval>, Vec<Interval>)>,
}

/// Applies a row over the nodes of an element to a coordinate.
fn along(row: &[Interval], of: &[Point], k: usize) -> Interval {
    dot(row.iter().copied(), of.iter().map(|of| of[k]))
}

/// Speed, direction and outward normal.
fn frame(slope: Point) -> (Interval, Point, Point) {
    let speed = (slope[0].square() + slope[1].square()).sqrt();
    let unit = slope.map(|d| d / speed);
    (speed, unit, [-unit[1], unit[0]])
}

impl Balloon {
    fn new(degree: usize, radius: f64) -> Self {
        let (t, radius, length) = (
            nodes(degree),
            Interval::point(radius),
            Interval::point(LENGTH),
        );
        let quarter = Interval::PI / int(2);
        let whole = int(2) * length + Interval::PI * radius;
        let mut reference: Vec<Point> = t.iter().map(|&t| [length * t, radius]).collect();
        reference.extend(t[1..].iter().map(|&t| {
            let cosine = (quarter - quarter * t).sin();
            [length + radius * (quarter * t).sin(), radius * cosine]
        }));
        reference[2 * degree][1] = Interval::ZERO;
        let derivative = derivative(&t);
        let times_derivative = |row: &[Interval]| -> Vec<Interval> {
            let column = |j| dot(row.iter().copied(), derivative.iter().map(|row| row[j]));
            (0..=degree).map(column).collect()
        };
        // y^2 x' has the degree 3 p - 1; of the points of this rule only the ends are nodes
        let n = 3 * degree + 1;
        let point = |(at, weight)| {
            let values = values(&t, at);
            let slopes = times_derivative(&values);
            (weight, values, slopes)
        };
        Self {
            degree,
            lengths: [length / whole, quarter * radius / whole],
            second: derivative.iter().map(|row| times_derivative(row)).collect(),
            rule: nodes(n).into_iter().zip(weights(n)).map(point).collect(),
            reference,
            derivative,
        }
    }

    fn unknowns(&self) -> usize {
        4 * self.degree
    }

    /// Position of coordinate `k` of `node` among the unknowns; `None` if it is fixed.
    fn place(&self, node: usize, k: usize) -> Option<usize> {
        let is_free = node > 0 && (node < 2 * self.degree || k == 0);
        is_free.then(|| 2 * (node - 1) + k)
    }

    /// Nodes of element `e` at which coordinate `k` is free, and its position among the unknowns.
    fn free(&self, e: usize, k: usize) -> impl Iterator<Item = (usize, usize)> {
        let p = self.degree;
        (0..=p).filter_map(move |i| Some((i, self.place(e * p + i, k)?)))
    }

    /// Displacements and positions of the nodes of element `e`.
    fn element(&self, e: usize, state: &[Interval]) -> [Vec<Point>; 2] {
        let all = e * self.degree..=(e + 1) * self.degree;
        let moved = |node, k| self.place(node, k).map_or(Interval::ZERO, |at| state[at]);
        let u: Vec<Point> = all
            .clone()
            .map(|node| [0, 1].map(|k| moved(node, k)))
            .collect();
        let c = self.reference[all]
            .iter()
            .zip(&u)
            .map(|(c, u)| [c[0] + u[0], c[1] + u[1]]);
        let c = c.collect();
        [u, c]
    }

    /// pi times the integral of y^2 x'.
    fn volume(&self, state: &[Interval]) -> Interval {
        let part = |e: usize| {
            let [_, c] = self.element(e, state);
            let rule = self.rule.iter();
            sum(rule.map(|(weight, values, slopes)| {
                *weight * along(values, &c, 1).square() * along(slopes, &c, 0)
            }))
        };
        Interval::PI * (part(0) + part(1))
    }

    /// The equations: u'' + f n at inner nodes of elements, the jump of u' at their common node, u' of x at the apex, and the volume.
    fn residual(&self, state: &[Interval], volume: Interval) -> Vec<Interval> {
        let (p, last) = (self.degree, self.unknowns() - 1);
        let mut out = vec![Interval::ZERO; last + 1];
        for e in 0..2 {
            let ([u, c], length) = (self.element(e, state), self.lengths[e]);
            for k in 0..2 {
                for (i, row) in self.free(e, k) {
                    let slope = [0, 1].map(|k| along(&self.derivative[i], &c, k));
                    let tension = along(&self.derivative[i], &u, k) / length;
                    let force = match i {
                        0 => tension,
                        _ if i == p => -tension,
                        _ => {
                            let second = along(&self.second[i], &u, k) / length.square();
                            second + state[last] * frame(slope).2[k]
                        }
                    };
                    out[row] = out[row] + force;
                }
            }
        }
        out[last] = self.volume(state) - volume;
        out
    }

    /// Derivatives of [`Self::residual`], row by row.
    fn tangent(&self, state: &[Interval]) -> Vec<Vec<Interval>> {
        let (p, last) = (self.degree, self.unknowns() - 1);
        let mut out = vec![vec![Interval::ZERO; last + 1]; last + 1];
        for e in 0..2 {
            let ([_, c], length) = (self.element(e, state), self.lengths[e]);
            for i in 0..=p {
                let slope = [0, 1].map(|k| along(&self.derivative[i], &c, k));
                let is_inside = (1..p).contains(&i);
                // the element's part of the equation is linear in u, and f n has dn/dc' = -t n^T / |c'|
                let linear = |j: usize| match i {
                    0 => self.derivative[i][j] / length,
                    _ if i == p => -(self.derivative[i][j] / length),
                    _ => self.second[i][j] / length.square(),
                };
                let (speed, unit, normal) = frame(slope);
                for k in 0..2 {
                    let Some(row) = self.place(e * p + i, k) else {
                        continue;
                    };
                    if is_inside {
                        out[row][last] = normal[k];
                    }
                    for m in 0..2 {
                        let turned = state[last] * unit[k] * normal[m] / speed;
                        for (j, column) in self.free(e, m) {
                            let by = &mut out[row][column];
                            if k == m {
                                *by = *by + linear(j);
                            }
                            if is_inside {
                                *by = *by - turned * self.derivative[i][j];
                            }
                        }
                    }
                }
            }
            for (weight, values, slopes) in &self.rule {
                let (y, slope) = (along(values, &c, 1), along(slopes, &c, 0));
                let scale = Interval::PI * *weight * y;
                for (j, column) in self.free(e, 0) {
                    out[last][column] = out[last][column] + scale * y * slopes[j];
                }
                for (j, column) in self.free(e, 1) {
                    out[last][column] = out[last][column] + int(2) * scale * slope * values[j];
                }
            }
        }
        out
    }

    /// Krawczyk's operator about an approximate root z: a box X, and K(X) = z - Y F(z) + (1 - Y F'(X)) (X - z) with an approximate inverse Y of
    /// the tangent. K(X) inside X proves that X contains exactly one root, and K(X) contains it.
    fn enclose(&self, state: &[f64], volume: Interval) -> [Vec<Interval>; 2] {
        let n = self.unknowns();
        let thin: Vec<_> = state.iter().map(|&z| Interval::point(z)).collect();
        let middle = self.tangent(&thin);
        let middle = DMatrix::from_fn(n, n, |i, j| middle[i][j].middle());
        let inverse = middle.try_inverse().unwrap();
        let inverse: Vec<Vec<_>> = (0..n)
            .map(|i| inverse.row(i).iter().map(|&y| Interval::point(y)).collect())
            .collect();
        let times =
            |i: usize, column: &[Interval]| dot(inverse[i].iter().copied(), column.iter().copied());
        let residual = self.residual(&thin, volume);
        let steps: Vec<_> = (0..n).map(|i| times(i, &residual)).collect();
        let wide = thin.iter().zip(&steps);
        let wide: Vec<_> = wide
            .map(|(z, step)| z.widened(1e-20 + 2.0 * step.magnitude()))
            .collect();
        let tangent = self.tangent(&wide);
        let mut images: Vec<_> = thin
            .iter()
            .zip(&steps)
            .map(|(&z, &step)| z - step)
            .collect();
        for j in 0..n {
            let column: Vec<_> = tangent.iter().map(|row| row[j]).collect();
            for (i, image) in images.iter_mut().enumerate() {
                let rest = int(usize::from(i == j)) - times(i, &column);
                *image = *image + rest * (wide[j] - thin[j]);
            }
        }
        [wide, images]
    }
}

/// The displacements and the pressure that the library computes.
fn state(balloon: &Balloon, found: &Equilibrium) -> Vec<f64> {
    let points = found.points();
    let mut state = vec![found.intensity; balloon.unknowns()];
    for (node, (point, rest)) in points.iter().zip(&balloon.reference).enumerate() {
        for k in 0..2 {
            if let Some(at) = balloon.place(node, k) {
                state[at] = point[k] - rest[k].middle();
            }
        }
    }
    state
}

#[test]
fn both_pressures_of_the_study_are_enclosed() {
    for (degree, pressures) in PRESSURES {
        let spectral = Discretisation::Spectral {
            degree,
            per_piece: 1,
        };
        let [inner, outer] = RADII.map(|radius| {
            let membrane = Membrane::new(ReferenceShape::balloon(LENGTH, radius).unwrap());
            Solver::new(&membrane, spectral).unwrap()
        });
        let pair = Pair::new(inner, outer).unwrap();
        let options = NewtonOptions::default();
        let found = pair.solve(Control::VolumeGain(GAIN), &options).unwrap();
        let balloons = RADII.map(|radius| Balloon::new(degree, radius));
        let start = [0, 1].map(|k| balloons[k].volume(&vec![Interval::ZERO; 4 * degree]));
        // The volume of the wall is that of the start, so that both volumes grow by the same.
        let swept = Interval::point(GAIN) * start[0];
        for (k, found) in [&found.inner, &found.outer].into_iter().enumerate() {
            let state = state(&balloons[k], found);
            let [wide, images] = balloons[k].enclose(&state, start[k] + swept);
            let mut both = images.iter().zip(&wide);
            assert!(both.all(|(image, wide)| image.is_inside(*wide)));
            let pressure = images[4 * degree - 1];
            let distance = |value| (pressure - value).magnitude();
            // rounded to the last digit, and the width of the enclosure, 1e-20
            let [whole, first, second] = pressures[k].map(int);
            let group = int(1_000_000_000);
            assert!(distance(whole + (first + second / group) / group) < 0.51e-18);
            // the rounding of the library, some p^4 units of 1e-16
            assert!(distance(Interval::point(found.intensity)) < 1e-11);
        }
    }
}
