//! Spreading of samples along a line of the spectrum over the cells of a grid, and interpolation between them.

use rustfft::num_complex::Complex;

use crate::scalar::Scalar;
use crate::simd::InstructionSet;
use crate::simd::registers::Registers;
use crate::simd::vector::Vector;

/// Numbers in a row of weights: real and imaginary parts of the largest number of cells of a sample.
pub(crate) const LANES: usize = 16;
/// Fractional bits of a position.
pub(crate) const DIGITS: u32 = 36;

/// Weights of neighbouring cells as polynomials in z, which runs from -1 to 1 within a cell; highest power first.
#[derive(Debug)]
pub struct Taps<T> {
    pub(crate) width: usize,
    /// One number per cell.
    pub(crate) across: Vec<[T; LANES]>,
    /// The same number twice for each cell, for real and imaginary part.
    pub(crate) along: Vec<[T; LANES]>,
}

/// Samples at equal steps through a grid `[column][cell]`.
#[derive(Clone, Copy, Debug)]
pub struct RayPath {
    /// Column and cell at which the weights of the first sample begin, in units of the last bit.
    pub(crate) at: [i64; 2],
    pub(crate) step: [i64; 2],
    /// Period of a column in cells, in the same unit; positions along it stay below.
    pub(crate) period: i64,
    /// Distance between columns.
    pub(crate) stride: usize,
    /// Whether the grid contains the complex conjugates of the samples.
    pub(crate) mirrored: bool,
}

impl RayPath {
    /// Panics if a path of `n` samples leaves a grid of `len` cells.
    fn check(&self, n: usize, width: usize, len: usize) {
        let ends = [self.at[0], self.at[0] + (n as i64 - 1) * self.step[0]];
        assert!(n > 0 && ends.iter().all(|&end| end >= 0));
        let columns = (ends[0].max(ends[1]) >> DIGITS) as usize + width;
        assert!((0..self.period).contains(&self.at[1]) && (0..self.period).contains(&self.step[1]));
        // Whole registers of LANES numbers are read and written.
        assert!((self.period >> DIGITS) as usize + LANES / 2 <= self.stride);
        assert!(columns * self.stride <= len && matches!(width, 4 | 5 | 6 | 8));
    }
}

/// Adds `samples * gains * factor`, or its conjugate, to the cells about each sample.
pub(super) fn spread<T: Registers>(
    set: InstructionSet,
    taps: &Taps<T>,
    path: &RayPath,
    (samples, gains, factor): (&[Complex<T>], &[T], Complex<T>),
    cells: &mut [Complex<T>],
) {
    assert_eq!(samples.len(), gains.len());
    path.check(samples.len(), taps.width, cells.len());
    let cells = cells.as_mut_ptr().cast();
    // SAFETY: a plan contains a set only after `is_available`; `check` has verified that the path lies in the grid.
    unsafe { spread_by(set, taps, path, samples, gains, factor, cells) }
}

/// Interpolates the cells at each position of a path, or their conjugates.
pub(super) fn read_between<T: Registers>(
    set: InstructionSet,
    taps: &Taps<T>,
    path: &RayPath,
    cells: &[Complex<T>],
    out: &mut [Complex<T>],
) {
    path.check(out.len(), taps.width, cells.len());
    let cells = cells.as_ptr().cast();
    // SAFETY: as above.
    unsafe { read_by(set, taps, path, cells, out) }
}

per_set!(fn spread_by<Registers>(taps: &Taps<T>, path: &RayPath, samples: &[Complex<T>], gains: &[T], factor: Complex<T>, cells: *mut T) = spread_widths);
per_set!(fn read_by<Registers>(taps: &Taps<T>, path: &RayPath, cells: *const T, out: &mut [Complex<T>]) = read_widths);

/// # Safety
/// The machine has the instruction set of `V`, and the path lies in the cells.
#[inline(always)]
unsafe fn spread_widths<T: Scalar, V: Vector<T>>(
    taps: &Taps<T>,
    path: &RayPath,
    samples: &[Complex<T>],
    gains: &[T],
    factor: Complex<T>,
    cells: *mut T,
) {
    // SAFETY: the caller's promise.
    unsafe {
        match taps.width {
            4 => spread_all::<T, V, 4>(taps, path, samples, gains, factor, cells),
            5 => spread_all::<T, V, 5>(taps, path, samples, gains, factor, cells),
            6 => spread_all::<T, V, 6>(taps, path, samples, gains, factor, cells),
            _ => spread_all::<T, V, 8>(taps, path, samples, gains, factor, cells),
        }
    }
}

/// # Safety
/// As for `spread_widths`.
#[inline(always)]
unsafe fn read_widths<T: Scalar, V: Vector<T>>(
    taps: &Taps<T>,
    path: &RayPath,
    cells: *const T,
    out: &mut [Complex<T>],
) {
    // SAFETY: the caller's promise.
    unsafe {
        match taps.width {
            4 => read_all::<T, V, 4>(taps, path, cells, out),
            5 => read_all::<T, V, 5>(taps, path, cells, out),
            6 => read_all::<T, V, 6>(taps, path, cells, out),
            _ => read_all::<T, V, 8>(taps, path, cells, out),
        }
    }
}

/// Returns the weights at a position z within a cell, in the first registers.
///
/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn weights<T: Scalar, V: Vector<T>>(powers: &[[T; LANES]], z: V, n: usize) -> [V; 8] {
    // SAFETY: the caller's promise; `n` registers hold LANES numbers at most.
    unsafe {
        let mut sums = [V::splat(T::ZERO); 8];
        for coefficients in powers {
            for i in 0..n {
                let next = V::load(coefficients.as_ptr().add(i * V::WIDTH));
                sums[i] = sums[i].multiply_add(z, next);
            }
        }
        sums
    }
}

/// Returns the position of a sample: index of the first of its cells, and its weights across the columns and along them.
///
/// # Safety
/// The machine has the instruction set of `V`.
#[inline(always)]
unsafe fn place<T: Scalar, V: Vector<T>, const W: usize>(
    taps: &Taps<T>,
    stride: usize,
    at: [i64; 2],
) -> (usize, [T; LANES], [V; 8]) {
    const ONE: f64 = (1_u64 << DIGITS) as f64;
    let [column, cell] = at.map(|t| (t >> DIGITS) as usize);
    // SAFETY: the caller's promise; the registers fill LANES numbers at most.
    unsafe {
        let [x, y] = at.map(|t| {
            let rest = (t & ((1 << DIGITS) - 1)) as f64;
            V::splat(T::of(rest * (2.0 / ONE) - 1.0))
        });
        let (n_across, n_along) = (W.div_ceil(V::WIDTH), (2 * W).div_ceil(V::WIDTH));
        let columns = weights::<T, V>(&taps.across, x, n_across);
        let mut across = [T::ZERO; LANES];
        for i in 0..n_across {
            columns[i].store(across.as_mut_ptr().add(i * V::WIDTH));
        }
        let along = weights::<T, V>(&taps.along, y, n_along);
        (2 * (column * stride + cell), across, along)
    }
}

/// The product of two complex numbers.
#[inline(always)]
fn product<T: Scalar>(a: Complex<T>, b: Complex<T>) -> Complex<T> {
    Complex::new(a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re)
}

/// # Safety
/// As for `spread_widths`; `W` is at least the taps' width.
#[inline(always)]
unsafe fn spread_all<T: Scalar, V: Vector<T>, const W: usize>(
    taps: &Taps<T>,
    path: &RayPath,
    samples: &[Complex<T>],
    gains: &[T],
    factor: Complex<T>,
    cells: *mut T,
) {
    let mut at = path.at;
    let n = (2 * W).div_ceil(V::WIDTH);
    let (real, imaginary) = alternating::<T>();
    // SAFETY: the caller's promise.
    unsafe {
        for (sample, &gain) in samples.iter().zip(gains) {
            let value = product(*sample, factor);
            let im = if path.mirrored { -value.im } else { value.im };
            let (first, across, mut along) = place::<T, V, W>(taps, path.stride, at);
            let zero = V::splat(T::ZERO);
            for (i, weights) in along.iter_mut().take(n).enumerate() {
                // Real and imaginary part alternate in every register.
                let re = V::load(real.as_ptr().add(i * V::WIDTH));
                let im_part = V::load(imaginary.as_ptr().add(i * V::WIDTH));
                let pair = re.multiply_add(V::splat(value.re * gain), zero);
                let pair = im_part.multiply_add(V::splat(im * gain), pair);
                *weights = weights.multiply_add(pair, zero);
            }
            for column in 0..W {
                let weight = V::splat(across[column]);
                let to = cells.add(first + 2 * column * path.stride);
                for i in 0..n {
                    let to = to.add(i * V::WIDTH);
                    along[i].multiply_add(weight, V::load(to)).store(to);
                }
            }
            advance(&mut at, path);
        }
    }
}

/// # Safety
/// As for `spread_all`.
#[inline(always)]
unsafe fn read_all<T: Scalar, V: Vector<T>, const W: usize>(
    taps: &Taps<T>,
    path: &RayPath,
    cells: *const T,
    out: &mut [Complex<T>],
) {
    let mut at = path.at;
    let n = (2 * W).div_ceil(V::WIDTH);
    for value in out {
        let mut products = [T::ZERO; LANES];
        // SAFETY: the caller's promise.
        unsafe {
            let (first, across, along) = place::<T, V, W>(taps, path.stride, at);
            let mut sums = [V::splat(T::ZERO); 8];
            for column in 0..W {
                let weight = V::splat(across[column]);
                let from = cells.add(first + 2 * column * path.stride);
                for i in 0..n {
                    sums[i] = V::load(from.add(i * V::WIDTH)).multiply_add(weight, sums[i]);
                }
            }
            for i in 0..n {
                let product = sums[i].multiply_add(along[i], V::splat(T::ZERO));
                product.store(products.as_mut_ptr().add(i * V::WIDTH));
            }
        }
        let (mut re, mut im) = (T::ZERO, T::ZERO);
        for cell in 0..W {
            re += products[2 * cell];
            im += products[2 * cell + 1];
        }
        *value = Complex::new(re, if path.mirrored { -im } else { im });
        advance(&mut at, path);
    }
}

/// Returns ones at even and at odd positions.
fn alternating<T: Scalar>() -> ([T; LANES], [T; LANES]) {
    let ones = |rest: usize| std::array::from_fn(|i| if i % 2 == rest { T::ONE } else { T::ZERO });
    (ones(0), ones(1))
}

/// Advances to the position of the next sample.
#[inline(always)]
fn advance(at: &mut [i64; 2], path: &RayPath) {
    at[0] += path.step[0];
    at[1] += path.step[1];
    if at[1] >= path.period {
        at[1] -= path.period;
    }
}
