//! The motion of the heart as linear maps of volumes: from end-diastole at end-expiration to the state of each gate.

use super::Phantom;
use crate::error::{PhantomError, check_count, zeros};
use crate::model::Reach;
use crate::scan::{Lasting, shortest_side};
use radon::{Displacements, Warp, Warps};
use rayon::prelude::*;
use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Pose, VoxelGrid};
use std::ops::Range;
use std::sync::Arc;

/// Largest displacement between neighbouring values of a coordinate of the motion, as a fraction of a voxel.
const APART: f64 = 0.25;
/// Largest number of intervals between values.
const MOST_CELLS: f64 = 64.0;
/// Displacements below this fraction of the heart's length are rounding.
const AT_REST: f64 = 1e-9;
/// Typical number of values of a cardiac gate; bytes of a displacement, and of a source of a voxel in a warp.
const STATES: f64 = 4.0;
const DISPLACEMENT_BYTES: f64 = 24.0;
const SOURCE_BYTES: f64 = 10.0;
/// Surroundings within this distance of the wall follow it entirely, as a fraction of the heart's length.
const TAKEN_ALONG: f64 = 0.1;
/// The displacement vanishes over this multiple of its length, so that the map does not fold.
const LOST_OVER: f64 = 3.0;

/// A coordinate of the motion in some gates.
struct Coordinate {
    /// Values between which no point of the wall moves farther than a fraction of a voxel.
    values: Vec<f64>,
    /// For each gate the fraction of its time at each value; times in between are divided among their neighbours.
    shares: Vec<Vec<f64>>,
}

/// For some voxels, by index, the displacement to the source of their value.
type Field = Vec<(usize, [f32; 3])>;

impl Phantom {
    /// The motion from end-diastole at end-expiration to a gate, as a linear map of volumes on the camera's voxels, averaged over the
    /// acquisition time of the gate. Applied to the volume of the reference state, it gives the volume of the gate.
    ///
    /// The map is a product of at most two [warps](Warp): the beat, averaged over the cardiac gate, and respiration, averaged over the
    /// respiratory gate. Either average is formed on its own, as if cardiac and respiratory phases were independent within a gate.
    ///
    /// A voxel of the wall takes the value of its own material ([`Phantom::wall`], exact). Surroundings of the wall, including the blood,
    /// follow the nearest material: entirely within a tenth of the heart's length, less beyond, and not at all at three times the longest
    /// displacement further. So edges of the wall keep their shape and uniform surroundings stay uniform; a stationary structure near the
    /// wall is displaced although it should not be. Respiration displaces voxels rigidly; its fraction is interpolated between voxels.
    ///
    /// ```
    /// use heart_phantom::radon::LinearOperator;
    /// use heart_phantom::{Phantom, Mode, Scene};
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
        let (grid, cardiac) = (self.camera().grid(), self.n_cardiac_gates());
        let [beat, breath] = [gate % cardiac, gate / cardiac].map(|gate| gate..gate + 1);
        let beats = self.beat_warps(beat, grid)?;
        product(&beats[0], &self.breath_warps(breath, grid)?[0])
    }

    /// The maps of all gates on a grid; gates share their warps.
    pub(super) fn warps_of_gates(&self, grid: &VoxelGrid) -> Result<Vec<Warps>, PhantomError> {
        let cardiac = self.n_cardiac_gates();
        let beats = self.beat_warps(0..cardiac, grid)?;
        let breaths = self.breath_warps(0..self.n_respiratory_gates(), grid)?;
        (0..self.n_gates())
            .map(|gate| product(&beats[gate % cardiac], &breaths[gate / cardiac]))
            .collect()
    }

    /// Cardiac motion at end-expiration, averaged over some cardiac gates.
    fn beat_warps(
        &self,
        gates: Range<usize>,
        grid: &VoxelGrid,
    ) -> Result<Vec<Arc<Warp>>, PhantomError> {
        let cardiac = self.n_cardiac_gates();
        let times = (0..cardiac).map(|gate| self.times_of((gate..self.n_gates()).step_by(cardiac)));
        let times = times.collect::<Result<Vec<_>, PhantomError>>()?;
        let way = |[low, high]: [f64; 2]| {
            Ok(self
                .wall_at(low, 0.0)?
                .longest_way(&self.wall_at(high, 0.0)?))
        };
        let beat = Coordinate::new(&times, |state| state.gain, way, grid)?;
        let still = self.wall(self.reference())?;
        let walls = beat.values.iter().map(|gain| self.wall_at(*gain, 0.0));
        let walls = walls.collect::<Result<Vec<_>, PhantomError>>()?;
        let ways: Vec<f64> = walls.iter().map(|wall| wall.longest_way(&still)).collect();
        let reach = self.reach(&ways, 0.0);
        beat.warps(gates, grid, |k| {
            match ways[k] > AT_REST * self.heart().length() {
                true => walls[k].displacements_around(&still, grid, reach),
                false => Ok(Field::new()),
            }
        })
    }

    /// Respiration from end-expiration, averaged over some respiratory gates.
    fn breath_warps(
        &self,
        gates: Range<usize>,
        grid: &VoxelGrid,
    ) -> Result<Vec<Arc<Warp>>, PhantomError> {
        let cardiac = self.n_cardiac_gates();
        if self.cycle().breathing().is_none() {
            let none = Arc::new(Warp::new(grid.shape(), grid.spacing(), &[])?);
            return Ok(vec![none; gates.len()]);
        }
        let all = 0..self.n_respiratory_gates();
        let times = all.map(|gate| self.times_of(gate * cardiac..(gate + 1) * cardiac));
        let times = times.collect::<Result<Vec<_>, PhantomError>>()?;
        // The displacement is rigid; the wall only determines which voxels follow it.
        let states = || times.iter().flatten();
        let gain = states().map(|state| state.share * state.gain).sum::<f64>()
            / states().map(|state| state.share).sum::<f64>();
        let still = self.wall_at(gain, 0.0)?;
        let at = |breath: f64| Ok::<_, PhantomError>(still.clone().with_pose(self.pose(breath)?));
        let way = |[low, high]: [f64; 2]| Ok(at(low)?.longest_way(&at(high)?));
        let breaths = Coordinate::new(&times, |state| state.breath, way, grid)?;
        let walls = breaths.values.iter().map(|breath| at(*breath));
        let walls = walls.collect::<Result<Vec<_>, PhantomError>>()?;
        let ways: Vec<f64> = walls.iter().map(|wall| wall.longest_way(&still)).collect();
        // The fraction of the displacement is interpolated between voxels: all neighbours of a voxel of the wall have the full one.
        let apart = grid.spacing().map(|x| x * x).iter().sum::<f64>().sqrt();
        let reach = self.reach(&ways, apart);
        // The wall is displaced by one; voxels towards it are displaced by their fraction.
        let one = still.clone().with_pose(still.pose().shifted(Vector3::x())?);
        let mut fractions: Vec<f32> = zeros("components of the motion", grid.len())?;
        for (voxel, [x, _, _]) in still.displacements_around(&one, grid, reach)? {
            fractions[voxel] = x;
        }
        breaths.warps(gates, grid, |k| {
            match ways[k] > AT_REST * self.heart().length() {
                true => Ok(rigid(still.pose(), walls[k].pose(), &fractions, grid)),
                false => Ok(Field::new()),
            }
        })
    }

    /// The distances at which surroundings follow a wall with these longest displacements, each larger by `more`.
    fn reach(&self, ways: &[f64], more: f64) -> Reach {
        let longest = ways.iter().copied().fold(0.0, f64::max);
        let whole = TAKEN_ALONG * self.heart().length();
        let none = whole + whole.max(LOST_OVER * longest);
        Reach {
            whole: whole + more,
            none: none + more,
        }
    }

    /// The states of the heart in some gates, weighted by acquisition time.
    fn times_of(&self, gates: impl Iterator<Item = usize>) -> Result<Vec<Lasting>, PhantomError> {
        let mut all = Vec::new();
        for gate in gates {
            let seconds: f64 = self.view_times(gate)?.iter().map(|time| time.window).sum();
            // Instants have no duration.
            let weight = if seconds > 0.0 { seconds } else { 1.0 };
            let times = self.states(gate)?;
            all.extend(times.into_iter().map(|state| Lasting {
                share: weight * state.share,
                ..state
            }));
        }
        Ok(all)
    }

    /// Estimates the memory of the warps of all gates together: the voxels within twice the heart's size, with 16 sources in each cardiac gate
    /// and those along the path in each respiratory gate, and the displacements of one gate.
    pub(super) fn bytes_of_warps(&self, grid: &VoxelGrid) -> u64 {
        let [x, r] = self.heart().reference_extent();
        let near = (2.0 * x * (4.0 * r).powi(2) / grid.voxel_volume()).min(grid.len() as f64);
        let voxel = shortest_side(grid);
        let cardiac = self.n_cardiac_gates() as f64;
        let beats = cardiac * 16.0 * SOURCE_BYTES + STATES * DISPLACEMENT_BYTES;
        let breaths = self.cycle().breathing().map_or(0.0, |breathing| {
            let shift = breathing.breathing().shift.map(|x| x * x);
            let gates = self.n_respiratory_gates() as f64;
            let path = shift.iter().sum::<f64>().sqrt() / voxel / gates;
            let values = (path / APART).min(MOST_CELLS);
            gates * (8.0 + 4.0 * path) * SOURCE_BYTES + values * DISPLACEMENT_BYTES
        });
        ((beats + breaths) * near) as u64
    }
}

/// Cardiac motion, then respiration if any.
fn product(beat: &Arc<Warp>, breath: &Arc<Warp>) -> Result<Warps, PhantomError> {
    let breath = Some(breath).filter(|warp| warp.n_displacements() > 0);
    let factors = [Some(beat), breath].into_iter().flatten().cloned();
    Ok(Warps::new(factors.collect())?)
}

/// The displacement of each voxel to the position of its content when the wall was at `still`. Voxels move rigidly with the wall by their `fractions`
/// of the displacement, defined at `still`.
fn rigid(still: &Pose, moved: &Pose, fractions: &[f32], grid: &VoxelGrid) -> Field {
    let ([nx, ny, nz], first) = (grid.shape(), grid.centre(0, 0, 0));
    let fraction = |at: &Point3<f64>| {
        let [(x, right), (y, behind), (z, above)] = [0, 1, 2].map(|a| {
            let last = (grid.shape()[a] - 1) as f64;
            let at = ((at[a] - first[a]) / grid.spacing()[a]).clamp(0.0, last);
            (at as usize, at.fract() as f32)
        });
        let line = |y: usize, z: usize| {
            let row = &fractions[(z.min(nz - 1) * ny + y.min(ny - 1)) * nx..][..nx];
            row[x] + right * (row[(x + 1).min(nx - 1)] - row[x])
        };
        let plane = |z: usize| line(y, z) + behind * (line(y + 1, z) - line(y, z));
        plane(z) + above * (plane(z + 1) - plane(z))
    };
    let rows = (0..ny * nz).into_par_iter();
    let of_row = |row: usize| {
        (0..nx).filter_map(move |x| {
            let here = grid.centre(x, row % ny, row / ny);
            let source = still.to_lab(&moved.to_body(&here));
            let (way, share) = (source - here, fraction(&source));
            let by = [way.x, way.y, way.z].map(|x| share * x as f32);
            (share > 0.0).then_some((row * nx + x, by))
        })
    };
    rows.flat_map_iter(of_row).collect()
}

impl Coordinate {
    /// Divides the states of each gate among common values; `way` returns the longest displacement of the wall between two values.
    fn new(
        times: &[Vec<Lasting>],
        of: fn(&Lasting) -> f64,
        way: impl Fn([f64; 2]) -> Result<f64, PhantomError>,
        grid: &VoxelGrid,
    ) -> Result<Self, PhantomError> {
        let all = times.iter().flatten().map(of);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        });
        let voxel = shortest_side(grid);
        let cells = match high > low {
            true => (way([low, high])? / (APART * voxel))
                .ceil()
                .clamp(1.0, MOST_CELLS),
            false => 0.0,
        };
        let step = (high - low) / cells.max(1.0);
        let shares = times.iter().map(|times| {
            let all: f64 = times.iter().map(|state| state.share).sum();
            let mut shares = vec![0.0; cells as usize + 1];
            for state in times {
                let at = if step > 0.0 {
                    (of(state) - low) / step
                } else {
                    0.0
                };
                let (k, behind) = (at.min(cells) as usize, at.min(cells).fract());
                shares[k] += (1.0 - behind) * state.share / all;
                if behind > 0.0 {
                    shares[k + 1] += behind * state.share / all;
                }
            }
            shares
        });
        Ok(Self {
            shares: shares.collect(),
            values: (0..=cells as usize)
                .map(|k| low + k as f64 * step)
                .collect(),
        })
    }

    /// The averages over some gates, given the displacements at a value.
    fn warps(
        &self,
        gates: Range<usize>,
        grid: &VoxelGrid,
        by: impl Fn(usize) -> Result<Field, PhantomError>,
    ) -> Result<Vec<Arc<Warp>>, PhantomError> {
        let shares = &self.shares[gates];
        let mut fields: Vec<Option<Field>> = vec![None; self.values.len()];
        let mut warps = Vec::with_capacity(shares.len());
        for gate in 0..shares.len() {
            for (k, field) in fields.iter_mut().enumerate() {
                match field {
                    // Later gates do not need it.
                    _ if shares[gate..].iter().all(|shares| shares[k] == 0.0) => *field = None,
                    None if shares[gate][k] > 0.0 => *field = Some(by(k)?),
                    _ => (),
                }
            }
            let motions = shares[gate]
                .iter()
                .zip(&fields)
                .filter(|(share, _)| **share > 0.0);
            let motions = motions.filter_map(|(&fraction, field)| {
                field.as_deref().map(|by| Displacements { fraction, by })
            });
            let motions: Vec<_> = motions.collect();
            warps.push(Arc::new(Warp::new(grid.shape(), grid.spacing(), &motions)?));
        }
        Ok(warps)
    }
}
