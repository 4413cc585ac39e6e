//! Distributions of a field: moments, bounds, equal probabilities, and invalid parameters.

use crate::text;
use heart_cohort::{Cohort, FieldValue};
use std::collections::BTreeMap;
use std::f64::consts::{SQRT_2, TAU};

/// Evenly distributed draws of a field: one in each of 2^16 intervals of equal probability.
fn draws(field: &str, distribution: &str) -> Vec<FieldValue> {
    let vary = format!("{field} = {distribution}");
    let cohort = Cohort::from_toml(&text(1 << 16, "sampling = \"sobol\"", &vary)).unwrap();
    let drawn = (0..cohort.members()).map(|k| cohort.member(k).unwrap().values.remove(field));
    drawn.map(Option::unwrap).collect()
}

fn numbers(distribution: &str) -> Vec<f64> {
    let drawn = draws("pose.shift.1", distribution);
    drawn.iter().map(|value| value.number().unwrap()).collect()
}

fn moments(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    [mean, variance.sqrt()]
}

/// Means and deviations in closed form; the average over 65 536 quantiles has its largest error in the tails, 1e-4 of the deviation.
#[test]
fn moments_agree_with_the_distribution() {
    for (distribution, [mean, sd]) in [
        ("{ uniform = [1.0, 4.0] }", [2.5, 3.0 / 12f64.sqrt()]),
        ("{ normal = { mean = 5.0, sd = 2.0 } }", [5.0, 2.0]),
        // Half of a normal distribution: sqrt(2 / pi), sqrt(1 - 2 / pi).
        (
            "{ normal = { mean = 0.0, sd = 1.0, bounds = [0.0, 40.0] } }",
            [0.797884560803, 0.602810274989],
        ),
        // exp(s^2 / 2), and that times sqrt(exp(s^2) - 1), with s = log 1.5.
        (
            "{ log-normal = { median = 1.0, factor = 1.5 } }",
            [1.085673983347, 0.458930712404],
        ),
    ] {
        let found = moments(&numbers(distribution));
        assert!(
            (found[0] - mean).abs() < 2e-4 * sd,
            "{distribution}: {found:?}"
        );
        assert!(
            (found[1] / sd - 1.0).abs() < 3e-4,
            "{distribution}: {found:?}"
        );
    }
}

#[test]
fn bounds_are_met_and_far_tails_are_accurate() {
    let values = numbers("{ normal = { mean = 0.0, sd = 1.0, bounds = [5.0, 5.5] } }");
    assert!(values.iter().all(|value| (5.0..=5.5).contains(value)));
    // Mean of a normal distribution between a and b: (density(a) - density(b)) / (probability between).
    let density = |x: f64| (-0.5 * x * x).exp() / TAU.sqrt();
    let beyond = |x: f64| 0.5 * libm::erfc(x / SQRT_2);
    let mean = (density(5.0) - density(5.5)) / (beyond(5.0) - beyond(5.5));
    assert!((moments(&values)[0] - mean).abs() < 1e-6);
}

#[test]
fn integers_and_choices_have_equal_probability() {
    let mut counts = BTreeMap::new();
    for value in draws("camera.views", "{ uniform = [3.0, 6.0] }") {
        *counts.entry(value.number().unwrap() as usize).or_insert(0) += 1;
    }
    assert_eq!(counts, [3, 4, 5, 6].map(|k| (k, 1 << 14)).into());
    let laws = ["total-force", "per-material-length"];
    let drawn = draws("heart.law", &format!("{{ choice = {laws:?} }}"));
    for law in laws {
        let law = FieldValue::Text(law.into());
        assert_eq!(drawn.iter().filter(|value| **value == law).count(), 1 << 15);
    }
}

#[test]
fn invalid_distributions_are_errors() {
    let error = |field: &str, distribution: &str| {
        let vary = format!("{field} = {distribution}");
        let error = Cohort::from_toml(&text(3, "", &vary)).unwrap_err();
        let said = error.to_string();
        assert!(said.contains(&format!("vary.{field}")), "{vary}: {said}");
    };
    for bad in [
        "{ uniform = [2.0, 1.0] }",
        "{ uniform = [-1e308, 1e308] }",
        "{ normal = { mean = 0.0, sd = 1e308 } }",
        "{ normal = { mean = 1.0, sd = 1.0, bounds = [2.0, 1.0] } }",
        "{ log-normal = { median = 1e300, factor = 20.0 } }",
        "{ normal = { mean = 0.0, sd = 0.0 } }",
        "{ normal = { mean = 0.0, sd = 1.0, bounds = [60.0, 70.0] } }",
        "{ normal = { mean = 0.0, sd = 1.0, bounds = [1.0, 1.0] } }",
        "{ log-normal = { median = 1.0, factor = 1.0 } }",
        "{ log-normal = { median = 1.0, factor = 2.0, bounds = [0.0, 1.0] } }",
        "{ choice = [] }",
    ] {
        error("pose.shift.1", bad);
    }
    // Valid in general, but not for integers.
    for bad in [
        "{ uniform = [0.0, 1e30] }",
        "{ uniform = [3.2, 3.8] }",
        "{ normal = { mean = 0.0, sd = 1e16 } }",
        "{ log-normal = { median = 1.0, factor = 100.0 } }",
    ] {
        // Its scenes may be outside the range of the field.
        let real = Cohort::from_toml(&text(3, "", &format!("pose.shift.1 = {bad}")));
        real.map_or_else(
            |error| assert!(error.to_string().contains("none of 64")),
            drop,
        );
        error("camera.views", bad);
    }
}
