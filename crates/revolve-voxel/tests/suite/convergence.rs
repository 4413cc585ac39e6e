//! Voxels against closed forms and exact chords: tolerances and orders.

use crate::support;

use nalgebra::{Point3, Vector3};
use revolve_voxel::{
    Assembly, BinValue, Body, DepthResponse, Meridian, Organs, ParallelDetector, Pose, Ray, Shown,
    View, VoxelGrid,
};
use support::*;

/// Area of the part of a disc of radius a about the origin with x' < x and y' < y, by its definition as an integral of
/// half-chords, in closed form.
fn quadrant(x: f64, y: f64, a: f64) -> f64 {
    // F(t): primitive of sqrt(a^2 - t^2).
    let f = |t: f64| {
        0.5 * (t * (a * a - t * t).max(0.0).sqrt() + a * a * (t / a).clamp(-1.0, 1.0).asin())
    };
    let (x, y) = (x.clamp(-a, a), y.clamp(-a, a));
    // For each t < x the column runs from -s(t) to min(y, s(t)), s(t) = sqrt(a^2 - t^2), and is empty if y < -s(t).
    let edge = (a * a - y * y).max(0.0).sqrt();
    let full = |from: f64, to: f64| {
        if to > from {
            2.0 * (f(to) - f(from))
        } else {
            0.0
        }
    };
    let capped = |from: f64, to: f64| {
        let (from, to) = (from.max(-edge), to.min(edge));
        if to > from {
            f(to) - f(from) + y * (to - from)
        } else {
            0.0
        }
    };
    let outer = if y > 0.0 {
        full(-a, x.min(-edge)) + full(edge, x)
    } else {
        0.0
    };
    outer + capped(-a, x)
}

/// Fraction of the square of side h about (x, y) inside the disc.
fn disc_share(x: f64, y: f64, h: f64, a: f64) -> f64 {
    let (x0, x1, y0, y1) = (x - 0.5 * h, x + 0.5 * h, y - 0.5 * h, y + 0.5 * h);
    (quadrant(x1, y1, a) - quadrant(x0, y1, a) - quadrant(x1, y0, a) + quadrant(x0, y0, a))
        / (h * h)
}

#[test]
fn the_closed_form_is_correct() {
    let a = 1.3;
    assert!((quadrant(2.0, 2.0, a) - std::f64::consts::PI * a * a).abs() < 1e-14);
    assert!((quadrant(0.0, 0.0, a) - 0.25 * std::f64::consts::PI * a * a).abs() < 1e-14);
    assert!((disc_share(0.1, 0.2, 0.1, a) - 1.0).abs() < 1e-12);
    assert!(disc_share(2.0, 0.2, 0.1, a).abs() < 1e-12);
}

#[test]
fn every_voxel_of_a_cylinder_meets_the_tolerance() {
    let (n, h, a) = (24, 0.12, 1.3);
    let cylinder = Meridian::new(&[[0.0, a], [4.0, a]]).unwrap();
    let body = Body::new(vec![cylinder], Pose::axis_along_z(2.0).unwrap()).unwrap();
    let grid = VoxelGrid::centred([n, n, 1], [h; 3], [0.01, 0.02, 0.0]).unwrap();
    for log in 2..=6 {
        let tolerance = 10f64.powi(-log);
        let (v, _) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
        let mut worst = 0.0f64;
        for j in 0..n {
            for i in 0..n {
                let c = grid.centre(i, j, 0);
                worst = worst.max((v[j * n + i] - disc_share(c.x, c.y, h, a)).abs());
            }
        }
        assert!(worst <= tolerance, "{worst:e} {tolerance:e}");
    }
}

#[test]
fn every_voxel_of_the_heart_meets_the_tolerance() {
    // The rim, the recess behind the base, the apex and the side, against exact chords through each voxel.
    let body = heart(200);
    let (h, tolerance) = (0.0625, 1e-3);
    let mut checked = 0;
    for x in [-0.01, 0.0, 0.3, 3.0, 9.0, 12.2] {
        for angle in [0.0f64, 1.0, 2.5, 4.0] {
            let rim = if x < 0.1 {
                2.78
            } else {
                body.layers()[1].r_max() * 0.9
            };
            let r = if x > 12.0 { 0.05 } else { rim };
            let p = body
                .pose()
                .to_lab(&Point3::new(x, r * angle.cos(), r * angle.sin()));
            let grid = VoxelGrid::centred([4; 3], [h; 3], [p.x, p.y, p.z]).unwrap();
            let (v, _) = body.voxelize::<f64>(&grid, tolerance, &[0.0, 1.0]).unwrap();
            for (k, &got) in v.iter().enumerate() {
                let c = grid.centre(k % 4, k / 4 % 4, k / 16);
                if !(1e-9..=1.0 - 1e-9).contains(&got) {
                    continue;
                }
                let m = 40;
                let mut sum = 0.0;
                for i in 0..m * m {
                    let off = |k: usize| ((k as f64 + 0.5) / m as f64 - 0.5) * h;
                    let o = c + Vector3::new(off(i % m), off(i / m), 0.0);
                    let ray = Ray::new(o, Vector3::z()).unwrap();
                    for (layer, sign) in [(1, 1.0), (0, -1.0)] {
                        for s in body.spans(layer, &ray).unwrap() {
                            sum += sign * (s.exit.min(0.5 * h) - s.enter.max(-0.5 * h)).max(0.0);
                        }
                    }
                }
                let exact = sum / (h * (m * m) as f64);
                // The error of the reference: where the surface is steep to its rays, each cell of a row of m has an error of up to half a cell with
                // varying sign, in total below 1 / m^1.5 / 2.
                let twin = 0.5 / (m as f64).powf(1.5);
                assert!(
                    (got - exact).abs() <= 2.0 * tolerance + twin,
                    "{got} {exact} at {c:?}"
                );
                checked += 1;
            }
        }
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn every_voxel_of_the_heart_meets_every_tolerance() {
    // Against sections at a much finer tolerance, which other tests compare with closed forms and the total volume: coarse, fine and long voxels,
    // with few and many segments per voxel.
    for (segments, h) in [
        (200, [0.5, 0.5, 0.5]),
        (200, [0.0625, 0.0625, 0.0625]),
        (40, [0.1, 0.1, 0.1]),
        (2000, [0.64, 0.64, 0.64]),
        (2000, [0.05, 0.2, 0.1]),
    ] {
        let body = heart(segments);
        let shape = [0, 1, 2].map(|a| if a == 2 { 2 } else { (12.0 / h[a]) as usize });
        let grid = VoxelGrid::centred(shape, h, [0.01, -0.02, 0.3]).unwrap();
        let run = |tolerance, activity: &[f64]| {
            body.voxelize::<f64>(&grid, tolerance, activity).unwrap().0
        };
        // Each layer separately, because the tolerance applies to the fraction of a layer.
        for activity in [[1.0, 0.0], [1.0, 1.0]] {
            let exact = run(1e-8, &activity);
            for log in 2..=6 {
                let tolerance = 10f64.powi(-log);
                let worst = run(tolerance, &activity)
                    .iter()
                    .zip(&exact)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(
                    worst <= tolerance,
                    "{worst:e} {tolerance:e} {segments} {h:?}"
                );
            }
        }
    }
}

/// For a surface without creases the local approximation has an error far below its estimate; the terms of the estimate are for creases.
#[test]
fn the_local_approximation_of_a_smooth_surface_is_accurate() {
    let pose = Pose::axis_along_z(0.0).unwrap();
    let body = Body::new(vec![spheroid(1.3, 1.0, 1e-9)], pose).unwrap();
    // Tolerances at which few voxels need sections.
    for (h, tolerance) in [(0.1, 2e-3), (0.05, 7e-4), (0.025, 3e-4)] {
        let n = (2.7 / h) as usize;
        let grid = VoxelGrid::centred([n, n, 4], [h; 3], [0.011, -0.007, 0.43]).unwrap();
        let run = |tolerance| body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
        let ((found, counters), (exact, _)) = (run(tolerance), run(1e-8));
        let errors = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        let worst = errors.fold(0.0, f64::max);
        assert!(counters.evaluations < 8 * counters.cut, "{counters:?}");
        // It is a tenth of the tolerance at most, and six times as large with the curvature between columns reversed.
        assert!(worst < tolerance / 8.0, "{h}: {worst:e}");
    }
}

#[test]
fn the_errors_of_a_cylinder_are_below_the_tolerance() {
    // Root-mean-square error of the voxels against the closed form of a cylinder along z.
    let a = 1.3;
    let cylinder = Meridian::new(&[[0.0, a], [4.0, a]]).unwrap();
    let body = Body::new(vec![cylinder], Pose::axis_along_z(2.0).unwrap()).unwrap();
    let error = |n: usize, tolerance| {
        let h = 3.0 / n as f64;
        let grid = VoxelGrid::centred([n, n, 1], [h; 3], [0.013, 0.007, 0.0]).unwrap();
        let (v, c) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
        let sum: f64 = (0..n * n)
            .map(|k| {
                let p = grid.centre(k % n, k / n, 0);
                (v[k] - disc_share(p.x, p.y, h, a)).powi(2)
            })
            .sum();
        (sum / c.cut as f64).sqrt()
    };
    for (n, tolerance) in [(60, 1e-2), (60, 1e-3), (240, 1e-3)] {
        let rms = error(n, tolerance);
        assert!(rms < tolerance, "{n}, {tolerance}: {rms}");
    }
}

#[test]
fn a_step_of_denormal_width_is_a_step() {
    // Radius 1/2 from x = 0 to a denormal number, then radius 1: a cylinder up to rounding.
    let stepped = Meridian::new(&[[0.0, 0.5], [1e-310, 1.0], [1.0, 1.0]]).unwrap();
    let volume = stepped.mass_properties().volume;
    assert!((volume - std::f64::consts::PI).abs() < 1e-12);
    for tolerance in [1e-2, 1e-6] {
        let body = Body::new(vec![stepped.clone()], Pose::identity()).unwrap();
        let grid = VoxelGrid::cube(5, 0.7).unwrap();
        let (voxels, _) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
        let sum: f64 = voxels.iter().sum::<f64>() * grid.voxel_volume();
        assert!((sum / volume - 1.0).abs() < 4.0 * tolerance, "{sum}");
    }
}

#[test]
fn the_remainder_of_a_response_falls_exponentially() {
    // GE LEHR holes in front of a crystal of 3.8 mm, at R = 20 cm.
    let sigma = |t: f64| {
        let fwhm = (0.15 / 3.4257 * (3.4257 + 20.0 - t)).hypot(0.38);
        fwhm / (8.0 * 2f64.ln()).sqrt()
    };
    let of = |tolerance| DepthResponse::new(sigma, [-12.0, 18.0], tolerance).unwrap();
    let [coarse, fine] = [of(1e-2), of(1e-5)];
    assert!(coarse.error() <= 1e-2 && fine.error() <= 1e-5);
    assert!(
        coarse.n_nodes() >= 4 && fine.n_nodes() <= 16,
        "{}",
        fine.n_nodes()
    );
}

/// A prolate spheroid of these half axes, to a tolerance.
fn spheroid(a: f64, b: f64, tolerance: f64) -> Meridian {
    let curve = |s: f64| {
        let (sin, cos) = (std::f64::consts::PI * s).sin_cos();
        [-a * cos, b * sin]
    };
    Meridian::from_function(curve, &[], tolerance).unwrap()
}

/// Across the axis at the height z, the spheroid is a circle of radius R = b sqrt(1 - z^2 / a^2), and the body one of a radius less by up to the
/// tolerance over the cosine of the slope.
#[test]
fn errors_of_chords_near_a_silhouette_are_the_root_of_the_tolerance() {
    let (a, b) = (3.0, 2.0);
    for tolerance in [1e-3, 1e-5, 1e-7] {
        let meridian = spheroid(a, b, tolerance);
        let measures = meridian.mass_properties();
        let lost = 16.0 * std::f64::consts::PI - measures.volume;
        assert!(
            lost > 0.0 && lost < tolerance * measures.surface,
            "{lost:e}"
        );
        let body = Body::new(vec![meridian], Pose::axis_along_z(0.0).unwrap()).unwrap();
        let (mut grazing, mut inside) = (0.0_f64, 0.0_f64);
        for k in 0..200 {
            let z = -1.0 + 0.01 * f64::from(k) + 1e-3;
            let radius = b * (1.0 - (z / a).powi(2)).sqrt();
            let error = |x: f64| {
                let ray = Ray::new(Point3::new(x, 0.0, z), Vector3::y()).unwrap();
                let exact = 2.0 * (radius * radius - x * x).sqrt();
                (exact - body.chord(0, &ray).unwrap()).abs()
            };
            for j in 0..100 {
                let x = radius * f64::from(j) / 100.0;
                inside = inside.max(error(x) * (1.0 - (x / radius).powi(2)).sqrt());
                grazing = grazing.max(error(radius - tolerance * f64::from(j) / 50.0));
            }
        }
        let most = 2.0 * (2.0 * b * tolerance).sqrt();
        println!(
            "tolerance {tolerance:e}: grazing {grazing:.2e} of {most:.2e}, inside {inside:.2e}"
        );
        assert!(grazing < 1.02 * most && grazing > 0.4 * most);
        assert!(inside < 2.1 * tolerance);
    }
}

/// Sums of samples at the centres of bins and of means over bins, against the volume.
#[test]
fn samples_at_the_centres_of_bins_do_not_sum_to_the_activity() {
    let pose = Pose::axis_along_z(0.0).unwrap().rotated_x(0.5).unwrap();
    let layers = vec![spheroid(3.0, 2.0, 1e-6), spheroid(3.6, 2.5, 1e-6)];
    let body = Body::new(layers, pose).unwrap();
    let exact = body.region_measures(1).unwrap().volume;
    for (n, least, most) in [(25, 0.01, 0.014), (50, 0.002, 0.004), (100, 0.0, 2e-4)] {
        let h = 10.0 / f64::from(n);
        let detector = ParallelDetector::new(n as usize, n as usize, [h, h]).unwrap();
        let rays = detector.rays(0.7).unwrap();
        let (samples, _) = body.project::<f64>(&rays, &[0.0, 1.0]).unwrap();
        let error = (samples.iter().sum::<f64>() * h * h / exact - 1.0).abs();
        println!("{n} bins: {error:.2e}");
        assert!(error >= least && error < most, "{error}");
    }
    let detector = ParallelDetector::new(25, 25, [0.4, 0.4]).unwrap();
    let (none, sharp) = (
        Organs::new(Vec::new()).unwrap(),
        DepthResponse::constant(0.0).unwrap(),
    );
    let wall = Assembly::new(&none)
        .with_body(&body, &[0.0, 1.0], None)
        .unwrap();
    let lines = detector.rays(0.7).unwrap();
    let view = View::new(&lines, detector.pitch(), BinValue::Average, &sharp, 4.0).unwrap();
    let image = view.image(&wall, Shown::Change, 0..25).unwrap();
    let error = image.samples.iter().sum::<f64>() * 0.16 / exact - 1.0;
    assert!(error.abs() < 1e-4, "{error}");
}
