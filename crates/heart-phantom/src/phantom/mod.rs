//! The phantom: lazy evaluation of every product of a scene.

mod along;
pub(crate) mod artefacts;
pub(crate) mod beats;
mod compensated;
mod gates;
pub(crate) mod memory;
mod memory_limit;
pub(crate) mod method;
mod model_voxels;
pub(crate) mod motion;
pub(crate) mod numbers;
mod osem;
mod osem_of_gates;
pub(crate) mod output;
pub(crate) mod phases;
pub(crate) mod polar;
mod prepare;
pub(crate) mod products;
mod reach;
mod resolution;
mod scatter;
mod scatter_model;
mod steps;
mod truncation;
mod unsuitable;
mod views;
mod volumes;
pub(crate) mod warning;
mod warnings;
mod warps;
pub(crate) mod work;

pub(crate) use products::{Content, Index, Needs};
pub(crate) use views::to_counts;

use crate::error::{PhantomError, check_count};
use crate::model::{Placed, bytes_of_defects};
use crate::scan::{Acquisition, Facing, Imaging, Lasting, Projected, STEPS, Scan};
use crate::scene::{Parts, Scene, check};
use crate::{Camera, Cycle, Heart, HeartShape, Regions, TruthOf, WorkReport};
use photon_scatter::Scatter;
use radon::FbpPlan;
use revolve_voxel::Pose;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};
use work::Work;

/// A phantom: the products of a scene, computed on demand.
///
/// [`Phantom::new`] computes nothing. A part (a view, a slice, a phase) costs only its own work and is bitwise identical to the same part of the
/// whole. Shapes are solved once and stored; [`Phantom::work`] counts the work. Results are bitwise identical for any number of threads.
///
/// ```
/// use heart_phantom::{Phantom, Mode, Scene};
/// let scene = Scene::default().with_size(32).with_mode(Mode::Static { phase: 0.5 });
/// let phantom = Phantom::new(scene)?;
/// assert_eq!(phantom.work().shapes_solved, 0);
/// let numbers = phantom.numbers()?; // two shapes, and nothing else
/// assert!((numbers.ejection_fraction - 0.375).abs() < 1e-10);
/// let slice = phantom.slice(0, 16)?; // one row of each view
/// assert_eq!(slice.len(), 32 * 32);
/// let work = phantom.work();
/// assert_eq!((work.shapes_solved, work.rays_cast + work.rays_skipped), (2, 90 * 32));
/// # Ok::<(), heart_phantom::PhantomError>(())
/// ```
#[derive(Debug)]
pub struct Phantom {
    parts: Parts,
    facing: OnceLock<Vec<Facing>>,
    imaging: OnceLock<Option<Imaging>>,
    aliasing: OnceLock<Option<[f64; 3]>>,
    /// Counts per unit sample that the noise defines, by gate.
    counts: Vec<OnceLock<Option<f64>>>,
    /// Scatter, by gate.
    scattered: Vec<OnceLock<Option<Scatter>>>,
    steps: OnceLock<usize>,
    regions: OnceLock<Regions>,
    /// Activity of the organs in all voxels, `[z][y][x]`.
    organ_map: OnceLock<Vec<f32>>,
    /// Attenuation of the organs in the voxels of the OSEM model.
    attenuating_organs: OnceLock<Vec<f32>>,
    /// The defects of shapes that the heart keeps.
    placed: Mutex<Placed>,
    /// The plan used last, with its gate.
    plan: Mutex<Option<(usize, Arc<FbpPlan<f32>>)>>,
    share: Share,
    /// The OSEM model of a gate, if all have the same geometry.
    model: OnceLock<model_voxels::Model>,
    pub(crate) work: Work,
    /// File and text of the scene, for errors after reading.
    pub(crate) file: Option<(PathBuf, String)>,
}

/// The part of the memory that a run may use.
#[derive(Debug, Clone, Copy)]
struct Share {
    /// Number of concurrent runs with equal parts.
    runs: u64,
    /// Bytes of the caller.
    further: u64,
}

impl Phantom {
    /// Validates the scene and builds its objects. Casts no ray and solves no shape, except the largest for the memory of defects.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] for an invalid value or combination of values; [`PhantomError::Membrane`] if the discretised membranes are
    /// not a valid pair.
    pub fn new(scene: Scene) -> Result<Self, PhantomError> {
        Self::of(scene, None)
    }

    /// As [`Phantom::new`], with any two membranes ([`Heart::of_membranes`]) instead of the sections `[heart]` and `[pose]`, which are
    /// ignored. Clones of a heart share solved shapes.
    ///
    /// ```
    /// use heart_phantom::membrane_newton::{Discretisation, Membrane, ReferenceShape};
    /// use heart_phantom::revolve_voxel::Pose;
    /// use heart_phantom::{Heart, Phantom, Scene, VolumeCurve, VolumeRange};
    /// # fn main() -> Result<(), heart_phantom::PhantomError> {
    /// // Two half ellipses, `[x, y]` from (0, b) over the apex (a, 0) to (0, -b), and a beat of five samples.
    /// let ellipse = |a: f64, b: f64| -> Result<Membrane, heart_phantom::PhantomError> {
    ///     let half = |k: i32| std::f64::consts::PI * (0.5 - f64::from(k) / 100.0);
    ///     let points: Vec<_> = (0..=100).map(half).map(|t| [a * t.cos(), b * t.sin()]).collect();
    ///     Ok(Membrane::new(ReferenceShape::polyline(&points)?))
    /// };
    /// let nodes = Discretisation::FiniteDifferences { nodes: 101 };
    /// let membranes = [ellipse(8.0, 2.5)?, ellipse(9.0, 3.5)?];
    /// let heart = Heart::of_membranes([&membranes[0], &membranes[1]], nodes, 0.0, Pose::axis_along_z(4.5)?)?;
    /// let mut scene = Scene::default().with_size(32);
    /// scene.cycle.curve = VolumeCurve::Sampled(vec![120.0, 80.0, 60.0, 90.0, 110.0]);
    /// scene.cycle.volume = VolumeRange::Gains([0.1, 0.5]);
    /// let phantom = Phantom::with_heart(scene, heart)?;
    /// assert!((phantom.numbers()?.gain - 0.5).abs() < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Phantom::new`].
    pub fn with_heart(scene: Scene, heart: Heart) -> Result<Self, PhantomError> {
        Self::of(scene, Some(heart))
    }

    /// Returns the phantom of another scene. It shares the solved shapes if `[heart]`, `[pose]` and the displacement of the base are equal,
    /// and preserves a given heart.
    ///
    /// # Errors
    /// As [`Phantom::new`].
    pub fn with_scene(&self, scene: Scene) -> Result<Self, PhantomError> {
        let (before, heart) = (&self.parts, &self.parts.heart);
        let mut phantom = Self::of(scene, before.own_heart.then(|| heart.clone()))?;
        phantom.share = self.share;
        let parts = &mut phantom.parts;
        if (&parts.scene.heart, parts.scene.pose) == (&before.scene.heart, before.scene.pose) {
            let descent = parts.scene.cycle.av_plane_displacement;
            let defect_bytes = parts.heart.defect_bytes;
            parts.heart =
                (heart.clone()).with_av_plane_displacement(descent, parts.cycle.gains())?;
            parts.heart.defect_bytes = defect_bytes;
        }
        Ok(phantom)
    }

    /// Reads the phantom of a scene file.
    ///
    /// # Errors
    /// As [`Scene::load`] and [`Phantom::new`].
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        let (scene, text) = Scene::read(path)?;
        let mut phantom = Self::new(scene)?;
        phantom.file = Some((path.to_path_buf(), text));
        Ok(phantom)
    }

    fn of(scene: Scene, heart: Option<Heart>) -> Result<Self, PhantomError> {
        let mut parts = check::parts(scene, heart)?;
        // A volume without a shape or without material coordinates is an error later.
        let (defects, is_twisted) = (&parts.scene.defects, parts.scene.twist.is_some());
        let largest = parts.cycle.gains()[1];
        let bytes = bytes_of_defects(&parts.heart, defects, is_twisted, largest);
        parts.heart.defect_bytes = bytes.unwrap_or(0);
        Ok(Self {
            facing: OnceLock::new(),
            imaging: OnceLock::new(),
            aliasing: OnceLock::new(),
            counts: vec![OnceLock::new(); parts.n_gates()],
            scattered: vec![OnceLock::new(); parts.n_gates()],
            steps: OnceLock::new(),
            regions: OnceLock::new(),
            organ_map: OnceLock::new(),
            attenuating_organs: OnceLock::new(),
            placed: Mutex::default(),
            plan: Mutex::new(None),
            share: Share {
                runs: 1,
                further: 0,
            },
            model: OnceLock::new(),
            work: Work::default(),
            file: None,
            parts,
        })
    }

    /// Returns the scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.parts.scene
    }

    /// Returns the scene, unless a given heart replaces two of its sections.
    pub(crate) fn whole_scene(&self) -> Option<&Scene> {
        (!self.parts.own_heart && !self.has_own_rays()).then_some(&self.parts.scene)
    }

    /// Limits the memory of the heart's shapes with their defects in bytes ([`Heart::with_memory`]); results are bitwise identical.
    #[must_use]
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.parts.heart = self.parts.heart.with_memory(bytes);
        self
    }

    /// Limits the memory to that of one of `runs` (at least 1) equal concurrent runs; each needs `further` bytes for arrays of the caller.
    #[must_use]
    pub fn with_memory_share(mut self, runs: usize, further: u64) -> Self {
        let runs = runs.max(1) as u64;
        self.share = Share { runs, further };
        self
    }

    /// Returns the heart, which solves its shapes on demand.
    #[must_use]
    pub fn heart(&self) -> &Heart {
        &self.parts.heart
    }

    /// Returns the camera with its voxel grid.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.parts.camera
    }

    /// Returns the cardiac cycle.
    #[must_use]
    pub fn cycle(&self) -> &Cycle {
        &self.parts.cycle
    }

    /// Returns the number of gated projection sets: cardiac gates (or 1) x respiratory gates (or 1). Set `k G + g` is the cardiac gate g of
    /// G in the respiratory gate k.
    #[must_use]
    pub fn n_gates(&self) -> usize {
        self.counts.len()
    }

    /// Returns the counters of work.
    #[must_use]
    pub fn work(&self) -> WorkReport {
        let heart = &self.parts.heart;
        (self.work).report(heart.shapes_solved(), heart.shapes_alive()[1])
    }

    /// Solves the shapes that the projections of a gate need, at most as many as the heart stores.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn solve(&self, gate: usize) -> Result<(), PhantomError> {
        let (mut gains, most) = (BTreeSet::new(), self.heart().most_shapes());
        self.scan_of(gate)?.collect_gains(&mut gains, most);
        let kept: Vec<f64> = gains.into_iter().map(f64::from_bits).take(most).collect();
        self.heart().shapes(&kept).map(drop)
    }

    /// Returns the time that the voxelised ground truth is averaged over.
    #[must_use]
    pub fn truth_of(&self) -> TruthOf {
        self.acquisition_of(0, STEPS[0])
            .truth_of(self.cycle(), self.camera())
    }

    /// Returns the shape of the heart at a phase.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a phase that is not within -1e9 to 1e9; errors of the solver.
    pub fn shape(&self, phase: f64) -> Result<Arc<HeartShape>, PhantomError> {
        let phase = crate::error::check("phase", phase, crate::ranges::PHASE)?;
        self.shape_at_gain(self.parts.cycle.gain(phase))
    }

    pub(crate) fn acquisition_of(&self, gate: usize, points: usize) -> Acquisition {
        let mode = self.scene().acquisition.mode;
        let responds = self.scene().has_response();
        Acquisition::new(mode, gate, points).behind(responds, self.camera())
    }

    /// Returns the scan of a gate, with the steps that meet the tolerance of the scene.
    pub(crate) fn scan_of(&self, gate: usize) -> Result<Scan<'_>, PhantomError> {
        let scan = self.heart_scan(gate)?;
        let acquisition = self.acquisition_of(gate, self.steps()?);
        Ok(Scan {
            acquisition,
            ..scan
        })
    }

    /// Returns the scan of a gate for quantities of the heart alone, which do not depend on the steps of views.
    pub(crate) fn heart_scan(&self, gate: usize) -> Result<Scan<'_>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        Ok(self.scan(self.acquisition_of(gate, STEPS[0])))
    }

    /// Returns the states of the heart whose average is the ground truth of a gate.
    pub(crate) fn states(&self, gate: usize) -> Result<Vec<Lasting>, PhantomError> {
        self.heart_scan(gate)?.states(self.scene().truth.tolerance)
    }

    /// Returns the scan of an acquisition.
    pub(crate) fn scan(&self, acquisition: Acquisition) -> Scan<'_> {
        Scan {
            heart: &self.parts.heart,
            camera: &self.parts.camera,
            cycle: self.cycle(),
            acquisition,
            activity: self.scene().activity,
            attenuation: self.scene().attenuates(),
            defects: &self.scene().defects,
            placed: &self.placed,
            // It moves nothing but defects.
            twist: (self.scene().twist.as_ref()).filter(|_| !self.scene().defects.is_empty()),
            background: self.scene().background,
            organs: self.parts.organs.as_ref(),
            surroundings: &self.parts.surroundings,
            imaging: None,
            projected: Projected::All,
        }
    }

    /// Returns the pose at a respiratory position: 0 at end-expiration, 1 at end-inspiration.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] for a position outside 0 to 1.
    pub fn pose(&self, breath: f64) -> Result<Pose, PhantomError> {
        let breath = crate::error::check("respiratory position", breath, [0.0, 1.0])?;
        self.parts.cycle.moved(self.parts.heart.pose(), breath)
    }

    pub(crate) fn shape_at_gain(&self, gain: f64) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.parts.heart.shapes(&[gain])?.remove(0))
    }
}
