//! All gates at a reference phase, with known exact motion.

use crate::phantom::small;
use heart_phantom::radon::{
    Displacements, EmOptions, Kernel, LinearOperator, MotionState, MovingOperator, Projector,
    StackOrder, Stopping, Warp, mlem,
};
use heart_phantom::scene::*;
use heart_phantom::*;
use heart_phantom::{
    Artefacts, ImageQuality, MaterialPoint, MotionPhase, Phantom, PhantomError, Uptake,
    no_observer, run,
};
use std::f64::consts::FRAC_1_PI;

/// A heart with views over a full turn, in voxels of 0.35 cm.
fn scene(mode: Mode) -> Scene {
    let mut scene = small(mode);
    (scene.camera.bins, scene.camera.rows) = (46, 44);
    scene.camera.pitch = [0.35; 2];
    (scene.camera.views, scene.camera.arc) = (32, 360.0);
    scene.camera.seconds_per_view = 4.0;
    scene.acquisition.accuracy = Accuracy::Steps(32);
    scene.reconstruction.method = Method::Osem(Osem::new(4, 10));
    scene
}

fn compensated(mode: Mode) -> Scene {
    let mut scene = scene(mode);
    scene.reconstruction.compensation = Compensation::KnownMotion;
    scene
}

fn counted(mut scene: Scene, per_unit: f64, seed: u64) -> Scene {
    scene.noise = Some(Noise {
        counts: Counts::PerUnit(per_unit),
        seed,
    });
    scene
}

fn views(phantom: &Phantom) -> Vec<f32> {
    let of = |gate| phantom.sinograms(gate, &no_observer).unwrap().samples;
    (0..phantom.n_gates()).flat_map(of).collect()
}

fn in_one_frame(scene: &Scene) -> (Phantom, Vec<f32>) {
    let phantom = Phantom::new(scene.clone()).unwrap();
    let (volume, report) = phantom
        .compensated(0, &views(&phantom), &no_observer)
        .unwrap();
    assert_eq!(
        report.is_some(),
        matches!(scene.reconstruction.method, Method::Osem(_))
    );
    (phantom, volume)
}

fn distance(a: &[f32], b: &[f32]) -> f64 {
    let square = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (square.sum::<f64>() / b.iter().map(|b| f64::from(*b).powi(2)).sum::<f64>()).sqrt()
}

/// The voxel of a material point takes the value at the point's position at the reference phase: a linear function of position is transported.
#[test]
fn voxels_of_the_wall_take_the_value_of_their_material() {
    let mut lively = small(Mode::Static { phase: 0.1 }).with_size(32);
    lively.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 12,
        per_piece: 1,
        tolerance: 1e-4,
    };
    lively.twist = Some(Twist {
        inner_degrees: vec![-3.0, 10.0],
        outer_degrees: vec![-3.0, 8.0],
    });
    lively.cycle.av_plane_displacement = 1.2;
    let phantom = Phantom::new(lively).unwrap();
    let warp = phantom.warps(0).unwrap();
    let grid = *phantom.camera().grid();
    let centre = |k: usize| grid.centre(k % 32, k / 32 % 32, k / 1024);
    // Linear functions are interpolated exactly.
    let plane = |p: &heart_phantom::revolve_voxel::nalgebra::Point3<f64>| {
        3.0 + 0.2 * p.x - 0.1 * p.y + 0.3 * p.z
    };
    let still: Vec<f64> = (0..grid.len()).map(|k| plane(&centre(k))).collect();
    let mut moved = vec![0.0f64; grid.len()];
    warp.forward_into(&still, &mut moved).unwrap();
    let at = MotionPhase {
        phase: 0.1,
        breath: 0.0,
        ..MotionPhase::default()
    };
    let walls = [phantom.reference(), at].map(|at| phantom.wall(at).unwrap());
    let mut seen = 0;
    for k in 0..grid.len() {
        if let Some(point) = walls[1].locate(&centre(k)) {
            let expected = plane(&walls[0].position(&point).unwrap());
            assert!(
                (moved[k] - expected).abs() < 1e-5,
                "{point:?} {} {expected}",
                moved[k]
            );
            seen += 1;
        }
    }
    assert!(seen > 500);
    // At the reference phase the displacement is zero.
    let mut held = small(Mode::Static { phase: 0.5 }).with_size(32);
    held.cycle.av_plane_displacement = 1.2;
    let held = Phantom::new(held).unwrap();
    held.warps(0)
        .unwrap()
        .forward_into(&still, &mut moved)
        .unwrap();
    assert!(moved.iter().zip(&still).all(|(a, b)| (a - b).abs() < 1e-5));
}

/// Cardiac gates are numbered first: each of the six maps leads to its own gate, and to no other gate better. The first and the last
/// cardiac gate contain the same volumes.
#[test]
fn maps_of_respiration_lead_to_their_own_gates() {
    let mut scene = small(Mode::Gated { gates: 3 }).with_size(32);
    scene.camera.seconds_per_view = 20.0;
    scene.truth.tolerance = 0.01;
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.6, -2.4],
        gates: Some(RespiratoryGates::Amplitude(2)),
        ..Breathing::default()
    });
    let phantom = Phantom::new(scene).unwrap();
    let still = phantom.activity(phantom.reference()).unwrap();
    let truths: Vec<Vec<f32>> = (0..6).map(|gate| phantom.truth(gate).unwrap()).collect();
    let grid = phantom.camera().grid();
    let heights: Vec<f32> = (0..grid.len())
        .map(|k| grid.centre(0, 0, k / 1024).z as f32)
        .collect();
    for gate in 0..6 {
        let warps = phantom.warps(gate).unwrap();
        assert_eq!(warps.factors().len(), 2);
        // Over 60 respiratory cycles, the lower and the upper half of a sinusoid have the average heights 1/2 -+ 1/pi.
        let mut shifted = vec![0.0f32; still.len()];
        (warps.factors()[1].forward_into(&heights, &mut shifted)).unwrap();
        // Sources of voxels near the edges may be outside.
        let middle = |k: &usize| grid.centre(k % 32, k / 32 % 32, k / 1024).coords.amax() < 5.0;
        let by = (0..still.len()).filter(middle);
        let by = by.map(|k| (shifted[k] - heights[k]).abs());
        let expected = 2.4 * (0.5 + if gate < 3 { -FRAC_1_PI } else { FRAC_1_PI });
        let off = f64::from(by.fold(0.0, f32::max)) - expected;
        // The states of the gate are those of a ground truth with a tolerance of 0.01.
        assert!(off.abs() < 0.02, "{gate}: {off:e}");
        let mut moved = vec![0.0f32; still.len()];
        warps.forward_into(&still, &mut moved).unwrap();
        let off: Vec<f64> = truths.iter().map(|truth| distance(&moved, truth)).collect();
        println!(
            "{gate}: {off:.3?}, still {:.3}",
            distance(&still, &truths[gate])
        );
        let least = off.iter().fold(f64::INFINITY, |least, off| least.min(*off));
        assert!(off[gate] <= 1.001 * least, "{gate}: {off:?}");
    }
}

/// Blur of sixteen gates and noise of four at a reference phase: compared with a static heart, and with an ungated one.
#[test]
fn compensated_gates_are_as_sharp_as_a_static_heart_and_no_noisier_than_an_ungated_one() {
    let counts = 4000.0;
    let diastole = Mode::Static { phase: 0.5 };
    let gated = Mode::Gated { gates: 16 };
    let judged = |phantom: &Phantom, volume: &[f32]| -> Artefacts {
        let truth = phantom.compensated_truth(0).unwrap();
        phantom.compensated_artefacts(0, volume, &truth).unwrap()
    };
    let (phantom, sharp) = in_one_frame(&compensated(gated));
    let (still, at_rest) = in_one_frame(&compensated(diastole));
    let (moving, blurred) = {
        let phantom = Phantom::new(scene(Mode::WholeCycle)).unwrap();
        let volume = phantom.volume(0).unwrap();
        (phantom, volume)
    };
    let [one, rest, ungated] =
        [(&phantom, &sharp), (&still, &at_rest), (&moving, &blurred)].map(|(phantom, volume)| {
            let artefacts = judged(phantom, volume);
            [
                artefacts.wall_blur_mm.unwrap(),
                artefacts.rmse.unwrap(),
                artefacts.wall_mean.unwrap_or(f64::NAN),
            ]
        });
    println!("blur, rmse, wall: compensated {one:?}, static {rest:?}, ungated {ungated:?}");
    assert!((one[0] / rest[0] - 1.0).abs() < 0.05, "{one:?} {rest:?}");
    assert!(one[1] < 1.2 * rest[1] && one[1] < 0.85 * ungated[1]);

    // Noise of two realisations in the wall at the reference phase, relative to the mean: the noise of expectation maximisation is proportional to
    // it.
    let wall = phantom.regions_of(7).unwrap().wall;
    let spread = |[a, b]: [Vec<f32>; 2]| {
        let inside = |(k, _): &(usize, (f32, f32))| wall.as_slice()[*k];
        let pairs = a.into_iter().zip(b).enumerate().filter(inside);
        let (mut square, mut sum) = (0.0, 0.0);
        for (_, (a, b)) in pairs {
            square += f64::from(a - b).powi(2);
            sum += f64::from(a + b);
        }
        let n = wall.count() as f64;
        (square / (2.0 * n)).sqrt() / (sum / (2.0 * n))
    };
    // A quarter of the gates of four times the counts have as much noise, and take a quarter of the time.
    let gated = spread([1, 2].map(|seed| {
        let gated = compensated(Mode::Gated { gates: 4 });
        in_one_frame(&counted(gated, counts / 4.0, seed)).1
    }));
    let ungated = spread([1, 2].map(|seed| {
        let scene = counted(scene(Mode::WholeCycle), counts, seed);
        Phantom::new(scene).unwrap().volume(0).unwrap()
    }));
    println!(
        "noise: compensated {gated}, ungated {ungated}, {} voxels",
        wall.count()
    );
    assert!(gated < 1.05 * ungated, "{gated} {ungated}");
}

/// The overshoot of the average of the wall at a reference phase exceeds that of a static heart, but no motion is missed. A warp
/// interpolates between voxels; the model treats this as blur of the camera and compensates it. A displacement by whole voxels gives the
/// average of the static heart, one by half voxels overshoots.
#[test]
fn displacements_by_whole_voxels_preserve_the_wall_average_and_by_half_voxels_overshoot() {
    const SIDE: f64 = 0.35;
    let still = Phantom::new(scene(Mode::Static { phase: 0.5 })).unwrap();
    let truth = still.compensated_truth(0).unwrap();
    let (camera, grid) = (still.camera(), *still.camera().grid());
    let wall_mean = |voxels: f64| {
        let mut elsewhere = scene(Mode::Static { phase: 0.5 });
        elsewhere.pose.shift = [voxels * SIDE; 3];
        let views = Phantom::new(elsewhere).unwrap().sinograms(0, &no_observer);
        let there = [-voxels * SIDE; 3].map(|way| way as f32);
        let motion = Displacements {
            fraction: 1.0,
            by: &(0..grid.len())
                .map(|voxel| (voxel, there))
                .collect::<Vec<_>>(),
        };
        let warp = Warp::new(grid.shape(), grid.spacing(), &[motion]).unwrap();
        let projector = Projector::new(&still.geometry(0).unwrap(), camera.image(), Kernel::Strip);
        let operator = projector
            .unwrap()
            .stack_operator::<f32>(camera.n_rows(), StackOrder::ViewSliceBin);
        let seen = MovingOperator::new(vec![MotionState {
            warps: warp.into(),
            operator: operator.unwrap(),
            weights: vec![1.0],
        }]);
        let mut volume = vec![0.1f32; grid.len()];
        let options =
            EmOptions::default().with_stopping(Stopping::default().with_max_iterations(20));
        mlem(
            &seen.unwrap(),
            &views.unwrap().samples,
            &mut volume,
            &options,
            heart_phantom::radon::no_observer,
        )
        .unwrap();
        let inner = ImageQuality::of(&volume, Some(&truth), &still.regions_of(0).unwrap());
        inner.unwrap().eroded_wall_mean.unwrap()
    };
    let [at_rest, by_one, by_half] = [0.0, 1.0, 0.5].map(wall_mean);
    println!("wall: static {at_rest}, displaced by a voxel {by_one}, by half a voxel {by_half}");
    // Views divide the wall into other bins: 0.8 %.
    assert!((by_one / at_rest - 1.0).abs() < 0.03, "{at_rest} {by_one}");
    // 29 % after 20 iterations: half-way along all three axes the interpolation is largest.
    assert!(by_half / at_rest - 1.0 > 0.2, "{at_rest} {by_half}");
}

#[test]
fn compensation_is_bitwise_independent_of_threads() {
    let mut moving = compensated(Mode::Gated { gates: 2 });
    (moving.camera.views, moving.reconstruction.method) = (6, Method::Osem(Osem::new(2, 1)));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| in_one_frame(&moving).1)
    };
    assert!(with(1) == with(3));
}

#[test]
fn fbp_shifts_the_views_of_each_cardiac_gate() {
    let mut moving = compensated(Mode::Gated { gates: 2 });
    moving.reconstruction.method = Method::Fbp;
    moving.camera.views = 12;
    moving.breathing = Some(Breathing {
        gates: Some(RespiratoryGates::Phase(3)),
        ..Breathing::default()
    });
    let phantom = Phantom::new(moving.clone()).unwrap();
    assert_eq!((phantom.n_gates(), phantom.n_volumes()), (6, 2));
    let views = views(&phantom);
    for gate in 0..2 {
        let (volume, report) = phantom.compensated(gate, &views, &no_observer).unwrap();
        assert!(report.is_none());
        let alone = Phantom::new(moving.clone()).unwrap();
        assert!(distance(&alone.volume(gate).unwrap(), &volume) < 1e-6);
        let (slice, len) = (alone.slice(gate, 20).unwrap(), 46 * 46);
        assert!(distance(&slice, &volume[20 * len..][..len]) < 1e-6);
        // The reference is a heart during a breath-hold.
        let mut held = moving.clone();
        held.breathing = None;
        let held = Phantom::new(held).unwrap().truth(gate).unwrap();
        assert!(distance(&phantom.compensated_truth(gate).unwrap(), &held) < 2e-3);
    }
}

#[test]
fn the_only_compensated_volume_is_volume_0() {
    let mut moving = compensated(Mode::Gated { gates: 2 });
    (moving.camera.bins, moving.camera.rows, moving.camera.pitch) = (12, 12, [1.3; 2]);
    (moving.camera.views, moving.reconstruction.method) = (6, Method::Osem(Osem::new(2, 2)));
    let (phantom, volume) = in_one_frame(&moving);
    let found = phantom.volume(0).unwrap();
    assert!(distance(&found, &volume) < 1e-5);
    let first_gate = phantom.reconstruct(0, &phantom.sinograms(0, &no_observer).unwrap().samples);
    assert!(distance(&found, &first_gate.unwrap()) > 0.1);
    let beyond = phantom.volume(1);
    assert!(
        matches!(beyond, Err(PhantomError::Count { given: 1, .. })),
        "{beyond:?}"
    );
}

#[test]
fn a_run_writes_the_planned_files() {
    for (method, volumes) in [(Method::Osem(Osem::new(2, 2)), 1), (Method::Fbp, 2)] {
        let mut moving = compensated(Mode::Gated { gates: 2 });
        (moving.camera.bins, moving.camera.rows, moving.camera.pitch) = (20, 20, [0.8; 2]);
        moving.camera.views = 12;
        moving.reconstruction.method = method;
        moving.output.write = vec![
            Product::Projections,
            Product::Reconstruction,
            Product::Truth,
            Product::Pictures,
        ];
        let phantom = Phantom::new(moving).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        let mut planned: Vec<_> = phantom
            .files()
            .unwrap()
            .into_iter()
            .map(|file| file.name)
            .collect();
        let mut written = report.files.clone();
        planned.sort();
        written.sort();
        assert_eq!(planned, written);
        assert_eq!(report.compensated.len(), volumes);
        assert!(
            report
                .gates
                .iter()
                .all(|gate| gate.osem.is_none() && gate.artefacts.is_none())
        );
        for of in &report.compensated {
            assert!(of.artefacts.is_some() && of.osem.is_some() == (volumes == 1));
        }
        let name = [
            "reconstruction-compensated.npy",
            "reconstruction-compensated-gate-01.npy",
        ][volumes - 1];
        assert!(folder.path().join(name).exists());
        let picture = ["slice-compensated.png", "slice-compensated-gate-00.png"][volumes - 1];
        assert!(folder.path().join(picture).exists());
    }
}

#[test]
fn scenes_without_a_common_reference_phase_are_rejected() {
    let refused = |change: &dyn Fn(&mut Scene)| {
        let mut scene = compensated(Mode::Gated { gates: 2 });
        change(&mut scene);
        match Phantom::new(scene) {
            Err(PhantomError::Scene(error)) => error.to_string(),
            other => panic!("{other:?}"),
        }
    };
    let error = refused(&|scene| {
        scene.reconstruction.method = Method::Fbp;
        scene.breathing = Some(Breathing {
            rotation_degrees: [1.0, 0.0, 0.0],
            ..Breathing::default()
        });
    });
    assert!(
        error.contains("reconstruction.compensation") && error.contains("rotation_degrees"),
        "{error}"
    );
    let error = refused(&|scene| scene.activity.cavity = Uptake::Total(10.0));
    assert!(error.contains("activity.cavity"), "{error}");
    let phantom = Phantom::new(compensated(Mode::Gated { gates: 2 })).unwrap();
    let short = phantom.compensated(0, &[0.0; 7], &no_observer).unwrap_err();
    assert!(matches!(short, PhantomError::WrongLength { given: 7, .. }));
    let beyond = phantom
        .compensated(1, &views(&phantom), &no_observer)
        .unwrap_err();
    assert!(matches!(beyond, PhantomError::Count { .. }));
    assert!(matches!(phantom.warps(2), Err(PhantomError::Count { .. })));
}

/// Surroundings are displaced up to a distance of a tenth of the heart's length and three times the longest displacement of the wall: here that of
/// the middle of its side, whose twist is the largest.
#[test]
fn surroundings_move_within_three_times_the_longest_displacement() {
    let mut scene = small(Mode::Static { phase: 0.0 }).with_size(32);
    scene.camera.pitch = [0.6; 2];
    let degrees = vec![0.0, 25.0, 25.0, 0.0];
    scene.twist = Some(Twist {
        inner_degrees: degrees.clone(),
        outer_degrees: degrees,
    });
    let phantom = Phantom::new(scene).unwrap();
    let at = MotionPhase::default();
    let [from, to] = [phantom.reference(), at].map(|at| phantom.wall(at).unwrap());
    let mut longest = 0.0f64;
    for (layer, k) in (0..400).map(|k| ((k % 2) as f64, k / 2)) {
        let point = MaterialPoint {
            layer,
            s: 0.5 * k as f64 / 199.0,
            azimuth: 0.0,
        };
        let way = to.position(&point).unwrap() - from.position(&point).unwrap();
        longest = longest.max(way.norm());
    }
    let reach = 0.1 * phantom.heart().length() * 2.0;
    let reach = reach.max(0.1 * phantom.heart().length() + 3.0 * longest);
    let grid = *phantom.camera().grid();
    let centre = |k: usize| grid.centre(k % 32, k / 32 % 32, k / 1024);
    let mut farthest = 0.0f64;
    for axis in 0..3 {
        let still: Vec<f64> = (0..grid.len()).map(|k| centre(k)[axis]).collect();
        let mut moved = vec![0.0f64; grid.len()];
        (phantom.warps(0).unwrap().forward_into(&still, &mut moved)).unwrap();
        let shape = phantom.shape(0.0).unwrap();
        for k in (0..grid.len()).filter(|&k| (moved[k] - still[k]).abs() > 1e-6) {
            farthest = farthest.max(shape.body().signed_distance(1, &centre(k)).unwrap());
        }
    }
    // Voxels of 0.6 cm; the longest displacement is that of eight points along the wall.
    assert!(
        farthest <= reach && farthest > reach - 0.4,
        "{farthest} {reach}"
    );
}

/// The heart at the reference phase, end-diastole, has no motion: its compensated reconstruction is an ordinary one.
#[test]
fn known_motion_has_no_effect_at_the_reference_phase() {
    let still = Mode::Static { phase: 0.5 };
    let [plain, compensated] = [scene(still), compensated(still)].map(|scene| {
        let mut scene = scene.with_size(16);
        scene.reconstruction.method = Method::Osem(Osem::new(4, 2));
        Phantom::new(scene).unwrap().volume(0).unwrap()
    });
    let most = plain.iter().copied().fold(0.0f32, f32::max);
    for (a, b) in plain.iter().zip(&compensated) {
        // Eight updates in single precision.
        assert!((a - b).abs() <= 1e-5 * most, "{a} {b}");
    }
}
