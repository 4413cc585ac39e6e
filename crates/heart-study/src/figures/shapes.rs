//! Equilibrium shapes at several pressures (Fig. 8 of the paper).

use super::Picture;
use super::canvas::{
    HPos, LABELS_BELOW, LABELS_LEFT, Rect, axes, bounds, label, number, paint, plane_axes, text,
};
use super::marks::{stroke, swatch};
use super::style::{GREY, SMALL, ramp};
use heart_phantom::PhantomError;

/// One equilibrium shape of a membrane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape<'a> {
    /// The whole meridian `[x, y]`, cm, from one end on the base over the apex to the other.
    pub(crate) nodes: &'a [[f64; 2]],
    /// Pressure over stiffness, f/λ, cm.
    pub(crate) load: f64,
    /// Area that the closed meridian encloses, cm².
    pub(crate) area: f64,
    /// Volume of revolution, cm³.
    pub(crate) volume: f64,
}

/// Draws shapes over one another at one scale, closed along the base, with a table of load, area and volume.
pub(crate) fn shapes(shapes: &[Shape<'_>]) -> Result<Picture, PhantomError> {
    let around = bounds(shapes.iter().flat_map(|s| s.nodes));
    let row = 40;
    let width = 820;
    let aspect = (around[3] - around[2]) / (around[1] - around[0]);
    let height =
        ((f64::from(width) * aspect.clamp(0.3, 1.2)) as i32).max(row * (shapes.len() as i32 + 2));
    let plot = Rect {
        left: LABELS_LEFT + 10,
        top: 24,
        width,
        height,
    };
    let (x, y) = plane_axes(around, 0.04, (width, height), 8);

    paint(
        (plot.left + width + 440) as u32,
        (height + 24 + LABELS_BELOW + 10) as u32,
        |area| {
            let chart = axes(area, plot, "", &x, &y)?;
            let colour = |i: usize| ramp(i as f64 / (shapes.len().max(2) - 1) as f64);
            for (i, shape) in shapes.iter().enumerate() {
                let mut closed = shape.nodes.to_vec();
                closed.push(shape.nodes[0]);
                stroke(&chart, &closed, colour(i), 4)?;
            }
            let left = plot.left + width + 30;
            let columns = [left + 150, left + 265, left + 385];
            for (head, at) in ["f/λ (cm)", "A (cm²)", "V (cm³)"].iter().zip(columns) {
                text(
                    area,
                    head,
                    SMALL,
                    GREY,
                    (at, plot.top + row / 2),
                    HPos::Right,
                )?;
            }
            for (i, shape) in shapes.iter().enumerate() {
                let y = plot.top + row / 2 + row * (i as i32 + 1);
                swatch(area, (left, y), colour(i), 4)?;
                let cells = [
                    number(shape.load, 0.01),
                    number(shape.area, 0.1),
                    number(shape.volume, 0.1),
                ];
                for (cell, at) in cells.iter().zip(columns) {
                    label(area, cell, (at, y), HPos::Right)?;
                }
            }
            Ok(())
        },
    )
}
