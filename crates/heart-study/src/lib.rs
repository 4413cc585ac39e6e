//! Reproduction of the beating-heart study of Rohmer, Sitek and Gullberg (2006), its figures, and the program `heart-phantom`.
//!
#![doc = include_str!("../README.md")]
//!
//! [`run`] computes the study and writes arrays, a [`report`], and a page with all figures. [`figures`] draws each figure from plain
//! data. [`ejection`] measures ejection fractions in images of gated SPECT. [`Look`] writes images and a page for any run. Conventions, units
//! and index orders are those of [`heart_phantom`].

mod command_line;
pub mod ejection;
mod error;
pub mod figures;
mod html;
mod look;
mod study;

pub use command_line::command_line;
pub use error::StudyError;
pub use heart_phantom;
pub use look::Look;
pub use study::report::{self, Report};
pub use study::{StudyOptions, run, summary};
