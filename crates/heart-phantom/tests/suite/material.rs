//! The wall as a material: conservation, inverse, stretches against finite differences.

use heart_phantom::{Defect, Heart, MaterialPoint, PhantomError, Wall};
use membrane_newton::{
    Discretisation, Membrane, NewtonOptions, Pair, PairEquilibrium, ReferenceShape, Solver,
};
use proptest::prelude::*;
use revolve_voxel::{Pose, RevolveError, VoxelGrid};
use std::f64::consts::PI;
use std::sync::LazyLock;

const GAINS: [f64; 3] = [0.0, 0.3, 0.6];

fn pose() -> Pose {
    Pose::axis_along_z(5.0)
        .unwrap()
        .rotated_x(0.7)
        .unwrap()
        .rotated_y(0.4)
        .unwrap()
}

/// The study's balloons at three phases, as polynomials.
static SMOOTH: LazyLock<Vec<PairEquilibrium>> = LazyLock::new(|| {
    let solver = |radius| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        Solver::new(
            &membrane,
            Discretisation::Spectral {
                degree: 18,
                per_piece: 2,
            },
        )
        .unwrap()
    };
    let pair = Pair::new(solver(1.75), solver(2.75)).unwrap();
    GAINS
        .map(|gain| pair.solve_gain(gain, &NewtonOptions::default()).unwrap())
        .to_vec()
});

static TIED: LazyLock<Vec<Wall>> = LazyLock::new(|| {
    let wall = |pair| Wall::new(pair, pose()).unwrap();
    SMOOTH.iter().map(wall).collect()
});

static SLIDING: LazyLock<Vec<Wall>> = LazyLock::new(|| {
    let slide = |wall: &Wall| wall.clone().sliding_from(&TIED[0]);
    TIED.iter().map(slide).collect()
});

fn at(layer: f64, s: f64, azimuth: f64) -> MaterialPoint {
    MaterialPoint { layer, s, azimuth }
}

#[test]
fn the_end_layers_are_the_membranes() {
    let walls = &TIED;
    for (wall, pair) in walls.iter().zip(SMOOTH.iter()) {
        for (layer, membrane) in [(0.0, &pair.inner), (1.0, &pair.outer)] {
            for k in 0..=50 {
                let s = k as f64 / 100.0;
                let [x, r] = membrane.at(s).position;
                let body = wall
                    .pose()
                    .to_body(&wall.position(&at(layer, s, 0.8)).unwrap());
                // Rounding of the pose and of two ways to sum one polynomial.
                assert!(
                    (body.x - x).abs() < 1e-13 && (body.y.hypot(body.z) - r.abs()).abs() < 1e-13
                );
            }
        }
    }
    // Sliding walls have the same surfaces at other s.
    for (wall, pair) in SLIDING.iter().zip(SMOOTH.iter()) {
        let p = wall
            .pose()
            .to_body(&wall.position(&at(1.0, 0.3, -2.0)).unwrap());
        let nearest = (0..5000)
            .map(|k| pair.outer.at(k as f64 / 10_000.0).position)
            .map(|[x, r]| (x - p.x).hypot(r - p.y.hypot(p.z)))
            .fold(f64::INFINITY, f64::min);
        // Half a step of 17 cm / 5000 away along the curve.
        assert!(nearest < 2e-3, "{nearest}");
    }
}

#[test]
fn every_layer_preserves_its_volume_over_the_cycle() {
    for walls in [&TIED, &SLIDING] {
        for layers in [[0.0, 1.0], [0.0, 0.25], [0.25, 0.6], [0.6, 1.0]] {
            let exact = (layers[1] - layers[0]) * walls[0].volume();
            for wall in walls.iter() {
                let volume = wall
                    .region(layers, [0.0, 0.5], 1e-8)
                    .unwrap()
                    .mass_properties()
                    .volume;
                // The polyline lies within 1e-8 of some 250 cm^2 of layers, always on one side.
                assert!(
                    (volume - exact).abs() < 5e-6,
                    "{layers:?}: {volume} {exact}"
                );
                // The volume of the wall, which the layers divide, is preserved to rounding.
                assert!((wall.volume() / walls[0].volume() - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_sliding_region_preserves_its_volume_and_a_tied_one_does_not() {
    let volumes = |walls: &[Wall]| -> Vec<f64> {
        let region = |wall: &Wall| wall.region([0.3, 0.8], [0.05, 0.2], 1e-8).unwrap();
        walls
            .iter()
            .map(|wall| region(wall).mass_properties().volume)
            .collect()
    };
    let (tied, sliding) = (volumes(&TIED), volumes(&SLIDING));
    for k in 0..GAINS.len() {
        assert!((sliding[k] - sliding[0]).abs() < 2e-6, "{sliding:?}");
    }
    // The membranes stretch unevenly: the tied strip gains some per cent.
    assert!((tied[2] / tied[0] - 1.0).abs() > 0.005, "{tied:?}");
}

/// The deformation gradient between two phases by central differences in the lab, from one material point.
fn gradient(from: &Wall, to: &Wall, point: &MaterialPoint) -> nalgebra::Matrix3<f64> {
    let (p, h) = (from.position(point).unwrap(), 1e-5);
    let columns = [0, 1, 2].map(|k| {
        let mut step = nalgebra::Vector3::zeros();
        step[k] = h;
        let [a, b] = [p - step, p + step].map(|p| to.position(&from.locate(&p).unwrap()).unwrap());
        (b - a) / (2.0 * h)
    });
    nalgebra::Matrix3::from_columns(&columns)
}

/// Along the layer, around the axis and across the layers.
fn stretches(from: &Wall, to: &Wall, point: &MaterialPoint) -> [f64; 3] {
    let deformation = from.deformation(to, point).unwrap();
    let f = deformation.gradient * deformation.wall;
    let [round, along] = [f.column(1).into_owned(), f.column(2).into_owned()];
    let area = along.cross(&round).norm();
    [
        along.norm(),
        round.norm(),
        deformation.gradient.determinant() / area,
    ]
}

#[test]
fn stretches_agree_with_the_deformation_gradient() {
    for walls in [&TIED, &SLIDING] {
        let (from, to) = (&walls[0], &walls[2]);
        for (layer, s) in [(0.3, 0.1), (0.5, 0.23), (0.2, 0.4), (0.8, 0.47)] {
            let point = at(layer, s, 0.6);
            let stretch = stretches(from, to, &point);
            let volume = from.deformation(to, &point).unwrap().gradient.determinant();
            let f = gradient(from, to, &point);
            // Material directions: along the layer and around the axis, by differences of positions.
            let [along, round] = [at(layer, s + 1e-6, 0.6), at(layer, s, 0.6 + 1e-6)]
                .map(|q| (from.position(&q).unwrap() - from.position(&point).unwrap()).normalize());
            // Differences of positions 1e-6 apart: 1e-6 from their curvature, 1e-9 from rounding.
            assert!(((f * along).norm() - stretch[0]).abs() < 2e-5);
            assert!(((f * round).norm() - stretch[1]).abs() < 2e-5);
            assert!((f.determinant() - volume).abs() < 1e-6, "{stretch:?}");
            // Area of the layer and its normal: the distance of layers is the volume over the area.
            let area = (f * along).cross(&(f * round)).norm();
            assert!((f.determinant() / area - stretch[2]).abs() < 2e-5);
        }
    }
}

#[test]
fn a_sliding_wall_is_incompressible_and_the_volume_change_of_a_tied_wall_is_that_of_its_strips() {
    let (tied, sliding) = (&TIED, &SLIDING);
    let mut worst = 0.0_f64;
    for k in 0..=40 {
        let s = 0.5 * k as f64 / 40.0;
        let mut ratios = Vec::new();
        for layer in [0.0, 0.4, 1.0] {
            let point = at(layer, s, 0.0);
            let free = sliding[0].deformation(&sliding[2], &point).unwrap();
            // Rounding near the apex, where two small numbers are divided.
            assert!(
                (free.gradient.determinant() - 1.0).abs() < 1e-8,
                "{s} {layer}: {free:?}"
            );
            ratios.push(
                tied[0]
                    .deformation(&tied[2], &point)
                    .unwrap()
                    .gradient
                    .determinant(),
            );
        }
        assert!((ratios[0] - ratios[1]).abs() < 1e-8 && (ratios[0] - ratios[2]).abs() < 1e-8);
        worst = worst.max((ratios[0] - 1.0).abs());
    }
    println!("largest change of a tied element's volume at gain 0.6: {worst:.4}");
    assert!(worst > 0.01 && worst < 0.5, "{worst}");
}

#[test]
fn stretches_without_motion_are_one_and_those_of_inverse_motions_are_reciprocal() {
    let walls = &TIED;
    for s in [0.0, 0.2, 0.5] {
        let point = at(0.5, s, 1.0);
        let none = stretches(&walls[1], &walls[1], &point);
        let there = stretches(&walls[0], &walls[2], &point);
        let back = stretches(&walls[2], &walls[0], &point);
        for k in 0..3 {
            assert!((none[k] - 1.0).abs() < 1e-14);
            assert!((there[k] * back[k] - 1.0).abs() < 1e-14);
        }
    }
    // The base is fixed: no hoop stretch on the membranes there.
    let [_, hoop, _] = stretches(&walls[0], &walls[2], &at(0.0, 0.0, 0.0));
    assert!((hoop - 1.0).abs() < 1e-14);
}

#[test]
fn displacements_equal_those_of_the_points_and_do_not_exist_outside() {
    let grid = VoxelGrid::cube(24, 0.6).unwrap();
    for walls in [&TIED, &SLIDING] {
        let all = walls[0].displacements(&walls[2], &grid, 0..24).unwrap();
        let some = walls[0].displacements(&walls[2], &grid, 7..9).unwrap();
        let cut = |(k, d): &(usize, [f32; 3])| Some((k.checked_sub(7 * 576)?, *d));
        let cut: Vec<_> = all
            .iter()
            .filter_map(cut)
            .filter(|(k, _)| *k < 2 * 576)
            .collect();
        assert_eq!(cut, some);
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        assert_eq!(
            all,
            one.install(|| walls[0].displacements(&walls[2], &grid, 0..24))
                .unwrap()
        );
        let mut moved = vec![None; grid.len()];
        all.iter().for_each(|&(k, d)| moved[k] = Some(d));
        for (k, found) in moved.iter().enumerate() {
            let p = grid.centre(k % 24, k / 24 % 24, k / 576);
            let point = walls[0].locate(&p);
            assert_eq!(found.is_some(), point.is_some());
            let (Some(found), Some(point)) = (found, point) else {
                continue;
            };
            let there = walls[2].position(&point).unwrap() - p;
            assert!((0..3).all(|a| (there[a] - f64::from(found[a])).abs() < 1e-6));
            assert!(there.norm() < 1.5);
        }
        volume_of(&walls[0], &grid, all.len());
    }
    let beyond = TIED[0].displacements(&TIED[2], &grid, 20..25);
    assert!(matches!(
        beyond,
        Err(PhantomError::Solid(RevolveError::BadRange {
            start: 20,
            end: 25,
            len: 24,
            ..
        }))
    ));
}

fn volume_of(wall: &Wall, grid: &VoxelGrid, inside: usize) {
    // As many voxels as correspond to the volume of the wall; its surface cuts some 800 of 600.
    let exact = wall.volume() / grid.voxel_volume();
    assert!(
        (inside as f64 - exact).abs() < 0.1 * exact,
        "{inside} {exact}"
    );
}

#[test]
fn finite_differences_give_the_polyline_that_is_projected() {
    let heart = Heart::study(101).unwrap();
    let shapes = heart.shapes(&[0.0, 0.5]).unwrap();
    let walls: Vec<Wall> = shapes
        .iter()
        .map(|shape| Wall::new(shape.solution(), *heart.pose()).unwrap())
        .collect();
    for (wall, shape) in walls.iter().zip(&shapes) {
        let [inner, outer] = shape.volumes();
        assert!((wall.volume() / (outer - inner) - 1.0).abs() < 1e-12);
        let exact = shape.body().region_measures(1).unwrap().volume;
        let region = wall.region([0.0, 1.0], [0.0, 0.5], 1e-6).unwrap();
        assert!((region.mass_properties().volume / exact - 1.0).abs() < 1e-12);
    }
    let [_, hoop, radial] = stretches(&walls[0], &walls[1], &at(0.4, 0.21, 0.0));
    assert!(hoop > 1.0 && radial < 1.0);
}

/// A layer of voxels' worth of the wall, all of it, and three pieces of it.
#[test]
fn regions_move_with_the_wall() {
    let region = Defect {
        layers: [0.2, 0.9],
        s: [0.1, 0.35],
        azimuths_degrees: [0.5f64, 2.0].map(f64::to_degrees),
        activity: 0.0,
    };
    let share = |wall: &Wall| {
        let solid = wall.sector(&region, 1e-7).unwrap();
        let grid = VoxelGrid::cube(40, 0.35).unwrap();
        let mut sum = 0.0;
        for p in (0..grid.len()).map(|k| grid.centre(k % 40, k / 40 % 40, k / 1600)) {
            let inside = wall.locate(&p).is_some_and(|m| {
                (0.2..0.9).contains(&m.layer)
                    && (0.1..0.35).contains(&m.s)
                    && (0.5..2.0).contains(&m.azimuth)
            });
            // Away from its surface, a point is in the solid if its material is in the region.
            if inside != solid.contains(&p) {
                sum += 1.0;
            }
        }
        (sum, solid.volume())
    };
    for wall in TIED.iter().chain(SLIDING.iter()) {
        let (wrong, _) = share(wall);
        assert_eq!(wrong, 0.0);
    }
    let [still, moved] = [0, 2].map(|k| share(&SLIDING[k]).1);
    assert!((still - moved).abs() < 1e-5);
    // All of it, in six pieces.
    let mut sum = 0.0;
    for layers in [[0.0, 0.3], [0.3, 1.0]] {
        for azimuths in [[-1.0, 0.2], [0.2, 3.0], [3.0, 2.0 * PI - 1.0]] {
            let piece = Defect {
                layers,
                s: [0.0, 0.5],
                azimuths_degrees: azimuths.map(f64::to_degrees),
                activity: 0.0,
            };
            sum += TIED[1].sector(&piece, 1e-7).unwrap().volume();
        }
    }
    assert!((sum / TIED[1].volume() - 1.0).abs() < 1e-7, "{sum}");
    let bad = Defect {
        azimuths_degrees: [60.0, 60.0],
        ..region
    };
    let refused = TIED[0].sector(&bad, 1e-3);
    assert!(matches!(
        refused,
        Err(PhantomError::Solid(RevolveError::NotPositive { .. }))
    ));
}

#[test]
fn the_wall_thins_as_the_cavity_grows() {
    let at = |k: usize, s: f64| TIED[k].thickness(s);
    for k in 0..=10 {
        let s = 0.05 * f64::from(k);
        // Two balloons a centimetre apart.
        assert!((at(0, s) - 1.0).abs() < 1e-10, "{}", at(0, s));
    }
    assert!(at(0, 0.25) > at(1, 0.25) && at(1, 0.25) > at(2, 0.25));
    assert_eq!(at(0, 9.0), at(0, 0.5));
    assert!(at(0, f64::NAN).is_nan());
}

#[test]
fn invalid_input_is_rejected() {
    let wall = &TIED[0];
    for bad in [
        at(-0.1, 0.2, 0.0),
        at(1.1, 0.2, 0.0),
        at(f64::NAN, 0.2, 0.0),
        at(0.5, -1e-9, 0.0),
        at(0.5, 0.51, 0.0),
        at(0.5, f64::NAN, 0.0),
        at(0.5, 0.2, f64::INFINITY),
        at(0.5, 0.2, f64::NAN),
    ] {
        assert!(matches!(
            wall.position(&bad),
            Err(PhantomError::OutOfRange { .. })
        ));
        assert!(matches!(
            wall.deformation(wall, &bad),
            Err(PhantomError::OutOfRange { .. })
        ));
    }
    for refused in [
        wall.region([0.2, 0.2], [0.0, 0.5], 1e-3),
        wall.region([0.2, 0.8], [0.3, 0.2], 1e-3),
    ] {
        assert!(matches!(
            refused,
            Err(PhantomError::Solid(RevolveError::NotPositive { .. }))
        ));
    }
    let refused = wall.region([0.2, 1.2], [0.0, 0.5], 1e-3);
    assert!(matches!(
        refused,
        Err(PhantomError::OutOfRange { given: 1.2, .. })
    ));
    let refused = wall.region([0.2, 0.8], [0.2, 0.3], f64::NAN);
    assert!(matches!(
        refused,
        Err(PhantomError::Solid(RevolveError::NotFinite { .. }))
    ));
    let far = nalgebra::Point3::new(f64::NAN, 0.0, 0.0);
    assert_eq!(wall.locate(&far), None);
    assert_eq!(wall.locate(&nalgebra::Point3::new(30.0, 0.0, 0.0)), None);
}

proptest! {
    #[test]
    fn locate_inverts_position(phase in 0..3usize, layer in 0.0..=1.0f64, s in 0.0..=0.5f64, azimuth in -PI..PI) {
        let point = at(layer, s, azimuth);
        let wall = &TIED[phase];
        let found = wall.locate(&wall.position(&point).unwrap()).unwrap();
        prop_assert!((found.layer - layer).abs() < 1e-10 && (found.s - s).abs() < 1e-10, "{found:?}");
        let slack = 1e-10 / (0.5 - s).max(1e-10);
        prop_assert!((found.azimuth - azimuth).abs() < slack, "{found:?}");

        let wall = &SLIDING[phase];
        let p = wall.position(&point).unwrap();
        let found = wall.locate(&p).unwrap();
        prop_assert!((found.layer - layer).abs() < 1e-10);
        // Half the digits near the apex.
        let slack = 1e-10_f64.max(1e-14 / (0.5 - s).max(1e-8));
        prop_assert!((found.s - s).abs() < slack, "{found:?}");
    }
}
