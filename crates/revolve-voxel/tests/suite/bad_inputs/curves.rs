//! Rejected curves: closed ones, smooth pieces and functions.

use super::*;

#[test]
fn the_upper_half_of_a_full_curve() {
    // With and without a node at the apex, which is then interpolated.
    let with = Meridian::from_full_curve(&[[0.0, 1.0], [2.0, 0.0], [0.0, -1.0]]).unwrap();
    let without =
        Meridian::from_full_curve(&[[0.0, 1.0], [2.0, 0.5], [2.0, -0.5], [0.0, -1.0]]).unwrap();
    assert_eq!(with, Meridian::new(&[[0.0, 1.0], [2.0, 0.0]]).unwrap());
    assert_eq!(
        without,
        Meridian::new(&[[0.0, 1.0], [2.0, 0.5], [2.0, 0.0]]).unwrap()
    );
}

#[test]
fn smooth_pieces() {
    let line = |x0: f64, x1: f64| Piece::Power {
        x: vec![x0, x1 - x0],
        r: vec![1.0],
    };
    assert!(matches!(
        Meridian::smooth(&[], 1e-3),
        Err(RevolveError::TooFew { .. })
    ));
    assert!(matches!(
        Meridian::smooth(&[line(0.0, 1.0)], 0.0),
        Err(RevolveError::NotPositive { .. })
    ));
    assert!(matches!(
        Meridian::smooth(&[line(0.0, f64::NAN)], 1e-3),
        Err(RevolveError::NotFinite { .. })
    ));
    let gap = Meridian::smooth(&[line(0.0, 1.0), line(1.5, 2.0)], 1e-3);
    assert!(
        matches!(gap, Err(RevolveError::Gap { piece: 1, gap, .. }) if (gap - 0.5).abs() < 1e-12)
    );
    let dips = Piece::Power {
        x: vec![0.0, 1.0],
        r: vec![0.5, -2.0, 2.0],
    };
    assert!(Meridian::smooth(&[dips], 1e-3).is_ok());
    let below = Piece::Power {
        x: vec![0.0, 1.0],
        r: vec![0.3, -2.0, 2.0],
    };
    assert!(matches!(
        Meridian::smooth(&[below], 1e-3),
        Err(RevolveError::NegativeRadius { .. })
    ));
    let round = Piece::Chebyshev {
        x: vec![0.0, 1.0],
        r: vec![0.5, 0.0, -0.5],
    };
    assert!(matches!(
        Meridian::smooth(&[round], 1e-18),
        Err(RevolveError::TooFine { .. })
    ));
}

/// Straight lines are one segment; the end of a cylinder is closed by another one on either side.
#[test]
fn straight_lines_of_functions_are_one_segment() {
    let made = |curve: fn(f64) -> [f64; 2], breakpoints: &[f64]| {
        Meridian::from_function(curve, breakpoints, 1e-6).unwrap()
    };
    let cylinder = made(|s| [6.0 * s, 2.0], &[0.3]);
    assert_eq!(cylinder, Meridian::new(&[[0.0, 2.0], [6.0, 2.0]]).unwrap());
    let pencil = |s: f64| match s < 0.5 {
        true => [6.0 * s, 2.0],
        false => [3.0 + 8.0 * (s - 0.5), 4.0 * (1.0 - s)],
    };
    assert_eq!(made(pencil, &[0.5]).n_segments(), 3);
    // Forward and back along a line is not merged, but rejected.
    let back = Meridian::from_function(|s| [1.0 - (s - 0.5).abs(), 2.0], &[0.5], 1e-6);
    assert!(back.is_err());
}

#[test]
fn functions() {
    let cone = |s: f64| [s, 1.0 - s];
    for breakpoints in [&[0.5, 0.5][..], &[0.6, 0.4], &[0.0], &[1.0], &[-0.1]] {
        let made = Meridian::from_function(cone, breakpoints, 1e-3);
        assert!(matches!(made, Err(RevolveError::NotPositive { .. })));
    }
    for (breakpoints, tolerance) in [(&[f64::NAN][..], 1e-3), (&[], f64::INFINITY)] {
        let made = Meridian::from_function(cone, breakpoints, tolerance);
        assert!(matches!(made, Err(RevolveError::NotFinite { .. })));
    }
    assert!(matches!(
        Meridian::from_function(cone, &[], 0.0),
        Err(RevolveError::NotPositive { .. })
    ));
    // Not finite at an end, inside, everywhere; the error contains the parameter.
    for at in [0.0, 0.25, 1.0] {
        let curve = |s: f64| [s, if s == at { f64::NAN } else { 1.0 }];
        assert!(matches!(
            Meridian::from_function(curve, &[], 1e-3),
            Err(RevolveError::NotFiniteAt { s, x, .. }) if s == at && x == at
        ));
    }
    assert!(matches!(
        Meridian::from_function(|s| [s, 0.5 - s], &[], 1e-3),
        Err(RevolveError::NegativeRadius { .. })
    ));
    assert!(matches!(
        Meridian::from_function(|s| [s, (1000.0 * s).sin().abs()], &[], 1e-18),
        Err(RevolveError::TooFine { .. })
    ));
}

#[test]
fn a_later_segment_that_crosses_the_first_one() {
    // The first segment is a disc at x = 0; the last but one, and the last, pass through it.
    for (path, second) in [
        (
            &[
                [0.0, 0.0],
                [0.0, 3.0],
                [2.0, 3.0],
                [2.0, 1.0],
                [-1.0, 1.0],
                [-1.0, 0.0],
            ][..],
            3,
        ),
        (
            &[[0.0, 0.0], [0.0, 3.0], [2.0, 3.0], [2.0, 1.0], [-1.0, 1.0]],
            3,
        ),
    ] {
        let crossing = Meridian::new(path);
        assert!(
            matches!(crossing, Err(RevolveError::SelfCrossing { first: 0, second: found }) if found == second),
            "{crossing:?}"
        );
    }
}
