//! Scenes: what is read, and where it is said what is wrong.

use heart_phantom::PhantomError;
use heart_phantom::scene::{Mode, Scene, SceneError};

#[path = "scene/bad_values.rs"]
mod bad_values;
#[path = "scene/changed.rs"]
mod changed;

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
