//! FBP against closed forms: amplitude, position, orientation.

mod common;

use common::{Ellipse, half_turn, mean_where};
use radon::{FbpOptions, FbpPlan, ImageGrid, Interpolation, Window};

#[test]
fn amplitude_of_an_off_centre_disc_is_right_for_every_window() {
    let (n, geometry) = (256, half_turn(90, 256, 1.0));
    let grid = ImageGrid::square(n, 1.0).unwrap();
    let disc = Ellipse::disc([0.1 * n as f64, -0.05 * n as f64], 0.3 * n as f64);
    let sinogram = disc.sinogram(&geometry);
    for window in [
        Window::RamLak,
        Window::SheppLogan,
        Window::Cosine,
        Window::Hamming,
        Window::Hann,
        Window::Butterworth { order: 4 },
    ] {
        for interpolation in [Interpolation::Linear, Interpolation::BandLimited] {
            let options = FbpOptions {
                window: window.clone(),
                interpolation,
                ..Default::default()
            };
            let image = FbpPlan::<f64>::new(&geometry, &grid, &options)
                .unwrap()
                .reconstruct(&sinogram)
                .unwrap();
            // Point-sampled chords miss the disc's area by up to 2.7e-4 a view (square-root ends), a few 1e-5 over 90 views;
            // six pixels keep the ringing of the edge out.
            let inside = mean_where(&image, &grid, |p| disc.level(p) < 1.0 - 6.0 / disc.a) - 1.0;
            let outside = mean_where(&image, &grid, |p| {
                disc.level(p) > 1.0 + 6.0 / disc.a && p[0].hypot(p[1]) < 127.0
            });
            assert!(
                inside.abs() < 7e-5 && outside.abs() < 5e-5,
                "{window:?} {interpolation:?}: {inside:.1e} {outside:.1e}"
            );
        }
    }
}

/// Centroid of the image, in length units, over a neighbourhood that holds the whole ellipse (and little of the streaks).
fn centroid(image: &[f64], grid: &ImageGrid, ellipse: &Ellipse) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for iy in 0..grid.ny() {
        for ix in 0..grid.nx() {
            let ([x, y], value) = (grid.pixel_centre(ix, iy), image[iy * grid.nx() + ix]);
            if ellipse.level([x, y]) > 1.5 {
                continue;
            }
            sums = [sums[0] + value, sums[1] + value * x, sums[2] + value * y];
        }
    }
    [sums[1] / sums[0], sums[2] / sums[0]]
}

#[test]
fn an_off_centre_ellipse_comes_out_where_it_is_for_even_and_odd_sizes_and_any_axis_of_rotation() {
    // Lengths in cm, pitch other than spacing, a detector shifted by a fraction of a bin, a grid off the axis.
    for (nx, ny, n_bins, offset) in [
        (96, 80, 160, 0.0),
        (97, 81, 161, 0.013),
        (96, 81, 160, -0.4),
    ] {
        let geometry = half_turn(120, n_bins, 0.05).with_offset(offset).unwrap();
        let grid = ImageGrid::new(nx, ny, 0.06)
            .unwrap()
            .with_centre([0.3, -0.2])
            .unwrap();
        let ellipse = Ellipse {
            centre: [0.7, -0.5],
            a: 1.1,
            b: 0.6,
            phi: 0.4,
        };
        let options = FbpOptions::default().with_window(Window::Hann);
        let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
        let image = plan.reconstruct(&ellipse.sinogram(&geometry)).unwrap();
        let inside = mean_where(&image, &grid, |p| ellipse.level(p) < 0.8) - 1.0;
        assert!(inside.abs() < 5e-4, "amplitude {inside:.1e}");
        let [x, y] = centroid(&image, &grid, &ellipse);
        let error = (x - 0.7).hypot(y + 0.5) / grid.spacing();
        assert!(
            error < 0.02,
            "{nx} x {ny}, {n_bins} bins, offset {offset}: off by {error:.4} pixels"
        );
    }
}
