//! Strain energies W of rubber: everything that depends on the type of rubber.
//!
//! Rubber is incompressible: for stretches l1 along the meridian, l2 around the axis and l3 across the thickness, l3 = 1 / (l1 l2).

use crate::error::{MembraneError, Result, finite, not_negative, positive};

/// Energy per volume of an incompressible rubber as a function of its principal stretches; moduli in kPa.
///
/// | rubber | W | source |
/// | --- | --- | --- |
/// | neo-Hookean | mu/2 (I1 - 3) | Treloar 1943, doi:10.5254/1.3540158 |
/// | Mooney and Rivlin | c1 (I1 - 3) + c2 (I2 - 3) | Mooney 1940, doi:10.1063/1.1712836 |
/// | Ogden | sum of mu_k / alpha_k (l1^alpha_k + l2^alpha_k + l3^alpha_k - 3) | Ogden 1972, doi:10.1098/rspa.1972.0026 |
/// | Gent | -mu jm/2 ln(1 - (I1 - 3) / jm) | Gent 1996, doi:10.5254/1.3538357 |
///
/// with I1 = l1^2 + l2^2 + l3^2 and I2 = l1^-2 + l2^-2 + l3^-2.
///
/// ```
/// use membrane_forces::StrainEnergy;
/// // a neo-Hookean balloon that is a sphere of radius 1 without load: p = 2 h W_1 / l^2, largest at l = 7^(1/6)
/// let rubber = StrainEnergy::NeoHookean { mu: 1.0 };
/// let l = 7f64.powf(1.0 / 6.0);
/// let pressure = 2.0 * rubber.at(l, l)?.by[0] / (l * l);
/// assert!((pressure - 1.2394629024).abs() < 1e-10);
/// # Ok::<(), membrane_forces::MembraneError>(())
/// ```
#[doc(alias = "hyperelastic")]
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(rename_all = "snake_case", deny_unknown_fields)
)]
pub enum StrainEnergy {
    /// Chains of Gaussian length.
    NeoHookean {
        /// Shear modulus.
        mu: f64,
    },
    /// Linear in both invariants; shear modulus 2 (c1 + c2).
    MooneyRivlin {
        /// Factor of I1 - 3, positive.
        c1: f64,
        /// Factor of I2 - 3, not negative.
        c2: f64,
    },
    /// A sum of powers of the stretches, of any number of terms; shear modulus half the sum of mu_k alpha_k.
    Ogden {
        /// `[mu_k, alpha_k]`, each of a positive product.
        terms: Vec<[f64; 2]>,
    },
    /// Chains of finite extensibility: I1 stays below 3 + jm.
    Gent {
        /// Shear modulus.
        mu: f64,
        /// Upper limit of I1 - 3.
        jm: f64,
    },
}

/// A strain energy with its derivatives by l1 and l2, where l3 = 1 / (l1 l2).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct EnergyDerivatives {
    /// W.
    pub energy: f64,
    /// dW/dl1, dW/dl2: forces per reference area.
    pub by: [f64; 2],
    /// Second derivatives: by l1 twice, by both, by l2 twice.
    pub second: [f64; 3],
}

/// The state of rubber at a point of a membrane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RubberState {
    /// Stretches along the meridian, around the axis and across the thickness.
    pub stretches: [f64; 3],
    /// Tensions along the meridian and around the axis, force per current width: kPa cm for moduli in kPa.
    pub tensions: [f64; 2],
    /// Stresses along the meridian and around the axis, force per current area, in the unit of the moduli.
    pub stresses: [f64; 2],
}

impl StrainEnergy {
    /// Rejects constants outside their range.
    ///
    /// # Errors
    /// A constant that is not finite or not positive (c2 may be zero), an Ogden energy without terms, with a product mu_k alpha_k that is not
    /// positive, or with an exponent alpha_k beyond 1000: that power of a stretch of 2 overflows at 1024.
    pub fn check(&self) -> Result<()> {
        match self {
            Self::NeoHookean { mu } => positive("mu", *mu).map(drop),
            Self::MooneyRivlin { c1, c2 } => {
                positive("c1", *c1)?;
                not_negative("c2", *c2).map(drop)
            }
            Self::Ogden { terms } => {
                crate::error::at_least("Ogden terms", terms.len(), 1)?;
                terms.iter().try_for_each(|[mu, alpha]| {
                    finite("mu_k", *mu)?;
                    MembraneError::within("alpha_k", *alpha, -1000.0, 1000.0)?;
                    positive("mu_k alpha_k", mu * alpha).map(drop)
                })
            }
            Self::Gent { mu, jm } => {
                positive("mu", *mu)?;
                positive("jm", *jm).map(drop)
            }
        }
    }

    /// Shear modulus of small strains.
    #[must_use]
    pub fn shear_modulus(&self) -> f64 {
        match self {
            Self::NeoHookean { mu } | Self::Gent { mu, .. } => *mu,
            Self::MooneyRivlin { c1, c2 } => 2.0 * (c1 + c2),
            Self::Ogden { terms } => 0.5 * terms.iter().map(|[mu, alpha]| mu * alpha).sum::<f64>(),
        }
    }

    /// W and its derivatives at these stretches. Constants are checked by [`Rubber::new`](crate::Rubber::new), not here.
    ///
    /// # Errors
    /// [`MembraneError::PastStretch`]: a stretch that is not positive, or beyond the extensibility of the rubber.
    #[inline]
    pub fn at(&self, l1: f64, l2: f64) -> Result<EnergyDerivatives> {
        let past = |limit: f64| MembraneError::PastStretch {
            given: [l1, l2],
            limit,
        };
        if !(l1 > 0.0 && l2 > 0.0 && l1 * l2 < f64::INFINITY) {
            return Err(past(f64::INFINITY));
        }
        Ok(match self {
            Self::NeoHookean { mu } => first_invariant(l1, l2).times(0.5 * mu),
            Self::MooneyRivlin { c1, c2 } => {
                let (first, second) = (first_invariant(l1, l2), second_invariant(l1, l2));
                first.times(*c1).plus(second.times(*c2))
            }
            Self::Ogden { terms } => {
                let powers = terms
                    .iter()
                    .map(|[mu, alpha]| powers(l1, l2, *alpha).times(mu / alpha));
                powers.fold(EnergyDerivatives::NONE, EnergyDerivatives::plus)
            }
            Self::Gent { mu, jm } => {
                let first = first_invariant(l1, l2);
                let left = 1.0 - first.energy / jm;
                if left <= 0.0 {
                    return Err(past(3.0 + jm));
                }
                // of f(I) = -mu jm/2 ln(1 - I/jm): f' = mu / (2 left), f'' = mu / (2 jm left^2)
                let slope = 0.5 * mu / left;
                let bend = slope / (jm * left);
                let ([a, b], [aa, ab, bb]) = (first.by, first.second);
                EnergyDerivatives {
                    energy: -0.5 * mu * jm * (-first.energy / jm).ln_1p(),
                    by: [slope * a, slope * b],
                    second: [
                        slope * aa + bend * a * a,
                        slope * ab + bend * a * b,
                        slope * bb + bend * b * b,
                    ],
                }
            }
        })
    }
}

impl EnergyDerivatives {
    /// Zero, for points without rubber.
    pub(crate) const NONE: Self = Self {
        energy: 0.0,
        by: [0.0; 2],
        second: [0.0; 3],
    };

    #[inline]
    fn times(self, factor: f64) -> Self {
        Self {
            energy: factor * self.energy,
            by: self.by.map(|v| factor * v),
            second: self.second.map(|v| factor * v),
        }
    }

    #[inline]
    fn plus(self, other: Self) -> Self {
        let ([a, b], [c, d]) = (self.by, other.by);
        let ([e, f, g], [h, i, j]) = (self.second, other.second);
        Self {
            energy: self.energy + other.energy,
            by: [a + c, b + d],
            second: [e + h, f + i, g + j],
        }
    }
}

/// a + b + (c - 1) for c = 1 / ((1 + a) (1 + b)), without the cancellation of its terms at small a and b.
#[inline]
fn sum_of_three(a: f64, b: f64, c: f64) -> f64 {
    match c < 0.25 {
        // nothing cancels, and products may overflow
        true => a + b + (c - 1.0),
        false => c * ((a + b) * (a + b + a * b) - a * b),
    }
}

/// I1 - 3.
#[inline]
fn first_invariant(a: f64, b: f64) -> EnergyDerivatives {
    let (over_a, over_b) = (1.0 / a, 1.0 / b);
    let third = over_a * over_b * over_a * over_b;
    EnergyDerivatives {
        energy: sum_of_three((a - 1.0) * (a + 1.0), (b - 1.0) * (b + 1.0), third),
        by: [2.0 * (a - third * over_a), 2.0 * (b - third * over_b)],
        second: [
            2.0 + 6.0 * third * over_a * over_a,
            4.0 * third * over_a * over_b,
            2.0 + 6.0 * third * over_b * over_b,
        ],
    }
}

/// I2 - 3.
#[inline]
fn second_invariant(a: f64, b: f64) -> EnergyDerivatives {
    let (over_a, over_b) = (1.0 / a, 1.0 / b);
    let (p, q) = (over_a * over_a, over_b * over_b);
    let (aa, bb) = (a * a, b * b);
    EnergyDerivatives {
        energy: sum_of_three(
            (1.0 - a) * (1.0 + a) * p,
            (1.0 - b) * (1.0 + b) * q,
            aa * bb,
        ),
        by: [2.0 * (a * bb - p * over_a), 2.0 * (b * aa - q * over_b)],
        second: [
            2.0 * (bb + 3.0 * p * p),
            4.0 * a * b,
            2.0 * (aa + 3.0 * q * q),
        ],
    }
}

/// l^alpha - 1 without cancellation near l = 1; `power` is l^alpha.
#[inline]
fn less_one(l: f64, alpha: f64, power: f64) -> f64 {
    let strain = l - 1.0;
    match strain.abs() < 0.1 {
        true => (alpha * strain.ln_1p()).exp_m1(),
        false => power - 1.0,
    }
}

/// l1^alpha + l2^alpha + l3^alpha - 3.
#[inline]
fn powers(a: f64, b: f64, alpha: f64) -> EnergyDerivatives {
    let (over_a, over_b) = (1.0 / a, 1.0 / b);
    let (p, q) = (a.powf(alpha), b.powf(alpha));
    let third = 1.0 / (p * q);
    let square = alpha * alpha;
    // of l^alpha by l: alpha l^(alpha - 1), alpha (alpha - 1) l^(alpha - 2); of l3^alpha: -alpha, alpha (alpha + 1)
    let bend = |power: f64, over: f64| {
        alpha * ((alpha - 1.0) * power + (alpha + 1.0) * third) * over * over
    };
    EnergyDerivatives {
        energy: sum_of_three(less_one(a, alpha, p), less_one(b, alpha, q), third),
        by: [alpha * (p - third) * over_a, alpha * (q - third) * over_b],
        second: [
            bend(p, over_a),
            square * third * over_a * over_b,
            bend(q, over_b),
        ],
    }
}
