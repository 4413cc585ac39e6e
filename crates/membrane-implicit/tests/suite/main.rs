//! All tests of this crate in one program: generic code is compiled once. `allocation.rs` counts allocations.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;

mod adaptive;
mod bad_inputs;
mod convergence;
mod energy;
mod equilibrium;
mod feedback;
mod paper;
mod pump;
mod rubber;
mod stability;
