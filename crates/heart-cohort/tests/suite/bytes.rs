//! The bytes of members, and their reproducibility.

use crate::{all, names, shard, text, with_rejected};
use heart_cohort::heart_phantom::{Phantom, Scene};
use heart_cohort::{Cohort, Row};
use std::fs;
use std::io::Read;
use std::path::Path;

/// The pieces of all members, one after the other, and their rows without the position in a shard.
fn pieces(folder: &Path, of: u64, threads: usize) -> (Vec<u8>, Vec<Row>) {
    let (mut bytes, mut rows) = (Vec::new(), Vec::new());
    for report in all(&with_rejected(14), folder, of, threads) {
        let archive = fs::read(&report.path).unwrap();
        assert_eq!(archive.len() as u64, report.bytes);
        // Without the two empty blocks at the end.
        bytes.extend_from_slice(&archive[..archive.len() - 1024]);
        rows.extend(report.rows.into_iter().map(|row| {
            let mut row = row;
            row.offset = 0;
            row
        }));
    }
    (bytes, rows)
}

#[test]
fn members_are_bitwise_independent_of_shards_and_threads() {
    let folder = tempfile::tempdir().unwrap();
    let expected = pieces(&folder.path().join("serial"), 1, 1);
    assert_eq!(expected.1.len(), 14);
    let keys: Vec<String> = (0..14).map(|k| format!("{k:08}")).collect();
    assert!(
        expected.1.iter().map(|row| &row.key).eq(&keys),
        "no key is missing"
    );
    for (of, threads) in [(1, 2), (2, 1), (2, 2), (7, 1), (7, 2), (14, 3)] {
        let found = pieces(&folder.path().join(format!("{of}-{threads}")), of, threads);
        assert_eq!(found.1, expected.1, "{of} shards, {threads} threads");
        assert!(found.0 == expected.0, "{of} shards, {threads} threads");
    }
}

/// The archive by another reader; the arrays by a separate phantom of the member's scene.
#[test]
fn a_shard_contains_the_data_of_its_members() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_rejected(6);
    let report = shard(&cohort, folder.path(), [1, 1], 2);
    let kept: Vec<&Row> = report
        .rows
        .iter()
        .filter(|row| row.rejected.is_none())
        .collect();
    assert!(kept.len() < 6 && !kept.is_empty());
    let mut archive = tar::Archive::new(fs::File::open(&report.path).unwrap());
    let mut files = Vec::new();
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let header = entry.header();
        let fixed = [header.mode(), header.mtime().map(|time| time as u32)].map(Result::unwrap);
        assert_eq!(fixed, [0o644, 0]);
        assert_eq!([header.uid().unwrap(), header.gid().unwrap()], [0; 2]);
        let name = entry.path().unwrap().to_string_lossy().into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        files.push((name, bytes));
    }
    let wanted = [
        "scene.json",
        "numbers.json",
        "cls",
        "geometry.json",
        "projections.npy",
        "reconstruction.npy",
        "truth.npy",
        "labels.npy",
    ];
    let expected = kept
        .iter()
        .flat_map(|row| wanted.map(|name| format!("{}.{name}", row.key)));
    assert!(files.iter().map(|(name, _)| name.clone()).eq(expected));
    for (row, files) in kept.iter().zip(files.chunks(wanted.len())) {
        let scene: Scene = serde_json::from_slice(&files[0].1).unwrap();
        assert_eq!(cohort.member(row.member).unwrap().scene().unwrap(), scene);
        let phantom = Phantom::new(scene).unwrap();
        let numbers: serde_json::Value = serde_json::from_slice(&files[1].1).unwrap();
        let edv = numbers["numbers"]["edv"].as_f64().unwrap();
        assert_eq!(edv, phantom.numbers().unwrap().edv);
        assert_eq!(row.numbers["edv"], edv);
        let close = |file: usize, shape: &str, of: &dyn Fn(usize) -> Vec<f32>| {
            let samples = npy(&files[file].1, shape);
            let expected: Vec<f32> = (0..2).flat_map(of).collect();
            assert_eq!(samples.len(), expected.len());
            let most = expected.iter().copied().fold(0.0, f32::max);
            assert!(most > 0.0);
            // Gates that share a shape are summed in another order: rounding of f32.
            let worst =
                (samples.iter().zip(&expected)).fold(0f32, |w, (a, b)| w.max((a - b).abs()));
            assert!(worst <= 2e-6 * most, "{shape}: {worst}");
        };
        close(6, "(2, 8, 8, 8)", &|gate| phantom.truth(gate).unwrap());
        let volumes = npy(&files[5].1, "(2, 8, 8, 8)");
        assert!(volumes.iter().any(|sample| *sample > 0.0));
        // With noise, counts in the units of the samples.
        let views = npy(&files[4].1, "(2, 3, 8, 8)");
        assert!(
            views
                .iter()
                .all(|sample| ((sample * 100.0).round() / 100.0 - sample).abs() < 1e-5)
        );
        let phases = phantom.phases();
        let labels: Vec<u8> = phases
            .iter()
            .flat_map(|phase| phantom.labels(phase.at).unwrap())
            .collect();
        assert!(files[7].1.ends_with(&labels) && labels.len() == 2 * 512);
    }
}

/// Labels of respiratory gates are at their respiratory positions, which `geometry.json` lists.
#[test]
fn labels_follow_respiration() {
    let cohort = Cohort::from_toml(
        r#"
members = 1
[scene]
heart.discretisation = { differences = { nodes = 51 } }
camera = { views = 3, bins = 8, rows = 8, pitch = [1.5, 1.5], seconds_per_view = 40.0 }
acquisition.mode = { gated = { gates = 2 } }
breathing = { shift = [0.0, 0.0, -4.0], gates = { amplitude = 2 } }
output.write = ["labels"]
"#,
    );
    let (cohort, folder) = (cohort.unwrap(), tempfile::tempdir().unwrap());
    let report = shard(&cohort, folder.path(), [1, 1], 1);
    let archive = fs::read(&report.path).unwrap();
    let phantom = Phantom::new(cohort.member(0).unwrap().scene().unwrap()).unwrap();
    let phases = phantom.phases();
    let breaths: Vec<f64> = phases.iter().map(|phase| phase.at.breath).collect();
    assert!(breaths[0] < breaths[breaths.len() - 1], "{breaths:?}");
    let labels: Vec<u8> = (phases.iter())
        .flat_map(|phase| phantom.labels(phase.at).unwrap())
        .collect();
    let still: Vec<u8> = (phases.iter())
        .flat_map(|phase| phantom.labels(phase.at.phase).unwrap())
        .collect();
    assert!(labels != still);
    assert!(archive.windows(labels.len()).any(|bytes| bytes == labels));
}

/// Samples of a file of NumPy, read by hand.
fn npy(bytes: &[u8], shape: &str) -> Vec<f32> {
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"));
    let length = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..length]).unwrap();
    assert!(
        header.contains("'<f4'") && header.contains(shape),
        "{header}"
    );
    (bytes[length..].as_chunks::<4>().0.iter())
        .map(|four| f32::from_le_bytes(*four))
        .collect()
}

#[test]
fn complete_shards_are_skipped_and_damaged_ones_recomputed() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_rejected(4);
    let first = shard(&cohort, folder.path(), [1, 2], 1);
    let (archive, record) = (first.path.clone(), first.path.with_extension("json"));
    let bytes = fs::read(&archive).unwrap();
    let again = |skipped| {
        let report = shard(&cohort, folder.path(), [1, 2], 2);
        assert_eq!(report.skipped, skipped);
        assert_eq!(report.rows, first.rows);
        assert!(fs::read(&archive).unwrap() == bytes);
        assert_eq!(names(folder.path()).len(), 2);
    };
    again(true);
    for at in [0, 600, bytes.len() - 1] {
        let mut broken = bytes.clone();
        broken[at] ^= 1;
        fs::write(&archive, broken).unwrap();
        again(false);
    }
    fs::write(&archive, &bytes[..bytes.len() - 512]).unwrap();
    again(false);
    fs::remove_file(&archive).unwrap();
    again(false);
    fs::write(&record, "{").unwrap();
    again(false);
    fs::remove_file(&record).unwrap();
    again(false);
    // Temporary files of this shard by a killed process are removed; those of another shard are kept.
    let left = folder.path().join("shard-00001-of-00002.tar.99-1.tmp");
    let other = folder.path().join("shard-00002-of-00002.tar.99-1.tmp");
    fs::write(&left, "half").unwrap();
    again(true);
    fs::write(&other, "half").unwrap();
    assert!(shard(&cohort, folder.path(), [1, 2], 1).skipped);
    assert!(other.exists() && !left.exists());
}

/// Constants of rubber vary like any field, and so does the material; the phantom of a member's scene has the pressures.
#[test]
fn members_may_be_of_rubber() {
    let rubber = "heart.material = { gent = { mu = 400.0, jm = 30.0, thickness = 0.5 } }";
    let vary = "heart.material.gent.jm = { uniform = [20.0, 40.0] }";
    let of_rubber = text(3, "", vary).replace("[scene]\n", &format!("[scene]\n{rubber}\n"));
    let either = "heart.material = { choice = [\"springs\", { neo_hookean = { mu = 400.0, thickness = 0.5 } }] }";
    for (text, least) in [(of_rubber, 3), (text(8, "", either), 1)] {
        let folder = tempfile::tempdir().unwrap();
        let cohort = Cohort::from_toml(&text).unwrap();
        let report = shard(&cohort, folder.path(), [1, 1], 1);
        assert_eq!(report.rejected, 0);
        let pressures = |row: &Row| {
            let phantom = Phantom::new(cohort.member(row.member).unwrap().scene().unwrap());
            phantom.unwrap().shape(0.5).unwrap().pressures_mmhg()
        };
        let mut found: Vec<[f64; 2]> = report.rows.iter().filter_map(pressures).collect();
        found.dedup();
        assert!(found.len() >= least, "{found:?}");
        assert!(
            found
                .iter()
                .all(|[inner, outer]| inner > outer && *outer > 0.0)
        );
    }
}
