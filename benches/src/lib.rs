//! Shared by the benches: rows of time beside error, which `cargo xtask report` collects.
//!
//! `cargo bench` measures criterion's groups, and takes its options and filters. A bench called with `--rows` (and optionally `--quick`) prints rows
//! of time and error of each method instead and does not run criterion:
//!
//! ```text
//! cargo bench -p benches-heart --features rivals --bench membrane -- --rows --quick
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
use std::ops::Mul;
use std::time::Instant;

use criterion::Criterion;

/// The extent of a study: everything, or about twenty seconds of work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Each row once, of the smallest size.
    Test,
    /// A few small cases, few repeats.
    Quick,
    /// All cases.
    Full,
}

/// Whether the command line contains a flag.
fn given(flag: &str) -> bool {
    std::env::args().any(|argument| argument == flag)
}

/// Whether each bench runs once, to see that it works.
#[must_use]
pub fn in_test() -> bool {
    given("--test")
}

/// Returns the size of a bench, or a smaller one with `--test`.
#[must_use]
pub fn size(full: usize, test: usize) -> usize {
    if in_test() { test } else { full }
}

/// Numbers of threads of the rows.
#[must_use]
pub fn threads() -> &'static [usize] {
    if in_test() { &[2] } else { &[1, 2] }
}

/// Runs what the command line requests: the rows, or the criterion groups and their summary; with `--test`, some rows and each group once.
pub fn run(rows: fn(Effort), groups: &[fn(&mut Criterion)]) {
    if given("--rows") || in_test() {
        rows(match (in_test(), given("--quick")) {
            (true, _) => Effort::Test,
            (false, true) => Effort::Quick,
            (false, false) => Effort::Full,
        });
    }
    if !given("--rows") {
        let mut criterion = Criterion::default().configure_from_args();
        groups.iter().for_each(|group| group(&mut criterion));
        criterion.final_summary();
    }
}

/// Blurs an image `[row][bin]` by a Gaussian of this variance (in squares of the pitch of bins and of rows), sampled to five standard deviations and
/// with a sum of one: the textbook convolution, first along the bins and then along the rows. Samples outside the image count as zero.
#[must_use]
pub fn gaussian_blur(image: &[f32], n_bins: usize, variance: [f64; 2]) -> Vec<f32> {
    let kernel = |variance: f64| -> Vec<f32> {
        let reach = (5.0 * variance.sqrt()).ceil().max(1.0);
        let weight = |k: usize| (-0.5 * (k as f64).powi(2) / variance).exp();
        let sum = 1.0 + 2.0 * (1..=reach as usize).map(weight).sum::<f64>();
        (0..=reach as usize)
            .map(|k| (weight(k) / sum) as f32)
            .collect()
    };
    let convolved = |image: &[f32], stride: usize, weights: &[f32]| -> Vec<f32> {
        let mut out: Vec<f32> = image.iter().map(|v| weights[0] * v).collect();
        for (k, weight) in weights.iter().enumerate().skip(1) {
            let shift = (k * stride).min(image.len());
            for (out, v) in out.iter_mut().zip(&image[shift..]) {
                *out += weight * v;
            }
            for (out, v) in out[shift..].iter_mut().zip(image) {
                *out += weight * v;
            }
        }
        out
    };
    let along = kernel(variance[0]);
    let rows = image
        .chunks(n_bins)
        .flat_map(|row| convolved(row, 1, &along));
    convolved(&rows.collect::<Vec<f32>>(), n_bins, &kernel(variance[1]))
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
    /// Seconds of a run.
    pub seconds: Time,
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
        let Time {
            least,
            median,
            repeats,
        } = self.seconds;
        assert!(median.is_finite() && self.error.is_finite(), "{self:?}");
        let json = serde_json::json!({
            "study": self.study,
            "method": self.method,
            "case": self.case,
            "size": self.size,
            "threads": self.threads,
            "seconds": median,
            "least": least,
            "repeats": repeats,
            "error": self.error,
            "error_kind": self.error_kind,
        });
        println!("row {json}");
    }
}

/// The time of repeated runs, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// The shortest run.
    pub least: f64,
    /// The median of all runs.
    pub median: f64,
    /// Number of runs.
    pub repeats: usize,
}

impl Time {
    /// Minimum and median of the durations of several runs.
    ///
    /// # Panics
    /// No run.
    pub fn of(mut runs: Vec<f64>) -> Self {
        runs.sort_by(f64::total_cmp);
        Self {
            least: runs[0],
            median: runs[runs.len() / 2],
            repeats: runs.len(),
        }
    }
}

/// The time of `n` computations of the same kind.
impl Mul<usize> for Time {
    type Output = Self;

    fn mul(self, n: usize) -> Self {
        Self {
            least: self.least * n as f64,
            median: self.median * n as f64,
            ..self
        }
    }
}

/// Returns the wall time of runs after a warm-up run, and the last result: nine runs, or more until they take a tenth of a second
/// together, but at most 99; three by [`Effort::Quick`]. The first run is the only one of [`Effort::Test`].
pub fn timed<T>(effort: Effort, mut run: impl FnMut() -> T) -> (Time, T) {
    let (start, mut answer) = (Instant::now(), run());
    let mut runs = Vec::new();
    if effort == Effort::Test {
        runs.push(start.elapsed().as_secs_f64());
    }
    let more = |runs: &[f64]| match effort {
        Effort::Test => false,
        Effort::Quick => runs.len() < 3,
        Effort::Full => runs.len() < 9 || runs.len() < 99 && runs.iter().sum::<f64>() < 0.1,
    };
    while more(&runs) {
        let start = Instant::now();
        answer = black_box(run());
        runs.push(start.elapsed().as_secs_f64());
    }
    (Time::of(runs), answer)
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
