//! Projection images (Fig. 14 of the paper) and slices of reconstructions (Fig. 15 to 17, a and b).

use super::Picture;
use super::canvas::number;
use super::raster::fit;
use super::sections::{Cut, draw};
use heart_phantom::PhantomError;

/// One projection image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection<'a> {
    /// View angle θ in radians.
    pub(crate) angle: f64,
    /// Samples `[row][bin]`: row along z from low to high, bin along s = x cos θ + y sin θ.
    pub(crate) values: &'a [f32],
}

/// A volume `[z][y][x]`, x fastest, its centre at the origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Volume<'a> {
    /// Samples, x fastest.
    pub(crate) values: &'a [f32],
    /// Numbers of voxels `[nz, ny, nx]`.
    pub(crate) size: [usize; 3],
    /// Distance between voxel centres, cm, the same along each axis.
    pub(crate) spacing: f64,
}

/// Draws panels of one size with about `target` pixels along the longer side, three in a row.
fn draw_panels(
    panels: &[Cut],
    target: usize,
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, PhantomError> {
    let [columns, rows] = panels[0].size;
    let sides = vec![fit(columns, rows, target).into(); panels.len()];
    draw(panels, &sides, window, (bar_label, ""))
}

/// Draws projection images side by side, s to the right, z up, grey from 0 to the largest value of all.
///
/// `n_bins` is the length of a row, `pitch` the distance between bins and between rows (cm), centred on the axis of the camera.
pub(crate) fn projections(
    images: &[Projection<'_>],
    n_bins: usize,
    pitch: f64,
) -> Result<Picture, PhantomError> {
    let n_rows = images[0].values.len() / n_bins;
    let most = images
        .iter()
        .flat_map(|i| i.values)
        .fold(0.0f32, |m, &v| m.max(v));
    // An empty scene is drawn black, on a bar of one centimetre.
    let high = if most > 0.0 { f64::from(most) } else { 1.0 };
    let [s, z] = [n_bins, n_rows].map(|n| 0.5 * n as f64 * pitch);
    let panels: Vec<Cut> = (images.iter())
        .map(|image| Cut {
            title: format!("θ = {}°", number(image.angle.to_degrees(), 1.0)),
            labels: ["s (cm)", "z (cm)"].map(Into::into),
            marks: Default::default(),
            size: [n_bins, n_rows],
            values: image.values.to_vec(),
            extent: [[-s, s], [-z, z]],
        })
        .collect();
    draw_panels(&panels, 384, [0.0, high], "chord (cm)")
}

/// Draws the axial slices at these indices, three in a row, x to the right, the front on top, with axes in cm and one colour bar; `window`
/// is [black, white]. A single slice is drawn larger.
pub(crate) fn slices(
    volume: &Volume<'_>,
    indices: &[usize],
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, PhantomError> {
    let [nz, ny, nx] = volume.size;
    let [x, y] = [nx, ny].map(|n| 0.5 * n as f64 * volume.spacing);
    let panel = |&k: &usize| {
        let z = (k as f64 - 0.5 * (nz as f64 - 1.0)) * volume.spacing;
        let rows = volume.values[k * ny * nx..(k + 1) * ny * nx].chunks_exact(nx);
        Cut {
            title: format!("z = {} cm", number(z, 0.01)),
            labels: ["x (cm)", "y (cm)"].map(Into::into),
            marks: Default::default(),
            size: [nx, ny],
            values: rows.rev().flatten().copied().collect(),
            extent: [[-x, x], [y, -y]],
        }
    };
    let panels: Vec<Cut> = indices.iter().map(panel).collect();
    let target = if indices.len() == 1 { 640 } else { 384 };
    draw_panels(&panels, target, window, bar_label)
}
