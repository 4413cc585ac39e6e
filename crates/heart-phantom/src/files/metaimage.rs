//! MetaImage: a text header, then the samples, in one file or two.
//!
//! Keys as in <https://itk.org/Wiki/ITK/MetaIO/Documentation>. The world of ITK is LPS, as the lab, so that the matrix is the
//! identity; MetaImage's word for it, `RAI`, names where the axes come from. Gates are the channels of a voxel, one after the other.

use super::names::data_beside;
use crate::error::PhantomError;
use crate::files::atomic::write_with_header;
use crate::files::{Samples, Volume, write_atomically};
use std::io::{self, Write};
use std::path::Path;

pub(super) fn write_mhd(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "raw");
    let header = header(volume, &name);
    write_with_header(path, header.as_bytes(), &data, |out| put(out, volume))
}

pub(super) fn write_mha(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let header = header(volume, "LOCAL");
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        put(out, volume)
    })
}

/// Writes so many components, the fastest in memory, on the voxels of a volume that says where they are, in a file beside the header.
pub(super) fn write_field_mhd(
    path: &Path,
    place: &Volume,
    (components, samples): (usize, &[f32]),
) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "raw");
    let header = field_header(place, &name, components);
    write_with_header(path, header.as_bytes(), &data, |out| {
        Samples::F32(samples).write(out)
    })
}

/// The same in one file.
pub(super) fn write_field_mha(
    path: &Path,
    place: &Volume,
    (components, samples): (usize, &[f32]),
) -> Result<(), PhantomError> {
    let header = field_header(place, "LOCAL", components);
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        Samples::F32(samples).write(out)
    })
}

fn field_header(place: &Volume, data: &str, components: usize) -> String {
    let channels = format!("ElementNumberOfChannels = {components}\nElementType");
    header(place, data).replacen("ElementType", &channels, 1)
}

fn put(out: &mut dyn Write, volume: &Volume) -> io::Result<()> {
    let samples = volume.samples();
    match volume.seconds_per_gate() {
        None => samples.write(out),
        Some(_) => samples.write_interleaved(volume.grid().len(), out),
    }
}

fn header(volume: &Volume, data: &str) -> String {
    let [nx, ny, nz] = volume.grid().shape();
    let [dx, dy, dz] = volume.spacing_mm();
    let [x, y, z] = volume.origin_mm();
    let kind = match volume.samples() {
        Samples::F32(_) => "MET_FLOAT",
        Samples::U8(_) => "MET_UCHAR",
        Samples::U16(_) => "MET_USHORT",
    };
    let gates = match volume.seconds_per_gate() {
        None => String::new(),
        Some(seconds) => {
            let n = volume.n_gates();
            format!("SecondsPerGate = {seconds}\nElementNumberOfChannels = {n}\n")
        }
    };
    format!(
        "ObjectType = Image\n\
         NDims = 3\n\
         BinaryData = True\n\
         BinaryDataByteOrderMSB = False\n\
         CompressedData = False\n\
         TransformMatrix = 1 0 0 0 1 0 0 0 1\n\
         Offset = {x} {y} {z}\n\
         CenterOfRotation = 0 0 0\n\
         AnatomicalOrientation = RAI\n\
         ElementSpacing = {dx} {dy} {dz}\n\
         DimSize = {nx} {ny} {nz}\n\
         {gates}\
         ElementType = {kind}\n\
         ElementDataFile = {data}\n"
    )
}
