//! Voxelised ground truth.

use crate::Activity;
use crate::error::PhantomError;
use crate::scan::{Lasting, OF_VOXEL, Scan, add_to_gates, shortest_side};
use revolve_voxel::{Body, Organs, VoxelCounters};
use std::collections::BTreeMap;
use std::ops::Range;

/// Largest number of shapes that are added in one pass over the volume, and their memory limit in bytes.
pub(crate) const MOST_IN_PASS: usize = 256;
const BYTES_OF_PASS: usize = 256 << 20;

/// Volume gains as bits, with the gates that contain the shape and its fraction of their time.
pub(crate) type SharedShapes = BTreeMap<u64, Vec<(usize, f64)>>;

/// Computes the activity of some slices, averaged over the voxel and over states of the heart; index order `[z][y][x]`. Bitwise equal to
/// the slices of the whole volume.
///
/// Volume fractions are accurate to `tolerance`, including the average over time if there is one ([`Scan::states`]). `around` contains the
/// activity of the organs in these slices.
pub(crate) fn truth_of_slices(
    scan: &Scan<'_>,
    tolerance: f64,
    slices: Range<usize>,
    around: Option<&[f32]>,
) -> Result<(Vec<f32>, VoxelCounters), PhantomError> {
    let times = scan.states(tolerance)?;
    let mut volume = background(scan, slices.clone())?;
    let mut counters = VoxelCounters::default();
    let part = simd_set::part(0..1, 1 + usize::from(around.is_some()));
    for (_part, pass) in simd_set::parts(times.chunks(in_pass(scan))) {
        let tolerance = of_voxels(scan, tolerance);
        counters = counters + add_shapes(scan, pass, tolerance, slices.clone(), &mut volume)?;
    }
    drop(part);
    if let Some(around) = around {
        let _part = simd_set::part(1..2, 2);
        let heart = alone(scan, 1.0);
        let (heart, further) = truth_of_slices(&heart, tolerance, slices, None)?;
        counters = counters + further;
        for ((voxel, share), held) in volume.iter_mut().zip(&heart).zip(around) {
            *voxel += (1.0 - share) * held;
        }
    }
    clamp(&mut volume);
    Ok((volume, counters))
}

/// Returns the scan of a heart of uniform value without surroundings: for 1 its ground truth is the volume fraction of the heart.
pub(crate) fn alone<'a>(scan: &Scan<'a>, value: f64) -> Scan<'a> {
    Scan {
        activity: Activity::from([value; 2]),
        attenuation: None,
        defects: &[],
        background: None,
        organs: None,
        ..scan.clone()
    }
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
    for (_part, (gain, uses)) in simd_set::parts(shared.iter()) {
        one.fill(0.0);
        let whole = [Lasting {
            gain: f64::from_bits(*gain),
            breath: 0.0,
            share: 1.0,
        }];
        counters = counters + add_shapes(scan, &whole, tolerance, slices.clone(), &mut one)?;
        add_to_gates(&one, uses, &mut gates);
    }
    clamp(volumes);
    Ok(counters)
}

/// Returns the tolerance of the average over a voxel: all of it without an average over time.
fn of_voxels(scan: &Scan<'_>, tolerance: f64) -> f64 {
    match scan.has_duration() {
        true => OF_VOXEL * tolerance,
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
    let bytes = scan.heart.bytes_with_defects() + finder_bytes(scan);
    (BYTES_OF_PASS / bytes).clamp(1, MOST_IN_PASS)
}

/// Estimates the memory of the surface search of a shape in bytes: for each layer cells of 24 bytes, as large as the least side of a
/// voxel, at most 250 000.
pub(crate) fn finder_bytes(scan: &Scan<'_>) -> usize {
    let size = shortest_side(scan.camera.grid());
    // Twice the reference volume, with a margin.
    let cells: f64 = (scan.heart.reference_extent().into_iter())
        .map(|side| 2f64.sqrt() * side / size + 8.0)
        .product();
    2 * 24 * cells.min(250_000.0) as usize
}

/// Adds the heart in some states, each weighted by its fraction of the time.
fn add_shapes(
    scan: &Scan<'_>,
    times: &[Lasting],
    tolerance: f64,
    slices: Range<usize>,
    volume: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    let gains: Vec<f64> = times.iter().map(|lasting| lasting.gain).collect();
    let shapes = scan.heart.shapes(&gains)?;
    let bodies = (times.iter().zip(&shapes))
        .map(|(lasting, shape)| Ok(shape.body().with_pose(scan.pose(lasting.breath)?)))
        .collect::<Result<Vec<Body>, PhantomError>>()?;
    let placed = scan.placed(&shapes)?;
    let grid = scan.camera.grid();
    let around = (scan.background).map_or(0.0, |background| background.concentration);
    let held: Vec<[f64; 2]> = (shapes.iter().zip(times))
        .map(|(shape, lasting)| {
            (scan.activity.of(shape)).map(|held| lasting.share * (held - around))
        })
        .collect();
    let weighted: Vec<(&Body, &[f64])> = (bodies.iter().zip(&held))
        .map(|(body, activity)| (body, &activity[..]))
        .collect();
    let n_sectors: usize = shapes.iter().map(|shape| placed.of(shape).len()).sum();
    let part = simd_set::part(0..1, 1 + n_sectors);
    let mut counters = Body::voxelize_add(&weighted, grid, slices.clone(), tolerance, volume)?;
    drop(part);
    let mut sectors = 1..1 + n_sectors;
    for ((shape, body), lasting) in shapes.iter().zip(&bodies).zip(times) {
        let [_, wall] = scan.activity.of(shape);
        for (_, sector, factor) in placed.of(shape) {
            let k = sectors.next().unwrap_or(n_sectors);
            let _part = simd_set::part(k..k + 1, 1 + n_sectors);
            let sector = sector.with_pose(*body.pose());
            let difference = lasting.share * factor * wall;
            let done = sector.voxelize_add(grid, slices.clone(), tolerance, difference, volume)?;
            counters = counters + done;
        }
    }
    Ok(counters)
}
