//! Six sections through the middle of the heart: three planes of the body and three of the heart.

use crate::figures::{Cut, trilinear};
use heart_phantom::Phantom;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use std::f64::consts::FRAC_1_SQRT_2;

/// Index of the short-axis section.
pub(super) const SHORT_AXIS: usize = 3;

/// A plane: the directions to the right and up in the lab, and the positions of its samples along both, from its centre, cm.
#[derive(Debug)]
struct Plane {
    title: String,
    labels: [&'static str; 2],
    right: Vector3<f64>,
    up: Vector3<f64>,
    middle: Point3<f64>,
    /// Columns and rows.
    size: [usize; 2],
    /// Position of the first sample, along right and up.
    first: [f64; 2],
    step: [f64; 2],
    /// Labels of the axes, right and up.
    extent: [[f64; 2]; 2],
}

/// The planes of a phantom.
#[derive(Debug)]
pub(super) struct Planes {
    grid: VoxelGrid,
    planes: Vec<Plane>,
}

impl Planes {
    pub(super) fn new(phantom: &Phantom) -> Self {
        let (grid, heart) = (*phantom.camera().grid(), phantom.heart());
        let pose = heart.pose();
        let middle = pose.to_lab(&Point3::new(0.5 * heart.length(), 0.0, 0.0));
        let (axis, up) = (pose.axis(), anterior(pose));
        let mut planes = of_the_body(&grid, &middle);
        planes.extend(of_the_heart(
            &grid,
            &middle,
            [axis, up],
            0.7 * heart.length(),
        ));
        Self { grid, planes }
    }

    /// Returns whether the heart has an anatomical pose: in the short-axis section the anterior wall is anterior or superior, the lateral
    /// wall on the left of the patient.
    pub(super) fn is_anatomical(&self) -> bool {
        self.planes.get(SHORT_AXIS).is_some_and(|plane| {
            letters(&plane.up).contains(['A', 'S']) && letters(&plane.right).contains('L')
        })
    }

    /// Returns the number of samples of all sections of a volume.
    pub(super) fn len(&self) -> usize {
        let sizes = self.planes.iter().map(|plane| plane.size);
        sizes.map(|[columns, rows]| columns * rows).sum()
    }

    /// Returns the sections of a volume `[z][y][x]`, with linear interpolation.
    pub(super) fn cut(&self, volume: &[f32]) -> Vec<Cut> {
        self.planes
            .iter()
            .map(|plane| plane.cut(&self.grid, volume))
            .collect()
    }
}

impl Plane {
    fn cut(&self, grid: &VoxelGrid, volume: &[f32]) -> Cut {
        let [columns, rows] = self.size;
        let mut values = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            let up = self.first[1] + row as f64 * self.step[1];
            for column in 0..columns {
                let right = self.first[0] + column as f64 * self.step[0];
                let place = self.middle + self.right * right + self.up * up;
                values.push(interpolated(grid, volume, &place));
            }
        }
        Cut {
            title: self.title.clone(),
            labels: self.labels.map(String::from),
            marks: [-self.right, self.right, -self.up, self.up].map(|way| letters(&way)),
            size: self.size,
            values,
            extent: self.extent,
        }
    }
}

/// Axial, coronal and sagittal planes on the voxels nearest to the centre, in radiological orientation.
fn of_the_body(grid: &VoxelGrid, middle: &Point3<f64>) -> Vec<Plane> {
    let (shape, spacing, origin) = (grid.shape(), grid.spacing(), grid.origin());
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let nearest = [0, 1, 2].map(|a| {
        let k = ((middle[a] - origin[a]) / spacing[a]).round();
        origin[a] + k.clamp(0.0, (shape[a] - 1) as f64) * spacing[a]
    });
    let last = [0, 1, 2].map(|a| origin[a] + (shape[a] - 1) as f64 * spacing[a]);
    // From the first voxel's edge to the last one's.
    let edges = [0, 1, 2].map(|a| [origin[a] - 0.5 * spacing[a], last[a] + 0.5 * spacing[a]]);
    let names = ["x (cm)", "y (cm)", "z (cm)"];
    let plane = |title: &str, across: usize, [a, b]: [usize; 2], up: Vector3<f64>, down: bool| {
        let mut corner = Point3::origin();
        corner[across] = nearest[across];
        corner[a] = origin[a];
        corner[b] = if down { last[b] } else { origin[b] };
        let [low, high] = edges[b];
        Plane {
            title: format!(
                "{title}, {} = {:.2} cm",
                &names[across][..1],
                nearest[across]
            ),
            labels: [names[a], names[b]],
            right: [x, y, z][a],
            up,
            middle: corner,
            size: [shape[a], shape[b]],
            first: [0.0; 2],
            step: [spacing[a], spacing[b]],
            extent: [edges[a], if down { [high, low] } else { [low, high] }],
        }
    };
    vec![
        plane("axial", 2, [0, 1], -y, true),
        plane("coronal", 1, [0, 2], z, false),
        plane("sagittal", 0, [1, 2], z, false),
    ]
}

/// The direction of the anterior wall: perpendicular to the long axis, farthest towards the patient's front and head, as in
/// [`PolarMap`](heart_phantom::PolarMap). The y axis of the body frame if the long axis has that direction.
fn anterior(pose: &Pose) -> Vector3<f64> {
    let (axis, up) = (
        pose.axis(),
        Vector3::new(0.0, -FRAC_1_SQRT_2, FRAC_1_SQRT_2),
    );
    let across = (up - axis * axis.dot(&up)).try_normalize(1e-9);
    across.unwrap_or_else(|| {
        pose.to_lab(&Point3::new(0.0, 1.0, 0.0)) - pose.to_lab(&Point3::origin())
    })
}

/// Short axis, horizontal and vertical long axis of the region of the heart in cardiological orientation: viewed from the apex with the
/// anterior wall on top and the lateral wall to the right, as in polar maps, and with the apex on top or to the right.
fn of_the_heart(
    grid: &VoxelGrid,
    middle: &Point3<f64>,
    [axis, up]: [Vector3<f64>; 2],
    half: f64,
) -> Vec<Plane> {
    let right = up.cross(&axis);
    let step = grid.spacing().into_iter().fold(f64::INFINITY, f64::min);
    // Limited by the resolution of the image; interpolated in large voxels.
    let step = step.clamp(half / 256.0, half / 64.0);
    let n = (2.0 * half / step).ceil().max(2.0) as usize;
    let half = 0.5 * n as f64 * step;
    let plane = |title: &str, right, up| Plane {
        title: title.into(),
        labels: ["cm", "cm"],
        right,
        up,
        middle: *middle,
        size: [n; 2],
        first: [0.5 * step - half; 2],
        step: [step; 2],
        extent: [[-half, half]; 2],
    };
    vec![
        plane("short axis", right, up),
        plane("horizontal long axis", right, axis),
        plane("vertical long axis", axis, up),
    ]
}

/// Letters of a direction, the largest component first: left or right, anterior or posterior, superior or inferior.
fn letters(way: &Vector3<f64>) -> String {
    let mut parts = [(way.x, "LR"), (way.y, "PA"), (way.z, "SI")];
    parts.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    (parts.iter())
        .filter(|(part, _)| part.abs() > 0.35)
        .map(|(part, names)| {
            if *part > 0.0 {
                &names[..1]
            } else {
                &names[1..]
            }
        })
        .collect()
}

/// [Trilinear](trilinear) up to half a voxel beyond the outermost centres, 0 outside.
fn interpolated(grid: &VoxelGrid, volume: &[f32], place: &Point3<f64>) -> f32 {
    let (shape, spacing, origin) = (grid.shape(), grid.spacing(), grid.origin());
    let at = Point3::from([0, 1, 2].map(|a| (place[a] - origin[a]) / spacing[a]));
    let is_inside = |a: usize| (-0.5..=shape[a] as f64 - 0.5).contains(&at[a]);
    match (0..3).all(is_inside) {
        true => trilinear(volume, shape, &at) as f32,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heart_phantom::Scene;

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
                let places = (0..nz)
                    .flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
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
}
