//! Runs of segments that a coarse tolerance need not tell apart.
//!
//! A meridian of 800 nodes has dozens of segments in a large voxel. Where a section's area stops being smooth (the circle passes a
//! corner of the box) hangs on all of them but little: a cone through the ends of a run tells it nearly as well, and the area itself is
//! taken at the meridian's own radius.

use crate::solid::chains::{Chain, Vertex};
use crate::solid::meridian::Meridian;

/// Segments of a run, at most: whoever makes runs looks at each of them for each.
const LONGEST: usize = 64;

/// How far a run may rise over its cone, as a share of a side and of the tolerance's power 2/3. Set by measuring: bodies of 12 to 400
/// nodes in voxels of 0.16 to 0.64 of their smallest radius and longer ones were off by 0.2 of the tolerance at most.
const OF_SIDE: f64 = 0.5;

/// Tolerances from here on are coarse; at finer ones breaks have to be where each segment has them.
pub(crate) const COARSE: f64 = 8e-5;

/// The vertices at which the runs of each chain of a meridian begin, and the last one.
#[derive(Debug)]
pub(crate) struct Runs(Vec<Vec<u32>>);

impl Runs {
    /// Runs for boxes with sides of at least `side` and a tolerance (a fraction of the box).
    pub(crate) fn new(meridian: &Meridian, side: f64, tolerance: f64) -> Self {
        if tolerance < COARSE {
            return Self::each(meridian);
        }
        // A break that is missed by d costs some d^(3/2) of the box, where the circle touches a face.
        let most = OF_SIDE * side * tolerance.cbrt().powi(2);
        let runs = |chain: &Chain| {
            let (mut starts, mut first, last) = (vec![0], 0, chain.vertices.len() - 1);
            for k in 1..=last {
                if k == last || !straight(&chain.vertices[first..=k + 1], most) {
                    starts.push(k as u32);
                    first = k;
                }
            }
            starts
        };
        Self(meridian.chains().iter().map(runs).collect())
    }

    /// Each segment by itself.
    pub(crate) fn each(meridian: &Meridian) -> Self {
        let all = |chain: &Chain| (0..chain.vertices.len() as u32).collect();
        Self(meridian.chains().iter().map(all).collect())
    }

    /// The runs of a chain, given its vertices.
    pub(crate) fn of(&self, chain: usize) -> &[u32] {
        &self.0[chain]
    }
}

/// Is the radius between the first and the last vertex that of the cone through them, but for `most`?
fn straight(vertices: &[Vertex], most: f64) -> bool {
    let (v, w) = (&vertices[0], &vertices[vertices.len() - 1]);
    let slope = (w.r - v.r) / (w.x - v.x);
    vertices.len() <= LONGEST + 1
        && vertices
            .iter()
            .all(|p| (p.r - v.r - slope * (p.x - v.x)).abs() <= most)
}

/// Some segments of a chain.
pub(crate) struct Run<'a> {
    vertices: &'a [Vertex],
    /// Radius at the middle of the meridian, and slope, of the cone through the ends.
    pub(crate) cone: [f64; 2],
}

impl<'a> Run<'a> {
    pub(crate) fn new(vertices: &'a [Vertex]) -> Self {
        let (v, w) = (&vertices[0], &vertices[vertices.len() - 1]);
        let slope = match vertices.len() {
            2 => v.tr / v.tx,
            _ => (w.r - v.r) / (w.x - v.x),
        };
        Self {
            vertices,
            cone: [v.r - slope * v.x, slope],
        }
    }

    /// The meridian's radius.
    #[inline(always)]
    pub(crate) fn radius(&self, x: f64) -> f64 {
        if self.vertices.len() == 2 {
            return self.cone[0] + self.cone[1] * x;
        }
        let inner = &self.vertices[1..self.vertices.len() - 1];
        let v = &self.vertices[inner.partition_point(|v| v.x <= x)];
        v.r + v.tr / v.tx * (x - v.x)
    }
}
