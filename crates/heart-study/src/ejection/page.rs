//! The page: one paragraph, tables and three plots.

use super::cases::{BASE, NO_ATTENUATION, NO_GATES, NO_RESPONSE, NOTHING, OFF, SIXTEEN};
use super::measure::{CaseResult, Measured, Volumes};
use crate::StudyError;
use crate::figures::{Curve, curves};
use crate::study::gallery::Gallery;

/// The edge rules, as the columns of the tables name them.
const RULES: [&str; 2] = ["half maximum", "steepest gradient"];

pub(super) fn introduction(quick: bool) -> Vec<String> {
    let text = "Gated perfusion SPECT of hearts of known volumes in a chest, without scatter and respiration. The endocardium is measured along \
        rays from the axis of the left ventricle, f(t) being the image and f(p) its maximum on the ray: at half maximum, the largest t < p with \
        f(t) = f(p) / 2; at the steepest gradient, the t < p with the largest f(t + h/2) - f(t - h/2), where h is the side of a voxel. Axis and plane \
        of the base are those of the phantom. EDV and ESV are the largest and the smallest volume of all gates. A value a ± b is that of expected counts and the \
        standard deviation of one study of 4 million counts, from n realisations of the noise (16; OSEM 4).";
    let quick = quick.then(|| "This is a run with --quick: its numbers have no meaning.".into());
    [text.into()].into_iter().chain(quick).collect()
}

/// Bias of a volume in percent, or of the ejection fraction in units of 0.01, with the standard deviation of one study.
fn bias(result: &CaseResult, rule: usize, of: fn(&Volumes) -> f64, relative: bool) -> [f64; 2] {
    let (measured, truth) = (result.rules()[rule], of(&result.truth));
    let scale = if relative { 100.0 / truth } else { 100.0 };
    [
        scale * (of(&measured.expected) - truth),
        scale * of(&measured.deviation),
    ]
}

const PARTS: [(fn(&Volumes) -> f64, bool); 3] = [
    (|v| v.edv, true),
    (|v| v.esv, true),
    (|v| v.fraction, false),
];

fn cell([value, deviation]: [f64; 2]) -> String {
    format!("{value:+.1} ± {deviation:.1}").replace('-', "−")
}

/// The cells of a case: EDV, ESV and EF by both rules.
fn cells(result: &CaseResult) -> impl Iterator<Item = String> {
    (0..2).flat_map(move |rule| PARTS.map(|(of, relative)| cell(bias(result, rule, of, relative))))
}

fn header<'a>(first: &[&'a str], names: &'a [String]) -> Vec<&'a str> {
    first
        .iter()
        .copied()
        .chain(names.iter().map(String::as_str))
        .collect()
}

pub(super) fn write(gallery: &mut Gallery<'_>, results: &[CaseResult]) -> Result<(), StudyError> {
    let Some(base) = results
        .iter()
        .find(|r| is_reference(r) && r.case.name == BASE)
    else {
        return Ok(());
    };
    let of_heart: Vec<&CaseResult> = (results.iter())
        .filter(|r| r.case.has_heart_of(&base.case))
        .collect();
    gallery.section("Where the bias comes from", paragraph(&of_heart));
    let names: Vec<String> = RULES
        .iter()
        .flat_map(|rule| ["EDV, %", "ESV, %", "EF, 0.01"].map(|part| format!("{part}: {rule}")))
        .collect();
    let rows =
        (of_heart.iter()).map(|r| [r.case.name.into()].into_iter().chain(cells(r)).collect());
    gallery.table(
        "Bias of the medium heart, EDV 127 mL, ejection fraction 0.55; one change at a time",
        &header(&["case"], &names),
        rows.collect(),
    );
    let rows =
        (of_heart.iter()).map(|r| [r.case.name.into()].into_iter().chain(noise(r)).collect());
    gallery.table(
        "Bias by noise alone: mean of the realisations minus the value of expected counts, ± its standard error",
        &header(&["case"], &names),
        rows.collect(),
    );
    plots(gallery, results, base)?;
    gallery.section(
        "Size and ejection fraction",
        "LEHR, FBP, all causes of bias. The reference volume of a heart is 0.29 of its EDV; wall and cavity scale together.",
    );
    let rows = (results.iter())
        .filter(|r| [BASE, SIXTEEN].contains(&r.case.name))
        .map(|r| {
            let heart = format!(
                "{}, {:.0} mL, {:.2}",
                r.case.acquired.size, r.truth.edv, r.truth.fraction
            );
            let gates = if r.case.name == BASE { "8" } else { "16" };
            [heart, gates.into()].into_iter().chain(cells(r)).collect()
        });
    gallery.table(
        "Bias of each heart",
        &header(&["heart, EDV, EF", "gates"], &names),
        rows.collect(),
    );
    published(gallery, results);
    Ok(())
}

fn is_reference(result: &CaseResult) -> bool {
    (result.case.acquired.size, result.case.acquired.fraction) == ("medium", 0.55)
}

/// The bias by noise of EDV, ESV and EF by both rules.
fn noise(result: &CaseResult) -> impl Iterator<Item = String> {
    let root = (result.case.realisations as f64).sqrt();
    (0..2).flat_map(move |rule| {
        PARTS.map(|(of, relative)| {
            let measured: &Measured = result.rules()[rule];
            let scale = if relative {
                100.0 / of(&result.truth)
            } else {
                100.0
            };
            let shift = of(&measured.mean) - of(&measured.expected);
            cell([scale * shift, scale * of(&measured.deviation) / root])
        })
    })
}

/// What switching each cause off changes.
fn paragraph(of_heart: &[&CaseResult]) -> String {
    let find = |name: &str| of_heart.iter().find(|r| r.case.name == name);
    let Some(base) = find(BASE) else {
        return String::new();
    };
    let mut text = String::new();
    for (rule, name) in RULES.iter().enumerate() {
        let all = PARTS.map(|(of, relative)| bias(base, rule, of, relative));
        text += &format!(
            "With the edge at the {name}, EDV has a bias of {} %, ESV {} % and EF {} units of 0.01. ",
            cell(all[0]),
            cell(all[1]),
            cell(all[2])
        );
        for (cause, case) in [
            ("the gates", NO_GATES),
            ("collimator and crystal", NO_RESPONSE),
            ("attenuation", NO_ATTENUATION),
        ] {
            let Some(without) = find(case) else { continue };
            let part = |k: usize| {
                let (of, relative) = PARTS[k];
                all[k][0] - bias(without, rule, of, relative)[0]
            };
            let parts = format!(
                "{:+.1}, {:+.1} and {:+.1} are due to {cause}; ",
                part(0),
                part(1),
                part(2)
            );
            text += &parts.replace('-', "−");
        }
        if let Some(rest) = find(NOTHING) {
            let rest = PARTS.map(|(of, relative)| bias(rest, rule, of, relative)[0]);
            let rest = format!(
                "{:+.1}, {:+.1} and {:+.1} remain without the three: bins, filter and voxels. ",
                rest[0], rest[1], rest[2]
            );
            text += &rest.replace('-', "−");
        }
    }
    text + "The parts need not add up to the whole: a boundary that is blurred twice moves less than the sum of both shifts. The noise adds the bias of the second table."
}

fn plots(
    gallery: &mut Gallery<'_>,
    results: &[CaseResult],
    base: &CaseResult,
) -> Result<(), StudyError> {
    // Bias of the ejection fraction over the true one for each case of the medium heart.
    let over = |keep: &dyn Fn(&CaseResult) -> bool, rule: usize| -> Vec<[f64; 2]> {
        let kept = results.iter().filter(|r| keep(r));
        kept.map(|r| [r.truth.fraction, bias(r, rule, PARTS[2].0, false)[0]])
            .collect()
    };
    let mut draw =
        |file: &str, labels: [&str; 2], lines: Vec<(String, Vec<[f64; 2]>)>, caption: &str| {
            let lines: Vec<_> = lines
                .iter()
                .filter(|(_, points)| points.len() > 1)
                .collect();
            let lines: Vec<Curve<'_>> = (lines.iter())
                .map(|(label, points)| Curve { label, points })
                .collect();
            match lines.is_empty() {
                true => Ok(()),
                false => gallery.drawing(file, &curves(labels[0], labels[1], &lines)?, caption),
            }
        };
    let causes = [
        "all causes",
        "no gates",
        "no collimator",
        "no attenuation",
        "none of them",
    ];
    let lines = OFF.iter().zip(causes).map(|(name, label)| {
        let keep = |r: &CaseResult| r.case.acquired.size == "medium" && r.case.name == *name;
        (label.to_owned(), over(&keep, 0))
    });
    draw(
        "causes.svg",
        ["true ejection fraction", "bias of EF (0.01)"],
        lines.collect(),
        "Bias of the ejection fraction of the medium heart with each cause switched off, edge at half maximum, 8 gates.",
    )?;
    let sizes = ["small", "medium", "large"].map(|size| {
        [0, 1].map(|rule| {
            let keep = |r: &CaseResult| r.case.acquired.size == size && r.case.name == BASE;
            (
                format!("{size}, {}", ["half", "gradient"][rule]),
                over(&keep, rule),
            )
        })
    });
    draw(
        "sizes.svg",
        ["true ejection fraction", "bias of EF (0.01)"],
        sizes.concat(),
        "Bias of the ejection fraction of small, medium and large hearts by both edge rules; LEHR, 8 gates, FBP.",
    )?;
    let mut lines = Vec::new();
    for r in results
        .iter()
        .filter(|r| [BASE, SIXTEEN].contains(&r.case.name) && r.case.has_heart_of(&base.case))
    {
        for (rule, name) in r.rules().iter().zip(["half", "gradient"]) {
            let n = rule.gates.len() as f64;
            let points = (rule.gates.iter().enumerate()).map(|(k, &v)| [(k as f64 + 0.5) / n, v]);
            lines.push((format!("{n} gates, {name}"), points.collect()));
        }
    }
    draw(
        "volumes.svg",
        ["phase", "cavity volume (mL)"],
        lines,
        &format!(
            "Measured volume of each gate over the cycle, at the middle of the gate; true EDV {:.1} mL, ESV {:.1} mL.",
            base.truth.edv, base.truth.esv
        ),
    )
}

/// Published phantoms beside the results.
fn published(gallery: &mut Gallery<'_>, results: &[CaseResult]) {
    gallery.section("Published phantoms", "The programs of these studies have edge rules of their own, and their phantoms other shapes.");
    let range = |size: &[&str], names: &[&str], part: usize| -> Vec<String> {
        let (of, relative) = PARTS[part];
        [0, 1]
            .map(|rule| {
                let kept = results.iter().filter(|r| {
                    size.contains(&r.case.acquired.size) && names.contains(&r.case.name)
                });
                let ends = kept
                    .map(|r| bias(r, rule, of, relative)[0])
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                        [a.min(v), b.max(v)]
                    });
                format!("{:+.1} to {:+.1}", ends[0], ends[1]).replace('-', "−")
            })
            .to_vec()
    };
    let stroke = |name: &str| {
        [0, 1].map(|rule| {
            let found = results
                .iter()
                .find(|r| is_reference(r) && r.case.name == name);
            found.map_or([0.0; 2], |r| {
                let [v, d] = [r.rules()[rule].expected, r.rules()[rule].deviation];
                [v.edv - v.esv, d.edv.hypot(d.esv)]
            })
        })
    };
    let [eight, sixteen] = [stroke(BASE), stroke(SIXTEEN)];
    let medium = ["medium", "large"];
    let row = |what: &str, theirs: &str, ours: Vec<String>| {
        [vec![what.into(), theirs.into()], ours].concat()
    };
    let both = |format: &dyn Fn(usize) -> String| vec![format(0), format(1)];
    let value = |[v, d]: [f64; 2]| format!("{v:.1} ± {d:.1}");
    let rows = vec![
        row(
            "stroke volume by 8 gates, of 70 mL",
            "60 to 61 (AGATE)",
            both(&|k| value(eight[k])),
        ),
        row(
            "stroke volume by 16 gates, of 70 mL",
            "63 to 65 (AGATE)",
            both(&|k| value(sixteen[k])),
        ),
        row(
            "ratio of both",
            "0.945 ± 0.02",
            both(&|k| format!("{:.3}", eight[k][0] / sixteen[k][0])),
        ),
        row(
            "EF by 8 gates, 0.01, medium and large",
            "+1.25 (AGATE)",
            range(&medium, &[BASE], 2),
        ),
        row(
            "EF by 16 gates, 0.01, medium and large",
            "+3.25 (AGATE)",
            range(&medium, &[SIXTEEN], 2),
        ),
        row(
            "EDV, %, LEHR, medium",
            "−24 (dynamic phantom)",
            range(&medium[..1], &[BASE], 0),
        ),
        row(
            "ESV, %, LEHR, medium",
            "−21 (dynamic phantom)",
            range(&medium[..1], &[BASE], 1),
        ),
        row(
            "EDV, %, all hearts",
            "−26 to −52 (17 departments)",
            range(&["small", "medium", "large"], &[BASE], 0),
        ),
        row(
            "ESV, %, all hearts",
            "−15 to −60 (17 departments)",
            range(&["small", "medium", "large"], &[BASE], 1),
        ),
        row(
            "ESV, %, small hearts",
            "−78 ± 18 (QGS), −13 ± 9 (ExH)",
            range(&["small"], &[BASE], 1),
        ),
    ];
    gallery.table(
        "AGATE: doi:10.1007/s00259-003-1352-5. Dynamic phantom: doi:10.1186/s40658-017-0187-2. 17 departments: Trägårdh et al. 2015, \
            doi:10.1186/s40658-014-0105-9. Small hearts: Nakajima et al. 2013, doi:10.1007/s00259-013-2431-x",
        &["quantity", "published", RULES[0], RULES[1]],
        rows,
    );
}
