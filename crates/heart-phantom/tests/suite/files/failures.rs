//! Rejected files, and the state after a failure.

use super::*;
use heart_phantom::files::write_npy;
use revolve_voxel::RevolveError;

/// Returns the error and checks that the folder is unchanged.
fn refused(folder: &Path, result: Result<(), PhantomError>) -> PhantomError {
    assert_eq!(entries(folder), 0);
    result.unwrap_err()
}

#[test]
fn invalid_volumes_are_rejected() {
    let grid = grid(Format::Nifti);
    let samples = sampled(&grid);
    let short = Volume::new(grid, &samples[1..]);
    assert!(matches!(
        short,
        Err(PhantomError::WrongLength {
            given: 59,
            expected: 60,
            ..
        })
    ));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut samples = samples.clone();
        samples[59] = bad;
        let volume = Volume::new(grid, &samples);
        assert!(matches!(volume, Err(PhantomError::OutOfRange { .. })));
    }
    // The grid itself rejects these.
    let refused = VoxelGrid::new(SHAPE, [f64::NAN, 1.0, 1.0], [0.0; 3]);
    assert!(matches!(refused, Err(RevolveError::NotFinite { .. })));
    let refused = VoxelGrid::new([0, 1, 1], SPACING, [0.0; 3]);
    assert!(matches!(refused, Err(RevolveError::TooFew { .. })));
    // Lengths that f32 headers would turn into infinity or zero.
    for (spacing, origin) in [(1e39, 0.0), (1e-40, 0.0), (1.0, 1e38)] {
        let grid = VoxelGrid::new([1; 3], [spacing; 3], [origin; 3]).unwrap();
        let volume = Volume::new(grid, [0_u8].as_slice());
        assert!(matches!(volume, Err(PhantomError::OutOfRange { .. })));
    }
    // A count of voxels that overflows.
    let refused = VoxelGrid::new([usize::MAX; 3], SPACING, [0.0; 3]);
    assert!(matches!(refused, Err(RevolveError::TooLarge { .. })));
}

#[test]
fn only_nifti_rejects_a_side_too_long_for_16_bits() {
    let folder = tempfile::tempdir().unwrap();
    for (n, fits) in [(32767, true), (32768, false)] {
        let grid = VoxelGrid::cube(1, 0.1).unwrap();
        let grid = VoxelGrid::new([1, n, 1], grid.spacing(), [0.0; 3]).unwrap();
        let samples = vec![0_u8; n];
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        for format in [Format::Nifti, Format::NiftiGz] {
            let path = path_of(folder.path(), format);
            let result = write(&path, &volume, format);
            if fits {
                result.unwrap();
                fs::remove_file(path).unwrap();
            } else {
                assert!(matches!(
                    refused(folder.path(), result),
                    PhantomError::Count {
                        given: 32768,
                        most: 32767,
                        ..
                    }
                ));
            }
        }
        let nrrd = folder.path().join("long.nrrd");
        write(&nrrd, &volume, Format::Nrrd).unwrap();
        fs::remove_file(nrrd).unwrap();
    }
}

#[test]
fn unsupported_data_of_a_format_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    // An off-centre grid, by a hundredth of a voxel along one axis.
    for a in 0..3 {
        let mut offset = [0.0; 3];
        offset[a] = 0.01 * SPACING[a];
        let grid = VoxelGrid::centred(SHAPE, SPACING, offset).unwrap();
        let samples = sampled(&grid);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        let result = write(&at("a.h00"), &volume, Format::InterfileSimind);
        let error = refused(folder.path(), result);
        assert!(
            matches!(error, PhantomError::OutOfRange { given, .. } if (given - 0.01).abs() < 1e-9)
        );
    }
    let uneven = [0.0, 0.5, 1.001];
    // By a hundred-thousandth of a small step: ten times the allowed difference.
    let nearly_even = [0.0, 0.02, 0.040_000_4];
    let still = [0.5, 0.5];
    let even = [0.0, 0.5, 1.0];
    let cases: [(&[f64], [f64; 2]); 5] = [
        (&uneven, [0.0; 2]),
        (&nearly_even, [0.0; 2]),
        (&still, [0.0; 2]),
        (&even, [0.01, 0.0]),
        (&even, [0.0, 0.01]),
    ];
    for (angles, offset) in cases {
        let (detector, samples) = stack(angles, offset);
        let projections =
            Projections::new(detector, angles, &[RADIUS], samples.as_slice()).unwrap();
        for (name, format) in [
            ("a.hs", Format::InterfileStir),
            ("a.h00", Format::InterfileSimind),
        ] {
            let result = write(&at(name), &projections, format);
            let error = refused(folder.path(), result);
            assert!(matches!(error, PhantomError::OutOfRange { .. }), "{error}");
        }
    }
    let (detector, samples) = stack(&even, [0.0; 2]);
    let projections = Projections::new(detector, &even, &[RADIUS], samples.as_slice()).unwrap();
    for format in plain() {
        if format.info().projections.is_none() {
            let result = write(&path_of(folder.path(), format), &projections, format);
            let error = refused(folder.path(), result);
            assert!(matches!(error, PhantomError::Unsupported { .. }));
        }
    }
}

#[test]
fn an_array_must_match_its_shape() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    for shape in [&[2, 2][..], &[], &[usize::MAX, 2]] {
        let error = refused(folder.path(), write_npy(&path, shape, &[0.0; 3]));
        assert!(matches!(error, PhantomError::WrongLength { given: 3, .. }));
    }
    write_npy(&path, &[3, 1], &[0.5, 1.5, 2.5]).unwrap();
    let found = read_npy(&fs::read(&path).unwrap());
    assert_eq!(found, (vec![3, 1], vec![0.5, 1.5, 2.5]));
}

#[test]
fn invalid_projections_are_rejected() {
    let (detector, samples) = stack(&[0.0, 1.0], [0.0; 2]);
    let new = |angles: &[f64], radius, samples: &[f32]| {
        Projections::new(detector, angles, &[radius], samples).map(|_| ())
    };
    assert!(matches!(
        new(&[], RADIUS, &samples),
        Err(PhantomError::Count { given: 0, .. })
    ));
    assert!(matches!(
        new(&[0.0, 1.0], RADIUS, &samples[1..]),
        Err(PhantomError::WrongLength { .. })
    ));
    for bad in [f64::NAN, f64::INFINITY, 1e7] {
        let result = new(&[0.0, bad], RADIUS, &samples);
        assert!(matches!(result, Err(PhantomError::OutOfRange { .. })));
    }
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let result = new(&[0.0, 1.0], radius, &samples);
        assert!(matches!(result, Err(PhantomError::OutOfRange { .. })));
    }
}

#[test]
fn invalid_file_names_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let grid = grid(Format::Nifti);
    let samples = sampled(&grid);
    let volume = Volume::new(grid, samples.as_slice()).unwrap();
    for (name, format) in [
        ("a.mha", Format::MetaImage),
        ("a", Format::Npy),
        ("amhd", Format::MetaImage),
        ("a.gz", Format::NiftiGz),
        ("..", Format::Npy),
    ] {
        let result = write(&folder.path().join(name), &volume, format);
        let error = refused(folder.path(), result);
        assert!(
            matches!(error, PhantomError::Extension { .. }),
            "{name}: {error}"
        );
    }
    for name in [".mhd", "..mhd", "a\nElementDataFile = b.mhd"] {
        let result = write(&folder.path().join(name), &volume, Format::MetaImage);
        let error = refused(folder.path(), result);
        assert!(matches!(error, PhantomError::Name { .. }), "{name}");
        let text = "more than dots before its extension, without control characters";
        assert!(error.to_string().contains(text), "{error}");
    }
}

#[test]
fn missing_and_obstructing_directories_leave_no_files() {
    let folder = tempfile::tempdir().unwrap();
    for format in plain() {
        let grid = grid(format);
        let samples = sampled(&grid);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        let path = path_of(&folder.path().join("missing"), format);
        let error = refused(folder.path(), write(&path, &volume, format));
        assert!(matches!(error, PhantomError::File { .. }));
    }
    for (format, data) in [
        (Format::MetaImage, "raw"),
        (Format::InterfileStir, "v"),
        (Format::InterfileSimind, "a00"),
        (Format::RawJson, "bin"),
    ] {
        let grid = grid(format);
        let samples = sampled(&grid);
        let volume = Volume::new(grid, samples.as_slice()).unwrap();
        let path = path_of(folder.path(), format);
        let in_the_way = path.with_extension(data);
        fs::create_dir(&in_the_way).unwrap();
        let refused = write(&path, &volume, format);
        assert!(matches!(refused, Err(PhantomError::File { path, .. }) if path == in_the_way));
        assert!(!path.exists(), "{format:?}: a header without data");
        assert_eq!(entries(folder.path()), 1);
        // Nor is an older header changed.
        fs::write(&path, "old").unwrap();
        write(&path, &volume, format).unwrap_err();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(entries(folder.path()), 2);
        fs::remove_file(path).unwrap();
        fs::remove_dir(in_the_way).unwrap();
    }
}

/// The operating system interrupts each write: a child process may write files of only a few kilobytes.
#[cfg(unix)]
#[test]
fn an_interrupted_write_keeps_the_older_file_and_leaves_no_temporary_file() {
    const FOLDER: &str = "HEART_PHANTOM_TEST_LIMITED_FOLDER";
    let grid = VoxelGrid::cube(24, 0.1).unwrap();
    // Not compressible to less than the limit: bits of a multiplicative sequence.
    let samples: Vec<f32> = (0..grid.len() as u32)
        .map(|k| (k.wrapping_mul(2_654_435_769) >> 8) as f32)
        .collect();
    let volume = Volume::new(grid, samples.as_slice()).unwrap();
    if let Some(folder) = std::env::var_os(FOLDER) {
        for format in plain() {
            let result = write(&path_of(Path::new(&folder), format), &volume, format);
            assert!(
                matches!(result, Err(PhantomError::File { .. })),
                "{format:?}"
            );
        }
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for format in plain() {
        fs::write(path_of(folder.path(), format), "old").unwrap();
    }
    // Without the trap the signal would end the child instead of failing the write.
    let child = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "files::failures::an_interrupted_write_keeps_the_older_file_and_leaves_no_temporary_file",
        ])
        .env(FOLDER, folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&child.stdout).into_owned();
    assert!(child.status.success(), "{said}");
    assert!(said.contains("1 passed"), "{said}");
    for format in plain() {
        let old = fs::read_to_string(path_of(folder.path(), format)).unwrap();
        assert_eq!(old, "old", "{format:?}");
    }
    assert_eq!(entries(folder.path()), plain().count());
}
