//! Curves over the cycle and over the views, and the projections.

use super::kept::Look;
use super::planes::SHORT_AXIS;
use crate::figures::{Cut, curves as drawn, projection};
use heart_phantom::PhantomError;
use heart_phantom::membrane_forces::PressureLaw;
use heart_phantom::revolve_voxel::nalgebra::Point3;
use heart_phantom::{Phantom, RunReport};

/// Points of a curve over the cycle.
const POINTS: usize = 96;
/// Phases of the pressure curves.
const SOLVED: usize = 24;

/// A plot of a page.
#[derive(Debug)]
pub(super) struct Plot {
    pub(super) svg: String,
    pub(super) caption: String,
}

/// Volume and pressures over the cycle, profiles and projection sums.
pub(super) fn curves(look: &Look<'_>, report: &RunReport) -> Result<Vec<Plot>, PhantomError> {
    let (phantom, sums) = (look.phantom, &look.sums);
    let (cycle, numbers) = (phantom.cycle(), &report.numbers);
    let [low, high] = cycle.gains();
    let volume = |phase: f64| {
        let share = match high > low {
            true => (cycle.gain(phase) - low) / (high - low),
            false => 0.0,
        };
        numbers.esv + share * (numbers.edv - numbers.esv)
    };
    let phases = (0..=POINTS).map(|k| k as f64 / POINTS as f64);
    let cavity: Vec<[f64; 2]> = phases.map(|phase| [phase, volume(phase)]).collect();
    let mut plots = vec![Plot {
        svg: drawn("phase", "cavity volume (mL)", &[("", cavity)])?,
        caption: "Volume of the cavity over one cardiac cycle.".into(),
    }];
    let phases: Vec<f64> = (0..=SOLVED).map(|k| k as f64 / SOLVED as f64).collect();
    let gains: Vec<f64> = phases.iter().map(|&phase| cycle.gain(phase)).collect();
    let shapes = phantom.heart().shapes(&gains)?;
    let of_rubber = shapes.iter().all(|shape| shape.pressures_mmhg().is_some());
    let pressure = |which: usize| -> Vec<[f64; 2]> {
        let each = phases.iter().zip(&shapes).map(|(&phase, shape)| {
            let solution = shape.solution();
            let intensities = [&solution.inner, &solution.outer].map(|solved| solved.intensity);
            [phase, shape.pressures_mmhg().unwrap_or(intensities)[which]]
        });
        each.collect()
    };
    let both = [("endocardial", pressure(0)), ("epicardial", pressure(1))];
    let is_pressure = phantom.scene().heart.law == PressureLaw::PerCurrentLength;
    let (label, caption) = match (of_rubber, is_pressure) {
        (true, _) => (
            "pressure (mmHg)",
            "Pressure across each membrane over one cardiac cycle.",
        ),
        (false, true) => (
            "pressure (stiffness)",
            "Pressure across each membrane over one cardiac cycle, in units of the spring stiffness.",
        ),
        (false, false) => (
            "force intensity (stiffness x cm)",
            "Pressure force on each membrane per unit of its material coordinate over one cardiac cycle, in units of spring stiffness \
             times cm.",
        ),
    };
    plots.push(Plot {
        svg: drawn("phase", label, &both)?,
        caption: caption.into(),
    });
    plots.extend(profiles(look)?);
    if sums.iter().all(|sum| sum.len() > 1) && !sums.is_empty() {
        plots.push(sums_of_views(sums)?);
    }
    Ok(plots)
}

/// The row through the middle of the short-axis section of the first gate, in each kind of volume; `None` without volumes.
fn profiles(look: &Look<'_>) -> Result<Option<Plot>, PhantomError> {
    let Some(first) = look.shown.first() else {
        return Ok(None);
    };
    let of = |cut: &Cut| -> Vec<[f64; 2]> {
        let [columns, rows] = cut.size;
        let [from, to] = cut.extent[0];
        let centre = |k: usize| from + (k as f64 + 0.5) * (to - from) / columns as f64;
        let row = &cut.values[rows / 2 * columns..][..columns];
        let points = row.iter().enumerate();
        points
            .map(|(k, &value)| [centre(k), value.into()])
            .collect()
    };
    let lines: Vec<_> = (look.shown.iter())
        .map(|shown| {
            let label = match shown.name {
                "reconstruction" => "reconstruction",
                _ => "exact activity",
            };
            (label, of(&shown.cuts[0][SHORT_AXIS]))
        })
        .collect();
    let [left, right, ..] = &first.cuts[0][SHORT_AXIS].marks;
    let along = format!("distance from the long axis (cm), {left} to {right}");
    Ok(Some(Plot {
        svg: drawn(
            &along,
            &format!("activity concentration ({})", look.unit()),
            &lines,
        )?,
        caption: format!(
            "Profile through the wall in the short-axis section, {}: the row through the long axis, from {left} to {right} (left, right, \
             anterior, posterior, superior, inferior).",
            look.when(0)
        ),
    }))
}

/// Sum of each projection, by gate.
fn sums_of_views(sums: &[Vec<f64>]) -> Result<Plot, PhantomError> {
    let views: Vec<(String, Vec<[f64; 2]>)> = (sums.iter().enumerate())
        .map(|(gate, sum)| {
            let label = match sums.len() {
                1 => String::new(),
                _ => format!("gate {gate}"),
            };
            let points = sum.iter().enumerate().map(|(k, &sum)| [k as f64, sum]);
            (label, points.collect())
        })
        .collect();
    Ok(Plot {
        svg: drawn("projection", "sum x bin area", &views)?,
        caption: "Sum of all samples of each projection times the bin area. Colours run from the first to the last gate.".into(),
    })
}

/// Extracts from views `[view][row][bin]` the row at the height of the centre of the heart in all views, and three views.
pub(super) fn cuts(phantom: &Phantom, views: &[f32]) -> Result<(Cut, Vec<Cut>), PhantomError> {
    let camera = phantom.camera();
    let (bins, rows, n_views) = (camera.n_bins(), camera.n_rows(), camera.n_views());
    let [bin, row] = camera.detector().pitch();
    let heart = phantom.heart();
    let middle = heart
        .pose()
        .to_lab(&Point3::new(0.5 * heart.length(), 0.0, 0.0));
    let at = (middle.z / row + 0.5 * (rows as f64 - 1.0)).round();
    let at = at.clamp(0.0, rows as f64 - 1.0) as usize;
    let half = 0.5 * bins as f64 * bin;
    let sinogram = Cut {
        title: format!(
            "sinogram, z = {:.2} cm",
            (at as f64 - 0.5 * (rows as f64 - 1.0)) * row
        ),
        labels: ["s (cm)".into(), "view".into()],
        marks: Default::default(),
        size: [bins, n_views],
        values: (views.chunks_exact(rows * bins))
            .flat_map(|view| &view[at * bins..(at + 1) * bins])
            .copied()
            .collect(),
        extent: [[-half, half], [-0.5, n_views as f64 - 0.5]],
    };
    let times = phantom.view_times(0)?;
    let mut chosen = vec![0, n_views / 3, 2 * n_views / 3];
    chosen.dedup();
    let images = (chosen.into_iter())
        .map(|k| {
            let title = format!("view {k}, {:.1}°", times[k].angle.to_degrees());
            projection(
                title,
                camera,
                &views[k * rows * bins..(k + 1) * rows * bins],
            )
        })
        .collect();
    Ok((sinogram, images))
}
