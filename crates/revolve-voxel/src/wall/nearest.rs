//! The nearest material of a wall for points around it.

use std::ops::Range;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::error::finite;
use crate::voxels::coverage::check_range;
use crate::wall::cells::{Cells, Line};
use crate::wall::isoline::{less, norm};
use crate::wall::locate::within;
use crate::{Pose, RevolveError, Shell, VoxelGrid};

/// The point of the wall nearest to a given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestMaterial {
    /// Layer and s of the nearest point.
    pub material: [f64; 2],
    /// Distance from it; 0 in the wall.
    pub distance: f64,
}

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

/// Returns the point of a chord nearest to a given point: the fraction along it, and the squared distance.
fn on_chord(p: [f64; 2], ends: [[f64; 2]; 2]) -> [f64; 2] {
    let (way, to) = (less(ends[1], ends[0]), less(p, ends[0]));
    let length = way[0] * way[0] + way[1] * way[1];
    let along = match length > 0.0 {
        true => ((to[0] * way[0] + to[1] * way[1]) / length).clamp(0.0, 1.0),
        false => 0.0,
    };
    let off = [0, 1].map(|k| to[k] - along * way[k]);
    [along, off[0] * off[0] + off[1] * off[1]]
}

impl Shell {
    /// Returns the point of the wall nearest to a point (x, r): the point itself in the wall, else a point on a surface or an open end.
    ///
    /// `chords` are the first chords of either surface to be tested, and then the nearest ones: for a neighbouring point they bound the
    /// distance, so that few others are tested.
    fn find_nearest(
        &self,
        outline: &Outline,
        p: [f64; 2],
        chords: &mut [usize; 2],
    ) -> NearestMaterial {
        if let Some(material) = self.locate(p) {
            return NearestMaterial {
                material,
                distance: 0.0,
            };
        }
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
        NearestMaterial {
            material,
            distance: least.sqrt(),
        }
    }

    /// As [`Shell::map_voxels`], for all voxels with centres within `reach` (cm) of the wall. The function receives the centre in
    /// the body frame and the nearest point of the wall: the centre itself in the wall, else a point on a surface or an open end.
    ///
    /// Both curves are approximated by at least 128 chords, with an error of an eighth of the curvature times the squared chord length.
    ///
    /// # Errors
    /// [`RevolveError::BadRange`] for slices outside the grid; [`RevolveError::Negative`] or [`RevolveError::NotFinite`] for the
    /// reach.
    pub fn map_voxels_around<T: Send>(
        &self,
        pose: &Pose,
        grid: &VoxelGrid,
        slices: Range<usize>,
        reach: f64,
        f: impl Fn(&Point3<f64>, &NearestMaterial) -> T + Sync,
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
                    let place = [p.x, (p.y * p.y + p.z * p.z).sqrt()];
                    let nearest = self.find_nearest(outline, place, &mut chords);
                    let near = nearest.distance <= reach;
                    near.then(|| ((row - first) * nx + x, f(&p, &nearest)))
                })
            })
            .collect())
    }
}
