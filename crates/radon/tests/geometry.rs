//! Conventions: centres, inverse maps, view weights.

use std::f64::consts::PI;

use radon::{ArcPolicy, ImageGrid, ParallelGeometry, StackOrder};

fn weights(angles: &[f64], policy: ArcPolicy) -> Vec<f64> {
    ParallelGeometry::new(angles, 4, 1.0)
        .unwrap()
        .view_weights(policy)
        .unwrap()
}

#[test]
fn centres_of_bins_and_pixels_are_symmetric_about_the_middle_for_even_and_odd_counts() {
    for n in [1, 2, 7, 8] {
        let geometry = ParallelGeometry::new([0.0], n, 0.5)
            .unwrap()
            .with_offset(0.1)
            .unwrap();
        let sum: f64 = (0..n).map(|k| geometry.bin_centre(k)).sum();
        assert!((sum / n as f64 - 0.1).abs() < 1e-15);
        assert!((0..n).all(|k| (geometry.bin_at(geometry.bin_centre(k)) - k as f64).abs() < 1e-12));
        let grid = ImageGrid::new(n, n + 1, 0.5)
            .unwrap()
            .with_centre([0.3, -0.7])
            .unwrap();
        let (first, last) = (grid.pixel_centre(0, 0), grid.pixel_centre(n - 1, n));
        assert!(
            (first[0] + last[0] - 0.6).abs() < 1e-15 && (first[1] + last[1] + 1.4).abs() < 1e-15
        );
    }
}

#[test]
fn the_rotation_bin_lies_on_the_axis() {
    for bin in [-3.0, 0.0, 3.25, 11.5] {
        let geometry = ParallelGeometry::new([0.0], 8, 0.3)
            .unwrap()
            .with_rotation_bin(bin)
            .unwrap();
        assert!((geometry.bin_at(0.0) - bin).abs() < 1e-12);
    }
}

#[test]
fn uniform_half_and_full_turns_weigh_equally_whatever_the_parity() {
    for n in [1, 2, 3, 90, 91] {
        for arc in [PI, 2.0 * PI] {
            let geometry = ParallelGeometry::uniform(n, arc, 4, 1.0).unwrap();
            for w in geometry.view_weights(ArcPolicy::Complete).unwrap() {
                assert!(
                    (w - PI / n as f64).abs() < 1e-12,
                    "{n} views over {arc}: {w}"
                );
            }
        }
    }
}

#[test]
fn weights_integrate_the_functions_that_the_trapezoidal_rule_does() {
    // cos(2 theta) has the period pi of directions; on irregular nodes the error is the rule's, h^2 f''/12 * pi with the
    // largest gap h = 0.11.
    let angles: Vec<f64> = (0..90)
        .map(|k| k as f64 * PI / 90.0 + 0.035 * (k as f64 * 1.7).sin() + 5.0)
        .collect();
    let w = weights(&angles, ArcPolicy::Complete);
    assert!((w.iter().sum::<f64>() - PI).abs() < 1e-12);
    let integral: f64 = angles
        .iter()
        .zip(&w)
        .map(|(a, w)| (2.0 * a).cos() * w)
        .sum();
    assert!(
        integral.abs() < PI * 0.11_f64.powi(2) * 4.0 / 12.0,
        "{integral}"
    );
}

#[test]
fn repeated_and_opposite_views_share_one_weight() {
    let plain = weights(&[0.1, 0.9, 1.7, 2.4], ArcPolicy::Complete);
    let repeated = weights(
        &[0.1, 0.9, 1.7, 2.4, 0.9, 0.9 + PI, 0.1 - PI],
        ArcPolicy::Complete,
    );
    for (view, share) in [(0, 2.0), (1, 3.0), (2, 1.0), (3, 1.0)] {
        assert!((repeated[view] - plain[view] / share).abs() < 1e-12);
    }
    assert!((repeated.iter().sum::<f64>() - PI).abs() < 1e-12);
}

#[test]
fn short_arcs_follow_their_policy() {
    let angles: Vec<f64> = (0..60).map(|k| k as f64 * 0.03).collect(); // 1.77 rad between the ends
    let arc = 60.0 * 0.03;
    let [extend, truncate, rescale] = [ArcPolicy::Extend, ArcPolicy::Truncate, ArcPolicy::Rescale]
        .map(|policy| weights(&angles, policy));
    assert!((extend.iter().sum::<f64>() - PI).abs() < 1e-12 && extend[0] > 10.0 * extend[1]);
    assert!((truncate.iter().sum::<f64>() - arc).abs() < 1e-12);
    assert!(truncate.iter().all(|w| (w - 0.03).abs() < 1e-12));
    assert!((rescale.iter().sum::<f64>() - PI).abs() < 1e-12);
    assert!(rescale.iter().all(|w| (w - PI / 60.0).abs() < 1e-12));
}

#[test]
fn a_golden_angle_series_counts_as_complete() {
    let golden = PI * (3.0 - 5.0_f64.sqrt()) / 2.0;
    for n in 1..200 {
        let angles: Vec<f64> = (0..n).map(|k| k as f64 * golden).collect();
        assert!((weights(&angles, ArcPolicy::Complete).iter().sum::<f64>() - PI).abs() < 1e-11);
    }
}

#[test]
fn stack_orders_index_what_they_say() {
    // 3 views, 5 slices, 7 bins.
    assert_eq!(
        StackOrder::ViewSliceBin.row_start(2, 4, 3, 5, 7),
        Some((2 * 5 + 4) * 7)
    );
    assert_eq!(
        StackOrder::SliceViewBin.row_start(2, 4, 3, 5, 7),
        Some((4 * 3 + 2) * 7)
    );
}
