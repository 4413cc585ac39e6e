//! The moving membrane: cost of a step against N, and time against error compared with diffsol (feature `rivals`).

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion};
use membrane_implicit::{
    Body, EvolvingOptions, Jacobian, Load, Membrane, Motion, ReferenceShape, Scheme, evolve,
};

#[cfg(feature = "rivals")]
mod rows;

const LOAD: f64 = 17.5;

fn body(n_nodes: usize) -> Body {
    let rest = ReferenceShape::balloon(8.5, 1.75).expect("a balloon");
    Body::springs(&Membrane::new(rest), n_nodes)
        .and_then(|body| body.with_damping(1.0))
        .expect("a body")
}

fn motion(n_nodes: usize, scheme: Scheme) -> Motion {
    Motion::new(body(n_nodes), Load::intensity(|_| LOAD), scheme).expect("a motion")
}

/// A group of twenty samples in a second.
fn short<'a>(c: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = c.benchmark_group(name);
    group
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    group
}

fn step_cost(c: &mut Criterion) {
    let mut group = short(c, "motion/paper_step");
    for n_nodes in [101, 201, 401, 801, 1601, 6401] {
        let mut motion = motion(n_nodes, Scheme::SemiImplicitEuler);
        group.bench_with_input(BenchmarkId::from_parameter(n_nodes), &n_nodes, |b, _| {
            b.iter(|| motion.step(black_box(2.0)).expect("a step"));
        });
    }
    group.finish();
}

fn paper_run(c: &mut Criterion) {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).expect("a balloon"));
    let mut group = short(c, "motion/evolve_201");
    for (name, jacobian) in [("band", Jacobian::Band), ("exact", Jacobian::Exact)] {
        let options = EvolvingOptions::default()
            .with_frame_every(0)
            .with_jacobian(jacobian);
        let run = evolve(&membrane, 201, 2588.9, &options).expect("a run");
        println!(
            "motion/evolve_201/{name}: {} steps, residual {:.1e}",
            run.steps,
            run.residual()
        );
        group.bench_function(name, |b| {
            b.iter(|| evolve(black_box(&membrane), 201, 2588.9, &options).expect("a run"));
        });
    }
    group.finish();
}

fn main() {
    #[cfg(feature = "rivals")]
    let rows = rows::rows;
    #[cfg(not(feature = "rivals"))]
    let rows = |_| println!("the rows need `--features rivals`");
    benches::run(rows, &[step_cost, paper_run]);
}
