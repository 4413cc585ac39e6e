//! Reconstruction of one volume by OSEM from the projections of all gates with known motion.

use super::Phantom;
use super::method::{Osem, OsemReport};
use super::model_voxels::Model;
use super::osem::counted;
use crate::error::PhantomError;
use crate::{Observer, Rotation};
use radon::{MotionState, MovingOperator, Subset};

impl Phantom {
    /// The volume at end-diastole and end-expiration.
    pub(super) fn osem_of_gates(
        &self,
        osem: &Osem,
        views: &[f32],
        progress: Observer<'_, usize>,
    ) -> Result<(Vec<f32>, OsemReport), PhantomError> {
        let voxels = self.parts.model_voxels(osem, &self.radii()?)?;
        let n_models = match self.gates_share_model(osem) {
            true => 1,
            false => self.n_gates(),
        };
        let mut models: Vec<Model> = Vec::with_capacity(n_models);
        for gate in 0..n_models {
            let other = models.first();
            let other = other.filter(|_| self.camera().rotation() == Rotation::StepAndShoot);
            models.push(self.gate_model(osem, gate, &voxels, other)?);
        }
        let of_gate = |gate: usize| &models[gate.min(n_models - 1)];
        let warps = self.warps_of_gates(voxels.camera.grid())?;
        let weights = self.weights_of_views()?;
        let each = self.camera().n_views() * self.camera().view_len();
        let (mut views, mut background) = (counted(views), Vec::new());
        for (gate, weights) in weights.iter().enumerate() {
            weigh(&mut views[gate * each..][..each], weights);
            let mut scatter = self.background(osem, gate)?;
            weigh(&mut scatter, weights);
            background.append(&mut scatter);
        }
        let subset = |k: usize| {
            let (mut states, mut data) = (Vec::new(), Vec::new());
            for (gate, warps) in warps.iter().enumerate() {
                let subset = &of_gate(gate).subsets[k];
                let views = subset.operator().views().iter();
                states.push(MotionState {
                    warps: warps.clone(),
                    operator: subset.operator(),
                    weights: views.map(|view| weights[gate][*view]).collect(),
                });
                data.extend(subset.data().iter().map(|k| gate * each + k));
            }
            Ok(Subset::new(MovingOperator::new(states)?, data))
        };
        let subsets = (0..osem.subsets)
            .map(subset)
            .collect::<Result<Vec<_>, PhantomError>>()?;
        let (volume, report) = self.passes(osem, &subsets, (views, background), progress)?;
        Ok((voxels.cut(&volume, self.camera())?, report))
    }

    /// Weights of the views of each gate: expected counts where they are known, else acquisition times; normalised to a mean of 1.
    fn weights_of_views(&self) -> Result<Vec<Vec<f64>>, PhantomError> {
        let mut weights = Vec::new();
        for gate in 0..self.n_gates() {
            let times = self.view_times(gate)?;
            let seconds = || times.iter().map(|time| time.window).collect();
            weights.push(self.counts_per_unit(gate)?.unwrap_or_else(seconds));
        }
        let all = weights.iter().map(Vec::len).sum::<usize>() as f64;
        let mean = weights.iter().flatten().sum::<f64>() / all;
        // Instantaneous views have no duration.
        let normal = |weight: f64| if mean > 0.0 { weight / mean } else { 1.0 };
        for weight in weights.iter_mut().flatten() {
            *weight = normal(*weight);
        }
        Ok(weights)
    }
}

/// Multiplies each view by its weight.
fn weigh(views: &mut [f32], weights: &[f64]) {
    let len = (views.len() / weights.len()).max(1);
    for (view, weight) in views.chunks_mut(len).zip(weights) {
        view.iter_mut().for_each(|x| *x *= *weight as f32);
    }
}
