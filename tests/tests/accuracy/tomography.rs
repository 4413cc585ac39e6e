//! Reconstruction and projectors.

use crate::Row;
use radon::{
    ArcPolicy, CglsOptions, EmOptions, FbpMethod, FbpOptions, FbpPlan, FourierProjector, ImageGrid,
    Kernel, LinearOperator, ParallelGeometry, Projector, RadonError, SirtOptions, Stopping, cgls,
    mlem, padded_len, sirt,
};
use std::f64::consts::PI;
use tests::Random;

pub(crate) const ROWS: &[Row] = &[
    Row {
        name: "radon::FbpMethod::Fourier::tolerance",
        what: "back-projected image",
        reference: "direct sums of cosines over frequencies, bins and views",
        norm: "L2, relative",
        quick: 30,
        problem: fourier_back_projection,
    },
    Row {
        name: "radon::FourierProjector::tolerance",
        what: "sinogram",
        reference: "direct sum over frequencies and pixels",
        norm: "L2, relative",
        quick: 30,
        problem: fourier_projection,
    },
    Row {
        name: "radon::Stopping::residual",
        what: "residual of the returned image",
        reference: "direct sums over the entries of the matrix",
        norm: "L2, relative to the data",
        quick: 40,
        problem: residual_rule,
    },
    Row {
        name: "radon::CglsOptions::gradient",
        what: "gradient at the returned image",
        reference: "direct sums over the entries of the matrix",
        norm: "L2, relative to the gradient of the data",
        quick: 40,
        problem: gradient_rule,
    },
];

/// A random acquisition and a random grid, both centred off the axis, the grid's centre within the field of view.
fn geometry(random: &mut Random) -> (ParallelGeometry, ImageGrid) {
    let n_views = random.integer(1, 9);
    let angles: Vec<f64> = (0..n_views).map(|_| random.uniform(-4.0, 4.0)).collect();
    let (n_bins, pitch) = (random.integer(3, 40), random.uniform(0.2, 1.0));
    let off = 0.15 * n_bins as f64 * pitch;
    let geometry = ParallelGeometry::from_radians(angles, n_bins, pitch)
        .expect("a pitch above zero")
        .with_offset(random.uniform(-off, off))
        .expect("a finite offset");
    let spacing = [0; 2].map(|_| pitch * random.uniform(0.3, 3.0));
    let grid = ImageGrid::anisotropic(random.integer(3, 28), random.integer(3, 28), spacing)
        .expect("pixels above zero")
        .with_centre([0; 2].map(|_| random.uniform(-off, off)))
        .expect("a finite centre");
    (geometry, grid)
}

/// Noise of mean zero or of positive values, or a smooth blob near the middle, which detector and image both contain.
fn samples(random: &mut Random, n: usize, row: usize) -> Vec<f64> {
    let kind = random.integer(0, 2);
    let (centre, width) = (random.uniform(0.4, 0.6), random.uniform(0.1, 0.3));
    let of = |i: usize| {
        let at = |i: usize, n: usize| (i as f64 / n as f64 - centre) / width;
        (-at(i % row, row).powi(2) - at(i / row, n / row).powi(2)).exp()
    };
    (0..n)
        .map(|i| match kind {
            0 => random.uniform(-1.0, 1.0),
            1 => random.uniform(0.0, 1.0),
            _ => of(i),
        })
        .collect()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    norm(&difference)
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// Cosine and sine sums of values at some positions, for one frequency.
fn wave(values: impl Iterator<Item = (f64, f64)>, frequency: f64) -> [f64; 2] {
    values.fold([0.0; 2], |[re, im], (value, at)| {
        let phase = 2.0 * PI * frequency * at;
        [re + value * phase.cos(), im - value * phase.sin()]
    })
}

fn at_wave([re, im]: [f64; 2], frequency: f64, at: f64) -> f64 {
    let phase = 2.0 * PI * frequency * at;
    re * phase.cos() - im * phase.sin()
}

/// The pixels of an image and their distances along a view.
fn along<'a>(
    grid: &'a ImageGrid,
    image: &'a [f64],
    theta: f64,
) -> impl Iterator<Item = (f64, f64)> + Clone + 'a {
    let (sin, cos) = theta.sin_cos();
    image.iter().enumerate().map(move |(i, value)| {
        let [x, y] = grid.pixel_centre(i % grid.nx(), i / grid.nx());
        (*value, x * cos + y * sin)
    })
}

/// The band limit of an image's projection, in waves per bin, with the same rounding as in the operator, which determines the last frequency.
fn band(geometry: &ParallelGeometry, grid: &ImageGrid, theta: f64) -> f64 {
    let ([dx, dy], (sin, cos)) = (grid.spacing(), theta.sin_cos());
    0.5 * geometry.pitch() / (dx * cos.abs()).max(dy * sin.abs())
}

fn fourier_back_projection(random: &mut Random) -> Option<f64> {
    let (geometry, grid) = geometry(random);
    let rows = samples(random, geometry.sinogram_len(), geometry.n_bins());
    let tolerance = random.decades(-6.0, -2.0);
    let options = FbpOptions::default()
        .with_ramp(false)
        .with_arc(ArcPolicy::Rescale)
        .with_method(FbpMethod::Fourier { tolerance });
    let plan = FbpPlan::<f64>::new(&geometry, &grid, &options).ok()?;
    let found = plan.reconstruct(&rows).ok()?;
    // The period of the plan, which keeps copies of a row out of the image.
    let farthest = (0..grid.image_len())
        .map(|i| grid.pixel_centre(i % grid.nx(), i / grid.nx()))
        .fold(0.0_f64, |most, [x, y]| most.max(x.hypot(y)));
    let n = geometry.n_bins() as f64;
    let reach = (farthest + geometry.offset().abs()) / geometry.pitch();
    let least = (n / 2.0 + reach + 2.0).max(n + 2.0);
    let period = padded_len(least.ceil() as usize).ok()?;
    let weights = geometry.view_weights(ArcPolicy::Rescale).ok()?;
    let mut expected = vec![0.0; grid.image_len()];
    for (view, &theta) in geometry.angles().iter().enumerate() {
        let row = &rows[view * geometry.n_bins()..][..geometry.n_bins()];
        let bins = row.iter().enumerate();
        let bins = bins.map(|(k, value)| (*value, geometry.bin_centre(k)));
        for i in -(period as i64)..=period as i64 {
            let waves = i as f64 / period as f64;
            let frequency = waves / geometry.pitch();
            let gain = weights[view] * sinc(waves).powi(2) / period as f64;
            let sums = wave(bins.clone(), frequency);
            for (pixel, (_, at)) in expected.iter_mut().zip(along(&grid, &found, theta)) {
                *pixel += gain * at_wave(sums, frequency, at);
            }
        }
    }
    Some(distance(&found, &expected) / (tolerance * norm(&expected)))
}

fn fourier_projection(random: &mut Random) -> Option<f64> {
    let (geometry, grid) = geometry(random);
    let image = samples(random, grid.image_len(), grid.nx());
    let tolerance = random.decades(-6.0, -2.0);
    let projector = FourierProjector::<f64>::new(&geometry, &grid, tolerance).ok()?;
    let found = projector.forward(&image).ok()?;
    let (period, [dx, dy]) = (projector.period() as f64, grid.spacing());
    let mut expected = Vec::new();
    for &theta in geometry.angles() {
        let mut row = vec![0.0; geometry.n_bins()];
        let most = (band(&geometry, &grid, theta) * period) as i64;
        for i in -most..=most {
            let waves = i as f64 / period;
            let frequency = waves / geometry.pitch();
            let gain = dx * dy / geometry.pitch() * sinc(waves) / period;
            let sums = wave(along(&grid, &image, theta), frequency);
            for (k, value) in row.iter_mut().enumerate() {
                *value += gain * at_wave(sums, frequency, geometry.bin_centre(k));
            }
        }
        expected.extend(row);
    }
    Some(distance(&found, &expected) / (tolerance * norm(&expected)))
}

/// A projector as a matrix `[datum][pixel]`, from its columns.
fn matrix(projector: &Projector) -> Vec<Vec<f64>> {
    let n = projector.grid().image_len();
    let mut rows = vec![vec![0.0; n]; projector.geometry().sinogram_len()];
    for pixel in 0..n {
        let mut image = vec![0.0; n];
        image[pixel] = 1.0;
        let column = projector.forward(&image).expect("finite pixels");
        for (row, value) in rows.iter_mut().zip(column) {
            row[pixel] = value;
        }
    }
    rows
}

fn residual(matrix: &[Vec<f64>], image: &[f64], data: &[f64]) -> Vec<f64> {
    let product = |row: &Vec<f64>| row.iter().zip(image).map(|(a, x)| a * x).sum::<f64>();
    (matrix.iter().zip(data))
        .map(|(row, b)| b - product(row))
        .collect()
}

fn gradient(matrix: &[Vec<f64>], data: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; matrix[0].len()];
    for (row, b) in matrix.iter().zip(data) {
        for (sum, a) in sums.iter_mut().zip(row) {
            *sum += a * b;
        }
    }
    sums
}

/// A projector, its matrix, and data of a positive image with noise.
fn system(random: &mut Random) -> Option<(Projector, Vec<Vec<f64>>, Vec<f64>)> {
    let (geometry, grid) = geometry(random);
    let kernel = [Kernel::Joseph, Kernel::Strip][random.integer(0, 1)];
    let projector = Projector::new(&geometry, &grid, kernel).ok()?;
    let matrix = matrix(&projector);
    let truth: Vec<f64> = (0..grid.image_len())
        .map(|_| random.uniform(0.0, 1.0))
        .collect();
    let zeros = vec![0.0; matrix.len()];
    let noise = random.decades(-3.0, -1.0);
    let data = residual(&matrix, &truth, &zeros).into_iter();
    let data = data.map(|b| -b * (1.0 + noise * random.uniform(-1.0, 1.0)));
    Some((projector, matrix, data.collect()))
}

fn residual_rule(random: &mut Random) -> Option<f64> {
    let (projector, matrix, data) = system(random)?;
    let rule = random.decades(-2.5, -0.3);
    let stopping = Stopping::default()
        .with_max_iterations(300)
        .with_residual(rule);
    let operator: &dyn LinearOperator<f64> = &projector;
    let mut image = vec![1.0; operator.image_len()];
    let report: Result<_, RadonError> = match random.integer(0, 2) {
        0 => cgls(
            operator,
            &data,
            &mut image,
            &CglsOptions::default().with_stopping(stopping),
            radon::no_observer,
        ),
        1 => sirt(
            operator,
            &data,
            &mut image,
            &SirtOptions::default().with_stopping(stopping),
            radon::no_observer,
        ),
        _ => mlem(
            operator,
            &data,
            &mut image,
            &EmOptions::default().with_stopping(stopping),
            radon::no_observer,
        ),
    };
    report.ok()?;
    if norm(&data) == 0.0 {
        return None;
    }
    Some(norm(&residual(&matrix, &image, &data)) / (rule * norm(&data)))
}

fn gradient_rule(random: &mut Random) -> Option<f64> {
    let (projector, matrix, data) = system(random)?;
    let rule = random.decades(-8.0, -1.0);
    let stopping = Stopping::default().with_max_iterations(300);
    let options = CglsOptions::default()
        .with_stopping(stopping)
        .with_gradient(rule);
    let mut image = vec![0.0; projector.grid().image_len()];
    cgls(&projector, &data, &mut image, &options, radon::no_observer).ok()?;
    let scale = norm(&gradient(&matrix, &data));
    if scale == 0.0 {
        return None;
    }
    let at_end = gradient(&matrix, &residual(&matrix, &image, &data));
    Some(norm(&at_end) / (rule * scale))
}
