//! Motion-compensated reconstruction of a heart with respiration and without heartbeat, by the exact motion.

use crate::phantom::small;
use heart_phantom::revolve_voxel::nalgebra::Vector3;
use heart_phantom::*;
use heart_phantom::{Phantom, VolumeRange, no_observer};
use radon::{FbpOptions, FbpPlan, ImageGrid, StackOrder, add_shifted};

fn still() -> Scene {
    let mut scene = small(Mode::Static { phase: 0.3 });
    scene.camera.views = 40;
    scene.camera.seconds_per_view = 4.0;
    scene.acquisition.accuracy = Accuracy::Steps(32);
    scene
}

fn breathing(shift: [f64; 3], gates: usize) -> Scene {
    let mut scene = still();
    scene.reconstruction.compensation = Compensation::KnownMotion;
    scene.breathing = Some(Breathing {
        shift,
        gates: Some(RespiratoryGates::Amplitude(gates)),
        ..Breathing::default()
    });
    scene
}

/// In f64, from the chords of the body: displaced by three rows and, at 0 and 90 degrees, by two bins and one bin.
#[test]
fn shifts_by_whole_bins_and_rows_are_compensated_to_rounding() {
    let phantom = Phantom::new(still()).unwrap();
    let camera = phantom.camera();
    let (n, pitch) = (camera.n_bins(), camera.pitch());
    let shape = phantom.shape(0.3).unwrap();
    for (views, shift) in [
        (
            (0..40).collect::<Vec<usize>>(),
            Vector3::new(0.0, 0.0, -3.0) * pitch,
        ),
        (vec![0, 20], Vector3::new(2.0, -1.0, 3.0) * pitch),
    ] {
        let pose = shape.body().pose().shifted(shift).unwrap();
        let moved = shape.body().with_pose(pose);
        let [mut exact, mut back] = [
            vec![0.0f64; views.len() * n * n],
            vec![0.0f64; views.len() * n * n],
        ];
        let mut angles = Vec::new();
        for (k, &view) in views.iter().enumerate() {
            let theta = camera.geometry().angles()[view];
            angles.push(theta);
            let rays = camera.detector().rays(theta).unwrap();
            let part = k * n * n..(k + 1) * n * n;
            shape
                .body()
                .project_add(&rays, &[0.0, 1.0], 1.0, &mut exact[part.clone()])
                .unwrap();
            let mut seen = vec![0.0f64; n * n];
            moved
                .project_add(&rays, &[0.0, 1.0], 1.0, &mut seen)
                .unwrap();
            // Rounding of an angle does not make a fraction of a bin.
            let by = [shift.x * theta.cos() + shift.y * theta.sin(), shift.z];
            let by = by.map(|by| (by / pitch * 1e12).round() / 1e12);
            add_shifted(&seen, [n, n], by, 1.0, &mut back[part]).unwrap();
        }
        let most = exact.iter().copied().fold(0.0, f64::max);
        let apart = exact.iter().zip(&back).map(|(a, b)| (a - b).abs());
        // Near the edge of the body a chord is a square root, with half of the digits where it is nearly zero.
        let square: f64 = apart.map(|d| d * d).sum();
        assert!(
            (square / exact.len() as f64).sqrt() < 1e-12 * most,
            "{square}"
        );
        if views.len() == 40 {
            let geometry = radon::ParallelGeometry::new(angles, n, pitch).unwrap();
            let image = ImageGrid::square(n, pitch).unwrap();
            let plan = FbpPlan::<f64>::new(&geometry, &image, &FbpOptions::default()).unwrap();
            let volume = |views: &[f64]| {
                let mut volume = vec![0.0; n * n * n];
                plan.reconstruct_slab_into(
                    views,
                    n,
                    StackOrder::ViewSliceBin,
                    0..n,
                    &mut volume,
                    &mut radon::FbpScratch::default(),
                )
                .unwrap();
                volume
            };
            let [a, b] = [volume(&exact), volume(&back)];
            let square: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
            let norm: f64 = a.iter().map(|a| a * a).sum();
            assert!((square / norm).sqrt() < 1e-12, "{}", (square / norm).sqrt());
        }
    }
}

#[test]
fn compensated_respiration_equals_the_static_heart_up_to_interpolation() {
    let still = Phantom::new(still()).unwrap();
    let sharp = still.sinograms(0, &no_observer).unwrap().samples;
    let expected = still.reconstruct(0, &sharp).unwrap();
    let off = |volume: Vec<f32>| {
        let square = volume
            .iter()
            .zip(&expected)
            .map(|(a, b)| f64::from(a - b).powi(2));
        let norm: f64 = expected.iter().map(|b| f64::from(*b).powi(2)).sum();
        (square.sum::<f64>() / norm).sqrt()
    };
    let shift = [0.3, 0.5, -1.6];
    let mut errors = Vec::new();
    for gates in [2, 4, 8] {
        let phantom = Phantom::new(breathing(shift, gates)).unwrap();
        errors.push(off(phantom.volume(0).unwrap()));
    }
    // The whole respiratory motion, not compensated.
    let mut blurred = breathing(shift, 1);
    blurred.breathing.as_mut().unwrap().gates = None;
    blurred.reconstruction.compensation = Compensation::None;
    let blurred = off(Phantom::new(blurred).unwrap().volume(0).unwrap());
    // The cost of interpolation alone: the static views shifted by half a bin and back.
    let len = still.camera().view_len();
    let mut moved = vec![0.0f32; sharp.len()];
    for (view, moved) in sharp.chunks(len).zip(moved.chunks_mut(len)) {
        let mut there = vec![0.0f32; len];
        add_shifted(view, [40, 40], [0.5, 0.5], 1.0, &mut there).unwrap();
        add_shifted(&there, [40, 40], [-0.5, -0.5], 1.0, moved).unwrap();
    }
    let interpolated = off(still.reconstruct(0, &moved).unwrap());
    println!("gates 2, 4, 8: {errors:?}, blurred {blurred}, interpolated {interpolated}");
    assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
    assert!(errors[2] < 0.5 * blurred);
    assert!(errors[2] < interpolated, "{errors:?} {interpolated}");
    // Without respiration: the same volume.
    let (volume, _) = still.compensated(0, &sharp, &no_observer).unwrap();
    assert!(volume == expected);
}

#[test]
fn respiratory_rotation_is_rejected() {
    let mut scene = breathing([0.0; 3], 2);
    scene.breathing.as_mut().unwrap().rotation_degrees = [5.0, 0.0, 0.0];
    scene.reconstruction.compensation = Compensation::None;
    let phantom = Phantom::new(scene).unwrap();
    let views = phantom.sinograms_of_gates().unwrap();
    let refused = phantom.compensated(0, &views, &no_observer).unwrap_err();
    assert!(
        refused.to_string().contains("rotation by breathing"),
        "{refused}"
    );
}

/// Instants, which have no duration, are shifted back whole.
#[test]
fn instants_are_compensated() {
    let volume = |shift: [f64; 3], compensation| {
        let mut scene = breathing(shift, 1);
        scene.acquisition.mode = Mode::Instants;
        // No heartbeat.
        scene.cycle.volume = VolumeRange::Gains([0.3; 2]);
        scene.camera.seconds_per_view = 1.3;
        scene.breathing.as_mut().unwrap().gates = None;
        scene.reconstruction.compensation = compensation;
        Phantom::new(scene).unwrap().volume(0).unwrap()
    };
    let still = volume([0.0; 3], Compensation::None);
    let off = |compensation| {
        let volume = volume([0.3, 0.5, -1.6], compensation);
        let square = |a: f64, b: f64| (a - b).powi(2);
        let pairs = volume.iter().zip(&still);
        let off: f64 = pairs.map(|(a, b)| square((*a).into(), (*b).into())).sum();
        off.sqrt()
    };
    let [moved, compensated] = [Compensation::None, Compensation::KnownMotion].map(off);
    // Interpolation by fractions of a bin remains.
    assert!(compensated < 0.5 * moved, "{compensated} {moved}");
}
