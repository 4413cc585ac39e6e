//! The study of a beating heart by Rohmer, Sitek and Gullberg (2006, hal-03929238), computed again: shapes of two balloons, both
//! methods to find them, three acquisitions, their reconstructions, every figure and every number.
//!
//! [`run`] does it and writes a folder: arrays, [`report`], and a page with all figures. [`figures`] draws each of them from plain
//! data. The package also has the program `heart-phantom`, the command line of the library of that name.
//!
//! ```
//! use heart_study::{StudyOptions, run};
//! let folder = tempfile::tempdir()?; // or any other
//! let options = StudyOptions { size: 16, views: 8, nodes: 51, figures: false, ..StudyOptions::default() };
//! let report = run(&options, folder.path(), &|_| ())?;
//! assert!(report.direct.wall_volume_error < 1e-9); // the outer membrane keeps the wall's volume
//! assert!(folder.path().join("long-ram-lak.npy").exists()); // `[z][y][x]`
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Conventions, units and index orders are those of [`heart_phantom`].

mod error;
pub mod figures;
mod study;

pub use error::StudyError;
pub use heart_phantom;
pub use study::report::{self, Report};
pub use study::{StudyOptions, run, summary};

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct ReadmeDoctests;
