//! Benches of the revolve group: chords, views and voxels of a dilated two-membrane body, compared with other methods on the same input.
//!
//! Each bench first asserts its result; errors are printed with the times.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::f64::consts::{FRAC_PI_4, PI};
use std::hint::black_box;

use benches::{Effort, Row, Time, on_threads, timed};
use criterion::{Criterion, Throughput};
use nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Lines, Meridian, ParallelDetector, PointRaster, Pose, Ray, VoxelGrid};

/// A balloon that bulges, also behind its base.
fn profile(radius: f64, n: usize) -> Vec<[f64; 2]> {
    let h = 9.5 + radius;
    (0..=n)
        .map(|k| {
            let u = k as f64 / n as f64;
            let r = radius * (0.5 * PI * u).cos() + 1.6 * (PI * u).sin();
            [
                h * (1.0 - (0.5 * PI * u).cos()) - 0.5 * (PI * u).sin(),
                if k == n { 0.0 } else { r },
            ]
        })
        .collect()
}

fn pose() -> Pose {
    Pose::axis_along_z(5.625)
        .and_then(|p| p.rotated_x(FRAC_PI_4)?.rotated_y(FRAC_PI_4))
        .unwrap()
}

fn body(radii: &[f64], n: usize) -> Body {
    let layers = radii
        .iter()
        .map(|&r| Meridian::new(&profile(r, n)).unwrap());
    Body::new(layers.collect(), pose()).unwrap()
}

/// The method for comparison: every frustum of the profile is clipped and intersected, ray by ray.
fn naive_chord(path: &[[f64; 2]], o: Point3<f64>, d: Vector3<f64>) -> f64 {
    path.windows(2)
        .map(|p| {
            let ([x0, r0], [x1, r1]) = (p[0], p[1]);
            let (a, b) = ((x0 - o.x) / d.x, (x1 - o.x) / d.x);
            let (t0, t1) = (a.min(b), a.max(b));
            let m = (r1 - r0) / (x1 - x0);
            let (g0, g1) = (r0 + m * (o.x - x0), m * d.x);
            let qa = d.y * d.y + d.z * d.z - g1 * g1;
            let qb = o.y * d.y + o.z * d.z - g0 * g1;
            let disc = qb * qb - qa * (o.y * o.y + o.z * o.z - g0 * g0);
            // Division at the roots and tests at the midpoints: steep cones and their mirror images need no special cases.
            let mut cuts = [t0, t1, t1, t1];
            if disc > 0.0 {
                cuts[1] = ((-qb - disc.sqrt()) / qa).max(t0).min(t1);
                cuts[2] = ((-qb + disc.sqrt()) / qa).max(t0).min(t1);
            }
            cuts.sort_by(f64::total_cmp);
            let length: f64 = cuts
                .windows(2)
                .filter(|ab| {
                    let at = o + d * (0.5 * (ab[0] + ab[1]));
                    at.y * at.y + at.z * at.z < (r0 + m * (at.x - x0)).powi(2)
                })
                .map(|ab| ab[1] - ab[0])
                .sum();
            length * (x1 - x0).signum()
        })
        .sum()
}

fn every_ray(rays: &Lines) -> impl Iterator<Item = Ray> {
    let [n_bins, n_rows] = rays.size();
    (0..n_bins * n_rows).map(move |k| {
        let ray = rays.ray(k % n_bins, k / n_bins);
        ray.expect("a ray of the raster")
    })
}

fn naive_view(path: &[[f64; 2]], rays: &Lines) -> Vec<f64> {
    let pose = pose();
    every_ray(rays)
        .map(|ray| {
            let d = pose.vector_to_body(&ray.direction());
            naive_chord(path, pose.to_body(&ray.origin()), d).max(0.0)
        })
        .collect()
}

fn chords(c: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let rays = ParallelDetector::new(256, 256, [0.0625; 2])
        .unwrap()
        .rays(0.7)
        .unwrap();
    let mut group = c.benchmark_group("revolve/chords/256x256");
    group.sample_size(20);
    for n in [200, 2000, 20_000] {
        let outer = body(&[2.75], n);
        let path = profile(2.75, n);
        let (image, counters) = outer.project::<f64>(&rays, &[1.0]).unwrap();
        if n == 200 {
            let twin = naive_view(&path, &rays);
            let worst = image
                .iter()
                .zip(&twin)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            println!("largest difference from the rival: {worst:.1e} cm");
            // Grazing rays have half of the digits.
            assert!(worst < 1e-6);
            group.throughput(Throughput::Elements(counters.hit));
            group.bench_function("naive/200", |b| {
                b.iter(|| naive_view(black_box(&path), black_box(&rays)))
            });
        }
        group.throughput(Throughput::Elements(counters.hit));
        let mut out = vec![0.0f32; 256 * 256];
        group.bench_function(format!("ours/{n}"), |b| {
            pool.install(|| {
                b.iter(|| {
                    outer
                        .project_add(black_box(&rays), &[1.0], 1.0, black_box(&mut out))
                        .unwrap()
                });
            });
        });
    }
    group.finish();
    lines(c, &rays);
}

/// A cone beam of as many lines through the heart, both membranes, and the parallel rays as a list, each on one thread and on all.
fn lines(c: &mut Criterion, rays: &Lines) {
    let both = body(&[1.75, 2.75], 200);
    let middle = rays.ray(128, 128).unwrap();
    let at = |bin, row| rays.ray(bin, row).unwrap().origin();
    let detector = PointRaster {
        first: at(0, 0),
        bin_step: at(1, 0) - at(0, 0),
        row_step: at(0, 1) - at(0, 0),
    };
    let source = middle.origin() - middle.direction() * 57.0;
    let cone = Lines::between([256; 2], source, detector).unwrap();
    let (image, counters) = both.project::<f64>(&cone, &[0.0, 1.0]).unwrap();
    for k in (0..image.len()).step_by(251) {
        let ray = cone.ray(k % 256, k / 256).unwrap();
        let chord = both.chord(1, &ray).unwrap() - both.chord(0, &ray).unwrap();
        assert!((image[k] - chord).abs() < 1e-9, "{} {chord}", image[k]);
    }
    println!("lines that hit the heart: {}", counters.hit);
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build();
    let listed = Lines::each(rays.size(), every_ray(rays).collect::<Vec<Ray>>()).unwrap();
    let mut out = vec![0.0f32; 256 * 256];
    let mut group = c.benchmark_group("revolve/lines/256x256");
    group.sample_size(20);
    group.throughput(Throughput::Elements(256 * 256));
    for &threads in benches::threads() {
        let pool = pool(threads).unwrap();
        let mut bench = |name: &str, project: &(dyn Fn(&mut [f32]) + Sync)| {
            group.bench_function(format!("{name}/{threads} threads"), |b| {
                pool.install(|| b.iter(|| project(black_box(&mut out))));
            });
        };
        bench("cone beam", &|out| {
            both.project_add(&cone, &[0.0, 1.0], 1.0, out)
                .map(drop)
                .unwrap();
        });
        bench("parallel rays one by one", &|out| {
            both.project_add(&listed, &[0.0, 1.0], 1.0, out)
                .map(drop)
                .unwrap();
        });
        bench("parallel rays", &|out| {
            both.project_add(rays, &[0.0, 1.0], 1.0, out)
                .map(drop)
                .unwrap();
        });
    }
    group.finish();
}

fn views(c: &mut Criterion) {
    let detector = ParallelDetector::new(256, 256, [0.0625; 2]).unwrap();
    let mut group = c.benchmark_group("revolve/90-views-both-membranes");
    group.sample_size(10);
    for n in [200, 2000] {
        let both = body(&[1.75, 2.75], n);
        let volume = both.region_measures(1).unwrap().volume;
        let sinogram = |out: &mut [f32]| {
            out.fill(0.0);
            for (k, image) in out.chunks_mut(256 * 256).enumerate() {
                let rays = detector.rays(k as f64 * PI / 90.0).unwrap();
                both.project_add(&rays, &[0.0, 1.0], 1.0, image).unwrap();
            }
        };
        let mut out = vec![0.0f32; 90 * 256 * 256];
        sinogram(&mut out);
        for image in out.chunks(256 * 256) {
            let sum = image.iter().map(|&v| f64::from(v)).sum::<f64>() * 0.0625 * 0.0625;
            // Every view contains the volume, to the accuracy of the midpoint rule.
            assert!((sum / volume - 1.0).abs() < 1e-3, "{sum} {volume}");
        }
        group.bench_function(format!("ours/{n}"), |b| {
            b.iter(|| sinogram(black_box(&mut out)))
        });
    }
    group.finish();
}

fn voxels(c: &mut Criterion) {
    let both = body(&[1.75, 2.75], 200);
    let volume = both.region_measures(1).unwrap().volume;
    let mut group = c.benchmark_group("revolve/voxels/256^3");
    group.sample_size(10);
    let grid = VoxelGrid::cube(256, 0.0625).unwrap();
    for (name, tolerance, bound) in [
        ("coverage 1e-2", 1e-2, 1e-5),
        ("coverage 1e-3", 1e-3, 1e-6),
        ("coverage 1e-4", 1e-4, 1e-6),
    ] {
        let (v, counters) = both.voxelize::<f32>(&grid, tolerance, &[0.0, 1.0]).unwrap();
        let sum = v.iter().map(|&v| f64::from(v)).sum::<f64>() * grid.voxel_volume();
        println!(
            "{name}: volume error {:.1e}, {counters:?}",
            sum / volume - 1.0
        );
        assert!((sum / volume - 1.0).abs() < bound);
        group.bench_function(name, |b| {
            b.iter(|| {
                both.voxelize::<f32>(black_box(&grid), tolerance, &[0.0, 1.0])
                    .unwrap()
            });
        });
    }
    group.finish();
}

/// Root of the mean square difference.
fn rms(a: &[f32], b: &[f32]) -> f64 {
    let square = |v: f32| f64::from(v) * f64::from(v);
    let sum: f64 = a.iter().zip(b).map(|(a, b)| square(a - b)).sum();
    (sum / a.len() as f64).sqrt()
}

/// Chords of one view against the number of profile points; the finest profile is the reference.
fn chord_rows(effort: Effort) {
    let rays = ParallelDetector::new(256, 256, [0.0625; 2])
        .and_then(|detector| detector.rays(0.7))
        .unwrap();
    let view = |body: &Body| {
        let mut out = vec![0.0f32; 256 * 256];
        body.project_add(&rays, &[1.0], 1.0, &mut out).unwrap();
        out
    };
    let truth = view(&body(&[2.75], 100_000));
    let row = |method: &str, size: usize, threads: usize, (seconds, image): (Time, Vec<f32>)| {
        Row {
            study: "chords",
            method,
            case: "one membrane, one view of 256 x 256 rays",
            size,
            threads,
            seconds,
            error: rms(&image, &truth),
            error_kind: "rms of all chords / cm",
        }
        .print();
    };
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[50, 400, 3200],
        Effort::Full => &[25, 50, 100, 200, 400, 800, 1600, 3200],
    };
    for &n in sizes {
        let outer = body(&[2.75], n);
        for &threads in benches::threads() {
            let run = on_threads(threads, || timed(effort, || view(&outer)));
            row("chains of frusta", n, threads, run);
        }
        if n <= 200 {
            let path = profile(2.75, n);
            let run = timed(effort, || naive_view(&path, &rays));
            let image = run.1.iter().map(|&v| v as f32).collect();
            row("every frustum of every ray", n, 1, (run.0, image));
        }
    }
}

/// The share of the wall of n^3 points of every voxel.
fn naive_voxels(body: &Body, grid: &VoxelGrid, n: usize) -> Vec<f64> {
    let [nx, ny, nz] = grid.shape();
    let offset = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
    let h = grid.spacing();
    let [inner, outer] = [0, 1].map(|k| &body.layers()[k]);
    (0..nx * ny * nz)
        .map(|k| {
            let centre = grid.centre(k % nx, k / nx % ny, k / (nx * ny));
            let within = (0..n * n * n).filter(|point| {
                let [x, y, z] = [point % n, point / n % n, point / (n * n)].map(offset);
                let point = centre + Vector3::new(x * h[0], y * h[1], z * h[2]);
                let point = body.pose().to_body(&point);
                outer.contains(&point) && !inner.contains(&point)
            });
            within.count() as f64 / (n * n * n) as f64
        })
        .collect()
}

/// Voxels of the wall, four slices of them; coverage to 1e-9 is the reference.
///
/// The largest error is the tolerance or less; from exact sections on, three more digits cost some five times the work. That of
/// n points a side falls as 1/n (a plane that lies along a layer of points), at n^3 the work.
fn voxel_rows(effort: Effort) {
    let both = body(&[1.75, 2.75], 200);
    let sides: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[64],
        Effort::Full => &[64, 128, 256],
    };
    for &n in sides {
        let grid = VoxelGrid::centred([n, n, 4], [16.0 / n as f64; 3], [0.0; 3]).unwrap();
        let voxels = |tolerance| {
            let result = both.voxelize::<f64>(&grid, tolerance, &[0.0, 1.0]);
            result.unwrap().0
        };
        let truth = voxels(1e-9);
        let row = |method: &str, threads: usize, (seconds, volume): (Time, Vec<f64>)| {
            let errors = volume.iter().zip(&truth).map(|(a, b)| (a - b).abs());
            Row {
                study: "voxels",
                method,
                case: "four slices of a wall of two membranes",
                size: n,
                threads,
                seconds,
                error: errors.fold(0.0, f64::max),
                error_kind: "largest of all voxels",
            }
            .print();
        };
        for points in [1, 4] {
            let run = timed(effort, || naive_voxels(&both, &grid, points));
            row(&format!("{points}^3 points a voxel"), 1, run);
        }
        for (method, tolerance) in [
            ("coverage to 1e-2", 1e-2),
            ("coverage to 1e-3", 1e-3),
            ("coverage to 1e-4", 1e-4),
            ("coverage to 1e-5", 1e-5),
            ("coverage to 1e-6", 1e-6),
        ] {
            for &threads in benches::threads() {
                let run = on_threads(threads, || timed(effort, || voxels(tolerance)));
                row(method, threads, run);
            }
        }
    }
}

fn rows(effort: Effort) {
    chord_rows(effort);
    voxel_rows(effort);
}

fn main() {
    benches::run(rows, &[chords, views, voxels]);
}
