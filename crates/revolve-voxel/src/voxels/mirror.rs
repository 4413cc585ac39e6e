//! Mirror planes of a grid and its bodies: half of the voxels are then copies.

use nalgebra::Point3;

use crate::{Pose, VoxelGrid};

/// Tolerance of the symmetry of directions and positions, relative to their size.
const SLACK: f64 = 4.0 * f64::EPSILON;

/// The mirror plane that exchanges two axes of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mirror {
    axes: [usize; 2],
}

impl Mirror {
    /// Returns a plane that maps the grid onto itself and contains the axis of every body, if there is one.
    pub(crate) fn of<'a>(
        poses: impl Iterator<Item = &'a Pose> + Clone,
        grid: &VoxelGrid,
    ) -> Option<Self> {
        let (shape, spacing, origin) = (grid.shape(), grid.spacing(), grid.origin());
        let holds = |[a, b]: [usize; 2], pose: &Pose| {
            let (axis, foot) = (pose.axis(), pose.to_lab(&Point3::origin()));
            let from = [0, 1, 2].map(|k| foot[k] - origin[k]);
            let size = (0..3)
                .map(|k| from[k].abs() + shape[k] as f64 * spacing[k])
                .fold(0.0, f64::max);
            (axis[a] - axis[b]).abs() <= SLACK && (from[a] - from[b]).abs() <= SLACK * size
        };
        let axes = [[0, 2], [0, 1], [1, 2]].into_iter().find(|&[a, b]| {
            shape[a] == shape[b]
                && spacing[a] == spacing[b]
                && poses.clone().all(|pose| holds([a, b], pose))
        })?;
        Some(Self { axes })
    }

    /// Mirrors per-axis values.
    pub(crate) fn image<T: Clone>(&self, of: &[T; 3]) -> [T; 3] {
        let mut image = of.clone();
        image.swap(self.axes[0], self.axes[1]);
        image
    }

    /// Returns whether a voxel is the image of a computed one.
    pub(crate) fn is_image(&self, place: &[usize; 3]) -> bool {
        place[self.axes[0]] < place[self.axes[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use std::f64::consts::FRAC_PI_4;

    #[test]
    fn symmetry_is_detected() {
        let cube = VoxelGrid::cube(20, 0.5).unwrap();
        let along_z = Pose::axis_along_z(1.3).unwrap();
        let study = (along_z.rotated_x(FRAC_PI_4).unwrap())
            .rotated_y(FRAC_PI_4)
            .unwrap();
        let of = |pose: &Pose, grid: &VoxelGrid| Mirror::of([pose].into_iter(), grid);
        assert_eq!(of(&study, &cube), Some(Mirror { axes: [0, 2] }));
        assert_eq!(of(&along_z, &cube), Some(Mirror { axes: [0, 1] }));
        // Slightly rotated, displaced, on another grid, or with another body: no symmetry.
        let turned = study.rotated_z(1e-12).unwrap();
        let moved = study.shifted(Vector3::new(1e-12, 0.0, 0.0)).unwrap();
        let along = study.shifted(Vector3::new(0.3, 5.0, 0.3)).unwrap();
        assert_eq!(of(&turned, &cube), None);
        assert_eq!(of(&moved, &cube), None);
        assert_eq!(of(&along, &cube), of(&study, &cube));
        let grid = |shape, spacing, offset| VoxelGrid::centred(shape, spacing, offset).unwrap();
        for other in [
            grid([20, 20, 21], [0.5; 3], [0.0; 3]),
            grid([20; 3], [0.5, 0.5, 0.6], [0.0; 3]),
            grid([20; 3], [0.5; 3], [0.0, 0.0, 0.1]),
        ] {
            assert_eq!(of(&study, &other), None);
        }
        assert_eq!(Mirror::of([&study, &along_z].into_iter(), &cube), None);
    }
}
