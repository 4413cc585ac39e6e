//! Tests that cross the crates; see the files beside this one.
