//! A SPECT camera by its definition: cells by polygon clipping, a separate blur of every depth plane.

use radon::{Collimator, ImageGrid, SliceAxis, SpectGeometry};

pub(crate) struct PlainCamera<'a> {
    pub(crate) geometry: &'a SpectGeometry,
    pub(crate) grid: &'a ImageGrid,
    pub(crate) layers: &'a SliceAxis,
    pub(crate) collimator: Collimator,
    /// Empty without attenuation.
    pub(crate) attenuation: &'a [f64],
}

impl PlainCamera<'_> {
    /// The views `[view][row][bin]` of a volume `[layer][y][x]`.
    pub(crate) fn views(&self, volume: &[f64]) -> Vec<f64> {
        let n = 0..self.geometry.views().n_views();
        n.flat_map(|view| self.view(view, volume)).collect()
    }

    fn view(&self, view: usize, volume: &[f64]) -> Vec<f64> {
        let (views, rows) = (self.geometry.views(), self.geometry.rows());
        let (theta, radius) = (views.angles()[view], self.geometry.radii()[view]);
        let [dx, dy] = self.grid.spacing();
        let depth = dx.min(dy);
        let corner = |i: usize, j: usize| {
            let half = [
                0.5 * dx * self.grid.nx() as f64,
                0.5 * dy * self.grid.ny() as f64,
            ];
            let [cx, cy] = self.grid.centre();
            (cx.abs() + [half[0], -half[0]][i]).hypot(cy.abs() + [half[1], -half[1]][j])
        };
        let reach = corner(0, 0).max(corner(0, 1)).max(corner(1, 0));
        let n_planes = (2.0 * reach / depth).ceil() as usize;
        let n_planes = n_planes + (n_planes + self.grid.ny()) % 2;
        // Six standard deviations of the widest blur on either side.
        let widest = self.collimator.sigma(radius + reach);
        let margin = [views.pitch(), rows.spacing()].map(|p| (6.0 * widest / p).ceil() as usize);
        let (nb, nr) = (
            views.n_bins() + 2 * margin[0],
            rows.n_slices() + 2 * margin[1],
        );
        let bin = |b: usize| views.bin_centre(0) + (b as f64 - margin[0] as f64) * views.pitch();
        let row = |r: usize| rows.slice_centre(0) + (r as f64 - margin[1] as f64) * rows.spacing();

        let mut image = vec![0.0; nb * nr];
        let mut passed = vec![1.0; nb * nr];
        for plane in 0..n_planes {
            let t = (0.5 * (n_planes as f64 - 1.0) - plane as f64) * depth;
            let distance = radius - t;
            if distance < 0.0 {
                continue;
            }
            let mut emitted = vec![0.0; nb * nr];
            for b in 0..nb {
                let parts = self.pixels_in(theta, bin(b), views.pitch(), t, depth);
                for r in 0..nr {
                    let (mut activity, mut thickness) = (0.0, 0.0);
                    for layer in 0..self.layers.n_slices() {
                        let z = self.layers.slice_centre(layer);
                        let half = 0.5 * self.layers.spacing();
                        let (low, high) =
                            (row(r) - 0.5 * rows.spacing(), row(r) + 0.5 * rows.spacing());
                        let part =
                            ((z + half).min(high) - (z - half).max(low)).max(0.0) / rows.spacing();
                        if part == 0.0 {
                            continue;
                        }
                        for &(pixel, length) in &parts {
                            let voxel = layer * self.grid.image_len() + pixel;
                            activity += part * length * volume[voxel];
                            if !self.attenuation.is_empty() {
                                thickness += part * length * self.attenuation[voxel];
                            }
                        }
                    }
                    let own = if thickness > 0.0 {
                        -(-thickness).exp_m1() / thickness
                    } else {
                        1.0
                    };
                    emitted[r * nb + b] = activity * own * passed[r * nb + b];
                    passed[r * nb + b] *= (-thickness).exp();
                }
            }
            if emitted.iter().all(|&x| x == 0.0) {
                continue;
            }
            let own = (self.collimator.slope() * depth).powi(2) / 12.0;
            let variance = self.collimator.variance(distance) + own;
            let across = gaussian(variance / views.pitch().powi(2));
            let along = gaussian(variance / rows.spacing().powi(2));
            let mut turned = vec![0.0; nb * nr];
            for r in 0..nr {
                for b in 0..nb {
                    turned[r * nb + b] = weighted(&across, b, nb, |b| emitted[r * nb + b]);
                }
            }
            for r in 0..nr {
                for b in 0..nb {
                    image[r * nb + b] += weighted(&along, r, nr, |r| turned[r * nb + b]);
                }
            }
        }
        let rows = margin[1]..nr - margin[1];
        rows.flat_map(|r| image[r * nb + margin[0]..(r + 1) * nb - margin[0]].to_vec())
            .collect()
    }

    /// Pixels that overlap a cell about (s, t), with the area over the width of a bin.
    fn pixels_in(&self, theta: f64, s: f64, pitch: f64, t: f64, depth: f64) -> Vec<(usize, f64)> {
        let (sin, cos) = theta.sin_cos();
        let [dx, dy] = self.grid.spacing();
        let mut parts = Vec::new();
        for pixel in 0..self.grid.image_len() {
            let [x, y] = self
                .grid
                .pixel_centre(pixel % self.grid.nx(), pixel / self.grid.nx());
            let mut polygon: Vec<[f64; 2]> = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
                .iter()
                .map(|(i, j)| [x + i * dx, y + j * dy])
                .map(|[x, y]| [x * cos + y * sin - s, y * cos - x * sin - t])
                .collect();
            for (axis, half) in [(0, 0.5 * pitch), (1, 0.5 * depth)] {
                for sign in [1.0, -1.0] {
                    polygon = clipped(&polygon, |p| half - sign * p[axis]);
                }
            }
            let area: f64 = (0..polygon.len())
                .map(|k| (polygon[k], polygon[(k + 1) % polygon.len()]))
                .map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0]))
                .sum();
            if area > 0.0 {
                parts.push((pixel, area / pitch));
            }
        }
        parts
    }
}

/// The part of a convex polygon where `inside` is positive (Sutherland and Hodgman).
fn clipped(polygon: &[[f64; 2]], inside: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for k in 0..polygon.len() {
        let (p, q) = (polygon[k], polygon[(k + 1) % polygon.len()]);
        let (a, b) = (inside(p), inside(q));
        if a >= 0.0 {
            out.push(p);
        }
        if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
            let share = a / (a - b);
            out.push([0, 1].map(|i| p[i] + share * (q[i] - p[i])));
        }
    }
    out
}

/// Weights w_k of k = 0, 1, ...: proportional to q^(k^2), q by bisection for the given variance.
pub(crate) fn gaussian(variance: f64) -> Vec<f64> {
    if variance == 0.0 {
        return vec![1.0];
    }
    let n = (8.0 * variance.sqrt()).ceil() as usize + 2;
    let weights = |q: f64| -> Vec<f64> {
        let w: Vec<f64> = (0..n).map(|k| q.powi((k * k) as i32)).collect();
        let sum = 2.0 * w.iter().sum::<f64>() - w[0];
        w.iter().map(|w| w / sum).collect()
    };
    let found = |w: &[f64]| -> f64 {
        w.iter()
            .enumerate()
            .map(|(k, w)| 2.0 * w * (k * k) as f64)
            .sum()
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..200 {
        let q = 0.5 * (low + high);
        if found(&weights(q)) < variance {
            low = q;
        } else {
            high = q;
        }
    }
    weights(low)
}

fn weighted(weights: &[f64], at: usize, n: usize, of: impl Fn(usize) -> f64) -> f64 {
    let mut sum = weights[0] * of(at);
    for (k, w) in weights.iter().enumerate().skip(1) {
        if at >= k {
            sum += w * of(at - k);
        }
        if at + k < n {
            sum += w * of(at + k);
        }
    }
    sum
}
