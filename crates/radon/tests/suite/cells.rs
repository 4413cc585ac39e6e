//! Averages of discs, balls and Gaussians over bins, rectangles and boxes against closed forms.

use radon::{Shape2, Shape3};
use std::f64::consts::PI;

const UPRIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Perpendicular unit vectors, none along an axis of the grid: its cells are sheared in the frame of a shape with unequal axes.
fn tilted() -> [[f64; 3]; 3] {
    let h = 0.5f64.sqrt();
    [[h, 0.0, -h], [0.5, h, 0.5], [0.5, -h, 0.5]]
}

fn disc() -> Shape2 {
    Shape2::ellipse([0.0; 2], [1.0; 2], 0.0).unwrap()
}

fn ball() -> Shape3 {
    Shape3::ellipsoid([0.0; 3], [1.0; 3], UPRIGHT).unwrap()
}

/// The part of a shape in a rectangle or box, and of its line integrals in a bin.
fn in_rectangle(shape: &Shape2, centre: [f64; 2], sides: [f64; 2]) -> f64 {
    shape.rectangle_mean(centre, sides) * sides[0] * sides[1]
}

fn in_box(shape: &Shape3, centre: [f64; 3], sides: [f64; 3]) -> f64 {
    shape.box_mean(centre, sides) * sides[0] * sides[1] * sides[2]
}

fn in_bin(shape: &Shape3, theta: f64, centre: [f64; 2], size: [f64; 2]) -> f64 {
    shape.bin_mean(theta, centre, size) * size[0] * size[1]
}

#[test]
fn cells_around_disc_and_ball_contain_all_of_them() {
    let area = in_rectangle(&disc(), [0.3, 0.2], [6.0, 5.0]);
    assert!((area - PI).abs() < 1e-14, "{area}");
    for theta in [0.0, 0.7] {
        let volume = in_bin(&ball(), theta, [0.3, -0.2], [6.0, 5.0]);
        assert!((volume - 4.0 * PI / 3.0).abs() < 2e-14, "{volume}");
    }
    let sheared = Shape3::ellipsoid([0.1, -0.2, 0.15], [0.5, 0.7, 0.9], tilted()).unwrap();
    let volume = in_box(&sheared, [0.0; 3], [2.5, 2.4, 2.2]);
    let whole = 4.0 * PI / 3.0 * 0.5 * 0.7 * 0.9;
    assert!((volume - whole).abs() < 1e-13, "{volume}");
}

#[test]
fn cells_that_end_at_the_centre_contain_a_half_or_an_octant() {
    let half = in_rectangle(&disc(), [1.0, 0.0], [2.0, 4.0]);
    assert!((half - PI / 2.0).abs() < 1e-14, "{half}");
    let half = in_bin(&ball(), 0.0, [1.0, 0.0], [2.0, 4.0]);
    assert!((half - 2.0 * PI / 3.0).abs() < 2e-14, "{half}");
    let octant = in_box(&ball(), [1.0; 3], [2.0; 3]);
    assert!((octant - PI / 6.0).abs() < 1e-14, "{octant}");
}

#[test]
fn a_spherical_cap_has_its_known_volume() {
    // Slab 0.3 <= x <= 5: cap of height 0.7, volume π h² (3 - h) / 3.
    let cap = in_box(&ball(), [2.65, 0.0, 0.0], [4.7, 6.0, 6.0]);
    // Relative rounding of the average over a box of 169 units of volume.
    assert!((cap - PI * 0.49 * 2.3 / 3.0).abs() < 1e-13, "{cap}");
}

#[test]
fn small_cells_tile_a_tilted_ellipsoid() {
    let semi_axes = [0.8, 1.1, 0.9];
    let ellipsoid = Shape3::ellipsoid([0.013, -0.007, 0.003], semi_axes, tilted()).unwrap();
    let (sides, n) = ([0.22, 0.2, 0.24], 7);
    let mut total = 0.0;
    for i in -n..=n {
        for j in -n..=n {
            for k in -n..=n {
                let at = [i, j, k].map(f64::from);
                total += in_box(&ellipsoid, [0, 1, 2].map(|a| at[a] * sides[a]), sides);
            }
        }
    }
    let whole = 4.0 * PI / 3.0 * semi_axes.iter().product::<f64>();
    assert!((total - whole).abs() < 1e-11, "{total}");
}

/// Cells from a fraction of the width of the hill to a hundred million times its size contain the whole integral, in a time that does not
/// grow with their size.
#[test]
fn a_cell_of_any_size_about_the_hill_contains_its_integral() {
    let flat = Shape2::gaussian([0.0; 2], [0.4, 0.9], 0.6).unwrap();
    let solid = Shape3::gaussian([0.0; 3], [0.7, 0.5, 0.9], tilted()).unwrap();
    for size in [20.0, 1e3, 1e8] {
        // Rounding of places, in standard deviations.
        let off = 1e-12 + 5e-15 * size;
        let area = in_rectangle(&flat, [0.3 * size, -0.2 * size], [2.0 * size, 2.4 * size]);
        let whole = area / (2.0 * PI * 0.4 * 0.9);
        assert!((whole - 1.0).abs() < off, "{size:e}: {whole}");
        let centre = [0.3, -0.2, 0.1].map(|x| x * size);
        let volume = in_box(&solid, centre, [2.0 * size, 2.2 * size, 1.8 * size]);
        let whole = volume / ((2.0 * PI).powf(1.5) * 0.7 * 0.5 * 0.9);
        assert!((whole - 1.0).abs() < off, "{size:e}: {whole}");
    }
}

/// Bins of any width have an error of 1e-15 of the peak, on either side of the width where the formula changes: against Gauss's rule with
/// four nodes, whose error is below 1e-18 for these widths.
#[test]
fn narrow_bins_agree_with_quadrature() {
    let hill = Shape2::gaussian([0.0; 2], [1.0; 2], 0.0).unwrap();
    let rule = [
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_2),
    ];
    for k in 0..60 {
        let middle = 0.15 * f64::from(k) - 3.0;
        let value = |x: f64| (-0.5 * x * x).exp();
        for half in [1e-300, 1e-20, 1e-9, 1e-5, 1e-4, 9.9e-3, 1e-2, 1.01e-2] {
            let pair = |(x, w): (f64, f64)| {
                0.5 * w * (value(middle - x * half) + value(middle + x * half))
            };
            let expected: f64 = rule.into_iter().map(pair).sum();
            // A few roundings; error functions have an error of 1e-14 near 0.01.
            let bound = if half > 1e-2 { 1e-14 } else { 1e-15 };
            let mean = hill.bin_mean(0.0, middle, 2.0 * half) / (2.0 * PI).sqrt();
            assert!((mean - expected).abs() < bound, "{middle} {half}");
        }
    }
}

#[test]
fn cells_whose_area_or_volume_overflows_have_the_mean_zero() {
    let flat = Shape2::ellipse([0.0; 2], [1.0, 2.0], 0.0).unwrap();
    for large in [1e155, 1e300] {
        for [a, b] in [[large, large], [large, 1.0], [1.0, large]] {
            assert_eq!(flat.rectangle_mean([0.0; 2], [a, b]), 0.0);
            assert_eq!(ball().box_mean([0.0; 3], [a, b, b]), 0.0);
            assert_eq!(ball().bin_mean(0.3, [0.0; 2], [a, b]), 0.0);
        }
    }
}

/// Mean of three values at distances of half a width, by Simpson's rule.
fn simpson(f: impl Fn(f64) -> f64, width: f64) -> f64 {
    (f(-0.5 * width) + 4.0 * f(0.0) + f(0.5 * width)) / 6.0
}

#[test]
fn rounding_of_small_pixels_has_its_documented_bound() {
    let flat = Shape2::ellipse([0.0; 2], [1.0, 0.05], 0.0).unwrap();
    let disc = Shape2::ellipse([0.0; 2], [5.0; 2], 0.0).unwrap();
    for side in [1e-2, 1e-3, 1e-4, 1e-5] {
        for k in 0..40 {
            let (sin, cos) = (0.157 * f64::from(k) + 0.01).sin_cos();
            // Beyond the outline, nearer than the circumscribed circle.
            let at = [1.0, 0.05].map(|x| x + 2.0 * side);
            let outside = flat.rectangle_mean([at[0] * cos, at[1] * sin], [side; 2]);
            assert!(
                outside <= 1e-14 * 0.05 * PI / (side * side),
                "{side:e} {k}: {outside:e}"
            );
            // On the outline: half, less the curvature, the sum of its parts.
            let at = [5.0 * cos, 5.0 * sin];
            let mean = disc.rectangle_mean(at, [side; 2]);
            let rounding = 1e-14 * 25.0 * PI / (side * side);
            assert!((mean - 0.5).abs() < side + rounding, "{side:e} {k}: {mean}");
            let part = |i: f64, j: f64| {
                let at = [at[0] + 0.25 * side * i, at[1] + 0.25 * side * j];
                disc.rectangle_mean(at, [0.5 * side; 2])
            };
            let parts = part(-1.0, -1.0) + part(-1.0, 1.0) + part(1.0, -1.0) + part(1.0, 1.0);
            // Parts have a quarter of the area.
            assert!((mean - parts / 4.0).abs() < 5.0 * rounding, "{side:e} {k}");
        }
    }
}

/// The fourth derivative times the fourth power of these sizes is below rounding.
#[test]
fn bins_far_smaller_than_a_disc_or_a_ball_have_their_documented_rounding() {
    for width in [1e-4, 1e-6, 1e-8, 1e-12] {
        for k in 0..19 {
            let s = 0.05 * f64::from(k);
            let expected = simpson(|d| disc().line_integral(0.3, s + d), width);
            let mean = disc().bin_mean(0.3, s, width);
            assert!((mean - expected).abs() < 1e-14, "{width:e} {s}: {mean}");
            let at = [0.8 * s, -0.6 * s];
            let line = |i: f64, j: f64| ball().line_integral(0.3, at[0] + i, at[1] + j);
            let expected = simpson(|i| simpson(|j| line(i, j), width), width);
            let mean = ball().bin_mean(0.3, at, [width; 2]);
            // The longest line is 2.
            let bound = 2e-15 * PI / (width * width);
            assert!((mean - expected).abs() < bound, "{width:e} {s}: {mean}");
        }
    }
}

/// Bins on the outline and voxels on the surface.
#[test]
fn rounding_at_outlines_and_surfaces_has_its_documented_bound() {
    for side in [1e-2, 1e-3, 1e-4] {
        for k in 0..100 {
            let (sin, cos) = (0.157 * f64::from(k) + 0.01).sin_cos();
            let of = |at: [f64; 2], side: f64| ball().bin_mean(0.4, at, [side; 2]);
            let at = [cos, sin].map(|x| x * (1.0 - 0.01 * f64::from(k) * side));
            let part = |i: f64, j: f64| of([at[0] + i, at[1] + j], 0.5 * side);
            let q = 0.25 * side;
            let parts = part(-q, -q) + part(-q, q) + part(q, -q) + part(q, q);
            // Twice the longest line, for the whole and for parts of a quarter of the area.
            let bound = 2.0 * 1e-15 * PI / (side * side) * 5.0;
            let difference = (of(at, side) - parts / 4.0).abs();
            assert!(difference < bound, "{side:e} {k}: {difference:e} {bound:e}");

            let height = 0.02 * f64::from(k) - 0.99;
            let r = (1.0 - height * height).sqrt();
            let mean = ball().box_mean([r * cos, r * sin, height], [side; 3]);
            // A half, less the curvature: at most an eighth of the squared diagonal of the voxel over its side.
            let bound = 1e-15 * 4.0 / 3.0 * PI / side.powi(3);
            let difference = (mean - 0.5).abs();
            assert!(
                difference < 0.4 * side + bound,
                "{side:e} {k}: {difference:e}"
            );
        }
    }
}
