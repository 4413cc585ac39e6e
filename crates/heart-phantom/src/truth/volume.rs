//! Voxelised ground truth.

use crate::HeartShape;
use crate::error::{PhantomError, zeros};
use crate::scan::{Lasting, OF_TIME, Scan, SharedShapes, add_to_gates};
use revolve_voxel::{Body, Organs, Sampling, VoxelCounters, VoxelGrid, WeightedBody};
use std::ops::Range;
use std::sync::Arc;

/// Largest number of shapes that are added in one pass over the volume, and their memory limit in bytes.
pub(crate) const MOST_IN_PASS: usize = 256;
const BYTES_OF_PASS: usize = 256 << 20;
/// Largest number of shapes in a time average: that of the finest whole cycle of a scene.
const MOST_SHAPES: usize = 2049;
/// Smallest tolerance for which states are merged.
const MERGED: f64 = 1e-3;
/// Groups of merged states along each axis, respiratory position and gain: together at most [`MOST_SHAPES`].
const SIDE: usize = 45;

/// Computes the activity of some slices, averaged over the voxel and over states of the heart; index order `[z][y][x]`. Bitwise equal to
/// the slices of the whole volume.
///
/// Volume fractions are accurate to `tolerance`, three quarters of it for the average over time if there is one ([`Scan::states`]). `around`
/// contains the activity of the organs in these slices. For tolerances of at least 1e-3, more than 2049 states are merged into groups of neighbouring
/// respiratory position and volume. Without respiration this changes the coverage by a surface that crosses a voxel once in each direction by at
/// most 1/1000; with it, 4e-4 was measured on voxels of 6.4 mm.
pub(crate) fn truth_of_slices(
    scan: &Scan<'_>,
    tolerance: f64,
    slices: Range<usize>,
    around: Option<&[f32]>,
) -> Result<(Vec<f32>, VoxelCounters), PhantomError> {
    let times = thinned(scan.states(tolerance)?, tolerance);
    let tolerance = of_voxels(scan, tolerance);
    let grid = scan.camera.grid();
    let mut volume = background(scan, slices.clone())?;
    let mut counters = VoxelCounters::default();
    let passes = times.chunks(in_pass(scan));
    let part = simd_set::part(0..1, 1 + usize::from(around.is_some()));
    for (_part, pass) in simd_set::parts(passes.clone()) {
        counters = counters + add_shapes(scan, pass, tolerance, slices.clone(), &mut volume)?;
    }
    drop(part);
    if let Some(around) = around {
        let mut heart: Vec<f32> = zeros("voxels of the ground truth", volume.len())?;
        let _part = simd_set::part(1..2, 2);
        for (_part, pass) in simd_set::parts(passes) {
            let (bodies, weights) = (bodies(scan, pass, &shapes_of(scan, pass)?)?, shares(pass));
            let all = vec![[1.0; 2]; bodies.len()];
            let of = (&bodies[..], &all[..], &weights[..]);
            counters = counters + add_bodies(of, grid, tolerance, slices.clone(), &mut heart)?;
        }
        for ((voxel, share), held) in volume.iter_mut().zip(&heart).zip(around) {
            *voxel += (1.0 - share) * held;
        }
    }
    clamp(&mut volume);
    Ok((volume, counters))
}

/// Computes the volumes of all gates, `[gate][z][y][x]`, from shapes that the gates share, without organs.
pub(crate) fn truth_of_gates_into(
    scan: &Scan<'_>,
    shared: &SharedShapes,
    tolerance: f64,
    volumes: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    let tolerance = of_voxels(scan, tolerance);
    let (grid, slices) = (scan.camera.grid(), 0..scan.camera.n_rows());
    let mut one = background(scan, slices.clone())?;
    let mut gates: Vec<&mut [f32]> = volumes.chunks_mut(grid.len()).collect();
    for volume in &mut gates {
        volume.copy_from_slice(&one);
    }
    let mut counters = VoxelCounters::default();
    for (_part, (&gain, uses)) in simd_set::parts(shared.gains.iter().zip(&shared.uses)) {
        one.fill(0.0);
        let whole = [Lasting {
            gain,
            breath: 0.0,
            share: 1.0,
        }];
        counters = counters + add_shapes(scan, &whole, tolerance, slices.clone(), &mut one)?;
        add_to_gates(&one, uses, &mut gates);
    }
    clamp(volumes);
    Ok(counters)
}

/// Returns the part of the tolerance of a voxel that is for its average over the voxel; all of it without an average over time.
fn of_voxels(scan: &Scan<'_>, tolerance: f64) -> f64 {
    match scan.has_duration() {
        true => (1.0 - OF_TIME) * tolerance,
        false => tolerance,
    }
}

/// Returns the activity of the background in every voxel of some slices; 0 without a background.
fn background(scan: &Scan<'_>, slices: Range<usize>) -> Result<Vec<f32>, PhantomError> {
    let organ = scan.background.map(|own| own.organ()).transpose()?;
    let organs = Organs::new(organ.into_iter().collect())?;
    Ok(organs.voxelize(scan.camera.grid(), slices, |organ| organ.activity)?)
}

/// Clamps the negative rounding residue of the wall (the difference of two bodies) to zero.
fn clamp(volume: &mut [f32]) {
    (volume.iter_mut()).for_each(|voxel| *voxel = voxel.max(0.0));
}

/// Returns the number of shapes of a pass. It does not depend on the memory of the heart, so that sums are bitwise reproducible.
pub(crate) fn in_pass(scan: &Scan<'_>) -> usize {
    let bytes = scan.heart.shape_bytes() + finder_bytes(scan);
    (BYTES_OF_PASS / bytes).clamp(1, MOST_IN_PASS)
}

/// Estimates the memory of the surface search of a shape in bytes: for each layer cells of 24 bytes, as large as the least side of a
/// voxel, at most 250 000.
pub(crate) fn finder_bytes(scan: &Scan<'_>) -> usize {
    let spacing = scan.camera.grid().spacing();
    let size = spacing.into_iter().fold(f64::INFINITY, f64::min);
    // Twice the reference volume, with a margin.
    let cells: f64 = (scan.heart.reference_extent().into_iter())
        .map(|side| 2f64.sqrt() * side / size + 8.0)
        .product();
    2 * 24 * cells.min(250_000.0) as usize
}

/// Adds the shapes of some gains, each weighted by its fraction of the time.
fn add_shapes(
    scan: &Scan<'_>,
    times: &[Lasting],
    tolerance: f64,
    slices: Range<usize>,
    volume: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    let (shapes, weights) = (shapes_of(scan, times)?, shares(times));
    let bodies = bodies(scan, times, &shapes)?;
    let placed = scan.placed(&shapes)?;
    let grid = scan.camera.grid();
    let around = (scan.background).map_or(0.0, |background| background.concentration);
    let sampling = Sampling::Coverage { tolerance };
    let held: Vec<[f64; 2]> = (shapes.iter())
        .map(|shape| scan.activity.of(shape).map(|held| held - around))
        .collect();
    let of = (&bodies[..], &held[..], &weights[..]);
    let n_sectors: usize = shapes.iter().map(|shape| placed.of(shape).len()).sum();
    let part = simd_set::part(0..1, 1 + n_sectors);
    let mut counters = add_bodies(of, grid, tolerance, slices.clone(), volume)?;
    drop(part);
    let mut sectors = 1..1 + n_sectors;
    for ((shape, body), weight) in shapes.iter().zip(&bodies).zip(&weights) {
        let [_, wall] = scan.activity.of(shape);
        for (_, sector, factor) in placed.of(shape) {
            let k = sectors.next().unwrap_or(n_sectors);
            let _part = simd_set::part(k..k + 1, 1 + n_sectors);
            let sector = sector.with_pose(*body.pose());
            let difference = weight * factor * wall;
            let done = sector.voxelize_add(grid, slices.clone(), sampling, difference, volume)?;
            counters = counters + done;
        }
    }
    Ok(counters)
}

/// Returns the shapes of some gains.
fn shapes_of(scan: &Scan<'_>, times: &[Lasting]) -> Result<Vec<Arc<HeartShape>>, PhantomError> {
    let gains: Vec<f64> = times.iter().map(|lasting| lasting.gain).collect();
    scan.heart.shapes(&gains)
}

/// Returns the bodies of these shapes in their poses.
fn bodies(
    scan: &Scan<'_>,
    times: &[Lasting],
    shapes: &[Arc<HeartShape>],
) -> Result<Vec<Body>, PhantomError> {
    let placed = |(lasting, shape): (&Lasting, &Arc<HeartShape>)| {
        Ok(shape.body().with_pose(scan.pose(lasting.breath)?))
    };
    times.iter().zip(shapes).map(placed).collect()
}

fn shares(times: &[Lasting]) -> Vec<f64> {
    times.iter().map(|lasting| lasting.share).collect()
}

/// Adds bodies with their activities of cavity and wall and their weights.
fn add_bodies(
    (bodies, held, weights): (&[Body], &[[f64; 2]], &[f64]),
    grid: &VoxelGrid,
    tolerance: f64,
    slices: Range<usize>,
    volume: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    let weighted: Vec<WeightedBody> = (bodies.iter().zip(held).zip(weights))
        .map(|((body, activity), &weight)| WeightedBody {
            body,
            activity,
            weight,
        })
        .collect();
    let sampling = Sampling::Coverage { tolerance };
    Ok(WeightedBody::voxelize_add(
        &weighted, grid, slices, sampling, volume,
    )?)
}

/// Merges the states, unless the tolerance is too small, into at most [`SIDE`] groups of equal weight along the respiratory position, and in each as many along the gain; a group is
/// represented by its average.
pub(crate) fn thinned(mut times: Vec<Lasting>, tolerance: f64) -> Vec<Lasting> {
    if times.len() <= MOST_SHAPES || tolerance < MERGED {
        return times;
    }
    times.sort_by(|a, b| (a.breath.total_cmp(&b.breath)).then(a.gain.total_cmp(&b.gain)));
    let mut merged = Vec::with_capacity(SIDE * SIDE);
    for mut slab in in_groups(&times) {
        slab.sort_by(|a, b| a.gain.total_cmp(&b.gain));
        merged.extend(in_groups(&slab).iter().map(|group| {
            let share = group.iter().map(|state| state.share).sum();
            let mean = |of: fn(&Lasting) -> f64| {
                let sum: f64 = group.iter().map(|state| state.share * of(state)).sum();
                sum / share
            };
            Lasting {
                gain: mean(|state| state.gain),
                breath: mean(|state| state.breath),
                share,
            }
        }));
    }
    merged
}

/// Divides states in their order into at most [`SIDE`] groups of nearly equal weight.
fn in_groups(states: &[Lasting]) -> Vec<Vec<Lasting>> {
    let all: f64 = states.iter().map(|state| state.share).sum();
    let mut groups = vec![Vec::new(); SIDE];
    let mut passed = 0.0;
    for state in states {
        let at = (passed / all * SIDE as f64) as usize;
        groups[at.min(SIDE - 1)].push(*state);
        passed += state.share;
    }
    groups.retain(|group| !group.is_empty());
    groups
}
