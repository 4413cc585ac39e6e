//! Pages agree with the tree: links and tests named by the errata exist. Drawings have their own background, so that black lines are
//! visible on a dark page.

use std::collections::BTreeSet;

use super::Finding;
use crate::workspace::TextFile;

/// Pages in which names in backquotes with three or more words are tests.
const PROVED: [&str; 1] = ["docs/theory.md"];

/// Checks all pages. `exists` decides whether a path from the root is a file or folder.
pub(crate) fn check(files: &[TextFile], exists: impl Fn(&str) -> bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    for page in files.iter().filter(|file| file.path.ends_with(".md")) {
        for (at, line) in page.text.lines().enumerate() {
            for target in links(line) {
                let path = resolve(&page.path, target);
                if !exists(&path) {
                    findings.push(Finding::new(
                        &page.path,
                        at + 1,
                        format!("links to {path}, which does not exist"),
                    ));
                }
            }
        }
    }
    for drawing in files.iter().filter(|file| file.path.ends_with(".svg")) {
        if !has_background(&drawing.text) {
            let message = "no white rectangle of the drawing's size comes first";
            findings.push(Finding::new(&drawing.path, 0, message));
        }
    }
    let tests: BTreeSet<&str> = files
        .iter()
        .filter(|file| file.path.ends_with(".rs"))
        .flat_map(|file| functions(&file.text))
        .collect();
    for page in PROVED.iter().filter_map(|path| super::find(files, path)) {
        for (at, line) in page.text.lines().enumerate() {
            for name in line
                .split('`')
                .skip(1)
                .step_by(2)
                .filter(|name| is_test_name(name))
            {
                if !tests.contains(name) {
                    findings.push(Finding::new(
                        &page.path,
                        at + 1,
                        format!("no test is named `{name}`"),
                    ));
                }
            }
        }
    }
    findings
}

/// Whether the first rectangle of a drawing fills its view box with white.
fn has_background(drawing: &str) -> bool {
    let value = |tag: &str, name: &str| -> Option<String> {
        let (_, rest) = tag.split_once(&format!(" {name}=\""))?;
        Some(rest.split_once('"')?.0.to_lowercase())
    };
    let tag = |name: &str| Some(drawing.split_once(name)?.1.split_once('>')?.0);
    let (Some(svg), Some(rect)) = (tag("<svg"), tag("<rect")) else {
        return false;
    };
    let [width, height] = ["width", "height"].map(|side| value(rect, side).unwrap_or_default());
    value(svg, "viewBox") == Some(format!("0 0 {width} {height}"))
        && value(rect, "fill").is_some_and(|fill| fill == "white" || fill == "#ffffff")
}

/// Returns the targets of the Markdown links of a line that lead into the tree.
fn links(line: &str) -> impl Iterator<Item = &str> {
    line.split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target.split('#').next().unwrap_or(""))
        .filter(|target| !target.is_empty() && !target.contains("://") && !target.contains(' '))
}

/// Resolves `target` on the page at `page` to a path from the root.
fn resolve(page: &str, target: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "." | "" => {}
            ".." => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Returns the names of the functions in Rust text.
fn functions(text: &str) -> impl Iterator<Item = &str> {
    text.split("fn ")
        .skip(1)
        .filter_map(|rest| rest.split(['(', '<']).next())
}

fn is_test_name(name: &str) -> bool {
    name.matches('_').count() >= 2
        && name
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    fn findings(page: &str, text: &str) -> Vec<usize> {
        let file = |path: &str, text: &str| TextFile {
            path: path.into(),
            text: text.into(),
        };
        let files = [
            file(page, text),
            file("tests/tests/errata.rs", "#[test]\nfn eq_5_is_right() {}\n"),
        ];
        check(&files, |path| path == "docs/img/a.svg")
            .iter()
            .map(|finding| finding.line)
            .collect()
    }

    #[test]
    fn drawings_have_a_background() {
        let drawing =
            |rect: &str| format!("<svg viewBox=\"0 0 7 5\">\n{rect}<text>s</text></svg>\n");
        for good in [
            "<rect width=\"7\" height=\"5\" fill=\"white\"/>",
            "<rect x=\"0\" width=\"7\" height=\"5\" fill=\"#FFFFFF\" stroke=\"none\"/>",
        ] {
            assert!(findings("img/a.svg", &drawing(good)).is_empty());
        }
        for bad in [
            "",
            "<rect width=\"7\" height=\"5\" fill=\"none\"/>",
            "<rect width=\"6\" height=\"5\" fill=\"white\"/>",
            "<rect width=\"1\" height=\"1\"/><rect width=\"7\" height=\"5\" fill=\"white\"/>",
        ] {
            assert_eq!(findings("img/a.svg", &drawing(bad)), [0]);
        }
    }

    #[test]
    fn links_must_exist() {
        assert_eq!(
            findings("docs/a.md", "\n![A](img/a.svg) and [b](b.md)\n"),
            [2]
        );
        assert_eq!(
            findings(
                "docs/a.md",
                "[a](../docs/img/a.svg#x) [b](https://a.b/c) [c](#here)\n"
            ),
            [0; 0]
        );
        assert_eq!(findings("README.md", "![A](img/a.svg)\n"), [1]);
    }

    #[test]
    fn pages_that_name_tests_name_some_that_exist() {
        for page in PROVED {
            assert_eq!(
                findings(page, "`eq_5_is_right` and `c_x`\n`eq_6_is_right`\n"),
                [2]
            );
        }
        assert_eq!(findings("docs/a.md", "`eq_6_is_right`\n"), [0; 0]);
    }
}
