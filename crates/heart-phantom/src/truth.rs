//! What the voxels really hold, and where measures are taken.

use crate::activity::Activity;
use crate::error::PhantomError;
use crate::scan::Scan;
use crate::{Acquisition, Camera, Cycle, Heart, HeartShape};
use radon::{MaskedStats, disc_mask, rms_within, rmse_within, sum_within};
use revolve_voxel::{Mask, Meridian, Moment, Pose, Sampling, Sweep, VoxelCounters};
use std::ops::Range;
use std::sync::Arc;

/// Phases over which "at all phases" and "at any phase" are taken.
const MASK_PHASES: usize = 24;
/// Most shapes that one pass over the volume adds up, and most bytes that they take in it.
pub(crate) const MOST_IN_PASS: usize = 256;
const BYTES_OF_PASS: usize = 256 << 20;
/// Most shapes that a mean is made of: as many as the finest whole beat of a scene has.
const MOST_SHAPES: usize = 2049;

/// What an exact volume is the mean over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
pub enum TruthOf {
    /// What every view sees: a phase, a whole beat, a gate. All views see the same.
    EachView,
    /// What all views see together, each for its share: they see different parts of the beat, instants or parts of beats, so that no
    /// one heart is behind all of them.
    MeanOfViews,
}

impl TruthOf {
    /// The name of its file, without what all files of a kind have in common.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::EachView => "truth",
            Self::MeanOfViews => "truth-mean-of-views",
        }
    }
}

/// The activity of every voxel, averaged over the voxel and over the time that the views see together
/// ([`Acquisition::truth_of`]); index order `[z][y][x]`.
///
/// Covered fractions of a voxel are right to `tolerance`. Where the views see more than 2 049 shapes, as many stand for them, each
/// for neighbours in volume: of a surface that passes a voxel once each way that changes its share by a thousandth at most.
///
/// # Errors
/// As [`acquire`](crate::acquire()); [`PhantomError::Solid`] for a bad tolerance.
pub fn truth(
    heart: &Heart,
    camera: &Camera,
    cycle: &Cycle,
    acquisition: Acquisition,
    activity: impl Into<Activity>,
    tolerance: f64,
) -> Result<Vec<f32>, PhantomError> {
    let scan = Scan::plain(heart, camera, cycle, acquisition, activity.into());
    Ok(truth_of_slices(&scan, tolerance, 0..camera.n_rows())?.0)
}

/// The same for some slices only, bit for bit the cut from the whole.
pub(crate) fn truth_of_slices(
    scan: &Scan<'_>,
    tolerance: f64,
    slices: Range<usize>,
) -> Result<(Vec<f32>, VoxelCounters), PhantomError> {
    let mut volume = vec![0.0f32; scan.camera.grid().slice_len() * slices.len()];
    let counters = add_truth(scan, tolerance, slices, &mut volume)?;
    scan.no_negatives(&mut volume);
    Ok((volume, counters))
}

/// The same, added to what is there.
pub(crate) fn add_truth(
    scan: &Scan<'_>,
    tolerance: f64,
    slices: Range<usize>,
    volume: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    scan.activity.validate()?;
    let times = thinned(scan.times()?);
    let grid = scan.camera.grid();
    if let Some(background) = &scan.background {
        let concentration = background.concentration;
        (background.torso).voxelize_add(grid, slices.clone(), concentration, volume)?;
    }
    let mut counters = VoxelCounters::default();
    for part in times.chunks(in_pass(scan)) {
        counters = counters + add_shapes(scan, part, tolerance, slices.clone(), volume)?;
    }
    Ok(counters)
}

/// How many shapes one pass adds up. It does not depend on the heart's memory, so that the sums have the same bits whatever that is.
pub(crate) fn in_pass(scan: &Scan<'_>) -> usize {
    let bytes = scan.heart.shape_bytes() + finder_bytes(scan);
    (BYTES_OF_PASS / bytes).clamp(1, MOST_IN_PASS)
}

/// About how many bytes finding the surfaces of a shape in the voxels takes: for each layer cells of 24 bytes, as large as the
/// least side of a voxel, a quarter of a million at most.
pub(crate) fn finder_bytes(scan: &Scan<'_>) -> usize {
    let spacing = scan.camera.grid().spacing();
    let size = spacing.into_iter().fold(f64::INFINITY, f64::min);
    // A heart twice as large as at rest, with a margin.
    let cells: f64 = (scan.heart.rest_extent().into_iter())
        .map(|side| 2f64.sqrt() * side / size + 8.0)
        .product();
    2 * 24 * cells.min(250_000.0) as usize
}

/// Adds the shapes of some gains, each for its share of the time.
fn add_shapes(
    scan: &Scan<'_>,
    times: &[(f64, f64)],
    tolerance: f64,
    slices: Range<usize>,
    volume: &mut [f32],
) -> Result<VoxelCounters, PhantomError> {
    let (gains, weights): (Vec<f64>, Vec<f64>) = times.iter().copied().unzip();
    let shapes = scan.heart.shapes(&gains)?;
    let placed = scan.placed(&shapes)?;
    let grid = scan.camera.grid();
    let around = (scan.background).map_or(0.0, |background| background.concentration);
    let sampling = Sampling::Coverage { tolerance };
    let held: Vec<[f64; 2]> = (shapes.iter())
        .map(|shape| scan.activity.of(shape).map(|held| held - around))
        .collect();
    let moments: Vec<Moment> = (shapes.iter().zip(&held).zip(&weights))
        .map(|((shape, activity), &weight)| Moment {
            body: shape.body(),
            activity,
            weight,
        })
        .collect();
    let mut counters = Moment::voxelize_add(&moments, grid, slices.clone(), sampling, volume)?;
    for (shape, weight) in shapes.iter().zip(&weights) {
        let [_, wall] = scan.activity.of(shape);
        for (sector, factor) in placed.of(shape) {
            let difference = weight * factor * wall;
            let done = sector.voxelize_add(grid, slices.clone(), sampling, difference, volume)?;
            counters = counters + done;
        }
    }
    Ok(counters)
}

/// Gains with their shares, or where there are very many, fewer of about equal shares that stand for them.
fn thinned(mut times: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if times.len() <= MOST_SHAPES {
        return times;
    }
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut passed = 0.0;
    let group = |&(_, weight): &(f64, f64)| {
        let at = (passed * MOST_SHAPES as f64) as usize;
        passed += weight;
        at.min(MOST_SHAPES - 1)
    };
    let groups: Vec<usize> = times.iter().map(group).collect();
    let mut thinned: Vec<(usize, f64, f64)> = Vec::with_capacity(MOST_SHAPES);
    for (group, (gain, weight)) in groups.into_iter().zip(times) {
        match thinned.last_mut() {
            Some((last, moment, sum)) if *last == group => {
                *moment += weight * gain;
                *sum += weight;
            }
            _ => thinned.push((group, weight * gain, weight)),
        }
    }
    (thinned.into_iter())
        .map(|(_, moment, sum)| (moment / sum, sum))
        .collect()
}

/// The sets of voxels over which a reconstruction is judged. They do not depend on the
/// acquisition, so that its figures can be compared with another's.
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// Pixels of a slice within [`Camera::field_radius`] of the axis, `[y][x]`.
    pub disc: Vec<bool>,
    /// In the wall at all phases, eroded by two voxels.
    pub wall: Mask,
    /// In the cavity at all phases, eroded by two voxels.
    pub cavity: Mask,
    /// Within the disc and more than three voxels from what the outer membrane holds at any phase.
    pub background: Mask,
}

impl Regions {
    /// The sets for a heart that runs through `cycle`, from 24 equally spaced phases; a voxel is
    /// where its centre is.
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn new(heart: &Heart, camera: &Camera, cycle: &Cycle) -> Result<Self, PhantomError> {
        let mut gains = Self::gains(cycle);
        // The most dilated shape second: with the smallest it settles most voxels.
        let last = gains.len() - 1;
        gains.swap(last, last.min(1));
        let shapes = heart.shapes(&gains)?;
        let (always, ever) = swept(&shapes, heart.pose(), camera)?;
        let [mut cavity, mut wall] = always;
        wall.erode(2);
        cavity.erode(2);
        let disc = disc_mask(camera.image(), camera.field_radius())?;
        let mut background = ever.farther_than(3.0);
        background.intersect_slices(&disc)?;
        Ok(Self {
            disc,
            wall,
            cavity,
            background,
        })
    }

    /// The distinct volume gains of those phases, from the smallest on.
    pub(crate) fn gains(cycle: &Cycle) -> Vec<f64> {
        let phases = (0..MASK_PHASES).map(|j| j as f64 / MASK_PHASES as f64);
        let mut gains: Vec<f64> = phases.map(|phase| cycle.gain(phase)).collect();
        gains.sort_by(f64::total_cmp);
        gains.dedup();
        gains
    }
}

/// What is in the cavity and in the wall at all of some shapes, and what is in the heart at any of them.
pub(crate) fn swept(
    shapes: &[Arc<HeartShape>],
    pose: &Pose,
    camera: &Camera,
) -> Result<([Mask; 2], Mask), PhantomError> {
    let layers: Vec<&[Meridian]> = shapes.iter().map(|s| s.body().layers()).collect();
    let Sweep { always, ever, .. } = Sweep::of(&layers, pose, camera.grid())?;
    match <[Mask; 2]>::try_from(always) {
        Ok(always) => Ok((always, ever)),
        #[expect(clippy::unreachable, reason = "a heart has two layers")]
        Err(_) => unreachable!("a heart has two layers"),
    }
}

/// How a reconstruction compares with the truth and with what an ideal one would show. A measure
/// whose set is empty is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Measures {
    /// Root mean square difference from the truth within the disc, all slices.
    pub rmse_truth: Option<f64>,
    /// Mean over the wall's voxels.
    pub wall_mean: Option<f64>,
    /// Standard deviation over the wall's voxels.
    pub wall_std: Option<f64>,
    /// Root mean square over the background.
    pub background_rms: Option<f64>,
    /// Mean over the cavity's voxels.
    pub cavity_mean: Option<f64>,
    /// Sum over the disc, all slices, times the volume of a voxel.
    pub total_activity: Option<f64>,
}

impl Measures {
    /// Measures of `volume`, and against `truth` if there is one; both `[z][y][x]`.
    ///
    /// # Errors
    /// [`PhantomError::Length`] if a volume does not have the camera's number of voxels, [`PhantomError::Radon`] if the regions are
    /// another camera's.
    pub fn of(
        volume: &[f32],
        truth: Option<&[f32]>,
        regions: &Regions,
        camera: &Camera,
    ) -> Result<Self, PhantomError> {
        let expected = camera.grid().len();
        for (what, given) in [
            ("volume", Some(volume.len())),
            ("truth", truth.map(<[f32]>::len)),
        ] {
            if let Some(given) = given.filter(|&given| given != expected) {
                return Err(PhantomError::Length {
                    what,
                    given,
                    expected,
                });
            }
        }
        let within = |mask: &Mask| MaskedStats::of(volume, mask.as_slice());
        let wall = within(&regions.wall)?;
        Ok(Self {
            rmse_truth: match truth {
                Some(truth) => rmse_within(volume, truth, &regions.disc)?,
                None => None,
            },
            wall_mean: wall.map(|stats| stats.mean),
            wall_std: wall.map(|stats| stats.std),
            background_rms: rms_within(volume, regions.background.as_slice())?,
            cavity_mean: within(&regions.cavity)?.map(|stats| stats.mean),
            total_activity: sum_within(volume, &regions.disc)?
                .map(|sum| sum * camera.grid().voxel_volume()),
        })
    }
}
