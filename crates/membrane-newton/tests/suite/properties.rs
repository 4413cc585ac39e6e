//! The paper's two invariants on random input: the circle of the appendix and the volume of the wall.

use membrane_newton::membrane_forces::LinearEquilibrium;
use membrane_newton::{
    Control, Discretisation, Membrane, NewtonOptions, Pair, ReferenceShape, Solver, Stiffness,
};
use proptest::prelude::*;

/// Largest distance of a node from its position in the closed form.
fn circle_error(radius: f64, load: f64, stiffness: f64, nodes: usize) -> f64 {
    let exact = LinearEquilibrium::circle(radius, load / stiffness).unwrap();
    let membrane = Membrane::new(ReferenceShape::disc(radius).unwrap())
        .with_stiffness(Stiffness::constant(stiffness).unwrap());
    let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap();
    let solution = solver
        .solve(Control::Intensity(load), &NewtonOptions::default())
        .unwrap();
    let last = (nodes - 1) as f64;
    let distances = solution
        .points()
        .into_iter()
        .enumerate()
        .map(|(n, [x, y])| {
            let at = exact.at(n as f64 / last).position;
            (x - at[0]).hypot(y - at[1])
        });
    distances.fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// A disc under any load becomes the circle, with order 2 in the number of nodes.
    #[test]
    fn a_disc_becomes_the_circle_with_order_two(
        radius in 0.1..10.0f64,
        ratio in 0.5..60.0f64, // load / (stiffness radius)
        stiffness in 0.01..100.0f64,
        cells in 60usize..200,
    ) {
        let load = ratio * stiffness * radius;
        let coarse = circle_error(radius, load, stiffness, cells + 1);
        let fine = circle_error(radius, load, stiffness, 2 * cells + 1);
        // The arc turns by mu < 5.5 here, so a cell turns by less than 0.1 rad and the next term
        // of the error is about (0.1)^2 = 1 % of the first: 0.05 in the order suffices.
        let order = (coarse / fine).log2();
        prop_assert!((order - 2.0).abs() < 0.05, "order {order}, errors {coarse:e} {fine:e}");
        // The constant: at these loads the error stays below 40 radii / cells^2.
        prop_assert!(coarse < 40.0 * radius / (cells * cells) as f64, "{coarse:e}");
    }

    /// The wall is incompressible: its volume is constant at any gain, for any two balloons.
    #[test]
    fn the_wall_volume_is_constant(
        length in 1.0..20.0f64,
        radius in 0.3..4.0f64,
        thickness in 0.1..1.0f64, // of the radius
        gain in 0.0..2.0f64,
        nodes in 11usize..202,
        spectral in any::<bool>(),
    ) {
        let discretisation = if spectral {
            Discretisation::Spectral { degree: 12, per_piece: 1 }
        } else {
            Discretisation::FiniteDifferences { nodes }
        };
        let solver = |radius: f64| {
            let membrane = Membrane::new(ReferenceShape::balloon(length, radius).unwrap());
            Solver::new(&membrane, discretisation).unwrap()
        };
        let pair = Pair::new(solver(radius), solver(radius * (1.0 + thickness))).unwrap();
        let solution = pair.solve_gain(gain, &NewtonOptions::default()).unwrap();
        // Volumes are sums of about a hundred terms; the wall is at least a tenth of the outer one, which increases the relative rounding by a factor
        // of ten.
        prop_assert!(solution.wall_volume_error.abs() < 1e-12, "{:e}", solution.wall_volume_error);
        let inner = pair.inner().start_measures().volume;
        prop_assert!((solution.inner.measures.volume / inner - 1.0 - gain).abs() < 1e-12 * (1.0 + gain));
    }
}

#[test]
fn equal_problems_have_equal_equilibria() {
    let solved = |radius: f64, gain: f64, degree: usize| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        let spectral = Discretisation::Spectral {
            degree,
            per_piece: 1,
        };
        let solver = Solver::new(&membrane, spectral).unwrap();
        let options = NewtonOptions::default();
        solver.solve(Control::VolumeGain(gain), &options).unwrap()
    };
    let one = solved(1.75, 0.3, 10);
    assert_eq!(one, one.clone());
    assert_eq!(one, solved(1.75, 0.3, 10));
    for other in [
        solved(1.8, 0.3, 10),
        solved(1.75, 0.31, 10),
        solved(1.75, 0.3, 11),
    ] {
        assert_ne!(one, other);
    }
}
