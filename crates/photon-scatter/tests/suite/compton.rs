//! Klein-Nishina and attenuation against quadrature and published values.

use photon_scatter::{Compton, Random, Spectrum, water_attenuation};
use std::f64::consts::PI;

/// Rest energy of the electron in keV, CODATA 2018.
const ELECTRON_KEV: f64 = 510.998_95;

/// Klein-Nishina in its other common form, per steradian in units of r^2.
fn differential(energy: f64, cosine: f64) -> f64 {
    let p = 1.0 / (1.0 + energy / ELECTRON_KEV * (1.0 - cosine));
    0.5 * p * p * (p + 1.0 / p - 1.0 + cosine * cosine)
}

/// Integral over all directions of a function of the cosine, weighted with the differential cross-section (Simpson).
fn moment(energy: f64, of: impl Fn(f64) -> f64) -> f64 {
    let n = 2000;
    let at = |k: usize| -1.0 + 2.0 * k as f64 / n as f64;
    let weight = |k: usize| match k {
        0 => 1.0,
        k if k == n => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=n)
        .map(|k| weight(k) * differential(energy, at(k)) * of(at(k)))
        .sum();
    2.0 * PI * sum * (2.0 / n as f64) / 3.0
}

#[test]
fn the_total_cross_section_is_the_integral_of_the_differential_one() {
    for energy in [1.0, 5.0, 60.0, 140.5, 364.5, 511.0] {
        let total = Compton::new(energy).unwrap().cross_section();
        let exact = moment(energy, |_| 1.0) * 7.940_787_6e-26;
        assert!(
            (total / exact - 1.0).abs() < 2e-8,
            "{energy} keV: {total:e} {exact:e}"
        );
    }
    // Published: 0.4928 barn per electron at 100 keV (Hubbell et al. 1975).
    let total = Compton::new(100.0).unwrap().cross_section();
    assert!((total / 0.4927e-24 - 1.0).abs() < 5e-4, "{total:e}");
}

#[test]
fn the_density_is_normalised_and_samples_have_its_moments() {
    for energy in [30.0, 140.5, 511.0] {
        let compton = Compton::new(energy).unwrap();
        let total = moment(energy, |_| 1.0);
        for cosine in [-1.0, -0.3, 0.0, 0.5, 1.0] {
            let exact = 4.0 * PI * differential(energy, cosine) / total;
            assert!((compton.relative_density(cosine).unwrap() / exact - 1.0).abs() < 1e-9);
        }
        let mut random = Random::new(7, 0);
        let n = 400_000;
        let (mut cosines, mut squares, mut energies) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            let cosine = compton.sample(&mut random);
            cosines += cosine;
            squares += cosine * cosine;
            energies += compton.energy_at(cosine).unwrap();
        }
        let scattered = |c: f64| energy / (1.0 + energy / ELECTRON_KEV * (1.0 - c));
        for (sum, exact, spread) in [
            (cosines, moment(energy, |c| c) / total, 0.7),
            (squares, moment(energy, |c| c * c) / total, 0.35),
            (energies, moment(energy, scattered) / total, 0.3 * energy),
        ] {
            // Four standard deviations of an average of n; the spreads are upper bounds.
            let off = (sum / f64::from(n) - exact).abs();
            assert!(
                off < 4.0 * spread / f64::from(n).sqrt(),
                "{energy} keV: {off:e}"
            );
        }
    }
}

#[test]
fn attenuation_agrees_with_that_of_water() {
    // NIST, with coherent scattering (Hubbell and Seltzer, NISTIR 5632), and the coherent part (XCOM). Electrons are bound: their
    // incoherent cross-section is less than that of free ones, by 1.3 % at 100 keV.
    for (energy, total, coherent) in [
        (80.0, 0.1837, 0.00816),
        (100.0, 0.1707, 0.00535),
        (150.0, 0.1505, 0.00244),
        (200.0, 0.1370, 0.00139),
    ] {
        let ours = water_attenuation(energy).unwrap() + coherent;
        let off = ours / total - 1.0;
        assert!((0.0..0.018).contains(&off), "{energy} keV: {ours} {off}");
    }
}

#[test]
fn efficiencies_are_integrals_of_gaussians() {
    let windows = [[126.45, 154.55], [90.0, 120.0]];
    let spectrum = Spectrum::new(140.5, 0.1, &windows).unwrap();
    let integral = |energy: f64, [low, high]: [f64; 2]| {
        let sigma = 0.1 * (140.5 * energy).sqrt() / (8.0 * 2.0_f64.ln()).sqrt();
        let n = 20_000;
        let step = (high - low) / f64::from(n);
        let at = |k: i32| low + (f64::from(k) + 0.5) * step;
        let density = |e: f64| (-0.5 * ((e - energy) / sigma).powi(2)).exp();
        (0..n).map(|k| density(at(k)) * step).sum::<f64>() / (sigma * (2.0 * PI).sqrt())
    };
    let photopeak = integral(140.5, windows[0]);
    for energy in [100.0, 120.0, 133.0, 140.5] {
        for (k, window) in windows.iter().enumerate() {
            let exact = integral(energy, *window) / photopeak;
            assert!((spectrum.efficiency(k, energy) - exact).abs() < 1e-8);
        }
    }
}
