//! Rubber in motion: energy to rounding, order two, independent equilibria and vibrations, events and dense output.

use crate::common;

use common::{RunWith, apart, runge_kutta};
use membrane_implicit::{
    Body, DiscreteMembrane, ImplicitError, Load, LoadState, Membrane, Motion, ReferenceShape,
    Scheme, Stiffness, Stop, TimeStep, Tolerance,
};
use membrane_newton::{
    Control, Discretisation, MembraneError, NewtonOptions, Rubber, Solver, StrainEnergy, Thickness,
};

fn of(rest: ReferenceShape, energy: StrainEnergy) -> Membrane {
    Membrane::new(rest).with_rubber(Rubber::new(energy, Thickness::UNIT).unwrap())
}

fn balloon() -> Membrane {
    of(
        ReferenceShape::balloon(8.5, 1.75).unwrap(),
        StrainEnergy::NeoHookean { mu: 1.0 },
    )
}

fn body(nodes: usize) -> Body {
    Body::rubber(&balloon(), nodes, 1.0).unwrap()
}

fn motion(body: Body, load: Load) -> Motion {
    Motion::new(body, load, Scheme::Midpoint).unwrap()
}

/// A sudden pressure, long and short steps, three rubbers, with and without damping: the energy balances.
#[test]
fn energy_adds_up_to_rounding_for_any_step() {
    for energy in [
        StrainEnergy::NeoHookean { mu: 1.0 },
        StrainEnergy::MooneyRivlin { c1: 0.4, c2: 0.1 },
        StrainEnergy::Gent { mu: 1.0, jm: 20.0 },
    ] {
        for (dt, damping) in [(0.3, 0.0), (0.05, 0.0), (0.1, 0.5)] {
            let membrane = of(ReferenceShape::balloon(8.5, 1.75).unwrap(), energy.clone());
            let body = Body::rubber(&membrane, 41, 1.0).unwrap();
            let body = body.with_damping(damping).unwrap();
            let mut motion = motion(body, Load::intensity(|t| 0.15 * (t / 3.0).min(1.0)));
            for _ in 0..100 {
                motion.step(dt).unwrap();
                let e = motion.energy();
                // the equations are solved to about 1e-11 of the size
                assert!(
                    e.imbalance().abs() < 1e-9 * (e.pressure_work.abs() + e.elastic),
                    "{dt} {:e}",
                    e.imbalance()
                );
                assert_eq!(e.numerical_loss, 0.0);
            }
            assert!(motion.energy().elastic > 0.1 && motion.energy().kinetic > 0.0);
        }
    }
    // long steps with much damping, whose equations converge slowly
    let neo = StrainEnergy::NeoHookean { mu: 1.0 };
    let thick = Rubber::new(neo, Thickness::constant(0.5).unwrap()).unwrap();
    let body = Body::rubber(&balloon().with_rubber(thick), 101, 1.0).unwrap();
    let load = Load::intensity(|t| 0.02 * (1.0 - (-t).exp()));
    let mut motion = motion(body.with_damping(5.0).unwrap(), load);
    motion.run(TimeStep::Fixed(4.0), &[Stop::Steps(4)]).unwrap();
    let e = motion.energy();
    assert!(e.imbalance().abs() < 1e-10 * e.elastic, "{e:?}");
}

/// The classical Runge-Kutta scheme on m c'' = F_e + p dV/dc, implemented from the forces only.
fn reference(end: f64, steps: usize, pressure: fn(f64) -> f64) -> Vec<[f64; 2]> {
    use membrane_implicit::DiscreteMembrane;
    use membrane_implicit::membrane_newton::membrane_forces::FiniteDifferences;
    let forces = FiniteDifferences::new(&balloon(), 21).unwrap();
    let n = forces.start().len();
    let (mut mass, mut matrix) = (vec![0.0; n], forces.tangent());
    forces.add_mass_into(1.0, &mut matrix).unwrap();
    matrix.mul_into(&vec![1.0; n], &mut mass);
    let slope = |time: f64, state: &[f64]| {
        let (c, v) = state.split_at(n);
        let (mut elastic, mut push) = (vec![0.0; n], vec![0.0; n]);
        forces.elastic_force_into(c, &mut elastic);
        forces
            .pressure_force_into(c, pressure(time), &mut push)
            .unwrap();
        let mut out = v.to_vec();
        out.extend((0..n).map(|i| (elastic[i] + push[i]) / mass[i]));
        forces.fixed().iter().for_each(|held| out[n + held] = 0.0);
        out
    };
    let mut state = forces.start().to_vec();
    state.resize(2 * n, 0.0);
    let state = runge_kutta(state, end, steps, slope);
    state[..n].as_chunks().0.to_vec()
}

fn swell(t: f64) -> f64 {
    0.15 * (1.0 - t.cos())
}

#[test]
fn the_scheme_is_of_order_two() {
    let exact = reference(2.0, 4000, swell);
    let off = |steps: u32| {
        let mut motion = motion(body(21), Load::intensity(swell));
        let dt = TimeStep::Fixed(2.0 / f64::from(steps));
        motion.run(dt, &[Stop::Time(2.0)]).unwrap();
        apart(motion.state().points, &exact)
    };
    let order = (off(80) / off(160)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

/// Adaptive steps, their dense output and events, against a Runge-Kutta scheme of order 4 with steps a hundred times smaller.
#[test]
fn adaptive_steps_events_and_dense_output_work_as_for_springs() {
    let exact = reference(2.0, 4000, swell);
    let mut errors = Vec::new();
    for tolerance in [1e-3, 1e-5] {
        let mut motion = motion(body(21), Load::intensity(swell));
        let steps = TimeStep::Adaptive(Tolerance::uniform(tolerance));
        motion.run(steps, &[Stop::Time(1.995)]).unwrap();
        motion.step(0.01).unwrap();
        let (mut points, mut velocities) = (exact.clone(), exact.clone());
        motion.at_into(2.0, &mut points, &mut velocities).unwrap();
        errors.push(apart(&points, &exact));
        println!(
            "{tolerance:e}: {:e} cm, {:?}",
            errors[errors.len() - 1],
            motion.work()
        );
    }
    // the tolerance applies to one step; errors of about a hundred steps add up
    assert!(errors[0] < 2e-2 && errors[1] < 2e-4, "{errors:?}");
    let mut motion = motion(body(21), Load::intensity(|t| 0.05 * t));
    let value = 1.05 * motion.state().volume();
    let stops = [Stop::Time(20.0), Stop::Volume(value)];
    assert_eq!(motion.run(TimeStep::Fixed(0.1), &stops), Ok(1));
    assert!((motion.state().volume() / value - 1.0).abs() < 1e-10);
    // closed there, its volume is constant
    motion.set_load(Load::volume(move |_| value)).unwrap();
    motion
        .run(TimeStep::Fixed(0.1), &[Stop::Steps(10)])
        .unwrap();
    assert!((motion.state().volume() / value - 1.0).abs() < 1e-10);
}

/// Between the ends of a step, velocities follow the accelerations at its start: mass times acceleration is the force of pressure and damping.
#[test]
fn the_first_acceleration_is_that_of_pressure_and_damping() {
    let body = Body::rubber(&balloon(), 21, 2.0).unwrap();
    let motion = motion(body.with_damping(3.0).unwrap(), Load::intensity(|_| 0.3));
    let d = motion.body().differences().clone();
    let n = d.start().len();
    // zero at the end, along the axis
    let before: Vec<[f64; 2]> = (0..n / 2).map(|k| [0.02 * k as f64, 0.0]).collect();
    let start = d.start().as_chunks().0;
    let mut motion = motion.with_state(0.0, start, &before).unwrap();
    motion.step(1e-3).unwrap();
    let (mut force, mut mass) = (vec![0.0; n], d.tangent());
    d.pressure_force_into(d.start(), 0.3, &mut force).unwrap();
    d.add_mass_into(1.0, &mut mass).unwrap();
    let (mut points, mut velocities) = (vec![[0.0; 2]; n / 2], vec![[0.0; 2]; n / 2]);
    motion.at_into(1e-6, &mut points, &mut velocities).unwrap();
    let mut momentum = vec![0.0; n];
    // density times the acceleration, with that of the damping
    let rates = velocities.as_flattened().iter().zip(before.as_flattened());
    let rates: Vec<f64> = rates
        .map(|(v, v0)| 2.0 * ((v - v0) / 1e-6 + 3.0 * v0))
        .collect();
    mass.mul_into(&rates, &mut momentum);
    let size = force.iter().fold(0.0f64, |most, f| most.max(f.abs()));
    for (momentum, force) in momentum.iter().zip(&force) {
        // the cubic is bent by some times the fraction of the step
        assert!((momentum - force).abs() < 1e-2 * size, "{momentum} {force}");
    }
}

/// Slow filling with damping ends in the equilibrium of that volume.
#[test]
fn a_filled_balloon_ends_in_equilibrium() {
    let rest = 93.0;
    let inflow = move |t: f64| 0.3 * rest * (1.0 - (-(t / 10.0).powi(2)).exp());
    let body = body(41).with_damping(1.0).unwrap();
    let start = body.start_volume();
    let load = Load::volume(move |t| start + inflow(t));
    let mut motion = motion(body, load);
    motion
        .run_with(TimeStep::Fixed(0.25), &[Stop::Steps(1200)], |motion| {
            let wanted = start + inflow(motion.time());
            assert!((motion.state().volume() / wanted - 1.0).abs() < 1e-11);
        })
        .unwrap();
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 41 }).unwrap();
    let (volume, pressure) = (motion.state().volume(), motion.state().intensity);
    let still = solver.solve(Control::Volume(volume), &NewtonOptions::default());
    let still = still.unwrap();
    assert!(
        (pressure / still.intensity - 1.0).abs() < 1e-6,
        "{pressure} {}",
        still.intensity
    );
    // The amplitude of the slowest mode is 7e-6 after half of the time and 4e-8 at the end, for any step.
    let off = apart(motion.state().points, &still.points());
    assert!(off < 1e-6, "{off:e}");
}

/// Under a pressure that depends on the volume, with damping, it ends in the common equilibrium.
#[test]
fn a_balloon_under_feedback_ends_in_equilibrium() {
    let answer = |now: &LoadState| 0.1 - 1e-3 * (now.volume - 93.0) - 1e-4 * now.volume_rate;
    let body = body(21).with_damping(1.0).unwrap();
    let mut motion = motion(body, Load::feedback(answer));
    motion
        .run(TimeStep::Fixed(0.25), &[Stop::Steps(1200)])
        .unwrap();
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 21 }).unwrap();
    let volume = motion.state().volume();
    let still = solver.solve(Control::Volume(volume), &NewtonOptions::default());
    let pressure = 0.1 - 1e-3 * (volume - 93.0);
    assert!((still.unwrap().intensity / pressure - 1.0).abs() < 1e-5);
    let energy = motion.energy();
    assert!(energy.imbalance().abs() < 1e-8 * energy.pressure_work);
}

/// Released near an equilibrium it oscillates with the period of the lowest eigenvalue of its stability.
#[test]
fn vibrations_have_the_frequency_of_the_lowest_eigenvalue() {
    let (nodes, p) = (41, 0.2);
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes }).unwrap();
    let still = solver
        .solve(Control::Load(p), &NewtonOptions::default())
        .unwrap();
    let omega = still.stability().unwrap().at_pressure.lowest.sqrt();
    // from the equilibrium, under a slightly larger pressure
    let load = Load::intensity(move |_| 1.0001 * p);
    let (half, still) = (nodes.div_ceil(2), still.points());
    let mut motion = motion(body(nodes), load)
        .with_state(0.0, &still[..half], &vec![[0.0; 2]; half])
        .unwrap();
    let (mut volumes, dt) = (Vec::new(), 0.02 / omega);
    for _ in 0..4000 {
        motion.step(dt).unwrap();
        volumes.push(motion.state().volume());
    }
    // the projection on a frequency is largest at the lowest one, which the pressure drives most
    let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
    let power = |w: f64| {
        let mut sums = [0.0; 2];
        for (k, v) in volumes.iter().enumerate() {
            let (t, window) = (
                k as f64 * dt,
                (std::f64::consts::PI * (k as f64 + 0.5) / volumes.len() as f64).sin(),
            );
            sums[0] += window * window * (v - mean) * (w * t).cos();
            sums[1] += window * window * (v - mean) * (w * t).sin();
        }
        sums[0].hypot(sums[1])
    };
    let best = (0..400)
        .map(|k| omega * (0.8 + 0.001 * f64::from(k)))
        .max_by(|a, b| power(*a).total_cmp(&power(*b)));
    assert!(
        (best.unwrap() / omega - 1.0).abs() < 0.01,
        "{best:?} {omega}"
    );
}

#[test]
fn loads_schemes_and_bodies_of_the_other_material_are_errors() {
    let springs = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    for rejected in [
        Body::rubber(&springs, 21, 1.0),
        Body::springs(&balloon(), 21),
    ] {
        assert!(matches!(
            rejected,
            Err(ImplicitError::Membrane(MembraneError::OtherMaterial { .. }))
        ));
    }
    let made = |load, scheme| Motion::new(body(21), load, scheme).map(drop);
    let pressure = || Load::intensity(|_| 0.1);
    let total = made(Load::total_force(|_| 1.0), Scheme::Midpoint);
    let unsupported = |scheme, what| Err(ImplicitError::Unsupported { scheme, what });
    assert_eq!(
        total,
        unsupported(Scheme::Midpoint, "a total force on rubber")
    );
    for scheme in [
        Scheme::SemiImplicitEuler,
        Scheme::TrBdf2,
        Scheme::ImplicitSplitting2,
        Scheme::Splitting2,
        Scheme::Splitting6,
    ] {
        assert_eq!(made(pressure(), scheme), unsupported(scheme, "rubber"));
    }
    assert!(Body::rubber(&balloon(), 21, 0.0).is_err());
    assert!(made(Load::volume(|_| 50.0), Scheme::Midpoint).is_err());
    assert!(made(Load::intensity(|_| f64::NAN), Scheme::Midpoint).is_err());
    let mut motion = motion(body(21), pressure());
    assert!(matches!(
        motion.set_stiffness(Stiffness::UNIT),
        Err(ImplicitError::Membrane(MembraneError::OtherMaterial { .. }))
    ));
    assert!(motion.step(-1.0).is_err() && motion.step(f64::NAN).is_err());
}
