//! The entries of a run's report against its files.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::{
    Accuracy, Attenuation, Counts, Medium, Mode, Noise, Product, Scene,
    membrane_newton::PressureLaw,
};
use heart_phantom::{
    GateReport, Phantom, PolarMap, RunReport, VolumeCurve, VolumeRange, no_observer, run,
};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

/// A scene that is fast to compute.
fn small(mode: Mode, write: &[Product]) -> Scene {
    let mut scene = Scene::default().with_size(32).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.camera.views = 12;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.output.write = write.to_vec();
    scene
}

fn done(scene: Scene, out: &Path) -> RunReport {
    run(&Phantom::new(scene).unwrap(), out, &no_observer).unwrap()
}

/// Attenuation removes nine tenths and more of the activity, which a fixed grey scale would show as black.
#[test]
fn images_have_the_grey_window_of_their_slices() {
    let folder = tempfile::tempdir().unwrap();
    let write = [Product::Reconstruction, Product::Pictures];
    let mut scene = small(Mode::Gated { gates: 3 }, &write);
    scene.attenuation = Some(Attenuation {
        coefficient: 1.0,
        medium: Medium::Heart,
    });
    let report = done(scene, folder.path());
    let shown = report.pictures.unwrap();
    // Row 16 of 32 of half a centimetre.
    assert_eq!((shown.slice, shown.z_cm, shown.black), (16, 0.25, 0.0));
    let mut most = f64::MIN;
    for gate in 0..3 {
        let name = |what: &str, ending: &str| format!("{what}-gate-0{gate}.{ending}");
        let bytes = std::fs::read(folder.path().join(name("reconstruction", "npy"))).unwrap();
        let samples: Vec<f32> = bytes[bytes.len() - 4 * 32 * 32 * 32..]
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect();
        let slice = &samples[16 * 32 * 32..17 * 32 * 32];
        let file = std::fs::File::open(folder.path().join(name("slice", "png"))).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(file))
            .read_info()
            .unwrap();
        let mut shades = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut shades).unwrap();
        assert_eq!(shades.len(), slice.len());
        for (value, shade) in slice.iter().zip(shades) {
            let grey = 255.0 * f64::from(*value) / shown.white;
            assert!((grey.clamp(0.0, 255.0) - f64::from(shade)).abs() <= 0.501);
            most = most.max(f64::from(*value));
        }
    }
    assert_eq!(most, shown.white);
    assert!(most < 0.5, "{most} is dark in a window up to 1.25");
}

fn npy(path: &Path) -> Vec<u8> {
    let bytes = std::fs::read(path).unwrap();
    bytes[bytes.len() - 32 * 32 * 32..].to_vec()
}

/// Enclosed volume of a binary STL file in mL: sums of tetrahedra from the origin.
fn stl_volume(path: &Path) -> (usize, f64) {
    let bytes = std::fs::read(path).unwrap();
    let triangles = bytes[84..].as_chunks::<50>().0.iter().map(|facet| {
        let at = |k: usize| {
            let b = facet[12 + 4 * k..16 + 4 * k].try_into().unwrap();
            f64::from(f32::from_le_bytes(b)) / 10.0
        };
        let [a, b, c] = [0, 3, 6].map(|k| [at(k), at(k + 1), at(k + 2)]);
        let cross = |i: usize| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            b[j] * c[k] - b[k] * c[j]
        };
        (0..3).map(|i| a[i] * cross(i)).sum::<f64>() / 6.0
    });
    let n = (bytes.len() - 84) / 50;
    (n, triangles.sum())
}

/// The volume of the cavity at a phase of the sinusoid, in closed form.
fn cavity(phase: f64) -> f64 {
    let rest = PI * 1.75f64.powi(2) * (8.5 + 2.0 * 1.75 / 3.0);
    rest * (1.0 + 0.3 * (1.0 - (TAU * phase).cos()))
}

#[test]
fn labels_maps_and_surfaces_agree_with_the_mode() {
    let write = [Product::Labels, Product::Attenuation, Product::Meshes];
    let gate = |k: usize| (format!("-gate-0{k}"), (k as f64 + 0.5) / 4.0);
    let ends = [("-end-diastole".into(), 0.5), ("-end-systole".into(), 0.0)];
    let modes = [
        (Mode::Static { phase: 0.2 }, vec![(String::new(), 0.2)]),
        (Mode::Gated { gates: 4 }, (0..4).map(gate).collect()),
        (Mode::WholeCycle, ends.to_vec()),
        (Mode::Instants, ends.to_vec()),
    ];
    for (mode, expected) in modes {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = small(mode, &write);
        scene.attenuation = Some(Attenuation {
            coefficient: 0.5,
            medium: Medium::Heart,
        });
        let report = done(scene, folder.path());
        let mut files: Vec<PathBuf> = Vec::new();
        for (k, (name, phase)) in expected.iter().enumerate() {
            let file =
                |what: &str, ending: &str| folder.path().join(format!("{what}{name}.{ending}"));
            // Voxels of 0.125 mL with more cavity than wall: accurate to some hundredths.
            let labels = npy(&file("labels", "npy"));
            let inside = labels.iter().filter(|label| **label == 1).count();
            let found = 0.125 * inside as f64;
            assert!(
                (found / cavity(*phase) - 1.0).abs() < 0.04,
                "{mode:?} {name} {found}"
            );
            // The whole heart attenuates: the cavity, and the wall of constant volume.
            let wall = report.numbers.wall_volume;
            let bytes = std::fs::read(file("attenuation", "npy")).unwrap();
            let sum: f64 = bytes[bytes.len() - 4 * labels.len()..]
                .as_chunks::<4>()
                .0
                .iter()
                .map(|b| f64::from(f32::from_le_bytes(*b)))
                .sum();
            let held = 0.125 * sum / 0.5;
            assert!(
                (held / (cavity(*phase) + wall) - 1.0).abs() < 2e-3,
                "{held}"
            );
            for (surface, volume) in [("inner", cavity(*phase)), ("outer", cavity(*phase) + wall)] {
                // A thousandth by default, and 101 nodes.
                let (_, found) = stl_volume(&file(surface, "stl"));
                assert!(
                    (found / volume - 1.0).abs() < 2e-3,
                    "{mode:?} {name} {found}"
                );
            }
            // The report agrees for these phases.
            let said = &report.phases[k];
            assert_eq!(said.phase, *phase);
            assert!(name.is_empty() || *name == format!("-{}", said.of));
            assert!((said.cavity_ml / cavity(*phase) - 1.0).abs() < 1e-3);
            let endings = [
                ("labels", "npy"),
                ("attenuation", "npy"),
                ("inner", "stl"),
                ("outer", "stl"),
            ];
            files.extend(endings.map(|(what, ending)| format!("{what}{name}.{ending}").into()));
        }
        files.push("report.json".into());
        assert_eq!(report.files, files);
    }
}

/// The study's pressures, and those of other phases: increasing with the volume, zero in the reference configuration.
#[test]
fn pressures_are_reported_by_phase() {
    let folder = tempfile::tempdir().unwrap();
    let report = done(small(Mode::Gated { gates: 8 }, &[]), folder.path());
    let told: Vec<&str> = report
        .phases
        .iter()
        .map(|phase| phase.of.as_str())
        .collect();
    assert_eq!(
        (told.len(), told[3], &told[8..]),
        (10, "gate-03", &["end-diastole", "end-systole"][..])
    );
    let [diastole, systole] = [&report.phases[8], &report.phases[9]];
    // Second-order differences: with 101 nodes four digits of the limit.
    assert!((diastole.f_inner / 17.48357527761 - 1.0).abs() < 1e-3);
    assert!((diastole.f_outer / 10.30942447850 - 1.0).abs() < 1e-3);
    assert!(systole.f_inner.abs() < 1e-9 && systole.f_outer.abs() < 1e-9);
    assert_eq!(diastole.thickness, report.numbers.diastolic_thickness);
    for pair in report.phases[..4].windows(2) {
        assert!(pair[0].f_inner < pair[1].f_inner && pair[0].gain < pair[1].gain);
    }
}

/// Counts divided by counts per unit sample are the samples: a total determines the sum of the expected values.
#[test]
fn counts_per_unit_are_reported_by_gate() {
    let folder = tempfile::tempdir().unwrap();
    let scene = small(Mode::Gated { gates: 2 }, &[Product::Projections]);
    let means = Phantom::new(scene.clone()).unwrap();
    let silent = done(scene.clone(), folder.path());
    assert!(
        silent
            .gates
            .iter()
            .all(|gate| gate.counts_per_unit.is_none())
    );
    for (counts, of_gate) in [
        (Counts::Total(1e5), [true; 2]),
        (Counts::PerUnit(7.0), [false; 2]),
    ] {
        let mut scene = scene.clone();
        scene.noise = Some(Noise { counts, seed: 3 });
        let report = done(scene, folder.path());
        for (gate, total) in of_gate.into_iter().enumerate() {
            let per_unit = report.gates[gate].counts_per_unit.unwrap();
            let views = means.sinograms(gate, &no_observer).unwrap().samples;
            let sum: f64 = views.iter().map(|v| f64::from(*v)).sum();
            // The scale of a total has 16 bits.
            let expected = if total { 1e5 / sum } else { 7.0 };
            assert!(
                (per_unit / expected - 1.0).abs() < 0.5f64.powi(16),
                "{per_unit} {expected}"
            );
        }
    }
}

#[test]
fn surfaces_preserve_their_volume_to_the_given_tolerance() {
    let mut triangles = Vec::new();
    for tolerance in [0.05, 1e-3, 3e-5] {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = small(Mode::Static { phase: 0.5 }, &[Product::Meshes]);
        scene.heart.discretisation = DiscretisationSettings::Spectral {
            degree: 12,
            per_piece: 1,
            tolerance: 1e-6,
        };
        scene.output.mesh_tolerance = tolerance;
        let report = done(scene, folder.path());
        let (n, found) = stl_volume(&folder.path().join("inner.stl"));
        let off = (found / report.numbers.edv - 1.0).abs();
        // Coordinates of 32 bits, and a body within 1e-6 cm of the membrane.
        assert!(off < tolerance + 5e-6, "{tolerance} {off}");
        triangles.push(n);
    }
    // 1 / tolerance: twenty times finer, about twenty times as many.
    let grown = [triangles[1] / triangles[0], triangles[2] / triangles[1]];
    assert!(
        grown.iter().all(|times| (5..=80).contains(times)),
        "{triangles:?}"
    );
}

/// No voxel of 3 mm stays in a wall with an ejection fraction of 45 %, but each gate has a wall of its own.
#[test]
fn each_gate_has_its_own_wall() {
    let mut scene = small(Mode::Gated { gates: 16 }, &[]).with_size(64);
    scene.camera.pitch = [0.3; 2];
    scene.cycle.curve = VolumeCurve::Physiological;
    scene.cycle.volume = VolumeRange::EjectionFraction(0.45);
    scene.acquisition.accuracy = Accuracy::Steps(32);
    let phantom = Phantom::new(scene).unwrap();
    assert_eq!(phantom.regions().unwrap().wall.count(), 0);
    for gate in [0, 3, 9, 15] {
        let truth = phantom.truth(gate).unwrap();
        let found = phantom.artefacts(gate, &truth, &truth).unwrap();
        assert!(found.wall_voxels >= 100);
        assert_eq!(found.rmse, Some(0.0));
        assert_eq!(found.streaks_outside, Some(0.0));
        assert_eq!(found.wall_mean, found.wall_mean_truth);
        assert!(found.wall_unevenness.unwrap() < 1e-3);
    }
}

/// Volumes are prescribed: stiffness and law change only the pressure. Numbers of the guide.
#[test]
fn stiffness_and_law_mainly_change_the_pressure() {
    let of = |law: PressureLaw, stiffness: f64| {
        let mut scene = small(Mode::Static { phase: 0.5 }, &[]);
        scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 401 };
        (scene.heart.law, scene.heart.inner.stiffness) = (law, stiffness);
        let phantom = Phantom::new(scene).unwrap();
        let phase = phantom.phase_reports().unwrap().remove(0);
        (phase, phantom.view(0, 3).unwrap())
    };
    let (plain, view) = of(PressureLaw::PerMaterialLength, 1.0);
    let (stiff, of_stiff) = of(PressureLaw::PerMaterialLength, 3.0);
    let (total, of_total) = of(PressureLaw::TotalForce, 1.0);
    let (current, _) = of(PressureLaw::PerCurrentLength, 1.0);
    // Newton's tolerance is about 1e-10 of the size.
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-8;
    assert!(same(stiff.f_inner, 3.0 * plain.f_inner) && same(stiff.f_outer, plain.f_outer));
    assert!(same(total.f_inner, plain.f_inner) && same(total.f_outer, plain.f_outer));
    for other in [of_stiff, of_total] {
        let apart = view.iter().zip(&other).map(|(a, b)| (a - b).abs());
        // Single precision of chords of a few cm.
        assert!(apart.fold(0.0, f32::max) < 2e-6);
    }
    let mm = |a: f64, b: f64| 10.0 * (a - b);
    let apex = mm(current.thickness.apex, plain.thickness.apex);
    let side = mm(current.thickness.side, plain.thickness.side);
    assert!(
        (apex + 0.24).abs() < 0.005 && (side - 0.03).abs() < 0.005,
        "{apex} {side}"
    );
    assert!((10.0 * plain.thickness.apex - 8.3).abs() < 0.05);
}

/// Volumes of a report can be prescribed and are reproduced, for any discretisation of the reference configuration.
#[test]
fn volumes_of_a_report_are_reproduced_by_a_scene() {
    for discretisation in [
        DiscretisationSettings::Differences { nodes: 51 },
        DiscretisationSettings::Spectral {
            degree: 16,
            per_piece: 1,
            tolerance: 1e-4,
        },
    ] {
        let mut scene = Scene::default();
        scene.heart.discretisation = discretisation;
        let first = Phantom::new(scene.clone()).unwrap().numbers().unwrap();
        let (edv, esv) = (first.edv, first.esv);
        scene.cycle.volume = VolumeRange::Volumes { edv, esv };
        let again = Phantom::new(scene).unwrap().numbers().unwrap();
        // To the tolerance of the solver.
        assert!((again.edv / edv - 1.0).abs() < 1e-12 && (again.esv / esv - 1.0).abs() < 1e-12);
    }
}

/// So far from the origin that volumes about it have no accurate digit.
#[test]
fn surfaces_far_away_have_no_more_triangles() {
    let mesh = |shift: f64| {
        let mut scene = Scene::default();
        scene.pose.shift = [shift; 3];
        scene.output.mesh_tolerance = 0.05;
        let phantom = Phantom::new(scene).unwrap();
        phantom.meshes(0.5).unwrap().map(|m| m.triangles.len())
    };
    assert_eq!(mesh(0.0), mesh(1e6));
}

/// The measured ejection fraction is that of the largest and the smallest cavity in the polar maps; one gate has none.
#[test]
fn the_measured_ejection_fraction_is_that_of_the_polar_maps() {
    let write = [Product::Reconstruction, Product::Truth];
    let measured = |gates: usize| {
        let folder = tempfile::tempdir().unwrap();
        done(small(Mode::Gated { gates }, &write), folder.path())
    };
    assert_eq!(measured(1).measured, None);
    let report = measured(3);
    let cavities = |map: fn(&GateReport) -> Option<PolarMap>| {
        let cavity = |gate| map(gate).unwrap().cavity_ml.unwrap();
        report.gates.iter().map(cavity).collect::<Vec<f64>>()
    };
    let found = report.measured.unwrap();
    for (found, cavities) in [
        (found.ejection_fraction, cavities(|gate| gate.polar_map)),
        (
            found.ejection_fraction_truth,
            cavities(|gate| gate.polar_map_truth),
        ),
    ] {
        let most = cavities.iter().copied().fold(0.0, f64::max);
        let least = cavities.iter().copied().fold(f64::INFINITY, f64::min);
        // One subtraction and one division.
        assert!((found.unwrap() - (1.0 - least / most)).abs() < 1e-12);
    }
    // Thirds of a sinusoid have the average heights 1/2 - a and 1/2 + 2 a, with a = sqrt(3) 3 / (8 pi), and the heart a gain of 0.6.
    let [least, most] = [-1.0, 2.0].map(|k| 1.0 + 0.6 * (0.5 + k * 3f64.sqrt() * 3.0 / (8.0 * PI)));
    // Voxels of 5 mm, averaged over a gate.
    let truth = found.ejection_fraction_truth.unwrap();
    assert!((truth - (most - least) / most).abs() < 0.02, "{truth}");
}
