//! Material coordinates of a point in a wall.
//!
//! A map of cells over the half-plane lists the lines near a point. Newton's method finds its line between two of them.

use crate::Shell;
use crate::voxels::disc::cross;
use crate::wall::isoline::{ON_AXIS, less, norm};
use crate::wall::root::rising_root;

impl Shell {
    /// Returns layer and s of a point (x, r); `None` outside the wall.
    ///
    /// The wall includes its surfaces, to 1e-12 of its size. Cost: several evaluations of both curves.
    #[must_use]
    pub fn locate(&self, p: [f64; 2]) -> Option<[f64; 2]> {
        let [first, last] = self.cells.at(p)?;
        let (lines, isolines) = (&self.lines, &self.isolines);
        let slack = ON_AXIS * isolines.size;
        let mut line = &lines[first];
        let mut before = line.before(p);
        // The end lines have no neighbour for points on them.
        if first == 0 && before < 0.0 && before >= -slack * norm(line.along) {
            before = 0.0;
        }
        for (k, next) in lines.iter().enumerate().take(last + 1).skip(first + 1) {
            let mut ahead = next.before(p);
            if k == lines.len() - 1 && ahead > 0.0 && ahead <= slack * norm(next.along) {
                ahead = 0.0;
            }
            if before >= 0.0 && ahead <= 0.0 {
                let rising = |s: f64| {
                    let (before, fall) = isolines.before(p, s);
                    (-before, fall)
                };
                let start = line.s + (next.s - line.s) * before / (before - ahead);
                // Where a wall has no thickness the root is indeterminate, but not for points on one of its lines.
                let s = match (before == 0.0, ahead == 0.0) {
                    (true, false) => line.s,
                    (false, true) => next.s,
                    _ => rising_root(rising, [line.s, next.s], start),
                };
                let isoline = isolines.at(s);
                let from = less(p, isoline.inner.position);
                let length = norm(isoline.line);
                let t = (from[0] * isoline.line[0] + from[1] * isoline.line[1]) / (length * length);
                let excess = slack / length;
                let off = cross(from, isoline.line).abs() / length;
                if t >= -excess && t <= 1.0 + excess && off <= slack {
                    return Some([isoline.share(t.clamp(0.0, 1.0)), s]);
                }
            }
            (line, before) = (next, ahead);
        }
        None
    }
}
