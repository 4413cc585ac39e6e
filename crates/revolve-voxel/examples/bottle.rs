//! A bottle with a wall of 2 mm: volumes, a projection, voxels and a mesh for a 3-D printer.
//!
//! `cargo run --release -p revolve-voxel --example bottle -- FOLDER`

use revolve_voxel::{Body, Meridian, ParallelDetector, Pose, VoxelGrid};
use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;

/// The meridian of a bottle of radius 3 cm and height 12 cm with a spherical bottom, displaced inwards by `inset`.
fn meridian(inset: f64) -> Result<Meridian, revolve_voxel::RevolveError> {
    let radius = 3.0 - inset;
    // x along the axis from the opening, distance r from it, of a parameter from 0 (opening) to 1 (bottom).
    let curve = |s: f64| match s {
        ..0.5 => [18.0 * s, radius - 1.5 * (1.0 - s / 0.5).powi(2)],
        _ => {
            let (sin, cos) = (FRAC_PI_2 * (s / 0.5 - 1.0)).sin_cos();
            [9.0 + radius * sin, radius * cos]
        }
    };
    Meridian::from_function(curve, &[0.5], 1e-4)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let pose = Pose::axis_along_z(6.0)?; // the centre of the lab is 6 cm from the opening
    let body = Body::nested(vec![meridian(0.2)?, meridian(0.0)?], pose, 1e-3)?;
    println!("content {:.2} mL", body.region_measures(0)?.volume);
    println!("wall    {:.2} mL", body.region_measures(1)?.volume);

    // Line integrals of a content of activity 1 and a wall of activity 0, [row][bin].
    let rays = ParallelDetector::new(64, 80, [0.2, 0.2])?.rays(0.3)?;
    let (view, counters) = body.project::<f32>(&rays, &[1.0, 0.0])?;
    let sum = view.iter().sum::<f32>() * 0.2 * 0.2;
    println!("content {sum:.2} mL, from {} rays", counters.cast);

    // Averages over voxels, [z][y][x].
    let grid = VoxelGrid::cube(40, 0.4)?;
    let tolerance = 1e-3;
    let (voxels, _) = body.voxelize::<f32>(&grid, tolerance, &[1.0, 0.0])?;
    let sum = f64::from(voxels.iter().sum::<f32>()) * grid.voxel_volume();
    println!("content {sum:.2} mL, from voxels");

    let mesh = body.mesh(1, 1e-2)?;
    let path = folder.join("bottle.stl");
    mesh.write_stl("bottle, cm", std::fs::File::create(&path)?)?;
    println!("{}: {:.2} mL within", path.display(), mesh.volume());
    Ok(())
}
