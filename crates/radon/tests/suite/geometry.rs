//! Conventions: centres, inverse maps, view weights.

use std::f64::consts::PI;

use radon::{ArcPolicy, ImageGrid, ParallelGeometry, RadonError, SliceAxis};

fn weights(angles: &[f64], policy: ArcPolicy) -> Vec<f64> {
    ParallelGeometry::from_radians(angles, 4, 1.0)
        .unwrap()
        .view_weights(policy)
        .unwrap()
}

#[test]
fn centres_of_bins_pixels_and_slices_are_symmetric_about_the_middle_for_even_and_odd_counts() {
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
        let slices = SliceAxis::new(n, 0.5).unwrap().with_centre(0.3).unwrap();
        let ends = slices.slice_centre(0) + slices.slice_centre(n - 1);
        assert_eq!(
            (slices.n_slices(), slices.spacing(), slices.centre()),
            (n, 0.5, 0.3)
        );
        assert!((ends - 0.6).abs() < 1e-15);
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
fn uniform_half_and_full_turns_have_equal_weights_for_any_parity() {
    for n in [1, 2, 3, 90, 91] {
        for turn in [ParallelGeometry::half_turn, ParallelGeometry::full_turn] {
            let geometry = turn(n, 4, 1.0).unwrap();
            for w in geometry.view_weights(ArcPolicy::Complete).unwrap() {
                assert!((w - PI / n as f64).abs() < 1e-12, "{geometry:?}: {w}");
            }
        }
    }
}

#[test]
fn each_constructor_has_the_unit_of_its_name() {
    let same = |a: &ParallelGeometry, b: &ParallelGeometry| {
        let angles = a.angles().iter().zip(b.angles());
        assert_eq!((a.n_views(), a.n_bins(), a.pitch()), (7, 4, 0.5));
        // Rounding of angles up to two turns.
        assert!({ angles }.all(|(a, b)| (a - b).abs() < 4e-15));
    };
    let listed = |arc: f64| {
        let angles: Vec<f64> = (0..7).map(|k| f64::from(k) * arc / 7.0).collect();
        ParallelGeometry::new(angles, 4, 0.5).unwrap()
    };
    same(
        &ParallelGeometry::half_turn(7, 4, 0.5).unwrap(),
        &listed(PI),
    );
    same(
        &ParallelGeometry::full_turn(7, 4, 0.5).unwrap(),
        &listed(2.0 * PI),
    );
    for turns in [0.01, 0.3, 1.0, 1.5, 2.0] {
        let arc = 2.0 * PI * turns;
        let radians = ParallelGeometry::arc_radians(7, arc, 4, 0.5).unwrap();
        same(&radians, &listed(arc));
        let angles: Vec<f64> = radians.angles().iter().map(|a| a.to_degrees()).collect();
        same(
            &ParallelGeometry::from_degrees(&angles, 4, 0.5).unwrap(),
            &radians,
        );
    }
}

#[test]
fn degrees_given_as_radians_are_rejected_with_the_reason() {
    // An arc of 180 would be 28.6 turns.
    match ParallelGeometry::arc_radians(60, 180.0, 4, 1.0) {
        Err(error @ RadonError::LongArc { arc, turns, most }) => {
            assert_eq!((arc, most), (180.0, 2.0));
            assert!((turns - 90.0 / PI).abs() < 1e-12);
            assert!(error.to_string().contains("`f64::to_radians`"), "{error}");
        }
        other => panic!("{other:?}"),
    }
    for arc in [4.0 * PI + 1e-9, 90.0, 360.0] {
        let refused = ParallelGeometry::arc_radians(60, arc, 4, 1.0);
        assert!(matches!(refused, Err(RadonError::LongArc { .. })), "{arc}");
    }

    // Lists: a half or a full turn, with or without the last view, in either direction, from any start; a part of a turn; uneven steps.
    let list = |n: i32, step: f64| (0..n).map(|k| 5.0 + f64::from(k) * step).collect();
    let jittered = |k: i32| f64::from(k) * 3.0 + 0.9 * (1.7 * f64::from(k)).sin();
    let lists: Vec<Vec<f64>> = vec![
        list(60, 3.0),
        list(361, 1.0),
        list(7, -30.0),
        list(270, 1.0),
        list(91, 1.5),
        list(45, 2.0 + 1e-8),
        (0..60).map(jittered).collect(),
        vec![0.0, 180.0],
        vec![270.0, 0.0, 90.0, 180.0],
        vec![0.0, 12.6],                  // just above two turns
        (0..12).map(f64::from).collect(), // 1.75 turns
        (0..4).map(|k| f64::from(2 * k)).collect(),
        vec![0.0, 2.5, 5.0, 7.5, 10.0],
        (0..3).map(|k| 5.625 * f64::from(k)).collect(), // 64 views of a turn
        (0..4).map(|k| 90.0 + 2.8125 * f64::from(k)).collect(),
    ];
    for angles in &lists {
        let error = ParallelGeometry::new(angles.clone(), 4, 1.0).unwrap_err();
        let [least, most] = [f64::min, f64::max].map(|f| angles.iter().copied().reduce(f).unwrap());
        let (n_views, arc) = (angles.len(), most - least);
        assert_eq!(error, RadonError::LikeDegrees { n_views, arc });
        assert!(error.to_string().contains("degrees"), "{error}");
        // Constructors that name the unit have no limit.
        let radians = ParallelGeometry::from_radians(angles.clone(), 4, 1.0).unwrap();
        assert_eq!(radians.angles(), angles);
        let degrees = ParallelGeometry::from_degrees(angles, 4, 1.0).unwrap();
        assert!((degrees.angles()[0] - angles[0] * PI / 180.0).abs() < 1e-14);
    }
    // Two turns from any start, however they are computed.
    for start in [0.0, -3.0, 180.0] {
        let angles: Vec<f64> = (0..=720)
            .map(|k| start + f64::from(k).to_radians())
            .collect();
        let geometry = ParallelGeometry::new(angles.clone(), 4, 1.0).unwrap();
        assert_eq!(geometry.angles(), angles);
    }
    ParallelGeometry::new([180.0], 4, 1.0).unwrap();
    // Few views, some of them whole numbers; golden angles.
    ParallelGeometry::new([0.0, 4.0], 4, 1.0).unwrap();
    ParallelGeometry::new([0.0, 1.0, 2.0, 3.0], 4, 1.0).unwrap();
    ParallelGeometry::new([0.0, 1.5, 3.0, 6.0], 4, 1.0).unwrap();
    let golden: Vec<f64> = (0..6).map(|k| 1.941_611 * f64::from(k)).collect();
    ParallelGeometry::new(golden, 4, 1.0).unwrap();
    // Up to a turn in steps of 1/2; two turns in steps of pi / n.
    let halves: Vec<f64> = (0..13).map(|k| 0.5 * f64::from(k)).collect();
    ParallelGeometry::new(halves, 4, 1.0).unwrap();
    for n in 1..=720 {
        let angles: Vec<f64> = (0..4 * n)
            .map(|k| f64::from(k) * PI / f64::from(n))
            .collect();
        ParallelGeometry::new(angles, 4, 1.0).unwrap();
    }

    // An arc in radians as degrees leaves a gap.
    let tiny = ParallelGeometry::arc_radians(90, PI.to_radians(), 64, 0.1).unwrap();
    let refused = tiny.view_weights(ArcPolicy::Complete).unwrap_err();
    assert!(refused.to_string().contains("`arc_radians`"), "{refused}");

    // The error of a gap also states that angles are in radians, if they are large enough to suggest degrees.
    let message = |angles: &[f64]| {
        let geometry = ParallelGeometry::from_radians(angles, 4, 1.0).unwrap();
        let refused = geometry.view_weights(ArcPolicy::Complete).unwrap_err();
        assert!(matches!(refused, RadonError::ShortArc { .. }));
        refused.to_string()
    };
    let degrees = message(&[0.0, 22.0, 44.0, 66.0, 88.0]);
    assert!(degrees.contains("radians and go up to 88"), "{degrees}");
    let radians = message(&[0.0, 0.1, 0.2, 0.3, 12.5]);
    assert!(!radians.contains("degrees"), "{radians}");
}

#[test]
fn weights_have_the_accuracy_of_the_trapezoidal_rule() {
    // cos(2 theta) has the period pi of directions; on irregular nodes the error is that of the rule, h^2 f''/12 * pi with the
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
fn repeated_and_opposite_views_divide_one_weight() {
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
