//! Time against error compared with diffsol, the reference of which is the most accurate run of that solver.

use benches::{Effort, Row, Time};
use cpu_time::ThreadTime;
use diffsol::{FaerSparseLU, FaerSparseMat, OdeBuilder, OdeSolverMethod};
use membrane_implicit::{DiscreteMembrane, Scheme, Stop, TimeStep, Tolerance};

use crate::{LOAD, body, motion};

const END: f64 = 5.0;

fn ours(n_nodes: usize, scheme: Scheme, steps: TimeStep) -> (Vec<[f64; 2]>, usize) {
    let mut motion = motion(n_nodes, scheme);
    motion.run(steps, &[Stop::Time(END)]).expect("a run");
    (motion.state().points.to_vec(), motion.work().steps)
}

/// The same equations of motion for a general solver: per interior node x, y, vx, vy.
#[derive(Clone)]
struct Ode {
    rest: Vec<[f64; 2]>,
}

impl Ode {
    fn new(n_nodes: usize) -> Self {
        let body = body(n_nodes);
        Self {
            rest: body.differences().start().as_chunks::<2>().0.to_vec(),
        }
    }

    fn last(&self) -> usize {
        self.rest.len() - 1
    }

    /// ds^-2.
    fn scale(&self) -> f64 {
        (self.last() * self.last()) as f64
    }

    fn node(&self, x: &[f64], n: usize) -> [f64; 2] {
        if n == 0 || n == self.last() {
            self.rest[n]
        } else {
            [x[4 * n - 4], x[4 * n - 3]]
        }
    }

    fn rhs(&self, x: &[f64], y: &mut [f64]) {
        let scale = self.scale();
        let (mut a, mut b) = (self.node(x, 0), self.node(x, 1));
        for n in 1..self.last() {
            let c = self.node(x, n + 1);
            let (d0, d1) = (c[0] - a[0], c[1] - a[1]);
            let f = LOAD / (d0 * d0 + d1 * d1).sqrt();
            let pull = |k: usize| {
                let u = |p: [f64; 2], m: usize| p[k] - self.rest[m][k];
                (u(c, n + 1) - 2.0 * u(b, n) + u(a, n - 1)) * scale
            };
            let i = 4 * n - 4;
            y[i] = x[i + 2];
            y[i + 1] = x[i + 3];
            y[i + 2] = pull(0) - f * d1 - x[i + 2];
            y[i + 3] = pull(1) + f * d0 - x[i + 3];
            (a, b) = (b, c);
        }
    }

    fn jacobian(&self, x: &[f64], v: &[f64], y: &mut [f64]) {
        let scale = self.scale();
        let change = |n: usize| {
            if n == 0 || n == self.last() {
                [0.0; 2]
            } else {
                [v[4 * n - 4], v[4 * n - 3]]
            }
        };
        for n in 1..self.last() {
            let (a, c) = (self.node(x, n - 1), self.node(x, n + 1));
            let (d0, d1) = (c[0] - a[0], c[1] - a[1]);
            let r = (d0 * d0 + d1 * d1).sqrt();
            let (da, db, dc) = (change(n - 1), change(n), change(n + 1));
            let (e0, e1) = (dc[0] - da[0], dc[1] - da[1]);
            let along = (d0 * e0 + d1 * e1) / (r * r);
            let f = LOAD / r;
            let i = 4 * n - 4;
            y[i] = v[i + 2];
            y[i + 1] = v[i + 3];
            y[i + 2] = (dc[0] - 2.0 * db[0] + da[0]) * scale - f * (e1 - d1 * along) - v[i + 2];
            y[i + 3] = (dc[1] - 2.0 * db[1] + da[1]) * scale + f * (e0 - d0 * along) - v[i + 3];
        }
    }

    fn points(&self, x: &[f64]) -> Vec<[f64; 2]> {
        (0..=self.last()).map(|n| self.node(x, n)).collect()
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Rival {
    Bdf,
    TrBdf2,
    Esdirk34,
    Tsit45,
}

/// Processor time of the integration alone (the problem, with its sparsity and colouring, is built before).
fn rival(n_nodes: usize, method: Rival, tolerance: f64) -> (Vec<[f64; 2]>, usize, f64) {
    type Matrix = FaerSparseMat<f64>;
    type Lu = FaerSparseLU<f64>;
    let ode = Ode::new(n_nodes);
    let last = ode.last();
    let (f, j, start) = (ode.clone(), ode.clone(), ode.clone());
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(tolerance)
        .atol([tolerance])
        .h0(1e-4)
        .p([1.0])
        .rhs_implicit(
            move |x: &[f64], _p: &[f64], _t: f64, y: &mut [f64]| f.rhs(x, y),
            move |x: &[f64], _p: &[f64], _t: f64, v: &[f64], y: &mut [f64]| j.jacobian(x, v, y),
        )
        .init(
            move |_p: &[f64], _t: f64, y: &mut [f64]| {
                for n in 1..last {
                    y[4 * n - 4..4 * n].copy_from_slice(&[
                        start.rest[n][0],
                        start.rest[n][1],
                        0.0,
                        0.0,
                    ]);
                }
            },
            4 * (last - 1),
        )
        .build()
        .expect("a problem");
    macro_rules! integrate {
        ($solver:expr) => {{
            let clock = ThreadTime::now();
            let mut solver = $solver.expect("a solver");
            solver.set_stop_time(END).expect("an end");
            let mut steps = 0;
            while solver.state().t < END {
                solver.step().expect("a step");
                steps += 1;
            }
            let seconds = clock.elapsed().as_secs_f64();
            let x: Vec<f64> = (0..4 * (last - 1)).map(|i| solver.state().y[i]).collect();
            (ode.points(&x), steps, seconds)
        }};
    }
    match method {
        Rival::Bdf => integrate!(problem.bdf::<Lu>()),
        Rival::TrBdf2 => integrate!(problem.tr_bdf2::<Lu>()),
        Rival::Esdirk34 => integrate!(problem.esdirk34::<Lu>()),
        Rival::Tsit45 => integrate!(problem.tsit45()),
    }
}

fn distance(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
        .fold(0.0, f64::max)
}

/// Seconds against error, with decreasing errors.
type Curve = Vec<(f64, f64)>;

/// Time of a curve at an error, interpolated between its rows in logarithms; `None` beyond its end.
fn time_at(curve: &Curve, error: f64) -> Option<f64> {
    // a row counts only if no cheaper row is more accurate
    let mut rows: Curve = Vec::new();
    for &(e, t) in curve {
        if !curve.iter().any(|&(other, time)| other < e && time < t) {
            rows.push((e, t));
        }
    }
    rows.sort_by(|a, b| b.0.total_cmp(&a.0));
    let k = rows.iter().position(|&(e, _)| e <= error)?;
    if k == 0 {
        return Some(rows[0].1);
    }
    let ((e0, t0), (e1, t1)) = (rows[k - 1], rows[k]);
    let x = (error / e0).ln() / (e1 / e0).ln();
    Some((t0.ln() + x * (t1 / t0).ln()).exp())
}

/// Ratio of the times of the other solver and ours, if it reaches the error.
fn longer(other: Option<f64>, ours: f64) -> String {
    other.map_or("not reached".into(), |time| format!("{:.1} x", time / ours))
}

pub(crate) fn rows(effort: Effort) {
    rows_of(101, effort);
    if effort == Effort::Full {
        rows_of(201, effort);
    }
}

/// Time against the error at t = 5, one row per setting; then the ratios at equal error.
fn rows_of(n_nodes: usize, effort: Effort) {
    // Independent of our steps: an explicit scheme of order 5 at the tightest tolerance.
    let tightest = if effort == Effort::Test { 1e-6 } else { 1e-13 };
    let truth = rival(n_nodes, Rival::Tsit45, tightest).0;
    let row = |method: &str, run: &mut dyn FnMut() -> (Vec<[f64; 2]>, usize, f64)| {
        let (points, steps, first) = run();
        let seconds = match effort {
            Effort::Test => vec![first],
            Effort::Quick => (0..3).map(|_| run().2).collect(),
            Effort::Full => (0..9).map(|_| run().2).collect(),
        };
        let seconds = Time::of(seconds);
        let error = distance(&points, &truth);
        Row {
            study: "motion",
            method,
            case: &format!("balloon at f = 17.5 to t = 5, {n_nodes} nodes"),
            size: steps,
            threads: 1,
            seconds,
            error,
            error_kind: "largest distance / cm",
        }
        .print();
        (error, seconds.median)
    };
    let tolerances: &[f64] = match effort {
        Effort::Test => &[1e-2],
        Effort::Quick => &[1e-2, 1e-4, 1e-6],
        Effort::Full => &[1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8],
    };
    let mut rivals: Vec<(Rival, Curve)> = Vec::new();
    for method in [Rival::Bdf, Rival::TrBdf2, Rival::Esdirk34, Rival::Tsit45] {
        let curve = tolerances
            .iter()
            .map(|&t| {
                row(&format!("diffsol {method:?}"), &mut || {
                    rival(n_nodes, method, t)
                })
            })
            .collect();
        rivals.push((method, curve));
    }
    let mut own: Vec<(Scheme, Curve)> = Vec::new();
    for (scheme, steps) in [
        (Scheme::Splitting2, [510, 550, 700, 1000, 2000, 4000]),
        (Scheme::ImplicitSplitting2, [40, 80, 150, 300, 600, 2000]),
        (Scheme::Splitting6, [325, 350, 400, 500, 600, 800]),
        (Scheme::TrBdf2, [125, 250, 500, 1000, 4000, 16000]),
        (Scheme::Midpoint, [125, 250, 500, 1000, 4000, 16000]),
    ] {
        let mut curve = Curve::new();
        let mut timed = |name: &str, how: TimeStep| {
            curve.push(row(&format!("{scheme:?}, {name} step"), &mut || {
                let clock = ThreadTime::now();
                let (points, steps) = ours(n_nodes, scheme, how);
                (points, steps, clock.elapsed().as_secs_f64())
            }));
        };
        let every = if effort != Effort::Full { 2 } else { 1 };
        // explicit steps scale with the spacing
        let finer = match scheme {
            Scheme::Splitting2 | Scheme::Splitting6 => (n_nodes - 1) / 100,
            _ => 1,
        };
        for n in steps.into_iter().step_by(every) {
            let n = n * finer as u32;
            timed("fixed", TimeStep::Fixed(END / f64::from(n)));
        }
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6].into_iter().step_by(every) {
            if scheme == Scheme::Splitting6 {
                break; // fixed steps only
            }
            timed(
                "adaptive",
                TimeStep::Adaptive(Tolerance::uniform(tolerance)),
            );
        }
        own.push((scheme, curve));
    }
    for error in [1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 3e-7] {
        let times = own.iter().filter_map(|(_, curve)| time_at(curve, error));
        let Some(best) = times.reduce(f64::min) else {
            println!("at error {error:.0e} ours not reached");
            continue;
        };
        print!("at error {error:.0e} ours {:9.3} ms", best * 1e3);
        for (method, curve) in &rivals {
            let times = longer(time_at(curve, error), best);
            print!(", diffsol {method:?} {times}");
        }
        let of = |wanted: Scheme| own.iter().find(|(scheme, _)| *scheme == wanted);
        if let (Some((_, ours)), Some((_, theirs))) = (of(Scheme::TrBdf2), rivals.get(1))
            && let Some(ours) = time_at(ours, error)
        {
            let times = longer(time_at(theirs, error), ours);
            print!("; TR-BDF2 alone {times}");
        }
        println!();
    }
}
