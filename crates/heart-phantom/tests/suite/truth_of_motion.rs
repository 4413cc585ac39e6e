//! Twist, displacement of the base and motion fields, from scenes to files.

use crate::phantom::{infarct, small};
use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::scene::*;
use heart_phantom::*;

fn twist() -> Twist {
    Twist {
        inner_degrees: vec![-3.0, 10.0],
        outer_degrees: vec![-3.0, 8.0],
    }
}

/// A coarse heart of polynomials, whose material is exact.
fn smooth(mode: Mode) -> Scene {
    let mut scene = small(mode).with_size(24);
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 14,
        per_piece: 1,
        tolerance: 1e-4,
    };
    scene
}

/// All motions together.
fn lively() -> Scene {
    let mut scene = smooth(Mode::Gated { gates: 4 });
    scene.twist = Some(twist());
    scene.cycle.av_plane_displacement = 1.6;
    scene.camera.seconds_per_view = 4.0;
    scene.breathing = Some(Breathing {
        shift: [0.1, 0.3, -1.5],
        rotation_degrees: [4.0, 0.0, -3.0],
        gates: Some(RespiratoryGates::Amplitude(2)),
        ..Breathing::default()
    });
    scene
}

#[test]
fn a_twist_leaves_a_wall_without_defects_bitwise_identical() {
    let plain = small(Mode::Gated { gates: 2 }).with_size(20);
    let mut twisted = plain.clone();
    twisted.twist = Some(twist());
    let [plain, twisted] = [plain.clone(), twisted].map(|scene| Phantom::new(scene).unwrap());
    let views = |phantom: &Phantom| phantom.sinograms(1, &no_observer).unwrap().samples;
    assert!(views(&plain) == views(&twisted));
    assert!(plain.truth(1).unwrap() == twisted.truth(1).unwrap());
    assert!(plain.labels(0.2).unwrap() == twisted.labels(0.2).unwrap());
    // Neither does a zero twist of a wall with defects.
    let mut still = small(Mode::Static { phase: 0.1 }).with_size(20);
    still.defects.push(infarct());
    let mut none = still.clone();
    none.twist = Some(Twist {
        inner_degrees: vec![0.0; 2],
        outer_degrees: vec![0.0; 2],
    });
    let [still, none] = [still, none].map(|scene| Phantom::new(scene).unwrap());
    assert!(still.view(0, 3).unwrap() == none.view(0, 3).unwrap());
    assert!(still.truth(0).unwrap() == none.truth(0).unwrap());
}

#[test]
fn defects_twist_with_the_material_and_preserve_their_volume() {
    let mut scene = smooth(Mode::Static { phase: 0.0 }).with_size(32);
    scene.twist = Some(twist());
    scene.truth.tolerance = 1e-4;
    scene.defects.push(Defect {
        layers: [0.0, 1.0],
        s: [0.15, 0.45],
        azimuths_degrees: [-40.0, 50.0],
        activity: 0.0,
    });
    let phantom = Phantom::new(scene.clone()).unwrap();
    let region = phantom.scene().defects[0];
    let wall = phantom.wall(0.0).unwrap();
    let grid = *phantom.camera().grid();
    // Labels of the wall's voxels: those of the defect have material in it, except near its boundaries.
    let labels = phantom.labels(0.0).unwrap();
    let (mut inside, mut moved) = (0, 0);
    let untwisted = {
        let mut scene = scene.clone();
        scene.twist = None;
        Phantom::new(scene).unwrap().labels(0.0).unwrap()
    };
    for k in 0..grid.len() {
        let p = grid.centre(k % 32, k / 32 % 32, k / 1024);
        let Some(point) = wall.locate(&p) else {
            continue;
        };
        let MaterialPoint { s, azimuth, layer } = point;
        let [from, to] = region.azimuths_degrees.map(f64::to_radians);
        let held = s > region.s[0] && s < region.s[1] && azimuth > from && azimuth < to;
        // Half a voxel from every boundary, along the azimuth with a radius of up to 4 cm, along s with a length of about 10 cm.
        let near = (azimuth - from).abs().min((azimuth - to).abs()) < 0.25
            || (s - region.s[0]).abs().min((s - region.s[1]).abs()) < 0.025
            || !(0.2..0.8).contains(&layer)
            || s > 0.44;
        if !near {
            assert_eq!(labels[k] == 3, held, "{point:?}");
            inside += usize::from(held);
        }
        moved += usize::from(labels[k] != untwisted[k]);
    }
    assert!(inside > 30, "{inside}");
    assert!(moved > 10, "{moved}");
    // Exact chords: the difference of projections is the volume of the defect, for any twist; voxels agree.
    let total = |phantom: &Phantom| -> [f64; 2] {
        let area = 0.5f64.powi(2);
        let views = phantom.view(0, 0).unwrap();
        let truth = phantom.truth(0).unwrap();
        let sum = |of: &[f32]| of.iter().map(|x| f64::from(*x)).sum::<f64>();
        [sum(&views) * area, sum(&truth) * grid.voxel_volume()]
    };
    let [_, twisted] = total(&phantom);
    let plain = phantom.heart().pair().wall_volume();
    let opening = (region.azimuths_degrees[1] - region.azimuths_degrees[0]) / 360.0;
    let ring = phantom
        .wall(0.0)
        .unwrap()
        .region([0.0, 1.0], region.s, 1e-5)
        .unwrap();
    let expected = plain - opening * ring.mass_properties().volume;
    assert!(
        (twisted - expected).abs() < 2e-3 * plain,
        "{twisted} {expected}"
    );
}

#[test]
fn the_base_is_displaced_the_apex_is_fixed_and_the_wall_volume_is_constant() {
    let mut scene = smooth(Mode::Static { phase: 0.0 });
    scene.cycle.av_plane_displacement = 1.6;
    let phantom = Phantom::new(scene.clone()).unwrap();
    for phase in [0.0, 0.1, 0.25, 0.4, 0.5] {
        let shape = phantom.shape(phase).unwrap();
        assert!(
            shape.solution().wall_volume_error.abs() < 1e-12,
            "{}",
            shape.solution().wall_volume_error
        );
        let height = shape.gain() / 0.6;
        let ring = shape.solution().inner.at(0.0).position[0];
        assert!((ring - 1.6 * (1.0 - height)).abs() < 1e-12, "{ring}");
        let apex = shape.solution().outer.at(0.5).position[0];
        let rests = phantom
            .shape(0.5)
            .unwrap()
            .solution()
            .outer
            .at(0.5)
            .position[0];
        assert!((apex - rests).abs() < 1e-9, "{apex} {rests}");
        let expected = phantom.shape(0.0).unwrap().volumes()[0] * (1.0 + shape.gain());
        assert!((shape.volumes()[0] / expected - 1.0).abs() < 1e-12);
    }
    let numbers = phantom.numbers().unwrap();
    println!("{numbers:?}");
    assert!((numbers.ejection_fraction - 0.375).abs() < 1e-10);
    assert_eq!(numbers.av_plane_displacement, 1.6);
    assert!(numbers.longitudinal_shortening > 0.1 && numbers.longitudinal_shortening < 0.2);
    assert!(numbers.av_plane_fraction > 0.5);
    // A zero displacement is bitwise identical to none.
    scene.cycle.av_plane_displacement = 0.0;
    let still = Phantom::new(scene.clone()).unwrap();
    let plain = small(Mode::Static { phase: 0.2 });
    let descent = plain.clone();
    assert_eq!(descent.cycle.av_plane_displacement, 0.0);
    assert_eq!(still.numbers().unwrap().av_plane_displacement, 0.0);
    let heart = still
        .heart()
        .clone()
        .with_av_plane_displacement(0.0, [0.0, 0.6])
        .unwrap();
    let shapes = heart.shapes(&[0.2]).unwrap();
    assert_eq!(
        shapes[0].curves(),
        still.heart().shapes(&[0.2]).unwrap()[0].curves()
    );
}

#[test]
fn with_all_motions_volumes_are_exact_and_inverse_motions_cancel() {
    let phantom = Phantom::new(lively()).unwrap();
    let moments = [
        phantom.reference(),
        MotionPhase {
            phase: 0.0,
            breath: 1.0,
            ..MotionPhase::default()
        },
        MotionPhase {
            phase: 0.13,
            breath: 0.4,
            ..MotionPhase::default()
        },
        MotionPhase {
            phase: 0.7,
            breath: 0.9,
            ..MotionPhase::default()
        },
    ];
    let walls = moments.map(|at| phantom.wall(at).unwrap());
    for k in 0..200 {
        let share = |a: f64| (f64::from(k) * a).fract();
        let point = MaterialPoint {
            layer: share(0.618),
            s: 0.5 * share(0.414),
            azimuth: 6.0 * share(0.732) - 3.0,
        };
        for pair in [[0, 1], [1, 2], [2, 3], [3, 0]] {
            let [from, to] = pair.map(|k| &walls[k]);
            let volume = from.deformation(to, &point).unwrap().gradient.determinant();
            assert!((volume - 1.0).abs() < 1e-12, "{point:?} {}", volume - 1.0);
            let p = from.position(&point).unwrap();
            let there = to.position(&from.locate(&p).unwrap()).unwrap();
            let back = from.position(&to.locate(&there).unwrap()).unwrap();
            assert!((back - p).norm() < 1e-10, "{point:?} {p} {back}");
        }
    }
}

#[test]
fn fields_equal_those_of_their_points() {
    let phantom = Phantom::new(lively()).unwrap();
    let to = MotionPhase {
        phase: 0.1,
        breath: 0.75,
        ..MotionPhase::default()
    };
    let motion = phantom.motion(to).unwrap();
    let [from, there] = [phantom.reference(), to].map(|at| phantom.wall(at).unwrap());
    let grid = *phantom.camera().grid();
    assert!(motion.voxels.len() > 200);
    let h = 1e-4;
    let around = [-h, h].map(|by| {
        let phase = to.phase + by;
        phantom.wall(MotionPhase { phase, ..to }).unwrap()
    });
    for &k in &motion.voxels {
        let p: Point3<f64> = grid.centre(k % 24, k / 24 % 24, k / 576);
        let point = from.locate(&p).unwrap();
        let way = there.position(&point).unwrap() - p;
        let strain = from
            .deformation(&there, &point)
            .unwrap()
            .strain()
            .components();
        let speed = around[1].position(&point).unwrap() - around[0].position(&point).unwrap();
        let speed = speed / (2.0 * h * phantom.cycle().period());
        for a in 0..3 {
            assert!((f64::from(motion.displacement[3 * k + a]) - way[a]).abs() < 1e-6);
            // Of second order in a thousandth of a cycle.
            let found = f64::from(motion.velocity[3 * k + a]);
            assert!((found - speed[a]).abs() < 1e-3, "{found} {}", speed[a]);
        }
        for (a, e) in strain.iter().enumerate() {
            let found = f64::from(motion.strain[6 * k + a]);
            assert!((found - e).abs() < 1e-6 * (1.0 + e.abs()), "{found} {e}");
        }
    }
    // Nothing outside.
    let all: usize = motion.displacement.iter().filter(|x| **x != 0.0).count();
    assert!(all <= 3 * motion.voxels.len());
}

/// In respiratory gates by phase both motions proceed: velocities are differences of positions in real time. By amplitude the respiratory
/// part cancels, as during a breath-hold.
#[test]
fn velocities_are_differences_in_real_time() {
    let mut scene = lively();
    let breathing = scene.breathing.as_mut().unwrap();
    breathing.gates = Some(RespiratoryGates::Phase(3));
    breathing.curve = BreathingCurve::Lujan { n: 2 };
    let phantom = Phantom::new(scene.clone()).unwrap();
    let (cycle, period) = (phantom.cycle(), scene.breathing.as_ref().unwrap().period);
    let grid = *phantom.camera().grid();
    let from = phantom.wall(phantom.reference()).unwrap();
    let mut fastest = [0.0f64; 3];
    for (gate, ScenePhase { at, .. }) in phantom.phases().into_iter().enumerate() {
        let phase = at.breath_phase.unwrap();
        // Each a hundredth of a second, with its own step.
        let h = 1e-5;
        let [before, after] = [-h, h].map(|dt| {
            let moment = MotionPhase {
                phase: at.phase + dt / cycle.period(),
                breath: cycle.breath(phase * period + dt),
                ..MotionPhase::default()
            };
            phantom.wall(moment).unwrap()
        });
        let motion = phantom.motion(at).unwrap();
        let at_rest = MotionPhase {
            breath_phase: None,
            ..at
        };
        let held = phantom.motion(at_rest).unwrap();
        for &k in &motion.voxels {
            let point = from
                .locate(&grid.centre(k % 24, k / 24 % 24, k / 576))
                .unwrap();
            let way = after.position(&point).unwrap() - before.position(&point).unwrap();
            for a in 0..3 {
                let expected = way[a] / (2.0 * h);
                let found = f64::from(motion.velocity[3 * k + a]);
                // Shapes are accurate to 1e-12 of their size.
                assert!(
                    (found - expected).abs() < 2e-3,
                    "gate {gate}: {found} {expected}"
                );
                let of_breath = found - f64::from(held.velocity[3 * k + a]);
                fastest[gate / 4] = fastest[gate / 4].max(of_breath.abs());
            }
        }
    }
    // Inspiration, turning point, and expiration.
    assert!(
        fastest[0] > 0.5 && fastest[1] < 1e-3 && fastest[2] > 0.5,
        "{fastest:?}"
    );
    scene.breathing.as_mut().unwrap().gates = Some(RespiratoryGates::Amplitude(2));
    let by_amplitude = Phantom::new(scene).unwrap();
    assert!(by_amplitude.phases()[5].at.breath_phase.is_none());
}

#[test]
fn a_run_writes_the_motion_of_each_gate_and_reports_torsion() {
    let mut scene = lively();
    scene.camera.views = 2;
    scene.output.write = vec![Product::Motion];
    scene.points = vec![PointSettings {
        layer: 0.5,
        s: 0.2,
        azimuth_degrees: 90.0,
    }];
    for (format, end) in [
        (heart_phantom::files::Format::Nifti, "nii"),
        (heart_phantom::files::Format::MetaImageSingle, "mha"),
    ] {
        scene.output.volumes = format;
        let folder = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(scene.clone()).unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        let planned = phantom.files().unwrap();
        assert_eq!(report.files.len(), 3 * 8 + 1);
        assert_eq!(planned.len(), 3 * 8 + 1);
        for file in planned {
            let name = file.name.to_str().unwrap();
            let written = std::fs::metadata(folder.path().join(&file.name))
                .unwrap()
                .len();
            assert!(
                written >= file.bytes && written < file.bytes + 600 || file.bytes == 0,
                "{name}"
            );
        }
        assert!(
            folder
                .path()
                .join(format!("displacement-gate-03.{end}"))
                .exists()
        );
        let bytes = std::fs::read(folder.path().join(format!("velocity-gate-03.{end}"))).unwrap();
        let number = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
        match end {
            // Dimensions 5, the fifth of 3, vectors.
            "nii" => assert_eq!([number(40), number(50), number(68)], [5, 3, 1007]),
            _ => assert!(
                String::from_utf8_lossy(&bytes[..400]).contains("ElementNumberOfChannels = 3\n")
            ),
        }
        assert_eq!(report.motion.len(), 8);
        // The average twist of both membranes is 12 degrees from base to apex at end-systole, over about 11 cm of the cavity.
        let systole = &report.motion[0];
        assert!(
            systole.torsion_degrees_per_cm > 0.7 && systole.torsion_degrees_per_cm < 1.3,
            "{systole:?}"
        );
        assert!(systole.longitudinal_shortening > 0.05);
        assert_eq!(systole.points.len(), 1);
        let wall = phantom.wall(phantom.phases()[0].at).unwrap();
        let point = phantom.scene().points[0];
        let point = MaterialPoint {
            layer: point.layer,
            s: point.s,
            azimuth: point.azimuth_degrees.to_radians(),
        };
        let place = wall.position(&point).unwrap();
        assert_eq!(
            systole.points[0].position_cm,
            <[f64; 3]>::from(place.coords)
        );
    }
}

/// Layers between polygons have small jumps at the nodes, which the velocities do not contain.
#[test]
fn velocities_of_polygons_equal_those_of_polynomials() {
    let mut scene = small(Mode::WholeCycle).with_size(48);
    let polygons = Phantom::new(scene.clone()).unwrap();
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 16,
        per_piece: 1,
        tolerance: 1e-4,
    };
    let polynomials = Phantom::new(scene).unwrap();
    for phase in [0.1, 0.25, 0.35, 0.6, 0.85] {
        let [found, expected] = [&polygons, &polynomials].map(|of| of.motion(phase).unwrap());
        assert!(found.voxels.len() > 500);
        let (mut largest, mut fastest) = (0.0f32, 0.0f32);
        for k in found.voxels.iter().filter(|k| expected.voxels.contains(k)) {
            for a in 3 * k..3 * k + 3 {
                largest = largest.max((found.velocity[a] - expected.velocity[a]).abs());
                fastest = fastest.max(expected.velocity[a].abs());
            }
        }
        // Of the tangents of layers between polygons, along which the material slides: 1.4 % at the first phase.
        assert!(largest < 0.03 * fastest, "{phase}: {largest} of {fastest}");
    }
}
