//! Computes members concurrently, each on one thread, and passes them on in order.

use heart_phantom::PhantomError;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Range;
use std::sync::mpsc::sync_channel;

/// One thread pool per concurrent member.
pub(crate) fn pools(threads: usize) -> Result<Vec<ThreadPool>, PhantomError> {
    let pool = |_| ThreadPoolBuilder::new().num_threads(1).build();
    let pools: Result<Vec<_>, _> = (0..threads).map(pool).collect();
    pools.map_err(|error| {
        let source = error.into();
        PhantomError::Threads { given: 1, source }
    })
}

/// Runs `work` for each index in one of the pools and passes the results to `take` in the order of the indices. At most two results
/// per pool are pending, so the memory does not depend on the number of indices. Parallel loops inside `work` stay on its thread:
/// the members keep all threads busy without waiting for each other.
///
/// # Errors
/// The first error of `take`; no further work begins after it.
pub(crate) fn in_order<T: Send, E>(
    indices: Range<u64>,
    pools: &[ThreadPool],
    work: impl Fn(u64) -> T + Sync,
    mut take: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    let work = &work;
    std::thread::scope(|scope| {
        let results: Vec<_> = (pools.iter().zip(indices.clone()))
            .map(|(pool, first)| {
                let (send, receive) = sync_channel(1);
                let own = (first..indices.end).step_by(pools.len());
                scope.spawn(move || {
                    for index in own {
                        // The receiver is dropped after a failure.
                        if send.send(pool.install(|| work(index))).is_err() {
                            break;
                        }
                    }
                });
                receive
            })
            .collect();
        for (_, result) in indices.zip(results.iter().cycle()) {
            // A thread that ended early panicked; the end of the scope propagates it.
            let Ok(done) = result.recv() else { break };
            take(done)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn a_failure_ends_the_work() {
        let begun = AtomicU64::new(0);
        let work = |_| begun.fetch_add(1, Ordering::SeqCst);
        let ended = in_order(0..1_000_000, &pools(2).unwrap(), work, |_| Err("full"));
        assert!(ended == Err("full") && begun.load(Ordering::SeqCst) < 10);
    }
}
