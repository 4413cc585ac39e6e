//! Clones of plans and operators compute the same results as their originals, bitwise.

use crate::common::noise;
use radon::{
    FbpMethod, FbpOptions, FbpPlan, FourierProjector, ImageGrid, Kernel, LinearOperator,
    ParallelGeometry, Projector, SliceAxis, SpectGeometry, SpectOperator, SpectOptions, StackOrder,
};

/// Both directions of an operator that has been used before it is cloned, and of its clone after it is gone.
fn check(operator: impl LinearOperator<f64> + Clone) {
    let image: Vec<f64> = noise(operator.image_len(), 1);
    let run = |operator: &dyn LinearOperator<f64>| {
        let (mut data, mut back) = (vec![0.0; operator.data_len()], vec![0.0; image.len()]);
        operator.forward_into(&image, &mut data).unwrap();
        operator.adjoint_into(&data, &mut back).unwrap();
        (data, back)
    };
    let expected = run(&operator);
    let clone = operator.clone();
    drop(operator);
    assert_eq!(run(&clone), expected);
}

#[test]
fn clones_compute_the_same() {
    let geometry = ParallelGeometry::half_turn(9, 16, 0.5).unwrap();
    let grid = ImageGrid::square(12, 0.5).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    check(
        projector
            .stack_operator(3, StackOrder::ViewSliceBin)
            .unwrap(),
    );
    check(FourierProjector::new(&geometry, &grid, 1e-4).unwrap());
    let axis = SliceAxis::new(4, 0.5).unwrap();
    let camera = SpectGeometry::circular(&geometry, &axis, 6.0).unwrap();
    check(SpectOperator::new(&camera, &grid, &axis, &SpectOptions::default()).unwrap());

    let sinogram: Vec<f64> = noise(geometry.sinogram_len(), 2);
    for method in [FbpMethod::Direct, FbpMethod::Fourier { tolerance: 1e-4 }] {
        let options = FbpOptions::default().with_method(method);
        let plan = FbpPlan::new(&geometry, &grid, &options).unwrap();
        let expected = plan.reconstruct(&sinogram).unwrap();
        let clone = plan.clone();
        drop(plan);
        assert_eq!(clone.method(), method);
        assert_eq!(clone.reconstruct(&sinogram).unwrap(), expected);
    }
}
