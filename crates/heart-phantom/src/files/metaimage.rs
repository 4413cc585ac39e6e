//! MetaImage: a text header, then the samples, in one file or two.
//!
//! Keys as in <https://itk.org/Wiki/ITK/MetaIO/Documentation>. The world of ITK is LPS, as the lab, so that the matrix is the
//! identity; MetaImage's word for it, `RAI`, names where the axes come from. Gates are the channels of a voxel, one after the other.

use super::names::data_beside;
use crate::error::PhantomError;
use crate::files::atomic::write_with_header;
use crate::files::{Format, Samples, Volume, write_atomically};
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

/// Writes so many components, the fastest in memory, on the voxels of a volume that says where they are.
pub(super) fn write_field(
    path: &Path,
    place: &Volume,
    (components, samples): (usize, &[f32]),
    format: Format,
) -> Result<(), PhantomError> {
    let of = |data: &str| {
        let channels = format!("ElementNumberOfChannels = {components}\nElementType");
        header(place, data).replacen("ElementType", &channels, 1)
    };
    let samples = Samples::F32(samples);
    if format == Format::MetaImage {
        let (data, name) = data_beside(path, "raw");
        return write_with_header(path, of(&name).as_bytes(), &data, |out| samples.write(out));
    }
    write_atomically(path, |out| {
        out.write_all(of("LOCAL").as_bytes())?;
        samples.write(out)
    })
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
