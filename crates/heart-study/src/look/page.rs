//! `index.html` of a run: one file, which needs no network and no other file.

use super::kept::{Kept, Shown};
use super::measured::Plot;

use crate::StudyError;
use crate::figures::{Picture, Table, escape as escaped, head, map};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::{RunReport, Thickness};
use std::fmt::Write as _;

/// niivue 0.69.0, <https://www.npmjs.com/package/@niivue/niivue>, its `dist/niivue.umd.js` by gzip.
const NIIVUE: &[u8] = include_bytes!("../../assets/niivue-0.69.0.umd.js.gz");
const NIIVUE_LICENCE: &str = include_str!("../../assets/niivue-LICENSE.txt");
const SCRIPT: &str = include_str!("../../assets/run.js");
const STYLE: &str = include_str!("../../assets/run.css");

pub(super) fn html(
    look: &Kept<'_>,
    report: &RunReport,
    plots: &[Plot],
) -> Result<String, StudyError> {
    let mut html = head("A run of heart-phantom", STYLE);
    let _ = writeln!(
        html,
        "<p>{}. Everything is in this file; the numbers are those of report.json.</p>\n<main>",
        escaped(&report.program)
    );
    warnings(&mut html, report);
    section(&mut html, "Numbers");
    for table in numbers(report) {
        table.push(&mut html)?;
    }
    section(&mut html, "The beat");
    html.push_str("<div class=\"plots\">\n");
    for Plot { svg, caption } in plots {
        let caption = escaped(caption);
        let _ = writeln!(
            html,
            "<figure>{svg}<figcaption>{caption}</figcaption></figure>"
        );
    }
    html.push_str("</div>\n");
    if !look.shown.is_empty() {
        viewer(look, &mut html)?;
    }
    if let Some((sinogram, images)) = &look.sinogram {
        section(&mut html, "What the camera saw");
        let most = |values: &[f32]| values.iter().copied().fold(0.0f32, f32::max);
        let high = images
            .iter()
            .map(|cut| most(&cut.values))
            .fold(0.0, f32::max);
        let window = |high: f32| [0.0, if high > 0.0 { f64::from(high) } else { 1.0 }];
        let picture = map(
            sinogram,
            [480, 360],
            window(most(&sinogram.values)),
            "sample",
        )?;
        let caption = "The row of the heart's middle in every view of the first gate; s is the place in the row.";
        figure(&mut html, &picture, caption)?;
        let picture = crate::figures::sections(images, window(high), "sample", "")?;
        figure(
            &mut html,
            &picture,
            "Three views of the first gate, the head on top, seen along the rays.",
        )?;
    }
    slices(look, &mut html)?;
    if let Some(scene) = &report.scene {
        section(&mut html, "The scene");
        let _ = writeln!(
            html,
            "<details><summary>as a file</summary><pre>{}</pre></details>",
            escaped(&scene.to_toml())
        );
    }
    html.push_str("</section>\n</main>\n</body>\n</html>\n");
    Ok(html)
}

/// Ends a section, if there is one, and begins another.
fn section(html: &mut String, title: &str) {
    if html.contains("<section>") {
        html.push_str("</section>\n");
    }
    let _ = writeln!(html, "<section>\n<h2>{}</h2>", escaped(title));
}

fn warnings(html: &mut String, report: &RunReport) {
    if report.warnings.is_empty() {
        return;
    }
    section(html, "Warnings");
    html.push_str("<ul>\n");
    for warning in &report.warnings {
        let _ = writeln!(html, "<li>{}</li>", escaped(&warning.to_string()));
    }
    html.push_str("</ul>\n");
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
    let caption = "The heart at the phases that stand for the views";
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
            "rms difference from the truth",
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
        let caption = "The reconstruction against the exact activity";
        tables.push(Table::new(caption, &header, rows.collect()));
    }
    tables
}

/// The 4-D viewer with its volumes.
fn viewer(look: &Kept<'_>, html: &mut String) -> Result<(), StudyError> {
    section(html, "The heart beating");
    let first = &look.shown[0].beat;
    let coarser = match first.factor() {
        1 => String::new(),
        n => format!(" Voxels of this page are means over {n} x {n} x {n}."),
    };
    let _ = writeln!(
        html,
        "<p>Drag to move the cross, scroll to go through the slices, drag the body to turn it; lengths are in mm. \
         Left is on the right, as radiologists look at it.{coarser}</p>"
    );
    html.push_str("<div class=\"controls\"><select id=\"beat-volume\">");
    for Shown { name, .. } in &look.shown {
        let _ = write!(html, "<option value=\"{name}\">{name}</option>");
    }
    html.push_str(
        "</select><button id=\"beat-play\">play</button>\
         <input id=\"beat-gate\" type=\"range\" min=\"0\" max=\"0\" value=\"0\" aria-label=\"gate\"><output id=\"beat-state\"></output></div>\n\
         <div class=\"viewer\"><canvas id=\"beat\" width=\"960\" height=\"544\"></canvas></div>\n\
         <noscript><p>The viewer needs JavaScript; everything else on this page does not.</p></noscript>\n",
    );
    let seconds = look.phantom.cycle().period() / look.phantom.n_gates() as f64;
    for shown in &look.shown {
        let window = shown.window();
        let (name, data) = (shown.name, shown.beat.base64(window)?);
        let [black, white] = [0.0, window[1]];
        let _ = writeln!(
            html,
            "<script type=\"application/octet-stream\" id=\"{name}\" data-black=\"{black}\" data-white=\"{white}\" \
             data-seconds=\"{seconds}\">{data}</script>"
        );
    }
    let niivue = STANDARD.encode(NIIVUE);
    let _ = writeln!(
        html,
        "<!-- niivue 0.69.0\n{}-->\n<script type=\"application/octet-stream\" id=\"niivue\">{niivue}</script>\n<script>\n{SCRIPT}</script>",
        NIIVUE_LICENCE.replace("--", "- -")
    );
    Ok(())
}

/// Sections of each kind of volume: of gates those of the largest and of the smallest cavity.
fn slices(look: &Kept<'_>, html: &mut String) -> Result<(), StudyError> {
    if look.shown.is_empty() {
        return Ok(());
    }
    section(html, "Sections");
    let n_gates = look.phantom.n_gates();
    let mut gates = vec![0];
    if n_gates > 1 {
        let [systole, diastole] = look.phantom.extreme_phases();
        let gate =
            |phase: f64| ((phase.rem_euclid(1.0) * n_gates as f64) as usize).min(n_gates - 1);
        gates = vec![gate(diastole), gate(systole)];
        gates.dedup();
    }
    for shown in &look.shown {
        let [black, white] = shown.window();
        for &gate in &gates {
            let caption = format!(
                "{}, {}: black is {black:.4}, white {white:.4} {}, the largest sample of these sections in all gates. \
                 Letters: left and right, anterior and posterior, superior and inferior; the heart's axes as seen from the apex.",
                shown.what(),
                look.when(gate),
                look.unit()
            );
            figure(html, &look.picture(shown, gate)?, &caption)?;
        }
    }
    Ok(())
}

fn figure(html: &mut String, picture: &Picture, caption: &str) -> Result<(), StudyError> {
    let (width, height) = (picture.width(), picture.height());
    let (png, caption) = (STANDARD.encode(picture.to_png()?), escaped(caption));
    let _ = writeln!(
        html,
        "<figure><img src=\"data:image/png;base64,{png}\" width=\"{width}\" height=\"{height}\" alt=\"{caption}\">\
         <figcaption>{caption}</figcaption></figure>"
    );
    Ok(())
}
