//! Random meridians, rays and poses: a slow reference, and the identities that relate chords, voxels, meshes and measures.

use crate::support;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use revolve_voxel::{Body, Lines, Meridian, Pose, Ray, VoxelGrid};
use std::collections::HashMap;
use std::f64::consts::PI;
use support::*;

proptest! {
    #[test]
    fn the_chord_equals_that_of_the_reference((path, meridian) in meridian(), d in direction(), p in prop::array::uniform3(-1.2..1.2f64), place in 0..5, pick in 0..100usize) {
        let v = path[pick % path.len()];
        let o = Point3::from(match place {
            0 => [p[0], 0.0, 0.0], // through the axis
            1 => [v[0], p[1], p[2]], // through a vertex's plane
            2 => [v[0], 0.6 * v[1], 0.8 * v[1]], // through a vertex: grazing an edge or cutting it
            _ => p,
        });
        let body = Body::new(vec![meridian], Pose::identity()).unwrap();
        let expected = naive_chord(&path, o, d).abs();
        let got = body.chord(0, &Ray::new(o, d).unwrap()).unwrap();
        let tolerance = chord_tolerance(&path, o, d);
        prop_assert!((got - expected).abs() <= tolerance, "{got} {expected} {tolerance:e} {o:?} {d:?}");
        let spans = body.spans(0, &Ray::new(o, d).unwrap()).unwrap();
        let total: f64 = spans.iter().map(|s| s.length()).sum();
        prop_assert!((total - got).abs() <= tolerance, "{spans:?} {got}");
        for pair in spans.windows(2) {
            prop_assert!(pair[0].exit < pair[1].enter);
        }
        // The middle of a span is inside and that of a gap outside, unless these are slivers.
        for s in spans.iter().filter(|s| s.length() > 1e-6) {
            let middle = o + d * (0.5 * (s.enter + s.exit));
            prop_assert!(body.signed_distance(0, &middle).unwrap() < 1e-9);
        }
        for w in spans.windows(2).filter(|w| w[1].enter - w[0].exit > 1e-6) {
            let middle = o + d * (0.5 * (w[0].exit + w[1].enter));
            prop_assert!(body.signed_distance(0, &middle).unwrap() > -1e-9);
        }
    }

    #[test]
    fn rotating_body_and_ray_together_changes_nothing((_, meridian) in meridian(), turn in pose(), d in direction(), p in prop::array::uniform3(-1.0..1.0f64)) {
        let still = Body::new(vec![meridian.clone()], Pose::identity()).unwrap();
        let turned = Body::new(vec![meridian], turn).unwrap();
        let o = Point3::from(p);
        let a = still.chord(0, &Ray::new(o, d).unwrap()).unwrap();
        let b = turned.chord(0, &Ray::new(turn.to_lab(&o), turn.isometry().rotation * d).unwrap()).unwrap();
        // Degenerate rays may graze after rounding: compare only well-conditioned chords.
        let near: Vec<f64> = [1e-9, -1e-9].iter().flat_map(|e| [Vector3::x(), Vector3::y(), Vector3::z()].map(|v| {
            still.chord(0, &Ray::new(o + v * *e, d).unwrap()).unwrap()
        })).collect();
        let spread = near.iter().fold(0.0f64, |m, c| m.max((c - a).abs()));
        prop_assert!((a - b).abs() <= 1e-12 + 10.0 * spread, "{a} {b} {spread}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn volume_is_the_sum_of_coverage_and_the_integral_of_chords((_, meridian) in meridian(), at in pose(), d in direction()) {
        let volume = meridian.mass_properties().volume;
        let body = Body::new(vec![meridian], at).unwrap();
        let grid = VoxelGrid::centred([40, 36, 44], [0.11, 0.12, 0.1], [0.01, -0.02, 0.005]).unwrap();
        for tolerance in [1e-3, 1e-6] {
            let (v, c) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap();
            let sum = v.iter().sum::<f64>() * grid.voxel_volume();
            // Every cut voxel within the tolerance.
            prop_assert!((sum - volume).abs() <= tolerance * c.cut as f64 * grid.voxel_volume() + 1e-12, "{sum} {volume}");
        }

        let u = d.cross(&Vector3::new(0.3, -0.5, 0.8)).normalize();
        let w = d.cross(&u);
        // Midpoint rule: four rasters half a step apart, and their mean, which is the raster twice as fine. Chords jump where a wall is
        // parallel to the rays, so each has an error of the pixels of an outline with changing sign, and the mean has an error below the
        // largest of the four differences from it.
        let (n, pitch) = (200, 0.025);
        let sums = [[-0.25, -0.25], [-0.25, 0.25], [0.25, -0.25], [0.25, 0.25]].map(|[a, b]| {
            let middle = 0.5 * (n as f64 - 1.0);
            let first = Point3::from(u * ((a - middle) * pitch) + w * ((b - middle) * pitch));
            let rays = Lines::parallel([n, n], first, u * pitch, w * pitch, d).unwrap();
            let (image, _) = body.project::<f64>(&rays, &[1.0]).unwrap();
            image.iter().sum::<f64>() * pitch * pitch
        });
        let mean = sums.iter().sum::<f64>() / 4.0;
        let spread = sums.iter().map(|s| (s - mean).abs()).fold(0.0, f64::max);
        prop_assert!((mean - volume).abs() <= 2.0 * spread + 2e-4 * volume.max(1.0), "{mean} {volume} {spread}");
    }

    #[test]
    fn a_voxel_is_the_average_of_its_eighths((_, meridian) in meridian(), at in pose(), axis_aligned in any::<bool>()) {
        // Creases, thin walls and the axis, cut by other planes: the parts are independent of the whole.
        let at = if axis_aligned { Pose::axis_along_z(0.1).unwrap() } else { at };
        let body = Body::new(vec![meridian], at).unwrap();
        let (n, h, tolerance) = (7, 0.5, 1e-6);
        let offset = [0.013, -0.021, 0.007];
        let voxels = |n: usize, h: f64, tolerance: f64| {
            let grid = VoxelGrid::centred([n; 3], [h; 3], offset).unwrap();
            body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap().0
        };
        let (whole, parts) = (voxels(n, h, tolerance), voxels(2 * n, 0.5 * h, tolerance));
        for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
            for (a, b) in whole.iter().zip(&voxels(n, h, tolerance)) {
                prop_assert!((a - b).abs() <= tolerance + 1e-6, "{a} {b} {tolerance}");
            }
        }
        for (k, v) in whole.iter().enumerate() {
            let (i, j, l) = (k % n, k / n % n, k / (n * n));
            let mut sum = 0.0;
            for part in 0..8 {
                let (i, j, l) = (2 * i + (part & 1), 2 * j + (part >> 1 & 1), 2 * l + (part >> 2));
                sum += parts[(l * 2 * n + j) * 2 * n + i];
            }
            prop_assert!((v - sum / 8.0).abs() <= 2.0 * tolerance, "{v} {}", sum / 8.0);
        }
    }

    #[test]
    fn rotating_body_and_grid_together_changes_nothing((_, meridian) in meridian(), at in pose()) {
        // A quarter turn about z maps the grid onto itself: voxel (i, j) to (n-1-j, i).
        let turned = at.rotated_z(std::f64::consts::FRAC_PI_2).unwrap();
        let grid = VoxelGrid::cube(24, 0.18).unwrap();
        let tolerance = 1e-2;
        let volume = |pose| {
            let body = Body::new(vec![meridian.clone()], pose).unwrap();
            body.voxelize::<f64>(&grid, tolerance, &[1.0]).unwrap().0
        };
        let (a, b) = (volume(at), volume(turned));
        for z in 0..24 {
            for j in 0..24 {
                for i in 0..24 {
                    let (p, q) = (a[(z * 24 + j) * 24 + i], b[(z * 24 + i) * 24 + 23 - j]);
                    // Rounding may change the decision to divide a voxel: both results then meet the tolerance.
                    prop_assert!((p - q).abs() <= 2.0 * tolerance, "{p} {q}");
                }
            }
        }
    }

    #[test]
    fn a_mesh_is_closed_and_contains_the_volume((_, meridian) in meridian(), at in pose()) {
        let m = meridian.mass_properties();
        let body = Body::new(vec![meridian], at).unwrap();
        let tolerance = 1e-3;
        let mesh = body.mesh(0, tolerance).unwrap();
        // Every directed edge and its reverse occur once.
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                *edges.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
        }
        for (&(a, b), &n) in &edges {
            prop_assert_eq!(n, 1);
            prop_assert_eq!(edges.get(&(b, a)), Some(&1));
        }
        prop_assert!((mesh.volume() - m.volume).abs() <= tolerance * m.surface);
        for t in &mesh.triangles {
            let centre = t.iter().fold(Vector3::zeros(), |s, &k| s + mesh.vertices[k as usize].coords) / 3.0;
            prop_assert!(body.signed_distance(0, &Point3::from(centre)).unwrap().abs() <= tolerance * (1.0 + 1e-9));
        }
        for v in &mesh.vertices {
            prop_assert!(body.signed_distance(0, v).unwrap().abs() < 1e-12);
        }
    }
}

#[test]
fn a_wall_is_the_difference_of_outer_and_inner_solid() {
    let body = heart(60);
    let ray = Ray::new(Point3::new(0.3, -20.0, 0.1), Vector3::new(0.0, 1.0, 0.02)).unwrap();
    let wall = body.line_integral(&ray, &[0.0, 1.0]).unwrap();
    assert!((wall - (body.chord(1, &ray).unwrap() - body.chord(0, &ray).unwrap())).abs() < 1e-14);
    assert!(wall > 1.0);
    let both = body.line_integral(&ray, &[2.0, 1.0]).unwrap();
    assert!((both - (body.chord(1, &ray).unwrap() + body.chord(0, &ray).unwrap())).abs() < 1e-13);
    let grid = VoxelGrid::cube(48, 0.35).unwrap();
    let r = body.regions::<f64>(&grid, 0..48, 1e-3).unwrap();
    let (wall, _) = body.voxelize::<f64>(&grid, 1e-3, &[0.0, 1.0]).unwrap();
    // A plane mirrors body and grid: half of the wall's voxels are computed at positions that differ by rounding.
    let rounding = 1e-13;
    for (a, b) in r.coverage[1].iter().zip(&wall) {
        assert!((a - b).abs() < rounding);
    }
    // Any quantity is linear in the regions' values.
    let (both, _) = body.voxelize::<f64>(&grid, 1e-3, &[2.0, 1.0]).unwrap();
    let means = (r.coverage[0].iter().zip(&r.coverage[1])).map(|(a, b)| 2.0 * a + b);
    assert!(means.zip(&both).all(|(a, b)| (a - b).abs() < rounding));
    let labelled = r.labels.iter().filter(|&&l| l == 2).count() as f64 * grid.voxel_volume();
    assert!((labelled / body.region_measures(1).unwrap().volume - 1.0).abs() < 0.03);
    assert!(Body::nested(body.layers().to_vec(), *body.pose(), 1.0).is_ok());
}

#[test]
fn a_pose_is_rigid() {
    let isometry = Isometry3::from_parts(
        Translation3::new(1.0, 2.0, 3.0),
        UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3),
    );
    let pose = Pose::new(isometry).unwrap();
    let p = Point3::new(0.3, -0.4, 0.5);
    assert!((pose.to_body(&pose.to_lab(&p)) - p).norm() < 1e-15);
}

#[test]
fn walls_have_the_area_of_both_faces_and_of_their_ends() {
    let cylinder = |x: [f64; 2], r: f64| Meridian::new(&[[x[0], r], [x[1], r]]).unwrap();
    // Inner and outer cylinders of length 3: flush at both ends, at one, at none.
    for (inner, common) in [([0.0, 3.0], 2.0), ([0.0, 2.0], 1.0), ([0.5, 2.0], 0.0)] {
        let layers = vec![cylinder(inner, 1.0), cylinder([0.0, 3.0], 2.0)];
        let body = Body::nested(layers, Pose::identity(), 0.0).unwrap();
        let outside = 2.0 * PI * 2.0 * 3.0 + 2.0 * PI * 4.0;
        let inside = 2.0 * PI * (inner[1] - inner[0]) + 2.0 * PI;
        let surface = body.region_measures(1).unwrap().surface;
        let exact = outside + inside - 2.0 * common * PI;
        assert!((surface / exact - 1.0).abs() < 1e-14, "{surface} {exact}");
    }
}

/// However coarse: solids on the axis, several parts, a ring.
#[test]
fn coarse_meshes_enclose_a_volume() {
    let cylinder = Meridian::new(&[[0.0, 1.0], [3.0, 1.0]]);
    let two = [[0.0, 0.0], [1.0, 3.0], [2.0, 0.0], [2.1, 0.1], [2.2, 0.0]];
    let ring = Meridian::ring(&[[0.0, 1.0], [0.0, 2.0], [1.0, 2.0], [1.0, 1.0]]);
    for meridian in [cylinder, Meridian::new(&two), ring] {
        let meridian = meridian.unwrap();
        let exact = meridian.mass_properties().volume;
        let body = Body::new(vec![meridian], Pose::identity()).unwrap();
        for part in [0.2, 0.5, 1.0] {
            let tolerance = part * body.layers()[0].r_max();
            let mesh = body.mesh(0, tolerance).unwrap();
            let volume = mesh.volume();
            assert!(
                volume > 0.1 * exact && volume < 1.1 * exact,
                "{tolerance}: {volume} of {exact}"
            );
            // Every edge belongs to two triangles.
            let mut edges = HashMap::<[u32; 2], i32>::new();
            for [a, b, c] in &mesh.triangles {
                for [p, q] in [[a, b], [b, c], [c, a]] {
                    *edges.entry([*p.min(q), *p.max(q)]).or_default() += if p < q { 1 } else { -1 };
                }
            }
            assert!(edges.values().all(|sum| *sum == 0));
        }
    }
}
