//! Overlap areas of pixels and the cells of a rotated grid, and overlap lengths of layers and rows.

/// Smaller areas and lengths, as fractions of a cell, are rounding errors of coincident edges.
const LEAST: f64 = 1e-14;

/// The cells covered by a polygon, from the signed areas to one side of its edges.
#[derive(Debug, Default)]
pub(super) struct Cover {
    first: [i64; 2],
    size: [usize; 2],
    /// For each row of cells, the contribution of each cell to the covered area in it and in all cells behind it.
    rows: Vec<f64>,
    cuts: Vec<f64>,
}

impl Cover {
    /// Calls `each` with the index and the covered fraction of each cell [i, i + 1] x [j, j + 1] that a convex polygon intersects; corners
    /// clockwise.
    pub(super) fn cells(&mut self, corners: &[[f64; 2]; 4], mut each: impl FnMut([i64; 2], f64)) {
        for axis in 0..2 {
            let of = |fold: fn(f64, f64) -> f64| corners.iter().map(|c| c[axis]).reduce(fold);
            let (least, most) = (of(f64::min).unwrap_or(0.0), of(f64::max).unwrap_or(0.0));
            self.first[axis] = least.floor() as i64;
            self.size[axis] = (most.floor() as i64 - self.first[axis]) as usize + 1;
        }
        // One more in each row, for the area behind the last cell.
        let stride = self.size[0] + 1;
        self.rows.clear();
        self.rows.resize(stride * self.size[1], 0.0);
        for k in 0..4 {
            self.edge(corners[k], corners[(k + 1) % 4]);
        }
        for (j, row) in self.rows.chunks_exact(stride).enumerate() {
            let mut area = 0.0;
            for (i, add) in row[..self.size[0]].iter().enumerate() {
                area += add;
                if area > LEAST {
                    each([self.first[0] + i as i64, self.first[1] + j as i64], area);
                }
            }
        }
    }

    /// Adds the area beyond an edge, piece by piece between the lines of the grid.
    fn edge(&mut self, p: [f64; 2], q: [f64; 2]) {
        let step = [q[0] - p[0], q[1] - p[1]];
        if step[1] == 0.0 {
            return;
        }
        self.cuts.clear();
        self.cuts.extend([0.0, 1.0]);
        for axis in 0..2 {
            let (low, high) = (p[axis].min(q[axis]), p[axis].max(q[axis]));
            let mut line = low.floor() + 1.0;
            while line < high {
                self.cuts.push((line - p[axis]) / step[axis]);
                line += 1.0;
            }
        }
        self.cuts.sort_unstable_by(f64::total_cmp);
        for pair in self.cuts.windows(2) {
            let middle = 0.5 * (pair[0] + pair[1]);
            let [u, v] = [0, 1].map(|axis| p[axis] + middle * step[axis]);
            let inside = |x: f64, axis: usize| {
                (x.floor() as i64 - self.first[axis]).clamp(0, self.size[axis] as i64 - 1) as usize
            };
            let (i, j) = (inside(u, 0), inside(v, 1));
            let behind = (u - (self.first[0] + i as i64) as f64).clamp(0.0, 1.0);
            let height = (pair[1] - pair[0]) * step[1];
            let at = j * (self.size[0] + 1) + i;
            self.rows[at] += height * (1.0 - behind);
            self.rows[at + 1] += height * behind;
        }
    }
}

/// Returns the cells that a segment [low, high] overlaps, with the overlap as a fraction of a cell; cell k is [k, k + 1].
pub(super) fn segment(low: f64, high: f64) -> impl Iterator<Item = (i64, f64)> {
    let (first, last) = (low.floor() as i64, high.floor() as i64);
    (first..=last)
        .map(move |k| (k, high.min((k + 1) as f64) - low.max(k as f64)))
        .filter(|&(_, length)| length > LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit square turned by 45 degrees about the middle of a cell: the corners beyond the cell's sides are triangles.
    #[test]
    fn a_rotated_square_has_its_exact_overlaps() {
        let r = 0.5_f64.sqrt();
        let corners = [
            [0.5, 0.5 - r],
            [0.5 - r, 0.5],
            [0.5, 0.5 + r],
            [0.5 + r, 0.5],
        ];
        let tip = (r - 0.5).powi(2);
        let mut seen = Vec::new();
        Cover::default().cells(&corners, |at, area| seen.push((at, area)));
        assert_eq!(seen.len(), 5);
        for (at, area) in seen {
            let expected = if at == [0, 0] { 1.0 - 4.0 * tip } else { tip };
            assert!((area - expected).abs() < 1e-15, "{at:?} {area}");
        }
    }

    #[test]
    fn a_segment_is_divided_among_cells() {
        let parts: Vec<_> = segment(-0.25, 2.0).collect();
        assert_eq!(parts, [(-1, 0.25), (0, 1.0), (1, 1.0)]);
    }
}
