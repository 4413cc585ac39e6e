//! Every public constructor and run returns a typed error for bad input.

use crate::common;

use common::{balloon, inflate, reference_body};
use membrane_implicit::membrane_newton::{
    Control, Discretisation, NewtonError, NewtonOptions, Rubber, Solver, StrainEnergy, Thickness,
};
use membrane_implicit::{
    Body, EvolvingOptions, ImplicitError, Load, LoadState, Membrane, MembraneError, Motion,
    PressureLaw, ReferenceShape, Scheme, Stop, TimeStep, Tolerance, evolve,
};

const BAD: [f64; 4] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0];

fn is_range<T: std::fmt::Debug>(result: Result<T, ImplicitError>) -> bool {
    matches!(
        result,
        Err(ImplicitError::Membrane(MembraneError::OutOfRange { .. }))
    )
}

#[test]
fn bodies() {
    assert_eq!(reference_body().with_mass(2.5).unwrap().mass(), 2.5);
    assert!(matches!(
        Body::springs(&balloon(), 2),
        Err(ImplicitError::Membrane(_))
    ));
    for bad in BAD.into_iter().chain([0.0]) {
        assert!(is_range(reference_body().with_mass(bad)), "{bad}");
    }
    for bad in BAD {
        assert!(is_range(reference_body().with_damping(bad)), "{bad}");
    }
}

/// Bounds that every finite number meets are not printed, nor numbers with three hundred digits.
#[test]
fn messages_are_short() {
    let said = |step: f64| inflate(Scheme::TrBdf2).step(step).unwrap_err().to_string();
    assert_eq!(
        said(-1e300),
        "time step is -1e300; it must be finite and positive"
    );
    let (longest, unstable) = (reference_body().largest_explicit_step(), 1.0);
    let said = (inflate(Scheme::Splitting2).step(unstable)).unwrap_err();
    let said = said.to_string();
    let expected = "time step of an explicit scheme is 1.0; it must be positive and at most 0.0";
    assert!(said.starts_with(expected) && longest < 0.011, "{said}");
    let damped = reference_body().with_damping(-0.5).unwrap_err();
    let expected = "damping is -0.5; it must be finite and not negative";
    assert_eq!(damped.to_string(), expected);
    let body = Body::springs(
        &membrane_implicit::Membrane::new(
            membrane_implicit::ReferenceShape::balloon(1e200, 1e199).unwrap(),
        ),
        5,
    );
    let expected = "reference position is 2.5e199; it must be between -1e100 and 1e100";
    assert_eq!(body.unwrap_err().to_string()[..17], expected[..17]);
}

#[test]
fn steps_and_runs() {
    for bad in BAD.into_iter().chain([0.0]) {
        let mut motion = inflate(Scheme::TrBdf2);
        assert!(is_range(motion.step(bad)), "{bad}");
        assert!(
            is_range(motion.run(TimeStep::Fixed(bad), &[Stop::Time(1.0)])),
            "{bad}"
        );
        let tolerance = TimeStep::Adaptive(Tolerance::uniform(bad));
        assert!(is_range(motion.run(tolerance, &[Stop::Time(1.0)])), "{bad}");
        assert!(
            is_range(motion.step_adaptive(&Tolerance::uniform(bad), 1.0)),
            "{bad}"
        );
        let longest = Tolerance {
            longest: bad,
            ..Tolerance::uniform(1e-3)
        };
        if bad != f64::INFINITY {
            assert!(
                is_range(motion.step_adaptive(&Tolerance::uniform(1e-3), bad)),
                "{bad}"
            );
            assert!(is_range(motion.step_adaptive(&longest, 1.0)), "{bad}");
        }
        if bad != 0.0 {
            assert!(
                is_range(motion.run(TimeStep::Fixed(0.1), &[Stop::Time(bad)])),
                "{bad}"
            );
        }
        assert!(
            is_range(motion.run(TimeStep::Fixed(0.1), &[Stop::Time(1.0), Stop::Volume(bad)])),
            "{bad}"
        );
        assert_eq!(motion.time(), 0.0);
    }
    let adaptive = inflate(Scheme::Splitting6).step_adaptive(&Tolerance::uniform(1e-3), 1.0);
    let unsupported = |scheme, what| Some(ImplicitError::Unsupported { scheme, what });
    assert_eq!(
        adaptive.err(),
        unsupported(Scheme::Splitting6, "adaptive steps")
    );
    let mut motion = inflate(Scheme::TrBdf2);
    let none = motion.run(TimeStep::Fixed(0.1), &[]).unwrap_err();
    assert_eq!(
        none.to_string(),
        "no stops are given; a run needs at least one"
    );
    let nan = Stop::Equilibrium {
        force: f64::NAN,
        speed: 1.0,
    };
    assert!(is_range(
        motion.run(TimeStep::Fixed(0.1), &[nan, Stop::Steps(1)])
    ));
}

#[test]
fn loads() {
    let nan = Load::intensity(|_| f64::NAN);
    let made = Motion::new(reference_body(), nan, Scheme::TrBdf2);
    assert!(matches!(
        made,
        Err(ImplicitError::BadLoad { time: 0.0, .. })
    ));
    let later = Load::intensity(|t| if t > 0.5 { f64::INFINITY } else { 1.0 });
    let mut motion = Motion::new(reference_body(), later, Scheme::TrBdf2).unwrap();
    let run = motion.run(TimeStep::Fixed(0.2), &[Stop::Time(1.0)]);
    assert!(matches!(run, Err(ImplicitError::BadLoad { .. })));
    assert!(
        (motion.time() - 0.4).abs() < 1e-12,
        "the state before the failed step"
    );
    let other = Motion::new(reference_body(), Load::volume(|_| 50.0), Scheme::TrBdf2);
    assert!(matches!(
        other,
        Err(ImplicitError::VolumeMismatch {
            prescribed: 50.0,
            ..
        })
    ));
    let body = reference_body();
    let empty = Load::volume_gain(&body, |t| -2.0 * t);
    let mut motion = Motion::new(body, empty, Scheme::TrBdf2).unwrap();
    let run = motion.run(TimeStep::Fixed(0.6), &[Stop::Time(1.0)]);
    assert!(
        matches!(run, Err(ImplicitError::BadLoad { given, .. }) if given < 0.0),
        "a volume that runs out: {run:?}"
    );
    for scheme in [
        Scheme::Splitting2,
        Scheme::Splitting6,
        Scheme::ImplicitSplitting2,
    ] {
        let body = reference_body();
        let pump = Load::volume_gain(&body, |_| 0.0);
        assert_eq!(
            Motion::new(body, pump, scheme).err(),
            Some(ImplicitError::Unsupported {
                scheme,
                what: "a prescribed volume"
            })
        );
    }
}

#[test]
fn pairs_and_states() {
    // the outer membrane must enclose the inner one
    let pair = Motion::pair(
        reference_body(),
        reference_body(),
        Load::intensity(|_| 1.0),
        Scheme::TrBdf2,
    );
    let volume = inflate(Scheme::TrBdf2).state().volume();
    let refused = NewtonError::NotEnclosed {
        what: "volume in cm^3",
        inner: volume,
        outer: volume,
    };
    assert_eq!(pair.err(), Some(ImplicitError::Pair(refused)));
    let balloon = |h: f64, radius: f64| Membrane::new(ReferenceShape::balloon(h, radius).unwrap());
    let springs = |membrane: &Membrane| Body::springs(membrane, 31).unwrap();
    let rejected = |inner: Body, outer: Body| {
        let pair = Motion::pair(inner, outer, Load::intensity(|_| 0.0), Scheme::Midpoint);
        match pair.err() {
            Some(ImplicitError::Pair(error)) => error,
            other => panic!("{other:?}"),
        }
    };
    let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 400.0 }, Thickness::UNIT).unwrap();
    let latex = Body::rubber(&balloon(8.5, 2.75).with_rubber(latex), 31, 1e-4).unwrap();
    let by_length = balloon(8.5, 2.75).with_law(PressureLaw::PerCurrentLength);
    for outer in [latex, springs(&by_length)] {
        let error = rejected(springs(&balloon(8.5, 1.75)), outer);
        assert!(matches!(error, NewtonError::MixedPair { .. }), "{error}");
    }
    let error = rejected(springs(&balloon(3.0, 2.9)), springs(&balloon(10.0, 2.75)));
    let (what, inner, outer) = ("distance of the end from the axis in cm", 2.9, 2.75);
    assert_eq!(error, NewtonError::NotEnclosed { what, inner, outer });
    let error = rejected(springs(&balloon(8.5, 1.75)), springs(&balloon(6.0, 2.75)));
    let said = "the largest x in cm of the inner membrane is 10.25, of the outer one 8.75: the outer one must enclose the inner one";
    assert_eq!(error.to_string(), said);
    let points = vec![[0.0; 2]; 100];
    let state = inflate(Scheme::TrBdf2).with_state(0.0, &points, &points);
    let expected = ImplicitError::Membrane(MembraneError::WrongLength {
        what: "points",
        given: 100,
        expected: 101,
    });
    assert_eq!(state.err(), Some(expected));
    let mut points = inflate(Scheme::TrBdf2).state().points.to_vec();
    let zero = vec![[0.0; 2]; 101];
    points[3][1] = f64::NAN;
    assert!(is_range(
        inflate(Scheme::TrBdf2).with_state(0.0, &points, &zero)
    ));
    let outer = membrane_implicit::Membrane::new(
        membrane_implicit::ReferenceShape::balloon(8.5, 2.75).unwrap(),
    );
    let outer = Body::springs(&outer, 101).unwrap();
    let load = Load::intensity(|_| 1.0);
    let pair = Motion::pair(reference_body(), outer, load, Scheme::TrBdf2).unwrap();
    let state = pair.with_state(0.0, &zero, &zero);
    assert_eq!(state.err(), Some(ImplicitError::StateOfPair));
    let state = inflate(Scheme::TrBdf2).with_state(0.0, &zero, &zero);
    let expected = ImplicitError::FixedNode {
        node: 0,
        given: [0.0; 2],
        fixed: [0.0, 1.75],
    };
    assert_eq!(state.err(), Some(expected));
    // all others at one position: no normal
    let mut folded = zero.clone();
    (folded[0], folded[100]) = ([0.0, 1.75], [0.0, -1.75]);
    let state = inflate(Scheme::TrBdf2).with_state(0.0, &folded, &zero);
    assert!(matches!(state, Err(ImplicitError::Forces { .. })));
}

/// A pump that empties a membrane of springs pulls its walls through each other; membrane-newton rejects this equilibrium, too.
#[test]
fn intersecting_walls_are_an_error() {
    for scheme in [Scheme::TrBdf2, Scheme::SemiImplicitEuler, Scheme::Midpoint] {
        let load = Load::volume_gain(&reference_body(), |t| -0.9999 * t * t);
        let mut motion = Motion::new(reference_body(), load, scheme).unwrap();
        let run = motion.run(TimeStep::Fixed(0.01), &[Stop::Time(1.0)]);
        let error = run.unwrap_err();
        let found = match error {
            ImplicitError::Collapsed { time, s } => (0.5..1.0).contains(&time) && s < 0.5,
            _ => false,
        };
        assert!(found, "{error}");
        let mut upper = motion.state().points[..50].iter();
        assert!(upper.all(|point| point[1] > 0.0));
    }
}

/// Under the total-force law a load is F, as for `Control::Load`; an intensity of this value would be too large by the surface.
#[test]
fn an_intensity_under_the_total_force_law_is_rejected() {
    let membrane = balloon().with_law(PressureLaw::TotalForce);
    let body = || Body::springs(&membrane, 21).unwrap();
    let motion = |load| Motion::new(body(), load, Scheme::TrBdf2);
    for load in [
        Load::intensity(|_| 1500.0),
        Load::feedback(|_: &LoadState| 1.0),
    ] {
        let error = motion(load.clone()).unwrap_err();
        let message = error.to_string();
        assert!(
            matches!(error, ImplicitError::Unsupported { .. }),
            "{message}"
        );
        assert!(
            message.contains("whose load is Load::total_force"),
            "{message}"
        );
        let mut moving = motion(Load::total_force(|_| 1500.0)).unwrap();
        assert_eq!(moving.set_load(load).unwrap_err(), error);
    }
    let mut total = motion(Load::total_force(|_| 1500.0)).unwrap();
    let settled = Stop::Equilibrium {
        force: 1e-8,
        speed: 1e-8,
    };
    let stops = [settled, Stop::Steps(1000)];
    assert_eq!(total.run(TimeStep::Fixed(1e3), &stops).unwrap(), 0);
    let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes: 21 }).unwrap();
    let options = NewtonOptions::default();
    let direct = solver.solve(Control::Load(1500.0), &options).unwrap();
    assert!((total.state().volume() / direct.measures.volume - 1.0).abs() < 1e-8);
    assert!(motion(Load::volume_gain(&body(), |t| t * t)).is_ok());
}

#[test]
fn a_pump_with_an_initial_flow_is_rejected_by_the_midpoint_rule() {
    type Gain = fn(f64) -> f64;
    for nodes in [5, 51, 401] {
        let body = Body::springs(&balloon(), nodes).unwrap();
        let motion =
            |gain: Gain, scheme| Motion::new(body.clone(), Load::volume_gain(&body, gain), scheme);
        let volume = body.start_volume();
        let flow: [(Gain, f64); 3] = [
            (|t| 0.3 * (6.0 * t).sin(), 1.8),
            (|t| 1e-3 * t, 1e-3),
            (
                |t| 0.3 * (1.0 - (6.8 * t + 0.1).cos() - 4.995_834_721_974_179e-3),
                0.3 * 6.8 * 0.1f64.sin(),
            ),
        ];
        for (gain, rate) in flow {
            let error = motion(gain, Scheme::Midpoint).unwrap_err();
            let ImplicitError::VolumeRateMismatch {
                prescribed,
                actual,
                time,
            } = error
            else {
                panic!("{error}")
            };
            assert!(
                (prescribed / (rate * volume) - 1.0).abs() < 1e-5,
                "{prescribed} {rate}"
            );
            assert_eq!((time, actual), (0.0, 0.0));
            assert!(motion(gain, Scheme::TrBdf2).is_ok());
        }
        let smooth: [Gain; 4] = [
            |t| 0.3 * (1.0 - (6.8 * t).cos()),
            |t| 0.3 * (1.0 - (50.0 * t).cos()),
            |t| 10.0 * t * t * t,
            |_| 0.0,
        ];
        for gain in smooth {
            assert!(motion(gain, Scheme::Midpoint).is_ok(), "{nodes}");
        }
    }
    // a hundred-thousandth of the volume per time of a wave
    for mass in [1e-4, 1.0, 1e4] {
        let body = Body::springs(&balloon(), 51).unwrap();
        let body = body.with_mass(mass).unwrap();
        let wave = 51.0 * body.largest_explicit_step();
        let motion = |part: f64| {
            let load = Load::volume_gain(&body, move |t| part * 1e-5 * t / wave);
            Motion::new(body.clone(), load, Scheme::Midpoint)
        };
        assert!(motion(0.9).is_ok() && motion(1.1).is_err(), "{mass}");
    }
}

#[test]
fn evolving_method() {
    let run = |options: EvolvingOptions, force: f64| evolve(&balloon(), 51, force, &options);
    for bad in BAD.into_iter().chain([0.0]) {
        assert!(
            is_range(run(EvolvingOptions::default().with_dt(bad), 1.0)),
            "{bad}"
        );
        assert!(
            is_range(run(EvolvingOptions::default().with_mass(bad), 1.0)),
            "{bad}"
        );
    }
    for bad in BAD {
        assert!(
            is_range(run(EvolvingOptions::default().with_damping(bad), 1.0)),
            "{bad}"
        );
        assert!(
            is_range(run(EvolvingOptions::default().with_tolerance(bad), 1.0)),
            "{bad}"
        );
        if bad != -1.0 {
            assert!(is_range(run(EvolvingOptions::default(), bad)), "{bad}");
        }
    }
    // forces whose squares overflow
    for force in [1e100, 1e150, 1e200, 1e300, f64::MAX, -1e300] {
        match run(EvolvingOptions::default(), force) {
            Ok(end) => assert!(end.norms.iter().all(|norm| norm.is_finite()), "{force}"),
            Err(_) => assert!(force.abs() >= 1e100),
        }
    }
    assert!(is_range(run(EvolvingOptions::default(), 1e300)));
    // no load: the initial state is an equilibrium, after no step
    let still = run(EvolvingOptions::default(), 0.0).unwrap();
    assert!(still.steps == 0 && still.residual() == 0.0);
    // an empty list has no stop
    let mut emptied = still;
    emptied.norms.clear();
    assert!(emptied.residual().is_nan() && emptied.is_monotone());
}
