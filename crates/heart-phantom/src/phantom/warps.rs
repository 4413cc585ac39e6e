//! The motion of the heart as linear maps of volumes: from the frame of end-diastole at end-expiration to what each set of views sees.

use super::Phantom;
use crate::Wall;
use crate::error::PhantomError;
use crate::model::Reach;
use crate::scan::Lasting;
use radon::{Displaced, Warp};
use revolve_voxel::VoxelGrid;
use std::collections::BTreeMap;

/// States of a set of views are no farther apart than this share of a voxel.
const APART: f64 = 0.25;
/// Volumes, and places of the breath, that stand for what a set of views sees, at most.
const MOST_STATES: f64 = 32.0;
/// Ways of this share of the heart's length are rounding.
const AT_REST: f64 = 1e-9;
/// States of a gate as a rule, and bytes of a displacement, in a warp and before.
const STATES: f64 = 4.0;
const DISPLACEMENT_BYTES: f64 = 52.0;
/// What is so near the wall, in shares of the heart's length, goes its way.
const TAKEN_ALONG: f64 = 0.1;
/// The way is lost over so many times its length, so that nothing folds.
const LOST_OVER: f64 = 3.0;

impl Phantom {
    /// The motion from end-diastole at end-expiration to a gate, in the mean over the time that its views see, as a linear map of volumes
    /// on the camera's voxels: of a volume that stands still in that frame it makes what the gate holds.
    ///
    /// A voxel of the wall takes what its own material holds ([`Phantom::wall`], exact). What is near the wall, blood too, goes with the
    /// nearest material: all of its way within a tenth of the heart's length, less beyond, nothing at three times the longest way further.
    /// So edges of the wall keep their form, and a uniform surrounding stays; what else stands still nearby is taken along where it should
    /// not be.
    ///
    /// ```
    /// use heart_phantom::radon::LinearOperator;
    /// use heart_phantom::{Phantom, scene::{Mode, Scene}};
    /// let phantom = Phantom::new(Scene::default().with_size(32).with_mode(Mode::Gated { gates: 4 }))?;
    /// let still = phantom.activity(phantom.reference())?;
    /// let mut moved = vec![0.0f32; still.len()];
    /// phantom.warp(0)?.forward_into(&still, &mut moved)?;
    /// let off = |volume: &[f32]| phantom.truth(0).map(|truth| -> f32 { volume.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum() });
    /// assert!(off(&moved)? < 0.5 * off(&still)?);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; as [`Phantom::wall`].
    pub fn warp(&self, gate: usize) -> Result<Warp, PhantomError> {
        self.warp_on(gate, self.camera().grid())
    }

    /// The same on other voxels.
    pub(super) fn warp_on(&self, gate: usize, grid: &VoxelGrid) -> Result<Warp, PhantomError> {
        let voxel = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let still = self.wall(self.reference())?;
        let mut walls = Vec::new();
        for state in self.states(gate, APART * voxel)? {
            walls.push((state.share, self.wall_at(state.gain, state.breath)?));
        }
        let longest =
            (walls.iter()).fold(0.0f64, |most, (_, wall)| most.max(wall.longest_way(&still)));
        let whole = TAKEN_ALONG * self.heart().length();
        let none = whole + whole.max(LOST_OVER * longest);
        // What is where it was stays.
        walls.retain(|(_, wall)| wall.longest_way(&still) > AT_REST * self.heart().length());
        let motions = walls.iter().map(|(share, wall)| {
            let by = wall.displacements_around(&still, grid, Reach { whole, none })?;
            Ok(Displaced { share: *share, by })
        });
        let motions = motions.collect::<Result<Vec<_>, PhantomError>>()?;
        Ok(Warp::new(grid.shape(), grid.spacing(), &motions)?)
    }

    /// Memory that the warps of all gates take together: about as many states as a gate of a beat in sixteen has, of all that is within
    /// twice the heart's size.
    pub(super) fn bytes_of_warps(&self, grid: &VoxelGrid) -> u64 {
        let [x, r] = self.heart().rest_extent();
        let near = (2.0 * x * (4.0 * r).powi(2) / grid.voxel_volume()).min(grid.len() as f64);
        (STATES * DISPLACEMENT_BYTES * near) as u64 * self.n_gates() as u64
    }

    /// What the views of a gate see, in the mean of cells of volume and breath over which no point of the wall goes farther than that.
    fn states(&self, gate: usize, apart: f64) -> Result<Vec<Lasting>, PhantomError> {
        let times = self
            .scan(self.camera(), gate, self.acquisition(gate)?)
            .times()?;
        let range = |of: fn(&Lasting) -> f64| {
            let values = times.iter().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            })
        };
        let ranges = [range(|state| state.gain), range(|state| state.breath)];
        let [[low, high], [out, inspired]] = ranges;
        let first = self.wall_at(low, out)?;
        let cells = |other: Wall| {
            (first.longest_way(&other) / apart)
                .ceil()
                .clamp(1.0, MOST_STATES)
        };
        let cells = [
            cells(self.wall_at(high, out)?),
            cells(self.wall_at(low, inspired)?),
        ];
        let mut sums = BTreeMap::<[usize; 2], [f64; 3]>::new();
        for Lasting {
            gain,
            breath,
            share,
        } in times
        {
            let at = [0, 1].map(|k| {
                let [low, high] = ranges[k];
                let along = if high > low {
                    ([gain, breath][k] - low) / (high - low)
                } else {
                    0.0
                };
                (along * cells[k]).min(cells[k] - 1.0) as usize
            });
            let sum = sums.entry(at).or_default();
            for (sum, x) in sum.iter_mut().zip([share, share * gain, share * breath]) {
                *sum += x;
            }
        }
        let mean = |[share, gain, breath]: [f64; 3]| Lasting {
            gain: gain / share,
            breath: breath / share,
            share,
        };
        Ok(sums
            .into_values()
            .filter(|sum| sum[0] > 0.0)
            .map(mean)
            .collect())
    }
}
