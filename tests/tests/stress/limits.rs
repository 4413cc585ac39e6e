//! Limits: NaN and infinity in every argument, sizes beyond any memory, folders without write permission, a process that is killed while it
//! writes.

mod processes;

use heart_phantom::files::{self, Format, Volume, write_npy};
use heart_phantom::{MaterialPoint, PhantomError, Wall};
use membrane_forces::{Membrane, MembraneError, ReferenceShape, Stiffness};
use membrane_newton::{Control, Discretisation, NewtonError, NewtonOptions, Pair, Solver};
use nalgebra::{Point3, Vector3};
use radon::{CountScale, ImageGrid, ParallelGeometry, RadonError, poisson_counts};
use revolve_voxel::{
    Assembly, Body, Curve, Lines, Meridian, OrganShape, Organs, ParallelDetector, Piece, Pose, Ray,
    RevolveError, Sector, Shell, VoxelGrid,
};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

fn body() -> Body {
    let cone = Meridian::new(&[[0.0, 1.0], [3.0, 0.0]]).expect("a cone");
    Body::new(vec![cone], Pose::axis_along_z(1.0).expect("a place")).expect("a body")
}

fn pair() -> Pair {
    let solver = |radius| {
        let rest = ReferenceShape::balloon(8.5, radius).expect("a balloon");
        Solver::new(
            &Membrane::new(rest),
            Discretisation::FiniteDifferences { nodes: 21 },
        )
        .expect("nodes enough")
    };
    Pair::new(solver(1.75), solver(2.75)).expect("a wall")
}

fn forces(error: MembraneError) -> bool {
    use MembraneError::*;
    matches!(error, OutOfRange { .. } | BadProfile { .. })
}

fn newton(error: NewtonError) -> bool {
    matches!(error, NewtonError::Membrane(error) if forces(error))
}

fn solid(error: RevolveError) -> bool {
    use RevolveError::*;
    matches!(error, NotFinite { .. } | NotFinitePoint { .. })
}

fn slices(error: RadonError) -> bool {
    use RadonError::*;
    matches!(error, NotFinite { .. } | BadSample { .. })
}

fn heart(error: PhantomError) -> bool {
    match error {
        PhantomError::Solid(error) => solid(error),
        error => matches!(error, PhantomError::OutOfRange { .. }),
    }
}

#[test]
fn nan_and_infinity_are_rejected_everywhere() {
    let (body, pair) = (body(), pair());
    let pose = Pose::axis_along_z(1.0).expect("a place");
    let options = NewtonOptions::default();
    let rays = ParallelDetector::new(2, 2, [1.0; 2])
        .and_then(|detector| detector.rays(0.0))
        .expect("rays");
    let grid = VoxelGrid::cube(2, 1.0).expect("a grid");
    let wall = Wall::new(&pair.solve_gain(0.1, &options).expect("a shape"), pose).expect("a wall");
    let ring = || Meridian::ring(&[[0.0, 1.0], [0.0, 2.0], [1.0, 2.0]]).expect("a ring");
    let sector = Sector::new(ring(), [0.0, 1.0], pose).expect("a sector");
    let geometry = ParallelGeometry::arc_radians(2, 3.0, 4, 1.0).expect("a geometry");
    let at = |layer, s, azimuth| wall.position(&MaterialPoint { layer, s, azimuth });
    let line = |x: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, 1.0], [1.0, x]]);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let one = &mut [0.0_f64; 4];
        let entries = [
            // membrane-forces, membrane-newton
            (
                "length of a balloon",
                ReferenceShape::balloon(bad, 1.0).err().is_some_and(forces),
            ),
            (
                "radius of a balloon",
                ReferenceShape::balloon(1.0, bad).err().is_some_and(forces),
            ),
            (
                "stiffness",
                Stiffness::constant(bad).err().is_some_and(forces),
            ),
            (
                "stiffness samples",
                Stiffness::samples(&[1.0, bad]).err().is_some_and(forces),
            ),
            (
                "volume gain",
                pair.solve_gain(bad, &options).err().is_some_and(newton),
            ),
            (
                "load",
                pair.solve(Control::Load(bad), &options)
                    .err()
                    .is_some_and(newton),
            ),
            (
                "volume",
                pair.solve(Control::Volume(bad), &options)
                    .err()
                    .is_some_and(newton),
            ),
            (
                "intensity",
                pair.solve(Control::Intensity(bad), &options)
                    .err()
                    .is_some_and(newton),
            ),
            // revolve-voxel
            (
                "profile x",
                Meridian::new(&[[0.0, 1.0], [bad, 0.0]])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "profile r",
                Meridian::new(&[[0.0, bad], [1.0, 0.0]])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "ring",
                Meridian::ring(&[[0.0, 1.0], [bad, 2.0], [1.0, 2.0]])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "full curve",
                Meridian::from_full_curve(&[[0.0, 1.0], [bad, 0.0], [0.0, -1.0]])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "piece",
                Meridian::smooth(
                    &[Piece::Power {
                        x: vec![bad],
                        r: vec![1.0],
                    }],
                    0.1,
                )
                .err()
                .is_some_and(solid),
            ),
            (
                "tolerance of a piece",
                Meridian::smooth(
                    &[Piece::Power {
                        x: vec![0.0, 1.0],
                        r: vec![1.0],
                    }],
                    bad,
                )
                .err()
                .is_some_and(solid),
            ),
            ("curve", line(bad).err().is_some_and(solid)),
            (
                "range of a shell",
                line(1.0)
                    .and_then(|c| Shell::new(c.clone(), c, [0.0, bad]))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "axial point",
                Pose::axis_along_z(bad).err().is_some_and(solid),
            ),
            (
                "turn",
                pose.rotated_x(bad).err().is_some_and(solid)
                    && pose.rotated_y(bad).err().is_some_and(solid)
                    && pose.rotated_z(bad).err().is_some_and(solid),
            ),
            (
                "shift",
                pose.shifted(Vector3::new(0.0, bad, 0.0))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "ray origin",
                Ray::new(Point3::new(bad, 0.0, 0.0), Vector3::x())
                    .err()
                    .is_some_and(solid),
            ),
            (
                "ray direction",
                Ray::new(Point3::origin(), Vector3::new(0.0, bad, 1.0))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "raster",
                Lines::parallel(
                    [2; 2],
                    Point3::origin(),
                    Vector3::x() * bad,
                    Vector3::y(),
                    Vector3::z(),
                )
                .err()
                .is_some_and(solid),
            ),
            (
                "bin pitch",
                ParallelDetector::new(2, 2, [bad, 1.0])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "row pitch",
                ParallelDetector::new(2, 2, [1.0, bad])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "view angle",
                ParallelDetector::new(2, 2, [1.0; 2])
                    .and_then(|d| d.rays(bad))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "detector offset",
                ParallelDetector::new(2, 2, [1.0; 2])
                    .and_then(|d| d.with_offset([0.0, bad]))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "spacing",
                VoxelGrid::new([2; 3], [1.0, bad, 1.0], [0.0; 3])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "grid origin",
                VoxelGrid::new([2; 3], [1.0; 3], [0.0, 0.0, bad])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "activity",
                body.project::<f32>(&rays, &[bad]).err().is_some_and(solid),
            ),
            (
                "weight",
                body.project_add(&rays, &[1.0], bad, one)
                    .err()
                    .is_some_and(solid),
            ),
            (
                "voxel activity",
                body.voxelize::<f32>(&grid, 0.01, &[bad])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "coverage",
                body.voxelize::<f32>(&grid, bad, &[1.0])
                    .err()
                    .is_some_and(solid),
            ),
            (
                "attenuation",
                Assembly::new(&Organs::default())
                    .with_body(&body, &[1.0], Some(bad))
                    .err()
                    .is_some_and(solid),
            ),
            (
                "torso",
                OrganShape::cylinder([0.0, bad], [1.0; 2])
                    .err()
                    .is_some_and(solid)
                    && OrganShape::cylinder([0.0; 2], [bad, 1.0])
                        .err()
                        .is_some_and(solid),
            ),
            (
                "azimuth",
                Sector::new(ring(), [0.0, bad], pose)
                    .err()
                    .is_some_and(solid)
                    && Sector::new(ring(), [bad, 1.0], pose)
                        .err()
                        .is_some_and(solid),
            ),
            (
                "sector activity",
                sector.project_add(&rays, bad, one).err().is_some_and(solid),
            ),
            // radon
            (
                "arc",
                ParallelGeometry::arc_radians(2, bad, 4, 1.0)
                    .err()
                    .is_some_and(slices),
            ),
            (
                "pitch",
                ParallelGeometry::arc_radians(2, 1.0, 4, bad)
                    .err()
                    .is_some_and(slices),
            ),
            ("pixel", ImageGrid::square(4, bad).err().is_some_and(slices)),
            (
                "mean counts",
                poisson_counts(&[1.0, bad], CountScale::PerUnit(1.0), 0)
                    .err()
                    .is_some_and(slices),
            ),
            (
                "count scale",
                poisson_counts(&[1.0], CountScale::PerUnit(bad), 0)
                    .err()
                    .is_some_and(slices),
            ),
            (
                "total counts",
                poisson_counts(&[1.0], CountScale::Total(bad), 0)
                    .err()
                    .is_some_and(slices),
            ),
            // heart-phantom
            ("layer", at(bad, 0.1, 0.0).err().is_some_and(heart)),
            ("s", at(0.5, bad, 0.0).err().is_some_and(heart)),
            (
                "azimuth of a point",
                at(0.5, 0.1, bad).err().is_some_and(heart),
            ),
            (
                "tolerance of a region",
                wall.region([0.0, 1.0], [0.0, 0.5], bad)
                    .err()
                    .is_some_and(heart)
                    || bad == f64::INFINITY,
            ),
            (
                "sample of a volume",
                Volume::new(grid, [bad as f32; 8].as_slice())
                    .err()
                    .is_some_and(heart),
            ),
        ];
        for (entry, refused) in entries {
            assert!(refused, "{bad} was accepted as {entry}");
        }
        assert!(wall.locate(&Point3::new(0.0, bad, 0.0)).is_none());
        assert!(geometry.n_views() == 2);
    }
}

#[test]
fn sizes_beyond_memory_are_rejected_before_any_allocation() {
    let body = body();
    // Counts whose product overflows, and one that exceeds any memory.
    for n in [usize::MAX, 1 << 32, 1 << 21] {
        let many = |error: RevolveError| matches!(error, RevolveError::TooLarge { .. });
        assert!(VoxelGrid::cube(n, 1.0).err().is_some_and(many), "{n}");
        let detector = ParallelDetector::new(n, n, [1.0; 2]);
        let seen = detector
            .and_then(|detector| detector.rays(0.0))
            .and_then(|rays| body.project::<f64>(&rays, &[1.0]));
        assert!(seen.err().is_some_and(many), "{n} x {n} bins");
    }
    let grid = VoxelGrid::new([1 << 19, 1 << 19, 1 << 19], [1.0; 3], [0.0; 3]).expect("countable");
    assert!(matches!(
        body.voxelize::<f32>(&grid, 0.01, &[1.0]),
        Err(RevolveError::TooLarge { .. })
    ));
    assert!(matches!(
        body.regions::<f32>(&grid, 0..1 << 19, 0.01),
        Err(RevolveError::TooLarge { .. })
    ));
    let huge = usize::MAX;
    for refused in [
        ParallelGeometry::arc_radians(huge, 1.0, huge, 1.0).err(),
        ImageGrid::square(huge, 1.0).err(),
    ] {
        assert!(
            matches!(refused, Some(RadonError::TooLarge { .. })),
            "{refused:?}"
        );
    }
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).expect("a balloon"));
    for discretisation in [
        Discretisation::FiniteDifferences { nodes: huge },
        Discretisation::FiniteDifferences { nodes: 1 << 40 },
        Discretisation::Spectral {
            degree: huge,
            per_piece: 1,
        },
        Discretisation::Spectral {
            degree: 1 << 20,
            per_piece: 1,
        },
        Discretisation::Spectral {
            degree: 8,
            per_piece: huge,
        },
        Discretisation::Spectral {
            degree: 8,
            per_piece: 1 << 32,
        },
    ] {
        let refused = Solver::new(&membrane, discretisation).err();
        assert!(
            matches!(
                refused,
                Some(NewtonError::Membrane(MembraneError::TooMany { .. }))
            ),
            "{discretisation:?}: {refused:?}"
        );
    }
}
