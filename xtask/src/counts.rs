//! `cargo xtask counts`: instructions of ten kernels on one thread, by valgrind's callgrind, against those of `benches/counts/counts.txt`.
//!
//! Unlike times, counts do not depend on the load of the machine. Valgrind presents a CPU with AVX2 and without AVX-512, so that all plans select
//! AVX2; on a host without AVX2 the counts are not comparable. They depend on the compiler, which the file names.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::workspace::{root, run, target_folder};

/// Largest relative change.
const MOST: f64 = 0.02;
/// Instruction set of the counts.
const SET: &str = "Avx2";

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let is_update = match arguments {
        [] => false,
        [only] if only == "--update" => true,
        _ => return Err("usage: cargo xtask counts [--update]".into()),
    };
    let Ok((valgrind, _)) = output(Command::new("valgrind").arg("--version")) else {
        println!("valgrind is not installed: no instructions counted");
        return Ok(());
    };
    run(Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--release"])
        .args(["--package", "counts"])
        .current_dir(root()))?;
    let program = target_folder().join("release/counts");
    let (listed, _) = output(Command::new("valgrind").arg("--tool=none").arg(&program))?;
    let (set, names) = listed.split_once('\n').unwrap_or_default();
    if set != SET {
        println!("valgrind presents a CPU with {set}; the counts are those of {SET}");
        return Ok(());
    }
    let mut found = BTreeMap::new();
    for name in names.lines() {
        let count = instructions(&program, name)?;
        println!("{count:12} {name}");
        found.insert(name.to_owned(), count);
    }
    let (compiler, _) = output(Command::new("rustc").arg("--version"))?;
    let head = format!("# {SET}, {}, {}", compiler.trim(), valgrind.trim());
    let path = root().join("benches/counts/counts.txt");
    let failed = |error| format!("{}: {error}", path.display());
    if is_update {
        let mut text = format!("{head}: cargo xtask counts --update\n");
        for (name, count) in &found {
            let _ = writeln!(text, "{name} {count}");
        }
        return fs::write(&path, text).map_err(failed);
    }
    let stored = fs::read_to_string(&path).map_err(failed)?;
    if !stored.starts_with(&head) {
        println!(
            "other versions: {head}\nin the file:    {}",
            stored.lines().next().unwrap_or("")
        );
    }
    let changed = changed(&found, &parse(&stored)?);
    match changed.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "{}\nif this is intended: cargo xtask counts --update",
            changed.join("\n")
        )),
    }
}

/// Returns the number of instructions within the function `collected` of a kernel.
fn instructions(program: &Path, name: &str) -> Result<u64, String> {
    let (_, errors) = output(
        Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg("--toggle-collect=*collected*")
            .arg(program)
            .arg(name),
    )?;
    let line = errors
        .lines()
        .find_map(|line| line.split_once("Collected :"));
    let count = line.and_then(|(_, count)| count.trim().parse().ok());
    match count {
        Some(count) if count > 0 => Ok(count),
        _ => Err(format!("callgrind counted nothing of {name}\n{errors}")),
    }
}

/// Returns what a command printed to its output and its errors.
fn output(command: &mut Command) -> Result<(String, String), String> {
    let done = command
        .output()
        .map_err(|error| format!("{command:?}: {error}"))?;
    let [out, errors] =
        [done.stdout, done.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    match done.status.success() {
        true => Ok((out, errors)),
        false => Err(format!("{command:?} failed\n{errors}")),
    }
}

/// Parses the lines `name count` of the file.
fn parse(text: &str) -> Result<BTreeMap<String, u64>, String> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let (name, count) = line.split_once(' ')?;
            Some((name.to_owned(), count.parse().ok()?))
        })
        .collect::<Option<_>>()
        .ok_or_else(|| "benches/counts/counts.txt has a line that is not `name count`".into())
}

/// Returns a line for each kernel whose count changed by more than [`MOST`], or that is new or absent.
fn changed(found: &BTreeMap<String, u64>, stored: &BTreeMap<String, u64>) -> Vec<String> {
    let mut lines = Vec::new();
    for (name, &count) in found {
        match stored.get(name) {
            None => lines.push(format!("{name} is not in benches/counts/counts.txt")),
            Some(&before) => {
                let change = count as f64 / before as f64 - 1.0;
                if count.abs_diff(before) as f64 > MOST * before as f64 {
                    lines.push(format!(
                        "{name}: {before} -> {count}, {:+.1} %",
                        100.0 * change
                    ));
                }
            }
        }
    }
    let absent = stored.keys().filter(|name| !found.contains_key(*name));
    lines.extend(absent.map(|name| format!("{name} is not among the kernels")));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_of_more_than_two_percent_are_reported() {
        let stored =
            parse("# of a compiler\na 1000\nb 1000\nc 1000\nd 1000\n").expect("it has this form");
        let found = parse("a 1020\nb 1021\nc 979\ne 5").expect("it has this form");
        assert_eq!(
            changed(&found, &stored),
            [
                "b: 1000 -> 1021, +2.1 %",
                "c: 1000 -> 979, -2.1 %",
                "e is not in benches/counts/counts.txt",
                "d is not among the kernels"
            ]
        );
        assert!(parse("a many").is_err() && parse("a").is_err());
    }
}
