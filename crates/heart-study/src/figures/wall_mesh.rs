//! The two membranes and a mesh between them (Fig. 11 of the paper).

use super::Picture;
use super::canvas::{LABELS_BELOW, LABELS_LEFT, Rect, axes, bounds, paint, plane_axes};
use super::marks::{Entry, Sign, legend, stroke};
use super::style::{GREY, INNER, OUTER};
use heart_phantom::PhantomError;

/// The legend.
const ENTRIES: [Entry<'_>; 3] = [
    (Sign::Line(4), INNER, "inner membrane"),
    (Sign::Line(4), OUTER, "outer membrane"),
    (Sign::Line(1), GREY, "mesh of the wall"),
];

/// Both membranes at one pressure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallState<'a> {
    /// Title of the panel.
    pub(crate) title: &'a str,
    /// Nodes of the inner membrane `[x, y]` over the whole meridian, cm.
    pub(crate) inner: &'a [[f64; 2]],
    /// Nodes of the outer membrane at the same material coordinates, cm.
    pub(crate) outer: &'a [[f64; 2]],
}

/// Draws one panel per state, all at one scale. The mesh is linear between nodes of equal material coordinate, with `n_layers`
/// layers through the wall and about `n_cells` cells along it.
pub(crate) fn wall_meshes(
    states: &[WallState<'_>],
    n_layers: usize,
    n_cells: usize,
) -> Result<Picture, PhantomError> {
    let around = bounds(states.iter().flat_map(|s| s.inner.iter().chain(s.outer)));
    let width = 450;
    let aspect = (around[3] - around[2]) / (around[1] - around[0]);
    let height = (f64::from(width) * aspect.clamp(0.4, 1.4)) as i32;
    let (x, y) = plane_axes(around, 0.04, (width, height), 9);
    let step = width + LABELS_LEFT + 20;
    let top = 64;

    let size = (
        step * states.len() as i32 + 30,
        top + height + LABELS_BELOW + 70,
    );
    paint(size.0 as u32, size.1 as u32, |area| {
        for (i, state) in states.iter().enumerate() {
            let plot = Rect {
                left: LABELS_LEFT + 10 + step * i as i32,
                top,
                width,
                height,
            };
            let chart = axes(area, plot, state.title, &x, &y)?;
            let between = |k: usize, t: f64| {
                let (a, b) = (state.inner[k], state.outer[k]);
                [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
            };
            for layer in 1..n_layers {
                let t = layer as f64 / n_layers as f64;
                let line: Vec<[f64; 2]> = (0..state.inner.len()).map(|k| between(k, t)).collect();
                stroke(&chart, &line, GREY, 1)?;
            }
            let every = state.inner.len().div_ceil(n_cells).max(1);
            // From the apex outwards, so that the mesh is as symmetric as the nodes are.
            let first = (state.inner.len() / 2) % every;
            for k in (first..state.inner.len()).step_by(every) {
                stroke(&chart, &[between(k, 0.0), between(k, 1.0)], GREY, 1)?;
            }
            stroke(&chart, state.outer, OUTER, 4)?;
            stroke(&chart, state.inner, INNER, 4)?;
        }
        legend(area, &ENTRIES, (LABELS_LEFT + 10, size.1 - 32)).map(drop)
    })
}
