//! Derivatives of a flat sheet of rubber at loads so small that its state is scaled.

use membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, ReferenceShape, Rubber, Solver, StrainEnergy,
    Thickness,
};

/// Central differences of solved equilibria under each control, with the radius in units of 1e-6 to 1e6: x is linear in the volume, y quadratic,
/// and the pressure cubic.
#[test]
fn the_derivatives_of_a_slack_sheet_are_those_of_its_solves() {
    let options = NewtonOptions::default();
    let energy = StrainEnergy::NeoHookean { mu: 1.0 };
    let rubber = Rubber::new(energy, Thickness::UNIT).unwrap();
    for radius in [1e-6, 1.0, 1e6] {
        let disc = ReferenceShape::disc(radius).unwrap();
        let disc = Membrane::new(disc).with_rubber(rubber.clone());
        for how in [
            Discretisation::Spectral {
                degree: 12,
                per_piece: 1,
            },
            Discretisation::FiniteDifferences { nodes: 41 },
        ] {
            let solver = Solver::new(&disc, how).unwrap();
            let volume = Control::Volume(1e-4 * radius.powi(3));
            let small = solver.solve(volume, &options).unwrap();
            type Make = fn(f64) -> Control;
            let controls: [(Make, f64); 5] = [
                (Control::Volume, small.measures.volume),
                (Control::Area, small.measures.area),
                (Control::Load, small.load),
                (Control::Intensity, small.intensity),
                (
                    Control::TotalForce,
                    small.intensity * small.measures.surface,
                ),
            ];
            for (control, value) in controls {
                for value in [value, 1e-3 * value] {
                    let solve = |value| solver.solve(control(value), &options).unwrap();
                    let here = solve(value);
                    let slope = here.sensitivity(control(value)).unwrap();
                    let step = 0.01 * value;
                    let (a, b) = (solve(value - step), solve(value + step));
                    // a power of 1/3 to 3 has a third derivative of at most 6 times the first: 2e-4 with this step; the relative error of the
                    // scaled state is 1e-7
                    let intensity = (b.intensity - a.intensity) / (2.0 * step);
                    assert!(
                        (slope.intensity / intensity - 1.0).abs() < 3e-4,
                        "{radius:e} {how:?} {:?}",
                        control(value)
                    );
                    let (at, before, after) = (here.points(), a.points(), b.points());
                    for i in 0..2 {
                        let differences = before.iter().zip(&after);
                        let differences = differences.map(|(a, b)| (b[i] - a[i]) / (2.0 * step));
                        let size = (slope.points.iter()).fold(0.0f64, |m, p| m.max(p[i].abs()));
                        // the rounding of y, which moves by its strain, over the step
                        let rounding = 2.0 * f64::EPSILON * at[0][1] / step;
                        for (found, expected) in slope.points.iter().zip(differences) {
                            let off = (found[i] - expected).abs();
                            assert!(
                                off < 3e-4 * size + rounding,
                                "{radius:e} {how:?} {:?} {i}: {off:e} of {size:e}, {rounding:e}",
                                control(value)
                            );
                        }
                    }
                }
            }
        }
    }
}
