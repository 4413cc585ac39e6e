//! File formats: one descriptor each, and the function that writes an image.

use super::names::check_extension;
use crate::error::PhantomError;
#[cfg(feature = "dicom")]
use crate::files::dicom;
#[cfg(feature = "files")]
use crate::files::npz;
use crate::files::{
    ORBIT_EXTENSION, Projections, Volume, interfile, metaimage, nifti, npy, nrrd, raw_json,
};
use std::path::{Component, Path};

/// Extensions of surfaces, images, pages and orbits, which are not formats of volumes.
const OTHER_EXTENSIONS: [&str; 6] = ["stl", "png", "gif", "svg", "html", ORBIT_EXTENSION];

/// A file format; the [module's page](crate::files) describes the coordinates of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
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
    /// DICOM: nuclear medicine images, all frames in one file, integers of 16 bits with their scale factor.
    Dicom,
}

/// Order of rows of projections and of slices of volumes in a file; the patient's head is at +z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SliceOrder {
    /// From -z to +z, as in memory.
    FeetToHead,
    /// From +z to -z.
    HeadToFeet,
}

/// File name extensions of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extensions {
    /// Extension of the path given to [`write()`].
    pub header: &'static str,
    /// Extension of the data file, if the data are in a file beside the header.
    pub data: Option<&'static str>,
}

type VolumeWriter = fn(&Path, &Volume<'_>) -> Result<(), PhantomError>;
type ProjectionsWriter = fn(&Path, &Projections<'_>) -> Result<(), PhantomError>;

/// Properties of a format: the only place that names them.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct FormatInfo {
    /// Name in messages.
    pub name: &'static str,
    /// Extensions of volumes.
    pub volume: Extensions,
    /// Extensions of projections; `None` if the format cannot store projection angles.
    pub projections: Option<Extensions>,
    /// Whether one file can contain all gates of a beat.
    pub gates: bool,
    /// Whether it can store several components per voxel ([`Volume::of_field`]).
    pub fields: bool,
    /// Whether it stores angles as a start and one constant step.
    pub even_steps: bool,
    /// Whether each detector head has a start angle of its own.
    pub detectors: bool,
    /// Bytes of a sample that is not a label, before compression.
    pub sample_bytes: u64,
    /// Bytes per sample of the copies that the writer makes of projections and of volumes.
    pub(crate) copy_bytes: [u64; 2],
    /// Order of the rows of projections.
    pub row_order: SliceOrder,
    /// Order of the slices of volumes.
    pub slice_order: SliceOrder,
    /// Cargo feature that contains the writer, if it is not always built.
    pub feature: Option<&'static str>,
    /// `None` if this build leaves the writer out.
    write_volume: Option<VolumeWriter>,
    /// `None` if this build leaves the writer out, or the format cannot store projections.
    write_projections: Option<ProjectionsWriter>,
}

/// Samples of 32 bits in the order of memory, of volumes with any axes; no writer.
const PLAIN: FormatInfo = FormatInfo {
    name: "",
    volume: one("npy"),
    projections: None,
    gates: true,
    fields: true,
    even_steps: false,
    detectors: false,
    sample_bytes: 4,
    copy_bytes: [0; 2],
    row_order: SliceOrder::FeetToHead,
    slice_order: SliceOrder::FeetToHead,
    feature: None,
    write_volume: None,
    write_projections: None,
};

/// Text headers whose rows and slices go from head to feet, of one gate and of scalars.
const INTERFILE: FormatInfo = FormatInfo {
    fields: false,
    even_steps: true,
    row_order: SliceOrder::HeadToFeet,
    slice_order: SliceOrder::HeadToFeet,
    ..PLAIN
};

/// Extension of a single file.
const fn one(header: &'static str) -> Extensions {
    Extensions { header, data: None }
}

/// Extensions of a header and of the data beside it.
const fn two(header: &'static str, data: &'static str) -> Extensions {
    Extensions {
        header,
        data: Some(data),
    }
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

    /// The properties of the format.
    #[must_use]
    pub const fn info(self) -> FormatInfo {
        match self {
            Self::Npy => FormatInfo {
                name: "npy",
                projections: Some(one("npy")),
                write_volume: Some(npy::write_volume),
                write_projections: Some(npy::write_projections),
                ..PLAIN
            },
            Self::Npz => FormatInfo {
                name: "npz",
                volume: one("npz"),
                projections: Some(one("npz")),
                feature: Some("files"),
                #[cfg(feature = "files")]
                write_volume: Some(npz::write_volume),
                #[cfg(feature = "files")]
                write_projections: Some(npz::write_projections),
                ..PLAIN
            },
            Self::Nifti => FormatInfo {
                name: "NIfTI",
                volume: one("nii"),
                write_volume: Some(nifti::write),
                ..PLAIN
            },
            Self::NiftiGz => FormatInfo {
                name: "compressed NIfTI",
                volume: one("nii.gz"),
                feature: Some("files"),
                #[cfg(feature = "files")]
                write_volume: Some(nifti::write_gz),
                ..PLAIN
            },
            Self::MetaImage => FormatInfo {
                name: "MetaImage",
                volume: two("mhd", "raw"),
                write_volume: Some(metaimage::write_mhd),
                ..PLAIN
            },
            Self::MetaImageSingle => FormatInfo {
                name: "MetaImage",
                volume: one("mha"),
                write_volume: Some(metaimage::write_mha),
                ..PLAIN
            },
            Self::Nrrd => FormatInfo {
                name: "NRRD",
                volume: one("nrrd"),
                projections: Some(one("nrrd")),
                write_volume: Some(nrrd::write_volume),
                write_projections: Some(nrrd::write_projections),
                ..PLAIN
            },
            Self::InterfileStir => FormatInfo {
                name: "Interfile (STIR)",
                volume: two("hv", "v"),
                projections: Some(two("hs", "s")),
                gates: false,
                write_volume: Some(interfile::write_volume_stir),
                write_projections: Some(interfile::write_projections_stir),
                ..INTERFILE
            },
            Self::InterfileSimind => FormatInfo {
                name: "Interfile (SIMIND)",
                volume: two("h00", "a00"),
                projections: Some(two("h00", "a00")),
                write_volume: Some(interfile::write_volume_simind),
                write_projections: Some(interfile::write_projections_simind),
                ..INTERFILE
            },
            Self::RawJson => FormatInfo {
                name: "raw with JSON",
                volume: two("json", "bin"),
                projections: Some(two("json", "bin")),
                write_volume: Some(raw_json::write_volume),
                write_projections: Some(raw_json::write_projections),
                ..PLAIN
            },
            Self::Dicom => FormatInfo {
                name: "DICOM",
                volume: one("dcm"),
                projections: Some(one("dcm")),
                fields: false,
                even_steps: true,
                detectors: true,
                sample_bytes: 2,
                // In the order of DICOM, and integers in a growing list.
                copy_bytes: [8, 4],
                row_order: SliceOrder::HeadToFeet,
                feature: Some("dicom"),
                #[cfg(feature = "dicom")]
                write_volume: Some(dicom::write_volume),
                #[cfg(feature = "dicom")]
                write_projections: Some(dicom::write_projections),
                ..PLAIN
            },
        }
    }
}

impl FormatInfo {
    /// # Errors
    /// [`PhantomError::NotBuilt`] if this build leaves the writer out.
    pub(crate) fn check_built(&self) -> Result<(), PhantomError> {
        match self.write_volume {
            Some(_) => Ok(()),
            None => Err(PhantomError::NotBuilt {
                what: self.name,
                feature: self.feature.unwrap_or_default(),
            }),
        }
    }

    /// The error of a format that cannot store something.
    pub(crate) fn cannot_hold(&self, what: &'static str) -> PhantomError {
        let format = self.name;
        PhantomError::Unsupported { format, what }
    }
}

/// The data that [`write()`] writes.
#[derive(Debug, Clone, Copy)]
pub enum Image<'a> {
    /// Samples on a voxel grid.
    Volume(&'a Volume<'a>),
    /// Samples of a rotating detector.
    Projections(&'a Projections<'a>),
}

impl<'a> From<&'a Volume<'a>> for Image<'a> {
    fn from(volume: &'a Volume<'a>) -> Self {
        Self::Volume(volume)
    }
}

impl<'a> From<&'a Projections<'a>> for Image<'a> {
    fn from(projections: &'a Projections<'a>) -> Self {
        Self::Projections(projections)
    }
}

/// Writes a volume, a vector field or projections. `path` ends in the header extension of [`Format::info`]; a data file beside the
/// header has the same name and the data extension.
///
/// # Errors
/// [`PhantomError::Extension`] for another extension; [`PhantomError::Name`] for a name of dots or with control characters;
/// [`PhantomError::Unsupported`] if the format cannot store angles, gates or
/// components; [`PhantomError::Count`] if a side is too long for the format; [`PhantomError::OutOfRange`] if the format cannot store the
/// position of the grid, an offset of the detector or uneven angles; [`PhantomError::NotBuilt`] for a format of the feature `files` or
/// `dicom` in a build without it; [`PhantomError::File`] if the files cannot be written. After any error an older file is unchanged, and
/// no header refers to missing data.
pub fn write<'a>(
    path: &Path,
    image: impl Into<Image<'a>>,
    format: Format,
) -> Result<(), PhantomError> {
    let info = format.info();
    match image.into() {
        Image::Volume(volume) => {
            check_extension(path, info.volume.header)?;
            if volume.field().is_some() && !info.fields {
                return Err(info.cannot_hold("several components per voxel"));
            }
            if volume.seconds_per_gate().is_some() && !info.gates {
                return Err(info.cannot_hold("gates in one file"));
            }
            (info.write_volume).map_or_else(|| info.check_built(), |write| write(path, volume))
        }
        Image::Projections(projections) => {
            let Some(extensions) = info.projections else {
                return Err(info.cannot_hold("the angles of projections"));
            };
            check_extension(path, extensions.header)?;
            if projections.seconds_per_gate.is_some() && !info.gates {
                return Err(info.cannot_hold("gates in one file"));
            }
            (info.write_projections)
                .map_or_else(|| info.check_built(), |write| write(path, projections))
        }
    }
}

/// Whether this is a plain name with an extension of a format, a surface, an image or a page.
pub(super) fn is_output(name: &Path) -> bool {
    let mut parts = name.components();
    let (Some(Component::Normal(only)), None) = (parts.next(), parts.next()) else {
        return false;
    };
    let Some((_, extension)) = only.to_str().and_then(|name| name.split_once('.')) else {
        return false;
    };
    let of_a_format = |format: Format| {
        let info = format.info();
        [Some(info.volume), info.projections]
            .into_iter()
            .flatten()
            .any(|known| known.header == extension || known.data == Some(extension))
    };
    OTHER_EXTENSIONS.contains(&extension) || Format::ALL.into_iter().any(of_a_format)
}
