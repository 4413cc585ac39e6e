//! Rules about manifests and the files beside them: the requirements of publication.

use toml::{Table, Value};

use super::{Finding, find};
use crate::workspace::{PUBLISHED, TextFile, package_name};

/// The texts of both licences.
const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

/// Checks all manifests of the workspace.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for file in files
        .iter()
        .filter(|file| file.path == "Cargo.toml" || file.path.ends_with("/Cargo.toml"))
    {
        match file.text.parse() {
            Ok(manifest) => findings.extend(one_manifest(&file.path, &manifest)),
            Err(error) => findings.push(Finding::new(&file.path, 0, format!("no TOML: {error}"))),
        }
    }
    findings.extend(same_lints(files));
    for name in LICENCES {
        if find(files, name).is_none() {
            findings.push(Finding::new(name, 0, "missing"));
        }
    }
    for krate in PUBLISHED {
        for name in ["Cargo.toml", "README.md"].into_iter().chain(LICENCES) {
            let path = format!("crates/{krate}/{name}");
            let Some(copy) = find(files, &path) else {
                let message = "missing: the package must contain it";
                findings.push(Finding::new(&path, 0, message));
                continue;
            };
            let original = find(files, name).filter(|_| LICENCES.contains(&name));
            if original.is_some_and(|original| original.text != copy.text) {
                let message = format!("differs from {name} of the workspace");
                findings.push(Finding::new(&path, 0, message));
            }
        }
    }
    findings
}

fn one_manifest(path: &str, manifest: &Table) -> Vec<Finding> {
    let mut findings = versions_beside_paths(path, manifest);
    if manifest.contains_key("package") {
        findings.extend(package_fields(path, manifest));
    }
    findings
}

/// The Python package is a workspace of its own, with the same lints.
fn same_lints(files: &[TextFile]) -> Option<Finding> {
    let lints = |path| {
        let manifest: Table = find(files, path)?.text.parse().ok()?;
        manifest.get("workspace")?.get("lints").cloned()
    };
    const PYTHON: &str = "python/Cargo.toml";
    let differs = find(files, PYTHON).is_some() && lints(PYTHON) != lints("Cargo.toml");
    differs.then(|| Finding::new(PYTHON, 0, "its lints differ from those of the workspace"))
}

/// A dependency by path needs a version for publication.
fn versions_beside_paths(path: &str, manifest: &Table) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (section, value) in manifest {
        let Some(table) = value.as_table() else {
            continue;
        };
        if section.ends_with("dependencies") {
            for (name, dependency) in table {
                if dependency.get("path").is_some() && dependency.get("version").is_none() {
                    findings.push(Finding::new(
                        path,
                        0,
                        format!("`{name}` has a path and no version"),
                    ));
                }
            }
        } else {
            findings.extend(versions_beside_paths(path, table));
        }
    }
    findings
}

/// Fields of every package, and additional ones of published packages.
fn package_fields(path: &str, manifest: &Table) -> Vec<Finding> {
    let mut needed = vec![
        "package.license",
        "package.description",
        "package.edition",
        "package.rust-version",
        "lints.workspace",
    ];
    let folder = path
        .strip_prefix("crates/")
        .and_then(|rest| rest.strip_suffix("/Cargo.toml"))
        .filter(|folder| !folder.contains('/')); // a package of tests in a published one
    if folder.is_some() {
        needed.extend([
            "package.keywords",
            "package.categories",
            "package.readme",
            "package.metadata.docs.rs",
        ]);
    }
    let mut findings = Vec::new();
    for field in needed {
        let mut keys = field.split('.');
        let table = keys.next().and_then(|key| manifest.get(key));
        if keys.fold(table, |table, key| table?.get(key)).is_none() {
            findings.push(Finding::new(path, 0, format!("`{field}` is missing")));
        }
    }
    let text = |table: &str, key: &str| {
        manifest
            .get(table)
            .and_then(|table| table.get(key))
            .and_then(Value::as_str)
    };
    let publishes = manifest
        .get("package")
        .and_then(|package| package.get("publish"))
        != Some(&Value::Boolean(false));
    if publishes != folder.is_some() {
        findings.push(Finding::new(
            path,
            0,
            "packages in crates/ are published, all others say `publish = false`",
        ));
    }
    if let Some(folder) = folder {
        let package = package_name(folder);
        if text("package", "name") != Some(package) {
            findings.push(Finding::new(
                path,
                0,
                format!("the package must be named `{package}`"),
            ));
        }
        if folder == "radon" && text("lib", "name") != Some("radon") {
            findings.push(Finding::new(
                path,
                0,
                "the library of radon-fbp must be named `radon`",
            ));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(path: &str, manifest: &str) -> Vec<String> {
        let manifest = manifest.parse().expect("the snippet is TOML");
        one_manifest(path, &manifest)
            .into_iter()
            .map(|finding| finding.message)
            .collect()
    }

    const COMPLETE: &str = "lints.workspace = true\n[package]\nname = \"radon-fbp\"\nlicense.workspace = true\ndescription = \"x\"\nedition = \"2024\"\n\
        rust-version = \"1.89\"\nkeywords = [\"a\"]\ncategories = [\"b\"]\nreadme = \"README.md\"\n\
        [package.metadata.docs.rs]\nall-features = true\n[lib]\nname = \"radon\"\n";

    #[test]
    fn the_package_of_python_has_the_workspaces_lints() {
        let file = |path: &str, value: &str| TextFile {
            path: path.into(),
            text: format!("[workspace.lints.rust]\nmissing_docs = \"{value}\"\n"),
        };
        let root = file("Cargo.toml", "warn");
        assert!(
            same_lints(&[
                file("Cargo.toml", "warn"),
                file("python/Cargo.toml", "warn")
            ])
            .is_none()
        );
        assert!(
            same_lints(&[
                file("Cargo.toml", "warn"),
                file("python/Cargo.toml", "allow")
            ])
            .is_some()
        );
        assert!(same_lints(&[root]).is_none());
    }

    #[test]
    fn a_path_needs_a_version() {
        assert_eq!(
            findings(
                "Cargo.toml",
                "[workspace.dependencies]\na = { path = \"a\" }"
            ),
            ["`a` has a path and no version"]
        );
        assert_eq!(
            findings(
                "Cargo.toml",
                "[target.x.dependencies]\na = { path = \"a\" }"
            )
            .len(),
            1
        );
        assert!(
            findings(
                "Cargo.toml",
                "[dependencies]\na = { path = \"a\", version = \"1\" }\nb = \"1\""
            )
            .is_empty()
        );
    }

    #[test]
    fn a_published_package_is_complete() {
        assert!(findings("crates/radon/Cargo.toml", COMPLETE).is_empty());
        for line in COMPLETE
            .lines()
            .filter(|line| line.contains('=') && !line.starts_with("all-features"))
        {
            let without = COMPLETE.replace(line, "");
            assert!(
                !findings("crates/radon/Cargo.toml", &without).is_empty(),
                "nothing found without: {line}"
            );
        }
        assert!(
            !findings(
                "crates/radon/Cargo.toml",
                &COMPLETE.replace("radon-fbp", "radon")
            )
            .is_empty()
        );
    }

    #[test]
    fn packages_outside_crates_stay_unpublished() {
        let manifest = "lints.workspace = true\n[package]\nname = \"x\"\nlicense = \"MIT\"\ndescription = \"x\"\nedition = \"2024\"\nrust-version = \"1.89\"\n";
        assert_eq!(findings("xtask/Cargo.toml", manifest).len(), 1);
        let publish = manifest.replace("[package]\n", "[package]\npublish = false\n");
        assert!(findings("xtask/Cargo.toml", &publish).is_empty());
    }

    #[test]
    fn each_crate_folder_has_readme_and_licence() {
        let file = |path: &str, text: &str| TextFile {
            path: path.into(),
            text: text.into(),
        };
        let mut files = Vec::from(LICENCES.map(|name| file(name, name)));
        for krate in PUBLISHED {
            let manifest = COMPLETE.replace("radon-fbp", package_name(krate));
            files.push(file(&format!("crates/{krate}/Cargo.toml"), &manifest));
            files.push(file(&format!("crates/{krate}/README.md"), "x"));
            files.extend(LICENCES.map(|name| file(&format!("crates/{krate}/{name}"), name)));
        }
        assert_eq!(check(&files), []);
        files.last_mut().expect("just filled").text = "other".into();
        assert_eq!(check(&files).len(), 1);
        files.retain(|file| file.path != "crates/radon/README.md");
        assert_eq!(check(&files).len(), 2);
    }
}
