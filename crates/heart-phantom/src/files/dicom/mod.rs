//! DICOM: projections and volumes as nuclear medicine images with all frames in one file, and volumes as slices of a CT.
//!
//! Sections of the standard (<https://dicom.nema.org/medical/dicom/current/output/chtml/part03/sect_C.8.4.html>):
//!
//! - Frames: energy window, detector, rotation, R-R interval, time slot, angular view of `TOMO` and `GATED TOMO`; R-R interval, time
//!   slot, slice of `RECON TOMO` and `RECON GATED TOMO`, the last index fastest (C.8.4.8).
//! - Angles: 0 at the patient's back, increasing towards the left, `CC`; so alpha = -theta, and increasing theta is `CW` (`Start
//! Angle`, C.8.4.10 and C.8.4.13).
//! - A view is the image seen from the detector: rows from head to feet, bins from s = +.
//! - The patient's axes are the lab's, millimetres: left, posterior, superior.
//!
//! Pixels are integers of 16 bits; `Rescale Slope` is the value of one unit. Modules of nuclear medicine neither list nor forbid
//! it, and readers apply it. The crate `dicom-object` encodes the data sets.
//!
//! Files are reproducible: dates are empty, and identifiers are functions of the content (or of the study name).

mod ct;
mod identity;
mod item;
mod nuclear;
mod pixels;

pub use ct::write_ct;
pub(super) use nuclear::{write_projections, write_volume};
