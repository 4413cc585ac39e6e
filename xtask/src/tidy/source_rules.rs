//! Rules about a Rust file that no lint checks: its first line, its length, the fields of errors.

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

use super::Finding;

/// Longest file, in lines outside `#[cfg(test)]`.
const MAX_LINES: usize = 500;
/// The only folders with `unsafe`.
const UNSAFE_FOLDERS: [&str; 2] = ["crates/radon/src/simd/", "crates/simd-set/src/"];
/// Files that plan transforms, for concrete types: in generic code every crate that makes a plan would compile the whole FFT again.
const FFT_FILES: [&str; 2] = ["crates/radon/src/fft.rs", "crates/radon/src/filter.rs"];
/// Comment that allows a `String` in a field of an error, followed by the reason.
const ALLOW_STRING: &str = "// tidy: allow string:";

/// Checks the Rust file at `path`.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !text.starts_with("//!") {
        let message = "the first line must be a `//!` line that describes the file";
        findings.push(Finding::new(path, 1, message));
    }
    for (at, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("#[ignore") {
            let message = "`#[ignore]`: make the test run, or guard it by a documented variable";
            findings.push(Finding::new(path, at + 1, message));
        }
        let names = |mark| line.trim_start().starts_with(mark) && line.contains("unsafe_code");
        let allows = names("#") || names("unsafe_code");
        if allows && !UNSAFE_FOLDERS.iter().any(|folder| path.starts_with(folder)) {
            let message = format!("`unsafe` outside {}", UNSAFE_FOLDERS.join(" and "));
            findings.push(Finding::new(path, at + 1, message));
        }
    }
    // Sources outside libraries have no limit and no interface.
    if let (true, Ok(file)) = (is_library_source(path), syn::parse_file(text)) {
        findings.extend(not_too_long(path, text, &file));
        findings.extend(errors_are_typed(path, text, &file));
        findings.extend(what_grows_says_so(path, &file));
        if !FFT_FILES.contains(&path) {
            findings.extend(transforms_are_planned_once(path, &file));
        }
    }
    findings
}

fn is_library_source(path: &str) -> bool {
    path.starts_with("python/src/") || path.starts_with("crates/") && path.contains("/src/")
}

/// Whether an item is compiled for tests only.
pub(super) fn is_test_item(item: &syn::Item) -> bool {
    let attributes = match item {
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute
                .parse_args::<syn::Path>()
                .is_ok_and(|of| of.is_ident("test") || of.is_ident("doctest"))
    })
}

fn lines_of(span: Span) -> usize {
    span.end().line + 1 - span.start().line
}

fn not_too_long(path: &str, text: &str, file: &syn::File) -> Option<Finding> {
    let tests: usize = (file.items.iter())
        .filter(|item| is_test_item(item))
        .map(|item| lines_of(item.span()))
        .sum();
    let count = text.lines().count() - tests;
    (count > MAX_LINES).then(|| {
        let message = format!("{count} lines outside tests, {MAX_LINES} allowed: one idea a file");
        Finding::new(path, 0, message)
    })
}

fn transforms_are_planned_once(path: &str, file: &syn::File) -> Vec<Finding> {
    #[derive(Default)]
    struct Planners(Vec<usize>);
    impl<'ast> Visit<'ast> for Planners {
        fn visit_ident(&mut self, ident: &'ast syn::Ident) {
            if ident == "FftPlanner" || ident == "RealFftPlanner" {
                self.0.push(ident.span().start().line);
            }
        }
    }
    let mut planners = Planners::default();
    planners.visit_file(file);
    let message = format!("transforms are planned in {}", FFT_FILES.join(" and "));
    (planners.0.into_iter())
        .map(|line| Finding::new(path, line, message.clone()))
        .collect()
}

/// Errors and reports are `non_exhaustive`; `docs/architecture.md` has the whole rule.
fn what_grows_says_so(path: &str, file: &syn::File) -> Vec<Finding> {
    let of = |item: &syn::Item| match item {
        syn::Item::Enum(item) if item.ident.to_string().ends_with("Error") => {
            Some((item.vis.clone(), item.attrs.clone(), item.ident.clone()))
        }
        syn::Item::Struct(item) if item.ident.to_string().ends_with("Report") => {
            Some((item.vis.clone(), item.attrs.clone(), item.ident.clone()))
        }
        _ => None,
    };
    (file.items.iter().filter_map(of))
        .filter(|(visible, attributes, _)| {
            let grows = |attribute: &syn::Attribute| attribute.path().is_ident("non_exhaustive");
            matches!(visible, syn::Visibility::Public(_)) && !attributes.iter().any(grows)
        })
        .map(|(_, _, name)| {
            let message =
                format!("`{name}` must be `#[non_exhaustive]`, as all errors and reports");
            Finding::new(path, name.span().start().line, message)
        })
        .collect()
}

fn errors_are_typed(path: &str, text: &str, file: &syn::File) -> Vec<Finding> {
    let mut strings = Strings::default();
    strings.visit_file(file);
    let lines: Vec<&str> = text.lines().collect();
    let is_allowed =
        |line: usize| line > 1 && lines[line - 2].trim_start().starts_with(ALLOW_STRING);
    (strings.at.into_iter())
        .filter(|&line| !is_allowed(line))
        .map(|line| {
            let message = format!(
                "a `String` in an error: use numbers and types (or `{ALLOW_STRING} reason` above it)"
            );
            Finding::new(path, line, message)
        })
        .collect()
}

/// Lines of `String`s in types whose name ends in `Error`.
#[derive(Default)]
struct Strings {
    inside: bool,
    at: Vec<usize>,
}

impl<'ast> Visit<'ast> for Strings {
    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.inside = item.ident.to_string().ends_with("Error");
        visit::visit_item_enum(self, item);
        self.inside = false;
    }

    fn visit_ident(&mut self, ident: &'ast syn::Ident) {
        if self.inside && ident == "String" {
            self.at.push(ident.span().start().line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "crates/a/src/x.rs";

    #[track_caller]
    fn breaks(text: &str, line: usize) {
        let findings = check(FILE, text);
        let at: Vec<usize> = findings.iter().map(|finding| finding.line).collect();
        assert_eq!(at, [line], "{findings:?}");
    }

    #[track_caller]
    fn keeps(path: &str, text: &str) {
        assert_eq!(check(path, text), []);
    }

    #[test]
    fn a_file_begins_with_a_doc_line() {
        breaks("// not this\nfn f() {}\n", 1);
        breaks("", 1);
        keeps(FILE, "//! This.\nfn f() {}\n");
    }

    #[test]
    fn a_file_is_not_too_long_outside_tests() {
        let limit = format!("//! This.\n{}", "struct X;\n".repeat(MAX_LINES - 1));
        keeps(FILE, &limit);
        breaks(&format!("{limit}struct X;\n"), 0);
        let tests = format!(
            "#[cfg(test)]\nmod tests {{\n{}}}\n",
            "struct X;\n".repeat(MAX_LINES)
        );
        keeps(FILE, &format!("{limit}{tests}"));
        keeps("crates/a/tests/x.rs", &limit.repeat(2));
    }

    #[test]
    fn unsafe_is_allowed_in_two_folders() {
        let allows = "//! This.\n#![allow(unsafe_code)]\n";
        breaks(allows, 2);
        breaks(
            "//! This.\n#![allow(\n    missing_docs,\n    unsafe_code\n)]\n",
            4,
        );
        keeps(&format!("{}mod.rs", UNSAFE_FOLDERS[0]), allows);
    }

    #[test]
    fn transforms_are_planned_where_types_are_known() {
        let plans = "//! This.\nfn f<T>() { RealFftPlanner::<T>::new(); }\n";
        breaks(plans, 2);
        keeps(FFT_FILES[0], plans);
        keeps("crates/a/tests/x.rs", plans);
    }

    #[test]
    fn errors_and_reports_may_grow() {
        breaks("//! This.\npub enum AnyError { Bad }\n", 2);
        breaks("//! This.\npub struct RunReport { pub n: usize }\n", 2);
        keeps(
            FILE,
            "//! This.\n#[non_exhaustive]\npub enum AnyError { Bad }\n",
        );
        keeps(
            FILE,
            "//! This.\npub(crate) struct RunReport;\npub struct Place;\n",
        );
    }

    #[test]
    fn no_test_is_ignored() {
        breaks("//! This.\n#[test]\n#[ignore = \"slow\"]\nfn f() {}", 3);
    }

    #[test]
    fn errors_contain_no_prose() {
        breaks("//! This.\nenum SolveError {\n    Other(String),\n}", 3);
        breaks(
            "//! This.\nenum E2Error {\n A {\n  why: Option<String>,\n },\n}\nstruct S(String);",
            4,
        );
        keeps(
            FILE,
            "//! This.\nenum SceneError {\n    // tidy: allow string: the parser's own words\n    Toml { message: String },\n}",
        );
        keeps(
            FILE,
            "//! This.\nenum AError {\n    TooSmall { given: f64 },\n}\nenum Kind {\n    Named(String),\n}",
        );
    }
}
