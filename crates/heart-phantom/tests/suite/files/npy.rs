//! The bytes of NumPy: `numpy.save` of NumPy 2.4.6 writes the same arrays identically.

use super::*;
use heart_phantom::files::write_npy;

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
