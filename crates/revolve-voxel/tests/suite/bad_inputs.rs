//! Every constructor and every batch call rejects invalid input with its values.

mod curves;
mod voxels;

use crate::support;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use revolve_voxel::{
    Body, Curve, Lines, Mask, Meridian, Mesh, OrganShape, ParallelDetector, Piece, Pose, Ray,
    RevolveError, Shell, VoxelGrid,
};
use support::*;

#[test]
fn meridians() {
    assert!(matches!(
        Meridian::new(&[]),
        Err(RevolveError::TooFew { given: 0, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0]]),
        Err(RevolveError::TooFew { given: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [0.0, 1.0]]),
        Err(RevolveError::TooFew { given: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [f64::NAN, 1.0]]),
        Err(RevolveError::NotFinitePoint { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [1.0, f64::INFINITY]]),
        Err(RevolveError::NotFinitePoint { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [1.0, -0.5]]),
        Err(RevolveError::NegativeRadius { index: 1, .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 0.0], [1.0, 0.0]]),
        Err(RevolveError::NoVolume { .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [0.0, 2.0]]),
        Err(RevolveError::NoVolume { .. })
    ));
    // Two parts whose volumes cancel.
    let crossing = Meridian::new(&[[0.0, 1.0], [2.0, 2.0], [2.0, 1.0], [0.0, 2.0]]).unwrap_err();
    assert!(
        crossing.to_string().contains("crosses itself"),
        "{crossing}"
    );
    // A loop in the path; a path through its own closing disc; one that retraces itself.
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
        Err(RevolveError::SelfCrossing { .. })
    ));
    assert!(matches!(
        Meridian::new(&[[0.0, 1.0], [-1.0, 0.5], [3.0, 0.2]]),
        Err(RevolveError::SelfCrossing { .. })
    ));
    let back = [[0.0, 1.0], [2.0, 1.0], [1.0, 1.0], [1.0, 0.5], [3.0, 0.0]];
    assert!(matches!(
        Meridian::new(&back),
        Err(RevolveError::SelfCrossing { .. })
    ));
    // Parts that overlap and meet on the axis only: a cone within the rest; two that end at one point and cross.
    let cone_within = [[0.0, 1.0], [1.0, 0.0], [-2.0, 0.0], [-2.0, 4.0], [5.0, 2.0]];
    let crossed = [[0.0, 0.0], [0.4, 2.0], [0.6, 6.0], [0.0, 0.0], [4.0, 1.0]];
    for overlapping in [&cone_within[..], &crossed] {
        assert!(matches!(
            Meridian::new(overlapping),
            Err(RevolveError::SelfCrossing { .. })
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
    // An edge that turns back at an angle below rounding.
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
        Err(RevolveError::SelfCrossing { .. })
    ));
    assert!(matches!(
        Meridian::ring(&[[0.0, 1.0], [1.0, 1.0]]),
        Err(RevolveError::TooFew { least: 3, .. })
    ));
    assert!(matches!(
        Meridian::from_full_curve(&[[0.0, -1.0], [1.0, 1.0]]),
        Err(RevolveError::NegativeRadius { .. })
    ));
    assert!(matches!(
        Meridian::from_full_curve(&[[0.0, 1.0], [1.0, f64::NAN]]),
        Err(RevolveError::NotFinitePoint { .. })
    ));
    // Sizes whose volume is not a number.
    for size in [1e-200, 1e-101, 1e101, 1e200] {
        match Meridian::new(&[[0.0, size], [size, size]]) {
            Err(RevolveError::OutOfRange {
                given, least, most, ..
            }) => {
                assert_eq!((given, least, most), (size, 1e-100, 1e100));
            }
            other => panic!("{other:?}"),
        }
    }
    for size in [1e-99, 1e99] {
        assert!(Meridian::new(&[[0.0, size], [size, size]]).is_ok());
    }
    // The order from apex to base is inverted.
    let a = Meridian::new(&[[3.0, 0.0], [0.0, 1.0]]).unwrap();
    assert_eq!(a, Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap());
}

#[test]
fn poses_rays_grids_detectors() {
    let nan = f64::NAN;
    let not_finite = |error: Option<RevolveError>| {
        assert!(
            matches!(error, Some(RevolveError::NotFinite { .. })),
            "{error:?}"
        );
    };
    let not_positive = |error: Option<RevolveError>| {
        assert!(
            matches!(error, Some(RevolveError::NotPositive { .. })),
            "{error:?}"
        );
    };
    not_finite(Pose::axis_along_z(nan).err());
    not_finite(Pose::identity().rotated_x(f64::INFINITY).err());
    let shift = Vector3::new(0.0, nan, 0.0);
    not_finite(Pose::identity().shifted(shift).err());
    not_finite(Pose::new(Isometry3::translation(nan, 0.0, 0.0)).err());
    let zero = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0));
    not_positive(Pose::new(Isometry3::from_parts(Vector3::zeros().into(), zero)).err());
    let nowhere = Ray::new(Point3::origin(), Vector3::zeros());
    assert_eq!(nowhere, Err(RevolveError::NoDirection));
    not_finite(Ray::new(Point3::new(nan, 0.0, 0.0), Vector3::x()).err());
    assert!(Ray::new(Point3::origin(), Vector3::new(1e-300, 0.0, 0.0)).is_ok());
    assert!(Ray::new(Point3::origin(), Vector3::new(1e300, 1e300, 0.0)).is_ok());
    assert_says(
        VoxelGrid::cube(0, 1.0),
        "voxels: 0 given, at least 1 needed",
    );
    not_positive(VoxelGrid::cube(4, -1.0).err());
    not_finite(VoxelGrid::new([1; 3], [1.0; 3], [nan; 3]).err());
    assert_says(
        ParallelDetector::new(0, 4, [1.0; 2]),
        "rays of a view: 0 given, at least 1 needed",
    );
    not_positive(ParallelDetector::new(4, 4, [1.0, 0.0]).err());
    let detector = ParallelDetector::new(4, 4, [1.0; 2]).unwrap();
    not_finite(detector.with_offset([nan, 0.0]).err());
    not_finite(detector.rays(nan).err());
    // Degrees; twelve turns of a view and two of a pose are valid.
    let quarter = "must be from -76.0 to 76.0, got 90.0";
    assert_says(
        detector.rays(90.0),
        &format!("view angle (radians) {quarter}"),
    );
    let out_of_range = |error: Option<RevolveError>| {
        assert!(
            matches!(error, Some(RevolveError::OutOfRange { .. })),
            "{error:?}"
        );
    };
    out_of_range(detector.rays(-1e300).err());
    let turn = std::f64::consts::TAU;
    for turns in [-12.0, 12.0] {
        assert!(detector.rays(turns * turn).is_ok());
    }
    type Rotation = fn(Pose, f64) -> Result<Pose, RevolveError>;
    for rotated in [
        Pose::rotated_x as Rotation,
        Pose::rotated_y,
        Pose::rotated_z,
    ] {
        for angle in [45.0, 90.0, -13.0, 1e300] {
            out_of_range(rotated(Pose::identity(), angle).err());
        }
        assert!(
            [-2.0, 2.0]
                .iter()
                .all(|turns| rotated(Pose::identity(), turns * turn).is_ok())
        );
    }
    let x = Vector3::x();
    let no_bins = Lines::parallel([0, 1], Point3::origin(), x, x, x);
    assert!(matches!(
        no_bins,
        Err(RevolveError::TooFew { given: 0, .. })
    ));
    not_finite(Lines::parallel([1, 1], Point3::origin(), x * nan, x, x).err());
    let nowhere = Lines::parallel([1, 1], Point3::origin(), x, x, x * 0.0);
    assert_eq!(nowhere.err(), Some(RevolveError::NoDirection));
}

/// Counts are rejected as counts.
#[track_caller]
fn assert_says<T: std::fmt::Debug>(refused: Result<T, RevolveError>, message: &str) {
    assert_eq!(refused.unwrap_err().to_string(), message);
}

#[test]
fn bodies_and_batches() {
    assert_says(
        Body::new(vec![], Pose::identity()),
        "layers of a body: 0 given, at least 1 needed",
    );
    let body = heart(20);
    let rays = ParallelDetector::new(4, 4, [1.0; 2])
        .unwrap()
        .rays(0.0)
        .unwrap();
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0]),
        Err(RevolveError::WrongLength {
            expected: 2,
            given: 1,
            ..
        })
    ));
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0, f64::NAN]),
        Err(RevolveError::NotFinite { .. })
    ));
    let mut short = vec![0.0f32; 15];
    assert!(matches!(
        body.project_add(&rays, &[1.0; 2], 1.0, &mut short),
        Err(RevolveError::WrongLength {
            expected: 16,
            given: 15,
            ..
        })
    ));
    assert!(matches!(
        body.project_add(&rays, &[1.0; 2], f64::NAN, &mut [0.0f32; 16]),
        Err(RevolveError::NotFinite { .. })
    ));
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    let voxels = |slices, tolerance, n| {
        voxelize_add(
            &body,
            &grid,
            slices,
            tolerance,
            &[1.0; 2],
            &mut vec![0.0f32; n],
        )
    };
    assert!(matches!(
        voxels(0..3, 0.01, 12),
        Err(RevolveError::BadRange { .. })
    ));
    assert!(matches!(
        voxels(0..2, 0.01, 7),
        Err(RevolveError::WrongLength { .. })
    ));
    assert!(matches!(
        voxels(0..2, 0.0, 8),
        Err(RevolveError::NotPositive { .. })
    ));
    assert_says(
        voxels(0..2, 5.0, 8),
        "tolerance must be from 0.0 to 1.0, got 5.0",
    );
    let widest = body.layers()[0].r_max();
    assert!(body.mesh(0, widest).is_ok());
    let coarse = body.mesh(0, 1.01 * widest);
    assert!(
        matches!(coarse, Err(RevolveError::OutOfRange { most, .. }) if most == widest),
        "{coarse:?}"
    );
    assert!(voxels(2..2, 0.01, 0).is_ok());
    assert!(matches!(
        body.mesh(0, -1.0),
        Err(RevolveError::NotPositive { .. })
    ));
    assert!(matches!(
        body.mesh(0, 1e-30),
        Err(RevolveError::TooFine { .. })
    ));
}

#[test]
fn layers_that_are_not_nested_are_reported() {
    let cylinder = |r: f64| Meridian::new(&[[0.0, r], [2.0, r]]).unwrap();
    // The outer layer first.
    let found = Body::new(vec![cylinder(2.0), cylinder(1.5)], Pose::identity());
    assert!(
        matches!(found, Err(RevolveError::NotNested { layer: 0, depth, .. }) if (depth - 0.5).abs() < 1e-12)
    );
    // In the right order, and not nested.
    let long = Meridian::new(&[[0.0, 1.0], [3.0, 1.0]]).unwrap();
    let found = Body::nested(vec![long, cylinder(1.5)], Pose::identity(), 1e-9);
    assert!(
        matches!(found, Err(RevolveError::NotNested { layer: 0, depth, .. }) if (depth - 1.0).abs() < 1e-12)
    );
}

#[test]
fn nested_layers_begin_with_the_innermost() {
    let cylinder = |r: f64| Meridian::new(&[[0.0, r], [2.0, r]]).unwrap();
    let nested = |radii: &[f64], tolerance| {
        let layers = radii.iter().map(|&r| cylinder(r)).collect();
        Body::nested(layers, Pose::identity(), tolerance)
    };
    let body = nested(&[1.0, 1.5, 2.0], 0.0).unwrap();
    assert_eq!(
        body,
        Body::new(body.layers().to_vec(), Pose::default()).unwrap()
    );
    // The walls have the areas of rings.
    for (region, area) in [(0, 1.0), (1, 1.25), (2, 1.75)] {
        let volume = body.region_measures(region).unwrap().volume;
        assert!((volume - 2.0 * area * std::f64::consts::PI).abs() < 1e-12);
    }
    for (radii, wrong, expected) in [
        (&[2.0, 1.0][..], 0, 1.0),
        (&[2.0, 1.5, 1.0], 0, 0.5),
        (&[1.0, 2.0, 1.5], 1, 0.5),
    ] {
        let found = nested(radii, 1e-9);
        assert!(
            matches!(found, Err(RevolveError::NotNested { layer, depth, .. })
                if layer == wrong && (depth - expected).abs() < 1e-12),
            "{radii:?}: {found:?}"
        );
    }
    // To within the tolerance: the inner layer is longer.
    let long = Meridian::new(&[[-0.1, 0.9], [2.0, 0.9]]).unwrap();
    let layers = || vec![long.clone(), cylinder(1.0)];
    assert!(Body::nested(layers(), Pose::identity(), 0.2).is_ok());
    assert!(Body::nested(layers(), Pose::identity(), 0.05).is_err());
    assert!(matches!(nested(&[], 0.0), Err(RevolveError::TooFew { .. })));
    let negative = nested(&[1.0, 2.0], -1.0).unwrap_err().to_string();
    assert_eq!(negative, "tolerance must be from 0.0 to 1.0, got -1.0");
    let coarse = nested(&[1.0, 2.0], 1e6);
    assert!(matches!(
        coarse,
        Err(RevolveError::OutOfRange { most: 1.0, .. })
    ));
    for bad in [f64::NAN, f64::INFINITY] {
        let refused = nested(&[1.0, 2.0], bad);
        assert!(matches!(refused, Err(RevolveError::NotFinite { .. })));
    }
}

#[test]
fn sizes_beyond_memory_are_rejected() {
    let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap();
    let body = Body::new(vec![cone], Pose::axis_along_z(1.0).unwrap()).unwrap();
    for n in [usize::MAX, 1 << 32] {
        assert!(matches!(
            VoxelGrid::cube(n, 1.0),
            Err(RevolveError::TooLarge { .. })
        ));
        assert!(matches!(
            ParallelDetector::new(n, n, [1.0; 2]),
            Err(RevolveError::TooLarge { .. })
        ));
    }
    // Countable, but no amount of memory.
    let grid = VoxelGrid::cube(1 << 19, 1.0).unwrap();
    let volume = body.voxelize::<f32>(&grid, 0.01, &[1.0]);
    assert!(matches!(volume, Err(RevolveError::TooLarge { .. })));
    let rays = ParallelDetector::new(1 << 28, 1 << 29, [1.0; 2])
        .unwrap()
        .rays(0.0)
        .unwrap();
    assert!(matches!(
        body.project::<f32>(&rays, &[1.0]),
        Err(RevolveError::TooLarge { .. })
    ));
}

#[test]
fn a_missing_layer_is_an_error() {
    let body = Body::new(
        vec![Meridian::new(&[[0.0, 1.0], [1.0, 1.0]]).unwrap()],
        Pose::identity(),
    )
    .unwrap();
    let ray = Ray::new(Point3::new(0.5, -3.0, 0.0), Vector3::y()).unwrap();
    assert!((body.chord(0, &ray).unwrap() - 2.0).abs() < 1e-14);
    for absent in [1, usize::MAX] {
        let origin = Point3::origin();
        for error in [
            body.chord(absent, &ray).unwrap_err(),
            body.spans(absent, &ray).unwrap_err(),
            body.bounding_box(absent).unwrap_err(),
            body.signed_distance(absent, &origin).unwrap_err(),
            body.region_measures(absent).unwrap_err(),
            body.mesh(absent, 0.1).unwrap_err(),
        ] {
            let (given, layers) = (absent, 1);
            assert_eq!(error, RevolveError::NoSuchLayer { given, layers });
        }
    }
}

fn cylinder() -> Body {
    let rod = Meridian::new(&[[0.0, 1.0], [1.0, 1.0]]).unwrap();
    Body::new(vec![rod], Pose::identity()).unwrap()
}

/// Two points on the axis as curves: an empty wall of the smallest degree.
#[test]
fn a_wall_of_constants_on_the_axis_has_no_volume() {
    let point = |x: f64| {
        let piece = Piece::Power {
            x: vec![x],
            r: vec![0.0],
        };
        Curve::new(vec![0.0, 1.0], vec![piece]).unwrap()
    };
    assert!(matches!(
        Shell::new(point(0.0), point(1.0), [0.0, 1.0]),
        Err(RevolveError::NotPositive { .. } | RevolveError::NotFinite { .. })
    ));
}

/// Tolerances below rounding are rejected: they would need a million sections of each voxel that the surface cuts.
#[test]
fn a_tiny_tolerance_costs_no_more_than_rounding() {
    let rod = Meridian::new(&[[0.0, 1.0], [2.0, 0.6]]).unwrap();
    let pose = Pose::axis_along_z(1.0).and_then(|p| p.rotated_x(0.5));
    let body = Body::new(vec![rod], pose.unwrap()).unwrap();
    let grid = VoxelGrid::cube(4, 0.8).unwrap();
    let fill = |tolerance| body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
    let ((fine, work), (finest, most)) = (fill(1e-12), fill(5e-324));
    assert!(fine.iter().zip(&finest).all(|(a, b)| (a - b).abs() < 2e-12));
    let ratio = most.evaluations as f64 / work.evaluations as f64;
    assert!(ratio < 100.0, "{ratio} times the work");
}

/// Two discs nearer to each other than rounding: distances cannot distinguish the sides of the sheet between them. Voxels of such a meridian would
/// have a fifth more volume than its closed form.
#[test]
fn faces_closer_than_rounding_are_rejected() {
    let meridian = |gap: f64, size: f64| {
        let points = [[0.0, 0.5], [0.0, 1.3], [0.9, 0.6], [gap, 1.2]];
        Meridian::new(&points.map(|p| p.map(|v| v * size)))
    };
    for size in [1e-3, 1.0, 1e6] {
        for gap in [1e-200, 1e-17, 1e-15] {
            assert!(matches!(
                meridian(gap, size),
                Err(RevolveError::SelfCrossing { .. })
            ));
        }
        // Farther apart they are two sheets, and voxels agree with the closed form.
        for gap in [1e-13, 1e-9, 1e-3] {
            let pose = Pose::axis_along_z(0.4 * size).and_then(|p| p.rotated_x(0.7));
            let body = Body::new(vec![meridian(gap, size).unwrap()], pose.unwrap()).unwrap();
            let grid = VoxelGrid::cube(20, 0.15 * size).unwrap();
            let tolerance = 1e-6;
            let (voxels, _) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
            let volume = voxels.iter().sum::<f64>() * grid.voxel_volume();
            let exact = body.layers()[0].mass_properties().volume;
            assert!(
                (volume / exact - 1.0).abs() < 1e-4,
                "{gap:e}: {volume} {exact}"
            );
        }
    }
    // Points nearer to each other than that along the meridian are valid.
    let many = [
        [0.0, 1.0],
        [1.0, 1.0],
        [1.0 + 1e-16, 1.0 - 1e-16],
        [1.0 + 3e-16, 0.9],
        [2.0, 0.5],
    ];
    assert!(Meridian::new(&many).is_ok());
}

#[test]
fn ranges_of_slices_are_checked() {
    let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap();
    let body = Body::new(vec![cone], Pose::identity()).unwrap();
    let grid = VoxelGrid::cube(4, 1.0).unwrap();
    #[allow(clippy::reversed_empty_ranges)]
    for (range, text) in [
        (3..2, "slices 3..2 must be ascending and within 0..4"),
        (2..5, "slices 2..5 must be ascending and within 0..4"),
    ] {
        let mut out = vec![0.0_f64; 64];
        let refused = voxelize_add(&body, &grid, range, 0.01, &[1.0], &mut out);
        assert_eq!(refused.unwrap_err().to_string(), text);
    }
}

#[test]
fn distances_of_nan_are_nan() {
    let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).unwrap();
    for axis in 0..3 {
        let mut p = Point3::new(1.0, 0.1, 0.1);
        p[axis] = f64::NAN;
        assert!(cone.signed_distance(&p).is_nan() && !cone.contains(&p));
    }
}
