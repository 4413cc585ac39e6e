//! Single slices and stacks use different loops: results must be bitwise identical.

use crate::common;

use common::noise;
use proptest::prelude::*;
use radon::{
    ImageGrid, InstructionSet, Kernel, LinearOperator, ParallelGeometry, Projector, StackOrder,
};
use std::f64::consts::PI;

const SETS: [InstructionSet; 4] = [
    InstructionSet::Baseline,
    InstructionSet::Avx2,
    InstructionSet::Avx512,
    InstructionSet::Neon,
];

/// Enough slices that none is projected alone.
const STACK: usize = 32;

fn bits(samples: &[f32]) -> Vec<u32> {
    // The sign of zero is ignored.
    samples.iter().map(|&x| (x + 0.0).to_bits()).collect()
}

/// Both directions of one slice alone and as the first of a stack, with every instruction set.
fn check(geometry: &ParallelGeometry, grid: &ImageGrid) -> Result<(), TestCaseError> {
    let order = StackOrder::SliceViewBin;
    let (image_len, sinogram_len) = (grid.image_len(), geometry.sinogram_len());
    let volume: Vec<f32> = noise(STACK * image_len, 5);
    let sinograms: Vec<f32> = noise(STACK * sinogram_len, 6);
    for kernel in [Kernel::Joseph, Kernel::Strip] {
        let projector = Projector::new(geometry, grid, kernel).unwrap();
        for set in SETS {
            let Ok(projector) = projector.clone().with_instructions(set) else {
                continue;
            };
            let stack = projector.stack_operator(STACK, order).unwrap();
            let among = stack.forward(&volume).unwrap();
            let alone = projector.forward(&volume[..image_len]).unwrap();
            prop_assert_eq!(
                bits(&alone),
                bits(&among[..sinogram_len]),
                "{:?} {:?}",
                kernel,
                set
            );
            let among = stack.adjoint(&sinograms).unwrap();
            let alone = projector.adjoint(&sinograms[..sinogram_len]).unwrap();
            prop_assert_eq!(
                bits(&alone),
                bits(&among[..image_len]),
                "adjoint, {:?} {:?}",
                kernel,
                set
            );
        }
    }
    Ok(())
}

#[test]
fn a_slice_of_the_study_is_bitwise_identical_alone_and_in_the_volume() {
    let geometry = ParallelGeometry::half_turn(90, 256, 1.0).unwrap();
    check(&geometry, &ImageGrid::square(256, 1.0).unwrap()).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// Bins finer than pixels and up to a hundred times as wide, images narrower than a run of rays and longer than a band of steps,
    /// rays beyond the image on either side.
    #[test]
    fn a_slice_is_bitwise_identical_alone_and_in_a_stack(
        mut angles in prop::collection::vec(-7.0f64..7.0, 1..4),
        n_bins in 1usize..90,
        (nx, ny) in (1usize..90, 1usize..90),
        pitch in prop_oneof![Just(1.0), 0.3f64..1.0, 1.0f64..1.5, 1.5f64..3.0, 3.0f64..70.0],
        spacing in prop_oneof![Just([1.0, 1.0]), prop::array::uniform2(0.6f64..1.6)],
        offset in prop_oneof![Just(0.0), -60.0f64..60.0],
        right_angle in any::<bool>(),
    ) {
        if right_angle {
            angles.push(PI / 2.0);
            angles.push(0.0);
        }
        let geometry = ParallelGeometry::from_radians(angles, n_bins, pitch).unwrap().with_offset(offset).unwrap();
        check(&geometry, &ImageGrid::anisotropic(nx, ny, spacing).unwrap())?;
    }
}
