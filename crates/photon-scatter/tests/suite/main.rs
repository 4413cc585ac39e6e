//! All tests of this crate, in one program.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "../support/mod.rs"]
mod support;

mod bad_inputs;
mod balance;
mod bound;
mod compton;
mod error_bound;
mod limits;
mod quadrature;
mod small;
mod sums;
mod threads;
mod voxels;
