//! Files that remain after the program is interrupted while it writes: all or none. A process to be interrupted waits for input that
//! never comes, so that no test depends on timing. Every wait ends after [`program::PATIENCE`]. Signals that are ignored here, as under
//! `nohup` or in the background of a script, are omitted.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]
#![cfg(unix)]

use heart_phantom::files::write_atomically;
use std::fs;
use std::path::Path;

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// The program's own.
#[path = "../src/command_line/signals.rs"]
mod signals;

mod program {
    use super::{names, signals, write_atomically};
    use std::fs::{self, File};
    use std::io::{BufRead, BufReader, Read, Write};
    use std::os::unix::process::ExitStatusExt;
    use std::path::{Path, PathBuf};
    use std::process::{Child, Command, ExitStatus, Output, Stdio};
    use std::sync::mpsc;
    use std::thread;
    use std::time::{Duration, Instant};

    const PROGRAM: &str = env!("CARGO_BIN_EXE_heart-phantom");
    /// Names and numbers of the signals that end the program.
    const ENDING: [(&str, i32); 4] = [("INT", 2), ("TERM", 15), ("HUP", 1), ("XCPU", 24)];

    /// Longest wait for another process, far above the needs of a busy machine.
    const PATIENCE: Duration = Duration::from_secs(300);

    /// The result of work that may wait for another process.
    fn bounded<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
        let (done, result) = mpsc::channel();
        thread::spawn(move || done.send(work()));
        result
            .recv_timeout(PATIENCE)
            .expect("the other process answers")
    }

    fn ended(mut child: Child) -> ExitStatus {
        bounded(move || child.wait().unwrap())
    }

    fn output(mut command: Command) -> Output {
        bounded(move || command.output().unwrap())
    }

    /// The writing end of a pipe, once its reader has opened it.
    fn opened(pipe: &Path) -> File {
        let pipe = pipe.to_owned();
        bounded(move || File::options().write(true).open(pipe).unwrap())
    }

    /// The signals that this process, and so its children, do not ignore.
    fn delivered() -> impl Iterator<Item = (&'static str, i32)> {
        // Linux only; elsewhere no signal counts as ignored.
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let ignored = mask(&status, "SigIgn:").unwrap_or(0);
        ENDING
            .into_iter()
            .filter(move |(_, number)| ignored >> (number - 1) & 1 == 0)
    }

    /// A set of signals out of `/proc/PID/status`.
    fn mask(status: &str, name: &str) -> Option<u64> {
        let mask = status.lines().find_map(|line| line.strip_prefix(name))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    }

    const SCENE: &str = "[heart]\ndiscretisation = { differences = { nodes = 51 } }\n\
        [camera]\nviews = 32\nbins = 128\nrows = 128\npitch = [0.125, 0.125]\n\
        [acquisition]\nmode = { gated = { gates = 3 } }\naccuracy = { steps = 2 }\n\
        [truth]\ntolerance = 0.5\n\
        [output]\nwrite = ['projections', 'reconstruction', 'truth', 'labels', 'pictures']\n\
        volumes = 'nifti-gz'\nprojections = 'interfile-stir'\n";

    /// A scene that takes a third of a second, mostly for writing: single files, pairs, compressed files, images.
    fn scene(folder: &Path) -> PathBuf {
        let path = folder.join("scene.toml");
        fs::write(&path, SCENE).unwrap();
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

    /// A scene that is a pipe: reading blocks until it is written.
    fn pipe(folder: &Path) -> PathBuf {
        let path = folder.join("pipe.toml");
        let made = Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(made.success());
        path
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

    /// No file, or all files and each bitwise identical to that of the complete run.
    fn all_or_none(out: &Path, whole: &Path) {
        let found = match out.exists() {
            true => names(out),
            false => Vec::new(),
        };
        assert!(found.is_empty() || found == names(whole), "{found:?}");
        for name in &found {
            let same = fs::read(out.join(name)).unwrap() == fs::read(whole.join(name)).unwrap();
            assert!(same, "{name}");
        }
    }

    /// Sends a signal once `out` has `seen` files, unless the program is faster.
    fn interrupted(mut child: Child, out: &Path, seen: usize, signal: &str) -> ExitStatus {
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(status) = child.try_wait().unwrap() {
                return status;
            }
            if seen == 0 || out.is_dir() && names(out).len() >= seen {
                send(signal, &child); // one that has just ended stays there until it is waited for
                return ended(child);
            }
            assert!(Instant::now() < end, "the program writes its files");
            thread::yield_now();
        }
    }

    fn ended_by(status: ExitStatus, signal: i32) -> bool {
        status.signal() == Some(signal)
    }

    /// A write that has printed a message and waits for input that never comes.
    fn write_that_waits(path: &Path) {
        signals::watch(None).unwrap();
        let end = write_atomically(path, |out| {
            out.write_all(b"half")?;
            println!("begun");
            let input = std::io::stdin().read(&mut [0])?;
            panic!("{input} bytes of input");
        });
        panic!("{end:?}");
    }

    #[test]
    fn an_interrupted_write_leaves_no_files() {
        const WRITE: &str = "HEART_PHANTOM_TEST_WRITE";
        if let Some(path) = std::env::var_os(WRITE) {
            return write_that_waits(Path::new(&path));
        }
        for (name, number) in delivered() {
            // Into an empty directory, and over an older file.
            for older in [&[][..], &["a.txt"]] {
                let folder = tempfile::tempdir().unwrap();
                let path = folder.path().join("a.txt");
                for file in older {
                    fs::write(folder.path().join(file), "old").unwrap();
                }
                let mut child = Command::new(std::env::current_exe().unwrap())
                    .args(["--exact", "--nocapture"])
                    .arg("program::an_interrupted_write_leaves_no_files")
                    .env(WRITE, &path)
                    .stdin(Stdio::piped())
                    .stdout(Stdio::piped())
                    .spawn()
                    .unwrap();
                let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
                assert!(bounded(
                    move || said.any(|line| line.unwrap().contains("begun"))
                ));
                assert_eq!(names(folder.path()).len(), older.len() + 1);
                let input = child.stdin.take(); // `wait` would close it
                send(name, &child);
                let status = ended(child);
                drop(input);
                assert!(ended_by(status, number), "{name}: {status}");
                assert_eq!(names(folder.path()), older);
                for file in older {
                    let text = fs::read_to_string(folder.path().join(file)).unwrap();
                    assert_eq!(text, "old");
                }
            }
        }
    }

    /// The program handles its signals and ends by them anywhere, here while it waits for its scene.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_signal_ends_the_program_by_itself() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, out) = (pipe(folder.path()), folder.path().join("out"));
        for (name, number) in delivered() {
            let mut child = Command::new(PROGRAM);
            let child = child.arg("run").arg(&scene).arg("--out").arg(&out);
            let child = child.stderr(Stdio::piped()).spawn().unwrap();
            // The open returns when the program opens the other end, after it has installed its signal handling.
            let waits = opened(&scene);
            let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
            let caught = mask(&status, "SigCgt:").unwrap();
            assert_eq!(caught >> (number - 1) & 1, 1, "{name}: {status}");
            send(name, &child);
            let output = bounded(move || child.wait_with_output().unwrap());
            drop(waits);
            assert!(ended_by(output.status, number), "{name}: {output:?}");
            assert!(!out.exists());
            let said = String::from_utf8(output.stderr).unwrap();
            assert_eq!(said, "interrupted: incomplete output was removed\n");
            // A cohort has a note on its unfinished shard.
            let mut cohort = Command::new(PROGRAM);
            cohort.args(["cohort", "run"]).arg(&scene).arg("--out");
            let cohort = cohort.arg(&out).stderr(Stdio::piped()).spawn().unwrap();
            let waits = opened(&scene);
            send(name, &cohort);
            let output = bounded(move || cohort.wait_with_output().unwrap());
            drop(waits);
            assert!(ended_by(output.status, number), "{output:?}");
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(
                said.starts_with("interrupted: complete shards are kept"),
                "{said}"
            );
        }
    }

    /// The position of the program at the signal depends on the machine; the assertions do not.
    #[test]
    fn an_interrupt_at_any_moment_leaves_all_files_or_none() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, whole) = (scene(folder.path()), folder.path().join("whole"));
        assert!(output(run(&scene, &whole)).status.success());
        // From an empty directory over the first file to the last ones.
        for (k, seen) in (0..names(&whole).len()).step_by(5).enumerate() {
            let (name, number) = ENDING[k % ENDING.len()];
            let out = folder.path().join(format!("{name}-{seen}"));
            let child = run(&scene, &out).spawn().unwrap();
            let status = interrupted(child, &out, seen, name);
            assert!(status.success() || ended_by(status, number), "{status}");
            assert!(!status.success() || out.join("report.json").exists());
            all_or_none(&out, &whole);
        }
    }

    /// The study of the paper, which may be complete at the signal; the next one finds no foreign file.
    #[test]
    fn an_interrupted_study_can_be_repeated() {
        let folder = tempfile::tempdir().unwrap();
        let study = || {
            let mut command = Command::new(PROGRAM);
            command.args(["paper", "--size", "24", "--views", "6", "--nodes", "51"]);
            command.args(["--quiet", "--out", "out"]);
            command.current_dir(folder.path()).stderr(Stdio::piped());
            command
        };
        let out = folder.path().join("out");
        for (name, number) in delivered() {
            let status = interrupted(study().spawn().unwrap(), &out, 4, name);
            assert!(status.success() || ended_by(status, number), "{status}");
            let found = names(&out);
            let is_complete = found.contains(&"report.json".to_owned());
            assert!(
                is_complete || !status.success() && found.is_empty(),
                "{found:?}"
            );
            if is_complete {
                fs::remove_dir_all(&out).unwrap();
            }
        }
        assert!(output(study()).status.success());
    }

    /// As under `nohup`, or in the background of a script.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_ignored_signal_stays_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, out) = (pipe(folder.path()), folder.path().join("out"));
        let child = Command::new("sh")
            .args([
                "-c",
                "trap '' INT HUP; exec \"$0\" run --quiet \"$1\" --out \"$2\"",
                PROGRAM,
            ])
            .args([&scene, &out])
            .spawn()
            .unwrap();
        let mut waits = opened(&scene);
        for signal in ["INT", "HUP"] {
            send(signal, &child);
        }
        waits.write_all(SCENE.as_bytes()).unwrap();
        drop(waits);
        assert!(ended(child).success());
        assert!(out.join("report.json").exists());
    }

    /// The limit of the file size, in blocks of 512 or 1024 bytes, is below the size of a file of views. Its signal would end the program.
    #[test]
    fn a_full_disk_is_an_error_and_leaves_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let (scene, out) = (scene(folder.path()), folder.path().join("out"));
        let mut command = Command::new("sh");
        command
            .args([
                "-c",
                "ulimit -f 1000; exec \"$0\" run --quiet \"$1\" --out \"$2\"",
                PROGRAM,
            ])
            .args([&scene, &out]);
        let output = output(command);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{}: {said}", output.status);
        assert!(
            said.contains("cannot write") && said.contains("projections-gate-00.s"),
            "{said}"
        );
        assert!(!out.exists(), "{:?}", names(&out));
    }
}
