//! Computation without the interpreter's lock: other Python threads run meanwhile, and Ctrl-C interrupts.
//!
//! A thread pool computes on its own data. The calling thread waits without the lock, checks for signals every 40 ms, and returns at the
//! first one. The threads of the computation then end at their next unit of work (`simd_set::checkpoint`). They count these units, which are
//! the progress of the call unless the task reports it. Simultaneous calls use different pools, so that one of them can be interrupted,
//! and a Python operator can call this package while a solver waits for it.

use crate::errors::Failure;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Interval between checks for signals.
const POLL: Duration = Duration::from_millis(40);

/// An argument `progress`.
pub(crate) type Progress<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// The link between the computation and the waiting thread.
#[derive(Debug)]
pub(crate) struct Watch {
    stopped: AtomicBool,
    /// Bits of the completed fraction; NaN if the units of work count it.
    share: AtomicU64,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            stopped: AtomicBool::new(false),
            share: AtomicU64::new(f64::NAN.to_bits()),
        }
    }
}

impl Watch {
    /// Reports the completed fraction. Breaks if the task is abandoned: its result is not used.
    pub(crate) fn tell(&self, share: f64) -> ControlFlow<()> {
        self.share.store(share.to_bits(), Ordering::Relaxed);
        self.poll()
    }

    /// Breaks if the task is abandoned; the units of work count the completed fraction.
    pub(crate) fn poll(&self) -> ControlFlow<()> {
        match self.stopped.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
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

/// Runs a task in the pool; `progress` receives the completed fraction.
pub(crate) fn work<T, E>(
    py: Python<'_>,
    progress: Progress<'_, '_>,
    task: impl FnOnce(&Watch) -> Result<T, E> + Send + 'static,
) -> Result<T, Failure>
where
    T: Send + 'static,
    E: Into<Failure> + Send + 'static,
{
    work_at(py, progress, AtSignal::Leave, task)
}

/// As [`work`], with the treatment at a signal. An exception of the callback ends the task.
pub(crate) fn work_at<T, E>(
    py: Python<'_>,
    progress: Progress<'_, '_>,
    at_signal: AtSignal,
    task: impl FnOnce(&Watch) -> Result<T, E> + Send + 'static,
) -> Result<T, Failure>
where
    T: Send + 'static,
    E: Into<Failure> + Send + 'static,
{
    let progress = progress.map(reporter).transpose()?;
    let progress = progress.as_ref();
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel();
    let of_task = watch.clone();
    let crew = Threads::held().take()?;
    crew.watch.restart();
    let mut last = 0.0f64;
    crew.pool.spawn(move || {
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
                Threads::held().give(crew);
                let done = done.map_err(Into::into)?;
                tell(progress, 1.0)?;
                return Ok(done);
            }
            Ok(Err(panic)) => return Err(Failure::internal(&message(panic.as_ref()))),
            Err(RecvTimeoutError::Disconnected) => return Err(Failure::internal(&"no answer")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let told = f64::from_bits(watch.share.load(Ordering::Relaxed));
        let counted = || crew.watch.fraction();
        last = last.max(if told.is_nan() { counted() } else { told });
        if let Err(error) = py.check_signals().and_then(|()| tell(progress, last)) {
            // Ends the task at its next progress report, and its threads at the next unit of work. Unfinished files are removed on the way.
            watch.stopped.store(true, Ordering::Relaxed);
            crew.watch.stop();
            if at_signal == AtSignal::Wait {
                wait(py, receiver);
            }
            return Err(error.into());
        }
    }
}

/// The function of the completed fraction that an argument `progress` stands for.
fn reporter<'py>(progress: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let module = progress.py().import("heart_phantom._progress")?;
    module.call_method1("reporter", (progress,))
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

/// A thread pool and the watch of its threads. One call uses a pool at a time.
struct Crew {
    pool: ThreadPool,
    watch: Arc<simd_set::Watch>,
    /// Number of `set_threads` calls before it was started.
    generation: u64,
}

/// The idle pools.
struct Threads {
    /// Requested number of threads; 0 for one per core.
    asked: usize,
    generation: u64,
    /// The process of the pools: a forked process has none of their threads.
    process: u32,
    idle: Vec<Crew>,
}

/// Largest number of pools that are kept: more exist only while more calls run at the same time.
const MOST_IDLE: usize = 2;

static THREADS: Mutex<Threads> = Mutex::new(Threads {
    asked: 0,
    generation: 0,
    process: 0,
    idle: Vec::new(),
});

impl Threads {
    fn held() -> MutexGuard<'static, Self> {
        let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
        let here = std::process::id();
        if threads.process != here {
            // The threads belong to the parent process and cannot be joined.
            std::mem::forget(std::mem::take(&mut threads.idle));
            threads.process = here;
        }
        threads
    }

    /// Returns an idle pool, or starts one.
    fn take(&mut self) -> Result<Crew, Failure> {
        if let Some(crew) = self.idle.pop() {
            return Ok(crew);
        }
        let watch = Arc::new(simd_set::Watch::default());
        let of_threads = watch.clone();
        let built = (ThreadPoolBuilder::new().num_threads(self.asked))
            .thread_name(|k| format!("heart-phantom-{k}"))
            .start_handler(move |_| simd_set::watch_with(of_threads.clone()));
        let given = self.asked;
        let failed = |error: ThreadPoolBuildError| heart_phantom::PhantomError::Threads {
            given,
            source: error.into(),
        };
        Ok(Crew {
            pool: built.build().map_err(failed)?,
            watch,
            generation: self.generation,
        })
    }

    /// Keeps a pool for the next call, unless the number of threads has changed.
    fn give(&mut self, crew: Crew) {
        if crew.generation == self.generation && self.idle.len() < MOST_IDLE {
            self.idle.push(crew);
        }
    }
}

/// Sets the number of threads. Results are bitwise identical for any number.
///
/// Parameters
/// ----------
/// n : int
///     Number of threads; 0 for one per core.
///
/// Raises
/// ------
/// ValueError
///     If it is above 4096.
/// OSError
///     If the threads cannot be started.
///
/// Examples
/// --------
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
    threads.asked = n.0;
    threads.generation += 1;
    threads.idle.clear();
    let crew = threads.take()?;
    threads.give(crew);
    Ok(())
}

/// Returns the number of threads.
///
/// Returns
/// -------
/// int
#[pyfunction]
pub(crate) fn threads() -> Result<usize, Failure> {
    let mut threads = Threads::held();
    let crew = threads.take()?;
    let n = crew.pool.current_num_threads();
    threads.give(crew);
    Ok(n)
}
