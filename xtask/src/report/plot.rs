//! The plot of a case: error to the right, time upwards, both logarithmic.

use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use super::page::Group;

const SIZE: (u32, u32) = (760, 460);
/// Colours for colour-blind readers (Okabe and Ito 2008), then again with rings.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 60),
];

/// Font for the measurement of text; readers of the page use their own font.
const FONT: &[u8] = include_bytes!("../../../crates/heart-study/assets/DejaVuSans-subset.ttf");

/// The plot of `group`.
pub(super) fn svg(group: &Group<'_>) -> Result<String, String> {
    register_font("sans-serif", FontStyle::Normal, FONT).map_err(|_| "the font is damaged")?;
    let mut text = String::new();
    draw(group, &mut text).map_err(|error| format!("{}: {error}", group.file()))?;
    Ok(text)
}

fn draw(group: &Group<'_>, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let shown = || group.rows.iter().filter(|row| row.error > 0.0);
    let (from, to) = range(shown().map(|row| row.error));
    let (fast, slow) = range(shown().map(|row| row.seconds));
    let area = SVGBackend::with_string(text, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let (left, right) = area.split_horizontally(520);
    let mut chart = ChartBuilder::on(&left)
        .caption(
            format!("{}: {}", group.study, group.case),
            ("sans-serif", 15),
        )
        .margin(10)
        .x_label_area_size(40)
        .y_label_area_size(62)
        .build_cartesian_2d((from..to).log_scale(), (fast..slow).log_scale())?;
    chart
        .configure_mesh()
        .x_desc(group.rows[0].error_kind.as_str())
        .y_desc("seconds")
        .x_label_formatter(&|v| format!("{v:.0e}"))
        .y_label_formatter(&|v| format!("{v:.0e}"))
        .light_line_style(WHITE)
        .draw()?;
    for (k, (name, rows)) in group.curves().into_iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let style = if k < COLOURS.len() {
            colour.filled()
        } else {
            colour.stroke_width(2)
        };
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter(|row| row.error > 0.0)
            .map(|row| (row.error, row.seconds))
            .collect();
        chart.draw_series(LineSeries::new(points.iter().copied(), colour))?;
        chart.draw_series(points.iter().map(|&at| Circle::new(at, 3, style)))?;
        let y = 42 + 17 * k as i32;
        right.draw(&Circle::new((8, y), 3, style))?;
        right.draw(&Text::new(name, (18, y - 6), ("sans-serif", 11)))?;
    }
    area.present()?;
    Ok(())
}

/// Powers of ten around the values.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if high == 0.0 {
        return (0.1, 1.0);
    }
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    (10f64.powf(low), 10f64.powf(high.max(low + 1.0)))
}
