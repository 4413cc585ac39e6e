//! Voxels of organs; later ones replace earlier ones.

use std::ops::Range;

use rayon::prelude::*;

use crate::error::{finite, zeros};
use crate::images::rule::gauss;
use crate::voxels::coverage::check_range;
use crate::voxels::disc::sector_sum;
use crate::{Organ, OrganShape, Organs, RevolveError, Sample, VoxelGrid};

/// Cross-sections of an ellipsoid.
const SECTIONS: usize = 8;

impl OrganShape {
    /// Returns the covered fraction of a voxel with a centre and sides: exact for a cylinder; for an ellipsoid the average of exact
    /// cross-sections, eight at its surface.
    fn fraction(&self, centre: [f64; 3], sides: [f64; 3]) -> f64 {
        let (at, axes) = self.bounds();
        // Edges in coordinates in which the solid is the unit ball, or the unit disc at every height.
        let [x, y, z] = [0, 1, 2].map(|k| {
            let edge = |side: f64| (centre[k] - at[k] + side * sides[k]) / axes[k];
            [edge(-0.5), edge(0.5)]
        });
        let square = |far: bool, [low, high]: [f64; 2]| match far {
            true => low.abs().max(high.abs()).powi(2),
            false => low.max(-high).max(0.0).powi(2),
        };
        let distance = |far: bool| square(far, x) + square(far, y) + square(far, z);
        if distance(true) <= 1.0 {
            return 1.0;
        }
        if distance(false) >= 1.0 {
            return 0.0;
        }
        let whole = (x[1] - x[0]) * (y[1] - y[0]);
        let section = |z: f64| {
            let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            match radius > 0.0 {
                true => {
                    let [x, y] = [x, y].map(|edges| edges.map(|edge| edge / radius));
                    (radius * radius * disc_in_box(x, y) / whole).clamp(0.0, 1.0)
                }
                false => 0.0,
            }
        };
        if z[0] == z[1] {
            return section(z[0]);
        }
        let [low, high] = [z[0].max(-1.0), z[1].min(1.0)];
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let sections = gauss(SECTIONS).iter();
        let sum: f64 = sections.map(|[t, w]| w * section(middle + t * half)).sum();
        sum * half / (z[1] - z[0])
    }
}

impl Organs {
    /// Returns the average of `of(organ)` over every voxel of some slices, `[z][y][x]`; 0 outside all organs.
    ///
    /// Covered fractions of a cylinder are exact, those of an ellipsoid the average of eight exact cross-sections. If several
    /// surfaces cross one voxel, they are treated as independent: `(1 - f) v + f w`.
    ///
    /// ```
    /// use revolve_voxel::{Organ, OrganShape, Organs, VoxelGrid};
    /// let ball = OrganShape::ellipsoid([0.0; 3], [2.0; 3])?;
    /// let organs = Organs::new(vec![Organ { shape: ball, activity: 3.0, attenuation: 0.1 }])?;
    /// let grid = VoxelGrid::centred([20, 20, 20], [0.25; 3], [0.0; 3])?;
    /// let map: Vec<f64> = organs.voxelize(&grid, 0..20, |organ| organ.activity)?;
    /// let volume = map.iter().sum::<f64>() / 3.0 * 0.25_f64.powi(3);
    /// assert!((volume / (4.0 / 3.0 * std::f64::consts::PI * 8.0) - 1.0).abs() < 1e-4);
    /// # Ok::<(), revolve_voxel::RevolveError>(())
    /// ```
    ///
    /// # Errors
    /// [`RevolveError::BadRange`] for slices outside the grid; [`RevolveError::NotFinite`] for a result of `of`;
    /// [`RevolveError::TooLarge`].
    pub fn voxelize<T: Sample>(
        &self,
        grid: &VoxelGrid,
        slices: Range<usize>,
        of: impl Fn(&Organ) -> f64,
    ) -> Result<Vec<T>, RevolveError> {
        check_range(grid, &slices)?;
        let values = (self.as_slice().iter())
            .map(|organ| Ok((organ.shape, finite("value of an organ", of(organ))?)))
            .collect::<Result<Vec<_>, RevolveError>>()?;
        let ([nx, ny, _], sides) = (grid.shape(), grid.spacing());
        let mut out: Vec<T> = zeros("voxels", nx * ny * slices.len())?;
        if values.is_empty() {
            return Ok(out);
        }
        // All slices of cylinders are equal.
        let is_one = values.iter().all(|(shape, _)| shape.is_cylinder()) && !out.is_empty();
        let computed = if is_one { nx * ny } else { out.len() };
        let (first, others) = out.split_at_mut(computed);
        (first.par_chunks_mut(nx).enumerate()).for_each(|(row, voxels)| {
            simd_set::checkpoint();
            let (y, z) = (row % ny, slices.start + row / ny);
            for (x, voxel) in voxels.iter_mut().enumerate() {
                let centre = grid.centre(x, y, z).coords.into();
                let over = |under: f64, (shape, value): &(OrganShape, f64)| {
                    let fraction = shape.fraction(centre, sides);
                    under + fraction * (value - under)
                };
                *voxel = T::from_f64(values.iter().fold(0.0, over));
            }
        });
        for slice in others.chunks_mut(nx * ny) {
            slice.copy_from_slice(first);
        }
        Ok(out)
    }
}

/// Area of the unit disc within a rectangle.
fn disc_in_box(x: [f64; 2], y: [f64; 2]) -> f64 {
    let far = x[0].max(-x[1]).max(0.0).hypot(y[0].max(-y[1]).max(0.0));
    if far >= 1.0 {
        return 0.0;
    }
    if x[0].abs().max(x[1].abs()).hypot(y[0].abs().max(y[1].abs())) <= 1.0 {
        return (x[1] - x[0]) * (y[1] - y[0]);
    }
    let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
    let edges = (0..4).map(|k| sector_sum(corners[k], corners[(k + 1) % 4], 1.0));
    0.5 * edges.sum::<f64>()
}
