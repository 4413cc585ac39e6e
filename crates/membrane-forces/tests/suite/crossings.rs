//! Curves that touch or cross themselves, collapse or are inside out.

use membrane_forces::{CurvePoint, Membrane, MembraneError, ReferenceShape, collapse};

/// All segments share their range of x: checking each pair would take minutes.
#[test]
fn a_long_polyline_across_the_axis_is_checked_quickly() {
    let points: Vec<[f64; 2]> = (0..200_000)
        .map(|k| [0.0, 1.0 - 1e-5 * f64::from(k)])
        .collect();
    assert!(ReferenceShape::polyline(&points).is_ok());
}

/// Polylines on a grid, whose nodes often touch other segments: against all pairs of segments in exact arithmetic.
#[test]
fn polylines_that_touch_or_cross_themselves_are_rejected() {
    type Point = [i64; 2];
    let way = |p: Point, q: Point| [q[0] - p[0], q[1] - p[1]];
    let cross = |u: Point, v: Point| u[0] * v[1] - u[1] * v[0];
    let dot = |u: Point, v: Point| u[0] * v[0] + u[1] * v[1];
    // a + t u = c + r v at t = w x v / u x v and r = w x u / u x v
    let meet = |points: &[Point], first: usize, second: usize| {
        let (a, c) = (points[first], points[second]);
        let (u, v) = (way(a, points[first + 1]), way(c, points[second + 1]));
        let (w, all) = (way(a, c), cross(u, v));
        if second == first + 1 {
            return all == 0 && dot(u, v) < 0;
        }
        if all != 0 {
            let parts = [cross(w, v), cross(w, u)].map(|part| part * all.signum());
            return parts.iter().all(|part| (0..=all.abs()).contains(part));
        }
        let [from, to] = [dot(w, u), dot(w, u) + dot(v, u)];
        cross(w, u) == 0 && from.max(to) >= 0 && from.min(to) <= dot(u, u)
    };
    let mut random = 1u64;
    let mut below = |n: i64| {
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (random >> 33) as i64 % n
    };
    let mut counts = [0; 2];
    for _ in 0..3000 {
        let inner: [Point; 4] = std::array::from_fn(|_| [below(5) - 1, below(7) - 3]);
        let points = [&[[0, 2]], &inner[..], &[[0, -2]]].concat();
        if points.windows(2).any(|pair| pair[0] == pair[1]) {
            continue;
        }
        let mut pairs = (1..5).flat_map(|second| (0..second).map(move |first| [first, second]));
        let crosses = pairs.any(|[first, second]| meet(&points, first, second));
        let floats: Vec<[f64; 2]> = points.iter().map(|p| p.map(|v| v as f64)).collect();
        match ReferenceShape::polyline(&floats) {
            Err(MembraneError::SelfCrossing { first, second }) => {
                assert!(meet(&points, first, second), "{points:?} {first} {second}");
            }
            _ => assert!(!crosses, "{points:?}"),
        }
        counts[usize::from(crosses)] += 1;
    }
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
}

/// The node returned is that behind the first crossing, or the middle of a curve that is inside out.
#[test]
fn a_collapsed_curve_is_located() {
    let cup = [
        [0.0, 1.0],
        [1.0, 1.2],
        [2.0, 0.5],
        [2.0, -0.5],
        [1.0, -1.2],
        [0.0, -1.0],
    ];
    let dome = [
        [0.0, 1.0],
        [1.0, 0.6],
        [1.5, 0.2],
        [1.5, -0.2],
        [1.0, -0.6],
        [0.0, -1.0],
    ];
    let mirrored = |points: [[f64; 2]; 6]| points.map(|[x, y]| [-x, y]);
    let mut across = cup;
    (across[2][1], across[3][1]) = (-0.5, 0.5);
    let looped = [
        [0.0, 1.0],
        [3.0, 1.0],
        [3.0, 0.2],
        [1.0, 0.2],
        [1.0, 1.5],
        [0.0, -1.0],
    ];
    for (start, points, expected) in [
        (cup, cup, None),
        (cup, across, Some(2)),
        (cup, looped, Some(1)),
        // a start that crosses itself allows its crossing
        (looped, looped, None),
        (cup, mirrored(cup), Some(3)),
        (cup, mirrored(dome), Some(3)),
        // pushed through
        (dome, mirrored(dome), None),
        (dome, mirrored(cup), None),
    ] {
        let found = collapse(&start, &points, &mut Vec::new());
        assert_eq!(found, expected, "{start:?} {points:?}");
    }
}

/// An ellipse that runs to the other side encloses a negative volume, -4 pi a b^2 / 6; exchanged ends are rejected, too.
#[test]
fn curves_that_are_inside_out_are_rejected() {
    use std::f64::consts::PI;
    let ellipse = |a: f64, b: f64| {
        let curve = move |s: f64| {
            let (sin, cos) = (PI * s).sin_cos();
            CurvePoint {
                position: [a * sin, b * cos],
                first: [a * PI * cos, -b * PI * sin],
                second: [-a * PI * PI * sin, -b * PI * PI * cos],
            }
        };
        ReferenceShape::from_function(curve, &[])
    };
    for (a, b) in [(3.0, -2.0), (-3.0, 2.0)] {
        let refused = ellipse(a, b).unwrap_err();
        let MembraneError::InsideOut { volume } = refused else {
            panic!("{refused:?}")
        };
        // 64 samples
        assert!((volume / (-8.0 * PI) - 1.0).abs() < 1e-2, "{refused}");
    }
    let membrane = Membrane::new(ellipse(3.0, 2.0).unwrap());
    let swapped = membrane.clone().with_ends([[0.0, -2.0], [0.0, 2.0]]);
    assert!(matches!(swapped, Err(MembraneError::EndsExchanged { .. })));
    for ends in [[[0.0, 1.0], [0.0, 1.0]], [[0.0, 2.0], [0.1, 0.0]]] {
        let beside = membrane.clone().with_ends(ends);
        assert!(matches!(beside, Err(MembraneError::EndsOnOneSide { .. })));
    }
    assert!(membrane.with_ends([[0.0, 2.2], [0.0, -2.2]]).is_ok());
}

/// Polylines and functions that run the other way, with exchanged coordinates, or over a part of the curve are errors.
#[test]
fn reference_curves_that_are_no_body_are_rejected() {
    let polyline = |points: &[[f64; 2]]| ReferenceShape::polyline(points);
    assert!(polyline(&[[0.0, 2.0], [3.0, 0.0], [0.0, -2.0]]).is_ok());
    for inside_out in [
        [[0.0, -2.0], [3.0, 0.0], [0.0, 2.0]],
        [[2.0, 0.0], [0.0, 3.0], [-2.0, 0.0]],
    ] {
        let refused = polyline(&inside_out).unwrap_err();
        assert!(
            matches!(refused, MembraneError::InsideOut { volume } if volume < 0.0),
            "{refused}"
        );
    }
    let ([from, middle], to) = ([[0.0, 2.0], [2.0, 1.5]], [3.0, 0.0]);
    let expected = MembraneError::EndsOnOneSide { from, to };
    assert_eq!(polyline(&[from, middle, to]).unwrap_err(), expected);
    let part = |s: f64| {
        let (sin, cos) = s.sin_cos();
        CurvePoint {
            position: [3.0 * sin, 2.0 * cos],
            first: [3.0 * cos, -2.0 * sin],
            second: [-3.0 * sin, -2.0 * cos],
        }
    };
    let refused = ReferenceShape::from_function(part, &[]).unwrap_err();
    assert!(
        matches!(refused, MembraneError::EndsOnOneSide { .. }),
        "{refused}"
    );
}
