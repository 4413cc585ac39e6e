//! Slabs across the rays and organs around a body, against integration along single rays by point tests.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use revolve_voxel::{
    Assembly, Body, Lines, Meridian, Organ, OrganShape, Organs, ParallelDetector, Pose, Ray,
    RevolveError, Sector, Shown, VoxelGrid,
};

const HEART_MU: f64 = 0.15;
const ACTIVITY: [f64; 2] = [0.3, 1.0];

/// A blunt cone within a larger one, waisted, off the axis and tilted.
fn heart() -> Body {
    larger(1.0)
}

/// The same, larger about its axis point.
fn larger(size: f64) -> Body {
    let layer = |scale: f64| {
        let points =
            [[0.0, 1.5], [1.0, 0.9], [3.0, 1.4], [4.0, 0.0]].map(|p| p.map(|v| v * scale * size));
        Meridian::new(&points).unwrap()
    };
    let pose = Pose::axis_along_z(2.0).unwrap().rotated_x(0.8).unwrap();
    let pose = pose.rotated_z(0.3).unwrap();
    let pose = pose.shifted(Vector3::new(1.5, -1.0, 0.4)).unwrap();
    Body::new(vec![layer(0.6), layer(1.0)], pose).unwrap()
}

/// A torso with a lung that contains a part of the heart, a spine, and a second lung that overlaps the first.
fn organs() -> Organs {
    let cylinder = |centre, axes| OrganShape::cylinder(centre, axes).unwrap();
    let ellipsoid = |centre, axes| OrganShape::ellipsoid(centre, axes).unwrap();
    let organ = |shape, activity, attenuation| Organ {
        shape,
        activity,
        attenuation,
    };
    Organs::new(vec![
        organ(cylinder([0.5, 0.0], [9.0, 7.0]), 0.1, 0.14),
        organ(ellipsoid([4.0, -1.0, 0.5], [3.0, 4.0, 6.0]), 0.02, 0.04),
        organ(cylinder([0.0, 5.0], [1.2, 1.0]), 0.0, 0.21),
        organ(ellipsoid([2.0, 2.0, -1.0], [2.5, 2.0, 3.0]), 0.4, 0.0),
    ])
    .unwrap()
}

fn rays(theta: f64) -> Lines {
    let detector = ParallelDetector::new(24, 20, [0.4, 0.4]).unwrap();
    detector.rays(theta).unwrap()
}

/// Activity and attenuation at a point.
fn held(heart: &Body, organs: &Organs, p: &Point3<f64>) -> [f64; 2] {
    let place = heart.pose().to_body(p);
    let region = heart
        .layers()
        .iter()
        .position(|layer| layer.contains(&place));
    if let Some(region) = region {
        return [ACTIVITY[region], HEART_MU];
    }
    let holds = |shape: &OrganShape| {
        let (centre, semi_axes) = shape.bounds();
        let share = |k: usize| ((p[k] - centre[k]) / semi_axes[k]).powi(2);
        share(0) + share(1) + share(2) < 1.0
    };
    let organ = organs.as_slice().iter().rev().find(|o| holds(&o.shape));
    organ.map_or([0.0; 2], |o| [o.activity, o.attenuation])
}

/// The slabs of a ray by integration between discontinuities, which are searched on 4000 points and bisected to rounding.
fn slow(heart: &Body, organs: &Organs, ray: &Ray, planes: &[f64]) -> Vec<f64> {
    let at = |t: f64| held(heart, organs, &ray.at(t));
    let mut cuts = vec![-12.0, 12.0];
    cuts.extend(planes);
    const N: usize = 4000;
    let t = |k: usize| -12.0 + 24.0 * k as f64 / N as f64;
    for k in 0..N {
        let (mut a, mut b) = (t(k), t(k + 1));
        if at(a) != at(b) {
            while b - a > 1e-13 {
                let middle = 0.5 * (a + b);
                if at(middle) == at(a) {
                    a = middle
                } else {
                    b = middle
                }
            }
            cuts.push(0.5 * (a + b));
        }
    }
    cuts.sort_by(f64::total_cmp);
    let mut slabs = vec![0.0; planes.len() + 1];
    let mut beyond = 0.0;
    for pair in cuts.windows(2).rev() {
        let (length, middle) = (pair[1] - pair[0], 0.5 * (pair[0] + pair[1]));
        let [activity, mu] = at(middle);
        // Two points of Gauss on 64 steps: 1e-12 of the stretch.
        let mut sum = 0.0;
        for k in 0..64 {
            for x in [-1.0, 1.0] {
                let share = (f64::from(k) + 0.5 + x / 12f64.sqrt()) / 64.0;
                sum += (-(beyond + mu * length * (1.0 - share))).exp() / 128.0;
            }
        }
        slabs[planes.partition_point(|plane| *plane <= middle)] += activity * length * sum;
        beyond += mu * length;
    }
    slabs
}

#[test]
fn organs_and_slabs_agree_with_integration_along_each_ray() {
    let (heart, organs) = (heart(), organs());
    let assembly = Assembly::new(&organs);
    let assembly = assembly
        .with_body(&heart, &ACTIVITY, Some(HEART_MU))
        .unwrap();
    let planes = [-3.0, -0.7, 0.2, 2.5];
    let mut met = 0;
    for theta in [0.3, 2.0, 4.4] {
        let rays = rays(theta).with_planes(&planes).unwrap();
        let mut seen = vec![0.0f64; 20 * 5 * 24];
        for shown in [Shown::Organs, Shown::Change] {
            assembly.project_add(&rays, shown, 1.0, &mut seen).unwrap();
        }
        for (row, bin) in (0..20)
            .step_by(3)
            .flat_map(|row| (0..24).map(move |bin| (row, bin)))
        {
            let exact = slow(&heart, &organs, &rays.ray(bin, row).unwrap(), &planes);
            for (slab, exact) in exact.iter().enumerate() {
                let value = seen[(5 * row + slab) * 24 + bin];
                // The search may miss a piece shorter than its step; these rays have none.
                assert!(
                    (value - exact).abs() < 1e-9,
                    "{theta} {row} {bin} {slab}: {value} {exact}"
                );
                met += usize::from(*exact > 0.0);
            }
        }
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn slabs_add_up_to_the_whole_and_one_slab_is_bitwise_identical_to_it() {
    let (heart, rays) = (heart(), rays(1.1));
    let cylinder = OrganShape::cylinder([0.0; 2], [8.0, 6.0]).unwrap();
    let torso = Organ {
        shape: cylinder,
        activity: 0.1,
        attenuation: 0.2,
    };
    let torso = Organs::new(vec![torso]).unwrap();
    let ring = Meridian::ring(&[[0.5, 0.4], [0.5, 1.4], [3.0, 1.2], [3.0, 0.3]]).unwrap();
    let sector = Sector::new(ring, [0.2, 2.9], *heart.pose()).unwrap();
    let project = |rays: &Lines, n: usize| {
        let mut images = vec![vec![0.0f64; n]; 4];
        heart
            .project_add(rays, &ACTIVITY, 0.7, &mut images[0])
            .unwrap();
        sector.project_add(rays, 0.4, &mut images[1]).unwrap();
        let assembly = Assembly::new(&torso)
            .with_body(&heart, &ACTIVITY, None)
            .unwrap();
        let assembly = assembly.with_sectors(vec![(sector.clone(), 0.4)]).unwrap();
        for (image, shown) in images[2..].iter_mut().zip([Shown::Change, Shown::Organs]) {
            assembly.project_add(rays, shown, 0.7, image).unwrap();
        }
        images
    };
    let whole = project(&rays, 480);
    let one = project(&rays.clone().with_planes(&[]).unwrap(), 480);
    assert!(whole == one);
    // Planes before and beyond all content have no effect.
    let wide = project(&rays.clone().with_planes(&[-50.0, 50.0]).unwrap(), 3 * 480);
    let many: Vec<f64> = (0..30).map(|k| -6.0 + 0.4 * f64::from(k)).collect();
    let cut = project(&rays.clone().with_planes(&many).unwrap(), 31 * 480);
    for ((whole, wide), cut) in whole.iter().zip(&wide).zip(&cut) {
        for (k, value) in whole.iter().enumerate() {
            let (row, bin) = (k / 24, k % 24);
            assert!((wide[(3 * row + 1) * 24 + bin] - value).abs() <= 1e-14 * value.abs());
            let sum: f64 = (0..31).map(|slab| cut[(31 * row + slab) * 24 + bin]).sum();
            assert!((sum - value).abs() < 1e-13, "{sum} {value}");
        }
        assert!(whole.iter().any(|value| *value > 0.0));
    }
    // Single rows are bitwise identical to those of the whole.
    let slabs = rays.with_planes(&many).unwrap();
    let some = project(&slabs.rows(7..9).unwrap(), 2 * 31 * 24);
    for (cut, some) in cut.iter().zip(&some) {
        assert!(cut[7 * 31 * 24..9 * 31 * 24] == some[..]);
    }
}

/// Averages of points, 24 along each side of a voxel: the error at a surface scales as 24^-1.5 at worst, about 1e-3.
#[test]
fn voxels_of_organs_agree_with_averages_of_points() {
    let organs = organs();
    let grid = VoxelGrid::centred([14, 9, 7], [1.3, 1.7, 2.1], [0.4, -0.3, 0.2]).unwrap();
    let map: Vec<f64> = organs
        .voxelize(&grid, 1..6, |organ| organ.attenuation)
        .unwrap();
    let nothing = Body::new(
        vec![Meridian::new(&[[90.0, 1.0], [91.0, 1.0]]).unwrap()],
        Pose::identity(),
    )
    .unwrap();
    const M: usize = 24;
    let (mut worst, mut cut) = (0.0f64, 0);
    for (k, value) in map.iter().enumerate() {
        let (x, y, z) = (k % 14, k / 14 % 9, 1 + k / (14 * 9));
        let centre = grid.centre(x, y, z);
        let mut sum = 0.0;
        for j in 0..M * M * M {
            let [a, b, c] =
                [j % M, j / M % M, j / (M * M)].map(|j| (j as f64 + 0.5) / M as f64 - 0.5);
            let place = centre + Vector3::new(1.3 * a, 1.7 * b, 2.1 * c);
            sum += held(&nothing, &organs, &place)[1];
        }
        let mean = sum / (M * M * M) as f64;
        // Surfaces of several organs in one voxel are treated as independent.
        worst = worst.max((value - mean).abs());
        cut += usize::from(mean > 0.0 && (mean - value).abs() > 1e-12);
    }
    assert!(cut > 100 && worst < 0.012, "{worst} {cut}");
}

#[test]
fn bad_planes_and_organs_are_rejected() {
    let rays = rays(0.0);
    let refused = |planes: &[f64]| rays.clone().with_planes(planes).unwrap_err();
    assert!(matches!(
        refused(&[0.0, f64::NAN]),
        RevolveError::NotFinite { .. }
    ));
    assert!(matches!(
        refused(&[0.0, 0.0]),
        RevolveError::NotPositive { given: 0.0, .. }
    ));
    assert!(matches!(
        refused(&[1.0, 0.5]),
        RevolveError::NotPositive { given: -0.5, .. }
    ));
    let listed = Lines::each([1, 1], vec![rays.ray(0, 0).unwrap()]).unwrap();
    let refused = listed.with_planes(&[0.0]);
    assert_eq!(refused.unwrap_err(), RevolveError::NotParallel);
    assert!(matches!(
        OrganShape::ellipsoid([0.0; 3], [1.0, 0.0, 1.0]),
        Err(RevolveError::NotPositive { .. })
    ));
    assert!(matches!(
        OrganShape::ellipsoid([f64::NAN; 3], [1.0; 3]),
        Err(RevolveError::NotFinite { .. })
    ));
    let shape = OrganShape::ellipsoid([0.0; 3], [1.0; 3]).unwrap();
    for (activity, attenuation) in [(-1.0, 0.1), (1.0, -0.1)] {
        let organ = Organ {
            shape,
            activity,
            attenuation,
        };
        assert!(matches!(
            Organs::new(vec![organ]),
            Err(RevolveError::Negative { .. })
        ));
    }
    let organ = Organ {
        shape,
        activity: 1.0,
        attenuation: f64::INFINITY,
    };
    assert!(matches!(
        Organs::new(vec![organ]),
        Err(RevolveError::NotFinite { .. })
    ));
    let (heart, organs) = (heart(), organs());
    let assembly = Assembly::new(&organs)
        .with_body(&heart, &ACTIVITY, None)
        .unwrap();
    for shown in [Shown::Organs, Shown::Change] {
        let refused = assembly.project_add(&rays, shown, 1.0, &mut [0.0f32; 7]);
        assert!(matches!(
            refused,
            Err(RevolveError::WrongLength {
                given: 7,
                expected: 480,
                ..
            })
        ));
    }
}

#[test]
fn an_ellipsoid_may_have_any_representable_size() {
    for size in [1e-160, 1e160] {
        let ball = OrganShape::ellipsoid([0.0; 3], [size, 2.0 * size, size]).unwrap();
        let ray = Ray::new(Point3::origin(), Vector3::y()).unwrap();
        let span = ball.span(&ray).unwrap();
        assert!((span.exit / size - 2.0).abs() < 1e-15 && span.enter == -span.exit);
    }
}

proptest! {
    /// The rays that an assembly skips intersect no body, for any rotations and shifts.
    #[test]
    fn skipped_rays_intersect_no_body(
        origin in prop::array::uniform3(-6.0..6.0),
        direction in prop::array::uniform3(-1.0..1.0),
        turn in -0.5..0.5,
        shift in -1.0..1.0,
    ) {
        prop_assume!(direction.iter().any(|d: &f64| d.abs() > 0.1));
        let one = heart();
        let pose = one.pose().rotated_x(turn).unwrap().shifted(Vector3::new(shift, 0.0, shift));
        let other = Body::new(larger(1.2).layers().to_vec(), pose.unwrap()).unwrap();
        let ray = Ray::new(Point3::from(origin), Vector3::from(direction)).unwrap();
        for body in [one, other] {
            let none = Organs::default();
            let assembly = Assembly::new(&none).with_body(&body, &ACTIVITY, None).unwrap();
            let lines = Lines::each([1, 1], [ray]).unwrap();
            let mut image = [0.0_f64];
            let rays = assembly.project_add(&lines, Shown::Change, 1.0, &mut image).unwrap();
            let exact = body.line_integral(&ray, &ACTIVITY).unwrap();
            prop_assert!((image[0] - exact).abs() < 1e-12 && rays.cast + rays.skipped == 1);
        }
    }


    /// The chord of an ellipsoid is that of a ball in coordinates in which it is one.
    #[test]
    fn an_ellipsoid_is_a_scaled_ball(
        centre in prop::array::uniform3(-3.0..3.0),
        semi_axes in prop::array::uniform3(0.2..5.0),
        origin in prop::array::uniform3(-6.0..6.0),
        direction in prop::array::uniform3(-1.0..1.0),
    ) {
        prop_assume!(direction.iter().any(|d: &f64| d.abs() > 0.1));
        let ellipsoid = OrganShape::ellipsoid(centre, semi_axes).unwrap();
        let ray = Ray::new(Point3::from(origin), Vector3::from(direction)).unwrap();
        let far = |t: f64| {
            let p = ray.at(t);
            (0..3).map(|k| ((p[k] - centre[k]) / semi_axes[k]).powi(2)).sum::<f64>().sqrt()
        };
        match ellipsoid.span(&ray) {
            Some(span) => {
                prop_assert!((far(span.enter) - 1.0).abs() < 1e-10);
                prop_assert!((far(span.exit) - 1.0).abs() < 1e-10);
                prop_assert!(far(0.5 * (span.enter + span.exit)) < 1.0);
            }
            None => for k in -200..200 {
                prop_assert!(far(0.1 * f64::from(k)) > 1.0 - 1e-12);
            }
        }
    }
}
