//! Tangents and gradients against differences, measures and equilibria against closed forms.

use membrane_forces::{
    DiscreteMembrane, FiniteDifferences, LinearEquilibrium, Measure, Measures, Membrane,
    PressureLaw, ReferenceShape, Rubber, SpectralElements, Stiffness, StrainEnergy, Thickness,
};
use std::f64::consts::PI;

const LAWS: [PressureLaw; 3] = [
    PressureLaw::PerMaterialLength,
    PressureLaw::TotalForce,
    PressureLaw::PerCurrentLength,
];

fn membrane(law: PressureLaw) -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
        .with_stiffness(Stiffness::function(|s| 1.0 + 0.5 * (5.0 * s).sin(), &[]).unwrap())
        .with_second_neighbours(Stiffness::constant(0.1).unwrap())
        .with_law(law)
}

/// A smooth displacement that vanishes at the ends and is not symmetric.
fn bump(n: usize, scale: f64) -> Vec<f64> {
    (0..n)
        .flat_map(|k| {
            let s = k as f64 / (n - 1) as f64;
            let envelope = scale * s * (1.0 - s);
            [
                envelope * (3.0 + (7.0 * s).sin()),
                envelope * (1.0 + (11.0 * s).cos()),
            ]
        })
        .collect()
}

/// Remainders |F(x + e d) - F(x) - e F'(x) d| fall by 4 when e is halved if F' is the derivative.
fn taylor_slope(
    force: impl Fn(&[f64]) -> Vec<f64>,
    derivative: &[f64],
    x: &[f64],
    d: &[f64],
) -> f64 {
    let at = force(x);
    let remainder = |e: f64| {
        let moved: Vec<f64> = x.iter().zip(d).map(|(x, d)| x + e * d).collect();
        let there = force(&moved);
        let squares = (0..at.len()).map(|i| (there[i] - at[i] - e * derivative[i]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    (remainder(2e-3) / remainder(1e-3)).log2()
}

#[test]
fn tangents_of_differences_are_the_derivatives() {
    for law in LAWS {
        let n = 41;
        let differences = FiniteDifferences::new(&membrane(law), n).unwrap();
        let x: Vec<f64> = differences
            .start()
            .iter()
            .zip(bump(n, 1.0))
            .map(|(x, b)| x + b)
            .collect();
        let d: Vec<f64> = bump(n, 1.0).iter().rev().copied().collect();
        let load = if law == PressureLaw::TotalForce {
            900.0
        } else {
            5.0
        };
        let intensity = |x: &[f64]| match law {
            PressureLaw::TotalForce => load / differences.measure(Measure::Surface, x).unwrap(),
            _ => load,
        };
        let force = |x: &[f64]| {
            let (mut pressure, mut elastic) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
            differences
                .pressure_force_into(x, intensity(x), &mut pressure)
                .unwrap();
            differences.elastic_force_into(x, &mut elastic);
            // the elastic part is linear: keep its rounding out of the remainder
            (0..2 * n)
                .map(|i| pressure[i] + 1e-3 * elastic[i])
                .collect::<Vec<_>>()
        };
        let (mut tangent, mut elastic) = (differences.tangent(), differences.tangent());
        differences
            .tangent_into(&x, intensity(&x), &mut tangent)
            .unwrap();
        differences.tangent_into(&x, 0.0, &mut elastic).unwrap();
        let (mut derivative, mut pull) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        tangent.mul_into(&d, &mut derivative);
        elastic.mul_into(&d, &mut pull);
        for (derivative, pull) in derivative.iter_mut().zip(pull) {
            *derivative += (1e-3 - 1.0) * pull;
        }
        let (mut column, mut row) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        if law == PressureLaw::TotalForce {
            let surface = differences.measure(Measure::Surface, &x).unwrap();
            differences
                .pressure_force_into(&x, -load / surface.powi(2), &mut column)
                .unwrap();
            differences.measure_gradient_into(Measure::Surface, &x, &mut row);
        }
        let along: f64 = row.iter().zip(&d).map(|(r, d)| r * d).sum();
        derivative
            .iter_mut()
            .zip(&column)
            .for_each(|(out, c)| *out += c * along);

        if law == PressureLaw::PerCurrentLength {
            // linear: the remainder is rounding, so compare the derivative itself
            let moved: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + d).collect();
            let (there, here) = (force(&moved), force(&x));
            for i in 0..2 * n {
                assert!((there[i] - here[i] - derivative[i]).abs() < 1e-10);
            }
        } else {
            let slope = taylor_slope(force, &derivative, &x, &d);
            assert!((slope - 2.0).abs() < 0.05, "{law:?}: {slope}");
        }
    }
}

#[test]
fn gradients_of_measures_are_the_derivatives() {
    let n = 40; // no node at the apex: a segment crosses the axis
    let differences = FiniteDifferences::new(&membrane(LAWS[0]), n).unwrap();
    let spectral = SpectralElements::new(&membrane(LAWS[0]), 8, 1).unwrap();
    assert!(!spectral.is_half());
    for measure in [
        Measure::Length,
        Measure::Area,
        Measure::Surface,
        Measure::Volume,
    ] {
        let x: Vec<f64> = differences
            .start()
            .iter()
            .zip(bump(n, 1.0))
            .map(|(x, b)| x + b)
            .collect();
        let d: Vec<f64> = (0..2 * n).map(|k| (k as f64).sin()).collect();
        let mut gradient = vec![0.0; 2 * n];
        differences.measure_gradient_into(measure, &x, &mut gradient);
        let slope: f64 = gradient.iter().zip(&d).map(|(g, d)| g * d).sum();
        let value = |x: &[f64]| vec![differences.measure(measure, x).unwrap()];
        let along = taylor_slope(value, &[slope], &x, &d);
        assert!((along - 2.0).abs() < 0.05, "polyline {measure:?}: {along}");
        let (points, moving) = (x.as_chunks().0, d.as_chunks().0);
        let along = taylor_slope(value, &[measure.rate(points, moving).unwrap()], &x, &d);
        assert!((along - 2.0).abs() < 0.05, "rate of {measure:?}: {along}");

        let x = spectral.start();
        let d: Vec<f64> = (0..x.len()).map(|k| 0.3 * (k as f64).sin()).collect();
        let mut gradient = vec![0.0; x.len()];
        spectral.measure_gradient_into(measure, x, &mut gradient);
        let slope: f64 = gradient.iter().zip(&d).map(|(g, d)| g * d).sum();
        let value = |x: &[f64]| vec![spectral.measure(measure, x).unwrap()];
        let along = taylor_slope(value, &[slope], x, &d);
        assert!((along - 2.0).abs() < 0.1, "spectral {measure:?}: {along}");
    }
}

#[test]
fn measures_of_the_reference_balloon_agree_with_closed_forms() {
    let (h, r) = (8.5, 1.75);
    let exact = Measures {
        length: 2.0 * h + PI * r,
        area: r * (2.0 * h + 0.5 * PI * r),
        surface: 2.0 * PI * r * (h + r),
        volume: PI * r * r * (h + 2.0 * r / 3.0),
    };
    let rest = LinearEquilibrium::balloon(h, r, 0.0, 1.0)
        .unwrap()
        .measures();
    for (a, b) in [
        (rest.length, exact.length),
        (rest.area, exact.area),
        (rest.surface, exact.surface),
        (rest.volume, exact.volume),
    ] {
        assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
    }
    let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let spectral = SpectralElements::new(&balloon, 16, 1).unwrap();
    assert!(spectral.is_half());
    let found = spectral.measures(spectral.start()).unwrap();
    let error = |n: usize| {
        let differences = FiniteDifferences::new(&balloon, n).unwrap();
        let m = Measures::of(differences.start().as_chunks().0);
        assert_eq!(m, differences.measures(differences.start()).unwrap());
        [
            m.length - exact.length,
            m.area - exact.area,
            m.surface - exact.surface,
            m.volume - exact.volume,
        ]
    };
    // polylines: order two, with some scatter because no node is at the start of the cap
    for (a, b) in error(101).iter().zip(error(801)) {
        assert!(((a / b).log2() / 3.0 - 2.0).abs() < 0.1, "{a} {b}");
    }
    for (found, exact) in [
        (found.length, exact.length),
        (found.area, exact.area),
        (found.surface, exact.surface),
        (found.volume, exact.volume),
    ] {
        assert!((found / exact - 1.0).abs() < 1e-14, "{found} {exact}");
    }
}

#[test]
fn linear_equilibria_agree_with_the_reference_and_solve_their_equation() {
    for (kappa, volume, area, length) in [
        (1.0, 180.00034338, 50.244070193, 25.4308996664),
        (4.0, 2759.41056007, 264.37919694, 55.439401175),
    ] {
        let exact = LinearEquilibrium::balloon(8.5, 1.75, kappa, 1.0).unwrap();
        let m = exact.measures();
        // the reference prints 11 to 12 digits
        assert!((m.volume / volume - 1.0).abs() < 5e-11, "{}", m.volume);
        assert!((m.area / area - 1.0).abs() < 5e-11, "{}", m.area);
        assert!((m.length / length - 1.0).abs() < 5e-11, "{}", m.length);
        assert!(exact.at(0.5).position[1].abs() < 1e-12);
        let rest = ReferenceShape::balloon(8.5, 1.75).unwrap();
        for s in [0.1, 0.45, 0.55, 0.9] {
            let (c, c0) = (exact.at(s), rest.at(s));
            for (force, rest) in [
                (c.second[0] - kappa * c.first[1], c0.second[0]),
                (c.second[1] + kappa * c.first[0], c0.second[1]),
            ] {
                assert!((force - rest).abs() < 1e-10 * (1.0 + rest.abs()));
            }
        }
    }
}

#[test]
fn disc_under_either_law_is_an_arc() {
    for ratio in [1e-6, 0.1, 1.0, 1.5, 2.0, 4.0, 40.0] {
        let (r, circle) = (1.5, LinearEquilibrium::circle(1.5, ratio).unwrap());
        // the equation of the angle, and the same arc under a pressure
        let mu = circle.kappa();
        assert!((r * mu * mu / (ratio * (0.5 * mu).sin()) - 1.0).abs() < 1e-14);
        assert_eq!(circle, LinearEquilibrium::disc(r, mu, 1.0).unwrap());
        // an arc of radius r / sin(mu / 2) about a centre on the axis
        let (half, arc) = (0.5 * mu, r / (0.5 * mu).sin());
        for s in [0.0, 0.2, 0.5, 0.9, 1.0] {
            let angle = mu * (0.5 - s);
            let exact = [arc * (angle.cos() - half.cos()), arc * angle.sin()];
            let found = circle.at(s).position;
            let off = (found[0] - exact[0]).hypot(found[1] - exact[1]);
            // rounding of terms as large as the radius
            assert!(off < 1e-15 * (arc + 10.0), "{ratio} {s} {off:e}");
        }
        let m = circle.measures();
        let height = r * (0.5 * half).tan();
        let volume = PI * height * (3.0 * r * r + height * height) / 6.0;
        for (found, exact) in [
            (m.length, arc * mu),
            (m.surface, PI * (r * r + height * height)),
            (m.volume, volume),
        ] {
            assert!(
                (found / exact - 1.0).abs() < 1e-13,
                "{ratio} {found} {exact}"
            );
        }
        let area = 0.5 * arc * arc * (mu - mu.sin());
        // a difference of terms of the size of the radius squared
        assert!(
            (m.area - area).abs() < 1e-15 * (arc * arc + 10.0),
            "{ratio}"
        );
    }
}

/// The energy of springs is the integral of lambda |u'|^2 / 2. For lambda = 1 + a s, ends moved apart by d and u' = d + (1 - 2 s) c it grows
/// from the start by -a (d . c) / 6 + |c|^2 (1 / 6 + a / 12).
#[test]
fn energies_of_springs_agree_with_the_integral() {
    for (a, d, c) in [
        (0.0, [0.0, 0.0], [0.7, 0.0]),
        (0.8, [0.4, -0.3], [0.7, 1.1]),
    ] {
        let membrane = Membrane::new(ReferenceShape::disc(1.5).unwrap())
            .with_stiffness(Stiffness::function(move |s| 1.0 + a * s, &[]).unwrap())
            .with_ends([[0.2, 1.5], [0.2 + d[0], -1.5 + d[1]]])
            .unwrap();
        let exact = -a * (d[0] * c[0] + d[1] * c[1]) / 6.0
            + (c[0] * c[0] + c[1] * c[1]) * (1.0 / 6.0 + a / 12.0);
        let off = |discrete: &dyn DiscreteMembrane| {
            assert_eq!(discrete.is_half(), a == 0.0);
            let nodes = discrete.start().as_chunks::<2>().0.iter();
            let moved = nodes
                .zip(discrete.positions())
                .flat_map(|(node, s)| [0, 1].map(|k| node[k] + s * (1.0 - s) * c[k]));
            let moved: Vec<f64> = moved.collect();
            discrete.elastic_energy(&moved).unwrap() - exact
        };
        let spectral = off(&SpectralElements::new(&membrane, 4, 2).unwrap());
        assert!(spectral.abs() < 1e-14, "{a}: {spectral:e}");
        let differences = |nodes| off(&FiniteDifferences::half(&membrane, nodes).unwrap());
        let order = (differences(51) / differences(101)).log2();
        assert!((order - 2.0).abs() < 0.01, "{a}: {order}");
    }
}

/// Nearly flat the arc is the parabola x = 2 R h s (1 - s), h half its angle, and 4 R h = f / lambda.
#[test]
fn a_disc_under_a_tiny_load_is_a_parabola() {
    // The remainder is of the order of h^2.
    for (radius, ratio) in [(1.5, 1e-20), (1.5, 1e-250), (1e-3, 1e-290), (1e60, 1e-240)] {
        let circle = LinearEquilibrium::circle(radius, ratio).unwrap();
        let half = 0.5 * circle.kappa();
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-14;
        assert!(same(half, ratio / radius / 4.0), "{radius} {ratio}");
        let m = circle.measures();
        assert!(same(m.length, 2.0 * radius));
        assert!(same(m.area, radius * (radius * half) * 2.0 / 3.0));
        assert!(same(m.surface, PI * radius * radius));
        assert!(same(m.volume, PI * radius * radius * (radius * half) / 4.0));
        for s in [0.1, 0.5, 0.7] {
            let [x, y] = circle.at(s).position;
            assert!(
                same(x, 2.0 * radius * half * s * (1.0 - s)),
                "{radius} {ratio} {s}"
            );
            assert!((y / radius - (1.0 - 2.0 * s)).abs() < 1e-14);
        }
    }
    let flat = LinearEquilibrium::circle(1.5, 0.0).unwrap();
    let m = flat.measures();
    assert!((m.length - 3.0).abs() < 1e-14 && (m.surface - PI * 2.25).abs() < 1e-14);
    assert_eq!((m.area, m.volume), (0.0, 0.0));
    assert_eq!(flat.at(0.25).position, [0.0, 0.75]);
}

/// Under the law per current length the limit is 2 pi over the integral of 1 / lambda, which has a closed form here: the mean of 1 / (1 + a
/// cos) is 1 / sqrt(1 - a^2). The lowest degree suffices.
#[test]
fn the_limit_of_the_pressure_does_not_depend_on_the_degree() {
    let stiffness = |s: f64| 1.0 + 0.9 * (4.0 * PI * s + 0.3).cos();
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
        .with_stiffness(Stiffness::function(stiffness, &[]).unwrap())
        .with_law(PressureLaw::PerCurrentLength);
    let exact = std::f64::consts::TAU * (1.0f64 - 0.81).sqrt();
    for degree in [2, 5, 20] {
        let limit = SpectralElements::new(&membrane, degree, 1)
            .unwrap()
            .blow_up();
        assert!(
            (limit / exact - 1.0).abs() < 1e-12,
            "{degree}: {limit} {exact}"
        );
    }
}

/// Between nodes, N springs turn by pi / N each at the limit, 2 lambda N tan(pi / N); second neighbours count four times. For other
/// stiffnesses the limit of fine meshes is that of the last test.
#[test]
fn the_limit_of_the_pressure_between_nodes_has_a_closed_form() {
    let balloon = |stiffness: Stiffness, second: Option<Stiffness>| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
            .with_stiffness(stiffness)
            .with_law(PressureLaw::PerCurrentLength);
        second.map_or(membrane.clone(), |second| {
            membrane.with_second_neighbours(second)
        })
    };
    let constant = |value: f64| Stiffness::constant(value).unwrap();
    for (lambda, second) in [(0.3, None), (7.0, Some(0.4))] {
        let membrane = balloon(constant(lambda), second.map(constant));
        let total = lambda + 4.0 * second.unwrap_or(0.0);
        for springs in [3, 10, 101] {
            let limit = FiniteDifferences::new(&membrane, springs + 1)
                .unwrap()
                .blow_up();
            let exact = 2.0 * total * springs as f64 * (PI / springs as f64).tan();
            assert!(
                (limit / exact - 1.0).abs() < 1e-14 * springs as f64,
                "{limit} {exact}"
            );
        }
    }
    // and there is none under the other laws
    for law in [LAWS[0], LAWS[1]] {
        let other = balloon(constant(1.0), None).with_law(law);
        let spectral = SpectralElements::new(&other, 4, 1).unwrap();
        assert_eq!(spectral.blow_up(), f64::INFINITY);
        let differences = FiniteDifferences::new(&other, 11).unwrap();
        assert_eq!(differences.blow_up(), f64::INFINITY);
    }
    let waves = Stiffness::function(|s| 1.0 + 0.9 * (4.0 * PI * s + 0.3).cos(), &[]).unwrap();
    let membrane = balloon(waves, None);
    let off = |nodes: usize| {
        let limit = FiniteDifferences::new(&membrane, nodes).unwrap().blow_up();
        limit - std::f64::consts::TAU * (1.0f64 - 0.81).sqrt()
    };
    let order = (off(101) / off(201)).log2();
    assert!((order - 2.0).abs() < 0.1, "{order}");
}

/// A disc bulges by between a tenth of its length and all of it; a sphere of rubber is stretched by a tenth at least, and the pressure is
/// below the largest, 1.24 times modulus and thickness over the radius.
#[test]
fn the_scale_of_the_intensity_moves_a_membrane_by_about_its_length() {
    let (radius, stiffness) = (1.3, 7.0);
    let scale = |membrane: &Membrane, length: f64| {
        let differences = FiniteDifferences::half(membrane, 11).unwrap();
        differences.intensity_scale(length)
    };
    for law in LAWS {
        let membrane = Membrane::new(ReferenceShape::disc(radius).unwrap())
            .with_stiffness(Stiffness::constant(stiffness).unwrap())
            .with_law(law);
        assert_eq!(law.is_total_force(), law == PressureLaw::TotalForce);
        let intensity = scale(&membrane, 2.0 * radius);
        let bulge = match law {
            PressureLaw::PerCurrentLength => {
                let arc = LinearEquilibrium::disc(radius, intensity, stiffness).unwrap();
                arc.at(0.5).position[0]
            }
            _ => {
                let arc = LinearEquilibrium::circle(radius, intensity / stiffness).unwrap();
                arc.at(0.5).position[0]
            }
        };
        assert!(
            (0.1..1.0).contains(&(bulge / (2.0 * radius))),
            "{law:?} {bulge}"
        );
    }
    let (mu, thickness) = (400.0, 0.2);
    let energy = StrainEnergy::NeoHookean { mu };
    let rubber = Rubber::new(energy.clone(), Thickness::constant(thickness).unwrap()).unwrap();
    let membrane = Membrane::new(ReferenceShape::disc(radius).unwrap()).with_rubber(rubber);
    let pressure = scale(&membrane, PI * radius) * radius / (mu * thickness);
    // 2 (1 / l - 1 / l^7) at l = 1.1 and at its maximum
    assert!(pressure > 0.79 && pressure < 1.24, "{pressure}");
}

/// Under suction the cap is drawn across the axis. Against polylines of 512 and 1024 segments, extrapolated: of fourth order, apart from the
/// segments with kinks.
#[test]
fn measures_of_linear_equilibria_are_exact_across_the_axis() {
    let exact = LinearEquilibrium::balloon(5.0, 1.75, -5.0, 1.0).unwrap();
    let points: Vec<[f64; 2]> = (0..=1024)
        .map(|k| exact.at(f64::from(k) / 1024.0).position)
        .collect();
    let crossings = points
        .windows(2)
        .filter(|pair| pair[0][1] * pair[1][1] < 0.0);
    assert!(crossings.count() > 1);
    let every_other: Vec<[f64; 2]> = points.iter().copied().step_by(2).collect();
    let all = |m: Measures| [m.length, m.area, m.surface, m.volume];
    let (coarse, fine) = (all(Measures::of(&every_other)), all(Measures::of(&points)));
    for (k, found) in all(exact.measures()).into_iter().enumerate() {
        let expected = fine[k] + (fine[k] - coarse[k]) / 3.0;
        assert!(
            (found - expected).abs() < 1e-7 * expected.abs(),
            "{k}: {found} {expected}"
        );
    }
}

/// Displaced ends move the whole curve: both discretisations start at the same position.
#[test]
fn displaced_fixed_ends_move_the_start() {
    let ends = [[0.5, 2.0], [-0.25, -1.5]];
    let balloon = ReferenceShape::balloon(8.5, 1.75).unwrap();
    let membrane = Membrane::new(balloon.clone()).with_ends(ends).unwrap();
    let differences = FiniteDifferences::new(&membrane, 51).unwrap();
    let spectral = SpectralElements::new(&membrane, 12, 1).unwrap();
    let nodes = differences.start().as_chunks::<2>().0;
    assert_eq!([nodes[0], nodes[50]], ends);
    assert_eq!(membrane.ends(), ends);
    for (n, node) in nodes.iter().enumerate() {
        let s = n as f64 / 50.0;
        let rest = balloon.at(s).position;
        let expected = [
            rest[0] + 0.5 * (1.0 - s) - 0.25 * s,
            rest[1] + 0.25 * (1.0 - s) + 0.25 * s,
        ];
        let at = spectral.at(spectral.start(), s).unwrap().position;
        for k in 0..2 {
            assert!((node[k] - expected[k]).abs() < 1e-14);
            assert!((at[k] - expected[k]).abs() < 1e-10);
        }
    }
    // and evaluation between the nodes agrees with the pieces on both sides of the apex
    let half = SpectralElements::new(&Membrane::new(balloon), 12, 1).unwrap();
    assert!(half.is_half());
    let pieces = half.pieces(half.start()).unwrap();
    for k in 0..=40 {
        let s = f64::from(k) / 40.0;
        let piece = pieces.iter().find(|piece| s <= piece.to).unwrap();
        assert_eq!(piece.at(s), half.at(half.start(), s).unwrap());
    }
}
