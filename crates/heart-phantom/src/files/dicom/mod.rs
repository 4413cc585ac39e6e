//! DICOM: views and volumes as images of nuclear medicine with all their frames in one file, and volumes as slices of a CT.
//!
//! What is relied upon, each read in the standard (<https://dicom.nema.org/medical/dicom/current/output/chtml/part03/sect_C.8.4.html>):
//!
//! - Frames: energy window, detector, rotation, R-R interval, time slot, angular view of `TOMO` and `GATED TOMO`; R-R interval, time
//!   slot, slice of `RECON TOMO` and `RECON GATED TOMO`, the last index fastest (C.8.4.8).
//! - Angles: 0 at the patient's back, growing from there towards the left, `CC`; so alpha = -theta, and growing angles of ours are `CW`
//!   (`Start Angle`, C.8.4.10 and C.8.4.13).
//! - A view is as one sees it from the detector: rows from head to feet, bins from s = +.
//! - The patient's axes are the lab's, millimetres: left, posterior, superior.
//!
//! Pixels are integers of 16 bits; `Rescale Slope` is what one of them stands for. Modules of nuclear medicine do not name it, but
//! do not forbid it, and readers apply it. The crate `dicom-object` encodes; what is in the file is decided here.
//!
//! There is no clock and no chance in a file: dates are empty, and what identifies it follows from what it holds (or from the
//! study's name), so that the same scene gives the same bytes.

mod ct;
mod identity;
mod item;
mod nuclear;
mod pixels;

pub use ct::write_ct;
pub(super) use nuclear::{write_projections, write_volume};
