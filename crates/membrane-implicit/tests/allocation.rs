//! Inside a step nothing is allocated.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::alloc::System;

use membrane_implicit::{
    Drive, Jacobian, Membrane, Moment, Motion, MovingMembrane, RestShape, Scheme, Stop, TimeStep,
    Tolerance,
};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn body(radius: f64) -> MovingMembrane {
    let membrane = Membrane::new(RestShape::balloon(8.5, radius).unwrap());
    MovingMembrane::new(&membrane, 201)
        .unwrap()
        .with_damping(1.0)
        .unwrap()
}

#[track_caller]
fn assert_allocates_nothing(label: &str, mut work: impl FnMut()) {
    // The test harness allocates in its own thread now and then; a step that does, does so always.
    let clean = (0..5).any(|_| {
        let region = Region::new(ALLOCATOR);
        work();
        let change = region.change();
        (change.allocations, change.reallocations) == (0, 0)
    });
    assert!(clean, "{label} allocates");
}

// One test: the counter is the process's, and tests run side by side.
#[test]
fn steps_allocate_nothing() {
    let mut points = vec![[0.0; 2]; 201];
    let mut velocities = points.clone();
    for scheme in [
        Scheme::ForwardEuler,
        Scheme::RungeKutta4,
        Scheme::Splitting2,
        Scheme::Splitting6,
        Scheme::ImplicitSplitting2,
        Scheme::SemiImplicitEuler,
        Scheme::BackwardEuler,
        Scheme::Trapezoidal,
        Scheme::TrBdf2,
    ] {
        for kind in ["intensity", "total force", "volume", "feedback", "pair"] {
            let explicit = matches!(scheme, Scheme::ForwardEuler | Scheme::RungeKutta4);
            let splits = matches!(
                scheme,
                Scheme::Splitting2 | Scheme::Splitting6 | Scheme::ImplicitSplitting2
            );
            if ((explicit || splits) && matches!(kind, "volume" | "pair"))
                || (splits && kind == "feedback")
            {
                continue;
            }
            let inner = body(1.75);
            let pump = Drive::volume_gain(&inner, |t| 0.3 * (1.0 - (6.0 * t).cos()));
            let mut motion = match kind {
                "intensity" => Motion::new(inner, Drive::intensity(|_| 17.5), scheme),
                "total force" => Motion::new(inner, Drive::total_force(|_| 2588.9), scheme),
                "volume" => Motion::new(inner, pump, scheme),
                "feedback" => {
                    let answer = |now: &Moment| 17.5 - 1e-3 * now.volume_rate;
                    Motion::new(inner, Drive::feedback(answer), scheme)
                }
                _ => Motion::pair(inner, body(2.75), pump, scheme),
            }
            .unwrap();
            let label = format!("{scheme:?} {kind}");
            let dt = if scheme == Scheme::ForwardEuler {
                1e-5
            } else {
                2e-3
            };
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
    let mut motion = Motion::new(
        body(1.75),
        Drive::total_force(|_| 2588.9),
        Scheme::SemiImplicitEuler,
    )
    .unwrap()
    .with_jacobian(Jacobian::Differences { refresh_every: 3 })
    .unwrap();
    assert_allocates_nothing("differences", || {
        motion
            .run(TimeStep::Fixed(2.0), &[Stop::Steps(20)])
            .unwrap();
    });
    // the counter itself counts
    let region = Region::new(ALLOCATOR);
    points = vec![[1.0; 2]; points.len()];
    assert!(region.change().allocations == 1 && points[0][0] == 1.0);
}
