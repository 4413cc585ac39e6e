//! Rust text, split line by line into what the compiler reads and what people read.
//!
//! Enough of a lexer for rules about words: comments (nested too), strings, raw strings and character literals are told from
//! code, and the items under `#[cfg(test)]` are marked. It never fails; text that is no Rust gives lines all the same.

/// One line of a file.
#[derive(Debug, Default)]
pub(crate) struct Line {
    /// The code, with comments and the insides of strings and characters blanked.
    pub(crate) code: String,
    /// The comments, with their slashes.
    pub(crate) comment: String,
    /// Whether the line belongs to an item under `#[cfg(test)]`.
    pub(crate) is_test: bool,
}

impl Line {
    /// Whether `word` stands in the code as a token of its own.
    pub(crate) fn has_token(&self, word: &str) -> bool {
        token_positions(&self.code, word).next().is_some()
    }
}

/// Where `word` stands in `code` with no letter, digit or underscore on either side.
pub(crate) fn token_positions<'a>(
    code: &'a str,
    word: &'a str,
) -> impl Iterator<Item = usize> + 'a {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(word)
        .map(|(at, _)| at)
        .filter(move |&at| {
            !code[..at].chars().next_back().is_some_and(is_name)
                && !code[at + word.len()..].chars().next().is_some_and(is_name)
        })
}

enum State {
    Code,
    LineComment,
    BlockComment { depth: usize },
    Text { hashes: Option<usize> },
}

/// The lines of a Rust file.
pub(crate) fn lines(text: &str) -> Vec<Line> {
    let chars: Vec<char> = text.chars().collect();
    let ahead = |at: usize| chars.get(at).copied().unwrap_or('\n');
    let mut lines = vec![Line::default()];
    let mut state = State::Code;
    let mut at = 0;
    while at < chars.len() {
        let c = chars[at];
        if c == '\n' {
            if matches!(state, State::LineComment) {
                state = State::Code;
            }
            lines.push(Line::default());
            at += 1;
            continue;
        }
        let last = lines.len() - 1;
        let line = &mut lines[last];
        let mut taken = 1;
        match state {
            State::Code if c == '/' && ahead(at + 1) == '/' => {
                line.comment.push('/');
                state = State::LineComment;
            }
            State::Code if c == '/' && ahead(at + 1) == '*' => {
                line.comment.push_str("/*");
                state = State::BlockComment { depth: 1 };
                taken = 2;
            }
            State::Code if c == '"' => {
                line.code.push('"');
                state = State::Text {
                    hashes: raw_hashes(&chars, at),
                };
            }
            State::Code if c == '\'' => {
                taken = char_literal_len(&chars, at);
                line.code.push('\'');
                line.code.extend(std::iter::repeat_n(' ', taken - 1));
            }
            State::Code => line.code.push(c),
            State::LineComment => line.comment.push(c),
            State::BlockComment { depth } => {
                let (change, len) = match (c, ahead(at + 1)) {
                    ('/', '*') => (1, 2),
                    ('*', '/') => (-1, 2),
                    _ => (0, 1),
                };
                line.comment.extend(&chars[at..at + len]);
                taken = len;
                state = match depth.saturating_add_signed(change) {
                    0 => State::Code,
                    depth => State::BlockComment { depth },
                };
            }
            State::Text { hashes } => {
                let closes = c == '"' && (1..=hashes.unwrap_or(0)).all(|k| ahead(at + k) == '#');
                if c == '\\' && hashes.is_none() && ahead(at + 1) != '\n' {
                    line.code.push_str("  ");
                    taken = 2;
                } else if closes {
                    line.code.push('"');
                    state = State::Code;
                } else {
                    line.code.push(' ');
                }
            }
        }
        at += taken;
    }
    mark_tests(&mut lines);
    lines
}

/// Number of `#` of the raw string whose opening quote is at `quote`; `None` for an ordinary string.
fn raw_hashes(chars: &[char], quote: usize) -> Option<usize> {
    let hashes = chars[..quote]
        .iter()
        .rev()
        .take_while(|&&c| c == '#')
        .count();
    (quote > hashes && chars[quote - hashes - 1] == 'r').then_some(hashes)
}

/// Length of the character literal whose opening quote is at `quote`; 1 for the quote of a lifetime.
fn char_literal_len(chars: &[char], quote: usize) -> usize {
    let rest = &chars[quote + 1..];
    match rest {
        ['\\', _, tail @ ..] => tail
            .iter()
            .position(|&c| c == '\'')
            .map_or(1, |end| end + 4),
        [_, '\'', ..] => 3,
        _ => 1,
    }
}

/// Marks the lines of each item under `#[cfg(test)]` (or `#[cfg(all(test, ...))]`), up to its closing brace or semicolon.
fn mark_tests(lines: &mut [Line]) {
    let mut at = 0;
    while at < lines.len() {
        let code = &lines[at].code;
        let under_test = code.find("#[cfg(").is_some_and(|from| {
            token_positions(&code[from..], "test").next().is_some()
                && !code[from..].contains("not(")
        });
        if !under_test {
            at += 1;
            continue;
        }
        let end = item_end(lines, at);
        for line in &mut lines[at..=end] {
            line.is_test = true;
        }
        at = end + 1;
    }
}

/// Last line of the item whose attribute starts on line `start`.
fn item_end(lines: &[Line], start: usize) -> usize {
    let mut brackets = 0_usize;
    let mut braces = 0_usize;
    for (number, line) in lines.iter().enumerate().skip(start) {
        for c in line.code.chars() {
            match c {
                '[' | '(' => brackets += 1,
                ']' | ')' => brackets = brackets.saturating_sub(1),
                '{' => braces += 1,
                '}' => {
                    braces = braces.saturating_sub(1);
                    if braces == 0 && brackets == 0 {
                        return number;
                    }
                }
                ';' if braces == 0 && brackets == 0 => return number,
                _ => {}
            }
        }
    }
    lines.len() - 1
}

/// The comments that speak for line `at`: its own, those inside the statement it ends, and those right above that statement
/// (attributes between are skipped).
pub(crate) fn comments_for(lines: &[Line], at: usize) -> String {
    let mut comments = lines[at].comment.clone();
    for line in lines[..at].iter().rev() {
        let code = line.code.trim();
        let is_attribute = code.starts_with("#[");
        let ends_statement = code.ends_with([';', '{', '}', ',']) && !is_attribute;
        let is_blank = code.is_empty() && line.comment.is_empty();
        if ends_statement || is_blank {
            break;
        }
        comments.insert(0, '\n');
        comments.insert_str(0, line.comment.trim());
    }
    comments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(text: &str) -> String {
        let lines = lines(text);
        let code: Vec<&str> = lines.iter().map(|line| line.code.trim_end()).collect();
        code.join("\n")
    }

    #[test]
    fn comments_and_strings_are_no_code() {
        assert_eq!(code("a // b\nc"), "a\nc");
        assert_eq!(code("a /* b /* c */ d */ e"), "a  e");
        assert_eq!(code("f(\"x \\\" y\") g"), "f(\"      \") g");
        assert_eq!(code("r#\"a \" b\"# c"), "r#\"     \"# c");
        assert_eq!(code("\"one\ntwo\" x"), "\"\n   \" x");
        assert_eq!(
            code("let c = '\"'; let d = '\\''; fn f<'a>() {}"),
            "let c = '  ; let d = '   ; fn f<'a>() {}"
        );
    }

    #[test]
    fn tokens_are_whole_words() {
        let line = &lines("unsafe_code(); not_unsafe")[0];
        assert!(!line.has_token("unsafe"));
        assert!(lines("{unsafe{x}}")[0].has_token("unsafe"));
    }

    #[test]
    fn test_items_are_marked() {
        let marked = |text: &str| {
            lines(text)
                .iter()
                .map(|line| line.is_test)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            marked("a\n#[cfg(test)]\nmod tests {\n b }\nc"),
            [false, true, true, true, false]
        );
        assert_eq!(marked("#[cfg(test)]\nmod tests;\nc"), [true, true, false]);
        assert_eq!(marked("#[cfg(not(test))]\nmod x {}"), [false, false]);
        assert_eq!(
            marked("#[cfg(all(test, unix))]\n#[allow(x)]\nfn f(a: [u8; 3]) {\n}\nc"),
            [true, true, true, true, false]
        );
    }

    #[test]
    fn a_comment_speaks_for_the_statement_below_it() {
        let text = "x;\n// why\nlet a = b\n    .c()\n    .d();\nlet e = f.d();";
        let lines = lines(text);
        assert!(comments_for(&lines, 4).contains("why"));
        assert!(!comments_for(&lines, 5).contains("why"));
    }
}
