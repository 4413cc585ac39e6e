//! A folder of shards as a whole: verified, surveyed before it is there.

use crate::{all, with_refused};
use heart_cohort::{CohortError, RunOptions, survey, verify};
use std::fs;

#[test]
fn members_computed_again_have_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_refused(9);
    all(&cohort, folder.path(), 3, 2);
    let options = RunOptions::new(2);
    let report = verify(&cohort, folder.path(), 100, 1, &options).unwrap();
    assert_eq!((report.shards, report.members.len()), (3, 9));
    assert!(report.refused > 0 && report.refused < 9);
    let [a, b] = [1, 2].map(|seed| {
        verify(&cohort, folder.path(), 4, seed, &options)
            .unwrap()
            .members
    });
    assert!(a.len() == 4 && b.len() == 4 && a != b);
}

/// A flipped bit is found by the checksums, and one that somebody has hidden from them by the bytes.
#[test]
fn what_was_changed_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_refused(4);
    let reports = all(&cohort, folder.path(), 2, 1);
    let path = &reports[1].path;
    let row = reports[1]
        .rows
        .iter()
        .find(|row| row.refused.is_none())
        .unwrap();
    let mut bytes = fs::read(path).unwrap();
    let at = (row.offset + row.bytes) as usize - 1;
    bytes[at] ^= 1;
    fs::write(path, &bytes).unwrap();
    let found = verify(&cohort, folder.path(), 0, 1, &RunOptions::new(1));
    assert!(matches!(
        found,
        Err(CohortError::Missing {
            missing: 1,
            of: 2,
            first: 2,
            ..
        })
    ));
    let record = path.with_extension("json");
    let piece = &bytes[row.offset as usize..=at];
    let sum = blake3::hash(piece).to_string();
    let text = fs::read_to_string(&record)
        .unwrap()
        .replace(&row.blake3, &sum);
    fs::write(&record, text).unwrap();
    let found = verify(&cohort, folder.path(), 9, 1, &RunOptions::new(1));
    assert!(matches!(found, Err(CohortError::Differs { member, .. }) if member == row.member));
}

#[test]
fn a_survey_tells_ranges_bytes_and_reasons() {
    let cohort = with_refused(40);
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
    assert!(!found.refused.is_empty() && found.members_per_second > 0.0);
    // What is told is what comes out, but for the share of the refused.
    let folder = tempfile::tempdir().unwrap();
    let report = &all(&cohort, folder.path(), 1, 2)[0];
    let kept = |all: u64, refused: usize| (all as usize - refused) as f64 / all as f64;
    let each = report.bytes as f64 / kept(40, report.refused());
    let told = found.bytes as f64 / kept(8, found.refused.len());
    assert!((told / each - 1.0).abs() < 0.01, "{told} {each}");
}
