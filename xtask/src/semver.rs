//! `cargo xtask semver`: changes of the public interfaces since the last version, by cargo-semver-checks.

use std::process::Command;

use crate::workspace::{PUBLISHED, package_name, root, run};

/// The supported version; built under `target/tools` at the first run.
const TOOL: &str = "cargo-semver-checks@0.51.0";

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err("usage: cargo xtask semver".into());
    }
    let Some(tag) = last_tag()? else {
        println!("no tag v* yet: there is no earlier version to compare with");
        return Ok(());
    };
    let tools = root().join("target/tools");
    run(Command::new(env!("CARGO"))
        .args(["install", "--quiet", "--locked", TOOL, "--root"])
        .arg(&tools)
        .current_dir(root()))?;
    let mut check = Command::new(tools.join("bin/cargo-semver-checks"));
    check.args(["semver-checks", "check-release", "--baseline-rev", &tag]);
    for krate in PUBLISHED {
        check.args(["--package", package_name(krate)]);
    }
    run(check.current_dir(root()))
}

/// Returns the newest version tag in the history of the current commit.
fn last_tag() -> Result<Option<String>, String> {
    let output = Command::new("git")
        .args(["describe", "--tags", "--abbrev=0", "--match", "v*"])
        .current_dir(root())
        .output()
        .map_err(|error| format!("git describe: {error}"))?;
    let tag = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    Ok((output.status.success() && !tag.is_empty()).then_some(tag))
}
