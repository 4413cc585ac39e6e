//! Interfile: a text header of `key := value` lines beside the samples, as STIR and as SIMIND write it.
//!
//! Sources:
//!
//! - STIR images: keys, and `first pixel offset (mm)` as the centre of the first voxel: `src/IO/interfile.cxx`,
//!   `write_basic_interfile_image_header` and `create_image_and_header_from` (<https://github.com/UCL/STIR>, 9a59610).
//! - The axes of STIR for a patient head in, supine are left, posterior, inferior; z is inverted in the conversion to LPS,
//!   `DiscretisedDensity::swap_axes_based_on_orientation`. So the slices go from head to feet, and z = -z of the lab.
//! - STIR projections: keys, `extent of rotation` as views times step, CCW as growing angles: `InterfilePDFSHeaderSPECT.cxx`,
//!   `write_basic_interfile_PDFS_header`. At angle phi the bins lie along (cos phi, sin phi), the detector's face on
//!   radius * (-sin phi, cos phi): `fill_ang` of `SPECTUB_Tools.cxx`. That is the lab's own rule with phi = theta.
//!   STIR takes the detector as centred on the axis; its SPECT projector takes the image as centred, too (STIR issue 1235).
//! - SIMIND: the keys of the `.h00` files that it writes: `short float`, rows from the top down (`Image Orientation` 1 0 0 0 0 -1),
//!   and the first slice of a map towards the head (<http://www.radfys.lu.se/simind/Change.html>: "first ... image is located
//!   towards +X", X being its long axis). Readers look at `program version`: from 8 on the radius is in mm, before in cm.
//! - Radii of other orbits: STIR has `orbit := non-circular` and `Radii := {...}` in mm (the same file, and `radii` in it); SIMIND has
//!   `orbit := noncircular` and a text file `.cor` with one radius in cm per line, which PyTomography reads unchanged as `corrfile`
//!   (`io/SPECT/simind.py`).
//! - PyTomography 3.4.0 (<https://pypi.org/project/pytomography/3.4.0>), which reads these files: view k of a step d is at
//!   `-start + k d`, of CW at `start - k d` (`io/SPECT/simind.py`); from angle beta the bins of an image array `[x][y]` lie along
//!   (cos beta, -sin beta), the detector towards (-sin beta, -cos beta) (`utils/spatial.py`, `rotate_detector_z`, and kornia's
//!   `rotate`, counter-clockwise as displayed). With beta = 180 degrees - theta and the bins the other way round, as a camera
//!   in front of the patient shows them, arrays of volumes and of maps are the lab's. Growing angles are then CW.
//! - Gates in one file: `GSPECT` with one time window (the accepted R-R intervals) that contains one image per view or slice and time slot. The keys
//!   are those of Interfile 3.3 as xmedcon reads them (`m-intf.c`).
//! - xmedcon 0.23.0 requires the numbers of images, energy windows and heads, which are optional in STIR.

use super::names::{data_beside, millimetres};
use super::turn::{Turn, check_centred};
use crate::error::PhantomError;
use crate::files::atomic::write_with_header;
use crate::files::{Projections, Samples, Volume, write_atomically};
use crate::text::short;
use std::path::Path;

/// Extension of the file of radii of SIMIND.
pub(crate) const ORBIT_EXTENSION: &str = "cor";

pub(super) fn write_volume_stir(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "v");
    let [nx, ny, nz] = volume.grid.shape();
    let [dx, dy, dz] = volume.spacing_mm();
    let [x, y, z] = volume.origin_mm();
    let first_z = -(z + (nz as f64 - 1.0) * dz);
    let number = number_format(volume.samples, "float");
    let header = format!(
        "!INTERFILE :=\n\
         !imaging modality := nucmed\n\
         !version of keys := STIR6.0\n\
         name of data file := {name}\n\
         !GENERAL DATA :=\n\
         patient orientation := head_in\n\
         patient rotation := supine\n\
         !GENERAL IMAGE DATA :=\n\
         !type of data := Tomographic\n\
         imagedata byte order := LITTLEENDIAN\n\
         !SPECT STUDY (General) :=\n\
         process status := Reconstructed\n\
         {number}\
         number of dimensions := 3\n\
         matrix axis label [1] := x\n\
         !matrix size [1] := {nx}\n\
         scaling factor (mm/pixel) [1] := {dx}\n\
         matrix axis label [2] := y\n\
         !matrix size [2] := {ny}\n\
         scaling factor (mm/pixel) [2] := {dy}\n\
         matrix axis label [3] := z\n\
         !matrix size [3] := {nz}\n\
         scaling factor (mm/pixel) [3] := {dz}\n\
         first pixel offset (mm) [1] := {x}\n\
         first pixel offset (mm) [2] := {y}\n\
         first pixel offset (mm) [3] := {first_z}\n\
         number of time frames := 1\n\
         !END OF INTERFILE :=\n"
    );
    write_with_header(path, header.as_bytes(), &data, |out| {
        volume.samples.write_reversed(nx * ny, nz, out)
    })
}

/// Interfile 3.3 has no key for a position: readers centre the array, so the grid must be centred.
pub(super) fn write_volume_simind(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "a00");
    let shape = volume.grid.shape();
    let [nx, ny, nz] = shape;
    let [dx, dy, dz] = volume.spacing_mm();
    for a in 0..3 {
        let spacing = volume.grid.spacing()[a];
        let centre = volume.grid.origin()[a] + 0.5 * (shape[a] as f64 - 1.0) * spacing;
        check_centred("centre of the grid in voxels", centre / spacing, shape[a])?;
    }
    let images = volume.n_gates() * nz;
    let head = simind_head(&name, images, volume.seconds_per_gate().is_some());
    let study = study_of(volume.n_gates(), volume.seconds_per_gate());
    let number = number_format(volume.samples, "short float");
    let thickness = dz / dx;
    let header = format!(
        "{head}\
         {study}\
         number of detector heads := 1\n\
         !number of images/energy window := {images}\n\
         !process status := reconstructed\n\
         !matrix size [1] := {nx}\n\
         !matrix size [2] := {ny}\n\
         ;# !matrix size [3] := {nz}\n\
         {number}\
         scaling factor (mm/pixel) [1] := {dx}\n\
         scaling factor (mm/pixel) [2] := {dy}\n\
         ;# scaling factor (mm/pixel) [3] := {dz}\n\
         !SPECT STUDY (reconstructed data) :=\n\
         !number of slices := {nz}\n\
         slice orientation := transverse\n\
         slice thickness (pixels) := {thickness}\n\
         centre-centre slice separation (pixels) := {thickness}\n\
         !END OF INTERFILE :=\n"
    );
    write_with_header(path, header.as_bytes(), &data, |out| {
        volume.samples.write_reversed(nx * ny, nz, out)
    })
}

pub(super) fn write_projections_stir(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "s");
    let turn = Turn::of(projections, projections.angles)?;
    let number = number_format(projections.samples, "float");
    let orbit = match projections.radii {
        [radius] => circular(*radius),
        radii => {
            let radii: Vec<_> = radii.iter().map(|r| millimetres(*r).to_string()).collect();
            format!("orbit := non-circular\nRadii := {{{}}}\n", radii.join(", "))
        }
    };
    let acquired = acquired(projections, &turn, &orbit);
    let [views, ..] = projections.shape();
    let header = format!(
        "!INTERFILE :=\n\
         !imaging modality := nucmed\n\
         name of data file := {name}\n\
         originating system := heart-phantom\n\
         !version of keys := 3.3\n\
         !GENERAL DATA :=\n\
         !GENERAL IMAGE DATA :=\n\
         !type of data := Tomographic\n\
         patient orientation := head_in\n\
         patient rotation := supine\n\
         imagedata byte order := LITTLEENDIAN\n\
         !total number of images := {views}\n\
         !number of energy windows := 1\n\
         !SPECT STUDY (General) :=\n\
         {number}\
         number of detector heads := 1\n\
         {acquired}"
    );
    // Rows from head to feet, like the slices.
    let [_, rows, bins] = projections.shape();
    write_with_header(path, header.as_bytes(), &data, |out| {
        projections.samples.write_reversed(bins, rows, out)
    })
}

pub(super) fn write_projections_simind(
    path: &Path,
    projections: &Projections,
) -> Result<(), PhantomError> {
    let (data, name) = data_beside(path, "a00");
    let turn = Turn::of(projections, projections.angles)?;
    let (gates, seconds) = (projections.n_gates(), projections.seconds_per_gate);
    let images = gates * projections.angles.len();
    let head = simind_head(&name, images, seconds.is_some());
    let study = study_of(gates, seconds);
    let number = number_format(projections.samples, "short float");
    let start = match turn.increases {
        true => 180.0 - turn.start,
        false => turn.start - 180.0,
    };
    let turn = Turn {
        start: start.rem_euclid(360.0),
        increases: !turn.increases,
        ..turn
    };
    let orbit = match projections.radii {
        [radius] => circular(*radius),
        radii => {
            let (beside, name) = data_beside(path, ORBIT_EXTENSION);
            write_atomically(&beside, |out| {
                (radii.iter()).try_for_each(|radius| writeln!(out, "{}", short(*radius)))
            })?;
            format!("orbit := noncircular\n;# Non-Uniform Orbit File := {name}\n")
        }
    };
    let acquired = acquired(projections, &turn, &orbit);
    let header = format!(
        "{head}\
         ;# Image Orientation := 1.000 0.000 0.000 0.000 0.000 -1.000\n\
         {study}\
         {number}\
         number of detector heads := 1\n\
         !number of images/energy window := {images}\n\
         {acquired}"
    );
    // Rows from head to feet, bins from s = +.
    let [_, rows, bins] = projections.shape();
    write_with_header(path, header.as_bytes(), &data, |out| {
        projections.samples.write_backwards(rows * bins, out)
    })
}

/// The first line of a study, and the keys of gates if they share the file.
fn study_of(n: usize, seconds: Option<f64>) -> String {
    match seconds {
        None => "!SPECT STUDY (General) :=\n".to_owned(),
        Some(seconds) => format!(
            "!GATED SPECT STUDY (general) :=\n\
             !gated SPECT nesting outer level := Gated\n\
             number of time windows := 1\n\
             !Gated Study (each time window) :=\n\
             !time window number := 1\n\
             !number of images in time window := {n}\n\
             !image duration (sec) := {seconds}\n"
        ),
    }
}

/// The first lines of SIMIND headers; the version defines the units.
fn simind_head(data: &str, images: usize, is_gated: bool) -> String {
    let kind = if is_gated { "GSPECT" } else { "tomographic" };
    format!(
        "!INTERFILE :=\n\
         !imaging modality := nucmed\n\
         !originating system := heart-phantom\n\
         program version := V8.0\n\
         !version of keys := 3.3\n\
         !GENERAL DATA :=\n\
         !data offset in bytes := 0\n\
         !name of data file := {data}\n\
         !GENERAL IMAGE DATA :=\n\
         !type of data := {kind}\n\
         patient orientation := head_in\n\
         patient rotation := supine\n\
         imagedata byte order := LITTLEENDIAN\n\
         !total number of images := {images}\n\
         !number of energy windows := 1\n"
    )
}

/// The keys of projections of both kinds, from the number of views to the end.
fn acquired(projections: &Projections, turn: &Turn, orbit: &str) -> String {
    let [views, rows, bins] = projections.shape();
    let [pitch_bin, pitch_row] = projections.detector.pitch().map(millimetres);
    let counts = counts(projections);
    let Turn { start, extent, .. } = turn;
    let direction = if turn.increases { "CCW" } else { "CW" };
    format!(
        "!number of projections := {views}\n\
         !extent of rotation := {extent}\n\
         !process status := acquired\n\
         !matrix size [1] := {bins}\n\
         scaling factor (mm/pixel) [1] := {pitch_bin}\n\
         !matrix size [2] := {rows}\n\
         scaling factor (mm/pixel) [2] := {pitch_row}\n\
         !SPECT STUDY (acquired data) :=\n\
         !direction of rotation := {direction}\n\
         start angle := {start}\n\
         {orbit}\
         {counts}\
         !END OF INTERFILE :=\n"
    )
}

fn circular(radius: f64) -> String {
    format!("orbit := circular\nRadius := {}\n", millimetres(radius))
}

/// A comment, because Interfile has no such key: expected counts of a sample of 1, one number if equal in all views.
fn counts(projections: &Projections) -> String {
    let told = match (projections.common_counts(), projections.counts) {
        (_, None) => return String::new(),
        (Some(common), _) => common.to_string(),
        (None, Some(counts)) => {
            let told: Vec<String> = counts.iter().map(f64::to_string).collect();
            told.join(", ")
        }
    };
    format!(";# counts per unit := {told}\n")
}

fn number_format(samples: Samples, float: &str) -> String {
    let format = match samples {
        Samples::F32(_) => float,
        Samples::U8(_) | Samples::U16(_) => "unsigned integer",
    };
    let bytes = samples.bytes_each();
    format!("!number format := {format}\n!number of bytes per pixel := {bytes}\n")
}
