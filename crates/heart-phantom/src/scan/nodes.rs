//! Quadrature points of a view: volume gain, respiratory position, time and weights.

use std::collections::BTreeMap;

/// Number of rays through a sphere at which the two rules are compared.
const SPHERE_RAYS: usize = 64;

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

/// The nodes of a view, and the phases of the cycle among them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nodes {
    pub(crate) nodes: Vec<Node>,
    /// Phases of the points; for averages over volumes, their gains.
    pub(crate) phases: Vec<f64>,
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
        self.phases = self.nodes.iter().map(|node| node.gain).collect();
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

    /// Returns the largest difference from the rule with half the points for rays through a sphere with the volume of the cavity, relative to its
    /// diameter. The rays leave the sphere at different states; few samples of a view may contain no ray with a large difference.
    pub(super) fn sphere_difference(&self) -> f64 {
        if self.nodes.len() < 2 {
            return 0.0;
        }
        let squares: Vec<f64> = (self.gains())
            .map(|gain| (1.0 + gain).cbrt().powi(2))
            .collect();
        let [low, high] =
            [f64::min, f64::max].map(|of| squares.iter().copied().fold(squares[0], of));
        let difference = |k: usize| {
            let squared_distance = low + (high - low) * k as f64 / SPHERE_RAYS as f64;
            let part = |(node, square): (&Node, &f64)| {
                (node.weights[1] - node.weights[0]) * (square - squared_distance).max(0.0).sqrt()
            };
            let parts = self.nodes.iter().zip(&squares).map(part);
            parts.sum::<f64>().abs()
        };
        (0..SPHERE_RAYS).map(difference).fold(0.0, f64::max) / high.sqrt()
    }
}
