//! Computation without the interpreter's lock: other Python threads run meanwhile, and Ctrl-C interrupts.
//!
//! A thread pool computes on its own data. The calling thread waits without the lock, checks for signals every 40 ms, and returns at the
//! first one. The computation then ends at its next progress report.

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

/// Interval between checks for signals.
const POLL: Duration = Duration::from_millis(40);

/// The link between the computation and the waiting thread.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    stopped: AtomicBool,
    /// Bits of the completed fraction.
    share: AtomicU64,
}

/// Unwinds an abandoned task; not a failure, and without a message.
struct Stopped;

impl Watch {
    /// Reports the completed fraction. Does not return if the task is abandoned.
    pub(crate) fn tell(&self, share: f64) {
        self.share.store(share.to_bits(), Ordering::Relaxed);
        if self.is_stopped() {
            resume_unwind(Box::new(Stopped));
        }
    }

    /// Whether the task is abandoned.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

/// The treatment of a running computation at a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AtSignal {
    /// Abandoned: it owns its data and ends later.
    Leave,
    /// Awaited, because it writes files.
    Wait,
}

/// Runs a task in the pool.
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

/// Runs a task with a `progress` callback for the completed fraction; an exception of the callback ends the task.
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
        // Partial results are dropped with it; counters and caches are behind locks.
        let done = catch_unwind(AssertUnwindSafe(|| task(&of_task)));
        // Fails if the task is abandoned.
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
        // Any other panic.
        let _ = receiver.recv();
    });
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned())
        .unwrap_or_default()
}

/// The thread pool.
struct Threads {
    /// Requested number of threads; 0 for one per core.
    asked: usize,
    /// The pool, if started, and its process: a forked process has none of its threads.
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
            // The threads belong to the parent process and cannot be joined.
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

    /// Abandons the pool to its running tasks: the next call starts new threads.
    fn leave(&mut self) {
        if let Some((process, pool)) = self.pool.take()
            && process != std::process::id()
        {
            std::mem::forget(pool);
        }
    }
}

/// Sets the number of threads; 0 for one per core. Results are bitwise identical for any number.
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

/// Returns the number of threads.
#[pyfunction]
pub(crate) fn threads() -> Result<usize, Failure> {
    Ok(Threads::held().pool()?.current_num_threads())
}
