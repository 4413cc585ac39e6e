//! Everything about this crate, in one program: what is generic is compiled once. What ends a process is in `interrupt.rs`.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod cli;
mod cli_check;
mod cli_cohort;
mod cli_folder;
mod cli_output;
mod cli_page;
mod cli_scene;
mod figures;
