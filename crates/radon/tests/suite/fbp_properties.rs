//! FBP: changes that leave the result bitwise identical.

use crate::common;

use common::{Ellipse, half_turn};
use radon::{
    FbpMethod, FbpOptions, FbpPlan, FbpScratch, ImageGrid, InstructionSet, Interpolation,
    ParallelGeometry, RadonError, StackOrder,
};

/// `n_slices` different ellipses, every third slice empty, as `[slice][view][bin]`.
fn stack(geometry: &ParallelGeometry, n_slices: usize) -> Vec<f32> {
    (0..n_slices)
        .flat_map(|z| {
            let ellipse = Ellipse {
                centre: [3.0 + 0.1 * z as f64, -2.0],
                a: 9.0,
                b: 4.0 + 0.05 * z as f64,
                phi: 0.3,
            };
            let value = if z % 3 == 2 { 0.0 } else { 1.0 + z as f64 };
            ellipse
                .sinogram(geometry)
                .into_iter()
                .map(move |p| (value * p) as f32)
        })
        .collect()
}

fn bits(volume: &[f32]) -> Vec<u32> {
    volume.iter().map(|v| v.to_bits()).collect()
}

#[test]
fn a_slice_is_bitwise_identical_alone_among_others_and_in_either_order() {
    let geometry = half_turn(23, 41, 1.0);
    let grid = ImageGrid::new(37, 29, 1.1).unwrap();
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    for n_slices in [2, 5, 16, 17, 40, 70, 131] {
        let by_slice = stack(&geometry, n_slices);
        let mut by_view = vec![0.0; by_slice.len()];
        for v in 0..23 {
            for z in 0..n_slices {
                let row = &by_slice[(z * 23 + v) * 41..][..41];
                by_view[(v * n_slices + z) * 41..][..41].copy_from_slice(row);
            }
        }
        let volume = plan
            .reconstruct_stack(&by_slice, n_slices, StackOrder::SliceViewBin)
            .unwrap();
        let other = plan
            .reconstruct_stack(&by_view, n_slices, StackOrder::ViewSliceBin)
            .unwrap();
        assert_eq!(bits(&volume), bits(&other), "{n_slices} slices");
        for z in 0..n_slices {
            let alone = plan
                .reconstruct(&by_slice[z * 23 * 41..][..23 * 41])
                .unwrap();
            assert_eq!(
                bits(&volume[z * grid.image_len()..][..grid.image_len()]),
                bits(&alone),
                "slice {z} of {n_slices}"
            );
        }
    }
}

#[test]
fn a_slice_alone_is_bitwise_identical_with_every_instruction_set_interpolation_and_sample_type() {
    // In up-sampled rows the samples of neighbouring pixels are apart and are loaded by other instructions than neighbouring samples.
    fn check<T: radon::Sample>(set: InstructionSet, interpolation: Interpolation, spacing: f64) {
        let geometry = half_turn(19, 41, 1.0);
        let grid = ImageGrid::new(37, 21, spacing).unwrap();
        let options = FbpOptions::default()
            .with_instructions(set)
            .with_interpolation(interpolation);
        let plan = FbpPlan::<T>::new(&geometry, &grid, &options).unwrap();
        let n_slices = 10;
        let projections: Vec<T> = stack(&geometry, n_slices)
            .into_iter()
            .map(|p| T::of(f64::from(p)))
            .collect();
        let volume = plan
            .reconstruct_stack(&projections, n_slices, StackOrder::SliceViewBin)
            .unwrap();
        let slices = volume.chunks_exact(grid.image_len());
        for (one, image) in projections
            .chunks_exact(geometry.sinogram_len())
            .zip(slices)
        {
            let alone = plan.reconstruct(one).unwrap();
            let same = |(a, b): (&T, &T)| a.f64().to_bits() == b.f64().to_bits();
            assert!(
                alone.iter().zip(image).all(same),
                "{set:?}, {interpolation:?}, {spacing}"
            );
        }
    }
    for set in [
        InstructionSet::Baseline,
        InstructionSet::Avx2,
        InstructionSet::Avx512,
        InstructionSet::Neon,
    ] {
        for interpolation in [Interpolation::Linear, Interpolation::BandLimited] {
            for spacing in [0.4, 1.0, 1.8, 2.5] {
                if set.is_available() {
                    check::<f32>(set, interpolation, spacing);
                    check::<f64>(set, interpolation, spacing);
                }
            }
        }
    }
}

#[test]
fn skipping_is_counted_and_leaves_results_bitwise_identical() {
    let geometry = half_turn(23, 41, 1.0);
    let grid = ImageGrid::square(32, 1.0).unwrap();
    let mut projections = stack(&geometry, 20);
    projections[3 * 41..5 * 41].fill(0.0); // two rows of slice 0
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    let mut volume = vec![f32::NAN; 20 * grid.image_len()];
    let order = StackOrder::SliceViewBin;
    let mut scratch = FbpScratch::default();
    let report = plan
        .reconstruct_slab_into(&projections, 20, order, 0..20, &mut volume, &mut scratch)
        .unwrap();
    let slices = volume.chunks(grid.image_len());
    for (sinogram, image) in projections.chunks(geometry.sinogram_len()).zip(slices) {
        assert_eq!(bits(&plan.reconstruct(sinogram).unwrap()), bits(image));
        let is_empty = |samples: &[f32]| samples.iter().all(|x| *x == 0.0);
        assert_eq!(is_empty(sinogram), is_empty(image));
    }
    assert_eq!(
        (report.slices_reconstructed, report.slices_skipped),
        (14, 6)
    );
    let method = FbpMethod::Fourier { tolerance: 1e-3 };
    let options = FbpOptions::default().with_method(method);
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
    let of_fourier = plan
        .reconstruct_slab_into(&projections, 20, order, 0..20, &mut volume, &mut scratch)
        .unwrap();
    assert_eq!(of_fourier, report);
}

/// A block that exceeds the memory is halved. A slice more than a block of one register does not widen it.
#[test]
fn the_width_of_blocks_follows_memory_and_slices() {
    // 32 views are the fewest that are filtered at once, if the memory suffices.
    let geometry = half_turn(32, 2000, 1.0);
    let grid = ImageGrid::square(32, 1.0).unwrap();
    for (set, register) in [
        (InstructionSet::Baseline, 4),
        (InstructionSet::Avx2, 8),
        (InstructionSet::Avx512, 16),
    ] {
        if !set.is_available() {
            continue;
        }
        let options = FbpOptions::default()
            .with_method(FbpMethod::Direct)
            .with_instructions(set);
        let work = |memory: usize, n_slices: usize| {
            let options = options.clone().with_memory(memory);
            let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
            plan.work_bytes(n_slices).unwrap() as f64
        };
        let wide = work(options.memory, 64);
        // The filtered rows are more than nine tenths of the memory.
        let half = work(wide as usize - 1, 64) / wide;
        assert!((half - 0.5).abs() < 0.05, "{set:?}: {half}");
        let [full, more] = [register, register + 1].map(|n| work(options.memory, n));
        assert_eq!(full, more, "{set:?}");
    }
}

#[test]
fn a_region_equals_that_part_of_the_whole() {
    let geometry = half_turn(31, 50, 1.0);
    let grid = ImageGrid::anisotropic(45, 38, [0.9, 1.2]).unwrap();
    let projections = stack(&geometry, 3);
    let whole = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    let options = FbpOptions::default().with_region(5..41, 9..30);
    let part = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
    let whole = whole
        .reconstruct_stack(&projections, 3, StackOrder::SliceViewBin)
        .unwrap();
    let part = part
        .reconstruct_stack(&projections, 3, StackOrder::SliceViewBin)
        .unwrap();
    let cut: Vec<f32> = (0..3)
        .flat_map(|z| (9..30).flat_map(move |y| (5..41).map(move |x| (z, y, x))))
        .map(|(z, y, x)| whole[(z * 38 + y) * 45 + x])
        .collect();
    assert_eq!(bits(&part), bits(&cut));
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let geometry = half_turn(23, 41, 1.0);
    let grid = ImageGrid::square(40, 1.0).unwrap();
    let projections = stack(&geometry, 37);
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        bits(
            &pool
                .install(|| plan.reconstruct_stack(&projections, 37, StackOrder::SliceViewBin))
                .unwrap(),
        )
    };
    let one = run(1);
    for threads in [2, 3, 8] {
        assert_eq!(one, run(threads), "{threads} threads");
    }
}

#[test]
fn every_instruction_set_computes_the_same_image_to_rounding() {
    let geometry = half_turn(23, 41, 1.0);
    let grid = ImageGrid::square(40, 0.9).unwrap();
    let projections = stack(&geometry, 37);
    let run = |set, projections: &[f32], n_slices| {
        let options = FbpOptions::default().with_instructions(set);
        let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
        plan.reconstruct_stack(projections, n_slices, StackOrder::SliceViewBin)
            .unwrap()
    };
    let sets: Vec<_> = [
        InstructionSet::Avx2,
        InstructionSet::Avx512,
        InstructionSet::Neon,
    ]
    .into_iter()
    .filter(|set| set.is_available())
    .collect();
    for n_slices in [1, 2, 9, 37] {
        let part = &projections[..n_slices * geometry.sinogram_len()];
        let plain = run(InstructionSet::Baseline, part, n_slices);
        let largest = plain.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        for &set in &sets {
            let other = run(set, part, n_slices);
            for (a, b) in plain.iter().zip(&other) {
                // The error of 46 additions is below 46 half-units in the last place of the sum of moduli.
                assert!(
                    (a - b).abs() <= 46.0 * f32::EPSILON * largest,
                    "{set:?}: {a} {b}"
                );
            }
        }
    }
}

#[test]
fn a_memory_budget_is_met_and_leaves_results_bitwise_identical() {
    let geometry = half_turn(50, 41, 1.0);
    let grid = ImageGrid::square(40, 1.0).unwrap();
    let projections = stack(&geometry, 70);
    let plan = |memory| {
        FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default().with_memory(memory)).unwrap()
    };
    let order = StackOrder::SliceViewBin;
    let whole = bits(
        &plan(64 << 20)
            .reconstruct_stack(&projections, 70, order)
            .unwrap(),
    );
    let largest = plan(64 << 20).work_bytes(70).unwrap();
    // Fewer views at once, narrower blocks, one slice at a time, one view of it at a time.
    let smallest = match plan(0).work_bytes(70) {
        Err(RadonError::BudgetTooSmall { least, given: 0 }) => least,
        other => panic!("{other:?}"),
    };
    for memory in [
        largest - 1,
        largest / 2,
        largest / 8,
        smallest + 10_000,
        smallest,
    ] {
        let plan = plan(memory);
        assert!(plan.work_bytes(70).unwrap() <= memory);
        assert_eq!(
            whole,
            bits(&plan.reconstruct_stack(&projections, 70, order).unwrap()),
            "{memory} bytes"
        );
    }
    assert!(matches!(
        plan(smallest - 1).reconstruct_stack(&projections, 70, order),
        Err(RadonError::BudgetTooSmall { least, given }) if (least, given) == (smallest, smallest - 1)
    ));
}

#[test]
fn slabs_within_a_budget_are_bitwise_identical() {
    let geometry = half_turn(23, 41, 1.0);
    let grid = ImageGrid::square(40, 1.0).unwrap();
    let (n_sinogram, n_image) = (geometry.sinogram_len(), grid.image_len());
    let projections = stack(&geometry, 70);
    let options = FbpOptions::default().with_memory(1 << 19);
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
    let mut scratch = FbpScratch::default();
    let mut slabs = vec![0.0; 70 * n_image];
    let mut slices = (0, 0);
    // Nine slices a slab.
    for (slab, from) in (slabs.chunks_mut(9 * n_image)).zip(projections.chunks(9 * n_sinogram)) {
        let (n, order) = (slab.len() / n_image, StackOrder::SliceViewBin);
        let report = plan
            .reconstruct_slab_into(from, n, order, 0..n, slab, &mut scratch)
            .unwrap();
        slices.0 += report.slices_reconstructed;
        slices.1 += report.slices_skipped;
    }
    let mut whole = vec![0.0; 70 * n_image];
    let order = StackOrder::SliceViewBin;
    let at_once = plan
        .reconstruct_slab_into(
            &projections,
            70,
            order,
            0..70,
            &mut whole,
            &mut FbpScratch::default(),
        )
        .unwrap();
    assert_eq!(bits(&whole), bits(&slabs));
    assert_eq!(slices, (47, 23));
    assert_eq!(
        (at_once.slices_reconstructed, at_once.slices_skipped),
        (47, 23)
    );
}

#[test]
fn a_reused_and_oversized_scratch_leaves_results_bitwise_identical() {
    let (large, small) = (half_turn(23, 41, 1.0), half_turn(7, 12, 1.0));
    let grid = ImageGrid::square(20, 1.0).unwrap();
    let plan = |geometry| FbpPlan::<f32>::new(geometry, &grid, &FbpOptions::default()).unwrap();
    let mut scratch = FbpScratch::default();
    let order = StackOrder::SliceViewBin;
    plan(&large)
        .reconstruct_slab_into(
            &stack(&large, 20),
            20,
            order,
            0..20,
            &mut vec![0.0; 20 * 400],
            &mut scratch,
        )
        .unwrap();
    let (mut used, projections) = (vec![f32::NAN; 5 * 400], stack(&small, 5));
    plan(&small)
        .reconstruct_slab_into(&projections, 5, order, 0..5, &mut used, &mut scratch)
        .unwrap();
    assert_eq!(
        bits(&used),
        bits(
            &plan(&small)
                .reconstruct_stack(&projections, 5, order)
                .unwrap()
        )
    );
}

#[test]
fn one_plan_serves_many_threads() {
    let geometry = half_turn(23, 41, 1.0);
    let plan = FbpPlan::<f32>::new(
        &geometry,
        &ImageGrid::square(32, 1.0).unwrap(),
        &FbpOptions::default(),
    )
    .unwrap();
    let projections = stack(&geometry, 4);
    let slice = &|z: usize| {
        bits(
            &plan
                .reconstruct(&projections[z * 23 * 41..][..23 * 41])
                .unwrap(),
        )
    };
    let one_by_one: Vec<_> = (0..4).map(slice).collect();
    let at_once: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|z| scope.spawn(move || slice(z))).collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap())
            .collect()
    });
    assert_eq!(one_by_one, at_once);
}
