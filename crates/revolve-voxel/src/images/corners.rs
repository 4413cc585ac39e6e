//! Corners of meridians: those that divide panels, and the error of quadrature across the others.

use crate::images::outline::largest_turn;
use crate::{Body, RevolveError, View};

/// Corners of a meridian divide panels if the sine of the turning angle exceeds the first number, or the second divided by the density of nodes.
/// Quadrature across a corner has an error of the turning angle over the square of the density, so that panels between the small corners of a
/// polyline of few vertices would need additional nodes at low densities.
const CORNER: [f64; 2] = [0.4, 0.8];
/// The first number for averages without a response, and with one that is narrow against the bins.
const SHARP_CORNER: f64 = 0.1;

impl View<'_> {
    /// Estimates the largest error of a sample by the corners of a body that do not divide panels, from its activity per cm^3 in each region: the sum
    /// over the layers of `s alpha |a| / (6 d^2)`, with alpha the sine of the largest turn of such a corner, a the difference of the activities
    /// inside and outside the layer, d the density, and s the narrowest standard deviation of the response, or for averages the pitch if that is
    /// narrow. Corners nearer to each other than `s / d` count in proportion to their distance.
    ///
    /// Nodes that are h apart have errors of at most `h^2 / 12` times the change of slope at a corner, 2 alpha a in line integrals, and the largest
    /// weight of a position is 0.4 / s; in the middle of a panel h is pi / 2 times s / d. Images of two densities differ by such errors only if the
    /// corners lie differently between the nodes. Attenuation by the body is not included.
    ///
    /// # Errors
    /// [`RevolveError::WrongLength`] or [`RevolveError::NotFinite`] for the activities.
    pub fn corner_error(&self, body: &Body, activity: &[f64]) -> Result<f64, RevolveError> {
        let weights = body.weights(activity)?;
        let scale = [0, 1].map(|axis| match self.is_narrow(axis) {
            true => self.axes[axis].pitch,
            false => self.response.extremes()[0],
        });
        let scale = scale[0].max(scale[1]);
        let turns = (body.layers().iter().zip(weights)).map(|(layer, weight)| {
            weight.abs() * largest_turn(layer, self.corner(), scale / self.density)
        });
        Ok(turns.sum::<f64>() * scale / (6.0 * self.density.powi(2)))
    }

    /// The sine of the smallest turn of a corner that divides panels.
    pub(super) fn corner(&self) -> f64 {
        match self.is_narrow(0) || self.is_narrow(1) {
            true => SHARP_CORNER,
            false => CORNER[0].min(CORNER[1] / self.density),
        }
    }
}
