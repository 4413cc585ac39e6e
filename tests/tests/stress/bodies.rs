//! Random solids of revolution, seen by rays that graze, run along the axis, lie in a parallel or start at a corner.

use crate::random::Random;
use crate::{Outcome, with_threads};
use nalgebra::{Point3, Vector3};
use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, Ray, Sampling, VoxelGrid};

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let unit = random.decades(-6.0, 6.0);
    let Some((body, size)) = body(random, unit) else {
        return Outcome::Refused;
    };
    for _ in 0..40 {
        let Some(ray) = ray(random, &body, size) else {
            continue;
        };
        check_ray(&body, &ray, size);
    }
    match random.integer(0, 2) {
        0 => check_projection(random, &body, size),
        1 => check_voxels(random, &body, size),
        _ => {}
    }
    Outcome::Answered
}

/// A body of one or two layers and a length it fits into.
fn body(random: &mut Random, unit: f64) -> Option<(Body, f64)> {
    let n = random.integer(1, 40);
    let mut points = Vec::new();
    for k in 0..=n {
        let x = match random.integer(0, 5) {
            // Several radii at one place, and turning back.
            0 => points.last().map_or(0.0, |&[x, _]: &[f64; 2]| x / unit),
            1 => (k as f64 - 0.4 * random.uniform(0.0, 1.0)) / n as f64,
            _ => k as f64 / n as f64,
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
    let mut turn = || {
        random.pick(&[
            0.0,
            0.3,
            std::f64::consts::FRAC_PI_4,
            std::f64::consts::FRAC_PI_2,
            2.0,
        ])
    };
    let pose = Pose::axis_along_z(0.5 * unit)
        .ok()?
        .turned_x(turn())
        .ok()?
        .turned_y(turn())
        .ok()?;
    let largest = points.iter().flatten().fold(unit, |a, b| a.max(b.abs()));
    Some((Body::new(layers, pose).ok()?, 2.0 * largest))
}

fn ray(random: &mut Random, body: &Body, size: f64) -> Option<Ray> {
    let mut anywhere = |scale: f64| Vector3::from_fn(|_, _| scale * random.uniform(-1.0, 1.0));
    let (origin, direction) = (anywhere(0.6 * size), anywhere(1.0));
    let axis = body.pose().axis();
    let across = axis.cross(&direction);
    let (origin, direction) = match random.integer(0, 5) {
        // Along the axis, on it; across it, through it; parallel to it, beside it.
        0 => (Vector3::zeros(), axis),
        1 => (axis * random.uniform(-0.5, 0.5) * size, across),
        2 => (origin, axis),
        3 => (origin, across),
        4 => (origin, Vector3::x()),
        _ => (origin, direction * random.decades(-3.0, 3.0)),
    };
    let x = random.spoiled(direction.x);
    Ray::new(
        Point3::from(origin),
        Vector3::new(x, direction.y, direction.z),
    )
    .ok()
}

fn check_ray(body: &Body, ray: &Ray, size: f64) {
    for layer in 0..body.layers().len() {
        let chord = body.chord(layer, ray).unwrap();
        let speed = ray.direction().norm();
        assert!(chord.is_finite() && chord >= 0.0, "chord {chord}");
        assert!(
            chord * speed <= 2.0 * size * (1.0 + 1e-9),
            "chord {chord} of a body of size {size}"
        );
        let spans = body.spans(layer, ray).unwrap();
        assert!(spans.iter().all(|span| span.enter <= span.exit));
        assert!(
            spans.windows(2).all(|pair| pair[0].exit <= pair[1].enter),
            "{spans:?}"
        );
        let sum: f64 = spans.iter().map(|span| span.exit - span.enter).sum();
        // Grazing a surface costs half the digits: a square root of rounding.
        assert!(
            (sum - chord).abs() * speed <= 1e-6 * size,
            "{sum} and {chord}"
        );
        if let Some(hit) = body.first_hit(layer, ray).unwrap() {
            assert!(hit.normal.iter().all(|x| x.is_finite()));
            assert!((hit.normal.norm() - 1.0).abs() < 1e-9);
        }
        let back = Ray::new(ray.origin(), -ray.direction()).expect("the same ray, turned round");
        let other = body.chord(layer, &back).unwrap();
        assert!(
            (other - chord).abs() * speed <= 1e-6 * size,
            "{chord}, backwards {other}"
        );
    }
}

fn check_projection(random: &mut Random, body: &Body, size: f64) {
    let (bins, rows) = (random.integer(1, 48), random.integer(1, 32));
    let pitch = [2.0 * size / bins as f64, 2.0 * size / rows as f64];
    let detector = ParallelDetector::new(bins, rows, pitch).expect("a detector of positive size");
    let rays = detector
        .rays(random.uniform(-7.0, 7.0))
        .expect("a finite angle");
    let activity = vec![1.0; body.layers().len()];
    let project = || {
        body.project::<f32>(&rays, &activity)
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
    // With one activity throughout, only the outermost surface is looked at.
    assert_eq!(counters.cast + counters.skipped, (bins * rows) as u64);
}

fn check_voxels(random: &mut Random, body: &Body, size: f64) {
    let n = random.integer(2, 24);
    let grid = VoxelGrid::cube(n, 2.2 * size / n as f64).expect("a grid of positive size");
    let activity: Vec<f64> = (0..body.layers().len())
        .map(|k| if k == 0 { 1.0 } else { 0.0 })
        .collect();
    let sampling = random.pick(&[
        Sampling::Centre,
        Sampling::Supersampled(3),
        Sampling::Coverage { tolerance: 1e-2 },
    ]);
    let fill = || {
        body.voxelize::<f64>(&grid, sampling, &activity)
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
    if let Sampling::Coverage { tolerance } = sampling {
        // Each voxel is right to the tolerance; the whole body lies in the grid.
        let volume = one.iter().sum::<f64>() * grid.voxel_volume();
        let exact = body.layers()[0].measures().volume;
        let cut = one.iter().filter(|&&v| v > 0.0 && v < 1.0).count() as f64 + 1.0;
        assert!(
            (volume - exact).abs() <= tolerance * cut * grid.voxel_volume() + 1e-9 * exact,
            "{volume} and {exact}"
        );
    }
}
