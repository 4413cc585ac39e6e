//! Volumes of a phantom: reconstruction and voxelised ground truth.

use super::Phantom;
use crate::error::{PhantomError, check, check_count, check_length, zeros};
use crate::observer::check_stop;
use crate::once::once;
use crate::scan::Scan;
use crate::truth::{alone, truth_of_slices};
use crate::{
    Activity, Method, MotionPhase, Observer, OsemReport, Regions, Rotation, Uptake, no_observer,
};
use radon::{FbpPlan, StackOrder};
use revolve_voxel::{Mesh, Organ, Organs, Sector};
use std::borrow::Cow;
use std::f64::consts::LN_2;
use std::ops::Range;
use std::sync::{Arc, OnceLock, PoisonError};

/// Index of the body's region that contains the defects.
const WALL: usize = 1;

impl Phantom {
    /// Computes slice `z` of [`Phantom::volume`], `[y][x]`, from one row of each view and the rows within the blur. [`Method::Osem`],
    /// [`Compensation::KnownMotion`](crate::Compensation::KnownMotion) and a filter of the volume reconstruct all of it.
    ///
    /// # Errors
    /// As [`Phantom::volume`]; [`PhantomError::Count`] if there is no such slice.
    pub fn slice(&self, number: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, [0, self.parts.camera.n_rows() - 1])?;
        let (settings, len) = (
            &self.scene().reconstruction,
            self.camera().grid().slice_len(),
        );
        if settings.method.osem().is_some()
            || self.is_compensated()
            || settings.filter_fwhm.is_some()
        {
            return Ok(self.volume(number)?[z * len..][..len].to_vec());
        }
        let part = (0..self.camera().n_views(), z..z + 1);
        let sinogram = self.take(number, part, &no_observer)?;
        let mut slice = vec![0.0f32; len];
        self.back_project(number, &sinogram.samples, 1, &mut slice)?;
        Ok(slice)
    }

    /// Projects and reconstructs volume `number` of [`Phantom::n_volumes`], `[z][y][x]`, on the voxels of
    /// [`Camera::grid`](crate::Camera::grid), limited to the region if one is given: a gate, or with
    /// [`Compensation::KnownMotion`](crate::Compensation::KnownMotion) the volume of [`Phantom::compensated`].
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such volume; as [`Phantom::reconstruct`] and [`Phantom::compensated`].
    pub fn volume(&self, number: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("volume", number, [0, self.n_volumes() - 1])?;
        match self.is_compensated() {
            true => Ok((self.compensated(number, &self.sinograms_of_gates()?, &no_observer)?).0),
            false => self.reconstruct(number, &self.sinograms(number, &no_observer)?.samples),
        }
    }

    /// Reconstructs views `[view][row][bin]` of this camera, `[z][y][x]`: those of [`Phantom::sinograms`], or modified ones. The angles are
    /// those of the gate ([`Phantom::geometry`]).
    ///
    /// # Errors
    /// [`PhantomError::Count`] if there is no such gate; [`PhantomError::Radon`] or [`PhantomError::WrongLength`] for a wrong length;
    /// [`PhantomError::Radon`] for a sample that is not finite, an arc that is too short (FBP), or a negative sample (OSEM).
    pub fn reconstruct(&self, gate: usize, views: &[f32]) -> Result<Vec<f32>, PhantomError> {
        let mut volume = self.empty_volume()?;
        self.reconstruct_into(gate, views, &mut volume, &no_observer)?;
        Ok(volume)
    }

    /// Returns a reconstruction of zeros.
    pub(crate) fn empty_volume(&self) -> Result<Vec<f32>, PhantomError> {
        zeros(
            "voxels of the reconstruction",
            self.parts.camera.grid().len(),
        )
    }

    /// As [`Phantom::reconstruct`], into a buffer of the caller, with a callback `progress` that can stop it, and with the report of OSEM.
    /// `progress` receives the number of completed OSEM iterations: 0 before the first, and with FBP.
    ///
    /// # Errors
    /// As [`Phantom::reconstruct`]; [`PhantomError::WrongLength`] or [`PhantomError::Radon`] for a volume of another length;
    /// [`PhantomError::Stopped`].
    pub fn reconstruct_into(
        &self,
        gate: usize,
        views: &[f32],
        volume: &mut [f32],
        progress: Observer<'_, usize>,
    ) -> Result<Option<OsemReport>, PhantomError> {
        check_stop(progress(0))?;
        let report = match &self.scene().reconstruction.method {
            Method::Fbp => {
                self.back_project(gate, views, self.parts.camera.n_rows(), volume)?;
                None
            }
            Method::Osem(osem) => {
                check_length("volume", volume.len(), self.parts.camera.grid().len())?;
                let (made, report) = self.osem(osem, gate, views, progress)?;
                volume.copy_from_slice(&made);
                Some(report)
            }
        };
        self.filter(volume)?;
        Ok(report)
    }

    /// Filters a reconstruction, if the scene has a filter.
    pub(super) fn filter(&self, volume: &mut [f32]) -> Result<(), PhantomError> {
        if let Some(fwhm) = self.scene().reconstruction.filter_fwhm {
            let sigma = fwhm / (8.0 * LN_2).sqrt();
            let grid = self.camera().grid();
            let ([nx, ny, nz], [x, y, z]) = (grid.shape(), grid.spacing());
            radon::gaussian_filter(volume, [nz, ny, nx], [z, y, x].map(|side| sigma / side))?;
        }
        Ok(())
    }

    /// Computes the voxelised ground truth of a gate, `[z][y][x]`: averages over each voxel and over the acquisition time of each view. If
    /// views differ, it is the average over the views with equal weights, whatever their acquisition times ([`Phantom::truth_of`]). The error of a
    /// volume fraction is at most `truth.tolerance`, both averages together (0.4 of it at most in random gates, compared with averages over
    /// instants); it does not depend on `acquisition.accuracy`. The number of states of the heart, to which the time is proportional, is
    /// [`Phantom::images_and_states`]. [`Phantom::check_memory`] checks before any work that the volume fits into memory.
    ///
    /// # Errors
    /// As [`Phantom::view`]; [`PhantomError::Solid`] if the volume cannot be allocated.
    pub fn truth(&self, gate: usize) -> Result<Vec<f32>, PhantomError> {
        self.truth_slices(&self.heart_scan(gate)?, 0..self.parts.camera.n_rows())
    }

    /// Returns the ground truth of the wall during a scan: `truth`, that of everything, less that of cavity, background and organs.
    pub(super) fn wall_alone<'a>(
        &self,
        scan: &Scan<'_>,
        truth: &'a [f32],
    ) -> Result<Cow<'a, [f32]>, PhantomError> {
        let organs = scan.organs.is_some_and(Organs::is_active);
        let cavity = scan.activity.cavity != Uptake::Concentration(0.0);
        if scan.background.is_none() && !organs && !cavity {
            return Ok(truth.into());
        }
        let others = Scan {
            activity: Activity {
                wall: Uptake::Concentration(0.0),
                ..scan.activity
            },
            defects: &[],
            ..scan.clone()
        };
        let mut wall = self.truth_slices(&others, 0..self.parts.camera.n_rows())?;
        for (other, all) in wall.iter_mut().zip(truth) {
            *other = (all - *other).max(0.0);
        }
        Ok(wall.into())
    }

    /// Computes a slice of the ground truth of a gate, `[y][x]`.
    ///
    /// # Errors
    /// As [`Phantom::truth`]; [`PhantomError::Count`] if there is no such slice.
    pub fn truth_slice(&self, gate: usize, z: usize) -> Result<Vec<f32>, PhantomError> {
        check_count("slice", z, [0, self.parts.camera.n_rows() - 1])?;
        self.truth_slices(&self.heart_scan(gate)?, z..z + 1)
    }

    /// Computes the activity at a phase, `[z][y][x]`, averaged over each voxel.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn activity(&self, at: impl Into<MotionPhase>) -> Result<Vec<f32>, PhantomError> {
        let slices = 0..self.parts.camera.n_rows();
        self.at_motion_phase(at.into(), |scan| self.truth_slices(scan, slices))
    }

    /// Computes the label with the largest volume fraction in each voxel at a phase, `[z][y][x]`: 0 background, 1 cavity, 2 wall, 3 the first
    /// defect of the scene, 4 the second, and so on.
    ///
    /// A voxel of the wall gets the label of a defect if the defect, without parts that later ones replace, has a larger volume fraction than any
    /// other defect and the rest of the wall; the first one of equals. [`Phantom::label_names`] lists the names.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn labels(&self, at: impl Into<MotionPhase>) -> Result<Vec<u8>, PhantomError> {
        let tolerance = self.scene().truth.tolerance;
        let (grid, slices) = (self.parts.camera.grid(), 0..self.parts.camera.n_rows());
        let at = at.into();
        let (shape, pose) = (self.shape(at.phase)?, self.pose(at.breath)?);
        let body = shape.body().with_pose(pose);
        let part = simd_set::part(0..1, self.scene().defects.len() + 1);
        let mut regions = body.regions::<f32>(grid, slices.clone(), tolerance)?;
        drop(part);
        let placed = self.at_motion_phase(at, |scan| scan.placed(std::slice::from_ref(&shape)))?;
        let defects = placed.by_defect(&shape, self.scene().defects.len(), pose);
        let defects: Vec<Vec<&Sector>> = defects.iter().map(|d| d.iter().collect()).collect();
        regions.label_pieces(WALL, &defects, grid, slices, tolerance)?;
        self.work.voxels(regions.counters);
        Ok(regions.labels)
    }

    /// Returns the names of the labels from 0: `background`, `cavity`, `wall`, `defect 1`, `defect 2` and so on.
    #[must_use]
    pub fn label_names(&self) -> Vec<String> {
        let regions = ["background", "cavity", "wall"].map(String::from);
        let defects = (1..=self.scene().defects.len()).map(|k| format!("defect {k}"));
        regions.into_iter().chain(defects).collect()
    }

    /// Computes the linear attenuation coefficient at a phase in 1/cm, `[z][y][x]`, averaged over each voxel.
    ///
    /// # Errors
    /// [`PhantomError::Absent`] if nothing attenuates; as [`Phantom::shape`].
    pub fn attenuation(&self, at: impl Into<MotionPhase>) -> Result<Vec<f32>, PhantomError> {
        let (at, tolerance) = (at.into(), self.scene().truth.tolerance);
        check("phase", at.phase, crate::ranges::PHASE)?;
        self.at_motion_phase(at, |scan| {
            self.attenuation_of(scan, tolerance, &OnceLock::new())
        })
    }

    /// The linear attenuation coefficient during a scan in 1/cm, averaged over its voxels and its time, `[z][y][x]`. `organs` stores that of the
    /// organs, which do not move.
    pub(super) fn attenuation_of(
        &self,
        scan: &Scan<'_>,
        tolerance: f64,
        organs: &OnceLock<Vec<f32>>,
    ) -> Result<Vec<f32>, PhantomError> {
        let Some(attenuation) = scan.attenuation else {
            let what = "attenuation";
            return Err(PhantomError::Absent { what });
        };
        let (grid, slices) = (scan.camera.grid(), 0..scan.camera.n_rows());
        let of = |organ: &Organ| organ.attenuation;
        if let Some(torso) = attenuation.torso() {
            return Ok(Organs::new(vec![torso])?.voxelize(grid, slices, of)?);
        }
        // Voxelised as if it were activity: with organs the volume fraction of the heart, else its coefficient.
        let own = (scan.organs).map_or(attenuation.coefficient, |_| 1.0);
        let (mut map, counters) =
            truth_of_slices(&alone(scan, own), tolerance, slices.clone(), None)?;
        if let Some(around) = scan.organs {
            let around = once(organs, || Ok(around.voxelize(grid, slices, of)?))?;
            for (voxel, under) in map.iter_mut().zip(around) {
                *voxel = under + *voxel * (attenuation.coefficient as f32 - under);
            }
        }
        self.work.voxels(counters);
        Ok(map)
    }

    /// Computes the inner and the outer surface at a phase, in the lab, cm. The relative error of the enclosed volume is at most
    /// `output.mesh_tolerance` of the scene; the number of triangles scales as 1 / tolerance.
    ///
    /// # Errors
    /// As [`Phantom::shape`].
    pub fn meshes(&self, at: impl Into<MotionPhase>) -> Result<[Mesh; 2], PhantomError> {
        let at = at.into();
        let (shape, pose) = (self.shape(at.phase)?, self.pose(at.breath)?);
        let tolerance = self.scene().output.mesh_tolerance;
        let part = simd_set::part(0..1, 2);
        let inner = shape.mesh(pose, 0, tolerance)?;
        drop(part);
        let _part = simd_set::part(1..2, 2);
        Ok([inner, shape.mesh(pose, 1, tolerance)?])
    }

    /// Returns the regions of interest, computed once from 24 phases.
    ///
    /// # Errors
    /// Errors of the solver.
    pub fn regions(&self) -> Result<&Regions, PhantomError> {
        let parts = &self.parts;
        let make = || Regions::new(&parts.heart, &parts.camera, &parts.cycle);
        once(&self.regions, make)
    }

    /// Returns the reconstruction plan of a slice of a gate; the last one is stored. With step and shoot all gates share it.
    pub(super) fn plan(&self, gate: usize) -> Result<Arc<FbpPlan<f32>>, PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        let of = match self.parts.camera.rotation() {
            Rotation::StepAndShoot => 0,
            Rotation::Continuous => gate,
        };
        let last = || self.plan.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, plan)) = &*last()
            && *known == of
        {
            return Ok(plan.clone());
        }
        // Computed without the lock: two threads may compute the same plan, but none can deadlock.
        let (geometry, parts) = (self.geometry(gate)?, &self.parts);
        let made = FbpPlan::new(
            &geometry,
            parts.camera.image(),
            &parts.scene.reconstruction.fbp(),
        )?;
        let made = Arc::new(made);
        *last() = Some((of, made.clone()));
        Ok(made)
    }

    fn back_project(
        &self,
        gate: usize,
        views: &[f32],
        n_slices: usize,
        volume: &mut [f32],
    ) -> Result<(), PhantomError> {
        let plan = self.plan(gate)?;
        let order = StackOrder::ViewSliceBin;
        let report = plan.reconstruct_slab_into(
            views,
            n_slices,
            order,
            0..n_slices,
            volume,
            &mut radon::FbpScratch::default(),
        )?;
        self.work.reconstruction(report);
        self.clear_outside(volume);
        Ok(())
    }

    /// Sets the voxels of slices that are outside the circle of all views to zero: the other views do not determine them.
    fn clear_outside(&self, slices: &mut [f32]) {
        let camera = &self.parts.camera;
        let (grid, radius) = (camera.grid(), 0.5 * camera.n_bins() as f64 * camera.pitch());
        let [nx, ..] = grid.shape();
        let is_outside = |pixel: &usize| {
            let centre = grid.centre(pixel % nx, pixel / nx, 0);
            centre.x.hypot(centre.y) > radius
        };
        let outside: Vec<usize> = (0..grid.slice_len()).filter(is_outside).collect();
        for slice in slices.chunks_exact_mut(grid.slice_len()) {
            outside.iter().for_each(|pixel| slice[*pixel] = 0.0);
        }
    }

    pub(super) fn truth_slices(
        &self,
        scan: &Scan<'_>,
        slices: Range<usize>,
    ) -> Result<Vec<f32>, PhantomError> {
        let tolerance = self.scene().truth.tolerance;
        let (grid, all) = (self.camera().grid(), 0..self.camera().n_rows());
        let of = |slices| {
            move |organs: &Organs| Ok(organs.voxelize(grid, slices, |organ| organ.activity)?)
        };
        let organs = scan.organs.filter(|organs| organs.is_active());
        // Organs do not move: all gates share their map.
        let around = match slices == all {
            true => {
                let map = organs.map(|organs| once(&self.organ_map, || of(all)(organs)));
                map.transpose()?.map(Cow::from)
            }
            false => organs.map(of(slices.clone())).transpose()?.map(Cow::from),
        };
        let (volume, counters) = truth_of_slices(scan, tolerance, slices, around.as_deref())?;
        self.work.voxels(counters);
        Ok(volume)
    }
}
