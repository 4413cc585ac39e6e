//! The circle of the appendix of the paper: shape (Fig. 18) and error against the number of nodes.

use super::Picture;
use super::canvas::{
    Area, Axis, Drawn, LABELS_BELOW, LABELS_LEFT, Rect, axes, bounds, number, on_plot, paint,
    plane_axes,
};
use super::marks::{Entry, Sign, dashed, legend, marker, stroke};
use super::style::{BLUE, GREY, VERMILION};
use heart_phantom::PhantomError;

/// The data of the circle figure.
#[derive(Clone, Debug)]
pub(crate) struct CircleStudy {
    /// The reference configuration, a straight line, cm.
    pub(crate) initial: Vec<[f64; 2]>,
    /// The discrete equilibrium, cm.
    pub(crate) solution: Vec<[f64; 2]>,
    /// Centre of the exact circle, cm.
    pub(crate) centre: [f64; 2],
    /// Radius of the exact circle, cm.
    pub(crate) radius: f64,
    /// Numbers of nodes N of the convergence study.
    pub(crate) n_nodes: Vec<usize>,
    /// Largest distance from the exact solution for each of them, cm; positive.
    pub(crate) errors: Vec<f64>,
}

/// The legend of the left panel.
const ENTRIES: [Entry<'_>; 3] = [
    (Sign::Line(4), BLUE, "initial line"),
    (Sign::Marker { kind: 0, radius: 5 }, VERMILION, "solution"),
    (Sign::Line(4), GREY, "exact circle"),
];

/// The order of the guide line, -d log(error) / d log(N).
const ORDER: f64 = 2.0;

/// Draws the line, the discrete equilibrium and the exact circle on the left, the errors and a guide of order 2 on the right.
pub(crate) fn circle(study: &CircleStudy) -> Result<Picture, PhantomError> {
    let size = 600;
    let left = Rect {
        left: LABELS_LEFT + 10,
        top: 24,
        width: size,
        height: size,
    };
    let right = Rect {
        left: left.left + size + LABELS_LEFT + 60,
        top: 24,
        width: size - 40,
        height: size,
    };
    let exact: Vec<[f64; 2]> = (0..=360)
        .map(|k| f64::from(k).to_radians())
        .map(|a| {
            [
                study.centre[0] + study.radius * a.cos(),
                study.centre[1] + study.radius * a.sin(),
            ]
        })
        .collect();
    let around = bounds(exact.iter().chain(&study.initial).chain(&study.solution));
    let (x, y) = plane_axes(around, 0.05, (size, size), 6);
    let height = (left.top + size + LABELS_BELOW + 60) as u32;
    paint((right.left + right.width + 40) as u32, height, |area| {
        let chart = axes(area, left, "", &x, &y)?;
        stroke(&chart, &exact, GREY, 3)?;
        stroke(&chart, &study.initial, BLUE, 4)?;
        let inside = chart.plotting_area().strip_coord_spec();
        // About 60 dots for any N.
        let every = study.solution.len().div_ceil(60);
        for p in study
            .solution
            .iter()
            .step_by(every)
            .chain(study.solution.last())
        {
            marker(&inside, 0, on_plot(&chart, *p), 5, VERMILION)?;
        }
        let y0 = left.top + size + LABELS_BELOW + 20;
        legend(area, &ENTRIES, (left.left, y0))?;
        errors(area, right, y0, study)
    })
}

/// The errors and the guide in a plot, their legend at height `y0`.
fn errors(area: &Area<'_>, right: Rect, y0: i32, study: &CircleStudy) -> Drawn {
    let n_axis = Axis::decades(study.n_nodes.iter().map(|&n| n as f64), "number of nodes N");
    let error_axis = Axis::decades(study.errors.iter().copied(), "error (cm)");
    let chart = axes(area, right, "", &n_axis, &error_axis)?;
    let points: Vec<[f64; 2]> = study
        .n_nodes
        .iter()
        .zip(&study.errors)
        .map(|(&n, e)| [(n as f64).log10(), e.log10()])
        .collect();
    // The guide passes a third of a decade above the last error.
    let last = points[points.len() - 1];
    let guide = |x: f64| [x, last[1] + 0.35 - ORDER * (x - last[0])];
    let (from, to) = (points[0][0].min(last[0]), points[0][0].max(last[0]));
    dashed(&chart, [guide(from), guide(to)], GREY, 3)?;
    stroke(&chart, &points, VERMILION, 3)?;
    let inside = chart.plotting_area().strip_coord_spec();
    for p in &points {
        marker(&inside, 0, on_plot(&chart, *p), 8, VERMILION)?;
    }
    let guide = format!("order {}", number(ORDER, 0.01));
    let dot = Sign::Marker { kind: 0, radius: 8 };
    let entries = [
        (dot, VERMILION, "largest distance"),
        (Sign::Dashes, GREY, &guide),
    ];
    legend(area, &entries, (right.left, y0)).map(drop)
}
