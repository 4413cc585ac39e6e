//! Random acquisitions: any sizes, units and angle lists, data from 1e-30 to 1e30, occasional NaNs.

use crate::{Outcome, with_threads};
use radon::{
    ArcPolicy, EdgePolicy, FbpOptions, FbpPlan, ImageGrid, Interpolation, Kernel, LinearOperator,
    ParallelGeometry, Projector, StackOrder, Window,
};
use std::f64::consts::PI;
use tests::Random;

pub(crate) fn scene(random: &mut Random) -> Outcome {
    let unit = random.decades(-6.0, 6.0);
    let Some((geometry, grid)) = acquisition(random, unit) else {
        return Outcome::Rejected;
    };
    if random.one_in(2) {
        projector(random, &geometry, &grid)
    } else {
        fbp(random, &geometry, &grid)
    }
}

fn acquisition(random: &mut Random, unit: f64) -> Option<(ParallelGeometry, ImageGrid)> {
    let (n_views, n_bins) = (random.integer(0, 40), random.integer(0, 70));
    let pitch = unit * random_step(random);
    let pitch = random.spoiled(pitch);
    let geometry = if random.one_in(2) {
        let arc = random.pick(&[PI, 2.0 * PI, 1.0, 7.0]);
        ParallelGeometry::arc_radians(n_views, random.spoiled(arc), n_bins, pitch)
    } else {
        let special = [0.0, PI / 4.0, PI / 2.0, PI, -PI, 1e-9];
        let mut angles: Vec<f64> = (0..n_views)
            .map(|_| {
                if random.one_in(4) {
                    random.pick(&special)
                } else {
                    random.angle(-10.0, 10.0)
                }
            })
            .collect();
        if let Some(angle) = angles.first_mut() {
            *angle = random.spoiled(*angle);
        }
        ParallelGeometry::from_radians(angles, n_bins, pitch)
    };
    let offset = unit * random.uniform(-2.0, 2.0);
    let geometry = geometry.ok()?.with_offset(random.spoiled(offset)).ok()?;
    let (nx, ny) = (random.integer(0, 40), random.integer(0, 40));
    let spacing = unit * random_step(random);
    let spacing = random.spoiled(spacing);
    let centre = [
        unit * random.uniform(-9.0, 9.0),
        unit * random.uniform(-9.0, 9.0),
    ];
    // Square, or stretched by up to a hundred.
    let stretch = random.decades(-2.0, 2.0);
    let across = if random.one_in(2) {
        spacing
    } else {
        random.spoiled(spacing * stretch)
    };
    let grid = ImageGrid::anisotropic(nx, ny, [spacing, across])
        .ok()?
        .with_centre(centre)
        .ok()?;
    Some((geometry, grid))
}

fn random_step(random: &mut Random) -> f64 {
    random.pick(&[1.0, 0.5, 3.0, 0.1])
}

/// Random samples of one order of magnitude; the flag is true if all are finite.
fn samples(random: &mut Random, len: usize) -> (Vec<f32>, bool) {
    let scale = random.decades(-30.0, 30.0);
    let mut values: Vec<f32> = (0..len)
        .map(|_| (scale * random.any(-1.0, 1.0)) as f32)
        .collect();
    let mut finite = true;
    if random.one_in(8) && len > 0 {
        let at = random.integer(0, len - 1);
        values[at] = random.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
        finite = false;
    }
    (values, finite)
}

fn fbp(random: &mut Random, geometry: &ParallelGeometry, grid: &ImageGrid) -> Outcome {
    let options = FbpOptions::default()
        .with_window(random.pick(&[
            Window::RamLak,
            Window::Hann,
            Window::SheppLogan,
            Window::Butterworth { order: 3 },
        ]))
        .with_cutoff(random.pick(&[1.0, 0.5, 0.0, -1.0, 1e-3, f64::NAN]))
        .with_interpolation(random.pick(&[Interpolation::Linear, Interpolation::BandLimited]))
        .with_edge(random.pick(&[EdgePolicy::Zero, EdgePolicy::Ellipse]))
        .with_arc(random.pick(&[
            ArcPolicy::Complete,
            ArcPolicy::Extend,
            ArcPolicy::Truncate,
            ArcPolicy::Rescale,
        ]));
    let Ok(plan) = FbpPlan::<f32>::new(geometry, grid, &options) else {
        return Outcome::Rejected;
    };
    let n_slices = random.integer(1, 5);
    let order = random.pick(&[StackOrder::ViewSliceBin, StackOrder::SliceViewBin]);
    let (projections, finite) = samples(random, geometry.sinogram_len() * n_slices);
    let run = |plan: &FbpPlan<f32>, threads| {
        with_threads(threads, || {
            plan.reconstruct_stack(&projections, n_slices, order)
        })
    };
    let Ok(one) = run(&plan, 1) else {
        return Outcome::Rejected;
    };
    assert!(finite, "data that are not finite were accepted");
    let two = run(&plan, 2).expect("as with one thread");
    let same = |a: &[f32]| one.iter().zip(a).all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same(&two));
    assert!(one.iter().all(|x| !x.is_nan()));
    Outcome::Answered
}

fn projector(random: &mut Random, geometry: &ParallelGeometry, grid: &ImageGrid) -> Outcome {
    let kernel = random.pick(&[Kernel::Joseph, Kernel::Strip]);
    let Ok(projector) = Projector::new(geometry, grid, kernel) else {
        return Outcome::Rejected;
    };
    let (image, finite) = samples(random, grid.image_len());
    let forward = |threads| with_threads(threads, || projector.forward(&image));
    let Ok(one) = forward(1) else {
        return Outcome::Rejected;
    };
    assert!(finite, "an image that is not finite was accepted");
    let two = forward(2).expect("as with one thread");
    assert!(
        one.iter()
            .zip(&two)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
    // Sums beyond the largest number of single precision are infinite, and no others.
    let sizes: Vec<f64> = image.iter().map(|x| f64::from(x.abs())).collect();
    let sizes = projector.forward(&sizes).expect("as the image");
    assert!((one.iter().zip(&sizes)).all(|(x, size)| x.is_finite() || *size > 1e38));

    // <A x, y> = <x, A'y> in f64, relative to the sizes of A x and y.
    let x: Vec<f64> = (0..grid.image_len())
        .map(|_| random.any(-1.0, 1.0))
        .collect();
    let y: Vec<f64> = (0..geometry.sinogram_len())
        .map(|_| random.any(-1.0, 1.0))
        .collect();
    let ax = projector.forward(&x).expect("finite");
    let aty = projector.adjoint(&y).expect("finite");
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (left, right) = (dot(&ax, &y), dot(&x, &aty));
    let size = (dot(&ax, &ax) * dot(&y, &y)).sqrt();
    assert!(
        (left - right).abs() <= 1e-12 * size,
        "{left} and {right} of {size}"
    );
    Outcome::Answered
}
