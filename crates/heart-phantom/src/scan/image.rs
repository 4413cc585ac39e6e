//! The image of one node of the quadrature over time: of the heart in one shape, or of what surrounds it.

use super::averages::Layout;
use super::camera::Rotation;
use super::depth::{Area, Depth, Fixed, Window};
use super::project::{Aim, CENTRE, Placement};
use super::whole::Scan;
use crate::error::PhantomError;
use revolve_voxel::{Body, Capsule, RayCounters};
use std::ops::Range;

/// Samples of some bins and rows, `[row][bin]`.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) area: Area,
    pub(super) samples: Vec<f32>,
    /// Differences from the samples of slabs of twice the thickness, if they were asked for and there are slabs.
    pub(super) differences: Option<Vec<f32>>,
    /// Largest value before the blur.
    pub(super) unblurred: f64,
}

/// The view of an image, from where, and whether its error of depth is estimated.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) view_idx: usize,
    pub(super) theta: f64,
    pub(super) estimated: bool,
}

impl Scan<'_> {
    /// The image of the heart in one shape without its surroundings; `None` where it is in none of the rows. `slabs` is scratch memory.
    pub(super) fn image_of_heart(
        &self,
        depth: &Depth,
        place: Place,
        rows: &Range<usize>,
        heart: Placement<'_>,
        slabs: &mut Vec<f32>,
    ) -> Result<(Option<Image>, RayCounters), PhantomError> {
        // Bounds along the bins, the rows and the rays are those of parallel rays.
        let spreads = self.background.is_some() && !self.is_background_fixed();
        let window = match spreads || self.camera.ray_geometry().is_some() {
            true => depth.everything(place.view_idx, rows)?,
            false => {
                let mut bounds = bounds(heart.1, place.theta)?;
                if self.changes_behind() {
                    bounds[2][0] = f64::NEG_INFINITY;
                }
                depth.window(place.view_idx, bounds, rows)?
            }
        };
        // Rays beside the window are skipped.
        let mut rays = RayCounters::default();
        let inside = |window: &Window| window.rows.len() * window.bins.len();
        let beside = depth
            .n_rays(rows)
            .saturating_sub(window.as_ref().map_or(0, inside));
        rays.skipped = beside as u64;
        let Some(window) = window else {
            return Ok((None, rays));
        };
        let dense = (depth.sub_bins.averages.as_ref()).and_then(|averages| averages.dense.as_ref());
        let image = self.image(depth, place, &window, dense, slabs, |aim, slabs| {
            rays = rays + self.project(heart, aim, 1.0, slabs)?;
            Ok(())
        })?;
        Ok((Some(image), rays))
    }

    /// The image of what surrounds the heart.
    pub(super) fn image_of_surroundings(
        &self,
        depth: &Depth,
        place: Place,
        rows: &Range<usize>,
    ) -> Result<Option<Image>, PhantomError> {
        let Some(window) = depth.everything(place.view_idx, rows)? else {
            return Ok(None);
        };
        let project = |aim: &Aim<'_>, slabs: &mut [f32]| self.project_surroundings(aim, 1.0, slabs);
        let slabs = &mut Vec::new();
        self.image(depth, place, &window, None, slabs, project)
            .map(Some)
    }

    fn image(
        &self,
        depth: &Depth,
        place: Place,
        window: &Window,
        dense: Option<&Capsule>,
        slabs: &mut Vec<f32>,
        mut project: impl FnMut(&Aim<'_>, &mut [f32]) -> Result<(), PhantomError>,
    ) -> Result<Image, PhantomError> {
        let planes = depth.planes(place.view_idx);
        let aim = Aim {
            view_idx: place.view_idx,
            theta: place.theta,
            planes: planes
                .get(window.slabs.start..window.slabs.end - 1)
                .unwrap_or_default(),
            bins: [window.bins.start, window.bins.end],
            rows: &window.rows,
            places: CENTRE,
            mask: None,
        };
        let layout = Layout {
            rows: window.rows.len(),
            slabs: window.slabs.len(),
            bins: window.bins.len(),
        };
        slabs.clear();
        slabs.resize(layout.rows * layout.slabs * layout.bins, 0.0);
        project(&aim, slabs)?;
        if let Some(averages) = &depth.sub_bins.averages {
            let mut flags = layout.flags(slabs, averages.threshold);
            if let Some(capsule) = dense {
                for rays in self.rays(&aim) {
                    let rays = rays?;
                    for (k, flag) in flags.iter_mut().enumerate() {
                        let ray = rays.ray(k % layout.bins, k / layout.bins);
                        *flag |= ray.is_some_and(|ray| capsule.meets(&ray));
                    }
                }
            }
            layout.average(slabs, &flags);
            let aim = Aim {
                places: &averages.lattice,
                mask: Some(&flags.into()),
                ..aim
            };
            project(&aim, slabs)?;
        }
        let samples = depth.samples(place.view_idx, window, slabs)?;
        let differences = match place.estimated {
            true => depth.differences(place.view_idx, window, (slabs, &samples))?,
            false => None,
        };
        let [sums, _] = layout.moments(slabs);
        Ok(Image {
            area: depth.area(window),
            samples,
            differences,
            unblurred: f64::from(
                sums.into_iter()
                    .fold(0.0, |most: f32, sum| most.max(sum.abs())),
            ),
        })
    }

    /// Whether the surroundings of a view are the same at all times, and kept with the response.
    pub(crate) fn keeps_surroundings(&self) -> bool {
        self.depth.is_some() && self.camera.rotation() == Rotation::StepAndShoot
    }

    /// The samples of what surrounds the heart, `[row][bin]` of all rows of a view.
    pub(super) fn surroundings<'b>(
        &self,
        depth: &'b Depth,
        view_idx: usize,
    ) -> Result<&'b Fixed, PhantomError> {
        let depth = depth.of_surroundings();
        let kept = &depth.fixed[view_idx];
        if let Some(fixed) = kept.get() {
            return Ok(fixed);
        }
        let place = Place {
            view_idx,
            theta: self.camera.angle(view_idx, 0.0),
            estimated: true,
        };
        let scan = Scan {
            camera: &depth.camera,
            ..self.clone()
        };
        let image = scan.image_of_surroundings(depth, place, &(0..depth.n_rows()))?;
        let mut samples = vec![0.0f32; depth.n_rows() * depth.n_bins()];
        let (mut error, mut unblurred) = (0.0, 0.0);
        if let Some(image) = image {
            add(
                &image.area,
                &image.samples,
                1.0,
                (&mut samples, depth.n_bins()),
            );
            let off = image.differences.iter().flatten();
            error = f64::from(off.fold(0.0, |most: f32, off| most.max(off.abs())));
            unblurred = image.unblurred;
        }
        // Another thread may have stored the same value first.
        Ok(kept.get_or_init(|| Fixed {
            samples,
            error,
            unblurred,
        }))
    }
}

/// Adds the weighted samples of some bins and rows to an image with `n_bins` bins in a row.
pub(super) fn add(area: &Area, samples: &[f32], weight: f64, (image, n_bins): (&mut [f32], usize)) {
    let rows = image.chunks_mut(n_bins).skip(area.rows.start);
    for (row, own) in rows.zip(samples.chunks(area.bins.len())) {
        for (sum, value) in row[area.bins.clone()].iter_mut().zip(own) {
            *sum += (weight * f64::from(*value)) as f32;
        }
    }
}

/// From where to where a body reaches along the bins, along the rows and along the rays of an angle.
fn bounds(body: &Body, theta: f64) -> Result<[[f64; 2]; 3], PhantomError> {
    let (sin, cos) = theta.sin_cos();
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for layer in 0..body.layers().len() {
        let corners = body.bounding_box(layer)?;
        for k in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|axis| corners[(k >> axis) & 1][axis]);
            for (bounds, at) in bounds
                .iter_mut()
                .zip([x * cos + y * sin, z, y * cos - x * sin])
            {
                *bounds = [bounds[0].min(at), bounds[1].max(at)];
            }
        }
    }
    // No bound is below a surface by rounding.
    let size = bounds
        .iter()
        .flatten()
        .fold(0.0, |most: f64, at| most.max(at.abs()));
    Ok(bounds.map(|[low, high]| [low - 1e-9 * size, high + 1e-9 * size]))
}
