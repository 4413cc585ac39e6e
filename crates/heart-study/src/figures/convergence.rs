//! Residuals by iteration (Fig. 10, and Newton with either Jacobian).

use super::Picture;
use super::canvas::{
    Area, Axis, Drawn, FINE, LABELS_BELOW, LABELS_LEFT, Rect, axes, on_plot, paint, power_of_ten,
    text_width,
};
use super::marks::{SIGN, Sign, dashed, legend, marker, stroke};
use super::style::{GREY, SERIES, SMALL};
use heart_phantom::PhantomError;

/// Distance of markers in pixels.
const APART: i32 = 24;

/// Draws norms against iteration, norms on a logarithmic axis, and a dashed line at `tolerance`, a power of ten, if there is one.
///
/// `y_label` names the norm with its unit. A history is its label in the legend and the norms, finite and not negative: before the
/// first iteration and after each. A zero is drawn on the lower edge.
pub(crate) fn histories(
    y_label: &str,
    tolerance: Option<f64>,
    histories: &[(&str, &[f64])],
) -> Result<Picture, PhantomError> {
    let row = 40;
    let above = row * histories.len() as i32;
    let plot = Rect {
        left: LABELS_LEFT + 30,
        top: above + 34,
        width: 1040,
        height: 560,
    };
    let last = histories
        .iter()
        .map(|(_, norms)| norms.len() - 1)
        .max()
        .unwrap_or(0)
        .max(1);
    let x = Axis::linear(
        -0.02 * last as f64,
        1.02 * last as f64,
        last.min(10),
        "iteration",
    );
    let norms = histories
        .iter()
        .flat_map(|(_, norms)| norms.iter().copied());
    let y = Axis::decades(norms.chain(tolerance), y_label);
    let height = |v: f64| if v > 0.0 { v.log10() } else { y.low };

    paint(
        (plot.left + plot.width + 40) as u32,
        (plot.top + plot.height + LABELS_BELOW + 10) as u32,
        |area| {
            let chart = axes(area, plot, "", &x, &y)?;
            if let Some(at) = tolerance {
                let line = [[x.low, at.log10()], [x.high, at.log10()]];
                dashed(&chart, line, GREY, 2)?;
            }
            for (i, (name, norms)) in histories.iter().enumerate() {
                let colour = SERIES[i % SERIES.len()];
                let points: Vec<[f64; 2]> = norms
                    .iter()
                    .enumerate()
                    .map(|(k, &v)| [k as f64, height(v)])
                    .collect();
                stroke(&chart, &points, colour, 3)?;
                // Markers several pixels apart; a steep history shows each point.
                let mut shown: Option<(i32, i32)> = None;
                for (k, p) in points.iter().enumerate() {
                    let at = on_plot(&chart, *p);
                    let far = shown.is_none_or(|last| apart(last, at) >= APART * FINE);
                    if far || k + 1 == points.len() {
                        // Drawn on the whole image, so that markers on the edge are complete.
                        let place = (at.0 + plot.left * FINE, at.1 + plot.top * FINE);
                        marker(area, i, place, 7, colour)?;
                        shown = Some(at);
                    }
                }
                let middle = 12 + row / 2 + row * i as i32;
                let entry = (Sign::Marked { kind: i }, colour, *name);
                legend(area, &[entry], (plot.left, middle))?;
            }
            let middle = 12 + row / 2 + row * (histories.len() as i32 - 1);
            tolerance.map_or(Ok(()), |at| {
                stop_at(area, at, (plot.left + plot.width, middle))
            })
        },
    )
}

/// The legend of the tolerance, up to a place.
fn stop_at(area: &Area<'_>, at: f64, (right, middle): (i32, i32)) -> Drawn {
    let words = format!("stop at {}", power_of_ten(at.log10().round() as i64));
    let left = right - text_width(area, &words, SMALL) - SIGN;
    legend(area, &[(Sign::Dashes, GREY, &words)], (left, middle)).map(drop)
}

fn apart(a: (i32, i32), b: (i32, i32)) -> i32 {
    (a.0 - b.0).abs().max((a.1 - b.1).abs())
}
