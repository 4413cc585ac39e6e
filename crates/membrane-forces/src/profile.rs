//! Positive quantities along the material coordinate: stiffness of springs, thickness of rubber.

use std::marker::PhantomData;
use std::sync::Arc;

use crate::error::{MembraneError, Result, at_least, positive, rising};
use crate::shared::Shared;

/// Spring stiffness lambda(s): force per unit s and cm.
pub type Stiffness = Profile<OfStiffness>;

/// Thickness h(s) of rubber in its reference configuration, cm.
pub type Thickness = Profile<OfThickness>;

/// A quantity of a [`Profile`].
pub trait Quantity {
    /// Its name in errors.
    const NAME: &'static str;
}

/// Marks the profile of a stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OfStiffness {}

/// Marks the profile of a thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OfThickness {}

impl Quantity for OfStiffness {
    const NAME: &'static str = "stiffness";
}

impl Quantity for OfThickness {
    const NAME: &'static str = "thickness";
}

/// A positive quantity along the material coordinate s in [0, 1]: a [`Thickness`] or a [`Stiffness`].
///
/// Profiles of a function are equal if they share it, as clones do.
///
/// Stiffness and thickness are different types, so that they cannot be confused:
///
/// ```compile_fail,E0308
/// use membrane_forces::{Rubber, Stiffness, StrainEnergy};
/// let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 400.0 }, Stiffness::UNIT);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Profile<Q> {
    values: Values,
    quantity: PhantomData<fn() -> Q>,
}

type Function = dyn Fn(f64) -> f64 + Send + Sync;

#[derive(Debug, Clone, PartialEq)]
enum Values {
    Constant(f64),
    Samples(Vec<f64>),
    Function {
        breaks: Vec<f64>,
        value: Shared<Function>,
    },
}

impl<Q> Profile<Q> {
    /// The value 1 everywhere.
    pub const UNIT: Self = Self::of(Values::Constant(1.0));

    const fn of(values: Values) -> Self {
        Self {
            values,
            quantity: PhantomData,
        }
    }

    /// Positions inside (0, 1) between which the profile is smooth.
    #[must_use]
    pub fn breakpoints(&self) -> Vec<f64> {
        match &self.values {
            Values::Constant(_) => Vec::new(),
            Values::Samples(values) => {
                let last = values.len() - 1;
                (1..last).map(|k| k as f64 / last as f64).collect()
            }
            Values::Function { breaks, .. } => breaks.clone(),
        }
    }
}

impl<Q: Quantity> Profile<Q> {
    /// Creates a constant profile.
    ///
    /// # Errors
    /// `value` not finite or not positive.
    pub fn constant(value: f64) -> Result<Self> {
        Ok(Self::of(Values::Constant(positive(Q::NAME, value)?)))
    }

    /// Interpolates samples at equal steps from s = 0 to s = 1 linearly.
    ///
    /// # Errors
    /// Fewer than two samples, or one that is not finite or not positive.
    pub fn samples(values: &[f64]) -> Result<Self> {
        at_least("samples of a profile", values.len(), 2)?;
        let last = (values.len() - 1) as f64;
        for (k, &value) in values.iter().enumerate() {
            Self::check(k as f64 / last, value)?;
        }
        Ok(Self::of(Values::Samples(values.to_vec())))
    }

    /// Creates a profile from a function of s, smooth between `breakpoints` (strictly ascending inside (0, 1)).
    ///
    /// Its values are checked where a discretisation uses them.
    ///
    /// # Errors
    /// Breakpoints that are not strictly ascending inside (0, 1).
    pub fn function(
        value: impl Fn(f64) -> f64 + Send + Sync + 'static,
        breakpoints: &[f64],
    ) -> Result<Self> {
        rising(breakpoints)?;
        Ok(Self::of(Values::Function {
            breaks: breakpoints.to_vec(),
            value: Shared(Arc::new(value)),
        }))
    }

    /// The value at `s`.
    ///
    /// # Errors
    /// The function gives a value that is not finite or not positive.
    pub fn at(&self, s: f64) -> Result<f64> {
        match &self.values {
            Values::Constant(value) => Ok(*value),
            Values::Samples(values) => {
                let last = values.len() - 1;
                let position = s.clamp(0.0, 1.0) * last as f64;
                let k = (position as usize).min(last - 1);
                let t = position - k as f64;
                Self::check(s, values[k] * (1.0 - t) + values[k + 1] * t)
            }
            Values::Function { value, .. } => Self::check(s, (value.0)(s)),
        }
    }

    fn check(s: f64, given: f64) -> Result<f64> {
        if given.is_finite() && given > 0.0 {
            Ok(given)
        } else {
            let what = Q::NAME;
            Err(MembraneError::BadProfile { what, s, given })
        }
    }
}
