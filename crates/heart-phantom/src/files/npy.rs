//! NumPy: single arrays.

use crate::error::{PhantomError, check_count, check_length};
use crate::files::{Projections, Samples, Volume, write_atomically};
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
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
    write_atomically(path, |out| put_npy(out, shape, values.into()))
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
    let kind = match samples {
        Samples::F32(_) => "<f4",
        Samples::U8(_) => "|u1",
        Samples::U16(_) => "<u2",
    };
    put_header(out, kind, shape)?;
    samples.write(out)
}

/// An array of a NumPy file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NpyArray {
    /// Lengths of the axes, from slowest to fastest.
    pub shape: Vec<usize>,
    /// The samples in C order, integers exactly converted; their number is the product of `shape`.
    pub samples: Vec<f32>,
}

/// Reads a NumPy `.npy` file: little-endian `f32`, `u8`, `u16` or half precision, in C order.
///
/// ```
/// use heart_phantom::files::{read_npy, write_npy};
/// use ndarray::ArrayD;
/// let folder = tempfile::tempdir()?; // or any other
/// let path = folder.path().join("volume.npy");
/// write_npy(&path, &[2, 1, 3], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])?; // [z][y][x]
/// let array = read_npy(&path)?;
/// let volume = ArrayD::from_shape_vec(array.shape, array.samples)?; // without a copy
/// assert_eq!(volume[[1, 0, 2]], 5.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`PhantomError::Read`], with the errors of [`get_npy`].
pub fn read_npy(path: &Path) -> Result<NpyArray, PhantomError> {
    let read = |file| get_npy(BufReader::new(file));
    let named = |error: io::Error| match error.kind() {
        io::ErrorKind::UnexpectedEof => io::Error::new(error.kind(), "the file ends too early"),
        _ => error,
    };
    (File::open(path).and_then(read))
        .map_err(named)
        .map_err(|source| PhantomError::Read {
            path: path.to_path_buf(),
            source,
        })
}

/// Reads an array as [`read_npy`] from any reader, which is then at the end of the array. Memory: the bytes of the array and
/// its samples as `f32`.
///
/// # Errors
/// Errors of `from`; [`io::ErrorKind::InvalidData`] for bytes that are not an array in C order of one of these types,
/// [`io::ErrorKind::UnexpectedEof`] for missing bytes.
pub fn get_npy(mut from: impl Read) -> io::Result<NpyArray> {
    let wrong = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what);
    let mut start = [0; 8];
    from.read_exact(&mut start)?;
    // Version 1 has two bytes for the length of the header, later ones four.
    let mut length = [0; 4];
    let bytes = match start {
        [0x93, b'N', b'U', b'M', b'P', b'Y', 1, _] => 2,
        [0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _] => 4,
        _ => return Err(wrong("not a NumPy array of version 1, 2 or 3")),
    };
    from.read_exact(&mut length[..bytes])?;
    let header = taken(&mut from, u32::from_le_bytes(length).into())?;
    let header = String::from_utf8_lossy(&header);
    let entry = |name: &str| header.split_once(name).map(|(_, rest)| rest.trim_start());
    if !entry("'fortran_order':").is_some_and(|order| order.starts_with("False")) {
        return Err(wrong("the array is not in C order"));
    }
    let axes = entry("'shape':").and_then(|rest| rest.strip_prefix('(')?.split_once(')'));
    let axes = axes.map_or("?", |(axes, _)| axes).split(',').map(str::trim);
    let shape: Result<Vec<usize>, _> = axes
        .filter(|axis| !axis.is_empty())
        .map(str::parse)
        .collect();
    let shape = shape.map_err(|_| wrong("the shape is not a list of lengths"))?;
    let kind = entry("'descr':").map_or("", |rest| rest.get(..5).unwrap_or(rest));
    let each = match kind {
        "'|u1'" => 1,
        "'<u2'" | "'<f2'" => 2,
        "'<f4'" => 4,
        _ => return Err(wrong("the type is not |u1, <u2, <f2 or <f4")),
    };
    let length = shape
        .iter()
        .try_fold(each, |n: u64, &k| n.checked_mul(k as u64));
    let length = length.ok_or_else(|| wrong("the array is larger than any memory"))?;
    let bytes = taken(&mut from, length)?;
    let pairs = || (bytes.as_chunks().0.iter()).map(|pair| u16::from_le_bytes(*pair));
    let samples = match kind {
        "'<f4'" => (bytes.as_chunks().0.iter())
            .map(|x| f32::from_le_bytes(*x))
            .collect(),
        "'<f2'" => pairs().map(single).collect(),
        "'<u2'" => pairs().map(f32::from).collect(),
        _ => bytes.into_iter().map(f32::from).collect(),
    };
    Ok(NpyArray { shape, samples })
}

/// Returns the next `length` bytes; a wrong length does not allocate more than there are bytes.
fn taken(from: &mut impl Read, length: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    match from.take(length).read_to_end(&mut bytes)? as u64 == length {
        true => Ok(bytes),
        false => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}

/// Returns the number with these bits in half precision (IEEE 754 binary16).
fn single(bits: u16) -> f32 {
    let (sign, size) = (u32::from(bits & 0x8000) << 16, u32::from(bits & 0x7fff));
    let magnitude = match size {
        // Multiples of 2^-24.
        ..0x400 => size as f32 / 16_777_216.0,
        // The exponents have the offsets 15 and 127.
        0x400..0x7c00 => f32::from_bits((size << 13) + (112 << 23)),
        _ => f32::from_bits((size << 13) | 0x7f80_0000),
    };
    f32::from_bits(magnitude.to_bits() | sign)
}

pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    write_atomically(path, |out| put_npy(out, &volume.axes(), volume.samples))
}

pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    write_atomically(path, |out| {
        put_npy(out, &projections.axes(), projections.samples)
    })
}

/// Writes an array of `f64`.
pub(super) fn put_f64(out: &mut dyn Write, shape: &[usize], values: &[f64]) -> io::Result<()> {
    put_header(out, "<f8", shape)?;
    (values.iter()).try_for_each(|value| out.write_all(&value.to_le_bytes()))
}

/// Writes the header of an array in C order, version 1.0 of the NumPy format
/// (<https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>): ten bytes (magic, version, length of the rest), then
/// type and shape as a Python dictionary, padded with spaces and a line end to a multiple of 64 bytes.
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
