//! All gates of a volume, reduced for embedding in a page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use heart_phantom::files::{Volume, nifti_bytes};
use heart_phantom::revolve_voxel::VoxelGrid;
use heart_phantom::{Phantom, PhantomError};
use std::io::Write;

/// Largest number of samples of all gates, one byte each: two such volumes in base64 are about 16 MB of the 25 MB of a page.
const MOST: usize = 6_000_000;

/// Bytes per sample while it is collected in a growing list, and as bytes, NIfTI, archive, text and page.
const BYTES_EACH: usize = 16;

/// The gates so far.
#[derive(Debug)]
pub(super) struct Beat {
    grid: VoxelGrid,
    /// Voxels averaged along each axis, at most all of them.
    pub(super) factor: usize,
    factors: [usize; 3],
    /// Numbers of averages along x, y, z; voxels that remain at the end are omitted.
    shape: [usize; 3],
    gates: usize,
    seconds: f64,
    /// `[gate][z][y][x]` of the coarser voxels.
    pub(super) samples: Vec<f32>,
}

impl Beat {
    /// No gates yet, with the finest voxels of which the page contains all gates.
    pub(super) fn new(phantom: &Phantom) -> Self {
        let fits = |beat: &Self| beat.len() <= MOST;
        let mut beats = (1..).map(|factor| Self::with_factor(phantom, factor));
        (beats.find(fits)).unwrap_or_else(|| Self::with_factor(phantom, 1))
    }

    /// As [`Beat::new`], with averages over this number of voxels along each axis.
    pub(super) fn with_factor(phantom: &Phantom, factor: usize) -> Self {
        let grid = *phantom.camera().grid();
        let (factors, n_gates) = (grid.shape().map(|n| factor.min(n)), phantom.n_gates());
        Self {
            grid,
            factor,
            factors,
            shape: [0, 1, 2].map(|a| grid.shape()[a] / factors[a]),
            gates: n_gates,
            seconds: phantom.cycle().period() / n_gates as f64,
            samples: Vec::new(),
        }
    }

    /// Number of samples of all gates.
    fn len(&self) -> usize {
        self.shape.iter().product::<usize>() * self.gates
    }

    /// Returns the largest memory of a volume of all gates.
    pub(super) fn bytes(&self) -> usize {
        BYTES_EACH * self.len()
    }

    /// Adds the next gate, `[z][y][x]`.
    pub(super) fn push(&mut self, volume: &[f32]) {
        let [nx, ny, _] = self.grid.shape();
        let ([mx, my, mz], [fx, fy, fz]) = (self.shape, self.factors);
        let scale = 1.0 / (fx * fy * fz) as f32;
        for z in 0..mz {
            for y in 0..my {
                for x in 0..mx {
                    let mut sum = 0.0;
                    for k in z * fz..(z + 1) * fz {
                        for j in y * fy..(y + 1) * fy {
                            let from = (k * ny + j) * nx + x * fx;
                            sum += volume[from..from + fx].iter().sum::<f32>();
                        }
                    }
                    self.samples.push(sum * scale);
                }
            }
        }
    }

    /// Returns a compressed NIfTI of bytes from 0 to white of the window, in base64. Negative samples become 0.
    pub(super) fn base64(&self, window: [f64; 2]) -> Result<String, PhantomError> {
        let (shape, spacing) = (self.shape, self.grid.spacing());
        // The page contains no negative samples.
        let step = window[1] / 255.0;
        let of = |v: &f32| (f64::from(*v) / step).round() as u8;
        let bytes: Vec<u8> = self.samples.iter().map(of).collect();
        let factors = self.factors.map(|n| n as f64);
        let coarse = [0, 1, 2].map(|a| spacing[a] * factors[a]);
        // The first voxel of the page is the average from the first voxel on.
        let centre = [0, 1, 2].map(|a| {
            let first = self.grid.origin()[a] + 0.5 * (factors[a] - 1.0) * spacing[a];
            first + 0.5 * (shape[a] as f64 - 1.0) * coarse[a]
        });
        let grid = VoxelGrid::centred(shape, coarse, centre).map_err(PhantomError::from)?;
        let volume = Volume::of_gates(grid, bytes.as_slice(), self.seconds)?;
        let nifti = nifti_bytes(&volume, step)?;
        let mut out = GzEncoder::new(Vec::new(), Compression::default());
        let packed = out.write_all(&nifti).and_then(|()| out.finish());
        let packed = packed.map_err(|source| PhantomError::File {
            path: "index.html".into(),
            source,
        })?;
        Ok(STANDARD.encode(packed))
    }
}
