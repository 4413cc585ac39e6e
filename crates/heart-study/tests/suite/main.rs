//! All tests of this crate in one program: generic code is compiled once. `interrupt.rs` contains tests that end a process.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod cli;
mod cli_check;
mod cli_cohort;
mod cli_folder;
mod cli_output;
mod cli_page;
mod cli_scene;
mod cli_slurm;
#[cfg(target_os = "linux")]
mod fuzzed;
mod observer;
