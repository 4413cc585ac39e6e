//! The survey of a cohort, compared with its shards.

use crate::{all, with_rejected};
use heart_cohort::{RunOptions, survey};

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
    // The survey agrees with the result, except for the fraction of rejected members.
    let folder = tempfile::tempdir().unwrap();
    let report = &all(&cohort, folder.path(), 1, 2)[0];
    let kept = |all: u64, rejected: usize| (all as usize - rejected) as f64 / all as f64;
    let each = report.bytes as f64 / kept(40, report.rejected());
    let told = found.bytes as f64 / kept(8, found.rejected.len());
    assert!((told / each - 1.0).abs() < 0.01, "{told} {each}");
}
