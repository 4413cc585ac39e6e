//! One manifest of all shards.

use crate::{SCENE, all, names, with_rejected};
use heart_cohort::{Cohort, CohortError, Fault, merge};
use std::fs;

#[test]
fn a_manifest_has_a_row_for_every_member() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_rejected(9);
    let reports = all(&cohort, folder.path(), 3, 1);
    fs::write(
        folder.path().join("shard-00002-of-00003.json.7-7.tmp"),
        "half",
    )
    .unwrap();
    let report = merge(folder.path()).unwrap();
    assert_eq!((report.members, report.shards), (9, 3));
    assert_eq!(
        report.bytes,
        reports.iter().map(|report| report.bytes).sum::<u64>()
    );
    assert!(
        names(folder.path())
            .iter()
            .all(|name| !name.ends_with(".tmp"))
    );
    let mut csv = csv::Reader::from_path(folder.path().join("manifest.csv")).unwrap();
    let header = csv.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|other| other == name).unwrap();
    let rows: Vec<csv::StringRecord> = csv.records().map(Result::unwrap).collect();
    let expected: Vec<_> = reports.iter().flat_map(|report| &report.rows).collect();
    assert_eq!(rows.len(), 9);
    for (k, (row, expected)) in rows.iter().zip(&expected).enumerate() {
        assert_eq!(&row[column("key")], format!("{k:08}"));
        assert_eq!(
            &row[column("shard")],
            format!("shard-{:05}-of-00003.tar", k / 3 + 1)
        );
        assert_eq!(&row[column("blake3")], expected.blake3);
        assert_eq!(row[column("status")] == *"ok", expected.rejected.is_none());
        assert_eq!(
            row[column("reason")],
            *expected.rejected.as_deref().unwrap_or_default()
        );
        let gain: f64 = row[column("cycle.volume.gain")].parse().unwrap();
        assert_eq!(Some(gain), expected.values["cycle.volume.gain"].number());
        let edv = expected.numbers.get("edv").copied();
        assert_eq!(row[column("edv")].parse().ok(), edv);
        if edv.is_some() {
            // The piece is at the offset of the row: it begins with its name.
            let archive = fs::read(folder.path().join(&row[column("shard")])).unwrap();
            let at: usize = row[column("offset")].parse().unwrap();
            assert!(archive[at..].starts_with(&row.as_slice().as_bytes()[..8]));
        }
    }
    // The manifest is the same for any origin of the shards, and if it is written again.
    let bytes = fs::read(folder.path().join("manifest.csv")).unwrap();
    merge(folder.path()).unwrap();
    assert!(fs::read(folder.path().join("manifest.csv")).unwrap() == bytes);
}

#[test]
fn a_directory_without_all_shards_has_no_manifest() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(
        merge(folder.path()),
        Err(CohortError::NoShards { .. })
    ));
    let cohort = with_rejected(6);
    let reports = all(&cohort, folder.path(), 3, 1);
    let archive = fs::read(&reports[1].path).unwrap();
    for bytes in [None, Some(&archive[..100])] {
        fs::remove_file(&reports[1].path).unwrap();
        if let Some(bytes) = bytes {
            fs::write(&reports[1].path, bytes).unwrap();
        }
        let error = merge(folder.path()).unwrap_err();
        let CohortError::Faults { faults, .. } = error else {
            panic!("{error}")
        };
        let fault = match bytes {
            None => Fault::Missing { following: 0 },
            Some(_) => Fault::Archive { member: None },
        };
        let file = "shard-00002-of-00003.tar";
        assert_eq!((faults.len(), &*faults[0].file), (1, file));
        assert_eq!(faults[0].fault, fault);
        fs::write(&reports[1].path, &archive).unwrap();
    }
    assert!(!folder.path().join("manifest.csv").exists());
    // Each file of a second division is a fault.
    let other = tempfile::tempdir().unwrap();
    all(&cohort, other.path(), 2, 1);
    for entry in fs::read_dir(other.path()).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    let error = merge(folder.path()).unwrap_err();
    let CohortError::Faults { faults, .. } = error else {
        panic!("{error}")
    };
    let found: Vec<_> = (faults.iter())
        .map(|found| (&*found.file, &found.fault))
        .collect();
    let expected = [
        "shard-00001-of-00002.json",
        "shard-00001-of-00002.tar",
        "shard-00002-of-00002.json",
        "shard-00002-of-00002.tar",
    ];
    assert_eq!(found, expected.map(|name| (name, &Fault::Name)));
}

/// Names of cases and drawn names come from the user; a spreadsheet must not evaluate them.
#[test]
fn no_cell_is_a_formula() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!(
        "members = 4\n{SCENE}[[cases]]\nname = '=HYPERLINK(\"x\"),1'\n[[cases]]\nname = \"-a; b\"\n"
    );
    let cohort = Cohort::from_toml(&text).unwrap();
    all(&cohort, folder.path(), 1, 1);
    merge(folder.path()).unwrap();
    let mut csv = csv::Reader::from_path(folder.path().join("manifest.csv")).unwrap();
    let at = csv
        .headers()
        .unwrap()
        .iter()
        .position(|name| name == "case");
    for (k, row) in csv.records().enumerate() {
        let row = row.unwrap();
        let case = cohort.member(k as u64).unwrap().case;
        assert_eq!(row[at.unwrap()], format!("'{case}"));
        // Numbers stay numbers: nothing else begins with a sign.
        assert!(row.iter().all(|cell| {
            !cell.starts_with(['=', '+', '-', '@']) || cell.parse::<f64>().is_ok()
        }));
    }
}
