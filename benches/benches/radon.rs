//! FBP and projectors compared with a textbook implementation, on one Shepp-Logan phantom; the error of each row is checked and printed.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "common/case.rs"]
mod case;

use std::f64::consts::PI;
use std::hint::black_box;

use benches::{Effort, Row, Time, on_threads, timed};
use case::{Case, case};
use criterion::{BenchmarkId, Criterion, Throughput};
use radon::{
    FbpOptions, InstructionSet, Interpolation, Kernel, LinearOperator, Projector, StackOrder,
    Window,
};

impl Case {
    /// FBP as in a textbook: each row convolved with the ramp, each pixel visited for each view.
    fn textbook(&self) -> Vec<f32> {
        let n = self.n;
        let mut image = vec![0.0_f32; n * n];
        for (row, theta) in self.sinogram.chunks_exact(n).zip(self.geometry.angles()) {
            let filtered: Vec<f64> = (0..n)
                .map(|i| {
                    (0..n)
                        .map(|k| radon::ramp_sample(i as i64 - k as i64) * f64::from(row[k]))
                        .sum()
                })
                .collect();
            let (sin, cos) = theta.sin_cos();
            for (i, pixel) in image.iter_mut().enumerate() {
                let [x, y] = self.grid.pixel_centre(i % n, i / n);
                let u = self.geometry.bin_at(x * cos + y * sin);
                let j = u.floor();
                let at = |j: f64| {
                    if j >= 0.0 && j < n as f64 {
                        filtered[j as usize]
                    } else {
                        0.0
                    }
                };
                *pixel += (PI / self.geometry.n_views() as f64
                    * ((1.0 - (u - j)) * at(j) + (u - j) * at(j + 1.0)))
                    as f32;
            }
        }
        image
    }
}

/// One slice: the textbook and each instruction set.
fn one_slice(c: &mut Criterion) {
    let case = case(256, 90);
    let truth = case.rmse(&case.textbook());
    let mut group = c.benchmark_group("radon/fbp/256x256x90");
    group
        .throughput(Throughput::Elements((256 * 256 * 90) as u64))
        .sample_size(10);
    println!("textbook: rmse {truth:.5}");
    group.bench_function("textbook", |b| {
        b.iter(|| black_box(black_box(&case).textbook()))
    });
    for set in [
        InstructionSet::Baseline,
        InstructionSet::Avx2,
        InstructionSet::Avx512,
        InstructionSet::Neon,
    ] {
        if set.is_available() {
            let plan = case.plan(FbpOptions::default().with_instructions(set));
            let rmse = case.rmse(&plan.reconstruct(&case.sinogram).unwrap());
            println!("{set:?}: rmse {rmse:.5}");
            // The same discretisation, f32 filtering instead of f64: far less than 1 % of the discretisation's own error.
            assert!((rmse / truth - 1.0).abs() < 0.01);
            let (mut image, mut scratch) = (vec![0.0; 256 * 256], radon::FbpScratch::default());
            group.bench_function(format!("{set:?}"), |b| {
                b.iter(|| {
                    plan.reconstruct_slab_into(
                        black_box(&case.sinogram),
                        1,
                        StackOrder::SliceViewBin,
                        0..1,
                        black_box(&mut image),
                        &mut scratch,
                    )
                    .unwrap()
                })
            });
        }
    }
    group.finish();
}

/// Time grows linearly in slices: the batch's time over the number of slices.
fn many_slices(c: &mut Criterion) {
    let case = case(256, 90);
    let plan = case.plan(FbpOptions::default());
    let alone = plan.reconstruct(&case.sinogram).unwrap();
    let mut group = c.benchmark_group("radon/fbp/slices");
    group.sample_size(10);
    for n_slices in [1, 2, 4, 16, 64, 256] {
        let projections = case.stack(n_slices);
        let (mut volume, mut scratch) = (
            vec![0.0; n_slices * 256 * 256],
            radon::FbpScratch::default(),
        );
        let order = StackOrder::SliceViewBin;
        plan.reconstruct_slab_into(
            &projections,
            n_slices,
            order,
            0..n_slices,
            &mut volume,
            &mut scratch,
        )
        .unwrap();
        assert!(
            volume
                .as_chunks::<{ 256 * 256 }>()
                .0
                .iter()
                .all(|slice| slice[..] == alone[..])
        );
        group.throughput(Throughput::Elements((n_slices * 256 * 256 * 90) as u64));
        group.bench_function(BenchmarkId::from_parameter(n_slices), |b| {
            b.iter(|| {
                plan.reconstruct_slab_into(
                    black_box(&projections),
                    n_slices,
                    order,
                    0..n_slices,
                    &mut volume,
                    &mut scratch,
                )
                .unwrap()
            })
        });
    }
    group.finish();
}

/// Back-projection alone, on one thread: filtered rows, including the changes of layout before and after.
fn back_projection(c: &mut Criterion) {
    let case = case(256, 90);
    let plan = case.plan(FbpOptions::default().with_ramp(false));
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one_thread = one_thread.expect("a pool of one thread");
    let projections = case.stack(256);
    let (mut volume, mut scratch) = (vec![0.0; 256 * 256 * 256], radon::FbpScratch::default());
    let mut group = c.benchmark_group("radon/backprojection/256x256x90x256");
    group
        .throughput(Throughput::Elements((256 * 256 * 256 * 90) as u64))
        .sample_size(10);
    group.bench_function("one thread", |b| {
        b.iter(|| {
            one_thread.install(|| {
                plan.reconstruct_slab_into(
                    black_box(&projections),
                    256,
                    StackOrder::SliceViewBin,
                    0..256,
                    &mut volume,
                    &mut scratch,
                )
                .unwrap()
            })
        })
    });
    group.finish();
}

/// Seconds of FBP of `n_slices` slices, and the first image.
fn time_of_fbp(effort: Effort, case: &Case, n_slices: usize) -> (Time, Vec<f32>) {
    let plan = case.plan(FbpOptions::default());
    let projections = case.stack(n_slices);
    let mut volume = vec![0.0; n_slices * case.n * case.n];
    let (mut scratch, order) = (radon::FbpScratch::default(), StackOrder::SliceViewBin);
    let run = || {
        let projections = black_box(&projections);
        plan.reconstruct_slab_into(
            projections,
            n_slices,
            order,
            0..n_slices,
            &mut volume,
            &mut scratch,
        )
        .unwrap();
    };
    let (seconds, ()) = timed(effort, run);
    volume.truncate(case.n * case.n);
    (seconds, volume)
}

/// Seconds of Joseph's forward projection of `n_slices` slices, and the first sinogram.
fn time_of_projection(effort: Effort, case: &Case, n_slices: usize) -> (Time, Vec<f32>) {
    let projector = Projector::new(&case.geometry, &case.grid, Kernel::Joseph).unwrap();
    let volume = case.image.repeat(n_slices);
    let mut projections = vec![0.0; n_slices * case.sinogram.len()];
    let operator = projector.stack_operator(n_slices, StackOrder::SliceViewBin);
    let operator = operator.unwrap();
    let run = || {
        let volume = black_box(&volume);
        operator.forward_into(volume, &mut projections).unwrap();
    };
    let (seconds, ()) = timed(effort, run);
    projections.truncate(case.sinogram.len());
    (seconds, projections)
}

/// Cost against size: the time of an update (slice, view and pixel) should not rise.
fn growth_rows(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[128, 256],
        Effort::Full => &[128, 256, 512, 1024],
    };
    for (what, [slices, views, side]) in [
        ("slices of 128 x 128 from 90 views", [0, 90, 128]),
        ("views of 16 slices of 256 x 256", [16, 0, 256]),
        ("pixels a side, 16 slices from 90 views", [16, 90, 0]),
    ] {
        for &size in sizes {
            let or = |n: usize| if n == 0 { size } else { n };
            let case = case(or(side), or(views));
            for &threads in benches::threads() {
                let row = |method: &str, seconds: Time, error: f64, error_kind: &str| {
                    Row {
                        study: "growth",
                        method,
                        case: &format!("{method}: {what}"),
                        size,
                        threads,
                        seconds,
                        error,
                        error_kind,
                    }
                    .print();
                };
                let (seconds, image) =
                    on_threads(threads, || time_of_fbp(effort, &case, or(slices)));
                row("FBP", seconds, case.rmse(&image), "rms within the circle");
                let (seconds, rays) =
                    on_threads(threads, || time_of_projection(effort, &case, or(slices)));
                let error = case.distance(&rays);
                row(
                    "Joseph",
                    seconds,
                    error,
                    "relative L2 against exact bin means",
                );
            }
        }
    }
}

/// Projectors and adjoints, 16 slices of 128 x 128, 90 views.
fn projectors(c: &mut Criterion) {
    let case = case(128, 90);
    let mut group = c.benchmark_group("radon/project/128x128x90x16");
    group
        .throughput(Throughput::Elements((16 * 128 * 128 * 90) as u64))
        .sample_size(10);
    let volume = case.image.repeat(16);
    for kernel in [Kernel::Joseph, Kernel::Strip] {
        let projector = Projector::new(&case.geometry, &case.grid, kernel).unwrap();
        let error = case.distance(&projector.forward(&case.image).unwrap());
        println!("{kernel:?}: relative error against bin means {error:.5}");
        assert!(error < 0.03);
        let operator = projector.stack_operator(16, StackOrder::SliceViewBin);
        let operator = operator.unwrap();
        let mut projections = vec![0.0; 16 * case.sinogram.len()];
        group.bench_function(format!("{kernel:?}/forward"), |b| {
            b.iter(|| {
                operator
                    .forward_into(black_box(&volume), &mut projections)
                    .unwrap()
            })
        });
        let mut back = vec![0.0; volume.len()];
        group.bench_function(format!("{kernel:?}/adjoint"), |b| {
            b.iter(|| {
                operator
                    .adjoint_into(black_box(&projections), &mut back)
                    .unwrap()
            })
        });
    }
    group.finish();
}

const SLICES: usize = 16;

/// FBP of Shepp and Logan's phantom from exact bin means: views, windows, interpolations, sizes.
fn fbp_rows(effort: Effort) {
    let cases: &[(usize, usize)] = match effort {
        Effort::Test | Effort::Quick => &[(256, 90), (256, 360)],
        Effort::Full => &[
            (256, 30),
            (256, 45),
            (256, 60),
            (256, 90),
            (256, 180),
            (256, 360),
            (256, 720),
            (128, 200),
            (512, 800),
        ],
    };
    for &(n, n_views) in cases {
        let case = case(n, n_views);
        let projections = case.stack(SLICES);
        let name = format!("{SLICES} slices of {n} x {n}");
        let row = |method: &str, threads: usize, (seconds, image): (Time, Vec<f32>)| {
            let error = case.rmse(&image[..n * n]);
            // With far fewer views than the n pi / 2 required by the bins, streaks dominate the error; otherwise smoothed edges, a larger part of a
            // coarser image.
            let edges = 0.06 * (256.0 / n as f64).sqrt().max(1.0);
            assert!(error < if n_views < 90 { 0.15 } else { edges }, "{error}");
            Row {
                study: "FBP",
                method,
                case: &name,
                size: n_views,
                threads,
                seconds,
                error,
                error_kind: "rms within the circle",
            }
            .print();
        };
        let windows = [
            Window::RamLak,
            Window::SheppLogan,
            Window::Cosine,
            Window::Hamming,
            Window::Hann,
        ];
        let every = if effort != Effort::Full { 4 } else { 1 };
        for window in windows.into_iter().step_by(every) {
            for interpolation in [Interpolation::Linear, Interpolation::BandLimited] {
                let plan = case.plan(
                    FbpOptions::default()
                        .with_window(window.clone())
                        .with_interpolation(interpolation),
                );
                let (mut volume, mut scratch) =
                    (vec![0.0; SLICES * n * n], radon::FbpScratch::default());
                let order = StackOrder::SliceViewBin;
                for &threads in benches::threads() {
                    let seconds = on_threads(threads, || {
                        timed(effort, || {
                            plan.reconstruct_slab_into(
                                &projections,
                                SLICES,
                                order,
                                0..SLICES,
                                &mut volume,
                                &mut scratch,
                            )
                            .unwrap();
                        })
                        .0
                    });
                    let method = format!("{window:?}, {interpolation:?}");
                    row(&method, threads, (seconds, volume.clone()));
                }
            }
        }
        if n <= 256 && n_views <= 180 {
            let (seconds, image) = timed(effort, || case.textbook());
            row("as in a textbook, RamLak", 1, (seconds * SLICES, image));
        }
    }
}

/// Projections of the phantom's pixel averages compared with its exact bin averages.
fn projector_rows(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[128],
        Effort::Full => &[64, 128, 256, 512],
    };
    for &n in sizes {
        let case = case(n, 90);
        let volume = case.image.repeat(SLICES);
        let mut projections = vec![0.0f32; SLICES * case.sinogram.len()];
        let row = |method: &str, threads: usize, seconds: Time, error: f64| {
            Row {
                study: "projectors",
                method,
                case: "16 slices of a square from 90 views",
                size: n,
                threads,
                seconds,
                error,
                error_kind: "relative L2 against exact bin means",
            }
            .print();
        };
        for kernel in [Kernel::Joseph, Kernel::Strip] {
            let projector = Projector::new(&case.geometry, &case.grid, kernel).unwrap();
            let operator = projector.stack_operator(SLICES, StackOrder::SliceViewBin);
            let operator = operator.unwrap();
            for &threads in benches::threads() {
                let seconds = on_threads(threads, || {
                    timed(effort, || {
                        operator.forward_into(&volume, &mut projections).unwrap();
                    })
                    .0
                });
                let error = case.distance(&projections[..case.sinogram.len()]);
                assert!(error < 0.05, "{kernel:?}: {error}");
                row(&format!("{kernel:?}"), threads, seconds, error);
            }
            if n <= 256 {
                // for comparison: the same weights as a sparse matrix, slice by slice
                let matrix = projector.matrix::<f32>().expect("room");
                let (seconds, rays) = timed(effort, || {
                    let mut rays = vec![0.0f32; matrix.rows()];
                    for (ray, row) in rays.iter_mut().zip(matrix.outer_iterator()) {
                        *ray = row.iter().map(|(pixel, &w)| w * case.image[pixel]).sum();
                    }
                    rays
                });
                let method = format!("{kernel:?} as a sparse matrix");
                row(&method, 1, seconds * SLICES, case.distance(&rays));
            }
        }
    }
}

fn rows(effort: Effort) {
    fbp_rows(effort);
    projector_rows(effort);
    growth_rows(effort);
}

fn main() {
    benches::run(rows, &[one_slice, many_slices, back_projection, projectors]);
}
