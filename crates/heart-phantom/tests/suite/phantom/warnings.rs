//! What a camera is warned not to see is what a larger one sees beyond it.

use super::small;
use heart_phantom::scene::{
    AttenuationSettings, BackgroundSettings, MediumSettings, Mode, RotationSettings, Scene,
};
use heart_phantom::{Edge, Phantom, Seen, Uptake, Warning};

/// Bins and rows of the camera that sees everything, and their pitch in cm.
const LARGE: (usize, f64) = (300, 0.1);

fn warnings(scene: &Scene) -> Vec<Warning> {
    Phantom::new(scene.clone()).unwrap().warnings().unwrap()
}

/// The farthest sample of each view that is not zero, along the bins and along the rows: seen, not derived.
fn seen_by_a_large_camera(scene: &Scene) -> Vec<[f64; 2]> {
    let (n, pitch) = LARGE;
    let mut large = scene.clone();
    (large.camera.bins, large.camera.rows, large.camera.pitch) = (n, n, [pitch; 2]);
    let phantom = Phantom::new(large).unwrap();
    let mut farthest = vec![[0.0f64; 2]; phantom.camera().n_views()];
    for gate in 0..phantom.n_gates() {
        let views = phantom.sinograms(gate, &|_| ()).unwrap().samples;
        for (k, _) in views.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let place = |index: usize| ((index as f64 - 0.5 * (n as f64 - 1.0)) * pitch).abs();
            let places = [place(k % n), place(k / n % n)];
            let far = &mut farthest[k / n / n];
            *far = [0, 1].map(|a| places[a].max(far[a]));
        }
    }
    farthest
}

fn farthest(views: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|a| views.iter().fold(0.0, |most: f64, far| most.max(far[a])))
}

#[test]
fn a_heart_that_is_truncated_is_told_with_the_width_it_needs() {
    let modes = [
        Mode::Static { phase: 0.3 },
        Mode::Gated { gates: 2 },
        Mode::WholeCycle,
    ];
    let mut told = 0;
    for (k, mode) in modes.into_iter().cycle().take(9).enumerate() {
        let mut scene = small(mode);
        let k = k as f64;
        (scene.pose.turn_x, scene.pose.turn_y) = (37.0 * k, 20.0 - 41.0 * k);
        scene.pose.shift = [k - 4.0, 0.7 * k, 3.0 - k];
        let views = seen_by_a_large_camera(&scene);
        let [bins, rows] = farthest(&views);
        for warning in warnings(&scene) {
            let Warning::Truncated {
                what,
                edge,
                needed,
                seen,
                angle,
            } = warning
            else {
                panic!("{warning}")
            };
            assert_eq!((what, seen), (Seen::Heart, 16.0));
            let far = match edge {
                Edge::Bins => bins,
                Edge::Rows => rows,
            };
            // The centre of the last sample that is hit, or up to one beyond it.
            let spare = 0.5 * needed - far;
            assert!((0.0..=LARGE.1).contains(&spare), "{warning}: {far}");
            // And it is there that it is hit.
            if let Some(angle) = angle {
                let view = (angle.to_degrees() / 15.0).round() as usize;
                assert!(far - views[view][0] <= LARGE.1, "{warning}");
            }
            told += 1;
        }
        // None is missing: what is seen beyond is told.
        for (edge, far) in [(Edge::Bins, bins), (Edge::Rows, rows)] {
            let is_told = |warning: &Warning| matches!(warning, Warning::Truncated { edge: found, .. } if *found == edge);
            let beyond = warnings(&scene).iter().any(is_told);
            assert!(beyond || far < 8.0, "{edge:?} {far}");
            assert!(!beyond || far + LARGE.1 > 8.0, "{edge:?} {far}");
        }
        // As wide as it needs is wide enough.
        if let Some(Warning::Truncated { needed, .. }) = warnings(&scene).first() {
            let mut scene = scene.clone();
            scene.camera.pitch = [needed * (1.0 + 1e-12) / 40.0; 2];
            let again = warnings(&scene);
            let same =
                |w: &&Warning| matches!(w, Warning::Truncated { needed: n, .. } if n == needed);
            assert_eq!(again.iter().filter(same).count(), 0, "{again:?}");
            scene.camera.pitch = [needed * (1.0 - 1e-6) / 40.0; 2];
            assert!(!warnings(&scene).is_empty());
        }
    }
    assert!(told > 6, "{told}");
}

#[test]
fn a_background_and_a_torso_wider_than_the_bins_are_told() {
    let around = BackgroundSettings {
        concentration: 0.1,
        centre: [1.0, -0.5],
        semi_axes: [9.5, 7.5],
    };
    let mut scene = small(Mode::Static { phase: 0.0 }).with_background(around);
    scene.camera.rotation = RotationSettings::Continuous;
    scene.activity.wall = Uptake::Concentration(0.0);
    let [far, _] = farthest(&seen_by_a_large_camera(&scene));
    let [
        Warning::Truncated {
            what: Seen::Background,
            edge: Edge::Bins,
            needed,
            ..
        },
    ] = warnings(&scene)[..]
    else {
        panic!("{:?}", warnings(&scene))
    };
    let spare = 0.5 * needed - far;
    assert!((0.0..=LARGE.1).contains(&spare), "{needed} {far}");

    // The same ellipse as a medium; and nothing where there is nothing.
    let torso = |coefficient| AttenuationSettings {
        coefficient,
        medium: MediumSettings::Torso {
            centre: around.centre,
            semi_axes: around.semi_axes,
        },
    };
    let mut other = scene.clone().with_attenuation(torso(0.1));
    other.background = None;
    let [
        Warning::Truncated {
            what, needed: same, ..
        },
    ] = warnings(&other)[..]
    else {
        panic!()
    };
    assert_eq!((what, same), (Seen::Torso, needed));
    other.attenuation = Some(torso(0.0));
    scene.background = Some(BackgroundSettings {
        concentration: 0.0,
        ..around
    });
    assert_eq!((warnings(&other), warnings(&scene)), (vec![], vec![]));
}
