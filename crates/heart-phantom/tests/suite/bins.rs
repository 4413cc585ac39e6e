//! Means over bins and rows: closed forms, conservation, and many more rays.

use heart_phantom::scene::{
    AttenuationSettings, BinSample, CollimatorSettings, DiscretisationSettings, HolesSettings,
    MediumSettings, Mode, OrganSettings, OrganShapeSettings, Product, Scene,
};
use heart_phantom::{Phantom, PhantomError, Uptake, run};
use std::f64::consts::PI;

const N: usize = 24;
const PITCH: f64 = 16.0 / N as f64;

fn scene(samples: BinSample) -> Scene {
    let mut scene = Scene::default()
        .with_size(N)
        .with_mode(Mode::Static { phase: 0.0 });
    scene.camera.views = 4;
    scene.camera.samples = samples;
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene
}

fn means(tolerance: f64) -> BinSample {
    BinSample::Means { tolerance }
}

/// An organ beside a heart that holds nothing and weakens nothing.
fn organ_alone(shape: OrganShapeSettings, samples: BinSample) -> Phantom {
    let mut scene = scene(samples);
    scene.activity.wall = Uptake::Concentration(0.0);
    let none = AttenuationSettings {
        coefficient: 0.0,
        medium: MediumSettings::Heart,
    };
    // Out of the way of the organ.
    scene.pose.shift = [0.0, 0.0, 100.0];
    let organ = OrganSettings {
        shape,
        activity: 1.0,
        attenuation: 0.0,
    };
    scene.attenuation = Some(none);
    scene.organs.push(organ);
    Phantom::new(scene).unwrap()
}

/// Relative Euclidean distance.
fn distance(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    let (off, all) = a.zip(b).fold((0.0, 0.0), |(off, all), (a, b)| {
        (off + (a - b) * (a - b), all + b * b)
    });
    f64::sqrt(off / all)
}

#[test]
fn means_of_a_cylinder_are_those_of_its_chord() {
    let axes = [5.3, 3.1];
    let shape = OrganShapeSettings::Cylinder {
        centre: [0.4, -0.2],
        semi_axes: axes,
    };
    let mut last = f64::INFINITY;
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let phantom = organ_alone(shape, means(tolerance));
        let (mut off, mut worst) = (0.0f64, 0.0f64);
        for view in 0..4 {
            let theta = phantom.camera().geometry().angles()[view];
            let half = (axes[0] * theta.cos()).hypot(axes[1] * theta.sin());
            let middle = 0.4 * theta.cos() - 0.2 * theta.sin();
            // The integral of 2 a b / half^2 sqrt(half^2 - s^2) up to s.
            let up_to = |s: f64| {
                let x = ((s - middle) / half).clamp(-1.0, 1.0);
                axes[0] * axes[1] * (x * (1.0 - x * x).sqrt() + x.asin())
            };
            let exact = |bin: usize| {
                let left = (bin as f64 - 0.5 * N as f64) * PITCH;
                (up_to(left + PITCH) - up_to(left)) / PITCH
            };
            let seen = phantom.view(0, view).unwrap();
            let exact: Vec<f64> = (0..N * N).map(|k| exact(k % N)).collect();
            off = off.max(distance(
                seen.iter().map(|v| f64::from(*v)),
                exact.iter().copied(),
            ));
            let errors = seen
                .iter()
                .zip(&exact)
                .map(|(a, b)| (f64::from(*a) - b).abs());
            worst = errors.fold(worst, f64::max);
        }
        let told = phantom.bin_means().unwrap().unwrap();
        println!(
            "tolerance {tolerance}: {} rays, told {:e}, error {off:e}, worst {worst:e}",
            told.rays, told.error
        );
        assert!(
            told.error <= tolerance && off < tolerance && off < last,
            "{off} {told:?}"
        );
        last = off;
    }
    // Samples at the middles are not means.
    let centres = organ_alone(shape, BinSample::Centres);
    assert!(centres.bin_means().unwrap().is_none());
}

#[test]
fn all_of_a_ball_is_in_its_bins() {
    let shape = OrganShapeSettings::Ellipsoid {
        centre: [1.1, -0.7, 0.3],
        semi_axes: [2.1; 3],
    };
    let volume = 4.0 / 3.0 * PI * 2.1f64.powi(3);
    let off = |samples: BinSample| {
        let phantom = organ_alone(shape, samples);
        let sum = |view: usize| {
            let view = phantom.view(0, view).unwrap();
            view.iter().map(|v| f64::from(*v)).sum::<f64>()
        };
        let off = |view: usize| (sum(view) * PITCH * PITCH / volume - 1.0).abs();
        (0..4).map(off).fold(0.0, f64::max)
    };
    let (centres, fine) = (off(BinSample::Centres), off(means(1e-3)));
    println!("ball: centres {centres:e}, means {fine:e}");
    // Errors of bins cancel in the sum.
    assert!(fine < 1e-4 && fine < 0.1 * centres, "{fine} {centres}");
}

/// 32 x 32 rays of each bin at even places, in slabs through a collimator too: means and blurs may be taken in any order.
#[test]
fn means_of_a_heart_are_those_of_many_rays() {
    const FINE: usize = 32;
    let lines = scene(BinSample::Centres).with_size(N * FINE);
    let fine = Phantom::new(lines).unwrap();
    for tolerance in [1e-2, 1e-3] {
        let phantom = Phantom::new(scene(means(tolerance))).unwrap();
        let told = phantom.bin_means().unwrap().unwrap();
        // Neither the first view nor the middle one, in which the number of rays was found.
        let (seen, rays) = (phantom.view(0, 1).unwrap(), fine.view(0, 1).unwrap());
        let mean = |k: usize| {
            let (bin, row) = (k % N * FINE, k / N * FINE);
            let of_row = |j: usize| -> f64 {
                let from = (row + j) * N * FINE + bin;
                rays[from..from + FINE].iter().map(|v| f64::from(*v)).sum()
            };
            (0..FINE).map(of_row).sum::<f64>() / (FINE * FINE) as f64
        };
        let off = distance(seen.iter().map(|v| f64::from(*v)), (0..N * N).map(mean));
        println!(
            "tolerance {tolerance}: {} rays, told {:e}, error {off:e}",
            told.rays, told.error
        );
        // Another view than those that it was found in: within a factor of two.
        assert!(
            off < 2.0 * tolerance && told.error > 0.2 * off,
            "{off} {told:?}"
        );
    }
}

#[test]
fn means_go_through_a_collimator_and_into_the_report() {
    let mut through = scene(means(1e-2));
    through.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.38,
        tolerance: 1e-3,
    });
    through.output.write = vec![Product::Projections];
    let mut by_centres = through.clone();
    by_centres.camera.samples = BinSample::Centres;
    let [with, without] = [&through, &by_centres].map(|scene| Phantom::new(scene.clone()).unwrap());
    let (a, b) = (with.view(0, 2).unwrap(), without.view(0, 2).unwrap());
    let sum = |v: &[f32]| v.iter().map(|v| f64::from(*v)).sum::<f64>();
    let off = distance(
        a.iter().map(|v| f64::from(*v)),
        b.iter().map(|v| f64::from(*v)),
    );
    // Blurred, samples and means differ by the width of a bin, not by its edges.
    assert!(
        off > 1e-3 && off < 0.1 && (sum(&a) / sum(&b) - 1.0).abs() < 0.02,
        "{off}"
    );
    // One row has the bits of the whole.
    assert!(with.sinograms(0, &|_| ()).unwrap().samples[2 * N * N..3 * N * N] == a);
    let folder = tempfile::tempdir().unwrap();
    let report = run(&with, folder.path(), &|_| ()).unwrap();
    assert_eq!(report.gates[0].bin_means, with.bin_means().unwrap());
    let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    assert!(text.contains("\"bin_means\"") && text.contains("\"depth_error\""));
}

#[test]
fn tolerances_that_cannot_be_are_refused() {
    for tolerance in ["0.0", "nan", "2.0", "-1.0"] {
        let text = format!("[camera]\nsamples = {{ means = {{ tolerance = {tolerance} }} }}\n");
        let Err(PhantomError::Scene(error)) = Scene::from_toml(&text) else {
            panic!("{tolerance}");
        };
        assert_eq!(error.first().field, "camera.samples.means.tolerance");
    }
    // More rays than are tried.
    let error = Phantom::new(scene(means(1e-6)))
        .unwrap()
        .prepare()
        .unwrap_err();
    let PhantomError::Refused { field, source, .. } = error else {
        panic!("{error:?}");
    };
    assert_eq!(field, "camera.samples");
    assert!(
        matches!(*source, PhantomError::BinMeans { rays: 610, tolerance: 1e-6, reached } if reached > 1e-6)
    );
}
