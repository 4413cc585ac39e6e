//! Activity is never negative: subtracted activity exists, and is subtracted only once.

use heart_phantom::scene::DiscretisationSettings;
use heart_phantom::*;
use proptest::prelude::*;

use super::defects::infarct;
use super::small;

fn region(layers: [f64; 2], s: [f64; 2], azimuths: [f64; 2], activity: f64) -> Defect {
    Defect {
        layers,
        s,
        azimuths_degrees: azimuths,
        activity,
    }
}

fn with(defects: &[Defect]) -> Phantom {
    let mut scene = small(Mode::WholeCycle);
    scene.defects = defects.to_vec();
    Phantom::new(scene).unwrap()
}

/// Overlapping defects and the same defects divided by hand into disjoint pieces, also across the seam of the azimuths.
#[test]
fn the_last_of_overlapping_defects_counts() {
    let cold = region([0.0, 1.0], [0.1, 0.4], [-60.0, 120.0], 0.0);
    let hot = region([0.5, 1.0], [0.2, 0.5], [60.0, 330.0], 3.0);
    let by_hand = [
        region([0.0, 0.5], [0.1, 0.4], [-60.0, 120.0], 0.0),
        region([0.5, 1.0], [0.1, 0.2], [-60.0, 120.0], 0.0),
        region([0.5, 1.0], [0.2, 0.4], [-30.0, 60.0], 0.0),
        hot,
    ];
    let (overlapping, cut) = (with(&[cold, hot]), with(&by_hand));
    for view_idx in [0, 5] {
        let [a, b] = [&overlapping, &cut].map(|phantom| phantom.view(0, view_idx).unwrap());
        let most = b.iter().copied().fold(0.0, f32::max);
        for (a, b) in a.iter().zip(&b) {
            // Sums of f32 in another order.
            assert!((a - b).abs() <= 1e-5 * most, "{a} {b}");
        }
    }
    let [a, b] = [&overlapping, &cut].map(|phantom| phantom.truth_slice(0, 20).unwrap());
    for (a, b) in a.iter().zip(&b) {
        // The tolerance of the coverage, 1e-3, of a handful of pieces of activity up to 3.
        assert!((a - b).abs() < 2e-2, "{a} {b}");
    }
    // In the opposite order the cold defect is complete.
    let other = with(&[hot, cold]);
    assert!(other.view(0, 0).unwrap() != overlapping.view(0, 0).unwrap());
}

/// A defect covered by one or two later ones has no effect, and adjacent ones are bitwise identical.
#[test]
fn a_completely_replaced_defect_has_no_effect() {
    let wide = region([0.0, 0.9], [0.1, 0.5], [0.0, 200.0], 0.5);
    let halves = [
        region([0.0, 0.9], [0.1, 0.3], [0.0, 200.0], 0.2),
        region([0.0, 0.9], [0.3, 0.5], [-360.0, -160.0], 0.7),
    ];
    let [alone, over] = [with(&[wide]), with(&[infarct(), wide])];
    assert!(alone.view(0, 3).unwrap() == over.view(0, 3).unwrap());
    assert!(alone.truth_slice(0, 17).unwrap() == over.truth_slice(0, 17).unwrap());
    let [alone, over] = [with(&halves), with(&[&[wide], &halves[..]].concat())];
    assert!(alone.view(0, 3).unwrap() == over.view(0, 3).unwrap());
    assert_eq!(over.label_names().len(), 6);
    let labels = over.labels(0.3).unwrap();
    assert!(!labels.contains(&3) && labels.contains(&4) && labels.contains(&5));
}

/// Two equal cold defects gave -1 of the wall's activity in the past.
#[test]
fn coinciding_cold_defects_count_once() {
    let [one, two] = [with(&[infarct()]), with(&[infarct(), infarct()])];
    assert!(one.view(0, 3).unwrap() == two.view(0, 3).unwrap());
    assert!(one.truth_slice(0, 20).unwrap() == two.truth_slice(0, 20).unwrap());
}

/// A completely cold wall is invisible, also where it is tangent to rays, for any tolerance of its polygons: the subtraction ends at the
/// surface of the wall.
#[test]
fn a_completely_cold_wall_is_invisible() {
    for discretisation in [
        DiscretisationSettings::Spectral {
            degree: 8,
            per_piece: 1,
            tolerance: 2e-2,
        },
        DiscretisationSettings::Differences { nodes: 41 },
    ] {
        let mut scene = small(Mode::WholeCycle);
        scene.heart.discretisation = discretisation;
        let whole = Phantom::new(scene.clone()).unwrap();
        let whole = whole.view(0, 3).unwrap().into_iter().fold(0.0, f32::max);
        scene.defects = vec![region([0.0, 1.0], [0.0, 0.5], [0.0, 360.0], 0.0)];
        let phantom = Phantom::new(scene).unwrap();
        let most = phantom.view(0, 3).unwrap().into_iter().fold(0.0, f32::max);
        // Sums of f32.
        assert!(most < 1e-6 * whole, "{most} {whole}");
        let truth = phantom.truth_slice(0, 20).unwrap();
        // Twice the tolerance of a coverage.
        assert!(truth.iter().all(|v| *v <= 2e-3));
    }
}

#[test]
fn defects_of_too_many_pieces_are_rejected() {
    let mut scene = small(Mode::WholeCycle);
    // Combs along three axes: 40 x 40 x 40 holes in the defect below.
    for k in 0..40 {
        let [from, to] = [k as f64 / 40.0, (k as f64 + 0.5) / 40.0];
        scene.defects.extend([
            region([from, to], [0.0, 0.5], [0.0, 360.0], 0.5),
            region([0.0, 1.0], [0.5 * from, 0.5 * to], [0.0, 360.0], 0.5),
            region([0.0, 1.0], [0.0, 0.5], [360.0 * from, 360.0 * to], 0.5),
        ]);
    }
    let error = scene.check().unwrap_err().to_string();
    assert!(
        error.starts_with("defects is 120; their overlaps"),
        "{error}"
    );
}

/// The total activity of a scene in closed form: cavity, and strips, layers and wedges of the wall.
fn activity(phantom: &Phantom, defects: &[Defect]) -> f64 {
    // The volume fraction of the wall up to s is exact only where defects end at 0 and 1/2; otherwise by points on a fine grid.
    const N: usize = 24;
    let shapes = phantom.heart().shapes(&[0.0]).unwrap();
    let wall = Wall::new(shapes[0].solution(), *shapes[0].body().pose()).unwrap();
    let strip = |from: f64, to: f64| wall.region([0.0, 1.0], [from, to], 1e-6).unwrap();
    let mut sum = 0.0;
    for j in 0..N {
        let [from, to] = [j, j + 1].map(|j| 0.5 * j as f64 / N as f64);
        let volume = strip(from, to).mass_properties().volume / (N * N) as f64;
        for (i, k) in (0..N).flat_map(|i| (0..N).map(move |k| (i, k))) {
            let at = |k: usize| (k as f64 + 0.5) / N as f64;
            let holds = |defect: &&Defect| {
                let turn = (360.0 * at(k) - defect.azimuths_degrees[0]).rem_euclid(360.0);
                (defect.layers[0]..defect.layers[1]).contains(&at(i))
                    && (defect.s[0]..defect.s[1]).contains(&(0.5 * (from + to)))
                    && turn < defect.azimuths_degrees[1] - defect.azimuths_degrees[0]
            };
            let activity = defects.iter().rev().find(holds);
            sum += volume * activity.map_or(1.0, |defect| defect.activity);
        }
    }
    sum
}

/// Boundaries on a coarse grid, so that defects share sides, contain each other and reach both membranes.
fn any_defect() -> impl Strategy<Value = Defect> {
    let range = |n: i32| (0..n, 0..n).prop_map(move |(a, b)| [a.min(b), a.max(b) + 1]);
    let activity = prop_oneof![3 => Just(0.0), 1 => 0.0..3.0];
    (range(4), range(4), -12..12, 1..=12, activity).prop_map(|(layers, s, from, wide, activity)| {
        let azimuths = [from, from + wide].map(|k| 30.0 * f64::from(k));
        let of = |range: [i32; 2], most: f64| range.map(|k| most * f64::from(k) / 4.0);
        region(of(layers, 1.0), of(s, 0.5), azimuths, activity)
    })
}

fn any_scene() -> impl Strategy<Value = Scene> {
    let spectral = DiscretisationSettings::Spectral {
        degree: 8,
        per_piece: 1,
        tolerance: 2e-2, // a coarse polygon
    };
    let differences = DiscretisationSettings::Differences { nodes: 41 };
    (
        prop::collection::vec(any_defect(), 1..5),
        prop_oneof![Just(spectral), Just(differences)],
        prop::bool::ANY,
        prop::bool::ANY,
        0.0..1.0,
        prop::array::uniform2(7.0..12.0),
    )
        .prop_map(
            |(defects, discretisation, around, weakened, phase, semi_axes)| {
                let mut scene = small(Mode::Static { phase }).with_size(20);
                scene.camera.views = 3;
                scene.heart.discretisation = discretisation;
                scene.defects = defects;
                let centre = [0.3, -0.2];
                if around {
                    // More active than the wall, so that the wall is subtracted.
                    scene.background = Some(Background {
                        concentration: 2.0,
                        centre,
                        semi_axes,
                    });
                }
                if weakened {
                    scene.attenuation = Some(Attenuation {
                        coefficient: 0.15,
                        medium: Medium::Torso { centre, semi_axes },
                    });
                }
                scene
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_value_is_negative(scene in any_scene()) {
        let phantom = Phantom::new(scene.clone()).unwrap();
        let views = phantom.sinograms(0, &no_observer).unwrap().samples;
        prop_assert!(views.iter().all(|v| *v >= 0.0));
        let truth = phantom.truth(0).unwrap();
        prop_assert!(truth.iter().all(|v| *v >= 0.0));
        // Negative values are not merely hidden: projections and voxels have the correct totals.
        let exact = activity(&phantom, &scene.defects);
        let camera = phantom.camera();
        if scene.background.is_none() {
            let sum: f64 = truth.iter().map(|v| f64::from(*v)).sum();
            let sum = sum * camera.grid().voxel_volume();
            // Polygons within 0.02 cm of a wall 1 cm thick on both sides, or 41 nodes, change at most 4 % of it; coverages are accurate to
            // 1e-3.
            prop_assert!((sum - exact).abs() < 0.05 * (exact + 8.0), "{sum} {exact}");
        }
        if scene.background.is_none() && scene.attenuation.is_none() {
            let fine = Phantom::new(scene.clone().with_size(96)).unwrap();
            let view = fine.view(0, 1).unwrap();
            let sum: f64 = view.iter().map(|v| f64::from(*v)).sum();
            let sum = sum * fine.camera().pitch().powi(2);
            // As above, and the midpoint rule on bins of 0.17 cm, of layers 0.2 cm thick.
            prop_assert!((sum - exact).abs() < 0.06 * (exact + 8.0), "{sum} {exact}");
        }
    }
}

#[test]
fn a_background_that_does_not_contain_the_heart_is_rejected() {
    let mut scene = small(Mode::WholeCycle);
    let concentration = 1.0;
    let background = |a: f64, b: f64| Background {
        concentration,
        centre: [0.0; 2],
        semi_axes: [a, b],
    };
    // The widest shape of the heart decides, for any phases of the views.
    let reach = |a: f64, b: f64| {
        let mut scene = scene.clone();
        scene.background = Some(background(a, b));
        scene.acquisition.mode = Mode::Static { phase: 0.5 };
        let phantom = Phantom::new(scene).unwrap();
        let [views, truth, labels] = [
            phantom.view(0, 0).map(drop),
            phantom.truth_slice(0, 20).map(drop),
            phantom.labels(0.5).map(drop),
        ];
        match (views, truth, labels) {
            (Ok(()), Ok(()), Ok(())) => None,
            (
                Err(PhantomError::Uncovered { times, gain }),
                Err(PhantomError::Uncovered { .. }),
                Err(PhantomError::Uncovered { .. }),
            ) => Some((times, gain)),
            ends => panic!("{ends:?}"),
        }
    };
    let (times, gain) = reach(4.0, 3.0).unwrap();
    assert!((gain - 0.6).abs() < 1e-12);
    // Scaled by this factor it contains the heart; slightly smaller it does not.
    assert!(reach(4.0 * times * 1.0001, 3.0 * times * 1.0001).is_none());
    let (almost, _) = reach(4.0 * times * 0.9999, 3.0 * times * 0.9999).unwrap();
    assert!((almost - 1.0001).abs() < 1e-6);
    // Nothing is subtracted from a background without activity.
    let nothing = Background {
        concentration: 0.0,
        ..background(1.0, 1.0)
    };
    scene.background = Some(nothing);
    assert!(Phantom::new(scene).unwrap().view(0, 0).is_ok());
}
