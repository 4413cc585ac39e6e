//! Relations between images on different bins, and of different poses.

use super::*;

/// An image at a density of nodes, with its samples as those of the whole detector.
fn seen(body: &Body, detector: &ParallelDetector, sigma: f64, density: f64) -> (Vec<f64>, Image) {
    let (organs, response) = (none(), DepthResponse::constant(sigma).unwrap());
    let view = view_of(detector, 0.8, BinValue::Average, &response, density);
    let assembly = Assembly::new(&organs)
        .with_body(body, &[0.2, 1.0], None)
        .unwrap();
    let rows = 0..detector.n_rows();
    let image = view.image(&assembly, Shown::Change, rows).unwrap();
    (whole(&image, detector), image)
}

/// The average over a bin is that of the averages over its quarters, for responses narrower and wider than the bins.
#[test]
fn bins_have_the_average_of_their_parts() {
    let body = heart();
    let coarse = ParallelDetector::new(8, 8, [0.8; 2]).unwrap();
    let fine = ParallelDetector::new(16, 16, [0.4; 2]).unwrap();
    for sigma in [0.3, 0.6, 1.2] {
        let [whole, parts] = [&coarse, &fine].map(|detector| seen(&body, detector, sigma, 2.0).0);
        let sums = (0..64).map(|k| {
            let at = |x: usize, y: usize| parts[(2 * (k / 8) + y) * 16 + 2 * (k % 8) + x];
            0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
        });
        let off = apart(&sums.collect::<Vec<_>>(), &whole);
        // The interpolation of the weights, 1e-6 of their peak, along both axes.
        assert!(off < 1e-5, "{sigma} {off}");
    }
}

/// With a response of a small part of a bin, the edges of bins divide panels, but only within the outline.
#[test]
fn bins_beside_a_body_need_no_rays() {
    let body = heart();
    for sigma in [0.0, 0.02] {
        let [(small, of_small), (large, of_large)] = [16, 32].map(|n| {
            let detector = ParallelDetector::new(n, n, [0.4; 2]).unwrap();
            let (samples, image) = seen(&body, &detector, sigma, 2.0);
            (samples, image.rays)
        });
        assert_eq!(of_small, of_large);
        for (k, sample) in large.iter().enumerate() {
            let (bin, row) = (k % 32, k / 32);
            let is_inner = (8..24).contains(&bin) && (8..24).contains(&row);
            let own = is_inner.then(|| small[(row - 8) * 16 + bin - 8]);
            // Rounding of positions in units of bins.
            let off = (sample - own.unwrap_or(0.0)).abs();
            assert!(off < 1e-12, "{bin} {row} {off}");
        }
        // The outline of a convex solid: every ray between its ends meets it.
        assert!(of_small.hit == of_small.cast && of_small.hit > 1000);
    }
    // The response is resolved at the edges of bins: its steps there are much narrower than a bin.
    let detector = ParallelDetector::new(8, 8, [0.8; 2]).unwrap();
    let [low, high] = [1.0, 6.0].map(|density| seen(&body, &detector, 0.04, density).0);
    assert!(apart(&low, &high) < 1e-2, "{}", apart(&low, &high));
}

/// The centres of wide bins are those of every ninth fine bin, and no other content contributes.
#[test]
fn values_at_the_centres_of_wide_bins_need_rays_near_these() {
    let (body, organs, sigma) = (heart(), none(), 0.1);
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.2, 1.0], None)
        .unwrap();
    let response = DepthResponse::constant(sigma).unwrap();
    let image = |n: usize, pitch: f64| {
        let detector = ParallelDetector::new(n, n, [pitch; 2]).unwrap();
        let view = view_of(&detector, 0.8, BinValue::Centre, &response, 3.0);
        let image = view.image(&assembly, Shown::Change, 0..n).unwrap();
        (whole(&image, &detector), image.rays.cast)
    };
    let ((wide, few), (fine, many)) = (image(5, 2.25), image(45, 0.25));
    let centres = (0..25).map(|k| fine[(9 * (k / 5) + 4) * 45 + 9 * (k % 5) + 4]);
    let off = apart(&wide, &centres.collect::<Vec<_>>());
    // Nodes at the same density in other panels.
    assert!(off < 1e-4, "{off}");
    // The part of the area within reach is 0.22, in more panels.
    assert!(2 * few < many, "{few} {many}");
}

/// Rows perpendicular to the axis cut parallels; rows that are nearly perpendicular cut short curves.
#[test]
fn an_upright_body_is_the_limit_of_tilted_ones() {
    let detector = ParallelDetector::new(12, 12, [0.5; 2]).unwrap();
    let cone = |r: f64| Meridian::new(&[[0.0, r], [2.0, 1.2 * r]]).unwrap();
    for layers in [[bulge(2.2, 0.8), bulge(2.7, 1.4)], [cone(0.8), cone(1.3)]] {
        let image = |tilt: f64| {
            let pose = Pose::axis_along_z(1.0).unwrap().rotated_x(tilt).unwrap();
            let body = Body::new(layers.to_vec(), pose).unwrap();
            seen(&body, &detector, 0.3, 2.0).0
        };
        let upright = image(0.0);
        for log in 2..=16 {
            let tilt = 0.1f64.powi(log);
            let off = apart(&image(tilt), &upright);
            // The tilt displaces the surface by up to 2 cm times it, against a response of 0.3 cm; the quadrature has errors of 3e-5.
            assert!(off < 5.0 * tilt + 1e-4, "{tilt} {off}");
        }
    }
}
