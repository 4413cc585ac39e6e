//! Sums over the gates that contain a shape.

use super::view_error::PIECE;

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
