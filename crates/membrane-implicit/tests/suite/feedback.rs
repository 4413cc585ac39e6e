//! Loads that depend on the state, and observers that end a run.

use crate::common;

use std::ops::ControlFlow;

use common::{RunWith, balloon, reference_body, runge_kutta};
use membrane_implicit::DiscreteMembrane;
use membrane_implicit::membrane_newton::membrane_forces::FiniteDifferences;
use membrane_implicit::membrane_newton::{Control, Discretisation, NewtonOptions, Solver};
use membrane_implicit::{
    Body, EvolvingOptions, Feedback, ImplicitError, Load, LoadState, Measure, Membrane, Motion,
    PressureLaw, ReferenceShape, Scheme, Stiffness, Stop, TimeStep, Tolerance, evolve,
    evolve_observed,
};

const IMPLICIT: [Scheme; 3] = [Scheme::SemiImplicitEuler, Scheme::Midpoint, Scheme::TrBdf2];

/// A pressure that increases with the volume, with the quadratic loss of a valve.
fn outlet(now: &LoadState) -> f64 {
    let flow = now.volume_rate;
    12.0 + 3.0 * now.time.sin() + 0.04 * (now.volume - 93.0) - 2e-4 * flow * (50.0 + flow.abs())
}

/// A body of 40 nodes, whose waves are slow enough for coarse steps.
fn body() -> Body {
    Body::springs(&balloon(), 41)
        .unwrap()
        .with_damping(1.0)
        .unwrap()
}

fn outlet_motion(scheme: Scheme) -> Motion {
    Motion::new(body(), Load::feedback(outlet), scheme).unwrap()
}

/// The classical Runge-Kutta scheme on m c'' = F_e + P n - mu c', m = mu = 1, implemented here from the forces only.
fn reference(end: f64, steps: usize) -> Vec<f64> {
    let forces = FiniteDifferences::new(&balloon(), 41).unwrap();
    let n = forces.start().len();
    let mut volume_gradient = vec![0.0; n];
    let slope = |time: f64, state: &[f64]| {
        let (c, v) = state.split_at(n);
        let (mut elastic, mut pressure) = (vec![0.0; n], vec![0.0; n]);
        forces.elastic_force_into(c, &mut elastic);
        forces.measure_gradient_into(Measure::Volume, c, &mut volume_gradient);
        let now = LoadState {
            time,
            volume: forces.measure(Measure::Volume, c).unwrap(),
            volume_rate: volume_gradient.iter().zip(v).map(|(g, v)| g * v).sum(),
        };
        forces
            .pressure_force_into(c, outlet(&now), &mut pressure)
            .unwrap();
        let mut out = v.to_vec();
        out.extend((0..n).map(|i| elastic[i] + pressure[i] - v[i]));
        out
    };
    let mut state = forces.start().to_vec();
    state.resize(2 * n, 0.0);
    let mut state = runge_kutta(state, end, steps, slope);
    state.truncate(n);
    state
}

/// Every scheme converges to that reference with its order: the pressure is that of the current state, not of the previous one.
#[test]
fn a_feedback_receives_the_current_state() {
    let end = 0.5;
    let truth = reference(end, 4000);
    for (scheme, steps) in [
        (Scheme::SemiImplicitEuler, 1000),
        (Scheme::Midpoint, 100),
        (Scheme::TrBdf2, 100),
    ] {
        let error = [steps, 2 * steps].map(|steps| {
            let mut motion = outlet_motion(scheme);
            let dt = end / f64::from(steps);
            motion.run(TimeStep::Fixed(dt), &[Stop::Time(end)]).unwrap();
            let found = motion.state().points.as_flattened();
            let apart = found.iter().zip(&truth).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max)
        });
        let order = (error[0] / error[1]).log2();
        println!("{scheme:?}: {error:?}, order {order}");
        // Orders are accurate to about a tenth before the waves are fully resolved; a lower order differs by 1.0.
        assert!(
            (order - scheme.order() as f64).abs() < 0.3,
            "{scheme:?}: {order}"
        );
        assert!(error[1] < 1e-3, "{scheme:?}: {error:?}");
    }
}

#[test]
fn pressure_and_state_are_consistent() {
    for scheme in IMPLICIT {
        let mut motion = outlet_motion(scheme);
        let steps = TimeStep::Fixed(0.01);
        motion
            .run_with(steps, &[Stop::Steps(60)], |motion| {
                let (state, time) = (motion.state(), motion.time());
                let now = LoadState {
                    time,
                    volume: state.volume(),
                    volume_rate: state.volume_rate(),
                };
                // The stages are solved to rounding of a position, which the flow amplifies by 1 / dt and the gradient of the volume, some
                // 50 cm^2: 1e-16 20 50 / 0.01 = 1e-11 of a pressure of 10.
                let apart = (state.intensity - outlet(&now)).abs();
                assert!(apart < 1e-10, "{scheme:?} at {time}: {apart:e}");
            })
            .unwrap();
        let energy = motion.energy();
        let balance = energy.imbalance().abs() / energy.pressure_work;
        assert!(balance < 1e-9, "{scheme:?}: {balance:e}");
    }
}

/// After damping, V and f are the equilibrium that Newton computes for the volume.
#[test]
fn a_feedback_converges_to_the_equilibrium_of_newton() {
    let hook = |now: &LoadState| 30.0 - 0.1 * now.volume - 0.01 * now.volume_rate;
    let mut motion = Motion::new(reference_body(), Load::feedback(hook), Scheme::TrBdf2).unwrap();
    let (force, speed) = (1e-9, 1e-9);
    let settled = Stop::Equilibrium { force, speed };
    let stop = motion.run(TimeStep::Fixed(1.0), &[settled, Stop::Steps(500)]);
    assert_eq!(stop, Ok(0));
    let (nodes, volume) = (101, motion.state().volume());
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes }).unwrap();
    let solved = solver.solve(Control::Volume(volume), &NewtonOptions::default());
    let intensity = solved.unwrap().intensity;
    // forces balance to 1e-9, of a stiffness of order one
    assert!((intensity - motion.state().intensity).abs() < 1e-7);
    assert!((intensity - (30.0 - 0.1 * volume)).abs() < 1e-7);
}

/// A load that depends only on time equals that function of time.
#[test]
fn a_feedback_may_ignore_the_state() {
    for scheme in IMPLICIT {
        let run = |load| {
            let mut motion = Motion::new(body(), load, scheme).unwrap();
            motion
                .run(TimeStep::Fixed(0.01), &[Stop::Steps(50)])
                .unwrap();
            motion.state().points.as_flattened().to_vec()
        };
        let seen = run(Load::feedback(|now: &LoadState| 15.0 + now.time));
        let told = run(Load::intensity(|time| 15.0 + time));
        let apart = seen.iter().zip(&told).map(|(a, b)| (a - b).abs());
        // both are solved to the rounding of 20 cm
        assert!(apart.fold(0.0, f64::max) < 1e-12, "{scheme:?}");
    }
}

/// The vessel C p' = -V' - p / R, integrated over the steps with the weight `theta` of their ends.
#[derive(Clone)]
struct Vessel {
    theta: f64,
    pressure: f64,
    last: Option<LoadState>,
}

impl Feedback for Vessel {
    fn intensity(&self, now: &LoadState) -> f64 {
        let Some(last) = self.last else {
            return self.pressure;
        };
        let (c, leak) = (100.0, 100.0 * (now.time - last.time));
        let kept = c - (1.0 - self.theta) * leak;
        (kept * self.pressure + last.volume - now.volume) / (c + self.theta * leak)
    }

    fn accepted(&mut self, now: &LoadState) {
        self.pressure = self.intensity(now);
        self.last = Some(*now);
    }
}

/// The rule of a model with memory limits the order: 2 by the trapezoidal rule (as in the example `windkessel`), 1 by backward Euler.
#[test]
fn a_model_with_memory_limits_the_order() {
    let membrane = balloon().with_law(PressureLaw::PerCurrentLength);
    for scheme in [Scheme::TrBdf2, Scheme::Midpoint] {
        for (theta, range) in [(0.5, 1.8..2.2), (1.0, 0.9..1.6)] {
            let volume = |steps: u32| {
                let (pressure, last) = (0.4, None);
                let load = Load::feedback(Vessel {
                    theta,
                    pressure,
                    last,
                });
                let body = Body::springs(&membrane, 21).unwrap();
                let body = body.with_damping(1.0).unwrap();
                let mut motion = Motion::new(body, load, scheme).unwrap();
                let dt = TimeStep::Fixed(1.0 / f64::from(steps));
                motion.run(dt, &[Stop::Time(1.0)]).unwrap();
                // in this law the intensity is the pressure
                assert_eq!(motion.state().pressure(), motion.state().intensity);
                motion.state().volume()
            };
            let [a, b, c] = [200, 400, 800].map(volume);
            let order = ((a - b) / (b - c)).abs().log2();
            println!("{scheme:?}, {theta}: {a} {b} {c}, order {order}");
            // that of backward Euler decreases to 1 as the second-order part vanishes
            assert!(range.contains(&order), "{scheme:?}: {order}");
        }
    }
}

/// Under a law of force per unit s the pressure is the intensity over the length of the curve; at rest it equals that of Newton's method.
#[test]
fn a_state_returns_its_pressure() {
    let mut motion = common::inflate(Scheme::TrBdf2);
    let (force, speed) = (1e-9, 1e-9);
    let settled = Stop::Equilibrium { force, speed };
    let stops = [settled, Stop::Steps(500)];
    motion.run(TimeStep::Fixed(1.0), &stops).unwrap();
    let nodes = 101;
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes }).unwrap();
    let solved = solver.solve(Control::Load(17.5), &NewtonOptions::default());
    let expected = solved.unwrap().pressure();
    let pressure = motion.state().pressure();
    assert!((pressure / expected - 1.0).abs() < 1e-8 && pressure < 1.0);
}

/// A valve: the slope of the pressure jumps where the flow changes sign.
#[test]
fn a_feedback_may_have_a_kink() {
    let valve = |now: &LoadState| {
        let pushed = 16.0 + 12.0 * (9.0 * now.time).sin();
        pushed - if now.volume_rate > 0.0 { 0.005 } else { 0.2 } * now.volume_rate
    };
    for scheme in [Scheme::SemiImplicitEuler, Scheme::TrBdf2] {
        for steps in [
            TimeStep::Fixed(0.02),
            TimeStep::Adaptive(Tolerance::uniform(1e-2)),
        ] {
            let mut motion = Motion::new(body(), Load::feedback(valve), scheme).unwrap();
            let mut turns = 0;
            let mut before = 0.0;
            motion
                .run_with(steps, &[Stop::Time(3.0)], |motion| {
                    let rate = motion.state().volume_rate();
                    turns += usize::from(rate * before < 0.0);
                    before = rate;
                })
                .unwrap();
            assert!(turns > 4, "{scheme:?}: {turns}");
        }
    }
}

#[test]
fn a_pair_under_feedback_preserves_its_wall_volume() {
    let outer = Membrane::new(ReferenceShape::balloon(8.5, 2.75).unwrap());
    let outer = Body::springs(&outer, 41).unwrap();
    let load = Load::feedback(outlet);
    let mut pair = Motion::pair(body(), outer, load, Scheme::TrBdf2).unwrap();
    let mut wall = 0.0f64;
    pair.run_with(TimeStep::Fixed(0.01), &[Stop::Time(0.5)], |pair| {
        wall = wall.max(pair.wall_volume_error().unwrap().abs());
    })
    .unwrap();
    // each volume is constant to rounding
    assert!(wall < 1e-12, "{wall:e}");
}

/// The memory of a model, and the number of its updates.
#[derive(Debug, Clone, Default)]
struct Diary {
    told: Vec<LoadState>,
    wanted: f64,
}

impl Feedback for Diary {
    fn intensity(&self, now: &LoadState) -> f64 {
        // no step begins before the last one that was accepted
        assert!(now.time >= self.told.last().map_or(0.0, |last| last.time));
        if self.told.len() > 40 {
            return self.wanted;
        }
        17.0
    }

    fn accepted(&mut self, now: &LoadState) {
        assert!(self.told.last().is_none_or(|last| now.time > last.time));
        self.told.push(*now);
    }
}

/// A model receives each accepted state once, those of rejected steps never; a copy of the motion has its own memory.
#[test]
fn a_model_may_have_memory() {
    // jumps to another load after forty states, so that an adaptive step is rejected
    let diary = Diary {
        wanted: 60.0,
        ..Diary::default()
    };
    let mut motion = Motion::new(body(), Load::feedback(diary), Scheme::TrBdf2).unwrap();
    let tolerance = Tolerance::uniform(1e-4);
    let steps = TimeStep::Adaptive(tolerance);
    motion.run(steps, &[Stop::Steps(38)]).unwrap();
    let mut copy = motion.clone();
    motion.run(steps, &[Stop::Steps(30)]).unwrap();
    assert!(motion.work().rejected > 0, "{:?}", motion.work());
    copy.set_stiffness(Stiffness::UNIT).unwrap();
    // with a common memory the copy would already be beyond the jump
    copy.run(steps, &[Stop::Steps(1)]).unwrap();
    assert_eq!(copy.state().intensity, 17.0);
    assert_eq!(motion.state().intensity, 60.0);
}

#[test]
fn unsupported_uses_of_feedback_are_errors() {
    for scheme in [
        Scheme::Splitting2,
        Scheme::ImplicitSplitting2,
        Scheme::Splitting6,
    ] {
        let refused = Motion::new(body(), Load::feedback(outlet), scheme).err();
        let what = "a load that depends on the state";
        assert_eq!(refused, Some(ImplicitError::Unsupported { scheme, what }));
    }
    let hole = |now: &LoadState| if now.time > 0.25 { f64::NAN } else { 17.0 };
    for scheme in IMPLICIT {
        let mut motion = Motion::new(body(), Load::feedback(hole), scheme).unwrap();
        let run = motion.run(TimeStep::Fixed(0.1), &[Stop::Time(1.0)]);
        let time = motion.time();
        assert!(matches!(run, Err(ImplicitError::BadLoad { .. })), "{run:?}");
        assert!((time - 0.2).abs() < 1e-12, "the state before the step");
    }
}

/// The value with which the observer breaks is returned at that step.
#[test]
fn an_observer_ends_a_run() {
    let mut motion = outlet_motion(Scheme::TrBdf2);
    let stops = [Stop::Time(1.0)];
    let steps = TimeStep::Fixed(0.01);
    let ended = motion.run_observed(steps, &stops, |motion| match motion.work().steps {
        7 => ControlFlow::Break("seven"),
        _ => ControlFlow::Continue(()),
    });
    assert_eq!(ended, Ok(ControlFlow::Break("seven")));
    assert!((motion.time() - 0.07).abs() < 1e-12 && motion.work().steps == 7);
    let never = |_: &Motion| ControlFlow::<()>::Continue(());
    assert_eq!(
        motion.run_observed(steps, &stops, never),
        Ok(ControlFlow::Continue(0))
    );
    assert_eq!(motion.time(), 1.0);

    let options = EvolvingOptions::default();
    let whole = evolve(&balloon(), 51, 2500.0, &options).unwrap();
    let mut seen = Vec::new();
    let cut = evolve_observed(&balloon(), 51, 2500.0, &options, |step, norm| {
        seen.push((step, norm));
        if step == 3 {
            ControlFlow::Break("three")
        } else {
            ControlFlow::Continue(())
        }
    })
    .unwrap();
    assert_eq!(cut, ControlFlow::Break("three"));
    let expected: Vec<_> = whole.norms[..4].iter().copied().enumerate().collect();
    assert_eq!(seen, expected);
}

/// A model whose call of some number panics.
#[derive(Clone)]
struct Interrupted(std::sync::Arc<std::sync::atomic::AtomicUsize>);

impl Feedback for Interrupted {
    fn intensity(&self, now: &LoadState) -> f64 {
        let left = self.0.fetch_sub(1, std::sync::atomic::Ordering::Relaxed);
        assert!(left != 1, "interrupted");
        outlet(now)
    }
}

/// After a panic of the user's model the motion is in the state before the step, and continues from it.
#[test]
fn a_panic_of_a_feedback_leaves_the_state_before_the_step() {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::{Arc, atomic::AtomicUsize, atomic::Ordering};
    for scheme in IMPLICIT {
        let calls = Arc::new(AtomicUsize::new(usize::MAX));
        let load = Load::feedback(Interrupted(calls.clone()));
        let mut motion = Motion::new(body(), load, scheme).unwrap();
        let mut undisturbed = outlet_motion(scheme);
        let mut interrupted = 0;
        for call in 1..40 {
            let before = motion.state().points.to_vec();
            calls.store(1 + call % 8, Ordering::Relaxed);
            if catch_unwind(AssertUnwindSafe(|| motion.step(0.01))).is_err() {
                interrupted += 1;
                assert_eq!(motion.state().points, before);
                calls.store(usize::MAX, Ordering::Relaxed);
                motion.step(0.01).unwrap();
            }
            undisturbed.step(0.01).unwrap();
        }
        let pairs = motion.state().points.iter().zip(undisturbed.state().points);
        let off = pairs.map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()));
        let off = off.fold(0.0, f64::max);
        println!("{scheme:?}: {interrupted} {off:e}");
        assert!(
            interrupted > 5 && off < 1e-9,
            "{scheme:?}: {interrupted} {off:e}"
        );
    }
}
