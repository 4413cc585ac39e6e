//! The Fourier method of filtered back-projection: against the direct sum, the formula and other instruction sets.

use std::f64::consts::PI;

use radon::{
    ArcPolicy, BinSampling, EdgePolicy, FbpMethod, FbpOptions, FbpPlan, FourierProjector,
    ImageGrid, InstructionSet, Interpolation, LinearOperator, ParallelGeometry, Phantom2,
    RadonError, StackOrder, Window, disc_mask, rmse_within,
};

const SETS: [InstructionSet; 4] = [
    InstructionSet::Baseline,
    InstructionSet::Avx2,
    InstructionSet::Avx512,
    InstructionSet::Neon,
];

pub(crate) fn signs(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    let next = |_| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as f64 / f64::from(1 << 30) - 1.0
    };
    (0..n).map(next).collect()
}

pub(crate) fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm(&difference) / norm(b)
}

/// Uneven angles beyond both half turns, an off-centre axis, an off-centre grid with two spacings.
pub(crate) fn odd_case(coarse: f64) -> (ParallelGeometry, ImageGrid) {
    let angles: Vec<f64> = (0..23).map(|k| 0.1 + 2.399_963 * f64::from(k)).collect();
    let geometry = ParallelGeometry::from_radians(angles, 31, 0.3).unwrap();
    let grid = ImageGrid::anisotropic(20, 27, [0.35 * coarse, 0.25 * coarse]).unwrap();
    (
        geometry.with_offset(0.4).unwrap(),
        grid.with_centre([0.7, -0.2]).unwrap(),
    )
}

/// Frequencies j / period within the response, for a period that keeps copies of a row out of the image.
pub(crate) fn waves(most: f64, period: f64, pitch: f64) -> impl Iterator<Item = f64> {
    let n = (most / pitch * period + 1e-9) as i64;
    (-n..=n).map(move |j| j as f64 / period)
}

/// Back-projection of rows by the first lobe of the response of linear interpolation, wave by wave.
fn wave_by_wave(
    geometry: &ParallelGeometry,
    grid: &ImageGrid,
    rows: &[f64],
    period: f64,
) -> Vec<f64> {
    let (pitch, n_bins) = (geometry.pitch(), geometry.n_bins());
    let sinc = |x: f64| {
        if x == 0.0 {
            1.0
        } else {
            (PI * x).sin() / (PI * x)
        }
    };
    let weights = geometry.view_weights(ArcPolicy::Complete).unwrap();
    let mut image = vec![0.0; grid.image_len()];
    for (view, theta) in geometry.angles().iter().enumerate() {
        let row = &rows[view * n_bins..][..n_bins];
        for f in waves(1.0, period, pitch) {
            let (mut re, mut im) = (0.0, 0.0);
            for (k, value) in row.iter().enumerate() {
                let phase = 2.0 * PI * f * geometry.bin_centre(k);
                re += value * phase.cos();
                im -= value * phase.sin();
            }
            let gain = weights[view] * sinc(f * pitch).powi(2) * pitch / period;
            for (i, pixel) in image.iter_mut().enumerate() {
                let [x, y] = grid.pixel_centre(i % grid.nx(), i / grid.nx());
                let phase = 2.0 * PI * f * (x * theta.cos() + y * theta.sin());
                *pixel += gain * (re * phase.cos() - im * phase.sin());
            }
        }
    }
    image
}

/// The period of a plan: see `row_period`.
pub(crate) fn period(geometry: &ParallelGeometry, grid: &ImageGrid) -> f64 {
    let corners =
        [0, grid.nx() - 1].map(|ix| [0, grid.ny() - 1].map(|iy| grid.pixel_centre(ix, iy)));
    let corners = corners.iter().flatten().map(|[x, y]| x.hypot(*y));
    let farthest = corners.fold(0.0, f64::max) + geometry.offset().abs();
    let n = geometry.n_bins() as f64;
    let least = (n / 2.0 + farthest / geometry.pitch() + 2.0).max(n + 2.0);
    radon::padded_len(least.ceil() as usize).unwrap() as f64 * geometry.pitch()
}

#[test]
fn the_tolerance_is_kept() {
    // Pixels coarser than bins alias high frequencies; finer ones leave cells empty.
    for coarse in [0.3, 1.0, 3.0] {
        let (geometry, grid) = odd_case(coarse);
        let rows = signs(geometry.sinogram_len(), 1);
        let expected = wave_by_wave(&geometry, &grid, &rows, period(&geometry, &grid));
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let options = FbpOptions::default()
                .with_ramp(false)
                .with_method(FbpMethod::Fourier { tolerance });
            let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap();
            let error = distance(&plan.reconstruct(&rows).unwrap(), &expected);
            println!("back-projection, {coarse}, {tolerance:e}: {error:.1e}");
            assert!(error < tolerance, "{coarse} {tolerance:e}: {error:e}");
        }
    }
}

fn phantom_case(n: usize, n_views: usize) -> (ParallelGeometry, ImageGrid, Vec<f64>, Vec<f64>) {
    let geometry = ParallelGeometry::half_turn(n_views, n, 1.0).unwrap();
    let grid = ImageGrid::square(n, 1.0).unwrap();
    let phantom = Phantom2::shepp_logan(n as f64 / 2.0).unwrap();
    let sinogram = phantom.sinogram(&geometry, BinSampling::Mean).unwrap();
    let truth = phantom.image(&grid).unwrap();
    (geometry, grid, sinogram, truth)
}

#[test]
fn methods_differ_by_the_documented_amount() {
    // Root mean square over the disc for rows that are zero beyond their ends, at 128 x 128 from 180 views and 256 x 256 from 360, and
    // the largest one for extended rows, in which a jump in the middle of the padding adds high frequencies.
    for (interpolation, window, stated, continued) in [
        (
            Interpolation::Linear,
            Window::RamLak,
            [2.8e-3, 1.8e-3],
            3e-3,
        ),
        (
            Interpolation::Linear,
            Window::Hann,
            [1.1e-3, 6.2e-4],
            1.2e-3,
        ),
        (
            Interpolation::BandLimited,
            Window::RamLak,
            [9.3e-4, 6.0e-4],
            1.3e-3,
        ),
        (
            Interpolation::BandLimited,
            Window::Hann,
            [2.7e-4, 1.4e-4],
            3e-4,
        ),
    ] {
        for (n, stated) in [128, 256].into_iter().zip(stated) {
            let (geometry, grid, sinogram, truth) = phantom_case(n, n / 32 * 45);
            let mask = disc_mask(&grid, n as f64 / 2.0 - 1.0).unwrap();
            for edge in [EdgePolicy::Zero, EdgePolicy::Ellipse] {
                let options = FbpOptions::default()
                    .with_interpolation(interpolation)
                    .with_window(window.clone())
                    .with_edge(edge);
                let image = |method| {
                    let options = options.clone().with_method(method);
                    let plan = FbpPlan::new(&geometry, &grid, &options).unwrap();
                    plan.reconstruct(&sinogram).unwrap()
                };
                let direct = image(FbpMethod::Direct);
                let fourier = image(FbpMethod::Fourier { tolerance: 1e-4 });
                let between = rmse_within(&fourier, &direct, &mask).unwrap().unwrap();
                let error = |image: &[f64]| rmse_within(image, &truth, &mask).unwrap().unwrap();
                let (direct, fourier) = (error(&direct), error(&fourier));
                println!(
                    "{n} {interpolation:?} {window:?} {edge:?}: {direct:.5} {fourier:.5}, between {between:.2e}"
                );
                // The stated digits; both methods have the same error against the phantom.
                match edge {
                    EdgePolicy::Zero => assert!((between / stated - 1.0).abs() < 0.05),
                    _ => assert!(between < continued),
                }
                assert!((fourier / direct - 1.0).abs() < 0.02);
            }
        }
    }
}

#[test]
fn truncated_rows_are_treated_as_in_the_direct_sum() {
    // Half the bins: both methods truncate the image at the same position.
    let geometry = ParallelGeometry::half_turn(120, 64, 1.0)
        .unwrap()
        .with_offset(3.3)
        .unwrap();
    let grid = ImageGrid::square(60, 1.0).unwrap();
    let phantom = Phantom2::shepp_logan(64.0).unwrap();
    let sinogram: Vec<f64> = phantom.sinogram(&geometry, BinSampling::Mean).unwrap();
    let mask = disc_mask(&grid, 26.0).unwrap();
    for edge in [EdgePolicy::Zero, EdgePolicy::Ellipse] {
        let image = |method| {
            let options = FbpOptions::default()
                .with_edge(edge)
                .with_window(Window::Hann)
                .with_method(method);
            FbpPlan::new(&geometry, &grid, &options)
                .unwrap()
                .reconstruct(&sinogram)
                .unwrap()
        };
        let (direct, fourier) = (
            image(FbpMethod::Direct),
            image(FbpMethod::Fourier { tolerance: 1e-5 }),
        );
        let between = rmse_within(&fourier, &direct, &mask).unwrap().unwrap();
        println!("{edge:?}: {between:.1e}");
        assert!(between < 2e-3);
    }
}

#[test]
fn a_fourier_image_is_bitwise_reproducible() {
    let (geometry, grid) = odd_case(1.0);
    let rows: Vec<f32> = signs(geometry.sinogram_len(), 5)
        .iter()
        .map(|&x| x as f32)
        .collect();
    let options = FbpOptions::default().with_method(FbpMethod::Fourier { tolerance: 1e-4 });
    let plan = FbpPlan::new(&geometry, &grid, &options).unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| plan.reconstruct(&rows).unwrap())
    };
    let image = on(1);
    for threads in [2, 3, 8] {
        assert_eq!(image, on(threads));
    }
    let projector = FourierProjector::new(&geometry, &grid, 1e-4).unwrap();
    let forward = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| projector.forward(&image).unwrap())
    };
    assert_eq!(forward(1), forward(3));

    // A part of the image, a slice among others, reused work arrays.
    let part = FbpPlan::new(&geometry, &grid, &options.clone().with_region(3..17, 5..11)).unwrap();
    let cut: Vec<f32> = (5..11)
        .flat_map(|y| image[y * 20 + 3..y * 20 + 17].to_vec())
        .collect();
    let mut scratch = radon::FbpScratch::default();
    let mut out = vec![0.0; cut.len()];
    let _ = plan
        .reconstruct_slab_into(
            &rows,
            1,
            StackOrder::SliceViewBin,
            0..1,
            &mut [0.0; 540],
            &mut scratch,
        )
        .unwrap();
    part.reconstruct_slab_into(
        &rows,
        1,
        StackOrder::SliceViewBin,
        0..1,
        &mut out,
        &mut scratch,
    )
    .unwrap();
    assert_eq!(out, cut);
    let stack: Vec<f32> = [vec![0.0; rows.len()], rows.clone(), vec![1.0; rows.len()]].concat();
    let volume = plan
        .reconstruct_stack(&stack, 3, radon::StackOrder::SliceViewBin)
        .unwrap();
    assert!(volume[..540].iter().all(|&x| x == 0.0) && volume[540..1080] == image);
}

#[test]
fn every_instruction_set_spreads_the_same_to_rounding() {
    let (geometry, grid) = odd_case(1.0);
    let rows: Vec<f32> = signs(geometry.sinogram_len(), 6)
        .iter()
        .map(|&x| x as f32)
        .collect();
    let fine: Vec<f64> = rows.iter().map(|&x| f64::from(x)).collect();
    for tolerance in [1e-2, 1e-3, 1e-4, 1e-6] {
        let options = FbpOptions::default().with_method(FbpMethod::Fourier { tolerance });
        let twin = FbpPlan::<f64>::new(&geometry, &grid, &options)
            .unwrap()
            .reconstruct(&fine)
            .unwrap();
        for set in SETS.into_iter().filter(|set| set.is_available()) {
            let options = options.clone().with_instructions(set);
            let single = FbpPlan::new(&geometry, &grid, &options)
                .unwrap()
                .reconstruct(&rows)
                .unwrap();
            let single: Vec<f64> = single.iter().map(|&x| f64::from(x)).collect();
            let double = FbpPlan::new(&geometry, &grid, &options)
                .unwrap()
                .reconstruct(&fine)
                .unwrap();
            assert!(
                distance(&single, &twin) < 2e-6 && distance(&double, &twin) < 1e-13,
                "{set:?}"
            );
            let plan = |set| {
                let options = options.clone().with_instructions(set);
                FbpPlan::<f64>::new(&geometry, &grid, &options).unwrap()
            };
            let [a, b] =
                [set, InstructionSet::Baseline].map(|set| plan(set).adjoint(&twin).unwrap());
            assert!(distance(&a, &b) < 1e-13, "{set:?}");
        }
    }
}

#[test]
fn the_method_depends_on_sizes_interpolation_and_sample_type_only() {
    let fourier = FbpMethod::Fourier {
        tolerance: FbpMethod::AUTO_TOLERANCE,
    };
    let method = |n: usize, n_views: usize, options: &FbpOptions| {
        let geometry = ParallelGeometry::half_turn(n_views, n, 1.0).unwrap();
        let grid = ImageGrid::square(n, 1.0).unwrap();
        let single = FbpPlan::<f32>::new(&geometry, &grid, options).unwrap();
        let double = FbpPlan::<f64>::new(&geometry, &grid, options).unwrap();
        [single.method(), double.method()]
    };
    let auto = FbpOptions::default();
    assert_eq!(method(128, 90, &auto), [FbpMethod::Direct; 2]);
    assert_eq!(method(1024, 1440, &auto), [fourier; 2]);
    // The documented crossover with as many views as pixels per side.
    assert_eq!(method(300, 300, &auto), [FbpMethod::Direct; 2]);
    assert_eq!(method(330, 330, &auto), [fourier, FbpMethod::Direct]);
    assert_eq!(method(415, 415, &auto), [fourier, FbpMethod::Direct]);
    assert_eq!(method(450, 450, &auto), [fourier; 2]);
    // A small part costs less than transforms of the whole.
    let part = auto.clone().with_region(0..32, 0..32);
    assert_eq!(method(1024, 1440, &part), [FbpMethod::Direct; 2]);
    // 48 sizes on either side of the crossover, by every set and with budgets that are too small for any run.
    let mut chosen = [0; 2];
    for i in 0..48 {
        let (n, n_views) = (180 + 97 * i % 400, 40 + 211 * i % 700);
        let options = match i % 3 {
            0 => auto.clone().with_interpolation(Interpolation::BandLimited),
            _ => auto.clone(),
        };
        let expected = method(n, n_views, &options);
        chosen[usize::from(expected[0] == fourier)] += 1;
        for set in SETS.into_iter().filter(|set| set.is_available()) {
            let options = options.clone().with_instructions(set).with_memory(1000);
            assert_eq!(
                method(n, n_views, &options),
                expected,
                "{n} {n_views} {set:?}"
            );
        }
    }
    assert!(chosen.iter().all(|&n| n > 5), "{chosen:?}");
}

#[test]
fn an_insufficient_budget_is_an_error_and_the_default_suffices() {
    let geometry = ParallelGeometry::half_turn(2880, 2048, 1.0).unwrap();
    let grid = ImageGrid::square(2048, 1.0).unwrap();
    let plan = |memory| {
        let options = FbpOptions::default().with_memory(memory);
        FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap()
    };
    let bytes = plan(FbpOptions::default().memory).work_bytes(1).unwrap();
    // Four times the data: image and sinogram of 2048 x 2048 from 2880 views.
    let data = 4 * (2048 * 2048 + 2048 * 2880);
    println!(
        "work arrays of 2048 x 2048 from 2880 views: {:.2} of the data",
        bytes as f64 / data as f64
    );
    assert!(bytes < 4 * data);
    let error = plan(bytes - 1).work_bytes(1).unwrap_err();
    let (least, given) = (bytes, bytes - 1);
    assert_eq!(error, RadonError::BudgetTooSmall { least, given });
}

#[test]
fn every_instruction_set_reconstructs_the_same_image() {
    // Sizes at which both methods have similar costs: a machine-dependent choice would differ here and change the images by 1e-3.
    for (n, n_views) in [(256, 720), (360, 720), (400, 400), (300, 310), (64, 90)] {
        let (geometry, grid, sinogram, _) = phantom_case(n, n_views);
        let sinogram: Vec<f32> = sinogram.iter().map(|&x| x as f32).collect();
        let image = |set| {
            let options = FbpOptions::default().with_instructions(set);
            let plan = FbpPlan::new(&geometry, &grid, &options).unwrap();
            plan.reconstruct(&sinogram).unwrap()
        };
        let baseline = image(InstructionSet::Baseline);
        let largest = baseline.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        for set in SETS.into_iter().filter(|set| set.is_available()) {
            let pairs = image(set).into_iter().zip(&baseline);
            let difference = pairs.fold(0.0_f32, |m, (a, b)| m.max((a - b).abs())) / largest;
            println!("{n} x {n} from {n_views} views, {set:?}: {difference:.1e}");
            // Rounding of f32 in sums of as many terms as views.
            assert!(difference < 1e-5, "{n} {n_views} {set:?}: {difference:e}");
        }
    }
}

#[test]
fn unsupported_options_of_the_fourier_method_are_rejected() {
    let (geometry, grid) = odd_case(1.0);
    for tolerance in [0.0, 1e-7, 0.1, f64::NAN, f64::INFINITY] {
        let options = FbpOptions::default().with_method(FbpMethod::Fourier { tolerance });
        let errors = [
            FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap_err(),
            FourierProjector::<f32>::new(&geometry, &grid, tolerance).unwrap_err(),
        ];
        for error in errors {
            assert!(matches!(
                error,
                RadonError::OutOfRange {
                    what: "tolerance",
                    ..
                } | RadonError::NotFinite {
                    what: "tolerance",
                    ..
                }
            ));
        }
    }
    let options = FbpOptions::default().with_method(FbpMethod::Fourier { tolerance: 1e-3 });
    let plan = FbpPlan::<f32>::new(&geometry, &grid, &options.clone().with_memory(1000)).unwrap();
    let error = plan.reconstruct(&[1.0; 23 * 31]).unwrap_err();
    assert!(matches!(
        error,
        RadonError::BudgetTooSmall { given: 1000, .. }
    ));
    // A row at an extreme distance from the axis.
    let far = geometry.clone().with_offset(1e18).unwrap();
    let error = FbpPlan::<f32>::new(&far, &grid, &options).unwrap_err();
    assert!(matches!(error, RadonError::OutOfRange { .. }));
    assert_eq!(
        FbpPlan::<f32>::new(&far, &grid, &FbpOptions::default())
            .unwrap()
            .method(),
        FbpMethod::Direct
    );
    let projector = FourierProjector::<f32>::new(&geometry, &grid, 1e-3).unwrap();
    assert!(matches!(
        projector.forward(&[0.0; 3]).unwrap_err(),
        RadonError::WrongLength { .. }
    ));
    let mut image = [0.0; 540];
    image[7] = f32::NAN;
    assert!(matches!(
        projector.forward(&image).unwrap_err(),
        RadonError::BadSample { index: 7, .. }
    ));
    let mut short = [0.0; 3];
    let error = projector
        .adjoint_into(&[0.0; 23 * 31], &mut short)
        .unwrap_err();
    assert!(matches!(
        error,
        RadonError::WrongLength { expected: 540, .. }
    ));
}
