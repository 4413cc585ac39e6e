//! Everything about this crate, in one program: what is generic is compiled once. What ends a process is in `interrupt.rs`.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod acquisitions;
mod bins;
mod bounds;
mod collimator;
mod compensated;
mod counting;
mod errors;
mod files;
mod folder;
mod gates;
mod lock;
mod material;
mod motion;
mod one_frame;
mod operator;
mod orbit;
mod organs;
mod osem;
mod own_heart;
mod phantom;
mod prepare;
mod real_time;
mod report;
mod rubber;
mod scene;
mod scenes;
mod time;
mod truth_of_motion;
