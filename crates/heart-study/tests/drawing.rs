//! Figures and images of runs. They have no public interface, so this program compiles their source, without the rest of the crate; the
//! tests are modules of that source.

#![allow(dead_code)]
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "../src/figures/mod.rs"]
mod figures;
#[path = "../src/html.rs"]
mod html;
#[path = "../src/look/mod.rs"]
mod look;
