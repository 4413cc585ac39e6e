//! The bytes of NumPy: `numpy.save` of NumPy 2.4.6 writes the same arrays identically.

use super::*;
use heart_phantom::files::{Samples, get_npy, put_npy, write_npy};
use std::io;

/// A file of `numpy.save`: its header has 128 bytes and ends with a line feed.
fn saved(array: &str, values: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{array:117}\n").bytes());
    bytes.extend(values);
    bytes
}

#[test]
fn arrays_are_identical_to_those_of_numpy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let values: Vec<f32> = (0..6).map(|k| 0.5 * k as f32 - 1.0).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    for (shape, n, array) in [
        (
            &[2, 3][..],
            6,
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }",
        ),
        (
            &[5],
            5,
            "{'descr': '<f4', 'fortran_order': False, 'shape': (5,), }",
        ),
        (
            &[1, 2, 1, 3],
            6,
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 1, 3), }",
        ),
        (
            &[3, 0],
            0,
            "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 0), }",
        ),
        (
            &[],
            1,
            "{'descr': '<f4', 'fortran_order': False, 'shape': (), }",
        ),
    ] {
        write_npy(&path, shape, &values[..n]).unwrap();
        assert_eq!(
            fs::read(&path).unwrap(),
            saved(array, &bytes[..4 * n]),
            "{shape:?}"
        );
    }

    let grid = grid(Format::Npy);
    let small = labels(&grid);
    let large: Vec<u16> = small.iter().map(|&v| 0x1234 + 257 * u16::from(v)).collect();
    write(
        &path,
        &Volume::new(grid, small.as_slice()).unwrap(),
        Format::Npy,
    )
    .unwrap();
    let array = "{'descr': '|u1', 'fortran_order': False, 'shape': (3, 4, 5), }";
    assert_eq!(fs::read(&path).unwrap(), saved(array, &small));
    write(
        &path,
        &Volume::new(grid, large.as_slice()).unwrap(),
        Format::Npy,
    )
    .unwrap();
    let array = "{'descr': '<u2', 'fortran_order': False, 'shape': (3, 4, 5), }";
    let bytes: Vec<u8> = large.iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(fs::read(&path).unwrap(), saved(array, &bytes));
}

#[test]
fn values_begin_at_a_multiple_of_64_bytes_and_a_65th_axis_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    for n_axes in 0..=64 {
        write_npy(&path, &vec![1; n_axes], &[0.25]).unwrap();
        let bytes = fs::read(&path).unwrap();
        assert_eq!((bytes.len() - 4) % 64, 0, "{n_axes} axes");
        assert_eq!(bytes[bytes.len() - 5], b'\n');
        assert_eq!(read_npy(&bytes), (vec![1; n_axes], vec![0.25]));
    }
    fs::remove_file(&path).unwrap();
    let bad = write_npy(&path, &[1; 65], &[0.25]).unwrap_err();
    assert!(
        matches!(
            bad,
            PhantomError::Count {
                given: 65,
                most: 64,
                ..
            }
        ),
        "{bad}"
    );
    assert!(!path.exists());
}

/// An array as NumPy 2 stores it.
fn npy(version: u8, header: &str, samples: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x93, b'N', b'U', b'M', b'P', b'Y', version, 0];
    let length = (header.len() as u32).to_le_bytes();
    bytes.extend(&length[..if version == 1 { 2 } else { 4 }]);
    bytes.extend(header.as_bytes());
    bytes.extend(samples);
    bytes
}

#[test]
fn arrays_are_read_as_they_were_written() {
    let (floats, labels, counts) = (
        [0.5_f32, -1e30, f32::MIN_POSITIVE],
        [1_u8, 255, 0],
        [256_u16, 65535, 7],
    );
    let all: [Samples; 3] = [
        (&floats[..]).into(),
        (&labels[..]).into(),
        (&counts[..]).into(),
    ];
    for samples in all {
        for shape in [&[3][..], &[1, 3, 1], &[3, 1]] {
            let mut bytes = Vec::new();
            put_npy(&mut bytes, shape, samples).unwrap();
            let found = get_npy(&bytes[..]).unwrap();
            let expected = match samples {
                Samples::F32(values) => values.to_vec(),
                Samples::U8(values) => values.iter().copied().map(f32::from).collect(),
                Samples::U16(values) => values.iter().copied().map(f32::from).collect(),
            };
            assert_eq!((&found.shape[..], found.samples), (shape, expected));
            for length in 0..bytes.len() {
                let error = get_npy(&bytes[..length]).unwrap_err();
                assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
            }
        }
    }
    let mut empty = Vec::new();
    put_npy(&mut empty, &[0, 4], Samples::U8(&[])).unwrap();
    assert_eq!(get_npy(&empty[..]).unwrap().shape, [0, 4]);
    let scalar = npy(
        3,
        "{'descr': '|u1', 'fortran_order': False, 'shape': (), }\n",
        &[9],
    );
    let scalar = get_npy(&scalar[..]).unwrap();
    assert_eq!((scalar.shape, scalar.samples), (vec![], vec![9.0]));
}

/// Numbers of the definition: sign, power of two and fraction.
#[test]
fn half_precision_is_exact() {
    let samples: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_le_bytes).collect();
    let bytes = npy(
        1,
        "{'descr': '<f2', 'fortran_order': False, 'shape': (65536,), }",
        &samples,
    );
    let found = get_npy(&bytes[..]).unwrap().samples;
    for (bits, found) in found.into_iter().enumerate() {
        let (exponent, fraction) = (bits >> 10 & 31, (bits & 1023) as f64 / 1024.0);
        let size = match exponent {
            0 => fraction * 2_f64.powi(-14),
            31 if fraction == 0.0 => f64::INFINITY,
            31 => f64::NAN,
            _ => (1.0 + fraction) * 2_f64.powi(exponent as i32 - 15),
        };
        let expected = if bits < 0x8000 { size } else { -size };
        assert!(
            f64::from(found) == expected || (found.is_nan() && expected.is_nan()),
            "{bits:x}"
        );
        assert!(found.is_nan() || found.is_sign_negative() == (bits >= 0x8000));
    }
}

#[test]
fn other_files_are_rejected() {
    for (header, what) in [
        (
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }",
            "type",
        ),
        (
            "{'descr': '>f4', 'fortran_order': False, 'shape': (1,), }",
            "type",
        ),
        ("{'fortran_order': False, 'shape': (1,), }", "type"),
        (
            "{'descr': '<f4', 'fortran_order': True, 'shape': (1, 1), }",
            "C order",
        ),
        (
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,), }",
            "shape",
        ),
        (
            "{'descr': '<f4', 'fortran_order': False, 'shape': 1, }",
            "shape",
        ),
        (
            "{'descr': '<f4', 'fortran_order': False, 'shape': (4294967296, 4294967296), }",
            "memory",
        ),
        ("", "C order"),
    ] {
        let error = get_npy(&npy(1, header, &[0; 4])[..]).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData, "{header}");
        assert!(error.to_string().contains(what), "{header}: {error}");
    }
    // A length that no memory has.
    let large = npy(
        1,
        "{'descr': '|u1', 'fortran_order': False, 'shape': (9223372036854775807,), }",
        &[0; 4],
    );
    assert_eq!(
        get_npy(&large[..]).unwrap_err().kind(),
        io::ErrorKind::UnexpectedEof
    );
    let error = get_npy(&b"PK\x03\x04 an archive"[..]).unwrap_err();
    assert!(error.to_string().contains("NumPy"));
    let error = heart_phantom::files::read_npy(Path::new("no such file.npy")).unwrap_err();
    assert!(matches!(error, PhantomError::Read { .. }));
}
