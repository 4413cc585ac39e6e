//! Operators behind pointers, operators that fail, observers that stop a solver, combined options.

use crate::common;

use std::error::Error;
use std::ops::ControlFlow;
use std::sync::Arc;

use common::dense::{Dense, many, not_negative};
use common::noise;
use radon::{
    ArcPolicy, CglsOptions, Collimator, EdgePolicy, EmOptions, FbpMethod, FbpOptions, FbpPlan,
    FourierProjector, ImageGrid, InstructionSet, Interpolation, IterativeReport, Kernel,
    LinearOperator, ParallelGeometry, Projector, RadonError, SirtOptions, SliceAxis, SpectGeometry,
    SpectOperator, SpectOptions, StackOrder, StopReason, Stopping, Subset, Window,
    adjoint_mismatch, cgls, mlem, osem, sirt,
};

/// Data with counts, and their operator in two halves.
fn problem() -> (Dense, [Subset<Dense, f64>; 2], Vec<f64>) {
    let whole = not_negative(12, 5, 3);
    let half = |first: usize| {
        let operator = Dense(whole.0.iter().skip(first).step_by(2).cloned().collect());
        Subset::new(operator, (first..12).step_by(2).collect())
    };
    let halves = [half(0), half(1)];
    let data = noise(12, 9).iter().map(|x: &f64| 2.0 + x).collect();
    (whole, halves, data)
}

/// Runs with the same subsets compute the column sums once: one adjoint for them, and one for each step of two runs.
#[test]
fn runs_with_the_same_subsets_share_their_column_sums() {
    struct Counting(Dense, std::cell::Cell<usize>);
    impl LinearOperator<f64> for &Counting {
        fn image_len(&self) -> usize {
            self.0.image_len()
        }
        fn data_len(&self) -> usize {
            self.0.data_len()
        }
        fn forward_into(&self, x: &[f64], y: &mut [f64]) -> Result<(), RadonError> {
            self.0.forward_into(x, y)
        }
        fn adjoint_into(&self, y: &[f64], x: &mut [f64]) -> Result<(), RadonError> {
            self.1.set(self.1.get() + 1);
            self.0.adjoint_into(y, x)
        }
    }
    let (whole, _, data) = problem();
    let counting = Counting(whole, 0.into());
    let subsets = [Subset::new(&counting, (0..12).collect())];
    let sums = subsets[0].sensitivity().unwrap().to_vec();
    let sum = |column: usize| (counting.0.0.iter()).map(|row| row[column]).sum::<f64>();
    assert!((0..5).all(|column| (sums[column] / sum(column) - 1.0).abs() < 1e-15));
    let options = EmOptions::default().with_stopping(Stopping::default().with_max_iterations(3));
    for runs in 1..3 {
        let mut x = vec![1.0; 5];
        osem(&subsets, &data, &mut x, &options, radon::no_observer).unwrap();
        assert_eq!(counting.1.get(), 1 + 3 * runs);
        assert_eq!(subsets[0].sensitivity().unwrap(), sums);
    }
}

/// Concurrent calls have their own work arrays: the results equal those of successive calls.
#[test]
fn an_operator_serves_two_threads_at_the_same_time() {
    fn check(operator: &(impl LinearOperator<f32> + Sync)) {
        let data = |seed: u64| noise::<f32>(operator.data_len(), seed);
        let back = |y: &[f32]| {
            let mut x = vec![0.0; operator.image_len()];
            operator.adjoint_into(y, &mut x).unwrap();
            let mut again = vec![0.0; operator.data_len()];
            operator.forward_into(&x, &mut again).unwrap();
            (x, again)
        };
        let alone = [1, 2].map(|seed| back(&data(seed)));
        for _ in 0..20 {
            let found = std::thread::scope(|scope| {
                let run = |seed| scope.spawn(move || back(&data(seed)));
                [1, 2].map(run).map(|thread| thread.join().unwrap())
            });
            assert!(found == alone);
        }
    }
    let views = ParallelGeometry::full_turn(7, 30, 0.5).unwrap();
    let (grid, axis) = (
        ImageGrid::square(24, 0.5).unwrap(),
        SliceAxis::new(5, 0.5).unwrap(),
    );
    let projector = Projector::new(&views, &grid, Kernel::Joseph).unwrap();
    check(
        &projector
            .stack_operator(5, StackOrder::SliceViewBin)
            .unwrap(),
    );
    check(&FourierProjector::new(&views, &grid, 1e-4).unwrap());
    let geometry = SpectGeometry::circular(&views, &axis, 9.0).unwrap();
    let options =
        SpectOptions::default().with_collimator(Collimator::new(0.04, 0.06, 0.1).unwrap());
    check(&SpectOperator::new(&geometry, &grid, &axis, &options).unwrap());
}

/// Every solver gives bitwise identical results through `dyn`, `&`, `Box`, `Arc` and pointers to those.
#[test]
fn pointers_to_operators_are_operators() {
    fn all<O: LinearOperator<f64> + ?Sized>(operator: &O, data: &[f64]) -> Vec<Vec<f64>> {
        let (cg, em, si) = (
            CglsOptions::default().with_stopping(many(3)),
            EmOptions::default().with_stopping(many(3)),
            SirtOptions::default().with_stopping(many(3)),
        );
        let mut x = vec![vec![1.0; 5]; 3];
        cgls(operator, data, &mut x[0], &cg, radon::no_observer).unwrap();
        mlem(operator, data, &mut x[1], &em, radon::no_observer).unwrap();
        sirt(operator, data, &mut x[2], &si, radon::no_observer).unwrap();
        x
    }
    let (whole, halves, data) = problem();
    let expected = all(&whole, &data);
    let object: &dyn LinearOperator<f64> = &whole;
    assert_eq!(all(object, &data), expected);
    assert_eq!(all(&object, &data), expected);
    assert_eq!(all(&&whole, &data), expected);

    let options = EmOptions::default().with_stopping(many(3));
    let mut expected_osem = vec![1.0; 5];
    osem(
        &halves,
        &data,
        &mut expected_osem,
        &options,
        radon::no_observer,
    )
    .unwrap();
    let borrowed = [&halves[0], &halves[1]].map(|half| {
        let operator: &dyn LinearOperator<f64> = half.operator();
        Subset::new(operator, half.data().to_vec())
    });
    let mut x = vec![1.0; 5];
    osem(&borrowed, &data, &mut x, &options, radon::no_observer).unwrap();
    assert_eq!(x, expected_osem);
    let boxed = halves.map(|half| {
        let (operator, data) = half.into_parts();
        let operator: Box<dyn LinearOperator<f64>> = Box::new(operator);
        Subset::new(operator, data)
    });
    let mut x = vec![1.0; 5];
    osem(&boxed, &data, &mut x, &options, radon::no_observer).unwrap();
    assert_eq!(x, expected_osem);

    let shared: Arc<dyn LinearOperator<f64> + Send + Sync> = Arc::new(whole);
    assert_eq!(all(&shared, &data), expected);
    assert_eq!(all(&Box::new(shared), &data), expected);
}

/// The observer of each step.
type Observer<'a> = &'a mut dyn FnMut(&IterativeReport, &[f64]) -> ControlFlow<()>;
/// A run of a solver that is observed.
type Solve<'a> = &'a dyn Fn(&mut [f64], Observer<'_>) -> Result<IterativeReport, RadonError>;

/// The calls of each solver's observer, which ends the run after `most` steps.
fn observed(most: usize) -> Vec<(IterativeReport, Vec<f64>, usize)> {
    let (whole, halves, data) = problem();
    let run = |solve: Solve<'_>| {
        let (mut x, mut calls, mut shown) = (vec![1.0; 5], 0, Vec::new());
        let report = solve(&mut x, &mut |report, image| {
            calls += 1;
            assert_eq!((report.iterations, report.history.len()), (calls, calls));
            assert!(report.history[calls - 1].change.is_some());
            shown = image.to_vec();
            match calls < most {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        });
        assert_eq!(shown, x);
        (report.unwrap(), x, calls)
    };
    let stopping = many(7);
    let em = EmOptions::default().with_stopping(stopping);
    let cg = CglsOptions::default().with_stopping(stopping.with_max_iterations(4));
    let si = SirtOptions::default().with_stopping(stopping);
    vec![
        run(&|x, see| mlem(&whole, &data, x, &em, see)),
        run(&|x, see| osem(&halves, &data, x, &em, see)),
        run(&|x, see| cgls(&whole, &data, x, &cg, see)),
        run(&|x, see| sirt(&whole, &data, x, &si, see)),
    ]
}

#[test]
fn an_observer_receives_every_step_and_may_end_the_run() {
    for (report, _, calls) in observed(usize::MAX) {
        assert_eq!(report.stopped_by, Some(StopReason::MaxIterations));
        assert_eq!(calls, report.iterations);
    }
    for (k, (report, x, calls)) in observed(3).into_iter().enumerate() {
        assert_eq!(report.stopped_by, Some(StopReason::Observer));
        assert_eq!((calls, report.iterations, report.history.len()), (3, 3, 3));
        // The image after three steps by the stopping rules.
        let (whole, halves, data) = problem();
        let (three, mut expected) = (many(3), vec![1.0; 5]);
        let em = EmOptions::default().with_stopping(three);
        match k {
            0 => mlem(&whole, &data, &mut expected, &em, radon::no_observer),
            1 => osem(&halves, &data, &mut expected, &em, radon::no_observer),
            2 => {
                let options = CglsOptions::default().with_stopping(three);
                cgls(&whole, &data, &mut expected, &options, radon::no_observer)
            }
            _ => {
                let options = SirtOptions::default().with_stopping(three);
                sirt(&whole, &data, &mut expected, &options, radon::no_observer)
            }
        }
        .unwrap();
        assert_eq!(x, expected);
    }
}

/// A met rule has priority over the observer; an unmet rule is no error if the observer ends the run.
#[test]
fn rules_and_observers() {
    let (whole, _, data) = problem();
    let run = |stopping: Stopping| {
        let options = SirtOptions::default().with_stopping(stopping);
        let stop = |_: &IterativeReport, _: &[f64]| ControlFlow::Break(());
        sirt(&whole, &data, &mut [1.0; 5], &options, stop).unwrap()
    };
    let report = run(Stopping::default().with_change(1e9));
    assert_eq!(report.stopped_by, Some(StopReason::Change));
    let report = run(Stopping::default().with_residual(1e-9));
    assert_eq!(report.stopped_by, Some(StopReason::Observer));
    assert_eq!(report.iterations, 1);
}

/// An operator whose data are no longer available.
struct Torn;

impl LinearOperator<f32> for Torn {
    fn image_len(&self) -> usize {
        2
    }
    fn data_len(&self) -> usize {
        3
    }
    fn forward_into(&self, _: &[f32], _: &mut [f32]) -> Result<(), RadonError> {
        Err(RadonError::user(std::io::Error::other("no disk")))
    }
    fn adjoint_into(&self, _: &[f32], image: &mut [f32]) -> Result<(), RadonError> {
        image.fill(1.0);
        Ok(())
    }
}

#[test]
fn the_error_of_an_operator_is_returned_and_reported_once() {
    let failed = mlem(
        &Torn,
        &[1.0; 3],
        &mut [1.0; 2],
        &EmOptions::default(),
        radon::no_observer,
    )
    .unwrap_err();
    let mut chain = vec![failed.to_string()];
    let mut next = failed.source();
    assert!(next.is_some_and(|source| source.is::<std::io::Error>()));
    while let Some(source) = next {
        chain.push(source.to_string());
        next = source.source();
    }
    assert_eq!(chain, ["the caller's own operator failed", "no disk"]);
    assert_eq!(failed, failed.clone());
    assert_ne!(failed, RadonError::user("no disk"));
}

#[test]
fn a_plan_returns_its_arguments() {
    let geometry = ParallelGeometry::full_turn(7, 9, 0.3)
        .unwrap()
        .with_offset(0.1)
        .unwrap();
    let grid = ImageGrid::new(12, 10, 0.2).unwrap();
    let plain = FbpOptions::default();
    let cut = plain.clone().with_region(2..7, 1..10);
    let whole = FbpPlan::<f32>::new(&geometry, &grid, &plain).unwrap();
    let part = FbpPlan::<f64>::new(&geometry, &grid, &cut).unwrap();
    assert_eq!((whole.image_len(), part.image_len()), (120, 45));
    assert_eq!(whole.sinogram_len(), 63);
    let within = format!("{part:?}");
    for own in [
        format!("{geometry:?}"),
        format!("{grid:?}"),
        format!("{cut:?}"),
    ] {
        assert!(within.contains(&own), "{own}: {within}");
    }

    let projector = Projector::new(&geometry, &grid, Kernel::Strip).unwrap();
    let projector = projector
        .with_instructions(InstructionSet::Baseline)
        .unwrap();
    let stack = projector.stack_operator::<f32>(3, StackOrder::SliceViewBin);
    let stack = stack.unwrap();
    for part in stack.subsets(2).unwrap() {
        let within = format!("{:?}", part.operator());
        for own in ["Baseline", "Strip", "offset: 0.1"] {
            assert!(within.contains(own), "{own}: {within}");
        }
        assert!(within.contains(&format!("{grid:?}")));
    }
}

/// The operator of some views projects as the whole; its adjoint is that of data without the other views.
#[test]
fn the_operator_of_some_views_is_a_part_of_the_whole() {
    let geometry = ParallelGeometry::half_turn(5, 9, 0.7).unwrap();
    let geometry = geometry.with_offset(0.1).unwrap();
    let grid = ImageGrid::new(6, 7, 0.8).unwrap();
    let projector = Projector::new(&geometry, &grid, Kernel::Joseph).unwrap();
    for order in [StackOrder::ViewSliceBin, StackOrder::SliceViewBin] {
        let whole = projector.stack_operator::<f64>(3, order).unwrap();
        let part = whole.subsets(3).unwrap().swap_remove(1); // views 1 and 4
        assert_eq!(part.data().len(), 2 * 3 * 9);
        let (x, y): (Vec<f64>, Vec<f64>) = (noise(whole.image_len(), 1), noise(2 * 3 * 9, 2));
        let (mut all, mut some) = (vec![0.0; 5 * 3 * 9], vec![0.0; 2 * 3 * 9]);
        whole.forward_into(&x, &mut all).unwrap();
        part.operator().forward_into(&x, &mut some).unwrap();
        let expected: Vec<f64> = part.data().iter().map(|&index| all[index]).collect();
        assert_eq!(some, expected);
        all.fill(0.0);
        part.data()
            .iter()
            .zip(&y)
            .for_each(|(&index, y)| all[index] = *y);
        let (mut expected, mut back) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        whole.adjoint_into(&all, &mut expected).unwrap();
        part.operator().adjoint_into(&y, &mut back).unwrap();
        assert!((expected.iter().zip(&back)).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}

/// A wrong adjoint has the mismatch of its definition; the vectors depend on the seed only.
#[test]
fn the_mismatch_of_a_wrong_adjoint_is_that_of_its_definition() {
    /// Multiplies by 1, and its adjoint by another factor.
    struct Wrong(f64);
    impl LinearOperator<f64> for Wrong {
        fn image_len(&self) -> usize {
            1
        }
        fn data_len(&self) -> usize {
            1
        }
        fn forward_into(&self, x: &[f64], y: &mut [f64]) -> Result<(), RadonError> {
            assert!((-1.0..1.0).contains(&x[0]));
            y[0] = x[0];
            Ok(())
        }
        fn adjoint_into(&self, y: &[f64], x: &mut [f64]) -> Result<(), RadonError> {
            assert!((-1.0..1.0).contains(&y[0]));
            x[0] = self.0 * y[0];
            Ok(())
        }
    }
    // |x y - f x y| / max(|x y|, |f x y|)
    for (factor, expected) in [
        (1.0, 0.0),
        (0.75, 0.25),
        (4.0, 0.75),
        (0.0, 1.0),
        (-1.0, 2.0),
    ] {
        for seed in 0..9 {
            let found = adjoint_mismatch(&Wrong(factor), seed).unwrap();
            assert!((found - expected).abs() < 1e-15, "{factor}: {found}");
        }
    }
    let infinite = adjoint_mismatch(&Wrong(f64::INFINITY), 1).unwrap_err();
    assert!(matches!(infinite, RadonError::BadSample { index: 0, .. }));
    let dense = not_negative(12, 5, 3);
    assert_eq!(adjoint_mismatch(&dense, 1), adjoint_mismatch(&dense, 1));
    assert!(adjoint_mismatch(&dense, 1).unwrap() < 1e-15);
}

/// Each builder sets its field only.
#[test]
fn options_are_set_field_by_field() {
    let changes: [fn(FbpOptions) -> FbpOptions; 10] = [
        |o| o.with_ramp(false),
        |o| o.with_window(Window::Hann),
        |o| o.with_cutoff(0.5),
        |o| o.with_interpolation(Interpolation::BandLimited),
        |o| o.with_edge(EdgePolicy::Ellipse),
        |o| o.with_arc(ArcPolicy::Extend),
        |o| o.with_region(1..2, 3..4),
        |o| o.with_instructions(InstructionSet::Baseline),
        |o| o.with_method(FbpMethod::Direct),
        |o| o.with_memory(7),
    ];
    let mut expected = FbpOptions::default();
    let mut built = FbpOptions::default();
    for (k, change) in changes.into_iter().enumerate() {
        match k {
            0 => expected.ramp = false,
            1 => expected.window = Window::Hann,
            2 => expected.cutoff = 0.5,
            3 => expected.interpolation = Interpolation::BandLimited,
            4 => expected.edge = EdgePolicy::Ellipse,
            5 => expected.arc = ArcPolicy::Extend,
            6 => expected.region = Some((1..2, 3..4)),
            7 => expected.instructions = Some(InstructionSet::Baseline),
            8 => expected.method = FbpMethod::Direct,
            _ => expected.memory = 7,
        }
        built = change(built);
        assert_eq!(built, expected);
    }
    let stopping = Stopping::default()
        .with_max_iterations(3)
        .with_residual(0.1)
        .with_change(0.2);
    assert_eq!(
        (stopping.max_iterations, stopping.residual, stopping.change),
        (3, Some(0.1), Some(0.2))
    );
    let options = SirtOptions::default()
        .with_stopping(stopping)
        .with_relaxation(1.5)
        .with_lower(-1.0)
        .with_upper(2.0);
    assert_eq!((options.stopping, options.relaxation), (stopping, 1.5));
    assert_eq!((options.lower, options.upper), (Some(-1.0), Some(2.0)));
}
