//! Grey values, resampling and the colour bar.

use crate::figures::canvas::{Rect, paint};
use crate::figures::raster::{BAR_GAP, BAR_WIDTH, fill_bar, footprints, grey};
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
