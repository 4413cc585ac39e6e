//! Conservation of photons: emitted ones escape or are absorbed.

use crate::support::{Ball, Point, camera, photopeak};
use photon_scatter::{Compton, Random, Scatter, ScatterOptions, Spectrum, water_attenuation};

/// Probability of absorption above 20 keV, by photons that are tracked from emission in the middle of a ball to their end, and the fraction that escapes
/// after each order of scattering.
fn tracked(radius: f64, photons: u32) -> (f64, [f64; 3]) {
    let mut random = Random::new(99, 0);
    let (mut absorbed, mut escaped) = (0.0, [0.0; 3]);
    for _ in 0..photons {
        let (mut at, mut direction, mut energy) = ([0.0; 3], [0.0, 0.0, 1.0_f64], 140.5);
        for order in 0.. {
            let mu = water_attenuation(energy).unwrap();
            let free = -(1.0 - random.uniform()).ln() / mu;
            at = std::array::from_fn(|k| at[k] + free * direction[k]);
            if at.iter().map(|x: &f64| x * x).sum::<f64>() > radius * radius {
                escaped[order.min(2)] += 1.0;
                break;
            }
            let compton = Compton::new(energy).unwrap();
            let scattering = compton.cross_section() * 10.0 * 6.022_140_76e23 / 18.0153;
            if random.uniform() * mu > scattering {
                absorbed += 1.0;
                break;
            }
            let cosine = compton.sample(&mut random);
            energy = compton.energy_at(cosine).unwrap();
            if energy < 21.0 {
                absorbed += 1.0;
                break;
            }
            // The direction at this angle from the old one towards a random one.
            let other = random.direction();
            let along: f64 = (0..3).map(|k| other[k] * direction[k]).sum();
            let across: [f64; 3] = std::array::from_fn(|k| other[k] - along * direction[k]);
            let norm = across.iter().map(|x| x * x).sum::<f64>().sqrt();
            let sine = (1.0 - cosine * cosine).sqrt();
            direction = std::array::from_fn(|k| cosine * direction[k] + sine / norm * across[k]);
        }
    }
    let n = f64::from(photons);
    (absorbed / n, escaped.map(|count| count / n))
}

#[test]
fn emitted_photons_escape_or_are_absorbed() {
    let radius = 8.0;
    let ball = Ball {
        centre: [0.0; 3],
        radius,
        density: 1.0,
    };
    // A window that records every photon above 20 keV: a view is a fraction of the photons that escape in all directions.
    let spectrum = Spectrum::new(140.5, 0.1, &[[1.0, 1e4]]).unwrap();
    let camera = camera(48, 0.5, &[30.0]);
    let options = ScatterOptions::new(6e-5);
    let scatter = Scatter::new(&Point([0.0; 3], 1.0), &ball, &camera, &spectrum, &options).unwrap();
    let scattered = scatter.view(0, 0).iter().sum::<f64>() * 0.25;
    let primary = (-water_attenuation(140.5).unwrap() * radius).exp();
    let (absorbed, [_, once, more]) = tracked(radius, 200_000);
    let total = primary + scattered + absorbed;
    // Three standard deviations of the tracked photons.
    assert!(
        (total - 1.0).abs() < 0.004,
        "{primary} + {scattered} + {absorbed} = {total}"
    );
    let orders = scatter.report().by_order;
    let first = orders[0] / orders.iter().sum::<f64>();
    let expected = once / (once + more);
    assert!((first - expected).abs() < 0.005, "{first} {expected}");
}

/// The orders of scattering are parts of the projection sums of a detector that records all of them.
#[test]
fn orders_add_up_to_the_projection_sums() {
    let ball = Ball {
        centre: [0.0; 3],
        radius: 5.0,
        density: 1.0,
    };
    let point = Point([0.0; 3], 3.0);
    let camera = camera(40, 0.5, &[0.0, 120.0, 240.0]);
    for histories in [64, 512] {
        let options = ScatterOptions::new(0.02).with_block(histories);
        let scatter = Scatter::new(&point, &ball, &camera, &photopeak(), &options).unwrap();
        let sum: f64 = (0..3).flat_map(|view| scatter.view(0, view)).sum();
        let orders: f64 = scatter.report().by_order.iter().sum();
        assert!((orders / (0.25 * sum) - 1.0).abs() < 0.02, "{orders} {sum}");
    }
}
