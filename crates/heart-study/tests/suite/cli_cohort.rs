//! The command line of cohorts.

use heart_cohort::Cohort;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const COHORT: &str = "members = 6
[scene]
heart.discretisation = { differences = { nodes = 51 } }
camera = { views = 3, bins = 16, rows = 16, pitch = [0.5, 0.8] }
output.write = [\"projections\", \"truth\"]
[vary]
heart.outer.radius = { choice = [2.6, 2.8, 1.7] }
cycle.volume.gain = { uniform = [0.2, 0.6] }
";

fn cohort(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args([&["--json", "--threads", "2", "cohort"], arguments].concat())
        .current_dir(folder)
        .output()
        .unwrap()
}

#[track_caller]
fn answer(folder: &Path, arguments: &[&str]) -> serde_json::Value {
    let output = cohort(folder, arguments);
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn files(folder: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Vec::new();
    };
    let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name();
    entries
        .map(|entry| name(entry).into_string().unwrap())
        .collect()
}

#[test]
fn a_cohort_is_processed_from_its_text_to_its_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(cohort(folder, &["init", "template.toml"]).status.success());
    assert!(
        !cohort(folder, &["init", "template.toml"]).status.success(),
        "it exists"
    );
    let clinical = ["init", "--clinical", "clinical.toml"];
    assert!(cohort(folder, &clinical).status.success());
    let clinical = fs::read_to_string(folder.join("clinical.toml")).unwrap();
    assert_eq!(clinical, Cohort::CLINICAL);
    fs::write(folder.join("cohort.toml"), COHORT).unwrap();
    let found = answer(folder, &["check", "cohort.toml", "--members", "3"]);
    assert_eq!((&found["members"], &found["tried"]), (&6.into(), &3.into()));
    assert_eq!(found["fields"][0]["path"], "cycle.volume.gain");
    assert!(
        found["warnings"]
            .as_object()
            .is_some_and(|all| !all.is_empty())
    );
    let said = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(["cohort", "check", "cohort.toml", "--members", "3"])
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.trim_end().ends_with(" seconds for all"), "{said}");
    let run = ["run", "cohort.toml", "--out", "out", "--shard"];
    let one = answer(folder, &[&run[..], &["2/3"]].concat());
    assert_eq!(
        (&one["shards_made"], &one["members"]),
        (&1.into(), &2.into())
    );
    let all = answer(folder, &[&run[..], &["all/3"]].concat());
    assert_eq!(
        (&all["shards_made"], &all["shards_skipped"]),
        (&2.into(), &1.into())
    );
    let merged = answer(folder, &["merge", "out"]);
    assert_eq!(
        (&merged["members"], &merged["rejected"]),
        (&6.into(), &all["rejected"])
    );
    assert!(folder.join("out/manifest.csv").is_file());
    let verified = answer(
        folder,
        &["verify", "cohort.toml", "--out", "out", "--members", "4"],
    );
    assert_eq!(verified["members"].as_array().map(Vec::len), Some(4));
    assert_eq!(verified["complete"], 3);
    let record = folder.join("out/shard-00002-of-00003.json");
    let kept = fs::read(&record).unwrap();
    fs::write(&record, "").unwrap();
    let output = cohort(
        folder,
        &["verify", "cohort.toml", "--out", "out", "--members", "6"],
    );
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let found: serde_json::Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(found["members"], serde_json::json!([0, 1, 4, 5]));
    let fault = serde_json::json!([{ "file": "shard-00002-of-00003.json", "fault": "checksum" }]);
    assert_eq!((&found["faults"], &found["complete"]), (&fault, &2.into()));
    let error = found["error"].as_str().unwrap();
    assert!(
        error.starts_with("shard-00002-of-00003.json does not"),
        "{error}"
    );
    fs::write(&record, kept).unwrap();
    let exported = answer(
        folder,
        &["export", "cohort.toml", "--member", "1", "--out", "nnunet"],
    );
    assert_eq!(exported["files"].as_array().map(Vec::len), Some(3));
    assert!(
        folder
            .join("nnunet/labelsTr/heart_00000001_00.nii.gz")
            .is_file()
    );
    assert_eq!(
        cohort(
            folder,
            &["export", "cohort.toml", "--member", "99", "--out", "x"]
        )
        .status
        .code(),
        Some(2)
    );
    let some = answer(folder, &[&run[..], &["2-3/3"]].concat());
    assert_eq!(some["shards_skipped"], 2);
    let script = answer(
        folder,
        &["slurm", "cohort.toml", "--out", "out", "--shards", "3"],
    );
    let script = script["text"].as_str().unwrap();
    assert!(script.contains("#SBATCH --array=1-3\n") && script.contains("cohort.toml' '/"));
    let slurm = ["slurm", "cohort.toml", "--out", "out", "--shards", "3"];
    let script = answer(folder, &[&slurm[..], &["--memory", "3000"]].concat());
    let script = script["text"].as_str().unwrap();
    assert!(
        script.contains("--quiet --memory 3000 --threads"),
        "{script}"
    );
    // The views of each computed member are truncated. An unknown option is no file name.
    let accepted = merged["members"].as_u64().unwrap() - merged["rejected"].as_u64().unwrap();
    assert_eq!(
        [&merged["warned"], &all["warned"], &verified["warned"]],
        [&accepted; 3]
    );
    let output = cohort(folder, &["run", "cohort.toml", "--ot", "out"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("unexpected argument '--ot'") && !said.contains("tip"),
        "{said}"
    );
}

/// The torso is smaller than the heart, which is known only after the membranes are solved.
#[test]
fn a_run_without_a_computed_member_fails_with_the_first_reason() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let torso = "background = { concentration = 0.1, centre = [0.0, 0.0], semi_axes = [30.0, 30.0] }\n[vary]\nbackground.semi_axes.1 = { choice = [AXIS] }\n";
    for (axis, code) in [("3.0", 2), ("3.0, 30.0", 0)] {
        let torso = torso.replace("AXIS", axis);
        let text = COHORT
            .replace("[vary]\n", &torso)
            .replace("members = 6", "members = 6\nsampling = \"sobol\"");
        fs::write(folder.join("cohort.toml"), text.replace(", 1.7]", "]")).unwrap();
        let out = format!("out-{code}");
        for _ in 0..2 {
            let output = cohort(folder, &["run", "cohort.toml", "--out", &out]);
            assert_eq!(output.status.code(), Some(code), "{output:?}");
            let told = if code == 0 {
                &output.stdout
            } else {
                &output.stderr
            };
            let found: serde_json::Value = serde_json::from_slice(told).unwrap();
            let first = found["first_rejected"].as_str().unwrap();
            assert!(
                first.contains(" rejected: ") && first.contains("background"),
                "{first}"
            );
            assert_eq!(found["error"].is_null(), code == 0);
        }
    }
}

#[test]
fn invalid_input_is_rejected_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(
        folder.join("cohort.toml"),
        COHORT.replace("volume.gain", "volume.gian"),
    )
    .unwrap();
    let output = cohort(folder, &["check", "cohort.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let error: serde_json::Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(
        (&error["line"], &error["field"]),
        (&8.into(), &"vary.cycle.volume.gian".into())
    );
    for arguments in [
        &["check", "missing.toml"][..],
        &["run", "cohort.toml", "--out", "out", "--shard", "0/3"],
        &["run", "cohort.toml", "--out", "out", "--shard", "3"],
        &["run", "cohort.toml", "--out", "out", "--shard", "1/1/1"],
        &["run", "cohort.toml", "--out", "out", "--shard", "3-2/4"],
        &["run", "cohort.toml", "--out", "out", "--shard", "3-5/4"],
        &["slurm", "cohort.toml", "--out", "out", "--shards", "0"],
    ] {
        let output = cohort(folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
    }
    assert_eq!(cohort(folder, &["merge", "out"]).status.code(), Some(2));
    assert!(!folder.join("out").exists());
}

/// A limit on the size of files simulates a full disk: the write fails in the same way.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_partial_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("cohort.toml"), COHORT).unwrap();
    let program = env!("CARGO_BIN_EXE_heart-phantom");
    let run = format!("ulimit -f 16; exec '{program}' cohort run cohort.toml --out out");
    let output = Command::new("sh")
        .args(["-c", &run])
        .current_dir(folder)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(
        words.contains("cannot write") && words.contains("shard-00001-of-00001.tar"),
        "{words}"
    );
    assert_eq!(files(&folder.join("out")), [""; 0]);
}
