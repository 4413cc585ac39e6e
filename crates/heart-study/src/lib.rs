//! Reproduction of the beating-heart study of Rohmer, Sitek and Gullberg (2006), its figures, and the program `heart-phantom`.
//!
#![doc = include_str!("../README.md")]
//!
//! [`run`] computes the study and writes arrays, a [`report`], and a page with all figures. [`command_line`] is the program. Conventions,
//! units and index orders are those of [`heart_phantom`].

mod command_line;
mod ejection;
mod figures;
mod html;
mod look;
pub mod report;
mod study;

pub use command_line::command_line;
pub use heart_phantom;
pub use study::{options::StudyOptions, run};
