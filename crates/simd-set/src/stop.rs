//! Cooperative end of computations on worker threads.

use std::cell::OnceCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    static FLAG: OnceCell<Arc<AtomicBool>> = const { OnceCell::new() };
}

/// The payload with which [`checkpoint`] unwinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// Ends the computations of this thread at their next [`checkpoint`] once the flag is set.
///
/// For the start handler of a thread pool whose computations can be abandoned. The first flag of a thread remains its flag.
pub fn stop_when(flag: Arc<AtomicBool>) {
    FLAG.with(|own| drop(own.set(flag)));
}

/// Unwinds with [`Stopped`], without a message, if the flag of this thread is set; otherwise does nothing.
///
/// [`Set::run`](crate::Set::run) calls it. Loops that take more than 0.1 s between two calls of it should call it. Cost: about a
/// nanosecond.
///
/// ```
/// use std::sync::{Arc, atomic::{AtomicBool, Ordering}};
/// let flag = Arc::new(AtomicBool::new(false));
/// let of_worker = flag.clone();
/// let worker = std::thread::spawn(move || {
///     simd_set::stop_when(of_worker);
///     loop { simd_set::checkpoint(); }
/// });
/// flag.store(true, Ordering::Relaxed);
/// assert!(worker.join().unwrap_err().is::<simd_set::Stopped>());
/// ```
#[inline]
pub fn checkpoint() {
    let stopped = FLAG.with(|own| own.get().is_some_and(|flag| flag.load(Ordering::Relaxed)));
    if stopped {
        resume_unwind(Box::new(Stopped));
    }
}
