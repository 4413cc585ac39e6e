//! Sensitivities against central differences of whole solves.

use membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, Pair, ReferenceShape, Solver, Stiffness,
};

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
                let step = 1e-4 * value;
                let at = |value| solver.solve_from(&here, control(value), &options).unwrap();
                let (a, b) = (at(value - step), at(value + step));
                let difference = |a: f64, b: f64| (b - a) / (2.0 * step);
                // steps of 1e-4 leave 1e-8 of the third derivative, solves 1e-14 / 1e-4
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
            // as above: steps of 1e-4 leave 1e-8
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
