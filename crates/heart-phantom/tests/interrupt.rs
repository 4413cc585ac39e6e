//! What is left when a program is ended while it writes: whole files, and nothing else.
#![cfg(unix)]

use heart_phantom::files::{self, write_atomically};
use std::fs;
use std::path::Path;
use std::sync::mpsc;
use std::thread;

/// The test of the library itself is the only one here that writes through it: what is held is held for the whole process.
#[test]
fn what_is_unfinished_goes_and_what_was_there_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let (begun, has_begun) = mpsc::channel();
    let (go_on, may_go_on) = mpsc::channel();
    thread::scope(|scope| {
        let writer = scope.spawn(|| {
            write_atomically(&path, move |out| {
                out.write_all(b"half")?;
                begun.send(()).unwrap();
                may_go_on.recv().unwrap();
                out.write_all(b" and half")
            })
        });
        has_begun.recv().unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        let held = files::remove_unfinished();
        assert_eq!(names(folder.path()), ["a.txt"]);
        // Neither the end of that write nor the beginning of another one comes through.
        go_on.send(()).unwrap();
        let second = scope.spawn(|| write_atomically(&folder.path().join("b.txt"), |_| Ok(())));
        thread::sleep(std::time::Duration::from_millis(50));
        assert!(!writer.is_finished() && !second.is_finished());
        assert_eq!(names(folder.path()), ["a.txt"]);
        drop(held);
        let error = writer.join().unwrap().unwrap_err();
        assert!(error.to_string().contains("a.txt"), "{error}");
        second.join().unwrap().unwrap();
    });
    assert_eq!(names(folder.path()), ["a.txt", "b.txt"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[cfg(feature = "cli")]
mod program {
    use super::names;
    use std::fs;
    use std::os::unix::process::ExitStatusExt;
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, ExitStatus, Stdio};
    use std::thread;
    use std::time::{Duration, Instant};

    const PROGRAM: &str = env!("CARGO_BIN_EXE_heart-phantom");
    /// Names and numbers of the signals that the program gives way to.
    const ENDING: [(&str, i32); 4] = [("INT", 2), ("TERM", 15), ("HUP", 1), ("XCPU", 24)];

    /// A scene that takes a third of a second, most of it to write: single files, pairs, compressed, pictures.
    fn scene(folder: &Path) -> PathBuf {
        let path = folder.join("scene.toml");
        let text = "[heart]\ndiscretisation = { differences = { nodes = 51 } }\n\
            [camera]\nviews = 32\nbins = 128\nrows = 128\npitch = [0.125, 0.125]\n\
            [acquisition]\nmode = { gated = { gates = 3 } }\naccuracy = { steps = 2 }\n\
            [truth]\ntolerance = 0.5\n\
            [output]\nwrite = ['projections', 'reconstruction', 'truth', 'labels', 'pictures']\n\
            volumes = 'nifti-gz'\nprojections = 'interfile-stir'\n";
        fs::write(&path, text).unwrap();
        path
    }

    fn run(scene: &Path, out: &Path) -> Command {
        let mut command = Command::new(PROGRAM);
        command
            .args(["run", "--quiet", "--threads", "2"])
            .arg(scene);
        command.arg("--out").arg(out).stderr(Stdio::piped());
        command
    }

    /// `kill` of the shell, which every system has.
    fn send(signal: &str, child: &Child) {
        let kill = format!("kill -{signal} {}", child.id());
        assert!(
            Command::new("sh")
                .args(["-c", &kill])
                .status()
                .unwrap()
                .success()
        );
    }

    fn has_temporary(folder: &Path) -> bool {
        folder.is_dir() && names(folder).iter().any(|name| name.ends_with(".tmp"))
    }

    /// The program, stopped while a temporary file is there. On a busy machine that may take more than one run.
    fn stopped_while_it_writes(mut command: Command, out: &Path) -> Child {
        for _ in 0..100 {
            let mut child = command.spawn().unwrap();
            while child.try_wait().unwrap().is_none() {
                if !has_temporary(out) {
                    thread::sleep(Duration::from_micros(200));
                    continue;
                }
                send("STOP", &child);
                // It may take a moment until all its threads stand still.
                thread::sleep(Duration::from_millis(2));
                if has_temporary(out) {
                    return child;
                }
                send("CONT", &child);
            }
        }
        panic!("nothing to interrupt");
    }

    /// Every file is one of the whole run, byte for byte; headers have their data; a report has all.
    fn only_whole_files(out: &Path, whole: &Path) {
        if !out.exists() {
            return;
        }
        let found = names(out);
        for name in &found {
            let expected = fs::read(whole.join(name)).unwrap_or_else(|_| panic!("litter: {name}"));
            assert!(fs::read(out.join(name)).unwrap() == expected, "{name}");
            if let Some(stem) = name.strip_suffix(".hs") {
                assert!(found.contains(&format!("{stem}.s")), "{name} without data");
            }
            if let Some(stem) = name.strip_suffix(".s") {
                assert!(
                    found.contains(&format!("{stem}.hs")),
                    "{name} without header"
                );
            }
        }
        if found.contains(&"report.json".to_owned()) {
            assert_eq!(found, names(whole));
        }
    }

    fn ended_by(status: ExitStatus, signal: i32) -> bool {
        status.signal() == Some(signal)
    }

    #[test]
    fn an_interrupted_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, whole) = (scene(folder.path()), folder.path().join("whole"));
        assert!(run(&scene, &whole).status().unwrap().success());
        for (name, number) in ENDING {
            // Into an empty folder, and over the files of an older run.
            for again in [false, true] {
                let out = folder.path().join(format!("{name}-{again}"));
                if again {
                    assert!(run(&scene, &out).status().unwrap().success());
                }
                let mut child = stopped_while_it_writes(run(&scene, &out), &out);
                send(name, &child);
                send("CONT", &child);
                let status = child.wait().unwrap();
                assert!(ended_by(status, number), "{name}: {status}");
                only_whole_files(&out, &whole);
                assert!(
                    !out.join("report.json").exists(),
                    "{name}: not all is there"
                );
            }
        }
    }

    #[test]
    fn an_interrupt_at_any_moment_leaves_whole_files() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, whole) = (scene(folder.path()), folder.path().join("whole"));
        let start = Instant::now();
        assert!(run(&scene, &whole).status().unwrap().success());
        let full = start.elapsed();
        const MOMENTS: u32 = 8;
        for (k, moment) in (0..MOMENTS).flat_map(|moment| [(0, moment), (1, moment)]) {
            let (name, number) = ENDING[k];
            let out = folder.path().join(format!("{name}-{moment}"));
            let mut child = run(&scene, &out).spawn().unwrap();
            thread::sleep(full * moment / MOMENTS);
            send(name, &child); // a child that has ended stays there until it is waited for
            let status = child.wait().unwrap();
            assert!(status.success() || ended_by(status, number), "{status}");
            assert_eq!(status.success(), out.join("report.json").exists());
            only_whole_files(&out, &whole);
        }
    }

    /// As under `nohup`, or in the background of a script.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_signal_that_is_ignored_stays_so() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, out) = (scene(folder.path()), folder.path().join("out"));
        let mut command = Command::new("sh");
        command
            .args([
                "-c",
                "trap '' INT HUP; exec \"$0\" run --quiet \"$1\" --out \"$2\"",
                PROGRAM,
            ])
            .args([&scene, &out]);
        let mut child = stopped_while_it_writes(command, &out);
        for signal in ["INT", "HUP", "CONT"] {
            send(signal, &child);
        }
        assert!(child.wait().unwrap().success());
        assert!(out.join("report.json").exists());
    }

    /// The limit of a file's size, in blocks of 512 or 1024 bytes, is less than that of a file of views. Its signal would end the
    /// program by itself.
    #[test]
    fn a_disk_without_room_is_an_error_and_leaves_whole_files() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, out) = (scene(folder.path()), folder.path().join("out"));
        let output = Command::new("sh")
            .args([
                "-c",
                "ulimit -f 1000; exec \"$0\" run --quiet \"$1\" --out \"$2\"",
                PROGRAM,
            ])
            .args([&scene, &out])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{}: {said}", output.status);
        assert!(
            said.contains("cannot write") && said.contains("projections-gate-00.s"),
            "{said}"
        );
        assert_eq!(names(&out), Vec::<String>::new());
    }
}
