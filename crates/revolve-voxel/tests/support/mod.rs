//! Common to the tests: the slow reference of the chord, random meridians, a balloon.
#![allow(dead_code)] // each test file uses a part

pub(crate) mod brute;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use revolve_voxel::{Body, Meridian, Pose, RevolveError, Sample, VoxelCounters, VoxelGrid};
use std::f64::consts::PI;
use std::ops::Range;

/// Chord of the solid under a path from axis to axis, by the definition: the signed sum over the path's pieces of the
/// length of line inside each frustum, divided at the roots of its quadratic and tested at the midpoints.
pub(crate) fn naive_chord(path: &[[f64; 2]], o: Point3<f64>, d: Vector3<f64>) -> f64 {
    let mut closed = path.to_vec();
    closed.insert(0, [path[0][0], 0.0]);
    closed.push([path[path.len() - 1][0], 0.0]);
    closed.windows(2).map(|p| frustum(p[0], p[1], o, d)).sum()
}

fn frustum(p: [f64; 2], q: [f64; 2], o: Point3<f64>, d: Vector3<f64>) -> f64 {
    if p[0] == q[0] {
        return 0.0;
    }
    let (low, high) = (p[0].min(q[0]), p[0].max(q[0]));
    let (mut t0, mut t1) = (-100.0, 100.0);
    if d.x != 0.0 {
        let (a, b) = ((low - o.x) / d.x, (high - o.x) / d.x);
        t0 = f64::max(t0, a.min(b));
        t1 = f64::min(t1, a.max(b));
    } else if o.x < low || o.x >= high {
        return 0.0;
    }
    let m = (q[1] - p[1]) / (q[0] - p[0]);
    let gap = |t: f64| {
        let at = o + d * t;
        at.y * at.y + at.z * at.z - (p[1] + m * (at.x - p[0])).powi(2)
    };
    let (g0, g1) = (p[1] + m * (o.x - p[0]), m * d.x);
    let a = d.y * d.y + d.z * d.z - g1 * g1;
    let b = o.y * d.y + o.z * d.z - g0 * g1;
    let c = o.y * o.y + o.z * o.z - g0 * g0;
    let mut cuts = vec![t0, t1];
    if a.abs() > 1e-14 {
        let disc = b * b - a * c;
        if disc > 0.0 {
            cuts.push((-b - disc.sqrt()) / a);
            cuts.push((-b + disc.sqrt()) / a);
        }
    }
    if b.abs() > 1e-14 {
        cuts.push(-c / (2.0 * b));
    }
    cuts.retain(|t| (t0..=t1).contains(t));
    cuts.sort_by(f64::total_cmp);
    let inside = |ab: &&[f64]| gap(0.5 * (ab[0] + ab[1])) < 0.0;
    let length: f64 = cuts.windows(2).filter(inside).map(|ab| ab[1] - ab[0]).sum();
    length * (q[0] - p[0]).signum()
}

/// The discriminant of the reference is a difference of squares: the effect of its rounding on the roots.
fn twin_rounding(p: [f64; 2], q: [f64; 2], o: Point3<f64>, d: Vector3<f64>) -> f64 {
    let m = if p[0] == q[0] {
        0.0
    } else {
        (q[1] - p[1]) / (q[0] - p[0])
    };
    let (g0, g1) = (p[1] + m * (o.x - p[0]), m * d.x);
    let a = d.y * d.y + d.z * d.z - g1 * g1;
    let b = o.y * d.y + o.z * d.z - g0 * g1;
    let disc = b * b - a * (o.y * o.y + o.z * o.z - g0 * g0);
    let noise = 4e-16 * b * b;
    if a.abs() > 1e-14 {
        noise / (disc.max(noise).max(1e-300).sqrt() * a.abs())
    } else {
        0.0
    }
}

/// The change of the reference chord under a small displacement of the line: conditioning times rounding.
pub(crate) fn chord_tolerance(path: &[[f64; 2]], o: Point3<f64>, d: Vector3<f64>) -> f64 {
    let step = 1e-12;
    let here = naive_chord(path, o, d);
    let mut worst = 0.0f64;
    for e in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for s in [-step, step] {
            worst = worst.max((naive_chord(path, o + e * s, d) - here).abs());
            worst = worst.max((naive_chord(path, o, (d + e * s).normalize()) - here).abs());
        }
    }
    1e-12
        + 4.0 * worst
        + path
            .windows(2)
            .map(|p| twin_rounding(p[0], p[1], o, d))
            .sum::<f64>()
}

/// Directions, many of them degenerate.
pub(crate) fn direction() -> impl Strategy<Value = Vector3<f64>> {
    prop_oneof![
        6 => (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_filter_map("not zero", |(a, b, c)| {
            let v = Vector3::new(a, b, c);
            (v.norm() > 0.1).then(|| v.normalize())
        }),
        1 => Just(Vector3::x()),
        1 => Just(-Vector3::x()),
        1 => Just(Vector3::y()),
        1 => Just(Vector3::new(0.0, 0.6, -0.8)),
        1 => Just(Vector3::new(1e-17, 0.6, -0.8)),
        1 => Just(Vector3::new(1.0, 1e-17, 0.0)),
        1 => Just(Vector3::new(1.0, -1e-9, 1e-9)),
        1 => Just(Vector3::new(1e-9, -1.0, 0.0)),
        1 => Just(Vector3::new(1.0, 1.0, 0.0).normalize()),
    ]
}

/// A path around the origin with decreasing angles: overhangs, creases, several radii at one x.
pub(crate) fn star() -> impl Strategy<Value = Vec<[f64; 2]>> {
    (
        prop::collection::vec((0.4..1.6f64, 0.1..1.0f64), 3..24),
        0..3,
    )
        .prop_map(|(raw, kind)| {
            let total: f64 = raw.iter().skip(1).map(|p| p.1).sum();
            let mut angle = PI;
            let n = raw.len();
            let points = raw.iter().enumerate().map(|(k, &(radius, gap))| {
                if k > 0 {
                    angle -= gap / total * PI;
                }
                // Three kinds: rough, a sphere of few corners, half-rough.
                let radius = match kind {
                    0 => radius,
                    1 => 1.0,
                    _ => 1.0 + 0.2 * (radius - 1.0),
                };
                let r = if k == 0 || k == n - 1 {
                    0.0
                } else {
                    radius * angle.sin().abs()
                };
                [radius * angle.cos(), r]
            });
            points.collect()
        })
}

/// A meridian with one radius at each x, open at both ends.
pub(crate) fn graph() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec((0.05..1.0f64, 0.0..1.2f64), 2..20).prop_map(|raw| {
        let mut x = -1.0;
        let step = 2.0 / raw.iter().map(|p| p.0).sum::<f64>();
        raw.iter()
            .map(|p| {
                x += p.0 * step;
                // Occasionally exactly equal radii, or the axis.
                [
                    x,
                    if p.1 > 1.0 {
                        1.0
                    } else if p.1 < 0.1 {
                        0.0
                    } else {
                        p.1
                    },
                ]
            })
            .collect()
    })
}

pub(crate) fn meridian() -> impl Strategy<Value = (Vec<[f64; 2]>, Meridian)> {
    prop_oneof![star(), graph()].prop_filter_map("a simple meridian", |p| {
        Meridian::new(&p).ok().map(|m| (p, m))
    })
}

pub(crate) fn pose() -> impl Strategy<Value = Pose> {
    (
        prop::array::uniform3(-1.0..1.0f64),
        prop::array::uniform3(-3.0..3.0f64),
    )
        .prop_map(|(t, a)| {
            let isometry = Isometry3::from_parts(
                Translation3::from(Vector3::from(t) * 0.1),
                UnitQuaternion::from_scaled_axis(Vector3::from(a)),
            );
            Pose::new(isometry).unwrap()
        })
}

/// The study's pose.
pub(crate) fn study_pose() -> Pose {
    let quarter = std::f64::consts::FRAC_PI_4;
    Pose::axis_along_z(5.625)
        .unwrap()
        .rotated_x(quarter)
        .unwrap()
        .rotated_y(quarter)
        .unwrap()
}

/// A balloon that bulges, also behind its base.
pub(crate) fn balloon(radius: f64, n: usize) -> Meridian {
    let h = 9.5 + radius;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| {
            let u = k as f64 / n as f64;
            let r = radius * (0.5 * PI * u).cos() + 1.6 * (PI * u).sin();
            [
                h * (1.0 - (0.5 * PI * u).cos()) - 0.5 * (PI * u).sin(),
                if k == n { 0.0 } else { r },
            ]
        })
        .collect();
    Meridian::new(&points).unwrap()
}

pub(crate) fn heart(n: usize) -> Body {
    Body::new(vec![balloon(1.75, n), balloon(2.75, n)], study_pose()).unwrap()
}

/// Voxels of a body in some slices, added to `out`.
pub(crate) fn voxelize_add<T: Sample>(
    body: &Body,
    grid: &VoxelGrid,
    slices: Range<usize>,
    tolerance: f64,
    activity: &[f64],
    out: &mut [T],
) -> Result<VoxelCounters, RevolveError> {
    Body::voxelize_add(&[(body, activity)], grid, slices, tolerance, out)
}

pub(crate) fn solid(points: &[[f64; 2]]) -> Body {
    Body::new(vec![Meridian::new(points).unwrap()], Pose::identity()).unwrap()
}
