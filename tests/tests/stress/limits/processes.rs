//! Folders without write permission, and a process that is killed while it writes.

use super::*;

#[test]
fn a_read_only_directory_is_an_error() {
    let grid = VoxelGrid::cube(2, 0.1).expect("a grid");
    let volume = Volume::new(grid, [0.5_f32; 8].as_slice()).expect("a volume");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "x").expect("a file");
    // A file in place of the directory; a system directory that accepts no files.
    for place in [file.as_path(), Path::new("/proc/self"), Path::new("/sys")] {
        for refused in [
            write_npy(&place.join("a.npy"), &[8], &[0.5_f32; 8]).err(),
            files::write(&place.join("a.nii"), &volume, Format::Nifti).err(),
            heart_phantom::files::create_writable_folder(&place.join("sub")).err(),
        ] {
            assert!(
                matches!(refused, Some(PhantomError::File { .. })),
                "{refused:?}"
            );
        }
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        1
    );
}

/// Whether `done` returns `true` within a minute; it is called repeatedly.
fn within_a_minute(mut done: impl FnMut() -> bool) -> bool {
    let end = Instant::now() + Duration::from_secs(60);
    loop {
        if done() {
            return true;
        }
        if Instant::now() > end {
            return false;
        }
    }
}

/// A child process writes one file repeatedly, each time with another number throughout, and is killed at any time: before and after, the file is
/// always one of those files, complete.
#[test]
fn a_process_killed_while_it_writes_leaves_a_complete_file() {
    const FILE: &str = "STRESS_INTERRUPTED_FILE";
    const LENGTH: usize = 1 << 18;
    if let Some(file) = std::env::var_os(FILE) {
        for k in 0..=u16::MAX {
            let samples = vec![f32::from(k); LENGTH];
            write_npy(Path::new(&file), &[LENGTH], &samples).expect("room for a megabyte");
        }
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.npy");
    /// The number in a complete file; `None` before the first file.
    fn number(file: &Path) -> Option<f32> {
        let bytes = std::fs::read(file).ok()?;
        let (header, samples) = bytes.split_at(128);
        assert_eq!((header.len(), samples.len()), (128, 4 * LENGTH));
        let (samples, _) = samples.as_chunks::<4>();
        assert!(samples.iter().all(|sample| *sample == samples[0]));
        Some(f32::from_le_bytes(samples[0]))
    }
    for round in 0_u8..12 {
        let mut child = Command::new(std::env::current_exe().expect("this program"))
            .args([
                "--exact",
                "limits::processes::a_process_killed_while_it_writes_leaves_a_complete_file",
            ])
            .env(FILE, &file)
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("a child");
        let enough = f32::from(round / 4);
        let written = within_a_minute(|| {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
            number(&file).is_some_and(|found| found >= enough)
        });
        child.kill().expect("a child that runs");
        assert!(written, "no file in a minute");
        let ended = within_a_minute(|| child.try_wait().expect("a child").is_some());
        assert!(ended, "it runs on after a kill");
        assert!(number(&file).is_some_and(|found| found >= enough));
        std::fs::remove_file(&file).expect("the file");
    }
}
