//! Several numbers a voxel: displacements, velocities, strains.

use super::names::check_extension;
use crate::error::PhantomError;
use crate::files::{Format, Samples, Volume, metaimage, nifti, npy, nrrd};
#[cfg(feature = "files")]
use crate::files::{npz, raw_json};
use revolve_voxel::VoxelGrid;
use std::path::Path;

/// What the numbers of a voxel are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldOf {
    /// Displacements along the lab's x, y, z in cm.
    Displacement,
    /// Velocities along the lab's x, y, z in cm/s.
    Velocity,
    /// So many numbers that belong to no axes of the world.
    Components(usize),
}

impl FieldOf {
    /// Numbers of a voxel.
    pub fn components(self) -> usize {
        match self {
            Self::Displacement | Self::Velocity => 3,
            Self::Components(n) => n,
        }
    }

    /// The samples as a world has them whose axes are the lab's with these signs, and whose lengths are millimetres.
    fn in_world(self, samples: &[f32], signs: [f32; 3]) -> Vec<f32> {
        match self {
            Self::Components(_) => samples.to_vec(),
            Self::Displacement | Self::Velocity => (samples.iter().zip(signs.iter().cycle()))
                .map(|(sample, sign)| 10.0 * sign * sample)
                .collect(),
        }
    }
}

/// Several samples a voxel, index order `[z][y][x][component]`; lab frame, centimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field<'a> {
    grid: VoxelGrid,
    samples: &'a [f32],
    of: FieldOf,
}

impl<'a> Field<'a> {
    /// A field from the grid that it was made on.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] unless each voxel has its components; else as [`Volume::new`].
    pub fn new(grid: VoxelGrid, samples: &'a [f32], of: FieldOf) -> Result<Self, PhantomError> {
        let [nx, ny, nz] = grid.shape();
        Samples::from(samples).check("samples of a field", &[nz, ny, nx, of.components()])?;
        Ok(Self { grid, samples, of })
    }

    /// All of one component, as a volume has them.
    fn component(&self, samples: &[f32], k: usize) -> Vec<f32> {
        let step = self.of.components();
        samples.iter().skip(k).step_by(step).copied().collect()
    }
}

/// Writes a field in a format that has several numbers a voxel: npy, npz, NIfTI, MetaImage, NRRD, raw with JSON.
///
/// Arrays of NumPy and raw ones are `[z][y][x][component]` in cm. Formats of a world have vectors along its axes, and in mm: MetaImage
/// (LPS) those of the lab, `ElementNumberOfChannels` of them, fastest; NRRD (LPS) those of the lab on a first axis of kind `vector`, of
/// other numbers `list`; NIfTI (RAS) x and y with the other sign, along its fifth axis, slowest, with the intent `DISPVECT` (1006) of
/// displacements, and `VECTOR` (1007) of all else.
///
/// # Errors
/// [`PhantomError::Unsupported`] for another format; else as [`write_volume`](crate::files::write_volume).
pub fn write_field(path: &Path, field: &Field, format: Format) -> Result<(), PhantomError> {
    let Field { grid, samples, of } = *field;
    check_extension(path, format.volume_extension())?;
    let n = of.components();
    let [nx, ny, nz] = grid.shape();
    let shape = [nz, ny, nx, n];
    // Its place is that of a volume of one component.
    let first = field.component(samples, 0);
    let volume = Volume::new(grid, &first)?;
    let lps = || of.in_world(samples, [1.0; 3]);
    let planes = || -> Vec<f32> {
        let ras = of.in_world(samples, [-1.0, -1.0, 1.0]);
        (0..n).flat_map(|k| field.component(&ras, k)).collect()
    };
    let intent = match of {
        FieldOf::Displacement => nifti::DISPVECT,
        FieldOf::Velocity | FieldOf::Components(_) => nifti::VECTOR,
    };
    let nifti_header = || nifti::field_header(&volume, n, intent);
    match format {
        Format::Npy => npy::write_samples(path, &shape, samples.into()),
        #[cfg(feature = "files")]
        Format::Npz => npz::write_field(path, &volume, &shape, samples.into()),
        Format::Nifti => nifti::write(path, &nifti_header()?, (&planes()).into()),
        #[cfg(feature = "files")]
        Format::NiftiGz => nifti::write_gz(path, &nifti_header()?, (&planes()).into()),
        Format::MetaImage => metaimage::write_mhd(path, &volume, Some((n, &lps()))),
        Format::MetaImageSingle => metaimage::write_mha(path, &volume, Some((n, &lps()))),
        #[cfg(not(feature = "files"))]
        Format::Npz | Format::NiftiGz | Format::RawJson => format.check_built(),
        Format::Nrrd => {
            let vectors = !matches!(of, FieldOf::Components(_));
            nrrd::write_field(path, &volume, (n, &lps()), vectors)
        }
        #[cfg(feature = "files")]
        Format::RawJson => raw_json::write_field(path, &volume, (n, samples)),
        Format::InterfileStir | Format::InterfileSimind | Format::Dicom => {
            let what = "several numbers a voxel here: npy, npz, NIfTI, MetaImage, NRRD and raw with JSON can";
            Err(format.cannot_hold(what))
        }
    }
}

impl Format {
    /// Whether [`write_field`] writes it.
    pub fn holds_fields(self) -> bool {
        match self {
            Self::Npy
            | Self::Npz
            | Self::Nifti
            | Self::NiftiGz
            | Self::MetaImage
            | Self::MetaImageSingle
            | Self::Nrrd
            | Self::RawJson => true,
            Self::InterfileStir | Self::InterfileSimind | Self::Dicom => false,
        }
    }
}
