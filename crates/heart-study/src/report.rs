//! The numbers of the study in `report.json`.
//!
//! Lengths in cm, areas in cm^2, volumes in cm^3, times in seconds, activities per cm^3 relative to the wall. A quantity over an empty set of voxels
//! (tiny volumes) is omitted.

use crate::StudyOptions;
use heart_phantom::{ImageQuality, TruthOf};
use serde::Serialize;
use std::path::PathBuf;

/// The whole report.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// The program and its version: [`PROGRAM`](heart_phantom::files::PROGRAM).
    pub program: String,
    /// Options of the run.
    pub settings: StudyOptions,
    /// Edge of a voxel and pitch of a bin in cm.
    pub voxel_cm: f64,
    /// Reference configurations (Table 1, section 3.3).
    pub reference: Reference,
    /// Direct method (section 3.1).
    pub direct: Direct,
    /// Evolving method (section 3.2), the run with a monotone norm.
    pub evolving: Evolving,
    /// The circle of the appendix.
    pub circle: Circle,
    /// The same balloons as rubber, at the volume gain of the study.
    pub rubber: Rubber,
    /// The three acquisitions, ramp filter; their fields are those of the report itself.
    #[serde(flatten)]
    pub ram_lak: Acquisitions,
    /// The same three with the Hann window.
    pub hann: Acquisitions,
    /// Run times.
    pub time: Time,
    /// Largest resident memory of the process so far; 0 if the system does not report it.
    pub peak_memory_bytes: u64,
    /// Files written, relative to the directory.
    pub files: Vec<PathBuf>,
}

/// Reference configurations of both balloons.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Reference {
    /// Endocardium.
    pub inner: ReferenceShape,
    /// Epicardium.
    pub outer: ReferenceShape,
}

/// Length, area and volume of one reference configuration: of the polygon through the nodes, and in closed form.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct ReferenceShape {
    /// Length of the polygon (Eq. 30).
    pub length: f64,
    /// Its area (Eq. 31, signed).
    pub area: f64,
    /// Volume of its revolution (Eq. 34).
    pub volume: f64,
    /// `2 h + pi R`.
    pub length_exact: f64,
    /// `R (2 h + pi R / 2)`.
    pub area_exact: f64,
    /// `pi R^2 (h + 2 R / 3)`.
    pub volume_exact: f64,
}

/// Direct method: the pair of membranes at the volume gain of the study.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Direct {
    /// Force intensity of the inner membrane, stiffness x cm (law 1, lambda = 1), on the mesh of the settings.
    pub f_inner: f64,
    /// Force intensity of the outer membrane, from the constant wall volume.
    pub f_outer: f64,
    /// Newton steps from the reference configuration.
    pub newton_iterations: usize,
    /// Scaled residual of the pair at the solution: the largest force at a node relative to stiffness x reference length, or the largest
    /// relative error of a volume ([`NewtonReport::residual`](heart_phantom::membrane_newton::NewtonReport::residual)).
    pub residual: f64,
    /// Volume within the inner membrane.
    pub v_inner: f64,
    /// Volume within the outer membrane.
    pub v_outer: f64,
    /// Relative change of the wall volume.
    pub wall_volume_error: f64,
    /// The same in the limit of fine meshes, from spectral elements.
    pub limit: Limit,
    /// As the last of `newton_history`, after 60 Newton steps with the printed Jacobian.
    pub printed_jacobian_residual_after_60: f64,
    /// Largest component of the force at a node (stiffness x cm) of the inner membrane alone, 201 nodes at the intensity 17.5, before the
    /// first Newton step and after each, with the correct Jacobian; ends below 1e-8.
    pub newton_history: Vec<f64>,
}

/// Mesh-independent values of the pair.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Limit {
    /// Force intensity of the inner membrane, stiffness x cm.
    pub f_inner: f64,
    /// Force intensity of the outer membrane, stiffness x cm.
    pub f_outer: f64,
    /// Relative change of the wall volume.
    pub wall_volume_error: f64,
}

/// Evolving method.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Evolving {
    /// Length of a step.
    pub dt: f64,
    /// Steps taken until the norm of the forces was at most 1e-4.
    pub steps: usize,
    /// That norm at the end.
    pub residual: f64,
    /// Whether it decreased in every step.
    pub monotone: bool,
    /// Largest distance of a node from its position in the direct method.
    pub distance_to_direct: f64,
    /// Whether the norm decreases in every step with a time step of 0.5.
    pub small_step_monotone: bool,
    /// The distance with springs to the second neighbours, which the direct method does not have.
    pub second_neighbours_distance: f64,
}

/// The circle of the appendix.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Circle {
    /// Numbers of nodes.
    pub nodes: Vec<usize>,
    /// Largest distance of a node from the exact circle, for each number of nodes.
    pub errors: Vec<f64>,
    /// Observed order of convergence, from the two finest meshes.
    pub order: f64,
}

/// The heart of neo-Hookean rubber, 400 kPa and 0.5 mm, compared with springs; in lists springs are first.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Rubber {
    /// Pressure across the inner balloon of rubber, mmHg.
    pub inner_mmhg: f64,
    /// Pressure across the outer balloon of rubber, mmHg.
    pub outer_mmhg: f64,
    /// Relative change of the wall volume.
    pub wall_volume_error: f64,
    /// Thickness of the wall at the middle of the inner cylinder, cm.
    pub side: [f64; 2],
    /// Thickness of the wall at the apex, cm.
    pub apex: [f64; 2],
    /// Root mean square difference of one view, relative to that of springs.
    pub view_difference: f64,
}

/// One acquisition, reconstructed.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Acquisition {
    /// Distinct phases of the views, one shape each (short).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distinct_shapes: Option<usize>,
    /// Phases in the average of a view (long).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature_points: Option<usize>,
    /// Bound on the error of any sample, relative to the largest one (long).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_error: Option<f64>,
    /// Shapes solved for it; mirrored phases and earlier acquisitions share theirs.
    pub shapes_solved: usize,
    /// Rays for which the surface was searched.
    pub rays_cast: u64,
    /// Rays outside the bounds of the body, which were skipped.
    pub rays_skipped: u64,
    /// The kind of average of the ground truth: for instants, over all views.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthOf>,
    /// Image quality; the wall and the cavity are eroded by two voxels, the background is more than three voxels from the body at all phases.
    #[serde(flatten)]
    pub quality: ImageQuality,
}

/// The three acquisitions with one window.
#[derive(Debug, Clone, Default, Serialize)]
#[non_exhaustive]
pub struct Acquisitions {
    /// Static acquisition of the reference configuration.
    pub r#static: Acquisition,
    /// One instant per view.
    pub short: Acquisition,
    /// One cycle per view.
    pub long: Acquisition,
}

/// Seconds spent.
#[derive(Debug, Clone, Copy, Default, Serialize)]
#[non_exhaustive]
pub struct Time {
    /// Membranes: reference configurations, both methods, all phases, the circle.
    pub solve: f64,
    /// Sinograms.
    pub project: f64,
    /// Filtered back-projection.
    pub reconstruct: f64,
    /// Ground truth, image quality, figures, and waiting for files, which are written concurrently.
    pub truth_and_files: f64,
    /// Total.
    pub total: f64,
}

impl Acquisitions {
    /// Returns the acquisitions with their names, in order.
    pub(crate) fn named(&self) -> [(&'static str, &Acquisition); 3] {
        [
            ("static", &self.r#static),
            ("short", &self.short),
            ("long", &self.long),
        ]
    }

    pub(crate) fn each_mut(&mut self) -> [&mut Acquisition; 3] {
        [&mut self.r#static, &mut self.short, &mut self.long]
    }
}
