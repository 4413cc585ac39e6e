//! The stated standard error against the true error.

use crate::support::{Ball, BallSource, CHEST, LEHR, Point, camera, photopeak};
use photon_scatter::{Camera, Response, Scatter, ScatterError, ScatterOptions, View};

fn chest(options: &ScatterOptions) -> Result<Scatter, ScatterError> {
    let source = BallSource([5.0, 5.0, 0.0], 3.0, 1.0);
    Scatter::new(
        &source,
        &CHEST,
        &camera(16, 2.0, &[-45.0, 60.0]),
        &photopeak(),
        options,
    )
}

#[test]
fn the_true_error_is_within_two_standard_errors() {
    // The largest primary sample is near 2.
    let reference = chest(&ScatterOptions::new(0.003).with_seed(1000)).unwrap();
    let (mut inside, mut all) = (0, 0);
    for seed in 0..8 {
        let scatter = chest(&ScatterOptions::new(0.04).with_block(64).with_seed(seed)).unwrap();
        assert!(scatter.report().largest_standard_error <= 0.04);
        let ratio = reference.report().histories / scatter.report().histories;
        assert!(ratio >= 100, "{ratio}");
        for view in 0..2 {
            let (samples, errors) = (scatter.view(0, view), scatter.standard_error(0, view));
            for ((sample, error), exact) in samples.iter().zip(errors).zip(reference.view(0, view))
            {
                inside += usize::from((sample - exact).abs() <= 2.0 * error);
                all += 1;
            }
        }
    }
    assert!(inside * 100 >= all * 95, "{inside} of {all}");
}

/// Sums over a view and over all views by order: their spread over seeds is the standard error, and errors of repeated runs average out.
#[test]
fn standard_errors_of_sums_are_their_spread() {
    let seeds = 40;
    let runs: Vec<Scatter> = (0..seeds)
        .map(|seed| chest(&ScatterOptions::new(0.15).with_block(16).with_seed(seed)).unwrap())
        .collect();
    let samples: f64 = runs[0].view(0, 1).iter().sum::<f64>() * 4.0;
    assert!((runs[0].sum(0, 1)[0] / samples - 1.0).abs() < 0.02);
    let values: [fn(&Scatter) -> [f64; 2]; 4] = [
        |run| run.sum(0, 0),
        |run| run.sum(0, 1),
        |run| [run.report().by_order[0], run.report().by_order_error[0]],
        |run| [run.report().by_order[1], run.report().by_order_error[1]],
    ];
    for value in values {
        let all: Vec<[f64; 2]> = runs.iter().map(value).collect();
        let n = seeds as f64;
        let mean = all.iter().map(|[sum, _]| sum).sum::<f64>() / n;
        let spread = all.iter().map(|[sum, _]| (sum - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let stated = all.iter().map(|[_, error]| error * error).sum::<f64>() / n;
        // The relative standard deviation of a variance of 40 values is sqrt(2 / 39), 0.23.
        let ratio = spread / stated;
        println!("{mean} {} {ratio}", stated.sqrt());
        assert!((0.4..1.8).contains(&ratio), "{mean}: {ratio}");
        assert!(stated.sqrt() < 0.1 * mean);
    }
}

/// A tolerance relative to the scatter applies where it is larger than the absolute one.
#[test]
fn the_larger_tolerance_applies() {
    let run =
        |absolute, relative| chest(&ScatterOptions::new(absolute).with_relative(relative)).unwrap();
    let relative = run(1e-6, 0.1);
    let most = (0..2).flat_map(|view| relative.view(0, view));
    let most = most.fold(0.0, f64::max);
    let error = relative.report().largest_standard_error;
    assert!(error <= 0.1 * most && error > 0.02 * most, "{error} {most}");
    assert_eq!(
        run(0.0, 0.1).report().largest_standard_error,
        relative.report().largest_standard_error
    );
    let absolute = run(0.1, 1e-3);
    assert_eq!(
        absolute.report().largest_standard_error,
        run(0.1, 0.0).report().largest_standard_error
    );
    for wrong in [-0.1, f64::NAN, 1.5] {
        let refused = chest(&ScatterOptions::new(0.0).with_relative(wrong)).unwrap_err();
        assert!(
            refused.to_string().starts_with("relative tolerance"),
            "{refused}"
        );
    }
}

/// Against nodes and views that are closer, a source whose outline is sharp; with coarse ones the interpolation is the larger error.
#[test]
fn interpolation_errors_bound_the_difference_from_finer_nodes_and_views() {
    let degrees: Vec<f64> = (0..60).map(|k| 6.0 * f64::from(k)).collect();
    let run = |pitch, spacing: f64, tolerance| {
        let options = ScatterOptions::new(tolerance)
            .with_pitch(pitch)
            .with_spacing(spacing.to_radians())
            .with_seed(pitch.to_bits());
        let source = BallSource([9.0, 2.0, 0.0], 3.0, 1.0);
        let camera = camera(12, 2.5, &degrees);
        Scatter::new(&source, &CHEST, &camera, &photopeak(), &options).unwrap()
    };
    let exact = run(0.6, 0.0, 0.03);
    for (pitch, spacing, coarse) in [(0.75, 12.0, false), (3.0, 36.0, true)] {
        let found = run(pitch, spacing, 0.015);
        let views = (0..degrees.len()).flat_map(|view| {
            let off = found.view(0, view).into_iter().zip(exact.view(0, view));
            off.map(|(found, exact)| (found - exact).abs())
                .collect::<Vec<_>>()
        });
        let off = views.fold(0.0, f64::max);
        // With a probability of 94 % none of 8640 normal errors exceeds 4.5 standard errors; most bins have smaller ones.
        let random = 4.5
            * found
                .report()
                .largest_standard_error
                .hypot(exact.report().largest_standard_error);
        println!(
            "{pitch} {spacing}: {off}, {random} + {}",
            found.report().interpolation_error
        );
        assert!(off <= random + found.report().interpolation_error);
        assert!(!coarse || off > random);
    }
}

#[test]
fn too_few_histories_are_an_error_with_the_work_done() {
    let options = ScatterOptions::new(1e-6)
        .with_block(16)
        .with_most_histories(3000);
    let Err(ScatterError::Tolerance {
        asked,
        reached,
        report,
        ..
    }) = chest(&options)
    else {
        panic!("no error");
    };
    assert!(asked == 1e-6 && reached > 1e-3 && (2048..=3000).contains(&report.histories));
}

/// A point 2 cm below the surface of a ball of water: the peak of its scatter is narrower than the nodes.
#[test]
fn interpolation_errors_cover_scatter_that_the_nodes_do_not_resolve() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 10.0,
        density: 1.0,
    };
    let view = View {
        angle: 0.0,
        radius: 12.0,
    };
    let camera = Camera::new([41; 2], [0.5; 2], &[view], LEHR).unwrap();
    let point = Point([0.2, 8.0, 0.2], 1.0);
    let run = |pitch, tolerance| {
        let options = ScatterOptions::new(tolerance)
            .with_pitch(pitch)
            .with_seed(3);
        Scatter::new(&point, &ball, &camera, &photopeak(), &options).unwrap()
    };
    let exact = run(0.2, 2e-4);
    for pitch in [0.4, 0.75, 1.5, 2.5] {
        let found = run(pitch, 1e-4);
        let pairs = found.view(0, 0).into_iter().zip(exact.view(0, 0));
        let off = pairs.map(|(found, exact)| (found - exact).abs());
        let off = off.fold(0.0, f64::max);
        let (stated, report) = (found.largest_error(), found.report());
        assert!(off < stated, "{pitch}: {off} > {stated}");
        println!("{pitch}: {off} of {stated}");
        // Not larger without limit.
        assert!(stated < 20.0 * off, "{pitch}: {off} {stated}");
        let parts = 4.0 * report.largest_standard_error + report.interpolation_error;
        assert_eq!(stated, parts);
        assert!(off > 20.0 * report.largest_standard_error);
    }
}

/// A point far from the axis, whose peak moves by more than its width from one of the detected views to the next.
#[test]
fn interpolation_errors_cover_peaks_that_move_between_views() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 10.0,
        density: 1.0,
    };
    let angles = (0..60).map(|k| (6.0 * f64::from(k)).to_radians());
    let views: Vec<View> = angles
        .map(|angle| View {
            angle,
            radius: 12.0,
        })
        .collect();
    let camera = Camera::new([21; 2], [1.0; 2], &views, LEHR).unwrap();
    let point = Point([0.0, 8.0, 0.0], 1.0);
    let run = |spacing: f64| {
        let options = ScatterOptions::new(1e-3)
            .with_pitch(0.75)
            .with_spacing(spacing.to_radians());
        Scatter::new(&point, &ball, &camera, &photopeak(), &options).unwrap()
    };
    let (found, exact) = (run(12.0), run(0.0));
    let samples = |scatter: &Scatter| -> Vec<f64> {
        (0..60).flat_map(|view| scatter.view(0, view)).collect()
    };
    let (a, b) = (samples(&found), samples(&exact));
    let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    let off = off.fold(0.0, f64::max);
    let stated = found.largest_error();
    println!("{off} {stated} {}", exact.largest_error());
    assert!(off < stated && stated < 10.0 * off, "{off} {stated}");
}

/// Absolute tolerances that the activity makes too small, and sources from which few photons meet the medium, fail after the first blocks.
#[test]
fn limits_of_histories_that_cannot_be_met_are_found_at_once() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 8.0,
        density: 1.0,
    };
    let relative = ScatterOptions::new(0.0).with_relative(0.02);
    for (x, activity, options) in [
        (0.0, 1e6, ScatterOptions::new(0.01)),
        (100.0, 1.0, relative),
    ] {
        let camera = camera(8, 4.0, &[0.0]);
        let point = Point([x, 0.0, 0.0], activity);
        let found = Scatter::new(&point, &ball, &camera, &photopeak(), &options);
        let Err(ScatterError::Tolerance {
            expected, report, ..
        }) = found
        else {
            panic!("{found:?}");
        };
        assert!(
            expected > 2e8 && report.histories < 10_000_000,
            "{expected}"
        );
    }
}

/// The peak of an ideal response is unbounded: no pitch resolves it.
#[test]
fn peaks_that_no_pitch_resolves_are_errors() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 2.0,
        density: 1.0,
    };
    let view = View {
        angle: 0.0,
        radius: 3.0,
    };
    let camera = Camera::new([2; 2], [0.5; 2], &[view], Response::default()).unwrap();
    let options = ScatterOptions::new(0.0).with_relative(0.1);
    let point = Point([0.0; 3], 1.0);
    let found = Scatter::new(&point, &ball, &camera, &photopeak(), &options);
    let Err(ScatterError::Interpolation {
        asked,
        reached,
        pitch,
    }) = found
    else {
        panic!("{found:?}");
    };
    assert!(reached > asked && pitch < 0.1, "{reached} {asked} {pitch}");
}
