//! Voxels of a body: centres, supersampling, coverage to a tolerance.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::error::{finite, length, positive};
use crate::field::{Answer, Field};
use crate::plane_clip::fraction_below;
use crate::{Body, Error, Sample, VoxelCounters, VoxelGrid};

/// How a voxel's value is found.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Sampling {
    /// The value at the voxel's centre.
    Centre,
    /// The mean over n x n x n points.
    Supersampled(usize),
    /// The mean over the voxel, each layer's covered fraction to within `tolerance`.
    Coverage {
        /// Largest error of a covered fraction.
        tolerance: f64,
    },
}

/// Slices to a block: blocks of 8 x 8 x 8 voxels are filled whole where no surface comes near.
const BLOCK: usize = 8;

impl Body {
    /// Activity of every voxel, `[z][y][x]`, x fastest.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`] for the activities, [`Error::NotPositive`] for the sampling.
    pub fn voxelize<T: Sample>(
        &self,
        grid: &VoxelGrid,
        sampling: Sampling,
        activity: &[f64],
    ) -> Result<(Vec<T>, VoxelCounters), Error> {
        let mut out = vec![T::default(); grid.len()];
        let counters =
            self.voxelize_add(grid, 0..grid.shape()[2], sampling, activity, 1.0, &mut out)?;
        Ok((out, counters))
    }

    /// Adds `weight` times the activity of the voxels of some slices to `out` (`[z][y][x]`, those slices only).
    ///
    /// A volume need never be whole in memory: slab by slab gives the same bits.
    ///
    /// # Errors
    /// [`Error::Length`] for a wrong buffer, slices or number of activities; [`Error::NotFinite`], [`Error::NotPositive`].
    pub fn voxelize_add<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        sampling: Sampling,
        activity: &[f64],
        weight: f64,
        out: &mut [T],
    ) -> Result<VoxelCounters, Error> {
        let weights = self.weights(activity)?;
        finite("weight", weight)?;
        if slices.end > grid.shape()[2] {
            return Err(Error::Length {
                what: "slices (at most)",
                expected: grid.shape()[2],
                given: slices.end,
            });
        }
        length("volume", grid.slice_len() * slices.len(), out.len())?;
        match sampling {
            Sampling::Centre => {}
            Sampling::Supersampled(n) => {
                positive("samples per axis", n as f64)?;
            }
            Sampling::Coverage { tolerance } => {
                positive("tolerance", tolerance)?;
            }
        }
        let spacing = Vector3::from(grid.spacing());
        let fields: Vec<Option<Field>> = (0..self.layers().len())
            .map(|k| {
                (weights[k] != 0.0)
                    .then(|| Field::new(&self.layers()[k], 0.5 * spacing.norm(), spacing.min()))
            })
            .collect();
        let counters = out
            .par_chunks_mut(grid.slice_len() * BLOCK)
            .enumerate()
            .map(|(slab, chunk)| {
                let start = slices.start + slab * BLOCK;
                let end = (start + BLOCK).min(slices.end);
                let mut counters = VoxelCounters::default();
                for (k, field) in fields.iter().enumerate() {
                    if let Some(field) = field {
                        let painter = Painter {
                            field,
                            origin: self.pose().to_body(&grid.centre(0, 0, 0)),
                            steps: [Vector3::x(), Vector3::y(), Vector3::z()]
                                .map(|e| self.pose().vector_to_body(&e)),
                            grid,
                            sampling,
                            weight: weight * weights[k],
                            first_slice: start,
                        };
                        painter.paint(start..end, chunk, &mut counters);
                    }
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b);
        Ok(counters)
    }
}

struct Painter<'a> {
    field: &'a Field<'a>,
    /// First voxel's centre in the body frame.
    origin: Point3<f64>,
    /// The lab's axes in the body frame.
    steps: [Vector3<f64>; 3],
    grid: &'a VoxelGrid,
    sampling: Sampling,
    weight: f64,
    first_slice: usize,
}

impl Painter<'_> {
    fn paint<T: Sample>(&self, z: Range<usize>, out: &mut [T], counters: &mut VoxelCounters) {
        let [nx, ny, _] = self.grid.shape();
        for y in (0..ny).step_by(BLOCK) {
            for x in (0..nx).step_by(BLOCK) {
                let block = [x..(x + BLOCK).min(nx), y..(y + BLOCK).min(ny), z.clone()];
                self.block(block, out, counters);
            }
        }
    }

    fn block<T: Sample>(
        &self,
        block: [Range<usize>; 3],
        out: &mut [T],
        counters: &mut VoxelCounters,
    ) {
        let spacing = self.grid.spacing();
        let mut centre = self.origin;
        let mut half = [0.0; 3];
        for a in 0..3 {
            half[a] = 0.5 * block[a].len() as f64 * spacing[a];
            centre +=
                self.steps[a] * (0.5 * (block[a].start + block[a].end - 1) as f64 * spacing[a]);
        }
        let radius = Vector3::from(half).norm();
        counters.evaluations += 1;
        let inside = match self.field.ask(centre.x, radius_of(&centre), radius) {
            Answer::Far(inside) => Some(inside),
            Answer::Near(d, _) if d.value.abs() >= radius => Some(d.value < 0.0),
            _ => None,
        };
        if inside == Some(false) {
            return;
        }
        let [x, y, z] = block;
        let voxels = x.len() * y.len() * z.len();
        if inside == Some(true) {
            let value = T::from_f64(self.weight);
            for iz in z {
                for iy in y.clone() {
                    let row = ((iz - self.first_slice) * self.grid.shape()[1] + iy)
                        * self.grid.shape()[0];
                    for v in &mut out[row + x.start..row + x.end] {
                        *v += value;
                    }
                }
            }
            counters.filled += voxels as u64;
            return;
        }
        if voxels == 1 {
            counters.cut += 1;
            let fraction = match self.sampling {
                Sampling::Centre => f64::from(u8::from(self.inside(&centre, counters))),
                Sampling::Supersampled(n) => self.supersample(&centre, n, counters),
                Sampling::Coverage { tolerance } => {
                    let fraction = self.look(&centre, half, radius, counters);
                    let goal = Goal {
                        smooth: tolerance,
                        crease: tolerance,
                        depth: DEEPEST,
                    };
                    self.refine(&centre, half, &fraction, goal, counters)
                }
            };
            let at = ((z.start - self.first_slice) * self.grid.shape()[1] + y.start)
                * self.grid.shape()[0]
                + x.start;
            out[at] += T::from_f64(self.weight * fraction);
            return;
        }
        let halves = |r: &Range<usize>| {
            let mid = r.start + r.len().div_ceil(2);
            [r.start..mid, mid..r.end]
        };
        for z in halves(&z) {
            for y in halves(&y) {
                for x in halves(&x) {
                    if !(x.is_empty() || y.is_empty() || z.is_empty()) {
                        self.block([x, y.clone(), z.clone()], out, counters);
                    }
                }
            }
        }
    }

    fn inside(&self, p: &Point3<f64>, counters: &mut VoxelCounters) -> bool {
        counters.evaluations += 1;
        let r = radius_of(p);
        match self.field.ask(p.x, r, 0.0) {
            Answer::Far(inside) => inside,
            Answer::Near(d, _) => d.value < 0.0,
            Answer::Between => self.field.profile().distance_at(p.x, r).value < 0.0,
        }
    }

    /// The surface as seen from the centre of a box of those half-widths, `radius` half its diagonal.
    fn look(
        &self,
        p: &Point3<f64>,
        half: [f64; 3],
        radius: f64,
        counters: &mut VoxelCounters,
    ) -> Sight {
        counters.evaluations += 1;
        let r = radius_of(p);
        let (d, tangents) = match self.field.ask(p.x, r, radius) {
            Answer::Far(inside) => return Sight::Clear(inside),
            Answer::Near(d, tangents) => (d, tangents),
            Answer::Between => {
                let profile = self.field.profile();
                (
                    profile.distance_at(p.x, r),
                    profile.tangents_within(p.x, r, radius),
                )
            }
        };
        if d.value.abs() >= radius {
            return Sight::Clear(d.value < 0.0);
        }
        let [gx, gr] = d.gradient;
        let normal = if r > 0.0 {
            Vector3::new(gx, gr * p.y / r, gr * p.z / r)
        } else {
            Vector3::new(gx.signum(), 0.0, 0.0)
        };
        // Along the profile, and round the axis: the parallel turns by the box's diameter over its radius.
        let round = (2.0 * radius / r).min(2.0) * gr.abs();
        let bend = tangents.spread() + round;
        let normal = [0, 1, 2].map(|a| normal.dot(&self.steps[a]));
        // Normals that differ by no more than the bend keep the surface this near its tangent plane: past the box's corner.
        let corner = (0..3).map(|a| half[a] * normal[a].abs()).sum::<f64>();
        if d.value.abs() >= corner + bend * radius {
            return Sight::Clear(d.value < 0.0);
        }
        Sight::Surface {
            distance: d.value,
            gradient: d.gradient,
            normal,
            bend,
        }
    }

    fn supersample(&self, centre: &Point3<f64>, n: usize, counters: &mut VoxelCounters) -> f64 {
        let h = self.grid.spacing();
        let at = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        let mut inside = 0usize;
        for k in 0..n * n * n {
            let (i, j, l) = (k % n, k / n % n, k / (n * n));
            let p = centre
                + self.steps[0] * (at(i) * h[0])
                + self.steps[1] * (at(j) * h[1])
                + self.steps[2] * (at(l) * h[2]);
            inside += usize::from(self.inside(&p, counters));
        }
        inside as f64 / (n * n * n) as f64
    }

    /// Covered fraction of a box: split in eight until one plane in each part is good enough.
    ///
    /// Where the surface is smooth, each plane is moved by the surface's mean height over it.
    fn refine(
        &self,
        p: &Point3<f64>,
        half: [f64; 3],
        whole: &Sight,
        goal: Goal,
        counters: &mut VoxelCounters,
    ) -> f64 {
        let &Sight::Surface {
            distance,
            gradient,
            bend,
            ..
        } = whole
        else {
            return whole.fraction([1.0; 3], 0.0);
        };
        let quarter = half.map(|h| 0.5 * h);
        let radius = Vector3::from(quarter).norm();
        let centres: [Point3<f64>; 8] = std::array::from_fn(|k| {
            let by = |a: usize| {
                if k >> a & 1 == 1 {
                    quarter[a]
                } else {
                    -quarter[a]
                }
            };
            p + self.steps[0] * by(0) + self.steps[1] * by(1) + self.steps[2] * by(2)
        });
        let parts = centres.map(|c| self.look(&c, quarter, radius, counters));
        let n_cut = parts.iter().filter(|s| s.bend().is_some()).count();
        let n_bent = parts
            .iter()
            .filter(|s| s.bend().is_some_and(|b| b > CREASE))
            .count();
        let smooth = bend <= CREASE;
        let lift = if smooth {
            self.lift(p, half, distance, gradient, counters)
        } else {
            0.0
        };
        let fine = parts
            .iter()
            .map(|s| s.fraction(quarter, 0.25 * lift))
            .sum::<f64>()
            / 8.0;
        let done = if smooth {
            let coarse = whole.fraction(half, lift);
            // The two can agree by chance: what the lifts correct in the parts must be small too.
            let thin = half.iter().fold(f64::INFINITY, |m, h| h.min(m));
            (fine - coarse).abs() <= goal.smooth && LIFT_ERROR * lift.abs() <= thin * goal.smooth
        } else {
            bend * CREASE_ERROR <= goal.crease
        };
        if done || goal.depth == 0 {
            return fine;
        }
        // A part's error counts an eighth: the goals grow as the parts that can have one become fewer.
        let goal = Goal {
            smooth: goal.smooth * 8.0 / n_cut.max(1) as f64,
            crease: goal.crease * 8.0 / n_bent.max(1) as f64,
            depth: goal.depth - 1,
        };
        (0..8)
            .map(|k| self.refine(&centres[k], quarter, &parts[k], goal, counters))
            .sum::<f64>()
            / 8.0
    }

    /// Mean height of a smooth surface over its tangent plane within a box: half the curvature times the mean square
    /// distance from the centre, h^2 / 3, along the profile and round the axis.
    fn lift(
        &self,
        p: &Point3<f64>,
        half: [f64; 3],
        distance: f64,
        [gx, gr]: [f64; 2],
        counters: &mut VoxelCounters,
    ) -> f64 {
        let r = radius_of(p);
        let h2 = half.iter().map(|h| h * h).sum::<f64>() / 3.0;
        let h = h2.sqrt();
        // Along the profile, by the second difference of the distance.
        let beside = |step: f64| match self.field.ask(p.x + step * gr, (r - step * gx).abs(), h) {
            Answer::Near(d, _) => Some(d.value),
            _ => None,
        };
        counters.evaluations += 2;
        let along = match (beside(h), beside(-h)) {
            (Some(a), Some(b)) => a + b - 2.0 * distance,
            _ => 0.0,
        };
        // Round the axis, the curvature at the surface is that of a parallel, tilted.
        let round = gr * h2 / (r - distance * gr).max(h);
        (along + round) / 6.0
    }
}

/// Distance from the axis. Not `hypot`: no voxel is so small or large that its square would under- or overflow, and this is
/// the innermost loop.
#[inline(always)]
fn radius_of(p: &Point3<f64>) -> f64 {
    (p.y * p.y + p.z * p.z).sqrt()
}

/// What is seen of the surface from a box's centre.
#[derive(Debug, Clone, Copy)]
enum Sight {
    /// None of it in the box: all inside, or all outside.
    Clear(bool),
    /// The nearest point's distance and normal (along the lab's axes), and a bound of the angle between normals in the box.
    Surface {
        distance: f64,
        gradient: [f64; 2],
        normal: [f64; 3],
        bend: f64,
    },
}

impl Sight {
    fn bend(&self) -> Option<f64> {
        match self {
            Sight::Clear(_) => None,
            Sight::Surface { bend, .. } => Some(*bend),
        }
    }

    /// Covered fraction of the box by one plane, lifted inward by the surface's mean height over it.
    fn fraction(&self, half: [f64; 3], lift: f64) -> f64 {
        match *self {
            Sight::Clear(inside) => f64::from(u8::from(inside)),
            Sight::Surface {
                distance, normal, ..
            } => fraction_below(normal, distance + lift, half),
        }
    }
}

/// Normals within a box that differ by more than this (radians) are those of a crease, of two faces of a thin wall, or of a
/// radius of curvature no larger than a few boxes: the change between two estimates then says little.
const CREASE: f64 = 0.2;

/// Error of planes in place of a crease, per radian: eight planes are off by an eighth of a part's side on average, in a
/// quarter to a half of the parts.
const CREASE_ERROR: f64 = 0.05;

/// Error of the parts' planes, as a share of the box's lift over its half-width: a quarter of the lift remains in a part
/// (an eighth over the part's width), and its mean over the box is right to some 15 % where the plane cuts a corner.
const LIFT_ERROR: f64 = 0.02;

/// A box 2^12 times smaller than a voxel is below any tolerance.
const DEEPEST: u32 = 12;

/// What the error of a box may be.
#[derive(Clone, Copy)]
struct Goal {
    smooth: f64,
    crease: f64,
    depth: u32,
}
