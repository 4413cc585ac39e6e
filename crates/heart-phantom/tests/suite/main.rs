//! Everything about this crate, in one program: what is generic is compiled once. What ends a process is in `interrupt.rs`.

mod acquisitions;
mod cli;
mod cli_output;
mod cli_scene;
mod figures;
mod files;
mod lock;
mod material;
mod phantom;
mod prepare;
mod report;
mod scene;
mod scenes;
mod time;
