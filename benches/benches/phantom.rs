//! Benches of the phantom group: the sinogram of the posed wall from exact chords, and by the usual way over voxels and a
//! projector, on the same camera; the time average against the number of phases. Errors are printed beside the times.

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use heart_phantom::{Acquisition, Camera, Cycle, Heart, acquire, truth};
use radon::{Kernel, Projector, StackOrder};

const WALL: [f64; 2] = [0.0, 1.0];
const STILL: Acquisition = Acquisition::Static { phase: 0.0 };

struct Scene {
    heart: Heart,
    camera: Camera,
    cycle: Cycle,
}

impl Scene {
    fn new(views: usize, size: usize) -> Self {
        Self {
            heart: Heart::study(801).expect("enough nodes"),
            camera: Camera::new(views, size, 16.0).expect("positive sizes"),
            cycle: Cycle::new(65.0, 0.6).expect("a living heart"),
        }
    }

    fn exact(&self, acquisition: Acquisition) -> Vec<f32> {
        let (heart, camera, cycle) = (&self.heart, &self.camera, &self.cycle);
        acquire(heart, camera, cycle, acquisition, WALL, &|_| ())
            .expect("reachable gains")
            .samples
    }

    /// Voxel averages, then Joseph's projector: what one does without exact chords.
    fn voxels(&self, projector: &Projector) -> Vec<f32> {
        let (heart, camera, cycle) = (&self.heart, &self.camera, &self.cycle);
        let volume = truth(heart, camera, cycle, STILL, WALL, 1e-3).expect("reachable gains");
        projector
            .forward_stack(&volume, camera.n_rows(), StackOrder::ViewSliceBin)
            .expect("lengths fit")
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
    let scene = Scene::new(24, 128);
    let exact = scene.exact(STILL);
    let projector = Projector::new(
        scene.camera.geometry(),
        scene.camera.image(),
        Kernel::Joseph,
    )
    .expect("valid geometry");
    let error = distance(&scene.voxels(&projector), &exact);
    println!("phantom,static,voxels and joseph,relative error {error:.2e}");
    // Voxels of 1.25 mm under point rays: the silhouette is off by a share of a voxel.
    assert!(error < 0.05);
    group.bench_function("exact chords", |b| {
        b.iter(|| black_box(&scene).exact(STILL))
    });
    group.bench_function("voxels and joseph", |b| {
        b.iter(|| black_box(&scene).voxels(&projector))
    });
    group.finish();

    let mut group = c.benchmark_group("phantom/whole-cycle-6x64");
    group.sample_size(10);
    let scene = Scene::new(6, 64);
    let reference = scene.exact(Acquisition::WholeCycle { points: 512 });
    println!("phantom,whole cycle,points,seconds,relative error");
    let mut last = f64::INFINITY;
    for points in [8, 16, 32, 64] {
        let average = Acquisition::WholeCycle { points };
        let start = Instant::now();
        let error = distance(&scene.exact(average), &reference);
        let seconds = start.elapsed().as_secs_f64();
        println!("phantom,whole cycle,{points},{seconds:.4},{error:.2e}");
        assert!(error < last, "more phases, smaller error");
        last = error;
        group.bench_function(format!("{points} phases"), |b| {
            b.iter(|| black_box(&scene).exact(average))
        });
    }
    group.finish();
}

criterion_group!(benches, phantom);
criterion_main!(benches);
