//! Reconstruction of all slices by OSEM with a model of the camera.
//!
//! The model's voxels are those of the camera, extended to all activity and attenuation that contributes to the projections, also beyond a requested
//! region. The camera's voxels are extracted at the end.

use super::Phantom;
use super::method::{Compensation, Osem, OsemReport};
use super::model_voxels::{Model, ModelVoxels};
use crate::error::{PhantomError, check_count, check_length, zeros};
use crate::observer::check_stop;
use crate::once::once;
use crate::scan::Scan;
use crate::{Camera, Observer, Rotation};
use radon::{
    EmOptions, IterativeReport, LinearOperator, SliceAxis, SpectGeometry, SpectOperator,
    SpectOptions, Stopping, Subset,
};
use std::ops::ControlFlow;

/// Work memory of the model that does not depend on the threads.
const WORK_BYTES: u64 = 64 << 20;
/// Work memory of the depth-dependent blur per sample of a view and thread: eight views of thirty images.
const BLUR_BYTES: usize = 8 * 30 * 4;
/// Tolerance of the volume fraction of the heart in a voxel of the attenuation map. Between soft tissue and lungs, with voxels of 6.4 mm,
/// this is an optical thickness of 7e-4.
const MAP_TOLERANCE: f64 = 1e-2;

/// Clamps negative rounding residue of projections to zero.
pub(super) fn counted(views: &[f32]) -> Vec<f32> {
    let most = views.iter().fold(0.0f32, |most, &x| most.max(x));
    let nothing = -f32::EPSILON * most..0.0;
    let counted = |&x: &f32| if nothing.contains(&x) { 0.0 } else { x };
    views.iter().map(counted).collect()
}

impl Phantom {
    /// Reconstructs projections of a gate. `progress` receives the number of completed iterations.
    pub(super) fn osem(
        &self,
        osem: &Osem,
        gate: usize,
        views: &[f32],
        progress: Observer<'_, usize>,
    ) -> Result<(Vec<f32>, OsemReport), PhantomError> {
        check_count("gate", gate, [0, self.n_gates() - 1])?;
        check_length(
            "views",
            views.len(),
            self.camera().n_views() * self.camera().view_len(),
        )?;
        let voxels = self.parts.model_voxels(osem, &self.radii()?)?;
        let any = match self.camera().rotation() {
            Rotation::StepAndShoot => {
                let make = || self.gate_model(osem, gate, &voxels, None);
                Some(once(&self.model, make)?)
            }
            Rotation::Continuous => None,
        };
        let own;
        let model = match any.filter(|_| self.gates_share_model(osem)) {
            Some(shared) => shared,
            None => {
                own = self.gate_model(osem, gate, &voxels, any)?;
                &own
            }
        };
        let data = (counted(views), self.background(osem, gate)?);
        let (volume, report) = self.passes(osem, &model.subsets, data, progress)?;
        Ok((voxels.cut(&volume, self.camera())?, report))
    }

    /// Whether all gates have the same geometry and attenuation map.
    pub(super) fn gates_share_model(&self, osem: &Osem) -> bool {
        let attenuation = self.scene().attenuates();
        let still = attenuation.is_some_and(|attenuation| attenuation.torso().is_some());
        self.camera().rotation() == Rotation::StepAndShoot && (still || !osem.attenuation)
    }

    /// Returns the model of a gate; `other` has the same geometry.
    pub(super) fn gate_model(
        &self,
        osem: &Osem,
        gate: usize,
        voxels: &ModelVoxels,
        other: Option<&Model>,
    ) -> Result<Model, PhantomError> {
        let map = match osem.attenuation {
            true => self.mean_attenuation(gate, &voxels.camera)?,
            false => Vec::new(),
        };
        let operator = match other {
            Some(other) => other.operator.with_attenuation(&map)?,
            None => self.operator(osem, gate, voxels, map)?,
        };
        Model::new(osem, operator)
    }

    /// The scatter that the model of a gate contains; empty for none.
    pub(super) fn background(&self, osem: &Osem, gate: usize) -> Result<Vec<f32>, PhantomError> {
        match osem.scatter {
            false => Ok(Vec::new()),
            true => self.scatter_samples(gate, 0),
        }
    }

    /// Iterates with a background. Voxels outside all views stay zero; the others start uniform, with the total counts.
    pub(super) fn passes<O: LinearOperator<f32>>(
        &self,
        osem: &Osem,
        subsets: &[Subset<O, f32>],
        (views, background): (Vec<f32>, Vec<f32>),
        progress: Observer<'_, usize>,
    ) -> Result<(Vec<f32>, OsemReport), PhantomError> {
        let mut volume: Vec<f32> = Vec::new();
        for subset in subsets {
            let seen = subset.sensitivity()?;
            if volume.is_empty() {
                volume = zeros("voxels of the reconstruction", seen.len())?;
            }
            volume.iter_mut().zip(seen).for_each(|(sum, x)| *sum += x);
        }
        let sum = |samples: &[f32]| samples.iter().map(|&x| f64::from(x)).sum::<f64>();
        let level = (sum(&views) / sum(&volume)) as f32;
        let start = |x: &mut f32| *x = if *x > 0.0 { level } else { 0.0 };
        volume.iter_mut().for_each(start);

        let stopping = Stopping::default().with_max_iterations(osem.iterations);
        let options = EmOptions::default()
            .with_stopping(stopping)
            .with_background(background);
        let mut observed = ControlFlow::Continue(());
        let watch = |report: &IterativeReport, _: &[f32]| {
            observed = progress(report.iterations);
            let change = report.history.last().and_then(|last| last.change);
            match osem.tolerance.zip(change) {
                Some((tolerance, change)) if change <= tolerance => ControlFlow::Break(()),
                _ => observed,
            }
        };
        let report = radon::osem(subsets, &views, &mut volume, &options, watch)?;
        check_stop(observed)?;
        self.work.osem(report.iterations);
        let last = report.history.last();
        let report = OsemReport {
            iterations: report.iterations,
            change: last.and_then(|last| last.change).unwrap_or(0.0),
            residual: last.map_or(0.0, |last| last.residual),
        };
        Ok((volume, report))
    }

    /// Estimates the memory in bytes: in all, and in addition per thread.
    pub(super) fn bytes_of_osem(&self, osem: &Osem) -> (u64, u64) {
        let (parts, views) = (&self.parts, self.camera().n_views());
        let radii = self.known_radii().unwrap_or_default();
        let Ok(voxels) = parts.model_voxels(osem, &radii) else {
            return (0, 0);
        };
        let (image, n) = (voxels.camera.image(), voxels.camera.grid().len());
        // Volume, start and factors of an iteration, a copy for the model; sensitivities of the subsets; twice the map, and
        // that of the organs.
        let maps = 2 + usize::from(parts.organs.is_some());
        let volumes = 4 + osem.subsets + maps * usize::from(osem.attenuation);
        // Pixels and lengths of the cells that they intersect; unsorted cells of a view are counted per thread.
        let (overlaps, cells) = (36 * views * image.image_len(), 80 * image.image_len());
        // Indices of the samples, data twice, backgrounds, expected values.
        let samples = 24 * views * self.camera().view_len();
        let one = (4 * volumes * n + overlaps + samples) as u64;
        let models = match self.is_compensated() {
            false => one,
            true => self.n_gates() as u64 * one + self.bytes_of_warps(voxels.camera.grid()),
        };
        let blur = BLUR_BYTES * self.camera().view_len();
        (models + WORK_BYTES, (cells + blur) as u64)
    }

    /// Validates the model of a gate by building it without attenuation.
    pub(super) fn try_model(&self, osem: &Osem, gate: usize) -> Result<(), PhantomError> {
        let voxels = self.parts.model_voxels(osem, &self.radii()?)?;
        if self.scene().reconstruction.compensation == Compensation::KnownMotion {
            self.wall(self.reference())?;
        }
        self.operator(osem, gate, &voxels, Vec::new()).map(drop)
    }

    fn operator(
        &self,
        osem: &Osem,
        gate: usize,
        voxels: &ModelVoxels,
        map: Vec<f32>,
    ) -> Result<SpectOperator<f32>, PhantomError> {
        let (parts, wide) = (&self.parts, &voxels.camera);
        let [_, pitch] = self.camera().detector().pitch();
        let rows = SliceAxis::new(self.camera().n_rows(), pitch)?;
        let layers = SliceAxis::new(wide.n_rows(), pitch)?;
        // Line integrals do not end at a collimator face.
        let radii = match osem.resolution {
            true => self.radii()?,
            false => {
                let image = wide.image();
                let [x, y] = image.pixel_centre(0, 0).map(f64::abs);
                let [u, v] = image.pixel_centre(image.nx() - 1, image.ny() - 1);
                let far = 2.0 * (x.max(u.abs()).hypot(y.max(v.abs())) + image.spacing()[0]);
                vec![far; self.camera().n_views()]
            }
        };
        let geometry = SpectGeometry::new(&self.geometry(gate)?, &rows, radii)?;
        let options = SpectOptions::default()
            .with_collimator(parts.response(osem))
            .with_attenuation(map);
        let operator = SpectOperator::new(&geometry, wide.image(), &layers, &options)?;
        Ok(operator)
    }

    /// The attenuation map of the model, averaged over the acquisition time of a gate.
    fn mean_attenuation(&self, gate: usize, wide: &Camera) -> Result<Vec<f32>, PhantomError> {
        let scan = Scan {
            camera: wide,
            ..self.heart_scan(gate)?
        };
        let tolerance = self.scene().truth.tolerance.max(MAP_TOLERANCE);
        self.attenuation_of(&scan, tolerance, &self.attenuating_organs)
    }
}
