//! The static limit: a motion ends at the equilibrium of Newton's method.
//!
//! `PROPTEST_CASES` sets the number of random problems (default 500).

use crate::common;

use common::balloon;
use membrane_implicit::membrane_newton::{Control, Discretisation, NewtonOptions, Pair, Solver};
use membrane_implicit::{
    Body, Load, Membrane, Motion, PressureLaw, ReferenceShape, Scheme, Stiffness, Stop, TimeStep,
};
use proptest::prelude::*;

#[derive(Debug, Clone)]
struct Problem {
    radius: f64,
    height: f64,
    nodes: usize,
    lambda: f64,
    waviness: f64,
    second: Option<f64>,
    law: PressureLaw,
    /// 0 intensity, 1 total force, 2 volume gain, 3 pair by gain, 4 pair by intensity
    control: usize,
    /// intensity over stiffness, or gain
    load: f64,
    scheme: Scheme,
}

fn problems() -> impl Strategy<Value = Problem> {
    let laws = prop_oneof![
        Just(PressureLaw::PerMaterialLength),
        Just(PressureLaw::TotalForce),
        Just(PressureLaw::PerCurrentLength),
    ];
    let schemes = prop_oneof![Just(Scheme::SemiImplicitEuler), Just(Scheme::TrBdf2),];
    let shape = (0.5f64..3.0, 2.0f64..10.0, 5usize..31);
    let springs = (-6.0f64..9.0, 0.0f64..0.9, prop::option::of(0.05f64..0.5));
    (shape, springs, laws, 0usize..5, 0.0f64..1.0, schemes).prop_map(
        |((radius, height, half), (exponent, waviness, second), law, control, load, scheme)| {
            Problem {
                radius,
                height,
                nodes: 2 * half + 1,
                lambda: 10f64.powf(exponent),
                waviness,
                second,
                law,
                control,
                load,
                scheme,
            }
        },
    )
}

fn membrane(p: &Problem, radius: f64) -> Membrane {
    let (lambda, waviness) = (p.lambda, p.waviness);
    let stiffness = Stiffness::function(
        move |s| lambda * (1.0 + waviness * (std::f64::consts::TAU * s).cos()),
        &[],
    )
    .unwrap();
    let mut membrane = Membrane::new(ReferenceShape::balloon(p.height, radius).unwrap())
        .with_stiffness(stiffness)
        .with_law(p.law);
    if let Some(second) = p.second {
        membrane = membrane.with_second_neighbours(Stiffness::constant(second * lambda).unwrap());
    }
    membrane
}

fn distance(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

fn check(p: &Problem) -> Result<(), TestCaseError> {
    let grid = Discretisation::FiniteDifferences { nodes: p.nodes };
    let (inner, outer) = (membrane(p, p.radius), membrane(p, p.radius + 1.0));
    let body = |m: &Membrane| {
        Body::springs(m, p.nodes)
            .unwrap()
            .with_damping(p.lambda.sqrt())
            .unwrap()
    };
    let solver = |m: &Membrane| Solver::new(m, grid).unwrap();
    // Loads that displace the membrane strongly, below the blow-up of the third law.
    let f = p.load
        * p.lambda
        * if p.law == PressureLaw::PerCurrentLength {
            0.3
        } else {
            20.0
        };
    let gain = 0.8 * p.load;
    let surface = solver(&inner).start_measures().surface;
    let total = f
        * surface
        * if p.law == PressureLaw::PerCurrentLength {
            0.7
        } else {
            1.0
        };
    let ramp = 2.0 / p.lambda.sqrt();
    let inner_body = body(&inner);
    let pump = Load::volume_gain(&inner_body, move |t| {
        let x = (t / ramp).clamp(0.0, 1.0);
        gain * x * x * (3.0 - 2.0 * x)
    });
    let (control, load) = match p.control {
        0 | 4 if p.law != PressureLaw::TotalForce => {
            (Control::Intensity(f), Load::intensity(move |_| f))
        }
        0 | 1 | 4 => (
            Control::TotalForce(total),
            Load::total_force(move |_| total),
        ),
        _ => (Control::VolumeGain(gain), pump),
    };
    let is_pair = p.control >= 3;
    let options = NewtonOptions::default().with_tolerances(1e-15, 1e-11);
    let (direct, direct_outer) = if is_pair {
        let pair = Pair::new(solver(&inner), solver(&outer))
            .unwrap()
            .solve(control, &options);
        let pair = pair.map_err(|e| TestCaseError::fail(format!("newton: {e}")))?;
        (pair.inner.points(), Some(pair.outer.points()))
    } else {
        let single = solver(&inner).solve(control, &options);
        (
            single
                .map_err(|e| TestCaseError::fail(format!("newton: {e}")))?
                .points(),
            None,
        )
    };
    let motion = if is_pair {
        Motion::pair(inner_body, body(&outer), load, p.scheme)
    } else {
        Motion::new(inner_body, load, p.scheme)
    };
    let mut motion = motion.map_err(|e| TestCaseError::fail(e.to_string()))?;
    motion
        .run(TimeStep::Fixed(ramp / 10.0), &[Stop::Time(ramp)])
        .map_err(|e| TestCaseError::fail(format!("ramp: {e}")))?;
    let size = p.lambda * 30.0;
    // Rounding of the forces is 1e-16 c/ds^2 of this; the limit of 1e-9 cm allows ten times more.
    let settled = Stop::Equilibrium {
        force: 1e-11 * size,
        speed: 1e-9 * p.lambda.sqrt(),
    };
    let stop = motion
        .run(TimeStep::Fixed(20.0 * ramp), &[settled, Stop::Steps(400)])
        .map_err(|e| TestCaseError::fail(format!("settling: {e}")))?;
    // near equilibrium each step reduces the error by at least a factor of ten
    motion
        .run(TimeStep::Fixed(20.0 * ramp), &[Stop::Steps(4)])
        .map_err(|e| TestCaseError::fail(format!("settled: {e}")))?;
    let inner_direct = direct;
    let apart = distance(motion.state().points, &inner_direct);
    prop_assert!(
        apart < 1e-9,
        "{apart:e} cm apart, stop {stop}, norms {:?}",
        motion.norms()
    );
    prop_assert_eq!(stop, 0);
    if let (Some(outer), Some(direct)) = (motion.outer(), direct_outer) {
        let apart = distance(outer.points, &direct);
        prop_assert!(
            apart < 1e-9,
            "outer {apart:e} cm apart, inner {:e}, wall {:?}",
            distance(motion.state().points, &inner_direct),
            motion.wall_volume_error()
        );
    }
    Ok(())
}

#[test]
fn motion_converges_to_the_equilibrium_of_newton() {
    let cases = std::env::var("PROPTEST_CASES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(500);
    let config = ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    proptest!(config, |(p in problems())| check(&p)?);
}

#[test]
fn adaptive_steps_grow_without_bound_near_equilibrium() {
    let body = Body::springs(&balloon(), 101)
        .unwrap()
        .with_damping(1.0)
        .unwrap();
    let mut motion = Motion::new(body, Load::intensity(|_| 17.5), Scheme::TrBdf2).unwrap();
    let tolerance = membrane_implicit::Tolerance::uniform(1e-5);
    let settled = Stop::Equilibrium {
        force: 1e-7,
        speed: 1e-7,
    };
    motion
        .run(
            TimeStep::Adaptive(tolerance),
            &[settled, Stop::Steps(20_000)],
        )
        .unwrap();
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 101 }).unwrap();
    let direct = solver
        .solve(Control::Intensity(17.5), &NewtonOptions::default())
        .unwrap();
    assert!(distance(motion.state().points, &direct.points()) < 1e-7);
    println!("{:?} at t = {}", motion.work(), motion.time());
    assert!(motion.work().steps < 3_000);
}

/// An initial state without load does not count as equilibrium: the first step precedes the first test.
#[test]
fn a_load_from_zero_does_not_stop_at_once() {
    let body = || {
        Body::springs(&balloon(), 51)
            .unwrap()
            .with_damping(1.0)
            .unwrap()
    };
    let settled = Stop::Equilibrium {
        force: 1e-6,
        speed: 1e-6,
    };
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 51 }).unwrap();
    let direct = solver
        .solve(Control::Intensity(17.5), &NewtonOptions::default())
        .unwrap();
    for steps in [
        TimeStep::Fixed(1.0),
        TimeStep::Adaptive(membrane_implicit::Tolerance::uniform(1e-4)),
    ] {
        let load = Load::intensity(|t| 17.5 * (1.0 - (-t).exp()));
        let mut motion = Motion::new(body(), load, Scheme::TrBdf2).unwrap();
        assert_eq!(motion.norms().unwrap(), (0.0, 0.0));
        // the others are tested before the first step
        for (stop, index) in [(Stop::Steps(0), 1), (Stop::Time(0.0), 1)] {
            assert_eq!(motion.run(steps, &[settled, stop]), Ok(index));
            assert_eq!(motion.work().steps, 0);
        }
        let ended = motion.run(steps, &[settled, Stop::Steps(5000)]);
        assert_eq!(ended, Ok(0), "{:?} at {}", motion.work(), motion.time());
        // forces balance to 1e-6; the smallest stiffness is of order one (pi^2 for half a wave)
        let apart = distance(motion.state().points, &direct.points());
        assert!(apart < 1e-6, "{apart:e}");
        // a motion in equilibrium needs one step of another run
        let before = motion.work().steps;
        assert_eq!(motion.run(steps, &[settled]), Ok(0));
        assert_eq!(motion.work().steps, before + 1);
    }
}

/// The kick and the midpoint rule cancel where the forces do: the shape of Newton's method is preserved.
#[test]
fn the_implicit_splitting_preserves_an_equilibrium() {
    let grid = Discretisation::FiniteDifferences { nodes: 101 };
    let solved = Solver::new(&balloon(), grid)
        .unwrap()
        .solve(Control::Load(17.5), &NewtonOptions::default())
        .unwrap();
    let body = Body::springs(&balloon(), 101).unwrap();
    let load = Load::intensity(|_| 17.5);
    let mut motion = Motion::new(body, load, Scheme::ImplicitSplitting2)
        .unwrap()
        .with_state(0.0, &solved.points(), &[[0.0; 2]; 101])
        .unwrap();
    // ten times the explicit limit
    motion
        .run(TimeStep::Fixed(0.1), &[Stop::Steps(1000)])
        .unwrap();
    let off = distance(motion.state().points, &solved.points());
    // no damping of motions caused by the rounding of forces, 1e-11
    println!("{off:e}");
    assert!(off < 1e-9, "{off:e}");
}
