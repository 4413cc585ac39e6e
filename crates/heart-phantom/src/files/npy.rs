//! NumPy: single arrays, and archives of named arrays.

use crate::error::PhantomError;
use crate::files::atomic::Pending;
use crate::files::{Projections, Samples, Volume, write_atomically};
use npyz::{AutoSerialize, WriterBuilder};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Writes `values` as a NumPy `.npy` file of little-endian `f32` in C order.
///
/// `shape` lists the axes from slowest to fastest; the product of its entries is `values.len()`.
///
/// # Errors
/// [`PhantomError::Length`] if `shape` and `values` disagree; [`PhantomError::File`] if the file
/// cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f32]) -> Result<(), PhantomError> {
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

/// npyz can write archives too, but brings bzip2 and zstd, which are C.
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
        put_header::<f64>(&mut self.0, &[values.len()])?;
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

/// The header, then all samples at once: one by one through the writer they would cost ten times the copying.
fn put_samples(out: &mut dyn Write, shape: &[usize], samples: Samples) -> io::Result<()> {
    match samples {
        Samples::F32(_) => put_header::<f32>(out, shape)?,
        Samples::U8(_) => put_header::<u8>(out, shape)?,
        Samples::U16(_) => put_header::<u16>(out, shape)?,
    }
    samples.write(out)
}

fn put_header<T: AutoSerialize>(out: &mut dyn Write, shape: &[usize]) -> io::Result<()> {
    let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
    npyz::WriteOptions::new_header_only()
        .dtype(T::default_dtype())
        .shape(&shape)
        .writer(out)
        .write_header_only()
        .map(drop)
}
