//! Volumes and vector fields to be written.

use super::names::millimetres;
use crate::error::{PhantomError, check};
use crate::files::samples::{SECONDS_PER_GATE, n_gates};
use crate::files::{BeatCounts, Samples};
use revolve_voxel::VoxelGrid;
use std::borrow::Cow;

/// Samples on a voxel grid, index order `[z][y][x]`; lab frame, centimetres, axes along x, y, z. Gates of a cycle are
/// `[gate][z][y][x]`, components of a field `[z][y][x][component]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume<'a> {
    pub(super) grid: VoxelGrid,
    /// `[z][y][x]`, `[gate][z][y][x]` or `[z][y][x][component]`.
    pub(super) samples: Samples<'a>,
    pub(super) axis: Axis,
    /// The R-R intervals of the acquisition, for headers of gates that record them (DICOM).
    pub beats: Option<BeatCounts>,
    /// The corrections of a reconstructed image; none by default.
    pub corrections: Corrections,
    /// Whether the values are attenuation coefficients, for headers that record it (DICOM).
    pub transmission: bool,
    /// The name of the study, any text: files of one study belong together where the format has studies (DICOM).
    pub study: Option<&'a str>,
}

/// The effects that a reconstructed image is corrected for, for headers that record them (DICOM).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Corrections {
    /// Radioactive decay to the start of the acquisition.
    pub decay: bool,
    /// Attenuation.
    pub attenuation: bool,
    /// Scatter.
    pub scatter: bool,
    /// Motion of the heart or respiration.
    pub motion: bool,
}

/// The axis of the samples besides z, y, x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axis {
    /// None.
    Single,
    /// Gates, slowest; seconds from one to the next.
    Gates(f64),
    /// Components of a voxel, fastest.
    Field(FieldOf),
}

/// Quantity of the components of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldOf {
    /// Displacements along the lab's x, y, z in cm.
    Displacement,
    /// Velocities along the lab's x, y, z in cm/s.
    Velocity,
    /// Any number of components that are not vectors of the lab frame.
    Components(usize),
}

impl FieldOf {
    /// Number of components.
    pub(crate) fn components(self) -> usize {
        match self {
            Self::Displacement | Self::Velocity => 3,
            Self::Components(n) => n,
        }
    }

    /// Whether the components are a vector along the axes of the lab.
    pub(super) fn is_vector(self) -> bool {
        match self {
            Self::Displacement | Self::Velocity => true,
            Self::Components(_) => false,
        }
    }
}

impl<'a> Volume<'a> {
    /// A volume of one sample per voxel.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] unless there is one sample per voxel; [`PhantomError::OutOfRange`] if a sample is not finite, or if
    /// spacing or origin in millimetres do not fit into 32 bits, as some formats store them.
    pub fn new(grid: VoxelGrid, samples: impl Into<Samples<'a>>) -> Result<Self, PhantomError> {
        Self::with_axis(grid, samples.into(), Axis::Single)
    }

    fn with_axis(grid: VoxelGrid, samples: Samples<'a>, axis: Axis) -> Result<Self, PhantomError> {
        let most = f64::from(f32::MAX) / 10.0;
        for a in 0..3 {
            let least = f64::from(f32::MIN_POSITIVE);
            check("voxel spacing", grid.spacing()[a], [least, most])?;
            check("grid origin", grid.origin()[a], [-most, most])?;
        }
        let volume = Self {
            grid,
            samples,
            axis,
            beats: None,
            corrections: Corrections::default(),
            transmission: false,
            study: None,
        };
        samples.check("samples of a volume", &volume.axes())?;
        Ok(volume)
    }

    /// The volumes of all gates of a cycle, `[gate][z][y][x]`, `seconds` from one to the next, for one file.
    ///
    /// ```
    /// use heart_phantom::files::{self, Format, Volume};
    /// use heart_phantom::revolve_voxel::VoxelGrid;
    /// let grid = VoxelGrid::centred([4, 3, 2], [0.1; 3], [0.0; 3])?;
    /// let beat = vec![0.5_f32; 8 * 24];
    /// let volume = Volume::of_gates(grid, &beat, 0.125)?; // 8 gates of a beat of a second
    /// let folder = tempfile::tempdir()?; // or any other
    /// files::write(&folder.path().join("beat.nii"), &volume, Format::Nifti)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Volume::new`], if the number of samples is not a multiple of that of the voxels; [`PhantomError::OutOfRange`] if
    /// `seconds` is not positive.
    pub fn of_gates(
        grid: VoxelGrid,
        samples: impl Into<Samples<'a>>,
        seconds: f64,
    ) -> Result<Self, PhantomError> {
        check("seconds per gate", seconds, SECONDS_PER_GATE)?;
        Self::with_axis(grid, samples.into(), Axis::Gates(seconds))
    }

    /// Several components per voxel, `[z][y][x][component]`: displacements, velocities, strains. For npy, npz, NIfTI, MetaImage, NRRD
    /// and raw with JSON.
    ///
    /// NumPy and raw arrays are `[z][y][x][component]` in cm. Formats with a world frame store vectors along its axes, in mm: MetaImage
    /// (LPS) with `ElementNumberOfChannels`, fastest; NRRD (LPS) on a first axis of kind `vector`, other components `list`; NIfTI (RAS)
    /// with x and y negated along the fifth axis, slowest, with the intent `DISPVECT` (1006) for displacements and `VECTOR` (1007)
    /// otherwise.
    ///
    /// # Errors
    /// [`PhantomError::WrongLength`] unless each voxel has its components; else as [`Volume::new`].
    pub fn of_field(
        grid: VoxelGrid,
        samples: &'a [f32],
        of: FieldOf,
    ) -> Result<Self, PhantomError> {
        Self::with_axis(grid, samples.into(), Axis::Field(of))
    }

    /// Returns the seconds from one gate to the next, for gated volumes.
    pub(super) fn seconds_per_gate(&self) -> Option<f64> {
        match self.axis {
            Axis::Gates(seconds) => Some(seconds),
            Axis::Single | Axis::Field(_) => None,
        }
    }

    /// Returns the quantity of the components of a field.
    pub(super) fn field(&self) -> Option<FieldOf> {
        match self.axis {
            Axis::Field(of) => Some(of),
            Axis::Single | Axis::Gates(_) => None,
        }
    }

    /// Returns the number of gates, or 1.
    pub(super) fn n_gates(&self) -> usize {
        match self.axis {
            Axis::Gates(_) => n_gates(self.samples, self.grid.len()),
            Axis::Single | Axis::Field(_) => 1,
        }
    }

    /// Returns the lengths of the axes from slowest to fastest.
    pub(super) fn axes(&self) -> Vec<usize> {
        let [nx, ny, nz] = self.grid.shape();
        match self.axis {
            Axis::Single => vec![nz, ny, nx],
            Axis::Gates(_) => vec![self.n_gates(), nz, ny, nx],
            Axis::Field(of) => vec![nz, ny, nx, of.components()],
        }
    }

    /// Returns the samples in a world frame in millimetres with the axes of the lab and these signs: vectors change, others do not.
    pub(super) fn in_world(&self, signs: [f32; 3]) -> Cow<'a, [f32]> {
        match (self.samples, self.field()) {
            (Samples::F32(samples), Some(of)) if of.is_vector() => {
                (samples.iter().zip(signs.iter().cycle()))
                    .map(|(sample, sign)| 10.0 * sign * sample)
                    .collect()
            }
            (Samples::F32(samples), _) => samples.into(),
            // A field has samples of 32 bits.
            (Samples::U8(_) | Samples::U16(_), _) => Cow::default(),
        }
    }

    /// Returns the spacing `[x, y, z]` in mm.
    pub(super) fn spacing_mm(&self) -> [f64; 3] {
        self.grid.spacing().map(millimetres)
    }

    /// Returns the centre of the first voxel `[x, y, z]` in mm.
    pub(super) fn origin_mm(&self) -> [f64; 3] {
        self.grid.origin().map(millimetres)
    }
}
