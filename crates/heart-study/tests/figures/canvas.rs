//! Positions of axes and their labels.

use crate::figures::canvas::{
    Axis, Rect, axes, equal_scale, font, number, on_plot, paint, paint_over, power_of_ten,
    round_ticks,
};
use crate::figures::marks::{marker, stroke};
use crate::figures::style::{BLACK, RED, register};

#[test]
fn a_point_of_the_chart_has_its_position() {
    let plot = Rect {
        left: 110,
        top: 20,
        width: 400,
        height: 300,
    };
    let (x, y) = (
        Axis::linear(-2.0, 6.0, 8, "x"),
        Axis::linear(-3.0, 3.0, 6, "y"),
    );
    let picture = paint(600, 420, |area| {
        let chart = axes(area, plot, "", &x, &y)?;
        let inside = chart.plotting_area().strip_coord_spec();
        marker(&inside, 0, on_plot(&chart, [3.0, 1.5]), 4, RED)
    })
    .unwrap();
    // 50 pixels a centimetre: (3 + 2) * 50 from the left, (3 - 1.5) * 50 from the top.
    assert_eq!(
        picture.pixel(110 + 250, 20 + 75).unwrap(),
        [RED.0, RED.1, RED.2]
    );
    let red: Vec<(u32, u32)> = (0..420)
        .flat_map(|y| (0..600).map(move |x| (x, y)))
        .filter(|&(x, y)| picture.pixel(x, y).unwrap() == [RED.0, RED.1, RED.2])
        .collect();
    let mean = |f: fn(&(u32, u32)) -> u32| {
        red.iter().map(|p| f64::from(f(p))).sum::<f64>() / red.len() as f64
    };
    // Plotters rounds to thirds of a pixel.
    assert!((mean(|p| p.0) + 0.5 - 360.5).abs() < 1.0 && (mean(|p| p.1) + 0.5 - 95.5).abs() < 1.0);
}

#[test]
fn a_stroke_colours_the_line_and_not_its_surroundings() {
    let plot = Rect {
        left: 110,
        top: 20,
        width: 400,
        height: 400,
    };
    let axis = Axis::linear(0.0, 4.0, 4, "");
    // A dense diagonal and back along the bottom.
    let points: Vec<[f64; 2]> = (0..=4000).map(|k| [0.5 + f64::from(k) * 7e-4; 2]).collect();
    let picture = paint(560, 520, |area| {
        let chart = axes(area, plot, "", &axis, &axis)?;
        stroke(&chart, &points, RED, 3)
    })
    .unwrap();
    for k in 1..10 {
        let at = 0.5 + 0.28 * f64::from(k);
        let (x, y) = (110 + (at * 100.0) as u32, 420 - (at * 100.0) as u32);
        let [r, g, _] = picture.pixel(x, y).unwrap();
        assert!(r > 200 && g < 60, "{k}: {:?}", picture.pixel(x, y).unwrap());
        assert!(
            picture.pixel(x + 8, y).unwrap()[1] > 200 && picture.pixel(x - 8, y).unwrap()[1] > 200
        );
    }
}

#[test]
fn ticks_are_round_numbers_within_the_range() {
    assert_eq!(round_ticks(-8.0, 8.0, 5), [-5.0, 0.0, 5.0]);
    assert_eq!(round_ticks(0.0, 10.0, 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
    let ticks = round_ticks(0.1, 0.3, 2);
    assert_eq!(ticks.len(), 3);
    // Extreme ranges end too.
    assert!(round_ticks(0.0, 1e300, 6).len() < 20);
    assert!(round_ticks(1.0, 1.0 + 1e-15, 6).len() < 60);
}

#[test]
fn numbers_are_written_with_the_decimals_of_their_scale() {
    assert_eq!(number(5.0, 1.0), "5");
    assert_eq!(number(-0.5, 0.5), "−0.5");
    assert_eq!(number(34.5606, 0.01), "34.56");
    assert_eq!(number(-0.0001, 0.1), "0.0");
    assert_eq!(power_of_ten(-14), "10⁻¹⁴");
    assert_eq!(power_of_ten(2), "10²");
}

#[test]
fn decades_contain_all_values() {
    let axis = Axis::decades([3e-14, 18.0, 0.0].into_iter(), "");
    assert_eq!((axis.low, axis.high), (-14.0, 2.0));
    assert!(axis.ticks.len() >= 5 && axis.ticks.iter().all(|t| t.fract() == 0.0));
}

#[test]
fn equal_scale_is_the_same_along_both_axes_and_contains_the_data() {
    let [x0, x1, y0, y1] = equal_scale([0.0, 10.0, -2.0, 2.0], 0.05, (800, 600));
    assert!(((x1 - x0) / 800.0 - (y1 - y0) / 600.0).abs() < 1e-12);
    assert!(x0 <= -0.5 && x1 >= 10.5 && y0 <= -2.5 && y1 >= 2.5);
    assert!((0.5 * (x0 + x1) - 5.0).abs() < 1e-12);
}

#[test]
fn drawing_over_an_image_preserves_other_pixels() {
    let mut below = paint(40, 30, |_| Ok(())).unwrap();
    (0..40).for_each(|x| below.set(x, x % 30, [(6 * x) as u8, 17, 200]));
    let over = paint_over(below.clone(), |_| Ok(())).unwrap();
    assert_eq!(over, below);
}

#[test]
fn the_font_has_every_sign_the_figures_use() {
    register();
    let drawing = |sign: char| {
        let mut ink = Vec::new();
        let drawn = font(40, &BLACK)
            .font
            .draw(&sign.to_string(), (0, 0), |x, y, c| {
                ink.push((x, y, c.to_bits()));
                Ok::<(), std::convert::Infallible>(())
            });
        assert!(drawn.is_ok());
        ink
    };
    // The replacement of a glyph that the font lacks, such as a Chinese character.
    let missing = drawing('\u{4e2d}');
    for sign in "aZ09λθΔπμ°²³⁻⁰⁴₂ₚₑ−×·±≤≥‖√∫∂→≈–’".chars()
    {
        let ink = drawing(sign);
        assert!(!ink.is_empty() && ink != missing, "{sign}");
    }
}
