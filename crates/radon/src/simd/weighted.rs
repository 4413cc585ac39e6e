//! Weighted sums of rows.

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::registers::Registers;
use crate::simd::vector::Vector;

/// Computes `sums[i]` as the sum over k of `weights[k] * samples[k * stride + i]`. With a stride of one item this is a convolution.
///
/// Cost: one multiply-add per sum and weight.
pub(super) fn weighted_sums<T: Registers>(
    set: InstructionSet,
    samples: &[T],
    stride: usize,
    weights: &[T],
    sums: &mut [T],
) {
    let last = weights.len().saturating_sub(1) * stride;
    assert!(weights.is_empty() || samples.len() >= last + sums.len());
    // SAFETY: a plan contains a set only after `is_available`; the length was checked.
    unsafe { all_sums(set, samples, stride, weights, sums) }
}

per_set!(fn all_sums<Registers>(samples: &[T], stride: usize, weights: &[T], sums: &mut [T]) = all_sums_by);

/// # Safety
/// The machine has the instruction set of `V`; every row that has a weight has as many samples as there are sums.
#[inline(always)]
unsafe fn all_sums_by<T: Scalar, V: Vector<T>>(
    samples: &[T],
    stride: usize,
    weights: &[T],
    sums: &mut [T],
) {
    // SAFETY: the caller's promise.
    unsafe {
        let mut done = some_sums::<T, V, 8>(samples, stride, weights, sums, 0);
        done = some_sums::<T, V, 4>(samples, stride, weights, sums, done);
        done = some_sums::<T, V, 1>(samples, stride, weights, sums, done);
        for i in done..sums.len() {
            let rows = samples[i..].iter().step_by(stride);
            let add = |sum: T, (&x, &weight): (&T, &T)| V::multiply_add_one(weight, x, sum);
            sums[i] = rows.zip(weights).fold(T::ZERO, add);
        }
    }
}

/// Computes `N` registers of sums at a time from `start` on; returns the end of the last ones.
///
/// # Safety
/// As for `all_sums_by`.
#[inline(always)]
unsafe fn some_sums<T: Scalar, V: Vector<T>, const N: usize>(
    samples: &[T],
    stride: usize,
    weights: &[T],
    sums: &mut [T],
    start: usize,
) -> usize {
    let mut done = start;
    for sums in sums[start..].chunks_exact_mut(N * V::WIDTH) {
        // SAFETY: the machine has the set; a row has samples for all sums.
        unsafe {
            let mut own = [V::splat(T::ZERO); N];
            for (k, &weight) in weights.iter().enumerate() {
                let (row, weight) = (samples.as_ptr().add(k * stride + done), V::splat(weight));
                for (i, own) in own.iter_mut().enumerate() {
                    *own = weight.multiply_add(V::load(row.add(i * V::WIDTH)), *own);
                }
            }
            for (i, own) in own.into_iter().enumerate() {
                own.store(sums.as_mut_ptr().add(i * V::WIDTH));
            }
        }
        done += N * V::WIDTH;
    }
    done
}
