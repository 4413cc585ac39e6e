//! Projection sums of strongly attenuated views against quadrature of single scatter.

use crate::support::{Ball, LEHR, Point, photopeak};
use photon_scatter::{
    Camera, Medium, Piece, Random, Scatter, ScatterError, ScatterOptions, View, water_attenuation,
};
use std::f64::consts::{PI, TAU};

/// Lengths in front of a point in a ball, and in it.
fn stretch(ball: &Ball, from: [f64; 3], direction: [f64; 3]) -> Option<[f64; 2]> {
    let mut pieces: Vec<Piece> = Vec::new();
    ball.pieces(from, direction, &mut pieces);
    let piece = pieces.pop().filter(|piece| piece.exit > 0.0)?;
    Some([piece.enter.max(0.0), piece.exit - piece.enter.max(0.0)])
}

/// Singly scattered photons of a point in all directions towards a view, by points in the ball (a low-discrepancy sequence).
fn once(ball: &Ball, source: [f64; 3], angle: f64, samples: usize) -> f64 {
    let ahead = [-angle.sin(), angle.cos(), 0.0];
    let (mu, spectrum) = (water_attenuation(140.5).unwrap(), photopeak());
    let g: f64 = 1.220_744_084_605_759_5;
    let mut sum = 0.0;
    for n in 0..samples {
        let [a, b, c] = [0, 1, 2].map(|k: i32| (0.5 + n as f64 / g.powi(1 + k)).fract());
        let z = 2.0 * a - 1.0;
        let across = (1.0 - z * z).sqrt();
        let direction = [across * (TAU * b).cos(), across * (TAU * b).sin(), z];
        let Some([enter, length]) = stretch(ball, source, direction) else {
            continue;
        };
        let at: [f64; 3] = std::array::from_fn(|k| source[k] + (enter + length * c) * direction[k]);
        let cosine = (0..3).map(|k| direction[k] * ahead[k]).sum::<f64>();
        let ratio = 1.0 / (1.0 + 140.5 / 510.998_95 * (1.0 - cosine));
        let klein_nishina =
            0.5 * 7.940_787_6e-26 * ratio * ratio * (ratio + 1.0 / ratio - 1.0 + cosine * cosine);
        let energy = 140.5 * ratio;
        let left = stretch(ball, at, ahead).map_or(0.0, |[_, length]| length);
        let lost = ball.density * (mu * length * c + water_attenuation(energy).unwrap() * left);
        sum +=
            length * ball.density * (-lost).exp() * klein_nishina * spectrum.efficiency(0, energy);
    }
    sum / samples as f64 * 3.342_8e23 * 4.0 * PI
}

/// Views through up to 24 cm of dense matter, which few photons reach: the blocks miss the largest contributions, or all.
#[test]
fn errors_of_sums_of_attenuated_views_are_not_too_small() {
    let mut random = Random::new(8, 0);
    let options = ScatterOptions::new(0.0)
        .with_relative(0.1)
        .with_orders(1)
        .with_pitch(0.5)
        .with_most_histories(1_000_000);
    let mut sums = 0;
    for scene in 0..10 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
        let (radius, density) = (between(5.0, 12.0), between(0.5, 6.0));
        let ball = Ball {
            centre: [0.0; 3],
            radius,
            density,
        };
        let (turn, distance) = (between(0.0, TAU), between(0.6, 1.3) * radius);
        let source = [
            distance * turn.sin(),
            -distance * turn.cos(),
            between(-1.0, 1.0),
        ];
        // Two views through the ball and one from the side of the source.
        let angles = [
            turn + between(-0.5, 0.5),
            turn + between(-1.5, 1.5),
            turn + PI,
        ];
        let views = angles.map(|angle| View {
            angle: angle.rem_euclid(TAU),
            radius: radius + 5.0,
        });
        let camera = Camera::new([28; 2], [1.0; 2], &views, LEHR).unwrap();
        let exact = angles.map(|angle| once(&ball, source, angle, 200_000));
        for seed in 0..3 {
            let options = options.with_seed(seed);
            let found = Scatter::new(&Point(source, 1.0), &ball, &camera, &photopeak(), &options);
            let found = match found {
                Ok(found) => found,
                Err(ScatterError::Tolerance { .. }) => continue,
                Err(error) => panic!("{error}"),
            };
            let pairs = (0..3).map(|view| (found.sum(0, view), exact[view]));
            for (view, ([sum, error], exact)) in pairs.enumerate() {
                let off = (sum - exact).abs() / error;
                assert!(
                    off <= 4.0,
                    "{scene} {view}: {sum:e} +- {error:e}, exact {exact:e}"
                );
                sums += 1;
            }
        }
    }
    assert!(sums > 60, "{sums}");
}
