//! Pieces of the wall that take up more or less than the rest of it, and move with it.

use crate::error::{PhantomError, check_count};
use crate::ranges::PIECES;
use crate::{Heart, HeartShape, Wall, WallRegion};
use rayon::prelude::*;
use revolve_voxel::Sector;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Angles that differ by less are equal but for the rounding of a turn.
const NO_ANGLE: f64 = 1e-12;

/// A piece of the wall with another activity, as an infarct, or an insert of a physical phantom.
///
/// It is made of the same material at every phase: it slides along the membranes with the wall and keeps its volume
/// ([`Wall::sliding`]). Where defects overlap, the last one replaces those before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defect {
    /// The piece, in the material coordinates of the wall at rest.
    pub region: WallRegion,
    /// Its activity in units of the wall's: 0 for a cold defect, 1 for none.
    pub activity: f64,
}

/// What is left of each defect by those after it, as pieces that do not overlap, each with the number of its defect;
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

/// What of a region lies outside another one: itself, as it is, if they do not overlap.
fn rest_of(region: &WallRegion, other: &WallRegion) -> Vec<WallRegion> {
    let common = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.max(c), b.min(d)];
    let layers = common(region.layers, other.layers);
    let s = common(region.s, other.s);
    // The other one's azimuths, by as many whole turns as bring them to those of the region.
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
    // First whole slabs of layers, then of s, then of azimuths: the fewest sides are cut twice.
    let mut rest = Vec::new();
    let [below, above] = around(region.layers, layers);
    for layers in [below, above] {
        rest.push(WallRegion { layers, ..*region });
    }
    let [before, behind] = around(region.s, s);
    for s in [before, behind] {
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

/// What of a range lies before and behind a part of it.
fn around([from, to]: [f64; 2], [a, b]: [f64; 2]) -> [[f64; 2]; 2] {
    [[from, a], [b, to]]
}

/// The defects of each shape as solids that do not overlap, with the activity that they add to the wall's, which is 1.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    shapes: BTreeMap<u64, Vec<(Sector, f64)>>,
    /// The number of the defect that each solid is a part of.
    owners: Vec<usize>,
}

impl Placed {
    /// The defects in each of some distinct shapes, drawn to `tolerance` cm. Solves the shape at rest, if there are any defects.
    pub(crate) fn new(
        heart: &Heart,
        defects: &[Defect],
        tolerance: f64,
        shapes: &[Arc<HeartShape>],
    ) -> Result<Self, PhantomError> {
        if defects.is_empty() {
            return Ok(Self::default());
        }
        let pieces = without_overlap(defects.iter().map(|defect| defect.region))?;
        let wall = |shape: &HeartShape| {
            Wall::drawn(shape, heart.tolerance()).map_err(|source| PhantomError::NoMaterial {
                gain: shape.gain(),
                source: Box::new(source),
            })
        };
        let rest = wall(&heart.shapes(&[0.0])?[0])?;
        let placed: Vec<Result<_, PhantomError>> = shapes
            .par_iter()
            .map(|shape| {
                let wall = wall(shape)?.sliding_from(&rest);
                let sectors = (pieces.iter())
                    .map(|(owner, region)| {
                        let sector = wall.sector(region, tolerance);
                        let sector = sector.map_err(|source| PhantomError::NoDefect {
                            defect: *owner,
                            gain: shape.gain(),
                            source: Box::new(source),
                        })?;
                        Ok((sector, defects[*owner].activity - 1.0))
                    })
                    .collect::<Result<_, PhantomError>>()?;
                Ok((shape.gain().to_bits(), sectors))
            })
            .collect();
        // Of several errors the first, whichever thread was faster.
        let shapes = placed.into_iter().collect::<Result<_, PhantomError>>()?;
        let owners = pieces.into_iter().map(|(owner, _)| owner).collect();
        Ok(Self { shapes, owners })
    }

    pub(crate) fn of(&self, shape: &HeartShape) -> &[(Sector, f64)] {
        self.shapes
            .get(&shape.gain().to_bits())
            .map_or(&[], Vec::as_slice)
    }

    /// The solids of each of `n` defects.
    pub(crate) fn by_defect(&self, shape: &HeartShape, n: usize) -> Vec<Vec<&Sector>> {
        let mut parts = vec![Vec::new(); n];
        for (owner, (sector, _)) in self.owners.iter().zip(self.of(shape)) {
            parts[*owner].push(sector);
        }
        parts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Sides on a coarse net, so that they often coincide; azimuths within three turns.
    fn any_region() -> impl Strategy<Value = WallRegion> {
        let range = |n: i32| (0..n, 0..n).prop_map(move |(a, b)| [a.min(b), a.max(b) + 1]);
        (range(4), range(4), -8..8, 1..=8).prop_map(|(layers, s, from, wide)| WallRegion {
            layers: layers.map(|k| f64::from(k) / 4.0),
            s: s.map(|k| f64::from(k) / 8.0),
            azimuths: [from, from + wide].map(|k| TAU * f64::from(k) / 8.0),
        })
    }

    fn holds(region: &WallRegion, [layer, s, azimuth]: [f64; 3]) -> bool {
        let turn = (azimuth - region.azimuths[0]).rem_euclid(TAU);
        (region.layers[0]..region.layers[1]).contains(&layer)
            && (region.s[0]..region.s[1]).contains(&s)
            && turn < region.azimuths[1] - region.azimuths[0]
    }

    proptest! {
        #[test]
        fn every_place_is_the_last_ones(regions in prop::collection::vec(any_region(), 1..9)) {
            let pieces = without_overlap(regions.iter().copied()).unwrap();
            // The middles of all cells of the net.
            for cell in 0..4 * 4 * 8 {
                let at = |k: i32, n: f64| (f64::from(k) + 0.5) / n;
                let place = [at(cell % 4, 4.0), at(cell / 4 % 4, 8.0), TAU * at(cell / 16, 8.0)];
                let last = (0..regions.len()).rev().find(|k| holds(&regions[*k], place));
                let found: Vec<usize> = (pieces.iter())
                    .filter(|(_, piece)| holds(piece, place))
                    .map(|(owner, _)| *owner)
                    .collect();
                prop_assert_eq!(found, Vec::from_iter(last));
            }
            for (_, piece) in &pieces {
                for [from, to] in [piece.layers, piece.s, piece.azimuths] {
                    prop_assert!(to - from > 1e-3, "{piece:?}");
                }
            }
        }
    }
}
