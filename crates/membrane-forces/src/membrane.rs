//! The continuous model: rest shape, stiffness, pressure law, held ends.

use crate::error::{MembraneError, finite};
use crate::law::PressureLaw;
use crate::rest::RestShape;
use crate::stiffness::Stiffness;

/// An elastic membrane in the plane of its axis of revolution.
///
/// ```
/// use membrane_forces::{Membrane, PressureLaw, RestShape, Stiffness};
/// let membrane = Membrane::new(RestShape::balloon(8.5, 1.75)?)
///     .with_stiffness(Stiffness::function(|s| 1.0 + 0.5 * (6.0 * s).sin(), &[])?)
///     .with_law(PressureLaw::TotalForce);
/// assert_eq!(membrane.ends(), [[0.0, 1.75], [0.0, -1.75]]);
/// # Ok::<(), membrane_forces::MembraneError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Membrane {
    rest: RestShape,
    stiffness: Stiffness,
    second: Option<Stiffness>,
    law: PressureLaw,
    ends: [[f64; 2]; 2],
}

impl Membrane {
    /// Stiffness 1, no second neighbours, force per material length, ends held where they rest.
    pub fn new(rest: RestShape) -> Self {
        let ends = [rest.at(0.0).position, rest.at(1.0).position];
        Self {
            rest,
            stiffness: Stiffness::UNIT,
            second: None,
            law: PressureLaw::default(),
            ends,
        }
    }

    /// The same with stiffness lambda(s) of the springs between neighbours.
    pub fn with_stiffness(mut self, stiffness: Stiffness) -> Self {
        self.stiffness = stiffness;
        self
    }

    /// The same with springs of stiffness lambda_2(s) between second neighbours (3.2.3).
    ///
    /// Both springs pull with (stiffness / ds^2) times the difference of displacements, so in
    /// the limit of fine meshes the membrane has stiffness lambda + 4 lambda_2.
    pub fn with_second_neighbours(mut self, stiffness: Stiffness) -> Self {
        self.second = Some(stiffness);
        self
    }

    /// The same under another pressure law.
    pub fn with_law(mut self, law: PressureLaw) -> Self {
        self.law = law;
        self
    }

    /// The same with its ends s = 0 and s = 1 held at `ends` instead of where they rest.
    ///
    /// Without load it is then no more at rest. Solvers start from c0 plus the displacements of the
    /// two ends, joined by a straight line over s: the equilibrium without load if lambda is constant.
    ///
    /// # Errors
    /// A coordinate that is not finite.
    pub fn with_ends(mut self, ends: [[f64; 2]; 2]) -> Result<Self, MembraneError> {
        for value in ends.as_flattened() {
            finite("held end", *value)?;
        }
        self.ends = ends;
        Ok(self)
    }

    /// Moves rest positions at s by what moves the ends to where they are held.
    pub(crate) fn hold_ends<'a>(&self, nodes: impl Iterator<Item = (f64, &'a mut [f64; 2])>) {
        let rest = [self.rest.at(0.0).position, self.rest.at(1.0).position];
        let moved = |end: usize, k: usize| self.ends[end][k] - rest[end][k];
        for (s, node) in nodes {
            for k in 0..2 {
                node[k] += (1.0 - s) * moved(0, k) + s * moved(1, k);
            }
            // not by way of the rest position, whose rounding the sum would keep
            if s == 0.0 {
                *node = self.ends[0];
            } else if s == 1.0 {
                *node = self.ends[1];
            }
        }
    }

    /// Rest shape c0(s).
    pub fn rest(&self) -> &RestShape {
        &self.rest
    }

    /// Stiffness lambda(s) between neighbours.
    pub fn stiffness(&self) -> &Stiffness {
        &self.stiffness
    }

    /// Stiffness lambda_2(s) between second neighbours, if there are such springs.
    pub fn second_neighbours(&self) -> Option<&Stiffness> {
        self.second.as_ref()
    }

    /// lambda(s) + 4 lambda_2(s): the stiffness in the limit of fine meshes.
    ///
    /// # Errors
    /// A stiffness that is not finite or not positive.
    pub fn effective_stiffness(&self, s: f64) -> Result<f64, MembraneError> {
        let second = self
            .second
            .as_ref()
            .map_or(Ok(0.0), |second| second.at(s))?;
        Ok(self.stiffness.at(s)? + 4.0 * second)
    }

    /// Where rest shape or stiffness is not smooth, on [0, 1] or, cut at the apex, on [0, 1/2].
    pub(crate) fn breakpoints(&self, half: bool) -> Vec<f64> {
        let mut all = self.rest.breakpoints().to_vec();
        all.extend(self.stiffness.breakpoints());
        if let Some(second) = &self.second {
            all.extend(second.breakpoints());
        }
        if half {
            all.retain(|&b| b < 0.5);
            all.push(0.5);
        }
        all.sort_by(f64::total_cmp);
        // breakpoints of different origin that mean the same place
        all.dedup_by(|b, a| *b - *a < 1e-12);
        // the end stays where it is, whatever came just before it
        if let Some(last) = all.last_mut() {
            *last = if half { 0.5 } else { 1.0 };
        }
        all
    }

    /// Pressure law.
    pub fn law(&self) -> PressureLaw {
        self.law
    }

    /// Positions [x, y] at which s = 0 and s = 1 are held.
    pub fn ends(&self) -> [[f64; 2]; 2] {
        self.ends
    }
}
