//! The Fourier projector: against its definition, its adjoint and exact bin averages.

use std::f64::consts::PI;

use proptest::prelude::*;
use radon::{
    BinSampling, FourierProjector, ImageGrid, Kernel, LinearOperator, ParallelGeometry, Phantom2,
    Projector, RadonError, adjoint_mismatch,
};

use crate::fourier::{distance, norm, odd_case, period, signs, waves};

/// The projections of the documented kernel.
fn defined(geometry: &ParallelGeometry, grid: &ImageGrid, image: &[f64]) -> Vec<f64> {
    let (period, pitch, [dx, dy]) = (period(geometry, grid), geometry.pitch(), grid.spacing());
    let sinc = |x: f64| {
        if x == 0.0 {
            1.0
        } else {
            (PI * x).sin() / (PI * x)
        }
    };
    let mut expected = Vec::new();
    for theta in geometry.angles() {
        let (sin, cos) = theta.sin_cos();
        let most = 0.5 * pitch / (dx * cos.abs()).max(dy * sin.abs());
        let mut row = vec![0.0; geometry.n_bins()];
        for f in waves(most, period, pitch) {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in image.iter().enumerate() {
                let [x, y] = grid.pixel_centre(i % grid.nx(), i / grid.nx());
                let phase = 2.0 * PI * f * (x * cos + y * sin);
                re += value * phase.cos();
                im -= value * phase.sin();
            }
            let gain = dx * dy / period * sinc(f * pitch);
            for (k, value) in row.iter_mut().enumerate() {
                let phase = 2.0 * PI * f * geometry.bin_centre(k);
                *value += gain * (re * phase.cos() - im * phase.sin());
            }
        }
        expected.extend(row);
    }
    expected
}

#[test]
fn projections_are_those_of_the_definition() {
    for coarse in [0.5, 1.0, 2.0] {
        let (geometry, grid) = odd_case(coarse);
        let image = signs(grid.image_len(), 2);
        let expected = defined(&geometry, &grid, &image);
        for tolerance in [1e-3, 1e-6] {
            let projector = FourierProjector::<f64>::new(&geometry, &grid, tolerance).unwrap();
            let error = distance(&projector.forward(&image).unwrap(), &expected);
            println!("projection, {coarse}, {tolerance:e}: {error:.1e}");
            assert!(error < tolerance, "{coarse} {tolerance:e}: {error:e}");
        }
    }
}

/// Images whose positive and negative pixels cancel, single views and single rows: the error is relative to the projections of the magnitudes.
#[test]
fn the_tolerance_bounds_the_error_relative_to_projected_magnitudes() {
    let mut worst = 0.0_f64;
    for (n_views, nx, ny) in [
        (1, 7, 1),
        (1, 20, 1),
        (1, 1, 16),
        (2, 16, 16),
        (5, 3, 11),
        (12, 20, 20),
    ] {
        // Half a bin on either side of the farthest pixel.
        let n_bins = nx.max(ny) * 3 / 2 + 2;
        let geometry = ParallelGeometry::half_turn(n_views, n_bins, 1.0).unwrap();
        let grid = ImageGrid::new(nx, ny, 1.0).unwrap();
        let checks = (0..nx * ny).map(|i| {
            if (i % nx + i / nx) % 2 == 0 {
                1.0
            } else {
                -1.0
            }
        });
        let mut images: Vec<Vec<f64>> = vec![checks.collect()];
        images.extend((0..4).map(|seed| signs(nx * ny, seed)));
        for image in images {
            let expected = defined(&geometry, &grid, &image);
            let magnitudes: Vec<f64> = image.iter().map(|x| x.abs()).collect();
            let size = norm(&defined(&geometry, &grid, &magnitudes));
            for tolerance in [1e-2, 1e-4, 1e-6] {
                let projector = FourierProjector::<f64>::new(&geometry, &grid, tolerance).unwrap();
                let got = projector.forward(&image).unwrap();
                let difference: Vec<f64> = got.iter().zip(&expected).map(|(a, b)| a - b).collect();
                worst = worst.max(norm(&difference) / size / tolerance);
            }
        }
    }
    println!("error over tolerance and projected magnitudes: {worst:.2}");
    assert!(worst < 1.0, "{worst}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_fourier_pair_is_adjoint_for_any_geometry(
        (n_views, n_bins, nx, ny) in (1_usize..12, 1_usize..40, 1_usize..30, 1_usize..30),
        (start, step, offset, centre) in (-7.0..7.0, 0.01..3.0, -2.0..2.0, -3.0..3.0),
        (pitch, dx, dy) in (0.2..2.0, 0.1..3.0, 0.1..3.0),
        digits in 2_i32..7,
    ) {
        let angles: Vec<f64> = (0..n_views).map(|k| start + step * k as f64).collect();
        let geometry = ParallelGeometry::from_radians(angles, n_bins, pitch).unwrap().with_offset(offset).unwrap();
        let grid = ImageGrid::anisotropic(nx, ny, [dx, dy]).unwrap().with_centre([centre, -offset]).unwrap();
        let projector = FourierProjector::<f64>::new(&geometry, &grid, 10.0_f64.powi(-digits)).unwrap();
        prop_assert!(adjoint_mismatch(&projector, 3).unwrap() <= 1e-12);
    }
}

#[test]
fn the_fourier_projector_has_the_error_of_joseph_or_less() {
    let geometry = ParallelGeometry::half_turn(60, 128, 1.0).unwrap();
    let grid = ImageGrid::square(128, 1.0).unwrap();
    let phantom = Phantom2::shepp_logan(64.0).unwrap();
    let exact: Vec<f64> = phantom.sinogram(&geometry, BinSampling::Mean).unwrap();
    let image: Vec<f64> = phantom.image(&grid).unwrap();
    let joseph = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    let joseph = distance(&joseph.forward(&image).unwrap(), &exact);
    let fourier = FourierProjector::new(&geometry, &grid, 1e-4).unwrap();
    let fourier = distance(&fourier.forward(&image).unwrap(), &exact);
    println!("against exact bin means: Joseph {joseph:.5}, Fourier {fourier:.5}");
    assert!(fourier < 1.02 * joseph);
}

#[test]
fn a_view_does_not_depend_on_the_others() {
    // Pixels as large as bins: the largest frequency of the first view is half a period, that of the second is beyond it.
    let grid = ImageGrid::square(16, 1.0).unwrap();
    let image = signs(256, 12);
    let rows = |angles: &[f64]| {
        let geometry = ParallelGeometry::new(angles.to_vec(), 20, 1.0).unwrap();
        let projector = FourierProjector::<f64>::new(&geometry, &grid, 1e-6).unwrap();
        projector.forward(&image).unwrap()
    };
    let (alone, among) = (rows(&[0.0]), rows(&[0.0, 0.7]));
    // Rounding: a term of the frequency in question is 1e-2 of the row.
    assert!(distance(&alone, &among[..20]) < 1e-13);
}

/// The copies of a row's spectrum grow with the pitch in pixels.
#[test]
fn bins_that_are_far_wider_than_pixels_are_an_error() {
    let of = |pitch: f64, spacing: f64| {
        let geometry = ParallelGeometry::half_turn(3, 100, pitch).unwrap();
        let grid = ImageGrid::square(16, spacing).unwrap();
        FourierProjector::<f64>::new(&geometry, &grid, 1e-4)
    };
    for (pitch, spacing) in [(1e6, 1.0), (1e200, 1.0), (1.0, 1e-200), (1e12, 1e-200)] {
        let error = of(pitch, spacing).map(drop).unwrap_err();
        let is_typed = matches!(
            error,
            RadonError::OutOfRange { .. } | RadonError::NotFinite { .. }
        );
        assert!(is_typed, "{pitch} {spacing}: {error}");
    }
    // A detector of bins as wide as the image: the sum over the bins is the integral.
    let projector = of(16.0, 1.0).unwrap();
    let row: Vec<f64> = projector.forward(&[1.0; 256]).unwrap();
    let sum: f64 = row[..100].iter().sum();
    assert!((16.0 * sum / 256.0 - 1.0).abs() < 1e-3, "{sum}");
}
