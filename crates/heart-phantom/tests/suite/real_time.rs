//! Projections with variable R-R intervals and respiration, against sums over real time in small steps.

use crate::phantom::small;
use heart_phantom::revolve_voxel::nalgebra::Vector3;
use heart_phantom::scene::*;
use heart_phantom::*;
use heart_phantom::{MotionPhase, Phantom, PhantomError, TruthOf, no_observer};
use std::collections::BTreeMap;

/// Levels of volume of the reference.
const GAINS: f64 = 1000.0;

fn breathing() -> Breathing {
    Breathing {
        shift: [0.2, 0.4, -1.8],
        period: 3.7,
        curve: BreathingCurve::Lujan { n: 2 },
        start: 0.15,
        ..Breathing::default()
    }
}

fn irregular() -> Beats {
    Beats::new(RrIntervals::List(vec![0.95, 0.7, 1.15, 0.9, 1.3]))
}

/// Four views of some seconds each.
fn slow(mode: Mode, seconds: f64) -> Scene {
    let mut scene = small(mode).with_size(24);
    scene.camera.views = 4;
    scene.camera.seconds_per_view = seconds;
    scene.cycle.beats_per_minute = 60.0;
    scene.acquisition.accuracy = Accuracy::Steps(64);
    scene
}

/// Phase at a time, index of the beat and fraction of the interval, from the list of intervals alone: diastole of the sinusoid is its first
/// half, and systole lasts half of the period of one second.
fn beat_at(scene: &Scene, t: f64) -> (f64, f64, f64) {
    let intervals = match &scene.beats {
        None => vec![1.0],
        Some(beats) => match &beats.intervals {
            RrIntervals::List(list) => list.clone(),
            _ => panic!("drawn"),
        },
    };
    let (mut start, mut k) = (0.0, 0);
    loop {
        let length = intervals[k % intervals.len()];
        if t < start + length {
            let (after, diastole) = (t - start, length - 0.5);
            let phase = match after < diastole {
                true => 0.5 * after / diastole,
                false => 0.5 + after - diastole,
            };
            return (phase, length, after);
        }
        (start, k) = (start + length, k + 1);
    }
}

/// Respiratory position by the formula.
fn breath_at(scene: &Scene, t: f64) -> (f64, f64) {
    let Some(breathing) = &scene.breathing else {
        return (0.0, 0.0);
    };
    let phase = (t / breathing.period + breathing.start).rem_euclid(1.0);
    let sine = (std::f64::consts::PI * phase).sin();
    let fraction = match breathing.curve {
        BreathingCurve::Sinusoid => sine.powi(2),
        BreathingCurve::Lujan { n } => sine.powi(2 * n as i32),
        _ => panic!("sampled"),
    };
    (phase, fraction)
}

/// A view of some gates, `[cardiac, of, respiratory]`, from `n` instants of its real time.
fn brute(phantom: &Phantom, view_idx: usize, gate: [usize; 3], n: usize) -> (Vec<f64>, f64) {
    let scene = phantom.scene();
    let interval = scene.camera.seconds_per_view;
    let [cardiac, of, respiratory] = gate;
    let mut moments = BTreeMap::<[u64; 2], f64>::new();
    let mut seconds = 0.0;
    for j in 0..n {
        let t = (view_idx as f64 + (j as f64 + 0.5) / n as f64) * interval;
        let (phase, length, after) = beat_at(scene, t);
        let (breath_phase, fraction) = breath_at(scene, t);
        let beats = scene.beats.as_ref();
        let accepted = beats.and_then(|beats| beats.accepted);
        let held = match scene.acquisition.mode {
            Mode::Static { .. } => true,
            _ => {
                let whole = match beats.map(|beats| beats.gated_by) {
                    Some(GatedBy::TimeAfterR) => 1.0,
                    _ => length,
                };
                let share = after / whole * of as f64;
                accepted.is_none_or(|[a, b]| (a..=b).contains(&length))
                    && share >= cardiac as f64
                    && share < cardiac as f64 + 1.0
            }
        };
        let breathes = match scene.breathing.as_ref().and_then(|b| b.gates) {
            None => true,
            Some(RespiratoryGates::Phase(n)) => (breath_phase * n as f64) as usize == respiratory,
            Some(RespiratoryGates::Amplitude(n)) => (fraction * n as f64) as usize == respiratory,
            _ => panic!("other gates"),
        };
        if !(held && breathes) {
            continue;
        }
        seconds += interval / n as f64;
        let gain = match scene.acquisition.mode {
            Mode::Static { phase } => phantom.cycle().gain(phase),
            _ => 0.3 * (1.0 - (std::f64::consts::TAU * phase).cos()),
        };
        let at = (gain / 0.6 * GAINS).round() * 0.6 / GAINS;
        let fraction = (fraction * GAINS).round() / GAINS;
        *moments
            .entry([at.to_bits(), fraction.to_bits()])
            .or_default() += 1.0;
    }
    let all: f64 = moments.values().sum();
    let mut sum = vec![0.0f64; phantom.camera().view_len()];
    let mut one = vec![0.0f32; sum.len()];
    let shift = scene.breathing.as_ref().map_or([0.0; 3], |b| b.shift);
    let theta = phantom.camera().geometry().angles()[view_idx];
    let rays = phantom.camera().detector().rays(theta).unwrap();
    for ([gain, fraction], weight) in moments {
        let [gain, fraction] = [gain, fraction].map(f64::from_bits);
        let shape = phantom.heart().shapes(&[gain]).unwrap().remove(0);
        let pose = shape.body().pose();
        let pose = pose.shifted(Vector3::from(shift) * fraction).unwrap();
        one.fill(0.0);
        let body = shape.body().with_pose(pose);
        body.project_add(&rays, &[0.0, 1.0], 1.0, &mut one).unwrap();
        for (sum, value) in sum.iter_mut().zip(&one) {
            *sum += weight / all * f64::from(*value);
        }
    }
    (sum, seconds)
}

fn distance(a: &[f32], b: &[f64]) -> f64 {
    let square = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).powi(2));
    (square.sum::<f64>() / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// All gates of a scene against the reference, with their acquisition times; for few steps the largest error of a sample.
fn check(scene: &Scene, cardiac: usize, respiratory: usize) {
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(phantom.n_gates(), cardiac * respiratory);
    let few = [8, 16, 32].map(|steps| {
        let mut scene = scene.clone();
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        Phantom::new(scene).unwrap()
    });
    for gate in 0..phantom.n_gates() {
        let coarse = (few.each_ref()).map(|few| few.sinograms(gate, &no_observer).unwrap());
        let mut worst = [0.0f64; 3];
        let times = phantom.view_times(gate).unwrap();
        let taken = phantom.sinograms(gate, &no_observer).unwrap();
        let stated = taken.view_error.time;
        let (mut square, mut norm) = (0.0, 0.0);
        for view_idx in 0..4 {
            let gates = [gate % cardiac, cardiac, gate / cardiac];
            let (exact, seconds) = brute(&phantom, view_idx, gates, 3000);
            let len = exact.len();
            let view = &taken.samples[view_idx * len..][..len];
            for (worst, coarse) in worst.iter_mut().zip(&coarse) {
                let pairs = coarse.samples[view_idx * len..].iter().zip(&exact);
                let off = pairs.map(|(a, b)| (f64::from(*a) - b).abs());
                *worst = off.fold(*worst, f64::max);
            }
            square +=
                (distance(view, &exact) * exact.iter().map(|b| b * b).sum::<f64>().sqrt()).powi(2);
            norm += exact.iter().map(|b| b * b).sum::<f64>();
            // Each end of a gate is accurate to a step.
            let steps = 60.0 * scene.camera.seconds_per_view / 3000.0;
            assert!(
                (times[view_idx].window - seconds).abs() < steps,
                "{:?} {seconds}",
                times[view_idx]
            );
        }
        let error = (square / norm).sqrt();
        println!("gate {gate}: {error:.2e}, stated {stated:.2e}");
        let largest = f64::from(taken.samples.iter().copied().fold(0.0, f32::max));
        for (worst, coarse) in worst.iter().zip(&coarse) {
            let stated = coarse.view_error.time;
            println!("    largest {:.2e}, stated {stated:.2e}", worst / largest);
            assert!(worst / largest <= stated, "gate {gate}: {worst} {stated}");
        }
        // Error of the reference: 3000 instants, 1000 volumes and positions.
        assert!(
            error < stated + 3e-4,
            "gate {gate}: {error} stated {stated}"
        );
        // Respiration counts four times the largest error of rays through a sphere.
        assert!(stated < 4e-2, "{stated}");
    }
}

#[test]
fn variable_intervals_agree_with_a_sum_over_real_time() {
    let mut scene = slow(Mode::WholeCycle, 2.9);
    scene.beats = Some(irregular());
    check(&scene, 1, 1);
    scene.acquisition.mode = Mode::Gated { gates: 3 };
    check(&scene, 3, 1);
    // By time after R, without the longest and the shortest beats.
    scene.camera.seconds_per_view = 5.0;
    scene.beats = Some(Beats {
        accepted: Some([0.8, 1.2]),
        gated_by: GatedBy::TimeAfterR,
        ..irregular()
    });
    check(&scene, 3, 1);
    let report = Phantom::new(scene).unwrap().beats().unwrap();
    assert_eq!((report.beats, report.rejected), (20, 8));
    assert_eq!(report.accepted[..5], [true, false, true, true, false]);
}

#[test]
fn respiration_agrees_with_a_sum_over_real_time() {
    let mut scene = slow(Mode::Static { phase: 0.3 }, 2.0);
    scene.breathing = Some(breathing());
    check(&scene, 1, 1);
    scene.acquisition.mode = Mode::WholeCycle;
    check(&scene, 1, 1);
    scene.beats = Some(irregular());
    check(&scene, 1, 1);
}

/// A view of a static or beating heart with respiration, from static scenes at many instants of the view.
fn brute_of_scenes(scene: &Scene, view_idx: usize, n: usize) -> Vec<f64> {
    let interval = scene.camera.seconds_per_view;
    let shift = scene.breathing.as_ref().unwrap().shift;
    let mut sum = Vec::new();
    for j in 0..n {
        let turn = (view_idx % scene.camera.views) as f64;
        let t = (turn + (j as f64 + 0.5) / n as f64) * interval;
        let phase = match scene.acquisition.mode {
            Mode::Static { phase } => phase,
            _ => beat_at(scene, t).0,
        };
        let mut still = scene.clone().with_mode(Mode::Static { phase });
        let breath = breath_at(scene, t).1;
        for (place, by) in still.pose.shift.iter_mut().zip(shift) {
            *place += breath * by;
        }
        still.breathing = None;
        let view = Phantom::new(still).unwrap().view(0, view_idx).unwrap();
        sum.resize(view.len(), 0.0);
        for (sum, value) in sum.iter_mut().zip(view) {
            *sum += f64::from(value) / n as f64;
        }
    }
    sum
}

/// A scene with two heads of two views.
fn check_heads(scene: &Scene, n: usize, most: f64) {
    let phantom = Phantom::new(scene.clone()).unwrap();
    let taken = phantom.sinograms(0, &no_observer).unwrap();
    let stated = taken.view_error.time;
    let len = phantom.camera().view_len();
    let mut errors = Vec::new();
    for view_idx in 0..4 {
        let exact = brute_of_scenes(scene, view_idx, n);
        errors.push(distance(&taken.samples[view_idx * len..][..len], &exact));
    }
    println!("{errors:?}, stated {stated:.2e}");
    assert!(
        errors.iter().all(|error| *error < stated + most),
        "{errors:?} {stated}"
    );
    assert!(stated < 2e-2);
}

fn with_two_heads(mode: Mode) -> Scene {
    let mut scene = slow(mode, 2.6).with_size(16);
    (scene.camera.views, scene.camera.arc) = (2, 180.0);
    scene.reconstruction.arc = radon::ArcPolicy::Extend;
    scene.camera.heads = HeadsSettings::Two { angle: 90.0 };
    scene.breathing = Some(breathing());
    scene
}

#[test]
fn both_heads_acquire_respiration_at_the_same_times() {
    check_heads(&with_two_heads(Mode::Static { phase: 0.3 }), 300, 1e-3);
    check_heads(&with_two_heads(Mode::WholeCycle), 150, 3e-3);
}

#[test]
fn respiration_among_organs_agrees_with_a_sum_over_real_time() {
    let mut scene = with_two_heads(Mode::Static { phase: 0.3 });
    scene.chest = Some(Chest::default());
    check_heads(&scene, 100, 1e-3);
    // The heart moves: views of a breath-hold differ.
    let breathing = Phantom::new(scene.clone()).unwrap().view(0, 1).unwrap();
    scene.breathing = None;
    let held: Vec<f64> = Phantom::new(scene)
        .unwrap()
        .view(0, 1)
        .unwrap()
        .iter()
        .map(|x| f64::from(*x))
        .collect();
    assert!(distance(&breathing, &held) > 0.01);
}

#[test]
fn respiratory_gates_agree_with_sums_over_real_time() {
    let mut scene = slow(Mode::Static { phase: 0.3 }, 4.1);
    scene.breathing = Some(breathing());
    for (gates, n) in [
        (RespiratoryGates::Phase(3), 3),
        (RespiratoryGates::Amplitude(2), 2),
    ] {
        scene.breathing.as_mut().unwrap().gates = Some(gates);
        check(&scene, 1, n);
    }
    scene.acquisition.mode = Mode::Gated { gates: 2 };
    check(&scene, 2, 2);
}

#[test]
fn instants_are_in_real_time() {
    let mut scene = slow(Mode::Instants, 2.3);
    scene.beats = Some(irregular());
    scene.breathing = Some(breathing());
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(phantom.truth_of(), TruthOf::MeanOfViews);
    for view_idx in 0..4 {
        let t = 2.3 * view_idx as f64;
        let (phase, ..) = beat_at(&scene, t);
        let at = MotionPhase {
            phase,
            breath: breath_at(&scene, t).1,
            ..MotionPhase::default()
        };
        let shape = phantom.shape(phase).unwrap();
        let body = shape.body().with_pose(phantom.pose(at.breath).unwrap());
        let camera = phantom.camera();
        let angle = camera.geometry().angles()[view_idx];
        let rays = camera.detector().rays(angle).unwrap();
        let mut exact = vec![0.0f32; phantom.camera().view_len()];
        body.project_add(&rays, &[0.0, 1.0], 1.0, &mut exact)
            .unwrap();
        let view = phantom.view(0, view_idx).unwrap();
        let exact: Vec<f64> = exact.iter().map(|x| f64::from(*x)).collect();
        // Phases are on a grid of 2^-40.
        assert!(distance(&view, &exact) < 1e-7);
    }
}

#[test]
fn motion_without_effect_is_bitwise_identical_to_none() {
    for mode in [
        Mode::Static { phase: 0.3 },
        Mode::Instants,
        Mode::WholeCycle,
        Mode::Gated { gates: 2 },
        Mode::Exposure { seconds: 0.3 },
    ] {
        let plain = small(mode).with_size(16);
        let period = 60.0 / plain.cycle.beats_per_minute;
        let mut still = plain.clone();
        still.breathing = Some(Breathing {
            shift: [0.0; 3],
            ..breathing()
        });
        still.beats = Some(Beats {
            accepted: Some([0.5, 1.5]),
            ..Beats::new(RrIntervals::List(vec![period; 3]))
        });
        let [plain, still] = [plain, still].map(|scene| Phantom::new(scene).unwrap());
        for gate in 0..plain.n_gates() {
            let views = |phantom: &Phantom| phantom.sinograms(gate, &no_observer).unwrap().samples;
            assert!(views(&plain) == views(&still), "{mode:?}");
            assert!(plain.truth(gate).unwrap() == still.truth(gate).unwrap());
            assert_eq!(
                plain.view_times(gate).unwrap(),
                still.view_times(gate).unwrap()
            );
        }
        assert!(still.beats().is_none());
    }
}

#[test]
fn shapes_are_solved_once_per_phase_and_respiration_costs_no_more_rays_than_instants() {
    // The same number of points with and without respiration: a static heart at as many positions.
    let mut scene = slow(Mode::Static { phase: 0.3 }, 8.0);
    scene.breathing = Some(breathing());
    scene.breathing.as_mut().unwrap().period = 4.0;
    let breathing = Phantom::new(scene.clone()).unwrap();
    breathing.view(0, 0).unwrap();
    let work = breathing.work();
    assert_eq!(work.shapes_solved, 1);
    let points = (work.rays_cast + work.rays_skipped) / (24 * 24);
    // 64 steps per respiratory cycle are 32 during inspiration: one position more than that.
    assert_eq!(points, 33);
    scene.breathing = None;
    let held = Phantom::new(scene.clone()).unwrap();
    held.view(0, 0).unwrap();
    let of_instant = held.work().rays_cast;
    let most = 1.2 * (points * of_instant) as f64;
    assert!((work.rays_cast as f64) < most, "{} {most}", work.rays_cast);
    // The levels of volume of a beating heart, for any beats and respiration.
    let mut scene = slow(Mode::WholeCycle, 8.0);
    scene.beats = Some(irregular());
    scene.breathing = Some(self::breathing());
    let beating = Phantom::new(scene).unwrap();
    beating.sinograms(0, &no_observer).unwrap();
    assert_eq!(beating.work().shapes_solved, 33);
}

#[test]
fn any_part_is_bitwise_identical_to_the_whole_for_any_number_of_threads() {
    let mut scene = slow(Mode::Gated { gates: 2 }, 3.1);
    scene.beats = Some(irregular());
    scene.breathing = Some(breathing());
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.camera.rotation = Rotation::Continuous;
    let phantom = Phantom::new(scene.clone()).unwrap();
    let views = phantom.sinograms(1, &no_observer).unwrap().samples;
    let len = phantom.camera().view_len();
    assert!(phantom.view(1, 2).unwrap() == views[2 * len..3 * len]);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let one = Phantom::new(scene.clone()).unwrap();
    assert!(pool.install(|| one.sinograms(1, &no_observer).unwrap().samples) == views);
    let tight = Phantom::new(scene).unwrap();
    let two = 2 * tight.heart().shape_bytes();
    assert!(
        tight
            .with_memory(two)
            .sinograms(1, &no_observer)
            .unwrap()
            .samples
            == views
    );
    // The ground truth of a gate is the average over its projections.
    let truth: f64 = phantom
        .truth(1)
        .unwrap()
        .iter()
        .map(|x| f64::from(*x))
        .sum();
    let wall = phantom.heart().pair().wall_volume();
    let mean = truth * phantom.camera().grid().voxel_volume();
    assert!((mean / wall - 1.0).abs() < 2e-3, "{mean} {wall}");
}

#[test]
fn random_beats_have_the_given_statistics() {
    let mut scene = slow(Mode::WholeCycle, 600.0);
    scene.beats = Some(Beats {
        accepted: Some([0.7, 1.3]),
        ..Beats::new(RrIntervals::Random {
            deviation: 0.05,
            ectopic: 0.1,
            seed: 3,
        })
    });
    let report = Phantom::new(scene.clone()).unwrap().beats().unwrap();
    let n = report.beats as f64;
    let mean = report.interval_s.iter().sum::<f64>() / n;
    // 2400 beats: a thousandth of the deviation of the mean is 0.0025.
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
    let premature = report
        .interval_s
        .iter()
        .filter(|s| (**s - 0.6).abs() < 1e-9)
        .count() as f64;
    assert!((premature / n - 0.1).abs() < 0.02, "{premature} of {n}");
    assert_eq!(report.rejected, 2 * premature as usize);
    let normal = || {
        report
            .interval_s
            .iter()
            .zip(&report.accepted)
            .filter(|(_, a)| **a)
    };
    let spread = normal().map(|(s, _)| (s - 1.0).powi(2)).sum::<f64>() / normal().count() as f64;
    assert!((spread.sqrt() - 0.05).abs() < 0.003, "{spread}");
    let again = Phantom::new(scene).unwrap().beats().unwrap();
    assert_eq!(again, report);
}

#[test]
fn a_gate_that_does_not_occur_is_rejected() {
    let mut scene = slow(Mode::Gated { gates: 4 }, 0.5);
    scene.breathing = Some(breathing());
    let refused = Phantom::new(scene.clone()).unwrap_err();
    let PhantomError::Scene(error) = refused else {
        panic!("{refused}")
    };
    assert!(error.to_string().contains("does not occur"), "{error}");
    // No accepted time.
    scene.acquisition.mode = Mode::WholeCycle;
    scene.breathing = None;
    scene.beats = Some(Beats {
        accepted: Some([0.1, 0.2]),
        ..irregular()
    });
    let refused = Phantom::new(scene).unwrap_err();
    assert!(matches!(refused, PhantomError::Scene(_)), "{refused}");
}
