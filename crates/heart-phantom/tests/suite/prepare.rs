//! Errors come before any view, with the field; planned files are written, and no others.

use heart_phantom::files::Format;
use heart_phantom::scene::*;
use heart_phantom::*;
use heart_phantom::{Phantom, PhantomError, Uptake, no_observer, run};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

fn small(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_size(12).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 41 };
    scene.camera.views = 6;
    scene.acquisition.accuracy = Accuracy::Steps(4);
    scene
}

fn defect() -> Defect {
    Defect {
        layers: [0.2, 0.8],
        s: [0.1, 0.4],
        azimuths_degrees: [0.0, 90.0],
        activity: 0.5,
    }
}

/// Scenes whose fields are within their ranges, but which cannot be run, with the responsible field.
fn hopeless() -> Vec<(Scene, &'static str)> {
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = small(Mode::WholeCycle);
        change(&mut scene);
        scene
    };
    vec![
        // Directions of 0, 180.3 and 360.7 degrees: nearly the same.
        (
            with(&|scene| (scene.camera.views, scene.camera.arc) = (3, 541.0)),
            "camera.arc",
        ),
        (
            with(&|scene| {
                scene.heart.inner.length = 1.7623;
                scene.heart.inner.radius = 2.4789;
                scene.defects = vec![defect()];
            }),
            "defects",
        ),
        (
            with(&|scene| {
                // Thinner than rounding.
                let layers = [0.5, 0.5 + 1e-15];
                scene.defects = vec![defect(), Defect { layers, ..defect() }];
            }),
            "defects.2",
        ),
        (
            with(&|scene| {
                scene.background = Some(Background {
                    concentration: 0.1,
                    centre: [0.0; 2],
                    semi_axes: [7.0, 3.0],
                });
            }),
            "background.semi_axes",
        ),
        (
            with(&|scene| {
                (scene.heart.outer.length, scene.heart.outer.radius) = (14.0, 1.77);
            }),
            "heart",
        ),
        (
            with(&|scene| scene.acquisition.accuracy = Accuracy::Tolerance(1e-6)),
            "acquisition.accuracy.tolerance",
        ),
        (
            with(&|scene| {
                scene.noise = Some(Noise {
                    counts: Counts::Total(1e6),
                    seed: 1,
                });
                scene.pose.shift = [0.0, 0.0, 100.0];
            }),
            "noise.counts.total",
        ),
        (
            with(&|scene| {
                scene.noise = Some(Noise {
                    counts: Counts::Total(1e6),
                    seed: 1,
                });
                scene.activity.wall = Uptake::Concentration(0.0);
            }),
            "noise.counts.total",
        ),
    ]
}

#[test]
fn invalid_runs_are_rejected_before_any_view_with_the_field() {
    for (scene, expected) in hopeless() {
        scene.check().unwrap();
        let phantom = Phantom::new(scene.clone()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        fs::create_dir(&out).unwrap();
        let older = "{\"program\": \"heart-phantom 0.1.0\", \"files\": [\"truth.npy\"]}";
        fs::write(out.join("report.json"), older).unwrap();
        fs::write(out.join("truth.npy"), "older").unwrap();
        let error = run(&phantom, &out, &no_observer).unwrap_err();
        let PhantomError::Rejected {
            field,
            file: None,
            place: None,
            ..
        } = &error
        else {
            panic!("{expected}: {error:?}")
        };
        assert_eq!(field, expected, "{error}");
        assert_eq!(error.to_string(), expected);
        // No rays (except coarse views for a tolerance, and the first views with counts for a total), and the files of an earlier run are
        // unchanged.
        let tried = expected.starts_with("acquisition") || expected.starts_with("noise");
        assert!(tried || phantom.work().rays_cast == 0, "{expected}");
        assert_eq!(phantom.work().slices_reconstructed, 0);
        assert_eq!(fs::read_to_string(out.join("truth.npy")).unwrap(), "older");
        assert!(out.join("report.json").exists());
        // The same from a file, with the place.
        let path = folder.path().join("scene.toml");
        fs::write(&path, scene.to_toml()).unwrap();
        let again = Phantom::load(&path).unwrap().prepare().unwrap_err();
        let PhantomError::Rejected {
            field: same,
            file: Some(file),
            place: Some([line, _]),
            ..
        } = &again
        else {
            panic!("{again:?}")
        };
        assert_eq!((same, file), (field, &path));
        let text = scene.to_toml();
        let at = text.lines().nth(line - 1).unwrap();
        let name = expected
            .split('.')
            .rfind(|part| part.parse::<usize>().is_err());
        let last = name.unwrap();
        assert!(
            at.contains(last) || at.contains("counts"),
            "{expected}: {at}"
        );
    }
}

/// The same scenes without the cause of the error can be run.
#[test]
fn valid_variants_of_these_scenes_are_accepted() {
    let mut scene = small(Mode::Gated { gates: 2 });
    scene.defects = vec![defect(), defect()];
    scene.camera.arc = 360.0;
    scene.background = Some(Background {
        concentration: 0.1,
        centre: [0.0; 2],
        semi_axes: [8.0, 9.0],
    });
    scene.noise = Some(Noise {
        counts: Counts::Total(1e4),
        seed: 1,
    });
    scene.acquisition.accuracy = Accuracy::Tolerance(0.05);
    let phantom = Phantom::new(scene).unwrap();
    phantom.prepare().unwrap();
    let folder = tempfile::tempdir().unwrap();
    run(&phantom, folder.path(), &no_observer).unwrap();
}

/// Errors of a reconstruction alone do not prevent a run without one.
#[test]
fn only_requested_products_are_validated() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, field) in hopeless() {
        let needs = [
            "camera.arc",
            "noise.counts.total",
            "acquisition.accuracy.tolerance",
        ];
        let needs = needs.contains(&field);
        let mut scene = scene;
        scene.output.write = vec![Product::Labels];
        let phantom = Phantom::new(scene).unwrap();
        let out = folder.path().join(field);
        assert_eq!(run(&phantom, &out, &no_observer).is_ok(), needs, "{field}");
    }
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<PathBuf> = (fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().file_name().into())
        .collect();
    names.sort();
    names
}

fn any_output() -> impl Strategy<Value = Output> {
    let all = vec![
        Product::Projections,
        Product::Reconstruction,
        Product::Truth,
        Product::Labels,
        Product::Attenuation,
        Product::Meshes,
        Product::Pictures,
    ];
    let n = all.len();
    let projections: Vec<Format> = (Format::ALL.into_iter())
        .filter(|format| format.info().projections.is_some())
        .collect();
    let volumes = prop::sample::select(Vec::from(Format::ALL));
    (
        prop::sample::subsequence(all, 0..=n),
        volumes,
        prop::sample::select(projections),
        any::<bool>(),
    )
        .prop_map(|(write, volumes, projections, one)| Output {
            write,
            volumes,
            projections,
            gates: match one && volumes.info().gates && projections.info().gates {
                true => GateFiles::OneFile,
                false => GateFiles::Each,
            },
            ..Output::default()
        })
}

fn any_mode() -> impl Strategy<Value = Mode> {
    prop_oneof![
        Just(Mode::Static { phase: 0.3 }),
        Just(Mode::Instants),
        Just(Mode::WholeCycle),
        Just(Mode::Gated { gates: 1 }),
        Just(Mode::Gated { gates: 3 }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Runs in the same directory one after the other: it contains the planned files of the last one, and foreign files.
    #[test]
    fn a_directory_contains_the_planned_files(
        runs in prop::collection::vec((any_mode(), any_output()), 1..4),
    ) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("notes.txt"), "mine").unwrap();
        for (mode, output) in runs {
            let mut scene = small(mode);
            scene.output = output;
            scene.truth.tolerance = 0.02;
            scene.attenuation = Some(Attenuation {
                coefficient: 0.1,
                medium: Medium::Heart,
            });
            let phantom = Phantom::new(scene).unwrap();
            let planned = phantom.files().unwrap();
            let report = run(&phantom, folder.path(), &no_observer).unwrap();
            let mut expected: Vec<PathBuf> = planned.iter().map(|file| file.name.clone()).collect();
            expected.sort();
            let mut written = report.files.clone();
            written.sort();
            prop_assert_eq!(&written, &expected);
            expected.push("notes.txt".into());
            expected.sort();
            prop_assert_eq!(names(folder.path()), expected);
            for file in planned {
                let size = fs::metadata(folder.path().join(&file.name)).unwrap().len();
                let ending = file.name.extension().unwrap().to_str().unwrap();
                match ending {
                    // Not known before the run.
                    _ if file.bytes == 0 => {}
                    "stl" => prop_assert_eq!(size, file.bytes),
                    // Compressed; incompressible data have the overhead of their format.
                    "gz" | "png" | "gif" => prop_assert!(size < file.bytes * 9 / 8 + 2048),
                    // An archive has a header for each of its arrays, and a directory.
                    "npz" => prop_assert!((file.bytes..file.bytes + 4096).contains(&size)),
                    // Overhead per frame and per file.
                    "dcm" => prop_assert!((file.bytes..file.bytes + 4096).contains(&size), "{file:?} {size}"),
                    _ => prop_assert!((file.bytes..file.bytes + 1024).contains(&size), "{file:?} {size}"),
                }
            }
        }
    }
}

/// A directory in place of a file is detected before anything is written.
#[test]
fn an_obstructing_directory_is_detected_before_any_view() {
    for name in ["projections.npy", "truth.npy", "report.json"] {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(name)).unwrap();
        let phantom = Phantom::new(small(Mode::WholeCycle)).unwrap();
        let error = run(&phantom, folder.path(), &no_observer).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        assert_eq!(phantom.work().rays_cast, 0);
        assert_eq!(names(folder.path()), [PathBuf::from(name)]);
    }
}

/// The heart is largest in the middle of the cycle, where surfaces have the most triangles.
#[test]
fn surfaces_of_many_gates_have_the_predicted_sizes() {
    const GATES: usize = 300;
    let mut scene = small(Mode::Gated { gates: GATES });
    scene.output.write = vec![Product::Meshes];
    scene.output.mesh_tolerance = 0.05;
    let phantom = Phantom::new(scene).unwrap();
    let planned = phantom.files().unwrap();
    let told = |gate: usize, surface: &str| {
        let name = PathBuf::from(format!("{surface}-gate-{gate:03}.stl"));
        planned.iter().find(|file| file.name == name).unwrap().bytes
    };
    // Every fifth, and the largest; STL has 84 bytes, and 50 per triangle.
    for gate in (0..GATES).step_by(5) {
        let meshes = phantom.meshes((gate as f64 + 0.5) / GATES as f64).unwrap();
        for (surface, mesh) in ["inner", "outer"].into_iter().zip(&meshes) {
            assert_eq!(told(gate, surface), 84 + 50 * mesh.triangles.len() as u64);
        }
    }
    assert!(told(GATES / 2, "inner") > told(0, "inner"));
}

/// A single gate is a file with an axis of gates, too: formats without gates are rejected by the scene.
#[test]
fn one_gate_in_one_file_needs_a_format_with_gates() {
    let mut scene = small(Mode::Gated { gates: 1 });
    scene.output.gates = GateFiles::OneFile;
    scene.output.projections = Format::InterfileStir;
    let error = scene.check().unwrap_err().to_string();
    assert!(error.contains("output.projections"), "{error}");
    scene.output.projections = Format::InterfileSimind;
    let folder = tempfile::tempdir().unwrap();
    run(&Phantom::new(scene).unwrap(), folder.path(), &no_observer).unwrap();
}
