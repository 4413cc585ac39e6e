//! NumPy: single arrays.

use crate::error::{PhantomError, check_count, check_length};
use crate::files::{Projections, Samples, Volume, write_atomically};
use std::io::{self, Write};
use std::path::Path;

/// Largest number of axes of NumPy arrays.
const MOST_AXES: usize = 64;

/// Writes `values` as a NumPy `.npy` file of little-endian `f32` in C order.
///
/// `shape` lists the axes from slowest to fastest; the product of its entries is `values.len()`.
///
/// # Errors
/// [`PhantomError::WrongLength`] if `shape` and `values` disagree; [`PhantomError::Count`] for more than 64 axes, the limit of
/// NumPy; [`PhantomError::File`] if the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f32]) -> Result<(), PhantomError> {
    check_count("axes of an npy array", shape.len(), [0, MOST_AXES])?;
    let expected = shape.iter().fold(1, |n: usize, &k| n.saturating_mul(k));
    check_length("npy values", values.len(), expected)?;
    write_samples(path, shape, values.into())
}

/// Writes an array as a NumPy `.npy` file to any writer, for example an archive: little-endian, C order. `shape` lists the axes
/// from slowest to fastest.
///
/// ```
/// use heart_phantom::files::{Samples, put_npy};
/// let mut bytes = Vec::new();
/// put_npy(&mut bytes, &[2, 3], Samples::U8(&[1, 2, 3, 4, 5, 6]))?;
/// assert!(bytes.starts_with(b"\x93NUMPY") && bytes.ends_with(&[5, 6]));
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
/// Errors of `out`; [`io::ErrorKind::InvalidInput`] for more than 64 axes, or if `shape` and `samples` disagree.
pub fn put_npy(out: &mut dyn Write, shape: &[usize], samples: Samples) -> io::Result<()> {
    let expected = shape.iter().fold(1, |n: usize, &k| n.saturating_mul(k));
    if shape.len() > MOST_AXES || samples.len() != expected {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    put_samples(out, shape, samples)
}

pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    write_samples(path, &volume.axes(), volume.samples())
}

pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    write_samples(path, &projections.axes(), projections.samples())
}

fn write_samples(path: &Path, shape: &[usize], samples: Samples) -> Result<(), PhantomError> {
    write_atomically(path, |out| put_samples(out, shape, samples))
}

pub(super) fn put_samples(
    out: &mut dyn Write,
    shape: &[usize],
    samples: Samples,
) -> io::Result<()> {
    let kind = match samples {
        Samples::F32(_) => "<f4",
        Samples::U8(_) => "|u1",
        Samples::U16(_) => "<u2",
    };
    put_header(out, kind, shape)?;
    samples.write(out)
}

/// Returns the header of an array in C order, version 1.0 of the NumPy format
/// (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>): ten bytes (magic, version, length of the rest), then
/// type and shape as a Python dictionary, padded with spaces and a line end to a multiple of 64 bytes.
pub(super) fn put_header(out: &mut dyn Write, kind: &str, shape: &[usize]) -> io::Result<()> {
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
