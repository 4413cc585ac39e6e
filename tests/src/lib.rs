//! Tests that cross the crates; see the files beside this one. The examples of the README and of the guide run here.

#[doc = include_str!("../../README.md")]
#[cfg(doctest)]
struct Readme;

#[doc = include_str!("../../docs/guide-physicists.md")]
#[cfg(doctest)]
struct Guide;
