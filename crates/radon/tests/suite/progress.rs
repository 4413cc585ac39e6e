//! The completed fraction that computations report.

use crate::common::{half_turn, noise};
use radon::{ImageGrid, Kernel, LinearOperator, Projector, Sample, StackOrder};
use std::sync::Arc;

/// Both directions of a stack, alone and in blocks, with several bands of steps along rows and columns, are complete at their ends.
fn check<T: Sample>(kernel: Kernel, n_slices: usize) {
    let watch = Arc::new(simd_set::Watch::default());
    let of_threads = watch.clone();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .start_handler(move |_| simd_set::watch_with(of_threads.clone()))
        .build()
        .unwrap();
    let grid = ImageGrid::new(70, 90, 1.0).unwrap();
    let projector = Projector::new(&half_turn(8, 60, 1.3), &grid, kernel).unwrap();
    let stack = projector.stack_operator::<T>(n_slices, StackOrder::SliceViewBin);
    let stack = stack.unwrap();
    let (x, y) = (noise(stack.image_len(), 1), noise(stack.data_len(), 2));
    let forward = || drop(stack.forward(&x).unwrap());
    let adjoint = || drop(stack.adjoint(&y).unwrap());
    let both: [&(dyn Fn() + Sync); 2] = [&forward, &adjoint];
    for work in both {
        watch.restart();
        pool.install(work);
        // Fixed point with 62 bits, divided by numbers of units.
        let done = watch.fraction();
        assert!(done > 1.0 - 1e-9, "{kernel:?}, {n_slices} slices: {done}");
    }
}

#[test]
fn a_computation_reports_its_end() {
    for kernel in [Kernel::Joseph, Kernel::Strip] {
        for n_slices in [1, 40] {
            check::<f32>(kernel, n_slices);
            check::<f64>(kernel, n_slices);
        }
    }
}
