//! Organs around the heart: as a torso they are what a background and a torso are, and their sums are closed forms.

use heart_phantom::Phantom;
use heart_phantom::scene::{
    AttenuationSettings, BackgroundSettings, DiscretisationSettings, MediumSettings, Mode,
    OrganSettings, OrganShapeSettings, Product, Scene,
};
use std::f64::consts::PI;

const N: usize = 40;
const AXES: [f64; 2] = [7.6, 7.0];
const MU: f64 = 0.15;

fn scene() -> Scene {
    let mut scene = Scene::default()
        .with_size(N)
        .with_mode(Mode::Gated { gates: 2 });
    scene.camera.views = 6;
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.output.write = vec![Product::Attenuation, Product::Truth];
    scene
}

fn heart_attenuates(coefficient: f64) -> AttenuationSettings {
    AttenuationSettings {
        coefficient,
        medium: MediumSettings::Heart,
    }
}

#[test]
fn one_organ_is_a_background_in_a_torso() {
    let centre = [0.1, -0.2];
    let plain = Scene {
        background: Some(BackgroundSettings {
            concentration: 0.2,
            centre,
            semi_axes: AXES,
        }),
        attenuation: Some(AttenuationSettings {
            coefficient: MU,
            medium: MediumSettings::Torso {
                centre,
                semi_axes: AXES,
            },
        }),
        ..scene()
    };
    let organ = OrganSettings {
        shape: OrganShapeSettings::Cylinder {
            centre,
            semi_axes: AXES,
        },
        activity: 0.2,
        attenuation: MU,
    };
    let organs = Scene {
        organs: vec![organ],
        attenuation: Some(heart_attenuates(MU)),
        ..scene()
    };
    let [plain, organs] = [plain, organs].map(|scene| Phantom::new(scene).unwrap());
    let close = |a: &[f32], b: &[f32], most: f32| {
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            assert!((a - b).abs() < most, "{k}: {a} {b}");
        }
        assert!(a.iter().any(|v| *v > 0.1));
    };
    for gate in 0..2 {
        // f32 sums of up to 15 cm, three more or less.
        let [a, b] = [&plain, &organs].map(|p| p.sinograms(gate, &|_| ()).unwrap().samples);
        close(&a, &b, 2e-5);
        let [a, b] = [&plain, &organs].map(|p| p.truth(gate).unwrap());
        close(&a, &b, 1e-6);
        let [a, b] = [&plain, &organs].map(|p| p.attenuation(0.3).unwrap());
        close(&a, &b, 1e-6);
    }
}

/// A ball beside the heart and a smaller one in it that replaces it.
#[test]
fn sums_are_closed_forms() {
    let ball = |radius: f64, activity: f64, attenuation: f64| OrganSettings {
        shape: OrganShapeSettings::Ellipsoid {
            centre: [4.4, 3.0, -4.0],
            semi_axes: [radius, 0.8 * radius, radius],
        },
        activity,
        attenuation,
    };
    let with = |organs| {
        let scene = Scene {
            organs,
            attenuation: Some(heart_attenuates(0.0)),
            ..scene()
        };
        Phantom::new(scene).unwrap()
    };
    let phantom = with(vec![ball(2.0, 0.5, 0.0), ball(1.0, 0.1, 0.0)]);
    let none = with(Vec::new());
    let volume = |radius: f64| 4.0 / 3.0 * PI * 0.8 * radius.powi(3);
    let exact = 0.5 * (volume(2.0) - volume(1.0)) + 0.1 * volume(1.0);
    let sum = |values: Vec<f32>| values.iter().map(|v| f64::from(*v)).sum::<f64>();
    let pixel = phantom.camera().pitch().powi(2);
    let seen = (sum(phantom.view(0, 1).unwrap()) - sum(none.view(0, 1).unwrap())) * pixel;
    // The midpoint rule over bins of 0.4 cm, as for any solid.
    assert!((seen / exact - 1.0).abs() < 1e-2, "{seen} {exact}");
    let voxel = phantom.camera().grid().voxel_volume();
    let held = (sum(phantom.truth(0).unwrap()) - sum(none.truth(0).unwrap())) * voxel;
    // Fractions of voxels to some 1e-4; f32 sums.
    assert!((held / exact - 1.0).abs() < 1e-3, "{held} {exact}");
}
