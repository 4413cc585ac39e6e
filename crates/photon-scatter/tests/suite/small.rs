//! Scatterers smaller than the distance of the nodes, far from the source: the stated error against quadrature of single scatter.

use crate::support::{Ball, camera, photopeak, share};
use photon_scatter::{
    Camera, Emission, Medium, Piece, PointSource, Random, Response, Scatter, ScatterError,
    ScatterOptions, Source, Spectrum, View, water_attenuation,
};
use std::f64::consts::{PI, TAU};

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Disjoint balls of water (centre and radius) in a larger ball about the origin of a low density.
struct Beads {
    beads: Vec<([f64; 3], f64)>,
    radius: f64,
    density: f64,
}

/// Ends of a ball on a line.
fn ends(centre: [f64; 3], radius: f64, from: [f64; 3], direction: [f64; 3]) -> Option<[f64; 2]> {
    let p: [f64; 3] = std::array::from_fn(|k| from[k] - centre[k]);
    let middle = -dot(p, direction);
    let square = radius * radius - dot(p, p) + middle * middle;
    (square > 0.0).then(|| [middle - square.sqrt(), middle + square.sqrt()])
}

impl Medium for Beads {
    fn pieces(&self, from: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>) {
        let on_line = |(centre, radius): &([f64; 3], f64)| ends(*centre, *radius, from, direction);
        let mut own: Vec<[f64; 2]> = self.beads.iter().filter_map(on_line).collect();
        own.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let around = ends([0.0; 3], self.radius, from, direction);
        let Some([mut enter, end]) = around else {
            return;
        };
        for [first, last] in own {
            for (exit, density) in [(first, self.density), (last, 1.0)] {
                pieces.push(Piece {
                    enter,
                    exit,
                    density,
                });
                enter = exit;
            }
        }
        pieces.push(Piece {
            enter,
            exit: end,
            density: self.density,
        });
    }
}

impl Beads {
    /// Column densities of a ray, as far as a distance.
    fn column(&self, from: [f64; 3], direction: [f64; 3], end: f64) -> f64 {
        let mut pieces = Vec::new();
        self.pieces(from, direction, &mut pieces);
        let length = |piece: &Piece| (piece.exit.min(end) - piece.enter.max(0.0)).max(0.0);
        pieces
            .iter()
            .map(|piece| piece.density * length(piece))
            .sum()
    }
}

struct Scene {
    source: [f64; 3],
    medium: Beads,
    view: View,
    response: Response,
    pitch: f64,
    spectrum: Spectrum,
}

/// Bins of a view.
const BINS: usize = 24;

impl Scene {
    fn new(random: &mut Random) -> Self {
        let mut between = |low: f64, high: f64| low + (high - low) * random.uniform();
        let radius = between(12.0, 18.0);
        let source = [0; 3].map(|_| between(-6.0, 6.0));
        let mut beads: Vec<([f64; 3], f64)> = Vec::new();
        let count = between(1.0, 4.0) as usize;
        // Some are in a row.
        let row = between(0.0, 1.0) < 0.5;
        while beads.len() < count {
            let size = between(0.3, 2.0);
            let centre = match beads.first() {
                Some((first, _)) if row => {
                    let along = between(0.3, 2.5);
                    std::array::from_fn(|k| source[k] + along * (first[k] - source[k]))
                }
                _ => [0; 3].map(|_| between(-9.0, 9.0)),
            };
            let distance = |a: [f64; 3]| {
                let off: [f64; 3] = std::array::from_fn(|k| a[k] - centre[k]);
                dot(off, off).sqrt()
            };
            let apart = beads
                .iter()
                .all(|(other, own)| distance(*other) > own + size);
            if apart && distance(source) > size + 4.0 && distance([0.0; 3]) < radius - size {
                beads.push((centre, size));
            }
        }
        let density = if between(0.0, 1.0) < 0.5 {
            0.0
        } else {
            between(0.0, 0.02)
        };
        Self {
            source,
            medium: Beads {
                beads,
                radius,
                density,
            },
            view: View {
                angle: between(0.0, TAU),
                radius: radius + between(0.1, 8.0),
            },
            response: Response {
                slope: between(0.0, 0.04),
                at_face: between(0.0, 0.1),
                intrinsic: between(0.05, 0.4),
            },
            pitch: between(0.5, 1.0),
            spectrum: photopeak(),
        }
    }

    fn scatter(&self, options: &ScatterOptions) -> Result<Scatter, ScatterError> {
        let camera = Camera::new([BINS; 2], [self.pitch; 2], &[self.view], self.response)?;
        let source = PointSource {
            position: self.source,
            activity: 1.0,
        };
        Scatter::new(&source, &self.medium, &camera, &self.spectrum, options)
    }

    /// Averages of single scatter over the bins: points in the beads, and of the rays from the source, of a low-discrepancy sequence.
    fn once(&self, samples: usize) -> Vec<f64> {
        let mut image = vec![0.0; BINS * BINS];
        let beads = &self.medium.beads;
        // M. Roberts' additive sequence in three dimensions.
        let g: f64 = 1.220_744_084_605_759_5;
        for n in 0..samples {
            let [a, b, c] = [0, 1, 2].map(|k: i32| (0.5 + n as f64 / g.powi(1 + k)).fract());
            let z = 2.0 * a - 1.0;
            let across = (1.0 - z * z).sqrt();
            let direction = [across * (TAU * b).cos(), across * (TAU * b).sin(), z];
            for (centre, radius) in beads {
                let r = radius * c.cbrt();
                let at: [f64; 3] = std::array::from_fn(|k| centre[k] + r * direction[k]);
                let way: [f64; 3] = std::array::from_fn(|k| at[k] - self.source[k]);
                let volume = 4.0 / 3.0 * PI * radius.powi(3);
                let weight = volume / (4.0 * PI * dot(way, way));
                self.add(at, weight / samples as f64, &mut image);
            }
            if let Some([_, end]) = ends([0.0; 3], self.medium.radius, self.source, direction) {
                let at: [f64; 3] = std::array::from_fn(|k| self.source[k] + c * end * direction[k]);
                let inside = |(centre, radius): &([f64; 3], f64)| {
                    let off: [f64; 3] = std::array::from_fn(|k| at[k] - centre[k]);
                    dot(off, off) < radius * radius
                };
                if !beads.iter().any(inside) {
                    let weight = self.medium.density * end;
                    self.add(at, weight / samples as f64, &mut image);
                }
            }
        }
        image
    }

    /// Adds the scatter at a point, whose weight is density times volume over 4 pi times the square of the distance from the source.
    fn add(&self, at: [f64; 3], weight: f64, image: &mut [f64]) {
        if weight == 0.0 {
            return;
        }
        let View { angle, radius } = self.view;
        let (bins, ahead) = (
            [angle.cos(), angle.sin(), 0.0],
            [-angle.sin(), angle.cos(), 0.0],
        );
        let way: [f64; 3] = std::array::from_fn(|k| at[k] - self.source[k]);
        let distance = dot(way, way).sqrt();
        let direction = way.map(|x| x / distance);
        let cosine = dot(direction, ahead);
        let ratio = 1.0 / (1.0 + 140.5 / 510.998_95 * (1.0 - cosine));
        let klein_nishina =
            0.5 * 7.940_787_6e-26 * ratio * ratio * (ratio + 1.0 / ratio - 1.0 + cosine * cosine);
        let energy = 140.5 * ratio;
        let attenuation = |energy| water_attenuation(energy).unwrap();
        let lost = attenuation(140.5) * self.medium.column(self.source, direction, distance)
            + attenuation(energy) * self.medium.column(at, ahead, f64::MAX);
        let recorded = (-lost).exp() * self.spectrum.efficiency(0, energy);
        let value = weight * 3.342_8e23 * 4.0 * PI * klein_nishina * recorded;
        let depth = radius - dot(at, ahead);
        let variance = (self.response.slope * depth.max(0.0) + self.response.at_face).powi(2)
            + self.response.intrinsic.powi(2);
        let places = [dot(at, bins), at[2]].map(|x| x / self.pitch + 0.5 * (BINS - 1) as f64);
        let width = 5.0 * variance.sqrt() / self.pitch + 1.0;
        let parts = places.map(|place| -> Vec<f64> {
            let part = |k: usize| {
                let off = k as f64 - place;
                match off.abs() < width {
                    true => share(self.pitch * off, self.pitch, variance),
                    false => 0.0,
                }
            };
            (0..BINS).map(part).collect()
        });
        for (line, along) in image
            .chunks_mut(BINS)
            .zip(&parts[1])
            .filter(|(_, w)| **w > 0.0)
        {
            for (bin, across) in line.iter_mut().zip(&parts[0]) {
                *bin += value * across * along;
            }
        }
    }
}

/// Prescribed pitches are within the stated error, or rejected: their limit is the depth of the interactions in the scatterers, not their distance
/// from the source.
#[test]
fn stated_errors_hold_for_scatterers_between_the_nodes() {
    let mut random = Random::new(6, 0);
    let [mut within, mut rejected] = [0; 2];
    for index in 0..16 {
        let scene = Scene::new(&mut random);
        let [coarse, exact] = [12_000, 16_000].map(|samples| scene.once(samples));
        let off = |a: &[f64], b: &[f64]| {
            let off = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            off.fold(0.0, f64::max)
        };
        let uncertain = off(&coarse, &exact);
        for pitch in [0.6, 1.0, 3.0, 9.0] {
            let options = ScatterOptions::new(0.0)
                .with_relative(0.1)
                .with_orders(1)
                .with_block(4096)
                .with_most_histories(2_000_000)
                .with_pitch(pitch);
            match scene.scatter(&options) {
                Ok(found) => {
                    let (off, stated) = (off(&found.view(0, 0), &exact), found.largest_error());
                    let sizes: Vec<f64> = scene.medium.beads.iter().map(|bead| bead.1).collect();
                    assert!(
                        off <= stated + uncertain,
                        "{index} {pitch}: {off:e} of {stated:e}, {sizes:?}"
                    );
                    within += 1;
                }
                Err(ScatterError::OutOfRange { what, most, .. }) => {
                    assert!(what == "pitch of the nodes in cm" && most < pitch && most > 0.1);
                    rejected += 1;
                }
                // Few photons meet the smallest.
                Err(ScatterError::Tolerance { .. }) => (),
                Err(error) => panic!("{error}"),
            }
        }
    }
    println!("{within} {rejected}");
    assert!(within >= 10 && rejected >= 20, "{within} {rejected}");
}

/// A hot sphere in a cube of drawn positions, of which 4 in 100 000 are inside.
struct Hot;

impl Source for Hot {
    fn emit(&self, random: &mut Random) -> Emission {
        let position = [0; 3].map(|_| 14.0 * (random.uniform() - 0.5));
        let inside = position.iter().map(|x| x * x).sum::<f64>() < 0.09;
        let weight = if inside { 24_254.0 } else { 0.0 };
        Emission { position, weight }
    }
}

/// Histories of weight 0 are no evidence: with the mean weight for that of an unseen photon, 0 +- 2e-6 was accepted.
#[test]
fn sparse_sources_are_not_without_scatter() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 10.0,
        density: 1.0,
    };
    for seed in 8..16 {
        let options = ScatterOptions::new(2e-4).with_pitch(0.75);
        let options = options.with_most_histories(100_000).with_seed(seed);
        let found = Scatter::new(
            &Hot,
            &ball,
            &camera(24, 0.6, &[0.0]),
            &photopeak(),
            &options,
        );
        if let Ok(scatter) = found {
            assert!(scatter.sum(0, 0)[0] > 0.0, "{seed}");
        }
    }
}
