//! NIfTI-1 in one file.
//!
//! The header has 348 bytes, <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>. It is written here because the existing
//! Rust crate requires its own arrays and leaves qform and sform to the caller.
//!
//! The world frame of NIfTI is right, anterior, superior; the lab is left, posterior, superior. So world = (-x, -y, z): half a turn
//! about z, quaternion (0, 0, 0, 1), no reflection (qfac = 1). Both qform and sform contain it, with code 1 (scanner anatomical).
//! Gates are the fourth axis, in seconds.

use super::volume::Axis;
use crate::error::{PhantomError, check, check_count};
use crate::files::{FieldOf, Samples, Volume, write_atomically};
use std::io::{self, Write};
use std::path::Path;

/// Returns a volume as the bytes of a NIfTI-1 file; a sample is `factor` times the stored value (`scl_slope`).
///
/// # Errors
/// [`PhantomError::Count`] if a side is too long for the format; [`PhantomError::OutOfRange`] if the factor is not positive.
pub fn nifti_bytes(volume: &Volume, factor: f64) -> Result<Vec<u8>, PhantomError> {
    let least = f64::from(f32::MIN_POSITIVE);
    let factor = check("factor of samples", factor, [least, f64::from(f32::MAX)])?;
    let mut header = header(volume)?;
    header[112..116].copy_from_slice(&(factor as f32).to_le_bytes()); // scl_slope
    let samples = volume.samples;
    let mut bytes = Vec::with_capacity(header.len() + samples.len() * samples.bytes_each());
    // Writing to a vector does not fail.
    let _ = put(&mut bytes, &header, volume);
    Ok(bytes)
}

pub(super) fn write(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let header = header(volume)?;
    write_atomically(path, |out| put(out, &header, volume))
}

#[cfg(feature = "files")]
pub(super) fn write_gz(path: &Path, volume: &Volume) -> Result<(), PhantomError> {
    let header = header(volume)?;
    write_atomically(path, |out| {
        let level = flate2::Compression::fast();
        let mut out = flate2::write::GzEncoder::new(out, level);
        put(&mut out, &header, volume)?;
        out.finish()?;
        Ok(())
    })
}

fn put(out: &mut dyn Write, header: &Header, volume: &Volume) -> io::Result<()> {
    out.write_all(header)?;
    match volume.field() {
        None => volume.samples.write(out),
        // Components slowest.
        Some(of) => Samples::F32(&volume.in_world([-1.0, -1.0, 1.0]))
            .write_interleaved(of.components(), out),
    }
}

/// A header and four zero bytes (no extension).
type Header = [u8; 352];

fn header(volume: &Volume) -> Result<Header, PhantomError> {
    let mut header = [0; 352];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348_i32.to_le_bytes()); // sizeof_hdr
    put(38, b"r"); // regular
    let mut dim = [3_i16, 1, 1, 1, 1, 1, 1, 1];
    for (to, n) in dim[1..].iter_mut().zip(volume.grid.shape()) {
        *to = check_count("voxels along a side", n, [1, i16::MAX as usize])? as i16;
    }
    let most = [1, i16::MAX as usize];
    match volume.axis {
        Axis::Single => {}
        Axis::Gates(seconds) => {
            dim[0] = 4;
            dim[4] = check_count("gates", volume.n_gates(), most)? as i16;
            put(92, &(seconds as f32).to_le_bytes()); // pixdim[4]
        }
        Axis::Field(of) => {
            dim[0] = 5;
            dim[5] = check_count("components of a field", of.components(), most)? as i16;
            let intent: i16 = match of {
                FieldOf::Displacement => 1006,                      // DISPVECT
                FieldOf::Velocity | FieldOf::Components(_) => 1007, // VECTOR
            };
            put(68, &intent.to_le_bytes()); // intent_code
            put(92, &1_f32.to_le_bytes()); // pixdim[4]
            put(96, &1_f32.to_le_bytes()); // pixdim[5]
        }
    }
    for (k, n) in dim.iter().enumerate() {
        put(40 + 2 * k, &n.to_le_bytes());
    }
    let datatype: i16 = match volume.samples {
        Samples::U8(_) => 2,
        Samples::F32(_) => 16,
        Samples::U16(_) => 512,
    };
    put(70, &datatype.to_le_bytes());
    put(72, &(8 * volume.samples.bytes_each() as i16).to_le_bytes()); // bitpix
    let spacing = volume.spacing_mm();
    put(76, &1_f32.to_le_bytes()); // qfac
    for (a, mm) in spacing.iter().enumerate() {
        put(80 + 4 * a, &(*mm as f32).to_le_bytes()); // pixdim
    }
    put(108, &352_f32.to_le_bytes()); // vox_offset
    put(112, &1_f32.to_le_bytes()); // scl_slope
    let time = volume.seconds_per_gate().map_or(0, |_| 8);
    put(123, &[2 | time]); // xyzt_units: mm, s
    put(
        148,
        b"heart-phantom; lab x, y, z = left, posterior, superior",
    ); // descrip
    put(252, &1_i16.to_le_bytes()); // qform_code
    put(254, &1_i16.to_le_bytes()); // sform_code
    put(264, &1_f32.to_le_bytes()); // quatern_d; b and c are 0
    let origin = volume.origin_mm();
    for (a, sign) in [-1.0, -1.0, 1.0].into_iter().enumerate() {
        let offset = ((sign * origin[a]) as f32).to_le_bytes();
        put(268 + 4 * a, &offset); // qoffset
        let row = 280 + 16 * a; // srow_x, srow_y, srow_z
        put(row + 4 * a, &((sign * spacing[a]) as f32).to_le_bytes());
        put(row + 12, &offset);
    }
    put(344, b"n+1\0"); // magic
    Ok(header)
}
