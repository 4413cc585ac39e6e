//! Single slices, small and large: the direct sum and Fourier methods, Joseph's projector and the Fourier projector; each row contains its error.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

#[path = "common/case.rs"]
mod case;

use std::hint::black_box;

use benches::{Effort, Row, Time, on_threads, timed};
use case::case;
use criterion::{Criterion, Throughput};
use radon::{
    FbpMethod, FbpOptions, FourierProjector, Interpolation, Kernel, LinearOperator, Projector,
    StackOrder,
};

/// One slice by either method: scaling with its side, n x n pixels from 45/32 n views.
fn large_rows(effort: Effort) {
    let sizes: &[usize] = match effort {
        Effort::Test | Effort::Quick => &[256],
        Effort::Full => &[256, 512, 1024, 2048, 4096],
    };
    for &n in sizes {
        let case = case(n, n * 45 / 32);
        let row =
            |study: &str, method: &str, threads: usize, seconds: Time, error: f64, kind: &str| {
                Row {
                    study,
                    method,
                    case: "one slice of n x n pixels from 45 n / 32 views",
                    size: n,
                    threads,
                    seconds,
                    error,
                    error_kind: kind,
                }
                .print();
            };
        let methods = [
            ("direct", FbpMethod::Direct, Interpolation::Linear),
            (
                "Fourier, 1e-3",
                FbpMethod::Fourier { tolerance: 1e-3 },
                Interpolation::Linear,
            ),
            (
                "Fourier, 1e-4",
                FbpMethod::Fourier { tolerance: 1e-4 },
                Interpolation::Linear,
            ),
            (
                "Fourier, 1e-6",
                FbpMethod::Fourier { tolerance: 1e-6 },
                Interpolation::Linear,
            ),
            (
                "Fourier, 1e-4, band-limited",
                FbpMethod::Fourier { tolerance: 1e-4 },
                Interpolation::BandLimited,
            ),
        ];
        for (name, method, interpolation) in methods {
            // It takes half a minute on one thread.
            if n > 2048 && method == FbpMethod::Direct {
                continue;
            }
            let options = FbpOptions::default()
                .with_method(method)
                .with_interpolation(interpolation);
            let plan = case.plan(options);
            let (mut image, mut scratch) = (vec![0.0; n * n], radon::FbpScratch::default());
            for &threads in benches::threads() {
                let run = || {
                    plan.reconstruct_slab_into(
                        &case.sinogram,
                        1,
                        StackOrder::SliceViewBin,
                        0..1,
                        &mut image,
                        &mut scratch,
                    )
                };
                let (seconds, done) = on_threads(threads, || timed(effort, run));
                done.expect("room");
                row(
                    "FBP of one slice",
                    name,
                    threads,
                    seconds,
                    case.rmse(&image),
                    "rms within the circle",
                );
            }
        }
        if n > 2048 {
            continue;
        }
        let mut rays = vec![0.0_f32; case.sinogram.len()];
        let joseph = Projector::new(&case.geometry, &case.grid, Kernel::Joseph).unwrap();
        let fourier = FourierProjector::new(&case.geometry, &case.grid, 1e-4).expect("room");
        let operators: [(&str, &(dyn LinearOperator<f32> + Sync)); 2] =
            [("Joseph", &joseph), ("Fourier, 1e-4", &fourier)];
        for (name, operator) in operators {
            for &threads in benches::threads() {
                let run = || operator.forward_into(&case.image, &mut rays);
                let (seconds, done) = on_threads(threads, || timed(effort, run));
                done.expect("room");
                let kind = "relative L2 against exact bin means";
                row(
                    "projection of one slice",
                    name,
                    threads,
                    seconds,
                    case.distance(&rays),
                    kind,
                );
            }
        }
    }
}

/// One slice of 512 x 512 pixels by either method.
fn one_large_slice(c: &mut Criterion) {
    let case = case(512, 720);
    let mut group = c.benchmark_group("radon/large/512x512x720");
    group
        .throughput(Throughput::Elements(512 * 512 * 720))
        .sample_size(10);
    for (name, method) in [
        ("direct", FbpMethod::Direct),
        ("Fourier", FbpMethod::Fourier { tolerance: 1e-4 }),
    ] {
        let plan = case.plan(FbpOptions::default().with_method(method));
        println!(
            "{name}: rmse {:.5}",
            case.rmse(&plan.reconstruct(&case.sinogram).unwrap())
        );
        let (mut image, mut scratch) = (vec![0.0; 512 * 512], radon::FbpScratch::default());
        group.bench_function(name, |b| {
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
    group.finish();
}

fn main() {
    benches::run(large_rows, &[one_large_slice]);
}
