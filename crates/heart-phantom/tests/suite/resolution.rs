//! The resolution at which images behind a response are computed, and its stated error.

use heart_phantom::scene::{BlurSettings, DiscretisationSettings};
use heart_phantom::{Accuracy, BinSample, Mode, Scene, radon::ArcPolicy};
use heart_phantom::{Phantom, Uptake, no_observer};

fn scene(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_size(16).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.camera.views = 4;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.blur = Some(BlurSettings { fwhm: 1.5 });
    scene
}

/// The error of a resolution is estimated as half of that of the next coarser one, and that of the corners of the meridian: a target between both
/// needs the finer one.
#[test]
fn the_stated_error_of_bins_halves_with_the_next_resolution() {
    let found = |tolerance: f64| {
        let mut scene = scene(Mode::Static { phase: 0.3 });
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        let phantom = Phantom::new(scene).unwrap();
        let views = phantom.sinograms(0, &no_observer).unwrap();
        (
            phantom.resolution().unwrap().unwrap().density,
            views.view_error.bins,
        )
    };
    let (coarse, error) = found(1.0);
    // Half of the tolerance is for bins.
    let (fine, half) = found(2.0 * 0.75 * error);
    assert!(fine > coarse);
    // The corners of 101 nodes contribute a hundredth.
    assert!((0.5..0.51).contains(&(half / error)), "{half} {error}");
}

/// Bins that contain the apex only at end-diastole, behind a narrow response: the error is relative to the images with activity.
#[test]
fn a_heart_outside_the_rows_at_end_systole_has_a_resolution() {
    let found = |tolerance: f64| {
        let mut scene = scene(Mode::WholeCycle);
        scene.blur = None;
        scene.camera.samples = Some(BinSample::Averages);
        (scene.camera.rows, scene.camera.pitch) = (4, [0.8; 2]);
        // The highest point of the heart is below the rows at end-systole, by 0.2 cm, and in the lowest row at end-diastole.
        scene.pose.shift[2] = -6.0;
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        let phantom = Phantom::new(scene).unwrap();
        for (phase, is_inside) in [(0.0, false), (0.5, true)] {
            let [_, high] = phantom
                .shape(phase)
                .unwrap()
                .body()
                .bounding_box(1)
                .unwrap();
            assert_eq!(high.z > -1.6, is_inside);
        }
        phantom.sinograms(0, &no_observer).unwrap()
    };
    let [rough, fine] = [0.1, 0.01].map(found);
    let most = fine.samples.iter().copied().fold(0.0f32, f32::max);
    let off = rough
        .samples
        .iter()
        .zip(&fine.samples)
        .map(|(a, b)| (a - b).abs());
    let off = f64::from(off.fold(0.0f32, f32::max) / most);
    assert!(most > 0.0 && off < rough.view_error.total(), "{off:e}");
    assert!(rough.view_error.bins > 0.0);
}

/// Without activity every resolution is exact.
#[test]
fn views_without_activity_have_the_coarsest_resolution() {
    let mut scene = scene(Mode::WholeCycle);
    scene.activity.wall = Uptake::Concentration(0.0);
    scene.acquisition.accuracy = Accuracy::Tolerance(1e-3);
    let phantom = Phantom::new(scene).unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap();
    assert!(views.samples.iter().all(|sample| *sample == 0.0));
    assert_eq!(views.view_error.bins, 0.0);
    assert_eq!(phantom.resolution().unwrap().unwrap().density, 0.7);
}
