//! The meridian divided into chains with convex solids.
//!
//! Where the radius is a concave function of x, the solid under it (down to the axis, between its two end planes) is convex, so a
//! line meets it in one interval, whose ends a bisection finds. The body is the signed sum of these solids, negative where the
//! meridian runs backward: `chord = sum of sign * length`. No parity of crossings is used, so even degenerate lines have errors of
//! rounding only.

use crate::solid::segment::{ROUNDING, Segment};

/// A vertex of a chain and the cone to its right (x grows along a chain, so `tx > 0`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vertex {
    /// Axial coordinate from the middle of the body.
    pub(crate) x: f64,
    pub(crate) r: f64,
    pub(crate) tx: f64,
    pub(crate) tr: f64,
}

/// A part of the meridian with concave radius.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chain {
    /// Vertices with ascending x, at least two; the tangent of the last one is not used.
    pub(crate) vertices: Vec<Vertex>,
    /// x and the squared radius, reduced by rounding, of the vertices, contiguous for searches: a line along the surface is not
    /// inside.
    pub(crate) x: Vec<f64>,
    pub(crate) r2: Vec<f64>,
    /// +1 where the meridian runs forward, -1 where it runs backward (the solid is then outside).
    pub(crate) sign: f64,
}

/// A binary tree over the chains of a meridian, in its order: whole parts are met inside or not at all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// Range of the axial coordinate and of the squared radius, including the axis if the meridian runs along it.
    pub(crate) x: [f64; 2],
    pub(crate) r2: [f64; 2],
    /// Axial coordinates at which the meridian enters and leaves this part.
    pub(crate) path: [f64; 2],
    /// Index of the chain of a leaf. The left child of another node follows it, and the right one follows the subtree of the left.
    pub(crate) chain: Option<usize>,
    /// Index of the first node outside this subtree.
    pub(crate) after: usize,
}

/// Returns the nodes of the tree, root first; every meridian has a chain.
pub(crate) fn tree(chains: &[Chain]) -> Vec<Node> {
    fn build(chains: &[Chain], first: usize, nodes: &mut Vec<Node>) {
        let at = nodes.len();
        let fold = |f: fn(f64, f64) -> f64, get: fn(&Chain) -> &[f64]| {
            let all = chains.iter().flat_map(get).copied();
            all.reduce(f).unwrap_or(0.0)
        };
        let ends = |c: &Chain| {
            let (a, b) = (c.vertices[0].x, c.vertices[c.vertices.len() - 1].x);
            if c.sign > 0.0 { [a, b] } else { [b, a] }
        };
        // The meridian may run along the axis between two chains.
        let whole = chains.windows(2).all(|c| ends(&c[0])[1] == ends(&c[1])[0]);
        let least = if whole {
            fold(f64::min, |c| &c.r2)
        } else {
            0.0
        };
        nodes.push(Node {
            x: [fold(f64::min, |c| &c.x), fold(f64::max, |c| &c.x)],
            r2: [least, fold(f64::max, |c| &c.r2)],
            path: [ends(&chains[0])[0], ends(&chains[chains.len() - 1])[1]],
            chain: (chains.len() == 1).then_some(first),
            after: at + 1,
        });
        if chains.len() > 1 {
            // Bisection by number of vertices, so that a long chain is near the root.
            let total: usize = chains.iter().map(|c| c.vertices.len()).sum();
            let mut sum = 0;
            let split = chains.iter().take_while(|c| {
                sum += c.vertices.len();
                2 * sum <= total
            });
            let split = split.count().clamp(1, chains.len() - 1);
            build(&chains[..split], first, nodes);
            build(&chains[split..], first + split, nodes);
            nodes[at].after = nodes.len();
        }
    }
    let mut nodes = Vec::with_capacity(2 * chains.len());
    if !chains.is_empty() {
        build(chains, 0, &mut nodes);
    }
    nodes
}

/// Slopes may increase by this amount (sine of the angle) in a concave chain: nodes of a cylinder or cone are collinear only to
/// rounding. The surface is displaced by at most this times its length.
const COLLINEAR: f64 = 1e-13;

/// Returns the chains of a meridian, in its order.
pub(crate) fn chains(segments: &[Segment], mid: f64, size: f64) -> Vec<Chain> {
    // Lines start at a distance of several sizes of the body.
    let near = 4.0 * ROUNDING * size;
    let mut chains: Vec<Chain> = Vec::new();
    let mut run: Vec<&Segment> = Vec::new();
    let mut flush = |run: &mut Vec<&Segment>| {
        if !run.is_empty() {
            chains.push(Chain::new(run, mid, near));
            run.clear();
        }
    };
    for s in segments {
        if let Some(last) = run.last() {
            let joined = last.x1 == s.x0 && last.r1 == s.r0;
            let same_way = last.tx * s.tx > 0.0;
            // Forward: turns right; backward: read from its other end, a right turn becomes a left turn.
            let turn = (last.tx * s.tr - last.tr * s.tx) * s.tx.signum();
            if !(joined && same_way && turn <= COLLINEAR) {
                flush(&mut run);
            }
        }
        // A disc has no solid under it: it consists of the end planes of its neighbours.
        if s.tx != 0.0 {
            run.push(s);
        }
    }
    flush(&mut run);
    chains
}

impl Chain {
    fn new(run: &[&Segment], mid: f64, near: f64) -> Self {
        let forward = run[0].tx > 0.0;
        let vertex = |x: f64, r: f64, tx: f64, tr: f64| Vertex {
            x: x - mid,
            r,
            tx,
            tr,
        };
        let mut vertices = Vec::with_capacity(run.len() + 1);
        if forward {
            vertices.extend(run.iter().map(|s| vertex(s.x0, s.r0, s.tx, s.tr)));
            let end = run[run.len() - 1];
            vertices.push(vertex(end.x1, end.r1, end.tx, end.tr));
        } else {
            vertices.extend(run.iter().rev().map(|s| vertex(s.x1, s.r1, -s.tx, -s.tr)));
            vertices.push(vertex(run[0].x0, run[0].r0, -run[0].tx, -run[0].tr));
        }
        Self {
            x: vertices.iter().map(|v| v.x).collect(),
            r2: vertices
                .iter()
                .map(|v| v.r * (v.r - 2.0 * near).max(0.0))
                .collect(),
            vertices,
            sign: if forward { 1.0 } else { -1.0 },
        }
    }
}
