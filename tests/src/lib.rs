//! Tests that cross the crates; see the files beside this one. The README's examples run here.

#[doc = include_str!("../../README.md")]
#[cfg(doctest)]
struct Readme;
