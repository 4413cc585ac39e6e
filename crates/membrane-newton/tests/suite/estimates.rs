//! Stated errors of the discretisation against closed forms and finer solves.

use std::f64::consts::PI;

use membrane_newton::membrane_forces::LinearEquilibrium;
use membrane_newton::{
    Control, CurvePoint, Discretisation, Equilibrium, Membrane, NewtonOptions, PressureLaw,
    ReferenceShape, Rubber, Solver, Stiffness, StrainEnergy, Thickness,
};

/// Numbers in [0, 1) of a linear congruential generator.
fn random(bits: &mut u64) -> f64 {
    *bits = bits.wrapping_mul(6_364_136_223_846_793_005);
    *bits = bits.wrapping_add(1_442_695_040_888_963_407);
    (*bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Random balloons of springs under a pressure, whose closed form is known, at random degrees: the pressure is within the stated errors of
/// iteration and discretisation, and solves from two starts differ by at most their errors of iteration.
#[test]
fn pressures_are_within_their_stated_errors() {
    let options = NewtonOptions::default();
    let (mut bits, mut solved_all) = (7, 0);
    for case in 0..80 {
        let mut between = |from: f64, to: f64| from + (to - from) * random(&mut bits);
        let (pressure, h, radius) = (between(0.2, 5.0), between(0.5, 20.0), between(0.5, 3.0));
        let degree = between(5.0, if case % 8 == 0 { 100.0 } else { 40.0 }) as usize;
        let per_piece = between(1.0, 5.0) as usize;
        let exact = LinearEquilibrium::balloon(h, radius, pressure, 1.0).unwrap();
        let volume = Control::Volume(exact.measures().volume);
        let membrane = Membrane::new(ReferenceShape::balloon(h, radius).unwrap())
            .with_law(PressureLaw::PerCurrentLength);
        let spectral = Discretisation::Spectral { degree, per_piece };
        let solver = Solver::new(&membrane, spectral).unwrap();
        let Ok(solved) = solver.solve(volume, &options) else {
            continue;
        };
        solved_all += 1;
        let iteration = solved.report.iteration_error;
        let stated = iteration + solved.discretisation_error().unwrap();
        let error = (solved.intensity / pressure - 1.0).abs();
        assert!(
            error <= stated,
            "{degree} x {per_piece}: {error:e}, stated {stated:e}"
        );
        let near = solver.solve(Control::Load(0.9 * pressure), &options);
        let again = solver.solve_from(&near.unwrap(), volume, &options).unwrap();
        let apart = (again.intensity / solved.intensity - 1.0).abs();
        let stated = (iteration + again.report.iteration_error) * pressure.recip().max(1.0);
        assert!(
            apart <= stated,
            "{degree} x {per_piece}: {apart:e}, stated {stated:e}"
        );
    }
    assert!(solved_all > 70, "{solved_all}");
}

/// The rounding of strains grows with the number of elements of a curve, which the stated error contains, though no more than a hundredfold.
#[test]
fn rounding_of_many_elements_is_within_the_stated_error() {
    for pressure in [0.5, 2.0] {
        let exact = LinearEquilibrium::balloon(8.5, 1.75, pressure, 1.0).unwrap();
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
            .with_law(PressureLaw::PerCurrentLength);
        for per_piece in [30, 100, 300, 1000] {
            let spectral = Discretisation::Spectral {
                degree: 8,
                per_piece,
            };
            let solver = Solver::new(&membrane, spectral).unwrap();
            let volume = Control::Volume(exact.measures().volume);
            let solved = solver.solve(volume, &NewtonOptions::default()).unwrap();
            let error = (solved.intensity / pressure - 1.0).abs();
            let stated = solved.discretisation_error().unwrap();
            let expected = error..(100.0 * error).max(1e-8);
            assert!(
                expected.contains(&stated),
                "{per_piece}: {error:e}, stated {stated:e}"
            );
        }
    }
}

/// The stated error of the discretisation bounds the difference of intensity and shape to those of many elements, for springs and rubber.
#[test]
fn discretisation_errors_bound_the_difference_to_finer_solves() {
    let options = NewtonOptions::default();
    let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    let rubber = balloon.clone().with_rubber(latex);
    // Springs converge faster, and many elements have larger rounding.
    for (membrane, reference) in [(balloon, (28, 2)), (rubber, (24, 8))] {
        let solve = |(degree, per_piece)| {
            let spectral = Discretisation::Spectral { degree, per_piece };
            let solver = Solver::new(&membrane, spectral).unwrap();
            solver.solve(Control::VolumeGain(0.2), &options).unwrap()
        };
        let fine = solve(reference);
        let plain = [6, 8, 10, 12, 14, 16, 20, 24].map(|degree| (degree, 1));
        for resolution in plain
            .into_iter()
            .chain([(16, 2), (20, 2), (24, 2), (16, 4)])
        {
            let solved = solve(resolution);
            let stated = solved.discretisation_error().unwrap() + solved.report.iteration_error;
            let intensity = (solved.intensity / fine.intensity - 1.0).abs();
            let distance = (0..=400).map(|k| {
                let s = f64::from(k) / 400.0;
                let [a, b] = [&solved, &fine].map(|own| own.at(s).position);
                (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
            });
            let shape = distance.fold(0.0, f64::max) / fine.measures.length;
            println!("{resolution:?}: {intensity:.1e} {shape:.1e}, stated {stated:.1e}");
            assert!(
                intensity.max(shape) <= stated,
                "{resolution:?}: {intensity:e} {shape:e}, stated {stated:e}"
            );
        }
    }
}

/// The differences of the shape, at the nodes of the first and relative to the length, and of the intensity.
fn apart(solved: &Equilibrium, fine: &Equilibrium) -> [f64; 2] {
    let places = solved.points().into_iter().zip(solved.positions());
    let distance = places.map(|(point, s)| {
        let exact = fine.at(s).position;
        (point[0] - exact[0]).abs().max((point[1] - exact[1]).abs())
    });
    let shape = distance.fold(0.0, f64::max) / fine.measures.length;
    [shape, (solved.intensity / fine.intensity - 1.0).abs()]
}

/// Random balloons, half ellipsoids and discs of uneven springs and rubber, at gains of volume of 1e-4 to 2: shape and intensity are within
/// the stated errors of both solves from those of finer elements. Where the rounding of flat rubber dominates, that is the finer one's.
#[test]
fn small_intensities_are_within_their_stated_errors() {
    let (options, mut bits, mut solved_all) = (NewtonOptions::default(), 7, 0);
    for case in 0..160 {
        let mut between = |from: f64, to: f64| from + (to - from) * random(&mut bits);
        let (length, radius) = (between(1.0, 15.0), between(0.5, 5.0));
        let shape = match case % 3 {
            0 => ReferenceShape::balloon(length, radius),
            1 => ReferenceShape::disc(radius),
            _ => ReferenceShape::from_function(
                move |s| {
                    let (sin, cos) = (PI * s).sin_cos();
                    let [position, first, second] = [
                        [sin, cos],
                        [PI * cos, -PI * sin],
                        [-PI * PI * sin, -PI * PI * cos],
                    ]
                    .map(|[x, y]| [length * x, radius * y]);
                    CurvePoint {
                        position,
                        first,
                        second,
                    }
                },
                &[],
            ),
        };
        let (height, waves, phase) = (between(0.0, 0.6), between(1.0, 4.0), between(0.0, 6.0));
        let uneven = move |s: f64| 1.0 + height * (waves * s + phase).sin();
        let energy = StrainEnergy::NeoHookean { mu: 1.0 };
        let membrane = Membrane::new(shape.unwrap());
        let membrane = match case % 4 {
            0 => membrane.with_rubber(Rubber::new(energy, Thickness::UNIT).unwrap()),
            1 => membrane.with_stiffness(Stiffness::function(uneven, &[]).unwrap()),
            2 => membrane.with_law(PressureLaw::PerCurrentLength),
            _ => membrane,
        };
        let gain = 10_f64.powf(between(-4.0, 0.3));
        let control = match case % 3 {
            1 => Control::Volume(gain * radius.powi(3)),
            _ => Control::VolumeGain(gain),
        };
        let solve = |(degree, per_piece)| {
            let spectral = Discretisation::Spectral { degree, per_piece };
            Solver::new(&membrane, spectral)?.solve(control, &options)
        };
        let resolution = (between(5.0, 20.0) as usize, between(1.0, 3.0) as usize);
        let (Ok(solved), Ok(fine)) = (solve(resolution), solve((24, 4))) else {
            continue;
        };
        solved_all += 1;
        let stated = [&solved, &fine]
            .map(|own| own.discretisation_error().unwrap() + own.report.iteration_error);
        let stated = stated[0] + stated[1];
        let [shape, intensity] = apart(&solved, &fine);
        let error = shape.max(intensity);
        println!(
            "{case}, gain {gain:.1e}, {resolution:?}: {shape:.1e} {intensity:.1e}, {:.2}",
            error / stated
        );
        assert!(
            error <= stated,
            "{case}: {shape:e} {intensity:e}, stated {stated:e}"
        );
    }
    assert!(solved_all > 150, "{solved_all}");
}

/// Finite differences of random balloons of springs under a pressure: the stated error bounds that of the closed form.
#[test]
fn the_errors_of_finite_differences_are_those_of_the_closed_form() {
    let (options, mut bits) = (NewtonOptions::default(), 11);
    for _ in 0..60 {
        let mut between = |from: f64, to: f64| from + (to - from) * random(&mut bits);
        let (pressure, h, radius) = (between(0.2, 5.0), between(0.5, 20.0), between(0.5, 3.0));
        let nodes = between(30.0, 400.0) as usize;
        let exact = LinearEquilibrium::balloon(h, radius, pressure, 1.0).unwrap();
        let membrane = Membrane::new(ReferenceShape::balloon(h, radius).unwrap())
            .with_law(PressureLaw::PerCurrentLength);
        let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes });
        let volume = Control::Volume(exact.measures().volume);
        let solved = solver.unwrap().solve(volume, &options).unwrap();
        let stated = solved.discretisation_error().unwrap();
        let error = (solved.intensity / pressure - 1.0).abs();
        println!(
            "{h:.2} {radius:.2} {pressure:.2}, {nodes}: {:.2}",
            stated / error
        );
        assert!(error <= stated, "{nodes}: {error:e}, stated {stated:e}");
    }
}

/// Finite differences: the stated error is that of shape and intensity against polynomials at the same volume.
#[test]
fn the_errors_of_finite_differences_are_estimated() {
    let options = NewtonOptions::default();
    let springs = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let pressed = springs.clone().with_law(PressureLaw::PerCurrentLength);
    let stiffness = Stiffness::function(|s| 1.0 + 0.5 * (5.0 * s).sin(), &[]).unwrap();
    let uneven = springs.clone().with_stiffness(stiffness);
    let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
    let rubber = springs.clone().with_rubber(latex);
    for membrane in [springs, pressed, uneven, rubber] {
        let fine = Discretisation::Spectral {
            degree: 28,
            per_piece: 2,
        };
        let volume = Control::Volume(130.0);
        let fine = Solver::new(&membrane, fine).unwrap();
        let fine = fine.solve(volume, &options).unwrap();
        for nodes in [5, 8, 11, 21, 50, 101, 201, 1001] {
            let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes });
            let solved = solver.unwrap().solve(volume, &options).unwrap();
            let stated = solved.discretisation_error().unwrap();
            let [shape, intensity] = apart(&solved, &fine);
            println!("{nodes}: shape {shape:.2e} intensity {intensity:.2e}, stated {stated:.2e}");
            // twice the error, at the nodes of the polynomials instead of those of the differences
            let ratio = stated / intensity.max(shape);
            assert!((1.9..2.1).contains(&ratio), "{nodes}: {ratio}");
        }
    }
    let disc = Membrane::new(ReferenceShape::disc(1.0).unwrap());
    for nodes in [3, 4, 51] {
        let solver = Solver::new(&disc, Discretisation::FiniteDifferences { nodes });
        let stated = solver.unwrap().start().discretisation_error();
        assert!(stated.unwrap() < 1e-15, "{stated:?}"); // the start is exact
    }
}

/// Finite differences of springs with kinks: the stated error bounds that of shape and intensity, wherever the nodes are.
#[test]
fn the_errors_of_finite_differences_are_bounded_at_kinks() {
    let options = NewtonOptions::default();
    let corners = [[0.0, 2.0], [5.0, 2.0], [6.0, 0.0], [5.0, -2.0], [0.0, -2.0]];
    let corners = Membrane::new(ReferenceShape::polyline(&corners).unwrap());
    let steps = |s: f64| if (0.3..0.7).contains(&s) { 2.0 } else { 1.0 };
    let steps = Stiffness::function(steps, &[0.3, 0.7]).unwrap();
    let balloon = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let stiffer = balloon.clone().with_stiffness(steps);
    for (membrane, gains) in [(corners, [0.1, 0.6, 1.5]), (stiffer, [0.1, 0.6, 3.0])] {
        for gain in gains {
            let fine = Discretisation::Spectral {
                degree: 24,
                per_piece: 2,
            };
            let fine = Solver::new(&membrane, fine).unwrap();
            let fine = fine.solve(Control::VolumeGain(gain), &options).unwrap();
            let volume = Control::Volume(fine.measures.volume);
            for nodes in (21..80).chain([101, 150, 201, 301, 401]) {
                let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes });
                let solved = solver.unwrap().solve(volume, &options).unwrap();
                let stated = solved.discretisation_error().unwrap();
                let [shape, intensity] = apart(&solved, &fine);
                let ratio = stated / intensity.max(shape);
                println!("gain {gain}, {nodes}: {shape:.1e} {intensity:.1e}, {ratio:.2}");
                assert!(
                    (1.7..8.0).contains(&ratio), // more where the polynomials have nodes nearer to the kink
                    "gain {gain}, {nodes} nodes: {ratio}"
                );
            }
        }
    }
}

/// The polynomials do not resolve rubber with corners, and smooth rubber has an estimate.
#[test]
fn rubber_with_corners_has_no_estimate_of_finite_differences() {
    let corners = [[0.0, 2.0], [5.0, 2.0], [6.0, 0.0], [5.0, -2.0], [0.0, -2.0]];
    let smooth = ReferenceShape::balloon(5.0, 2.0).unwrap();
    for (shape, known) in [
        (ReferenceShape::polyline(&corners).unwrap(), false),
        (smooth, true),
    ] {
        let latex = Rubber::new(StrainEnergy::NeoHookean { mu: 1.0 }, Thickness::UNIT).unwrap();
        let membrane = Membrane::new(shape).with_rubber(latex);
        for nodes in [51, 101, 201] {
            let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes });
            let solved = solver.unwrap();
            let solved = solved.solve(Control::VolumeGain(0.3), &NewtonOptions::default());
            let stated = solved.unwrap().discretisation_error();
            assert_eq!(stated.is_some(), known, "{nodes}: {stated:?}");
        }
    }
}

/// Gaussian bumps of the stiffness, of any width: between the nodes of coarse polynomials, or resolved by many elements.
#[test]
fn errors_are_bounded_for_stiffnesses_that_the_nodes_miss() {
    let options = NewtonOptions::default();
    let mut bits = 11;
    for case in 0..40 {
        let mut between = |from: f64, to: f64| from + (to - from) * random(&mut bits);
        let at = between(0.02, 0.5);
        let (width, height) = match case % 4 {
            0 => (0.002, 2.0),
            _ => (between(0.1, 0.5), between(-0.5, 1.8)),
        };
        let bump = move |s: f64| (-((s - at) / width).powi(2)).exp();
        let stiffness = Stiffness::function(move |s| 1.0 + height * (bump(s) + bump(1.0 - s)), &[]);
        let shape = ReferenceShape::balloon(between(0.5, 8.5), 1.75).unwrap();
        let membrane = Membrane::new(shape).with_stiffness(stiffness.unwrap());
        let solve = |discretisation| {
            let solver = Solver::new(&membrane, discretisation)?;
            solver.solve(Control::VolumeGain(0.6), &options)
        };
        let fine = Discretisation::Spectral {
            degree: 24,
            per_piece: 64,
        };
        let fine = solve(fine).unwrap();
        for discretisation in [
            Discretisation::SpectralAdaptive { tolerance: 1e-5 },
            Discretisation::Spectral {
                degree: 8 + case,
                per_piece: 1,
            },
        ] {
            let solved = solve(discretisation).unwrap();
            let stated = solved.discretisation_error().unwrap();
            let [shape, intensity] = apart(&solved, &fine);
            let error = shape.max(intensity);
            // the reference states errors of 7e-9, of rounding
            assert!(
                error <= stated + 1e-8,
                "{discretisation:?}, {width} at {at}: {error:e}, stated {stated:e}"
            );
        }
    }
}

/// The equations of few springs under a pressure do not amplify rounding: the error is about that of the unknowns, 2.2e-16 of the length 2 and of an
/// intensity, whose scale is at most 1.
#[test]
fn the_error_of_well_conditioned_equations_is_rounding() {
    let law = PressureLaw::PerCurrentLength;
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap()).with_law(law);
    for nodes in [3, 4, 5, 11] {
        for load in [1e-3, 1.0] {
            let how = Discretisation::FiniteDifferences { nodes };
            let solver = Solver::new(&membrane, how).unwrap();
            let solved = solver.solve(Control::Load(load), &NewtonOptions::default());
            let error = solved.unwrap().report.iteration_error;
            assert!(error <= 3.0 * f64::EPSILON, "{nodes} {load}: {error:e}");
        }
    }
}
