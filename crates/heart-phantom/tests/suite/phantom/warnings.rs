//! Truncation warnings against projections by a larger camera.

use super::defects::infarct;
use super::small;
use heart_phantom::scene::ReconstructionSettings;
use heart_phantom::{
    Attenuation, Background, Beats, Breathing, Chest, Compensation, Counts, GateFiles, Medium,
    Mode, Noise, Product, Rotation, RrIntervals, Scene, Twist, radon::ArcPolicy, radon::Window,
};
use heart_phantom::{Method, Osem, Phantom, Uptake, Warning, WarningKind, no_observer};
use revolve_voxel::{Organs, VoxelGrid};

/// Bins and rows of the camera that contains everything, and their pitch in cm.
const LARGE: (usize, f64) = (300, 0.1);

pub(super) fn warnings(scene: &Scene) -> Vec<Warning> {
    Phantom::new(scene.clone()).unwrap().warnings().unwrap()
}

fn kinds(warnings: &[Warning]) -> Vec<WarningKind> {
    warnings.iter().map(|warning| warning.what).collect()
}

/// The farthest nonzero sample of each view along bins and rows, from projections.
fn seen_by_a_large_camera(scene: &Scene) -> Vec<[f64; 2]> {
    let (n, pitch) = LARGE;
    let mut large = scene.clone();
    (large.camera.bins, large.camera.rows, large.camera.pitch) = (n, n, [pitch; 2]);
    let phantom = Phantom::new(large).unwrap();
    let mut farthest = vec![[0.0f64; 2]; phantom.camera().n_views()];
    for gate in 0..phantom.n_gates() {
        let views = phantom.sinograms(gate, &no_observer).unwrap().samples;
        for (k, _) in views.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let place = |index: usize| ((index as f64 - 0.5 * (n as f64 - 1.0)) * pitch).abs();
            let places = [place(k % n), place(k / n % n)];
            let far = &mut farthest[k / n / n];
            *far = [0, 1].map(|a| places[a].max(far[a]));
        }
    }
    farthest
}

fn farthest(views: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|a| views.iter().fold(0.0, |most: f64, far| most.max(far[a])))
}

#[test]
fn a_truncated_heart_is_a_warning_with_the_required_width() {
    let modes = [
        Mode::Static { phase: 0.3 },
        Mode::Gated { gates: 2 },
        Mode::WholeCycle,
    ];
    let mut told = 0;
    for (k, mode) in modes.into_iter().cycle().take(9).enumerate() {
        let mut scene = small(mode);
        let k = k as f64;
        (scene.pose.rotate_x, scene.pose.rotate_y) = (37.0 * k, 20.0 - 41.0 * k);
        scene.pose.shift = [k - 4.0, 0.7 * k, 3.0 - k];
        let views = seen_by_a_large_camera(&scene);
        let [bins, rows] = farthest(&views);
        for warning in warnings(&scene) {
            let (what, available) = (warning.what, warning.numbers["available_cm"]);
            assert_eq!((what, available), (WarningKind::TruncatedHeart, 16.0));
            let far = match warning.key {
                "camera.bins" => bins,
                "camera.rows" => rows,
                _ => panic!("{warning:?}"),
            };
            let needed = warning.numbers["needed_cm"];
            // The centre of the last nonzero sample, or up to one beyond.
            let spare = 0.5 * needed - far;
            assert!((0.0..=LARGE.1).contains(&spare), "{warning}: {far}");
            // The angle of the warning agrees.
            if let Some(angle) = warning.numbers.get("angle_degrees") {
                let view = (angle / 15.0).round() as usize;
                assert!(far - views[view][0] <= LARGE.1, "{warning}");
            }
            told += 1;
        }
        // Every truncation in the projections has its warning.
        for (key, far) in [("camera.bins", bins), ("camera.rows", rows)] {
            let truncated = WarningKind::TruncatedHeart;
            let is_told = |warning: &Warning| warning.what == truncated && warning.key == key;
            let beyond = warnings(&scene).iter().any(is_told);
            assert!(beyond || far < 8.0, "{key} {far}");
            assert!(!beyond || far + LARGE.1 > 8.0, "{key} {far}");
        }
        // The stated width is sufficient.
        if let Some(warning) = warnings(&scene).first() {
            let needed = warning.numbers["needed_cm"];
            let mut scene = scene.clone();
            scene.camera.pitch = [needed * (1.0 + 1e-12) / 40.0; 2];
            let again = warnings(&scene);
            let same = |w: &&Warning| w.numbers["needed_cm"] == needed;
            assert_eq!(again.iter().filter(same).count(), 0, "{again:?}");
            scene.camera.pitch = [needed * (1.0 - 1e-6) / 40.0; 2];
            assert!(!warnings(&scene).is_empty());
        }
    }
    assert!(told > 6, "{told}");
}

#[test]
fn a_background_and_a_torso_wider_than_the_rows_are_warnings() {
    let around = Background {
        concentration: 0.1,
        centre: [1.0, -0.5],
        semi_axes: [9.5, 7.5],
    };
    let mut scene = small(Mode::Static { phase: 0.0 });
    scene.background = Some(around);
    scene.camera.rotation = Rotation::Continuous;
    // A smaller heart than the ellipse.
    scene.activity.wall = Uptake::Concentration(0.1);
    let [far, _] = farthest(&seen_by_a_large_camera(&scene));
    let found = warnings(&scene);
    assert_eq!(found.len(), 1, "{found:?}");
    let kind = (found[0].what, found[0].key);
    assert_eq!(kind, (WarningKind::TruncatedActivity, "camera.bins"));
    let needed = found[0].numbers["needed_cm"];
    let spare = 0.5 * needed - far;
    assert!((0.0..=LARGE.1).contains(&spare), "{needed} {far}");

    // The same ellipse as a medium; no warning without attenuation.
    let torso = |coefficient| Attenuation {
        coefficient,
        medium: Medium::Torso {
            centre: around.centre,
            semi_axes: around.semi_axes,
        },
    };
    let mut other = scene.clone();
    other.attenuation = Some(torso(0.1));
    other.background = None;
    let found = warnings(&other);
    let expected = [WarningKind::TruncatedTorso, WarningKind::Uncorrected];
    assert_eq!(kinds(&found), expected);
    assert_eq!(found[0].numbers["needed_cm"], needed);
    other.attenuation = Some(torso(0.0));
    scene.background = Some(Background {
        concentration: 0.0,
        ..around
    });
    assert_eq!((warnings(&other), warnings(&scene)), (vec![], vec![]));
}

/// Smallest distance of the voxels of the heart from the axis of rotation and from the middle slice, in a large volume.
fn nearest_voxels(scene: &Scene) -> [f64; 2] {
    let (n, pitch) = (100, 0.7);
    let mut large = scene.clone();
    (large.camera.bins, large.camera.rows, large.camera.pitch) = (n, n, [pitch; 2]);
    large.activity.cavity = Uptake::Concentration(1.0);
    let phantom = Phantom::new(large).unwrap();
    let mut nearest = [f64::INFINITY; 2];
    for phase in phantom.cycle().extreme_phases() {
        let volume = phantom.activity(phase).unwrap();
        for (k, _) in volume.iter().enumerate().filter(|(_, v)| **v > 0.0) {
            let place = |index: usize| (index as f64 - 0.5 * (n as f64 - 1.0)) * pitch;
            let [x, y, z] = [k % n, k / n % n, k / n / n].map(place);
            nearest = [nearest[0].min(x.hypot(y)), nearest[1].min(z.abs())];
        }
    }
    nearest
}

#[test]
fn only_hearts_outside_the_views_are_warnings() {
    let mut told = 0;
    for shift in [
        [26.0, 0.0, 0.0],
        [0.0, 0.0, 25.0],
        [0.0, 0.0, -15.0],
        [0.0, 13.0, 0.0],
        [0.0, 15.0, 0.0],
        [10.0, -10.0, 0.0],
        [3.0, 0.0, 11.0],
        [3.0, 0.0, 14.0],
        [-7.0, 0.0, 7.0],
    ] {
        let mut scene = small(Mode::WholeCycle);
        scene.pose.shift = shift;
        let [bins, rows] = nearest_voxels(&scene);
        // Half a voxel, and half of its diagonal, in addition to the error of the directions.
        let spare = [0.5 + 3e-4 * bins, 0.36];
        let warnings = warnings(&scene);
        match &warnings[..] {
            [only] if only.what == WarningKind::OutOfView => {
                let (found, spare) = match only.key {
                    "camera.bins" => (bins, spare[0]),
                    "camera.rows" => (rows, spare[1]),
                    _ => panic!("{only:?}"),
                };
                let [nearest, reach] = ["nearest_cm", "reach_cm"].map(|name| only.numbers[name]);
                assert!(
                    reach == 8.0 && nearest >= 8.0 && (nearest - found).abs() < spare,
                    "{shift:?} {found} {warnings:?}"
                );
                told += 1;
            }
            _ => {
                let outside = kinds(&warnings).contains(&WarningKind::OutOfView);
                assert!(!outside, "{warnings:?}");
                assert!(
                    bins < 8.0 + spare[0] && rows < 8.0 + spare[1],
                    "{shift:?} {bins} {rows}"
                );
            }
        }
    }
    assert!((4..9).contains(&told), "{told}");
    // Above all rows no view contains anything.
    let mut scene = small(Mode::Static { phase: 0.5 });
    scene.pose.shift = [0.0, 0.0, 25.0];
    let views = Phantom::new(scene)
        .unwrap()
        .sinograms(0, &no_observer)
        .unwrap();
    assert!(views.samples.iter().all(|sample| *sample == 0.0));
}

#[test]
fn a_heart_outside_the_torso_is_a_warning_with_its_extent() {
    let torso = |semi_axes: [f64; 2]| {
        let mut scene = small(Mode::Static { phase: 0.5 });
        (scene.pose.rotate_x, scene.pose.rotate_y) = (0.0, 0.0);
        scene.attenuation = Some(Attenuation {
            coefficient: 0.15,
            medium: Medium::Torso {
                centre: [0.0; 2],
                semi_axes,
            },
        });
        scene
    };
    // A heart upright about the axis of the torso extends to its largest radius.
    let shape = Phantom::new(torso([3.0; 2])).unwrap().shape(0.5).unwrap();
    let radius = (shape.curves()[1].iter()).fold(0.0, |most: f64, [_, y]| most.max(*y));
    for share in [0.5, 0.9, 0.999] {
        let warnings = warnings(&torso([share * radius, 7.0]));
        let expected = [WarningKind::OutOfTorso, WarningKind::Uncorrected];
        assert_eq!(kinds(&warnings), expected);
        let times = warnings[0].numbers["times"];
        // 256 vertices of a circle: at most 7.5e-5 too far.
        assert!(
            (0.0..1e-4).contains(&(times * share - 1.0)),
            "{times} {share}"
        );
    }
    let found = warnings(&torso([1.001 * radius, 7.0]));
    assert_eq!(kinds(&found), [WarningKind::Uncorrected]);
    assert_eq!(found[0].numbers["coefficient_per_cm"], 0.15);
    // A medium without attenuation has no effect.
    let mut none = torso([3.0; 2]);
    if let Some(attenuation) = &mut none.attenuation {
        attenuation.coefficient = 0.0;
    }
    assert_eq!(warnings(&none), vec![]);
}

#[test]
fn repeated_directions_are_counted_once() {
    let mut scene = small(Mode::Static { phase: 0.3 });
    (scene.camera.views, scene.camera.arc) = (8, 3600.0);
    scene.reconstruction.arc = ArcPolicy::Extend;
    let few = |scene: &Scene| {
        let found = warnings(scene).into_iter();
        found
            .filter(|warning| warning.what == WarningKind::FewDirections)
            .map(|warning| ["directions", "views"].map(|name| warning.numbers[name]))
            .collect::<Vec<_>>()
    };
    // Steps of 450 degrees: 0 and 90, and both from behind.
    assert_eq!(few(&scene), [[2.0, 8.0]]);
    // A full turn has each direction twice.
    scene.camera.arc = 360.0;
    assert!(few(&scene).is_empty());
    (scene.camera.views, scene.camera.arc) = (1, 180.0);
    assert_eq!(few(&scene).len(), 1);
}

/// An arc of pi "degrees" is reconstructed by OSEM, with a warning; half a turn has none.
#[test]
fn osem_of_a_short_arc_is_a_warning() {
    let mut scene = small(Mode::Static { phase: 0.3 });
    scene.reconstruction.method = Method::Osem(Osem::new(2, 1));
    assert_eq!(warnings(&scene), []);
    scene.camera.arc = std::f64::consts::PI;
    // Twelve views a twelfth of the arc apart, as their directions.
    let gap = (180.0 - 11.0 / 12.0 * scene.camera.arc).to_radians();
    let found = warnings(&scene);
    assert_eq!(kinds(&found), [WarningKind::ShortArc]);
    let off = found[0].numbers["gap_degrees"] - gap.to_degrees();
    assert!(off.abs() < 1e-9, "{found:?}");
}

/// Attenuation that the reconstruction does not model, and values as of another unit.
#[test]
fn uncorrected_attenuation_and_unusual_values_are_warnings() {
    let mut scene = small(Mode::Static { phase: 0.3 });
    let medium = |coefficient| {
        Some(Attenuation {
            coefficient,
            medium: Medium::Heart,
        })
    };
    scene.attenuation = medium(0.15);
    let uncorrected = |scene: &Scene| {
        let found = warnings(scene);
        assert_eq!(kinds(&found), [WarningKind::Uncorrected]);
        assert_eq!(found[0].numbers["coefficient_per_cm"], 0.15);
    };
    uncorrected(&scene);
    let mut osem = Osem::new(2, 1);
    scene.reconstruction.method = Method::Osem(osem);
    uncorrected(&scene);
    osem.attenuation = true;
    scene.reconstruction.method = Method::Osem(osem);
    assert_eq!(warnings(&scene), []);
    // 1/m and 1/s.
    scene.attenuation = medium(15.0);
    scene.cycle.beats_per_minute = 1.1;
    let found = warnings(&scene);
    assert_eq!(kinds(&found), [WarningKind::Unusual; 2]);
    let keys = found.iter().map(|warning| warning.key);
    assert!(keys.eq(["cycle.beats_per_minute", "attenuation.coefficient"]));
}

#[test]
fn settings_without_effect_and_scenes_without_activity_are_warnings() {
    let unused = |scene: &Scene| -> Vec<&str> {
        let found = warnings(scene).into_iter();
        found
            .filter(|warning| warning.what == WarningKind::Unused)
            .map(|warning| warning.key)
            .collect()
    };
    let mut scene = small(Mode::Static { phase: 0.5 });
    (scene.reconstruction.window, scene.reconstruction.cutoff) = (Window::Hann, 0.5);
    assert!(unused(&scene).is_empty());
    scene.reconstruction.method = Method::Osem(Osem::new(2, 1));
    let expected = ["reconstruction.window", "reconstruction.cutoff"];
    assert_eq!(unused(&scene), expected);
    scene.reconstruction = ReconstructionSettings {
        compensation: Compensation::KnownMotion,
        ..ReconstructionSettings::default()
    };
    assert_eq!(unused(&scene), ["reconstruction.compensation"]);
    let mut scene = small(Mode::Static { phase: 0.5 });
    scene.output.write = vec![Product::Truth];
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene.noise = Some(Noise {
        counts: Counts::PerUnit(1.0),
        seed: 1,
    });
    scene.output.gates = GateFiles::OneFile;
    scene.twist = Some(Twist {
        inner_degrees: vec![0.0, 10.0],
        outer_degrees: vec![0.0, 5.0],
    });
    scene.breathing = Some(Breathing::default());
    let expected = [
        "reconstruction.arc",
        "noise",
        "output.gates",
        "twist",
        "breathing",
    ];
    assert_eq!(unused(&scene), expected);
    // Each has an effect.
    scene.output.write = vec![Product::Reconstruction, Product::Motion];
    scene.breathing = Some(Breathing {
        shift: [0.0, 0.0, 1.0],
        ..Breathing::default()
    });
    assert_eq!(unused(&scene), ["output.gates"]);
    let mut scene = small(Mode::Gated { gates: 2 });
    assert!(warnings(&scene).is_empty());
    // counts that do not depend on the time of a view, of equal and of unequal times
    let seed = 1;
    for counts in [Counts::Total(1e4), Counts::PerUnit(10.0)] {
        scene.noise = Some(Noise { counts, seed });
        scene.beats = None;
        assert!(warnings(&scene).is_empty());
        let intervals = RrIntervals::List(vec![0.95, 0.7, 1.15, 0.9, 1.3]);
        scene.camera.seconds_per_view = 8.0;
        scene.beats = Some(Beats {
            accepted: Some([0.8, 1.2]),
            ..Beats::new(intervals)
        });
        let found = warnings(&scene);
        assert_eq!(kinds(&found), [WarningKind::UntimedCounts]);
        let [shortest, longest] = ["shortest_s", "longest_s"].map(|name| found[0].numbers[name]);
        assert!(shortest > 0.0 && longest > 1.01 * shortest);
    }
    let mut scene = small(Mode::Static { phase: 0.5 });
    scene.activity.wall = Uptake::Total(0.0);
    assert_eq!(kinds(&warnings(&scene)), [WarningKind::NoActivity]);
    scene.activity.cavity = Uptake::Concentration(1.0);
    assert!(warnings(&scene).is_empty());
}

/// A healthy twist is followed to the tolerances, one that jumps between two of many samples is not.
#[test]
fn a_steep_twist_of_a_defect_is_a_warning() {
    let mut scene = small(Mode::Static { phase: 0.4 });
    let warns = |scene: &Scene| kinds(&warnings(scene)).contains(&WarningKind::SteepTwist);
    let jump: Vec<f64> = (0..200).map(|k| if k < 100 { 0.0 } else { 90.0 }).collect();
    for (degrees, is_steep) in [(vec![-3.0, 10.0], false), (jump, true)] {
        scene.twist = Some(Twist {
            inner_degrees: degrees.clone(),
            outer_degrees: degrees,
        });
        scene.defects = vec![infarct()];
        assert_eq!(warns(&scene), is_steep);
        scene.defects.clear();
        assert!(!warns(&scene), "no boundaries");
    }
}

/// The study's heart upright, with its wall in the spine of the chest.
#[test]
fn a_heart_in_the_spine_is_a_warning_with_the_volume() {
    let mut scene = small(Mode::Static { phase: 0.5 });
    scene.chest = Some(Chest::default());
    scene.attenuation = Some(Attenuation {
        coefficient: Chest::SOFT_TISSUE,
        medium: Medium::Heart,
    });
    let volume = |scene: &Scene| {
        let mut found = warnings(scene).into_iter();
        let warning = found.find(|warning| warning.what == WarningKind::InBone)?;
        assert_eq!(warning.numbers["organ"], 4.0);
        Some(warning.numbers["volume_ml"])
    };
    let told = volume(&scene).unwrap();
    // Voxels of 2 mm in both.
    let phantom = Phantom::new(scene.clone()).unwrap();
    let body = phantom.shape(0.5).unwrap();
    let organs = Chest::default().organs().unwrap();
    let spine = &organs.as_slice()[4..5];
    let grid = VoxelGrid::cube(120, 0.2).unwrap();
    let spine = Organs::new(spine.to_vec()).unwrap();
    let spine: Vec<f32> = spine.voxelize(&grid, 0..120, |_| 1.0).unwrap();
    let body = body.body();
    let inside = |k: usize| {
        let place = grid.centre(k % 120, k / 120 % 120, k / (120 * 120));
        body.layers()[1].contains(&body.pose().to_body(&place))
    };
    let both: f64 = (spine.iter().enumerate())
        .filter(|(k, fraction)| **fraction > 0.0 && inside(*k))
        .map(|(_, fraction)| f64::from(*fraction))
        .sum();
    let both = both * grid.voxel_volume();
    assert!((told / both - 1.0).abs() < 0.05, "{told} {both}");
    // In front of the spine.
    scene.pose.shift = [0.0, -6.0, 0.0];
    assert_eq!(volume(&scene), None);
}
