//! The part of the memory that a run may use.

/// The part of the memory that belongs to a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    /// Number of concurrent runs with equal parts.
    pub(super) runs: u64,
    /// Bytes of the caller.
    pub(super) further: u64,
}

impl Default for Share {
    fn default() -> Self {
        Self {
            runs: 1,
            further: 0,
        }
    }
}
