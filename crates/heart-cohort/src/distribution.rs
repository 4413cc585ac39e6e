//! Distributions of field values by their quantile functions.

use crate::quantile::{normal_quantile, normal_share};
use crate::value::FieldValue;
use serde::{Deserialize, Serialize};

/// Smallest probability of a normal distribution within its bounds.
const LEAST_SHARE: f64 = 1e-9;

/// Largest magnitude of a drawn integer; all integers up to it are exact as f64.
const MOST_WHOLE: f64 = (1u64 << 53) as f64;

/// The distribution of a field. A value is the quantile of a coordinate `u` of the unit cube, so evenly distributed points give
/// evenly distributed fields. Integer fields are rounded; with [`Distribution::Uniform`] all integers, both ends included, have the
/// same probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Distribution {
    /// Uniform between two values.
    Uniform([f64; 2]),
    /// Normal, truncated to the bounds.
    #[non_exhaustive]
    Normal {
        /// Mean before truncation.
        mean: f64,
        /// Standard deviation before truncation.
        sd: f64,
        /// Smallest and largest value.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bounds: Option<[f64; 2]>,
    },
    /// Log-normal, truncated to the bounds.
    #[non_exhaustive]
    LogNormal {
        /// Median before truncation.
        median: f64,
        /// `exp` of the standard deviation of the logarithm, above 1: two thirds of the values are between `median / factor` and
        /// `median * factor`.
        factor: f64,
        /// Smallest and largest value.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bounds: Option<[f64; 2]>,
    },
    /// One of several values with equal probability: numbers, names, or tables of a scene.
    Choice(Vec<FieldValue>),
}

impl Distribution {
    /// Names in files.
    pub(crate) const NAMES: [&str; 4] = ["uniform", "normal", "log-normal", "choice"];

    /// Returns the fault of its numbers, if any.
    pub(crate) fn fault(&self) -> Option<String> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        match self {
            Self::Uniform([low, high]) => (!(high - low).is_finite() || low > high).then(|| {
                format!("uniform = [{low}, {high}]: must be ascending with a finite difference")
            }),
            Self::Normal { mean, sd, bounds } => {
                if !finite(&[*mean, *sd]) || *sd <= 0.0 {
                    return Some(format!("sd is {sd}; must be positive"));
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
                if !finite(&[*median, *factor]) || *median <= 0.0 || *factor <= 1.0 {
                    return Some(format!(
                        "median is {median}, factor is {factor}; must be positive and above 1"
                    ));
                }
                let [center, width] = [*median, *factor].map(libm::log);
                match bounds {
                    Some(bounds) if bounds[0] > 0.0 => {
                        bad_bounds(*bounds, |value| (libm::log(value) - center) / width)
                    }
                    Some([least, _]) => {
                        Some(format!("the lower bound is {least}; must be positive"))
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
            Self::Uniform([low, high]) if high.floor() < low.ceil() => {
                Some(format!("uniform = [{low}, {high}]: contains no integer"))
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

fn bad_bounds([low, high]: [f64; 2], standard: impl Fn(f64) -> f64) -> Option<String> {
    let ends = [low, high].map(standard);
    let share = match ends[0] > 0.0 {
        true => normal_share(-ends[0]) - normal_share(-ends[1]),
        false => normal_share(ends[1]) - normal_share(ends[0]),
    };
    // Also rejects NaN.
    let is_good = low.is_finite() && high.is_finite() && share > LEAST_SHARE;
    (!is_good).then(|| format!("bounds = [{low}, {high}] contain none of the distribution"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn values(distribution: &Distribution, n: usize) -> Vec<f64> {
        assert_eq!(distribution.fault(), None);
        let middle = |k| (k as f64 + 0.5) / n as f64;
        (0..n)
            .map(|k| distribution.value(middle(k), false).number().unwrap())
            .collect()
    }

    fn moments(values: &[f64]) -> [f64; 2] {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        [mean, variance.sqrt()]
    }

    /// Means and deviations in closed form; the midpoint rule over 100 000 quantiles has its largest error in the tails, 1e-4 of
    /// the deviation.
    #[test]
    fn moments_agree_with_the_distribution() {
        let known = [
            (json!({ "uniform": [1.0, 4.0] }), [2.5, 3.0 / 12f64.sqrt()]),
            (json!({ "normal": { "mean": 5.0, "sd": 2.0 } }), [5.0, 2.0]),
            // Half of a normal distribution: sqrt(2 / pi), sqrt(1 - 2 / pi).
            (
                json!({ "normal": { "mean": 0.0, "sd": 1.0, "bounds": [0.0, 40.0] } }),
                [0.797884560803, 0.602810274989],
            ),
            // exp(s^2 / 2), and that times sqrt(exp(s^2) - 1), with s = log 1.5.
            (
                json!({ "log-normal": { "median": 1.0, "factor": 1.5 } }),
                [1.085673983347, 0.458930712404],
            ),
        ];
        for (file, [mean, sd]) in known {
            let distribution: Distribution = serde_json::from_value(file.clone()).unwrap();
            let found = moments(&values(&distribution, 100_000));
            assert!((found[0] - mean).abs() < 2e-4 * sd, "{file}: {found:?}");
            assert!((found[1] / sd - 1.0).abs() < 2e-4, "{file}: {found:?}");
        }
    }

    #[test]
    fn bounds_are_met_and_far_tails_are_accurate() {
        let tail = json!({ "normal": { "mean": 0.0, "sd": 1.0, "bounds": [5.0, 5.5] } });
        let distribution: Distribution = serde_json::from_value(tail).unwrap();
        let values = values(&distribution, 1000);
        assert!(
            values
                .windows(2)
                .all(|pair| 5.0 <= pair[0] && pair[0] < pair[1])
        );
        // Mean of a normal distribution between a and b: (density(a) - density(b)) / (probability between).
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let share = normal_share(-5.0) - normal_share(-5.5);
        let mean = (density(5.0) - density(5.5)) / share;
        assert!((moments(&values)[0] - mean).abs() < 1e-6);
    }

    #[test]
    fn integers_have_equal_probability() {
        let distribution = Distribution::Uniform([3.0, 6.0]);
        let mut counts = [0; 4];
        for k in 0..400 {
            let value = distribution.value((f64::from(k) + 0.5) / 400.0, true);
            counts[value.number().unwrap() as usize - 3] += 1;
        }
        assert_eq!(counts, [100; 4]);
        let values = [FieldValue::Text("a".into()), FieldValue::Whole(2)];
        let choice = Distribution::Choice(values.to_vec());
        assert_eq!([0.1, 0.9].map(|u| choice.value(u, true)), values);
    }

    #[test]
    fn invalid_distributions_are_errors() {
        for bad in [
            json!({ "uniform": [2.0, 1.0] }),
            json!({ "uniform": [-1e308, 1e308] }),
            json!({ "normal": { "mean": 0.0, "sd": 1e308 } }),
            json!({ "normal": { "mean": 1.0, "sd": 1.0, "bounds": [2.0, 1.0] } }),
            json!({ "log-normal": { "median": 1e300, "factor": 20.0 } }),
            json!({ "normal": { "mean": 0.0, "sd": 0.0 } }),
            json!({ "normal": { "mean": 0.0, "sd": 1.0, "bounds": [60.0, 70.0] } }),
            json!({ "normal": { "mean": 0.0, "sd": 1.0, "bounds": [1.0, 1.0] } }),
            json!({ "log-normal": { "median": 1.0, "factor": 1.0 } }),
            json!({ "log-normal": { "median": 1.0, "factor": 2.0, "bounds": [0.0, 1.0] } }),
            json!({ "choice": [] }),
        ] {
            let distribution: Distribution = serde_json::from_value(bad.clone()).unwrap();
            assert!(distribution.fault().is_some(), "{bad}");
        }
        // Valid in general, but not for integers.
        for bad in [
            json!({ "uniform": [0.0, 1e30] }),
            json!({ "uniform": [3.2, 3.8] }),
            json!({ "normal": { "mean": 0.0, "sd": 1e16 } }),
            json!({ "log-normal": { "median": 1.0, "factor": 100.0 } }),
        ] {
            let distribution: Distribution = serde_json::from_value(bad.clone()).unwrap();
            assert_eq!(distribution.fault(), None, "{bad}");
            assert!(distribution.fault_of_whole().is_some(), "{bad}");
        }
    }
}
