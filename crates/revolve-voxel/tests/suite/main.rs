//! All tests of this crate in one program: generic code is compiled once.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "../support/mod.rs"]
mod support;

mod attenuation;
mod bad_inputs;
mod coincidence;
mod convergence;
mod counters;
mod depth;

mod images;
mod lines;
mod long_voxels;
mod mask;
mod meridians;
mod moments;
mod nearest;
mod oracle;
mod progress;
mod properties;
mod sector;
mod shell;
mod sweep;
mod threads;
mod torso;
mod twist;
mod units;
mod walls;
