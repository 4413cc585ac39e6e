//! Solved equilibria against reference values and closed forms.

use membrane_forces::{CircleEquilibrium, Membrane, RestShape};
use membrane_newton::{Control, Discretisation, NewtonOptions, Pair, Solver};

fn balloon(radius: f64, nodes: usize) -> Solver {
    let membrane = Membrane::new(RestShape::balloon(8.5, radius).unwrap());
    Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap()
}

#[test]
fn finite_difference_volumes_of_the_reference() {
    // Independent solver, f = 17.5. Its Newton stopped at a residual of about 1e-5, which leaves
    // the volume uncertain by 2e-7; ours goes on to rounding.
    for (nodes, volume) in [
        (101, 148.81284352),
        (201, 148.85374880),
        (401, 148.86404321),
        (801, 148.86662312),
    ] {
        let solved = balloon(1.75, nodes)
            .solve(Control::Load(17.5), &NewtonOptions::default())
            .unwrap();
        println!("{:?}", solved.report);
        assert!(
            (solved.measures.volume - volume).abs() < 2e-7,
            "{nodes}: {}",
            solved.measures.volume
        );
    }
}

#[test]
fn pair_at_gain_sixty_percent() {
    let pair = Pair::new(balloon(1.75, 201), balloon(2.75, 201)).unwrap();
    let solved = pair.solve_gain(0.6, &NewtonOptions::default()).unwrap();
    println!(
        "{} {} {:?}",
        solved.inner.intensity, solved.outer.intensity, solved.report
    );
    assert!(solved.wall_volume_error.abs() < 1e-13);
    assert!((solved.inner.intensity - 17.48357527761).abs() < 2e-2);
    assert!((solved.outer.intensity - 10.30942447850).abs() < 2e-2);
}

#[test]
fn disc_becomes_the_circle_with_order_two() {
    let circle = CircleEquilibrium::new(1.0, 10.0).unwrap();
    let error = |nodes: usize| {
        let membrane = Membrane::new(RestShape::disc(1.0).unwrap());
        let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap();
        let solved = solver
            .solve(Control::Load(10.0), &NewtonOptions::default())
            .unwrap();
        let last = (nodes - 1) as f64;
        solved
            .points
            .iter()
            .enumerate()
            .map(|(n, p)| {
                let q = circle.at(n as f64 / last);
                (p[0] - q[0]).hypot(p[1] - q[1])
            })
            .fold(0.0, f64::max)
    };
    let order = (error(51) / error(101)).log2();
    assert!((order - 2.0).abs() < 0.05, "order {order}");
}
