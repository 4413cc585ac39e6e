//! Section 3.2: the evolving method.

use super::*;

/// One scalar membrane of four free nodes: M_sys, M_e, the block dF_p/dc on the velocities, M_d, for U = (c, v).
struct SmallSystem {
    sys: DMatrix<f64>,
    elastic: DMatrix<f64>,
    pressure_slope: DMatrix<f64>,
    damping: DMatrix<f64>,
}

const FREE: usize = 4;
const MU: f64 = 0.7;

fn small_system() -> SmallSystem {
    let springs = DMatrix::from_fn(FREE, FREE, |i, j| match i.abs_diff(j) {
        0 => -2.0,
        1 => 1.0,
        _ => 0.0,
    });
    let slope = DMatrix::from_fn(FREE, FREE, |i, j| {
        0.4 * (j as f64 - i as f64).clamp(-1.0, 1.0)
    });
    let block = |row: usize, column: usize, entries: &DMatrix<f64>| {
        let mut whole = DMatrix::zeros(2 * FREE, 2 * FREE);
        whole
            .view_mut((row, column), (FREE, FREE))
            .copy_from(entries);
        whole
    };
    let identity = DMatrix::identity(FREE, FREE);
    SmallSystem {
        sys: block(0, FREE, &identity),
        elastic: block(FREE, 0, &springs),
        pressure_slope: block(FREE, FREE, &slope),
        damping: block(FREE, FREE, &(identity * -MU)),
    }
}

/// A vector (0, g(i)): a force on the velocities.
fn force(g: impl Fn(usize) -> f64) -> DVector<f64> {
    DVector::from_fn(2 * FREE, |i, _| if i < FREE { 0.0 } else { g(i - FREE) })
}

#[test]
fn eq_24_subtracts_the_elastic_force_of_the_rest_shape() {
    // M_e U - F^0 must vanish at c = c0 for any velocity, so F^0 = K c0 without damping.
    let system = small_system();
    let at_rest = DVector::from_fn(2 * FREE, |i, _| if i < FREE { 1.0 + i as f64 } else { 5.0 });
    let moving_less =
        DVector::from_fn(2 * FREE, |i, _| if i < FREE { 1.0 + i as f64 } else { 2.0 });
    let elastic_rest = &system.elastic * &at_rest;
    assert_eq!((&system.elastic * &moving_less - &elastic_rest).norm(), 0.0);
    assert!((&system.elastic * &moving_less - &system.damping * &at_rest).norm() > 1.0);
}

/// The misprints of Eq. 28 and 29 to apply.
#[derive(Default)]
struct Misprints {
    elastic_sign: bool,
    pressure_slope: bool,
    forces_without_dt: bool,
    damping_without_dt: bool,
}

/// Difference of one step from implicit Euler with a linear F_p: c+ = c + dt v+ and v+ = v + dt (K (c+ - c0) + F_p(c) + F_p' (c+ - c) - mu
/// v). Zero up to rounding if the step is correct.
fn step_defect(misprints: Misprints) -> f64 {
    let SmallSystem {
        sys,
        elastic,
        pressure_slope,
        damping,
    } = small_system();
    let dt = 0.1;
    let identity = DMatrix::<f64>::identity(2 * FREE, 2 * FREE);
    let state = DVector::from_fn(2 * FREE, |i, _| (i as f64 * 0.9).sin());
    let (push, rest) = (force(|i| 1.0 + 0.1 * i as f64), force(|i| 0.3 * i as f64));
    let dm_p = &pressure_slope * dt;

    let elastic_sign = if misprints.elastic_sign { -1.0 } else { 1.0 };
    let slope_factor = if misprints.pressure_slope { -dt } else { 1.0 };
    let matrix = &identity - (&sys + &elastic * elastic_sign + &dm_p * slope_factor) * dt;
    let force_factor = if misprints.forces_without_dt { 1.0 } else { dt };
    let damping_factor = if misprints.damping_without_dt {
        1.0
    } else {
        dt
    };
    let right = (&identity + &damping * damping_factor) * &state + (&push - &rest) * force_factor;
    let next = matrix.lu().solve(&right).expect("a regular matrix");

    let moved = DVector::from_fn(2 * FREE, |i, _| {
        if i < FREE {
            0.0
        } else {
            next[i - FREE] - state[i - FREE]
        }
    });
    let euler = &state
        + (&sys * &next + &elastic * &next - &rest
            + &push
            + &pressure_slope * moved
            + &damping * &state)
            * dt;
    (next - euler).norm()
}

#[test]
fn eq_28_and_29_signs_and_time_steps_of_implicit_euler() {
    assert!(step_defect(Misprints::default()) < 1e-14);
    let printed = [
        Misprints {
            elastic_sign: true,
            ..Misprints::default()
        },
        Misprints {
            pressure_slope: true,
            ..Misprints::default()
        },
        Misprints {
            forces_without_dt: true,
            ..Misprints::default()
        },
        Misprints {
            damping_without_dt: true,
            ..Misprints::default()
        },
    ];
    for (which, misprints) in printed.into_iter().enumerate() {
        assert!(step_defect(misprints) > 1e-3, "misprint {which}");
    }
}

#[test]
fn after_eq_29_the_norm_to_stop_at_is_that_of_pressure_and_springs() {
    let c0 = balloon(201, H, INNER);
    let c = equilibrium(&c0, 17.5);
    assert!(imbalance(&c, &c0, 17.5) < 1e-8);
    // At equilibrium |F_e| = f at every node: |F_e + F_e| never falls below 2 f.
    let springs = elastic(&c, &c0, 50) * 2.0;
    assert!((springs.norm() - 35.0).abs() < 1e-8);
}

/// The evolving method, total force, banded part of the Jacobian; the imbalance after each step until 1e-4.
fn evolve(dt: f64, mu: f64, max_steps: usize) -> Vec<f64> {
    const TOTAL_FORCE: f64 = 2588.9;
    let c0 = balloon(201, H, INNER);
    let k_scale = spacing(&c0).powi(-2);
    let (mut c, mut v) = (c0.clone(), vec![Vector2::zeros(); 199]);
    let mut norms = Vec::new();
    while norms.len() < max_steps {
        let f = TOTAL_FORCE / surface(&c);
        let rows: Vec<_> = (1..200)
            .map(|k| {
                let (before, after) = jacobian_corrected(&c, k, f);
                let spring = Matrix2::identity() * k_scale;
                let at = Matrix2::identity() * (1.0 + dt * mu + 2.0 * dt * dt * k_scale);
                (
                    (before + spring) * -(dt * dt),
                    at,
                    (after + spring) * -(dt * dt),
                )
            })
            .collect();
        let rhs: Vec<_> = (1..200)
            .map(|k| v[k - 1] + (pressure(&c, k, f) + elastic(&c, &c0, k)) * dt)
            .collect();
        v = block_tridiagonal(&rows, &rhs);
        for (node, velocity) in c[1..].iter_mut().zip(&v) {
            *node += velocity * dt;
        }
        norms.push(imbalance(&c, &c0, TOTAL_FORCE / surface(&c)));
        if *norms.last().expect("just pushed") < 1e-4 {
            break;
        }
    }
    norms
}

#[test]
fn section_4_2_the_norm_falls_at_every_step_for_large_steps_only() {
    for mu in [0.0, 0.5, 1.0] {
        for dt in [2.0, 4.0] {
            let norms = evolve(dt, mu, 30);
            assert!(
                norms.windows(2).all(|pair| pair[1] < pair[0]),
                "dt {dt}, mu {mu}: {norms:?}"
            );
            assert!(norms.len() <= 12, "dt {dt}, mu {mu}: {norms:?}");
        }
        let norms = evolve(0.5, mu, 30);
        assert!(
            norms.windows(2).any(|pair| pair[1] > pair[0]),
            "dt 0.5, mu {mu}: {norms:?}"
        );
    }
}
