//! Throughput of chords, views and voxels for a dilated two-membrane body.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use revolve_voxel::nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Lines, Meridian, ParallelDetector, PointRaster, Pose, Ray, VoxelGrid};
use std::f64::consts::{FRAC_PI_4, PI};

/// A balloon that bulges, also behind its base.
fn balloon(radius: f64, n: usize) -> Meridian {
    let h = 9.5 + radius;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| {
            let u = k as f64 / n as f64;
            [
                h * (1.0 - (0.5 * PI * u).cos()) - 0.5 * (PI * u).sin(),
                if k == n {
                    0.0
                } else {
                    radius * (0.5 * PI * u).cos() + 1.6 * (PI * u).sin()
                },
            ]
        })
        .collect();
    Meridian::new(&points).unwrap()
}

/// Processor seconds used by all threads so far, comparable on a busy machine (Linux; zero elsewhere).
fn cpu() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return 0.0;
    };
    tasks
        .flatten()
        .filter_map(|t| std::fs::read_to_string(t.path().join("schedstat")).ok())
        .filter_map(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .sum::<f64>()
        * 1e-9
}

struct Clock(std::time::Instant, f64);

impl Clock {
    fn start() -> Self {
        Self(std::time::Instant::now(), cpu())
    }
    /// Wall and processor seconds.
    fn read(&self) -> (f64, f64) {
        (self.0.elapsed().as_secs_f64(), cpu() - self.1)
    }
}

fn main() {
    let pose = Pose::axis_along_z(5.625)
        .unwrap()
        .rotated_x(FRAC_PI_4)
        .unwrap()
        .rotated_y(FRAC_PI_4)
        .unwrap();
    let detector = ParallelDetector::new(256, 256, [0.0625; 2]).unwrap();
    for threads in [1, 2] {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            for n in [200, 2000, 20000] {
                let outer = Body::new(vec![balloon(2.75, n)], pose).unwrap();
                let both = Body::new(vec![balloon(1.75, n), balloon(2.75, n)], pose).unwrap();
                let mut out = vec![0.0f32; 256 * 256];
                let clock = Clock::start();
                let (mut hit, mut cast) = (0, 0);
                for k in 0..90 {
                    let rays = detector.rays(k as f64 * PI / 90.0).unwrap();
                    let c = outer.project_add(&rays, &[1.0], 1.0, &mut out).unwrap();
                    hit += c.hit;
                    cast += c.cast;
                }
                let (t, cpu) = clock.read();
                println!("{threads} threads, {n} segments: {:.1} M chords/s, {:.1} per processor second ({hit} hit, {cast} cast)", hit as f64 / t * 1e-6, hit as f64 / cpu * 1e-6);
                let clock = Clock::start();
                for k in 0..90 {
                    let rays = detector.rays(k as f64 * PI / 90.0).unwrap();
                    both.project_add(&rays, &[0.0, 1.0], 1.0, &mut out).unwrap();
                }
                println!("    90 views, both membranes: {:.4?} s (wall, processor)", clock.read());
                // A cone beam from 60 cm to a detector at 40 cm, and the parallel rays as a list.
                let clock = Clock::start();
                for k in 0..90 {
                    let (sin, cos) = (k as f64 * PI / 90.0).sin_cos();
                    let (u, v, d) = (Vector3::new(cos, sin, 0.0), Vector3::z(), Vector3::new(-sin, cos, 0.0));
                    let step = 0.0625 * 100.0 / 60.0;
                    let detector = PointRaster {
                        first: Point3::from(d * 40.0 - (u + v) * (127.5 * step)),
                        bin_step: u * step,
                        row_step: v * step,
                    };
                    let cone = Lines::between([256; 2], Point3::from(d * -60.0), detector).unwrap();
                    both.project_add(&cone, &[0.0, 1.0], 1.0, &mut out).unwrap();
                }
                println!("    90 cone-beam views, both membranes: {:.4?} s (wall, processor)", clock.read());
                let list = |k: usize| {
                    let rays = detector.rays(k as f64 * PI / 90.0).unwrap();
                    let every = (0..256 * 256).map(|k| rays.ray(k % 256, k / 256).unwrap());
                    Lines::each([256; 2], every.collect::<Vec<Ray>>()).unwrap()
                };
                let lists: Vec<Lines> = (0..90).map(list).collect();
                let clock = Clock::start();
                for lines in &lists {
                    both.project_add(lines, &[0.0, 1.0], 1.0, &mut out).unwrap();
                }
                println!("    90 views as lists, both membranes: {:.4?} s (wall, processor)", clock.read());
                let grid = VoxelGrid::cube(256, 0.0625).unwrap();
                if n <= 200 {
                let clock = Clock::start();
                let (v, c) = both
                    .voxelize::<f32>(&grid, 1e-3, &[0.0, 1.0])
                    .unwrap();
                let (t, cpu) = clock.read();
                let sum = v.iter().map(|&v| f64::from(v)).sum::<f64>() * grid.voxel_volume();
                let error = sum / both.region_measures(1).unwrap().volume - 1.0;
                println!("    256^3 coverage: {t:.4} s wall, {cpu:.4} s processor, volume error {error:.2e}, {c:?}");
                }
            }
        });
    }
}
