//! Voxels of a body: centres, supersampling, coverage to a tolerance.

use std::ops::Range;

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::distance::Distance;
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
    origin: nalgebra::Point3<f64>,
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
        let answer = self.field.ask(centre.x, centre.y.hypot(centre.z), radius);
        let (inside, near) = match answer {
            Answer::Far(inside) => (Some(inside), None),
            Answer::Near(d) => ((d.value.abs() >= radius).then_some(d.value < 0.0), Some(d)),
            Answer::Between => (None, None),
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
            let d = near.unwrap_or_else(|| self.distance(&centre, counters));
            let fraction = match self.sampling {
                Sampling::Centre => f64::from(u8::from(d.value < 0.0)),
                Sampling::Supersampled(n) => self.supersample(&centre, n, counters),
                Sampling::Coverage { tolerance } => {
                    let first = self.plane(&centre, half, &d);
                    self.refine(&centre, half, first, tolerance, 0, counters)
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

    fn distance(&self, p: &nalgebra::Point3<f64>, counters: &mut VoxelCounters) -> Distance {
        counters.evaluations += 1;
        self.field.distance(p.x, p.y.hypot(p.z))
    }

    fn supersample(
        &self,
        centre: &nalgebra::Point3<f64>,
        n: usize,
        counters: &mut VoxelCounters,
    ) -> f64 {
        let h = self.grid.spacing();
        let at = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        let mut inside = 0usize;
        for k in 0..n * n * n {
            let (i, j, l) = (k % n, k / n % n, k / (n * n));
            let p = centre
                + self.steps[0] * (at(i) * h[0])
                + self.steps[1] * (at(j) * h[1])
                + self.steps[2] * (at(l) * h[2]);
            inside += usize::from(self.distance(&p, counters).value < 0.0);
        }
        inside as f64 / (n * n * n) as f64
    }

    /// Covered fraction of a box by the plane that best agrees with the surface at its centre.
    fn plane(&self, p: &nalgebra::Point3<f64>, half: [f64; 3], d: &Distance) -> f64 {
        let r = p.y.hypot(p.z);
        let [gx, gr] = d.gradient;
        let g = if r > 0.0 {
            Vector3::new(gx, gr * p.y / r, gr * p.z / r)
        } else {
            Vector3::new(gx.signum(), 0.0, 0.0)
        };
        let normal = [0, 1, 2].map(|a| g.dot(&self.steps[a]));
        fraction_below(normal, d.value, half)
    }

    /// Splits a box in eight until the fractions found before and after agree.
    fn refine(
        &self,
        p: &nalgebra::Point3<f64>,
        half: [f64; 3],
        coarse: f64,
        tolerance: f64,
        depth: usize,
        counters: &mut VoxelCounters,
    ) -> f64 {
        let quarter = half.map(|h| 0.5 * h);
        let radius = Vector3::from(quarter).norm();
        let mut parts = [0.0; 8];
        let mut cut = [None; 8];
        for k in 0..8 {
            let sign = |b: usize| if k >> b & 1 == 1 { 1.0 } else { -1.0 };
            let child = p
                + self.steps[0] * (sign(0) * quarter[0])
                + self.steps[1] * (sign(1) * quarter[1])
                + self.steps[2] * (sign(2) * quarter[2]);
            let d = self.distance(&child, counters);
            if d.value.abs() < radius {
                parts[k] = self.plane(&child, quarter, &d);
                cut[k] = Some(child);
            } else {
                parts[k] = if d.value < 0.0 { 1.0 } else { 0.0 };
            }
        }
        let fine = parts.iter().sum::<f64>() / 8.0;
        // Depth 12 is a box 4096 times smaller than a voxel: its volume is far below any tolerance.
        if (fine - coarse).abs() <= 3.0 * tolerance || depth >= 12 {
            return (fine + (fine - coarse) / 3.0).clamp(0.0, 1.0);
        }
        for k in 0..8 {
            if let Some(child) = cut[k] {
                parts[k] = self.refine(
                    &child,
                    quarter,
                    parts[k],
                    2.0 * tolerance,
                    depth + 1,
                    counters,
                );
            }
        }
        parts.iter().sum::<f64>() / 8.0
    }
}
