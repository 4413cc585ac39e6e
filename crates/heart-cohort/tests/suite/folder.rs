//! The survey of a cohort, compared with its shards.

use crate::{all, text, with_rejected};
use heart_cohort::{
    Cohort, CohortError, RunOptions, Shard, export, list_shards, merge, survey, verify,
};
use std::fs;

#[test]
fn a_survey_contains_ranges_bytes_and_reasons() {
    let cohort = with_rejected(40);
    let found = survey(&cohort, 8, &RunOptions::new(2)).unwrap();
    assert_eq!(
        (found.members, found.drawn, found.draws, found.tried),
        (40, 40, 40, 8)
    );
    let [gain, radius] = &found.fields[..] else {
        panic!()
    };
    assert_eq!(
        (gain.path.as_str(), radius.path.as_str()),
        ("cycle.volume.gain", "heart.outer.radius")
    );
    let [least, mean, most] = gain.range.unwrap();
    assert!(0.2 < least && least < mean && mean < most && most < 0.6);
    assert_eq!(
        (
            radius.values,
            radius.range.map(|[least, _, most]| [least, most])
        ),
        (Some(3), Some([1.7, 2.8]))
    );
    assert!(!found.rejected.is_empty() && found.members_per_second > 0.0);
    assert!(found.warnings.values().all(|count| (1..=8).contains(count)));
    // The survey agrees with the result, except for the fraction of rejected members.
    let folder = tempfile::tempdir().unwrap();
    let report = &all(&cohort, folder.path(), 1, 2)[0];
    // Each computed member has few views.
    assert!(!found.warnings.is_empty() && report.warned == 40 - report.rejected);
    let merged = merge(folder.path()).unwrap();
    let verified = verify(&cohort, folder.path(), 0, 1, &RunOptions::new(1)).unwrap();
    assert_eq!([merged.warned, verified.warned], [report.warned; 2]);
    let one = Shard { shard: 1, of: 1 };
    assert_eq!(list_shards(folder.path()).unwrap(), [one]);
    let kept = |all: u64, rejected: u64| (all - rejected) as f64 / all as f64;
    let each = report.bytes as f64 / kept(40, report.rejected);
    let told = found.bytes as f64 / kept(8, found.rejected.len() as u64);
    assert!((told / each - 1.0).abs() < 0.01, "{told} {each}");
}

#[test]
fn files_of_other_programs_are_not_replaced() {
    let cohort = Cohort::from_toml(&text(2, "", "")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    all(&cohort, folder, 1, 1);
    let foreign = |result: Result<(), CohortError>, name: &str| {
        let error = result.unwrap_err().to_string();
        assert!(
            error.contains(name) && error.contains("not written by this program"),
            "{error}"
        );
        assert_eq!(fs::read_to_string(folder.join(name)).unwrap(), "mine");
        fs::remove_file(folder.join(name)).unwrap();
    };
    for name in ["manifest.csv", "dataset.json"] {
        fs::write(folder.join(name), "mine").unwrap();
    }
    foreign(merge(folder).map(drop), "manifest.csv");
    foreign(
        export(&cohort, 0, folder, 1 << 29).map(drop),
        "dataset.json",
    );
    // Their own are.
    for _ in 0..2 {
        assert_eq!(merge(folder).unwrap().members, 2);
        assert_eq!(export(&cohort, 0, folder, 1 << 29).unwrap().len(), 5);
    }
}
