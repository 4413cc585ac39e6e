//! Gaussian filters of volumes against direct sums, moments and closed forms.

use radon::{RadonError, gaussian_filter};

/// The point in the middle of a volume.
fn point([nz, ny, nx]: [usize; 3]) -> Vec<f64> {
    let mut volume = vec![0.0; nz * ny * nx];
    volume[(nz / 2 * ny + ny / 2) * nx + nx / 2] = 1.0;
    volume
}

#[test]
fn a_point_becomes_a_gaussian_of_the_given_variances() {
    let shape = [41, 35, 61];
    for sigma in [[2.0, 1.5, 3.0], [0.3, 0.0, 0.7]] {
        let mut volume = point(shape);
        gaussian_filter(&mut volume, shape, sigma).unwrap();
        let (mut sum, mut variances) = (0.0, [0.0; 3]);
        for (k, value) in volume.iter().enumerate() {
            let at = [k / (35 * 61), k / 61 % 35, k % 61];
            sum += value;
            for axis in 0..3 {
                let way = at[axis] as f64 - (shape[axis] / 2) as f64;
                variances[axis] += way * way * value;
            }
        }
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        for (variance, sigma) in variances.iter().zip(sigma) {
            // Exact by construction; weights beyond the 6 sigma of the largest are not within all ends.
            assert!(
                (variance - sigma * sigma).abs() < 1e-6,
                "{variance} {sigma}"
            );
        }
    }
    let mut volume = point(shape);
    gaussian_filter(&mut volume, shape, [2.0, 1.5, 3.0]).unwrap();
    let peak = std::f64::consts::TAU.powf(-1.5) / (2.0 * 1.5 * 3.0);
    let found = volume[(20 * 35 + 17) * 61 + 30];
    assert!((found / peak - 1.0).abs() < 1e-7, "{found} {peak}");
}

/// By direct sums over a volume padded with zeros: axes are independent, and voxels outside are zero.
#[test]
fn ends_and_axes_agree_with_direct_sums() {
    let shape = [5, 7, 6];
    let values: Vec<f64> = (0..5 * 7 * 6).map(|k| ((k * 37) % 101) as f64).collect();
    // Weights of one axis from a point in a long row.
    let weights = |sigma: f64| {
        let mut row = point([1, 1, 101]);
        gaussian_filter(&mut row, [1, 1, 101], [0.0, 0.0, sigma]).unwrap();
        move |k: usize| row[50 + k]
    };
    let sigma = [1.2, 2.5, 0.4];
    let [along_z, along_y, along_x] = sigma.map(weights);
    let mut filtered = values.clone();
    gaussian_filter(&mut filtered, shape, sigma).unwrap();
    for (k, value) in filtered.iter().enumerate() {
        let [z, y, x] = [k / 42, k / 6 % 7, k % 6];
        let mut sum = 0.0;
        for (l, given) in values.iter().enumerate() {
            let [w, v, u] = [l / 42, l / 6 % 7, l % 6];
            sum += along_z(z.abs_diff(w)) * along_y(y.abs_diff(v)) * along_x(x.abs_diff(u)) * given;
        }
        assert!((value - sum).abs() < 1e-10, "{value} {sum}");
    }
    let mut single: Vec<f32> = values.iter().map(|value| *value as f32).collect();
    gaussian_filter(&mut single, shape, sigma).unwrap();
    for (a, b) in single.iter().zip(&filtered) {
        assert!((f64::from(*a) - b).abs() < 1e-4);
    }
}

#[test]
fn wrong_lengths_and_widths_are_errors() {
    let mut volume = vec![0.0f32; 8];
    let mut filter = |shape, sigma| gaussian_filter(&mut volume, shape, [sigma, 0.0, 0.0]);
    assert!(matches!(
        filter([2, 2, 3], 1.0),
        Err(RadonError::WrongLength { .. })
    ));
    assert!(filter([usize::MAX, 2, 2], 1.0).is_err());
    for sigma in [-1.0, f64::NAN, f64::INFINITY, 1e7] {
        assert!(filter([2, 2, 2], sigma).is_err(), "{sigma}");
    }
    assert!(filter([2, 2, 2], 1e6).is_ok());
    assert!(gaussian_filter::<f64>(&mut [], [0, 2, 2], [1.0; 3]).is_ok());
}
