//! Results beside published measurements, closed forms and the results of other programs (`docs/evidence.md`).

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod collimator;
mod enclosure;
mod interval;
mod partial_volume;
mod projectors;
mod rubber;
