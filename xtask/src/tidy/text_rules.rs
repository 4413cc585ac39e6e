//! Rules about one text file of any kind: its white space, and that it speaks of the project alone.

use super::Finding;

/// All findings in the text file at `path`.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    if !path.ends_with("Cargo.lock") {
        findings.extend(no_foreign_words(path, text));
    }
    findings.extend(clean_white_space(path, text));
    findings
}

/// Words of the places where the project is written, not of the project: folders of one machine and hosts of packages.
/// In two halves, so that this file does not hold them.
const FOREIGN: &[[&str; 2]] = &[
    ["/wo", "rk/"],
    ["/ro", "ot/"],
    ["/ho", "me/"],
    ["sand", "box"],
    ["farm", "-bench"],
    ["../sha", "red"],
    ["sha", "red/paper"],
    ["sha", "red/peers"],
    ["sha", "red/reference"],
    ["sha", "red/design"],
    ["sha", "red/style"],
    ["anch", "ors.md"],
    ["bri", "ef.md"],
    ["index.", "crates.io"],
    ["static.", "crates.io"],
    ["pythonho", "sted.org"],
    ["arti", "factory"],
];

fn no_foreign_words(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (at, line) in text.lines().enumerate() {
        let line = line.to_lowercase();
        for word in FOREIGN
            .iter()
            .map(|halves| halves.concat())
            .filter(|word| line.contains(word))
        {
            findings.push(Finding::new(
                path,
                at + 1,
                format!("`{word}` is no word of this project"),
            ));
        }
    }
    findings
}

fn clean_white_space(path: &str, text: &str) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (at, line) in text.split('\n').enumerate() {
        if line.ends_with([' ', '\t', '\r']) {
            findings.push(Finding::new(
                path,
                at + 1,
                "white space at the end of the line",
            ));
        }
    }
    if !text.is_empty() && (!text.ends_with('\n') || text.ends_with("\n\n")) {
        findings.push(Finding::new(path, 0, "the file must end with one newline"));
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_words_are_found() {
        for halves in FOREIGN {
            let text = format!("first\nsee {}x\n", halves.concat().to_uppercase());
            let lines: Vec<usize> = no_foreign_words("docs/a.md", &text)
                .iter()
                .map(|finding| finding.line)
                .collect();
            assert_eq!(lines.last(), Some(&2), "{halves:?}");
        }
        assert_eq!(
            no_foreign_words(
                "docs/a.md",
                "published on crates.io, shared by threads; work-precision\n"
            ),
            []
        );
    }

    #[test]
    fn white_space_is_clean() {
        let lines = |text| {
            clean_white_space("a.md", text)
                .iter()
                .map(|finding| finding.line)
                .collect::<Vec<_>>()
        };
        assert_eq!(lines("a\x20\nb\t\nc\r\n"), [1, 2, 3]);
        assert_eq!(lines("a"), [0]);
        assert_eq!(lines("a\n\n"), [0]);
        assert_eq!(lines("a\n\nb\n"), [0; 0]);
        assert_eq!(lines(""), [0; 0]);
    }
}
