//! What motion, few views, noise and blur do to a reconstruction.

use crate::error::PhantomError;
use crate::scan::{Lasting, Mode};
use crate::truth::{BREATHS, MOST_IN_PASS, swept};
use crate::{Camera, Measures, Phantom, Regions};
use revolve_voxel::Mask;
use revolve_voxel::nalgebra::{Point3, Vector3};
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Fewest voxels of a wall whose mean is worth something.
const FEWEST: usize = 100;
/// Lines on which the blur of the wall is measured; the median counts.
const AZIMUTHS: usize = 16;

/// What motion, few views or noise did to a reconstruction. A measure that cannot be taken is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Artefacts {
    /// Root mean square more than three voxels outside the heart at all phases, where nothing should be.
    pub streaks_outside: Option<f64>,
    /// Standard deviation over mean of the voxels that are in the wall at all phases that the views see, defects among them, those
    /// near its faces left out.
    pub wall_unevenness: Option<f64>,
    /// Mean over the exact wall, weighted with its activity: `sum w f / sum w`, `w` the exact volume of the wall alone, averaged over the
    /// time of the projections. Partial volume is part of it; it depends on the voxel size by that only.
    pub wall_mean: Option<f64>,
    /// The same mean of the exact volume; the ratio of both is the recovery of the wall.
    pub wall_mean_truth: Option<f64>,
    /// Number of the voxels of `wall_unevenness`; 0 if the wall moves by more than its thickness, or has too few voxels.
    pub wall_voxels: usize,
    /// How many times the outermost voxels were removed from them: 2, or less where fewer than 100 would be left.
    pub wall_erosion: usize,
    /// Width of the outer edge at the apex, from 90 to 10 % of its height above the background along the axis, mm; none where
    /// views or volume end before that.
    pub apex_blur_mm: Option<f64>,
    /// The same at the middle of the wall's side, median of 16 azimuths, mm.
    pub wall_blur_mm: Option<f64>,
    /// Root mean square difference from the truth within the field of view; from which, [`Phantom::truth_of`] tells.
    pub rmse: Option<f64>,
}

impl Phantom {
    /// The voxels over which a gate is judged: those of [`Phantom::regions`], but wall and cavity of a gate or of a static scene
    /// are what is in them at its own phases. They are eroded by two voxels, or by one or none where fewer than 100 would be
    /// left.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; what solving the shapes can return.
    pub fn regions_of(&self, gate: usize) -> Result<Regions, PhantomError> {
        let acquisition = self.acquisition(gate)?;
        let mut regions = self.regions()?.clone();
        if let Mode::Static { .. } | Mode::Gated { .. } = self.scene().acquisition.mode {
            let times = self.scan(self.camera(), gate, acquisition).times()?;
            let breaths = breaths_of(&times);
            regions = self.regions_at(&some_of(times), &breaths)?;
        }
        Ok(regions)
    }

    /// The same, wall and cavity those of some volumes at some places of the breath.
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

    /// How far the breath has come, in the mean over what the views of a gate see; 0 without one.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn mean_breath(&self, gate: usize) -> Result<f64, PhantomError> {
        let acquisition = self.acquisition(gate)?;
        if self.cycle().breathing().is_none() {
            return Ok(0.0);
        }
        let times = self.scan(self.camera(), gate, acquisition).times()?;
        Ok(times
            .iter()
            .map(|lasting| lasting.share * lasting.breath)
            .sum())
    }

    /// How a volume of a gate compares with the truth: streaks outside the heart, unevenness of the wall, blur. Both have the voxels of
    /// [`Camera::grid`], of a camera whose pixels are a region those of the region only, as [`Phantom::volume`] and [`Phantom::truth`] have.
    ///
    /// # Errors
    /// As [`Phantom::regions_of`]; [`PhantomError::WrongLength`] for a volume or a truth of another number of voxels.
    pub fn artefacts(
        &self,
        gate: usize,
        volume: &[f32],
        truth: &[f32],
    ) -> Result<Artefacts, PhantomError> {
        let breath = self.mean_breath(gate)?;
        let wall = self.wall_of_gate(gate, truth)?;
        self.judged(&self.regions_of(gate)?, breath, volume, [truth, &wall])
    }

    /// The same over some voxels, of a heart that stands where that breath has it, against the exact volume of all and of the wall alone.
    pub(super) fn judged(
        &self,
        regions: &Regions,
        breath: f64,
        volume: &[f32],
        [truth, wall]: [&[f32]; 2],
    ) -> Result<Artefacts, PhantomError> {
        let measures = Measures::of(volume, Some(truth), regions, self.camera())?;
        let shape = self.shape_at_gain(self.cycle().gains()[0])?;
        let solution = shape.solution();
        let pose = self.pose(breath)?;
        let length = self.heart().length();
        let voxel = self.camera().grid().spacing()[0];
        let around = self
            .scene()
            .background
            .map_or(0.0, |around| around.concentration);
        // From the middle of the wall outwards, past the largest heart or to where views or volume end.
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
        let (side, outer_side) = at(self.parts().side);
        let mut widths = Vec::new();
        for k in 0..AZIMUTHS {
            let (sin, cos) = (TAU * k as f64 / AZIMUTHS as f64).sin_cos();
            widths.extend(width(Vector3::new(0.0, cos, sin), side, outer_side)?);
        }
        widths.sort_by(f64::total_cmp);
        Ok(Artefacts {
            streaks_outside: measures.background_rms,
            wall_unevenness: (measures.wall_std.zip(measures.wall_mean))
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

/// How far a way goes before it leaves what all views see or the voxels hold.
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
    // |p + t d| = R about the axis that the camera turns about
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

/// The breaths, or of many as many as sweeps take: the first and the last, and others between.
fn breaths_of(times: &[Lasting]) -> Vec<f64> {
    let mut breaths: Vec<f64> = times.iter().map(|lasting| lasting.breath).collect();
    breaths.sort_by(f64::total_cmp);
    breaths.dedup();
    if breaths.len() > BREATHS.len() {
        let ends = [breaths[0], breaths[breaths.len() - 1]];
        breaths = BREATHS
            .map(|share| ends[0] + share * (ends[1] - ends[0]))
            .to_vec();
    }
    breaths
}

/// The gains, or of very many as many as one pass takes, the first and the last in volume among them.
fn some_of(times: Vec<Lasting>) -> Vec<f64> {
    // In their order, which decides what is looked at first; each once.
    let mut known = BTreeSet::new();
    let gains = times.into_iter().map(|lasting| lasting.gain);
    let mut gains: Vec<f64> = gains.filter(|gain| known.insert(gain.to_bits())).collect();
    if gains.len() > MOST_IN_PASS {
        gains.sort_by(f64::total_cmp);
        let last = (gains.len() - 1) as f64 / (MOST_IN_PASS - 1) as f64;
        gains = (0..MOST_IN_PASS)
            .map(|k| gains[(k as f64 * last).round() as usize])
            .collect();
    }
    gains
}

/// Mean of the samples with these weights; `None` without weights.
fn weighted_mean(samples: &[f32], weights: &[f32]) -> Option<f64> {
    let (mut sum, mut all) = (0.0, 0.0);
    for (sample, weight) in samples.iter().zip(weights) {
        sum += f64::from(*sample) * f64::from(*weight);
        all += f64::from(*weight);
    }
    (all > 0.0).then(|| sum / all)
}

/// A mask without its outermost voxels, and how many times these were removed: twice, or as often as leaves enough.
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
