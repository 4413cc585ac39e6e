//! One writer per directory; only new files are written to.
#![cfg(unix)]

use heart_phantom::files::Folder;
use heart_phantom::{Mode, Phantom, PhantomError, Scene, no_observer, run};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

const LOCK: &str = ".heart-phantom.lock";

/// Longest wait for another process, far above the needs of a busy machine.
const PATIENCE: Duration = Duration::from_secs(300);

/// The result of work that waits for another process.
fn bounded<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
    let (done, result) = mpsc::channel();
    thread::spawn(move || done.send(work()));
    let result = result.recv_timeout(PATIENCE);
    result.expect("the other process answers")
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn holder(result: Result<Folder, PhantomError>) -> String {
    match result.unwrap_err() {
        PhantomError::Busy { holder, .. } => holder,
        error => panic!("{error}"),
    }
}

fn phantom() -> Phantom {
    let scene = Scene::default().with_size(8);
    Phantom::new(scene.with_mode(Mode::Static { phase: 0.0 })).unwrap()
}

#[test]
fn a_locked_directory_has_one_writer() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/out");
    let held = Folder::lock(&out).unwrap();
    assert_eq!(names(&out), [LOCK]);
    let me = format!("process {} on ", std::process::id());
    assert!(holder(Folder::lock(&out)).starts_with(&me));
    let error = run(&phantom(), &out, &no_observer).unwrap_err();
    assert!(error.to_string().contains(&me), "{error}");
    assert_eq!(names(&out), [LOCK]);
    drop(held);
    assert!(!out.exists());
    let report = run(&phantom(), &out, &no_observer).unwrap();
    assert_eq!(names(&out).len(), report.files.len());
}

#[test]
fn a_created_directory_without_files_is_removed() {
    let parent = tempfile::tempdir().unwrap();
    let own = parent.path().join("own");
    drop(Folder::lock(&own).unwrap());
    assert!(!own.exists());
    let folder = Folder::lock(&own).unwrap();
    fs::write(own.join("of the user"), "kept").unwrap();
    drop(folder);
    assert_eq!(names(&own), ["of the user"]);
    drop(Folder::lock(parent.path()).unwrap());
    assert!(parent.path().exists());
}

/// The owner of the lock is alone, for any number of concurrent processes and any number of creations of the file.
#[test]
fn concurrent_processes_lock_in_turn() {
    const FOLDER: &str = "HEART_PHANTOM_TEST_SHARED_FOLDER";
    const PROCESSES: usize = 8;
    const TURNS: usize = 1000;
    if let Some(folder) = std::env::var_os(FOLDER) {
        let folder = Path::new(&folder);
        let inside = folder.join("inside");
        // Every process finally gets the lock: a rejected one detects another owner, or one that is leaving.
        let (mut turns, end) = (0, Instant::now() + PATIENCE);
        while turns < TURNS {
            assert!(Instant::now() < end, "{turns} of {TURNS} turns");
            match Folder::lock(folder) {
                Ok(held) => {
                    fs::File::create_new(&inside).expect("nobody else is inside");
                    fs::remove_file(&inside).unwrap();
                    drop(held);
                    turns += 1;
                }
                Err(PhantomError::Busy { .. }) => thread::yield_now(),
                Err(error) => panic!("{error}"),
            }
        }
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let children: Vec<_> = (0..PROCESSES)
        .map(|_| {
            let mut command = Command::new(std::env::current_exe().unwrap());
            command.args(["--exact", "lock::concurrent_processes_lock_in_turn"]);
            command.env(FOLDER, folder.path()).stdout(Stdio::piped());
            command.spawn().unwrap()
        })
        .collect();
    for child in children {
        let output = bounded(|| child.wait_with_output().unwrap());
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{said}");
        assert!(said.contains("1 passed"), "{said}");
    }
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

/// A killed process leaves the lock file with its name and a file, but nobody is locked out, and the next run has no foreign file.
#[test]
fn the_lock_of_a_killed_process_is_taken_over() {
    const HELD: &str = "HEART_PHANTOM_TEST_HELD_FOLDER";
    if let Some(folder) = std::env::var_os(HELD) {
        let mut held = Folder::lock(Path::new(&folder)).unwrap();
        held.clear(&["labels.npy".into(), "truth.npy".into()])
            .unwrap();
        fs::write(held.path().join("labels.npy"), "").unwrap();
        println!("held");
        let input = std::io::stdin().read(&mut [0]);
        panic!("{input:?}");
    }
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "--nocapture"])
        .arg("lock::the_lock_of_a_killed_process_is_taken_over")
        .env(HELD, folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
    let held = bounded(move || said.any(|line| line.unwrap().contains("held")));
    assert!(held);
    let other = format!("process {} on ", child.id());
    assert!(holder(Folder::lock(folder.path())).starts_with(&other));
    child.kill().unwrap();
    bounded(move || child.wait().unwrap());
    let left = fs::read_to_string(folder.path().join(LOCK)).unwrap();
    assert!(left.starts_with(&other) && left.ends_with("\nlabels.npy\ntruth.npy\n"));
    assert!(folder.path().join("labels.npy").exists());
    let report = run(&phantom(), folder.path(), &no_observer).unwrap();
    assert_eq!(names(folder.path()).len(), report.files.len());
}

/// Links in the directory under every name that a run writes, and under that of the lock: their targets are unchanged.
#[test]
fn links_in_the_folder_are_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let [out, again, other] = ["out", "again", "other"].map(|name| folder.path().join(name));
    let report = run(&phantom(), &out, &no_observer).unwrap();
    fs::create_dir(&again).unwrap();
    fs::write(&other, "not ours").unwrap();
    for file in &report.files {
        symlink(&other, again.join(file)).unwrap();
    }
    run(&phantom(), &again, &no_observer).unwrap();
    assert_eq!(fs::read_to_string(&other).unwrap(), "not ours");
    for file in &report.files {
        assert!(fs::symlink_metadata(again.join(file)).unwrap().is_file());
        assert!(fs::read(again.join(file)).unwrap() == fs::read(out.join(file)).unwrap());
    }
    // Another link to that file instead of the lock is stale: it is removed, the file is kept.
    fs::hard_link(&other, again.join(LOCK)).unwrap();
    let held = Folder::lock(&again).unwrap();
    assert_eq!(fs::read_to_string(&other).unwrap(), "not ours");
    drop(held);
    // A link, a directory or a pipe instead of the lock is an immediate error.
    for kind in ["link", "folder", "pipe"] {
        let lock = again.join(LOCK);
        match kind {
            "link" => symlink(&other, &lock).unwrap(),
            "folder" => fs::create_dir(&lock).unwrap(),
            _ => {
                let made = Command::new("mkfifo").arg(&lock).status().unwrap();
                assert!(made.success());
            }
        }
        let place = again.clone();
        let error = bounded(move || Folder::lock(&place).unwrap_err());
        assert!(matches!(error, PhantomError::File { .. }), "{error}");
        assert_eq!(fs::read_to_string(&other).unwrap(), "not ours");
        match kind {
            "folder" => fs::remove_dir(&lock).unwrap(),
            _ => fs::remove_file(&lock).unwrap(),
        }
    }
}
