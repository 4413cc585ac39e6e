//! Sections through a volume with axes in cm, orientation marks and one grey window; maps of other samples.

use super::Picture;
use super::canvas::{
    Area, Axis, Drawn, HPos, LABELS_BELOW, LABELS_LEFT, Rect, axes, label, paint, title,
};
use super::raster::{BAR_ROOM, bar_labels, fill, fill_bar};
use heart_phantom::PhantomError;

/// Pixels of the longest side of a section.
const LONGEST: f64 = 360.0;
/// Sections per row.
const PER_ROW: usize = 3;
/// Space of the heading.
const HEADING: i32 = 56;
/// Margins beside and above an image in its frame, for up to three orientation letters.
const MARGINS: [i32; 2] = [54, 30];

/// Pixels above the first row, and of titles and labels between rows.
const GAPS: [i32; 2] = [60, 70];

/// Samples of a plane.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cut {
    /// Title.
    pub(crate) title: String,
    /// Axis labels with units.
    pub(crate) labels: [String; 2],
    /// Orientation letters at the left, right, lower and upper edge, such as `R`, `L`, `P`, `A`; empty for none.
    pub(crate) marks: [String; 4],
    /// Columns and rows.
    pub(crate) size: [usize; 2],
    /// Samples `[row][column]`, the lowest row first.
    pub(crate) values: Vec<f32>,
    /// Left, right, lower and upper edge in the units of the labels; an axis may be reversed.
    pub(crate) extent: [[f64; 2]; 2],
}

impl Cut {
    fn lengths(&self) -> [f64; 2] {
        self.extent.map(|[from, to]| (to - from).abs())
    }
}

/// Returns the grey window from 0 to the largest sample of some planes, or to 1 if none is positive.
pub(crate) fn window(cuts: &[Cut]) -> [f64; 2] {
    let values = cuts.iter().flat_map(|cut| &cut.values);
    let most = values.fold(0.0f32, |most, &value| most.max(value));
    [0.0, if most > 0.0 { f64::from(most) } else { 1.0 }]
}

/// Draws sections side by side, three per row, with one scale per row, one grey window, a colour bar and a heading. Orientation letters are
/// outside the image, in the margin of its frame.
pub(crate) fn sections(
    cuts: &[Cut],
    window: [f64; 2],
    bar_label: &str,
    heading: &str,
) -> Result<Picture, PhantomError> {
    let mut sides = Vec::with_capacity(cuts.len());
    for row in cuts.chunks(PER_ROW) {
        let longest = row.iter().flat_map(Cut::lengths).fold(0.0, f64::max);
        let pixels = |cm: f64| (LONGEST * cm / longest).round().max(8.0) as i32;
        sides.extend(row.iter().map(|cut| cut.lengths().map(pixels)));
    }
    draw(cuts, &sides, window, (bar_label, heading))
}

/// Draws samples over any two variables, such as a sinogram, with `size` pixels along x and y.
pub(crate) fn map(
    cut: &Cut,
    size: [i32; 2],
    window: [f64; 2],
    bar_label: &str,
) -> Result<Picture, PhantomError> {
    draw(std::slice::from_ref(cut), &[size], window, (bar_label, ""))
}

/// Draws sections of some pixels with the label of the colour bar and a heading.
pub(super) fn draw(
    cuts: &[Cut],
    sides: &[[i32; 2]],
    window: [f64; 2],
    (bar_label, heading): (&str, &str),
) -> Result<Picture, PhantomError> {
    let [above, between] = GAPS;
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
            // Five are at least three about a centre.
            let ticks = sides[k].map(|pixels| (pixels / 55).clamp(5, 9) as usize);
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
