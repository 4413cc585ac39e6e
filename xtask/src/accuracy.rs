//! The table of `docs/accuracy.md`: its measurement, and the rule that every public tolerance and every reported error has a row.

use std::process::Command;

use syn::visit::{self, Visit};

use crate::tidy::{Finding, find};
use crate::workspace::{TextFile, root};

/// The page with the table.
const PAGE: &str = "docs/accuracy.md";
/// The lines around the measured rows of the table.
const BEGIN: &str = "| option or result | quantity | reference | norm | problems | median | 99 % | worst |\n| --- | --- | --- | --- | ---: | ---: | ---: | ---: |\n";
const END: &str = "\n\n<!-- end of the table -->";

/// Measures the rows whose names begin with `prefix`, with this number of problems each, and writes them to the page.
pub(crate) fn write_table(problems: &str, seed: u64, prefix: &str) -> Result<(), String> {
    let rows = std::env::temp_dir().join(format!("accuracy-rows-{}.md", std::process::id()));
    // Not `--release`: the profile of tests is optimised.
    let status = Command::new(env!("CARGO"))
        .args(["test", "--package", "tests", "--test", "accuracy"])
        .args(["--", "--nocapture"])
        .env("STRESS_SCENES", problems)
        .env("ACCURACY_ROWS", prefix)
        .env("STRESS_SEED", seed.to_string())
        .env("ACCURACY_TABLE", &rows)
        .current_dir(root())
        .status()
        .map_err(|error| format!("cargo test: {error}"))?;
    let read = |path| std::fs::read_to_string(path).map_err(|error| error.to_string());
    let page = root().join(PAGE);
    let text = with_rows(&read(&page)?, &read(&rows)?, prefix)?;
    std::fs::write(&page, text).map_err(|error| format!("{PAGE}: {error}"))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!(
            "some stated errors are exceeded: see {PAGE} and the output above"
        ))
    }
}

/// Returns the page with these rows instead of all whose names begin with `prefix`. A row keeps the position of its predecessor (name and
/// quantity); new ones follow the others.
fn with_rows(page: &str, rows: &str, prefix: &str) -> Result<String, String> {
    let (before, rest) = page
        .split_once(BEGIN)
        .ok_or_else(|| format!("{PAGE} has no head of the table"))?;
    let (old, after) = rest
        .split_once(END)
        .ok_or_else(|| format!("{PAGE} has no end of the table"))?;
    let key = |row: &str| row.splitn(4, '|').take(3).collect::<String>();
    let mut new: Vec<&str> = rows.lines().collect();
    let mut all = Vec::new();
    for row in old.lines() {
        match new.iter().position(|new| key(new) == key(row)) {
            Some(place) => all.push(new.remove(place)),
            None if row.starts_with(&format!("| `{prefix}")) => {}
            None => all.push(row),
        }
    }
    all.extend(new);
    Ok([before, BEGIN, &all.join("\n"), END, after].concat())
}

/// Lists public fields and accessors whose name contains `error` or `tolerance` and that the page does not name as `Type::name`.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let page = find(files, PAGE).map_or("", |page| page.text.as_str());
    let mut findings = Vec::new();
    for TextFile { path, text } in files {
        let is_library = path.starts_with("crates/") && path.contains("/src/");
        let Ok(file) = syn::parse_file(text) else {
            continue;
        };
        if !is_library {
            continue;
        }
        let mut stated = Stated::default();
        stated.visit_file(&file);
        for (line, name) in stated.found {
            if !page.contains(&format!("{name}`")) {
                let message = format!("`{name}` has no row in {PAGE}");
                findings.push(Finding::new(path, line, message));
            }
        }
    }
    findings
}

/// Lines and names, `Type::name`, of stated errors.
#[derive(Default)]
struct Stated {
    within: Vec<String>,
    found: Vec<(usize, String)>,
}

impl Stated {
    fn add(&mut self, ident: &syn::Ident) {
        let name = ident.to_string();
        // `with_tolerance` sets `tolerance`.
        if (name.contains("error") || name.contains("tolerance")) && !name.starts_with("with_") {
            let line = ident.span().start().line;
            self.found
                .push((line, [&self.within.join("::"), "::", &name].concat()));
        }
    }

    fn inside(&mut self, name: String, visit: impl FnOnce(&mut Self)) {
        self.within.push(name);
        visit(self);
        self.within.pop();
    }
}

fn is_public(visibility: &syn::Visibility) -> bool {
    matches!(visibility, syn::Visibility::Public(_))
}

impl<'ast> Visit<'ast> for Stated {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        if is_public(&item.vis) {
            self.inside(item.ident.to_string(), |me| {
                visit::visit_item_struct(me, item)
            });
        }
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        // Variants of an error enum are not stated errors.
        if is_public(&item.vis) && !item.ident.to_string().ends_with("Error") {
            self.inside(item.ident.to_string(), |me| {
                visit::visit_item_enum(me, item)
            });
        }
    }

    fn visit_variant(&mut self, variant: &'ast syn::Variant) {
        self.inside(variant.ident.to_string(), |me| {
            for ident in variant
                .fields
                .iter()
                .filter_map(|field| field.ident.as_ref())
            {
                me.add(ident);
            }
        });
    }

    fn visit_field(&mut self, field: &'ast syn::Field) {
        if let (true, Some(ident)) = (is_public(&field.vis), &field.ident) {
            self.add(ident);
        }
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        let (None, syn::Type::Path(of)) = (&item.trait_, &*item.self_ty) else {
            return;
        };
        let name = of.path.segments.last().map(|last| last.ident.to_string());
        self.inside(name.unwrap_or_default(), |me| {
            visit::visit_item_impl(me, item)
        });
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        // An accessor has only `&self`.
        if is_public(&item.vis) && item.sig.inputs.len() == 1 && item.sig.receiver().is_some() {
            self.add(&item.sig.ident);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !item
            .attrs
            .iter()
            .any(|attribute| attribute.path().is_ident("cfg"))
        {
            visit::visit_item_mod(self, item);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(page: &str, text: &str) -> Vec<String> {
        let file = |path: &str, text: &str| TextFile {
            path: path.into(),
            text: text.into(),
        };
        let files = [file(PAGE, page), file("crates/a/src/lib.rs", text)];
        check(&files)
            .into_iter()
            .map(|finding| finding.message)
            .collect()
    }

    #[test]
    fn stated_errors_have_rows() {
        let text = "pub struct A { pub view_error: f64, tolerance: f64 }
            impl A { pub fn tolerance(&self) -> f64 { 0.0 } pub fn with_tolerance(self, t: f64) -> Self { self } }
            pub enum B { C { tolerance: f64 } }
            pub enum BError { C { tolerance: f64 } }";
        assert_eq!(names("", text).len(), 3);
        assert!(
            names(
                "`a::A::view_error` `a::A::tolerance` `a::B::C::tolerance`",
                text
            )
            .is_empty()
        );
    }

    #[test]
    fn only_rows_are_replaced() {
        let page = format!("before\n{BEGIN}| `old` |{END}\nafter\n");
        let expected = format!("before\n{BEGIN}| new |\n| er |{END}\nafter\n");
        assert_eq!(with_rows(&page, "| new |\n| er |\n", ""), Ok(expected));
        let page =
            format!("{BEGIN}| `a::b` | x | 1 |\n| `b::c` | y | 2 |\n| `a::d` | z | 3 |{END}");
        let expected =
            format!("{BEGIN}| `a::b` | x | 4 |\n| `b::c` | y | 2 |\n| `a::e` | z | 5 |{END}");
        let rows = "| `a::b` | x | 4 |\n| `a::e` | z | 5 |\n";
        assert_eq!(with_rows(&page, rows, "a::"), Ok(expected));
    }
}
