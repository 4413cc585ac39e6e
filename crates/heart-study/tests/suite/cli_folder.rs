//! Commands in a directory that is not empty.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A fast scene; labels and surfaces have the names of those of `truth`.
const SCENE: &str = "[heart]\ndiscretisation = { differences = { nodes = 51 } }\n\
    [camera]\nviews = 4\nbins = 12\nrows = 10\npitch = [1.4, 1.6]\nsamples = 'averages'\n\
    [acquisition]\nmode = { static = { phase = 0.0 } }\n[truth]\ntolerance = 0.1\n";
const PAPER: [&str; 6] = ["--size", "16", "--views", "4", "--nodes", "51"];

/// Runs in `folder`, which contains `scene.toml`.
fn heart_phantom(folder: &Path, arguments: &[&str]) -> Output {
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[track_caller]
fn done(folder: &Path, arguments: &[&str]) {
    let output = heart_phantom(folder, arguments);
    assert!(output.status.success(), "{output:?}");
}

/// Returns the message, and checks the exit code of a failure during work.
#[track_caller]
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = heart_phantom(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(output.stdout.is_empty());
    String::from_utf8(output.stderr).unwrap()
}

/// Returns all files with their content.
fn contents(folder: &Path) -> BTreeSet<(PathBuf, Vec<u8>)> {
    (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.clone(), fs::read(path).unwrap()))
        .collect()
}

/// Checks that a directory contains the files of its report, and `others`.
#[track_caller]
fn holds_what_is_listed(folder: &Path, others: &[&str]) -> BTreeSet<String> {
    let report = fs::read(folder.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    let listed = report["files"].as_array().unwrap().iter();
    let mut listed: BTreeSet<String> = listed.map(|f| f.as_str().unwrap().into()).collect();
    listed.extend(others.iter().map(|&name| name.to_owned()));
    let found: BTreeSet<String> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(found, listed);
    found
}

#[test]
fn a_study_or_a_run_removes_the_files_of_an_earlier_one() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("main.c"), "mine").unwrap();
    let paper = [&["paper", "--out", "out"], &PAPER[..]].concat();
    done(folder.path(), &paper);
    let found = holds_what_is_listed(&out, &["main.c"]);
    for name in ["index.html", "fig15-static-slice.png", "short-ram-lak.npy"] {
        assert!(found.contains(name), "{name}");
    }
    done(folder.path(), &[&paper[..], &["--no-figures"]].concat());
    let found = holds_what_is_listed(&out, &["main.c"]);
    assert!(!found.contains("index.html") && found.contains("short-ram-lak.npy"));
    let before = fs::read_dir(&out).unwrap().count();
    let run = ["run", "scene.toml", "--out", "out"];
    let output = heart_phantom(folder.path(), &run);
    let found = holds_what_is_listed(&out, &["main.c"]);
    assert!(!found.contains("short-ram-lak.npy") && found.contains("truth.npy"));
    // All except main.c and report.json; the second run replaces files and removes none.
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        said,
        format!("removed {} files of an earlier run\n", before - 2)
    );
    assert_eq!(heart_phantom(folder.path(), &run).stderr, b"");
    let output = heart_phantom(folder.path(), &[&paper[..], &["--json"]].concat());
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    // All except main.c, and report.json and index.html, which both have.
    assert_eq!(report["removed"], found.len() - 3);
    assert!(!holds_what_is_listed(&out, &["main.c"]).contains("truth.npy"));
}

/// A report of another program, with its files.
#[test]
fn files_of_other_programs_are_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    for (name, text) in [
        ("main.c", "mine"),
        ("truth.npy", "mine too"),
        (
            "report.json",
            "{\"tool\": \"other\", \"files\": [\"main.c\", \"truth.npy\"]}",
        ),
    ] {
        fs::write(out.join(name), text).unwrap();
    }
    let before = contents(&out);
    let paper = [&["paper", "--out", "out"], &PAPER[..]].concat();
    for command in [&["run", "scene.toml", "--out", "out"][..], &paper] {
        let said = refused(folder.path(), command);
        assert!(
            said.contains("report.json") && said.contains("not written by this program"),
            "{said}"
        );
        assert_eq!(contents(&out), before);
    }
}

/// Files under every name that a run or the paper's study writes; that of ejection fractions is tested with its results.
#[test]
fn files_that_no_report_lists_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let paper = [&["paper", "--out", "paper"], &PAPER[..]].concat();
    for command in [&["run", "scene.toml", "--out", "run"][..], &paper] {
        done(folder.path(), command);
        let out = folder.path().join(command[0]);
        fs::remove_file(out.join("report.json")).unwrap();
        let before = contents(&out);
        let said = refused(folder.path(), command);
        assert!(said.contains("no report lists it"), "{said}");
        assert_eq!(contents(&out), before);
    }
}

/// If a report exists, all files that it lists are unchanged.
#[test]
fn single_results_do_not_change_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    done(folder.path(), &["run", "scene.toml", "--out", "out"]);
    let before = contents(&out);
    // The default run has neither labels nor surfaces, so that these can be written beside it.
    let truth = ["truth", "scene.toml", "--phase", "0.5", "--out", "out"];
    done(folder.path(), &truth);
    let view = ["view", "scene.toml", "--view", "1", "--out"];
    done(
        folder.path(),
        &[&view[..], &["out/view-1.npy"][..]].concat(),
    );
    done(folder.path(), &[&view[..], &["out/slice.png"][..]].concat());
    assert!(contents(&out).is_superset(&before));
    for name in [
        "projections.npy",
        "out/projections.npy",
        "./out/../out/truth.npy",
    ] {
        let arguments = [&view[..], &[name][..]].concat();
        match name.contains('/') {
            false => done(folder.path(), &arguments),
            true => {
                let said = refused(folder.path(), &arguments);
                assert!(said.contains("is a file of the run"), "{said}");
            }
        }
    }
    assert!(contents(&out).is_superset(&before));
    // Nor do they replace files of other origin.
    let before = contents(&out);
    for arguments in [
        &truth[..],
        &[&view[..], &["out/slice.png"][..]].concat(),
        &[&view[..], &["out/view-1.npy"][..]].concat(),
    ] {
        let said = refused(folder.path(), arguments);
        assert!(said.contains("the file exists"), "{said}");
    }
    assert_eq!(contents(&out), before);
    // A run with labels.
    let labels = folder.path().join("labels");
    let scene = format!("{SCENE}[output]\nwrite = ['labels', 'meshes']\n");
    fs::write(folder.path().join("labels.toml"), scene).unwrap();
    done(folder.path(), &["run", "labels.toml", "--out", "labels"]);
    let before = contents(&labels);
    let said = refused(
        folder.path(),
        &["truth", "scene.toml", "--phase", "0.5", "--out", "labels"],
    );
    assert!(
        said.contains("labels.npy") && said.contains("is a file of the run"),
        "{said}"
    );
    assert_eq!(contents(&labels), before);
}
