//! Coverage of voxels by sectors.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, length, zeros};
use crate::rays::single::Search;
use crate::solid::wedge::{Place, Wedge};
use crate::voxels::coverage::check;
use crate::voxels::patch::Cuboid;
use crate::voxels::runs::Runs;
use crate::voxels::sections::Sections;
use crate::voxels::square;
use crate::wall::body_line::BodyLine;
use crate::wall::sector::{Sector, Twisted};
use crate::{Body, Ray, RevolveError, Sample, VoxelCounters, VoxelGrid};

impl Sector {
    /// Adds `activity` times the covered fraction, to within `tolerance`, of every voxel in some slices to `out` (`[z][y][x]`, those slices
    /// only).
    ///
    /// Voxels that no side of the wedge cuts have the value of the ring. Voxels that a twisted side may cut are computed from the lengths of lines.
    ///
    /// # Errors
    /// As [`Body::voxelize_add`].
    pub fn voxelize_add<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        tolerance: f64,
        activity: f64,
        out: &mut [T],
    ) -> Result<VoxelCounters, RevolveError> {
        finite("activity", activity)?;
        check(grid, &slices, tolerance)?;
        length("volume", grid.slice_len() * slices.len(), out.len())?;
        // The ring alone, on the part of the grid that contains it, independent of the requested slices.
        let [low, high] = self.ring.bounding_box(0)?;
        let (origin, h) = (grid.origin(), grid.spacing());
        let part: [Range<usize>; 3] = [0, 1, 2].map(|a| {
            let n = grid.shape()[a] as f64;
            let index = |x: f64| ((x - origin[a]) / h[a]).clamp(-1.0, n);
            let first = (index(low[a]) - 1.0).max(0.0) as usize;
            first..((index(high[a]) + 2.0).min(n) as usize).max(first)
        });
        let z = part[2].start.max(slices.start)..part[2].end.min(slices.end);
        let [nx, ny] = [part[0].len(), part[1].len()];
        if nx * ny == 0 || z.is_empty() {
            return Ok(VoxelCounters::default());
        }
        let corner = grid.centre(part[0].start, part[1].start, part[2].start);
        let small = VoxelGrid::new(part.clone().map(|p| p.len()), h, corner.coords.into())?;
        let own = z.start - part[2].start..z.end - part[2].start;
        let mut ring = zeros("voxels", nx * ny * z.len())?;
        let (whole, first) = ((&self.ring, &[1.0][..]), own.start);
        let mut counters = Body::voxelize_add(&[whole], &small, own, tolerance, &mut ring)?;
        counters = counters + self.cut(&small, first, tolerance, &mut ring);
        for (slice, own) in z.zip(ring.chunks(nx * ny)) {
            for (y, row) in own.chunks(nx).enumerate() {
                let start = (slice - slices.start) * grid.slice_len()
                    + (part[1].start + y) * grid.shape()[0]
                    + part[0].start;
                for (v, share) in out[start..start + nx].iter_mut().zip(row) {
                    if *share != 0.0 {
                        *v += T::from_f64(activity * share);
                    }
                }
            }
        }
        Ok(counters)
    }

    /// Converts the coverage of the ring, from `first_slice`, to that of the sector.
    fn cut(
        &self,
        grid: &VoxelGrid,
        first_slice: usize,
        tolerance: f64,
        ring: &mut [f64],
    ) -> VoxelCounters {
        if self.wedge == Wedge::Whole {
            return VoxelCounters::default();
        }
        let pose = self.ring.pose();
        let steps = [Vector3::x(), Vector3::y(), Vector3::z()].map(|e| pose.vector_to_body(&e));
        let half = grid.spacing().map(|h| 0.5 * h);
        let radius = Vector3::from(half).norm();
        let meridian = &self.ring.layers()[0];
        let runs = Runs::each(meridian);
        let [nx, ny, _] = grid.shape();
        ring.par_iter_mut()
            .enumerate()
            .map(|(k, share)| {
                let mut counters = VoxelCounters::default();
                if *share == 0.0 {
                    return counters;
                }
                simd_set::checkpoint();
                let (x, y, z) = (k % nx, k / nx % ny, first_slice + k / (nx * ny));
                let at = grid.centre(x, y, z);
                let centre = pose.to_body(&at);
                let cuboid = Cuboid {
                    centre: &centre,
                    axes: &steps,
                    half,
                    radius,
                };
                match self.place(&cuboid) {
                    Place::Inside => {}
                    Place::Outside => *share = 0.0,
                    Place::Cut if self.twisted.is_some() => {
                        (*share, counters.evaluations) = self.share(&at, &cuboid, tolerance);
                        counters.cut = 1;
                    }
                    Place::Cut => {
                        let mut sections =
                            Sections::new(meridian, &runs, &cuboid, tolerance).within(&self.wedge);
                        *share = sections.fraction();
                        counters.cut = 1;
                        counters.evaluations = sections.evaluations;
                    }
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b)
    }

    /// Returns the position of a box relative to the sides; `Cut` also if a twisted side may cut it.
    fn place(&self, cuboid: &Cuboid<'_>) -> Place {
        let Some(Twisted { reach, core, .. }) = &self.twisted else {
            return self.wedge.place(cuboid);
        };
        let in_core = |core: &Wedge| core.place(cuboid) == Place::Inside;
        if reach.place(cuboid) == Place::Outside {
            Place::Outside
        } else if core.as_ref().is_some_and(in_core) {
            Place::Inside
        } else {
            Place::Cut
        }
    }

    /// Returns the fraction of a voxel, with its centre in the lab, inside a twisted sector, and the number of lines: the length of lines inside the
    /// sector is integrated over the cross-section of the voxel.
    fn share(&self, centre: &Point3<f64>, cuboid: &Cuboid<'_>, tolerance: f64) -> (f64, u64) {
        // Along the edge most oblique to sides and surfaces, so that the length changes continuously across both.
        let (pose, body, half) = (self.ring.pose(), cuboid.centre, cuboid.half);
        let oblique = |k: usize| {
            let e = cuboid.axes[k];
            ((e.y * body.y + e.z * body.z) * (e.z * body.y - e.y * body.z)).abs()
        };
        let axis = (1..3).fold(
            0,
            |best, k| if oblique(k) > oblique(best) { k } else { best },
        );
        let others = [(axis + 1) % 3, (axis + 2) % 3];
        let mut along = Vector3::zeros();
        along[axis] = 1.0;
        let mut search = Search::default();
        let length = |at: [f64; 2]| {
            let mut start = *centre;
            for (axis, at) in others.into_iter().zip(at) {
                start[axis] += at * half[axis];
            }
            let Ok(ray) = Ray::new(start, along) else {
                return 0.0;
            };
            let mut sum = 0.0;
            let line = BodyLine::new(pose, &ray);
            let reach = half[axis];
            self.for_spans(&ray, &line, &mut search, |span| {
                sum += (span.exit.min(reach) - span.enter.max(-reach)).max(0.0);
            });
            0.5 * sum / reach
        };
        let (share, evaluations) = square::mean(tolerance, length);
        (share.clamp(0.0, 1.0), evaluations)
    }
}
