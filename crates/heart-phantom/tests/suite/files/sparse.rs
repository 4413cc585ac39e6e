//! Files without their pages of zeros.

use heart_phantom::files::write_atomically;
use proptest::prelude::*;
use std::fs;

const PAGE: usize = 4096;

/// Lengths of alternating runs of data and zeros, around the pages.
fn runs() -> impl Strategy<Value = Vec<(usize, usize)>> {
    let run = || prop_oneof![0..3 * PAGE, (0..40usize).prop_map(|n| n * PAGE)];
    prop::collection::vec((run(), run()), 0..6)
}

proptest! {
    #[test]
    fn the_bytes_are_those_of_an_ordinary_file(runs in runs(), at_once in 1..50 * PAGE) {
        let of = |(data, zeros)| [vec![7; data], vec![0; zeros]].concat();
        let bytes: Vec<u8> = runs.into_iter().flat_map(of).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let pieces = || bytes.chunks(at_once);
        write_atomically(&path, |out| pieces().try_for_each(|piece| out.write_all(piece))).unwrap();
        prop_assert!(fs::read(&path).unwrap() == bytes);
    }
}

/// On file systems without sparse files this is no less than the length, which is no error.
#[cfg(target_os = "linux")]
#[test]
fn pages_of_zeros_are_not_stored() {
    use std::os::unix::fs::MetadataExt;
    let folder = tempfile::tempdir().unwrap();
    let stored = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        write_atomically(&path, |out| out.write_all(bytes)).unwrap();
        let found = fs::metadata(&path).unwrap();
        assert_eq!(found.len(), bytes.len() as u64);
        512 * found.blocks()
    };
    let mut bytes = vec![0; 1 << 20];
    bytes[500_000] = 1;
    let [sparse, full] = [stored("sparse", &bytes), stored("full", &vec![1; 1 << 20])];
    assert!(sparse < 1 << 16 || sparse >= full, "{sparse} {full}");
}
