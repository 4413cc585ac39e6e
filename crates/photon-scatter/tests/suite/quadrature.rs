//! Single scatter against deterministic quadrature, and its reciprocity.

use crate::support::{Ball, BallSource, LEHR, Point, camera, photopeak, share};
use photon_scatter::{Medium, Scatter, ScatterOptions, water_attenuation};
use std::f64::consts::PI;

fn length_ahead(ball: &Ball, position: [f64; 3], direction: [f64; 3]) -> f64 {
    let mut pieces = Vec::new();
    ball.pieces(position, direction, &mut pieces);
    let ahead = |piece: &photon_scatter::Piece| piece.exit - piece.enter.max(0.0);
    pieces.iter().map(ahead).map(|length| length.max(0.0)).sum()
}

/// Width of the bins in cm.
const BIN: f64 = 1.2;

/// Singly scattered photons of a point source outside a ball, averaged over the bin about a point of the detector: a sum over cubes in the ball.
fn once_scattered(ball: &Ball, source: [f64; 3], angle: f64, [s, z]: [f64; 2]) -> f64 {
    let step = 0.15;
    let n = (ball.radius / step).ceil() as i32;
    let mu = water_attenuation(140.5).unwrap();
    let (bins, ahead) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos(), 0.0]);
    let spectrum = photopeak();
    let mut sum = 0.0;
    for k in 0..(2 * n).pow(3) {
        let index = [k % (2 * n), k / (2 * n) % (2 * n), k / (2 * n).pow(2)];
        let offset = index.map(|i| (f64::from(i - n) + 0.5) * step);
        if offset.iter().map(|x| x * x).sum::<f64>() > ball.radius.powi(2) {
            continue;
        }
        let at: [f64; 3] = std::array::from_fn(|k| ball.centre[k] + offset[k]);
        let way: [f64; 3] = std::array::from_fn(|k| at[k] - source[k]);
        let distance = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        let towards = way.map(|x| x / distance);
        let inside = length_ahead(ball, source, towards) - length_ahead(ball, at, towards);
        let fluence = (-mu * ball.density * inside).exp() / (4.0 * PI * distance * distance);
        let cosine = towards[0] * ahead[0] + towards[1] * ahead[1];
        let ratio = 1.0 / (1.0 + 140.5 / 510.998_95 * (1.0 - cosine));
        // cm^2 per steradian and electron.
        let klein_nishina =
            0.5 * 7.940_787_6e-26 * ratio * ratio * (ratio + 1.0 / ratio - 1.0 + cosine * cosine);
        let electrons = ball.density * 3.342_8e23;
        let energy = 140.5 * ratio;
        let left =
            water_attenuation(energy).unwrap() * ball.density * length_ahead(ball, at, ahead);
        let recorded = (-left).exp() * spectrum.efficiency(0, energy);
        let depth = 25.0 - (at[0] * ahead[0] + at[1] * ahead[1]);
        let variance = (LEHR.slope * depth + LEHR.at_face).powi(2) + LEHR.intrinsic.powi(2);
        let shares = [at[0] * bins[0] + at[1] * bins[1] - s, at[2] - z];
        let [across, along] = shares.map(|off| share(off, BIN, variance));
        sum += fluence * electrons * klein_nishina * 4.0 * PI * recorded * across * along;
    }
    sum * step.powi(3)
}

#[test]
fn single_scatter_agrees_with_the_integral_over_the_medium() {
    let ball = Ball {
        centre: [1.0, 0.5, -0.5],
        radius: 4.0,
        density: 1.0,
    };
    let source = [-5.0, -2.0, 1.0];
    let degrees = [-60.0, -20.0, 70.0];
    let camera = camera(9, BIN, &degrees);
    let options = ScatterOptions::new(2e-5).with_orders(1).with_pitch(0.3);
    let scatter =
        Scatter::new(&Point(source, 1.0), &ball, &camera, &photopeak(), &options).unwrap();
    let mut within = [0, 0];
    for (view, degrees) in degrees.iter().enumerate() {
        let (samples, errors) = (scatter.view(0, view), scatter.standard_error(0, view));
        let largest = samples.iter().fold(0.0, |a: f64, b| a.max(*b));
        for row in [2, 4, 5] {
            for bin in 0..9 {
                let at = [bin, row].map(|k| BIN * (k as f64 - 4.0));
                let exact = once_scattered(&ball, source, degrees.to_radians(), at);
                let (sample, error) = (samples[row * 9 + bin], errors[row * 9 + bin]);
                // The edge of the ball is not resolved by the nodes to the last digit: 0.4 % of the largest sample.
                let bound = 3.0 * error + 0.004 * largest;
                assert!(
                    (sample - exact).abs() < bound,
                    "view {view}, {at:?}: {sample:e} for {exact:e}, {error:e} of {largest:e}"
                );
                within[usize::from((sample - exact).abs() < 2.0 * error)] += 1;
            }
        }
    }
    assert!(within[1] > 9 * within[0], "{within:?}");
}

#[test]
fn source_and_medium_are_reciprocal_without_attenuation() {
    let (a, b) = ([-4.0, 1.0, 0.5], [3.0, -0.5, -0.5]);
    let density = 1e-6;
    let ball = |centre| Ball {
        centre,
        radius: 1.5,
        density,
    };
    let total = |from: [f64; 3], to: [f64; 3], degrees: f64| {
        let options = ScatterOptions::new(2e-10).with_orders(1);
        let source = BallSource(from, 1.5, 1.0);
        let camera = camera(40, 0.5, &[degrees]);
        let scatter = Scatter::new(&source, &ball(to), &camera, &photopeak(), &options).unwrap();
        scatter.view(0, 0).iter().sum::<f64>()
    };
    for degrees in [-70.0, -120.0] {
        let [there, back] = [total(a, b, degrees), total(b, a, degrees + 180.0)];
        assert!(there > 0.0);
        assert!(
            (there / back - 1.0).abs() < 0.01,
            "{degrees}: {there:e} {back:e}"
        );
    }
}
