//! Effects of motion, few views, noise and blur on a reconstruction.

use crate::error::PhantomError;
use crate::truth::{BREATHS, MOST_IN_PASS, check_volumes, swept};
use crate::{Camera, ImageQuality, Mode, Phantom, Regions};
use radon::rmse_within;
use revolve_voxel::Mask;
use revolve_voxel::nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Smallest number of voxels of a wall region.
const FEWEST: usize = 100;
/// Number of lines on which the blur of the wall is measured.
const AZIMUTHS: usize = 16;

/// Figures of the artefacts of a reconstruction. A figure that cannot be measured is `None`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Artefacts {
    /// Root mean square difference from the ground truth more than three voxels outside the heart at all phases, where only background and
    /// organs are active.
    pub streaks_outside: Option<f64>,
    /// Coefficient of variation of the voxels that are in the wall at all phases of the projections, defects included, voxels near the
    /// surfaces excluded.
    pub wall_unevenness: Option<f64>,
    /// Average over the exact wall, weighted with its activity: `sum w f / sum w`, where `w` is the ground truth of the wall alone,
    /// averaged over the time of the projections. Includes the partial-volume effect, its only dependence on the voxel size.
    pub wall_mean: Option<f64>,
    /// The same average of the ground truth; the ratio of both is the recovery of the wall.
    pub wall_mean_truth: Option<f64>,
    /// Number of voxels of `wall_unevenness`; 0 if the wall moves by more than its thickness, or has too few voxels.
    pub wall_voxels: usize,
    /// Number of erosions of these voxels: 2, or fewer if fewer than 100 voxels would remain.
    pub wall_erosion: usize,
    /// Width of the outer edge at the apex along the axis, from 90 to 10 % of its height above the background, mm; `None` if the field of
    /// view ends before.
    pub apex_blur_mm: Option<f64>,
    /// The same at the middle of the wall's side, median over 16 azimuths, mm.
    pub wall_blur_mm: Option<f64>,
    /// Root mean square difference from the ground truth ([`Phantom::truth_of`]) within the field of view.
    pub rmse: Option<f64>,
}

impl Phantom {
    /// Returns the regions of a gate: those of [`Phantom::regions`], with wall and cavity of a gate or static scene at its own phases only.
    /// They are eroded by two voxels, or fewer if fewer than 100 voxels would remain.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; errors of the solver.
    pub fn regions_of(&self, gate: usize) -> Result<Regions, PhantomError> {
        let mut regions = self.regions()?.clone();
        if let Mode::Static { .. } | Mode::Gated { .. } = self.scene().acquisition.mode {
            let times = self.states(gate)?;
            let gains = times.iter().map(|state| state.gain).collect();
            let breaths = times.iter().map(|state| state.breath).collect();
            let gains = some_of(gains, MOST_IN_PASS);
            regions = self.regions_at(&gains, &some_of(breaths, BREATHS.len()))?;
        }
        Ok(regions)
    }

    /// Returns the regions with wall and cavity at some volumes and respiratory positions.
    pub(super) fn regions_at(
        &self,
        gains: &[f64],
        breaths: &[f64],
    ) -> Result<Regions, PhantomError> {
        let mut regions = self.regions()?.clone();
        let shapes = self.heart().shapes(gains)?;
        let poses = breaths.iter().map(|breath| self.pose(*breath));
        let poses = poses.collect::<Result<Vec<_>, _>>()?;
        let ([cavity, wall], _) = swept(&shapes, &poses, self.camera())?;
        (regions.cavity, _) = inside(cavity);
        (regions.wall, regions.wall_erosion) = inside(wall);
        Ok(regions)
    }

    /// Compares a volume of a gate with the ground truth: streaks outside the heart, unevenness of the wall, blur. Both have the voxels of
    /// [`Camera::grid`], like [`Phantom::volume`] and [`Phantom::truth`].
    ///
    /// # Errors
    /// As [`Phantom::regions_of`]; [`PhantomError::WrongLength`] for volumes of another size; [`PhantomError::OutOfRange`] for a voxel of
    /// `volume` or `truth` that is not finite.
    pub fn artefacts(
        &self,
        gate: usize,
        volume: &[f32],
        truth: &[f32],
    ) -> Result<Artefacts, PhantomError> {
        check_volumes(volume, Some(truth), self.camera().grid())?;
        let scan = self.heart_scan(gate)?;
        let [_, breath] = scan.means()?;
        let part = simd_set::part(0..1, 2);
        let wall = self.wall_alone(&scan, truth)?;
        drop(part);
        let _part = simd_set::part(1..2, 2);
        self.judged(&self.regions_of(gate)?, breath, volume, [truth, &wall])
    }

    /// Compares within given regions, at a respiratory position, with the ground truth of everything and of the wall alone.
    pub(super) fn judged(
        &self,
        regions: &Regions,
        breath: f64,
        volume: &[f32],
        [truth, wall]: [&[f32]; 2],
    ) -> Result<Artefacts, PhantomError> {
        let measures = ImageQuality::of(volume, Some(truth), regions)?;
        let shape = self.shape_at_gain(self.cycle().gains()[0])?;
        let solution = shape.solution();
        let pose = self.pose(breath.clamp(0.0, 1.0))?; // a rounded average
        let length = self.heart().length();
        let voxel = self.camera().grid().spacing()[0];
        let around = self
            .scene()
            .background
            .map_or(0.0, |around| around.concentration);
        // From the middle of the wall outwards, past the largest heart or to the edge of the field of view.
        let width = |direction: Vector3<f64>, inner: [f64; 2], outer: [f64; 2]| {
            let place = |[x, r]: [f64; 2]| Point3::new(x, r * direction.y, r * direction.z);
            let from = place([0.5 * (inner[0] + outer[0]), 0.5 * (inner[1] + outer[1])]);
            let from_lab = pose.to_lab(&from);
            let room = room(
                self.camera(),
                &from_lab,
                &(pose.to_lab(&(from + direction)) - from_lab),
            );
            let far = room.min(0.5 * length);
            if far <= 0.0 {
                return Ok(None);
            }
            let n = 2 + (4.0 * far / voxel) as usize;
            let ends = [from_lab, pose.to_lab(&(from + direction * far))];
            let line = self.camera().grid().profile(volume, ends, n)?;
            let cm = line.above(around).edge_width(0.9, 0.1);
            Ok::<_, PhantomError>(cm.map(|cm| 10.0 * cm))
        };
        let at = |s: f64| (solution.inner.at(s).position, solution.outer.at(s).position);
        let (tip, outer_tip) = at(0.5);
        let (side, outer_side) = at(self.parts.side);
        let mut widths = Vec::new();
        for k in 0..AZIMUTHS {
            let (sin, cos) = (TAU * k as f64 / AZIMUTHS as f64).sin_cos();
            widths.extend(width(Vector3::new(0.0, cos, sin), side, outer_side)?);
        }
        widths.sort_by(f64::total_cmp);
        Ok(Artefacts {
            streaks_outside: rmse_within(volume, truth, regions.background.as_slice())?,
            wall_unevenness: (measures.wall_std.zip(measures.eroded_wall_mean))
                .map(|(std, mean)| std / mean),
            wall_mean: weighted_mean(volume, wall),
            wall_mean_truth: weighted_mean(truth, wall),
            wall_voxels: regions.wall.count(),
            wall_erosion: regions.wall_erosion,
            apex_blur_mm: width(Vector3::x(), [tip[0], 0.0], [outer_tip[0], 0.0])?,
            wall_blur_mm: widths.get(widths.len() / 2).copied(),
            rmse: measures.rmse_truth,
        })
    }
}

/// Returns the distance along a line to the edge of the voxels or of the field of all views.
fn room(camera: &Camera, from: &Point3<f64>, along: &Vector3<f64>) -> f64 {
    let (grid, radius) = (camera.grid(), camera.field_radius());
    let [nx, ny, nz] = grid.shape();
    let ends = [grid.centre(0, 0, 0), grid.centre(nx - 1, ny - 1, nz - 1)];
    let mut room = f64::INFINITY;
    for a in 0..3 {
        let half = 0.5 * grid.spacing()[a];
        for (edge, outwards) in [(ends[0][a] - half, -1.0), (ends[1][a] + half, 1.0)] {
            let speed = outwards * along[a];
            let left = outwards * (edge - from[a]);
            if speed > 0.0 || left < 0.0 {
                room = room.min(left / speed.max(f64::MIN_POSITIVE));
            }
        }
    }
    // |p + t d| = R about the axis of rotation
    let (pp, pd) = (
        from.x.hypot(from.y).powi(2),
        from.x * along.x + from.y * along.y,
    );
    let dd = along.x * along.x + along.y * along.y;
    if pp > radius * radius {
        return 0.0;
    }
    if dd > 0.0 {
        room = room.min(((pd * pd + dd * (radius * radius - pp)).sqrt() - pd) / dd);
    }
    room
}

/// Returns at most so many of the distinct values in ascending order, with the smallest and the largest.
pub(super) fn some_of(mut values: Vec<f64>, most: usize) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() <= most {
        return values;
    }
    let step = (values.len() - 1) as f64 / (most - 1) as f64;
    (0..most)
        .map(|k| values[(k as f64 * step).round() as usize])
        .collect()
}

/// Returns the weighted average of the samples; `None` without weights.
fn weighted_mean(samples: &[f32], weights: &[f32]) -> Option<f64> {
    let (mut sum, mut all) = (0.0, 0.0);
    for (sample, weight) in samples.iter().zip(weights) {
        sum += f64::from(*sample) * f64::from(*weight);
        all += f64::from(*weight);
    }
    (all > 0.0).then(|| sum / all)
}

/// Erodes a mask twice, or less often to keep enough voxels; returns the number of erosions.
fn inside(mask: Mask) -> (Mask, usize) {
    for steps in [2, 1] {
        let mut eroded = mask.clone();
        eroded.erode(steps);
        if eroded.count() >= FEWEST {
            return (eroded, steps);
        }
    }
    (mask, 0)
}
