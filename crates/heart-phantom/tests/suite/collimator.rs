//! Projections through a collimator against moments, a direct sum over depths, and symmetries.

use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::scene::{CollimatorSettings, HolesSettings};
use heart_phantom::{Accuracy, BinSample, radon::ArcPolicy};
use heart_phantom::{Attenuation, Counts, Medium, Mode, Noise, Orbit, Scene};
use heart_phantom::{Phantom, PhantomError, no_observer};
use radon::Collimator;
use std::f64::consts::LN_2;

const N: usize = 128;
const FIELD: f64 = 16.0;
const RADIUS: f64 = 12.0;

/// The heart in the reference configuration in four views, with an active wall.
fn scene() -> Scene {
    let mut scene = Scene::default()
        .with_size(N)
        .with_mode(Mode::Static { phase: 0.3 });
    scene.camera.views = 4;
    scene.camera.arc = 360.0;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.camera.radius = Orbit::Circle(RADIUS);
    scene.heart.discretisation =
        heart_phantom::scene::DiscretisationSettings::Differences { nodes: 201 };
    scene
}

fn through(response: Collimator, tolerance: f64) -> Phantom {
    let mut scene = scene();
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::Widths {
            slope: response.slope(),
            at_face: response.at_face(),
        },
        intrinsic_fwhm: response.intrinsic() * (8.0 * 2f64.ln()).sqrt(),
    });
    scene.camera.samples = Some(BinSample::Centres);
    scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
    Phantom::new(scene).unwrap()
}

fn response() -> Collimator {
    Collimator::new(0.02, 0.06, 0.16).unwrap()
}

/// Sum, mean bin and row in cm, and variance along both of a view.
fn moments(view: &[f32]) -> [f64; 5] {
    let n = view.len().isqrt();
    let at = |k: usize| (k as f64 - 0.5 * (n as f64 - 1.0)) * FIELD / n as f64;
    let mean = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        let each = view.iter().enumerate();
        each.map(|(k, v)| f64::from(*v) * of(at(k % n), at(k / n)))
            .sum()
    };
    let sum = mean(&|_, _| 1.0);
    let [s, z] = [mean(&|s, _| s) / sum, mean(&|_, z| z) / sum];
    let along = mean(&|x, _| (x - s).powi(2)) / sum;
    let across = mean(&|_, y| (y - z).powi(2)) / sum;
    [sum, s, z, along, across]
}

/// Sum, centroid and variances of a view against the closed forms of the wall: the variance of an image is that of the wall plus the mean of
/// the response's.
#[test]
fn moments_agree_with_those_of_the_wall_and_the_response() {
    let phantom = through(response(), 5e-5);
    let shape = phantom.shape(0.3).unwrap();
    let (wall, pose) = (
        shape.body().region_measures(1).unwrap(),
        shape.body().pose(),
    );
    let centre = pose.to_lab(&Point3::new(wall.centroid(), 0.0, 0.0));
    let axial = wall.second_moment / wall.volume - wall.centroid().powi(2);
    let radial = 0.5 * wall.polar_inertia / wall.volume;
    let variance = |e: &Vector3<f64>| radial + (axial - radial) * pose.axis().dot(e).powi(2);
    for view_idx in [1, 2] {
        let (sin, cos) = phantom.camera().geometry().angles()[view_idx].sin_cos();
        let [bins, ahead] = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0)];
        let depth = RADIUS - centre.coords.dot(&ahead);
        // The variance of the response is a quadratic function of depth.
        let blur = response().variance(depth) + response().slope().powi(2) * variance(&ahead);
        let image = moments(&phantom.view(0, view_idx).unwrap());
        let sum = image[0] * (FIELD / N as f64).powi(2) / wall.volume - 1.0;
        // Samples are f32, and the tolerance is 5e-5 of the largest one; errors cancel in sums.
        assert!(sum.abs() < 2e-6, "{sum}");
        for (own, exact) in [
            (image[1], centre.coords.dot(&bins)),
            (image[2], centre.z),
            (image[3], variance(&bins) + blur),
            (image[4], variance(&Vector3::z()) + blur),
        ] {
            assert!((own - exact).abs() < 1e-5, "{own} {exact}");
        }
    }
}

/// The stated error of views against their error, by a reference with a sixth of the smallest tolerance.
#[test]
fn views_converge_with_the_tolerance() {
    let all = |tolerance: f64| {
        through(response(), tolerance)
            .sinograms(0, &no_observer)
            .unwrap()
    };
    let finest = all(5e-5).samples;
    for tolerance in [3e-2, 3e-3, 3e-4] {
        let made = all(tolerance);
        let (mut off, mut largest) = (0.0f32, 0.0f32);
        for (a, b) in made.samples.iter().zip(&finest) {
            (off, largest) = (off.max((a - b).abs()), largest.max(*b));
        }
        let (stated, error) = (made.view_error.total(), f64::from(off / largest));
        println!("tolerance {tolerance}: error {error:e}, stated {stated:e}");
        assert!(
            error <= stated && stated <= tolerance,
            "{tolerance}: {stated} {error}"
        );
    }
    // Line integrals have no such error.
    let lines = Phantom::new(scene()).unwrap();
    assert_eq!(
        lines.sinograms(0, &no_observer).unwrap().view_error.bins,
        0.0
    );
}

#[test]
fn a_response_without_width_is_bitwise_identical_to_line_integrals() {
    let lines = Phantom::new(scene()).unwrap();
    let none = through(Collimator::default(), 1e-4);
    assert!(lines.view(0, 3).unwrap() == none.view(0, 3).unwrap());
    assert_eq!(lines.work(), none.work());
}

#[test]
fn zero_attenuation_is_bitwise_identical_to_none() {
    for medium in [
        Medium::Heart,
        Medium::Torso {
            centre: [0.0; 2],
            semi_axes: [9.0, 8.0],
        },
    ] {
        let mut none = scene();
        none.attenuation = Some(Attenuation {
            coefficient: 0.0,
            medium,
        });
        let [lines, none] = [scene(), none].map(|scene| Phantom::new(scene).unwrap());
        assert!(lines.view(0, 1).unwrap() == none.view(0, 1).unwrap());
        assert_eq!(lines.work(), none.work());
    }
}

#[test]
fn parts_are_bitwise_identical_to_the_whole() {
    let mut scene = scene().with_size(48);
    scene.acquisition.mode = Mode::WholeCycle;
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    let phantom = Phantom::new(scene.clone()).unwrap();
    let whole = phantom.sinograms(0, &no_observer).unwrap().samples;
    assert!(phantom.view(0, 2).unwrap() == whole[2 * 48 * 48..3 * 48 * 48]);
    let volume = phantom.volume(0).unwrap();
    assert!(phantom.slice(0, 20).unwrap() == volume[20 * 48 * 48..21 * 48 * 48]);
    // Little memory: points come in batches, slabs for few views at a time.
    let one = phantom.heart().shape_bytes();
    let small = Phantom::new(scene).unwrap().with_memory(2 * one);
    assert!(small.sinograms(0, &no_observer).unwrap().samples == whole);
}

#[test]
fn an_invalid_collimator_is_rejected() {
    let refused = |text: &str| match Scene::from_toml(text) {
        Err(PhantomError::Scene(error)) => error.first().field.clone(),
        other => panic!("{text}: {other:?}"),
    };
    for (holes, more, field) in [
        (
            "{ parallel = { diameter = 0.0, length = 3.5, attenuation = 26.9 } }",
            "",
            "collimator.holes.parallel.diameter",
        ),
        // Two mean free paths exceed the length of the holes.
        (
            "{ parallel = { diameter = 0.1, length = 0.05, attenuation = 26.9 } }",
            "",
            "collimator.holes",
        ),
        (
            "{ widths = { slope = -0.1, at_face = 0.0 } }",
            "",
            "collimator.holes.widths.slope",
        ),
        ("'ge-lehr'", "tolerance = 1.0\n", "collimator.tolerance"),
        ("'ge-lehr'", "[blur]\nfwhm = 1.0\n", "blur"),
    ] {
        let text = format!("[collimator]\nholes = {holes}\nintrinsic_fwhm = 0.4\n{more}");
        assert_eq!(refused(&text), field);
    }
    // The heart would intersect the collimator.
    let mut near = scene();
    near.camera.radius = Orbit::Circle(4.0);
    let collimator = CollimatorSettings {
        holes: HolesSettings::SiemensLehr,
        intrinsic_fwhm: 0.4,
    };
    near.collimator = Some(collimator);
    // Detected before any view.
    let error = Phantom::new(near.clone()).unwrap().prepare().unwrap_err();
    assert!(
        matches!(&error, PhantomError::Rejected { field, .. } if field == "camera.radius"),
        "{error:?}"
    );
    let error = Phantom::new(near).unwrap().view(0, 0).unwrap_err();
    assert!(
        matches!(error, PhantomError::DetectorInside { radius: 4.0, needed, .. } if needed > 4.0),
        "{error:?}"
    );
    // At the far side of hearts with radii of 10 and 29 m the response is hundreds of times wider than at the near side.
    for (radius, least) in [(1000.0, 100.0), (2900.0, 300.0)] {
        let mut large = scene();
        large.heart.outer.radius = radius;
        large.camera.radius = Orbit::Contour { gap: 1.0 };
        large.collimator = Some(collimator);
        let error = Phantom::new(large).unwrap().prepare().unwrap_err();
        let PhantomError::Rejected { field, source, .. } = &error else {
            panic!("{error:?}");
        };
        assert_eq!(field, "collimator");
        assert!(
            matches!(**source, PhantomError::OutOfRange { given, most: 100.0, .. } if given > least),
            "{source:?}"
        );
        assert!(
            source.to_string().ends_with("between 1 and 100"),
            "{source}"
        );
    }
    // 1.5 mm holes of 35 mm at 10 cm, with a crystal of 3.8 mm: (0.15 (3.4257 + 10) / 3.4257)^2 + 0.38^2.
    let camera = Collimator::parallel_holes(&radon::ParallelHoles::GE_LEHR, 0.38).unwrap();
    let fwhm = camera.sigma(10.0) * (8.0 * LN_2).sqrt();
    assert!(
        (fwhm - (0.15f64 * 13.4257 / 3.4257).hypot(0.38)).abs() < 1e-4,
        "{fwhm}"
    );
}

/// The response of holes by its name in a scene: 0.4247, 0.3727 and 0.3536 diameters at the face.
#[test]
fn the_response_of_holes_has_a_name() {
    for (response, widths) in [
        ("", 0.424_66),
        (", response = \"anger\"", 0.424_66),
        (", response = \"hexagonal\"", 0.372_68),
        (", response = \"round\"", 0.353_55),
    ] {
        let holes = format!("diameter = 0.2, length = 3.0, attenuation = 26.9{response}");
        let text =
            format!("[collimator]\nholes = {{ parallel = {{ {holes} }} }}\nintrinsic_fwhm = 0.4\n");
        let settings = Scene::from_toml(&text).unwrap().collimator.unwrap();
        assert!((settings.response().unwrap().at_face() / 0.2 - widths).abs() < 1e-5);
    }
    let text = "[collimator]\nholes = \"ge-ventri-lehr\"\nintrinsic_fwhm = 0.4\n";
    let ventri = Scene::from_toml(text).unwrap().collimator.unwrap();
    // Holes of 1.4 mm and 30 mm: FWHM at 10 cm without the crystal.
    let length: f64 = 3.0 - 2.0 / 26.9;
    let fwhm: f64 = 0.14 * (length + 10.0) / length;
    let expected = fwhm.hypot(0.4) / (8.0 * LN_2).sqrt();
    assert!((ventri.response().unwrap().sigma(10.0) - expected).abs() < 1e-12);
}

/// The wall is outer minus inner membrane. After attenuation, division into slabs and blur, rounding left -1e-26 where the activity is
/// zero, which the noise rejected.
#[test]
fn no_sample_is_negative_and_noise_accepts_all_samples() {
    let mut scene = scene().with_size(64);
    (scene.camera.views, scene.camera.radius) = (16, Orbit::Circle(25.0));
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [1.0, 0.0],
            semi_axes: [14.0, 10.0],
        },
    });
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    let views = |scene: &Scene| {
        let phantom = Phantom::new(scene.clone()).unwrap();
        phantom.sinograms(0, &no_observer).unwrap().samples
    };
    let least = views(&scene).into_iter().fold(f32::INFINITY, f32::min);
    assert!(least >= 0.0, "{least}");
    scene.noise = Some(Noise {
        counts: Counts::PerUnit(100.0),
        seed: 1,
    });
    assert!(views(&scene).iter().any(|count| *count > 0.0));
}
