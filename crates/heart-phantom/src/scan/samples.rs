//! From the images of a view on sub-bins to its samples, and their errors.

use super::averages::Layout;
use super::camera::Rotation;
use super::depth::{Depth, Fixed};
use super::project::{Aim, CENTRE};
use super::view_error::Errors;
use super::whole::Scan;
use crate::error::PhantomError;
use revolve_voxel::RayCounters;
use std::ops::Range;
use std::sync::Arc;

/// A view under way.
pub(super) struct Taking<'a> {
    pub(super) view_idx: usize,
    pub(super) plan: usize,
    /// In the end the view.
    pub(super) image: &'a mut [f32],
    /// The even half of the rule: the view itself, unless slabs of it are to be blurred.
    pub(super) slabs: Vec<f32>,
    /// The odd half, while there is one.
    pub(super) odd: Vec<f32>,
    /// The sub-bins that an edge crosses, `[row][bin]`, once they are known.
    pub(super) flags: Option<Arc<[bool]>>,
    pub(super) rays: RayCounters,
    /// Whether its errors are estimated.
    pub(super) look: bool,
    pub(super) errors: Errors,
}

impl Scan<'_> {
    /// Turns samples at the centres of sub-bins into averages, but for those that an edge crosses: they are flagged and become zero.
    pub(super) fn flag(
        &self,
        view: &mut Taking<'_>,
        rows: &Range<usize>,
    ) -> Result<(), PhantomError> {
        let Some(depth) = self.depth else {
            return Ok(());
        };
        let Some(averages) = &depth.sub_bins.averages else {
            return Ok(());
        };
        let seen = depth.rows_seen(rows);
        let layout = Layout {
            rows: seen.len(),
            slabs: depth.planes(view.view_idx).len() + 1,
            bins: self.camera.n_bins(),
        };
        let Taking { slabs, odd, .. } = view;
        let mut flags = layout.flags(&[slabs, odd], averages.threshold);
        if let Some(capsule) = &averages.dense {
            let theta = self.camera.angle(view.view_idx, 0.5);
            let rays = self.camera.detector().rays(theta)?.rows(seen)?;
            for (k, flag) in flags.iter_mut().enumerate() {
                let ray = rays.ray(k % layout.bins, k / layout.bins);
                *flag |= ray.is_some_and(|ray| capsule.meets(&ray));
            }
        }
        for half in [slabs, odd] {
            layout.average(half, &flags);
        }
        view.flags = Some(flags.into());
        Ok(())
    }

    /// Sums both halves of the rule, blurs, and looks at the errors.
    pub(super) fn finish(
        &self,
        view: &mut Taking<'_>,
        rows: &Range<usize>,
    ) -> Result<(), PhantomError> {
        let Taking {
            image,
            slabs,
            odd,
            errors,
            ..
        } = view;
        let (mut slabs, mut odd) = (std::mem::take(slabs), std::mem::take(odd));
        let even = match self.depth {
            None => &mut **image,
            Some(_) => &mut slabs[..],
        };
        for (even, odd) in even.iter_mut().zip(&mut odd) {
            let difference = *odd - *even;
            *even += *odd;
            *odd = difference;
        }
        let differences = match self.depth {
            None => odd,
            Some(depth) => {
                depth.view(view.view_idx, &slabs, rows, image)?;
                let mut differences = Vec::new();
                if view.look {
                    errors.depth = depth.error_of(view.view_idx, &slabs, rows, image)?;
                    errors.unblurred = depth.largest_sum(view.view_idx, &slabs);
                    if !odd.is_empty() {
                        differences = vec![0.0; image.len()];
                        depth.view(view.view_idx, &odd, rows, &mut differences)?;
                    }
                }
                if self.has_surroundings() && self.keeps_surroundings() {
                    let fixed = self.surroundings(depth, view.view_idx)?;
                    let own = &fixed.samples[rows.start * depth.n_bins()..];
                    (image.iter_mut().zip(own)).for_each(|(sample, fixed)| *sample += fixed);
                    errors.depth += fixed.error;
                    errors.unblurred += fixed.unblurred;
                }
                differences
            }
        };
        (differences.iter()).for_each(|difference| errors.add_difference(f64::from(*difference)));
        self.no_negatives(image);
        image.iter().for_each(|sample| errors.add_sample(*sample));
        Ok(())
    }

    /// Whether the surroundings of a view are the same in all gates, and kept with the sub-bins.
    pub(super) fn keeps_surroundings(&self) -> bool {
        self.depth.is_some() && self.camera.rotation() == Rotation::StepAndShoot
    }

    /// The samples of what surrounds the heart, `[row][bin]` of all rows of a view.
    fn surroundings<'b>(
        &self,
        depth: &'b Depth,
        view_idx: usize,
    ) -> Result<&'b Fixed, PhantomError> {
        let kept = &depth.fixed[view_idx];
        if let Some(fixed) = kept.get() {
            return Ok(fixed);
        }
        let rows = 0..depth.n_rows();
        let (seen, planes) = (depth.rows_seen(&rows), depth.planes(view_idx));
        let layout = Layout {
            rows: seen.len(),
            slabs: planes.len() + 1,
            bins: self.camera.n_bins(),
        };
        let aim = Aim {
            theta: self.camera.angle(view_idx, 0.0),
            planes: &planes,
            rows: &seen,
            places: CENTRE,
            mask: None,
        };
        let mut slabs = vec![0.0f32; layout.rows * layout.slabs * layout.bins];
        self.project_surroundings(&aim, 1.0, &mut slabs)?;
        if let Some(averages) = &depth.sub_bins.averages {
            let flags = layout.flags(&[&slabs], averages.threshold);
            layout.average(&mut slabs, &flags);
            let aim = Aim {
                places: &averages.lattice,
                mask: Some(&flags.into()),
                ..aim
            };
            self.project_surroundings(&aim, 1.0, &mut slabs)?;
        }
        let mut samples = vec![0.0f32; rows.len() * depth.n_bins()];
        depth.view(view_idx, &slabs, &rows, &mut samples)?;
        let fixed = Fixed {
            error: depth.error_of(view_idx, &slabs, &rows, &samples)?,
            unblurred: depth.largest_sum(view_idx, &slabs),
            samples,
        };
        // Another thread may have been first, with the same.
        Ok(kept.get_or_init(|| fixed))
    }
}
