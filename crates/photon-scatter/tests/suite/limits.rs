//! Rare scatter, the limit of histories, the range of activities, bins and pitches.

use crate::support::{Ball, LEHR, photopeak};
use photon_scatter::ScatterError as Error;
use photon_scatter::{Camera, PointSource, Scatter, ScatterOptions, View};

/// Scatter of a point in or beside a ball of water about the origin.
fn scatter(
    radius: f64,
    (position, activity): ([f64; 3], f64),
    (bins, pitch): (usize, f64),
    options: ScatterOptions,
) -> Result<Scatter, Error> {
    let ball = Ball {
        centre: [0.0; 3],
        radius,
        density: 1.0,
    };
    let view = View {
        angle: 0.0,
        radius: 13.0,
    };
    let camera = Camera::new([bins; 2], [pitch; 2], &[view], LEHR).unwrap();
    let source = PointSource { position, activity };
    Scatter::new(&source, &ball, &camera, &photopeak(), &options)
}

fn relative(tolerance: f64) -> ScatterOptions {
    ScatterOptions::new(0.0).with_relative(tolerance)
}

/// Deposits are single-precision numbers.
#[test]
fn scatter_is_proportional_to_the_activity() {
    let run = |activity| {
        let options = relative(0.1).with_pitch(0.75);
        scatter(10.0, ([0.0; 3], activity), (40, 0.9), options)
    };
    let one = run(1.0).unwrap();
    for activity in [1e-90, 1e-45, 1e-20, 1e36, 1e90] {
        let found = run(activity).unwrap();
        for (a, b) in found.sum(0, 0).into_iter().zip(one.sum(0, 0)) {
            assert!(
                (a / (b * activity) - 1.0).abs() < 1e-5,
                "{activity:e}: {a:e}"
            );
        }
        let (a, b) = (found.report(), one.report());
        assert!((a.by_order[1] / (b.by_order[1] * activity) - 1.0).abs() < 1e-5);
        assert!((found.largest_error() / (one.largest_error() * activity) - 1.0).abs() < 1e-5);
    }
    for activity in [1e-110, 1e110] {
        assert!(matches!(run(activity), Err(Error::OutOfRange { .. })));
    }
}

/// Of the first blocks, of larger ones and of finer nodes.
#[test]
fn the_limit_of_histories_is_not_exceeded() {
    let bins = (40, 0.9);
    for (position, options, limit) in [
        ([0.0; 3], relative(0.02), 2048),
        ([0.0; 3], relative(0.1), 100_000),
        ([0.0; 3], relative(0.1), 150_000),
        ([3.0, 1.0, 0.3], relative(0.05), 1_000_000),
        ([0.0, -300.0, 0.0], relative(0.3), 4_000_000),
    ] {
        let options = options.with_most_histories(limit);
        let found = scatter(10.0, (position, 1.0), bins, options);
        let done = match &found {
            Ok(found) => found.report().histories,
            Err(Error::Tolerance { report, .. }) => report.histories,
            Err(Error::Interpolation { .. }) => limit,
            Err(error) => panic!("{error}"),
        };
        assert!(done <= limit, "{done} > {limit}");
    }
    let least = relative(0.1).with_most_histories(2047);
    let error = scatter(10.0, ([0.0; 3], 1.0), bins, least).unwrap_err();
    assert_eq!(
        error.to_string(),
        "largest number of histories is 2047; it must be at least 2048"
    );
}

/// A ball from which few photons scatter towards the detector. Without a recorded photon the error is unknown, not 0.
#[test]
fn rare_scatter_is_not_zero() {
    let run = |x, radius, options: ScatterOptions| {
        let options = options.with_pitch(0.5);
        scatter(radius, ([x, 0.0, 0.0], 1.0), (40, 0.9), options)
    };
    let [exact, _] = run(8.0, 1.0, relative(0.05)).unwrap().sum(0, 0);
    for seed in 0..3 {
        let found = run(8.0, 1.0, relative(0.3).with_seed(seed)).unwrap();
        let [sum, error] = found.sum(0, 0);
        println!("{sum:e} +- {error:e} {}", found.report().histories);
        assert!((sum - exact).abs() < 4.0 * error + 0.1 * exact && error > 0.0);
        assert!(found.largest_error() > 0.0);
    }
    for (x, radius) in [(30.0, 1.0), (300.0, 10.0), (1e6, 10.0)] {
        let options = relative(0.3).with_most_histories(1_000_000);
        let found = run(x, radius, options);
        let Err(Error::Tolerance {
            reached, report, ..
        }) = found
        else {
            panic!("{x} {radius}: {found:?}");
        };
        assert!(
            reached > 0.0 && report.histories > 500_000,
            "{reached} {report:?}"
        );
    }
}

/// A speck between the nodes that no history meets: its scatter is not 0, and the error covers it, whatever the pitch.
#[test]
fn scatter_of_a_remote_speck_is_within_its_error() {
    let speck = Ball {
        centre: [0.37, 0.0, 0.37],
        radius: 0.02,
        density: 30.0,
    };
    let view = View {
        angle: 0.0,
        radius: 13.0,
    };
    let camera = Camera::new([20; 2], [0.2; 2], &[view], LEHR).unwrap();
    // Density times volume over 4 pi times the square of the distance, electrons per gram, 4 pi times the cross-section per steradian and electron
    // at a cosine of 0.8, and the efficiency, without attenuation.
    let ratio: f64 = 1.0 / (1.0 + 0.2 * 140.5 / 510.998_95);
    let section = 0.5 * 7.940_787_6e-26 * ratio * ratio * (ratio + 1.0 / ratio - 0.36);
    let amount = 30.0 * 0.02f64.powi(3) / 3.0 / 50.0f64.powi(2);
    let recorded = photopeak().efficiency(0, 140.5 * ratio);
    let exact = amount * 3.342_8e23 * 4.0 * std::f64::consts::PI * section * recorded;
    let peak = exact / (2.0 * std::f64::consts::PI * 0.35f64.powi(2));
    let source = PointSource {
        position: [30.0, -40.0, 0.0],
        activity: 1.0,
    };
    for pitch in [0.75, 5.0] {
        let options = ScatterOptions::new(1e-3).with_pitch(pitch);
        let found = Scatter::new(&source, &speck, &camera, &photopeak(), &options).unwrap();
        let ([sum, error], stated) = (found.sum(0, 0), found.largest_error());
        println!("{pitch}: {sum:e} +- {error:e} for {exact:e}, {stated:e} for {peak:e}");
        assert!((sum - exact).abs() <= 4.0 * error && peak <= stated && stated <= 4e-3);
    }
}

/// Samples are averages over bins: their sum does not depend on the width of the bins.
#[test]
fn projection_sums_agree_for_all_widths_of_bins() {
    let run = |bins, options| scatter(10.0, ([0.0; 3], 1.0), bins, options).unwrap();
    // Quadrature of single scatter.
    let exact = 0.101_44;
    for (bins, pitch) in [
        ((9, 4.0), 0.3),
        ((18, 2.0), 0.3),
        ((19, 2.0), 0.3),
        ((40, 0.9), 0.75),
        ((120, 0.3), 0.3),
    ] {
        let options = relative(0.02).with_pitch(pitch).with_orders(1);
        let [sum, error] = run(bins, options).sum(0, 0);
        println!("{bins:?} {pitch}: {sum} +- {error}");
        assert!((sum - exact).abs() < 3.5 * error && error < 0.01 * exact);
    }
}

/// Points at the centre and near the surface, at a node and between nodes; the pitch is at most the mean distance to an interaction.
#[test]
fn stated_errors_hold_up_to_the_coarsest_pitch() {
    let run = |position, pitch| {
        let options = relative(0.03).with_orders(1).with_pitch(pitch);
        scatter(10.0, (position, 1.0), (40, 0.9), options)
    };
    for (y, pitch) in [(0.0, 3.5), (7.0, 2.5), (9.0, 2.0)] {
        for shift in [0.0, 0.5 * pitch] {
            let position = [shift, y, shift];
            let (exact, found) = (run(position, 0.3).unwrap(), run(position, pitch).unwrap());
            let pairs = exact.view(0, 0).into_iter().zip(found.view(0, 0));
            let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let (stated, own) = (found.largest_error(), exact.largest_error());
            let [a, b] = [&exact, &found].map(|scatter| scatter.sum(0, 0)[0]);
            println!("{y} {shift}: {off} of {stated} + {own}, sums {a} {b}");
            assert!(off <= stated + own && (b / a - 1.0).abs() < 0.03);
        }
        for coarse in [3.0 * pitch, 20.0] {
            let error = run([0.0, y, 0.0], coarse).unwrap_err();
            let Error::OutOfRange { what, most, .. } = error else {
                panic!("{error}");
            };
            assert!(what == "pitch of the nodes in cm" && most > pitch && most < coarse);
        }
    }
    // The response is wider than the medium, and the nodes may be as far apart as it is wide.
    let tiny = |options| scatter(0.1, ([0.0; 3], 1.0), (20, 0.2), options);
    let sum = |options| tiny(options).map(|found| found.sum(0, 0));
    let ([a, first], [b, second]) = (
        sum(relative(0.1)).unwrap(),
        sum(relative(0.1).with_pitch(0.3)).unwrap(),
    );
    assert!((a - b).abs() < 4.0 * first.hypot(second), "{a} {b}");
    assert!(sum(relative(0.1).with_pitch(0.75)).is_err());
}

/// The largest sample and the largest standard error are those of bins, whatever their width.
#[test]
fn relative_tolerances_are_relative_to_the_largest_sample() {
    for bins in [(9, 4.0), (21, 0.5)] {
        let options = relative(0.05).with_pitch(0.5);
        let found = scatter(10.0, ([0.0; 3], 1.0), bins, options).unwrap();
        let largest = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
        let [most, error] = [found.view(0, 0), found.standard_error(0, 0)].map(largest);
        assert_eq!(error, found.report().largest_standard_error);
        assert!(error <= 0.05 * most, "{error} {most}");
    }
}
