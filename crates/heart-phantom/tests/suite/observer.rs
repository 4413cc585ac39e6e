//! Observers that stop a computation: it returns an error and leaves no report, and the next computation is bitwise identical.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{Accuracy, Mode};
use heart_phantom::{
    Compensation, Defect, Method, Osem, Phantom, PhantomError, Product, Progress, Run, RunReport,
    Scene, no_observer, run,
};
use radon::{
    FbpMethod, FbpOptions, FbpPlan, ImageGrid, Kernel, LinearOperator, ParallelGeometry, Projector,
    StackOrder,
};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

fn osem() -> Method {
    Method::Osem(Osem::new(2, 3))
}

/// Two gates of a small heart, six views.
fn small(method: Method) -> Scene {
    let mut scene = Scene::default().with_size(12);
    scene.acquisition.mode = Mode::Gated { gates: 2 };
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 51 };
    (scene.camera.views, scene.camera.arc) = (6, 360.0);
    scene.truth.tolerance = 0.02;
    scene.reconstruction.method = method;
    scene.output.write = vec![
        Product::Projections,
        Product::Reconstruction,
        Product::Truth,
        Product::Labels,
        Product::Pictures,
    ];
    scene
}

/// An observer that breaks from its call `last` on, counted from 0.
fn stop_at<T>(last: usize) -> impl Fn(T) -> ControlFlow<()> + Sync {
    let calls = AtomicUsize::new(0);
    move |_| match calls.fetch_add(1, Ordering::Relaxed) < last {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    }
}

/// Stops at each call in turn until the computation ends; returns the number of calls.
fn stops<R: Debug>(compute: impl Fn(usize) -> Result<R, PhantomError>) -> usize {
    (0..)
        .find(|last| match compute(*last) {
            Ok(_) => true,
            Err(PhantomError::Stopped) => false,
            Err(error) => panic!("call {last}: {error}"),
        })
        .unwrap()
}

/// The fraction that the units of work count does not decrease, and ends at 1.
#[test]
fn units_of_work_count_the_completed_fraction() {
    let watch = Arc::new(simd_set::Watch::default());
    let of_threads = watch.clone();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
    let pool = pool.start_handler(move |_| simd_set::watch_with(of_threads.clone()));
    let pool = pool.build().unwrap();
    let counts = |what: &str, compute: &(dyn Fn() + Sync)| {
        watch.restart();
        std::thread::scope(|scope| {
            let work = scope.spawn(|| pool.install(compute));
            let mut last = 0.0;
            while !work.is_finished() {
                let now = watch.fraction();
                assert!(now >= last, "{what}: {now} after {last}");
                last = now;
            }
        });
        // Fixed point with 62 bits, divided by numbers of units.
        assert!(
            watch.fraction() > 1.0 - 1e-9,
            "{what}: {}",
            watch.fraction()
        );
    };
    let mut scene = small(Method::Fbp);
    scene.defects = vec![Defect {
        layers: [0.2, 0.8],
        s: [0.1, 0.4],
        azimuths_degrees: [0.0, 90.0],
        activity: 0.5,
    }];
    let phantom = Phantom::new(scene).unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap().samples;
    counts("views", &|| {
        drop(phantom.sinograms(0, &no_observer).unwrap())
    });
    counts("gates", &|| drop(phantom.sinograms_of_gates().unwrap()));
    counts("volume", &|| drop(phantom.reconstruct(0, &views).unwrap()));
    counts("truth", &|| drop(phantom.truth(0).unwrap()));
    counts("truths", &|| drop(phantom.truth_of_gates().unwrap()));
    counts("labels", &|| drop(phantom.labels(0.3).unwrap()));
    counts("motion", &|| drop(phantom.motion(0.3).unwrap()));
    let geometry = ParallelGeometry::half_turn(40, 50, 1.0).unwrap();
    let grid = ImageGrid::new(70, 30, 1.0).unwrap();
    let direct = FbpOptions::default().with_method(FbpMethod::Direct);
    let fourier = FbpMethod::Fourier { tolerance: 1e-3 };
    let fourier = FbpOptions::default().with_method(fourier);
    // The first within a memory that divides the views into several parts.
    for options in [direct.clone().with_memory(1 << 19), direct, fourier] {
        let plan = FbpPlan::<f32>::new(&geometry, &grid, &options).unwrap();
        for n in [1, 5, 40] {
            let data = vec![1.0; n * 2000];
            let order = StackOrder::SliceViewBin;
            counts("FBP", &|| {
                drop(plan.reconstruct_stack(&data, n, order).unwrap())
            });
        }
        counts("transpose", &|| drop(plan.adjoint(&[1.0; 2100]).unwrap()));
    }
    for kernel in [Kernel::Joseph, Kernel::Strip] {
        let projector = Projector::new(&geometry, &grid, kernel).unwrap();
        for n in [1, 5, 40, 300] {
            let (x, y, order) = (
                vec![1.0f32; n * 2100],
                vec![1.0f32; n * 2000],
                StackOrder::SliceViewBin,
            );
            let operator = projector.stack_operator(n, order).unwrap();
            counts("forward", &|| drop(operator.forward(&x).unwrap()));
            counts("adjoint", &|| drop(operator.adjoint(&y).unwrap()));
            let x: Vec<f64> = x.iter().map(|x| f64::from(*x)).collect();
            let double = projector.stack_operator(n, order).unwrap();
            counts("double", &|| drop(double.forward(&x).unwrap()));
        }
    }
}

#[test]
fn projections_stop_after_any_view() {
    let phantom = Phantom::new(small(Method::Fbp)).unwrap();
    let calls = stops(|last| phantom.sinograms(1, &stop_at(last)));
    assert_eq!(calls, 6);
    assert_eq!(stops(|last| phantom.windows(1, &stop_at(last))), 6);
    let expected = Phantom::new(small(Method::Fbp)).unwrap();
    let expected = expected.sinograms(1, &no_observer).unwrap().samples;
    assert!(phantom.sinograms(1, &stop_at(calls)).unwrap().samples == expected);
}

#[test]
fn reconstructions_stop_after_any_iteration() {
    for (method, calls) in [(Method::Fbp, 1), (osem(), 4)] {
        let phantom = Phantom::new(small(method)).unwrap();
        let views = phantom.sinograms(0, &no_observer).unwrap().samples;
        let len = phantom.camera().grid().len();
        let stopped = |last| {
            let mut volume = vec![0.0; len];
            let report = phantom.reconstruct_into(0, &views, &mut volume, &stop_at(last))?;
            Ok((volume, report))
        };
        assert_eq!(stops(stopped), calls);
        let expected = Phantom::new(small(method)).unwrap();
        let (volume, report) = stopped(calls).unwrap();
        assert!(volume == expected.reconstruct(0, &views).unwrap());
        assert_eq!(
            report.map(|report| report.iterations + 1),
            (calls > 1).then_some(calls)
        );
    }
}

/// The iteration that meets the tolerance ends the reconstruction with a result unless its observer breaks.
#[test]
fn a_break_at_the_tolerance_is_an_error() {
    let osem = Osem {
        tolerance: Some(1.0),
        ..Osem::new(2, 3)
    };
    let phantom = Phantom::new(small(Method::Osem(osem))).unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap().samples;
    let len = phantom.camera().grid().len();
    let calls =
        stops(|last| phantom.reconstruct_into(0, &views, &mut vec![0.0; len], &stop_at(last)));
    assert_eq!(calls, 2);
}

#[test]
fn motion_compensated_reconstructions_stop() {
    for (method, calls) in [(Method::Fbp, 1), (osem(), 4)] {
        let mut scene = small(method);
        scene.reconstruction.compensation = Compensation::KnownMotion;
        let phantom = Phantom::new(scene).unwrap();
        let views = phantom.sinograms_of_gates().unwrap();
        let stopped = |last| phantom.compensated(0, &views, &stop_at(last));
        assert_eq!(stops(stopped), calls);
        let expected = phantom.compensated(0, &views, &no_observer).unwrap();
        assert!(stopped(calls).unwrap() == expected);
    }
}

/// The files of a directory and their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    entries
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, std::fs::read(path).unwrap())
        })
        .collect()
}

/// A stop at any call leaves no report, not even that of an earlier run, no temporary file and no lock.
#[test]
fn a_stopped_run_leaves_no_report() {
    for (method, compensation) in [
        (Method::Fbp, Compensation::None),
        (osem(), Compensation::None),
        (osem(), Compensation::KnownMotion),
    ] {
        let mut scene = small(method);
        scene.reconstruction.compensation = compensation;
        let (folder, complete) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let phantom = Phantom::new(scene.clone()).unwrap();
        run(&phantom, folder.path(), &no_observer).unwrap();
        let calls = stops(|last| {
            let made = run(&phantom, folder.path(), &stop_at(last));
            if made.is_err() {
                let left = files(folder.path()).into_keys();
                let left: Vec<_> = left.filter(|name| !is_product(name)).collect();
                assert_eq!(left, [""; 0], "call {last}");
            }
            made
        });
        assert!(calls > 12, "{calls}");
        run(&Phantom::new(scene).unwrap(), complete.path(), &no_observer).unwrap();
        let [mut made, mut expected] = [&folder, &complete].map(|folder| files(folder.path()));
        // Reports contain the work, which differs with cached shapes.
        assert!(made.remove("report.json").is_some() && expected.remove("report.json").is_some());
        assert!(made == expected);
    }
}

fn is_product(name: &str) -> bool {
    ["npy", "png", "gif"]
        .iter()
        .any(|extension| name.ends_with(&format!(".{extension}")))
}

/// A run removes and lists files by their names: they are in its directory, and each has a name of its own.
#[test]
fn names_of_files_beside_a_run_are_plain_and_unique() {
    let mut scene = small(Method::Fbp).with_mode(Mode::Static { phase: 0.0 });
    scene.output.write = vec![Product::Projections];
    let phantom = Phantom::new(scene).unwrap();
    let outside = tempfile::tempdir().unwrap();
    let (out, other) = (outside.path().join("out"), outside.path().join("e.txt"));
    std::fs::write(&other, "kept").unwrap();
    let rejected = |names: &[&Path]| {
        let names: Vec<PathBuf> = names.iter().map(|name| name.to_path_buf()).collect();
        let begun = Run::begin(&phantom, &out, &names);
        assert!(
            matches!(&begun, Err(PhantomError::Name { path }) if path == names.last().unwrap()),
            "{begun:?}"
        );
    };
    for name in [
        "",
        ".",
        "..",
        "../e.txt",
        "e.txt/",
        "./e.txt",
        "sub/e.txt",
        "e\n.txt",
        "report.json",
        "projections.npy",
        ".heart-phantom.lock",
    ] {
        rejected(&[Path::new(name)]);
    }
    rejected(&[&other]);
    rejected(&[Path::new("e.txt"), Path::new("e.txt")]);
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        rejected(&[Path::new(std::ffi::OsStr::from_bytes(b"notes\xff.txt"))]);
    }
    assert_eq!(std::fs::read_to_string(&other).unwrap(), "kept");
    // A file that the caller does not write is not listed.
    let names = ["a.txt", "b.txt"].map(PathBuf::from);
    let mut run = Run::begin(&phantom, &out, &names).unwrap();
    let beyond = run.gate(1, &no_observer).unwrap_err();
    assert_eq!(beyond.to_string(), "gate is 1, must be 0");
    run.gate(0, &no_observer).unwrap();
    let write =
        |_: &RunReport| std::fs::write(out.join("b.txt"), "b").map_err(|_| PhantomError::Stopped);
    let report = run.finish(&no_observer, write).unwrap();
    let listed = ["projections.npy", "b.txt", "report.json"].map(PathBuf::from);
    assert_eq!(report.files, listed);
}

/// The reported fraction of a run does not decrease.
#[test]
fn the_fraction_of_a_run_does_not_decrease() {
    for (method, compensation) in [
        (osem(), Compensation::None),
        (osem(), Compensation::KnownMotion),
        (Method::Fbp, Compensation::KnownMotion),
    ] {
        let mut scene = small(method);
        scene.reconstruction.compensation = compensation;
        let folder = tempfile::tempdir().unwrap();
        let seen = Mutex::new(vec![0.0]);
        let watch = |progress: Progress| {
            seen.lock().unwrap().push(progress.fraction);
            ControlFlow::Continue(())
        };
        run(&Phantom::new(scene).unwrap(), folder.path(), &watch).unwrap();
        let seen = seen.into_inner().unwrap();
        assert!(seen.is_sorted() && seen[seen.len() - 1] <= 1.0, "{seen:?}");
    }
}

/// Threads report the numbers of completed views in ascending order, although the callback takes longer for some.
#[test]
fn completed_views_are_counted_in_order() {
    let phantom = Phantom::new(small(Method::Fbp)).unwrap();
    let seen = Mutex::new(Vec::new());
    let watch = |done: usize| {
        std::thread::sleep(std::time::Duration::from_millis(done as u64 % 3));
        seen.lock().unwrap().push(done);
        ControlFlow::Continue(())
    };
    phantom.sinograms(0, &watch).unwrap();
    let n_views = phantom.camera().n_views();
    assert_eq!(seen.into_inner().unwrap(), Vec::from_iter(1..=n_views));
}
