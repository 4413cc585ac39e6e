//! Random solids of revolution; rays that graze, run along the axis, lie in the plane of a parallel or start at a corner.

use crate::{Outcome, with_threads};
use nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Lines, Meridian, ParallelDetector, Pose, Ray, Sector, VoxelGrid};
use std::f64::consts::TAU;
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let unit = random.decades(-6.0, 6.0);
    let Some((body, points, size)) = body(random, unit) else {
        return Outcome::Rejected;
    };
    for _ in 0..40 {
        let Some(ray) = ray(random, &body, &points, size) else {
            continue;
        };
        check_ray(random, &body, &ray, size);
    }
    match random.integer(0, 2) {
        0 => check_projection(random, &body, size),
        1 => check_voxels(random, &body, size),
        _ => {}
    }
    Outcome::Answered
}

/// A body of one or two layers, the points of its outer profile, and a length that bounds it.
fn body(random: &mut Random, unit: f64) -> Option<(Body, Vec<[f64; 2]>, f64)> {
    let n = random.integer(1, 40);
    let step = random.rounded(1.0 / n as f64);
    let mut points = Vec::new();
    for k in 0..=n {
        let x = match random.integer(0, 5) {
            // Several radii at one position, and reversals.
            0 => points.last().map_or(0.0, |&[x, _]: &[f64; 2]| x / unit),
            1 => (k as f64 - random.uniform(0.0, 0.4)) * step,
            _ => k as f64 * step,
        };
        let r = if random.one_in(12) {
            0.0
        } else {
            random.uniform(0.05, 1.0)
        };
        points.push([random.spoiled(x * unit), r * unit]);
    }
    let outer = Meridian::new(&points).ok()?;
    let inner: Vec<[f64; 2]> = points.iter().map(|[x, r]| [*x, 0.5 * r]).collect();
    let layers = match Meridian::new(&inner) {
        Ok(inner) if random.one_in(2) => vec![inner, outer],
        _ => vec![outer],
    };
    let mut turn = || match random.integer(0, 2) {
        0 => 0.0,
        _ => random.angle(-7.0, 7.0),
    };
    let [x, y] = [turn(), turn()];
    let pose = Pose::axis_along_z(random.uniform(0.0, 1.0) * unit);
    let pose = pose.ok()?.rotated_x(x).ok()?.rotated_y(y).ok()?;
    let largest = points.iter().flatten().fold(unit, |a, b| a.max(b.abs()));
    Some((Body::new(layers, pose).ok()?, points, 2.0 * largest))
}

fn ray(random: &mut Random, body: &Body, points: &[[f64; 2]], size: f64) -> Option<Ray> {
    let mut anywhere = |scale: f64| Vector3::from_fn(|_, _| scale * random.uniform(-1.0, 1.0));
    let (mut origin, mut direction) = (anywhere(0.6 * size), anywhere(1.0));
    if random.one_in(2) {
        // In the plane of a vertex, at its height or not.
        let [x, r] = random.pick(points);
        let r = random.pick(&[0.0, 0.5, 1.0, 1.5]) * r;
        let (sin, cos) = random.angle(-4.0, 4.0).sin_cos();
        origin = body.pose().to_lab(&Point3::new(x, r * cos, r * sin)).coords;
    }
    if random.one_in(2) {
        let signs = [0, 1, 2].map(|_| random.pick(&[-1.0, 0.0, 1.0]));
        direction = body.pose().isometry().rotation * Vector3::from(signs);
    }
    let axis = body.pose().axis();
    let across = axis.cross(&direction);
    let (origin, direction) = match random.integer(0, 7) {
        // On the axis; perpendicular to it, through it; parallel to it, beside it.
        0 => (Vector3::zeros(), axis),
        1 => (axis * (random.uniform(-0.5, 0.5) * size), across),
        2 => (origin, axis),
        3 => (origin, across),
        4 => (origin, Vector3::x()),
        5 => (origin, direction * random.decades(-3.0, 3.0)),
        _ => (origin, direction),
    };
    let x = random.spoiled(direction.x);
    Ray::new(
        Point3::from(origin),
        Vector3::new(x, direction.y, direction.z),
    )
    .ok()
}

/// Checks that the value of a ray is similar to those of neighbouring rays.
///
/// The neighbours are on either side of every surface that the ray may touch or lie in, and coincide with none.
pub(crate) fn check_beside(
    random: &mut Random,
    here: f64,
    ray: &Ray,
    (size, axis): (f64, Vector3<f64>),
    value: impl Fn(&Ray) -> f64,
) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..8 {
        let mut aside = Vector3::from_fn(|_, _| random.any(-1.0, 1.0)) * (1e-9 * size);
        if k == 0 {
            // Perpendicular to the axis and to the ray: away from all cones that it may run along.
            aside = axis.cross(&ray.direction()) * aside.x;
        }
        for aside in [aside, -aside] {
            let Ok(ray) = Ray::new(ray.origin() + aside, ray.direction()) else {
                return;
            };
            (low, high) = (low.min(value(&ray)), high.max(value(&ray)));
        }
    }
    // At a groove all neighbours have longer chords, by the square root of their displacement, and by the root of rounding.
    let slack = 3.0 * (high - low) + 1e-6 * size;
    assert!(
        here >= low - slack && here <= high + slack,
        "{here}, beside it {low} to {high}: {ray:?}"
    );
}

/// Whether some samples of a raster are close to those of neighbouring rays.
pub(crate) fn check_samples(
    random: &mut Random,
    image: &[f64],
    rays: &Lines,
    place: (f64, Vector3<f64>),
    value: impl Fn(&Ray) -> f64,
) {
    for _ in 0..8 {
        let [bin, row] = rays.size().map(|n| random.integer(0, n - 1));
        let ray = rays.ray(bin, row).expect("one of them");
        check_beside(
            random,
            image[row * rays.size()[0] + bin],
            &ray,
            place,
            &value,
        );
    }
}

fn check_ray(random: &mut Random, body: &Body, ray: &Ray, size: f64) {
    for layer in 0..body.layers().len() {
        let chord = body.chord(layer, ray).unwrap();
        let speed = ray.direction().norm();
        assert!(chord.is_finite() && chord >= 0.0, "chord {chord}");
        assert!(
            chord * speed <= 2.0 * size * (1.0 + 1e-9),
            "chord {chord} of a body of size {size}"
        );
        let place = (size, body.pose().axis());
        check_beside(random, chord, ray, place, |ray| {
            body.chord(layer, ray).unwrap()
        });
        let spans = body.spans(layer, ray).unwrap();
        assert!(spans.iter().all(|span| span.enter <= span.exit));
        assert!(
            spans.windows(2).all(|pair| pair[0].exit <= pair[1].enter),
            "{spans:?}"
        );
        let sum: f64 = spans.iter().map(|span| span.exit - span.enter).sum();
        // A grazing ray has half of the digits: a square root of rounding.
        assert!(
            (sum - chord).abs() * speed <= 1e-6 * size,
            "{sum} and {chord}"
        );
        let solid = body.layers()[layer].clone();
        let sector = Sector::new(solid, [0.0, TAU], *body.pose()).unwrap();
        if let Some(hit) = sector.first_hit(ray) {
            assert!(hit.normal.iter().all(|x| x.is_finite()));
            assert!((hit.normal.norm() - 1.0).abs() < 1e-9);
        }
        let back = Ray::new(ray.origin(), -ray.direction()).expect("the reversed ray");
        let other = body.chord(layer, &back).unwrap();
        assert!(
            (other - chord).abs() * speed <= 1e-6 * size,
            "{chord}, backwards {other}"
        );
    }
}

fn check_projection(random: &mut Random, body: &Body, size: f64) {
    let (bins, rows) = (random.integer(1, 48), random.integer(1, 32));
    let pitch = [bins, rows].map(|n| random.rounded(2.0 * size / n as f64));
    let detector = ParallelDetector::new(bins, rows, pitch).expect("a detector of positive size");
    let rays = detector
        .rays(random.angle(-7.0, 7.0))
        .expect("a finite angle");
    let activity = vec![1.0; body.layers().len()];
    let project = || {
        body.project::<f64>(&rays, &activity)
            .expect("finite activities")
    };
    let (one, counters) = with_threads(1, project);
    let (two, again) = with_threads(2, project);
    assert!(
        one.iter()
            .zip(&two)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
    assert_eq!(counters, again);
    let outer = body.layers().len() - 1;
    let place = (size, body.pose().axis());
    check_samples(random, &one, &rays, place, |ray| {
        body.chord(outer, ray).unwrap()
    });
    // With uniform activity, only the outermost surface is intersected.
    assert_eq!(counters.cast + counters.skipped, (bins * rows) as u64);
}

fn check_voxels(random: &mut Random, body: &Body, size: f64) {
    let n = random.integer(2, 24);
    let grid =
        VoxelGrid::cube(n, random.rounded(2.2 * size / n as f64)).expect("a grid of positive size");
    let activity: Vec<f64> = (0..body.layers().len())
        .map(|k| if k == 0 { 1.0 } else { 0.0 })
        .collect();
    let tolerance = random.pick(&[0.2, 1e-2]);
    let fill = || {
        body.voxelize::<f64>(&grid, tolerance, &activity)
            .expect("finite activities")
            .0
    };
    let (one, two) = (with_threads(1, fill), with_threads(2, fill));
    assert!(
        one.iter()
            .zip(&two)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
    assert!(one.iter().all(|&v| (-1e-12..=1.0 + 1e-12).contains(&v)));
    // Each voxel is accurate to the tolerance; the whole body is within the grid.
    let volume = one.iter().sum::<f64>() * grid.voxel_volume();
    let exact = body.layers()[0].mass_properties().volume;
    let cut = one.iter().filter(|&&v| v > 0.0 && v < 1.0).count() as f64 + 1.0;
    assert!(
        (volume - exact).abs() <= tolerance * cut * grid.voxel_volume() + 1e-9 * exact,
        "{volume} and {exact}"
    );
}
