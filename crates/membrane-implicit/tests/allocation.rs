//! A step allocates nothing.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::alloc::System;

use membrane_implicit::membrane_newton::{Rubber, StrainEnergy, Thickness};
use membrane_implicit::{
    Body, Load, LoadState, Membrane, Motion, ReferenceShape, Scheme, Stop, TimeStep, Tolerance,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn body(radius: f64) -> Body {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
    Body::springs(&membrane, 201)
        .unwrap()
        .with_damping(1.0)
        .unwrap()
}

#[track_caller]
fn assert_allocates_nothing(label: &str, mut work: impl FnMut()) {
    // The test harness occasionally allocates in its own thread; a step that allocates does so every time.
    let clean = (0..5).any(|_| {
        let region = Region::new(ALLOCATOR);
        work();
        let change = region.change();
        (change.allocations, change.reallocations) == (0, 0)
    });
    assert!(clean, "{label} allocates");
}

// A single test: the counter applies to the process, and tests run concurrently.
#[test]
fn steps_allocate_nothing() {
    let mut points = vec![[0.0; 2]; 201];
    let mut velocities = points.clone();
    for scheme in [
        Scheme::Splitting2,
        Scheme::Splitting6,
        Scheme::ImplicitSplitting2,
        Scheme::SemiImplicitEuler,
        Scheme::Midpoint,
        Scheme::TrBdf2,
    ] {
        for kind in ["intensity", "total force", "volume", "feedback", "pair"] {
            let splits = matches!(
                scheme,
                Scheme::Splitting2 | Scheme::Splitting6 | Scheme::ImplicitSplitting2
            );
            if splits && matches!(kind, "volume" | "pair" | "feedback") {
                continue;
            }
            let inner = body(1.75);
            let pump = Load::volume_gain(&inner, |t| 0.3 * (1.0 - (6.0 * t).cos()));
            let mut motion = match kind {
                "intensity" => Motion::new(inner, Load::intensity(|_| 17.5), scheme),
                "total force" => Motion::new(inner, Load::total_force(|_| 2588.9), scheme),
                "volume" => Motion::new(inner, pump, scheme),
                "feedback" => {
                    let answer = |now: &LoadState| 17.5 - 1e-3 * now.volume_rate;
                    Motion::new(inner, Load::feedback(answer), scheme)
                }
                _ => Motion::pair(inner, body(2.75), pump, scheme),
            }
            .unwrap();
            let label = format!("{scheme:?} {kind}");
            let dt = 2e-3;
            assert_allocates_nothing(&label, || {
                motion.run(TimeStep::Fixed(dt), &[Stop::Steps(20)]).unwrap();
                let adaptive = scheme != Scheme::Splitting6;
                for _ in 0..if adaptive { 5 } else { 0 } {
                    motion
                        .step_adaptive(&Tolerance::uniform(1e-3), 1e-3)
                        .unwrap();
                }
                let middle = motion.time() - 1e-9;
                motion
                    .at_into(middle, &mut points, &mut velocities)
                    .unwrap();
            });
        }
    }
    let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap()).with_rubber(latex);
    let rubber = Body::rubber(&balloon, 101, 1.0).unwrap();
    let start = rubber.start_volume();
    for load in [
        Load::intensity(|t| 0.1 * t),
        Load::volume(move |t| start + 20.0 * t * t),
    ] {
        let mut motion = Motion::new(rubber.clone(), load, Scheme::Midpoint).unwrap();
        assert_allocates_nothing("rubber", || {
            motion
                .run(TimeStep::Fixed(0.01), &[Stop::Steps(5)])
                .unwrap();
        });
    }
    // the counter works
    let region = Region::new(ALLOCATOR);
    points = vec![[1.0; 2]; points.len()];
    assert!(region.change().allocations == 1 && points[0][0] == 1.0);
}
