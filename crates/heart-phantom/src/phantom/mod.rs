//! A phantom: everything on demand, and nothing twice.

mod artefacts;
mod beats;
mod compensated;
mod gates;
mod memory;
mod method;
mod model_voxels;
mod motion;
mod numbers;
mod osem;
mod osem_of_gates;
mod output;
mod phases;
mod polar;
mod prepare;
mod products;
mod reach;
mod resolution;
mod steps;
mod views;
mod volumes;
mod warning;
mod warnings;
mod warps;
mod work;

pub use artefacts::Artefacts;
pub use beats::BeatReport;
pub use memory::Memory;
pub use method::{Compensation, Method, Osem, OsemReport};
pub(crate) use model_voxels::farthest;
pub use motion::{MotionField, MotionReport, PointMotion};
pub use numbers::{Numbers, Thickness};
pub use output::{GateFiles, Output, Product, ProjectionValues};
pub use phases::{Moment, PhaseOf, PhaseReport, ScenePhase};
pub use polar::PolarMap;
pub use products::PlannedFile;
#[cfg(feature = "scene")]
pub(crate) use products::{Content, Index, Needs};
pub use resolution::Resolution;
pub use warning::{Edge, Seen, Warning};
use work::Work;
pub use work::WorkReport;

use crate::error::{PhantomError, check_count};
use crate::scan::{Acquisition, Depth, Facing, Readout, STEPS, Scan};
use crate::scene::{Parts, Scene, check};
use crate::{Camera, Cycle, Heart, HeartShape, Regions, TruthOf};
use radon::{FbpPlan, Skip};
use revolve_voxel::Pose;
#[cfg(feature = "scene")]
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

/// A phantom: what a scene describes, computed when it is asked for.
///
/// [`Phantom::new`] computes nothing. Every part (a view, a slice, a phase) does its own work only and has the
/// bits that it has in the whole; shapes are solved once and kept; [`Phantom::work`] tells what has been done. Results have the same
/// bits for any number of threads.
///
/// ```
/// use heart_phantom::{Phantom, scene::{Mode, Scene}};
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
    /// The cycle, each of its respiratory gates by itself.
    cycles: Vec<Cycle>,
    pub(crate) readout: Readout,
    facing: OnceLock<Vec<Facing>>,
    depth: OnceLock<Option<Depth>>,
    /// Mean counts of a sample of 1, by gate.
    counts: Vec<OnceLock<f64>>,
    pub(crate) steps: OnceLock<usize>,
    regions: OnceLock<Regions>,
    /// The plan that was used last, with its gate.
    plan: Mutex<Option<(usize, Arc<FbpPlan<f32>>)>>,
    pub(crate) work: Work,
    /// The file of the scene and its text, for errors that are found after it was read.
    #[cfg(feature = "scene")]
    pub(crate) file: Option<(PathBuf, String)>,
}

impl Phantom {
    /// Validates the scene and builds the objects that it describes. Solves no shape, casts no ray.
    ///
    /// # Errors
    /// [`PhantomError::Scene`] for a value or a combination of values that is not allowed; [`PhantomError::Membrane`] if the discretised
    /// balloons make no pair.
    pub fn new(scene: Scene) -> Result<Self, PhantomError> {
        Self::of(scene, None)
    }

    /// The same with any two membranes ([`Heart::of_membranes`]) in the place of the sections `[heart]` and `[pose]`, which are not read.
    /// Clones of a heart share the shapes that are solved.
    ///
    /// ```
    /// use heart_phantom::membrane_newton::{Discretisation, Membrane, RestShape};
    /// use heart_phantom::revolve_voxel::Pose;
    /// use heart_phantom::{Heart, Phantom, Scene, VolumeCurve, VolumeRange};
    /// # fn main() -> Result<(), heart_phantom::PhantomError> {
    /// // Two half ellipses, `[x, y]` from (0, b) over the apex (a, 0) to (0, -b), and a beat of five samples.
    /// let ellipse = |a: f64, b: f64| -> Result<Membrane, heart_phantom::PhantomError> {
    ///     let half = |k: i32| std::f64::consts::PI * (0.5 - f64::from(k) / 100.0);
    ///     let points: Vec<_> = (0..=100).map(half).map(|t| [a * t.cos(), b * t.sin()]).collect();
    ///     Ok(Membrane::new(RestShape::polyline(&points)?))
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

    /// The phantom of another scene. It shares the shapes of this one that are solved where `[heart]`, `[pose]` and the descent of the
    /// base are equal; a heart of one's own stays.
    ///
    /// # Errors
    /// As [`Phantom::new`].
    pub fn with_scene(&self, scene: Scene) -> Result<Self, PhantomError> {
        let (before, heart) = (&self.parts, &self.parts.heart);
        let mut phantom = Self::of(scene, before.own_heart.then(|| heart.clone()))?;
        let parts = &mut phantom.parts;
        if (&parts.scene.heart, parts.scene.pose) == (&before.scene.heart, before.scene.pose) {
            let descent = parts.scene.cycle.base_descent;
            parts.heart = (heart.clone()).with_base_descent(descent, parts.cycle.gains())?;
        }
        Ok(phantom)
    }

    /// The phantom of a scene file.
    ///
    /// # Errors
    /// As [`Scene::load`] and [`Phantom::new`].
    #[cfg(feature = "scene")]
    #[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        let (scene, text) = Scene::read(path)?;
        let mut phantom = Self::new(scene)?;
        phantom.file = Some((path.to_path_buf(), text));
        Ok(phantom)
    }

    fn of(scene: Scene, heart: Option<Heart>) -> Result<Self, PhantomError> {
        let parts = check::parts(scene, heart)?;
        let camera = &parts.camera;
        let size = [camera.n_bins(), camera.n_rows()];
        Ok(Self {
            readout: Readout {
                noise: parts.scene.noise,
                size,
            },
            facing: OnceLock::new(),
            depth: OnceLock::new(),
            counts: vec![OnceLock::new(); parts.n_gates()],
            cycles: parts.cycles(),
            steps: OnceLock::new(),
            regions: OnceLock::new(),
            plan: Mutex::new(None),
            work: Work::default(),
            #[cfg(feature = "scene")]
            file: None,
            parts,
        })
    }

    pub(crate) fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The scene that describes it.
    pub fn scene(&self) -> &Scene {
        &self.parts.scene
    }

    /// The scene, unless a heart of one's own took the place of two of its sections.
    #[cfg(feature = "scene")]
    pub(crate) fn whole_scene(&self) -> Option<&Scene> {
        (!self.parts.own_heart).then_some(&self.parts.scene)
    }

    /// The same with work on empty slices done or not; it changes no bit of any result.
    pub fn with_skip(mut self, skip: Skip) -> Self {
        self.parts.reconstruction = self.parts.reconstruction.with_skip(skip);
        self.plan = Mutex::new(None);
        self
    }

    /// The same with another bound, in bytes, on the memory of the heart's shapes ([`Heart::with_memory`]); it changes no bit of any
    /// result.
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.parts.heart = self.parts.heart.with_memory(bytes);
        self
    }

    /// The heart, whose shapes are solved when asked for.
    pub fn heart(&self) -> &Heart {
        &self.parts.heart
    }

    /// The camera and the voxels.
    pub fn camera(&self) -> &Camera {
        &self.parts.camera
    }

    /// The beat.
    pub fn cycle(&self) -> &Cycle {
        &self.parts.cycle
    }

    /// Number of sets of views: the cardiac gates or 1, times the respiratory gates or 1. Set `k G + g` is the cardiac gate g of G in the
    /// respiratory gate k.
    pub fn n_gates(&self) -> usize {
        self.counts.len()
    }

    /// What has been done so far.
    pub fn work(&self) -> WorkReport {
        let heart = &self.parts.heart;
        (self.work).report(heart.shapes_solved(), heart.most_shapes_alive())
    }

    /// Solves the shapes that the views of a gate need, no more than the heart keeps.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn solve(&self, gate: usize) -> Result<(), PhantomError> {
        let times = self
            .scan(self.camera(), gate, self.acquisition(gate)?)
            .times()?;
        let gains = times.iter().map(|lasting| lasting.gain);
        let kept: Vec<f64> = gains.take(self.heart().most_shapes()).collect();
        self.heart().shapes(&kept).map(drop)
    }

    /// What the views of a gate are averages over, with the steps that meet the tolerance of the scene.
    pub(crate) fn acquisition(&self, gate: usize) -> Result<Acquisition, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        Ok(self.acquisition_of(gate, self.steps()?))
    }

    /// What the exact volumes are the mean over.
    pub fn truth_of(&self) -> TruthOf {
        self.acquisition_of(0, STEPS[0])
            .truth_of(self.cycle_of(0), &self.parts.camera)
    }

    /// The heart at a phase.
    ///
    /// # Errors
    /// What solving the shape can return.
    pub fn shape(&self, phase: f64) -> Result<Arc<HeartShape>, PhantomError> {
        self.shape_at_gain(self.parts.cycle.gain(phase))
    }

    /// Activity per mL of cavity and wall at a phase.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn concentrations(&self, phase: f64) -> Result<[f64; 2], PhantomError> {
        Ok(self.scene().activity.of(&*self.shape(phase)?))
    }

    /// A phase of end-systole and one of end-diastole.
    pub fn extreme_phases(&self) -> [f64; 2] {
        self.parts.cycle.extreme_phases()
    }

    pub(crate) fn acquisition_of(&self, gate: usize, points: usize) -> Acquisition {
        let mode = self.scene().acquisition.mode;
        Acquisition {
            mode,
            gate: gate % mode.n_gates(),
            points,
        }
    }

    /// The cycle with the respiratory gate that a set of views is of.
    pub(crate) fn cycle_of(&self, gate: usize) -> &Cycle {
        &self.cycles[gate / self.scene().acquisition.mode.n_gates()]
    }

    /// What a set of views is, or with another time.
    pub(crate) fn scan<'a>(
        &'a self,
        camera: &'a Camera,
        gate: usize,
        acquisition: Acquisition,
    ) -> Scan<'a> {
        Scan {
            heart: &self.parts.heart,
            camera,
            cycle: self.cycle_of(gate),
            acquisition,
            activity: self.scene().activity,
            attenuation: self.parts.attenuation,
            defects: &self.scene().defects,
            twist: self.parts.twist.as_ref(),
            background: self.scene().background,
            organs: self.parts.organs.as_ref(),
            // Far below what any detector resolves.
            tolerance: 1e-5 * self.parts.heart.length(),
            depth: None,
        }
    }

    /// Looks at the heart at a moment, whatever views see.
    pub(crate) fn at_moment<T>(
        &self,
        moment: Moment,
        look: impl FnOnce(&Scan<'_>) -> Result<T, PhantomError>,
    ) -> Result<T, PhantomError> {
        let heart = self.parts.heart.standing(self.pose(moment.breath)?);
        let cycle = self.parts.cycle.clone().without_breathing();
        look(&Scan {
            heart: &heart,
            cycle: &cycle,
            ..self.scan(&self.parts.camera, 0, Acquisition::still(moment.phase))
        })
    }

    /// Where the heart stands when the breath has come so far: 0 at end-expiration, 1 at end-inspiration.
    ///
    /// # Errors
    /// [`PhantomError::Solid`] for a number that is not finite.
    pub fn pose(&self, breath: f64) -> Result<Pose, PhantomError> {
        self.parts.cycle.moved(self.parts.heart.pose(), breath)
    }

    pub(crate) fn shape_at_gain(&self, gain: f64) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.parts.heart.shapes(&[gain])?.remove(0))
    }
}

/// What was made before, or is now.
fn once<T>(
    made: &OnceLock<T>,
    make: impl FnOnce() -> Result<T, PhantomError>,
) -> Result<&T, PhantomError> {
    if let Some(known) = made.get() {
        return Ok(known);
    }
    let new = make()?;
    // Another thread may have been first, with the same.
    Ok(made.get_or_init(|| new))
}
