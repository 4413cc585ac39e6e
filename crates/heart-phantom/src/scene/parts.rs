//! The objects that a scene describes.

use super::Scene;
use crate::model::{Attenuation, Background};
use crate::scan::{Collimation, Mode, STEPS};
use crate::{Camera, Cycle, Heart, MaterialPoint, Twist, ViewTime};
use radon::FbpOptions;
use revolve_voxel::Organs;

/// A scene with the objects that its sections describe. Every other parameter is read from the scene itself.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    pub(crate) scene: Scene,
    /// Whether the heart was given instead of the sections `[heart]` and `[pose]`.
    pub(crate) own_heart: bool,
    pub(crate) heart: Heart,
    pub(crate) cycle: Cycle,
    pub(crate) camera: Camera,
    pub(crate) background: Option<Background>,
    pub(crate) organs: Option<Organs>,
    pub(crate) twist: Option<Twist>,
    pub(crate) points: Vec<MaterialPoint>,
    /// That of the scene, or of soft tissue in a chest.
    pub(crate) attenuation: Option<Attenuation>,
    pub(crate) collimator: Option<Collimation>,
    pub(crate) reconstruction: FbpOptions,
    /// Material coordinate, above 0 (the base) and below 1/2 (the apex), at which thickness and blur of the wall are reported.
    pub(crate) side: f64,
}

impl Parts {
    pub(crate) fn mode(&self) -> Mode {
        self.scene.acquisition.mode
    }

    /// The number of gated projection sets: cardiac gates times respiratory gates.
    pub(crate) fn n_gates(&self) -> usize {
        self.mode().n_gates() * self.cycle.breath_gates()
    }

    /// The cycle, once for each respiratory gate.
    pub(crate) fn cycles(&self) -> Vec<Cycle> {
        (0..self.cycle.breath_gates())
            .map(|gate| self.cycle.clone().in_breath_gate(gate))
            .collect()
    }

    /// Times and angles of the views of a gate.
    pub(crate) fn view_times(&self, gate: usize) -> Vec<ViewTime> {
        let gates = self.mode().n_gates();
        let acquisition = self.mode().acquisition(gate % gates, STEPS[0]);
        let cycle = self.cycle.clone().in_breath_gate(gate / gates);
        (0..self.camera.n_views())
            .map(|view_idx| acquisition.view_time(&cycle, &self.camera, view_idx))
            .collect()
    }

    /// Distance of the collimator's face from the axis in each view; `None` if it follows the contour of the body.
    pub(crate) fn nominal_radii(&self) -> Option<Vec<f64>> {
        let angles = self.camera.geometry().angles().iter().enumerate();
        let orbit = &self.scene.camera.radius;
        (angles.map(|(k, theta)| orbit.radius(k, *theta))).collect()
    }

    /// Expected counts of a sample of 1 in each view of a gate; `None` if the sensitivity of the camera is not given.
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
