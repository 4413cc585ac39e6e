//! Options of the computation of members.

use heart_phantom::{Heart, PhantomError, check_count};

const MOST_THREADS: usize = 4096;

/// Options of the computation of a shard. Results do not depend on them, except that a member whose memory exceeds its part is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RunOptions {
    /// Number of members computed concurrently, each on one thread: 1 to 4096.
    pub threads: usize,
    /// Bytes for shapes of the heart on all threads, at least 1 ([`Heart::with_memory`]); default 512 MiB.
    pub memory: usize,
}

impl RunOptions {
    /// Options for a number of concurrent members, 1 to 4096, and 512 MiB; the functions that compute members reject others, and 0 bytes,
    /// with [`PhantomError::Count`] before any work.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        Self {
            threads,
            memory: Heart::DEFAULT_MEMORY,
        }
    }

    /// Validates the numbers of threads and bytes.
    pub(crate) fn check(&self) -> Result<(), PhantomError> {
        check_count("threads", self.threads, [1, MOST_THREADS])?;
        check_count("memory", self.memory, [1, usize::MAX]).map(drop)
    }
}
