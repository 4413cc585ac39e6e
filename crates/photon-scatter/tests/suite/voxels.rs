//! Ready sources and media against analytic shapes.

use crate::support::{Point, camera, photopeak};
use photon_scatter::{
    Medium, Piece, PointSource, Random, Scatter, ScatterError, ScatterOptions, Source, VoxelMedium,
    VoxelSource,
};

/// The stretch of a ray ahead in a box about the origin.
struct Brick([f64; 3]);

impl Medium for Brick {
    fn pieces(&self, p: [f64; 3], d: [f64; 3], pieces: &mut Vec<Piece>) {
        let (mut enter, mut exit) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let ends = [-1.0, 1.0].map(|side| (side * self.0[k] - p[k]) / d[k]);
            enter = enter.max(ends[0].min(ends[1]));
            exit = exit.min(ends[0].max(ends[1]));
        }
        if enter < exit {
            let density = 1.0;
            pieces.push(Piece {
                enter,
                exit,
                density,
            });
        }
    }
}

fn pieces(medium: &dyn Medium, position: [f64; 3], direction: [f64; 3]) -> Vec<Piece> {
    let mut pieces = Vec::new();
    medium.pieces(position, direction, &mut pieces);
    pieces
}

#[test]
fn uniform_voxels_are_a_box() {
    let medium = VoxelMedium::new([5, 4, 3], [0.5, 1.0, 2.0], &[1.0; 60]).unwrap();
    let brick = Brick([1.25, 2.0, 3.0]);
    let mut random = Random::new(1, 0);
    for k in 0..20_000 {
        let position = [0; 3].map(|_| 10.0 * random.uniform() - 5.0);
        let mut direction = random.direction();
        if k % 10 < 3 {
            direction = [0.0; 3];
            direction[k % 3] = if k % 2 == 0 { 1.0 } else { -1.0 };
        }
        let (found, exact) = (
            pieces(&medium, position, direction),
            pieces(&brick, position, direction),
        );
        let long = |all: &[Piece]| all.iter().map(|p| p.exit - p.enter).sum::<f64>();
        assert!(
            (long(&found) - long(&exact)).abs() < 1e-12,
            "{position:?} {direction:?}"
        );
        assert!(found.len() <= 1, "{found:?}");
        if long(&exact) > 1e-9 {
            assert!((found[0].enter - exact[0].enter).abs() < 1e-12);
        }
    }
}

/// Densities that differ everywhere: column densities against samples along the ray.
#[test]
fn pieces_have_the_densities_of_their_voxels() {
    let density: Vec<f32> = (0..60).map(|k| (k * 7 % 11) as f32).collect();
    let medium = VoxelMedium::new([5, 4, 3], [0.5, 1.0, 2.0], &density).unwrap();
    let at = |p: [f64; 3]| {
        let [x, y, z] = [p[0] / 0.5 + 2.5, p[1] + 2.0, p[2] / 2.0 + 1.5].map(f64::floor);
        let inside = (0.0..5.0).contains(&x) && (0.0..4.0).contains(&y) && (0.0..3.0).contains(&z);
        match inside {
            true => f64::from(density[((z * 4.0 + y) * 5.0 + x) as usize]),
            false => 0.0,
        }
    };
    let mut random = Random::new(2, 0);
    for _ in 0..300 {
        let position = [0; 3].map(|_| 8.0 * random.uniform() - 4.0);
        let direction = random.direction();
        let found = pieces(&medium, position, direction);
        for piece in &found {
            let middle = 0.5 * (piece.enter + piece.exit);
            let point = std::array::from_fn(|k| position[k] + middle * direction[k]);
            let length = piece.exit - piece.enter;
            assert!(length < 1e-12 || piece.density == at(point), "{piece:?}");
        }
        let n = 16_000;
        let step = 16.0 / f64::from(n);
        let sampled: f64 = (0..n)
            .map(|k| (f64::from(k) + 0.5) * step)
            .map(|t| step * at(std::array::from_fn(|k| position[k] + t * direction[k])))
            .sum();
        let column: f64 = found.iter().map(|p| p.density * (p.exit - p.enter)).sum();
        assert!((column - sampled).abs() < 0.1, "{column} {sampled}");
    }
}

#[test]
fn voxels_emit_in_proportion_to_their_activity() {
    let source = VoxelSource::new([2, 1, 3], [1.0, 2.0, 3.0], &[0.0, 1.0, 2.0, 3.0, 0.0, 4.0]);
    let source = source.unwrap();
    let (mut random, mut counts) = (Random::new(3, 0), [0_i32; 6]);
    for _ in 0..10_000 {
        let emission = source.emit(&mut random);
        assert_eq!(emission.weight, 60.0);
        let [x, y, z] = emission.position;
        assert!(x.abs() <= 1.0 && y.abs() <= 1.0 && z.abs() <= 4.5);
        counts[2 * ((z + 4.5) / 3.0) as usize + usize::from(x > 0.0)] += 1;
    }
    assert_eq!([counts[0], counts[4]], [0, 0]);
    for (voxel, expected) in [(1, 1000), (2, 2000), (3, 3000), (5, 4000)] {
        assert!((counts[voxel] - expected).abs() < 200, "{counts:?}");
    }
}

/// A point, a box and the same as voxels; voxels of half the size are one box too.
#[test]
fn scatter_of_voxels_is_that_of_the_box() {
    let (camera, options) = (camera(20, 1.0, &[0.0, 90.0]), ScatterOptions::new(2e-3));
    let half = [8.0, 6.0, 7.0];
    let run = |source: &dyn Source, medium: &dyn Medium, seed| {
        let options = options.with_seed(seed);
        Scatter::new(source, medium, &camera, &photopeak(), &options).unwrap()
    };
    let position = [1.0, 2.0, 0.0];
    let exact = run(&Point(position, 1.0), &Brick(half), 1);
    let medium = VoxelMedium::new([16, 12, 14], [1.0; 3], &[1.0; 16 * 12 * 14]).unwrap();
    let activity = 1.0;
    let found = run(&PointSource { position, activity }, &medium, 2);
    for view in 0..2 {
        let ([a, first], [b, second]) = (exact.sum(0, view), found.sum(0, view));
        assert!((a - b).abs() < 4.0 * first.hypot(second), "{a} {b}");
    }
}

#[test]
fn voxels_are_checked() {
    for (size, spacing, value) in [
        ([2, 2, 2], [1.0; 3], 1.0),
        ([0, 2, 2], [1.0; 3], 1.0),
        ([1, 2, 2], [0.0; 3], 1.0),
        ([1, 2, 2], [f64::NAN; 3], 1.0),
        ([1, 2, 2], [1.0; 3], -1.0),
        ([1, 2, 2], [1.0; 3], f32::NAN),
        ([1, 2, 2], [1.0; 3], f32::INFINITY),
    ] {
        let source = VoxelSource::new(size, spacing, &[value; 4]);
        let medium = VoxelMedium::new(size, spacing, &[value; 4]);
        for error in [source.unwrap_err(), medium.unwrap_err()] {
            assert!(matches!(error, ScatterError::OutOfRange { .. }));
        }
    }
    assert!(VoxelMedium::new([1; 3], [1.0; 3], &[31.0]).is_err());
    // Nothing emitted: no scatter.
    let (empty, medium) = (
        VoxelSource::new([1; 3], [1.0; 3], &[0.0]).unwrap(),
        VoxelMedium::new([1; 3], [1.0; 3], &[1.0]).unwrap(),
    );
    let camera = camera(4, 1.0, &[0.0]);
    let scatter = Scatter::new(
        &empty,
        &medium,
        &camera,
        &photopeak(),
        &ScatterOptions::new(1.0),
    );
    assert_eq!(scatter.unwrap().sum(0, 0), [0.0; 2]);
}

/// A grid moved by some voxels is a larger grid with empty voxels.
#[test]
fn grids_have_centres() {
    let mut values = vec![0.0; 8 * 4 * 6];
    for k in 0..2 * 2 * 2 {
        let [x, y, z] = [k % 2 + 5, k / 2 % 2 + 1, k / 4 + 3];
        values[(z * 4 + y) * 8 + x] = 1.0;
    }
    let large = VoxelMedium::new([8, 4, 6], [0.5; 3], &values).unwrap();
    let centre = [1.0, 0.0, 0.5];
    let small = VoxelMedium::new([2; 3], [0.5; 3], &[1.0; 8]).unwrap();
    let small = small.with_centre(centre).unwrap();
    let direction = [0.6, -0.48, 0.64];
    let column = |medium: &VoxelMedium, x: f64| {
        let mut pieces = Vec::new();
        medium.pieces([x - 3.0, 2.4, -2.7], direction, &mut pieces);
        let lengths = pieces
            .iter()
            .map(|piece| piece.density * (piece.exit - piece.enter));
        lengths.sum::<f64>()
    };
    let mut most = 0.0f64;
    for k in 0..20 {
        let x = 0.1 * f64::from(k);
        let (a, b) = (column(&large, x), column(&small, x));
        assert!((a - b).abs() < 1e-12, "{x}: {a} {b}");
        most = most.max(a);
    }
    assert!(most > 0.5);
    let source = VoxelSource::new([2; 3], [0.5; 3], &[1.0; 8]).unwrap();
    let source = source.with_centre(centre).unwrap();
    let mut random = Random::new(1, 0);
    for _ in 0..100 {
        let at = source.emit(&mut random).position;
        assert!((0..3).all(|k| (at[k] - centre[k]).abs() <= 0.5));
    }
    assert!(source.with_centre([0.0, f64::NAN, 0.0]).is_err());
    assert_eq!(
        VoxelSource::new([4; 3], [1.0; 3], &[0.0; 63])
            .unwrap_err()
            .to_string(),
        "number of values of the voxels is 63; it must be 64"
    );
}
