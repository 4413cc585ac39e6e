//! Output directories: the files of the previous run, and atomic files.

use heart_phantom::PhantomError;
use heart_phantom::files::{Folder, PROGRAM, REPORT, check_unlisted, write_atomically};
use serde_json::json;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

fn write_report(folder: &Path, files: &serde_json::Value) {
    let report = json!({ "program": PROGRAM, "files": files, "else": [1, 2] });
    fs::write(folder.join(REPORT), report.to_string()).unwrap();
}

fn clear(folder: &Path) -> Result<(), PhantomError> {
    Folder::lock(folder).unwrap().clear(&[])
}

#[test]
fn an_empty_path_is_not_the_current_directory() {
    let Err(PhantomError::File { source, .. }) = Folder::lock(Path::new("")) else {
        panic!("locked");
    };
    assert_eq!(source.to_string(), "the path is empty");
}

/// A report that lists other files for removal.
#[test]
fn a_manipulated_report_removes_no_other_files() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("out");
    fs::create_dir_all(folder.join("sub")).unwrap();
    let others = [
        "../truth.npy",
        "sub/truth.npy",
        "labels.npy",
        "slice.png",
        "main.c",
        "truth",
        "truth.c",
        "truth.npy.1-2.tmp",
        "Makefile",
    ];
    for name in others.iter().chain(&["truth.npy", "inner-gate-03.stl"]) {
        fs::write(folder.join(name), "x").unwrap();
    }
    let far = outside.path().join("truth.npy");
    #[cfg(unix)]
    std::os::unix::fs::symlink(&far, folder.join("outer.stl")).unwrap();
    let files = json!([
        "truth.npy",
        "inner-gate-03.stl",
        "slice.png",
        "outer.stl",
        "main.c",
        "truth",
        "truth.c",
        "truth.npy.1-2.tmp",
        "Makefile",
        ".heart-phantom.lock",
        "../truth.npy",
        "sub/truth.npy",
        "sub",
        "sub/../../truth.npy",
        far,
        "..",
        ".",
        "",
        "/",
        "gone",
        "./sub/truth.npy",
        "truth.npy\0",
        "report.json",
    ]);
    write_report(&folder, &files);
    let mut held = Folder::lock(&folder).unwrap();
    held.clear(&["slice.png".into()]).unwrap();
    for name in others {
        assert!(folder.join(name).exists(), "{name}");
    }
    #[cfg(unix)]
    assert!(folder.join("outer.stl").is_symlink());
    for name in ["truth.npy", "inner-gate-03.stl", REPORT] {
        assert!(!folder.join(name).exists(), "{name}");
    }
    // The directory is still locked.
    let second = Folder::lock(&folder);
    assert!(
        matches!(second, Err(PhantomError::Busy { .. })),
        "{second:?}"
    );
    drop(held);
}

/// Files other than our reports are kept, and so are the files that they list.
#[test]
fn foreign_reports_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let (report, file) = (folder.path().join(REPORT), folder.path().join("truth.npy"));
    fs::write(&file, "x").unwrap();
    let deep = "[".repeat(100_000);
    let refused = || {
        let error = clear(folder.path()).unwrap_err();
        assert!(
            matches!(&error, PhantomError::Foreign { path } if *path == report),
            "{error}"
        );
        assert!(file.exists() && report.symlink_metadata().is_ok());
    };
    for text in [
        "",
        "{",
        "[\"truth.npy\"]",
        "{\"files\": [\"truth.npy\"]}",
        "{\"program\": \"other\", \"files\": [\"truth.npy\"]}",
        "{\"program\": \"heart-phantoms 1\", \"files\": [\"truth.npy\"]}",
        "{\"program\": \"heart-phantom 0.1.0\", \"files\": \"truth.npy\"}",
        "{\"program\": \"heart-phantom 0.1.0\", \"files\": [1]}",
        &deep,
    ] {
        fs::write(&report, text).unwrap();
        refused();
        assert_eq!(fs::read_to_string(&report).unwrap(), text);
    }
    fs::remove_file(&report).unwrap();
    fs::create_dir(&report).unwrap();
    refused();
    fs::remove_dir(&report).unwrap();
    // A link to a report elsewhere is not read, and is removed.
    #[cfg(unix)]
    {
        let elsewhere = folder.path().join("elsewhere");
        write_report(folder.path(), &json!(["truth.npy"]));
        fs::rename(&report, &elsewhere).unwrap();
        std::os::unix::fs::symlink(&elsewhere, &report).unwrap();
        clear(folder.path()).unwrap();
        assert!(file.exists() && elsewhere.exists());
        assert!(report.symlink_metadata().is_err());
    }
}

/// A pipe without a writer: opening it blocks.
#[cfg(unix)]
#[test]
fn a_pipe_does_not_block() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join(REPORT);
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let (send, receive) = std::sync::mpsc::channel();
    let path = folder.path().to_path_buf();
    std::thread::spawn(move || send.send(clear(&path)).unwrap());
    // Far longer than reading a file takes, so that the test ends even if the call blocks.
    let answer = receive.recv_timeout(std::time::Duration::from_secs(60));
    assert!(matches!(answer, Ok(Err(PhantomError::Foreign { .. }))));
}

/// Files that no report lists, and files of a report that are replaced by an incomplete run.
#[test]
fn only_files_of_a_report_are_replaced_and_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let planned = ["truth.npy", "index.html", REPORT].map(PathBuf::from);
    for name in ["truth.npy", "index.html", "notes.txt"] {
        fs::write(path(name), "mine").unwrap();
    }
    let error = (Folder::lock(folder.path()).unwrap().clear(&planned)).unwrap_err();
    assert!(matches!(error, PhantomError::Foreign { path } if path.ends_with("truth.npy")));
    assert_eq!(fs::read_to_string(path("truth.npy")).unwrap(), "mine");
    // A run that finishes keeps its files, an incomplete one removes them.
    let listed = json!(["truth.npy", "index.html", REPORT]);
    write_report(folder.path(), &listed);
    let mut complete = Folder::lock(folder.path()).unwrap();
    complete.clear(&planned).unwrap();
    write_report(folder.path(), &listed);
    complete.finish();
    assert!(planned.iter().all(|name| folder.path().join(name).exists()));
    clear_and_drop(folder.path(), &planned);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

fn clear_and_drop(folder: &Path, planned: &[PathBuf]) {
    Folder::lock(folder).unwrap().clear(planned).unwrap();
}

#[test]
fn files_listed_in_a_report_are_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["activity.npy", "labels.npy"].map(PathBuf::from);
    assert!(check_unlisted(folder.path(), &names).is_ok());
    write_report(folder.path(), &json!(["truth.npy", "report.json"]));
    assert!(check_unlisted(folder.path(), &names).is_ok());
    write_report(folder.path(), &json!(["labels.npy", "report.json"]));
    let error = check_unlisted(folder.path(), &names).unwrap_err();
    let expected = folder.path().join("labels.npy");
    assert!(matches!(&error, PhantomError::Listed { path } if *path == expected));
}

#[test]
fn failure_keeps_the_old_file_and_leaves_no_temporary_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let result = write_atomically(&path, |out| {
        out.write_all(b"half of it")?;
        Err(io::ErrorKind::StorageFull.into())
    });
    assert!(matches!(result, Err(PhantomError::File { .. })));
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// Links to a foreign file under every name of a temporary file for a while, and under the last one.
#[cfg(unix)]
#[test]
fn links_are_not_followed_by_writes() {
    let folder = tempfile::tempdir().unwrap();
    let [path, other] = ["a.txt", "other"].map(|name| folder.path().join(name));
    fs::write(&other, "not ours").unwrap();
    let link = |name: &str| std::os::unix::fs::symlink(&other, folder.path().join(name));
    link("a.txt").unwrap();
    for count in 0..500 {
        link(&format!("a.txt.{}-{count}.tmp", std::process::id())).unwrap();
    }
    write_atomically(&path, |out| out.write_all(b"ours")).unwrap();
    assert_eq!(fs::read_to_string(&other).unwrap(), "not ours");
    assert_eq!(fs::read_to_string(&path).unwrap(), "ours");
    assert!(fs::symlink_metadata(&path).unwrap().is_file());
}
