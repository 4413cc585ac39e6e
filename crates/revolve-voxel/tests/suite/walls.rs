//! Walls and sectors with closed forms: points on the ends, voxels within the wall, the smallest thickness, derivatives, the edge of a sector.

use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Curve, Meridian, Piece, Pose, Ray, Sector, Shell, VoxelGrid};
use std::f64::consts::PI;

/// A tube of radii 1 and 2 from x = 0 to 3.
fn tube() -> Shell {
    let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [3.0, r]]).unwrap();
    Shell::new(line(1.0), line(2.0), [0.0, 1.0]).unwrap()
}

/// The wall includes its surfaces to 1e-12 of its size, 3 cm.
#[test]
fn points_on_the_surfaces_are_in_the_wall() {
    let wall = tube();
    for (off, is_inside) in [(0.0, true), (1e-12, true), (1e-11, false)] {
        for (p, exact) in [
            ([-off, 1.2], [0.44 / 3.0, 0.0]),
            ([3.0 + off, 1.2], [0.44 / 3.0, 1.0]),
            ([1.5, 1.0 - off], [0.0, 0.5]),
            ([1.5, 2.0 + off], [1.0, 0.5]),
        ] {
            let found = wall.locate(p);
            assert_eq!(found.is_some(), is_inside, "{p:?}");
            for (a, b) in found.iter().flatten().zip(exact) {
                // The fraction of the volume between the radii 1 and 1.2, and rounding.
                assert!((a - b).abs() < 1e-11, "{p:?} {found:?}");
            }
        }
    }
}

/// The rows of the grid begin in the wall, in the cavity or outside, and end in any of them.
#[test]
fn voxels_of_a_grid_within_the_wall_are_found() {
    let wall = tube();
    for (shape, spacing, origin) in [
        ([7, 5, 6], [0.1, 0.12, 0.11], [0.6, 1.1, -0.3]),
        ([5, 7, 6], [0.4, 0.5, 0.3], [0.2, -0.7, 0.4]),
        ([9, 4, 4], [0.3, 0.25, 0.25], [1.0, 0.4, 1.0]),
        ([1, 3, 3], [1.0, 0.1, 0.1], [1.5, 1.2, 0.1]),
    ] {
        let grid = VoxelGrid::new(shape, spacing, origin).unwrap();
        for pose in [Pose::identity(), Pose::axis_along_z(1.5).unwrap()] {
            let pose = pose.rotated_y(0.3).unwrap();
            let inside = |k: &usize| {
                let [x, y, z] = [
                    k % shape[0],
                    k / shape[0] % shape[1],
                    k / shape[0] / shape[1],
                ];
                let p = pose.to_body(&grid.centre(x, y, z));
                (0.0..=3.0).contains(&p.x) && (1.0..=2.0).contains(&p.y.hypot(p.z))
            };
            let exact: Vec<usize> = (0..grid.len()).filter(inside).collect();
            let found = wall
                .map_voxels(&pose, &grid, 0..shape[2], 0.0, |_, _, _| ())
                .unwrap();
            let found: Vec<usize> = found.into_iter().map(|(k, ())| k).collect();
            assert_eq!(found, exact, "{shape:?}");
        }
    }
}

/// About a cylinder of radius 1, a parabola with its smallest distance of 0.5 at x = 3 a, between any samples.
#[test]
fn the_smallest_thickness_is_found_between_samples() {
    for a in [0.3 + 0.001 * PI, 0.55123, 0.777] {
        let piece = |r: Vec<f64>| Piece::Power {
            x: vec![0.0, 3.0],
            r,
        };
        let curve = |r: Vec<f64>| Curve::new(vec![0.0, 1.0], vec![piece(r)]).unwrap();
        let outer = curve(vec![1.5 + 2.0 * a * a, -4.0 * a, 2.0]);
        let wall = Shell::new(curve(vec![1.0]), outer, [0.0, 1.0]).unwrap();
        let all = wall.thicknesses();
        assert!((all.minimum - 0.5).abs() < 1e-14, "{all:?}");
        // Half of the digits at a minimum.
        assert!((all.thinnest_at - a).abs() < 1e-7, "{a} {all:?}");
    }
}

/// The derivatives of a point of a curve of degree five, against central differences.
#[test]
fn derivatives_of_curves_agree_with_differences() {
    let coefficients = [
        vec![0.3, 1.0, -0.4, 0.7, 0.2, -0.3],
        vec![1.0, -0.2, 0.5, -0.9, 0.4, 0.1],
    ];
    let [x, r] = coefficients;
    let power = Piece::Power {
        x: x.clone(),
        r: r.clone(),
    };
    for piece in [power, Piece::Chebyshev { x, r }] {
        let curve = Curve::new(vec![0.5, 2.0], vec![piece]).unwrap();
        let h = 1e-4;
        for s in [0.6, 0.9, 1.3, 1.75, 1.95] {
            let [before, at, after] = [s - h, s, s + h].map(|s| curve.at(s));
            for k in 0..2 {
                let first = (after.position[k] - before.position[k]) / (2.0 * h);
                let second = (after.first[k] - before.first[k]) / (2.0 * h);
                // The third derivatives of either, below 5e3, times h^2 / 6, and rounding over h.
                assert!((at.first[k] - first).abs() < 1e-5, "{s} {at:?}");
                assert!((at.second[k] - second).abs() < 1e-5, "{s} {at:?}");
            }
        }
    }
}

/// A ray from inside the larger part of a cylinder passes through its axis, where it touches the missing quarter.
#[test]
fn a_ray_through_the_edge_of_a_sector_does_not_enter_it_again() {
    let cylinder = Meridian::new(&[[-2.0, 2.0], [2.0, 2.0]]).unwrap();
    let sector = Sector::new(cylinder, [0.0, 1.5 * PI], Pose::identity()).unwrap();
    for d in [
        [0.0, 0.6, 0.8],
        [0.1, 0.6, 0.8],
        [0.0, -1.0, -1.0],
        [0.3, 1.0, 0.2],
    ] {
        // A unit vector whose normalisation changes no digit.
        let unit = |d: Vector3<f64>| Ray::new(Point3::origin(), d).unwrap().direction();
        let d = (0..8).fold(Vector3::from(d), |d, _| unit(d));
        let ray = Ray::new(Point3::from(-d), d).unwrap();
        assert_eq!(ray.direction(), d);
        assert_eq!(sector.first_hit(&ray), None, "{d:?}");
        assert!(sector.chord(&ray) > 3.9);
    }
}
