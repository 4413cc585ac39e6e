//! Interpolation in angle: photons are detected in some of the views; every other view is a combination of four of these.

use crate::View;
use std::f64::consts::TAU;

/// Angles in radians closer than this are equal.
const SAME: f64 = 1e-9;
/// Differences of the radius in cm that change the width of the response below the resolution of scatter.
const SAME_RADIUS: f64 = 0.5;

/// Error of a cubic in the middle of an interval over that of leave-one-out interpolation, both in fourth derivatives (3/128 and 1/6). The ratio is
/// larger at the end of an arc, where the first of four nodes is the neighbour (15/384).
const TURN: f64 = 9.0 / 64.0;
const ARC: f64 = 15.0 / 64.0;
/// Standard errors of a node below which its difference from an interpolation is noise.
const NOISE: f64 = 6.0;

/// The views in which photons are detected, and the weights of four of them in every view.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Angles {
    /// Numbers of the views in which photons are detected.
    pub(crate) nodes: Vec<usize>,
    /// For every view: indices into `nodes`, and weights.
    taps: Vec<[(usize, f64); 4]>,
    /// For nodes with two nodes on either side: views and weights of the difference from the interpolation between these.
    errors: Vec<[(usize, f64); 5]>,
    /// Error of the interpolation over that difference where images are smooth.
    smooth: f64,
}

impl Angles {
    /// Chooses views at most `spacing` radians apart where the others lie on the cubic through four of them, angle and radius; else all.
    pub(crate) fn new(views: &[View], spacing: f64) -> Self {
        let chosen = Self::chosen(views, spacing).filter(|angles| {
            let off = |(view, taps): (&View, &[(usize, f64); 4])| {
                let radius = taps.map(|(node, weight)| weight * views[angles.nodes[node]].radius);
                (radius.iter().sum::<f64>() - view.radius).abs()
            };
            let mut off = views.iter().zip(&angles.taps).map(off);
            off.all(|off| off <= SAME_RADIUS)
        });
        chosen.unwrap_or_else(|| Self {
            nodes: (0..views.len()).collect(),
            taps: (0..views.len())
                .map(|view| [(view, 1.0), (view, 0.0), (view, 0.0), (view, 0.0)])
                .collect(),
            errors: Vec::new(),
            smooth: 0.0,
        })
    }

    fn chosen(views: &[View], spacing: f64) -> Option<Self> {
        let angle = |view: usize| views[view].angle.rem_euclid(TAU);
        let mut order: Vec<usize> = (0..views.len()).collect();
        order.sort_by(|a, b| angle(*a).total_cmp(&angle(*b)));
        // The list starts after the largest gap, which is then between the last and the first angle.
        let gap = |k: usize| match order.get(k + 1) {
            Some(next) => angle(*next) - angle(order[k]),
            None => angle(order[0]) + TAU - angle(order[k]),
        };
        let last = (0..order.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)))?;
        let turn = gap(last) <= spacing + SAME;
        // Nodes on the other side of a gap would be far from the views.
        if (0..order.len()).any(|k| k != last && gap(k) > spacing + SAME) {
            return None;
        }
        order.rotate_left((last + 1) % views.len());
        let start = angle(order[0]);
        let at = |k: usize| match order.get(k) {
            // The angle of the first view itself may be below zero by rounding.
            Some(view) => (angle(*view) - start + SAME).rem_euclid(TAU) - SAME,
            None => TAU,
        };
        let n = order.len();
        let mut chosen = vec![0];
        for k in 1..n {
            let ends = !turn && k + 1 == n;
            let from = at(chosen[chosen.len() - 1]);
            if at(k) - from > SAME && (ends || at(k + 1) - from > spacing + SAME) {
                chosen.push(k);
            }
        }
        let m = chosen.len();
        if m < 5 {
            return None;
        }
        // Beyond both ends of a turn the nodes continue.
        let place = |node: isize| {
            let turns = node.div_euclid(m as isize) as f64;
            at(chosen[node.rem_euclid(m as isize) as usize]) + TAU * turns
        };
        let mut taps = vec![[(0, 0.0); 4]; n];
        for (k, view) in order.iter().enumerate() {
            let above = chosen.partition_point(|node| at(*node) <= at(k) + SAME) as isize;
            let first = match turn {
                true => above - 2,
                false => (above - 2).clamp(0, m as isize - 4),
            };
            let four = std::array::from_fn(|j| first + j as isize);
            let weights = lagrange(at(k), four.map(place));
            taps[*view] =
                std::array::from_fn(|j| (four[j].rem_euclid(m as isize) as usize, weights[j]));
        }
        let view = |node: isize| order[chosen[node.rem_euclid(m as isize) as usize]];
        let (within, smooth) = match turn {
            true => (0..m as isize, TURN),
            false => (2..m as isize - 2, ARC),
        };
        let errors = within.map(|node| {
            let four = [-2, -1, 1, 2].map(|step| node + step);
            let weights = lagrange(place(node), four.map(place));
            std::array::from_fn(|j| match j {
                4 => (view(node), -1.0),
                _ => (view(four[j]), weights[j]),
            })
        });
        let errors = errors.collect();
        Some(Self {
            nodes: chosen.into_iter().map(|k| order[k]).collect(),
            taps,
            errors,
            smooth,
        })
    }

    /// Estimates the largest error of the interpolation: each node is compared with its interpolation from the two on either side.
    pub(crate) fn error(&self, images: &[f64], errors: &[f64], len: usize) -> f64 {
        let off = |five: &[(usize, f64); 5], k: usize| {
            let terms = five.map(|(view, weight)| weight * images[view * len + k]);
            let (off, at) = (terms.iter().sum::<f64>().abs(), five[4].0 * len + k);
            let certain = (off - NOISE * errors[at]).max(0.0);
            let rough = certain / certain.max(images[at]).max(f64::MIN_POSITIVE);
            off.min(2.0 * certain) * rough.max(self.smooth)
        };
        let all = self
            .errors
            .iter()
            .flat_map(|five| (0..len).map(move |k| off(five, k)));
        all.fold(0.0, f64::max)
    }

    /// Sum of the weights of each node in all views.
    pub(crate) fn totals(&self) -> Vec<f64> {
        let mut totals = vec![0.0; self.nodes.len()];
        for (node, weight) in self.taps.iter().flatten() {
            totals[*node] += weight;
        }
        totals
    }

    /// Computes the images of all views from those of the nodes, with `len` values each.
    pub(crate) fn expand(&self, images: &[f32], len: usize) -> Vec<f32> {
        let mut all = vec![0.0; self.taps.len() * len];
        for (image, taps) in all.chunks_mut(len).zip(&self.taps) {
            for (node, weight) in taps.iter().filter(|(_, weight)| *weight != 0.0) {
                let own = &images[node * len..(node + 1) * len];
                for (value, more) in image.iter_mut().zip(own) {
                    *value += *weight as f32 * more;
                }
            }
        }
        all
    }
}

/// Weights of values at four places in the cubic through them.
fn lagrange(at: f64, places: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|j| {
        let others = (0..4).filter(|k| *k != j);
        let factors = others.map(|k| (at - places[k]) / (places[j] - places[k]));
        factors.product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn views(degrees: impl IntoIterator<Item = f64>, radius: fn(f64) -> f64) -> Vec<View> {
        let view = |degrees: f64| View {
            angle: degrees.to_radians(),
            radius: radius(degrees.to_radians()),
        };
        degrees.into_iter().map(view).collect()
    }

    /// Largest error of the interpolation of a function of the angle.
    fn off(views: &[View], angles: &Angles, f: fn(f64) -> f64) -> f64 {
        let nodes: Vec<f32> = (angles.nodes.iter())
            .map(|node| f(views[*node].angle) as f32)
            .collect();
        let all = angles.expand(&nodes, 1);
        let off = all.iter().zip(views);
        off.map(|(found, view)| (f64::from(*found) - f(view.angle)).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn cubics_interpolate_arcs_and_turns() {
        let spacing = 12f64.to_radians();
        let contour = |angle: f64| 20.0 + 4.0 * (2.0 * angle).cos();
        let smooth = |angle: f64| (2.0 * angle).sin();
        let two_heads =
            (0..32).flat_map(|k| [0.0, 90.0].map(|head| 135.0 + head + 2.8 * f64::from(k)));
        for (views, most) in [
            (views((0..64).map(|k| 2.8 * f64::from(k)), contour), 18),
            (
                views((0..120).map(|k| 400.0 - 3.0 * f64::from(k)), contour),
                30,
            ),
            (views(two_heads, contour), 18),
        ] {
            let angles = Angles::new(&views, spacing);
            assert!(angles.nodes.len() <= most, "{}", angles.nodes.len());
            // Fourth order: 3/128 (2 h)^4, at the ends of an arc 1.8 times that.
            let error = off(&views, &angles, smooth);
            assert!(
                error < 1.8 * 3.0 / 128.0 * (2.0 * spacing).powi(4),
                "{error}"
            );
            let total: f64 = angles.totals().iter().sum();
            assert!((total - views.len() as f64).abs() < 1e-9);
        }
    }

    #[test]
    fn views_without_neighbours_or_with_other_radii_are_nodes() {
        let spacing = 12f64.to_radians();
        for views in [
            views([0.0, 90.0, 180.0], |_| 20.0),
            views([0.0], |_| 20.0),
            views(
                (0..64).map(|k| 2.8 * f64::from(k % 32) + 180.0 * f64::from(k / 32)),
                |_| 20.0,
            ),
            views((0..64).map(|k| 5.0 * f64::from(k)), |angle| {
                if angle < 1.0 { 20.0 } else { 25.0 }
            }),
        ] {
            let angles = Angles::new(&views, spacing);
            assert_eq!(angles.nodes, (0..views.len()).collect::<Vec<_>>());
            assert!(off(&views, &angles, f64::sin) < 1e-7);
        }
        // Equal angles share a node.
        let twice = views((0..120).map(|k| 6.0 * f64::from(k % 60)), |_| 20.0);
        let angles = Angles::new(&twice, spacing);
        assert!(angles.nodes.len() == 30 && off(&twice, &angles, f64::sin) < 1e-4);
    }
}
