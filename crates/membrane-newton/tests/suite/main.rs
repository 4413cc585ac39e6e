//! All tests of this crate in one program: generic code is compiled once.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod bad_inputs;
mod banded;
mod branches;
mod collapse;
mod convergence;
mod estimates;
mod half;
mod odd_inputs;
mod oracle;
mod own_systems;
mod pairs;
mod properties;
mod reports;
mod robustness;
mod rubber;
mod rubber_limits;
mod scalar;
mod sensitivity;
mod slack;
mod slack_rates;
mod stability;
mod walks;
