//! The command line on scenes: files, messages, exit codes.

use heart_phantom::files::Format;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn heart_phantom(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(arguments)
        .output()
        .unwrap()
}

fn said(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// A fast scene.
fn small(folder: &Path, rest: &str) -> PathBuf {
    let path = folder.join("scene.toml");
    let text = format!(
        "[heart]\ndiscretisation = {{ differences = {{ nodes = 51 }} }}\n\
         [camera]\nviews = 8\nbins = 24\nrows = 20\npitch = [0.7, 0.75]\n{rest}"
    );
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn init_writes_a_scene_that_check_accepts_and_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.toml");
    let path = path.to_str().unwrap();
    assert!(heart_phantom(&["init", path]).status.success());
    let (shown, _) = said(&heart_phantom(&["init"]));
    assert_eq!(std::fs::read_to_string(path).unwrap(), shown);
    let (checked, _) = said(&heart_phantom(&["check", path]));
    assert!(
        checked.contains("90 views") && checked.contains("0.3750"),
        "{checked}"
    );
    std::fs::write(path, "mine").unwrap();
    assert_eq!(heart_phantom(&["init", path]).status.code(), Some(1));
    assert_eq!(std::fs::read_to_string(path).unwrap(), "mine");
}

#[test]
fn run_writes_the_requested_products() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(
        folder.path(),
        "[acquisition]\nmode = { gated = { gates = 2 } }\naccuracy = { steps = 8 }\n[output]\n\
         write = ['projections', 'reconstruction', 'truth', 'labels', 'meshes', 'pictures']\n\
         volumes = 'nrrd'\nprojections = 'interfile-stir'\n",
    );
    let (scene, out) = (scene.to_str().unwrap(), folder.path().join("out"));
    let output = heart_phantom(&["run", scene, "--out", out.to_str().unwrap(), "--json"]);
    let (report, errors) = said(&output);
    assert!(output.status.success(), "{errors}");
    let report = json(&report);
    assert_eq!(
        report,
        json(&std::fs::read_to_string(out.join("report.json")).unwrap())
    );
    let mut listed: Vec<&str> = report["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f.as_str().unwrap())
        .collect();
    listed.sort_unstable();
    let expected = [
        "beat.gif",
        "curves.svg",
        "index.html",
        "inner-gate-00.stl",
        "inner-gate-01.stl",
        "labels-gate-00.nrrd",
        "labels-gate-01.nrrd",
        "outer-gate-00.stl",
        "outer-gate-01.stl",
        "projections-gate-00.hs",
        "projections-gate-00.s",
        "projections-gate-01.hs",
        "projections-gate-01.s",
        "reconstruction-gate-00.nrrd",
        "reconstruction-gate-00.png",
        "reconstruction-gate-01.nrrd",
        "reconstruction-gate-01.png",
        "report.json",
        "slice-gate-00.png",
        "slice-gate-01.png",
        "truth-gate-00.nrrd",
        "truth-gate-00.png",
        "truth-gate-01.nrrd",
        "truth-gate-01.png",
    ];
    assert_eq!(listed, expected);
    for file in expected {
        assert!(
            std::fs::metadata(out.join(file)).unwrap().len() > 0,
            "{file}"
        );
    }
    assert!((report["numbers"]["ejection_fraction"].as_f64().unwrap() - 0.375).abs() < 1e-9);
    // 13 for the 24 phases of the masks, among them 5 for the views of 8 steps, and 12 between for the tolerance of the ground truth.
    assert_eq!(report["work"]["shapes_solved"], 25);
    assert!(report["gates"][1]["view_error"]["time"].as_f64().unwrap() > 0.0);
    check_views(&report);
    // The summary, and no output with `--quiet`.
    let again = folder.path().join("again");
    let (shown, _) = said(&heart_phantom(&[
        "run",
        scene,
        "--out",
        again.to_str().unwrap(),
        "--threads",
        "1",
    ]));
    assert!(
        shown.contains("EF 0.3750") && shown.contains("24 files"),
        "{shown}"
    );
    for file in expected.iter().filter(|file| **file != "report.json") {
        let bytes = |folder: &Path| std::fs::read(folder.join(file)).unwrap();
        assert!(
            bytes(&out) == bytes(&again),
            "{file} depends on the threads"
        );
    }
    let quiet = heart_phantom(&["--quiet", "run", scene, "--out", again.to_str().unwrap()]);
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
}

/// Step and shoot, 65 beats per minute, views one second apart, two gates: each has half of a second.
fn check_views(report: &serde_json::Value) {
    assert_eq!(report["slice_order"]["projections"], "head-to-feet");
    assert_eq!(report["slice_order"]["volumes"], "feet-to-head");
    let n = report["scene"]["camera"]["views"].as_u64().unwrap() as usize;
    for gate in 0..2 {
        let column = |name: &str| -> Vec<f64> {
            let column = report["gates"][gate]["views"][name].as_array().unwrap();
            column.iter().map(|x| x.as_f64().unwrap()).collect()
        };
        let [start, window, phase, angle] =
            ["start_s", "window_s", "phase", "angle_deg"].map(column);
        assert_eq!(
            [start.len(), window.len(), phase.len(), angle.len()],
            [n; 4]
        );
        for k in 0..n {
            let beats = k as f64 * 65.0 / 60.0;
            assert_eq!([start[k], window[k]], [k as f64, 0.5]);
            assert!((phase[k] - beats.fract()).abs() < 1e-11); // 13 digits
            assert!((angle[k] - 180.0 * k as f64 / n as f64).abs() < 1e-10);
        }
    }
}

/// The report lists the files in the directory, including data beside their headers.
#[test]
fn every_file_is_listed_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let name = serde_json::to_value(format).unwrap();
        let projections = match format.info().projections {
            Some(_) => format!("projections = {name}\n"),
            None => String::new(),
        };
        let rest = format!(
            "[acquisition]\nmode = {{ static = {{ phase = 0.0 }} }}\n[output]\nvolumes = {name}\n{projections}"
        );
        let scene = small(folder.path(), &rest);
        let out = folder.path().join(name.as_str().unwrap());
        let output = heart_phantom(&[
            "run",
            scene.to_str().unwrap(),
            "--json",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{output:?}");
        let report = json(&said(&output).0);
        let listed: BTreeSet<PathBuf> = (report["files"].as_array().unwrap().iter())
            .map(|file| out.join(file.as_str().unwrap()))
            .collect();
        let found: BTreeSet<PathBuf> = (std::fs::read_dir(&out).unwrap())
            .map(|entry| entry.unwrap().path())
            .collect();
        assert_eq!(listed, found);
    }
}

#[test]
fn check_reports_the_size_of_the_output() {
    let folder = tempfile::tempdir().unwrap();
    let rest = "[acquisition]\nmode = { gated = { gates = 2 } }\naccuracy = { steps = 4 }\n\
        [attenuation]\ncoefficient = 0.1\nmedium = 'heart'\n\
        [output]\nwrite = ['projections', 'reconstruction', 'truth', 'labels', 'attenuation']\n";
    let scene = small(folder.path(), rest);
    let (scene, out) = (scene.to_str().unwrap(), folder.path().join("out"));
    let told = json(&said(&heart_phantom(&["check", scene, "--json"])).0)["bytes"].clone();
    let run = heart_phantom(&["run", scene, "--quiet", "--out", out.to_str().unwrap()]);
    assert!(run.status.success(), "{run:?}");
    let lengths = (std::fs::read_dir(&out).unwrap()).map(|entry| entry.unwrap().path());
    // The header of such a .npy has 128 bytes.
    let written: u64 = lengths
        .filter(|path| path.extension().is_some_and(|extension| extension == "npy"))
        .map(|path| path.metadata().unwrap().len() - 128)
        .sum();
    assert_eq!(told, written);
    let (shown, _) = said(&heart_phantom(&["check", scene]));
    assert!(shown.contains(" of data in 12 files:"), "{shown}");
}

#[test]
fn truth_and_view_compute_their_part_only() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(folder.path(), "");
    let scene = scene.to_str().unwrap();
    let (shown, _) = said(&heart_phantom(&[
        "truth", scene, "--phase", "0.5", "--json",
    ]));
    let shown = json(&shown);
    let rest = shown["numbers"]["esv"].as_f64().unwrap();
    assert!((shown["cavity_ml"].as_f64().unwrap() / rest - 1.6).abs() < 1e-9);
    assert_eq!(shown["work"]["rays_cast"], 0);
    let out = folder.path().join("truth");
    assert!(
        heart_phantom(&["truth", scene, "--out", out.to_str().unwrap(), "--quiet"])
            .status
            .success()
    );
    for file in ["activity.npy", "labels.npy", "inner.stl", "outer.stl"] {
        assert!(out.join(file).exists(), "{file}");
    }
    for name in ["view.npy", "view.png"] {
        let file = folder.path().join(name);
        let output = heart_phantom(&[
            "view",
            scene,
            "--view",
            "3",
            "--out",
            file.to_str().unwrap(),
        ]);
        assert!(output.status.success() && file.exists(), "{output:?}");
    }
    let view = std::fs::read(folder.path().join("view.npy")).unwrap();
    assert!(String::from_utf8_lossy(&view).contains("'shape': (20, 24)"));
    assert_eq!(view.len(), 128 + 4 * 20 * 24);
    let beyond = heart_phantom(&["view", scene, "--view", "8", "--out", "x.npy"]);
    assert_eq!(beyond.status.code(), Some(2));
    let unknown = heart_phantom(&["view", scene, "--out", "x.tiff"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert_eq!(
        heart_phantom(&["truth", scene, "--phase", "nan"])
            .status
            .code(),
        Some(2)
    );
}

#[test]
fn view_writes_the_quantity_of_the_output() {
    let folder = tempfile::tempdir().unwrap();
    let view = |values: &str| {
        let rest = format!(
            "[noise]\ncounts = {{ per_unit = 50.0 }}\nseed = 1\n[acquisition]\nmode = {{ static = {{ phase = 0.0 }} }}\n\
             [output]\nvalues = '{values}'\n"
        );
        let (scene, file) = (
            small(folder.path(), &rest),
            folder.path().join(format!("{values}.npy")),
        );
        let (scene, out) = (scene.to_str().unwrap(), file.to_str().unwrap());
        let output = heart_phantom(&["view", scene, "--view", "3", "--out", out]);
        assert!(output.status.success(), "{output:?}");
        let samples = std::fs::read(&file).unwrap()[128..].to_vec();
        let samples = samples.as_chunks::<4>().0.iter();
        samples
            .map(|sample| f32::from_le_bytes(*sample))
            .collect::<Vec<f32>>()
    };
    let (samples, counts) = (view("normalised"), view("counts"));
    for (sample, count) in samples.iter().zip(&counts) {
        // Rounding of f32 of counts below 1000.
        assert!(count.fract() == 0.0 && (50.0 * sample - count).abs() < 1e-3);
    }
    assert!(counts.iter().any(|count| *count > 100.0));
}

#[test]
fn an_invalid_scene_is_reported_with_its_line_and_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(folder.path(), "arc = 'half'\n");
    let scene = scene.to_str().unwrap();
    let out = folder.path().join("out");
    for command in [
        &["check", scene][..],
        &["run", scene, "--out", out.to_str().unwrap()],
        &["truth", scene],
        &["view", scene, "--out", "x.npy"],
    ] {
        let output = heart_phantom(command);
        let (_, error) = said(&output);
        assert_eq!(output.status.code(), Some(2), "{error}");
        assert!(
            error.starts_with(&format!("error: {scene}:8:7: camera.arc")),
            "{error}"
        );
        assert!(!out.exists());
    }
    let output = heart_phantom(&["check", scene, "--json"]);
    let error = json(&said(&output).1);
    assert_eq!(
        (&error["line"], &error["column"], &error["field"]),
        (&8.into(), &7.into(), &"camera.arc".into())
    );
    let absent = heart_phantom(&["check", "nowhere.toml"]);
    assert_eq!(absent.status.code(), Some(2));
    assert!(said(&absent).1.contains("nowhere.toml"));
}

#[test]
fn a_read_only_directory_is_reported_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    // The computation would end with another error: no number of steps suffices.
    let rest = "[acquisition]\naccuracy = { tolerance = 1e-6 }\n";
    let scene = small(folder.path(), rest);
    let out = scene.join("out"); // a file in the way
    let (scene, file) = (scene.to_str().unwrap(), out.join("x.npy"));
    let (out, file) = (out.to_str().unwrap(), file.to_str().unwrap());
    for command in [
        &["run", scene, "--out", out][..],
        &["truth", scene, "--out", out],
        &["view", scene, "--out", file],
    ] {
        let output = heart_phantom(command);
        let (shown, error) = said(&output);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(
            error.contains("cannot write") && error.contains(out),
            "{error}"
        );
        assert!(shown.is_empty());
    }
}

#[test]
fn completions_and_manual_are_written() {
    for shell in ["bash", "zsh", "fish"] {
        let (script, _) = said(&heart_phantom(&["completions", shell]));
        assert!(
            script.contains("heart-phantom") && script.contains("completions"),
            "{shell}"
        );
    }
    let (page, _) = said(&heart_phantom(&["man"]));
    assert!(
        page.contains(".TH HEART-PHANTOM 1") && page.contains("Exit codes"),
        "{page}"
    );
    // The page names those of the commands, which can be printed, too.
    for command in ["paper", "init", "check", "run", "truth", "view"] {
        assert!(page.contains(&format!("heart\\-phantom\\-{command}(1)")));
        let (page, _) = said(&heart_phantom(&["man", command]));
        let title = format!(".TH HEART-PHANTOM-{} 1", command.to_uppercase());
        assert!(page.contains(&title), "{page}");
        assert!(
            page.contains("threads") && page.contains("\"heart-phantom 0."),
            "{page}"
        );
    }
    let (page, _) = said(&heart_phantom(&["man", "cohort", "run"]));
    assert!(page.contains(".TH HEART-PHANTOM-COHORT-RUN 1") && page.contains("threads"));
    for unknown in [&["man", "dance"][..], &["man", "cohort", "dance"]] {
        assert_eq!(heart_phantom(unknown).status.code(), Some(2));
    }
}

/// No panic if the output is full, and no error if its reader closes it.
#[cfg(target_os = "linux")]
#[test]
fn a_failing_output_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(folder.path(), "");
    let scene = scene.to_str().unwrap();
    for command in [
        &["init"][..],
        &["check", scene],
        &["check", scene, "--json"],
        &["truth", scene],
        &["completions", "bash"],
        &["man"],
    ] {
        let full = std::fs::File::create("/dev/full").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
            .args(command)
            .stdout(full)
            .output()
            .unwrap();
        let (_, error) = said(&output);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {error}");
        assert!(
            error.contains("cannot write the standard output"),
            "{error}"
        );
    }
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(["check", scene])
        .stdout(writer)
        .output()
        .unwrap();
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
}

#[test]
fn invalid_commands_are_rejected_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(folder.path(), "");
    let scene = scene.to_str().unwrap();
    let new = folder.path().join("new");
    let file = new.join("x.npy");
    let file = file.to_str().unwrap();
    for (command, says) in [
        (&["check", scene, "--threads", "0"][..], "1..=4096"),
        (&["check"], "<SCENE>"),
        (&["chekc", scene], "check"),
        (&["view", "nowhere.toml", "--out", "x.tiff"], ".npy or .png"),
        (&["view", scene, "--view", "8", "--out", file], "view is 8"),
        (&["view", scene, "--gate", "1", "--out", file], "gate is 1"),
        (&["init", scene], "the file exists"),
    ] {
        let output = heart_phantom(command);
        let (_, error) = said(&output);
        let expected = if command[0] == "init" { 1 } else { 2 };
        assert_eq!(output.status.code(), Some(expected), "{error}");
        assert!(
            error.starts_with("error: ") && error.contains(says),
            "{error}"
        );
        // The same as JSON, for any error.
        let output = heart_phantom(&[command, &["--json"]].concat());
        let error = json(&said(&output).1);
        assert_eq!(error["code"], expected, "{error}");
        assert!(error["error"].as_str().unwrap().contains(says), "{error}");
    }
    assert!(!new.exists());
}

/// A heart half outside the bins: a warning before the work, in the report, and as JSON.
#[test]
fn warnings_are_printed_by_all_commands_of_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(
        folder.path(),
        "[pose]\nshift = [6.0, 0.0, 0.0]\n[acquisition]\nmode = { static = { phase = 0.0 } }\n[output]\nwrite = []\n",
    );
    let (scene, out) = (scene.to_str().unwrap(), folder.path().join("out"));
    let out = out.to_str().unwrap();
    let view = folder.path().join("view.npy");
    let view = view.to_str().unwrap();
    for command in [
        vec!["check", scene],
        vec!["run", scene, "--out", out],
        vec!["truth", scene],
        vec!["view", scene, "--out", view],
    ] {
        let output = heart_phantom(&command);
        let (_, told) = said(&output);
        assert!(output.status.success());
        let expected = "warning: the heart needs a detector ";
        assert_eq!(told.matches(expected).count(), 1, "{told}");
        let _ = std::fs::remove_file(view);
        let with_json: Vec<&str> = command.into_iter().chain(["--json"]).collect();
        let (found, told) = said(&heart_phantom(&with_json));
        assert!(told.is_empty(), "{told}");
        let warning = &json(&found)["warnings"][0];
        assert_eq!(
            (&warning["what"], &warning["key"]),
            (&"truncated-heart".into(), &"camera.bins".into())
        );
        let [needed, seen] =
            ["needed_cm", "available_cm"].map(|key| warning[key].as_f64().unwrap());
        assert!(needed > seen && (seen - 16.8).abs() < 1e-9, "{warning}");
    }
}
