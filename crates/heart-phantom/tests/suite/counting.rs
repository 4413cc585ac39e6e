//! Expected counts from the sensitivity of the camera: activity in MBq, acquisition time, decay.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{Counting, Counts, Decay, Mode, Noise, Product, ProjectionValues, Scene};
use heart_phantom::{Phantom, PhantomError, Rotation, Uptake, no_observer, run};
use std::f64::consts::LN_2;
use std::path::Path;

const SENSITIVITY: f64 = 80.0;
const SECONDS: f64 = 12.0;

fn scene(mode: Mode, decay: Decay) -> Scene {
    let mut scene = Scene::default().with_size(48).with_mode(mode);
    scene.camera.views = 5;
    scene.camera.seconds_per_view = SECONDS;
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.output.write = vec![Product::Projections];
    scene.counting = Some(Counting {
        sensitivity: SENSITIVITY,
        decay,
    });
    scene
}

fn factors(scene: Scene, gate: usize) -> Vec<f64> {
    let phantom = Phantom::new(scene).unwrap();
    phantom.counts_per_unit(gate).unwrap().unwrap()
}

/// The counts of a view correspond to the total activity: the sum of the samples is the volume integral, by the midpoint rule.
#[test]
fn counts_of_a_heart_agree_with_its_activity() {
    let total = 37.0; // MBq
    let off = |size: usize| {
        let mut scene = scene(Mode::Static { phase: 0.5 }, Decay::None).with_size(size);
        scene.activity.wall = Uptake::Total(total);
        scene.activity.cavity = Uptake::Concentration(0.02);
        let phantom = Phantom::new(scene).unwrap();
        let cavity = 0.02 * phantom.shape(0.5).unwrap().volumes()[0];
        let exact = (total + cavity) * SENSITIVITY * SECONDS;
        let factor = phantom.counts_per_unit(0).unwrap().unwrap();
        (0..5)
            .map(|view| {
                let view_samples = phantom.view(0, view).unwrap();
                let sum: f64 = view_samples.iter().map(|v| f64::from(*v)).sum();
                (sum * factor[view] / exact - 1.0).abs()
            })
            .fold(0.0, f64::max)
    };
    let [coarse, fine] = [32, 128].map(off);
    // Near the edge a chord is the root of the distance from it: the midpoint rule is of order 3/2, a factor of 8 from bins of 0.5 cm,
    // half as wide as the wall is thick, to 0.125 cm.
    assert!(coarse < 3e-2 && fine < coarse / 8.0, "{coarse} {fine}");
}

#[test]
fn counts_scale_with_the_acquisition_time() {
    let area = (16.0f64 / 48.0).powi(2);
    let all = area * SENSITIVITY * SECONDS;
    let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-12);
    for mode in [Mode::Static { phase: 0.2 }, Mode::WholeCycle] {
        for factor in factors(scene(mode, Decay::None), 0) {
            near(factor, all);
        }
    }
    for factor in factors(scene(Mode::Exposure { seconds: 0.3 }, Decay::None), 0) {
        near(factor, all * 0.3 / SECONDS);
    }
    // With step and shoot each gate has a fraction of the time; with continuous rotation its actual time, all gates together the whole time.
    let gated = Mode::Gated { gates: 5 };
    for gate in 0..5 {
        for factor in factors(scene(gated, Decay::None), gate) {
            near(factor, all / 5.0);
        }
    }
    let mut turning = scene(gated, Decay::None);
    turning.camera.rotation = Rotation::Continuous;
    turning.camera.seconds_per_view = 1.3;
    let gates: Vec<Vec<f64>> = (0..5).map(|gate| factors(turning.clone(), gate)).collect();
    for view in 0..5 {
        near(
            gates.iter().map(|gate| gate[view]).sum(),
            all * 1.3 / SECONDS,
        );
    }
    // 1.4 beats per view: one gate occurs once, another twice.
    assert!(
        gates
            .iter()
            .any(|gate| (gate[0] / gates[0][0] - 1.0).abs() > 0.3)
    );
}

/// The average of 2^(-t / h) over the time of view k against sums over many instants.
#[test]
fn decay_is_averaged_over_the_time_of_a_view() {
    let mean = |from: f64, seconds: f64, half_life: f64| {
        // Simpson's rule, much more accurate than 1e-12 over a fraction of a half-life.
        let n = 2000;
        let at = |k: usize| (-LN_2 * (from + seconds * k as f64 / n as f64) / half_life).exp();
        let inner: f64 = (1..n).map(|k| at(k) * [2.0, 4.0][k % 2]).sum();
        (at(0) + inner + at(n)) / (3 * n) as f64
    };
    for (mode, seconds) in [
        (Mode::WholeCycle, SECONDS),
        (Mode::Exposure { seconds: 7.0 }, 7.0),
    ] {
        let alone = factors(scene(mode, Decay::None), 0);
        for (decay, half_life) in [
            (Decay::Tc99m, 21_625.92),
            (Decay::HalfLifeHours(0.01), 36.0),
            (Decay::HalfLifeHours(1e9), 3.6e12),
        ] {
            let found = factors(scene(mode, decay), 0);
            for (view, (found, alone)) in found.iter().zip(&alone).enumerate() {
                let exact = mean(view as f64 * SECONDS, seconds, half_life);
                assert!(
                    (found / alone / exact - 1.0).abs() < 1e-11,
                    "{decay:?} {view}"
                );
            }
        }
    }
}

/// Counts over many seeds have the expected mean and the variance of a Poisson distribution, in an early and in a late view.
#[test]
fn expected_counts_are_counted() {
    let mut scene = scene(Mode::Static { phase: 0.3 }, Decay::HalfLifeHours(0.01)).with_size(16);
    scene.activity.wall = Uptake::Concentration(0.02);
    let means = Phantom::new(scene.clone()).unwrap();
    let factors = means.counts_per_unit(0).unwrap().unwrap();
    assert!(factors[4] < 0.5 * factors[0]);
    let n_seeds = 400;
    for view in [0, 4] {
        let expected: Vec<f64> = (means.view(0, view).unwrap().iter())
            .map(|v| f64::from(*v) * factors[view])
            .collect();
        let total: f64 = expected.iter().sum();
        let mut sums = [0.0; 2];
        for seed in 0..n_seeds {
            let noise = Noise {
                counts: Counts::Expected,
                seed,
            };
            let phantom = Phantom::new(Scene {
                noise: Some(noise),
                ..scene.clone()
            });
            let phantom = phantom.unwrap();
            let samples = phantom.view(0, view).unwrap();
            let counts: Vec<f64> = (samples.iter())
                .map(|v| f64::from(*v) * factors[view])
                .collect();
            // Integers, to the rounding of f32.
            assert!(
                counts
                    .iter()
                    .all(|c| (c - c.round()).abs() < 1e-6 * c.max(1.0))
            );
            let sum: f64 = counts.iter().sum();
            sums[0] += sum / n_seeds as f64;
            sums[1] += (sum - total).powi(2) / n_seeds as f64;
        }
        // Five standard deviations of the mean and of the variance over so many seeds.
        let n = n_seeds as f64;
        assert!(
            (sums[0] - total).abs() < 5.0 * (total / n).sqrt(),
            "{sums:?} {total}"
        );
        assert!(
            (sums[1] / total - 1.0).abs() < 5.0 * (2.0 / n).sqrt(),
            "{sums:?} {total}"
        );
    }
}

#[test]
fn noise_of_a_part_is_identical_to_that_of_the_whole() {
    let noise = Noise {
        counts: Counts::Expected,
        seed: 3,
    };
    let mut scene = scene(Mode::Gated { gates: 2 }, Decay::Tc99m);
    scene.noise = Some(noise);
    let all = Phantom::new(scene.clone())
        .unwrap()
        .sinograms(1, &no_observer);
    let len = 48 * 48;
    let part = Phantom::new(scene).unwrap().view(1, 3).unwrap();
    assert!(part == all.unwrap().samples[3 * len..4 * len]);
}

#[test]
fn views_of_other_gates_and_lengths_are_not_converted() {
    let counted = scene(Mode::Static { phase: 0.3 }, Decay::None).with_size(8);
    let n_views = counted.camera.views;
    let all = vec![1.0; n_views * 64];
    for values in [ProjectionValues::Normalised, ProjectionValues::Counts] {
        let mut scene = counted.clone();
        let (counts, seed) = (Counts::Expected, 1);
        scene.noise = Some(Noise { counts, seed });
        scene.output.values = values;
        let phantom = Phantom::new(scene).unwrap();
        let convert = |gate, first, samples| {
            let views = &all[..samples];
            (phantom.in_values_of_output(gate, first, views)).map(|views| views.len())
        };
        assert_eq!(convert(0, 0, all.len()).unwrap(), all.len());
        assert_eq!(convert(0, n_views - 1, 64).unwrap(), 64);
        for (gate, first) in [(1000, 0), (0, n_views)] {
            let rejected = convert(gate, first, 64);
            assert!(
                matches!(rejected, Err(PhantomError::Count { .. })),
                "{rejected:?}"
            );
        }
        for (first, samples) in [(1, all.len()), (0, 63), (0, 65)] {
            let rejected = convert(0, first, samples);
            assert!(
                matches!(rejected, Err(PhantomError::WrongLength { given, .. }) if given == samples),
                "{rejected:?}"
            );
        }
    }
}

/// A number of 16 significant bits is at least 2^15 units of its last bit, of which rounding changes half a unit.
#[test]
fn a_total_of_counts_is_met_to_its_stated_error() {
    let mut scene = scene(Mode::Static { phase: 0.3 }, Decay::None).with_size(8);
    scene.counting = None;
    let means = Phantom::new(scene.clone()).unwrap();
    let means = means.sinograms(0, &no_observer).unwrap().samples;
    let sum: f64 = means.iter().map(|sample| f64::from(*sample)).sum();
    let error = |k: i32| {
        let total = 1e5 * 1.013f64.powi(k);
        let mut scene = scene.clone();
        let counts = Counts::Total(total);
        scene.noise = Some(Noise { counts, seed: 1 });
        let per_unit = Phantom::new(scene).unwrap().counts_per_unit(0).unwrap();
        (per_unit.unwrap()[0] * sum / total - 1.0).abs()
    };
    let worst = (0..60).map(error).fold(0.0, f64::max);
    assert!((8e-6..1.6e-5).contains(&worst), "{worst}");
}

#[test]
fn the_report_and_the_headers_contain_the_counts_per_unit() {
    use heart_phantom::files::Format;
    let folder = tempfile::tempdir().unwrap();
    let written = |decay: Decay, format: Format, name: &str| {
        let mut scene = scene(Mode::WholeCycle, decay);
        scene.output.projections = format;
        let out = folder.path().join(name);
        let phantom = Phantom::new(scene).unwrap();
        let report = run(&phantom, &out, &no_observer).unwrap();
        let factors = phantom.counts_per_unit(0).unwrap().unwrap();
        assert_eq!(report.gates[0].views.counts_per_unit, factors);
        let alike = (decay == Decay::None).then_some(factors[0]);
        assert_eq!(report.gates[0].counts_per_unit, alike);
        (factors, out)
    };
    let texts = |factors: &[f64], between: &str| {
        let texts: Vec<String> = factors.iter().map(f64::to_string).collect();
        texts.join(between)
    };
    let line = |path: &Path, begins: &str| {
        let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
        let line = text.lines().find(|line| line.starts_with(begins));
        line.unwrap().to_owned()
    };
    for (format, file) in [
        (Format::InterfileStir, "projections.hs"),
        (Format::InterfileSimind, "projections.h00"),
    ] {
        let (factors, out) = written(Decay::None, format, &format!("{file}-none"));
        let told = line(&out.join(file), ";# counts per unit");
        assert_eq!(told, format!(";# counts per unit := {}", factors[0]));
        let (factors, out) = written(Decay::Tc99m, format, file);
        let told = line(&out.join(file), ";# counts per unit");
        assert_eq!(
            told,
            format!(";# counts per unit := {}", texts(&factors, ", "))
        );
    }
    let (factors, out) = written(Decay::Tc99m, Format::Nrrd, "nrrd");
    let told = line(&out.join("projections.nrrd"), "counts_per_unit:=");
    assert_eq!(told, format!("counts_per_unit:={}", texts(&factors, " ")));
    let (_, out) = written(Decay::Tc99m, Format::Npz, "npz");
    let archive = std::fs::read(out.join("projections.npz")).unwrap();
    let name = b"counts_per_unit.npy";
    assert!(archive.windows(name.len()).any(|bytes| bytes == name));
    let (factors, out) = written(Decay::Tc99m, Format::RawJson, "json");
    let header = std::fs::read(out.join("projections.json")).unwrap();
    let header: serde_json::Value = serde_json::from_slice(&header).unwrap();
    // To the last digit, as read.
    let told = header["counts_per_unit"].as_array().unwrap();
    assert_eq!(told.len(), 5);
    for (told, factor) in told.iter().zip(&factors) {
        assert!((told.as_f64().unwrap() / factor - 1.0).abs() < 1e-15);
    }
}

/// With `values = "counts"` every format contains the counts, as integers without a factor.
#[test]
fn counts_are_unscaled_in_every_format() {
    use heart_phantom::files::Format;
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(Mode::Static { phase: 0.3 }, Decay::HalfLifeHours(0.01)).with_size(24);
    scene.noise = Some(Noise {
        counts: Counts::Expected,
        seed: 3,
    });
    scene.activity.wall = Uptake::Concentration(0.1);
    scene.output.values = ProjectionValues::Counts;
    let phantom = Phantom::new(scene.clone()).unwrap();
    let factors = phantom.counts_per_unit(0).unwrap().unwrap();
    let samples = phantom.sinograms(0, &no_observer).unwrap().samples;
    // In any order: the formats differ in that of rows and bins.
    let sorted = |mut counts: Vec<f32>| {
        counts.sort_by(f32::total_cmp);
        counts
    };
    let views = samples.chunks(24 * 24).zip(&factors);
    let expected = views.flat_map(|(view, factor)| {
        view.iter()
            .map(move |sample| (f64::from(*sample) * factor).round() as f32)
    });
    let expected = sorted(expected.collect());
    assert!(factors[4] < 0.5 * factors[0] && expected[samples.len() - 1] > 10.0);
    let total: f64 = expected.iter().map(|count| f64::from(*count)).sum();
    for format in Format::ALL {
        let Some(extensions) = format.info().projections else {
            continue;
        };
        scene.output.projections = format;
        let out = folder.path().join(extensions.header);
        let report = run(&Phantom::new(scene.clone()).unwrap(), &out, &no_observer).unwrap();
        assert_eq!(report.gates[0].counts, Some(total));
        let extension = extensions.data.unwrap_or(extensions.header);
        let bytes = std::fs::read(out.join(format!("projections.{extension}"))).unwrap();
        let find = |what: &[u8]| bytes.windows(what.len()).position(|part| part == what);
        let each = format.info().sample_bytes as usize;
        let from = match format {
            // Of the archive the array of this name; its header has 128 bytes.
            Format::Npz => {
                let array = find(b"samples.npy").unwrap();
                let magic = bytes[array..]
                    .windows(6)
                    .position(|part| part == b"\x93NUMPY");
                array + magic.unwrap() + 128
            }
            // The samples are the end of the file.
            _ => bytes.len() - each * samples.len(),
        };
        let found = bytes[from..].chunks_exact(each).take(samples.len());
        let found = found.map(|sample| match *sample {
            [a, b] => f32::from(u16::from_le_bytes([a, b])),
            _ => f32::from_le_bytes(sample.try_into().unwrap()),
        });
        assert!(sorted(found.collect()) == expected, "{format:?}");
    }
}

/// Scenes without the section have unchanged results.
#[test]
fn an_unknown_sensitivity_is_not_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut plain = scene(Mode::WholeCycle, Decay::None);
    plain.counting = None;
    plain.output.projections = heart_phantom::files::Format::InterfileStir;
    let phantom = Phantom::new(plain).unwrap();
    assert!(phantom.counts_per_unit(0).unwrap().is_none());
    run(&phantom, folder.path(), &no_observer).unwrap();
    for file in ["report.json", "projections.hs"] {
        let text = std::fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(
            !text.contains("counting") && !text.contains("counts"),
            "{text}"
        );
    }
}

#[test]
fn invalid_sensitivities_are_rejected() {
    let refused = |decay: Decay, mode: Mode| match Phantom::new(scene(mode, decay)) {
        Err(PhantomError::Scene(error)) => error,
        other => panic!("{other:?}"),
    };
    // 48 s are 1e4 half-lives: no activity remains.
    let decay = Decay::HalfLifeHours(48.0 / 3600.0 / 1e4);
    let error = refused(decay, Mode::WholeCycle);
    assert_eq!(error.first().field, "counting.sensitivity");
    assert!(
        error
            .first()
            .wanted
            .contains("expected counts per unit sample"),
        "{error}"
    );
    let error = refused(Decay::None, Mode::Instants);
    assert_eq!(error.first().field, "acquisition.mode");
}
