//! Reconstruction methods: plain data of a scene.

/// A reconstruction method.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Method {
    /// Filtered back-projection of each slice; it treats projections as line integrals, so that attenuation is not corrected: behind 10 cm of
    /// water activities are a fifth of the true ones at 140 keV. Voxels whose centres are farther from the axis of rotation
    /// than half a row of bins are zero.
    #[default]
    Fbp,
    /// Ordered-subsets expectation maximisation of all slices together, with a model of the camera.
    Osem(Osem),
}

impl Method {
    /// Returns the parameters of OSEM, if it is OSEM.
    pub(crate) fn osem(&self) -> Option<&Osem> {
        match self {
            Self::Fbp => None,
            Self::Osem(osem) => Some(osem),
        }
    }

    /// Returns the largest number of iterations; 1 for FBP.
    pub(crate) fn iterations(&self) -> usize {
        self.osem().map_or(1, |osem| osem.iterations)
    }
}

/// Ordered-subsets expectation maximisation ([`radon::osem`]; Hudson & Larkin 1994, doi:10.1109/42.363108) with the model
/// [`radon::SpectOperator`].
///
/// Subset k of n contains the views k, k + n, k + 2 n, ...; sizes differ by at most one view. The order of the subsets is bit-reversed
/// (0, 4, 2, 6, 1, 5, 3, 7 for n = 8), so that consecutive subsets have different directions.
///
/// ```
/// use heart_phantom::{Method, Mode, Osem, Phantom, Scene};
/// # fn main() -> Result<(), heart_phantom::PhantomError> {
/// let mut scene = Scene::default().with_size(24).with_mode(Mode::Static { phase: 0.0 });
/// scene.camera.views = 16;
/// scene.reconstruction.method = Method::Osem(Osem { tolerance: Some(0.05), ..Osem::new(4, 20) });
/// let phantom = Phantom::new(scene)?;
/// let volume = phantom.volume(0)?;
/// let sum = |samples: &[f32]| samples.iter().map(|&x| f64::from(x)).sum::<f64>();
/// assert!((sum(&volume) / sum(&phantom.truth(0)?) - 1.0).abs() < 0.02);
/// assert!((2..20).contains(&phantom.work().osem_iterations));
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Osem {
    /// Number of subsets, from 1 (MLEM) to the number of views.
    pub subsets: usize,
    /// Maximum number of iterations through all subsets.
    pub iterations: usize,
    /// Whether to model attenuation, with the map averaged over the acquisition time of the gate.
    #[serde(default)]
    pub attenuation: bool,
    /// Whether to model the collimator at `scene::CameraSettings::radius`; the tolerance is 1e-3 ([`radon::SpectOptions`]).
    #[serde(default)]
    pub resolution: bool,
    /// Whether to model the expected scatter of the projections ([`Phantom::scatter`](crate::Phantom::scatter)): the reference for methods that
    /// estimate scatter.
    #[serde(default)]
    pub scatter: bool,
    /// Stops after an iteration whose relative change of the volume (root mean square) is at most this value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
}

impl Osem {
    /// Maximum of `iterations`.
    pub(crate) const MOST: usize = 10_000;
    /// Range of the tolerance.
    pub(crate) const TOLERANCE: [f64; 2] = [1e-9, 1.0];

    /// Sets subsets and iterations, without models of attenuation, collimator and scatter.
    #[must_use]
    pub fn new(subsets: usize, iterations: usize) -> Self {
        Self {
            subsets,
            iterations,
            attenuation: false,
            resolution: false,
            scatter: false,
            tolerance: None,
        }
    }
}

/// Compensation of the exactly known motion between gates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Compensation {
    /// No compensation: one volume per gate.
    #[default]
    None,
    /// All gates at a reference phase ([`Phantom::compensated`](crate::Phantom::compensated)): the reference for methods that estimate the
    /// motion.
    KnownMotion,
}

/// Convergence of OSEM for a gate or a motion-compensated volume.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct OsemReport {
    /// Iterations through all subsets.
    pub iterations: usize,
    /// Relative change of the volume in the last iteration, root mean square.
    pub change: f64,
    /// Relative root mean square difference between the projections and those modelled from the volume that each subset updated in the last
    /// iteration.
    pub residual: f64,
}
