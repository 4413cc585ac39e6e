//! MetaImage: a text header, then the samples, in one file or two.
//!
//! Keys as in <https://itk.org/Wiki/ITK/MetaIO/Documentation>. The world frame of ITK is LPS, as the lab, so the matrix is the
//! identity; MetaImage calls this `RAI`, by the origins of the axes. Gates are channels of a voxel.

use super::names::data_beside;
use super::volume::Axis;
use crate::error::PhantomError;
use crate::files::atomic::write_with_header;
use crate::files::{Samples, Volume, write_atomically};
use std::io::{self, Write};
use std::path::Path;

/// Writes the samples in a file beside the header.
pub(super) fn write_mhd(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "raw");
    let header = header(volume, &name);
    write_with_header(path, header.as_bytes(), &data, |out| put(out, volume))
}

/// Writes header and samples in one file.
pub(super) fn write_mha(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let header = header(volume, "LOCAL");
    write_atomically(path, |out| {
        out.write_all(header.as_bytes())?;
        put(out, volume)
    })
}

fn put(out: &mut dyn Write, volume: &Volume) -> io::Result<()> {
    let samples = volume.samples;
    match volume.axis {
        Axis::Single => samples.write(out),
        Axis::Gates(_) => samples.write_interleaved(volume.grid.len(), out),
        Axis::Field(_) => Samples::F32(&volume.in_world([1.0; 3])).write(out),
    }
}

fn header(volume: &Volume, data: &str) -> String {
    let [nx, ny, nz] = volume.grid.shape();
    let [dx, dy, dz] = volume.spacing_mm();
    let [x, y, z] = volume.origin_mm();
    let kind = match volume.samples {
        Samples::F32(_) => "MET_FLOAT",
        Samples::U8(_) => "MET_UCHAR",
        Samples::U16(_) => "MET_USHORT",
    };
    let channels = match volume.axis {
        Axis::Single => String::new(),
        Axis::Gates(seconds) => {
            let n = volume.n_gates();
            format!("SecondsPerGate = {seconds}\nElementNumberOfChannels = {n}\n")
        }
        Axis::Field(of) => format!("ElementNumberOfChannels = {}\n", of.components()),
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
         {channels}\
         ElementType = {kind}\n\
         ElementDataFile = {data}\n"
    )
}
