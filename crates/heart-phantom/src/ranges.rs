//! Allowed values of the numbers of a phantom, from Rust or from a scene.

/// Lengths in cm and times in seconds.
pub(crate) const SIZE: [f64; 2] = [1e-6, 1e6];
/// Full width at half maximum of a filter of volumes, cm.
pub(crate) const FILTER: [f64; 2] = [1e-3, 100.0];
/// Volume gains of the cavity, `(EDV - ESV) / ESV`, and the corresponding ejection fractions.
pub(crate) const GAIN: [f64; 2] = [0.0, 20.0];
pub(crate) const EJECTION_FRACTION: [f64; 2] = [0.0, GAIN[1] / (1.0 + GAIN[1])];
/// Activity per cm^3 or of a region, or none; sums remain within the normal numbers of `f32`.
pub(crate) const ACTIVITY: [f64; 2] = [0.0, 1e12];
pub(crate) const LEAST_ACTIVITY: f64 = 1e-25;
/// Number of defects: each has a label, above those of background, cavity and wall; labels are bytes.
pub(crate) const DEFECTS: [usize; 2] = [0, 252];
/// Number of disjoint pieces of all defects together.
pub(crate) const PIECES: [usize; 2] = [0, 1000];
/// Largest ratio of the standard deviations of a response: rays are as dense as the narrowest needs, over the reach of the widest.
pub(crate) const UNEVEN: f64 = 100.0;
/// Activity of defects, relative to the wall.
pub(crate) const DEFECT_ACTIVITY: [f64; 2] = [0.0, 1e6];
/// Number of reported material points.
pub(crate) const POINTS: [usize; 2] = [0, 10_000];
/// Transmural position from the inner to the outer membrane, and s from base to apex.
pub(crate) const LAYER: [f64; 2] = [0.0, 1.0];
pub(crate) const S: [f64; 2] = [0.0, 0.5];
/// R-R intervals in a list in seconds, their number, and fractions of ectopic beats.
pub(crate) const INTERVALS: [f64; 2] = [0.05, 60.0];
pub(crate) const LIST: [usize; 2] = [1, 1_000_000];
pub(crate) const ECTOPIC: [f64; 2] = [0.0, 0.5];
/// Of scatter: largest standard error relative to the largest sample; energies in keV; energy resolution.
pub(crate) const SCATTER_TOLERANCE: [f64; 2] = [1e-3, 1.0];
pub(crate) const PHOTON_ENERGY: [f64; 2] = [30.0, 600.0];
pub(crate) const ENERGY_RESOLUTION: [f64; 2] = [0.005, 0.5];
/// Linear attenuation coefficients, 1/cm.
pub(crate) const ATTENUATION: [f64; 2] = [0.0, 1e6];
/// Expected counts of a unit sample or of all views.
pub(crate) const COUNTS: [f64; 2] = [1e-12, 1e12];
/// Phases, in cycles.
pub(crate) const PHASE: [f64; 2] = [-1e9, 1e9];
/// Steps per cycle.
pub(crate) const STEPS: [usize; 2] = [2, 4096];
pub(crate) const VIEW_TOLERANCE: [f64; 2] = [1e-6, 1.0];
pub(crate) const GATES: [usize; 2] = [1, 1000];
pub(crate) const TRUTH_TOLERANCE: [f64; 2] = [1e-7, 0.5];
/// Mesh tolerances: finer meshes would have millions of triangles.
pub(crate) const MESH_TOLERANCE: [f64; 2] = [1e-5, 0.1];
