//! A phantom: everything on demand, and nothing twice.

use crate::error::{PhantomError, check_count};
use crate::parts::PhantomParts;
use crate::readout::Readout;
use crate::scan::Scan;
use crate::steps::STEPS;
use crate::truth::truth_of_slices;
use crate::wide::Wide;
use crate::work::{Work, WorkReport};
use crate::{
    Acquisition, Camera, Cycle, Heart, HeartShape, Regions, Rotation, Sinograms, TruthOf, ViewTime,
};
#[cfg(feature = "scene")]
use crate::{Scene, source::Source};
use radon::{Blur, FbpPlan, ParallelGeometry, Skip, StackOrder};
use revolve_voxel::{Mesh, Sampling};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The body's region that holds the defects.
const WALL: usize = 1;
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
    pub(crate) readout: Readout,
    pub(crate) wide: OnceLock<Option<Wide>>,
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
            counts: vec![OnceLock::new(); parts.mode.n_gates()],
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

    /// Number of sets of views: the gates, or 1.
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
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        Ok(self.acquisition_of(gate, self.steps()?))
    }

    /// When and from where each view of a gate is taken; nothing is computed for it.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate.
    pub fn view_times(&self, gate: usize) -> Result<Vec<ViewTime>, PhantomError> {
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        let acquisition = self.acquisition_of(gate, STEPS[0]);
        let interval = self.parts.interval;
        let time = |view_idx| {
            acquisition.view_time(&self.parts.cycle, &self.parts.camera, interval, view_idx)
        };
        Ok((0..self.parts.camera.n_views()).map(time).collect())
    }

    /// One view of a gate, `[row][bin]`, with the scene's blur and noise. Noise of a given total needs all views of the gate
    /// once, to know its scale.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or view; what solving the shapes can return.
    pub fn view(&self, gate: usize, view_idx: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("view", view_idx, 0, self.parts.camera.n_views() - 1)?;
        let rows = 0..self.parts.camera.n_rows();
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
            0..self.parts.camera.n_views(),
            0..self.parts.camera.n_rows(),
            progress,
        )
    }

    /// One slice of the reconstruction of a gate, `[y][x]`, from one row of each view, and those that the blur reaches.
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate or slice; [`PhantomError::Radon`] if the arc is too short.
    pub fn slice(&self, gate: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, 0, self.parts.camera.n_rows() - 1)?;
        let sinogram = self.take(gate, 0..self.parts.camera.n_views(), z..z + 1, &|_| ())?;
        self.reconstruct_slices(gate, &sinogram.samples, 1)
    }

    /// The reconstruction of a gate, `[z][y][x]`: the voxels of [`Camera::grid`], of a camera whose pixels are a region those of the region
    /// only.
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
        self.reconstruct_slices(gate, views, self.parts.camera.n_rows())
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
        let (bins, pitch) = (self.parts.camera.n_bins(), self.parts.camera.pitch());
        Ok(ParallelGeometry::new(angles, bins, pitch)?)
    }

    /// What the exact volumes are the mean over.
    pub fn truth_of(&self) -> TruthOf {
        self.acquisition_of(0, STEPS[0])
            .truth_of(&self.parts.cycle, &self.parts.camera)
    }

    /// The exact volume of a gate, `[z][y][x]`: the mean over each voxel and over the time that the views see together, see
    /// [`Phantom::truth_of`].
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn truth(&self, gate: usize) -> Result<Vec<f32>, PhantomError> {
        self.truth_slices(self.acquisition(gate)?, 0..self.parts.camera.n_rows())
    }

    /// One slice of the exact volume of a gate, `[y][x]`.
    ///
    /// # Errors
    /// As [`Phantom::slice`].
    pub fn truth_slice(&self, gate: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, 0, self.parts.camera.n_rows() - 1)?;
        self.truth_slices(self.acquisition(gate)?, z..z + 1)
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

    /// The activity of every voxel at a phase, `[z][y][x]`, averaged over the voxel.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn activity(&self, phase: f64) -> Result<Vec<f32>, PhantomError> {
        self.truth_slices(Acquisition::still(phase), 0..self.parts.camera.n_rows())
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
            tolerance: self.parts.truth_tolerance,
        };
        let (grid, slices) = (self.parts.camera.grid(), 0..self.parts.camera.n_rows());
        let shape = self.shape(phase)?;
        let mut regions = (shape.body()).regions::<f32>(grid, slices.clone(), sampling)?;
        let scan = self.scan(&self.parts.camera, Acquisition::still(phase));
        let placed = scan.placed(std::slice::from_ref(&shape))?;
        let defects = placed.by_defect(&shape, self.parts.defects.len());
        regions.label_pieces(WALL, &defects, grid, slices, sampling)?;
        self.work.voxels(regions.counters);
        Ok(regions.labels)
    }

    /// What the labels stand for, from 0 on: `background`, `cavity`, `wall`, `defect 1`, `defect 2` and so on.
    pub fn label_names(&self) -> Vec<String> {
        let regions = ["background", "cavity", "wall"].map(String::from);
        let defects = (1..=self.parts.defects.len()).map(|k| format!("defect {k}"));
        regions.into_iter().chain(defects).collect()
    }

    /// The attenuation of every voxel at a phase in 1/cm, `[z][y][x]`, averaged over the voxel.
    ///
    /// # Errors
    /// [`PhantomError::Absent`] if nothing attenuates; as [`Phantom::shape`].
    pub fn attenuation(&self, phase: f64) -> Result<Vec<f32>, PhantomError> {
        let Some(attenuation) = &self.parts.attenuation else {
            return Err(PhantomError::Absent {
                what: "attenuation",
            });
        };
        let tolerance = self.parts.truth_tolerance;
        attenuation.map(
            self.shape(phase)?.body(),
            self.parts.camera.grid(),
            tolerance,
        )
    }

    /// The inner and the outer surface at a phase, in the lab, cm. They enclose the body's volume to the scene's
    /// `output.mesh_tolerance`, whatever the voxels are; the number of triangles goes as one over that.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn meshes(&self, phase: f64) -> Result<[Mesh; 2], PhantomError> {
        let shape = self.shape(phase)?;
        let tolerance = self.parts.output.mesh_tolerance;
        Ok([shape.mesh(0, tolerance)?, shape.mesh(1, tolerance)?])
    }

    /// The voxels over which reconstructions are judged; from 24 phases, made once.
    ///
    /// # Errors
    /// What solving the shapes can return.
    pub fn regions(&self) -> Result<&Regions, PhantomError> {
        if self.regions.get().is_none() {
            let made = Regions::new(&self.parts.heart, &self.parts.camera, &self.parts.cycle)?;
            // Another thread may have been first, with the same.
            let _ = self.regions.set(made);
        }
        #[expect(clippy::unreachable, reason = "just set")]
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
        let camera = &self.parts.camera;
        let per_unit = if (&views, &rows) == (&(0..camera.n_views()), &(0..camera.n_rows())) {
            self.counts_of(gate, || Ok(Cow::Borrowed(&taken.samples)))?
        } else {
            self.counts_per_unit(gate)?
        };
        let first = gate * self.parts.camera.n_views() + views.start;
        self.readout
            .count(&mut taken.samples, per_unit, first, &rows)?;
        Ok(taken)
    }

    /// Mean counts of a sample of 1 in a gate; `None` without noise. Of a given total it takes all views of the gate, once.
    ///
    /// # Errors
    /// As [`Phantom::view`].
    pub fn counts_per_unit(&self, gate: usize) -> Result<Option<f64>, PhantomError> {
        check_count("gate", gate, 0, self.n_gates() - 1)?;
        let camera = &self.parts.camera;
        let (views, rows) = (0..camera.n_views(), 0..camera.n_rows());
        self.counts_of(gate, || {
            Ok(Cow::Owned(self.means(gate, views, rows, &|_| ())?.samples))
        })
    }

    /// The same from all samples of the gate, if they are needed.
    fn counts_of<'a>(
        &self,
        gate: usize,
        all: impl FnOnce() -> Result<Cow<'a, [f32]>, PhantomError>,
    ) -> Result<Option<f64>, PhantomError> {
        if let Some(&known) = self.counts[gate].get() {
            return Ok(Some(known));
        }
        let made = self.readout.counts_per_unit(all)?;
        Ok(made.map(|made| *self.counts[gate].get_or_init(|| made)))
    }

    pub(crate) fn acquisition_of(&self, gate: usize, points: usize) -> Acquisition {
        let parts = &self.parts;
        parts.mode.acquisition(parts.interval, gate, points)
    }

    pub(crate) fn scan<'a>(&'a self, camera: &'a Camera, acquisition: Acquisition) -> Scan<'a> {
        Scan {
            heart: &self.parts.heart,
            camera,
            cycle: &self.parts.cycle,
            acquisition,
            activity: self.parts.activity,
            attenuation: self.parts.attenuation,
            defects: &self.parts.defects,
            background: self.parts.background,
            // Far below what any detector resolves.
            tolerance: 1e-5 * self.parts.heart.length(),
        }
    }

    /// What reconstructs a slice of a gate, made once for as long as one gate is looked at. Before a camera that stops it is the same for
    /// all of them.
    pub(crate) fn plan(&self, gate: usize) -> Result<Arc<FbpPlan<f32>>, PhantomError> {
        let of = match self.parts.camera.rotation() {
            Rotation::StepAndShoot => 0,
            Rotation::Continuous { .. } => gate,
        };
        let last = || self.plan.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, plan)) = &*last()
            && *known == of
        {
            return Ok(plan.clone());
        }
        // Without the lock: other threads may make the same, but none waits for itself.
        let (geometry, parts) = (self.geometry(gate)?, &self.parts);
        let made = FbpPlan::new(&geometry, parts.camera.image(), &parts.reconstruction)?;
        let made = Arc::new(made);
        *last() = Some((of, made.clone()));
        Ok(made)
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
        let tolerance = self.parts.truth_tolerance;
        let scan = self.scan(&self.parts.camera, acquisition);
        let (volume, counters) = truth_of_slices(&scan, tolerance, slices)?;
        self.work.voxels(counters);
        Ok(volume)
    }

    pub(crate) fn shape_at_gain(&self, gain: f64) -> Result<Arc<HeartShape>, PhantomError> {
        Ok(self.parts.heart.shapes(&[gain])?.remove(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CameraGeometry, Mode};

    fn gated(rotation: Rotation) -> Phantom {
        let heart = Heart::study(51).unwrap();
        let cycle = Cycle::new(60.0, 0.6).unwrap();
        let camera = Camera::with_geometry(&CameraGeometry {
            views: 8,
            arc: std::f64::consts::TAU,
            start: 0.0,
            bins: 8,
            rows: 1,
            pitch: [2.0; 2],
            rotation,
            pixels: [8; 2],
            pixel: 2.0,
            centre: [0.0; 2],
        });
        let mut parts = PhantomParts::new(heart, cycle, camera.unwrap());
        parts.mode = Mode::Gated { gates: 2 };
        Phantom::from_parts(parts).unwrap()
    }

    #[test]
    fn a_plan_is_made_once() {
        let phantom = gated(Rotation::StepAndShoot);
        let first = phantom.plan(0).unwrap();
        assert!(Arc::ptr_eq(&first, &phantom.plan(0).unwrap()));
        assert!(Arc::ptr_eq(&first, &phantom.plan(1).unwrap()));
        // Another option is another plan.
        let skipping = phantom.with_skip(Skip::Nothing);
        assert!(!Arc::ptr_eq(&first, &skipping.plan(0).unwrap()));
        // A camera that turns sees each gate from other angles.
        let phantom = gated(Rotation::Continuous { interval: 1.25 });
        let first = phantom.plan(0).unwrap();
        assert!(Arc::ptr_eq(&first, &phantom.plan(0).unwrap()));
        assert!(!Arc::ptr_eq(&first, &phantom.plan(1).unwrap()));
    }
}
