//! Phantoms from parts: those of a scene have its bits, and those of any heart hold what they should.

use heart_phantom::membrane_newton::membrane_forces::PressureLaw;
use heart_phantom::membrane_newton::{Discretisation, Membrane, RestShape};
use heart_phantom::radon::{FbpOptions, Window};
use heart_phantom::revolve_voxel::{EllipticCylinder, Pose};
use heart_phantom::scene::{
    AttenuationSettings, BackgroundSettings, BlurSettings, DefectSettings, DiscretisationSettings,
    MediumSettings, Scene,
};
use heart_phantom::{
    Accuracy, Attenuation, Background, Balloon, Camera, Counts, Cycle, Defect, Heart, Mode, Noise,
    Orbit, Phantom, PhantomError, PhantomParts, VolumeCurve, WallRegion, run,
};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_4, PI};

#[path = "../../examples/own_heart.rs"]
#[allow(dead_code)] // its `main` is called, as a test
mod own_heart;

#[test]
fn the_example_runs() {
    own_heart::main().unwrap();
}

fn scene(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_size(24).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 60 };
    scene.camera.views = 12;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.background = Some(BackgroundSettings {
        concentration: 0.1,
        centre: [0.5, 0.0],
        semi_axes: [9.0, 8.0],
    });
    scene.defects = vec![DefectSettings {
        layers: [0.0, 0.6],
        s: [0.1, 0.4],
        azimuths_degrees: [30.0, 120.0],
        activity: 0.3,
    }];
    scene.attenuation = Some(AttenuationSettings {
        coefficient: 0.15,
        medium: MediumSettings::Torso {
            centre: [0.0, 1.0],
            semi_axes: [14.0, 10.0],
        },
    });
    scene.blur = Some(BlurSettings { fwhm: 0.9 });
    scene.noise = Some(Noise {
        counts: Counts::Total(1e5),
        seed: 7,
    });
    scene.reconstruction.window = Window::Hann;
    scene.reconstruction.cutoff = 0.8;
    scene
}

/// The same by hand.
fn parts(mode: Mode) -> PhantomParts {
    let pose = Pose::axis_along_z((Balloon::OUTER.length + Balloon::OUTER.radius) / 2.0)
        .and_then(|pose| pose.turned_x(FRAC_PI_4)?.turned_y(FRAC_PI_4))
        .unwrap();
    let heart = Heart::new(Balloon::INNER, Balloon::OUTER, 60, pose).unwrap();
    let cycle = Cycle::new(65.0, 0.6).unwrap();
    let mut parts = PhantomParts::new(heart, cycle, Camera::new(12, 24, 16.0).unwrap());
    parts.mode = mode;
    parts.accuracy = Accuracy::Steps(8);
    parts.background = Some(Background {
        torso: EllipticCylinder::new([0.5, 0.0], [9.0, 8.0]).unwrap(),
        concentration: 0.1,
    });
    parts.defects = vec![Defect {
        region: WallRegion {
            layers: [0.0, 0.6],
            s: [0.1, 0.4],
            azimuths: [30f64.to_radians(), 120f64.to_radians()],
        },
        activity: 0.3,
    }];
    parts.attenuation = Some(Attenuation {
        coefficient: 0.15,
        torso: Some(EllipticCylinder::new([0.0, 1.0], [14.0, 10.0]).unwrap()),
    });
    parts.blur = Some(0.9);
    parts.noise = Some(Noise {
        counts: Counts::Total(1e5),
        seed: 7,
    });
    parts.reconstruction = FbpOptions::default()
        .with_window(Window::Hann)
        .with_cutoff(0.8);
    // The middle of the inner cylinder: half its length of two lengths and half a circle.
    let Balloon { length, radius, .. } = Balloon::INNER;
    parts.side = 0.5 * length / (2.0 * length + PI * radius);
    parts
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|sample| sample.to_bits()).collect()
}

#[test]
fn parts_have_the_bits_of_their_scene() {
    for mode in [
        Mode::Static { phase: 0.3 },
        Mode::Instants,
        Mode::Exposure { seconds: 0.4 },
        Mode::WholeCycle,
        Mode::Gated { gates: 3 },
    ] {
        let of_scene = Phantom::new(scene(mode)).unwrap();
        let by_hand = Phantom::from_parts(parts(mode)).unwrap();
        assert!(of_scene.scene().is_some() && by_hand.scene().is_none());
        assert_eq!(of_scene.n_gates(), by_hand.n_gates());
        let gate = of_scene.n_gates() - 1;
        let both = [&of_scene, &by_hand];
        let [a, b] = both.map(|phantom| phantom.sinograms(gate, &|_| ()).unwrap());
        assert_eq!(bits(&a.samples), bits(&b.samples), "{mode:?}");
        assert_eq!(
            (a.angles, a.quadrature_error),
            (b.angles, b.quadrature_error)
        );
        for of in [
            |phantom: &Phantom, gate| phantom.slice(gate, 11).unwrap(),
            |phantom: &Phantom, gate| phantom.truth(gate).unwrap(),
            |phantom: &Phantom, _| phantom.attenuation(0.2).unwrap(),
        ] {
            let [a, b] = both.map(|phantom| bits(&of(phantom, gate)));
            assert_eq!(a, b, "{mode:?}");
        }
        let [a, b] = both.map(|phantom| {
            let (volume, truth) = (phantom.volume(gate).unwrap(), phantom.truth(gate).unwrap());
            let artefacts = phantom.artefacts(gate, &volume, &truth).unwrap();
            let (labels, numbers) = (phantom.labels(0.4).unwrap(), phantom.numbers().unwrap());
            (
                artefacts,
                labels,
                numbers,
                phantom.memory(),
                phantom.view_times(gate).unwrap(),
            )
        });
        assert_eq!(a, b, "{mode:?}");
    }
}

/// What `run` writes of parts is what it writes of the scene; their report has no scene.
#[test]
fn a_run_of_parts_writes_the_files_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let mode = Mode::Static { phase: 0.3 };
    let [a, b] = ["scene", "parts"].map(|name| folder.path().join(name));
    let of_scene = run(&Phantom::new(scene(mode)).unwrap(), &a, &|_| ()).unwrap();
    let by_hand = run(&Phantom::from_parts(parts(mode)).unwrap(), &b, &|_| ()).unwrap();
    assert_eq!(of_scene.files, by_hand.files);
    for file in of_scene
        .files
        .iter()
        .filter(|file| !file.ends_with("report.json"))
    {
        let [a, b] = [&a, &b].map(|folder| std::fs::read(folder.join(file)).unwrap());
        assert_eq!(a, b, "{}", file.display());
    }
    assert!(of_scene.scene.is_some() && by_hand.scene.is_none());
    assert_eq!(of_scene.numbers, by_hand.numbers);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// A balloon's length is that of its cylinder and its radius to the last bit: what scales with it keeps its bits.
    #[test]
    fn the_length_of_a_balloon_is_exact(h in 0.1..50.0f64, r in 0.1..20.0f64, nodes in 11..60usize) {
        let outer = Balloon { length: h, radius: r, stiffness: 1.0 };
        let inner = Balloon { length: 0.9 * h, radius: 0.8 * r, stiffness: 1.0 };
        let heart = Heart::new(inner, outer, nodes, Pose::identity()).unwrap();
        prop_assert_eq!(heart.length(), h + r);
    }
}

const SIZE: usize = 64;
const FIELD: f64 = 20.0;
const WALL: f64 = 1.5;

/// Nodes of half an ellipse from the base over the apex.
fn half_ellipse(a: f64, b: f64) -> Vec<[f64; 2]> {
    (0..=80)
        .map(|k| PI * (0.5 - f64::from(k) / 80.0))
        .map(|t| [a * t.cos(), b * t.sin()])
        .collect()
}

/// Half ellipsoids, stiffer at the apex by nothing but their form, under a total force, with a beat of seven samples.
fn own(discretisation: Discretisation, tolerance: f64) -> PhantomParts {
    let membrane = |a, b| {
        let rest = match discretisation {
            Discretisation::Spectral { .. } => RestShape::balloon(a - b, b).unwrap(),
            _ => RestShape::polyline(&half_ellipse(a, b)).unwrap(),
        };
        Membrane::new(rest).with_law(PressureLaw::TotalForce)
    };
    let pose = Pose::axis_along_z(4.0)
        .and_then(|pose| pose.turned_x(0.9)?.turned_y(-0.4))
        .unwrap();
    let membranes = [membrane(7.5, 2.2), membrane(8.7, 3.1)];
    let membranes = [&membranes[0], &membranes[1]];
    let heart = Heart::of_membranes(membranes, discretisation, tolerance, pose).unwrap();
    let curve = VolumeCurve::Sampled(vec![9.0, 7.5, 4.0, 3.0, 6.0, 8.0, 8.5]);
    let cycle = Cycle::with_curve(80.0, &curve, [0.1, 0.7]).unwrap();
    let camera = Camera::new(8, SIZE, FIELD).unwrap();
    let mut parts = PhantomParts::new(heart, cycle, camera);
    parts.activity = [0.0, WALL].into();
    parts
}

const NODES: Discretisation = Discretisation::FiniteDifferences { nodes: 81 };
const SPECTRAL: Discretisation = Discretisation::Spectral {
    degree: 10,
    per_piece: 2,
};

/// The volume that a polygon encloses when it is revolved: a sum of cut cones.
fn volume(points: &[[f64; 2]]) -> f64 {
    let half = &points[..=points.len() / 2];
    half.windows(2)
        .map(|pair| {
            let [[x, r], [to, s]] = [pair[0], pair[1]];
            PI / 3.0 * (to - x) * (r * r + r * s + s * s)
        })
        .sum()
}

/// The activity that a view holds.
fn total(view: &[f32]) -> f64 {
    let pitch = FIELD / SIZE as f64;
    view.iter().map(|&sample| f64::from(sample)).sum::<f64>() * pitch * pitch
}

/// Rays at the middles of bins of 0.31 cm sum smooth chords well; the roots of chords at the edges of the shadow leave up to 3.0e-3
/// (measured).
const SUM: f64 = 4e-3;

#[test]
fn views_of_an_own_heart_hold_its_wall_and_its_defect() {
    let wall = volume(&half_ellipse(8.7, 3.1)) - volume(&half_ellipse(7.5, 2.2));
    for mode in [
        Mode::Static { phase: 0.4 },
        Mode::Instants,
        Mode::WholeCycle,
        Mode::Gated { gates: 2 },
    ] {
        for share in [0.0, 0.4] {
            let mut parts = own(NODES, 0.0);
            parts.mode = mode;
            parts.accuracy = Accuracy::Steps(8);
            if share > 0.0 {
                // The inner part of all of the wall, over a quarter turn: so much of its volume, at every phase.
                parts.defects.push(Defect {
                    region: WallRegion {
                        layers: [0.0, share],
                        s: [0.0, 0.5],
                        azimuths: [0.3, 0.3 + 0.5 * PI],
                    },
                    activity: 0.1,
                });
            }
            let phantom = Phantom::from_parts(parts).unwrap();
            let expected = WALL * wall * (1.0 + 0.25 * share * (0.1 - 1.0));
            for gate in 0..phantom.n_gates() {
                for view_idx in [0, 3, 7] {
                    let found = total(&phantom.view(gate, view_idx).unwrap());
                    assert!(
                        (found / expected - 1.0).abs() < SUM,
                        "{mode:?} {share}: {found} {expected}"
                    );
                }
                // Voxels hold it to their tolerance, a thousandth of those that a surface cuts.
                let truth = phantom.truth(gate).unwrap();
                let pitch = FIELD / SIZE as f64;
                let held = total(&truth) * pitch;
                assert!((held / expected - 1.0).abs() < 1e-3, "{held} {expected}");
            }
        }
    }
}

#[test]
fn an_own_heart_beats_by_its_own_curve() {
    for (discretisation, tolerance) in [(NODES, 0.0), (SPECTRAL, 1e-4)] {
        let parts = own(discretisation, tolerance);
        let rest = parts.heart.pair().inner().start_measures().volume;
        let phantom = Phantom::from_parts(parts).unwrap();
        let numbers = phantom.numbers().unwrap();
        assert!((numbers.edv / rest - 1.7).abs() < 1e-10);
        assert!((numbers.esv / rest - 1.1).abs() < 1e-10);
        // Samples are at sevenths of the beat; the volume is theirs, from the least (3) to the largest (9).
        for (k, sample) in [9.0, 7.5, 4.0, 3.0, 6.0, 8.0, 8.5].into_iter().enumerate() {
            let [cavity, _] = phantom.shape(k as f64 / 7.0).unwrap().volumes();
            let expected = rest * (1.1 + 0.6 * (sample - 3.0) / 6.0);
            assert!(
                (cavity / expected - 1.0).abs() < 1e-10,
                "{k}: {cavity} {expected}"
            );
        }
    }
}

#[test]
fn an_own_heart_is_attenuated_blurred_and_counted() {
    let still = |change: &dyn Fn(&mut PhantomParts)| {
        let mut parts = own(NODES, 0.0);
        parts.mode = Mode::Static { phase: 0.4 };
        parts.activity = [WALL, WALL].into();
        change(&mut parts);
        Phantom::from_parts(parts).unwrap().view(0, 2).unwrap()
    };
    let plain = still(&|_| ());
    let beats_later = still(&|parts| parts.mode = Mode::Static { phase: 2.4 });
    assert_eq!(plain, beats_later);
    // Of a convex body of one activity and one attenuation a ray's chord L tells all: a (1 - exp(-mu L)) / mu.
    let (mu, torso) = (0.3, None);
    let weak = still(&|parts| {
        let coefficient = mu;
        parts.attenuation = Some(Attenuation { coefficient, torso });
    });
    for (seen, unweakened) in weak.iter().zip(&plain) {
        let chord = f64::from(*unweakened) / WALL;
        let expected = WALL * (1.0 - (-mu * chord).exp()) / mu;
        // Both are f32.
        assert!((f64::from(*seen) - expected).abs() < 1e-6 * (1.0 + expected));
    }
    assert!(total(&weak) < 0.7 * total(&plain));
    // The tails beyond the detector, which is twice as wide as the heart, are below 1e-9.
    let blurred = still(&|parts| parts.blur = Some(1.2));
    assert!((total(&blurred) / total(&plain) - 1.0).abs() < 1e-6);
    let most = |view: &[f32]| view.iter().copied().fold(0.0, f32::max);
    assert!(most(&blurred) < 0.99 * most(&plain));
    // Counts are whole numbers, and their sum is within five standard deviations.
    let per_unit = 40.0;
    let counted = still(&|parts| {
        let counts = Counts::PerUnit(per_unit);
        parts.noise = Some(Noise { counts, seed: 3 });
    });
    let sum = |view: &[f32]| view.iter().map(|&v| f64::from(v)).sum::<f64>() * per_unit;
    assert!((sum(&counted) - sum(&plain)).abs() < 5.0 * sum(&plain).sqrt());
    for sample in counted {
        let count = f64::from(sample) * per_unit;
        assert!((count - count.round()).abs() < 1e-4 * (1.0 + count));
    }
}

#[test]
fn parts_that_make_no_sense_are_refused() {
    let refused = |change: &dyn Fn(&mut PhantomParts)| {
        let mut parts = parts(Mode::WholeCycle);
        change(&mut parts);
        Phantom::from_parts(parts).unwrap_err()
    };
    type Change<'a> = &'a dyn Fn(&mut PhantomParts);
    let out_of_range: [(&str, Change); 11] = [
        ("activity of the wall", &|p| p.activity = [0.0, -1.0].into()),
        ("activity of the background", &|p| {
            p.background.as_mut().unwrap().concentration = f64::NAN
        }),
        ("layers of a defect", &|p| {
            p.defects[0].region.layers = [0.5, 0.5]
        }),
        ("s of a defect", &|p| p.defects[0].region.s = [0.1, 0.6]),
        ("azimuths of a defect", &|p| {
            p.defects[0].region.azimuths = [0.0, 90.0]
        }),
        ("activity of a defect", &|p| p.defects[0].activity = -0.1),
        ("attenuation", &|p| {
            p.attenuation.as_mut().unwrap().coefficient = -1.0
        }),
        ("counts", &|p| {
            p.noise.as_mut().unwrap().counts = Counts::PerUnit(0.0)
        }),
        ("truth tolerance", &|p| p.truth_tolerance = 0.0),
        ("side", &|p| p.side = 0.5),
        ("radius of the camera", &|p| {
            p.orbit = Orbit::Circle(f64::INFINITY)
        }),
    ];
    for (quantity, change) in out_of_range {
        let error = refused(change);
        assert!(
            matches!(&error, PhantomError::OutOfRange { what, .. } if *what == quantity),
            "{quantity}: {error:?}"
        );
    }
    let error = refused(&|p| p.accuracy = Accuracy::Steps(0));
    assert!(matches!(error, PhantomError::Count { what: "steps", .. }));
    let error = refused(&|p| p.accuracy = Accuracy::Steps(7));
    assert!(matches!(error, PhantomError::Odd { given: 7, .. }));
    let error = refused(&|p| p.mode = Mode::Gated { gates: 0 });
    assert!(matches!(error, PhantomError::Count { what: "gates", .. }));
    let error = refused(&|p| p.defects = vec![p.defects[0]; 300]);
    assert!(matches!(
        error,
        PhantomError::Count {
            what: "defects",
            ..
        }
    ));
    let error = refused(&|p| p.blur = Some(100.0));
    assert!(matches!(error, PhantomError::Radon(_)), "{error:?}");
    let error = refused(&|p| p.output.projections = heart_phantom::files::Format::Nifti);
    assert!(matches!(error, PhantomError::Unsupported { .. }));
    let error = refused(&|p| {
        p.attenuation = None;
        p.output.write.push(heart_phantom::Product::Attenuation);
    });
    assert!(matches!(error, PhantomError::Absent { .. }));
}

/// A copy of a heart has the shapes that were solved for it.
#[test]
fn copies_of_parts_solve_no_shape_again() {
    let parts = Scene::default().with_size(24).parts().unwrap();
    let mut noisy = parts.clone();
    noisy.noise = Some(Noise {
        counts: Counts::PerUnit(100.0),
        seed: 1,
    });
    let [plain, noisy] = [parts, noisy].map(|parts| Phantom::from_parts(parts).unwrap());
    let means = plain.view(0, 0).unwrap();
    let solved = plain.work().shapes_solved;
    assert!(noisy.view(0, 0).unwrap() != means);
    assert_eq!(noisy.work().shapes_solved, solved);
}
