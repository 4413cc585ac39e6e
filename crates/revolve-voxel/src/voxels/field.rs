//! A map of the half-plane: lists nearby segments, and classifies points far from the surface.

use rayon::prelude::*;

use crate::solid::meridian::Meridian;

/// Square cells over the half-plane; a cell near the surface lists the segments that can be nearest to its points.
#[derive(Debug)]
pub(crate) struct Field<'a> {
    meridian: &'a Meridian,
    lines: Vec<Line>,
    x0: f64,
    inv_size: f64,
    half_diagonal: f64,
    shape: [usize; 2],
    cells: Vec<Cell>,
}

/// A segment as a line: `a x + b r + c` is the height over it, outward.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    pub(crate) a: f64,
    pub(crate) b: f64,
    pub(crate) c: f64,
    /// Start of the segment.
    pub(crate) start: [f64; 2],
}

impl Line {
    #[inline(always)]
    pub(crate) fn height(&self, x: f64, r: f64) -> f64 {
        self.a * x + self.b * r + self.c
    }
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Signed distance at the centre.
    distance: f64,
    first: u32,
    len: u32,
    bend: Bend,
}

/// The arrangement of the segments near a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bend {
    /// No segment is near.
    None,
    /// Connected, turning toward the solid: inside where all heights are negative.
    Convex,
    /// Connected, turning away from the solid: inside where any height is negative.
    Reflex,
    /// Other: turning both ways or strongly, or disconnected.
    Other,
}

/// The classification of a point.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Answer<'a> {
    /// At least the given distance from the surface; inside or outside.
    Far(bool),
    /// The surface near it consists of these lines.
    Run { lines: &'a [Line], reflex: bool },
    /// Not classified.
    Unknown,
}

/// Largest turn (radians) of connected segments in a local approximation.
const MOST_TURN: f64 = 0.8;

impl<'a> Field<'a> {
    /// Creates a field for distances up to `near` (half the diagonal of a voxel), with cells of about `size`, but at least half of
    /// `near`: smaller cells would list the same segments.
    pub(crate) fn new(meridian: &'a Meridian, near: f64, size: f64) -> Self {
        let size = size.max(0.5 * near);
        let [a, b] = meridian.x_range();
        let margin = near + 2.0 * size;
        let extent = [b - a + 2.0 * margin, meridian.r_max() + margin];
        // At most a quarter of a million cells, which is sufficient for fine grids.
        // Including one long row.
        let longest = extent[0].max(extent[1]);
        let size = size
            .max((extent[0] * extent[1] / 250_000.0).sqrt())
            .max(longest / 250_000.0);
        let shape = extent.map(|e| (e / size).ceil() as usize);
        let half_diagonal = size * std::f64::consts::FRAC_1_SQRT_2;
        let x0 = a - margin;
        let cells = (0..shape[0] * shape[1])
            .into_par_iter()
            .with_min_len(256)
            .map_init(Vec::new, |list, k| {
                simd_set::checkpoint();
                let (i, j) = (k % shape[0], k / shape[0]);
                let (x, r) = (x0 + (i as f64 + 0.5) * size, (j as f64 + 0.5) * size);
                let distance = meridian.distance_at(x, r);
                let mut cell = Cell {
                    distance,
                    first: 0,
                    len: 0,
                    bend: Bend::None,
                };
                if distance.abs() <= near + 2.0 * half_diagonal {
                    let reach = (distance.abs() + 2.0 * half_diagonal).max(near + half_diagonal);
                    list.clear();
                    meridian.segments_within(reach * (1.0 + 1e-12), x, r, list);
                    list.sort_unstable();
                    cell.first = list[0];
                    cell.len = list.len() as u32;
                    cell.bend = bend(meridian, list);
                }
                cell
            })
            .collect();
        Self {
            meridian,
            lines: (meridian.segments().iter())
                .map(|s| Line {
                    a: -s.tr,
                    b: s.tx,
                    c: s.tr * s.x0 - s.tx * s.r0,
                    start: s.start(),
                })
                .collect(),
            x0,
            inv_size: 1.0 / size,
            half_diagonal,
            shape,
            cells,
        }
    }

    pub(crate) fn meridian(&self) -> &Meridian {
        self.meridian
    }

    /// Returns the classification of a point for the surface within `far` (at most `near` of the field).
    #[inline(always)]
    pub(crate) fn ask(&self, x: f64, r: f64, far: f64) -> Answer<'_> {
        let (u, v) = ((x - self.x0) * self.inv_size, r * self.inv_size);
        if !(u >= 0.0 && u < self.shape[0] as f64 && v < self.shape[1] as f64) {
            let [a, b] = self.meridian.x_range();
            let gap = (a - x)
                .max(x - b)
                .max(0.0)
                .hypot((r - self.meridian.r_max()).max(0.0));
            return if gap >= far {
                Answer::Far(false)
            } else {
                Answer::Unknown
            };
        }
        let cell = &self.cells[v as usize * self.shape[0] + u as usize];
        if cell.distance.abs() - self.half_diagonal >= far {
            return Answer::Far(cell.distance < 0.0);
        }
        match cell.bend {
            Bend::None | Bend::Other => Answer::Unknown,
            bend => Answer::Run {
                lines: &self.lines[cell.first as usize..(cell.first + cell.len) as usize],
                reflex: bend == Bend::Reflex,
            },
        }
    }

    /// Returns whether all points within `reach` of a point are inside or all outside; with zero `reach` always decided.
    #[inline(always)]
    pub(crate) fn inside(&self, x: f64, r: f64, reach: f64) -> Option<bool> {
        match self.ask(x, r, reach) {
            Answer::Far(inside) => Some(inside),
            _ if reach > 0.0 => None,
            Answer::Run { lines, reflex } => {
                let below = |l: &Line| l.height(x, r) < 0.0;
                Some(if reflex {
                    lines.iter().any(below)
                } else {
                    lines.iter().all(below)
                })
            }
            Answer::Unknown => Some(self.meridian.distance_at(x, r) < 0.0),
        }
    }
}

/// Returns the arrangement of segments with ascending indices.
fn bend(meridian: &Meridian, list: &[u32]) -> Bend {
    let (mut left, mut right) = (0.0f64, 0.0f64);
    for pair in list.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|k| &meridian.segments()[k as usize]);
        if pair[0] + 1 != pair[1] || a.end() != b.start() {
            return Bend::Other;
        }
        let turn = (a.tx * b.tr - a.tr * b.tx).atan2(a.tx * b.tx + a.tr * b.tr);
        left += turn.max(0.0);
        right -= turn.min(0.0);
    }
    // Collinear up to rounding is either.
    let small = 1e-12 * list.len() as f64;
    if left.max(right) > MOST_TURN {
        Bend::Other
    } else if left <= small {
        Bend::Convex
    } else if right <= small {
        Bend::Reflex
    } else {
        Bend::Other
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Pose, VoxelGrid};

    #[test]
    fn a_map_for_long_voxels_lists_no_more_than_one_for_cubes_of_their_shortest_side() {
        let n = 400;
        let points: Vec<[f64; 2]> = (0..=n)
            .map(|k| (std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(n)).sin_cos())
            .map(|(sin, cos)| [10.0 * (1.0 - cos), 3.0 * sin])
            .collect();
        let body = Body::new(vec![Meridian::new(&points).unwrap()], Pose::identity()).unwrap();
        let listed = |spacing: [f64; 3]| {
            let grid = VoxelGrid::centred([1; 3], spacing, [0.0; 3]).unwrap();
            let field = Field::of(&body.layers()[0], &grid);
            field
                .cells
                .iter()
                .map(|c| 1 + u64::from(c.len))
                .sum::<u64>()
        };
        for h in [1.1, 0.3, 0.04] {
            let cubes = listed([h; 3]);
            for long in [2.0, 3.0, 4.0, 16.0, 300.0, 1e6] {
                for spacing in [[long * h, h, h], [h, long * h, long * h]] {
                    let listed = listed(spacing);
                    assert!(listed < 2 * cubes, "{spacing:?}: {listed}, cubes {cubes}");
                }
            }
        }
        // For any thickness.
        assert!(listed([1.0, 1.0, 1e-6]) < 200_000);
    }

    #[test]
    fn a_map_of_a_long_thin_body_is_no_larger_than_others() {
        for length in [1.0, 1e3, 1e6, 1e7] {
            let needle = Meridian::new(&[[0.0, 1.0], [length, 1.0]]).unwrap();
            let body = Body::new(vec![needle], Pose::identity()).unwrap();
            let grid = VoxelGrid::centred([1; 3], [1e-4; 3], [0.0; 3]).unwrap();
            let cells = Field::of(&body.layers()[0], &grid).cells.len();
            // A quarter of a million, plus rounding up.
            assert!(cells <= 750_000, "{length}: {cells}");
        }
    }
}
