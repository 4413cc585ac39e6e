//! Grey-scale images of sampled data: window, resampling to pixels, colour bar.

use super::Picture;
use super::canvas::{Area, Drawn, FINE, HPos, Rect, label, number, round_ticks};
use super::style::GREY;
use plotters::prelude::{Color, PathElement};

/// Width of a colour bar with its labels, and its distance from the image, pixels.
pub(super) const BAR_ROOM: i32 = 170;
const BAR_GAP: i32 = 28;
const BAR_WIDTH: i32 = 28;

/// The grey of `value`: black at the window's low end and below, white at its high end and above, linear between.
pub(super) fn grey(value: f64, window: [f64; 2]) -> u8 {
    let along = (value - window[0]) / (window[1] - window[0]);
    (255.0 * along.clamp(0.0, 1.0)).round() as u8
}

/// Size of a grid of samples in pixels: an integer number per sample if at least two, else `target` along the longer side.
pub(super) fn fit(n_columns: usize, n_rows: usize, target: usize) -> (i32, i32) {
    let longest = n_columns.max(n_rows);
    let whole = target / longest;
    let pixels = |n: usize| {
        if whole >= 2 {
            n * whole
        } else {
            (n * target).div_ceil(longest)
        }
    };
    (pixels(n_columns) as i32, pixels(n_rows) as i32)
}

/// For each of `n_pixels` pixels, the covered samples and their fractions.
fn footprints(n_pixels: usize, n_samples: usize) -> Vec<Vec<(usize, f64)>> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figures::canvas::paint;

    #[test]
    fn the_window_maps_low_to_black_and_high_to_white_and_rises() {
        let window = [-0.25, 1.25];
        assert_eq!(grey(-0.25, window), 0);
        assert_eq!(grey(-9.0, window), 0);
        assert_eq!(grey(1.25, window), 255);
        assert_eq!(grey(9.0, window), 255);
        assert_eq!(grey(0.5, window), 128);
        let greys: Vec<u8> = (0..=1000)
            .map(|k| grey(-0.3 + 1.6 * f64::from(k) / 1000.0, window))
            .collect();
        assert!(greys.windows(2).all(|w| w[0] <= w[1]));
        // Every grey is used.
        assert!((0..=255).all(|g| greys.contains(&g)));
    }

    #[test]
    fn footprints_cover_each_sample_evenly() {
        for (n_pixels, n_samples) in [(512, 256), (384, 256), (384, 1000), (7, 7)] {
            let prints = footprints(n_pixels, n_samples);
            let mut seen = vec![0.0; n_samples];
            for print in &prints {
                assert!((print.iter().map(|p| p.1).sum::<f64>() - 1.0).abs() < 1e-9);
                print.iter().for_each(|&(k, share)| seen[k] += share);
            }
            let even = n_pixels as f64 / n_samples as f64;
            assert!(seen.iter().all(|s| (s - even).abs() < 1e-6));
        }
    }

    #[test]
    fn columns_run_to_the_right_and_rows_upwards() {
        let rect = Rect {
            left: 5,
            top: 7,
            width: 40,
            height: 30,
        };
        let mut picture = paint(60, 50, |_| Ok(())).unwrap();
        fill(&mut picture, rect, (4, 3), [0.0, 1.0], |column, row| {
            f32::from(u8::from(column == 3 && row == 2))
        });
        // Ten pixels per sample: the last column and the last row are to the right and on top.
        assert_eq!(picture.pixel(5 + 35, 7 + 5).unwrap(), [255; 3]);
        assert_eq!(picture.pixel(5 + 35, 7 + 15).unwrap(), [0; 3]);
        assert_eq!(picture.pixel(5 + 25, 7 + 5).unwrap(), [0; 3]);
        assert_eq!(picture.pixel(5, 7 + 29).unwrap(), [0; 3]);
        // Nothing beyond the rectangle.
        assert_eq!(picture.pixel(4, 20).unwrap(), [255; 3]);
        assert_eq!(picture.pixel(45, 20).unwrap(), [255; 3]);
    }

    #[test]
    fn the_bar_shows_the_window_from_bottom_to_top() {
        let rect = Rect {
            left: 0,
            top: 10,
            width: 20,
            height: 200,
        };
        let mut picture = paint(200, 230, |_| Ok(())).unwrap();
        let window = [-1.0, 3.0];
        fill_bar(&mut picture, rect, window);
        let x = (20 + BAR_GAP + BAR_WIDTH / 2) as u32;
        for y in 12..208 {
            // Position of the centre of pixel y as a fraction of the height of the bar.
            let along = (210.0 - f64::from(y) - 0.5) / 200.0;
            let value = -1.0 + 4.0 * along;
            assert_eq!(picture.pixel(x, y).unwrap()[0], grey(value, window));
        }
        assert!(picture.pixel(x, 12).unwrap()[0] > 250 && picture.pixel(x, 207).unwrap()[0] < 5);
    }
}
