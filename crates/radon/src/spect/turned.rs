//! Overlap of voxels and a grid that rotates with the camera.

use super::axial::Axial;
use super::depth::Depths;
use super::overlap::Cover;
use super::{Collimator, SpectGeometry};
use crate::error::{RadonError, product, room, within};
use crate::{ImageGrid, Sample};

/// A cell of a rotated plane that overlaps pixels: those of the entries from the end of the previous cell to `end`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    pub(super) plane: u32,
    pub(super) bin: u32,
    pub(super) end: u32,
}

/// Overlaps of a view.
#[derive(Debug)]
pub(super) struct View<T> {
    /// Cells, nearest planes first.
    pub(super) cells: Vec<Cell>,
    /// Pixels and lengths: the overlap area of pixel and cell divided by the width of a bin. For activity it is the length along the rays;
    /// times the attenuation coefficient it is the optical thickness.
    pub(super) entries: Vec<(u32, T)>,
    pub(super) depths: Depths<T>,
}

impl<T> View<T> {
    /// The camera's image and the nodes.
    pub(super) fn n_images(&self) -> usize {
        self.depths.nodes.len() + 1
    }
}

/// The cells of a plane of bins and depths, from the camera's side of the grid to the other side.
pub(super) struct Turned<'a> {
    geometry: &'a SpectGeometry,
    grid: &'a ImageGrid,
    /// Bins of the frame, and those before the detector's.
    n_bins: usize,
    margin: usize,
    n_planes: usize,
    /// Distance between planes.
    pub(super) depth: f64,
}

impl<'a> Turned<'a> {
    /// Prepares a frame of `n_bins`, `margin` of them before the detector's.
    pub(super) fn new(
        geometry: &'a SpectGeometry,
        grid: &'a ImageGrid,
        n_bins: usize,
        margin: usize,
    ) -> Result<Self, RadonError> {
        let [dx, dy] = grid.spacing();
        let (depth, views) = (dx.min(dy), geometry.views());
        // Cells of all planes have 32-bit indices, and positions of bins have fractional bits.
        let planes = 2.0 * reach(grid) / depth;
        within("planes of a view", planes, 0.0, 1e6)?;
        let farthest = (views.offset().abs() + reach(grid)) / views.pitch();
        within("bins from the axis", farthest, 0.0, 1e9)?;
        // Same parity as the rows of pixels, so that planes do not halve them in the view at 0.
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

    /// Computes the cells of a view with their pixels, and the blur of the planes; omits planes whose middle is behind the collimator face.
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
        // Corners from the middle of a pixel, clockwise if bins increase to the right and depth upwards.
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
        // Includes the average over the depth of a plane.
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

/// Rejects more cells or overlaps than 32-bit indices can address.
fn numbered(n_planes: usize, n_bins: usize, n: usize) -> Result<(), RadonError> {
    let (what, a, b) = ("cells of a view", n_planes, n_bins);
    u32::try_from(n).map_or(Err(RadonError::TooLarge { what, a, b }), |_| Ok(()))
}

/// Returns the distance of the farthest corner of a grid from the axis of rotation.
pub(super) fn reach(grid: &ImageGrid) -> f64 {
    let ([dx, dy], [cx, cy]) = (grid.spacing(), grid.centre());
    let half = [0.5 * dx * grid.nx() as f64, 0.5 * dy * grid.ny() as f64];
    (cx.abs() + half[0]).hypot(cy.abs() + half[1])
}

/// Sorts pixels by cell; planes count from the nearest one with pixels. Cells of a plane with equal numbers of pixels are adjacent, because
/// loops of randomly varying length are slow.
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
