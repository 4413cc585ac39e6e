//! The ejection fraction from reconstructed volumes: gated blood pool, counts in the cavity of each gate (what a nuclear
//! physician does), against the fraction that the phantom was given.
//!
//! `cargo run --release -p heart-phantom --example ejection_fraction`

use heart_phantom::scene::{Mode, Scene};
use heart_phantom::{Phantom, PhantomError, Uptake, VolumeCurve, VolumeRange};

fn main() -> Result<(), PhantomError> {
    println!("gates   found     true");
    for gates in [4, 8, 16, 32] {
        let mut scene = Scene::default()
            .with_size(64)
            .with_mode(Mode::Gated { gates });
        scene.cycle.curve = VolumeCurve::Physiological;
        scene.cycle.volume = VolumeRange::EjectionFraction(0.5);
        scene.activity.cavity = Uptake::Concentration(1.0);
        scene.activity.wall = Uptake::Concentration(0.0);
        let phantom = Phantom::new(scene)?;
        let voxel = phantom.camera().grid().voxel_volume();
        let mut volumes = Vec::new();
        for gate in 0..gates {
            let sum: f64 = phantom.volume(gate)?.iter().map(|&v| f64::from(v)).sum();
            volumes.push(sum * voxel);
        }
        let largest = volumes.iter().copied().fold(f64::MIN, f64::max);
        let smallest = volumes.iter().copied().fold(f64::MAX, f64::min);
        // Few gates mix phases: the extremes are averaged away.
        let found = (largest - smallest) / largest;
        println!(
            "{gates:5}   {found:.4}   {:.4}",
            phantom.numbers()?.ejection_fraction
        );
    }
    Ok(())
}
