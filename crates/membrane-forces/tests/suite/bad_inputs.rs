//! Errors of constructors contain the invalid number.

mod lengths;

use membrane_forces::{
    BandMatrix, CurvePiece, CurvePoint, DiscreteMembrane, FiniteDifferences, LinearEquilibrium,
    Measure, Measures, Membrane, MembraneError, PressureLaw, ReferenceShape, SpectralElements,
    Stiffness, StrainEnergy, Thickness,
};

#[test]
fn sizes_must_be_positive_and_finite() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for refused in [
            ReferenceShape::balloon(bad, 1.0).err(),
            ReferenceShape::balloon(1.0, bad).err(),
            ReferenceShape::disc(bad).err(),
            Stiffness::constant(bad).err(),
            LinearEquilibrium::circle(bad, 1.0).err(),
            LinearEquilibrium::disc(bad, 1.0, 1.0).err(),
        ] {
            let given = match refused {
                Some(MembraneError::OutOfRange { given, least, .. }) if least > 0.0 => given,
                other => panic!("{bad}: {other:?}"),
            };
            assert_eq!(given.to_bits(), bad.to_bits());
        }
        let stiffness = Stiffness::samples(&[1.0, bad]).err();
        let thickness = Thickness::samples(&[1.0, bad]).err();
        for (error, name) in [(stiffness, "stiffness"), (thickness, "thickness")] {
            assert!(
                matches!(error, Some(MembraneError::BadProfile { what, s: 1.0, given })
                    if what == name && given.to_bits() == bad.to_bits())
            );
        }
    }
    assert_eq!(
        ReferenceShape::disc(-2.0).unwrap_err(),
        MembraneError::OutOfRange {
            what: "radius",
            given: -2.0,
            least: 0f64.next_up(),
            most: f64::MAX,
        }
    );
    let refused = LinearEquilibrium::circle(1.0, -1.0).err();
    let expected = MembraneError::within("load over stiffness", -1.0, 0.0, f64::MAX).err();
    assert_eq!(refused, expected);
}

#[test]
fn reference_configurations_must_not_cross_or_have_zero_speed() {
    let crossing = [[0.0, 1.0], [2.0, -1.0], [2.0, 1.0], [0.0, -1.0]];
    assert_eq!(
        ReferenceShape::polyline(&crossing).unwrap_err(),
        MembraneError::SelfCrossing {
            first: 0,
            second: 2
        }
    );
    let twice = [[0.0, 1.0], [1.0, 1.0], [1.0, 1.0], [0.0, -1.0]];
    assert_eq!(
        ReferenceShape::polyline(&twice).unwrap_err(),
        MembraneError::CoincidentPoints { index: 1 }
    );
    let nan = |_: f64| CurvePoint {
        position: [f64::NAN; 2],
        first: [1.0; 2],
        second: [0.0; 2],
    };
    assert!(matches!(
        ReferenceShape::from_function(nan, &[]),
        Err(MembraneError::OutOfRange { .. })
    ));
    let still = |_: f64| CurvePoint {
        position: [1.0; 2],
        first: [1.0; 2],
        second: [0.0; 2],
    };
    assert!(matches!(
        ReferenceShape::from_function(still, &[]),
        Err(MembraneError::CoincidentPoints { index: 1 })
    ));
    let line = |s: f64| CurvePoint {
        position: [0.0, 1.0 - 2.0 * s],
        first: [0.0, -2.0],
        second: [0.0; 2],
    };
    assert!(ReferenceShape::from_function(line, &[]).is_ok());
    assert!(matches!(
        ReferenceShape::from_function(line, &[0.5, 0.5]),
        Err(MembraneError::BadBreakpoint {
            index: 1,
            given: 0.5
        })
    ));
}

#[test]
fn stiffness_is_checked_where_it_is_used() {
    let negative = Stiffness::function(|s| 0.5 - s, &[]).unwrap();
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap()).with_stiffness(negative);
    assert!(matches!(
        FiniteDifferences::new(&membrane, 11),
        Err(MembraneError::BadProfile { .. })
    ));
    assert!(matches!(
        SpectralElements::new(&membrane, 8, 1),
        Err(MembraneError::BadProfile { .. })
    ));
}

#[test]
fn too_few_nodes_and_too_much_pressure() {
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap());
    assert!(matches!(
        FiniteDifferences::new(&membrane, 2),
        Err(MembraneError::TooFew {
            given: 2,
            least: 3,
            ..
        })
    ));
    assert!(matches!(
        SpectralElements::new(&membrane, 1, 1),
        Err(MembraneError::TooFew { given: 1, .. })
    ));
    assert!(matches!(
        LinearEquilibrium::disc(1.0, std::f64::consts::TAU, 1.0),
        Err(MembraneError::PastBlowUp { .. })
    ));
    let negative = StrainEnergy::MooneyRivlin { c1: 1.0, c2: -1.0 }.check();
    let message = negative.unwrap_err().to_string();
    assert_eq!(message, "c2 is -1.0; it must be finite and not negative");
    assert!(
        StrainEnergy::MooneyRivlin { c1: 1.0, c2: 0.0 }
            .check()
            .is_ok()
    );
    // the limit is proportional to the stiffness
    let limit = std::f64::consts::TAU * 400.0;
    let error = LinearEquilibrium::balloon(8.5, 1.75, 2600.0, 400.0).unwrap_err();
    let pressure = 2600.0;
    assert_eq!(error, MembraneError::PastBlowUp { pressure, limit });
    assert!(LinearEquilibrium::balloon(8.5, 1.75, 2500.0, 400.0).is_ok());
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(LinearEquilibrium::disc(1.0, 0.0, bad).is_err());
    }
    assert!(matches!(
        membrane.with_ends([[0.0, 1.0], [f64::NAN, 0.0]]),
        Err(MembraneError::OutOfRange {
            what: "fixed end",
            ..
        })
    ));
}

#[test]
fn sizes_beyond_any_memory_are_rejected() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    for nodes in [10_000_001, usize::MAX] {
        assert!(matches!(
            FiniteDifferences::new(&membrane, nodes),
            Err(MembraneError::TooMany { given, most: 10_000_000, .. }) if given == nodes
        ));
    }
    for (degree, per_piece) in [(1001, 1), (usize::MAX, 1), (8, usize::MAX), (1000, 101)] {
        assert!(matches!(
            SpectralElements::new(&membrane, degree, per_piece),
            Err(MembraneError::TooMany { .. })
        ));
    }
    // a piece between any two samples of the stiffness
    let samples = Stiffness::samples(&vec![1.0; 100_000]).unwrap();
    assert!(matches!(
        SpectralElements::new(&membrane.with_stiffness(samples), 100, 1),
        Err(MembraneError::TooMany { .. })
    ));
}

/// The check at construction samples some points only: nodes elsewhere are checked, too.
#[test]
fn a_reference_curve_with_nan_at_a_node_is_rejected() {
    let curve = |s: f64| CurvePoint {
        position: [
            if s > 0.33 && s < 0.335 { f64::NAN } else { s },
            1.0 - 2.0 * s,
        ],
        first: [1.0, -2.0],
        second: [0.0; 2],
    };
    let membrane = Membrane::new(ReferenceShape::from_function(curve, &[]).unwrap());
    let refused =
        |error| matches!(error, MembraneError::OutOfRange { given, .. } if given.is_nan());
    assert!(refused(
        FiniteDifferences::new(&membrane, 1001).unwrap_err()
    ));
    assert!(refused(
        SpectralElements::new(&membrane, 400, 1).unwrap_err()
    ));
}

#[test]
fn breakpoints_next_to_the_ends_and_empty_series() {
    for unit in [1e-6, 1.0, 1e6] {
        let curve = move |s: f64| CurvePoint {
            position: [0.0, unit - 2.0 * unit * s],
            first: [0.0, -2.0 * unit],
            second: [0.0; 2],
        };
        let rest = ReferenceShape::from_function(curve, &[1e-13, 1.0 - 1e-13]).unwrap();
        let spectral = SpectralElements::new(&Membrane::new(rest), 4, 1).unwrap();
        let s = spectral.positions();
        assert_eq!((s[0], s[s.len() - 1]), (0.0, 1.0));
        let end = spectral.at(spectral.start(), 1.0).unwrap().position;
        assert!(end[0] == 0.0 && (end[1] / unit + 1.0).abs() < 1e-15);
    }
    let nothing = CurvePiece {
        from: 0.0,
        to: 1.0,
        x: vec![],
        y: vec![2.0],
    };
    assert_eq!(nothing.at(0.3).position, [0.0, 2.0]);
}

/// Sizes of any power of ten: a result is finite, or an error.
#[test]
fn closed_forms_are_finite_or_rejected() {
    const SIZES: [f64; 16] = [
        5e-324,
        1e-300,
        1e-200,
        1e-160,
        1e-100,
        1e-9,
        0.5,
        1.0,
        1000.0,
        1e50,
        1e100,
        1e102,
        1e154,
        1e200,
        1e300,
        f64::MAX,
    ];
    let is_number = |m: Measures| {
        [m.length, m.area, m.surface, m.volume]
            .iter()
            .all(|x| x.is_finite())
    };
    let places = [0.0, 0.1, 0.3, 0.5, 0.9, 1.0];
    for a in SIZES {
        for b in SIZES {
            assert!(
                LinearEquilibrium::balloon(a, b, 0.0, 1.0)
                    .is_ok_and(|rest| is_number(rest.measures()))
                    || a.max(b) > 1e90
            );
            match LinearEquilibrium::circle(a, b) {
                Err(error) => assert!(
                    matches!(error, MembraneError::OutOfRange { .. }) && a.max(b) > 1e90,
                    "{a} {b} {error}"
                ),
                Ok(circle) => {
                    assert!(is_number(circle.measures()), "{a} {b}");
                    let places = places.map(|s| circle.at(s).position);
                    assert!(places.as_flattened().iter().all(|x| x.is_finite()));
                }
            }
            for kappa in [0.0, 1e-9, 1.0, 6.2] {
                let balloon = LinearEquilibrium::balloon(a, b, kappa, 1.0);
                for linear in [balloon, LinearEquilibrium::disc(a, kappa, 1.0)] {
                    let Ok(linear) = linear else { continue };
                    assert!(is_number(linear.measures()), "{a} {b} {kappa}");
                    let places = places.map(|s| linear.at(s).position);
                    assert!(places.as_flattened().iter().all(|x| x.is_finite()));
                }
            }
        }
    }
    for refused in [
        LinearEquilibrium::balloon(1.0, 1e103, 0.0, 1.0).err(),
        LinearEquilibrium::circle(1e300, 1e3).err(),
        LinearEquilibrium::disc(1e300, 1.0, 1.0).err(),
    ] {
        assert!(
            matches!(refused, Some(MembraneError::OutOfRange { .. })),
            "{refused:?}"
        );
    }
    assert!(LinearEquilibrium::disc(1e100, 1.0, 1.0).is_ok());
}

/// The cap bends by its length squared divided by its radius, which may overflow.
#[test]
fn arguments_that_overflow_are_rejected() {
    assert!(matches!(
        LinearEquilibrium::balloon(1e300, 1e291, 1.0, 1.0),
        Err(MembraneError::OutOfRange { .. })
    ));
    let samples = Stiffness::samples(&[1.0, 2.0]).unwrap();
    assert!(matches!(
        samples.at(f64::NAN),
        Err(MembraneError::BadProfile { .. })
    ));
}

/// Derivatives that are wrong on an eighth of a piece only.
#[test]
fn derivatives_are_compared_along_the_whole_reference_configuration() {
    let line = |wrong: std::ops::Range<f64>, order: usize| {
        let curve = move |s: f64| {
            let factor = if wrong.contains(&s) { 1.5 } else { 1.0 };
            let factors = if order == 1 {
                [factor, 1.0]
            } else {
                [1.0, factor]
            };
            CurvePoint {
                position: [2.0 * s - s * s, 1.0 - 2.0 * s],
                first: [2.0 - 2.0 * s, -2.0].map(|v| factors[0] * v),
                second: [-2.0, 0.0].map(|v| factors[1] * v),
            }
        };
        ReferenceShape::from_function(curve, &[0.5])
    };
    assert!(line(2.0..3.0, 1).is_ok());
    for k in 0..8 {
        let from = f64::from(k) / 8.0;
        for order in [1, 2] {
            let refused = line(from..from + 0.125, order);
            assert!(
                matches!(refused, Err(MembraneError::WrongDerivative { s, .. }) if (from..from + 0.125).contains(&s)),
                "{from}, {order}: {refused:?}"
            );
        }
    }
}

/// A thousandth of the speed per length of the piece, here 2 / 0.01: errors of a second derivative without effect on the curve.
#[test]
fn small_second_derivatives_are_compared_with_the_speed() {
    let line = |wrong: f64| {
        let curve = move |s: f64| CurvePoint {
            position: [0.0, 1.0 - 2.0 * s],
            first: [0.0, -2.0],
            second: [if s > 0.5 && s < 0.51 { wrong } else { 0.0 }, 0.0],
        };
        ReferenceShape::from_function(curve, &[0.5, 0.51])
    };
    assert!(line(0.19).is_ok());
    assert!(line(0.21).is_err());
}

/// The law per current length needs no direction.
#[test]
fn a_node_between_coincident_neighbours_has_no_direction() {
    for law in [
        PressureLaw::PerMaterialLength,
        PressureLaw::TotalForce,
        PressureLaw::PerCurrentLength,
    ] {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap()).with_law(law);
        let differences = FiniteDifferences::half(&membrane, 21).unwrap();
        let mut x = differences.start().to_vec();
        x.copy_within(8..10, 12);
        let mut out = vec![0.0; x.len()];
        let expected = match law {
            PressureLaw::PerCurrentLength => Ok(()),
            _ => Err(MembraneError::CoincidentPoints { index: 5 }),
        };
        assert_eq!(differences.pressure_force_into(&x, 1.0, &mut out), expected);
    }
}

/// A jump of the first derivative needs a breakpoint, wherever it is between two samples; a smooth bend of a thousandth of the curve does not.
#[test]
fn jumps_of_the_first_derivative_need_a_breakpoint() {
    for (at, jump, bend) in [
        (0.5, 12.0, 0.0),
        (0.37, 12.0, 0.0),
        (0.3701, 0.1, 0.0),
        (0.999, 1.0, 0.0),
        // the change over 1/64 with the jump, 8, is half the square of the bend over 64
        (0.37, -8.5, -32.0),
    ] {
        let kinked = move |s: f64| CurvePoint {
            position: [
                6.0 * s - 0.5 * bend * s * (1.0 - s) - jump * (s - at).max(0.0),
                2.0 - 4.0 * s,
            ],
            first: [
                6.0 + bend * (s - 0.5) - if s < at { 0.0 } else { jump },
                -4.0,
            ],
            second: [bend, 0.0],
        };
        let refused = ReferenceShape::from_function(kinked, &[]);
        assert!(
            matches!(refused, Err(MembraneError::Kink { s, before, after })
                if (s - at).abs() < 1e-6 && (before[0] - after[0] - jump).abs() < 1e-7),
            "{at}: {refused:?}"
        );
        assert!(ReferenceShape::from_function(kinked, &[at]).is_ok());
    }
    let bent = |s: f64| {
        let width = 1e-3;
        let t = ((s - 0.4) / width).tanh();
        CurvePoint {
            position: [
                2.0 * s - width * ((s - 0.4) / width).cosh().ln(),
                1.0 - 2.0 * s,
            ],
            first: [2.0 - t, -2.0],
            second: [-(1.0 - t * t) / width, 0.0],
        }
    };
    assert!(ReferenceShape::from_function(bent, &[]).is_ok());
}

#[test]
fn intensities_that_are_not_finite_are_rejected() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let forces = FiniteDifferences::new(&membrane, 11).unwrap();
    let (mut scratch, mut out) = (vec![0.0; 22], vec![0.0; 22]);
    let mut tangent = forces.tangent();
    for bad in [f64::NAN, f64::INFINITY] {
        for refused in [
            forces
                .forces_into(forces.start(), bad, &mut scratch, &mut out)
                .map(drop),
            forces.pressure_force_into(forces.start(), bad, &mut out),
            forces.tangent_into(forces.start(), bad, &mut tangent),
        ] {
            assert!(matches!(refused, Err(MembraneError::OutOfRange { .. })));
        }
    }
}

/// Derivatives that are halved, zero or exchanged are detected; correct ones of many waves are accepted.
#[test]
fn derivatives_of_a_reference_configuration_must_match_its_positions() {
    use std::f64::consts::PI;
    let cap = |waves: f64, factors: [f64; 2]| {
        move |s: f64| {
            let (sin, cos) = (PI * s).sin_cos();
            let (ripple, along) = (2.0 * PI * waves * s).sin_cos();
            let k = 2.0 * PI * waves;
            CurvePoint {
                position: [sin + 0.001 * ripple, cos],
                first: [PI * cos + 0.001 * k * along, -PI * sin].map(|v| factors[0] * v),
                second: [-PI * PI * sin - 0.001 * k * k * ripple, -PI * PI * cos]
                    .map(|v| factors[1] * v),
            }
        }
    };
    for waves in [0.0, 1.0, 7.0, 40.0] {
        assert!(
            ReferenceShape::from_function(cap(waves, [1.0; 2]), &[0.3]).is_ok(),
            "{waves}"
        );
        for (factors, wrong) in [
            ([0.5, 1.0], 1),
            ([1.0, 0.5], 2),
            ([1.0, 0.0], 2),
            ([-1.0, 1.0], 1),
            ([1.01, 1.01], 1),
        ] {
            let refused = ReferenceShape::from_function(cap(waves, factors), &[0.3]);
            assert!(
                matches!(refused, Err(MembraneError::WrongDerivative { order, .. }) if order == wrong),
                "{waves} {factors:?}: {refused:?}"
            );
        }
    }
}

#[test]
fn a_mean_pressure_needs_a_length() {
    use membrane_forces::PressureLaw::{PerCurrentLength, PerMaterialLength};
    for length in [0.0, -1.0, f64::NAN] {
        assert!(PerMaterialLength.mean_pressure(17.5, length).is_nan());
        assert!(PerCurrentLength.mean_pressure(17.5, length).is_nan());
    }
    assert_eq!(PerMaterialLength.mean_pressure(17.5, 25.0), 0.7);
}

#[test]
fn balloons_whose_pieces_vanish_by_rounding_are_rejected() {
    for (h, radius) in [(1e-17, 1.0), (1e308, 1.0), (1.0, 1e17), (1.0, 1e-17)] {
        let error = ReferenceShape::balloon(h, radius).unwrap_err();
        assert!(
            matches!(error, MembraneError::BadBreakpoint { .. }),
            "{h:e}, {radius:e}: {error}"
        );
    }
    assert!(ReferenceShape::balloon(1e-12, 1.0).is_ok());
    assert!(ReferenceShape::balloon(1.0, 1e-12).is_ok());
}
