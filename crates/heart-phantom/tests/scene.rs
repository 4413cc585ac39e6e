//! Scenes: what is read, what is refused and where, and that nothing makes the reader panic.

use heart_phantom::PhantomError;
use heart_phantom::scene::{Mode, Scene, SceneError};
use proptest::prelude::*;

fn error_of(text: &str) -> SceneError {
    match Scene::from_toml(text) {
        Err(PhantomError::Scene(error)) => *error,
        other => panic!("{text}\n{other:?}"),
    }
}

#[test]
fn a_written_scene_is_read_back() {
    let scene = Scene::default();
    assert_eq!(Scene::from_toml(&scene.to_toml()).unwrap(), scene);
    assert_eq!(Scene::from_toml("").unwrap(), scene);
    let text = "
        [heart]
        law = 'per-current-length'
        discretisation = { spectral = { degree = 12, per_piece = 2, tolerance = 1e-4 } }
        [heart.inner]
        length = 7.0
        radius = 2.0
        stiffness = 1.5
        [cycle]
        curve = { sampled = [120.0, 60.0, 50.0, 110.0] }
        volume = { volumes = { edv = 150.0, esv = 120.0 } }
        [pose]
        centre = 4.0
        turn_z = -10.0
        shift = [1.0, 2.0, -3.0]
        [activity]
        cavity = { total = 7.0 }
        [background]
        concentration = 0.1
        centre = [0.0, 1.0]
        semi_axes = [7.0, 6.0]
        [[defects]]
        layers = [0.0, 0.5]
        s = [0.1, 0.3]
        azimuths = [-30.0, 30.0]
        activity = 0.0
        [[defects]]
        layers = [0.5, 1.0]
        s = [0.4, 0.5]
        azimuths = [0.0, 360.0]
        activity = 2.0
        [blur]
        fwhm = 0.8
        [noise]
        counts = { total = 1e6 }
        seed = 7
        [attenuation]
        coefficient = 0.15
        medium = { torso = { centre = [0.0, 1.0], semi_axes = [16.0, 11.0] } }
        [camera]
        rotation = 'continuous'
        arc = -360.0
        [acquisition]
        mode = { gated = { gates = 8 } }
        accuracy = { tolerance = 0.01 }
        [reconstruction]
        window = { butterworth = { order = 5 } }
        pixels = 64
        pixel = 0.25
        region = { x = [10, 20], y = [0, 64] }
        [output]
        write = ['labels', 'meshes']
        volumes = 'meta-image'
        projections = 'raw-json'
    ";
    let scene = Scene::from_toml(text).unwrap();
    assert_eq!(scene.acquisition.mode, Mode::Gated { gates: 8 });
    let again = scene.to_toml();
    assert_eq!(Scene::from_toml(&again).unwrap(), scene, "{again}");
}

/// Every field with a value that makes no sense: what the file says, the field that the error names, and words of its advice.
const BAD: &[(&str, &str, &str)] = &[
    (
        "[heart]\nlaw = 'per-volume'",
        "heart.law",
        "per-material-length",
    ),
    (
        "[heart]\ndiscretisation = 'fine'",
        "heart.discretisation",
        "differences",
    ),
    (
        "[heart]\ndiscretisation = { differences = { nodes = 3 } }",
        "heart.discretisation.differences.nodes",
        "11",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 2, per_piece = 1, tolerance = 1e-4 } }",
        "heart.discretisation.spectral.degree",
        "4",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 8, per_piece = 0, tolerance = 1e-4 } }",
        "heart.discretisation.spectral.per_piece",
        "1",
    ),
    (
        "[heart]\ndiscretisation = { spectral = { degree = 8, per_piece = 1, tolerance = 0.0 } }",
        "heart.discretisation.spectral.tolerance",
        "between",
    ),
    (
        "[heart.inner]\nlength = -1.0\nradius = 1.0\nstiffness = 1.0",
        "heart.inner.length",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nradius = nan\nstiffness = 1.0",
        "heart.inner.radius",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nradius = 1.0\nstiffness = 0.0",
        "heart.inner.stiffness",
        "between",
    ),
    (
        "[heart.inner]\nlength = 8.0\nradius = 1.0",
        "heart.inner",
        "stiffness",
    ),
    (
        "[heart.outer]\nlength = inf\nradius = 3.0\nstiffness = 1.0",
        "heart.outer.length",
        "between",
    ),
    (
        "[heart.outer]\nlength = 7.0\nradius = 2.0\nstiffness = 1.0",
        "heart.outer.length",
        "apex",
    ),
    (
        "[heart.outer]\nlength = 8.5\nradius = 1.0\nstiffness = 1.0",
        "heart.outer.radius",
        "1.75",
    ),
    (
        "[heart.outer]\nlength = 8.5\nradius = 3.0\nstiffness = -2.0",
        "heart.outer.stiffness",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 0.0",
        "cycle.beats_per_minute",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 'fast'",
        "cycle.beats_per_minute",
        "f64",
    ),
    ("[cycle]\ncurve = 'square'", "cycle.curve", "sinusoid"),
    ("[cycle]\ncurve = { sampled = [1.0] }", "cycle.curve", "3"),
    (
        "[cycle]\ncurve = { sampled = [1.0, 1.0, 1.0] }",
        "cycle.curve",
        "range",
    ),
    (
        "[cycle]\ncurve = { sampled = [1.0, inf, 1.0] }",
        "cycle.curve",
        "between",
    ),
    (
        "[cycle]\nbeats_per_minute = 200.0\ncurve = 'physiological'",
        "cycle.curve",
        "140",
    ),
    (
        "[cycle]\nvolume = { gain = -0.1 }",
        "cycle.volume.gain",
        "between",
    ),
    (
        "[cycle]\nvolume = { ejection_fraction = 1.0 }",
        "cycle.volume.ejection_fraction",
        "between",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 150.0, esv = 50.0 } }",
        "cycle.volume.volumes.esv",
        "rest volume",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 100.0, esv = 110.0 } }",
        "cycle.volume.volumes.edv",
        "end-systolic",
    ),
    (
        "[cycle]\nvolume = { volumes = { edv = 1e9, esv = 110.0 } }",
        "cycle.volume.volumes.edv",
        "between",
    ),
    ("[cycle]\nvolume = 0.6", "cycle.volume", "table"),
    ("[pose]\ncentre = nan", "pose.centre", "between"),
    ("[pose]\nturn_x = 400.0", "pose.turn_x", "360"),
    ("[pose]\nturn_y = nan", "pose.turn_y", "between"),
    ("[pose]\nturn_z = -1e9", "pose.turn_z", "between"),
    ("[pose]\nshift = [0.0, inf, 0.0]", "pose.shift", "between"),
    ("[pose]\nshift = [0.0, 1.0]", "pose.shift", "3"),
    (
        "[activity]\ncavity = { concentration = -1.0 }",
        "activity.cavity",
        "between",
    ),
    (
        "[activity]\nwall = { total = nan }",
        "activity.wall",
        "between",
    ),
    ("[activity]\nwall = 1.0", "activity.wall", "table"),
    ("[attenuation]\ncoefficient = 0.15", "attenuation", "medium"),
    (
        "[attenuation]\ncoefficient = -0.1\nmedium = 'heart'",
        "attenuation.coefficient",
        "between",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = 'lead'",
        "attenuation.medium",
        "torso",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [nan, 0.0], semi_axes = [1.0, 1.0] } }",
        "attenuation.medium.torso.centre",
        "between",
    ),
    (
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [0.0, 0.0], semi_axes = [1.0, 0.0] } }",
        "attenuation.medium.torso.semi_axes",
        "between",
    ),
    (
        "[output]\nwrite = ['attenuation']",
        "output.write",
        "needs a section",
    ),
    (
        "[background]\nconcentration = -0.1\ncentre = [0.0, 0.0]\nsemi_axes = [9.0, 8.0]",
        "background.concentration",
        "between",
    ),
    (
        "[background]\nconcentration = 0.1\ncentre = [0.0, inf]\nsemi_axes = [9.0, 8.0]",
        "background.centre",
        "between",
    ),
    (
        "[background]\nconcentration = 0.1\ncentre = [0.0, 0.0]\nsemi_axes = [9.0, -8.0]",
        "background.semi_axes",
        "between",
    ),
    ("[[defects]]\ns = [0.1, 0.2]", "defects.0", "missing field"),
    (
        "[[defects]]\nlayers = [0.5, 0.2]\ns = [0.1, 0.2]\nazimuths = [0.0, 90.0]\nactivity = 0.0",
        "defects.0.layers",
        "from < to",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.6]\nazimuths = [0.0, 90.0]\nactivity = 0.0",
        "defects.0.s",
        "0.5",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths = [0.0, 400.0]\nactivity = 0.0",
        "defects.0.azimuths",
        "360",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths = [nan, 40.0]\nactivity = 0.0",
        "defects.0.azimuths",
        "between",
    ),
    (
        "[[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.2]\nazimuths = [0.0, 40.0]\nactivity = -1.0",
        "defects.0.activity",
        "between",
    ),
    ("[blur]\nfwhm = -1.0", "blur.fwhm", "between"),
    ("[blur]\nfwhm = 17.0", "blur.fwhm", "16"),
    (
        "[noise]\ncounts = { total = 0.0 }\nseed = 1",
        "noise.counts.total",
        "between",
    ),
    (
        "[noise]\ncounts = { per_unit = nan }\nseed = 1",
        "noise.counts.per_unit",
        "between",
    ),
    ("[noise]\ncounts = 5.0\nseed = 1", "noise.counts", "table"),
    (
        "[noise]\ncounts = { per_unit = 1.0 }\nseed = -1",
        "noise.seed",
        "u64",
    ),
    ("[camera]\nviews = 0", "camera.views", "between 1"),
    ("[camera]\nviews = -3", "camera.views", "usize"),
    (
        "[camera]\nviews = 10000\nbins = 8192",
        "camera.views",
        "at most",
    ),
    ("[camera]\narc = 0.0", "camera.arc", "between"),
    ("[camera]\nstart = inf", "camera.start", "between"),
    ("[camera]\nbins = 1", "camera.bins", "between 2"),
    ("[camera]\nrows = 0", "camera.rows", "between 1"),
    ("[camera]\npitch = [0.0, 0.1]", "camera.pitch", "between"),
    ("[camera]\npitch = 0.1", "camera.pitch", "array"),
    (
        "[camera]\nrotation = 'wobbling'",
        "camera.rotation",
        "step-and-shoot",
    ),
    (
        "[camera]\nseconds_per_view = 0.0",
        "camera.seconds_per_view",
        "between",
    ),
    (
        "[camera]\nseconds_per_view = 0.5\nrotation = 'continuous'",
        "camera.seconds_per_view",
        "one beat",
    ),
    ("[camera]\nradius = -1.0", "camera.radius", "between"),
    (
        "[acquisition]\nmode = 'long'",
        "acquisition.mode",
        "whole-cycle",
    ),
    (
        "[acquisition]\nmode = { static = { phase = 1.5 } }",
        "acquisition.mode.static.phase",
        "between",
    ),
    (
        "[acquisition]\nmode = { exposure = { seconds = 2.0 } }",
        "acquisition.mode.exposure.seconds",
        "between",
    ),
    (
        "[acquisition]\nmode = { gated = { gates = 0 } }",
        "acquisition.mode.gated.gates",
        "between",
    ),
    (
        "[acquisition]\naccuracy = { steps = 7 }",
        "acquisition.accuracy.steps",
        "even",
    ),
    (
        "[acquisition]\naccuracy = { steps = 0 }",
        "acquisition.accuracy.steps",
        "between",
    ),
    (
        "[acquisition]\naccuracy = { tolerance = 0.0 }",
        "acquisition.accuracy.tolerance",
        "between",
    ),
    (
        "[reconstruction]\nwindow = 'hat'",
        "reconstruction.window",
        "hann",
    ),
    (
        "[reconstruction]\nwindow = { butterworth = { order = 0 } }",
        "reconstruction.window.butterworth.order",
        "between",
    ),
    (
        "[reconstruction]\ncutoff = 1.5",
        "reconstruction.cutoff",
        "between",
    ),
    (
        "[reconstruction]\npixels = 0",
        "reconstruction.pixels",
        "between",
    ),
    (
        "[reconstruction]\npixels = 8192",
        "reconstruction.pixels",
        "at most",
    ),
    (
        "[reconstruction]\npixel = 0.0",
        "reconstruction.pixel",
        "between",
    ),
    (
        "[reconstruction]\nregion = { x = [5, 5], y = [0, 9] }",
        "reconstruction.region.x",
        "from < to",
    ),
    (
        "[reconstruction]\nregion = { x = [5, 6], y = [0, 257] }",
        "reconstruction.region.y",
        "256",
    ),
    (
        "[reconstruction]\narc = 'complete'\n[camera]\narc = 90.0",
        "reconstruction.arc",
        "180",
    ),
    ("[truth]\ntolerance = 0.0", "truth.tolerance", "between"),
    (
        "[output]\nwrite = ['sinogram']",
        "output.write",
        "projections",
    ),
    (
        "[output]\nwrite = ['truth', 'truth']",
        "output.write",
        "once",
    ),
    ("[output]\nvolumes = 'dicom'", "output.volumes", "nrrd"),
    (
        "[output]\nprojections = 'nifti'",
        "output.projections",
        "Interfile",
    ),
];

#[test]
fn every_field_refuses_a_bad_value_and_says_where() {
    for (text, field, advice) in BAD {
        let error = error_of(text);
        let said = error.to_string();
        assert_eq!(error.field, *field, "{text}\n{said}");
        assert!(said.contains(advice), "{text}\n{said}");
        // The line of the field's own name, or of the table that misses it.
        let [line, column] = error.place.unwrap_or_else(|| panic!("{text}\n{said}"));
        let there = text.lines().nth(line - 1).unwrap_or_default();
        let named = field.split('.').any(|name| there.contains(name));
        assert!(named, "{text}\n{said}");
        assert!(column <= there.chars().count() + 1, "{said}");
    }
}

#[test]
fn every_field_is_in_the_written_scene_and_in_the_table_of_bad_values() {
    let scene = Scene::default();
    let page = scene.to_toml();
    let table: toml::Table = toml::from_str(&toml::to_string(&scene).unwrap()).unwrap();
    for (section, fields) in &table {
        for field in fields.as_table().unwrap().keys() {
            let name = format!("{section}.{field}");
            assert!(
                page.contains(&format!("\n{field} = ")) || page.contains(&format!("[{name}]")),
                "{name} is not written"
            );
            assert!(
                BAD.iter().any(|(_, bad, _)| bad.starts_with(&name)),
                "{name} has no bad value"
            );
        }
    }
    for absent in ["centre", "pixels", "pixel", "region"] {
        assert!(page.contains(&format!("# {absent} = ")));
    }
}

#[test]
fn unknown_fields_and_broken_text_are_shown_where_they_stand() {
    let error = error_of("[camera]\nviews = 60\ncolour = 'red'\n");
    assert_eq!(
        (error.place, error.field.as_str()),
        (Some([3, 1]), "camera.colour")
    );
    assert!(error.wanted.contains("views"), "{error}");
    let error = error_of("[camra]\nviews = 60\n");
    assert_eq!(error.place.map(|[line, _]| line), Some(1));
    assert!(error.wanted.contains("camera"), "{error}");
    let error = error_of("[camera\nviews = 60\n");
    assert_eq!(error.place.map(|[line, _]| line), Some(1));
    let error = error_of("[camera]\nviews = 60\nviews = 61\n");
    assert_eq!(error.place.map(|[line, _]| line), Some(3));
    // A bad value that no line holds: the default arc is complete, the shorter one is given.
    let error = error_of("[camera]\narc = 90.0\n");
    assert_eq!(
        (error.field.as_str(), error.place),
        ("reconstruction.arc", None)
    );
}

#[test]
fn a_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    assert!(matches!(Scene::load(&path), Err(PhantomError::Read { .. })));
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

/// One change to a scene's text.
#[derive(Debug, Clone)]
enum Change {
    /// Another value for a field.
    Value(usize, String),
    /// A line gone, or there twice.
    Drop(usize),
    Repeat(usize),
    /// Characters put anywhere.
    Insert(usize, String),
    /// The text ends here.
    Cut(usize),
}

fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|v| format!("{v:?}")),
        (-1e3..1e3f64).prop_map(|v| format!("{v:?}")),
        any::<i64>().prop_map(|v| v.to_string()),
        (0..300i64).prop_map(|v| v.to_string()),
        prop::collection::vec(-5.0..300.0f64, 0..6).prop_map(|v| format!("{{ sampled = {v:?} }}")),
        prop::sample::select(vec![
            "nan",
            "-inf",
            "true",
            "''",
            "[]",
            "{}",
            "'hann'",
            "'physiological'",
            "'continuous'",
            "'instants'",
            "'nrrd'",
            "{ gain = 3.0 }",
            "{ volumes = { edv = 1e300, esv = 1e-300 } }",
            "{ gated = { gates = 7 } }",
            "{ steps = 18446744073709551615 }",
            "{ x = [0, 9], y = [3, 300] }",
            "[0.1, 0.2]",
            "1979-05-27",
            "\"\\u00e9\"",
        ])
        .prop_map(str::to_owned),
    ]
}

fn change() -> impl Strategy<Value = Change> {
    let at = 0..10_000usize;
    prop_oneof![
        4 => (at.clone(), value()).prop_map(|(at, value)| Change::Value(at, value)),
        1 => at.clone().prop_map(Change::Drop),
        1 => at.clone().prop_map(Change::Repeat),
        1 => (at.clone(), "\\PC{0,6}").prop_map(|(at, text)| Change::Insert(at, text)),
        1 => at.prop_map(Change::Cut),
    ]
}

fn apply(text: &str, change: &Change) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let boundary = |at: usize| {
        let mut at = at % (text.len() + 1);
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        at
    };
    match change {
        Change::Insert(at, inserted) => {
            let at = boundary(*at);
            return format!("{}{inserted}{}", &text[..at], &text[at..]);
        }
        Change::Cut(at) => return text[..boundary(*at)].to_owned(),
        _ if lines.is_empty() => {}
        Change::Value(at, value) => {
            let fields: Vec<usize> = (0..lines.len())
                .filter(|&k| lines[k].contains(" = "))
                .collect();
            if let Some(&k) = fields.get(at % fields.len().max(1)) {
                let name = lines[k]
                    .trim_start_matches("# ")
                    .split(" = ")
                    .next()
                    .unwrap_or_default()
                    .to_owned();
                lines[k] = format!("{name} = {value}");
            }
        }
        Change::Drop(at) => {
            lines.remove(at % lines.len());
        }
        Change::Repeat(at) => {
            let k = at % lines.len();
            lines.insert(k, lines[k].clone());
        }
    }
    lines.join("\n")
}

proptest! {
    // PROPTEST_CASES runs more.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_scenes_are_read_or_refused_and_never_panic(changes in prop::collection::vec(change(), 1..4)) {
        let mut text = Scene::default().to_toml();
        for change in &changes {
            text = apply(&text, change);
        }
        match Scene::from_toml(&text) {
            Ok(scene) => {
                prop_assert_eq!(Scene::from_toml(&scene.to_toml()).unwrap(), scene);
            }
            Err(PhantomError::Scene(error)) => {
                prop_assert!(!error.to_string().is_empty());
                if let Some([line, _]) = error.place {
                    prop_assert!(line >= 1 && line <= text.lines().count() + 1);
                }
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}
