//! Images of bodies whose meridians have few vertices, and the stated error of their corners.

use super::*;

/// The corners of 24 segments do not divide the panel between the ends of a row, which has more nodes than one Gauss-Legendre rule. The reference is a
/// lattice of rays.
#[test]
fn corners_are_resolved_in_a_body_much_longer_than_the_response_is_wide() {
    let point = |k: i32| {
        let angle = std::f64::consts::PI * f64::from(k) / 24.0;
        [-7.0 * angle.cos(), 2.5 * angle.sin()]
    };
    let layer = Meridian::new(&(0..=24).map(point).collect::<Vec<_>>()).unwrap();
    let body = Body::new(vec![layer], Pose::identity()).unwrap();
    let (organs, sigma) = (none(), 0.1);
    let detector = ParallelDetector::new(45, 1, [0.31, 0.2]).unwrap();
    let exact = Definition {
        ray: &|u, v| parallel_ray(0.1, [u, v]),
        on_ray: &|ray| {
            let spans = body.spans(0, ray).unwrap();
            let ends = spans.iter().flat_map(|s| [s.enter, s.exit]).collect();
            OnRay {
                ends,
                content: Box::new(|_| [1.0, 0.0]),
            }
        },
        sigma: &|_| sigma,
        value: BinValue::Centre,
    }
    .samples(&detector, [[-7.2, 7.2], [-0.54, 0.54]], [0.012, 10.0]);
    let response = DepthResponse::constant(sigma).unwrap();
    let errors = [2.0, 2.8, 4.0].map(|density| {
        let view = view_of(&detector, 0.1, BinValue::Centre, &response, density);
        let assembly = Assembly::new(&organs)
            .with_body(&body, &[1.0], None)
            .unwrap();
        let image = view.image(&assembly, Shown::Change, 0..1).unwrap();
        let stated = view.corner_error(&body, &[1.0]).unwrap() / largest(&exact);
        [apart(&whole(&image, &detector), &exact), stated]
    });
    println!("{errors:?}");
    // Order 2 of the density; half the step changes the reference by less than 1e-6.
    assert!(errors[2][0] < 0.4 * errors[0][0], "{errors:?}");
    for [off, stated] in errors {
        assert!(off < stated && off > 0.02 * stated, "{errors:?}");
    }
}

/// Two polygons in a circle: the turns of their corners, of whose sides the inner ones are shorter than the distance of the nodes.
#[test]
fn the_error_of_corners_follows_its_formula() {
    let polygon = |radius: f64, n: i32| {
        let angle = |k: i32| std::f64::consts::PI * f64::from(k) / f64::from(n);
        let point = |k: i32| [-radius * angle(k).cos(), radius * angle(k % n).sin()];
        Meridian::new(&(0..=n).map(point).collect::<Vec<_>>()).unwrap()
    };
    let turn = |n: f64| (std::f64::consts::PI / n).sin();
    let body = Body::new(vec![polygon(1.0, 40), polygon(5.0, 16)], Pose::identity()).unwrap();
    let stated = |sigma: f64, pitch: f64, density: f64| {
        let response = DepthResponse::constant(sigma).unwrap();
        let detector = ParallelDetector::new(4, 4, [pitch, 0.5 * pitch]).unwrap();
        let view = view_of(&detector, 0.0, BinValue::Average, &response, density);
        view.corner_error(&body, &[0.5, 2.0]).unwrap()
    };
    let side = 2.0 * (std::f64::consts::PI / 80.0).sin();
    for (sigma, pitch, density, scale) in [(0.4, 1.0, 2.0, 0.4), (0.1, 1.0, 2.0, 1.0)] {
        // The corners of the outer polygon divide panels if the response is narrow.
        let outer = match sigma < View::NARROW * pitch {
            true => 0.0,
            false => 2.0 * turn(16.0),
        };
        let inner = 1.5 * turn(40.0) * side * density / scale;
        let exact = (inner + outer) * scale / (6.0 * density * density);
        let found = stated(sigma, pitch, density);
        // Rounding.
        assert!((found / exact - 1.0).abs() < 1e-12, "{found} {exact}");
    }
    // Corners of more than 0.8 over the density divide panels; those of the inner polygon remain.
    assert!(stated(0.4, 1.0, 5.0) < 0.2 * stated(0.4, 1.0, 4.0));
    let response = DepthResponse::constant(0.4).unwrap();
    let detector = ParallelDetector::new(4, 4, [1.0; 2]).unwrap();
    let view = view_of(&detector, 0.0, BinValue::Average, &response, 2.0);
    assert!(matches!(
        view.corner_error(&body, &[1.0]),
        Err(RevolveError::WrongLength { .. })
    ));
}

/// Of 36 bodies in random poses, many with the axis along the bins or the rows, where a corner is a line in the image. The reference has 20 nodes a
/// standard deviation and other panels, which corners above 0.04 divide.
#[test]
fn the_difference_of_two_densities_and_the_corners_bound_the_error() {
    let mut seed = 7u64;
    let mut uniform = move |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        low + (high - low) * (seed >> 11) as f64 / 2f64.powi(53)
    };
    let organs = none();
    let (mut most, mut by_difference) = (0.0f64, 0.0f64);
    for k in 0..36 {
        let n = [25, 50, 100][k % 3];
        let half = |length: f64, radius: f64| {
            let angle =
                |k: i32| -0.6 + (0.6 + std::f64::consts::FRAC_PI_2) * f64::from(k) / f64::from(n);
            let point = |k: i32| [length * angle(k).sin(), radius * angle(k).cos().max(0.0)];
            Meridian::new(&(0..=n).map(point).collect::<Vec<_>>()).unwrap()
        };
        let tilts = match k % 2 {
            0 => [0.0, uniform(0.0, 0.02)],
            _ => [uniform(0.0, 6.0), uniform(0.0, 6.0)],
        };
        let pose = Pose::axis_along_z(1.0).and_then(|pose| pose.rotated_x(tilts[0]));
        let pose = pose.and_then(|pose| pose.rotated_y(tilts[1])).unwrap();
        let layers = [half(4.0, uniform(1.2, 2.2)), half(5.0, uniform(2.4, 3.4))];
        let body = Body::new(layers.to_vec(), pose).unwrap();
        let sigma = uniform(0.1, 0.6);
        let pitch = [0, 1].map(|_| sigma * uniform(0.5, 4.5));
        let detector = ParallelDetector::new(12, 10, pitch).unwrap();
        let lines = detector.rays(uniform(0.0, 6.0)).unwrap();
        let response = DepthResponse::constant(sigma).unwrap();
        let value = [BinValue::Average, BinValue::Centre][k / 2 % 2];
        let image = |density: f64| {
            let view = View::new(&lines, detector.pitch(), value, &response, density).unwrap();
            let assembly = Assembly::new(&organs)
                .with_body(&body, &[0.0, 1.0], None)
                .unwrap();
            let image = view.image(&assembly, Shown::Change, 0..10).unwrap();
            let corners = view.corner_error(&body, &[0.0, 1.0]).unwrap();
            (whole(&image, &detector), corners)
        };
        let (exact, _) = image(20.0);
        let images = [1.0, 1.4, 2.0, 2.8, 4.0, 5.6].map(image);
        for pair in images.windows(2) {
            let off = apart(&pair[1].0, &exact);
            // Errors fall by at least a factor of 2 from one density to the next, but for corners.
            let difference = 1.2 * apart(&pair[0].0, &pair[1].0);
            most = most.max(off / (difference + pair[1].1 / largest(&exact)));
            by_difference = by_difference.max(off / difference);
        }
    }
    println!("{most} {by_difference}");
    assert!(most < 1.0, "{most}");
    // The difference alone is no bound.
    assert!(by_difference > 1.0, "{by_difference}");
}
