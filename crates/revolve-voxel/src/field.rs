//! A map of the half-plane that makes distances near the surface cheap and answers far from it without looking.

use rayon::prelude::*;

use crate::distance::{Distance, Tangents};
use crate::meridian::Meridian;

/// Lists longer than this are searched by the tree instead.
const LIST: usize = 12;

/// Square cells over the half-plane; a cell near the surface lists the segments that can be nearest to its points.
#[derive(Debug)]
pub(crate) struct Field<'a> {
    profile: &'a Meridian,
    x0: f64,
    size: f64,
    shape: [usize; 2],
    cells: Vec<Cell>,
    lists: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    /// Signed distance of the centre.
    distance: f64,
    first: u32,
    len: u32,
}

/// What is known of a point's distance.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Answer {
    /// Its absolute value is at least the one asked for; inside or not.
    Far(bool),
    /// The distance, and the tangents of all segments nearer than the one asked for.
    Near(Distance, Tangents),
    /// Neither: the cell is not near enough to the surface for a list, nor far enough to tell.
    Between,
}

impl<'a> Field<'a> {
    /// A field that answers distances up to `near` (half a voxel's diagonal), with cells of about `size`.
    pub(crate) fn new(profile: &'a Meridian, near: f64, size: f64) -> Self {
        let [a, b] = profile.x_range();
        let margin = near + 2.0 * size;
        let extent = [b - a + 2.0 * margin, profile.r_max() + margin];
        // Never more than a quarter of a million cells: a fine grid gains nothing from finer ones.
        let size = size.max((extent[0] * extent[1] / 250_000.0).sqrt());
        let shape = extent.map(|e| (e / size).ceil() as usize);
        let half_diagonal = size * std::f64::consts::FRAC_1_SQRT_2;
        let x0 = a - margin;
        let rows: Vec<(Vec<Cell>, Vec<u32>)> = (0..shape[1])
            .into_par_iter()
            .map(|j| {
                let mut lists = Vec::new();
                let cells = (0..shape[0])
                    .map(|i| {
                        let (x, r) = (x0 + (i as f64 + 0.5) * size, (j as f64 + 0.5) * size);
                        let distance = profile.distance_at(x, r).value;
                        let first = lists.len() as u32;
                        if distance.abs() <= near + 2.0 * half_diagonal {
                            let reach =
                                (distance.abs() + 2.0 * half_diagonal).max(near + half_diagonal);
                            profile.segments_within(reach * (1.0 + 1e-12), x, r, &mut lists);
                        }
                        Cell {
                            distance,
                            first,
                            len: lists.len() as u32 - first,
                        }
                    })
                    .collect();
                (cells, lists)
            })
            .collect();
        let mut field = Self {
            profile,
            x0,
            size,
            shape,
            cells: Vec::with_capacity(shape[0] * shape[1]),
            lists: Vec::new(),
        };
        for (cells, lists) in rows {
            let offset = field.lists.len() as u32;
            field.cells.extend(cells.into_iter().map(|c| Cell {
                first: c.first + offset,
                ..c
            }));
            field.lists.extend(lists);
        }
        field
    }

    pub(crate) fn profile(&self) -> &Meridian {
        self.profile
    }

    /// The distance of a point, unless it is at least `far` (no more than the field's `near`, for tangents) in absolute
    /// value.
    #[inline]
    pub(crate) fn ask(&self, x: f64, r: f64, far: f64) -> Answer {
        let (u, v) = ((x - self.x0) / self.size, r / self.size);
        if !(u >= 0.0 && u < self.shape[0] as f64 && v < self.shape[1] as f64) {
            let [a, b] = self.profile.x_range();
            let gap = (a - x)
                .max(x - b)
                .max(0.0)
                .hypot((r - self.profile.r_max()).max(0.0));
            return if gap >= far {
                Answer::Far(false)
            } else {
                Answer::Between
            };
        }
        let (i, j) = (u as usize, v as usize);
        let cell = &self.cells[j * self.shape[0] + i];
        let (du, dv) = (u - i as f64 - 0.5, v - j as f64 - 0.5);
        let off = (du * du + dv * dv).sqrt() * self.size;
        if cell.distance.abs() - off >= far {
            return Answer::Far(cell.distance < 0.0);
        }
        let list = &self.lists[cell.first as usize..(cell.first + cell.len) as usize];
        match list.len() {
            0 => Answer::Between,
            1..=LIST => {
                let (distance, tangents) = self.profile.distance_among(list, x, r, far);
                Answer::Near(distance, tangents)
            }
            n => Answer::Near(
                self.profile.distance_from(Some(list[n / 2] as usize), x, r),
                self.profile.tangents_within(x, r, far),
            ),
        }
    }
}
