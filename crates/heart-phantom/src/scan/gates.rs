//! The views of all gates together: a shape of the heart that several gates see is projected once.

use super::nodes::Node;
use super::project::{Aim, CENTRE};
use super::whole::Scan;
use crate::HeartShape;
use crate::error::PhantomError;
use crate::model::Placed;
use rayon::prelude::*;
use revolve_voxel::RayCounters;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Shapes, each with the gates that see it and for which share of their time.
pub(crate) struct SharedShapes {
    pub(crate) gains: Vec<f64>,
    pub(crate) uses: Vec<Vec<(usize, f64)>>,
}

impl SharedShapes {
    /// Those of some scans, one a gate; `None` if it takes more than how the heart beats to tell their views: they differ in more than
    /// their angle, depth blurs them, the heart is moved by breathing, or their shapes do not fit
    /// into the heart's memory together.
    pub(crate) fn of(scans: &[Scan<'_>]) -> Result<Option<Self>, PhantomError> {
        let mut by_gain: BTreeMap<u64, Vec<(usize, f64)>> = BTreeMap::new();
        for (gate, scan) in scans.iter().enumerate() {
            scan.acquisition.validate(scan.cycle, scan.camera)?;
            let alike = scan.acquisition.same_for_all_views(scan.cycle, scan.camera);
            if scan.depth.is_some() || scan.cycle.breathing().is_some() || !alike {
                return Ok(None);
            }
            for node in scan.quadrature().view(0).nodes {
                // All that there is to a point: another field would have to be equal, too.
                let Node {
                    gain,
                    breath: _,
                    share,
                    weights: [even, odd],
                } = node;
                if share != 0.0 {
                    return Ok(None);
                }
                let uses = by_gain.entry(gain.to_bits()).or_default();
                uses.push((gate, even + odd));
            }
        }
        let most = scans.first().map_or(0, |scan| scan.heart.most_shapes());
        Ok((by_gain.len() <= most).then(|| Self {
            gains: by_gain.keys().map(|bits| f64::from_bits(*bits)).collect(),
            uses: by_gain.into_values().collect(),
        }))
    }
}

/// Samples that are looked at together, whether a shape is in any of them.
const PIECE: usize = 64;

/// Adds a weighted copy to each of those gates; where a shape holds nothing the gates are not touched.
pub(crate) fn add_to_gates(one: &[f32], uses: &[(usize, f64)], gates: &mut [&mut [f32]]) {
    for (k, piece) in one.chunks(PIECE).enumerate() {
        if piece.iter().all(|value| *value == 0.0) {
            continue;
        }
        for &(gate, weight) in uses {
            let own = &mut gates[gate][k * PIECE..][..piece.len()];
            for (sum, value) in own.iter_mut().zip(piece) {
                *sum += (weight * f64::from(*value)) as f32;
            }
        }
    }
}

impl Scan<'_> {
    /// All rows of all views of the gates, `[gate][view][row][bin]`, before any blur.
    pub(crate) fn of_gates_into(
        &self,
        shared: &SharedShapes,
        samples: &mut [f32],
    ) -> Result<RayCounters, PhantomError> {
        self.activity.validate()?;
        let solved = self.heart.shapes(&shared.gains)?;
        let placed = self.placed(&solved)?;
        samples.fill(0.0);
        let n_views = self.camera.n_views();
        let mut views: Vec<Vec<&mut [f32]>> = (0..n_views).map(|_| Vec::new()).collect();
        for (k, view) in samples.chunks_mut(self.camera.view_len()).enumerate() {
            views[k % n_views].push(view);
        }
        let rays = (views.into_par_iter().enumerate())
            .map(|(view_idx, mut gates)| {
                self.view_of_gates(view_idx, (&solved, &placed), shared, &mut gates)
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(rays.into_iter().fold(RayCounters::default(), |a, b| a + b))
    }

    /// Adds one view, `[row][bin]`, to those of all gates.
    fn view_of_gates(
        &self,
        view_idx: usize,
        (solved, placed): (&[Arc<HeartShape>], &Placed),
        shared: &SharedShapes,
        gates: &mut [&mut [f32]],
    ) -> Result<RayCounters, PhantomError> {
        let aim = Aim {
            theta: self.camera.angle(view_idx, 0.0),
            planes: &[],
            rows: &(0..self.camera.n_rows()),
            places: CENTRE,
            mask: None,
        };
        let mut one = vec![0.0f32; self.camera.view_len()];
        let mut done = RayCounters::default();
        for (shape, uses) in solved.iter().zip(&shared.uses) {
            one.fill(0.0);
            let heart = (&**shape, shape.body(), placed.of(shape));
            done = done + self.project(heart, &aim, 1.0, &mut one)?;
            add_to_gates(&one, uses, gates);
        }
        if self.has_surroundings() {
            one.fill(0.0);
            self.project_surroundings(&aim, 1.0, &mut one)?;
            let all: Vec<(usize, f64)> = (0..gates.len()).map(|gate| (gate, 1.0)).collect();
            add_to_gates(&one, &all, gates);
        }
        for view in gates {
            self.no_negatives(view);
        }
        Ok(done)
    }
}
