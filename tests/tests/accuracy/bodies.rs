//! Solids of revolution: covered fractions of voxels.

use crate::Row;
use crate::voxel::covered;
use nalgebra::Point3;
use revolve_voxel::{Body, Meridian, Pose, VoxelGrid};
use tests::Random;

pub(crate) const ROWS: &[Row] = &[Row {
    name: "revolve_voxel::Body::voxelize_add",
    what: "volume fraction of a voxel inside the solid",
    reference: "1.1e5 points of a Kronecker sequence per voxel, tested against closed-form cones",
    norm: "maximum over the voxels of a row",
    quick: 20,
    problem: covered_fraction,
}];

fn covered_fraction(random: &mut Random) -> Option<f64> {
    let n = random.integer(2, 8);
    let profile: Vec<[f64; 2]> = (0..=n)
        .map(|k| [k as f64 / n as f64, random.uniform(0.05, 0.6)])
        .collect();
    let pose = Pose::axis_along_z(0.5)
        .ok()?
        .rotated_x(random.angle(-3.0, 3.0))
        .ok()?
        .rotated_y(random.angle(-3.0, 3.0))
        .ok()?;
    let body = Body::new(vec![Meridian::new(&profile).ok()?], pose).ok()?;
    let tolerance = random.decades(-2.5, -0.5);
    let spacing = [0; 3].map(|_| random.any(0.05, 0.3));
    let origin = [0.3, 0.3, 0.0].map(|reach| random.uniform(-reach, reach));
    let grid = VoxelGrid::new([6, 1, 1], spacing, origin).ok()?;
    let (fractions, _) = body.voxelize::<f64>(&grid, tolerance, &[1.0]).ok()?;
    let inside = |point: Point3<f64>| {
        let at = pose.to_body(&point);
        let place = at.x * n as f64;
        if !(0.0..n as f64).contains(&place) {
            return false;
        }
        let (k, fraction) = (place.floor() as usize, place.fract());
        let radius = profile[k][1] + fraction * (profile[k + 1][1] - profile[k][1]);
        at.y.hypot(at.z) < radius
    };
    let mut worst = 0.0_f64;
    for (ix, fraction) in fractions.iter().enumerate() {
        let centre = grid.centre(ix, 0, 0);
        let exact = covered(spacing, |by| inside(centre + by));
        worst = worst.max((fraction - exact).abs());
    }
    Some(worst / tolerance)
}
