//! Quadrature points of a view: volume gain, respiratory position, time and weights.

use std::collections::BTreeMap;

/// Number of rays through a sphere for which the error of the rule is computed.
const SPHERE_RAYS: usize = 64;
/// Bound on the error of a view, relative to that of rays through a sphere, without and with respiration. The largest sample of an empty cavity is
/// the chord of the wall, down to half the diameter of the sphere; respiration also moves the outer surface, which is larger and less curved.
const SAFETY: [f64; 2] = [2.0, 4.0];
/// Smaller values of this multiple of the difference from the exact average, relative to the diameter, are not used: the quadrature of that average
/// has errors of up to 4e-4, and rules with such small errors have enough points.
const EXACT: f64 = 2e-3;

/// A quadrature point of a view; equal points are merged.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Volume gain of the cavity.
    pub(crate) gain: f64,
    /// Respiratory position; 0 without respiration.
    pub(crate) breath: f64,
    /// Elapsed fraction of the view's time.
    pub(crate) share: f64,
    /// Weights of the two halves: the sum over both is the view, twice the sum over the first the rule with half the points.
    pub(crate) weights: [f64; 2],
    /// The number of the projection set, among those that are computed together.
    pub(crate) set: usize,
}

impl Node {
    /// Equal for nodes of the same image; nodes of one angle are adjacent in its order.
    pub(super) fn key(&self) -> [u64; 3] {
        [self.share, self.gain, self.breath].map(f64::to_bits)
    }
}

/// The nodes of a view.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nodes {
    pub(crate) nodes: Vec<Node>,
    /// Relative error of the average cavity volume over the view's time.
    pub(crate) volume_error: f64,
    known: BTreeMap<[u64; 3], usize>,
}

impl Nodes {
    /// Adds a point.
    pub(super) fn add(&mut self, [gain, breath]: [f64; 2], share: f64, weights: [f64; 2]) {
        let nodes = &mut self.nodes;
        let at = *(self.known)
            .entry([gain.to_bits(), breath.to_bits(), share.to_bits()])
            .or_insert_with(|| {
                nodes.push(Node {
                    gain,
                    breath,
                    share,
                    weights: [0.0; 2],
                    set: 0,
                });
                nodes.len() - 1
            });
        for (sum, weight) in self.nodes[at].weights.iter_mut().zip(weights) {
            *sum += weight;
        }
    }

    /// Completes the list: removes weights within rounding and points without weight. A single point has no error.
    pub(super) fn tidy(&mut self, rounding: f64) {
        let alone = self.nodes.len() == 1;
        for Node { weights, .. } in &mut self.nodes {
            if alone || weights[1].abs() <= rounding * weights[0].abs() {
                *weights = [weights[0] + weights[1], 0.0];
            }
        }
        self.nodes.retain(|node| node.weights != [0.0; 2]);
    }

    /// Returns the gains of all points.
    pub(crate) fn gains(&self) -> impl Iterator<Item = f64> {
        self.nodes.iter().map(|node| node.gain)
    }

    /// Returns the mean absolute deviation of the volume from its average, relative to the average: a measure of difficulty.
    pub(crate) fn spread(&self) -> f64 {
        let mean = |of: &dyn Fn(&Node) -> f64| -> f64 {
            let weight = |node: &Node| node.weights[0] + node.weights[1];
            self.nodes.iter().map(|node| weight(node) * of(node)).sum()
        };
        let volume = mean(&|node| 1.0 + node.gain);
        mean(&|node| (1.0 + node.gain - volume).abs()) / volume
    }

    /// Returns the largest error for rays through the sphere, relative to its diameter: the difference from the rule with half the points, or the
    /// difference from the exact average times [`SAFETY`]. The rays leave the sphere at different states; few samples of a view may contain no ray
    /// with a large error, and two rules of few points may differ by less than their errors.
    pub(super) fn sphere_error(&self, sphere: &Sphere) -> f64 {
        let radii: Vec<f64> = self.gains().map(radius).collect();
        let largest = radii.iter().copied().fold(0.0, f64::max);
        let safety = SAFETY[usize::from(sphere.shift > 0.0)];
        let error = |[offset, exact]: &[f64; 2]| {
            let mut halves = [0.0; 2];
            for (node, radius) in self.nodes.iter().zip(&radii) {
                let half_chord = sphere.half_chord(*offset, *radius, node.breath);
                for (sum, weight) in halves.iter_mut().zip(node.weights) {
                    *sum += weight * half_chord;
                }
            }
            let [even, odd] = halves;
            let (apart, off) = (
                (even - odd).abs() / largest,
                safety * (even + odd - exact).abs() / largest,
            );
            if off > EXACT { apart.max(off) } else { apart }
        };
        sphere.rays.iter().map(error).fold(0.0, f64::max)
    }
}

/// Returns the radius of a sphere of this volume gain, relative to that without gain.
pub(super) fn radius(gain: f64) -> f64 {
    (1.0 + gain).cbrt()
}

/// Rays through a sphere with the volume of the cavity, which respiration moves across them; lengths relative to its radius without gain.
#[derive(Debug, Clone, Default)]
pub(super) struct Sphere {
    shift: f64,
    /// Offsets from the centre at end-expiration, and halves of the chords averaged over the view's time.
    rays: Vec<[f64; 2]>,
}

impl Sphere {
    /// Rays that enter or leave a sphere of radius `low` to `high` that moves by up to `shift`.
    pub(super) fn new([low, high]: [f64; 2], shift: f64) -> Self {
        // without a shift both edges are equal
        let edges = match shift > 0.0 {
            true => vec![[-high - shift, -low], [low - shift, high]],
            false => vec![[low, high]],
        };
        let n = SPHERE_RAYS / edges.len();
        let rays = edges.iter().flat_map(|[from, to]| {
            (0..n).map(move |k| [from + (to - from) * (k as f64 + 0.5) / n as f64, 0.0])
        });
        Self {
            shift,
            rays: rays.collect(),
        }
    }

    fn half_chord(&self, offset: f64, radius: f64, breath: f64) -> f64 {
        let offset = offset + self.shift * breath;
        (radius * radius - offset * offset).max(0.0).sqrt()
    }

    /// Adds a state that lasts for a `share` of the time.
    pub(super) fn add(&mut self, share: f64, radius: f64, breath: f64) {
        for k in 0..self.rays.len() {
            self.rays[k][1] += share * self.half_chord(self.rays[k][0], radius, breath);
        }
    }
}
