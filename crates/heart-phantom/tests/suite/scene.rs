//! Scenes: reading, and the places of errors.

use heart_phantom::PhantomError;
use heart_phantom::scene::*;
use heart_phantom::*;

mod bad_values;
mod changed;
mod messages;

/// Every optional section and field.
const FULL: &str = "
[heart]
law = 'per-current-length'
discretisation = { spectral = { degree = 12, per_piece = 2, tolerance = 1e-4 } }
[heart.inner]
length = 7.0
radius = 2.0
stiffness = 1.5
[cycle]
curve = { sampled = [120.0, 60.0, 50.0, 110.0] }
volume = { volumes = { edv = 150.0, esv = 120.0 } }
av_plane_displacement = 0.4
[beats]
intervals = { list = [0.9, 0.92] }
accepted = [0.5, 1.5]
gated_by = 'time-after-r'
[breathing]
shift = [0.1, 0.0, -1.5]
rotation_degrees = [1.0, 0.0, 0.0]
period = 3.5
curve = { lujan = { n = 2 } }
start = 0.25
[pose]
centre = 4.0
rotate_z = -10.0
shift = [1.0, 2.0, -3.0]
[activity]
cavity = { total = 7.0 }
[background]
concentration = 0.1
centre = [0.0, 1.0]
semi_axes = [7.0, 6.0]
[[defects]]
layers = [0.0, 0.5]
s = [0.1, 0.3]
azimuths_degrees = [-30.0, 30.0]
activity = 0.0
[[defects]]
layers = [0.5, 1.0]
s = [0.4, 0.5]
azimuths_degrees = [0.0, 360.0]
activity = 2.0
[twist]
inner_degrees = [-3.0, 4.0, 10.0]
outer_degrees = [-3.0, 8.0]
[[points]]
layer = 0.5
s = 0.2
azimuth_degrees = 30.0
[blur]
fwhm = 0.8
[noise]
counts = { total = 1e6 }
seed = 7
[attenuation]
coefficient = 0.15
medium = { torso = { centre = [0.0, 1.0], semi_axes = [16.0, 11.0] } }
[camera]
rotation = 'continuous'
arc = -360.0
[acquisition]
mode = { gated = { gates = 8 } }
accuracy = { tolerance = 0.01 }
[reconstruction]
window = { butterworth = { order = 5 } }
pixels = 64
pixel = 0.25
region = { x = [10, 20], y = [0, 64] }
[output]
write = ['labels', 'meshes']
volumes = 'meta-image'
projections = 'raw-json'
";

fn error_of(text: &str) -> SceneError {
    match Scene::from_toml(text) {
        Err(PhantomError::Scene(error)) => *error,
        other => panic!("{text}\n{other:?}"),
    }
}

#[test]
fn a_written_scene_is_restored() {
    let scene = Scene::default();
    assert_eq!(Scene::from_toml(&scene.to_toml()).unwrap(), scene);
    assert_eq!(Scene::from_toml("").unwrap(), scene);
    let scene = Scene::from_toml(FULL).unwrap();
    assert_eq!(scene.acquisition.mode, Mode::Gated { gates: 8 });
    let again = scene.to_toml();
    assert_eq!(Scene::from_toml(&again).unwrap(), scene, "{again}");
}

/// Two scenes that together contain everything optional, each without some parts; both have two defects.
#[test]
fn no_field_of_a_full_scene_is_commented_out() {
    let mut scene = Scene::from_toml(FULL).unwrap();
    scene.pose.centre = Some(5.0);
    scene.defects.resize(1, scene.defects[0]);
    scene.defects.push(Defect {
        activity: 0.625,
        ..scene.defects[0]
    });
    scene.reconstruction.window = radon::Window::Custom(vec![1.0, 0.5, 0.25]);
    // Sections that exclude background, torso and blur.
    let mut other = scene.clone();
    other.organs.push(OrganSettings {
        shape: OrganShapeSettings::Cylinder {
            centre: [0.0; 2],
            semi_axes: [9.0; 2],
        },
        activity: 0.1,
        attenuation: 0.1,
    });
    (other.background, other.blur) = (None, None);
    other.camera.samples = Some(heart_phantom::BinSample::Averages);
    (
        other.reconstruction.region,
        other.reconstruction.filter_fwhm,
    ) = (None, Some(1.0));
    other.chest = Some(Chest::default());
    if let Some(breathing) = &mut other.breathing {
        breathing.gates = Some(RespiratoryGates::Amplitude(1));
    }
    other.attenuation = Some(Attenuation {
        coefficient: 0.1,
        medium: Medium::Heart,
    });
    other.collimator = Some(CollimatorSettings {
        holes: HolesSettings::GeLehr,
        intrinsic_fwhm: 0.4,
    });
    other.counting = Some(Counting {
        sensitivity: 75.0,
        decay: Decay::HalfLifeHours(6.0),
    });
    other.scatter = Some(ScatterSettings {
        seed: 3,
        ..ScatterSettings::default()
    });
    other.noise = Some(Noise {
        counts: Counts::Expected,
        seed: 7,
    });
    let pages = [&scene, &other].map(Scene::to_toml);
    let is_field =
        |line: &&str| line.starts_with("# ") && line.contains(" = ") && line.contains("  # ");
    let left_out = |page: &'static str| -> Vec<&'static str> {
        (page.lines())
            .filter(|line| line.starts_with("# [") || is_field(line))
            .collect()
    };
    let [one, two] = pages.clone().map(|page| left_out(page.leak()));
    assert!(!one.is_empty() && !two.is_empty());
    assert!(
        one.iter().all(|line| !two.contains(line)),
        "{one:?} {two:?}"
    );
    for (page, scene) in pages.iter().zip([scene, other]) {
        assert_eq!(page.matches("[[defects]]").count(), 2);
        assert_eq!(Scene::from_toml(page).unwrap(), scene);
    }
}

/// A number that TOML cannot store is rejected at its place.
#[test]
fn numbers_that_are_too_large_to_write_are_rejected_with_their_line() {
    let noise = Noise {
        counts: Counts::Total(1e6),
        seed: u64::MAX,
    };
    let scene = Scene {
        noise: Some(noise),
        ..Scene::default()
    };
    let page = scene.to_toml();
    let error = error_of(&page);
    assert_eq!(error.first().field, "noise.seed");
    let line = 1 + page
        .lines()
        .position(|line| line.starts_with("seed"))
        .unwrap();
    assert_eq!(error.first().place.unwrap()[0], line);
}

#[test]
fn a_centred_region_is_accepted_by_every_format() {
    let text = "[reconstruction]\nregion = { x = [56, 200], y = [0, 256] }\n\
        [output]\nvolumes = 'interfile-simind'";
    Scene::from_toml(text).unwrap();
}

/// Scenes built in Rust have the errors of their files, section by section.
#[test]
fn each_part_of_a_scene_can_be_built() {
    let text = "
        [background]
        concentration = 0.1
        centre = [0.0, 1.0]
        semi_axes = [7.0, 6.0]
        [[defects]]
        layers = [0.0, 0.5]
        s = [0.1, 0.3]
        azimuths_degrees = [-30.0, 30.0]
        activity = 0.0
        [attenuation]
        coefficient = 0.15
        medium = 'heart'
        [acquisition]
        accuracy = { tolerance = 0.01 }
        [blur]
        fwhm = 0.8
        [noise]
        counts = { per_unit = 10.0 }
        seed = 7
        [truth]
        tolerance = 0.01
        [output]
        write = ['labels']
    ";
    let mut scene = Scene {
        background: Some(Background {
            concentration: 0.1,
            centre: [0.0, 1.0],
            semi_axes: [7.0, 6.0],
        }),
        defects: vec![Defect {
            layers: [0.0, 0.5],
            s: [0.1, 0.3],
            azimuths_degrees: [-30.0, 30.0],
            activity: 0.0,
        }],
        attenuation: Some(Attenuation {
            coefficient: 0.15,
            medium: Medium::Heart,
        }),
        blur: Some(BlurSettings { fwhm: 0.8 }),
        noise: Some(Noise {
            counts: Counts::PerUnit(10.0),
            seed: 7,
        }),
        truth: TruthSettings { tolerance: 0.01 },
        ..Scene::default()
    };
    scene.acquisition.accuracy = Accuracy::Tolerance(0.01);
    scene.output.write = vec![Product::Labels];
    assert_eq!(Scene::from_toml(text).unwrap(), scene);
    scene.check().unwrap();
}

#[test]
fn an_arc_stated_as_sufficient_is_accepted() {
    for views in [3, 7, 90, 1000] {
        let written = |arc: &str, product: &str| {
            format!("camera.views = {views}\ncamera.arc = {arc}\noutput.write = ['{product}']\n")
        };
        Scene::from_toml(&written("0.5", "projections")).unwrap();
        let text = |arc: &str| written(arc, "reconstruction");
        let said = error_of(&text("0.5")).first().wanted.clone();
        let (_, after) = said.split_once("at least 180 (").unwrap();
        let enough = after.split(' ').next().unwrap();
        Scene::from_toml(&text(enough)).unwrap();
        Scene::from_toml(&text(&format!("-{enough}"))).unwrap();
        // By a small amount.
        let less = 0.9998 * enough.parse::<f64>().unwrap();
        error_of(&text(&less.to_string()));
    }
}

/// TOML alone would ignore surplus values.
#[test]
fn arrays_need_the_exact_number_of_values() {
    for (section, field, values) in [
        ("pose", "shift", 3),
        ("camera", "pitch", 2),
        ("background", "centre", 2),
        ("background", "semi_axes", 2),
        ("[defects]", "layers", 2),
        ("[defects]", "s", 2),
        ("[defects]", "azimuths_degrees", 2),
    ] {
        for n in [values - 1, values + 1] {
            let given = vec!["0.5"; n].join(", ");
            let error = error_of(&format!("[{section}]\n{field} = [{given}]\n"));
            assert_eq!(error.first().place.unwrap()[0], 2, "{error}");
            assert!(
                error
                    .to_string()
                    .contains(&format!("expected an array of {values} values")),
                "{error}"
            );
        }
    }
    for text in [
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [0.0, 0.0, 0.0], semi_axes = [1.0, 1.0] } }",
        "[attenuation]\ncoefficient = 0.1\nmedium = { torso = { centre = [0.0, 0.0], semi_axes = [1.0, 1.0, 1.0] } }",
        "[reconstruction]\nregion = { x = [1, 2, 3], y = [1, 2] }",
        "[reconstruction]\nregion = { x = [1, 2], y = [1, 2, 3] }",
    ] {
        let error = error_of(text);
        assert!(
            error.to_string().contains("expected an array of 2 values"),
            "{error}"
        );
    }
}

#[test]
fn each_line_of_a_balloon_may_be_omitted() {
    let scene =
        Scene::from_toml("[heart.inner]\nradius = 2.0\n[heart.outer]\nlength = 9.0\n").unwrap();
    let mut expected = Scene::default();
    expected.heart.inner.radius = 2.0;
    expected.heart.outer.length = 9.0;
    assert_eq!(scene, expected);
}

#[test]
fn more_than_a_terabyte_is_rejected_with_its_size() {
    let error = error_of(
        "[camera]\nbins = 1024\nrows = 1024\n[acquisition]\nmode = { gated = { gates = 1000 } }\n",
    );
    assert_eq!(error.first().field, "acquisition.mode.gated.gates");
    assert!(
        error.first().wanted.contains("1000 gated projection sets"),
        "{error}"
    );
    // For any number that another check would reject.
    for pixels in ["9223372036854775807", "4294967296"] {
        error_of(&format!(
            "[acquisition]\nmode = {{ gated = {{ gates = 9 }} }}\n[reconstruction]\npixels = {pixels}\n"
        ));
    }
}

/// Ranges in the comments of the template against the checks: values just outside are findings, both ends are not.
#[test]
fn ranges_of_the_template_agree_with_validation() {
    let page = Scene::default().to_toml().replace("\n# [", "\n[");
    let mut ranges = 0;
    for block in page.split("\n\n") {
        let lines: Vec<&str> = block.lines().collect();
        let Some(header) = lines.iter().find(|line| line.starts_with('[')) else {
            continue;
        };
        let section = header.trim_matches(['[', ']']);
        let element = if header.starts_with("[[") { ".1" } else { "" };
        let fields: Vec<[&str; 3]> = (lines.iter())
            .filter_map(|line| {
                let line = line.strip_prefix("# ").unwrap_or(line);
                let (name, rest) = line.split_once(" = ")?;
                let (value, comment) = rest.split_once("  # ")?;
                Some([name, value, comment])
            })
            .collect();
        for [name, value, comment] in &fields {
            let words: Vec<&str> = comment.split([' ', ',', ';']).collect();
            let range = (words.windows(3))
                .filter(|words| words[1] == "to")
                .find_map(|words| Some([words[0].parse::<f64>().ok()?, words[2].parse().ok()?]));
            let (Some([least, most]), Ok(_)) = (range, value.parse::<f64>()) else {
                continue;
            };
            let outside = |number: f64| {
                let given = match value.contains('.') {
                    true => format!("{number:?}"),
                    false => format!("{}", number.round()),
                };
                let others = fields.iter().filter(|field| field[0] != *name);
                let others: String = others
                    .map(|[name, value, _]| format!("{name} = {value}\n"))
                    .collect();
                let text = format!("{header}\n{name} = {given}\n{others}");
                let path = format!("{section}{element}.{name}");
                match Scene::from_toml(&text) {
                    Err(PhantomError::Scene(error)) => (error.findings.iter())
                        .any(|found| found.field == path && found.wanted.contains("between")),
                    _ => false,
                }
            };
            let step = |number: f64| match value.contains('.') {
                true => 1e-3 * number.abs().max(1e-6),
                false => 1.0,
            };
            assert!(!outside(least) && !outside(most), "{section}.{name}");
            assert!(outside(most + step(most)), "{section}.{name}");
            if value.contains('.') || least >= 1.0 {
                assert!(outside(least - step(least)), "{section}.{name}");
            }
            ranges += 1;
        }
    }
    assert!(ranges > 20, "{ranges}");
}
