//! The heap memory of a shard against the number of its members. A separate program, because the counter applies to the process.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use heart_cohort::{Cohort, RunOptions, Shard, heart_phantom::no_observer, run_shard};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Largest size of a row of the record: a dozen names with their numbers.
const ROW_BYTES: usize = 4096;

fn peak(members: usize) -> usize {
    let text = format!(
        "members = {members}\n[scene]\nheart.discretisation = {{ differences = {{ nodes = 51 }} }}
camera = {{ views = 4, bins = 16, rows = 16, pitch = [0.8, 0.8] }}
acquisition.mode = {{ gated = {{ gates = 2 }} }}\noutput.write = [\"projections\", \"truth\"]
truth.tolerance = 0.1
[vary]\ncycle.volume.gain = {{ uniform = [0.3, 0.6] }}\n"
    );
    let cohort = Cohort::from_toml(&text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (shard, options) = (Shard { shard: 1, of: 1 }, RunOptions::new(2));
    HEAP.reset_peak_usage();
    let before = HEAP.current_usage();
    let report = run_shard(&cohort, folder.path(), shard, &options, &no_observer);
    report.map(drop).unwrap();
    HEAP.peak_usage() - before
}

#[test]
fn memory_does_not_grow_with_members() {
    peak(4);
    let (few, many) = (peak(10), peak(110));
    // Members on two threads may or may not reach their largest memory at the same time. Storing all pieces of 40 KB would need 4 MB more.
    assert!(many < 2 * few + 100 * ROW_BYTES, "{few} {many}");
}
