//! Static membranes: both discretisations of this workspace compared with a general sparse LU on the same finite-difference system; each time is
//! printed with its error (the sparse LU with the feature `rivals`). SciPy's `solve_bvp` solves the same problem in peers/solve_bvp.py.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::hint::black_box;

use benches::{Effort, Row, Time, timed};
use criterion::Criterion;
use membrane_forces::{Membrane, ReferenceShape};
use membrane_newton::{
    Control, Discretisation, NewtonOptions, Pair, Rubber, Solver, StrainEnergy, Thickness,
};

#[cfg(feature = "rivals")]
mod sparse_lu;

/// f for a gain of 0.6 and the corresponding volume (h = 8.5, R = 1.75, lambda = 1).
const GAIN: f64 = 0.6;
const VOLUME_AT_17_5: f64 = 148.86748016;

fn balloon(radius: f64) -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, radius).expect("positive sizes"))
}

fn solver(radius: f64, discretisation: Discretisation) -> Solver {
    Solver::new(&balloon(radius), discretisation).expect("valid discretisation")
}

/// Time and volume error from the reference configuration, one row per resolution.
fn rows(effort: Effort) {
    let options = NewtonOptions::default();
    let (nodes, degrees): (&[usize], &[usize]) = match effort {
        Effort::Test | Effort::Quick => (&[51, 201, 801], &[4, 8, 12]),
        Effort::Full => (
            &[51, 101, 201, 401, 801, 1601, 3201, 6401],
            &[4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24],
        ),
    };
    let row = |method: &str, size: usize, (seconds, volume): (Time, f64)| {
        Row {
            study: "static solve",
            method,
            case: "balloon at f = 17.5, from rest",
            size,
            threads: 1,
            seconds,
            error: (volume / VOLUME_AT_17_5 - 1.0).abs(),
            error_kind: "relative volume error (reference good to 3e-11)",
        }
        .print();
    };
    let volume = |solver: &Solver| {
        let solved = solver.solve(Control::Load(17.5), &options);
        solved.expect("converges").measures.volume
    };
    for &nodes in nodes {
        let ours = solver(1.75, Discretisation::FiniteDifferences { nodes });
        let own = timed(effort, || volume(&ours));
        row("finite differences", nodes, own);
        #[cfg(feature = "rivals")]
        {
            let differences = membrane_forces::FiniteDifferences::new(&balloon(1.75), nodes);
            let differences = differences.expect("enough nodes");
            let theirs = timed(effort, || sparse_lu::newton(&differences));
            assert!(
                (theirs.1 / own.1 - 1.0).abs() < 1e-9,
                "the same system has the same solution"
            );
            row("finite differences, faer sparse LU", nodes, theirs);
        }
    }
    for &degree in degrees {
        let ours = solver(
            1.75,
            Discretisation::Spectral {
                degree,
                per_piece: 1,
            },
        );
        row("spectral elements", degree, timed(effort, || volume(&ours)));
    }
}

/// p / (mu h) of the balloon of neo-Hookean rubber at a gain of 0.3, per cm.
const RUBBER_PRESSURE: f64 = 0.256444419246;

fn rubber(radius: f64, discretisation: Discretisation) -> Solver {
    let energy = StrainEnergy::NeoHookean { mu: 1.0 };
    let rubber = Rubber::new(energy, Thickness::UNIT).expect("positive");
    Solver::new(&balloon(radius).with_rubber(rubber), discretisation).expect("mirrored")
}

/// The same for rubber at a gain of 0.3.
fn rubber_rows(effort: Effort) {
    let options = NewtonOptions::default();
    let (nodes, degrees): (&[usize], &[usize]) = match effort {
        Effort::Test | Effort::Quick => (&[201], &[12, 24]),
        Effort::Full => (&[101, 201, 401, 801], &[8, 12, 16, 20, 24, 28]),
    };
    let differences = nodes.iter().map(|&nodes| {
        let how = Discretisation::FiniteDifferences { nodes };
        ("finite differences", nodes, how)
    });
    let spectral = degrees.iter().map(|&degree| {
        let how = Discretisation::Spectral {
            degree,
            per_piece: 1,
        };
        ("spectral elements", degree, how)
    });
    for (method, size, how) in differences.chain(spectral) {
        let solver = rubber(1.75, how);
        let (seconds, pressure) = timed(effort, || {
            let solved = solver.solve(Control::VolumeGain(0.3), &options);
            solved.expect("converges").intensity
        });
        Row {
            study: "static solve",
            method,
            case: "rubber balloon at a gain of 0.3, from rest",
            size,
            threads: 1,
            seconds,
            error: (pressure / RUBBER_PRESSURE - 1.0).abs(),
            error_kind: "relative error of the pressure (reference good to 2e-12)",
        }
        .print();
    }
}

/// Rubber at a gain of 0.6 from the reference configuration: spectral elements, a pair, differences of more and more nodes.
fn rubber_gain(c: &mut Criterion) {
    let options = NewtonOptions::default();
    let mut group = c.benchmark_group("membrane/rubber-gain-0.6");
    let spectral = Discretisation::Spectral {
        degree: 16,
        per_piece: 1,
    };
    let inner = rubber(1.75, spectral);
    group.bench_function("spectral", |b| {
        b.iter(|| black_box(&inner).solve(Control::VolumeGain(GAIN), &options))
    });
    let pair = Pair::new(inner.clone(), rubber(2.75, spectral)).expect("the outer one is larger");
    let solved = pair.solve_gain(GAIN, &options).expect("converges");
    assert!(solved.wall_volume_error.abs() < 1e-13);
    group.bench_function("pair-spectral", |b| {
        b.iter(|| black_box(&pair).solve_gain(GAIN, &options))
    });
    group.sample_size(10);
    for nodes in [201, 401, 801] {
        let solver = rubber(1.75, Discretisation::FiniteDifferences { nodes });
        group.bench_function(format!("differences-{nodes}"), |b| {
            b.iter(|| {
                let solved = black_box(&solver).solve(Control::VolumeGain(GAIN), &options);
                solved.expect("converges")
            })
        });
    }
    group.finish();
}

fn membrane(c: &mut Criterion) {
    let options = NewtonOptions::default();

    let mut group = c.benchmark_group("membrane/gain-0.6");
    let spectral = solver(
        1.75,
        Discretisation::Spectral {
            degree: 14,
            per_piece: 1,
        },
    );
    let solved = spectral
        .solve(Control::VolumeGain(GAIN), &options)
        .expect("converges");
    assert!((solved.intensity - 17.48357527761).abs() < 2e-11);
    group.bench_function("spectral", |b| {
        b.iter(|| black_box(&spectral).solve(Control::VolumeGain(GAIN), &options))
    });
    let differences = solver(1.75, Discretisation::FiniteDifferences { nodes: 201 });
    group.bench_function("differences-201", |b| {
        b.iter(|| black_box(&differences).solve(Control::VolumeGain(GAIN), &options))
    });
    let pair = Pair::new(
        spectral.clone(),
        solver(
            2.75,
            Discretisation::Spectral {
                degree: 14,
                per_piece: 1,
            },
        ),
    )
    .expect("the outer one is larger");
    let solved = pair.solve_gain(GAIN, &options).expect("converges");
    assert!(solved.wall_volume_error.abs() < 1e-13);
    group.bench_function("pair-spectral", |b| {
        b.iter(|| black_box(&pair).solve_gain(GAIN, &options))
    });
    group.finish();

    let mut group = c.benchmark_group("membrane/differences-linear-in-nodes");
    group.sample_size(10);
    for nodes in [1001, 10_001, 100_001] {
        let solver = solver(1.75, Discretisation::FiniteDifferences { nodes });
        group.throughput(criterion::Throughput::Elements(nodes as u64));
        group.bench_function(nodes.to_string(), |b| {
            b.iter(|| {
                black_box(&solver)
                    .solve(Control::VolumeGain(GAIN), &options)
                    .expect("converges")
            })
        });
    }
    group.finish();
}

fn main() {
    let all = |effort| {
        rows(effort);
        rubber_rows(effort);
    };
    benches::run(all, &[membrane, rubber_gain]);
}
