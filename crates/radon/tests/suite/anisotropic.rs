//! Rectangular pixels: exact sinograms, comparison with finer square pixels, reconstruction.

use crate::common;

use common::{Ellipse, half_turn, mean_where};
use radon::{
    BinSampling, FbpOptions, FbpPlan, ImageGrid, Kernel, LinearOperator, ParallelGeometry,
    Phantom2, Projector, Shape2, SirtOptions, Stopping, Window, sirt,
};
use std::f64::consts::PI;

/// Pseudo-random samples in [-1, 1).
fn noise(n: usize) -> Vec<f64> {
    (0..n).map(|i| (12.9898 * i as f64 + 1.0).sin()).collect()
}

fn grid(n: [usize; 2], spacing: [f64; 2], centre: [f64; 2]) -> ImageGrid {
    ImageGrid::anisotropic(n[0], n[1], spacing)
        .and_then(|g| g.with_centre(centre))
        .unwrap()
}

/// Relative L2 distance between projected pixel averages and the exact sinogram: line integrals for kernels of rays, bin averages for strips.
fn projection_error(
    phantom: &Phantom2,
    geometry: &ParallelGeometry,
    grid: &ImageGrid,
    kernel: Kernel,
) -> f64 {
    let sampling = match kernel {
        Kernel::Strip => BinSampling::Mean,
        _ => BinSampling::Centre,
    };
    let exact: Vec<f64> = phantom.sinogram(geometry, sampling).unwrap();
    let projector = Projector::new(geometry, grid, kernel).unwrap();
    let got: Vec<f64> = projector.forward(&phantom.image(grid).unwrap()).unwrap();
    let square = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
    square(&mut got.iter().zip(&exact).map(|(a, b)| a - b)) / square(&mut exact.iter().copied())
}

#[test]
fn projections_converge_to_exact_sinograms() {
    let geometry = ParallelGeometry::half_turn(24, 40, 0.35).unwrap();
    let solid = Phantom2::new([
        (1.0, Shape2::ellipse([1.3, -0.9], [2.4, 1.1], 0.4).unwrap()),
        (
            0.7,
            Shape2::rectangle([-1.5, 1.2], [1.7, 2.9], -0.3).unwrap(),
        ),
    ])
    .unwrap();
    let hills = Phantom2::new([
        (1.0, Shape2::gaussian([1.3, -0.9], [1.1, 0.7], 0.4).unwrap()),
        (0.7, Shape2::gaussian([-1.0, 1.0], [0.6, 0.8], 0.0).unwrap()),
    ])
    .unwrap();
    // Orders in the pixel size. Smooth objects: linear interpolation and areas have order two. Solids: rays that graze an edge intersect blurred pixels.
    let orders = [(Kernel::Joseph, 1.0, 2.0), (Kernel::Strip, 1.85, 2.0)];
    for (nx, ny) in [(24, 12), (8, 24)] {
        for (kernel, of_solid, of_hills) in orders {
            for (phantom, order) in [(&solid, of_solid), (&hills, of_hills)] {
                let error = |k: usize| {
                    let n = [k * nx, k * ny];
                    let spacing = n.map(|n| 12.0 / n as f64);
                    projection_error(phantom, &geometry, &grid(n, spacing, [0.0; 2]), kernel)
                };
                let (coarse, fine) = (error(2), error(8));
                let measured = (coarse / fine).log2() / 2.0;
                assert!(
                    (measured - order).abs() < 0.2,
                    "{nx} x {ny} {kernel:?}: {coarse:.4} to {fine:.4}, order {measured:.2}"
                );
                // The level too, so that a common factor is detected.
                assert!(fine < 0.021, "{nx} x {ny} {kernel:?}: {fine}");
            }
        }
    }
}

#[test]
fn a_tall_pixel_is_a_column_of_square_ones() {
    // Exact lengths and areas add up; so does their adjoint.
    let geometry = ParallelGeometry::new([0.0, 0.3, 1.1, PI / 2.0, 2.0, 2.9, 4.0], 31, 0.7)
        .and_then(|g| g.with_offset(0.13))
        .unwrap();
    for k in [2, 3] {
        for along_x in [true, false] {
            let (cut, whole) = if along_x {
                (
                    grid([12 * k, 15], [0.5, 0.5], [0.4, -0.3]),
                    grid([12, 15], [0.5 * k as f64, 0.5], [0.4, -0.3]),
                )
            } else {
                (
                    grid([12, 15 * k], [0.5, 0.5], [0.4, -0.3]),
                    grid([12, 15], [0.5, 0.5 * k as f64], [0.4, -0.3]),
                )
            };
            // The large pixel that contains a small one.
            let holder = |i: usize| {
                let (ix, iy) = (i % cut.nx(), i / cut.nx());
                if along_x {
                    iy * 12 + ix / k
                } else {
                    iy / k * 12 + ix
                }
            };
            let image = noise(whole.image_len());
            let fine: Vec<f64> = (0..cut.image_len()).map(|i| image[holder(i)]).collect();
            let project = |grid| Projector::new(&geometry, grid, Kernel::Strip).unwrap();
            let (a, b) = (
                project(&whole).forward(&image).unwrap(),
                project(&cut).forward(&fine).unwrap(),
            );
            for (a, b) in a.iter().zip(&b) {
                assert!((a - b).abs() < 1e-12, "{k} {a} {b}");
            }
            let rays = noise(geometry.sinogram_len());
            let coarse = project(&whole).adjoint(&rays).unwrap();
            let mut summed = vec![0.0; whole.image_len()];
            for (i, x) in project(&cut).adjoint(&rays).unwrap().iter().enumerate() {
                summed[holder(i)] += x;
            }
            for (a, b) in coarse.iter().zip(&summed) {
                assert!((a - b).abs() < 1e-12, "{k} {a} {b}");
            }
        }
    }
}

#[test]
fn fbp_equals_that_of_square_pixels_at_the_same_positions() {
    // The middle one of three small pixels is at the position of the large one.
    let geometry = half_turn(40, 61, 0.3).with_offset(0.05).unwrap();
    let ellipse = Ellipse {
        centre: [1.2, -0.8],
        a: 3.0,
        b: 1.7,
        phi: 0.5,
    };
    let sinogram = ellipse.sinogram(&geometry);
    let fine = grid([60, 63], [0.2, 0.2], [0.1, 0.3]);
    let reconstruct = |grid: &ImageGrid| {
        FbpPlan::<f64>::new(&geometry, grid, &FbpOptions::default())
            .unwrap()
            .reconstruct(&sinogram)
            .unwrap()
    };
    let all = reconstruct(&fine);
    let tall = reconstruct(&grid([60, 21], [0.2, 0.6], [0.1, 0.3]));
    let wide = reconstruct(&grid([20, 63], [0.6, 0.2], [0.1, 0.3]));
    for iy in 0..63 {
        for ix in 0..60 {
            let here = all[iy * 60 + ix];
            // A position in a row of 61 samples has an error of about 1e-14, and the slope of the row is at most about 10.
            if iy % 3 == 1 {
                assert!((tall[iy / 3 * 60 + ix] - here).abs() < 1e-11);
            }
            if ix % 3 == 1 {
                assert!((wide[iy * 20 + ix / 3] - here).abs() < 1e-11);
            }
        }
    }
}

#[test]
fn an_ellipse_is_reconstructed_with_position_and_value() {
    let geometry = half_turn(120, 161, 0.05).with_offset(0.013).unwrap();
    let ellipse = Ellipse {
        centre: [0.7, -0.5],
        a: 1.1,
        b: 0.6,
        phi: 0.4,
    };
    let sinogram = ellipse.sinogram(&geometry);
    for (n, spacing) in [([100, 50], [0.05, 0.1]), ([40, 120], [0.12, 0.04])] {
        let grid = grid(n, spacing, [0.3, -0.2]);
        let options = FbpOptions::default().with_window(Window::Hann);
        let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
        let image = plan.reconstruct(&sinogram).unwrap();
        let inside = mean_where(&image, &grid, |p| ellipse.level(p) < 0.8) - 1.0;
        assert!(inside.abs() < 5e-4, "amplitude {inside:.1e}");
        let mut sums = [0.0; 3];
        for iy in 0..n[1] {
            for ix in 0..n[0] {
                let ([x, y], value) = (grid.pixel_centre(ix, iy), image[iy * n[0] + ix]);
                if ellipse.level([x, y]) < 1.5 {
                    sums = [sums[0] + value, sums[1] + value * x, sums[2] + value * y];
                }
            }
        }
        let mass = sums[0] * spacing[0] * spacing[1] / (PI * 1.1 * 0.6);
        assert!((mass - 1.0).abs() < 5e-3, "{mass}");
        for (axis, expected) in [0.7, -0.5].into_iter().enumerate() {
            let error = (sums[axis + 1] / sums[0] - expected).abs() / spacing[axis];
            assert!(error < 0.02, "axis {axis}: error {error:.4} pixels");
        }
    }
}

#[test]
fn row_sums_are_chords_of_the_grid_and_sirt_recovers_the_image() {
    let geometry = ParallelGeometry::half_turn(36, 30, 0.4)
        .and_then(|g| g.with_offset(0.1))
        .unwrap();
    for (n, spacing) in [([16, 8], [0.5, 1.0]), ([6, 18], [1.2, 0.4])] {
        let grid = grid(n, spacing, [0.3, -0.2]);
        let field = [n[0] as f64 * spacing[0], n[1] as f64 * spacing[1]];
        let outline = Shape2::rectangle([0.3, -0.2], field, 0.0).unwrap();
        let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
        let sums: Vec<f64> = projector.forward(&vec![1.0; grid.image_len()]).unwrap();
        for (i, sum) in sums.iter().enumerate() {
            let (view, bin) = (i / 30, i % 30);
            let chord = outline.bin_mean(geometry.angles()[view], geometry.bin_centre(bin), 0.4);
            assert!((sum - chord).abs() < 1e-12, "{sum} {chord}");
        }
        let truth: Vec<f64> = noise(grid.image_len()).iter().map(|x| 2.0 + x).collect();
        let data = projector.forward(&truth).unwrap();
        let mut image = vec![0.0; truth.len()];
        let stopping = Stopping::default()
            .with_max_iterations(5000)
            .with_residual(1e-6);
        let options = SirtOptions::default().with_stopping(stopping);
        sirt(&projector, &data, &mut image, &options, radon::no_observer).unwrap();
        for (a, b) in image.iter().zip(&truth) {
            // The residual of 1e-6 over the smallest relevant singular value; measured 7e-5.
            assert!((a - b).abs() < 5e-4, "{a} {b}");
        }
    }
}
