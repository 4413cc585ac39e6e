//! The OSEM model of a gate.

use super::method::Osem;
use crate::error::PhantomError;
use radon::{SpectOperator, Subset};

/// The model of a gate.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) operator: SpectOperator<f32>,
    pub(super) subsets: Vec<Subset<SpectOperator<f32>, f32>>,
}

impl Model {
    pub(super) fn new(osem: &Osem, operator: SpectOperator<f32>) -> Result<Self, PhantomError> {
        let mut subsets = operator.subsets(osem.subsets)?;
        // Consecutive subsets have different directions.
        subsets.sort_by_key(|subset| subset.operator().views()[0].reverse_bits());
        Ok(Self { operator, subsets })
    }
}
