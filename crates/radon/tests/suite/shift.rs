//! Shifts of views along bins and rows.

use radon::{RadonError, add_shifted};

/// Linear interpolation is exact for a linear view, and samples beyond its edges are zero.
#[test]
fn a_linear_view_is_shifted_by_any_fraction_and_added_with_its_weight() {
    let (bins, rows) = (9, 7);
    let linear = |b: f64, r: f64| 2.0 + 0.5 * b - 0.3 * r;
    let place = |k: usize| ((k % bins) as f64, (k / bins) as f64);
    let view: Vec<f64> = (0..bins * rows)
        .map(|k| linear(place(k).0, place(k).1))
        .collect();
    for shift in [
        [0.0, 0.0],
        [1.5, 0.25],
        [-2.25, 1.0],
        [3.0, -1.6],
        [-0.1, -2.9],
        [0.7, 3.5],
    ] {
        let mut sum = vec![10.0; view.len()];
        add_shifted(&view, [bins, rows], shift, 0.5, &mut sum).unwrap();
        for (k, found) in sum.iter().enumerate() {
            let (b, r) = (place(k).0 + shift[0], place(k).1 + shift[1]);
            let within = |x: f64, n: usize| x >= 0.0 && x <= (n - 1) as f64;
            let beyond = |x: f64, n: usize| x <= -1.0 || x >= n as f64;
            // Between the last sample and the zero beyond the edge lies a part of that sample.
            if within(b, bins) && within(r, rows) {
                let expected = 10.0 + 0.5 * linear(b, r);
                assert!((found - expected).abs() < 1e-14, "{shift:?} {k}: {found}");
            } else if beyond(b, bins) || beyond(r, rows) {
                assert_eq!(*found, 10.0, "{shift:?} {k}");
            }
        }
    }
}

#[test]
fn lengths_of_shifted_views_are_reported_as_given_and_expected() {
    let shift = |view: &[f64], n_sum| {
        let mut sum = vec![0.0; n_sum];
        add_shifted(view, [2, 2], [0.0; 2], 1.0, &mut sum).unwrap_err()
    };
    for error in [shift(&[0.0; 3], 4), shift(&[0.0; 4], 3)] {
        let (given, expected) = (3, 4);
        assert!(
            matches!(error, RadonError::WrongLength { given: g, expected: e, .. } if (g, e) == (given, expected))
        );
    }
}
