//! Polar maps and ejection fractions measured on ground truth of known shape.

use super::small;
use heart_phantom::membrane_newton::{Discretisation, Membrane, ReferenceShape};
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use heart_phantom::scene::BlurSettings;
use heart_phantom::{Breathing, Defect, Mode, Rotation, Scene, radon::ArcPolicy};
use heart_phantom::{Heart, Phantom, PhantomError, Uptake};
use std::f64::consts::{PI, TAU};

fn fine(mode: Mode) -> Scene {
    let mut scene = small(mode).with_size(96);
    scene.camera.pitch = [0.2; 2];
    scene.camera.views = 2;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene
}

#[test]
fn a_polar_map_has_the_activity_and_the_volume_of_the_heart() {
    let phantom = Phantom::new(fine(Mode::Static { phase: 0.5 })).unwrap();
    let map = phantom.polar_map(0, &phantom.truth(0).unwrap()).unwrap();
    let exact = phantom.shape(0.5).unwrap().volumes()[0];
    // Voxels of 2 mm between which the image is linear: the edge is at half of a wall five voxels thick.
    assert!(
        (map.cavity_ml.unwrap() / exact - 1.0).abs() < 0.03,
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
fn the_ejection_fraction_of_exact_gates_is_accurate() {
    let phantom = Phantom::new(fine(Mode::Gated { gates: 8 })).unwrap();
    let cavity = |gate| {
        let truth = phantom.truth(gate).unwrap();
        phantom.polar_map(gate, &truth).unwrap().cavity_ml.unwrap()
    };
    let volumes: Vec<f64> = (0..8).map(cavity).collect();
    let most = volumes.iter().copied().fold(0.0, f64::max);
    let least = volumes.iter().copied().fold(f64::INFINITY, f64::min);
    let found = (most - least) / most;
    let exact = phantom.numbers().unwrap().ejection_fraction;
    // Averages over an eighth of a sinusoid lose 2 %; volumes on voxels of 2 mm are accurate to 3 %, a twentieth of the fraction each.
    assert!((found / exact - 1.0).abs() < 0.12, "{found} {exact}");
}

/// The default curve is a sinusoid, whose mean over a gate has a closed form, also over whole beats during which the patient breathes and the
/// camera rotates.
#[test]
fn the_mean_volume_of_a_gate_is_that_of_a_sinusoid() {
    let mut turning = small(Mode::Gated { gates: 8 });
    (turning.blur, turning.breathing) =
        (Some(BlurSettings { fwhm: 1.0 }), Some(Breathing::default()));
    (turning.camera.rotation, turning.camera.seconds_per_view) = (Rotation::Continuous, 4.0);
    turning.cycle.beats_per_minute = 60.0;
    for scene in [small(Mode::Gated { gates: 8 }), turning] {
        let phantom = Phantom::new(scene).unwrap();
        let reports = phantom.phase_reports().unwrap();
        let ends: Vec<f64> = reports[8..].iter().map(|end| end.cavity_ml).collect();
        let least = ends.iter().copied().fold(f64::INFINITY, f64::min);
        let stroke = ends.iter().copied().fold(0.0, f64::max) - least;
        assert!(reports[8..].iter().all(|end| end.mean_cavity_ml.is_none()));
        for (gate, report) in reports[..8].iter().enumerate() {
            let sin = |k: usize| (TAU * k as f64 / 8.0).sin();
            let share = 0.5 - 8.0 * (sin(gate + 1) - sin(gate)) / (2.0 * TAU);
            let off = report.mean_cavity_ml.unwrap() - least - stroke * share;
            // rounding of volumes and of the times of beats
            assert!(off.abs() < 1e-9 * stroke, "{gate}: {off:e}");
        }
    }
}

/// Voxels, averaged over the time of a gate, and the exact volume of the cavity.
#[test]
fn the_blood_volume_of_the_truth_of_a_gate_is_accurate() {
    let mut scene = Scene::default()
        .with_size(32)
        .with_mode(Mode::Gated { gates: 8 });
    scene.activity.cavity = Uptake::Concentration(1.0);
    scene.activity.wall = Uptake::Concentration(0.0);
    let phantom = Phantom::new(scene).unwrap();
    let reports = phantom.phase_reports().unwrap();
    let voxel = phantom.camera().grid().voxel_volume();
    for (gate, report) in reports[..8].iter().enumerate() {
        let truth = phantom.truth(gate).unwrap();
        let found = voxel * truth.iter().map(|&v| f64::from(v)).sum::<f64>();
        let error = found / report.mean_cavity_ml.unwrap() - 1.0;
        assert!(error.abs() < 1e-3, "{gate}: {error:e}");
    }
}

#[test]
fn images_with_voxels_that_are_not_finite_are_rejected() {
    let phantom = Phantom::new(small(Mode::Static { phase: 0.5 })).unwrap();
    let truth = phantom.truth(0).unwrap();
    for bad in [f32::NAN, f32::INFINITY] {
        let mut image = truth.clone();
        image[7] = bad;
        let is_it = |error| {
            matches!(
                error,
                PhantomError::OutOfRange {
                    what: "a voxel",
                    ..
                }
            )
        };
        assert!(is_it(phantom.polar_map(0, &image).unwrap_err()));
        assert!(is_it(phantom.artefacts(0, &image, &truth).unwrap_err()));
    }
}

/// Rays without an edge have no cavity; one of negative samples has none either.
#[test]
fn images_without_a_wall_have_no_cavity() {
    let phantom = Phantom::new(small(Mode::Static { phase: 0.5 })).unwrap();
    let truth = phantom.truth(0).unwrap();
    for level in [-1.0, 0.0, 1.0] {
        let map = phantom.polar_map(0, &vec![level; truth.len()]).unwrap();
        let cavities = [map.cavity_ml, map.cavity_gradient_ml];
        assert_eq!(cavities, [None; 2], "{level}");
    }
    // A wall with negative samples in a part.
    let half = truth.len() / 2;
    let mixed: Vec<f32> = (truth.iter().enumerate())
        .map(|(k, v)| if k < half { *v } else { -1.0 - *v })
        .collect();
    let whole = phantom.polar_map(0, &truth).unwrap();
    let map = phantom.polar_map(0, &mixed).unwrap();
    assert!(map.cavity_ml.unwrap() < whole.cavity_ml.unwrap());
    assert!(map.cavity_gradient_ml.unwrap() < whole.cavity_gradient_ml.unwrap());
}

/// A spherical shell with radii 2.5 and 3.5 cm, blurred by a Gaussian of 0.45 cm (FWHM 10.6 mm): its value at the distance r from the centre,
/// by Simpson's rule over the spheres in it.
fn blurred_shell(r: f64) -> f64 {
    const SIGMA: f64 = 0.45;
    let bell = |x: f64| (-0.5 * (x / SIGMA).powi(2)).exp() / (SIGMA * (2.0 * PI).sqrt());
    let sphere = |s: f64| match r > 1e-6 {
        true => s / r * (bell(r - s) - bell(r + s)),
        false => 2.0 * (s / SIGMA).powi(2) * bell(s),
    };
    let node = |k: usize| sphere(SHELL[0] + (SHELL[1] - SHELL[0]) * k as f64 / 40.0);
    let weight = |k: usize| [2.0, 4.0][k % 2] - f64::from(k.is_multiple_of(40));
    (0..=40).map(|k| weight(k) * node(k)).sum::<f64>() * (SHELL[1] - SHELL[0]) / 120.0
}

const SHELL: [f64; 2] = [2.5, 3.5];

/// The edges of a blurred hemisphere. All rays have the same largest value, so that the edge at half maximum is a sphere; the steepest gradient
/// of oblique rays is found by brute force.
#[test]
fn the_edges_of_a_blurred_shell_agree_with_the_closed_form() {
    let half_circle = |radius: f64| {
        let points = (0..=200).map(|k| PI * (0.5 - f64::from(k) / 200.0));
        let points: Vec<_> = points
            .map(|t| [radius * t.cos(), radius * t.sin()])
            .collect();
        Membrane::new(ReferenceShape::polyline(&points).unwrap())
    };
    let membranes = SHELL.map(half_circle);
    let nodes = Discretisation::FiniteDifferences { nodes: 201 };
    let pose = Pose::axis_along_z(0.0).unwrap();
    let heart = Heart::of_membranes([&membranes[0], &membranes[1]], nodes, 0.0, pose).unwrap();
    let phantom = Phantom::with_heart(fine(Mode::Static { phase: 0.0 }), heart).unwrap();
    let table: Vec<f64> = (0..2000).map(|k| blurred_shell(k as f64 / 100.0)).collect();
    let sampled = |grid: &VoxelGrid, table: &[f64]| -> Vec<f32> {
        let [nx, ny, _] = grid.shape();
        let place = |k: usize| grid.centre(k % nx, k / nx % ny, k / (nx * ny));
        let value = |k: usize| table[(place(k).coords.norm() * 100.0).round() as usize] as f32;
        (0..grid.len()).map(value).collect()
    };
    let image = sampled(phantom.camera().grid(), &table);
    let map = phantom.polar_map(0, &image).unwrap();

    let fine_table: Vec<f64> = (0..6000)
        .map(|k| blurred_shell(k as f64 / 1000.0))
        .collect();
    let largest = fine_table.iter().copied().fold(0.0, f64::max);
    let half = fine_table.iter().position(|&v| v > 0.5 * largest).unwrap();
    let half = 2.0 / 3.0 * PI * (half as f64 / 1000.0).powi(3);
    // The steepest gradient along the ray from a point of the axis at an angle to it.
    let edge = |x: f64, cos: f64| -> f64 {
        let at = |t: f64| blurred_shell((x * x + 2.0 * x * t * cos + t * t).sqrt());
        let steps = (1..400).map(|k| f64::from(k) / 100.0);
        let rise = |t: &f64| at(t + 1e-3) - at(t - 1e-3);
        (steps.max_by(|a, b| rise(a).total_cmp(&rise(b)))).unwrap()
    };
    let apical = 2.0 / 3.0 * SHELL[0];
    let steepest: f64 = (0..20)
        .map(|k| {
            let u = (f64::from(k) + 0.5) / 20.0;
            let circle = PI * edge(apical * u, 0.0).powi(2) * apical / 20.0;
            circle + 2.0 / 3.0 * PI * edge(apical, u).powi(3) / 20.0
        })
        .sum();
    // The blur moves both inwards from 32.72 mL.
    let exact = 2.0 / 3.0 * PI * SHELL[0].powi(3);
    assert!(half < 0.97 * exact && steepest < exact, "{half} {steepest}");
    // Linear interpolation between voxels of 2 mm adds up to h^2 / 4 = 5 % to the variance of the blur, which moves the edge by 0.02 cm;
    // differences over a voxel add 2 %.
    let [by_half, by_gradient] = [
        map.cavity_ml.unwrap() / half,
        map.cavity_gradient_ml.unwrap() / steepest,
    ];
    assert!((by_half - 1.0).abs() < 0.015, "{by_half} {half}");
    assert!(
        (by_gradient - 1.0).abs() < 0.02,
        "{by_gradient} {steepest} {half}"
    );
    // Voxels about as large as the standard deviation of the blur.
    let mut scene = fine(Mode::Static { phase: 0.0 }).with_size(40);
    scene.camera.pitch = [0.457; 2];
    let coarse = Phantom::with_heart(scene, phantom.heart().clone()).unwrap();
    let image = sampled(coarse.camera().grid(), &table);
    let found = coarse.polar_map(0, &image).unwrap().cavity_gradient_ml;
    let defined = self::by_gradient(coarse.camera().grid(), &image);
    // Samples of a ray are 0.02 cm apart, and ten are half a voxel.
    assert!(
        (found.unwrap() / defined - 1.0).abs() < 0.004,
        "{found:?} {defined}"
    );
}

/// The volume within the steepest gradient, by its definition, of an image of a shell whose axis is z: the largest difference over a voxel, and the
/// vertex of the parabola through differences a voxel apart.
fn by_gradient(grid: &VoxelGrid, image: &[f32]) -> f64 {
    const SAMPLES: usize = 1001;
    let (apical, length) = (2.0 / 3.0 * SHELL[0], 1.3 * SHELL[1]);
    let half = (0.5 * grid.spacing()[0] / length * (SAMPLES - 1) as f64).round() as usize;
    let edge = |height: f64, polar: f64, turn: f64| {
        let from = Point3::new(0.0, 0.0, height);
        let across = [turn.cos(), turn.sin()].map(|x| x * polar.sin());
        let to = from + length * Vector3::new(across[0], across[1], polar.cos());
        let ray = grid.profile(image, [from, to], SAMPLES).unwrap();
        let ray = ray.values();
        let peak = (0..SAMPLES).max_by(|&a, &b| ray[a].total_cmp(&ray[b]));
        let rise = |k: usize| ray[k + half] - ray[k - half];
        let inside = half..=peak.unwrap().min(SAMPLES - 1 - half);
        let steepest = inside.max_by(|&a, &b| rise(a).total_cmp(&rise(b)));
        let (k, voxel) = (steepest.unwrap(), 2 * half);
        let vertex = match k >= voxel + half {
            true => {
                let [a, b, c] = [k - voxel, k, k + voxel].map(rise);
                (a - c) / (2.0 * (a - 2.0 * b + c)) * voxel as f64
            }
            // The ray begins too late.
            false => 0.0,
        };
        length * (k as f64 + vertex) / (SAMPLES - 1) as f64
    };
    // Nine of 72 azimuths: the voxels are symmetric about eight of them.
    let each = TAU / 9.0;
    let mut volume = 0.0;
    for turn in (0..9).map(|k| (f64::from(k) + 0.5) * TAU / 72.0) {
        for circle in 0..16 {
            let height = apical * (f64::from(circle) + 0.5) / 16.0;
            volume += each * edge(height, 0.5 * PI, turn).powi(2) / 2.0 * apical / 16.0;
        }
        for angle in 0..12 {
            let polar = |k: f64| 0.5 * PI * (f64::from(angle) + k) / 12.0;
            let band = polar(0.0).cos() - polar(1.0).cos();
            volume += each * edge(apical, polar(0.5), turn).powi(3) / 3.0 * band;
        }
    }
    volume
}
