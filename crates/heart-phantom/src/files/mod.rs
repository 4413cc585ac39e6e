//! Files for other programs: every volume and every set of projections where it belongs, whole or not at all.
//!
//! Inside the crate lengths are centimetres in the lab frame. The writers turn them into what the format wants, millimetres
//! as a rule. Where a format names the axes of a patient, the lab is taken as
//!
//! ```text
//! +x = left     +y = posterior     +z = superior          (LPS, the world frame of DICOM and ITK)
//! ```
//!
//! so that the direction matrix is the identity wherever the world is LPS, and the apex of the study's heart, which points
//! along (1/2, -sqrt(2)/2, 1/2), points to the left and to the front as a heart does. Programs whose world is another one
//! read the same place: one point of the heart has one position in every viewer.
//!
//! | [`Format`] | files | world | volume | projections |
//! | --- | --- | --- | --- | --- |
//! | `Npy` | `.npy` | none: the bare array | yes | yes |
//! | `Npz` | `.npz` | lab, cm; arrays `samples`, `spacing_cm`, ... | yes | yes, with angles |
//! | `Nifti`, `NiftiGz` | `.nii`, `.nii.gz` | RAS, mm: (-x, -y, z) in both sform and qform | yes | no |
//! | `MetaImage`, `MetaImageSingle` | `.mhd` + `.raw`, `.mha` | LPS, mm: (x, y, z) | yes | no |
//! | `Nrrd` | `.nrrd` | LPS, mm: (x, y, z) | yes | yes, with angles |
//! | `InterfileStir` | `.hv` + `.v`, `.hs` + `.s` | STIR, mm: (x, y, -z), head first | yes | even steps, centred |
//! | `InterfileSimind` | `.h00` + `.a00`, and `.cor` of an orbit that is no circle | centred, mm, head first, bins as seen from in front | centred | even steps, centred |
//! | `RawJson` | `.json` + `.bin` | lab, cm | yes | yes, with angles |
//! | `Dicom` | `.dcm` | LPS, mm: (x, y, z); integers with a factor | yes | even steps, centred |
//!
//! The gates of a beat go into one file each, or into one for all ([`Volume::of_gates`], [`Projections::of_gates`]; not as
//! `InterfileStir`): the slowest axis of arrays, the fourth of NIfTI and NRRD, the channels of MetaImage, the time slots of Interfile and
//! DICOM.
//!
//! Samples are little-endian. What a format cannot hold is refused ([`PhantomError`]) before anything is written, never
//! dropped; `Npy` alone holds samples and nothing else.
//!
//! A file appears under its name when it is complete. Of two files that belong together the header comes last, so that a
//! header always points to the whole data that it describes. A program that may be interrupted calls [`remove_unfinished`] before
//! it ends; then it leaves nothing else behind. Whoever writes several files into a folder holds its lock ([`lock_folder`]), so that
//! no two runs mix theirs.
//!
//! [`PhantomError`]: crate::PhantomError
//!
//! ```
//! use heart_phantom::files::{Format, Volume, write_volume};
//! use revolve_voxel::VoxelGrid;
//! let grid = VoxelGrid::centred([4, 3, 2], [0.1, 0.2, 0.3], [1.0, 0.0, 0.0])?;
//! let labels = vec![0_u8; 24]; // [z][y][x]
//! let folder = tempfile::tempdir()?; // or any other
//! write_volume(&folder.path().join("labels.nii"), &Volume::new(grid, &labels)?, Format::Nifti)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod atomic;
#[cfg(feature = "dicom")]
mod dicom;
mod field;
mod format;
mod interfile;
mod lock;
mod mesh;
mod metaimage;
mod names;
mod nifti;
mod npy;
#[cfg(feature = "files")]
mod npz;
mod nrrd;
#[cfg(feature = "scene")]
mod older;
#[cfg(feature = "files")]
mod picture;
mod projections;
#[cfg(feature = "files")]
mod raw_json;
mod samples;
mod turn;
mod volume;

/// The name of a run's report, which lists its files.
pub const REPORT: &str = "report.json";
/// Who writes it, as it says itself: the program and its version.
pub const PROGRAM: &str = concat!("heart-phantom ", env!("CARGO_PKG_VERSION"));

pub use atomic::{HeldWrites, create_writable_folder, remove_unfinished, write_atomically};
#[cfg(feature = "dicom")]
#[cfg_attr(docsrs, doc(cfg(feature = "dicom")))]
pub use dicom::write_ct;
pub use field::{Field, FieldOf, write_field};
pub use format::{Format, SliceOrder, write_projections, write_volume};
pub(crate) use interfile::ORBIT_EXTENSION;
pub use lock::{FolderLock, lock_folder};
pub(crate) use mesh::stl_bytes;
pub use mesh::{write_ply, write_stl};
pub(crate) use names::{
    ATTENUATION, FIELDS, LABELS, MOVING, PROJECTIONS, RECONSTRUCTION, SLICE, SURFACES, TRUTH,
};
pub use nifti::nifti_bytes;
pub use npy::{put_npy, write_npy};
#[cfg(feature = "scene")]
pub(crate) use older::check_no_folder;
#[cfg(feature = "scene")]
#[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
pub use older::{is_product, lock_beside, remove_older};
#[cfg(feature = "files")]
#[cfg_attr(docsrs, doc(cfg(feature = "files")))]
pub use picture::{Section, write_gif, write_png};
pub use projections::{Projections, Radius};
pub use samples::Samples;
pub use volume::Volume;
