//! Deformation and strain of the wall, with and without a twist.

use heart_phantom::revolve_voxel::nalgebra::{Matrix3, Point3, Vector3};
use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use heart_phantom::{GreenStrain, MaterialPoint, Twist, Wall};
use membrane_newton::{Discretisation, Membrane, NewtonOptions, Pair, ReferenceShape, Solver};
use proptest::prelude::*;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The study's balloons as polynomials at two gains, in an oblique pose, sliding from the first.
static WALLS: LazyLock<[Wall; 2]> = LazyLock::new(|| {
    let degree = Discretisation::Spectral {
        degree: 16,
        per_piece: 1,
    };
    let solver = |radius| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        Solver::new(&membrane, degree).unwrap()
    };
    let pair = Pair::new(solver(1.75), solver(2.75)).unwrap();
    let pose = Pose::axis_along_z(5.6).unwrap().rotated_x(0.7).unwrap();
    let pose = pose.rotated_y(-0.4).unwrap();
    let of = |gain| {
        let solved = pair.solve_gain(gain, &NewtonOptions::default()).unwrap();
        Wall::new(&solved, pose).unwrap()
    };
    let rest = of(0.0);
    [of(0.6).sliding_from(&rest), rest]
});

fn systole() -> Twist {
    Twist {
        inner_degrees: vec![-3.0, -1.0, 5.0, 12.0],
        outer_degrees: vec![-2.5, 8.0],
    }
}

/// End-diastole, and end-systole with a twist.
fn beat() -> [Wall; 2] {
    let [diastole, rest] = WALLS.clone();
    [diastole, rest.twisted(systole())]
}

fn at(layer: f64, s: f64, azimuth: f64) -> MaterialPoint {
    MaterialPoint { layer, s, azimuth }
}

/// F in the lab by differences of positions of fourth order, independent of tangents.
fn by_differences(from: &Wall, to: &Wall, point: &MaterialPoint) -> Matrix3<f64> {
    let (p, h) = (from.position(point).unwrap(), 1e-3);
    let carried = |p: Point3<f64>| to.position(&from.locate(&p).unwrap()).unwrap();
    let columns = [0, 1, 2].map(|k| {
        let mut e = Vector3::zeros();
        e[k] = h;
        let wide = carried(p + 2.0 * e) - carried(p - 2.0 * e);
        (8.0 * (carried(p + e) - carried(p - e)) - wide) / (12.0 * h)
    });
    Matrix3::from_columns(&columns)
}

/// Directions of the wall in the lab by differences of positions: across the layer, around the axis, along the layer.
fn directions(wall: &Wall, point: &MaterialPoint) -> [Vector3<f64>; 3] {
    let h = 1e-6;
    let way = |from: MaterialPoint, to: MaterialPoint| {
        (wall.position(&to).unwrap() - wall.position(&from).unwrap()).normalize()
    };
    let (s, azimuth) = (point.s, point.azimuth);
    let round = way(
        at(point.layer, s, azimuth - h),
        at(point.layer, s, azimuth + h),
    );
    let along = way(
        at(point.layer, s - h, azimuth),
        at(point.layer, s + h, azimuth),
    );
    [round.cross(&along), round, along]
}

#[test]
fn strain_agrees_with_finite_differences() {
    let [from, to] = beat();
    // Between the kinks of the twist, at s = 1/6 and 1/3.
    for (layer, s) in [
        (0.3, 0.1),
        (0.5, 0.23),
        (0.2, 0.4),
        (0.8, 0.46),
        (0.6, 0.05),
    ] {
        let point = at(layer, s, 0.6);
        let f = by_differences(&from, &to, &point);
        let e = (f.tr_mul(&f) - Matrix3::identity()) * 0.5;
        let [n, c, l] = directions(&from, &point);
        let part = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(e * b));
        let expected = [
            part(&n, &n),
            part(&c, &c),
            part(&l, &l),
            part(&n, &c),
            part(&n, &l),
            part(&c, &l),
        ];
        let deformation = from.deformation(&to, &point).unwrap();
        let found = deformation.strain();
        for (k, (a, b)) in found.components().iter().zip(expected).enumerate() {
            // h^4 of differences and 1e-6 of the directions' own.
            let name = GreenStrain::NAMES[k];
            assert!((a - b).abs() < 1e-6, "{name} at {layer} {s}: {a} {b}");
        }
        assert!((deformation.gradient.determinant() - f.determinant()).abs() < 1e-6);
        assert!((f.determinant() - 1.0).abs() < 1e-6);
        // The wall thickens, and its circles shrink; torsion shears.
        assert!(found.radial > 0.05 && found.circumferential < -0.01);
        assert!(found.circumferential_longitudinal.abs() > 1e-3);
    }
}

#[test]
fn a_twisted_cylinder_has_the_shear_of_torsion() {
    // For a pure twist F = 1 + e_c g^T with g = r grad tau, so that E has a closed form. Along a layer of a cylinder, as in the reference
    // configuration of the study, g is r times the twist per cm.
    let rest = &WALLS[1];
    let degrees = 10.0;
    let twisted = rest.clone().twisted(Twist {
        inner_degrees: vec![0.0, degrees],
        outer_degrees: vec![0.0, degrees],
    });
    let point = at(0.5, 0.1, 2.0);
    let (h, e) = (1e-3, rest.deformation(&twisted, &point).unwrap().strain());
    let place = |s| rest.position(&at(0.5, s, 2.0)).unwrap();
    let length = (place(0.1 + h) - place(0.1 - h)).norm();
    let across = rest.position(&at(0.5, 0.1, 2.0 + PI)).unwrap() - place(0.1);
    let rate = degrees.to_radians() * 2.0 * h / 0.5 / length;
    let shear = 0.5 * across.norm() * rate;
    assert!((e.circumferential_longitudinal - 0.5 * shear).abs() < 1e-9);
    assert!((e.longitudinal - 0.5 * shear * shear).abs() < 1e-9);
    // Lines of equal s lean, and with them the twist has a slope across the wall.
    let [rc, cl] = [e.radial_circumferential, e.circumferential_longitudinal];
    assert!(rc.abs() > 1e-3);
    for (found, expected) in [
        (e.radial, 2.0 * rc * rc),
        (e.longitudinal, 2.0 * cl * cl),
        (e.radial_longitudinal, 2.0 * rc * cl),
        (e.circumferential, 0.0),
    ] {
        assert!((found - expected).abs() < 1e-12, "{e:?}");
    }
}

#[test]
fn a_zero_twist_is_bitwise_identical_to_none() {
    let [from, to] = WALLS.clone();
    let none = Twist {
        inner_degrees: vec![0.0; 2],
        outer_degrees: vec![0.0; 2],
    };
    let still = [from.clone(), to.clone()].map(|wall| wall.twisted(none.clone()));
    let grid = VoxelGrid::cube(20, 0.7).unwrap();
    let moved = from.displacements(&to, &grid, 0..20).unwrap();
    assert!(moved.len() > 200);
    assert_eq!(
        moved,
        still[0].displacements(&still[1], &grid, 0..20).unwrap()
    );
    let strained = from.strains(&to, &grid, 0..20).unwrap();
    assert_eq!(strained, still[0].strains(&still[1], &grid, 0..20).unwrap());
    assert_eq!(moved.len(), strained.len());
}

#[test]
fn maps_of_voxels_equal_those_of_their_points() {
    let [from, to] = beat();
    let grid = VoxelGrid::cube(24, 0.6).unwrap();
    let moved = from.displacements(&to, &grid, 0..24).unwrap();
    let strained = from.strains(&to, &grid, 0..24).unwrap();
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    assert_eq!(
        strained,
        one.install(|| from.strains(&to, &grid, 0..24)).unwrap()
    );
    let (mut far, mut shear) = (0.0f64, 0.0f64);
    for ((k, way), (other, strain)) in moved.iter().zip(&strained) {
        assert_eq!(k, other);
        let p = grid.centre(k % 24, k / 24 % 24, k / 576);
        let point = from.locate(&p).unwrap();
        let exact = to.position(&point).unwrap() - p;
        let e = from.deformation(&to, &point).unwrap().strain().components();
        for a in 0..3 {
            assert!((exact[a] - f64::from(way[a])).abs() < 1e-6);
        }
        for (a, b) in e.iter().zip(strain) {
            assert!(
                (a - f64::from(*b)).abs() < 1e-6 * (1.0 + a.abs()),
                "{point:?} {e:?}"
            );
        }
        far = far.max(Vector3::from(exact).norm());
        shear = shear.max(e[5].abs());
    }
    println!("at most {far} cm, torsion {shear}");
    assert!(far > 0.5 && shear > 0.02);
}

proptest! {
    #[test]
    fn inverse_deformations_cancel(layer in 0.0..=1.0f64, s in 0.0..=0.5f64, azimuth in -PI..PI) {
        let [from, to] = beat();
        let p = from.position(&at(layer, s, azimuth)).unwrap();
        let there = to.position(&from.locate(&p).unwrap()).unwrap();
        let back = from.position(&to.locate(&there).unwrap()).unwrap();
        prop_assert!((back - p).norm() < 1e-10, "{} {}", p, back);
    }

    #[test]
    fn water_does_not_compress(layer in 0.0..=1.0f64, s in 0.0..=0.5f64, azimuth in -PI..PI) {
        let [from, to] = beat();
        let volume = from.deformation(&to, &at(layer, s, azimuth)).unwrap().gradient.determinant();
        prop_assert!((volume - 1.0).abs() < 1e-12, "{}", volume - 1.0);
    }
}
