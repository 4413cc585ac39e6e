//! Continuous rotation: reconstructions are at the correct position.

use super::brute;
use heart_phantom::scene::{BlurSettings, DiscretisationSettings, PoseSettings};
use heart_phantom::{Accuracy, Breathing, Mode, Rotation, Scene};
use heart_phantom::{
    Phantom, Product, VolumeCurve, VolumeRange, Warning, WarningKind, no_observer, run,
};

/// A heart 4 cm off the axis before a camera that rotates by 6 degrees in each of 30 views of 3 s.
fn turning(mode: Mode) -> Scene {
    let mut scene = Scene::default().with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    scene.pose = PoseSettings {
        shift: [4.0, 0.0, 0.0],
        ..PoseSettings::default()
    };
    let camera = &mut scene.camera;
    (camera.views, camera.bins, camera.rows) = (30, 128, 40);
    camera.pitch = [0.2, 0.35];
    camera.seconds_per_view = 3.0;
    camera.rotation = Rotation::Continuous;
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene
}

fn small(mode: Mode) -> Scene {
    let mut scene = turning(mode);
    (scene.camera.views, scene.camera.bins, scene.camera.rows) = (3, 32, 10);
    (scene.camera.arc, scene.camera.pitch) = (18.0, [0.8, 1.4]);
    scene.reconstruction.arc = heart_phantom::radon::ArcPolicy::Extend;
    scene
}

const GATES: usize = 4;
const MODES: [Mode; 8] = [
    Mode::Static { phase: 0.0 },
    Mode::Instants,
    Mode::Exposure { seconds: 1e-6 },
    Mode::Exposure { seconds: 0.3 },
    Mode::Exposure { seconds: 1.5 },
    Mode::Exposure { seconds: 3.0 },
    Mode::WholeCycle,
    Mode::Gated { gates: GATES },
];

/// The centre of the heart from the projections: the mean bin of a view is that of the centre of any body, x cos + y sin.
fn centre(phantom: &Phantom, gate: usize) -> [f64; 2] {
    let views = phantom.sinograms(gate, &no_observer).unwrap().samples;
    let geometry = phantom.geometry(gate).unwrap();
    let bins = geometry.n_bins();
    // Normal equations of the least-squares fit.
    let [mut cc, mut cs, mut ss, mut cm, mut sm] = [0.0; 5];
    for (view, angle) in views
        .chunks(phantom.camera().view_len())
        .zip(geometry.angles())
    {
        let [mut sum, mut moment] = [0.0; 2];
        for (k, value) in view.iter().enumerate() {
            sum += f64::from(*value);
            moment += f64::from(*value) * geometry.bin_centre(k % bins);
        }
        let (mean, (sin, cos)) = (moment / sum, angle.sin_cos());
        (cc, cs, ss) = (cc + cos * cos, cs + cos * sin, ss + sin * sin);
        (cm, sm) = (cm + cos * mean, sm + sin * mean);
    }
    let determinant = cc * ss - cs * cs;
    [
        (ss * cm - cs * sm) / determinant,
        (cc * sm - cs * cm) / determinant,
    ]
}

#[test]
fn projections_of_a_static_heart_are_not_rotated_in_any_mode() {
    let mut scene = turning(Mode::Static { phase: 0.0 });
    scene.cycle.volume = VolumeRange::Gain(0.0);
    scene.camera.rotation = Rotation::StepAndShoot;
    let [x, y] = centre(&Phantom::new(scene.clone()).unwrap(), 0);
    assert!(x.hypot(y) > 3.5);
    scene.camera.rotation = Rotation::Continuous;
    for mode in MODES {
        scene.acquisition.mode = mode;
        let phantom = Phantom::new(scene.clone()).unwrap();
        for gate in 0..phantom.n_gates() {
            let [a, b] = centre(&phantom, gate);
            let turned = (b.atan2(a) - y.atan2(x)).to_degrees();
            println!("{mode:?} {gate}: {turned:.5}");
            assert!(
                turned.abs() < 0.02,
                "{mode:?}, gate {gate}: {turned} degrees"
            );
        }
    }
}

/// The same for the reconstruction at the stated angles: its centre is that for a camera in step and shoot at the mean angles. (Other
/// angles give other streaks, which displace the centre by 0.03 degrees.)
#[test]
fn reconstructions_of_a_static_heart_are_not_rotated() {
    let place = |rotation, mode, start: f64| {
        let mut scene = turning(mode);
        scene.cycle.volume = VolumeRange::Gain(0.0);
        scene.camera.rotation = rotation;
        scene.camera.start = start;
        // Enough views that the streaks between them have little weight.
        (scene.camera.views, scene.camera.rows, scene.camera.pitch[1]) = (90, 8, 1.75);
        let phantom = Phantom::new(scene).unwrap();
        let gate = phantom.n_gates() - 1;
        let volume = phantom.volume(gate).unwrap();
        let [nx, ny, _] = phantom.camera().grid().shape();
        let [mut sum, mut mx, mut my] = [0.0; 3];
        for (k, value) in volume.iter().map(|v| f64::from(*v)).enumerate() {
            let [px, py] = phantom.camera().image().pixel_centre(k % nx, k / nx % ny);
            // Beyond the heart there are only streaks, which a moment would weight by their distance.
            if (px - 4.0).hypot(py) < 6.5 {
                (sum, mx, my) = (sum + value, mx + value * px, my + value * py);
            }
        }
        let nominal = phantom.camera().geometry().angles();
        let times = phantom.view_times(gate).unwrap();
        let off: f64 = times
            .iter()
            .zip(nominal)
            .map(|(time, angle)| time.angle - angle)
            .sum();
        (
            (my / sum).atan2(mx / sum).to_degrees(),
            (off / 90.0).to_degrees(),
        )
    };
    for mode in MODES {
        let (turning, off) = place(Rotation::Continuous, mode, 0.0);
        let (still, _) = place(Rotation::StepAndShoot, MODES[0], off);
        println!("{mode:?} {:.5} seen from {off:.3}", turning - still);
        assert!(
            (turning - still).abs() < 0.02,
            "{mode:?}: {turning} and not {still} degrees"
        );
    }
}

/// The projections of one gate.
fn views(scene: &Scene, gate: usize) -> Vec<f32> {
    let phantom = Phantom::new(scene.clone()).unwrap();
    phantom.sinograms(gate, &no_observer).unwrap().samples
}

#[test]
fn short_exposures_converge_to_instants() {
    for rotation in [Rotation::StepAndShoot, Rotation::Continuous] {
        let mut scene = small(Mode::Instants);
        scene.camera.rotation = rotation;
        let instants: Vec<f64> = views(&scene, 0).into_iter().map(f64::from).collect();
        let mut last = f64::INFINITY;
        for seconds in [1e-1, 1e-2, 1e-3, 1e-4, 1e-9, 0.0] {
            scene.acquisition.mode = Mode::Exposure { seconds };
            let found = brute::distance(&views(&scene, 0), &instants);
            println!("{rotation:?} {seconds} {found:.2e}");
            // Rays that touch the surface are square roots of time: a factor of ten gives at least a factor of three. The last errors are
            // the rounding of f32.
            assert!(
                found < (last / 2.5).max(1e-6),
                "{rotation:?} {seconds} s: {found}"
            );
            last = found;
        }
        assert!(last < 1e-6);
    }
}

/// Gates are weighted by their acquisition times: together they give the whole view.
#[test]
fn the_gates_of_continuous_rotation_add_up_to_the_view() {
    let mut last = [f64::INFINITY; 2];
    for steps in [16, 64, 512] {
        let mut scene = small(Mode::WholeCycle);
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        let whole: Vec<f64> = views(&scene, 0).into_iter().map(f64::from).collect();
        scene.acquisition.mode = Mode::Gated { gates: GATES };
        let phantom = Phantom::new(scene.clone()).unwrap();
        let len = phantom.camera().view_len();
        let mut mean = vec![0.0f64; whole.len()];
        for gate in 0..GATES {
            let times = phantom.view_times(gate).unwrap();
            let taken = phantom.sinograms(gate, &no_observer).unwrap().samples;
            for (k, value) in taken.iter().enumerate() {
                mean[k] += times[k / len].window / 3.0 * f64::from(*value);
            }
        }
        let mean: Vec<f32> = mean.into_iter().map(|v| v as f32).collect();
        let apart = brute::distance(&mean, &whole);
        println!("{steps} steps: {apart:.2e}");
        // The gates have the levels of the whole cycle: only their arcs differ, which are equally many for both numbers of steps. Measured:
        // 7e-5 and 2e-5.
        assert!(apart < 1e-4, "{steps} steps: {apart}");
        last = [last[1], apart];
    }
    // 512 steps have four times as many arcs: at order 3/2 a factor of 8, of which 4 is required.
    assert!(last[1] < last[0] / 4.0, "{last:?}");
}

/// Each mode is the average of very many instants, including incomplete beats at the ends of views.
#[test]
fn every_mode_agrees_with_brute_force() {
    let mut volumes = vec![100.0; 12];
    volumes[5..9].copy_from_slice(&[70.0, 50.0, 50.0, 80.0]);
    for curve in [VolumeCurve::Sinusoid, VolumeCurve::Sampled(volumes)] {
        for mode in &MODES[1..] {
            let mut scene = small(*mode);
            scene.cycle.curve = curve.clone();
            scene.acquisition.accuracy = Accuracy::Steps(128);
            let phantom = Phantom::new(scene).unwrap();
            for gate in 0..phantom.n_gates() {
                let taken = phantom.sinograms(gate, &no_observer).unwrap();
                let exact: Vec<f64> = (0..3)
                    .flat_map(|k| brute::view(&phantom, gate, k, 700))
                    .collect();
                let error = brute::distance(&taken.samples, &exact);
                println!("{mode:?} {gate} {error:.2e} {:?}", taken.view_error.time);
                // The reference rounds volumes to 1/1400 of their range; 128 steps are accurate to about 1e-4.
                assert!(error < 4e-4, "{mode:?}, gate {gate}: {error}");
            }
        }
    }
}

/// Simpson's rule over instants of a second scene, which share neither levels nor angles with the average: two views of 2 s and 20 degrees each, a heart
/// of 60 beats per minute behind a response.
#[test]
fn averages_behind_a_response_agree_with_instants() {
    const PER_SECOND: usize = 64;
    const STEP: f64 = 20.0;
    let scene = |mode: Mode, tolerance: f64| {
        let mut scene = small(mode);
        scene.blur = Some(BlurSettings { fwhm: 0.9 });
        scene.cycle.beats_per_minute = 60.0;
        let camera = &mut scene.camera;
        (camera.views, camera.arc, camera.seconds_per_view) = (2, 2.0 * STEP, 2.0);
        (camera.bins, camera.rows, camera.pitch) = (24, 12, [0.8, 1.2]);
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        scene
    };
    let mut moments = scene(Mode::Instants, 1e-3);
    let camera = &mut moments.camera;
    camera.views = 4 * PER_SECOND + 1;
    camera.seconds_per_view = 1.0 / PER_SECOND as f64;
    let turn = STEP / (2 * PER_SECOND) as f64;
    camera.arc = turn * camera.views as f64;
    // An instant is half a step before the angle of its view.
    camera.start += 0.5 * (turn - STEP);
    let moments = Phantom::new(moments).unwrap();
    let images = moments.sinograms(0, &no_observer).unwrap().samples;
    let len = moments.camera().view_len();
    // Average over a window of instants, an even number of intervals.
    let average = |[from, to]: [usize; 2]| -> Vec<f64> {
        let weight = |k: usize| match k {
            _ if k == from || k == to => 1.0,
            _ if (k - from).is_multiple_of(2) => 2.0,
            _ => 4.0,
        };
        let sample = |i: usize| {
            let sum = (from..=to).map(|k| weight(k) * f64::from(images[k * len + i]));
            sum.sum::<f64>() / (3 * (to - from)) as f64
        };
        (0..len).map(sample).collect()
    };
    for (mode, windows) in [
        (Mode::WholeCycle, vec![[0, 128]]),
        (Mode::Gated { gates: 4 }, vec![[16, 32], [80, 96]]),
        (Mode::Exposure { seconds: 0.75 }, vec![[0, 48]]),
    ] {
        let phantom = Phantom::new(scene(mode, 1e-2)).unwrap();
        let made = phantom.sinograms(phantom.n_gates().min(2) - 1, &no_observer);
        let made = made.unwrap();
        for (view_idx, own) in made.samples.chunks(len).enumerate() {
            let parts = windows
                .iter()
                .map(|window| average(window.map(|k| 128 * view_idx + k)));
            let sum = parts.reduce(|a, b| a.iter().zip(b).map(|(a, b)| a + b).collect());
            let n = windows.len() as f64;
            let exact: Vec<f64> = sum.unwrap().iter().map(|v| v / n).collect();
            let (error, stated) = (brute::worst(own, &exact), made.view_error.total());
            println!("{mode:?} {view_idx}: error {error:.1e}, stated {stated:.1e}");
            // The instants have an error of 1e-3 of their own.
            assert!(error <= stated + 1e-3 && stated <= 1e-2, "{error} {stated}");
        }
    }
}

/// The average over 600 beats, of which 256 are represented, equals that over 200 beats, all of which are, if the camera turns by the same angle.
#[test]
fn a_view_of_many_beats_behind_a_response_is_that_of_fewer() {
    let taken = |beats: f64| {
        let mut scene = small(Mode::Gated { gates: 4 });
        scene.blur = Some(BlurSettings { fwhm: 0.9 });
        scene.cycle.beats_per_minute = 60.0;
        let camera = &mut scene.camera;
        (camera.views, camera.arc, camera.seconds_per_view) = (2, 40.0, beats);
        (camera.bins, camera.rows, camera.pitch) = (24, 12, [0.8, 1.2]);
        scene.acquisition.accuracy = Accuracy::Tolerance(1e-2);
        let phantom = Phantom::new(scene).unwrap();
        phantom.sinograms(1, &no_observer).unwrap().samples
    };
    let [few, many] = [200.0, 600.0].map(taken);
    let few: Vec<f64> = few.into_iter().map(f64::from).collect();
    // The gate is 1/8 of a beat before the middle of the beat, and a beat is 20/200 or 20/600 degrees: the mean angles differ by 0.008 degrees, which
    // moves a point at 3 cm from the axis by 4e-4 cm. A blurred edge changes by 1.04 of its height per cm: 5e-4. The limit is four times as large.
    assert!(brute::worst(&many, &few) < 2e-3);
}

/// Each view against the average of 400 views at the middles of as many parts of its arc.
#[test]
fn a_static_heart_meets_the_tolerance_in_continuous_rotation() {
    const VIEWS: usize = 4;
    const PARTS: usize = 400;
    let mut scene = turning(Mode::Static { phase: 0.3 });
    (scene.camera.bins, scene.camera.rows, scene.camera.views) = (40, 36, VIEWS);
    scene.camera.pitch = [0.4; 2];
    let mut standing = scene.clone();
    standing.camera.rotation = Rotation::StepAndShoot;
    standing.camera.views = VIEWS * PARTS;
    let step = scene.camera.arc / VIEWS as f64;
    standing.camera.start += step * (0.5 / PARTS as f64 - 0.5);
    let taken = |scene| {
        Phantom::new(scene)
            .unwrap()
            .sinograms(0, &no_observer)
            .unwrap()
    };
    let parts = taken(standing).samples;
    let len = 40 * 36;
    let exact = |view: usize, k: usize| -> f64 {
        let of = |part: usize| f64::from(parts[(view * PARTS + part) * len + k]);
        (0..PARTS).map(of).sum::<f64>() / PARTS as f64
    };
    let off = |scene: Scene| {
        let seen = taken(scene);
        let [mut difference, mut all] = [0.0; 2];
        for (i, value) in seen.samples.iter().enumerate() {
            let exact = exact(i / len, i % len);
            difference += (f64::from(*value) - exact).powi(2);
            all += exact * exact;
        }
        ((difference / all).sqrt(), seen.view_error.time)
    };
    for tolerance in [3e-2, 3e-3] {
        scene.acquisition.accuracy = Accuracy::Tolerance(tolerance);
        let (off, stated) = off(scene.clone());
        println!("{tolerance}: error {off:e}, stated {stated:e}");
        assert!(off <= tolerance && stated <= tolerance);
    }
    let mut last = f64::INFINITY;
    for steps in [8, 32, 128] {
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        let (off, stated) = off(scene.clone());
        println!("{steps} steps: error {off:e}, stated {stated:e}");
        // At order 3/2 four times the steps give a factor 8; flat faces parallel to the rays reduce it.
        assert!(off < stated && off < last / 3.0);
        last = off;
    }
}

/// Formats with even steps only store the uneven angles of gates as even ones, with a warning.
#[test]
fn gates_of_continuous_rotation_are_written_to_files_of_even_steps_with_a_warning() {
    use heart_phantom::files::Format;
    for format in [
        Format::InterfileStir,
        Format::InterfileSimind,
        Format::Dicom,
    ] {
        let mut scene = crate::phantom::small(Mode::Gated { gates: 2 }).with_size(8);
        scene.camera.rotation = Rotation::Continuous;
        scene.camera.seconds_per_view = 1.3;
        scene.output.write = vec![Product::Projections];
        scene.output.projections = format;
        let phantom = Phantom::new(scene).unwrap();
        let warnings = phantom.warnings().unwrap();
        let uneven = |warning: &Warning| warning.what == WarningKind::UnevenAngles;
        assert!(warnings.iter().any(uneven), "{format:?}: {warnings:?}");
        let folder = tempfile::tempdir().unwrap();
        run(&phantom, folder.path(), &no_observer).unwrap();
    }
}

/// Views of whole beats and breaths have the same phases, and as many points each, however late they start.
#[test]
fn later_views_have_no_more_points() {
    let mut scene = small(Mode::WholeCycle);
    scene.cycle.beats_per_minute = 60.0;
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.0, -1.0],
        period: 3.0,
        ..Breathing::default()
    });
    let rays = |view_idx: usize| {
        let phantom = Phantom::new(scene.clone()).unwrap();
        phantom.view(0, view_idx).unwrap();
        let work = phantom.work();
        work.rays_cast + work.rays_skipped
    };
    assert_eq!(rays(0), rays(2));
}
