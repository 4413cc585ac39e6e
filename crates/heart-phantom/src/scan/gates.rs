//! Ground truth of all gates together: a shape that several gates contain is voxelised once.

use super::view_error::PIECE;
use super::whole::Scan;
use crate::error::PhantomError;
use std::collections::BTreeMap;

/// Shapes, each with the gates that contain it and its fraction of their time.
pub(crate) struct SharedShapes {
    pub(crate) gains: Vec<f64>,
    pub(crate) uses: Vec<Vec<(usize, f64)>>,
}

impl SharedShapes {
    /// Collects the shapes of some scans, one per gate ([`Scan::states`]). Returns `None` if views differ in their states or the heart
    /// breathes; also if the shapes exceed the memory of the heart.
    pub(crate) fn of(scans: &[Scan<'_>], tolerance: f64) -> Result<Option<Self>, PhantomError> {
        let mut by_gain: BTreeMap<u64, Vec<(usize, f64)>> = BTreeMap::new();
        for (gate, scan) in scans.iter().enumerate() {
            let alike = scan.acquisition.same_for_all_views(scan.cycle, scan.camera);
            if scan.cycle.breathing().is_some() || !alike {
                return Ok(None);
            }
            for state in scan.states(tolerance)? {
                let uses = by_gain.entry(state.gain.to_bits()).or_default();
                uses.push((gate, state.share));
            }
        }
        let most = scans.first().map_or(0, |scan| scan.heart.most_shapes());
        Ok((by_gain.len() <= most).then(|| Self {
            gains: by_gain.keys().map(|bits| f64::from_bits(*bits)).collect(),
            uses: by_gain.into_values().collect(),
        }))
    }
}

/// Adds a weighted copy to each of these gates; skips pieces where the shape is zero.
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
