//! Iterative solvers against dense linear algebra and known theorems.

use crate::common;

use common::dense::{Dense, dot, many, not_negative};
use common::noise;
use radon::{
    CglsOptions, EmOptions, LinearOperator, SirtOptions, StopReason, Stopping, cgls, mlem, sirt,
};

/// Weighted least squares by normal equations and Gaussian elimination with pivoting.
fn least_squares(a: &Dense, weights: &[f64], b: &[f64]) -> Vec<f64> {
    let n = a.image_len();
    let mut m: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let entry = |f: &dyn Fn(usize) -> f64| {
                (0..b.len()).map(|k| weights[k] * a.0[k][i] * f(k)).sum()
            };
            let mut row: Vec<f64> = (0..n).map(|j| entry(&|k| a.0[k][j])).collect();
            row.push(entry(&|k| b[k]));
            row
        })
        .collect();
    for i in 0..n {
        let pivot = (i..n)
            .max_by(|&p, &q| m[p][i].abs().total_cmp(&m[q][i].abs()))
            .unwrap();
        m.swap(i, pivot);
        for r in 0..n {
            if r != i {
                let f = m[r][i] / m[i][i];
                for c in i..=n {
                    m[r][c] -= f * m[i][c];
                }
            }
        }
    }
    (0..n).map(|i| m[i][n] / m[i][i]).collect()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn cgls_reaches_the_least_squares_solution_in_as_many_steps_as_unknowns() {
    let a = Dense((0..12).map(|i| noise(7, 100 + i)).collect());
    let b = noise(12, 3);
    let expected = least_squares(&a, &[1.0; 12], &b);
    let mut x = noise(7, 8);
    let report = cgls(
        &a,
        &b,
        &mut x,
        &CglsOptions::default().with_gradient(1e-13),
        radon::no_observer,
    )
    .unwrap();
    // Condition of a random 12 x 7 matrix about 5: the normal equations have 14 correct digits.
    assert!(
        distance(&x, &expected) < 1e-12,
        "{}",
        distance(&x, &expected)
    );
    assert_eq!(report.stopped_by, Some(StopReason::Gradient));
    assert!(report.iterations <= 9, "{}", report.iterations);
    assert_eq!(report.history.len(), report.iterations + 1);
    for pair in report.history.windows(2) {
        assert!(pair[1].residual <= pair[0].residual);
    }
    // A start at the solution needs no step.
    let again = cgls(
        &a,
        &b,
        &mut x,
        &CglsOptions::default().with_gradient(1e-12),
        radon::no_observer,
    )
    .unwrap();
    assert_eq!(
        (again.iterations, again.stopped_by),
        (0, Some(StopReason::Gradient))
    );
}

#[test]
fn cgls_from_zero_reaches_the_shortest_of_many_solutions() {
    // The last column repeats the first: the shortest solution divides the weight evenly.
    let mut a = Dense((0..9).map(|i| noise(5, 40 + i)).collect());
    for row in &mut a.0 {
        row[4] = row[0];
    }
    let b = noise(9, 77);
    let reduced = Dense(
        a.0.iter()
            .map(|r| vec![2.0 * r[0], r[1], r[2], r[3]])
            .collect(),
    );
    let expected = least_squares(&reduced, &[1.0; 9], &b);
    let mut x = vec![0.0; 5];
    cgls(
        &a,
        &b,
        &mut x,
        &CglsOptions::default().with_gradient(1e-12),
        radon::no_observer,
    )
    .unwrap();
    assert!(distance(&x[..4], &expected) < 1e-11);
    assert!((x[4] - x[0]).abs() < 1e-13);
    let zero = cgls(
        &a,
        &[0.0; 9],
        &mut [0.0; 5],
        &CglsOptions::default(),
        radon::no_observer,
    )
    .unwrap();
    assert_eq!(
        (zero.iterations, zero.stopped_by),
        (0, Some(StopReason::Solved))
    );
}

#[test]
fn sirt_converges_to_the_weighted_least_squares_solution_within_its_bounds() {
    let a = not_negative(10, 4, 5);
    let b = noise(10, 2);
    let weights: Vec<f64> =
        a.0.iter()
            .map(|row| 1.0 / row.iter().sum::<f64>())
            .collect();
    let expected = least_squares(&a, &weights, &b);
    for relaxation in [0.5, 1.0, 1.9] {
        let mut x = vec![0.0; 4];
        let stopping = Stopping::default()
            .with_max_iterations(20_000)
            .with_change(1e-14);
        let options = SirtOptions::default()
            .with_relaxation(relaxation)
            .with_stopping(stopping);
        let report = sirt(&a, &b, &mut x, &options, radon::no_observer).unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Change));
        // The slowest mode decreases by a factor of about 0.97 per step: a change of 1e-14 is a distance of about 1e-12.
        assert!(
            distance(&x, &expected) < 1e-11,
            "{relaxation}: {}",
            distance(&x, &expected)
        );
    }
    let (lower, upper) = (-0.1, 0.05);
    assert!(expected.iter().any(|&x| x < lower) && expected.iter().any(|&x| x > upper));
    let mut x = vec![0.0; 4];
    let bounded = SirtOptions::default()
        .with_lower(lower)
        .with_upper(upper)
        .with_stopping(many(20_000));
    let report = sirt(&a, &b, &mut x, &bounded, radon::no_observer).unwrap();
    assert_eq!(
        (report.iterations, report.stopped_by),
        (20_000, Some(StopReason::MaxIterations))
    );
    assert!(x.contains(&lower) && x.contains(&upper));
    // Kuhn-Tucker: the gradient is zero inside the bounds and points outwards at a bound.
    let mut ax = vec![0.0; 10];
    a.forward_into(&x, &mut ax).unwrap();
    let pull: Vec<f64> = (0..10).map(|i| weights[i] * (b[i] - ax[i])).collect();
    let mut gradient = vec![0.0; 4];
    a.adjoint_into(&pull, &mut gradient).unwrap();
    for (x, g) in x.iter().zip(&gradient) {
        assert!((lower..=upper).contains(x));
        if *x == lower {
            assert!(*g <= 1e-9);
        } else if *x == upper {
            assert!(*g >= -1e-9);
        } else {
            assert!(g.abs() < 1e-9, "{g}");
        }
    }
}

#[test]
fn one_step_of_mlem_equals_its_formula() {
    let a = not_negative(6, 3, 9);
    let (b, s) = (
        vec![3.0, 0.0, 2.0, 5.0, 1.0, 4.0],
        vec![0.1, 0.2, 0.0, 0.3, 0.0, 0.5],
    );
    let mut x = vec![0.5, 1.0, 2.0];
    let before = x.clone();
    mlem(
        &a,
        &b,
        &mut x,
        &EmOptions::default()
            .with_background(s.clone())
            .with_stopping(many(1)),
        radon::no_observer,
    )
    .unwrap();
    for j in 0..3 {
        let (mut up, mut down) = (0.0, 0.0);
        for i in 0..6 {
            up += a.0[i][j] * b[i] / (dot(&a.0[i], &before) + s[i]);
            down += a.0[i][j];
        }
        assert!((x[j] - before[j] * up / down).abs() < 1e-14);
    }
}

#[test]
fn mlem_increases_the_likelihood_conserves_counts_and_is_stationary_at_the_solution() {
    let a = not_negative(20, 8, 50);
    let b: Vec<f64> = noise::<f64>(20, 4)
        .iter()
        .map(|x| (5.0 + 5.0 * x).round())
        .collect();
    let mut x = vec![1.0; 8];
    let mut ax = vec![0.0; 20];
    let mut last = f64::NEG_INFINITY;
    for _ in 0..60 {
        let report = mlem(
            &a,
            &b,
            &mut x,
            &EmOptions::default().with_stopping(many(1)),
            radon::no_observer,
        )
        .unwrap();
        let likelihood = report.history[0].log_likelihood.unwrap();
        // Sums of about 100 terms to 16 digits.
        assert!(likelihood >= last - 1e-12, "{last} {likelihood}");
        last = likelihood;
        a.forward_into(&x, &mut ax).unwrap();
        assert!((ax.iter().sum::<f64>() - b.iter().sum::<f64>()).abs() < 1e-11);
        assert!(x.iter().all(|&x| x >= 0.0));
        // The reported likelihood is that of the previous image; it is computed here for the next iteration.
        let direct: f64 = ax.iter().zip(&b).map(|(e, b)| b * e.ln() - e).sum();
        let next = mlem(
            &a,
            &b,
            &mut x.clone(),
            &EmOptions::default().with_stopping(many(1)),
            radon::no_observer,
        )
        .unwrap();
        assert!((next.history[0].log_likelihood.unwrap() - direct).abs() < 1e-11);
    }
    let truth: Vec<f64> = (0..8).map(f64::from).collect();
    let background = vec![0.7; 20];
    a.forward_into(&truth, &mut ax).unwrap();
    let data: Vec<f64> = ax.iter().map(|x| x + 0.7).collect();
    let mut x = truth.clone();
    let rules = Stopping::default().with_change(1e-14);
    let options = EmOptions::default()
        .with_background(background)
        .with_stopping(rules);
    let report = mlem(&a, &data, &mut x, &options, radon::no_observer).unwrap();
    assert_eq!(
        (report.iterations, report.stopped_by),
        (1, Some(StopReason::Change))
    );
    assert!(distance(&x, &truth) < 1e-13);
}
