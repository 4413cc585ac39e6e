//! The warning about line integrals through the centres of wide bins: when it appears, and the effect that it states.

use super::small;
use heart_phantom::scene::{BlurSettings, CollimatorSettings, HolesSettings};
use heart_phantom::{Accuracy, BinSample, Mode, Orbit, Scene};
use heart_phantom::{Phantom, WarningKind};

/// Line integrals through the centres of bins of this pitch.
fn centres(pitch: [f64; 2]) -> Scene {
    let mut scene = small(Mode::Static { phase: 0.3 });
    (scene.camera.bins, scene.camera.rows, scene.camera.pitch) = (26, 24, pitch);
    scene.camera.samples = Some(BinSample::Centres);
    scene
}

fn blurred(pitch: [f64; 2], fwhm: f64) -> Scene {
    let mut scene = centres(pitch);
    scene.blur = Some(BlurSettings { fwhm });
    scene
}

/// A heart a tenth as large, much of which single rays miss.
fn tiny(pitch: [f64; 2]) -> Scene {
    let mut scene = centres(pitch);
    for balloon in [&mut scene.heart.inner, &mut scene.heart.outer] {
        balloon.length *= 0.1;
        balloon.radius *= 0.1;
    }
    scene
}

/// Pitch, full width at half maximum and stated effect of the warning.
fn aliased(scene: &Scene) -> Option<[f64; 3]> {
    let warnings = Phantom::new(scene.clone()).unwrap().warnings().unwrap();
    let mut warnings = warnings.into_iter();
    let warning = warnings.find(|warning| warning.what == WarningKind::Aliased)?;
    Some(["pitch_cm", "fwhm_cm", "error"].map(|name| warning.numbers[name]))
}

/// The largest difference of the first view from bin averages, relative to their largest value. They are computed with bins a third as
/// wide, to the tolerance.
fn effect(scene: &Scene, tolerance: f64) -> f64 {
    let lines = Phantom::new(scene.clone()).unwrap().view(0, 0).unwrap();
    let mut fine = scene.clone();
    (fine.camera.bins, fine.camera.rows) = (3 * scene.camera.bins, 3 * scene.camera.rows);
    fine.camera.pitch = scene.camera.pitch.map(|pitch| pitch / 3.0);
    fine.camera.samples = Some(BinSample::Averages);
    fine.acquisition.accuracy = Accuracy::Tolerance(tolerance);
    let fine = Phantom::new(fine).unwrap().view(0, 0).unwrap();
    let bins = scene.camera.bins;
    let average = |k: usize| {
        let line = |j: usize| &fine[((k / bins * 3 + j) * bins + k % bins) * 3..][..3];
        (0..3).flat_map(line).sum::<f32>() / 9.0
    };
    let averages: Vec<f32> = (0..lines.len()).map(average).collect();
    let off = (lines.iter().zip(&averages)).map(|(a, b)| (a - b).abs());
    let largest = averages.iter().fold(0.0f32, |most, v| most.max(*v));
    f64::from(off.fold(0.0, f32::max) / largest)
}

#[test]
fn line_integrals_of_bins_wider_than_half_the_response_are_aliased() {
    // The wider side of a bin counts.
    for pitch in [[0.6, 0.5], [0.5, 0.6]] {
        let found = aliased(&blurred(pitch, 1.19)).unwrap();
        assert!(
            found[0] == 0.6 && (found[1] - 1.19).abs() < 1e-9,
            "{found:?}"
        );
        assert_eq!(aliased(&blurred(pitch, 1.21)), None);
    }
    // Bin averages, and line integrals without a response through a heart that is large compared with the bins.
    let mut averages = blurred([0.6; 2], 0.9);
    averages.camera.samples = Some(BinSample::Averages);
    assert_eq!(aliased(&averages), None);
    averages.camera.samples = None;
    assert_eq!(aliased(&averages), None);
    assert_eq!(aliased(&centres([0.6; 2])), None);
    // A heart that is small compared with the bins is aliased without a response, too.
    let [pitch, fwhm, error] = aliased(&tiny([0.6; 2])).unwrap();
    assert_eq!((pitch, fwhm), (0.6, 0.0));
    assert!(error > 0.1, "{error}");
    assert_eq!(aliased(&tiny([0.05; 2])), None);
}

/// For bins wider than the wall, whatever the radius of the cavity, the stated difference is that of bin averages.
#[test]
fn line_integrals_of_bins_wider_than_the_wall_are_aliased() {
    for (bins, pitch, radius) in [
        (8, 2.0, 1.75),
        (8, 2.0, 1.9),
        (8, 2.0, 2.05),
        (8, 2.0, 2.2),
        (8, 2.0, 2.48),
        (16, 1.0, 1.9),
        (16, 1.0, 2.05),
        (16, 1.0, 2.48),
        (32, 0.5, 2.48),
    ] {
        let mut scene = centres([pitch; 2]);
        (scene.camera.bins, scene.camera.rows) = (bins, bins);
        scene.acquisition.mode = Mode::Static { phase: 0.0 };
        scene.heart.inner.radius = radius;
        let stated = aliased(&scene).map(|[.., stated]| stated);
        let lines = Phantom::new(scene.clone()).unwrap().view(0, 0).unwrap();
        scene.camera.samples = Some(BinSample::Averages);
        scene.acquisition.accuracy = Accuracy::Tolerance(0.02);
        let averages = Phantom::new(scene).unwrap().view(0, 0).unwrap();
        let largest = averages.iter().fold(0.0f32, |most, v| most.max(*v));
        let off = (lines.iter().zip(&averages)).map(|(a, b)| (a - b).abs());
        let off = f64::from(off.fold(0.0, f32::max) / largest);
        assert!(
            stated.is_some_and(|stated| (stated - off).abs() < 0.02 && off > 0.2),
            "{pitch} {radius}: {stated:?} {off}"
        );
    }
}

#[test]
fn the_stated_effect_of_aliasing_is_correct() {
    let mut near = centres([0.64; 2]);
    near.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    near.camera.radius = Orbit::Circle(9.0);
    let mut far = near.clone();
    far.camera.radius = Orbit::Circle(14.0);
    // At 20 cm bins of 4 mm are narrower than half the response.
    let mut fine = near.clone();
    (fine.camera.radius, fine.camera.pitch) = (Orbit::Circle(20.0), [0.4; 2]);
    assert_eq!(aliased(&fine), None);
    let blurred = blurred([0.5, 0.7], 0.9);
    for (scene, tolerance) in [
        (near, 1e-3),
        (far, 1e-3),
        (blurred, 1e-3),
        (tiny([0.6; 2]), 1e-2),
    ] {
        let [_, _, stated] = aliased(&scene).unwrap();
        let exact = effect(&scene, tolerance);
        println!("stated {stated:e}, exact {exact:e}");
        // The reference averages are those of 3 x 3 sub-bins of at most 34 rays.
        assert!(
            (stated - exact).abs() < 0.02 * exact + tolerance,
            "{stated} {exact}"
        );
    }
}
