//! The half curve against plain Newton with a dense LU on the whole one.

use std::f64::consts::TAU;

use membrane_newton::membrane_forces::{DiscreteMembrane, FiniteDifferences};
use membrane_newton::{
    Control, Discretisation, Measure, Membrane, NewtonOptions, PressureLaw, ReferenceShape, Solver,
    Stiffness,
};
use nalgebra::{DMatrix, DVector};

/// Nodes and intensity at volume `wanted`: the whole curve, one dense matrix with its border.
fn dense_newton(membrane: &Membrane, n_nodes: usize, wanted: f64) -> (Vec<f64>, f64) {
    let d = FiniteDifferences::new(membrane, n_nodes).unwrap();
    let n = 2 * n_nodes;
    let (mut x, mut f) = (d.start().to_vec(), 0.0);
    let (mut elastic, mut pressure, mut unit) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut row = vec![0.0; n];
    for _ in 0..30 {
        d.elastic_force_into(&x, &mut elastic);
        d.pressure_force_into(&x, f, &mut pressure).unwrap();
        d.pressure_force_into(&x, 1.0, &mut unit).unwrap();
        d.measure_gradient_into(Measure::Volume, &x, &mut row);
        let mut tangent = d.tangent();
        d.tangent_into(&x, f, &mut tangent).unwrap();
        let held = |i: usize| i < 2 || i >= n - 2;
        let matrix = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
            (true, true) if held(i) => f64::from(u8::from(i == j)),
            (true, true) => tangent.band.get(i, j).unwrap(),
            (true, false) => unit[i],
            (false, true) => row[j],
            (false, false) => 0.0,
        });
        let missed = d.measure(Measure::Volume, &x).unwrap() - wanted;
        let residual = DVector::from_fn(n + 1, |i, _| {
            if i < n {
                elastic[i] + pressure[i]
            } else {
                missed
            }
        });
        let step = matrix.lu().solve(&residual).unwrap();
        (0..n).for_each(|i| x[i] -= step[i]);
        f -= step[n];
        if step.amax() < 1e-13 * f.abs() {
            break;
        }
    }
    (x, f)
}

#[test]
fn the_half_curve_has_the_solution_of_the_whole() {
    let profile = |a: f64| Stiffness::function(move |s| 1.0 + a * (TAU * s).cos(), &[]).unwrap();
    for nodes in [21, 40, 41] {
        for law in [
            PressureLaw::PerMaterialLength,
            PressureLaw::PerCurrentLength,
        ] {
            for second in [false, true] {
                let mut membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
                    .with_stiffness(profile(0.5))
                    .with_law(law);
                if second {
                    membrane = membrane.with_second_neighbours(profile(-0.3));
                }
                let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes });
                let half = solver.unwrap();
                let wanted = 1.6 * half.start_measures().volume;
                let half = half
                    .solve(Control::VolumeGain(0.6), &NewtonOptions::default())
                    .unwrap();
                let (x, f) = dense_newton(&membrane, nodes, wanted);
                let off = half
                    .points()
                    .as_flattened()
                    .iter()
                    .zip(&x)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                // rounding of a position, 1e-15 of 12 cm, times a condition number below 1e3
                assert!(
                    half.points().len() == nodes && off < 1e-11,
                    "{nodes} {law:?} {off:e}"
                );
                assert!((half.intensity / f - 1.0).abs() < 1e-11, "{nodes} {law:?}");
                let volume = Measure::Volume.of(x.as_chunks().0);
                assert!((half.measures.volume / volume - 1.0).abs() < 1e-13);
                // the interpolant contains the nodes on both sides of the axis
                for (s, point) in half.positions().iter().zip(half.points()) {
                    let at = half.at(*s).position;
                    assert!((at[0] - point[0]).hypot(at[1] - point[1]) < 1e-12);
                }
            }
        }
    }
}
