//! A slice from exact projections by FBP and by OSEM, and the errors of both within the object.
//!
//! `cargo run --release -p radon-fbp --example reconstruct`

use radon::{
    BinSampling, EmOptions, FbpOptions, FbpPlan, ImageGrid, Kernel, ParallelGeometry, Phantom2,
    Projector, StackOrder, Stopping, Window, disc_mask, no_observer, osem, rmse_within,
};

fn main() -> Result<(), radon::RadonError> {
    // 120 views over a half turn, 128 bins of 0.1 cm; 128 x 128 pixels of 0.1 cm.
    let geometry = ParallelGeometry::half_turn(120, 128, 0.1)?;
    let grid = ImageGrid::square(128, 0.1)?;

    // The object is analytic: its projections are averages of exact line integrals over each bin, [view][bin].
    let object = Phantom2::shepp_logan(6.0)?;
    let sinogram: Vec<f32> = object.sinogram(&geometry, BinSampling::Mean)?;
    let truth: Vec<f32> = object.image(&grid)?;

    // A plan is made once for any number of slices; the image is [y][x].
    let options = FbpOptions::default().with_window(Window::Hann);
    let fbp = FbpPlan::new(&geometry, &grid, &options)?.reconstruct(&sinogram)?;

    // Ten iterations with twelve subsets of ten views each, from a uniform image.
    let projector = Projector::new(&geometry, &grid, Kernel::Strip)?;
    let subsets = projector
        .stack_operator(1, StackOrder::ViewSliceBin)?
        .subsets(12)?;
    let mut image = vec![1.0; grid.image_len()];
    let options = EmOptions::default().with_stopping(Stopping::default().with_max_iterations(10));
    let report = osem(&subsets, &sinogram, &mut image, &options, no_observer)?;

    let mask = disc_mask(&grid, 6.0)?;
    for (name, image) in [("FBP", &fbp), ("OSEM", &image)] {
        let error = rmse_within(image, &truth, &mask)?.unwrap_or(f64::NAN);
        println!("{name}: root mean square error {error:.4}");
    }
    for (k, iteration) in report.history.iter().enumerate() {
        println!(
            "iteration {k}: relative residual {:.1e}",
            iteration.residual
        );
    }
    Ok(())
}
