//! Observers that stop a study: it returns an error and leaves no report, and the next study is bitwise identical.

use heart_phantom::{PhantomError, Progress, no_observer};
use heart_study::{StudyOptions, run};
use std::fmt::Debug;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// An observer that breaks from its call `last` on, counted from 0.
fn stop_at(last: usize) -> impl Fn(Progress) -> ControlFlow<()> + Sync {
    let calls = AtomicUsize::new(0);
    move |_| match calls.fetch_add(1, Ordering::Relaxed) < last {
        true => ControlFlow::Continue(()),
        false => ControlFlow::Break(()),
    }
}

/// Checks the error of a stopped study, and that its directory contains arrays and figures at most.
fn check_stopped(made: Result<impl Debug, PhantomError>, out: &Path) {
    let Err(PhantomError::Stopped) = made else {
        panic!("{made:?}")
    };
    for entry in fs::read_dir(out).unwrap() {
        let path = entry.unwrap().path();
        let extension = path.extension().and_then(|extension| extension.to_str());
        assert!(matches!(extension, Some("npy" | "png" | "svg")), "{path:?}");
    }
}

fn arrays(out: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(out).unwrap().map(|entry| entry.unwrap());
    let names = entries.map(|entry| entry.file_name().into_string().unwrap());
    let mut names: Vec<_> = names.filter(|name| name.ends_with(".npy")).collect();
    names.sort();
    let read = |name: String| {
        let bytes = fs::read(out.join(&name)).unwrap();
        (name, bytes)
    };
    names.into_iter().map(read).collect()
}

#[test]
fn a_stopped_study_leaves_no_report() {
    let (folder, complete) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut options = StudyOptions::default();
    (options.size, options.views, options.nodes) = (12, 6, 51);
    options.figures = false;
    run(&options, complete.path(), &no_observer).unwrap();
    // The first stage, a stage of the first acquisition, and one of the second, after arrays were written.
    for last in [0, 8, 13] {
        check_stopped(run(&options, folder.path(), &stop_at(last)), folder.path());
    }
    run(&options, folder.path(), &stop_at(usize::MAX)).unwrap();
    let [made, expected] = [&folder, &complete].map(|out| arrays(out.path()));
    assert!(made.len() > 8 && made == expected);
}

#[test]
fn an_empty_path_is_rejected() {
    let empty = Path::new("");
    let error = run(&StudyOptions::default(), empty, &stop_at(0)).unwrap_err();
    assert!(matches!(error, PhantomError::File { .. }), "{error}");
}
