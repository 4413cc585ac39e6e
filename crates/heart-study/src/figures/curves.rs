//! Curves over one variable, as SVG.

use heart_phantom::{PhantomError, check_value};
use plotters::chart::ChartBuilder;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::element::{PathElement, Text};
use plotters::prelude::{Color, IntoDrawingArea, SVGBackend};
use plotters::series::LineSeries;
use plotters::style::{IntoTextStyle, RGBColor};

use super::canvas::{bounds, not_drawn, round_ticks};
use super::style::{FAINT, FONT, GREY, SERIES, ramp, register};

/// Width and height in pixels of 1/96 inch.
pub(crate) const SIZE: (u32, u32) = (640, 400);

/// The name and the points of a curve.
type Curve<'a> = (&'a str, &'a [[f64; 2]]);

type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// Most names in a legend: as many as fit beside the axes.
const MOST_NAMES: usize = 17;

/// Draws curves in one pair of axes with a legend beside them. Returns the SVG, with an accessible label. A curve is its name in the
/// legend, where an empty one has no entry, and its points `[x, y]` in their order. Up to six curves have colours that are
/// distinguishable with any colour vision, more curves the colours of an ordered family.
///
/// # Errors
/// [`PhantomError::OutOfRange`]: a library that divides an axis into equal steps needs finite ends.
pub(crate) fn curves(
    x_label: &str,
    y_label: &str,
    curves: &[(impl AsRef<str>, impl AsRef<[[f64; 2]]>)],
) -> Result<String, PhantomError> {
    let curves: Vec<Curve<'_>> = (curves.iter())
        .map(|(label, points)| (label.as_ref(), points.as_ref()))
        .collect();
    let points = curves.iter().flat_map(|(_, points)| *points);
    for &coordinate in points.flatten() {
        check_value("a coordinate of a curve", coordinate, [f64::MIN, f64::MAX])?;
    }
    register();
    let mut svg = String::new();
    draw(&mut svg, [x_label, y_label], &curves).map_err(not_drawn)?;
    // Escaped as the value of an attribute.
    let what = maud::html! { (y_label) " over " (x_label) }.into_string();
    Ok(svg.replacen(
        "<svg ",
        &format!("<svg role=\"img\" aria-label=\"{what}\" "),
        1,
    ))
}

/// Draws axes, curves and legend.
fn draw(svg: &mut String, [x_label, y_label]: [&str; 2], curves: &[Curve<'_>]) -> Drawn {
    let [x0, x1, y0, y1] = bounds(curves.iter().flat_map(|(_, points)| *points));
    let [y0, y1] = roomy([y0, y1]);
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    // A letter of the legend is about 9 pixels wide.
    let longest = curves.iter().map(|(label, _)| label.chars().count()).max();
    let width = match longest.unwrap_or(0) {
        0 => 0,
        letters => (40 + 9 * letters as u32).min(SIZE.0 / 3),
    };
    let (axes, beside) = area.split_horizontally(SIZE.0 - width);
    let mut chart = ChartBuilder::on(&axes)
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(x0..x1.max(x0 + f64::MIN_POSITIVE), y0..y1)?;
    chart
        .configure_mesh()
        .bold_line_style(FAINT)
        .light_line_style(plotters::style::TRANSPARENT)
        .axis_style(GREY)
        .label_style((FONT, 15))
        .axis_desc_style((FONT, 17))
        .x_labels(round_ticks(x0, x1, 8).len().max(2))
        .x_desc(x_label)
        .y_desc(y_label)
        .draw()?;
    for (k, (_, points)) in curves.iter().enumerate() {
        let points = points.iter().map(|&[x, y]| (x, y));
        let line = LineSeries::new(points, colour(k, curves.len()).stroke_width(2));
        chart.draw_series(line)?;
    }
    legend(&beside, curves)?;
    area.present()
}

/// The legend beside the axes; with many curves only some of them, the first included.
fn legend(area: &DrawingArea<SVGBackend<'_>, Shift>, curves: &[Curve<'_>]) -> Drawn {
    let named = || (curves.iter().enumerate()).filter(|(_, (label, _))| !label.is_empty());
    let each = named().count().div_ceil(MOST_NAMES).max(1);
    for (row, (k, (label, _))) in named().step_by(each).enumerate() {
        let y = 24 + 20 * row as i32;
        let line = vec![(4, y), (26, y)];
        area.draw(&PathElement::new(
            line,
            colour(k, curves.len()).stroke_width(2),
        ))?;
        let style = (FONT, 15).into_text_style(area);
        area.draw(&Text::new(*label, (32, y - 8), style))?;
    }
    Ok(())
}

fn colour(k: usize, curves: usize) -> RGBColor {
    match curves {
        0..=6 => SERIES[k],
        n => ramp(k as f64 / (n - 1) as f64),
    }
}

/// Margin above and below.
fn roomy([low, high]: [f64; 2]) -> [f64; 2] {
    let room = 0.06 * (high - low).max(1e-9 * high.abs().max(1e-9));
    [low - room, high + room]
}
