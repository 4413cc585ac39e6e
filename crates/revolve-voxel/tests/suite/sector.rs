//! Solids cut by a wedge: against whole solids, closed forms, point tests and each other.

use crate::support;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Assembly, Body, Lines, Meridian, Organ, OrganShape, Organs, ParallelDetector, Pose, Ray,
    RevolveError, Sector, Shown, VoxelGrid,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn pose() -> Pose {
    let pose = Pose::axis_along_z(1.0)
        .unwrap()
        .rotated_x(0.8)
        .unwrap()
        .rotated_y(-0.4)
        .unwrap();
    pose.shifted(Vector3::new(0.3, -0.2, 0.1)).unwrap()
}

/// A bent ring that does not touch the axis.
fn ring() -> Meridian {
    Meridian::ring(&[
        [0.0, 1.0],
        [-0.2, 1.9],
        [1.2, 2.4],
        [2.3, 1.6],
        [2.1, 0.8],
        [1.1, 1.4],
    ])
    .unwrap()
}

fn rays(theta: f64) -> Lines {
    ParallelDetector::new(40, 36, [0.15, 0.15])
        .unwrap()
        .rays(theta)
        .unwrap()
}

/// The image of sectors of activity 2, alone or in an attenuating torso with a body that contains them.
fn image(sectors: &[Sector], rays: &Lines, torso: Option<(&Organs, &Body)>) -> Vec<f64> {
    let mut out = vec![0.0; rays.size().iter().product()];
    match torso {
        None => sectors.iter().for_each(|sector| {
            sector.project_add(rays, 2.0, &mut out).unwrap();
        }),
        Some((torso, body)) => {
            let assembly = Assembly::new(torso).with_body(body, &[0.0], None).unwrap();
            let sectors = sectors.iter().map(|sector| (sector.clone(), 2.0)).collect();
            let assembly = assembly.with_sectors(sectors).unwrap();
            assembly
                .project_add(rays, Shown::Change, 1.0, &mut out)
                .unwrap();
        }
    }
    out
}

fn voxels(sector: &Sector, grid: &VoxelGrid, tolerance: f64) -> Vec<f64> {
    let mut out = vec![0.0; grid.len()];
    sector
        .voxelize_add(grid, 0..grid.shape()[2], tolerance, 1.0, &mut out)
        .unwrap();
    out
}

#[test]
fn a_full_turn_equals_the_ring() {
    let body = Body::new(vec![ring()], pose()).unwrap();
    let grid = VoxelGrid::cube(30, 0.2).unwrap();
    let (volume, _) = body.voxelize::<f64>(&grid, 1e-3, &[1.0]).unwrap();
    for azimuths in [[0.0, TAU], [-1.0, TAU - 1.0]] {
        let sector = Sector::new(ring(), azimuths, pose()).unwrap();
        assert!((sector.volume() - body.region_measures(0).unwrap().volume).abs() < 1e-12);
        let rays = rays(0.4);
        let (plain, _) = body.project::<f64>(&rays, &[2.0]).unwrap();
        let seen = image(std::slice::from_ref(&sector), &rays, None);
        // Rounding: the intervals are shifted along the ray before their lengths are computed.
        assert!(plain.iter().zip(&seen).all(|(a, b)| (a - b).abs() < 1e-13));
        // On another part of the grid: each to the tolerance.
        let again = voxels(&sector, &grid, 1e-3);
        assert!(again.iter().zip(&volume).all(|(a, b)| (a - b).abs() < 1e-3));
    }
}

#[test]
fn adjacent_wedges_add_up_to_the_ring() {
    let torso = OrganShape::cylinder([0.0; 2], [6.0, 5.0]).unwrap();
    let torso = Organ {
        shape: torso,
        activity: 0.0,
        attenuation: 0.2,
    };
    let torso = Organs::new(vec![torso]).unwrap();
    let body = Body::new(vec![ring()], pose()).unwrap();
    let cuts = [0.3, 0.9, 2.0, 5.5, 0.3 + TAU];
    let grid = VoxelGrid::cube(24, 0.25).unwrap();
    let whole = Sector::new(ring(), [0.0, TAU], pose()).unwrap();
    for torso in [None, Some((&torso, &body))] {
        for theta in [0.0, 1.3, FRAC_PI_2] {
            let rays = rays(theta);
            let part = |pair: &[f64]| Sector::new(ring(), [pair[0], pair[1]], pose()).unwrap();
            let parts: Vec<Sector> = cuts.windows(2).map(part).collect();
            let sum = image(&parts, &rays, torso);
            let exact = image(std::slice::from_ref(&whole), &rays, torso);
            assert!(sum.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }
    let mut sum = vec![0.0; grid.len()];
    for pair in cuts.windows(2) {
        let part = Sector::new(ring(), [pair[0], pair[1]], pose()).unwrap();
        for (v, add) in sum.iter_mut().zip(voxels(&part, &grid, 1e-3)) {
            *v += add;
        }
    }
    let exact = voxels(&whole, &grid, 1e-3);
    for (a, b) in sum.iter().zip(&exact) {
        // Each part and the whole to the tolerance; near the axis up to four parts share a voxel.
        assert!((a - b).abs() < 4e-3, "{a} {b}");
    }
}

#[test]
fn half_a_ball_and_a_quarter_of_a_cylinder_have_closed_forms() {
    let n = 1000;
    let angle = |k: usize| PI * k as f64 / n as f64;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| {
            [
                -2.0 * angle(k).cos(),
                if k % n == 0 {
                    0.0
                } else {
                    2.0 * angle(k).sin()
                },
            ]
        })
        .collect();
    let ball = Meridian::new(&points).unwrap();
    let upright = Pose::axis_along_z(0.0).unwrap();
    // Body y is lab x, body z is lab y: the half with lab y > 0.
    let half = Sector::new(ball, [0.0, PI], upright).unwrap();
    let chord = |o: [f64; 3], d: [f64; 3]| half.chord(&Ray::new(o.into(), d.into()).unwrap());
    // The polyline is 1e-5 within the ball.
    assert!((chord([0.3, 0.0, 0.4], [0.0, 1.0, 0.0]) - (4.0_f64 - 0.25).sqrt()).abs() < 2e-5);
    assert!((chord([0.0, 0.5, 0.4], [1.0, 0.0, 0.0]) - 2.0 * (4.0_f64 - 0.41).sqrt()).abs() < 2e-5);
    assert_eq!(chord([0.0, -0.5, 0.4], [1.0, 0.0, 0.0]), 0.0);
    assert_eq!(chord([0.0, 3.0, 0.4], [1.0, 0.0, 0.0]), 0.0);
    assert!((half.volume() / (16.0 * PI / 3.0) - 1.0).abs() < 1e-5);

    let cylinder = || Meridian::new(&[[-1.0, 2.0], [1.0, 2.0]]).unwrap();
    let quarter = Sector::new(cylinder(), [0.0, FRAC_PI_2], upright).unwrap();
    let chord = |sector: &Sector, o: [f64; 3], d: [f64; 3]| {
        sector.chord(&Ray::new(o.into(), d.into()).unwrap())
    };
    assert!((chord(&quarter, [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) - 3.75_f64.sqrt()).abs() < 1e-14);
    assert!((chord(&quarter, [0.5, 0.0, 0.0], [0.0, -1.0, 0.0]) - 3.75_f64.sqrt()).abs() < 1e-14);
    // Along the axis through its inside: the whole height.
    assert!((chord(&quarter, [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]) - 2.0).abs() < 1e-14);
    assert_eq!(chord(&quarter, [0.5, -0.5, 0.0], [0.0, 0.0, 1.0]), 0.0);
    // Through the axis at 45 degrees: from it to the surface.
    assert!((chord(&quarter, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]) - 2.0).abs() < 1e-14);
    // The rest of the cylinder, more than half a turn.
    let rest = Sector::new(cylinder(), [FRAC_PI_2, TAU], upright).unwrap();
    assert!((chord(&rest, [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) - 3.75_f64.sqrt()).abs() < 1e-14);
    assert!((chord(&rest, [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]) - 2.0).abs() < 1e-14);
    assert!(
        (chord(&rest, [-0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) - 2.0 * 3.75_f64.sqrt()).abs() < 1e-14
    );
    assert_eq!(chord(&rest, [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]), 0.0);

    // Voxels aligned with the cuts: exact halves and quarters along them.
    let grid = VoxelGrid::centred([5, 5, 1], [0.5; 3], [0.0; 3]).unwrap();
    let volume = voxels(&quarter, &grid, 1e-4);
    let at = |x: usize, y: usize| volume[y * 5 + x];
    assert!(
        (at(2, 2) - 0.25).abs() < 1e-12
            && (at(3, 2) - 0.5).abs() < 1e-12
            && (at(2, 4) - 0.5).abs() < 1e-12
    );
    assert_eq!(
        (at(3, 3), at(1, 3), at(1, 1), at(3, 1)),
        (1.0, 0.0, 0.0, 0.0)
    );
}

#[test]
fn coverage_adds_up_to_the_volume() {
    // The tolerance bounds the error of a voxel; that of the sum is much smaller and decreases with it.
    for azimuths in [[0.2, 1.1], [1.0, 1.0 + PI], [0.5, 5.0]] {
        let sector = Sector::new(ring(), azimuths, pose()).unwrap();
        for (n, tolerance) in [(16, 1e-2), (40, 1e-3)] {
            let grid = VoxelGrid::cube(n, 6.4 / n as f64).unwrap();
            let volume = voxels(&sector, &grid, tolerance);
            let sum = volume.iter().sum::<f64>() * grid.voxel_volume();
            let exact = sector.volume();
            assert!(
                (sum / exact - 1.0).abs() < 0.5 * tolerance,
                "{azimuths:?} {n}: {sum} {exact}"
            );
            assert!(volume.iter().all(|v| (0.0..=1.0 + 1e-12).contains(v)));
        }
    }
}

#[test]
fn voxels_of_any_size_meet_the_tolerance() {
    // Thin and thick wedges, of more than half a turn too, in voxels up to the size of the whole piece.
    for azimuths in [
        [0.2, 0.25],
        [0.2, 1.1],
        [1.0, 1.0 + PI],
        [0.5, 5.0],
        [3.0, 9.2],
    ] {
        let sector = Sector::new(ring(), azimuths, pose()).unwrap();
        for n in [1, 2, 3, 5] {
            let grid = VoxelGrid::cube(n, 7.0 / n as f64).unwrap();
            for tolerance in [1e-1, 1e-3, 1e-6, 1e-9] {
                let volume = voxels(&sector, &grid, tolerance);
                let cut = volume.iter().filter(|v| **v > 0.0 && **v < 1.0).count();
                let off = volume.iter().sum::<f64>() - sector.volume() / grid.voxel_volume();
                assert!(
                    off.abs() <= tolerance * cut as f64,
                    "{azimuths:?} {n} {tolerance:e}: {off:e} in {cut}"
                );
            }
        }
    }
}

#[test]
fn divided_voxels_preserve_their_sum() {
    // Eight voxels against one that contains them, by other sections; also where the axis intersects voxels.
    let ball = Meridian::ring(&[[-1.5, 0.0], [-1.0, 1.3], [0.9, 1.6], [1.2, 0.0]]).unwrap();
    for (meridian, azimuths) in [(ball, [0.4, 1.0]), (ring(), [0.3, 4.0])] {
        let sector = Sector::new(meridian, azimuths, pose()).unwrap();
        let grids = [5, 10].map(|n| VoxelGrid::cube(n, 6.0 / n as f64).unwrap());
        let [coarse, fine] = grids.map(|grid| voxels(&sector, &grid, 1e-8));
        let mut sums = [0.0; 125];
        for (k, v) in fine.iter().enumerate() {
            let [x, y, z] = [k % 10, k / 10 % 10, k / 100].map(|j| j / 2);
            sums[(z * 5 + y) * 5 + x] += v / 8.0;
        }
        for (a, b) in coarse.iter().zip(&sums) {
            assert!((a - b).abs() < 2e-8, "{a} {b}");
        }
    }
}

#[test]
fn coverage_agrees_with_point_tests() {
    let sector = Sector::new(ring(), [0.3, 1.4], pose()).unwrap();
    let grid = VoxelGrid::cube(16, 0.4).unwrap();
    let (tolerance, m) = (2e-3, 48);
    let volume = voxels(&sector, &grid, tolerance);
    let (mut looked, mut worst) = (0, 0.0_f64);
    for (k, v) in volume.iter().enumerate() {
        if !(*v > 0.0 && *v < 1.0) || k % 3 != 0 {
            continue;
        }
        let c = grid.centre(k % 16, k / 16 % 16, k / 256);
        let at = |j: usize| ((j as f64 + 0.5) / m as f64 - 0.5) * 0.4;
        let inside = (0..m * m * m)
            .filter(|&j| {
                sector.contains(&(c + Vector3::new(at(j % m), at(j / m % m), at(j / (m * m)))))
            })
            .count();
        let share = inside as f64 / (m * m * m) as f64;
        looked += 1;
        worst = worst.max((v - share).abs());
    }
    println!("{looked} voxels, worst {worst:.1e}");
    // Point tests are accurate to 1 / 48 of the area of a face over 48: about 2e-3.
    assert!(looked > 30 && worst < tolerance + 3e-3, "{worst}");
}

#[test]
fn pieces_have_separate_labels() {
    // A cylinder within another; two quarters of the ring between them, and voxels along their sides cut in halves.
    let upright = Pose::axis_along_z(0.0).unwrap();
    let cylinder = |r: f64| Meridian::new(&[[-1.0, r], [1.0, r]]).unwrap();
    let body = Body::new(vec![cylinder(1.0), cylinder(3.0)], upright).unwrap();
    let ring = Meridian::ring(&[[-1.0, 1.0], [-1.0, 3.0], [1.0, 3.0], [1.0, 1.0]]).unwrap();
    let quarter = |k: f64| {
        let azimuths = [k * FRAC_PI_2, (k + 1.0) * FRAC_PI_2];
        Sector::new(ring.clone(), azimuths, upright).unwrap()
    };
    let grid = VoxelGrid::centred([15, 15, 1], [0.5; 3], [0.0; 3]).unwrap();
    let tolerance = 1e-4;
    let plain = body.regions::<f32>(&grid, 0..1, tolerance).unwrap();
    let mut marked = plain.clone();
    let pieces = [quarter(0.0), quarter(1.0), quarter(1.0)];
    let list: Vec<Vec<&Sector>> = pieces.iter().map(|piece| vec![piece]).collect();
    marked
        .label_pieces(1, &list, &grid, 0..1, tolerance)
        .unwrap();
    let at = |x: usize, y: usize| marked.labels[y * 15 + x];
    // Body y is lab x, body z is lab y. The first of two equals; none for the third, which the second covers.
    assert_eq!((at(10, 10), at(4, 10), at(4, 4), at(10, 4)), (3, 4, 2, 2));
    assert_eq!((at(11, 7), at(7, 11), at(3, 7), at(7, 3)), (3, 3, 4, 2));
    assert_eq!((at(7, 7), at(0, 0), at(14, 7)), (1, 0, 0));
    for (a, b) in marked.labels.iter().zip(&plain.labels) {
        assert!(a == b || (*b == 2 && *a > 2 && *a < 5));
    }
    assert_eq!(marked.coverage, plain.coverage);
    // A piece of two parts is their union; a piece without parts is empty.
    let mut halves = plain.clone();
    let parts = [vec![], vec![&pieces[0], &pieces[1]]];
    halves
        .label_pieces(1, &parts, &grid, 0..1, tolerance)
        .unwrap();
    for (a, b) in halves.labels.iter().zip(&marked.labels) {
        assert_eq!(*a, if *b == 3 { 4 } else { *b });
    }
    let many = vec![vec![&pieces[0]]; 253];
    let refused = marked.label_pieces(1, &many, &grid, 0..1, tolerance);
    assert!(
        matches!(
            refused,
            Err(RevolveError::WrongLength {
                expected: 254,
                given: 255,
                ..
            })
        ),
        "{refused:?}"
    );
    let refused = marked.label_pieces(2, &list, &grid, 0..1, tolerance);
    assert!(
        matches!(
            refused,
            Err(RevolveError::WrongLength {
                expected: 3,
                given: 2,
                ..
            })
        ),
        "{refused:?}"
    );
}

#[test]
fn slices_are_bitwise_identical_to_the_whole_for_any_number_of_threads() {
    let sector = Sector::new(ring(), [0.3, 4.4], pose()).unwrap();
    let grid = VoxelGrid::new([20, 17, 14], [0.3, 0.35, 0.4], [-2.6, -2.9, -2.7]).unwrap();
    let pool = |n| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
    };
    let [one, two] = [1, 2].map(|n| pool(n).install(|| voxels(&sector, &grid, 1e-3)));
    assert!(one == two);
    let mut part = vec![0.0_f64; 3 * 20 * 17];
    let tolerance = 1e-3;
    sector
        .voxelize_add(&grid, 5..8, tolerance, 1.0, &mut part)
        .unwrap();
    assert!(part.iter().any(|v| *v > 0.0));
    assert!(part[..] == one[5 * 340..8 * 340]);
    let rays = rays(1.0);
    let [one, two] =
        [1, 2].map(|n| pool(n).install(|| image(std::slice::from_ref(&sector), &rays, None)));
    assert!(one == two);
}

#[test]
fn invalid_input_is_rejected() {
    for (azimuths, wide) in [
        ([0.0, 0.0], false),
        ([1.0, 0.5], false),
        ([f64::NAN, 1.0], false),
        ([0.0, f64::INFINITY], false),
        ([0.0, 6.3], true),
    ] {
        let error = Sector::new(ring(), azimuths, pose()).unwrap_err();
        assert_eq!(
            matches!(error, RevolveError::OutOfRange { .. }),
            wide,
            "{error}"
        );
    }
    let sector = Sector::new(ring(), [0.0, 1.0], pose()).unwrap();
    assert!(matches!(
        sector.project_add(&rays(0.0), f64::NAN, &mut [0.0_f64; 1440]),
        Err(RevolveError::NotFinite { .. })
    ));
    assert!(matches!(
        sector.project_add(&rays(0.0), 1.0, &mut [0.0_f64; 1439]),
        Err(RevolveError::WrongLength { given: 1439, .. })
    ));
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    let add = |slices, tolerance, activity, n| {
        sector.voxelize_add(&grid, slices, tolerance, activity, &mut vec![0.0_f64; n])
    };
    for (slices, n) in [(0..3, 12), (0..2, 7)] {
        let refused = add(slices, 0.01, 1.0, n);
        assert!(matches!(
            refused,
            Err(RevolveError::WrongLength { .. } | RevolveError::BadRange { .. })
        ));
    }
    // Also of a grid that the sector does not reach.
    let away = VoxelGrid::centred([2; 3], [1.0; 3], [100.0; 3]).unwrap();
    assert!(matches!(
        sector.voxelize_add(&away, 0..2, 0.0, 1.0, &mut [0.0_f64; 8]),
        Err(RevolveError::NotPositive { .. })
    ));
    assert!(matches!(
        add(0..2, 0.01, f64::NAN, 8),
        Err(RevolveError::NotFinite { .. })
    ));
    assert!(matches!(
        add(0..2, 0.0, 1.0, 8),
        Err(RevolveError::NotPositive { .. })
    ));
}

proptest! {
    #[test]
    fn chords_agree_with_point_tests(
        from in -4.0..4.0f64, opening in 0.05..6.2f64, d in support::direction(),
        o in (-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64),
    ) {
        let sector = Sector::new(ring(), [from, from + opening], pose()).unwrap();
        let ray = Ray::new(Point3::new(o.0, o.1, o.2), d).unwrap();
        let (n, reach) = (8000, 6.0);
        let h = 2.0 * reach / n as f64;
        let inside = (0..n).filter(|&k| sector.contains(&ray.at((k as f64 + 0.5) * h - reach))).count();
        // At most eight ends, each with an error of half a step.
        prop_assert!((sector.chord(&ray) - inside as f64 * h).abs() < 4.0 * h, "{} {}", sector.chord(&ray), inside as f64 * h);
    }
}

proptest! {
    /// An assembly skips sectors by their bounding boxes; a chord is computed without them. Lines close to the axis and perpendicular to it included.
    #[test]
    fn an_assembly_skips_no_sector_that_a_line_crosses(
        from in -4.0..4.0f64, opening in 0.05..TAU, d in support::direction(), p in prop::array::uniform3(-2.0..2.0f64), kind in 0..4,
        distance in 0.0..1e3f64, [x, r] in prop::array::uniform2(0.0..2.0f64), [long, thick] in prop::array::uniform2(1e-3..1.0f64),
    ) {
        // More than two groups with a common bounding box.
        let shifted = |k: u32| {
            let x = x + 0.05 * f64::from(k);
            let profile = [[x, r], [x, r + thick], [x + long, r + 1.5 * thick], [x + long, r + 0.5 * thick]];
            Sector::new(Meridian::ring(&profile).unwrap(), [from, from + opening], pose()).unwrap()
        };
        let sectors: Vec<Sector> = (0..40).map(shifted).collect();
        let axis = pose().axis();
        let direction = match kind {
            0 => axis,
            1 => d.cross(&axis).normalize(),
            _ => d,
        };
        let through = Point3::from(p) - distance * direction;
        let ray = Ray::new(through, direction).unwrap();
        let all = Meridian::new(&[[-5.0, 6.0], [5.0, 6.0]]).unwrap();
        let body = Body::new(vec![all], pose()).unwrap();
        let nothing = Organs::new(Vec::new()).unwrap();
        let assembly = Assembly::new(&nothing).with_body(&body, &[0.0], None).unwrap();
        let assembly = assembly.with_sectors(sectors.iter().map(|sector| (sector.clone(), 1.0)).collect()).unwrap();
        let mut crossed = [0.0_f64];
        assembly.project_add(&Lines::each([1, 1], vec![ray]).unwrap(), Shown::Change, 1.0, &mut crossed).unwrap();
        let [crossed] = crossed;
        let chords: f64 = sectors.iter().map(|sector| sector.chord(&ray)).sum();
        // Rounding of parameters up to 1e3, at 80 ends of spans.
        prop_assert!((crossed - chords).abs() < 1e-9, "{crossed} {chords}");
    }

    /// Against points: the path to the hit is outside the sector, the path beyond is inside, and the normal points out.
    #[test]
    fn hits_agree_with_point_tests(from in 0.0..TAU, opening in 0.1..TAU, d in support::direction(), p in prop::array::uniform3(-2.0..2.0f64)) {
        let sector = Sector::new(ring(), [from, from + opening], pose()).unwrap();
        let ray = Ray::new(Point3::from(p) - 8.0 * d, d).unwrap();
        let inside = |t: f64| sector.contains(&ray.at(t));
        // Steps of 1/250: thinner parts may lie between two of them.
        let step = 16.0 / 4000.0;
        let first = (0..4000).map(|k| step * f64::from(k)).find(|&t| inside(t));
        let hit = sector.first_hit(&ray);
        match (hit, first) {
            (None, None) => {}
            (None, Some(t)) => prop_assert!(false, "inside at {t}, and no hit"),
            (Some(hit), first) => {
                prop_assert!(first.is_none_or(|t| hit.t <= t + 1e-9), "{hit:?} {first:?}");
                prop_assert!(!inside(hit.t - 1e-7));
                prop_assert!((hit.normal.norm() - 1.0).abs() < 1e-12);
                let slope = -hit.normal.dot(&d);
                prop_assert!(slope > -1e-9, "{slope}");
                // Grazing rays leave immediately.
                if slope > 1e-2 {
                    prop_assert!(inside(hit.t + 1e-7));
                    prop_assert!(!sector.contains(&(hit.point + 1e-6 * hit.normal)));
                    prop_assert!(sector.contains(&(hit.point - 1e-6 * hit.normal)));
                }
            }
        }
    }
}
