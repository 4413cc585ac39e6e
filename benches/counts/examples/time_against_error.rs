//! Prints time, work and error of the voxels of a dilated two-membrane body, by tolerance, tab-separated.
//!
//! `cargo run --release -p counts --example time_against_error [voxels a side, 96 by default]`. Two slices through
//! the middle; the reference is coverage to 1e-9; times are those of one run with all threads.

use revolve_voxel::{Body, Meridian, Pose, VoxelGrid};
use std::f64::consts::{FRAC_PI_4, PI};
use std::time::Instant;

fn balloon(radius: f64) -> Result<Meridian, revolve_voxel::RevolveError> {
    let n = 200;
    let h = 9.5 + radius;
    let points: Vec<[f64; 2]> = (0..=n)
        .map(|k| {
            let u = k as f64 / n as f64;
            let r = radius * (0.5 * PI * u).cos() + 1.6 * (PI * u).sin();
            [
                h * (1.0 - (0.5 * PI * u).cos()) - 0.5 * (PI * u).sin(),
                if k == n { 0.0 } else { r },
            ]
        })
        .collect();
    Meridian::new(&points)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n: usize = std::env::args().nth(1).map_or(Ok(96), |a| a.parse())?;
    let pose = Pose::axis_along_z(5.625)?
        .rotated_x(FRAC_PI_4)?
        .rotated_y(FRAC_PI_4)?;
    let body = Body::new(vec![balloon(1.75)?, balloon(2.75)?], pose)?;
    let h = 16.0 / n as f64;
    let grid = VoxelGrid::centred([n, n, 2], [h; 3], [0.0; 3])?;
    let wall = [0.0, 1.0];
    let (exact, counters) = body.voxelize::<f64>(&grid, 1e-9, &wall)?;
    println!("tolerance\ttime (s)\tevaluations\tlargest error\trms error of cut voxels");
    for (name, tolerance) in [
        ("coverage 1e-2", 1e-2),
        ("coverage 1e-3", 1e-3),
        ("coverage 1e-4", 1e-4),
        ("coverage 1e-5", 1e-5),
        ("coverage 1e-6", 1e-6),
    ] {
        let start = Instant::now();
        let (v, c) = body.voxelize::<f64>(&grid, tolerance, &wall)?;
        let time = start.elapsed().as_secs_f64();
        let errors = v.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        let worst = errors.clone().fold(0.0, f64::max);
        let rms = (errors.map(|e| e * e).sum::<f64>() / counters.cut as f64).sqrt();
        println!(
            "{name}\t{time:.4}\t{}\t{worst:.1e}\t{rms:.1e}",
            c.evaluations
        );
    }
    Ok(())
}
