//! Reconstruction of one volume by OSEM from the projections of all gates with known motion.

use super::Phantom;
use super::method::{Osem, OsemReport};
use super::model_voxels::farthest;
use super::osem::{counted, in_turns};
use crate::Rotation;
use crate::error::PhantomError;
use radon::{MovingOperator, SpectOperator, State, Subset};

/// The states of a subset, and the indices of their data.
type Part = (Vec<State<SpectOperator<f32>>>, Vec<usize>);

impl Phantom {
    /// The volume at end-diastole and end-expiration.
    pub(super) fn osem_of_gates(
        &self,
        osem: &Osem,
        views: &[f32],
        progress: &dyn Fn(usize),
    ) -> Result<(Vec<f32>, OsemReport), PhantomError> {
        let parts = self.parts();
        let voxels = parts.model_voxels(osem, farthest(&self.radii()?))?;
        let grid = voxels.camera.grid();
        // All gates share a model whose attenuation does not move.
        let torso = parts
            .attenuation
            .is_some_and(|attenuation| attenuation.torso().is_some());
        let alike = self.camera().rotation() == Rotation::StepAndShoot;
        let alike = alike && (torso || !osem.attenuation);
        let weights = self.weights_of_views()?;
        let each = self.camera().n_views() * self.camera().view_len();
        let mut views = counted(views);
        let mut background = Vec::new();
        let mut shared: Option<SpectOperator<f32>> = None;
        let mut parts: Vec<Part> = (0..osem.subsets).map(|_| Part::default()).collect();
        for (gate, warps) in self.warps_of_gates(grid)?.into_iter().enumerate() {
            let model = match shared.take().filter(|_| alike) {
                Some(model) => model,
                None => {
                    let map = match osem.attenuation {
                        true => self.mean_attenuation(gate, &voxels.camera)?,
                        false => Vec::new(),
                    };
                    self.model(osem, gate, &voxels, map)?
                }
            };
            let subsets = in_turns(model.subsets(osem.subsets)?);
            for ((states, all), subset) in parts.iter_mut().zip(subsets) {
                let of_view = |view: &usize| weights[gate][*view];
                let (operator, data) = subset.into_parts();
                states.push(State {
                    warps: warps.clone(),
                    weights: operator.views().iter().map(of_view).collect(),
                    operator,
                });
                all.extend(data.into_iter().map(|k| gate * each + k));
            }
            shared = Some(model);
            let mut scatter = self.background(osem, gate)?;
            let own = views[gate * each..][..each].chunks_mut(self.camera().view_len());
            for (view, weight) in own.zip(&weights[gate]) {
                view.iter_mut().for_each(|x| *x *= *weight as f32);
            }
            let own = scatter.chunks_mut(self.camera().view_len());
            for (view, weight) in own.zip(&weights[gate]) {
                view.iter_mut().for_each(|x| *x *= *weight as f32);
            }
            background.append(&mut scatter);
        }
        let subset = |(states, data)| Ok(Subset::new(MovingOperator::new(states)?, data));
        let subsets = parts
            .into_iter()
            .map(subset)
            .collect::<Result<Vec<_>, PhantomError>>()?;
        let (volume, report) = self.passes(osem, &subsets, (views, background), progress)?;
        Ok((voxels.cut(&volume, self.camera()), report))
    }

    /// Weights of the views of each gate: expected counts where they are known, else acquisition times; normalised to a mean of 1.
    fn weights_of_views(&self) -> Result<Vec<Vec<f64>>, PhantomError> {
        let mut weights = Vec::new();
        for gate in 0..self.n_gates() {
            let seconds = || -> Result<Vec<f64>, PhantomError> {
                Ok(self
                    .view_times(gate)?
                    .iter()
                    .map(|time| time.window)
                    .collect())
            };
            weights.push(match self.counts_per_unit(gate)? {
                Some(counts) => counts,
                None => seconds()?,
            });
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
