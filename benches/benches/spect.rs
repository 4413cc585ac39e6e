//! SPECT views and their adjoint: 64 views of a volume, attenuated and with depth-dependent blur, compared with a plain loop that rotates the volume
//! by interpolation and blurs every plane separately.
//!
//! The object is a Gaussian hill off the centre of a cylinder of water, whose views are an integral over depth and bins of smooth
//! functions; the relative L2 error of each method is printed and asserted before timing.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::cell::LazyCell;
use std::f64::consts::PI;
use std::hint::black_box;

use benches::{Effort, Row, Time, gaussian_blur, on_threads, size, timed};
use criterion::Criterion;
use radon::{
    Collimator, ImageGrid, LinearOperator, ParallelGeometry, ParallelHoles, Phantom3, Shape2,
    Shape3, SliceAxis, SpectGeometry, SpectOperator, SpectOptions,
};
use rayon::prelude::*;

const VIEWS: usize = 64;
/// Exact values are computed for one in this number of views.
const EVERY: usize = 16;
/// Sides of the field of view, the cylinder's radius and its attenuation, the camera's distance, in cm.
const FIELD: f64 = 38.4;
const WATER: (f64, f64) = (16.0, 0.15);
const RADIUS: f64 = 22.0;
/// The hill's centre and standard deviation.
const HILL: ([f64; 3], f64) = ([5.0, -3.0, 1.0], 1.5);

struct Scene {
    n: usize,
    geometry: SpectGeometry,
    grid: ImageGrid,
    axis: SliceAxis,
    collimator: Collimator,
    volume: Vec<f32>,
    water: Vec<f32>,
    /// Every [`EVERY`]th view.
    exact: Vec<f64>,
}

fn scene(n: usize) -> Scene {
    let pitch = FIELD / n as f64;
    let views = ParallelGeometry::full_turn(VIEWS, n, pitch).unwrap();
    let (grid, axis) = (
        ImageGrid::square(n, pitch).unwrap(),
        SliceAxis::new(n, pitch).unwrap(),
    );
    let geometry = SpectGeometry::circular(&views, &axis, RADIUS).unwrap();
    let collimator = Collimator::parallel_holes(&ParallelHoles::GE_LEGP, 0.38).unwrap();
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let hill = Shape3::gaussian(HILL.0, [HILL.1; 3], unit).unwrap();
    let disc = Shape2::ellipse([0.0; 2], [WATER.0; 2], 0.0).unwrap();
    let body = Shape3::prism(disc, [-FIELD, FIELD]).unwrap();
    let made = |value: f64, shape: Shape3| {
        let phantom = Phantom3::new([(value, shape)]).unwrap();
        phantom.volume(&grid, &axis).unwrap()
    };
    let (mut volume, water) = (made(1.0, hill), made(WATER.1, body));
    // Not the time of numbers that are nearly zero.
    let tail = |x: &&mut f32| **x < 1e-12;
    volume.iter_mut().filter(tail).for_each(|x| *x = 0.0);
    let exact = exact(&geometry, &collimator);
    Scene {
        n,
        geometry,
        grid,
        axis,
        collimator,
        volume,
        water,
        exact,
    }
}

/// The views by the trapezoidal rule over depth and bins, which for smooth hills is exact to rounding; rows in closed form.
fn exact(geometry: &SpectGeometry, collimator: &Collimator) -> Vec<f64> {
    const STEP: f64 = 0.25;
    let (views, rows, ([x, y, z], own)) = (geometry.views(), geometry.rows(), HILL);
    let normal = |x: f64, variance: f64| (-0.5 * x * x / variance).exp();
    let thetas: Vec<f64> = views.angles().iter().copied().step_by(EVERY).collect();
    let mut out = vec![0.0; thetas.len() * geometry.view_len()];
    let images = out.par_chunks_mut(geometry.view_len()).zip(thetas);
    images.for_each(|(image, theta)| {
        let (sin, cos) = theta.sin_cos();
        let (s, t) = (x * cos + y * sin, y * cos - x * sin);
        for k in -40..=40 {
            let depth = f64::from(k) * STEP;
            let variance = collimator.variance(RADIUS - t - depth);
            let tall = own * own + variance;
            let along: Vec<f64> = (0..rows.n_slices())
                .map(|row| normal(rows.slice_centre(row) - z, tall) * own / tall.sqrt())
                .collect();
            for bin in 0..views.n_bins() {
                let at = views.bin_centre(bin);
                let across: f64 = (-40..=40)
                    .map(|j| s + f64::from(j) * STEP)
                    .map(|source| {
                        let path = (WATER.0.powi(2) - source * source).sqrt() - (t + depth);
                        let blurred = normal(at - source, variance) / (2.0 * PI * variance).sqrt();
                        normal(source - s, own * own) * (-WATER.1 * path).exp() * blurred
                    })
                    .sum();
                let weight = across * normal(depth, own * own) * STEP * STEP;
                for (row, along) in along.iter().enumerate() {
                    image[row * views.n_bins() + bin] += weight * along;
                }
            }
        }
    });
    out
}

impl Scene {
    fn operator(&self, tolerance: f64) -> SpectOperator<f32> {
        let options = SpectOptions::default()
            .with_collimator(self.collimator)
            .with_attenuation(self.water.clone())
            .with_tolerance(tolerance);
        SpectOperator::new(&self.geometry, &self.grid, &self.axis, &options).unwrap()
    }

    /// Relative L2 distance from the exact views.
    fn error(&self, views: &[f32]) -> f64 {
        let len = self.geometry.view_len();
        let seen = views.chunks_exact(len).step_by(EVERY).flatten();
        let square: f64 = (seen.zip(&self.exact))
            .map(|(&a, b)| (f64::from(a) - b).powi(2))
            .sum();
        (square / self.exact.iter().map(|x| x * x).sum::<f64>()).sqrt()
    }

    /// Planes parallel to the detector by bilinear interpolation, each attenuated by all before it and half of itself, and blurred separately.
    fn plain_loop(&self) -> Vec<f32> {
        let (n, pitch) = (self.n, FIELD / self.n as f64);
        let middle = (n as f64 - 1.0) / 2.0;
        let distance = |plane: usize| RADIUS - (middle - plane as f64) * pitch;
        let variances: Vec<f64> = (0..n)
            .map(|plane| self.collimator.variance(distance(plane)) / (pitch * pitch))
            .collect();
        let mut out = vec![0.0f32; VIEWS * n * n];
        let views = out
            .par_chunks_mut(n * n)
            .zip(self.geometry.views().angles());
        views.for_each(|(view, theta)| {
            let (sin, cos) = theta.sin_cos();
            let mut path = vec![0.0f32; n * n];
            for (plane, variance) in variances.iter().enumerate() {
                let (mut emitted, mut weakened) = (vec![0.0f32; n * n], vec![0.0f32; n * n]);
                for bin in 0..n {
                    let (s, t) = (bin as f64 - middle, middle - plane as f64);
                    let x = (s * cos - t * sin + middle).clamp(0.0, n as f64 - 1.001);
                    let y = (s * sin + t * cos + middle).clamp(0.0, n as f64 - 1.001);
                    let (i, j) = (x as usize, y as usize);
                    let (u, v) = ((x - i as f64) as f32, (y - j as f64) as f32);
                    let at = |volume: &[f32], row: usize| {
                        let near = &volume[(row * n + j) * n + i..];
                        (1.0 - v) * ((1.0 - u) * near[0] + u * near[1])
                            + v * ((1.0 - u) * near[n] + u * near[n + 1])
                    };
                    for row in 0..n {
                        emitted[row * n + bin] = at(&self.volume, row) * pitch as f32;
                        weakened[row * n + bin] = at(&self.water, row) * pitch as f32;
                    }
                }
                for ((e, &w), path) in emitted.iter_mut().zip(&weakened).zip(&mut path) {
                    *e *= (-(*path + 0.5 * w)).exp();
                    *path += w;
                }
                let blurred = gaussian_blur(&emitted, n, [*variance; 2]);
                view.iter_mut().zip(&blurred).for_each(|(v, e)| *v += e);
            }
        });
        out
    }
}

fn forward(operator: &SpectOperator<f32>, volume: &[f32], views: &mut [f32]) {
    operator.forward_into(black_box(volume), views).unwrap();
}

/// If a filter omits a method, its scene is not computed.
fn spect(c: &mut Criterion) {
    let n = size(128, 32);
    let scene = LazyCell::new(|| scene(n));
    let mut group = c.benchmark_group(format!("spect/{n}x{n}x{n}x64"));
    group.sample_size(10);
    let operator = LazyCell::new(|| scene.operator(1e-3));
    let mut views = vec![0.0; VIEWS * n * n];
    let checked = LazyCell::new(|| {
        let mut views = vec![0.0; VIEWS * n * n];
        forward(&operator, &scene.volume, &mut views);
        let errors = [scene.error(&views), scene.error(&scene.plain_loop())];
        println!("operator: {:.2e}, plain loop: {:.2e}", errors[0], errors[1]);
        // A sixth of a voxel's square in the variance of a hill of four voxels and more, at the full size.
        let most = 0.01 * (128.0 / n as f64).powi(2);
        assert!(errors.iter().all(|&error| error < most), "{errors:?}");
    });
    group.bench_function("forward", |b| {
        *checked;
        b.iter(|| forward(&operator, &scene.volume, &mut views))
    });
    let mut back = vec![0.0; n * n * n];
    let counts = vec![1.0; VIEWS * n * n];
    group.bench_function("adjoint", |b| {
        b.iter(|| {
            operator
                .adjoint_into(black_box(&counts), &mut back)
                .unwrap()
        })
    });
    group.bench_function("plain loop", |b| b.iter(|| black_box(scene.plain_loop())));
    group.finish();
}

/// Time and error against size and tolerance.
fn rows(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test => &[32],
        Effort::Quick => &[64],
        Effort::Full => &[64, 128, 256],
    };
    for &n in sizes {
        let scene = scene(n);
        let row = |method: &str, back: &str, threads: usize, (seconds, error): (Time, f64)| {
            Row {
                study: "SPECT",
                method,
                case: &format!("hill in water, 64 views, attenuated and blurred by distance{back}"),
                size: n,
                threads,
                seconds,
                error,
                error_kind: match back {
                    "" => "relative L2 against the integral over depth",
                    _ => "relative difference of <A x, y> and <x, A' y>",
                },
            }
            .print();
        };
        let (mut views, mut back) = (vec![0.0; VIEWS * n * n], vec![0.0; n * n * n]);
        let counts: Vec<f32> = (0..views.len()).map(|i| 1.0 + (i % 7) as f32).collect();
        let dot = |a: &[f32], b: &[f32]| -> f64 {
            let products = a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b));
            products.sum()
        };
        for tolerance in [1e-2, 1e-3] {
            let operator = scene.operator(tolerance);
            for &threads in benches::threads() {
                let run = || timed(effort, || forward(&operator, &scene.volume, &mut views)).0;
                let seconds = on_threads(threads, run);
                let method = format!("SpectOperator, tolerance {tolerance:e}");
                row(&method, "", threads, (seconds, scene.error(&views)));
                let run = || {
                    timed(effort, || {
                        operator.adjoint_into(&counts, &mut back).unwrap()
                    })
                    .0
                };
                let seconds = on_threads(threads, run);
                let off = (dot(&views, &counts) / dot(&scene.volume, &back) - 1.0).abs();
                row(&method, ", back", threads, (seconds, off));
            }
        }
        if n <= 128 {
            let (seconds, views) = on_threads(2, || timed(effort, || scene.plain_loop()));
            row(
                "every plane blurred by itself",
                "",
                2,
                (seconds, scene.error(&views)),
            );
        }
    }
}

fn main() {
    benches::run(rows, &[spect]);
}
