//! Gated SPECT: 16 gates, 64 views over 180 degrees, 128^3 voxels by default, each gate reconstructed and compared with its ground truth.
//!
//! `cargo run --release -p heart-phantom --example gated_spect -- [VOXELS]`

use heart_phantom::{Accuracy, Mode, Scene, radon::Window};
use heart_phantom::{Phantom, VolumeCurve, VolumeRange};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n = std::env::args().nth(1).map_or(Ok(128), |n| n.parse())?;
    let mut scene = Scene::default()
        .with_size(n)
        .with_mode(Mode::Gated { gates: 16 });
    scene.cycle.curve = VolumeCurve::Physiological;
    scene.cycle.volume = VolumeRange::EjectionFraction(0.45);
    scene.reconstruction.window = Window::Hann;
    scene.camera.views = 64;
    scene.camera.seconds_per_view = 20.0;
    scene.acquisition.accuracy = Accuracy::Steps(32);

    let clock = Instant::now();
    let phantom = Phantom::new(scene)?;
    let volumes = (0..phantom.n_gates())
        .map(|gate| phantom.volume(gate))
        .collect::<Result<Vec<_>, _>>()?;
    println!(
        "{} volumes in {:.2} s",
        volumes.len(),
        clock.elapsed().as_secs_f64()
    );

    println!("gate   cavity (mL)   outside   wall sd/mean   blur of wall and apex (mm)");
    for (gate, volume) in volumes.iter().enumerate().step_by(4) {
        let middle = (gate as f64 + 0.5) / phantom.n_gates() as f64;
        let cavity = phantom.shape(middle)?.volumes()[0];
        let found = phantom.artefacts(gate, volume, &phantom.truth(gate)?)?;
        let number = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.3}"));
        println!(
            "{gate:4}   {cavity:11.2}   {}     {}          {}  {}",
            number(found.streaks_outside),
            number(found.wall_unevenness),
            number(found.wall_blur_mm),
            number(found.apex_blur_mm)
        );
    }
    println!("{:?}", phantom.work());
    Ok(())
}
