//! Tests that cross the crates, in `tests/`; a generator of random problems for them; the examples of the README and of the guide.

mod random;

pub use random::Random;

#[doc = include_str!("../../README.md")]
#[cfg(doctest)]
struct Readme;

#[doc = include_str!("../../docs/guide-physicists.md")]
#[cfg(doctest)]
struct Guide;
