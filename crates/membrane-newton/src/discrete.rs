//! The two discretisations behind one face, and the factorisation that goes with each.

use membrane_forces::{
    BandMatrix, CurvePiece, FiniteDifferences, Measure, Measures, MembraneError, PressureLaw,
    SpectralElements,
};

use crate::banded::BandedLu;
use crate::error::NewtonError;
use crate::factors::CondensedLu;
use crate::turning::{turned, turning};

#[derive(Debug, Clone)]
pub(crate) enum Discrete {
    Differences(FiniteDifferences),
    Spectral(SpectralElements),
}

impl Discrete {
    pub(crate) fn start(&self) -> &[f64] {
        match self {
            Self::Differences(d) => d.start(),
            Self::Spectral(s) => s.start(),
        }
    }

    pub(crate) fn law(&self) -> PressureLaw {
        match self {
            Self::Differences(d) => d.law(),
            Self::Spectral(s) => s.law(),
        }
    }

    pub(crate) fn stiffness_scale(&self) -> f64 {
        match self {
            Self::Differences(d) => d.stiffness_scale(),
            Self::Spectral(s) => s.stiffness_scale(),
        }
    }

    pub(crate) fn blow_up(&self) -> f64 {
        match self {
            Self::Differences(d) => d.blow_up(),
            Self::Spectral(s) => s.blow_up(),
        }
    }

    pub(crate) fn elastic_force_into(&self, nodes: &[f64], out: &mut [f64]) {
        match self {
            Self::Differences(d) => d.elastic_force_into(nodes, out),
            Self::Spectral(s) => s.elastic_force_into(nodes, out),
        }
    }

    pub(crate) fn pressure_force_into(
        &self,
        nodes: &[f64],
        intensity: f64,
        out: &mut [f64],
    ) -> Result<(), MembraneError> {
        match self {
            Self::Differences(d) => d.pressure_force_into(nodes, intensity, out),
            Self::Spectral(s) => s.pressure_force_into(nodes, intensity, out),
        }
    }

    pub(crate) fn measure(&self, measure: Measure, nodes: &[f64]) -> f64 {
        match self {
            Self::Differences(d) => own(d.measure(measure, nodes)),
            Self::Spectral(s) => own(s.measure(measure, nodes)),
        }
    }

    pub(crate) fn measure_gradient_into(&self, measure: Measure, nodes: &[f64], out: &mut [f64]) {
        match self {
            Self::Differences(d) => d.measure_gradient_into(measure, nodes, out),
            Self::Spectral(s) => {
                s.measure_gradient_into(measure, nodes, out);
            }
        }
    }

    pub(crate) fn measures(&self, nodes: &[f64]) -> Measures {
        match self {
            Self::Differences(d) => own(d.measures(nodes)),
            Self::Spectral(s) => own(s.measures(nodes)),
        }
    }

    pub(crate) fn positions(&self) -> Vec<f64> {
        match self {
            Self::Differences(d) => {
                let last = d.n_nodes() - 1;
                (0..=last).map(|n| n as f64 / last as f64).collect()
            }
            Self::Spectral(s) => s.positions(),
        }
    }

    pub(crate) fn points(&self, nodes: &[f64]) -> Vec<[f64; 2]> {
        match self {
            Self::Differences(d) => own(d.points(nodes)),
            Self::Spectral(s) => own(s.points(nodes)),
        }
    }

    /// Whether the x and the y of the first and of the last node of the state are held.
    pub(crate) fn held(&self) -> [[bool; 2]; 2] {
        match self {
            Self::Differences(d) => d.held(),
            Self::Spectral(s) => s.held(),
        }
    }

    /// Puts held coordinates where they are held.
    pub(crate) fn hold(&self, nodes: &mut [f64]) {
        let (start, last) = (self.start(), nodes.len() - 2);
        let [first, end] = self.held();
        for k in 0..2 {
            if first[k] {
                nodes[k] = start[k];
            }
            if end[k] {
                nodes[last + k] = start[last + k];
            }
        }
    }

    /// State that follows the curve of `pieces`.
    pub(crate) fn sample(&self, pieces: &[CurvePiece]) -> Vec<f64> {
        let positions = self.positions();
        let count = self.start().len() / 2;
        let mut piece = 0;
        let mut nodes = Vec::with_capacity(2 * count);
        for &s in &positions[..count] {
            while s > pieces[piece].to && piece + 1 < pieces.len() {
                piece += 1;
            }
            nodes.extend(pieces[piece].at(s).position);
        }
        self.hold(&mut nodes);
        nodes
    }

    /// Size of the last two polynomial coefficients times the degree (collocation errs by about
    /// the tail of the derivative), the largest of any element.
    pub(crate) fn tail(&self, nodes: &[f64]) -> f64 {
        let last_two =
            |c: &[f64]| c.len() as f64 * c.iter().rev().take(2).map(|c| c.abs()).sum::<f64>();
        self.pieces(nodes)
            .iter()
            .map(|piece| last_two(&piece.x).max(last_two(&piece.y)))
            .fold(0.0, f64::max)
    }

    /// Angle through which the whole curve turns in state `from`, and in state `to`.
    pub(crate) fn turning(&self, from: &[f64], to: &[f64]) -> [f64; 2] {
        let copies = if self.held()[1][0] { 1.0 } else { 2.0 };
        let before = copies * turning(from);
        [before, before + copies * turned(from, to)]
    }

    pub(crate) fn pieces(&self, nodes: &[f64]) -> Vec<CurvePiece> {
        match self {
            Self::Differences(_) => Vec::new(),
            Self::Spectral(s) => own(s.pieces(nodes)),
        }
    }
}

/// What a discretisation says of one of its own states.
#[expect(
    clippy::expect_used,
    reason = "nobody outside this crate makes a state, so that its length is right"
)]
pub(crate) fn own<T>(of_state: Result<T, MembraneError>) -> T {
    of_state.expect("a state of this discretisation")
}

/// Puts a unit into the rows of `tangent` that belong to held coordinates, which are zero.
pub(crate) fn hold_rows(
    differences: &FiniteDifferences,
    tangent: &mut BandMatrix,
) -> Result<(), MembraneError> {
    let [first, end] = differences.held();
    let last = tangent.len() - 2;
    for (node, held) in [(0, first), (last, end)] {
        for k in 0..2 {
            if held[k] {
                tangent.add(node + k, node + k, 1.0)?;
            }
        }
    }
    Ok(())
}

/// The factorisation that goes with each.
#[derive(Debug, Clone)]
pub(crate) enum Factors<'a> {
    Banded {
        of: &'a FiniteDifferences,
        tangent: BandMatrix,
        lu: BandedLu,
    },
    Condensed {
        of: &'a SpectralElements,
        lu: CondensedLu,
    },
}

impl<'a> Factors<'a> {
    pub(crate) fn new(discrete: &'a Discrete) -> Self {
        match discrete {
            Discrete::Differences(of) => {
                let tangent = of.band();
                let lu = BandedLu::for_matrix(&tangent);
                Self::Banded { of, tangent, lu }
            }
            Discrete::Spectral(of) => Self::Condensed {
                of,
                lu: CondensedLu::new(of),
            },
        }
    }

    /// Factors the tangent of the forces at fixed intensity; returns the sign of its determinant.
    pub(crate) fn factor(&mut self, nodes: &[f64], intensity: f64) -> Result<f64, NewtonError> {
        match self {
            Self::Banded { of, tangent, lu } => {
                tangent.clear();
                of.add_elastic_tangent_into(1.0, tangent);
                of.add_pressure_tangent_into(nodes, intensity, 1.0, tangent)?;
                hold_rows(of, tangent)?;
                Ok(lu.factor(tangent)?.determinant_sign())
            }
            Self::Condensed { of, lu } => lu.factor(of, nodes, intensity),
        }
    }

    pub(crate) fn solve_in_place(&mut self, rhs: &mut [f64]) -> Result<(), NewtonError> {
        match self {
            Self::Banded { lu, .. } => {
                let lu = lu.factored().ok_or(NewtonError::NotFactored)?;
                lu.solve_into(rhs);
                Ok(())
            }
            Self::Condensed { lu, .. } => lu.solve_in_place(rhs),
        }
    }
}
