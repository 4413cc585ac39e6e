//! Analytic objects against independent references: brute-force sampling, quadrature, conservation.

use crate::common::row_start;
use proptest::prelude::*;
use radon::{
    BinSampling, ImageGrid, ParallelGeometry, Phantom2, Phantom3, RadonError, Shape2, Shape3,
    SliceAxis, StackOrder,
};
use std::f64::consts::PI;

/// The axes z, x, y... of a body first upright, turned 45 degrees about x, then 45 degrees about y: images of x, y, z.
fn tilted() -> [[f64; 3]; 3] {
    let h = 0.5f64.sqrt();
    [[h, 0.0, -h], [0.5, h, 0.5], [0.5, -h, 0.5]]
}

fn plane_shapes() -> Vec<Shape2> {
    let not_convex_clockwise = vec![
        [0.0, 1.5],
        [0.4, 0.3],
        [1.4, 0.2],
        [0.2, -0.1],
        [-1.1, -1.2],
        [-0.6, 0.4],
    ];
    vec![
        Shape2::ellipse([0.3, -0.2], [1.7, 0.6], 0.5).unwrap(),
        Shape2::rectangle([-0.4, 0.1], [1.9, 0.8], -0.7).unwrap(),
        Shape2::rectangle([0.05, 0.15], [1.0, 0.5], 0.0).unwrap(),
        Shape2::polygon(not_convex_clockwise).unwrap(),
        Shape2::gaussian([0.2, 0.1], [0.3, 0.11], 0.9).unwrap(),
        Shape2::gaussian([-0.2, 0.3], [0.2, 0.4], 0.0).unwrap(),
    ]
}

fn solid_shapes() -> Vec<Shape3> {
    let upright = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut shapes = vec![
        Shape3::ellipsoid([0.3, -0.2, 0.1], [0.5, 0.7, 1.6], tilted()).unwrap(),
        Shape3::ellipsoid([0.0, 0.1, -0.1], [0.9, 0.4, 0.6], upright).unwrap(),
        Shape3::gaussian([0.1, 0.2, -0.1], [0.15, 0.2, 0.3], tilted()).unwrap(),
        Shape3::gaussian([0.1, -0.1, 0.0], [0.2, 0.15, 0.3], upright).unwrap(),
    ];
    for section in plane_shapes().into_iter().take(4) {
        shapes.push(Shape3::prism(section, [-0.4, 0.9]).unwrap());
    }
    shapes
}

/// Midpoint rule for the mean over an interval of length `width` about `c`.
fn mean(c: f64, width: f64, n: usize, f: impl Fn(f64) -> f64) -> f64 {
    let h = width / n as f64;
    let sum: f64 = (0..n)
        .map(|i| f(c - 0.5 * width + (i as f64 + 0.5) * h))
        .sum();
    sum / n as f64
}

#[test]
fn line_integrals_agree_with_the_values_along_the_line() {
    // The position of a step is accurate to half a panel of 1e-4; at most four steps.
    let tolerance = 2.5e-4;
    for shape in plane_shapes() {
        for (theta, s) in [
            (0.0, 0.21),
            (0.4, -0.3),
            (2.2, 0.5),
            (4.0, 0.05),
            (PI / 2.0, 0.2),
        ] {
            let (sin, cos) = f64::sin_cos(theta);
            let point = |t: f64| [s * cos - t * sin, s * sin + t * cos];
            let sum = 8.0 * mean(0.0, 8.0, 80_000, |t| shape.value(point(t)));
            let got = shape.line_integral(theta, s);
            assert!((got - sum).abs() < tolerance, "{shape:?}: {got} {sum}");
        }
    }
    for shape in solid_shapes() {
        for (theta, s, z) in [(0.0, 0.21, 0.1), (0.7, -0.3, 0.3), (2.5, 0.2, -0.33)] {
            let (sin, cos) = f64::sin_cos(theta);
            let point = |t: f64| [s * cos - t * sin, s * sin + t * cos, z];
            let sum = 8.0 * mean(0.0, 8.0, 80_000, |t| shape.value(point(t)));
            let got = shape.line_integral(theta, s, z);
            assert!((got - sum).abs() < tolerance, "{shape:?}: {got} {sum}");
        }
    }
}

#[test]
fn bin_means_agree_with_averages_of_line_integrals() {
    for shape in plane_shapes() {
        for (theta, s, width) in [
            (0.1, 0.3, 0.2),
            (1.9, -0.7, 1.1),
            (0.9, 0.0, 6.0),
            (0.0, 0.5, 0.1),
        ] {
            let expected = mean(s, width, 200_000, |s| shape.line_integral(theta, s));
            // The error of the midpoint rule is panel^1.5 = 2e-7 at the rim of an ellipse, and a panel at a step, 3e-5 of 0.1 ... 6.
            let got = shape.bin_mean(theta, s, width);
            assert!((got - expected).abs() < 1e-5, "{shape:?}: {got} {expected}");
        }
    }
    for shape in solid_shapes() {
        for (theta, c, size) in [
            (0.1, [0.3, 0.2], [0.2, 0.3]),
            (2.0, [-0.4, -0.1], [0.5, 0.2]),
            (0.8, [0.1, 0.0], [0.05, 0.04]),
            (5.0, [0.2, 0.1], [3.0, 4.0]),
        ] {
            let expected = mean(c[1], size[1], 500, |z| {
                mean(c[0], size[0], 500, |s| shape.line_integral(theta, s, z))
            });
            // The error of a step between two sample planes is up to half a panel: 1/325 of the prism's height in the widest cell.
            let got = shape.bin_mean(theta, c, size);
            assert!(
                (got - expected).abs() < 3.5e-3 * (0.01 + expected),
                "{shape:?}: {got} {expected}"
            );
        }
    }
}

#[test]
fn cell_means_agree_with_averages_of_sampled_values() {
    for shape in plane_shapes() {
        for (c, sides) in [
            ([0.2, 0.1], [0.7, 0.3]),
            ([-0.5, -0.4], [0.4, 0.9]),
            ([1.2, 0.2], [1.0, 1.0]),
        ] {
            let expected = mean(c[1], sides[1], 1000, |y| {
                mean(c[0], sides[0], 1000, |x| shape.value([x, y]))
            });
            // Each boundary sample may be wrong by 1/1000 of a row, and the errors mostly cancel.
            let got = shape.rectangle_mean(c, sides);
            assert!((got - expected).abs() < 6e-4, "{shape:?}: {got} {expected}");
        }
    }
    for shape in solid_shapes() {
        for (c, sides) in [
            ([0.2, 0.1, 0.3], [0.7, 0.3, 0.5]),
            ([-0.3, -0.4, -0.5], [0.5, 0.6, 0.7]),
        ] {
            let expected = mean(c[2], sides[2], 120, |z| {
                mean(c[1], sides[1], 120, |y| {
                    mean(c[0], sides[0], 120, |x| shape.value([x, y, z]))
                })
            });
            // The error of a flat end between two sample planes is up to 1/240 of the whole.
            let got = shape.box_mean(c, sides);
            assert!(
                (got - expected).abs() < 4.5e-3,
                "{shape:?}: {got} {expected}"
            );
        }
    }
}

#[test]
fn every_view_and_every_image_conserve_the_integral() {
    let weighted = |(i, shape)| (1.0 + i as f64, shape);
    let plane = Phantom2::new(plane_shapes().into_iter().enumerate().map(weighted)).unwrap();
    // Everything lies inside the grids (the widest Gaussian to 5.5 standard deviations in x, 1e-8, 3.5 cm); boundary
    // cells have rounding errors of about 1e-15 each.
    for (nx, ny, [dx, dy]) in [(131, 140, [0.06, 0.06]), (66, 210, [0.12, 0.04])] {
        let grid = ImageGrid::anisotropic(nx, ny, [dx, dy])
            .and_then(|g| g.with_centre([0.1, -0.05]))
            .unwrap();
        let total = plane.image::<f64>(&grid).unwrap().iter().sum::<f64>() * dx * dy;
        assert!((total / plane.integral() - 1.0).abs() < 1e-12, "{total}");
    }
    let geometry = ParallelGeometry::new([0.0, 0.3, 1.1, 2.0, 4.5], 150, 0.06)
        .and_then(|g| g.with_offset(0.21))
        .unwrap();
    for view in plane
        .sinogram::<f64>(&geometry, BinSampling::Mean)
        .unwrap()
        .chunks(150)
    {
        let total = view.iter().sum::<f64>() * 0.06;
        assert!((total / plane.integral() - 1.0).abs() < 1e-12, "{total}");
    }

    let weighted = |(i, shape)| (1.0 + i as f64, shape);
    let solid = Phantom3::new(solid_shapes().into_iter().enumerate().map(weighted)).unwrap();
    let slices = SliceAxis::new(57, 0.11)
        .and_then(|s| s.with_centre(0.02))
        .unwrap();
    let grid = ImageGrid::anisotropic(61, 32, [0.1, 0.2]).unwrap();
    let volume: Vec<f64> = solid.volume(&grid, &slices).unwrap();
    let total = volume.iter().sum::<f64>() * 0.1 * 0.2 * 0.11;
    assert!((total / solid.integral() - 1.0).abs() < 1e-11, "{total}");
    let geometry = ParallelGeometry::new([0.2, 1.9], 70, 0.1).unwrap();
    for order in [StackOrder::ViewSliceBin, StackOrder::SliceViewBin] {
        let sinogram: Vec<f64> = solid
            .sinogram(&geometry, &slices, BinSampling::Mean, order)
            .unwrap();
        for view_idx in 0..2 {
            let rows =
                (0..57).map(|slice_idx| row_start(order, [view_idx, slice_idx], [2, 57, 70]));
            let total = rows
                .map(|r| sinogram[r..r + 70].iter().sum::<f64>())
                .sum::<f64>()
                * 0.1
                * 0.11;
            assert!((total / solid.integral() - 1.0).abs() < 1e-11, "{total}");
        }
    }
}

#[test]
fn an_ellipsoid_agrees_with_the_quadratic_formula_for_its_rays() {
    let (c, s) = ([3.3, -2.1, 1.7], [28.0, 28.0, 90.0]);
    let shape = Shape3::ellipsoid(c, s, tilted()).unwrap();
    for (theta, u, z) in [
        (0.0, 1.0, 0.0),
        (0.8, -17.3, 30.0),
        (2.1, 20.0, -40.0),
        (3.0, 5.0, 66.0),
    ] {
        let (sin, cos) = f64::sin_cos(theta);
        let (mut a, mut b, mut q) = (0.0, 0.0, -1.0);
        for (axis, len) in tilted().iter().zip(s) {
            let p =
                (axis[0] * (u * cos - c[0]) + axis[1] * (u * sin - c[1]) + axis[2] * (z - c[2]))
                    / len;
            let d = (axis[1] * cos - axis[0] * sin) / len;
            a += d * d;
            b += p * d;
            q += p * p;
        }
        let chord = 2.0 * f64::max(b * b - a * q, 0.0).sqrt() / a;
        assert!(
            (shape.line_integral(theta, u, z) - chord).abs() < 1e-11,
            "{chord}"
        );
    }
}

/// Chords of a rotated rectangle along its sides and at 45 degrees to them, where they form a trapezoid, about its centre.
#[test]
fn a_rotated_rectangle_has_its_chords_area_and_bounds() {
    let (c, [a, b], phi) = ([3.0, -2.0], [1.6, 0.6], 0.5f64);
    let shape = Shape2::rectangle(c, [a, b], phi).unwrap();
    let chord = |turn: f64, s: f64| {
        let (sin, cos) = (phi + turn).sin_cos();
        shape.line_integral(phi + turn, c[0] * cos + c[1] * sin + s)
    };
    let h = 0.5f64.sqrt();
    // Half the top and half the base of the trapezoid are h (a - b) / 2 and h (a + b) / 2; its height is b / h.
    for (turn, s, expected) in [
        (0.0, 0.79, b),
        (0.0, -0.81, 0.0),
        (PI / 2.0, 0.29, a),
        (PI / 2.0, -0.31, 0.0),
        (PI / 4.0, 0.3, b / h),
        (PI / 4.0, 0.5 * h * a, b / h / 2.0),
        (PI / 4.0, 0.79, 0.0),
    ] {
        for s in [s, -s] {
            // Rounding of corners about 3.
            assert!((chord(turn, s) - expected).abs() < 1e-13, "{turn} {s}");
        }
    }
    assert!((shape.integral() - a * b).abs() < 1e-14);
    // The ball about a prism passes through its corners.
    let (centre, radius) = Shape3::prism(shape, [1.0, 5.0]).unwrap().bounding_ball();
    let off = (0..3).map(|k| (centre[k] - [c[0], c[1], 3.0][k]).abs());
    assert!(off.fold(0.0, f64::max) < 1e-14, "{centre:?}");
    assert!((radius - (0.8f64.powi(2) + 0.3 * 0.3 + 4.0).sqrt()).abs() < 1e-14);
}

#[test]
fn a_line_along_an_edge_has_the_mean_of_both_sides() {
    let square = Shape2::rectangle([0.0; 2], [2.0, 3.0], 0.0).unwrap();
    assert_eq!(square.line_integral(0.0, 1.0), 1.5);
    assert_eq!(square.line_integral(0.0, -1.0), 1.5);
    assert_eq!(square.line_integral(0.0, 0.999), 3.0);
    let slab = Shape3::prism(square, [0.0, 1.0]).unwrap();
    assert_eq!(slab.line_integral(0.0, 0.0, 1.0), 1.5);
    assert_eq!(slab.line_integral(0.0, 0.0, 0.5), 3.0);
}

#[test]
fn shepp_logan_has_its_known_grey_values() {
    let (head, solid) = (
        Phantom2::shepp_logan(1.0).unwrap(),
        Phantom3::shepp_logan(1.0).unwrap(),
    );
    for (point, value, in_solid) in [
        ([0.0, 0.9], 1.0, 1.0),   // skull
        ([0.0, -0.3], 0.2, 0.2),  // brain
        ([0.25, 0.05], 0.0, 0.0), // ventricles
        ([-0.2, -0.05], 0.0, 0.0),
        ([0.0, 0.35], 0.3, 0.3), // large disc
        ([0.0, 0.09], 0.3, 0.2), // a small disc, which lies higher in the solid
        ([0.06, -0.605], 0.3, 0.3),
        ([0.95, 0.95], 0.0, 0.0),
    ] {
        assert!((head.value(point) - value).abs() < 1e-12, "{point:?}");
        let got = solid.value([point[0], point[1], 0.0]);
        assert!((got - in_solid).abs() < 1e-12, "{point:?} {got}");
    }
    assert!((solid.value([0.0, -0.1, 0.25]) - 0.3).abs() < 1e-12);
    // The line formula of ellipses, from a second copy of Toft's table.
    let entries = [
        (1.0, 0.69, 0.92, 0.0, 0.0, 0.0f64),
        (-0.8, 0.6624, 0.874, 0.0, -0.0184, 0.0),
        (-0.2, 0.11, 0.31, 0.22, 0.0, -18.0),
        (-0.2, 0.16, 0.41, -0.22, 0.0, 18.0),
        (0.1, 0.21, 0.25, 0.0, 0.35, 0.0),
        (0.1, 0.046, 0.046, 0.0, 0.1, 0.0),
        (0.1, 0.046, 0.046, 0.0, -0.1, 0.0),
        (0.1, 0.046, 0.023, -0.08, -0.605, 0.0),
        (0.1, 0.023, 0.023, 0.0, -0.606, 0.0),
        (0.1, 0.023, 0.046, 0.06, -0.605, 0.0),
    ];
    for (theta, s) in [(0.0, 0.1), (0.6, -0.2), (2.0, 0.6), (1.2, 0.01)] {
        let mut sum = 0.0;
        for (value, a, b, x, y, degrees) in entries {
            let g: f64 = theta - f64::to_radians(degrees);
            let a2 = (a * g.cos()).powi(2) + (b * g.sin()).powi(2);
            let t = s - x * f64::cos(theta) - y * f64::sin(theta);
            sum += value * 2.0 * a * b / a2 * (a2 - t * t).max(0.0).sqrt();
        }
        assert!((head.line_integral(theta, s) - sum).abs() < 1e-14);
    }
}

#[test]
fn sinograms_are_bitwise_independent_of_order_and_threads() {
    let head = Phantom3::shepp_logan(1.0).unwrap();
    let geometry = ParallelGeometry::new([0.3, 2.0, 1.0], 33, 0.07)
        .and_then(|g| g.with_offset(0.1))
        .unwrap();
    let slices = SliceAxis::new(6, 0.2)
        .and_then(|s| s.with_centre(0.1))
        .unwrap();
    let run = |threads, order| -> Vec<f64> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            head.sinogram(&geometry, &slices, BinSampling::Centre, order)
                .unwrap()
        })
    };
    let by_view = run(1, StackOrder::ViewSliceBin);
    let by_slice = run(3, StackOrder::SliceViewBin);
    for v in 0..3 {
        for s in 0..6 {
            for k in 0..33 {
                let at = |order: StackOrder| row_start(order, [v, s], [3, 6, 33]) + k;
                let got = by_view[at(StackOrder::ViewSliceBin)];
                let (bin, z) = (geometry.bin_centre(k), slices.slice_centre(s));
                let expected = head.line_integral(geometry.angles()[v], bin, z);
                assert!((got - expected).abs() < 1e-14);
                assert_eq!(
                    got.to_bits(),
                    by_slice[at(StackOrder::SliceViewBin)].to_bits()
                );
            }
        }
    }
}

#[test]
fn bad_shapes_are_rejected_with_their_values() {
    let id = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(matches!(
        Shape2::ellipse([0.0, f64::NAN], [1.0, 1.0], 0.0),
        Err(RadonError::NotFinite { .. })
    ));
    assert!(matches!(
        Shape2::ellipse([0.0; 2], [2.0, 1.0], 90.0),
        Err(RadonError::OutOfRange {
            what: "shape angle in radians",
            given: 90.0,
            ..
        })
    ));
    assert_eq!(
        Shape2::ellipse([0.0; 2], [1.0, -2.0], 0.0).unwrap_err(),
        RadonError::NotPositive {
            what: "ellipse semi-axis",
            given: -2.0
        }
    );
    for corners in [
        vec![],
        vec![[0.0, 0.0], [1.0, 0.0]],
        vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]],
        vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 2.0]], // bow tie
    ] {
        let n = corners.len();
        assert!(matches!(
            Shape2::polygon(corners),
            Err(RadonError::DegeneratePolygon { corners, .. }) if corners == n
        ));
    }
    let sheared = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.1, 0.99]];
    assert!(matches!(
        Shape3::ellipsoid([0.0; 3], [1.0; 3], sheared),
        Err(RadonError::NotOrthonormal { deviation }) if (deviation - 0.1).abs() < 1e-12
    ));
    let prism = Shape3::prism(plane_shapes().remove(0), [1.0, 1.0]);
    for refused in [
        Shape2::gaussian([0.0; 2], [0.0, 1.0], 0.0).err(),
        Shape3::ellipsoid([0.0; 3], [1.0, 0.0, 1.0], id).err(),
        prism.err(),
        Phantom2::shepp_logan(0.0).err(),
        SliceAxis::new(3, -1.0).err(),
    ] {
        assert!(
            matches!(refused, Some(RadonError::NotPositive { .. })),
            "{refused:?}"
        );
    }
    for refused in [
        Shape2::rectangle([0.0; 2], [1.0, f64::INFINITY], 0.0).err(),
        Shape3::gaussian([f64::INFINITY, 0.0, 0.0], [1.0; 3], id).err(),
        Phantom2::new([(f64::NAN, plane_shapes().remove(0))]).err(),
        Phantom3::new([(f64::INFINITY, solid_shapes().remove(0))]).err(),
        Phantom3::shepp_logan(f64::NAN).err(),
        SliceAxis::new(3, 1.0).unwrap().with_centre(f64::NAN).err(),
    ] {
        assert!(
            matches!(refused, Some(RadonError::NotFinite { .. })),
            "{refused:?}"
        );
    }
    let none = SliceAxis::new(0, 1.0);
    assert!(matches!(
        none,
        Err(RadonError::TooFew {
            given: 0,
            least: 1,
            ..
        })
    ));
}

proptest! {
    /// Closed forms of different cells must agree: a cell is the sum of its parts. Cells intersect outlines in all ways, and some are centred on the
    /// shape.
    #[test]
    fn cells_are_the_sum_of_their_parts(
        which in 0usize..8,
        c in prop::array::uniform3(-1.2f64..1.2),
        sides in prop::array::uniform3(0.01f64..1.5),
        cut in 0.1f64..0.9,
        theta in -7.0f64..7.0,
        centred in any::<bool>(),
    ) {
        let (plane, solid) = (&plane_shapes()[which % 6], &solid_shapes()[which]);
        let c = if centred { solid.bounding_ball().0 } else { c };
        // Contents have errors of about 1e-14; those of means are larger by the inverse size of the smaller part.
        let parts = |axis: usize, mean: &dyn Fn([f64; 3], [f64; 3]) -> f64| {
            let (mut c0, mut c1, mut s0, mut s1) = (c, c, sides, sides);
            s0[axis] *= cut;
            s1[axis] *= 1.0 - cut;
            c0[axis] -= 0.5 * s1[axis];
            c1[axis] += 0.5 * s0[axis];
            (cut * mean(c0, s0) + (1.0 - cut) * mean(c1, s1) - mean(c, sides)).abs()
        };
        let volume = sides.iter().product::<f64>() * cut.min(1.0 - cut);
        for axis in 0..3 {
            let error = parts(axis, &|c, s| solid.box_mean(c, s));
            prop_assert!(error < 1e-13 + 1e-13 / volume, "{}", error);
        }
        for axis in [0, 2] {
            let error = parts(axis, &|c, s| solid.bin_mean(theta, [c[0], c[2]], [s[0], s[2]]));
            prop_assert!(error < 1e-13 + 1e-14 / volume, "{}", error);
        }
        for axis in [0, 1] {
            let error = parts(axis, &|c, s| plane.rectangle_mean([c[0], c[1]], [s[0], s[1]]));
            prop_assert!(error < 1e-13 + 1e-14 / volume, "{}", error);
        }
    }

    /// The line (theta, s) is the line (theta + pi, -s).
    #[test]
    fn opposite_views_have_the_same_lines(
        which in 0usize..6, theta in -4.0f64..4.0, s in -1.5f64..1.5, z in -0.5f64..0.5,
    ) {
        let (plane, solid) = (&plane_shapes()[which], &solid_shapes()[which]);
        let (a, b) = (plane.bin_mean(theta, s, 0.3), plane.bin_mean(theta + PI, -s, 0.3));
        prop_assert!((a - b).abs() < 1e-12);
        let (a, b) = (solid.bin_mean(theta, [s, z], [0.3, 0.2]), solid.bin_mean(theta + PI, [-s, z], [0.3, 0.2]));
        prop_assert!((a - b).abs() < 1e-11);
    }
}
