//! Volumes with a known motion, and their projections.

use crate::common::dense::dot;
use radon::{
    Displacements, EmOptions, ImageGrid, Kernel, LinearOperator, MotionState, MovingOperator,
    ParallelGeometry, Projector, RadonError, StackOperator, StackOrder, Stopping, Subset, Warp,
    Warps, adjoint_mismatch, osem,
};
use std::sync::Arc;

/// Pseudo-random numbers in [-1, 1).
fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    (0..n)
        .map(|_| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

const SHAPE: [usize; 3] = [7, 6, 5];
const SIDES: [f64; 3] = [0.5, 0.25, 2.0];

/// Two motions of some voxels by up to three voxels, some of them out of the volume, one far out.
fn motions() -> Vec<Displacements<'static>> {
    let by = |every: usize, seed: u64| -> Vec<(usize, [f32; 3])> {
        let all: usize = SHAPE.iter().product();
        let random = noise(3 * all, seed);
        let by = |v: usize, a: usize| (3.0 * SIDES[a] * random[3 * v + a]) as f32;
        (0..all)
            .filter(|v| v % every != 1)
            .map(|v| (v, [0, 1, 2].map(|a| by(v, a))))
            .collect()
    };
    let mut first = by(3, 5);
    first[4].1 = [1e30, 0.0, -1e30];
    [(0.3, first), (0.6, by(2, 9))]
        .map(|(share, by)| Displacements {
            fraction: share,
            by: by.leak(),
        })
        .into()
}

/// The definition, voxel by voxel and neighbour by neighbour, with hat functions.
fn plain(motions: &[Displacements<'_>], x: &[f64]) -> Vec<f64> {
    let [nx, ny, nz] = SHAPE;
    let mut moved = x.to_vec();
    for v in 0..x.len() {
        let centre = [v % nx, v / nx % ny, v / (nx * ny)];
        let (mut sum, mut stays) = (0.0, 1.0);
        for Displacements {
            fraction: share,
            by,
        } in motions
        {
            for (_, by) in by.iter().filter(|(voxel, _)| *voxel == v) {
                stays -= share;
                let at = [0, 1, 2].map(|a| centre[a] as f64 + f64::from(by[a]) / SIDES[a]);
                for w in 0..nx * ny * nz {
                    let place = [w % nx, w / nx % ny, w / (nx * ny)];
                    let hat = |a: usize| (1.0 - (at[a] - place[a] as f64).abs()).max(0.0);
                    sum += share * hat(0) * hat(1) * hat(2) * x[w];
                }
            }
        }
        moved[v] = stays * x[v] + sum;
    }
    moved
}

fn apply(operator: &impl LinearOperator<f64>, x: &[f64]) -> Vec<f64> {
    let mut y = vec![f64::NAN; operator.data_len()];
    operator.forward_into(x, &mut y).unwrap();
    y
}

fn back(operator: &impl LinearOperator<f64>, y: &[f64]) -> Vec<f64> {
    let mut x = vec![f64::NAN; operator.image_len()];
    operator.adjoint_into(y, &mut x).unwrap();
    x
}

#[test]
fn a_warp_equals_its_definition_and_its_adjoint_the_transpose() {
    let motions = motions();
    let warp = Warp::new(SHAPE, SIDES, &motions).unwrap();
    assert_eq!(
        warp.n_displacements(),
        motions[0].by.len() + motions[1].by.len()
    );
    let x = noise(210, 3);
    // Positions have 24 binary digits.
    for (found, expected) in apply(&warp, &x).iter().zip(plain(&motions, &x)) {
        assert!((found - expected).abs() < 3e-6, "{found} {expected}");
    }
    let off = adjoint_mismatch::<f64, _>(&warp, 1).unwrap();
    assert!(off < 1e-15, "{off}");
    // Entry by entry.
    let unit = |k: usize| -> Vec<f64> { (0..210).map(|j| f64::from(u8::from(j == k))).collect() };
    let columns: Vec<Vec<f64>> = (0..210).map(|k| apply(&warp, &unit(k))).collect();
    for row in [0, 1, 4, 100, 209] {
        let found = back(&warp, &unit(row));
        assert!((0..210).all(|k| (found[k] - columns[k][row]).abs() < 1e-15));
    }
    // In f32 too.
    let x32: Vec<f32> = x.iter().map(|x| *x as f32).collect();
    let mut moved = vec![0.0f32; 210];
    warp.forward_into(&x32, &mut moved).unwrap();
    for (a, b) in moved.iter().zip(apply(&warp, &x)) {
        assert!((f64::from(*a) - b).abs() < 1e-6);
    }
}

#[test]
fn displacements_by_whole_voxels_and_of_linear_functions_are_exact() {
    let [nx, ny, nz] = [9, 8, 7];
    let all = nx * ny * nz;
    let warp = |d| {
        let by: Vec<_> = (0..all).map(|v| (v, d)).collect();
        let motion = Displacements {
            fraction: 1.0,
            by: &by,
        };
        Warp::new([nx, ny, nz], [0.4; 3], &[motion]).unwrap()
    };
    let x = noise(all, 8);
    let moved = apply(&warp([0.8, -0.4, 0.4]), &x);
    for v in 0..all {
        let at = [v % nx + 2, (v / nx % ny).wrapping_sub(1), v / (nx * ny) + 1];
        let there = at[0] < nx && at[1] < ny && at[2] < nz;
        let expected = if there {
            x[(at[2] * ny + at[1]) * nx + at[0]]
        } else {
            0.0
        };
        assert_eq!(moved[v], expected);
    }
    // No displacement and a zero displacement leave the volume bitwise identical.
    assert_eq!(
        apply(&Warp::new([nx, ny, nz], [1.0; 3], &[]).unwrap(), &x),
        x
    );
    assert_eq!(apply(&warp([0.0; 3]), &x), x);
    let plane = |p: [f64; 3]| 1.0 + 2.0 * p[0] - 0.5 * p[1] + 0.25 * p[2];
    let place = |v: usize| [v % nx, v / nx % ny, v / (nx * ny)].map(|k| 0.4 * k as f64);
    let x: Vec<f64> = (0..all).map(|v| plane(place(v))).collect();
    let d = [0.13f32, 0.29, -0.07];
    let moved = apply(&warp(d), &x);
    for v in 0..all {
        let p = [0, 1, 2].map(|a| place(v)[a] + f64::from(d[a]));
        let inside = (0..3).all(|a| p[a] > 0.0 && p[a] < 0.4 * ([nx, ny, nz][a] - 1) as f64);
        assert!(!inside || (moved[v] - plane(p)).abs() < 1e-5);
    }
}

/// A hill rotated by a fifth of a turn, on increasingly fine voxels: trilinear interpolation has order 2.
#[test]
fn a_smooth_volume_is_warped_with_order_two() {
    let hill = |p: [f64; 3]| (-(p[0] - 0.6).powi(2) - 2.0 * p[1] * p[1] - p[2] * p[2]).exp();
    let (sin, cos) = (0.4 * std::f64::consts::PI).sin_cos();
    let error = |n: usize| {
        let side = 6.0 / n as f64;
        let place = |v: usize| {
            [v % n, v / n % n, v / (n * n)].map(|k| (k as f64 - 0.5 * (n - 1) as f64) * side)
        };
        let turned = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
        let by = |v: usize| {
            let (p, q) = (place(v), turned(place(v)));
            (v, [0, 1, 2].map(|a| (q[a] - p[a]) as f32))
        };
        let motion = Displacements {
            fraction: 1.0,
            by: &(0..n * n * n).map(by).collect::<Vec<_>>(),
        };
        let warp = Warp::new([n; 3], [side; 3], &[motion]).unwrap();
        let x: Vec<f64> = (0..n * n * n).map(|v| hill(place(v))).collect();
        let moved = apply(&warp, &x);
        let off = (0..n * n * n).map(|v| (moved[v] - hill(turned(place(v)))).powi(2));
        (off.sum::<f64>() / (n * n * n) as f64).sqrt()
    };
    let errors = [12, 24, 48].map(error);
    let order = |k: usize| (errors[k] / errors[k + 1]).log2();
    assert!(order(0) > 1.7 && order(1) > 1.85, "{errors:?}");
}

#[test]
fn a_warp_is_bitwise_independent_of_threads() {
    let warp = Warp::new(SHAPE, SIDES, &motions()).unwrap();
    let x = noise(210, 4);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let same = Warp::new(SHAPE, SIDES, &motions()).unwrap();
            assert!(same == warp);
            (apply(&same, &x), back(&same, &x))
        })
    };
    assert!(with(1) == with(3));
}

/// Slices of 12 x 12 pixels in three layers, by 8 views of 16 bins.
fn projector() -> Projector {
    let geometry = ParallelGeometry::half_turn(8, 16, 1.0).unwrap();
    Projector::new(
        &geometry,
        &ImageGrid::square(12, 1.0).unwrap(),
        Kernel::Strip,
    )
    .unwrap()
}

fn operator() -> StackOperator<f64> {
    projector()
        .stack_operator(3, StackOrder::ViewSliceBin)
        .unwrap()
}

/// A displacement of the whole volume.
fn shifted(by: [f32; 3]) -> Arc<Warp> {
    let by: Vec<_> = (0..432).map(|v| (v, by)).collect();
    let warp = Warp::new(
        [12, 12, 3],
        [1.0; 3],
        &[Displacements {
            fraction: 1.0,
            by: &by,
        }],
    );
    Arc::new(warp.unwrap())
}

fn states() -> Vec<MotionState<StackOperator<f64>>> {
    let state = |by, weights| MotionState {
        warps: Warps::new(vec![shifted(by)]).unwrap(),
        operator: operator(),
        weights,
    };
    let views = (0..8).map(|k| 1.0 + 0.25 * f64::from(k)).collect();
    vec![state([0.0; 3], vec![2.0]), state([0.7, -1.2, 0.4], views)]
}

#[test]
fn views_of_states_equal_those_of_the_warped_volumes_and_the_adjoint_is_exact() {
    let moving = MovingOperator::new(states()).unwrap();
    let x = noise(432, 6);
    let data = apply(&moving, &x);
    assert_eq!(data.len(), 2 * 8 * 3 * 16);
    let still = apply(&operator(), &x);
    let moved = apply(&operator(), &apply(&*shifted([0.7, -1.2, 0.4]), &x));
    for k in 0..384 {
        assert_eq!(data[k], 2.0 * still[k]);
        assert_eq!(data[384 + k], (1.0 + 0.25 * (k / 48) as f64) * moved[k]);
    }
    let off = adjoint_mismatch::<f64, _>(&moving, 1).unwrap();
    assert!(off < 1e-12, "{off}");
}

/// A product of three warps, which do not commute, equals the successive factors, and so does its adjoint.
#[test]
fn products_apply_their_factors_in_order() {
    let half: Vec<_> = (0..216).map(|v| (v, [0.3, -0.6, 0.9])).collect();
    let half = Warp::new(
        [12, 12, 3],
        [1.0; 3],
        &[Displacements {
            fraction: 0.7,
            by: &half,
        }],
    );
    let factors = [
        shifted([0.7, -1.2, 0.4]),
        Arc::new(half.unwrap()),
        shifted([2.0, 0.0, -0.5]),
    ];
    let x = noise(432, 9);
    let product = Warps::new(factors.to_vec()).unwrap();
    let expected = factors.iter().fold(x.clone(), |x, warp| apply(&**warp, &x));
    assert_eq!(apply(&product, &x), expected);
    let off = adjoint_mismatch::<f64, _>(&product, 1).unwrap();
    assert!(off < 1e-14, "{off}");
    let other = Arc::new(Warp::new([12, 12, 4], [1.0; 3], &[]).unwrap());
    let unequal = Warps::new(vec![factors[0].clone(), other]).unwrap_err();
    assert!(matches!(
        unequal,
        RadonError::WrongLength {
            given: 576,
            expected: 432,
            ..
        }
    ));
    assert!(matches!(
        Warps::new(Vec::new()),
        Err(RadonError::TooFew { .. })
    ));
}

/// A block at two positions: compensated OSEM recovers it as from as many views of a static block; without compensation it does not.
#[test]
fn osem_with_known_motion_recovers_a_moving_block() {
    let truth: Vec<f64> = (0..432)
        .map(|v| {
            let inside = (4..7).contains(&(v % 12)) && (5..8).contains(&(v / 12 % 12));
            f64::from(u8::from(inside && v / 144 == 1))
        })
        .collect();
    let ways = [[0.0f32; 3], [2.0, -1.0, 1.0]];
    let found = |known: bool| {
        let mut views = Vec::new();
        let mut all = Vec::new();
        for by in ways {
            views.extend(apply(&operator(), &apply(&*shifted(by), &truth)));
            let by = if known { by } else { [0.0; 3] };
            all.push((shifted(by), operator().subsets(4).unwrap()));
        }
        let subsets: Vec<_> = (0..4)
            .map(|k| {
                let (mut states, mut data) = (Vec::new(), Vec::new());
                for (j, (warp, subsets)) in all.iter().enumerate() {
                    let part = operator().subsets(4).unwrap().remove(k);
                    data.extend(subsets[k].data().iter().map(|i| 384 * j + i));
                    states.push(MotionState {
                        warps: Warps::new(vec![warp.clone()]).unwrap(),
                        operator: part.into_parts().0,
                        weights: vec![1.0],
                    });
                }
                let operator = MovingOperator::new(states).unwrap();
                Subset::new(operator, data)
            })
            .collect();
        let stopping = Stopping::default().with_max_iterations(60);
        let mut x = vec![1.0; 432];
        let options = EmOptions::default().with_stopping(stopping);
        osem(&subsets, &views, &mut x, &options, radon::no_observer).unwrap();
        let off = x
            .iter()
            .zip(&truth)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>();
        (off / dot(&truth, &truth)).sqrt()
    };
    let [known, unknown] = [true, false].map(found);
    println!("{known} {unknown}");
    assert!(known < 0.1 && unknown > 0.5, "{known} {unknown}");
}

#[test]
fn invalid_input_is_rejected() {
    let one = |voxel, by, share| {
        Warp::new(
            [4, 4, 4],
            [1.0; 3],
            &[Displacements {
                fraction: share,
                by: &[(voxel, by)],
            }],
        )
    };
    assert!(matches!(
        one(64, [0.0; 3], 1.0),
        Err(RadonError::OutOfRange {
            what: "voxel to warp",
            ..
        })
    ));
    assert!(matches!(
        one(3, [f32::NAN; 3], 1.0),
        Err(RadonError::NotFinite {
            what: "displacement",
            ..
        })
    ));
    assert!(matches!(
        one(3, [0.0; 3], f64::INFINITY),
        Err(RadonError::NotFinite {
            what: "fraction of a motion",
            ..
        })
    ));
    // A voxel moves for at most all of the time: by one motion, by two, or named twice.
    let twice = [(3, [1.0; 3]), (3, [2.0; 3])];
    let shares = |first, second| {
        let motion = |fraction, by| Displacements { fraction, by };
        Warp::new(
            [4; 3],
            [1.0; 3],
            &[motion(first, &twice[..1]), motion(second, &twice[1..])],
        )
    };
    let doubled = Displacements {
        fraction: 0.6,
        by: &twice,
    };
    for excessive in [
        one(3, [0.0; 3], 1.5),
        one(3, [0.0; 3], -0.5),
        shares(0.8, 0.3),
        Warp::new([4; 3], [1.0; 3], &[doubled]),
    ] {
        assert!(matches!(excessive, Err(RadonError::OutOfRange { .. })));
    }
    assert!(shares(0.7, 0.3).is_ok());
    assert!(matches!(
        Warp::new([0, 4, 4], [1.0; 3], &[]),
        Err(RadonError::OutOfRange { .. })
    ));
    assert!(matches!(
        Warp::new([1 << 20; 3], [1.0; 3], &[]),
        Err(RadonError::TooLarge { .. })
    ));
    assert!(matches!(
        Warp::new([4; 3], [1.0, 0.0, 1.0], &[]),
        Err(RadonError::NotPositive { .. })
    ));
    let warp = one(3, [1.0; 3], 1.0).unwrap();
    let short = warp
        .forward_into(&[0.0f64; 63], &mut [0.0; 64])
        .unwrap_err();
    assert!(matches!(
        short,
        RadonError::WrongLength {
            given: 63,
            expected: 64,
            ..
        }
    ));
    let short = warp.adjoint_into(&[0.0f64; 64], &mut [0.0; 3]).unwrap_err();
    assert!(matches!(short, RadonError::WrongLength { given: 3, .. }));
    let change = |change: &dyn Fn(&mut MotionState<StackOperator<f64>>)| {
        let mut states = states();
        change(&mut states[1]);
        MovingOperator::new(states).unwrap_err()
    };
    assert!(matches!(
        change(&|s| s.weights.clear()),
        RadonError::TooFew { .. }
    ));
    assert!(matches!(
        change(&|s| s.weights = vec![1.0; 7]),
        RadonError::WrongLength { .. }
    ));
    assert!(matches!(
        change(&|s| s.weights[2] = f64::NAN),
        RadonError::NotFinite { .. }
    ));
    let other = Warp::new([12, 12, 4], [1.0; 3], &[]).unwrap();
    assert!(matches!(
        change(&|s| s.warps = other.clone().into()),
        RadonError::WrongLength {
            given: 576,
            expected: 432,
            ..
        }
    ));
    let none = MovingOperator::<StackOperator<f64>>::new(Vec::new()).unwrap_err();
    assert!(matches!(none, RadonError::TooFew { .. }));
}
