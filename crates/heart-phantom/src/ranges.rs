//! What the numbers of a phantom may be, whether its parts are put together by hand or by a scene.

/// Lengths in cm, and times in seconds.
pub(crate) const SIZE: [f64; 2] = [1e-6, 1e6];
/// Volume gains of the cavity, `(EDV - ESV) / ESV`, and the ejection fractions that they are.
pub(crate) const GAIN: [f64; 2] = [0.0, 20.0];
pub(crate) const EJECTION_FRACTION: [f64; 2] = [0.0, GAIN[1] / (1.0 + GAIN[1])];
/// Activity per cm^3, or of a region; it keeps sums within `f32`.
pub(crate) const ACTIVITY: [f64; 2] = [0.0, 1e12];
/// Each defect has a label of its own, above those of background, cavity and wall; labels are bytes.
pub(crate) const DEFECTS: [usize; 2] = [0, 252];
/// Pieces without overlap that all defects together are made of.
pub(crate) const PIECES: [usize; 2] = [0, 1000];
/// In units of the wall's.
pub(crate) const DEFECT_ACTIVITY: [f64; 2] = [0.0, 1e6];
/// Material points that a report follows.
pub(crate) const POINTS: [usize; 2] = [0, 10_000];
/// Cm that the base goes down.
pub(crate) const DESCENT: [f64; 2] = [0.0, 10.0];
/// From the inner membrane to the outer one, and from the base to the apex.
pub(crate) const LAYER: [f64; 2] = [0.0, 1.0];
pub(crate) const S: [f64; 2] = [0.0, 0.5];
/// Seconds of a beat in a list of them, how many it has, and shares of ectopic beats.
pub(crate) const INTERVALS: [f64; 2] = [0.05, 60.0];
pub(crate) const LIST: [usize; 2] = [1, 1_000_000];
pub(crate) const ECTOPIC: [f64; 2] = [0.0, 0.5];
/// In 1/cm.
pub(crate) const ATTENUATION: [f64; 2] = [0.0, 1e6];
/// Counts of a sample of 1, or of all views.
pub(crate) const COUNTS: [f64; 2] = [1e-12, 1e12];
/// Steps a cycle.
pub(crate) const STEPS: [usize; 2] = [2, 4096];
pub(crate) const VIEW_TOLERANCE: [f64; 2] = [1e-6, 1.0];
pub(crate) const GATES: [usize; 2] = [1, 1000];
pub(crate) const TRUTH_TOLERANCE: [f64; 2] = [1e-7, 0.5];
/// Finer meshes would have millions of triangles.
pub(crate) const MESH_TOLERANCE: [f64; 2] = [1e-5, 0.1];
