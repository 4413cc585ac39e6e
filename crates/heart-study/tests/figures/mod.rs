//! Content of the figures.

mod canvas;
mod pictures;
mod polar;
mod raster;
mod render;
mod surface;
mod wall;

use std::f64::consts::PI;

use super::*;
use heart_phantom::revolve_voxel::VoxelGrid;

/// Half an ellipse [x, y] from (0, b) over the apex (a, 0) to (0, -b).
fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
    (0..=100)
        .map(|i| 0.5 * PI * (1.0 - f64::from(i) / 50.0))
        .map(|t| [a * t.cos(), b * t.sin()])
        .collect()
}

/// A soft ball of radius `r` voxels in a cube of `n`.
fn ball(n: usize, r: f64) -> Vec<f32> {
    let middle = 0.5 * (n as f64 - 1.0);
    (0..n * n * n)
        .map(|i| {
            let d: f64 = [i % n, i / n % n, i / n / n]
                .iter()
                .map(|&k| (k as f64 - middle).powi(2))
                .sum();
            (0.5 + r - d.sqrt()).clamp(0.0, 1.0) as f32
        })
        .collect()
}

/// A cube of samples about the origin.
fn cube(values: &[f32], n: usize, spacing: f64) -> Volume<'_> {
    let grid = VoxelGrid::cube(n, spacing).unwrap();
    Volume { grid, values }
}

const FRONT: View = View {
    azimuth: 0.0,
    elevation: 0.0,
};

fn iso(level: f32) -> IsoView {
    IsoView {
        level,
        view: FRONT,
        cut: None,
    }
}
