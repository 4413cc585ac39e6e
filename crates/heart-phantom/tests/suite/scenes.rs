//! The scenes of the crate: each runs, and agrees with its description.

use heart_phantom::{Accuracy, Scene};
use heart_phantom::{Phantom, WarningKind, no_observer, run};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes")
}

fn load(name: &str) -> Scene {
    Scene::load(&folder().join(name)).unwrap()
}

/// The same scene with fewer and larger bins, to a coarse tolerance: all its products, quickly.
fn rough(scene: Scene) -> Scene {
    let mut scene = scene.with_size(20);
    scene.camera.views = 8;
    scene.acquisition.accuracy = Accuracy::Tolerance(0.2);
    scene.truth.tolerance = 0.02;
    scene.heart.discretisation =
        heart_phantom::scene::DiscretisationSettings::Differences { nodes: 51 };
    scene
}

/// But for the attenuation that filtered back-projection does not model.
#[test]
fn every_scene_runs_without_a_warning() {
    let mut n = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let scene = Scene::load(&path).unwrap();
        let mut whole = scene.clone();
        whole.acquisition.accuracy = Accuracy::Tolerance(0.2); // no warning depends on it
        let whole = Phantom::new(whole).unwrap();
        let mut found = whole.warnings().unwrap();
        found.retain(|warning| warning.what != WarningKind::Uncorrected);
        assert_eq!(found, [], "{}", path.display());
        let out = tempfile::tempdir().unwrap();
        let report = run(
            &Phantom::new(rough(scene)).unwrap(),
            out.path(),
            &no_observer,
        )
        .unwrap();
        for file in &report.files {
            assert!(out.path().join(file).exists(), "{}", file.display());
        }
        n += 1;
    }
    assert_eq!(n, 3);
}

/// The example of the guide is the file, so that both run.
#[test]
fn the_guide_shows_the_gated_study() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../docs/guide-physicists.md");
    // Absent from the package of this crate.
    let Ok(guide) = std::fs::read_to_string(guide) else {
        return;
    };
    let scene = std::fs::read_to_string(folder().join("gated-spect.toml")).unwrap();
    assert!(guide.contains(&format!("```toml\n{scene}```")));
}

/// Apex left, front and down by published angles, and named walls; found in the label volume.
#[test]
fn the_clinical_pose_agrees_with_anatomy() {
    let mut scene = load("clinical-pose.toml");
    let axis = Phantom::new(scene.clone()).unwrap().heart().pose().axis();
    // +x left, +y back, +z head.
    let (left, front, down) = (axis.x, -axis.y, -axis.z);
    assert!(left > 0.0 && front > 0.0 && down > 0.0);
    assert!((down.atan2(left).to_degrees() - 38.0).abs() < 0.1);
    assert!((front.atan2(left).to_degrees() - 46.0).abs() < 0.1);

    // A region of the wall about each azimuth, seen from the middle of the wall, across the axis.
    let defect = scene.defects[0];
    scene.defects = [45.0, 135.0, 225.0, 315.0]
        .map(|middle| {
            let azimuths = [middle - 20.0, middle + 20.0];
            heart_phantom::Defect {
                azimuths_degrees: azimuths,
                ..defect
            }
        })
        .to_vec();
    let phantom = Phantom::new(scene).unwrap();
    let labels = phantom.labels(0.0).unwrap();
    let centre_of = |wanted: &dyn Fn(u8) -> bool| {
        let grid = phantom.camera().grid();
        let [nx, ny, _] = grid.shape();
        let (mut sum, mut n) = ([0.0; 3], 0.0);
        for (k, _) in labels
            .iter()
            .enumerate()
            .filter(|(_, label)| wanted(**label))
        {
            let at = grid.centre(k % nx, k / nx % ny, k / nx / ny);
            (sum, n) = ([sum[0] + at.x, sum[1] + at.y, sum[2] + at.z], n + 1.0);
        }
        sum.map(|sum| sum / n)
    };
    let middle = centre_of(&|label| label >= 3);
    let towards = |label: u8| {
        let piece = centre_of(&|found| found == label);
        [0, 1, 2].map(|a| piece[a] - middle[a])
    };
    // By the largest component of each: down, left, up, right. Several centimetres, with voxels of 6.4 mm.
    let [inferior, lateral, anterior, septal] = [3, 4, 5, 6].map(towards);
    assert!(
        inferior[2] < -1.0 && anterior[2] > 1.0,
        "{inferior:?} {anterior:?}"
    );
    assert!(
        lateral[0] > 1.0 && septal[0] < -1.0,
        "{lateral:?} {septal:?}"
    );
    // The anterior wall is in front of the inferior one, the septum in front of the lateral wall.
    assert!(anterior[1] < inferior[1] && septal[1] < lateral[1]);
    // The first defect of the scene: an infarct of the inferior wall.
    assert!((defect.azimuths_degrees[0] + defect.azimuths_degrees[1] - 90.0).abs() < 1e-9);
}

/// From right anterior over anterior and left to left posterior: the detector lies in the direction of the rays.
#[test]
fn the_clinical_camera_rotates_from_right_anterior_to_left_posterior() {
    let phantom = Phantom::new(load("clinical-pose.toml")).unwrap();
    let angles = phantom.camera().geometry().angles();
    let detector = |theta: f64| [-theta.sin(), theta.cos()];
    let near = |theta: f64, [x, y]: [f64; 2]| {
        let [a, b] = detector(theta);
        (a - x).hypot(b - y) < 1e-9
    };
    let diagonal = 0.5f64.sqrt();
    assert!(near(angles[0], [-diagonal, -diagonal]));
    assert!(near(angles[16], [0.0, -1.0]) && near(angles[48], [1.0, 0.0]));
    let end = angles[63] + (angles[1] - angles[0]);
    assert!(near(end, [diagonal, diagonal]));
}
