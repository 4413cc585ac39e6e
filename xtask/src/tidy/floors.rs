//! The layers: allowed dependencies of each crate. A crate depends only on lower layers.

use toml::{Table, Value};

use super::{Finding, find};
use crate::workspace::TextFile;

/// Each package by its folder, with its allowed dependencies. `docs/architecture.md` has the reasons.
const FLOORS: &[(&str, &[&str])] = &[
    ("crates/membrane-forces", &[]),
    ("crates/simd-set", &[]),
    ("crates/photon-scatter", &["simd-set"]),
    ("crates/revolve-voxel", &["simd-set"]),
    ("crates/radon", &["simd-set"]),
    ("crates/membrane-newton", &["membrane-forces"]),
    (
        "crates/membrane-implicit",
        &["membrane-forces", "membrane-newton"],
    ),
    ("crates/heart-phantom", BELOW),
    ("crates/heart-cohort", &["heart-phantom"]),
    ("crates/heart-study", &["heart-phantom", "heart-cohort"]),
    (
        "python",
        &["heart-phantom", "heart-cohort", "heart-study", "simd-set"],
    ),
    ("crates/heart-phantom/tests", ALL),
    ("tests", ALL),
    ("benches", ALL),
    (
        "benches/counts",
        &["membrane-newton", "revolve-voxel", "radon"],
    ),
    (
        "benches/heart",
        &[
            "benches",
            "membrane-forces",
            "membrane-newton",
            "membrane-implicit",
            "revolve-voxel",
            "radon",
            "heart-phantom",
            "heart-study",
        ],
    ),
    ("xtask", &[]),
];
/// Everything below `heart-phantom`.
const BELOW: &[&str] = &[
    "membrane-forces",
    "membrane-newton",
    "membrane-implicit",
    "photon-scatter",
    "revolve-voxel",
    "radon",
    "simd-set",
];
const ALL: &[&str] = &[
    "membrane-forces",
    "membrane-newton",
    "membrane-implicit",
    "photon-scatter",
    "revolve-voxel",
    "radon",
    "simd-set",
    "heart-phantom",
    "heart-cohort",
    "heart-study",
];

/// Checks all manifests of the workspace.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let manifests: Vec<(&str, Table)> = files
        .iter()
        .filter_map(|file| {
            let folder = file.path.strip_suffix("/Cargo.toml")?;
            Some((folder, file.text.parse().ok()?))
        })
        .collect();
    // Every name of a crate in manifests: folder and package name.
    let names: Vec<(&str, &str)> = manifests
        .iter()
        .flat_map(|(folder, manifest)| {
            let short = folder.rsplit('/').next().unwrap_or(folder);
            [(short, short), (package_name(manifest), short)]
        })
        .collect();
    let mut findings = Vec::new();
    for (folder, manifest) in &manifests {
        findings.extend(arrows_point_down(folder, manifest, &names));
    }
    if find(files, "Cargo.toml").is_none() {
        findings.push(Finding::new(
            "Cargo.toml",
            0,
            "the workspace has no manifest",
        ));
    }
    findings
}

fn package_name(manifest: &Table) -> &str {
    manifest
        .get("package")
        .and_then(|package| package.get("name"))
        .and_then(Value::as_str)
        .unwrap_or("")
}

/// Checks one manifest. `names` maps every name of a crate of the workspace to that in [`FLOORS`].
fn arrows_point_down(folder: &str, manifest: &Table, names: &[(&str, &str)]) -> Vec<Finding> {
    let path = format!("{folder}/Cargo.toml");
    let Some((_, allowed)) = FLOORS.iter().find(|(known, _)| *known == folder) else {
        return vec![Finding::new(
            &path,
            0,
            "the package has no layer: define one in xtask/src/tidy/floors.rs",
        )];
    };
    let mut findings = Vec::new();
    for (section, dependency) in dependencies(manifest) {
        let Some((_, target)) = names.iter().find(|(name, _)| *name == dependency) else {
            continue;
        };
        if !allowed.contains(target) {
            let may = if allowed.is_empty() {
                "no crate of the workspace".into()
            } else {
                allowed.join(", ")
            };
            let message =
                format!("{folder} -> {target} in [{section}]: {folder} may depend on {may}");
            findings.push(Finding::new(&path, 0, message));
        }
    }
    findings
}

/// Lists every dependency of a manifest as (section, package name), of any kind and target.
fn dependencies(manifest: &Table) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let targets = manifest.get("target").and_then(Value::as_table);
    let tables = std::iter::once((String::new(), manifest)).chain(
        targets
            .into_iter()
            .flatten()
            .filter_map(|(target, table)| Some((format!("target.{target}."), table.as_table()?))),
    );
    for (prefix, table) in tables {
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            for (key, value) in table
                .get(kind)
                .and_then(Value::as_table)
                .into_iter()
                .flatten()
            {
                let name = value.get("package").and_then(Value::as_str).unwrap_or(key);
                found.push((format!("{prefix}{kind}"), name.to_owned()));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: &[(&str, &str)] = &[
        ("membrane-forces", "membrane-forces"),
        ("membrane-newton", "membrane-newton"),
        ("radon", "radon"),
        ("radon-fbp", "radon"),
        ("tests", "tests"),
    ];

    fn findings(folder: &str, manifest: &str) -> Vec<String> {
        let manifest = manifest.parse().expect("the snippet is TOML");
        arrows_point_down(folder, &manifest, NAMES)
            .iter()
            .map(Finding::to_string)
            .collect()
    }

    #[test]
    fn dependencies_upwards_and_sideways_are_reported() {
        assert_eq!(
            findings(
                "crates/membrane-forces",
                "[dependencies]\nmembrane-newton.workspace = true"
            ),
            [
                "crates/membrane-forces/Cargo.toml: crates/membrane-forces -> membrane-newton in [dependencies]: \
              crates/membrane-forces may depend on no crate of the workspace"
            ]
        );
        let sideways = findings(
            "crates/membrane-newton",
            "[dev-dependencies]\nx = { package = \"radon-fbp\", version = \"1\" }",
        );
        assert_eq!(sideways.len(), 1);
        assert!(
            sideways[0].contains("-> radon in [dev-dependencies]"),
            "{sideways:?}"
        );
        assert!(
            sideways[0].ends_with("may depend on membrane-forces"),
            "{sideways:?}"
        );
        let on_unix = findings(
            "crates/radon",
            "[target.'cfg(unix)'.build-dependencies]\ntests = { path = \"../../tests\" }",
        );
        assert!(
            on_unix[0].contains("[target.cfg(unix).build-dependencies]"),
            "{on_unix:?}"
        );
        assert_eq!(
            findings("xtask", "[dependencies]\nradon.workspace = true").len(),
            1
        );
        assert_eq!(findings("crates/newcomer", "").len(), 1);
    }

    #[test]
    fn dependencies_downwards_are_allowed() {
        let none: [String; 0] = [];
        assert_eq!(
            findings(
                "crates/membrane-newton",
                "[dependencies]\nmembrane-forces.workspace = true\nrayon = \"1\""
            ),
            none
        );
        assert_eq!(
            findings("tests", "[dev-dependencies]\nradon.workspace = true"),
            none
        );
        assert_eq!(
            findings(
                "crates/heart-phantom",
                "[dependencies]\nradon.workspace = true"
            ),
            none
        );
    }
}
