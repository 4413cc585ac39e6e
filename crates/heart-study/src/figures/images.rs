//! Projections (Fig. 14 of the paper) and slices of reconstructions (Fig. 15 to 17, a and b) as planes.

use super::Picture;
use super::canvas::number;
use super::raster::fit;
use super::sections::{Cut, draw};
use super::volume::{Volume, edges};
use heart_phantom::{Camera, PhantomError};

/// Returns a projection `[row][bin]` as a plane with s to the right and z up.
pub(crate) fn projection(title: String, camera: &Camera, values: &[f32]) -> Cut {
    let size = [camera.n_bins(), camera.n_rows()];
    let pitch = camera.detector().pitch();
    let extent = [0, 1].map(|a| {
        let half = 0.5 * size[a] as f64 * pitch[a];
        [-half, half]
    });
    Cut {
        title,
        labels: ["s (cm)", "z (cm)"].map(Into::into),
        marks: Default::default(),
        size,
        values: values.to_vec(),
        extent,
    }
}

/// Returns the axial slice at an index as a plane with x to the right and the front on top.
pub(crate) fn slice(volume: &Volume<'_>, k: usize) -> Cut {
    let [nx, ny, _] = volume.grid.shape();
    let [x, [back, front], _] = edges(&volume.grid);
    let z = volume.grid.centre(0, 0, k).z;
    let rows = volume.values[k * ny * nx..(k + 1) * ny * nx].chunks_exact(nx);
    Cut {
        title: format!("z = {} cm", number(z, 0.01)),
        labels: ["x (cm)", "y (cm)"].map(Into::into),
        marks: Default::default(),
        size: [nx, ny],
        values: rows.rev().flatten().copied().collect(),
        extent: [x, [front, back]],
    }
}

/// Draws planes of one size, three in a row, with a whole number of pixels per sample if at least two fit; `window` is [black, white].
/// A single plane is drawn larger.
pub(crate) fn images(
    cuts: &[Cut],
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, PhantomError> {
    let target = if cuts.len() == 1 { 640 } else { 384 };
    let sides = vec![fit(cuts[0].size, target); cuts.len()];
    draw(cuts, &sides, window, (bar_label, ""))
}
