//! Views along rays that are not parallel, against closed forms, parallel views, static hearts and finer sampling.

mod rejected;

use heart_phantom::revolve_voxel::nalgebra::{Matrix3, Point3, Rotation3, Vector3};
use heart_phantom::revolve_voxel::{Lines, ParallelDetector, Ray};
use heart_phantom::scene::*;
use heart_phantom::*;
use heart_phantom::{Phantom, PhantomError, RayGeometry, Uptake, WarningKind, no_observer};
use std::path::Path;

fn heart(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_size(24).with_mode(mode);
    scene.camera.views = 6;
    scene.output.write = vec![Product::Projections];
    scene
}

fn largest(samples: &[f32]) -> f64 {
    f64::from(samples.iter().copied().fold(0.0, f32::max))
}

fn off(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let off = a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs()));
    off.fold(0.0, f64::max) / largest(b)
}

fn views(phantom: &Phantom) -> Vec<f32> {
    phantom.sinograms(0, &no_observer).unwrap().samples
}

/// A detector with fewer bins and another pitch has the pixels of the scene, which contain the heart.
#[test]
fn pixels_do_not_depend_on_the_rays() {
    let parallel = Phantom::new(Scene::default().with_mode(Mode::Instants)).unwrap();
    let angles: Vec<f64> = (0..60).map(|k| (6.0 * f64::from(k)).to_radians()).collect();
    let detector = ParallelDetector::new(48, 48, [0.6; 2]).unwrap();
    let times: Vec<f64> = (0..60).map(|k| 0.005 * f64::from(k)).collect();
    let cone = RayGeometry::cone([60.0, 100.0], &angles, detector).unwrap();
    let phantom = parallel.along(cone.with_times(&times).unwrap()).unwrap();
    let size = |phantom: &Phantom| {
        let grid = phantom.camera().grid();
        (grid.shape()[..2].to_vec(), grid.spacing()[..2].to_vec())
    };
    assert_eq!(size(&phantom), size(&parallel));
    let found = phantom.warnings().unwrap();
    assert!(
        found.iter().all(|w| w.what != WarningKind::Unsuitable),
        "{found:?}"
    );
}

/// Numbers between -1 and 1.
pub(crate) fn random(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6364136223846793005)
        .wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A pinhole camera `K R (x - C)` with its parts.
struct Pinhole {
    matrix: [[f64; 4]; 3],
    source: Vector3<f64>,
    /// From (bin, row, 1) to the direction of a ray.
    ways: Matrix3<f64>,
}

fn pinhole(seed: &mut u64, bins: f64) -> Pinhole {
    let mut next = || random(seed);
    let turn = Rotation3::from_euler_angles(3.0 * next(), 3.0 * next(), 3.0 * next());
    let turn = turn.into_inner();
    // The optical axis passes the heart within some centimetres.
    let near = Vector3::new(next(), next(), next()) * 2.0;
    let source = near - turn.transpose() * Vector3::new(0.0, 0.0, 45.0 + 15.0 * next());
    let focal = bins * (2.5 + next());
    let middle = 0.5 * bins;
    let k = Matrix3::new(
        focal,
        0.3 * next(),
        middle + next(),
        0.0,
        1.1 * focal,
        middle - next(),
        0.0,
        0.0,
        1.0,
    );
    let (block, scale) = (k * turn, 0.01 + next().abs());
    let last = -(block * source);
    let matrix = [0, 1, 2]
        .map(|i| [block[(i, 0)], block[(i, 1)], block[(i, 2)], last[i]].map(|v| v * scale));
    let ways = turn.transpose() * k.try_inverse().unwrap();
    Pinhole {
        matrix,
        source,
        ways,
    }
}

/// Ellipsoids and an elliptic cylinder around a cold heart, with the closed form of each chord; the heart itself by its own lines.
#[test]
fn random_matrices_agree_with_closed_forms_of_organs() {
    let mut seed = 7;
    let cameras: Vec<Pinhole> = (0..12).map(|_| pinhole(&mut seed, 24.0)).collect();
    let matrices: Vec<_> = cameras.iter().map(|camera| camera.matrix).collect();
    let mut scene = heart(Mode::Static { phase: 0.3 });
    scene.activity.wall = Uptake::Concentration(0.0);
    let (centre, semi_axes) = ([13.0, 2.0, 1.0], [3.0, 5.0, 4.0]);
    let torso = ([-1.0, 0.5, 0.0], [20.0, 12.0, 16.0]);
    scene.organs = vec![
        OrganSettings {
            shape: OrganShapeSettings::Ellipsoid {
                centre: torso.0,
                semi_axes: torso.1,
            },
            activity: 0.25,
            attenuation: 0.0,
        },
        OrganSettings {
            shape: OrganShapeSettings::Ellipsoid { centre, semi_axes },
            activity: 1.0,
            attenuation: 0.0,
        },
    ];
    scene.attenuation = Some(Attenuation {
        coefficient: 0.0,
        medium: Medium::Heart,
    });
    let phantom = Phantom::new(scene).unwrap();
    let detector = ParallelDetector::new(24, 24, [0.3, 0.4]).unwrap();
    let rays = RayGeometry::from_matrices(&matrices, detector).unwrap();
    let body = phantom.shape(0.3).unwrap().body().clone();
    let lines: Vec<Lines> = (0..12).map(|k| rays.lines(k).unwrap()).collect();
    let seen = views(&phantom.along(rays).unwrap());
    let most = largest(&seen);
    for (k, sample) in seen.iter().enumerate() {
        let (view, row, bin) = (k / 576, k / 24 % 24, k % 24);
        let camera = &cameras[view];
        let d = (camera.ways * Vector3::new(bin as f64, row as f64, 1.0)).normalize();
        let chord = |middle: [f64; 3], axes: [f64; 3]| {
            let [p, v] = [camera.source - Vector3::from(middle), d]
                .map(|x| x.component_div(&Vector3::from(axes)));
            let (a, b, c) = (v.dot(&v), p.dot(&v), p.dot(&p) - 1.0);
            2.0 * (b * b - a * c).max(0.0).sqrt() / a
        };
        let ellipsoid = chord(centre, semi_axes);
        // The heart replaces the torso; the ellipsoid is beside it, within the torso.
        let own = body
            .chord(1, &Ray::new(Point3::from(camera.source), d).unwrap())
            .unwrap();
        let expected = 0.25 * (chord(torso.0, torso.1) - own) + 0.75 * ellipsoid;
        assert!(
            (f64::from(*sample) - expected).abs() < 1e-5 * most,
            "{view} {row} {bin}: {sample} {expected}"
        );
        let line = lines[view].ray(bin, row).unwrap();
        assert!(
            (line.direction() - d).norm() < 1e-10,
            "the ray points to the detector"
        );
    }
}

/// The cone beam as matrices of its definition, and turned with the heart.
#[test]
fn cone_beams_by_distances_and_by_matrices() {
    let angles: Vec<f64> = (0..5).map(|k| 0.3 + 1.1 * f64::from(k)).collect();
    let detector = ParallelDetector::new(21, 18, [1.1, 1.2]).unwrap();
    let cone = RayGeometry::cone([50.0, 80.0], &angles, detector).unwrap();
    let matrices: Vec<[[f64; 4]; 3]> = angles
        .iter()
        .map(|theta| {
            let (sin, cos) = theta.sin_cos();
            // w = distance from the source along the central ray; bin = 10 + 80 s / (1.1 w), row = 8.5 + 80 z / (1.2 w).
            let w = [-sin, cos, 0.0, 50.0];
            let row = |along: [f64; 4], pitch: f64, middle: f64| {
                [0, 1, 2, 3].map(|k| 80.0 / pitch * along[k] + middle * w[k])
            };
            [
                row([cos, sin, 0.0, 0.0], 1.1, 10.0),
                row([0.0, 0.0, 1.0, 0.0], 1.2, 8.5),
                w,
            ]
        })
        .collect();
    let matrices = RayGeometry::from_matrices(&matrices, detector).unwrap();
    let mut scene = heart(Mode::Static { phase: 0.7 });
    scene.chest = Some(Chest {
        trunk: 0.1,
        lungs: 0.03,
        liver: 0.3,
        spine: 0.05,
    });
    let phantom = Phantom::new(scene.clone()).unwrap();
    let seen = views(&phantom.along(cone.clone()).unwrap());
    assert!(off(&views(&phantom.along(matrices).unwrap()), &seen) < 1e-6);
    // The heart alone, turned by 0.4 about z with the camera.
    scene.chest = None;
    let seen = views(&Phantom::new(scene.clone()).unwrap().along(cone).unwrap());
    scene.pose.rotate_z += 0.4f64.to_degrees();
    let turned: Vec<f64> = angles.iter().map(|angle| angle + 0.4).collect();
    let turned = RayGeometry::cone([50.0, 80.0], &turned, detector).unwrap();
    assert!(
        off(
            &views(&Phantom::new(scene).unwrap().along(turned).unwrap()),
            &seen
        ) < 1e-5
    );
}

/// Parallel rays as lists of lines: the samples of the parallel camera, with defects, twist, chest and attenuation; and a fan and a cone from far away.
#[test]
fn parallel_views_as_lines() {
    let mut scene = heart(Mode::Static { phase: 0.4 });
    scene.defects = vec![Defect {
        layers: [0.0, 1.0],
        s: [0.2, 0.4],
        azimuths_degrees: [20.0, 90.0],
        activity: 0.1,
    }];
    for chest in [
        None,
        Some(Chest {
            trunk: 0.1,
            lungs: 0.03,
            liver: 0.3,
            spine: 0.05,
        }),
    ] {
        scene.chest = chest;
        let phantom = Phantom::new(scene.clone()).unwrap();
        let parallel = views(&phantom);
        let camera = phantom.camera();
        let lines = (camera.geometry().angles().iter()).map(|angle| {
            let rays = camera.detector().rays(*angle).unwrap();
            let [n_bins, n_rows] = rays.size();
            let every = (0..n_bins * n_rows).map(|k| rays.ray(k % n_bins, k / n_bins).unwrap());
            Lines::each(rays.size(), every.collect::<Vec<Ray>>()).unwrap()
        });
        let lists = RayGeometry::from_lines(lines.collect()).unwrap();
        assert!(off(&views(&phantom.along(lists).unwrap()), &parallel) < 2e-6);
        let angles = phantom.camera().geometry().angles().to_vec();
        let detector = *phantom.camera().detector();
        for make in [RayGeometry::fan, RayGeometry::cone] {
            let far = make([1e6, 1e6], &angles, detector).unwrap();
            let far = views(&phantom.along(far).unwrap());
            // Where an edge falls on the centre of a bin it may be on the other side.
            let n = far
                .iter()
                .zip(&parallel)
                .filter(|(a, b)| (*a - *b).abs() > 1e-3)
                .count();
            assert!(n <= far.len() / 200, "{n} of {}", far.len());
        }
    }
}

/// At given times a beating heart is bitwise identical to the static heart of these phases; equal phases share a shape.
#[test]
fn each_view_has_its_given_time() {
    let times = [0.0, 0.31, 1.7, 0.2, 60.0 / 65.0 + 0.2];
    let angles = [0.0, 0.5, 1.0, 4.0, 4.0];
    let detector = ParallelDetector::new(24, 20, [1.0; 2]).unwrap();
    let cone = RayGeometry::cone([60.0, 100.0], &angles, detector).unwrap();
    let mut scene = heart(Mode::Instants);
    scene.attenuation = Some(Attenuation {
        coefficient: 0.12,
        medium: Medium::Heart,
    });
    let phantom = Phantom::new(scene.clone()).unwrap();
    let moving = phantom
        .along(cone.clone().with_times(&times).unwrap())
        .unwrap();
    let seen = moving.sinograms(0, &no_observer).unwrap();
    assert_eq!(seen.distinct_shapes, 4);
    assert_eq!(seen.samples[3 * 480..4 * 480], seen.samples[4 * 480..]);
    assert_eq!(moving.view_times(0).unwrap()[2].start, 1.7);
    for (k, time) in times.iter().enumerate() {
        let still = scene.clone().with_mode(Mode::Static {
            phase: phantom.cycle().phase(*time),
        });
        let still = Phantom::new(still).unwrap().along(cone.clone()).unwrap();
        assert_eq!(
            still.view(0, k).unwrap(),
            seen.samples[k * 480..(k + 1) * 480]
        );
        assert_eq!(
            moving.view(0, k).unwrap(),
            seen.samples[k * 480..(k + 1) * 480]
        );
    }
}

/// Averages over the bins of a cone beam and over the time of a view, to the stated error, against many more lines and instants.
#[test]
fn averages_are_within_their_stated_errors() {
    let angles = [0.2, 1.9, 3.3];
    let detector =
        |fine: usize| ParallelDetector::new(20 * fine, 16 * fine, [1.4 / fine as f64; 2]).unwrap();
    let cone = |fine| RayGeometry::cone([60.0, 100.0], &angles, detector(fine)).unwrap();
    for (mode, tolerance) in [
        (Mode::Static { phase: 0.2 }, 0.05),
        (Mode::Static { phase: 0.6 }, 0.02),
    ] {
        let mut scene = heart(mode);
        scene.camera.samples = Some(BinSample::Averages);
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        let phantom = Phantom::new(scene.clone()).unwrap();
        let seen = phantom
            .along(cone(1))
            .unwrap()
            .sinograms(0, &no_observer)
            .unwrap();
        scene.camera.samples = None;
        let fine = views(&Phantom::new(scene).unwrap().along(cone(25)).unwrap());
        let mut brute = vec![0.0f64; seen.samples.len()];
        for (k, sample) in fine.iter().enumerate() {
            let (view, row, bin) = (k / (500 * 400), k / 500 % 400, k % 500);
            brute[(view * 16 + row / 25) * 20 + bin / 25] += f64::from(*sample) / 625.0;
        }
        let most = largest(&seen.samples);
        let error = seen
            .samples
            .iter()
            .zip(&brute)
            .map(|(a, b)| (f64::from(*a) - b).abs());
        let error = error.fold(0.0, f64::max) / most;
        let stated = seen.view_error.total();
        assert!(
            stated <= tolerance && error <= stated + 2e-4,
            "{error} {stated} {tolerance}"
        );
        assert!(error > 1e-5, "{error}");
    }
    let times = [0.05, 0.4, 0.7];
    let mut scene = heart(Mode::Exposure { seconds: 0.2 });
    scene.acquisition.accuracy = Accuracy::Tolerance(0.01);
    let phantom = Phantom::new(scene.clone()).unwrap();
    let seen = phantom.along(cone(1).with_times(&times).unwrap()).unwrap();
    let seen = seen.sinograms(0, &no_observer).unwrap();
    let mut brute = vec![0.0f64; seen.samples.len()];
    let phantom = Phantom::new(scene.with_mode(Mode::Instants)).unwrap();
    for k in 0..400 {
        let at = times.map(|time| time + 0.2 * (f64::from(k) + 0.5) / 400.0);
        let now = phantom.along(cone(1).with_times(&at).unwrap()).unwrap();
        for (sum, sample) in brute.iter_mut().zip(views(&now)) {
            *sum += f64::from(sample) / 400.0;
        }
    }
    let error = seen
        .samples
        .iter()
        .zip(&brute)
        .map(|(a, b)| (f64::from(*a) - b).abs());
    let error = error.fold(0.0, f64::max) / largest(&seen.samples);
    let stated = seen.view_error.total();
    assert!(stated <= 0.01 && error <= stated, "{error} {stated}");
}

/// The time steps for a tolerance are found with coarser views of the same rays.
#[test]
fn cone_beams_of_many_bins_meet_a_tolerance() {
    let detector = ParallelDetector::new(90, 80, [0.3; 2]).unwrap();
    let cone = RayGeometry::cone([60.0, 100.0], &[0.4], detector).unwrap();
    let mut scene = heart(Mode::WholeCycle);
    scene.acquisition.accuracy = Accuracy::Tolerance(0.1);
    let phantom = Phantom::new(scene).unwrap().along(cone).unwrap();
    let taken = phantom.sinograms(0, &no_observer).unwrap();
    assert_eq!(taken.samples.len(), 90 * 80);
    assert!(taken.view_error.total() < 0.1, "{:?}", taken.view_error);
}

/// Time steps are chosen from views of at most 64 bins and rows in the same field of view.
#[test]
fn time_steps_do_not_depend_on_the_number_of_bins() {
    let steps = |n: [usize; 2]| {
        let mut scene = heart(Mode::WholeCycle);
        scene.acquisition.accuracy = Accuracy::Tolerance(0.02);
        let pitch = [36.0 / n[0] as f64, 8.0 / n[1] as f64];
        let detector = ParallelDetector::new(n[0], n[1], pitch).unwrap();
        let rays = RayGeometry::cone([60.0, 100.0], &[0.3, 1.7], detector).unwrap();
        let phantom = Phantom::new(scene).unwrap().along(rays).unwrap();
        (phantom.steps().unwrap(), phantom.work().rays_cast)
    };
    let coarse = steps([64, 2]);
    assert!(coarse.0 > 8, "{coarse:?}");
    assert_eq!(steps([256, 2]), coarse);
    assert_eq!(steps([128, 2]), coarse);
    assert_eq!(steps([64, 256]), steps([64, 64]));
}
