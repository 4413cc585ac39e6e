//! Cone-beam CT of a beating heart, one turn in 0.3 s from 60 cm: projections for RTK (`beating.mha` with `beating.xml`) and for ASTRA
//! (`beating.npy` with `beating-vectors.npy`), and those of the static heart of the first view, without motion artefacts.
//!
//! `cargo run --release -p heart-phantom --example cone_beam -- FOLDER`

use heart_phantom::files::{write_astra, write_rtk};
use heart_phantom::revolve_voxel::ParallelDetector;
use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::{Mode, Scene};
use heart_phantom::{Phantom, RayGeometry, no_observer};
use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;

const VIEWS: usize = 180;
const TURN: f64 = 0.3;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".into()));
    let part = |k: usize| k as f64 / VIEWS as f64;
    let angles: Vec<f64> = (0..VIEWS).map(|k| TAU * part(k)).collect();
    let times: Vec<f64> = (0..VIEWS).map(|k| TURN * part(k)).collect();
    // 128 x 128 bins of 0.25 cm, 0.15 cm in the heart.
    let detector = ParallelDetector::new(128, 128, [0.25; 2])?;
    let cone = RayGeometry::cone([60.0, 100.0], &angles, detector)?.with_times(&times)?;
    let mut first = Vec::new();
    for (name, mode) in [
        ("beating", Mode::Instants),
        ("still", Mode::Static { phase: 0.0 }),
    ] {
        let phantom = Phantom::new(Scene::default().with_mode(mode))?.along(cone.clone())?;
        let views = phantom.sinograms(0, &no_observer)?;
        write_rtk(&folder.join(name), &cone, &views.samples)?;
        write_astra(&folder.join(name), &cone, &views.samples)?;
        let sum: f32 = views.samples.iter().sum();
        println!(
            "{name}: {} shapes of the heart, sum {sum}",
            views.distinct_shapes
        );
        first.push(views.samples[..128 * 128].to_vec());
    }
    let shape = Phantom::new(Scene::default())?.shape(0.0)?;
    let wall = shape.body().region_measures(1)?;
    let at = (shape.body().pose()).to_lab(&Point3::new(wall.centroid(), 0.0, 0.0));
    println!(
        "wall of the static heart: {:.3} mL, centroid ({:.4}, {:.4}, {:.4}) cm",
        wall.volume, at.x, at.y, at.z
    );
    // The first view is identical; motion changes the other ones.
    assert_eq!(first[0], first[1]);
    Ok(())
}
