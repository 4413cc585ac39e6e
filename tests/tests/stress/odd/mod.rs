//! Every public call with unreasonable arguments: wrong lengths, indices beyond the end, NaN, infinity, zero, sizes beyond any memory. Each
//! ends in an error or a result, none in a panic.
//!
//! `bad_inputs` of each crate tests the kind of error; here the calls are many and combined.

mod hearts;
mod membranes;
mod solids;
mod tomography;

/// NaN, infinities, zeros, tiny, ordinary and huge values.
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

/// Unreasonable array sizes.
pub(crate) const SIZES: [usize; 6] = [0, 1, 3, 1 << 33, 1 << 62, usize::MAX];

/// Checks that a call returned, and that no line of its error writes out large numbers. A line is a finding.
pub(crate) fn back<T, E: std::fmt::Display>(outcome: Result<T, E>) -> Option<T> {
    match outcome {
        Ok(answer) => Some(answer),
        Err(error) => {
            let said = error.to_string();
            // Two numbers with all their digits, and a sentence or the list of sections; 1e308 written out has 309 digits.
            let short = |line: &str| (1..309).contains(&line.len());
            assert!(!said.is_empty() && said.lines().all(short), "{said}");
            None
        }
    }
}

/// Pairs of odd numbers.
pub(crate) fn pairs() -> impl Iterator<Item = [f64; 2]> {
    ODD.into_iter().flat_map(|a| ODD.map(|b| [a, b]))
}
