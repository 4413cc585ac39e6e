//! Messages of errors in scene files, with their places.

use super::*;

#[test]
fn unknown_fields_and_invalid_text_are_reported_with_their_place() {
    let error = error_of("[camera]\nviews = 60\ncolour = 'red'\n");
    assert_eq!(
        (error.first().place, error.first().field.as_str()),
        (Some([3, 1]), "camera.colour")
    );
    assert!(error.first().wanted.contains("views"), "{error}");
    let error = error_of("[camra]\nviews = 60\n");
    assert_eq!(error.first().place.map(|[line, _]| line), Some(1));
    assert!(error.first().wanted.contains("camera"), "{error}");
    let error = error_of("[camera\nviews = 60\n");
    assert_eq!(error.first().place.map(|[line, _]| line), Some(1));
    let error = error_of("[camera]\nviews = 60\nviews = 61\n");
    assert_eq!(error.first().place.map(|[line, _]| line), Some(3));
    // The arc policy is absent, and its default fits the default camera: the error is at the camera.
    let error = error_of("[camera]\narc = 90.0\n");
    assert_eq!(
        (error.first().field.as_str(), error.first().place),
        ("camera.arc", Some([2, 7]))
    );
    assert!(
        error.first().wanted.contains("reconstruction.arc"),
        "{error}"
    );
    let error = error_of("[camera]\nbins = 8192\nrows = 8192\nviews = 8\n");
    assert_eq!(
        (error.first().field.as_str(), error.first().place),
        ("camera.bins", Some([2, 8]))
    );
}

#[test]
fn json_with_a_repeated_key_is_an_error() {
    let text = r#"{"camera": {"views": 60, "views": 61}}"#;
    let error = Scene::from_json(text).unwrap_err();
    assert!(
        error.to_string().contains("`views`: duplicate key"),
        "{error}"
    );
    let large = r#"{"noise": {"counts": {"total": 18446744073709551615}}}"#;
    let scene = Scene::from_json(large).unwrap();
    assert_eq!(Scene::from_json(&scene.to_json()).unwrap(), scene);
}

/// The complete messages for frequent mistakes.
#[test]
fn messages_of_frequent_mistakes_are_complete() {
    for (text, said) in [
        (
            "[camera]\nviewz = 3\n",
            "line 2, column 1: camera.viewz: unknown field `viewz`, expected one of `views`",
        ),
        (
            "[camra]\nviews = 3\n",
            "line 1, column 2: camra: unknown field `camra`, expected one of `heart`",
        ),
        (
            "[noise]\nseed = 1\n",
            "line 1, column 1: noise: missing field `counts`",
        ),
        (
            "[camera]\nviews = 3.0\n",
            "line 2, column 9: camera.views is 3.0; invalid type: floating point `3.0`, expected a non-negative integer",
        ),
        (
            "[camera]\nviews = -3\n",
            "line 2, column 9: camera.views is -3; invalid value: integer `-3`, expected a non-negative integer",
        ),
        (
            "[camera]\nviews = 99999999999999999999\n",
            "line 2, column 9: camera.views is 99999999999999999999; out of range: integer `99999999999999999999`, expected a non-negative integer",
        ),
        (
            "[camera]\narc = '180'\n",
            "line 2, column 7: camera.arc is '180'; invalid type: string \"180\", expected a number",
        ),
        (
            "[camera]\npitch = [0.1, 0.2, 0.3]\n",
            "line 2, column 9: camera.pitch is [0.1, 0.2, 0.3]; invalid length 3, expected an array of 2 values",
        ),
        (
            "[camera]\npitch = [0.1]\n",
            "line 2, column 9: camera.pitch is [0.1]; invalid length 1, expected an array of 2 values",
        ),
        (
            "[acquisition]\nmode = { gated = { gates = 2 }, static = { phase = 0.0 } }\n",
            "only one of these can be chosen",
        ),
        (
            "[camera]\nviews = 3\nviews = 4\n",
            "line 3, column 1: `views`: duplicate key",
        ),
        (
            "acquisition.mode = 'gated'",
            "acquisition.mode is 'gated'; `gated` needs a value: mode = { gated = { gates = 16 } }",
        ),
        (
            "acquisition.mode = { gated = 16 }",
            "acquisition.mode.gated is 16; `gated` needs a value: mode = { gated = { gates = 16 } }",
        ),
        (
            "[reconstruction]\nwindow = \"butterworth\"",
            "reconstruction.window is \"butterworth\"; `butterworth` needs a value: window = { butterworth = { order = 5 } }",
        ),
        (
            "cycle.volume = 0.6",
            "cycle.volume is 0.6; must be range of the cavity volume: { gain = 0.6 }, { gains = ",
        ),
        (
            "noise = { counts = 1e6, seed = 1 }",
            "noise.counts is 1e6; must be expected number of counts: { total = 1e6 } in all projections of a gate, { per_unit = 10.0 } in",
        ),
        (
            "activity.wall = 1.0",
            "activity.wall is 1.0; must be { concentration = 1.0 } per mL at every phase, or { total = 100.0 }",
        ),
        (
            "cycle = 3",
            "cycle is 3; must be a section [cycle] with beats_per_minute, curve, volume",
        ),
        (
            "defects = [3]",
            "defects is 3; must be a section [[defects]] with layers, s, azimuths_degrees, activity",
        ),
        (
            "camera.arc = -4000",
            "camera.arc is -4000; its magnitude must be between 0.001 and 3600; negative is clockwise",
        ),
        (
            "camera.arc = 178",
            "camera.arc is 178; its magnitude must be at least 180 (178.03 for 90 views",
        ),
        (
            "cycle.volume = { volumes = { edv = 100.0, esv = 90 } }",
            "cycle.volume.volumes.esv is 90; must be at least 93.004, the reference volume",
        ),
        (
            "[reconstruction]\nmethod = { osem = { subsets = 2, iterations = 1 } }\npixel = 50",
            "line 3, column 9: reconstruction.pixel is 50; must be between 0.000625 and 6.25",
        ),
        (
            "reconstruction.window = { custom = [nan] }",
            "reconstruction.window.custom is an array of 1 values; must have between 2 and 65536 values",
        ),
        (
            "reconstruction.method = { osem = { subsets = 2, iterations = 1, attenuation = true } }",
            "needs a section [attenuation] or [chest]",
        ),
        // A byte-order mark and line ends of other systems do not change places.
        (
            "\u{feff}[camera]\r\nviews = 0\r\n",
            "line 2, column 9: camera.views is 0; must be between 1 and 10000",
        ),
    ] {
        let error = error_of(text).to_string();
        assert!(error.contains(said), "{error}\n{said}");
    }
}

/// For values of a wrong type, messages contain no names of Rust types.
#[test]
fn messages_contain_no_types_of_rust() {
    let full = toml::Table::try_from(Scene::from_toml(FULL).unwrap()).unwrap();
    let mut paths: Vec<Vec<String>> = Vec::new();
    for (section, fields) in &full {
        paths.push(vec![section.clone()]);
        for (field, value) in fields.as_table().into_iter().flatten() {
            paths.push(vec![section.clone(), field.clone()]);
            for name in value.as_table().into_iter().flatten().map(|(name, _)| name) {
                paths.push(vec![section.clone(), field.clone(), name.clone()]);
            }
        }
    }
    assert!(paths.len() > 70, "{}", paths.len());
    let mut said = 0;
    for path in &paths {
        for value in ["-1", "0.5", "true", "'x'", "[[]]", "{}", "{ x = 1 }"] {
            let text = format!("{} = {value}", path.join("."));
            let Err(error) = Scene::from_toml(&text) else {
                continue;
            };
            let error = error.to_string();
            for rust in [
                " variant",
                " struct",
                "Settings",
                "string or table",
                "sequence",
                "map,",
            ] {
                assert!(!error.contains(rust), "{text}\n{error}");
            }
            said += 1;
        }
    }
    assert!(said > 400, "{said}");
}

#[test]
fn errors_contain_the_name_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    assert!(matches!(Scene::load(&path), Err(PhantomError::Read { .. })));
    std::fs::write(&path, b"[camera]\nviews = 3 # caf\xe9\n").unwrap();
    let said = Scene::load(&path).unwrap_err().to_string();
    assert!(said.contains(":2:16: is not UTF-8"), "{said}");
    // An endless device.
    #[cfg(unix)]
    assert!(matches!(
        Scene::load(std::path::Path::new("/dev/zero")),
        Err(PhantomError::Read { .. })
    ));
    assert!(matches!(
        Scene::load(folder.path()),
        Err(PhantomError::Read { .. })
    ));
    std::fs::write(&path, "[camera]\nviews = 0\n").unwrap();
    let said = Scene::load(&path).unwrap_err().to_string();
    assert_eq!(
        said,
        format!(
            "{}:2:9: camera.views is 0; must be between 1 and 10000",
            path.display()
        )
    );
}
