//! Volumes by OSEM: accuracy, cost and errors.

use heart_phantom::scene::{
    CollimatorSettings, DiscretisationSettings, HeadsSettings, HolesSettings, OrganSettings,
    OrganShapeSettings, PixelRange,
};
use heart_phantom::{Accuracy, Method, Osem, Phantom, PhantomError, Uptake, no_observer, run};
use heart_phantom::{Attenuation, Background, Compensation, Medium, Mode, Orbit, Scene};
use std::sync::Mutex;

/// Projections of the heart in the reference configuration within a torso through a collimator, bins of half a centimetre.
fn scene() -> Scene {
    let mut scene = Scene::default().with_mode(Mode::Static { phase: 0.0 });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 201 };
    scene.camera.views = 32;
    scene.camera.arc = 360.0;
    (scene.camera.bins, scene.camera.rows) = (32, 30);
    scene.camera.pitch = [0.5; 2];
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
    scene
}

fn by(osem: Osem) -> Scene {
    let mut scene = scene();
    scene.reconstruction.method = Method::Osem(osem);
    scene
}

/// Models all effects of the scene.
fn whole(subsets: usize, iterations: usize) -> Osem {
    Osem {
        attenuation: true,
        resolution: true,
        ..Osem::new(subsets, iterations)
    }
}

fn sum(samples: &[f32]) -> f64 {
    samples.iter().map(|&x| f64::from(x)).sum()
}

/// Ratio of the sum of a phantom's volume to that of the ground truth, and the recovery of the wall.
fn found(scene: Scene) -> (f64, Option<f64>) {
    let phantom = Phantom::new(scene).unwrap();
    let (volume, truth) = (phantom.volume(0).unwrap(), phantom.truth(0).unwrap());
    let artefacts = phantom.artefacts(0, &volume, &truth).unwrap();
    let recovery = (artefacts.wall_mean.zip(artefacts.wall_mean_truth)).map(|(of, all)| of / all);
    (sum(&volume) / sum(&truth), recovery)
}

#[test]
fn the_wall_has_its_activity() {
    // The torso extends far beyond the views, and so does the attenuation map of the model.
    let (all, wall) = found(by(whole(8, 4)));
    println!("OSEM: {all} of all, wall {wall:?}");
    let (by_lines, wall_by_lines) = found(by(Osem::new(8, 4)));
    println!("without a model: {by_lines} of all, wall {wall_by_lines:?}");
    let (by_fbp, wall_by_fbp) = found(scene());
    println!("FBP: {by_fbp} of all, wall {wall_by_fbp:?}");
    // Samples at the centres of bins that are half as wide as the wall.
    assert!((all - 1.0).abs() < 0.01, "{all}");
    // A wall as thin as the resolution is too low at first and overshoots later.
    assert!((wall.unwrap() - 1.0).abs() < 0.1, "{wall:?}");
    assert!(wall_by_lines.unwrap() < 0.25 && wall_by_fbp.unwrap() < 0.25);
    assert!(by_lines < 0.25 && by_fbp < 0.25);
}

/// Two heads on the contour of the torso, with a radius for each view.
#[test]
fn an_orbit_near_the_body_is_modelled() {
    let mut near = by(whole(8, 4));
    (near.camera.views, near.camera.arc) = (16, 180.0);
    near.camera.heads = HeadsSettings::Two { angle: 180.0 };
    near.camera.radius = Orbit::Contour { gap: 1.0 };
    let radii = Phantom::new(near.clone()).unwrap().radii().unwrap();
    let [least, most] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|f| radii.iter().copied().reduce(f));
    assert!(least.unwrap() < 11.1 && most.unwrap() > 15.0, "{radii:?}");
    let (all, wall) = found(near);
    println!("contour: {all} of all, wall {wall:?}");
    assert!((all - 1.0).abs() < 0.005, "{all}");
    // The resolution improves as the camera approaches, and the overshoot of a thin wall increases.
    assert!((wall.unwrap() - 1.0).abs() < 0.2, "{wall:?}");
}

/// Filters a volume `[z][y][x]` of cubes by a Gaussian with this standard deviation in voxels, by direct sums along each axis.
fn filtered(volume: &[f32], shape: [usize; 3], sigma: f64) -> Vec<f64> {
    let reach = (5.0 * sigma).ceil() as i64;
    let weight = |k: i64| (-0.5 * (k as f64 / sigma).powi(2)).exp();
    let all: f64 = (-reach..=reach).map(weight).sum();
    let mut values: Vec<f64> = volume.iter().map(|&x| f64::from(x)).collect();
    let mut stride = 1;
    for n in shape {
        let before = values.clone();
        for (k, value) in values.iter_mut().enumerate() {
            let at = (k / stride % n) as i64;
            let near = (-reach..=reach).filter(|step| (0..n as i64).contains(&(at + step)));
            let of = |step: i64| before[(k as i64 + step * stride as i64) as usize];
            *value = near.map(|step| weight(step) / all * of(step)).sum();
        }
        stride *= n;
    }
    values
}

#[test]
fn the_wall_activity_is_accurate_to_a_hundredth_at_the_resolution_of_the_camera() {
    let mut scene = by(whole(8, 12));
    (scene.camera.bins, scene.camera.rows) = (56, 50);
    scene.camera.pitch = [0.3; 2];
    let on_axis = 1.2; // cm: full width at half maximum of the camera at its axis
    let measured = |scene: Scene| {
        let phantom = Phantom::new(scene).unwrap();
        let (volume, truth) = (phantom.volume(0).unwrap(), phantom.truth(0).unwrap());
        let shape = phantom.camera().grid().shape();
        let sigma = on_axis / (8.0 * 2f64.ln()).sqrt() / 0.3;
        let [seen, held] = [&volume, &truth].map(|volume| filtered(volume, shape, sigma));
        let within = |values: &[f64], least: f32| -> f64 {
            let wall = values.iter().zip(&truth).filter(|(_, t)| **t > least);
            wall.map(|(value, _)| value).sum()
        };
        [0.5, 0.999].map(|least| within(&seen, least) / within(&held, least))
    };
    let [wall, inner] = measured(scene.clone());
    println!("wall {wall}, voxels that it fills {inner}");
    scene.reconstruction.method = Method::Fbp;
    let [by_fbp, _] = measured(scene);
    println!("by FBP {by_fbp}");
    // After 96 steps the error at the resolution of the camera is half a hundredth. Samples are at the centres of bins (their error is
    // 0.8 % of the wall with 0.35 cm, 0.2 % with 0.25 cm). Finer structure is not determined by the data.
    assert!((wall - 1.0).abs() < 0.01 && (inner - 1.0).abs() < 0.015);
    assert!(by_fbp < 0.25);
}

/// By either method, with anisotropic voxels; also motion-compensated volumes and single slices are filtered.
#[test]
fn volumes_are_filtered_by_a_gaussian() {
    let mut osem = by(Osem::new(4, 2));
    osem.camera.views = 12;
    let mut fbp = osem.clone();
    fbp.reconstruction.method = Method::Fbp;
    let mut compensated = osem.clone().with_mode(Mode::Gated { gates: 2 });
    compensated.acquisition.accuracy = Accuracy::Steps(4);
    compensated.reconstruction.compensation = Compensation::KnownMotion;
    for mut scene in [osem, fbp, compensated] {
        let plain = Phantom::new(scene.clone()).unwrap();
        scene.reconstruction.filter_fwhm = Some(1.6);
        let phantom = Phantom::new(scene).unwrap();
        let shape = phantom.camera().grid().shape();
        let sigma = 1.6 / (8.0 * 2f64.ln()).sqrt() / 0.5;
        let expected = filtered(&plain.volume(0).unwrap(), shape, sigma);
        let volume = phantom.volume(0).unwrap();
        let most = expected.iter().copied().fold(0.0, f64::max);
        for (a, b) in volume.iter().zip(&expected) {
            // Sampled Gaussians differ by 2e-5 from those of exact variance.
            assert!((f64::from(*a) - b).abs() < 1e-4 * most, "{a} {b}");
        }
        let n = shape[0] * shape[1];
        assert_eq!(phantom.slice(0, 9).unwrap(), volume[9 * n..10 * n]);
    }
}

#[test]
fn a_uniform_body_is_uniform() {
    let mut scene = by(whole(8, 6));
    scene.activity.cavity = Uptake::Concentration(1.0);
    let medium = scene.attenuation.unwrap().medium;
    let Medium::Torso { centre, semi_axes } = medium else {
        panic!()
    };
    // The model contains all activity; otherwise activity outside the volume would be attributed to it. Higher than all rows.
    (scene.camera.bins, scene.camera.rows) = (64, 12);
    scene.background = Some(Background {
        concentration: 1.0,
        centre,
        semi_axes,
    });
    let phantom = Phantom::new(scene).unwrap();
    let volume = phantom.volume(0).unwrap();
    let (grid, inner) = (phantom.camera().grid(), 0.8);
    let mut inside = Vec::new();
    for (k, x) in volume.iter().enumerate() {
        let p = grid.centre(k % 64, k / 64 % 64, k / (64 * 64));
        let [x_of, y_of] = [(p.x - centre[0]) / semi_axes[0], p.y / semi_axes[1]];
        if x_of.hypot(y_of) < inner {
            inside.push(*x);
        }
    }
    let mean = sum(&inside) / inside.len() as f64;
    let off = inside.iter().map(|x| (f64::from(*x) - mean).abs());
    let off = off.sum::<f64>() / inside.len() as f64;
    println!("{mean} +- {off}");
    // Deep in a torso of four mean free paths, after 48 steps.
    assert!((mean - 1.0).abs() < 0.01 && off < 0.05, "{mean} {off}");
}

#[test]
fn a_gated_study_has_its_ejection_fraction() {
    let mut scene = by(whole(8, 4)).with_mode(Mode::Gated { gates: 4 });
    // With active blood a sum is a volume.
    scene.activity.cavity = Uptake::Concentration(1.0);
    scene.activity.wall = Uptake::Concentration(0.0);
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.truth.tolerance = 0.01;
    let phantom = Phantom::new(scene).unwrap();
    let ejection = |volume: &dyn Fn(usize) -> Vec<f32>| {
        let sums = [0, 1, 2, 3].map(|gate| sum(&volume(gate)));
        let most = sums.iter().fold(0.0f64, |a, &b| a.max(b));
        1.0 - sums.iter().fold(most, |a, &b| a.min(b)) / most
    };
    let found = ejection(&|gate| phantom.volume(gate).unwrap());
    let truth = ejection(&|gate| phantom.truth(gate).unwrap());
    println!("{found} of {truth}");
    assert!((found - truth).abs() < 0.005, "{found} {truth}");
    assert!(truth > 0.2);
}

#[test]
fn an_attenuating_beating_heart_has_its_activity() {
    let osem = Osem {
        attenuation: true,
        ..Osem::new(8, 4)
    };
    let mut scene = by(osem).with_mode(Mode::WholeCycle);
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.collimator = None;
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Heart,
    });
    let (all, _) = found(scene.clone());
    scene.reconstruction.method = Method::Osem(Osem::new(8, 4));
    let (without, _) = found(scene);
    println!("{all} {without}");
    // The map is averaged over the motion.
    assert!((all - 1.0).abs() < 0.01, "{all}");
    assert!(without < 0.85, "{without}");
}

#[test]
fn organs_attenuate_and_emit_in_the_model_too() {
    let mut scene = by(whole(8, 4));
    let centre = [1.0, 0.0];
    let body = OrganShapeSettings::Cylinder {
        centre,
        semi_axes: [14.0, 10.0],
    };
    let lung = OrganShapeSettings::Ellipsoid {
        centre: [-8.0, 0.0, 0.0],
        semi_axes: [4.0, 6.0, 10.0],
    };
    for (shape, attenuation) in [(body, 0.15), (lung, 0.05)] {
        scene.organs.push(OrganSettings {
            shape,
            activity: 0.0,
            attenuation,
        });
    }
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Heart,
    });
    let (all, wall) = found(scene.clone());
    println!("{all} of all, wall {wall:?}");
    assert!((all - 1.0).abs() < 0.01, "{all}");
    // Activity beyond the ends of the views is part of the model and not attributed to the heart.
    scene.organs[0].activity = 0.2;
    let phantom = Phantom::new(scene).unwrap();
    let volume = phantom.volume(0).unwrap();
    let truth = phantom.truth(0).unwrap();
    let all = sum(&volume) / sum(&truth);
    println!("{all} of all with a warm body");
    assert!((all - 1.0).abs() < 0.03, "{all}");
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    let mut small = by(whole(3, 2));
    small.camera.views = 10; // subsets of four, three and three
    let phantom = Phantom::new(small).unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap().samples;
    let volume = |threads| {
        let pool = rayon::ThreadPoolBuilder::new();
        let pool = pool.num_threads(threads).build().unwrap();
        pool.install(|| phantom.reconstruct(0, &views).unwrap())
    };
    let one = volume(1);
    assert!(one.iter().any(|x| *x > 0.5));
    assert!(
        one.iter()
            .zip(volume(2))
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

#[test]
fn a_region_and_a_slice_equal_those_of_the_whole() {
    let mut scene = by(whole(4, 2));
    scene.camera.views = 12;
    let n = scene.camera.bins;
    let phantom = Phantom::new(scene.clone()).unwrap();
    let volume = phantom.volume(0).unwrap();
    assert_eq!(phantom.slice(0, 9).unwrap(), volume[9 * n * n..10 * n * n]);
    let ([x, y], [to_x, to_y]) = ([4, 10], [20, 29]);
    scene.reconstruction.region = Some(PixelRange {
        x: [x, to_x],
        y: [y, to_y],
    });
    let region = Phantom::new(scene.clone()).unwrap().volume(0).unwrap();
    let cut = |k: usize| {
        let (i, j, slice) = (k % 16, k / 16 % 19, k / (16 * 19));
        volume[(slice * n + y + j) * n + x + i]
    };
    assert!(region.iter().enumerate().all(|(k, &v)| v == cut(k)));
    assert_eq!(region.len(), 16 * 19 * scene.camera.rows);

    // Pixels of another size, some outside all views: zero there.
    scene.reconstruction.region = None;
    (scene.reconstruction.pixels, scene.reconstruction.pixel) = (Some(60), Some(0.7));
    scene.reconstruction.method = Method::Osem(Osem::new(4, 2));
    let wide = Phantom::new(scene).unwrap().volume(0).unwrap();
    assert!(wide[0] == 0.0 && wide.iter().any(|x| *x > 0.1));
}

#[test]
fn a_run_reports_its_iterations() {
    let mut scene = by(Osem {
        tolerance: Some(0.1),
        ..whole(4, 30)
    });
    scene.camera.views = 12;
    let phantom = Phantom::new(scene).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let told = Mutex::new(Vec::new());
    let report = run(&phantom, folder.path(), &|progress| {
        if progress.stage == "reconstruction" {
            told.lock().unwrap().push(progress.fraction);
        }
        no_observer(progress)
    })
    .unwrap();
    let osem = report.gates[0].osem.unwrap();
    assert!(
        (2..30).contains(&osem.iterations) && osem.change <= 0.1,
        "{osem:?}"
    );
    assert!(osem.residual < 0.5);
    assert_eq!(report.work.osem_iterations, osem.iterations);
    assert_eq!(report.work.slices_reconstructed, 0);
    // One call before the first iteration.
    let told = told.into_inner().unwrap();
    assert_eq!(told.len(), osem.iterations + 1);
    assert!(told.windows(2).all(|pair| pair[0] < pair[1]));
}

#[test]
fn scenes_without_a_valid_model_are_rejected() {
    // A torso whose model exceeds the memory.
    let mut vast = by(whole(4, 2));
    vast.attenuation = Some(Attenuation {
        coefficient: 1e-9,
        medium: Medium::Torso {
            centre: [0.0; 2],
            semi_axes: [1e5; 2],
        },
    });
    match Phantom::new(vast) {
        Err(PhantomError::Scene(error)) => assert_eq!(error.first().field, "reconstruction.method"),
        other => panic!("{other:?}"),
    }

    let phantom = Phantom::new(by(whole(4, 2))).unwrap();
    let mut views = vec![1.0f32; 32 * phantom.camera().view_len()];
    assert!(matches!(
        phantom.reconstruct(0, &views[1..]),
        Err(PhantomError::WrongLength { .. })
    ));
    views[7] = -1.0;
    assert!(matches!(
        phantom.reconstruct(0, &views),
        Err(PhantomError::Radon(_))
    ));
    // An arc too short for filtered back-projection.
    let mut short = by(Osem::new(2, 1));
    short.camera.arc = 90.0;
    Phantom::new(short).unwrap().prepare().unwrap();
}

/// A torso that does not attenuate, wider than the views, does not change the volume.
#[test]
fn a_torso_of_coefficient_zero_has_no_effect() {
    let volume = |attenuation: bool| {
        let mut scene = Scene::default()
            .with_size(20)
            .with_mode(Mode::Static { phase: 0.0 });
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 41 };
        scene.camera.views = 8;
        scene.attenuation = Some(Attenuation {
            coefficient: 0.0,
            medium: Medium::Torso {
                centre: [0.0; 2],
                semi_axes: [20.0, 14.0],
            },
        });
        scene.reconstruction.method = Method::Osem(Osem {
            attenuation,
            ..Osem::new(2, 3)
        });
        Phantom::new(scene).unwrap().volume(0).unwrap()
    };
    let (with, without) = (volume(true), volume(false));
    let most = without.iter().copied().fold(0.0f32, f32::max);
    for (a, b) in with.iter().zip(&without) {
        // Factors of exactly 1 in 32 bits, in another order of sums.
        assert!((a - b).abs() < 1e-5 * most, "{a} {b}");
    }
}
