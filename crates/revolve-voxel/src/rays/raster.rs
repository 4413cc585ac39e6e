//! The interface of rays to projections.

use crate::{Body, Ray, RayCounters, RevolveError, Sample};

/// The rays of a view: [`ParallelRays`](crate::ParallelRays), or [`Lines`](crate::Lines) in any direction. Sealed.
pub trait Rays: Raster {}

/// A raster of rays with an image `[row][slab][bin]`.
pub trait Raster: Sync {
    /// Rays in a row.
    fn row_len(&self) -> usize;
    /// Samples of an image.
    fn image_len(&self) -> usize;
    /// Planes between the slabs of a ray.
    fn planes(&self) -> &[f64];
    /// One of the rays.
    fn line(&self, bin: usize, row: usize) -> Ray;
    /// An error if a ray is parallel to the axis of a torso.
    fn check_across(&self) -> Result<(), RevolveError>;
    /// Adds the integrals along all rays, with a weight per layer of the body.
    fn project_body<T: Sample, M: Fn(f64, f64, f64) -> f64>(
        &self,
        body: &Body,
        weights: &[f64],
        out: &mut [T],
        measure: impl Fn([usize; 2]) -> M + Sync,
    ) -> RayCounters;
}
