//! The error of the nodes: of the distribution of points to them, and of the cubics between them.

use crate::camera::Grid;

/// Standard errors of a node below which its difference from the neighbours is noise.
const NOISE: f64 = 5.0;
/// Ratio of the differences at one and at two pitches: up to the first number images are smooth (1/16 in the limit), from the second on they may
/// contain point sources (0.28 to 1).
const SMOOTH: f64 = 0.15;
const SHARP: f64 = 0.25;

/// Error over the sum of the differences at the four nodes around a bin, of smooth images and where these may have edges or point sources. `narrow`
/// is the standard deviation of the response at the face, `own` at the nearest emission, in pitches. The factors are upper bounds for analytic images
/// at all places between the nodes. Those of a point source, whose projected fluence is inversely proportional to the distance, are 0.75 at a width
/// of 0.3, 0.46 at 0.4, 0.21 at 0.6 and 0.8, 0.15 at 1 and 0.09 from 1.2 on; those of an edge 0.52 at 0.1 and 0.21 at 0.4.
fn factors(narrow: f64, own: f64) -> [f64; 2] {
    let smooth = (0.17 / narrow.powi(2)).clamp(0.1, 0.25);
    let (edge, point) = (0.6 - 0.9 * narrow, 0.42 / own - 0.45);
    [smooth, smooth.max(edge).max(point)]
}

/// Estimates an upper bound on the error of the nodes, without noise, in all bins; `nearest` is the smallest distance of an emission from a face.
pub(crate) fn smoothing(grid: &Grid, nearest: f64, images: &[f64], errors: &[f64]) -> f64 {
    let [rows, columns] = grid.used();
    let [nx, nz] = grid.size;
    let [smooth, sharp] = factors(grid.width(0.0), grid.width(nearest));
    let mut most = 0.0f64;
    let mut differences = vec![[0.0; 3]; nx * nz];
    for (image, errors) in images.chunks(nx * nz).zip(errors.chunks(nx * nz)) {
        // Difference from the cubics through four neighbours along both axes.
        let off = |at: usize, step: usize| {
            let [across, along] = [step, step * nx].map(|step| {
                let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| image[at + k * step - 2 * step]);
                (c - (4.0 * (b + d) - (a + e)) / 6.0).abs()
            });
            across + along
        };
        let nodes = rows
            .clone()
            .map(|row| row * nx + columns.start..row * nx + columns.end);
        for at in nodes.clone().flatten() {
            differences[at] = [off(at, 1), off(at, 2), errors[at]];
        }
        for at in nodes
            .take(rows.len() - 1)
            .flat_map(|row| row.start..row.end - 1)
        {
            let four = [at, at + 1, at + nx, at + nx + 1].map(|at| differences[at]);
            let [near, far, error] =
                [0, 1, 2].map(|k| four.iter().map(|node| node[k]).sum::<f64>());
            let near = near.min(2.0 * (near - NOISE * error));
            if near > 0.0 {
                let share = ((near / far - SMOOTH) / (SHARP - SMOOTH)).clamp(0.0, 1.0);
                most = most.max(near * (smooth + share * (sharp - smooth)));
            }
        }
    }
    most
}
