//! The upper half of a meridian: smooth normals and material coordinates at points of its surface of revolution.

/// Buckets along x in which segments are looked up.
const BUCKETS: usize = 256;

/// A half meridian from the base to the apex, with a unit normal at each node.
#[derive(Debug)]
pub(super) struct Profile {
    /// Nodes `[x, r]`, the last on the axis.
    nodes: Vec<[f64; 2]>,
    /// Outward unit normals at the nodes.
    normals: Vec<[f64; 2]>,
    /// Material coordinate of the nodes, 0 at the base, 1 at the apex.
    material: Vec<f64>,
    /// Segments that touch each bucket of x.
    buckets: Vec<Vec<usize>>,
    x_range: [f64; 2],
}

/// What a profile knows about a point of its surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnProfile {
    /// Distance to the profile, cm.
    pub(super) distance: f64,
    /// Outward normal `[along the axis, away from it]`, unit length.
    pub(super) normal: [f64; 2],
    /// Material coordinate from base (0) to apex (1).
    pub(super) material: f64,
    /// Centimetres of profile per unit of material coordinate.
    pub(super) stretch: f64,
}

impl Profile {
    /// The upper half of a full meridian `[x, y]`, closed on the axis where y changes sign.
    pub(super) fn new(full: &[[f64; 2]]) -> Self {
        let mut nodes: Vec<[f64; 2]> = full.iter().copied().take_while(|p| p[1] > 0.0).collect();
        let mut at = nodes.len() as f64;
        if let (Some(a), Some(b)) = (nodes.last().copied(), full.get(nodes.len())) {
            let t = a[1] / (a[1] - b[1]);
            nodes.push([a[0] + t * (b[0] - a[0]), 0.0]);
            at += t - 1.0;
        }
        let n = nodes.len();
        let mut material: Vec<f64> = (0..n).map(|i| i as f64 / at.max(1.0)).collect();
        if let Some(last) = material.last_mut() {
            *last = 1.0;
        }
        let normals = (0..n)
            .map(|i| {
                let (a, b) = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(n - 1)]);
                let (dx, dr) = if i + 1 == n {
                    (0.0, -1.0)
                } else {
                    (b[0] - a[0], b[1] - a[1])
                };
                let length = dx.hypot(dr).max(f64::MIN_POSITIVE);
                [-dr / length, dx / length]
            })
            .collect();
        let x_range = nodes
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| {
                [a.min(p[0]), b.max(p[0])]
            });
        let mut profile = Self {
            nodes,
            normals,
            material,
            buckets: vec![Vec::new(); BUCKETS],
            x_range,
        };
        for k in 0..n.saturating_sub(1) {
            let (a, b) = (
                profile.bucket(profile.nodes[k][0]),
                profile.bucket(profile.nodes[k + 1][0]),
            );
            // A neighbour more, for points that rounding puts beside their segment.
            for i in a.min(b).saturating_sub(1)..=(a.max(b) + 1).min(BUCKETS - 1) {
                profile.buckets[i].push(k);
            }
        }
        profile
    }

    fn bucket(&self, x: f64) -> usize {
        let [low, high] = self.x_range;
        let along = (x - low) / (high - low).max(f64::MIN_POSITIVE);
        ((along * BUCKETS as f64).max(0.0) as usize).min(BUCKETS - 1)
    }

    /// The nearest point of the profile to a point at `x` along the axis and `r` from it.
    pub(super) fn at(&self, x: f64, r: f64) -> Option<OnProfile> {
        let mut best: Option<(f64, usize, f64)> = None;
        for &k in &self.buckets[self.bucket(x)] {
            let (a, b) = (self.nodes[k], self.nodes[k + 1]);
            let (dx, dr) = (b[0] - a[0], b[1] - a[1]);
            let square = dx * dx + dr * dr;
            let t = if square > 0.0 {
                ((x - a[0]) * dx + (r - a[1]) * dr) / square
            } else {
                0.0
            };
            let t = t.clamp(0.0, 1.0);
            let (ex, er) = (x - a[0] - t * dx, r - a[1] - t * dr);
            let squared = ex * ex + er * er;
            if best.is_none_or(|(d, _, _)| squared < d) {
                best = Some((squared, k, t));
            }
        }
        let (squared, k, t) = best?;
        let mix = |a: f64, b: f64| a + t * (b - a);
        let normal: [f64; 2] =
            std::array::from_fn(|c| mix(self.normals[k][c], self.normals[k + 1][c]));
        let length = normal[0].hypot(normal[1]).max(f64::MIN_POSITIVE);
        let (a, b) = (self.nodes[k], self.nodes[k + 1]);
        let step = self.material[k + 1] - self.material[k];
        Some(OnProfile {
            distance: squared.sqrt(),
            normal: normal.map(|v| v / length),
            material: mix(self.material[k], self.material[k + 1]),
            stretch: (b[0] - a[0]).hypot(b[1] - a[1]) / step.max(f64::MIN_POSITIVE),
        })
    }
}
