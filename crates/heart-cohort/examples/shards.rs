//! A cohort of six hearts in two shards, their manifest, and the ejection fractions that a reader of the shards finds.
//!
//! `cargo run --release -p heart-cohort --example shards -- FOLDER`

use heart_cohort::heart_phantom::no_observer;
use heart_cohort::{Cohort, RunOptions, Shard, merge, read_shard, run_shard, verify};
use std::path::PathBuf;

const COHORT: &str = r#"
members = 6
sampling = "sobol"
constraints = ["heart.outer.radius > heart.inner.radius + 0.8"]
[scene]
heart.discretisation = { differences = { nodes = 51 } }
camera = { views = 16, bins = 24, rows = 24, pitch = [0.7, 0.7] }
acquisition.mode = { gated = { gates = 4 } }
output.write = ["projections", "truth"]
[vary]
heart.inner.radius = { uniform = [1.5, 2.0] }
heart.outer.radius = { normal = { mean = 2.8, sd = 0.2, bounds = [2.4, 3.2] } }
cycle.volume.gain = { uniform = [0.3, 0.7] }
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "cohort".into()));
    let cohort = Cohort::from_toml(COHORT)?;
    let options = RunOptions::new(2);
    let shards = [1, 2].map(|shard| Shard { shard, of: 2 });
    for shard in shards {
        // On a cluster: one task per shard, in any order.
        let report = run_shard(&cohort, &folder, shard, &options, &no_observer)?;
        println!("{}: {} bytes", report.path.display(), report.bytes);
    }
    let manifest = merge(&folder)?;
    println!(
        "{} members, {} rejected",
        manifest.members, manifest.rejected
    );
    let faults = verify(&cohort, &folder, 1, 1, &options)?.faults;
    println!("{} faults", faults.len());

    println!("member    EF     sum of the views of gate 0");
    for shard in shards {
        for member in read_shard(&folder, shard)? {
            let member = member?;
            let views = member.array("projections.npy")?; // [gate][view][row][bin]
            let gate_len: usize = views.shape[1..].iter().product();
            let sum: f32 = views.samples[..gate_len].iter().sum();
            let row = &member.row;
            println!(
                "{}  {:.3}  {sum:.1}",
                row.key, row.numbers["ejection_fraction"]
            );
        }
    }
    Ok(())
}
