//! Style of all figures: palette, sizes and font.

use std::sync::Once;

use plotters::style::{FontStyle, RGBColor, register_font};

// The colours of Okabe and Ito, distinguishable with any colour vision (https://jfly.uni-koeln.de/color/).
pub(super) const BLACK: RGBColor = RGBColor(0x1c, 0x1c, 0x1c);
pub(super) const BLUE: RGBColor = RGBColor(0x00, 0x72, 0xb2);
pub(super) const VERMILION: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
pub(super) const GREEN: RGBColor = RGBColor(0x00, 0x9e, 0x73);
pub(super) const ORANGE: RGBColor = RGBColor(0xe6, 0x9f, 0x00);
pub(super) const PINK: RGBColor = RGBColor(0xcc, 0x79, 0xa7);
pub(super) const SKY: RGBColor = RGBColor(0x56, 0xb4, 0xe9);
pub(super) const RED: RGBColor = RGBColor(0xd6, 0x1f, 0x26);
pub(super) const MAGENTA: RGBColor = RGBColor(0xc0, 0x1f, 0xb0);
pub(super) const GREY: RGBColor = RGBColor(0x75, 0x75, 0x75);
pub(super) const FAINT: RGBColor = RGBColor(0xe4, 0xe4, 0xe4);

/// Inner membrane (endocardium) and outer membrane (epicardium), in every figure.
pub(super) const INNER: RGBColor = VERMILION;
pub(super) const OUTER: RGBColor = BLUE;

/// Surfaces and cut faces in shaded views.
pub(super) const SURFACE: RGBColor = RGBColor(0x6f, 0xa8, 0xd6);
pub(super) const CAVITY: RGBColor = RGBColor(0xe0, 0x7b, 0x4f);
pub(super) const CUT: RGBColor = RGBColor(0xf6, 0xd3, 0xb8);

/// Colours of series, in order.
pub(super) const SERIES: [RGBColor; 6] = [VERMILION, BLUE, GREEN, ORANGE, PINK, SKY];

// Heights of text in pixels of the finished image.
pub(super) const TITLE: i32 = 30;
pub(super) const TEXT: i32 = 26;
pub(super) const SMALL: i32 = 23;

/// The family name of the included font.
pub(super) const FONT: &str = "sans-serif";

static DEJAVU: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");

/// Registers the included font, once per process.
pub(super) fn register() {
    static DONE: Once = Once::new();
    DONE.call_once(|| {
        // The bytes are part of the program and parsed by every test, so a failure cannot occur at run time.
        let registered = register_font(FONT, FontStyle::Normal, DEJAVU);
        debug_assert!(registered.is_ok());
    });
}

/// Colour `t` in [0, 1] of an ordered family: dark violet to green-yellow, lightness rising throughout
/// (anchors sampled from matplotlib's viridis, CC0), cut before it gets too pale for white paper.
pub(super) fn ramp(t: f64) -> RGBColor {
    const ANCHORS: [[f64; 3]; 6] = [
        [68.0, 1.0, 84.0],
        [65.0, 68.0, 135.0],
        [42.0, 120.0, 142.0],
        [34.0, 168.0, 132.0],
        [94.0, 190.0, 92.0],
        [150.0, 200.0, 50.0],
    ];
    let at = t.clamp(0.0, 1.0) * (ANCHORS.len() - 1) as f64;
    let i = (at as usize).min(ANCHORS.len() - 2);
    let w = at - i as f64;
    let mix = |k: usize| (ANCHORS[i][k] * (1.0 - w) + ANCHORS[i + 1][k] * w).round() as u8;
    RGBColor(mix(0), mix(1), mix(2))
}
