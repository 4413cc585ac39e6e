//! Texts of scenes: an accepted scene is written and read again without a change.
#![no_main]

use heart_cohort::heart_phantom::Scene;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(scene) = Scene::from_toml(text) {
        let _ = scene.check();
        let written = scene.to_toml();
        let again = Scene::from_toml(&written).expect("a written scene is valid");
        assert_eq!(again.to_toml(), written);
    }
});
