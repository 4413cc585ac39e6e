//! Torso, background and blur of parts and of the whole.

use super::*;

#[test]
fn a_torso_attenuates_by_depth_and_agrees_with_its_map() {
    let mut scene = small(Mode::Static { phase: 0.0 });
    let clear = Phantom::new(scene.clone()).unwrap();
    let torso = Medium::Torso {
        centre: [0.0, 0.0],
        semi_axes: [12.0, 10.0],
    };
    let with = |scene: &mut Scene, coefficient, medium| {
        scene.attenuation = Some(Attenuation {
            coefficient,
            medium,
        });
        Phantom::new(scene.clone()).unwrap()
    };
    let weak = with(&mut scene, 1e-9, torso);
    let [seen, faint] = [&clear, &weak].map(|phantom| phantom.view(0, 2).unwrap());
    for (a, b) in seen.iter().zip(&faint) {
        assert!((a - b).abs() <= 1e-6 * a.abs());
    }
    // The whole heart has between 10 - 7 and 12 + 7 cm of torso on its way to the detector.
    let deep = with(&mut scene, 0.15, torso);
    for (a, b) in seen.iter().zip(deep.view(0, 2).unwrap()) {
        assert!(
            b <= a * (-0.15f32 * 3.0).exp() && b >= a * (-0.15f32 * 19.0).exp(),
            "{a} {b}"
        );
    }
    // A slice equals that of the whole here, too.
    let volume = deep.volume(0).unwrap();
    assert!(deep.slice(0, 21).unwrap() == volume[21 * 1600..22 * 1600]);
    let map = deep.attenuation(0.0).unwrap();
    assert!((map[20 * 1600 + 20 * 40 + 20] - 0.15).abs() < 1e-6);
    let heart = with(&mut scene, 0.2, Medium::Heart);
    let map = heart.attenuation(0.5).unwrap();
    let sum: f64 =
        map.iter().map(|&v| f64::from(v)).sum::<f64>() * heart.camera().grid().voxel_volume();
    let outer = heart.shape(0.5).unwrap().volumes()[1];
    assert!((sum / (0.2 * outer) - 1.0).abs() < 1e-4);
    assert!(matches!(
        clear.attenuation(0.0),
        Err(PhantomError::Absent { .. })
    ));
}

#[test]
fn a_slice_of_blurred_views_costs_the_rows_within_the_blur() {
    let mut scene = small(Mode::Static { phase: 0.3 });
    scene.camera.pitch = [0.5, 0.4];
    // 1 cm on 0.4 cm rows: a standard deviation of 1.06 rows; five of them reach six rows.
    scene.blur = Some(BlurSettings { fwhm: 1.0 });
    scene.camera.samples = Some(heart_phantom::BinSample::Centres);
    let rays = |of: &dyn Fn(&Phantom)| {
        let phantom = Phantom::new(scene.clone()).unwrap();
        // The comparison of resolutions casts rays of its own.
        phantom.resolution().unwrap();
        let before = phantom.work().rays_cast;
        of(&phantom);
        phantom.work().rays_cast - before
    };
    let volume = Phantom::new(scene.clone()).unwrap().volume(0).unwrap();
    let all = rays(&|phantom| drop(phantom.volume(0).unwrap()));
    // Six rows on either side of row 20 are 13 of the 20 that the heart covers.
    for (z, most) in [(0, 0.2), (3, 0.3), (20, 0.65), (39, 0.2)] {
        let some = rays(&|phantom| {
            assert!(phantom.slice(0, z).unwrap() == volume[z * 1600..(z + 1) * 1600]);
        });
        assert!((some as f64) < most * all as f64, "{z}: {some} of {all}");
    }
    let one = rays(&|phantom| drop(phantom.view(0, 2).unwrap()));
    assert!(one * 10 < all, "{one} of {all}");
}

#[test]
fn blur_and_noise_of_a_part_are_identical_to_those_of_the_whole() {
    let mut scene = small(Mode::Gated { gates: 2 }).with_size(24);
    scene.acquisition.accuracy = Accuracy::Tolerance(0.4); // equality of bits does not depend on it
    scene.defects = vec![infarct()];
    scene.blur = Some(BlurSettings { fwhm: 1.0 });
    let blurred = Phantom::new(scene.clone()).unwrap();
    for counts in [Counts::PerUnit(30.0), Counts::Total(2e5)] {
        scene.noise = Some(Noise { counts, seed: 3 });
        let phantom = Phantom::new(scene.clone()).unwrap();
        let views = phantom.sinograms(1, &no_observer).unwrap().samples;
        let alone = Phantom::new(scene.clone()).unwrap();
        assert!(alone.view(1, 5).unwrap() == views[5 * 576..6 * 576]);
        let volume = phantom.volume(1).unwrap();
        assert!(alone.slice(1, 12).unwrap() == volume[12 * 576..13 * 576]);
        // The noise differs between gates; the sum is accurate to the noise of the counts.
        let sum = |views: &[f32]| views.iter().map(|&v| f64::from(v)).sum::<f64>();
        let mean = sum(&blurred.sinograms(1, &no_observer).unwrap().samples);
        let total = match counts {
            Counts::PerUnit(counts) => mean * counts,
            Counts::Total(counts) => counts,
            Counts::Expected => panic!("needs a sensitivity"),
        };
        assert!(
            (sum(&views) / mean - 1.0).abs() < 5.0 / total.sqrt(),
            "{counts:?}"
        );
        assert!(phantom.view(0, 5).unwrap() != views[5 * 576..6 * 576]);
        scene.noise = Some(Noise { counts, seed: 4 });
        assert!(
            Phantom::new(scene.clone()).unwrap().view(1, 5).unwrap() != views[5 * 576..6 * 576]
        );
    }
}

#[test]
fn a_background_fills_the_torso_around_the_heart() {
    let mut scene = small(Mode::WholeCycle);
    // Wide enough to contain the heart at all phases.
    let (a, b) = (7.6, 7.2);
    scene.background = Some(Background {
        concentration: 0.3,
        centre: [0.1, 0.0],
        semi_axes: [a, b],
    });
    let phantom = Phantom::new(scene.clone()).unwrap();
    let numbers = phantom.numbers().unwrap();
    let voxel = phantom.camera().grid().voxel_volume();
    let sum: f64 = phantom
        .activity(0.0)
        .unwrap()
        .iter()
        .map(|&v| f64::from(v))
        .sum::<f64>()
        * voxel;
    let torso = std::f64::consts::PI * a * b * 16.0;
    let exact = 0.3 * (torso - numbers.wall_volume - numbers.esv) + numbers.wall_volume;
    assert!((sum / exact - 1.0).abs() < 1e-4, "{sum} {exact}");
    // The same in a view: bins of 0.4 cm, the midpoint rule.
    let seen: f64 = phantom
        .view(0, 3)
        .unwrap()
        .iter()
        .map(|&v| f64::from(v))
        .sum::<f64>()
        * 0.16;
    let mean = {
        let clear = Phantom::new(Scene {
            background: None,
            ..scene.clone()
        })
        .unwrap();
        let all = |phantom: &Phantom| {
            let truth = phantom.truth(0).unwrap();
            truth.iter().map(|&v| f64::from(v)).sum::<f64>() * voxel
        };
        assert!(all(&phantom) > all(&clear));
        all(&phantom)
    };
    assert!((seen / mean - 1.0).abs() < 0.01, "{seen} {mean}");
    // A heart with the activity of its surroundings is invisible.
    scene.activity = Activity {
        cavity: Uptake::Concentration(0.3),
        wall: Uptake::Concentration(0.3),
    };
    let even = Phantom::new(scene).unwrap().view(0, 0).unwrap();
    for row in even.chunks(40) {
        assert!(row == &even[..40]);
    }
}
