//! Shared by the benches: rows of time beside error, which `cargo xtask report` collects.
//!
//! `cargo bench` measures criterion's groups, and takes its options and filters. A bench called with `--rows` (and optionally `--quick`) prints rows
//! of time and error of each method instead and does not run criterion:
//!
//! ```text
//! cargo bench -p benches --bench membrane -- --rows --quick
//! row {"case":"balloon","error":2.1e-4,"error_kind":"relative volume",...}
//! ```
//!
//! Its `main` then reads
//!
//! ```text
//! fn main() {
//!     benches::run(rows, &[one_group, another]);
//! }
//! ```

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::hint::black_box;
use std::time::Instant;

use criterion::Criterion;

/// The extent of a study: everything, or about twenty seconds of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// A few small cases, few repeats.
    Quick,
    /// All cases.
    Full,
}

/// Runs what the command line requests: the rows, or the criterion groups and their summary; with `--test`, some rows and each group once.
pub fn run(rows: fn(Effort), groups: &[fn(&mut Criterion)]) {
    let given = |flag: &str| std::env::args().any(|argument| argument == flag);
    if given("--rows") || given("--test") {
        let all = given("--rows") && !given("--quick");
        rows(if all { Effort::Full } else { Effort::Quick });
    }
    if !given("--rows") {
        let mut criterion = Criterion::default().configure_from_args();
        groups.iter().for_each(|group| group(&mut criterion));
        criterion.final_summary();
    }
}

/// One point of a work-precision study: the time a method took and the error it left.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Subject of the comparison: static solve, motion, chords, voxels, projectors, FBP, SPECT, growth, whole study.
    pub study: &'a str,
    /// The program or method, with the options that distinguish it from others.
    pub method: &'a str,
    /// The problem; rows of one study and case answer the same question.
    pub case: &'a str,
    /// Number of unknowns, nodes, bins or the like that makes this row differ from its neighbours.
    pub size: usize,
    /// Number of threads.
    pub threads: usize,
    /// Seconds (median of the repeats).
    pub seconds: f64,
    /// Distance from the reference.
    pub error: f64,
    /// The norm of that distance, with its unit if it has one.
    pub error_kind: &'a str,
}

impl Row<'_> {
    /// Prints the row: `row ` and one JSON object.
    ///
    /// # Panics
    /// A time or an error that is not finite: such a row means a broken bench.
    pub fn print(&self) {
        assert!(
            self.seconds.is_finite() && self.error.is_finite(),
            "{self:?}"
        );
        let json = serde_json::json!({
            "study": self.study,
            "method": self.method,
            "case": self.case,
            "size": self.size,
            "threads": self.threads,
            "seconds": self.seconds,
            "error": self.error,
            "error_kind": self.error_kind,
        });
        println!("row {json}");
    }
}

/// Returns the median of the wall times of `repeats` runs in seconds, after a warm-up run, and the last result.
pub fn timed<T>(repeats: usize, mut run: impl FnMut() -> T) -> (f64, T) {
    let mut answer = run();
    let mut times: Vec<f64> = (0..repeats.max(1))
        .map(|_| {
            let start = Instant::now();
            answer = black_box(run());
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    (times[times.len() / 2], answer)
}

/// Runs `work` on a pool of this many threads.
///
/// # Panics
/// Threads cannot be started.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads")
        .install(work)
}
