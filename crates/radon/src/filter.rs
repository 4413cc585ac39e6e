//! The ramp filter: band-limited kernel from its spatial samples, apodising windows, cutoff, zero-padding.

use std::f64::consts::PI;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::error::{RadonError, at_least, finite, positive, within};

/// Apodising window `W(nu)` on the ramp `|f|`, with `nu = f / (cutoff * Nyquist)`; every one but `Custom` is 1 at `nu = 0`.
///
/// ```text
/// RamLak       1                              SheppLogan   sin(pi nu/2) / (pi nu/2)
/// Cosine       cos(pi nu/2)                   Hamming      0.54 + 0.46 cos(pi nu)
/// Hann         0.5 + 0.5 cos(pi nu)           Butterworth  1 / sqrt(1 + nu^(2 order))
/// ```
///
/// All vanish for `nu > 1` except Butterworth, whose `cutoff` is where it has fallen to `1/sqrt(2)`.
#[doc(alias("apodization", "filter"))]
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(rename_all = "kebab-case", deny_unknown_fields)
)]
#[non_exhaustive]
pub enum Window {
    /// No window: highest resolution and noise.
    #[default]
    RamLak,
    /// Ramp times a sinc.
    SheppLogan,
    /// Ramp times a half period of the cosine.
    Cosine,
    /// Ramp times a raised cosine that ends at 0.08.
    Hamming,
    /// Ramp times a raised cosine that ends at 0: the smoothest.
    Hann,
    /// Maximally flat low pass of the given order.
    Butterworth {
        /// Order, at least 1.
        order: u32,
    },
    /// Gains at equally spaced frequencies from 0 to the cutoff (both included), linear in between. A first gain other than
    /// 1 scales the whole image.
    Custom(Vec<f64>),
}

impl Window {
    /// `W(nu)` for `nu >= 0`; NaN for a custom window of fewer than two gains, which every plan rejects.
    #[must_use]
    pub fn gain(&self, nu: f64) -> f64 {
        if let Window::Butterworth { order } = self {
            return 1.0 / (1.0 + nu.powi(2 * (*order).min(1 << 20) as i32)).sqrt();
        }
        if nu > 1.0 {
            return 0.0;
        }
        match self {
            Window::RamLak | Window::Butterworth { .. } => 1.0,
            Window::SheppLogan if nu == 0.0 => 1.0,
            Window::SheppLogan => (PI * nu / 2.0).sin() / (PI * nu / 2.0),
            Window::Cosine => (PI * nu / 2.0).cos(),
            Window::Hamming => 0.54 + 0.46 * (PI * nu).cos(),
            Window::Hann => 0.5 + 0.5 * (PI * nu).cos(),
            Window::Custom(gains) => {
                let at = nu * gains.len().saturating_sub(1) as f64;
                let k = (at as usize).min(gains.len().saturating_sub(2));
                match gains.get(k..k + 2) {
                    Some(&[a, b]) => a + (at - k as f64) * (b - a),
                    _ => f64::NAN,
                }
            }
        }
    }

    fn check(&self) -> Result<(), RadonError> {
        match self {
            Window::Butterworth { order } => {
                at_least("Butterworth order", *order as usize, 1).map(|_| ())
            }
            Window::Custom(gains) => {
                at_least("gains of a custom window", gains.len(), 2)?;
                gains
                    .iter()
                    .try_for_each(|&g| finite("custom window gain", g).map(|_| ()))
            }
            _ => Ok(()),
        }
    }
}

/// Sample `n` of the band-limited ramp for unit pitch: 1/4 at 0, `-1/(pi n)^2` at odd `n`, 0 at even `n` (Kak & Slaney 1988,
/// eq. 3.61). Samples of `|f|` itself would change the mean of the image.
#[must_use]
pub fn ramp_sample(n: i64) -> f64 {
    if n == 0 {
        0.25
    } else if n % 2 == 0 {
        0.0
    } else {
        -1.0 / (PI * n as f64).powi(2)
    }
}

/// Response of the windowed ramp (unit pitch) at the `len/2 + 1` frequencies of a real FFT of even length `len`; an odd `len` is rounded up.
///
/// The window acts on a ramp sampled 16 times more finely in frequency. The kernel that results is then cut to `len` samples, so
/// that a row padded with zeros to `len >= 2 n` gets the linear convolution with this kernel.
///
/// The kernel is exact to rounding for Ram-Lak, Hamming and Hann windows at full cutoff. Otherwise the response differs from that of the exact
/// kernel by less than 2e-3 of its largest value if `cutoff * len >= 8`, the order of a Butterworth window is at most 8 and a custom window has
/// at most 3 gains, none of them negative. Steeper windows have larger errors.
///
/// ```
/// use radon::{Window, padded_len, ramp_response};
/// let len = padded_len(2 * 101)?; // rows of 101 bins
/// assert_eq!(len, 216);
/// let hann = ramp_response(&Window::Hann, 1.0, len)?;
/// let ramp = ramp_response(&Window::RamLak, 1.0, len)?;
/// assert_eq!(ramp.len(), 109);
/// assert!((ramp[54] - 0.25).abs() < 1e-4 && (hann[54] - 0.125).abs() < 1e-4); // half the Nyquist frequency
/// # Ok::<(), radon::RadonError>(())
/// ```
///
/// # Errors
/// A `cutoff` outside `(0, 1]`, a Butterworth order of 0, a custom window with fewer than two gains or with a gain that is not
/// finite; [`RadonError::OutOfRange`] for a `len` below 2 or above 2^23.
pub fn ramp_response(window: &Window, cutoff: f64, len: usize) -> Result<Vec<f64>, RadonError> {
    window.check()?;
    if positive("cutoff", cutoff)? > 1.0 {
        return Err(RadonError::OutOfRange {
            what: "cutoff",
            given: cutoff,
            least: f64::MIN_POSITIVE,
            most: 1.0,
        });
    }
    within("filter length", len as f64, 2.0, LONGEST as f64)?;
    let len = len + len % 2;
    let half = (len / 2) as i64;
    let kernel: Vec<f64> = if *window == Window::RamLak && cutoff == 1.0 {
        (-half + 1..=half).map(ramp_sample).collect()
    } else {
        let fine = 16 * len;
        let mut spectrum = ramp_spectrum(fine);
        let nyquist = (fine / 2) as f64;
        let edge = cutoff * nyquist;
        let stepped = !matches!(window, Window::Butterworth { .. });
        for (k, value) in spectrum.iter_mut().enumerate() {
            let k = k.min(fine - k) as f64;
            // The frequency whose cell a step falls into counts by the part of the cell before the step; cells end at the Nyquist frequency.
            let part = (edge - k + 0.5) / (nyquist - k + 0.5).min(1.0);
            let (nu, part) = match stepped {
                true => ((k / edge).min(1.0), part.clamp(0.0, 1.0)),
                false => (k / edge, 1.0),
            };
            *value *= window.gain(nu) * part / fine as f64;
        }
        FftPlanner::new()
            .plan_fft_inverse(fine)
            .process(&mut spectrum);
        (-half + 1..=half)
            .map(|n| spectrum[n.rem_euclid(fine as i64) as usize].re)
            .collect()
    };
    let mut spectrum = vec![Complex::new(0.0, 0.0); len];
    for (value, n) in kernel.iter().zip(-half + 1..=half) {
        spectrum[n.rem_euclid(len as i64) as usize].re = *value;
    }
    FftPlanner::new()
        .plan_fft_forward(len)
        .process(&mut spectrum);
    Ok(spectrum[..=len / 2].iter().map(|c| c.re).collect())
}

fn ramp_spectrum(len: usize) -> Vec<Complex<f64>> {
    let sample = |k: usize| Complex::new(ramp_sample(k.min(len - k) as i64), 0.0);
    let mut spectrum: Vec<Complex<f64>> = (0..len).map(sample).collect();
    FftPlanner::new()
        .plan_fft_forward(len)
        .process(&mut spectrum);
    spectrum
}

/// Longest filter: a window takes sixteen times as many complex numbers, 2 GB, and the transform's own work arrays.
const LONGEST: usize = 1 << 23;

/// The least even length `>= least` that has no prime factor above 5: the rule for zero-padding.
///
/// # Errors
/// [`RadonError::OutOfRange`] for a `least` above 2^23, the longest filter.
pub fn padded_len(least: usize) -> Result<usize, RadonError> {
    within("padded length", least as f64, 0.0, LONGEST as f64)?;
    let mut len = least.max(2).next_multiple_of(2);
    loop {
        let mut rest = len;
        for p in [2, 3, 5] {
            while rest.is_multiple_of(p) {
                rest /= p;
            }
        }
        if rest == 1 {
            return Ok(len);
        }
        len += 2;
    }
}
