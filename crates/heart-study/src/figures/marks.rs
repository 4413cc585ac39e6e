//! Marks on a plot: strokes, dashes, markers, arrows and the swatches of legends.

use plotters::element::{Circle, PathElement, Polygon};
use plotters::prelude::{Color, RGBColor};

use super::canvas::{Area, Chart, Drawn, FINE, HPos, label, on_plot, text_width};
use super::style::SMALL;

/// A line through `points` in the chart's units. Points closer than an image pixel are omitted: plotters joins
/// corners at whole canvas pixels, and near ones make it ragged.
pub(super) fn stroke(
    chart: &Chart<'_, '_>,
    points: &[[f64; 2]],
    colour: RGBColor,
    width: i32,
) -> Drawn {
    let area = chart.plotting_area().strip_coord_spec();
    let mut kept: Vec<(i32, i32)> = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        let at = on_plot(chart, *p);
        let far = kept
            .last()
            .is_none_or(|&(a, b)| (a - at.0).abs().max((b - at.1).abs()) > 2 * FINE);
        if far {
            kept.push(at);
        } else if i + 1 == points.len() && kept.len() > 1 {
            kept.pop();
            kept.push(at);
        }
    }
    path(&area, kept, colour, width)
}

/// A dashed line between two points in the chart's units; dash and gap are 10 pixels of the image.
pub(super) fn dashed(
    chart: &Chart<'_, '_>,
    ends: [[f64; 2]; 2],
    colour: RGBColor,
    width: i32,
) -> Drawn {
    let area = chart.plotting_area().strip_coord_spec();
    let [a, b] = ends
        .map(|p| on_plot(chart, p))
        .map(|(x, y)| [f64::from(x), f64::from(y)]);
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    let point = |along: f64| [0, 1].map(|k| a[k] + (b[k] - a[k]) * along / length);
    let dash = 10.0 * f64::from(FINE);
    let mut from = 0.0;
    while from < length {
        let to = (from + dash).min(length);
        segment(&area, point(from), point(to), colour, width)?;
        from += 2.0 * dash;
    }
    Ok(())
}

/// Markers that distinguish series without colour.
pub(super) fn marker(
    area: &Area<'_>,
    kind: usize,
    (x, y): (i32, i32),
    radius: i32,
    colour: RGBColor,
) -> Drawn {
    let r = radius * FINE;
    let shape = |corners: &[(i32, i32)]| {
        Polygon::new(
            corners
                .iter()
                .map(|&(a, b)| (x + a, y + b))
                .collect::<Vec<_>>(),
            colour.filled(),
        )
    };
    match kind % 4 {
        0 => area.draw(&Circle::new((x, y), r, colour.filled())),
        1 => area.draw(&shape(&[(-r, -r), (r, -r), (r, r), (-r, r)])),
        2 => area.draw(&shape(&[(0, -r - r / 3), (r + r / 4, r), (-r - r / 4, r)])),
        _ => area.draw(&shape(&[
            (0, -r - r / 3),
            (r + r / 3, 0),
            (0, r + r / 3),
            (-r - r / 3, 0),
        ])),
    }
}

/// An arrow with a filled head, canvas pixels of `area`.
pub(super) fn arrow(
    area: &Area<'_>,
    from: [f64; 2],
    to: [f64; 2],
    colour: RGBColor,
    width: i32,
) -> Drawn {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length < 1.0 {
        return Ok(());
    }
    let (ux, uy) = (dx / length, dy / length);
    let head = (f64::from(4 * width * FINE) + 2.0).min(0.6 * length);
    let half = 0.42 * head;
    let pixel = |along: f64, across: f64| {
        let x = from[0] + along * ux - across * uy;
        let y = from[1] + along * uy + across * ux;
        (x.round() as i32, y.round() as i32)
    };
    let stem = vec![pixel(0.0, 0.0), pixel(length - 0.8 * head, 0.0)];
    path(area, stem, colour, width)?;
    let corners = vec![
        pixel(length, 0.0),
        pixel(length - head, half),
        pixel(length - head, -half),
    ];
    area.draw(&Polygon::new(corners, colour.filled()))
}

/// The sign of an entry of a legend.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sign {
    /// A line of this width.
    Line(i32),
    /// A dashed line.
    Dashes,
    /// A [`marker`] of a kind.
    Marker { kind: usize, radius: i32 },
    /// A line with a marker.
    Marked { kind: usize },
    /// An arrow.
    Arrow,
}

/// An entry of a legend: its sign, colour and words.
pub(super) type Entry<'a> = (Sign, RGBColor, &'a str);

/// Width of a sign with its distance from the words, and distance of entries, pixels of the image.
pub(super) const SIGN: i32 = 58;
const BETWEEN: i32 = 40;

/// Draws entries of a legend side by side from a place to the right, pixels of the image; returns the end of the last one.
pub(super) fn legend(area: &Area<'_>, entries: &[Entry<'_>], (x, y): (i32, i32)) -> Drawn<i32> {
    let mut x = x;
    for &(sign, colour, words) in entries {
        let middle = ((x + 22) * FINE, y * FINE);
        match sign {
            Sign::Line(width) => swatch(area, (x, y), colour, width)?,
            Sign::Dashes => dashes(area, (x, y), colour)?,
            Sign::Marker { kind, radius } => marker(area, kind, middle, radius, colour)?,
            Sign::Marked { kind } => {
                swatch(area, (x, y), colour, 3)?;
                marker(area, kind, middle, 7, colour)?;
            }
            Sign::Arrow => {
                let ends = [x, x + 46].map(|x| [x, y].map(|v| f64::from(v * FINE)));
                arrow(area, ends[0], ends[1], colour, 3)?;
            }
        }
        label(area, words, (x + SIGN, y), HPos::Left)?;
        x += SIGN + text_width(area, words, SMALL) + BETWEEN;
    }
    Ok(x)
}

/// A short line in a legend from `(x, y)` to the right, pixels of the image.
pub(super) fn swatch(area: &Area<'_>, (x, y): (i32, i32), colour: RGBColor, width: i32) -> Drawn {
    let ends = vec![(x * FINE, y * FINE), ((x + 44) * FINE, y * FINE)];
    path(area, ends, colour, width)
}

/// A swatch of a dashed line.
fn dashes(area: &Area<'_>, (x, y): (i32, i32), colour: RGBColor) -> Drawn {
    for k in 0..3 {
        let ends = vec![
            ((x + 16 * k) * FINE, y * FINE),
            ((x + 16 * k + 10) * FINE, y * FINE),
        ];
        path(area, ends, colour, 2)?;
    }
    Ok(())
}

/// A line through canvas pixels of `area`; its width in pixels of the image.
fn path(area: &Area<'_>, through: Vec<(i32, i32)>, colour: RGBColor, width: i32) -> Drawn {
    let style = colour.stroke_width((width * FINE) as u32);
    area.draw(&PathElement::new(through, style))
}

/// A straight line, canvas pixels of `area`.
pub(super) fn segment(
    area: &Area<'_>,
    from: [f64; 2],
    to: [f64; 2],
    colour: RGBColor,
    width: i32,
) -> Drawn {
    let ends = [from, to]
        .map(|p| (p[0].round() as i32, p[1].round() as i32))
        .to_vec();
    path(area, ends, colour, width)
}
