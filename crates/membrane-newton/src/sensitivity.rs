//! The derivative of an equilibrium by its control.

use crate::constraint::Control;
use crate::equilibrium::Equilibrium;
use crate::error::{Result, own};
use crate::nested::Nested;
use crate::resolution::Resolution;

/// Derivative of an equilibrium by the value of a control (per unit of that value).
#[doc(alias = "compliance", alias = "tangent stiffness")]
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// d[x, y] at the nodes of [`Equilibrium::points`].
    pub points: Vec<[f64; 2]>,
    /// d intensity.
    pub intensity: f64,
}

impl Equilibrium {
    /// Derivative of shape and intensity by the value of `control`: one factorisation of the bordered system at the solution and one solve,
    /// without Newton iterations. The value of `control` is not used, apart from the check of its range: the derivative is that at the solution.
    ///
    /// The last factorisation of the solve is not used: it belongs to the state before the last step, and `control` may differ from that of the
    /// solve. The new one costs a quarter of a solve.
    ///
    /// ```
    /// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Solver};
    /// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
    /// let solver = Solver::new(&membrane, Discretisation::Spectral { degree: 12, per_piece: 1 })?;
    /// let options = NewtonOptions::default();
    /// let here = solver.solve(Control::VolumeGain(0.6), &options)?;
    /// let there = solver.solve_from(&here, Control::VolumeGain(0.6001), &options)?;
    /// let slope = here.sensitivity(Control::VolumeGain(0.6))?.intensity;
    /// assert!(((there.intensity - here.intensity) / 1e-4 / slope - 1.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A control out of range; a singular tangent (the control is at a limit point).
    pub fn sensitivity(&self, control: Control) -> Result<Sensitivity> {
        let nested = Nested(vec![self.resolution.clone()]);
        let rate = nested.rate(&self.state, control)?;
        Ok(self.resolution.sensitivity(&rate))
    }
}

impl Resolution {
    /// Returns the derivative of the border equation by the value of `control`.
    pub(crate) fn constraint_slope(&self, control: Control) -> f64 {
        match control {
            Control::VolumeGain(_) => self.start.volume,
            _ => 1.0,
        }
    }

    /// Converts the change of a state.
    pub(crate) fn sensitivity(&self, change: &[f64]) -> Sensitivity {
        let last = change.len() - 1;
        Sensitivity {
            points: own(self.discrete.points(&change[..last])),
            intensity: change[last],
        }
    }
}
