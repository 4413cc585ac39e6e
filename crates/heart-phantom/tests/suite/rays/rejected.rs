//! Geometries and scenes that are rejected.

use super::*;

#[test]
fn geometries_without_rays_are_rejected() {
    let detector = ParallelDetector::new(4, 3, [1.0; 2]).unwrap();
    let good = pinhole(&mut 3, 4.0).matrix;
    let flat = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let mut nan = good;
    nan[1][2] = f64::NAN;
    for (bad, view_idx) in [
        (vec![flat], 0),
        (vec![good, nan], 1),
        (vec![good, good, [[0.0; 4]; 3]], 2),
    ] {
        match RayGeometry::from_matrices(&bad, detector) {
            Err(PhantomError::Matrix { view_idx: at, .. }) => assert_eq!(at, view_idx),
            other => panic!("{other:?}"),
        }
    }
    assert!(matches!(
        RayGeometry::from_matrices(&[], detector),
        Err(PhantomError::Count { .. })
    ));
    for distances in [
        [0.0, 10.0],
        [f64::NAN, 10.0],
        [20.0, 10.0],
        [20.0, f64::INFINITY],
    ] {
        let cone = RayGeometry::cone(distances, &[0.0], detector);
        assert!(
            matches!(cone, Err(PhantomError::OutOfRange { .. })),
            "{cone:?}"
        );
    }
    assert!(RayGeometry::fan([20.0, 30.0], &[f64::NAN], detector).is_err());
    let cone = RayGeometry::cone([20.0, 30.0], &[0.0, 1.0], detector).unwrap();
    assert!(matches!(
        cone.clone().with_times(&[0.0]),
        Err(PhantomError::WrongLength { .. })
    ));
    assert!(matches!(
        cone.clone().with_times(&[0.0, -1.0]),
        Err(PhantomError::OutOfRange { .. })
    ));
    assert!(matches!(cone.lines(2), Err(PhantomError::Count { .. })));
    let lists = vec![
        cone.lines(0).unwrap(),
        cone.lines(1).unwrap().rows(0..2).unwrap(),
    ];
    assert!(matches!(
        RayGeometry::from_lines(lists),
        Err(PhantomError::WrongLength { .. })
    ));
    let wide = ParallelDetector::new(1 << 20, 1 << 12, [1e-4; 2]).unwrap();
    let wide = RayGeometry::cone([20.0, 30.0], &[0.0], wide).unwrap();
    let phantom = Phantom::new(heart(Mode::Instants)).unwrap();
    assert!(matches!(
        phantom.along(wide),
        Err(PhantomError::OutOfRange { .. })
    ));
    // Settings that require parallel rays.
    let own = phantom.along(cone.clone()).unwrap();
    assert!(matches!(own.geometry(0), Err(PhantomError::Absent { .. })));
    assert!(own.reconstruct(0, &views(&own)).is_err());
    let lists = RayGeometry::from_lines(vec![cone.lines(0).unwrap()]).unwrap();
    let mut averages = heart(Mode::Instants);
    averages.camera.samples = Some(BinSample::Averages);
    let averages = Phantom::new(averages).unwrap();
    assert!(matches!(
        averages.along(lists.clone()),
        Err(PhantomError::Unsupported { .. })
    ));
    assert!(phantom.along(lists).unwrap().prepare().is_ok());
    // A source within the heart.
    let inside = RayGeometry::cone([1.0, 30.0], &[0.0], detector).unwrap();
    let inside = phantom.along(inside).unwrap();
    assert!(matches!(
        inside.view(0, 0),
        Err(PhantomError::SourceInside { view_idx: 0 })
    ));
    match inside.prepare() {
        Err(PhantomError::Rejected { field, source, .. }) => {
            assert_eq!(field, "camera.geometry");
            assert!(matches!(
                *source,
                PhantomError::SourceInside { view_idx: 0 }
            ));
        }
        other => panic!("{other:?}"),
    }
}

/// Every rule across sections, by the same code from a file, from Rust and for a run.
#[test]
fn scenes_that_need_parallel_rays_are_rejected() {
    let finding = |text: &str| {
        let text = format!("[camera]\nviews = 2\nbins = 8\nrows = 4\n{text}");
        match Scene::from_toml(&text) {
            Err(PhantomError::Scene(error)) => error.first().to_string(),
            other => panic!("{other:?}"),
        }
    };
    let cone = "geometry = { cone = { source_to_isocentre = 60.0, source_to_detector = 100.0 } }\n";
    let plain = "[output]\nwrite = [\"projections\"]\n";
    for (text, starts) in [
        (
            cone.to_owned(),
            "output.write is reconstruction; needs camera.geometry",
        ),
        (
            format!("{cone}{plain}projections = \"nrrd\"\n"),
            "output.projections is nrrd; stores parallel",
        ),
        (
            format!("{cone}rotation = \"continuous\"\n{plain}"),
            "camera.rotation is continuous; needs",
        ),
        (
            format!("{cone}[collimator]\nholes = \"ge-lehr\"\nintrinsic_fwhm = 0.4\n{plain}"),
            "collimator: parallel holes need",
        ),
        (
            cone.replace("100.0", "50.0") + plain,
            "camera.geometry: source_to_detector is 50, must be between 60",
        ),
        (
            cone.replace("cone", "fan").replace("60.0", "nan") + plain,
            "camera.geometry: source_to_isocentre is NaN",
        ),
        (
            format!("geometry = {{ matrices = \"/no/such.json\" }}\n{plain}"),
            "camera.geometry: cannot read /no/such.json",
        ),
        // An endless device.
        (
            format!("geometry = {{ matrices = \"/dev/zero\" }}\n{plain}"),
            "camera.geometry: cannot read /dev/zero",
        ),
    ] {
        let found = finding(&text);
        assert!(found.starts_with(starts), "{found}");
    }
}

#[test]
fn scenes_with_matrices_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[camera]\nviews = 2\nbins = 20\nrows = 16\npitch = [0.5, 0.5]\ngeometry = { matrices = \"two.json\" }\n\
        [acquisition]\nmode = \"instants\"\n[output]\nwrite = [\"projections\"]\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let mut seed = 11;
    let matrices: Vec<_> = (0..2).map(|_| pinhole(&mut seed, 20.0).matrix).collect();
    let write = |json: &serde_json::Value| {
        std::fs::write(folder.path().join("two.json"), json.to_string()).unwrap()
    };
    write(&serde_json::json!(matrices));
    let phantom = Phantom::load(&path).unwrap();
    let detector = ParallelDetector::new(20, 16, [0.5; 2]).unwrap();
    let rays = RayGeometry::from_matrices(&matrices, detector).unwrap();
    let mut plain = phantom.scene().clone();
    plain.camera.geometry = BeamSettings::Parallel;
    let along = Phantom::new(plain).unwrap().along(rays).unwrap();
    // JSON numbers are read to rounding.
    assert!(off(&views(&along), &views(&phantom)) < 1e-6);
    // The scene in the report is complete: it reads the same file from any directory.
    let again = Scene::from_toml(&phantom.scene().to_toml()).unwrap();
    assert_eq!(&again, phantom.scene());
    for (json, says) in [
        (
            serde_json::json!(matrices[..1]),
            "projection matrices, one per view: 1 values given, 2 expected",
        ),
        (serde_json::json!([1, 2]), "cannot read"),
        (
            serde_json::json!(vec![[[0.0; 4]; 3], matrices[1]]),
            "projection matrix 0 (from 0) must be finite",
        ),
    ] {
        write(&json);
        let error = Phantom::load(Path::new(&path)).unwrap_err().to_string();
        assert!(
            error.contains("camera.geometry: ") && error.contains(says),
            "{error}"
        );
    }
}

/// A multiple of a projection matrix has the same rays, and a multiple of a nearly singular one is rejected as well.
#[test]
fn the_scale_of_a_projection_matrix_has_no_effect() {
    let detector = ParallelDetector::new(4, 3, [1.0; 2]).unwrap();
    let good = pinhole(&mut 3, 4.0).matrix;
    let nearly_singular = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [1.0, 1.0, 1e-14, 1.0],
    ];
    let scaled = |matrix: [[f64; 4]; 3], factor: f64| {
        let matrix = matrix.map(|row| row.map(|entry| factor * entry));
        RayGeometry::from_matrices(&[matrix], detector)
    };
    let expected = scaled(good, 1.0).unwrap().lines(0).unwrap();
    for factor in [1e-8, 1e8] {
        let found = scaled(good, factor).unwrap().lines(0).unwrap();
        for (bin, row) in [(0, 0), (3, 0), (1, 2)] {
            let [a, b] = [&expected, &found].map(|lines| lines.ray(bin, row).unwrap());
            // Rounding of some tens of centimetres.
            assert!((a.direction() - b.direction()).norm() < 1e-12, "{factor}");
            assert!((a.at(50.0) - b.at(50.0)).norm() < 1e-10, "{factor}");
        }
        let rejected = scaled(nearly_singular, factor);
        assert!(
            matches!(rejected, Err(PhantomError::Matrix { .. })),
            "{factor}: {rejected:?}"
        );
    }
}
