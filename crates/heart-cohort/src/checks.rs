//! Checks of a cohort as a whole: its numbers, cases, correlations and constraints.

use crate::cohort::{Case, Cohort, MOST_MEMBERS, Sampling};
use crate::correlation::{Copula, Correlation};
use crate::error::TextError;
use crate::expression::Constraint;
use crate::read::Reader;
use heart_phantom::shown;

/// Longest name of a case.
const MOST_NAME: usize = 100;

impl Reader<'_> {
    pub(crate) fn check_numbers(&self, cohort: &Cohort) -> Result<(), TextError> {
        let wrong = |field, given: u64, most| {
            Err(self.wrong(field, format!("is {given}; must be 1 to {most}")))
        };
        if !(1..=MOST_MEMBERS).contains(&cohort.members) {
            return wrong("members", cohort.members, MOST_MEMBERS);
        }
        if cohort.split.is_some_and(|split| !split.is_whole()) {
            return Err(self.wrong("split", "must be fractions from 0 on whose sum is 1"));
        }
        // So many blocks of points are there.
        let blocks = (1 << 32) / cohort.members.next_power_of_two();
        let most = match cohort.sampling {
            Sampling::Plain => 1_000_000,
            Sampling::Sobol => blocks.min(1_000_000),
        };
        if !(1..=most).contains(&u64::from(cohort.attempts)) {
            return wrong("attempts", cohort.attempts.into(), most);
        }
        Ok(())
    }

    /// The copula of the correlated coordinates: that of the case comes before those of the varied fields.
    pub(crate) fn copula(
        &self,
        given: &[Correlation],
        cohort: &Cohort,
    ) -> Result<Copula, TextError> {
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
            // A NaN is not below 1 either.
            let is_inside = coefficient.abs() < 1.0;
            if !is_inside {
                let what = format!("is {coefficient}; it must be between -1 and 1, both excluded");
                return Err(self.wrong(&format!("{at}.coefficient"), what));
            }
            pairs.push((pair, coefficient));
        }
        Copula::new(&pairs).ok_or_else(|| {
            let what =
                "no variables have these coefficients: their matrix must be positive definite";
            self.wrong("correlations", what)
        })
    }

    pub(crate) fn check_cases(&self, cases: &[Case], are_named: bool) -> Result<(), TextError> {
        let mut all = 0.0;
        for (k, Case { name, weight, .. }) in cases.iter().enumerate() {
            all += weight;
            if !(*weight > 0.0 && all.is_finite()) {
                let what =
                    format!("is {weight:?}; it must be positive, and all weights together finite");
                return Err(self.wrong(&format!("cases.{}.weight", k + 1), what));
            }
            let what = if cases[..k].iter().any(|other| other.name == *name) {
                format!("`{name}` is the name of another case, too")
            } else if are_named && (name.is_empty() || name.len() > MOST_NAME) {
                format!("has {} bytes; it must have 1 to {MOST_NAME}", name.len())
            } else if shown(name) != *name {
                format!("`{name}` contains characters that cannot be shown")
            } else {
                continue;
            };
            return Err(self.wrong(&format!("cases.{}.name", k + 1), what));
        }
        Ok(())
    }

    pub(crate) fn constraints(
        &self,
        given: &[String],
        cohort: &Cohort,
    ) -> Result<Vec<Constraint>, TextError> {
        let mut constraints = Vec::new();
        for (k, text) in given.iter().enumerate() {
            let at = format!("constraints.{}", k + 1);
            let constraint = Constraint::parse(text)
                .map_err(|what| self.wrong(&at, format!("`{text}`: {what}")))?;
            for field in constraint.fields() {
                let is_known = |(case, k): (&Case, usize)| {
                    case.vary.contains_key(field) || cohort.number_of_case(k, field).is_some()
                };
                let drawn_within = |case: &Case| {
                    case.vary.keys().any(|path| {
                        field
                            .strip_prefix(path.as_str())
                            .is_some_and(|rest| rest.starts_with('.'))
                    })
                };
                for (k, case) in cohort.cases.iter().enumerate() {
                    if !is_known((case, k)) && !drawn_within(case) {
                        let what = format!("`{text}`: the scene has no number {field}");
                        return Err(self.wrong(&at, what));
                    }
                }
            }
            constraints.push(constraint);
        }
        Ok(constraints)
    }
}
