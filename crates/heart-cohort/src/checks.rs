//! Validation of a cohort: numbers, cases, correlations and constraints.

use crate::cohort::{Case, Cohort, MOST_MEMBERS, Sampling};
use crate::correlation::{Copula, Correlation};
use crate::expression::{Constraint, MOST_BYTES};
use crate::field::{self, is_within, overlap};
use crate::read::{Reader, section_of};
use heart_phantom::escape;
use heart_phantom::scene::SceneError;
use serde_json::Value;

/// Longest name of a case.
const MOST_NAME: usize = 100;

impl Reader<'_> {
    pub(crate) fn check_numbers(&self, cohort: &Cohort) -> Result<(), SceneError> {
        let wrong = |field, given: u64, most| {
            Err(self.wrong(field, format!("is {given}; must be between 1 and {most}")))
        };
        if !(1..=MOST_MEMBERS).contains(&cohort.members) {
            return wrong("members", cohort.members, MOST_MEMBERS);
        }
        if cohort.split.is_some_and(|split| !split.is_whole()) {
            return Err(self.wrong("split", "must be non-negative fractions with the sum 1"));
        }
        // The number of available blocks of points.
        let blocks = (1 << 32) / cohort.members.next_power_of_two();
        let most = match cohort.sampling {
            Sampling::Plain => 1_000_000,
            Sampling::Sobol => blocks.min(1_000_000),
        };
        if !(1..=most).contains(&u64::from(cohort.attempts)) {
            let of_sobol = match most < 1_000_000 {
                true => format!(
                    " with sobol and {} members, rounded up to a power of two: their product is at most 2^32",
                    cohort.members
                ),
                false => String::new(),
            };
            let what = format!("is {}; must be between 1 and {most}", cohort.attempts);
            return Err(self.wrong("attempts", what + &of_sobol));
        }
        Ok(())
    }

    /// The copula of the correlated coordinates; the coordinate of the case precedes those of the varied fields.
    pub(crate) fn copula(
        &self,
        given: &[Correlation],
        cohort: &Cohort,
    ) -> Result<Copula, SceneError> {
        let mut pairs: Vec<([usize; 2], f64)> = Vec::new();
        for (k, given) in given.iter().enumerate() {
            let (fields, coefficient) = (&given.fields, given.coefficient);
            let at = format!("correlations.{}", k + 1);
            let mut pair = [0; 2];
            for (place, field) in pair.iter_mut().zip(fields) {
                let Some(d) = cohort.varied.iter().position(|varied| varied == field) else {
                    let what = format!("{field} does not vary");
                    return Err(self.wrong(&format!("{at}.fields"), what));
                };
                *place = d + 1;
            }
            pair.sort_unstable();
            if pair[0] == pair[1] || pairs.iter().any(|(other, _)| *other == pair) {
                let what = "must be two different fields, and each pair given once";
                return Err(self.wrong(&format!("{at}.fields"), what));
            }
            // Also rejects NaN.
            let is_inside = coefficient.abs() < 1.0;
            if !is_inside {
                let what = format!("is {coefficient}; it must be between -1 and 1, both excluded");
                return Err(self.wrong(&format!("{at}.coefficient"), what));
            }
            pairs.push((pair, coefficient));
        }
        Copula::new(&pairs).ok_or_else(|| {
            let what = "the correlation matrix of the coefficients must be positive definite";
            self.wrong("correlations", what)
        })
    }

    pub(crate) fn check_cases(&self, cases: &[Case], are_named: bool) -> Result<(), SceneError> {
        let mut all = 0.0;
        for (k, Case { name, weight, .. }) in cases.iter().enumerate() {
            all += weight;
            // Also rejects NaN.
            let is_positive = *weight > 0.0;
            if !is_positive || !all.is_finite() {
                let wanted = match is_positive {
                    false => "it must be positive",
                    true => "the sum of all weights must be finite",
                };
                let what = format!("is {weight:?}; {wanted}");
                return Err(self.wrong(&format!("cases.{}.weight", k + 1), what));
            }
            let what = if cases[..k].iter().any(|other| other.name == *name) {
                format!("`{name}` is the name of another case")
            } else if are_named && (name.is_empty() || name.len() > MOST_NAME) {
                format!("has {} bytes; it must have 1 to {MOST_NAME}", name.len())
            } else if escape(name) != *name {
                format!("`{name}` contains control characters")
            } else {
                continue;
            };
            return Err(self.wrong(&format!("cases.{}.name", k + 1), what));
        }
        Ok(())
    }

    /// Rejects a case without valid scenes, for instance with a distribution outside the range of its field.
    pub(crate) fn check_scenes(&self, cohort: &Cohort, has_cases: bool) -> Result<(), SceneError> {
        for (k, case) in cohort.cases.iter().enumerate() {
            let Some(error) = cohort.invalid(case) else {
                continue;
            };
            let first = error.first();
            let mut varied = case.vary.keys();
            let at = match varied.find(|path| overlap(path, &first.field)) {
                Some(path) => self.varied_at(&section_of(k, has_cases), path),
                None => "vary".to_owned(),
            };
            let is = match first.given.as_str() {
                "" => String::new(),
                given => format!(" is {given};"),
            };
            let what = format!(
                "none of {} drawn scenes is valid; in the first, {}{is} {}",
                Cohort::SCENES,
                first.field,
                first.wanted
            );
            return Err(self.wrong(&at, what));
        }
        Ok(())
    }

    pub(crate) fn constraints(
        &self,
        given: &[String],
        cohort: &Cohort,
    ) -> Result<Vec<Constraint>, SceneError> {
        let mut constraints = Vec::new();
        for (k, text) in given.iter().enumerate() {
            let at = format!("constraints.{}", k + 1);
            if text.len() > MOST_BYTES {
                let what = format!("has {} bytes; must have at most {MOST_BYTES}", text.len());
                return Err(self.wrong(&at, what));
            }
            let constraint = Constraint::parse(text)
                .map_err(|what| self.wrong(&at, format!("`{text}`: {what}")))?;
            for field in constraint.fields() {
                let is_known = |case: &Case| {
                    case.vary.keys().any(|path| is_within(field, path))
                        || field::get(&case.scene, field).is_some_and(Value::is_number)
                };
                if !cohort.cases.iter().all(is_known) {
                    let what = format!("`{text}`: {field} is not a number of the scene");
                    return Err(self.wrong(&at, what));
                }
            }
            constraints.push(constraint);
        }
        Ok(constraints)
    }
}
