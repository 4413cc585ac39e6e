//! Interrupted writes leave the previous files unchanged. A separate program, because the lock applies to the whole process. A test that
//! waits for longer than [`PATIENCE`] fails.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]
#![cfg(unix)] // requires a system that can remove open files

use heart_phantom::files::{self, write_atomically};
use heart_phantom::{Attenuation, Medium, Mode, Product, Scene};
use heart_phantom::{Phantom, PhantomError};
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

/// Longest duration of a test, far above the needs of a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn unfinished_files_are_removed_and_older_files_are_kept() {
    let (done, result) = mpsc::channel();
    thread::spawn(move || {
        interrupted_write();
        done.send(())
    });
    let end = result.recv_timeout(PATIENCE);
    end.expect("the test ends, without a panic");
}

fn interrupted_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let (begun, has_begun) = mpsc::channel();
    let (go_on, may_go_on) = mpsc::channel();
    let released = AtomicBool::new(false);
    thread::scope(|scope| {
        let go_on = go_on; // dropped by a panic, which then ends the wait
        let writer = scope.spawn(|| {
            let written = write_atomically(&path, move |out| {
                out.write_all(b"half")?;
                begun.send(()).unwrap();
                may_go_on.recv().unwrap();
                out.write_all(b" and half")
            });
            (written, released.load(Ordering::SeqCst))
        });
        has_begun.recv().unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        let held = files::remove_unfinished();
        assert_eq!(names(folder.path()), ["a.txt"]);
        // Neither the end of that write nor the start of another one is possible while the lock is held.
        go_on.send(()).unwrap();
        let second = scope.spawn(|| {
            write_atomically(&folder.path().join("b.txt"), |_| {
                assert!(released.load(Ordering::SeqCst), "began while held");
                Ok(())
            })
        });
        for _ in 0..1000 {
            thread::yield_now();
            assert!(!writer.is_finished() && !second.is_finished());
        }
        assert_eq!(names(folder.path()), ["a.txt"]);
        released.store(true, Ordering::SeqCst);
        drop(held);
        let (written, ended_after) = writer.join().unwrap();
        assert!(ended_after, "ended while held");
        let error = written.unwrap_err();
        assert!(error.to_string().contains("a.txt"), "{error}");
        second.join().unwrap().unwrap();
    });
    assert_eq!(names(folder.path()), ["a.txt", "b.txt"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

/// The name of this test, which runs itself under a limit of the address space.
const LIMITED: &str = "volumes_that_do_not_fit_into_memory_are_an_error";

#[test]
fn volumes_that_do_not_fit_into_memory_are_an_error() {
    if std::env::var_os("HEART_PHANTOM_LIMITED").is_none() {
        let program = std::env::current_exe().unwrap();
        let script = "ulimit -v 1500000 && exec \"$0\" --exact \"$1\"";
        let mut limited = std::process::Command::new("sh");
        limited.args(["-c", script]).arg(program).arg(LIMITED);
        let done = limited.env("HEART_PHANTOM_LIMITED", "1").output().unwrap();
        assert!(done.status.success(), "{done:?}");
        return;
    }
    let mut scene = Scene::default().with_size(1290);
    scene.acquisition.mode = Mode::Static { phase: 0.0 };
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Heart,
    });
    let phantom = Phantom::new(scene).unwrap();
    for rejected in [
        phantom.truth(0).map(drop),
        phantom.truth_of_gates().map(drop),
        phantom.activity(0.0).map(drop),
        phantom.labels(0.0).map(drop),
        phantom.attenuation(0.0).map(drop),
    ] {
        let said = rejected.unwrap_err().to_string();
        assert!(said.ends_with("do not fit into memory"), "{said}");
    }
    let rejected = phantom.check_memory(&[Product::Truth], 1);
    assert!(
        matches!(rejected, Err(PhantomError::Memory { .. })),
        "{rejected:?}"
    );
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
