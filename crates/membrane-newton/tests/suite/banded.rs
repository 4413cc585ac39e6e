//! Factors of band matrices.

use membrane_newton::{BandMatrix, BandedLu};
use nalgebra::{DMatrix, DVector};

/// A x for x = A^-1 b, with pivoting (weak diagonal) and without, at every small size.
#[test]
fn solves_equal_a_dense_lu() {
    for (lower, upper) in [(3, 3), (4, 4), (1, 2), (2, 1)] {
        for n in 1..40usize {
            for diagonal in [0.1, 10.0] {
                let entry = |i: usize, j: usize| ((7 * i + 3 * j) as f64 * 1.7).sin();
                let mut band = BandMatrix::zeros(n, lower, upper).unwrap();
                let mut dense = DMatrix::zeros(n, n);
                for i in 0..n {
                    for j in i.saturating_sub(lower)..(i + upper + 1).min(n) {
                        let value = entry(i, j) + if i == j { diagonal } else { 0.0 };
                        band.add(i, j, value).unwrap();
                        dense[(i, j)] = value;
                    }
                }
                let b = DVector::from_fn(n, |i, _| (i as f64 * 0.9).cos());
                let mut out = vec![0.0; n];
                band.mul_into(b.as_slice(), &mut out);
                let product = &dense * &b;
                assert!((DVector::from_vec(out) - product).amax() < 1e-13);
                let mut lu = BandedLu::for_matrix(&band);
                lu.factor(&band).unwrap();
                assert_eq!(lu.determinant_sign(), dense.determinant().signum());
                let mut x = b.as_slice().to_vec();
                lu.solve_into(&mut x).unwrap();
                // backward stable: the residual is rounding of the size of x
                let size = x.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
                let residual = (dense * DVector::from_vec(x) - b).amax();
                assert!(
                    residual < 1e-12 * size,
                    "n {n}, {lower}, {upper}: {residual:e}"
                );
            }
        }
    }
}
