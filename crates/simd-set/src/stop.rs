//! Cooperative end, and progress, of computations on worker threads.

use std::cell::OnceCell;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

thread_local! {
    static WATCH: OnceCell<Arc<Watch>> = const { OnceCell::new() };
}

/// The payload with which [`checkpoint`] unwinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// The state of a computation that its threads share with the thread that waits for it.
#[derive(Debug, Default)]
pub struct Watch {
    stopped: AtomicBool,
    /// Completed fraction in units of 1 / [`WHOLE`].
    done: AtomicU64,
    /// Start and length of the current part, in the same units.
    part: [AtomicU64; 2],
}

const WHOLE: u64 = 1 << 62;

impl Watch {
    /// Ends the computation at its next [`checkpoint`].
    pub fn stop(&self) {
        self.stopped.store(true, Relaxed);
    }

    /// Sets the completed fraction to 0. Call it before each computation whose progress is read.
    pub fn restart(&self) {
        self.begin([0, WHOLE], 0);
    }

    /// Returns the completed fraction, from 0 to 1, that [`unit()`] and [`part`] have counted.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        (self.done.load(Relaxed) as f64 / WHOLE as f64).min(1.0)
    }

    fn begin(&self, part: [u64; 2], done: u64) {
        (self.part.iter().zip(part)).for_each(|(own, given)| own.store(given, Relaxed));
        self.done.store(done, Relaxed);
    }
}

/// Connects this thread with a watch: its computations end at their next [`checkpoint`] after [`Watch::stop`], and report their progress.
///
/// For the start handler of a thread pool whose computations can be abandoned. The first watch of a thread remains its watch.
pub fn watch_with(watch: Arc<Watch>) {
    WATCH.with(|own| drop(own.set(watch)));
}

/// Unwinds with [`Stopped`], without a message, if the watch of this thread is stopped; otherwise does nothing.
///
/// [`Set::run`](crate::Set::run) calls it. Loops that take more than 0.1 s between two calls of it should call it. Cost: about a
/// nanosecond.
///
/// ```
/// use std::sync::Arc;
/// let watch = Arc::new(simd_set::Watch::default());
/// let of_worker = watch.clone();
/// let worker = std::thread::spawn(move || {
///     simd_set::watch_with(of_worker);
///     loop { simd_set::checkpoint(); }
/// });
/// watch.stop();
/// assert!(worker.join().unwrap_err().is::<simd_set::Stopped>());
/// ```
#[inline]
pub fn checkpoint() {
    if WATCH.with(|own| (own.get()).is_some_and(|watch| watch.stopped.load(Relaxed))) {
        resume_unwind(Box::new(Stopped));
    }
}

/// A [`checkpoint`] that counts one of `of` equal units of work of the current part as completed.
pub fn unit(of: usize) {
    checkpoint();
    WATCH.with(|own| {
        if let Some(watch) = own.get() {
            let each = watch.part[1].load(Relaxed) / of.max(1) as u64;
            watch.done.fetch_add(each, Relaxed);
        }
    });
}

/// Makes these of `of` equal units the current part, until the returned value is dropped. Only for sequential loops.
#[must_use = "the part ends when it is dropped"]
pub fn part(units: Range<usize>, of: usize) -> Part {
    let watch = WATCH.with(|own| own.get().cloned());
    Part(watch.map(|watch| {
        let outer = watch.part.each_ref().map(|own| own.load(Relaxed));
        let place = |unit: usize| outer[0] + outer[1] / of.max(1) as u64 * unit as u64;
        let (start, end) = (place(units.start), place(units.end));
        watch.begin([start, end - start], start);
        (watch, outer, end)
    }))
}

/// Makes each step of a sequential loop a [`part`] of equal length.
pub fn parts<I: ExactSizeIterator>(steps: I) -> impl Iterator<Item = (Part, I::Item)> {
    let n = steps.len();
    (steps.enumerate()).map(move |(k, step)| (part(k..k + 1, n), step))
}

/// The end of a [`part`].
#[derive(Debug)]
pub struct Part(Option<(Arc<Watch>, [u64; 2], u64)>);

impl Drop for Part {
    fn drop(&mut self) {
        if let Some((watch, outer, end)) = &self.0 {
            watch.begin(*outer, *end);
        }
    }
}
