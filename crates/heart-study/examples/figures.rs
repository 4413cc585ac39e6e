//! Draws every figure from artificial data: `cargo run --release -p heart-study --example figures -- DIR`.

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use heart_phantom::files::Section;
use heart_phantom::revolve_voxel::Pose;
use heart_study::StudyError;
use heart_study::figures::*;

/// A cylinder with a spherical cap, inflated by `g`; nodes at equal steps of arc length.
fn balloon(radius: f64, g: f64, n: usize) -> Vec<[f64; 2]> {
    let h = 8.5;
    let length = 2.0 * h + PI * radius;
    (0..n)
        .map(|i| {
            let s = length * i as f64 / (n - 1) as f64;
            let [x, y] = if s < h {
                [s, radius]
            } else if s > length - h {
                [length - s, -radius]
            } else {
                let a = (s - h) / radius;
                [h + radius * a.sin(), radius * a.cos()]
            };
            let swell = g * (PI * i as f64 / (n - 1) as f64).sin().powf(0.8);
            [x + 0.35 * x / h * swell, y * (1.0 + 0.4 * swell)]
        })
        .collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "figures".into()));
    std::fs::create_dir_all(&out)?;
    let start = std::time::Instant::now();
    let save = |name: &str, picture: Picture| -> Result<(), StudyError> {
        let drawn = start.elapsed();
        picture.write_png(out.join(name))?;
        println!(
            "{name:28} {picture:?} at {drawn:.1?}, written at {:.1?}",
            start.elapsed()
        );
        Ok(())
    };

    let curves: Vec<_> = (0..7)
        .map(|k| balloon(1.75, f64::from(k) * 0.3, 201))
        .collect();
    let family: Vec<Shape<'_>> = curves
        .iter()
        .enumerate()
        .map(|(k, nodes)| Shape {
            nodes,
            load: 5.0 * k as f64,
            area: 34.56 + 6.2 * k as f64,
            volume: 93.0 + 22.5 * k as f64,
        })
        .collect();
    save("fig08-shapes.png", shapes(&family)?)?;

    let printed: Vec<f64> = (0..=60)
        .map(|k| 9.1 + 5.0 * (f64::from(k) * 1.7).sin().abs() + 12.0 / f64::from(k + 1))
        .collect();
    let right = [18.0, 0.27, 6.6e-6, 3e-14];
    let series = [
        ("Newton, Jacobian as printed in Eq. 14", &printed[..]),
        ("Newton, exact Jacobian", &right[..]),
    ];
    save(
        "fig08-newton.png",
        histories("‖F(c)‖", Some(1e-10), &series)?,
    )?;

    let large: Vec<f64> = (0..12).map(|k| 240.0 * 0.25f64.powi(k)).collect();
    let small: Vec<f64> = (0..120)
        .map(|k| 240.0 * (-0.12 * f64::from(k)).exp() * (1.2 + (f64::from(k) * 0.35).sin()))
        .collect();
    let series = [
        ("Δt = 2 s, falls at every step", &large[..]),
        ("Δt = 0.25 s, swings like the wave it is", &small[..]),
    ];
    save(
        "fig10-norm.png",
        histories("‖F_p + F_e‖", Some(1e-4), &series)?,
    )?;

    let frames: Vec<Vec<[f64; 2]>> = (0..4)
        .map(|k| balloon(1.75, f64::from(k) * 0.4, 201))
        .collect();
    let forces: Vec<[Vec<[f64; 2]>; 2]> = frames
        .iter()
        .enumerate()
        .map(|(k, c)| {
            let n = c.len();
            let pressure: Vec<[f64; 2]> = (0..n)
                .map(|i| {
                    let (a, b) = (c[i.saturating_sub(1)], c[(i + 1).min(n - 1)]);
                    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                    let r = dx.hypot(dy);
                    [-17.0 * dy / r, 17.0 * dx / r]
                })
                .collect();
            let part = k as f64 / 3.0;
            let elastic = pressure
                .iter()
                .map(|p| [-part * p[0], -part * p[1]])
                .collect();
            [elastic, pressure]
        })
        .collect();
    let shown: Vec<ForceFrame<'_>> = frames
        .iter()
        .zip(&forces)
        .zip([0, 1, 3, 9])
        .map(|((nodes, [elastic, pressure]), iteration)| ForceFrame {
            iteration,
            nodes,
            elastic,
            pressure,
        })
        .collect();
    save("fig09-forces.png", force_frames(&shown)?)?;

    let pairs: Vec<_> = [0.0, 0.5, 1.0]
        .iter()
        .map(|&g| (balloon(1.75, g, 201), balloon(2.75, 0.55 * g, 201)))
        .collect();
    let titles = ["gain 0", "gain 0.3", "gain 0.6"];
    let states: Vec<WallState<'_>> = pairs
        .iter()
        .zip(titles)
        .map(|((inner, outer), title)| WallState {
            title,
            inner,
            outer,
        })
        .collect();
    save("fig11-wall.png", wall_meshes(&states, 6, 60)?)?;

    save("fig12-bodies.png", bodies(&[states[0], states[2]])?)?;
    let upright = Pose::axis_along_z(5.625)?;
    let turned = upright.rotated_x(PI / 4.0)?.rotated_y(PI / 4.0)?;
    let both = [
        ("axis along z", upright),
        ("rotated 45° about x, then y", turned),
    ];
    save("fig13-pose.png", poses(&states[0], &both, View::default())?)?;

    let arc: Vec<[f64; 2]> = (0..101)
        .map(|k| PI * 1.49 + (TAU - 1.0) * f64::from(k) / 100.0)
        .map(|a| [1.3 * a.cos(), 1.3 * a.sin()])
        .collect();
    let line = [arc[0], arc[100]];
    let n_nodes = [26, 51, 101, 201, 401, 801];
    let errors: Vec<f64> = n_nodes
        .iter()
        .map(|&n| 9.0 / f64::from(n).powi(2))
        .collect();
    let study = CircleStudy {
        initial: &line,
        solution: &arc,
        centre: [0.0, 0.0],
        radius: 1.3,
        n_nodes: &n_nodes.map(|n| n as usize),
        errors: &errors,
        order: 2.0,
    };
    save("fig18-circle.png", circle(&study)?)?;

    // An oblique, off-centre ball with a hole: chords in closed form, samples of a volume.
    let n = 256;
    let pitch = 0.0625;
    let at = |k: usize| (k as f64 - 127.5) * pitch;
    let chord = |s: f64, z: f64, r: f64| 2.0 * (r * r - s * s - z * z).max(0.0).sqrt();
    let views: Vec<(f64, Vec<f32>)> = [0.0, PI / 3.0, PI / 1.5]
        .map(|theta: f64| {
            let centre = 1.5 * theta.cos() + 0.5 * theta.sin();
            let values = (0..n * n).map(|i| {
                let (s, z) = (at(i % n) - centre, at(i / n) - 1.0);
                (chord(s, z, 4.0) - chord(s, z, 2.8)) as f32
            });
            (theta, values.collect())
        })
        .to_vec();
    let images: Vec<Projection<'_>> = views
        .iter()
        .map(|(angle, values)| Projection {
            angle: *angle,
            values,
        })
        .collect();
    save("fig14-projections.png", projections(&images, n, pitch)?)?;

    let values: Vec<f32> = (0..n * n * n)
        .map(|i| {
            let (x, y, z) = (at(i % n) - 1.5, at(i / n % n) - 0.5, at(i / n / n) - 1.0);
            let r = (x * x + y * y + z * z * (1.0 - 0.04 * z)).sqrt();
            let streak = 0.12 * (20.0 * y.atan2(x)).sin() * (-0.3 * r).exp();
            let edge = |a: f64| 1.0 / (1.0 + ((r - a) / 0.03).exp());
            (edge(4.0) - edge(2.8) + streak) as f32
        })
        .collect();
    let volume = Volume {
        values: &values,
        size: [n, n, n],
        spacing: pitch,
    };
    save(
        "fig15a-slice.png",
        slices(&volume, &[Section::Axial(140)], [-0.25, 1.25], "activity")?,
    )?;
    let planes = [90, 110, 130, 150, 170, 190].map(Section::Axial);
    save(
        "fig15b-slices.png",
        slices(&volume, &planes, [-0.25, 1.25], "activity")?,
    )?;

    let direction = View {
        azimuth: 0.5,
        elevation: 0.35,
    };
    let whole = IsoView {
        level: 0.5,
        view: direction,
        cut: None,
    };
    save("fig15c-surface.png", isosurface(&volume, &whole)?)?;
    let open = IsoView {
        cut: Some(([1.0, 0.0, 0.0], 1.5)),
        ..whole
    };
    save("fig15c-open.png", isosurface(&volume, &open)?)?;

    let figures = [
        "fig08-shapes.png",
        "fig10-norm.png",
        "fig14-projections.png",
        "fig15a-slice.png",
    ];
    let introduction = "Two balloons, solved & drawn; the <numbers> stand below.";
    let mut page = Page::new(
        &out,
        "A beating heart: the study",
        vec![introduction.into()],
    );
    for (k, file) in figures.iter().enumerate() {
        let text = "What is shown, and how it was computed, in a sentence or two.";
        page.section(&format!("Part {}", k + 1), text);
        let caption = format!("Figure {}. A caption that describes the figure.", k + 1);
        page.figure(file, [1366, 553], caption);
        page.table(
            "Closed forms and discrete values.",
            &["", "length (cm)", "area (cm²)", "volume (cm³)"],
            vec![
                ["inner", "22.498", "34.561", "93.011"]
                    .map(String::from)
                    .to_vec(),
            ],
        );
    }
    page.write()?;
    Ok(())
}
