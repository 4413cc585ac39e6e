//! Blur by depth against its definition: the content of each depth convolved with the lattice Gaussian of its own variance.

use crate::common::spect::gaussian;
use radon::{
    Collimator, ImageGrid, LinearOperator, ParallelGeometry, ParallelHoles, SliceAxis,
    SpectGeometry, SpectOperator, SpectOptions,
};

/// Bins and rows, in cm.
const PITCHES: [[f64; 2]; 5] = [[0.2, 0.2], [0.3, 0.3], [0.4, 0.4], [0.5, 0.7], [0.64, 0.64]];

fn collimator() -> Collimator {
    Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38).unwrap()
}

fn at(kernel: &[f64], k: usize) -> f64 {
    kernel.get(k).copied().unwrap_or(0.0)
}

/// The largest deviation of the image of a point in the middle from the product of two kernels, relative to the peak of this product.
fn off(image: &[f64], n: usize, variance: f64, pitch: [f64; 2]) -> f64 {
    let [bins, rows] = pitch.map(|p| gaussian(variance / p / p));
    let exact = |k: usize| {
        let [bin, row] = [k % n, k / n].map(|k| k.abs_diff(n / 2));
        at(&bins, bin) * at(&rows, row)
    };
    let off = (0..n * n).map(|k| (image[k] - exact(k)).abs());
    off.fold(0.0, f64::max) / exact(n * n / 2)
}

/// Points at distances from 1 to 31 cm, and the largest deviation of their images.
fn worst_point(pitch: [f64; 2], tolerance: f64) -> f64 {
    const N: usize = 11;
    const RADIUS: f64 = 16.0;
    let depth = pitch[0];
    let ny = (30.0 / depth).round() as usize;
    let views = ParallelGeometry::new([0.0], N, pitch[0]).unwrap();
    let axis = SliceAxis::new(N, pitch[1]).unwrap();
    let geometry = SpectGeometry::circular(&views, &axis, RADIUS).unwrap();
    let grid = ImageGrid::new(N, ny, depth).unwrap();
    let options = SpectOptions::default()
        .with_collimator(collimator())
        .with_tolerance(tolerance);
    let camera = SpectOperator::<f64>::new(&geometry, &grid, &axis, &options).unwrap();
    let mut worst = 0.0f64;
    let step = if tolerance < 1e-4 { ny / 9 } else { 1 };
    for y in (0..ny).step_by(step) {
        let mut volume = vec![0.0; N * N * ny];
        volume[(N / 2 * ny + y) * N + N / 2] = 1.0 / depth;
        let mut view = vec![0.0; N * N];
        camera.forward_into(&volume, &mut view).unwrap();
        let distance = RADIUS - grid.pixel_centre(N / 2, y)[1];
        let within = (collimator().slope() * depth).powi(2) / 12.0;
        let variance = collimator().variance(distance) + within;
        worst = worst.max(off(&view, N, variance, pitch));
    }
    worst
}

/// The image of a point is within the tolerance of the Gaussian of its plane, at every distance.
#[test]
fn points_of_the_operator_are_within_the_tolerance() {
    for pitch in PITCHES {
        for tolerance in [1e-1, 1e-2, 1e-3, 1e-4] {
            let worst = worst_point(pitch, tolerance);
            println!("{pitch:?}, {tolerance:e}: {worst:.2e}");
            assert!(worst <= tolerance, "{pitch:?}, {tolerance:e}: {worst:e}");
        }
    }
}

/// A case in which steps of nodes alone increased the error from 8e-6 to 4e-2 between two planes.
#[test]
fn points_of_the_operator_at_the_finest_tolerance() {
    let worst = worst_point([0.4, 0.4], 1e-6);
    assert!(worst <= 1e-6, "{worst:e}");
}
