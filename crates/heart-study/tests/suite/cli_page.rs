//! The page of a run: self-contained, of limited size, and optional.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::Command;

const SCENE: &str = "[heart]\ndiscretisation = { differences = { nodes = 51 } }\n\
    [camera]\nviews = 6\nbins = 20\nrows = 16\npitch = [0.9, 1.1]\n\
    [acquisition]\nmode = { gated = { gates = 3 } }\naccuracy = { steps = 6 }\n[truth]\ntolerance = 0.1\n";

fn run(folder: &Path, rest: &str, arguments: &[&str]) -> serde_json::Value {
    run_scene(folder, &format!("{SCENE}{rest}"), arguments)
}

fn run_scene(folder: &Path, scene: &str, arguments: &[&str]) -> serde_json::Value {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(["run", "scene.toml", "--out", "out", "--json"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Returns the content of the element with this identifier.
fn data<'a>(page: &'a str, id: &str) -> &'a str {
    let from = page.find(&format!("id=\"{id}\"")).unwrap();
    let from = from + page[from..].find('>').unwrap() + 1;
    &page[from..from + page[from..].find('<').unwrap()]
}

fn unpacked(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let packed = STANDARD.decode(text).unwrap();
    flate2::read::GzDecoder::new(packed.as_slice())
        .read_to_end(&mut bytes)
        .unwrap();
    bytes
}

#[test]
fn a_page_is_self_contained() {
    let folder = tempfile::tempdir().unwrap();
    let report = run(folder.path(), "", &[]);
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    assert!(page.len() < 25_000_000);
    // Nothing is fetched: the only addresses are XML namespaces, and no other file is used.
    for address in ["src=\"http", "href=\"http", "url(http", "@import", "<link"] {
        assert!(!page.contains(address), "{address}");
    }
    for image in page.split("<img src=\"").skip(1) {
        assert!(image.starts_with("data:image/png;base64,"));
    }
    let edv = report["numbers"]["edv"].as_f64().unwrap();
    assert!(page.contains(&format!("<td>{edv:.3}</td>")));
    assert_eq!(page.matches("<svg").count(), 6); // polar maps of two gates, volume, pressures, profiles, views
    // Images come before curves, and these before tables; all have labels, and the viewer is hidden until it works.
    let places = ["id=\"beat\"", "<img", "<svg", "<table"].map(|part| page.find(part).unwrap());
    assert!(places.is_sorted(), "{places:?}");
    for labelled in [
        "<div id=\"beat-view\" hidden>",
        "<label for=\"beat-volume\">",
        "<label for=\"beat-gate\">",
    ] {
        assert!(page.contains(labelled), "{labelled}");
    }
    for (tag, label) in [
        ("<svg", "aria-label=\""),
        ("<canvas", "aria-label=\""),
        ("<img", "alt=\""),
    ] {
        for element in page.split(tag).skip(1) {
            let element = element.split('>').next().unwrap();
            let (_, text) = element.split_once(label).unwrap();
            assert!(!text.starts_with('"'), "{tag} {element}");
        }
    }
    // Units of voxels and samples; views and angles.
    for text in [
        "<title>Run of scene.toml</title>",
        "force intensity (stiffness x cm)",
        "activity concentration (1/mL)",
        "the largest voxel value of these sections",
        "Views 0 at 0.0° to 5 at 150.0°. A sample is activity concentration times cm.",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // The library, and its licence.
    assert!(unpacked(data(&page, "niivue")).starts_with(b"(function("));
    assert!(page.contains("BSD 2-Clause License") && page.contains("Copyright (c) 2021, Niivue"));
    // The volumes: all gates, at the position of the grid, in their unit.
    for name in ["reconstruction", "truth"] {
        let nifti = unpacked(data(&page, name));
        let short = |at: usize| i16::from_le_bytes([nifti[at], nifti[at + 1]]);
        let float = |at: usize| f32::from_le_bytes(nifti[at..at + 4].try_into().unwrap());
        let sides = [40, 42, 44, 46, 48].map(short);
        assert_eq!(sides, [4, 20, 20, 16, 3]);
        assert_eq!(nifti.len(), 352 + 20 * 20 * 16 * 3);
        assert!((float(92) - 60.0 / 65.0 / 3.0).abs() < 1e-6);
        let most = nifti[352..].iter().max().unwrap();
        let white = f32::from(*most) * float(112);
        assert!(*most > 200 && white > 0.3, "{name}: {white}");
        // The gates differ.
        let gate = |k: usize| &nifti[352 + k * 6400..352 + (k + 1) * 6400];
        assert!(gate(0) != gate(1));
    }
    assert!(
        report["files"]
            .as_array()
            .unwrap()
            .contains(&"index.html".into())
    );
    // A page of the same scene has the same bytes, also from one thread.
    run(folder.path(), "", &["--threads", "1"]);
    assert!(page == fs::read_to_string(folder.path().join("out/index.html")).unwrap());
}

/// Polar maps, difference and tables of the page against the report; gates are numbered from 0.
#[test]
fn a_page_compares_image_and_truth() {
    let folder = tempfile::tempdir().unwrap();
    let noise = "[noise]\ncounts = { total = 1e5 }\nseed = 1\n";
    let report = run(folder.path(), noise, &[]);
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    // End-diastole is at phase 1/2, in the second of three gates; end-systole at phase 0.
    let mut segments = Vec::new();
    for gate in [1, 0] {
        for map in ["polar_map", "polar_map_truth"] {
            let of = report["gates"][gate][map]["segments"].as_array().unwrap();
            segments.extend(of.iter().map(|value| value.as_f64().unwrap()));
        }
    }
    let largest = segments.iter().copied().fold(0.0, f64::max);
    let expected: Vec<String> = (segments.iter())
        .map(|value| format!("{:.0}", 100.0 * value / largest))
        .collect();
    let drawn: Vec<&str> = (page.split("<text ").skip(1))
        .filter_map(|text| {
            let (attributes, text) = text.split_once('>')?;
            let is_value = attributes.ends_with("\"#000\"") || attributes.ends_with("\"#fff\"");
            is_value.then(|| text.split('<').next().unwrap())
        })
        .collect();
    assert_eq!(drawn, expected);
    assert!(page.contains("Reconstruction minus exact activity, gate 1 (of 3)"));
    assert!(page.contains("Profile through the wall in the short-axis section, gate 0 (of 3)"));
    assert!(page.contains(
        "phase 0 is end-systole (sinusoidal volume curve). End-diastole is at phase 0.500, end-systole at phase 0.000."
    ));
    let number = |value: &serde_json::Value, digits: usize| {
        format!("<td>{:.digits$}</td>", value.as_f64().unwrap())
    };
    let measured = &report["measured"];
    for (name, value) in [
        ("ejection fraction", &report["numbers"]["ejection_fraction"]),
        (
            "ejection fraction measured in the reconstructions",
            &measured["ejection_fraction"],
        ),
        (
            "ejection fraction measured in the exact activity",
            &measured["ejection_fraction_truth"],
        ),
    ] {
        let row = format!("<th scope=\"row\">{name}</th>{}", number(value, 5));
        assert!(page.contains(&row), "{row}");
    }
    for (k, gate) in report["gates"].as_array().unwrap().iter().enumerate() {
        let row = format!(
            "<tr><th scope=\"row\">{k}</th>{}{}</tr>",
            number(&gate["counts"], 0),
            number(&gate["counts_per_unit"], 5)
        );
        assert!(page.contains(&row), "{row}");
        let artefacts = &gate["artefacts"];
        let row = format!(
            "<tr><th scope=\"row\">{k}</th>{}{}{}",
            number(&artefacts["wall_mean"], 4),
            number(&artefacts["wall_unevenness"], 4),
            number(&artefacts["wall_erosion"], 0)
        );
        assert!(page.contains(&row), "{row}");
    }
}

/// Gated projection set 4 is cardiac gate 1 of 3 in the second respiratory gate.
#[test]
fn a_page_names_respiratory_gates() {
    let folder = tempfile::tempdir().unwrap();
    let breathing = "[noise]\ncounts = { total = 1e5 }\nseed = 1\n\
        [breathing]\nshift = [0.0, 0.0, 1.0]\nperiod = 0.25\ngates = { phase = 2 }\n";
    let report = run(folder.path(), breathing, &[]);
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    let breath = report["phases"][4]["breath"].as_f64().unwrap();
    assert!(page.contains("<th scope=\"col\">respiratory position</th>"));
    let row = page.split("<tr><th scope=\"row\">gate-04, respiratory gate 1 (of 2)</th>");
    let row = row.last().unwrap().split("</tr>").next().unwrap();
    assert!(row.ends_with(&format!("<td>{breath:.4}</td>")), "{row}");
    let rows = page.matches("<tr><th scope=\"row\">4, respiratory gate 1 (of 2)</th>");
    assert_eq!(rows.count(), 2); // counts and image quality
    assert!(page.contains("set 1: cardiac gate 1 (of 3), phase 0.500, respiratory gate 0 (of 2)"));
}

/// Intervals of 0.9, 0.95 and 1.3 s, repeated; the longest is rejected.
#[test]
fn a_page_counts_variable_beats_and_defines_their_phase() {
    let folder = tempfile::tempdir().unwrap();
    let beats = "[beats]\nintervals = { list = [0.9, 0.95, 1.3] }\naccepted = [0.8, 1.2]\ngated_by = 'time-after-r'\n";
    // Long views, which contain all gates in accepted beats.
    let beats = format!("[output]\nwrite = ['projections']\n{beats}");
    let scene = SCENE.replace("views = 6\n", "views = 6\nseconds_per_view = 6.2\n");
    let report = run_scene(folder.path(), &format!("{scene}{beats}"), &[]);
    let page = fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    // Twelve groups of three beats begin in 37.2 s.
    assert_eq!(report["beats"]["rejected"], 12);
    for row in [
        "<th scope=\"row\">accepted</th><td>24</td><td>0.9000</td><td>0.9500</td>",
        "<th scope=\"row\">rejected</th><td>12</td><td>1.3000</td><td>1.3000</td>",
    ] {
        assert!(page.contains(row), "{row}");
    }
    assert!(page.contains("systole keeps its duration and diastole takes the remaining time"));
    assert!(page.contains("Gates are equal times after phase 0: together 0.923 s"));
}

#[test]
fn a_page_is_omitted_on_request() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "", &[]);
    let page = folder.path().join("out/index.html");
    assert!(page.exists());
    // The page of the earlier run is removed.
    let without = run(folder.path(), "", &["--no-html"]);
    assert!(!page.exists());
    assert!(
        !without["files"]
            .as_array()
            .unwrap()
            .contains(&"index.html".into())
    );
    // Without volumes there is a page without a viewer.
    run(folder.path(), "[output]\nwrite = ['projections']\n", &[]);
    let page = fs::read_to_string(page).unwrap();
    assert!(!page.contains("id=\"niivue\"") && page.contains("<h2>Projections</h2>"));
}

/// All gates of a study in one file each; all listed files exist.
#[test]
fn a_study_with_one_file_per_product() {
    let folder = tempfile::tempdir().unwrap();
    let output = "[output]\nwrite = ['projections', 'reconstruction', 'truth', 'labels', 'pictures']\n\
        gates = 'one-file'\nvolumes = 'nifti'\n";
    let dicom = cfg!(feature = "dicom");
    let projections = if dicom {
        "projections = 'dicom'\n"
    } else {
        "projections = 'nrrd'\n"
    };
    let report = run(
        folder.path(),
        &format!("{output}{projections}"),
        &["--no-html"],
    );
    let mut files: Vec<&str> = (report["files"].as_array().unwrap().iter())
        .map(|file| file.as_str().unwrap())
        .filter(|file| !file.ends_with(".png"))
        .collect();
    files.sort_unstable();
    let views = if dicom {
        "projections.dcm"
    } else {
        "projections.nrrd"
    };
    assert_eq!(
        files,
        [
            "beat.gif",
            "curves.svg",
            "labels.nii",
            views,
            "reconstruction.nii",
            "report.json",
            "truth.nii"
        ]
    );
    let nifti = fs::read(folder.path().join("out/truth.nii")).unwrap();
    assert_eq!(nifti.len(), 352 + 4 * 3 * 20 * 20 * 16);
    // The gates equal those of separate files.
    run(
        folder.path(),
        "[output]\nwrite = ['truth']\n",
        &["--no-html"],
    );
    for gate in 0..3 {
        let own = fs::read(folder.path().join(format!("out/truth-gate-0{gate}.npy"))).unwrap();
        let len = 4 * 20 * 20 * 16;
        assert!(nifti[352 + gate * len..352 + (gate + 1) * len] == own[own.len() - len..]);
    }
    // A format that cannot store them is rejected, with the field.
    fs::write(
        folder.path().join("scene.toml"),
        format!("{SCENE}[output]\ngates = 'one-file'\nprojections = 'interfile-stir'\n"),
    )
    .unwrap();
    let refused = Command::new(env!("CARGO_BIN_EXE_heart-phantom"))
        .args(["check", "scene.toml"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(
        said.contains("output.projections") && said.contains("one file"),
        "{said}"
    );
}
