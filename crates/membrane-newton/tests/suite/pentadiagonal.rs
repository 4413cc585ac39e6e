//! The symmetric matrix of a chain of springs.

use membrane_newton::{NewtonError, PentadiagonalLdl};

/// The matrix times the solution equals the right-hand side.
#[test]
fn solves_any_number_of_rows() {
    // diagonally dominant
    let entry = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 3.0 + (i as f64).sin(),
        1 => (0.7 * (i + j) as f64).cos(),
        2 => 0.4 * (0.3 * (i + j) as f64).sin(),
        _ => 0.0,
    };
    for n in [1, 2, 3, 4, 5, 40] {
        let mut ldl = PentadiagonalLdl::new(n);
        let b: Vec<[f64; 2]> = (0..n).map(|i| [(i as f64 * 0.9).cos(), i as f64]).collect();
        let mut x = b.clone();
        assert_eq!(ldl.solve_into(&mut x), Err(NewtonError::NotFactored));
        ldl.factor(entry).unwrap();
        ldl.solve_into(&mut x).unwrap();
        for i in 0..n {
            for k in 0..2 {
                let product: f64 = (0..n).map(|j| entry(i, j) * x[j][k]).sum();
                // rounding of terms of the size of b, at most 39
                assert!(
                    (product - b[i][k]).abs() < 1e-13,
                    "{n} rows: {product}, {b:?}"
                );
            }
        }
        let refused = ldl.factor(|i, j| entry(i, j) - if i == j { 9.0 } else { 0.0 });
        assert!(matches!(refused, Err(NewtonError::Singular { row: 0, .. })));
        assert_eq!(ldl.solve_into(&mut x), Err(NewtonError::NotFactored));
    }
}
