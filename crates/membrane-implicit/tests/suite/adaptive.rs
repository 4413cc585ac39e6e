//! Adaptive steps and events, compared with other schemes at much smaller steps.

use crate::common;

use std::f64::consts::TAU;

use common::{RunWith, apart, balloon, inflate, reference_body};
use membrane_implicit::{
    Body, ImplicitError, Load, LoadKind, Membrane, MembraneError, Motion, ReferenceShape, Rubber,
    Scheme, Stop, StrainEnergy, Thickness, TimeStep, Tolerance,
};

/// A load that rises within a tenth of the first step that the initial state suggests: the error of that step is controlled, too, also by
/// schemes whose estimate needs a previous step.
#[test]
fn the_first_step_meets_the_tolerance() {
    let motion = |scheme| {
        let load = Load::intensity(|t| 17.5 * (1.0 - (-t / 0.001).exp()));
        Motion::new(reference_body(), load, scheme).unwrap()
    };
    // Splitting6 (order 6): with these steps its error is 3e-10 cm, found by halving them
    let mut reference = motion(Scheme::Splitting6);
    let fine = TimeStep::Fixed(1e-4);
    reference.run(fine, &[Stop::Time(0.02)]).unwrap();
    let coarse = TimeStep::Fixed(2.5e-3);
    reference.run(coarse, &[Stop::Time(0.5)]).unwrap();
    let exact = reference.state().points;
    for scheme in [
        Scheme::Midpoint,
        Scheme::Splitting2,
        Scheme::ImplicitSplitting2,
        Scheme::TrBdf2,
    ] {
        for tolerance in [1e-3, 1e-5, 1e-7] {
            let mut motion = motion(scheme);
            let steps = TimeStep::Adaptive(Tolerance::uniform(tolerance));
            motion.run(steps, &[Stop::Time(0.5)]).unwrap();
            let error = apart(motion.state().points, exact);
            println!(
                "{scheme:?} {tolerance:e}: {error:e} cm, {:?}",
                motion.work()
            );
            // The tolerance is that of one step and of velocities too. Errors of velocities (cm/s) act for half a second; those of the steps (about
            // ten at 1e-3, a thousand at 1e-7) add up.
            assert!(
                error < 20.0 * tolerance,
                "{scheme:?} {tolerance:e}: {error:e}"
            );
        }
    }
}

/// A pulse of the load long after the start, when steps without load are long, is not stepped over.
#[test]
fn a_late_pulse_is_found() {
    let pulse = |scheme| {
        let load = |t: f64| if (5.0..5.2).contains(&t) { 17.5 } else { 0.0 };
        Motion::new(reference_body(), Load::intensity(load), scheme).unwrap()
    };
    let end = [Stop::Time(5.3)];
    let mut fixed = pulse(Scheme::TrBdf2);
    fixed.run(TimeStep::Fixed(5e-4), &end).unwrap();
    let expected = fixed.energy().pressure_work;
    // on a load of the same size at equilibrium, too
    let mut settled =
        Motion::new(reference_body(), Load::intensity(|_| 1.0), Scheme::TrBdf2).unwrap();
    settled
        .run(TimeStep::Fixed(1.0), &[Stop::Time(100.0)])
        .unwrap();
    let load = Load::intensity(|t| if (5.0..5.2).contains(&t) { 2.0 } else { 1.0 });
    let motion = Motion::new(reference_body(), load, Scheme::TrBdf2).unwrap();
    let mut motion = (motion.with_state(0.0, settled.state().points, &[[0.0; 2]; 101])).unwrap();
    let steps = TimeStep::Adaptive(Tolerance::uniform(1e-4));
    motion.run(steps, &end).unwrap();
    assert!(motion.state().volume() > 1.001 * settled.state().volume());
    for scheme in [
        Scheme::TrBdf2,
        Scheme::SemiImplicitEuler,
        Scheme::Midpoint,
        Scheme::ImplicitSplitting2,
    ] {
        let mut motion = pulse(scheme);
        let steps = TimeStep::Adaptive(Tolerance::uniform(1e-4));
        motion.run(steps, &end).unwrap();
        let work = motion.energy().pressure_work;
        println!("{scheme:?}: {work} of {expected}, {:?}", motion.work());
        assert!((work / expected - 1.0).abs() < 0.01, "{scheme:?}: {work}");
    }
}

/// The volume passes the value and returns within one step of the run, for any position of the steps about the maximum.
#[test]
fn a_volume_passed_within_a_step_stops_the_run() {
    // TR-BDF2 at 1e-4: error 2e-6 of the volume; the run uses Splitting6 at 0.009
    let mut fine = inflate(Scheme::TrBdf2);
    let mut volumes = vec![(0.0, fine.state().volume())];
    fine.run_with(TimeStep::Fixed(1e-4), &[Stop::Time(1.0)], |motion| {
        volumes.push((motion.time(), motion.state().volume()));
    })
    .unwrap();
    let &(_, most) = volumes.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let value = most - 0.005;
    let after = volumes.iter().position(|(_, v)| *v > value).unwrap();
    let ((t0, v0), (t1, v1)) = (volumes[after - 1], volumes[after]);
    let time = t0 + (value - v0) / (v1 - v0) * (t1 - t0);
    let mut within = 0;
    for offset in 0..9 {
        let run = |stops: &[Stop]| {
            let mut motion = inflate(Scheme::Splitting6);
            motion.step(0.001 * f64::from(offset) + 5e-4).unwrap();
            let stop = motion.run(TimeStep::Fixed(0.009), stops).unwrap();
            (stop, motion)
        };
        let (stop, motion) = run(&[Stop::Time(1.0), Stop::Volume(value)]);
        assert_eq!(stop, 1, "offset {offset}");
        assert!((motion.state().volume() / value - 1.0).abs() < 1e-10);
        // the volume rises by 3 cm^3/s there: its error of 4e-4 cm^3 is 1e-4 s
        let off = motion.time() - time;
        println!("offset {offset}: {off:e} s");
        assert!(off.abs() < 1e-4, "offset {offset}: {off:e} s");
        let steps = motion.work().steps;
        let (_, whole) = run(&[Stop::Steps(steps - 1)]);
        within += i32::from(whole.state().volume() < value);
    }
    // in some of the runs no step ends beyond the value
    assert!((1..9).contains(&within), "{within}");
}

/// Steps limited by the error of the positions, and by that of the velocities: the true error of each, against much finer steps from the same
/// state, is at most 1.5 times the tolerance, and in some step a tenth of it. At most every second attempt is rejected, and none of a pump's first
/// one, whose length is known from the acceleration.
#[test]
fn the_error_of_each_step_is_near_the_tolerance() {
    let load = |_: &Body| Load::intensity(|t| 0.5 - 0.5 * (TAU * t).cos());
    let sudden = |_: &Body| Load::intensity(|t| 17.5 * (1.0 - (-t / 1e-4).exp()));
    let pump = |body: &Body| Load::volume_gain(body, |t| 0.1 - 0.1 * (TAU * t).cos());
    let springs = || Body::springs(&balloon(), 21).unwrap();
    let rubber = || {
        let neo = StrainEnergy::NeoHookean { mu: 1.0 };
        let rubber = Rubber::new(neo, Thickness::UNIT).unwrap();
        Body::rubber(&balloon().with_rubber(rubber), 21, 1.0).unwrap()
    };
    let (explicit, fine) = (Scheme::Splitting6, Scheme::Midpoint);
    type Case<'a> = (
        Scheme,
        Scheme,
        &'a dyn Fn() -> Body,
        &'a dyn Fn(&Body) -> Load,
    );
    let cases: [Case<'_>; 7] = [
        (Scheme::TrBdf2, explicit, &springs, &load),
        (Scheme::Midpoint, explicit, &springs, &load),
        (Scheme::Splitting2, explicit, &springs, &load),
        (Scheme::ImplicitSplitting2, explicit, &springs, &load),
        (Scheme::Midpoint, fine, &rubber, &load),
        (Scheme::TrBdf2, Scheme::TrBdf2, &springs, &pump),
        (Scheme::Midpoint, explicit, &springs, &sudden),
    ];
    for (scheme, fine, body, load) in cases {
        for (position, velocity) in [(1e-5, 1e9), (1e9, 1e-4)] {
            let mut motion = Motion::new(body(), load(&body()), scheme).unwrap();
            let pumped = motion.load().kind() == LoadKind::Volume;
            let mut position = position;
            if pumped && velocity < 1.0 {
                // a second pump with larger steps, which starts late
                position = 1e-2;
                let start = motion.state().points.to_vec();
                motion = motion.with_state(16.0, &start, &[[0.0; 2]; 21]).unwrap();
            }
            let tolerance = Tolerance {
                position,
                velocity,
                longest: 0.3,
            };
            let mut largest = 0.0f64;
            for _ in 0..12 {
                let before = motion.state();
                let mut exact = Motion::new(body(), load(&body()), fine).unwrap();
                exact = exact
                    .with_state(before.time, before.points, before.velocities)
                    .unwrap();
                motion.step_adaptive(&tolerance, 1.0).unwrap();
                let rejected = motion.work().rejected;
                assert!(!pumped || motion.work().steps > 1 || rejected == 0);
                let dt = (motion.time() - exact.time()) / 20.0;
                let end = [Stop::Time(motion.time())];
                exact.run(TimeStep::Fixed(dt), &end).unwrap();
                let off = |a: &[[f64; 2]], b: &[[f64; 2]]| {
                    let squares = a
                        .iter()
                        .zip(b)
                        .map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2));
                    (squares.sum::<f64>() / a.len() as f64).sqrt()
                };
                let (a, b) = (motion.state(), exact.state());
                // in a pump the change of position by an error of the velocity
                let velocity = if pumped {
                    position / (20.0 * dt)
                } else {
                    velocity
                };
                let by_velocity = off(a.velocities, b.velocities) / velocity;
                let error = by_velocity.max(off(a.points, b.points) / position);
                assert!(error < 1.5, "{scheme:?} {position:e}: {error}");
                largest = largest.max(error);
            }
            assert!(largest > 0.1, "{scheme:?} {position:e}: {largest}");
            assert!(motion.work().rejected <= 12, "{:?}", motion.work());
        }
    }
}

/// From rest, a volume is passed and left again within the first step: the largest is 191.6 cm^3 after 0.8 s of a sudden load, the smallest
/// 64.8 cm^3 after 0.9 s without that load.
#[test]
fn a_volume_passed_within_the_first_step_stops_the_run() {
    let body = |damping| {
        let body = Body::springs(&balloon(), 21).unwrap();
        body.with_damping(damping).unwrap()
    };
    let load = |f: f64| Load::intensity(move |_| f);
    let mut full = Motion::new(body(1.0), load(17.5), Scheme::TrBdf2).unwrap();
    let steps = TimeStep::Fixed(0.05);
    full.run(steps, &[Stop::Time(30.0)]).unwrap();
    let rest = vec![[0.0; 2]; 21];
    let start = |f: f64| {
        let motion = Motion::new(body(0.5), load(f), Scheme::TrBdf2).unwrap();
        match f {
            0.0 => motion.with_state(0.0, full.state().points, &rest).unwrap(),
            _ => motion,
        }
    };
    for (f, dt, volume) in [(17.5, 1.1, 187.6), (0.0, 1.2, 68.5)] {
        let mut motion = start(f);
        let stops = [Stop::Volume(volume), Stop::Steps(1)];
        assert_eq!(motion.run(TimeStep::Fixed(dt), &stops), Ok(0), "{f}");
        assert_eq!(motion.work().steps, 1);
        assert!((motion.state().volume() / volume - 1.0).abs() < 1e-10);
        // on its way there, not back
        assert!(motion.time() < 0.8 && motion.state().volume_rate() * (f - 1.0) > 0.0);
    }
    // a step is searched if the cubic through volumes and flows of its ends, here sampled, reaches the volume within it
    let mut searches = 0;
    for (f, sign) in [(17.5, 1.0), (0.0, -1.0)] {
        for k in 0..8 {
            let (mut from, dt) = (start(f), 0.7);
            from.run(TimeStep::Fixed(0.05), &[Stop::Steps(2 * k)])
                .unwrap();
            let mut plain = from.clone();
            plain.step(dt).unwrap();
            let [a, b] = [&from, &plain]
                .map(|motion| [motion.state().volume(), dt * motion.state().volume_rate()]);
            let cubic = |t: f64| {
                let s = 1.0 - t;
                s * s * (a[0] * (3.0 - 2.0 * s) + a[1] * t)
                    + t * t * (b[0] * (3.0 - 2.0 * t) - b[1] * s)
            };
            let samples = (0..=2000).map(|k| sign * cubic(f64::from(k) / 2000.0));
            let most = sign * samples.fold(f64::NEG_INFINITY, f64::max);
            if (sign * (most - a[0])).min(sign * (most - b[0])) < 0.01 {
                continue;
            }
            searches += 1;
            for (beyond, is_searched) in [(-1e-3, true), (1e-3, false)] {
                let mut motion = from.clone();
                let stops = [Stop::Volume(most + sign * beyond), Stop::Steps(1)];
                motion.run(TimeStep::Fixed(dt), &stops).unwrap();
                assert_eq!(
                    motion.work() != plain.work(),
                    is_searched,
                    "{f} {k} {beyond}"
                );
            }
        }
    }
    assert!(searches > 5, "{searches}");
}

/// After a load a thousand times as large, steps that the old factorisation cannot solve are solved with one of their own; rubber is too stiff
/// for steps of 10 s. In units of length of 2^-30 the motion is the same to the last bit, by the same work.
#[test]
fn sudden_loads_are_followed_in_any_unit_of_length() {
    let run = |unit: f64, is_rubber: bool, (jump, dt): (f64, f64), scheme| {
        let rest = ReferenceShape::balloon(8.5 * unit, 1.75 * unit).unwrap();
        let membrane = Membrane::new(rest);
        let (body, load) = if is_rubber {
            let neo = StrainEnergy::NeoHookean { mu: 1.0 };
            let rubber = Rubber::new(neo, Thickness::constant(0.5 * unit).unwrap()).unwrap();
            let membrane = membrane.with_rubber(rubber);
            (Body::rubber(&membrane, 21, 1.0 / (unit * unit)), 0.05)
        } else {
            (Body::springs(&membrane, 21), 17.5 * unit)
        };
        let load = move |t: f64| if t > 2.2 * dt { -jump * load } else { load };
        let body = body.unwrap().with_damping(0.5).unwrap();
        let mut motion = Motion::new(body, Load::intensity(load), scheme).unwrap();
        let made = (0..6).take_while(|_| motion.step(dt).is_ok()).count();
        let points = motion.state().points.iter();
        let points: Vec<_> = points.map(|p| p.map(|x| x / unit)).collect();
        (made, points, motion.work())
    };
    for (is_rubber, jump, scheme, steps) in [
        (false, (20.0, 0.3), Scheme::TrBdf2, 6),
        (false, (1000.0, 0.3), Scheme::TrBdf2, 6),
        (false, (1000.0, 0.3), Scheme::Midpoint, 6),
        (true, (10.0, 10.0), Scheme::Midpoint, 2),
    ] {
        let [large, small] = [1.0, 0.5f64.powi(30)].map(|unit| run(unit, is_rubber, jump, scheme));
        assert_eq!(large.0, steps, "{scheme:?} {jump:?}");
        assert_eq!(large, small, "{scheme:?} {jump:?}");
    }
}

/// Adaptive steps up to a time and to a volume, under a load and a pump, with lengths in units of 2^-30 and 2^30 and times in those of 2^20 and
/// 2^-20: the same to the last bit, by the same work.
#[test]
fn adaptive_steps_do_not_depend_on_units() {
    let run = |(length, time): (f64, f64), pumped: bool, scheme| {
        let rest = ReferenceShape::balloon(8.5 * length, 1.75 * length).unwrap();
        let body = Body::springs(&Membrane::new(rest), 21).unwrap();
        let body = body
            .with_mass(time * time)
            .unwrap()
            .with_damping(time)
            .unwrap();
        let load = match pumped {
            true => Load::volume_gain(&body, move |t| 0.5 - 0.5 * (6.0 * t / time).cos()),
            false => Load::intensity(move |t| length * (9.0 - 8.0 * (6.0 * t / time).cos())),
        };
        let tolerance = Tolerance {
            position: 1e-3 * length,
            velocity: 1e-2 * length / time,
            longest: f64::INFINITY,
        };
        let steps = TimeStep::Adaptive(tolerance);
        let mut motion = Motion::new(body, load, scheme).unwrap();
        motion.run(steps, &[Stop::Time(0.125 * time)]).unwrap();
        motion
            .run(steps, &[Stop::Volume(110.0 * length.powi(3))])
            .unwrap();
        let state = motion.state();
        let points: Vec<_> = state.points.iter().map(|p| p.map(|x| x / length)).collect();
        (points, state.time / time, motion.work())
    };
    for (pumped, scheme) in [
        (false, Scheme::TrBdf2),
        (false, Scheme::Splitting2),
        (true, Scheme::TrBdf2),
        (true, Scheme::Midpoint),
    ] {
        let [one, small, large] = [(0, 0), (-30, 20), (30, -20)]
            .map(|(length, time)| run((2f64.powi(length), 2f64.powi(time)), pumped, scheme));
        assert_eq!(one, small, "{scheme:?} {pumped}");
        assert_eq!(one, large, "{scheme:?} {pumped}");
    }
}

/// With hardly any mass the velocity follows the force at once: fast modes, which the scheme damps, do not limit the steps.
#[test]
fn fast_modes_do_not_limit_the_steps() {
    for (scheme, mass, damping, tolerance, [steps, rejected]) in [
        (Scheme::TrBdf2, 1e-5, 1.0, 1e-3, [25, 3]),
        (Scheme::Midpoint, 1e-5, 1.0, 1e-3, [100, 100]),
        (Scheme::ImplicitSplitting2, 3e-3, 10.0, 1e-2, [300, 300]),
    ] {
        let body = Body::springs(&balloon(), 51).unwrap().with_mass(mass);
        let body = body.unwrap().with_damping(damping).unwrap();
        let load = Load::intensity(|t| 5.0 - 5.0 * (2.0 * t).cos());
        let mut motion = Motion::new(body, load, scheme).unwrap();
        let dt = TimeStep::Adaptive(Tolerance::uniform(tolerance));
        motion.run(dt, &[Stop::Time(1.0)]).unwrap();
        let work = motion.work();
        assert!(
            work.steps < steps && work.rejected < rejected,
            "{scheme:?}: {work:?}"
        );
    }
}

/// Two volumes are passed within one step: the run stops at the first, whichever is listed first.
#[test]
fn the_first_volume_of_a_step_stops_the_run() {
    for stops in [[120.0, 125.0], [125.0, 120.0]] {
        let mut motion = inflate(Scheme::TrBdf2);
        let steps = TimeStep::Fixed(0.2);
        let index = motion.run(steps, &stops.map(Stop::Volume)).unwrap();
        assert_eq!(stops[index], 120.0);
        assert!((motion.state().volume() / 120.0 - 1.0).abs() < 1e-10);
    }
}

/// Steps cannot resolve less than rounding; twenty thousand of them would end at 1e-15 s.
#[test]
fn tolerances_below_rounding_are_rejected() {
    for (position, velocity, what) in [
        (1e-30, 1e-3, "position tolerance"),
        (1e-3, 1e-30, "velocity tolerance"),
    ] {
        let tolerance = Tolerance {
            position,
            velocity,
            longest: f64::INFINITY,
        };
        let mut motion = inflate(Scheme::TrBdf2);
        for error in [
            motion.step_adaptive(&tolerance, 1.0).unwrap_err(),
            (motion.run(TimeStep::Adaptive(tolerance), &[Stop::Steps(1)])).unwrap_err(),
        ] {
            let ImplicitError::Membrane(MembraneError::OutOfRange {
                what: of, given, ..
            }) = error
            else {
                panic!("{error}")
            };
            assert_eq!((of, given), (what, 1e-30));
        }
    }
    // the limit of the velocity is that of the position per time of a wave
    for mass in [1e-4, 1e4] {
        let body = reference_body().with_mass(mass).unwrap();
        let wave = 101.0 * body.largest_explicit_step();
        let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::TrBdf2).unwrap();
        let [position, velocity] = [(0.0, 1.0), (1.0, 0.0)].map(|(position, velocity)| {
            let tolerance = Tolerance {
                position,
                velocity,
                longest: 1.0,
            };
            match motion.step_adaptive(&tolerance, 1.0) {
                Err(ImplicitError::Membrane(MembraneError::OutOfRange { least, .. })) => least,
                other => panic!("{other:?}"),
            }
        });
        assert!((velocity * wave / position - 1.0).abs() < 1e-14, "{mass}");
    }
    let mut motion = inflate(Scheme::TrBdf2);
    let fine = Tolerance::uniform(1e-13);
    assert!(motion.step_adaptive(&fine, 1.0).is_ok());
}

/// Ten steps of 0.1 end at 1 - 1e-16, three at 0.3 + 6e-17: both are the end of a run.
#[test]
fn a_run_to_a_time_reached_to_rounding_makes_no_step() {
    for (steps, end) in [(10, 1.0), (3, 0.3)] {
        let mut motion = inflate(Scheme::TrBdf2);
        let dt = TimeStep::Fixed(0.1);
        motion.run(dt, &[Stop::Steps(2)]).unwrap();
        motion.run(dt, &[Stop::Steps(steps - 2)]).unwrap();
        assert!(motion.time() != end && (motion.time() / end - 1.0).abs() < 1e-15);
        assert_eq!(motion.run(dt, &[Stop::Time(end)]), Ok(0));
        assert_eq!(motion.work().steps, steps);
    }
}
