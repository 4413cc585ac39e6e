//! Lines that intersect surfaces where these are not smooth: in planes of vertices, of faces and of sides, along and across the axis, along
//! generators, at every multiple of 45 degrees, against brute force.
//!
//! Coordinates are small integers divided by powers of two, and angles are multiples of 45 degrees, so that exact and nearly exact
//! coincidences are frequent.

use crate::support;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Assembly, Body, Meridian, Organ, OrganShape, Organs, ParallelDetector, Pose, Ray, Sector,
    Shown, VoxelGrid,
};
use std::f64::consts::{FRAC_PI_4, TAU};
use support::brute::{Scene, Solid};
use support::voxelize_add;

/// Rounding of coordinates of a few units, of poses and of roots.
const ROUNDING: f64 = 1e-12;

pub(crate) fn quarters(range: std::ops::RangeInclusive<i32>) -> impl Strategy<Value = f64> {
    range.prop_map(|k| 0.25 * f64::from(k))
}

/// Multiples of 45 degrees.
pub(crate) fn eighths() -> impl Strategy<Value = f64> {
    (-9..10i32).prop_map(|k| f64::from(k) * FRAC_PI_4)
}

/// Points on the grid: cylinders, faces and cones at 45 degrees among them.
fn points() -> impl Strategy<Value = Vec<[f64; 2]>> {
    let step = prop::sample::select(vec![
        [0.0, 0.25],
        [0.0, -0.5],
        [0.5, 0.0],
        [0.25, 0.25],
        [0.5, -0.5],
        [0.25, -0.5],
        [1.0, 0.25],
        [-0.25, 0.25],
    ]);
    let start = (quarters(-4..=2), quarters(0..=6));
    (start, prop::collection::vec(step, 1..8)).prop_map(|((x, r), steps)| {
        let mut at = [x, r];
        let mut points = vec![at];
        for [dx, dr] in steps {
            at = [at[0] + dx, f64::max(at[1] + dr, 0.0)];
            points.push(at);
        }
        points
    })
}

/// A meridian on the grid in both descriptions.
pub(crate) fn solid() -> impl Strategy<Value = (Vec<[f64; 2]>, Meridian, Solid)> {
    prop_oneof![
        4 => points().prop_filter_map("a simple meridian", |p| {
            Meridian::new(&p).ok().map(|m| (p.clone(), m, Solid::under(&p)))
        }),
        1 => (quarters(-3..=1), quarters(0..=3)).prop_map(|(x, r)| {
            // An inner and an outer step.
            let p = [[0.0, 0.0], [0.0, 0.5], [0.5, 1.0], [1.0, 1.0], [1.0, 0.25], [0.5, 0.0]];
            let p: Vec<_> = p.iter().map(|p| [x + p[0], r + p[1]]).collect();
            (p.clone(), Meridian::ring(&p).unwrap(), Solid::ring(&p))
        }),
    ]
}

pub(crate) fn pose() -> impl Strategy<Value = Pose> {
    let (turns, by) = (
        prop::array::uniform3(eighths()),
        prop::array::uniform3(quarters(-2..=2)),
    );
    (quarters(-4..=4), turns, by).prop_map(|(centre, [x, y, z], by)| {
        let pose = Pose::axis_along_z(centre).unwrap();
        let pose = pose.rotated_x(x).unwrap().rotated_y(y).unwrap();
        pose.rotated_z(z)
            .unwrap()
            .shifted(Vector3::from(by))
            .unwrap()
    })
}

/// Directions in the body frame: the multiples of 45 degrees, and the same with deviations below and above rounding.
fn direction() -> impl Strategy<Value = Vector3<f64>> {
    let main = (1..27i32)
        .prop_map(|k| Vector3::from([k % 3, k / 3 % 3, k / 9].map(|n| f64::from((n + 1) % 3 - 1))));
    let off = vec![
        0.0, 0.0, 0.0, 1e-17, -1e-16, 1e-15, -1e-13, 1e-12, 1e-11, -1e-10, 1e-8,
    ];
    let off = prop::array::uniform3(prop::sample::select(off));
    (main, off).prop_map(|(d, off)| (d + Vector3::from(off)).normalize())
}

/// A line through a vertex, in the plane of one, or on the grid.
pub(crate) fn through(path: &[[f64; 2]], pick: usize, place: usize, at: [f64; 3]) -> Point3<f64> {
    let [x, r] = path[pick % path.len()];
    let (sin, cos) = (at[2] * 4.0 * FRAC_PI_4).sin_cos();
    Point3::from(match place {
        0 => [x, r * cos, r * sin],
        1 => [x, at[1], at[2]],
        2 => [x, 0.0, 0.0],
        3 => [at[0], r * cos, r * sin],
        _ => at,
    })
}

/// A camera whose bins and rows fall on the grid.
pub(crate) fn camera() -> impl Strategy<Value = ParallelDetector> {
    let pitch = prop::array::uniform2(prop::sample::select(vec![0.125, 0.25, 0.5]));
    let offset = prop::array::uniform2((-4..5i32).prop_map(|k| 0.125 * f64::from(k)));
    (prop::array::uniform2(1..10usize), pitch, offset).prop_map(|([bins, rows], pitch, offset)| {
        ParallelDetector::new(bins, rows, pitch)
            .unwrap()
            .with_offset(offset)
            .unwrap()
    })
}

pub(crate) fn check(got: f64, scene: &Scene, ray: &Ray) -> Result<(), TestCaseError> {
    let [low, high] = scene.bounds(&ray.origin(), &ray.direction());
    let held = got >= low - ROUNDING && got <= high + ROUNDING;
    prop_assert!(held, "{got}, not in {low}..{high}: {ray:?} {scene:?}");
    Ok(())
}

pub(crate) fn cases(n: u32) -> ProptestConfig {
    ProptestConfig {
        cases: n,
        max_local_rejects: 10 * n,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(cases(2000))]

    #[test]
    fn single_lines(
        (path, meridian, solid) in solid(), d in direction(), pick in 0..100usize, place in 0..6usize,
        at in prop::array::uniform3(quarters(-6..=6)), back in prop::sample::select(vec![0.0, 1.0, -8.0]), pose in pose(),
    ) {
        let o = through(&path, pick, place, at) + d * back;
        let still = Body::new(vec![meridian.clone()], Pose::identity()).unwrap();
        let ray = Ray::new(o, d).unwrap();
        let turned = Body::new(vec![meridian], pose).unwrap();
        let there = Ray::new(pose.to_lab(&o), pose.isometry().rotation * d).unwrap();
        for (body, ray, solid) in [(&still, ray, solid.clone()), (&turned, there, solid.at(pose.isometry()))] {
            let scene = Scene::of(&solid);
            check(body.chord(0, &ray).unwrap(), &scene, &ray)?;
            let spans = body.spans(0, &ray).unwrap();
            check(spans.iter().map(|s| s.length()).sum(), &scene, &ray)?;
            prop_assert!(spans.iter().all(|s| s.enter <= s.exit) && spans.windows(2).all(|s| s[0].exit <= s[1].enter));
        }
    }
}

/// The one of the smaller volume first, as the layers of a body.
pub(super) fn ordered<P>(
    one: (P, Meridian, Solid),
    other: (P, Meridian, Solid),
) -> [(P, Meridian, Solid); 2] {
    let [a, b] = [&one, &other].map(|solid| solid.1.mass_properties().volume);
    if a > b { [other, one] } else { [one, other] }
}

proptest! {
    #![proptest_config(cases(75))]

    #[test]
    fn rows_of_detectors(one in solid(), other in solid(), pose in pose(), camera in camera(), theta in eighths(), mu in prop::sample::select(vec![0.0, 0.5])) {
        let rays = camera.rays(theta).unwrap();
        let [(_, inner, a), (_, outer, b)] = ordered(one, other);
        let body = Body::new(vec![inner, outer], pose).unwrap();
        let [a, b] = [a, b].map(|s| s.at(pose.isometry()));
        // Weights 1.0 and 0.5.
        let activity = [1.5, 0.5];
        let (plain, _) = body.project::<f64>(&rays, &activity).unwrap();
        let torso = OrganShape::cylinder([0.25, 0.0], [1.0, 1.0]).unwrap();
        let torso = Organ { shape: torso, activity: 0.0, attenuation: mu };
        let (none, torso) = (Organs::default(), Organs::new(vec![torso]).unwrap());
        let round = Solid::under(&[[-20.0, 1.0], [20.0, 1.0]]).at(Pose::axis_along_z(0.0).unwrap().shifted(Vector3::x() * 0.25).unwrap().isometry());
        let mut seen = vec![(plain, None)];
        for (media, own, solid) in [(&none, Some(mu), b.clone()), (&torso, None, round)] {
            let mut image = vec![0.0; rays.size().iter().product()];
            let assembly = Assembly::new(media).with_body(&body, &activity, own).unwrap();
            assembly.project_add(&rays, Shown::Change, 1.0, &mut image).unwrap();
            seen.push((image, Some((mu, solid))));
        }
        for (image, medium) in seen {
            let scene = Scene { active: vec![(1.0, a.clone()), (0.5, b.clone())], medium };
            for (k, got) in image.into_iter().enumerate() {
                check(got, &scene, &rays.ray(k % rays.size()[0], k / rays.size()[0]).unwrap())?;
            }
        }
    }

    #[test]
    fn sectors((path, meridian, solid) in solid(), pose in pose(), camera in camera(), theta in eighths(), from in -9..9i32, opening in 1..9i32,
        d in direction(), pick in 0..100usize, place in 0..6usize, at in prop::array::uniform3(quarters(-6..=6)))
    {
        let azimuths = [from, from + opening].map(|k| f64::from(k) * FRAC_PI_4);
        let rest = [azimuths[1], azimuths[0] + TAU];
        let parts = |azimuths: [f64; 2]| (azimuths[1] > azimuths[0]).then(|| Sector::new(meridian.clone(), azimuths, pose).unwrap());
        let scene = |azimuths| Scene::of(&solid.clone().between(azimuths).at(pose.isometry()));
        let o = through(&path, pick, place, at);
        let ray = Ray::new(pose.to_lab(&o), pose.isometry().rotation * d).unwrap();
        let rays = camera.rays(theta).unwrap();
        for azimuths in [azimuths, rest] {
            let Some(sector) = parts(azimuths) else { continue };
            check(sector.chord(&ray), &scene(azimuths), &ray)?;
            let mut image = vec![0.0; rays.size().iter().product()];
            sector.project_add(&rays, 1.0, &mut image).unwrap();
            for (k, got) in image.into_iter().enumerate() {
                check(got, &scene(azimuths), &rays.ray(k % rays.size()[0], k / rays.size()[0]).unwrap())?;
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn voxels((_, meridian, solid) in solid(), pose in pose(), from in -9..9i32, opening in 1..9i32, n in 2..7usize, first in prop::array::uniform3(quarters(-4..=-2))) {
        let azimuths = [from, from + opening].map(|k| f64::from(k) * FRAC_PI_4);
        let grid = VoxelGrid::new([n; 3], [0.5; 3], first).unwrap();
        let tolerance = 1e-3;
        let mut parts = [vec![0.0; n * n * n], vec![0.0; n * n * n]];
        let body = Body::new(vec![meridian.clone()], pose).unwrap();
        voxelize_add(&body, &grid, 0..n, tolerance, &[1.0], &mut parts[0]).unwrap();
        Sector::new(meridian, azimuths, pose).unwrap().voxelize_add(&grid, 0..n, tolerance, 1.0, &mut parts[1]).unwrap();
        let solids = [solid.clone(), solid.between(azimuths)].map(|s| s.at(pose.isometry()));
        // Lines along x, LINES by LINES through each voxel, off the grid.
        const LINES: usize = 16;
        let ends: Vec<f64> = (0..=n).map(|k| first[0] + 0.5 * (k as f64 - 0.5)).collect();
        for (got, solid) in parts.iter().zip(&solids) {
            let mut expected = vec![0.0; n * n * n];
            for j in 0..n * n * LINES * LINES {
                let [y, z] = [j % (n * LINES), j / (n * LINES)];
                let at = |k: usize, from: f64| from + 0.5 * ((k as f64 + 0.5) / LINES as f64 - 0.5);
                let o = Point3::new(0.0, at(y, first[1]), at(z, first[2]));
                for (k, length) in solid.lengths(&o, &Vector3::x(), &ends).into_iter().enumerate() {
                    expected[(z / LINES * n + y / LINES) * n + k] += length / (0.5 * (LINES * LINES) as f64);
                }
            }
            for (got, expected) in got.iter().zip(&expected) {
                // If surfaces are parallel to the lines, one row in LINES may be on the wrong side.
                prop_assert!((got - expected).abs() < 1e-3 + 1.5 / LINES as f64, "{got} {expected}");
            }
            let off: f64 = got.iter().zip(&expected).map(|(a, b)| (a - b).abs()).sum();
            prop_assert!(off < (2e-3 + 0.2 / LINES as f64) * (n * n * n) as f64, "{off}");
        }
    }
}

/// Along a cone or a cylinder the limit from larger radii applies: nothing beside a solid's outer surface, everything at the surface of a
/// bore, for any pose and rounding.
#[test]
fn lines_along_generators() {
    let solid = |points: &[[f64; 2]]| Meridian::new(points).unwrap();
    let ring = |points: &[[f64; 2]]| Meridian::ring(points).unwrap();
    // From one point (x, r) of the surface to another; the chord of the line through both.
    let cases = [
        (
            solid(&[[0.0, 1.0], [2.0, 1.0]]),
            [[0.0, 1.0], [2.0, 1.0]],
            0.0,
        ),
        (
            solid(&[[0.0, 1.25], [1.0, 0.25]]),
            [[0.0, 1.25], [1.0, 0.25]],
            0.0,
        ),
        (
            solid(&[[0.0, 0.5], [0.5, 1.0], [1.5, 1.0], [2.0, 0.75]]),
            [[0.0, 0.5], [0.5, 1.0]],
            0.0,
        ),
        // A shaft beside a collar: its line is only in the collar.
        (
            solid(&[[0.0, 0.5], [1.0, 0.5], [1.0, 1.0], [1.75, 1.0]]),
            [[0.0, 0.5], [1.0, 0.5]],
            0.75,
        ),
        (
            ring(&[[0.0, 0.5], [0.0, 1.0], [2.0, 1.0], [2.0, 0.5]]),
            [[0.0, 0.5], [2.0, 0.5]],
            2.0,
        ),
        (
            ring(&[[0.0, 0.5], [0.0, 3.0], [1.0, 3.0], [1.0, 1.5]]),
            [[0.0, 0.5], [1.0, 1.5]],
            2f64.sqrt(),
        ),
    ];
    for (meridian, [p, q], chord) in cases {
        for k in 0..8 * 8 * 8 * 8 {
            let [x, y, z, azimuth] =
                [k % 8, k / 8 % 8, k / 64 % 8, k / 512].map(|k| f64::from(k) * FRAC_PI_4);
            let pose = Pose::axis_along_z(0.75).unwrap().rotated_x(x).unwrap();
            let pose = pose.rotated_y(y).unwrap().rotated_z(z).unwrap();
            let body = Body::new(vec![meridian.clone()], pose).unwrap();
            let (sin, cos) = azimuth.sin_cos();
            let at = |[x, r]: [f64; 2]| pose.to_lab(&Point3::new(x, r * cos, r * sin));
            let ray = Ray::new(at(p), at(q) - at(p)).unwrap();
            let got = body.chord(0, &ray).unwrap();
            assert!((got - chord).abs() < 1e-12, "{got} {chord} {p:?} {pose:?}");
        }
    }
}

/// Corners of voxels on a cylinder, at Pythagorean triples times any number: the covered fractions are continuous there.
#[test]
fn corners_of_voxels_on_a_cylinder() {
    for k in 0..60 {
        let h = 0.1 * (1.0 + 0.37 * f64::from(k % 20)) / f64::from(1 + k % 3);
        let radius = [5.0, 13.0, 17.0][k as usize / 20] * h;
        let body = Body::new(
            vec![Meridian::new(&[[-1.0, radius], [1.0, radius]]).unwrap()],
            Pose::identity(),
        )
        .unwrap();
        let voxels = |shift: f64| {
            let origin = [-0.2, 0.5 * h + shift, 0.5 * h + shift];
            let grid = VoxelGrid::new([2, 18, 18], [0.3, h, h], origin).unwrap();
            body.voxelize::<f64>(&grid, 1e-6, &[1.0]).unwrap().0
        };
        let (on, beside) = (voxels(0.0), voxels(1e-9 * h));
        for (a, b) in on.iter().zip(&beside) {
            // Both tolerances, and the shift.
            assert!((a - b).abs() < 3e-6, "{h} {radius}: {a} {b}");
        }
    }
}
