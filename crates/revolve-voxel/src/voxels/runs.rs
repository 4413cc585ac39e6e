//! Runs of segments that are merged at a coarse tolerance.
//!
//! A meridian of 800 nodes has dozens of segments in a large voxel. The singular points of the area of a cross-section (where the
//! circle passes a corner of the box) depend only weakly on each segment: a cone through the ends of a run gives them almost as
//! well. The area itself uses the radius of the meridian.

use crate::solid::chains::{Chain, Vertex};
use crate::solid::meridian::Meridian;

/// Largest number of segments in a run, which limits the cost of making runs.
const LONGEST: usize = 64;

/// Largest deviation of a run from its cone, relative to a side and the tolerance to the power 2/3. Measured: for bodies of 12 to
/// 400 nodes in voxels of 0.16 to 0.64 of their smallest radius and longer ones the error was at most 0.2 of the tolerance.
const OF_SIDE: f64 = 0.5;

/// Tolerances above this are coarse; finer ones need the singular points of each segment.
pub(crate) const COARSE: f64 = 8e-5;

/// The vertices at which the runs of each chain of a meridian begin, and the last one.
#[derive(Debug)]
pub(crate) struct Runs(Vec<Vec<u32>>);

impl Runs {
    /// Returns runs for boxes with sides of at least `side` and a tolerance (a fraction of the box).
    pub(crate) fn new(meridian: &Meridian, side: f64, tolerance: f64) -> Self {
        if tolerance < COARSE {
            return Self::each(meridian);
        }
        // An error d of a singular point costs about d^(3/2) of the box, where the circle touches a face.
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

    /// Runs of single segments.
    pub(crate) fn each(meridian: &Meridian) -> Self {
        let all = |chain: &Chain| (0..chain.vertices.len() as u32).collect();
        Self(meridian.chains().iter().map(all).collect())
    }

    /// The runs of a chain, given its vertices.
    pub(crate) fn of(&self, chain: usize) -> &[u32] {
        &self.0[chain]
    }
}

/// Returns whether the radius between the first and the last vertex is within `most` of the cone through them.
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

    /// Returns the radius of the meridian.
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
