//! DICOM of gated studies and of two heads.

use super::*;

/// Two heads over the same half turn, gates with rejected beats: frames are sorted by detector, gate and view.
#[test]
fn two_heads_are_two_detectors_with_counted_beats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.dcm");
    const EACH: usize = 4;
    let angle = |head: usize, k: usize| 0.5 + 1.5 * head as f64 + 0.7 * k as f64;
    let angles: Vec<f64> = (0..2 * EACH).map(|k| angle(k / EACH, k % EACH)).collect();
    let (detector, one) = stack(&angles, [0.0; 2]);
    let samples: Vec<f32> = (0..GATES)
        .flat_map(|gate| one.iter().map(move |v| v + 10.0 * gate as f32))
        .collect();
    let info = AcquisitionInfo {
        heads: 2,
        decay_corrected: true,
        beats: Some(BeatCounts {
            accepted: 61,
            rejected: 7,
            mean: 0.9,
            limits: [0.8, 1.1],
            rejects: true,
        }),
        ..AcquisitionInfo::default()
    };
    let projections =
        Projections::of_gates(detector, &angles, &[RADIUS], samples.as_slice(), 0.45).unwrap();
    // As one head the angles are uneven.
    assert!(write(&path, &projections, Format::Dicom).is_err());
    write(
        &path,
        &projections.with_acquisition(info).unwrap(),
        Format::Dicom,
    )
    .unwrap();
    validate(&path);
    let file = open_file(&path).unwrap();
    assert_eq!(shorts(&file, tags::NUMBER_OF_DETECTORS), [2]);
    assert_eq!(text(&file, tags::CORRECTED_IMAGE).trim(), "DECY");
    assert_eq!(text(&file, tags::BEAT_REJECTION_FLAG).trim(), "Y");
    let times = beat_times(&file);
    for (tag, expected) in [
        (tags::INTERVALS_ACQUIRED, 61),
        (tags::INTERVALS_REJECTED, 7),
        (tags::LOW_RR_VALUE, 800),
        (tags::HIGH_RR_VALUE, 1100),
        (tags::NOMINAL_INTERVAL, 900),
    ] {
        assert_eq!(
            times.element(tag).unwrap().to_int::<i32>().unwrap(),
            expected
        );
    }
    let frame = times.element(tags::FRAME_TIME).unwrap();
    assert_eq!(frame.to_float64().unwrap(), 450.0);
    let detectors = file
        .element(tags::DETECTOR_INFORMATION_SEQUENCE)
        .unwrap()
        .items()
        .unwrap();
    let starts: Vec<f64> = (detectors.iter())
        .map(|item| {
            item.element(tags::START_ANGLE)
                .unwrap()
                .to_float64()
                .unwrap()
        })
        .collect();
    let [of, slot, view] = [
        tags::DETECTOR_VECTOR,
        tags::TIME_SLOT_VECTOR,
        tags::ANGULAR_VIEW_VECTOR,
    ]
    .map(|tag| shorts(&file, tag));
    let (found, factor) = samples_of(&file);
    for (k, value) in found.iter().enumerate() {
        let frame = k / (ROWS * BINS);
        let (head, gate, view) = (of[frame] - 1, slot[frame] - 1, view[frame] - 1);
        let order = (usize::from(head) * GATES + usize::from(gate)) * EACH + usize::from(view);
        assert_eq!(order, frame);
        let theta = angle(head.into(), view.into());
        let start = -starts[usize::from(head)].to_radians();
        assert!((start - angle(head.into(), 0)).sin().abs() < 1e-9);
        let s = -((k % BINS) as f64 - 2.0) * PITCH[0];
        let z = (1.5 - (k / BINS % ROWS) as f64) * PITCH[1];
        let expected = seen(theta, [s, z]) + 10.0 * f64::from(gate);
        assert!(
            (value - expected).abs() < 0.51 * factor,
            "{value} {expected}"
        );
    }
}

/// Two heads, gates and rejected beats: intervals, times and detectors of all files equal those of the scene and of `report.json`.
#[test]
fn files_of_a_gated_study_with_rejected_beats_equal_its_report() {
    const LIST: [f64; 5] = [0.9, 1.0, 1.5, 0.8, 0.6];
    let scene = format!(
        "[heart]\ndiscretisation = {{ differences = {{ nodes = 41 }} }}\n\
         [beats]\nintervals = {{ list = {LIST:?} }}\naccepted = [0.7, 1.2]\n\
         [camera]\nviews = 4\nbins = 12\nrows = 10\npitch = [1.4, 1.6]\nseconds_per_view = 5.0\nstart = 30.0\narc = 180.0\n\
         heads = {{ two = {{ angle = 90.0 }} }}\nradius = {{ ellipse = {{ semi_axes = [25.0, 20.0] }} }}\n\
         [acquisition]\nmode = {{ gated = {{ gates = 2 }} }}\naccuracy = {{ steps = 4 }}\n\
         [output]\nprojections = 'dicom'\nvolumes = 'dicom'\ngates = 'one-file'\n"
    );
    let phantom = Phantom::new(Scene::from_toml(&scene).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    run(&phantom, folder.path(), &no_observer).unwrap();
    let report = fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    // The beats that begin in four views of 5 s.
    let mut beats: Vec<f64> = Vec::new();
    while beats.iter().sum::<f64>() < 20.0 {
        beats.push(LIST[beats.len() % LIST.len()]);
    }
    let accepted: Vec<f64> = (beats.iter().copied())
        .filter(|interval| (0.7..=1.2).contains(interval))
        .collect();
    let [n, rejected] = [accepted.len(), beats.len() - accepted.len()];
    assert_eq!(report["beats"]["beats"], n + rejected);
    assert_eq!(report["beats"]["rejected"], rejected);
    let mean = accepted.iter().sum::<f64>() / n as f64;
    let files = report["files"].as_array().unwrap();
    let names = files.iter().filter_map(|name| name.as_str());
    let names: Vec<&str> = names.filter(|name| name.ends_with(".dcm")).collect();
    assert_eq!(names.len(), 3, "projections, volume, ground truth");
    for name in names {
        let path = folder.path().join(name);
        validate(&path);
        let file = open_file(&path).unwrap();
        assert_eq!(text(&file, tags::BEAT_REJECTION_FLAG).trim(), "Y");
        let gated = &items(&file, tags::GATED_INFORMATION_SEQUENCE)[0];
        let times = gated.element(tags::DATA_INFORMATION_SEQUENCE).unwrap();
        let times = &times.items().unwrap()[0];
        for (tag, expected) in [
            (tags::INTERVALS_ACQUIRED, n as f64),
            (tags::INTERVALS_REJECTED, rejected as f64),
            (tags::LOW_RR_VALUE, 700.0),
            (tags::HIGH_RR_VALUE, 1200.0),
            (tags::NOMINAL_INTERVAL, (1e3 * mean).round()),
        ] {
            let found = times.element(tag).unwrap().to_float64().unwrap();
            assert_eq!(found, expected, "{name} {tag}");
        }
    }
    assert_times_and_detectors(folder.path(), &report, 20.0 - accepted.iter().sum::<f64>());
}

/// Four views on each of two heads, two gates; `lost` is the time of rejected beats, to a beat at the end.
fn assert_times_and_detectors(folder: &Path, report: &serde_json::Value, lost: f64) {
    let file = open_file(folder.join("projections.dcm")).unwrap();
    let turn = &items(&file, tags::ROTATION_INFORMATION_SEQUENCE)[0];
    let number = |tag| turn.element(tag).unwrap().to_float64().unwrap();
    let seconds = report["scene"]["camera"]["seconds_per_view"].as_f64();
    assert_eq!(Some(1e-3 * number(tags::ACTUAL_FRAME_DURATION)), seconds);
    assert_eq!(number(tags::NUMBER_OF_FRAMES_IN_ROTATION), 4.0);
    assert_eq!(text(&file, tags::NUMBER_OF_FRAMES).trim(), "16");
    // The times of the gates, without rejected beats, are within it.
    let window = |gate: usize, view: usize| {
        let seconds = &report["gates"][gate]["views"]["window_s"][view];
        seconds.as_f64().unwrap()
    };
    let used: f64 = (0..4).map(|view| window(0, view) + window(1, view)).sum();
    assert!((20.0 - used - lost).abs() < 1.5, "{used} {lost}");
    let views = &report["gates"][0]["views"];
    let detectors = items(&file, tags::DETECTOR_INFORMATION_SEQUENCE);
    assert_eq!(detectors.len(), 2);
    for (head, item) in detectors.iter().enumerate() {
        let start = item.element(tags::START_ANGLE).unwrap();
        let angle = views["angle_deg"][4 * head].as_f64().unwrap();
        assert!((start.to_float64().unwrap() + angle - 360.0).abs() < 1e-6);
        let radii = item.element(tags::RADIAL_POSITION).unwrap();
        for (k, mm) in radii.to_multi_float64().unwrap().into_iter().enumerate() {
            let cm = views["radius_cm"][4 * head + k].as_f64().unwrap();
            assert!((mm - 10.0 * cm).abs() < 1e-6 * mm);
        }
    }
}
