//! Tables of a page.

use super::Look;
use crate::html::table;
use heart_phantom::{GateReport, RunReport, Thickness};
use maud::Markup;

/// Tables of the heart, its phases, the counts and the image quality.
pub(super) fn tables(look: &Look<'_>, report: &RunReport) -> Vec<Markup> {
    [Some(heart(report)), Some(phases(look, report))]
        .into_iter()
        .chain([beats(report), counts(look, report), quality(look, report)])
        .flatten()
        .collect()
}

fn heart(report: &RunReport) -> Markup {
    let numbers = &report.numbers;
    let measured = report.measured.as_ref();
    let of_images = measured.and_then(|measured| measured.ejection_fraction);
    let of_truth = measured.and_then(|measured| measured.ejection_fraction_truth);
    let measures = [
        ("end-diastolic volume (mL)", Some(numbers.edv), 3),
        ("end-systolic volume (mL)", Some(numbers.esv), 3),
        ("stroke volume (mL)", Some(numbers.stroke_volume), 3),
        ("ejection fraction", Some(numbers.ejection_fraction), 5),
        (
            "ejection fraction measured in the reconstructions",
            of_images,
            5,
        ),
        (
            "ejection fraction measured in the exact activity",
            of_truth,
            5,
        ),
        ("cardiac output (L/min)", Some(numbers.cardiac_output), 3),
        ("volume of the wall (mL)", Some(numbers.wall_volume), 3),
    ];
    let rows = measures.into_iter().filter_map(|(name, value, digits)| {
        value.map(|value| vec![name.into(), format!("{value:.digits$}")])
    });
    table("The heart", &["measure", "value"], rows.collect())
}

fn phases(look: &Look<'_>, report: &RunReport) -> Markup {
    let breathes = report.phases.iter().any(|phase| phase.breath.is_some());
    let mut header = vec![
        "name",
        "phase",
        "cavity (mL)",
        "wall at the side (mm)",
        "at the apex (mm)",
    ];
    header.extend(breathes.then_some("respiratory position"));
    let gate = |of: &str| of.strip_prefix("gate-")?.parse().ok();
    let rows = report.phases.iter().map(|phase| {
        let Thickness { side, apex, .. } = phase.thickness;
        let respiratory = gate(&phase.of).map_or(String::new(), |gate| look.respiratory_gate(gate));
        let mut row = vec![
            phase.of.clone() + &respiratory,
            format!("{:.4}", phase.phase),
            format!("{:.3}", phase.cavity_ml),
            format!("{:.2}", 10.0 * side),
            format!("{:.2}", 10.0 * apex),
        ];
        row.extend(breathes.then(|| optional(phase.breath)));
        row
    });
    let caption = "The heart at the phases that represent the projections";
    table(caption, &header, rows.collect())
}

/// Accepted and rejected beats; `None` if all beats are equal.
fn beats(report: &RunReport) -> Option<Markup> {
    let beats = report.beats.as_ref()?;
    let of = |accepted: bool| {
        let all = beats.interval_s.iter().zip(&beats.accepted);
        let intervals: Vec<f64> = all
            .filter(|(_, yes)| **yes == accepted)
            .map(|(s, _)| *s)
            .collect();
        let least = intervals.iter().copied().reduce(f64::min);
        let most = intervals.iter().copied().reduce(f64::max);
        let name = if accepted { "accepted" } else { "rejected" };
        vec![
            name.into(),
            intervals.len().to_string(),
            optional(least),
            optional(most),
        ]
    };
    let header = [
        "beats",
        "number",
        "shortest R-R interval (s)",
        "longest R-R interval (s)",
    ];
    Some(table("Beats", &header, vec![of(true), of(false)]))
}

/// The number of a gate with its respiratory gate.
fn name(look: &Look<'_>, gate: usize) -> String {
    gate.to_string() + &look.respiratory_gate(gate)
}

fn optional(value: Option<f64>) -> String {
    value.map_or("-".into(), |value| format!("{value:.4}"))
}

/// `None` if the counts are unknown.
fn counts(look: &Look<'_>, report: &RunReport) -> Option<Markup> {
    // One value, or the smallest and the largest of the projections.
    let per_unit = |gate: &GateReport| match (gate.counts_per_unit, &gate.views.counts_per_unit) {
        (Some(one), _) => format!("{one:.5}"),
        (None, each) => {
            let least = each.iter().copied().fold(f64::INFINITY, f64::min);
            let most = each.iter().copied().fold(0.0, f64::max);
            format!("{least:.5} to {most:.5}")
        }
    };
    let rows: Vec<_> = (report.gates.iter().enumerate())
        .filter_map(|(gate, of)| {
            let counts = format!("{:.0}", of.counts?);
            Some(vec![name(look, gate), counts, per_unit(of)])
        })
        .collect();
    let header = [
        "gate",
        "counts in all projections",
        "counts per unit sample",
    ];
    (!rows.is_empty()).then(|| table("Counts", &header, rows))
}

/// `None` without both reconstruction and exact activity.
fn quality(look: &Look<'_>, report: &RunReport) -> Option<Markup> {
    let header = [
        "gate",
        "mean of the wall (activity concentration)",
        "coefficient of variation of the wall",
        "erosions of the wall mask",
        "blur of the outer wall edge (mm)",
        "rms difference from the ground truth",
    ];
    let rows: Vec<_> = (report.gates.iter().enumerate())
        .filter_map(|(gate, of)| {
            let found = of.artefacts.as_ref()?;
            Some(vec![
                name(look, gate),
                optional(found.wall_mean),
                optional(found.wall_unevenness),
                found.wall_erosion.to_string(),
                optional(found.wall_blur_mm),
                optional(found.rmse),
            ])
        })
        .collect();
    let caption = "Comparison of the reconstruction with the exact activity";
    (!rows.is_empty()).then(|| table(caption, &header, rows))
}
