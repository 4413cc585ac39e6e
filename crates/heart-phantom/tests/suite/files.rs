//! Files: correct samples at correct positions in every format; atomic writes; errors before the first byte.
//!
//! The readers here are minimal and independent of the writers. `readers/check.py` does the same with nibabel, SimpleITK, numpy and pynrrd,
//! and with PyTomography's parsers for SIMIND's files; these tests run it if the packages can be imported.

use heart_phantom::PhantomError;
use heart_phantom::files::{
    FieldOf, Format, Projections, Samples, Volume, write, write_ply, write_stl,
};
use minimal::*;
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, VoxelGrid};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SHAPE: [usize; 3] = [5, 4, 3];
const SPACING: [f64; 3] = [0.25, 0.5, 0.75];

/// A volume with a different value in every voxel: `x + 8 y + 64 z`, in cm. Any flip, shift, exchange of axes or other unit changes it.
fn field([x, y, z]: [f64; 3]) -> f64 {
    x + 8.0 * y + 64.0 * z
}

/// The grid is off-centre, except for the format that cannot store it.
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

/// Labels that identify every voxel: its index.
fn labels(grid: &VoxelGrid) -> Vec<u8> {
    (0..grid.len() as u8).collect()
}

/// All formats except DICOM, whose samples are rounded: it has tests of its own.
fn plain() -> impl Iterator<Item = Format> {
    (Format::ALL.into_iter()).filter(|format| *format != Format::Dicom)
}

fn path_of(folder: &Path, format: Format) -> PathBuf {
    folder.join(format!("{format:?}.{}", format.info().volume.header))
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn every_sample_keeps_its_position_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for format in plain() {
        let grid = grid(format);
        let samples = sampled(&grid);
        let path = path_of(folder.path(), format);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        write(&path, &volume, format).unwrap();
        let found = read(&path, format);
        assert_eq!(found.shape, SHAPE, "{format:?}");
        assert_eq!(found.samples.len(), samples.len(), "{format:?}");
        for (k, sample) in found.samples.iter().enumerate() {
            // NIfTI stores positions as f32, 1e-7 of at most 40 mm, and the field grows by 64 per cm.
            let expected = field(found.centre(k));
            assert!(
                (sample - expected).abs() < 1e-4,
                "{format:?} {k}: {sample} {expected}"
            );
        }
    }
}

#[test]
fn labels_of_8_and_16_bits_are_restored_exactly() {
    let folder = tempfile::tempdir().unwrap();
    for format in plain() {
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
            write(&path, &volume, format).unwrap();
            let found = read(&path, format);
            assert_eq!(found.samples.len(), grid.len(), "{format:?}");
            for (k, sample) in found.samples.iter().enumerate() {
                // The voxel of a label is at its position.
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

/// A value for every view, row and bin: angle in degrees, position in cm.
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
            assert_eq!(number("Radius"), 10.0 * RADIUS);
            assert_eq!(indexed(&header, "matrix size"), [BINS as f64, ROWS as f64]);
            let pitch = indexed(&header, "scaling factor (mm/pixel)");
            let mut step = [pitch[0] / 10.0, -pitch[1] / 10.0]; // rows from head to feet
            let start = number("start angle");
            let angle = |k: f64| match format {
                // Viewed from the front of the patient, with the opposite rotation: beta = 180 degrees - theta, where beta = -start + k
                // step, or start - k step if CW.
                Format::InterfileSimind if turned < 0.0 => 180.0 - (start + k * turned / n),
                Format::InterfileSimind => 180.0 - (k * turned / n - start),
                _ => start + k * turned / n,
            };
            let angles = (0..n as usize).map(|k| angle(k as f64).to_radians());
            let angles = angles.collect();
            if format == Format::InterfileSimind {
                assert_eq!(header["program version"], "V8.0"); // the radius is in mm
                step[0] = -step[0];
            }
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
    // Uneven and off-centre if the format can store it; both directions of rotation if not.
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
        let projections =
            Projections::new(detector, angles, &[RADIUS], samples.as_slice()).unwrap();
        let extension = format.info().projections.unwrap().header;
        let path = folder.path().join(format!("{format:?}.{extension}"));
        write(&path, &projections, format).unwrap();
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
    // The bare array contains only the samples.
    let (detector, samples) = stack(&uneven, [0.5, 0.0]);
    let projections = Projections::new(detector, &uneven, &[RADIUS], samples.as_slice()).unwrap();
    let path = folder.path().join("bare.npy");
    write(&path, &projections, Format::Npy).unwrap();
    let (shape, found) = read_npy(&fs::read(&path).unwrap());
    assert_eq!(shape, [4, ROWS, BINS]);
    assert!(found.iter().zip(&samples).all(|(a, b)| *a == f64::from(*b)));
}

#[test]
fn writing_twice_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for format in plain() {
        let grid = grid(format);
        let samples = sampled(&grid);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        let path = path_of(folder.path(), format);
        write(&path, &volume, format).unwrap();
        let once = fs::read(&path).unwrap();
        write(&path, &volume, format).unwrap();
        assert_eq!(fs::read(&path).unwrap(), once, "{format:?}");
    }
    // One file each, two for the four formats with a separate header; no temporary ones.
    assert_eq!(entries(folder.path()), plain().count() + 4);
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

mod dicom;
mod failures;
mod gates;
mod minimal;
mod npy;
mod pictures;
mod rays;
mod readers;
mod sparse;

/// Ninety views of two degrees are 180 degrees, and 0.7 cm are 7 mm.
#[test]
fn headers_contain_no_rounding_digits() {
    let folder = tempfile::tempdir().unwrap();
    let angles: Vec<f64> = (0..90)
        .map(|k| f64::from(k) * std::f64::consts::PI / 90.0)
        .collect();
    let detector = ParallelDetector::new(3, 1, [0.7, 1.1]).unwrap();
    let samples = vec![0.0f32; 3 * 90];
    let projections = Projections::new(detector, &angles, &[14.1], samples.as_slice()).unwrap();
    let path = folder.path().join("a.hs");
    write(&path, &projections, Format::InterfileStir).unwrap();
    let (header, _) = read_interfile(&path);
    assert_eq!(header["extent of rotation"], "180");
    assert_eq!(header["scaling factor (mm/pixel) [1]"], "7");
    assert_eq!(header["scaling factor (mm/pixel) [2]"], "11");
    assert_eq!(header["Radius"], "141");
}

#[test]
fn samples_have_a_number_and_a_size() {
    for (samples, len, bytes) in [
        (Samples::F32(&[0.5; 3]), 3, 4),
        (Samples::U8(&[]), 0, 1),
        (Samples::U16(&[7]), 1, 2),
    ] {
        let found = (samples.len(), samples.is_empty(), samples.bytes_each());
        assert_eq!(found, (len, len == 0, bytes));
    }
}
