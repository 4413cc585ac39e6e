//! Voxels in and around a wall, with the nearest material.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::finite;
use crate::rays::lines::{indices, not_positive};
use crate::solid::segment::on_chord;
use crate::voxels::coverage::check_range;
use crate::wall::cells::{Cells, Line};
use crate::wall::isoline::{less, norm};
use crate::{Pose, RevolveError, Shell, VoxelGrid};

/// Chords that approximate the surfaces of a wall, and those across its open ends.
struct Outline {
    /// Parameters of the ends of the chords.
    s: Vec<f64>,
    /// The inner and the outer surface.
    sides: [Side; 2],
    ends: Vec<End>,
}

/// Points of a surface with their arc length.
struct Side {
    points: Vec<[f64; 2]>,
    arcs: Vec<f64>,
}

/// The line across an open end, and its index.
struct End {
    points: [[f64; 2]; 2],
    line: usize,
}

impl Outline {
    fn of(shell: &Shell) -> Self {
        let lines = &shell.lines;
        let outer = |line: &Line| [0, 1].map(|a| line.start[a] + line.along[a]);
        let side = |place: &dyn Fn(&Line) -> [f64; 2]| {
            let points: Vec<[f64; 2]> = lines.iter().map(place).collect();
            let mut arcs = vec![0.0];
            for pair in points.windows(2) {
                arcs.push(arcs[arcs.len() - 1] + norm(less(pair[1], pair[0])));
            }
            Side { points, arcs }
        };
        let end = |line: usize| End {
            points: [lines[line].start, outer(&lines[line])],
            line,
        };
        // An end on the axis is not open: it is surrounded by material.
        let open = |end: &End| end.points.iter().any(|point| point[1] > 0.0);
        Self {
            s: lines.iter().map(|line| line.s).collect(),
            sides: [side(&|line| line.start), side(&outer)],
            ends: [end(0), end(lines.len() - 1)]
                .into_iter()
                .filter(open)
                .collect(),
        }
    }
}

impl Shell {
    /// Returns layer and s of the point on a surface or an open end that is nearest to a point (x, r) outside the wall, and the distance.
    ///
    /// `chords` are the first chords of either surface to be tested, and then the nearest ones: for a neighbouring point they bound the
    /// distance, so that few others are tested.
    fn find_nearest(
        &self,
        outline: &Outline,
        p: [f64; 2],
        chords: &mut [usize; 2],
    ) -> ([f64; 2], f64) {
        let (mut least, mut material) = (f64::INFINITY, [0.0; 2]);
        for End { points, line } in &outline.ends {
            let [along, squared] = on_chord(p, *points);
            if squared < least {
                let isoline = self.isolines.at(outline.s[*line]);
                (least, material) = (squared, [isoline.share(along), outline.s[*line]]);
            }
        }
        for ((side, layer), first) in outline.sides.iter().zip([0.0, 1.0]).zip(chords) {
            let (start, mut k) = (*first, 0);
            let mut test = |k: usize, least: &mut f64| {
                let [along, squared] = on_chord(p, [side.points[k], side.points[k + 1]]);
                if squared < *least {
                    let [s, t] = [outline.s[k], outline.s[k + 1]];
                    (*least, material, *first) = (squared, [layer, s + along * (t - s)], k);
                }
            };
            test(start, &mut least);
            while k + 1 < side.points.len() {
                test(k, &mut least);
                // A nearer point is at least this distance along the surface.
                let next = side.arcs[k + 1] + norm(less(p, side.points[k + 1])) - least.sqrt();
                k += 1;
                k += side.arcs[k..]
                    .partition_point(|arc| *arc <= next)
                    .saturating_sub(1);
            }
        }
        (material, least.sqrt())
    }

    /// Evaluates a function at the centre of every voxel of some slices within `reach` (cm) of the wall in `pose`; with a reach of 0 in the wall. The
    /// function receives the centre in the body frame, and layer and s of the nearest point of the wall with its distance: those of the centre itself
    /// in the wall, else of a point on a surface or an open end. Returns the index of the voxel among these slices (`[z][y][x]`), ascending, with
    /// the result.
    ///
    /// For points outside the wall both curves are approximated by at least 128 chords, with an error of an eighth of the curvature times the
    /// squared chord length. Cost: proportional to the number of voxels in the cylinder around the wall. Rows are distributed over the threads of
    /// the current rayon pool; results are bitwise independent of their number.
    ///
    /// # Errors
    /// [`RevolveError::BadRange`] for slices outside the grid; [`RevolveError::Negative`] or [`RevolveError::NotFinite`] for the
    /// reach.
    pub fn map_voxels<T: Send>(
        &self,
        pose: &Pose,
        grid: &VoxelGrid,
        slices: Range<usize>,
        reach: f64,
        f: impl Fn(&Point3<f64>, [f64; 2], f64) -> T + Sync,
    ) -> Result<Vec<(usize, T)>, RevolveError> {
        check_range(grid, &slices)?;
        if finite("reach", reach)? < 0.0 {
            let what = "reach";
            return Err(RevolveError::Negative { what, given: reach });
        }
        let [nx, ny, _] = grid.shape();
        let Cells { low, high, .. } = &self.cells;
        let cylinder = ([low[0] - reach, high[0] + reach], high[1] + reach);
        let outline = Outline::of(self);
        let (first, f, outline) = (slices.start * ny, &f, &outline);
        Ok((first..slices.end * ny)
            .into_par_iter()
            .with_min_len(slices.len() * ny / 1024) // about a thousand jobs at most: after a stop each unwinds its thread
            .flat_map_iter(|row| {
                simd_set::unit(slices.len() * ny);
                let (y, z) = (row % ny, row / ny);
                let mut chords = [0; 2];
                within(grid, pose, cylinder, y, z).filter_map(move |x| {
                    let p = pose.to_body(&grid.centre(x, y, z));
                    // Not `hypot`: squares of voxel sizes neither underflow nor overflow.
                    let place = [p.x, (p.y * p.y + p.z * p.z).sqrt()];
                    let (material, distance) = match self.locate(place) {
                        Some(material) => (material, 0.0),
                        None if reach == 0.0 => return None,
                        None => self.find_nearest(outline, place, &mut chords),
                    };
                    let voxel = (row - first) * nx + x;
                    (distance <= reach).then(|| (voxel, f(&p, material, distance)))
                })
            })
            .collect())
    }
}

/// Returns the voxels of a row with centres that may lie in a cylinder about the axis of the body, given by its x and radius.
fn within(
    grid: &VoxelGrid,
    pose: &Pose,
    (x, radius): ([f64; 2], f64),
    iy: usize,
    iz: usize,
) -> Range<usize> {
    let nx = grid.shape()[0];
    let from = pose.to_body(&grid.centre(0, iy, iz)).coords;
    let step = pose.vector_to_body(&Vector3::x()) * grid.spacing()[0];
    let (mut low, mut high) = (0.0f64, nx as f64);
    if step.x != 0.0 {
        let ends = x.map(|x| (x - from.x) / step.x);
        low = low.max(ends[0].min(ends[1]));
        high = high.min(ends[0].max(ends[1]));
    } else if from.x < x[0] || from.x > x[1] {
        return 0..0;
    }
    let product = |u: &Vector3<f64>, v: &Vector3<f64>| u.y * v.y + u.z * v.z;
    let c = product(&from, &from) - radius * radius;
    match not_positive([product(&step, &step), product(&from, &step), c]) {
        None => 0..0,
        Some([start, end]) => indices([low.max(start), high.min(end)], nx),
    }
}
