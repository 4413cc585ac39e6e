//! What the measures of a reconstruction say of volumes for which it is known.

use super::small;
use heart_phantom::scene::{BlurSettings, Mode, Scene};
use heart_phantom::{Artefacts, Phantom};

fn of_reconstruction(scene: Scene) -> Artefacts {
    let phantom = Phantom::new(scene).unwrap();
    let volume = phantom.volume(0).unwrap();
    let truth = phantom.truth(0).unwrap();
    phantom.artefacts(0, &volume, &truth).unwrap()
}

/// An edge blurred by a Gaussian falls from 90 to 10 % within 2 * 1.28155 standard deviations, here between the middle of a
/// thick wall and what is outside.
#[test]
fn the_blur_of_the_wall_is_that_of_the_detector() {
    let blurred = |fwhm: f64| {
        let mut scene = small(Mode::Static { phase: 0.0 }).with_size(96);
        scene.camera.views = 120;
        scene.camera.pitch = [0.2; 2];
        (scene.heart.inner.radius, scene.heart.inner.length) = (1.0, 6.0);
        (scene.heart.outer.radius, scene.heart.outer.length) = (5.0, 6.0);
        scene.blur = Some(BlurSettings { fwhm });
        of_reconstruction(scene)
    };
    let widths = |a: &Artefacts| [a.wall_blur_mm.unwrap(), a.apex_blur_mm.unwrap()];
    let sharp = widths(&blurred(0.0));
    for fwhm in [0.8, 1.2] {
        let gaussian = 10.0 * 2.0 * 1.281_551_6 * fwhm / (8.0 * 2.0f64.ln()).sqrt();
        for (found, sharp) in widths(&blurred(fwhm)).into_iter().zip(sharp) {
            // The width of voxels and filter adds in squares, as far as it is Gaussian; the wall is curved.
            let expected = gaussian.hypot(sharp);
            assert!(
                (found / expected - 1.0).abs() < 0.03,
                "{found} {expected} {sharp}"
            );
        }
    }
}

#[test]
fn the_truth_is_even_and_what_is_added_is_measured() {
    let phantom = Phantom::new(small(Mode::Static { phase: 0.25 }).with_size(64)).unwrap();
    let truth = phantom.truth(0).unwrap();
    let measured = |change: &dyn Fn(f32) -> f32| {
        let volume: Vec<f32> = truth.iter().map(|&v| change(v)).collect();
        phantom.artefacts(0, &volume, &truth).unwrap()
    };
    // Voxels two inside the wall hold nothing else; those three outside hold nothing. Sums are of f32.
    let near = |found: Option<f64>, expected: f64| {
        assert!(
            (found.unwrap() - expected).abs() < 1e-6,
            "{found:?} {expected}"
        );
    };
    let same = measured(&|v| v);
    near(same.streaks_outside, 0.0);
    near(same.wall_unevenness, 0.0);
    near(same.wall_mean, 1.0);
    near(same.rmse, 0.0);
    let raised = measured(&|v| v + 0.125);
    near(raised.streaks_outside, 0.125);
    near(raised.wall_mean, 1.125);
    near(raised.wall_unevenness, 0.0);
    near(raised.rmse, 0.125);
    let doubled = measured(&|v| 2.0 * v);
    near(doubled.wall_mean, 2.0);
    assert_eq!(doubled.wall_blur_mm, same.wall_blur_mm);
    assert_eq!(doubled.apex_blur_mm, same.apex_blur_mm);
}

#[test]
fn motion_blurs_and_gates_restore() {
    let artefacts = |mode: Mode| {
        let mut scene = small(mode).with_size(80);
        scene.camera.views = 60;
        of_reconstruction(scene)
    };
    let still = artefacts(Mode::Static { phase: 0.0 });
    let long = artefacts(Mode::WholeCycle);
    let gated = artefacts(Mode::Gated { gates: 8 });
    let short = artefacts(Mode::Instants);
    let blur = |a: &Artefacts| (a.wall_blur_mm.unwrap(), a.apex_blur_mm.unwrap());
    // A sharp edge is about a voxel and a half wide (2 mm voxels); the side moves by 3 mm, the apex by more.
    assert!(blur(&still).0 < 5.0 && blur(&still).1 < 5.0, "{still:?}");
    assert!(
        blur(&long).0 > blur(&still).0 + 1.0 && blur(&long).1 > blur(&still).1 + 1.0,
        "{long:?}"
    );
    assert!(
        blur(&gated).0 < blur(&long).0 && blur(&gated).1 < blur(&long).1,
        "{gated:?}"
    );
    // Views of different hearts do not fit together: streaks.
    assert!(
        short.streaks_outside.unwrap() > 2.0 * still.streaks_outside.unwrap(),
        "{short:?} {still:?}"
    );
}
