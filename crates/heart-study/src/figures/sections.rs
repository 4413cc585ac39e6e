//! Sections through a volume with axes in cm, orientation marks and one grey window; maps of other samples.

use super::canvas::{
    Area, Axis, Drawn, HPos, LABELS_BELOW, LABELS_LEFT, Rect, axes, label, paint, title,
};
use super::raster::{BAR_ROOM, bar_labels, fill, fill_bar};
use super::{Picture, check};
use crate::StudyError;
use heart_phantom::check_length;

/// Pixels of the longest side of a section.
const LONGEST: f64 = 360.0;
/// Sections per row.
const PER_ROW: usize = 3;
/// Space of the heading.
const HEADING: i32 = 56;
/// Margins beside and above an image in its frame, for up to three orientation letters.
const MARGINS: [i32; 2] = [54, 30];

/// Positions and ticks of the panels of a figure.
pub(super) struct Layout {
    /// Pixels above the first row, and of titles and labels between rows.
    pub(super) gaps: [i32; 2],
    /// Numbers of ticks along the sides of a panel of some pixels.
    pub(super) ticks: fn([i32; 2]) -> [usize; 2],
}

const LAYOUT: Layout = Layout {
    gaps: [56, 60],
    // Five are at least three about a centre.
    ticks: |sides| sides.map(|pixels| (pixels / 55).clamp(5, 9) as usize),
};

/// Samples of a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Title.
    pub title: String,
    /// Axis labels with units.
    pub labels: [String; 2],
    /// Orientation letters at the left, right, lower and upper edge, such as `R`, `L`, `P`, `A`; empty for none.
    pub marks: [String; 4],
    /// Columns and rows.
    pub size: [usize; 2],
    /// Samples `[row][column]`, the lowest row first.
    pub values: Vec<f32>,
    /// Left, right, lower and upper edge in the units of the labels; an axis may be reversed.
    pub extent: [[f64; 2]; 2],
}

impl Cut {
    fn check(&self) -> Result<(), StudyError> {
        for n in self.size {
            check::at_least("samples along a side", n, 1)?;
        }
        let expected = self.size[0].saturating_mul(self.size[1]);
        check_length("samples of a section", self.values.len(), expected)?;
        check::finite_samples("samples of a section", &self.values)?;
        for [low, high] in self.extent {
            check::interval("extent of a section", low.min(high), low.max(high))?;
        }
        Ok(())
    }

    fn lengths(&self) -> [f64; 2] {
        self.extent.map(|[from, to]| (to - from).abs())
    }
}

/// Draws sections side by side, three per row, with one scale per row, one grey window, a colour bar and a heading. Orientation letters are
/// outside the image, in the margin of its frame.
///
/// # Errors
/// [`StudyError`] if there is no section, samples and size disagree, a number is not finite, or the window or an extent is not an
/// interval.
pub fn sections(
    cuts: &[Cut],
    window: [f64; 2],
    bar_label: &str,
    heading: &str,
) -> Result<Picture, StudyError> {
    check::at_least("sections", cuts.len(), 1)?;
    cuts.iter().try_for_each(Cut::check)?;
    let mut sides = Vec::with_capacity(cuts.len());
    for row in cuts.chunks(PER_ROW) {
        let longest = row.iter().flat_map(Cut::lengths).fold(0.0, f64::max);
        let pixels = |cm: f64| (LONGEST * cm / longest).round().max(8.0) as i32;
        sides.extend(row.iter().map(|cut| cut.lengths().map(pixels)));
    }
    draw(cuts, &sides, window, (bar_label, heading), &LAYOUT)
}

/// Draws samples over any two variables, such as a sinogram, `width` by `height` pixels.
///
/// # Errors
/// As [`sections()`].
pub fn map(
    cut: &Cut,
    [width, height]: [u32; 2],
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, StudyError> {
    cut.check()?;
    let side = |pixels: u32| pixels.clamp(8, 4096) as i32;
    let cuts = std::slice::from_ref(cut);
    let sides = [[side(width), side(height)]];
    draw(cuts, &sides, window, (bar_label, ""), &LAYOUT)
}

/// Draws sections of some pixels with the label of the colour bar and a heading.
pub(super) fn draw(
    cuts: &[Cut],
    sides: &[[i32; 2]],
    window: [f64; 2],
    (bar_label, heading): (&str, &str),
    layout: &Layout,
) -> Result<Picture, StudyError> {
    check::interval("window", window[0], window[1])?;
    let [above, between] = layout.gaps;
    let is_marked = cuts
        .iter()
        .flat_map(|cut| &cut.marks)
        .any(|m| !m.is_empty());
    let margins = if is_marked { MARGINS } else { [0; 2] };
    let most = |a: usize| sides.iter().map(|side| side[a]).max().unwrap_or(0) + 2 * margins[a];
    let step = (most(0) + LABELS_LEFT + 24, most(1) + LABELS_BELOW + between);
    let columns = cuts.len().min(PER_ROW);
    let headed = if heading.is_empty() { 0 } else { HEADING };
    let top = above + headed;
    let place = |k: usize| {
        let (column, row) = ((k % columns) as i32, (k / columns) as i32);
        let [width, height] = [0, 1].map(|a| sides[k][a] + 2 * margins[a]);
        Rect {
            left: LABELS_LEFT + 8 + step.0 * column + (most(0) - width) / 2,
            top: top + step.1 * row + (most(1) - height) / 2,
            width,
            height,
        }
    };
    let bar = Rect {
        left: LABELS_LEFT + 8 + step.0 * (columns as i32 - 1),
        top,
        width: most(0),
        height: most(1),
    };
    let rows = cuts.len().div_ceil(columns) as i32;
    let size = (step.0 * columns as i32 + BAR_ROOM, headed + step.1 * rows);
    let mut picture = paint(size.0 as u32, size.1 as u32, |area| {
        if !heading.is_empty() {
            title(area, heading, (size.0 / 2, HEADING / 2))?;
        }
        for (k, cut) in cuts.iter().enumerate() {
            let rect = place(k);
            let ticks = (layout.ticks)(sides[k]);
            let axis = |a: usize| {
                let [from, to] = cut.extent[a];
                let mut axis = Axis::linear(from.min(to), from.max(to), ticks[a], &cut.labels[a]);
                let margin = (to - from).abs() * f64::from(margins[a]) / f64::from(sides[k][a]);
                (axis.low, axis.high) = (axis.low - margin, axis.high + margin);
                if to < from { axis.downwards() } else { axis }
            };
            let (x, y) = (axis(0), axis(1));
            axes(area, rect, &cut.title, &x, &y)?;
            orientation(area, cut, rect)?;
        }
        bar_labels(area, bar, window, bar_label)
    })?;
    for (k, cut) in cuts.iter().enumerate() {
        let [n_columns, n_rows] = cut.size;
        let sample = |column: usize, row: usize| cut.values[row * n_columns + column];
        let rect = place(k);
        let image = Rect {
            left: rect.left + margins[0],
            top: rect.top + margins[1],
            width: sides[k][0],
            height: sides[k][1],
        };
        fill(&mut picture, image, (n_columns, n_rows), window, sample);
    }
    fill_bar(&mut picture, bar, window);
    Ok(picture)
}

/// Draws the orientation letters of a section.
fn orientation(area: &Area<'_>, cut: &Cut, rect: Rect) -> Drawn {
    let Rect {
        left,
        top,
        width,
        height,
    } = rect;
    let (x, y) = (left + width / 2, top + height / 2);
    let [beside, above] = MARGINS.map(|margin| margin / 2);
    let places = [
        (left + beside, y),
        (left + width - beside, y),
        (x, top + height - above),
        (x, top + above),
    ];
    for (mark, at) in cut.marks.iter().zip(places) {
        label(area, mark, at, HPos::Center)?;
    }
    Ok(())
}
