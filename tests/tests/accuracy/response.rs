//! Depth-dependent resolution.

use std::f64::consts::PI;

use crate::Row;
use radon::{
    Collimator, ImageGrid, LinearOperator, ParallelGeometry, SliceAxis, SpectGeometry,
    SpectOperator, SpectOptions,
};
use revolve_voxel::DepthResponse;
use tests::Random;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "radon::SpectOptions::tolerance",
        what: "image of a voxel",
        reference: "Gaussian sampled on the bins; its parameter is found by bisection, so that its variance is that of the plane",
        norm: "maximum, relative to the peak",
        quick: 20,
        problem: voxel_of_the_operator,
    },
    Row {
        name: "revolve_voxel::DepthResponse::error",
        what: "integral of the absolute error of the response to a point, at 40 random depths",
        reference: "Lagrange polynomials in product form, closed-form integrals between sign changes",
        norm: "maximum over the depths",
        quick: 100,
        problem: response_in_depth,
    },
];

/// Bins of a side of the images.
const N: usize = 15;

/// A clinical collimator, bins and rows of 2 to 8 mm, a tolerance.
fn camera(random: &mut Random) -> (Collimator, [f64; 2], f64) {
    let slope = random.uniform(0.01, 0.06);
    let at_face = random.uniform(0.02, 0.2);
    let intrinsic = random.uniform(0.0, 0.25);
    let collimator = Collimator::new(slope, at_face, intrinsic).unwrap();
    let pitch = [0; 2].map(|_| random.uniform(0.2, 0.8));
    (collimator, pitch, random.decades(-5.0, -1.0))
}

fn voxel_of_the_operator(random: &mut Random) -> Option<f64> {
    let (collimator, pitch, tolerance) = camera(random);
    let depth = random.uniform(0.2, 0.8);
    let n = random.integer(8, 40);
    let radius = random.uniform(0.5, 1.0) * n as f64 * depth;
    let views = ParallelGeometry::new([0.0], N, pitch[0]).ok()?;
    let (axis, y) = (SliceAxis::new(N, pitch[1]).ok()?, random.integer(0, n - 1));
    let geometry = SpectGeometry::circular(&views, &axis, radius).ok()?;
    let grid = ImageGrid::anisotropic(N, n, [pitch[0], depth]).ok()?;
    let options = SpectOptions::default()
        .with_collimator(collimator)
        .with_tolerance(tolerance);
    let camera = SpectOperator::<f64>::new(&geometry, &grid, &axis, &options).ok()?;
    let distance = radius - grid.pixel_centre(N / 2, y)[1];
    // Planes are as thick as the pixel's shorter side; the voxel is one plane.
    if distance < 0.0 || depth > pitch[0] {
        return None;
    }
    let mut volume = vec![0.0; N * N * n];
    volume[(N / 2 * n + y) * N + N / 2] = 1.0 / depth;
    let mut view = vec![0.0; N * N];
    camera.forward_into(&volume, &mut view).ok()?;
    let variance = collimator.variance(distance) + (collimator.slope() * depth).powi(2) / 12.0;
    Some(off(&view, variance, pitch) / tolerance)
}

/// The largest deviation of the image of a point in the middle from two lattice Gaussians, relative to their peak.
fn off(image: &[f64], variance: f64, pitch: [f64; 2]) -> f64 {
    let [bins, rows] = pitch.map(|pitch| gaussian(variance / pitch / pitch));
    let exact = |k: usize| bins[(k % N).abs_diff(N / 2)] * rows[(k / N).abs_diff(N / 2)];
    let off = (0..N * N).map(|k| (image[k] - exact(k)).abs());
    off.fold(0.0, f64::max) / exact(N * N / 2)
}

/// Weights q^(k^2) of k = 0, 1, ..., q by bisection so that they have this variance.
fn gaussian(variance: f64) -> Vec<f64> {
    let n = N.max((9.0 * variance.sqrt()) as usize);
    let weights = |q: f64| -> Vec<f64> {
        let w: Vec<f64> = (0..n).map(|k| q.powi((k * k) as i32)).collect();
        let sum = 2.0 * w.iter().sum::<f64>() - 1.0;
        w.iter().map(|w| w / sum).collect()
    };
    let squares = |w: &[f64]| -> f64 {
        let each = w.iter().enumerate();
        each.map(|(k, w)| 2.0 * w * (k * k) as f64).sum()
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let q = 0.5 * (low + high);
        match squares(&weights(q)) < variance {
            true => low = q,
            false => high = q,
        }
    }
    weights(low)
}

fn response_in_depth(random: &mut Random) -> Option<f64> {
    let (collimator, _, tolerance) = camera(random);
    let radius = random.uniform(8.0, 35.0);
    let high = radius - random.uniform(0.0, 6.0);
    let low = high - random.uniform(1.0, 30.0);
    let sigma = |t: f64| collimator.variance(radius - t).sqrt();
    let response = DepthResponse::new(sigma, [low, high], tolerance).ok()?;
    let n = response.n_nodes();
    let nodes: Vec<f64> = (0..n)
        .map(|j| 0.5 * (low + high - (high - low) * (PI * (j as f64 + 0.5) / n as f64).cos()))
        .collect();
    let mut worst = 0.0_f64;
    for k in 0..40 {
        let t = match k {
            0 => low,
            1 => high,
            _ => random.any(low, high),
        };
        let factor = |j: usize| -> f64 {
            let others = (0..n).filter(|k| *k != j);
            others
                .map(|k| (t - nodes[k]) / (nodes[j] - nodes[k]))
                .product()
        };
        let mut terms: Vec<[f64; 2]> = (0..n).map(|j| [factor(j), sigma(nodes[j])]).collect();
        terms.push([-1.0, sigma(t)]);
        worst = worst.max(absolute_integral(&terms));
    }
    // 1e-13 for rounding, where the standard deviation does not depend on the depth.
    Some(worst / (response.error() + 1e-13))
}

/// 2 pi times the integral over r of `r |sum over [w, s] of w g(r; s)|`, g the Gaussian of standard deviation s in the plane: in closed form
/// between the zeros, which are found among 2000 points by bisection.
fn absolute_integral(terms: &[[f64; 2]]) -> f64 {
    let widest = terms.iter().fold(0.0_f64, |most, [_, s]| most.max(*s));
    let sum = |of: &dyn Fn(f64) -> f64| terms.iter().map(|[w, s]| w * of(*s)).sum::<f64>();
    let density = |r: f64| sum(&|s| (-0.5 * (r / s).powi(2)).exp() / (s * s));
    let outside = |r: f64| sum(&|s| (-0.5 * (r / s).powi(2)).exp());
    let at = |k: usize| 9.0 * widest * k as f64 / 2000.0;
    let (mut integral, mut last) = (0.0, outside(0.0));
    for k in 0..2000 {
        let (mut low, mut high) = (at(k), at(k + 1));
        let positive = density(low) > 0.0;
        if positive == (density(high) > 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match (density(middle) > 0.0) == positive {
                true => low = middle,
                false => high = middle,
            }
        }
        let next = outside(low);
        integral += (last - next).abs();
        last = next;
    }
    integral + last.abs()
}
