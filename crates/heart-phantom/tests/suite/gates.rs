//! All gates together against each gate separately.

use heart_phantom::files::Format;
use heart_phantom::scene::{
    BlurSettings, CollimatorSettings, DiscretisationSettings, HolesSettings,
};
use heart_phantom::{
    Accuracy, Background, Counts, Defect, GateFiles, Mode, Noise, Product, Scene, run,
};
use heart_phantom::{
    Breathing, Phantom, PhantomError, RespiratoryGates, Rotation, VolumeCurve, VolumeRange,
    no_observer,
};
use std::fs;

fn scene() -> Scene {
    let mut scene = Scene::default()
        .with_size(12)
        .with_mode(Mode::Gated { gates: 4 });
    scene.camera.views = 4;
    scene.acquisition.accuracy = Accuracy::Steps(16);
    scene.truth.tolerance = 0.01;
    scene
}

fn one_by_one(phantom: &Phantom, of: impl Fn(usize) -> Vec<f32>) -> Vec<f32> {
    (0..phantom.n_gates()).flat_map(of).collect()
}

/// Largest differences of projections and volumes, relative to the largest sample.
fn differences(scene: &Scene) -> [f32; 2] {
    let phantom = Phantom::new(scene.clone()).unwrap();
    let views = one_by_one(&phantom, |gate| {
        phantom.sinograms(gate, &no_observer).unwrap().samples
    });
    let volumes = one_by_one(&phantom, |gate| phantom.truth(gate).unwrap());
    let together = [
        phantom.sinograms_of_gates().unwrap(),
        phantom.truth_of_gates().unwrap(),
    ];
    let mut found = [0.0; 2];
    for (found, (a, b)) in found.iter_mut().zip(together.iter().zip([views, volumes])) {
        assert_eq!(a.len(), b.len());
        let most = b.iter().copied().fold(0.0, f32::max);
        assert!(most > 0.0);
        *found = a
            .iter()
            .zip(&b)
            .fold(0f32, |worst, (a, b)| worst.max((a - b).abs()))
            / most;
    }
    found
}

/// A file with several cardiac gates has a time axis; respiratory gates have files of their own, also without cardiac gates.
#[test]
fn each_respiratory_gate_has_a_file_of_its_cardiac_gates() {
    let mut scene = Scene::default().with_size(8);
    scene.camera.views = 4;
    scene.camera.pitch = [2.0; 2];
    scene.camera.seconds_per_view = 20.0;
    scene.truth.tolerance = 0.1;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.0, -2.0],
        gates: Some(RespiratoryGates::Amplitude(3)),
        ..Breathing::default()
    });
    scene.output.write = vec![Product::Projections, Product::Truth, Product::Labels];
    scene.output.gates = GateFiles::OneFile;
    (scene.output.projections, scene.output.volumes) = (Format::Npz, Format::Nifti);
    for (mode, cardiac) in [
        (Mode::Gated { gates: 2 }, Some(2)),
        (Mode::Gated { gates: 1 }, Some(1)),
        (Mode::WholeCycle, None),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(scene.clone().with_mode(mode)).unwrap();
        let report = run(&phantom, folder.path(), &no_observer).unwrap();
        let planned = phantom.files().unwrap();
        assert_eq!(report.files.len(), planned.len());
        for file in &planned {
            assert!(report.files.contains(&file.name), "{}", file.name.display());
        }
        let stem = cardiac.map_or("gate", |_| "respiratory-gate");
        for breath in 0..3 {
            let end = format!("{stem}-{breath:02}.nii");
            let name = (planned.iter())
                .map(|file| file.name.to_str().unwrap())
                .find(|name| name.starts_with("truth") && name.ends_with(&end))
                .unwrap();
            let bytes = fs::read(folder.path().join(name)).unwrap();
            let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
            let dimension = if cardiac.is_some() { 4 } else { 3 };
            assert_eq!((short(40), short(48)), (dimension, cardiac.unwrap_or(1)));
            if let Some(gates) = cardiac {
                let seconds = f32::from_le_bytes(bytes[92..96].try_into().unwrap());
                let expected = phantom.cycle().period() as f32 / f32::from(gates);
                assert_eq!(seconds, expected);
                let volumes = bytes[352..].chunks(4 * 8 * 8 * 8).enumerate();
                for (gate, volume) in volumes {
                    let truth = phantom.truth(breath * gates as usize + gate).unwrap();
                    let truth: Vec<u8> = truth.iter().flat_map(|v| v.to_le_bytes()).collect();
                    assert_eq!(volume, truth);
                }
            }
        }
    }
}

/// Counts do not depend on what was computed before: the scale of a given total is the same from gates together and from each.
#[test]
fn noise_of_all_gates_is_independent_of_earlier_calls() {
    for seed in 0..12 {
        let mut scene = Scene::default()
            .with_size(16)
            .with_mode(Mode::Gated { gates: 4 });
        scene.camera.views = 8;
        scene.camera.pitch = [1.0; 2];
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 51 };
        scene.cycle.volume = VolumeRange::EjectionFraction(0.3 + 0.03 * seed as f64);
        scene.pose.rotate_x = 30.0 + 1.7 * seed as f64;
        scene.defects.push(Defect {
            layers: [0.0, 1.0],
            s: [0.2, 0.35],
            azimuths_degrees: [0.0, 70.0],
            activity: 0.03 * seed as f64,
        });
        scene.noise = Some(Noise {
            counts: Counts::Total(1e5),
            seed,
        });
        let fresh = Phantom::new(scene.clone()).unwrap();
        let used = Phantom::new(scene).unwrap();
        for gate in 0..used.n_gates() {
            used.sinograms(gate, &no_observer).unwrap();
        }
        assert_eq!(
            fresh.sinograms_of_gates().unwrap(),
            used.sinograms_of_gates().unwrap(),
            "{seed}"
        );
        // Rounding of the counts hides most differences of the scales.
        for gate in 0..used.n_gates() {
            let scales = [&fresh, &used].map(|of| of.counts_per_unit(gate).unwrap());
            assert_eq!(scales[0], scales[1], "{seed} {gate}");
        }
    }
}

#[test]
fn gates_computed_together_equal_separate_gates() {
    let defect = Defect {
        layers: [0.0, 0.6],
        s: [0.2, 0.4],
        azimuths_degrees: [0.0, 80.0],
        activity: 0.2,
    };
    let around = Background {
        concentration: 0.3,
        centre: [0.0; 2],
        semi_axes: [14.0, 12.0],
    };
    let mut physiological = scene();
    physiological.cycle.curve = VolumeCurve::Physiological;
    let mut with_defect = physiological.clone();
    with_defect.defects.push(defect);
    physiological.background = Some(around);
    let mut with_all = scene();
    with_all.background = Some(around);
    with_all.defects.push(defect);
    let mut blurred = with_all.clone().with_size(6);
    blurred.blur = Some(BlurSettings { fwhm: 1.5 });
    for scene in [scene(), physiological, with_defect, with_all, blurred] {
        // A sum of about six terms, each rounded to 24 bits, in either order.
        let found = differences(&scene);
        assert!(found.iter().all(|worst| *worst < 1e-6), "{found:?}");
    }
}

#[test]
fn gates_without_common_shapes_are_bitwise_identical_to_separate_gates() {
    let mut turning = scene();
    turning.camera.rotation = Rotation::Continuous;
    turning.camera.seconds_per_view = 10.0;
    let collimator = CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    };
    assert_eq!(differences(&turning), [0.0; 2]);
    let mut collimated = scene();
    collimated.collimator = Some(collimator);
    assert_eq!(differences(&collimated)[0], 0.0);
    assert_eq!(differences(&scene().with_mode(Mode::WholeCycle)), [0.0; 2]);
}

#[test]
fn a_shape_that_gates_share_is_computed_once() {
    let work = |together: bool, with_truth: bool| {
        let phantom = Phantom::new(scene()).unwrap();
        if together {
            phantom.sinograms_of_gates().unwrap();
        } else {
            one_by_one(&phantom, |gate| {
                phantom.sinograms(gate, &no_observer).unwrap().samples
            });
        }
        if with_truth && together {
            phantom.truth_of_gates().unwrap();
        } else if with_truth {
            one_by_one(&phantom, |gate| phantom.truth(gate).unwrap());
        }
        phantom.work()
    };
    let (together, alone) = (work(true, false), work(false, false));
    // 16 steps per beat are 9 shapes of a sinusoid; four separate gates need five each.
    assert_eq!((together.shapes_solved, alone.shapes_solved), (9, 9));
    let rays = |work: heart_phantom::WorkReport| work.rays_cast + work.rays_skipped;
    assert_eq!(rays(together), 9 * 4 * 12 * 12);
    assert_eq!(rays(alone), 20 * 4 * 12 * 12);
    let (together, alone) = (work(true, true), work(false, true));
    assert_eq!(together.shapes_solved, alone.shapes_solved);
    assert!(together.voxels_cut < alone.voxels_cut);
}

#[test]
fn gates_computed_together_are_bitwise_independent_of_threads() {
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let phantom = Phantom::new(scene()).unwrap();
            [
                phantom.sinograms_of_gates().unwrap(),
                phantom.truth_of_gates().unwrap(),
            ]
        })
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn reused_buffers_give_bitwise_identical_results_and_must_have_the_length() {
    let mut around = scene();
    around.background = Some(Background {
        concentration: 0.3,
        centre: [0.0; 2],
        semi_axes: [14.0, 12.0],
    });
    let mut turning = scene();
    turning.camera.rotation = Rotation::Continuous;
    for scene in [scene(), around, turning] {
        let phantom = Phantom::new(scene).unwrap();
        let [views, volumes] = [
            phantom.sinograms_of_gates().unwrap(),
            phantom.truth_of_gates().unwrap(),
        ];
        let mut dirty = vec![f32::NAN; views.len()];
        phantom.sinograms_of_gates_into(&mut dirty).unwrap();
        assert_eq!(dirty, views);
        let mut dirty = vec![f32::NAN; volumes.len()];
        phantom.truth_of_gates_into(&mut dirty).unwrap();
        assert_eq!(dirty, volumes);
        for len in [0, volumes.len() - 1, volumes.len() + 1] {
            let given = &mut vec![0.0f32; len];
            let refused = phantom.truth_of_gates_into(given);
            assert!(matches!(refused, Err(PhantomError::WrongLength { .. })));
            let refused = phantom.sinograms_of_gates_into(given);
            assert!(matches!(refused, Err(PhantomError::WrongLength { .. })));
        }
    }
}
