//! Springs of spectral elements: forces at closed-form equilibria, tangents and gradients against differences.

use membrane_forces::{
    DiscreteMembrane, LinearEquilibrium, Measure, Membrane, PressureLaw, ReferenceShape,
    SpectralElements, Stiffness,
};
use std::f64::consts::PI;

fn sum_of_forces(d: &SpectralElements, x: &[f64], intensity: f64) -> Vec<f64> {
    let (mut elastic, mut sum) = (vec![f64::NAN; x.len()], vec![f64::NAN; x.len()]);
    d.forces_into(x, intensity, &mut elastic, &mut sum).unwrap();
    // a scratch may have any numbers where the membrane is fixed
    d.elastic_force_into(x, &mut elastic);
    let mut pressure = vec![f64::NAN; x.len()];
    d.pressure_force_into(x, intensity, &mut pressure).unwrap();
    for ((sum, e), p) in sum.iter().zip(&elastic).zip(&pressure) {
        assert!((sum - e - p).abs() <= 1e-12 * (e.abs() + p.abs()));
    }
    sum
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
}

/// Pressure and springs balance at the exact shapes, inside elements and where they meet, on the half and on the whole curve.
#[test]
fn forces_vanish_at_closed_forms() {
    let (kappa, ratio) = (1.7, 6.0);
    let balloon = LinearEquilibrium::balloon(8.5, 1.75, kappa, 1.0).unwrap();
    let disc = LinearEquilibrium::disc(1.3, kappa, 1.0).unwrap();
    let circle = LinearEquilibrium::circle(1.3, ratio).unwrap();
    type Shape<'a> = Box<dyn Fn(f64) -> [f64; 2] + 'a>;
    let cases: [(ReferenceShape, PressureLaw, f64, Shape<'_>); 3] = [
        (
            ReferenceShape::balloon(8.5, 1.75).unwrap(),
            PressureLaw::PerCurrentLength,
            kappa,
            Box::new(|s| balloon.at(s).position),
        ),
        (
            ReferenceShape::disc(1.3).unwrap(),
            PressureLaw::PerCurrentLength,
            kappa,
            Box::new(|s| disc.at(s).position),
        ),
        (
            ReferenceShape::disc(1.3).unwrap(),
            PressureLaw::PerMaterialLength,
            ratio,
            Box::new(|s| circle.at(s).position),
        ),
    ];
    for (rest, law, load, shape) in cases {
        // a breakpoint without a jump on one side only makes the elements asymmetric
        for breaks in [&[][..], &[0.3]] {
            let unit = Stiffness::function(|_| 1.0, breaks).unwrap();
            let membrane = Membrane::new(rest.clone())
                .with_stiffness(unit)
                .with_law(law);
            let d = SpectralElements::new(&membrane, 20, 2).unwrap();
            let count = d.start().len() / 2;
            let s = d.positions().into_iter().take(count);
            let mut x: Vec<f64> = s.flat_map(&shape).collect();
            d.fixed().iter().for_each(|&k| x[k] = d.start()[k]);
            let force = sum_of_forces(&d, &x, load);
            let mut elastic = vec![0.0; x.len()];
            d.elastic_force_into(&x, &mut elastic);
            let (off, size) = (largest(&force), largest(&elastic));
            // rounding of positions times p^4 divided by the square of an element
            assert!(
                off < 1e-8 * size,
                "{law:?}, {breaks:?}: {off:e} of {size:e}"
            );
            assert!(off > 0.0 && size > 0.1);
        }
    }
}

fn smooth(d: &SpectralElements, amplitude: f64, frequency: f64) -> Vec<f64> {
    let count = d.start().len() / 2;
    let at = |s: f64| [frequency * s, 1.3 * frequency * s].map(|a| amplitude * (a + 0.4).sin());
    let mut out: Vec<f64> = d.positions().into_iter().take(count).flat_map(at).collect();
    d.fixed().iter().for_each(|&k| out[k] = 0.0);
    out
}

#[test]
fn tangents_are_the_derivatives() {
    for law in [
        PressureLaw::PerMaterialLength,
        PressureLaw::TotalForce,
        PressureLaw::PerCurrentLength,
    ] {
        for skew in [0.0, 0.4] {
            let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
                .with_stiffness(Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap())
                .with_second_neighbours(Stiffness::constant(0.2).unwrap())
                .with_law(law);
            let d = SpectralElements::new(&membrane, 9, 2).unwrap();
            assert_eq!(d.is_half(), skew == 0.0);
            let bump = smooth(&d, 0.3, 4.0);
            let x: Vec<f64> = d.start().iter().zip(&bump).map(|(x, b)| x + b).collect();
            let along = smooth(&d, 1.0, 7.0);
            let intensity = 3.7;
            let mut tangent = d.tangent();
            d.tangent_into(&x, intensity, &mut tangent).unwrap();
            let mut product = vec![f64::NAN; x.len()];
            tangent.mul_into(&along, &mut product);
            // a central difference over 1e-5: 1e-10 of the third derivative, 1e-11 of rounding
            let force = |e: f64| {
                let moved: Vec<f64> = x.iter().zip(&along).map(|(x, a)| x + e * a).collect();
                sum_of_forces(&d, &moved, intensity)
            };
            let (after, before) = (force(1e-5), force(-1e-5));
            for (i, product) in product.iter().enumerate() {
                let change = (after[i] - before[i]) / 2e-5;
                let off = (product - change).abs();
                assert!(off < 1e-7 * largest(&after), "{law:?} {skew}, {i}: {off:e}");
            }
            // rows of fixed numbers are those of the unit matrix
            let unit: Vec<f64> = (0..x.len()).map(|i| 1.0 + i as f64).collect();
            tangent.mul_into(&unit, &mut product);
            assert!(d.fixed().iter().all(|&k| product[k] == unit[k]));
            // and their columns
            for &held in d.fixed() {
                let mut moved = vec![0.0; x.len()];
                moved[held] = 1.0;
                tangent.mul_into(&moved, &mut product);
                assert_eq!(product, moved);
            }
        }
    }
}

/// A line from (0, 2) to (1, -1) crosses the axis inside an element, at s = 2/3.
#[test]
fn measures_are_exact_where_an_element_crosses_the_axis() {
    let skew = Stiffness::function(|s| 1.0 + s, &[]).unwrap();
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap()).with_stiffness(skew);
    let d = SpectralElements::new(&membrane, 6, 2).unwrap();
    assert!(!d.is_half());
    let x: Vec<f64> = (d.positions().into_iter())
        .flat_map(|s| [s, 2.0 - 3.0 * s])
        .collect();
    let found = d.measures(&x).unwrap();
    // cones of slant heights 2 and 1 times sqrt(10) / 3, radii 2 and 1, heights 2/3 and 1/3: half of each, the second one negative in volume
    let slant = 10.0f64.sqrt() / 3.0;
    let surface = 0.5 * PI * slant * (2.0 * 2.0 + 1.0);
    let volume = 0.5 * PI / 3.0 * (4.0 * 2.0 / 3.0 - 1.0 / 3.0);
    assert!((found.length / (3.0 * slant) - 1.0).abs() < 1e-14);
    assert!(
        (found.surface / surface - 1.0).abs() < 1e-14,
        "{}",
        found.surface / surface
    );
    assert!((found.volume / volume - 1.0).abs() < 1e-14);
}

/// Each coordinate, also of fixed nodes and on either side of the axis.
#[test]
fn gradients_are_the_derivatives_of_measures() {
    for skew in [0.0, 0.4] {
        let membrane = Membrane::new(ReferenceShape::balloon(3.0, 1.75).unwrap())
            .with_stiffness(Stiffness::function(move |s| 1.0 + skew * s, &[]).unwrap());
        let d = SpectralElements::new(&membrane, 7, 1).unwrap();
        for amplitude in [0.1, -3.0] {
            let bump = smooth(&d, amplitude, 4.0);
            let x: Vec<f64> = d.start().iter().zip(&bump).map(|(x, b)| x + b).collect();
            let crosses = x.as_chunks::<2>().0[1..x.len() / 4]
                .iter()
                .any(|p| p[1] < 0.0);
            assert_eq!(crosses, amplitude < 0.0);
            for measure in [
                Measure::Length,
                Measure::Area,
                Measure::Surface,
                Measure::Volume,
            ] {
                // where the curve crosses the axis, the parts of a rule for roots move with the nodes
                if crosses && matches!(measure, Measure::Length | Measure::Surface) {
                    continue;
                }
                let mut gradient = vec![f64::NAN; x.len()];
                d.measure_gradient_into(measure, &x, &mut gradient);
                let size = largest(&gradient);
                for k in 0..x.len() {
                    // the apex of half a curve stays on the axis
                    if d.is_half() && k == x.len() - 1 {
                        continue;
                    }
                    let value = |e: f64| {
                        let mut moved = x.clone();
                        moved[k] += e;
                        d.measure(measure, &moved).unwrap()
                    };
                    let slope = (value(1e-5) - value(-1e-5)) / 2e-5;
                    let off = (gradient[k] - slope).abs();
                    assert!(
                        off < 1e-6 * size,
                        "{measure:?} {skew} {amplitude}, {k}: {off:e}"
                    );
                }
                let all = d.measures(&x).unwrap();
                let one = d.measure(measure, &x).unwrap();
                let same = match measure {
                    Measure::Length => all.length,
                    Measure::Area => all.area,
                    Measure::Surface => all.surface,
                    Measure::Volume => all.volume,
                };
                assert!(
                    (one / same - 1.0).abs() < 1e-12,
                    "{measure:?}: {one} {same}"
                );
            }
        }
    }
}
