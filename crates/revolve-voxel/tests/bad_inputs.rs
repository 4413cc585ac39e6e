//! Every constructor and every batch call refuses bad input with the numbers that show why.

mod support;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use revolve_voxel::{
    Body, Error, Meridian, ParallelDetector, ParallelRays, Piece, Pose, Ray, Sampling, VoxelGrid,
};
use support::*;

#[test]
fn meridians() {
    assert!(matches!(
        Meridian::new(&[]),
        Err(Error::TooFewPoints { given: 0, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0]]),
        Err(Error::TooFewPoints { given: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [0.0, 1.0]]),
        Err(Error::TooFewPoints { given: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [f64::NAN, 1.0]]),
        Err(Error::NotFinitePoint { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [1.0, f64::INFINITY]]),
        Err(Error::NotFinitePoint { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [1.0, -0.5]]),
        Err(Error::NegativeRadius { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 0.0], [1.0, 0.0]]),
        Err(Error::NoVolume { .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [0.0, 2.0]]),
        Err(Error::NoVolume { .. })
    ));
    // A loop in the path; a path through its own closing disc; one that runs back over itself.
    let knot = [
        [0.0, 0.0],
        [2.0, 1.0],
        [2.0, 2.0],
        [1.0, 2.0],
        [1.0, 0.2],
        [3.0, 0.0],
    ];
    assert!(matches!(
        Meridian::new(&knot),
        Err(Error::SelfCrossing { .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [-1.0, 0.5], [3.0, 0.2]]),
        Err(Error::SelfCrossing { .. })
    ));
    let back = [[0.0, 1.0], [2.0, 1.0], [1.0, 1.0], [1.0, 0.5], [3.0, 0.0]];
    assert!(matches!(
        Meridian::new(&back),
        Err(Error::SelfCrossing { .. })
    ));
    // Parts that overlap and meet on the axis only: a cone within the rest; two that come down to one point, crossed over.
    let cone_within = [[0.0, 1.0], [1.0, 0.0], [-2.0, 0.0], [-2.0, 4.0], [5.0, 2.0]];
    let crossed = [[0.0, 0.0], [0.4, 2.0], [0.6, 6.0], [0.0, 0.0], [4.0, 1.0]];
    for overlapping in [&cone_within[..], &crossed] {
        assert!(matches!(
            Meridian::new(overlapping),
            Err(Error::SelfCrossing { .. })
        ));
    }
    // The same parts side by side are a solid, and so is a ring that touches the axis.
    for fine in [
        Meridian::new(&[[0.0, 1.0], [1.0, 0.0], [2.0, 0.0], [2.0, 4.0], [5.0, 2.0]]),
        Meridian::new(&[[0.0, 0.0], [0.4, 2.0], [1.0, 0.0], [4.0, 1.0]]),
        Meridian::ring(&[[0.0, 0.0], [-1.0, 1.0], [0.0, 2.0], [1.0, 1.0]]),
    ] {
        assert!(fine.is_ok(), "{fine:?}");
    }
    // An edge that comes back at an angle below rounding.
    let slit = [
        [0.0, 0.0],
        [2.0, 1.0],
        [0.5, 1.0],
        [1e-300, 3.0],
        [1e-300, 1.0],
        [0.0, 3.1],
        [4.0, 2.0],
    ];
    assert!(matches!(
        Meridian::new(&slit),
        Err(Error::SelfCrossing { .. })
    ));
    assert!(matches!(
        Meridian::ring(&[[0.0, 1.0], [1.0, 1.0]]),
        Err(Error::TooFewPoints { needed: 3, .. })
    ));
    assert!(matches!(
        Meridian::from_full_curve(&[[0.0, -1.0], [1.0, 1.0]]),
        Err(Error::NegativeRadius { .. })
    ));
    assert!(matches!(
        Meridian::from_full_curve(&[[0.0, 1.0], [1.0, f64::NAN]]),
        Err(Error::NotFinitePoint { .. })
    ));
    // Apex to base is turned round.
    let a = Meridian::new(&[[3.0, 0.0], [0.0, 1.0]]).unwrap();
    assert_eq!(a, Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap());
}

#[test]
fn the_upper_half_of_a_full_curve() {
    // A node at the apex, and none: the apex is then interpolated.
    let with = Meridian::from_full_curve(&[[0.0, 1.0], [2.0, 0.0], [0.0, -1.0]]).unwrap();
    let without =
        Meridian::from_full_curve(&[[0.0, 1.0], [2.0, 0.5], [2.0, -0.5], [0.0, -1.0]]).unwrap();
    assert_eq!(with, Meridian::new(&[[0.0, 1.0], [2.0, 0.0]]).unwrap());
    assert_eq!(
        without,
        Meridian::new(&[[0.0, 1.0], [2.0, 0.5], [2.0, 0.0]]).unwrap()
    );
}

#[test]
fn smooth_pieces() {
    let line = |x0: f64, x1: f64| Piece::Power {
        x: vec![x0, x1 - x0],
        r: vec![1.0],
    };
    assert!(matches!(
        Meridian::smooth(&[], 1e-3),
        Err(Error::TooFewPoints { .. })
    ));
    assert!(matches!(
        Meridian::smooth(&[line(0.0, 1.0)], 0.0),
        Err(Error::NotPositive { .. })
    ));
    assert!(matches!(
        Meridian::smooth(&[line(0.0, f64::NAN)], 1e-3),
        Err(Error::NotFinite { .. })
    ));
    let gap = Meridian::smooth(&[line(0.0, 1.0), line(1.5, 2.0)], 1e-3);
    assert!(matches!(gap, Err(Error::Gap { piece: 1, gap, .. }) if (gap - 0.5).abs() < 1e-12));
    let dips = Piece::Power {
        x: vec![0.0, 1.0],
        r: vec![0.5, -2.0, 2.0],
    };
    assert!(Meridian::smooth(&[dips], 1e-3).is_ok());
    let below = Piece::Power {
        x: vec![0.0, 1.0],
        r: vec![0.3, -2.0, 2.0],
    };
    assert!(matches!(
        Meridian::smooth(&[below], 1e-3),
        Err(Error::NegativeRadius { .. })
    ));
    let round = Piece::Chebyshev {
        x: vec![0.0, 1.0],
        r: vec![0.5, 0.0, -0.5],
    };
    assert!(matches!(
        Meridian::smooth(&[round], 1e-18),
        Err(Error::TooFine { .. })
    ));
}

#[test]
fn poses_rays_grids_detectors() {
    let nan = f64::NAN;
    assert!(Pose::axis_along_z(nan).is_err());
    assert!(Pose::identity().turned_x(f64::INFINITY).is_err());
    assert!(
        Pose::identity()
            .shifted(Vector3::new(0.0, nan, 0.0))
            .is_err()
    );
    assert!(Pose::new(Isometry3::translation(nan, 0.0, 0.0)).is_err());
    let zero = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    assert!(Pose::new(Isometry3::from_parts(Vector3::zeros().into(), zero)).is_err());
    assert!(matches!(
        Ray::new(Point3::origin(), Vector3::zeros()),
        Err(Error::NotPositive { .. })
    ));
    assert!(Ray::new(Point3::new(nan, 0.0, 0.0), Vector3::x()).is_err());
    assert!(Ray::new(Point3::origin(), Vector3::new(1e-300, 0.0, 0.0)).is_ok());
    assert!(Ray::new(Point3::origin(), Vector3::new(1e300, 1e300, 0.0)).is_ok());
    assert!(VoxelGrid::cube(0, 1.0).is_err());
    assert!(VoxelGrid::cube(4, -1.0).is_err());
    assert!(VoxelGrid::new([1; 3], [1.0; 3], [nan; 3]).is_err());
    assert!(ParallelDetector::new(0, 4, [1.0; 2]).is_err());
    assert!(ParallelDetector::new(4, 4, [1.0, 0.0]).is_err());
    let detector = ParallelDetector::new(4, 4, [1.0; 2]).unwrap();
    assert!(detector.with_offset([nan, 0.0]).is_err());
    assert!(detector.rays(nan).is_err());
    let x = Vector3::x();
    assert!(ParallelRays::new([0, 1], Point3::origin(), x, x, x).is_err());
    assert!(ParallelRays::new([1, 1], Point3::origin(), x * nan, x, x).is_err());
    assert!(ParallelRays::new([1, 1], Point3::origin(), x, x, x * 0.0).is_err());
}

#[test]
fn bodies_and_batches() {
    assert!(matches!(
        Body::new(vec![], Pose::identity()),
        Err(Error::Length { given: 0, .. })
    ));
    let body = heart(20);
    let rays = ParallelDetector::new(4, 4, [1.0; 2])
        .unwrap()
        .rays(0.0)
        .unwrap();
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0]),
        Err(Error::Length {
            expected: 2,
            given: 1,
            ..
        })
    ));
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0, f64::NAN]),
        Err(Error::NotFinite { .. })
    ));
    let mut short = vec![0.0f32; 15];
    assert!(matches!(
        body.project_add(&rays, &[1.0; 2], 1.0, &mut short),
        Err(Error::Length {
            expected: 16,
            given: 15,
            ..
        })
    ));
    assert!(
        body.project_add(&rays, &[1.0; 2], f64::NAN, &mut [0.0f32; 16])
            .is_err()
    );
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    let voxels = |slices, sampling, n| {
        body.voxelize_add(
            &grid,
            slices,
            sampling,
            &[1.0; 2],
            1.0,
            &mut vec![0.0f32; n],
        )
    };
    assert!(matches!(
        voxels(0..3, Sampling::Centre, 12),
        Err(Error::Length { .. })
    ));
    assert!(matches!(
        voxels(0..2, Sampling::Centre, 7),
        Err(Error::Length { .. })
    ));
    assert!(matches!(
        voxels(0..2, Sampling::Supersampled(0), 8),
        Err(Error::NotPositive { .. })
    ));
    assert!(matches!(
        voxels(0..2, Sampling::Coverage { tolerance: 0.0 }, 8),
        Err(Error::NotPositive { .. })
    ));
    assert!(voxels(2..2, Sampling::Centre, 0).is_ok());
    assert!(body.mesh(0, -1.0).is_err());
    assert!(matches!(body.mesh(0, 1e-30), Err(Error::TooFine { .. })));
}

#[test]
fn layers_that_are_not_nested_are_reported() {
    let cylinder = |r: f64| Meridian::new(&[[0.0, r], [2.0, r]]).unwrap();
    let body = |a, b| Body::new(vec![cylinder(a), cylinder(b)], Pose::identity()).unwrap();
    assert!(body(1.0, 2.0).check_nested(0.0).is_ok());
    let found = body(2.0, 1.5).check_nested(1e-9);
    assert!(
        matches!(found, Err(Error::NotNested { layer: 0, depth, .. }) if (depth - 0.5).abs() < 1e-12)
    );
}

#[test]
fn sizes_beyond_memory_are_refused() {
    let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap();
    let body = Body::new(vec![cone], Pose::axis_along_z(1.0).unwrap()).unwrap();
    for n in [usize::MAX, 1 << 32] {
        assert!(matches!(
            VoxelGrid::cube(n, 1.0),
            Err(Error::TooLarge { .. })
        ));
        assert!(matches!(
            ParallelDetector::new(n, n, [1.0; 2]),
            Err(Error::TooLarge { .. })
        ));
    }
    // Countable, but no amount of memory.
    let grid = VoxelGrid::cube(1 << 19, 1.0).unwrap();
    let volume = body.voxelize::<f32>(&grid, Sampling::Centre, &[1.0]);
    assert!(matches!(volume, Err(Error::TooLarge { .. })));
    let rays = ParallelDetector::new(1 << 28, 1 << 29, [1.0; 2])
        .unwrap()
        .rays(0.0)
        .unwrap();
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0]),
        Err(Error::TooLarge { .. })
    ));
}

#[test]
fn a_layer_that_is_not_there_is_empty() {
    let body = Body::new(
        vec![Meridian::new(&[[0.0, 1.0], [1.0, 1.0]]).unwrap()],
        Pose::identity(),
    )
    .unwrap();
    let ray = Ray::new(Point3::new(0.5, -3.0, 0.0), Vector3::y()).unwrap();
    assert!((body.chord(0, &ray) - 2.0).abs() < 1e-14);
    for absent in [1, usize::MAX] {
        assert_eq!(body.chord(absent, &ray), 0.0);
        assert!(body.spans(absent, &ray).is_empty());
        assert!(body.first_hit(absent, &ray).is_none());
        assert!(body.bounding_box(absent).is_none());
        assert_eq!(
            body.signed_distance(absent, &Point3::origin()),
            f64::INFINITY
        );
        assert_eq!(body.region_measures(absent).volume, 0.0);
        assert!(matches!(
            body.mesh(absent, 0.1),
            Err(Error::NoSuchLayer { given, layers: 1 }) if given == absent
        ));
    }
}
