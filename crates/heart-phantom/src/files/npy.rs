//! NumPy: single arrays, and archives of named arrays.

use crate::error::{PhantomError, check_count};
use crate::files::atomic::Pending;
use crate::files::{Projections, Samples, Volume, write_atomically};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The most axes that NumPy's arrays have.
const MOST_AXES: usize = 64;

/// Writes `values` as a NumPy `.npy` file of little-endian `f32` in C order.
///
/// `shape` lists the axes from slowest to fastest; the product of its entries is `values.len()`.
///
/// # Errors
/// [`PhantomError::Length`] if `shape` and `values` disagree; [`PhantomError::Count`] if there are more than
/// 64 axes, the most that NumPy has; [`PhantomError::File`] if the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f32]) -> Result<(), PhantomError> {
    check_count("axes of an npy array", shape.len(), 0, MOST_AXES)?;
    let expected = shape.iter().fold(1, |n: usize, &k| n.saturating_mul(k));
    if values.len() != expected {
        return Err(PhantomError::Length {
            what: "npy values",
            given: values.len(),
            expected,
        });
    }
    write_samples(path, shape, values.into())
}

pub(super) fn volume_shape(volume: &Volume) -> [usize; 3] {
    let [nx, ny, nz] = volume.grid().shape();
    [nz, ny, nx]
}

pub(super) fn write_samples(
    path: &Path,
    shape: &[usize],
    samples: Samples,
) -> Result<(), PhantomError> {
    write_atomically(path, |out| put_samples(out, shape, samples))
}

/// Arrays `samples` [z][y][x], `spacing_cm` and `origin_cm` (x, y, z).
pub(super) fn write_volume_npz(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    write_npz(path, &volume_shape(volume), volume.samples(), |archive| {
        archive.array("spacing_cm", &volume.grid().spacing())?;
        archive.array("origin_cm", &volume.grid().origin())
    })
}

/// Arrays `samples` [view][row][bin], `angles_rad`, `pitch_cm` and `first_cm` (bin, row), `radius_cm`.
pub(super) fn write_projections_npz(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let shape = projections.shape();
    write_npz(path, &shape, projections.samples(), |archive| {
        archive.array("angles_rad", projections.angles())?;
        archive.array("pitch_cm", &projections.detector().pitch())?;
        archive.array("first_cm", &projections.first())?;
        archive.array("radius_cm", &[projections.radius()])
    })
}

struct Archive<'a>(ZipWriter<&'a mut BufWriter<File>>);

impl Archive<'_> {
    fn begin(&mut self, name: &str) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true); // past 4 GiB
        Ok(self.0.start_file(format!("{name}.npy"), options)?)
    }

    fn array(&mut self, name: &str, values: &[f64]) -> io::Result<()> {
        self.begin(name)?;
        put_header(&mut self.0, "<f8", &[values.len()])?;
        values
            .iter()
            .try_for_each(|value| self.0.write_all(&value.to_le_bytes()))
    }
}

fn write_npz(
    path: &Path,
    shape: &[usize],
    samples: Samples,
    rest: impl FnOnce(&mut Archive) -> io::Result<()>,
) -> Result<(), PhantomError> {
    Pending::write(path, |out| {
        let mut archive = Archive(ZipWriter::new(out));
        archive.begin("samples")?;
        put_samples(&mut archive.0, shape, samples)?;
        rest(&mut archive)?;
        archive.0.finish()?;
        Ok(())
    })?
    .commit()
}

fn put_samples(out: &mut dyn Write, shape: &[usize], samples: Samples) -> io::Result<()> {
    let kind = match samples {
        Samples::F32(_) => "<f4",
        Samples::U8(_) => "|u1",
        Samples::U16(_) => "<u2",
    };
    put_header(out, kind, shape)?;
    samples.write(out)
}

/// What stands before the values of an array in C order, in version 1.0 of NumPy's format
/// (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>): ten bytes (magic, version, length of what follows),
/// then the type and the shape as a Python dictionary, filled up with spaces and ended as a line at a multiple of 64 bytes.
fn put_header(out: &mut dyn Write, kind: &str, shape: &[usize]) -> io::Result<()> {
    let axes = match shape {
        [only] => format!("{only},"), // else Python reads a number in brackets
        _ => shape
            .iter()
            .map(usize::to_string)
            .collect::<Vec<_>>()
            .join(", "),
    };
    let array = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({axes}), }}");
    let length = (10 + array.len() + 1).next_multiple_of(64) - 10;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    // At most 64 axes of 20 digits: below 2^16.
    out.write_all(&(length as u16).to_le_bytes())?;
    writeln!(out, "{array:<width$}", width = length - 1)
}
