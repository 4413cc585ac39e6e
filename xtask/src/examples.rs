//! `cargo xtask examples`: runs the examples of the published crates in a temporary directory and requires the exit code 0.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::workspace::{PUBLISHED, root, run, target_folder};

/// Arguments of examples that take minutes without them.
const SMALL: &[(&str, &str)] = &[("gated_spect", "24")];
/// Examples that take minutes at any size: compiled only.
const LONG: &[&str] = &["ejection_fraction", "one_frame"];

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err("usage: cargo xtask examples".into());
    }
    // Of the whole workspace: features and profile are those of `cargo test --workspace`, which has compiled the examples.
    run(Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--workspace", "--examples"])
        .current_dir(root()))?;
    let programs = target_folder().join("debug/examples");
    let out = std::env::temp_dir().join(format!("examples-{}", std::process::id()));
    for krate in PUBLISHED {
        let names = names(&root().join("crates").join(krate).join("examples"))?;
        if names.is_empty() {
            return Err(format!("{krate} has no example"));
        }
        for name in names.iter().filter(|name| !LONG.contains(&name.as_str())) {
            let folder = out.join(name);
            run_in(&programs.join(name), name, &folder)
                .map_err(|error| format!("{krate}: {error}"))?;
        }
    }
    fs::remove_dir_all(&out).map_err(|error| format!("{}: {error}", out.display()))
}

/// Runs an example in a new directory; its output is printed only if it fails.
fn run_in(program: &Path, name: &str, folder: &Path) -> Result<(), String> {
    let failed = |error| format!("{}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(failed)?;
    let start = Instant::now();
    let small = SMALL.iter().filter(|(example, _)| *example == name);
    let done = Command::new(program)
        .args(small.map(|(_, argument)| argument))
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    println!("{:6.1} s  {name}", start.elapsed().as_secs_f64());
    match done.status.success() {
        true => Ok(()),
        false => Err(format!(
            "the example {name} ended with {}\n{}{}",
            done.status,
            String::from_utf8_lossy(&done.stdout),
            String::from_utf8_lossy(&done.stderr)
        )),
    }
}

/// Returns the names of the examples in a directory, sorted.
fn names(folder: &Path) -> Result<Vec<String>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut names: Vec<String> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    names.sort();
    Ok(names)
}
