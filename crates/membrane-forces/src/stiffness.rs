//! Stiffness lambda(s): spring constant per unit material length.

use std::fmt;
use std::sync::Arc;

use crate::error::{MembraneError, at_least, positive, rising};

/// Spring stiffness along the material coordinate s in [0, 1], or any positive number there, such as a [`Thickness`].
#[derive(Clone)]
pub struct Stiffness(Profile);

/// Thickness h(s) of rubber at rest, cm, given as a stiffness is.
pub type Thickness = Stiffness;

type StiffnessFunction = dyn Fn(f64) -> f64 + Send + Sync;

#[derive(Clone)]
enum Profile {
    Constant(f64),
    Samples(Vec<f64>),
    Function {
        breaks: Vec<f64>,
        value: Arc<StiffnessFunction>,
    },
}

impl fmt::Debug for Stiffness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Profile::Constant(value) => f.debug_tuple("Constant").field(value).finish(),
            Profile::Samples(values) => f.debug_tuple("Samples").field(values).finish(),
            Profile::Function { breaks, .. } => f.debug_tuple("Function").field(breaks).finish(),
        }
    }
}

impl Stiffness {
    /// Stiffness 1 everywhere.
    pub const UNIT: Self = Self(Profile::Constant(1.0));

    /// The same stiffness everywhere.
    ///
    /// # Errors
    /// `value` not finite or not positive.
    pub fn constant(value: f64) -> Result<Self, MembraneError> {
        Ok(Self(Profile::Constant(positive("stiffness", value)?)))
    }

    /// Samples at equal steps from s = 0 to s = 1, joined by straight lines.
    ///
    /// # Errors
    /// Fewer than two samples, or one that is not finite or not positive.
    pub fn samples(values: &[f64]) -> Result<Self, MembraneError> {
        at_least("stiffness samples", values.len(), 2)?;
        let last = (values.len() - 1) as f64;
        for (k, &value) in values.iter().enumerate() {
            check(k as f64 / last, value)?;
        }
        Ok(Self(Profile::Samples(values.to_vec())))
    }

    /// A function of s, smooth between `breakpoints` (strictly rising inside (0, 1)).
    ///
    /// Its values are checked where a discretisation uses them.
    ///
    /// # Errors
    /// Breakpoints that do not rise strictly inside (0, 1).
    pub fn function(
        value: impl Fn(f64) -> f64 + Send + Sync + 'static,
        breakpoints: &[f64],
    ) -> Result<Self, MembraneError> {
        rising(breakpoints)?;
        Ok(Self(Profile::Function {
            breaks: breakpoints.to_vec(),
            value: Arc::new(value),
        }))
    }

    /// Stiffness at `s`.
    ///
    /// # Errors
    /// The function gives a value that is not finite or not positive.
    pub fn at(&self, s: f64) -> Result<f64, MembraneError> {
        match &self.0 {
            Profile::Constant(value) => Ok(*value),
            Profile::Samples(values) => {
                let last = values.len() - 1;
                let position = s.clamp(0.0, 1.0) * last as f64;
                let k = (position as usize).min(last - 1);
                let t = position - k as f64;
                check(s, values[k] * (1.0 - t) + values[k + 1] * t)
            }
            Profile::Function { value, .. } => check(s, value(s)),
        }
    }

    /// The value if it is the same everywhere.
    pub fn as_constant(&self) -> Option<f64> {
        match self.0 {
            Profile::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// Positions inside (0, 1) between which the stiffness is smooth.
    pub fn breakpoints(&self) -> Vec<f64> {
        match &self.0 {
            Profile::Constant(_) => Vec::new(),
            Profile::Samples(values) => {
                let last = values.len() - 1;
                (1..last).map(|k| k as f64 / last as f64).collect()
            }
            Profile::Function { breaks, .. } => breaks.clone(),
        }
    }
}

fn check(s: f64, given: f64) -> Result<f64, MembraneError> {
    if given.is_finite() && given > 0.0 {
        Ok(given)
    } else {
        Err(MembraneError::BadStiffness { s, given })
    }
}
