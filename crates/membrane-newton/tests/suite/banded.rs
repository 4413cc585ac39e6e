//! Factors of band matrices.

use membrane_newton::{BandMatrix, BandedLu, Border, NewtonError};
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

/// [[0.3, 0.7], [0.9, 2.1 + e]] has a determinant of 0.3 e and a condition number below 20 / e. Within a border that makes the system regular, x loses
/// as many digits, y none.
#[test]
fn a_nearly_singular_matrix_costs_the_accuracy_of_x_alone() {
    let (column, row, corner) = ([0.2, 0.9], [1.1, -0.4], 0.5);
    let (exact, y) = ([1.0, -2.0], 3.0);
    for e in [1e-3, 1e-6, 1e-9, 1e-12] {
        let entries = [[0.3, 0.7], [0.9, 2.1 + e]];
        let mut a = BandMatrix::zeros(2, 1, 1).unwrap();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            a.add(i, j, entries[i][j]).unwrap();
        }
        let mut lu = BandedLu::for_matrix(&a);
        lu.factor(&a).unwrap();
        let mut border = Border::new(2);
        let (b, g) = border.column_and_row_mut();
        b.copy_from_slice(&column);
        g.copy_from_slice(&row);
        border.eliminate(corner, |x| lu.solve_into(x)).unwrap();
        let dot = |a: [f64; 2]| a[0] * exact[0] + a[1] * exact[1];
        let mut x = [0, 1].map(|i| dot(entries[i]) + column[i] * y);
        lu.solve_into(&mut x).unwrap();
        let found = border.correct(&mut x, dot(row) + corner * y).unwrap();
        let error = (x[0] - exact[0]).abs().max((x[1] - exact[1]).abs());
        // epsilon times the condition number
        assert!(error <= 20.0 / e * f64::EPSILON, "{e:e}: {error:e}");
        // some ten operations
        assert!((found - y).abs() < 1e-14, "{e:e}: {found}");
    }
}

/// Rows 1 to 3 of tenths are linearly dependent; the last pivot is their rounding.
#[test]
fn a_singular_matrix_may_be_factored() {
    let mut a = BandMatrix::zeros(3, 2, 2).unwrap();
    for k in 0..9 {
        a.add(k / 3, k % 3, (k + 1) as f64 * 0.1).unwrap();
    }
    BandedLu::for_matrix(&a).factor(&a).unwrap();
}

/// The error names the row whose pivot has no finite reciprocal, not a later one.
#[test]
fn a_denormal_pivot_is_an_error_of_its_row() {
    for small in [1e-310, 5e-324, 0.0] {
        let mut a = BandMatrix::zeros(3, 1, 1).unwrap();
        for (i, entry) in [1.0, small, 1.0].into_iter().enumerate() {
            a.add(i, i, entry).unwrap();
        }
        let expected = Err(NewtonError::Singular {
            row: 1,
            pivot: small,
        });
        assert_eq!(BandedLu::for_matrix(&a).factor(&a), expected);
    }
}
