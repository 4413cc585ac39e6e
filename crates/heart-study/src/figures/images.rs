//! Projection images (Fig. 14 of the paper) and slices of reconstructions (Fig. 15 to 17, a and b).

use super::canvas::number;
use super::raster::fit;
use super::sections::{Cut, Layout, draw};
use super::{Picture, check};
use crate::StudyError;
use heart_phantom::files::Section;
use heart_phantom::{check_count, check_length, check_value};
use std::f64::consts::TAU;

/// One projection image.
#[derive(Clone, Copy, Debug)]
pub struct Projection<'a> {
    /// View angle θ in radians, at most two turns.
    pub angle: f64,
    /// Samples `[row][bin]`: row along z from low to high, bin along s = x cos θ + y sin θ.
    pub values: &'a [f32],
}

/// A volume `[z][y][x]`, x fastest, its centre at the origin.
#[derive(Clone, Copy, Debug)]
pub struct Volume<'a> {
    /// Samples, x fastest.
    pub values: &'a [f32],
    /// Numbers of voxels `[nz, ny, nx]`.
    pub size: [usize; 3],
    /// Distance between voxel centres, cm, the same along each axis.
    pub spacing: f64,
}

impl Volume<'_> {
    pub(super) fn check(&self) -> Result<(), StudyError> {
        check::positive("spacing", self.spacing)?;
        let [nz, ny, nx] = self.size;
        self.size
            .iter()
            .try_for_each(|&n| check::at_least("volume size", n, 2))?;
        let expected = nz.saturating_mul(ny).saturating_mul(nx);
        check_length("volume", self.values.len(), expected)?;
        check::finite_samples("volume", self.values)
    }
}

/// Returns the name of the axis across a section, index, number of slices, then axes to the right and up with their lengths.
fn layout(
    section: Section,
    [nz, ny, nx]: [usize; 3],
) -> (&'static str, usize, usize, [(&'static str, usize); 2]) {
    match section {
        Section::Axial(k) => ("z", k, nz, [("x (cm)", nx), ("y (cm)", ny)]),
        Section::Coronal(k) => ("y", k, ny, [("x (cm)", nx), ("z (cm)", nz)]),
        Section::Sagittal(k) => ("x", k, nx, [("y (cm)", ny), ("z (cm)", nz)]),
    }
}

/// Returns the sample of a section at `column` to the right and `row` up.
fn sample(volume: &Volume<'_>, section: Section, column: usize, row: usize) -> f32 {
    let [_, ny, nx] = volume.size;
    let (z, y, x) = match section {
        Section::Axial(k) => (k, ny - 1 - row, column),
        Section::Coronal(k) => (row, k, column),
        Section::Sagittal(k) => (row, column, k),
    };
    volume.values[(z * ny + y) * nx + x]
}

const LAYOUT: Layout = Layout {
    gaps: [60, 70],
    ticks: |[width, height]| [(width.min(height) / 45).clamp(2, 9) as usize; 2],
};

/// Samples of a `[columns, rows]` centred raster; the second axis may run downwards.
fn panel(title: String, labels: [&str; 2], down: bool, size: [usize; 2], pitch: f64) -> Cut {
    let [x, y] = size.map(|n| 0.5 * n as f64 * pitch);
    Cut {
        title,
        labels: labels.map(Into::into),
        marks: Default::default(),
        size,
        values: Vec::new(),
        extent: [[-x, x], if down { [y, -y] } else { [-y, y] }],
    }
}

/// Draws panels of one size with about `target` pixels along the longer side, three in a row.
fn draw_panels(
    panels: &[Cut],
    target: usize,
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, StudyError> {
    let [columns, rows] = panels[0].size;
    let sides = vec![fit(columns, rows, target).into(); panels.len()];
    draw(panels, &sides, window, (bar_label, ""), &LAYOUT)
}

/// Draws projection images side by side, s to the right, z up, grey from 0 to the largest value of all.
///
/// `n_bins` is the length of a row, `pitch` the distance between bins and between rows (cm), centred on the axis of the camera.
///
/// # Errors
/// [`StudyError`] if there is no image, a length is not a multiple of `n_bins` or differs between images, a
/// sample is not finite, an angle exceeds two turns, or the pitch is not positive.
pub fn projections(
    images: &[Projection<'_>],
    n_bins: usize,
    pitch: f64,
) -> Result<Picture, StudyError> {
    check::at_least("projections", images.len(), 1)?;
    check::at_least("n_bins", n_bins, 2)?;
    check::positive("pitch", pitch)?;
    let n_rows = images[0].values.len() / n_bins;
    check::at_least("projection rows", n_rows, 2)?;
    for image in images {
        check_length("projection", image.values.len(), n_bins * n_rows)?;
        check::finite_samples("projection", image.values)?;
        check_value("angle in radians", image.angle, [-2.0 * TAU, 2.0 * TAU])?;
    }
    let most = images
        .iter()
        .flat_map(|i| i.values)
        .fold(0.0f32, |m, &v| m.max(v));
    // An empty scene is drawn black, on a bar of one centimetre.
    let high = if most > 0.0 { f64::from(most) } else { 1.0 };
    let panels: Vec<Cut> = (images.iter())
        .map(|image| {
            let title = format!("θ = {}°", number(image.angle.to_degrees(), 1.0));
            Cut {
                values: image.values.to_vec(),
                ..panel(title, ["s (cm)", "z (cm)"], false, [n_bins, n_rows], pitch)
            }
        })
        .collect();
    draw_panels(&panels, 384, [0.0, high], "chord (cm)")
}

/// Draws sections of one size, three in a row, with axes in cm and one colour bar; `window` is [black, white]. A single section
/// is drawn larger.
///
/// # Errors
/// [`StudyError`] if the volume's length and size disagree, a sample is not finite, the spacing is not positive, there is no section, one
/// is outside the volume, their images differ in size, or the window is not an interval.
pub fn slices(
    volume: &Volume<'_>,
    sections: &[Section],
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, StudyError> {
    volume.check()?;
    check::at_least("sections", sections.len(), 1)?;
    let [(_, n_columns), (_, n_rows)] = layout(sections[0], volume.size).3;
    let mut panels = Vec::with_capacity(sections.len());
    for &section in sections {
        let (across, index, len, [(right, columns), (up, rows)]) = layout(section, volume.size);
        check_count(across, index, [0, len - 1])?;
        check_length("columns of a slice", columns, n_columns)?;
        check_length("rows of a slice", rows, n_rows)?;
        let at = (index as f64 - 0.5 * (len as f64 - 1.0)) * volume.spacing;
        let title = format!("{across} = {} cm", number(at, 0.01));
        let down = matches!(section, Section::Axial(_));
        let row = |row| (0..n_columns).map(move |column| sample(volume, section, column, row));
        panels.push(Cut {
            values: (0..n_rows).flat_map(row).collect(),
            ..panel(
                title,
                [right, up],
                down,
                [n_columns, n_rows],
                volume.spacing,
            )
        });
    }
    let target = if sections.len() == 1 { 640 } else { 384 };
    draw_panels(&panels, target, window, bar_label)
}
