//! Bin averages against closed forms, quadrature by the definition and finer bins; stated errors.

use heart_phantom::scene::{
    BlurSettings, CollimatorSettings, DiscretisationSettings, HolesSettings, OrganSettings,
    OrganShapeSettings,
};
use heart_phantom::{
    Accuracy, Attenuation, BinSample, Defect, Medium, Mode, Orbit, Product, Rotation, Scene,
    radon::ArcPolicy,
};
use heart_phantom::{Phantom, PhantomError, Uptake, no_observer, run};
use std::f64::consts::{LN_2, PI};

const N: usize = 24;
const PITCH: f64 = 16.0 / N as f64;

/// The study's heart in the reference configuration, four views.
fn scene() -> Scene {
    let mut scene = Scene::default()
        .with_size(N)
        .with_mode(Mode::Static { phase: 0.0 });
    scene.camera.views = 4;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.camera.samples = Some(BinSample::Averages);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene
}

fn with_tolerance(mut scene: Scene, tolerance: f64) -> Phantom {
    scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
    Phantom::new(scene).unwrap()
}

/// An organ beside a heart that contains no activity and does not attenuate.
fn organ_alone(shape: OrganShapeSettings) -> Scene {
    let mut scene = scene();
    scene.activity.wall = Uptake::Concentration(0.0);
    scene.attenuation = Some(Attenuation {
        coefficient: 0.0,
        medium: Medium::Heart,
    });
    // The heart is away from the organ.
    scene.pose.shift = [0.0, 0.0, 100.0];
    scene.organs.push(OrganSettings {
        shape,
        activity: 1.0,
        attenuation: 0.0,
    });
    scene
}

fn collimator() -> CollimatorSettings {
    CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
    }
}

/// Largest difference relative to the largest sample.
fn distance(a: &[f32], b: &[f64]) -> f64 {
    let (off, most) = (a.iter().zip(b)).fold((0.0f64, 0.0f64), |(off, most), (a, b)| {
        (off.max((f64::from(*a) - b).abs()), most.max(b.abs()))
    });
    off / most
}

#[test]
fn averages_of_a_cylinder_equal_those_of_its_chord() {
    averages_of_a_cylinder([0.4, -0.2], [5.3, 3.1]);
}

/// The silhouettes are in the first and in the last bin.
#[test]
fn averages_at_the_ends_of_the_rows_equal_those_of_the_chord() {
    averages_of_a_cylinder([0.0; 2], [7.7; 2]);
}

fn averages_of_a_cylinder(centre: [f64; 2], axes: [f64; 2]) {
    let shape = OrganShapeSettings::Cylinder {
        centre,
        semi_axes: axes,
    };
    for tolerance in [1e-2, 1e-3, 2e-4] {
        let phantom = with_tolerance(organ_alone(shape), tolerance);
        let made = phantom.sinograms(0, &no_observer).unwrap();
        let mut exact = Vec::new();
        for view in 0..4 {
            let theta = phantom.camera().geometry().angles()[view];
            let half = (axes[0] * theta.cos()).hypot(axes[1] * theta.sin());
            let middle = centre[0] * theta.cos() + centre[1] * theta.sin();
            // The integral of 2 a b / half^2 sqrt(half^2 - s^2) up to s.
            let up_to = |s: f64| {
                let x = ((s - middle) / half).clamp(-1.0, 1.0);
                axes[0] * axes[1] * (x * (1.0 - x * x).sqrt() + x.asin())
            };
            exact.extend((0..N * N).map(|k| {
                let left = ((k % N) as f64 - 0.5 * N as f64) * PITCH;
                (up_to(left + PITCH) - up_to(left)) / PITCH
            }));
        }
        let (off, stated) = (distance(&made.samples, &exact), made.view_error.total());
        println!(
            "tolerance {tolerance}: {:?}, stated {stated:e}, error {off:e}",
            phantom.resolution()
        );
        assert!(
            off <= stated && off <= tolerance,
            "{off} {stated} {tolerance}"
        );
        assert!(stated <= tolerance, "{stated} {tolerance}");
    }
}

#[test]
fn bin_averages_preserve_the_integral_of_a_ball() {
    let shape = OrganShapeSettings::Ellipsoid {
        centre: [1.1, -0.7, 0.3],
        semi_axes: [2.1; 3],
    };
    let volume = 4.0 / 3.0 * PI * 2.1f64.powi(3);
    let off = |samples: BinSample| {
        let mut scene = organ_alone(shape);
        scene.camera.samples = Some(samples);
        let phantom = Phantom::new(scene).unwrap();
        let sum = |view: usize| {
            let view = phantom.view(0, view).unwrap();
            view.iter().map(|v| f64::from(*v)).sum::<f64>()
        };
        let off = |view: usize| (sum(view) * PITCH * PITCH / volume - 1.0).abs();
        (0..4).map(off).fold(0.0, f64::max)
    };
    let (centres, fine) = (off(BinSample::Centres), off(BinSample::Averages));
    println!("ball: centres {centres:e}, averages {fine:e}");
    // Errors of bins cancel in the sum.
    assert!(fine < 1e-4 && fine < 0.1 * centres, "{fine} {centres}");
}

/// The error function to 1.5e-7 (Abramowitz & Stegun 7.1.26), below all tolerances here.
fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.3275911 * x.abs());
    let series = [
        1.061405429,
        -1.453152027,
        1.421413741,
        -0.284496736,
        0.254829592,
    ];
    let sum = series.iter().fold(0.0, |sum, c| (sum + c) * t);
    (1.0 - sum * (-x * x).exp()).copysign(x)
}

/// A sample by its definition: rays 0.05 cm apart, each cut at every 0.05 cm of depth, weighted by the bin average of the Gaussian of this
/// depth, or by its value at the centre.
fn by_definition(
    phantom: &Phantom,
    samples: BinSample,
    sigma: impl Fn(f64) -> f64,
    theta: f64,
    at: [f64; 2],
    pitch: [f64; 2],
) -> f64 {
    const STEP: f64 = 0.05;
    const SLABS: usize = 320;
    let reach = 4.5 * sigma(-8.0);
    let n = [0, 1].map(|k| ((2.0 * reach + pitch[k]) / STEP).ceil() as usize);
    let detector =
        heart_phantom::revolve_voxel::ParallelDetector::new(n[0], n[1], [STEP; 2]).unwrap();
    let planes: Vec<f64> = (1..SLABS).map(|k| -8.0 + STEP * k as f64).collect();
    let rays = detector.with_offset(at).unwrap().rays(theta).unwrap();
    let rays = rays.with_planes(&planes).unwrap();
    let shape = phantom.shape(0.0).unwrap();
    let (slabs, _) = shape.body().project::<f64>(&rays, &[0.0, 1.0]).unwrap();
    let kernel = |axis: usize, sigma: f64| -> Vec<f64> {
        let half = 0.5 * pitch[axis];
        let up_to = |x: f64| 0.5 * erf(x / (sigma * 2f64.sqrt()));
        let x = |k: usize| (k as f64 - 0.5 * (n[axis] as f64 - 1.0)) * STEP;
        let of = |k: usize| match samples {
            BinSample::Averages => (up_to(x(k) + half) - up_to(x(k) - half)) / pitch[axis] * STEP,
            _ => (-0.5 * (x(k) / sigma).powi(2)).exp() / (sigma * (2.0 * PI).sqrt()) * STEP,
        };
        (0..n[axis]).map(of).collect()
    };
    let mut sum = 0.0;
    for slab in 0..SLABS {
        let sigma = sigma(-8.0 + STEP * (slab as f64 + 0.5));
        let [along, across] = [kernel(0, sigma), kernel(1, sigma)];
        for (row, weight) in across.iter().enumerate() {
            let line = &slabs[(SLABS * row + slab) * n[0]..][..n[0]];
            sum += weight * line.iter().zip(&along).map(|(v, w)| v * w).sum::<f64>();
        }
    }
    sum
}

#[test]
fn samples_agree_with_their_definition() {
    let mut near = scene();
    near.camera.pitch = [0.64; 2];
    near.collimator = Some(collimator());
    near.camera.radius = Orbit::Circle(12.0);
    let mut far = near.clone();
    far.camera.radius = Orbit::Circle(22.0);
    let mut blurred = scene();
    blurred.camera.pitch = [0.5, 0.7];
    blurred.blur = Some(BlurSettings { fwhm: 0.9 });
    let mut centres = near.clone();
    centres.camera.samples = Some(BinSample::Centres);
    for (scene, radius) in [
        (near, Some(12.0)),
        (centres, Some(12.0)),
        (far, Some(22.0)),
        (blurred, None),
    ] {
        let pitch = scene.camera.pitch;
        let phantoms = [1e-2, 1e-3].map(|t| (t, with_tolerance(scene.clone(), t)));
        let sigma = |t: f64| match radius {
            Some(radius) => (scene.collimator.unwrap().response().unwrap()).sigma(radius - t),
            None => 0.9 / (8.0 * LN_2).sqrt(),
        };
        let theta = phantoms[0].1.camera().geometry().angles()[1];
        // The wall, its edges, and the base.
        let places = [(12, 12), (16, 10), (7, 4), (12, 20)];
        let exact = places.map(|(bin, row)| {
            let place = |k: usize, axis: usize| (k as f64 - 0.5 * (N as f64 - 1.0)) * pitch[axis];
            let at = [place(bin, 0), place(row, 1)];
            by_definition(
                &phantoms[0].1,
                scene.camera.samples.unwrap(),
                sigma,
                theta,
                at,
                pitch,
            )
        });
        for (tolerance, phantom) in phantoms {
            let made = phantom.sinograms(0, &no_observer).unwrap();
            let view = &made.samples[N * N..2 * N * N];
            let largest = made.samples.iter().fold(0.0f32, |most, v| most.max(*v));
            let mut worst = 0.0f64;
            for ((bin, row), exact) in places.into_iter().zip(exact) {
                let off = (f64::from(view[row * N + bin]) - exact).abs() / f64::from(largest);
                worst = worst.max(off);
            }
            let stated = made.view_error;
            println!(
                "{radius:?} {tolerance}: {:?} error {worst:e}, stated {stated:?}",
                phantom.resolution()
            );
            assert!(worst <= stated.total() && worst <= tolerance);
        }
    }
}

/// The samples of a scene from bins that are `times` as fine, averaged.
fn from_finer(scene: &Scene, times: usize, tolerance: f64) -> Vec<f64> {
    let (mut fine, own) = (scene.clone(), &scene.camera);
    fine.camera.bins *= times;
    fine.camera.rows *= times;
    fine.camera.pitch = own.pitch.map(|pitch| pitch / times as f64);
    fine.camera.samples = Some(BinSample::Averages);
    let samples = with_tolerance(fine, tolerance)
        .sinograms(0, &no_observer)
        .unwrap()
        .samples;
    let (bins, rows) = (own.bins, own.rows);
    let of = |k: usize| -> f64 {
        let (view, row, bin) = (k / (bins * rows), k / bins % rows, k % bins);
        let line = |j: usize| {
            &samples[((view * rows + row) * times + j) * bins * times + bin * times..][..times]
        };
        let sum: f64 = (0..times).flat_map(line).map(|v| f64::from(*v)).sum();
        sum / (times * times) as f64
    };
    (0..samples.len() / (times * times)).map(of).collect()
}

/// Without sub-bins these errors are 1 to 17 per cent of the largest sample.
#[test]
fn samples_equal_averages_of_finer_bins() {
    let clinical = |text: &str, views: usize| {
        let mut scene = Scene::from_toml(text).unwrap();
        scene.noise = None;
        scene.output.write = vec![Product::Projections];
        scene.acquisition.mode = Mode::Static { phase: 0.0 };
        // Rows through the middle of the heart take an eighth of the time.
        (scene.camera.views, scene.camera.rows) = (views, 8);
        scene
    };
    let chest = clinical(include_str!("../../scenes/chest.toml"), 1);
    let pose = clinical(include_str!("../../scenes/clinical-pose.toml"), 2);
    let mut small = scene();
    small.camera.pitch = [0.64; 2];
    small.collimator = Some(collimator());
    for balloon in [&mut small.heart.inner, &mut small.heart.outer] {
        balloon.length *= 0.1;
        balloon.radius *= 0.1;
    }
    // Next to hotter lungs the heart reduces samples.
    let mut hot = chest.clone();
    hot.chest.as_mut().unwrap().lungs = 5.0;
    let scenes = [
        ("chest", chest),
        ("hot", hot),
        ("pose", pose),
        ("small", small),
    ];
    for (name, scene) in scenes {
        let exact = from_finer(&scene, 3, 3e-4);
        for tolerance in [1e-2, 1e-3] {
            let phantom = with_tolerance(scene.clone(), tolerance);
            let made = phantom.sinograms(0, &no_observer).unwrap();
            let (off, stated) = (distance(&made.samples, &exact), made.view_error);
            println!(
                "{name} {tolerance}: {:?} error {off:e}, stated {stated:?}",
                phantom.resolution()
            );
            // The finer bins have errors of their own.
            assert!(
                off <= stated.total() + 3e-4 && off <= tolerance + 3e-4,
                "{name}"
            );
        }
        let mut lines = scene;
        lines.camera.samples = Some(BinSample::Centres);
        let lines = Phantom::new(lines)
            .unwrap()
            .sinograms(0, &no_observer)
            .unwrap();
        println!("{name} centres: {:e}", distance(&lines.samples, &exact));
    }
}

/// A small heart in few bins without a response: two of its resolutions differ by a tenth of what their errors suggest.
#[test]
fn a_difference_that_is_small_by_chance_is_not_taken_for_the_error() {
    let mut scene = scene();
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 61 };
    for (balloon, radius) in [
        (&mut scene.heart.inner, 0.352_293_037),
        (&mut scene.heart.outer, 0.553_603_344),
    ] {
        (balloon.length, balloon.radius) = (1.711_137_610, radius);
    }
    (scene.pose.rotate_x, scene.pose.rotate_y) = (165.751_918, -5.548_826);
    scene.pose.shift = [0.297_868_618, -0.728_666_763, -0.879_330_870];
    let camera = &mut scene.camera;
    (camera.views, camera.start) = (2, 25.456_721_264);
    (camera.bins, camera.rows) = (14, 12);
    camera.pitch = [0.315_197_806, 0.532_813_398];
    scene.acquisition.mode = Mode::Static {
        phase: 0.235_875_145,
    };
    scene.attenuation = Some(Attenuation {
        coefficient: 0.15,
        medium: Medium::Torso {
            centre: [0.0; 2],
            semi_axes: [9.0, 7.0],
        },
    });
    let phantom = with_tolerance(scene.clone(), 6.59e-3);
    let made = phantom.sinograms(0, &no_observer).unwrap();
    // Bins of an eighth resolve a tenth of the stated error.
    let off = distance(&made.samples, &from_finer(&scene, 8, 1e-3));
    let stated = made.view_error.total();
    println!("error {off:e}, stated {stated:e}");
    assert!(off <= stated && stated <= 6.59e-3, "{off} {stated}");
}

#[test]
fn parts_of_views_are_bitwise_identical_to_the_whole() {
    let mut through = scene();
    through.collimator = Some(collimator());
    through.acquisition.mode = Mode::WholeCycle;
    through.acquisition.accuracy = Accuracy::Steps(8);
    through.output.write = vec![Product::Projections];
    let phantom = Phantom::new(through.clone()).unwrap();
    let all = phantom.sinograms(0, &no_observer).unwrap().samples;
    assert!(all[2 * N * N..3 * N * N] == phantom.view(0, 2).unwrap());
    // For any memory and number of threads.
    let small = Phantom::new(through.clone()).unwrap().with_memory(1);
    assert!(small.view(0, 2).unwrap() == all[2 * N * N..3 * N * N]);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    assert!(
        one.install(|| Phantom::new(through).unwrap().view(0, 2).unwrap())
            == all[2 * N * N..3 * N * N]
    );
    let folder = tempfile::tempdir().unwrap();
    let report = run(&phantom, folder.path(), &no_observer).unwrap();
    assert_eq!(report.gates[0].resolution, phantom.resolution().unwrap());
    let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    assert!(text.contains("\"view_error\"") && text.contains("\"density\""));
}

#[test]
fn samples_are_bin_averages_with_blur_and_line_integrals_without() {
    let mut plain = scene();
    plain.camera.samples = None;
    let mut blurred = plain.clone();
    blurred.blur = Some(BlurSettings { fwhm: 1.0 });
    let resolution = |scene: &Scene| Phantom::new(scene.clone()).unwrap().resolution().unwrap();
    assert!(resolution(&plain).is_none() && resolution(&blurred).is_some());
    // The centres of bins show the blurred image, too.
    let averages = Phantom::new(blurred.clone()).unwrap().view(0, 1).unwrap();
    blurred.camera.samples = Some(BinSample::Centres);
    let centres = Phantom::new(blurred).unwrap().view(0, 1).unwrap();
    let averages: Vec<f64> = averages.into_iter().map(f64::from).collect();
    // An average is higher by h^2 / 24 times the Laplacian: at the peak of the wall's image 2 % for h / sigma = 1.6.
    let off = distance(&centres, &averages);
    assert!((0.005..0.1).contains(&off), "{off}");
}

#[test]
fn a_tolerance_that_no_resolution_meets_is_an_error() {
    let mut scene = scene();
    (scene.camera.bins, scene.camera.rows, scene.camera.pitch) = (8, 8, [2.0; 2]);
    scene.acquisition.accuracy = Accuracy::Tolerance(1e-6);
    let error = Phantom::new(scene).unwrap().prepare().unwrap_err();
    let PhantomError::Rejected { field, source, .. } = error else {
        panic!("{error:?}");
    };
    assert_eq!(field, "acquisition.accuracy.tolerance");
    assert!(matches!(*source, PhantomError::Tolerance { reached, .. } if reached > 1e-6));
    let said = source.to_string();
    let end = "the tolerance is 0.000001, of which 5e-7 is for this term";
    assert!(said.ends_with(end), "{said}");
}

/// Weights of a response are omitted beyond a fixed distance: a tolerance below their sum is rejected at the coarsest resolution.
#[test]
fn a_tolerance_below_the_omitted_weights_costs_little() {
    let mut scene = scene();
    scene.blur = Some(BlurSettings { fwhm: 1.0 });
    let rays = |tolerance| {
        let phantom = with_tolerance(scene.clone(), tolerance);
        let found = phantom.resolution();
        (phantom.work().rays_cast, found)
    };
    let (few, rejected) = rays(1e-6);
    let error = rejected.unwrap_err();
    assert!(error.to_string().starts_with("omitted weights"), "{error}");
    let (many, found) = rays(0.02);
    assert!(found.is_ok() && 2 * few < many, "{few} {many}");
}

/// A resolution is found in views of a camera that does not turn; the largest sample that of averages over the rotation, if it turns far.
#[test]
fn rotation_during_a_view_does_not_change_the_resolution() {
    let found = |rotation, arc| {
        let mut scene = scene();
        (scene.camera.rotation, scene.camera.arc) = (rotation, arc);
        let phantom = with_tolerance(scene, 0.02);
        let resolution = phantom.resolution().unwrap().unwrap();
        (resolution, phantom.work().rays_cast)
    };
    for arc in [20.0, 360.0] {
        let [turning, stopped] =
            [Rotation::Continuous, Rotation::StepAndShoot].map(|rotation| found(rotation, arc));
        assert_eq!(turning.0, stopped.0);
        // 5 and 90 degrees a view.
        assert_eq!(
            turning.1 == stopped.1,
            arc == 20.0,
            "{turning:?} {stopped:?}"
        );
    }
}

/// Rows wider than the wall need thousands of rays a sample for an error of 1e-3: without a given tolerance, refinement ends before.
#[test]
fn without_a_tolerance_the_rays_of_a_sample_are_limited() {
    let mut scene = scene();
    (scene.camera.bins, scene.camera.rows) = (9, 7);
    scene.camera.pitch = [0.002, 2.2];
    scene.defects.push(Defect {
        layers: [0.0, 0.6],
        s: [0.0, 0.5],
        azimuths_degrees: [-90.0, 270.0],
        activity: 0.2,
    });
    scene.acquisition.accuracy = Accuracy::Steps(8);
    let phantom = Phantom::new(scene.clone()).unwrap();
    let density = phantom.resolution().unwrap().unwrap().density;
    let before = phantom.work().rays_cast;
    phantom.view(0, 0).unwrap();
    let rays = (phantom.work().rays_cast - before) / (9 * 7);
    assert!((100..2000).contains(&rays), "{rays}");
    // A tolerance is met with more.
    let finer = with_tolerance(scene, 1e-2).resolution().unwrap().unwrap();
    assert!(finer.density > density, "{finer:?} {density}");
}
