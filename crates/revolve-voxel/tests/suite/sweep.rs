//! Intersection over a motion: against tests of every voxel's centre in every shape, and the number of tests needed.

use crate::support;

use nalgebra::Point3;
use proptest::prelude::*;
use revolve_voxel::{Mask, Meridian, Pose, RevolveError, Sweep, VoxelGrid};
use support::*;

/// Region of a point in one shape: the first layer that contains it.
fn region(layers: &[Meridian], p: &Point3<f64>) -> usize {
    let holds = |m: &Meridian| m.signed_distance(p) < 0.0;
    layers.iter().position(holds).unwrap_or(layers.len())
}

/// By the definition; `always` for each region, then `ever`.
fn naive(shapes: &[&[Meridian]], pose: &Pose, grid: &VoxelGrid) -> Vec<Mask> {
    let [nx, ny, nz] = grid.shape();
    let n_layers = shapes[0].len();
    let found: Vec<Vec<usize>> = (0..grid.len())
        .map(|i| {
            let p = pose.to_body(&grid.centre(i % nx, i / nx % ny, i / (nx * ny)));
            shapes.iter().map(|layers| region(layers, &p)).collect()
        })
        .collect();
    let mask = |holds: &dyn Fn(&Vec<usize>) -> bool| {
        Mask::new([nz, ny, nx], found.iter().map(holds).collect()).unwrap()
    };
    (0..n_layers)
        .map(|k| mask(&|seen| seen.iter().all(|&region| region == k)))
        .chain([mask(&|seen| seen.iter().any(|&region| region < n_layers))])
        .collect()
}

fn scaled(path: &[[f64; 2]], by: f64) -> Meridian {
    let points: Vec<[f64; 2]> = path.iter().map(|p| p.map(|v| by * v)).collect();
    Meridian::new(&points).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// Rough meridians, nested and not, in any pose, on grids that no block divides.
    #[test]
    fn agrees_with_its_definition(
        (a, _) in meridian(), (b, _) in meridian(), sizes in prop::array::uniform4(0.3..1.2f64),
        pose in pose(), n in 1usize..24,
    ) {
        let shapes = [
            [scaled(&a, sizes[0]), scaled(&b, 1.5 * sizes[1])],
            [scaled(&a, sizes[2]), scaled(&b, 1.5 * sizes[3])],
            [scaled(&b, sizes[0]), scaled(&a, sizes[3])],
        ];
        let shapes: Vec<&[Meridian]> = shapes.iter().map(|s| &s[..]).collect();
        let size = 3.3 / n as f64;
        let grid = VoxelGrid::centred([n, n + 3, n + 5], [size, 0.9 * size, 0.8 * size], [0.01, 0.02, -0.1]).unwrap();
        let sweep = Sweep::of(&shapes, &pose, &grid).unwrap();
        let slow = naive(&shapes, &pose, &grid);
        prop_assert_eq!(&sweep.intersection[..], &slow[..2]);
        prop_assert_eq!(&sweep.union, &slow[2]);
    }
}

/// Balloons from the reference configuration to a gain in seven steps: the number of tests of surfaces grows with the area that bounds the
/// sets, and the extreme shapes decide most of them.
#[test]
fn the_number_of_tests_scales_with_the_surface() {
    let shapes: Vec<Vec<Meridian>> = [0.0, 1.0, 0.1, 0.9, 0.3, 0.7, 0.5]
        .iter()
        .map(|g| {
            let ball = |r: f64| {
                let arc = |k: i32| std::f64::consts::PI * f64::from(100 - k) / 100.0;
                let point = |k: i32| [r * arc(k).cos(), r * arc(k).sin().max(0.0)];
                Meridian::new(&(0..=100).map(point).collect::<Vec<_>>()).unwrap()
            };
            vec![ball(3.0 + g), ball(5.0 + 0.5 * g)]
        })
        .collect();
    let shapes: Vec<&[Meridian]> = shapes.iter().map(|s| &s[..]).collect();
    let pose = study_pose();
    let count = |n: usize| {
        let grid = VoxelGrid::cube(n, 16.0 / n as f64).unwrap();
        Sweep::of(&shapes, &pose, &grid).unwrap().counters
    };
    let (coarse, fine) = (count(64), count(128));
    let growth = fine.evaluations as f64 / coarse.evaluations as f64;
    // Twice the resolution: four times the surface; eight times would be the volume.
    assert!(growth < 5.0, "{coarse:?} {fine:?}");
    // Four spheres bound the sets; at most 3 voxels on either side of each are tested individually.
    let area: f64 = [3.0f64, 4.0, 5.0, 5.5]
        .iter()
        .map(|r| 4.0 * std::f64::consts::PI * r * r)
        .sum();
    let most = 6.0 * area / (16.0f64 / 128.0).powi(2);
    assert!((fine.cut as f64) < most, "{fine:?} {most}");
    for (counters, n) in [(coarse, 64u64), (fine, 128)] {
        assert_eq!(counters.cut + counters.filled, n.pow(3));
    }
    let all = (128u64.pow(3)) * 14;
    assert!(10 * fine.evaluations < all, "{fine:?} of {all}");
}

/// Voxels in and beside a cylinder, by the position of their centre, at multiples of half their side: also at the edge of any map of the
/// cylinder by cells of this side.
#[test]
fn single_voxels_anywhere_contain_their_centre() {
    let cylinder = [Meridian::new(&[[0.0, 1.0], [4.0, 1.0]]).unwrap()];
    for i in -24..=48 {
        for j in 0..=18 {
            let [x, y] = [i, j].map(|k| 0.25 * f64::from(k) + 1e-9 * f64::from(u8::from(k == 4)));
            let grid = VoxelGrid::new([1; 3], [0.5; 3], [x, y, 0.0]).unwrap();
            let sweep = Sweep::of(&[&cylinder[..]], &Pose::identity(), &grid).unwrap();
            let is_inside = 0.0 < x && x < 4.0 && y < 1.0;
            // The end planes are on neither side.
            if i != 0 && i != 16 {
                assert_eq!(sweep.union.count() == 1, is_inside, "{x} {y}");
            }
        }
    }
}

#[test]
fn invalid_shapes_are_rejected() {
    let grid = VoxelGrid::cube(4, 1.0).unwrap();
    let pose = study_pose();
    let cone = Meridian::new(&[[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]).unwrap();
    let one = [cone.clone()];
    let two = [cone.clone(), cone];
    for shapes in [&[][..], &[&[][..]], &[&one[..], &two]] {
        let refused = Sweep::of(shapes, &pose, &grid);
        assert!(
            matches!(
                refused,
                Err(RevolveError::WrongLength { .. } | RevolveError::TooFew { .. })
            ),
            "{refused:?}"
        );
    }
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let shapes = [
        [
            scaled(&[[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]], 1.0),
            scaled(&[[-2.0, 0.0], [0.0, 2.0], [2.0, 0.0]], 1.0),
        ],
        [
            scaled(&[[-1.0, 0.0], [0.0, 1.0], [1.0, 0.0]], 1.3),
            scaled(&[[-2.0, 0.0], [0.0, 2.0], [2.0, 0.0]], 1.1),
        ],
    ];
    let shapes: Vec<&[Meridian]> = shapes.iter().map(|s| &s[..]).collect();
    let grid = VoxelGrid::cube(37, 0.13).unwrap();
    let run = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        let work = || Sweep::of(&shapes, &study_pose(), &grid);
        pool.unwrap().install(work).unwrap()
    };
    assert_eq!(run(1), run(3));
}
