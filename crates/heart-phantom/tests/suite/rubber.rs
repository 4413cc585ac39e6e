//! A heart of rubber from a scene: input, results, errors.

use heart_phantom::membrane_forces::StrainEnergy;
use heart_phantom::membrane_newton::{
    Discretisation, Membrane, NewtonOptions, Pair, ReferenceShape, Rubber, Solver, Thickness,
};
use heart_phantom::scene::{DiscretisationSettings, MaterialSettings};
use heart_phantom::{MMHG_PER_KPA, Mode, Phantom, PhantomError, Scene, no_observer, run};

const LATEX: &str = "{ neo_hookean = { mu = 400.0, thickness = 0.5 } }";

fn scene(material: &str) -> Scene {
    Scene::from_toml(&format!("[heart]\nmaterial = {material}\n")).unwrap()
}

/// A small scene.
fn small(material: &str) -> Scene {
    let mut scene = scene(material).with_size(24);
    scene.camera.views = 6;
    scene.heart.discretisation = DiscretisationSettings::Differences { nodes: 81 };
    scene
}

fn kinds() -> [(&'static str, StrainEnergy); 4] {
    [
        (LATEX, StrainEnergy::NeoHookean { mu: 400.0 }),
        (
            "{ mooney_rivlin = { c1 = 160, c2 = 40.0, thickness = 0.5 } }",
            StrainEnergy::MooneyRivlin {
                c1: 160.0,
                c2: 40.0,
            },
        ),
        (
            "{ ogden = { terms = [[600.0, 1.3], [1.0, 5.0]], thickness = 0.5 } }",
            StrainEnergy::Ogden {
                terms: vec![[600.0, 1.3], [1.0, 5.0]],
            },
        ),
        (
            "{ gent = { mu = 400.0, jm = 30.0, thickness = 0.5 } }",
            StrainEnergy::Gent {
                mu: 400.0,
                jm: 30.0,
            },
        ),
    ]
}

#[test]
fn every_rubber_is_read_written_and_read_again() {
    assert_eq!(scene("\"springs\""), Scene::default());
    for (text, energy) in kinds() {
        let scene = scene(text);
        let thickness = 0.5;
        let expected = MaterialSettings::Rubber { energy, thickness };
        assert_eq!(scene.heart.material, expected);
        let again = scene.to_toml();
        assert_eq!(Scene::from_toml(&again).unwrap(), scene, "{again}");
    }
    let section = "[heart.material.neo_hookean]\nmu = 400\nthickness = 0.5\n";
    assert_eq!(Scene::from_toml(section).unwrap(), scene(LATEX));
}

#[test]
fn invalid_rubber_is_rejected_with_line_and_field() {
    for (bad, field, wanted) in [
        ("'jelly'", "", "neo_hookean"),
        ("'gent'", "", "gent = { mu = 400.0"),
        ("3", "", "neo_hookean"),
        ("{}", "", "neo_hookean"),
        ("{ gent = 3.0 }", "", "gent"),
        (
            "{ gent = { mu = 1.0, jm = 1.0, thickness = 1.0 }, ogden = {} }",
            "",
            "only one",
        ),
        ("{ neo_hookean = { mu = 400.0 } }", "", "thickness"),
        (
            "{ neo_hookean = { mu = 400.0, thickness = 'thin' } }",
            "",
            "a number",
        ),
        ("{ neo_hookean = { thickness = 0.5 } }", "", "mu"),
        (
            "{ neo_hookean = { mu = 400.0, jm = 3.0, thickness = 0.5 } }",
            "",
            "jm",
        ),
        ("{ jelly = { mu = 400.0, thickness = 0.5 } }", "", "jelly"),
        (
            "{ neo_hookean = { mu = -1.0, thickness = 0.5 } }",
            ".neo_hookean.mu",
            "positive",
        ),
        (
            "{ neo_hookean = { mu = nan, thickness = 0.5 } }",
            ".neo_hookean.mu",
            "finite",
        ),
        (
            "{ neo_hookean = { mu = 1e12, thickness = 0.5 } }",
            ".neo_hookean",
            "shear modulus",
        ),
        (
            "{ neo_hookean = { mu = 400.0, thickness = 0.0 } }",
            ".neo_hookean.thickness",
            "between",
        ),
        (
            "{ neo_hookean = { mu = 400.0, thickness = inf } }",
            ".neo_hookean.thickness",
            "between",
        ),
        (
            "{ mooney_rivlin = { c1 = 1.0, c2 = -1.0, thickness = 0.5 } }",
            ".mooney_rivlin.c2",
            "must be finite and not negative",
        ),
        (
            "{ gent = { mu = 1.0, jm = 0.0, thickness = 0.5 } }",
            ".gent.jm",
            "positive",
        ),
        (
            "{ ogden = { terms = [], thickness = 0.5 } }",
            ".ogden",
            "Ogden terms",
        ),
        (
            "{ ogden = { terms = [[1.0, -1.0]], thickness = 0.5 } }",
            ".ogden",
            "mu_k alpha_k",
        ),
        (
            "{ ogden = { terms = [[1e-9, 1e9]], thickness = 0.5 } }",
            ".ogden",
            "alpha_k is 1000000000.0; it must be between -1000.0 and 1000.0",
        ),
    ] {
        let text = format!("# no rubber\n[heart]\nmaterial = {bad}\n");
        let Err(PhantomError::Scene(error)) = Scene::from_toml(&text) else {
            panic!("{bad} was taken");
        };
        let message = error.to_string();
        assert!(
            error
                .first()
                .field
                .starts_with(&format!("heart.material{field}")),
            "{bad}: {message}"
        );
        assert_eq!(error.first().place.unwrap()[0], 3, "{bad}: {message}");
        assert!(message.contains(wanted), "{bad}: {message}");
    }
}

/// Fields of springs are rejected with rubber.
#[test]
fn rubber_has_a_pressure_and_no_stiffness() {
    for (given, field) in [
        ("law = \"total-force\"", "heart.law"),
        ("inner = { stiffness = 2.0 }", "heart.inner.stiffness"),
        ("outer = { stiffness = 0.5 }", "heart.outer.stiffness"),
    ] {
        let text = format!("[heart]\nmaterial = {LATEX}\n{given}\n");
        let Err(PhantomError::Scene(error)) = Scene::from_toml(&text) else {
            panic!("{given} was taken");
        };
        assert_eq!(
            (
                error.first().field.as_str(),
                error.first().place.unwrap()[0]
            ),
            (field, 3)
        );
    }
    let law = format!("[heart]\nmaterial = {LATEX}\nlaw = \"per-current-length\"\n");
    assert!(Scene::from_toml(&law).is_ok());
}

/// The pair of the membrane crates without a scene: bitwise identical; and the reference value p = 0.371980648542 mu h / cm of the inner
/// balloon at a gain of 0.6 (`the_balloon_of_the_paper_reaches_its_reference_values` has that at 0.3).
#[test]
fn pressures_equal_those_of_the_membranes() {
    for (text, energy) in kinds() {
        let mut scene = scene(text);
        scene.heart.discretisation = DiscretisationSettings::Spectral {
            degree: 20,
            per_piece: 1,
            tolerance: 1e-3,
        };
        let phantom = Phantom::new(scene).unwrap();
        let solver = |radius: f64| {
            let thickness = Thickness::constant(0.05).unwrap();
            let rubber = Rubber::new(energy.clone(), thickness).unwrap();
            let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
            let spectral = Discretisation::Spectral {
                degree: 20,
                per_piece: 1,
            };
            Solver::new(&membrane.with_rubber(rubber), spectral).unwrap()
        };
        let pair = Pair::new(solver(1.75), solver(2.75)).unwrap();
        let options = NewtonOptions::default();
        for report in phantom.phase_reports().unwrap() {
            let solved = pair.solve_gain(report.gain, &options).unwrap();
            let kpa = [solved.inner.intensity, solved.outer.intensity];
            assert_eq!([report.f_inner, report.f_outer], kpa);
            let mmhg = kpa.map(|kpa| kpa * 1000.0 / 133.322387415);
            let reported = report.pressures_mmhg.unwrap();
            for k in 0..2 {
                assert!((reported[k] - mmhg[k]).abs() <= 1e-14 * mmhg[k].abs());
            }
            assert!(solved.wall_volume_error.abs() < 1e-13);
            if report.of == "end-diastole" {
                assert!(reported[0] > reported[1] && reported[1] > 0.0);
            }
            if report.of == "end-diastole" && matches!(energy, StrainEnergy::NeoHookean { .. }) {
                let known = 0.371980648542 * 400.0 * 0.05;
                assert!((kpa[0] / known - 1.0).abs() < 1e-9, "{}", kpa[0]);
            }
        }
    }
    assert!((MMHG_PER_KPA - 7.50061575846).abs() < 1e-10);
    let springs = Phantom::new(small("\"springs\"")).unwrap();
    let reports = springs.phase_reports().unwrap();
    assert!(reports.iter().all(|report| report.pressures_mmhg.is_none()));
}

/// At equal volumes rubber is fuller towards the apex: views have the same sums and different samples.
#[test]
fn views_contain_the_same_wall_volume_at_other_positions() {
    let view = |material: &str| {
        let mut scene = small(material).with_mode(Mode::Static { phase: 0.5 });
        scene.camera = Scene::default().with_size(96).camera;
        let phantom = Phantom::new(scene).unwrap();
        let [bin, row] = phantom.camera().detector().pitch();
        let samples = phantom.view(0, 0).unwrap();
        let sum: f64 = samples.iter().map(|value| f64::from(*value)).sum();
        let [inner, outer] = phantom.shape(0.5).unwrap().volumes();
        // error of sums of samples at the centres of 96 bins
        assert!((sum * bin * row / (outer - inner) - 1.0).abs() < 2e-3);
        samples
    };
    let (springs, latex, stiff) = (
        view("\"springs\""),
        view(LATEX),
        view("{ neo_hookean = { mu = 800.0, thickness = 0.25 } }"),
    );
    let off = |a: &[f32], b: &[f32]| {
        let most = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        f64::from(most.fold(0.0, f32::max))
    };
    assert!(off(&springs, &latex) > 0.5, "{}", off(&springs, &latex));
    // shapes depend on the type of rubber, not on mu h
    assert!(off(&latex, &stiff) < 1e-4, "{}", off(&latex, &stiff));
}

/// All sections that are valid with springs are valid with rubber.
#[test]
fn everything_works_with_rubber() {
    let text = format!(
        "[heart]\nmaterial = {LATEX}\ndiscretisation = {{ differences = {{ nodes = 81 }} }}\n\
         [cycle]\ncurve = \"physiological\"\nvolume = {{ ejection_fraction = 0.5 }}\nav_plane_displacement = 1.6\n\
         [camera]\nviews = 6\nbins = 24\nrows = 24\npitch = [0.7, 0.7]\n\
         [acquisition]\nmode = {{ gated = {{ gates = 2 }} }}\naccuracy = {{ steps = 4 }}\n\
         [truth]\ntolerance = 0.01\n\
         [twist]\ninner_degrees = [-3.0, 10.0]\nouter_degrees = [-3.0, 8.0]\n\
         [[defects]]\nlayers = [0.0, 1.0]\ns = [0.1, 0.3]\nazimuths_degrees = [0.0, 60.0]\nactivity = 0.0\n\
         [output]\nwrite = [\"projections\", \"truth\", \"labels\", \"motion\", \"meshes\"]\n"
    );
    let phantom = Phantom::new(Scene::from_toml(&text).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let report = run(&phantom, out.path(), &no_observer).unwrap();
    assert!(
        report
            .files
            .iter()
            .all(|file| out.path().join(file).exists())
    );
    for phase in &report.phases {
        let shape = phantom.shape(phase.phase).unwrap();
        assert!(shape.solution().wall_volume_error.abs() < 1e-12);
        let [inner, outer] = phase.pressures_mmhg.unwrap();
        assert!(inner > 0.0 && outer > 0.0, "{phase:?}");
    }
    // The base is displaced, the apex is fixed.
    let [systole, diastole] = phantom
        .cycle()
        .extreme_phases()
        .map(|at| phantom.shape(at).unwrap());
    let place =
        |shape: &heart_phantom::HeartShape, s: f64| shape.solution().outer.at(s).position[0];
    assert!((place(&systole, 0.0) - place(&diastole, 0.0) - 1.6).abs() < 1e-12);
    assert!((place(&systole, 0.5) - place(&diastole, 0.5)).abs() < 1e-9);
    let json = std::fs::read_to_string(out.path().join("report.json")).unwrap();
    assert!(json.contains("pressures_mmhg"));
}

/// A volume beyond the extensibility of the rubber is an error of the volume, with its line.
#[test]
fn insufficient_extensibility_is_an_error_with_its_field() {
    let text = "[heart]\nmaterial = { gent = { mu = 400.0, jm = 0.5, thickness = 0.5 } }\n\
                [cycle]\nvolume = { gain = 3.0 }\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let phantom = Phantom::load(&path).unwrap();
    let Err(error) = phantom.prepare() else {
        panic!("such rubber does not reach that volume");
    };
    let PhantomError::Rejected { field, place, .. } = &error else {
        panic!("{error:?}");
    };
    assert_eq!((field.as_str(), place.unwrap()[0]), ("cycle.volume", 4));
    let mut said = error.to_string();
    let mut source = std::error::Error::source(&error);
    while let Some(inner) = source {
        said += &format!(": {inner}");
        source = inner.source();
    }
    assert!(
        said.contains("the limit of the rubber, l1^2 + l2^2 + l3^2 < 3.5"),
        "{said}"
    );
}
