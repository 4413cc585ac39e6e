//! Warps applied one after the other.

use std::sync::Arc;

use super::warp::Warp;
use crate::error::{RadonError, at_least, length, zeros};
use crate::{LinearOperator, Sample};

/// A product of [warps](Warp), `W = W_n ... W_2 W_1`, with its exact adjoint.
///
/// A motion that is composed of two, for instance of the beating of the heart and of its displacement by respiration, is the product
/// of both maps. States of either motion are shared by the products: m beats and n respiratory phases need m + n warps, not m n.
/// Each factor interpolates on its own. Cost: that of the factors, and one volume if there are several.
///
/// ```
/// use radon::{Displacements, LinearOperator, Warp, Warps};
/// // Twice from the left neighbour: from two voxels to the left.
/// let by: Vec<_> = (0..4).map(|voxel| (voxel, [-1.0, 0.0, 0.0])).collect();
/// let left = std::sync::Arc::new(Warp::new([4, 1, 1], [1.0; 3], &[Displacements { fraction: 1.0, by: &by }])?);
/// let twice = Warps::new(vec![left.clone(), left])?;
/// let mut moved = [0.0f64; 4];
/// twice.forward_into(&[1.0, 2.0, 3.0, 4.0], &mut moved)?;
/// assert_eq!(moved, [0.0, 0.0, 1.0, 2.0]);
/// # Ok::<(), radon::RadonError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Warps {
    factors: Vec<Arc<Warp>>,
}

impl From<Warp> for Warps {
    fn from(warp: Warp) -> Self {
        Self {
            factors: vec![Arc::new(warp)],
        }
    }
}

impl Warps {
    /// The product of `factors`, the first one applied first.
    ///
    /// # Errors
    /// [`RadonError::TooFew`] without a factor; [`RadonError::WrongLength`] for volumes of different lengths. Shapes of equal length and voxel
    /// sizes are not compared.
    pub fn new(factors: Vec<Arc<Warp>>) -> Result<Self, RadonError> {
        at_least("factors of a product of warps", factors.len(), 1)?;
        for warp in &factors {
            length("volume of a warp", warp.len(), factors[0].len())?;
        }
        Ok(Self { factors })
    }

    /// The factors, the first one applied first.
    #[must_use]
    pub fn factors(&self) -> &[Arc<Warp>] {
        &self.factors
    }

    /// Applies the maps in their order, from `from` into `into`.
    fn in_turn<'a, T: Sample>(
        mut maps: impl ExactSizeIterator<Item = &'a Arc<Warp>>,
        from: &[T],
        into: &mut [T],
        apply: impl Fn(&Warp, &[T], &mut [T]) -> Result<(), RadonError>,
    ) -> Result<(), RadonError> {
        match maps.next() {
            None => into.copy_from_slice(from),
            Some(first) => apply(first, from, into)?,
        }
        if maps.len() > 0 {
            let mut between = zeros("volume between two warps", into.len(), 1)?;
            for map in maps {
                between.copy_from_slice(into);
                apply(map, &between, into)?;
            }
        }
        Ok(())
    }
}

impl<T: Sample> LinearOperator<T> for Warps {
    fn image_len(&self) -> usize {
        self.factors[0].len()
    }

    fn data_len(&self) -> usize {
        self.factors[0].len()
    }

    fn forward_into(&self, image: &[T], data: &mut [T]) -> Result<(), RadonError> {
        Self::in_turn(self.factors.iter(), image, data, Warp::forward_into)
    }

    fn adjoint_into(&self, data: &[T], image: &mut [T]) -> Result<(), RadonError> {
        Self::in_turn(self.factors.iter().rev(), data, image, Warp::adjoint_into)
    }
}
