//! The largest heap memory of a run against its prediction. A separate program, because the counter applies to the process.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use heart_phantom::files::Format;
use heart_phantom::scene::{CollimatorSettings, DiscretisationSettings, HolesSettings};
use heart_phantom::{
    Accuracy, Attenuation, Counts, Defect, GateFiles, Medium, Method, Mode, Noise, Osem, Product,
    Scene, Twist,
};
use heart_phantom::{Phantom, no_observer, run};
use peak_alloc::PeakAlloc;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Largest heap memory during `work` in addition to that before.
fn peak(work: impl FnOnce()) -> u64 {
    HEAP.reset_peak_usage();
    let before = HEAP.current_usage();
    work();
    (HEAP.peak_usage() - before) as u64
}

fn scene(mode: Mode, size: usize) -> Scene {
    let mut scene = Scene::default().with_size(size).with_mode(mode);
    scene.camera.views = 60;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene
}

/// A single test, because tests run concurrently.
#[test]
fn memory_does_not_exceed_its_prediction() {
    // Work arrays that a thread keeps are not part of a shape.
    pool(1).install(shapes_are_as_large_as_was_said);
    pool(2).install(runs_take_what_was_said);
}

fn pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new();
    builder.num_threads(threads).build().unwrap()
}

fn runs_take_what_was_said() {
    let mut noisy = scene(Mode::WholeCycle, 64);
    noisy.noise = Some(Noise {
        counts: Counts::Total(1e6),
        seed: 1,
    });
    let mut one = scene(Mode::Exposure { seconds: 0.3 }, 16);
    one.cycle.beats_per_minute = 61.73456789;
    one.output.write = vec![Product::Projections];
    let mut all = scene(Mode::Gated { gates: 2 }, 48);
    all.output.write.push(Product::Labels);
    let mut fine = scene(Mode::WholeCycle, 32);
    fine.acquisition.accuracy = Accuracy::Steps(256);
    let mut modelled = scene(Mode::Static { phase: 0.0 }, 64);
    modelled.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    modelled.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [0.0; 2],
            semi_axes: [12.0, 9.0],
        },
    });
    modelled.reconstruction.method = Method::Osem(Osem {
        attenuation: true,
        resolution: true,
        ..Osem::new(8, 1)
    });
    let mut lines = scene(Mode::Static { phase: 0.0 }, 96);
    lines.reconstruction.method = Method::Osem(Osem::new(4, 1));
    let mut dicom = scene(Mode::Gated { gates: 8 }, 64);
    dicom.output.gates = GateFiles::OneFile;
    (dicom.output.projections, dicom.output.volumes) = (Format::Dicom, Format::Dicom);
    let infarct = |discretisation, is_twisted: bool| {
        let mut scene = scene(Mode::WholeCycle, 8);
        scene.heart.discretisation = discretisation;
        (scene.camera.views, scene.camera.pitch) = (2, [1.3; 2]);
        scene.acquisition.accuracy = Accuracy::Steps(128);
        scene.output.write = vec![Product::Projections];
        scene.defects = vec![Defect {
            layers: [0.3, 0.6],
            s: [0.1, 0.4],
            azimuths_degrees: [5.0, 35.0],
            activity: 0.0,
        }];
        scene.twist = is_twisted.then(|| Twist {
            inner_degrees: vec![0.0, 12.0],
            outer_degrees: vec![0.0, 8.0],
        });
        scene
    };
    let spectral = DiscretisationSettings::Spectral {
        degree: 16,
        per_piece: 2,
        tolerance: 1e-4,
    };
    let plain = Scene::default().heart.discretisation;
    for (name, scene, bound) in [
        ("one file", dicom, usize::MAX),
        ("OSEM", modelled, usize::MAX),
        ("OSEM of lines", lines, usize::MAX),
        ("static", scene(Mode::Static { phase: 0.0 }, 96), usize::MAX),
        ("whole cycle", scene(Mode::WholeCycle, 96), usize::MAX),
        ("noise", noisy, usize::MAX),
        ("exposures", one.clone(), usize::MAX),
        ("exposures in 2 MB", one, 2_000_000),
        ("gates", all, usize::MAX),
        ("fine steps", fine, usize::MAX),
        ("defect", infarct(plain, false), usize::MAX),
        ("twisted", infarct(spectral, true), usize::MAX),
        ("twisted in 16 MB", infarct(spectral, true), 16_000_000),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let phantom = Phantom::new(scene).unwrap().with_memory(bound);
        let said = phantom.memory();
        let found = peak(|| {
            run(&phantom, folder.path(), &no_observer).unwrap();
        });
        println!("{name}: {found} of {said:?} = {}", said.total());
        // Work arrays of about 2 MB per thread are not included.
        assert!(
            found <= said.total().min(bound as u64) + (8 << 20),
            "{name}: {found} of {said:?}"
        );
        assert!(said.total() <= 3 * found, "{name}: {found} of {said:?}");
    }
}

fn shapes_are_as_large_as_was_said() {
    let differences = |nodes| DiscretisationSettings::Differences { nodes };
    let spectral = |tolerance| DiscretisationSettings::Spectral {
        degree: 16,
        per_piece: 1,
        tolerance,
    };
    for discretisation in [
        differences(101),
        differences(801),
        differences(3201),
        spectral(1e-2),
        spectral(1e-4),
        spectral(1e-6),
    ] {
        let mut scene = Scene::default();
        scene.heart.discretisation = discretisation;
        let phantom = Phantom::new(scene).unwrap();
        let heart = phantom.heart();
        let said = heart.shape_bytes();
        heart.shapes(&[0.5]).unwrap();
        let before = HEAP.current_usage();
        // So many that their list is a small part.
        let gains: Vec<f64> = (1..=24).map(|k| 0.02 * f64::from(k)).collect();
        heart.shapes(&gains).unwrap();
        let found = (HEAP.current_usage() - before) / gains.len();
        println!("{discretisation:?}: {found} of {said}");
        assert!(
            found < said + 4096 && said < 2 * found,
            "{discretisation:?}: {found} of {said}"
        );
    }
}
