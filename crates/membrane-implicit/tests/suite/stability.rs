//! Steps far beyond the explicit limit, stiffnesses and dampings of any size.
//!
//! `MEMBRANE_STEPS` sets the number of steps of the long runs (default 2 000; the full count is
//! 1 000 000).

use crate::common;

use std::error::Error;

use common::{RunWith, balloon};
use membrane_implicit::membrane_newton::NewtonError;
use membrane_implicit::{
    Body, ImplicitError, Load, Membrane, MembraneError, Motion, PressureLaw, ReferenceShape,
    Scheme, Stiffness, Stop, TimeStep,
};

fn long_run() -> usize {
    std::env::var("MEMBRANE_STEPS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(2_000)
}

const IMPLICIT: [Scheme; 3] = [Scheme::SemiImplicitEuler, Scheme::Midpoint, Scheme::TrBdf2];

#[test]
fn any_step_stiffness_and_damping_stays_finite() {
    for scheme in IMPLICIT {
        for lambda in [1.0, 1e6, 1e12] {
            for mu in [0.0, 1.0, 1e6] {
                for multiple in [1.0, 1e3, 1e6] {
                    let membrane = balloon().with_stiffness(Stiffness::constant(lambda).unwrap());
                    let body = Body::springs(&membrane, 21)
                        .unwrap()
                        .with_damping(mu)
                        .unwrap();
                    let dt = multiple * body.largest_explicit_step();
                    let load = 17.5 * lambda;
                    let mut motion =
                        Motion::new(body, Load::intensity(move |_| load), scheme).unwrap();
                    for step in 0..long_run() {
                        if let Err(error) = motion.step(dt) {
                            panic!(
                                "{scheme:?} lambda {lambda:e} mu {mu:e} dt {dt:e} step {step}: {error}"
                            );
                        }
                    }
                    let far = motion
                        .state()
                        .points
                        .as_flattened()
                        .iter()
                        .fold(0.0, |m: f64, x| m.max(x.abs()));
                    // the equilibrium reaches 10.9 cm; an undamped wave overshoots it
                    assert!(
                        far < 100.0,
                        "{scheme:?} lambda {lambda:e} mu {mu:e} dt {dt:e}: {far}"
                    );
                }
            }
        }
    }
}

#[test]
fn midpoint_rules_conserve_the_energy_of_the_linear_membrane() {
    let schemes = [Scheme::Midpoint, Scheme::ImplicitSplitting2];
    for (lambda, scheme) in schemes.iter().flat_map(|s| [(1.0, *s), (1e12, *s)]) {
        for multiple in [0.1, 10.0, 1e6] {
            let membrane = balloon()
                .with_stiffness(Stiffness::constant(lambda).unwrap())
                .with_second_neighbours(Stiffness::constant(0.1 * lambda).unwrap());
            let body = Body::springs(&membrane, 41).unwrap();
            let dt = multiple * body.largest_explicit_step();
            let mut motion = Motion::new(body, Load::intensity(|_| 0.0), scheme).unwrap();
            let points: Vec<[f64; 2]> = motion
                .state()
                .points
                .iter()
                .enumerate()
                .map(|(n, p)| {
                    let s = n as f64 / 40.0;
                    [
                        p[0] + (3.0 * s).sin() * s * (1.0 - s),
                        p[1] + 0.3 * (std::f64::consts::PI * s).sin(),
                    ]
                })
                .collect();
            let velocities: Vec<[f64; 2]> = (0..41)
                .map(|n| [lambda.sqrt() * (n as f64).sin(), 0.0])
                .collect();
            motion = motion.with_state(0.0, &points, &velocities).unwrap();
            let before = motion.energy().kinetic + motion.energy().elastic;
            let mut worst = 0.0f64;
            motion
                .run_with(TimeStep::Fixed(dt), &[Stop::Steps(long_run())], |m| {
                    if m.work().steps.is_multiple_of(97) {
                        let energy = m.energy();
                        worst = worst.max(((energy.kinetic + energy.elastic) / before - 1.0).abs());
                    }
                })
                .unwrap();
            println!(
                "{scheme:?}, lambda {lambda:e}, {multiple:e} times the explicit step: {worst:e}"
            );
            assert!(
                worst < 1e-9,
                "{scheme:?}, lambda {lambda:e}, {multiple:e}: {worst:e}"
            );
        }
    }
}

/// The highest mode, which alternates from node to node, has a constant amplitude up to the documented step of explicit schemes; a longer step
/// is rejected at once, by a run and by a single step.
#[test]
fn explicit_schemes_are_stable_as_far_as_documented() {
    for (scheme, limit) in [(Scheme::Splitting2, 1.0), (Scheme::Splitting6, 1.57)] {
        let body = Body::springs(&balloon(), 41).unwrap();
        let longest = limit * body.largest_explicit_step();
        let motion = Motion::new(body, Load::intensity(|_| 0.0), scheme).unwrap();
        let points = motion.state().points.to_vec();
        let alternating = |n: usize| [if n.is_multiple_of(2) { 1e-6 } else { -1e-6 }, 0.0];
        let velocities: Vec<[f64; 2]> = (0..41).map(alternating).collect();
        let mut motion = motion.with_state(0.0, &points, &velocities).unwrap();
        for share in [1.02, 2.5, 1e100] {
            let dt = share * longest;
            let errors = [
                motion.step(dt).unwrap_err(),
                motion
                    .run(TimeStep::Fixed(dt), &[Stop::Steps(10)])
                    .unwrap_err(),
            ];
            for error in errors {
                assert!(
                    matches!(error, ImplicitError::Membrane(MembraneError::OutOfRange { given, most, .. })
                        if given == dt && (most / longest - 1.0).abs() < 1e-9),
                    "{scheme:?}: {error:?}"
                );
            }
            assert_eq!(motion.work().steps, 0);
        }
        let before = motion.energy().initial;
        let mut most = 0.0f64;
        for _ in 0..300 {
            motion.step(0.995 * longest).unwrap();
            most = most.max(motion.energy().kinetic / before);
        }
        assert!(most < 100.0, "{scheme:?}: {most}");
    }
}

/// A pressure above that of every equilibrium moves the membrane to infinity, and a long step with an explicit pressure diverges. After every
/// accepted step volume, flow, energy and norms are finite; then an error contains step, time and the diverging quantity, and the state before
/// it is kept.
#[test]
fn divergence_is_an_error_before_overflow() {
    let law = PressureLaw::PerCurrentLength;
    let resolved = [
        Scheme::Splitting2,
        Scheme::Splitting6,
        Scheme::ImplicitSplitting2,
    ]
    .map(|scheme| (scheme, vec![0.015]));
    let long = (
        Scheme::ImplicitSplitting2,
        vec![0.1, 1.0, 1e10, 1e60, 1e100],
    );
    for (scheme, steps) in resolved.into_iter().chain([long]) {
        for dt in steps {
            let body = Body::springs(&balloon().with_law(law), 51).unwrap();
            let load = Load::intensity(|_| 17.5);
            let mut motion = Motion::new(body, load, scheme).unwrap();
            let case = format!("{scheme:?} {dt:e}");
            let mut ran_away = None;
            for step in 1..5000 {
                let (time, before) = (motion.time(), motion.state().points.to_vec());
                if let Err(error) = motion.step(dt) {
                    assert_eq!(motion.time(), time, "{case}");
                    assert_eq!(motion.state().points, before, "{case}");
                    ran_away = Some((step, time, error));
                    break;
                }
                let (force, speed) = motion.norms().unwrap();
                let (state, energy) = (motion.state(), motion.energy());
                let numbers = [
                    force,
                    speed,
                    state.volume(),
                    state.volume_rate(),
                    state.intensity,
                    energy.kinetic,
                    energy.elastic,
                    energy.pressure_work,
                    energy.damping_loss,
                    energy.numerical_loss,
                ];
                assert!(numbers.iter().all(|v| v.is_finite()), "{case}, step {step}");
                // the longest chord of a curve within the bound
                let size = state
                    .points
                    .as_flattened()
                    .iter()
                    .fold(0.0, |m: f64, v| m.max(v.abs()));
                assert!(size <= 1e100, "{case}, step {step}: {size:e}");
            }
            match ran_away {
                Some((
                    wanted,
                    start,
                    ImplicitError::Unstable {
                        step,
                        time,
                        dt: by,
                        node,
                        value,
                        what,
                    },
                )) => {
                    assert_eq!((step, time, by), (wanted, start, dt), "{case}");
                    assert!(
                        node < 51 && (value.is_nan() || value.abs() >= 1e98),
                        "{case}: {what} {value:e}"
                    );
                }
                other => panic!("{case}: {other:?}"),
            }
        }
    }
}

/// A curve whose volume overflows is rejected before it moves.
#[test]
fn a_curve_whose_volume_overflows_is_rejected() {
    let huge = Membrane::new(ReferenceShape::balloon(1e101, 1e101).unwrap());
    let refused = Body::springs(&huge, 11).err();
    assert!(matches!(
        refused,
        Some(ImplicitError::Membrane(MembraneError::OutOfRange {
            most: 1e100,
            ..
        }))
    ));
    let motion = common::inflate(Scheme::TrBdf2);
    let mut points = motion.state().points.to_vec();
    points[3][0] = 1e101;
    let velocities = vec![[0.0; 2]; 101];
    let refused = motion.clone().with_state(0.0, &points, &velocities).err();
    assert!(matches!(
        refused,
        Some(ImplicitError::Membrane(MembraneError::OutOfRange {
            most: 1e100,
            ..
        }))
    ));
}

/// The cause of an error is its source, and the chain contains each message once.
#[test]
fn causes_are_reachable_and_reported_once() {
    let few = Body::springs(&balloon(), 2).unwrap_err();
    let source = few.source().map(ToString::to_string);
    let (what, given, least) = ("nodes", 2, 3);
    let expected = MembraneError::TooFew { what, given, least };
    assert_eq!(source, None);
    assert_eq!(few, ImplicitError::Membrane(expected));
    assert_eq!(few.to_string(), "nodes: 2 given, at least 3 needed");
    let motion = common::inflate(Scheme::TrBdf2);
    let velocities = vec![[0.0; 2]; 101];
    let mut points = velocities.clone();
    (points[0], points[100]) = ([0.0, 1.75], [0.0, -1.75]);
    let folded = motion.with_state(0.5, &points, &velocities);
    let folded = folded.unwrap_err();
    let said = "no forces at t = 0.5: nodes coincide, or rubber is stretched beyond its limit";
    assert_eq!(folded.to_string(), said);
    let source = folded.source().and_then(|source| source.downcast_ref());
    assert!(matches!(
        source,
        Some(MembraneError::CoincidentPoints { .. })
    ));
    let (row, pivot) = (3, 0.0);
    let singular = NewtonError::Singular { row, pivot };
    let (time, dt, error) = (0.5, 0.1, singular.clone());
    let stuck = ImplicitError::Step { time, dt, error };
    let source = stuck.source().and_then(|source| source.downcast_ref());
    assert_eq!(source, Some(&singular));
    assert!(!stuck.to_string().contains("singular"));
}
