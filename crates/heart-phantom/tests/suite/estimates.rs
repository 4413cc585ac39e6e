//! Estimates of memory against sizes of arrays, for scenes whose numbers of voxels, samples and shapes are known.

use heart_phantom::scene::{DiscretisationSettings, OrganSettings, OrganShapeSettings};
use heart_phantom::{
    Accuracy, Attenuation, BinSample, Breathing, Compensation, Defect, Medium, Method, Mode, Osem,
    Product, RespiratoryGates, Rotation, Scene,
};
use heart_phantom::{Memory, Phantom, Wall, no_observer};

const N: u64 = 16;
const VIEWS: u64 = 8;

/// `N` bins, rows and voxels along each axis, all within twice the size of the heart.
fn scene(mode: Mode, write: &[Product]) -> Scene {
    let mut scene = Scene::default().with_size(N as usize).with_mode(mode);
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 101 };
    (scene.camera.views, scene.camera.pitch) = (VIEWS as usize, [0.8; 2]);
    scene.acquisition.accuracy = Accuracy::Steps(8);
    scene.output.write = write.to_vec();
    scene
}

fn memory(scene: Scene) -> Memory {
    Phantom::new(scene).unwrap().memory()
}

/// Half of the steps of a cycle, and one, are distinct volumes; each defect has a surface of its own.
#[test]
fn shapes_are_counted_with_their_defects_and_searches() {
    let bytes = |steps: usize, defects: usize| {
        let mut scene = scene(Mode::WholeCycle, &[]);
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        scene.defects = vec![
            Defect {
                layers: [0.2, 0.8],
                s: [0.1, 0.4],
                azimuths_degrees: [0.0, 90.0],
                activity: 0.5,
            };
            defects
        ];
        memory(scene).shapes
    };
    let phantom = Phantom::new(scene(Mode::WholeCycle, &[])).unwrap();
    let each = phantom.heart().shape_bytes() as u64;
    // 490 bytes for each cone of the defect in the largest heart, as `tests/memory.rs` measures.
    let heart = phantom.heart();
    let largest = heart.shapes(&phantom.cycle().gains()[1..]).unwrap();
    let wall = Wall::new(largest[0].solution(), *heart.pose()).unwrap();
    let defect = wall.region([0.2, 0.8], [0.1, 0.4], 1e-5 * heart.length());
    let of_defect = 490 * defect.unwrap().n_segments() as u64;
    for steps in [8, 32, 128] {
        let shapes = steps as u64 / 2 + 1;
        assert_eq!(bytes(steps, 0), shapes * each);
        assert_eq!(bytes(steps, 1), shapes * (each + of_defect));
    }
    // The search of a surface has, for both layers, 24 bytes for each square as large as a voxel, in a meridian half-plane of sqrt(2) times the
    // reference size with eight squares more.
    let still = |write: &[Product], voxel: f64| {
        let mut scene = scene(Mode::Static { phase: 0.0 }, write);
        scene.reconstruction.pixel = Some(voxel);
        memory(scene).shapes
    };
    let size = [phantom.heart().length(), phantom.scene().heart.outer.radius];
    for voxel in [0.4, 0.8] {
        let squares = size.map(|side| 2f64.sqrt() * side / voxel + 8.0);
        let expected = 48.0 * squares[0] * squares[1];
        let found = (still(&[Product::Truth], voxel) - still(&[], voxel)) as f64;
        assert!((found / expected - 1.0).abs() < 1e-2, "{found} {expected}");
    }
}

fn modelled(mode: Mode, osem: Osem) -> Scene {
    let mut scene = scene(mode, &[Product::Reconstruction]);
    scene.reconstruction.method = Method::Osem(osem);
    scene
}

/// Volumes of four bytes per voxel: one for each subset, two for the attenuation, one more for organs.
#[test]
fn osem_has_a_volume_for_each_subset_and_three_for_attenuation_among_organs() {
    let volume = 4 * N * N * N;
    let bytes = |subsets, attenuation, organs: usize| {
        let osem = Osem {
            attenuation,
            ..Osem::new(subsets, 1)
        };
        let mut scene = modelled(Mode::Static { phase: 0.0 }, osem);
        scene.attenuation = Some(Attenuation {
            coefficient: 0.15,
            medium: Medium::Heart,
        });
        scene.organs = vec![
            OrganSettings {
                shape: OrganShapeSettings::Ellipsoid {
                    centre: [4.0, 0.0, 0.0],
                    semi_axes: [1.0; 3],
                },
                activity: 0.5,
                attenuation: 0.1,
            };
            organs
        ];
        memory(scene).volumes
    };
    for organs in [0, 1] {
        let plain = bytes(2, false, organs);
        assert_eq!(bytes(4, false, organs), plain + 2 * volume);
        let attenuated = plain + (2 + organs as u64) * volume;
        assert_eq!(bytes(2, true, organs), attenuated);
    }
}

/// With known motion each gate has a model of its own, its projections twice, and maps with 16 sources of ten bytes per voxel for the beat and
/// sources along the path for respiration.
#[test]
fn known_motion_has_a_model_and_a_map_for_each_gate() {
    let (voxels, samples) = (N * N * N, VIEWS * N * N);
    let bytes = |cardiac, respiratory: usize| {
        let mut scene = modelled(Mode::Gated { gates: cardiac }, Osem::new(2, 1));
        scene.camera.seconds_per_view = 20.0;
        scene.reconstruction.compensation = Compensation::KnownMotion;
        if respiratory > 0 {
            scene.breathing = Some(Breathing {
                shift: [0.0, 0.0, -3.2],
                gates: Some(RespiratoryGates::Amplitude(respiratory)),
                ..Breathing::default()
            });
        }
        memory(scene).volumes
    };
    // Six volumes; pixels and lengths of the cells that they intersect in each view; indices, data twice, background and expected values.
    let model = 4 * 6 * voxels + 36 * VIEWS * N * N + 24 * samples;
    let gate = model + 2 * 4 * samples + 160 * voxels;
    let one = bytes(1, 0);
    for gates in [2, 5] {
        assert_eq!(bytes(gates, 0), one + (gates as u64 - 1) * gate);
    }
    // Four voxels of 0.8 cm: sources of 8 + 4 path, displacements of 24 bytes at four values per voxel of the path of a gate.
    let breath = |gates: u64| {
        let path = 4 / gates;
        voxels * (gates * (8 + 4 * path) * 10 + 24 * 4 * path)
    };
    for gates in [1, 2, 4] {
        let more = (gates - 1) * (gate - 160 * voxels) + breath(gates);
        assert_eq!(bytes(1, gates as usize), one + more);
    }
}

/// Rows of an unfinished image have as many samples as bins: twice the field of view needs twice the memory.
#[test]
fn unfinished_images_grow_with_the_bins() {
    let bytes = |bins: usize| {
        let mut scene = scene(Mode::Static { phase: 0.0 }, &[Product::Projections]);
        scene.camera.samples = Some(BinSample::Averages);
        scene.camera.bins = bins;
        let phantom = Phantom::new(scene).unwrap();
        phantom.prepare().unwrap();
        phantom.memory().each_thread as f64
    };
    let [narrow, wide] = [bytes(24), bytes(48)];
    assert!((wide / narrow - 2.0).abs() < 0.1, "{narrow} {wide}");
}

/// Points of the time quadrature take 120 bytes each. The estimate is an upper limit of those of the views, and less than twice their number.
#[test]
fn points_of_continuous_rotation_are_counted() {
    let gated = Mode::Gated { gates: 1 };
    for (mode, seconds, steps) in [
        (Mode::WholeCycle, 1.0, 8),
        (Mode::WholeCycle, 3.0, 8),
        (Mode::WholeCycle, 2.5, 32),
        (gated, 2.5, 8),
        (Mode::Exposure { seconds: 1.3 }, 2.0, 16),
    ] {
        let mut scene = scene(mode, &[Product::Projections]);
        scene.acquisition.accuracy = Accuracy::Steps(steps);
        scene.camera.rotation = Rotation::Continuous;
        scene.cycle.beats_per_minute = 60.0;
        scene.camera.seconds_per_view = seconds;
        let phantom = Phantom::new(scene).unwrap();
        let estimate = (phantom.memory().views - 4 * VIEWS * N * N) / 120;
        phantom.sinograms(0, &no_observer).unwrap();
        let work = phantom.work();
        let points = (work.rays_cast + work.rays_skipped) / (N * N);
        assert!(
            (points..=2 * points).contains(&estimate),
            "{mode:?}: {estimate} {points}"
        );
    }
}
