//! A phantom computes only requested parts, and each part is bitwise identical to that of the whole.

mod aliased;
mod artefacts;
mod defects;
mod guide;
mod overlaps;
mod polar;
mod surroundings;
mod twin;
mod unsuitable;
mod upright;
mod warnings;

use heart_phantom::scene::{BlurSettings, CycleSettings, DiscretisationSettings, PixelRange};
use heart_phantom::{
    Accuracy, Activity, Attenuation, Background, Counts, Medium, Method, Mode, Noise, Osem, Scene,
};
use heart_phantom::{Phantom, PhantomError, Uptake, VolumeCurve, VolumeRange, no_observer};

pub(crate) use defects::infarct;

pub(crate) fn small(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_size(40).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.camera.views = 12;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.truth.tolerance = 0.01;
    scene
}

#[test]
fn nothing_is_computed_before_it_is_requested() {
    let phantom = Phantom::new(small(Mode::Gated { gates: 4 })).unwrap();
    assert_eq!(phantom.work(), Default::default());
    // One view of one gate: its phases, its rays.
    phantom.view(1, 3).unwrap();
    let work = phantom.work();
    assert_eq!(work.shapes_solved, 3); // phases 1/4, 3/8, 1/2
    assert_eq!(work.rays_cast + work.rays_skipped, 3 * 40 * 40);
    assert_eq!((work.voxels_cut, work.slices_reconstructed), (0, 0));
    // The next gate has the same phases, mirrored: no shape is left to solve.
    phantom.view(2, 3).unwrap();
    assert_eq!(phantom.work().shapes_solved, 3);
    // The numbers need the smallest and the largest heart; the latter is solved.
    phantom.numbers().unwrap();
    assert_eq!(phantom.work().shapes_solved, 4);
}

/// Views of a square detector contain the inscribed circle only; what FBP computes beyond it, here 3 % of the sum, is not an image.
#[test]
fn the_sum_of_a_reconstruction_is_that_of_the_circle_of_all_views() {
    for region in [
        None,
        Some(PixelRange {
            x: [1, 30],
            y: [0, 37],
        }),
    ] {
        let mut scene = small(Mode::Static { phase: 0.3 });
        scene.reconstruction.region = region;
        let phantom = Phantom::new(scene).unwrap();
        let views = phantom.sinograms(0, &no_observer).unwrap().samples;
        let found = phantom.reconstruct(0, &views).unwrap();
        let camera = phantom.camera();
        let options = radon::FbpOptions::default();
        let plan = radon::FbpPlan::new(camera.geometry(), &square(40, camera.pitch()), &options);
        let whole = plan
            .unwrap()
            .reconstruct_stack(&views, 40, radon::StackOrder::ViewSliceBin);
        let whole = whole.unwrap();
        let radius = 20.0 * camera.pitch();
        let (mut sums, mut corners, [nx, ny, _]) = ([0.0; 2], 0.0, camera.grid().shape());
        for (k, value) in found.iter().enumerate() {
            let [x, y, z] = [k % nx, k / nx % ny, k / (nx * ny)];
            let place = camera.grid().centre(x, y, z);
            let [left, low] = region.map_or([0, 0], |own| [own.x[0], own.y[0]]);
            let exact = f64::from(whole[(z * 40 + y + low) * 40 + x + left]);
            match place.x.hypot(place.y) <= radius {
                true => {
                    sums[0] += f64::from(*value);
                    sums[1] += exact;
                }
                false => {
                    assert_eq!(*value, 0.0);
                    corners += exact;
                }
            }
        }
        // The plan of the scene has another order of sums.
        assert!((sums[0] / sums[1] - 1.0).abs() < 1e-5, "{sums:?}");
        assert!(corners.abs() > 0.005 * sums[1], "{corners} {sums:?}");
    }
}

fn square(n: usize, pitch: f64) -> radon::ImageGrid {
    radon::ImageGrid::square(n, pitch).unwrap()
}

#[test]
fn a_slice_costs_a_row_of_each_view_and_is_bitwise_identical_to_the_whole() {
    for mode in [
        Mode::Static { phase: 0.3 },
        Mode::Instants,
        Mode::WholeCycle,
        Mode::Exposure { seconds: 0.4 },
    ] {
        let phantom = Phantom::new(small(mode)).unwrap();
        let volume = phantom.volume(0).unwrap();
        let truth = phantom.truth(0).unwrap();
        for z in [0, 13, 39] {
            let alone = Phantom::new(small(mode)).unwrap();
            assert!(
                alone.slice(0, z).unwrap() == volume[z * 1600..(z + 1) * 1600],
                "{mode:?} {z}"
            );
            let work = alone.work();
            let rays = work.rays_cast + work.rays_skipped;
            let whole = phantom.work().rays_cast + phantom.work().rays_skipped;
            assert_eq!(40 * rays, whole, "{mode:?}");
            assert!(
                alone.truth_slice(0, z).unwrap() == truth[z * 1600..(z + 1) * 1600],
                "{mode:?} {z}"
            );
        }
        let views = phantom.sinograms(0, &no_observer).unwrap().samples;
        assert!(phantom.view(0, 7).unwrap() == views[7 * 1600..8 * 1600]);
    }
}

#[test]
fn results_are_bitwise_independent_of_threads() {
    // A small heart far up: many slices are empty.
    let mut scene = small(Mode::WholeCycle);
    scene.pose.shift = [0.0, 0.0, 3.0];
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let phantom = Phantom::new(scene.clone()).unwrap();
            let volume = phantom.volume(0).unwrap();
            let truth = phantom.truth(0).unwrap();
            let artefacts = phantom.artefacts(0, &volume, &truth).unwrap();
            (
                volume,
                truth,
                artefacts,
                phantom.labels(0.5).unwrap(),
                phantom.work(),
            )
        })
    };
    let one = run(1);
    assert!(one.4.slices_skipped > 0 && one.4.rays_skipped > 0);
    assert!(one == run(2));
    assert!(one == run(3));
}

#[test]
fn numbers_agree_with_the_scene() {
    let numbers = |volume| {
        let mut scene = small(Mode::WholeCycle);
        // Spectral elements: the discrete reference volume equals the closed form.
        scene.heart.discretisation = DiscretisationSettings::Spectral {
            degree: 16,
            per_piece: 1,
            tolerance: 1e-4,
        };
        scene.cycle = CycleSettings {
            volume,
            curve: VolumeCurve::Physiological,
            ..scene.cycle
        };
        Phantom::new(scene).unwrap().numbers().unwrap()
    };
    let of_fraction = numbers(VolumeRange::EjectionFraction(0.4));
    assert!((of_fraction.ejection_fraction - 0.4).abs() < 1e-10);
    assert!((of_fraction.gain - 0.4 / 0.6).abs() < 1e-10);
    let of_volumes = numbers(VolumeRange::Volumes {
        edv: 160.0,
        esv: 110.0,
    });
    assert!((of_volumes.edv - 160.0).abs() < 1e-8 && (of_volumes.esv - 110.0).abs() < 1e-8);
    assert!((of_volumes.stroke_volume - 50.0).abs() < 1e-8);
    assert!((of_volumes.cardiac_output - 50.0 * 65.0 / 1000.0).abs() < 1e-9);
    // In the reference configuration the balloons are concentric, 1 cm apart at the side and at the apex.
    let rest = numbers(VolumeRange::Gain(0.6)).systolic_thickness;
    assert!(
        (rest.side - 1.0).abs() < 2e-4 && (rest.apex - 1.0).abs() < 2e-4,
        "{rest:?}"
    );
    // The same wall on a larger heart is thinner.
    let large = numbers(VolumeRange::Gain(0.6)).diastolic_thickness;
    assert!(large.side < 0.9);
}

#[test]
fn a_tolerance_is_met() {
    let mut scene = small(Mode::WholeCycle);
    let error = |steps: usize| {
        let mut scene = scene.clone();
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        Phantom::new(scene)
            .unwrap()
            .sinograms(0, &no_observer)
            .unwrap()
            .samples
    };
    let exact = error(256);
    let norm = |v: &[f32]| v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
    for tolerance in [0.03, 0.01] {
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        let phantom = Phantom::new(scene.clone()).unwrap();
        let taken = phantom.sinograms(0, &no_observer).unwrap();
        let difference: Vec<f32> = taken
            .samples
            .iter()
            .zip(&exact)
            .map(|(a, b)| a - b)
            .collect();
        let reached = norm(&difference) / norm(&exact);
        assert!(reached <= tolerance, "{reached} {tolerance}");
        // The number of steps is not excessive: doubling it reduces the error by about 2.8.
        assert!(reached > tolerance / 30.0, "{reached} {tolerance}");
    }
    scene.acquisition.accuracy = Accuracy::Tolerance(1e-6);
    let refused = Phantom::new(scene.with_size(8)).unwrap().view(0, 0);
    assert!(matches!(refused, Err(PhantomError::Tolerance { .. })));
}

/// One view in four contains a short dip of the volume between the points of a coarse rule: neither the first nor the middle view, nor the
/// difference between two coarse rules, detects it.
#[test]
fn features_between_time_steps_are_resolved() {
    let mut volumes = vec![100.0; 24];
    volumes[8] = 50.0;
    let mut scene = small(Mode::Exposure { seconds: 0.25 });
    scene.camera.views = 12;
    scene.camera.seconds_per_view = 1.25;
    scene.cycle.beats_per_minute = 60.0;
    scene.cycle.curve = VolumeCurve::Sampled(volumes);
    let taken = |accuracy| {
        let mut scene = scene.clone();
        scene.acquisition.accuracy = accuracy;
        Phantom::new(scene)
            .unwrap()
            .sinograms(0, &no_observer)
            .unwrap()
    };
    let norm = |v: &[f32]| v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt();
    let exact = taken(Accuracy::Steps(1024)).samples;
    for (accuracy, most) in [
        (Accuracy::Steps(8), f64::INFINITY),
        (Accuracy::Tolerance(0.01), 0.01),
        (Accuracy::Tolerance(0.001), 0.001),
    ] {
        let found = taken(accuracy);
        let difference: Vec<f32> = (found.samples.iter().zip(&exact))
            .map(|(a, b)| a - b)
            .collect();
        let error = norm(&difference) / norm(&exact);
        let stated = found.view_error.time;
        assert!(error <= most, "{accuracy:?}: {error}");
        // The volume term of the error measures the average, and does not bound single samples.
        assert!(error <= 2.0 * stated, "{accuracy:?}: {error} {stated}");
    }
}

#[test]
fn spectral_and_difference_hearts_agree() {
    let mut scene = small(Mode::Static { phase: 0.5 });
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 1601 };
    let differences = Phantom::new(scene.clone())
        .unwrap()
        .sinograms(0, &no_observer)
        .unwrap()
        .samples;
    scene.heart.discretisation = DiscretisationSettings::Spectral {
        degree: 16,
        per_piece: 1,
        tolerance: 1e-6,
    };
    let spectral = Phantom::new(scene)
        .unwrap()
        .sinograms(0, &no_observer)
        .unwrap()
        .samples;
    let mut worst = 0.0f32;
    for (a, b) in differences.iter().zip(&spectral) {
        worst = worst.max((a - b).abs());
    }
    // The curves are 1e-5 cm apart; a grazing chord of a wall of radius 3 changes by sqrt(8 R 1e-5).
    assert!(worst < 0.02, "{worst}");
    let mean = differences
        .iter()
        .zip(&spectral)
        .map(|(a, b)| f64::from(a - b).abs())
        .sum::<f64>()
        / differences.len() as f64;
    assert!(mean < 1e-5, "{mean}");
}

#[test]
fn a_region_equals_that_part_of_the_whole() {
    let mut scene = small(Mode::Static { phase: 0.0 });
    let whole = Phantom::new(scene.clone()).unwrap();
    scene.reconstruction.region = Some(PixelRange {
        x: [5, 25],
        y: [11, 31],
    });
    let part = Phantom::new(scene).unwrap();
    assert_eq!(part.camera().grid().shape(), [20, 20, 40]);
    let volumes = |phantom: &Phantom| [phantom.volume(0).unwrap(), phantom.truth(0).unwrap()];
    let (of_whole, of_part) = (volumes(&whole), volumes(&part));
    // Each volume is compared within its own field of view.
    part.artefacts(0, &of_part[0], &of_part[1]).unwrap();
    let other = part.artefacts(0, &of_whole[0], &of_part[1]).unwrap_err();
    assert!(
        matches!(
            other,
            PhantomError::WrongLength {
                given: 64_000,
                expected: 16_000,
                ..
            }
        ),
        "{other:?}"
    );
    for (whole, part) in of_whole.iter().zip(&of_part) {
        for (k, value) in part.iter().enumerate() {
            let (x, y, z) = (k % 20, k / 20 % 20, k / 400);
            let cut = whole[(z * 40 + y + 11) * 40 + x + 5];
            // Pixel positions differ in the last bit; the coverage meets its tolerance in both.
            assert!((value - cut).abs() < 2.1e-3, "{x} {y} {z}: {value} {cut}");
        }
    }
}

#[test]
fn labels_surfaces_and_activity_at_a_phase() {
    let mut scene = small(Mode::WholeCycle);
    scene.activity = Activity {
        cavity: Uptake::Total(10.0),
        wall: Uptake::Concentration(1.0),
    };
    let phantom = Phantom::new(scene).unwrap();
    let voxel = phantom.camera().grid().voxel_volume();
    for phase in [0.0, 0.5] {
        let shape = phantom.shape(phase).unwrap();
        let [inner, outer] = shape.volumes();
        let labels = phantom.labels(phase).unwrap();
        let volume = |label: u8| labels.iter().filter(|&&l| l == label).count() as f64 * voxel;
        // Voxels of 4 mm: the largest fraction is accurate to a few per cent.
        assert!(
            (volume(1) / inner - 1.0).abs() < 0.03
                && (volume(2) / (outer - inner) - 1.0).abs() < 0.03
        );
        let activity = phantom.activity(phase).unwrap();
        let sum: f64 = activity.iter().map(|&v| f64::from(v)).sum::<f64>() * voxel;
        assert!((sum / (10.0 + outer - inner) - 1.0).abs() < 1e-4);
        for (mesh, volume) in phantom.meshes(phase).unwrap().iter().zip([inner, outer]) {
            assert!((mesh.volume() / volume - 1.0).abs() < 0.02);
        }
    }
    for (refused, beyond) in [
        (phantom.view(1, 0).map(drop), 1),
        (phantom.view(0, 12).map(drop), 12),
        (phantom.slice(0, 40).map(drop), 40),
    ] {
        assert!(matches!(refused, Err(PhantomError::Count { given, .. }) if given == beyond));
    }
}

/// In the reference configuration one balloon is within the other; inflated, the short one is rounder and thicker at the middle of the
/// side, where the wall would have a negative thickness.
#[test]
fn crossing_membranes_are_rejected() {
    for discretisation in [
        DiscretisationSettings::Differences { nodes: 101 },
        DiscretisationSettings::Spectral {
            degree: 12,
            per_piece: 1,
            tolerance: 1e-4,
        },
    ] {
        let mut scene = small(Mode::Static { phase: 0.0 });
        scene.heart.discretisation = discretisation;
        scene.heart.outer.length = 14.0;
        scene.heart.outer.radius = 1.77;
        let phantom = Phantom::new(scene).unwrap();
        // Nested in the reference configuration: the thickness is that of the cylinders.
        let still = phantom.thickness(0.0).unwrap();
        assert!((still.side - 0.02).abs() < 1e-3, "{still:?}");
        let shape = phantom.shape(0.5);
        let said = shape
            .as_ref()
            .map_or_else(ToString::to_string, |_| String::new());
        // At most five digits.
        let mut numbers = said.split(|c: char| !c.is_ascii_digit() && c != '.');
        assert!(numbers.all(|number| number.len() <= 8), "{said}");
        match shape {
            Err(PhantomError::Crossed { gain, depth, x, r }) => {
                assert!((gain - 0.6).abs() < 1e-12);
                assert!((0.1..0.3).contains(&depth), "{depth}");
                assert!(
                    (1.0..8.0).contains(&x) && (1.8..3.0).contains(&r),
                    "{x} {r}"
                );
            }
            other => panic!("{other:?}"),
        }
        // Detected before any view, although the views are of the reference configuration.
        let folder = tempfile::tempdir().unwrap();
        let refused = heart_phantom::run(&phantom, folder.path(), &no_observer);
        let Err(PhantomError::Rejected { source, .. }) = refused else {
            panic!("{refused:?}")
        };
        assert!(matches!(*source, PhantomError::Crossed { .. }));
        assert_eq!(phantom.work().rays_cast, 0);
    }
}

#[test]
fn a_total_of_counts_needs_activity_in_the_views() {
    let mut scene = small(Mode::Static { phase: 0.0 });
    scene.pose.shift = [100.0, 0.0, 100.0];
    let seed = 1;
    let counts = Counts::Total(1e5);
    scene.noise = Some(Noise { counts, seed });
    let refused = Phantom::new(scene.clone()).unwrap().view(0, 0);
    assert!(matches!(refused, Err(PhantomError::NoCounts)));
    // Zero samples have zero counts for a given calibration.
    let counts = Counts::PerUnit(10.0);
    scene.noise = Some(Noise { counts, seed });
    let view = Phantom::new(scene).unwrap().view(0, 0).unwrap();
    assert!(view.iter().all(|&count| count == 0.0));
}

/// A computed plan or model of another gate does not make a gate exist.
#[test]
fn gates_that_do_not_exist_are_rejected_before_and_after_a_reconstruction() {
    for method in [Method::Fbp, Method::Osem(Osem::new(2, 1))] {
        let mut scene = small(Mode::Gated { gates: 2 }).with_size(12);
        scene.reconstruction.method = method;
        let phantom = Phantom::new(scene).unwrap();
        let views = phantom.sinograms(0, &no_observer).unwrap().samples;
        let mut volume = vec![0.0; 12 * 12 * 12];
        for _ in 0..2 {
            for rejected in [
                phantom.reconstruct(1000, &views).map(drop),
                (phantom.reconstruct_into(1000, &views, &mut volume, &no_observer)).map(drop),
                phantom.slice(1000, 0).map(drop),
                phantom.volume(1000).map(drop),
            ] {
                assert!(
                    matches!(rejected, Err(PhantomError::Count { given: 1000, .. })),
                    "{rejected:?}"
                );
            }
            phantom.reconstruct(0, &views).unwrap();
        }
    }
}

#[test]
fn the_shapes_of_a_gate_can_be_solved_in_advance() {
    let phantom = Phantom::new(small(Mode::Gated { gates: 4 })).unwrap();
    phantom.solve(1).unwrap();
    let work = phantom.work();
    // Phases 1/4, 3/8, 1/2.
    assert_eq!((work.shapes_solved, work.rays_cast), (3, 0));
    phantom.view(1, 3).unwrap();
    assert_eq!(phantom.work().shapes_solved, 3);
}
