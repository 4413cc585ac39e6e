//! NumPy: archives of named arrays.

use crate::error::PhantomError;
use crate::files::atomic::write_file;
use crate::files::sparse::SparseFile;
use crate::files::{Projections, Samples, Volume, npy};
use std::io::{self, BufWriter};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Arrays `samples` [z][y][x], `spacing_cm` and `origin_cm` (x, y, z); of gates `samples` [gate][z][y][x] and `seconds_per_gate`,
/// of fields `samples` [z][y][x][component].
pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    write_npz(path, &volume.axes(), volume.samples, |archive| {
        archive.array("spacing_cm", &volume.grid.spacing())?;
        archive.array("origin_cm", &volume.grid.origin())?;
        archive.some("seconds_per_gate", volume.seconds_per_gate())
    })
}

/// Arrays `samples` [view][row][bin], `angles_rad`, `pitch_cm` and `first_cm` (bin, row), `radius_cm` (one, or one for each view);
/// `counts_per_unit` of each view, if it is known; of gates `samples` [gate][view][row][bin] and `seconds_per_gate`.
pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    write_npz(path, &projections.axes(), projections.samples, |archive| {
        archive.array("angles_rad", projections.angles)?;
        archive.array("pitch_cm", &projections.detector.pitch())?;
        archive.array("first_cm", &projections.first())?;
        archive.array("radius_cm", projections.radii)?;
        archive.some("seconds_per_gate", projections.seconds_per_gate)?;
        (projections.counts).map_or(Ok(()), |counts| archive.array("counts_per_unit", counts))
    })
}

struct Archive<'a>(ZipWriter<&'a mut BufWriter<SparseFile>>);

impl Archive<'_> {
    fn begin(&mut self, name: &str) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true); // past 4 GiB
        Ok(self.0.start_file(format!("{name}.npy"), options)?)
    }

    fn some(&mut self, name: &str, value: Option<f64>) -> io::Result<()> {
        value.map_or(Ok(()), |value| self.array(name, &[value]))
    }

    fn array(&mut self, name: &str, values: &[f64]) -> io::Result<()> {
        self.begin(name)?;
        npy::put_f64(&mut self.0, &[values.len()], values)
    }
}

fn write_npz(
    path: &Path,
    shape: &[usize],
    samples: Samples,
    rest: impl FnOnce(&mut Archive) -> io::Result<()>,
) -> Result<(), PhantomError> {
    write_file(path, |out| {
        let mut archive = Archive(ZipWriter::new(out));
        archive.begin("samples")?;
        npy::put_npy(&mut archive.0, shape, samples)?;
        rest(&mut archive)?;
        archive.0.finish()?;
        Ok(())
    })
}
