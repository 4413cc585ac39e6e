//! The time average of the ground truth, and its statement in the report.

use crate::phantom::small;
use heart_phantom::scene::{Accuracy, Breathing, Mode, Product, Rotation, Scene};
use heart_phantom::{MotionPhase, Phantom, TruthOf, no_observer, run};
use std::f64::consts::PI;

/// The average over all views of the heart at the phase and the respiratory position of each, with voxels summed in f64.
fn mean_of_instants(scene: &Scene) -> Vec<f64> {
    let phantom = Phantom::new(scene.clone()).unwrap();
    let times = phantom.view_times(0).unwrap();
    let mut mean = vec![0.0; phantom.camera().grid().len()];
    for time in &times {
        // a sinusoid from end-expiration
        let breath = (scene.breathing.as_ref())
            .map_or(0.0, |own| (PI * time.start / own.period).sin().powi(2));
        let at = MotionPhase {
            phase: time.phase,
            breath,
            breath_phase: None,
        };
        for (sum, value) in mean.iter_mut().zip(phantom.activity(at).unwrap()) {
            *sum += f64::from(value) / times.len() as f64;
        }
    }
    mean
}

fn farthest(a: &[f32], b: &[f64]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs());
    apart.fold(0.0, f64::max)
}

#[test]
fn the_ground_truth_of_instants_is_the_average_over_all_views() {
    let mut scene = small(Mode::Instants);
    scene.cycle.beats_per_minute = 73.0;
    let mean = mean_of_instants(&scene);
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(phantom.truth_of(), TruthOf::MeanOfViews);
    let truth = phantom.truth(0).unwrap();
    // Twelve additions in f32.
    assert!(farthest(&truth, &mean) < 1e-6);
    // The first view alone differs much.
    let first: Vec<f32> = phantom.activity(0.0).unwrap();
    assert!(farthest(&first, &mean) > 0.3);
    // The same for exposures, with smaller differences for shorter ones; for 1 ms, that of voxels is half of the displacement of a surface.
    scene.acquisition.mode = Mode::Exposure { seconds: 1e-3 };
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(phantom.truth_of(), TruthOf::MeanOfViews);
    let apart = farthest(&phantom.truth(0).unwrap(), &mean);
    assert!(apart < 2e-2, "{apart}");
    // If all views represent the same heart, it is that heart.
    scene.cycle.beats_per_minute = 60.0;
    scene.acquisition.mode = Mode::Instants;
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(phantom.truth_of(), TruthOf::EachView);
    assert!(phantom.truth(0).unwrap() == phantom.activity(0.0).unwrap());
}

#[test]
fn a_common_heart_of_all_views_is_the_ground_truth() {
    for (mode, rotation, seconds, of) in [
        (
            Mode::Static { phase: 0.2 },
            Rotation::Continuous,
            1.5,
            TruthOf::EachView,
        ),
        (
            Mode::WholeCycle,
            Rotation::StepAndShoot,
            1.5,
            TruthOf::EachView,
        ),
        (
            Mode::WholeCycle,
            Rotation::Continuous,
            1.5,
            TruthOf::MeanOfViews,
        ),
        (
            Mode::WholeCycle,
            Rotation::Continuous,
            2.0,
            TruthOf::EachView,
        ),
        (
            Mode::Gated { gates: 3 },
            Rotation::Continuous,
            2.0,
            TruthOf::EachView,
        ),
        (
            Mode::Gated { gates: 3 },
            Rotation::Continuous,
            1.5,
            TruthOf::MeanOfViews,
        ),
        (
            Mode::Exposure { seconds: 2.0 },
            Rotation::StepAndShoot,
            2.1,
            TruthOf::EachView,
        ),
        (
            Mode::Exposure { seconds: 0.4 },
            Rotation::StepAndShoot,
            2.1,
            TruthOf::MeanOfViews,
        ),
    ] {
        let mut scene = small(mode);
        scene.cycle.beats_per_minute = 60.0;
        (scene.camera.rotation, scene.camera.seconds_per_view) = (rotation, seconds);
        let phantom = Phantom::new(scene).unwrap();
        assert_eq!(phantom.truth_of(), of, "{mode:?} {rotation:?} {seconds}");
    }
}

/// More states than the limit of a volume: neighbours in volume and respiratory position are merged.
#[test]
fn very_many_instants_are_merged() {
    let mut scene = small(Mode::Instants).with_size(6);
    scene.camera.views = 2500;
    scene.cycle.beats_per_minute = 61.73456789;
    let mut breathing = scene.clone();
    breathing.breathing = Some(Breathing {
        shift: [0.0, 0.0, -2.0],
        period: 4.1234567,
        ..Breathing::default()
    });
    for scene in [scene, breathing] {
        let mean = mean_of_instants(&scene);
        let phantom = Phantom::new(scene).unwrap();
        let truth = phantom.truth(0).unwrap();
        let solved = phantom.work().shapes_solved;
        assert!((1500..=2049).contains(&solved), "{solved}");
        // Documented: a thousandth of a surface that passes once in each direction, and 2049 additions in f32.
        let apart = farthest(&truth, &mean);
        assert!(apart < 1e-3, "{apart}");
    }
}

/// 65 x 65 levels of volume and respiration, some without weight, are merged, 33 x 33 are not: both averages agree.
#[test]
fn very_many_states_of_a_breathing_heart_are_merged() {
    let truth = |steps: usize| {
        let mut scene = small(Mode::WholeCycle).with_size(6);
        scene.breathing = Some(Breathing {
            shift: [0.0, 0.0, -2.0],
            ..Breathing::default()
        });
        (scene.camera.views, scene.camera.seconds_per_view) = (3, 201.7);
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        Phantom::new(scene).unwrap().truth(0).unwrap()
    };
    let [coarse, merged] = [64, 128].map(truth);
    let coarse: Vec<f64> = coarse.into_iter().map(f64::from).collect();
    let apart = farthest(&merged, &coarse);
    // as for instants
    assert!(apart < 1e-3, "{apart}");
}

#[test]
fn files_and_report_name_the_kind_of_ground_truth() {
    for (mode, file, name) in [
        (Mode::Instants, "truth-mean-of-views.npy", "mean-of-views"),
        (Mode::WholeCycle, "truth.npy", "each-view"),
    ] {
        let mut scene = small(mode).with_size(16);
        scene.output.write = vec![Product::Reconstruction, Product::Truth];
        let folder = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(scene).unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        assert!(report.files.iter().any(|path| path.to_str() == Some(file)));
        assert!(folder.path().join(file).exists());
        let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["gates"][0]["truth"], name);
        // The difference is from the written ground truth.
        let volume = phantom.volume(0).unwrap();
        let artefacts = phantom
            .artefacts(0, &volume, &phantom.truth(0).unwrap())
            .unwrap();
        assert_eq!(report.gates[0].artefacts, Some(artefacts));
    }
}
