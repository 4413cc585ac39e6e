//! The ramp and its windows against their definitions.

use std::f64::consts::PI;

use crate::common::noise;
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

/// `2 * integral_0^(1/2) f cos(2 pi f x) df`, the band-limited ramp at any position.
fn ramp_at(x: f64) -> f64 {
    if x == 0.0 {
        return 0.25;
    }
    let px = PI * x;
    px.sin() / (2.0 * px) - ((px / 2.0).sin() / px).powi(2)
}

/// Kernel of each window at full cutoff in closed form, without the window's gain: a cosine window shifts the ramp to both sides, a linear one is a
/// parabola in f, and that of Shepp and Logan is known.
fn closed_form(window: &Window, x: f64) -> f64 {
    let moved = |by: f64| 0.5 * (ramp_at(x - by) + ramp_at(x + by));
    match window {
        Window::RamLak => ramp_at(x),
        Window::SheppLogan => {
            // The integral of 2/pi sin(pi f) cos(2 pi f x); at whole x it is 2/(pi^2 (1 - 4 x^2)).
            let part = |y: f64| match 1.0 + 2.0 * y {
                0.0 => 0.0,
                d => (1.0 + (PI * y).sin()) / d,
            };
            (part(x) + part(-x)) / (PI * PI)
        }
        Window::Cosine => moved(0.5),
        Window::Hamming => 0.54 * ramp_at(x) + 0.46 * moved(1.0),
        Window::Hann => 0.5 * ramp_at(x) + 0.5 * moved(1.0),
        // Gains that fall linearly from 1 to 0: f - 2 f^2.
        Window::Custom(gains) if *gains == [1.0, 0.0] => {
            let a = 2.0 * PI * x;
            let square = if a == 0.0 {
                1.0 / 24.0
            } else {
                let (sin, cos) = (a / 2.0).sin_cos();
                sin / (4.0 * a) + cos / (a * a) - 2.0 * sin / (a * a * a)
            };
            ramp_at(x) - 4.0 * square
        }
        other => panic!("no closed form for {other:?}"),
    }
}

/// The kernel `2 * integral_0^(1/2) f W(f) cos(2 pi f n) df` by Simpson's rule, for windows without a closed form.
fn by_quadrature(gain: impl Fn(f64) -> f64, n: f64) -> f64 {
    let steps = 20_000;
    let h = 0.5 / steps as f64;
    let value = |k: usize| {
        let f = k as f64 * h;
        2.0 * f * gain(f) * (2.0 * PI * f * n).cos()
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
        let integral = by_quadrature(|_| 1.0, n as f64);
        assert_relative_eq!(ramp_sample(n), integral, epsilon = 1e-10);
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

/// The response of length 64 against the transform of a kernel's samples.
fn check_response(window: &Window, cutoff: f64, kernel: impl Fn(i64) -> f64, tolerance: f64) {
    let len = 64;
    let response = ramp_response(window, cutoff, len).unwrap();
    assert_eq!(response.len(), 33);
    let taps: Vec<f64> = (0..=32).map(kernel).collect();
    for (k, r) in response.iter().enumerate() {
        let cosine = |n: usize| (2.0 * PI * (k * n) as f64 / len as f64).cos();
        let sum = taps[0]
            + 2.0 * (1..32).map(|n| taps[n] * cosine(n)).sum::<f64>()
            + taps[32] * cosine(32);
        assert!(
            (r - sum).abs() < tolerance,
            "{window:?}, cutoff {cutoff}, frequency {k}: {r} and {sum}"
        );
    }
}

// Aliasing from beyond 16 * 64 samples; the tail of a window that ends in a step is the longest.
const SMOOTH: f64 = 5e-5;
const STEPPED: f64 = 5e-4;

#[test]
fn ram_lak_has_its_kernel() {
    check_response(
        &Window::RamLak,
        1.0,
        |n| closed_form(&Window::RamLak, n as f64),
        // 64 terms of at most 1/4, and a transform.
        1e-14,
    );
    cut_off(&Window::RamLak);
}

#[test]
fn shepp_logan_has_its_kernel() {
    for n in [0_i32, 1, 2, 7] {
        let known = 2.0 / (PI * PI * (1.0 - 4.0 * f64::from(n * n)));
        assert_relative_eq!(
            closed_form(&Window::SheppLogan, f64::from(n)),
            known,
            epsilon = 1e-15
        );
    }
    whole_and_cut_off(&Window::SheppLogan);
}

#[test]
fn cosine_has_its_kernel() {
    whole_and_cut_off(&Window::Cosine);
}

#[test]
fn hamming_has_its_kernel() {
    whole_and_cut_off(&Window::Hamming);
}

#[test]
fn hann_has_its_kernel() {
    whole_and_cut_off(&Window::Hann);
}

#[test]
fn a_custom_window_is_linear_between_its_gains() {
    let none = ramp_response(&Window::Custom(vec![]), 1.0, 64).unwrap_err();
    assert_eq!(
        none.to_string(),
        "gains of a custom window must be at least 2, got 0"
    );
    whole_and_cut_off(&Window::Custom(vec![1.0, 0.0]));
    // Constant gains equal Ram-Lak, and the gain at zero scales the whole response.
    for cutoff in [1.0, 0.6] {
        let flat = ramp_response(&Window::Custom(vec![2.5; 7]), cutoff, 64).unwrap();
        let ramp = ramp_response(&Window::RamLak, cutoff, 64).unwrap();
        for (a, b) in flat.iter().zip(ramp) {
            assert!((a - 2.5 * b).abs() < 2.5 * SMOOTH);
        }
    }
    // Gains of the Hann window at 201 positions: the error of a chord of its cosine is at most (pi/200)^2/16 of it; the ramp ends at 1/2.
    let gains = (0..=200).map(|k| Window::Hann.gain(f64::from(k) / 200.0));
    let custom = ramp_response(&Window::Custom(gains.collect()), 0.8, 64).unwrap();
    let hann = ramp_response(&Window::Hann, 0.8, 64).unwrap();
    for (a, b) in custom.iter().zip(hann) {
        assert!((a - b).abs() < 1e-5);
    }
}

#[test]
fn butterworth_has_half_its_power_at_the_cutoff_and_its_order_beyond() {
    for order in [1, 3, 8] {
        for cutoff in [1.0, 0.6] {
            let power = |f: f64| 1.0 + (2.0 * f / cutoff).powi(order).powi(2);
            // At full cutoff it ends in a step at the limit of the band.
            let kernel = |n| by_quadrature(|f| power(f).sqrt().recip(), n as f64);
            let order = order as u32;
            check_response(&Window::Butterworth { order }, cutoff, kernel, STEPPED);
        }
    }
    let gain = |nu: f64| Window::Butterworth { order: 3 }.gain(nu);
    assert_relative_eq!(gain(1.0), 0.5_f64.sqrt(), epsilon = 1e-15);
    assert_relative_eq!(gain(100.0) / gain(200.0), 8.0, max_relative = 1e-10);
}

/// Full cutoff, and one within the band, where the width of the kernel is inversely proportional to the cutoff.
fn whole_and_cut_off(window: &Window) {
    check_response(window, 1.0, |n| closed_form(window, n as f64), SMOOTH);
    cut_off(window);
}

fn cut_off(window: &Window) {
    for cutoff in [0.6, 0.25] {
        let kernel = |n: i64| cutoff * cutoff * closed_form(window, cutoff * n as f64);
        check_response(window, cutoff, kernel, STEPPED);
    }
}

#[test]
fn the_mean_of_an_image_is_preserved() {
    // Truncated to 2n samples, the ramp has a small positive response at zero, sum_(|n| > len/2) 1/(pi n)^2 over odd n ~ 2/(pi^2 len);
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
fn padding_is_at_least_the_request_even_and_smooth() {
    for n in 1..3000_usize {
        let len = padded_len(2 * n).unwrap();
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

/// Largest deviation of a response from the transform of its kernel, over the largest value of that.
fn error_of(window: &Window, cutoff: f64, len: usize) -> f64 {
    let kernel = |n: usize| match window {
        Window::Butterworth { .. } => by_quadrature(|f| window.gain(2.0 * f / cutoff), n as f64),
        // Its slope changes at steps of the quadrature.
        Window::Custom(gains) if gains.len() == 3 => {
            cutoff * cutoff * by_quadrature(|f| window.gain(2.0 * f), cutoff * n as f64)
        }
        _ => cutoff * cutoff * closed_form(window, cutoff * n as f64),
    };
    let taps: Vec<f64> = (0..=len / 2).map(kernel).collect();
    let (mut error, mut largest) = (0.0_f64, 0.0_f64);
    for (k, got) in ramp_response(window, cutoff, len)
        .unwrap()
        .iter()
        .enumerate()
    {
        let term = |n: usize| taps[n] * (2.0 * PI * (k * n % len) as f64 / len as f64).cos();
        let inner: f64 = (1..len / 2).map(term).sum();
        let exact = taps[0] + 2.0 * inner + term(len / 2);
        error = error.max((got - exact).abs());
        largest = largest.max(exact.abs());
    }
    error / largest
}

#[test]
fn responses_have_the_stated_errors() {
    let exact = [Window::RamLak, Window::Hamming, Window::Hann];
    let windows = [
        Window::SheppLogan,
        Window::Cosine,
        Window::Custom(vec![1.0, 0.0]),
    ];
    for len in [8, 10, 16, 36, 80, 162] {
        for window in &exact {
            let error = error_of(window, 1.0, len);
            // Rounding of sums of `len` terms.
            assert!(error < 1e-13, "{window:?}, {len}: {error:.1e}");
        }
        // From 8 / len to a last one in the cell of the Nyquist frequency.
        let (least, n) = (8.0 / len as f64, 12);
        let cutoffs = (0..=n).map(|k| least.powf(1.0 - f64::from(k) / f64::from(n)));
        for cutoff in cutoffs.chain([1.0 - 1e-3, 1.0 - 1e-5]) {
            for window in windows.iter().chain(&exact) {
                let error = error_of(window, cutoff, len);
                assert!(error < 2e-3, "{window:?}, {cutoff}, {len}: {error:.1e}");
            }
        }
    }
    let gains = noise::<f64>(60, 7);
    let custom = gains
        .chunks(3)
        .map(|g| Window::Custom(g.iter().map(|g| 0.5 + 0.5 * g).collect()));
    let butterworth = [1, 3, 8].map(|order| Window::Butterworth { order });
    for (k, window) in custom.chain(butterworth).enumerate() {
        let len = [10, 16, 36][k % 3];
        for power in [0.0, 0.1, 0.5, 1.0] {
            let cutoff = (8.0 / len as f64).powf(power);
            let error = error_of(&window, cutoff, len);
            assert!(error < 2e-3, "{window:?}, {cutoff}, {len}: {error:.1e}");
        }
    }
    // An odd length is rounded up.
    let [odd, even] = [7, 8].map(|len| ramp_response(&Window::Cosine, 0.7, len));
    assert_eq!(odd, even);
}
