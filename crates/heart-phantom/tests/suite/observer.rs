//! Observers that stop a computation: it returns an error and leaves no report, and the next computation is bitwise identical.

use heart_phantom::scene::{Accuracy, DiscretisationSettings, Mode};
use heart_phantom::{
    Compensation, Method, Osem, Phantom, PhantomError, Product, Run, Scene, no_observer, run,
};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

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
        let stopped = |last| phantom.reconstruct_observed(0, &views, &stop_at(last));
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
    let calls = stops(|last| phantom.reconstruct_observed(0, &views, &stop_at(last)));
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

/// The report lists all files by their names, which JSON has only in Unicode.
#[cfg(unix)]
#[test]
fn a_report_with_a_name_that_is_not_unicode_is_an_error_and_not_an_empty_file() {
    use std::os::unix::ffi::OsStrExt;
    let mut scene = small(Method::Fbp).with_mode(Mode::Static { phase: 0.0 });
    scene.output.write = vec![Product::Projections];
    let phantom = Phantom::new(scene).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let name = Path::new(std::ffi::OsStr::from_bytes(b"notes\xff.txt"));
    let mut run = Run::begin(&phantom, folder.path(), &[name.into()]).unwrap();
    run.gate(0, &no_observer).unwrap();
    let report = run.finish(&no_observer, |_| Ok::<(), PhantomError>(()));
    assert!(
        matches!(report, Err(PhantomError::File { .. })),
        "{report:?}"
    );
    assert!(!folder.path().join("report.json").exists());
}
