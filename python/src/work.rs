//! Work away from the interpreter: other Python threads run meanwhile, and Ctrl-C ends it.
//!
//! A call's work is done by a pool of threads, on data of its own. The thread that called waits for it without the lock of the
//! interpreter, looks for signals every few hundredths of a second, and leaves as soon as there is one. What is under way then ends at
//! the next place where it tells how far it is.

use crate::errors::Failure;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long a signal may wait.
const POLL: Duration = Duration::from_millis(40);

/// Between the work and who waits for it.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    stopped: AtomicBool,
    /// Bits of the share of the work that is done.
    share: AtomicU64,
}

/// What unwinds a task that nobody waits for any more; no failure, and no message.
struct Stopped;

impl Watch {
    /// Tells how much is done, from 0 to 1. Does not return where nobody waits any more.
    pub(crate) fn tell(&self, share: f64) {
        self.share.store(share.to_bits(), Ordering::Relaxed);
        if self.is_stopped() {
            resume_unwind(Box::new(Stopped));
        }
    }

    /// Whether nobody waits any more.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

/// What happens to work that is under way when a signal comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AtSignal {
    /// It ends by itself later: all that it has is its own.
    Leave,
    /// It is waited for: it writes files.
    Wait,
}

/// Does a task in the pool.
pub(crate) fn work<T, E>(
    py: Python<'_>,
    task: impl FnOnce(&Watch) -> Result<T, E> + Send + 'static,
) -> Result<T, Failure>
where
    T: Send + 'static,
    E: Into<Failure> + Send + 'static,
{
    work_told(py, None, AtSignal::Leave, task)
}

/// The same; `progress`, if any, is called with the share of the work that is done. What it raises ends the work.
pub(crate) fn work_told<T, E>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    at_signal: AtSignal,
    task: impl FnOnce(&Watch) -> Result<T, E> + Send + 'static,
) -> Result<T, Failure>
where
    T: Send + 'static,
    E: Into<Failure> + Send + 'static,
{
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel();
    let of_task = watch.clone();
    let pool = Threads::held().pool()?;
    pool.spawn(move || {
        // What it leaves half done is dropped with it, or whole: counters and caches behind locks.
        let done = catch_unwind(AssertUnwindSafe(|| task(&of_task)));
        // Fails if nobody waits.
        let _ = sender.send(done);
    });
    loop {
        let waited = py.detach(move || {
            let got = receiver.recv_timeout(POLL);
            (receiver, got)
        });
        receiver = waited.0;
        match waited.1 {
            Ok(Ok(done)) => {
                let done = done.map_err(Into::into)?;
                tell(progress, 1.0)?;
                return Ok(done);
            }
            Ok(Err(panic)) => return Err(Failure::internal(&message(panic.as_ref()))),
            Err(RecvTimeoutError::Disconnected) => return Err(Failure::internal(&"no answer")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let share = f64::from_bits(watch.share.load(Ordering::Relaxed));
        if let Err(error) = py.check_signals().and_then(|()| tell(progress, share)) {
            watch.stopped.store(true, Ordering::Relaxed);
            match at_signal {
                AtSignal::Wait => wait(py, receiver),
                AtSignal::Leave => Threads::held().leave(),
            }
            return Err(error.into());
        }
    }
}

fn tell(progress: Option<&Bound<'_, PyAny>>, share: f64) -> PyResult<()> {
    progress.map_or(Ok(()), |progress| progress.call1((share,)).map(drop))
}

fn wait<T: Send>(py: Python<'_>, receiver: Receiver<T>) {
    py.detach(move || {
        // Whatever it was.
        let _ = receiver.recv();
    });
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_default()
}

/// The threads that compute.
struct Threads {
    /// How many are asked for; 0 for one a core.
    asked: usize,
    /// The pool, once it is needed, and the process that has its threads: a fork has none of them.
    pool: Option<(u32, Arc<ThreadPool>)>,
}

static THREADS: Mutex<Threads> = Mutex::new(Threads {
    asked: 0,
    pool: None,
});

impl Threads {
    fn held() -> MutexGuard<'static, Self> {
        THREADS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn pool(&mut self) -> Result<Arc<ThreadPool>, Failure> {
        let here = std::process::id();
        match self.pool.take() {
            Some((process, pool)) if process == here => {
                self.pool = Some((process, pool.clone()));
                return Ok(pool);
            }
            // Its threads are the parent's: there is nobody to end.
            Some((_, parents)) => std::mem::forget(parents),
            None => {}
        }
        let builder = ThreadPoolBuilder::new().num_threads(self.asked);
        let built = builder.thread_name(|k| format!("heart-phantom-{k}"));
        let given = self.asked;
        let failed = |source| heart_phantom::PhantomError::Threads { given, source };
        let pool = Arc::new(built.build().map_err(failed)?);
        self.pool = Some((here, pool.clone()));
        Ok(pool)
    }

    /// Leaves the pool to what is under way in it: the next call has threads of its own.
    fn leave(&mut self) {
        if let Some((process, pool)) = self.pool.take()
            && process != std::process::id()
        {
            std::mem::forget(pool);
        }
    }
}

/// Sets how many threads compute; 0 for one a core. Results have the same bits for any number.
///
/// >>> import heart_phantom
/// >>> heart_phantom.set_threads(1)
/// >>> heart_phantom.threads()
/// 1
/// >>> heart_phantom.set_threads(0)
#[pyfunction]
#[pyo3(signature = (n))]
pub(crate) fn set_threads(n: crate::values::Whole) -> Result<(), Failure> {
    const MOST: usize = 4096;
    if n.0 > MOST {
        let text = format!("threads are {}, must be between 0 and {MOST}", n.0);
        return Err(PyValueError::new_err(text).into());
    }
    let mut threads = Threads::held();
    threads.leave();
    threads.asked = n.0;
    threads.pool().map(drop)
}

/// How many threads compute.
#[pyfunction]
pub(crate) fn threads() -> Result<usize, Failure> {
    Ok(Threads::held().pool()?.current_num_threads())
}
