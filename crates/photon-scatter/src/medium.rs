//! Sources and attenuating media: traits that a user implements.

use crate::Random;
use crate::error::{ScatterError, valid};

/// A point of emission, drawn from an activity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// Position in cm.
    pub position: [f64; 3],
    /// Weight: activity per cm^3 over the probability per cm^3 of this position. Constant and equal to the total activity where positions are
    /// distributed as the activity is.
    pub weight: f64,
}

/// A distribution of activity.
pub trait Source: Sync {
    /// Draws a point of emission.
    fn emit(&self, random: &mut Random) -> Emission;
}

/// A stretch of a ray, `position + t direction`, with the density of the medium there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its start, t in cm.
    pub enter: f64,
    /// Its end.
    pub exit: f64,
    /// Density in g/cm^3 of water that attenuates as the medium does.
    pub density: f64,
}

/// A scattering medium: water of a density that is constant along stretches of any ray.
pub trait Medium: Sync {
    /// Appends the stretches of a ray in their order. They do not overlap; those at t < 0 are ignored. `direction` is a unit vector.
    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>);
}

/// Stretches of one ray ahead of a position.
#[derive(Debug, Default)]
pub(crate) struct Path(Vec<Piece>);

impl Path {
    /// Follows a ray and returns the column density ahead in g/cm^2.
    pub(crate) fn follow(
        &mut self,
        medium: &dyn Medium,
        position: [f64; 3],
        direction: [f64; 3],
    ) -> Result<f64, ScatterError> {
        self.0.clear();
        medium.pieces(position, direction, &mut self.0);
        let column = (self.0.iter())
            .map(|piece| piece.density * (piece.exit - piece.enter.max(0.0)).max(0.0))
            .sum();
        valid("column density of a path", column)
    }

    /// Returns the distance at which a column density is reached.
    pub(crate) fn distance(&self, column: f64) -> f64 {
        let (mut left, mut last) = (column, 0.0);
        for piece in &self.0 {
            let length = piece.exit - piece.enter.max(0.0);
            if length <= 0.0 || piece.density <= 0.0 {
                continue;
            }
            let here = piece.density * length;
            if left <= here {
                return piece.enter.max(0.0) + left / piece.density;
            }
            left -= here;
            last = piece.exit;
        }
        // The distance exceeds the end of the path by rounding.
        last
    }
}
