//! Frames of the moving membrane with its forces (Fig. 9 of the paper).

use super::Picture;
use super::canvas::{
    Area, Drawn, FINE, HPos, LABELS_BELOW, LABELS_LEFT, Rect, axes, bounds, label, number, on_plot,
    paint, plane_axes,
};
use super::marks::{Sign, arrow, legend, marker, stroke};
use super::style::{BLACK, FAINT, GREY, MAGENTA, RED};
use heart_phantom::PhantomError;

/// Width of the legend in pixels.
const LEGEND: i32 = 1060;

/// One frame: nodes and their forces, divided by the stiffness, per unit of the material coordinate: cm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceFrame<'a> {
    /// Iteration (time step).
    pub(crate) iteration: usize,
    /// Nodes `[x, y]` along the whole meridian, cm.
    pub(crate) nodes: &'a [[f64; 2]],
    /// Elastic force on each node.
    pub(crate) elastic: &'a [[f64; 2]],
    /// Pressure force on each node.
    pub(crate) pressure: &'a [[f64; 2]],
}

/// Draws the frames side by side, two in a row: nodes red, elastic forces magenta, pressure forces black.
///
/// About 45 nodes per frame have arrows. All arrows have one scale, the longest is an eighth of the figure's
/// longer side; a grey one on top has the length of a round force.
pub(crate) fn force_frames(frames: &[ForceFrame<'_>]) -> Result<Picture, PhantomError> {
    let around = bounds(frames.iter().flat_map(|f| f.nodes));
    let side = (around[1] - around[0]).max(around[3] - around[2]);
    let longest = frames
        .iter()
        .flat_map(|f| f.elastic.iter().chain(f.pressure))
        .fold(0.0f64, |m, v| m.max(v[0].hypot(v[1])));
    let reach = 0.125 * side;
    let scale = if longest > 0.0 { reach / longest } else { 0.0 };
    let tips = |f: &ForceFrame<'_>| -> Vec<[f64; 2]> {
        let forces = f.nodes.iter().zip(f.elastic.iter().zip(f.pressure));
        forces
            .flat_map(|(p, (e, q))| [e, q].map(|v| [p[0] + scale * v[0], p[1] + scale * v[1]]))
            .collect()
    };
    let tips: Vec<[f64; 2]> = frames.iter().flat_map(tips).collect();
    let around = bounds(frames.iter().flat_map(|f| f.nodes).chain(&tips));

    let n_columns = frames.len().min(2);
    let n_rows = frames.len().div_ceil(n_columns);
    let width = 640;
    let aspect = (around[3] - around[2]) / (around[1] - around[0]).max(1e-9 * side);
    let height = (f64::from(width) * aspect.clamp(0.4, 1.2)) as i32;
    let (x, y) = plane_axes(around, 0.03, (width, height), 7);
    let (step_x, step_y) = (width + LABELS_LEFT + 30, height + LABELS_BELOW + 70);
    let top = 64;

    let size = (
        (step_x * n_columns as i32 + 20).max(LEGEND),
        top + step_y * n_rows as i32 + 10,
    );
    paint(size.0 as u32, size.1 as u32, |area| {
        draw_legend(area, longest, scale / (x.high - x.low) * f64::from(width))?;
        for (i, frame) in frames.iter().enumerate() {
            let (column, row) = ((i % n_columns) as i32, (i / n_columns) as i32);
            let plot = Rect {
                left: LABELS_LEFT + 10 + column * step_x,
                top: top + 50 + row * step_y,
                width,
                height,
            };
            let chart = axes(
                area,
                plot,
                &format!("iteration {}", frame.iteration),
                &x,
                &y,
            )?;
            stroke(&chart, frame.nodes, FAINT, 3)?;
            let inside = chart.plotting_area().strip_coord_spec();
            let pixel = |p: [f64; 2]| {
                let (x, y) = on_plot(&chart, p);
                [f64::from(x), f64::from(y)]
            };
            let every = frame.nodes.len().div_ceil(45);
            for (forces, colour) in [(frame.pressure, BLACK), (frame.elastic, MAGENTA)] {
                for (p, v) in frame.nodes.iter().zip(forces).step_by(every) {
                    let tip = [p[0] + scale * v[0], p[1] + scale * v[1]];
                    arrow(&inside, pixel(*p), pixel(tip), colour, 2)?;
                }
            }
            for p in frame.nodes.iter().step_by(every) {
                marker(&inside, 0, on_plot(&chart, *p), 4, RED)?;
            }
        }
        Ok(())
    })
}

/// Draws the legend with an arrow of a round force; arrows have `per_force` pixels per unit of force.
fn draw_legend(area: &Area<'_>, longest: f64, per_force: f64) -> Drawn {
    let entries = [
        (Sign::Marker { kind: 0, radius: 5 }, RED, "node"),
        (Sign::Arrow, MAGENTA, "elastic force"),
        (Sign::Arrow, BLACK, "pressure force"),
    ];
    let from = f64::from(legend(area, &entries, (LABELS_LEFT + 10, 28))?);
    if longest > 0.0 {
        let round = round_below(longest);
        let to = from + round * per_force;
        let ends = [from, to].map(|x| [x, 28.0].map(|v| v * f64::from(FINE)));
        arrow(area, ends[0], ends[1], GREY, 3)?;
        let words = format!("force/λ of {} cm", number(round, round));
        label(area, &words, (to as i32 + 14, 28), HPos::Left)?;
    }
    Ok(())
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a positive number.
fn round_below(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    let fits = |digit: &f64| digit * power <= most;
    power * [5.0, 2.0].into_iter().find(fits).unwrap_or(1.0)
}
