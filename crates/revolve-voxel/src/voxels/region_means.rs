//! Volumes of any quantity from the coverage of the regions: one pass over the surface serves them all.

use rayon::prelude::*;

use crate::error::{finite, length};
use crate::{Error, RegionVolumes, Sample};

impl<T: Sample> RegionVolumes<T> {
    /// The mean over each voxel of a quantity with one value a region and none outside: activity, attenuation.
    ///
    /// # Errors
    /// [`Error::Length`] or [`Error::NotFinite`] for the values; [`Error::Length`] for a region of another number of voxels
    /// than there are labels.
    pub fn mean_of(&self, values: &[f64]) -> Result<Vec<T>, Error> {
        length("values (one per region)", self.coverage.len(), values.len())?;
        for &value in values {
            finite("value of a region", value)?;
        }
        for covered in &self.coverage {
            length("voxels of a region", self.labels.len(), covered.len())?;
        }
        Ok((0..self.labels.len())
            .into_par_iter()
            .map(|i| {
                let shares = self.coverage.iter().zip(values);
                T::from_f64(shares.map(|(c, value)| c[i].to_f64() * value).sum())
            })
            .collect())
    }
}
