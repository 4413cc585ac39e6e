//! Trajectories: the published reference, and the order of every scheme.

use crate::common;

use common::{RunWith, apart, apex, balloon, inflate, reference_body, runge_kutta};
use membrane_implicit::DiscreteMembrane;
use membrane_implicit::{
    Body, ImplicitError, Load, Measure, Membrane, MembraneError, Motion, PressureLaw,
    ReferenceShape, Scheme, Stiffness, Stop, TimeStep, Tolerance, Work,
};

/// Independent method of lines at N = 101 with an explicit scheme of order 8, rtol 1e-11: apex and
/// volume at t = 0.5 and t = 2.
const REFERENCE: [(f64, f64, f64); 2] = [
    (0.5, 10.839353069994, 193.8640169874),
    (2.0, 10.674236910228, 126.3119350064),
];

#[test]
fn reference_trajectory_is_reached() {
    let mut motion = inflate(Scheme::TrBdf2);
    let mut previous: Option<[f64; 4]> = None;
    for dt in [2e-4, 1e-4] {
        motion = inflate(Scheme::TrBdf2);
        let mut found = Vec::new();
        for (time, _, _) in REFERENCE {
            motion
                .run(TimeStep::Fixed(dt), &[Stop::Time(time)])
                .unwrap();
            found.extend([apex(&motion), motion.state().volume()]);
        }
        let found: [f64; 4] = found.try_into().unwrap();
        if let Some(coarse) = previous {
            // order 2: the limit is found + (found - coarse) / 3
            let expected = REFERENCE.map(|(_, x, v)| [x, v]);
            for (k, expected) in expected.as_flattened().iter().enumerate() {
                let limit = found[k] + (found[k] - coarse[k]) / 3.0;
                println!(
                    "{k}: {limit:.12} against {expected}, plain {:e}",
                    found[k] - expected
                );
                // the rtol of the reference, 1e-11, over about 1e3 steps
                assert!(
                    (limit / expected - 1.0).abs() < 2e-9,
                    "{k}: {limit} {expected}"
                );
            }
        }
        previous = Some(found);
    }
    assert_eq!(motion.time(), 2.0);
}

/// Largest distance over the nodes between a run and a much finer one.
fn errors(scheme: Scheme, steps: &[usize], end: f64, truth: &[[f64; 2]]) -> Vec<f64> {
    steps
        .iter()
        .map(|&n| {
            let mut motion = inflate(scheme);
            motion
                .run(TimeStep::Fixed(end / n as f64), &[Stop::Time(end)])
                .unwrap();
            let points = motion.state().points;
            let pairs = points.iter().zip(truth);
            pairs
                .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                .fold(0.0, f64::max)
        })
        .collect()
}

#[test]
fn every_scheme_converges_with_its_order() {
    let end = 0.5;
    // the reference: TR-BDF2, extrapolated from 4 000 and 8 000 steps
    let run = |n: usize| {
        let mut motion = inflate(Scheme::TrBdf2);
        motion
            .run(TimeStep::Fixed(end / n as f64), &[Stop::Time(end)])
            .unwrap();
        motion.state().points.to_vec()
    };
    let (coarse, fine) = (run(4_000), run(8_000));
    let truth: Vec<[f64; 2]> = coarse
        .iter()
        .zip(&fine)
        .map(|(c, f)| [f[0] + (f[0] - c[0]) / 3.0, f[1] + (f[1] - c[1]) / 3.0])
        .collect();
    for (scheme, steps) in [
        (Scheme::SemiImplicitEuler, [16_000, 32_000]),
        (Scheme::Splitting2, [400, 800]),
        (Scheme::Splitting6, [40, 80]),
        (Scheme::ImplicitSplitting2, [500, 1_000]),
        (Scheme::Midpoint, [500, 1_000]),
        (Scheme::TrBdf2, [500, 1_000]),
    ] {
        let e = errors(scheme, &steps, end, &truth);
        let slope = (e[0] / e[1]).log2();
        println!("{scheme:?}: errors {e:?}, slope {slope:.3}");
        assert!(
            (slope - scheme.order() as f64).abs() < 0.2,
            "{scheme:?}: {e:?} slope {slope}"
        );
    }
}

#[test]
fn adaptive_steps_have_errors_near_the_tolerance() {
    let (time, x, v) = REFERENCE[1];
    for scheme in [
        Scheme::TrBdf2,
        Scheme::Midpoint,
        Scheme::Splitting2,
        Scheme::ImplicitSplitting2,
    ] {
        let mut last = f64::INFINITY;
        for tolerance in [1e-4, 1e-6, 1e-8] {
            let mut motion = inflate(scheme);
            motion
                .run(
                    TimeStep::Adaptive(Tolerance::uniform(tolerance)),
                    &[Stop::Time(time)],
                )
                .unwrap();
            let error = (apex(&motion) - x)
                .abs()
                .max((motion.state().volume() / v - 1.0).abs());
            println!("{scheme:?} {tolerance:e}: {error:e}, {:?}", motion.work());
            assert_eq!(motion.time(), time);
            // errors of the steps add up, and an error of the velocity causes one of the position
            assert!(
                error < 300.0 * tolerance && (error < last || error < 1e-7),
                "{scheme:?} {tolerance}: {error:e}"
            );
            last = error;
        }
    }
}

#[test]
fn dense_output_has_the_accuracy_of_the_steps() {
    // fourth order between steps: halving them reduces the error by 16 against the steps of the same scheme
    let mut worst = Vec::new();
    for n in [200, 400] {
        let dt = 0.5 / n as f64;
        let (mut motion, mut fine) = (inflate(Scheme::TrBdf2), inflate(Scheme::TrBdf2));
        let mut points = vec![[0.0; 2]; 101];
        let mut velocities = points.clone();
        let mut error = 0.0f64;
        let mut half = Vec::new();
        fine.run_with(TimeStep::Fixed(6.25e-5), &[Stop::Time(0.5)], |m| {
            half.push((m.time(), m.state().points.to_vec()));
        })
        .unwrap();
        motion
            .run_with(TimeStep::Fixed(dt), &[Stop::Time(0.5)], |m| {
                let time = m.time() - 0.5 * dt;
                let Some((_, truth)) = half.iter().find(|(t, _)| (t - time).abs() < 1e-9) else {
                    return;
                };
                m.at_into(time, &mut points, &mut velocities).unwrap();
                for (a, b) in points.iter().zip(truth) {
                    error = error.max((a[0] - b[0]).hypot(a[1] - b[1]));
                }
            })
            .unwrap();
        worst.push(error);
        let before = motion.at_into(0.0, &mut points, &mut velocities);
        assert!(
            matches!(
                before,
                Err(ImplicitError::Membrane(MembraneError::OutOfRange {
                    what: "time",
                    given: 0.0,
                    ..
                }))
            ),
            "{before:?}"
        );
    }
    let slope = (worst[0] / worst[1]).log2();
    println!("{worst:?} slope {slope}");
    // only the scheme's own error, of order 2, remains
    assert!(slope > 1.8, "{worst:?}");
}

/// Under the law per current length equations of springs are linear, and steps of equal length have one matrix. Every iteration and every end of a
/// step evaluates the pressure, and so does the start.
#[test]
fn work_is_counted() {
    let membrane = balloon().with_law(PressureLaw::PerCurrentLength);
    let body = Body::springs(&membrane, 21).unwrap();
    let steps = 7;
    for (scheme, factorisations, per_step) in [
        (Scheme::SemiImplicitEuler, steps, 1),
        (Scheme::TrBdf2, 1, 2),
        (Scheme::Midpoint, 1, 2),
        (Scheme::ImplicitSplitting2, 1, 1),
        (Scheme::Splitting2, 0, 1),
        (Scheme::Splitting6, 0, 11),
    ] {
        let load = Load::intensity(|_| 1.5);
        let mut motion = Motion::new(body.clone(), load, scheme).unwrap();
        motion
            .run(TimeStep::Fixed(0.01), &[Stop::Steps(steps)])
            .unwrap();
        let work = motion.work();
        let by_iterations =
            |work: Work, factorisations| work.iterations + factorisations + per_step * steps + 1;
        assert_eq!(work.force_calls, by_iterations(work, 0), "{scheme:?}");
        assert_eq!((work.steps, work.rejected), (steps, 0));
        assert_eq!(work.factorisations, factorisations, "{scheme:?}");
        if !matches!(scheme, Scheme::TrBdf2 | Scheme::Midpoint) {
            continue;
        }
        // under a volume each factorisation evaluates it, too; a pair starts its inner membrane twice
        let load = Load::intensity(|_| 1.5);
        let wide = Membrane::new(ReferenceShape::balloon(8.5, 2.75).unwrap());
        let wide = wide.with_law(PressureLaw::PerCurrentLength);
        let outer = Body::springs(&wide, 21).unwrap();
        let mut pair = Motion::pair(body.clone(), outer, load, scheme).unwrap();
        pair.run(TimeStep::Fixed(0.01), &[Stop::Steps(steps)])
            .unwrap();
        let mut other = pair.work();
        other.iterations -= work.iterations;
        other.factorisations -= work.factorisations;
        other.force_calls -= work.force_calls;
        assert!(other.iterations > steps && other.factorisations > 0);
        assert_eq!(
            other.force_calls,
            by_iterations(other, other.factorisations) + 1
        );
    }
}

/// A set state is not the end of a step: no shape precedes it.
#[test]
fn a_set_state_has_no_previous_step() {
    let moved = inflate(Scheme::TrBdf2).state().points.to_vec();
    let mut velocities = vec![[0.0; 2]; 101];
    let set = inflate(Scheme::TrBdf2).with_state(2.0, &moved, &velocities);
    let (set, mut points) = (set.unwrap(), vec![[0.0; 2]; 101]);
    set.at_into(2.0, &mut points, &mut velocities).unwrap();
    assert_eq!(points, moved);
    let lists = |n: usize| vec![[0.0; 2]; n];
    for (what, n, m, given) in [("points", 100, 101, 100), ("velocities", 101, 102, 102)] {
        let refused = set.at_into(2.0, &mut lists(n), &mut lists(m));
        let expected = 101;
        let length = ImplicitError::Membrane(MembraneError::WrongLength {
            what,
            given,
            expected,
        });
        assert_eq!(refused, Err(length));
    }
    let before = set.at_into(1.0, &mut points, &mut velocities);
    assert_eq!(
        before,
        Err(ImplicitError::Membrane(MembraneError::OutOfRange {
            what: "time",
            given: 1.0,
            least: 2.0,
            most: 2.0
        }))
    );
}

#[test]
fn pumped_volume_converges_with_order_two() {
    let run = |n: usize| {
        let body = reference_body();
        let load = Load::volume_gain(&body, |t| 0.3 * (1.0 - (3.0 * t).cos()));
        let mut motion = Motion::new(body, load, Scheme::TrBdf2).unwrap();
        motion
            .run(TimeStep::Fixed(1.0 / n as f64), &[Stop::Time(1.0)])
            .unwrap();
        let rest = Measure::Volume.of(motion.body().differences().start().as_chunks().0);
        let volume = rest * (1.0 + 0.3 * (1.0 - 3.0f64.cos()));
        assert!((motion.state().volume() / volume - 1.0).abs() < 1e-12);
        (motion.state().points.to_vec(), motion.state().intensity)
    };
    let [a, b, c] = [1_000, 2_000, 4_000].map(run);
    let distance = |p: &[[f64; 2]], q: &[[f64; 2]]| {
        p.iter()
            .zip(q)
            .map(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1]))
            .fold(0.0, f64::max)
    };
    let slope = (distance(&a.0, &b.0) / distance(&b.0, &c.0)).log2();
    let pressure = ((a.1 - b.1) / (b.1 - c.1)).abs().log2();
    println!(
        "shape {slope}, pressure {pressure}: {} {} {}",
        a.1, b.1, c.1
    );
    assert!((slope - 2.0).abs() < 0.2, "{slope}");
}

/// A stiffness that varies in time, against the equations integrated by the classical Runge-Kutta scheme.
#[test]
fn a_stiffness_in_time_converges_with_order_two() {
    let (nodes, end) = (21, 0.5);
    let stiffness = |t: f64| 2.0 - (5.0 * t).cos();
    let body = || Body::springs(&balloon(), nodes).unwrap();
    let (rest, ds) = (
        body().differences().start().to_vec(),
        body().differences().ds(),
    );
    let n = rest.len();
    let slope = |t: f64, y: &[f64]| -> Vec<f64> {
        let (c, v) = y.split_at(n);
        let mut acceleration = vec![0.0; n];
        for i in 1..nodes - 1 {
            let d = [c[2 * i + 2] - c[2 * i - 2], c[2 * i + 3] - c[2 * i - 1]];
            let unit = 12.0 / d[0].hypot(d[1]);
            for k in 0..2 {
                let u = |m: usize| c[2 * m + k] - rest[2 * m + k];
                let pull = u(i + 1) - 2.0 * u(i) + u(i - 1);
                let push = [-unit * d[1], unit * d[0]][k];
                acceleration[2 * i + k] = stiffness(t) * pull / (ds * ds) + push - v[2 * i + k];
            }
        }
        [v, &acceleration].concat()
    };
    let exact = runge_kutta([&rest[..], &vec![0.0; n]].concat(), end, 4000, slope);
    for scheme in [Scheme::Midpoint, Scheme::TrBdf2, Scheme::ImplicitSplitting2] {
        let error = |steps: u32| {
            let body = body().with_damping(1.0).unwrap();
            let mut motion = Motion::new(body, Load::intensity(|_| 12.0), scheme).unwrap();
            let dt = end / f64::from(steps);
            for _ in 0..steps {
                let middle = stiffness(motion.time() + 0.5 * dt);
                motion
                    .set_stiffness(Stiffness::constant(middle).unwrap())
                    .unwrap();
                motion.step(dt).unwrap();
            }
            let energy = motion.energy();
            assert!(energy.imbalance().abs() < 1e-9 * energy.pressure_work);
            assert_eq!(motion.work().steps, steps as usize);
            apart(motion.state().points, exact[..n].as_chunks().0)
        };
        let (coarse, fine) = (error(100), error(200));
        let order = (coarse / fine).log2();
        assert!(
            (order - 2.0).abs() < 0.2,
            "{scheme:?}: {coarse:e}, {fine:e}"
        );
    }
}
