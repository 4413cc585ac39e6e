//! Shapes obey their memory limit, and results are bitwise identical for any limit.

use crate::phantom::{infarct, small};
use heart_phantom::{Accuracy, Mode, Product, Rotation, Scene};
use heart_phantom::{Phantom, Sinograms, no_observer};

fn taken(scene: &Scene, shapes: usize) -> (Sinograms, Phantom) {
    let phantom = Phantom::new(scene.clone()).unwrap();
    let bytes = shapes * phantom.heart().shape_bytes();
    let phantom = phantom.with_memory(bytes);
    (phantom.sinograms(0, &no_observer).unwrap(), phantom)
}

/// Views with phases of their own: shapes are evicted after their view.
#[test]
fn shapes_are_evicted_at_the_memory_limit() {
    let mut scene = small(Mode::Exposure { seconds: 0.3 }).with_size(4);
    scene.camera.views = 200;
    // The views start in the first tenth of a beat: none contains a turning point, which would be a common level.
    scene.cycle.beats_per_minute = 60.03;
    let (all, phantom) = taken(&scene, 1_000_000);
    // 0.3 s are 0.3 beats: five levels for each view.
    assert!(all.distinct_shapes > 950, "{}", all.distinct_shapes);
    assert_eq!(phantom.work().shapes_at_once, all.distinct_shapes);
    for most in [1, 7, 40] {
        let (few, phantom) = taken(&scene, most);
        assert!(few.samples == all.samples, "{most}");
        assert_eq!(few.view_error.time, all.view_error.time);
        assert_eq!(few.distinct_shapes, all.distinct_shapes);
        let work = phantom.work();
        assert!(work.shapes_at_once <= most && phantom.heart().shapes_alive()[0] <= most);
        // A view needs five: with room for them none is solved twice.
        assert!(
            most < 5 || work.shapes_solved == all.distinct_shapes,
            "{work:?}"
        );
    }
}

/// One list of points for all views, with more shapes than memory, and with continuous rotation, levels or defects.
#[test]
fn a_view_beyond_the_memory_limit_is_computed_in_parts() {
    let mut scene = small(Mode::WholeCycle).with_size(12);
    scene.acquisition.accuracy = Accuracy::Steps(32);
    let mut turning = scene.clone();
    turning.camera.rotation = Rotation::Continuous;
    let mut gated = turning.clone();
    gated.acquisition.mode = Mode::Gated { gates: 3 };
    gated.cycle.curve = heart_phantom::VolumeCurve::Physiological;
    let mut defect = scene.clone();
    defect.defects = vec![infarct()];
    for scene in [scene, turning, gated, defect] {
        let (all, phantom) = taken(&scene, 100);
        let solved = phantom.work().shapes_solved;
        for most in [1, 4] {
            let (few, phantom) = taken(&scene, most);
            assert!(few.samples == all.samples && few.view_error.time == all.view_error.time);
            let work = phantom.work();
            // Defects also need the shape of the reference configuration.
            let besides = scene.defects.len();
            assert!(work.shapes_at_once <= most + besides, "{work:?}");
            assert!(work.shapes_solved >= solved);
        }
    }
}

#[test]
fn the_most_recently_used_shapes_are_kept() {
    let heart = heart_phantom::Heart::study(51).unwrap();
    let three = 3 * heart.shape_bytes();
    let heart = heart.with_memory(three);
    for (gains, solved, alive) in [
        (&[0.1, 0.2, 0.3][..], 3, 3),
        (&[0.1][..], 3, 3),
        (&[0.4][..], 4, 3),      // replaces 0.2
        (&[0.1, 0.3][..], 4, 3), // still cached
        (&[0.2][..], 5, 3),
        (&[0.5, 0.6, 0.7, 0.8, 0.9][..], 10, 5), // more than the memory, requested together
        (&[0.9][..], 10, 3),                     // evicted at the next request
        (&[0.1][..], 11, 3),
    ] {
        let shapes = heart.shapes(gains).unwrap();
        assert_eq!(shapes.len(), gains.len());
        assert_eq!(
            (heart.shapes_solved(), heart.shapes_alive()[0]),
            (solved, alive),
            "{gains:?}"
        );
    }
    assert_eq!(heart.shapes_alive()[1], 5);
    // Shapes with other owners remain alive.
    let held = heart.shapes(&[0.01]).unwrap();
    heart.shapes(&[0.02, 0.03, 0.04]).unwrap();
    assert_eq!(heart.shapes_alive()[0], 4);
    drop(held);
    assert_eq!(heart.shapes_alive()[0], 3);
}

/// With step and shoot all views have the images of the first, one for each shape. The states of the ground truth of a gate are the shapes that it solves.
#[test]
fn images_and_states_are_counted_before_a_run() {
    for mode in [Mode::WholeCycle, Mode::Gated { gates: 4 }] {
        let mut scene = small(mode).with_size(8);
        scene.output.write = vec![Product::Projections, Product::Truth];
        let phantom = Phantom::new(scene).unwrap();
        let [images, states] = phantom.images_and_states().unwrap();
        let gates = 0..phantom.n_gates();
        let solved = |gate| {
            let alone = Phantom::new(phantom.scene().clone()).unwrap();
            alone.truth(gate).unwrap();
            alone.work().shapes_solved
        };
        let solved: usize = gates.clone().map(solved).sum();
        let shapes = |gate| {
            phantom
                .sinograms(gate, &no_observer)
                .unwrap()
                .distinct_shapes
        };
        let shapes: usize = gates.map(shapes).sum();
        assert_eq!(images, 12 * shapes, "{mode:?}");
        // Gates that do not reach end-diastole or end-systole solve it for the displacement of the surfaces.
        assert!(states <= solved && solved <= states + 2 * phantom.n_gates());
    }
    let mut scene = small(Mode::Static { phase: 0.0 });
    scene.output.write = vec![Product::Labels];
    let none = Phantom::new(scene).unwrap();
    assert_eq!(none.images_and_states().unwrap(), [0, 0]);
}
