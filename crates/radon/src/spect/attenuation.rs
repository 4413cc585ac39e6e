//! Escape of photons from a cell towards the camera.

use crate::Sample;
use crate::simd::{Lanes, ROWS};

/// The average of exp(-t) over t from 0 to x, (1 - exp(-x)) / x, by its Taylor series at x / 2^n: the fraction of a uniform emission that
/// leaves a cell of optical thickness x.
#[derive(Debug)]
pub(super) struct Escape<T> {
    /// Coefficients (-1)^k / (k + 1)!, the highest first.
    series: Vec<T>,
    /// 2^-n and n.
    scale: T,
    doublings: usize,
}

impl<T: Sample> Escape<T> {
    /// Prepares cells up to this optical thickness.
    pub(super) fn new(thickest: f64) -> Self {
        let (mut most, mut doublings) = (thickest, 0);
        while most > 0.5 {
            most *= 0.5;
            doublings += 1;
        }
        // The first omitted term is below rounding.
        let (mut series, mut size, mut factorial) = (vec![], 1.0, 1.0);
        for k in 0.. {
            factorial *= f64::from(k + 1);
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            series.push(T::of(sign / factorial));
            size *= most / f64::from(k + 2);
            if size < 0.25 * T::EPSILON.f64() {
                break;
            }
        }
        series.reverse();
        Self {
            series,
            scale: T::of(0.5_f64.powi(doublings)),
            doublings: doublings as usize,
        }
    }

    /// Returns the fraction of a cell's emission that leaves it and passes everything in front, and multiplies `passed` by the transmission
    /// of the cell.
    #[inline(always)]
    pub(super) fn step<const FUSED: bool>(
        &self,
        thickness: &Lanes<T>,
        passed: &mut Lanes<T>,
    ) -> Lanes<T> {
        let mut x = thickness.0;
        x.iter_mut().for_each(|x| *x *= self.scale);
        let mut mean = [T::ZERO; ROWS];
        for &c in &self.series {
            for (mean, &x) in mean.iter_mut().zip(&x) {
                *mean = match FUSED {
                    true => mean.fused(x, c),
                    false => *mean * x + c,
                };
            }
        }
        for _ in 0..self.doublings {
            // mean(2 x) = mean(x) (1 + exp(-x)) / 2.
            for (mean, x) in mean.iter_mut().zip(&mut x) {
                *mean *= T::ONE - T::of(0.5) * *x * *mean;
                *x += *x;
            }
        }
        for ((mean, &x), passed) in mean.iter_mut().zip(&thickness.0).zip(&mut passed.0) {
            let through = T::ONE - x * *mean;
            *mean *= *passed;
            // Clamps negative rounding residue of an opaque cell.
            *passed *= if through > T::ZERO { through } else { T::ZERO };
        }
        Lanes(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_agrees_with_the_mean_to_rounding() {
        for thickest in [1e-3, 0.3, 2.0, 40.0] {
            let escape = Escape::<f64>::new(thickest);
            for part in [0.0, 1e-9, 0.1, 0.7, 1.0] {
                let x = part * thickest;
                let mean = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
                let mut passed = Lanes::splat(0.5);
                let out = escape.step::<false>(&Lanes::splat(x), &mut passed).0[0];
                assert!((out - 0.5 * mean).abs() < 1e-15, "{x}: {out}");
                assert!((passed.0[0] - 0.5 * (-x).exp()).abs() < 1e-14, "{x}");
            }
        }
    }
}
