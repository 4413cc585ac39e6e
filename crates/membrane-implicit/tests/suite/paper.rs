//! The paper's scheme: against the dense solution of the block system of Eq. 28, and the behaviour of Fig. 10.

use membrane_implicit::membrane_newton::{Control, Discretisation, NewtonOptions, Solver};
use membrane_implicit::{
    EvolvingOptions, ImplicitError, Jacobian, Membrane, PressureLaw, ReferenceShape, Stiffness,
    evolve,
};
use nalgebra::{DMatrix, DVector};

const TOTAL_FORCE: f64 = 2588.9;

fn balloon() -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
}

/// The paper's forces, implemented from its text for interior nodes, first and second neighbours.
struct Twin {
    rest: Vec<f64>,
    lambda: f64,
    lambda_2: f64,
    total_force: f64,
}

impl Twin {
    fn n(&self) -> usize {
        self.rest.len() / 2
    }

    fn elastic(&self, c: &[f64]) -> DVector<f64> {
        let n = self.n();
        let ds = 1.0 / (n - 1) as f64;
        let mut f = DVector::zeros(2 * n);
        for k in 0..2 {
            // beyond a fixed end the displacement is its mirror image
            let u = |m: i64| -> f64 {
                let at = |m: usize| c[2 * m + k] - self.rest[2 * m + k];
                let last = n as i64 - 1;
                if m < 0 {
                    2.0 * at(0) - at((-m) as usize)
                } else if m > last {
                    2.0 * at(n - 1) - at((2 * last - m) as usize)
                } else {
                    at(m as usize)
                }
            };
            for m in 1..n as i64 - 1 {
                f[2 * m as usize + k] = (self.lambda * (u(m + 1) - 2.0 * u(m) + u(m - 1))
                    + self.lambda_2 * (u(m + 2) - 2.0 * u(m) + u(m - 2)))
                    / (ds * ds);
            }
        }
        f
    }

    fn intensity(&self, c: &[f64]) -> f64 {
        // lateral surface: frustums, with |y| over the whole curve, halved
        let n = self.n();
        let sum: f64 = (1..n)
            .map(|m| {
                let (a, b) = (c[2 * m - 1], c[2 * m + 1]);
                let length = (c[2 * m] - c[2 * m - 2]).hypot(b - a);
                assert!(a * b >= -1e-4, "the reference needs a node at the apex");
                std::f64::consts::PI * (a + b).abs() * length
            })
            .sum();
        self.total_force / (0.5 * sum)
    }

    fn pressure(&self, c: &[f64], f: f64) -> DVector<f64> {
        let n = self.n();
        let mut out = DVector::zeros(2 * n);
        for m in 1..n - 1 {
            let (dx, dy) = (c[2 * m + 2] - c[2 * m - 2], c[2 * m + 3] - c[2 * m - 1]);
            let r = dx.hypot(dy);
            out[2 * m] = -f * dy / r;
            out[2 * m + 1] = f * dx / r;
        }
        out
    }

    fn derivative(&self, c: &[f64], force: impl Fn(&[f64]) -> DVector<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(c.len(), c.len());
        let step = 1e-6;
        for j in 0..c.len() {
            let (mut a, mut b) = (c.to_vec(), c.to_vec());
            a[j] += step;
            b[j] -= step;
            out.set_column(j, &((force(&a) - force(&b)) / (2.0 * step)));
        }
        out
    }

    /// Eq. 28 with its signs and factors dt corrected, for U = (c, c_t): 4 N unknowns.
    fn step(&self, dt: f64, mu: f64, full: bool, c: &mut [f64], v: &mut [f64]) {
        let n = c.len();
        let f = self.intensity(c);
        let k = self.derivative(c, |c| self.elastic(c));
        let dp = self.derivative(c, |c| {
            self.pressure(c, if full { self.intensity(c) } else { f })
        });
        let mut matrix = DMatrix::identity(2 * n, 2 * n);
        let mut rhs = DVector::zeros(2 * n);
        let constant = self.elastic(c) - &k * DVector::from_column_slice(c);
        let load = self.pressure(c, f);
        for i in 0..n {
            matrix[(i, n + i)] = -dt;
            rhs[i] = c[i];
            rhs[n + i] = v[i];
            if i < 2 || i >= n - 2 {
                continue;
            }
            rhs[n + i] += dt * (constant[i] + load[i]);
            matrix[(n + i, n + i)] += dt * mu;
            for j in 0..n {
                matrix[(n + i, j)] -= dt * k[(i, j)];
                matrix[(n + i, n + j)] -= dt * dt * dp[(i, j)];
            }
        }
        let u = matrix.lu().solve(&rhs).unwrap();
        c.copy_from_slice(&u.as_slice()[..n]);
        v.copy_from_slice(&u.as_slice()[n..]);
    }
}

#[test]
fn steps_equal_the_block_system_of_eq_28() {
    let n_nodes = 21;
    for (jacobian, full) in [(Jacobian::Band, false), (Jacobian::Exact, true)] {
        for lambda_2 in [0.0, 0.3] {
            for dt in [0.05, 2.0] {
                let mut membrane = balloon();
                if lambda_2 > 0.0 {
                    membrane =
                        membrane.with_second_neighbours(Stiffness::constant(lambda_2).unwrap());
                }
                // mass 1 and damping 0.7, relative to the stiffness
                let stiffness = 1.0 + 4.0 * lambda_2;
                let options = EvolvingOptions::default()
                    .with_max_steps(4)
                    .with_mass(1.0 / stiffness)
                    .with_damping(0.7 / stiffness)
                    .with_dt(dt)
                    .with_jacobian(jacobian);
                // four steps do not converge: the error contains the evolution
                let Err(ImplicitError::NotSettled { evolution: ours }) =
                    evolve(&membrane, n_nodes, TOTAL_FORCE, &options)
                else {
                    panic!("{options:?}")
                };
                let mut c: Vec<f64> = ours.frames[0].points.as_flattened().to_vec();
                let mut v = vec![0.0; c.len()];
                let twin = Twin {
                    rest: c.clone(),
                    lambda: 1.0,
                    lambda_2,
                    total_force: TOTAL_FORCE,
                };
                for frame in &ours.frames[1..] {
                    twin.step(dt, 0.7, full, &mut c, &mut v);
                    let worst = frame
                        .points
                        .as_flattened()
                        .iter()
                        .zip(&c)
                        .map(|(a, b)| (a - b).abs())
                        .fold(0.0, f64::max);
                    // The derivatives of the reference are differences with step 1e-6: rounding 1e-16 / 1e-6 of forces of order 1e3, times dt^2 over
                    // a stiffness of 1/ds^2 = 400.
                    assert!(
                        worst < 1e-6,
                        "{jacobian:?} lambda_2 {lambda_2} dt {dt}: {worst:e}"
                    );
                }
            }
        }
    }
}

/// Errata of section 4.2, Fig. 10: from dt = 2 on, 8 to 10 steps.
#[test]
fn the_band_jacobian_decreases_the_norm_at_every_step_for_large_steps() {
    for dt in [2.0, 4.0, 10.0, 100.0, 1e4] {
        for mu in [0.0, 0.25, 0.5, 1.0] {
            let options = EvolvingOptions::default().with_dt(dt).with_damping(mu);
            let run = evolve(&balloon(), 201, TOTAL_FORCE, &options).unwrap();
            assert!(run.is_monotone(), "dt {dt} mu {mu}: {:?}", run.norms);
            assert!(
                (8..=10).contains(&run.steps),
                "dt {dt} mu {mu}: {:?}",
                run.norms
            );
            // a linear tail: every ratio from the third on close to the last
            let ratios: Vec<f64> = run.norms.windows(2).map(|p| p[1] / p[0]).collect();
            let rate = ratios[ratios.len() - 1];
            println!("dt {dt} mu {mu}: {} steps, rate {rate:.4}", run.steps);
            assert!((0.15..0.27).contains(&rate), "dt {dt} mu {mu}: {ratios:?}");
            assert!(
                ratios[3..].iter().all(|r| (r / rate - 1.0).abs() < 0.15),
                "{ratios:?}"
            );
        }
    }
}

#[test]
fn small_steps_oscillate() {
    for dt in [0.05, 0.1, 0.25, 0.5] {
        for mu in [0.0, 0.25, 0.5, 1.0] {
            let options = EvolvingOptions::default().with_dt(dt).with_damping(mu);
            let run = evolve(&balloon(), 201, TOTAL_FORCE, &options).unwrap();
            println!("dt {dt} mu {mu}: {} steps", run.steps);
            assert!(!run.is_monotone(), "dt {dt} mu {mu}: {:?}", run.norms);
        }
    }
}

#[test]
fn rank_one_part_makes_large_steps_quadratic() {
    let options = EvolvingOptions::default()
        .with_tolerance(1e-10)
        .with_dt(1e5)
        .with_jacobian(Jacobian::Exact);
    let run = evolve(&balloon(), 201, TOTAL_FORCE, &options).unwrap();
    println!("{:?}", run.norms);
    assert!(run.steps <= 5, "{:?}", run.norms);
    // e(k+1) <= C e(k)^2 with one C until rounding (about 1e-11: 1e-16 over ds^2)
    for pair in run.norms.windows(2).skip(1) {
        assert!(
            pair[1] < (0.05 * pair[0] * pair[0]).max(1e-9),
            "{:?}",
            run.norms
        );
    }
}

#[test]
fn evolution_converges_to_the_equilibrium_of_newton() {
    let membrane = balloon().with_law(PressureLaw::TotalForce);
    let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes: 201 }).unwrap();
    let direct = solver
        .solve(Control::TotalForce(TOTAL_FORCE), &NewtonOptions::default())
        .unwrap();
    for dt in [0.5, 2.0] {
        let run = evolve(
            &membrane,
            201,
            TOTAL_FORCE,
            &EvolvingOptions::default().with_dt(dt),
        )
        .unwrap();
        // A residual of norm 1e-4 divided by the lowest eigenvalue of the springs, pi^2, is 1e-5 cm on average; the pressure reduces the stiffness.
        let distance = run.distance_to(&direct.points()).unwrap();
        println!("dt {dt}: {distance:e} cm from Newton's solution");
        assert!(distance < 1e-4, "dt {dt}: {distance:e}");
    }
}

/// Springs of 1e-6 to 1e6 times the stiffness, and a membrane of another size, move in the same way under as many times the force.
#[test]
fn evolution_does_not_depend_on_the_units_of_force_and_length() {
    let options = EvolvingOptions::default();
    let one = evolve(&balloon(), 101, TOTAL_FORCE, &options).unwrap();
    for exponent in [-6, -4, -2, 0, 2, 4, 6] {
        for size in [1.0, 1e-3, 1e3] {
            let k = 10f64.powi(exponent);
            let rest = ReferenceShape::balloon(8.5 * size, 1.75 * size).unwrap();
            let membrane = Membrane::new(rest).with_stiffness(Stiffness::constant(k).unwrap());
            let force = TOTAL_FORCE * k * size.powi(3);
            let run = evolve(&membrane, 101, force, &options).unwrap();
            assert_eq!(run.steps, one.steps, "k {k} size {size}");
            let scaled: Vec<_> = one.points.iter().map(|p| p.map(|x| x * size)).collect();
            // rounding of k times the forces only
            let distance = run.distance_to(&scaled).unwrap() / size;
            assert!(distance < 1e-11, "k {k} size {size}: {distance:e}");
        }
    }
}

#[test]
fn frames_contain_forces_that_balance_at_the_end() {
    let run = evolve(&balloon(), 101, TOTAL_FORCE, &EvolvingOptions::default()).unwrap();
    assert_eq!(run.frames.len(), run.steps + 1);
    for (frame, norm) in run.frames.iter().zip(&run.norms) {
        let sum: f64 = frame
            .elastic
            .as_flattened()
            .iter()
            .zip(frame.pressure.as_flattened())
            .map(|(e, p)| (e + p) * (e + p))
            .sum();
        let own = (sum / 100.0).sqrt();
        assert!(
            (own - norm).abs() <= 1e-12 * run.norms[0],
            "{own} and {norm}"
        );
    }
    // in the reference configuration the elastic force is zero and the pressure is F / S everywhere
    let first = &run.frames[0];
    assert!(first.elastic.as_flattened().iter().all(|e| *e == 0.0));
    let distances = run.points.iter().zip(&first.points);
    let distances = distances.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
    let farthest = distances.fold(0.0, f64::max);
    assert!(farthest > 0.1 && run.distance_to(&first.points) == Ok(farthest));
    let [x, y] = first.pressure[50];
    let surface = std::f64::consts::TAU * 1.75 * (8.5 + 1.75);
    // the surface of the polyline is smaller than that of the body by (ds/R)^2
    assert!(
        y.abs() < 1e-9 && (x * surface / TOTAL_FORCE - 1.0).abs() < 2e-3,
        "{x} {y}"
    );
    assert_eq!(first.pressure[0], [0.0; 2]);
}

#[test]
fn a_run_without_convergence_is_an_error() {
    let options = EvolvingOptions::default().with_max_steps(3);
    let error = evolve(&balloon(), 201, TOTAL_FORCE, &options).unwrap_err();
    let ImplicitError::NotSettled { evolution: run } = &error else {
        panic!("{error}")
    };
    assert!(error.to_string().ends_with(" after 3 steps"), "{error}");
    assert_eq!((run.steps, run.norms.len()), (3, 4));
    // frames of every second step and of the last one, or none
    for (every, expected) in [(2, &[0, 2, 3][..]), (0, &[])] {
        let options = options.clone().with_frame_every(every);
        let error = evolve(&balloon(), 201, TOTAL_FORCE, &options).unwrap_err();
        let ImplicitError::NotSettled { evolution: run } = &error else {
            panic!("{error}")
        };
        let steps: Vec<usize> = run.frames.iter().map(|frame| frame.step).collect();
        assert_eq!(steps, expected);
    }
}

/// Newton's method has no equilibrium below -97.6 either: walls that have passed through each other are no body.
#[test]
fn an_equilibrium_with_crossed_walls_is_an_error() {
    let membrane = balloon().with_law(PressureLaw::PerCurrentLength);
    let options = EvolvingOptions::default().with_jacobian(Jacobian::Exact);
    for total_force in [-100.0, -150.0, -300.0] {
        let error = evolve(&membrane, 51, total_force, &options).unwrap_err();
        assert!(
            matches!(error, ImplicitError::Collapsed { .. }),
            "{total_force}: {error}"
        );
    }
    assert!(evolve(&membrane, 51, -50.0, &options).is_ok());
}
