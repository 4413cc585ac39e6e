//! The continuous model: reference configuration, stiffness, pressure law, fixed ends.

use crate::error::{MembraneError, Result, finite};
use crate::law::PressureLaw;
use crate::material::{Material, Rubber};
use crate::profile::Stiffness;
use crate::reference::{CurvePoint, ReferenceShape, check_sides};
use crate::strain_energy::RubberState;

/// Breakpoints that differ by less are one.
pub(crate) const SAME: f64 = 1e-12;

/// An elastic membrane in the plane of its axis of revolution.
///
/// ```
/// use membrane_forces::{Membrane, PressureLaw, ReferenceShape, Stiffness};
/// let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?)
///     .with_stiffness(Stiffness::function(|s| 1.0 + 0.5 * (6.0 * s).sin(), &[])?)
///     .with_law(PressureLaw::TotalForce);
/// assert_eq!(membrane.ends(), [[0.0, 1.75], [0.0, -1.75]]);
/// # Ok::<(), membrane_forces::MembraneError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Membrane {
    rest: ReferenceShape,
    material: Material,
    law: PressureLaw,
    ends: [[f64; 2]; 2],
}

impl Membrane {
    /// Creates a membrane with stiffness 1, no second neighbours, force per material length, and ends fixed in the reference configuration.
    #[must_use]
    pub fn new(rest: ReferenceShape) -> Self {
        let ends = [rest.at(0.0).position, rest.at(1.0).position];
        Self {
            rest,
            material: Material::Springs {
                stiffness: Stiffness::UNIT,
                second: None,
            },
            law: PressureLaw::default(),
            ends,
        }
    }

    /// Sets the stiffness lambda(s) of springs between neighbours. Rubber set before ([`Membrane::with_rubber`]) is replaced by springs.
    #[must_use]
    pub fn with_stiffness(mut self, stiffness: Stiffness) -> Self {
        let second = match self.material {
            Material::Springs { second, .. } => second,
            Material::Rubber(_) => None,
        };
        self.material = Material::Springs { stiffness, second };
        self
    }

    /// Sets the stiffness lambda_2(s) of springs between second neighbours (3.2.3).
    ///
    /// Both springs pull with (stiffness / ds^2) times the difference of displacements, so in
    /// the limit of fine meshes the membrane has stiffness lambda + 4 lambda_2. Rubber set before is replaced by springs of stiffness 1.
    #[must_use]
    pub fn with_second_neighbours(mut self, stiffness: Stiffness) -> Self {
        let second = Some(stiffness);
        let stiffness = match self.material {
            Material::Springs { stiffness, .. } => stiffness,
            Material::Rubber(_) => Stiffness::UNIT,
        };
        self.material = Material::Springs { stiffness, second };
        self
    }

    /// Replaces springs by rubber under a pressure: [`PressureLaw::PerCurrentLength`], for a body of revolution the force per current area.
    ///
    /// A membrane has one material, the one set last: a later [`Membrane::with_stiffness`] or [`Membrane::with_second_neighbours`] replaces
    /// the rubber by springs, under the same law.
    ///
    /// ```
    /// use membrane_forces::{Material, Membrane, ReferenceShape, Rubber, StrainEnergy, Thickness};
    /// let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 400.0 }, Thickness::constant(0.05)?)?;
    /// let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75)?).with_rubber(latex);
    /// assert!(matches!(balloon.material(), Material::Rubber(_)));
    /// # Ok::<(), membrane_forces::MembraneError>(())
    /// ```
    #[must_use]
    pub fn with_rubber(mut self, rubber: Rubber) -> Self {
        self.material = Material::Rubber(rubber);
        self.law = PressureLaw::PerCurrentLength;
        self
    }

    /// Sets the pressure law.
    #[must_use]
    pub fn with_law(mut self, law: PressureLaw) -> Self {
        self.law = law;
        self
    }

    /// Sets the positions of the fixed ends s = 0 and s = 1, instead of those of the reference configuration.
    ///
    /// The membrane then has tension without load. Solvers start from c0 plus the displacements of the two ends, interpolated linearly in
    /// s: the equilibrium without load if lambda is constant.
    ///
    /// # Errors
    /// A coordinate that is not finite; [`MembraneError::EndsOnOneSide`]; [`MembraneError::EndsExchanged`] if each is near the other end of the
    /// reference configuration: together closer than a tenth of the distance between the two.
    pub fn with_ends(mut self, ends: [[f64; 2]; 2]) -> Result<Self> {
        for value in ends.as_flattened() {
            finite("fixed end", *value)?;
        }
        self.ends = ends;
        let rest = [0.0, 1.0].map(|s| self.rest.at(s).position);
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let off = distance(ends[0], rest[1]) + distance(ends[1], rest[0]);
        if off < 0.1 * distance(rest[0], rest[1]) {
            return Err(MembraneError::EndsExchanged { ends, rest });
        }
        check_sides(ends)?;
        Ok(self)
    }

    /// Moves reference positions at s by the displacement of the ends.
    pub(crate) fn hold_ends<'a>(&self, nodes: impl Iterator<Item = (f64, &'a mut [f64; 2])>) {
        let rest = [self.rest.at(0.0).position, self.rest.at(1.0).position];
        let moved = |end: usize, k: usize| self.ends[end][k] - rest[end][k];
        for (s, node) in nodes {
            for k in 0..2 {
                node[k] += (1.0 - s) * moved(0, k) + s * moved(1, k);
            }
            // directly, without the rounding of the reference position
            if s == 0.0 {
                *node = self.ends[0];
            } else if s == 1.0 {
                *node = self.ends[1];
            }
        }
    }

    /// Returns the reference configuration c0(s).
    #[must_use]
    pub fn reference(&self) -> &ReferenceShape {
        &self.rest
    }

    /// Returns the material.
    #[must_use]
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// Returns lambda(s) + 4 lambda_2(s), the stiffness of springs in the limit of fine meshes.
    ///
    /// # Errors
    /// A stiffness that is not finite or not positive; [`MembraneError::OtherMaterial`].
    pub fn effective_stiffness(&self, s: f64) -> Result<f64> {
        match &self.material {
            Material::Springs { stiffness, second } => {
                let second = second.as_ref().map_or(Ok(0.0), |second| second.at(s))?;
                Ok(stiffness.at(s)? + 4.0 * second)
            }
            Material::Rubber(_) => Err(MembraneError::OtherMaterial {
                what: "effective stiffness",
                needs: "springs",
            }),
        }
    }

    /// Computes stretches, tensions and stresses of rubber at `s`, where the membrane is at `here`. On the axis the hoop stretch is the
    /// meridional one, its limit.
    ///
    /// # Errors
    /// [`MembraneError::OtherMaterial`] for springs; [`MembraneError::PastStretch`].
    pub fn rubber_state(&self, s: f64, here: &CurvePoint) -> Result<RubberState> {
        let Material::Rubber(rubber) = &self.material else {
            let (what, needs) = ("stretches", "rubber");
            return Err(MembraneError::OtherMaterial { what, needs });
        };
        let rest = self.rest.at(s.clamp(0.0, 1.0));
        let speed = |point: &CurvePoint| point.first[0].hypot(point.first[1]);
        let l1 = speed(here) / speed(&rest);
        // the apex of a mirror-symmetric curve is on the axis; sine and cosine have rounding errors
        let l2 = match s {
            0.5 => l1,
            _ => here.position[1] / rest.position[1],
        };
        let [w1, w2] = rubber.energy().at(l1, l2)?.by;
        let thickness = rubber.thickness().at(s.clamp(0.0, 1.0))?;
        Ok(RubberState {
            stretches: [l1, l2, 1.0 / (l1 * l2)],
            tensions: [thickness * w1 / l2, thickness * w2 / l1],
            stresses: [l1 * w1, l2 * w2],
        })
    }

    /// Rejects rubber with a law other than that of a pressure.
    pub(crate) fn check_law(&self) -> Result<()> {
        match (&self.material, self.law) {
            (Material::Springs { .. }, _)
            | (Material::Rubber(_), PressureLaw::PerCurrentLength) => Ok(()),
            (Material::Rubber(_), PressureLaw::PerMaterialLength | PressureLaw::TotalForce) => {
                Err(MembraneError::LawOfRubber)
            }
        }
    }

    /// Returns the points at which reference configuration or stiffness is not smooth, on [0, 1] or, cut at the apex, on [0, 1/2].
    pub(crate) fn breakpoints(&self, half: bool) -> Vec<f64> {
        let mut all = self.rest.breakpoints().to_vec();
        match &self.material {
            Material::Springs { stiffness, second } => {
                all.extend(stiffness.breakpoints());
                if let Some(second) = second {
                    all.extend(second.breakpoints());
                }
            }
            Material::Rubber(rubber) => all.extend(rubber.thickness().breakpoints()),
        }
        if half {
            all.retain(|&b| b < 0.5);
            all.push(0.5);
        }
        all.sort_by(f64::total_cmp);
        // breakpoints of different origin at the same position: the outer one, as at the mirror image
        all.dedup_by(|b, a| {
            let same = *b - *a < SAME;
            if same && *b > 0.5 {
                *a = *b;
            }
            same
        });
        // the end is exact; a breakpoint just before it is replaced
        if let Some(last) = all.last_mut() {
            *last = if half { 0.5 } else { 1.0 };
        }
        all
    }

    /// Returns the pressure law.
    #[must_use]
    pub fn law(&self) -> PressureLaw {
        self.law
    }

    /// Returns the positions [x, y] at which s = 0 and s = 1 are fixed.
    #[must_use]
    pub fn ends(&self) -> [[f64; 2]; 2] {
        self.ends
    }
}
