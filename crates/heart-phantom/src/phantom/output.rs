//! What a run writes: plain data that a scene's file and Rust share.

use crate::files::Format;

/// What a run writes, `[output]` of a scene.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct Output {
    /// Which results.
    pub write: Vec<Product>,
    /// Format of volumes.
    pub volumes: Format,
    /// Format of projections.
    pub projections: Format,
    /// Quantity of the projections that are written.
    pub values: ProjectionValues,
    /// Whether the gates go into files of their own.
    pub gates: GateFiles,
    /// Largest relative error of the volume that a surface encloses.
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

/// Quantity of the projections that are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
pub enum ProjectionValues {
    /// Line integrals of the activity at the start of the acquisition: counts over the counts per unit of each view.
    #[default]
    Normalised,
    /// Poisson counts as a camera writes them, neither normalised nor corrected for decay; needs noise.
    Counts,
}

/// Where the gates of a beat go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
pub enum GateFiles {
    /// Each into a file of its own: `truth-gate-03`.
    #[default]
    Each,
    /// All into one: `truth`, four-dimensional; surfaces and pictures have their own all the same.
    OneFile,
}

/// A result that can be written; `report.json` with the numbers is always there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Product {
    /// The views.
    Projections,
    /// The reconstructed volume.
    Reconstruction,
    /// The exact volume.
    Truth,
    /// Labels at the phases that stand for the views ([`Phantom::phases`](crate::Phantom::phases)): 0 background, 1 cavity,
    /// 2 wall, from 3 on the defects in their order.
    Labels,
    /// Attenuation map at the same phases.
    Attenuation,
    /// Surfaces (STL) at the same phases.
    Meshes,
    /// Displacements, velocities and strains of the wall since end-diastole, at the same phases, on the voxels that it fills at
    /// end-diastole ([`Phantom::motion`](crate::Phantom::motion)).
    Motion,
    /// Pictures of the middle slice; of gates also a moving one.
    Pictures,
}
