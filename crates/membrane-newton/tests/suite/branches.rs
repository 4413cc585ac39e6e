//! Choice between several equilibria: the one that a rising load reaches, or an error.
//!
//! The reference is a shooting method without nodes or tangents. With the tension T = lambda c' the equilibrium of a disc is T' = lambda'
//! c0' - f n; a mirror-symmetric one leaves the apex with T = (0, -t), and c_y(0) = R is one equation for the number t. Its roots are all
//! mirror-symmetric equilibria.

use std::f64::consts::{PI, TAU};

use membrane_newton::{
    Control, Discretisation, Membrane, NewtonError, NewtonOptions, ReferenceShape, Solver,
    Stiffness,
};

/// A disc of stiffness 1 + a cos(2 pi s).
#[derive(Clone, Copy)]
struct Disc {
    radius: f64,
    amplitude: f64,
}

impl Disc {
    fn solver(self, discretisation: Discretisation) -> Solver {
        let stiffness = move |s: f64| self.stiffness(s);
        let membrane = Membrane::new(ReferenceShape::disc(self.radius).unwrap())
            .with_stiffness(Stiffness::function(stiffness, &[]).unwrap());
        Solver::new(&membrane, discretisation).unwrap()
    }

    fn stiffness(self, s: f64) -> f64 {
        1.0 + self.amplitude * (TAU * s).cos()
    }

    /// Returns the error of c_y(0) = R for the apex tension (0, -t) under `load`, and the turning angle of the curve. Classical Runge-Kutta
    /// scheme from s = 1/2 to 0.
    fn shoot(self, load: f64, t: f64) -> (f64, f64) {
        let rate = |s: f64, [x, y]: [f64; 2]| {
            let size = x.hypot(y);
            let slope = -self.amplitude * TAU * (TAU * s).sin();
            [
                load * y / size,
                -2.0 * self.radius * slope - load * x / size,
                y / self.stiffness(s),
            ]
        };
        let steps = 200;
        let h = -0.5 / f64::from(steps);
        let (mut tension, mut y, mut turned) = ([0.0, -t], 0.0, 0.0);
        for k in 0..steps {
            let s = 0.5 + h * f64::from(k);
            let ahead = |by: f64, k: [f64; 3]| [tension[0] + by * k[0], tension[1] + by * k[1]];
            let k1 = rate(s, tension);
            let k2 = rate(s + 0.5 * h, ahead(0.5 * h, k1));
            let k3 = rate(s + 0.5 * h, ahead(0.5 * h, k2));
            let k4 = rate(s + h, ahead(h, k3));
            let sum = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            let next = [tension[0] + sum(0), tension[1] + sum(1)];
            y += sum(2);
            let cross = tension[0] * next[1] - tension[1] * next[0];
            turned += cross.atan2(tension[0] * next[0] + tension[1] * next[1]);
            tension = next;
        }
        (y - self.radius, 2.0 * turned)
    }

    /// Every equilibrium under `load` with a tension t at the apex from `least` to `most` in size: t
    /// and the angle turned, largest tension first.
    fn equilibria(self, load: f64, least: f64, most: f64) -> Vec<(f64, f64)> {
        let missed = |t: f64| self.shoot(load, t).0;
        let trials = 500;
        let at = |k: usize| most * (least / most).powf(k as f64 / trials as f64);
        let mut found = Vec::new();
        for sign in [1.0, -1.0] {
            for k in 0..trials {
                let (mut a, mut b) = (sign * at(k), sign * at(k + 1));
                let side = missed(a);
                if side * missed(b) < 0.0 {
                    for _ in 0..50 {
                        let middle = 0.5 * (a + b);
                        if missed(middle) * side > 0.0 {
                            a = middle
                        } else {
                            b = middle
                        }
                    }
                    found.push((a, self.shoot(load, a).1));
                }
            }
        }
        found
    }
}

const DIFFERENCES: Discretisation = Discretisation::FiniteDifferences { nodes: 401 };
const SPECTRAL: Discretisation = Discretisation::SpectralAdaptive { tolerance: 1e-10 };

/// Under constant stiffness and 2 000 R there are discs of one loop and of two, three, ...: the
/// result is that of one loop, the closed form.
#[test]
fn the_result_is_the_equilibrium_reached_by_inflation() {
    let disc = Disc {
        radius: 1.0,
        amplitude: 0.0,
    };
    let all = disc.equilibria(2000.0, 20.0, 2000.0);
    assert!(all.len() > 5, "{all:?}");
    let (tension, turned) = all[0];
    assert!(turned < TAU && all[1..].iter().all(|other| other.1 > TAU));
    for (discretisation, tolerance) in [(SPECTRAL, 1e-9), (DIFFERENCES, 1e-2)] {
        let solved = disc
            .solver(discretisation)
            .solve(Control::Intensity(2000.0), &NewtonOptions::default())
            .unwrap();
        let found = -solved.at(0.5).first[1] * disc.stiffness(0.5);
        assert!(
            (found / tension - 1.0).abs() < tolerance,
            "{found} {tension}"
        );
    }
}

/// The disc is soft at the apex and has a limit point far below 740. Newton's method from the start alone converges to curves of three loops here,
/// and to others on other meshes.
#[test]
fn curves_with_loops_past_the_limit_point_are_not_results() {
    let disc = Disc {
        radius: 0.12226,
        amplitude: 0.5582,
    };
    let asked = 739.84;
    let all = disc.equilibria(asked, 0.01 * asked, asked);
    assert!(all.len() > 10 && all.iter().all(|other| other.1 > 6.0 * PI));
    // below the limit there are two curves, which meet there
    let two = |load: f64| {
        let all = disc.equilibria(load, 0.085 * load, load);
        all.iter().all(|other| other.1 < 4.0 * PI) && all.len() == 2
    };
    let (mut low, mut high) = (28.0, 30.0);
    assert!(two(low) && !two(high));
    while high - low > 2e-5 * low {
        let middle = 0.5 * (low + high);
        if two(middle) {
            low = middle
        } else {
            high = middle
        }
    }
    // continuation stops within 2e-4 of it; differences have an additional error of 4.5 / N^2, as measured
    for (discretisation, tolerance) in [
        (SPECTRAL, 2e-4),
        (DIFFERENCES, 2e-3),
        (Discretisation::FiniteDifferences { nodes: 201 }, 8e-3),
        (Discretisation::FiniteDifferences { nodes: 801 }, 7e-4),
    ] {
        let outcome = disc
            .solver(discretisation)
            .solve(Control::Intensity(asked), &NewtonOptions::default());
        let Err(NewtonError::LimitPoint {
            quantity,
            reached,
            wanted,
            report,
        }) = outcome
        else {
            panic!("{discretisation:?}: {outcome:?}");
        };
        assert!(quantity.starts_with("force intensity"), "{quantity}");
        assert_eq!((wanted, report.stopped_by), (asked, None));
        assert!(
            (reached / low - 1.0).abs() < tolerance,
            "{discretisation:?}: {reached}, {low}"
        );
    }
}

/// Without continuation the end of the branch is unknown, but no curve with loops is a result.
#[test]
fn without_load_steps_another_branch_is_an_error_too() {
    let disc = Disc {
        radius: 0.12226,
        amplitude: 0.5582,
    };
    let options = NewtonOptions::default().with_max_load_steps(0);
    for nodes in [101, 201, 401, 801, 1601] {
        let outcome = disc
            .solver(Discretisation::FiniteDifferences { nodes })
            .solve(Control::Intensity(739.84), &options);
        assert!(
            matches!(
                outcome,
                Err(NewtonError::OtherBranch { .. } | NewtonError::NotConverged { .. })
            ),
            "{nodes}: {outcome:?}"
        );
    }
}

/// A branch may turn back twice and continue under larger loads, here at a total force of 169: an equilibrium there has as many loops, but
/// a rising load does not reach it.
#[test]
fn equilibria_beyond_two_limit_points_are_not_results() {
    let wave = |s: f64| 1.0 + 0.8733245064194779 * (TAU * (s + 0.9097600797022831)).cos();
    let stiffness = move |s: f64| wave(s) * if s < 0.7 { 1.0 } else { 1.3606585151805919 };
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap())
        .with_stiffness(Stiffness::function(stiffness, &[0.7]).unwrap());
    let options = NewtonOptions::default();
    for discretisation in [SPECTRAL, DIFFERENCES] {
        let solver = Solver::new(&membrane, discretisation).unwrap();
        // within reach: the volume has its maximum before the limit, and falls
        let solve = |force| solver.solve(Control::TotalForce(force), &options);
        let (before, after) = (solve(160.0).unwrap(), solve(168.5).unwrap());
        assert!(after.intensity > before.intensity);
        assert!(after.measures.volume < before.measures.volume);
        for force in [170.0, 180.0, 250.0, 500.0, 1000.0, 4881.6] {
            let outcome = solve(force);
            let Err(NewtonError::LimitPoint { reached, .. }) = outcome else {
                panic!("{force} {discretisation:?}: {outcome:?}");
            };
            assert!((reached - 169.0).abs() < 0.2, "{force}: {reached}");
        }
    }
}

/// Near its limit point this membrane is a thousand times its size, and steps on fine elements are 2e-9 because of rounding: continuation must
/// distinguish this from the end of the branch.
#[test]
fn rounding_does_not_end_continuation_early() {
    let radius = 0.18008754300863378;
    let wave = |s: f64| 1.0 - 0.8922928507348119 * (TAU * s).cos();
    let stiffness = move |s: f64| wave(s) * if s < 0.6 { 1.0 } else { 0.6328613604936809 };
    let rest = ReferenceShape::balloon(6.965507011735689 * radius, radius).unwrap();
    let membrane =
        Membrane::new(rest).with_stiffness(Stiffness::function(stiffness, &[0.6]).unwrap());
    let solver = Solver::new(&membrane, SPECTRAL).unwrap();
    let options = NewtonOptions::default();
    // differences of 6 401 nodes reach 77.21 too and not 77.22
    let limit = 77.215;
    assert!(solver.solve(Control::Intensity(77.2), &options).is_ok());
    for asked in [77.3, 78.0, 90.0, 148.0] {
        let outcome = solver.solve(Control::Intensity(asked), &options);
        let Err(NewtonError::LimitPoint { reached, .. }) = outcome else {
            panic!("{asked}: {outcome:?}");
        };
        assert!((reached / limit - 1.0).abs() < 2e-4, "{asked}: {reached}");
    }
}

/// The same with two limit points within a thousandth of the load and near each other: a step from just below the first ends beyond the second unless
/// the rates at its ends are compared.
#[test]
fn a_narrow_pair_of_limit_points_is_not_stepped_over() {
    let radius = 1.6301606497749683;
    let wave = |s: f64| 1.0 - 0.11008719555488762 * (TAU * s).cos();
    let stiffness = move |s: f64| wave(s) * if s < 0.4 { 1.0 } else { 0.2701328495626068 };
    let rest = ReferenceShape::balloon(0.17363534843984182 * radius, radius).unwrap();
    let membrane =
        Membrane::new(rest).with_stiffness(Stiffness::function(stiffness, &[0.4]).unwrap());
    let differences = |nodes| Discretisation::FiniteDifferences { nodes };
    for discretisation in [
        SPECTRAL,
        differences(401),
        differences(801),
        differences(1601),
    ] {
        let solver = Solver::new(&membrane, discretisation).unwrap();
        for asked in [109.0, 112.0, 130.0, 150.0, 194.3582093112442, 300.0, 600.0] {
            let outcome = solver.solve(Control::Intensity(asked), &NewtonOptions::default());
            let Err(NewtonError::LimitPoint { reached, .. }) = outcome else {
                panic!("{asked} {discretisation:?}: {outcome:?}");
            };
            // the error of 400 cells is 1.5e-3
            assert!((reached / 108.75 - 1.0).abs() < 2e-3, "{asked}: {reached}");
        }
    }
}
