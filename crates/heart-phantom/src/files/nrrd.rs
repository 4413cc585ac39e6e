//! NRRD with its data inside, raw. Fields as in <https://teem.sourceforge.net/nrrd/format.html>. Gates are a fourth axis, a list.

use super::names::millimetres;
use super::volume::Axis;
use crate::error::PhantomError;
use crate::files::{Projections, Samples, Volume, write_atomically};
use std::fmt::Write as _;
use std::path::Path;

pub(super) fn write_volume(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let [nx, ny, nz] = volume.grid.shape();
    let [dx, dy, dz] = volume.spacing_mm();
    let [x, y, z] = volume.origin_mm();
    let sides = format!("{nx} {ny} {nz}");
    let directions = format!("({dx},0,0) (0,{dy},0) (0,0,{dz})");
    let kinds = "domain domain domain";
    let (sizes, directions, kinds, more) = match volume.axis {
        Axis::Single => (sides, directions, kinds.to_owned(), String::new()),
        Axis::Gates(seconds) => (
            format!("{sides} {}", volume.n_gates()),
            format!("{directions} none"),
            format!("{kinds} list"),
            format!("seconds_per_gate:={seconds}\n"),
        ),
        Axis::Field(of) => {
            let (kind, frame) = match of.is_vector() {
                true => ("vector", "measurement frame: (1,0,0) (0,1,0) (0,0,1)\n"),
                false => ("list", ""),
            };
            (
                format!("{} {sides}", of.components()),
                format!("none {directions}"),
                format!("{kind} {kinds}"),
                frame.to_owned(),
            )
        }
    };
    let fields = format!(
        "space: left-posterior-superior\n\
         sizes: {sizes}\n\
         space directions: {directions}\n\
         kinds: {kinds}\n\
         space units: \"mm\" \"mm\" \"mm\"\n\
         space origin: ({x},{y},{z})\n\
         {more}"
    );
    let axes = volume.axes().len();
    match volume.field() {
        Some(_) => write(path, axes, &fields, (&*volume.in_world([1.0; 3])).into()),
        None => write(path, axes, &fields, volume.samples),
    }
}

/// Axes bin, row, view. Views need not be evenly spaced, so the angles are a separate key. The axis is of kind `domain`, not
/// `list`: ITK would read views of kind `list` as components of pixels.
pub(super) fn write_projections(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let [views, rows, bins] = projections.shape();
    let [pitch_bin, pitch_row] = projections.detector.pitch().map(millimetres);
    let [bin, row] = projections.first().map(millimetres);
    let radii: Vec<f64> = projections.radii.iter().map(|r| millimetres(*r)).collect();
    let (size, spacing, kind, label, unit, time) = match projections.seconds_per_gate {
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
    fields += &spaced(projections.angles);
    fields.push('\n');
    if let Some(counts) = projections.counts {
        // Writing into a String does not fail.
        let _ = writeln!(fields, "counts_per_unit:={}", spaced(counts));
    }
    write(path, projections.axes().len(), &fields, projections.samples)
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
