//! The SPECT operator against closed forms: counts and moments of points, attenuated cylinders, blurred hills, recovery by OSEM.

use std::f64::consts::PI;

use radon::{
    Collimator, EmOptions, ImageGrid, LinearOperator, ParallelGeometry, ParallelHoles, Phantom3,
    RadonError, Shape2, Shape3, SliceAxis, SpectGeometry, SpectOperator, SpectOptions, Stopping,
    osem,
};

fn forward(operator: &SpectOperator<f64>, volume: &[f64]) -> Vec<f64> {
    let mut views = vec![0.0; operator.data_len()];
    operator.forward_into(volume, &mut views).unwrap();
    views
}

/// Sum, means and variances along bins and rows, in cm, of a view `[row][bin]`.
fn moments(view: &[f64], geometry: &SpectGeometry) -> (f64, [f64; 2], [f64; 2]) {
    let n_bins = geometry.views().n_bins();
    let place = |i: usize| {
        let (row, bin) = (i / n_bins, i % n_bins);
        [
            geometry.views().bin_centre(bin),
            geometry.rows().slice_centre(row),
        ]
    };
    let sum: f64 = view.iter().sum();
    let mean = |of: &dyn Fn(usize) -> f64| -> f64 {
        view.iter().enumerate().map(|(i, x)| x * of(i)).sum::<f64>() / sum
    };
    let means = [0, 1].map(|axis| mean(&|i| place(i)[axis]));
    let variances = [0, 1].map(|axis| mean(&|i| (place(i)[axis] - means[axis]).powi(2)));
    (sum, means, variances)
}

/// An off-centre voxel in views perpendicular to its faces: it fills one cell, whose variance is that of the collimator averaged over the
/// depth of the cell. Bins and rows of any pitch; planes that are nodes and planes between them.
#[test]
fn a_voxel_has_the_variance_of_the_response_at_its_distance() {
    let h = 0.4;
    let views = ParallelGeometry::full_turn(4, 96, 0.2).unwrap();
    let rows = SliceAxis::new(128, 0.2).unwrap();
    let geometry = SpectGeometry::new(&views, &rows, [9.0, 10.0, 12.0, 11.0]).unwrap();
    let grid = ImageGrid::square(20, h).unwrap();
    let layers = SliceAxis::new(5, h).unwrap();
    let collimator = Collimator::new(0.04, 0.06, 0.14).unwrap();
    let plan = |collimator| {
        let options = SpectOptions::default().with_collimator(collimator);
        SpectOperator::new(&geometry, &grid, &layers, &options).unwrap()
    };
    let (blurred, sharp) = (plan(collimator), plan(Collimator::default()));
    for [ix, iy] in [[7, 12], [10, 3], [14, 14]] {
        let mut volume = vec![0.0; 5 * 400];
        volume[2 * 400 + iy * 20 + ix] = 1.0;
        let (with, without) = (forward(&blurred, &volume), forward(&sharp, &volume));
        let [x, y] = grid.pixel_centre(ix, iy);
        for view in 0..4 {
            let part = view * geometry.view_len()..(view + 1) * geometry.view_len();
            let (sum, at, wide) = moments(&with[part.clone()], &geometry);
            let (whole, place, own) = moments(&without[part], &geometry);
            // The voxel's volume, per square of a bin.
            assert!((whole / (h.powi(3) / 0.04) - 1.0).abs() < 1e-13);
            // Contributions beyond five standard deviations are truncated.
            assert!((sum / whole - 1.0).abs() < 1e-6, "{sum} {whole}");
            let (sin, cos) = views.angles()[view].sin_cos();
            let expected = [x * cos + y * sin, layers.slice_centre(2)];
            let distance = geometry.radii()[view] + x * sin - y * cos;
            let variance = collimator.variance(distance) + (0.04 * h).powi(2) / 12.0;
            for axis in 0..2 {
                assert!((at[axis] - expected[axis]).abs() < 1e-12);
                assert!((place[axis] - expected[axis]).abs() < 1e-12);
                let found = wide[axis] - own[axis];
                assert!((found / variance - 1.0).abs() < 1e-6, "{found} {variance}");
            }
        }
    }
}

/// A Gaussian of 0.8 cm behind a collimator: the variance of a view exceeds that of the projection by h^2/12 for the bins, and where the grid is
/// oblique to the view by h^2/6 for the voxels.
#[test]
fn voxels_widen_oblique_views_by_a_sixth_of_their_area() {
    let (centre, s) = ([0.4, 0.7, 0.1], 0.8);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let hill = Shape3::gaussian(centre, [s; 3], axes).unwrap();
    let hill = Phantom3::new([(1.0, hill)]).unwrap();
    let collimator = Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38).unwrap();
    let angles = [
        0.0, 90.0, 180.0, 1.0, 5.0, 10.0, 22.5, 45.0, 67.5, 80.0, 100.0, 250.0,
    ];
    for (n, h) in [(28, 0.5), (56, 0.25)] {
        let views = ParallelGeometry::from_degrees(&angles, n, h).unwrap();
        let axis = SliceAxis::new(n, h).unwrap();
        let grid = ImageGrid::square(n, h).unwrap();
        let geometry = SpectGeometry::circular(&views, &axis, 12.0).unwrap();
        let options = SpectOptions::default().with_collimator(collimator);
        let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
        let found = forward(&operator, &hill.volume(&grid, &axis).unwrap());
        for (view, theta) in views.angles().iter().enumerate() {
            let part = view * geometry.view_len()..(view + 1) * geometry.view_len();
            let (_, _, wide) = moments(&found[part], &geometry);
            let distance = 12.0 + centre[0] * theta.sin() - centre[1] * theta.cos();
            let expected = s * s + collimator.variance(distance) + (collimator.slope() * s).powi(2);
            let excess = wide.map(|wide| (wide - expected) / (h * h));
            println!("h {h}, {} degrees: {excess:.4?} h^2", angles[view]);
            // Within 10 degrees of the grid many rows of voxels share a position in their bins.
            let voxels = match angles[view] % 90.0 {
                0.0 => 0.0..=0.0,
                15.0..75.0 => 1.0 / 6.0..=1.0 / 6.0,
                _ => 0.0..=1.0 / 6.0,
            };
            let own = excess[0] - 1.0 / 12.0;
            assert!(
                own > voxels.start() - 0.01 && own < voxels.end() + 0.01,
                "{excess:?}"
            );
            assert!((excess[1] - 1.0 / 12.0).abs() < 0.01, "{excess:?}");
        }
    }
}

/// Presets: the formula at 10 cm, by hand.
#[test]
fn the_response_of_a_collimator_follows_from_its_holes() {
    // 35 mm less two mean free paths of 1/26.9 cm; (0.15 (3.4257 + 10) / 3.4257)^2 + 0.38^2.
    let length: f64 = 3.5 - 2.0 / 26.9;
    let fwhm = (0.15 * (length + 10.0) / length).hypot(0.38);
    let camera = Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38).unwrap();
    let in_sigmas = 2.0 * (2.0 * 2.0_f64.ln()).sqrt();
    assert!((camera.sigma(10.0) * in_sigmas - fwhm).abs() < 1e-14);
    assert_eq!(camera.sigma(-1.0), camera.sigma(0.0));
    let parts = (camera.slope(), camera.at_face(), camera.intrinsic());
    let same = Collimator::new(parts.0, parts.1, parts.2).unwrap();
    assert_eq!(same, camera);
    let opaque = ParallelHoles {
        attenuation: f64::INFINITY,
        ..ParallelHoles::GE_LEHR
    };
    assert_eq!(opaque.effective_length().unwrap(), 3.5);
    assert_eq!(Collimator::default().sigma(7.0), 0.0);
}

/// A cylinder of radius 5 along z off the axis, activity 1 and attenuation 0.15 inside, uniform along z: a sample is (1 - exp(-mu chord)) /
/// mu. Root mean square error over bins relative to the bin averages.
fn cylinder_error(n: usize) -> f64 {
    let (centre, radius, mu) = ([1.3, -0.7], 5.0, 0.15);
    let pitch = 16.0 / n as f64;
    let views = ParallelGeometry::full_turn(7, n, pitch).unwrap();
    let axis = SliceAxis::new(1, 1.0).unwrap();
    let geometry = SpectGeometry::circular(&views, &axis, 12.0).unwrap();
    let grid = ImageGrid::square(n, pitch).unwrap();
    let disc = Shape2::ellipse(centre, [radius; 2], 0.0).unwrap();
    let cylinder = Phantom3::new([(1.0, Shape3::prism(disc, [-9.0, 9.0]).unwrap())]).unwrap();
    let volume: Vec<f64> = cylinder.volume(&grid, &axis).unwrap();
    let map = volume.iter().map(|x| mu * x).collect();
    let options = SpectOptions::default().with_attenuation(map);
    let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
    let found = forward(&operator, &volume);
    let mut square = 0.0;
    for (view, theta) in views.angles().iter().enumerate() {
        let middle = centre[0] * theta.cos() + centre[1] * theta.sin();
        for bin in 0..n {
            let parts = 64;
            let mean: f64 = (0..parts)
                .map(|k| (f64::from(k) + 0.5) / f64::from(parts) - 0.5)
                .map(|part| views.bin_centre(bin) + part * pitch - middle)
                .map(|s| 2.0 * (radius * radius - s * s).max(0.0).sqrt())
                .map(|chord| -(-mu * chord).exp_m1() / mu)
                .sum();
            square += (found[view * n + bin] - mean / f64::from(parts)).powi(2);
        }
    }
    (square / (7 * n) as f64).sqrt()
}

#[test]
fn an_attenuated_cylinder_converges_to_the_closed_form() {
    let errors = [64, 128, 256].map(cylinder_error);
    let order = (errors[0] / errors[2]).log2() / 2.0;
    println!("rms {errors:.2?}, order {order:.2}; the largest sample is 5.2");
    // The view of a disc ends like a square root: two bins have an error of the root of one voxel, so that the rms has order 1.
    assert!(errors[1] < 0.02 && errors[2] < 0.01, "{errors:?}");
    assert!(order > 0.95, "{order}");
}

/// A Gaussian hill of standard deviation 1.2 cm, through a collimator whose response doubles across it: slices of the hill at each depth
/// are Gaussians blurred to Gaussians; the trapezoidal rule over depth is exact to rounding for a smooth hill.
fn hill_error(n: usize, tolerance: f64) -> f64 {
    let (centre, own, radius) = ([1.1, -0.6, 0.4], 1.2, 7.0);
    let pitch = 16.0 / n as f64;
    let views = ParallelGeometry::new([0.3, 1.9, 4.4], n, pitch).unwrap();
    let axis = SliceAxis::new(n, pitch).unwrap();
    let geometry = SpectGeometry::circular(&views, &axis, radius).unwrap();
    let grid = ImageGrid::square(n, pitch).unwrap();
    let collimator = Collimator::new(0.08, 0.1, 0.2).unwrap();
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let hill = Shape3::gaussian(centre, [own; 3], unit).unwrap();
    let volume: Vec<f64> = Phantom3::new([(1.0, hill)])
        .unwrap()
        .volume(&grid, &axis)
        .unwrap();
    let options = SpectOptions::default().with_collimator(collimator);
    let options = options.with_tolerance(tolerance);
    let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
    let found = forward(&operator, &volume);
    let (mut square, mut whole) = (0.0, 0.0);
    for (view, theta) in views.angles().iter().enumerate() {
        let (sin, cos) = theta.sin_cos();
        let middle = [centre[0] * cos + centre[1] * sin, centre[2]];
        let depth = radius + centre[0] * sin - centre[1] * cos;
        for i in 0..n * n {
            let (s, z) = (views.bin_centre(i % n), axis.slice_centre(i / n));
            let away = (s - middle[0]).powi(2) + (z - middle[1]).powi(2);
            let step = 0.1;
            let exact: f64 = (-70..=70)
                .map(|k| f64::from(k) * step)
                .map(|t| {
                    let narrow = own * own;
                    let wide = narrow + collimator.variance(depth + t);
                    (-0.5 * t * t / narrow).exp() * narrow / wide * (-0.5 * away / wide).exp()
                })
                .sum::<f64>()
                * step;
            square += (found[view * n * n + i] - exact).powi(2);
            whole += exact * exact;
        }
    }
    (square / whole).sqrt()
}

#[test]
fn a_blurred_hill_converges_to_the_integral_over_depths() {
    let errors = [16, 32, 64].map(|n| hill_error(n, 1e-6));
    let order = (errors[0] / errors[2]).log2() / 2.0;
    let default = hill_error(64, 1e-3);
    println!("relative L2 {errors:.2?}, order {order:.2}; {default:.2e} at the default tolerance");
    // Voxel averages, box-shaped voxels and bin averages each have second order.
    assert!((order - 2.0).abs() < 0.1, "{order}");
    assert!((default - errors[2]).abs() < 2e-4, "{default} {errors:?}");
}

/// Activity and attenuation behind the face are omitted.
#[test]
fn activity_behind_the_face_is_omitted() {
    let views = ParallelGeometry::new([0.0], 8, 1.0).unwrap();
    let axis = SliceAxis::new(1, 1.0).unwrap();
    let grid = ImageGrid::square(8, 1.0).unwrap();
    let geometry = SpectGeometry::circular(&views, &axis, 1.0).unwrap();
    // The camera is at y = 1: rows y = 1.5 and above are behind its face. That is an error for attenuation (more than a diagonal behind).
    let options = SpectOptions::default();
    for (row, valid) in [(5, true), (6, false)] {
        let map = (0..64).map(|i| if i / 8 == row { 3.0 } else { 0.01 });
        let options = options.clone().with_attenuation(map.collect());
        let made = SpectOperator::new(&geometry, &grid, &axis, &options);
        assert_eq!(made.is_ok(), valid, "{row}");
        let what = "radius of the orbit outside the attenuating voxels";
        assert!(
            valid
                || matches!(made, Err(RadonError::OutOfRange { what: w, given: 1.0, .. }) if w == what)
        );
        let plain = SpectOperator::new(&geometry, &grid, &axis, &SpectOptions::default()).unwrap();
        assert_eq!(plain.with_attenuation(&options.attenuation).is_ok(), valid);
    }
    let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
    let found = forward(&operator, &[1.0; 64]);
    assert!(found.iter().all(|&x| (x - 5.0).abs() < 1e-14), "{found:?}");
    // The whole activity, for a grid behind the face.
    let grid = grid.with_centre([0.0, 9.0]).unwrap();
    let operator = SpectOperator::new(&geometry, &grid, &axis, &options).unwrap();
    assert_eq!(forward(&operator, &[1.0; 64]), [0.0; 8]);
}

/// Noise-free views of an elliptic cylinder of water with a hot sphere and a cold one, by a camera on an ellipse: OSEM with the operator
/// finds the activity, OSEM without attenuation does not.
#[test]
fn osem_recovers_the_activity() {
    let (n, pitch) = (24, 0.8);
    let views = ParallelGeometry::full_turn(24, n, pitch).unwrap();
    let axis = SliceAxis::new(12, pitch).unwrap();
    let radii: Vec<f64> = (views.angles().iter())
        .map(|theta| 10.0 + 2.0 * (2.0 * theta).cos() * (PI / 8.0).cos())
        .collect();
    let geometry = SpectGeometry::new(&views, &axis, radii).unwrap();
    let grid = ImageGrid::square(n, pitch).unwrap();
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let body = Shape2::ellipse([0.0, 0.0], [8.0, 6.0], 0.0).unwrap();
    let body = Shape3::prism(body, [-9.0, 9.0]).unwrap();
    let ball = |x: f64| Shape3::ellipsoid([x, 0.5, 0.0], [2.0; 3], unit).unwrap();
    let made = |objects: Vec<(f64, Shape3)>| -> Vec<f64> {
        let phantom = Phantom3::new(objects).unwrap();
        phantom.volume(&grid, &axis).unwrap()
    };
    let truth = made(vec![
        (1.0, body.clone()),
        (3.0, ball(3.5)),
        (-1.0, ball(-3.5)),
    ]);
    let truth: Vec<f64> = truth.iter().map(|x| x.max(0.0)).collect();
    let options = SpectOptions::default()
        .with_collimator(Collimator::parallel_holes(&ParallelHoles::GE_LEHR, 0.38).unwrap());
    let attenuated = options.clone().with_attenuation(made(vec![(0.15, body)]));
    let plan = |options| SpectOperator::new(&geometry, &grid, &axis, options).unwrap();
    let (camera, wrong) = (plan(&attenuated), plan(&options));
    let counts = forward(&camera, &truth);
    let hot = |image: &[f64]| {
        let ball = made(vec![(1.0, ball(3.5))]);
        let within = |i: &usize| ball[*i] == 1.0;
        let (found, true_sum) = (0..image.len())
            .filter(within)
            .fold((0.0, 0.0), |(a, b), i| (a + image[i], b + truth[i]));
        found / true_sum
    };
    let run = |operator: &SpectOperator<f64>| {
        let mut image = vec![1.0; truth.len()];
        let em = EmOptions::default().with_stopping(Stopping::default().with_max_iterations(40));
        let subsets = operator.subsets(6).unwrap();
        let report = osem(&subsets, &counts, &mut image, &em, radon::no_observer).unwrap();
        (hot(&image), report.history[39].residual)
    };
    let ((right, residual), (off, _)) = (run(&camera), run(&wrong));
    println!(
        "hot ball: {right:.4} of the true value (residual {residual:.1e}), {off:.4} without attenuation"
    );
    assert!((right - 1.0).abs() < 0.01, "{right}");
    assert!(residual < 2e-3, "{residual}");
    assert!(off < 0.6, "{off}");
}
