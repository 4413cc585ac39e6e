//! The points over which a view is averaged: volumes and breaths, when they are seen, and with what weights.

use std::collections::BTreeMap;

/// One point of the quadrature over a view, equal ones merged.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Volume gain of the cavity.
    pub(crate) gain: f64,
    /// How far the breath has come; 0 without one.
    pub(crate) breath: f64,
    /// Share of the view's time that has passed.
    pub(crate) share: f64,
    /// The view is the sum over both of these weights, the rule with half the points twice that over the first.
    pub(crate) weights: [f64; 2],
}

/// The points over which a view is averaged, and how many phases of the cycle they see.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nodes {
    pub(crate) nodes: Vec<Node>,
    /// Phases seen; of means over volumes, the gains.
    pub(crate) phases: Vec<f64>,
    /// How far the mean volume of the cavity is from that over the view's time, as a share of it.
    pub(crate) volume_error: f64,
    known: BTreeMap<[u64; 3], usize>,
}

impl Nodes {
    /// Adds a point of a volume gain and a breath.
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
                });
                nodes.len() - 1
            });
        for (sum, weight) in self.nodes[at].weights.iter_mut().zip(weights) {
            *sum += weight;
        }
    }

    /// Ends the list: without weights that are rounding of the other half, and without points of no weight. A single point has no error.
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

    /// The gains of all points.
    pub(crate) fn gains(&self) -> impl Iterator<Item = f64> {
        self.nodes.iter().map(|node| node.gain)
    }

    /// How far the volume is from its mean over the view, in the mean and as a share of it: the more, the harder it is to sample.
    pub(crate) fn spread(&self) -> f64 {
        let mean = |of: &dyn Fn(&Node) -> f64| -> f64 {
            let weight = |node: &Node| node.weights[0] + node.weights[1];
            self.nodes.iter().map(|node| weight(node) * of(node)).sum()
        };
        let volume = mean(&|node| 1.0 + node.gain);
        mean(&|node| (1.0 + node.gain - volume).abs()) / volume
    }
}
