//! Files: every sample is where it was, in every format; nothing half written; bad input refused before a byte is written.
//!
//! The readers here are minimal and know nothing of the writers. `readers/check.py` does the same with nibabel, SimpleITK, numpy
//! and pynrrd, and is run from here when they can be imported.

use heart_phantom::PhantomError;
use heart_phantom::files::{
    Format, Projections, Volume, write_ply, write_projections, write_stl, write_volume,
};
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, VoxelGrid};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SHAPE: [usize; 3] = [5, 4, 3];
const SPACING: [f64; 3] = [0.25, 0.5, 0.75];

/// A volume that has another value in every voxel: `x + 8 y + 64 z`, in cm. No flip, shift, swap of
/// axes or other unit leaves it as it is.
fn field([x, y, z]: [f64; 3]) -> f64 {
    x + 8.0 * y + 64.0 * z
}

/// The grid sits off the centre, except for the format that cannot hold it.
fn grid(format: Format) -> VoxelGrid {
    let offset = match format {
        Format::InterfileSimind => [0.0; 3],
        _ => [1.5, -2.25, 3.125],
    };
    VoxelGrid::centred(SHAPE, SPACING, offset).unwrap()
}

fn sampled(grid: &VoxelGrid) -> Vec<f32> {
    let [nx, ny, nz] = grid.shape();
    let mut samples = Vec::new();
    for iz in 0..nz {
        for iy in 0..ny {
            for ix in 0..nx {
                let p = grid.centre(ix, iy, iz);
                samples.push(field([p.x, p.y, p.z]) as f32);
            }
        }
    }
    samples
}

/// Labels that tell every voxel from every other: its index.
fn labels(grid: &VoxelGrid) -> Vec<u8> {
    (0..grid.len() as u8).collect()
}

/// What a reader found: x fastest; sample (i, j, k) at `first + (i, j, k) * step` in the lab, cm.
#[derive(Debug)]
struct Found {
    shape: [usize; 3],
    first: [f64; 3],
    step: [f64; 3],
    samples: Vec<f64>,
}

impl Found {
    fn centre(&self, index: usize) -> [f64; 3] {
        let [nx, ny, _] = self.shape;
        let k = [index % nx, index / nx % ny, index / nx / ny];
        [0, 1, 2].map(|a| self.first[a] + k[a] as f64 * self.step[a])
    }
}

fn numbers(bytes: &[u8], kind: &str) -> Vec<f64> {
    match kind {
        "f32" => bytes
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())))
            .collect(),
        "f64" => bytes
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
            .collect(),
        "u8" => bytes.iter().map(|&b| f64::from(b)).collect(),
        "u16" => bytes
            .chunks_exact(2)
            .map(|b| f64::from(u16::from_le_bytes(b.try_into().unwrap())))
            .collect(),
        kind => panic!("unknown kind {kind}"),
    }
}

fn list(text: &str) -> Vec<f64> {
    text.split(|c: char| c.is_whitespace() || "(),".contains(c))
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().unwrap())
        .collect()
}

fn three(values: &[f64]) -> [f64; 3] {
    values.try_into().unwrap()
}

fn sizes(values: &[f64]) -> [usize; 3] {
    three(values).map(|v| v as usize)
}

fn mm_to_cm(values: [f64; 3]) -> [f64; 3] {
    values.map(|mm| mm / 10.0)
}

/// Header lines `key SEPARATOR value`; an Interfile key loses its leading `!`.
fn keys(text: &str, separator: &str) -> HashMap<String, String> {
    text.lines()
        .filter(|line| !line.starts_with([';', '#']))
        .filter_map(|line| line.split_once(separator))
        .map(|(key, value)| {
            let key = key.trim().trim_start_matches('!').to_string();
            (key, value.trim().to_string())
        })
        .collect()
}

/// A NumPy array: shape and values.
fn read_npy(bytes: &[u8]) -> (Vec<usize>, Vec<f64>) {
    assert_eq!(&bytes[..6], b"\x93NUMPY");
    let start = 10 + u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
    let header = String::from_utf8_lossy(&bytes[10..start]).into_owned();
    assert!(header.contains("'fortran_order': False"), "{header}");
    let kind = if header.contains("<f4") {
        "f32"
    } else if header.contains("<f8") {
        "f64"
    } else if header.contains("<u2") {
        "u16"
    } else {
        assert!(header.contains("|u1"), "{header}");
        "u8"
    };
    let shape = header.split_once("'shape': (").unwrap().1;
    let shape = list(shape.split_once(')').unwrap().0);
    let shape = shape.iter().map(|&n| n as usize).collect();
    (shape, numbers(&bytes[start..], kind))
}

/// The stored files of a zip archive, from its local headers. Sizes are in the 64-bit field.
fn read_npz(bytes: &[u8]) -> HashMap<String, (Vec<usize>, Vec<f64>)> {
    let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]) as usize;
    let mut at = 0;
    let mut found = HashMap::new();
    while bytes[at..].starts_with(b"PK\x03\x04") {
        assert_eq!(word(at + 8), 0, "stored");
        let (name, extra) = (at + 30, at + 30 + word(at + 26));
        let data = extra + word(at + 28);
        assert_eq!(word(extra), 1, "64-bit sizes");
        let size = u64::from_le_bytes(bytes[extra + 4..extra + 12].try_into().unwrap());
        let end = data + size as usize;
        let name = String::from_utf8_lossy(&bytes[name..extra]).into_owned();
        found.insert(name, read_npy(&bytes[data..end]));
        at = end;
    }
    found
}

fn read_nifti(bytes: &[u8]) -> Found {
    let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    assert_eq!(i32::from_le_bytes(bytes[..4].try_into().unwrap()), 348);
    assert_eq!(&bytes[344..348], b"n+1\0");
    assert_eq!((short(40), bytes[123]), (3, 2), "three axes, mm");
    assert_eq!((short(252), short(254)), (1, 1), "both forms");
    let kind = match (short(70), short(72)) {
        (2, 8) => "u8",
        (16, 32) => "f32",
        (512, 16) => "u16",
        other => panic!("{other:?}"),
    };
    // The rotation of a quaternion without its real part, from the NIfTI standard, method 2.
    let [b, c, d] = [256, 260, 264].map(float);
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let rotation = [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c - a * d),
            2.0 * (b * d + a * c),
        ],
        [
            2.0 * (b * c + a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d - a * b),
        ],
        [
            2.0 * (b * d - a * c),
            2.0 * (c * d + a * b),
            a * a + d * d - b * b - c * c,
        ],
    ];
    assert_eq!(float(76), 1.0, "qfac");
    let ras_to_lab = [-1.0, -1.0, 1.0];
    let mut found = Found {
        shape: [42, 44, 46].map(|at| short(at) as usize),
        first: [0.0; 3],
        step: [0.0; 3],
        samples: numbers(&bytes[float(108) as usize..], kind),
    };
    for i in 0..3 {
        for j in 0..3 {
            let s = float(280 + 16 * i + 4 * j);
            assert_eq!(
                s,
                rotation[i][j] * float(80 + 4 * j),
                "forms differ at {i} {j}"
            );
            assert!(i == j || s == 0.0);
        }
        assert_eq!(float(292 + 16 * i), float(268 + 4 * i), "offsets differ");
        found.first[i] = ras_to_lab[i] * float(268 + 4 * i) / 10.0;
        found.step[i] = ras_to_lab[i] * float(280 + 20 * i) / 10.0;
    }
    found
}

fn read_metaimage(path: &Path, bytes: &[u8]) -> Found {
    let end = b"ElementDataFile";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap();
    let line = at + bytes[at..].iter().position(|&b| b == b'\n').unwrap() + 1;
    let header = keys(std::str::from_utf8(&bytes[..line]).unwrap(), " = ");
    assert_eq!(header["TransformMatrix"], "1 0 0 0 1 0 0 0 1");
    assert_eq!(header["BinaryDataByteOrderMSB"], "False");
    let kind = match header["ElementType"].as_str() {
        "MET_FLOAT" => "f32",
        "MET_UCHAR" => "u8",
        "MET_USHORT" => "u16",
        other => panic!("{other}"),
    };
    let data = match header["ElementDataFile"].as_str() {
        "LOCAL" => bytes[line..].to_vec(),
        name => fs::read(path.with_file_name(name)).unwrap(),
    };
    Found {
        shape: sizes(&list(&header["DimSize"])),
        first: mm_to_cm(three(&list(&header["Offset"]))),
        step: mm_to_cm(three(&list(&header["ElementSpacing"]))),
        samples: numbers(&data, kind),
    }
}

/// Fields, and the samples.
fn read_nrrd(bytes: &[u8]) -> (HashMap<String, String>, Vec<f64>) {
    assert!(bytes.starts_with(b"NRRD0004\n"));
    let end = bytes.windows(2).position(|w| w == b"\n\n").unwrap();
    let text = std::str::from_utf8(&bytes[..end]).unwrap();
    let mut header = keys(text, ": ");
    header.extend(keys(text, ":="));
    assert_eq!(
        (&*header["encoding"], &*header["endian"]),
        ("raw", "little")
    );
    let kind = match header["type"].as_str() {
        "float" => "f32",
        "uint8" => "u8",
        "uint16" => "u16",
        other => panic!("{other}"),
    };
    (header, numbers(&bytes[end + 2..], kind))
}

/// Keys, and the samples of the data file named there.
fn read_interfile(path: &Path) -> (HashMap<String, String>, Vec<f64>) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.starts_with("!INTERFILE :=\n") && text.ends_with("!END OF INTERFILE :=\n"));
    let header = keys(&text, ":=");
    assert_eq!(header["imagedata byte order"], "LITTLEENDIAN");
    let kind = match (
        &*header["number format"],
        &*header["number of bytes per pixel"],
    ) {
        ("float" | "short float", "4") => "f32",
        ("unsigned integer", "1") => "u8",
        ("unsigned integer", "2") => "u16",
        other => panic!("{other:?}"),
    };
    let data = fs::read(path.with_file_name(&header["name of data file"])).unwrap();
    (header, numbers(&data, kind))
}

fn indexed(header: &HashMap<String, String>, key: &str) -> Vec<f64> {
    (1..=3)
        .filter_map(|k| header.get(&format!("{key} [{k}]")))
        .map(|value| value.parse().unwrap())
        .collect()
}

fn read_json(path: &Path) -> (serde_json::Value, Vec<f64>) {
    let header: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let data = fs::read(path.with_file_name(header["data"].as_str().unwrap())).unwrap();
    let kind = match header["type"].as_str().unwrap() {
        "float32" => "f32",
        "uint8" => "u8",
        "uint16" => "u16",
        other => panic!("{other}"),
    };
    (header, numbers(&data, kind))
}

fn json_list(value: &serde_json::Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}

fn read(path: &Path, format: Format) -> Found {
    let bytes = fs::read(path).unwrap();
    match format {
        // The bare array: its place is what the caller knows.
        Format::Npy => {
            let (shape, samples) = read_npy(&bytes);
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: grid(format).origin(),
                step: SPACING,
                samples,
            }
        }
        Format::Npz => {
            let arrays = read_npz(&bytes);
            let (shape, samples) = arrays["samples.npy"].clone();
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: three(&arrays["origin_cm.npy"].1),
                step: three(&arrays["spacing_cm.npy"].1),
                samples,
            }
        }
        Format::Nifti => read_nifti(&bytes),
        Format::NiftiGz => {
            let mut plain = Vec::new();
            let mut gz = flate2::read::GzDecoder::new(bytes.as_slice());
            std::io::Read::read_to_end(&mut gz, &mut plain).unwrap();
            read_nifti(&plain)
        }
        Format::MetaImage | Format::MetaImageSingle => read_metaimage(path, &bytes),
        Format::Nrrd => {
            let (header, samples) = read_nrrd(&bytes);
            assert_eq!(header["space"], "left-posterior-superior");
            let directions = list(&header["space directions"]);
            for (k, direction) in directions.iter().enumerate() {
                assert!(k % 4 == 0 || *direction == 0.0, "not along the axes");
            }
            Found {
                shape: sizes(&list(&header["sizes"])),
                first: mm_to_cm(three(&list(&header["space origin"]))),
                step: mm_to_cm([directions[0], directions[4], directions[8]]),
                samples,
            }
        }
        Format::InterfileStir => {
            let (header, samples) = read_interfile(path);
            assert_eq!(header["patient orientation"], "head_in");
            assert_eq!(header["patient rotation"], "supine");
            // Head in, supine: STIR's z runs to the feet.
            let to_lab = |v: [f64; 3]| [v[0] / 10.0, v[1] / 10.0, -v[2] / 10.0];
            Found {
                shape: sizes(&indexed(&header, "matrix size")),
                first: to_lab(three(&indexed(&header, "first pixel offset (mm)"))),
                step: to_lab(three(&indexed(&header, "scaling factor (mm/pixel)"))),
                samples,
            }
        }
        Format::InterfileSimind => {
            let (header, samples) = read_interfile(path);
            let mut size = indexed(&header, "matrix size");
            size.push(header["number of slices"].parse().unwrap());
            let mut step = indexed(&header, "scaling factor (mm/pixel)");
            let apart = &header["centre-centre slice separation (pixels)"];
            step.push(-step[0] * apart.parse::<f64>().unwrap());
            let step = mm_to_cm(three(&step));
            let shape = sizes(&size);
            Found {
                shape,
                first: [0, 1, 2].map(|a| -0.5 * (shape[a] as f64 - 1.0) * step[a]),
                step,
                samples,
            }
        }
        Format::RawJson => {
            let (header, samples) = read_json(path);
            let shape = sizes(&json_list(&header["shape"]));
            Found {
                shape: [shape[2], shape[1], shape[0]],
                first: three(&json_list(&header["origin_cm"])),
                step: three(&json_list(&header["spacing_cm"])),
                samples,
            }
        }
        other => panic!("no reader for {other:?}"),
    }
}

fn path_of(folder: &Path, format: Format) -> PathBuf {
    folder.join(format!("{format:?}.{}", format.volume_extension()))
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn every_sample_is_where_it_was_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let grid = grid(format);
        let samples = sampled(&grid);
        let path = path_of(folder.path(), format);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        write_volume(&path, &volume, format).unwrap();
        let found = read(&path, format);
        assert_eq!(found.shape, SHAPE, "{format:?}");
        assert_eq!(found.samples.len(), samples.len(), "{format:?}");
        for (k, sample) in found.samples.iter().enumerate() {
            // NIfTI keeps places as f32, 1e-7 of at most 40 mm, and the field grows by 64 a cm.
            let expected = field(found.centre(k));
            assert!(
                (sample - expected).abs() < 1e-4,
                "{format:?} {k}: {sample} {expected}"
            );
        }
    }
}

#[test]
fn labels_of_8_and_16_bits_come_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let grid = grid(format);
        let small = labels(&grid);
        // Beyond 8 bits, and with two different bytes.
        let large: Vec<u16> = small.iter().map(|&v| 0x1234 + 257 * u16::from(v)).collect();
        let expected = sampled(&grid);
        let path = path_of(folder.path(), format);
        for wide in [false, true] {
            let volume = if wide {
                Volume::new(grid, large.as_slice()).unwrap()
            } else {
                Volume::new(grid, small.as_slice()).unwrap()
            };
            write_volume(&path, &volume, format).unwrap();
            let found = read(&path, format);
            assert_eq!(found.samples.len(), grid.len(), "{format:?}");
            for (k, sample) in found.samples.iter().enumerate() {
                // The voxel that a label names is the one at that place.
                let voxel = if wide {
                    (*sample - 4660.0) / 257.0
                } else {
                    *sample
                };
                let there = f64::from(expected[voxel as usize]);
                assert!((there - field(found.centre(k))).abs() < 1e-4, "{format:?}");
            }
        }
    }
}

const PITCH: [f64; 2] = [0.25, 0.5];
const BINS: usize = 5;
const ROWS: usize = 4;
const RADIUS: f64 = 20.0;

/// A value for every view, row and bin: angle in degrees, place in cm.
fn seen(theta: f64, [s, z]: [f64; 2]) -> f64 {
    theta.to_degrees() + 0.125 * s + 0.015625 * z
}

fn stack(angles: &[f64], offset: [f64; 2]) -> (ParallelDetector, Vec<f32>) {
    let detector = ParallelDetector::new(BINS, ROWS, PITCH).unwrap();
    let detector = detector.with_offset(offset).unwrap();
    let mut samples = Vec::new();
    for &theta in angles {
        for row in 0..ROWS {
            for bin in 0..BINS {
                samples.push(seen(theta, place(bin, row, offset)) as f32);
            }
        }
    }
    (detector, samples)
}

fn place(bin: usize, row: usize, offset: [f64; 2]) -> [f64; 2] {
    [
        (bin as f64 - 2.0) * PITCH[0] + offset[0],
        (row as f64 - 1.5) * PITCH[1] + offset[1],
    ]
}

/// The angle of each view, the first bin and row with their signed steps in cm, and the samples.
fn read_stack(path: &Path, format: Format) -> (Vec<f64>, [f64; 2], [f64; 2], Vec<f64>) {
    let bytes = fs::read(path).unwrap();
    let two = |v: &[f64]| [v[0], v[1]];
    match format {
        Format::Npz => {
            let arrays = read_npz(&bytes);
            assert_eq!(
                arrays["samples.npy"].0,
                [arrays["angles_rad.npy"].1.len(), ROWS, BINS]
            );
            assert_eq!(arrays["radius_cm.npy"].1, [RADIUS]);
            (
                arrays["angles_rad.npy"].1.clone(),
                two(&arrays["first_cm.npy"].1),
                two(&arrays["pitch_cm.npy"].1),
                arrays["samples.npy"].1.clone(),
            )
        }
        Format::Nrrd => {
            let (header, samples) = read_nrrd(&bytes);
            let first = [&header["first_bin_mm"], &header["first_row_mm"]];
            let step = list(&header["spacings"]);
            (
                list(&header["angles_rad"]),
                first.map(|v| v.parse::<f64>().unwrap() / 10.0),
                [step[0] / 10.0, step[1] / 10.0],
                samples,
            )
        }
        Format::RawJson => {
            let (header, samples) = read_json(path);
            (
                json_list(&header["angles_rad"]),
                two(&json_list(&header["first_cm"])),
                two(&json_list(&header["pitch_cm"])),
                samples,
            )
        }
        Format::InterfileStir | Format::InterfileSimind => {
            let (header, samples) = read_interfile(path);
            let number = |key: &str| header[key].parse::<f64>().unwrap();
            let n = number("number of projections");
            let turned = match header["direction of rotation"].as_str() {
                "CCW" => number("extent of rotation"),
                other => {
                    assert_eq!(other, "CW");
                    -number("extent of rotation")
                }
            };
            let half_turn = if format == Format::InterfileSimind {
                180.0
            } else {
                0.0
            };
            let start = number("start angle") - half_turn;
            assert_eq!(number("Radius"), 10.0 * RADIUS);
            assert_eq!(indexed(&header, "matrix size"), [BINS as f64, ROWS as f64]);
            let pitch = indexed(&header, "scaling factor (mm/pixel)");
            let step = [pitch[0] / 10.0, -pitch[1] / 10.0]; // rows from head to feet
            let angles = (0..n as usize)
                .map(|k| (start + k as f64 * turned / n).to_radians())
                .collect();
            let first = [
                -0.5 * (BINS - 1) as f64 * step[0],
                -0.5 * (ROWS - 1) as f64 * step[1],
            ];
            (angles, first, step, samples)
        }
        other => panic!("no reader for {other:?}"),
    }
}

#[test]
fn projections_keep_their_angles_bins_and_rows() {
    let folder = tempfile::tempdir().unwrap();
    // Uneven and off the centre where the format can hold it; both senses of turning where not.
    let even: Vec<f64> = (0..6).map(|k| 0.5 + 0.25 * f64::from(k)).collect();
    let back: Vec<f64> = even.iter().rev().copied().collect();
    let uneven = vec![0.5, 0.625, 1.5, 1.25];
    let cases = [
        (Format::Npz, &uneven, [0.5, -0.125]),
        (Format::Nrrd, &uneven, [0.5, -0.125]),
        (Format::RawJson, &uneven, [0.5, -0.125]),
        (Format::InterfileStir, &even, [0.0; 2]),
        (Format::InterfileStir, &back, [0.0; 2]),
        (Format::InterfileSimind, &even, [0.0; 2]),
        (Format::InterfileSimind, &back, [0.0; 2]),
    ];
    for (format, angles, offset) in cases {
        let (detector, samples) = stack(angles, offset);
        let projections = Projections::new(detector, angles, RADIUS, samples.as_slice()).unwrap();
        let extension = format.projections_extension().unwrap();
        let path = folder.path().join(format!("{format:?}.{extension}"));
        write_projections(&path, &projections, format).unwrap();
        let (found, first, step, samples) = read_stack(&path, format);
        assert_eq!(found.len(), angles.len());
        assert_eq!(samples.len(), angles.len() * ROWS * BINS);
        for (k, sample) in samples.iter().enumerate() {
            let theta = found[k / (ROWS * BINS)];
            let (row, bin) = (k / BINS % ROWS, k % BINS);
            let at = [
                first[0] + bin as f64 * step[0],
                first[1] + row as f64 * step[1],
            ];
            // Rounding of the f32 sample, at most 86; start angles modulo a full turn.
            let expected = seen(theta, at);
            let off = (sample - expected + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off.abs() < 2e-5, "{format:?} {k}: {sample} {expected}");
        }
    }
    // The bare array is the samples and nothing else.
    let (detector, samples) = stack(&uneven, [0.5, 0.0]);
    let projections = Projections::new(detector, &uneven, RADIUS, samples.as_slice()).unwrap();
    let path = folder.path().join("bare.npy");
    write_projections(&path, &projections, Format::Npy).unwrap();
    let (shape, found) = read_npy(&fs::read(&path).unwrap());
    assert_eq!(shape, [4, ROWS, BINS]);
    assert!(found.iter().zip(&samples).all(|(a, b)| *a == f64::from(*b)));
}

#[test]
fn writing_twice_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL {
        let grid = grid(format);
        let samples = sampled(&grid);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        let path = path_of(folder.path(), format);
        write_volume(&path, &volume, format).unwrap();
        let once = fs::read(&path).unwrap();
        write_volume(&path, &volume, format).unwrap();
        assert_eq!(fs::read(&path).unwrap(), once, "{format:?}");
    }
    // One file each, two for the four with a header of their own; no temporary ones.
    assert_eq!(entries(folder.path()), Format::ALL.len() + 4);
}

#[test]
fn meshes_are_in_millimetres() {
    let folder = tempfile::tempdir().unwrap();
    let meridian = Meridian::new(&[[0.0, 1.5], [2.0, 1.5], [2.0, 0.0]]).unwrap();
    let body = Body::new(vec![meridian], Pose::identity()).unwrap();
    let mesh = body.mesh(0, 0.01).unwrap();
    let (stl, ply) = (folder.path().join("a.stl"), folder.path().join("a.ply"));
    write_stl(&stl, &mesh).unwrap();
    write_ply(&ply, &mesh).unwrap();
    let corners = |at: &dyn Fn(usize) -> f64, n: usize| {
        let values = (0..n).map(at);
        values.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)))
    };
    let all: Vec<f64> = mesh.vertices.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    let (low, high) = corners(&|k| 10.0 * all[k], all.len());
    let bytes = fs::read(&stl).unwrap();
    assert_eq!(bytes.len(), 84 + 50 * mesh.triangles.len());
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let vertex = |k: usize| float(84 + k / 9 * 50 + 12 + k % 9 * 4);
    let (least, most) = corners(&vertex, 9 * mesh.triangles.len());
    // f32 of at most 20 mm.
    assert!((least - low).abs() < 2e-6 && (most - high).abs() < 2e-6);
    let bytes = fs::read(&ply).unwrap();
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let float = |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let vertex = |k: usize| float(start + k / 3 * 24 + k % 3 * 4);
    let (least, most) = corners(&vertex, all.len());
    assert!((least - low).abs() < 2e-6 && (most - high).abs() < 2e-6);
}

#[path = "files/failures.rs"]
mod failures;
#[cfg(feature = "figures")]
#[path = "files/pictures.rs"]
mod pictures;
#[path = "files/readers.rs"]
mod readers;
