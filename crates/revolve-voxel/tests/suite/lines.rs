//! Lines in any direction: against closed forms, brute force, parallel rays and themselves in other frames.

use super::coincidence::{camera, cases, check, eighths, ordered, pose, quarters, solid, through};
use super::threads::with_threads;
use crate::support::{self, heart};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Assembly, Body, Lines, Meridian, Organ, OrganShape, Organs, ParallelDetector, PointRaster,
    Pose, Ray, RevolveError, Sector, Shown,
};
use support::brute::Scene;

/// Rays of a cone beam: a source, and a detector of `size` at angles of a few times ten degrees.
fn cone(size: [usize; 2]) -> impl Strategy<Value = Lines> {
    let unit = prop::array::uniform3(-1.0..1.0f64).prop_filter_map("not zero", |v| {
        let v = Vector3::from(v);
        (v.norm() > 0.2).then(|| v.normalize())
    });
    (unit.clone(), unit, 4.0..30.0f64, 1.0..20.0f64, 1.5..6.0f64).prop_map(
        move |(d, other, source, detector, width)| {
            let u = d
                .cross(&(other + d * 0.1 + Vector3::new(0.3, 0.5, 0.7) * 0.01))
                .normalize();
            let v = d.cross(&u);
            let step = width * (1.0 + detector / source) / size[0] as f64;
            let corner =
                d * detector - (u * (size[0] - 1) as f64 + v * (size[1] - 1) as f64) * (0.5 * step);
            let raster = PointRaster {
                first: Point3::from(corner),
                bin_step: u * step,
                row_step: v * step,
            };
            Lines::between(size, Point3::from(d * -source), raster).unwrap()
        },
    )
}

fn rays(lines: &Lines) -> Vec<Ray> {
    let [n_bins, n_rows] = lines.size();
    let all = (0..n_bins * n_rows).map(|k| lines.ray(k % n_bins, k / n_bins).unwrap());
    all.collect()
}

/// The same lines as a list.
fn listed(lines: &Lines) -> Lines {
    Lines::each(lines.size(), rays(lines)).unwrap()
}

/// The length of a line between two planes within a quadratic `a t^2 + 2 b t + c < 0`, a > 0.
fn within(quadratic: [f64; 3], [low, high]: [f64; 2]) -> f64 {
    let [a, b, c] = quadratic;
    let root = (b * b - a * c).max(0.0).sqrt();
    (((root - b) / a).min(high) - ((-root - b) / a).max(low)).max(0.0)
}

proptest! {
    #![proptest_config(cases(100))]

    /// Closed forms of a cylinder and of an ellipsoid (as an organ), in coordinates of the lab.
    #[test]
    fn cone_beams_of_cylinders_and_ellipsoids(lines in cone([13, 9]), r in 0.5..2.0f64, h in 0.5..2.0f64, at in prop::array::uniform3(-0.5..0.5f64)) {
        let rod = Meridian::new(&[[-h, r], [h, r]]).unwrap();
        let shift = Vector3::from(at);
        let pose = Pose::axis_along_z(0.0).unwrap().shifted(shift).unwrap();
        let body = Body::new(vec![rod], pose).unwrap();
        let (image, counters) = body.project::<f64>(&lines, &[1.0]).unwrap();
        prop_assert_eq!(counters.cast + counters.skipped, 13 * 9);
        let shape = OrganShape::ellipsoid(at, [r, h, 0.7]).unwrap();
        let organ = Organ { shape, activity: 1.0, attenuation: 0.0 };
        let mut of_organ = vec![0.0f64; 13 * 9];
        let organs = Organs::new(vec![organ]).unwrap();
        Assembly::new(&organs).project_add(&lines, Shown::Organs, 1.0, &mut of_organ).unwrap();
        for (k, ray) in rays(&lines).iter().enumerate() {
            let (o, d) = (ray.origin().coords - shift, ray.direction());
            let ends = [-h, h].map(|z| (z - o.z) / d.z);
            let round = [d.x * d.x + d.y * d.y, o.x * d.x + o.y * d.y, o.x * o.x + o.y * o.y - r * r];
            let chord = within(round, [ends[0].min(ends[1]), ends[0].max(ends[1])]);
            // A grazing chord is the root of a difference: half the digits.
            prop_assert!((image[k] - chord).abs() < 1e-6 && (image[k].powi(2) - chord.powi(2)).abs() < 1e-10, "{} {chord}", image[k]);
            let [p, v] = [o, d].map(|x| x.component_div(&Vector3::new(r, h, 0.7)));
            let chord = within([v.dot(&v), p.dot(&v), p.dot(&p) - 1.0], [f64::NEG_INFINITY, f64::INFINITY]);
            prop_assert!((of_organ[k].powi(2) - chord.powi(2)).abs() < 1e-10, "{} {chord}", of_organ[k]);
        }
    }

    /// Any solid, against the definition of the chord; every line as a single line.
    #[test]
    fn cone_beams_of_any_solid((path, meridian) in support::meridian(), pose in support::pose(), lines in cone([11, 8])) {
        let body = Body::new(vec![meridian], pose).unwrap();
        let (image, _) = body.project::<f64>(&lines, &[1.0]).unwrap();
        for (got, ray) in image.iter().zip(rays(&lines)) {
            let (o, d) = (pose.to_body(&ray.origin()), pose.vector_to_body(&ray.direction()));
            // Parameters of the reference are bounded: they begin at the point of the line nearest to the origin.
            let o = o - d * o.coords.dot(&d);
            let tolerance = support::chord_tolerance(&path, o, d);
            prop_assert!((got - support::naive_chord(&path, o, d)).abs() < 20.0 * tolerance);
            prop_assert!((got - body.chord(0, &ray).unwrap()).abs() < 20.0 * tolerance);
        }
    }

    /// Moving body and lines together changes no integral, also with attenuation.
    #[test]
    fn rigid_motions(pose in support::pose(), lines in cone([17, 6]), turn in prop::array::uniform3(-3.0..3.0f64), shift in prop::array::uniform3(-9.0..9.0f64)) {
        let motion = Isometry3::from_parts(Translation3::from(Vector3::from(shift)), UnitQuaternion::from_scaled_axis(Vector3::from(turn)));
        let layers = [1.0, 1.5].map(|r| Meridian::new(&[[-1.0, r], [0.5, 1.2 * r], [1.0, 0.0]]).unwrap());
        let here = Body::new(layers.to_vec(), pose).unwrap();
        let there = here.with_pose(Pose::new(motion * pose.isometry()).unwrap());
        let moved = |ray: &Ray| Ray::new(motion * ray.origin(), motion * ray.direction()).unwrap();
        let away: Vec<Ray> = rays(&lines).iter().map(moved).collect();
        let away = Lines::each(lines.size(), away).unwrap();
        let images = [(&here, &lines), (&there, &away)].map(|(body, lines)| {
            let (plain, _) = body.project::<f64>(lines, &[0.3, 1.0]).unwrap();
            let none = Organs::default();
            let assembly = Assembly::new(&none).with_body(body, &[0.3, 1.0], Some(0.4)).unwrap();
            let mut weak = vec![0.0; plain.len()];
            assembly.project_add(lines, Shown::Change, 1.0, &mut weak).unwrap();
            prop_assert!(plain.iter().zip(&weak).all(|(a, b)| b <= &(a + 1e-12)));
            Ok([plain, weak])
        });
        let [Ok(here), Ok(there)] = images else { panic!("attenuation adds") };
        for (a, b) in here.iter().flatten().zip(there.iter().flatten()) {
            prop_assert!((a * a - b * b).abs() < 1e-9, "{a} {b}");
        }
    }
}

proptest! {
    #![proptest_config(cases(120))]

    /// Sources and detectors on the grid of the vertices: lines in planes of vertices and faces, along the axis, along generators, tangents.
    #[test]
    fn lines_on_the_grid(
        one in solid(), other in solid(), pose in pose(), pick in 0..100usize, place in 0..6usize,
        at in prop::array::uniform3(quarters(-6..=6)), corner in prop::array::uniform3(quarters(-8..=8)),
        steps in prop::array::uniform2(prop::array::uniform3(quarters(-2..=2))), along in any::<bool>(), from in -9..9i32, opening in 1..9i32,
    ) {
        let [(path, inner, a), (_, outer, b)] = ordered(one, other);
        let lab = |v: [f64; 3]| pose.isometry().rotation * Vector3::from(v);
        let [bin_step, row_step] = steps.map(lab);
        let detector = PointRaster { first: pose.to_lab(&Point3::from(corner)), bin_step, row_step };
        let source = PointRaster::from(pose.to_lab(&through(&path, pick, place, at)));
        // A fan for each row, or one cone.
        let source = if along { PointRaster { row_step, ..source } } else { source };
        let lines = Lines::between([5, 4], source, detector);
        prop_assume!(lines != Err(RevolveError::NoDirection));
        let lines = lines.unwrap();
        let list = Lines::each([5, 4], rays(&lines)).unwrap();
        let body = Body::new(vec![inner.clone(), outer], pose).unwrap();
        let azimuths = [from, from + opening].map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
        let sector = Sector::new(inner, azimuths, pose).unwrap();
        let part = Scene::of(&a.clone().between(azimuths).at(pose.isometry()));
        let [a, b] = [a, b].map(|s| s.at(pose.isometry()));
        let scene = Scene { active: vec![(1.0, a), (0.5, b)], medium: None };
        for lines in [&lines, &list] {
            let (image, _) = body.project::<f64>(lines, &[1.5, 0.5]).unwrap();
            let mut of_sector = vec![0.0; 20];
            sector.project_add(lines, 1.0, &mut of_sector).unwrap();
            for (k, ray) in rays(lines).iter().enumerate() {
                check(image[k], &scene, ray)?;
                check(of_sector[k], &part, ray)?;
            }
        }
    }

    /// Parallel rays as lines, where bins and rows fall on surfaces.
    #[test]
    fn parallel_rays_as_lines(one in solid(), other in solid(), pose in pose(), camera in camera(), theta in eighths()) {
        let rays = camera.rays(theta).unwrap();
        let [(_, inner, a), (_, outer, b)] = ordered(one, other);
        let body = Body::new(vec![inner, outer], pose).unwrap();
        let [a, b] = [a, b].map(|s| s.at(pose.isometry()));
        let scene = Scene { active: vec![(1.0, a), (0.5, b)], medium: None };
        let (parallel, _) = body.project::<f64>(&rays, &[1.5, 0.5]).unwrap();
        let (lines, _) = body.project::<f64>(&listed(&rays), &[1.5, 0.5]).unwrap();
        for (k, got) in lines.into_iter().enumerate() {
            check(got, &scene, &rays.ray(k % rays.size()[0], k / rays.size()[0]).unwrap())?;
            // Two grazing chords, with half the digits.
            prop_assert!((got - parallel[k]).abs() < 1e-6, "{got} {}", parallel[k]);
        }
    }
}

/// The heart in the parallel camera: f32 samples to rounding, also with attenuation, sectors and a torso.
#[test]
fn parallel_views_of_the_heart_as_lines() {
    let body = heart(200);
    let torso = OrganShape::cylinder([0.2, 0.1], [12.0, 9.0]).unwrap();
    let torso = Organ {
        shape: torso,
        activity: 0.1,
        attenuation: 0.15,
    };
    let torso = Organs::new(vec![torso]).unwrap();
    let assembly = Assembly::new(&torso)
        .with_body(&body, &[0.2, 1.0], None)
        .unwrap();
    let detector = ParallelDetector::new(60, 50, [0.25, 0.3]).unwrap();
    for k in 0..12 {
        let rays = detector.rays(0.5 * f64::from(k)).unwrap();
        let lines = listed(&rays);
        fn image(assembly: &Assembly<'_>, rays: &Lines) -> Vec<f64> {
            let mut image = vec![0.0; 3000];
            for shown in [Shown::Organs, Shown::Change] {
                assembly.project_add(rays, shown, 1.0, &mut image).unwrap();
            }
            image
        }
        let (parallel, any) = (image(&assembly, &rays), image(&assembly, &lines));
        for (a, b) in parallel.iter().zip(&any) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        let mean = parallel
            .iter()
            .zip(&any)
            .map(|(a, b)| (a - b).abs())
            .sum::<f64>()
            / 3000.0;
        assert!(mean < 1e-11, "{mean}");
    }
}

#[test]
fn lines_are_bitwise_independent_of_threads_rows_and_masks() {
    let body = heart(100);
    let detector = PointRaster {
        first: Point3::new(-10.0, 20.0, -9.0),
        bin_step: Vector3::x() * 0.3,
        row_step: Vector3::z() * 0.4,
    };
    let lines = Lines::between([67, 43], Point3::new(0.0, -40.0, 0.0), detector).unwrap();
    let run = |n| with_threads(n, || body.project::<f32>(&lines, &[0.2, 1.0]).unwrap());
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
    for lines in [&lines, &Lines::each(lines.size(), rays(&lines)).unwrap()] {
        let (all, _) = body.project::<f32>(lines, &[0.2, 1.0]).unwrap();
        let some = lines.rows(3..40).unwrap().rows(2..9).unwrap();
        assert_eq!(some.ray(4, 1), lines.ray(4, 6));
        let (some, _) = body.project::<f32>(&some, &[0.2, 1.0]).unwrap();
        assert_eq!(some, all[67 * 5..67 * 12]);
        assert!(lines.rows(40..44).is_err() && lines.rows(3..3).is_err());
    }
}

#[test]
fn bad_lines_are_rejected() {
    let raster = |first: [f64; 3], bin_step: [f64; 3]| PointRaster {
        first: Point3::from(first),
        bin_step: Vector3::from(bin_step),
        row_step: Vector3::zeros(),
    };
    let source = Point3::new(1.0, 0.0, 0.0);
    // The third bin is the source.
    let through = raster([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    assert_eq!(
        Lines::between([5, 2], source, through),
        Err(RevolveError::NoDirection)
    );
    assert!(Lines::between([2, 2], source, through).is_ok());
    // It is the source to rounding, so that its direction has no correct digit.
    let beside = raster([-1.0, 1e-15, 0.0], [1.0, 0.0, 0.0]);
    assert_eq!(
        Lines::between([5, 2], source, beside),
        Err(RevolveError::NoDirection)
    );
    let nan = raster([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0]);
    assert!(matches!(
        Lines::between([5, 2], source, nan),
        Err(RevolveError::NotFinite { .. })
    ));
    let far = raster([0.0; 3], [f64::MAX, 0.0, 0.0]);
    assert!(matches!(
        Lines::between([5, 2], source, far),
        Err(RevolveError::NotFinite { .. })
    ));
    assert!(matches!(
        Lines::between([0, 2], source, through),
        Err(RevolveError::TooFew { .. })
    ));
    let huge = [usize::MAX, 2];
    assert!(matches!(
        Lines::between(huge, source, through),
        Err(RevolveError::TooLarge { .. })
    ));
    let ray = Ray::new(source, Vector3::z()).unwrap();
    assert!(matches!(
        Lines::each([2, 2], vec![ray; 3]),
        Err(RevolveError::WrongLength { .. })
    ));
    // Along the axis of a torso a line has no end.
    let lines = Lines::each([1, 2], vec![Ray::new(source, Vector3::x()).unwrap(), ray]).unwrap();
    let torso = OrganShape::cylinder([0.0; 2], [2.0; 2]).unwrap();
    let torso = Organ {
        shape: torso,
        activity: 1.0,
        attenuation: 0.0,
    };
    let torso = Organs::new(vec![torso]).unwrap();
    let of_torso = Assembly::new(&torso).project_add(&lines, Shown::Organs, 1.0, &mut [0.0f64; 2]);
    assert!(matches!(of_torso, Err(RevolveError::NotPositive { .. })));
    // Directions of any size, with squares that under- or overflow.
    let body = heart(50);
    for scale in [1e-170, 1.0_f64, 1e150] {
        let from = source * scale.min(1.0);
        let to = from + Vector3::new(-0.1, 0.2, 0.3) * scale;
        let lines = Lines::between([1, 1], from, to).unwrap();
        let (image, _) = body.project::<f64>(&lines, &[1.0, 1.0]).unwrap();
        let chord = body.chord(1, &lines.ray(0, 0).unwrap()).unwrap();
        assert!(
            chord > 1.0 && (image[0] - chord).abs() < 1e-9,
            "{scale} {} {chord}",
            image[0]
        );
    }
}
