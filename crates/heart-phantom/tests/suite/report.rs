//! What a run says of itself: the report's entries against what was written.
#![cfg(feature = "figures")]

use heart_phantom::scene::{
    AccuracySettings, AttenuationSettings, DiscretisationSettings, MediumSettings, Mode, Product,
    Scene,
};
use heart_phantom::{Phantom, RunReport, run};
use std::path::Path;

/// A scene that takes no time.
fn small(mode: Mode, write: &[Product]) -> Scene {
    let mut scene = Scene::default().with_size(32).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.camera.views = 12;
    scene.acquisition.accuracy = AccuracySettings::Steps(8);
    scene.output.write = write.to_vec();
    scene
}

fn done(scene: Scene, out: &Path) -> RunReport {
    run(&Phantom::new(scene).unwrap(), out, &|_| ()).unwrap()
}

/// Attenuation takes nine tenths and more of the activity, which a fixed window shows black.
#[test]
fn pictures_have_the_window_of_their_slices() {
    let folder = tempfile::tempdir().unwrap();
    let write = [Product::Reconstruction, Product::Pictures];
    let scene = small(Mode::Gated { gates: 3 }, &write).with_attenuation(AttenuationSettings {
        coefficient: 1.0,
        medium: MediumSettings::Heart,
    });
    let report = done(scene, folder.path());
    let shown = report.pictures.unwrap();
    // Row 16 of 32 of half a centimetre.
    assert_eq!((shown.slice, shown.z_cm, shown.black), (16, 0.25, 0.0));
    let mut most = f64::MIN;
    for gate in 0..3 {
        let name = |what: &str, ending: &str| format!("{what}-gate-0{gate}.{ending}");
        let bytes = std::fs::read(folder.path().join(name("reconstruction", "npy"))).unwrap();
        let samples: Vec<f32> = bytes[bytes.len() - 4 * 32 * 32 * 32..]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
            .collect();
        let slice = &samples[16 * 32 * 32..17 * 32 * 32];
        let file = std::fs::File::open(folder.path().join(name("slice", "png"))).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(file))
            .read_info()
            .unwrap();
        let mut shades = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut shades).unwrap();
        assert_eq!(shades.len(), slice.len());
        for (value, shade) in slice.iter().zip(shades) {
            let grey = 255.0 * f64::from(*value) / shown.white;
            assert!((grey.clamp(0.0, 255.0) - f64::from(shade)).abs() <= 0.501);
            most = most.max(f64::from(*value));
        }
    }
    assert_eq!(most, shown.white);
    assert!(most < 0.5, "{most} is dark in a window up to 1.25");
}
