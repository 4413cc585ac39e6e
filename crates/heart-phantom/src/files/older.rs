//! What an earlier run has left in a folder.

use super::atomic::{failed, remove_if_there};
use super::names::WORDS;
use super::{FolderLock, Format, ORBIT_EXTENSION, PROGRAM, REPORT, lock_folder};
use crate::error::PhantomError;
use serde::Deserialize;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufReader, Read};
use std::path::{Component, Path, PathBuf};

/// No report is longer.
const MOST_BYTES: u64 = 1 << 30;

/// What names of products may begin with besides [`WORDS`], and `fig` with two digits. Crates above take the names of theirs from here.
const OTHER_WORDS: [&str; 6] = ["static", "short", "long", "newton", "rubber", "index"];
/// What names of surfaces, pictures and pages end in.
const OTHER_EXTENSIONS: [&str; 5] = ["stl", "png", "gif", "svg", "html"];

/// What is read of an older report.
#[derive(Deserialize)]
struct Listed {
    program: String,
    files: Vec<PathBuf>,
}

/// Removes the report of an earlier run, and then the files that it lists and that are not to be written again.
///
/// Whoever has changed the report, only what is a file in the folder itself, by a name of a product ([`is_product`]), is removed: no folder, no link, no lock, nothing elsewhere.
///
/// # Errors
/// [`PhantomError::Foreign`], with nothing removed, if there is a `report.json` that is none of this program (a link of that name goes);
/// [`PhantomError::File`] for a file that cannot be removed.
pub fn remove_older(folder: &Path, kept: &[PathBuf]) -> Result<(), PhantomError> {
    let report = folder.join(REPORT);
    let files = match found(&report)? {
        Found::Nothing => return Ok(()),
        Found::Other => return Err(PhantomError::Foreign { path: report }),
        Found::Ours(files) => files,
    };
    // First of all: where it is, all that it lists is.
    remove_if_there(&report)?;
    for name in files.iter().filter_map(|name| plain(name)) {
        let path = folder.join(name);
        let is_file = fs::symlink_metadata(&path).is_ok_and(|found| found.is_file());
        if is_file && is_product(name) && !kept.iter().any(|kept| kept == name) {
            remove_if_there(&path)?;
        }
    }
    Ok(())
}

/// Takes the right to write files of these names into a folder, as [`lock_folder`], beside what a run has left there. For single
/// files of a program that is no run.
///
/// # Errors
/// [`PhantomError::Listed`] if one of them belongs to a run whose report is there: it would no longer be what the report says. Those
/// of [`lock_folder`].
pub fn lock_beside(folder: &Path, names: &[PathBuf]) -> Result<FolderLock, PhantomError> {
    let held = lock_folder(folder)?;
    if let Found::Ours(files) = found(&folder.join(REPORT))?
        && let Some(name) = names.iter().find(|name| files.contains(name))
    {
        let path = folder.join(name);
        return Err(PhantomError::Listed { path });
    }
    Ok(held)
}

/// Whether this may be the name of a product: only such a file is ever removed, so whoever lists files in a report names them so.
pub fn is_product(name: &OsStr) -> bool {
    let Some((stem, extension)) = name.to_str().and_then(|name| name.split_once('.')) else {
        return false;
    };
    let word = stem.split('-').next().unwrap_or_default();
    let is_figure = (word.strip_prefix("fig"))
        .is_some_and(|number| number.len() == 2 && number.bytes().all(|c| c.is_ascii_digit()));
    let of_a_format = |format: Format| {
        [
            Some(format.volume_extension()),
            format.volume_data_extension(),
            format.projections_extension(),
            format.projections_data_extension(),
        ]
        .contains(&Some(extension))
    };
    (is_figure || WORDS.contains(&word) || OTHER_WORDS.contains(&word))
        && (OTHER_EXTENSIONS.contains(&extension)
            || extension == ORBIT_EXTENSION
            || Format::ALL.into_iter().any(of_a_format))
}

/// Nothing can be renamed onto a folder: it is found out before there is something to rename.
pub(crate) fn check_no_folder(folder: &Path, names: &[PathBuf]) -> Result<(), PhantomError> {
    for name in names {
        let path = folder.join(name);
        if fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir()) {
            return Err(failed(&path, io::ErrorKind::IsADirectory.into()));
        }
    }
    Ok(())
}

/// What bears the name of a report.
enum Found {
    Nothing,
    /// A report of a run or the study, and what it lists.
    Ours(Vec<PathBuf>),
    /// Something else.
    Other,
}

fn found(report: &Path) -> Result<Found, PhantomError> {
    // What cannot be read cannot be replaced by right either.
    let unread = |source| failed(report, source);
    // Looked at before it is opened: a link may lead anywhere, a pipe would be waited for.
    match fs::symlink_metadata(report) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(error) => return Err(unread(error)),
        // What it leads to stays; it goes itself, as links of every other name do.
        Ok(found) if found.is_symlink() => return Ok(Found::Ours(Vec::new())),
        Ok(found) if !found.is_file() => return Ok(Found::Other),
        Ok(_) => {}
    }
    let file = File::open(report).map_err(unread)?;
    let listed = serde_json::from_reader(BufReader::new(file.take(MOST_BYTES)));
    Ok(match listed {
        Ok(Listed { program, files }) if same_program(&program) => Found::Ours(files),
        _ => Found::Other,
    })
}

/// Whether both are this program, of any version.
fn same_program(program: &str) -> bool {
    let name = |program: &str| program.split(' ').next().map(str::to_owned);
    name(program) == name(PROGRAM)
}

/// A name that is nothing but a name.
fn plain(name: &Path) -> Option<&OsStr> {
    let mut parts = name.components();
    match (parts.next(), parts.next()) {
        (Some(Component::Normal(only)), None) => Some(only),
        _ => None,
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
        let held = lock_folder(&folder).unwrap();
        remove_older(&folder, &["slice.png".into()]).unwrap();
        for name in others {
            assert!(folder.join(name).exists(), "{name}");
        }
        #[cfg(unix)]
        assert!(folder.join("outer.stl").is_symlink());
        for name in ["truth.npy", "inner-gate-03.stl", REPORT] {
            assert!(!folder.join(name).exists(), "{name}");
        }
        // The folder is still ours alone.
        let second = lock_folder(&folder);
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
            let error = remove_older(folder.path(), &[]).unwrap_err();
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
            remove_older(folder.path(), &[]).unwrap();
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
        std::thread::spawn(move || send.send(remove_older(&path, &[])).unwrap());
        // Far longer than a look at a file takes, so that the test ends where one waits.
        let answer = receive.recv_timeout(std::time::Duration::from_secs(60));
        assert!(matches!(answer, Ok(Err(PhantomError::Foreign { .. }))));
    }

    #[test]
    fn what_a_report_lists_is_not_written_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["activity.npy", "labels.npy"].map(PathBuf::from);
        assert!(lock_beside(folder.path(), &names).is_ok());
        write_report(folder.path(), &json!(["truth.npy", "report.json"]));
        assert!(lock_beside(folder.path(), &names).is_ok());
        write_report(folder.path(), &json!(["labels.npy", "report.json"]));
        let error = lock_beside(folder.path(), &names).unwrap_err();
        let expected = folder.path().join("labels.npy");
        assert!(matches!(&error, PhantomError::Listed { path } if *path == expected));
        // And nobody else's turn is lost by it.
        assert!(lock_folder(folder.path()).is_ok());
    }
}
