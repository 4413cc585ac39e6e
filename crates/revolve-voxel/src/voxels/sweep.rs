//! Intersection and union (swept volume) of a moving body on a grid.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{at_least, length, zeros};
use crate::voxels::block::{BLOCK, Placed, eighths, slabs};
use crate::voxels::field::Field;
use crate::{Mask, Meridian, Pose, RevolveError, VoxelCounters, VoxelGrid};

/// The intersection and union over several shapes of one body, by voxel centres.
///
/// ```
/// use revolve_voxel::{Meridian, Pose, Sweep, VoxelGrid};
/// let ball = |r: f64| Meridian::new(&[[-r, 0.0], [0.0, r], [r, 0.0]]); // a double cone
/// let (small, large) = ([ball(1.0)?, ball(2.0)?], [ball(1.5)?, ball(2.5)?]);
/// let grid = VoxelGrid::cube(30, 0.2)?;
/// let sweep = Sweep::of(&[&small, &large], &Pose::axis_along_z(0.0)?, &grid)?;
/// let cavity = &sweep.intersection[0]; // inside the small cavity
/// let wall = &sweep.intersection[1]; // between the large cavity and the small outside
/// assert!(cavity.count() > 0 && wall.count() > 0);
/// assert!(cavity.count() + wall.count() < sweep.union.count());
/// # Ok::<(), revolve_voxel::RevolveError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[doc(alias = "swept volume")]
pub struct Sweep {
    /// For each region, the voxels inside it in every shape (intersection). A point belongs to the first layer that contains it.
    pub intersection: Vec<Mask>,
    /// The voxels inside any shape (union, swept volume).
    pub union: Mask,
    /// Work done: single voxels, voxels filled in blocks, and surface evaluations.
    pub counters: VoxelCounters,
}

/// The state of all points of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    /// In the same region in every shape.
    Stays(usize),
    /// Inside some shapes, but in no region in all of them.
    Passes,
    /// Outside all shapes.
    Outside,
    /// Undecided, or different between points.
    Mixed,
}

impl Sweep {
    /// Computes the sets for shapes with layers, innermost first, all in one pose.
    ///
    /// A block of voxels is complete as soon as the first shapes decide it, so extreme shapes should come first. The cost is
    /// proportional to the surfaces that bound the sets, not to the number of voxels.
    ///
    /// # Errors
    /// [`RevolveError::TooFew`] without a shape or a layer, [`RevolveError::WrongLength`] for shapes with different numbers of layers;
    /// [`RevolveError::TooLarge`].
    pub fn of(shapes: &[&[Meridian]], pose: &Pose, grid: &VoxelGrid) -> Result<Self, RevolveError> {
        let n_layers = shapes.first().map_or(0, |layers| layers.len());
        at_least("layers of the first shape", n_layers, 1)?;
        for layers in shapes {
            length("layers of a shape", n_layers, layers.len())?;
        }
        let size = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let asked = Asked {
            // Only points are evaluated finally: distances beyond a cell are not needed.
            fields: (shapes.iter())
                .map(|layers| layers.iter().map(|m| Field::new(m, 0.0, size)).collect())
                .collect(),
            placed: Placed::new(pose, grid),
        };
        let [nx, ny, nz] = grid.shape();
        let mut sets = (0..=n_layers)
            .map(|_| zeros::<bool>("voxels", grid.len()))
            .collect::<Result<Vec<_>, _>>()?;
        let counters = slabs(&mut sets, grid.slice_len() * BLOCK)
            .into_par_iter()
            .enumerate()
            .map(|(index, mut sets)| {
                simd_set::unit(nz.div_ceil(BLOCK));
                let z = index * BLOCK..nz.min((index + 1) * BLOCK);
                let mut counters = VoxelCounters::default();
                for y in (0..ny).step_by(BLOCK) {
                    for x in (0..nx).step_by(BLOCK) {
                        let block = [x..nx.min(x + BLOCK), y..ny.min(y + BLOCK), z.clone()];
                        asked.block(&block, z.start, &mut sets, &mut counters);
                    }
                }
                counters
            })
            .reduce(VoxelCounters::default, |a, b| a + b);
        let mut masks = (sets.into_iter())
            .map(|set| Mask::new([nz, ny, nx], set))
            .collect::<Result<Vec<_>, _>>()?;
        let ever = masks.remove(n_layers);
        Ok(Self {
            intersection: masks,
            union: ever,
            counters,
        })
    }
}

/// The surfaces, and the voxels in their frame.
struct Asked<'a> {
    /// For each layer of each shape.
    fields: Vec<Vec<Field<'a>>>,
    placed: Placed<'a>,
}

impl Asked<'_> {
    /// Decides a block, or its eighths.
    fn block(
        &self,
        block: &[Range<usize>; 3],
        first_slice: usize,
        sets: &mut [&mut [bool]],
        counters: &mut VoxelCounters,
    ) {
        let centre = self.placed.centre(block);
        let spacing = self.placed.grid.spacing();
        let reach2: f64 = (0..3)
            .map(|a| 0.5 * (block[a].len() - 1) as f64 * spacing[a])
            .map(|half| half * half)
            .sum();
        let r = (centre.y * centre.y + centre.z * centre.z).sqrt();
        let fate = self.fate(centre.x, r, reach2.sqrt(), counters);
        let voxels = block.iter().map(Range::len).product::<usize>();
        if fate == Fate::Mixed && voxels > 1 {
            for part in eighths(block) {
                self.block(&part, first_slice, sets, counters);
            }
            return;
        }
        match voxels {
            1 => counters.cut += 1,
            _ => counters.filled += voxels as u64,
        }
        let ever = sets.len() - 1;
        match fate {
            Fate::Outside | Fate::Mixed => {}
            Fate::Passes => self.fill(block, first_slice, sets[ever]),
            Fate::Stays(region) => {
                self.fill(block, first_slice, sets[region]);
                self.fill(block, first_slice, sets[ever]);
            }
        }
    }

    fn fill(&self, [x, y, z]: &[Range<usize>; 3], first_slice: usize, set: &mut [bool]) {
        let [nx, ny, _] = self.placed.grid.shape();
        for z in z.clone() {
            for y in y.clone() {
                let row = ((z - first_slice) * ny + y) * nx;
                set[row + x.start..row + x.end].fill(true);
            }
        }
    }

    /// Returns the state of the points within `reach` of a point; decided for zero `reach`.
    fn fate(&self, x: f64, r: f64, reach: f64, counters: &mut VoxelCounters) -> Fate {
        let (mut first, mut same, mut held, mut known) = (None, true, false, true);
        for layers in &self.fields {
            let region = region(layers, x, r, reach, counters);
            match region {
                Some(region) => {
                    held |= region < layers.len();
                    same &= *first.get_or_insert(region) == region;
                }
                None => known = false,
            }
            if held && !same {
                return Fate::Passes;
            }
        }
        match first {
            Some(region) if known && held => Fate::Stays(region),
            Some(_) if known => Fate::Outside,
            _ => Fate::Mixed,
        }
    }
}

/// Returns the region of one shape that contains all points within `reach` of a point, or the number of regions if all are outside;
/// `None` if undecided.
fn region(
    layers: &[Field<'_>],
    x: f64,
    r: f64,
    reach: f64,
    counters: &mut VoxelCounters,
) -> Option<usize> {
    for (k, field) in layers.iter().enumerate() {
        counters.evaluations += 1;
        if field.inside(x, r, reach)? {
            return Some(k);
        }
    }
    Some(layers.len())
}
