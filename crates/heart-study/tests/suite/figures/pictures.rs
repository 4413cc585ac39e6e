//! Figures as files: orientation, scale, reproducibility.

use std::f64::consts::PI;

use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use heart_phantom::{PhantomError, files};
use heart_study::StudyError;
use heart_study::figures;
use heart_study::figures::*;

use super::{FRONT, ball, half_ellipse, iso};

#[test]
fn files_are_written_completely_and_restored_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let picture = histories(
        "norm",
        None,
        &[History {
            label: "a",
            norms: &[1.0, 0.1],
        }],
    )
    .unwrap();
    let path = folder.path().join("a.png");
    picture.write_png(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut rgb).unwrap();
    assert_eq!(
        (frame.width, frame.height),
        (picture.width(), picture.height())
    );
    assert_eq!(frame.color_type, png::ColorType::Rgb);
    assert!(rgb == picture.rgb());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

    let nowhere = folder.path().join("no/folder/a.png");
    assert!(matches!(
        picture.write_png(&nowhere),
        Err(StudyError::Phantom(PhantomError::File { .. }))
    ));
    let page = Page::default();
    assert!(matches!(
        page.write_html(&nowhere),
        Err(StudyError::Phantom(PhantomError::File { .. }))
    ));
}

#[test]
fn geometry_has_one_scale_along_both_axes() {
    // A diamond 8 cm long and 6 cm high: its colour's extent in pixels has the same proportions.
    let nodes = [[0.0, 3.0], [8.0, 0.0], [0.0, -3.0], [4.0, 0.0]];
    let picture = shapes(&[Shape {
        nodes: &nodes,
        load: 0.0,
        area: 1.0,
        volume: 1.0,
    }])
    .unwrap();
    // The plot is left of the table; the first colour of the family is a dark violet.
    let (mut x, mut y) = ((u32::MAX, 0), (u32::MAX, 0));
    for j in 0..picture.height() {
        for i in 110..900 {
            let [r, g, b] = picture.pixel(i, j).unwrap();
            if g < 40 && b > 60 && r > 50 && r < 100 {
                x = (x.0.min(i), x.1.max(i));
                y = (y.0.min(j), y.1.max(j));
            }
        }
    }
    let (width, height) = (f64::from(x.1 - x.0), f64::from(y.1 - y.0));
    // Corners are mitred by up to a few strokes of 4 pixels.
    assert!(
        (width / height - 8.0 / 6.0).abs() < 0.04,
        "{width} {height}"
    );
    assert!(width > 500.0);
}

#[test]
fn a_slice_has_x_to_the_right_and_the_front_or_the_head_on_top() {
    let (nz, ny, nx) = (4, 6, 8);
    let mut values = vec![0.0f32; nz * ny * nx];
    // One voxel: x = 6 of 8, y = 4 of 6, z = 1 of 4.
    values[(ny + 4) * nx + 6] = 1.0;
    let volume = Volume {
        values: &values,
        size: [nz, ny, nx],
        spacing: 1.0,
    };
    let lit = |plane: Plane| lit(&slice(&volume, plane, [0.0, 1.0], "").unwrap());
    // Centres of voxels, as fractions of the panel from the left and from the top; one pixel is below 1/300.
    let close = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 4e-3 && (a.1 - b.1).abs() < 4e-3;
    // +y is the back of a patient.
    let found = lit(Plane::Z(1));
    assert!(close(found, (6.5 / 8.0, 4.5 / 6.0)), "{found:?}");
    let found = lit(Plane::Y(4));
    assert!(close(found, (6.5 / 8.0, 1.0 - 1.5 / 4.0)), "{found:?}");
    let found = lit(Plane::X(6));
    assert!(close(found, (4.5 / 6.0, 1.0 - 1.5 / 4.0)), "{found:?}");

    // The plain images of the same volume have the same orientation.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let grid = VoxelGrid::centred([nx, ny, nz], [1.0; 3], [0.0; 3]).unwrap();
    let plain = files::Volume::new(grid, values.as_slice()).unwrap();
    for (plane, section) in [
        (Plane::Z(1), files::Section::Axial(1)),
        (Plane::Y(4), files::Section::Coronal(4)),
        (Plane::X(6), files::Section::Sagittal(6)),
    ] {
        files::write_png(&path, &plain, section, [0.0, 1.0]).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut shades = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut shades).unwrap();
        let (width, height) = (frame.width as usize, frame.height as usize);
        let at = shades.iter().position(|&shade| shade == 255).unwrap();
        let share = |at: usize, of: usize| (at as f64 + 0.5) / of as f64;
        let found = (share(at % width, width), share(at / width, height));
        let figure = lit(plane);
        assert!(close(found, figure), "{plane:?}: {found:?} {figure:?}");
    }
}

/// The centre of the white pixels of a slice's panel, as fractions from its left and from its top.
fn lit(picture: &Picture) -> (f64, f64) {
    // The panel is the black rectangle; the bar is to its right, beyond a white gap.
    let row_of = |j: u32| {
        (0..picture.width() - 175)
            .filter(|&i| picture.pixel(i, j).unwrap() == [0; 3])
            .collect::<Vec<_>>()
    };
    let rows: Vec<(u32, Vec<u32>)> = (0..picture.height())
        .map(|j| (j, row_of(j)))
        .filter(|(_, r)| r.len() > 200)
        .collect();
    let (top, bottom) = (rows[0].0, rows[rows.len() - 1].0);
    let (left, right) = (rows[0].1[0], *rows[0].1.last().unwrap());
    let mut at = Vec::new();
    for j in top..=bottom {
        for i in left..=right {
            if picture.pixel(i, j).unwrap() == [255; 3] {
                at.push((f64::from(i - left) + 0.5, f64::from(j - top) + 0.5));
            }
        }
    }
    let n = at.len() as f64;
    let (width, height) = (f64::from(right - left + 1), f64::from(bottom - top + 1));
    (
        at.iter().map(|p| p.0).sum::<f64>() / n / width,
        at.iter().map(|p| p.1).sum::<f64>() / n / height,
    )
}

/// Pixels that are not white within the circle of half the width of the image.
fn inked(picture: &Picture) -> usize {
    let middle = 0.5 * f64::from(picture.width());
    (0..picture.height())
        .flat_map(|y| (0..picture.width()).map(move |x| (x, y)))
        .filter(|&(x, y)| {
            (f64::from(x) + 0.5 - middle).hypot(f64::from(y) + 0.5 - middle) < 0.7 * middle
        })
        .filter(|&(x, y)| picture.pixel(x, y).unwrap() != [255; 3])
        .count()
}

#[test]
fn a_ball_has_a_round_silhouette_of_its_radius() {
    let n = 64;
    let (radius, spacing) = (18.0, 0.25);
    let values = ball(n, radius);
    let volume = Volume {
        values: &values,
        size: [n; 3],
        spacing,
    };
    for view in [
        FRONT,
        View {
            azimuth: 1.0,
            elevation: 0.6,
        },
    ] {
        let picture = isosurface(&volume, &IsoView { view, ..iso(0.5) }).unwrap();
        // The image spans 0.85 of the volume.
        let pixels = radius / (0.85 * n as f64) * f64::from(picture.width());
        let measured = (inked(&picture) as f64 / PI).sqrt();
        // Half a pixel: a partially covered pixel counts; the surface is accurate to a hundredth of a voxel.
        assert!((measured - pixels).abs() < 1.0, "{measured} {pixels}");
        // Round: the four ends.
        let middle = f64::from(picture.width()) / 2.0;
        for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let at = |r: f64| {
                picture
                    .pixel((middle + dx * r) as u32, (middle + dy * r) as u32)
                    .unwrap()
            };
            assert!(at(pixels - 3.0) != [255; 3] && at(pixels + 3.0) == [255; 3]);
        }
        // Lit from the upper left.
        let light = |x: f64, y: f64| {
            picture
                .pixel((middle + x * pixels) as u32, (middle + y * pixels) as u32)
                .unwrap()[1]
        };
        assert!(light(-0.4, -0.5) > light(0.4, 0.6));
    }
}

#[test]
fn a_cut_of_half_the_ball_is_flat() {
    let n = 48;
    let values = ball(n, 14.0);
    let volume = Volume {
        values: &values,
        size: [n; 3],
        spacing: 0.1,
    };
    let whole = isosurface(&volume, &iso(0.5)).unwrap();
    // From +x, with everything in front of x = 0 cut away: the same disc, flat.
    let flat = isosurface(
        &volume,
        &IsoView {
            cut: Some(([2.0, 0.0, 0.0], 0.0)),
            ..iso(0.5)
        },
    )
    .unwrap();
    let ratio = inked(&flat) as f64 / inked(&whole) as f64;
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    let middle = flat.width() / 2;
    assert_eq!(
        flat.pixel(middle, middle).unwrap(),
        flat.pixel(middle + 60, middle - 60).unwrap()
    );
    // With the right half, y > 0, removed, half remains.
    let half = isosurface(
        &volume,
        &IsoView {
            cut: Some(([0.0, 1.0, 0.0], 0.0)),
            ..iso(0.5)
        },
    )
    .unwrap();
    let ratio = inked(&half) as f64 / inked(&whole) as f64;
    assert!((ratio - 0.5).abs() < 0.01, "{ratio}");
    assert!(
        half.pixel(middle - 60, middle).unwrap() != [255; 3]
            && half.pixel(middle + 60, middle).unwrap() == [255; 3]
    );
}

#[test]
fn figures_are_bitwise_reproducible_for_any_number_of_threads() {
    let n = 32;
    let values = ball(n, 10.0);
    let volume = Volume {
        values: &values,
        size: [n; 3],
        spacing: 0.5,
    };
    let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(9.0, 3.0));
    let state = WallState {
        title: "rest",
        inner: &inner,
        outer: &outer,
    };
    let draw = || {
        [
            isosurface(&volume, &iso(0.5)).unwrap(),
            bodies(&[state]).unwrap(),
            slice(&volume, Plane::Z(9), [0.0, 1.0], "activity").unwrap(),
            figures::poses(&state, &[("rest", Pose::identity())], View::default()).unwrap(),
        ]
        .map(|p| p.to_png().unwrap())
    };
    let with = |n: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap()
            .install(draw)
    };
    let one = with(1);
    assert!(one == with(1));
    assert!(one == with(3));
}

#[test]
fn the_page_is_one_file_with_all_parts_in_order() {
    let figure = |k: usize| Illustration {
        file: format!("fig {k}.png"),
        caption: format!("Figure {k}: f < 3 & \"quoted\""),
        size: [640, 480],
    };
    let mut page = Page {
        title: "<Study>".into(),
        introduction: vec!["It's <b>plain</b>.".into()],
        sections: vec![
            Section {
                title: "One".into(),
                text: vec!["text".into()],
                figures: vec![figure(1), figure(2)],
                tables: vec![Table {
                    caption: "Numbers".into(),
                    header: vec!["name".into(), "value".into()],
                    rows: vec![vec!["a".into(), "1.5".into()]],
                }],
            },
            Section {
                title: "Two".into(),
                figures: vec![figure(3)],
                ..Section::default()
            },
        ],
    };
    let html = page.to_html().unwrap();
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
    assert!(html.contains("<h1>&lt;Study&gt;</h1>") && html.contains("It's &lt;b&gt;plain"));
    let places: Vec<usize> = [
        "fig%201.png\"><img",
        "fig%202.png\"><img",
        "Numbers",
        "fig%203.png\"><img",
    ]
    .iter()
    .map(|s| html.find(s).unwrap_or_else(|| panic!("{s}")))
    .collect();
    assert!(places.is_sorted());
    assert!(html.contains("f &lt; 3 &amp; &quot;quoted&quot;") && html.contains("<td>1.5</td>"));
    for foreign in ["<script", "http:", "https:", "<link", "@import", "url("] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    page.sections[0].tables[0]
        .rows
        .push(vec!["only one".into()]);
    assert!(matches!(
        page.to_html(),
        Err(StudyError::Phantom(PhantomError::WrongLength {
            given: 1,
            expected: 2,
            ..
        }))
    ));
}

/// Pixels of exactly one colour.
fn of_colour(picture: &Picture, colour: [u8; 3]) -> Vec<(f64, f64)> {
    (0..picture.height())
        .flat_map(|y| (0..picture.width()).map(move |x| (x, y)))
        .filter(|&(x, y)| picture.pixel(x, y).unwrap() == colour)
        .map(|(x, y)| (f64::from(x) + 0.5, f64::from(y) + 0.5))
        .collect()
}

#[test]
fn norms_have_a_logarithmic_axis() {
    let norms = [1e2, 1.0, 1e-2];
    let picture = histories(
        "norm",
        None,
        &[History {
            label: "a",
            norms: &norms,
        }],
    )
    .unwrap();
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
    let of = |label, norms| History { label, norms };
    let picture = histories("norm", None, &[of("long", &long), of("steep", &steep)]).unwrap();
    let blue = of_colour(&picture, [0x00, 0x72, 0xb2]);
    let wide = |y: f64| blue.iter().filter(|p| p.1 == y && p.0 > 120.0).count() >= 13;
    // Below the legend of two rows.
    let rows: Vec<u32> = (100..picture.height())
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
    let runs = (0..picture.width()).scan(0, |run, x| {
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
            (50..picture.height() - 60)
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
        initial: &[[2.0, 0.0], [-2.0, 0.0]],
        solution: &arc,
        centre: [0.0; 2],
        radius: 2.0,
        n_nodes: &[10, 100, 1000],
        errors: &[1e-2, 1e-4, 1e-6],
        order: 2.0,
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
