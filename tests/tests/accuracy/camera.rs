//! Projections: bin averages, time averages, depth response, truncation.

use crate::Row;
use heart_phantom::Phantom;
use heart_phantom::scene::{
    Accuracy, ArcPolicy, Attenuation, Background, BinSample, BlurSettings, Chest,
    CollimatorSettings, DiscretisationSettings, HolesSettings, Medium, Mode, Orbit, Scene,
};
use tests::Random;

pub(crate) const ROWS: &[Row] = &[Row {
    name: "heart_phantom::ViewError::total",
    what: "sample of a view, against the smaller of the stated error and the tolerance asked for",
    reference: "bins 3 times as fine, at an eighth of the tolerance, averaged",
    norm: "maximum over the samples, relative to the largest",
    quick: 3,
    problem: sample,
}];

/// Bins and rows along a bin of the reference.
const FINER: usize = 3;

fn sample(random: &mut Random) -> Option<f64> {
    let tolerance = random.decades(-2.7, -1.5);
    let scene = scene(random, tolerance);
    let made = Phantom::new(scene.clone())
        .ok()?
        .sinograms(0, &|_| ())
        .ok()?;
    let exact = reference(scene, 0.125 * tolerance)?;
    let (mut off, mut largest) = (0.0f64, 0.0f64);
    for (sample, exact) in made.samples.iter().zip(&exact) {
        off = off.max((f64::from(*sample) - exact).abs());
        largest = largest.max(exact.abs());
    }
    (largest > 0.0).then(|| off / largest / made.view_error.total().min(tolerance))
}

/// A small clinical camera before a heart of any size.
fn scene(random: &mut Random, tolerance: f64) -> Scene {
    let mut scene = Scene::default();
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 61 };
    let size = random.decades(-1.0, 0.0);
    for balloon in [&mut scene.heart.inner, &mut scene.heart.outer] {
        balloon.length *= size;
        balloon.radius *= size;
    }
    scene.pose.turn_x = random.uniform(-180.0, 180.0);
    scene.pose.turn_y = random.uniform(-180.0, 180.0);
    scene.pose.shift = [0; 3].map(|_| random.uniform(-1.0, 1.0));
    let camera = &mut scene.camera;
    (camera.views, camera.bins, camera.rows) = (2, 14, 12);
    camera.start = random.uniform(-90.0, 90.0);
    camera.pitch = [0; 2].map(|_| random.uniform(0.3, 0.8));
    camera.samples = Some(BinSample::Averages);
    scene.reconstruction.arc = ArcPolicy::Extend;
    // The collimator's face clears the body.
    let (mut least, torso) = (8.0, [9.0, 7.0]);
    match random.integer(0, 4) {
        0 => {
            scene.background = Some(Background {
                concentration: 0.1,
                centre: [0.0; 2],
                semi_axes: torso,
            });
            (scene.attenuation, least) = (attenuation(torso), 10.0);
        }
        1 => {
            (scene.chest, least) = (Some(Chest::default()), 20.0);
        }
        2 => scene.attenuation = attenuation(torso),
        _ => {}
    }
    let radius = random.uniform(least, 25.0);
    scene.camera.radius = Orbit::Circle(radius);
    match random.integer(0, 3) {
        0 => {}
        1 => {
            let fwhm = random.uniform(0.3, 1.5);
            scene.blur = Some(BlurSettings { fwhm });
        }
        _ => {
            let holes = [
                HolesSettings::GeLehr,
                HolesSettings::GeLegp,
                HolesSettings::SiemensLehr,
            ];
            scene.collimator = Some(CollimatorSettings {
                holes: random.pick(&holes),
                intrinsic_fwhm: random.uniform(0.3, 0.5),
            });
        }
    }
    scene.acquisition.mode = match random.integer(0, 3) {
        0 => Mode::WholeCycle,
        1 => Mode::Gated { gates: 8 },
        _ => Mode::Static {
            phase: random.uniform(0.0, 1.0),
        },
    };
    scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
    scene
}

fn attenuation(semi_axes: [f64; 2]) -> Option<Attenuation> {
    Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [0.0; 2],
            semi_axes,
        },
    })
}

/// The samples from finer bins. Nothing in them is done at the pitch of the bins.
fn reference(mut scene: Scene, tolerance: f64) -> Option<Vec<f64>> {
    let bins = scene.camera.bins;
    scene.camera.bins *= FINER;
    scene.camera.rows *= FINER;
    scene.camera.pitch = scene.camera.pitch.map(|pitch| pitch / FINER as f64);
    scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
    let fine = Phantom::new(scene)
        .ok()?
        .sinograms(0, &|_| ())
        .ok()?
        .samples;
    let of = |k: usize| -> f64 {
        let (line, bin) = (k / bins * FINER, k % bins * FINER);
        let lines = (line..line + FINER).map(|line| line * bins * FINER + bin);
        let samples = lines.flat_map(|from| &fine[from..from + FINER]);
        samples.map(|v| f64::from(*v)).sum::<f64>() / (FINER * FINER) as f64
    };
    Some((0..fine.len() / (FINER * FINER)).map(of).collect())
}
