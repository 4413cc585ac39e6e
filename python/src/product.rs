//! A phantom, and the computation of its products: progress, warnings, reconstruction.

use crate::arrays::array;
use crate::errors::Failure;
use crate::values::Whole;
use crate::work::{Progress, Watch, work};
use heart_phantom::{Method, MotionPhase, Phantom, PhantomError, Scene, no_observer};
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(crate) type Floats<'py> = Result<Bound<'py, PyArrayDyn<f32>>, Failure>;

/// A beating-heart phantom with its camera. Products are computed on demand and shapes are stored.
///
/// Arrays are C-contiguous `float32` unless stated otherwise: views `[view][row][bin]`, volumes `[z][y][x]`; row j of a view and slice j of
/// a volume have the same height. Lengths in cm, angles in radians, activities in 1/mL, views in activity times cm. Results are bitwise
/// identical for any number of threads.
///
/// Parameters
/// ----------
/// scene : Scene or dict, optional
///     By default the study of Rohmer et al. 2006. It is validated; nothing is computed.
/// memory : int, optional
///     Limit of the memory of solved shapes in bytes; results are bitwise identical.
///
/// Raises
/// ------
/// SceneError
///     If the scene is invalid.
///
/// Examples
/// --------
/// >>> from heart_phantom import Phantom, Scene
/// >>> phantom = Phantom(Scene().with_size(32).replace(acquisition={"mode": {"static": {"phase": 0.5}}}))
/// >>> round(phantom.numbers()["ejection_fraction"], 6)
/// 0.375
/// >>> phantom.views().shape, phantom.truth().shape
/// ((90, 32, 32), (32, 32, 32))
#[pyclass(name = "Phantom", module = "heart_phantom", frozen)]
#[derive(Debug)]
pub(crate) struct PyPhantom {
    pub(crate) phantom: Arc<Phantom>,
    /// Whether the warnings of the scene have been issued.
    pub(crate) warned: AtomicBool,
}

impl From<Phantom> for PyPhantom {
    fn from(phantom: Phantom) -> Self {
        Self {
            phantom: Arc::new(phantom),
            warned: AtomicBool::new(false),
        }
    }
}

impl PyPhantom {
    /// The shape of a volume.
    pub(crate) fn volume_shape(&self) -> [usize; 3] {
        let [nx, ny, nz] = self.phantom.camera().grid().shape();
        [nz, ny, nx]
    }

    pub(crate) fn views_shape(&self) -> [usize; 3] {
        let camera = self.phantom.camera();
        [camera.n_views(), camera.n_rows(), camera.n_bins()]
    }

    /// The array that a call computes.
    pub(crate) fn floats<'py>(
        &self,
        py: Python<'py>,
        progress: Progress<'_, 'py>,
        shape: &[usize],
        make: impl FnOnce(&Phantom, &Watch) -> Result<Vec<f32>, PhantomError> + Send + 'static,
    ) -> Floats<'py> {
        let phantom = self.phantom.clone();
        let made = work(py, progress, move |watch| make(&phantom, watch))?;
        self.warn(py)?;
        array(py, made, shape)
    }

    /// Issues the warnings of the scene, once.
    pub(crate) fn warn(&self, py: Python<'_>) -> Result<(), Failure> {
        if self.warned.swap(true, Ordering::Relaxed) {
            return Ok(());
        }
        let warnings = match self.warnings(py) {
            // That of the products.
            Err(Failure::Phantom(_)) => Vec::new(),
            found => found?,
        };
        let class = py.import("heart_phantom.errors")?.getattr("SceneWarning")?;
        for text in warnings {
            (py.import("warnings")?).call_method1("warn", (text, &class))?;
        }
        Ok(())
    }

    /// Any other result.
    pub(crate) fn made<T: Send + 'static>(
        &self,
        py: Python<'_>,
        progress: Progress<'_, '_>,
        make: impl FnOnce(&Phantom) -> Result<T, PhantomError> + Send + 'static,
    ) -> Result<T, Failure> {
        let phantom = self.phantom.clone();
        work(py, progress, move |_| make(&phantom))
    }

    /// Cardiac phase and respiratory position; the latter requires respiration.
    pub(crate) fn moment(&self, phase: f64, breath: f64) -> Result<MotionPhase, Failure> {
        if breath != 0.0 && self.phantom.scene().breathing.is_none() {
            let text = format!("breath is {breath}, and this scene has no respiration");
            return Err(PyValueError::new_err(text).into());
        }
        Ok(MotionPhase {
            phase,
            breath,
            ..MotionPhase::default()
        })
    }

    pub(crate) fn of(py: Python<'_>, scene: Scene, memory: Option<Whole>) -> Result<Self, Failure> {
        let made = work(py, None, move |_| Phantom::new(scene))?;
        Ok(Self::from(match memory {
            None => made,
            Some(Whole(bytes)) => made.with_memory(bytes),
        }))
    }
}

/// Projects and reconstructs a gate.
pub(crate) fn volume(
    phantom: &Phantom,
    gate: usize,
    watch: &Watch,
) -> Result<Vec<f32>, PhantomError> {
    let part = simd_set::part(0..1, 2);
    let views = phantom.sinograms(gate, &no_observer)?.samples;
    drop(part);
    let _part = simd_set::part(1..2, 2);
    let told = |fraction: f64| watch.tell(0.5 + 0.5 * fraction);
    reconstructed(phantom, gate, &views, told, watch)
}

/// Reconstructs views; `told` receives the completed fraction of the iterations of OSEM, the units of work count that of FBP.
pub(crate) fn reconstructed(
    phantom: &Phantom,
    gate: usize,
    views: &[f32],
    told: impl Fn(f64) -> ControlFlow<()> + Sync,
    watch: &Watch,
) -> Result<Vec<f32>, PhantomError> {
    let method = &phantom.scene().reconstruction.method;
    let done = |iterations: usize| match method {
        Method::Osem(osem) => told(iterations as f64 / osem.iterations as f64),
        _ => watch.poll(),
    };
    let mut volume = vec![0.0; phantom.camera().grid().len()];
    phantom.reconstruct_into(gate, views, &mut volume, &done)?;
    Ok(volume)
}
