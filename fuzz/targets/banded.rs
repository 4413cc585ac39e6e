//! A banded matrix (size, lower and upper bandwidth, entries) and a right-hand side: the residual of a solution is a rounding error.
#![no_main]

use fuzz::numbers;
use libfuzzer_sys::fuzz_target;
use membrane_newton::{BandMatrix, BandedLu};

fuzz_target!(|text: &str| {
    let Some(numbers) = numbers(text) else { return };
    let Some((sizes, mut entries)) = numbers.split_first_chunk::<3>() else {
        return;
    };
    let [n, lower, upper] = sizes.map(|size| size.abs() as usize % 13);
    let Ok(mut matrix) = BandMatrix::zeros(n, lower, upper) else {
        return;
    };
    let mut next = || entries.split_off_first().copied().unwrap_or(0.0);
    let mut largest = 0.0_f64;
    for i in 0..n {
        for j in i.saturating_sub(lower)..(i + upper + 1).min(n) {
            let entry = next();
            largest = largest.max(entry.abs());
            matrix.add(i, j, entry).expect("within the band");
        }
    }
    let b: Vec<f64> = (0..n).map(|_| next()).collect();
    let (mut lu, mut x, mut product) = (BandedLu::for_matrix(&matrix), b.clone(), vec![0.0; n]);
    if lu.factor(&matrix).is_err() {
        return;
    }
    lu.solve_into(&mut x).expect("a factorisation");
    if x.iter().all(|x| x.is_finite()) {
        matrix.mul_into(&x, &mut product);
        let size = |v: &[f64]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let scale = n as f64 * largest * size(&x) + size(&b);
        // Elimination with partial pivoting: the entries grow by 2^11 at most.
        for (product, b) in product.iter().zip(&b) {
            assert!(
                (product - b).abs() <= 1e-10 * scale,
                "{product} {b} of {scale}"
            );
        }
    }
});
