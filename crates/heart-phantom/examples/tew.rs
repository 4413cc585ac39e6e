//! The triple-energy-window estimate of scatter, compared with the exact scatter of a chest.
//!
//! `cargo run --release -p heart-phantom --example tew`

use heart_phantom::scene::{BlurSettings, ScatterSettings};
use heart_phantom::{BinSample, Chest, Mode, Phantom, Scene, no_observer};

/// The photopeak window, and one of 3 keV on either side of it.
const WINDOWS: [[f64; 2]; 3] = [[126.45, 154.55], [123.45, 126.45], [154.55, 157.55]];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut scene = Scene::default()
        .with_size(32)
        .with_mode(Mode::Static { phase: 0.0 });
    scene.camera.views = 4;
    scene.camera.arc = 180.0;
    scene.camera.pitch = [1.28; 2];
    scene.camera.samples = Some(BinSample::Centres);
    scene.blur = Some(BlurSettings { fwhm: 1.0 });
    scene.chest = Some(Chest::default());
    scene.scatter = Some(ScatterSettings {
        tolerance: 0.03,
        windows: WINDOWS.to_vec(),
        ..ScatterSettings::default()
    });
    let phantom = Phantom::new(scene)?;
    let windows = phantom.windows(0, &no_observer)?;
    let Some(scatter) = phantom.scatter(0)? else {
        return Err("no activity".into());
    };
    // The trapezium between the count densities of the two narrow windows (Ogawa et al., IEEE Trans. Med. Imaging 10 (1991) 408).
    let [wide, low, high] = WINDOWS.map(|[from, to]| to - from);
    let len = phantom.camera().view_len();
    println!("scatter fraction of the photopeak window");
    for (view, time) in phantom.view_times(0)?.iter().enumerate() {
        let sum = |window: usize| -> f64 {
            let samples = &windows[window].samples[view * len..][..len];
            samples.iter().map(|sample| f64::from(*sample)).sum()
        };
        let estimate = 0.5 * wide * (sum(1) / low + sum(2) / high);
        let exact: f64 = scatter.view(0, view).iter().sum();
        let angle = time.angle.to_degrees();
        println!(
            "view at {angle:5.1} degrees: exact {:.3}, estimated {:.3}",
            exact / sum(0),
            estimate / sum(0)
        );
    }
    Ok(())
}
