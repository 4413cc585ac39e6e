//! `index.html` of a run: one self-contained file.

use super::kept::{Kept, Shown};
use super::measured::Plot;

use crate::StudyError;
use crate::figures::{Table, map, sections};
use crate::html::{document, figure, section};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::{RunReport, Thickness};
use maud::{Markup, PreEscaped, Render, html};

/// niivue 0.69.0, <https://www.npmjs.com/package/@niivue/niivue>, its `dist/niivue.umd.js` compressed by gzip.
const NIIVUE: &[u8] = include_bytes!("../../assets/niivue-0.69.0.umd.js.gz");
const NIIVUE_LICENCE: &str = include_str!("../../assets/niivue-LICENSE.txt");
const SCRIPT: &str = include_str!("../../assets/run.js");
const STYLE: &str = include_str!("../../assets/run.css");

/// Images first, then curves, then tables.
pub(super) fn html(
    look: &Kept<'_>,
    report: &RunReport,
    plots: &[Plot],
) -> Result<String, StudyError> {
    let body = html! {
        p { (report.program) ". This file is self-contained; its numbers are those of report.json." }
        main {
            @if !report.warnings.is_empty() {
                (section("Warnings", &html! {
                    ul { @for warning in &report.warnings { li { (warning.to_string()) } } }
                }))
            }
            @if !look.shown.is_empty() {
                (section("The beating heart", &viewer(look)?))
                (section("Sections", &slices(look)?))
            }
            @if look.sinogram.is_some() { (section("Projections", &projections(look)?)) }
            (section("Curves", &html! { div.plots { @for plot in plots { (plot) } } }))
            (section("Numbers", &html! { @for table in numbers(report) { (table) } }))
            @if let Some(scene) = &report.scene {
                (section("Scene", &html! {
                    details { summary { "scene file" } pre { (scene.to_toml()) } }
                }))
            }
        }
    };
    Ok(document("A run of heart-phantom", STYLE, &body))
}

impl Render for Plot {
    fn render(&self) -> Markup {
        html! { figure { (PreEscaped(&self.svg)) figcaption { (self.caption) } } }
    }
}

/// The sinogram of a row and three projections of the first gate.
fn projections(look: &Kept<'_>) -> Result<Markup, StudyError> {
    let Some((sinogram, images)) = &look.sinogram else {
        return Ok(Markup::default());
    };
    let most = |values: &[f32]| values.iter().copied().fold(0.0f32, f32::max);
    let high = (images.iter()).fold(0.0, |high: f32, cut| high.max(most(&cut.values)));
    let window = |high: f32| [0.0, if high > 0.0 { f64::from(high) } else { 1.0 }];
    let size = [480, 360];
    let row = map(sinogram, size, window(most(&sinogram.values)), "sample")?;
    let three = sections(images, window(high), "sample", "")?;
    Ok(html! {
        (figure(&row, "Sinogram of the first gate, the row through the middle of the heart; s is the position within the row.")?)
        (figure(&three, "Three projections of the first gate in the direction of the rays, superior on top.")?)
    })
}

fn numbers(report: &RunReport) -> Vec<Table> {
    let numbers = &report.numbers;
    let measures = [
        ("end-diastolic volume (mL)", numbers.edv, 3),
        ("end-systolic volume (mL)", numbers.esv, 3),
        ("stroke volume (mL)", numbers.stroke_volume, 3),
        ("ejection fraction", numbers.ejection_fraction, 5),
        ("cardiac output (L/min)", numbers.cardiac_output, 3),
        ("volume of the wall (mL)", numbers.wall_volume, 3),
    ];
    let row =
        |(name, value, digits): (&str, f64, usize)| vec![name.into(), format!("{value:.digits$}")];
    let rows = measures.map(row).to_vec();
    let mut tables = vec![Table::new("The heart", &["measure", "value"], rows)];
    let header = [
        "phase of",
        "phase",
        "cavity (mL)",
        "wall at the side (mm)",
        "at the apex (mm)",
    ];
    let rows = report.phases.iter().map(|phase| {
        let Thickness { side, apex, .. } = phase.thickness;
        vec![
            phase.of.clone(),
            format!("{:.4}", phase.phase),
            format!("{:.3}", phase.cavity_ml),
            format!("{:.2}", 10.0 * side),
            format!("{:.2}", 10.0 * apex),
        ]
    });
    let caption = "The heart at the phases that represent the projections. The phase is the fraction of the R-R interval since \
        the start of the cycle";
    tables.push(Table::new(caption, &header, rows.collect()));
    let judged: Vec<_> = (report.gates.iter().enumerate())
        .filter_map(|(gate, of)| Some((gate, of.artefacts.as_ref()?)))
        .collect();
    if !judged.is_empty() {
        let told = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.4}"));
        let header = [
            "gate",
            "mean of the wall",
            "unevenness",
            "edge of the wall (mm)",
            "rms difference from the ground truth",
        ];
        let rows = judged.into_iter().map(|(gate, found)| {
            vec![
                (gate + 1).to_string(),
                told(found.wall_mean),
                told(found.wall_unevenness),
                told(found.wall_blur_mm),
                told(found.rmse),
            ]
        });
        let caption = "Comparison of the reconstruction with the exact activity";
        tables.push(Table::new(caption, &header, rows.collect()));
    }
    tables
}

/// The 4-D viewer with its volumes. It is hidden until it has started; without JavaScript or WebGL2 a sentence replaces it.
fn viewer(look: &Kept<'_>) -> Result<Markup, StudyError> {
    let coarser = match look.shown[0].beat.factor() {
        1 => String::new(),
        n => format!(" Voxels of this page are averages over {n} x {n} x {n}."),
    };
    let seconds = look.phantom.cycle().period() / look.phantom.n_gates() as f64;
    let volume = |shown: &Shown| -> Result<Markup, StudyError> {
        let window = shown.window();
        Ok(html! {
            script type="application/octet-stream" id=(shown.name) data-black="0" data-white=(window[1]) data-seconds=(seconds) {
                (PreEscaped(shown.beat.base64(window)?))
            }
        })
    };
    // A comment ends at the first two hyphens.
    let licence = NIIVUE_LICENCE.replace("--", "- -");
    Ok(html! {
        p {
            "Drag to move the cross, scroll to change the slice, drag the body to rotate it; lengths are in mm. The patient's left is on the \
             right, the radiological convention." (coarser)
        }
        p #beat-state role="status" {}
        noscript { p { "The viewer needs JavaScript; the rest of this page does not." } }
        div #beat-view hidden {
            div.controls {
                label for="beat-volume" { "volume" }
                select #beat-volume {
                    @for shown in &look.shown { option value=(shown.name) { (shown.what()) } }
                }
                button #beat-play { "play" }
                label for="beat-gate" { "gate" }
                input #beat-gate type="range" min="0" max="0" value="0";
            }
            div.viewer {
                canvas #beat width="960" height="544" role="img"
                    aria-label="Axial, coronal and sagittal slices and a rendering of the volume at the gate chosen; the sections below show the same" {}
            }
        }
        @for shown in &look.shown { (volume(shown)?) }
        (PreEscaped(format!("<!-- niivue 0.69.0\n{licence}-->\n")))
        script type="application/octet-stream" id="niivue" { (PreEscaped(STANDARD.encode(NIIVUE))) }
        script { (PreEscaped(SCRIPT)) }
    })
}

/// Sections of each kind of volume; of several gates those with the largest and smallest cavity.
fn slices(look: &Kept<'_>) -> Result<Markup, StudyError> {
    let n_gates = look.phantom.n_gates();
    let mut gates = vec![0];
    if n_gates > 1 {
        let [systole, diastole] = look.phantom.extreme_phases();
        let gate =
            |phase: f64| ((phase.rem_euclid(1.0) * n_gates as f64) as usize).min(n_gates - 1);
        gates = vec![gate(diastole), gate(systole)];
        gates.dedup();
    }
    let of = |shown: &Shown, gate: usize| {
        let [black, white] = shown.window();
        let caption = format!(
            "{}, {}: black is {black:.4}, white {white:.4} {}, the largest sample of these sections in all gates. Letters: left and \
             right, anterior and posterior, superior and inferior; axes of the heart as seen from the apex.",
            shown.what(),
            look.when(gate),
            look.unit()
        );
        figure(&look.picture(shown, gate)?, &caption)
    };
    Ok(html! {
        @for shown in &look.shown { @for &gate in &gates { (of(shown, gate)?) } }
    })
}
