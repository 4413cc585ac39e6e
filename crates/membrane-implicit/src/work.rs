//! Counters of work.

/// Counters of the work done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Work {
    /// Steps accepted.
    pub steps: usize,
    /// Steps rejected by the error test or because their equations were not solved.
    pub rejected: usize,
    /// Newton iterations, one linear solve each.
    pub iterations: usize,
    /// Band factorisations.
    pub factorisations: usize,
    /// Evaluations of the pressure force.
    pub force_calls: usize,
}
