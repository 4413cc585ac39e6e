//! Inputs at the ends of their ranges: results scale, or an error occurs before any work.

use heart_phantom::{Mode, Product, Scene, radon::ArcPolicy};
use heart_phantom::{Phantom, PhantomError, Warning, WarningKind, no_observer, run};

/// A twisted heart with a defect, all lengths times `scale`.
fn twisted(scale: f64) -> Scene {
    let text = format!(
        "[heart]\ndiscretisation = {{ differences = {{ nodes = 61 }} }}\n\
         inner = {{ length = {}, radius = {} }}\nouter = {{ length = {}, radius = {} }}\n\
         [camera]\nviews = 3\nbins = 20\nrows = 18\npitch = [{}, {}]\nradius = {}\n\
         [acquisition]\nmode = {{ static = {{ phase = 0.3 }} }}\n\
         [reconstruction]\narc = 'extend'\n\
         [output]\nwrite = ['projections']\n\
         [[defects]]\nlayers = [0.1, 0.7]\ns = [0.2, 0.4]\nazimuths_degrees = [10.0, 100.0]\nactivity = 0.2\n\
         [twist]\ninner_degrees = [-3.0, 4.0, 10.0]\nouter_degrees = [-2.0, 8.0]\n",
        8.5 * scale,
        1.75 * scale,
        8.5 * scale,
        2.75 * scale,
        0.9 * scale,
        scale,
        20.0 * scale,
    );
    Scene::from_toml(&text).unwrap()
}

/// Line integrals scale with the size of the heart at constant activity.
#[test]
fn a_twisted_defect_scales_with_the_heart() {
    let views = |scale: f64| {
        let phantom = Phantom::new(twisted(scale)).unwrap();
        phantom.prepare().unwrap();
        phantom.sinograms(0, &no_observer).unwrap().samples
    };
    let expected = views(1.0);
    let most = expected.iter().copied().fold(0.0f32, f32::max);
    for scale in [0.05, 0.1, 1000.0] {
        for (found, expected) in views(scale).iter().zip(&expected) {
            let found = f64::from(*found) / scale;
            // The solver's tolerance and the polygons of the defect's layers, 1e-5 of the heart's length.
            let off = (found - f64::from(*expected)).abs();
            assert!(off < 1e-4 * f64::from(most), "{scale} {found} {expected}");
        }
    }
}

/// Sections of a study with all lengths times `cm`; attenuation coefficients scale inversely. Presets of collimators and `[chest]` have the
/// physical lengths of a device and of an adult, which do not scale: their numbers are fields here.
fn sections(case: &str, cm: f64) -> String {
    let collimator = format!(
        "[collimator]\nintrinsic_fwhm = {}\nholes = {{ parallel = {{ diameter = {}, length = {}, attenuation = {}, response = 'anger' }} }}\n",
        0.38 * cm,
        0.15 * cm,
        3.5 * cm,
        26.9 / cm,
    );
    let trunk = format!(
        "{{ cylinder = {{ centre = [0.0, {}], semi_axes = [{}, {}] }} }}",
        cm,
        15.0 * cm,
        12.0 * cm
    );
    let spine = format!(
        "{{ ellipsoid = {{ centre = [{}, {}, 0.0], semi_axes = [{}, {}, {}] }} }}",
        2.0 * cm,
        3.0 * cm,
        2.0 * cm,
        2.5 * cm,
        20.0 * cm
    );
    let organs = format!(
        "[attenuation]\ncoefficient = {}\nmedium = 'heart'\n\
         [[organs]]\nshape = {trunk}\nactivity = 0.1\nattenuation = {}\n\
         [[organs]]\nshape = {spine}\nactivity = 0.05\nattenuation = {}\n",
        0.15 / cm,
        0.15 / cm,
        0.2 / cm,
    );
    match case {
        "collimator" => collimator,
        "organs" => organs,
        "breathing" => format!(
            "[breathing]\nshift = [{}, 0.0, {}]\nrotation_degrees = [5.0, 0.0, 0.0]\n",
            0.5 * cm,
            -1.5 * cm
        ),
        "descent" => format!("[cycle]\nav_plane_displacement = {}\n", 1.6 * cm),
        "osem" => format!(
            "{collimator}{organs}[reconstruction]\n\
             method = {{ osem = {{ subsets = 3, iterations = 2, attenuation = true, resolution = true }} }}\n"
        ),
        _ => String::new(),
    }
}

/// A phantom of such a study.
fn study(case: &str, cm: f64) -> Phantom {
    let discretisation = match case {
        "spectral" => format!(
            "spectral = {{ degree = 10, per_piece = 1, tolerance = {} }}",
            1e-3 * cm
        ),
        _ => "differences = { nodes = 61 }".to_owned(),
    };
    let text = format!(
        "[heart]\ndiscretisation = {{ {discretisation} }}\n\
         inner = {{ length = {}, radius = {} }}\nouter = {{ length = {}, radius = {} }}\n\
         [camera]\nviews = 6\nbins = 14\nrows = 10\npitch = [{}, {}]\nradius = {}\n\
         [acquisition]\naccuracy = {{ tolerance = 0.1 }}\n{}",
        5.5 * cm,
        1.6 * cm,
        5.2 * cm,
        2.9 * cm,
        1.2 * cm,
        1.6 * cm,
        20.0 * cm,
        sections(case, cm)
    );
    let phantom = Phantom::new(Scene::from_toml(&text).unwrap()).unwrap();
    phantom.prepare().unwrap();
    phantom
}

/// Projections scale with the lengths, reconstructed activity concentrations do not depend on them, overlaps scale with the volume.
#[test]
fn studies_scale_with_their_lengths() {
    for case in [
        "spectral",
        "collimator",
        "organs",
        "breathing",
        "descent",
        "osem",
    ] {
        let of = |cm: f64| {
            let phantom = study(case, cm);
            let views = phantom.sinograms(0, &no_observer).unwrap().samples;
            let found = phantom.warnings().unwrap();
            let in_bone = |warning: &&Warning| warning.what == WarningKind::InBone;
            let overlap = found.iter().find(in_bone);
            let overlap = overlap.map(|warning| warning.numbers["volume_ml"]);
            (views, phantom.volume(0).unwrap(), overlap)
        };
        let (views, volume, overlap) = of(1.0);
        assert_eq!(overlap.is_some(), ["organs", "osem"].contains(&case));
        // Holes are at most 1000 cm long, shifts 100 cm.
        let largest = match case {
            "collimator" | "osem" => 200.0,
            "breathing" => 60.0,
            _ => 1000.0,
        };
        for cm in [0.05, largest] {
            let (scaled_views, scaled_volume, scaled_overlap) = of(cm);
            for (scaled, expected, unit) in
                [(scaled_views, &views, cm), (scaled_volume, &volume, 1.0)]
            {
                let most = expected.iter().copied().fold(0.0f32, f32::max);
                let off = (scaled.iter().zip(expected))
                    .map(|(a, b)| (f64::from(*a) / unit - f64::from(*b)).abs())
                    .fold(0.0, f64::max);
                // The solver's tolerance; samples are f32.
                assert!(off < 1e-5 * f64::from(most), "{case} {cm}: {off} {most}");
            }
            let ratio = scaled_overlap
                .zip(overlap)
                .map(|(a, b)| a / (b * cm.powi(3)));
            assert!(ratio.is_none_or(|ratio| (ratio - 1.0).abs() < 1e-6));
            assert_eq!(scaled_overlap.is_some(), overlap.is_some());
        }
    }
}

/// The number of rays does not depend on the width of the response in bins.
#[test]
fn a_response_may_be_far_wider_than_the_bins() {
    let mut scene = Scene::from_toml(
        "[collimator]\nholes = 'ge-lehr'\nintrinsic_fwhm = 0.38\n[camera]\nviews = 4\nbins = 8\nrows = 8\npitch = [0.001, 0.001]\n",
    )
    .unwrap();
    scene = scene.with_mode(Mode::Static { phase: 0.0 });
    let phantom = Phantom::new(scene).unwrap();
    phantom.prepare().unwrap();
    let view = phantom.view(0, 0).unwrap();
    // The image is constant over 0.008 cm.
    assert!(view.iter().all(|sample| *sample > 0.0));
    assert!(
        view.iter()
            .all(|sample| (sample / view[0] - 1.0).abs() < 0.01)
    );
    assert!(phantom.work().rays_cast < 1_000_000);
}

/// Sections of a scene on a detector of two small sides; the same scene is validated and run.
fn samples(sections: &str, bins: [usize; 2], pitch: [f64; 2]) -> (Vec<f32>, Phantom) {
    let ([bins, rows], [bin, row]) = (bins, pitch);
    let text = format!(
        "[heart]\ndiscretisation = {{ differences = {{ nodes = 61 }} }}\n{sections}\n\
         [camera]\nviews = 4\nbins = {bins}\nrows = {rows}\npitch = [{bin}, {row}]\n[truth]\ntolerance = 0.02\n"
    );
    let scene = Scene::from_toml(&text).unwrap();
    let phantom = Phantom::new(scene.with_mode(Mode::Static { phase: 0.0 })).unwrap();
    phantom.prepare().unwrap();
    assert!(phantom.memory().each_thread < 64 << 20, "{text}");
    let folder = tempfile::tempdir().unwrap();
    run(&phantom, folder.path(), &no_observer).unwrap();
    assert!(phantom.work().rays_cast < 1_000_000, "{text}");
    (phantom.view(0, 0).unwrap(), phantom)
}

/// Behind a response that is far wider than the heart, a sample is the total activity times the density of the response at its centre.
#[test]
fn a_response_may_be_wider_than_the_heart() {
    for fwhm in [180.0, 1000.0] {
        for pitch in [1e-3, 1e-6] {
            for rows in [8, 1] {
                let sections = format!("[collimator]\nholes = 'ge-lehr'\nintrinsic_fwhm = {fwhm}");
                let (view, phantom) = samples(&sections, [8, rows], [pitch; 2]);
                let variance = fwhm * fwhm / (8.0 * 2f64.ln());
                let peak = 1.0 / (std::f64::consts::TAU * variance);
                let expected = phantom.numbers().unwrap().wall_volume * peak;
                // The wall reaches 7 cm from the axis: (7 cm)^2 / (2 variance).
                let most = 24.5 / variance;
                for sample in view {
                    let off = f64::from(sample) / expected - 1.0;
                    assert!(-most < off && off < 1e-3, "{fwhm} {pitch} {rows}: {off}");
                }
            }
        }
    }
}

/// A single row has no smallest height.
#[test]
fn a_row_may_be_far_lower_than_the_blur() {
    let of = |height| samples("[blur]\nfwhm = 8.0", [20, 1], [1.0, height]).0;
    let expected = of(0.1);
    let most = expected.iter().copied().fold(0.0f32, f32::max);
    for height in [1e-3, 1e-6] {
        for (found, expected) in of(height).iter().zip(&expected) {
            // The tolerance of the quadrature; the average over 0.1 cm differs by 4e-5.
            assert!(
                (found - expected).abs() < 2e-3 * most,
                "{height}: {found} {expected}"
            );
        }
    }
}

/// 2^31 voxels and as many samples, of which a run needs several copies.
#[cfg(target_os = "linux")]
#[test]
fn insufficient_memory_is_an_error_before_any_view() {
    let mut scene = Scene::default().with_size(1290);
    scene.camera.views = 1;
    scene.reconstruction.arc = ArcPolicy::Extend;
    scene = scene.with_mode(Mode::Gated { gates: 64 });
    scene.output.gates = heart_phantom::GateFiles::OneFile;
    let phantom = Phantom::new(scene).unwrap();
    // 64 gates of two volumes of 8 GB each exceed the memory of any test machine.
    assert!(phantom.memory().total() > 1 << 40);
    let error = phantom.prepare().unwrap_err();
    let PhantomError::Rejected { source, .. } = error else {
        panic!("{error:?}")
    };
    assert!(matches!(*source, PhantomError::Memory { .. }), "{source}");
}

#[cfg(target_os = "linux")]
#[test]
fn memory_is_divided_among_concurrent_runs() {
    let phantom = || Phantom::new(twisted(1.0)).unwrap();
    phantom().with_memory_share(2, 1 << 20).prepare().unwrap();
    for (runs, further) in [(1 << 40, 0), (1, 1 << 60)] {
        let phantom = phantom().with_memory_share(runs, further);
        match phantom.prepare().unwrap_err() {
            PhantomError::Rejected { source, .. } => {
                assert!(matches!(*source, PhantomError::Memory { .. }), "{source}");
            }
            error => panic!("{error:?}"),
        }
        assert_eq!(phantom.work().rays_cast, 0);
        let error = phantom.check_memory(&[Product::Truth], 0).unwrap_err();
        assert!(matches!(error, PhantomError::Memory { .. }), "{error}");
        let error = phantom.check_memory(&[Product::Truth], usize::MAX);
        assert!(matches!(
            error,
            Err(PhantomError::Count { what: "views", .. })
        ));
    }
}

/// A twist moves defects only: volumes without them need no more states.
#[test]
fn a_twist_without_defects_has_no_effect() {
    let truth = |is_twisted: bool| {
        let mut scene = twisted(1.0).with_mode(Mode::Gated { gates: 2 });
        scene.defects.clear();
        if !is_twisted {
            scene.twist = None;
        }
        Phantom::new(scene).unwrap().truth(0).unwrap()
    };
    assert!(truth(true) == truth(false));
}

/// One view of 2000, which need 8 GB.
#[test]
fn a_part_needs_its_own_memory_only() {
    let mut scene = twisted(1.0);
    (scene.camera.bins, scene.camera.rows, scene.camera.views) = (1000, 1000, 2000);
    scene.reconstruction.pixels = Some(4);
    let phantom = Phantom::new(scene).unwrap();
    assert!(phantom.memory().total() > 8_000_000_000);
    // Of 64 equal runs, on a machine of at least 4 GB.
    let phantom = phantom.with_memory_share(64, 0);
    phantom.check_memory(&[Product::Projections], 1).unwrap();
}

/// The wall is a difference of two bodies, whose rounding is not activity.
#[test]
fn exact_volumes_are_not_negative() {
    let text = "[heart]\ndiscretisation = { differences = { nodes = 61 } }\n[cycle]\n\
        [camera]\nviews = 6\nbins = 16\nrows = 14\npitch = [1.0, 1.1]\n\
        [acquisition]\naccuracy = { steps = 4 }\n[reconstruction]\narc = 'extend'\n[truth]\ntolerance = 0.01\n\
        [breathing]\nshift = [-3, -3, -1.0]\nperiod = 2.0\ncurve = { lujan = { n = 5 } }\n";
    let phantom = Phantom::new(Scene::from_toml(text).unwrap()).unwrap();
    let truth = phantom.truth(0).unwrap();
    assert!(truth.iter().all(|voxel| *voxel >= 0.0));
}

/// Before the number of time steps is known, the estimate of the memory does not need the nodes of all views with the most levels of volume and
/// respiratory position, which take minutes with respiration or variable intervals.
#[test]
fn memory_is_estimated_before_the_time_steps_are_known() {
    for slow in [
        "[breathing]\nperiod = 4.0\ncurve = { sampled = [0.0, 0.4, 1.0] }\ngates = { amplitude = 2 }\n",
        "[beats]\nintervals = { list = [0.45, 0.5, 0.65, 0.4] }\n",
    ] {
        let scene = Scene::from_toml(&format!(
            "[heart]\ndiscretisation = {{ differences = {{ nodes = 41 }} }}\n\
             [cycle]\nbeats_per_minute = 120.0\ncurve = 'physiological'\n{slow}\
             [camera]\nviews = 4\nbins = 10\nrows = 8\npitch = [2.0, 2.2]\nseconds_per_view = 5.0\nradius = 22.0\n\
             [blur]\nfwhm = 1.0\n\
             [acquisition]\nmode = {{ gated = {{ gates = 2 }} }}\naccuracy = {{ tolerance = 0.2 }}\n",
        ));
        let phantom = Phantom::new(scene.unwrap()).unwrap();
        let before = phantom.memory();
        phantom.prepare().unwrap();
        assert!(phantom.memory().shapes <= before.shapes, "{slow}");
    }
}

/// The resolution of bin averages is found at instants, as the views are: no view needs to contain the respiratory gate.
#[test]
fn instants_do_not_need_a_respiratory_gate_in_each_view() {
    let scene = Scene::from_toml(
        "[heart]\ndiscretisation = { differences = { nodes = 41 } }\n\
         [breathing]\nshift = [0.0, 0.0, -1.0]\ngates = { phase = 2 }\n\
         [camera]\nviews = 4\nbins = 9\nrows = 8\npitch = [2.0, 2.2]\nsamples = 'averages'\nrotation = 'continuous'\n\
         [acquisition]\nmode = 'instants'\naccuracy = { steps = 4 }\n[reconstruction]\narc = 'extend'\n",
    );
    let phantom = Phantom::new(scene.unwrap()).unwrap();
    phantom.prepare().unwrap();
    let views = phantom.sinograms(0, &no_observer).unwrap();
    assert!(views.samples.iter().any(|sample| *sample > 0.0));
}

/// The file has no other dependency than the standard library.
#[path = "../../src/phantom/memory_limit.rs"]
mod memory_limit;

#[test]
fn the_limit_is_that_of_the_smallest_group_around_the_process() {
    if cfg!(target_os = "linux") {
        assert!(memory_limit::memory_limit().is_some_and(|bytes| bytes > 1 << 20));
    }
    let root = tempfile::tempdir().unwrap();
    let put = |path: &str, text: &str| {
        let path = root.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let limit = |groups| memory_limit::limit_of_groups(groups, root.path());
    assert_eq!(limit("0::/job/step\n"), None);
    put("job/step/memory.max", "max\n");
    put("job/memory.max", "3000\n");
    put("other/memory.max", "10\n");
    assert_eq!(limit("0::/job/step\n"), Some(3000));
    put("memory.max", "2000\n");
    assert_eq!(limit("0::/job/step\n"), Some(2000));
    put("job/step/memory.max", "1000\n");
    assert_eq!(limit("0::/job/step\n"), Some(1000));
    assert_eq!(limit("0::/\n"), Some(2000));
    // Version 1, with other controllers; the group may be that of another name space.
    put("memory/a/memory.limit_in_bytes", "500\n");
    put("memory/memory.limit_in_bytes", "9223372036854771712\n");
    assert_eq!(limit("3:cpu:/a\n4:hugetlb,memory:/a/b\n"), Some(500));
    let unlimited = Some(9_223_372_036_854_771_712);
    assert_eq!(limit("4:memory:/docker/c\n1:name=systemd:/a\n"), unlimited);
}
