//! A scene come to life: everything on demand, and nothing twice.

use crate::activity::Background;
use crate::attenuation::Attenuation;
use crate::build::{
    acquisition_of, background_of, cycle_of, defect_of, gates_of, geometry_of, heart_of, readout_of,
};
use crate::defect::Defect;
use crate::error::{PhantomError, check_count};
use crate::prepare::Source;
use crate::readout::Readout;
use crate::scan::Scan;
use crate::scene::{Scene, WindowSettings};
use crate::steps::STEPS;
use crate::truth::truth_of_slices;
use crate::work::{Work, WorkReport};
use crate::{
    Acquisition, Activity, Camera, Cycle, Heart, HeartShape, Regions, Sinograms, TruthOf, ViewTime,
};
use radon::{FbpOptions, FbpPlan, ParallelGeometry, Skip, StackOrder, Window};
use revolve_voxel::nalgebra::Point3;
use revolve_voxel::{Mesh, Sampling};
use serde::Serialize;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// The body's region that holds the defects.
const WALL: usize = 1;
/// A phantom: what a [`Scene`] describes, computed when it is asked for.
///
/// [`Phantom::new`] computes nothing. Every part (a view, a slice, a phase) does its own work only and has the bits that it has in
/// the whole; shapes are solved once and kept; [`Phantom::work`] tells what has been done. Results have the same bits for any
/// number of threads.
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
    scene: Scene,
    heart: Heart,
    camera: Camera,
    cycle: Cycle,
    activity: Activity,
    attenuation: Option<Attenuation>,
    defects: Vec<Defect>,
    background: Option<Background>,
    readout: Readout,
    /// Mean counts of a sample of 1, by gate.
    counts: Vec<OnceLock<f64>>,
    skip: Skip,
    pub(crate) steps: OnceLock<usize>,
    regions: OnceLock<Regions>,
    pub(crate) work: Work,
    source: Option<Source>,
}

/// The numbers of a heart, as a clinic would measure them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Numbers {
    /// End-diastolic volume of the cavity in mL.
    pub edv: f64,
    /// End-systolic volume in mL.
    pub esv: f64,
    /// `EDV - ESV` in mL.
    pub stroke_volume: f64,
    /// `(EDV - ESV) / EDV`.
    pub ejection_fraction: f64,
    /// The paper's `(EDV - V_rest) / V_rest`.
    pub gain: f64,
    /// Stroke volume times heart rate, L a minute.
    pub cardiac_output: f64,
    /// Volume of the wall in mL, the same at all phases.
    pub wall_volume: f64,
    /// Thickness of the wall at end-diastole.
    pub diastolic_thickness: Thickness,
    /// Thickness of the wall at end-systole.
    pub systolic_thickness: Thickness,
}

/// Thickness of the wall in cm: shortest distance from the inner membrane to the outer one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Thickness {
    /// From the material middle of the inner cylinder.
    pub side: f64,
    /// From the inner apex.
    pub apex: f64,
}

impl Phantom {
    /// Checks the scene and makes ready; no shape is solved, no ray cast.
    ///
    /// # Errors
    /// [`PhantomError::Scene`]; [`PhantomError::Membrane`] if the discretised balloons make no pair.
    pub fn new(scene: Scene) -> Result<Self, PhantomError> {
        scene.check()?;
        let heart = heart_of(&scene)?;
        Ok(Self {
            heart,
            camera: Camera::with_geometry(&geometry_of(&scene))?,
            cycle: cycle_of(&scene)?,
            activity: Activity {
                cavity: scene.activity.cavity,
                wall: scene.activity.wall,
            },
            attenuation: scene
                .attenuation
                .as_ref()
                .map(Attenuation::new)
                .transpose()?,
            defects: scene.defects.iter().map(defect_of).collect(),
            background: scene.background.as_ref().map(background_of).transpose()?,
            readout: readout_of(&scene)?,
            counts: vec![OnceLock::new(); gates_of(&scene)],
            skip: Skip::default(),
            steps: OnceLock::new(),
            regions: OnceLock::new(),
            work: Work::default(),
            source: None,
            scene,
        })
    }

    /// The phantom of a scene file.
    ///
    /// # Errors
    /// As [`Scene::load`] and [`Phantom::new`].
    pub fn load(path: &Path) -> Result<Self, PhantomError> {
        let (scene, text) = Scene::read(path)?;
        let path = path.to_path_buf();
        Ok(Self {
            source: Some(Source { path, text }),
            ..Self::new(scene)?
        })
    }

    pub(crate) fn source(&self) -> Option<&Source> {
        self.source.as_ref()
    }

    /// The same with work on empty slices done or not; it changes no bit of any result.
    pub fn with_skip(mut self, skip: Skip) -> Self {
        self.skip = skip;
        self
    }

    /// The same with another bound, in bytes, on the memory of the heart's shapes ([`Heart::with_memory`]); it changes no bit of any
    /// result.
    pub fn with_memory(mut self, bytes: usize) -> Self {
        self.heart = self.heart.with_memory(bytes);
        self
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The heart, whose shapes are solved when asked for.
    pub fn heart(&self) -> &Heart {
        &self.heart
    }

    /// The camera and the voxels.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The beat.
    pub fn cycle(&self) -> &Cycle {
        &self.cycle
    }

    /// Number of sets of views: the gates, or 1.
    pub fn n_gates(&self) -> usize {
        self.counts.len()
    }

    /// What has been done so far.
    pub fn work(&self) -> WorkReport {
        let heart = &self.heart;
        (self.work).report(heart.shapes_solved(), heart.most_shapes_alive())
    }

    /// The time that the views of a gate see, with the steps that meet the scene's tolerance.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::Quadrature`] if no number of steps suffices.
    pub fn acquisition(&self, gate: usize) -> Result<Acquisition, PhantomError> {
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        Ok(acquisition_of(&self.scene, gate, self.steps()?))
    }

    /// When and from where each view of a gate is taken; nothing is computed for it.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn view_times(&self, gate: usize) -> Result<Vec<ViewTime>, PhantomError> {
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        let acquisition = acquisition_of(&self.scene, gate, STEPS[0]);
        let interval = self.scene.camera.seconds_per_view;
        let time = |view_idx| acquisition.view_time(&self.cycle, &self.camera, interval, view_idx);
        Ok((0..self.camera.n_views()).map(time).collect())
    }

    /// One view of a gate, `[row][bin]`, with the scene's blur and noise. Noise of a given total needs all views of the gate
    /// once, to know its scale.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or view; what solving the shapes can return.
    pub fn view(&self, gate: usize, view_idx: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("view", view_idx, 0, self.camera.n_views() - 1)?;
        let rows = 0..self.camera.n_rows();
        Ok(self
            .take(gate, view_idx..view_idx + 1, rows, &|_| ())?
            .samples)
    }

    /// All views of a gate, `[view][row][bin]`. `progress` is told the number of views done.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn sinograms(
        &self,
        gate: usize,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        self.take(
            gate,
            0..self.camera.n_views(),
            0..self.camera.n_rows(),
            progress,
        )
    }

    /// One slice of the reconstruction of a gate, `[y][x]`, from one row of each view, and those that the blur reaches.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or slice; [`PhantomError::Radon`] if the arc is too short.
    pub fn slice(&self, gate: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, 0, self.camera.n_rows() - 1)?;
        let sinogram = self.take(gate, 0..self.camera.n_views(), z..z + 1, &|_| ())?;
        self.reconstruct_slices(gate, &sinogram.samples, 1)
    }

    /// The reconstruction of a gate, `[z][y][x]`.
    ///
    /// # Errors
    /// As [`Phantom::slice`].
    pub fn volume(&self, gate: usize) -> Result<Vec<f32>, PhantomError> {
        self.reconstruct(gate, &self.sinograms(gate, &|_| ())?.samples)
    }

    /// The reconstruction of any views `[view][row][bin]` of this camera, `[z][y][x]`: those of
    /// [`Phantom::sinograms`], or those with noise or blur added. They count as seen from where those of the gate are
    /// ([`Phantom::geometry`]).
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::Radon`] for a wrong length, a sample that is not finite, or
    /// an arc that is too short.
    pub fn reconstruct(&self, gate: usize, views: &[f32]) -> Result<Vec<f32>, PhantomError> {
        self.reconstruct_slices(gate, views, self.camera.n_rows())
    }

    /// The angles from which the views of a gate are seen, each in the mean over its time, and the bins. Of a camera that turns
    /// all the time they are not those of [`Camera::geometry`], unless the views see all of their time.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn geometry(&self, gate: usize) -> Result<ParallelGeometry, PhantomError> {
        let angles: Vec<f64> = self
            .view_times(gate)?
            .iter()
            .map(|time| time.angle)
            .collect();
        let (bins, pitch) = (self.camera.n_bins(), self.camera.pitch());
        Ok(ParallelGeometry::new(angles, bins, pitch)?)
    }

    /// What the exact volumes are the mean over.
    pub fn truth_of(&self) -> TruthOf {
        acquisition_of(&self.scene, 0, STEPS[0]).truth_of(&self.cycle, &self.camera)
    }

    /// The exact volume of a gate, `[z][y][x]`: the mean over each voxel and over the time that the views see together, see
    /// [`Phantom::truth_of`].
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn truth(&self, gate: usize) -> Result<Vec<f32>, PhantomError> {
        self.truth_slices(self.acquisition(gate)?, 0..self.camera.n_rows())
    }

    /// One slice of the exact volume of a gate, `[y][x]`.
    ///
    /// # Errors
    /// As [`Phantom::slice`].
    pub fn truth_slice(&self, gate: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, 0, self.camera.n_rows() - 1)?;
        self.truth_slices(self.acquisition(gate)?, z..z + 1)
    }

    /// The heart at a phase.
    ///
    /// # Errors
    /// What solving the shape can return.
    pub fn shape(&self, phase: f64) -> Result<Arc<HeartShape>, PhantomError> {
        self.shape_at_gain(self.cycle.gain(phase))
    }

    /// Activity per mL of cavity and wall at a phase.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn concentrations(&self, phase: f64) -> Result<[f64; 2], PhantomError> {
        Ok(self.activity.of(&*self.shape(phase)?))
    }

    /// A phase of end-systole and one of end-diastole.
    pub fn extreme_phases(&self) -> [f64; 2] {
        self.cycle.extreme_phases()
    }

    /// The activity of every voxel at a phase, `[z][y][x]`, averaged over the voxel.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn activity(&self, phase: f64) -> Result<Vec<f32>, PhantomError> {
        self.truth_slices(Acquisition::Static { phase }, 0..self.camera.n_rows())
    }

    /// What every voxel holds most of at a phase, `[z][y][x]`: 0 background, 1 cavity, 2 wall; of the wall's voxels 3 are those
    /// of the scene's first defect, 4 those of the second, and so on.
    ///
    /// A voxel of the wall is a defect's if that, without what later ones replace of it, fills more of it than any other defect or
    /// the rest of the wall, and the first one's of equals. [`Phantom::label_names`] lists the names.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn labels(&self, phase: f64) -> Result<Vec<u8>, PhantomError> {
        let sampling = Sampling::Coverage {
            tolerance: self.scene.truth.tolerance,
        };
        let (grid, slices) = (self.camera.grid(), 0..self.camera.n_rows());
        let shape = self.shape(phase)?;
        let mut regions = (shape.body()).regions::<f32>(grid, slices.clone(), sampling)?;
        let scan = self.scan(&self.camera, Acquisition::Static { phase });
        let placed = scan.placed(std::slice::from_ref(&shape))?;
        let defects = placed.by_defect(&shape, self.defects.len());
        regions.label_pieces(WALL, &defects, grid, slices, sampling)?;
        self.work.voxels(regions.counters);
        Ok(regions.labels)
    }

    /// What the labels stand for, from 0 on: `background`, `cavity`, `wall`, `defect 1`, `defect 2` and so on.
    pub fn label_names(&self) -> Vec<String> {
        let regions = ["background", "cavity", "wall"].map(String::from);
        let defects = (1..=self.defects.len()).map(|k| format!("defect {k}"));
        regions.into_iter().chain(defects).collect()
    }

    /// The attenuation of every voxel at a phase in 1/cm, `[z][y][x]`, averaged over the voxel.
    ///
    /// # Errors
    /// [`PhantomError::Absent`] if nothing attenuates; as [`Phantom::shape`].
    pub fn attenuation(&self, phase: f64) -> Result<Vec<f32>, PhantomError> {
        let Some(attenuation) = &self.attenuation else {
            return Err(PhantomError::Absent {
                what: "attenuation",
            });
        };
        let tolerance = self.scene.truth.tolerance;
        attenuation.map(self.shape(phase)?.body(), self.camera.grid(), tolerance)
    }

    /// The inner and the outer surface at a phase, in the lab, cm. They enclose the body's volume to the scene's
    /// `output.mesh_tolerance`, whatever the voxels are; the number of triangles goes as one over that.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn meshes(&self, phase: f64) -> Result<[Mesh; 2], PhantomError> {
        let shape = self.shape(phase)?;
        let tolerance = self.scene.output.mesh_tolerance;
        Ok([shape.mesh(0, tolerance)?, shape.mesh(1, tolerance)?])
    }

    /// Volumes, ejection fraction, wall.
    ///
    /// # Errors
    /// What solving the two shapes can return.
    pub fn numbers(&self) -> Result<Numbers, PhantomError> {
        let [systole, diastole] = self.cycle.gains();
        self.heart.shapes(&[systole, diastole])?;
        let (small, large) = (self.shape_at_gain(systole)?, self.shape_at_gain(diastole)?);
        let (esv, edv) = (small.volumes()[0], large.volumes()[0]);
        Ok(Numbers {
            edv,
            esv,
            stroke_volume: edv - esv,
            ejection_fraction: (edv - esv) / edv,
            gain: diastole,
            cardiac_output: (edv - esv) * self.scene.cycle.beats_per_minute / 1000.0,
            wall_volume: self.heart.pair().wall_volume(),
            diastolic_thickness: self.thickness_of(&large),
            systolic_thickness: self.thickness_of(&small),
        })
    }

    /// Thickness of the wall at a phase.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn thickness(&self, phase: f64) -> Result<Thickness, PhantomError> {
        Ok(self.thickness_of(&*self.shape(phase)?))
    }

    /// The voxels over which reconstructions are judged; from 24 phases, made once.
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn regions(&self) -> Result<&Regions, PhantomError> {
        if self.regions.get().is_none() {
            let made = Regions::new(&self.heart, &self.camera, &self.cycle)?;
            // Another thread may have been first, with the same.
            let _ = self.regions.set(made);
        }
        Ok(self.regions.get_or_init(|| unreachable!("just set")))
    }

    fn take(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let mut taken = self.means(gate, views.clone(), rows.clone(), progress)?;
        let per_unit = self.counts_per_unit(gate)?;
        let first = gate * self.camera.n_views() + views.start;
        self.readout
            .count(&mut taken.samples, per_unit, first, &rows)?;
        Ok(taken)
    }

    /// Line integrals, blurred but without noise.
    fn means(
        &self,
        gate: usize,
        views: Range<usize>,
        rows: Range<usize>,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Sinograms, PhantomError> {
        let cast = self.readout.rows_seen(&rows);
        let scan = self.scan(&self.camera, self.acquisition(gate)?);
        let mut taken = scan.rows(views, cast, progress)?;
        self.work.rays(taken.rays);
        self.readout.blur(&mut taken.samples, &rows)?;
        Ok(taken)
    }

    /// Mean counts of a sample of 1 in a gate; `None` without noise. Of a given total it takes all views of the gate, once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn counts_per_unit(&self, gate: usize) -> Result<Option<f64>, PhantomError> {
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        if let Some(&known) = self.counts[gate].get() {
            return Ok(Some(known));
        }
        let (views, rows) = (0..self.camera.n_views(), 0..self.camera.n_rows());
        let made = (self.readout)
            .counts_per_unit(|| Ok(self.means(gate, views, rows, &|_| ())?.samples))?;
        Ok(made.map(|made| *self.counts[gate].get_or_init(|| made)))
    }

    pub(crate) fn scan<'a>(&'a self, camera: &'a Camera, acquisition: Acquisition) -> Scan<'a> {
        Scan {
            heart: &self.heart,
            camera,
            cycle: &self.cycle,
            acquisition,
            activity: self.activity,
            attenuation: self.attenuation,
            defects: &self.defects,
            background: self.background,
            // Far below what any detector resolves.
            tolerance: 1e-5 * (self.scene.heart.outer.length + self.scene.heart.outer.radius),
        }
    }

    /// What reconstructs a slice of a gate.
    pub(crate) fn plan(&self, gate: usize) -> Result<FbpPlan<f32>, PhantomError> {
        let settings = &self.scene.reconstruction;
        let window = match settings.window {
            WindowSettings::RamLak => Window::RamLak,
            WindowSettings::SheppLogan => Window::SheppLogan,
            WindowSettings::Cosine => Window::Cosine,
            WindowSettings::Hamming => Window::Hamming,
            WindowSettings::Hann => Window::Hann,
            WindowSettings::Butterworth { order } => Window::Butterworth { order },
        };
        let options = FbpOptions::default()
            .with_window(window)
            .with_cutoff(settings.cutoff)
            .with_arc(settings.arc.policy())
            .with_skip(self.skip);
        let geometry = self.geometry(gate)?;
        Ok(FbpPlan::new(&geometry, self.camera.image(), &options)?)
    }

    fn reconstruct_slices(
        &self,
        gate: usize,
        views: &[f32],
        n_slices: usize,
    ) -> Result<Vec<f32>, PhantomError> {
        let plan = self.plan(gate)?;
        let mut volume = vec![0.0f32; n_slices * plan.image_len()];
        let order = StackOrder::ViewSliceBin;
        let report =
            plan.reconstruct_stack_into(views, n_slices, order, &mut volume, &mut plan.scratch())?;
        self.work.reconstruction(report);
        Ok(volume)
    }

    fn truth_slices(
        &self,
        acquisition: Acquisition,
        slices: Range<usize>,
    ) -> Result<Vec<f32>, PhantomError> {
        let tolerance = self.scene.truth.tolerance;
        let scan = self.scan(&self.camera, acquisition);
        let (volume, counters) = truth_of_slices(&scan, tolerance, slices)?;
        self.work.voxels(counters);
        Ok(volume)
    }

    pub(crate) fn shape_at_gain(&self, gain: f64) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.heart.shapes(&[gain])?.remove(0))
    }

    /// Share of the upper half of the inner membrane up to the middle of its cylinder.
    pub(crate) fn side(&self) -> f64 {
        let inner = self.scene.heart.inner;
        inner.length / (2.0 * inner.length + std::f64::consts::PI * inner.radius)
    }

    pub(crate) fn thickness_of(&self, shape: &HeartShape) -> Thickness {
        let distance = |s: f64| {
            let [x, r] = shape.solution().inner.at(s).position;
            let place = self.heart.pose().to_lab(&Point3::new(x, r.max(0.0), 0.0));
            -shape.body().signed_distance(1, &place)
        };
        Thickness {
            side: distance(0.5 * self.side()),
            apex: distance(0.5),
        }
    }
}
