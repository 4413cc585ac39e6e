//! The previous run of an output directory: its report and the files that the report lists.

use super::atomic::{failed, remove_if_there};
use super::{Folder, Format, ORBIT_EXTENSION, PROGRAM, REPORT};
use crate::error::PhantomError;
use serde::Deserialize;
use std::fs::{self, File};
use std::io::{self, BufReader, Read};
use std::path::{Component, Path, PathBuf};

/// Longest report that is read, in bytes.
const MOST_BYTES: u64 = 1 << 30;
/// Extensions of surfaces, pictures, pages and orbits, which are no formats of volumes.
const OTHER_EXTENSIONS: [&str; 6] = ["stl", "png", "gif", "svg", "html", ORBIT_EXTENSION];

/// The part of a report that is read.
#[derive(Deserialize)]
struct Listed {
    program: String,
    files: Vec<PathBuf>,
}

impl Folder {
    /// Removes the report of the previous run, and then the files that it lists and that are not among `names`, the files to be
    /// written.
    ///
    /// Whatever the report lists, only regular files in the directory itself with an extension of the formats are removed: no
    /// directory, no link, no lock, nothing elsewhere.
    ///
    /// # Errors
    /// [`PhantomError::File`] for a directory of the name of a file to be written, [`PhantomError::Foreign`] for a `report.json` of
    /// another program, both with nothing removed (a link of that name is removed, not followed); [`PhantomError::File`] for a file
    /// that cannot be removed.
    pub fn clear(&self, names: &[PathBuf]) -> Result<(), PhantomError> {
        for name in names {
            let path = self.path().join(name);
            if fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir()) {
                return Err(failed(&path, io::ErrorKind::IsADirectory.into()));
            }
        }
        let report = self.path().join(REPORT);
        let Some(files) = listed(&report)? else {
            return Ok(());
        };
        // First: a directory with a report has all files that it lists.
        remove_if_there(&report)?;
        for name in files.iter().filter(|name| !names.contains(name)) {
            let path = self.path().join(name);
            let is_file = fs::symlink_metadata(&path).is_ok_and(|found| found.is_file());
            if is_file && is_output(name) {
                remove_if_there(&path)?;
            }
        }
        Ok(())
    }
}

/// Tests that the report in a directory, if there is one, lists none of these names, for single files beside those of a run.
///
/// # Errors
/// [`PhantomError::Listed`] with the first name that it lists; [`PhantomError::File`] if the report cannot be read.
pub fn check_unlisted(folder: &Path, names: &[PathBuf]) -> Result<(), PhantomError> {
    let files = match listed(&folder.join(REPORT)) {
        Err(PhantomError::Foreign { .. }) | Ok(None) => return Ok(()),
        files => files?.unwrap_or_default(),
    };
    match names.iter().find(|name| files.contains(name)) {
        None => Ok(()),
        Some(name) => Err(PhantomError::Listed {
            path: folder.join(name),
        }),
    }
}

/// Whether this is a plain name with an extension of a format, a surface, a picture or a page.
fn is_output(name: &Path) -> bool {
    let mut parts = name.components();
    let (Some(Component::Normal(only)), None) = (parts.next(), parts.next()) else {
        return false;
    };
    let Some((_, extension)) = only.to_str().and_then(|name| name.split_once('.')) else {
        return false;
    };
    let of_a_format = |format: Format| {
        let info = format.info();
        [Some(info.volume), info.projections]
            .into_iter()
            .flatten()
            .any(|known| known.header == extension || known.data == Some(extension))
    };
    OTHER_EXTENSIONS.contains(&extension) || Format::ALL.into_iter().any(of_a_format)
}

/// The files that a report lists; `None` if there is no report.
fn listed(report: &Path) -> Result<Option<Vec<PathBuf>>, PhantomError> {
    let foreign = || PhantomError::Foreign {
        path: report.to_path_buf(),
    };
    let failed = |source| failed(report, source);
    // Before it is opened: a link may lead anywhere, a pipe would block.
    match fs::symlink_metadata(report) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
        Ok(found) if found.is_symlink() => return Ok(Some(Vec::new())),
        Ok(found) if !found.is_file() => return Err(foreign()),
        Ok(_) => {}
    }
    let file = File::open(report).map_err(failed)?;
    let read: Result<Listed, _> = serde_json::from_reader(BufReader::new(file.take(MOST_BYTES)));
    let name = |program: &str| program.split(' ').next().map(str::to_owned);
    match read {
        // Of any version.
        Ok(read) if name(&read.program) == name(PROGRAM) => Ok(Some(read.files)),
        _ => Err(foreign()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn write_report(folder: &Path, files: &serde_json::Value) {
        let report = json!({ "program": PROGRAM, "files": files, "else": [1, 2] });
        fs::write(folder.join(REPORT), report.to_string()).unwrap();
    }

    fn clear(folder: &Path) -> Result<(), PhantomError> {
        Folder::lock(folder).unwrap().clear(&[])
    }

    /// A report that somebody has changed, to have other files removed.
    #[test]
    fn a_tampered_report_removes_nothing_else() {
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
        let held = Folder::lock(&folder).unwrap();
        held.clear(&["slice.png".into()]).unwrap();
        for name in others {
            assert!(folder.join(name).exists(), "{name}");
        }
        #[cfg(unix)]
        assert!(folder.join("outer.stl").is_symlink());
        for name in ["truth.npy", "inner-gate-03.stl", REPORT] {
            assert!(!folder.join(name).exists(), "{name}");
        }
        // The folder is still ours alone.
        let second = Folder::lock(&folder);
        assert!(
            matches!(second, Err(PhantomError::Busy { .. })),
            "{second:?}"
        );
        drop(held);
    }

    /// What is no report of ours stays, and so does what it lists.
    #[test]
    fn something_else_of_that_name_is_refused() {
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
        // A link to a report elsewhere is not read, and goes.
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

    /// Nobody writes to this pipe: whoever opens it waits for ever.
    #[cfg(unix)]
    #[test]
    fn a_pipe_is_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join(REPORT);
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let (send, receive) = std::sync::mpsc::channel();
        let path = folder.path().to_path_buf();
        std::thread::spawn(move || send.send(clear(&path)).unwrap());
        // Far longer than a look at a file takes, so that the test ends where one waits.
        let answer = receive.recv_timeout(std::time::Duration::from_secs(60));
        assert!(matches!(answer, Ok(Err(PhantomError::Foreign { .. }))));
    }

    #[test]
    fn what_a_report_lists_is_not_written_beside_it() {
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
}
