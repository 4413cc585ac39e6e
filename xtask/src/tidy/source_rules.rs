//! Rules about one Rust file: how it begins, how long it is, and the words it may not hold.

use super::Finding;
use super::rust_text::{self, Line, comments_for, token_positions};

/// Longest file, in lines outside `#[cfg(test)]`.
const MAX_LINES: usize = 600;
/// The only folder where `unsafe` may stand.
const UNSAFE_FOLDER: &str = "crates/radon/src/simd/";
/// Where transforms are planned, for types that are known: in generic code every crate that makes a plan would compile all of the FFT
/// again.
const FFT_FILES: [&str; 2] = ["crates/radon/src/compiled.rs", "crates/radon/src/filter.rs"];
/// Comment that lets one error variant hold a `String`, followed by the reason.
const ALLOW_STRING: &str = "tidy: allow string:";

/// All findings in the Rust file at `path`.
pub(crate) fn check(path: &str, text: &str) -> Vec<Finding> {
    let lines = rust_text::lines(text);
    let mut findings = Vec::new();
    for rule in [
        begins_with_doc,
        not_too_long,
        unsafe_in_its_place,
        transforms_are_planned_once,
        panics_have_reasons,
        nothing_left_behind,
        errors_are_typed,
    ] {
        findings.extend(rule(path, &lines));
    }
    findings
}

/// Whether the whole file is test code.
fn is_test_file(path: &str) -> bool {
    path.starts_with("tests/") || path.contains("/tests/") || path.ends_with("/tests.rs")
}

fn is_library_source(path: &str) -> bool {
    path.starts_with("crates/") && path.contains("/src/") && !is_test_file(path)
}

fn begins_with_doc(path: &str, lines: &[Line]) -> Vec<Finding> {
    if lines[0].comment.starts_with("//!") {
        return Vec::new();
    }
    vec![Finding::new(
        path,
        1,
        "the first line must be a `//!` line that says what the file is",
    )]
}

fn not_too_long(path: &str, lines: &[Line]) -> Vec<Finding> {
    let count = lines
        .iter()
        .filter(|line| !line.is_test)
        .count()
        .saturating_sub(1);
    if count <= MAX_LINES || is_test_file(path) {
        return Vec::new();
    }
    vec![Finding::new(
        path,
        0,
        format!("{count} lines outside tests, {MAX_LINES} allowed: one idea a file"),
    )]
}

fn unsafe_in_its_place(path: &str, lines: &[Line]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let file_says_what_callers_promise = lines.iter().any(|line| line.comment.contains("# Safety"));
    for (at, line) in lines
        .iter()
        .enumerate()
        .filter(|(_, line)| line.has_token("unsafe"))
    {
        if !path.starts_with(UNSAFE_FOLDER) {
            findings.push(Finding::new(
                path,
                at + 1,
                format!("`unsafe` outside {UNSAFE_FOLDER}"),
            ));
            continue;
        }
        let comments = comments_for(lines, at);
        let has_reason = comments.contains("SAFETY:") || comments.contains("# Safety");
        // A declared function does nothing unsafe yet; what its callers promise may stand once, at its trait or module.
        let is_declared = line.code.contains("unsafe fn") && file_says_what_callers_promise;
        if !has_reason && !is_declared {
            findings.push(Finding::new(
                path,
                at + 1,
                "`unsafe` without a `SAFETY:` comment (a function: without `# Safety` docs)",
            ));
        }
    }
    findings
}

fn transforms_are_planned_once(path: &str, lines: &[Line]) -> Vec<Finding> {
    if !is_library_source(path) || FFT_FILES.contains(&path) {
        return Vec::new();
    }
    let plans = |line: &Line| line.has_token("FftPlanner") || line.has_token("RealFftPlanner");
    let lines = lines.iter().enumerate().filter(|(_, line)| plans(line));
    let message = format!("transforms are planned in {}", FFT_FILES.join(" and "));
    lines
        .map(|(at, _)| Finding::new(path, at + 1, message.clone()))
        .collect()
}

fn panics_have_reasons(path: &str, lines: &[Line]) -> Vec<Finding> {
    if !is_library_source(path) {
        return Vec::new();
    }
    let panics = |line: &Line| line.code.contains(".unwrap()") || line.code.contains(".expect(");
    let has_reason = |at: usize| {
        comments_for(lines, at).lines().any(|comment| {
            !comment.starts_with("///") && !comment.starts_with("//!") && !comment.is_empty()
        })
    };
    lines
        .iter()
        .enumerate()
        .filter(|&(at, line)| !line.is_test && panics(line) && !has_reason(at))
        .map(|(at, _)| {
            Finding::new(
                path,
                at + 1,
                "`unwrap` or `expect` without a comment that says why it cannot fail",
            )
        })
        .collect()
}

fn nothing_left_behind(path: &str, lines: &[Line]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        for name in ["todo", "unimplemented", "dbg"] {
            if token_positions(&line.code, name)
                .any(|from| line.code[from + name.len()..].starts_with('!'))
            {
                findings.push(Finding::new(path, at + 1, format!("`{name}!` left behind")));
            }
        }
        if line.code.contains("#[ignore") {
            findings.push(Finding::new(
                path,
                at + 1,
                "`#[ignore]`: make the test run, or guard it by a documented variable",
            ));
        }
    }
    findings
}

fn errors_are_typed(path: &str, lines: &[Line]) -> Vec<Finding> {
    if !is_library_source(path) {
        return Vec::new();
    }
    let mut findings = Vec::new();
    // Braces since the `enum ...Error` now open; `None` outside of one.
    let mut depth: Option<isize> = None;
    for (at, line) in lines.iter().enumerate() {
        if depth.is_none() && declares_error_enum(&line.code) {
            depth = Some(0);
        }
        let Some(open) = depth else { continue };
        if line.has_token("String") && !comments_for(lines, at).contains(ALLOW_STRING) {
            let message = format!(
                "a `String` in an error: carry numbers and types (or `// {ALLOW_STRING} reason`)"
            );
            findings.push(Finding::new(path, at + 1, message));
        }
        let open = open + line.code.matches('{').count() as isize
            - line.code.matches('}').count() as isize;
        let closed = open <= 0 && line.code.contains('}');
        depth = (!closed).then_some(open);
    }
    findings
}

fn declares_error_enum(code: &str) -> bool {
    let Some(at) = token_positions(code, "enum").next() else {
        return false;
    };
    let name: String = code[at + 4..]
        .trim_start()
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect();
    name.ends_with("Error")
}

#[cfg(test)]
mod tests {
    use super::*;

    type Rule = fn(&str, &[Line]) -> Vec<Finding>;

    #[track_caller]
    fn breaks(rule: Rule, path: &str, text: &str, line: usize) {
        let findings = rule(path, &rust_text::lines(text));
        let at: Vec<usize> = findings.iter().map(|finding| finding.line).collect();
        assert_eq!(at, [line], "{findings:?}");
    }

    #[track_caller]
    fn keeps(rule: Rule, path: &str, text: &str) {
        assert_eq!(rule(path, &rust_text::lines(text)), []);
    }

    #[test]
    fn a_file_begins_with_a_doc_line() {
        breaks(
            begins_with_doc,
            "crates/a/src/lib.rs",
            "// not this\nfn f() {}\n",
            1,
        );
        breaks(begins_with_doc, "crates/a/src/lib.rs", "", 1);
        keeps(
            begins_with_doc,
            "crates/a/src/lib.rs",
            "//! This.\nfn f() {}\n",
        );
    }

    #[test]
    fn a_file_has_at_most_600_lines_outside_tests() {
        let limit = "x;\n".repeat(600);
        keeps(not_too_long, "crates/a/src/x.rs", &limit);
        breaks(
            not_too_long,
            "crates/a/src/x.rs",
            &format!("{limit}x;\n"),
            0,
        );
        keeps(
            not_too_long,
            "crates/a/src/x.rs",
            &format!("{limit}#[cfg(test)]\nmod tests {{\n{limit}}}\n"),
        );
        keeps(not_too_long, "crates/a/tests/x.rs", &limit.repeat(2));
    }

    #[test]
    fn transforms_are_planned_where_types_are_known() {
        let rule = transforms_are_planned_once;
        let plan = "use realfft::RealFftPlanner;\nlet p = FftPlanner::new();\n";
        let found = rule("crates/radon/src/fbp/rows.rs", &rust_text::lines(plan));
        assert_eq!(found.len(), 2);
        keeps(rule, "crates/radon/src/compiled.rs", plan);
        keeps(rule, "crates/radon/tests/suite/filter.rs", plan);
        keeps(rule, "crates/radon/src/fbp/rows.rs", "// FftPlanner\n");
    }

    #[test]
    fn unsafe_stays_in_its_folder_with_its_reason() {
        let simd = "crates/radon/src/simd/avx2.rs";
        breaks(
            unsafe_in_its_place,
            "crates/radon/src/fbp.rs",
            "// SAFETY: no\nunsafe { f() }",
            2,
        );
        breaks(unsafe_in_its_place, simd, "let a = 1;\nunsafe { f() }", 2);
        breaks(
            unsafe_in_its_place,
            simd,
            "// SAFETY: of a\nA => unsafe { f() },\nB => unsafe { g() },",
            3,
        );
        keeps(
            unsafe_in_its_place,
            simd,
            "// SAFETY: the plan asked the CPU\nunsafe { f() }",
        );
        keeps(
            unsafe_in_its_place,
            simd,
            "/// # Safety\n/// AVX2.\n#[target_feature(enable = \"avx2\")]\npub(crate) unsafe fn f() {}",
        );
        breaks(unsafe_in_its_place, simd, "unsafe fn f() {}", 1);
        keeps(
            unsafe_in_its_place,
            simd,
            "/// # Safety
/// AVX2.
trait V {
    unsafe fn f();
    unsafe fn g();
}",
        );
        keeps(
            unsafe_in_its_place,
            "crates/radon/src/fbp.rs",
            "// unsafe\nlet a = \"unsafe\"; #[allow(unsafe_code)] fn f() {}",
        );
    }

    #[test]
    fn unwrap_says_why() {
        let path = "crates/a/src/x.rs";
        breaks(
            panics_have_reasons,
            path,
            "let a = 1;\nlet b = c.unwrap();",
            2,
        );
        breaks(
            panics_have_reasons,
            path,
            "/// Docs.\nfn f() -> u8 { c.expect(\"some\") }",
            2,
        );
        keeps(
            panics_have_reasons,
            path,
            "// checked above\nlet b = c.unwrap();",
        );
        keeps(
            panics_have_reasons,
            path,
            "let b = c.unwrap(); // checked above",
        );
        keeps(
            panics_have_reasons,
            path,
            "/// let b = c.unwrap();\nfn f() {}",
        );
        keeps(
            panics_have_reasons,
            path,
            "#[cfg(test)]\nmod tests { fn f() { c.unwrap() } }",
        );
        keeps(
            panics_have_reasons,
            "crates/a/tests/x.rs",
            "let b = c.unwrap();",
        );
        keeps(panics_have_reasons, path, "let b = c.unwrap_or(0);");
    }

    #[test]
    fn nothing_unfinished_is_left() {
        let path = "benches/benches/x.rs";
        breaks(nothing_left_behind, path, "fn f() { todo!() }", 1);
        breaks(nothing_left_behind, path, "\nunimplemented!(\"x\")", 2);
        breaks(nothing_left_behind, path, "dbg!(x)", 1);
        breaks(
            nothing_left_behind,
            path,
            "#[test]\n#[ignore = \"slow\"]\nfn f() {}",
            2,
        );
        keeps(
            nothing_left_behind,
            path,
            "// todo!\nlet s = \"dbg!(x)\"; my_dbg!(x);",
        );
    }

    #[test]
    fn errors_hold_no_prose() {
        let path = "crates/a/src/error.rs";
        breaks(
            errors_are_typed,
            path,
            "pub enum SolveError {\n    Other(String),\n}",
            2,
        );
        breaks(
            errors_are_typed,
            path,
            "enum E2Error {\n A {\n  why: String,\n },\n}\nstruct S(String);",
            3,
        );
        keeps(
            errors_are_typed,
            path,
            "enum SceneError {\n    // tidy: allow string: the parser's own words\n    Toml { message: String },\n}",
        );
        keeps(
            errors_are_typed,
            path,
            "enum AError {\n    TooSmall { given: f64, allowed: f64 },\n}\nstruct S(String);",
        );
        keeps(errors_are_typed, path, "enum Kind {\n    Named(String),\n}");
    }
}
