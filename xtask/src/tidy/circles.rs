//! No import cycles between the files of a crate.
//!
//! A file imports another if a `use` or a path leads to it. Re-exported names (`pub use` of files below) lead to their definitions, and
//! re-exporting is not an import. Tests do not count.

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::{self, Visit};

use super::source_rules::is_test_item;
use super::{Finding, TextFile};

/// Crates without cycles.
const CRATES: [&str; 11] = [
    "heart-cohort",
    "heart-phantom",
    "heart-study",
    "membrane-forces",
    "membrane-implicit",
    "membrane-newton",
    "photon-scatter",
    "python",
    "radon",
    "revolve-voxel",
    "simd-set",
];
/// A module by its names from the crate's root; empty for the root.
type Module = Vec<String>;

/// Finds all cycles in the crates of `files`.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    within(&CRATES, files)
}

fn within(names: &[&str], files: &[TextFile]) -> Vec<Finding> {
    let mut crates: BTreeMap<&str, BTreeMap<Module, &TextFile>> = BTreeMap::new();
    for file in files {
        if let Some((name, module)) = module_of(&file.path) {
            crates.entry(name).or_default().insert(module, file);
        }
    }
    (crates.iter())
        .filter(|(name, _)| names.contains(name))
        .flat_map(|(_, files)| circles(files))
        .collect()
}

/// Returns the crate's folder and the module of a library file; programs are crates of their own.
fn module_of(path: &str) -> Option<(&str, Module)> {
    let (name, inside) = path
        .strip_prefix("crates/")
        .unwrap_or(path)
        .split_once("/src/")?;
    let mut module: Module = inside
        .strip_suffix(".rs")?
        .split('/')
        .map(String::from)
        .collect();
    if module[0] == "bin" || module == ["main"] {
        return None;
    }
    if module == ["lib"] || module.last().is_some_and(|last| last == "mod") {
        module.pop();
    }
    Some((name, module))
}

/// Finds the cycles of one crate, each reported at its first file.
fn circles(of: &BTreeMap<Module, &TextFile>) -> Vec<Finding> {
    let known: BTreeSet<Module> = of.keys().cloned().collect();
    let mut names: BTreeMap<Module, Names> = BTreeMap::new();
    for (module, file) in of {
        // The compiler reports invalid Rust.
        let Ok(parsed) = syn::parse_file(&file.text) else {
            return Vec::new();
        };
        let mut found = Names::new(module.clone(), &known);
        found.visit_file(&parsed);
        names.insert(module.clone(), found);
    }
    let imports: BTreeMap<&Module, BTreeSet<Module>> = (names.iter())
        .map(|(module, found)| {
            let defined = |path: &Module| home(path, &names, &known);
            let targets = (found.used.iter().map(defined)).filter(|target| target != module);
            (module, targets.collect())
        })
        .collect();
    let mut findings = Vec::new();
    let mut told: BTreeSet<&Module> = BTreeSet::new();
    for &module in imports.keys() {
        if told.contains(module) {
            continue;
        }
        if let Some(circle) = way_back(module, &imports) {
            told.extend(circle.iter().copied());
            let paths: Vec<&str> = circle.iter().map(|m| of[*m].path.as_str()).collect();
            let message = format!("imports in a circle: {}", paths.join(" -> "));
            findings.push(Finding::new(paths[0], 0, message));
        }
    }
    findings
}

/// Returns the shortest path from a file through others back to it.
fn way_back<'a>(
    start: &'a Module,
    imports: &'a BTreeMap<&'a Module, BTreeSet<Module>>,
) -> Option<Vec<&'a Module>> {
    let mut ways = vec![vec![start]];
    let mut seen: BTreeSet<&Module> = BTreeSet::new();
    while !ways.is_empty() {
        let mut longer = Vec::new();
        for way in ways {
            for next in &imports[way[way.len() - 1]] {
                let mut way = way.clone();
                way.push(next);
                if next == start {
                    return Some(way);
                }
                if seen.insert(next) {
                    longer.push(way);
                }
            }
        }
        ways = longer;
    }
    None
}

/// Returns the file in which a path ends, through all re-exports.
fn home(path: &Module, names: &BTreeMap<Module, Names>, known: &BTreeSet<Module>) -> Module {
    let mut path = path.clone();
    // A chain of `pub use` is at most as long as the number of files.
    for _ in 0..known.len() {
        let depth = (0..=path.len())
            .rev()
            .find(|&n| known.contains(&path[..n]))
            .unwrap_or(0);
        let (module, rest) = path.split_at(depth);
        let handed_on = rest
            .first()
            .and_then(|name| names.get(module)?.handed_on.get(name));
        match handed_on {
            Some(to) if *to != path[..=depth] => {
                path = to.iter().chain(&rest[1..]).cloned().collect();
            }
            _ => return module.to_vec(),
        }
    }
    path
}

/// The names that a file uses.
struct Names<'a> {
    known: &'a BTreeSet<Module>,
    /// The current module: that of the file, or one within it.
    at: Module,
    /// Paths from the root to another part of the crate.
    used: BTreeSet<Module>,
    /// Targets of `pub use`, by name.
    handed_on: BTreeMap<String, Module>,
    /// Targets of private `use`, by name.
    imported: BTreeMap<String, Module>,
}

impl<'a> Names<'a> {
    fn new(at: Module, known: &'a BTreeSet<Module>) -> Self {
        Self {
            known,
            at,
            used: BTreeSet::new(),
            handed_on: BTreeMap::new(),
            imported: BTreeMap::new(),
        }
    }

    /// Resolves a path of the file from the crate's root; `None` if it leads outside.
    fn rooted(&self, path: &[String]) -> Option<Module> {
        let first = path.first()?;
        let joined = |start: &[String], rest: &[String]| [start, rest].concat();
        match first.as_str() {
            "crate" => Some(path[1..].to_vec()),
            "self" => Some(joined(&self.at, &path[1..])),
            "super" => {
                let up = path.iter().take_while(|name| *name == "super").count();
                let parent = &self.at[..self.at.len().saturating_sub(up)];
                Some(joined(parent, &path[up..]))
            }
            name => {
                let child = joined(&self.at, std::slice::from_ref(first));
                match self.imported.get(name) {
                    _ if self.known.contains(&child) => Some(joined(&child, &path[1..])),
                    Some(module) => Some(joined(module, &path[1..])),
                    None => None,
                }
            }
        }
    }

    fn add_use(&mut self, tree: &syn::UseTree, before: &[String], is_public: bool) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            syn::UseTree::Path(path) => self.add_use(&path.tree, &with(&path.ident), is_public),
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.add_use(tree, before, is_public);
                }
            }
            syn::UseTree::Glob(_) => self.add_name(before, None, is_public),
            syn::UseTree::Name(name) if name.ident == "self" => {
                let last = before.last().cloned();
                self.add_name(before, last, is_public);
            }
            syn::UseTree::Name(name) => {
                self.add_name(&with(&name.ident), Some(name.ident.to_string()), is_public);
            }
            syn::UseTree::Rename(new) => {
                self.add_name(&with(&new.ident), Some(new.rename.to_string()), is_public);
            }
        }
    }

    fn add_name(&mut self, path: &[String], name: Option<String>, is_public: bool) {
        let Some(target) = self.rooted(path) else {
            return;
        };
        let own = is_public && target.starts_with(&self.at);
        if let Some(name) = name {
            let names = if is_public {
                &mut self.handed_on
            } else {
                &mut self.imported
            };
            names.insert(name, target.clone());
        }
        if !own {
            self.used.insert(target);
        }
    }
}

impl<'ast> Visit<'ast> for Names<'_> {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if !is_test_item(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        self.at.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.at.pop();
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_public = !matches!(item.vis, syn::Visibility::Inherited);
        self.add_use(&item.tree, &[], is_public);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = (path.segments.iter())
            .map(|segment| segment.ident.to_string())
            .collect();
        if names.len() > 1
            && let Some(target) = self.rooted(&names)
        {
            self.used.insert(target);
        }
        visit::visit_path(self, path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let files: Vec<TextFile> = (files.iter())
            .map(|(path, text)| TextFile {
                path: format!("crates/a/src/{path}"),
                text: (*text).to_owned(),
            })
            .collect();
        let findings = within(&["a"], &files);
        findings.into_iter().map(|found| found.message).collect()
    }

    #[test]
    fn a_cycle_of_two_is_reported() {
        let lib = ("lib.rs", "mod b;\nmod c;\npub use b::B;\npub use c::C;");
        let there = ("b.rs", "use crate::c::C;\npub struct B(C);");
        let back = ("c.rs", "pub struct C(Option<Box<crate::b::B>>);");
        let told = found(&[lib, there, back]);
        assert_eq!(
            told,
            ["imports in a circle: crates/a/src/b.rs -> crates/a/src/c.rs -> crates/a/src/b.rs"]
        );
        // A single direction is not a cycle.
        assert!(found(&[lib, there, ("c.rs", "pub struct C;")]).is_empty());
    }

    #[test]
    fn a_name_leads_to_its_definition() {
        let lib = ("lib.rs", "mod b;\nmod c;\npub use b::B;");
        // Through the root, and through a folder's re-exports.
        let through_root = ("c/d.rs", "use crate::B;");
        let folder = ("c/mod.rs", "mod d;\npub use d::D;");
        let back = ("b.rs", "use crate::c;\nfn f() { c::D::new(); }");
        assert_eq!(found(&[lib, folder, through_root, back]).len(), 1);
        assert!(found(&[lib, folder, ("c/d.rs", "use std::fmt;"), back]).is_empty());
    }

    #[test]
    fn a_parent_that_only_lists_its_children_imports_nothing() {
        let child = ("b/c.rs", "use super::Shared;");
        let lists = ("b/mod.rs", "mod c;\npub use c::C;\nstruct Shared;");
        let calls = ("b/mod.rs", "mod c;\nstruct Shared;\nfn f() { c::g(); }");
        let lib = ("lib.rs", "mod b;");
        assert!(found(&[lib, lists, child]).is_empty());
        assert_eq!(found(&[lib, calls, child]).len(), 1);
    }

    #[test]
    fn tests_are_ignored_and_inner_modules_are_resolved() {
        let lib = ("lib.rs", "mod b;\nmod c;");
        let tests = (
            "b.rs",
            "#[cfg(test)]\nmod tests {\n    use crate::c::C;\n}\npub struct B;",
        );
        let back = ("c.rs", "use crate::b::B;\npub struct C;");
        assert!(found(&[lib, tests, back]).is_empty());
        let within = (
            "b.rs",
            "mod sealed {\n    use super::B;\n    use crate::c::C;\n}\npub struct B;",
        );
        assert_eq!(found(&[lib, within, back]).len(), 1);
    }
}
