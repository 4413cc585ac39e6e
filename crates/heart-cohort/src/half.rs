//! Half precision, IEEE 754 binary16.

/// Returns the bits of the nearest half-precision number, ties to even; `None` for NaN and beyond 65 504, the largest one. The
/// relative error is at most 2^-11 above 6.1e-5, the absolute error at most 2^-25 below.
pub(crate) fn half(value: f32) -> Option<u16> {
    let bits = value.to_bits();
    let sign = (bits >> 16) as u16 & 0x8000;
    let exponent = (bits >> 23 & 0xff) as i32 - 127;
    // Fraction bits that half precision lacks; more for subnormal numbers.
    let dropped = 13 + (-14 - exponent).clamp(0, 12) as u32;
    let fraction = bits & 0x7f_ffff | 0x80_0000;
    let kept = fraction >> dropped;
    let (rest, tie) = (fraction & ((1 << dropped) - 1), 1 << (dropped - 1));
    let rounded = kept + u32::from(rest > tie || (rest == tie && kept & 1 == 1));
    // The leading bit of a normal number adds one to the exponent; so does a carry of the rounding.
    let biased = (exponent + 14).max(0) as u32;
    let found = match exponent {
        ..-25 => 0,
        _ => (biased << 10) + rounded,
    };
    (found < 0x7c00 && exponent < 16).then_some(sign | found as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value of the bits by the definition of the format.
    fn value(bits: u16) -> f64 {
        let (exponent, fraction) = (bits >> 10 & 31, f64::from(bits & 1023));
        let size = match exponent {
            0 => fraction * 2f64.powi(-24),
            e => (1024.0 + fraction) * 2f64.powi(i32::from(e) - 25),
        };
        if bits >> 15 == 1 { -size } else { size }
    }

    #[test]
    fn half_precision_numbers_are_exact_and_ties_are_even() {
        for bits in (0..0x7c00).chain(0x8000..0xfc00) {
            let here = value(bits);
            assert_eq!(half(here as f32), Some(bits), "{here}");
            if bits & 0x7fff == 0x7bff {
                continue;
            }
            // The midpoint to the next number, and one step of single precision on either side.
            let tie = (0.5 * (here + value(bits + 1))) as f32;
            let even = bits + (bits & 1);
            assert_eq!(half(tie), Some(even), "{tie}");
            let [below, above] = [tie.to_bits() - 1, tie.to_bits() + 1].map(f32::from_bits);
            assert_eq!(
                [half(below), half(above)],
                [Some(bits), Some(bits + 1)],
                "{tie}"
            );
        }
    }

    #[test]
    fn numbers_beyond_the_range_are_rejected() {
        assert_eq!(half(65_519.0), Some(0x7bff));
        for value in [65_520.0, -65_520.0, 1e30, f32::INFINITY, f32::NAN] {
            assert_eq!(half(value), None, "{value}");
        }
        for value in [1e-8, 1e-30, f32::MIN_POSITIVE, 1e-42] {
            assert_eq!(half(-value), Some(0x8000), "{value}");
        }
    }
}
