//! Two membranes around a wall: the work of the cavity, ends and curves that touch or cross.

use std::f64::consts::PI;

use membrane_newton::{
    Control, CurvePoint, Discretisation, Membrane, NewtonError, NewtonOptions, Pair,
    PairEquilibrium, ReferenceShape, Rubber, Solver, StrainEnergy, Thickness,
};

const SPECTRAL: Discretisation = Discretisation::Spectral {
    degree: 16,
    per_piece: 1,
};

fn solver(rest: ReferenceShape, how: Discretisation) -> Solver {
    let energy = StrainEnergy::NeoHookean { mu: 1.0 };
    let rubber = Rubber::new(energy, Thickness::UNIT).unwrap();
    Solver::new(&Membrane::new(rest).with_rubber(rubber), how).unwrap()
}

/// The wall is incompressible, so that the cavity does all work on both membranes: its pressure is the derivative of their energies by its volume.
#[test]
fn the_pressure_of_the_cavity_is_that_of_its_work() {
    let balloon = |radius| ReferenceShape::balloon(8.5, radius).unwrap();
    let pair = Pair::new(
        solver(balloon(1.75), SPECTRAL),
        solver(balloon(2.75), SPECTRAL),
    )
    .unwrap();
    let options = NewtonOptions::default();
    let here = pair.solve_gain(0.5, &options).unwrap();
    let volume = here.inner.measures.volume;
    let step = 1e-3 * volume;
    let energy = |volume| {
        let there = pair.solve_from(&here, Control::Volume(volume), &options);
        let there = there.unwrap();
        there.inner.elastic_energy() + there.outer.elastic_energy()
    };
    let work = (energy(volume + step) - energy(volume - step)) / (2.0 * step);
    // the square of the step; energies are exact to 1e-12 with these polynomials
    let found = here.cavity_pressure();
    assert!((work / found - 1.0).abs() < 1e-5, "{work} {found}");
    assert!(here.outer.pressure() > 0.1 * found);
}

/// Half an ellipsoid of radius 1 and this length, plus a bump along the normal of the sphere.
fn cap(radius: f64, length: f64, bump: f64) -> ReferenceShape {
    let curve = move |s: f64| {
        let (sin, cos) = (PI * s).sin_cos();
        // zero at the ends and at the apex, largest halfway between
        let wave = (2.0 * PI * s).sin();
        let (r, r1, r2) = (
            radius + bump * wave * wave,
            4.0 * PI * bump * wave * (2.0 * PI * s).cos(),
            8.0 * PI * PI * bump * (4.0 * PI * s).cos(),
        );
        CurvePoint {
            position: [length * r * sin, r * cos],
            first: [length * (r1 * sin + PI * r * cos), r1 * cos - PI * r * sin],
            second: [
                length * (r2 * sin + 2.0 * PI * r1 * cos - PI * PI * r * sin),
                r2 * cos - 2.0 * PI * r1 * sin - PI * PI * r * cos,
            ],
        }
    };
    ReferenceShape::from_function(curve, &[]).unwrap()
}

/// Both membranes may be fixed to one ring.
#[test]
fn membranes_of_a_pair_may_share_their_ends() {
    let pair = Pair::new(
        solver(cap(1.0, 1.0, 0.0), SPECTRAL),
        solver(cap(1.0, 1.5, 0.0), SPECTRAL),
    )
    .unwrap();
    // half the volume of an ellipsoid
    assert!((pair.wall_volume() / (PI / 3.0) - 1.0).abs() < 1e-9);
    let solved = pair.solve_gain(0.1, &NewtonOptions::default()).unwrap();
    assert!(solved.wall_volume_error.abs() < 1e-12);
}

/// A chord of a 64th of the meridian of the unit hemisphere has a sagitta of 7.5e-5. A membrane is rejected if it is outside by four times that.
#[test]
fn a_crossing_by_a_few_sagittas_is_rejected() {
    for how in [SPECTRAL, Discretisation::FiniteDifferences { nodes: 401 }] {
        let [sphere, within, across] = [0.0, 0.0099, 0.0103]
            .map(|bump| solver(cap(if bump == 0.0 { 1.0 } else { 0.99 }, 1.0, bump), how).start());
        assert!(PairEquilibrium::of(within, sphere.clone(), 1.0).is_ok());
        let found = PairEquilibrium::of(across, sphere, 1.0).unwrap_err();
        assert!(
            // to the tolerance of the curve of finite differences, and of the nearest node
            matches!(found, NewtonError::Crossed { depth, .. } if (depth / 3e-4 - 1.0).abs() < 0.3),
            "{how:?}: {found:?}"
        );
    }
}
