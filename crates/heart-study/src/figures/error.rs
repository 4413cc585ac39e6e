//! What can go wrong while drawing: bad input, found before any work starts, and files that cannot be written.

use heart_phantom::PhantomError;

/// Why a figure could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FigureError {
    /// An input that needs at least `least` entries has fewer.
    #[error("{what}: {given} entries, at least {least} needed")]
    TooFew {
        /// The input's name.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        least: usize,
    },
    /// An entry is NaN or infinite.
    #[error("{what}: entry {index} is not finite")]
    NotFinite {
        /// The input's name.
        what: &'static str,
        /// Position of the first such entry.
        index: usize,
    },
    /// Two inputs that belong together differ in length.
    #[error("{what}: {given} entries, {expected} expected")]
    Mismatch {
        /// The input's name.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries that the other inputs ask for.
        expected: usize,
    },
    /// A size, spacing, radius or error that must be positive is not.
    #[error("{what}: {given:?}, must be positive")]
    NotPositive {
        /// The input's name.
        what: &'static str,
        /// The value given.
        given: f64,
    },
    /// A slice index outside the volume.
    #[error("{what}: index {given}, must be below {len}")]
    OutOfRange {
        /// The input's name.
        what: &'static str,
        /// The index given.
        given: usize,
        /// Number of slices.
        len: usize,
    },
    /// An interval of grey values or coordinates that is empty, reversed or not finite.
    #[error("{what}: from {low:?} to {high:?} is not an interval")]
    Interval {
        /// The input's name.
        what: &'static str,
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// A membrane is not the meridian of a solid.
    #[error("no solid of revolution")]
    Body(#[source] heart_phantom::revolve_voxel::RevolveError),
    /// The plotting library refused; the buffer is in memory, so this is not about files.
    #[error("drawing failed")]
    Drawing(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// A file could not be written; an older file of that name stays as it was.
    #[error(transparent)]
    File(PhantomError),
}
