//! Input of the targets that take numbers.

/// Returns the numbers of a text, separated by white space; `None` if there is another word, or a number other than zero outside 1e-6 to 1e6,
/// for which no rounding error is stated.
#[must_use]
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |word: &str| {
        word.parse()
            .ok()
            .filter(|x: &f64| *x == 0.0 || (1e-6..=1e6).contains(&x.abs()))
    };
    text.split_whitespace().map(number).collect()
}
