//! Rubber in motion: energy to rounding, order two, equilibria and vibrations known from elsewhere.

use membrane_implicit::{Drive, ImplicitError, Membrane, MovingMembrane, RestShape, RubberMotion};
use membrane_newton::{
    Control, Discretisation, MembraneError, NewtonOptions, Rubber, Solver, StrainEnergy, Thickness,
};

fn of(rest: RestShape, energy: StrainEnergy) -> Membrane {
    Membrane::new(rest).with_rubber(Rubber::new(energy, Thickness::UNIT).unwrap())
}

fn balloon() -> Membrane {
    of(
        RestShape::balloon(8.5, 1.75).unwrap(),
        StrainEnergy::NeoHookean { mu: 1.0 },
    )
}

/// A sudden pressure, long and short steps, three rubbers, with and without damping: what the pressure has done is somewhere.
#[test]
fn energy_adds_up_to_rounding_for_any_step() {
    for energy in [
        StrainEnergy::NeoHookean { mu: 1.0 },
        StrainEnergy::MooneyRivlin { c1: 0.4, c2: 0.1 },
        StrainEnergy::Gent { mu: 1.0, jm: 20.0 },
    ] {
        for (dt, damping) in [(0.3, 0.0), (0.05, 0.0), (0.1, 0.5)] {
            let membrane = of(RestShape::balloon(8.5, 1.75).unwrap(), energy.clone());
            let motion = RubberMotion::new(
                &membrane,
                41,
                1.0,
                Drive::intensity(|t| 0.15 * (t / 3.0).min(1.0)),
            );
            let mut motion = motion.unwrap().with_damping(damping).unwrap();
            for _ in 0..100 {
                motion.step(dt).unwrap();
                let e = motion.energy();
                // the equations are solved to some 1e-11 of the size
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
}

#[test]
fn the_scheme_is_of_order_two() {
    let reached = |steps: usize| {
        let drive = Drive::intensity(|t: f64| 0.15 * (1.0 - t.cos()));
        let mut motion = RubberMotion::new(&balloon(), 21, 1.0, drive).unwrap();
        for _ in 0..steps {
            motion.step(2.0 / steps as f64).unwrap();
        }
        motion.points()[10]
    };
    let exact = reached(1280);
    let off = |steps| {
        let there = reached(steps);
        (there[0] - exact[0]).hypot(there[1] - exact[1])
    };
    let order = (off(80) / off(160)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

/// Filled slowly and damped it ends in the equilibrium of that volume.
#[test]
fn a_filled_balloon_ends_in_equilibrium() {
    let rest = 93.0;
    let inflow = move |t: f64| 0.3 * rest * (1.0 - (-(t / 10.0).powi(2)).exp());
    let mut motion = RubberMotion::filled(&balloon(), 41, 1.0, inflow)
        .unwrap()
        .with_damping(1.0)
        .unwrap();
    for _ in 0..1200 {
        motion.step(0.25).unwrap();
        let wanted = motion.start_volume() + inflow(motion.time());
        assert!((motion.volume() / wanted - 1.0).abs() < 1e-11);
    }
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 41 }).unwrap();
    let still = solver
        .solve(Control::Volume(motion.volume()), &NewtonOptions::default())
        .unwrap();
    assert!(
        (motion.pressure() / still.intensity - 1.0).abs() < 1e-6,
        "{} {}",
        motion.pressure(),
        still.intensity
    );
    for (a, b) in motion.points().iter().zip(still.points()) {
        // What is left of the slowest mode: 7e-6 after half of the time, 4e-8 after all of it, whatever the step.
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-6);
    }
}

/// Let go beside an equilibrium it swings with the period of the lowest eigenvalue of its stability.
#[test]
fn vibrations_have_the_frequency_of_the_stability() {
    let (nodes, p) = (41, 0.2);
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes }).unwrap();
    let still = solver
        .solve(Control::Load(p), &NewtonOptions::default())
        .unwrap();
    let omega = still.stability().unwrap().at_pressure.lowest.sqrt();
    // settled under p, then a little more pressure for a moment of the lowest mode's period
    let drive = Drive::intensity(move |t| {
        if t < 200.0 {
            p * (t / 100.0).min(1.0)
        } else {
            1.0001 * p
        }
    });
    let mut motion = RubberMotion::new(&balloon(), nodes, 1.0, drive)
        .unwrap()
        .with_damping(0.5)
        .unwrap();
    while motion.time() < 200.0 - 1e-9 {
        motion.step(0.5).unwrap();
    }
    let mut motion = motion.with_damping(0.0).unwrap();
    let (mut volumes, dt) = (Vec::new(), 0.02 / omega);
    for _ in 0..4000 {
        motion.step(dt).unwrap();
        volumes.push(motion.volume());
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
fn what_does_not_move_so_is_refused() {
    let springs = Membrane::new(RestShape::balloon(8.5, 1.75).unwrap());
    let pressure = || Drive::intensity(|_| 0.1);
    let refused = RubberMotion::new(&springs, 21, 1.0, pressure());
    assert!(matches!(
        refused,
        Err(ImplicitError::Membrane {
            error: MembraneError::OtherMaterial { .. },
            ..
        })
    ));
    let refused = MovingMembrane::new(&balloon(), 21);
    assert!(matches!(
        refused,
        Err(ImplicitError::Membrane {
            error: MembraneError::OtherMaterial { .. },
            ..
        })
    ));
    let total = RubberMotion::new(&balloon(), 21, 1.0, Drive::total_force(|_| 1.0));
    assert_eq!(total.map(drop), Err(ImplicitError::RubberDrive));
    assert!(RubberMotion::new(&balloon(), 21, 0.0, pressure()).is_err());
    assert!(RubberMotion::new(&balloon(), 21, 1.0, Drive::volume(|_| 50.0)).is_err());
    assert!(RubberMotion::new(&balloon(), 21, 1.0, Drive::intensity(|_| f64::NAN)).is_err());
    let mut motion = RubberMotion::new(&balloon(), 21, 1.0, pressure()).unwrap();
    assert!(motion.step(-1.0).is_err() && motion.step(f64::NAN).is_err());
}
