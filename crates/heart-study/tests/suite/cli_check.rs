//! `check`: errors of `run` with their lines, or its products.

use heart_phantom::Phantom;
use heart_phantom::Scene;
use std::fs;
use std::path::Path;
use std::process::Command;

const SMALL: &str = "heart.discretisation = { differences = { nodes = 41 } }\n\
    acquisition.accuracy = { steps = 4 }\n\
    camera.bins = 12\ncamera.rows = 12\ncamera.pitch = [1.3333333333333333, 1.3333333333333333]\n";

fn check(folder: &Path, scene: &str, words: &[&str]) -> (Option<i32>, String, String) {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .current_dir(folder)
        .args(["check", "scene.toml"])
        .args(words)
        .output()
        .unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|said| String::from_utf8(said).unwrap());
    (output.status.code(), out, err)
}

/// Scenes whose fields are within their ranges, but which cannot be run, with the responsible field.
const HOPELESS: [(&str, &str); 8] = [
    // Directions of 0, 180.3 and 360.7 degrees: nearly the same.
    ("camera.views = 3\ncamera.arc = 541.0", "camera.arc"),
    (
        "heart.inner = { length = 1.7623, radius = 2.4789 }\n\
         [[defects]]\nlayers = [0.2, 0.8]\ns = [0.1, 0.4]\nazimuths_degrees = [0.0, 90.0]\nactivity = 0.5",
        "defects",
    ),
    (
        // Thinner than rounding.
        "[[defects]]\nlayers = [0.2, 0.8]\ns = [0.1, 0.4]\nazimuths_degrees = [0.0, 90.0]\nactivity = 0.5\n\
         [[defects]]\nlayers = [0.5, 0.500000000000001]\ns = [0.1, 0.4]\nazimuths_degrees = [0.0, 90.0]\nactivity = 0.5",
        "defects.2",
    ),
    (
        "background = { concentration = 0.1, centre = [0.0, 0.0], semi_axes = [7.0, 3.0] }",
        "background.semi_axes",
    ),
    ("heart.outer = { length = 14.0, radius = 1.77 }", "heart"),
    (
        "camera.views = 6\n[acquisition.accuracy]\ntolerance = 1e-6",
        "acquisition.accuracy.tolerance",
    ),
    (
        "pose.shift = [0.0, 0.0, 100.0]\n[noise]\ncounts = { total = 1e6 }\nseed = 1",
        "noise.counts.total",
    ),
    (
        "activity.wall = { concentration = 0.0 }\n[noise]\ncounts = { total = 1e6 }\nseed = 1",
        "noise.counts.total",
    ),
];

#[test]
fn check_finds_the_errors_of_run_with_their_lines() {
    let folder = tempfile::tempdir().unwrap();
    for (fields, field) in HOPELESS {
        // A field must be given once.
        let small = match field {
            "acquisition.accuracy.tolerance" => {
                SMALL.replace("acquisition.accuracy = { steps = 4 }\n", "")
            }
            _ => SMALL.to_owned(),
        };
        let scene = format!("{small}{fields}\n");
        let (code, out, said) = check(folder.path(), &scene, &[]);
        assert_eq!((code, out.as_str()), (Some(2), ""), "{said}");
        assert!(said.starts_with("error: scene.toml:"), "{said}");
        assert!(said.contains(&format!(": {field}: ")), "{said}");
        let (_, out, said) = check(folder.path(), &scene, &["--json"]);
        assert!(out.is_empty());
        let said: serde_json::Value = serde_json::from_str(&said).unwrap();
        assert_eq!(said["field"], field);
        assert_eq!(said["file"], "scene.toml");
        assert!(said["line"].as_u64().unwrap() >= 1);
    }
}

/// In an address space that is too small, every command ends with an error before its work, not in an abort.
#[cfg(target_os = "linux")]
#[test]
fn each_command_checks_the_memory_first() {
    let folder = tempfile::tempdir().unwrap();
    let many = "acquisition.mode = { static = { phase = 0.3 } }\n\
        camera = { views = 3, bins = 800, rows = 800, pitch = [0.05, 0.05] }\n";
    // The samples of a view take 268 MB; this exceeds the whole address space.
    let large = "acquisition.mode = { static = { phase = 0.3 } }\n\
        camera = { views = 3, bins = 8192, rows = 8192, pitch = [0.001, 0.001] }\n\
        reconstruction.pixels = 4\n";
    let kilobytes = 240_000;
    for (scene, words) in [
        (many, "check scene.toml"),
        (many, "run scene.toml --out out"),
        (many, "truth scene.toml --phase 0.3 --out out"),
        (large, "view scene.toml --view 1 --out view.npy"),
    ] {
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let program = env!("CARGO_BIN_EXE_heart-phantom");
        let output = Command::new("sh")
            .current_dir(&folder)
            .args([
                "-c",
                &format!("ulimit -v {kilobytes}; exec {program} --threads 1 {words}"),
            ])
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("bytes of memory"), "{words}: {said}");
        assert!(
            output.status.code().is_some_and(|code| code != 0),
            "{words}: {said}"
        );
        assert!(!folder.path().join("out/report.json").exists());
    }
}

#[test]
fn check_reports_volumes_memory_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "{SMALL}camera.views = 6\nacquisition.mode = {{ gated = {{ gates = 8 }} }}\n\
         output.write = ['projections', 'reconstruction', 'truth', 'labels', 'pictures']\n"
    );
    let phantom = Phantom::new(Scene::from_toml(&text).unwrap()).unwrap();
    fs::write(folder.path().join("scene.toml"), &text).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .current_dir(folder.path())
        .args(["--json", "run", "scene.toml", "--out", "out"])
        .output()
        .unwrap();
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let (code, said, warned) = check(folder.path(), &text, &["--json"]);
    assert_eq!((code, warned.as_str()), (Some(0), ""));
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["numbers"], report["numbers"]);
    let files = said["files"].as_array().unwrap();
    let mut listed: Vec<&str> = (files.iter())
        .map(|file| file["name"].as_str().unwrap())
        .collect();
    assert_eq!(listed.last(), Some(&"report.json"));
    let mut written: Vec<&str> = (report["files"].as_array().unwrap().iter())
        .map(|file| file.as_str().unwrap())
        .collect();
    listed.sort_unstable();
    written.sort_unstable();
    assert_eq!(listed, written);
    for name in ["index.html", "curves.svg", "truth-gate-07.png", "beat.gif"] {
        assert!(listed.contains(&name), "{name}");
    }
    let bytes_of = |wanted: &str| {
        let named = files
            .iter()
            .filter(|file| file["name"].as_str().unwrap().ends_with(wanted));
        named
            .map(|file| file["bytes"].as_u64().unwrap())
            .sum::<u64>()
    };
    // 8 sets of 6 views, 8 reconstructions and ground truths of four bytes per sample, 8 volumes of one byte per sample.
    let bytes = 8 * (4 * 6 * 12 * 12 + (4 + 4 + 1) * 12 * 12 * 12);
    assert_eq!(bytes_of(".npy"), bytes);
    assert_eq!(said["bytes"], bytes_of(""));
    // With the memory of the page: the viewer, and twice the samples of all gates in 16 bytes each and six sections of them.
    let memory = serde_json::to_value(phantom.memory()).unwrap();
    let extra =
        |what: &str| said["memory"][what].as_u64().unwrap() - memory[what].as_u64().unwrap();
    let page = (32 << 20) + 2 * 16 * 8 * 12 * 12 * 12;
    assert!((page..page + (4 << 20)).contains(&extra("volumes")));
    assert!(["shapes", "views", "each_thread"].map(extra) == [0; 3]);
    let (_, said, _) = check(folder.path(), &text, &[]);
    let edv = format!(
        "EDV {:.2} mL, ESV {:.2} mL",
        report["numbers"]["edv"].as_f64().unwrap(),
        report["numbers"]["esv"].as_f64().unwrap()
    );
    for part in [
        "8 gates of 6 views",
        &edv,
        "projections-gate-00.npy 3.38 KiB",
        "report.json",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    for name in written {
        assert!(said.contains(&format!("    {name}")), "{name}: {said}");
    }
}
