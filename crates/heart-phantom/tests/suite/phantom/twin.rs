//! A scene in cm and its copy in mm, with ten times the numbers, are the same heart.

use super::defects::infarct;
use super::small;
use heart_phantom::scene::{BlurSettings, DiscretisationSettings, PixelRange};
use heart_phantom::{
    Accuracy, Attenuation, Background, Counts, Medium, Mode, Noise, Rotation, Scene,
};
use heart_phantom::{Orbit, Phantom, Uptake, VolumeCurve, VolumeRange, no_observer};

/// The same heart in tenths of the unit: lengths times 10, volumes times 1000, attenuation divided by 10. Concentrations are equal, totals
/// scale with the volume; a count corresponds to a tenth of the line integral.
fn twin(scene: &Scene) -> Scene {
    let mut twin = scene.clone();
    let times = |lengths: &mut [f64], factor: f64| lengths.iter_mut().for_each(|x| *x *= factor);
    for balloon in [&mut twin.heart.inner, &mut twin.heart.outer] {
        balloon.length *= 10.0;
        balloon.radius *= 10.0;
    }
    if let DiscretisationSettings::Spectral { tolerance, .. } = &mut twin.heart.discretisation {
        *tolerance *= 10.0;
    }
    if let VolumeRange::Volumes { edv, esv } = &mut twin.cycle.volume {
        *edv *= 1000.0;
        *esv *= 1000.0;
    }
    times(twin.pose.centre.as_mut_slice(), 10.0);
    times(&mut twin.pose.shift, 10.0);
    for uptake in [&mut twin.activity.cavity, &mut twin.activity.wall] {
        if let Uptake::Total(total) = uptake {
            *total *= 1000.0;
        }
    }
    if let Some(torso) = &mut twin.background {
        times(&mut torso.centre, 10.0);
        times(&mut torso.semi_axes, 10.0);
    }
    if let Some(attenuation) = &mut twin.attenuation {
        attenuation.coefficient /= 10.0;
        if let Medium::Torso { centre, semi_axes } = &mut attenuation.medium {
            times(centre, 10.0);
            times(semi_axes, 10.0);
        }
    }
    times(&mut twin.camera.pitch, 10.0);
    twin.camera.radius = match twin.camera.radius {
        Orbit::Circle(radius) => Orbit::Circle(10.0 * radius),
        other => panic!("{other:?}"),
    };
    if let Some(blur) = &mut twin.blur {
        blur.fwhm *= 10.0;
    }
    if let Some(Noise {
        counts: Counts::PerUnit(counts),
        ..
    }) = &mut twin.noise
    {
        *counts /= 10.0;
    }
    times(twin.reconstruction.pixel.as_mut_slice(), 10.0);
    twin
}

/// Largest difference of two arrays after scaling the second, relative to the largest value.
fn difference(a: &[f32], b: &[f32], scale: f64) -> f64 {
    let most = a
        .iter()
        .fold(0.0, |most: f64, v| most.max(f64::from(v.abs())));
    let pairs = a.iter().zip(b);
    let worst = pairs.map(|(a, b)| (f64::from(*a) - f64::from(*b) / scale).abs());
    worst.fold(0.0, f64::max) / most
}

fn agree(scene: &Scene) {
    let mut scene = scene.clone();
    scene.truth.tolerance = 1e-3; // the truths are compared
    let [a, b] = [scene.clone(), twin(&scene)].map(|scene| Phantom::new(scene).unwrap());
    let [small, large] = [&a, &b].map(|phantom| phantom.numbers().unwrap());
    for (small, large, scale) in [
        (small.edv, large.edv, 1e3),
        (small.esv, large.esv, 1e3),
        (small.wall_volume, large.wall_volume, 1e3),
        (small.ejection_fraction, large.ejection_fraction, 1.0),
        (small.gain, large.gain, 1.0),
        (
            small.diastolic_thickness.side,
            large.diastolic_thickness.side,
            10.0,
        ),
        (
            small.systolic_thickness.apex,
            large.systolic_thickness.apex,
            10.0,
        ),
    ] {
        assert!(
            (small * scale / large - 1.0).abs() < 1e-9,
            "{small} {large}"
        );
    }
    let [views, large] = [&a, &b].map(|phantom| phantom.sinograms(0, &no_observer).unwrap());
    let far = difference(&views.samples, &large.samples, 10.0);
    // f32, and shapes to Newton's tolerance; a grazing ray of a wall of radius R shifted by d changes by sqrt(8 R d).
    assert!(far < 1e-5, "views: {far}");
    assert_eq!(views.distinct_shapes, large.distinct_shapes);
    let [image, large] = [&a, &b].map(|phantom| phantom.volume(0).unwrap());
    let far = difference(&image, &large, 1.0);
    assert!(far < 1e-5, "reconstruction: {far}");
    let tolerance = 2.0 * scene.truth.tolerance;
    let [truth, truth_large] = [&a, &b].map(|phantom| phantom.truth(0).unwrap());
    let far = difference(&truth, &truth_large, 1.0);
    assert!(far < tolerance, "truth: {far}");
    let [labels, large_labels] = [&a, &b].map(|phantom| phantom.labels(0.4).unwrap());
    let differing = labels.iter().zip(&large_labels).filter(|(a, b)| a != b);
    assert_eq!(differing.count(), 0);
    let [found, large_found] = [
        a.artefacts(0, &image, &truth).unwrap(),
        b.artefacts(0, &large, &truth_large).unwrap(),
    ];
    for (found, large, scale) in [
        (found.streaks_outside, large_found.streaks_outside, 1.0),
        (found.wall_unevenness, large_found.wall_unevenness, 1.0),
        (found.wall_blur_mm, large_found.wall_blur_mm, 10.0),
        (found.apex_blur_mm, large_found.apex_blur_mm, 10.0),
    ] {
        let (found, large) = (found.unwrap(), large.unwrap());
        assert!(
            (found * scale - large).abs() < 1e-3 * large,
            "{found} {large}"
        );
    }
    let [meshes, large] = [&a, &b].map(|phantom| phantom.meshes(0.4).unwrap());
    for (mesh, large) in meshes.iter().zip(&large) {
        assert_eq!(mesh.vertices.len(), large.vertices.len());
        assert!((mesh.volume() * 1e3 / large.volume() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_scene_in_millimetres_gives_the_same_heart() {
    let mut scene = small(Mode::WholeCycle).with_size(64);
    scene.pose.shift = [0.1, -0.2, 0.3];
    agree(&scene);
}

#[test]
fn all_sections_scale_with_the_unit_of_length() {
    let mut scene = small(Mode::Gated { gates: 2 }).with_size(20);
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 12,
        per_piece: 1,
        tolerance: 1e-4,
    };
    scene.cycle.curve = VolumeCurve::Physiological;
    scene.cycle.volume = VolumeRange::Volumes {
        edv: 150.0,
        esv: 100.0,
    };
    scene.pose.centre = Some(5.0);
    scene.pose.shift = [0.5, -0.2, 0.3];
    scene.activity.cavity = Uptake::Total(20.0);
    scene.activity.wall = Uptake::Total(150.0);
    let (centre, semi_axes) = ([0.5, 0.0], [7.5, 7.0]);
    scene.background = Some(Background {
        concentration: 0.1,
        centre,
        semi_axes,
    });
    scene.attenuation = Some(Attenuation {
        coefficient: 0.1,
        medium: Medium::Torso { centre, semi_axes },
    });
    scene.defects = vec![infarct()];
    scene.blur = Some(BlurSettings { fwhm: 0.6 });
    scene.camera.views = 3;
    scene.camera.rotation = Rotation::Continuous;
    scene.camera.seconds_per_view = 2.0;
    scene.acquisition.accuracy = Accuracy::Tolerance(0.2); // equal steps of both, whatever their number
    scene.reconstruction.pixels = Some(18);
    scene.reconstruction.pixel = Some(0.85);
    scene.reconstruction.region = Some(PixelRange {
        x: [1, 17],
        y: [2, 18],
    });
    agree(&scene);
}

/// Counts change by at most one, and rarely, because the expected values differ in their last digits.
#[test]
fn counts_scale_with_the_unit_of_length() {
    let mut scene = small(Mode::Static { phase: 0.3 });
    for counts in [Counts::Total(1e6), Counts::PerUnit(40.0)] {
        scene.noise = Some(Noise { counts, seed: 3 });
        let [a, b] = [scene.clone(), twin(&scene)].map(|scene| {
            Phantom::new(scene)
                .unwrap()
                .sinograms(0, &no_observer)
                .unwrap()
                .samples
        });
        let differing = (a.iter().zip(&b)).filter(|(a, b)| (10.0 * *a - *b).abs() > 1e-5 * b.abs());
        assert!(differing.count() < a.len() / 1000);
    }
}
