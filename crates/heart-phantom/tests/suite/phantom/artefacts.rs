//! Figures of artefacts for volumes with known values.

use super::small;
use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::scene::{BlurSettings, DiscretisationSettings};
use heart_phantom::{Artefacts, ImageQuality, Phantom, PhantomError, no_observer};
use heart_phantom::{Background, BinSample, Counts, Mode, Noise, Scene};

fn of_reconstruction(scene: Scene) -> Artefacts {
    let phantom = Phantom::new(scene).unwrap();
    let volume = phantom.volume(0).unwrap();
    let truth = phantom.truth(0).unwrap();
    phantom.artefacts(0, &volume, &truth).unwrap()
}

/// An edge blurred by a Gaussian falls from 90 to 10 % within 2 * 1.28155 standard deviations, here between the middle of a thick wall and
/// its surroundings.
#[test]
fn the_blur_of_the_wall_equals_that_of_the_detector() {
    let blurred = |fwhm: f64| {
        let mut scene = small(Mode::Static { phase: 0.0 }).with_size(64);
        scene.camera.views = 120;
        scene.camera.pitch = [0.2; 2];
        (scene.heart.inner.radius, scene.heart.inner.length) = (1.0, 6.0);
        (scene.heart.outer.radius, scene.heart.outer.length) = (5.0, 6.0);
        scene.blur = Some(BlurSettings { fwhm });
        scene.camera.samples = Some(BinSample::Centres);
        of_reconstruction(scene)
    };
    let widths = |a: &Artefacts| [a.wall_blur_mm.unwrap(), a.apex_blur_mm.unwrap()];
    let sharp = widths(&blurred(0.0));
    for fwhm in [0.8, 1.2] {
        let gaussian = 10.0 * 2.0 * 1.281_551_6 * fwhm / (8.0 * 2.0f64.ln()).sqrt();
        for (found, sharp) in widths(&blurred(fwhm)).into_iter().zip(sharp) {
            // The widths of voxels and filter add in squares if they are Gaussian; the wall is curved.
            let expected = gaussian.hypot(sharp);
            assert!(
                (found / expected - 1.0).abs() < 0.03,
                "{found} {expected} {sharp}"
            );
        }
    }
}

/// Active organs are no streaks.
#[test]
fn the_ground_truth_of_a_chest_has_no_streaks() {
    let mut scene = small(Mode::Static { phase: 0.25 });
    scene.background = Some(Background {
        concentration: 0.3,
        centre: [0.0; 2],
        semi_axes: [14.0, 12.0],
    });
    let phantom = Phantom::new(scene).unwrap();
    let truth = phantom.truth(0).unwrap();
    let found = phantom.artefacts(0, &truth, &truth).unwrap();
    assert_eq!(found.streaks_outside, Some(0.0));
}

#[test]
fn ground_truth_is_uniform_and_added_artefacts_are_measured() {
    let phantom = Phantom::new(small(Mode::Static { phase: 0.25 }).with_size(64)).unwrap();
    let truth = phantom.truth(0).unwrap();
    let measured = |change: &dyn Fn(f32) -> f32| {
        let volume: Vec<f32> = truth.iter().map(|&v| change(v)).collect();
        phantom.artefacts(0, &volume, &truth).unwrap()
    };
    // Voxels two inside the wall contain only wall; those three outside are zero. Sums are f32.
    let near = |found: Option<f64>, expected: f64| {
        assert!(
            (found.unwrap() - expected).abs() < 1e-6,
            "{found:?} {expected}"
        );
    };
    let same = measured(&|v| v);
    near(same.streaks_outside, 0.0);
    near(same.wall_unevenness, 0.0);
    // The average of the wall is below its activity: voxels at its surfaces contain only a part of it.
    let of_wall = same.wall_mean_truth.unwrap();
    assert!((0.8..0.98).contains(&of_wall), "{of_wall}");
    near(same.wall_mean, of_wall);
    assert_eq!(same.wall_erosion, 2);
    near(same.rmse, 0.0);
    let raised = measured(&|v| v + 0.125);
    near(raised.streaks_outside, 0.125);
    near(raised.wall_mean, of_wall + 0.125);
    near(raised.wall_unevenness, 0.0);
    near(raised.rmse, 0.125);
    let doubled = measured(&|v| 2.0 * v);
    near(doubled.wall_mean, 2.0 * of_wall);
    assert_eq!(doubled.wall_blur_mm, same.wall_blur_mm);
    assert_eq!(doubled.apex_blur_mm, same.apex_blur_mm);
}

#[test]
fn motion_blurs_and_gating_reduces_blur() {
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
    // Projections of different hearts are inconsistent: streaks.
    assert!(
        short.streaks_outside.unwrap() > 2.0 * still.streaks_outside.unwrap(),
        "{short:?} {still:?}"
    );
}

/// The heart in the reference configuration, `bins` bins of half a centimetre.
fn resting(bins: usize) -> Scene {
    let mut scene = Scene::default().with_mode(Mode::Static { phase: 0.0 });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    (scene.camera.views, scene.camera.bins, scene.camera.rows) = (60, bins, bins);
    scene.camera.pitch = [0.5; 2];
    scene
}

/// A truncated view includes the blur from beyond its edges: it equals the middle of a complete view.
#[test]
fn blur_includes_activity_beyond_the_edges() {
    for fwhm in [1.0, 2.0] {
        let taken = |bins: usize, rows: usize| {
            let mut scene = resting(bins);
            (scene.camera.views, scene.camera.rows) = (3, rows);
            scene.blur = Some(BlurSettings { fwhm });
            let phantom = Phantom::new(scene).unwrap();
            let views = phantom.sinograms(0, &no_observer).unwrap().samples;
            (phantom, views)
        };
        let ((_, all), (part, views)) = (taken(64, 64), taken(16, 12));
        let most = views.iter().copied().fold(0.0f32, f32::max);
        for view in 0..3 {
            for (row, bin) in (0..12).flat_map(|row| (0..16).map(move |bin| (row, bin))) {
                let here = views[(view * 12 + row) * 16 + bin];
                let there = all[(view * 64 + row + 26) * 64 + bin + 24];
                // Sums of the same numbers, up to rounding of single precision.
                assert!((here - there).abs() <= 1e-6 * most, "{here} {there}");
            }
        }
        // A single slice is bitwise identical to that of the volume.
        let (volume, slice) = (part.volume(0).unwrap(), part.slice(0, 1).unwrap());
        assert!(volume[256..512] == slice[..]);
    }
}

#[test]
fn an_edge_is_measured_above_its_background_within_the_field_of_view() {
    let found = |bins: usize, background: f64| {
        let mut scene = resting(bins);
        if background > 0.0 {
            scene.background = Some(Background {
                concentration: background,
                centre: [0.0; 2],
                semi_axes: [7.7; 2],
            });
        }
        of_reconstruction(scene)
    };
    let alone = found(32, 0.0);
    for background in [0.1, 0.3] {
        let within = found(32, background);
        for (a, b) in [
            (within.wall_blur_mm, alone.wall_blur_mm),
            (within.apex_blur_mm, alone.apex_blur_mm),
        ] {
            // Streaks of 60 views; the edge of the background is at least 30 mm away.
            assert!((a.unwrap() / b.unwrap() - 1.0).abs() < 0.25, "{a:?} {b:?}");
        }
    }
    // The apex is 5.9 cm from the axis of rotation; views of 16 bins end at 4 cm, less one bin at 3.5 cm.
    assert_eq!(found(16, 0.0).apex_blur_mm, None);
    // Pixels so small that a line through the heart would have billions of points.
    let mut scene = resting(16);
    scene.reconstruction.pixel = Some(1e-6);
    assert_eq!(of_reconstruction(scene).apex_blur_mm, None);
}

/// A given total of counts projects the views once, not separately for the sum and the counts.
#[test]
fn views_with_a_given_total_of_counts_are_projected_once() {
    let mut scene = resting(16);
    scene.noise = Some(Noise {
        counts: Counts::Total(1e5),
        seed: 1,
    });
    let phantom = Phantom::new(scene).unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap().samples;
    let work = phantom.work();
    assert_eq!(work.rays_cast + work.rays_skipped, 60 * 16 * 16);
    assert!(phantom.view(0, 7).unwrap()[..] == views[7 * 256..8 * 256]);
}

#[test]
fn figures_of_other_voxels_and_of_values_that_are_not_finite_are_rejected() {
    let scene = small(Mode::Static { phase: 0.0 }).with_size(16);
    let phantom = Phantom::new(scene.clone()).unwrap();
    let regions = phantom.regions().unwrap();
    let volume = phantom.truth(0).unwrap();
    let mut wrong = volume.clone();
    wrong[7] = f32::NAN;
    for [volume, truth] in [[&volume, &wrong], [&wrong, &volume]] {
        for rejected in [
            phantom.artefacts(0, volume, truth).map(drop),
            phantom.compensated_artefacts(0, volume, truth).map(drop),
            ImageQuality::of(volume, Some(truth), regions).map(drop),
        ] {
            assert!(
                matches!(rejected, Err(PhantomError::OutOfRange { .. })),
                "{rejected:?}"
            );
        }
    }
    // Another number of voxels.
    let other = Phantom::new(scene.with_size(15)).unwrap();
    let rejected = ImageQuality::of(&volume, None, other.regions().unwrap());
    assert!(
        matches!(rejected, Err(PhantomError::WrongLength { .. })),
        "{rejected:?}"
    );
    assert!(ImageQuality::of(&volume, Some(&volume), regions).is_ok());
}

/// The line through the apex ends at the circle that all views contain, and begins within it and within the voxels.
#[test]
fn voxels_beyond_the_field_of_view_have_no_effect_on_the_blur() {
    // Middle of the wall at the apex.
    let probe = Phantom::new(resting(16)).unwrap();
    let shape = probe.shape(0.0).unwrap();
    let solution = shape.solution();
    let [inner, outer] = [&solution.inner, &solution.outer].map(|own| own.at(0.5).position[0]);
    let apex = Point3::new(0.5 * (inner + outer), 0.0, 0.0);
    let apex = shape.body().pose().to_lab(&apex);
    let blur = |to: [f64; 3], bright: f32| {
        let mut scene = resting(16);
        scene.pose.shift = [0, 1, 2].map(|a| to[a] - apex[a]);
        let phantom = Phantom::new(scene).unwrap();
        let truth = phantom.truth(0).unwrap();
        let mut volume = truth.clone();
        for (k, voxel) in volume.iter_mut().enumerate() {
            let [x, y] = [k % 16, k / 16 % 16].map(|i| 0.5 * (i as f64 - 7.5));
            // Voxels of 5 mm that no point of the circle with radius 3.5 cm is interpolated from.
            if x.hypot(y) > 3.5 + 0.5 * 2f64.sqrt() {
                *voxel = bright;
            }
        }
        (phantom.artefacts(0, &volume, &truth).unwrap()).apex_blur_mm
    };
    let inside = blur([0.0; 3], 0.0);
    assert!(inside.is_some());
    assert_eq!(blur([0.0; 3], 9.0), inside);
    // Outside the circle, in a corner of the voxels; below the lowest voxels, towards which the apex points.
    assert_eq!(blur([-2.7, 2.7, 0.0], 0.0), None);
    assert_eq!(blur([0.0, 0.0, -4.1], 0.0), None);
    assert!(blur([0.0, 0.0, -3.9], 0.0).is_some());
}
