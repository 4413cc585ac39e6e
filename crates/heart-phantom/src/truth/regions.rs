//! Regions of interest and the image quality measured in them.

use crate::error::{PhantomError, check_finite, check_length};
use crate::{Camera, Cycle, Heart, HeartShape};
use radon::{MaskedStats, disc_mask, rmse_within};
use revolve_voxel::{Mask, Meridian, Pose, Sweep, VoxelGrid};
use std::sync::Arc;

/// Most shapes over which intersection and union of the motion are computed.
pub(crate) const MASK_PHASES: usize = 24;
/// Respiratory positions over which intersection and union are computed.
pub(crate) const BREATHS: [f64; 5] = [0.0, 1.0, 0.5, 0.25, 0.75];

/// Regions of interest ([`Phantom::regions`](crate::Phantom::regions)): sets of voxels that do not depend on the acquisition, so that
/// reconstructions are comparable.
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// The voxels.
    pub grid: VoxelGrid,
    /// Pixels of a slice within `(bins / 2 - 1) * pitch` of the axis: the disc within all views, less one bin; `[y][x]`.
    pub disc: Vec<bool>,
    /// Voxels within the wall at all phases, eroded.
    pub wall: Mask,
    /// Number of erosions, of one voxel each.
    pub wall_erosion: usize,
    /// Voxels within the cavity at all phases, eroded by two voxels.
    pub cavity: Mask,
    /// Voxels within the disc and more than three voxels outside the outer membrane at all phases.
    pub background: Mask,
}

impl Regions {
    /// Computes the regions from 24 equally spaced cardiac phases, with respiration at five positions each. A voxel belongs to a solid if
    /// its centre does.
    pub(crate) fn new(heart: &Heart, camera: &Camera, cycle: &Cycle) -> Result<Self, PhantomError> {
        let mut gains = Self::gains(cycle);
        // The smallest and the largest shape first: they decide most voxels.
        let last = gains.len() - 1;
        gains.swap(last, last.min(1));
        let shapes = heart.shapes(&gains)?;
        let breaths = match cycle.breathing() {
            None => &[0.0][..],
            Some(_) => &BREATHS,
        };
        let poses = (breaths.iter()).map(|breath| cycle.moved(heart.pose(), *breath));
        let poses = poses.collect::<Result<Vec<_>, _>>()?;
        let ([mut cavity, mut wall], ever) = swept(&shapes, &poses, camera)?;
        wall.erode(2);
        cavity.erode(2);
        let disc = disc_mask(camera.image(), camera.field_radius())?;
        let mut background = ever.farther_than(3.0);
        background.intersect_slices(&disc)?;
        Ok(Self {
            grid: *camera.grid(),
            disc,
            wall,
            wall_erosion: 2,
            cavity,
            background,
        })
    }

    /// Returns the distinct volume gains of these phases in ascending order.
    pub(crate) fn gains(cycle: &Cycle) -> Vec<f64> {
        let phases = (0..MASK_PHASES).map(|j| j as f64 / MASK_PHASES as f64);
        let mut gains: Vec<f64> = phases.map(|phase| cycle.gain(phase)).collect();
        gains.sort_by(f64::total_cmp);
        gains.dedup();
        gains
    }
}

/// Computes the intersection of cavity and of wall, and the union of the heart, over all shapes in all poses.
pub(crate) fn swept(
    shapes: &[Arc<HeartShape>],
    poses: &[Pose],
    camera: &Camera,
) -> Result<([Mask; 2], Mask), PhantomError> {
    let layers: Vec<&[Meridian]> = shapes.iter().map(|s| s.body().layers()).collect();
    let mut all: Option<([Mask; 2], Mask)> = None;
    for pose in poses {
        let sweep = Sweep::of(&layers, pose, camera.grid())?;
        #[expect(clippy::unreachable, reason = "a heart has two layers")]
        let Ok(inside) = <[Mask; 2]>::try_from(sweep.intersection) else {
            unreachable!("a heart has two layers")
        };
        match &mut all {
            None => all = Some((inside, sweep.union)),
            Some((intersection, union)) => {
                for (intersection, inside) in intersection.iter_mut().zip(&inside) {
                    intersection.intersect(inside)?;
                }
                union.unite(&sweep.union)?;
            }
        }
    }
    all.ok_or(PhantomError::Absent {
        what: "position of the heart",
    })
}

/// Checks length and values of a volume and its ground truth.
pub(crate) fn check_volumes(
    volume: &[f32],
    truth: Option<&[f32]>,
    grid: &VoxelGrid,
) -> Result<(), PhantomError> {
    let expected = grid.len();
    check_length("volume", volume.len(), expected)?;
    check_length("truth", truth.map_or(expected, <[f32]>::len), expected)?;
    check_finite("a voxel", volume)?;
    check_finite("a voxel of the ground truth", truth.unwrap_or_default())
}

/// Image quality of a reconstruction. A figure whose region is empty is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct ImageQuality {
    /// Root mean square difference from the ground truth within the disc, all slices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_truth: Option<f64>,
    /// Average over the voxels of the wall region ([`Regions::wall`]): unweighted, voxels near the surfaces excluded, in contrast to
    /// [`Artefacts::wall_mean`](crate::Artefacts::wall_mean).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eroded_wall_mean: Option<f64>,
    /// Standard deviation over the same voxels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_std: Option<f64>,
    /// Root mean square over the background.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background_rms: Option<f64>,
    /// Average over the voxels of the cavity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cavity_mean: Option<f64>,
    /// Sum over the disc, all slices, times the volume of a voxel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub total_activity: Option<f64>,
}

impl ImageQuality {
    /// Computes the figures of `volume`, with `truth` as the reference if given; both `[z][y][x]`. Regions of one gate are
    /// [`Phantom::regions_of`](crate::Phantom::regions_of).
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] if a volume has another number of voxels than the regions, [`PhantomError::OutOfRange`] for a voxel of
    /// `volume` or `truth` that is not finite.
    pub fn of(
        volume: &[f32],
        truth: Option<&[f32]>,
        regions: &Regions,
    ) -> Result<Self, PhantomError> {
        let grid = &regions.grid;
        check_volumes(volume, truth, grid)?;
        let disc = regions.disc.repeat(grid.shape()[2]);
        let within = |mask: &[bool]| MaskedStats::of(volume, mask);
        let wall = within(regions.wall.as_slice())?;
        Ok(Self {
            rmse_truth: match truth {
                Some(truth) => rmse_within(volume, truth, &disc)?,
                None => None,
            },
            eroded_wall_mean: wall.map(|stats| stats.mean),
            wall_std: wall.map(|stats| stats.std),
            background_rms: within(regions.background.as_slice())?.map(|stats| stats.rms),
            cavity_mean: within(regions.cavity.as_slice())?.map(|stats| stats.mean),
            total_activity: within(&disc)?.map(|stats| stats.sum * grid.voxel_volume()),
        })
    }
}
