//! Defects of the wall.

use heart_phantom::*;
use revolve_voxel::nalgebra::{Point3, Vector3};

use super::small;

pub(crate) fn infarct() -> Defect {
    Defect {
        layers: [0.0, 0.7],
        s: [0.2, 0.35],
        azimuths_degrees: [20.0, 110.0],
        activity: 0.0,
    }
}

#[test]
fn labels_mark_defects() {
    let mut scene = small(Mode::Static { phase: 0.0 });
    let plain = Phantom::new(scene.clone()).unwrap();
    let lateral = Defect {
        layers: [0.0, 1.0],
        s: [0.05, 0.3],
        azimuths_degrees: [90.0, 200.0],
        activity: 2.0,
    };
    // The second defect replaces the first one, which lies within it; the third replaces a part of the second.
    let hidden = Defect {
        s: [0.25, 0.3],
        layers: [0.1, 0.5],
        azimuths_degrees: [40.0, 80.0],
        ..infarct()
    };
    scene.defects = vec![hidden, infarct(), lateral];
    let phantom = Phantom::new(scene.clone()).unwrap();
    assert_eq!(
        phantom.label_names()[2..],
        ["wall", "defect 1", "defect 2", "defect 3"]
    );
    let grid = phantom.camera().grid();
    let wall = |shape: &HeartShape| Wall::new(shape.solution(), *phantom.heart().pose()).unwrap();
    let rest = wall(&phantom.heart().shapes(&[0.0]).unwrap()[0]);
    for phase in [0.0, 0.4] {
        let labels = phantom.labels(phase).unwrap();
        let shape = phantom.shape(phase).unwrap();
        let wall = wall(&shape).sliding_from(&rest);
        // Returns the defects at a point, or none outside the wall.
        let at = |p: Point3<f64>| {
            let m = wall.locate(&p)?;
            Some([0, 1, 2].map(|k: usize| {
                let d = &scene.defects[k];
                let turn = (m.azimuth.to_degrees() - d.azimuths_degrees[0]).rem_euclid(360.0);
                (d.layers[0]..=d.layers[1]).contains(&m.layer)
                    && (d.s[0]..=d.s[1]).contains(&m.s)
                    && turn <= d.azimuths_degrees[1] - d.azimuths_degrees[0]
            }))
        };
        let mut seen = [0; 6];
        for (k, (&label, before)) in labels.iter().zip(plain.labels(phase).unwrap()).enumerate() {
            seen[usize::from(label)] += 1;
            // Only voxels of the wall change.
            assert!(
                label == before || (before == 2 && label > 2),
                "{label} {before}"
            );
            let c = grid.centre(k % 40, k / 40 % 40, k / 1600);
            let h = 0.5 * grid.spacing()[0];
            let corner = |j: usize| [0, 1, 2].map(|a| if j >> a & 1 == 1 { h } else { -h });
            let all: Vec<_> = (0..8).map(|j| at(c + Vector3::from(corner(j)))).collect();
            // A voxel whose corners and centre are in one region has its label: regions are thicker than a voxel or two.
            if all.iter().any(|found| *found != at(c)) {
                continue;
            }
            match at(c) {
                None => assert!(label < 2, "{label}"),
                Some([_, _, true]) => assert_eq!(label, 5),
                Some([_, true, false]) => assert_eq!(label, 4),
                Some(_) => assert_eq!(label, 2),
            }
        }
        assert!(
            seen[2] > 1000 && seen[3] == 0 && seen[4] > 100 && seen[5] > 100,
            "{seen:?}"
        );
        // The ground truth agrees: a voxel of a cold defect is dark, one of a hot one bright.
        let activity = phantom.activity(phase).unwrap();
        let mean = |label: u8| {
            let own = labels.iter().zip(&activity).filter(|(l, _)| **l == label);
            let (sum, n) = own.fold((0.0, 0.0), |(sum, n), (_, v)| {
                (sum + f64::from(*v), n + 1.0)
            });
            sum / n
        };
        assert!(
            mean(4) < 0.4 && mean(5) > 1.5 && mean(2) > 0.8,
            "{} {} {}",
            mean(4),
            mean(5),
            mean(2)
        );
    }
    scene.defects = vec![infarct(); 253];
    assert!(matches!(
        Phantom::new(scene),
        Err(PhantomError::Scene { .. })
    ));
}

#[test]
fn a_defect_moves_with_the_wall_and_preserves_its_volume() {
    let mut scene = small(Mode::WholeCycle);
    let whole = Phantom::new(scene.clone()).unwrap();
    scene.defects = vec![infarct()];
    let cold = Phantom::new(scene.clone()).unwrap();
    let voxel = cold.camera().grid().voxel_volume();
    let lost: Vec<f64> = [0.0, 0.25, 0.5]
        .into_iter()
        .map(|phase| {
            let [all, less] = [&whole, &cold].map(|phantom| phantom.activity(phase).unwrap());
            assert!(less.iter().all(|&v| v >= 0.0));
            all.iter()
                .zip(&less)
                .map(|(a, b)| f64::from(a - b))
                .sum::<f64>()
                * voxel
        })
        .collect();
    // 0.7 of a strip of the wall, a quarter of a turn: the same material at every phase.
    assert!(lost[0] > 1.0);
    for volume in &lost {
        assert!((volume / lost[0] - 1.0).abs() < 2e-3, "{lost:?}");
    }
    // The projections of the difference contain the volume of the region, by the midpoint rule on 4 mm bins.
    let [all, less] = [&whole, &cold].map(|phantom| phantom.view(0, 4).unwrap());
    let seen: f64 = all
        .iter()
        .zip(&less)
        .map(|(a, b)| f64::from(a - b))
        .sum::<f64>()
        * 0.16;
    assert!((seen / lost[0] - 1.0).abs() < 0.03, "{seen} {lost:?}");
    // As active as the wall: no defect.
    scene.defects[0].activity = 1.0;
    let none = Phantom::new(scene).unwrap();
    assert!(none.view(0, 4).unwrap() == all);
}

/// Averages over bins have outlines of complete rings as panel ends; a twist maps such a ring onto itself.
#[test]
fn a_ring_does_not_depend_on_the_twist() {
    let mut scene = small(Mode::Static { phase: 0.4 });
    scene.camera.views = 2;
    scene.reconstruction.arc = radon::ArcPolicy::Extend;
    (scene.camera.bins, scene.camera.rows) = (10, 10);
    scene.camera.pitch = [1.6; 2];
    scene.camera.samples = Some(BinSample::Averages);
    scene.acquisition.accuracy = Accuracy::Tolerance(0.02);
    scene.defects = vec![Defect {
        azimuths_degrees: [-90.0, 270.0],
        ..infarct()
    }];
    let still = Phantom::new(scene.clone()).unwrap();
    scene.twist = Some(Twist {
        inner_degrees: vec![-3.0, 10.0],
        outer_degrees: vec![-3.0, 8.0],
    });
    let twisted = Phantom::new(scene.clone()).unwrap();
    let view = twisted.view(0, 1).unwrap();
    assert!(view == still.view(0, 1).unwrap());
    assert_eq!(
        twisted.work().rays_cast,
        still.work().rays_cast,
        "a ring without sides"
    );
    // The same ring in two halves, whose sides rotate.
    let half = |azimuths_degrees: [f64; 2]| Defect {
        azimuths_degrees,
        ..infarct()
    };
    scene.defects = vec![half([-90.0, 80.0]), half([80.0, 270.0])];
    let halves = Phantom::new(scene).unwrap().view(0, 1).unwrap();
    let most = view.iter().copied().fold(0.0, f32::max);
    let off = view.iter().zip(&halves).map(|(a, b)| (a - b).abs());
    // Twice the part of the tolerance for bins.
    assert!(off.fold(0.0, f32::max) < 0.02 * most);
}
