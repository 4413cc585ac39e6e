//! The examples of `docs/guide-physicists.md` and `docs/theory.md` agree with the program and the crates.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

use heart_phantom::Scene;
use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, NewtonOptions, Pair, PairEquilibrium,
    PressureLaw, ReferenceShape, Solver, Stiffness,
};

const GUIDE: &str = include_str!("../../docs/guide-physicists.md");
const PRESSURE: &str = include_str!("../../docs/theory.md");

/// The heart of the study at a gain of 0.6.
fn dilated(law: PressureLaw, stiffness: f64) -> PairEquilibrium {
    let solver = |radius: f64| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap())
            .with_law(law)
            .with_stiffness(Stiffness::constant(stiffness).unwrap());
        let (degree, per_piece) = (16, 1);
        Solver::new(&membrane, Discretisation::Spectral { degree, per_piece }).unwrap()
    };
    let pair = Pair::new(solver(1.75), solver(2.75)).unwrap();
    let options = NewtonOptions::default();
    pair.solve(Control::VolumeGain(0.6), &options).unwrap()
}

/// Every number of the example of the page, from the equilibria and from the definition of a millimetre of mercury.
#[test]
fn pressures_are_those_of_the_page() {
    let shown = |text: String| assert!(PRESSURE.contains(&text), "{text}");
    let row =
        |name: &str, digits: usize, pair: &PairEquilibrium, of: &dyn Fn(&Equilibrium) -> f64| {
            let [inner, outer] = [&pair.inner, &pair.outer].map(of);
            shown(format!("| {name} | {inner:.digits$} | {outer:.digits$} |"));
        };
    // mercury 13 595.1 kg/m^3, 9.80665 m/s^2, 1 mm; in kPa
    let mmhg = 13_595.1 * 9.80665 * 1e-6;
    shown(format!("1 kPa = {:.6} mmHg", 1.0 / mmhg));
    shown(format!("{:.9} Pa", 1000.0 * mmhg));

    let one = dilated(PressureLaw::PerMaterialLength, 1.0);
    row("intensity f", 6, &one, &|e| e.intensity);
    row("current length L, cm", 6, &one, &|e| e.measures.length);
    row("mean pressure f / L", 6, &one, &|e| e.pressure());
    let across = one.inner.pressure() + one.outer.pressure();
    let stiffness = 10.0 * mmhg / across;
    shown(format!("The sum {across:.6} lambda equals"));
    shown(format!(
        "10 mmHg = {:.6} kPa for lambda = {stiffness:.6} kPa",
        10.0 * mmhg
    ));

    // solved again in these units, by the law of total force
    let pair = dilated(PressureLaw::TotalForce, stiffness);
    row("mean pressure, mmHg", 6, &pair, &|e| e.pressure() / mmhg);
    // the average over the curve is that of p(s) along its length, and the sum is the given one
    for e in [&pair.inner, &pair.outer] {
        let n = 2000;
        let points: Vec<_> = (0..n)
            .map(|k| e.at((f64::from(k) + 0.5) / f64::from(n)))
            .collect();
        let speed = |k: usize| points[k].first[0].hypot(points[k].first[1]);
        let length: f64 = (0..points.len()).map(speed).sum();
        let mean: f64 = (0..points.len())
            .map(|k| e.intensity / speed(k) * speed(k))
            .sum();
        // midpoints, of second order: 1e-7 of the total
        assert!((mean / length / e.pressure() - 1.0).abs() < 1e-6);
    }
    let sum = pair.inner.pressure() + pair.outer.pressure();
    assert!((sum / (10.0 * mmhg) - 1.0).abs() < 1e-12);

    let rest = 17.0 + 1.75 * std::f64::consts::PI;
    let sheet = 10.0 * stiffness * rest; // N/m
    shown(format!("lambda times {rest:.6} cm = {sheet:.1} N/m"));
    shown(format!("({:.2} mm)", sheet / 1e6 * 1e3));

    // the law per current length has nearly the same pressures
    let even = dilated(PressureLaw::PerCurrentLength, 1.0);
    let [inner, outer] = [&even.inner, &even.outer].map(Equilibrium::pressure);
    assert!((one.inner.pressure() / inner - 1.0).abs() < 2e-3);
    assert!((one.outer.pressure() / outer - 1.0).abs() < 2e-3);
    // water of 1 g/cm^3
    assert!((1000.0 * 9.80665 * 0.1 / 1000.0 / mmhg - 7.0).abs() < 0.5);
}

#[test]
fn scenes_of_the_guide_are_valid() {
    let scenes: Vec<&str> = (GUIDE.split("```toml\n").skip(1))
        .map(|rest| rest.split("```").next().unwrap())
        .collect();
    assert!(!scenes.is_empty());
    for text in scenes {
        Scene::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    }
}

#[test]
fn the_error_message_of_the_guide_is_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    // Line 12, column 9, as in the guide.
    std::fs::write(&path, format!("[camera]\n{}views = 0\n", "\n".repeat(10))).unwrap();
    let error = Scene::load(&path).unwrap_err().to_string();
    let shown = error.replace(path.to_str().unwrap(), "scene.toml");
    assert!(GUIDE.contains(&format!("error: {shown}\n")), "{shown}");
}

/// The table contains every section and field; rows that share a section name the later fields by their last part.
#[test]
fn the_table_of_the_guide_has_every_field() {
    let fields = toml_fields(&Scene::default().to_toml());
    assert!(fields.len() > 40, "{fields:?}");
    let table = GUIDE.split("## Every field").nth(1).unwrap();
    let table = table.split("\n## ").next().unwrap();
    for [section, field] in &fields {
        // The outer balloon has the fields of the inner one.
        let section = section.replace("heart.outer", "heart.inner");
        let row = table.lines().find(|line| {
            let names = line.split('|').nth(1).unwrap_or_default();
            names.contains(&format!("`{section}."))
                && (names.contains(&format!(".{field}`")) || names.contains(&format!("`{field}`")))
        });
        assert!(row.is_some(), "{section}.{field} is not in the table");
    }
}

/// Sections and fields of a commented scene, including those that are commented out.
fn toml_fields(text: &str) -> Vec<[String; 2]> {
    let mut section = String::new();
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.strip_prefix("# ").unwrap_or(line);
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']).to_owned();
        } else if let Some((name, _)) = line.split_once(" = ") {
            let is_name = |c: char| c.is_ascii_lowercase() || c == '_';
            if name.chars().all(is_name) {
                fields.push([section.clone(), name.to_owned()]);
            }
        }
    }
    fields
}
