//! Output of a run: plain data of a scene.

use crate::files::Format;

/// The output of a run, `[output]` of a scene.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Products to write.
    pub write: Vec<Product>,
    /// Format of volumes.
    pub volumes: Format,
    /// Format of projections.
    pub projections: Format,
    /// Quantity of written projections.
    pub values: ProjectionValues,
    /// Whether each gate is written to its own file.
    pub gates: GateFiles,
    /// Largest relative error of the volume enclosed by a surface.
    pub mesh_tolerance: f64,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            write: vec![
                Product::Projections,
                Product::Reconstruction,
                Product::Truth,
            ],
            volumes: Format::Npy,
            projections: Format::Npy,
            values: ProjectionValues::Normalised,
            gates: GateFiles::Each,
            mesh_tolerance: 1e-3,
        }
    }
}

/// Quantity of written projections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProjectionValues {
    /// Line integrals of the activity at the start of the acquisition: counts divided by the counts per unit sample of each view.
    #[default]
    Normalised,
    /// Poisson counts as a camera records them, without normalisation and decay correction; needs noise.
    Counts,
}

/// Distribution of gates to files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GateFiles {
    /// One file per gate: `truth-gate-03`.
    #[default]
    Each,
    /// One four-dimensional file for all cardiac gates: `reconstruction`, or `reconstruction-respiratory-gate-00` for each respiratory
    /// gate. Surfaces, images and fields of motion always have one file per gate.
    OneFile,
}

/// A product of a run. `report.json` is always written.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Product {
    /// Projections.
    Projections,
    /// Expected samples of the scattered photons.
    Scatter,
    /// Reconstructed volumes.
    Reconstruction,
    /// Voxelised ground truth.
    Truth,
    /// Labels at the phases that represent the projections ([`Phantom::phases`](crate::Phantom::phases)): 0 background, 1 cavity, 2 wall,
    /// from 3 the defects in their order.
    Labels,
    /// Attenuation maps at these phases.
    Attenuation,
    /// Surfaces (STL) at these phases.
    Meshes,
    /// Displacement, velocity and strain of the wall since end-diastole at these phases, on the voxels of the wall at end-diastole
    /// ([`Phantom::motion`](crate::Phantom::motion)).
    Motion,
    /// Images of the middle slice; for several gates also an animation.
    Pictures,
}
