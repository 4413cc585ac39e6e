//! Six sections through the middle of the heart: three planes of the body and three of the heart.

use crate::figures::{Cut, Volume, edges};
use heart_phantom::Phantom;
use heart_phantom::revolve_voxel::nalgebra::{Point3, Vector3};
use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use std::f64::consts::FRAC_1_SQRT_2;

/// Index of the short-axis section.
pub(super) const SHORT_AXIS: usize = 3;

/// A plane: the directions to the right and up in the lab, and the positions of its samples along both, from its centre, cm.
#[derive(Debug)]
pub(super) struct Plane {
    title: String,
    labels: [&'static str; 2],
    pub(super) right: Vector3<f64>,
    pub(super) up: Vector3<f64>,
    pub(super) middle: Point3<f64>,
    /// Columns and rows.
    size: [usize; 2],
    /// Position of the first sample, along right and up.
    pub(super) first: [f64; 2],
    pub(super) step: [f64; 2],
    /// Labels of the axes, right and up.
    extent: [[f64; 2]; 2],
}

/// The planes of a phantom.
#[derive(Debug)]
pub(super) struct Planes {
    grid: VoxelGrid,
    pub(super) planes: Vec<Plane>,
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
        let (grid, values) = (self.grid, volume);
        let volume = Volume { grid, values };
        self.planes.iter().map(|plane| plane.cut(&volume)).collect()
    }
}

impl Plane {
    fn cut(&self, volume: &Volume<'_>) -> Cut {
        let [columns, rows] = self.size;
        let mut values = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            let up = self.first[1] + row as f64 * self.step[1];
            for column in 0..columns {
                let right = self.first[0] + column as f64 * self.step[0];
                let place = self.middle + self.right * right + self.up * up;
                values.push(interpolated(volume, &place));
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
    let edges = edges(grid);
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

/// Returns the trilinear value up to half a voxel beyond the outermost centres, 0 outside.
fn interpolated(volume: &Volume<'_>, place: &Point3<f64>) -> f32 {
    let (at, shape) = (volume.index(place), volume.grid.shape());
    let is_inside = |a: usize| (-0.5..=shape[a] as f64 - 0.5).contains(&at[a]);
    match (0..3).all(is_inside) {
        true => volume.value(&at) as f32,
        false => 0.0,
    }
}
