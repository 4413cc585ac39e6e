//! Tests the conventions of `docs/conventions.md` between the crates: pairs of independent crates agree on positions.
//!
//! The objects are off-centre and differ from all their mirror images, so that a sign error in both crates would be detected.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use nalgebra::Vector3;
use radon::{
    BinSampling, FbpOptions, FbpPlan, ImageGrid, ParallelGeometry, Phantom3, Shape2, Shape3,
    SliceAxis, StackOrder,
};
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, VoxelGrid};
use std::f64::consts::FRAC_PI_4;

/// All detector images of a body, `[view][row][bin]`.
fn projections(
    body: &Body,
    detector: &ParallelDetector,
    angles: &[f64],
    activity: f64,
) -> Vec<f64> {
    let view = |&theta: &f64| {
        let rays = detector.rays(theta).unwrap();
        body.project::<f64>(&rays, &[activity]).unwrap().0
    };
    angles.iter().flat_map(view).collect()
}

#[test]
fn chords_of_a_body_equal_line_integrals_of_a_phantom() {
    // An upright cylinder off the axis and off the middle in height, on an offset detector of odd and even sizes.
    let (radius, height, centre) = (1.1, 3.0, [2.0, -1.3, 0.7]);
    let meridian = Meridian::new(&[[0.0, radius], [height, radius]]).unwrap();
    let pose = Pose::axis_along_z(height / 2.0).unwrap();
    let body = Body::new(vec![meridian], pose.shifted(Vector3::from(centre)).unwrap()).unwrap();
    let section = Shape2::ellipse([centre[0], centre[1]], [radius; 2], 0.0).unwrap();
    let z = [centre[2] - height / 2.0, centre[2] + height / 2.0];
    let phantom = Phantom3::new([(1.5, Shape3::prism(section, z).unwrap())]).unwrap();

    let (n_bins, n_rows, pitch, offset) = (41, 30, 0.21, 0.13);
    let geometry = ParallelGeometry::full_turn(7, n_bins, pitch).unwrap();
    let geometry = geometry.with_offset(offset).unwrap();
    let slices = SliceAxis::new(n_rows, 0.17).unwrap();
    let detector = ParallelDetector::new(n_bins, n_rows, [pitch, 0.17]).unwrap();
    let detector = detector.with_offset([offset, 0.0]).unwrap();

    let chords = projections(&body, &detector, geometry.angles(), 1.5);
    let expected: Vec<f64> = phantom
        .sinogram(
            &geometry,
            &slices,
            BinSampling::Centre,
            StackOrder::ViewSliceBin,
        )
        .unwrap();
    // Two closed forms of order 1; near the rim a square root amplifies 1e-16 to 1e-8.
    assert_eq!(chords.len(), expected.len());
    assert!(expected.iter().filter(|&&value| value > 1.0).count() > 500);
    for (at, (a, b)) in chords.iter().zip(&expected).enumerate() {
        assert!((a - b).abs() < 1e-7, "sample {at}: {a} and {b}");
    }
}

#[test]
fn rotating_the_object_equals_rotating_the_camera_back() {
    let meridian = || Meridian::new(&[[0.0, 1.0], [2.0, 1.6], [3.0, 0.0]]).unwrap();
    let pose = Pose::axis_along_z(1.0).unwrap().rotated_x(0.5).unwrap();
    let pose = pose.shifted(Vector3::new(1.0, 0.4, -0.2)).unwrap();
    let detector = ParallelDetector::new(32, 24, [0.25, 0.25]).unwrap();
    let turn = 0.3;
    let still = Body::new(vec![meridian()], pose).unwrap();
    let turned = Body::new(vec![meridian()], pose.rotated_z(turn).unwrap()).unwrap();
    let expected = projections(&still, &detector, &[1.1 - turn], 1.0);
    let other_sign = projections(&still, &detector, &[1.1 + turn], 1.0);
    let found = projections(&turned, &detector, &[1.1], 1.0);
    let distance = |a: &[f64]| {
        a.iter()
            .zip(&found)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    assert!(distance(&expected) < 1e-7, "{}", distance(&expected)); // as above
    assert!(distance(&other_sign) > 0.1);
}

/// Centre of mass and mass (sum of voxels) of a volume `[z][y][x]` within the circle that all views cover.
fn moments(volume: &[f64], grid: &VoxelGrid) -> ([f64; 3], f64) {
    let [nx, ny, _] = grid.shape();
    let (mut mass, mut first) = (0.0, [0.0; 3]);
    for (at, &value) in volume.iter().enumerate() {
        let centre = grid.centre(at % nx, at / nx % ny, at / (nx * ny));
        if centre.x.hypot(centre.y) > 0.5 * nx as f64 * grid.spacing()[0] {
            continue;
        }
        mass += value;
        for axis in 0..3 {
            first[axis] += value * centre[axis];
        }
    }
    (first.map(|sum| sum / mass), mass)
}

#[test]
fn a_posed_body_is_reconstructed_at_the_position_of_its_voxels() {
    // A blunt cone in the pose of the study, displaced from the centre: it differs from its mirror images.
    let meridian = Meridian::new(&[[0.0, 1.2], [2.5, 0.5], [3.0, 0.0]]).unwrap();
    let pose = Pose::axis_along_z(1.0).unwrap();
    let pose = pose
        .rotated_x(FRAC_PI_4)
        .unwrap()
        .rotated_y(FRAC_PI_4)
        .unwrap();
    let direction = pose.axis();
    assert!((direction - Vector3::new(0.5, -0.5f64.sqrt(), 0.5)).norm() < 1e-15);
    let pose = pose.shifted(Vector3::new(0.8, 0.5, -0.4)).unwrap();
    let body = Body::new(vec![meridian], pose).unwrap();

    let (n, n_slices, pitch) = (64, 48, 0.125);
    let geometry = ParallelGeometry::half_turn(120, n, pitch).unwrap();
    let detector = ParallelDetector::new(n, n_slices, [pitch; 2]).unwrap();
    let sinogram = projections(&body, &detector, geometry.angles(), 1.0);
    let image = ImageGrid::square(n, pitch).unwrap();
    let plan = FbpPlan::<f64>::new(&geometry, &image, &FbpOptions::default()).unwrap();
    let volume = plan
        .reconstruct_stack(&sinogram, n_slices, StackOrder::ViewSliceBin)
        .unwrap();

    let grid = VoxelGrid::centred([n, n, n_slices], [pitch; 3], [0.0; 3]).unwrap();
    let (truth, _) = body.voxelize::<f64>(&grid, 1e-3, &[1.0]).unwrap();
    let rms = |a: &[f64], b: &[f64]| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    };
    let right = rms(&volume, &truth);

    // Mirrored in x, y or z, or with x and y exchanged, the ground truth differs strongly from it.
    let at = |x: usize, y: usize, z: usize| truth[(z * n + y) * n + x];
    let last = n - 1;
    let mirrors: [&dyn Fn(usize, usize, usize) -> f64; 5] = [
        &|x, y, z| at(last - x, y, z),
        &|x, y, z| at(x, last - y, z),
        &|x, y, z| at(x, y, n_slices - 1 - z),
        &|x, y, z| at(y, x, z),
        &|x, y, z| at(last - x, last - y, z),
    ];
    for (which, mirror) in mirrors.iter().enumerate() {
        let other: Vec<f64> = (0..truth.len())
            .map(|i| mirror(i % n, i / n % n, i / (n * n)))
            .collect();
        assert!(rms(&volume, &other) > 3.0 * right, "mirror {which}");
    }

    // The ramp conserves both moments up to sampling: measured 3e-4 and 0.006 voxels, where a shift by half a bin would be 0.5.
    let (found, mass) = moments(&volume, &grid);
    let (expected, volume_of_truth) = moments(&truth, &grid);
    assert!(
        (mass / volume_of_truth - 1.0).abs() < 1e-3,
        "{mass} and {volume_of_truth}"
    );
    for axis in 0..3 {
        assert!(
            (found[axis] - expected[axis]).abs() < 0.02 * pitch,
            "axis {axis}: {found:?}, {expected:?}"
        );
    }
}
