//! Curves over one variable, as SVG.

use crate::StudyError;
use plotters::chart::{ChartBuilder, SeriesLabelPosition};
use plotters::element::PathElement;
use plotters::prelude::{Color, IntoDrawingArea, SVGBackend};
use plotters::series::LineSeries;

use super::canvas::round_ticks;
use super::style::{FAINT, GREY, SERIES, ramp, register};
use super::{check};

/// Width and height in pixels of 1/96 inch.
pub(crate) const SIZE: (u32, u32) = (640, 400);

/// A curve.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a> {
    /// Its name in the legend; an empty one has no entry.
    pub label: &'a str,
    /// Points `[x, y]` in their order.
    pub points: &'a [[f64; 2]],
}

/// Draws curves in one pair of axes and gives the SVG. Up to six have colours that are told apart with any kind of colour vision, more
/// the colours of an ordered family.
///
/// ```
/// use heart_study::figures::{Curve, curves};
/// let volume = Curve { label: "cavity", points: &[[0.0, 149.0], [0.4, 93.0], [1.0, 149.0]] };
/// let svg = curves("phase", "volume (mL)", &[volume])?;
/// assert!(svg.starts_with("<svg") && svg.contains("cavity"));
/// # Ok::<(), heart_study::StudyError>(())
/// ```
///
/// # Errors
/// [`StudyError`] if there is no curve, one has fewer than two points, or a number is not finite.
pub fn curves(x_label: &str, y_label: &str, curves: &[Curve<'_>]) -> Result<String, StudyError> {
    check::at_least("curves", curves.len(), 1)?;
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for curve in curves {
        check::at_least("points of a curve", curve.points.len(), 2)?;
        for point in curve.points {
            check::finite("points of a curve", point)?;
            for (bound, value) in bounds.iter_mut().zip(point) {
                *bound = [bound[0].min(*value), bound[1].max(*value)];
            }
        }
    }
    let [x, y] = bounds;
    let y = roomy(y);
    register();
    let mut svg = String::new();
    {
        let refused = |error: Box<dyn std::error::Error + Send + Sync>| StudyError::Drawing(error);
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d(x[0]..x[1].max(x[0] + f64::MIN_POSITIVE), y[0]..y[1])
            .map_err(|error| refused(Box::new(error)))?;
        chart
            .configure_mesh()
            .bold_line_style(FAINT)
            .light_line_style(plotters::style::TRANSPARENT)
            .axis_style(GREY)
            .label_style(("sans-serif", 15))
            .axis_desc_style(("sans-serif", 17))
            .x_labels(round_ticks(x[0], x[1], 8).len().max(2))
            .x_desc(x_label)
            .y_desc(y_label)
            .draw()
            .map_err(|error| refused(Box::new(error)))?;
        for (k, curve) in curves.iter().enumerate() {
            let colour = match curves.len() {
                0..=6 => SERIES[k],
                n => ramp(k as f64 / (n - 1) as f64),
            };
            let points = curve.points.iter().map(|&[x, y]| (x, y));
            let drawn = chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))
                .map_err(|error| refused(Box::new(error)))?;
            if !curve.label.is_empty() {
                drawn.label(curve.label).legend(move |(x, y)| {
                    PathElement::new(vec![(x, y), (x + 22, y)], colour.stroke_width(2))
                });
            }
        }
        if curves.iter().any(|curve| !curve.label.is_empty()) {
            chart
                .configure_series_labels()
                .position(free_place(curves, [x, y]))
                .border_style(FAINT)
                .background_style(plotters::style::WHITE.mix(0.85))
                .label_font(("sans-serif", 15))
                .draw()
                .map_err(|error| refused(Box::new(error)))?;
        }
        area.present().map_err(|error| refused(Box::new(error)))?;
    }
    Ok(svg)
}

/// Where a legend hides least of the curves.
fn free_place(curves: &[Curve<'_>], [x, y]: [[f64; 2]; 2]) -> SeriesLabelPosition {
    let entries = curves.iter().filter(|curve| !curve.label.is_empty());
    // Shares of the axes that it takes: a line of 15 pixels and the room about it for each entry, half of the width at most.
    let (wide, high) = (0.5, 0.09 * entries.count() as f64);
    let middle = 0.5 * (1.0 - high);
    let hidden = |left: f64, bottom: f64| {
        let mut n = 0;
        for pair in curves.iter().flat_map(|curve| curve.points.windows(2)) {
            for k in 0..8 {
                let at = |a: usize, [low, high]: [f64; 2]| {
                    let p = pair[0][a] + (pair[1][a] - pair[0][a]) * f64::from(k) / 8.0;
                    (p - low) / (high - low).max(f64::MIN_POSITIVE)
                };
                let (u, v) = (at(0, x) - left, at(1, y) - bottom);
                n += u32::from((0.0..=wide).contains(&u) && (0.0..=high).contains(&v));
            }
        }
        n
    };
    let (right, top) = (1.0 - wide, 1.0 - high);
    [
        (SeriesLabelPosition::MiddleRight, hidden(right, middle)),
        (SeriesLabelPosition::UpperRight, hidden(right, top)),
        (SeriesLabelPosition::LowerRight, hidden(right, 0.0)),
        (SeriesLabelPosition::UpperLeft, hidden(0.0, top)),
        (SeriesLabelPosition::LowerLeft, hidden(0.0, 0.0)),
        (SeriesLabelPosition::MiddleLeft, hidden(0.0, middle)),
    ]
    .into_iter()
    .min_by_key(|(_, hidden)| *hidden)
    .map_or(SeriesLabelPosition::MiddleRight, |(place, _)| place)
}

/// Some room above and below.
fn roomy([low, high]: [f64; 2]) -> [f64; 2] {
    let room = 0.06 * (high - low).max(1e-9 * high.abs().max(1e-9));
    [low - room, high + room]
}
