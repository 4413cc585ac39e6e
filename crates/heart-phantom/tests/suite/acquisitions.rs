//! Projections and ground truth: conservation, symmetry and mutual consistency.

use heart_phantom::scene::{CameraSettings, DiscretisationSettings};
use heart_phantom::{Accuracy, Activity, Breathing, Mode, Rotation, Scene, radon::ArcPolicy};
use heart_phantom::{
    Heart, ImageQuality, MotionPhase, Phantom, PhantomError, Sinograms, Uptake, VolumeRange,
    no_observer,
};
use membrane_newton::{MembraneError, NewtonError};

const SIZE: usize = 48;
const VIEWS: usize = 12;

/// The study with views of [`SIZE`] rows and bins.
fn scene(mode: Mode, steps: usize) -> Scene {
    let mut scene = Scene::default().with_size(SIZE).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.camera.views = VIEWS;
    scene.acquisition.accuracy = Accuracy::Steps(steps);
    scene
}

fn phantom(mode: Mode, steps: usize) -> Phantom {
    Phantom::new(scene(mode, steps)).unwrap()
}

fn views(phantom: &Phantom, gate: usize) -> Sinograms {
    phantom.sinograms(gate, &no_observer).unwrap()
}

fn taken(scene: Scene) -> Sinograms {
    views(&Phantom::new(scene).unwrap(), 0)
}

fn wall_volume(phantom: &Phantom) -> f64 {
    phantom.heart().pair().wall_volume()
}

#[test]
fn every_view_of_every_acquisition_contains_the_wall_volume() {
    for mode in [
        Mode::Static { phase: 0.3 },
        Mode::Instants,
        Mode::WholeCycle,
    ] {
        let phantom = phantom(mode, 8);
        let exact = wall_volume(&phantom);
        let sinograms = views(&phantom, 0);
        let pixel = (16.0 / SIZE as f64).powi(2);
        for view in sinograms.samples.chunks(SIZE * SIZE) {
            let sum: f64 = view.iter().map(|&v| f64::from(v)).sum();
            // The midpoint rule on 48 x 48 chords that end like square roots at the silhouette:
            // O(h^1.5), measured at most 4e-3.
            assert!((sum * pixel / exact - 1.0).abs() < 1e-2, "{}", sum * pixel);
        }
    }
}

#[test]
fn phases_are_solved_once_and_mirrored_phases_share_a_shape() {
    let mut scene = scene(Mode::Instants, 8).with_size(16);
    scene.camera.views = 90;
    let phantom = Phantom::new(scene).unwrap();
    let sinograms = views(&phantom, 0);
    // 90 views, 13/12 of a cycle apart: 12 phases, which are 7 gains.
    assert_eq!(
        (sinograms.distinct_shapes, phantom.heart().shapes_solved()),
        (7, 7)
    );
    let rays = sinograms.rays;
    assert_eq!(rays.cast + rays.skipped, 90 * 16 * 16);
    // The projected area of the body is about a third of the field of view.
    assert!(rays.skipped > rays.cast);
    views(&phantom, 0);
    assert_eq!(phantom.heart().shapes_solved(), 7);
}

#[test]
fn a_static_heart_has_the_same_projections_in_all_acquisitions() {
    let mut scene = scene(Mode::Static { phase: 0.0 }, 4);
    scene.cycle.volume = VolumeRange::Gain(0.0);
    let phantom = Phantom::new(scene.clone()).unwrap();
    let other = |mode| {
        let other = phantom.with_scene(scene.clone().with_mode(mode)).unwrap();
        views(&other, 0)
    };
    let still = views(&phantom, 0);
    let (short, long) = (other(Mode::Instants), other(Mode::WholeCycle));
    assert_eq!(still.samples, short.samples);
    for (a, b) in still.samples.iter().zip(&long.samples) {
        // Two halves of weight 1/2, each rounded to f32.
        assert!((a - b).abs() <= 2.0 * f32::EPSILON * a.abs());
    }
    assert!(long.view_error.time < 1e-6);
    assert_eq!(phantom.heart().shapes_solved(), 1);
}

#[test]
fn the_average_over_a_cycle_equals_that_of_static_scans() {
    let long = views(&phantom(Mode::WholeCycle, 8), 0);
    let mut mean = vec![0.0f64; long.samples.len()];
    for j in 0..8 {
        let phase = f64::from(j) / 8.0;
        let still = views(&phantom(Mode::Static { phase }, 8), 0);
        for (sum, v) in mean.iter_mut().zip(&still.samples) {
            *sum += f64::from(*v) / 8.0;
        }
    }
    for (a, b) in long.samples.iter().zip(&mean) {
        // Eight additions in f32.
        assert!((f64::from(*a) - b).abs() < 8.0 * f64::from(f32::EPSILON) * 10.0);
    }
}

#[test]
fn the_quadrature_error_falls_and_bounds_the_next() {
    let error = |steps| views(&phantom(Mode::WholeCycle, steps), 0).view_error.time;
    let errors = [4, 8, 16, 32].map(error);
    // Chords vary like square roots where the silhouette passes during the average, so the rule converges like n^-1.5: a factor 2.8 per
    // doubling; 2 leaves room for the sampling of the silhouette.
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 2.0, "{errors:?}");
    }
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let phantom = phantom(Mode::WholeCycle, 8);
            let sinograms = views(&phantom, 0);
            let volume = phantom.truth(0).unwrap();
            (sinograms.samples, sinograms.view_error.time, volume)
        })
    };
    assert!(run(1) == run(2) && run(1) == run(3));
}

#[test]
fn ground_truth_contains_the_wall_volume_and_has_no_error_against_itself() {
    for mode in [Mode::Static { phase: 0.0 }, Mode::WholeCycle] {
        let mut scene = scene(mode, 4).with_size(64);
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 201 };
        scene.truth.tolerance = 1e-4;
        let phantom = Phantom::new(scene).unwrap();
        let regions = phantom.regions().unwrap();
        assert!(regions.wall.count() > 0 && regions.cavity.count() > 0);
        let volume = phantom.truth(0).unwrap();
        let measures = ImageQuality::of(&volume, Some(&volume), regions).unwrap();
        assert_eq!(measures.rmse_truth, Some(0.0));
        assert_eq!(measures.background_rms, Some(0.0));
        assert_eq!(measures.cavity_mean, Some(0.0));
        // Voxels in the wall at all phases have the value 1, up to rounding of the weights in f32.
        assert!((measures.eroded_wall_mean.unwrap() - 1.0).abs() < 1e-6);
        assert!(measures.wall_std.unwrap() < 1e-6);
        // Coverages are accurate to 1e-4 each, with errors of either sign.
        let total = measures.total_activity.unwrap();
        assert!(
            (total / wall_volume(&phantom) - 1.0).abs() < 1e-5,
            "{total}"
        );
    }
}

#[test]
fn bad_input_is_rejected_with_its_values() {
    let heart = Heart::study(101).unwrap();
    for phase in [f64::NAN, f64::INFINITY, 1e10] {
        let refused = phantom(Mode::WholeCycle, 8).activity(phase);
        assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
        let refused = phantom(Mode::WholeCycle, 8).shape(phase);
        assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
    }
    for (breath, text) in [(f64::NAN, "NaN"), (-0.1, "-0.1"), (1.01, "1.01")] {
        let at = MotionPhase {
            breath,
            ..MotionPhase::default()
        };
        let refused = phantom(Mode::WholeCycle, 8).activity(at);
        assert_eq!(
            refused.unwrap_err().to_string(),
            format!("respiratory position is {text}, must be between 0 and 1")
        );
    }
    for phase in [f64::NAN, f64::INFINITY, -0.1, 1.01] {
        let at = MotionPhase {
            breath_phase: Some(phase),
            ..MotionPhase::default()
        };
        let refused = phantom(Mode::WholeCycle, 8).motion(at);
        assert!(matches!(
            refused,
            Err(PhantomError::OutOfRange {
                what: "respiratory phase",
                ..
            })
        ));
    }
    // An unreasonable number of points.
    for mode in [
        Mode::WholeCycle,
        Mode::Gated { gates: 4 },
        Mode::Exposure { seconds: 1e6 },
    ] {
        let mut turning = scene(mode, 4096).with_size(8);
        turning.camera.rotation = Rotation::Continuous;
        turning.camera.seconds_per_view = 1e6;
        let refused = Phantom::new(turning).unwrap_err().to_string();
        assert!(
            refused.starts_with("camera.seconds_per_view is 1")
                && refused.contains("the limit is 1.6777216e7"),
            "{refused}"
        );
    }
    let phantom = phantom(Mode::WholeCycle, 8);
    let n_views = phantom.camera().n_views();
    let refused = phantom.view(0, n_views).unwrap_err();
    assert!(
        matches!(refused, PhantomError::Count { given, most, .. } if given == n_views && most + 1 == n_views)
    );
    let refused = Heart::study(2);
    assert!(
        matches!(
            refused,
            Err(PhantomError::Membrane(NewtonError::Membrane(
                MembraneError::TooFew { given: 2, .. }
            )))
        ),
        "{refused:?}"
    );
    // A gain of -1 is an empty cavity.
    for gain in [f64::NAN, -1.0] {
        let refused = heart.shapes(&[gain]);
        assert!(
            matches!(
                refused,
                Err(PhantomError::Membrane(NewtonError::Membrane(
                    MembraneError::OutOfRange { .. }
                )))
            ),
            "{refused:?}"
        );
    }
}

#[test]
fn the_average_of_all_gates_is_the_whole_cycle() {
    let (gates, steps) = (4, 16);
    let whole = phantom(Mode::WholeCycle, steps);
    let gated = scene(Mode::Gated { gates }, steps);
    let gated = whole.with_scene(gated).unwrap();
    let whole = views(&whole, 0);
    assert_eq!(gated.heart().shapes_solved(), 9);
    let mut mean = vec![0.0f64; whole.samples.len()];
    for gate in 0..gates {
        let one = views(&gated, gate);
        // Four steps: five phases.
        assert_eq!(one.distinct_shapes, 5);
        for (sum, v) in mean.iter_mut().zip(&one.samples) {
            *sum += f64::from(*v) / gates as f64;
        }
    }
    assert_eq!(gated.heart().shapes_solved(), 9); // neighbouring gates share their ends, all share those of the cycle
    for (a, b) in whole.samples.iter().zip(&mean) {
        assert!((f64::from(*a) - b).abs() < 20.0 * f64::from(f32::EPSILON) * 10.0);
    }
}

#[test]
fn an_exposure_is_the_average_over_its_beats() {
    let period = 60.0 / 65.0;
    let every = |interval: f64, mode| {
        let mut scene = scene(mode, 8);
        scene.camera.seconds_per_view = interval;
        taken(scene).samples
    };
    let exposure = |interval, seconds| every(interval, Mode::Exposure { seconds });
    let whole = every(1.0, Mode::WholeCycle);
    assert!(exposure(period, period) == whole);
    assert!(exposure(3.0 * period, 3.0 * period) == whole);
    // Views start at the same phase if the interval is a whole number of beats.
    let half = exposure(3.0 * period, 0.5 * period);
    let both = exposure(3.0 * period, 2.5 * period);
    for ((a, b), sum) in whole.iter().zip(&half).zip(&both) {
        assert!((2.0 * a + 0.5 * b - 2.5 * sum).abs() < 1e-4); // sums of f32 up to 10
    }
    assert!(exposure(0.3, 0.0) == every(0.3, Mode::Instants));
}

#[test]
fn continuous_rotation_averages_over_angles() {
    let with = |mode, views: usize, start: f64, (rotation, seconds_per_view)| {
        let mut scene = scene(mode, 8);
        scene.camera = CameraSettings {
            views,
            start,
            bins: 24,
            rows: 20,
            pitch: [0.6, 0.7],
            rotation,
            seconds_per_view,
            ..scene.camera
        };
        Phantom::new(scene)
    };
    let still = Mode::Static { phase: 0.25 };
    let turning = (Rotation::Continuous, 2.0);
    let blurred = views(&with(still, 6, 17.0, turning).unwrap(), 0);
    // The reference: eight views for each, from the middles of its arcs.
    let (step, first) = (180.0 / 6.0, 0.5 / 8.0);
    let standing = (Rotation::StepAndShoot, 1.0);
    let fine = views(
        &with(still, 48, 17.0 + (first - 0.5) * step, standing).unwrap(),
        0,
    );
    let n = 24 * 20;
    for view in 0..6 {
        for k in 0..n {
            let sample = |j| fine.samples[(8 * view + j) * n + k] / 8.0;
            let mean: f32 = (0..8).map(sample).sum();
            assert!((blurred.samples[view * n + k] - mean).abs() < 1e-5);
        }
    }
    // Beats while it turns: 2 s hold two and a part, and eight steps of a beat are four up and four down, between five volumes.
    let beating = with(Mode::WholeCycle, 6, 17.0, turning).unwrap();
    let beats = views(&beating, 0);
    assert_eq!(beats.distinct_shapes, 5);
    let wall = wall_volume(&beating);
    for view in beats.samples.chunks(n) {
        let sum: f64 = view.iter().map(|&v| f64::from(v)).sum();
        assert!((sum * 0.42 / wall - 1.0).abs() < 0.03);
    }
    let short = (Rotation::Continuous, 0.9);
    assert!(with(Mode::WholeCycle, 6, 0.0, short).is_err());
}

#[test]
fn a_total_is_conserved_and_a_concentration_scales_with_the_cavity() {
    let pixel = (16.0 / SIZE as f64).powi(2);
    let total = |cavity, phase| {
        let mut scene = scene(Mode::Static { phase }, 8);
        scene.camera.views = 2;
        scene.reconstruction.arc = ArcPolicy::Extend;
        scene.activity = Activity {
            cavity,
            wall: Uptake::Concentration(0.0),
        };
        let samples = taken(scene).samples;
        let view = &samples[..SIZE * SIZE];
        view.iter().map(|&v| f64::from(v)).sum::<f64>() * pixel
    };
    // The midpoint rule over 48 x 48 chords, as above.
    for phase in [0.0, 0.3, 0.5] {
        assert!((total(Uptake::Total(7.0), phase) / 7.0 - 1.0).abs() < 1e-2);
    }
    let grown = total(Uptake::Concentration(2.0), 0.5) / total(Uptake::Concentration(2.0), 0.0);
    assert!((grown - 1.6).abs() < 0.02, "{grown}");
}

/// At most 120 000 heartbeats and breaths: 26 per minute, 12 views.
#[test]
fn acquisitions_of_too_many_cycles_are_rejected() {
    let lasting = |seconds: f64| {
        let mut scene = scene(Mode::WholeCycle, 8).with_size(8);
        scene.cycle.beats_per_minute = 20.0;
        scene.breathing = Some(Breathing {
            shift: [0.0, 0.0, -1.0],
            period: 10.0,
            ..Breathing::default()
        });
        scene.camera.seconds_per_view = seconds;
        Phantom::new(scene).map(drop)
    };
    lasting(23_076.0).unwrap();
    let rejected = lasting(23_078.0).unwrap_err().to_string();
    assert!(rejected.contains("heartbeats and breaths"), "{rejected}");
}
