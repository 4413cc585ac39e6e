//! Membranes in motion.

use membrane_implicit::membrane_newton::{Rubber, StrainEnergy, Thickness};
use membrane_implicit::{
    Body, DiscreteMembrane, Energy, EvolvingOptions, Load, LoadState, Membrane, Motion,
    PressureLaw, ReferenceShape, Scheme, Stiffness, Stop, TimeStep, Tolerance, evolve,
};
use tests::Random;

use crate::Row;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "membrane_implicit::Tolerance::position",
        what: "springs: local error of positions and of velocities in an adaptive step, each relative to its tolerance; the larger one",
        reference: "classical Runge-Kutta scheme with at most a twentieth of the stable time step of the leapfrog scheme",
        norm: "root mean square over the nodes",
        quick: 40,
        problem: |random| local_error(random, false),
    },
    Row {
        name: "membrane_implicit::Tolerance::velocity",
        what: "rubber: local error of positions and of velocities in an adaptive step, each relative to its tolerance; the larger one",
        reference: "classical Runge-Kutta scheme with at most a twentieth of the stable time step of the leapfrog scheme",
        norm: "root mean square over the nodes",
        quick: 20,
        problem: |random| local_error(random, true),
    },
    Row {
        name: "membrane_implicit::Stop::Volume",
        what: "volume at which the run stops; limit 1e-10",
        reference: "integral of y abs(y) dx along the polyline",
        norm: "relative",
        quick: 40,
        problem: volume_event,
    },
    Row {
        name: "membrane_implicit::Energy::imbalance",
        what: "energy balance; limit 1e-9",
        reference: "energies and losses, each by its own formula",
        norm: "relative to the sum of all terms",
        quick: 40,
        problem: |random| imbalance(random, false),
    },
    Row {
        name: "membrane_implicit::Energy::imbalance (feedback)",
        what: "energy balance under feedback; limit 1e-9",
        reference: "energies and losses, each by its own formula",
        norm: "relative to the sum of all terms",
        quick: 20,
        problem: |random| imbalance(random, true),
    },
    Row {
        name: "membrane_implicit::Motion::wall_volume_error",
        what: "stated relative change of the volume between two membranes; limit 1e-12",
        reference: "integrals of y abs(y) dx along the polylines",
        norm: "absolute",
        quick: 20,
        problem: wall_volume,
    },
    Row {
        name: "membrane_implicit::EvolvingOptions::tolerance",
        what: "norm of the forces at the end of the evolution, relative to that at its start",
        reference: "forces of springs and pressure by their formulas",
        norm: "L2 over s",
        quick: 20,
        problem: evolved,
    },
];

fn rest(random: &mut Random) -> ReferenceShape {
    ReferenceShape::balloon(random.uniform(3.0, 9.0), random.uniform(1.0, 2.5)).expect("a balloon")
}

/// Springs of a stiffness of order one, under a law whose load is an intensity.
fn springs(random: &mut Random) -> Membrane {
    let (mean, wave) = (random.decades(-0.5, 0.5), random.uniform(0.0, 0.6));
    let stiffness = move |s: f64| mean * (1.0 + wave * (5.0 * s).sin());
    Membrane::new(rest(random))
        .with_stiffness(Stiffness::function(stiffness, &[]).expect("a stiffness"))
        .with_law(random.pick(&[
            PressureLaw::PerMaterialLength,
            PressureLaw::PerCurrentLength,
        ]))
}

fn rubber(random: &mut Random) -> Membrane {
    let energy = random.pick(&[
        StrainEnergy::NeoHookean { mu: 1.0 },
        StrainEnergy::MooneyRivlin { c1: 0.4, c2: 0.1 },
    ]);
    let thickness = Thickness::constant(random.uniform(0.5, 2.0)).expect("a thickness");
    Membrane::new(rest(random)).with_rubber(Rubber::new(energy, thickness).expect("rubber"))
}

/// A body of few nodes and a pressure that moves it by about its radius.
fn body(random: &mut Random, of_rubber: bool) -> (Body, f64) {
    let nodes = random.integer(9, 41);
    let damping = random.uniform(0.0, 2.0);
    let (body, pressure) = if of_rubber {
        let density = random.decades(-1.0, 1.0);
        let membrane = rubber(random);
        (Body::rubber(&membrane, nodes, density), 0.15)
    } else {
        let membrane = springs(random);
        let per_length = membrane.law() == PressureLaw::PerCurrentLength;
        let body = Body::springs(&membrane, nodes);
        (body, if per_length { 1.0 } else { 10.0 })
    };
    let body = body.and_then(|body| body.with_damping(damping));
    (body.expect("a body"), pressure * random.uniform(0.2, 1.0))
}

/// A pressure of this size: sudden, rising or oscillating.
fn signal(random: &mut Random, size: f64) -> impl Fn(f64) -> f64 + Send + Sync + Clone + 'static {
    let (kind, rise) = (random.integer(0, 2), random.decades(-3.0, 0.0));
    let rate = random.uniform(1.0, 10.0);
    move |t: f64| match kind {
        0 => size,
        1 => size * (1.0 - (-t / rise).exp()),
        _ => size * (1.0 + 0.5 * (rate * t).sin()),
    }
}

/// The classical Runge-Kutta scheme on the equation of motion, from its forces alone; positions and velocities after `span`.
fn runge_kutta(
    body: &Body,
    pressure: &dyn Fn(f64) -> f64,
    (start, span): (f64, f64),
    state: (&[[f64; 2]], &[[f64; 2]]),
) -> Vec<f64> {
    let forces = body.differences();
    let n = forces.start().len();
    let (mut mass, mut damping) = (vec![body.mass(); n], vec![body.damping() / body.mass(); n]);
    let mut matrix = forces.tangent();
    if forces.add_mass_into(body.mass(), &mut matrix).is_ok() {
        matrix.mul_into(&vec![1.0; n], &mut mass);
        damping.fill(body.damping());
    }
    let slope = |time: f64, state: &[f64]| {
        let (c, v) = state.split_at(n);
        let (mut elastic, mut push) = (vec![0.0; n], vec![0.0; n]);
        forces.elastic_force_into(c, &mut elastic);
        forces
            .pressure_force_into(c, pressure(time), &mut push)
            .expect("forces");
        let mut out = v.to_vec();
        out.extend((0..n).map(|i| (elastic[i] + push[i]) / mass[i] - damping[i] * v[i]));
        for held in forces.fixed() {
            out[n + held] = 0.0;
        }
        out
    };
    let moved = |state: &[f64], slope: &[f64], by: f64| -> Vec<f64> {
        state.iter().zip(slope).map(|(x, k)| x + by * k).collect()
    };
    let mut x = [state.0.as_flattened(), state.1.as_flattened()].concat();
    let steps = (20.0 * span / body.largest_explicit_step()).ceil().max(4.0);
    let dt = span / steps;
    for step in 0..steps as usize {
        let time = start + step as f64 * dt;
        let k1 = slope(time, &x);
        let k2 = slope(time + 0.5 * dt, &moved(&x, &k1, 0.5 * dt));
        let k3 = slope(time + 0.5 * dt, &moved(&x, &k2, 0.5 * dt));
        let k4 = slope(time + dt, &moved(&x, &k3, dt));
        for i in 0..2 * n {
            x[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    x
}

fn local_error(random: &mut Random, of_rubber: bool) -> Option<f64> {
    let scheme = match of_rubber {
        true => Scheme::Midpoint,
        false => random.pick(&[
            Scheme::SemiImplicitEuler,
            Scheme::TrBdf2,
            Scheme::Midpoint,
            Scheme::ImplicitSplitting2,
            Scheme::Splitting2,
        ]),
    };
    let (body, size) = body(random, of_rubber);
    let pressure = signal(random, size);
    let mut motion =
        Motion::new(body.clone(), Load::intensity(pressure.clone()), scheme).expect("a motion");
    let tolerance = Tolerance {
        position: random.decades(-5.0, -2.0),
        velocity: random.decades(-5.0, -2.0),
        longest: 0.5,
    };
    // the first step, or a later one
    for _ in 0..random.pick(&[0, 0, 1, 2, 5, 20, 60]) {
        motion.step_adaptive(&tolerance, f64::INFINITY).ok()?;
    }
    let before = motion.clone();
    let dt = motion.step_adaptive(&tolerance, f64::INFINITY).ok()?;
    let state = before.state();
    let exact = runge_kutta(
        &body,
        &pressure,
        (state.time, dt),
        (state.points, state.velocities),
    );
    let (found, n) = (motion.state(), exact.len() / 2);
    let off = |found: &[[f64; 2]], exact: &[f64], tolerance: f64| {
        let pairs = found.as_flattened().iter().zip(exact);
        let sum: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
        (sum / found.len() as f64).sqrt() / tolerance
    };
    let by_position = off(found.points, &exact[..n], tolerance.position);
    Some(by_position.max(off(found.velocities, &exact[n..], tolerance.velocity)))
}

/// pi/2 times the integral of y |y| dx along the polyline, which covers the body once from end to end and half of it to the axis.
fn volume(points: &[[f64; 2]]) -> f64 {
    let cube = |y: f64| y.abs().powi(3);
    let segment = |p: &[[f64; 2]]| {
        let ([x0, a], [x1, b]) = (p[0], p[1]);
        let mean = if (b - a).abs() < 1e-3 * (a.abs() + b.abs()) {
            (a * a + a * b + b * b).copysign(a) / 3.0
        } else {
            (cube(b) - cube(a)) / (3.0 * (b - a))
        };
        0.5 * std::f64::consts::PI * (x1 - x0) * mean
    };
    let sum: f64 = points.windows(2).map(segment).sum();
    let whole = points[points.len() - 1][1] < -0.5 * points[0][1];
    if whole { sum } else { 2.0 * sum }
}

fn volume_event(random: &mut Random) -> Option<f64> {
    let of_rubber = random.one_in(3);
    let scheme = match of_rubber {
        true => Scheme::Midpoint,
        false => random.pick(&[Scheme::TrBdf2, Scheme::Midpoint, Scheme::SemiImplicitEuler]),
    };
    let (body, size) = body(random, of_rubber);
    let pressure = signal(random, size);
    let mut motion = Motion::new(body, Load::intensity(pressure), scheme).expect("a motion");
    let value = motion.state().volume() * random.uniform(1.01, 1.3);
    let steps = match random.one_in(2) {
        true => TimeStep::Fixed(random.decades(-3.0, -0.5)),
        false => TimeStep::Adaptive(Tolerance::uniform(random.decades(-5.0, -2.0))),
    };
    let stops = [Stop::Volume(value), Stop::Steps(2000)];
    match motion.run(steps, &stops).ok()? {
        0 => Some((volume(motion.state().points) / value - 1.0).abs() / 1e-10),
        _ => None,
    }
}

fn imbalance(random: &mut Random, feedback: bool) -> Option<f64> {
    let of_rubber = random.one_in(3);
    let (body, size) = body(random, of_rubber);
    let start = body.start_volume();
    let scheme = match (of_rubber, feedback) {
        (true, _) => Scheme::Midpoint,
        (false, true) => {
            random.pick(&[Scheme::TrBdf2, Scheme::Midpoint, Scheme::SemiImplicitEuler])
        }
        (false, false) => random.pick(&[
            Scheme::TrBdf2,
            Scheme::Midpoint,
            Scheme::SemiImplicitEuler,
            Scheme::ImplicitSplitting2,
            Scheme::Splitting2,
            Scheme::Splitting6,
        ]),
    };
    let load = if feedback {
        let stiff = random.uniform(0.0, 1.0) * size / start;
        Load::feedback(move |now: &LoadState| {
            size - stiff * (now.volume - start) - 0.05 * stiff * now.volume_rate
        })
    } else {
        Load::intensity(signal(random, size))
    };
    let explicit = body.largest_explicit_step();
    let dt = match scheme {
        Scheme::Splitting2 | Scheme::Splitting6 => random.uniform(0.1, 0.9) * explicit,
        _ => random.decades(-3.0, 0.0),
    };
    let mut motion = Motion::new(body, load, scheme).expect("a motion");
    motion.run(TimeStep::Fixed(dt), &[Stop::Steps(200)]).ok()?;
    let Energy {
        kinetic,
        elastic,
        pressure_work,
        damping_loss,
        numerical_loss,
        ..
    } = motion.energy();
    let sum = kinetic + elastic.abs() + pressure_work.abs() + damping_loss + numerical_loss.abs();
    Some(motion.energy().imbalance().abs() / (1e-9 * sum))
}

fn wall_volume(random: &mut Random) -> Option<f64> {
    let (height, radius) = (random.uniform(3.0, 9.0), random.uniform(1.0, 2.5));
    let nodes = 2 * random.integer(5, 30) + 1;
    let body = |radius: f64| {
        let rest = ReferenceShape::balloon(height, radius).expect("a balloon");
        let body = Body::springs(&Membrane::new(rest), nodes);
        body.and_then(|body| body.with_damping(1.0))
            .expect("a body")
    };
    let (inner, outer) = (body(radius), body(radius + random.uniform(0.5, 1.5)));
    let gain = random.uniform(0.05, 0.5);
    let pump = Load::volume_gain(&inner, move |t| gain * (1.0 - (3.0 * t).cos()));
    let scheme = random.pick(&[Scheme::TrBdf2, Scheme::Midpoint, Scheme::SemiImplicitEuler]);
    let mut pair = Motion::pair(inner, outer, pump, scheme).expect("a pair");
    let wall = |pair: &Motion| {
        let outer = pair.outer().expect("an outer membrane");
        volume(outer.points) - volume(pair.state().points)
    };
    let start = wall(&pair);
    let dt = random.decades(-3.0, -1.0);
    pair.run(TimeStep::Fixed(dt), &[Stop::Steps(50)]).ok()?;
    let stated = pair.wall_volume_error().expect("a wall");
    let exact = wall(&pair) / start - 1.0;
    Some((exact - stated).abs() / 1e-12)
}

fn evolved(random: &mut Random) -> Option<f64> {
    let (height, radius) = (random.uniform(3.0, 9.0), random.uniform(1.0, 2.5));
    let nodes = 2 * random.integer(10, 100) + 1;
    let membrane = Membrane::new(ReferenceShape::balloon(height, radius).expect("a balloon"));
    let tolerance = random.decades(-7.0, -2.0);
    let options = EvolvingOptions::default()
        .with_tolerance(tolerance)
        .with_dt(random.uniform(0.5, 5.0));
    let force = random.uniform(100.0, 3000.0);
    let run = evolve(&membrane, nodes, force, &options).ok()?;
    let rest = Body::springs(&membrane, nodes).expect("a body");
    let rest = rest.differences().start().as_chunks::<2>().0.to_vec();
    let relative = norm_of_forces(&run.points, &rest, force) / norm_of_forces(&rest, &rest, force);
    Some(relative / tolerance)
}

/// Norm of the forces of springs of stiffness 1, reference positions `rest`, under a total force at the nodes `c`.
fn norm_of_forces(c: &[[f64; 2]], rest: &[[f64; 2]], force: f64) -> f64 {
    let nodes = c.len();
    // lateral surface by frustums, over the whole curve by |y| and halved
    let surface: f64 = c
        .windows(2)
        .map(|p| {
            let slant = (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]);
            0.5 * std::f64::consts::PI * (p[0][1] + p[1][1]).abs() * slant
        })
        .sum();
    let ds = 1.0 / (nodes - 1) as f64;
    let mut sum = 0.0;
    for n in 1..nodes - 1 {
        let (dx, dy) = (c[n + 1][0] - c[n - 1][0], c[n + 1][1] - c[n - 1][1]);
        let f = force / surface / dx.hypot(dy);
        let push = [-f * dy, f * dx];
        for k in 0..2 {
            let u = |m: usize| c[m][k] - rest[m][k];
            let pull = (u(n + 1) - 2.0 * u(n) + u(n - 1)) / (ds * ds);
            sum += (pull + push[k]) * (pull + push[k]) * ds;
        }
    }
    sum.sqrt()
}
