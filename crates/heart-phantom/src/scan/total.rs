//! What views add up to, and what that says of the quadrature over time.

use super::depth::Squares;
use super::nodes::Nodes;
use revolve_voxel::RayCounters;
use std::collections::BTreeSet;

/// So many samples, where they make up all of the difference between two rules, tell the error of the finer one to a factor of two.
const FEW: f64 = 5.0;
/// What views add up to.
#[derive(Default)]
pub(super) struct Total {
    pub(super) rays: RayCounters,
    pub(super) square: f64,
    pub(super) difference: f64,
    pub(super) fourth: f64,
    /// Lists of points, and the sum of their squared errors of the mean volume.
    plans: usize,
    volume: f64,
    averaged: bool,
    /// Sums over the views in which the error of the blur by depth was estimated.
    blurred: Option<Squares>,
    pub(super) phases: BTreeSet<u64>,
    pub(super) gains: BTreeSet<u64>,
}

impl Total {
    pub(super) fn plan(&mut self, plan: &Nodes) {
        self.plans += 1;
        self.volume += plan.volume_error.powi(2);
        self.averaged |= plan.nodes.len() > 1 || plan.nodes.iter().any(|n| n.weights[1] != 0.0);
        self.phases
            .extend(plan.phases.iter().map(|phase| phase.to_bits()));
        self.gains.extend(plan.gains().map(f64::to_bits));
    }

    pub(super) fn blur(&mut self, view: Option<Squares>) {
        if let Some([error, all]) = view {
            let [errors, alls] = self.blurred.get_or_insert_default();
            *errors += error;
            *alls += all;
        }
    }

    pub(super) fn depth_error(&self) -> Option<f64> {
        let [error, all] = self.blurred?;
        Some(if all > 0.0 { (error / all).sqrt() } else { 0.0 })
    }

    pub(super) fn quadrature_error(&self) -> Option<f64> {
        if !self.averaged {
            return None;
        }
        let volume = (self.volume / self.plans as f64).sqrt();
        // Of one sample that is all of the difference 1, of n equal ones 1 / n.
        let few = self.fourth / self.difference.powi(2);
        Some(if self.square == 0.0 {
            0.0
        } else if self.difference > 0.0 {
            ((1.0 + FEW * few) * (self.difference / self.square).sqrt()).max(volume)
        } else {
            volume
        })
    }
}
