//! The transpose of FBP, against the reconstruction itself.

use radon::{
    EdgePolicy, FbpMethod, FbpOptions, FbpPlan, ImageGrid, Interpolation, ParallelGeometry,
    RadonError, Window,
};

/// Pseudo-random numbers between -1 and 1.
fn numbers(n: usize, seed: f64) -> Vec<f64> {
    (0..n)
        .map(|k| (12.9898 * (k as f64 + seed)).sin() * 43758.5453)
        .map(|x| 2.0 * (x - x.floor()) - 1.0)
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn the_adjoint_is_the_transpose_of_the_reconstruction() {
    // Rows longer than the image, and an image wider than the rows; an off-centre axis.
    for (n_bins, nx, ny) in [(40, 17, 12), (9, 31, 26)] {
        let angles = (0..23).map(|k| 0.1 + 0.29 * f64::from(k));
        let geometry = ParallelGeometry::new(angles.collect::<Vec<_>>(), n_bins, 0.7).unwrap();
        let geometry = geometry.with_offset(0.3).unwrap();
        let grid = ImageGrid::new(nx, ny, 0.9).unwrap();
        let options = FbpOptions::default();
        for options in [
            options.clone().with_method(FbpMethod::Direct),
            options
                .clone()
                .with_method(FbpMethod::Direct)
                .with_ramp(false),
            options.clone().with_window(Window::Hann).with_cutoff(0.6),
            options
                .clone()
                .with_method(FbpMethod::Direct)
                .with_region(3..11, 2..9),
            options
                .clone()
                .with_method(FbpMethod::Fourier { tolerance: 1e-4 }),
        ] {
            let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
            let p = numbers(plan.sinogram_len(), 0.3);
            let f = numbers(plan.image_len(), 0.7);
            let reconstructed = dot(&plan.reconstruct(&p).unwrap(), &f);
            let transposed = dot(&p, &plan.adjoint(&f).unwrap());
            let scale = dot(&f, &f).sqrt() * dot(&p, &p).sqrt();
            // Rounding of about a thousand terms and of positions in bins.
            let difference = (reconstructed - transposed).abs();
            assert!(
                difference < 1e-12 * scale,
                "{options:?}: {difference} of {scale}"
            );
        }
    }
}

#[test]
fn a_plan_without_an_adjoint_names_the_required_option() {
    let geometry = ParallelGeometry::half_turn(8, 16, 1.0).unwrap();
    let grid = ImageGrid::square(16, 1.0).unwrap();
    let options = FbpOptions::default().with_method(FbpMethod::Direct);
    for (options, needed) in [
        (
            options
                .clone()
                .with_interpolation(Interpolation::BandLimited),
            "linear interpolation",
        ),
        (
            options.clone().with_edge(EdgePolicy::Ellipse),
            "the edge policy zero",
        ),
    ] {
        let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
        let error = plan.adjoint(&[0.0; 256]).unwrap_err();
        assert_eq!(error, RadonError::NoAdjoint { what: needed });
    }
    let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
    assert!(matches!(
        plan.adjoint(&[0.0; 255]),
        Err(RadonError::WrongLength { .. })
    ));
    assert!(matches!(
        plan.adjoint(&[f64::NAN; 256]),
        Err(RadonError::BadSample { index: 0, .. })
    ));
}
