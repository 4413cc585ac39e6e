//! Curves over one variable, as SVG.

use plotters::chart::ChartBuilder;
use plotters::element::PathElement;
use plotters::prelude::{Color, IntoDrawingArea, SVGBackend};
use plotters::series::LineSeries;

use super::canvas::round_ticks;
use super::style::{FAINT, GREY, SERIES, ramp, register};
use super::{FigureError, check};

/// Width and height in pixels of 1/96 inch.
const SIZE: (u32, u32) = (640, 400);

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
/// # Ok::<(), heart_study::figures::FigureError>(())
/// ```
///
/// # Errors
/// [`FigureError`] if there is no curve, one has fewer than two points, or a number is not finite.
pub fn curves(x_label: &str, y_label: &str, curves: &[Curve<'_>]) -> Result<String, FigureError> {
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
        let refused = |error: Box<dyn std::error::Error + Send + Sync>| FigureError::Drawing(error);
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

/// Some room above and below.
fn roomy([low, high]: [f64; 2]) -> [f64; 2] {
    let room = 0.06 * (high - low).max(1e-9 * high.abs().max(1e-9));
    [low - room, high + room]
}
