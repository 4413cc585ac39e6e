//! Data for networks: geometry, smaller files, subsets, correlated fields, other layouts.

use crate::{all, shard, text, with_rejected};
use heart_cohort::heart_phantom::{Phantom, PhantomError, Product};
use heart_cohort::{
    Cohort, CohortError, Fault, Row, Shard, ShardReport, StoredMember, Subset, export, merge,
    read_member, read_rows, read_shard,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Read;
use std::path::Path;

/// The files of a shard by their names, unpacked where they are compressed.
fn files(report: &ShardReport) -> BTreeMap<String, Vec<u8>> {
    let mut archive = tar::Archive::new(fs::File::open(&report.path).unwrap());
    let read = |entry: std::io::Result<tar::Entry<'_, fs::File>>| {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().to_string_lossy().into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        match name.strip_suffix(".gz") {
            Some(name) => (name.to_owned(), unpacked(&bytes)),
            None => (name, bytes),
        }
    };
    archive.entries().unwrap().map(read).collect()
}

fn unpacked(bytes: &[u8]) -> Vec<u8> {
    let mut unpacked = Vec::new();
    let mut reader = flate2::read::GzDecoder::new(bytes);
    reader.read_to_end(&mut unpacked).unwrap();
    unpacked
}

/// The reader against the archive as `tar` unpacks it, and NumPy arrays against their bytes.
#[test]
fn a_shard_is_read_as_it_was_written() {
    for head in [
        "seed = 5",
        "seed = 5\ncompression = \"gzip\"\nprecision = \"float16\"",
    ] {
        let vary = "heart.outer.radius = { choice = [2.6, 2.8, 1.7] }\ncycle.volume.gain = { uniform = [0.2, 0.6] }";
        let cohort = Cohort::from_toml(&text(9, head, vary)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let report = shard(&cohort, folder.path(), [1, 1], 1);
        let (mut files, place) = (files(&report), Shard { shard: 1, of: 1 });
        let read = || read_shard(folder.path(), place).unwrap();
        let members: Vec<StoredMember> = read().map(Result::unwrap).collect();
        let rows: Vec<&Row> = members.iter().map(|member| &member.row).collect();
        let kept = report.rows.iter().filter(|row| row.rejected.is_none());
        assert_eq!(rows, kept.collect::<Vec<_>>());
        assert!(rows.len() < 9);
        for member in &members {
            for (name, bytes) in &member.files {
                let written = files.remove(&format!("{}.{name}", member.row.key));
                assert_eq!(Some(bytes), written.as_ref());
            }
            let scene: heart_cohort::heart_phantom::Scene = member.json("scene.json").unwrap();
            assert_eq!(
                scene,
                cohort.member(member.row.member).unwrap().scene().unwrap()
            );
            let truth = member.array("truth.npy").unwrap();
            assert_eq!(truth.shape, [2, 8, 8, 8]);
            // Half precision rounds to 2^-11.
            let exact = Phantom::new(scene).unwrap().truth(0).unwrap();
            for (found, exact) in truth.samples.iter().zip(exact) {
                assert!(
                    (found - exact).abs() <= 5e-4 * exact + 1e-7,
                    "{found} {exact}"
                );
            }
            let missing = member.array("labels").unwrap_err();
            let CohortError::Phantom(PhantomError::Read { path, source }) = missing else {
                panic!("{missing:?}")
            };
            assert_eq!(path, Path::new(&format!("{}.labels", member.row.key)));
            let names = source.to_string();
            assert!(
                names.contains("cls, geometry.json, labels.npy, "),
                "{names}"
            );
            assert!(member.array("cls").is_err() && member.json::<f64>("scene.json").is_err());
        }
        assert!(files.is_empty(), "{:?}", files.keys());
        // Single members in any order, and the reason of a rejected one.
        let rows = read_rows(folder.path(), place).unwrap();
        assert_eq!(rows, report.rows);
        let single = |row| read_member(folder.path(), place, row);
        let expected = "edv esv stroke_volume ejection_fraction gain cardiac_output av_plane_displacement av_plane_fraction \
            longitudinal_shortening wall_volume diastolic_thickness.side diastolic_thickness.apex systolic_thickness.side \
            systolic_thickness.apex";
        for row in rows.iter().rev() {
            match &row.rejected {
                None => {
                    let member = members.iter().find(|member| member.row == *row);
                    assert!(single(row).unwrap() == *member.unwrap());
                    let names: BTreeSet<&str> = row.numbers.keys().map(String::as_str).collect();
                    assert_eq!(names, expected.split(' ').collect());
                }
                Some(reason) => {
                    let error = single(row).unwrap_err().to_string();
                    assert!(error.contains(reason), "{error}");
                }
            }
        }
        // A changed byte of the last member; the members before it are read.
        let mut bytes = fs::read(&report.path).unwrap();
        let last = &members.last().unwrap().row;
        bytes[last.offset as usize + 700] ^= 1;
        fs::write(&report.path, bytes).unwrap();
        let found: Vec<_> = read().collect();
        assert!(found[..found.len() - 1].iter().all(Result::is_ok));
        let Some(Err(CohortError::Faults { faults, .. })) = found.last() else {
            panic!("{found:?}")
        };
        let member = Some(last.member);
        assert_eq!(faults[0].fault, Fault::Archive { member });
        assert!(single(last).is_err());
        assert!(read_shard(folder.path(), Shard { shard: 1, of: 2 }).is_err());
    }
}

fn kept(report: &ShardReport) -> &Row {
    report
        .rows
        .iter()
        .find(|row| row.rejected.is_none())
        .unwrap()
}

/// The file against the phantom, and noisy projections times the counts per unit are counts.
#[test]
fn geometry_contains_positions_and_units_of_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = with_rejected(4);
    let report = shard(&cohort, folder.path(), [1, 1], 1);
    let row = kept(&report);
    let files = files(&report);
    let json: serde_json::Value =
        serde_json::from_slice(&files[&format!("{}.geometry.json", row.key)]).unwrap();
    let phantom = Phantom::new(cohort.member(row.member).unwrap().scene().unwrap()).unwrap();
    let grid = phantom.camera().grid();
    // The affine takes an index to the centre of its voxel, right, anterior, superior.
    let centre = grid.centre(1, 2, 3);
    let expected = [-10.0 * centre.x, -10.0 * centre.y, 10.0 * centre.z];
    for (a, expected) in expected.iter().enumerate() {
        let entry = |k: usize| json["affine"][a][k].as_f64().unwrap();
        let found = entry(0) + 2.0 * entry(1) + 3.0 * entry(2) + entry(3);
        // Rounding of sums of about ten terms below 200 mm.
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        assert_eq!(
            json["voxel_mm"][a].as_f64().unwrap(),
            10.0 * grid.spacing()[a]
        );
    }
    assert_eq!(json["shape_zyx"], serde_json::json!([8, 8, 8]));
    assert_eq!(json["label_names"][2], "wall");
    assert_eq!(json["phases"][1]["phase"], 0.75);
    let period = phantom.cycle().period();
    assert_eq!(
        json["phases"][1]["seconds"].as_f64().unwrap(),
        0.75 * period
    );
    let angles = phantom.camera().geometry().angles();
    assert_eq!(json["gates"].as_array().map(Vec::len), Some(2));
    let degrees = json["gates"][0]["angle_degrees"].as_array().unwrap();
    for (degrees, angle) in degrees.iter().zip(angles) {
        // A projection of a gate has its mean angle: that of step and shoot here.
        assert!((degrees.as_f64().unwrap() - angle.to_degrees()).abs() < 1e-9);
    }
    assert_eq!(json["radius_mm"].as_array().map(Vec::len), Some(3));
    assert_eq!(
        json["ejection_fraction"].as_f64(),
        row.numbers.get("ejection_fraction").copied()
    );
    assert_eq!(json["edv_ml"].as_f64(), row.numbers.get("edv").copied());
    let npy = &files[&format!("{}.projections.npy", row.key)];
    let per_unit = json["counts_per_unit"][1][2].as_f64().unwrap();
    assert_eq!(per_unit, 100.0);
    let mut all = 0.0;
    for sample in npy[npy.len() - 4 * 2 * 3 * 64..].as_chunks::<4>().0.iter() {
        let counts = f64::from(f32::from_le_bytes(*sample)) * per_unit;
        // Half a rounding of f32 of counts below 10 000.
        assert!((counts - counts.round()).abs() < 1e-3, "{counts}");
        all += counts;
    }
    assert!(all > 1000.0);
}

/// With `output.values = "counts"` projections are counts, also if other samples have half precision.
#[test]
fn projections_are_counts_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let of = |head: &str, values: &str| {
        let text = text(1, head, "cycle.volume.gain = { uniform = [0.2, 0.6] }");
        let text = text.replace("per_unit = 100.0", "per_unit = 10000.0");
        let output = format!("output.values = \"{values}\"\noutput.write");
        let cohort = Cohort::from_toml(&text.replace("output.write", &output)).unwrap();
        let report = shard(&cohort, &folder.path().join(values), [1, 1], 1);
        let (key, files) = (kept(&report).key.clone(), files(&report));
        let json: serde_json::Value =
            serde_json::from_slice(&files[&format!("{key}.geometry.json")]).unwrap();
        assert_eq!(json["projection_values"], values);
        assert_eq!(json["counts_per_unit"][1][2], 10_000.0);
        let npy = &files[&format!("{key}.projections.npy")];
        let samples = npy[npy.len() - 4 * 2 * 3 * 64..].as_chunks::<4>().0.iter();
        samples
            .map(|sample| f32::from_le_bytes(*sample))
            .collect::<Vec<f32>>()
    };
    let normalised = of("", "normalised");
    let counts = of("precision = \"float16\"", "counts");
    for (count, sample) in counts.iter().zip(&normalised) {
        // Half a rounding of f32 of counts below 100 000.
        assert!(count.fract() == 0.0 && (count - 10_000.0 * sample).abs() < 0.02);
    }
    // Integers that half precision lacks.
    assert!(
        counts
            .iter()
            .any(|count| *count > 2048.0 && count % 2.0 == 1.0)
    );
}

/// The same arrays in fewer, reproducible bytes.
#[test]
fn compressed_arrays_are_restored_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let of = |head: &str, name: &str| {
        let cohort = Cohort::from_toml(&text(
            2,
            head,
            "cycle.volume.gain = { uniform = [0.2, 0.6] }",
        ));
        shard(&cohort.unwrap(), &folder.path().join(name), [1, 1], 1)
    };
    let plain = of("", "plain");
    let packed = of("compression = \"gzip\"", "packed");
    assert!(files(&plain) == files(&packed) && packed.bytes < plain.bytes);
    let again = of("compression = \"gzip\"", "again");
    assert!(fs::read(&packed.path).unwrap() == fs::read(&again.path).unwrap());
    // Half precision: half the bytes of single precision, each sample within its bound.
    let halves = files(&of("precision = \"float16\"", "halves"));
    for (name, single) in files(&plain) {
        let found = &halves[&name];
        if !name.ends_with(".npy") || name.ends_with(".labels.npy") {
            assert!(*found == single, "{name}");
            continue;
        }
        let header = |bytes: &[u8]| 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8_lossy(&found[10..header(found)]).into_owned();
        assert!(text.contains("'<f2'"), "{text}");
        let (single, half) = (&single[header(&single)..], &found[header(found)..]);
        assert_eq!(2 * half.len(), single.len(), "{name}");
        for (single, half) in single
            .as_chunks::<4>()
            .0
            .iter()
            .zip(half.as_chunks::<2>().0.iter())
        {
            let single = f64::from(f32::from_le_bytes(*single));
            let half = of_half(u16::from_le_bytes(*half));
            assert!((half - single).abs() <= single.abs() / 2048.0 + 2f64.powi(-25));
        }
    }
}

fn of_half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        e => (1024.0 + fraction) * 2f64.powi(e - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// Each field keeps its distribution, to the distance of Kolmogorov and Smirnov; ranks correlate according to the copula.
#[test]
fn draws_may_be_correlated() {
    let vary = "pose.shift.1 = { uniform = [0.0, 1.0] }\npose.shift.2 = { normal = { mean = 0.0, sd = 1.0 } }\npose.shift.3 = { uniform = [0.0, 1.0] }";
    let n = 2000;
    for sampling in ["plain", "sobol"] {
        let head = format!(
            "sampling = \"{sampling}\"\ncorrelations = [{{ fields = [\"pose.shift.1\", \"pose.shift.2\"], coefficient = -0.6 }}]"
        );
        let cohort = Cohort::from_toml(&text(n, &head, vary)).unwrap();
        let ranks = |path: &str| {
            let members = (0..n).map(|k| cohort.member(k).unwrap());
            let values: Vec<f64> = members.map(|member| member.number(path).unwrap()).collect();
            let below = |x: &f64| values.iter().filter(|y| *y < x).count() as f64;
            values
                .iter()
                .map(|x| (below(x) + 0.5) / n as f64)
                .collect::<Vec<f64>>()
        };
        let [x, y, z] = ["pose.shift.1", "pose.shift.2", "pose.shift.3"].map(ranks);
        let correlation = |a: &[f64], b: &[f64]| -> f64 {
            12.0 / n as f64
                * a.iter()
                    .zip(b)
                    .map(|(a, b)| (a - 0.5) * (b - 0.5))
                    .sum::<f64>()
        };
        // Spearman's coefficient of normal scores with coefficient r is 6 / pi asin(r / 2); its deviation is below 1 / sqrt(n).
        let expected = 6.0 / std::f64::consts::PI * (-0.3f64).asin();
        let found = correlation(&x, &y);
        assert!(
            (found - expected).abs() < 3.3 / (n as f64).sqrt(),
            "{sampling}: {found} {expected}"
        );
        assert!(correlation(&x, &z).abs() < 3.3 / (n as f64).sqrt());
        // The uniform field stays uniform: its value is its rank, to 1.95 / sqrt(n) except with a probability of 1/1000.
        for (k, rank) in x.iter().enumerate() {
            let value = cohort
                .member(k as u64)
                .unwrap()
                .number("pose.shift.1")
                .unwrap();
            assert!(
                (value - rank).abs() < 1.95 / (n as f64).sqrt(),
                "{sampling}: {value} {rank}"
            );
        }
    }
    for (correlations, words) in [
        (
            "{ fields = [\"pose.shift.1\", \"pose.centre\"], coefficient = 0.1 }",
            "pose.centre does not vary",
        ),
        (
            "{ fields = [\"pose.shift.1\", \"pose.shift.1\"], coefficient = 0.1 }",
            "two different fields",
        ),
        (
            "{ fields = [\"pose.shift.1\", \"pose.shift.2\"], coefficient = 1.0 }",
            "coefficient: is 1; it must be",
        ),
        (
            "{ fields = [\"pose.shift.1\", \"pose.shift.2\"], coefficient = nan }",
            "coefficient: is NaN; it must be",
        ),
        (
            "{ fields = [\"pose.shift.1\", \"pose.shift.2\"], coefficient = 0.9 }, { fields = [\"pose.shift.1\", \"pose.shift.3\"], coefficient = 0.9 }, { fields = [\"pose.shift.3\", \"pose.shift.2\"], coefficient = -0.9 }",
            "positive definite",
        ),
    ] {
        let error = Cohort::from_toml(&text(9, &format!("correlations = [{correlations}]"), vary));
        let error = error.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

fn name(subset: Subset) -> &'static str {
    match subset {
        Subset::Train => "train",
        Subset::Validation => "validation",
        Subset::Test => "test",
    }
}

#[test]
fn subsets_have_their_fractions_for_any_shards() {
    let head = "split = { train = 0.7, validation = 0.2, test = 0.1 }";
    let vary = "cycle.volume.gain = { uniform = [0.2, 0.6] }";
    let cohort = Cohort::from_toml(&text(10_000, head, vary)).unwrap();
    let mut counts = BTreeMap::new();
    for k in 0..10_000 {
        *counts
            .entry(cohort.member(k).unwrap().split.map(name).unwrap())
            .or_insert(0) += 1;
    }
    for (name, fraction) in [("train", 0.7_f64), ("validation", 0.2), ("test", 0.1)] {
        // 3.3 standard deviations of a binomial distribution.
        let room = 3.3 * (1e4 * fraction * (1.0 - fraction)).sqrt();
        let count = f64::from(counts[name]);
        assert!((count - 1e4 * fraction).abs() < room, "{name}: {count}");
    }
    // More members, other constraints and other fields have no effect.
    let head = format!("{head}\nconstraints = [\"pose.centre > 5\"]");
    let other = "pose.centre = { uniform = [4.0, 6.0] }";
    let other = Cohort::from_toml(&text(20_000, &head, other)).unwrap();
    let split = |cohort: &Cohort| -> Vec<Option<Subset>> {
        (0..100).map(|k| cohort.member(k).unwrap().split).collect()
    };
    assert_eq!(split(&cohort), split(&other));
    // It is a column of the manifest for any shards.
    let small = text(6, &head, "pose.centre = { uniform = [4.0, 6.0] }");
    let small = Cohort::from_toml(&small).unwrap();
    let column = |of: u64| -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        all(&small, folder.path(), of, 1);
        merge(folder.path()).unwrap();
        let mut csv = csv::Reader::from_path(folder.path().join("manifest.csv")).unwrap();
        let at = csv
            .headers()
            .unwrap()
            .iter()
            .position(|name| name == "split")
            .unwrap();
        csv.records()
            .map(|row| row.unwrap()[at].to_owned())
            .collect()
    };
    let expected: Vec<&str> = split(&cohort)[..6]
        .iter()
        .map(|split| split.map(name).unwrap())
        .collect();
    assert_eq!(column(1), expected);
    assert_eq!(column(3), expected);
    for split in [
        "{ train = 0.9 }",
        "{ train = 1.5, test = -0.5 }",
        "{ train = nan }",
    ] {
        let error = Cohort::from_toml(&format!("members = 3\nsplit = {split}\n")).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("line 2, column 9: split: must be"),
            "{error}"
        );
    }
}

/// Images and labels of every gate on one grid, as NIfTI, and a list of them.
#[test]
fn a_member_is_exported_in_the_layout_of_nnunet() {
    let folder = tempfile::tempdir().unwrap();
    let cohort = Cohort::from_toml(&text(3, "", "cycle.volume.gain = { uniform = [0.2, 0.6] }"));
    let cohort = cohort.unwrap();
    let wanted = |key: &str| {
        let case = |gate: &str| format!("heart_{key}_{gate}");
        vec![
            format!("imagesTr/{}_0000.nii.gz", case("00")),
            format!("labelsTr/{}.nii.gz", case("00")),
            format!("imagesTr/{}_0000.nii.gz", case("01")),
            format!("labelsTr/{}.nii.gz", case("01")),
            "dataset.json".to_owned(),
        ]
    };
    for (member, key) in [(2, "00000002"), (0, "00000000")] {
        let files = export(&cohort, member, folder.path(), 1 << 28).unwrap();
        assert!(files.iter().eq(wanted(key).iter().map(Path::new)));
    }
    let dataset = fs::read(folder.path().join("dataset.json")).unwrap();
    let dataset: serde_json::Value = serde_json::from_slice(&dataset).unwrap();
    assert_eq!(
        (&dataset["numTraining"], &dataset["labels"]["wall"]),
        (&4.into(), &2.into())
    );
    assert_eq!(dataset["channel_names"]["0"], "reconstruction");
    assert_eq!(
        dataset["training"][1]["label"],
        "./labelsTr/heart_00000000_01.nii.gz"
    );
    let phantom = Phantom::new(cohort.member(2).unwrap().scene().unwrap()).unwrap();
    assert!(
        phantom
            .scene()
            .output
            .write
            .contains(&Product::Reconstruction)
    );
    let nifti = |name: &str| unpacked(&fs::read(folder.path().join(name)).unwrap());
    let labels = nifti("labelsTr/heart_00000002_01.nii.gz");
    let expected = phantom.labels(phantom.phases()[1].at).unwrap();
    assert!(labels.len() == 352 + 512 && labels.ends_with(&expected));
    let image = nifti("imagesTr/heart_00000002_01_0000.nii.gz");
    let expected = phantom.volume(1).unwrap();
    let found = image[352..]
        .as_chunks::<4>()
        .0
        .iter()
        .map(|v| f32::from_le_bytes(*v));
    assert!(found.eq(expected));
    // The same grid: sides, voxels and both forms of the position.
    assert!(image[40..56] == labels[40..56] && image[76..108] == labels[76..108]);
    assert!(image[252..328] == labels[252..328]);
    let missing = export(&cohort, 3, folder.path(), 1 << 28);
    assert!(matches!(missing, Err(CohortError::NoMember { .. })));
}
