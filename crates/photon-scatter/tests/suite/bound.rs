//! The stated error against quadrature of single scatter, for random scenes.

use crate::support::{Ball, BallSource, LEHR, photopeak, share};
use photon_scatter::{
    Camera, Emission, Medium, Piece, PointSource, Random, Response, Scatter, ScatterOptions,
    Source, View, water_attenuation,
};
use std::f64::consts::{PI, TAU};

/// A cube of water or of activity 1 per cm^3: centre and half-width.
struct Cube([f64; 3], f64);

impl Medium for Cube {
    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>) {
        let (mut enter, mut exit) = (f64::MIN, f64::MAX);
        for k in 0..3 {
            let ends =
                [-1.0, 1.0].map(|side| (self.0[k] + side * self.1 - position[k]) / direction[k]);
            (enter, exit) = (
                enter.max(ends[0].min(ends[1])),
                exit.min(ends[0].max(ends[1])),
            );
        }
        if enter < exit {
            pieces.push(Piece {
                enter,
                exit,
                density: 1.0,
            });
        }
    }
}

impl Source for Cube {
    fn emit(&self, random: &mut Random) -> Emission {
        Emission {
            position: self.0.map(|x| x + self.1 * (2.0 * random.uniform() - 1.0)),
            weight: (2.0 * self.1).powi(3),
        }
    }
}

struct Scene {
    source: Box<dyn Source>,
    medium: Box<dyn Medium>,
    views: Vec<View>,
    response: Response,
    bins: usize,
    pitch: f64,
}

impl Scene {
    fn new(random: &mut Random) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
        let centre = [0; 3].map(|_| between(-1.0, 1.0));
        let radius = between(3.0, 9.0);
        let (ball, kind, outside) = (
            between(0.0, 1.0) < 0.5,
            between(0.0, 3.0) as usize,
            between(0.0, 1.0) < 0.1,
        );
        let reach = if outside { 1.3 } else { 0.55 } * radius;
        let at = [0, 1, 2].map(|k| centre[k] + between(-reach, reach));
        let width = between(0.05, 0.4 * radius);
        let face = radius * if ball { 1.0 } else { 1.42 } + 1.5 + between(0.1, 6.0);
        let views = [0; 2].map(|_| View {
            angle: between(0.0, TAU),
            radius: face,
        });
        let pitch = between(0.15, 0.8);
        Self {
            source: match kind {
                0 => Box::new(PointSource {
                    position: at,
                    activity: 1.0,
                }),
                1 => Box::new(Cube(at, 0.5 * width)),
                _ => Box::new(BallSource(at, 0.5 * width, 1.0)),
            },
            medium: match ball {
                true => Box::new(Ball {
                    centre,
                    radius,
                    density: 1.0,
                }),
                false => Box::new(Cube(centre, radius)),
            },
            views: views.to_vec(),
            response: Response {
                slope: between(0.0, 0.04),
                at_face: between(0.0, 0.1),
                intrinsic: between(0.05, 0.4),
            },
            bins: (between(1.0, 2.5) * radius / pitch) as usize,
            pitch,
        }
    }

    fn scatter(&self, options: &ScatterOptions) -> Scatter {
        let camera =
            Camera::new([self.bins; 2], [self.pitch; 2], &self.views, self.response).unwrap();
        Scatter::new(&*self.source, &*self.medium, &camera, &photopeak(), options).unwrap()
    }

    /// Averages of single scatter over the bins of a view: in spherical coordinates about points of the source, points of a low-discrepancy sequence.
    fn once(&self, view: usize, stream: u64, samples: usize) -> Vec<f64> {
        let View { angle, radius } = self.views[view];
        let (bins, ahead) = (
            [angle.cos(), angle.sin(), 0.0],
            [-angle.sin(), angle.cos(), 0.0],
        );
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mu = water_attenuation(140.5).unwrap();
        let spectrum = photopeak();
        let (mut random, mut pieces) = (Random::new(77, stream), Vec::new());
        let mut image = vec![0.0; self.bins * self.bins];
        let shift = [0; 3].map(|_| random.uniform());
        // M. Roberts' additive sequence in three dimensions.
        let g: f64 = 1.220_744_084_605_759_5;
        for n in 0..samples {
            let [a, b, c] =
                [0, 1, 2].map(|k: usize| (shift[k] + n as f64 / g.powi(1 + k as i32)).fract());
            let emission = self.source.emit(&mut random);
            let (z, turn) = (2.0 * a - 1.0, TAU * b);
            let across = (1.0 - z * z).sqrt();
            let direction = [across * turn.cos(), across * turn.sin(), z];
            pieces.clear();
            self.medium
                .pieces(emission.position, direction, &mut pieces);
            let Some(piece) = pieces.pop().filter(|piece| piece.exit > 0.0) else {
                continue;
            };
            let (enter, length) = (piece.enter.max(0.0), piece.exit - piece.enter.max(0.0));
            let r = length * c * c;
            let at: [f64; 3] =
                std::array::from_fn(|k| emission.position[k] + (enter + r) * direction[k]);
            let cosine = dot(direction, ahead);
            let ratio = 1.0 / (1.0 + 140.5 / 510.998_95 * (1.0 - cosine));
            let klein_nishina = 0.5
                * 7.940_787_6e-26
                * ratio
                * ratio
                * (ratio + 1.0 / ratio - 1.0 + cosine * cosine);
            pieces.clear();
            self.medium.pieces(at, ahead, &mut pieces);
            let left = pieces
                .pop()
                .map_or(0.0, |piece| piece.exit - piece.enter.max(0.0))
                .max(0.0);
            let energy = 140.5 * ratio;
            let left = water_attenuation(energy).unwrap() * left;
            let value = emission.weight
                * 2.0
                * length
                * c
                * (-mu * r - left).exp()
                * 3.342_8e23
                * 4.0
                * PI
                * klein_nishina
                * spectrum.efficiency(0, energy);
            let depth = radius - dot(at, ahead);
            let variance = (self.response.slope * depth.max(0.0) + self.response.at_face).powi(2)
                + self.response.intrinsic.powi(2);
            let places =
                [dot(at, bins), at[2]].map(|x| x / self.pitch + 0.5 * (self.bins - 1) as f64);
            let width = 5.0 * variance.sqrt() / self.pitch;
            let range = |x: f64| {
                (x - width).max(0.0) as usize
                    ..((x + width).max(-1.0) + 1.0).min(self.bins as f64) as usize
            };
            let shares = [0, 1].map(|axis| -> Vec<f64> {
                let off = |k: usize| self.pitch * (k as f64 - places[axis]);
                let share = |k| share(off(k), self.pitch, variance);
                range(places[axis]).map(share).collect()
            });
            for (row, along) in range(places[1]).zip(&shares[1]) {
                for (bin, across) in range(places[0]).zip(&shares[0]) {
                    image[row * self.bins + bin] += value * across * along;
                }
            }
        }
        image
            .into_iter()
            .map(|value| value / samples as f64)
            .collect()
    }
}

/// Largest difference of single scatter from quadrature over the stated error, with the error of the quadrature, for automatic and prescribed nodes.
fn check(scene: &Scene) {
    let views = 0..scene.views.len();
    let parts = [0, 1, 2].map(|stream| -> Vec<f64> {
        let images = views.clone().map(|view| scene.once(view, stream, 150_000));
        images.flatten().collect()
    });
    let exact: Vec<f64> = (0..parts[0].len())
        .map(|k| parts.iter().map(|part| part[k]).sum::<f64>() / 3.0)
        .collect();
    let spread = |part: &Vec<f64>| {
        let off = part.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        off.fold(0.0, f64::max)
    };
    let uncertain = parts.iter().map(spread).fold(0.0, f64::max);
    let peak = exact.iter().copied().fold(0.0, f64::max);
    for pitch in [None, Some(0.3), Some(0.75), Some(1.5)] {
        let options = ScatterOptions::new(0.0).with_relative(0.02).with_orders(1);
        let found = scene.scatter(&pitch.map_or(options, |pitch| options.with_pitch(pitch)));
        let samples = views.clone().flat_map(|view| found.view(0, view));
        let off = samples.zip(&exact).map(|(a, b)| (a - b).abs());
        let (off, stated) = (off.fold(0.0, f64::max), found.largest_error());
        println!(
            "{pitch:?}: {:.4} of {:.4}, quadrature {:.4}",
            off / peak,
            stated / peak,
            uncertain / peak
        );
        assert!(uncertain < 0.06 * peak, "{uncertain} {peak}");
        assert!(off <= stated + uncertain, "{pitch:?}: {off} {stated}");
        // Four standard errors and the interpolation, each at most 2 % of the largest sample, which is about 2 % too large.
        assert!(pitch.is_some() || stated < 0.105 * peak, "{stated} {peak}");
    }
}

#[test]
fn stated_errors_bound_the_difference_from_quadrature_in_random_scenes() {
    for stream in 0..3 {
        check(&Scene::new(&mut Random::new(5, stream)));
    }
}

/// A point between the nodes at the default pitch: the samples of its peak are 30 % too low there.
#[test]
fn stated_errors_bound_the_error_of_a_point_between_nodes() {
    let view = |degrees: f64| View {
        angle: degrees.to_radians(),
        radius: 12.0,
    };
    check(&Scene {
        source: Box::new(PointSource {
            position: [2.75, -0.25, -0.25],
            activity: 1.0,
        }),
        medium: Box::new(Ball {
            centre: [0.0; 3],
            radius: 8.0,
            density: 1.0,
        }),
        views: [0.0, 90.0, 180.0, 270.0].map(view).to_vec(),
        response: LEHR,
        bins: 64,
        pitch: 0.5,
    });
}
