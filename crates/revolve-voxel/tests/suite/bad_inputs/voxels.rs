//! Rejected input of voxels, masks, meshes, regions and rasters.

use super::*;
use revolve_voxel::{Organ, Organs};

#[test]
fn rays_beyond_a_raster() {
    let rays = ParallelDetector::new(4, 3, [1.0; 2])
        .and_then(|detector| detector.rays(0.3))
        .unwrap();
    let some = rays.rows(1..3).unwrap();
    assert_eq!(some.ray(3, 1), rays.ray(3, 2));
    assert!(some.ray(3, 1).is_some());
    for (bin, row) in [(4, 0), (0, 2), (usize::MAX, 0), (0, usize::MAX)] {
        assert_eq!(some.ray(bin, row), None);
    }
    // The first and the last ray are finite, but one in between is not.
    let raster = |count: usize, step: f64| {
        let (bin, row) = (Vector3::x() * step, Vector3::x() * -step);
        Lines::parallel([count; 2], Point3::origin(), bin, row, Vector3::z())
    };
    assert!(raster(1000, 1e300).is_ok());
    assert!(matches!(
        raster(1 << 28, 1e300),
        Err(RevolveError::NotFinite { .. })
    ));
}

#[test]
fn slices_out_of_order_and_samples_of_nan() {
    let (body, grid) = (cylinder(), VoxelGrid::cube(4, 1.0).unwrap());
    let torso = Organs::new(vec![Organ {
        shape: OrganShape::cylinder([0.0; 2], [1.0; 2]).unwrap(),
        activity: 1.0,
        attenuation: 0.0,
    }])
    .unwrap();
    let curve = |r| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [1.0, r]]).unwrap();
    let shell = Shell::new(curve(1.0), curve(2.0), [0.0, 1.0]).unwrap();
    let pose = Pose::identity();
    for (start, end) in [(3, 1), (usize::MAX, 2), (1 << 62, 4)] {
        let slices = start..end;
        let refused = |outcome: Option<RevolveError>| {
            let Some(RevolveError::BadRange { start: given, .. }) = outcome else {
                return false;
            };
            given == start
        };
        let none: &mut [f64] = &mut [];
        let add = voxelize_add(&body, &grid, slices.clone(), 0.01, &[1.0], none);
        assert!(refused(add.err()));
        let regions = body.regions::<f64>(&grid, slices.clone(), 0.01);
        assert!(refused(regions.err()));
        let map = torso.voxelize::<f64>(&grid, slices.clone(), |organ| organ.activity);
        assert!(refused(map.err()));
        let voxels = shell.map_voxels(&pose, &grid, slices, 0.0, |_, _, _| ());
        assert!(refused(voxels.err()));
    }
    // An empty request for a grid of 2^56 voxels per slice needs no memory.
    let wide = VoxelGrid::new([1 << 28, 1 << 28, 1], [1.0; 3], [0.0; 3]).unwrap();
    let none = torso.voxelize::<f64>(&wide, 0..0, |organ| organ.activity);
    assert!(none.unwrap().is_empty());
}

#[test]
fn profiles_of_any_length() {
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    let ends = [Point3::origin(), Point3::new(1.0, 0.0, 0.0)];
    for n in [usize::MAX, 1 << 60, 1 << 45] {
        assert!(matches!(
            grid.profile(&[1.0f32; 8], ends, n),
            Err(RevolveError::TooLarge { .. })
        ));
    }
    for bad in [f64::NAN, f64::INFINITY] {
        let ends = [Point3::origin(), Point3::new(1.0, bad, 0.0)];
        assert!(matches!(
            grid.profile(&[1.0f32; 8], ends, 3),
            Err(RevolveError::NotFinite { .. })
        ));
    }
}

#[test]
fn masks_with_a_side_of_zero() {
    for shape in [[0, usize::MAX, 2], [usize::MAX, 0, 2], [2, usize::MAX, 0]] {
        assert!(matches!(
            Mask::new(shape, vec![]),
            Err(RevolveError::TooLarge { .. })
        ));
    }
    let mut long = Mask::new([0, 1 << 40, 1], vec![]).unwrap();
    long.erode(3);
    assert_eq!(long.farther_than(f64::INFINITY).count(), 0);
    assert!(matches!(
        long.intersect_slices(&[]),
        Err(RevolveError::WrongLength { .. })
    ));
    // A distance beyond a long, thin grid does not visit all offsets of a ball of that radius.
    let mut set = vec![false; 1_000_000];
    set[17] = true;
    let mask = Mask::new([1, 1, 1_000_000], set).unwrap();
    assert_eq!(mask.farther_than(f64::INFINITY).count(), 0);
    assert_eq!(mask.farther_than(10.0).count(), 1_000_000 - 21);
}

#[test]
fn meshes_with_invalid_lists() {
    let mesh = |triangle: [u32; 3], n_normals: usize| {
        let (vertices, normals) = (vec![Point3::origin(); 3], vec![Vector3::x(); n_normals]);
        Mesh::new(vertices, normals, vec![triangle])
    };
    let whole = mesh([0, 1, 2], 3);
    assert_eq!(whole.volume(), 0.0);
    assert!(whole.write_stl("", Vec::new()).is_ok() && whole.write_ply(Vec::new()).is_ok());
    let empty = Mesh::new(Vec::new(), Vec::new(), vec![[0, 1, 2]]);
    for broken in [mesh([0, 1, 3], 3), mesh([u32::MAX, 0, 0], 3), empty] {
        assert!(broken.volume().is_nan());
        for written in [
            broken.write_stl("", Vec::new()),
            broken.write_ply(Vec::new()),
            whole.write_stl("solid of revolution", Vec::new()),
            mesh([0, 1, 2], 2).write_ply(Vec::new()),
        ] {
            assert_eq!(
                written.unwrap_err().kind(),
                std::io::ErrorKind::InvalidInput
            );
        }
    }
    // Tens of thousands of millions of points at the finest.
    let fine = cylinder().mesh(0, 1e-17);
    assert!(matches!(
        fine,
        Err(RevolveError::TooFine { .. } | RevolveError::TooLarge { .. })
    ));
}

#[test]
fn regions_whose_lists_were_changed() {
    let grid = VoxelGrid::cube(2, 1.0).unwrap();
    let mut regions = cylinder().regions::<f64>(&grid, 0..2, 0.01).unwrap();
    let none = regions.label_pieces(usize::MAX, &[], &grid, 0..2, 0.01);
    assert!(matches!(none, Err(RevolveError::WrongLength { .. })));
    regions.coverage.clear();
    let none = regions.label_pieces(0, &[], &grid, 0..2, 0.01);
    assert!(matches!(none, Err(RevolveError::WrongLength { .. })));
}
