//! The ejection fraction from reconstructed volumes against that of the phantom: gated blood pool, from the counts in the cavity; and gated
//! perfusion SPECT in a chest without scatter, with it, and with known scatter, from the volume within the edge of the wall.
//!
//! `cargo run --release -p heart-phantom --example ejection_fraction`

use heart_phantom::scene::ScatterSettings;
use heart_phantom::{Accuracy, Mode, Scene};
use heart_phantom::{
    BinSample, Method, Osem, Phantom, PhantomError, Uptake, VolumeCurve, VolumeRange,
};

fn main() -> Result<(), PhantomError> {
    blood_pool()?;
    println!("perfusion, 8 gates, OSEM       EDV (mL)   ESV (mL)   fraction   true");
    for (name, scatter, known) in [
        ("without scatter", false, false),
        ("with scatter", true, false),
        ("known scatter", true, true),
    ] {
        perfusion(name, scatter, known)?;
    }
    Ok(())
}

/// Counts in the cavity of each gate.
fn blood_pool() -> Result<(), PhantomError> {
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
        // Few gates average over phases, which reduces the extremes.
        let found = (largest - smallest) / largest;
        println!(
            "{gates:5}   {found:.4}   {:.4}",
            phantom.numbers()?.ejection_fraction
        );
    }
    Ok(())
}

/// Volumes of the cavity within the edge of the wall (`Phantom::polar_map`); expected counts, attenuation corrected.
fn perfusion(name: &str, scatter: bool, known: bool) -> Result<(), PhantomError> {
    let mut scene = Scene::from_toml(include_str!("../scenes/chest.toml"))?;
    scene.acquisition.mode = Mode::Gated { gates: 8 };
    scene.acquisition.accuracy = Accuracy::Tolerance(0.1);
    scene.camera.samples = Some(BinSample::Centres);
    scene.noise = None;
    scene.scatter = scatter.then(|| ScatterSettings {
        tolerance: 0.02,
        ..ScatterSettings::default()
    });
    scene.reconstruction.method = Method::Osem(Osem {
        attenuation: true,
        scatter: known,
        ..Osem::new(8, 4)
    });
    let phantom = Phantom::new(scene)?;
    let volumes = (0..phantom.n_gates())
        .map(|gate| {
            let map = phantom.polar_map(gate, &phantom.volume(gate)?)?;
            Ok(map.cavity_ml.unwrap_or(f64::NAN))
        })
        .collect::<Result<Vec<_>, PhantomError>>()?;
    let largest = volumes.iter().copied().fold(f64::MIN, f64::max);
    let smallest = volumes.iter().copied().fold(f64::MAX, f64::min);
    println!(
        "{name:28} {largest:10.1} {smallest:10.1} {:10.3}   {:.3}",
        (largest - smallest) / largest,
        phantom.numbers()?.ejection_fraction
    );
    Ok(())
}
