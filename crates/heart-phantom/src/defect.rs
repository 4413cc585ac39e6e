//! Pieces of the wall that take up more or less than the rest of it, and move with it.

use crate::error::PhantomError;
use crate::{Heart, HeartShape, Wall, WallRegion};
use rayon::prelude::*;
use revolve_voxel::Sector;
use std::collections::BTreeMap;

/// A piece of the wall with another activity, as an infarct, or an insert of a physical phantom.
///
/// It is made of the same material at every phase: it slides along the membranes with the wall and keeps its volume
/// ([`Wall::sliding`]). Where defects overlap, their differences from the wall add up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defect {
    /// The piece, in the material coordinates of the wall at rest.
    pub region: WallRegion,
    /// Its activity in units of the wall's: 0 for a cold defect, 1 for none.
    pub activity: f64,
}

/// The defects of each shape as solids, with the activity that they add to the wall's, which is 1.
#[derive(Debug, Default)]
pub(crate) struct Placed(BTreeMap<u64, Vec<(Sector, f64)>>);

impl Placed {
    /// The defects in each of the shapes, drawn to `tolerance` cm. Solves the shape at rest, if there are any defects.
    pub(crate) fn new(
        heart: &Heart,
        defects: &[Defect],
        tolerance: f64,
        gains: &[f64],
    ) -> Result<Self, PhantomError> {
        if defects.is_empty() {
            return Ok(Self::default());
        }
        let rest = Wall::new(&heart.shapes(&[0.0])?[0])?;
        let mut distinct = gains.to_vec();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup_by_key(|gain| gain.to_bits());
        let shapes = heart.shapes(&distinct)?;
        let placed = shapes
            .par_iter()
            .map(|shape| {
                let wall = Wall::sliding(shape, &rest)?;
                let sectors = (defects.iter())
                    .map(|defect| {
                        Ok((
                            wall.sector(&defect.region, tolerance)?,
                            defect.activity - 1.0,
                        ))
                    })
                    .collect::<Result<_, PhantomError>>()?;
                Ok((shape.gain().to_bits(), sectors))
            })
            .collect::<Result<_, PhantomError>>()?;
        Ok(Self(placed))
    }

    pub(crate) fn of(&self, shape: &HeartShape) -> &[(Sector, f64)] {
        self.0
            .get(&shape.gain().to_bits())
            .map_or(&[], Vec::as_slice)
    }
}
