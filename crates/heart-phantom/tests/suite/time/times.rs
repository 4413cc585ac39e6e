//! One rule for time and angle: at time t of view k the camera is at its angle at t.

use heart_phantom::{
    Beats, Breathing, BreathingCurve, Mode, RespiratoryGates, Rotation, RrIntervals, Scene,
};
use heart_phantom::{Phantom, PhantomError, VolumeCurve};

use crate::phantom::small;

/// Twelve views of 3 s, 15 degrees apart.
fn turning(mode: Mode) -> Scene {
    let mut scene = small(mode);
    scene.camera.rotation = Rotation::Continuous;
    scene.camera.seconds_per_view = 3.0;
    scene
}

#[test]
fn every_view_reports_its_time_and_angle() {
    let nominal = |k: usize| (k as f64 * 15.0).to_radians();
    let step = 15.0_f64.to_radians();
    for (mode, window, share) in [
        (Mode::Static { phase: 0.25 }, 3.0, 0.5),
        (Mode::Instants, 0.0, 0.0),
        (Mode::Exposure { seconds: 0.3 }, 0.3, 0.05),
        (Mode::Exposure { seconds: 3.0 }, 3.0, 0.5),
        (Mode::WholeCycle, 3.0, 0.5),
    ] {
        let mut scene = turning(mode);
        let times = Phantom::new(scene.clone()).unwrap().view_times(0).unwrap();
        for (k, time) in times.iter().enumerate() {
            assert_eq!(
                (time.start, time.window),
                (3.0 * k as f64, window),
                "{mode:?}"
            );
            let expected = nominal(k) + (share - 0.5) * step;
            assert!((time.angle - expected).abs() < 1e-14, "{mode:?} {k}");
            let phase = match mode {
                Mode::Static { phase } => phase,
                _ => (3.0 * k as f64 * 65.0 / 60.0).fract(),
            };
            assert!((time.phase - phase).abs() < 1e-11, "{mode:?} {k}");
        }
        scene.camera.rotation = Rotation::StepAndShoot;
        let times = Phantom::new(scene).unwrap().view_times(0).unwrap();
        assert!(
            (times.iter().enumerate()).all(|(k, time)| (time.angle - nominal(k)).abs() < 1e-14)
        );
    }
}

/// Gates divide the view's time: their times sum to it, and their angles average to that of the view.
#[test]
fn the_gates_divide_the_time_of_a_view() {
    let gates = 8;
    let phantom = Phantom::new(turning(Mode::Gated { gates })).unwrap();
    let times: Vec<_> = (0..gates)
        .map(|gate| phantom.view_times(gate).unwrap())
        .collect();
    for (k, nominal) in phantom.camera().geometry().angles().iter().enumerate() {
        let seconds: f64 = times.iter().map(|of| of[k].window).sum();
        assert!((seconds - 3.0).abs() < 1e-11);
        let mean: f64 = times.iter().map(|of| of[k].window * of[k].angle).sum();
        assert!((mean / 3.0 - nominal).abs() < 1e-11);
    }
    // 3 s are 3.25 beats: the first view contains its first two gates four times, the others three times.
    let beat = 60.0 / 65.0;
    assert!((times[0][0].window - 4.0 * beat / 8.0).abs() < 1e-11);
    assert!((times[7][0].window - 3.0 * beat / 8.0).abs() < 1e-11);
    // Beats 0, 1, 2 and 3 pass the middle of gate 0 at 1/16, 17/16, ...: on average at 25/16 of 3.25 beats.
    let share = (25.0 / 16.0) / 3.25;
    let angle = (share - 0.5) * 15.0_f64.to_radians();
    assert!((times[0][0].angle - angle).abs() < 1e-12);
    assert!(
        matches!(phantom.view_times(gates), Err(PhantomError::Count { given, most, .. }) if given == gates && most == gates - 1)
    );
    // All of them by direct evaluation: angle and gate at 100 000 instants of a view.
    let n = 100_000;
    for k in [0, 5, 11] {
        let mut sums = vec![[0.0; 2]; gates];
        for j in 0..n {
            let share = (f64::from(j) + 0.5) / f64::from(n);
            let phase = (3.0 * (k as f64 + share) / beat).fract();
            let sum = &mut sums[(phase * gates as f64) as usize];
            *sum = [sum[0] + 1.0, sum[1] + share];
        }
        for (of, [seen, shares]) in times.iter().zip(sums) {
            // At each end of at most four passes through a gate one instant may be wrong.
            let off = 8.0 / f64::from(n);
            assert!((of[k].window / 3.0 - seen / f64::from(n)).abs() < off);
            let angle = (k as f64 + shares / seen - 0.5) * 15.0_f64.to_radians();
            assert!((of[k].angle - angle).abs() < 8.0 * off, "{angle}");
        }
    }
}

/// Respiratory gates by amplitude divide the time of a view, also where the position rests or rounds to the end of a gate.
#[test]
fn respiratory_gates_divide_the_time_of_a_view() {
    let sampled = |samples: &[f64]| BreathingCurve::Sampled(samples.to_vec());
    let curves = [
        BreathingCurve::Sinusoid,
        BreathingCurve::Lujan { n: 5 },
        BreathingCurve::Lujan { n: 20 },
        sampled(&[0.0, 0.0, 0.0, 0.3, 1.0, 0.6, 0.1, 0.0]),
        sampled(&[0.0, 0.0, 1.0, 1.0]),
        sampled(&[1.0, 1.0, 0.5, 0.5, 0.5, 0.0]),
    ];
    for (curve, gates) in curves
        .iter()
        .flat_map(|curve| [(curve, 1), (curve, 2), (curve, 3)])
    {
        let mut scene = small(Mode::WholeCycle).with_size(8);
        scene.camera.seconds_per_view = 6.0;
        scene.breathing = Some(Breathing {
            shift: [0.0, 0.0, -2.0],
            period: 3.69255,
            start: 0.417,
            curve: curve.clone(),
            gates: Some(RespiratoryGates::Amplitude(gates)),
            ..Breathing::default()
        });
        let phantom = Phantom::new(scene).unwrap();
        let times: Vec<_> = (0..gates)
            .map(|gate| phantom.view_times(gate).unwrap())
            .collect();
        for k in 0..phantom.camera().n_views() {
            let seconds: f64 = times.iter().map(|of| of[k].window).sum();
            assert!(
                (seconds - 6.0).abs() < 1e-9,
                "{curve:?}, {gates}: {seconds}"
            );
        }
    }
}

/// A sampled curve that rises within a third of a long cycle is a smooth step, `3 u^2 - 2 u^3`: the times at which it passes the limits of gates
/// have the closed form `u = 1/2 - sin(arcsin(1 - 2 y) / 3)`.
#[test]
fn times_of_amplitude_gates_have_a_closed_form() {
    const GATES: usize = 100;
    let mut scene = small(Mode::Static { phase: 0.0 }).with_size(8);
    scene.camera.seconds_per_view = 30.0;
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.0, -2.0],
        period: 30.0,
        curve: BreathingCurve::Sampled(vec![0.0, 1.0, 1.0]),
        gates: Some(RespiratoryGates::Amplitude(GATES)),
        ..Breathing::default()
    });
    let phantom = Phantom::new(scene).unwrap();
    let at = |y: f64| 10.0 * (0.5 - ((1.0 - 2.0 * y).asin() / 3.0).sin());
    for gate in [0, 1, 37, GATES - 1] {
        let [from, to] = [gate, gate + 1].map(|k| at(k as f64 / GATES as f64));
        // Inspiration and expiration; the last gate also has the third of the cycle at end-inspiration.
        let rest = if gate + 1 == GATES { 10.0 } else { 0.0 };
        let expected = 2.0 * (to - from) + rest;
        for time in phantom.view_times(gate).unwrap() {
            // Roots have a relative error of 1e-13; the last view starts at 330 s.
            assert!(
                (time.window - expected).abs() < 1e-9,
                "{gate}: {} {expected}",
                time.window
            );
        }
    }
}

/// Systole in the middle of a beat lasts as long as in a regular beat; both parts of diastole are stretched alike.
#[test]
fn systole_between_two_parts_of_diastole_has_a_fixed_duration() {
    const INTERVALS: [f64; 4] = [0.9, 1.2, 1.0, 1.6];
    let mut scene = small(Mode::Instants).with_size(8);
    scene.cycle.beats_per_minute = 60.0;
    // Largest at a quarter of the beat, smallest at three quarters.
    scene.cycle.curve = VolumeCurve::Sampled(vec![0.5, 1.0, 0.5, 0.0]);
    scene.beats = Some(Beats::new(RrIntervals::List(INTERVALS.to_vec())));
    (scene.camera.views, scene.camera.seconds_per_view) = (40, 0.37);
    for time in Phantom::new(scene).unwrap().view_times(0).unwrap() {
        let (mut after, mut k) = (time.start, 0);
        while after >= INTERVALS[k % 4] {
            after -= INTERVALS[k % 4];
            k += 1;
        }
        // Seconds of the first part of diastole; systole lasts half a second.
        let first = 0.5 * (INTERVALS[k % 4] - 0.5);
        let expected = if after < first {
            0.25 * after / first
        } else if after < first + 0.5 {
            0.25 + after - first
        } else {
            0.75 + 0.25 * (after - first - 0.5) / first
        };
        // Phases are rounded to 5e-13.
        assert!((time.phase - expected).abs() < 1e-11, "{time:?} {expected}");
    }
}
