//! Prescribed volumes: constant volumes, periodic beats, events.

use crate::common;

use std::f64::consts::TAU;

use common::{RunWith, balloon, inflate, reference_body};
use membrane_implicit::DiscreteMembrane;
use membrane_implicit::{
    Body, Load, LoadKind, Measure, Membrane, Motion, PressureLaw, ReferenceShape, Scheme,
    Stiffness, Stop, TimeStep, Tolerance,
};

type Points = Vec<[f64; 2]>;

/// 65 beats per minute.
const PERIOD: f64 = 60.0 / 65.0;

fn bodies(law: PressureLaw) -> (Body, Body) {
    let body = |radius: f64| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap())
            .with_stiffness(Stiffness::constant(100.0).unwrap())
            .with_law(law);
        Body::springs(&membrane, 101)
            .unwrap()
            .with_damping(20.0)
            .unwrap()
    };
    (body(1.75), body(2.75))
}

fn beating(law: PressureLaw, scheme: Scheme) -> Motion {
    let (inner, outer) = bodies(law);
    let load = Load::volume_gain(&inner, |t| 0.3 * (1.0 - (TAU * t / PERIOD).cos()));
    Motion::pair(inner, outer, load, scheme).unwrap()
}

fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

#[test]
fn ten_beats_of_a_pair_are_periodic_and_preserve_the_wall_volume() {
    for (law, scheme) in [
        (PressureLaw::PerMaterialLength, Scheme::TrBdf2),
        (PressureLaw::PerMaterialLength, Scheme::Midpoint),
        (PressureLaw::PerCurrentLength, Scheme::TrBdf2),
    ] {
        let mut motion = beating(law, scheme);
        let rest = motion.state().volume();
        let mut beats: Vec<(Points, Points, f64)> = Vec::new();
        let (mut wall, mut inner) = (0.0f64, 0.0f64);
        for beat in 0..10 {
            // A quarter past the start of each beat, where the shape moves fastest.
            let end = (f64::from(beat) + 0.25) * PERIOD;
            motion
                .run_with(TimeStep::Fixed(PERIOD / 100.0), &[Stop::Time(end)], |m| {
                    wall = wall.max(m.wall_volume_error().unwrap().abs());
                    let gain = 0.3 * (1.0 - (TAU * m.time() / PERIOD).cos());
                    inner = inner.max((m.state().volume() / (rest * (1.0 + gain)) - 1.0).abs());
                })
                .unwrap();
            let outer = motion.outer().unwrap();
            let state = motion.state();
            beats.push((
                state.points.to_vec(),
                outer.points.to_vec(),
                state.intensity,
            ));
        }
        let change =
            |k: usize| apart(&beats[k].0, &beats[k - 1].0).max(apart(&beats[k].1, &beats[k - 1].1));
        println!(
            "{law:?} {scheme:?}: change of beat 1 {:e}, 9 {:e}; wall {wall:e}, inner {inner:e}",
            change(1),
            change(9)
        );
        assert!(
            wall < 1e-12 && inner < 1e-12,
            "{scheme:?}: wall {wall:e}, inner {inner:e}"
        );
        // The transient decays like exp(-mu t / 2) = exp(-9.2) per beat, to rounding after nine. The midpoint rule damps unresolved modes more slowly
        // (omega dt up to 18).
        let bound = if scheme == Scheme::Midpoint {
            1e-6
        } else {
            1e-11
        };
        assert!(change(1) > 1e-9, "{scheme:?}: no transient at all");
        assert!(change(9) < bound, "{scheme:?}: {:e}", change(9));
        assert!(
            (beats[9].2 / beats[8].2 - 1.0).abs() < 1e-3,
            "{:?} {:?}",
            beats[9].2,
            beats[8].2
        );
    }
}

#[test]
fn the_linearised_scheme_meets_the_volume_to_its_order() {
    let drift = [200, 400].map(|n| {
        let (inner, outer) = bodies(PressureLaw::PerMaterialLength);
        let load = Load::volume_gain(&inner, |t| 0.3 * (1.0 - (TAU * t / PERIOD).cos()));
        let mut motion = Motion::pair(inner, outer, load, Scheme::SemiImplicitEuler).unwrap();
        let mut drift = 0.0f64;
        motion
            .run_with(
                TimeStep::Fixed(PERIOD / f64::from(n)),
                &[Stop::Time(PERIOD)],
                |m| {
                    drift = drift.max(m.wall_volume_error().unwrap().abs());
                },
            )
            .unwrap();
        drift
    });
    println!("{drift:?}");
    // the error of a linearised volume is (dt v)^2 per step and is corrected by the next step
    let slope = (drift[0] / drift[1]).log2();
    assert!(
        drift[0] < 1e-2 && (slope - 2.0).abs() < 0.3,
        "{drift:?}, slope {slope}"
    );
}

#[test]
fn adaptive_pumping_follows_fixed_steps() {
    let mut fixed = beating(PressureLaw::PerMaterialLength, Scheme::TrBdf2);
    fixed
        .run(TimeStep::Fixed(PERIOD / 4000.0), &[Stop::Time(PERIOD)])
        .unwrap();
    let mut adaptive = beating(PressureLaw::PerMaterialLength, Scheme::TrBdf2);
    let tolerance = Tolerance {
        position: 1e-5,
        velocity: 1e-2,
        longest: 0.05,
    };
    adaptive
        .run(TimeStep::Adaptive(tolerance), &[Stop::Time(PERIOD)])
        .unwrap();
    let distance = apart(fixed.state().points, adaptive.state().points);
    println!("{distance:e} with {:?}", adaptive.work());
    assert!(distance < 1e-3, "{distance:e}");
    assert!(adaptive.wall_volume_error().unwrap().abs() < 1e-12);
}

/// The pressure of a volume control, prescribed as a load, gives the same volumes.
#[test]
fn volume_control_and_pressure_control_agree() {
    let gain = |t: f64| 0.3 * (1.0 - (2.0 * t).cos());
    let body = reference_body();
    let mut pumped = Motion::new(
        body.clone(),
        Load::volume_gain(&body, gain),
        Scheme::Midpoint,
    )
    .unwrap();
    let dt = 0.01;
    let mut pressures = vec![pumped.state().intensity];
    pumped
        .run_with(TimeStep::Fixed(dt), &[Stop::Steps(100)], |m| {
            pressures.push(m.state().intensity)
        })
        .unwrap();
    let table = pressures.clone();
    // the pressure of a step applies to its middle
    let load = Load::intensity(move |t| table[((t / dt) as usize + 1).min(100)]);
    let mut pressed = Motion::new(body, load, Scheme::Midpoint).unwrap();
    pressed
        .run(TimeStep::Fixed(dt), &[Stop::Steps(100)])
        .unwrap();
    let distance = apart(pumped.state().points, pressed.state().points);
    println!("{distance:e}");
    assert!(distance < 1e-9, "{distance:e}");
    assert_eq!(Load::intensity(|_| 0.0).kind(), LoadKind::Intensity);
}

/// At the start the pressure of the volume control must match the second derivative of the volume.
#[test]
fn first_pressure_of_a_pump_is_consistent() {
    let body = reference_body();
    let motion = Motion::new(
        body.clone(),
        Load::volume_gain(&body, |t| 0.5 * t * t),
        Scheme::TrBdf2,
    )
    .unwrap();
    // from zero velocity: f grad V . n = m V'' = m V0, without other forces
    let d = body.differences();
    let (mut gradient, mut normal) = (vec![0.0; 202], vec![0.0; 202]);
    d.measure_gradient_into(Measure::Volume, d.start(), &mut gradient);
    d.pressure_force_into(d.start(), 1.0, &mut normal).unwrap();
    let rate: f64 = gradient.iter().zip(&normal).map(|(g, n)| g * n).sum();
    let expected = Measure::Volume.of(d.start().as_chunks().0) / rate;
    // V'' by differences over 1e-3 s: rounding 1e-16 / 1e-6
    assert!((motion.state().intensity / expected - 1.0).abs() < 1e-7);
    // 1 - cos(50 t) has the V'' of 1250 t^2: differences over a thousandth of its time have an error of second order
    let load = Load::volume_gain(&body, |t| 1.0 - (50.0 * t).cos());
    let fast = Motion::new(body.clone(), load, Scheme::TrBdf2).unwrap();
    assert!((fast.state().intensity / (2500.0 * expected) - 1.0).abs() < 5e-3);
    // with the same V'' the outer membrane of a pair
    let outer = Membrane::new(ReferenceShape::balloon(8.5, 2.75).unwrap());
    let outer = Body::springs(&outer, 101).unwrap();
    let d = outer.differences();
    d.measure_gradient_into(Measure::Volume, d.start(), &mut gradient);
    d.pressure_force_into(d.start(), 1.0, &mut normal).unwrap();
    let outer_rate: f64 = gradient.iter().zip(&normal).map(|(g, n)| g * n).sum();
    let load = Load::volume_gain(&body, |t| 0.5 * t * t);
    let pair = Motion::pair(body.clone(), outer.clone(), load, Scheme::TrBdf2).unwrap();
    let found = pair.outer().unwrap().intensity;
    assert!((found * outer_rate / (expected * rate) - 1.0).abs() < 1e-7);
}

/// From a moving state under f = 17.5, volumes with its first and second derivatives: f is continuous, and the volume is met. V'' is a
/// difference of V' over 2e-4 s of the same motion, with an error of second order.
#[test]
fn a_pump_continues_a_motion_at_its_pressure() {
    for scheme in [Scheme::TrBdf2, Scheme::Midpoint] {
        let mut motion = inflate(scheme);
        let mut rates = [0.0; 3];
        motion
            .run(TimeStep::Fixed(1e-2), &[Stop::Time(0.3)])
            .unwrap();
        let mut later = motion.clone();
        for rate in &mut rates {
            *rate = later.state().volume_rate();
            later.step(1e-4).unwrap();
        }
        let v = motion.state().volume();
        let second = (4.0 * rates[1] - 3.0 * rates[0] - rates[2]) / 2e-4;
        let volume = move |t: f64| {
            let t = t - 0.3;
            v + rates[0] * t + 0.5 * second * t * t
        };
        motion.set_load(Load::volume(volume)).unwrap();
        let found = motion.state().intensity;
        assert!((found / 17.5 - 1.0).abs() < 1e-4, "{scheme:?}: {found}");
        let mut points = motion.state().points.to_vec();
        let mut velocities = points.clone();
        assert!(motion.at_into(0.295, &mut points, &mut velocities).is_err());
        motion.step(0.01).unwrap();
        assert!((motion.state().volume() / volume(motion.time()) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn runs_stop_at_a_volume_and_at_the_first_of_several_events() {
    for steps in [
        TimeStep::Fixed(0.02),
        TimeStep::Adaptive(Tolerance::uniform(1e-4)),
    ] {
        for scheme in [
            Scheme::TrBdf2,
            Scheme::SemiImplicitEuler,
            Scheme::Splitting2,
        ] {
            let steps = match steps {
                TimeStep::Fixed(_) if scheme == Scheme::Splitting2 => TimeStep::Fixed(0.01),
                other => other,
            };
            let mut motion = inflate(scheme);
            let stops = [Stop::Time(10.0), Stop::Volume(150.0)];
            assert_eq!(motion.run(steps, &stops).unwrap(), 1);
            let volume = motion.state().volume();
            assert!((volume / 150.0 - 1.0).abs() < 1e-10, "{scheme:?} {volume}");
            assert!(motion.time() > 0.1 && motion.time() < 1.0);
            // then continues through the same volume in the opposite direction
            let first = motion.time();
            motion.run(steps, &[Stop::Time(first + 0.1)]).unwrap();
            assert!(motion.state().volume() > 150.0);
            assert_eq!(
                motion
                    .run(steps, &[Stop::Time(10.0), Stop::Volume(150.0)])
                    .unwrap(),
                1
            );
            assert!(motion.time() > first + 0.1);
        }
    }
    let mut motion = inflate(Scheme::TrBdf2);
    assert_eq!(
        motion
            .run(TimeStep::Fixed(0.1), &[Stop::Time(0.35), Stop::Steps(2)])
            .unwrap(),
        1
    );
    assert_eq!(
        motion
            .run(TimeStep::Fixed(0.1), &[Stop::Time(0.35)])
            .unwrap(),
        0
    );
    assert_eq!((motion.time(), motion.work().steps), (0.35, 4));
    let settled = Stop::Equilibrium {
        force: 1e-6,
        speed: 1e-6,
    };
    assert_eq!(
        motion
            .run(TimeStep::Fixed(5.0), &[Stop::Time(1e9), settled])
            .unwrap(),
        1
    );
    let (force, speed) = motion.norms().unwrap();
    assert!(force <= 1e-6 && speed <= 1e-6);
}

#[test]
fn fixed_ends_are_bitwise_constant() {
    for scheme in [Scheme::SemiImplicitEuler, Scheme::Midpoint, Scheme::TrBdf2] {
        let membrane = balloon().with_second_neighbours(Stiffness::constant(0.2).unwrap());
        let body = Body::springs(&membrane, 61).unwrap();
        let mut motion = Motion::new(
            body,
            Load::total_force(|t| 2000.0 + 900.0 * t.sin()),
            scheme,
        )
        .unwrap();
        motion
            .run(TimeStep::Fixed(0.3), &[Stop::Steps(300)])
            .unwrap();
        let state = motion.state();
        assert_eq!(
            [state.points[0], state.points[60]],
            [[0.0, 1.75], [0.0, -1.75]]
        );
        assert_eq!([state.velocities[0], state.velocities[60]], [[0.0; 2]; 2]);
    }
}
