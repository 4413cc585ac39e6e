//! Polar maps and ejection fractions measured on ground truth of known shape.

use super::small;
use heart_phantom::Phantom;
use heart_phantom::scene::{Defect, Mode, Scene};

fn fine(mode: Mode) -> Scene {
    let mut scene = small(mode).with_size(96);
    scene.camera.pitch = [0.2; 2];
    scene.camera.views = 2;
    scene
}

#[test]
fn a_polar_map_has_the_activity_and_the_volume_of_the_heart() {
    let phantom = Phantom::new(fine(Mode::Static { phase: 0.5 })).unwrap();
    let map = phantom.polar_map(0, &phantom.truth(0).unwrap()).unwrap();
    let exact = phantom.shape(0.5).unwrap().volumes()[0];
    // Voxels of 2 mm between which the image is linear: the edge is at half of a wall five voxels thick.
    assert!(
        (map.cavity_ml / exact - 1.0).abs() < 0.03,
        "{map:?} {exact}"
    );
    for value in map.segments {
        assert!((value - 1.0).abs() < 0.02, "{map:?}");
    }
}

/// A cold defect at one azimuth darkens the segments there, and no segment on the opposite side.
#[test]
fn a_defect_is_in_its_segments() {
    let mut scene = fine(Mode::Static { phase: 0.5 });
    // The full thickness of the wall, the middle third of its length, a third of the turn.
    scene.defects = vec![Defect {
        layers: [0.0, 1.0],
        s: [0.1, 0.3],
        azimuths_degrees: [0.0, 120.0],
        activity: 0.0,
    }];
    let phantom = Phantom::new(scene).unwrap();
    let map = phantom.polar_map(0, &phantom.truth(0).unwrap()).unwrap();
    let mid = &map.segments[6..12];
    let coldest = (0..6).min_by(|a, b| mid[*a].total_cmp(&mid[*b])).unwrap();
    assert!(mid[coldest] < 0.2, "{map:?}");
    assert!(mid[(coldest + 3) % 6] > 0.98, "{map:?}");
    assert!((map.segments[16] - 1.0).abs() < 0.02, "{map:?}");
}

/// The first segment is anterior: the pose rotates the body so that its segments are those of the patient.
#[test]
fn anterior_is_towards_front_and_head() {
    let phantom = Phantom::new(fine(Mode::Static { phase: 0.5 })).unwrap();
    let grid = *phantom.camera().grid();
    // Activity that increases towards front and head.
    let image: Vec<f32> = (0..grid.len())
        .map(|k| {
            let [nx, ny, _] = grid.shape();
            let place = grid.centre(k % nx, k / nx % ny, k / (nx * ny));
            (30.0 - place.y + place.z) as f32
        })
        .collect();
    let map = phantom.polar_map(0, &image).unwrap();
    for (anterior, inferior) in [(0, 3), (6, 9)] {
        assert!(map.segments[anterior] > map.segments[inferior], "{map:?}");
        let ring = &map.segments[anterior..anterior + 6];
        assert!(ring.iter().all(|value| *value <= ring[0]), "{map:?}");
    }
}

#[test]
fn the_ejection_fraction_of_exact_gates_is_near_the_true_one() {
    let phantom = Phantom::new(fine(Mode::Gated { gates: 8 })).unwrap();
    let cavity = |gate| {
        let truth = phantom.truth(gate).unwrap();
        phantom.polar_map(gate, &truth).unwrap().cavity_ml
    };
    let volumes: Vec<f64> = (0..8).map(cavity).collect();
    let most = volumes.iter().copied().fold(0.0, f64::max);
    let least = volumes.iter().copied().fold(f64::INFINITY, f64::min);
    let found = (most - least) / most;
    let exact = phantom.numbers().unwrap().ejection_fraction;
    // Averages over an eighth of a sinusoid lose 2 %; volumes on voxels of 2 mm are accurate to 3 %, a twentieth of the fraction each.
    assert!((found / exact - 1.0).abs() < 0.12, "{found} {exact}");
}
