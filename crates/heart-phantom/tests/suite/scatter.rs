//! Scatter in the projections of a scene.

use heart_phantom::radon::ArcPolicy;
use heart_phantom::scene::{BlurSettings, OrganSettings, OrganShapeSettings, ScatterSettings};
use heart_phantom::{
    Attenuation, Background, Medium, Method, Mode, Noise, Orbit, Osem, Phantom, Product, Run,
    Scene, no_observer,
};

fn scene() -> Scene {
    let mut scene = Scene::default()
        .with_size(16)
        .with_mode(Mode::Static { phase: 0.0 });
    scene.camera.views = 4;
    scene.camera.arc = 360.0;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.camera.pitch = [1.6; 2];
    scene.camera.radius = Orbit::Circle(20.0);
    scene.blur = Some(BlurSettings { fwhm: 1.0 });
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [0.0; 2],
            semi_axes: [16.0, 11.0],
        },
    });
    scene.scatter = Some(ScatterSettings {
        tolerance: 0.03,
        ..ScatterSettings::default()
    });
    scene
}

const WINDOWS: [[f64; 2]; 2] = [[126.45, 154.55], [108.0, 126.45]];

fn two_windows() -> Scene {
    let mut scene = scene();
    scene.scatter.as_mut().unwrap().windows = WINDOWS.to_vec();
    scene
}

fn sum(samples: &[f32]) -> f64 {
    samples.iter().map(|sample| f64::from(*sample)).sum()
}

/// The scattered photons of a gate in a window.
fn scattered(phantom: &Phantom, window: usize) -> Vec<f32> {
    let scatter = phantom.scatter(0).unwrap().unwrap();
    let views = 0..phantom.camera().n_views();
    let samples = views.flat_map(|view| scatter.view(window, view));
    samples.map(|sample| sample as f32).collect()
}

#[test]
fn scatter_is_added_to_the_primary_photons_with_its_error() {
    let phantom = Phantom::new(scene()).unwrap();
    let alone = Phantom::new(Scene {
        scatter: None,
        ..scene()
    })
    .unwrap();
    let (with, without) = (
        phantom.sinograms(0, &no_observer).unwrap(),
        alone.sinograms(0, &no_observer).unwrap(),
    );
    let scatter = scattered(&phantom, 0);
    for ((with, without), scatter) in with.samples.iter().zip(&without.samples).zip(&scatter) {
        assert_eq!(*with, without + scatter);
    }
    let largest = |samples: &[f32]| samples.iter().fold(0.0f32, |a, b| a.max(*b));
    let made = phantom.scatter(0).unwrap().unwrap();
    let report = made.report();
    let most = 0.03 * f64::from(largest(&without.samples));
    assert!(report.largest_standard_error <= most * 1.000_001);
    let stated = with.view_error.scatter * f64::from(largest(&with.samples));
    let expected = 4.0 * report.largest_standard_error + report.interpolation_error;
    assert!((stated / expected - 1.0).abs() < 1e-12);
    assert!(with.view_error.total() > with.view_error.scatter && without.view_error.scatter == 0.0);
    // Near 0.3 to 0.7 in the middle of 32 x 22 cm of water.
    let ratio = sum(&scatter) / sum(&without.samples);
    assert!((0.3..0.8).contains(&ratio), "{ratio}");
    assert!(alone.scatter(0).unwrap().is_none());
}

#[test]
fn each_window_has_its_primary_photons_and_its_scatter() {
    let phantom = Phantom::new(two_windows()).unwrap();
    let windows = phantom.windows(0, &no_observer).unwrap();
    let alone = Phantom::new(Scene {
        scatter: None,
        ..scene()
    })
    .unwrap();
    let primary = alone.sinograms(0, &no_observer).unwrap();
    assert!(windows[0].samples == phantom.sinograms(0, &no_observer).unwrap().samples);
    // Photons of 140.5 keV, with a standard deviation of 5.97 keV, in each window, from tables of the normal distribution.
    for (window, efficiency) in [(0, 1.0), (1, 0.009_440_77)] {
        let scatter = scattered(&phantom, window);
        let all = windows[window].samples.iter();
        for ((all, primary), scatter) in all.zip(&primary.samples).zip(&scatter) {
            let exact = efficiency * f64::from(*primary) + f64::from(*scatter);
            assert!((f64::from(*all) - exact).abs() <= 2e-5 * f64::from(*primary) + 1e-6 * exact);
        }
    }
    let ratio = sum(&windows[1].samples) / sum(&windows[0].samples);
    assert!((0.15..0.5).contains(&ratio), "{ratio}");
}

#[test]
fn windows_of_a_gate_have_independent_noise() {
    let gated = two_windows().with_mode(Mode::Gated { gates: 2 });
    let noise = |counts, seed| {
        let mut scene = gated.clone();
        scene.noise = Some(Noise { counts, seed });
        Phantom::new(scene)
            .unwrap()
            .windows(1, &no_observer)
            .unwrap()
    };
    let exact = Phantom::new(gated.clone()).unwrap();
    let exact = exact.windows(1, &no_observer).unwrap();
    let noisy = noise(heart_phantom::Counts::PerUnit(1e5), 1);
    let score = |window: usize, k: usize| {
        let exact = f64::from(exact[window].samples[k]);
        (f64::from(noisy[window].samples[k]) - exact) / (exact / 1e5).sqrt()
    };
    // Bins with more than 100 counts in both windows.
    let bins: Vec<usize> = (0..exact[0].samples.len())
        .filter(|&k| exact[0].samples[k].min(exact[1].samples[k]) > 1e-3)
        .collect();
    assert!(bins.len() > 500);
    let product = |a: usize, b: usize| {
        let products = bins.iter().map(|&k| score(a, k) * score(b, k));
        products.sum::<f64>() / bins.len() as f64
    };
    assert!((product(0, 0) - 1.0).abs() < 0.2 && (product(1, 1) - 1.0).abs() < 0.2);
    assert!(product(0, 1).abs() < 0.2);
}

#[test]
fn scatter_of_a_part_is_identical_to_that_of_the_whole() {
    let whole = Phantom::new(scene())
        .unwrap()
        .sinograms(0, &no_observer)
        .unwrap();
    let view = Phantom::new(scene()).unwrap().view(0, 2).unwrap();
    assert_eq!(view, whole.samples[2 * 256..3 * 256]);
}

#[test]
fn uniform_activity_has_the_same_scatter_with_and_without_a_heart() {
    // Background, wall and cavity of the same activity: the same source as a torso without a heart.
    let uniform = |radius: f64| {
        let mut scene = scene();
        scene.heart.inner.radius = 0.5 * radius;
        scene.heart.outer.radius = radius;
        scene.activity = [1.0; 2].into();
        scene.background = Some(Background {
            concentration: 1.0,
            centre: [0.0; 2],
            semi_axes: [16.0, 11.0],
        });
        let phantom = Phantom::new(scene).unwrap();
        sum(&scattered(&phantom, 0))
    };
    let [small, large] = [uniform(1.0), uniform(3.0)];
    assert!((small / large - 1.0).abs() < 0.01, "{small} {large}");
}

#[test]
fn a_medium_without_density_has_no_scatter() {
    let mut scene = scene();
    scene.attenuation.as_mut().unwrap().coefficient = 0.0;
    let phantom = Phantom::new(scene).unwrap();
    let made = phantom.scatter(0).unwrap().unwrap();
    assert_eq!(made.largest_error(), 0.0);
    assert!(scattered(&phantom, 0).iter().all(|sample| *sample == 0.0));
}

#[test]
fn scatter_needs_a_medium_and_a_photopeak() {
    let message = |change: fn(&mut Scene)| {
        let mut scene = scene();
        change(&mut scene);
        Phantom::new(scene).unwrap_err().to_string()
    };
    for (change, expected) in [
        (
            (|scene| scene.attenuation = None) as fn(&mut Scene),
            "scatter.tolerance",
        ),
        (
            |scene| scene.scatter.as_mut().unwrap().tolerance = 0.0,
            "scatter.tolerance",
        ),
        (
            |scene| scene.scatter.as_mut().unwrap().energy = f64::NAN,
            "scatter.energy",
        ),
        (
            |scene| scene.scatter.as_mut().unwrap().resolution = 2.0,
            "scatter.resolution",
        ),
        (
            |scene| scene.scatter.as_mut().unwrap().windows = vec![[60.0, 70.0]],
            "scatter.windows",
        ),
        (
            |scene| scene.scatter.as_mut().unwrap().windows = Vec::new(),
            "scatter.windows",
        ),
        (
            |scene| {
                scene.scatter = None;
                let osem = Osem {
                    scatter: true,
                    ..Osem::new(1, 1)
                };
                scene.reconstruction.method = Method::Osem(osem);
            },
            "reconstruction.method.osem.scatter",
        ),
        (
            |scene| {
                scene.scatter = None;
                scene.output.write = vec![Product::Scatter];
            },
            "output.write",
        ),
    ] {
        let message = message(change);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn an_orbit_of_too_many_nodes_is_rejected_before_any_view() {
    let mut scene = scene();
    scene.camera.views = 1000;
    scene.camera.radius = Orbit::Circle(200.0);
    scene.blur = None;
    scene.collimator = Some(heart_phantom::scene::CollimatorSettings {
        holes: heart_phantom::scene::HolesSettings::Widths {
            slope: 0.05,
            at_face: 0.1,
        },
        intrinsic_fwhm: 0.4,
    });
    let message = Phantom::new(scene)
        .unwrap()
        .prepare()
        .unwrap_err()
        .to_string();
    assert!(message.contains("scatter"), "{message}");
}

#[test]
fn osem_with_known_scatter_agrees_with_osem_without_scatter() {
    let volume = |scatter: bool, known: bool, mode| {
        let mut scene = scene();
        scene.acquisition.mode = mode;
        scene.camera.views = 16;
        scene.reconstruction.method = Method::Osem(Osem {
            attenuation: true,
            scatter: known,
            ..Osem::new(4, 8)
        });
        if !scatter {
            scene.scatter = None;
        }
        Phantom::new(scene).unwrap().volume(0).unwrap()
    };
    let mode = Mode::Static { phase: 0.0 };
    let (exact, known, ignored) = (
        volume(false, false, mode),
        volume(true, true, mode),
        volume(true, false, mode),
    );
    let off = |volume: &[f32]| {
        let squares = volume.iter().zip(&exact).map(|(a, b)| (a - b).powi(2));
        (squares.sum::<f32>() / exact.iter().map(|a| a * a).sum::<f32>()).sqrt()
    };
    assert!(
        off(&known) < 0.1 && off(&ignored) > 0.2,
        "{} {}",
        off(&known),
        off(&ignored)
    );
}

#[test]
fn a_run_writes_projections_and_scatter_of_each_window() {
    let mut scene = two_windows().with_mode(Mode::Gated { gates: 2 });
    scene.output.write = vec![Product::Projections, Product::Scatter];
    let phantom = Phantom::new(scene).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut run = Run::begin(&phantom, folder.path(), &[]).unwrap();
    for gate in 0..2 {
        run.gate(gate, &no_observer).unwrap();
    }
    let report = run
        .finish(&no_observer, |_| Ok::<_, heart_phantom::PhantomError>(()))
        .unwrap();
    let names = [
        "projections",
        "projections-window-2",
        "scatter",
        "scatter-window-2",
    ];
    for name in names {
        for gate in 0..2 {
            let name = format!("{name}-gate-{gate:02}.npy");
            assert!(report.files.contains(&name.clone().into()), "{name}");
            let bytes = std::fs::metadata(folder.path().join(&name)).unwrap().len();
            assert!(bytes > 4 * 4 * 256, "{name}");
        }
    }
    assert_eq!(report.files.len(), 9);
    assert!(
        report
            .gates
            .iter()
            .all(|gate| gate.view_error.unwrap().scatter > 0.0)
    );
}

#[test]
fn gates_computed_together_have_the_scatter_of_separate_gates() {
    let mut scene = scene().with_mode(Mode::Gated { gates: 2 });
    scene.blur = None;
    let phantom = Phantom::new(scene).unwrap();
    let together = phantom.sinograms_of_gates().unwrap();
    assert!(together[1024..] == phantom.sinograms(1, &no_observer).unwrap().samples);
}

#[test]
fn scatter_is_bitwise_independent_of_threads() {
    let views = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let windows = Phantom::new(two_windows())
                .unwrap()
                .windows(0, &no_observer);
            let samples = windows.unwrap().into_iter().map(|window| window.samples);
            samples.collect::<Vec<_>>()
        })
    };
    let one = views(1);
    assert!([2, 3].iter().all(|&threads| views(threads) == one));
}

#[test]
fn the_true_error_is_within_two_standard_errors() {
    let scatter = |tolerance, seed| {
        let mut scene = scene();
        scene.scatter = Some(ScatterSettings {
            tolerance,
            seed,
            ..ScatterSettings::default()
        });
        let phantom = Phantom::new(scene).unwrap();
        phantom.scatter(0).unwrap().unwrap().clone()
    };
    let exact = scatter(0.002, 1000);
    let (mut inside, mut all) = (0, 0);
    for seed in 0..4 {
        let rough = scatter(0.1, seed);
        let ratio = exact.report().histories / rough.report().histories;
        assert!(ratio >= 100, "{ratio}");
        for view in 0..4 {
            let samples = rough.view(0, view).into_iter().zip(exact.view(0, view));
            for ((sample, exact), error) in samples.zip(rough.standard_error(0, view)) {
                inside += usize::from((sample - exact).abs() <= 2.0 * error);
                all += 1;
            }
        }
    }
    assert!(inside * 100 >= all * 95, "{inside} of {all}");
}

/// A torso, and an organ of the same shape and attenuation as the heart that it surrounds, are the same medium.
#[test]
fn an_organ_around_the_heart_scatters_as_a_torso() {
    let views = |organ: bool| {
        let mut scene = scene();
        if organ {
            let attenuation = scene.attenuation.as_mut().unwrap();
            attenuation.medium = Medium::Heart;
            scene.organs = vec![OrganSettings {
                shape: OrganShapeSettings::Cylinder {
                    centre: [0.0; 2],
                    semi_axes: [16.0, 11.0],
                },
                activity: 0.0,
                attenuation: attenuation.coefficient,
            }];
        }
        scattered(&Phantom::new(scene).unwrap(), 0)
    };
    let [torso, organ] = [views(false), views(true)];
    let most = torso.iter().fold(0.0f32, |a, b| a.max(*b));
    let off = torso.iter().zip(&organ).map(|(a, b)| (a - b).abs());
    let off = off.fold(0.0f32, f32::max);
    // The same photon histories, up to the rounding of lengths that the surface of the heart divides.
    assert!(most > 0.0 && off < 1e-4 * most, "{off:e} {most}");
}

/// A cylinder, in which photons are drawn with a density that decreases beyond the rows, scatters as a very long ellipsoid in it, in which they are
/// drawn uniformly.
#[test]
fn a_cylinder_scatters_as_a_long_ellipsoid() {
    let total = |is_long: bool| {
        let mut scene = scene();
        (scene.camera.rows, scene.camera.views) = (2, 2);
        scene.activity = [0.0; 2].into();
        scene.scatter.as_mut().unwrap().tolerance = 0.05;
        scene.attenuation.as_mut().unwrap().medium = Medium::Heart;
        let organ = |shape, activity| OrganSettings {
            shape,
            activity,
            attenuation: 0.15,
        };
        let cylinder = OrganShapeSettings::Cylinder {
            centre: [0.0; 2],
            semi_axes: [16.0, 11.0],
        };
        let ellipsoid = OrganShapeSettings::Ellipsoid {
            centre: [0.0; 3],
            semi_axes: [16.0, 11.0, 120.0],
        };
        scene.organs = match is_long {
            false => vec![organ(cylinder, 1.0)],
            true => vec![organ(cylinder, 0.0), organ(ellipsoid, 1.0)],
        };
        sum(&scattered(&Phantom::new(scene).unwrap(), 0))
    };
    let [cylinder, ellipsoid] = [false, true].map(total);
    // A standard error of about one per cent; the ellipsoid is narrower by 1 % at 30 cm.
    assert!(
        (cylinder / ellipsoid - 1.0).abs() < 0.04,
        "{cylinder} {ellipsoid}"
    );
}

#[test]
fn nothing_active_has_no_scatter() {
    let mut scene = scene();
    scene.activity = [0.0; 2].into();
    let phantom = Phantom::new(scene).unwrap();
    assert!(phantom.scatter(0).unwrap().is_none());
}
