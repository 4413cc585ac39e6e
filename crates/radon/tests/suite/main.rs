//! All tests of this crate in one program: generic code is compiled once. `memory.rs` counts the heap.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;

mod anisotropic;
mod cells;
mod clones;
mod fbp_adjoint;
mod fbp_bad_inputs;
mod fbp_edges;
mod fbp_oracle;
mod fbp_properties;
mod filter;
mod fourier;
mod fourier_projector;
mod geometry;
mod iterative;
mod iterative_overflow;
mod iterative_runs;
mod measure;
mod motion;
mod noise;
mod odd_inputs;
mod operators;
mod phantom;
mod progress;
mod projector;
mod projector_alone;
mod response;
mod shift;
mod smooth;
mod spect;
mod spect_physics;
#[cfg(feature = "serde")]
mod stored;
