//! A discretised membrane to be solved under any control.

use std::sync::Arc;

use membrane_forces::{FiniteDifferences, Measures, Membrane};

use crate::constraint::{Control, POSITIVE, check};
use crate::equilibrium::Equilibrium;
use crate::error::{NewtonError, Result};
use crate::nested::Nested;
use crate::options::NewtonOptions;
use crate::report::NewtonReport;
use crate::resolution::Resolution;

/// The discretisation of the curve.
///
/// The errors of spectral elements reach rounding where reference configuration and stiffness are smooth between their breakpoints: degree
/// 14 for a balloon of springs with constant stiffness. Rubber needs more: for a balloon (8.5, 1.75) of neo-Hookean rubber at 1.2 times the
/// volume, intensity and shape (relative to the length) have errors of 2e-7 and 2e-6 at degree 14, 3e-8 and 4e-7 at degree 16, 1e-13 and 4e-10 at
/// degree 20 with two elements per piece. Use adaptive elements for other membranes. Finite differences are those of the paper, of second
/// order; they need no breakpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[non_exhaustive]
pub enum Discretisation {
    /// Second-order finite differences, as in the paper.
    FiniteDifferences {
        /// Number of nodes N, fixed ends included.
        nodes: usize,
    },
    /// Spectral elements: polynomials of this degree, this many elements on each smooth piece.
    Spectral {
        /// Degree p of the polynomials.
        degree: usize,
        /// Elements on each smooth piece.
        per_piece: usize,
    },
    /// Spectral elements whose degree is raised, and which are then split, until twice the degree times the last two coefficients of the
    /// solved curve is at most this fraction of its length: the error of the shape. That of a small intensity is larger
    /// ([`Equilibrium::discretisation_error`]).
    SpectralAdaptive {
        /// Relative tolerance, for instance 1e-12.
        tolerance: f64,
    },
}

/// A discretised membrane: immutable, cheap to clone, shared by threads.
///
/// Solves need a few hundred bytes per node of finite differences, and for each element of degree p some p^2 numbers; the process ends if the
/// system does not provide them. They take microseconds to milliseconds, except with very many nodes, and cannot be cancelled.
///
/// ```
/// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Solver};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?);
/// let solver = Solver::new(&membrane, Discretisation::Spectral { degree: 16, per_piece: 1 })?;
/// let dilated = solver.solve(Control::VolumeGain(0.6), &NewtonOptions::default())?;
/// assert!((dilated.intensity - 17.48357527761).abs() < 1e-10);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solver {
    pub(crate) resolution: Arc<Resolution>,
}

impl Solver {
    /// Discretises `membrane`.
    ///
    /// # Errors
    /// Too few nodes or too low a degree, a stiffness that is not positive, coinciding nodes, a reference configuration that no polynomials
    /// resolve, or whose volume overflows.
    pub fn new(membrane: &Membrane, discretisation: Discretisation) -> Result<Self> {
        let resolution = match discretisation {
            Discretisation::FiniteDifferences { nodes } => {
                let differences = FiniteDifferences::half(membrane, nodes)?;
                Arc::new(Resolution::new(differences, None)?)
            }
            Discretisation::Spectral { degree, per_piece } => {
                Arc::new(Resolution::spectral(membrane, degree, per_piece)?)
            }
            Discretisation::SpectralAdaptive { tolerance } => {
                check("tolerance", tolerance, POSITIVE)?;
                Resolution::adaptive(membrane, tolerance)?
            }
        };
        Ok(Self { resolution })
    }

    /// Returns the measures of the start: the reference configuration with its ends fixed.
    #[must_use]
    pub fn start_measures(&self) -> Measures {
        self.resolution.start
    }

    /// Returns the start as an equilibrium without load (exact if the ends are fixed in the reference configuration).
    #[must_use]
    pub fn start(&self) -> Equilibrium {
        self.resolution
            .equilibrium(self.resolution.start_state(), NewtonReport::default())
    }

    /// Solves from the start for a value of the control.
    ///
    /// Several equilibria may have the same control. The result is the one that a rising control reaches from the start, up to the first
    /// limit point; beyond it the result is an error.
    ///
    /// # Errors
    /// Of [`NewtonError`](crate::NewtonError): `LimitPoint`, the branch ends before it; `Membrane` with
    /// `OutOfRange`, a control out of range, or [`PastBlowUp`](membrane_forces::MembraneError::PastBlowUp), a pressure per current length with no equilibrium; `Unresolved`,
    /// polynomials that do not converge; `Slack`, `Collapsed`; `OtherBranch`, `NotConverged`.
    pub fn solve(&self, control: Control, options: &NewtonOptions) -> Result<Equilibrium> {
        if let Some(opposite) = self.resolution.opposite(control) {
            return mirrored(self.solve(opposite, options));
        }
        let start = self.resolution.start_state();
        solve_one((self.resolution.clone(), start), &[], control, options)
    }

    /// Solves from a nearby equilibrium (warm start) of the same membrane in any discretisation. The result is on its branch, also past a limit
    /// point. An equilibrium of another membrane is not rejected: its curve, with the ends of this membrane, is the initial value of Newton's
    /// method, and the branch of the result is not determined.
    ///
    /// ```
    /// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Rubber, Solver, StrainEnergy, Thickness};
    /// let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT)?;
    /// let disc = Membrane::new(ReferenceShape::disc(1.0)?).with_rubber(rubber);
    /// let solver = Solver::new(&disc, Discretisation::Spectral { degree: 16, per_piece: 1 })?;
    /// // p(V), also past the maximum of the pressure
    /// let mut solved = solver.solve(Control::Volume(1.0), &NewtonOptions::default())?;
    /// assert!(solved.sensitivity(Control::Volume(1.0))?.intensity > 0.0);
    /// for volume in [2.0, 3.0, 4.0].map(Control::Volume) {
    ///     solved = solver.solve_from(&solved, volume, &NewtonOptions::default())?;
    /// }
    /// assert!(solved.sensitivity(Control::Volume(4.0))?.intensity < 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve_from(
        &self,
        near: &Equilibrium,
        control: Control,
        options: &NewtonOptions,
    ) -> Result<Equilibrium> {
        if near.measures.volume.abs() < near.resolution.smallest_volume() {
            // a state without relevant strains, next to the start
            return self.solve(control, options);
        }
        if self.resolution.is_slack_sheet() {
            let wanted = self.resolution.constraint(control)?.value;
            if near.measures.volume.signum() * wanted < 0.0 {
                // the branch leads through the start
                return self.solve(control, options);
            }
            if let Some(opposite) = self.resolution.opposite(control) {
                return mirrored(self.solve_from(&near.mirrored(), opposite, options));
            }
        }
        solve_one(self.resolution.state_near(near), &[near], control, options)
    }
}

/// The solution of the opposite control for a flat sheet.
fn mirrored(solved: Result<Equilibrium>) -> Result<Equilibrium> {
    let solved = solved.map_err(NewtonError::opposite)?;
    Ok(solved.mirrored())
}

fn solve_one(
    (resolution, start): (Arc<Resolution>, Vec<f64>),
    near: &[&Equilibrium],
    control: Control,
    options: &NewtonOptions,
) -> Result<Equilibrium> {
    let nested = Nested(vec![resolution]);
    let (nested, state, report) = nested.solve(start, near, control, options)?;
    nested.0[0].answer(state, report)
}
