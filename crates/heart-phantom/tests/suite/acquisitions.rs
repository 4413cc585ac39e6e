//! Acquisitions and truth against conservation, symmetry and each other.

use heart_phantom::{
    Acquisition, Activity, Camera, CameraGeometry, Cycle, Heads, Heart, Measures, PhantomError,
    Regions, Rotation, Sinograms, Uptake, acquire, truth,
};
use membrane_newton::{MembraneError, NewtonError};
use radon::RadonError;
use revolve_voxel::RevolveError;
use std::f64::consts::PI;

const WALL: [f64; 2] = [0.0, 1.0];
const SIZE: usize = 48;
const VIEWS: usize = 12;

fn take(heart: &Heart, acquisition: Acquisition, gain: f64) -> Sinograms {
    take_every(1.0, heart, acquisition, gain)
}

/// Views that start so many seconds after each other.
fn take_every(interval: f64, heart: &Heart, acquisition: Acquisition, gain: f64) -> Sinograms {
    let camera = Camera::new(VIEWS, SIZE, 16.0).unwrap();
    let camera = camera.with_interval(interval).unwrap();
    let cycle = Cycle::new(65.0, gain).unwrap();
    acquire(heart, &camera, &cycle, acquisition, WALL, &|_| ()).unwrap()
}

fn wall_volume(heart: &Heart) -> f64 {
    heart.pair().wall_volume()
}

#[test]
fn every_view_of_every_acquisition_holds_the_wall_volume() {
    let heart = Heart::study(101).unwrap();
    let exact = wall_volume(&heart);
    for acquisition in [
        Acquisition::still(0.3),
        Acquisition::Instants,
        Acquisition::WholeCycle { points: 8 },
    ] {
        let sinograms = take(&heart, acquisition, 0.6);
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
    let heart = Heart::study(101).unwrap();
    let camera = Camera::new(90, 16, 16.0).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let short = Acquisition::Instants;
    let sinograms = acquire(&heart, &camera, &cycle, short, WALL, &|_| ()).unwrap();
    // 90 views, 13/12 of a cycle apart: 12 phases, which are 7 gains.
    assert_eq!(sinograms.distinct_phases, 12);
    assert_eq!((sinograms.distinct_shapes, heart.shapes_solved()), (7, 7));
    let rays = sinograms.rays;
    assert_eq!(rays.cast + rays.skipped, 90 * 16 * 16);
    // The body's shadow is about a third of the field of view.
    assert!(rays.skipped > rays.cast);
    acquire(&heart, &camera, &cycle, short, WALL, &|_| ()).unwrap();
    assert_eq!(heart.shapes_solved(), 7);
}

#[test]
fn a_heart_that_does_not_beat_looks_the_same_in_all_acquisitions() {
    let heart = Heart::study(101).unwrap();
    let still = take(&heart, Acquisition::still(0.0), 0.0);
    let short = take(&heart, Acquisition::Instants, 0.0);
    let long = take(&heart, Acquisition::WholeCycle { points: 4 }, 0.0);
    assert_eq!(still.samples, short.samples);
    for (a, b) in still.samples.iter().zip(&long.samples) {
        // Two halves of weight 1/2, each rounded to f32.
        assert!((a - b).abs() <= 2.0 * f32::EPSILON * a.abs());
    }
    assert!(long.view_error.time < 1e-6);
    assert_eq!(heart.shapes_solved(), 1);
}

#[test]
fn the_average_over_a_cycle_is_the_mean_of_static_scans() {
    let heart = Heart::study(101).unwrap();
    let long = take(&heart, Acquisition::WholeCycle { points: 6 }, 0.6);
    let mut mean = vec![0.0f64; long.samples.len()];
    for j in 0..6 {
        let phase = f64::from(j) / 6.0;
        let still = take(&heart, Acquisition::still(phase), 0.6);
        for (sum, v) in mean.iter_mut().zip(&still.samples) {
            *sum += f64::from(*v) / 6.0;
        }
    }
    for (a, b) in long.samples.iter().zip(&mean) {
        // Six additions in f32.
        assert!((f64::from(*a) - b).abs() < 6.0 * f64::from(f32::EPSILON) * 10.0);
    }
}

#[test]
fn the_quadrature_error_falls_and_bounds_the_next() {
    let heart = Heart::study(101).unwrap();
    let errors: Vec<f64> = [4, 8, 16, 32]
        .into_iter()
        .map(|points| {
            take(&heart, Acquisition::WholeCycle { points }, 0.6)
                .view_error
                .time
        })
        .collect();
    // Chords end like square roots where the silhouette passes in time, so the rule converges
    // like n^-1.5: a factor 2.8 a doubling; 2 leaves room for the sampling of the silhouette.
    for pair in errors.windows(2) {
        assert!(pair[1] < pair[0] / 2.0, "{errors:?}");
    }
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let heart = Heart::study(101).unwrap();
            let camera = Camera::new(VIEWS, SIZE, 16.0).unwrap();
            let cycle = Cycle::new(65.0, 0.6).unwrap();
            let long = Acquisition::WholeCycle { points: 8 };
            let sinograms = acquire(&heart, &camera, &cycle, long, WALL, &|_| ()).unwrap();
            let volume = truth(&heart, &camera, &cycle, long, WALL, 1e-3).unwrap();
            (sinograms.samples, sinograms.view_error.time, volume)
        })
    };
    assert!(run(1) == run(2) && run(1) == run(3));
}

#[test]
fn truth_holds_the_wall_volume_and_measures_itself_as_perfect() {
    let heart = Heart::study(201).unwrap();
    let camera = Camera::new(VIEWS, 96, 16.0).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let regions = Regions::new(&heart, &camera, &cycle).unwrap();
    assert!(regions.wall.count() > 0 && regions.cavity.count() > 0);
    for acquisition in [
        Acquisition::still(0.0),
        Acquisition::WholeCycle { points: 4 },
    ] {
        let volume = truth(&heart, &camera, &cycle, acquisition, WALL, 1e-4).unwrap();
        let measures = Measures::of(&volume, Some(&volume), &regions, &camera).unwrap();
        assert_eq!(measures.rmse_truth, Some(0.0));
        assert_eq!(measures.background_rms, Some(0.0));
        assert_eq!(measures.cavity_mean, Some(0.0));
        // Voxels in the wall at all phases: one, but for the rounding of the weights in f32.
        assert!((measures.wall_mean.unwrap() - 1.0).abs() < 1e-6);
        assert!(measures.wall_std.unwrap() < 1e-6);
        // Fractions right to 1e-4 each, with errors of either sign.
        let total = measures.total_activity.unwrap();
        assert!((total / wall_volume(&heart) - 1.0).abs() < 1e-5, "{total}");
    }
}

#[test]
fn bad_input_is_refused_with_its_numbers() {
    let heart = Heart::study(101).unwrap();
    let camera = Camera::new(2, 8, 16.0).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let try_it = |acquisition| acquire(&heart, &camera, &cycle, acquisition, WALL, &|_| ());
    assert!(matches!(
        try_it(Acquisition::WholeCycle { points: 7 }),
        Err(PhantomError::Odd { given: 7, .. })
    ));
    assert!(matches!(
        try_it(Acquisition::WholeCycle { points: 0 }),
        Err(PhantomError::Count { given: 0, .. })
    ));
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        let refused = camera.clone().with_interval(bad);
        assert!(matches!(
            refused,
            Err(PhantomError::OutOfRange {
                what: "interval",
                ..
            })
        ));
    }
    assert!(matches!(
        try_it(Acquisition::still(f64::NAN)),
        Err(PhantomError::OutOfRange { .. })
    ));
    // More points than anyone waits for.
    let points = 65_536;
    let turning = Camera::with_geometry(&CameraGeometry {
        views: 2,
        arc: PI,
        start: 0.0,
        heads: Heads::One,
        bins: 8,
        rows: 8,
        pitch: [2.0; 2],
        rotation: Rotation::Continuous,
        interval: 1e7,
        pixels: [8; 2],
        pixel: 2.0,
        centre: [0.0; 2],
    })
    .unwrap();
    let window = 1e7;
    for long in [
        Acquisition::WholeCycle { points },
        Acquisition::Gate {
            gate: 0,
            gates: 4,
            points,
        },
        Acquisition::Exposure { window, points },
    ] {
        let refused = acquire(&heart, &turning, &cycle, long, WALL, &|_| ());
        assert!(
            matches!(refused, Err(PhantomError::Count { given, most: 16_777_216, .. }) if given > 20_000_000),
            "{refused:?}"
        );
    }
    let still = Acquisition::still(0.0);
    let refused = acquire(&heart, &camera, &cycle, still, [f64::NAN, 1.0], &|_| ());
    assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
    let refused = truth(&heart, &camera, &cycle, still, WALL, 0.0);
    assert!(matches!(
        refused,
        Err(PhantomError::Solid(RevolveError::NotPositive { .. }))
    ));
    assert!(matches!(
        camera.rays(2),
        Err(PhantomError::Count {
            given: 2,
            most: 1,
            ..
        })
    ));
    for refused in [Camera::new(0, 8, 16.0), Camera::new(2, 0, 16.0)] {
        assert!(
            matches!(
                refused,
                Err(PhantomError::Radon(RadonError::TooFew { given: 0, .. }))
            ),
            "{refused:?}"
        );
    }
    let refused = Camera::new(2, 8, f64::NAN);
    assert!(
        matches!(
            refused,
            Err(PhantomError::Radon(RadonError::NotFinite { .. }))
        ),
        "{refused:?}"
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
    // A gain of -1 is a cavity of nothing.
    for gain in [f64::NAN, -1.0] {
        let refused = heart.shapes(&[gain]);
        assert!(
            matches!(
                refused,
                Err(PhantomError::Membrane(NewtonError::OutOfRange { .. }))
            ),
            "{refused:?}"
        );
    }
}

#[test]
fn the_gates_together_are_the_whole_cycle() {
    let heart = Heart::study(101).unwrap();
    let points = 16;
    let whole = take(&heart, Acquisition::WholeCycle { points }, 0.6);
    assert_eq!(heart.shapes_solved(), 9);
    let gates = 4;
    let mut mean = vec![0.0f64; whole.samples.len()];
    for gate in 0..gates {
        let one = take(
            &heart,
            Acquisition::Gate {
                gate,
                gates,
                points,
            },
            0.6,
        );
        // Four steps: five phases.
        assert_eq!(one.distinct_phases, 5);
        for (sum, v) in mean.iter_mut().zip(&one.samples) {
            *sum += f64::from(*v) / gates as f64;
        }
    }
    assert_eq!(heart.shapes_solved(), 9); // neighbouring gates share their ends, all share the cycle's
    for (a, b) in whole.samples.iter().zip(&mean) {
        assert!((f64::from(*a) - b).abs() < 20.0 * f64::from(f32::EPSILON) * 10.0);
    }
}

#[test]
fn an_exposure_is_made_of_its_beats() {
    let heart = Heart::study(101).unwrap();
    let period = 60.0 / 65.0;
    let exposure = |interval: f64, window: f64| {
        let exposed = Acquisition::Exposure { window, points: 8 };
        take_every(interval, &heart, exposed, 0.6).samples
    };
    let whole = take(&heart, Acquisition::WholeCycle { points: 8 }, 0.6).samples;
    assert!(exposure(period, period) == whole);
    assert!(exposure(3.0 * period, 3.0 * period) == whole);
    // Views begin at the same phase when the interval is a whole number of beats.
    let half = exposure(3.0 * period, 0.5 * period);
    let both = exposure(3.0 * period, 2.5 * period);
    for ((a, b), sum) in whole.iter().zip(&half).zip(&both) {
        assert!((2.0 * a + 0.5 * b - 2.5 * sum).abs() < 1e-4); // sums of f32 up to 10
    }
    let still = take_every(0.3, &heart, Acquisition::Instants, 0.6).samples;
    assert!(exposure(0.3, 0.0) == still);
}

#[test]
fn a_turning_camera_averages_over_the_angles_that_it_passes() {
    let heart = Heart::study(101).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let geometry = |views: usize, start: f64, (rotation, interval)| CameraGeometry {
        views,
        arc: PI,
        start,
        heads: Heads::One,
        bins: 24,
        rows: 20,
        pitch: [0.6, 0.7],
        rotation,
        interval,
        pixels: [24; 2],
        pixel: 0.6,
        centre: [0.0; 2],
    };
    let still = Acquisition::still(0.25);
    let take = |geometry: CameraGeometry, acquisition| {
        let camera = Camera::with_geometry(&geometry).unwrap();
        acquire(&heart, &camera, &cycle, acquisition, WALL, &|_| ()).unwrap()
    };
    let turning = (Rotation::Continuous, 2.0);
    let blurred = take(geometry(6, 0.3, turning), still);
    // The slow twin: eight views for each, from half a step before it.
    let step = PI / 6.0;
    let fine = take(
        geometry(48, 0.3 - step / 2.0, (Rotation::StepAndShoot, 1.0)),
        still,
    );
    let n = 24 * 20;
    for view in 0..5 {
        for k in 0..n {
            let mean: f32 = (0..=8)
                .map(|j| {
                    fine.samples[(8 * view + j) * n + k] * if j % 8 == 0 { 0.5 } else { 1.0 } / 8.0
                })
                .sum();
            assert!((blurred.samples[view * n + k] - mean).abs() < 1e-5);
        }
    }
    // Beats while it turns: 2 s hold two and a part, and eight steps of a beat are four up and four down, between five volumes.
    let beats = take(
        geometry(6, 0.3, turning),
        Acquisition::WholeCycle { points: 8 },
    );
    assert_eq!((beats.distinct_phases, beats.distinct_shapes), (5, 5));
    let wall = wall_volume(&heart);
    for view in beats.samples.chunks(n) {
        let sum: f64 = view.iter().map(|&v| f64::from(v)).sum();
        assert!((sum * 0.42 / wall - 1.0).abs() < 0.03);
    }
    let short = (Rotation::Continuous, 0.9);
    let camera = Camera::with_geometry(&geometry(6, 0.0, short)).unwrap();
    let refused = acquire(
        &heart,
        &camera,
        &cycle,
        Acquisition::WholeCycle { points: 8 },
        WALL,
        &|_| (),
    );
    assert!(matches!(refused, Err(PhantomError::OutOfRange { .. })));
}

#[test]
fn a_total_stays_and_a_concentration_grows_with_the_cavity() {
    let heart = Heart::study(101).unwrap();
    let camera = Camera::new(2, SIZE, 16.0).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let pixel = camera.pitch().powi(2);
    let total = |cavity, phase| {
        let activity = Activity {
            cavity,
            wall: Uptake::Concentration(0.0),
        };
        let still = Acquisition::still(phase);
        let taken = acquire(&heart, &camera, &cycle, still, activity, &|_| ()).unwrap();
        let view = &taken.samples[..SIZE * SIZE];
        view.iter().map(|&v| f64::from(v)).sum::<f64>() * pixel
    };
    // The midpoint rule over 48 x 48 chords, as above.
    for phase in [0.0, 0.3, 0.5] {
        assert!((total(Uptake::Total(7.0), phase) / 7.0 - 1.0).abs() < 1e-2);
    }
    let grown = total(Uptake::Concentration(2.0), 0.5) / total(Uptake::Concentration(2.0), 0.0);
    assert!((grown - 1.6).abs() < 0.02, "{grown}");
}
