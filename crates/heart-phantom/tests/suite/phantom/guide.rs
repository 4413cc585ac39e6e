//! Numbers of the guide for physicists.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{ImageQuality, Phantom};
use heart_phantom::{Mode, Scene, radon::ArcPolicy};
use std::f64::consts::PI;

#[test]
fn volumes_have_the_accuracy_stated_in_the_guide() {
    // The inner balloon in its reference configuration: a cylinder of 8.5 cm and radius 1.75 cm closed by a hemisphere.
    let rest = PI * 1.75f64.powi(2) * (8.5 + 2.0 * 1.75 / 3.0);
    let volumes = |scene: &Scene| {
        let numbers = Phantom::new(scene.clone()).unwrap().numbers().unwrap();
        [numbers.esv, numbers.edv]
    };
    let mut scene = Scene::default();
    for (found, told) in volumes(&scene).into_iter().zip([93.00351, 148.80561]) {
        assert!((found - told).abs() < 5e-6, "{found} {told}");
    }
    assert!((rest - 93.00423).abs() < 5e-6 && (1.6 * rest - 148.80677).abs() < 5e-6);
    // For any tolerance of the surface.
    for tolerance in [1e-4, 1e-2] {
        scene.heart.discretisation = DiscretisationSettings::Spectral {
            degree: 16,
            per_piece: 1,
            tolerance,
        };
        for (found, exact) in volumes(&scene).into_iter().zip([rest, 1.6 * rest]) {
            // To rounding; Newton meets a gain to 1e-12.
            assert!((found / exact - 1.0).abs() < 1e-11, "{found} {exact}");
        }
    }
}

#[test]
fn amplitudes_of_a_short_arc_agree_with_the_guide() {
    let mut scene = Scene::default()
        .with_size(96)
        .with_mode(Mode::Static { phase: 0.5 });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 201 };
    scene.camera.arc = 90.0;
    for (arc, mean) in [
        (ArcPolicy::Extend, 1.07),
        (ArcPolicy::Truncate, 0.64),
        (ArcPolicy::Rescale, 1.27),
    ] {
        scene.reconstruction.arc = arc;
        let phantom = Phantom::new(scene.clone()).unwrap();
        let (volume, truth) = (phantom.volume(0).unwrap(), phantom.truth(0).unwrap());
        let found = phantom.artefacts(0, &volume, &truth).unwrap();
        let regions = phantom.regions_of(0).unwrap();
        let inner = ImageQuality::of(&volume, Some(&truth), &regions).unwrap();
        // To the last printed digit.
        assert!(
            (inner.eroded_wall_mean.unwrap() - mean).abs() < 0.006,
            "{inner:?}"
        );
        let uneven = found.wall_unevenness.unwrap();
        assert!((0.325..0.435).contains(&uneven), "{found:?}");
    }
}
