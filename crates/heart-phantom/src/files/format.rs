//! The formats, and which writer serves each.

use super::names::check_extension;
use crate::error::PhantomError;
#[cfg(feature = "dicom")]
use crate::files::dicom;
use crate::files::{Projections, Volume, interfile, metaimage, nifti, npy, nrrd};
#[cfg(feature = "files")]
use crate::files::{npz, raw_json};
use std::path::Path;

/// A file format; the [module's page](crate::files) says how each one places its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Format {
    /// NumPy array, samples only.
    Npy,
    /// NumPy archive of several arrays, not compressed.
    Npz,
    /// NIfTI-1 in one file.
    Nifti,
    /// NIfTI-1, compressed.
    NiftiGz,
    /// MetaImage with its data beside it.
    MetaImage,
    /// MetaImage in one file.
    MetaImageSingle,
    /// NRRD with its data inside, raw.
    Nrrd,
    /// Interfile as STIR writes and reads it.
    InterfileStir,
    /// Interfile 3.3 as SIMIND writes it.
    InterfileSimind,
    /// Raw samples with a JSON header beside them.
    RawJson,
    /// DICOM: images of nuclear medicine, all frames in one file, integers of 16 bits with their factor.
    Dicom,
}

/// From which end rows of projections and slices of volumes follow each other in a file, the patient's head at +z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
pub enum SliceOrder {
    /// From -z to +z, as in memory.
    FeetToHead,
    /// From +z to -z.
    HeadToFeet,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 11] = [
        Self::Npy,
        Self::Npz,
        Self::Nifti,
        Self::NiftiGz,
        Self::MetaImage,
        Self::MetaImageSingle,
        Self::Nrrd,
        Self::InterfileStir,
        Self::InterfileSimind,
        Self::RawJson,
        Self::Dicom,
    ];

    /// The name of the format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Npy => "npy",
            Self::Npz => "npz",
            Self::Nifti => "NIfTI",
            Self::NiftiGz => "compressed NIfTI",
            Self::MetaImage | Self::MetaImageSingle => "MetaImage",
            Self::Nrrd => "NRRD",
            Self::InterfileStir => "Interfile (STIR)",
            Self::InterfileSimind => "Interfile (SIMIND)",
            Self::RawJson => "raw with JSON",
            Self::Dicom => "DICOM",
        }
    }

    /// Whether this build writes it: compressed, archived and JSON ones come with the feature `files`, DICOM with `dicom`.
    ///
    /// # Errors
    /// [`PhantomError::NotBuilt`].
    pub(crate) fn check_built(self) -> Result<(), PhantomError> {
        match self {
            Self::Npz | Self::NiftiGz | Self::RawJson if !cfg!(feature = "files") => {
                Err(PhantomError::NotBuilt {
                    what: self.name(),
                    feature: "files",
                })
            }
            Self::Dicom if !cfg!(feature = "dicom") => Err(PhantomError::NotBuilt {
                what: self.name(),
                feature: "dicom",
            }),
            _ => Ok(()),
        }
    }

    /// That it has no place for something.
    pub(crate) fn cannot_hold(self, what: &'static str) -> PhantomError {
        let format = self.name();
        PhantomError::Unsupported { format, what }
    }

    /// Bytes of a sample that is no label in its files, before any compression.
    pub(crate) fn sample_bytes(self) -> u64 {
        match self {
            Self::Dicom => 2,
            _ => 4,
        }
    }

    /// Whether the gates of a beat have room in one of its files.
    pub fn holds_gates(self) -> bool {
        !matches!(self, Self::InterfileStir)
    }

    /// Whether its projections are told by a first angle and one step from each to the next.
    pub(crate) fn asks_even_steps(self) -> bool {
        matches!(
            self,
            Self::InterfileStir | Self::InterfileSimind | Self::Dicom
        )
    }

    /// The order of rows of projections in its files.
    pub fn row_order(self) -> SliceOrder {
        match self {
            Self::Dicom => SliceOrder::HeadToFeet,
            format => format.slice_order(),
        }
    }

    /// The order of slices of volumes in its files.
    pub fn slice_order(self) -> SliceOrder {
        match self {
            Self::InterfileStir | Self::InterfileSimind => SliceOrder::HeadToFeet,
            Self::Npy
            | Self::Npz
            | Self::Nifti
            | Self::NiftiGz
            | Self::MetaImage
            | Self::MetaImageSingle
            | Self::Nrrd
            | Self::RawJson
            | Self::Dicom => SliceOrder::FeetToHead,
        }
    }

    /// What the path given to [`write_volume`] ends in.
    pub fn volume_extension(self) -> &'static str {
        match self {
            Self::Npy => "npy",
            Self::Npz => "npz",
            Self::Nifti => "nii",
            Self::NiftiGz => "nii.gz",
            Self::MetaImage => "mhd",
            Self::MetaImageSingle => "mha",
            Self::Nrrd => "nrrd",
            Self::InterfileStir => "hv",
            Self::InterfileSimind => "h00",
            Self::RawJson => "json",
            Self::Dicom => "dcm",
        }
    }

    /// What the path given to [`write_projections`] ends in; `None` if the format has no place for
    /// the angles.
    pub fn projections_extension(self) -> Option<&'static str> {
        match self {
            Self::Nifti | Self::NiftiGz | Self::MetaImage | Self::MetaImageSingle => None,
            Self::InterfileStir => Some("hs"),
            format => Some(format.volume_extension()),
        }
    }

    /// What the name of a volume's data ends in, where they are kept beside the header.
    pub fn volume_data_extension(self) -> Option<&'static str> {
        match self {
            Self::MetaImage => Some("raw"),
            Self::InterfileStir => Some("v"),
            Self::InterfileSimind => Some("a00"),
            Self::RawJson => Some("bin"),
            Self::Npy
            | Self::Npz
            | Self::Nifti
            | Self::NiftiGz
            | Self::MetaImageSingle
            | Self::Nrrd
            | Self::Dicom => None,
        }
    }

    /// What the name of the data of projections ends in, where they are kept beside the header.
    pub fn projections_data_extension(self) -> Option<&'static str> {
        match self {
            Self::InterfileStir => Some("s"),
            Self::InterfileSimind | Self::RawJson => self.volume_data_extension(),
            _ => None,
        }
    }
}

/// Writes a volume. `path` ends in the format's [`Format::volume_extension`]; data kept beside a
/// header have the same name and another extension.
///
/// # Errors
/// [`PhantomError::Extension`]; [`PhantomError::Count`] if a side is too long for the format;
/// [`PhantomError::OutOfRange`] if the format cannot hold the grid's place; [`PhantomError::Unsupported`] if it has no room for gates;
/// [`PhantomError::NotBuilt`] for a format of the feature `files` or `dicom` in a build without it; [`PhantomError::File`] if the files cannot be written. Whatever the error, no file that was there
/// before is half written, and no header points to data that are not there.
pub fn write_volume(path: &Path, volume: &Volume, format: Format) -> Result<(), PhantomError> {
    check_extension(path, format.volume_extension())?;
    match format {
        Format::Npy => npy::write_samples(path, &volume.axes(), volume.samples()),
        #[cfg(feature = "files")]
        Format::Npz => npz::write_volume(path, volume),
        Format::Nifti => nifti::write(path, &nifti::header(volume)?, volume.samples()),
        #[cfg(feature = "files")]
        Format::NiftiGz => nifti::write_gz(path, &nifti::header(volume)?, volume.samples()),
        Format::MetaImage => metaimage::write_mhd(path, volume, None),
        Format::MetaImageSingle => metaimage::write_mha(path, volume, None),
        Format::Nrrd => nrrd::write_volume(path, volume),
        Format::InterfileStir => interfile::write_volume_stir(path, volume),
        Format::InterfileSimind => interfile::write_volume_simind(path, volume),
        #[cfg(feature = "files")]
        Format::RawJson => raw_json::write_volume(path, volume),
        #[cfg(feature = "dicom")]
        Format::Dicom => dicom::write_volume(path, volume),
        #[cfg(not(feature = "dicom"))]
        Format::Dicom => format.check_built(),
        #[cfg(not(feature = "files"))]
        Format::Npz | Format::NiftiGz | Format::RawJson => format.check_built(),
    }
}

/// Writes projections. `path` ends in the format's [`Format::projections_extension`].
///
/// # Errors
/// [`PhantomError::Unsupported`] if the format has no place for angles; else as [`write_volume`].
/// Interfile and DICOM hold even steps between the views and a detector centred on the axis only:
/// [`PhantomError::OutOfRange`] says what was found.
pub fn write_projections(
    path: &Path,
    projections: &Projections,
    format: Format,
) -> Result<(), PhantomError> {
    let unsupported = format.cannot_hold("the angles of projections");
    let Some(extension) = format.projections_extension() else {
        return Err(unsupported);
    };
    check_extension(path, extension)?;
    match format {
        Format::Npy => npy::write_samples(path, &projections.axes(), projections.samples()),
        #[cfg(feature = "files")]
        Format::Npz => npz::write_projections(path, projections),
        Format::Nrrd => nrrd::write_projections(path, projections),
        Format::InterfileStir => interfile::write_projections_stir(path, projections),
        Format::InterfileSimind => interfile::write_projections_simind(path, projections),
        #[cfg(feature = "files")]
        Format::RawJson => raw_json::write_projections(path, projections),
        #[cfg(feature = "dicom")]
        Format::Dicom => dicom::write_projections(path, projections),
        #[cfg(not(feature = "dicom"))]
        Format::Dicom => format.check_built(),
        #[cfg(not(feature = "files"))]
        Format::Npz | Format::RawJson => format.check_built(),
        Format::Nifti | Format::NiftiGz | Format::MetaImage | Format::MetaImageSingle => {
            Err(unsupported)
        }
    }
}
