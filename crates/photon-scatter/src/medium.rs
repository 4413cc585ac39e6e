//! Sources and attenuating media: traits that a user implements, ready ones in `voxels`.

use crate::camera::Grid;
use crate::error::{ScatterError, valid, within};
use crate::{Camera, Random};

/// A point of emission, drawn from an activity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// Position in cm.
    pub position: [f64; 3],
    /// Weight: activity per cm^3 over the probability per cm^3 of this position. Constant and equal to the total activity where positions are
    /// distributed as the activity is. The mean is from 1e-100 to 1e100.
    pub weight: f64,
}

/// A distribution of activity: [`PointSource`](crate::PointSource), [`VoxelSource`](crate::VoxelSource) or another.
pub trait Source: Sync {
    /// Draws a point of emission.
    fn emit(&self, random: &mut Random) -> Emission;

    /// Whether there is no activity, so that scatter is 0 without an error; `false` unless implemented. If the first 65 536 weights of another source
    /// are 0, [`Scatter::new`](crate::Scatter::new) returns an error.
    fn is_empty(&self) -> bool {
        false
    }
}

/// A stretch of a ray, `position + t direction`, with the density of the medium there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Its start, t in cm.
    pub enter: f64,
    /// Its end, at least [`enter`](Self::enter).
    pub exit: f64,
    /// Density in g/cm^3, 0 to 30, of water that attenuates as the medium does: 1 for water. It is not the attenuation coefficient `mu` in 1/cm
    /// but `mu / water_attenuation(energy)?`, with [`water_attenuation`](crate::water_attenuation) at the energy in keV of `mu`.
    pub density: f64,
}

/// Largest density in g/cm^3: above that of any element.
pub(crate) const DENSEST: f64 = 30.0;
/// Rounding errors of the ends of pieces in cm.
const OVERLAP: f64 = 1e-6;
/// Ratio of densities at which a scatterer begins.
const GAP: f64 = 0.125;

/// A scattering medium: water of a density that is constant along stretches of any ray; [`VoxelMedium`](crate::VoxelMedium) or another.
pub trait Medium: Sync {
    /// Appends the stretches of a ray in their order. They do not overlap by more than 1e-6 cm; those at t < 0 are ignored. `direction` is a
    /// unit vector. [`Scatter::new`](crate::Scatter::new) checks the pieces of every ray that it traces.
    fn pieces(&self, position: [f64; 3], direction: [f64; 3], pieces: &mut Vec<Piece>);

    /// Whether no ray has a density, so that scatter is 0 without an error; `false` unless implemented. The standard error of another medium that no
    /// history meets is the contribution of one photon.
    fn is_empty(&self) -> bool {
        false
    }
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
        let (mut column, mut last) = (0.0, f64::MIN);
        for piece in &self.0 {
            let (enter, exit, density) = (piece.enter, piece.exit, piece.density);
            within("start of a piece in cm", enter, [last - OVERLAP, f64::MAX])?;
            within("end of a piece in cm", exit, [enter, f64::MAX])?;
            within("density of a piece in g/cm^3", density, [0.0, DENSEST])?;
            column += density * (exit - enter.max(0.0)).max(0.0);
            last = exit;
        }
        valid("column density of a path", column)
    }

    /// Returns the distance at which the medium ends.
    pub(crate) fn end(&self) -> f64 {
        let pieces = self.0.iter().filter(|piece| piece.density > 0.0);
        pieces.fold(0.0, |end: f64, piece| end.max(piece.exit))
    }

    /// Returns the distance at which a column density is reached, the density there, and the part of the column density in that scatterer.
    pub(crate) fn reach(&self, column: f64) -> [f64; 3] {
        let (mut left, mut inside, mut at) = (column, 0.0, [0.0; 3]);
        let (mut end, mut before) = (0.0, 0.0);
        for piece in &self.0 {
            let (start, density) = (piece.enter.max(0.0), piece.density);
            let here = density * (piece.exit - start);
            if here <= 0.0 {
                continue;
            }
            if start > end + OVERLAP || before < GAP * density {
                inside = 0.0;
            }
            // The distance exceeds the end of the path by rounding.
            let part = left.min(here);
            inside += part;
            at = [start + part / density, density, inside];
            if left <= here {
                break;
            }
            (left, end, before) = (left - here, piece.exit, density);
        }
        at
    }
}

/// `Ok` if the medium ends in front of the face of every view, on the line through the axis of rotation.
pub(crate) fn in_front(
    medium: &dyn Medium,
    camera: &Camera,
    grid: &Grid,
) -> Result<(), ScatterError> {
    let mut path = Path::default();
    for (view, direction) in camera.views().iter().zip(grid.directions()) {
        path.follow(medium, [0.0; 3], direction)?;
        // Less by rounding errors.
        let end = (1.0 - 1e-9) * path.end();
        let what = "radius of a view in cm, which is beyond the medium,";
        within(what, view.radius, [end, f64::MAX])?;
    }
    Ok(())
}
