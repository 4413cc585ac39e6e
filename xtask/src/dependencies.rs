//! `cargo xtask dependencies`: the dependencies of each published crate by `cargo tree`, with licences and compiler versions. Compares the
//! table in README.md.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::workspace::{PUBLISHED, package_name, root};

/// Allowed licences of dependencies.
const LICENCES: &[&str] = &[
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "Bitstream-Vera", // the font of the figures
    "0BSD",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Packages that may occur twice in a tree: `syn` runs only inside the compiler; the two halves of the PNG encoder (`png`, `flate2`) need
/// different versions of `miniz_oxide`.
const TWICE: &[&str] = &["syn", "miniz_oxide"];

/// A package of a tree: name, version, licence expression.
type Package = (String, String, String);
/// Version of a Rust compiler.
type Compiler = [u32; 3];
type Compilers = BTreeMap<(String, String), Compiler>;

/// The task.
pub(crate) fn task(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err("usage: cargo xtask dependencies".into());
    }
    let mut complaints = BTreeSet::new();
    let (own, asked_for) = compilers(&metadata()?)?;
    let readme = fs::read_to_string(root().join("README.md"))
        .map_err(|error| format!("README.md: {error}"))?;
    println!("| crate | packages, default features | packages, all features |");
    println!("| --- | ---: | ---: |");
    for krate in PUBLISHED {
        let default = parse(&tree(krate, &[])?);
        let all = parse(&tree(krate, &["--all-features"])?);
        let row = format!(
            "| {} | {} | {} |",
            package_name(krate),
            default.len(),
            all.len()
        );
        println!("{row}");
        if !readme.contains(&row) {
            complaints.insert(format!("README.md does not have the row {row}"));
        }
        complaints.extend(licences(&all));
        complaints.extend(too_new(&all, own, &asked_for));
        complaints.extend(
            duplicates(&all)
                .into_iter()
                .map(|text| format!("{krate}: {text}")),
        );
    }
    if complaints.is_empty() {
        return Ok(());
    }
    Err(complaints.into_iter().collect::<Vec<_>>().join("\n"))
}

/// Lists every package that `krate` needs at run time, itself included.
fn tree(krate: &str, flags: &[&str]) -> Result<String, String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}|{l}",
        ])
        // Gives equal counts on every machine.
        .args(["--target", "x86_64-unknown-linux-gnu"])
        .args(["--package", package_name(krate)])
        .args(flags)
        .current_dir(root())
        .output()
        .map_err(|error| format!("cargo tree: {error}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Parses a tree printed as `name vVERSION (..)|LICENCE`, each package once. Repeated packages end in ` (*)`.
fn parse(tree: &str) -> BTreeSet<Package> {
    tree.lines()
        .filter_map(|line| {
            let (package, licence) = line.split_once('|')?;
            let mut words = package.split(' ');
            let (name, version) = (words.next()?, words.next()?);
            Some((
                name.into(),
                version.into(),
                licence.trim_end_matches(" (*)").into(),
            ))
        })
        .collect()
}

/// Returns the metadata of all packages.
fn metadata() -> Result<Value, String> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--locked", "--format-version", "1"])
        .current_dir(root())
        .output()
        .map_err(|error| format!("cargo metadata: {error}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    serde_json::from_slice(&output.stdout).map_err(|error| format!("cargo metadata: {error}"))
}

/// Returns the oldest compiler that this workspace supports, and the oldest one of each package, by name and version.
fn compilers(metadata: &Value) -> Result<(Compiler, Compilers), String> {
    let asked_for: Compilers = metadata["packages"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|package| {
            let text = |key| package[key].as_str();
            let name = (text("name")?.into(), format!("v{}", text("version")?));
            Some((name, compiler(text("rust_version")?)))
        })
        .collect();
    let own = asked_for
        .iter()
        .find(|((name, _), _)| name == env!("CARGO_PKG_NAME"));
    let (_, own) = own.ok_or("cargo metadata: no rust-version of our own")?;
    Ok((*own, asked_for))
}

/// Parses `1.89.0`; missing numbers are zero.
fn compiler(version: &str) -> Compiler {
    let mut numbers = version.split('.').map(|part| part.parse().unwrap_or(0));
    std::array::from_fn(|_| numbers.next().unwrap_or(0))
}

fn too_new(packages: &BTreeSet<Package>, own: Compiler, asked_for: &Compilers) -> Vec<String> {
    let asked_for = |name: &str, version: &str| asked_for.get(&(name.into(), version.into()));
    packages
        .iter()
        .filter_map(|(name, version, _)| Some((name, version, asked_for(name, version)?)))
        .filter(|(_, _, needed)| **needed > own)
        .map(|(name, version, needed)| {
            format!("{name} {version}: needs Rust {needed:?}, we promise {own:?}")
        })
        .collect()
}

fn licences(packages: &BTreeSet<Package>) -> Vec<String> {
    packages
        .iter()
        .filter(|(_, _, licence)| !is_allowed(licence))
        .map(|(name, version, licence)| {
            format!("{name} {version}: licence `{licence}` is not on the list")
        })
        .collect()
}

/// Whether every AND-term of a licence expression has an OR-alternative on the list.
fn is_allowed(expression: &str) -> bool {
    let flat = expression.replace(['(', ')'], "").replace('/', " OR ");
    flat.split(" AND ").all(|term| {
        term.split(" OR ")
            .any(|licence| LICENCES.contains(&licence.trim()))
    })
}

fn duplicates(packages: &BTreeSet<Package>) -> Vec<String> {
    let mut versions: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (name, version, _) in packages {
        versions.entry(name).or_default().push(version);
    }
    versions
        .into_iter()
        .filter(|(name, versions)| versions.len() > 1 && !TWICE.contains(name))
        .map(|(name, versions)| format!("`{name}` in versions {}", versions.join(" and ")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TREE: &str = "top v1.0.0 (/a/b)|MIT\nlow v1.0.0|MIT/Apache-2.0\n\nlow v2.0.0|MIT\nlow v1.0.0|MIT/Apache-2.0 (*)\n";

    #[test]
    fn a_tree_is_read() {
        let packages = parse(TREE);
        assert_eq!(packages.len(), 3);
        assert_eq!(licences(&packages), [""; 0]);
        assert_eq!(
            duplicates(&packages),
            ["`low` in versions v1.0.0 and v2.0.0"]
        );
        assert_eq!(duplicates(&parse(&TREE.replace("low", "syn"))), [""; 0]);
        assert_eq!(licences(&parse("a v1.0.0|GPL-3.0\nb v1.0.0|\n")).len(), 2);
    }

    #[test]
    fn a_package_for_a_newer_compiler_is_reported() {
        let metadata = |low: &str| {
            serde_json::json!({"packages": [
                {"name": "xtask", "version": "0.0.0", "rust_version": "1.89"},
                {"name": "low", "version": "1.0.0", "rust_version": low},
                {"name": "top", "version": "1.0.0", "rust_version": null},
            ]})
        };
        let complaints = |low| {
            let (own, asked_for) = compilers(&metadata(low)).expect("our own is there");
            too_new(&parse(TREE), own, &asked_for)
        };
        assert_eq!(complaints("1.89.0"), [""; 0]);
        assert_eq!(complaints("1.9"), [""; 0]);
        assert_eq!(
            complaints("1.89.1"),
            ["low v1.0.0: needs Rust [1, 89, 1], we promise [1, 89, 0]"]
        );
    }

    #[test]
    fn licence_expressions_are_read() {
        assert!(is_allowed("(MIT OR Apache-2.0) AND Unicode-3.0"));
        assert!(is_allowed("GPL-3.0 OR MIT"));
        assert!(is_allowed("Apache-2.0 WITH LLVM-exception"));
        assert!(!is_allowed("MIT AND GPL-3.0"));
        assert!(!is_allowed(""));
    }
}
