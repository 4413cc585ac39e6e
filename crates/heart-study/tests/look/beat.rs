//! Volumes of all gates in the page.

use crate::look::beat::Beat;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::Phantom;
use heart_phantom::Scene;
use std::io::Read;

#[test]
fn voxels_of_the_page_are_averages_at_their_positions() {
    let phantom = Phantom::new(Scene::default().with_size(8)).unwrap();
    assert_eq!(Beat::new(&phantom).factor, 1);
    let mut beat = Beat::with_factor(&phantom, 2);
    let volume: Vec<f32> = (0..512).map(|k| (k % 8) as f32).collect();
    beat.push(&volume);
    assert_eq!(beat.samples.len(), 64);
    assert_eq!(beat.samples[..4], [0.5, 2.5, 4.5, 6.5]);
    let packed = STANDARD.decode(beat.base64([0.0, 255.0]).unwrap()).unwrap();
    let mut nifti = Vec::new();
    flate2::read::GzDecoder::new(packed.as_slice())
        .read_to_end(&mut nifti)
        .unwrap();
    let float = |at: usize| f32::from_le_bytes(nifti[at..at + 4].try_into().unwrap());
    assert_eq!(float(80), 40.0); // mm, of 16 cm in 8 voxels
    assert_eq!(float(268), 60.0); // of x, which points the other way
    assert_eq!(nifti[352..356], [1, 3, 5, 7]); // halves are rounded up
}
