//! An upper bound for motion-compensated reconstruction: sixteen gates by OSEM with the exact motion, compared with a static heart and an ungated one
//! at equal counts. `cargo run --release -p heart-phantom --example one_frame -- [VOXELS]`.

use heart_phantom::scene::{CollimatorSettings, HolesSettings};
use heart_phantom::{
    Accuracy, Attenuation, Compensation, Counts, Medium, Method, Mode, Noise, Osem, Scene,
};
use heart_phantom::{Phantom, PhantomError, no_observer};

/// Counts of a sample of 1 in all gates together.
const COUNTS: f64 = 4000.0;

/// Views through a collimator and a torso.
fn scene(n: usize, mode: Mode, compensation: Compensation) -> Scene {
    let mut scene = Scene::default().with_size(n).with_mode(mode);
    (scene.camera.views, scene.camera.arc) = (64, 360.0);
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [1.0, 0.0],
            semi_axes: [14.0, 10.0],
        },
    });
    scene.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    });
    scene.acquisition.accuracy = Accuracy::Steps(64);
    scene.reconstruction.method = Method::Osem(Osem {
        attenuation: true,
        resolution: true,
        ..Osem::new(8, 6)
    });
    scene.reconstruction.compensation = compensation;
    scene
}

/// The volume of all views, with or without noise.
fn volume(
    scene: &Scene,
    per_unit: Option<(f64, u64)>,
) -> Result<(Phantom, Vec<f32>), PhantomError> {
    let mut scene = scene.clone();
    scene.noise = per_unit.map(|(mean, seed)| Noise {
        counts: Counts::PerUnit(mean),
        seed,
    });
    let phantom = Phantom::new(scene)?;
    let volume = match phantom.scene().reconstruction.compensation {
        Compensation::KnownMotion => {
            phantom
                .compensated(0, &phantom.sinograms_of_gates()?, &no_observer)?
                .0
        }
        _ => phantom.volume(0)?,
    };
    Ok((phantom, volume))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n = std::env::args().nth(1).map_or(Ok(128), |n| n.parse())?;
    let gates = 16;
    let known = Compensation::KnownMotion;
    let kinds = [
        (
            "static, end-diastole",
            scene(n, Mode::Static { phase: 0.5 }, known),
            COUNTS,
        ),
        (
            "not gated",
            scene(n, Mode::WholeCycle, Compensation::None),
            COUNTS,
        ),
        (
            "16 gates compensated",
            scene(n, Mode::Gated { gates }, known),
            COUNTS / gates as f64,
        ),
        (
            "one gate of the 16",
            scene(n, Mode::Gated { gates }, Compensation::None),
            COUNTS / gates as f64,
        ),
    ];
    println!(
        "{:24} wall blur mm   rmse   wall mean   noise of the wall, of its mean",
        ""
    );
    for (name, scene, counts) in kinds {
        let start = std::time::Instant::now();
        let (phantom, exact) = volume(&scene, None)?;
        let seconds = start.elapsed().as_secs_f64();
        let still = Phantom::new(self::scene(n, Mode::Static { phase: 0.5 }, known))?;
        let truth = still.compensated_truth(0)?;
        let judged = still.compensated_artefacts(0, &exact, &truth)?;
        // From two realisations, in the wall at end-diastole.
        let [(_, a), (_, b)] = [
            volume(&scene, Some((counts, 1)))?,
            volume(&scene, Some((counts, 2)))?,
        ];
        let wall = still.regions_of(0)?.wall;
        let (mut square, mut sum, n) = (0.0, 0.0, wall.count() as f64);
        for ((a, b), _) in a
            .iter()
            .zip(&b)
            .zip(wall.as_slice())
            .filter(|(_, inside)| **inside)
        {
            square += f64::from(a - b).powi(2);
            sum += f64::from(a + b);
        }
        let noise = (2.0 * square / n).sqrt() / (sum / n);
        let number = |x: Option<f64>| x.map_or_else(|| "-".into(), |x| format!("{x:.3}"));
        println!(
            "{name:24} {:>12} {:>6} {:>11} {noise:>8.4}   ({} iterations over all gates: {seconds:.1} s)",
            number(judged.wall_blur_mm),
            number(judged.rmse),
            number(judged.wall_mean),
            phantom.work().osem_iterations,
        );
    }
    Ok(())
}
