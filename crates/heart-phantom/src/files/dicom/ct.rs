//! CT Image Storage: an attenuation map as the slices of a CT.

use super::identity::series;
use super::item::Item;
use super::nuclear::of_a_phantom;
use super::pixels::Pixels;
use crate::error::{PhantomError, check, check_count};
use crate::files::{Samples, Volume, write_atomically};
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::io;
use std::path::{Path, PathBuf};

/// Writes an attenuation map in 1/cm as the slices of a CT, one file each, for programs that derive their maps from a CT:
/// `stem-0000.dcm` is the slice nearest to the feet. Returns the names of the files.
///
/// A pixel is a Hounsfield unit, `1000 (mu / water - 1)`, rounded. `water` is the attenuation of water in 1/cm that the reader
/// assumes: at 140.5 keV 0.1536 (NIST, <https://physics.nist.gov/PhysRefData/XrayMassCoef/ComTab/water.html>, between 100 and 150
/// keV). Half a unit is 0.05 % of water.
///
/// # Errors
/// [`PhantomError::OutOfRange`] if `water` is not positive, or a sample has no Hounsfield unit of 16 bits; [`PhantomError::Count`] if a
/// slice has more than 65535 rows or columns; [`PhantomError::Unsupported`] for labels; [`PhantomError::File`].
///
/// ```
/// use heart_phantom::files::{Volume, write_ct};
/// use heart_phantom::revolve_voxel::VoxelGrid;
/// let grid = VoxelGrid::centred([4, 3, 2], [0.4; 3], [0.0; 3])?;
/// let map = vec![0.15_f32; 24]; // [z][y][x], 1/cm
/// let folder = tempfile::tempdir()?; // or any other
/// let files = write_ct(folder.path(), "ct", &Volume::new(grid, &map)?, 0.1536)?;
/// assert_eq!(files.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_ct(
    folder: &Path,
    stem: &str,
    volume: &Volume,
    water: f64,
) -> Result<Vec<PathBuf>, PhantomError> {
    check("attenuation of water", water, [1e-6, 1e6])?;
    let Samples::F32(samples) = volume.samples else {
        return Err(PhantomError::Unsupported {
            format: "a CT",
            what: "labels",
        });
    };
    let [nx, ny, nz] = volume.grid.shape();
    let side = |what, n| check_count(what, n, [1, u16::MAX.into()]).map(|n| n as u16);
    let sides = [side("rows", ny)?, side("columns", nx)?];
    let unit = |mu: f32| 1000.0 * (f64::from(mu) / water - 1.0);
    for &mu in samples {
        check(
            "Hounsfield unit",
            unit(mu),
            [i16::MIN.into(), i16::MAX.into()],
        )?;
    }
    let ([dx, dy, dz], [x, y, z]) = (volume.spacing_mm(), volume.origin_mm());
    let slice = |(k, slice): (usize, &[f32])| {
        let pixels = slice.iter().map(|&mu| unit(mu).round() as i16);
        let item = of_a_phantom("CT")
            .text(tags::IMAGE_TYPE, VR::CS, "DERIVED\\SECONDARY\\AXIAL")
            .text(tags::BODY_PART_EXAMINED, VR::CS, "CHEST")
            .text(tags::PATIENT_POSITION, VR::CS, "HFS")
            .text(tags::INSTANCE_NUMBER, VR::IS, &(k + 1).to_string())
            .empty(&[(tags::ACQUISITION_NUMBER, VR::IS), (tags::KVP, VR::DS)])
            .decimals(tags::IMAGE_POSITION_PATIENT, &[x, y, z + k as f64 * dz])
            .decimals(
                tags::IMAGE_ORIENTATION_PATIENT,
                &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            )
            .decimals(tags::SLICE_THICKNESS, &[dz])
            .text(tags::RESCALE_TYPE, VR::LO, "HU");
        Pixels::signed(pixels.flat_map(i16::to_le_bytes).collect()).put(item, sides, [dy, dx])
    };
    let slices: Vec<Item> = (samples.chunks_exact(nx * ny).enumerate())
        .map(slice)
        .collect();
    let made = series(slices, uids::CT_IMAGE_STORAGE, volume.study);
    let files = made.map_err(|source| PhantomError::File {
        path: folder.join(stem),
        source,
    })?;
    let digits = (nz - 1).to_string().len().max(4);
    let mut names = Vec::with_capacity(nz);
    for (k, file) in files.iter().enumerate() {
        let name = PathBuf::from(format!("{stem}-{k:0digits$}.dcm"));
        write_atomically(&folder.join(&name), |out| {
            file.write_all(out).map_err(io::Error::other)
        })?;
        names.push(name);
    }
    Ok(names)
}
