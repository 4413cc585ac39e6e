//! Given hearts instead of two sections of a scene, and phantoms that share solved shapes.

use heart_phantom::membrane_newton::membrane_forces::PressureLaw;
use heart_phantom::membrane_newton::{Discretisation, Membrane, ReferenceShape};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::scene::{BlurSettings, DiscretisationSettings};
use heart_phantom::{
    Accuracy, Balloon, BinSample, Counts, Defect, Heart, Mode, Noise, Phantom, VolumeCurve,
    VolumeRange, no_observer, run,
};
use heart_phantom::{Attenuation, Medium, Scene};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_4, PI};

#[path = "../../examples/own_heart.rs"]
#[allow(dead_code)] // its `main` is called, as a test
mod example;

fn heart_of([inner, outer]: [Balloon; 2], nodes: usize, pose: Pose) -> Heart {
    let membranes = [inner.membrane().unwrap(), outer.membrane().unwrap()];
    let differences = Discretisation::FiniteDifferences { nodes };
    Heart::of_membranes([&membranes[0], &membranes[1]], differences, 0.0, pose).unwrap()
}

#[test]
fn the_example_runs() {
    example::main().unwrap();
}

/// The balloons of the sections, given as a heart, have bitwise identical results; the report of a run then has no scene.
#[test]
fn a_given_heart_is_bitwise_identical_to_that_of_the_sections() {
    let mut scene = Scene::default()
        .with_size(24)
        .with_mode(Mode::Gated { gates: 2 });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 60 };
    scene.camera.views = 12;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.cycle.av_plane_displacement = 0.5;
    let pose = Pose::axis_along_z((Balloon::OUTER.length + Balloon::OUTER.radius) / 2.0)
        .and_then(|pose| pose.rotated_x(FRAC_PI_4)?.rotated_y(FRAC_PI_4))
        .unwrap();
    let heart = heart_of([Balloon::INNER, Balloon::OUTER], 60, pose);
    let given = Phantom::with_heart(scene.clone(), heart).unwrap();
    // Neither of the two sections is used or validated.
    let mut other = scene.clone();
    (other.heart.inner.radius, other.pose.rotate_x) = (-1.0, f64::NAN);
    let unread = given.with_scene(other).unwrap();
    let phantom = Phantom::new(scene).unwrap();
    for given in [&given, &unread] {
        assert_eq!(given.view(1, 3).unwrap(), phantom.view(1, 3).unwrap());
        assert_eq!(given.truth(1).unwrap(), phantom.truth(1).unwrap());
    }
    assert_eq!(unread.work().shapes_solved, given.work().shapes_solved);
    let folder = tempfile::tempdir().unwrap();
    let report = run(&given, folder.path(), &no_observer).unwrap();
    assert!(report.scene.is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Length and radius of a balloon are exact: scaled quantities are bitwise identical.
    #[test]
    fn the_length_of_a_balloon_is_exact(h in 0.1..50.0f64, r in 0.1..20.0f64, nodes in 11..60usize) {
        let outer = Balloon { length: h, radius: r, stiffness: 1.0 };
        let inner = Balloon { length: 0.9 * h, radius: 0.8 * r, stiffness: 1.0 };
        let heart = heart_of([inner, outer], nodes, Pose::identity());
        prop_assert_eq!(heart.length(), h + r);
    }
}

const SIZE: usize = 64;
const FIELD: f64 = 20.0;
const WALL: f64 = 1.5;

/// Nodes of half an ellipse from the base over the apex.
fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
    (0..=80)
        .map(|k| PI * (0.5 - f64::from(k) / 80.0))
        .map(|t| [a * t.cos(), b * t.sin()])
        .collect()
}

/// Half ellipsoids under a total force, with a cycle of seven samples.
fn own(discretisation: Discretisation, tolerance: f64) -> (Scene, Heart) {
    let membrane = |a, b| {
        let rest = match discretisation {
            Discretisation::Spectral { .. } => ReferenceShape::balloon(a - b, b).unwrap(),
            _ => ReferenceShape::polyline(&half_ellipse(a, b)).unwrap(),
        };
        Membrane::new(rest).with_law(PressureLaw::TotalForce)
    };
    let pose = Pose::axis_along_z(4.0)
        .and_then(|pose| pose.rotated_x(0.9)?.rotated_y(-0.4))
        .unwrap();
    let membranes = [membrane(7.5, 2.2), membrane(8.7, 3.1)];
    let membranes = [&membranes[0], &membranes[1]];
    let heart = Heart::of_membranes(membranes, discretisation, tolerance, pose).unwrap();
    let mut scene = Scene::default();
    scene.cycle.beats_per_minute = 80.0;
    scene.cycle.curve = VolumeCurve::Sampled(vec![9.0, 7.5, 4.0, 3.0, 6.0, 8.0, 8.5]);
    scene.cycle.volume = VolumeRange::Gains([0.1, 0.7]);
    scene.camera.views = 8;
    (scene.camera.bins, scene.camera.rows) = (SIZE, SIZE);
    scene.camera.pitch = [FIELD / SIZE as f64; 2];
    scene.activity = [0.0, WALL].into();
    (scene, heart)
}

const NODES: Discretisation = Discretisation::FiniteDifferences { nodes: 81 };
const SPECTRAL: Discretisation = Discretisation::Spectral {
    degree: 10,
    per_piece: 2,
};

/// The volume of a revolved polygon: a sum of truncated cones.
fn volume(points: &[[f64; 2]]) -> f64 {
    let half = &points[..=points.len() / 2];
    half.windows(2)
        .map(|pair| {
            let [[x, r], [to, s]] = [pair[0], pair[1]];
            PI / 3.0 * (to - x) * (r * r + r * s + s * s)
        })
        .sum()
}

/// The activity in a view.
fn total(view: &[f32]) -> f64 {
    let pitch = FIELD / SIZE as f64;
    view.iter().map(|&sample| f64::from(sample)).sum::<f64>() * pitch * pitch
}

/// Samples at the centres of bins of 0.31 cm integrate smooth chords accurately; square roots at the edges of the projection have errors of
/// up to 3.0e-3 (measured).
const SUM: f64 = 4e-3;

#[test]
fn views_of_a_custom_heart_contain_its_wall_and_its_defect() {
    let wall = volume(&half_ellipse(8.7, 3.1)) - volume(&half_ellipse(7.5, 2.2));
    for mode in [
        Mode::Static { phase: 0.4 },
        Mode::Instants,
        Mode::WholeCycle,
        Mode::Gated { gates: 2 },
    ] {
        for share in [0.0, 0.4] {
            let (scene, heart) = own(NODES, 0.0);
            let mut scene = scene.with_mode(mode);
            scene.acquisition.accuracy = Accuracy::Steps(8);
            scene.truth.tolerance = 0.01;
            if share > 0.0 {
                // The inner part of the whole wall, over a quarter turn: the same fraction of its volume at every phase.
                scene.defects.push(Defect {
                    layers: [0.0, share],
                    s: [0.0, 0.5],
                    azimuths_degrees: [17.0, 107.0],
                    activity: 0.1,
                });
            }
            let phantom = Phantom::with_heart(scene, heart).unwrap();
            let expected = WALL * wall * (1.0 + 0.25 * share * (0.1 - 1.0));
            for gate in 0..phantom.n_gates() {
                for view_idx in [0, 3, 7] {
                    let found = total(&phantom.view(gate, view_idx).unwrap());
                    assert!(
                        (found / expected - 1.0).abs() < SUM,
                        "{mode:?} {share}: {found} {expected}"
                    );
                }
                // Errors of the voxels that a surface cuts, at most their tolerance of a hundredth, have either sign.
                let truth = phantom.truth(gate).unwrap();
                let pitch = FIELD / SIZE as f64;
                let held = total(&truth) * pitch;
                assert!((held / expected - 1.0).abs() < 1e-3, "{held} {expected}");
            }
        }
    }
}

#[test]
fn a_custom_heart_follows_its_volume_curve() {
    for (discretisation, tolerance) in [(NODES, 0.0), (SPECTRAL, 1e-4)] {
        let (scene, heart) = own(discretisation, tolerance);
        let rest = heart.pair().inner().start_measures().volume;
        let phantom = Phantom::with_heart(scene, heart).unwrap();
        let numbers = phantom.numbers().unwrap();
        assert!((numbers.edv / rest - 1.7).abs() < 1e-10);
        assert!((numbers.esv / rest - 1.1).abs() < 1e-10);
        // Samples are at sevenths of the cycle; the volume is that of the samples there, from the smallest (3) to the largest (9).
        for (k, sample) in [9.0, 7.5, 4.0, 3.0, 6.0, 8.0, 8.5].into_iter().enumerate() {
            let [cavity, _] = phantom.shape(k as f64 / 7.0).unwrap().volumes();
            let expected = rest * (1.1 + 0.6 * (sample - 3.0) / 6.0);
            assert!(
                (cavity / expected - 1.0).abs() < 1e-10,
                "{k}: {cavity} {expected}"
            );
        }
    }
}

#[test]
fn a_custom_heart_is_attenuated_blurred_and_counted() {
    let still = |change: &dyn Fn(&mut Scene)| {
        let (mut scene, heart) = own(NODES, 0.0);
        scene.acquisition.mode = Mode::Static { phase: 0.4 };
        scene.activity = [WALL, WALL].into();
        change(&mut scene);
        let phantom = Phantom::with_heart(scene, heart).unwrap();
        phantom.view(0, 2).unwrap()
    };
    let plain = still(&|_| ());
    // For a convex body of uniform activity and attenuation, the chord L determines the sample: a (1 - exp(-mu L)) / mu.
    let (mu, medium) = (0.3, Medium::Heart);
    let weak = still(&|scene| {
        let coefficient = mu;
        scene.attenuation = Some(Attenuation {
            coefficient,
            medium,
        });
    });
    for (seen, unweakened) in weak.iter().zip(&plain) {
        let chord = f64::from(*unweakened) / WALL;
        let expected = WALL * (1.0 - (-mu * chord).exp()) / mu;
        // Both are f32.
        assert!((f64::from(*seen) - expected).abs() < 1e-6 * (1.0 + expected));
    }
    assert!(total(&weak) < 0.7 * total(&plain));
    // A blur preserves the sum of bin averages. The tails beyond the detector, which is twice as wide as the heart, are below 1e-9; with
    // time steps, bin averages are accurate to 1e-3 of the largest sample.
    let averaged = still(&|scene| scene.camera.samples = Some(BinSample::Averages));
    let blurred = still(&|scene| scene.blur = Some(BlurSettings { fwhm: 1.2 }));
    assert!((total(&blurred) / total(&averaged) - 1.0).abs() < 1e-3);
    let most = |view: &[f32]| view.iter().copied().fold(0.0, f32::max);
    assert!(most(&blurred) < 0.99 * most(&plain));
    // Counts are integers, and their sum is within five standard deviations.
    let per_unit = 40.0;
    let counted = still(&|scene| {
        let counts = Counts::PerUnit(per_unit);
        scene.noise = Some(Noise { counts, seed: 3 });
    });
    let sum = |view: &[f32]| view.iter().map(|&v| f64::from(v)).sum::<f64>() * per_unit;
    assert!((sum(&counted) - sum(&plain)).abs() < 5.0 * sum(&plain).sqrt());
    for sample in counted {
        let count = f64::from(sample) * per_unit;
        assert!((count - count.round()).abs() < 1e-4 * (1.0 + count));
    }
}

/// Phantoms of scenes with the same heart share solved shapes; others do not.
#[test]
fn another_scene_of_the_heart_reuses_its_shapes() {
    let plain = Phantom::new(Scene::default().with_size(24)).unwrap();
    let means = plain.view(0, 0).unwrap();
    let solved = plain.work().shapes_solved;
    let mut noisy = plain.scene().clone();
    let counts = Counts::PerUnit(100.0);
    noisy.noise = Some(Noise { counts, seed: 1 });
    let noisy = plain.with_scene(noisy).unwrap();
    assert!(noisy.view(0, 0).unwrap() != means);
    assert_eq!(noisy.work().shapes_solved, solved);
    let change = |change: &dyn Fn(&mut Scene)| {
        let mut scene = plain.scene().clone();
        change(&mut scene);
        let changed = plain.with_scene(scene.clone()).unwrap();
        let fresh = Phantom::new(scene).unwrap();
        assert_eq!(changed.view(0, 0).unwrap(), fresh.view(0, 0).unwrap());
        assert_eq!(changed.work().shapes_solved, fresh.work().shapes_solved);
    };
    change(&|scene| scene.heart.inner.stiffness = 2.0);
    change(&|scene| scene.pose.rotate_x = 0.0);
    change(&|scene| scene.cycle.av_plane_displacement = 0.5);
}
