//! The time average of the ground truth, and its statement in the report.

use crate::phantom::{infarct, small};
use crate::rays::random;
use heart_phantom::{Breathing, Mode, Product, Rotation, Scene, Twist};
use heart_phantom::{MotionPhase, Phantom, PhantomError, TruthOf, VolumeCurve, no_observer, run};
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

#[test]
fn the_ground_truth_of_many_breathing_instants_is_their_average() {
    let mut scene = small(Mode::Instants).with_size(6);
    scene.camera.views = 300;
    scene.cycle.beats_per_minute = 61.73456789;
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.0, -2.0],
        period: 4.1234567,
        ..Breathing::default()
    });
    let mean = mean_of_instants(&scene);
    // 300 additions in f32
    assert!(farthest(&Phantom::new(scene).unwrap().truth(0).unwrap(), &mean) < 1e-5);
}

/// The most states of a cycle do not meet every tolerance.
#[test]
fn a_ground_truth_that_needs_too_many_states_is_rejected() {
    let mut scene = small(Mode::Gated { gates: 16 }).with_size(8);
    (scene.camera.pitch, scene.truth.tolerance) = ([0.01; 2], 1e-7);
    scene.output.write = vec![Product::Truth];
    let error = Phantom::new(scene).unwrap().prepare().unwrap_err();
    let PhantomError::Rejected { field, source, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(field, "truth.tolerance");
    let PhantomError::Tolerance { reached, .. } = *source else {
        panic!("{source}")
    };
    // A sixteenth of 4096 steps, half of them in each direction, of about 50 voxels: some 1e-5.
    assert!((1e-6..1e-4).contains(&reached), "{reached}");
}

/// The average of the heart at many instants of a gate, evenly spaced in the time of each view: no levels, no weights.
fn mean_of_many(phantom: &Phantom, gate: usize, per_view: usize) -> Vec<f64> {
    let scene = phantom.scene();
    let gates = match scene.acquisition.mode {
        Mode::Gated { gates } => gates as f64,
        _ => 1.0,
    };
    let mut times = vec![];
    for k in 0..per_view {
        let share = (k as f64 + 0.5) / per_view as f64;
        match &scene.breathing {
            None => times.push(((gate as f64 + share) / gates, 0.0)),
            Some(own) => times.extend(phantom.view_times(gate).unwrap().iter().map(|view| {
                let t = view.start + share * scene.camera.seconds_per_view;
                (
                    phantom.cycle().phase(t),
                    (PI * t / own.period).sin().powi(2),
                )
            })),
        }
    }
    let mut mean = vec![0.0; phantom.camera().grid().len()];
    for (phase, breath) in &times {
        let at = MotionPhase {
            phase: *phase,
            breath: *breath,
            breath_phase: None,
        };
        for (sum, value) in mean.iter_mut().zip(phantom.activity(at).unwrap()) {
            *sum += f64::from(value) / times.len() as f64;
        }
    }
    mean
}

/// The stated tolerance of a voxel includes the average over time: random gates, volume curves, twists, defects, base displacements and
/// breathing against instants.
#[test]
fn the_ground_truth_of_a_gate_is_within_its_tolerance() {
    let mut seed = 2006;
    let mut random = || 0.5 + 0.5 * random(&mut seed);
    let mut worst = 0.0f64;
    for k in 0..8 {
        let breathes = k % 4 == 3;
        let mode = match breathes {
            true => Mode::WholeCycle,
            false => Mode::Gated { gates: 3 + k },
        };
        let mut scene = small(mode).with_size(16);
        // Two slices at the middle of the heart, of clinical voxels or twice as large.
        (scene.camera.rows, scene.camera.views) = (2, 3);
        scene.camera.pitch = [[0.64, 1.28][k % 2]; 2];
        scene.cycle.curve = [VolumeCurve::Sinusoid, VolumeCurve::Physiological][k / 2 % 2].clone();
        scene.cycle.av_plane_displacement = [0.0, 1.4][k % 2];
        scene.truth.tolerance = [1e-2, 2e-3][k / 3 % 2];
        if k % 3 == 1 {
            scene.twist = Some(Twist {
                inner_degrees: vec![-5.0, 12.0],
                outer_degrees: vec![-4.0, 9.0],
            });
            scene.defects = vec![infarct()];
        }
        if breathes {
            scene.breathing = Some(Breathing {
                shift: [1.2, 0.3, -1.0],
                period: 3.0 + random(),
                ..Breathing::default()
            });
            scene.camera.seconds_per_view = 12.0 + random();
        }
        let phantom = Phantom::new(scene).unwrap();
        let gate = (random() * phantom.n_gates() as f64) as usize;
        let mean = mean_of_many(&phantom, gate, if breathes { 80 } else { 40 });
        let error = farthest(&phantom.truth(gate).unwrap(), &mean);
        let tolerance = phantom.scene().truth.tolerance;
        println!("{k} {error:e} of {tolerance}");
        worst = worst.max(error / tolerance);
        // Instants have an error too: a surface that moves by two voxels in a gate has steps of 1/20, an eighth of which counts once in 40.
        assert!(error < tolerance + 1.6e-4, "{k}: {error:e} of {tolerance}");
    }
    // The test is not empty: the bound is approached.
    assert!(worst > 0.1, "{worst}");
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

/// Ground truth over eight beats is that over one beat, from as many states.
#[test]
fn the_ground_truth_does_not_depend_on_the_number_of_whole_beats() {
    let of = |beats: f64| {
        let mut scene = small(Mode::WholeCycle).with_size(8);
        (scene.cycle.beats_per_minute, scene.truth.tolerance) = (60.0, 5e-4);
        (scene.camera.rotation, scene.camera.seconds_per_view) = (Rotation::Continuous, beats);
        let phantom = Phantom::new(scene).unwrap();
        let truth = phantom.truth(0).unwrap();
        (truth, phantom.work().shapes_solved)
    };
    let [(one, few), (eight, many)] = [of(1.0), of(8.0)];
    assert_eq!(few, many);
    let eight: Vec<f64> = eight.into_iter().map(f64::from).collect();
    // Weights in f64, sums in f32.
    assert!(farthest(&one, &eight) < 1e-6);
}
