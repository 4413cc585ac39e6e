//! The motion of the heart as linear maps of volumes: from end-diastole at end-expiration to the state of each gate.

use super::Phantom;
use crate::Wall;
use crate::error::{PhantomError, check_count};
use crate::model::Reach;
use crate::scan::Lasting;
use radon::{Displacements, Warp, Warps};
use revolve_voxel::VoxelGrid;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest distance between neighbouring states of a gate, as a fraction of a voxel.
const APART: f64 = 0.25;
/// Largest number of states of a warp.
const MOST_STATES: f64 = 32.0;
/// Displacements below this fraction of the heart's length are rounding.
const AT_REST: f64 = 1e-9;
/// Typical number of states of a cardiac gate; bytes of a displacement in a warp and before.
const STATES: f64 = 4.0;
const DISPLACEMENT_BYTES: f64 = 52.0;
/// Surroundings within this distance of the wall follow it entirely, as a fraction of the heart's length.
const TAKEN_ALONG: f64 = 0.1;
/// The displacement vanishes over this multiple of its length, so that the map does not fold.
const LOST_OVER: f64 = 3.0;

/// A state of the wall and the fraction of a gate's time that it represents.
struct State {
    share: f64,
    wall: Wall,
}

impl Phantom {
    /// The motion from end-diastole at end-expiration to a gate, as a linear map of volumes on the camera's voxels, averaged over the
    /// acquisition time of the gate. Applied to the volume of the reference state, it gives the volume of the gate.
    ///
    /// The map is a product of at most two [warps](Warp): the beat, averaged over the cardiac gate, and respiration, averaged over the
    /// respiratory gate. Either average is formed on its own, as if cardiac and respiratory phases were independent within a gate.
    ///
    /// A voxel of the wall takes the value of its own material ([`Phantom::wall`], exact). Surroundings of the wall, including the blood,
    /// follow the nearest material: entirely within a tenth of the heart's length, less beyond, and not at all at three times the longest
    /// displacement further. So edges of the wall keep their shape and uniform surroundings stay uniform; a resting structure near the
    /// wall is displaced although it should not be.
    ///
    /// ```
    /// use heart_phantom::radon::LinearOperator;
    /// use heart_phantom::{Phantom, scene::{Mode, Scene}};
    /// let phantom = Phantom::new(Scene::default().with_size(32).with_mode(Mode::Gated { gates: 4 }))?;
    /// let still = phantom.activity(phantom.reference())?;
    /// let mut moved = vec![0.0f32; still.len()];
    /// phantom.warps(0)?.forward_into(&still, &mut moved)?;
    /// let off = |volume: &[f32]| phantom.truth(0).map(|truth| -> f32 { volume.iter().zip(truth).map(|(a, b)| (a - b).powi(2)).sum() });
    /// assert!(off(&moved)? < 0.5 * off(&still)?);
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; as [`Phantom::wall`].
    pub fn warps(&self, gate: usize) -> Result<Warps, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        let (grid, cardiac) = (self.camera().grid(), self.cardiac_gates());
        let beat = Arc::new(self.beat_warp(gate % cardiac, grid)?);
        product(&beat, self.breath_warp(gate / cardiac, grid)?.as_ref())
    }

    /// The maps of all gates on a grid; gates share their warps.
    pub(super) fn warps_of_gates(&self, grid: &VoxelGrid) -> Result<Vec<Warps>, PhantomError> {
        let cardiac = self.cardiac_gates();
        let beats = (0..cardiac)
            .map(|gate| Ok(Arc::new(self.beat_warp(gate, grid)?)))
            .collect::<Result<Vec<_>, PhantomError>>()?;
        let breaths = (0..self.n_gates() / cardiac)
            .map(|gate| self.breath_warp(gate, grid))
            .collect::<Result<Vec<_>, PhantomError>>()?;
        (0..self.n_gates())
            .map(|gate| product(&beats[gate % cardiac], breaths[gate / cardiac].as_ref()))
            .collect()
    }

    fn cardiac_gates(&self) -> usize {
        self.scene().acquisition.mode.n_gates()
    }

    /// The beat at end-expiration, averaged over a cardiac gate.
    fn beat_warp(&self, cardiac: usize, grid: &VoxelGrid) -> Result<Warp, PhantomError> {
        let gates = (cardiac..self.n_gates()).step_by(self.cardiac_gates());
        let times = self.times_of(gates)?;
        let states = self.states(
            &times,
            |state| state.gain,
            |gain| self.wall_at(gain, 0.0),
            grid,
        )?;
        self.average(&self.wall(self.reference())?, states, grid)
    }

    /// Respiration from end-expiration, averaged over a respiratory gate; `None` for a heart that it does not move.
    fn breath_warp(
        &self,
        breath: usize,
        grid: &VoxelGrid,
    ) -> Result<Option<Arc<Warp>>, PhantomError> {
        if self.cycle().breathing().is_none() {
            return Ok(None);
        }
        let cardiac = self.cardiac_gates();
        let times = self.times_of(breath * cardiac..(breath + 1) * cardiac)?;
        // The displacement is rigid: the wall only bounds what moves with it.
        let all: f64 = times.iter().map(|state| state.share).sum();
        let gain = times
            .iter()
            .map(|state| state.share * state.gain)
            .sum::<f64>()
            / all;
        let states = self.states(
            &times,
            |state| state.breath,
            |at| self.wall_at(gain, at),
            grid,
        )?;
        let warp = self.average(&self.wall_at(gain, 0.0)?, states, grid)?;
        Ok((warp.n_displacements() > 0).then(|| Arc::new(warp)))
    }

    /// The states of the heart in some gates, weighted by acquisition time.
    fn times_of(&self, gates: impl Iterator<Item = usize>) -> Result<Vec<Lasting>, PhantomError> {
        let mut all = Vec::new();
        for gate in gates {
            let seconds: f64 = self.view_times(gate)?.iter().map(|time| time.window).sum();
            // Instants have no duration.
            let weight = if seconds > 0.0 { seconds } else { 1.0 };
            let times = (self.scan(self.camera(), gate, self.acquisition(gate)?)).times()?;
            all.extend(times.into_iter().map(|state| Lasting {
                share: weight * state.share,
                ..state
            }));
        }
        Ok(all)
    }

    /// Averages of one coordinate of the motion over cells in which no point of the wall moves farther than a fraction of a voxel.
    fn states(
        &self,
        times: &[Lasting],
        of: fn(&Lasting) -> f64,
        wall: impl Fn(f64) -> Result<Wall, PhantomError>,
        grid: &VoxelGrid,
    ) -> Result<Vec<State>, PhantomError> {
        let voxel = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let [low, high] = times
            .iter()
            .map(of)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [low.min(x), high.max(x)]
            });
        let way = wall(low)?.longest_way(&wall(high)?);
        let cells = (way / (APART * voxel)).ceil().clamp(1.0, MOST_STATES);
        let mut sums = BTreeMap::<usize, [f64; 2]>::new();
        for state in times {
            let along = if high > low {
                (of(state) - low) / (high - low)
            } else {
                0.0
            };
            let sum = sums
                .entry((along * cells).min(cells - 1.0) as usize)
                .or_default();
            sum[0] += state.share;
            sum[1] += state.share * of(state);
        }
        let all: f64 = sums.values().map(|[share, _]| share).sum();
        let sums = sums.into_values().filter(|[share, _]| *share > 0.0);
        sums.map(|[share, sum]| {
            Ok(State {
                share: share / all,
                wall: wall(sum / share)?,
            })
        })
        .collect()
    }

    /// The average of the maps from a still wall to some states.
    fn average(
        &self,
        still: &Wall,
        mut states: Vec<State>,
        grid: &VoxelGrid,
    ) -> Result<Warp, PhantomError> {
        let longest = (states.iter()).fold(0.0f64, |most, at| most.max(at.wall.longest_way(still)));
        let whole = TAKEN_ALONG * self.heart().length();
        let none = whole + whole.max(LOST_OVER * longest);
        // States without displacement leave the volume unchanged.
        states.retain(|at| at.wall.longest_way(still) > AT_REST * self.heart().length());
        let motions = states.iter().map(|State { share, wall }| {
            let by = wall.displacements_around(still, grid, Reach { whole, none })?;
            Ok(Displacements {
                fraction: *share,
                by,
            })
        });
        let motions = motions.collect::<Result<Vec<_>, PhantomError>>()?;
        Ok(Warp::new(grid.shape(), grid.spacing(), &motions)?)
    }

    /// Estimated memory of the warps of all gates together: the voxels within twice the heart's size, in the states of a gate of a beat
    /// in sixteen, and in those of the whole respiratory displacement.
    pub(super) fn bytes_of_warps(&self, grid: &VoxelGrid) -> u64 {
        let [x, r] = self.heart().reference_extent();
        let near = (2.0 * x * (4.0 * r).powi(2) / grid.voxel_volume()).min(grid.len() as f64);
        let voxel = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
        let breaths = self.cycle().breathing().map_or(0.0, |breathing| {
            let shift = breathing
                .breathing()
                .shift
                .map(|x| x * x)
                .iter()
                .sum::<f64>()
                .sqrt();
            let gates = (self.n_gates() / self.cardiac_gates()) as f64;
            gates + (shift / (APART * voxel)).min(MOST_STATES * gates)
        });
        ((STATES * self.cardiac_gates() as f64 + breaths) * DISPLACEMENT_BYTES * near) as u64
    }
}

/// The beat, and then respiration where there is any.
fn product(beat: &Arc<Warp>, breath: Option<&Arc<Warp>>) -> Result<Warps, PhantomError> {
    let factors = [Some(beat), breath].into_iter().flatten().cloned();
    Ok(Warps::new(factors.collect())?)
}
