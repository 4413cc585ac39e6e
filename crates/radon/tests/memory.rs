//! The largest heap memory of a run against the prediction of the plan.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use peak_alloc::PeakAlloc;
use radon::{
    FbpMethod, FbpOptions, FbpPlan, ImageGrid, Interpolation, Kernel, LinearOperator,
    ParallelGeometry, Projector, StackOrder,
};

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Lists of slices and jobs, beside the samples.
const BOOKKEEPING: usize = 16 << 10;

/// Largest heap memory during `work` in addition to that before.
fn peak(work: impl FnOnce()) -> usize {
    HEAP.reset_peak_usage();
    let before = HEAP.current_usage();
    work();
    HEAP.peak_usage() - before
}

// A single test: the counter applies to the process, and tests run concurrently.
#[test]
fn a_run_uses_the_predicted_memory() {
    reconstructions();
    a_slice_of_long_rows();
    back_projections();
    #[cfg(feature = "sprs")]
    matrices();
}

/// Beside its entries, which grow by doubling, a matrix needs the list of one ray at a time: a growing list and its copy are at most 1.5 times
/// the size of a list whose length is a power of two.
#[cfg(feature = "sprs")]
fn matrices() {
    let geometry = ParallelGeometry::half_turn(1, 256, 1.0).unwrap();
    let grid = ImageGrid::square(256, 1.0).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    let n_entries = 256 * 256;
    let used = peak(|| assert_eq!(projector.matrix::<f64>().unwrap().nnz(), n_entries));
    let entries = n_entries * (size_of::<usize>() + size_of::<f64>());
    assert!(
        used < 3 * entries / 2 + 4 * BOOKKEEPING,
        "{used} of {entries}"
    );
}

/// Transforms of long rows need more memory than the bookkeeping.
fn a_slice_of_long_rows() {
    let geometry = ParallelGeometry::half_turn(3, 6000, 1.0).unwrap();
    let grid = ImageGrid::square(16, 1.0).unwrap();
    let sinogram = vec![1.0_f32; geometry.sinogram_len()];
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &FbpOptions::default()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.build().unwrap().install(|| {
        let said = plan.work_bytes(1).unwrap();
        let used = peak(|| drop(plan.reconstruct(&sinogram).unwrap()));
        assert!(used <= said + BOOKKEEPING, "{used} of {said}");
    });
}

/// One slice: work arrays beside the image are a few times the image and the sinogram, with margins.
fn back_projections() {
    let geometry = ParallelGeometry::half_turn(60, 200, 1.0).unwrap();
    let grid = ImageGrid::square(200, 1.0).unwrap();
    let sinogram = vec![1.0_f32; geometry.sinogram_len()];
    let data = size_of::<f32>() * (grid.image_len() + geometry.sinogram_len());
    for kernel in [Kernel::Joseph, Kernel::Strip] {
        let projector = Projector::new(&geometry, &grid, kernel).unwrap();
        let used = peak(|| drop(projector.adjoint(&sinogram).unwrap()));
        assert!(used < 8 * data, "{kernel:?}: {used} of {data}");
    }
}

fn reconstructions() {
    let geometry = ParallelGeometry::half_turn(60, 96, 1.0).unwrap();
    let grid = ImageGrid::square(96, 1.0).unwrap();
    let (n_slices, order) = (80, StackOrder::SliceViewBin);
    let projections = vec![1.0_f32; n_slices * geometry.sinogram_len()];
    let mut volume = vec![0.0_f32; n_slices * grid.image_len()];
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let fourier = FbpMethod::Fourier { tolerance: 1e-4 };
        for (interpolation, method) in [
            (Interpolation::Linear, FbpMethod::Direct),
            (Interpolation::BandLimited, FbpMethod::Direct),
            (Interpolation::Linear, fourier),
            (Interpolation::BandLimited, fourier),
        ] {
            for memory in [64 << 20, 3 << 20, 3 << 19] {
                let options = FbpOptions::default()
                    .with_memory(memory)
                    .with_interpolation(interpolation)
                    .with_method(method);
                let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
                let said = pool.install(|| plan.work_bytes(n_slices)).unwrap();
                assert!(said <= memory);
                let mut scratch = radon::FbpScratch::default();
                let mut run = || {
                    pool.install(|| {
                        plan.reconstruct_slab_into(
                            &projections,
                            n_slices,
                            order,
                            0..n_slices,
                            &mut volume,
                            &mut scratch,
                        )
                    })
                    .unwrap();
                };
                let (first, second) = (peak(&mut run), peak(&mut run));
                assert!(
                    first <= said + BOOKKEEPING,
                    "{threads} threads, {method:?}, {interpolation:?}, {memory}: {first} of {said}"
                );
                // The filtered rows, the larger part, stay allocated.
                assert!(second < first, "{second} of {first}");
            }
        }
    }
}
