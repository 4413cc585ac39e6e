//! The canvas: plotters at three times the size, averaged down, with uniform axes.

use heart_phantom::PhantomError;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::prelude::{BitMapBackend, Cartesian2d, Color, IntoTextStyle, RGBColor};
use plotters::style::TextStyle;
pub(super) use plotters::style::text_anchor::HPos;
use plotters::style::text_anchor::{Pos, VPos};

use super::style::{BLACK, FAINT, FONT, GREY, SMALL, TEXT, TITLE};
use super::{Picture, style};

/// Canvas pixels per pixel of the image. Plotters rounds lines, dots and glyphs to canvas pixels.
pub(super) const FINE: i32 = 3;

pub(super) type Area<'b> = DrawingArea<BitMapBackend<'b>, Shift>;
pub(super) type Drawn<T = ()> = Result<
    T,
    DrawingAreaErrorKind<<BitMapBackend<'static> as plotters::prelude::DrawingBackend>::ErrorType>,
>;
pub(super) type Chart<'a, 'b> = ChartContext<'a, BitMapBackend<'b>, Cartesian2d<Axis, Axis>>;

/// Runs `draw` on a white canvas and averages it down to `width` by `height` pixels.
pub(super) fn paint(
    width: u32,
    height: u32,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<Picture, PhantomError> {
    let fine = FINE as usize;
    let canvas = vec![255; 3 * width as usize * fine * height as usize * fine];
    paint_on(canvas, [width, height], draw)
}

/// Draws over a finished image; other pixels do not change.
pub(super) fn paint_over(
    picture: Picture,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<Picture, PhantomError> {
    let Picture { width, height, rgb } = picture;
    let fine = FINE as usize;
    let mut canvas = Vec::with_capacity(rgb.len() * fine * fine);
    for row in rgb.chunks_exact(3 * width as usize) {
        let first = canvas.len();
        for pixel in row.as_chunks::<3>().0 {
            (0..fine).for_each(|_| canvas.extend_from_slice(pixel));
        }
        let end = canvas.len();
        (1..fine).for_each(|_| canvas.extend_from_within(first..end));
    }
    paint_on(canvas, [width, height], draw)
}

fn paint_on(
    mut canvas: Vec<u8>,
    [width, height]: [u32; 2],
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<Picture, PhantomError> {
    style::register();
    {
        let size = (width * FINE as u32, height * FINE as u32);
        let area = BitMapBackend::with_buffer(&mut canvas, size).into_drawing_area();
        draw(&area)
            .and_then(|()| area.present())
            .map_err(not_drawn)?;
    }
    let rgb = average(&canvas, width as usize, height as usize);
    Ok(Picture { width, height, rgb })
}

/// The error of the plotting library, which draws in memory.
pub(super) fn not_drawn(error: impl std::error::Error + Send + Sync + 'static) -> PhantomError {
    PhantomError::File {
        path: "a figure".into(),
        source: std::io::Error::other(error),
    }
}

/// Averages blocks of FINE by FINE pixels, rounded to nearest.
fn average(canvas: &[u8], width: usize, height: usize) -> Vec<u8> {
    let fine = FINE as usize;
    let stride = 3 * width * fine;
    let count = (fine * fine) as u32;
    let mut rgb = Vec::with_capacity(3 * width * height);
    let mut sums = vec![0u32; 3 * width];
    for rows in canvas.chunks_exact(stride * fine) {
        // White rows are common and stay white.
        if rows.iter().all(|&v| v == 255) {
            rgb.resize(rgb.len() + 3 * width, 255);
            continue;
        }
        sums.fill(0);
        for row in rows.chunks_exact(stride) {
            let pixels = sums.as_chunks_mut::<3>().0.iter_mut();
            for (sum, block) in pixels.zip(row.chunks_exact(3 * fine)) {
                for pixel in block.as_chunks::<3>().0 {
                    for k in 0..3 {
                        sum[k] += u32::from(pixel[k]);
                    }
                }
            }
        }
        rgb.extend(sums.iter().map(|&s| ((s + count / 2) / count) as u8));
    }
    rgb
}

/// A rectangle in pixels of the finished image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub(super) left: i32,
    pub(super) top: i32,
    pub(super) width: i32,
    pub(super) height: i32,
}

/// An axis: its range and ticks in the units drawn (decades if `decades`), and its label with units.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) ticks: Vec<f64>,
    pub(super) label: String,
    pub(super) decades: bool,
}

impl Axis {
    /// A linear axis over exactly `[low, high]`, with at most about `count` round ticks.
    pub(super) fn linear(low: f64, high: f64, count: usize, label: &str) -> Self {
        Self {
            low,
            high,
            ticks: round_ticks(low, high, count),
            label: label.into(),
            decades: false,
        }
    }

    /// As [`Self::linear`], with the low end on top.
    pub(super) fn downwards(mut self) -> Self {
        (self.low, self.high) = (self.high, self.low);
        self
    }

    /// A logarithmic axis over whole decades that contain all positive `values`; the chart uses log10 of values.
    pub(super) fn decades(values: impl Iterator<Item = f64>, label: &str) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(|&v| v > 0.0) {
            low = low.min(v.log10());
            high = high.max(v.log10());
        }
        if low > high {
            (low, high) = (-1.0, 0.0);
        }
        let low = low.floor();
        let high = high.ceil().max(low + 1.0);
        let step = ((high - low) / 9.0).ceil().max(1.0) as i64;
        let ticks = (low as i64..=high as i64)
            .filter(|t| t.rem_euclid(step) == 0)
            .map(|t| t as f64)
            .collect();
        Self {
            low,
            high,
            ticks,
            label: label.into(),
            decades: true,
        }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let along = (value - self.low) / (self.high - self.low);
        limit.0 + (along * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.ticks.clone()
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format(value: &f64) -> String {
        number(*value, 1.0)
    }

    fn format_ext(&self, value: &f64) -> String {
        if self.decades {
            return power_of_ten(value.round() as i64);
        }
        let step = if self.ticks.len() > 1 {
            self.ticks[1] - self.ticks[0]
        } else {
            1.0
        };
        number(*value, step)
    }
}

/// Multiples of 1, 2 or 5 times a power of ten within `[low, high]`, at most about `count`.
pub(super) fn round_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let rough = (high - low) / count.max(1) as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|m| m * power)
        .find(|&s| s >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0 * power);
    // Rounding may lose a tick at the end of the range.
    let slack = 1e-9 * (high - low) / step;
    let first = (low / step - slack).ceil();
    let last = (high / step + slack).floor();
    let n = (last - first).clamp(0.0, 50.0) as usize;
    (0..=n).map(|i| (first + i as f64) * step).collect()
}

/// Formats a number with the decimals of a scale of step `step` and a true minus sign.
pub(super) fn number(value: f64, step: f64) -> String {
    let decimals = (-step.abs().log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
    let magnitude = value.abs();
    let text = if magnitude >= 1e6 {
        format!("{magnitude:.1e}")
    } else {
        format!("{magnitude:.decimals$}")
    };
    let zero = text.chars().all(|c| c == '0' || c == '.');
    if value < 0.0 && !zero {
        format!("−{text}")
    } else {
        text
    }
}

/// `10ⁿ`, set in superscripts.
pub(super) fn power_of_ten(exponent: i64) -> String {
    let raised = |c| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        c => char::from_u32('⁴' as u32 + (c as u32 - '4' as u32)).unwrap_or(c),
    };
    format!(
        "10{}",
        exponent.to_string().chars().map(raised).collect::<String>()
    )
}

/// Bounds of points as `[x low, x high, y low, y high]`.
pub(super) fn bounds<'p>(points: impl Iterator<Item = &'p [f64; 2]>) -> [f64; 4] {
    points.fold(
        [
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ],
        |b, p| {
            [
                b[0].min(p[0]),
                b[1].max(p[0]),
                b[2].min(p[1]),
                b[3].max(p[1]),
            ]
        },
    )
}

/// Widens `bounds` by `margin` of the longer side, then until its shape is that of the plot: the same cm per pixel both ways.
pub(super) fn equal_scale(bounds: [f64; 4], margin: f64, plot: (i32, i32)) -> [f64; 4] {
    let [x0, x1, y0, y1] = bounds;
    let pad = margin * (x1 - x0).max(y1 - y0).max(f64::MIN_POSITIVE.sqrt());
    let (w, h) = (x1 - x0 + 2.0 * pad, y1 - y0 + 2.0 * pad);
    let per_pixel = (w / f64::from(plot.0)).max(h / f64::from(plot.1));
    let (w, h) = (per_pixel * f64::from(plot.0), per_pixel * f64::from(plot.1));
    let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    [cx - 0.5 * w, cx + 0.5 * w, cy - 0.5 * h, cy + 0.5 * h]
}

pub(super) fn font(size: i32, colour: &RGBColor) -> TextStyle<'_> {
    (FONT, size * FINE).into_text_style(&(1, 1)).color(colour)
}

/// Vertical offset of a line from its nominal middle, in hundredths of its size: plotters centres a box that is higher than digits.
const DROP: i32 = 14;

/// A line of text with its middle at height `y`, in pixels of the image.
pub(super) fn text(
    area: &Area<'_>,
    words: &str,
    size: i32,
    colour: RGBColor,
    (x, y): (i32, i32),
    pin: HPos,
) -> Drawn {
    area.draw_text(
        words,
        &font(size, &colour).pos(Pos::new(pin, VPos::Center)),
        (x * FINE, y * FINE + DROP * size * FINE / 100),
    )
}

/// A line of small black text.
pub(super) fn label(area: &Area<'_>, words: &str, at: (i32, i32), pin: HPos) -> Drawn {
    text(area, words, SMALL, BLACK, at, pin)
}

/// A title about a place.
pub(super) fn title(area: &Area<'_>, words: &str, at: (i32, i32)) -> Drawn {
    text(area, words, TITLE, BLACK, at, HPos::Center)
}

/// The width of a line of text, pixels of the image.
pub(super) fn text_width(area: &Area<'_>, words: &str, size: i32) -> i32 {
    area.estimate_text_size(words, &font(size, &BLACK))
        .map_or(0, |(w, _)| (w as i32 + FINE - 1) / FINE)
}

/// Space of labels around a plot: left and below.
pub(super) const LABELS_LEFT: i32 = 96;
pub(super) const LABELS_BELOW: i32 = 78;

/// Axes of x and y in cm at one scale (see [`equal_scale`]) with a number of ticks.
pub(super) fn plane_axes(
    around: [f64; 4],
    margin: f64,
    plot: (i32, i32),
    ticks: usize,
) -> (Axis, Axis) {
    let [x0, x1, y0, y1] = equal_scale(around, margin, plot);
    (
        Axis::linear(x0, x1, ticks, "x (cm)"),
        Axis::linear(y0, y1, ticks, "y (cm)"),
    )
}

/// Axes with the plotting area `plot`; labels are to its left and below, the title above.
pub(super) fn axes<'a, 'b>(
    area: &'a Area<'b>,
    plot: Rect,
    heading: &str,
    x: &Axis,
    y: &Axis,
) -> Drawn<Chart<'a, 'b>> {
    let left = plot.left - LABELS_LEFT;
    let panel = area.clone().shrink(
        (left * FINE, plot.top * FINE),
        (
            (LABELS_LEFT + plot.width) * FINE,
            (plot.height + LABELS_BELOW) * FINE,
        ),
    );
    let mut chart = ChartBuilder::on(&panel)
        .x_label_area_size(LABELS_BELOW * FINE)
        .y_label_area_size(LABELS_LEFT * FINE)
        .build_cartesian_2d(x.clone(), y.clone())?;
    chart
        .configure_mesh()
        .bold_line_style(FAINT.stroke_width(FINE as u32))
        .axis_style(GREY.stroke_width(FINE as u32))
        .label_style(font(SMALL, &BLACK))
        .axis_desc_style(font(TEXT, &BLACK))
        .set_all_tick_mark_size(5 * FINE)
        .y_label_offset(DROP * SMALL * FINE / 100)
        .x_desc(x.label.clone())
        .y_desc(y.label.clone())
        .draw()?;
    if !heading.is_empty() {
        title(area, heading, (plot.left + plot.width / 2, plot.top - 28))?;
    }
    Ok(chart)
}

/// Position of a point of the chart on its plotting area, canvas pixels.
pub(super) fn on_plot(chart: &Chart<'_, '_>, p: [f64; 2]) -> (i32, i32) {
    let base = chart.plotting_area().strip_coord_spec().get_base_pixel();
    let (x, y) = chart.plotting_area().map_coordinate(&(p[0], p[1]));
    (x - base.0, y - base.1)
}
