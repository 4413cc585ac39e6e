//! The ramp and its windows against their definitions.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use radon::{Window, padded_len, ramp_response, ramp_sample};

fn windows() -> Vec<Window> {
    vec![
        Window::RamLak,
        Window::SheppLogan,
        Window::Cosine,
        Window::Hamming,
        Window::Hann,
        Window::Butterworth { order: 3 },
        Window::Custom(vec![1.0, 0.9, 0.2]),
    ]
}

/// The kernel `2 * integral_0^(1/2) f W(f) cos(2 pi f n) df` by Simpson's rule.
fn kernel(window: &Window, cutoff: f64, n: i64) -> f64 {
    let steps = 200_000;
    let h = 0.5 / steps as f64;
    let value = |k: usize| {
        let f = k as f64 * h;
        2.0 * f * window.gain(f / 0.5 / cutoff) * (2.0 * PI * f * n as f64).cos()
    };
    (0..=steps)
        .map(|k| {
            value(k)
                * if k == 0 || k == steps {
                    1.0
                } else {
                    2.0 + 2.0 * (k % 2) as f64
                }
        })
        .sum::<f64>()
        * h
        / 3.0
}

#[test]
fn ramp_samples_are_the_band_limited_ramp() {
    for n in [0, 1, 2, 3, 10, 51] {
        assert_relative_eq!(
            ramp_sample(n),
            kernel(&Window::RamLak, 1.0, n),
            epsilon = 1e-10
        );
        assert_eq!(ramp_sample(n), ramp_sample(-n));
    }
}

#[test]
fn every_window_is_one_at_zero_and_never_amplifies() {
    for window in windows() {
        assert_eq!(window.gain(0.0), 1.0, "{window:?}");
        for k in 1..=20 {
            let gain = window.gain(k as f64 / 20.0);
            assert!((0.0..=1.0).contains(&gain), "{window:?}");
        }
    }
    assert_relative_eq!(
        Window::Butterworth { order: 3 }.gain(1.0),
        0.5_f64.sqrt(),
        epsilon = 1e-15
    );
    assert_relative_eq!(Window::Hamming.gain(1.0), 0.08, epsilon = 1e-15);
}

#[test]
fn responses_are_those_of_the_windowed_kernel() {
    for window in windows() {
        for cutoff in [1.0, 0.6] {
            let len = 64;
            let response = ramp_response(&window, cutoff, len).unwrap();
            let taps: Vec<f64> = (0..=32).map(|n| kernel(&window, cutoff, n)).collect();
            for (k, r) in response.iter().enumerate() {
                let cosine = |n: usize| (2.0 * PI * (k * n) as f64 / len as f64).cos();
                let sum = taps[0]
                    + 2.0 * (1..32).map(|n| taps[n] * cosine(n)).sum::<f64>()
                    + taps[32] * cosine(32);
                // What folds back from beyond 16 * 64 samples; the tail of a window that ends in a step is the longest.
                let tolerance = if cutoff < 1.0 { 5e-4 } else { 5e-5 };
                assert!(
                    (r - sum).abs() < tolerance,
                    "{window:?}, cutoff {cutoff}, frequency {k}: {r} and {sum}"
                );
            }
        }
    }
}

#[test]
fn the_mean_of_an_image_is_not_lost() {
    // Cut to 2n samples the ramp keeps a small positive response at zero, sum_(|n| > len/2) 1/(pi n)^2 over odd n ~ 2/(pi^2 len);
    // sampling |f| would give 0.
    for len in [64, 512, 4096] {
        let response = ramp_response(&Window::RamLak, 1.0, len).unwrap();
        assert_relative_eq!(
            response[0],
            2.0 / (PI * PI * len as f64),
            max_relative = 1e-2
        );
    }
}

#[test]
fn padding_is_at_least_what_is_asked_even_and_smooth() {
    for n in 1..3000_usize {
        let len = padded_len(2 * n);
        assert!(
            len >= 2 * n && len.is_multiple_of(2) && len <= 2 * n + 2 * n / 8 + 2,
            "{n}: {len}"
        );
        let mut rest = len;
        for p in [2, 3, 5] {
            while rest.is_multiple_of(p) {
                rest /= p;
            }
        }
        assert_eq!(rest, 1);
    }
}
