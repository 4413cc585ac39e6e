//! A custom heart: two half ellipsoids, a volume curve of five samples and an infarct, with blur and counting noise.
//!
//! `cargo run --release -p heart-phantom --example own_heart`

use heart_phantom::membrane_newton::{Discretisation, Membrane, ReferenceShape};
use heart_phantom::revolve_voxel::Pose;
use heart_phantom::scene::BlurSettings;
use heart_phantom::{Accuracy, Attenuation, Medium, Scene};
use heart_phantom::{
    Counts, Defect, Heart, Mode, Noise, Phantom, PhantomError, VolumeCurve, VolumeRange,
};
use std::f64::consts::PI;

/// Half an ellipse `[x, y]` about the axis, from (0, radius) over the apex (length, 0) to (0, -radius), in cm.
fn half_ellipse(length: f64, radius: f64) -> Result<Membrane, PhantomError> {
    let angle = |k: i32| PI * (0.5 - f64::from(k) / 100.0);
    let point = |t: f64| [length * t.cos(), radius * t.sin()];
    let points: Vec<[f64; 2]> = (0..=100).map(angle).map(point).collect();
    Ok(Membrane::new(ReferenceShape::polyline(&points)?))
}

pub(crate) fn main() -> Result<(), PhantomError> {
    let membranes = [half_ellipse(8.0, 2.5)?, half_ellipse(9.0, 3.5)?];
    let heart = Heart::of_membranes(
        [&membranes[0], &membranes[1]],
        Discretisation::FiniteDifferences { nodes: 101 },
        0.0, // finite differences are polygons, which bodies follow exactly
        Pose::axis_along_z(4.5)?.rotated_x(0.25 * PI)?,
    )?;

    let mut scene = Scene::default().with_mode(Mode::Gated { gates: 4 });
    scene.cycle.beats_per_minute = 70.0;
    scene.cycle.curve = VolumeCurve::Sampled(vec![120.0, 80.0, 60.0, 90.0, 110.0]);
    scene.cycle.volume = VolumeRange::Gain(0.5);
    (scene.camera.views, scene.camera.bins, scene.camera.rows) = (30, 48, 48);
    scene.camera.pitch = [18.0 / 48.0; 2];
    scene.defects.push(Defect {
        layers: [0.0, 1.0],
        s: [0.1, 0.3],
        azimuths_degrees: [0.0, 90.0],
        activity: 0.2,
    });
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Heart,
    });
    scene.blur = Some(BlurSettings { fwhm: 0.8 });
    let counts = Counts::Total(1e6);
    scene.noise = Some(Noise { counts, seed: 1 });

    scene.acquisition.accuracy = Accuracy::Tolerance(1e-2); // of the largest sample; less than the noise

    let phantom = Phantom::with_heart(scene, heart)?;
    let numbers = phantom.numbers()?;
    println!("EDV {:.1} mL, ESV {:.1} mL", numbers.edv, numbers.esv);
    let slice = phantom.slice(2, 24)?; // of the third gate
    let most = slice.iter().copied().fold(0.0, f32::max);
    println!("largest activity of its middle slice: {most:.2}");
    Ok(())
}
