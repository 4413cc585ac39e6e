//! Poisson noise: its moments, its distribution, its independence of order and threads.
#![cfg(feature = "noise")]

use radon::{CountScale, RadonError, poisson_counts, poisson_counts_into};

#[test]
fn mean_and_variance_agree_with_poisson() {
    let n = 200_000;
    for mean in [0.01, 0.7, 5.0, 30.0, 1e3, 1e6] {
        let counts = poisson_counts(&vec![mean / 8.0; n], CountScale::PerUnit(8.0), 42).unwrap();
        assert!(counts.iter().all(|c: &f64| *c >= 0.0 && c.fract() == 0.0));
        let average = counts.iter().sum::<f64>() / n as f64;
        let variance = counts.iter().map(|c| (c - average).powi(2)).sum::<f64>() / (n - 1) as f64;
        // Five standard errors: of the mean, sqrt(m / n); of the variance, sqrt((2 m^2 + m) / n).
        assert!(
            (average - mean).abs() < 5.0 * (mean / n as f64).sqrt(),
            "{mean}: {average}"
        );
        let error = ((2.0 * mean * mean + mean) / n as f64).sqrt();
        assert!((variance - mean).abs() < 5.0 * error, "{mean}: {variance}");
    }
}

#[test]
fn frequencies_agree_with_poisson() {
    let n = 300_000;
    for (mean, classes) in [(0.8_f64, 6), (4.0, 13), (20.0, 40), (25.5, 45)] {
        let counts = poisson_counts(&vec![mean; n], CountScale::PerUnit(1.0), 5).unwrap();
        let mut found = vec![0.0; classes + 1];
        for c in counts {
            found[(c as usize).min(classes)] += 1.0;
        }
        let (mut p, mut rest, mut chi, mut freedom) = ((-mean).exp(), 1.0, 0.0, -1.0);
        for (k, found) in found.iter().enumerate() {
            let share = if k == classes { rest } else { p };
            let expected = n as f64 * share;
            if expected > 5.0 {
                chi += (found - expected).powi(2) / expected;
                freedom += 1.0;
            }
            rest -= p;
            p *= mean / (k + 1) as f64;
        }
        // Five standard deviations of chi square.
        let bound = freedom + 5.0 * (2.0_f64 * freedom).sqrt();
        assert!(chi < bound, "{mean}: chi square {chi} of {freedom}");
    }
}

#[test]
fn neighbours_are_independent() {
    let n = 200_000;
    let counts = poisson_counts(&vec![10.0; n], CountScale::PerUnit(1.0), 11).unwrap();
    for lag in [1, 2, 64, 4096] {
        let pairs = (n - lag) as f64;
        let sum: f64 = counts
            .iter()
            .zip(&counts[lag..])
            .map(|(a, b)| (a - 10.0) * (b - 10.0))
            .sum();
        // The correlation of independent samples has standard deviation 1 / sqrt(n).
        assert!((sum / pairs / 10.0).abs() < 5.0 / pairs.sqrt(), "{lag}");
    }
    let other = poisson_counts(&vec![10.0; n], CountScale::PerUnit(1.0), 12).unwrap();
    let sum: f64 = counts
        .iter()
        .zip(&other)
        .map(|(a, b)| (a - 10.0) * (b - 10.0))
        .sum();
    assert!((sum / n as f64 / 10.0).abs() < 5.0 / (n as f64).sqrt());
}

#[test]
fn a_sample_depends_on_seed_index_and_mean_only() {
    let means: Vec<f32> = (0..20_000).map(|k| (k % 97) as f32).collect();
    let scale = CountScale::PerUnit(0.7);
    let pool = |n| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
    };
    let one = pool(1).install(|| poisson_counts(&means, scale, 3).unwrap());
    let two = pool(2).install(|| poisson_counts(&means, scale, 3).unwrap());
    assert!(one == two);
    assert!(one != poisson_counts(&means, scale, 4).unwrap());
    // A single view, and the same view among changed ones.
    let mut part = vec![0.0_f32; 1000];
    poisson_counts_into(&means[7000..8000], 0.7, 3, 7000, &mut part).unwrap();
    assert!(part[..] == one[7000..8000]);
    let mut changed = means.clone();
    changed[..7000].fill(1e4);
    assert!(poisson_counts(&changed, scale, 3).unwrap()[7000..] == one[7000..]);
    // The stored type changes only the rounding.
    let wide: Vec<f64> = means.iter().map(|&m| f64::from(m)).collect();
    let wide = poisson_counts(&wide, scale, 3).unwrap();
    assert!(one.iter().zip(&wide).all(|(a, b)| f64::from(*a) == *b));
}

#[test]
fn zero_means_give_zero_counts_and_a_total_is_met() {
    assert!(poisson_counts(&[0.0_f32; 100], CountScale::PerUnit(1e6), 1).unwrap() == [0.0; 100]);
    assert!(poisson_counts(&[1e-320_f64; 10], CountScale::PerUnit(1e-10), 1).unwrap() == [0.0; 10]);
    let means: Vec<f64> = (0..1000).map(|k| f64::from(k % 10)).collect();
    let scale = CountScale::Total(1e6);
    assert!((scale.per_unit(&means).unwrap() - 1e6 / 4500.0).abs() < 1e-10);
    let total: f64 = poisson_counts(&means, scale, 9).unwrap().iter().sum();
    assert!((total - 1e6).abs() < 5.0 * 1e3);
    let none = poisson_counts::<f32>(&[], CountScale::PerUnit(1.0), 0);
    assert!(none.unwrap().is_empty());
}

#[test]
fn invalid_input_is_rejected() {
    let draw = |sample: f64, scale| poisson_counts(&[1.0, sample], scale, 0);
    for bad in [f64::NAN, f64::INFINITY, -1.0, -1e-300] {
        for scale in [CountScale::PerUnit(1.0), CountScale::Total(1.0)] {
            let refused = draw(bad, scale).unwrap_err();
            let named = match bad.is_finite() {
                true => matches!(refused, RadonError::OutOfRange { what: "sample", .. }),
                false => matches!(refused, RadonError::NotFinite { what: "sample", .. }),
            };
            assert!(named, "{bad}: {refused:?}");
        }
        for scale in [CountScale::PerUnit(bad), CountScale::Total(bad)] {
            let refused = draw(1.0, scale);
            assert!(
                matches!(
                    refused,
                    Err(RadonError::NotFinite { .. } | RadonError::NotPositive { .. })
                ),
                "{bad}: {refused:?}"
            );
        }
    }
    assert!(matches!(
        draw(1.0, CountScale::PerUnit(0.0)),
        Err(RadonError::NotPositive { .. })
    ));
    assert!(matches!(
        draw(1e16, CountScale::PerUnit(1.0)),
        Err(RadonError::OutOfRange { .. })
    ));
    let none = poisson_counts(&[0.0_f32; 3], CountScale::Total(5.0), 0);
    assert!(matches!(none, Err(RadonError::NotPositive { .. })));
    let short = poisson_counts_into(&[1.0_f32; 3], 1.0, 0, 0, &mut [0.0; 2]);
    assert!(matches!(short, Err(RadonError::WrongLength { .. })));
}
