//! Errors of the study and its figures: invalid input, detected before any work, and files that cannot be written.

use heart_phantom::PhantomError;
use heart_phantom::revolve_voxel::RevolveError;

/// An error of the study, of a figure or of a page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// An option, the phantom, or a file that cannot be written; an older file of that name is unchanged.
    #[error(transparent)]
    Phantom(#[from] PhantomError),
    /// An input with too few entries.
    #[error("{what}: {given} entries, at least {least} needed")]
    TooFew {
        /// Name of the input.
        what: &'static str,
        /// Number of entries given.
        given: usize,
        /// Smallest number of entries.
        least: usize,
    },
    /// An entry is NaN or infinite.
    #[error("{what}: entry {index} is not finite")]
    NotFinite {
        /// Name of the input.
        what: &'static str,
        /// Position of the first such entry.
        index: usize,
    },
    /// Two inputs that belong together differ in length.
    #[error("{what}: {given} entries, {expected} expected")]
    Mismatch {
        /// Name of the input.
        what: &'static str,
        /// Number of entries given.
        given: usize,
        /// Number of entries expected.
        expected: usize,
    },
    /// A size, spacing, radius or error that is not positive.
    #[error("{what}: {given:?}, must be positive")]
    NotPositive {
        /// Name of the input.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A slice index outside the volume.
    #[error("{what}: index {given}, must be below {len}")]
    OutOfRange {
        /// Name of the input.
        what: &'static str,
        /// The index given.
        given: usize,
        /// Number of slices.
        len: usize,
    },
    /// An interval of grey values or coordinates that is empty, reversed or not finite.
    #[error("{what}: from {low:?} to {high:?} is not an interval")]
    Interval {
        /// Name of the input.
        what: &'static str,
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// A membrane that is not the meridian of a solid.
    #[error("no solid of revolution")]
    Body(#[source] RevolveError),
    /// An error of the plotting library, which draws in memory.
    #[error("drawing failed")]
    Drawing(#[source] Box<dyn std::error::Error + Send + Sync>),
}
