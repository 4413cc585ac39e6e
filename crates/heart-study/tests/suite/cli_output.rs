//! Output for people and programs: only JSON with `--json`, no control characters, short messages.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_heart-phantom");

fn heart_phantom<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Output {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(arguments);
    command.output().unwrap()
}

const SMALL: &str = "[heart]\ndiscretisation = { differences = { nodes = 51 } }\n\
    [camera]\nviews = 8\nbins = 8\nrows = 8\npitch = [2.0, 2.0]\n[acquisition]\nmode = { static = { phase = 0.0 } }\n";

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path
}

/// Returns the single JSON object of one output; the other output is empty.
fn only_json(output: &Output) -> serde_json::Value {
    let (said, other) = match output.status.success() {
        true => (&output.stdout, &output.stderr),
        false => (&output.stderr, &output.stdout),
    };
    assert!(other.is_empty(), "{output:?}");
    let value: serde_json::Value = serde_json::from_slice(said).unwrap_or_else(|error| {
        panic!("{error}: {output:?}");
    });
    assert!(value.is_object(), "{value}");
    assert_eq!(output.status.success(), value.get("error").is_none());
    value
}

#[test]
fn with_json_the_output_is_json_only() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(folder, "small.toml", SMALL);
    write(folder, "bad.toml", "[camera]\nviews = 0\n");
    write(folder, "file", "in the way");
    for command in [
        // Output of every command.
        &["init"][..],
        &["init", "new.toml"],
        &["check", "small.toml"],
        &["run", "small.toml", "--out", "out"],
        &["truth", "small.toml"],
        &["truth", "small.toml", "--out", "phase"],
        &["view", "small.toml", "--out", "view.npy"],
        &["view", "small.toml", "--out", "view.png", "--quiet"],
        &["completions", "bash"],
        &["man"],
        &["man", "run"],
        &["--help"],
        &["run", "--help"],
        &["--version"],
        // Errors of every kind.
        &[],
        &["nosuch"],
        &["man", "nosuch"],
        &["completions", "nosuch"],
        &["check"],
        &["check", "bad.toml"],
        &["check", "nowhere.toml"],
        &["check", "."],
        &["init", "small.toml"],
        &["init", "file/x.toml"],
        &["run", "small.toml", "--out", "file/x"],
        &["run", "bad.toml", "--out", "out"],
        &["truth", "small.toml", "--phase", "2"],
        &["truth", "small.toml", "--phase", "two"],
        &["view", "small.toml", "--out", "view.tiff"],
        &["view", "small.toml", "--view", "99", "--out", "view.npy"],
        &["check", "small.toml", "--threads", "0"],
        &["paper", "--out", "paper", "--size", "3"],
        &["paper", "--out", "paper", "--gain", "-1e-320"],
    ] {
        let succeeds = matches!(
            command,
            ["init" | "completions" | "man"]
                | ["init", "new.toml"]
                | ["completions", "bash"]
                | ["man", "run"]
                | [.., "--help" | "--version"]
        ) || command.len() > 1
            && command[1] == "small.toml"
            && command[0] != "init"
            && !command
                .iter()
                .any(|word| ["2", "two", "99", "0", "view.tiff", "file/x"].contains(word));
        let output = heart_phantom(folder, &[command, &["--json"]].concat());
        assert_eq!(output.status.success(), succeeds, "{command:?}: {output:?}");
        only_json(&output);
        // The option before the command.
        if let [first, ..] = command
            && !first.starts_with('-')
            && *first != "init"
        {
            // Single results do not replace those above.
            for new in ["view.npy", "view.png", "phase"].map(|name| folder.join(name)) {
                let _ = fs::rename(&new, new.with_extension("old"));
            }
            let output = heart_phantom(folder, &[&["--json"], command].concat());
            assert_eq!(output.status.success(), succeeds, "{command:?}");
            only_json(&output);
        }
    }
}

#[test]
fn help_and_version_are_printed_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for command in [
        &["--help"][..],
        &["-h"],
        &["--version"],
        &["help"],
        &["run", "--help"],
        &["check", "-h"],
        &["help", "truth"],
    ] {
        let output = heart_phantom(folder, command);
        assert_eq!((output.status.code(), output.stderr.len()), (Some(0), 0));
        let said = String::from_utf8(output.stdout).unwrap();
        let first = said.lines().next().unwrap();
        assert_eq!(said.matches(first).count(), 1, "{command:?}: {said}");
        if !command.contains(&"help") {
            let json = only_json(&heart_phantom(folder, &[command, &["--json"]].concat()));
            assert_eq!(json["text"], said);
        }
    }
    // Without a command the same help is printed, without an error message.
    let output = heart_phantom::<&str>(folder, &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    let help = heart_phantom(folder, &["-h"]).stdout;
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
    assert_eq!(said.as_bytes(), help);
}

#[test]
fn the_summary_contains_the_sampling_of_time() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let moving = SMALL.replace(
        "mode = { static = { phase = 0.0 } }",
        "mode = { gated = { gates = 2 } }\naccuracy = { tolerance = 0.05 }",
    );
    write(folder, "moving.toml", &moving);
    write(folder, "small.toml", SMALL);
    let output = heart_phantom(folder, &["run", "moving.toml", "--out", "out"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let report = fs::read_to_string(folder.join("out").join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let gates = report["gates"].as_array().unwrap();
    let error = |gate: &serde_json::Value| gate["view_error"]["total"].as_f64().unwrap();
    let worst = gates.iter().map(error).fold(0.0, f64::max);
    let steps = gates[0]["quadrature_steps"].as_u64().unwrap();
    assert!(worst > 0.0 && steps >= 8 && gates[1]["quadrature_steps"] == steps);
    let line = format!(" of the largest sample ({steps} time steps per beat)\n");
    let (before, _) = said.split_once(&line).unwrap();
    let shown = before.split_once("sample error: at most ").unwrap().1;
    // Two digits, rounded up.
    let over = shown.parse::<f64>().unwrap() / worst;
    assert!((1.0..1.1).contains(&over), "{worst} {said}");
    // A single instant is sampled exactly.
    let output = heart_phantom(folder, &["run", "small.toml", "--out", "still"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("EDV") && !said.contains("time steps"),
        "{said}"
    );
}

/// A warning is part of the single object. With a limit of four open files the two of the signal handling exceed the limit.
#[cfg(target_os = "linux")]
#[test]
fn a_warning_is_part_of_the_json() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "small.toml", SMALL);
    write(folder.path(), "bad.toml", "[camera]\nviews = 0\n");
    for scene in ["small.toml", "bad.toml"] {
        let check = |json: &str| {
            let limited = format!("ulimit -n 4; exec \"$0\" check {scene} {json}");
            let mut command = Command::new("sh");
            command.current_dir(folder.path());
            command.args(["-c", &limited, PROGRAM]).output().unwrap()
        };
        let found = only_json(&check("--json"));
        let warnings = found["warnings"].as_array().unwrap().iter();
        let mut messages = warnings.map(|warning| warning["message"].as_str().unwrap());
        let warning = messages.find(|message| message.contains("interrupt"));
        let said = String::from_utf8(check("").stderr).unwrap();
        assert!(
            said.contains(&format!("warning: {}\n", warning.unwrap())),
            "{said}"
        );
    }
}

/// A name that is not Unicode, on systems that allow it.
#[cfg(target_os = "linux")]
#[test]
fn a_file_name_that_is_not_unicode_is_escaped() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"bad\xff\x1b[31m.toml");
    fs::write(folder.path().join(name), "[camera]\nviews = 0\n").unwrap();
    let output = heart_phantom(folder.path(), &[OsStr::new("check"), name]);
    let said = String::from_utf8(output.stderr).unwrap();
    let expected = "error: bad\u{fffd}\\u{1b}[31m.toml:2:9: camera.views is 0;";
    assert!(said.starts_with(expected), "{said}");
    for (command, code) in [
        (&["check"][..], 2),
        (&["run", "--out"], 2),
        (&["view", "small.toml", "--out"], 2),
        (&["init"], 1),
    ] {
        let mut arguments: Vec<&OsStr> = command.iter().map(OsStr::new).collect();
        if command[0] == "run" {
            arguments.insert(1, name);
        }
        arguments.extend([name, OsStr::new("--json")]);
        let output = heart_phantom(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        only_json(&output);
    }
    let found = only_json(&heart_phantom(
        folder.path(),
        &[OsStr::new("check"), name, OsStr::new("--json")],
    ));
    assert_eq!(found["file"], "bad\u{fffd}\u{1b}[31m.toml");
    assert_eq!(found["field"], "camera.views");
}

/// Control characters, bidirectional marks and invisible characters.
fn moves_a_terminal(c: char) -> bool {
    c != '\n' && c.is_control() || "\u{202e}\u{2066}\u{200b}\u{feff}\u{9b}".contains(c)
}

const HOSTILE: &str =
    "\u{1b}[2J\u{1b}]0;title\u{7}\u{9b}31m\u{202e}\u{2066}\u{200b}\u{feff}\r\u{8}";

/// As escapes of TOML, which has no other notation for them.
fn escaped(text: &str) -> String {
    text.chars()
        .map(|c| format!("\\u{:04x}", c as u32))
        .collect()
}

#[test]
fn foreign_text_is_escaped_for_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let hostile = escaped(HOSTILE);
    let texts = [
        format!("[camera]\nviews = \"{hostile}\"\n"),
        format!("[camera]\n\"{hostile}\" = 1\n"),
        format!("[\"{hostile}\"]\nx = 1\n"),
        format!("[acquisition]\nmode = \"{hostile}\"\n"),
        format!("[acquisition]\nmode = {{ \"{hostile}`, expected\\n\" = 1 }}\n"),
        format!("[output]\nwrite = [\"{hostile}\"]\n"),
        // Unescaped: invalid TOML, or within a comment.
        format!("[camera]\nviews = {HOSTILE}\n"),
        format!("{HOSTILE}\n"),
        String::from("[camera]\nviews = 'x\u{202e}\u{2066}\u{200b}'\n"),
    ];
    let mut commands: Vec<Vec<String>> = Vec::new();
    for (k, text) in texts.iter().enumerate() {
        let name = format!("{k}.toml");
        write(folder, &name, text);
        commands.push(vec!["check".into(), name]);
    }
    // Names of files, and words of the command line.
    let (scene, out) = (format!("{HOSTILE}.toml"), format!("out{HOSTILE}"));
    write(folder, &scene, SMALL);
    let words = |words: &[&str]| words.iter().map(|word| String::from(*word)).collect();
    commands.push(words(&["check", &scene]));
    commands.push(words(&["run", &scene, "--out", &out]));
    commands.push(words(&["run", &scene, "--out", &format!("{scene}/{out}")]));
    commands.push(words(&["view", &scene, "--out", &out]));
    commands.push(words(&["check", HOSTILE]));
    commands.push(words(&["init", &scene]));
    commands.push(words(&["man", HOSTILE]));
    commands.push(words(&[HOSTILE]));
    commands.push(words(&["truth", &scene, "--phase", HOSTILE]));
    for command in &commands {
        for json in [&[][..], &["--json".to_owned()]] {
            let output = heart_phantom(folder, &[command, json].concat());
            for said in [&output.stdout, &output.stderr] {
                let said = String::from_utf8(said.clone()).unwrap();
                assert!(!said.contains(moves_a_terminal), "{command:?}: {said:?}");
                // Each error is one line.
                if command[0] == "check" && json.is_empty() && !output.status.success() {
                    assert_eq!(
                        said.lines().count(),
                        usize::from(!said.is_empty()),
                        "{said}"
                    );
                }
            }
        }
    }
}

#[test]
fn long_texts_are_truncated() {
    let folder = tempfile::tempdir().unwrap();
    const LENGTH: usize = 2_000_000;
    let long = "A".repeat(LENGTH);
    for (text, ends) in [
        (
            format!("[camera]\nviews = \"{long}\"\n"),
            "a non-negative integer",
        ),
        (format!("[camera]\n{long} = 1\n"), "`radius`"),
        (format!("[{long}]\nx = 1\n"), "`output`"),
        (format!("[acquisition]\nmode = \"{long}\"\n"), "`gated`"),
        (format!("x = \"{long}\n"), ""),
        (format!("{long}\n"), ""),
    ] {
        let scene = write(folder.path(), "long.toml", &text);
        for json in [&[][..], &["--json"]] {
            let arguments = [&["check", scene.to_str().unwrap()], json].concat();
            let output = heart_phantom(folder.path(), &arguments);
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(said.len() < 2000, "{} bytes", said.len());
            assert_eq!(output.status.code(), Some(2));
            // The allowed value is not truncated.
            assert!(said.contains(ends), "{said}");
            if !ends.is_empty() {
                let length = format!("... ({LENGTH} characters)");
                assert!(said.contains(&length), "{said}");
            }
        }
    }
}

#[test]
fn numbers_are_parsed_and_normalised() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "small.toml", SMALL);
    let truth =
        |phase: &str| heart_phantom(folder.path(), &["truth", "small.toml", "--phase", phase]);
    for phase in [
        "-1e-320",
        "-0.001",
        "1.0000000000000002",
        "NaN",
        "inf",
        "-1e300",
    ] {
        let output = truth(phase);
        assert_eq!(output.status.code(), Some(2), "{phase}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            said,
            format!("error: phase is {phase}, must be between 0 and 1\n")
        );
    }
    // Zero has no sign, and one is the end of the beat.
    for (phase, same) in [("-0", "0"), ("-0.0", "0"), ("1", "0"), ("1e-320", "0")] {
        let [output, other] = [phase, same].map(|phase| truth(phase).stdout);
        let [said, other] = [output, other].map(|out| String::from_utf8(out).unwrap());
        let of = |text: &str| text.split_once(": ").map(|(_, rest)| rest.to_owned());
        assert_eq!(of(&said), of(&other));
        assert!(!said.contains("-0"), "{said}");
    }
}
