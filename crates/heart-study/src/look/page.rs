//! `index.html` of a run: one self-contained file.

use super::kept::{Look, Shown};
use super::measured::Plot;
use super::tables::tables;

use crate::figures::{map, polar_maps, sections, window};
use crate::html::{document, figure, section};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use heart_phantom::PhantomError;
use heart_phantom::{GatedBy, Mode, RunReport, VolumeCurve};
use maud::{Markup, PreEscaped, Render, html};
use std::slice::from_ref;

/// niivue 0.69.0, <https://www.npmjs.com/package/@niivue/niivue>, its `dist/niivue.umd.js` compressed by gzip.
const NIIVUE: &[u8] = include_bytes!("../../assets/niivue-0.69.0.umd.js.gz");
const NIIVUE_LICENCE: &str = include_str!("../../assets/niivue-LICENSE.txt");
const SCRIPT: &str = include_str!("../../assets/run.js");
const STYLE: &str = include_str!("../../assets/run.css");

/// Images first, then curves, then tables.
pub(super) fn html(
    look: &Look<'_>,
    report: &RunReport,
    title: &str,
    plots: &[Plot],
) -> Result<String, PhantomError> {
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
                (section("Polar maps", &html! { div.plots { @for plot in &maps(look, report) { (plot) } } }))
            }
            @if look.sinogram.is_some() { (section("Projections", &projections(look)?)) }
            (section("Curves", &html! { p { (phases(look)) } div.plots { @for plot in plots { (plot) } } }))
            (section("Numbers", &html! { @for table in tables(look, report) { (table) } }))
            @if let Some(scene) = &report.scene {
                (section("Scene", &html! {
                    details { summary { "scene file" } pre { (scene.to_toml()) } }
                }))
            }
        }
    };
    Ok(document(title, STYLE, &body))
}

impl Render for Plot {
    fn render(&self) -> Markup {
        html! { figure { (PreEscaped(&self.svg)) figcaption { (self.caption) } } }
    }
}

/// The sinogram of a row and three projections of the first gate.
fn projections(look: &Look<'_>) -> Result<Markup, PhantomError> {
    let Some((sinogram, images)) = &look.sinogram else {
        return Ok(Markup::default());
    };
    let size = [480, 360];
    let label = match look.phantom.scene().counting {
        Some(_) => "sample (MBq cm/mL)",
        None => "sample (cm/mL)",
    };
    let row = map(sinogram, size, window(from_ref(sinogram)), label)?;
    let three = sections(images, window(images), label, "")?;
    let times = look.phantom.view_times(0)?;
    let ends = [0, times.len() - 1].map(|k| format!("{k} at {:.1}°", times[k].angle.to_degrees()));
    let caption = format!(
        "Sinogram of the first gate, the row through the middle of the heart; s is the position within the row. Views {}. A sample is \
         activity concentration times cm.",
        ends.join(" to ")
    );
    Ok(html! {
        (figure(&row, &caption)?)
        (figure(&three, "Three projections of the first gate in the direction of the rays, superior on top.")?)
    })
}

/// The 4-D viewer with its volumes. It is hidden until it has started; without JavaScript or WebGL2 a sentence replaces it.
fn viewer(look: &Look<'_>) -> Result<Markup, PhantomError> {
    let coarser = match look.shown[0].beat.factor {
        1 => String::new(),
        n => format!(" Voxels of this page are averages over {n} x {n} x {n}."),
    };
    let seconds = look.phantom.cycle().period() / look.phantom.n_gates() as f64;
    let volume = |shown: &Shown| -> Result<Markup, PhantomError> {
        let window = shown.window();
        Ok(html! {
            script type="application/octet-stream" id=(shown.name) data-black="0" data-white=(window[1]) data-seconds=(seconds)
                data-gates=(look.phantom.n_cardiac_gates()) {
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

/// Sections of each kind of volume and their difference in the gates of [`extremes`].
fn slices(look: &Look<'_>) -> Result<Markup, PhantomError> {
    let walls = match look.planes.is_anatomical() {
        true => {
            " with the anterior wall on top and the lateral wall to the right, as are the polar maps"
        }
        false => "",
    };
    let of = |shown: &Shown, gate: usize| {
        let [black, white] = shown.window();
        let caption = format!(
            "{}, {}: activity concentration, black is {black:.4}, white {white:.4} {}, the largest voxel value of these sections in all \
             gates. Letters: left and right, anterior and posterior, superior and inferior. The short axis is viewed from the apex{walls}.",
            shown.what(),
            look.when(gate),
            look.unit()
        );
        figure(&look.picture(shown, gate)?, &caption)
    };
    let difference = |gate: usize| {
        let Some((picture, white)) = look.difference(gate)? else {
            return Ok(Markup::default());
        };
        let caption = format!(
            "Reconstruction minus exact activity, {}: grey is 0, black -{white:.4}, white {white:.4} {}, the largest magnitude in \
             all gates.",
            look.when(gate),
            look.unit()
        );
        figure(&picture, &caption)
    };
    Ok(html! {
        @for gate in extremes(look) {
            @for shown in &look.shown { (of(shown, gate)?) }
            (difference(gate)?)
        }
    })
}

/// Of several gates those with the largest and smallest cavity, in the first respiratory gate.
fn extremes(look: &Look<'_>) -> Vec<usize> {
    let Mode::Gated { gates: n_gates } = look.phantom.scene().acquisition.mode else {
        return vec![0];
    };
    let [systole, diastole] = look.phantom.cycle().extreme_phases();
    let gate = |phase: f64| ((phase.rem_euclid(1.0) * n_gates as f64) as usize).min(n_gates - 1);
    let mut gates = vec![gate(diastole), gate(systole)];
    gates.dedup();
    gates
}

/// Polar maps of reconstruction and exact activity in the gates of [`extremes`], with one colour scale.
fn maps(look: &Look<'_>, report: &RunReport) -> Vec<Plot> {
    let of_gate = |gate: usize| {
        let of = &report.gates[gate];
        let maps = [
            ("reconstruction", of.polar_map),
            ("exact activity", of.polar_map_truth),
        ];
        let maps = maps.into_iter();
        maps.filter_map(|(title, map)| Some((title, map?.segments)))
            .collect::<Vec<_>>()
    };
    let gates: Vec<_> = (extremes(look).into_iter())
        .map(|gate| (gate, of_gate(gate)))
        .filter(|(_, maps)| !maps.is_empty())
        .collect();
    let values = gates.iter().flat_map(|(_, maps)| maps);
    let values = values.flat_map(|(_, segments)| segments);
    let largest = values.copied().fold(0.0, f64::max);
    let largest = if largest > 0.0 { largest } else { 1.0 };
    let drawn = |(gate, maps): &(usize, Vec<_>)| Plot {
        svg: polar_maps(maps, largest, look.unit()),
        caption: format!(
            "Viewed from the apex, the anterior wall on top: mean of the largest voxel values across the wall in the 17 segments of the \
                 American Heart Association, {}, in percent of {largest:.4} {}, the largest segment of the maps on this page.",
            look.when(*gate),
            look.unit()
        ),
    };
    gates.iter().map(drawn).collect()
}

/// The definition of phase, and the phases of end-diastole and end-systole.
fn phases(look: &Look<'_>) -> String {
    let zero = match look.phantom.scene().cycle.curve {
        VolumeCurve::Sinusoid => "end-systole (sinusoidal volume curve)",
        VolumeCurve::Physiological => {
            "the onset of the QRS complex (R wave; physiological volume curve)"
        }
        _ => "the first sample of the volume curve",
    };
    let [systole, diastole] = look.phantom.cycle().extreme_phases();
    let ends =
        format!("End-diastole is at phase {diastole:.3}, end-systole at phase {systole:.3}.");
    let numbers = "Gates and projections are numbered from 0.";
    let Some(beats) = &look.phantom.scene().beats else {
        return format!(
            "Phase is the fraction of the cardiac cycle; phase 0 is {zero}. {ends} {numbers}"
        );
    };
    let rate = look.phantom.scene().cycle.beats_per_minute;
    let gates = match beats.gated_by {
        GatedBy::TimeAfterR => {
            let period = look.phantom.cycle().period();
            format!("Gates are equal times after phase 0: together {period:.3} s")
        }
        _ => "Gates are equal fractions of each R-R interval".into(),
    };
    format!(
        "Phase is the fraction of the cardiac cycle at {rate} beats per minute; phase 0 is {zero}. In an R-R interval of another \
         length, systole keeps its duration and diastole takes the remaining time. {ends} {gates}; the phase of a gate is its middle \
         at {rate} beats per minute. {numbers}"
    )
}
