//! All tests of this crate in one program: generic code is compiled once. `interrupt.rs` contains tests that end a process.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod acquisitions;
mod bins;
mod bounds;
mod collimator;
mod compensated;
mod counting;
mod cycle;
mod errors;
mod estimates;
mod files;
mod folder;
mod gates;
mod lock;
mod material;
mod motion;
mod observer;
mod one_frame;
mod operator;
mod orbit;
mod organs;
mod osem;
mod own_heart;
mod phantom;
mod place;
mod prepare;
mod rays;
mod real_time;
mod report;
mod resolution;
mod rubber;
mod scatter;
mod scene;
mod scenes;
mod time;
mod truth_of_motion;
mod twisted;
