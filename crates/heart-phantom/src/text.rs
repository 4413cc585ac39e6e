//! Foreign text and numbers in messages: escaped and shortened.

use std::error::Error;
use std::fmt;
use std::path::Path;

/// Largest number of characters of foreign text in a message.
pub(crate) const MOST: usize = 120;

/// Whether a terminal does not display the character or acts on it: control characters (both sets), bidirectional marks, and others without
/// a glyph (Unicode Cc, and the non-letters of Cf, Zl and Zp).
fn is_unseen(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{feff}')
        || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}')
        || matches!(c, '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
}

/// Escapes control characters and bidirectional marks as Rust does and returns one line. Errors of this crate escape all foreign text in
/// messages.
///
/// ```
/// assert_eq!(heart_phantom::escape("scene \u{1b}[31m\u{202e}.toml"), "scene \\u{1b}[31m\\u{202e}.toml");
/// ```
#[must_use]
pub fn escape(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_unseen(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Returns the message of an error and those of its causes, each once.
#[must_use]
pub fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let said = error.to_string();
        // Some messages of other crates, such as rayon, repeat that of their cause.
        if !text.ends_with(&said) {
            text = format!("{text}: {said}");
        }
        cause = error.source();
    }
    text
}

/// Escapes a path with [`escape`]; bytes that are not UTF-8 become U+FFFD.
pub(crate) fn escape_path(path: &Path) -> String {
    escape(&path.to_string_lossy())
}

/// Cuts a text to a number of characters and appends its length.
pub(crate) fn cut(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => {
            let length = text.chars().count();
            format!("{}... ({length} characters)", &text[..end])
        }
    }
}

/// A number in its shortest notation, so that 1e300 is not a line of zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number(pub(crate) f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (plain, scientific) = (self.0.to_string(), format!("{:e}", self.0));
        // 0.001 and 1000000 are easier to read than 1e-3 and 1e6.
        let plain_is_short = plain.len() <= scientific.len() + 4;
        f.write_str(if plain_is_short { &plain } else { &scientific })
    }
}

/// Formats the allowed range of a number.
pub(crate) fn range(least: f64, most: f64) -> String {
    let (low, high) = (Number(least), Number(most));
    match (least == f64::MIN_POSITIVE, most == f64::MAX) {
        (true, true) => "positive and finite".to_owned(),
        (true, false) => format!("positive and at most {high}"),
        (false, true) if least == f64::MIN => "finite".to_owned(),
        (false, true) => format!("finite and at least {low}"),
        (false, false) => format!("between {low} and {high}"),
    }
}

/// Rounds a number to 13 digits for headers and reports: 180, not 180.00000000000003.
pub(crate) fn short(value: f64) -> f64 {
    // No grid is known to more than twelve digits.
    format!("{value:.12e}").parse().unwrap_or(value)
}

/// Formats a number to five digits.
pub(crate) fn brief(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Formats a required number above 0 to five digits, rounded up by less than 1e-4 of its value.
pub(crate) fn enough(value: f64) -> f64 {
    let near = brief(value);
    match near < value {
        // Up to ten halves of the last digit more.
        true => brief(value * (1.0 + 5e-5)),
        false => near,
    }
}
