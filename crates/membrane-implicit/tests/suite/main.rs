//! Everything about this crate, in one program: what is generic is compiled once. What counts allocations is in `allocation.rs`.

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
