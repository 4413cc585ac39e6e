//! The voxels as a view sees them: which pixels meet which cells of a grid that is turned with the camera.

use super::axial::Axial;
use super::depth::Depths;
use super::overlap::Cover;
use super::{Collimator, SpectGeometry};
use crate::error::{RadonError, product, room, within};
use crate::{ImageGrid, Sample};

/// A place in a turned plane that meets pixels: those of the entries up to `end`, behind those of the cell before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) plane: u32,
    pub(super) bin: u32,
    pub(super) end: u32,
}

/// What a view knows of the voxels.
#[derive(Debug)]
pub(super) struct View<T> {
    /// Cells, the nearest planes first.
    pub(super) cells: Vec<Cell>,
    /// Pixels and lengths: the area in which pixel and cell overlap over the width of a bin. Alike for activity, whose length along
    /// the rays it is, and for attenuation, whose optical thickness is its product with it.
    pub(super) entries: Vec<(u32, T)>,
    pub(super) depths: Depths<T>,
}

impl<T> View<T> {
    /// The camera's image and the nodes.
    pub(super) fn n_images(&self) -> usize {
        self.depths.nodes.len() + 1
    }
}

/// Cells of a plane of bins, and of depths from the camera's side of the grid to the other.
pub(super) struct Turned<'a> {
    geometry: &'a SpectGeometry,
    grid: &'a ImageGrid,
    /// Bins of the frame, and how many of them are before the detector's.
    n_bins: usize,
    margin: usize,
    n_planes: usize,
    /// Distance between planes.
    pub(super) depth: f64,
}

impl<'a> Turned<'a> {
    /// For a frame of `n_bins`, `margin` of them before the detector's.
    pub(super) fn new(
        geometry: &'a SpectGeometry,
        grid: &'a ImageGrid,
        n_bins: usize,
        margin: usize,
    ) -> Result<Self, RadonError> {
        let [dx, dy] = grid.spacing();
        let (depth, views) = (dx.min(dy), geometry.views());
        // Cells of all planes are numbers of 32 bits, and places of bins have digits left behind the point.
        let planes = 2.0 * reach(grid) / depth;
        within("planes of a view", planes, 0.0, 1e6)?;
        let farthest = (views.offset().abs() + reach(grid)) / views.pitch();
        within("bins from the axis", farthest, 0.0, 1e9)?;
        // As even or odd as the rows of pixels, lest planes halve them in the view at 0.
        let n = planes.ceil() as usize;
        let n_planes = n + (n + grid.ny()) % 2;
        numbered(
            n_planes,
            n_bins,
            product("cells of a view", n_planes, n_bins)?,
        )?;
        Ok(Self {
            geometry,
            grid,
            n_bins,
            margin,
            n_planes,
            depth,
        })
    }

    /// The cells of a view and the pixels in them, and how planes are blurred; planes whose middle is behind the collimator's face are
    /// left out.
    pub(super) fn view<T: Sample>(
        &self,
        view: usize,
        axial: &Axial<T>,
        collimator: &Collimator,
        tolerance: f64,
    ) -> Result<View<T>, RadonError> {
        let (views, rows) = (self.geometry.views(), self.geometry.rows());
        let (pitch, n_bins) = (views.pitch(), self.n_bins);
        let top = 0.5 * self.n_planes as f64 * self.depth;
        let radius = self.geometry.radii()[view];
        let distance = |plane: usize| radius - top + (plane as f64 + 0.5) * self.depth;
        let (sin, cos) = views.angles()[view].sin_cos();
        let [dx, dy] = self.grid.spacing();
        // Corners from the middle of a pixel, clockwise for one who has bins to the right and depth upwards.
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let corners = corners.map(|(i, j)| [i * dx, j * dy]);
        let first_bin = self.margin as f64 + 0.5;

        let mut found: Vec<(u32, u32, f64)> = room("cells", self.grid.image_len(), 5)?;
        let mut cover = Cover::default();
        for pixel in 0..self.grid.image_len() {
            let (ix, iy) = (pixel % self.grid.nx(), pixel / self.grid.nx());
            let [x, y] = self.grid.pixel_centre(ix, iy);
            let pixel = axial.place(ix, iy);
            let placed = corners.map(|[i, j]| {
                let (x, y) = (x + i, y + j);
                let bin = views.bin_at(x * cos + y * sin) + first_bin;
                [bin, (top - (y * cos - x * sin)) / self.depth]
            });
            cover.cells(&placed, |[bin, plane], area| {
                let inside = (0..n_bins as i64).contains(&bin)
                    && (0..self.n_planes as i64).contains(&plane)
                    && distance(plane as usize) >= 0.0;
                if inside {
                    let cell = plane as usize * n_bins + bin as usize;
                    found.push((cell as u32, pixel as u32, area * self.depth));
                }
            });
        }
        numbered(self.n_planes, n_bins, found.len())?;
        let planes = found.iter().map(|&(cell, ..)| cell as usize / n_bins);
        let (nearest, farthest) = planes.fold((usize::MAX, 0), |(a, b), p| (a.min(p), b.max(p)));
        let nearest = nearest.min(farthest);
        // The mean over the depth of a plane, too.
        let own = (collimator.slope() * self.depth).powi(2) / 12.0;
        let variance = |plane| collimator.variance(distance(plane)) + own;
        let variances: Vec<f64> = (nearest..=farthest).map(variance).collect();
        let (cells, entries) = grouped(&found, nearest, self.n_planes, n_bins);
        Ok(View {
            cells,
            entries,
            depths: Depths::new(&variances, [pitch, rows.spacing()], tolerance)?,
        })
    }
}

/// Refuses more cells, or pixels in cells, than numbers of 32 bits.
fn numbered(n_planes: usize, n_bins: usize, n: usize) -> Result<(), RadonError> {
    let (what, a, b) = ("cells of a view", n_planes, n_bins);
    u32::try_from(n).map_or(Err(RadonError::TooLarge { what, a, b }), |_| Ok(()))
}

/// Distance of the farthest corner of a grid from the axis of rotation.
pub(super) fn reach(grid: &ImageGrid) -> f64 {
    let ([dx, dy], [cx, cy]) = (grid.spacing(), grid.centre());
    let half = [0.5 * dx * grid.nx() as f64, 0.5 * dy * grid.ny() as f64];
    (cx.abs() + half[0]).hypot(cy.abs() + half[1])
}

/// Pixels by cell, planes counted from the nearest one that has any. Cells of a plane that meet as many pixels follow each other: loops
/// over pixels whose lengths change at random cost more than the pixels.
fn grouped<T: Sample>(
    found: &[(u32, u32, f64)],
    nearest: usize,
    n_planes: usize,
    n_bins: usize,
) -> (Vec<Cell>, Vec<(u32, T)>) {
    let mut counts = vec![0; n_planes * n_bins];
    for &(cell, ..) in found {
        counts[cell as usize] += 1;
    }
    let mut order: Vec<usize> = (0..counts.len()).filter(|&cell| counts[cell] > 0).collect();
    order.sort_by_key(|&cell| (cell / n_bins, counts[cell]));
    let (mut cells, mut end) = (Vec::with_capacity(order.len()), 0);
    for cell in order {
        let start = end;
        end += counts[cell];
        counts[cell] = start;
        cells.push(Cell {
            plane: (cell / n_bins - nearest) as u32,
            bin: (cell % n_bins) as u32,
            end,
        });
    }
    let mut entries = vec![(0, T::ZERO); found.len()];
    for &(cell, pixel, length) in found {
        let at = &mut counts[cell as usize];
        entries[*at as usize] = (pixel, T::of(length));
        *at += 1;
    }
    (cells, entries)
}
