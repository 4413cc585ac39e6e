//! Content of the panels of figures.

use super::*;

/// Pixels of exactly one colour.
fn of_colour(picture: &Picture, colour: [u8; 3]) -> Vec<(f64, f64)> {
    (0..picture.height)
        .flat_map(|y| (0..picture.width).map(move |x| (x, y)))
        .filter(|&(x, y)| picture.pixel(x, y).unwrap() == colour)
        .map(|(x, y)| (f64::from(x) + 0.5, f64::from(y) + 0.5))
        .collect()
}

#[test]
fn norms_have_a_logarithmic_axis() {
    let norms = [1e2, 1.0, 1e-2];
    let picture = histories("norm", None, &[("a", &norms)]).unwrap();
    // The first colour, below the legend; markers are the widest runs of it, three of them.
    let points: Vec<(f64, f64)> = of_colour(&picture, [0xd5, 0x5e, 0x00])
        .into_iter()
        .filter(|p| p.1 > 60.0)
        .collect();
    let (left, right) = points
        .iter()
        .fold((f64::INFINITY, 0.0f64), |m, p| (m.0.min(p.0), m.1.max(p.0)));
    // Heights of the ends and of the line at the middle: equal steps of the logarithm.
    let height = |x: f64| {
        let near: Vec<f64> = points
            .iter()
            .filter(|p| (p.0 - x).abs() < 2.0)
            .map(|p| p.1)
            .collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    let (a, b, c) = (
        height(left + 7.0),
        height(0.5 * (left + right)),
        height(right - 7.0),
    );
    assert!(a < b && b < c, "norms fall: {a} {b} {c}");
    // Four decades over 560 pixels, to the markers' width.
    assert!(
        (b - a - 280.0).abs() < 5.0 && (c - b - 280.0).abs() < 5.0,
        "{a} {b} {c}"
    );
}

/// Squares are 14 pixels wide, the line is 3.
#[test]
fn every_point_of_a_steep_history_has_its_marker() {
    let (long, steep) = ([10.0; 61], [20.0, 0.3, 7e-6, 1e-10]);
    let picture = histories("norm", None, &[("long", &long), ("steep", &steep)]).unwrap();
    let blue = of_colour(&picture, [0x00, 0x72, 0xb2]);
    let wide = |y: f64| blue.iter().filter(|p| p.1 == y && p.0 > 120.0).count() >= 13;
    // Below the legend of two rows.
    let rows: Vec<u32> = (100..picture.height)
        .filter(|&y| wide(f64::from(y) + 0.5))
        .collect();
    let squares = rows.iter().filter(|&&y| !rows.contains(&(y + 1))).count();
    assert_eq!(squares, 4, "{rows:?}");
    // Each marker is complete, also the last one, on the edge of the plot.
    assert!(rows.len() >= 4 * 13, "{}", rows.len());
}

#[test]
fn forces_have_their_directions_at_their_nodes() {
    let nodes = [[0.0, 0.0], [4.0, 0.0], [8.0, 0.0]];
    // Elastic to the right and twice the pressure, which is upwards.
    let (elastic, pressure) = ([[2.0, 0.0]; 3], [[0.0, 1.0]; 3]);
    let frame = ForceFrame {
        iteration: 3,
        nodes: &nodes,
        elastic: &elastic,
        pressure: &pressure,
    };
    let picture = force_frames(&[frame]).unwrap();
    // Below the legend.
    let find = |colour| -> Vec<(f64, f64)> {
        of_colour(&picture, colour)
            .into_iter()
            .filter(|p| p.1 > 114.0)
            .collect()
    };
    let red = find([0xd6, 0x1f, 0x26]);
    let magenta = find([0xc0, 0x1f, 0xb0]);
    let low = |p: &[(f64, f64)]| p.iter().fold(f64::INFINITY, |m, p| m.min(p.0));
    let high = |p: &[(f64, f64)]| p.iter().fold(0.0f64, |m, p| m.max(p.0));
    let level = red.iter().map(|p| p.1).sum::<f64>() / red.len() as f64;
    // The nodes' dots are 8 pixels wide; 8 cm lie between the outer two.
    let per_cm = (high(&red) - low(&red) - 8.0) / 8.0;
    // The longest arrow is an eighth of 8 cm, to the right of the last node, level with it.
    let reach = high(&magenta) - (high(&red) - 4.0);
    assert!((reach / per_cm - 1.0).abs() < 0.06, "{reach} {per_cm}");
    assert!(magenta.iter().all(|p| (p.1 - level).abs() < 8.0));
    // The key at the top, in the row of its stem: the longest force is 2 cm, a round number.
    let grey = |x: u32| picture.pixel(x, 28).unwrap() == [0x75; 3];
    let runs = (0..picture.width).scan(0, |run, x| {
        *run = if grey(x) { *run + 1 } else { 0 };
        Some(*run)
    });
    let key = f64::from(runs.max().unwrap());
    assert!((key - reach).abs() < 4.0, "{key} {reach}");
    // Half as long and upwards: black above the middle node.
    let middle = 0.5 * (low(&red) + high(&red));
    let black: Vec<f64> = find([0x1c; 3])
        .into_iter()
        .filter(|p| (p.0 - middle).abs() < 2.0 && p.1 < level)
        .map(|p| p.1)
        .collect();
    let top = black.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(
        ((level - top) / per_cm - 0.5).abs() < 0.06,
        "{}",
        (level - top) / per_cm
    );
}

#[test]
fn the_wall_has_its_layers_between_its_membranes() {
    // A wall from y = 1 to y = 3, straight; five layers are four lines between the membranes.
    let line = |y: f64| -> Vec<[f64; 2]> { (0..=50).map(|k| [f64::from(k) * 0.2, y]).collect() };
    let (inner, outer) = (line(1.0), line(3.0));
    let state = WallState {
        title: "",
        inner: &inner,
        outer: &outer,
    };
    let rows_of = |n_layers: usize| {
        // A single cell along the wall, so only lines along it cross this column.
        let picture = wall_meshes(&[state], n_layers, 1).unwrap();
        let column = 110 + 450 / 4;
        let find = |colour: [u8; 3]| -> Vec<u32> {
            (50..picture.height - 60)
                .filter(|&y| picture.pixel(column, y).unwrap() == colour)
                .collect()
        };
        let (blue, vermilion) = (find([0x00, 0x72, 0xb2]), find([0xd5, 0x5e, 0x00]));
        assert!(blue[0] < vermilion[0], "the outer membrane is above");
        let dark = |y: u32| picture.pixel(column, y).unwrap()[0] < 200;
        let (from, to) = (*blue.last().unwrap() + 2, vermilion[0] - 2);
        (from..to).filter(|&y| dark(y) && !dark(y - 1)).count()
    };
    assert_eq!(rows_of(5), 4);
    assert_eq!(rows_of(1), 0);
}

#[test]
fn the_circle_and_its_guide_are_drawn_in_their_panels() {
    let arc: Vec<[f64; 2]> = (0..=60)
        .map(|k| PI * f64::from(k) / 60.0)
        .map(|a| [2.0 * a.cos(), 2.0 * a.sin()])
        .collect();
    let study = CircleStudy {
        initial: vec![[2.0, 0.0], [-2.0, 0.0]],
        solution: arc,
        centre: [0.0; 2],
        radius: 2.0,
        n_nodes: vec![10, 100, 1000],
        errors: vec![1e-2, 1e-4, 1e-6],
    };
    let picture = circle(&study).unwrap();
    // The initial line is a level run of blue through the middle of the left panel (106..706 by 24..624).
    let blue: Vec<(f64, f64)> = of_colour(&picture, [0x00, 0x72, 0xb2])
        .into_iter()
        .filter(|p| p.1 < 630.0)
        .collect();
    assert!(blue.iter().all(|p| (p.1 - 324.0).abs() < 4.0));
    let (low, high) = blue
        .iter()
        .fold((f64::INFINITY, 0.0f64), |m, p| (m.0.min(p.0), m.1.max(p.0)));
    // 4 cm of the 4.4 cm across 600 pixels, less the dots over its ends.
    assert!(
        (high - low - 4.0 / 4.4 * 600.0).abs() < 14.0,
        "{low} {high}"
    );
    // The errors fall by four decades over two of N: from the upper left to the lower right corner.
    let dots: Vec<(f64, f64)> = of_colour(&picture, [0xd5, 0x5e, 0x00])
        .into_iter()
        .filter(|p| p.0 > 760.0 && p.1 < 640.0)
        .collect();
    assert!(
        dots.iter().any(|p| p.0 < 875.0 && p.1 < 40.0)
            && dots.iter().any(|p| p.0 > 1410.0 && p.1 > 610.0)
    );
    // Along a straight line, also at the middle.
    assert!(
        dots.iter()
            .any(|p| (p.0 - 1142.0).abs() < 6.0 && (p.1 - 324.0).abs() < 6.0)
    );
}
