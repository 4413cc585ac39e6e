//! Positions and orientation of sections.

use crate::look::planes::{Planes, SHORT_AXIS};
use heart_phantom::Phantom;
use heart_phantom::Scene;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};

/// A volume that increases along a direction of the short-axis section has its largest segment on that side of the polar map, and equal
/// segments on both sides of it.
#[test]
fn short_axis_sections_and_polar_maps_have_one_orientation() {
    for pose in [
        "",
        "rotate_x = 39.2, rotate_y = 128.0",
        "rotate_x = 0.0, rotate_y = 0.0",
        // The long axis points to front and head, so that no side of the wall is the farthest.
        "rotate_x = 45.0, rotate_y = 0.0",
    ] {
        let mut scene = Scene::from_toml(&format!("pose = {{ {pose} }}\n"))
            .unwrap()
            .with_size(24);
        scene.acquisition.mode = heart_phantom::Mode::Static { phase: 0.0 };
        let phantom = Phantom::new(scene).unwrap();
        let (grid, planes) = (*phantom.camera().grid(), Planes::new(&phantom));
        let plane = &planes.planes[SHORT_AXIS];
        let segments = |way: Vector3<f64>| {
            let [nx, ny, nz] = grid.shape();
            let places =
                (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
            let value = |[x, y, z]: [usize; 3]| {
                (20.0 + way.dot(&(grid.centre(x, y, z) - plane.middle))) as f32
            };
            phantom
                .polar_map(0, &places.map(value).collect::<Vec<f32>>())
                .unwrap()
                .segments
        };
        // Mid-ventricle, from the anterior wall over the septum: 7 to 12.
        let up = segments(plane.up);
        assert!((7..12).all(|k| up[6] > up[k] + 0.3), "{pose}: {up:?}");
        let right = segments(plane.right);
        for (k, l) in [(7, 8), (10, 11)] {
            assert!(
                (right[k] - right[l]).abs() < 0.02 && (up[k] - up[18 - k]).abs() < 0.02,
                "{pose}: {up:?} {right:?}"
            );
        }
        assert!(right[10] > right[7] + 0.3, "{pose}: {right:?}");
    }
}

/// A volume that is linear in position is reproduced at the positions of the axes, with its marks on the correct sides.
#[test]
fn sections_reproduce_a_linear_volume() {
    let phantom = Phantom::new(Scene::default().with_size(24)).unwrap();
    let grid = *phantom.camera().grid();
    let [nx, ny, nz] = grid.shape();
    let field = |p: &Point3<f64>| p.x + 100.0 * p.y + 10_000.0 * p.z;
    let mut volume = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                volume.push(field(&grid.centre(x, y, z)) as f32);
            }
        }
    }
    let planes = Planes::new(&phantom);
    let cuts = planes.cut(&volume);
    assert_eq!(cuts.len(), 6);
    for (plane, cut) in planes.planes.iter().zip(&cuts) {
        let [columns, rows] = cut.size;
        let mut inside = 0;
        for (k, value) in cut.values.iter().enumerate() {
            let along = |a: usize, k: usize| plane.first[a] + k as f64 * plane.step[a];
            let place = plane.middle
                + plane.right * along(0, k % columns)
                + plane.up * along(1, k / columns);
            // Where all eight voxels are.
            if place.coords.amax() < 7.5 {
                // f32 of at most 8e4.
                assert!((f64::from(*value) - field(&place)).abs() < 0.02);
                inside += 1;
            }
        }
        assert!(inside > columns * rows / 2, "{}", cut.title);
    }
    let marks: Vec<[&str; 4]> = (cuts.iter())
        .map(|cut| [0, 1, 2, 3].map(|k| cut.marks[k].as_str()))
        .collect();
    assert_eq!(marks[0], ["R", "L", "P", "A"]);
    assert_eq!(marks[1], ["R", "L", "I", "S"]);
    assert_eq!(marks[2], ["A", "P", "I", "S"]);
    // The apex of the study points to the left, front and head: it is on top of one long axis and to the right of the other.
    assert_eq!(marks[4][3], "ALS");
    assert_eq!(marks[5][1], "ALS");
    // Axial: y grows downwards.
    assert!(cuts[0].extent[1][0] > cuts[0].extent[1][1]);
}
