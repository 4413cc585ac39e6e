//! Distributions of field values by their quantile functions.

use crate::field::FieldValue;
use crate::quantile::{normal_quantile, normal_share};
use serde::{Deserialize, Serialize};

/// Smallest probability of a normal distribution within its bounds.
const LEAST_SHARE: f64 = 1e-9;

/// Largest magnitude of a drawn integer; all integers up to it are exact as f64.
const MOST_WHOLE: f64 = (1u64 << 53) as f64;

/// The distribution of a field, as [`Cohort`](crate::Cohort) describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Distribution {
    Uniform([f64; 2]),
    Normal {
        mean: f64,
        sd: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bounds: Option<[f64; 2]>,
    },
    LogNormal {
        median: f64,
        factor: f64,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bounds: Option<[f64; 2]>,
    },
    Choice(Vec<FieldValue>),
}

impl Distribution {
    /// Names in files.
    pub(crate) const NAMES: [&str; 4] = ["uniform", "normal", "log-normal", "choice"];

    /// Returns the fault of its numbers, if any; those of JSON are finite.
    pub(crate) fn fault(&self) -> Option<String> {
        match self {
            Self::Uniform(ends @ [low, high]) => (!(high - low).is_finite() || low > high)
                .then(|| format!("uniform = {ends:?}: must be ascending with a finite difference")),
            Self::Normal { mean, sd, bounds } => {
                if *sd <= 0.0 {
                    return Some(format!("sd is {sd:?}; must be positive"));
                }
                match bounds {
                    Some(bounds) => bad_bounds(*bounds, |value| (value - mean) / sd),
                    None => self.fault_of_tails(f64::MAX),
                }
            }
            Self::LogNormal {
                median,
                factor,
                bounds,
            } => {
                if *median <= 0.0 || *factor <= 1.0 {
                    return Some(format!(
                        "median is {median:?}, factor is {factor:?}; must be positive and above 1"
                    ));
                }
                let [center, width] = [*median, *factor].map(libm::log);
                match bounds {
                    Some(bounds) if bounds[0] > 0.0 => {
                        bad_bounds(*bounds, |value| (libm::log(value) - center) / width)
                    }
                    Some([least, _]) => {
                        Some(format!("the lower bound is {least:?}; must be positive"))
                    }
                    None => self.fault_of_tails(f64::MAX),
                }
            }
            Self::Choice(values) => values
                .is_empty()
                .then(|| "choice = []: must not be empty".to_owned()),
        }
    }

    /// Returns its fault for an integer field, if any.
    pub(crate) fn fault_of_whole(&self) -> Option<String> {
        match self {
            Self::Uniform(ends @ [low, high]) if high.floor() < low.ceil() => {
                Some(format!("uniform = {ends:?}: contains no integer"))
            }
            Self::Uniform(_) | Self::Normal { .. } | Self::LogNormal { .. } => {
                self.fault_of_tails(MOST_WHOLE)
            }
            Self::Choice(_) => None,
        }
    }

    /// Returns whether a draw may exceed `most` in magnitude.
    fn fault_of_tails(&self, most: f64) -> Option<String> {
        // The smallest coordinate of a draw is 2^-54, the largest one rounds to 1.
        let ends = [f64::EPSILON / 4.0, 1.0].map(|u| self.number(u));
        let is_within = ends.iter().all(|end| end.abs() <= most);
        (!is_within).then(|| {
            let [low, high] = ends;
            format!("draws between {low:e} and {high:e} exceed the limit of {most:e} in magnitude")
        })
    }

    /// Returns the quantile of `u` in (0, 1), rounded for integer fields.
    pub(crate) fn value(&self, u: f64, is_whole: bool) -> FieldValue {
        match self {
            Self::Choice(values) => {
                let k = (u * values.len() as f64) as usize;
                values[k.min(values.len() - 1)].clone()
            }
            Self::Uniform([low, high]) if is_whole => {
                let count = high.floor() - low.ceil() + 1.0;
                FieldValue::Whole((low.ceil() + (u * count).floor()).min(high.floor()) as i64)
            }
            // Within `MOST_WHOLE`, where all integers are exact.
            _ if is_whole => FieldValue::Whole(self.number(u).round() as i64),
            _ => FieldValue::Number(self.number(u)),
        }
    }

    /// Returns the quantile of `u` in (0, 1) as a number; NaN for a choice, whose values have no order.
    fn number(&self, u: f64) -> f64 {
        match self {
            Self::Uniform([low, high]) => (low + u * (high - low)).clamp(*low, *high),
            Self::Normal { mean, sd, bounds } => {
                let ends = bounds.map(|ends| ends.map(|end| (end - mean) / sd));
                within(mean + sd * cut_off(u, ends), *bounds)
            }
            Self::LogNormal {
                median,
                factor,
                bounds,
            } => {
                let [center, width] = [*median, *factor].map(libm::log);
                let ends = bounds.map(|ends| ends.map(|end| (libm::log(end) - center) / width));
                within(libm::exp(center + width * cut_off(u, ends)), *bounds)
            }
            Self::Choice(_) => f64::NAN,
        }
    }
}

fn bad_bounds(bounds: [f64; 2], standard: impl Fn(f64) -> f64) -> Option<String> {
    if bounds[0] >= bounds[1] {
        return Some(format!("bounds = {bounds:?}: must be ascending"));
    }
    let ends = bounds.map(standard);
    let share = match ends[0] > 0.0 {
        true => normal_share(-ends[0]) - normal_share(-ends[1]),
        false => normal_share(ends[1]) - normal_share(ends[0]),
    };
    (share <= LEAST_SHARE)
        .then(|| format!("bounds = {bounds:?}: must contain a part of the distribution"))
}

/// Returns a quantile of the truncated standard normal distribution. The upper half is computed by symmetry, which avoids
/// cancellation.
fn cut_off(u: f64, ends: Option<[f64; 2]>) -> f64 {
    let share = match ends {
        None => u,
        Some([low, high]) if low > 0.0 => return -cut_off(1.0 - u, Some([-high, -low])),
        Some(ends) => {
            let [from, to] = ends.map(normal_share);
            from + u * (to - from)
        }
    };
    normal_quantile(share.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON))
}

fn within(value: f64, bounds: Option<[f64; 2]>) -> f64 {
    bounds.map_or(value, |[low, high]| value.clamp(low, high))
}
