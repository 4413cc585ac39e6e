//! A solved membrane: its shape, load and measures.

use std::sync::Arc;

use membrane_forces::{CurvePiece, CurvePoint, Measures, Membrane, RubberState, collapse};

use crate::constraint::check;
use crate::error::{NewtonError, Result, own};
use crate::limit::SLACK;
use crate::report::NewtonReport;
use crate::resolution::Resolution;

/// A solved membrane.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Force intensity f or p.
    pub intensity: f64,
    /// Load under the membrane's law: the intensity, or the total force.
    pub load: f64,
    /// Length, area, surface and volume, each to the accuracy of the discretisation.
    pub measures: Measures,
    /// Report of the solve.
    pub report: NewtonReport,
    pub(crate) resolution: Arc<Resolution>,
    /// Unknown nodes, then the force intensity.
    pub(crate) state: Vec<f64>,
}

/// Compares membranes, loads, measures, reports and the numbers of the state. Discretisations are not compared.
impl PartialEq for Equilibrium {
    fn eq(&self, other: &Self) -> bool {
        self.state == other.state
            && (self.intensity, self.load, self.measures)
                == (other.intensity, other.load, other.measures)
            && self.report == other.report
            && self.membrane() == other.membrane()
    }
}

impl Equilibrium {
    pub(crate) fn nodes(&self) -> &[f64] {
        &self.state[..self.state.len() - 1]
    }

    /// Pressure across the membrane (inside minus outside), force per current area, in the unit of the stiffness. Under the law per current
    /// length it is p; the other laws distribute the force evenly over the material, and the pressure is the average over the curve,
    /// intensity over current length.
    ///
    /// With the stiffness lambda (for rubber the modulus) in kPa it is in kPa. f is then in kPa cm and F = f S in kPa cm^3, S the lateral
    /// surface; the average is f / L with the current length L.
    ///
    /// ```
    /// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, PressureLaw, ReferenceShape, Solver};
    /// let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?); // stiffness 1
    /// let spectral = Discretisation::Spectral { degree: 16, per_piece: 1 };
    /// let options = NewtonOptions::default();
    /// let by_material = Solver::new(&balloon, spectral)?.solve(Control::VolumeGain(0.6), &options)?;
    /// let by_area = Solver::new(&balloon.with_law(PressureLaw::PerCurrentLength), spectral)?;
    /// let by_area = by_area.solve(Control::VolumeGain(0.6), &options)?;
    /// assert!((by_material.pressure() - 0.717148).abs() < 1e-6);
    /// assert!((by_area.pressure() - 0.716189).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn pressure(&self) -> f64 {
        let law = self.resolution.discrete.law();
        law.mean_pressure(self.intensity, self.measures.length)
    }

    /// Elastic energy above that of the start: of rubber in the unit of the modulus times cm^3, of springs (2-D) in that of the stiffness times
    /// cm^2; to the accuracy of the discretisation.
    ///
    /// Rubber and springs under [`PressureLaw::PerCurrentLength`](crate::PressureLaw) do the work p dV and p dA on the way between two
    /// equilibria, with the area A of [`Measures`].
    #[must_use]
    pub fn elastic_energy(&self) -> f64 {
        own(self.resolution.discrete.elastic_energy(self.nodes()))
    }

    /// Stretches, tensions and stresses of rubber at material coordinate `s`, clamped to [0, 1].
    ///
    /// ```
    /// use membrane_newton::{Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Solver};
    /// use membrane_newton::{Rubber, StrainEnergy, Thickness};
    /// let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT)?;
    /// let disc = Membrane::new(ReferenceShape::disc(1.0)?).with_rubber(rubber);
    /// let solver = Solver::new(&disc, Discretisation::Spectral { degree: 24, per_piece: 1 })?;
    /// let blown = solver.solve(Control::Volume(1.19181877167), &NewtonOptions::default())?;
    /// let apex = blown.rubber_state(0.5)?;
    /// assert!((blown.intensity - 1.30986814766).abs() < 1e-10);
    /// assert!((apex.stretches[0] - 1.3).abs() < 1e-8 && apex.stretches[0] == apex.stretches[1]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A membrane of springs; a coordinate that is NaN.
    pub fn rubber_state(&self, s: f64) -> Result<RubberState> {
        let s = check("material coordinate", s.clamp(0.0, 1.0), f64::MIN)?;
        Ok(self.membrane().rubber_state(s, &self.at(s))?)
    }

    /// The membrane.
    #[must_use]
    pub fn membrane(&self) -> &Membrane {
        self.resolution.discrete.setting().membrane()
    }

    /// Nodes [x, y] of the discretisation from s = 0 to s = 1, cm.
    #[must_use]
    pub fn points(&self) -> Vec<[f64; 2]> {
        own(self.resolution.discrete.points(self.nodes()))
    }

    /// Material coordinates of [`Equilibrium::points`].
    #[must_use]
    pub fn positions(&self) -> Vec<f64> {
        self.resolution.discrete.positions()
    }

    /// The whole curve as polynomials, s from 0 to 1; empty with finite differences.
    #[must_use]
    pub fn pieces(&self) -> Vec<CurvePiece> {
        own(self.resolution.discrete.pieces(self.nodes()))
    }

    /// The curve at material coordinate `s`, clamped to [0, 1]: the polynomials, or with finite differences the reference configuration
    /// plus a cubic Hermite interpolant of the displacement, with the accuracy of the nodes. In the cells next to a jump of the stiffness,
    /// where c' jumps, tangent and curvature are averages of both sides. Cost O(degree^2), or O(1).
    #[must_use]
    pub fn at(&self, s: f64) -> CurvePoint {
        own(self.resolution.discrete.at(self.nodes(), s))
    }
}

impl Resolution {
    /// Returns the state on `curve`, which may have another resolution.
    pub(crate) fn state_near(self: &Arc<Self>, curve: &Equilibrium) -> (Arc<Self>, Vec<f64>) {
        let mut resolution = Some(self.clone());
        while let Some(here) = resolution {
            if Arc::ptr_eq(&here, &curve.resolution) {
                return (here, curve.state.clone());
            }
            resolution = here.made_finer();
        }
        (self.clone(), self.carry(&curve.resolution, &curve.state))
    }

    /// Returns the curve of `near`, or the start.
    pub(crate) fn start_near(&self, near: Option<&Equilibrium>) -> Vec<f64> {
        let carried = near.map(|near| self.carry(&near.resolution, &near.state));
        carried.unwrap_or_else(|| self.start_state())
    }

    /// Returns the equilibrium of a solve, unless its measures overflow.
    pub(crate) fn answer(
        self: &Arc<Self>,
        state: Vec<f64>,
        report: NewtonReport,
    ) -> Result<Equilibrium> {
        let solved = self.equilibrium(state, report);
        solved.measures.finite()?;
        let tension = self.discrete.least_tension(solved.nodes())?;
        if tension < -SLACK {
            return Err(NewtonError::Slack { tension });
        }
        let start = own(self.discrete.points(self.discrete.start()));
        if let Some(node) = collapse(&start, &solved.points(), &mut Vec::new()) {
            let s = solved.positions()[node];
            return Err(NewtonError::Collapsed { s });
        }
        // A total force is the intensity times the surface.
        check("load", solved.load, f64::MIN)?;
        Ok(solved)
    }

    pub(crate) fn equilibrium(
        self: &Arc<Self>,
        state: Vec<f64>,
        report: NewtonReport,
    ) -> Equilibrium {
        let (nodes, intensity) = (&state[..state.len() - 1], state[state.len() - 1]);
        let measures = own(self.discrete.measures(nodes));
        let load = match self.discrete.law().is_total_force() {
            true => intensity * measures.surface,
            false => intensity,
        };
        Equilibrium {
            intensity,
            load,
            measures,
            report,
            resolution: self.clone(),
            state,
        }
    }
}
