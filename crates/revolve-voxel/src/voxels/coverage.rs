//! Voxels of a body: coverage to a tolerance, for any voxel shape.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::error::{check_range as in_axis, positive, within};
use crate::voxels::block::{Block, Placed, eighths};
use crate::voxels::field::{Answer, Field};
use crate::voxels::patch::{Cuboid, Patch, Surface};
use crate::voxels::runs::Runs;
use crate::voxels::sections::Sections;
use crate::{Body, Meridian, Pose, RevolveError, Sample, VoxelCounters, VoxelGrid};

/// Largest deviation of simplified surfaces relative to the tolerance and the shortest side of a voxel. A plane face that moves by this changes the
/// covered fraction of a voxel by at most sqrt(3) times as much, 0.052 of the tolerance.
const OF_TOLERANCE: f64 = 0.03;

impl Body {
    /// Returns a layer with as many segments as the tolerance needs.
    pub(crate) fn simplified_for(
        &self,
        layer: usize,
        grid: &VoxelGrid,
        tolerance: f64,
    ) -> Cow<'_, Meridian> {
        let layer = &self.layers()[layer];
        let least = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let simplified = layer.simplified(OF_TOLERANCE * tolerance * least);
        simplified.map_or(Cow::Borrowed(layer), Cow::Owned)
    }
}

impl<'a> Field<'a> {
    /// Returns the distance field of a layer for the voxels of a grid.
    pub(crate) fn of(layer: &'a Meridian, grid: &VoxelGrid) -> Self {
        let mut piece = Vector3::from(grid.spacing());
        for (side, halvings) in piece.iter_mut().zip(halvings(layer, grid)) {
            *side *= 0.5f64.powi(halvings as i32);
        }
        Field::new(layer, 0.5 * piece.norm(), piece.min())
    }
}

/// Smallest size of parts of long voxels relative to the layer; below it cross-sections are more efficient.
const LEAST_PIECE: f64 = 1.0 / 128.0;

/// Most bisections of a voxel edge: a layer that is smaller than the part covers less than 1e-12 of the voxel.
const MOST_HALVINGS: u32 = 40;

/// Returns the number of bisections of each voxel edge, so that parts are nearly cubic.
fn halvings(layer: &Meridian, grid: &VoxelGrid) -> [u32; 3] {
    let spacing = grid.spacing();
    let least = spacing.into_iter().fold(f64::INFINITY, f64::min);
    let longest = (2.0 * least).max(2.0 * LEAST_PIECE * layer.size());
    spacing.map(|mut side| {
        let mut halvings = 0;
        while side > longest && halvings < MOST_HALVINGS {
            side *= 0.5;
            halvings += 1;
        }
        halvings
    })
}

/// Checks that the slices are in the grid and in order.
pub(crate) fn check_range(grid: &VoxelGrid, slices: &Range<usize>) -> Result<(), RevolveError> {
    in_axis("slices", slices, grid.shape()[2])
}

/// Checks that the slices are in the grid and the tolerance is above 0 and at most 1.
pub(crate) fn check(
    grid: &VoxelGrid,
    slices: &Range<usize>,
    tolerance: f64,
) -> Result<(), RevolveError> {
    check_range(grid, slices)?;
    within("tolerance", positive("tolerance", tolerance)?, [0.0, 1.0]).map(drop)
}

/// Adds one layer to blocks of voxels.
pub(crate) struct Painter<'a> {
    field: &'a Field<'a>,
    placed: Placed<'a>,
    tolerance: f64,
    halvings: [u32; 3],
    /// Data of cross-sections.
    runs: Runs,
    set: simd_set::Set,
}

impl<'a> Painter<'a> {
    pub(crate) fn new(
        pose: &Pose,
        field: &'a Field<'a>,
        grid: &'a VoxelGrid,
        tolerance: f64,
    ) -> Self {
        let halvings = halvings(field.meridian(), grid);
        let sides = grid.spacing().into_iter().zip(halvings);
        let least = sides.map(|(side, n)| side * 0.5f64.powi(n as i32));
        let least = least.fold(f64::INFINITY, f64::min);
        Self {
            field,
            placed: Placed::new(pose, grid),
            tolerance,
            halvings,
            runs: Runs::new(field.meridian(), least, tolerance),
            set: simd_set::Set::detect(),
        }
    }

    /// Adds `weight` times the covered fraction to some voxels of a block.
    pub(crate) fn paint<T: Sample>(
        &self,
        block: &[Range<usize>; 3],
        weight: f64,
        target: &mut Block<T>,
    ) {
        let centre = self.placed.centre(block);
        let spacing = self.placed.grid.spacing();
        let half = [0, 1, 2].map(|a| 0.5 * block[a].len() as f64 * spacing[a]);
        let radius = Vector3::from(half).norm();
        let voxels = block.iter().map(Range::len).product::<usize>();
        target.counters.evaluations += 1;
        let answer = self.field.ask(centre.x, radius_of(&centre), radius);
        if let Answer::Far(inside) = answer {
            if inside {
                target.counters.filled += voxels as u64;
                target.fill(block, T::from_f64(weight));
            }
            return;
        }
        if voxels == 1 {
            let cuboid = Cuboid {
                centre: &centre,
                axes: &self.placed.steps,
                half,
                radius,
            };
            let counters = &mut target.counters;
            let before = counters.cut;
            let fraction = self.divided(&cuboid, self.halvings, answer, counters);
            counters.cut = counters.cut.min(before + 1);
            if fraction > 0.0 {
                target.fill(block, T::from_f64(weight * fraction));
            }
            return;
        }
        for part in eighths(block) {
            self.paint(&part, weight, target);
        }
    }

    /// Returns the covered fraction of a voxel, or of a part of it with remaining bisections.
    fn divided(
        &self,
        cuboid: &Cuboid<'_>,
        halvings: [u32; 3],
        answer: Answer<'_>,
        counters: &mut VoxelCounters,
    ) -> f64 {
        let Cuboid { axes, half, .. } = *cuboid;
        let longest = (0..3)
            .filter(|&a| halvings[a] > 0)
            .max_by(|&a, &b| half[a].total_cmp(&half[b]));
        let Some(a) = longest else {
            return self.covered(cuboid, answer, counters);
        };
        let (mut half, mut halvings) = (half, halvings);
        half[a] *= 0.5;
        halvings[a] -= 1;
        let radius = Vector3::from(half).norm();
        let mut part = |side: f64| {
            let centre = cuboid.centre + axes[a] * (side * half[a]);
            counters.evaluations += 1;
            match self.field.ask(centre.x, radius_of(&centre), radius) {
                Answer::Far(inside) => f64::from(u8::from(inside)),
                answer => {
                    let centre = &centre;
                    let part = Cuboid {
                        centre,
                        axes,
                        half,
                        radius,
                    };
                    self.divided(&part, halvings, answer, counters)
                }
            }
        };
        0.5 * (part(-1.0) + part(1.0))
    }

    /// Returns the covered fraction of a part: by a local approximation of the surface if accurate enough, else by cross-sections.
    fn covered(
        &self,
        cuboid: &Cuboid<'_>,
        answer: Answer<'_>,
        counters: &mut VoxelCounters,
    ) -> f64 {
        if let Answer::Run { lines, reflex } = answer {
            counters.evaluations += 1;
            let surface = Surface {
                lines,
                reflex,
                cuboid,
            };
            match self.set.run(surface) {
                Patch::Clear(inside) => return f64::from(u8::from(inside)),
                Patch::Covered { fraction, error } if error <= self.tolerance => {
                    counters.cut += 1;
                    return fraction;
                }
                Patch::Covered { .. } | Patch::Unknown => {}
            }
        }
        counters.cut += 1;
        simd_set::checkpoint();
        let mut sections = Sections::new(self.field.meridian(), &self.runs, cuboid, self.tolerance);
        let fraction = sections.fraction();
        counters.evaluations += sections.evaluations;
        fraction
    }
}

/// Returns the distance from the axis. Not `hypot`: squares of voxel sizes neither underflow nor overflow, and this is the
/// innermost loop.
#[inline(always)]
fn radius_of(p: &Point3<f64>) -> f64 {
    (p.y * p.y + p.z * p.z).sqrt()
}
