//! The blur by one Gaussian: widths, symmetry, closed forms, and the sum of the definition.

use crate::common::noise;
use crate::common::spect::gaussian;
use proptest::prelude::*;
use radon::{DepthBlur, RadonError};

/// Standard deviation of a Gaussian in terms of its full width at half maximum.
fn sigma(fwhm: f64) -> f64 {
    fwhm / (8.0 * 2.0_f64.ln()).sqrt()
}

/// A blur of one slab, to rounding.
fn new(pitch: [f64; 2], fwhm: f64) -> DepthBlur {
    DepthBlur::new(&[sigma(fwhm).powi(2)], pitch, 1e-12).unwrap()
}

fn blurred(blur: &DepthBlur, image: &[f64], n_bins: usize) -> Vec<f64> {
    let mut out = vec![0.0; image.len()];
    blur.apply(image, n_bins, 0, &mut out).unwrap();
    out
}

/// The second moment of a blurred point is that of the requested Gaussian, for any width in bins.
#[test]
fn a_point_has_the_requested_width() {
    let (size, pitch) = ([251, 131], [0.1, 0.2]);
    let (across, along) = (size[0] as f64 * pitch[0], size[1] as f64 * pitch[1]);
    let widths = (0..=52).map(|i| 0.05 * 400.0_f64.powf(f64::from(i) / 52.0)); // 0.05 to 20 pitches of 0.1
    for fwhm in widths.map(|bins| 0.1 * bins).chain([0.2, 0.3, 0.4]) {
        assert!(8.0 * sigma(fwhm) < 0.5 * across.min(along)); // nothing reaches the edges
        let mut point = vec![0.0_f64; size[0] * size[1]];
        point[65 * 251 + 125] = 1.0;
        let view = blurred(&new(pitch, fwhm), &point, 251);
        let mut moments = [0.0; 2];
        for (k, v) in view.iter().enumerate() {
            let (x, y) = ((k % 251) as f64 - 125.0, (k / 251) as f64 - 65.0);
            moments[0] += v * (x * pitch[0]).powi(2);
            moments[1] += v * (y * pitch[1]).powi(2);
        }
        for m in moments {
            // The weights are accurate to 1e-12; in addition rounding of about a hundred terms.
            assert!(
                (m / sigma(fwhm).powi(2) - 1.0).abs() < 1e-11,
                "{fwhm}: {moments:?}"
            );
        }
        let row = &view[65 * 251 + 125..66 * 251];
        let falls = row.windows(2).all(|w| w[0] >= w[1] && w[1] >= 0.0);
        let sum: f64 = view.iter().sum();
        // Rounding of about a thousand terms.
        assert!(falls && (sum - 1.0).abs() < 1e-13, "{fwhm}: {sum}");
    }
}

/// Widths whose square is zero or negligible have no or a negligible effect.
#[test]
fn widths_near_zero() {
    for fwhm in [0.0, 5e-324, 1e-200, 1e-154, 1e-9] {
        let before = noise::<f64>(9, 6);
        let row = blurred(&new([1.0; 2], fwhm), &before, 9);
        assert!(row.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}

/// The variance of two successive Gaussians is the sum of their variances. The fourth moments of a wide Gaussian are correct, too. A narrow one moves
/// counts to the next bins only, with m4 = m2 = sigma^2 instead of 3 sigma^4, so that blurred values f + m2/2 f'' + m4/24 f + ... have an error of up
/// to (sigma^2 - 3 sigma^4)/24 f.
#[test]
fn a_gaussian_profile_becomes_a_wider_one() {
    let (n, own) = (201, 8.0_f64); // its own standard deviation, in bins
    let profile = |variance: f64, x: f64| (-0.5 * x * x / variance).exp() / variance.sqrt();
    for bins in [0.05, 0.2, 0.5, 0.75, 1.0, 1.3, 2.0, 3.0, 5.0, 20.0] {
        let variance = sigma(bins).powi(2);
        let x = |k: usize| k as f64 - 100.0;
        let row: Vec<f64> = (0..n).map(|k| profile(own * own, x(k))).collect();
        // The blur is narrow compared with the distance of rows: it acts along the bins only.
        let row = blurred(&new([1.0, 1e6], bins), &row, n);
        // The largest fourth derivative of the profile is 3 / own^4 times its peak; a tenth more for the terms beyond.
        let fourth = (variance - 3.0 * variance * variance).max(0.0) / 24.0 * 3.0 / own.powi(4);
        let bound = (1.1 * fourth + 3e-6) / own;
        for (k, v) in row.iter().enumerate() {
            let exact = profile(own * own + variance, x(k));
            assert!((v - exact).abs() < bound, "{bins}, {k}: {v} {exact}");
        }
    }
}

/// The blurred profile of a disc converges to its exact convolution as the bins become finer.
#[test]
fn a_blurred_disc_converges_to_its_exact_convolution() {
    let (radius, fwhm) = (3.0_f64, 1.2);
    let gaussian = |x: f64| {
        let s = sigma(fwhm);
        (-0.5 * (x / s).powi(2)).exp() / (s * (2.0 * std::f64::consts::PI).sqrt())
    };
    // s = r sin u: the chord 2 r cos u is smooth to beyond the ends, where the trapezoidal rule is exact to rounding.
    let exact = |x: f64| -> f64 {
        let steps = 400;
        let du = std::f64::consts::PI / f64::from(steps);
        let term = |i: i32| {
            let u = -0.5 * std::f64::consts::PI + f64::from(i) * du;
            2.0 * (radius * u.cos()).powi(2) * gaussian(x - radius * u.sin())
        };
        (0..steps).map(term).sum::<f64>() * du
    };
    let error = |n: usize| -> f64 {
        let pitch = 12.0 / n as f64;
        let x = |k: usize| (k as f64 - (n - 1) as f64 / 2.0) * pitch;
        let chord = |k| 2.0 * (radius * radius - x(k) * x(k)).max(0.0).sqrt();
        let row: Vec<f64> = (0..n).map(chord).collect();
        let row = blurred(&new([pitch, 1e6], fwhm), &row, n);
        let off = row.iter().enumerate().map(|(k, v)| (v - exact(x(k))).abs());
        off.fold(0.0, f64::max)
    };
    // From 6 to 48 bins per FWHM: a sum over samples with square roots at both ends has the order 3/2.
    let errors = [60, 120, 240, 480].map(error);
    for (i, e) in errors.iter().enumerate() {
        assert!(*e < 0.022 * 0.5_f64.powf(1.5 * i as f64), "{errors:?}");
    }
}

#[test]
fn an_edge_becomes_an_error_function() {
    // A half-plane of ones with its edge between bins: the sum of the Gaussian's samples approximates its integral.
    let (n, pitch, fwhm) = (120, 0.1, 1.0);
    let row: Vec<f64> = (0..n).map(|k| if k < 60 { 0.0 } else { 1.0 }).collect();
    let row = blurred(&new([pitch, 1e6], fwhm), &row, n);
    // Eight standard deviations from the other edge of the ones, which is that of the row.
    for (k, v) in row.iter().enumerate().take(85) {
        let x = (k as f64 - 59.5) * pitch;
        let exact = 0.5 * (1.0 + libm::erf(x / (sigma(fwhm) * 2.0_f64.sqrt())));
        // The error of the midpoint rule is pitch^2 / 24 times the slope of the Gaussian.
        let bound = pitch * pitch / 24.0 / (sigma(fwhm).powi(2) * 2.0) + 1e-6;
        assert!((v - exact).abs() < bound, "{k}: {v} {exact}");
    }
}

#[test]
fn the_blur_is_self_adjoint() {
    let blur = new([0.2, 0.3], 2.0);
    let (x, y) = (noise::<f64>(31 * 17, 2), noise::<f64>(31 * 17, 3));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (left, right) = (
        dot(&blurred(&blur, &x, 31), &y),
        dot(&x, &blurred(&blur, &y, 31)),
    );
    // Rounding of about a hundred products of numbers of either sign.
    assert!((left - right).abs() < 1e-13 * dot(&x, &x));
}

#[test]
fn single_precision_and_threads_agree() {
    let blur = new([0.1, 0.1], 0.7);
    let wide = noise::<f64>(64 * 40, 4);
    let narrow: Vec<f32> = wide.iter().map(|&v| v as f32).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let mut out = vec![0.0_f32; narrow.len()];
        pool.install(|| blur.apply(&narrow, 64, 0, &mut out))
            .unwrap();
        (pool.install(|| blurred(&blur, &wide, 64)), out)
    };
    let (one, two) = (run(1), run(2));
    assert!(one == two);
    // About 50 additions of numbers below 1.
    let pairs = one.0.iter().zip(&one.1);
    assert!(
        pairs
            .into_iter()
            .all(|(a, b)| (a - f64::from(*b)).abs() < 2e-6)
    );
}

#[test]
fn invalid_input_is_rejected() {
    let range = |refused: Result<DepthBlur, RadonError>| {
        matches!(
            refused,
            Err(RadonError::OutOfRange { .. } | RadonError::NotFinite { .. })
        )
    };
    assert!(matches!(
        DepthBlur::new(&[], [0.1; 2], 1e-3),
        Err(RadonError::TooFew { .. })
    ));
    for bad in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        for pitch in [[bad, 0.1], [0.1, bad]] {
            assert!(matches!(
                DepthBlur::new(&[0.1], pitch, 1e-3),
                Err(RadonError::NotPositive { .. } | RadonError::NotFinite { .. })
            ));
        }
    }
    for bad in [-0.1, 1e300, f64::NAN, f64::INFINITY] {
        assert!(range(DepthBlur::new(&[0.1, bad], [0.1; 2], 1e-3)), "{bad}");
    }
    for bad in [-0.1, 0.0, 1e-13, 1.1, f64::NAN, f64::INFINITY] {
        assert!(range(DepthBlur::new(&[0.1], [0.1; 2], bad)), "{bad}");
    }
    let blur = new([0.1; 2], 0.1);
    let mut out = [7.0_f32; 16];
    for (len, n_bins) in [(17, 4), (12, 4)] {
        assert!(matches!(
            blur.apply(&vec![0.0; len], n_bins, 0, &mut out),
            Err(RadonError::WrongLength { .. })
        ));
    }
    assert!(matches!(
        blur.apply(&[0.0; 16], 0, 0, &mut out),
        Err(RadonError::TooFew { .. })
    ));
    let mut bad = [1.0_f32; 16];
    bad[3] = f32::NAN;
    assert!(matches!(
        blur.apply(&bad, 4, 0, &mut out),
        Err(RadonError::NotFinite { .. })
    ));
    assert_eq!(out, [7.0; 16]);
    blur.apply::<f32>(&[], 4, 0, &mut []).unwrap();
}

proptest! {
    #[test]
    fn the_blur_equals_the_sum_of_its_definition(
        bins in 1..14usize, rows in 1..12usize, width in 0.0..1.0f64, pitch in (0.05..0.5f64, 0.05..0.5f64), seed in 0..1000u64,
    ) {
        let fwhm = width * (bins as f64 * pitch.0).min(rows as f64 * pitch.1);
        let before = noise::<f64>(bins * rows, seed);
        let after = blurred(&new([pitch.0, pitch.1], fwhm), &before, bins);
        let [kx, ky] = [pitch.0, pitch.1].map(|p| gaussian((sigma(fwhm) / p).powi(2)));
        let at = |kernel: &[f64], k: usize| kernel.get(k).copied().unwrap_or(0.0);
        for (k, value) in after.iter().enumerate() {
            let (bin, row) = (k % bins, k / bins);
            let weights = |j: usize| at(&kx, bin.abs_diff(j % bins)) * at(&ky, row.abs_diff(j / bins));
            let exact: f64 = before.iter().enumerate().map(|(j, v)| v * weights(j)).sum();
            // Either method for q is accurate to 1e-12 of the variance; truncation to about 1e-12 of the peak.
            prop_assert!((value - exact).abs() < 5e-12);
        }
    }
}
