//! The page: a paragraph, tables and three plots.

use super::cases::{BASE, NO_ATTENUATION, NO_GATES, NO_RESPONSE, NO_WINDOW, NOTHING, SIXTEEN};
use super::measure::CaseResult;
use crate::StudyError;
use crate::figures::{Curve, curves};
use crate::study::gallery::Gallery;

const RULES: [&str; 2] = ["half maximum", "steepest gradient"];
/// Bias of EDV and ESV in percent, of the ejection fraction in units of 0.01.
const PARTS: [&str; 3] = ["EDV, %", "ESV, %", "EF, 0.01"];

pub(super) fn introduction(quick: bool) -> Vec<String> {
    let text = "Gated perfusion SPECT of hearts of known volumes in a chest, without scatter and respiration. The endocardium is measured along \
        rays from the axis of the left ventricle; f(t) is the image and f(p) its maximum on the ray. At half maximum it is the largest t < p with \
        f(t) = f(p) / 2, at the steepest gradient the t < p with the largest f(t + h/2) - f(t - h/2), where h is the side of a voxel. Axis and \
        base plane are those of the phantom. EDV and ESV are the largest and the smallest volume of all gates. A value a ± b is that of \
        expected counts and the standard deviation of one study of 4 million counts, from 16 realisations of the noise (OSEM: 4).";
    let quick =
        quick.then(|| "A run with --quick tests the program: its numbers have no meaning.".into());
    [text.into()].into_iter().chain(quick).collect()
}

/// A bias with the standard deviation of one study.
fn bias(result: &CaseResult, rule: usize, part: usize) -> [f64; 2] {
    let (measured, truth) = (&result.rules[rule], result.truth.values()[part]);
    let scale = scale(result, part);
    [
        measured.expected.values()[part] - truth,
        measured.deviation.values()[part],
    ]
    .map(|v| scale * v)
}

/// The bias by noise, with its standard error.
fn noise(result: &CaseResult, rule: usize, part: usize) -> [f64; 2] {
    let (measured, n) = (&result.rules[rule], result.case.realisations as f64);
    let shift = measured.mean.values()[part] - measured.expected.values()[part];
    [shift, measured.deviation.values()[part] / n.sqrt()].map(|v| scale(result, part) * v)
}

fn scale(result: &CaseResult, part: usize) -> f64 {
    if part < 2 {
        100.0 / result.truth.values()[part]
    } else {
        100.0
    }
}

fn signed(value: f64) -> String {
    format!("{value:+.1}").replace('-', "−")
}

fn cell([value, deviation]: [f64; 2]) -> String {
    format!("{} ± {deviation:.1}", signed(value))
}

/// A table of biases by both rules.
fn table<'a>(
    gallery: &mut Gallery<'_>,
    (caption, first): (&str, &[&str]),
    of: fn(&CaseResult, usize, usize) -> [f64; 2],
    rows: impl Iterator<Item = (Vec<String>, &'a CaseResult)>,
) {
    let columns = [0, 1, 2, 3, 4, 5].map(|k| (k / 3, k % 3));
    let names = columns.map(|(rule, part)| format!("{}: {}", PARTS[part], RULES[rule]));
    let header: Vec<&str> = (first.iter().copied())
        .chain(names.iter().map(String::as_str))
        .collect();
    let row = |(name, result): (Vec<String>, &CaseResult)| {
        let cells = columns.map(|(rule, part)| cell(of(result, rule, part)));
        name.into_iter().chain(cells).collect()
    };
    gallery.table(caption, &header, rows.map(row).collect());
}

pub(super) fn write(gallery: &mut Gallery<'_>, results: &[CaseResult]) -> Result<(), StudyError> {
    let reference = || results.iter().filter(|r| r.case.is_of_reference());
    let named = |name: &str| reference().find(|r| r.case.name == name);
    gallery.section("Where the bias comes from", paragraph(&named));
    let rows = || reference().map(|r| (vec![r.case.name.into()], r));
    let caption = "Bias for EDV 127 mL and an ejection fraction of 0.55; one change at a time";
    table(gallery, (caption, &["case"]), bias, rows());
    let caption = "Bias by noise: mean of the realisations minus the value of expected counts, ± its standard error";
    table(gallery, (caption, &["case"]), noise, rows());
    plots(gallery, results)?;
    gallery.section("Size and ejection fraction", "LEHR and FBP. Wall and cavity scale together: the reference volume of a heart is 0.29 EDV.");
    let grid = results
        .iter()
        .filter(|r| [BASE, SIXTEEN].contains(&r.case.name));
    let rows = grid.map(|r| {
        let gates = if r.case.name == BASE { "8" } else { "16" };
        let heart = format!(
            "{}, {:.0} mL, {:.2}",
            r.case.size, r.truth.edv, r.truth.fraction
        );
        (vec![heart, gates.into()], r)
    });
    table(
        gallery,
        ("Bias of each heart", &["heart, EDV, EF", "gates"]),
        bias,
        rows,
    );
    published(gallery, results, &named);
    Ok(())
}

type Named<'a, 'b> = &'b dyn Fn(&str) -> Option<&'a CaseResult>;

/// What switching each cause off changes.
fn paragraph(named: Named<'_, '_>) -> String {
    let Some(base) = named(BASE) else {
        return String::new();
    };
    let mut text = String::new();
    for (rule, name) in RULES.iter().enumerate() {
        let of = |result: &CaseResult| [0, 1, 2].map(|part| bias(result, rule, part)[0]);
        let list = |values: [f64; 3]| values.map(signed).join(", ");
        let all = of(base);
        text += &format!(
            "Edge at {name}: biases of EDV, ESV (%) and EF (0.01) {}. ",
            list(all)
        );
        for (cause, case) in [
            ("8 gates", NO_GATES),
            ("collimator and crystal", NO_RESPONSE),
            ("the filter window", NO_WINDOW),
            ("attenuation", NO_ATTENUATION),
        ] {
            if let Some(without) = named(case).map(of) {
                let parts = [0, 1, 2].map(|part| all[part] - without[part]);
                text += &format!(
                    "Without {cause} they change by {}. ",
                    list(parts.map(|v| -v))
                );
            }
        }
        if let Some(rest) = named(NOTHING).map(of) {
            text += &format!("Without all four {} remain. ", list(rest));
        }
        let parts = [0, 1, 2].map(|part| cell(noise(base, rule, part)));
        text += &format!("Noise adds {}. ", parts.join(", "));
    }
    text + "The changes do not add up: the blurs of collimator and filter add in square, and the edge moves by less than their sum."
}

fn plots(gallery: &mut Gallery<'_>, results: &[CaseResult]) -> Result<(), StudyError> {
    let mut draw =
        |file: &str, [x, y]: [&str; 2], lines: Vec<(String, Vec<[f64; 2]>)>, caption: &str| {
            let lines: Vec<Curve<'_>> = (lines.iter())
                .filter(|(_, points)| points.len() > 1)
                .map(|(label, points)| Curve { label, points })
                .collect();
            match lines.is_empty() {
                true => Ok(()),
                false => gallery.drawing(file, &curves(x, y, &lines)?, caption),
            }
        };
    let over_fraction = |size: &str, name: &str, rule: usize| -> Vec<[f64; 2]> {
        (results.iter())
            .filter(|r| (r.case.size, r.case.name) == (size, name))
            .map(|r| [r.truth.fraction, bias(r, rule, 2)[0]])
            .collect()
    };
    let axes = ["true ejection fraction", "bias of EF (0.01)"];
    let causes = [
        (BASE, "all causes"),
        (NO_GATES, "no gates"),
        (NO_RESPONSE, "no collimator"),
        (NO_ATTENUATION, "no attenuation"),
        (NOTHING, "none"),
    ];
    let lines = causes.map(|(name, label)| (label.to_owned(), over_fraction("medium", name, 0)));
    let caption = "Bias of the ejection fraction of the medium heart with each cause switched off; edge at half maximum.";
    draw("causes.svg", axes, lines.into(), caption)?;
    let sizes = ["small", "medium", "large"].map(|size| {
        ["half", "gradient"].map(|rule| {
            (
                format!("{size}, {rule}"),
                over_fraction(size, BASE, usize::from(rule != "half")),
            )
        })
    });
    let caption = "Bias of the ejection fraction of small, medium and large hearts by both edge rules; base case.";
    draw("sizes.svg", axes, sizes.concat(), caption)?;
    let of_gates = |r: &CaseResult| {
        ["half", "gradient"].map(|rule| {
            let gates = &r.rules[usize::from(rule != "half")].gates;
            let n = gates.len();
            let points = gates
                .iter()
                .enumerate()
                .map(|(k, &v)| [(k as f64 + 0.5) / n as f64, v]);
            (format!("{n} gates, {rule}"), points.collect())
        })
    };
    let shown = results
        .iter()
        .filter(|r| r.case.is_of_reference() && [BASE, SIXTEEN].contains(&r.case.name));
    let caption = "Measured volume of each gate at its middle; true EDV 127 mL, ESV 57.2 mL.";
    draw(
        "volumes.svg",
        ["phase", "cavity volume (mL)"],
        shown.flat_map(of_gates).collect(),
        caption,
    )
}

/// Published phantoms beside the results.
fn published(gallery: &mut Gallery<'_>, results: &[CaseResult], named: Named<'_, '_>) {
    let range = |sizes: &[&str], name: &str, part: usize| {
        [0, 1].map(|rule| {
            let kept =
                (results.iter()).filter(|r| sizes.contains(&r.case.size) && r.case.name == name);
            let values = kept.map(|r| bias(r, rule, part)[0]);
            let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                [a.min(v), b.max(v)]
            });
            ends.map(signed).join(" to ")
        })
    };
    let stroke = |name: &str| {
        [0, 1].map(|rule| {
            named(name).map_or([0.0; 2], |r| {
                let [value, deviation] = [r.rules[rule].expected, r.rules[rule].deviation];
                [value.edv - value.esv, deviation.edv.hypot(deviation.esv)]
            })
        })
    };
    let volume = |[value, deviation]: [f64; 2]| format!("{value:.1} ± {deviation:.1}");
    let [eight, sixteen] = [stroke(BASE), stroke(SIXTEEN)];
    let all = ["small", "medium", "large"];
    let rows = [
        (
            "stroke volume of 70 mL, 8 gates, mL",
            "60 to 61 (AGATE)",
            eight.map(volume),
        ),
        (
            "stroke volume of 70 mL, 16 gates, mL",
            "63 to 65 (AGATE)",
            sixteen.map(volume),
        ),
        (
            "ratio of both",
            "0.945 ± 0.02 (AGATE)",
            [0, 1].map(|k| format!("{:.3}", eight[k][0] / sixteen[k][0])),
        ),
        (
            "EF, 0.01, 8 gates, medium and large",
            "+1.25 (AGATE)",
            range(&all[1..], BASE, 2),
        ),
        (
            "EF, 0.01, 16 gates, medium and large",
            "+3.25 (AGATE)",
            range(&all[1..], SIXTEEN, 2),
        ),
        (
            "EDV, %, medium",
            "−24 (dynamic phantom)",
            range(&all[1..2], BASE, 0),
        ),
        (
            "ESV, %, medium",
            "−21 (dynamic phantom)",
            range(&all[1..2], BASE, 1),
        ),
        (
            "EDV, %, all hearts",
            "−26 to −52 (17 departments)",
            range(&all, BASE, 0),
        ),
        (
            "ESV, %, all hearts",
            "−15 to −60 (17 departments)",
            range(&all, BASE, 1),
        ),
        (
            "EF, %, all hearts, 0.01 here",
            "−24 to +14 (17 departments)",
            range(&all, BASE, 2),
        ),
        (
            "ESV, %, small",
            "−78 ± 18 (QGS), −13 ± 9 (ExH)",
            range(&all[..1], BASE, 1),
        ),
    ];
    gallery.section("Published phantoms", "Their programs have other edge rules, and their phantoms other shapes. The page of published numbers in the documentation discusses the differences.");
    let rows = rows.map(|(what, theirs, [a, b])| vec![what.into(), theirs.into(), a, b]);
    let caption = "AGATE: doi:10.1007/s00259-003-1352-5. Dynamic phantom: doi:10.1186/s40658-017-0187-2. 17 departments: Trägårdh et al. 2015, \
        doi:10.1186/s40658-014-0105-9. Small hearts: Nakajima et al. 2013, doi:10.1007/s00259-013-2431-x";
    gallery.table(
        caption,
        &["quantity", "published", RULES[0], RULES[1]],
        rows.into(),
    );
}
