//! File formats for other programs. Files are atomic: complete, or absent.
//!
//! Inside the crate lengths are centimetres in the lab frame. The writers convert them to the units of the format, usually
//! millimetres. Formats that name the axes of a patient use
//!
//! ```text
//! +x = left     +y = posterior     +z = superior          (LPS, the world frame of DICOM and ITK)
//! ```
//!
//! so that the direction matrix is the identity in an LPS world. The apex of the study's heart points along (1/2, -sqrt(2)/2, 1/2): to
//! the left and to the front. Formats with another world frame store the same positions: a point of the heart has one position in
//! every viewer.
//!
//! | [`Format`] | files | world | volume | projections | gates in one file |
//! | --- | --- | --- | --- | --- | --- |
//! | `Npy` | `.npy` | none: the bare array | yes | yes | slowest axis |
//! | `Npz` | `.npz` | lab, cm; arrays `samples`, `spacing_cm`, ... | yes | yes, with angles | slowest axis |
//! | `Nifti`, `NiftiGz` | `.nii`, `.nii.gz` | RAS, mm: (-x, -y, z) in both sform and qform | yes | no | fourth axis |
//! | `MetaImage`, `MetaImageSingle` | `.mhd` + `.raw`, `.mha` | LPS, mm: (x, y, z) | yes | no | channels |
//! | `Nrrd` | `.nrrd` | LPS, mm: (x, y, z) | yes | yes, with angles | fourth axis |
//! | `InterfileStir` | `.hv` + `.v`, `.hs` + `.s` | STIR, mm: (x, y, -z), head first | yes | even steps, centred | no |
//! | `InterfileSimind` | `.h00` + `.a00`, and `.cor` for an orbit that is not circular | centred, mm, head first, bins as seen from in front | centred | even steps, centred | time slots |
//! | `RawJson` | `.json` + `.bin` | lab, cm | yes | yes, with angles | slowest axis |
//! | `Dicom` | `.dcm` | LPS, mm: (x, y, z); integers with a scale factor | yes | even steps, centred | time slots |
//!
//! [`Format::info`] has the properties of a format. [`Volume::of_gates`] and [`Projections::of_gates`] contain all gates of a beat for one
//! file. [`Volume::of_field`] has several components per voxel.
//!
//! Arrays of projections are `[view][row][bin]` with rows from feet to head and bins along s (`Npy`). `InterfileStir` stores the rows from
//! head to feet, `InterfileSimind` and `Dicom` the bins backwards too. [`AcquisitionInfo::seconds_per_view`] is written by `Dicom` only.
//!
//! Samples are little-endian. Input that a format cannot store is an error ([`PhantomError`]) before anything is written; `Npy` stores
//! the samples only.
//!
//! Of two files that belong together the header is renamed last, so that a header always refers to complete data. A program that may be
//! interrupted calls [`remove_unfinished`] before it ends. A program that writes several files to a directory locks it ([`Folder`]).
//!
//! [`PhantomError`]: crate::PhantomError
//!
//! ```
//! use heart_phantom::files::{self, Format, Volume};
//! use revolve_voxel::VoxelGrid;
//! let grid = VoxelGrid::centred([4, 3, 2], [0.1, 0.2, 0.3], [1.0, 0.0, 0.0])?;
//! let labels = vec![0_u8; 24]; // [z][y][x]
//! let folder = tempfile::tempdir()?; // or any other
//! files::write(&folder.path().join("labels.nii"), &Volume::new(grid, &labels)?, Format::Nifti)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
#[cfg(feature = "dicom")]
mod dicom;
mod folder;
mod format;
mod interfile;
mod mesh;
mod metaimage;
mod names;
mod nifti;
mod npy;
#[cfg(feature = "files")]
mod npz;
mod nrrd;
#[cfg(feature = "files")]
mod picture;
mod previous;
mod projections;
mod raw_json;
mod rays;
mod samples;
mod sparse;
mod turn;
mod volume;

/// The name of the report of a run, which lists its files.
pub const REPORT: &str = "report.json";
/// The program and its version, as recorded in the report.
pub const PROGRAM: &str = concat!("heart-phantom ", env!("CARGO_PKG_VERSION"));

pub use atomic::{create_writable_folder, remove_unfinished, write_atomically};
#[cfg(feature = "dicom")]
#[cfg_attr(docsrs, doc(cfg(feature = "dicom")))]
pub use dicom::write_ct;
pub use folder::Folder;
pub use format::{Extensions, Format, FormatInfo, Image, SliceOrder, write};
pub(crate) use interfile::ORBIT_EXTENSION;
pub(crate) use mesh::stl_bytes;
pub use mesh::{write_ply, write_stl};
pub use nifti::nifti_bytes;
pub use npy::{NpyArray, get_npy, put_npy, read_npy, write_npy};
#[cfg(feature = "files")]
#[cfg_attr(docsrs, doc(cfg(feature = "files")))]
pub use picture::{Section, png_bytes, write_gif, write_png};
pub use previous::check_unlisted;
pub(crate) use projections::are_equal;
pub use projections::{AcquisitionInfo, BeatCounts, Projections};
pub use rays::{write_astra, write_rtk};
pub use samples::Samples;
pub use volume::{Corrections, FieldOf, Volume};
