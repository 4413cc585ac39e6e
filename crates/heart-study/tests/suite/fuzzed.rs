//! Random scene and cohort files for the program. Each process has 2 GiB of address space and 60 s of processor time. None panics, is ended by
//! a signal or by the time limit, and `run` succeeds exactly if `check` accepts the file.
//!
//! `cargo test` tries a few files; `cargo xtask stress --kind fuzzed --scenes N` tries N. A file that fails is printed with its seed.
//! `STRESS_PROGRAM` is the path of another build of the program.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Files of an ordinary run.
const SCENES: u64 = 24;
/// Sections with the number of texts for each that contains it, and the alternatives of their fields; `-` omits the field.
const SCENE: &str = include_str!("fuzzed/scene.txt");
/// Complete scenes and a cohort. Sizes are reduced by `SMALLER`.
const FILES: [&str; 4] = [
    heart_cohort::Cohort::TEMPLATE,
    include_str!("../../../heart-phantom/scenes/chest.toml"),
    include_str!("../../../heart-phantom/scenes/clinical-pose.toml"),
    include_str!("../../../heart-phantom/scenes/gated-spect.toml"),
];
const SMALLER: [(&str, &str); 15] = [
    ("members = 1000", "members = 3"),
    (
        "[scene]",
        "[scene]\nheart.discretisation = { differences = { nodes = 41 } }",
    ),
    ("views = 64", "views = 4"),
    ("views = 32", "views = 4"),
    ("bins = 64", "bins = 6"),
    ("rows = 64", "rows = 5"),
    ("rows = 68", "rows = 5"),
    ("0.64, 0.64", "7.0, 7.5"),
    ("0.4, 0.4", "4.2, 4.6"),
    ("gates = 16", "gates = 2"),
    ("gates = 8", "gates = 2"),
    (
        "[collimator]",
        "[acquisition]\naccuracy = { tolerance = 0.2 }\n[collimator]",
    ),
    ("tolerance = 0.01", "tolerance = 0.2"),
    ("tolerance = 0.02", "tolerance = 0.2"),
    (
        "acquisition.mode",
        "acquisition.accuracy = { tolerance = 0.2 }\nacquisition.mode",
    ),
];
const NUMBERS: [&str; 18] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "0.5",
    "1e-300",
    "1e300",
    "nan",
    "inf",
    "-inf",
    "1e-6",
    "1e6",
    "1000",
    "65536",
    "1e-3",
    "9223372036854775807",
    "18446744073709551616",
];

struct Dice(ChaCha8Rng);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n.max(1) as u64) as usize
    }

    fn pick<'a>(&mut self, all: &[&'a str]) -> &'a str {
        all[self.below(all.len())]
    }
}

fn variable<T: std::str::FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok()?.parse().ok()
}

#[test]
fn files_give_results_or_errors() {
    let first: u64 = variable("STRESS_SEED").unwrap_or(1);
    let time = variable("STRESS_MINUTES")
        .map(|minutes: f64| Duration::from_secs_f64(60.0 * minutes.clamp(0.0, 1e5)));
    let scenes = match time {
        Some(_) => u64::MAX - first,
        None => variable("STRESS_SCENES").unwrap_or(SCENES),
    };
    let (start, next) = (Instant::now(), AtomicU64::new(first));
    let found = Mutex::new((BTreeMap::<&str, u64>::new(), Vec::new()));
    let work = || {
        while time.is_none_or(|time| start.elapsed() < time) {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= first + scenes {
                break;
            }
            let outcome = outcome(seed);
            let mut found = found.lock().unwrap();
            match outcome {
                Ok(kind) => *found.0.entry(kind).or_default() += 1,
                Err(what) => {
                    eprintln!("seed {seed}: {what}");
                    found.1.push(seed);
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
    let (kinds, failed) = found.into_inner().unwrap();
    println!("fuzzed: {kinds:?}, {} failed", failed.len());
    assert!(failed.is_empty(), "fuzzed: seeds {failed:?}");
}

/// Writes the file of a seed and gives it to the program; a failure contains the file.
fn outcome(seed: u64) -> Result<&'static str, String> {
    let mut dice = Dice(ChaCha8Rng::seed_from_u64(seed));
    let (is_cohort, text) = text(&mut dice);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.toml"), &text).unwrap();
    let ended = match is_cohort {
        true => cohort(folder.path()),
        false => scene(folder.path(), seed.is_multiple_of(8)),
    };
    ended.map_err(|what| format!("{what}\n{text}"))
}

fn scene(folder: &Path, has_page: bool) -> Result<&'static str, String> {
    let page = if has_page { "--quiet" } else { "--no-html" };
    let run = ["run", "a.toml", "--out", "out", page];
    let (code, found) = ended(folder, &["check", "a.toml"])?;
    match code {
        0 if !is_small(&found) => return Ok("accepted, too large to run"),
        0 | 2 => {}
        _ => return Err(format!("check: exit code {code}: {found}")),
    }
    match ended(folder, &run)? {
        (0, _) if code == 0 => Ok("accepted and run"),
        (2, _) if code == 2 => Ok("rejected"),
        (other, found) => Err(format!("check: exit code {code}, run: {other}: {found}")),
    }
}

/// Returns true if a run takes seconds.
fn is_small(found: &Value) -> bool {
    let number = |value: &Value| value.as_f64().unwrap_or(0.0);
    let scene = &found["scene"];
    let steps = number(&scene["acquisition"]["accuracy"]["steps"]).max(16.0);
    let method = &scene["reconstruction"]["method"]["osem"];
    let iterations = number(&method["iterations"]).max(1.0);
    // A view of a turning camera is an average over angles.
    let rotation = match scene["camera"]["rotation"] == "continuous" {
        true => 16.0,
        false => 1.0,
    };
    let memory: f64 = (found["memory"].as_object().into_iter().flatten())
        .map(|(_, bytes)| number(bytes))
        .sum();
    number(&found["samples"]) * steps < 3e4
        && number(&found["voxels"]) * iterations < 2e4
        && number(&found["bytes"]) < 2e7
        && number(&found["work"]["rays_cast"]) * rotation < 1e6
        && memory < 3e8
}

fn cohort(folder: &Path) -> Result<&'static str, String> {
    let (code, found) = ended(folder, &["cohort", "check", "a.toml", "--members", "1"])?;
    let seconds = found["members"].as_f64().unwrap_or(0.0)
        / found["members_per_second"].as_f64().unwrap_or(0.0);
    match code {
        0 if seconds > 10.0 => return Ok("cohort accepted, too large to run"),
        0 => {}
        2 => return Ok("cohort rejected"),
        _ => return Err(format!("check: exit code {code}: {found}")),
    }
    for command in ["run", "verify"] {
        let (code, found) = ended(folder, &["cohort", command, "a.toml", "--out", "out"])?;
        if code != 0 {
            return Err(format!("{command}: exit code {code}: {found}"));
        }
    }
    Ok("cohort accepted and run")
}

/// Runs the program; exit code and JSON output.
fn ended(folder: &Path, arguments: &[&str]) -> Result<(i32, Value), String> {
    let limits = "ulimit -v 2097152; ulimit -t 60; exec timeout -k 5 900 \"$@\"";
    let program = variable("STRESS_PROGRAM");
    let program = program.unwrap_or(env!("CARGO_BIN_EXE_heart-phantom").to_owned());
    let Output {
        status,
        stdout,
        stderr,
    } = Command::new("sh")
        .args(["-c", limits, "sh", &program, "--threads", "1", "--json"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&stderr);
    match status.code() {
        // 101 is a panic, 124 a wait without end, from 128 on a signal.
        Some(code @ 0..=100) if !told.contains("panicked at") => {
            let json = if code == 0 { &stdout } else { &stderr };
            let json = serde_json::from_slice(json)
                .map_err(|error| format!("{arguments:?}: {error}: {told}"))?;
            Ok((code, json))
        }
        _ => Err(format!("{arguments:?}: {status}: {told}")),
    }
}

/// Returns whether the text is a cohort, and the text.
fn text(dice: &mut Dice) -> (bool, String) {
    let kind = dice.below(12);
    let mut text = match FILES.get(kind) {
        None => drawn(dice),
        Some(file) => {
            let plain = file
                .lines()
                .map(|line| line.split('#').next().unwrap_or(line).trim_end());
            let plain: String = plain
                .filter(|line| !line.is_empty())
                .map(|line| format!("{line}\n"))
                .collect();
            let small = SMALLER
                .iter()
                .fold(plain, |text, (from, to)| text.replacen(from, to, 1));
            match kind {
                0 => small,
                _ => {
                    format!("heart.discretisation = {{ differences = {{ nodes = 41 }} }}\n{small}")
                }
            }
        }
    };
    // Half of the random scenes have no change.
    let changes = match kind < FILES.len() {
        true => 1 + dice.below(3),
        false => dice.below(6).saturating_sub(2),
    };
    for _ in 0..changes {
        text = changed(dice, text);
    }
    (kind == 0, text)
}

/// A scene of random sections and alternatives.
fn drawn(dice: &mut Dice) -> String {
    let (mut text, mut is_kept) = (String::new(), true);
    for line in SCENE.lines() {
        if line.starts_with('[') {
            let (header, one_in) = line.rsplit_once(' ').unwrap();
            is_kept = dice.below(one_in.parse().unwrap()) == 0;
            if is_kept {
                text += &format!("{header}\n");
            }
            continue;
        }
        let (key, values) = line.split_once(" = ").unwrap();
        let value = dice.pick(&values.split(" | ").collect::<Vec<_>>());
        if is_kept && value != "-" {
            text += &format!("{key} = {value}\n");
        }
    }
    text
}

/// The text with one number, line, section or character changed.
fn changed(dice: &mut Dice, text: String) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let [a, b] = [0, 1].map(|_| dice.below(lines.len()));
    match dice.below(12) {
        0 => drop(lines.remove(a)),
        1 => lines.insert(a, lines[b]),
        2 => {
            let mut sections: Vec<&str> = text.split("\n[").collect();
            let last = sections.len();
            sections.swap(dice.below(last), dice.below(last));
            return sections.join("\n[");
        }
        3 => {
            // The value of another field.
            let [key, value] = [a, b].map(|k| lines[k].split_once(" = "));
            if let (Some((key, _)), Some((_, value))) = (key, value) {
                let line = format!("{key} = {value}");
                lines[a] = &line;
                return lines.join("\n");
            }
        }
        4 => {
            let mut characters: Vec<char> = text.chars().collect();
            let at = dice.below(characters.len());
            characters[at] = [
                '[', ']', '{', '}', '=', '"', '-', '9', '.', '\n', 'e', '\u{e9}',
            ][dice.below(12)];
            return characters.into_iter().collect();
        }
        _ => {
            let places = numbers(&text);
            if let Some(place) = places.get(dice.below(places.len())) {
                let value: Result<f64, _> = text[place.clone()].parse();
                let number = match (value, dice.below(3)) {
                    (Ok(value), 0) => format!("{:?}", value * 10f64.powi(dice.below(7) as i32 - 3)),
                    (Ok(value), 1) => format!(
                        "{}",
                        (value as i64).saturating_add(dice.below(5) as i64 - 2)
                    ),
                    _ => dice.pick(&NUMBERS).to_owned(),
                };
                return [&text[..place.start], &number, &text[place.end..]].concat();
            }
        }
    }
    lines.join("\n")
}

/// The places of all numbers.
fn numbers(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let is_part = |b: u8| b.is_ascii_alphanumeric() || b"._-+\"".contains(&b);
    let mut places = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = (at..bytes.len())
            .find(|&k| !is_part(bytes[k]))
            .unwrap_or(bytes.len());
        // A piece within a character is not a number.
        if (text.get(at..end)).is_some_and(|piece| piece.parse::<f64>().is_ok()) {
            places.push(at..end);
        }
        at = end + 1;
    }
    places
}
