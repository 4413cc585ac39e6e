//! All tests of this crate in one program: generic code is compiled once.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod bad_inputs;
mod crossings;
mod curves;
mod elements;
mod half;
mod oracle;
mod published;
mod rubber;
