//! Benches of the phantom group: the sinogram of the posed wall from exact chords, and by the usual method with voxels and a projector, on the same
//! camera; the time average against the number of phases. Errors are printed beside the times.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::hint::black_box;
use std::time::Instant;

use benches::{Effort, Row, Time, gaussian_blur, on_threads, timed};
use criterion::Criterion;
use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{Accuracy, Mode};
use heart_phantom::{BinSample, Phantom, no_observer, scene};
use heart_study::StudyOptions;
use radon::{
    Kernel, LinearOperator, Projector, SliceAxis, SpectGeometry, SpectOperator, SpectOptions,
    StackOrder,
};
use rayon::prelude::*;

const WALL: [f64; 2] = [0.0, 1.0];
const STILL: Mode = Mode::Static { phase: 0.0 };

/// Views of the posed wall.
struct Scene {
    phantom: Phantom,
}

impl Scene {
    fn new(views: usize, size: usize, nodes: usize) -> Self {
        let mut scene = heart_phantom::Scene::default()
            .with_size(size)
            .with_mode(STILL);
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes };
        scene.camera.views = views;
        let phantom = Phantom::new(scene).expect("a scene");
        Self { phantom }
    }

    /// The phantom in a mode with a number of steps per cycle; it shares the solved shapes.
    fn with(&self, mode: Mode, steps: usize) -> Phantom {
        let mut scene = self.phantom.scene().clone().with_mode(mode);
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        self.phantom.with_scene(scene).expect("a scene")
    }

    fn exact(&self, mode: Mode, steps: usize) -> Vec<f32> {
        views(&self.with(mode, steps))
    }

    /// Voxel averages, then Joseph's projector: the usual method without exact chords.
    fn voxels(&self, projector: &Projector) -> Vec<f32> {
        let volume = self.with(STILL, 8).truth(0).expect("reachable gains");
        projector
            .stack_operator(self.phantom.camera().n_rows(), StackOrder::ViewSliceBin)
            .and_then(|a| a.forward(&volume))
            .expect("lengths fit")
    }

    fn projector(&self) -> Projector {
        let camera = self.phantom.camera();
        Projector::new(camera.geometry(), camera.image(), Kernel::Joseph).expect("valid geometry")
    }
}

/// Relative Euclidean distance.
fn distance(a: &[f32], b: &[f32]) -> f64 {
    let square = |v: f64| v * v;
    let difference: f64 = a.iter().zip(b).map(|(a, b)| square(f64::from(a - b))).sum();
    let norm: f64 = b.iter().map(|b| square(f64::from(*b))).sum();
    (difference / norm).sqrt()
}

fn phantom(c: &mut Criterion) {
    let mut group = c.benchmark_group("phantom/static-sinogram-24x128");
    group.sample_size(10);
    let scene = Scene::new(24, 128, 801);
    let exact = scene.exact(STILL, 8);
    let projector = scene.projector();
    let error = distance(&scene.voxels(&projector), &exact);
    println!("phantom,static,voxels and joseph,relative error {error:.2e}");
    // Voxels of 1.25 mm under point rays: the error of the silhouette is a fraction of a voxel.
    assert!(error < 0.05);
    group.bench_function("exact chords", |b| {
        b.iter(|| black_box(&scene).exact(STILL, 8))
    });
    group.bench_function("voxels and joseph", |b| {
        b.iter(|| black_box(&scene).voxels(&projector))
    });
    group.finish();

    let mut group = c.benchmark_group("phantom/whole-cycle-6x64");
    group.sample_size(10);
    let scene = Scene::new(6, 64, 801);
    let reference = scene.exact(Mode::WholeCycle, 512);
    println!("phantom,whole cycle,points,seconds,relative error");
    let mut last = f64::INFINITY;
    for points in [8, 16, 32, 64] {
        let start = Instant::now();
        let error = distance(&scene.exact(Mode::WholeCycle, points), &reference);
        let seconds = start.elapsed().as_secs_f64();
        println!("phantom,whole cycle,{points},{seconds:.4},{error:.2e}");
        assert!(error < last, "more phases, smaller error");
        last = error;
        group.bench_function(format!("{points} phases"), |b| {
            b.iter(|| black_box(&scene).exact(Mode::WholeCycle, points))
        });
    }
    group.finish();
}

/// A camera's sinogram of the wall, its average over a cycle against the number of phases, and whole studies.
fn rows(effort: Effort) {
    let row = |method: &str, case: &str, size: usize, threads: usize, run: (Time, f64)| {
        Row {
            study: "whole study",
            method,
            case,
            size,
            threads,
            seconds: run.0,
            error: run.1,
            error_kind: "relative L2",
        }
        .print();
    };
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[64],
        Effort::Full => &[32, 64, 128],
    };
    for &size in sizes {
        let scene = Scene::new(24, size, 801);
        let case = "24 views of the posed wall, at rest";
        let exact = scene.exact(STILL, 8);
        // The reference for the exact chords of 801 nodes has four times as many nodes.
        let truth = Scene::new(24, size, 3201).exact(STILL, 8);
        let projector = scene.projector();
        for &threads in benches::threads() {
            let (seconds, _) = on_threads(threads, || timed(effort, || scene.exact(STILL, 8)));
            let run = (seconds, distance(&exact, &truth));
            row("exact chords", case, size, threads, run);
            let (seconds, voxels) =
                on_threads(threads, || timed(effort, || scene.voxels(&projector)));
            let run = (seconds, distance(&voxels, &truth));
            row("voxels, then Joseph", case, size, threads, run);
        }
    }
    let points: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[8, 16, 32],
        Effort::Full => &[4, 8, 16, 32, 64, 128],
    };
    let scene = Scene::new(6, 64, 801);
    let truth = scene.exact(Mode::WholeCycle, 512);
    for &points in points {
        for &threads in benches::threads() {
            let (seconds, mean) = on_threads(threads, || {
                timed(effort, || scene.exact(Mode::WholeCycle, points))
            });
            let run = (seconds, distance(&mean, &truth));
            let case = "6 views of 64 x 64, averaged over a beat";
            row("equally spaced phases", case, points, threads, run);
        }
    }
    papers(effort);
    gated_studies(effort);
    collimated(effort);
}

/// Exact views of a static heart through a collimator, with and without a chest around it.
fn through_a_collimator(size: usize, chest: bool, tolerance: f64) -> Phantom {
    let mut scene = heart_phantom::Scene::default()
        .with_size(size)
        .with_mode(heart_phantom::Mode::Static { phase: 0.0 });
    scene.camera.views = 64;
    scene.camera.arc = 360.0;
    scene.camera.pitch = [51.2 / size as f64; 2];
    scene.camera.radius = heart_phantom::Orbit::Circle(24.0);
    scene.collimator = Some(scene::CollimatorSettings {
        holes: scene::HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    scene.acquisition.accuracy = heart_phantom::Accuracy::Tolerance(tolerance);
    scene.camera.samples = Some(BinSample::Centres);
    if chest {
        scene.chest = Some(heart_phantom::Chest::default());
    }
    Phantom::new(scene).expect("a scene")
}

fn views(phantom: &Phantom) -> Vec<f32> {
    phantom.sinograms(0, &no_observer).expect("views").samples
}

/// A simple method for the same views: exact integrals between planes of the thickness of a bin, each blurred separately.
fn every_plane_by_itself(phantom: &Phantom) -> Vec<f32> {
    const REACH: f64 = 12.8;
    let camera = phantom.camera();
    let (n_bins, n_rows) = (camera.n_bins(), camera.n_rows());
    let shape = phantom.shape(0.0).expect("a shape");
    let response = phantom
        .scene()
        .collimator
        .expect("a collimator")
        .response()
        .expect("holes");
    let radii = phantom.radii().expect("a circle");
    let n = (2.0 * REACH / camera.pitch()).ceil() as usize;
    let plane = |k: usize| (k as f64 / n as f64 - 0.5) * 2.0 * REACH;
    let planes: Vec<f64> = (1..n).map(plane).collect();
    let view = |view_idx: usize| {
        let angle = camera.geometry().angles()[view_idx];
        let rays = camera.detector().rays(angle).expect("an angle");
        let rays = rays.with_planes(&planes).expect("ascending planes");
        let (slabs, _) = shape.body().project::<f32>(&rays, &WALL).expect("slabs");
        let mut seen = vec![0.0f32; n_bins * n_rows];
        for k in 0..n {
            let image: Vec<f32> = (0..n_rows)
                .flat_map(|row| &slabs[(row * n + k) * n_bins..][..n_bins])
                .copied()
                .collect();
            let distance = radii[view_idx] - 0.5 * (plane(k) + plane(k + 1));
            let pitch = camera.detector().pitch();
            let variance = pitch.map(|pitch| response.variance(distance) / (pitch * pitch));
            let blurred = gaussian_blur(&image, n_bins, variance);
            seen.iter_mut().zip(blurred).for_each(|(sum, v)| *sum += v);
        }
        seen
    };
    (0..camera.n_views())
        .into_par_iter()
        .flat_map_iter(view)
        .collect()
}

/// The exact views, and those of the voxel operator of exact voxels, both as bin averages: the order of the operator.
fn operators(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test => &[16],
        Effort::Quick => &[32, 64],
        Effort::Full => &[64, 128, 256],
    };
    for &size in sizes {
        let mut scene = through_a_collimator(size, false, 5e-4).scene().clone();
        scene.camera.samples = Some(BinSample::Averages);
        let phantom = Phantom::new(scene).expect("a phantom");
        let (exact, volume) = (views(&phantom), phantom.truth(0).expect("a truth"));
        let (camera, radii) = (phantom.camera(), phantom.radii().expect("a circle"));
        let axis = SliceAxis::new(size, camera.pitch()).expect("a pitch");
        let geometry = SpectGeometry::new(camera.geometry(), &axis, radii).expect("an orbit");
        let response = phantom
            .scene()
            .collimator
            .expect("one")
            .response()
            .expect("holes");
        let options = SpectOptions::default().with_collimator(response);
        let operator = SpectOperator::<f32>::new(&geometry, camera.image(), &axis, &options);
        let operator = operator.expect("a geometry");
        let mut made = vec![0.0f32; exact.len()];
        for &threads in benches::threads() {
            let forward = || {
                operator
                    .forward_into(&volume, &mut made)
                    .expect("lengths fit")
            };
            let (seconds, ()) = on_threads(threads, || timed(effort, forward));
            Row {
                study: "SPECT",
                method: "voxel operator on exact voxels",
                case: "64 views of a heart through a collimator, means over bins",
                size,
                threads,
                seconds,
                error: distance(&made, &exact),
                error_kind: "relative L2",
            }
            .print();
        }
    }
}

fn collimated(effort: Effort) {
    operators(effort);
    let sizes: &[usize] = match effort {
        Effort::Test => &[32],
        Effort::Quick => &[64],
        Effort::Full => &[64, 128],
    };
    for &size in sizes {
        let print = |method: &str, case: &str, threads: usize, (seconds, error): (Time, f64)| {
            Row {
                study: "SPECT",
                method,
                case,
                size,
                threads,
                seconds,
                error,
                error_kind: "relative L2",
            }
            .print();
        };
        for (chest, case) in [
            (false, "64 exact views of a heart through a collimator"),
            (
                true,
                "64 exact views of a heart in a chest through a collimator",
            ),
        ] {
            let finest = match effort {
                Effort::Test => 5e-4,
                Effort::Quick | Effort::Full => 5e-5,
            };
            let truth = views(&through_a_collimator(size, chest, finest));
            for &threads in benches::threads() {
                for (tolerance, method) in [(5e-4, "tolerance 5e-4"), (5e-3, "tolerance 5e-3")] {
                    let made = || views(&through_a_collimator(size, chest, tolerance));
                    let (seconds, made) = on_threads(threads, || timed(effort, made));
                    print(method, case, threads, (seconds, distance(&made, &truth)));
                }
                if !chest {
                    let plain = || every_plane_by_itself(&through_a_collimator(size, chest, 5e-4));
                    let (seconds, made) = on_threads(threads, || timed(effort, plain));
                    let method = "every plane by itself";
                    print(method, case, threads, (seconds, distance(&made, &truth)));
                }
            }
        }
    }
}

/// `cargo paper --no-figures` from start to end, including files; the error is that of its static reconstruction.
fn papers(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[64],
        Effort::Full => &[64, 128, 256],
    };
    let folder = std::env::temp_dir().join(format!("benches-paper-{}", std::process::id()));
    for &size in sizes {
        for &threads in benches::threads() {
            let mut options = StudyOptions::default();
            (options.size, options.figures) = (size, false);
            let run = || heart_study::run(&options, &folder, &no_observer).expect("a study");
            let (seconds, report) = on_threads(threads, || timed(effort, run));
            Row {
                study: "whole study",
                method: "cargo paper --no-figures",
                case: "three acquisitions of 90 views, with files",
                size,
                threads,
                seconds,
                error: report.ram_lak.r#static.quality.rmse_truth.expect("a truth"),
                error_kind: "rms of the static one",
            }
            .print();
        }
    }
    std::fs::remove_dir_all(&folder).expect("its own folder");
}

/// 16 gates of 64 views, each reconstructed; the error is that of the first gate's volume, against the mean over the gate.
fn gated_studies(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[32],
        Effort::Full => &[32, 64, 128],
    };
    for &size in sizes {
        let mut scene = heart_phantom::Scene::default()
            .with_size(size)
            .with_mode(heart_phantom::Mode::Gated { gates: 16 });
        scene.camera.views = 64;
        let volumes = || {
            let phantom = Phantom::new(scene.clone()).expect("a scene");
            let volumes: Result<Vec<_>, _> = (0..phantom.n_gates())
                .map(|gate| phantom.volume(gate))
                .collect();
            (phantom, volumes.expect("reachable gains"))
        };
        for &threads in benches::threads() {
            let (seconds, (phantom, made)) = on_threads(threads, || timed(effort, volumes));
            let truth = phantom.truth(0).expect("a gate");
            let found = phantom
                .artefacts(0, &made[0], &truth)
                .expect("volumes that fit");
            Row {
                study: "whole study",
                method: "views and reconstructions",
                case: "16 gates of 64 views",
                size,
                threads,
                seconds,
                error: found.rmse.expect("a truth"),
                error_kind: "rms of the first gate",
            }
            .print();
        }
    }
}

fn main() {
    benches::run(rows, &[phantom]);
}
