//! Projections: bin averages, time averages, depth response, truncation.

mod definition;

use crate::Row;
use heart_phantom::scene::{
    BlurSettings, CollimatorSettings, DiscretisationSettings, HolesSettings,
};
use heart_phantom::{
    Accuracy, Attenuation, Background, BinSample, Chest, Medium, Mode, Orbit, Scene,
    radon::ArcPolicy,
};
use heart_phantom::{Defect, Phantom, Twist, no_observer};
use tests::Random;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "heart_phantom::ViewError::total",
        what: "sample of a view; the smaller of stated error and prescribed tolerance",
        reference: "bin averages of Gaussians in closed form, slab by slab, on a dense lattice of rays",
        norm: "maximum over the samples, relative to the largest",
        quick: 3,
        problem: |random| sample(random, BinSample::Averages),
    },
    Row {
        name: "heart_phantom::ViewError::total (centres)",
        what: "sample at the centre of a bin of 0.75 to 2 cm; the smaller of stated error and prescribed tolerance",
        reference: "Gaussians at the centres of bins, slab by slab, on a dense lattice of rays",
        norm: "maximum over the samples, relative to the largest",
        quick: 2,
        problem: |random| sample(random, BinSample::Centres),
    },
];

/// Ratios above this are computed again, with a reference that resolves the stated error.
const NEAR: f64 = 0.5;

fn sample(random: &mut Random, samples: BinSample) -> Option<f64> {
    let tolerance = random.decades(-2.7, -1.5);
    let phantom = Phantom::new(scene(random, tolerance, samples)).ok()?;
    let view_idx = random.integer(0, 1);
    let made = phantom.sinograms(0, &no_observer).ok()?;
    let largest = made.samples.iter().fold(0.0f32, |most, v| most.max(*v));
    let stated = made.view_error.total().min(tolerance);
    let ratio = |resolved: f64| {
        let exact = definition::view(&phantom, view_idx, resolved)?;
        let own = &made.samples[view_idx * exact.len()..];
        let off = (own.iter().zip(&exact)).fold(0.0f64, |most, (sample, exact)| {
            most.max((f64::from(*sample) - exact).abs())
        });
        (largest > 0.0).then(|| off / f64::from(largest) / stated)
    };
    match ratio(tolerance)? {
        near if near > NEAR => ratio(stated),
        far => Some(far),
    }
}

/// A small clinical camera before a heart of any size; half as many bins of larger pitch, and a response, for samples at their centres.
fn scene(random: &mut Random, tolerance: f64, samples: BinSample) -> Scene {
    let mut scene = Scene::default();
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 61 };
    let size = random.decades(-1.0, 0.0);
    for balloon in [&mut scene.heart.inner, &mut scene.heart.outer] {
        balloon.length *= size;
        balloon.radius *= size;
    }
    // Not from a grid: the rays of the reference resolve an edge parallel to their rows to first order only.
    scene.pose.rotate_x = random.any(-180.0, 180.0);
    scene.pose.rotate_y = random.any(-180.0, 180.0);
    scene.pose.shift = [0; 3].map(|_| random.uniform(-1.0, 1.0));
    if random.one_in(3) {
        add_defect(random, &mut scene);
    }
    let camera = &mut scene.camera;
    (camera.views, camera.bins, camera.rows) = (2, 14, 12);
    camera.start = random.any(-90.0, 90.0);
    camera.pitch = [0; 2].map(|_| random.uniform(0.3, 0.8));
    camera.samples = Some(samples);
    let mut least_fwhm = 0.3;
    if samples == BinSample::Centres {
        (camera.bins, camera.rows) = (7, 6);
        camera.pitch = camera.pitch.map(|pitch| 2.5 * pitch);
        least_fwhm = 0.15;
    }
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
    match random.integer(usize::from(samples == BinSample::Centres), 3) {
        0 => {}
        1 => {
            let fwhm = random.uniform(least_fwhm, 1.5);
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

/// A cold defect or one more active than the wall, in a wall that may be twisted.
fn add_defect(random: &mut Random, scene: &mut Scene) {
    let [layer, s, azimuth] = [0.6, 0.4, 360.0].map(|most| random.any(0.0, most));
    scene.defects = vec![Defect {
        layers: [layer, random.any(layer + 0.2, 1.0)],
        s: [s, random.any(s + 0.05, 0.5)],
        azimuths_degrees: [azimuth, azimuth + random.any(20.0, 340.0)],
        activity: random.pick(&[0.0, 0.3, 2.0, 8.0]),
    }];
    if random.one_in(3) {
        let [inner, outer] = [0; 2].map(|_| random.any(-20.0, 20.0));
        scene.twist = Some(Twist {
            inner_degrees: vec![0.0, inner],
            outer_degrees: vec![0.0, outer],
        });
    }
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
