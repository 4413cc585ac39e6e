//! The detector's blur: widths, conservation, symmetry, closed forms, and the sum by the definition.

use proptest::prelude::*;
use radon::{Blur, RadonError};

/// Standard deviation of a Gaussian in terms of its full width at half maximum.
fn sigma(fwhm: f64) -> f64 {
    fwhm / (8.0 * 2.0_f64.ln()).sqrt()
}

/// The definition: every sample of the mirrored plane, weighed by both kernels; q of `q^(k^2)` found by halving.
fn naive(image: &[f64], size: [usize; 2], pitch: [f64; 2], fwhm: f64) -> Vec<f64> {
    let kernel = |axis: usize| -> Vec<f64> {
        let s = sigma(fwhm) / pitch[axis];
        let reach = ((5.0 * s).floor() as i64).max(1);
        let weights = |q: f64| -> Vec<f64> {
            let powers = (-reach..=reach).map(|k| q.powi((k * k) as i32));
            powers.collect()
        };
        let variance = |q: f64| {
            let squares = (-reach..=reach).map(|k| (k * k) as f64);
            let w = weights(q);
            w.iter().zip(squares).map(|(w, k)| w * k).sum::<f64>() / w.iter().sum::<f64>()
        };
        let [mut low, mut high] = [0.0, 1.0];
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            match variance(middle) < s * s {
                true => low = middle,
                false => high = middle,
            }
        }
        let w = weights(low);
        let sum: f64 = w.iter().sum();
        w.iter().map(|w| w / sum).collect()
    };
    let [kx, ky] = [kernel(0), kernel(1)];
    let fold = |k: i64, n: usize| {
        let n = n as i64;
        let mut k = k;
        while k < 0 || k >= n {
            k = if k < 0 { -1 - k } else { 2 * n - 1 - k };
        }
        k as usize
    };
    let mut out = vec![0.0; image.len()];
    for row in 0..size[1] {
        for bin in 0..size[0] {
            let (hx, hy) = (kx.len() as i64 / 2, ky.len() as i64 / 2);
            for (j, wy) in ky.iter().enumerate() {
                let y = fold(row as i64 + j as i64 - hy, size[1]);
                for (i, wx) in kx.iter().enumerate() {
                    let x = fold(bin as i64 + i as i64 - hx, size[0]);
                    out[row * size[0] + bin] += wx * wy * image[y * size[0] + x];
                }
            }
        }
    }
    out
}

fn image(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        })
        .collect()
}

/// The second moment of a blurred point is that of the Gaussian asked for, whatever its width in bins.
#[test]
fn a_point_gets_the_width_asked_for() {
    let (size, pitch) = ([251, 131], [0.1, 0.2]);
    let (across, along) = (size[0] as f64 * pitch[0], size[1] as f64 * pitch[1]);
    let widths = (0..=52).map(|i| 0.05 * 400.0_f64.powf(f64::from(i) / 52.0)); // 0.05 to 20 pitches of 0.1
    for fwhm in widths.map(|bins| 0.1 * bins).chain([0.2, 0.3, 0.4]) {
        assert!(5.0 * sigma(fwhm) < 0.5 * across.min(along)); // nothing reaches the edges
        let blur = Blur::new(size, pitch, fwhm).unwrap();
        let mut view = vec![0.0_f64; size[0] * size[1]];
        view[65 * 251 + 125] = 1.0;
        blur.apply(&mut view).unwrap();
        let mut moments = [0.0; 2];
        for (k, v) in view.iter().enumerate() {
            let (x, y) = ((k % 251) as f64 - 125.0, (k / 251) as f64 - 65.0);
            moments[0] += v * (x * pitch[0]).powi(2);
            moments[1] += v * (y * pitch[1]).powi(2);
        }
        for m in moments {
            // The weights are found to 1e-12; beside it rounding of some hundred terms.
            assert!(
                (m / sigma(fwhm).powi(2) - 1.0).abs() < 1e-11,
                "{fwhm}: {moments:?}"
            );
        }
        for axis in 0..2 {
            let weights = blur.weights(axis);
            let falls = weights.windows(2).all(|w| w[0] >= w[1] && w[1] >= 0.0);
            let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
            assert!(falls && (sum - 1.0).abs() < 1e-14, "{fwhm}: {weights:?}");
        }
    }
}

/// Widths whose square is nothing, or next to it, change nothing or next to it.
#[test]
fn a_width_of_nearly_nothing() {
    for fwhm in [0.0, 5e-324, 1e-200, 1e-154, 1e-9] {
        let blur = Blur::new([9, 1], [1.0; 2], fwhm).unwrap();
        let mut row = image(9, 6);
        let before = row.clone();
        blur.apply(&mut row).unwrap();
        assert!(row.iter().zip(&before).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}

/// Two Gaussians in a row are one whose variance is the sum of theirs. The fourth moments are right too where the Gaussian is
/// wide; a narrow one moves counts to the next bins alone, where m4 = m2 = sigma^2 stands for 3 sigma^4, so that blurred values
/// f + m2/2 f'' + m4/24 f + ... are off by up to (sigma^2 - 3 sigma^4)/24 f.
#[test]
fn a_gaussian_profile_becomes_a_wider_one() {
    let (n, own) = (201, 8.0_f64); // its own standard deviation, in bins
    let profile = |variance: f64, x: f64| (-0.5 * x * x / variance).exp() / variance.sqrt();
    for bins in [0.05, 0.2, 0.5, 0.75, 1.0, 1.3, 2.0, 3.0, 5.0, 20.0] {
        let variance = sigma(bins).powi(2);
        let blur = Blur::new([n, 1], [1.0; 2], bins).unwrap();
        let x = |k: usize| k as f64 - 100.0;
        let mut row: Vec<f64> = (0..n).map(|k| profile(own * own, x(k))).collect();
        blur.apply(&mut row).unwrap();
        // The largest fourth derivative of the profile is 3 / own^4 times its peak; a tenth more for the terms beyond. The cut at
        // 5 sigma moves 6e-7 of the counts, and what is left is made wider to make up for it.
        let fourth = (variance - 3.0 * variance * variance).max(0.0) / 24.0 * 3.0 / own.powi(4);
        let bound = (1.1 * fourth + 3e-6) / own;
        for (k, v) in row.iter().enumerate() {
            let exact = profile(own * own + variance, x(k));
            assert!((v - exact).abs() < bound, "{bins}, {k}: {v} {exact}");
        }
    }
}

/// The profile of a disc, blurred bin by bin, tends to its true convolution as the bins get finer.
#[test]
fn a_blurred_disc_tends_to_its_true_convolution() {
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
        let blur = Blur::new([n, 1], [pitch, 1.0], fwhm).unwrap();
        let x = |k: usize| (k as f64 - (n - 1) as f64 / 2.0) * pitch;
        let chord = |k| 2.0 * (radius * radius - x(k) * x(k)).max(0.0).sqrt();
        let mut row: Vec<f64> = (0..n).map(chord).collect();
        blur.apply(&mut row).unwrap();
        let off = row.iter().enumerate().map(|(k, v)| (v - exact(x(k))).abs());
        off.fold(0.0, f64::max)
    };
    // From 6 bins a FWHM to 48: a sum over samples with square roots at both ends has the order 3/2.
    let errors = [60, 120, 240, 480].map(error);
    for (i, e) in errors.iter().enumerate() {
        assert!(*e < 0.022 * 0.5_f64.powf(1.5 * i as f64), "{errors:?}");
    }
}

#[test]
fn some_rows_have_the_bits_and_the_work_of_these_rows() {
    // From no reach at all to one beyond the image, whose mirror images are then mirrored again.
    let size = [13, 17];
    for fwhm in [0.0, 0.3, 1.0, 2.5, 3.4] {
        let blur = Blur::new(size, [0.3, 0.2], fwhm).unwrap();
        let views: Vec<f32> = image(2 * 13 * 17, 5).iter().map(|&v| v as f32).collect();
        let mut whole = views.clone();
        blur.apply(&mut whole).unwrap();
        for rows in [0..17, 0..1, 16..17, 5..9, 11..17] {
            let seen = blur.rows_seen(&rows);
            let reach = blur.weights(1).len() - 1;
            assert!(seen.len() <= rows.len() + 2 * reach && seen.end <= 17);
            let cut = |views: &[f32], rows: &std::ops::Range<usize>| -> Vec<f32> {
                let own = |view: &[f32]| view[rows.start * 13..rows.end * 13].to_vec();
                views.chunks(13 * 17).flat_map(own).collect()
            };
            let found = blur.rows(cut(&views, &seen), &rows).unwrap();
            assert!(found == cut(&whole, &rows), "{fwhm} {rows:?}");
        }
        for rows in [0..0, 3..18, 17..17, 9..9] {
            let refused = blur.rows(vec![0.0_f32; 13], &rows);
            assert!(
                matches!(refused, Err(RadonError::OutOfRange { .. })),
                "{rows:?}"
            );
        }
    }
}

#[test]
fn an_edge_becomes_an_error_function() {
    // Half a plane of ones, its edge between bins: the sum of the Gaussian's samples, nearly its integral.
    let (n, pitch, fwhm) = (120, 0.1, 1.0);
    let blur = Blur::new([n, 1], [pitch, 1.0], fwhm).unwrap();
    let mut row: Vec<f64> = (0..n).map(|k| if k < 60 { 0.0 } else { 1.0 }).collect();
    blur.apply(&mut row).unwrap();
    for (k, v) in row.iter().enumerate() {
        let x = (k as f64 - 59.5) * pitch;
        let exact = 0.5 * (1.0 + libm::erf(x / (sigma(fwhm) * 2.0_f64.sqrt())));
        // The midpoint rule's sum is off by pitch^2 / 24 times the slope of the Gaussian.
        let bound = pitch * pitch / 24.0 / (sigma(fwhm).powi(2) * 2.0) + 1e-6;
        assert!((v - exact).abs() < bound, "{k}: {v} {exact}");
    }
}

#[test]
fn nothing_is_lost_even_at_the_edge() {
    let (size, pitch) = ([37, 23], [0.3, 0.2]);
    for fwhm in [0.0, 0.1, 1.0, 4.0] {
        let blur = Blur::new(size, pitch, fwhm).unwrap();
        let before = image(3 * 37 * 23, 1);
        let mut after = before.clone();
        blur.apply(&mut after).unwrap();
        for (a, b) in before.chunks(37 * 23).zip(after.chunks(37 * 23)) {
            let (a, b): (f64, f64) = (a.iter().sum(), b.iter().sum());
            assert!((a / b - 1.0).abs() < 1e-13);
        }
        let mut flat = vec![2.5_f64; 37 * 23];
        blur.apply(&mut flat).unwrap();
        assert!(flat.iter().all(|v| (v - 2.5).abs() < 1e-13));
        if fwhm == 0.0 {
            assert!(before == after);
        }
    }
}

#[test]
fn the_blur_is_its_own_adjoint() {
    let size = [31, 17];
    let blur = Blur::new(size, [0.2, 0.3], 2.0).unwrap();
    let (x, y) = (image(31 * 17, 2), image(31 * 17, 3));
    let blurred = |v: &[f64]| {
        let mut v = v.to_vec();
        blur.apply(&mut v).unwrap();
        v
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (left, right) = (dot(&blurred(&x), &y), dot(&x, &blurred(&y)));
    assert!((left / right - 1.0).abs() < 1e-13);
}

#[test]
fn single_precision_and_threads_give_the_same() {
    let size = [64, 40];
    let blur = Blur::new(size, [0.1, 0.1], 0.7).unwrap();
    let wide = image(4 * 64 * 40, 4);
    let narrow: Vec<f32> = wide.iter().map(|&v| v as f32).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (mut wide, mut narrow) = (wide.clone(), narrow.clone());
        pool.install(|| {
            blur.apply(&mut wide).unwrap();
            blur.apply(&mut narrow).unwrap();
        });
        (wide, narrow)
    };
    let (one, two) = (run(1), run(2));
    assert!(one == two);
    // Some 30 additions of numbers below 1.
    assert!(
        one.0
            .iter()
            .zip(&one.1)
            .all(|(a, b)| (a - f64::from(*b)).abs() < 1e-6)
    );
}

#[test]
fn nonsense_is_refused() {
    let new = |size, pitch, fwhm| Blur::new(size, [pitch, 0.1], fwhm);
    assert!(matches!(
        new([0, 4], 0.1, 0.1),
        Err(RadonError::TooFew { .. })
    ));
    assert!(matches!(
        new([4, 0], 0.1, 0.1),
        Err(RadonError::TooFew { .. })
    ));
    assert!(matches!(
        new([usize::MAX, 4], 0.1, 0.1),
        Err(RadonError::TooLarge { .. })
    ));
    for bad in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            new([4, 4], bad, 0.1),
            Err(RadonError::NotPositive { .. } | RadonError::NotFinite { .. })
        ));
    }
    for bad in [-0.1, 0.5, 1e300, f64::NAN, f64::INFINITY] {
        for shape in [[4, 4], [4, 1]] {
            let refused = new(shape, 0.1, bad);
            assert!(
                matches!(
                    refused,
                    Err(RadonError::OutOfRange { .. } | RadonError::NotFinite { .. })
                ),
                "{bad}: {refused:?}"
            );
        }
    }
    let blur = new([4, 4], 0.1, 0.1).unwrap();
    assert!(matches!(
        blur.apply(&mut [0.0_f32; 17]),
        Err(RadonError::WrongLength { .. })
    ));
    let mut bad = [1.0_f32; 16];
    bad[3] = f32::NAN;
    assert!(matches!(
        blur.apply(&mut bad),
        Err(RadonError::NotFinite { .. })
    ));
    assert_eq!(bad[0], 1.0);
    blur.apply::<f32>(&mut []).unwrap();
}

proptest! {
    #[test]
    fn the_sum_by_the_definition(
        bins in 1..14usize, rows in 1..12usize, width in 0.0..1.0f64, pitch in (0.05..0.5f64, 0.05..0.5f64), seed in 0..1000u64,
    ) {
        let (size, pitch) = ([bins, rows], [pitch.0, pitch.1]);
        let fwhm = width * (bins as f64 * pitch[0]).min(rows as f64 * pitch[1]);
        let blur = Blur::new(size, pitch, fwhm).unwrap();
        let before = image(bins * rows, seed);
        let mut after = before.clone();
        blur.apply(&mut after).unwrap();
        let exact = naive(&before, size, pitch, fwhm);
        for (a, b) in after.iter().zip(&exact) {
            // Either way of finding q leaves 1e-12 of the variance.
            prop_assert!((a - b).abs() < 3e-12);
        }
    }
}
