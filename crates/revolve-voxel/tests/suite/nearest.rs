//! Surroundings of a wall, and the nearest material.

use revolve_voxel::nalgebra::Point3;
use revolve_voxel::{Curve, Pose, RevolveError, Shell, VoxelGrid};

/// Half-circles about the origin from the plane x = 0 to the axis, of radius 1 and 2: half a hollow ball, open at its base.
fn bowl() -> Shell {
    let s: Vec<f64> = (0..=2000).map(|k| f64::from(k) / 2000.0).collect();
    let arc = |radius: f64| -> Vec<[f64; 2]> {
        let angle = |s: &f64| 0.5 * std::f64::consts::PI * s;
        s.iter()
            .map(|s| [radius * angle(s).sin(), radius * angle(s).cos()])
            .collect()
    };
    let curve = |radius| Curve::polyline(&s, &arc(radius)).unwrap();
    Shell::new(curve(1.0), curve(2.0), [0.0, 1.0]).unwrap()
}

#[test]
fn the_nearest_material_is_straight_up_or_down_or_on_the_base() {
    let bowl = bowl();
    // Above, below and in the half-ball, and beyond its base.
    let grid = VoxelGrid::new([29, 17, 1], [0.21, 0.205, 1.0], [-2.48, 0.003, 0.0]).unwrap();
    let all = bowl
        .map_voxels(&Pose::identity(), &grid, 0..1, 10.0, |p, material, off| {
            (*p, material, off)
        })
        .unwrap();
    assert_eq!(all.len(), grid.len());
    for (_, (p, [layer, s], found)) in all {
        let p = [p.x, p.y];
        let radius = p[0].hypot(p[1]);
        let (distance, place) = match p[0] >= 0.0 {
            true if radius > 2.0 => (radius - 2.0, p.map(|x| 2.0 / radius * x)),
            true if radius < 1.0 => (1.0 - radius, p.map(|x| x / radius)),
            true => (0.0, p),
            false => {
                let on = [0.0, p[1].clamp(1.0, 2.0)];
                ((p[0] - on[0]).hypot(p[1] - on[1]), on)
            }
        };
        // Chords of a 2000th of the quarter, divided into 128 or more pieces: an eighth of their square.
        assert!((found - distance).abs() < 1e-4, "{p:?} {found} {distance}");
        let found = bowl.point(layer, s);
        let off = (found[0] - place[0]).hypot(found[1] - place[1]);
        // At the centre all points of the inner surface have the same distance.
        assert!(off < 2e-3 / radius.min(1.0), "{p:?} {found:?} {place:?}");
    }
}

#[test]
fn all_voxels_within_reach_are_included_and_those_of_the_wall_unchanged() {
    let bowl = bowl();
    let grid = VoxelGrid::centred([24, 22, 20], [0.3, 0.3, 0.4], [0.1, -0.2, 0.3]).unwrap();
    let pose = Pose::axis_along_z(1.0)
        .unwrap()
        .rotated_x(0.7)
        .unwrap()
        .rotated_y(0.4)
        .unwrap();
    let reach = 0.6;
    let around = bowl
        .map_voxels(&pose, &grid, 0..20, reach, |p, material, off| {
            (*p, material, off)
        })
        .unwrap();
    let all = bowl
        .map_voxels(&pose, &grid, 0..20, 100.0, |_, _, distance| distance)
        .unwrap();
    assert_eq!(all.len(), grid.len());
    let expected: Vec<usize> = (all.iter())
        .filter(|(_, distance)| *distance <= reach)
        .map(|(k, _)| *k)
        .collect();
    assert!(expected.len() > 1000);
    let numbers: Vec<usize> = around.iter().map(|(k, _)| *k).collect();
    assert_eq!(numbers, expected);
    let own: Vec<_> = (around.iter())
        .filter(|(_, (.., distance))| *distance == 0.0)
        .copied()
        .collect();
    assert!(
        own == bowl
            .map_voxels(&pose, &grid, 0..20, 0.0, |p, material, off| (
                *p, material, off
            ))
            .unwrap()
    );
    // A part of the whole, for any number of threads.
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let of = |p: &Point3<f64>, material, off| (*p, material, off);
    let some = || bowl.map_voxels(&pose, &grid, 7..12, reach, of);
    let (from, to) = (7 * 24 * 22, 12 * 24 * 22);
    let part: Vec<_> = (around.iter())
        .filter(|(k, _)| (from..to).contains(k))
        .map(|(k, of)| (k - from, *of))
        .collect();
    assert!(pool.install(some).unwrap() == part);
    let refused = bowl.map_voxels(&pose, &grid, 0..20, -0.1, |_, _, _| ());
    assert!(matches!(refused, Err(RevolveError::Negative { .. })));
    let refused = bowl.map_voxels(&pose, &grid, 0..20, f64::NAN, |_, _, _| ());
    assert!(matches!(refused, Err(RevolveError::NotFinite { .. })));
}
