//! NRRD with its data inside, raw. Fields as in <https://teem.sourceforge.net/nrrd/format.html>. Gates are a fourth axis, a list.

use super::names::millimetres;
use crate::error::PhantomError;
use crate::files::{Projections, Samples, Volume, write_atomically};
use std::fmt::Write as _;
use std::path::Path;

pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let [nx, ny, nz] = volume.grid().shape();
    let [dx, dy, dz] = volume.spacing_mm();
    let [x, y, z] = volume.origin_mm();
    let (size, direction, kind, time) = match volume.seconds_per_gate() {
        None => Default::default(),
        Some(seconds) => (
            format!(" {}", volume.n_gates()),
            " none",
            " list",
            format!("seconds_per_gate:={seconds}\n"),
        ),
    };
    let fields = format!(
        "space: left-posterior-superior\n\
         sizes: {nx} {ny} {nz}{size}\n\
         space directions: ({dx},0,0) (0,{dy},0) (0,0,{dz}){direction}\n\
         kinds: domain domain domain{kind}\n\
         space units: \"mm\" \"mm\" \"mm\"\n\
         space origin: ({x},{y},{z})\n\
         {time}"
    );
    write(path, volume.axes().len(), &fields, volume.samples())
}

/// Several numbers a voxel, fastest: of kind `vector` along the axes of the space, or a `list` of others.
pub(super) fn write_field(
    path: &Path,
    place: &Volume,
    (n, samples): (usize, &[f32]),
    vectors: bool,
) -> Result<(), PhantomError> {
    let [nx, ny, nz] = place.grid().shape();
    let [dx, dy, dz] = place.spacing_mm();
    let [x, y, z] = place.origin_mm();
    let (kind, frame) = match vectors {
        true => ("vector", "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n"),
        false => ("list", ""),
    };
    let fields = format!(
        "space: left-posterior-superior\n\
         sizes: {n} {nx} {ny} {nz}\n\
         space directions: none ({dx},0,0) (0,{dy},0) (0,0,{dz})\n\
         kinds: {kind} domain domain domain\n\
         space units: \"mm\" \"mm\" \"mm\"\n\
         space origin: ({x},{y},{z})\n\
         {frame}"
    );
    write(path, 4, &fields, samples.into())
}

/// Axes bin, row, view. The third counts the views, as they need not be evenly spaced: the angles are a key of their own.
/// It is of kind `domain`, not `list`: ITK would make the views the components of its pixels.
pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let [views, rows, bins] = projections.shape();
    let [pitch_bin, pitch_row] = projections.detector().pitch().map(millimetres);
    let [bin, row] = projections.first().map(millimetres);
    let radii = projections.radius();
    let radii: Vec<f64> = radii.as_slice().iter().map(|r| millimetres(*r)).collect();
    let (size, spacing, kind, label, unit, time) = match projections.seconds_per_gate() {
        None => Default::default(),
        Some(seconds) => (
            format!(" {}", projections.n_gates()),
            format!(" {seconds}"),
            " list",
            " \"gate\"",
            " \"s\"",
            format!("seconds_per_gate:={seconds}\n"),
        ),
    };
    let mut fields = format!(
        "sizes: {bins} {rows} {views}{size}\n\
         spacings: {pitch_bin} {pitch_row} 1{spacing}\n\
         kinds: domain domain domain{kind}\n\
         labels: \"bin\" \"row\" \"view\"{label}\n\
         units: \"mm\" \"mm\" \"\"{unit}\n\
         {time}\
         first_bin_mm:={bin}\n\
         first_row_mm:={row}\n\
         radius_mm:={}\n\
         angles_rad:=",
        spaced(&radii)
    );
    fields += &spaced(projections.angles());
    fields.push('\n');
    if let Some(counts) = projections.counts_per_unit() {
        // Writing into a String does not fail.
        let _ = writeln!(fields, "counts_per_unit:={}", spaced(counts));
    }
    write(
        path,
        projections.axes().len(),
        &fields,
        projections.samples(),
    )
}

fn spaced(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
    texts.join(" ")
}

fn write(path: &Path, axes: usize, fields: &str, samples: Samples) -> Result<(), PhantomError> {
    let kind = match samples {
        Samples::F32(_) => "float",
        Samples::U8(_) => "uint8",
        Samples::U16(_) => "uint16",
    };
    write_atomically(path, |out| {
        write!(
            out,
            "NRRD0004\n\
             # heart-phantom\n\
             type: {kind}\n\
             dimension: {axes}\n\
             endian: little\n\
             encoding: raw\n\
             {fields}\n"
        )?;
        samples.write(out)
    })
}
