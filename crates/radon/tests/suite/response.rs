//! Blur by depth against its definition: the content of each depth convolved with the lattice Gaussian of its own variance.

use crate::common::noise;
use crate::common::spect::gaussian;
use radon::{
    Collimator, DepthBlur, ImageGrid, LinearOperator, ParallelGeometry, ParallelHoles, SliceAxis,
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

/// The same for slabs, whose largest deviation is reported.
#[test]
fn points_of_slabs_are_within_the_reported_error() {
    const N: usize = 41;
    for pitch in PITCHES {
        for tolerance in [1e-1, 1e-2, 1e-3, 1e-4] {
            let distances = (0..=30).map(|k| 1.0 + f64::from(k));
            let variances: Vec<f64> = distances.map(|d| collimator().variance(d)).collect();
            let blur = DepthBlur::new(&variances, pitch, tolerance).unwrap();
            let n = variances.len();
            let mut worst = 0.0f64;
            for (slab, &variance) in variances.iter().enumerate() {
                let mut slabs = vec![0.0; N * n * N];
                slabs[(N / 2 * n + slab) * N + N / 2] = 1.0;
                let mut image = vec![0.0; N * N];
                blur.apply(&slabs, N, 0, &mut image).unwrap();
                worst = worst.max(off(&image, N, variance, pitch));
            }
            let error = blur.error().unwrap();
            println!("{pitch:?}, {tolerance:e}: {worst:.2e} of {error:.2e}");
            // 31 distances do not contain the worst one between each pair of nodes.
            assert!(worst <= error && error <= tolerance, "{worst:e} {error:e}");
            assert!(worst > 0.5 * error, "{pitch:?}: {worst:e} {error:e}");
        }
    }
}

/// Rows of random slabs, from the middle of the given ones, against the sum of the definition.
#[test]
fn slabs_are_added_as_defined() {
    let (n_bins, n_rows, above, given) = (17, 5, 3, 11);
    let (pitch, variances) = ([0.3, 0.4], [0.02, 0.3, 0.11, 0.04]);
    let blur = DepthBlur::new(&variances, pitch, 1e-4).unwrap();
    let slabs = noise(given * 4 * n_bins, 3);
    let slabs: Vec<f64> = slabs.into_iter().map(f64::abs).collect();
    let mut out = vec![0.0; n_rows * n_bins];
    blur.apply(&slabs, n_bins, above, &mut out).unwrap();
    for (k, value) in out.iter().enumerate() {
        let (bin, row) = (k % n_bins, above + k / n_bins);
        let (mut exact, mut peaks) = (0.0, 0.0);
        for (slab, variance) in variances.iter().enumerate() {
            let [bins, rows] = pitch.map(|p| gaussian(variance / p / p));
            for (j, v) in slabs.iter().enumerate() {
                let (from, own, line) = (j % n_bins, j / n_bins % 4, j / n_bins / 4);
                if own == slab {
                    exact += v * at(&bins, bin.abs_diff(from)) * at(&rows, row.abs_diff(line));
                    peaks += v * bins[0] * rows[0];
                }
            }
        }
        // The error of each sample of a slab may be the tolerance of its peak.
        assert!((value - exact).abs() < 1e-4 * peaks, "{k}: {value} {exact}");
        // The absolute deviations of all samples of a point's image add up to 3 tolerances at most.
        assert!((value - exact).abs() < 3e-4 * exact, "{k}: {value} {exact}");
    }
}
