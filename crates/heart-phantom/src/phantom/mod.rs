//! A phantom: everything on demand, and nothing twice.

mod artefacts;
mod beats;
mod bins;
mod compensated;
#[cfg(feature = "scene")]
mod from_scene;
mod gates;
mod memory;
mod method;
mod motion;
mod numbers;
mod osem;
mod osem_of_gates;
mod output;
mod parts;
mod phases;
mod prepare;
mod products;
mod reach;
mod steps;
mod views;
mod volumes;
mod warning;
mod warnings;
mod warps;
mod work;

pub use artefacts::Artefacts;
pub use beats::BeatReport;
pub use bins::BinMeans;
pub use memory::Memory;
pub use method::{Compensation, Method, Osem, OsemReport};
pub use motion::{MotionField, MotionReport, PointMotion};
pub use numbers::{Numbers, Thickness};
pub use output::{GateFiles, Output, Product};
pub use parts::PhantomParts;
#[cfg(feature = "scene")]
pub(crate) use parts::WORK_BYTES;
pub use phases::{Moment, PhaseOf, PhaseReport, ScenePhase};
pub(crate) use products::Needs;
pub use products::PlannedFile;
#[cfg(feature = "scene")]
pub(crate) use products::{Content, Index};
pub use warning::{Edge, Seen, Warning};
use work::Work;
pub use work::WorkReport;

use crate::error::{PhantomError, check_count};
use crate::scan::{Depth, Facing, Readout, STEPS, Scan, Wide};
#[cfg(feature = "scene")]
use crate::scene::{Scene, Source};
use crate::{Acquisition, Camera, Cycle, Heart, HeartShape, Regions, TruthOf};
use radon::{Blur, FbpPlan, Skip};
use revolve_voxel::Pose;
use std::sync::{Arc, Mutex, OnceLock};

/// A phantom: what its [parts](PhantomParts) or a scene describe, computed when it is asked for.
///
/// [`Phantom::from_parts`] and `Phantom::new`, of a scene, compute nothing. Every part (a view, a slice, a phase) does its own work only and has the
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
    parts: PhantomParts,
    /// The cycle, each of its respiratory gates by itself.
    cycles: Vec<Cycle>,
    pub(crate) readout: Readout,
    pub(crate) wide: OnceLock<Option<Wide>>,
    /// The lattice of the means over bins, and its number.
    bins: OnceLock<(BinMeans, usize)>,
    facing: OnceLock<Vec<Facing>>,
    depth: OnceLock<Option<Depth>>,
    /// Mean counts of a sample of 1, by gate.
    counts: Vec<OnceLock<f64>>,
    pub(crate) steps: OnceLock<usize>,
    regions: OnceLock<Regions>,
    /// The plan that was used last, with its gate.
    plan: Mutex<Option<(usize, Arc<FbpPlan<f32>>)>>,
    pub(crate) work: Work,
    #[cfg(feature = "scene")]
    pub(crate) source: Option<Source>,
}

impl Phantom {
    /// Checks the parts and makes ready; no shape is solved, no ray cast.
    ///
    /// # Errors
    /// [`PhantomError::OutOfRange`] or [`PhantomError::Count`] for a number without sense; [`PhantomError::Odd`] for an odd number of
    /// steps, unless views are instants, which need none; [`PhantomError::Unseen`] for a gate that does not come in the time of a view;
    /// [`PhantomError::Radon`] for a blur wider than the detector; [`PhantomError::Absent`] or [`PhantomError::Unsupported`] for an
    /// output that there is not, [`PhantomError::NotBuilt`] for one of the feature `files` in a build without it.
    pub fn from_parts(parts: PhantomParts) -> Result<Self, PhantomError> {
        parts.check()?;
        let camera = &parts.camera;
        let size = [camera.n_bins(), camera.n_rows()];
        let blur = |fwhm| Blur::new(size, camera.detector().pitch(), fwhm);
        Ok(Self {
            readout: Readout {
                blur: parts.blur.map(blur).transpose()?,
                noise: parts.noise,
                size,
            },
            wide: OnceLock::new(),
            bins: OnceLock::new(),
            facing: OnceLock::new(),
            depth: OnceLock::new(),
            counts: vec![OnceLock::new(); parts.n_gates()],
            cycles: parts.cycles(),
            steps: OnceLock::new(),
            regions: OnceLock::new(),
            plan: Mutex::new(None),
            work: Work::default(),
            #[cfg(feature = "scene")]
            source: None,
            parts,
        })
    }

    /// What it is made of.
    pub fn parts(&self) -> &PhantomParts {
        &self.parts
    }

    /// The scene that it was made from, if it was.
    #[cfg(feature = "scene")]
    #[cfg_attr(docsrs, doc(cfg(feature = "scene")))]
    pub fn scene(&self) -> Option<&Scene> {
        self.source.as_ref().map(|source| &source.scene)
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

    /// The time that the views of a gate see, with the steps that meet the scene's tolerance.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::Quadrature`] if no number of steps suffices.
    pub fn acquisition(&self, gate: usize) -> Result<Acquisition, PhantomError> {
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
        Ok(self.parts.activity.of(&*self.shape(phase)?))
    }

    /// A phase of end-systole and one of end-diastole.
    pub fn extreme_phases(&self) -> [f64; 2] {
        self.parts.cycle.extreme_phases()
    }

    pub(crate) fn acquisition_of(&self, gate: usize, points: usize) -> Acquisition {
        let gates = self.parts.mode.n_gates();
        self.parts.mode.acquisition(gate % gates, points)
    }

    /// The cycle with the respiratory gate that a set of views is of.
    pub(crate) fn cycle_of(&self, gate: usize) -> &Cycle {
        &self.cycles[gate / self.parts.mode.n_gates()]
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
            activity: self.parts.activity,
            attenuation: self.parts.attenuation,
            defects: &self.parts.defects,
            twist: self.parts.twist.as_ref(),
            background: self.parts.background,
            organs: self.parts.organs.as_ref(),
            // Far below what any detector resolves.
            tolerance: 1e-5 * self.parts.heart.length(),
            depth: None,
            lattice: vec![[0.0; 2]],
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
