//! Every public call with what no sensible caller would pass: wrong lengths, indices beyond the end, NaN, infinity, nothing,
//! sizes no memory holds. Each ends in an error or in a number, none in a panic.
//!
//! What is refused with which error stands in each crate's own `bad_inputs`; here the calls are many and crossed with each other.

mod figures;
mod hearts;
mod membranes;
mod solids;
mod tomography;

/// Numbers that are none, that are nothing, and that are too much.
pub(crate) const ODD: [f64; 14] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    0.3,
    f64::MIN_POSITIVE,
    5e-324,
    1e-150,
    1e150,
    -1e150,
    f64::MAX,
    f64::MIN,
];

/// Counts with nothing behind them.
pub(crate) const SIZES: [usize; 6] = [0, 1, 3, 1 << 33, 1 << 62, usize::MAX];

/// `Ok` or not: it came back, and says what is wrong on a line or two whatever the numbers are.
pub(crate) fn back<T, E: std::fmt::Display>(outcome: Result<T, E>) -> Option<T> {
    match outcome {
        Ok(answer) => Some(answer),
        Err(error) => {
            let said = error.to_string();
            // two numbers with all their digits, and a sentence; 1e308 written out has 309
            assert!((1..300).contains(&said.len()), "{said}");
            None
        }
    }
}

/// Pairs of odd numbers.
pub(crate) fn pairs() -> impl Iterator<Item = [f64; 2]> {
    ODD.into_iter().flat_map(|a| ODD.map(|b| [a, b]))
}
