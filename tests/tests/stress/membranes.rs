//! Random membranes: any size and unit, stiffness ratios up to 1e12, any law and control, both discretisations.

use crate::Outcome;
use membrane_forces::{Membrane, PressureLaw, ReferenceShape, Stiffness};
use membrane_newton::{Control, Discretisation, Equilibrium, NewtonOptions, Pair, Solver};
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let unit = random.decades(-6.0, 6.0);
    let (radius, h) = (
        unit * random.decades(-0.7, 0.7),
        unit * random.decades(-1.0, 1.0),
    );
    let Some(solver) = solver(random, h, radius) else {
        return Outcome::Rejected;
    };
    if random.one_in(5) {
        let outer_radius = radius * random.uniform(1.05, 2.0);
        let Some(outer) = self::solver(random, h, outer_radius) else {
            return Outcome::Rejected;
        };
        return pair(random, solver, outer);
    }
    let control = match random.integer(0, 3) {
        0 => Control::Load(random.decades(-3.0, 3.0) * unit),
        1 => Control::VolumeGain(random.uniform(-0.5, 20.0)),
        2 => Control::Volume(solver.start_measures().volume * random.decades(-1.0, 1.0)),
        _ => Control::Intensity(random.decades(-3.0, 3.0) * unit),
    };
    let control = match control {
        Control::Load(value) => Control::Load(random.spoiled(value)),
        Control::VolumeGain(value) => Control::VolumeGain(random.spoiled(value)),
        other => other,
    };
    let Ok(solved) = solver.solve(control, &NewtonOptions::default()) else {
        return Outcome::Rejected;
    };
    check(&solved);
    let start = solver.start_measures().volume;
    let wanted = match control {
        Control::Volume(volume) => Some(volume),
        Control::VolumeGain(gain) => Some(start * (1.0 + gain)),
        _ => None,
    };
    if let Some(volume) = wanted {
        // The border equation is one of Newton's equations: its residual is below the tolerance, far below 1e-8 of the volume.
        assert!(
            (solved.measures.volume / volume - 1.0).abs() < 1e-8,
            "{} and {volume}",
            solved.measures.volume
        );
    }
    Outcome::Answered
}

fn solver(random: &mut Random, h: f64, radius: f64) -> Option<Solver> {
    let rest = ReferenceShape::balloon(random.spoiled(h), random.spoiled(radius)).ok()?;
    let stiffness = match random.integer(0, 2) {
        0 => Stiffness::constant(random.spoiled(1.0)),
        1 => {
            let amplitude = random.uniform(0.0, 0.9);
            Stiffness::function(move |s| 1.0 + amplitude * (9.0 * s).sin(), &[])
        }
        _ => {
            let ratio = random.decades(0.0, 12.0);
            let values: Vec<f64> = (0..7)
                .map(|k| if k % 2 == 0 { 1.0 } else { ratio })
                .collect();
            Stiffness::samples(&values)
        }
    };
    let law = random.pick(&[
        PressureLaw::PerMaterialLength,
        PressureLaw::TotalForce,
        PressureLaw::PerCurrentLength,
    ]);
    let membrane = Membrane::new(rest)
        .with_stiffness(stiffness.ok()?)
        .with_law(law);
    let discretisation = if random.one_in(2) {
        Discretisation::FiniteDifferences {
            nodes: random.integer(0, 300),
        }
    } else {
        Discretisation::Spectral {
            degree: random.integer(0, 20),
            per_piece: random.integer(0, 3),
        }
    };
    Solver::new(&membrane, discretisation).ok()
}

fn pair(random: &mut Random, inner: Solver, outer: Solver) -> Outcome {
    let Ok(pair) = Pair::new(inner, outer) else {
        return Outcome::Rejected;
    };
    let gain = random.uniform(0.0, 3.0);
    let Ok(solved) = pair.solve_gain(random.spoiled(gain), &NewtonOptions::default()) else {
        return Outcome::Rejected;
    };
    check(&solved.inner);
    check(&solved.outer);
    // Two border equations; relative to the wall, which may be thin beside the volumes.
    let scale = solved.outer.measures.volume / solved.wall_volume.abs();
    assert!(
        solved.wall_volume_error.abs() < 1e-9 * scale.max(1.0),
        "{}",
        solved.wall_volume_error
    );
    Outcome::Answered
}

fn check(solved: &Equilibrium) {
    assert!(solved.points().iter().flatten().all(|x| x.is_finite()));
    let m = &solved.measures;
    assert!(
        [
            m.length,
            m.area,
            m.surface,
            m.volume,
            solved.intensity,
            solved.load
        ]
        .iter()
        .all(|x| x.is_finite()),
        "{m:?}, intensity {}, load {}",
        solved.intensity,
        solved.load
    );
    assert!(solved.report.residual.is_finite());
    for k in 0..=10 {
        let point = solved.at(k as f64 / 10.0);
        assert!(
            point
                .position
                .iter()
                .chain(&point.first)
                .all(|x| x.is_finite())
        );
    }
}
