//! Conversion between rows of samples and samples with the lanes innermost, a square of registers at a time.

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::registers::Registers;
use crate::simd::vector::Vector;

/// Computes `out[sample * stride + lane] = rows[lane][sample]`; rows have equal length, and `stride` is at least the number of rows.
pub(super) fn interleave<T: Registers>(
    set: InstructionSet,
    rows: &[&[T]],
    stride: usize,
    out: &mut [T],
) {
    let n = rows.first().map_or(0, |row| row.len());
    if n == 0 {
        return;
    }
    assert!(rows.iter().all(|row| row.len() == n) && rows.len() <= stride);
    assert!(out.len() >= (n - 1) * stride + rows.len());
    // SAFETY: a plan contains a set only after `is_available`; the lengths were checked.
    unsafe { interleave_all(set, rows, n, stride, out) }
}

/// The inverse: `rows[lane][sample] = block[sample * stride + lane]`.
pub(super) fn separate<T: Registers>(
    set: InstructionSet,
    block: &[T],
    stride: usize,
    rows: &mut [&mut [T]],
) {
    let n = rows.first().map_or(0, |row| row.len());
    if n == 0 {
        return;
    }
    assert!(rows.iter().all(|row| row.len() == n) && rows.len() <= stride);
    assert!(block.len() >= (n - 1) * stride + rows.len());
    // SAFETY: a plan contains a set only after `is_available`; the lengths were checked.
    unsafe { separate_all(set, block, n, stride, rows) }
}

per_set!(fn interleave_all<Registers>(rows: &[&[T]], n: usize, stride: usize, out: &mut [T]) = interleave_by);
per_set!(fn separate_all<Registers>(block: &[T], n: usize, stride: usize, rows: &mut [&mut [T]]) = separate_by);

/// # Safety
/// The machine has the instruction set of `V`; rows have `n` samples, `out` all of `(n - 1) * stride + rows.len()`.
#[inline(always)]
unsafe fn interleave_by<T: Scalar, V: Vector<T>>(
    rows: &[&[T]],
    n: usize,
    stride: usize,
    out: &mut [T],
) {
    if rows.len().min(n) < V::WIDTH {
        for (lane, row) in rows.iter().enumerate() {
            for (to, &x) in out[lane..].iter_mut().step_by(stride).zip(*row) {
                *to = x;
            }
        }
        return;
    }
    for lane in starts(rows.len(), V::WIDTH) {
        for sample in starts(n, V::WIDTH) {
            // SAFETY: the square lies within the rows and within `out`, by the caller's promise.
            unsafe {
                let from = |i: usize| rows.get_unchecked(lane + i).as_ptr().add(sample);
                let out = out.as_mut_ptr();
                square::<T, V>(from, |i| out.add((sample + i) * stride + lane));
            }
        }
    }
}

/// # Safety
/// As for `interleave_by`.
#[inline(always)]
unsafe fn separate_by<T: Scalar, V: Vector<T>>(
    block: &[T],
    n: usize,
    stride: usize,
    rows: &mut [&mut [T]],
) {
    if rows.len().min(n) < V::WIDTH {
        for (lane, row) in rows.iter_mut().enumerate() {
            for (to, &x) in row.iter_mut().zip(block[lane..].iter().step_by(stride)) {
                *to = x;
            }
        }
        return;
    }
    for lane in starts(rows.len(), V::WIDTH) {
        for sample in starts(n, V::WIDTH) {
            // SAFETY: the square lies within the block and within the rows, by the caller's promise.
            unsafe {
                let to = |i: usize| rows.get_unchecked_mut(lane + i).as_mut_ptr().add(sample);
                square::<T, V>(|i| block.as_ptr().add((sample + i) * stride + lane), to);
            }
        }
    }
}

/// Returns the starts of parts of `width` that cover `len >= width`; the last one may overlap its predecessor.
fn starts(len: usize, width: usize) -> impl Iterator<Item = usize> {
    (0..len.div_ceil(width)).map(move |part| (part * width).min(len - width))
}

/// Transposes a square of a register's width.
///
/// # Safety
/// A register can be read at each `from` and written at each `to`; the machine has the instruction set of `V`.
#[inline(always)]
unsafe fn square<T: Scalar, V: Vector<T>>(
    from: impl Fn(usize) -> *const T,
    to: impl FnMut(usize) -> *mut T,
) {
    // SAFETY: the caller's promise.
    unsafe {
        match V::WIDTH {
            2 => square_of::<T, V, 2>(from, to),
            4 => square_of::<T, V, 4>(from, to),
            8 => square_of::<T, V, 8>(from, to),
            16 => square_of::<T, V, 16>(from, to),
            #[expect(clippy::unreachable, reason = "vectors have 2 to 16 lanes")]
            width => unreachable!("{width} lanes"),
        }
    }
}

/// # Safety
/// As for `square`; the width is `N`.
#[inline(always)]
unsafe fn square_of<T: Scalar, V: Vector<T>, const N: usize>(
    from: impl Fn(usize) -> *const T,
    mut to: impl FnMut(usize) -> *mut T,
) {
    // SAFETY: the caller's promise.
    unsafe {
        let rows: [V; N] = std::array::from_fn(|i| V::load(from(i)));
        for (i, register) in transposed::<T, V, N>(rows).into_iter().enumerate() {
            register.store(to(i));
        }
    }
}

/// Transposes registers: each round halves the distance between samples that become neighbours.
///
/// # Safety
/// The machine has the instruction set of `V`, whose width is `N`.
#[inline(always)]
unsafe fn transposed<T: Scalar, V: Vector<T>, const N: usize>(mut rows: [V; N]) -> [V; N] {
    for _ in 0..N.ilog2() {
        let before = rows;
        for i in 0..N / 2 {
            // SAFETY: the caller's promise.
            (rows[2 * i], rows[2 * i + 1]) = unsafe { before[i].zip(before[i + N / 2]) };
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every set agrees with the definition, for ragged shapes too; samples between the lanes are unchanged.
    #[test]
    fn interleaving_is_inverted() {
        for set in [
            InstructionSet::Baseline,
            InstructionSet::Avx2,
            InstructionSet::Avx512,
            InstructionSet::Neon,
        ] {
            if set.is_available() {
                for (n_rows, n, stride) in [
                    (1, 1, 1),
                    (3, 40, 4),
                    (16, 16, 16),
                    (17, 33, 20),
                    (64, 5, 64),
                ] {
                    check::<f32>(set, n_rows, n, stride);
                    check::<f64>(set, n_rows, n, stride);
                }
            }
        }
    }

    fn check<T: Registers>(set: InstructionSet, n_rows: usize, n: usize, stride: usize) {
        let value = |lane: usize, sample: usize| T::of((lane * 1000 + sample) as f64);
        let rows: Vec<Vec<T>> = (0..n_rows)
            .map(|lane| (0..n).map(|sample| value(lane, sample)).collect())
            .collect();
        let slices: Vec<&[T]> = rows.iter().map(|row| &row[..]).collect();
        let mut block = vec![T::of(-1.0); n * stride];
        interleave(set, &slices, stride, &mut block);
        for (at, &x) in block.iter().enumerate() {
            let (sample, lane) = (at / stride, at % stride);
            let expected = match lane < n_rows {
                true => value(lane, sample),
                false => T::of(-1.0),
            };
            assert_eq!(x, expected, "{set:?} {n_rows} {n} {stride}");
        }
        let mut back = vec![vec![T::ZERO; n]; n_rows];
        let mut slices: Vec<&mut [T]> = back.iter_mut().map(|row| &mut row[..]).collect();
        separate(set, &block, stride, &mut slices);
        assert_eq!(back, rows, "{set:?}");
    }
}
