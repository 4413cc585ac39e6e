//! Collimators beside published widths, sensitivities and attenuation, and the spread of models of their response.

use heart_phantom::scene::{CollimatorSettings, HolesSettings};
use heart_phantom::{Chest, Phantom, no_observer};
use heart_phantom::{Mode, Orbit, Scene};
use radon::{Collimator, HoleResponse, ParallelHoles};
use std::f64::consts::{PI, TAU};

/// Published with TOPAS-SPECT for a Siemens Symbia LEHR at 140.5 keV (github.com/bertoletlab/topas-spect-release, docs/validation.md, section 2):
/// distance in cm, FWHM in mm by Monte Carlo and by Anger's formula.
const PUBLISHED: [[f64; 3]; 4] = [
    [10.0, 5.3, 5.9],
    [15.0, 7.3, 8.3],
    [20.0, 9.3, 10.6],
    [30.0, 13.3, 15.4],
];

/// The cross-section of a hole of diameter 1.
#[derive(Clone, Copy, Debug)]
enum Hole {
    Hexagonal,
    Round,
}

impl Hole {
    /// Fraction of the cross-section that overlaps its copy displaced by `v`: its autocorrelation, 1 at 0.
    fn shared(self, [x, y]: [f64; 2]) -> f64 {
        match self {
            Self::Round => {
                let d = x.hypot(y);
                if d >= 1.0 {
                    return 0.0;
                }
                (d.acos() - d * (1.0 - d * d).sqrt()) / (0.5 * PI)
            }
            Self::Hexagonal => {
                // The hexagon cut by the half-planes of the displaced one, edge normals at multiples of 60 degrees.
                let corner = |k: usize| (PI * (k as f64 + 0.5) / 3.0).sin_cos();
                let size = 0.5 / (PI / 6.0).cos();
                let mut polygon: Vec<[f64; 2]> = (0..6)
                    .map(corner)
                    .map(|(s, c)| [size * c, size * s])
                    .collect();
                for k in 0..6 {
                    let (sin, cos) = (PI * f64::from(k) / 3.0).sin_cos();
                    let above = |p: [f64; 2]| (p[0] - x) * cos + (p[1] - y) * sin - 0.5;
                    polygon = cut(&polygon, above);
                }
                area(&polygon) / (0.5 * 3.0_f64.sqrt())
            }
        }
    }

    /// Standard deviation along an axis, by sums over a polar grid.
    fn sigma(self) -> f64 {
        let (steps, turns) = (400, 48);
        let (mut whole, mut moment) = (0.0, 0.0);
        for k in 0..steps {
            let r = (f64::from(k) + 0.5) / f64::from(steps) * 1.2;
            for turn in 0..turns {
                let (sin, cos) = (TAU * (f64::from(turn) + 0.5) / f64::from(turns)).sin_cos();
                let weight = r * self.shared([r * cos, r * sin]);
                whole += weight;
                moment += weight * 0.5 * r * r;
            }
        }
        (moment / whole).sqrt()
    }

    /// Full width at half maximum, averaged over directions.
    fn fwhm(self) -> f64 {
        let turns = 48;
        let half = |turn: i32| {
            let (sin, cos) = (TAU * (f64::from(turn) + 0.5) / f64::from(turns)).sin_cos();
            let (mut low, mut high) = (0.0, 1.2);
            while high - low > 1e-6 {
                let r = 0.5 * (low + high);
                match self.shared([r * cos, r * sin]) > 0.5 {
                    true => low = r,
                    false => high = r,
                }
            }
            low
        };
        2.0 * (0..turns).map(half).sum::<f64>() / f64::from(turns)
    }
}

/// The part of a convex polygon where `above` is negative.
fn cut(polygon: &[[f64; 2]], above: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let (at_a, at_b) = (above(a), above(b));
        if at_a <= 0.0 {
            kept.push(a);
        }
        if (at_a < 0.0 && at_b > 0.0) || (at_a > 0.0 && at_b < 0.0) {
            let t = at_a / (at_a - at_b);
            kept.push([0, 1].map(|k| a[k] + t * (b[k] - a[k])));
        }
    }
    kept
}

fn area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let pairs = polygon.iter().zip(next);
    0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

/// FWHM in mm of a Gaussian with a standard deviation in cm.
fn fwhm_mm(sigma: f64) -> f64 {
    10.0 * sigma * (8.0 * 2.0_f64.ln()).sqrt()
}

fn symbia(response: HoleResponse) -> Collimator {
    let holes = ParallelHoles {
        response,
        ..ParallelHoles::SIEMENS_LEHR
    };
    Collimator::parallel_holes(&holes, 0.0).unwrap()
}

#[test]
fn gaussians_have_the_variance_of_their_holes() {
    let holes = [
        (Hole::Hexagonal, HoleResponse::Hexagonal),
        (Hole::Round, HoleResponse::Round),
    ];
    for (hole, response) in holes {
        // Sums over 400 by 48 points of a function with kinks: 1e-4.
        let at_face = symbia(response).at_face() / ParallelHoles::SIEMENS_LEHR.diameter;
        assert!((hole.sigma() / at_face - 1.0).abs() < 2e-4, "{hole:?}");
    }
}

#[test]
fn widths_of_a_symbia_collimator_beside_published_ones() {
    let [anger, hexagonal] = [HoleResponse::Anger, HoleResponse::Hexagonal].map(symbia);
    let own = Hole::Hexagonal.fwhm();
    let length = ParallelHoles::SIEMENS_LEHR.effective_length().unwrap();
    for [distance, monte_carlo, formula] in PUBLISHED {
        let by_formula = fwhm_mm(anger.sigma(distance));
        let by_variance = fwhm_mm(hexagonal.sigma(distance));
        let by_hole =
            10.0 * own * ParallelHoles::SIEMENS_LEHR.diameter * (length + distance) / length;
        // Published to 0.1 mm; the attenuation of lead is known to a per cent, 0.01 mm of the width.
        assert!((by_formula - formula).abs() < 0.06, "{by_formula}");
        // The formula is the width of a triangle, the response of a slit; that of a hexagonal hole is narrower.
        assert!((0.10..0.17).contains(&(by_formula / monte_carlo - 1.0)));
        assert!(
            (by_variance / monte_carlo - 1.0).abs() < 0.03,
            "{by_variance}"
        );
        // The simulation has a gap of 0.25 mm, a crystal of 9.5 mm and bins of 1 mm, which add about 0.2 mm, and septal penetration.
        assert!((0.2..0.4).contains(&(monte_carlo - by_hole)), "{by_hole}");
    }
}

/// Photons that pass opaque parallel holes per photon emitted: a hole's area over that of its cell, times the area over 4 pi L^2.
fn geometric_efficiency(diameter: f64, septum: f64, length: f64) -> f64 {
    let hole = 0.5 * 3.0_f64.sqrt() * diameter * diameter;
    (diameter / (diameter + septum)).powi(2) * hole / (4.0 * PI * length * length)
}

#[test]
fn sensitivities_from_geometry_beside_published_ones() {
    // Photopeak efficiency of 9.5 mm of NaI at 140.5 keV in a window of 20 % (TOPAS-SPECT, section 1), and photons of this energy per decay of
    // 99mTc (E. Browne and J. K. Tuli, Nuclear Data Sheets 145, 25, 2017).
    let (crystal, per_decay) = (0.862, 0.89);
    let detected = |holes: ParallelHoles, septum: f64| {
        crystal * geometric_efficiency(holes.diameter, septum, holes.length)
    };
    // 9.67e-5 per photon, 8.60e-5 per decay. Measured by NEMA's method: 5460 counts per minute and MBq. Septal penetration, which raises
    // the sensitivity of a GE LEHR by 4.8 %, is not in the geometry.
    let symbia = per_decay * detected(ParallelHoles::SIEMENS_LEHR, 0.016);
    assert!((5460.0 / 60e6 / symbia - 1.058).abs() < 2e-3, "{symbia}");
    // 8.49e-5 per photon; by Monte Carlo with opaque septa 8.7e-5 (section 4).
    let discovery = detected(ParallelHoles::GE_LEHR, 0.02);
    assert!((discovery / 8.7e-5 - 0.976).abs() < 2e-3, "{discovery}");
}

#[test]
fn attenuation_beside_tables_of_nist() {
    // Mass attenuation in cm^2/g at 100 and 150 keV (J. H. Hubbell and S. M. Seltzer, NISTIR 5632, tables 3 and 4); a power law between them.
    let at_140 = |low: f64, high: f64| low * (high / low).powf(1.405_f64.ln() / 1.5_f64.ln());
    let (muscle, bone) = (at_140(0.1693, 0.1492), at_140(0.1855, 0.1480));
    let organs = Chest::default().organs().unwrap();
    // Densities of `Chest`: soft tissue, lung, skeleton. The skeleton contains marrow.
    for (organ, density, published, within) in [
        (0, 1.04, muscle, 2e-3),
        (1, 0.296, muscle, 2e-3),
        (4, 1.4, bone, 7e-3),
    ] {
        let ours = organs.as_slice()[organ].attenuation / density;
        assert!(
            (ours / published - 1.0).abs() < within,
            "{ours} {published}"
        );
    }
    let lead = 11.35 * at_140(5.549, 2.014);
    assert!(
        (ParallelHoles::LEAD_140_KEV / lead - 1.0).abs() < 1e-3,
        "{lead}"
    );
}

/// The heart of `chest.toml` at end-diastole without noise, with or without the chest.
fn heart(bins: usize, pitch: f64, has_chest: bool) -> Scene {
    let text = include_str!("../../../crates/heart-phantom/scenes/chest.toml");
    let mut scene = Scene::from_toml(text).unwrap();
    (scene.camera.bins, scene.camera.rows) = (bins, bins);
    scene.camera.pitch = [pitch; 2];
    scene.camera.views = 4;
    scene.noise = None;
    scene.acquisition.mode = Mode::Static { phase: 0.0 };
    if !has_chest {
        scene.chest = None;
        scene.output.write = Vec::new();
        scene.camera.radius = Orbit::Circle(18.0);
    }
    scene
}

/// Relative L2 difference from `b`, and the largest difference relative to the largest sample of `b`.
fn apart<T: Copy + Into<f64>>(a: &[T], b: &[T]) -> [f64; 2] {
    let pairs = || a.iter().zip(b).map(|(&a, &b)| (a.into(), b.into()));
    let square: f64 = pairs().map(|(a, b)| (a - b) * (a - b)).sum();
    let norm: f64 = pairs().map(|(_, b)| b * b).sum();
    let [most, size] = pairs().fold([0.0f64; 2], |[most, size], (a, b)| {
        [most.max((a - b).abs()), size.max(b.abs())]
    });
    [(square / norm).sqrt(), most / size]
}

#[test]
fn spread_of_gaussian_models_in_exact_views() {
    // Relative L2 and largest differences of the views by Anger's formula and of round holes from those of hexagonal holes, in 8 views: in the
    // chest on an orbit along the contour, and of the heart alone at 18 cm.
    for (has_chest, anger, round) in [
        (true, [0.0054, 0.0200], [0.0019, 0.0072]),
        (false, [0.0209, 0.0304], [0.0076, 0.0111]),
    ] {
        let views = |response| {
            let mut scene = heart(64, 0.64, has_chest);
            scene.collimator = Some(CollimatorSettings {
                holes: HolesSettings::Parallel(ParallelHoles {
                    response,
                    ..ParallelHoles::GE_LEHR
                }),
                intrinsic_fwhm: 0.38,
            });
            let phantom = Phantom::new(scene).unwrap();
            phantom.sinograms(0, &no_observer).unwrap().samples
        };
        let hexagonal = views(HoleResponse::Hexagonal);
        for (response, expected) in [(HoleResponse::Anger, anger), (HoleResponse::Round, round)] {
            let found = apart(&views(response), &hexagonal);
            for (found, expected) in found.into_iter().zip(expected) {
                // rounded; the views are accurate to 1e-3 of the largest sample
                assert!((found - expected).abs() < 1e-3, "{response:?}: {found}");
            }
        }
    }
}

/// Convolution of a plane of n x n cells with a kernel of (2 m + 1)^2 values, zero outside.
fn convolve(plane: &[f64], n: usize, kernel: &[f64], out: &mut [f64]) {
    let m = kernel.len().isqrt() / 2;
    for (at, _) in plane.iter().enumerate().filter(|(_, value)| **value != 0.0) {
        let (row, column) = (at / n, at % n);
        for (k, weight) in kernel.iter().enumerate() {
            let (i, j) = (row + k / (2 * m + 1), column + k % (2 * m + 1));
            if (m..n + m).contains(&i) && (m..n + m).contains(&j) {
                out[(i - m) * n + j - m] += weight * plane[at];
            }
        }
    }
}

/// Cell averages of a response with this reach on cells of size `pitch`, of sum 1.
fn kernel(pitch: f64, reach: f64, response: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
    let (m, parts) = ((reach / pitch).ceil() as i32, 4);
    let place = |cell: i32, part: i32| {
        pitch * (f64::from(cell) + (f64::from(part) + 0.5) / f64::from(parts) - 0.5)
    };
    let cells = (-m..=m).flat_map(|i| (-m..=m).map(move |j| (i, j)));
    let values: Vec<f64> = cells
        .map(|(i, j)| {
            let points = (0..parts * parts).map(|k| (k / parts, k % parts));
            points
                .map(|(a, b)| response([place(i, a), place(j, b)]))
                .sum()
        })
        .collect();
    let sum: f64 = values.iter().sum();
    values.into_iter().map(|value| value / sum).collect()
}

#[test]
fn spread_of_gaussians_and_the_response_of_holes() {
    let (n, pitch) = (56, 0.3);
    let phantom = Phantom::new(heart(n, pitch, false)).unwrap();
    let volume = phantom.truth(0).unwrap();
    let holes = ParallelHoles::GE_LEHR;
    let length = holes.effective_length().unwrap();
    let gaussian =
        |sigma: f64| move |[x, y]: [f64; 2]| (-(x * x + y * y) / (2.0 * sigma * sigma)).exp();
    // A view from the front: planes of constant y, the collimator face at y = -11, the chest's surface less 1 cm.
    let view = |model: Result<HoleResponse, Hole>| {
        let mut sum = vec![0.0; n * n];
        for y in 0..n {
            let plane: Vec<f64> = (0..n * n)
                .map(|k| f64::from(volume[(k / n * n + y) * n + k % n]))
                .collect();
            let distance = 11.0 + pitch * (y as f64 - 0.5 * (n as f64 - 1.0));
            let base = holes.diameter * (length + distance) / length;
            let kernel = match model {
                Ok(response) => {
                    let holes = ParallelHoles { response, ..holes };
                    let sigma = Collimator::parallel_holes(&holes, 0.0)
                        .unwrap()
                        .sigma(distance);
                    kernel(pitch, 4.0 * sigma, gaussian(sigma))
                }
                Err(hole) => kernel(pitch, 1.2 * base, |v| hole.shared(v.map(|v| v / base))),
            };
            convolve(&plane, n, &kernel, &mut sum);
        }
        let mut view = vec![0.0; n * n];
        let crystal = 0.38 / (8.0 * 2.0_f64.ln()).sqrt();
        convolve(
            &sum,
            n,
            &kernel(pitch, 4.0 * crystal, gaussian(crystal)),
            &mut view,
        );
        view
    };
    let own = view(Err(Hole::Hexagonal));
    // With voxels of half the size: 0.0113 and 0.0187, 0.0012 and 0.0026.
    let [square, most] = apart(&view(Ok(HoleResponse::Anger)), &own);
    assert!((square - 0.0105).abs() < 1e-3 && (most - 0.0186).abs() < 1e-3);
    for (gaussian, own) in [
        (HoleResponse::Hexagonal, own),
        (HoleResponse::Round, view(Err(Hole::Round))),
    ] {
        let [square, most] = apart(&view(Ok(gaussian)), &own);
        assert!(
            square < 0.002 && most < 0.003,
            "{gaussian:?}: {square} {most}"
        );
    }
}
