//! The half curve against the whole one: forces, tangents, measures and gradients on mirror images.

use std::f64::consts::{PI, TAU};

use membrane_forces::{
    DiscreteMembrane, FiniteDifferences, Measure, Measures, Membrane, MembraneError, PressureLaw,
    ReferenceShape, Rubber, SpectralElements, Stiffness, StrainEnergy, Tangent, Thickness,
};

const LAWS: [PressureLaw; 3] = [
    PressureLaw::PerMaterialLength,
    PressureLaw::TotalForce,
    PressureLaw::PerCurrentLength,
];
const MEASURES: [Measure; 4] = [
    Measure::Length,
    Measure::Area,
    Measure::Surface,
    Measure::Volume,
];

fn membrane(law: PressureLaw, second: bool) -> Membrane {
    let stiffness = |a: f64| Stiffness::function(move |s| 1.0 + a * (TAU * s).cos(), &[]).unwrap();
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
        .with_stiffness(stiffness(0.5))
        .with_ends([[0.5, 1.75], [0.5, -1.75]])
        .unwrap()
        .with_law(law);
    if second {
        membrane.with_second_neighbours(stiffness(-0.3))
    } else {
        membrane
    }
}

/// Adds a mirror-symmetric displacement to `start`, the first nodes of `n`.
fn displaced(start: &[f64], n: usize, amplitude: f64) -> Vec<f64> {
    let mut nodes = start.to_vec();
    for (k, node) in nodes
        .as_chunks_mut::<2>()
        .0
        .iter_mut()
        .enumerate()
        .skip(1)
        .take(n - 2)
    {
        let s = (k as f64 / (n - 1) as f64 - 0.5) * TAU;
        node[0] += amplitude * (1.0 + s.cos()) * (1.0 + 0.4 * (3.0 * s).cos());
        node[1] -= amplitude * (s.sin() + 0.3 * (2.0 * s).sin());
    }
    nodes
}

/// Largest difference of the first numbers of `whole` from `half`, over the size of `whole`.
fn distance(half: &[f64], whole: &[f64]) -> f64 {
    let size = whole.iter().fold(1.0f64, |m, v| m.max(v.abs()));
    let pairs = half.iter().zip(whole);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

fn times(tangent: &Tangent, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    tangent.mul_into(x, &mut out);
    out
}

#[test]
fn the_half_curve_has_the_forces_and_measures_of_the_whole() {
    for n in [3, 4, 5, 6, 7, 8, 41, 42] {
        for law in LAWS {
            for second in [false, true] {
                let membrane = membrane(law, second);
                let whole = FiniteDifferences::new(&membrane, n).unwrap();
                let half = FiniteDifferences::half(&membrane, n).unwrap();
                assert!(half.is_half() && half.start().len() == 2 * n.div_ceil(2));
                let (x, d) = (
                    displaced(whole.start(), n, 0.4),
                    displaced(&vec![0.0; 2 * n], n, 1.0),
                );
                let (mut x_half, mut d_half) = (
                    displaced(half.start(), n, 0.4),
                    displaced(&vec![0.0; half.start().len()], n, 1.0),
                );
                if n % 2 == 1 {
                    // the sine at the apex is not exactly zero
                    *x_half.last_mut().unwrap() = 0.0;
                    *d_half.last_mut().unwrap() = 0.0;
                }
                let case = format!("N {n}, {law:?}, second neighbours {second}");
                // rounding of x, amplified by 1 / ds^2, over forces of about that size
                let check = |name: &str, a: &[f64], b: &[f64]| {
                    let off = distance(a, b);
                    assert!(off < 1e-12, "{case}, {name}: {off:e}");
                };
                let (mut a, mut b) = (vec![f64::NAN; d_half.len()], vec![f64::NAN; d.len()]);
                half.elastic_force_into(&x_half, &mut a);
                whole.elastic_force_into(&x, &mut b);
                check("elastic force", &a, &b);
                let energy = |d: &FiniteDifferences, x: &[f64]| d.elastic_energy(x).unwrap();
                let energies = (energy(&half, &x_half), energy(&whole, &x));
                check("elastic energy", &[energies.0], &[energies.1]);
                // quadratic, so that a central difference is the derivative up to rounding: 1e-16 over the step 1e-4
                let at = |sign: f64| -> Vec<f64> {
                    let moved = x.iter().zip(&d).map(|(x, d)| x + sign * 1e-4 * d);
                    moved.collect()
                };
                let by_force = whole.ds() * b.iter().zip(&d).map(|(f, d)| f * d).sum::<f64>();
                let rise = energy(&whole, &at(1.0)) - energy(&whole, &at(-1.0));
                let (slope, size) = (rise / 2e-4, energies.1.abs() + by_force.abs());
                assert!(
                    (slope + by_force).abs() < 1e-9 * size,
                    "{case}: {slope}, {by_force}"
                );
                half.pressure_force_into(&x_half, 3.0, &mut a).unwrap();
                whole.pressure_force_into(&x, 3.0, &mut b).unwrap();
                check("pressure force", &a, &b);

                let (mut tangent, mut full) = (half.tangent(), whole.tangent());
                half.tangent_into(&x_half, 1.5, &mut tangent).unwrap();
                whole.tangent_into(&x, 1.5, &mut full).unwrap();
                check("tangent", &times(&tangent, &d_half), &times(&full, &d));

                for measure in MEASURES {
                    let name = format!("{measure:?}");
                    check(
                        &name,
                        &[half.measure(measure, &x_half).unwrap()],
                        &[whole.measure(measure, &x).unwrap()],
                    );
                    half.measure_gradient_into(measure, &x_half, &mut a);
                    whole.measure_gradient_into(measure, &x, &mut b);
                    // both free: a change of the half is a change of its image too
                    let dot =
                        |g: &[f64], d: &[f64]| g.iter().zip(d).map(|(g, d)| g * d).sum::<f64>();
                    check(&name, &[dot(&a, &d_half)], &[dot(&b, &d)]);
                }
                let points = half.points(&x_half).unwrap();
                check("points", points.as_flattened(), &x);
                assert_eq!(half.blow_up(), whole.blow_up());
            }
        }
    }
}

#[test]
fn asymmetric_membranes_are_whole_curves() {
    let rest = || ReferenceShape::balloon(8.5, 1.75).unwrap();
    let skew = Stiffness::function(|s| 1.0 + 1e-9 * s, &[]).unwrap();
    let ends = [[0.0, 1.75], [1e-9, -1.75]];
    for membrane in [
        Membrane::new(rest()).with_stiffness(skew.clone()),
        Membrane::new(rest()).with_second_neighbours(skew),
        Membrane::new(rest()).with_ends(ends).unwrap(),
        Membrane::new(ReferenceShape::polyline(&[[0.0, 1.0], [1.0, 0.1], [0.0, -1.0]]).unwrap()),
    ] {
        let half = FiniteDifferences::half(&membrane, 41).unwrap();
        assert!(!half.is_half() && half.start().len() == 82);
        assert_eq!(half.fixed(), [0, 1, 80, 81]);
    }
}

/// Jumps that are mirror images: where elements meet, each has the stiffness of its own side.
#[test]
fn mirrored_jumps_of_the_stiffness_allow_half_a_curve() {
    let rest = || ReferenceShape::balloon(8.5, 1.75).unwrap();
    let step = |left: f64, right: f64| {
        let value = move |s: f64| {
            if s < 0.3 {
                left
            } else if s < 0.7 {
                1.0
            } else {
                right
            }
        };
        Membrane::new(rest()).with_stiffness(Stiffness::function(value, &[0.3, 0.7]).unwrap())
    };
    for (left, right) in [(3.0, 3.0), (3.0, 3.0 + 1e-9)] {
        let membrane = step(left, right);
        let spectral = SpectralElements::new(&membrane, 8, 2).unwrap();
        assert_eq!(spectral.is_half(), left == right);
        let differences = FiniteDifferences::half(&membrane, 41).unwrap();
        assert_eq!(differences.is_half(), left == right);
    }
}

/// The nodes of a half curve are those of the first half, and their mirror images.
#[test]
fn positions_of_a_half_curve_are_symmetric() {
    let membrane = membrane(PressureLaw::PerMaterialLength, false);
    let half = SpectralElements::new(&membrane, 6, 2).unwrap();
    assert!(half.is_half());
    let s = half.positions();
    assert!(s.is_sorted_by(|a, b| a < b) && s[0] == 0.0, "{s:?}");
    for (a, b) in s.iter().zip(s.iter().rev()) {
        assert!((a + b - 1.0).abs() < 1e-15, "{s:?}");
    }
}

/// As documented, `Measures::of` of the nodes up to the axis is half; the measures of the discretisation are of the whole curve.
#[test]
fn measures_of_half_a_state_are_half() {
    let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap()).with_rubber(rubber);
    let d = FiniteDifferences::new(&membrane, 51).unwrap();
    assert!(d.is_half());
    let whole = d.measures(d.start()).unwrap();
    let half = Measures::of(d.start().as_chunks().0);
    for (half, whole) in [
        (half.length, whole.length),
        (half.surface, whole.surface),
        (half.volume, whole.volume),
    ] {
        assert!((2.0 * half / whole - 1.0).abs() < 1e-14, "{half} {whole}");
    }
    let points = Measures::of(&d.points(d.start()).unwrap());
    assert!((points.volume / whole.volume - 1.0).abs() < 1e-14);
}

/// The rounding of the length of a short piece between a kink of the profile and the end of the cylinder breaks no symmetry; breakpoints that
/// polynomials cannot tell apart are rejected.
#[test]
fn kinks_near_the_end_of_the_cylinder_leave_the_membrane_symmetric() {
    let values = [0.15, 0.12, 0.05, 0.08, 0.16, 0.08, 0.05, 0.12, 0.15];
    for k in 4..52 {
        for side in [1.0, -1.0] {
            let apart: f64 = side * 10f64.powf(-0.25 * f64::from(k));
            // the end of the cylinder beside the kink at 3/8
            let end = 0.375 - apart;
            let rest = ReferenceShape::balloon(end * PI / (1.0 - 2.0 * end), 1.0).unwrap();
            let springs =
                Membrane::new(rest.clone()).with_stiffness(Stiffness::samples(&values).unwrap());
            let thickness = Thickness::samples(&values).unwrap();
            let rubber = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, thickness).unwrap();
            let rubber = Membrane::new(rest).with_rubber(rubber);
            for membrane in [springs, rubber] {
                let made = SpectralElements::new(&membrane, 10, 2);
                // either side of both limits
                if (1.1e-12..0.9e-7).contains(&apart.abs()) {
                    assert!(
                        matches!(made, Err(MembraneError::CloseBreakpoints { .. })),
                        "{apart:e}"
                    );
                } else if !(0.9e-12..1.1e-7).contains(&apart.abs()) {
                    assert!(made.is_ok_and(|made| made.is_half()), "{apart:e}");
                }
            }
        }
    }
}
