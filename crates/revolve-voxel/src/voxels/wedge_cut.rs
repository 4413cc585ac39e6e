//! The part of a box inside a wedge.

use crate::solid::wedge::Wedge;
use crate::voxels::disc::between;

/// A wedge that intersects a box.
pub(crate) struct Cut<'a> {
    pub(crate) wedge: &'a Wedge,
    /// Axial coordinates of the corners of this part, ascending, and the volume below each.
    pub(crate) stops: Vec<[f64; 2]>,
}

impl Cut<'_> {
    /// Sum of a measure relative to the axis over the edges of an outline inside the wedge.
    pub(crate) fn sum(
        &self,
        outline: &[[[f64; 2]; 2]],
        of: impl Fn([f64; 2], [f64; 2]) -> f64,
    ) -> f64 {
        let edge = |&[p, q]: &[[f64; 2]; 2]| {
            let parts = self.wedge.parts(p, q).into_iter().flatten();
            parts
                .map(|[from, to]| of(between(p, q, from), between(p, q, to)))
                .sum::<f64>()
        };
        outline.iter().map(edge).sum()
    }
}
