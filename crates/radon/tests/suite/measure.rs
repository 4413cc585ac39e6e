//! Measures within a mask against plain sums.

use radon::{MaskedStats, RadonError, rmse_within};

#[test]
fn agrees_with_the_plain_sums() {
    let values: Vec<f64> = (0..50_000).map(|i| (i as f64 * 0.37).sin() + 1e6).collect();
    let mask: Vec<bool> = (0..500).map(|i| i % 3 != 0).collect();
    let mask = mask.repeat(100);
    let picked: Vec<f64> = values
        .iter()
        .enumerate()
        .filter(|(i, _)| mask[*i])
        .map(|(_, &v)| v)
        .collect();
    let n = picked.len() as f64;
    let mean = picked.iter().sum::<f64>() / n;
    let std = (picked.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    let stats = MaskedStats::of(&values, &mask).unwrap().unwrap();
    assert_eq!(stats.count, picked.len());
    // Another order of 33 300 terms of 1e6 changes the mean by a few ulps of 1e6.
    assert!((stats.mean - mean).abs() < 1e-8 && (stats.std - std).abs() < 1e-8);
    let shifted: Vec<f64> = values.iter().map(|v| v - 0.5).collect();
    let rmse = rmse_within(&values, &shifted, &mask).unwrap().unwrap();
    assert!((rmse - 0.5).abs() < 1e-9);
}

/// Any length of mask and values, against the definitions.
#[test]
fn pieces_blocks_and_lanes_cover_all_samples() {
    for (mask_len, times) in [
        (1, 9000),
        (3, 5),
        (7, 2000),
        (4096, 3),
        (5000, 2),
        (12_289, 1),
    ] {
        let mask: Vec<bool> = (0..mask_len).map(|i| (i / 11 + i * i) % 3 != 1).collect();
        let mask = mask.repeat(times);
        let values: Vec<f32> = (0..mask_len * times).map(|i| (i % 1000) as f32).collect();
        let picked: Vec<f64> = (0..values.len())
            .filter(|i| mask[*i])
            .map(|i| f64::from(values[i]))
            .collect();
        let stats = MaskedStats::of(&values, &mask).unwrap().unwrap();
        assert_eq!(stats.count, picked.len());
        // Sums of whole numbers below 2^53 are exact in any order.
        assert_eq!(stats.sum, picked.iter().sum::<f64>());
        let square: f64 = picked.iter().map(|v| v * v).sum();
        assert_eq!(stats.rms, (square / picked.len() as f64).sqrt());
        let mean = stats.sum / picked.len() as f64;
        let spread: f64 = picked.iter().map(|v| (v - mean) * (v - mean)).sum();
        let std = (spread / picked.len() as f64).sqrt();
        assert!((stats.std - std).abs() <= 1e-12 * std, "{stats:?} {std}");
        let zeros = vec![0.0f32; values.len()];
        assert_eq!(rmse_within(&values, &zeros, &mask), Ok(Some(stats.rms)));
    }
}

#[test]
fn wrong_masks_are_errors_and_empty_ones_none() {
    assert_eq!(MaskedStats::of(&[1.0f32; 6], &[false; 6]).unwrap(), None);
    assert_eq!(rmse_within(&[1.0f32; 2], &[1.0; 2], &[false; 2]), Ok(None));
    for refused in [
        MaskedStats::of(&[1.0f32; 6], &[true; 4]).err(),
        MaskedStats::of(&[1.0f32; 6], &[]).err(),
        MaskedStats::of(&[1.0f32; 6], &[true; 3]).err(),
        rmse_within(&[1.0f32; 2], &[1.0; 3], &[true; 2]).err(),
        rmse_within(&[1.0f32; 1024], &[1.0; 1024], &[true; 2]).err(),
    ] {
        assert!(
            matches!(refused, Some(RadonError::WrongLength { .. })),
            "{refused:?}"
        );
    }
}

#[test]
fn a_small_spread_about_a_large_mean_is_accurate() {
    // Exact integers; sums of 2e5 of them round by thousands.
    let small: Vec<f64> = (0..200_000).map(|i| f64::from(i * 7 % 9)).collect();
    let large: Vec<f64> = small.iter().map(|v| v + 1e14).collect();
    let mask = vec![true; small.len()];
    let [small, large] = [&small, &large].map(|v| MaskedStats::of(v, &mask).unwrap().unwrap());
    assert!((large.std / small.std - 1.0).abs() < 1e-12, "{large:?}");
}

/// Squares of these under- or overflow.
#[test]
fn values_of_any_size_have_statistics() {
    for size in [1e-310, 1e-200, 1e-120, 1e160, 1e307] {
        let mask: Vec<bool> = (0..9000).map(|i| i % 7 != 0).collect();
        let plain: Vec<f64> = (0..9000).map(|i| f64::from(i % 13) - 4.0).collect();
        let scaled: Vec<f64> = plain.iter().map(|v| v * size).collect();
        let [plain_stats, stats] =
            [&plain, &scaled].map(|v| MaskedStats::of(v, &mask).unwrap().unwrap());
        // A number of 1e-310 has 40 bits.
        let tolerance = if size < 1e-300 { 1e-9 } else { 1e-13 };
        for (got, expected) in [
            (stats.mean, plain_stats.mean),
            (stats.std, plain_stats.std),
            (stats.rms, plain_stats.rms),
        ] {
            assert!(
                (got / size / expected - 1.0).abs() < tolerance,
                "{size:e}: {stats:?}"
            );
        }
        let zeros = vec![0.0; 9000];
        let rmse = rmse_within(&scaled, &zeros, &mask).unwrap().unwrap();
        assert!((rmse / stats.rms - 1.0).abs() < tolerance, "{rmse:e}");
        assert_eq!(rmse_within(&scaled, &scaled, &mask), Ok(Some(0.0)));
    }
    let zeros = MaskedStats::of(&[0.0; 3], &[true; 3]).unwrap().unwrap();
    assert_eq!((zeros.mean, zeros.std, zeros.rms), (0.0, 0.0, 0.0));
}

/// Sums with such a sample are not finite, and differences from an infinite or undefined mean are undefined; in one and several blocks.
#[test]
fn statistics_of_samples_that_are_not_finite_are_not_finite() {
    let infinite = f64::INFINITY;
    for (sample, sum, rms) in [
        (f64::NAN, f64::NAN, f64::NAN),
        (infinite, infinite, infinite),
        (-infinite, -infinite, infinite),
    ] {
        for (len, at) in [(1, 0), (4, 2), (9000, 50), (9000, 8999)] {
            let mut values: Vec<f64> = (0..len).map(|i| f64::from(i % 10)).collect();
            values[at] = sample;
            let single: Vec<f32> = values.iter().map(|&v| v as f32).collect();
            let mut mask = vec![true; values.len()];
            for stats in [
                MaskedStats::of(&values, &mask).unwrap().unwrap(),
                MaskedStats::of(&single, &mask).unwrap().unwrap(),
            ] {
                for (got, expected) in [(stats.sum, sum), (stats.mean, sum), (stats.rms, rms)] {
                    assert_eq!(got.to_string(), expected.to_string(), "{stats:?}");
                }
                assert!(stats.std.is_nan(), "{stats:?}");
            }
            mask[at] = false;
            let others = MaskedStats::of(&values, &mask).unwrap();
            assert!(others.is_none_or(|stats| stats.std.is_finite()));
        }
    }
}
