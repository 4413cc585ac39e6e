//! DICOM: the content of the files, read back by tag. `readers/check.py` validates them with other programs.

mod gated;

use super::*;
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, InMemDicomObject, Tag, open_file};
use heart_phantom::files::{AcquisitionInfo, BeatCounts, PROGRAM, write_ct};
use heart_phantom::{Phantom, Scene, no_observer, run};

const GATES: usize = 2;

fn shorts(file: &DefaultDicomObject, tag: Tag) -> Vec<u16> {
    file.element(tag).unwrap().to_multi_int().unwrap()
}

fn text(file: &DefaultDicomObject, tag: Tag) -> String {
    file.element(tag).unwrap().to_str().unwrap().into_owned()
}

fn items(file: &DefaultDicomObject, tag: Tag) -> Vec<InMemDicomObject> {
    file.element(tag).unwrap().items().unwrap().to_vec()
}

/// Returns the intervals between beats of the first time slot.
fn beat_times(file: &DefaultDicomObject) -> InMemDicomObject {
    let gated = items(file, tags::GATED_INFORMATION_SEQUENCE);
    let times = gated[0].element(tags::DATA_INFORMATION_SEQUENCE).unwrap();
    times.items().unwrap()[0].clone()
}

fn decimals(file: &DefaultDicomObject, tag: Tag) -> Vec<f64> {
    file.element(tag).unwrap().to_multi_float64().unwrap()
}

/// No error from the validator of dicom3tools (<https://www.dclunie.com/dicom3tools/dciodvfy.html>), if it is installed.
fn validate(path: &Path) {
    if let Ok(output) = Command::new("dciodvfy").arg(path).output() {
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("Error"), "{said}");
    }
}

/// Samples according to the factor.
fn samples_of(file: &DefaultDicomObject) -> (Vec<f64>, f64) {
    let bytes = file.element(tags::PIXEL_DATA).unwrap().to_bytes().unwrap();
    let factor = decimals(file, tags::RESCALE_SLOPE)[0];
    let signed = shorts(file, tags::PIXEL_REPRESENTATION) == [1];
    let words = bytes.as_chunks::<2>().0.iter().map(|pair| match signed {
        true => f64::from(i16::from_le_bytes([pair[0], pair[1]])),
        false => f64::from(u16::from_le_bytes([pair[0], pair[1]])),
    });
    (words.map(|word| factor * word).collect(), factor)
}

/// A view is the image seen from the detector, which is at the patient's back at 0 and on the left at 90 degrees.
#[test]
fn views_have_the_detector_position_of_the_header() {
    let folder = tempfile::tempdir().unwrap();
    let growing: Vec<f64> = (0..6).map(|k| 0.5 + 0.25 * f64::from(k)).collect();
    let falling: Vec<f64> = growing.iter().rev().copied().collect();
    for angles in [&growing, &falling] {
        for gates in [1, GATES] {
            let (detector, one) = stack(angles, [0.0; 2]);
            let samples: Vec<f32> = (0..gates)
                .flat_map(|gate| one.iter().map(move |v| v + 10.0 * gate as f32))
                .collect();
            let projections = match gates {
                1 => Projections::new(detector, angles, &[RADIUS], samples.as_slice()),
                _ => Projections::of_gates(detector, angles, &[RADIUS], samples.as_slice(), 0.5),
            };
            let path = folder.path().join("a.dcm");
            write(&path, &projections.unwrap(), Format::Dicom).unwrap();
            validate(&path);
            let file = open_file(&path).unwrap();
            let n = gates * angles.len();
            assert_eq!(text(&file, tags::NUMBER_OF_FRAMES).trim(), n.to_string());
            let views: Vec<u16> = (0..n).map(|k| (k % angles.len()) as u16 + 1).collect();
            assert_eq!(shorts(&file, tags::ANGULAR_VIEW_VECTOR), views);
            if gates > 1 {
                let slots: Vec<u16> = (0..n).map(|k| (k / angles.len()) as u16 + 1).collect();
                assert_eq!(shorts(&file, tags::TIME_SLOT_VECTOR), slots);
            }
            let turns = file.element(tags::ROTATION_INFORMATION_SEQUENCE).unwrap();
            let turn = &turns.items().unwrap()[0];
            let number = |tag| turn.element(tag).unwrap().to_float64().unwrap();
            assert_eq!(number(tags::RADIAL_POSITION), 10.0 * RADIUS);
            let way = turn
                .element(tags::ROTATION_DIRECTION)
                .unwrap()
                .to_str()
                .unwrap();
            let step = match way.trim() {
                "CC" => number(tags::ANGULAR_STEP),
                "CW" => -number(tags::ANGULAR_STEP),
                other => panic!("{other}"),
            };
            let (found, factor) = samples_of(&file);
            for (k, value) in found.iter().enumerate() {
                let (gate, view) = (k / (6 * ROWS * BINS), k / (ROWS * BINS) % 6);
                let (row, column) = (k / BINS % ROWS, k % BINS);
                let alpha = (number(tags::START_ANGLE) + step * view as f64).to_radians();
                // The detector is at (sin, cos) of x to the left, y to the back; viewed from there, head up, the right of the image is
                // towards (-cos, sin).
                let across = (column as f64 - 2.0) * PITCH[0];
                let [x, y] = [-alpha.cos() * across, alpha.sin() * across];
                let z = (1.5 - row as f64) * PITCH[1];
                let theta = angles[view];
                assert!((-theta.sin() - alpha.sin()).abs() < 1e-6);
                let s = x * theta.cos() + y * theta.sin();
                let expected = seen(theta, [s, z]) + 10.0 * gate as f64;
                assert!(
                    (value - expected).abs() < 0.51 * factor,
                    "{value} {expected}"
                );
            }
        }
    }
}

#[test]
fn a_volume_keeps_its_position_and_labels_are_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dcm");
    let grid = grid(Format::Dicom);
    let samples = sampled(&grid);
    write(
        &path,
        &Volume::new(grid, samples.as_slice()).unwrap(),
        Format::Dicom,
    )
    .unwrap();
    validate(&path);
    let file = open_file(&path).unwrap();
    let detectors = file.element(tags::DETECTOR_INFORMATION_SEQUENCE).unwrap();
    let place = detectors.items().unwrap()[0]
        .element(tags::IMAGE_POSITION_PATIENT)
        .unwrap();
    assert_eq!(
        place.to_multi_float64().unwrap(),
        grid.origin().map(|cm| 10.0 * cm)
    );
    let spacing = decimals(&file, tags::PIXEL_SPACING);
    assert_eq!(
        [spacing[1], spacing[0]],
        [SPACING[0], SPACING[1]].map(|cm| 10.0 * cm)
    );
    assert_eq!(
        decimals(&file, tags::SPACING_BETWEEN_SLICES),
        [10.0 * SPACING[2]]
    );
    let (found, factor) = samples_of(&file);
    let worst = (found.iter().zip(&samples)).map(|(a, b)| (a - f64::from(*b)).abs());
    assert!(worst.fold(0.0, f64::max) < 0.51 * factor);
    // 16 bits: the largest sample has the largest pixel.
    assert_eq!(shorts(&file, tags::PIXEL_REPRESENTATION), [0]);
    let most = f64::from(samples.iter().copied().fold(0.0f32, f32::max));
    assert!((factor * 65535.0 - most).abs() < 1e-8 * most);
    let bytes = labels(&grid);
    write(
        &path,
        &Volume::new(grid, bytes.as_slice()).unwrap(),
        Format::Dicom,
    )
    .unwrap();
    let file = open_file(&path).unwrap();
    let kept = file.element(tags::PIXEL_DATA).unwrap().to_bytes().unwrap();
    assert_eq!(kept[..bytes.len()], bytes[..]);
    assert_eq!(decimals(&file, tags::RESCALE_SLOPE), [1.0]);
}

/// If samples are counts divided by a number, the pixels are these counts.
#[test]
fn counts_are_stored_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dcm");
    let angles: Vec<f64> = (0..6).map(f64::from).collect();
    let (detector, samples) = stack(&angles, [0.0; 2]);
    let counts: Vec<u16> = (0..samples.len()).map(|k| (k * k % 4001) as u16).collect();
    let per_unit = 1234.56789;
    let samples: Vec<f32> = counts
        .iter()
        .map(|&n| (f64::from(n) / per_unit) as f32)
        .collect();
    let known = vec![per_unit; 6];
    let projections = Projections::new(detector, &angles, &[RADIUS], samples.as_slice()).unwrap();
    let projections = projections.with_counts_per_unit(&known).unwrap();
    write(&path, &projections, Format::Dicom).unwrap();
    let file = open_file(&path).unwrap();
    let pixels: Vec<u16> = shorts(&file, tags::PIXEL_DATA);
    let turned = counts
        .chunks(ROWS * BINS)
        .flat_map(|view| view.iter().rev().copied());
    assert!(pixels.iter().copied().eq(turned));
    let factor = decimals(&file, tags::RESCALE_SLOPE)[0];
    assert!((factor * per_unit - 1.0).abs() < 1e-8); // of a number in 16 characters
}

#[test]
fn identifiers_are_functions_of_the_content() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid(Format::Dicom);
    let samples = sampled(&grid);
    let other: Vec<f32> = samples.iter().map(|v| v + 1.0).collect();
    let ids = |samples: &[f32], study: Option<&str>| {
        let path = folder.path().join("a.dcm");
        let mut volume = Volume::new(grid, samples).unwrap();
        volume.study = study;
        write(&path, &volume, Format::Dicom).unwrap();
        let bytes = fs::read(&path).unwrap();
        let file = open_file(&path).unwrap();
        let all = [
            tags::STUDY_INSTANCE_UID,
            tags::FRAME_OF_REFERENCE_UID,
            tags::SERIES_INSTANCE_UID,
            tags::SOP_INSTANCE_UID,
        ];
        let uids = all.map(|tag| text(&file, tag).trim_end_matches('\0').to_owned());
        assert_eq!(
            file.meta()
                .media_storage_sop_instance_uid()
                .trim_end_matches('\0'),
            uids[3]
        );
        for uid in &uids {
            let number: u128 = uid.strip_prefix("2.25.").unwrap().parse().unwrap();
            assert_eq!(
                (number >> 76 & 0xf, number >> 62 & 3),
                (8, 2),
                "a UUID of version 8"
            );
        }
        (bytes, uids)
    };
    let (bytes, first) = ids(&samples, Some("scene"));
    // The hash FNV-1a of 128 bits, with the bits of a UUID (RFC 9923 and 9562).
    let text = [PROGRAM, "study", "scene"].concat();
    let hash = (text.bytes()).fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |hash, byte| {
        (hash ^ u128::from(byte)).wrapping_mul(0x0100_0000_0000_0000_0000_013b)
    });
    let other_bits: u128 = !(0xf << 76 | 0b11 << 62);
    let number: u128 = first[0]["2.25.".len()..].parse().unwrap();
    assert_eq!(number & other_bits, hash & other_bits);
    assert_eq!(ids(&samples, Some("scene")).0, bytes);
    let (_, second) = ids(&other, Some("scene"));
    assert_eq!(first[..2], second[..2]);
    assert!((2..4).all(|k| first[k] != second[k]));
    let (_, third) = ids(&samples, Some("another"));
    assert!((0..2).all(|k| first[k] != third[k]));
    let (_, alone) = ids(&samples, None);
    assert_ne!(alone[0], first[0]);
}

#[test]
fn a_ct_has_one_file_per_slice_in_hounsfield_units() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid(Format::Dicom);
    let map: Vec<f32> = (0..grid.len()).map(|k| 0.01 * (k % 30) as f32).collect();
    let volume = Volume::new(grid, map.as_slice()).unwrap();
    let names = write_ct(folder.path(), "ct", &volume, 0.15).unwrap();
    assert_eq!(names.len(), SHAPE[2]);
    let mut series = Vec::new();
    for (k, name) in names.iter().enumerate() {
        validate(&folder.path().join(name));
        let file = open_file(folder.path().join(name)).unwrap();
        let z = decimals(&file, tags::IMAGE_POSITION_PATIENT)[2];
        assert!((z - 10.0 * (grid.origin()[2] + k as f64 * SPACING[2])).abs() < 1e-9);
        series.push(text(&file, tags::SERIES_INSTANCE_UID));
        let (units, _) = samples_of(&file);
        let slice = &map[k * SHAPE[0] * SHAPE[1]..];
        for (unit, mu) in units.iter().zip(slice) {
            assert!((unit - 1000.0 * (f64::from(*mu) / 0.15 - 1.0)).abs() <= 0.5);
        }
    }
    assert!(series.iter().all(|uid| *uid == series[0]));
    let far = vec![10.0f32; grid.len()];
    let refused = write_ct(
        folder.path(),
        "far",
        &Volume::new(grid, &far).unwrap(),
        0.15,
    );
    assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
    assert_eq!(entries(folder.path()), SHAPE[2]);
}

/// Expected noise of a decaying activity on two heads: the file contains the counts; their sum is that of the report.
#[test]
fn raw_counts_are_whole_numbers_with_a_slope_of_one() {
    let scene = "[heart]\ndiscretisation = { differences = { nodes = 41 } }\n\
        [camera]\nviews = 4\nbins = 12\nrows = 10\npitch = [1.4, 1.6]\nseconds_per_view = 30.0\narc = 180.0\n\
        heads = { two = { angle = 90.0 } }\n\
        [noise]\ncounts = 'expected'\nseed = 3\n\
        [counting]\nsensitivity = 80.0\ndecay = { half_life_hours = 0.01 }\n\
        [acquisition]\nmode = { gated = { gates = 2 } }\naccuracy = { steps = 4 }\n\
        [output]\nwrite = ['projections']\nprojections = 'dicom'\nvalues = 'counts'\ngates = 'one-file'\n";
    let phantom = Phantom::new(Scene::from_toml(scene).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let report = run(&phantom, folder.path(), &no_observer).unwrap();
    validate(&folder.path().join("projections.dcm"));
    let file = open_file(folder.path().join("projections.dcm")).unwrap();
    assert_eq!(decimals(&file, tags::RESCALE_SLOPE), [1.0]);
    assert_eq!(text(&file, tags::CORRECTED_IMAGE).trim(), "");
    assert_eq!(shorts(&file, tags::NUMBER_OF_DETECTORS), [2]);
    let pixels: f64 = shorts(&file, tags::PIXEL_DATA)
        .iter()
        .map(|&n| f64::from(n))
        .sum();
    let told: f64 = report.gates.iter().filter_map(|gate| gate.counts).sum();
    // The report's sum is of samples, which are counts divided by 32-bit numbers.
    assert!(
        pixels > 1e3 && (told / pixels - 1.0).abs() < 1e-6,
        "{told} {pixels}"
    );
    // 65 beats a minute for four views of 30 s.
    let times = beat_times(&file);
    let acquired = times
        .element(tags::INTERVALS_ACQUIRED)
        .unwrap()
        .to_int::<i32>()
        .unwrap();
    assert_eq!(acquired, 130);
}

/// `Corrected Image` of reconstructions: decay of the samples, attenuation and scatter of the model, known motion. The ground truth has none.
#[test]
fn volumes_name_their_corrections() {
    let scene = "[heart]\ndiscretisation = { differences = { nodes = 41 } }\n\
        [camera]\nviews = 8\nbins = 12\nrows = 10\npitch = [1.4, 1.6]\n\
        [attenuation]\ncoefficient = 0.15\nmedium = { torso = { centre = [0.0, 0.0], semi_axes = [12.0, 9.0] } }\n\
        [scatter]\ntolerance = 1.0\n\
        [acquisition]\nmode = { static = { phase = 0.0 } }\n\
        [output]\nwrite = ['reconstruction', 'truth', 'attenuation']\nvolumes = 'dicom'\n";
    let osem = "method = { osem = { subsets = 2, iterations = 1, attenuation = true } }";
    let scatter =
        "method = { osem = { subsets = 2, iterations = 1, attenuation = true, scatter = true } }";
    let moves =
        "method = { osem = { subsets = 2, iterations = 1 } }\ncompensation = 'known-motion'";
    let decay = "[counting]\nsensitivity = 80.0\ndecay = 'tc-99m'\n";
    for (counting, method, expected) in [
        ("", "method = 'fbp'", ""),
        (decay, "method = 'fbp'", "DECY"),
        ("", osem, "ATTN"),
        (decay, scatter, "DECY\\ATTN\\SCAT"),
        ("", moves, "MOTN"),
    ] {
        let text_of = format!("{scene}{counting}[reconstruction]\n{method}\n");
        let phantom = Phantom::new(Scene::from_toml(&text_of).unwrap()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        for (stem, expected) in [
            ("reconstruction", expected),
            ("truth", ""),
            ("attenuation", ""),
        ] {
            let of_stem = |file: &&std::path::PathBuf| file.to_string_lossy().starts_with(stem);
            let name = report.files.iter().find(of_stem).unwrap();
            validate(&folder.path().join(name));
            let file = open_file(folder.path().join(name)).unwrap();
            let found = text(&file, tags::CORRECTED_IMAGE);
            assert_eq!(found.trim(), expected, "{method} {stem}");
            let kind = text(&file, tags::IMAGE_TYPE);
            assert_eq!(kind.trim().ends_with("TRANSMISSION"), stem == "attenuation");
        }
    }
}

/// Counts beyond 16 bits have no pixel: an error with the largest count and the limit, and no file.
#[test]
fn counts_above_16_bits_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dcm");
    let angles: Vec<f64> = (0..6).map(f64::from).collect();
    let (detector, mut samples) = stack(&angles, [0.0; 2]);
    samples.fill(3.0);
    let mut write_counts = |largest: f32| {
        samples[7] = largest;
        let projections =
            Projections::new(detector, &angles, &[RADIUS], samples.as_slice()).unwrap();
        let info = AcquisitionInfo {
            counts: true,
            ..AcquisitionInfo::default()
        };
        let projections = projections.with_acquisition(info).unwrap();
        write(&path, &projections, Format::Dicom)
    };
    let message = write_counts(65_536.0).unwrap_err().to_string();
    assert_eq!(
        message,
        "largest count (DICOM has 16 bits: reduce the counts or choose another format) is 65536, must be between 0 and 65535"
    );
    assert_eq!(entries(folder.path()), 0);
    write_counts(65_535.0).unwrap();
    let file = open_file(&path).unwrap();
    assert_eq!(decimals(&file, tags::RESCALE_SLOPE), [1.0]);
    let pixels = shorts(&file, tags::PIXEL_DATA);
    assert_eq!(pixels.iter().max(), Some(&u16::MAX));
}

#[test]
fn numbers_fit_into_their_field_with_eight_digits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dcm");
    for cm in [
        18.0,
        2.864788975654116,
        1.0 / 30.0,
        1.0 / 3e8,
        0.1 * f64::from(f32::MAX),
        12_345_678_901_234.56,
    ] {
        let grid = VoxelGrid::new([1; 3], [cm; 3], [-cm; 3]).unwrap();
        let volume = Volume::new(grid, [1_u8].as_slice()).unwrap();
        write(&path, &volume, Format::Dicom).unwrap();
        let file = open_file(&path).unwrap();
        for number in text(&file, tags::PIXEL_SPACING).split('\\') {
            assert!(number.trim_end().len() <= 16, "{number}");
            let back: f64 = number.trim().parse().unwrap();
            assert!((back - 10.0 * cm).abs() <= 1e-8 * cm, "{number}");
        }
        let detector = &items(&file, tags::DETECTOR_INFORMATION_SEQUENCE)[0];
        let origin = detector.element(tags::IMAGE_POSITION_PATIENT).unwrap();
        for number in origin.to_str().unwrap().split('\\') {
            assert!(number.trim_end().len() <= 16, "{number}");
            let back: f64 = number.trim().parse().unwrap();
            assert!((back + 10.0 * cm).abs() <= 1e-7 * cm, "{number}");
        }
    }
}
