//! The heart, its camera, its walls, its files.

use super::{ODD, SIZES, back, pairs};
use heart_phantom::files::{self, Format, Projections, Volume, write_npy};
use heart_phantom::{
    Accuracy, Activity, Balloon, Cycle, Defect, Heart, ImageQuality as Quality, MaterialPoint,
    Mode, Phantom, PhantomError, Scene, VolumeCurve, VolumeRange, Wall, no_observer,
};
use membrane_newton::{MembraneError, NewtonError};
use nalgebra::Point3;
use radon::RadonError;
use revolve_voxel::{ParallelDetector, VoxelGrid};
use std::path::Path;

#[test]
fn heart_phantom_accepts_any_input() {
    let heart = Heart::study(21).expect("nodes enough");
    let mut small = Scene::default().with_size(6);
    small.camera.views = 4;
    let phantom = Phantom::with_heart(small, heart.clone()).expect("a phantom");
    let mut cycles = vec![Cycle::new(65.0, &VolumeCurve::Sinusoid, [0.0, 0.1]).expect("a cycle")];
    for [a, b] in pairs() {
        cycles.extend(back(Cycle::new(a, &VolumeCurve::Sinusoid, [0.0, b])));
        cycles.extend(back(Cycle::new(60.0, &VolumeCurve::Physiological, [a, b])));
        let sampled = VolumeCurve::Sampled(vec![a, b, 1.0, 2.0]);
        cycles.extend(back(Cycle::new(60.0, &sampled, [0.0, 0.1])));
        let mut scene = Scene::default().with_size(3);
        scene.camera.pitch = [a, b];
        scene.camera.seconds_per_view = a;
        back(scene.check());
        let range = VolumeRange::Gain(a);
        back(range.gains(b));
        let fraction = VolumeRange::EjectionFraction(a);
        back(fraction.gains(b));
        let balloon = Balloon {
            length: a,
            radius: b,
            stiffness: 1.0,
        };
        back(balloon.membrane());
        back(heart.shapes(&[a]));
        for mode in [
            Mode::Static { phase: a },
            Mode::Instants,
            Mode::Exposure { seconds: b },
            Mode::Gated { gates: 0 },
        ] {
            let mut scene = Scene::default().with_size(6).with_mode(mode);
            scene.acquisition.accuracy = Accuracy::Steps(SIZES[2]);
            scene.activity = Activity::from([b, 1.0]);
            scene.truth.tolerance = b;
            if let Some(phantom) = back(Phantom::with_heart(scene, heart.clone())) {
                back(phantom.sinograms(0, &no_observer));
                back(phantom.truth(0));
            }
        }
    }
    back(Cycle::new(60.0, &VolumeCurve::Sampled(vec![]), [0.0, 0.1]));
    for cycle in &cycles {
        for phase in ODD {
            let _ = cycle.gain(phase);
            let _ = cycle.phase(phase);
        }
        let _ = cycle.period();
        let _ = cycle.extreme_phases();
    }
    for n in SIZES {
        if n > 3 {
            let refused = Heart::study(n);
            assert!(matches!(
                refused,
                Err(PhantomError::Membrane(NewtonError::Membrane(MembraneError::TooMany { given, .. }))) if given == n
            ));
        }
        for size in [[n, 3], [2, n]] {
            let mut scene = Scene::default();
            [scene.camera.views, scene.camera.bins] = size;
            scene.camera.rows = size[1];
            back(scene.check());
        }
    }
    let regions = phantom.regions().expect("regions");
    for n in [0, 1, 6 * 6 * 6 - 1, 2 * 6 * 6 * 6] {
        let volume = vec![f32::NAN; n];
        for refused in [
            Quality::of(&volume, None, regions),
            Quality::of(&[0.0; 216], Some(&volume), regions),
        ] {
            assert!(
                matches!(refused, Err(PhantomError::WrongLength { given, expected: 216, .. }) if given == n)
            );
        }
    }
    walls(&heart);
    phantoms();
}

fn walls(heart: &Heart) {
    let shapes = heart.shapes(&[0.0, 0.1]).expect("two shapes");
    let of = |k: usize| Wall::new(shapes[k].solution(), *heart.pose()).expect("a wall");
    let (wall, other) = (of(0), of(1).sliding_from(&of(0)));
    let grid = VoxelGrid::cube(3, 1.0).expect("voxels");
    for [a, b] in pairs() {
        let point = MaterialPoint {
            layer: a,
            s: b,
            azimuth: 0.0,
        };
        back(wall.position(&point));
        back(wall.deformation(&other, &point));
        let _ = wall.locate(&Point3::new(a, b, 0.0));
        let _ = wall.thickness(a);
        for region in [
            Defect {
                layers: [a, b],
                s: [0.0, 0.3],
                azimuths_degrees: [0.0, 57.0],
                activity: 0.0,
            },
            Defect {
                layers: [0.0, 1.0],
                s: [a, b],
                azimuths_degrees: [b, a],
                activity: 0.0,
            },
        ] {
            back(wall.sector(&region, 0.1));
            back(wall.sector(&region, a));
        }
        back(wall.region([a, 1.0], [0.0, b], 0.1));
    }
    for start in SIZES {
        for end in SIZES {
            back(wall.displacements(&other, &grid, start..end));
        }
    }
}

fn phantoms() {
    let scene = Scene::default().with_size(6);
    let phantom = Phantom::new(scene).expect("the study, small");
    for n in SIZES {
        back(phantom.view(n, n));
        back(phantom.slice(0, n.max(6)));
        back(phantom.slice(n.max(1), 0));
        back(phantom.truth_slice(n.max(1), n));
        back(phantom.solve(n));
        let refused = phantom.reconstruct(0, &vec![0.0; n.min(5)]);
        assert!(
            matches!(refused, Err(PhantomError::Radon(RadonError::WrongLength { given, .. })) if given == n.min(5)),
            "{refused:?}"
        );
        back(Phantom::new(Scene::default().with_size(n.max(1 << 33))));
    }
    for phase in ODD {
        back(phantom.shape(phase));
        back(phantom.activity(phase));
        back(phantom.labels(phase));
        back(phantom.attenuation(phase));
        back(phantom.meshes(phase));
        back(phantom.thickness(phase));
    }
    let refused = phantom.artefacts(0, &[], &[]);
    assert!(matches!(
        refused,
        Err(PhantomError::WrongLength { given: 0, .. })
    ));
    for text in [
        "",
        "=",
        "[",
        "a = 1",
        "[camera]\nviews = -1",
        "\u{0}",
        "[[[[",
    ] {
        back(Scene::from_toml(text));
    }
    let grid = VoxelGrid::cube(2, 1.0).expect("voxels");
    let refused = Volume::new(grid, [0.0_f32; 7].as_slice());
    assert!(matches!(
        refused,
        Err(PhantomError::WrongLength {
            given: 7,
            expected: 8,
            ..
        })
    ));
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["", ".", "a", "a.nii", "a\u{0}.npy", "b.npy"] {
        let path = folder.path().join(name);
        back(write_npy(&path, &[2, usize::MAX], &[0.0; 3]));
        back(write_npy(&path, &[], &[]));
        let volume = Volume::new(grid, [0.5_f32; 8].as_slice()).expect("a volume");
        back(files::write(&path, &volume, Format::Nifti));
    }
    back(write_npy(Path::new(""), &[1], &[0.0]));
    let detector = ParallelDetector::new(2, 2, [1.0; 2]).expect("bins");
    for radius in ODD {
        back(Projections::new(
            detector,
            &[0.0, radius],
            &[radius],
            [0.0_f32; 8].as_slice(),
        ));
    }
}
