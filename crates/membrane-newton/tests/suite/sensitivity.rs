//! Sensitivities against central differences of whole solves, and against dense matrices.

use membrane_newton::membrane_forces::SpectralElements;
use membrane_newton::{
    Control, DiscreteMembrane, Discretisation, Measure, Membrane, NewtonOptions, Pair, PressureLaw,
    ReferenceShape, Solver, Stiffness,
};
use nalgebra::{DMatrix, DVector};

#[test]
fn sensitivities_are_the_derivatives_of_solves() {
    let options = NewtonOptions::default();
    for skew in [0.0, 0.3] {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
            .with_stiffness(Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap());
        for discretisation in [
            Discretisation::FiniteDifferences { nodes: 101 },
            Discretisation::FiniteDifferences { nodes: 100 },
            Discretisation::Spectral {
                degree: 12,
                per_piece: 1,
            },
        ] {
            let solver = Solver::new(&membrane, discretisation).unwrap();
            type Make = fn(f64) -> Control;
            let controls: [(Make, f64); 6] = [
                (Control::Load, 15.0),
                (Control::Intensity, 15.0),
                (Control::TotalForce, 2000.0),
                (Control::Volume, 140.0),
                (Control::VolumeGain, 0.5),
                (Control::Area, 50.0),
            ];
            for (control, value) in controls {
                let here = solver.solve(control(value), &options).unwrap();
                let slope = here.sensitivity(control(value)).unwrap();
                assert_eq!(here.sensitivity(control(0.1 * value)).unwrap(), slope);
                let step = 1e-4 * value;
                let at = |value| solver.solve_from(&here, control(value), &options).unwrap();
                let (a, b) = (at(value - step), at(value + step));
                let difference = |a: f64, b: f64| (b - a) / (2.0 * step);
                // errors: 1e-8 of the third derivative for steps of 1e-4, 1e-14 / 1e-4 from the solves
                let intensity = difference(a.intensity, b.intensity);
                assert!((slope.intensity / intensity - 1.0).abs() < 1e-6);
                let size = slope
                    .points
                    .as_flattened()
                    .iter()
                    .fold(0.0f64, |m, v| m.max(v.abs()));
                assert_eq!(slope.points.len(), here.points().len());
                for (k, by) in slope.points.iter().enumerate() {
                    for i in 0..2 {
                        let expected = difference(a.points()[k][i], b.points()[k][i]);
                        let off = (by[i] - expected).abs() / size;
                        assert!(off < 1e-6, "{discretisation:?}, node {k}: {off:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn sensitivities_of_a_pair_are_the_derivatives_of_its_solves() {
    let options = NewtonOptions::default();
    let solver = |radius, discretisation| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        Solver::new(&membrane, discretisation).unwrap()
    };
    let differences = Discretisation::FiniteDifferences { nodes: 101 };
    let spectral = Discretisation::Spectral {
        degree: 12,
        per_piece: 1,
    };
    let pair = Pair::new(solver(1.75, spectral), solver(2.75, differences)).unwrap();
    type Make = fn(f64) -> Control;
    let controls: [(Make, f64); 3] = [
        (Control::VolumeGain, 0.5),
        (Control::Load, 15.0),
        (Control::Area, 50.0),
    ];
    for (control, value) in controls {
        let here = pair.solve(control(value), &options).unwrap();
        let slopes = here.sensitivity(control(value)).unwrap();
        let step = 1e-4 * value;
        let at = |value| pair.solve_from(&here, control(value), &options).unwrap();
        let (a, b) = (at(value - step), at(value + step));
        for (slope, a, b) in [
            (&slopes[0], &a.inner, &b.inner),
            (&slopes[1], &a.outer, &b.outer),
        ] {
            // as above: 1e-8 for steps of 1e-4
            let intensity = (b.intensity - a.intensity) / (2.0 * step);
            assert!((slope.intensity / intensity - 1.0).abs() < 1e-6);
            let flat = slope.points.as_flattened();
            let size = flat.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let (a, b) = (a.points(), b.points());
            for ((by, a), b) in flat.iter().zip(a.as_flattened()).zip(b.as_flattened()) {
                let off = (by - (b - a) / (2.0 * step)).abs() / size;
                assert!(off < 1e-6, "{off:e}");
            }
        }
    }
}

/// Returns the tangent as one dense matrix: blocks at their nodes, the band at the ends of blocks.
fn assembled(elements: &SpectralElements, nodes: &[f64], intensity: f64) -> DMatrix<f64> {
    let (p, n) = (elements.degree(), nodes.len());
    let mut tangent = elements.tangent();
    elements
        .tangent_into(nodes, intensity, &mut tangent)
        .unwrap();
    let mut matrix = DMatrix::zeros(n, n);
    for (e, block) in tangent.blocks.iter().enumerate() {
        // inner nodes come first, then the two ends
        let node = |i: usize| match i / 2 {
            k if k < p - 1 => e * p + k + 1,
            k if k == p - 1 => e * p,
            _ => e * p + p,
        };
        let size = 2 * (p + 1);
        for i in 0..size {
            for j in 0..size {
                let at = (2 * node(i) + i % 2, 2 * node(j) + j % 2);
                matrix[at] += block[i * size + j];
            }
        }
    }
    let end = |i: usize| 2 * (i / 2 * p) + i % 2;
    for i in 0..tangent.band.len() {
        for j in 0..tangent.band.len() {
            matrix[(end(i), end(j))] += tangent.band.get(i, j).unwrap();
        }
    }
    for &held in elements.fixed() {
        let unit = DVector::from_fn(n, |i, _| f64::from(u8::from(i == held)));
        assert_eq!(matrix.row(held), unit.transpose());
    }
    matrix
}

#[test]
fn sensitivities_of_elements_equal_a_dense_lu() {
    for law in [
        PressureLaw::PerMaterialLength,
        PressureLaw::PerCurrentLength,
    ] {
        // whole curve and half curve
        for skew in [0.5, 0.0] {
            let stiffness = Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap();
            let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
                .with_stiffness(stiffness)
                .with_second_neighbours(Stiffness::constant(0.1).unwrap())
                .with_law(law);
            for (degree, per_piece) in [(3, 1), (3, 2), (7, 1), (14, 3)] {
                let elements = SpectralElements::new(&membrane, degree, per_piece).unwrap();
                assert_eq!(elements.is_half(), skew == 0.0);
                let spectral = Discretisation::Spectral { degree, per_piece };
                let solver = Solver::new(&membrane, spectral).unwrap();
                let control = Control::VolumeGain(0.4);
                let solved = solver.solve(control, &NewtonOptions::default()).unwrap();
                let n = elements.start().len();
                let mut nodes = solved.points().as_flattened()[..n].to_vec();
                let held = elements.fixed();
                held.iter().for_each(|&k| nodes[k] = elements.start()[k]);
                let (mut column, mut row) = (vec![0.0; n], vec![0.0; n]);
                elements
                    .pressure_force_into(&nodes, 1.0, &mut column)
                    .unwrap();
                elements.measure_gradient_into(Measure::Volume, &nodes, &mut row);
                let mut matrix =
                    assembled(&elements, &nodes, solved.intensity).resize(n + 1, n + 1, 0.0);
                for k in 0..n {
                    matrix[(k, n)] = column[k];
                    matrix[(n, k)] = row[k];
                }
                let volume = solver.start_measures().volume;
                let rate = DVector::from_fn(n + 1, |i, _| if i == n { volume } else { 0.0 });
                let dense = matrix.clone().lu().solve(&rate).unwrap();
                let found = solved.sensitivity(control).unwrap();
                let points = found.points.as_flattened()[..n].iter().copied();
                let x = DVector::from_iterator(n + 1, points.chain([found.intensity]));
                // rounding times the condition number
                let size = |m: &DMatrix<f64>| m.abs().row_sum_tr().max();
                let condition = size(&matrix.clone().try_inverse().unwrap()) * size(&matrix);
                let off = (&dense - &x).amax() / dense.amax();
                assert!(
                    off < 1e-15 * condition,
                    "{law:?}, degree {degree}, {per_piece} a piece: {off:e}, condition {condition:e}"
                );
            }
        }
    }
}
