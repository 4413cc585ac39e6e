//! Defects: regions of the wall with another activity, which move with the wall.

use super::material::WallRegion;
use super::twist::APEX;
use crate::error::{PhantomError, check_count};
use crate::ranges::PIECES;
use crate::scene::exactly;
use crate::{Heart, HeartShape, Twist, Wall};
use membrane_newton::NewtonOptions;
use rayon::prelude::*;
use revolve_voxel::{Pose, Sector};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Angles that differ by less are equal up to rounding of a full turn.
const NO_ANGLE: f64 = 1e-12;

/// `[[defects]]`: a region of the wall with another activity, such as an infarct, or an insert of a physical phantom.
///
/// A defect consists of the same material at every phase: it slides along the membranes with the wall and preserves its volume
/// ([`Wall::sliding_from`]). Where defects overlap, the last one replaces earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Defect {
    /// From 0, the inner membrane, to 1, the outer one: fractions of the volume of the wall.
    #[serde(deserialize_with = "exactly")]
    pub layers: [f64; 2],
    /// From 0, the base, to 0.5, the apex: material coordinate of the membranes in the reference configuration.
    #[serde(deserialize_with = "exactly")]
    pub s: [f64; 2],
    /// Degrees about the axis, from body y to body z; the second is larger, by at most 360.
    #[serde(deserialize_with = "exactly")]
    pub azimuths_degrees: [f64; 2],
    /// Activity relative to the wall: 0 for a cold defect, 1 for no defect.
    pub activity: f64,
}

impl Defect {
    /// The region, its azimuths in radians.
    pub(crate) fn region(&self) -> WallRegion {
        WallRegion {
            layers: self.layers,
            s: self.s,
            azimuths: self.azimuths_degrees.map(f64::to_radians),
        }
    }
}

impl Wall {
    /// Returns the region of a defect at this phase as a solid in the lab, with layers accurate to `tolerance` in cm, for exact line
    /// integrals and coverage.
    ///
    /// Its activity is not used. In a twisted wall the sides of the region are rotated with the material.
    ///
    /// Add the difference of the activities of region and wall to the projections of the wall. Differences of overlapping regions
    /// add.
    ///
    /// ```
    /// use heart_phantom::{Defect, Phantom, Scene};
    /// let phantom = Phantom::new(Scene::default())?;
    /// let infarct = Defect { layers: [0.0, 0.6], s: [0.3, 0.45], azimuths_degrees: [0.0, 60.0], activity: 0.0 };
    /// let [systole, diastole] = [phantom.wall(0.0)?, phantom.wall(0.5)?];
    /// let ratio = diastole.sector(&infarct, 1e-5)?.volume() / systole.sector(&infarct, 1e-5)?.volume();
    /// assert!((ratio - 1.0).abs() < 1e-4); // its activity is conserved
    /// # Ok::<(), heart_phantom::PhantomError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Wall::region`]; [`PhantomError::Solid`] for an empty range of azimuths.
    pub fn sector(&self, defect: &Defect, tolerance: f64) -> Result<Sector, PhantomError> {
        self.sector_in(&defect.region(), self.wall_twist()?, tolerance)
    }
}

/// Returns the parts of each defect that later defects do not replace, without overlap, each with the index of its defect;
/// [`PhantomError::Count`] if they are too many.
///
/// Ranges of layers, s and azimuths are boxes in material coordinates, and so are the parts that remain: nothing is approximated.
pub(crate) fn without_overlap(
    regions: impl IntoIterator<Item = WallRegion>,
) -> Result<Vec<(usize, WallRegion)>, PhantomError> {
    let mut pieces: Vec<(usize, WallRegion)> = Vec::new();
    for (k, region) in regions.into_iter().enumerate() {
        pieces = (pieces.into_iter())
            .flat_map(|(owner, piece)| {
                let rest = rest_of(&piece, &region).into_iter();
                rest.map(move |part| (owner, part))
            })
            .collect();
        pieces.push((k, region));
        let what = "pieces without overlap of the defects";
        check_count(what, pieces.len(), PIECES)?;
    }
    Ok(pieces)
}

/// Returns the part of a region outside another one; the region itself if they do not overlap.
fn rest_of(region: &WallRegion, other: &WallRegion) -> Vec<WallRegion> {
    let common = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.max(c), b.min(d)];
    let layers = common(region.layers, other.layers);
    let s = common(region.s, other.s);
    // The azimuths of the other region, shifted by whole turns to those of the region.
    let ([from, to], [start, end]) = (region.azimuths, other.azimuths);
    let turns = ((from - end) / TAU).ceil() as i64..=((to - start) / TAU).floor() as i64;
    let azimuths: Vec<[f64; 2]> = turns
        .map(|turn| [start, end].map(|angle| angle + turn as f64 * TAU))
        .map(|other| common([from, to], other))
        .filter(|[a, b]| b - a > NO_ANGLE)
        .collect();
    if layers[0] >= layers[1] || s[0] >= s[1] || azimuths.is_empty() {
        return vec![*region];
    }
    // Slabs of layers first, then of s, then of azimuths: this minimises repeated cuts.
    let mut rest = Vec::new();
    for layers in around(region.layers, layers) {
        rest.push(WallRegion { layers, ..*region });
    }
    for s in around(region.s, s) {
        rest.push(WallRegion {
            layers,
            s,
            ..*region
        });
    }
    let mut angle = from;
    for [a, b] in azimuths.into_iter().chain([[to, to]]) {
        rest.push(WallRegion {
            layers,
            s,
            azimuths: [angle, a],
        });
        angle = b;
    }
    let is_some = |region: &WallRegion| {
        let [a, b] = region.azimuths;
        region.layers[0] < region.layers[1] && region.s[0] < region.s[1] && b - a > NO_ANGLE
    };
    rest.into_iter().filter(is_some).collect()
}

/// Returns the parts of a range before and behind a part of it.
fn around([from, to]: [f64; 2], [a, b]: [f64; 2]) -> [[f64; 2]; 2] {
    [[from, a], [b, to]]
}

/// Memory of a defect per cone, if its radius is concave nowhere, and of a twisted wall per segment of its polygons; `tests/memory.rs` measures both.
const CONE_BYTES: usize = 490;
const WALL_BYTES: usize = 400;

/// Returns the tolerance of the surfaces of defects, cm: far below any detector resolution.
fn tolerance_of(heart: &Heart) -> f64 {
    1e-5 * heart.length()
}

/// Estimates the bytes of the defects of a shape from that of a volume gain, which has the most cones if it is the largest one.
pub(crate) fn bytes_of_defects(
    heart: &Heart,
    defects: &[Defect],
    is_twisted: bool,
    gain: f64,
) -> Result<usize, PhantomError> {
    let pieces = without_overlap(defects.iter().map(Defect::region))?;
    if pieces.is_empty() {
        return Ok(0);
    }
    let pair = heart.pair().solve_gain(gain, &NewtonOptions::default())?;
    let wall = Wall::polygonal(&pair, *heart.pose(), heart.tolerance())?;
    let cones = |layers, s| {
        let ring = wall.region(layers, s, tolerance_of(heart));
        ring.map(|ring| ring.n_segments())
    };
    // A twist contains the wall, which the regions share.
    let mut bytes = match is_twisted {
        true => WALL_BYTES * cones([0.0, 1.0], [0.0, APEX])?,
        false => 0,
    };
    for (_, WallRegion { layers, s, .. }) in pieces {
        bytes += CONE_BYTES * cones(layers, s)?;
    }
    Ok(bytes)
}

/// The defects of each shape as disjoint solids, with activities relative to the wall minus 1.
#[derive(Debug, Clone, Default)]
pub(crate) struct Placed {
    shapes: BTreeMap<u64, Arc<OfShape>>,
}

/// The defects of a shape in a wall with a twist, each with the index of its defect.
#[derive(Debug)]
struct OfShape {
    shape: Weak<HeartShape>,
    twist: Option<Twist>,
    sectors: Vec<(usize, Sector, f64)>,
}

impl Placed {
    /// Returns the defects of several distinct shapes. Solves the reference shape if there are defects. Those of shapes that `kept` contains are not
    /// computed again; it keeps them as long as the heart keeps their shapes.
    pub(crate) fn new(
        heart: &Heart,
        (defects, twist): (&[Defect], impl Fn(f64) -> Option<Twist> + Sync),
        shapes: &[Arc<HeartShape>],
        kept: &Mutex<Self>,
    ) -> Result<Self, PhantomError> {
        if defects.is_empty() {
            return Ok(Self::default());
        }
        let tolerance = tolerance_of(heart);
        let pieces = without_overlap(defects.iter().map(Defect::region))?;
        let wall = |shape: &HeartShape| {
            let (pair, pose) = (shape.solution(), *shape.body().pose());
            let wall = Wall::polygonal(pair, pose, heart.tolerance());
            wall.map_err(|source| PhantomError::NoMaterial {
                gain: shape.gain(),
                source: Box::new(source),
            })
        };
        let rest = wall(&*heart.reference_shape()?)?;
        let kept = || kept.lock().unwrap_or_else(PoisonError::into_inner);
        // Those of other shapes are freed before new ones are computed.
        kept().shapes.retain(|_, own| own.shape.strong_count() > 0);
        let known = kept().clone();
        let placed: Vec<Result<_, PhantomError>> = shapes
            .par_iter()
            .map(|shape| {
                simd_set::checkpoint();
                let twist = twist(shape.gain());
                let at = shape.gain().to_bits();
                let is_same = |own: &&Arc<OfShape>| {
                    Weak::as_ptr(&own.shape) == Arc::as_ptr(shape) && own.twist == twist
                };
                if let Some(own) = known.shapes.get(&at).filter(is_same) {
                    return Ok((at, own.clone()));
                }
                let mut wall = wall(shape)?.sliding_from(&rest);
                if let Some(twist) = twist.clone() {
                    wall = wall.twisted(twist);
                }
                let wall_twist = wall.wall_twist()?;
                let sector = |(owner, region): &(usize, WallRegion)| {
                    let sector = wall.sector_in(region, wall_twist.clone(), tolerance);
                    let sector = sector.map_err(|source| PhantomError::NoDefect {
                        defect: *owner,
                        gain: shape.gain(),
                        source: Box::new(source),
                    })?;
                    Ok((*owner, sector, defects[*owner].activity - 1.0))
                };
                let sectors = pieces
                    .iter()
                    .map(sector)
                    .collect::<Result<_, PhantomError>>()?;
                let shape = Arc::downgrade(shape);
                Ok((
                    at,
                    Arc::new(OfShape {
                        shape,
                        twist,
                        sectors,
                    }),
                ))
            })
            .collect();
        // The first of several errors, independent of threads.
        let shapes = placed.into_iter().collect::<Result<_, PhantomError>>()?;
        let placed = Self { shapes };
        kept().shapes.extend(placed.shapes.clone());
        Ok(placed)
    }

    /// Each with the index of its defect.
    pub(crate) fn of(&self, shape: &HeartShape) -> &[(usize, Sector, f64)] {
        self.shapes
            .get(&shape.gain().to_bits())
            .map_or(&[], |own| &own.sectors)
    }

    /// Returns the solids of each of `n` defects of a heart in a pose.
    pub(crate) fn by_defect(&self, shape: &HeartShape, n: usize, pose: Pose) -> Vec<Vec<Sector>> {
        let mut parts = vec![Vec::new(); n];
        for (owner, sector, _) in self.of(shape) {
            parts[*owner].push(sector.with_pose(pose));
        }
        parts
    }
}
