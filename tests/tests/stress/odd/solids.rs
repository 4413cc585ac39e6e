//! Solids of revolution, rays and voxels.

use super::{ODD, SIZES, back, pairs};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, Unit, Vector3};
use revolve_voxel::{
    Assembly, Body, Curve, Lines, Mask, Meridian, Organ, OrganShape, Organs, ParallelDetector,
    Piece, Pose, Ray, RevolveError, Sector, Shell, Shown, Sweep, VoxelGrid,
};

fn meridians() -> Vec<Meridian> {
    let mut found = Vec::new();
    for [a, b] in pairs() {
        found.extend(back(Meridian::new(&[[0.0, a], [b, 0.3], [1.0, 0.0]])));
        found.extend(back(Meridian::ring(&[[0.0, 1.0], [a, 2.0], [1.0, b]])));
        let full = [[0.0, 1.0], [a, b], [0.0, -1.0]];
        found.extend(back(Meridian::from_full_curve(&full)));
        let piece = Piece::Chebyshev {
            x: vec![1.0, 1.0],
            r: vec![0.5, a, -0.5],
        };
        let _ = piece.at(b);
        found.extend(back(Meridian::smooth(&[piece], b.max(1e-4))));
    }
    for empty in [&[][..], &[[0.0, 1.0]]] {
        for refused in [
            Meridian::new(empty),
            Meridian::ring(empty),
            Meridian::from_full_curve(empty),
        ] {
            let given = empty.len();
            assert!(matches!(refused, Err(RevolveError::TooFew { given: n, .. }) if n == given));
        }
    }
    let nothing = Piece::Power {
        x: vec![],
        r: vec![],
    };
    for (points, pieces) in [(0, &[][..]), (1, &[nothing])] {
        let refused = Meridian::smooth(pieces, 0.1);
        assert!(matches!(refused, Err(RevolveError::TooFew { given, .. }) if given == points));
    }
    found
}

#[test]
fn revolve_voxel_accepts_any_input() {
    let pose = Pose::axis_along_z(0.5).expect("a place");
    let mut poses = vec![pose];
    for [a, b] in pairs() {
        poses.extend(back(Pose::axis_along_z(a).and_then(|p| p.rotated_x(b))));
        poses.extend(back(pose.rotated_y(a).and_then(|p| p.rotated_z(b))));
        poses.extend(back(pose.shifted(Vector3::new(a, b, 0.0))));
        let rotation = Unit::new_unchecked(Quaternion::new(a, b, 0.0, 0.0));
        let isometry = Isometry3::from_parts(Translation3::new(a, 0.0, b), rotation);
        poses.extend(back(Pose::new(isometry)));
    }
    let mut rays = Vec::new();
    let mut rasters = Vec::new();
    for [a, b] in pairs() {
        rays.extend(back(Ray::new(
            Point3::new(a, 0.1, b),
            Vector3::new(b, a, 1.0),
        )));
        rays.extend(back(Ray::new(
            Point3::new(0.1, a, 0.2),
            Vector3::new(0.0, 1.0, b),
        )));
        let detector = ParallelDetector::new(3, 2, [a, b]);
        let detector = detector.and_then(|d| d.with_offset([b, a]));
        rasters.extend(back(detector.and_then(|d| d.rays(a))));
        rasters.extend(back(Lines::parallel(
            [2, 2],
            Point3::new(a, b, 0.0),
            Vector3::x() * b,
            Vector3::z() * a,
            Vector3::new(0.0, 1.0, b),
        )));
    }
    let mut grids = Vec::new();
    for [a, b] in pairs() {
        grids.extend(back(VoxelGrid::new([2, 3, 2], [a, 1.0, b], [b, 0.0, a])));
        grids.extend(back(VoxelGrid::centred([2; 3], [a; 3], [b; 3])));
    }
    for n in SIZES {
        back(VoxelGrid::cube(n, 0.3));
        back(ParallelDetector::new(n, 2, [0.3; 2]));
        back(Mask::new([n, 0, 1], vec![]));
        back(Mask::new([0, n, n], vec![]));
    }
    for (k, raster) in rasters.iter().enumerate() {
        for (bin, row) in SIZES.into_iter().zip(SIZES) {
            assert_eq!(
                raster.ray(bin, row).is_some(),
                bin < raster.size()[0] && row < raster.size()[1]
            );
        }
        let slices = SIZES[k % SIZES.len()]..SIZES[k / SIZES.len() % SIZES.len()];
        back(raster.rows(slices));
    }
    for (k, meridian) in meridians().into_iter().enumerate() {
        let any = |k: usize| &poses[k % poses.len()];
        let inner = Meridian::new(&[[0.0, 0.2], [0.5, 0.0]]).expect("a cone");
        let layers = vec![inner.clone(), meridian.clone()];
        let body = Body::new(layers, *any(k))
            .or_else(|_| Body::new(vec![meridian.clone(), inner], *any(k)))
            .expect("layers");
        let _ = meridian.mass_properties();
        let _ = meridian.r_max();
        let _ = meridian.x_range();
        back(Body::nested(
            body.layers().to_vec(),
            *any(k),
            ODD[k % ODD.len()],
        ));
        for layer in SIZES {
            back(body.bounding_box(layer));
            back(body.region_measures(layer));
            back(body.mesh(layer, ODD[k % ODD.len()].max(1e-3)));
            for j in 0..4 {
                let ray = &rays[(31 * k + j) % rays.len()];
                back(body.chord(layer, ray));
                back(body.spans(layer, ray));
                back(body.signed_distance(layer, &ray.origin()));
            }
        }
        let raster = &rasters[(7 * k) % rasters.len()];
        let grid = &grids[(11 * k) % grids.len()];
        back(body.project::<f32>(raster, &[1.0, 0.5]));
        back(body.project::<f64>(raster, &[ODD[k % ODD.len()], 0.5]));
        for refused in [
            body.project::<f64>(raster, &[]).map(drop),
            (body.project_add::<f64>(raster, &[1.0; 2], 1.0, &mut [])).map(drop),
        ] {
            assert!(matches!(
                refused,
                Err(RevolveError::WrongLength { given: 0, .. })
            ));
        }
        // Voxels and sectors take most of the time: only every fifth.
        if k % 5 > 0 {
            continue;
        }
        let tolerance = [0.2, 1e-2, ODD[k / 4 % ODD.len()]][k % 3];
        back(body.voxelize::<f32>(grid, tolerance, &[1.0, 0.5]));
        back(body.regions::<f32>(grid, 0..usize::MAX, tolerance));
        let layers = std::slice::from_ref(&meridian);
        back(Sweep::of(&[layers, layers], any(k), grid));
        let azimuths = [ODD[k % ODD.len()], ODD[k / ODD.len() % ODD.len()]];
        for azimuths in [azimuths, [0.3, 2.0]] {
            let Some(sector) = back(Sector::new(meridian.clone(), azimuths, *any(k))) else {
                continue;
            };
            let mut image = vec![0.0; raster.size().iter().product()];
            let mut voxels = vec![0.0; grid.len()];
            back(sector.project_add(raster, 1.0, &mut image));
            let none = Organs::default();
            let assembly = Assembly::new(&none).with_body(&body, &[1.0; 2], Some(0.1));
            let assembly = assembly.expect("a medium");
            let assembly = assembly.with_sectors(vec![(sector.clone(), 1.0)]);
            let assembly = assembly.expect("an activity");
            back(assembly.project_add(raster, Shown::Change, 1.0, &mut image));
            back(sector.voxelize_add(grid, 0..grid.shape()[2], 1e-2, 1.0, &mut voxels));
            let _ = sector.contains(&Point3::new(azimuths[0], 0.1, azimuths[1]));
            let _ = sector.chord(&rays[k % rays.len()]);
            let _ = sector.first_hit(&rays[k % rays.len()]);
        }
    }
    for refused in [
        Body::new(vec![], pose).map(drop),
        Sweep::of(&[], &pose, &grids[0]).map(drop),
    ] {
        assert!(matches!(
            refused,
            Err(RevolveError::TooFew { given: 0, .. })
        ));
    }
    for [a, b] in pairs() {
        if let Some(torso) = back(OrganShape::cylinder([a, 0.0], [1.0, b])) {
            let raster = &rasters[0];
            let mut image = vec![0.0; raster.size().iter().product()];
            let organ = Organ {
                shape: torso,
                activity: a,
                attenuation: b,
            };
            if let Some(organs) = back(Organs::new(vec![organ])) {
                let assembly = Assembly::new(&organs);
                back(assembly.project_add(raster, Shown::Organs, 1.0, &mut image));
                back(organs.voxelize::<f64>(&grids[0], 0..1, |organ| organ.attenuation));
            }
            let _ = torso.span(&rays[0]);
        }
        if let Some(ball) = back(OrganShape::ellipsoid([a, 0.0, b], [1.0, b, a])) {
            let shape = ball;
            let organ = Organ {
                shape,
                activity: b,
                attenuation: a,
            };
            if let Some(organs) = back(Organs::new(vec![organ])) {
                back(organs.voxelize::<f64>(&grids[0], 0..1, |organ| organ.activity));
            }
        }
        back(rasters[0].clone().with_planes(&[a, b]));
        shells([a, b]);
        let mask = Mask::new([2, 1, 3], vec![true, false, true, true, true, false]);
        let _ = mask.expect("six voxels").farther_than(a);
        let profile = grids[0].profile(
            &vec![1.0f32; grids[0].len()],
            [Point3::new(a, b, 0.0); 2],
            3,
        );
        if let Some(profile) = back(profile) {
            let _ = profile.edge_width(a, b);
        }
    }
}

fn shells([a, b]: [f64; 2]) {
    let curve = |r: f64| Curve::polyline(&[0.0, 0.4, 1.0], &[[0.0, r], [1.0, r], [2.0, 0.0]]);
    back(Curve::polyline(&[0.0, a], &[[0.0, 1.0], [1.0, b]]));
    back(Curve::polyline(&[0.0], &[[0.0, 1.0]]));
    back(Curve::new(vec![], vec![]));
    let piece = Piece::Power {
        x: vec![a],
        r: vec![b],
    };
    let odd = back(Curve::new(vec![0.0, 1.0], vec![piece]));
    let plain = [curve(1.0).expect("a curve"), curve(2.0).expect("a curve")];
    let mut found = Vec::new();
    for range in [[0.0, 1.0], [a, b], [0.0, b]] {
        found.extend(back(Shell::new(plain[0].clone(), plain[1].clone(), range)));
    }
    if let Some(odd) = odd {
        let _ = odd.at(a);
        found.extend(back(Shell::new(odd.clone(), plain[1].clone(), [0.0, 1.0])));
        found.extend(back(Shell::new(odd.clone(), odd, [0.0, 1.0])));
    }
    for shell in &found {
        let _ = shell.point(a, b);
        let _ = shell.tangents(a, b);
        let _ = shell.locate([a, b]);
        let _ = shell.corresponding(a, &found[0]);
        let _ = shell.thickness(a);
        let _ = shell.volume_rate(b);
        back(shell.region([0.0, a], [0.0, b], 0.1));
        back(shell.region([0.2, 0.5], [0.1, 0.6], b.max(1e-3)));
    }
}
