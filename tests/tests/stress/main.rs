//! Random and pathological scenes for all crates: each ends in a finite result that passes its checks, or in a typed error.
//!
//! `cargo test -p tests --test stress` runs a few hundred scenes; `cargo xtask stress --minutes N` as many as possible in N minutes, from
//! new seeds. A scene that panics is named by its kind and seed; `STRESS_SEED=S` starts there.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod bodies;
mod limits;
mod membranes;
mod odd;
mod rubber;
mod runs;
mod scenes;
mod tomography;
mod walls;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tests::Random;

/// The outcome of a scene without failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// A result that passed its checks.
    Answered,
    /// A typed error.
    Rejected,
    /// A kind that is counted separately.
    Named(&'static str),
}

/// Scenes of each kind in an ordinary run.
const SCENES: u64 = 50;

fn variable<T: std::str::FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok()?.parse().ok()
}

/// Runs scenes from the seed on, for the given time or number, and fails with the seeds of those that panicked.
fn run(kind: &str, scene: fn(&mut Random) -> Outcome) {
    let first: u64 = variable("STRESS_SEED").unwrap_or(1);
    // The kinds run concurrently, each for the whole time.
    let time = variable::<f64>("STRESS_MINUTES")
        .map(|m| Duration::from_secs_f64(60.0 * m.clamp(0.0, 1e5)));
    let start = Instant::now();
    let scenes: u64 = variable("STRESS_SCENES").unwrap_or(SCENES);
    let (next, outcomes) = (AtomicU64::new(first), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if time.map_or(seed >= first + scenes, |time| start.elapsed() >= time) {
                return;
            }
            let outcome = catch_unwind(AssertUnwindSafe(|| scene(&mut Random::new(seed))));
            let outcome = outcome.map_err(|_| seed);
            outcomes.lock().expect("no panic holds it").push(outcome);
        }
    };
    // On two threads, because a few scenes take most of the time.
    std::thread::scope(|threads| {
        threads.spawn(work);
        work();
    });
    let (mut answered, mut refused, mut failed) = (0_u64, 0_u64, Vec::new());
    let mut named: BTreeMap<&str, u64> = BTreeMap::new();
    for outcome in outcomes.into_inner().expect("no panic holds it") {
        match outcome {
            Ok(Outcome::Answered) => answered += 1,
            Ok(Outcome::Rejected) => refused += 1,
            Ok(Outcome::Named(kind)) => *named.entry(kind).or_default() += 1,
            Err(seed) => failed.push(seed),
        }
    }
    failed.sort_unstable();
    println!(
        "{kind}: {answered} solved, {refused} rejected, {} failed{}",
        failed.len(),
        (named.iter())
            .map(|(kind, times)| format!(", {times} {kind}"))
            .collect::<String>()
    );
    assert!(failed.is_empty(), "{kind}: seeds {failed:?}");
    assert!(
        answered > 0 || time.is_some(),
        "{kind}: no scene was solved, so none was checked"
    );
}

#[test]
fn membranes_give_results_or_errors() {
    run("membranes", membranes::scene);
}

#[test]
fn rubber_gives_results_or_errors() {
    run("rubber", rubber::scene);
}

#[test]
fn bodies_give_results_or_errors() {
    run("bodies", bodies::scene);
}

#[test]
fn tomography_gives_results_or_errors() {
    run("tomography", tomography::scene);
}

#[test]
fn scenes_give_results_or_errors() {
    run("scenes", scenes::scene);
}

#[test]
fn runs_give_results_or_errors() {
    run("runs", runs::scene);
}

#[test]
fn walls_give_results_or_errors() {
    run("walls", walls::scene);
}

/// The same work with one thread and with two.
pub(crate) fn with_threads<T: Send>(threads: usize, work: impl Fn() -> T + Send + Sync) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a pool of two threads").install(work)
}
