//! `cargo xtask features`: each published crate compiles without a warning with each of its features alone and with none, and the unit tests of
//! crates that have features with none. The tests of the workspace compile them with all. Its target folder is `checks` in that of
//! the workspace, so that it can run beside the compilation of the tests.

use std::process::Command;

use toml::{Table, Value};

use crate::workspace::{PUBLISHED, package_name, root, target_folder};

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err("usage: cargo xtask features".into());
    }
    for krate in PUBLISHED {
        let path = root().join("crates").join(krate).join("Cargo.toml");
        let text = std::fs::read_to_string(&path)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let manifest = text
            .parse::<Table>()
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let sets = sets(&manifest);
        let optional = sets.len() > 1;
        for features in sets {
            println!(
                "{} {}",
                package_name(krate),
                if features.is_empty() {
                    "(none)"
                } else {
                    &features
                }
            );
            check(krate, &features, ["--lib", "--bins"])?;
            // With all features they are compiled by the tests.
            if features.is_empty() && optional {
                check(krate, &features, ["--lib", "--profile=test"])?;
            }
        }
    }
    Ok(())
}

/// Compiles some targets of a crate with some features.
fn check(krate: &str, features: &str, target: [&str; 2]) -> Result<(), String> {
    let package = package_name(krate);
    let output = Command::new(env!("CARGO"))
        .args(["check", "--quiet", "--package", package])
        .args(target)
        .args(["--no-default-features", "--features", features])
        .arg("--target-dir")
        .arg(target_folder().join("checks"))
        .current_dir(root())
        .output()
        .map_err(|error| format!("cargo check: {error}"))?;
    // Prints only errors and warnings.
    match output.status.success() && output.stderr.is_empty() {
        true => Ok(()),
        false => Err(format!(
            "{package} does not compile cleanly with features `{features}` ({})\n{}",
            target.join(" "),
            String::from_utf8_lossy(&output.stderr)
        )),
    }
}

/// Returns the sets of features to try as cargo arguments: none, and each alone if there are others.
fn sets(manifest: &Table) -> Vec<String> {
    let features = manifest.get("features").and_then(Value::as_table);
    let names: Vec<String> = features
        .into_iter()
        .flat_map(Table::keys)
        .filter(|name| *name != "default")
        .cloned()
        .collect();
    let mut sets = vec![String::new()];
    if names.len() > 1 {
        sets.extend(names);
    }
    sets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_features_is_tested() {
        let sets = |text: &str| sets(&text.parse().expect("the snippet is TOML"));
        assert_eq!(sets(""), [""]);
        assert_eq!(sets("[features]\ndefault = [\"a\"]\na = []"), [""]);
        assert_eq!(
            sets("[features]\ndefault = [\"a\"]\na = []\nb = [\"a\"]"),
            ["", "a", "b"]
        );
    }
}
