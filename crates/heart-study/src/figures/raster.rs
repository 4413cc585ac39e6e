//! Grey-scale images of sampled data: window, resampling to pixels, colour bar.

use super::Picture;
use super::canvas::{Area, Drawn, FINE, HPos, Rect, label, number, round_ticks};
use super::style::GREY;
use plotters::prelude::{Color, PathElement};

/// Width of a colour bar with its labels, and its distance from the image, pixels.
pub(super) const BAR_ROOM: i32 = 170;
pub(super) const BAR_GAP: i32 = 28;
pub(super) const BAR_WIDTH: i32 = 28;

/// The grey of `value`: black at the window's low end and below, white at its high end and above, linear between.
pub(super) fn grey(value: f64, window: [f64; 2]) -> u8 {
    let along = (value - window[0]) / (window[1] - window[0]);
    (255.0 * along.clamp(0.0, 1.0)).round() as u8
}

/// Size of a grid of samples in pixels: an integer number per sample if at least two, else `target` along the longer side.
pub(super) fn fit(size: [usize; 2], target: usize) -> [i32; 2] {
    let longest = size[0].max(size[1]);
    let whole = target / longest;
    size.map(|n| match whole {
        0 | 1 => (n * target).div_ceil(longest) as i32,
        _ => (n * whole) as i32,
    })
}

/// For each of `n_pixels` pixels, the covered samples and their fractions.
pub(super) fn footprints(n_pixels: usize, n_samples: usize) -> Vec<Vec<(usize, f64)>> {
    let ratio = n_samples as f64 / n_pixels as f64;
    (0..n_pixels)
        .map(|i| {
            let (from, to) = (i as f64 * ratio, (i as f64 + 1.0) * ratio);
            let last = (to.ceil() as usize).min(n_samples);
            (from.floor() as usize..last)
                .map(|k| (k, (to.min(k as f64 + 1.0) - from.max(k as f64)) / ratio))
                .filter(|&(_, share)| share > 1e-9)
                .collect()
        })
        .collect()
}

/// Fills `rect` with the average of the samples over each pixel; row 0 of the samples is at the bottom.
pub(super) fn fill(
    picture: &mut Picture,
    rect: Rect,
    (n_columns, n_rows): (usize, usize),
    window: [f64; 2],
    sample: impl Fn(usize, usize) -> f32,
) {
    let across = footprints(rect.width as usize, n_columns);
    let up = footprints(rect.height as usize, n_rows);
    for (j, rows) in up.iter().enumerate() {
        for (i, columns) in across.iter().enumerate() {
            let mut mean = 0.0;
            for &(row, a) in rows {
                for &(column, b) in columns {
                    mean += a * b * f64::from(sample(column, row));
                }
            }
            let shade = grey(mean, window);
            let y = rect.top + rect.height - 1 - j as i32;
            picture.set((rect.left + i as i32) as u32, y as u32, [shade; 3]);
        }
    }
}

/// Position of the colour bar of the image in `rect`.
fn bar(rect: Rect) -> Rect {
    Rect {
        left: rect.left + rect.width + BAR_GAP,
        width: BAR_WIDTH,
        ..rect
    }
}

/// Ticks, numbers and the label of the colour bar to the right of `rect`.
pub(super) fn bar_labels(area: &Area<'_>, rect: Rect, window: [f64; 2], heading: &str) -> Drawn {
    let bar = bar(rect);
    let ticks = round_ticks(window[0], window[1], 6);
    let step = if ticks.len() > 1 {
        ticks[1] - ticks[0]
    } else {
        1.0
    };
    for &tick in &ticks {
        let along = (tick - window[0]) / (window[1] - window[0]);
        let y = bar.top + bar.height - (along * f64::from(bar.height)).round() as i32;
        let right = bar.left + bar.width;
        let ends = vec![(right * FINE, y * FINE), ((right + 8) * FINE, y * FINE)];
        area.draw(&PathElement::new(ends, GREY.stroke_width(FINE as u32)))?;
        label(area, &number(tick, step), (right + 14, y), HPos::Left)?;
    }
    label(
        area,
        heading,
        (bar.left + bar.width, bar.top - 28),
        HPos::Center,
    )
}

/// The greys of the colour bar.
pub(super) fn fill_bar(picture: &mut Picture, rect: Rect, window: [f64; 2]) {
    let bar = bar(rect);
    for j in 0..bar.height {
        // The value at the middle of the pixel.
        let along = (f64::from(bar.height - j) - 0.5) / f64::from(bar.height);
        let shade = grey(window[0] + along * (window[1] - window[0]), window);
        for i in 0..bar.width {
            let edge = i == 0 || j == 0 || i + 1 == bar.width || j + 1 == bar.height;
            let colour = if edge { [0x75; 3] } else { [shade; 3] };
            picture.set((bar.left + i) as u32, (bar.top + j) as u32, colour);
        }
    }
}
