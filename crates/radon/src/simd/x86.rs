//! The registers of x86-64: AVX2 and AVX-512.

use std::arch::x86_64::*;

use crate::simd::vector::{RUN, Vector};

macro_rules! vector {
    ($name:ident, $register:ident, $t:ident, $width:literal, $splat:ident, $load:ident, $store:ident, $fma:ident, $add:ident, $sub:ident, { $($more:item)* }) => {
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $name($register);

        impl Vector<$t> for $name {
            const WIDTH: usize = $width;
            #[inline(always)]
            unsafe fn splat(x: $t) -> Self {
                // SAFETY: the machine has the set and the pointers are valid, as the caller promised.
                Self(unsafe { $splat(x) })
            }
            #[inline(always)]
            unsafe fn load(at: *const $t) -> Self {
                // SAFETY: the machine has the set and the pointers are valid, as the caller promised.
                Self(unsafe { $load(at) })
            }
            #[inline(always)]
            unsafe fn store(self, at: *mut $t) {
                // SAFETY: the machine has the set and the pointers are valid, as the caller promised.
                unsafe { $store(at, self.0) }
            }
            #[inline(always)]
            unsafe fn multiply_add(self, a: Self, b: Self) -> Self {
                // SAFETY: the machine has the set and the pointers are valid, as the caller promised.
                Self(unsafe { $fma(self.0, a.0, b.0) })
            }
            #[inline(always)]
            unsafe fn plus(self, other: Self) -> Self {
                // SAFETY: the machine has the set, as the caller promised.
                Self(unsafe { $add(self.0, other.0) })
            }
            #[inline(always)]
            unsafe fn minus(self, other: Self) -> Self {
                // SAFETY: the machine has the set, as the caller promised.
                Self(unsafe { $sub(self.0, other.0) })
            }
            #[inline(always)]
            fn multiply_add_one(x: $t, a: $t, b: $t) -> $t {
                x.mul_add(a, b)
            }
            $($more)*
        }
    };
}
vector!(
    F32x8,
    __m256,
    f32,
    8,
    _mm256_set1_ps,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_fmadd_ps,
    _mm256_add_ps,
    _mm256_sub_ps,
    {
        #[inline(always)]
        unsafe fn zip(self, other: Self) -> (Self, Self) {
            // SAFETY: the machine has the set, as the caller promised.
            unsafe {
                let low = _mm256_unpacklo_ps(self.0, other.0);
                let high = _mm256_unpackhi_ps(self.0, other.0);
                (
                    Self(_mm256_permute2f128_ps::<0x20>(low, high)),
                    Self(_mm256_permute2f128_ps::<0x31>(low, high)),
                )
            }
        }

        #[inline(always)]
        unsafe fn gather_close(row: *const f32, index: &[i32]) -> Self {
            // SAFETY: the machine has the set and the window is valid to read, as the caller promised.
            unsafe {
                let least = index[0].min(index[7]);
                let row = row.add(least as usize);
                let (a, b) = (_mm256_loadu_ps(row), _mm256_loadu_ps(row.add(8)));
                let j = _mm256_loadu_si256(index[..8].as_ptr().cast());
                Self(pick(a, b, _mm256_sub_epi32(j, _mm256_set1_epi32(least))))
            }
        }

        #[inline(always)]
        unsafe fn add_run(
            sums: &mut [f32; RUN],
            row: *const f32,
            first: f32,
            lane_dx: &[f32; RUN],
            most: f32,
            narrow: bool,
        ) {
            // SAFETY: the machine has the set, and the pointers are valid to read, as the caller promised; all arrays are RUN long.
            unsafe {
                let (index, weight) = Self::locate(first, lane_dx, most);
                for half in [0, 8] {
                    let j = _mm256_loadu_si256(index[half..].as_ptr().cast());
                    let w = _mm256_loadu_ps(weight[half..].as_ptr());
                    let (p0, p1) = if narrow {
                        // The samples of half a run are in two registers from its least index on.
                        let least = index[half].min(index[half + 7]);
                        let row = row.add(least as usize);
                        let (a, b) = (_mm256_loadu_ps(row), _mm256_loadu_ps(row.add(8)));
                        let j = _mm256_sub_epi32(j, _mm256_set1_epi32(least));
                        let next = _mm256_add_epi32(j, _mm256_set1_epi32(1));
                        (pick(a, b, j), pick(a, b, next))
                    } else {
                        (
                            _mm256_i32gather_ps::<4>(row, j),
                            _mm256_i32gather_ps::<4>(row.add(1), j),
                        )
                    };
                    let near = _mm256_sub_ps(_mm256_set1_ps(1.0), w);
                    let at = sums[half..].as_mut_ptr();
                    let sum = _mm256_fmadd_ps(near, p0, _mm256_loadu_ps(at));
                    _mm256_storeu_ps(at, _mm256_fmadd_ps(w, p1, sum));
                }
            }
        }
    }
);
vector!(
    F64x4,
    __m256d,
    f64,
    4,
    _mm256_set1_pd,
    _mm256_loadu_pd,
    _mm256_storeu_pd,
    _mm256_fmadd_pd,
    _mm256_add_pd,
    _mm256_sub_pd,
    {
        #[inline(always)]
        unsafe fn zip(self, other: Self) -> (Self, Self) {
            // SAFETY: the machine has the set, as the caller promised.
            unsafe {
                let low = _mm256_unpacklo_pd(self.0, other.0);
                let high = _mm256_unpackhi_pd(self.0, other.0);
                (
                    Self(_mm256_permute2f128_pd::<0x20>(low, high)),
                    Self(_mm256_permute2f128_pd::<0x31>(low, high)),
                )
            }
        }
    }
);
vector!(
    F32x16,
    __m512,
    f32,
    16,
    _mm512_set1_ps,
    _mm512_loadu_ps,
    _mm512_storeu_ps,
    _mm512_fmadd_ps,
    _mm512_add_ps,
    _mm512_sub_ps,
    {
        #[inline(always)]
        unsafe fn zip(self, other: Self) -> (Self, Self) {
            // SAFETY: the machine has the set, as the caller promised.
            unsafe {
                let low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
                let high = _mm512_add_epi32(low, _mm512_set1_epi32(8));
                (
                    Self(_mm512_permutex2var_ps(self.0, low, other.0)),
                    Self(_mm512_permutex2var_ps(self.0, high, other.0)),
                )
            }
        }

        #[inline(always)]
        unsafe fn gather_close(row: *const f32, index: &[i32]) -> Self {
            // SAFETY: the machine has the set and the window is valid to read, as the caller promised.
            unsafe {
                let least = index[0].min(index[15]);
                let row = row.add(least as usize);
                let (a, b) = (_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(16)));
                let j = _mm512_loadu_si512(index[..16].as_ptr().cast());
                let j = _mm512_sub_epi32(j, _mm512_set1_epi32(least));
                Self(_mm512_permutex2var_ps(a, j, b))
            }
        }

        #[inline(always)]
        unsafe fn add_run(
            sums: &mut [f32; RUN],
            row: *const f32,
            first: f32,
            lane_dx: &[f32; RUN],
            most: f32,
            narrow: bool,
        ) {
            // SAFETY: the machine has the set, and the pointers are valid to read, as the caller promised; `sums` is RUN long.
            unsafe {
                let (j, w) = locate_16(first, lane_dx, most);
                let (p0, p1) = if narrow {
                    // The samples of the whole run are in two registers.
                    let (a, b) = (_mm512_loadu_ps(row), _mm512_loadu_ps(row.add(16)));
                    let next = _mm512_add_epi32(j, _mm512_set1_epi32(1));
                    (
                        _mm512_permutex2var_ps(a, j, b),
                        _mm512_permutex2var_ps(a, next, b),
                    )
                } else {
                    (
                        _mm512_i32gather_ps::<4>(j, row),
                        _mm512_i32gather_ps::<4>(j, row.add(1)),
                    )
                };
                let near = _mm512_sub_ps(_mm512_set1_ps(1.0), w);
                let sum = _mm512_fmadd_ps(near, p0, _mm512_loadu_ps(sums.as_ptr()));
                _mm512_storeu_ps(sums.as_mut_ptr(), _mm512_fmadd_ps(w, p1, sum));
            }
        }
    }
);
vector!(
    F64x8,
    __m512d,
    f64,
    8,
    _mm512_set1_pd,
    _mm512_loadu_pd,
    _mm512_storeu_pd,
    _mm512_fmadd_pd,
    _mm512_add_pd,
    _mm512_sub_pd,
    {
        #[inline(always)]
        unsafe fn zip(self, other: Self) -> (Self, Self) {
            // SAFETY: the machine has the set, as the caller promised.
            unsafe {
                let low = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
                let high = _mm512_add_epi64(low, _mm512_set1_epi64(4));
                (
                    Self(_mm512_permutex2var_pd(self.0, low, other.0)),
                    Self(_mm512_permutex2var_pd(self.0, high, other.0)),
                )
            }
        }

        #[inline(always)]
        unsafe fn gather(row: *const f64, index: &[i32]) -> Self {
            // SAFETY: the machine has the set and every index is valid to read, as the caller promised.
            unsafe {
                Self(_mm512_i32gather_pd::<8>(
                    _mm256_loadu_si256(index[..8].as_ptr().cast()),
                    row,
                ))
            }
        }
    }
);

#[inline(always)]
unsafe fn locate_16(first: f32, lane_dx: &[f32; RUN], most: f32) -> (__m512i, __m512) {
    // SAFETY: the machine has the set, as the caller promised; `lane_dx` is RUN long.
    unsafe {
        let t = _mm512_add_ps(_mm512_set1_ps(first), _mm512_loadu_ps(lane_dx.as_ptr()));
        let t = _mm512_min_ps(_mm512_max_ps(t, _mm512_setzero_ps()), _mm512_set1_ps(most));
        let j = _mm512_cvttps_epi32(t);
        (j, _mm512_sub_ps(t, _mm512_cvtepi32_ps(j)))
    }
}

/// Selects pixels of a window of two registers by 4-bit positions, whose first bit selects the register.
///
/// # Safety
/// The machine has AVX2.
#[inline(always)]
pub(super) unsafe fn pick(a: __m256, b: __m256, place: __m256i) -> __m256 {
    // SAFETY: the caller's promise.
    unsafe {
        _mm256_blendv_ps(
            _mm256_permutevar8x32_ps(a, place),
            _mm256_permutevar8x32_ps(b, place),
            _mm256_castsi256_ps(_mm256_slli_epi32::<28>(place)),
        )
    }
}
