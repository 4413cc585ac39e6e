//! Distributions of members.

use crate::text;
use heart_cohort::{Cohort, CohortError};
use heart_phantom::Phantom;
use std::collections::BTreeMap;

fn numbers(cohort: &Cohort, path: &str) -> Vec<f64> {
    (0..cohort.members())
        .map(|k| cohort.member(k).unwrap().number(path).unwrap())
        .collect()
}

/// Kolmogorov and Smirnov's distance of some numbers from the uniform distribution on [0, 1].
fn distance(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let n = numbers.len() as f64;
    let far = |(k, x): (usize, &f64)| {
        (x - k as f64 / n)
            .abs()
            .max((x - (k as f64 + 1.0) / n).abs())
    };
    numbers.iter().enumerate().map(far).fold(0.0, f64::max)
}

#[test]
fn plain_draws_follow_the_distribution_and_sobol_draws_are_even() {
    let vary = "pose.shift.1 = { uniform = [0.0, 1.0] }\npose.shift.3 = { uniform = [0.0, 1.0] }";
    let of = |head: &str| Cohort::from_toml(&text(512, head, vary)).unwrap();
    let (plain, sobol) = (of("seed = 2"), of("sampling = \"sobol\"\nseed = 2"));
    for path in ["pose.shift.1", "pose.shift.3"] {
        // It exceeds 1.95 / sqrt(n) with a probability of 1/1000.
        let found = distance(numbers(&plain, path));
        assert!(
            found < 1.95 / 512f64.sqrt() && found > 2.0 / 512.0,
            "{found}"
        );
        // Each of 512 equal intervals has one point.
        assert!(distance(numbers(&sobol, path)) <= 1.0 / 512.0 + 1e-12);
    }
    // Together, too: each of 16 x 16 squares has two (the pair of the sequence's second and third coordinate has t = 1).
    let [x, z] = ["pose.shift.1", "pose.shift.3"].map(|path| numbers(&sobol, path));
    let mut seen = vec![0; 256];
    for (x, z) in x.iter().zip(&z) {
        seen[(x * 16.0) as usize * 16 + (z * 16.0) as usize] += 1;
    }
    assert_eq!(seen, vec![2; 256]);
    let correlation: f64 = (numbers(&plain, "pose.shift.1").iter())
        .zip(numbers(&plain, "pose.shift.3"))
        .map(|(x, z)| (x - 0.5) * (z - 0.5) * 12.0 / 512.0)
        .sum();
    assert!(correlation.abs() < 3.3 / 512f64.sqrt(), "{correlation}");
}

#[test]
fn a_member_depends_on_the_text_and_its_index_only() {
    let vary = "heart.inner.radius = { uniform = [1.5, 2.0] }";
    let member = |members, seed: u64, head: &str| {
        let text = text(members, &format!("seed = {seed}\n{head}"), vary);
        Cohort::from_toml(&text).unwrap().member(3).unwrap()
    };
    let first = member(10, 1, "");
    assert_eq!(first, member(10, 1, "# a comment"));
    // More members do not change the existing ones.
    assert_eq!(first, member(10_000, 1, ""));
    assert_ne!(first.values, member(10, 2, "").values);
    // Each member has independent noise.
    let cohort = Cohort::from_toml(&text(5, "", vary)).unwrap();
    let mut seeds = numbers(&cohort, "noise.seed");
    seeds.dedup();
    assert_eq!(seeds.len(), 5);
    assert_ne!(first.number("noise.seed"), Some(1.0));
    let digest = |text: &str| Cohort::from_toml(text).unwrap().digest().to_owned();
    assert_eq!(
        digest("members = 3"),
        digest("# x\nmembers = 3 # y\nseed = 1\n")
    );
    assert_ne!(digest("members = 3"), digest("members = 4"));
}

#[test]
fn constraints_are_met_and_preserve_the_remaining_distribution() {
    for sampling in ["plain", "sobol"] {
        let head = format!(
            "sampling = \"{sampling}\"\nconstraints = [\"pose.shift.1 + pose.shift.2 < 1\", \"2 * pose.shift.1 >= 0.2\"]"
        );
        let vary =
            "pose.shift.1 = { uniform = [0.0, 1.0] }\npose.shift.2 = { uniform = [0.0, 1.0] }";
        let cohort = Cohort::from_toml(&text(2000, &head, vary)).unwrap();
        let [x, y] = ["pose.shift.1", "pose.shift.2"].map(|path| numbers(&cohort, path));
        assert!(x.iter().zip(&y).all(|(x, y)| x + y < 1.0 && *x >= 0.1));
        // x over the triangle from 0.1: density 2 (1 - x) / 0.81, fraction below x 1 - ((1 - x) / 0.9)^2.
        let shares = x.iter().map(|x| 1.0 - ((1.0 - x) / 0.9).powi(2)).collect();
        assert!(distance(shares) < 1.95 / 2000f64.sqrt(), "{sampling}");
        let draws: u32 = (0..2000).map(|k| cohort.member(k).unwrap().attempts).sum();
        // A draw is accepted with probability 0.405.
        assert!(
            (f64::from(draws) / 2000.0 * 0.405 - 1.0).abs() < 0.1,
            "{sampling}: {draws}"
        );
    }
}

#[test]
fn whole_numbers_names_and_tables_vary_too() {
    let vary = "camera.views = { uniform = [3, 5] }
heart.law = { choice = [\"total-force\", \"per-material-length\"] }
cycle.volume = { choice = [{ gain = 0.5 }, { ejection_fraction = 0.3 }] }
reconstruction.pixels = { choice = [8, 16] }
pose.centre = { normal = { mean = 5.0, sd = 0.1 } }
blur.fwhm = { log-normal = { median = 1.0, factor = 1.3 } }";
    let head = "constraints = [\"camera.views * 2 < 9\"]";
    let cohort = Cohort::from_toml(&text(200, head, vary)).unwrap();
    let mut views = BTreeMap::new();
    for k in 0..200 {
        let member = cohort.member(k).unwrap();
        let scene = member.scene().unwrap();
        *views.entry(scene.camera.views).or_insert(0) += 1;
        scene.check().unwrap();
        assert!(scene.blur.unwrap().fwhm > 0.0 && scene.pose.centre.is_some());
    }
    assert_eq!(views.keys().copied().collect::<Vec<_>>(), [3, 4]);
    assert!(
        views.values().all(|count| (70..130).contains(count)),
        "{views:?}"
    );
}

#[test]
fn cases_have_their_fractions_and_their_own_fields() {
    let text = format!(
        "members = 900\nsampling = \"sobol\"\n{}\n[vary]\ncycle.volume.gain = {{ uniform = [0.5, 0.6] }}
[[cases]]\nname = \"healthy\"\nweight = 2.0
[[cases]]\nscene.defects = [{{ layers = [0.0, 1.0], s = [0.2, 0.3], azimuths_degrees = [0.0, 90.0], activity = 0.1 }}]
vary.cycle.volume.gain = {{ uniform = [0.2, 0.3] }}\nvary.defects.1.activity = {{ uniform = [0.0, 0.2] }}
[[cases]]\nname = \"fixed\"\nweight = 3\nscene.cycle.volume = {{ ejection_fraction = 0.25 }}\n",
        super::SCENE
    );
    let cohort = Cohort::from_toml(&text).unwrap();
    assert_eq!(
        cohort.cases().collect::<Vec<_>>(),
        ["healthy", "case 2", "fixed"]
    );
    let mut counts = [0; 3];
    for k in 0..900 {
        let member = cohort.member(k).unwrap();
        counts[member.case_index] += 1;
        let gain = member.number("cycle.volume.gain");
        match member.case_index {
            0 => assert!(gain.unwrap() >= 0.5 && member.number("defects.1.activity").is_none()),
            1 => assert!(gain.unwrap() < 0.3 && member.number("defects.1.activity").unwrap() < 0.2),
            _ => {
                assert!(member.values.is_empty());
                assert_eq!(member.number("cycle.volume.ejection_fraction"), Some(0.25));
            }
        }
    }
    // 900 are four blocks of powers of two, each with an error of less than one point at either end of an interval.
    assert!(
        counts
            .iter()
            .zip([300, 150, 450])
            .all(|(n, wanted): (&i32, i32)| (n - wanted).abs() < 9),
        "{counts:?}"
    );
}

#[test]
fn the_template_is_a_cohort() {
    let cohort = Cohort::from_toml(Cohort::TEMPLATE).unwrap();
    for k in 0..50 {
        let member = cohort.member(k).unwrap();
        member.scene().unwrap().check().unwrap();
        let [inner, outer] =
            ["heart.inner.radius", "heart.outer.radius"].map(|path| member.number(path).unwrap());
        assert!((0.8..1.4).contains(&(outer - inner)));
    }
    let values = cohort.member(0).unwrap().values;
    assert!(values.contains_key("activity.cavity.concentration"));
}

#[test]
fn the_clinical_template_is_a_cohort_without_warnings() {
    let cohort = Cohort::from_toml(Cohort::CLINICAL).unwrap();
    let mut defects = 0;
    for k in 0..50 {
        let scene = cohort.member(k).unwrap().scene().unwrap();
        assert!(scene.chest.is_some() && scene.collimator.is_some() && scene.noise.is_some());
        defects += scene.defects.len();
        let warnings = Phantom::new(scene).unwrap().warnings().unwrap();
        assert!(warnings.is_empty(), "{k}: {warnings:?}");
    }
    assert!((15..35).contains(&defects), "{defects} of 50 have a defect");
}

/// A field that varies within a table that varies: the constraint uses the value in the scene.
#[test]
fn constraints_read_the_field_inside_a_drawn_table() {
    let head = "constraints = [\"cycle.volume.gain > 0.5\"]";
    let vary = "cycle.volume = { choice = [{ gain = 0.2 }, { gain = 0.9 }] }\n\"cycle.volume.gain\" = { uniform = [0.3, 0.8] }";
    let cohort = Cohort::from_toml(&text(200, head, vary)).unwrap();
    let mut tables = 0;
    for k in 0..200 {
        let member = cohort.member(k).unwrap();
        let gain = member.number("cycle.volume.gain").unwrap();
        let drawn = member.values;
        assert_eq!(drawn["cycle.volume.gain"].number(), Some(gain));
        assert!(gain > 0.5 && gain <= 0.8);
        tables += u32::from(drawn["cycle.volume"].to_string() == "{\"gain\":0.2}");
    }
    // Either table is equally likely, whatever its value of the field.
    assert!((70..130).contains(&tables), "{tables}");
}

#[test]
fn a_member_that_does_not_exist_is_an_error() {
    let cohort = Cohort::from_toml("members = 5").unwrap();
    for member in [5, 99, u64::MAX] {
        let error = cohort.member(member).unwrap_err();
        assert!(matches!(error, CohortError::NoMember { members: 5, .. }));
    }
}
