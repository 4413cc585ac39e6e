//! `docs/conventions.md` and the code that it describes change together: the page contains a hash of each such file.
//!
//! The hash excludes comments, white space and tests, so that only changes of code require a review of the page; then
//! `cargo xtask tidy --bless` updates the hashes.

use std::fs;
use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;

use super::source_rules::is_test_item;
use super::{Finding, find};
use crate::workspace::{self, TextFile};

const PAGE: &str = "docs/conventions.md";
/// Files that the page must contain if they exist.
const REQUIRED: &[&str] = &[
    "crates/radon/src/geometry.rs",
    "crates/revolve-voxel/src/solid/pose.rs",
    "crates/revolve-voxel/src/rays/detector.rs",
];
/// Prefix of the line of a file on the page; path and hash follow.
const MARK: &str = "<!-- code: ";

/// Checks the page.
pub(crate) fn check(files: &[TextFile]) -> Vec<Finding> {
    let Some(page) = find(files, PAGE) else {
        return vec![Finding::new(PAGE, 0, "missing")];
    };
    let mut findings = Vec::new();
    let mut carried = Vec::new();
    for (at, line) in page.text.lines().enumerate() {
        let Some((path, hash)) = parse(line) else {
            continue;
        };
        carried.push(path);
        match find(files, path) {
            None => findings.push(Finding::new(
                PAGE,
                at + 1,
                format!("{path} is not a file of the workspace"),
            )),
            Some(file) if hash_of_code(&file.text) != hash => {
                let message = format!(
                    "{path} has changed: is the page still correct? Then `cargo xtask tidy --bless`"
                );
                findings.push(Finding::new(PAGE, at + 1, message));
            }
            Some(_) => {}
        }
    }
    for path in REQUIRED {
        if find(files, path).is_some() && !carried.contains(path) {
            findings.push(Finding::new(
                PAGE,
                0,
                format!("contains no line `{MARK}{path} HASH -->`"),
            ));
        }
    }
    findings
}

/// Writes the current hashes to the page.
pub(crate) fn bless(root: &Path) -> Result<(), String> {
    let files =
        workspace::text_files(root).map_err(|error| format!("reading the workspace: {error}"))?;
    let page = find(&files, PAGE).ok_or_else(|| format!("{PAGE} is missing"))?;
    fs::write(root.join(PAGE), renewed(&page.text, &files))
        .map_err(|error| format!("writing {PAGE}: {error}"))
}

fn renewed(page: &str, files: &[TextFile]) -> String {
    let mut text = String::new();
    for line in page.lines() {
        match parse(line).and_then(|(path, _)| find(files, path)) {
            Some(file) => {
                text += &format!("{MARK}{} {} -->\n", file.path, hash_of_code(&file.text))
            }
            None => text += &format!("{line}\n"),
        }
    }
    text
}

/// Parses path and hash of a line of the page.
fn parse(line: &str) -> Option<(&str, &str)> {
    line.strip_prefix(MARK)?
        .strip_suffix(" -->")?
        .split_once(' ')
}

/// FNV-1a, 64 bits, of the code without comments, white space and tests.
fn hash_of_code(text: &str) -> String {
    let mut code = String::new();
    if let Ok(mut file) = syn::parse_file(text) {
        file.items.retain(|item| !is_test_item(item));
        add_code(file.into_token_stream(), &mut code);
    }
    let hash = code.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("{hash:016x}")
}

/// Appends the tokens without doc comments, which are attributes.
fn add_code(tokens: TokenStream, code: &mut String) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        let is_doc = |token: &TokenTree| {
            let text = token.to_string();
            text.starts_with("[doc =") || text.starts_with("[doc=")
        };
        if matches!(&token, TokenTree::Punct(mark) if mark.as_char() == '#') {
            let inner =
                |t: &TokenTree| matches!(t, TokenTree::Punct(mark) if mark.as_char() == '!');
            let mark = tokens.next_if(inner);
            if tokens.next_if(is_doc).is_some() {
                continue;
            }
            code.push('#');
            code.push_str(if mark.is_some() { "!" } else { "" });
            continue;
        }
        match token {
            TokenTree::Group(group) => {
                code.push('(');
                add_code(group.stream(), code);
                code.push(')');
            }
            token => {
                code.push_str(&token.to_string());
                code.push(' ');
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> TextFile {
        TextFile {
            path: path.into(),
            text: text.into(),
        }
    }

    #[test]
    fn the_page_changes_with_the_code() {
        let code = "//! Doc.\nfn centre(n: usize) -> f64 { (n - 1) as f64 / 2.0 }\n";
        let page = format!("# Page\n{MARK}{} 0 -->\nend\n", REQUIRED[0]);
        let mut files = vec![file(PAGE, &page), file(REQUIRED[0], code)];
        assert_eq!(check(&files).len(), 1, "a wrong hash is detected");
        files[0].text = renewed(&page, &files);
        assert!(files[0].text.starts_with("# Page\n") && files[0].text.ends_with("\nend\n"));
        assert_eq!(check(&files), [], "an updated hash is accepted");
        files[1].text = code
            .replace("//! Doc.", "//! Other words.")
            .replace(" { ", "\n{\n");
        assert_eq!(check(&files), [], "layout does not change the hash");
        files[1].text = code.replace("- 1", "- 0");
        assert_eq!(check(&files).len(), 1, "a half bin changes the hash");
    }

    #[test]
    fn required_files_are_on_the_page() {
        let code = file(REQUIRED[0], "fn f() {}\n");
        assert_eq!(check(&[file(PAGE, "# Page\n"), code]).len(), 1);
        assert_eq!(check(&[file(PAGE, "# Page\n")]), []);
        assert_eq!(check(&[]).len(), 1);
        assert_eq!(
            check(&[file(PAGE, &format!("{MARK}gone.rs 0 -->\n"))]).len(),
            1
        );
    }
}
