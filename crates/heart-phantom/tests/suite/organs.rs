//! Organs around the heart: a cylinder equals background and torso, and sums equal closed forms.

use heart_phantom::scene::{DiscretisationSettings, OrganSettings, OrganShapeSettings};
use heart_phantom::{Attenuation, Background, Chest, Medium, Mode, Product, Scene};
use heart_phantom::{Phantom, WarningKind, no_observer, run};
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

fn heart_attenuates(coefficient: f64) -> Attenuation {
    Attenuation {
        coefficient,
        medium: Medium::Heart,
    }
}

#[test]
fn one_organ_is_a_background_in_a_torso() {
    let centre = [0.1, -0.2];
    let plain = Scene {
        background: Some(Background {
            concentration: 0.2,
            centre,
            semi_axes: AXES,
        }),
        attenuation: Some(Attenuation {
            coefficient: MU,
            medium: Medium::Torso {
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
        let [a, b] = [&plain, &organs].map(|p| p.sinograms(gate, &no_observer).unwrap().samples);
        close(&a, &b, 2e-5);
        let [a, b] = [&plain, &organs].map(|p| p.truth(gate).unwrap());
        close(&a, &b, 1e-6);
        let [a, b] = [&plain, &organs].map(|p| p.attenuation(0.3).unwrap());
        close(&a, &b, 1e-6);
    }
}

/// A ball beside the heart and a smaller one inside that replaces it.
#[test]
fn sums_equal_closed_forms() {
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
    // Coverages to about 1e-4; f32 sums.
    assert!((held / exact - 1.0).abs() < 1e-3, "{held} {exact}");
}

/// Chest from a scene: volumes by those of its shapes, and attenuation coefficients.
#[test]
fn a_chest_needs_one_line() {
    let mut scene = Scene::from_toml("[chest]\n").unwrap();
    assert_eq!(scene.chest, Some(Chest::default()));
    scene = scene.with_size(40).with_mode(Mode::Static { phase: 0.0 });
    scene.camera.pitch = [1.1; 2];
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.output.write = vec![Product::Attenuation, Product::Truth];
    // Far above, where there are only trunk and spine.
    scene.pose.shift = [0.0, -3.0, 200.0];
    let liver_alone = Chest {
        trunk: 0.0,
        lungs: 0.0,
        liver: 2.0,
        spine: 0.0,
    };
    scene.chest = Some(liver_alone);
    let phantom = Phantom::new(scene.clone()).unwrap();
    let grams = |samples: Vec<f32>, unit: f64| {
        let sum: f64 = samples.iter().map(|v| f64::from(*v)).sum();
        sum * phantom.camera().grid().voxel_volume() / unit * 1.04
    };
    // The liver of the reference man, 1800 g.
    let liver = grams(phantom.truth(0).unwrap(), 2.0);
    assert!((liver - 1800.0).abs() < 2.0, "{liver}");
    let at = |phantom: &Phantom, place: [f64; 3]| {
        let map = phantom.attenuation(0.0).unwrap();
        let grid = phantom.camera().grid();
        let [i, j, k] =
            [0, 1, 2].map(|a| ((place[a] - grid.origin()[a]) / grid.spacing()[a]).round() as usize);
        f64::from(map[(k * grid.shape()[1] + j) * grid.shape()[0] + i])
    };
    for (place, mu) in [
        ([15.0, 0.0, -18.0], 0.1585),
        ([8.5, 0.0, 4.0], 0.0451),
        ([-8.5, 0.0, 4.0], 0.0451),
        ([-7.0, 0.0, -14.0], 0.1585),
        ([0.0, 5.5, 0.0], 0.2137),
        ([0.0, 15.0, 0.0], 0.0),
    ] {
        let found = at(&phantom, place);
        assert!((found - mu).abs() < 1e-6, "{place:?}: {found}");
    }
    // The heart attenuates as soft tissue by default.
    scene.pose.shift = [3.0, -3.0, 0.0];
    let inside = Phantom::new(scene.clone()).unwrap();
    let soft = Attenuation {
        coefficient: Chest::SOFT_TISSUE,
        medium: Medium::Heart,
    };
    let mut told = inside.scene().clone();
    told.attenuation = Some(soft);
    let told = Phantom::new(told).unwrap();
    assert_eq!(
        told.attenuation(0.5).unwrap(),
        inside.attenuation(0.5).unwrap()
    );
    let bad = Scene::from_toml("[chest]\nliver = -1.0\n").unwrap_err();
    assert!(bad.to_string().contains("chest.liver"), "{bad}");
    let bad = Scene::from_toml(
        "[chest]\n[background]\nconcentration = 1.0\ncentre = [0, 0]\nsemi_axes = [9, 9]\n",
    );
    assert!(bad.unwrap_err().to_string().contains("background"));
    // Organs of the scene follow those of the chest.
    let more = OrganSettings {
        shape: OrganShapeSettings::Ellipsoid {
            centre: [-7.0, 0.0, -14.0],
            semi_axes: [1.0; 3],
        },
        activity: 5.0,
        attenuation: 0.0,
    };
    scene.organs.push(more);
    let organs = Phantom::new(scene).unwrap();
    // The voxel there is not completely inside.
    assert!(at(&organs, [-7.0, 0.0, -14.0]) < 0.5 * 0.1585);
    assert!((at(&organs, [-7.0, 0.0, -16.0]) - 0.1585).abs() < 1e-6);
}

#[test]
fn organs_outside_the_field_are_warnings_in_the_report_too() {
    let ball = |centre: [f64; 3], activity: f64| OrganSettings {
        shape: OrganShapeSettings::Ellipsoid {
            centre,
            semi_axes: [3.0; 3],
        },
        activity,
        attenuation: 0.1,
    };
    let mut scene = scene();
    scene.attenuation = Some(heart_attenuates(MU));
    scene.output.write = vec![Product::Projections];
    let told = |organ: OrganSettings| {
        let mut scene = scene.clone();
        scene.organs.push(organ);
        let phantom = Phantom::new(scene).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        assert_eq!(report.warnings, phantom.warnings().unwrap());
        report.warnings
    };
    assert_eq!(told(ball([4.9, 0.0, -4.9], 0.2)), []);
    // Displaced by 9 cm in the first view, of 16 cm width: 18.
    for (centre, key) in [
        ([6.0, 0.0, 0.0], "camera.bins"),
        ([0.0, 0.0, -6.0], "camera.rows"),
    ] {
        for (activity, what) in [
            (0.2, WarningKind::TruncatedActivity),
            (0.0, WarningKind::TruncatedTorso),
        ] {
            let found = told(ball(centre, activity));
            assert_eq!(found.len(), 1, "{found:?}");
            assert_eq!((found[0].what, found[0].key), (what, key));
            let [needed, available] =
                ["needed_cm", "available_cm"].map(|name| found[0].numbers[name]);
            assert!(
                (needed - 18.0).abs() < 1e-9 && (available - 16.0).abs() < 1e-9,
                "{needed} {available}"
            );
        }
    }
}
