//! Findings of `verify`: every change of a byte, a file or a name, and nothing else.

use crate::{all, shard, text, with_rejected};
use heart_cohort::heart_phantom::no_observer;
use heart_cohort::{
    Cohort, CohortError, Fault, RunOptions, Shard, VerifyReport, merge, run_shard, verify,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fs;
use std::path::{Path, PathBuf};

fn verified(cohort: &Cohort, folder: &Path, count: u64) -> VerifyReport {
    verify(cohort, folder, count, 1, &RunOptions::new(2)).unwrap()
}

#[track_caller]
fn finds(cohort: &Cohort, folder: &Path, wanted: &[(&str, Fault)]) {
    let faults = verified(cohort, folder, 0).faults;
    let found: Vec<(&str, Fault)> = (faults.iter())
        .map(|found| (&*found.file, found.fault.clone()))
        .collect();
    assert_eq!(found, wanted);
}

/// Six members in three complete shards.
fn six() -> (Cohort, tempfile::TempDir, Vec<PathBuf>) {
    let (cohort, folder) = (with_rejected(6), tempfile::tempdir().unwrap());
    let paths = all(&cohort, folder.path(), 3, 1)
        .into_iter()
        .map(|report| report.path)
        .collect();
    (cohort, folder, paths)
}

#[test]
fn only_recomputed_members_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_rejected(9);
    all(&cohort, folder.path(), 3, 2);
    let report = verified(&cohort, folder.path(), 100);
    assert_eq!(
        (report.complete, report.shards, report.faults.len()),
        (3, 3, 0)
    );
    assert_eq!(report.recomputed, (0..9).collect::<Vec<u64>>());
    assert!(report.rejected > 0 && report.rejected < 9);
    let [a, b] = [1, 2].map(|seed| {
        let options = RunOptions::new(2);
        verify(&cohort, folder.path(), 4, seed, &options)
            .unwrap()
            .recomputed
    });
    assert!(a.len() == 4 && b.len() == 4 && a != b);
    let none = verified(&cohort, folder.path(), 0);
    assert_eq!(
        (none.complete, none.recomputed.len(), none.rejected),
        (3, 0, 0)
    );
    // Those of a missing shard are not.
    fs::remove_file(folder.path().join("shard-00002-of-00003.json")).unwrap();
    let report = verified(&cohort, folder.path(), 100);
    assert_eq!(
        (report.complete, report.recomputed),
        (2, vec![0, 1, 2, 6, 7, 8])
    );
}

/// One byte of a record or of an archive, anywhere, with any other value.
#[test]
fn every_change_of_a_byte_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    let vary = "heart.outer.radius = { choice = [2.8, 1.7] }";
    let text = text(4, "seed = 5", vary).replace(
        "output.write = [\"truth\", \"projections\", \"reconstruction\", \"labels\"]",
        "output.write = [\"labels\"]",
    );
    let cohort = Cohort::from_toml(&text).unwrap();
    let reports = all(&cohort, folder.path(), 2, 1);
    assert!(reports.iter().any(|report| report.rejected == 1));
    let files: Vec<(PathBuf, Vec<u8>)> = (reports.iter())
        .flat_map(|report| [report.path.clone(), report.path.with_extension("json")])
        .map(|path| (path.clone(), fs::read(path).unwrap()))
        .collect();
    // Two copies of the folder, each with half of the changes.
    std::thread::scope(|threads| {
        for seed in [30, 31] {
            let (cohort, files) = (&cohort, &files);
            threads.spawn(move || changed_bytes_are_detected(cohort, files, seed));
        }
    });
}

/// Changes one byte of a copy of the files, 5000 times.
fn changed_bytes_are_detected(cohort: &Cohort, files: &[(PathBuf, Vec<u8>)], seed: u64) {
    let folder = tempfile::tempdir().unwrap();
    let own = |path: &PathBuf| folder.path().join(path.file_name().unwrap());
    for (path, bytes) in files {
        fs::write(own(path), bytes).unwrap();
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for k in 0..5_000 {
        let (path, bytes) = &files[k % files.len()];
        let mut changed = bytes.clone();
        let at = (random.next_u64() % bytes.len() as u64) as usize;
        changed[at] ^= (1 + random.next_u64() % 255) as u8;
        fs::write(own(path), &changed).unwrap();
        let report = verified(cohort, folder.path(), 0);
        assert!(
            (report.faults.len(), report.complete) == (1, 1),
            "byte {at} of {path:?}: {report:?}"
        );
        fs::write(own(path), bytes).unwrap();
    }
    finds(cohort, folder.path(), &[]);
}

#[test]
fn empty_truncated_missing_and_copied_files_are_detected() {
    let (cohort, folder, paths) = six();
    let [archive, record] = ["tar", "json"].map(|extension| paths[1].with_extension(extension));
    let names = ["shard-00002-of-00003.tar", "shard-00002-of-00003.json"];
    for (path, name) in [&archive, &record].into_iter().zip(names) {
        let bytes = fs::read(path).unwrap();
        let fault = match path == &record {
            true => Fault::Checksum,
            false => Fault::Archive { member: None },
        };
        let mut longer = bytes.clone();
        longer.push(0);
        for changed in [&[][..], &bytes[..1], &bytes[..bytes.len() - 1], &longer] {
            fs::write(path, changed).unwrap();
            finds(&cohort, folder.path(), &[(name, fault.clone())]);
            assert!(matches!(
                merge(folder.path()),
                Err(CohortError::Faults { .. })
            ));
        }
        fs::remove_file(path).unwrap();
        let following = 0;
        finds(
            &cohort,
            folder.path(),
            &[(name, Fault::Missing { following })],
        );
        fs::write(path, bytes).unwrap();
    }
    finds(&cohort, folder.path(), &[]);
    // The files of another shard, under these names.
    let kept = [&archive, &record].map(|path| fs::read(path).unwrap());
    for extension in ["tar", "json"] {
        fs::copy(
            paths[0].with_extension(extension),
            paths[1].with_extension(extension),
        )
        .unwrap();
    }
    finds(&cohort, folder.path(), &[(names[1], Fault::Members)]);
    fs::write(&record, &kept[1]).unwrap();
    let faults = verified(&cohort, folder.path(), 0).faults;
    assert!(matches!(faults[0].fault, Fault::Archive { .. }) && faults.len() == 1);
    fs::write(&archive, &kept[0]).unwrap();
    // Two shards are missing.
    for path in &paths[1..] {
        fs::remove_file(path).unwrap();
        fs::remove_file(path.with_extension("json")).unwrap();
    }
    finds(
        &cohort,
        folder.path(),
        &[(names[1], Fault::Missing { following: 1 })],
    );
}

/// Names that resemble that of a shard are detected; none causes the program to allocate memory for missing shards, or to wait.
#[test]
fn invalid_shard_names_are_detected() {
    let (cohort, folder, paths) = six();
    for name in [
        "shard-0-of-0.json",
        "shard-1-of-3.json",
        "shard-00004-of-00003.tar",
        "shard-00000-of-00003.json",
        "shard-1-of-18446744073709551615.json",
        "shard-00001-of-10000000000.json",
        "shard-00001-of-00003 (copy).tar",
        "shard-00001-of-00003.tar.gz",
        "shard-x.json",
        // valid names of other numbers of shards
        "shard-00001-of-00001.json",
        "shard-00004-of-00040.tar",
    ] {
        let path = folder.path().join(name);
        fs::copy(&paths[0], &path).unwrap();
        finds(&cohort, folder.path(), &[(name, Fault::Name)]);
        assert!(
            matches!(merge(folder.path()), Err(CohortError::Faults { .. })),
            "{name}"
        );
        fs::remove_file(path).unwrap();
    }
    // A renamed file is missing, for any new name.
    fs::rename(&paths[2], folder.path().join("other.tar")).unwrap();
    let name = "shard-00003-of-00003.tar";
    finds(
        &cohort,
        folder.path(),
        &[(name, Fault::Missing { following: 0 })],
    );
    // Such a name alone is not a cohort; with a valid number of shards all other shards are missing.
    let alone = tempfile::tempdir().unwrap();
    let empty = |name: &str| fs::write(alone.path().join(name), "").unwrap();
    empty("shard-0-of-0.json");
    let options = RunOptions::new(1);
    assert!(matches!(
        verify(&cohort, alone.path(), 9, 1, &options),
        Err(CohortError::NoShards { .. })
    ));
    fs::remove_file(alone.path().join("shard-0-of-0.json")).unwrap();
    empty("shard-00001-of-67108864.json");
    let missing = Fault::Missing {
        following: 67_108_862,
    };
    let (first, second) = (
        "shard-00001-of-67108864.json",
        "shard-00002-of-67108864.json",
    );
    finds(
        &cohort,
        alone.path(),
        &[(second, missing), (first, Fault::Checksum)],
    );
}

/// A name of another number of shards hides no other fault.
#[test]
fn a_stray_name_is_listed_with_all_other_faults() {
    let (cohort, folder, paths) = six();
    fs::write(folder.path().join("shard-00001-of-00006.tar"), "").unwrap();
    fs::write(&paths[0], "").unwrap();
    fs::remove_file(&paths[2]).unwrap();
    let faults = [
        ("shard-00001-of-00006.tar", Fault::Name),
        ("shard-00001-of-00003.tar", Fault::Archive { member: None }),
        ("shard-00003-of-00003.tar", Fault::Missing { following: 0 }),
    ];
    finds(&cohort, folder.path(), &faults);
    let report = verified(&cohort, folder.path(), 9);
    assert_eq!((report.complete, report.recomputed), (1, vec![2, 3]));
}

/// Opening a pipe would block.
#[cfg(unix)]
#[test]
fn pipes_and_directories_are_faults() {
    let (cohort, folder, paths) = six();
    let run = |paths: &Path| {
        let shard = Shard { shard: 1, of: 3 };
        let run = run_shard(
            &cohort,
            folder.path(),
            shard,
            &RunOptions::new(1),
            &no_observer,
        );
        let Err(CohortError::Faults { faults, .. }) = run else {
            panic!("{run:?}")
        };
        assert_eq!(faults[0].fault, Fault::NotAFile);
        assert!(paths.ends_with(&faults[0].file));
    };
    for extension in ["json", "tar"] {
        let path = paths[0].with_extension(extension);
        let name = path.file_name().unwrap().to_str().unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        finds(&cohort, folder.path(), &[(name, Fault::NotAFile)]);
        assert!(matches!(
            merge(folder.path()),
            Err(CohortError::Faults { .. })
        ));
        run(&path);
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        finds(&cohort, folder.path(), &[(name, Fault::NotAFile)]);
        run(&path);
        fs::remove_dir(&path).unwrap();
        fs::write(&path, bytes).unwrap();
    }
    finds(&cohort, folder.path(), &[]);
}

/// A forged record with a new checksum: rows, keys and draws are still verified, numbers only by recomputed members.
#[test]
fn forged_records_are_detected() {
    let (cohort, folder, paths) = six();
    let record = paths[0].with_extension("json");
    let whole = fs::read_to_string(&record).unwrap();
    let name = "shard-00001-of-00003.json";
    let forge = |change: &dyn Fn(&mut serde_json::Value)| {
        let mut json: serde_json::Value = serde_json::from_str(&whole).unwrap();
        json.as_object_mut().unwrap().remove("blake3");
        change(&mut json);
        let text = format!("{json:#}");
        let body = text.strip_suffix("\n}").unwrap();
        let sum = blake3::hash(body.as_bytes());
        fs::write(&record, format!("{body},\n  \"blake3\": \"{sum}\"\n}}\n")).unwrap();
    };
    forge(&|_| ());
    finds(&cohort, folder.path(), &[]);
    let members: [&dyn Fn(&mut serde_json::Value); 7] = [
        &|json| json["rows"] = serde_json::json!([]),
        &|json| drop(json["rows"].as_array_mut().unwrap().pop()),
        &|json| json["rows"].as_array_mut().unwrap().reverse(),
        &|json| json["rows"][1]["member"] = 0.into(),
        &|json| json["rows"][1]["key"] = "00000007".into(),
        &|json| json["rows"][1]["offset"] = 7.into(),
        &|json| json["members"] = u64::MAX.into(),
    ];
    for change in members {
        forge(change);
        finds(&cohort, folder.path(), &[(name, Fault::Members)]);
    }
    let drawn: [&dyn Fn(&mut serde_json::Value); 3] = [
        &|json| json["rows"][1]["values"]["cycle.volume.gain"] = 0.5.into(),
        &|json| json["rows"][1]["attempts"] = 2.into(),
        &|json| json["rows"][1]["case"] = "x".into(),
    ];
    for change in drawn {
        forge(change);
        finds(
            &cohort,
            folder.path(),
            &[(name, Fault::Drawn { member: 1 })],
        );
    }
    forge(&|json| json["cohort"] = "0".into());
    finds(&cohort, folder.path(), &[(name, Fault::OtherCohort)]);
    let report = shard(&cohort, &folder.path().join("again"), [1, 3], 1);
    let k = report
        .rows
        .iter()
        .position(|row| row.rejected.is_none())
        .unwrap();
    let member = report.rows[k].member;
    let recomputed: [&dyn Fn(&mut serde_json::Value); 2] = [
        &|json| json["rows"][k]["numbers"]["edv"] = 100.0.into(),
        &|json| json["rows"][k]["warnings"] = serde_json::json!(["x"]),
    ];
    for change in recomputed {
        forge(change);
        finds(&cohort, folder.path(), &[]);
        let report = verified(&cohort, folder.path(), 9);
        assert_eq!(report.faults[0].fault, Fault::Recomputed { member });
        assert!(report.recomputed.len() == 5 && !report.recomputed.contains(&member));
    }
    // An archive forged with its record.
    let row = &report.rows[k];
    let mut bytes = fs::read(&paths[0]).unwrap();
    let piece = row.offset as usize..(row.offset + row.bytes) as usize;
    bytes[piece.end - 1] ^= 1;
    fs::write(&paths[0], &bytes).unwrap();
    let sum = blake3::hash(&bytes[piece]).to_string();
    forge(&|json| json["rows"][k]["blake3"] = sum.clone().into());
    finds(&cohort, folder.path(), &[]);
    let faults = verified(&cohort, folder.path(), 9).faults;
    assert_eq!(faults[0].fault, Fault::Recomputed { member });
}
