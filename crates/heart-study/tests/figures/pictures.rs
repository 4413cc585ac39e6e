//! Figures as files: orientation, scale, reproducibility.

mod panels;

use std::f64::consts::PI;
use std::path::PathBuf;
use std::slice::from_ref;

use heart_phantom::files::{self, Section};
use heart_phantom::revolve_voxel::{Pose, VoxelGrid};
use heart_phantom::{Phantom, PhantomError, Scene};

use super::*;
use crate::figures;
use crate::html::Page;

#[test]
fn files_are_written_completely_and_restored_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let picture = histories("norm", None, &[("a", &[1.0, 0.1])]).unwrap();
    let path = folder.path().join("a.png");
    picture.write_png(&path).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut rgb).unwrap();
    assert_eq!((frame.width, frame.height), (picture.width, picture.height));
    assert_eq!(frame.color_type, png::ColorType::Rgb);
    assert!(rgb == picture.rgb);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

    let nowhere = folder.path().join("no/folder/a.png");
    assert!(matches!(
        picture.write_png(&nowhere),
        Err(PhantomError::File { .. })
    ));
    let page = Page::new(&nowhere, "", Vec::new());
    assert!(matches!(page.write(), Err(PhantomError::File { .. })));
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
    for j in 0..picture.height {
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
fn a_slice_has_x_to_the_right_and_the_front_on_top() {
    let (nz, ny, nx) = (4, 6, 8);
    let mut values = vec![0.0f32; nz * ny * nx];
    // One voxel: x = 6 of 8, y = 4 of 6, z = 1 of 4.
    values[(ny + 4) * nx + 6] = 1.0;
    let grid = VoxelGrid::centred([nx, ny, nz], [1.0; 3], [0.0; 3]).unwrap();
    let volume = Volume {
        grid,
        values: &values,
    };
    // Centres of voxels, as fractions of the panel from the left and from the top; one pixel is below 1/300.
    let close = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 4e-3 && (a.1 - b.1).abs() < 4e-3;
    // +y is the back of a patient.
    let figure = lit(&images(&[slice(&volume, 1)], [0.0, 1.0], "").unwrap());
    assert!(close(figure, (6.5 / 8.0, 4.5 / 6.0)), "{figure:?}");

    // The plain images of the same volume have the same orientation.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let plain = files::Volume::new(grid, values.as_slice()).unwrap();
    files::write_png(&path, &plain, Section::Axial(1), [0.0, 1.0]).unwrap();
    let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut shades = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut shades).unwrap();
    let (width, height) = (frame.width as usize, frame.height as usize);
    let at = shades.iter().position(|&shade| shade == 255).unwrap();
    let share = |at: usize, of: usize| (at as f64 + 0.5) / of as f64;
    let found = (share(at % width, width), share(at / width, height));
    assert!(close(found, figure), "{found:?} {figure:?}");
}

/// The centre of the white pixels of a slice's panel, as fractions from its left and from its top.
fn lit(picture: &Picture) -> (f64, f64) {
    // The panel is the black rectangle; the bar is to its right, beyond a white gap.
    let row_of = |j: u32| {
        (0..picture.width - 175)
            .filter(|&i| picture.pixel(i, j).unwrap() == [0; 3])
            .collect::<Vec<_>>()
    };
    let rows: Vec<(u32, Vec<u32>)> = (0..picture.height)
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
    let middle = 0.5 * f64::from(picture.width);
    (0..picture.height)
        .flat_map(|y| (0..picture.width).map(move |x| (x, y)))
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
    let volume = cube(&values, n, spacing);
    for view in [
        FRONT,
        View {
            azimuth: 1.0,
            elevation: 0.6,
        },
    ] {
        let picture = isosurface(volume, &IsoView { view, ..iso(0.5) }).unwrap();
        // The image spans 0.85 of the volume.
        let pixels = radius / (0.85 * n as f64) * f64::from(picture.width);
        let measured = (inked(&picture) as f64 / PI).sqrt();
        // Half a pixel: a partially covered pixel counts; the surface is accurate to a hundredth of a voxel.
        assert!((measured - pixels).abs() < 1.0, "{measured} {pixels}");
        // Round: the four ends.
        let middle = f64::from(picture.width) / 2.0;
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
    let volume = cube(&values, n, 0.1);
    let whole = isosurface(volume, &iso(0.5)).unwrap();
    // From +x, with everything in front of x = 0 cut away: the same disc, flat.
    let flat = isosurface(
        volume,
        &IsoView {
            cut: Some(([2.0, 0.0, 0.0], 0.0)),
            ..iso(0.5)
        },
    )
    .unwrap();
    let ratio = inked(&flat) as f64 / inked(&whole) as f64;
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    let middle = flat.width / 2;
    assert_eq!(
        flat.pixel(middle, middle).unwrap(),
        flat.pixel(middle + 60, middle - 60).unwrap()
    );
    // With the right half, y > 0, removed, half remains.
    let half = isosurface(
        volume,
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
    let volume = cube(&values, n, 0.5);
    let (inner, outer) = (half_ellipse(8.0, 2.0), half_ellipse(9.0, 3.0));
    let state = WallState {
        title: "rest",
        inner: &inner,
        outer: &outer,
    };
    let draw = || {
        [
            isosurface(volume, &iso(0.5)).unwrap(),
            bodies(&[state]).unwrap(),
            images(&[slice(&volume, 9)], [0.0, 1.0], "activity").unwrap(),
            figures::poses(&state, &[("rest", Pose::identity())], FRONT).unwrap(),
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
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::new(folder.path(), "<Study>", vec!["It's <b>plain</b>.".into()]);
    let figure = |page: &mut Page, k: usize| {
        let caption = format!("Figure {k}: f < 3 & \"quoted\"");
        page.figure(&format!("fig{k}.png"), [640, 480], caption);
    };
    page.section("One", "text");
    figure(&mut page, 1);
    figure(&mut page, 2);
    let rows = vec![vec!["a".into(), "1.5".into()]];
    page.table("Numbers", &["name", "value"], rows);
    page.section("Two", "more");
    figure(&mut page, 3);
    let html = page.to_html();
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n"));
    assert!(html.contains("<h1>&lt;Study&gt;</h1>") && html.contains("It's &lt;b&gt;plain"));
    let places: Vec<usize> = [
        "fig1.png\"><img",
        "fig2.png\"><img",
        "Numbers",
        "fig3.png\"><img",
    ]
    .iter()
    .map(|s| html.find(s).unwrap_or_else(|| panic!("{s}")))
    .collect();
    assert!(places.is_sorted());
    assert!(html.contains("f &lt; 3 &amp; &quot;quoted&quot;") && html.contains("<td>1.5</td>"));
    for foreign in ["<script", "http:", "https:", "<link", "@import", "url("] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    let files = ["fig1.png", "fig2.png", "fig3.png", Page::FILE];
    assert_eq!(page.write().unwrap(), files.map(PathBuf::from));
}

/// Zeros, single values and membranes without forces are drawn; curves reject infinity, of which no axis has steps.
#[test]
fn unusual_data_are_drawn() {
    histories("", None, &[("", &[0.0])]).unwrap();
    let nodes = half_ellipse(8.0, 2.0);
    let still = vec![[0.0; 2]; nodes.len()];
    let rest = ForceFrame {
        iteration: 0,
        nodes: &nodes,
        elastic: &still,
        pressure: &still,
    };
    force_frames(&[rest]).unwrap();
    let phantom = Phantom::new(Scene::default().with_size(8)).unwrap();
    let dark = projection(String::new(), phantom.camera(), &[0.0; 64]);
    assert_eq!(window(from_ref(&dark)), [0.0, 1.0]);
    images(&[dark], [0.0, 1.0], "").unwrap();
    for value in [f64::NAN, f64::INFINITY] {
        let curve = ("", [[0.0, 1.0], [1.0, value]]);
        assert!(matches!(
            curves("", "", &[curve]),
            Err(PhantomError::OutOfRange { .. })
        ));
    }
}

/// Six grey sections, the lower three of a smaller region: their images have equal sizes and nothing on them, and ticks at three positions
/// at least.
#[test]
fn sections_fill_their_panels_with_letters_outside() {
    let cut = |half: f64| Cut {
        title: String::new(),
        labels: ["cm".into(), "cm".into()],
        marks: ["RAI", "LPS", "IP", "SA"].map(String::from),
        size: [4; 2],
        values: vec![0.6; 16],
        extent: [[-half, half]; 2],
    };
    let cuts = [20.5, 20.5, 20.5, 6.4, 6.4, 6.4].map(cut);
    let picture = sections(&cuts, [0.0, 1.0], "", "").unwrap();
    let is_grey = |x: u32, y: u32| picture.pixel(x, y).unwrap() == [153; 3];
    let columns = |y: u32| -> Vec<u32> { (0..picture.width).filter(|&x| is_grey(x, y)).collect() };
    // The colour bar has a row of this grey.
    let of_images = |y: &u32| columns(*y).len() > 600;
    let rows: Vec<u32> = (0..picture.height).filter(of_images).collect();
    let side = rows.len() / 2;
    assert!(side >= 300 && 6 * side * side * 3 > (picture.width * picture.height) as usize);
    let (above, below) = (columns(rows[1]), columns(rows[side + 1]));
    assert!(above == below && above.len() == 3 * side);
    for row in [&rows[..side], &rows[side..]] {
        assert_eq!(row[side - 1] - row[0], side as u32 - 1);
        assert!(row.iter().all(|&y| columns(y).len() >= 3 * side));
        for left in [0, 1, 2].map(|k| above[k * side]) {
            // Ticks below the frame, which is the first dark row below the image.
            let is_dark = |x: u32, y: u32| picture.pixel(x, y).unwrap()[0] < 0xc0;
            let middle = left + side as u32 / 4 + 3;
            let frame = (row[side - 1] + 1..).find(|&y| is_dark(middle, y)).unwrap();
            let dark = |x: u32| is_dark(x, frame + 4);
            let ticks = (left..left + side as u32).filter(|&x| dark(x) && !dark(x - 1));
            assert!(ticks.count() >= 3);
        }
    }
}
