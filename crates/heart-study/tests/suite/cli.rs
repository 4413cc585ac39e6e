//! The command line: a small version of the whole study, and messages for bad input.

use std::path::Path;
use std::process::{Command, Output};

fn heart_phantom(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(arguments)
        .output()
        .unwrap()
}

fn paper(out: &Path, arguments: &[&str]) -> Output {
    let out = out.to_str().unwrap();
    heart_phantom(&[&["paper", "--out", out], arguments].concat())
}

const SMALL: [&str; 6] = ["--size", "48", "--views", "24", "--nodes", "101"];

fn number(report: &serde_json::Value, path: &str) -> f64 {
    let value = path.split('.').fold(report, |value, key| &value[key]);
    value.as_f64().unwrap_or_else(|| panic!("{path}: {value}"))
}

#[test]
fn the_study_writes_its_report_figures_and_arrays() {
    let folder = tempfile::tempdir().unwrap();
    let output = paper(folder.path(), &SMALL);
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    let get = |path: &str| number(&report, path);
    for balloon in ["inner", "outer"] {
        for measure in ["length", "area", "volume"] {
            let discrete = get(&format!("reference.{balloon}.{measure}"));
            let exact = get(&format!("reference.{balloon}.{measure}_exact"));
            // Second order in 1/100 of the curve; the constant is below 10 for each quantity.
            assert!((discrete / exact - 1.0).abs() < 1e-3, "{balloon} {measure}");
        }
    }
    // The converged references; the mesh-independent values agree to all their digits.
    assert!((get("direct.limit.f_inner") - 17.48357527761).abs() < 1e-9);
    assert!((get("direct.limit.f_outer") - 10.30942447850).abs() < 1e-9);
    assert!((get("direct.f_inner") / 17.48357527761 - 1.0).abs() < 1e-3);
    assert!((get("direct.f_outer") / 10.30942447850 - 1.0).abs() < 1e-3);
    assert!(get("direct.wall_volume_error").abs() < 1e-12);
    assert!(get("direct.newton_iterations") <= 8.0);
    assert!(get("direct.residual") < 1e-8);
    assert!((get("direct.v_inner") / get("reference.inner.volume") - 1.6).abs() < 1e-10);
    assert!(get("direct.v_outer") > get("direct.v_inner"));
    // With the printed Jacobian Newton's method stalls, with the corrected one it converges quadratically.
    assert!(get("direct.printed_jacobian_residual_after_60") > 6.0);
    let history = report["direct"]["newton_history"].as_array().unwrap();
    let history: Vec<f64> = history.iter().map(|norm| norm.as_f64().unwrap()).collect();
    assert!(history.len() == 4 && history[0] == 17.5 && history[3] < 1e-8);
    assert!((history[1] - 0.2725).abs() < 1e-3 && (history[2] - 6.57e-6).abs() < 1e-7);
    assert!(get("evolving.steps") <= 10.0);
    assert!(get("evolving.residual") <= 1e-4);
    assert_eq!(report["evolving"]["monotone"], true);
    assert_eq!(report["evolving"]["small_step_monotone"], false);
    assert!(get("evolving.distance_to_direct") < 1e-4);
    assert!((get("circle.order") - 2.0).abs() < 0.01);
    // p / (mu h) of the fine mesh times 400 kPa and 0.05 cm; second order in 1/100 of the curve, except in a layer at the ring
    let mmhg = 0.371980648542 * 400.0 * 0.05 * 1000.0 / 133.322387415;
    assert!((get("rubber.inner_mmhg") / mmhg - 1.0).abs() < 1e-2);
    assert!(get("rubber.outer_mmhg") < get("rubber.inner_mmhg"));
    assert!(get("rubber.wall_volume_error").abs() < 1e-12);
    assert!((0.01..0.3).contains(&get("rubber.view_difference")));
    assert_eq!(get("short.distinct_shapes"), 12.0);
    assert_eq!(get("long.quadrature_points"), 32.0);
    assert!(get("long.view_error") < 0.01);
    // Work: each ray of a view once for each of its shapes, 17 for the 32 mirrored phases of a beat; three in four are never cast. The
    // phases of the masks contain all shapes of the first two scans, and 5 of the 17; the tolerance of the ground truth needs 8 more.
    for (name, shapes_a_view, shapes_solved) in [
        ("static", 1.0, 0.0),
        ("short", 1.0, 0.0),
        ("long", 17.0, 20.0),
    ] {
        let (cast, skipped) = (
            get(&format!("{name}.rays_cast")),
            get(&format!("{name}.rays_skipped")),
        );
        assert_eq!(cast + skipped, shapes_a_view * 24.0 * 48.0 * 48.0, "{name}");
        assert!(
            cast < 0.25 * (cast + skipped),
            "{name}: {cast} of {skipped}"
        );
        assert_eq!(get(&format!("{name}.shapes_solved")), shapes_solved);
    }
    let wall = get("reference.outer.volume") - get("reference.inner.volume");
    for prefix in ["", "hann."] {
        for name in ["static", "short", "long"] {
            let of = |key: &str| get(&format!("{prefix}{name}.{key}"));
            assert!((of("total_activity") / wall - 1.0).abs() < 0.02);
            assert!(of("background_rms") > 0.0);
        }
        // Instants represent different hearts: the ground truth is their average, and is named so.
        assert_eq!(report["short"]["truth"], "mean-of-views");
        assert_eq!(report["long"]["truth"], "each-view");
        assert!(get("short.rmse_truth") > get("long.rmse_truth"));
        let background = |name: &str| get(&format!("{prefix}{name}.background_rms"));
        assert!(background("long") < background("short"));
    }
    for key in ["solve", "project", "reconstruct", "total"] {
        assert!(get(&format!("time.{key}")) > 0.0);
    }
    if cfg!(target_os = "linux") {
        assert!(get("peak_memory_bytes") > 1e6);
    }

    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    for figure in 8..=18 {
        let name = format!("fig{figure:02}-");
        let shown = page.matches(&format!("src=\"{name}")).count();
        assert_eq!(
            shown,
            if (15..=17).contains(&figure) { 3 } else { 1 },
            "{name}"
        );
    }
    for name in ["rubber-wall.png", "rubber-pressure.svg", "rubber-view.svg"] {
        assert!(page.contains(&format!("src=\"{name}\"")), "{name}");
        assert!(folder.path().join(name).exists(), "{name}");
    }
    for name in ["static", "short", "long"] {
        let npy = |what: &str| {
            let path = folder.path().join(format!("{name}-{what}.npy"));
            let bytes = std::fs::read(path).unwrap();
            let header = String::from_utf8_lossy(&bytes[..128]).into_owned();
            (header, bytes.len() - 128)
        };
        for (what, shape, n) in [
            ("sinogram", "(24, 48, 48)", 24 * 48 * 48),
            ("ram-lak", "(48, 48, 48)", 48 * 48 * 48),
            ("hann", "(48, 48, 48)", 48 * 48 * 48),
        ] {
            let (header, bytes) = npy(what);
            assert!(header.contains(&format!("'shape': {shape}")), "{header}");
            assert_eq!(bytes, 4 * n, "{name} {what}");
        }
    }
}

#[test]
fn results_do_not_depend_on_threads_or_figures() {
    let runs: Vec<tempfile::TempDir> =
        [&["--threads", "1", "--no-figures"][..], &["--threads", "2"]]
            .into_iter()
            .map(|extra| {
                let folder = tempfile::tempdir().unwrap();
                let small = ["--size", "32", "--views", "6", "--nodes", "51"];
                let output = paper(folder.path(), &[&small, extra].concat());
                assert!(output.status.success(), "{output:?}");
                folder
            })
            .collect();
    for name in ["static", "short", "long"] {
        for what in ["sinogram", "ram-lak", "hann"] {
            let bytes = |run: &tempfile::TempDir| {
                std::fs::read(run.path().join(format!("{name}-{what}.npy"))).unwrap()
            };
            assert!(bytes(&runs[0]) == bytes(&runs[1]), "{name} {what}");
        }
    }
    assert!(!runs[0].path().join("index.html").exists());
}

#[test]
fn bad_input_is_rejected_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (arguments, says) in [
        (["--size", "0"], "size"),
        (["--size", "1000000"], "size"),
        (["--size", "many"], "--size"),
        (["--size", "-3"], "invalid value '-3' for '--size"),
        (["--views", "2"], "views"),
        (["--gain", "-0.5"], "gain"),
        (["--gain", "NaN"], "gain"),
        (["--gain", "1e9"], "gain"),
        (["--bpm", "0"], "bpm"),
        (["--bpm", "inf"], "bpm"),
        (["--nodes", "2"], "nodes"),
        (["--threads", "0"], "threads"),
        (["--colour", "red"], "--colour"),
    ] {
        let output = paper(&out, &arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(error.contains(says), "{arguments:?}: {error}");
        assert!(!error.contains("panicked"), "{error}");
        assert!(!out.exists(), "{arguments:?} wrote something");
    }
    assert_eq!(heart_phantom(&["paper"]).status.code(), Some(2));
    assert_eq!(heart_phantom(&[]).status.code(), Some(2));
    assert!(heart_phantom(&["--help"]).status.success());
}

#[test]
fn a_directory_that_cannot_be_created_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let output = paper(&file, &SMALL);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(
        error.contains("it exists and must be a directory"),
        "{error}"
    );
    let output = paper(&file.join("out"), &SMALL);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(error.contains(file.to_str().unwrap()), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "in the way");
}

/// A quick study of ejection fractions: true volumes, results of both edge rules, and every image of the page.
#[test]
fn the_study_of_ejection_fractions_writes_its_report_and_page() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let output = heart_phantom(&["ef", "--quick", "--out", out]);
    assert!(output.status.success(), "{output:?}");
    // The meaning of the numbers, and that those of a quick run have none.
    let said = String::from_utf8(output.stdout).unwrap();
    for part in [
        "half maximum / at the steepest gradient (true value)",
        "(127.0)",
        "numbers have no meaning",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    let cases = report["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 5);
    assert!(read("index.html").contains("from 2 realisations of the noise"));
    for case in cases {
        assert_eq!(case["realisations"], 2);
        assert!((number(case, "truth.edv") - 127.0).abs() < 0.01, "{case}");
        assert!(
            (number(case, "truth.fraction") - 0.55).abs() < 1e-4,
            "{case}"
        );
        for rule in 0..2 {
            let measured = &case["rules"][rule];
            let [edv, esv, fraction] =
                ["edv", "esv", "fraction"].map(|key| number(measured, &format!("expected.{key}")));
            assert!(0.0 < esv && esv < edv && edv < 150.0, "{case}");
            assert!((fraction - (edv - esv) / edv).abs() < 1e-12);
            assert!(number(measured, "mean.edv").is_finite());
        }
    }
    // A static heart without collimator, attenuation and filter window, in bins of 2 mm: from eight views both rules are accurate to 3 %.
    let ideal = &cases[4];
    assert_eq!(
        ideal["name"],
        "no filter window, motion, collimator or attenuation; bins of 2 mm"
    );
    for rule in 0..2 {
        let found = number(&ideal["rules"][rule], "expected.edv");
        assert!((found / 127.0 - 1.0).abs() < 0.03, "{found}");
    }
    let html = read("index.html");
    let images: Vec<&str> = (html.split("<img src=\"").skip(1))
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    assert!(!images.is_empty());
    for image in images {
        assert!(read(image).starts_with("<svg"), "{image}");
    }
    for file in report["files"].as_array().unwrap() {
        assert!(
            folder.path().join(file.as_str().unwrap()).exists(),
            "{file}"
        );
    }
    assert_eq!(report["quick"], true);
    // Without a report they are not replaced.
    std::fs::remove_file(folder.path().join("report.json")).unwrap();
    let output = heart_phantom(&["ef", "--quick", "--out", out]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("no report lists it"), "{said}");
    assert_eq!(read("index.html"), html);
}
