//! Rules about white space in any text file.

use super::Finding;

/// Checks the text file at `path`.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
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
    fn white_space_is_clean() {
        let lines = |text| {
            check("a.md", text)
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
