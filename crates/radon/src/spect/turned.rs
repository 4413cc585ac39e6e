//! Overlap of voxels and a grid that rotates with the camera.

use std::ops::Range;

use super::axial::Axial;
use super::blur::Blur;
use super::collimator::Collimator;
use super::geometry::SpectGeometry;
use super::overlap::Cover;
use crate::error::{RadonError, product, room, within};
use crate::{ImageGrid, Sample};

/// Cells of a rotated plane that overlap the same number of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Run {
    pub(super) plane: u32,
    /// Whether any of the pixels attenuates in any layer.
    pub(super) attenuates: bool,
    /// Pixels of each cell.
    pub(super) n_pixels: u32,
    pub(super) n_cells: u32,
}

/// Overlaps of a view.
#[derive(Debug)]
pub(super) struct View<T> {
    /// Runs of cells, nearest planes first.
    pub(super) runs: Vec<Run>,
    /// The bin of each cell.
    pub(super) bins: Vec<u32>,
    /// Pixels of all cells in order, and lengths: the overlap area of pixel and cell divided by the width of a bin. For activity it is the
    /// length along the rays; times the attenuation coefficient it is the optical thickness.
    pub(super) entries: Vec<(u32, T)>,
    /// The nodes in use.
    pub(super) used: Range<usize>,
    /// For each plane the node in front of it, counted from the first in use, and the fraction of the node behind.
    pub(super) planes: Vec<(usize, T)>,
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
    /// Prepares the planes, without bins beside the detector's.
    pub(super) fn new(
        geometry: &'a SpectGeometry,
        grid: &'a ImageGrid,
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
        Ok(Self {
            geometry,
            grid,
            n_bins: views.n_bins(),
            margin: 0,
            n_planes,
            depth,
        })
    }

    /// Adds so many bins on either side of the detector.
    pub(super) fn with_margin(mut self, margin: usize) -> Result<Self, RadonError> {
        (self.margin, self.n_bins) = (margin, self.n_bins + 2 * margin);
        let cells = product("cells of a view", self.n_planes, self.n_bins)?;
        numbered(self.n_planes, self.n_bins, cells)?;
        Ok(self)
    }

    /// Computes the cells of a view with their pixels, and the nodes of the planes; omits planes whose middle is behind the collimator
    /// face. `attenuates` is for each pixel whether any layer attenuates there; empty for none.
    pub(super) fn view<T: Sample>(
        &self,
        view: usize,
        axial: &Axial<T>,
        (collimator, blur): (&Collimator, &Blur<T>),
        attenuates: &[bool],
    ) -> Result<View<T>, RadonError> {
        let (views, n_bins) = (self.geometry.views(), self.n_bins);
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
        let nodes = |plane| {
            blur.nodes
                .fraction(self.variance(collimator, distance(plane)))
        };
        let planes: Vec<(usize, f64)> = (nearest..=farthest).map(nodes).collect();
        let ends = planes
            .iter()
            .map(|&(node, behind)| (node, node + 1 + usize::from(behind > 0.0)));
        let (first, end) = ends.fold((usize::MAX, 0), |(a, b), (c, d)| (a.min(c), b.max(d)));
        let planes = planes
            .into_iter()
            .map(|(node, behind)| (node - first, T::of(behind)));
        let (runs, bins, entries) = self.grouped(&found, nearest, attenuates);
        Ok(View {
            runs,
            bins,
            entries,
            used: first..end,
            planes: planes.collect(),
        })
    }

    /// Returns the variance of a plane at a distance from the face, averaged over the depth of the plane.
    pub(super) fn variance(&self, collimator: &Collimator, distance: f64) -> f64 {
        collimator.variance(distance) + (collimator.slope() * self.depth).powi(2) / 12.0
    }

    /// Sorts pixels by cell; planes count from the nearest one with pixels. Cells of a plane with equal numbers of pixels are adjacent,
    /// because loops of randomly varying length are slow.
    fn grouped<T: Sample>(
        &self,
        found: &[(u32, u32, f64)],
        nearest: usize,
        attenuates: &[bool],
    ) -> (Vec<Run>, Vec<u32>, Vec<(u32, T)>) {
        let n_bins = self.n_bins;
        let mut cells = vec![(false, 0_u32); self.n_planes * n_bins];
        for &(cell, pixel, _) in found {
            let (dense, count) = &mut cells[cell as usize];
            *dense |= attenuates.get(pixel as usize).is_some_and(|&a| a);
            *count += 1;
        }
        let mut order: Vec<usize> = (0..cells.len()).filter(|&cell| cells[cell].1 > 0).collect();
        order.sort_by_key(|&cell| (cell / n_bins, cells[cell]));
        let (mut runs, mut starts, mut end) = (Vec::<Run>::new(), vec![0; cells.len()], 0);
        for &cell in &order {
            let (attenuates, n_pixels) = cells[cell];
            (starts[cell], end) = (end, end + n_pixels as usize);
            let plane = (cell / n_bins - nearest) as u32;
            let run = Run {
                plane,
                attenuates,
                n_pixels,
                n_cells: 1,
            };
            match runs.last_mut() {
                Some(last)
                    if (Run {
                        n_cells: 1,
                        ..*last
                    }) == run =>
                {
                    last.n_cells += 1
                }
                _ => runs.push(run),
            }
        }
        let mut entries = vec![(0, T::ZERO); found.len()];
        for &(cell, pixel, length) in found {
            let at = &mut starts[cell as usize];
            entries[*at] = (pixel, T::of(length));
            *at += 1;
        }
        (
            runs,
            order.iter().map(|cell| (cell % n_bins) as u32).collect(),
            entries,
        )
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
