//! Iterative solvers on projectors: recovery, subsets, stopping rules, threads, bad input.

mod bad_inputs;

use crate::common;

use common::dense::{Dense, dot, many, not_negative};
use common::noise;
use radon::{
    BinSampling, CglsOptions, EmOptions, ImageGrid, IterativeReport, Kernel, LinearOperator,
    ParallelGeometry, Phantom2, Projector, RadonError, Sample, SirtOptions, StackOrder, StopReason,
    Stopping, Subset, cgls, mlem, osem, sirt,
};

/// A head phantom, 40 views, twice the bins: consistent data for the operator.
fn scene() -> (Projector, Vec<f64>, Vec<f64>) {
    let geometry = ParallelGeometry::half_turn(40, 36, 1.0).unwrap();
    let projector = Projector::new(
        &geometry,
        &ImageGrid::new(24, 22, 1.0).unwrap(),
        Kernel::Strip,
    )
    .unwrap();
    let mut truth: Vec<f64> = Phantom2::shepp_logan(11.0)
        .unwrap()
        .image(projector.grid())
        .unwrap();
    // 1 - 0.8 - 0.2 is -6e-17.
    truth.iter_mut().for_each(|x| *x = x.max(0.0));
    let data = projector.forward(&truth).unwrap();
    (projector, truth, data)
}

#[test]
fn every_solver_recovers_a_head_from_consistent_data() {
    let (projector, truth, data) = scene();
    let error = |x: &[f64]| {
        let off: f64 = x.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum();
        (off / dot(&truth, &truth)).sqrt()
    };
    let start = vec![0.0; truth.len()];
    let mut x = start.clone();
    let report = cgls(
        &projector,
        &data,
        &mut x,
        &CglsOptions::default().with_stopping(many(200)),
        radon::no_observer,
    )
    .unwrap();
    println!("CGLS {} steps: {:.2e}", report.iterations, error(&x));
    // The remaining error consists of modes that the blur of the strips removes.
    assert!(error(&x) < 0.03);
    let mut x = start.clone();
    sirt(
        &projector,
        &data,
        &mut x,
        &SirtOptions::default().with_stopping(many(300)),
        radon::no_observer,
    )
    .unwrap();
    println!("SIRT 300 steps: {:.2e}", error(&x));
    assert!(error(&x) < 0.15);
    let mut by_mlem = vec![1.0; truth.len()];
    let report = mlem(
        &projector,
        &data,
        &mut by_mlem,
        &EmOptions::default().with_stopping(many(30)),
        radon::no_observer,
    )
    .unwrap();
    println!("MLEM 30 steps: {:.2e}", error(&by_mlem));
    assert!(error(&by_mlem) < 0.2);
    // Ten subsets: three iterations equal thirty steps (the residual agrees within a tenth).
    let subsets = projector
        .stack_operator(1, StackOrder::ViewSliceBin)
        .unwrap()
        .subsets(10)
        .unwrap();
    let mut x = vec![1.0; truth.len()];
    let passes = osem(
        &subsets,
        &data,
        &mut x,
        &EmOptions::default().with_stopping(many(4)),
        radon::no_observer,
    )
    .unwrap();
    println!("OSEM 10 x 4: {:.2e}", error(&x));
    assert!(error(&x) < 1.2 * error(&by_mlem));
    assert!(passes.history[3].residual < report.history[20].residual);
    assert!(x.iter().all(|&x| x >= 0.0));
}

#[test]
fn subsets_contain_each_datum_once_and_the_rows_of_the_whole() {
    let geometry = ParallelGeometry::new([0.1, 0.9, 1.4, 2.0, 2.9], 7, 1.0)
        .and_then(|g| g.with_offset(0.3))
        .unwrap();
    let projector = Projector::new(
        &geometry,
        &ImageGrid::square(5, 1.0).unwrap(),
        Kernel::Joseph,
    )
    .unwrap();
    for order in [StackOrder::ViewSliceBin, StackOrder::SliceViewBin] {
        let whole = projector.stack_operator::<f64>(3, order).unwrap();
        let image = noise(75, 1);
        let mut data = vec![0.0; 105];
        whole.forward_into(&image, &mut data).unwrap();
        let subsets = whole.subsets(2).unwrap();
        let mut seen = vec![0; 105];
        for subset in &subsets {
            let (operator, indices) = (subset.operator(), subset.data());
            let mut part = vec![0.0; operator.data_len()];
            operator.forward_into(&image, &mut part).unwrap();
            for (value, &i) in part.iter().zip(indices) {
                assert_eq!(*value, data[i], "{order:?}");
                seen[i] += 1;
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        // One subset is MLEM itself.
        let counts: Vec<f64> = data.iter().map(|x| x.abs()).collect();
        let (mut a, mut b) = (vec![1.0; 75], vec![1.0; 75]);
        osem(
            &whole.subsets(1).unwrap(),
            &counts,
            &mut a,
            &EmOptions::default().with_stopping(many(3)),
            radon::no_observer,
        )
        .unwrap();
        mlem(
            &whole,
            &counts,
            &mut b,
            &EmOptions::default().with_stopping(many(3)),
            radon::no_observer,
        )
        .unwrap();
        assert_eq!(a, b);
        assert!(matches!(
            whole.subsets(6),
            Err(RadonError::OutOfRange { .. })
        ));
        assert!(matches!(whole.subsets(0), Err(RadonError::TooFew { .. })));
    }
}

#[test]
fn rules_stop_as_documented_and_unmet_ones_are_errors_with_the_report() {
    let (projector, truth, data) = scene();
    let mut x = vec![0.0; truth.len()];
    let stopping = Stopping::default()
        .with_max_iterations(500)
        .with_residual(0.02);
    let report = sirt(
        &projector,
        &data,
        &mut x,
        &SirtOptions::default().with_stopping(stopping),
        radon::no_observer,
    )
    .unwrap();
    let n = report.iterations;
    assert_eq!(report.stopped_by, Some(StopReason::Residual));
    assert!(report.history[n].residual <= 0.02 && report.history[n - 1].residual > 0.02);
    assert_eq!(report.history[n].change, None);
    let ax = projector.forward(&x).unwrap();
    let residual = ax
        .iter()
        .zip(&data)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
        / dot(&data, &data).sqrt();
    assert!((residual - report.history[n].residual).abs() < 1e-12);

    let stopping = Stopping::default()
        .with_max_iterations(5)
        .with_residual(1e-9);
    let unmet = |result: Result<IterativeReport, RadonError>| match result {
        Err(RadonError::NotConverged { report }) => {
            assert_eq!(
                (report.iterations, report.history.len(), report.stopped_by),
                (5, 5, None)
            );
        }
        other => panic!("{other:?}"),
    };
    let start = vec![1.0; truth.len()];
    unmet(sirt(
        &projector,
        &data,
        &mut start.clone(),
        &SirtOptions::default().with_stopping(stopping),
        radon::no_observer,
    ));
    unmet(cgls(
        &projector,
        &data,
        &mut start.clone(),
        &CglsOptions::default().with_stopping(stopping),
        radon::no_observer,
    ));
    unmet(mlem(
        &projector,
        &data,
        &mut start.clone(),
        &EmOptions::default().with_stopping(stopping),
        radon::no_observer,
    ));
    let none = mlem(
        &projector,
        &data,
        &mut start.clone(),
        &EmOptions::default().with_stopping(many(0)),
        radon::no_observer,
    )
    .unwrap();
    assert_eq!(
        (none.iterations, none.stopped_by),
        (0, Some(StopReason::MaxIterations))
    );
}

/// Each solver from the image `start`: its name, its result and its final image.
fn each(
    stopping: Stopping,
    start: &[f64],
) -> Vec<(&'static str, Result<IterativeReport, RadonError>, Vec<f64>)> {
    let (projector, _, data) = scene();
    let stack = projector
        .stack_operator(1, StackOrder::ViewSliceBin)
        .unwrap();
    let em = EmOptions::default().with_stopping(stopping);
    let run = |name, solve: &dyn Fn(&mut [f64]) -> Result<IterativeReport, RadonError>| {
        let mut x = start.to_vec();
        (name, solve(&mut x), x)
    };
    vec![
        run("SIRT", &|x| {
            let options = SirtOptions::default().with_stopping(stopping);
            sirt(&projector, &data, x, &options, radon::no_observer)
        }),
        run("CGLS", &|x| {
            let options = CglsOptions::default().with_stopping(stopping);
            cgls(&projector, &data, x, &options, radon::no_observer)
        }),
        run("MLEM", &|x| {
            mlem(&projector, &data, x, &em, radon::no_observer)
        }),
        run("OSEM", &|x| {
            osem(
                &stack.subsets(4).unwrap(),
                &data,
                x,
                &em,
                radon::no_observer,
            )
        }),
    ]
}

#[test]
fn every_solver_obeys_every_rule() {
    let (projector, truth, data) = scene();
    let start = vec![1.0; truth.len()];
    let residual = |x: &[f64]| {
        let ax = projector.forward(x).unwrap();
        let off: f64 = ax.iter().zip(&data).map(|(a, b)| (a - b).powi(2)).sum();
        (off / dot(&data, &data)).sqrt()
    };
    let rule = Stopping::default()
        .with_max_iterations(400)
        .with_residual(0.03);
    for (name, result, x) in each(rule, &start) {
        let report = result.unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Residual), "{name}");
        let (last, before) = report.history.split_last().unwrap();
        assert!(last.residual <= 0.03, "{name}");
        assert!(before.iter().all(|entry| entry.residual > 0.03), "{name}");
        // The image that met the rule; with subsets the iteration is completed.
        if name == "OSEM" {
            assert!(residual(&x) < 0.03);
        } else {
            assert!((residual(&x) - last.residual).abs() < 1e-12, "{name}");
            assert_eq!(last.change, None, "{name}");
        }
    }
    let rule = Stopping::default()
        .with_max_iterations(4000)
        .with_change(2e-3);
    for (name, result, _) in each(rule, &start) {
        let report = result.unwrap();
        assert_eq!(report.stopped_by, Some(StopReason::Change), "{name}");
        let (last, before) = report.history.split_last().unwrap();
        assert_eq!(report.iterations, report.history.len(), "{name}");
        assert!(last.change.unwrap() <= 2e-3, "{name}");
        assert!(before.iter().all(|e| e.change.unwrap() > 2e-3), "{name}");
    }
}

#[test]
fn the_change_of_a_step_is_relative_to_the_image_after_it() {
    let (_, truth, _) = scene();
    let start = noise::<f64>(truth.len(), 3)
        .iter()
        .map(|x| x + 1.1)
        .collect::<Vec<_>>();
    for (name, result, x) in each(many(1), &start) {
        let step: f64 = x.iter().zip(&start).map(|(a, b)| (a - b).powi(2)).sum();
        let change = result.unwrap().history[0].change.unwrap();
        // CGLS takes the norm of the step from its length and direction.
        assert!(
            (change / (step / dot(&x, &x)).sqrt() - 1.0).abs() < 1e-12,
            "{name}: {change}"
        );
    }
}

#[test]
fn an_error_names_each_unmet_rule_with_its_value() {
    let (projector, truth, data) = scene();
    let stopping = many(3).with_change(1e-9);
    let options = CglsOptions::default()
        .with_stopping(stopping)
        .with_gradient(1e-10);
    let mut x = vec![0.0; truth.len()];
    let error = cgls(&projector, &data, &mut x, &options, radon::no_observer).unwrap_err();
    let RadonError::NotConverged { report } = &error else {
        panic!("{error}");
    };
    let rules = [(StopReason::Change, 1e-9), (StopReason::Gradient, 1e-10)];
    assert_eq!(report.unmet_rules, rules);
    let last = report.history[2];
    let [change, gradient] = [last.change.unwrap(), last.gradient.unwrap()];
    assert_eq!(
        error.to_string(),
        format!(
            "no stopping rule was met in 3 iterations; change {change:.3e} (rule 1e-9); gradient {gradient:.3e} (rule 1e-10)"
        )
    );
    let options = EmOptions::default().with_stopping(many(0).with_residual(0.1));
    let error = mlem(
        &projector,
        &data,
        &mut vec![1.0; truth.len()],
        &options,
        radon::no_observer,
    );
    assert_eq!(
        error.unwrap_err().to_string(),
        "no stopping rule was met in 0 iterations; residual NaN (rule 0.1)"
    );
}

#[test]
fn a_solver_started_at_the_solution_makes_no_step() {
    let (_, truth, _) = scene();
    // No iteration is allowed: the given image must meet the rule.
    let rule = Stopping::default()
        .with_max_iterations(0)
        .with_residual(1e-14);
    for (name, result, x) in each(rule, &truth) {
        if name == "OSEM" {
            // With subsets the residual is known only after an iteration.
            assert!(matches!(result, Err(RadonError::NotConverged { .. })));
            continue;
        }
        let report = result.unwrap();
        assert_eq!(
            (report.iterations, report.stopped_by),
            (0, Some(StopReason::Residual)),
            "{name}"
        );
        assert_eq!(x, truth, "{name}");
    }
    let one = rule.with_max_iterations(1);
    for (name, result, x) in each(one, &truth) {
        assert_eq!(result.unwrap().stopped_by, Some(StopReason::Residual));
        let error = x.iter().zip(&truth).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f64::max) < 1e-12, "{name}");
    }
}

#[test]
fn solvers_are_bitwise_independent_of_threads() {
    let (projector, truth, data) = scene();
    let operator = projector
        .stack_operator::<f32>(1, StackOrder::ViewSliceBin)
        .unwrap();
    let data: Vec<f32> = data.iter().map(|&x| x as f32).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut x = vec![vec![1.0f32; truth.len()]; 4];
            let em = EmOptions::default().with_stopping(many(4));
            sirt(
                &operator,
                &data,
                &mut x[0],
                &SirtOptions::default().with_stopping(many(4)),
                radon::no_observer,
            )
            .unwrap();
            cgls(
                &operator,
                &data,
                &mut x[1],
                &CglsOptions::default().with_stopping(many(4)),
                radon::no_observer,
            )
            .unwrap();
            let report = mlem(&operator, &data, &mut x[2], &em, radon::no_observer).unwrap();
            osem(
                &operator.subsets(5).unwrap(),
                &data,
                &mut x[3],
                &em,
                radon::no_observer,
            )
            .unwrap();
            (x, report)
        })
    };
    assert_eq!(run(1), run(3));
}

/// The norms of the last entry are those of the image, also where the recurrence is far below them.
#[test]
fn cgls_reports_the_residual_and_gradient_of_its_image() {
    fn check<T: Sample>(rules: &[f64], unmet: f64, rounding: f64) {
        let geometry = ParallelGeometry::half_turn(40, 36, 1.0).unwrap();
        let grid = ImageGrid::square(12, 2.5).unwrap();
        let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
        let phantom = Phantom2::shepp_logan(15.0).unwrap();
        let data: Vec<T> = phantom.sinogram(&geometry, BinSampling::Mean).unwrap();
        let size = |x: &[T]| x.iter().map(|x| x.f64().powi(2)).sum::<f64>().sqrt();
        let scale = size(&projector.adjoint(&data).unwrap());
        let solve = |rule: f64| {
            let options = CglsOptions::default()
                .with_gradient(rule)
                .with_stopping(many(2000));
            let mut image = vec![T::ZERO; 144];
            let report = cgls(&projector, &data, &mut image, &options, radon::no_observer);
            let mut rest = projector.forward(&image).unwrap();
            rest.iter_mut().zip(&data).for_each(|(r, b)| *r = *b - *r);
            let gradient = size(&projector.adjoint(&rest).unwrap()) / scale;
            (report, gradient, size(&rest) / size(&data))
        };
        for &rule in rules {
            let (report, gradient, residual) = solve(rule);
            let report = report.unwrap();
            let last = report.history[report.iterations];
            assert!(last.gradient.unwrap() <= rule, "{rule:e}");
            // The sums are rounded in another order.
            assert!(gradient <= rule + rounding, "{rule:e}: {gradient:e}");
            assert!(
                (last.residual / residual - 1.0).abs() < rounding,
                "{rule:e}"
            );
        }
        let (report, gradient, _) = solve(unmet);
        assert!(gradient > unmet, "{gradient:e}");
        match report {
            Err(RadonError::NotConverged { report }) => assert!(report.iterations < 2000),
            other => panic!("{other:?}"),
        }
    }
    check::<f32>(&[1e-3, 1e-5], 1e-8, 1e-6);
    check::<f64>(&[1e-3, 1e-13], 1e-17, 1e-14);
}
