//! An upright heart, whose base and vertices are in planes of the camera's rows.

use heart_phantom::Phantom;
use heart_phantom::scene::*;
use heart_phantom::*;

use super::defects::infarct;

/// In every row from base to apex; row 15 of 31 is in the plane of the base.
fn scene(lower: f64) -> Scene {
    let mut scene = Scene::default().with_mode(Mode::Static { phase: 0.0 });
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 16,
        per_piece: 1,
        tolerance: 1e-4,
    };
    scene.pose.centre = Some(0.0);
    (scene.pose.rotate_x, scene.pose.rotate_y) = (0.0, 0.0);
    scene.pose.shift = [0.0, 0.0, -lower];
    scene.camera.bins = 24;
    scene.camera.rows = 31;
    scene.camera.pitch = [0.3, 0.25];
    scene
}

#[test]
fn an_upright_heart_equals_a_slightly_lower_one() {
    let medium = Medium::Torso {
        centre: [0.0; 2],
        semi_axes: [10.0, 8.0],
    };
    let mut base_seen = 0;
    for medium in [None, Some(Medium::Heart), Some(medium)] {
        for defects in [vec![], vec![infarct()]] {
            let [here, lower, lowest] = [0.0, 1e-7, 2e-7].map(|by| {
                let mut scene = scene(by);
                scene.attenuation = medium.map(|medium| Attenuation {
                    coefficient: 0.15,
                    medium,
                });
                scene.defects = defects.clone();
                Phantom::new(scene).unwrap()
            });
            for view in 0..90 {
                let [here, lower, lowest] =
                    [&here, &lower, &lowest].map(|p| p.view(0, view).unwrap());
                for (k, here) in here.iter().enumerate() {
                    // The chord is a square root where a ray touches the surface: its change there is more than twice that in the next
                    // step, but not much more.
                    let change = (lower[k] - lowest[k]).abs();
                    assert!(
                        (here - lower[k]).abs() <= 4.0 * change + 1e-5,
                        "view {view}, sample {k}: {here}, lower {}",
                        lower[k]
                    );
                    assert!(*here >= 0.0, "{here}");
                    base_seen += usize::from(k / 24 == 15 && *here > 0.0);
                }
            }
        }
    }
    // The base belongs to the heart, in every view.
    assert!(base_seen > 6 * 90 * 10, "{base_seen}");
}
