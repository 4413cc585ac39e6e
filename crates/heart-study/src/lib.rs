//! The study of a beating heart by Rohmer, Sitek and Gullberg (2006), computed again, its figures, and the program `heart-phantom`.
//!
#![doc = include_str!("../README.md")]
//!
//! [`run`] does it and writes a folder: arrays, [`report`], and a page with all figures. [`figures`] draws each of them from plain
//! data, [`Look`] makes pictures and a page of a run of any scene. Conventions, units and index orders are those of [`heart_phantom`].

mod error;
pub mod figures;
mod html;
mod look;
mod study;

pub use error::StudyError;
pub use heart_phantom;
pub use look::Look;
pub use study::report::{self, Report};
pub use study::{StudyOptions, run, summary};
