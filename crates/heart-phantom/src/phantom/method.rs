//! How volumes are made from views: plain data that a scene's file and Rust share.

/// How volumes are made from views.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Method {
    /// Filtered back-projection, slice by slice, of the views: it takes them
    /// for line integrals.
    #[default]
    Fbp,
    /// Expectation maximisation with ordered subsets, of all slices at once, which models what the camera does.
    Osem(Osem),
}

/// Expectation maximisation with ordered subsets ([`radon::osem`]; Hudson & Larkin 1994, doi:10.1109/42.363108) of views that
/// [`radon::SpectOperator`] models.
///
/// Subsets are interleaved views: number k of n has views k, k + n, k + 2 n ..., so that of n that do not divide the number of views some
/// have one view more. They take turns in the order of their numbers' bits reversed (0, 4, 2, 6, 1, 5, 3, 7), so that one looks from where
/// those before it did not.
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
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Osem {
    /// Parts of the views, from 1 (MLEM) to as many as there are views.
    pub subsets: usize,
    /// Most passes through all of them.
    pub iterations: usize,
    /// Whether it models attenuation: by the mean of the map over the time that the views of the gate see.
    #[cfg_attr(feature = "scene", serde(default))]
    pub attenuation: bool,
    /// Whether it models the collimator, `scene::CameraSettings::radius` from the axis; the tolerance of that is 1e-3 ([`radon::SpectOptions`]).
    #[cfg_attr(feature = "scene", serde(default))]
    pub resolution: bool,
    /// It ends earlier after a pass that changed the volume by no more than this share of it (root mean squares).
    #[cfg_attr(
        feature = "scene",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    pub tolerance: Option<f64>,
}

impl Osem {
    /// Most passes.
    pub(crate) const MOST: usize = 10_000;
    /// Range of the tolerance.
    pub(crate) const TOLERANCE: [f64; 2] = [1e-9, 1.0];

    /// So many passes through so many subsets, of views that are taken for line integrals.
    pub fn new(subsets: usize, iterations: usize) -> Self {
        Self {
            subsets,
            iterations,
            attenuation: false,
            resolution: false,
            tolerance: None,
        }
    }
}

/// Of what volumes are made, where the heart moves from one set of views to the next: its exact motion is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Compensation {
    /// Each set of views as it was seen, a volume of each.
    #[default]
    None,
    /// All sets in one frame, the motion taken back ([`Phantom::compensated`](crate::Phantom::compensated)): what methods that have to find the
    /// motion are measured against.
    KnownMotion,
}

/// What OSEM did for a gate, or for all of them in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct OsemReport {
    /// Passes through all subsets.
    pub iterations: usize,
    /// Root mean square by which the last one changed the volume, over that of the volume.
    pub change: f64,
    /// Root mean square difference of views and what their model makes of the volume that each subset found in the last pass, over
    /// that of the views.
    pub residual: f64,
}
