//! Images of sectors, whose outlines divide panels.

use super::*;
use revolve_voxel::{Curve, Sector, Shell, WallTwist};
use std::f64::consts::TAU;

/// A tube with a wall from radius 1 to 2, tilted.
fn tube() -> Body {
    let pose = Pose::axis_along_z(1.5)
        .and_then(|pose| pose.rotated_x(0.9))
        .and_then(|pose| pose.rotated_y(0.4))
        .unwrap();
    let layer = |r: f64| Meridian::new(&[[0.0, r], [3.0, r]]).unwrap();
    Body::new(vec![layer(1.0), layer(2.0)], pose).unwrap()
}

/// A part of the wall of the tube from azimuth 0.5, with flat sides and with sides twisted by 1.2 radians from one end to the other.
fn sectors(turn: f64) -> [Sector; 2] {
    let ring = Meridian::ring(&[[0.4, 1.0], [0.4, 1.7], [2.2, 1.7], [2.2, 1.0]]).unwrap();
    let flat = Sector::new(ring, [0.5, 0.5 + turn], *tube().pose()).unwrap();
    let line = |r: f64| Curve::polyline(&[0.0, 1.0], &[[0.0, r], [3.0, r]]).unwrap();
    let wall = Shell::new(line(1.0), line(2.0), [0.0, 1.0]).unwrap();
    let twist = WallTwist::new(wall.into(), |s| [1.2 * s; 2]).unwrap();
    let twisted = flat.clone().with_twist(twist.into());
    [flat, twisted]
}

/// A part of a rod, which touches the axis.
fn slice(turn: f64) -> Sector {
    let rod = Meridian::new(&[[0.3, 1.5], [2.4, 1.1]]).unwrap();
    Sector::new(rod, [0.5, 0.5 + turn], *tube().pose()).unwrap()
}

/// The image of an activity of 1 per cm^3 in a sector alone, and the number of rays.
fn seen(
    sector: Option<&Sector>,
    detector: &ParallelDetector,
    sigma: f64,
    density: f64,
) -> (Vec<f64>, u64) {
    let (organs, body, response) = (none(), tube(), DepthResponse::constant(sigma).unwrap());
    let view = view_of(detector, 0.3, BinValue::Average, &response, density);
    let sectors = sector.map(|sector| (sector.clone(), 1.0));
    let assembly = Assembly::new(&organs)
        .with_body(&body, &[0.0; 2], None)
        .and_then(|assembly| assembly.with_sectors(sectors.into_iter().collect()))
        .unwrap();
    let image = view
        .image(&assembly, Shown::Change, 0..detector.n_rows())
        .unwrap();
    (whole(&image, detector), image.rays.cast)
}

/// Averages over bins of the chords of a lattice of rays.
#[test]
fn bins_have_the_mean_chord_of_a_sector() {
    const RAYS: usize = 100;
    let detector = ParallelDetector::new(7, 6, [0.6; 2]).unwrap();
    let place = |k: usize, n: usize| 0.6 * ((k as f64 + 0.5) / RAYS as f64 - 0.5 * n as f64);
    for sector in [1.0, 4.0].into_iter().flat_map(sectors) {
        let mut exact = vec![0.0; 42];
        for row in 0..6 * RAYS {
            for bin in 0..7 * RAYS {
                let ray = parallel_ray(0.3, [place(bin, 7), place(row, 6)]);
                exact[row / RAYS * 7 + bin / RAYS] += sector.chord(&ray);
            }
        }
        let scale = 1.0 / (RAYS * RAYS) as f64;
        exact.iter_mut().for_each(|sum| *sum *= scale);
        let errors = [1.4, 4.0].map(|density| {
            let (samples, _) = seen(Some(&sector), &detector, 0.0, density);
            apart(&samples, &exact)
        });
        // The lattice has errors of up to 2.1e-4, and of 1e-4 with 150 rays along a bin.
        assert!(errors[0] < 2e-3 && errors[1] < 3e-4, "{errors:?}");
    }
}

/// Between the edges of flat sides the integrand is smooth, so that the error falls exponentially behind a response. A twisted side has an
/// outline besides its edges.
#[test]
fn outlines_of_sectors_divide_panels() {
    let detector = ParallelDetector::new(9, 8, [0.6, 0.5]).unwrap();
    let all = [1.0, 2.5, 4.0, TAU].into_iter().flat_map(|turn| {
        let [flat, twisted] = sectors(turn);
        [(flat, false), (slice(turn), false), (twisted, true)]
    });
    for (sector, is_twisted) in all {
        for sigma in [0.0, 0.1, 0.3] {
            let image = |density: f64| seen(Some(&sector), &detector, sigma, density).0;
            let fine = image(6.0);
            let errors = [1.4, 3.0].map(|density| apart(&image(density), &fine));
            let bounds = match (is_twisted, sigma > 0.0) {
                (false, true) => [1e-3, 3e-6],
                (false, false) => [2e-3, 2e-4],
                (true, _) => [3e-3, 6e-4],
            };
            assert!(
                errors[0] < bounds[0] && errors[1] < bounds[1],
                "{sigma} {is_twisted} {errors:?}"
            );
        }
        let rays = |sector, density| seen(sector, &detector, 0.3, density).1;
        assert!(rays(Some(&sector), 1.0) > rays(None, 1.0));
        assert_eq!(rays(Some(&sector), 0.9), rays(None, 0.9));
    }
    // A full turn has no sides.
    let [full, _] = sectors(TAU);
    let [low, high] = [1.0, 6.0].map(|density| seen(Some(&full), &detector, 0.3, density).0);
    assert!(apart(&low, &high) < 1e-3, "{}", apart(&low, &high));
}

/// Jags that are small compared with the response do not divide panels.
#[test]
fn small_jags_of_a_sector_need_few_rays() {
    let detector = ParallelDetector::new(9, 8, [0.6, 0.5]).unwrap();
    let sector = |depth: f64| {
        let teeth = (0..12).flat_map(|k| {
            let x = 0.4 + 0.15 * f64::from(k);
            [[x, 1.7 - depth], [x + 0.15, 1.7]]
        });
        let ring: Vec<_> = [[2.2, 1.0], [0.4, 1.0]].into_iter().chain(teeth).collect();
        Sector::new(Meridian::ring(&ring).unwrap(), [0.5, 2.0], *tube().pose()).unwrap()
    };
    let image = |depth, density| seen(Some(&sector(depth)), &detector, 0.6, density);
    let (jagged, rays) = image(3e-3, 1.4);
    let off = apart(&jagged, &image(3e-3, 6.0).0);
    assert!(off < 1e-4, "{off}");
    let [none, large] = [1e-4, 0.1].map(|depth| image(depth, 1.4).1);
    assert!(
        5 * rays < 6 * none && 3 * rays < large,
        "{none} {rays} {large}"
    );
}
