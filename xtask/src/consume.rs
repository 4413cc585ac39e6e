//! `cargo xtask consume`: packs the published crates and builds a project outside the workspace with the packages.
//!
//! Users download packages, not the checkout: only here does a missing file, a path out of the crate or a dependency without a version
//! become visible. The packages are unpacked as members of a new workspace, which patches the registry with itself, because the crates need
//! each other's current version. The outside project contains the examples of the packed readmes, as tests, which `--run` runs.

use std::fs;
use std::path::Path;
use std::process::Command;

use toml::{Table, Value};

use crate::workspace::{PUBLISHED, package_name, root, run, target_folder};

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    let runs = match arguments {
        [] => false,
        [flag] if flag == "--run" => true,
        _ => return Err("usage: cargo xtask consume [--run]".into()),
    };
    let manifest = manifest()?;
    let version = version(&manifest)?;
    let folder = target_folder().join("consume");
    let outside = folder.join("outside");
    let packages = folder.join("packages");
    if packages.exists() {
        fs::remove_dir_all(&packages)
            .map_err(|error| format!("emptying {}: {error}", packages.display()))?;
    }
    for path in [&packages, &outside.join("src")] {
        fs::create_dir_all(path).map_err(|error| format!("making {}: {error}", path.display()))?;
    }

    let mut pack = Command::new(env!("CARGO"));
    pack.args([
        "package",
        "--quiet",
        "--no-verify",
        "--allow-dirty",
        "--target-dir",
    ])
    .arg(&folder)
    .current_dir(root());
    for krate in PUBLISHED {
        pack.args(["--package", package_name(krate)]);
    }
    run(&mut pack)?;

    let mut unpacked = Vec::new();
    for krate in PUBLISHED {
        let name = format!("{}-{}", package_name(krate), version);
        let archive = folder.join("package").join(format!("{name}.crate"));
        run(Command::new("tar")
            .arg("-xmzf") // times of now: packed ones are all equal, and cargo would take older builds for current
            .arg(&archive)
            .arg("-C")
            .arg(&packages))?;
        complete(&packages.join(&name))?;
        unpacked.push((package_name(krate), name));
    }

    write(
        &folder.join("Cargo.toml"),
        &workspace_manifest(&unpacked, &manifest),
    )?;
    write(
        &outside.join("Cargo.toml"),
        &outside_manifest(&unpacked, version),
    )?;
    write(&outside.join("src/lib.rs"), &outside_library(&unpacked))?;
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock"))
        .map_err(|error| format!("Cargo.lock: {error}"))?;

    let cargo = |arguments: &[&str]| {
        run(Command::new(env!("CARGO"))
            .args(arguments)
            .current_dir(&folder))
    };
    // The target folder of `cargo xtask features`, where most dependencies have been checked.
    let target = target_folder().join("checks");
    let target = target.to_str().ok_or("the target folder is not UTF-8")?;
    let shared = ["--workspace", "--all-features", "--target-dir", target];
    cargo(&[&["check", "--quiet"], &shared[..]].concat())?;
    match runs {
        true => cargo(&["test", "--package", "outside", "--doc"]),
        false => Ok(()),
    }
}

/// The workspace's manifest.
fn manifest() -> Result<Table, String> {
    let text = fs::read_to_string(root().join("Cargo.toml"))
        .map_err(|error| format!("Cargo.toml: {error}"))?;
    text.parse().map_err(|error| format!("Cargo.toml: {error}"))
}

/// The version that all published crates share.
fn version(manifest: &Table) -> Result<&str, String> {
    let package = (manifest.get("workspace")).and_then(|workspace| workspace.get("package"));
    let version = package.and_then(|package| package.get("version"));
    (version.and_then(Value::as_str))
        .ok_or_else(|| "Cargo.toml has no workspace.package.version".into())
}

/// Checks that a package contains its manifest, its licence and a readme with an example.
fn complete(package: &Path) -> Result<(), String> {
    for file in ["Cargo.toml", "README.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        if !package.join(file).is_file() {
            return Err(format!("{} has no {file}", package.display()));
        }
    }
    let readme = package.join("README.md");
    let text =
        fs::read_to_string(&readme).map_err(|error| format!("{}: {error}", readme.display()))?;
    if !text.contains("```rust") {
        return Err(format!("{} contains no example", readme.display()));
    }
    Ok(())
}

/// The manifest of the outside workspace. Profiles are those of ours, so that compiled dependencies are shared.
fn workspace_manifest(unpacked: &[(&str, String)], manifest: &Table) -> String {
    let mut text = String::from(
        "[workspace]\nresolver = \"3\"\nmembers = [\"outside\", \"packages/*\"]\n\n[patch.crates-io]\n",
    );
    for (package, folder) in unpacked {
        text += &format!("{package} = {{ path = \"packages/{folder}\" }}\n");
    }
    let profiles = manifest.iter().filter(|(key, _)| *key == "profile");
    let profiles: Table = profiles
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    text + "\n" + &profiles.to_string()
}

fn outside_manifest(unpacked: &[(&str, String)], version: &str) -> String {
    let mut text = String::from(
        "[package]\nname = \"outside\"\nversion = \"0.0.0\"\nedition = \"2024\"\npublish = false\n\n[dependencies]\n",
    );
    for (package, _) in unpacked {
        text += &format!("{package} = \"{version}\"\n");
    }
    text
}

/// A library whose documentation tests are the readmes of the packages.
fn outside_library(unpacked: &[(&str, String)]) -> String {
    let mut text = String::from("//! Uses the packed crates as their readmes say.\n");
    for (package, folder) in unpacked {
        let name = package.replace('-', "_");
        text += &format!(
            "#[doc = include_str!(\"../../packages/{folder}/README.md\")]\npub mod {name} {{}}\n"
        );
    }
    text
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("writing {}: {error}", path.display()))
}
