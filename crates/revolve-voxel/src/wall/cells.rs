//! A map of cells over the half-plane that lists lines near the points of a cell.

use crate::voxels::disc::cross;
use crate::wall::isoline::{Isolines, less, norm};

/// Cells along the longer side of the map.
const CELLS: f64 = 128.0;

/// The line of one s, from the inner to the outer curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    pub(crate) s: f64,
    pub(crate) start: [f64; 2],
    pub(crate) along: [f64; 2],
}

impl Line {
    /// Positive if it lies before the point.
    pub(crate) fn before(&self, p: [f64; 2]) -> f64 {
        cross(less(p, self.start), self.along)
    }
}

/// Square cells over the half-plane, each with the lines between which its points may lie.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cells {
    pub(crate) low: [f64; 2],
    pub(crate) high: [f64; 2],
    inv_size: f64,
    shape: [usize; 2],
    /// First and last line, or none.
    lines: Vec<Option<[u32; 2]>>,
}

impl Cells {
    pub(crate) fn new(isolines: &Isolines, lines: &[Line]) -> Self {
        // The region between two lines lies in the box about their ends, except for the curvature of the curves between them: an
        // eighth of the second derivative; four times as much is used.
        let boxes: Vec<[[f64; 2]; 2]> = lines
            .windows(2)
            .map(|pair| {
                let mut b = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
                let step = pair[1].s - pair[0].s;
                for line in pair {
                    for curve in [&isolines.inner, &isolines.outer] {
                        let at = curve.at(line.s);
                        let margin = 0.5 * step * step * norm(at.second) + 1e-9 * isolines.size;
                        for k in 0..2 {
                            b[0][k] = b[0][k].min(at.position[k] - margin);
                            b[1][k] = b[1][k].max(at.position[k] + margin);
                        }
                    }
                }
                b
            })
            .collect();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for [a, b] in &boxes {
            for k in 0..2 {
                low[k] = low[k].min(a[k]);
                high[k] = high[k].max(b[k]);
            }
        }
        let inv_size = CELLS / (high[0] - low[0]).max(high[1] - low[1]);
        let shape = [0, 1].map(|k| ((high[k] - low[k]) * inv_size) as usize + 1);
        let mut cells = Self {
            low,
            high,
            inv_size,
            shape,
            lines: vec![None; shape[0] * shape[1]],
        };
        for (k, [a, b]) in boxes.iter().enumerate() {
            let [from, to] = [a, b].map(|p| [cells.index(0, p[0]), cells.index(1, p[1])]);
            for j in from[1]..=to[1] {
                for i in from[0]..=to[0] {
                    let cell = &mut cells.lines[j * shape[0] + i];
                    let first = cell.map_or(k as u32, |[first, _]| first);
                    *cell = Some([first, k as u32 + 1]);
                }
            }
        }
        cells
    }

    fn index(&self, axis: usize, x: f64) -> usize {
        (((x - self.low[axis]) * self.inv_size) as usize).min(self.shape[axis] - 1)
    }

    /// Returns the first and last line between which a point may lie; `None` for NaN.
    #[inline(always)]
    pub(crate) fn at(&self, p: [f64; 2]) -> Option<[usize; 2]> {
        if !(0..2).all(|k| p[k] >= self.low[k] && p[k] <= self.high[k]) {
            return None;
        }
        let cell = self.lines[self.index(1, p[1]) * self.shape[0] + self.index(0, p[0])]?;
        Some([cell[0] as usize, cell[1] as usize])
    }
}
