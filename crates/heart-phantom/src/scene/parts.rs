//! The objects that a scene describes.

use super::Scene;
use crate::model::Surroundings;
use crate::scan::{Acquisition, STEPS};
use crate::{Accuracy, BinSample, Camera, Cycle, Heart, Mode, ViewTime};
use radon::Collimator;
use revolve_voxel::Organs;

/// The tolerance of images if the number of time steps is given.
const DEFAULT_TOLERANCE: f64 = 1e-3;

/// A scene with the objects that its sections describe. Every other parameter is read from the scene itself.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub(crate) scene: Scene,
    /// Whether the caller gave the heart; it replaces the sections `[heart]` and `[pose]`.
    pub(crate) own_heart: bool,
    pub(crate) heart: Heart,
    pub(crate) cycle: Cycle,
    pub(crate) camera: Camera,
    pub(crate) organs: Option<Organs>,
    pub(crate) surroundings: Surroundings,
    pub(crate) collimator: Option<Collimator>,
    /// Material coordinate, above 0 (the base) and below 1/2 (the apex), at which thickness and blur of the wall are reported.
    pub(crate) side: f64,
}

impl Parts {
    pub(crate) fn mode(&self) -> Mode {
        self.scene.acquisition.mode
    }

    /// Returns the definition of a sample, given or implied by response and blur.
    pub(crate) fn samples(&self) -> BinSample {
        let samples = self.scene.camera.samples;
        samples.unwrap_or(match self.scene.has_response() {
            true => BinSample::Averages,
            false => BinSample::Centres,
        })
    }

    /// Returns the tolerance of the scene, if it is given.
    pub(crate) fn tolerance(&self) -> Option<f64> {
        match self.scene.acquisition.accuracy {
            Accuracy::Tolerance(tolerance) => Some(tolerance),
            Accuracy::Steps(_) => None,
        }
    }

    /// Returns the part of the tolerance for averages over bins; time averages have the remainder.
    pub(crate) fn tolerance_of_bins(&self) -> f64 {
        self.tolerance().map_or(DEFAULT_TOLERANCE, |all| 0.5 * all)
    }

    /// The number of gated projection sets: cardiac gates times respiratory gates.
    pub(crate) fn n_gates(&self) -> usize {
        self.mode().n_gates() * self.cycle.breath_gates()
    }

    /// Returns times and angles of the views of a gate.
    pub(crate) fn view_times(&self, gate: usize) -> Vec<ViewTime> {
        let acquisition = Acquisition::new(self.mode(), gate, STEPS[0]);
        (0..self.camera.n_views())
            .map(|view_idx| acquisition.view_time(&self.cycle, &self.camera, view_idx))
            .collect()
    }

    /// Returns the distance of the collimator face from the axis in each view; `None` if it follows the contour of the body.
    pub(crate) fn nominal_radii(&self) -> Option<Vec<f64>> {
        let angles = self.camera.geometry().angles().iter().enumerate();
        let orbit = &self.scene.camera.radius;
        (angles.map(|(k, theta)| orbit.radius(k, *theta))).collect()
    }

    /// Returns the expected counts per unit sample in each view of a gate; `None` if the sensitivity of the camera is unknown.
    pub(crate) fn expected_counts(&self, gate: usize) -> Option<Vec<f64>> {
        let counting = self.scene.counting.as_ref()?;
        let [bin, row] = self.camera.detector().pitch();
        let lasts = match self.mode() {
            Mode::Exposure { seconds } => seconds,
            _ => self.camera.interval(),
        };
        let of = |time: &ViewTime| counting.per_unit(bin * row, time, lasts);
        Some(self.view_times(gate).iter().map(of).collect())
    }
}
