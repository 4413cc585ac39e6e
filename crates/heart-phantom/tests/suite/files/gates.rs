//! All gates of a cycle in one file.

use super::*;

const GATES: usize = 3;
const SECONDS: f64 = 0.25;

/// The field of each gate, plus 1000 per gate index.
fn beat(grid: &VoxelGrid) -> Vec<f32> {
    let one = sampled(grid);
    let of = |gate: usize| one.iter().map(move |v| v + 1000.0 * gate as f32).collect();
    (0..GATES)
        .flat_map(|gate| -> Vec<f32> { of(gate) })
        .collect()
}

/// The gates according to an independent reader, `[gate][z][y][x]`, and the seconds between them.
fn read_gates(path: &Path, format: Format) -> (Vec<f64>, f64) {
    let bytes = fs::read(path).unwrap();
    match format {
        Format::Nifti => {
            let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
            let float = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
            assert_eq!((short(40), short(48)), (4, GATES as i16));
            assert_eq!(bytes[123], 2 + 8, "mm and s");
            (numbers(&bytes[352..], "f32"), f64::from(float(92)))
        }
        Format::MetaImage => {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let header = keys(&text, " = ");
            assert_eq!(header["ElementNumberOfChannels"], GATES.to_string());
            let mixed = numbers(&fs::read(path.with_extension("raw")).unwrap(), "f32");
            let gate = |g: usize| mixed[g..].iter().step_by(GATES).copied().collect();
            let samples = (0..GATES).flat_map(|g| -> Vec<f64> { gate(g) }).collect();
            (samples, header["SecondsPerGate"].parse().unwrap())
        }
        Format::Nrrd => {
            let (header, samples) = read_nrrd(&bytes);
            assert_eq!(header["dimension"], "4");
            assert_eq!(list(&header["sizes"])[3], GATES as f64);
            assert!(header["kinds"].ends_with("list"));
            (samples, header["seconds_per_gate"].parse().unwrap())
        }
        Format::Npz => {
            let arrays = read_npz(&bytes);
            assert_eq!(arrays["samples.npy"].0[0], GATES);
            (
                arrays["samples.npy"].1.clone(),
                arrays["seconds_per_gate.npy"].1[0],
            )
        }
        Format::RawJson => {
            let (header, samples) = read_json(path);
            assert_eq!(
                (&header["order"][0], &header["shape"][0]),
                (&"gate".into(), &GATES.into())
            );
            (samples, header["seconds_per_gate"].as_f64().unwrap())
        }
        Format::InterfileSimind => {
            let (header, samples) = read_interfile(path);
            assert_eq!(header["type of data"], "GSPECT");
            assert_eq!(header["number of time windows"], "1");
            assert_eq!(header["number of images in time window"], GATES.to_string());
            let images: usize = header["total number of images"].parse().unwrap();
            let len = samples.len() / images; // slices or rows from head to feet
            (
                samples
                    .iter()
                    .enumerate()
                    .map(|(k, _)| {
                        let (gate, within) =
                            (k / (len * images / GATES), k % (len * images / GATES));
                        let turned = images / GATES - 1 - within / len;
                        samples[(gate * images / GATES + turned) * len + within % len]
                    })
                    .collect(),
                header["image duration (sec)"].parse().unwrap(),
            )
        }
        other => panic!("no reader for {other:?}"),
    }
}

#[test]
fn the_gates_of_one_file_are_read_in_order() {
    let folder = tempfile::tempdir().unwrap();
    for format in [
        Format::Nifti,
        Format::MetaImage,
        Format::Nrrd,
        Format::Npz,
        Format::RawJson,
        Format::InterfileSimind,
    ] {
        let grid = grid(format);
        let samples = beat(&grid);
        let volume = Volume::of_gates(grid, samples.as_slice(), SECONDS).unwrap();
        let path = path_of(folder.path(), format);
        write(&path, &volume, format).unwrap();
        let (found, seconds) = read_gates(&path, format);
        assert_eq!(seconds, SECONDS, "{format:?}");
        let expected: Vec<f64> = samples.iter().map(|&v| f64::from(v)).collect();
        assert_eq!(found, expected, "{format:?}");
    }
    // Bare arrays have a fourth axis.
    let grid = grid(Format::Npy);
    let samples = beat(&grid);
    let volume = Volume::of_gates(grid, samples.as_slice(), SECONDS).unwrap();
    let path = folder.path().join("beat.npy");
    write(&path, &volume, Format::Npy).unwrap();
    let (shape, _) = read_npy(&fs::read(&path).unwrap());
    assert_eq!(shape, [GATES, SHAPE[2], SHAPE[1], SHAPE[0]]);
}

/// More samples than a block of the interleaving writer, of three types.
#[test]
fn channels_of_any_length_are_interleaved() {
    let folder = tempfile::tempdir().unwrap();
    let grid = VoxelGrid::centred([97, 31, 11], [0.1; 3], [0.0; 3]).unwrap();
    let words: Vec<u16> = (0..GATES * grid.len())
        .map(|k| (k * 7919 % 65536) as u16)
        .collect();
    let volume = Volume::of_gates(grid, words.as_slice(), SECONDS).unwrap();
    let path = folder.path().join("a.mhd");
    write(&path, &volume, Format::MetaImage).unwrap();
    let mixed = numbers(&fs::read(path.with_extension("raw")).unwrap(), "u16");
    for (k, found) in mixed.iter().enumerate() {
        let (gate, voxel) = (k % GATES, k / GATES);
        assert_eq!(*found, f64::from(words[gate * grid.len() + voxel]));
    }
}

#[test]
fn views_of_all_gates_go_into_one_file() {
    let folder = tempfile::tempdir().unwrap();
    let angles: Vec<f64> = (0..6).map(|k| 0.5 + 0.25 * f64::from(k)).collect();
    let (detector, one) = stack(&angles, [0.0; 2]);
    let samples: Vec<f32> = (0..GATES)
        .flat_map(|gate| one.iter().map(move |v| v + 500.0 * gate as f32))
        .collect();
    let views = |samples| Projections::of_gates(detector, &angles, &[RADIUS], samples, SECONDS);
    let projections = views(samples.as_slice()).unwrap();
    let shape = [GATES, angles.len(), ROWS, BINS];
    let path = folder.path().join("a.npy");
    write(&path, &projections, Format::Npy).unwrap();
    assert_eq!(read_npy(&fs::read(&path).unwrap()).0, shape);
    let path = folder.path().join("a.nrrd");
    write(&path, &projections, Format::Nrrd).unwrap();
    let (header, found) = read_nrrd(&fs::read(&path).unwrap());
    assert_eq!(list(&header["sizes"]), [5.0, 4.0, 6.0, 3.0]);
    assert!(found.iter().zip(&samples).all(|(a, b)| *a == f64::from(*b)));
    let path = folder.path().join("a.h00");
    write(&path, &projections, Format::InterfileSimind).unwrap();
    let (header, found) = read_interfile(&path);
    assert_eq!(header["number of projections"], "6");
    assert_eq!(header["total number of images"], "18");
    // Rows and bins of each view are transposed.
    for (k, value) in found.iter().enumerate() {
        let (view, pixel) = (k / (ROWS * BINS), k % (ROWS * BINS));
        let expected = samples[view * ROWS * BINS + ROWS * BINS - 1 - pixel];
        assert_eq!(*value, f64::from(expected));
    }
    // One calibration factor per view and gate.
    let counts = vec![2.0; GATES * angles.len()];
    assert!(projections.with_counts_per_unit(&counts).is_ok());
    assert!(projections.with_counts_per_unit(&counts[1..]).is_err());
}

#[test]
fn invalid_gates_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid(Format::InterfileStir);
    let samples = beat(&grid);
    let short = Volume::of_gates(grid, &samples[1..], SECONDS);
    assert!(
        matches!(short, Err(PhantomError::WrongLength { .. })),
        "{short:?}"
    );
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Volume::of_gates(grid, samples.as_slice(), seconds);
        assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
    }
    let mut infinite = samples.clone();
    infinite[2 * grid.len()] = f32::INFINITY; // of another gate than the first
    assert!(Volume::of_gates(grid, infinite.as_slice(), SECONDS).is_err());
    let volume = Volume::of_gates(grid, samples.as_slice(), SECONDS).unwrap();
    let path = path_of(folder.path(), Format::InterfileStir);
    let refused = write(&path, &volume, Format::InterfileStir);
    assert!(matches!(refused, Err(PhantomError::Unsupported { .. })));
    assert_eq!(entries(folder.path()), 0);
}
