//! The page: a paragraph, tables and three plots.

use super::cases::{
    BASE, Case, NO_ATTENUATION, NO_GATES, NO_RESPONSE, NO_WINDOW, NOTHING, SIXTEEN,
};
use super::measure::CaseResult;
use crate::figures::curves;
use crate::html::Page;
use heart_phantom::Method;
use heart_phantom::PhantomError;

const RULES: [&str; 2] = ["half maximum", "steepest gradient"];
/// Bias of EDV and ESV in percent, of the ejection fraction in units of 0.01.
const PARTS: [&str; 3] = ["EDV, %", "ESV, %", "EF, 0.01"];
/// The causes of bias and the cases without them.
const CAUSES: [(&str, &str); 4] = [
    ("8 gates", NO_GATES),
    ("collimator and crystal", NO_RESPONSE),
    ("the filter window", NO_WINDOW),
    ("attenuation", NO_ATTENUATION),
];
pub(super) const PLOTS: [&str; 3] = ["causes.svg", "sizes.svg", "volumes.svg"];
pub(crate) const QUICK: &str = "A run with --quick tests the program: its numbers have no meaning.";
const INTRODUCTION: &str = "Gated perfusion SPECT of hearts of known volumes in a chest, without scatter and respiration. The \
    endocardium is measured along rays from the axis of the left ventricle; f(t) is the image and f(p) its maximum on the ray. At half \
    maximum it is the largest t < p with f(t) = f(p) / 2, at the steepest gradient the t < p with the largest f(t + h/2) - f(t - h/2), \
    where h is the side of a voxel. Axis and base plane are those of the phantom. EDV and ESV are the largest and the smallest volume of \
    all gates. A value a ± b is the value from expected counts and the standard deviation of one study of 4 million counts, from";

pub(super) fn introduction(quick: bool, cases: &[Case]) -> Vec<String> {
    let of = |is_fbp: bool| {
        let method = |case: &&Case| (case.scene.reconstruction.method == Method::Fbp) == is_fbp;
        cases.iter().find(method).map(|case| case.realisations)
    };
    let osem = of(false).map_or(String::new(), |n| format!(" (OSEM: {n})"));
    let fbp = of(true).unwrap_or(0);
    let text = format!("{INTRODUCTION} {fbp} realisations of the noise{osem}.");
    let all = [Some(text), quick.then(|| QUICK.into())];
    all.into_iter().flatten().collect()
}

/// The result of a case, an edge rule and a part of [`PARTS`], with its error.
type Value = fn(&CaseResult, usize, usize) -> [f64; 2];

/// A bias with the standard deviation of one study.
fn bias(result: &CaseResult, rule: usize, part: usize) -> [f64; 2] {
    let (measured, truth) = (&result.rules[rule], result.truth.values()[part]);
    let [found, deviation] = [measured.expected, measured.deviation].map(|v| v.values()[part]);
    [found - truth, deviation].map(|v| scale(result, part) * v)
}

/// The bias by noise, with its standard error.
fn noise(result: &CaseResult, rule: usize, part: usize) -> [f64; 2] {
    let (measured, n) = (&result.rules[rule], result.case.realisations as f64);
    let [mean, found] = [measured.mean, measured.expected].map(|v| v.values()[part]);
    let deviation = measured.deviation.values()[part];
    [mean - found, deviation / n.sqrt()].map(|v| scale(result, part) * v)
}

fn scale(result: &CaseResult, part: usize) -> f64 {
    [100.0 / result.truth.edv, 100.0 / result.truth.esv, 100.0][part]
}

fn signed(value: f64) -> String {
    format!("{value:+.1}").replace('-', "−")
}

fn cell([value, deviation]: [f64; 2]) -> String {
    format!("{} ± {deviation:.1}", signed(value))
}

/// A table by both rules; a row has names and a case.
fn table<'a>(
    page: &mut Page,
    caption: &str,
    (first, of): (&[&str], Value),
    rows: impl Iterator<Item = (Vec<String>, &'a CaseResult)>,
) {
    let columns = [0, 1, 2, 3, 4, 5].map(|k| (k / 3, k % 3));
    let names = columns.map(|(rule, part)| format!("{}: {}", PARTS[part], RULES[rule]));
    let names = names.iter().map(String::as_str);
    let header: Vec<&str> = first.iter().copied().chain(names).collect();
    let row = |(name, result): (Vec<String>, &CaseResult)| {
        let cells = columns.map(|(rule, part)| cell(of(result, rule, part)));
        name.into_iter().chain(cells).collect()
    };
    page.table(caption, &header, rows.map(row).collect());
}

pub(super) fn write(page: &mut Page, results: &[CaseResult]) -> Result<(), PhantomError> {
    let reference: Vec<_> = (results.iter())
        .filter(|r| r.case.is_of_reference())
        .collect();
    page.section("Causes of the bias", paragraph(&reference));
    plots(page, results)?;
    let rows = || (reference.iter()).map(|r| (vec![r.case.name.into()], *r));
    let caption = "Bias for EDV 127 mL and an ejection fraction of 0.55; one change at a time";
    table(page, caption, (&["case"], bias), rows());
    let caption = "Bias by noise: mean of the realisations minus the value of expected counts, ± its standard error";
    table(page, caption, (&["case"], noise), rows());
    let text = "LEHR and FBP. Wall and cavity scale together: the reference volume of a heart is 0.29 EDV.";
    page.section("Size and ejection fraction", text);
    let grid = (results.iter()).filter(|r| [BASE, SIXTEEN].contains(&r.case.name));
    let rows = grid.map(|r| {
        let gates = r.rules[0].gates.len().to_string();
        let (size, edv, fraction) = (r.case.size, r.truth.edv, r.truth.fraction);
        (
            vec![format!("{size}, {edv:.0} mL, {fraction:.2}"), gates],
            r,
        )
    });
    table(
        page,
        "Bias of each heart",
        (&["heart, EDV, EF", "gates"], bias),
        rows,
    );
    Ok(())
}

/// Describes the change when each cause is switched off.
fn paragraph(cases: &[&CaseResult]) -> String {
    let mut text = String::new();
    for (rule, name) in RULES.iter().enumerate() {
        let of = |case: &str| {
            let found = cases.iter().find(|r| r.case.name == case);
            found.map(|r| [0, 1, 2].map(|part| bias(r, rule, part)[0]))
        };
        let list = |values: [f64; 3]| values.map(signed).join(", ");
        let Some(all) = of(BASE) else { continue };
        text += &format!(
            "Edge at {name}: biases of EDV, ESV (%) and EF (0.01) {}. ",
            list(all)
        );
        for (cause, case) in CAUSES {
            if let Some(without) = of(case) {
                let change = [0, 1, 2].map(|part| without[part] - all[part]);
                text += &format!("Without {cause} the biases change by {}. ", list(change));
            }
        }
        if let Some(rest) = of(NOTHING) {
            text += &format!("Without all four causes the biases are {}. ", list(rest));
        }
    }
    text + "The changes are not additive: the blurs of collimator and filter add in quadrature. The second table contains the bias by noise."
}

/// Points of the cases with this size and name: the true ejection fraction and its bias.
fn points(results: &[CaseResult], size: &str, name: &str, rule: usize) -> Vec<[f64; 2]> {
    let kept = results
        .iter()
        .filter(|r| (r.case.size, r.case.name) == (size, name));
    kept.map(|r| [r.truth.fraction, bias(r, rule, 2)[0]])
        .collect()
}

fn plots(page: &mut Page, results: &[CaseResult]) -> Result<(), PhantomError> {
    type Line = (String, Vec<[f64; 2]>);
    let mut draw = |file: &str, [x, y]: [&str; 2], lines: Vec<Line>, caption: &str| {
        let full = lines.into_iter().filter(|(_, points)| points.len() > 1);
        let lines: Vec<Line> = full.collect();
        match lines.is_empty() {
            true => Ok(()),
            false => page.drawing(file, &curves(x, y, &lines)?, caption),
        }
    };
    let axes = ["true ejection fraction", "bias of EF (0.01)"];
    let shown = [
        ("all causes", BASE),
        ("no gates", NO_GATES),
        ("no collimator", NO_RESPONSE),
        ("no attenuation", NO_ATTENUATION),
        ("none of four", NOTHING),
    ];
    let lines = shown.map(|(label, name)| (label.into(), points(results, "medium", name, 0)));
    let caption = "Bias of the ejection fraction of the medium heart with each cause switched off; edge at half maximum.";
    draw(PLOTS[0], axes, lines.into(), caption)?;
    let rules = [(0, "half"), (1, "gradient")];
    let lines = ["small", "medium", "large"].map(|size| {
        rules.map(|(rule, name)| (format!("{size}, {name}"), points(results, size, BASE, rule)))
    });
    let caption = "Bias of the ejection fraction of small, medium and large hearts by both edge rules; base case.";
    draw(PLOTS[1], axes, lines.concat(), caption)?;
    let of_gates = |r: &CaseResult| {
        rules.map(|(rule, name)| {
            let (gates, n) = (&r.rules[rule].gates, r.rules[rule].gates.len() as f64);
            let points = gates
                .iter()
                .enumerate()
                .map(|(k, &v)| [(k as f64 + 0.5) / n, v]);
            (format!("{n} gates, {name}"), points.collect())
        })
    };
    let wanted =
        |r: &&CaseResult| r.case.is_of_reference() && [BASE, SIXTEEN].contains(&r.case.name);
    let lines = results.iter().filter(wanted).flat_map(of_gates).collect();
    let caption = "Measured volume of each gate at its middle; true EDV 127 mL, ESV 57.2 mL.";
    draw(PLOTS[2], ["phase", "cavity volume (mL)"], lines, caption)
}
