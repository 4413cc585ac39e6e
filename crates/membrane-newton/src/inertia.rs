//! Number of positive eigenvalues of a symmetric tangent, by Sylvester's law of inertia.

use membrane_forces::{DiscreteMembrane, Tangent};

/// Largest entry of L: the backward error of a factorisation without row exchanges is a few rounding errors times its square.
const MOST_GROWTH: f64 = 1e6;
/// Least pivot over the largest entry.
const LEAST_PIVOT: f64 = 1e-13;

/// Counts the positive eigenvalues of `tangent` restricted to moving nodes; overwrites the tangent.
///
/// The tangent must be symmetric there. A congruence A = L D L' preserves the number of positive eigenvalues, which equals that of the
/// positive entries of D; the inner nodes of each block are eliminated before the band (Haynsworth 1968, doi:10.1016/0024-3795(68)90050-5).
/// `None` if a pivot or the growth of L makes the count unreliable. Cost O(blocks p^3 + nodes in the band).
pub(crate) fn positive(discrete: &dyn DiscreteMembrane, tangent: &mut Tangent) -> Option<usize> {
    let size = (tangent.blocks.first()).map_or(0, |block| block.len().isqrt());
    let band = &tangent.band;
    let width = band.lower();
    // row i: entries i - width ..= i
    let lower = band.rows().map(|row| row[..=width].to_vec());
    let mut rows: Vec<Vec<f64>> = lower.collect();
    let mut count = 0;
    for (e, block) in tangent.blocks.iter_mut().enumerate() {
        count += condense(block, size, size - 4)?;
        for i in 0..4 {
            for j in 0..=i {
                let schur = block[(size - 4 + i) * size + size - 4 + j];
                rows[2 * e + i][width + j - i] += schur;
            }
        }
    }
    let degree = if size == 0 { 1 } else { size / 2 - 1 };
    let places = discrete.fixed().iter();
    let held: Vec<usize> = places.map(|&k| 2 * (k / 2 / degree) + k % 2).collect();
    // fixed rows and columns are those of the unit matrix: a negative pivot of the size of the others, whatever their unit
    held.iter().for_each(|&held| rows[held][width] = 0.0);
    let unit = largest(rows.iter().flatten());
    held.iter().for_each(|&held| rows[held][width] = -unit);
    Some(count + eliminate(&mut rows, width)?)
}

/// Eliminates the first `inner` rows and columns of a symmetric matrix, with the largest remaining diagonal entry as pivot; the Schur
/// complement overwrites the rest. Returns the number of positive pivots.
fn condense(a: &mut [f64], size: usize, inner: usize) -> Option<usize> {
    let largest = largest(&a[..inner * size]);
    let mut left: Vec<usize> = (0..inner).collect();
    let mut factors = vec![0.0; size];
    let mut count = 0;
    while !left.is_empty() {
        let diagonal = |&k: &usize| a[k * size + k].abs();
        let best =
            (0..left.len()).max_by(|&i, &j| diagonal(&left[i]).total_cmp(&diagonal(&left[j])));
        let k = left.swap_remove(best?);
        let pivot = a[k * size + k];
        if !usable(pivot, largest) {
            return None;
        }
        count += usize::from(pivot > 0.0);
        let rows = || left.iter().copied().chain(inner..size);
        for i in rows() {
            factors[i] = a[i * size + k] / pivot;
            if factors[i].abs() > MOST_GROWTH {
                return None;
            }
        }
        for i in rows() {
            for j in rows() {
                a[i * size + j] -= factors[i] * a[k * size + j];
            }
        }
    }
    Some(count)
}

/// Factors a symmetric band matrix, given by its lower half, as L D L'; returns the number of positive entries of D.
fn eliminate(rows: &mut [Vec<f64>], width: usize) -> Option<usize> {
    let largest = largest(rows.iter().flatten());
    let mut count = 0;
    for k in 0..rows.len() {
        let (done, below) = rows.split_at_mut(k + 1);
        let pivot = done[k][width];
        if !usable(pivot, largest) {
            return None;
        }
        count += usize::from(pivot > 0.0);
        let reach = width.min(below.len());
        let column: Vec<f64> = (0..reach).map(|i| below[i][width - 1 - i]).collect();
        for (i, row) in below.iter_mut().take(reach).enumerate() {
            let factor = column[i] / pivot;
            if factor.abs() > MOST_GROWTH {
                return None;
            }
            for (j, value) in column[..=i].iter().enumerate() {
                row[width + j - i] -= factor * value;
            }
        }
    }
    Some(count)
}

fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |m, v| m.max(v.abs()))
}

fn usable(pivot: f64, largest: f64) -> bool {
    pivot.abs() > LEAST_PIVOT * largest && pivot.is_finite()
}
