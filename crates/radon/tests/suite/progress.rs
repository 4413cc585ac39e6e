//! The completed fraction that computations report, and their end.

use crate::common::{half_turn, noise};
use radon::{
    FbpMethod, FbpOptions, FbpPlan, FourierProjector, ImageGrid, Kernel, LinearOperator, Projector,
    Sample, SliceAxis, SpectGeometry, SpectOperator, SpectOptions, StackOrder,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

fn pool(watch: &Arc<simd_set::Watch>) -> rayon::ThreadPool {
    let watch = watch.clone();
    rayon::ThreadPoolBuilder::new()
        .num_threads(2)
        .start_handler(move |_| simd_set::watch_with(watch.clone()))
        .build()
        .unwrap()
}

/// Both directions of a stack, alone and in blocks, with several bands of steps along rows and columns, are complete at their ends.
fn check<T: Sample>(kernel: Kernel, n_slices: usize) {
    let watch = Arc::new(simd_set::Watch::default());
    let pool = pool(&watch);
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

/// All computations that the first page of the crate names.
#[test]
fn computations_report_their_end_and_end_when_the_watch_is_stopped() {
    let (geometry, grid) = (half_turn(8, 30, 1.0), ImageGrid::square(24, 1.0).unwrap());
    let slice = SliceAxis::new(1, 1.0).unwrap();
    let orbit = SpectGeometry::circular(&geometry, &slice, 30.0).unwrap();
    let spect =
        || SpectOperator::<f64>::new(&orbit, &grid, &slice, &SpectOptions::default()).unwrap();
    let planned = |method| {
        let options = FbpOptions::default().with_method(method);
        FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap()
    };
    let [direct, fourier] =
        [FbpMethod::Direct, FbpMethod::Fourier { tolerance: 1e-4 }].map(planned);
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    let gridded = FourierProjector::<f64>::new(&geometry, &grid, 1e-3).unwrap();
    let operators: [&(dyn LinearOperator<f64> + Sync); 3] = [&projector, &gridded, &spect()];
    let (x, y) = (
        noise(grid.image_len(), 1),
        noise(geometry.sinogram_len(), 2),
    );

    let [watch, stopped] = [(); 2].map(|()| Arc::new(simd_set::Watch::default()));
    stopped.stop();
    let (running, ending) = (pool(&watch), pool(&stopped));
    let check = |name: &str, work: &(dyn Fn() + Sync)| {
        watch.restart();
        running.install(work);
        let done = watch.fraction();
        assert!(done > 1.0 - 1e-9, "{name}: {done}");
        let ended = catch_unwind(AssertUnwindSafe(|| ending.install(work)));
        assert!(
            ended.is_err_and(|payload| payload.is::<simd_set::Stopped>()),
            "{name}"
        );
    };
    for plan in [direct, fourier] {
        check("FBP", &|| drop(plan.reconstruct(&y).unwrap()));
        check("adjoint of FBP", &|| drop(plan.adjoint(&x).unwrap()));
    }
    check("SPECT plan", &|| drop(spect()));
    for (name, operator) in ["projector", "Fourier projector", "SPECT"]
        .iter()
        .zip(operators)
    {
        check(name, &|| drop(operator.forward(&x).unwrap()));
        check(name, &|| drop(operator.adjoint(&y).unwrap()));
    }
}
