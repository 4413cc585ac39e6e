//! Controls that cannot be met and limits that are reached give typed errors with numbers.

use membrane_newton::{
    BandMatrix, BandedLu, Control, Discretisation, Membrane, MembraneError, NewtonError,
    NewtonOptions, Pair, PairEquilibrium, PressureLaw, ReferenceShape, ResidualSystem, Rubber,
    Solver, Stiffness, StopReason, StrainEnergy, Thickness, newton,
};

fn solver(law: PressureLaw, radius: f64) -> Solver {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap()).with_law(law);
    Solver::new(
        &membrane,
        Discretisation::Spectral {
            degree: 10,
            per_piece: 1,
        },
    )
    .unwrap()
}

#[test]
fn impossible_controls() {
    let solver = solver(PressureLaw::PerMaterialLength, 1.75);
    let options = NewtonOptions::default();
    for bad in [
        Control::Load(f64::NAN),
        Control::TotalForce(f64::INFINITY),
        Control::Volume(0.0),
        Control::Volume(-3.0),
        Control::VolumeGain(-1.0),
        Control::Area(f64::NAN),
    ] {
        let error = solver.solve(bad, &options).unwrap_err();
        assert!(
            matches!(
                error,
                NewtonError::Membrane(MembraneError::OutOfRange { .. })
            ),
            "{bad:?}: {error}"
        );
    }
    let disc = Membrane::new(ReferenceShape::disc(1.0).unwrap());
    let disc = Solver::new(&disc, Discretisation::FiniteDifferences { nodes: 51 }).unwrap();
    assert!(matches!(
        disc.solve(Control::VolumeGain(0.6), &options),
        Err(NewtonError::Membrane(MembraneError::OutOfRange {
            what: "volume of the start",
            ..
        }))
    ));
}

#[test]
fn pressure_at_or_past_the_blow_up() {
    let solver = solver(PressureLaw::PerCurrentLength, 1.75);
    let options = NewtonOptions::default();
    for past in [std::f64::consts::TAU, 7.0, -100.0] {
        assert!(matches!(
            solver.solve(Control::Load(past), &options),
            Err(NewtonError::Membrane(MembraneError::PastBlowUp { .. }))
        ));
    }
    assert!(solver.solve(Control::Load(6.2), &options).is_ok());
}

#[test]
fn a_failed_solve_reports_its_attempts() {
    let solver = solver(PressureLaw::PerMaterialLength, 1.75);
    let options = NewtonOptions::default()
        .with_max_iterations(1)
        .with_max_load_steps(0);
    let Err(NewtonError::NotConverged { report, .. }) =
        solver.solve(Control::VolumeGain(5.0), &options)
    else {
        panic!("one iteration cannot be enough");
    };
    assert_eq!((report.iterations, report.history.len()), (1, 2));
}

#[test]
fn bad_discretisations_and_pairs() {
    let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap());
    for bad in [
        Discretisation::FiniteDifferences { nodes: 2 },
        Discretisation::Spectral {
            degree: 1,
            per_piece: 1,
        },
        Discretisation::Spectral {
            degree: 8,
            per_piece: 0,
        },
        Discretisation::SpectralAdaptive { tolerance: 0.0 },
        Discretisation::SpectralAdaptive {
            tolerance: f64::NAN,
        },
    ] {
        let error = Solver::new(&membrane, bad).unwrap_err();
        let kind = match bad {
            Discretisation::SpectralAdaptive { .. } => {
                matches!(
                    error,
                    NewtonError::Membrane(MembraneError::OutOfRange { .. })
                )
            }
            _ => matches!(error, NewtonError::Membrane(MembraneError::TooFew { .. })),
        };
        assert!(kind, "{bad:?}: {error:?}");
    }
    let law = PressureLaw::PerMaterialLength;
    let (small, large) = (solver(law, 1.75), solver(law, 2.75));
    let volumes = [&small, &large].map(|solver| solver.start_measures().volume);
    let expected = NewtonError::NotEnclosed {
        what: "volume in cm^3",
        inner: volumes[1],
        outer: volumes[0],
    };
    let swapped = Pair::new(large, small).unwrap_err();
    assert_eq!(swapped, expected);
    let message = swapped.to_string();
    assert!(
        message.contains("the outer one must enclose the inner one"),
        "{message}"
    );
}

/// A long thin membrane has the larger volume, but not the larger radius; springs and rubber, and forces and pressures, do not mix.
#[test]
fn membranes_that_cannot_be_a_pair_are_rejected() {
    let spectral = Discretisation::Spectral {
        degree: 12,
        per_piece: 1,
    };
    let solver = |membrane: &Membrane| Solver::new(membrane, spectral).unwrap();
    let balloon = |h, radius| Membrane::new(ReferenceShape::balloon(h, radius).unwrap());
    let thin = Pair::new(solver(&balloon(8.5, 1.75)), solver(&balloon(40.0, 1.2)));
    let (what, inner, outer) = ("distance of the end from the axis in cm", 1.75, 1.2);
    let expected = NewtonError::NotEnclosed { what, inner, outer };
    assert_eq!(thin.unwrap_err(), expected);
    let short = Pair::new(solver(&balloon(8.5, 1.75)), solver(&balloon(6.0, 2.75)));
    let (what, inner, outer) = ("largest x in cm", 10.25, 8.75);
    let expected = NewtonError::NotEnclosed { what, inner, outer };
    assert_eq!(short.unwrap_err(), expected);
    let energy = StrainEnergy::NeoHookean { mu: 400.0 };
    let rubber = Rubber::new(energy, Thickness::constant(0.05).unwrap()).unwrap();
    let outside = balloon(8.5, 2.75);
    for (outside, expected) in [
        (
            outside.clone().with_rubber(rubber),
            "rubber under a pressure",
        ),
        (
            outside.with_law(PressureLaw::PerCurrentLength),
            "springs under a pressure",
        ),
    ] {
        let mixed = Pair::new(solver(&balloon(8.5, 1.75)), solver(&outside)).unwrap_err();
        assert!(
            matches!(mixed, NewtonError::MixedPair { outer, .. } if outer == expected),
            "{mixed}"
        );
    }
}

/// Between ends and apexes that do not cross, the inner membrane bulges through the outer one.
#[test]
fn membranes_that_cross_in_the_result_are_rejected() {
    let inner = [[0.0, 1.0], [1.0, 3.0], [2.0, 0.0], [1.0, -3.0], [0.0, -1.0]];
    let outer = [[0.0, 2.0], [8.0, 2.0], [9.0, 0.0], [8.0, -2.0], [0.0, -2.0]];
    let options = NewtonOptions::default();
    for how in [
        Discretisation::FiniteDifferences { nodes: 101 },
        Discretisation::FiniteDifferences { nodes: 2001 },
        Discretisation::Spectral {
            degree: 16,
            per_piece: 1,
        },
    ] {
        let [inside, outside] = [&inner, &outer].map(|points| {
            let membrane = Membrane::new(ReferenceShape::polyline(points).unwrap());
            Solver::new(&membrane, how).unwrap()
        });
        let [alone, around] = [&inside, &outside].map(|solver| solver.start());
        let pair = Pair::new(inside, outside).unwrap();
        let wall = pair.wall_volume();
        let found = PairEquilibrium::of(alone, around, wall).unwrap_err();
        // at the start the tip is 1 cm outside the cylinder
        let NewtonError::Crossed { depth, x, r } = found else {
            panic!("{found}")
        };
        assert!((depth - 1.0).abs() < 0.05 && (x - 1.0).abs() < 0.05 && (r - 3.0).abs() < 0.05);
        let solved = pair.solve_gain(0.1, &options).unwrap_err();
        assert!(matches!(solved, NewtonError::Crossed { .. }), "{solved}");
    }
    // a tip that is outside by a third of a chord, over a straight part of the outer membrane
    let mut shallow = inner;
    (shallow[1][1], shallow[3][1]) = (2.05, -2.05);
    let [alone, around] = [&shallow, &outer].map(|points| {
        let membrane = Membrane::new(ReferenceShape::polyline(points).unwrap());
        let how = Discretisation::FiniteDifferences { nodes: 2001 };
        Solver::new(&membrane, how).unwrap().start()
    });
    let found = PairEquilibrium::of(alone, around, 1.0).unwrap_err();
    assert!(
        matches!(found, NewtonError::Crossed { depth, .. } if (depth - 0.05).abs() < 5e-3),
        "{found}"
    );
    // walls of a thousandth of the radius and less
    for nodes in [3, 11, 101, 1001] {
        for thickness in [0.1, 1e-3, 1e-6] {
            let how = Discretisation::FiniteDifferences { nodes };
            let solver = |radius| {
                let rest = ReferenceShape::balloon(8.5, radius).unwrap();
                Solver::new(&Membrane::new(rest), how).unwrap()
            };
            let pair = Pair::new(solver(1.75), solver(1.75 * (1.0 + thickness))).unwrap();
            let [inner, outer] = [pair.inner().start(), pair.outer().start()];
            assert!(PairEquilibrium::of(inner, outer, pair.wall_volume()).is_ok());
        }
    }
}

/// With fewer iterations than Newton needs, no step of the control succeeds after the first ones: the error names the cause.
#[test]
fn too_few_iterations_are_not_a_limit_point() {
    let solver = solver(PressureLaw::PerMaterialLength, 1.75);
    let options = NewtonOptions::default().with_max_iterations(1);
    let error = solver
        .solve(Control::VolumeGain(0.6), &options)
        .unwrap_err();
    let NewtonError::NotConverged { report, .. } = &error else {
        panic!("{error}")
    };
    assert_eq!(report.stopped_by, Some(StopReason::Iterations));
    let message = error.to_string();
    assert!(message.contains("the iterations are used up"), "{message}");
}

/// If sums of squares of the shape overflow, a result would have another volume.
#[test]
fn a_volume_out_of_range_is_an_error() {
    let options = NewtonOptions::default();
    for gain in [1e100, 1e200, 1e300] {
        let control = Control::VolumeGain(gain);
        let refused = |outcome| {
            assert!(
                matches!(outcome, Err(NewtonError::NotConverged { .. })),
                "{gain:e}: {outcome:?}"
            );
        };
        let inner = solver(PressureLaw::PerMaterialLength, 1.75);
        refused(inner.solve(control, &options).map(drop));
        let pair = Pair::new(inner, solver(PressureLaw::PerMaterialLength, 2.75)).unwrap();
        refused(pair.solve(control, &options).map(drop));
    }
    let empty = solver(PressureLaw::PerMaterialLength, 1.75)
        .solve(Control::VolumeGain(-1.0), &options)
        .unwrap_err();
    assert_eq!(
        empty.to_string(),
        "volume gain is -1.0; it must be finite and greater than -1.0"
    );
}

/// A length of 1e200 is finite; its square and its cube overflow.
#[test]
fn shapes_whose_volume_overflows_are_rejected() {
    for discretisation in [
        Discretisation::FiniteDifferences { nodes: 21 },
        Discretisation::Spectral {
            degree: 8,
            per_piece: 1,
        },
        Discretisation::SpectralAdaptive { tolerance: 1e-9 },
    ] {
        for radius in [1e103, 1e200] {
            let membrane = Membrane::new(ReferenceShape::balloon(radius, radius).unwrap());
            assert!(matches!(
                Solver::new(&membrane, discretisation),
                Err(NewtonError::Membrane(MembraneError::OutOfRange { .. }))
            ));
        }
        // This one has a finite volume, but not at a hundred times its size.
        let membrane = Membrane::new(ReferenceShape::balloon(8.5e101, 1.75e101).unwrap());
        let solver = Solver::new(&membrane, discretisation).unwrap();
        assert!(solver.start_measures().volume.is_finite());
        let load = Control::Load(1e104);
        match solver.solve(load, &NewtonOptions::default()) {
            Ok(solved) => assert!(solved.measures.volume.is_finite()),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

#[test]
fn invalid_tolerances_are_rejected() {
    let solver = solver(PressureLaw::PerMaterialLength, 1.75);
    let near = solver
        .solve(Control::Load(5.0), &NewtonOptions::default())
        .unwrap();
    for bad in [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        -1e-15,
        -f64::from_bits(1),
    ] {
        for (residual, step) in [(bad, 1e-14), (1e-15, bad)] {
            let options = NewtonOptions::default().with_tolerances(residual, step);
            for outcome in [
                solver.solve(Control::Load(5.1), &options),
                solver.solve_from(&near, Control::Load(5.0), &options),
            ] {
                let error = outcome.unwrap_err();
                assert!(
                    matches!(error, NewtonError::Membrane(MembraneError::OutOfRange { given, .. }) if given.to_bits() == bad.to_bits()),
                    "{error}"
                );
                let message = error.to_string();
                assert!(
                    message.ends_with(&format!(
                        "tolerance is {bad:?}; it must be finite and not negative"
                    )),
                    "{message}"
                );
            }
        }
    }
    // with a tolerance of zero the other one decides
    for zero in [0.0, -0.0] {
        let options = NewtonOptions::default().with_tolerances(zero, 1e-14);
        assert!(solver.solve(Control::Load(5.1), &options).is_ok());
    }
    // an unlimited number of steps needs no memory
    let options = NewtonOptions::default()
        .with_max_iterations(usize::MAX)
        .with_max_load_steps(usize::MAX);
    assert!(solver.solve(Control::VolumeGain(0.6), &options).is_ok());
}

#[test]
fn matrices_and_unknowns_of_another_size_are_rejected() {
    let mut lu = BandedLu::for_matrix(&BandMatrix::zeros(3, 1, 2).unwrap());
    for ((n, lower, upper), what, given, expected) in [
        ((4, 1, 2), "rows", 4, 3),
        ((0, 1, 2), "rows", 0, 3),
        ((3, 2, 2), "diagonals below the main one", 2, 1),
        ((3, 1, 0), "diagonals above the main one", 0, 2),
    ] {
        let refused = lu.factor(&BandMatrix::zeros(n, lower, upper).unwrap());
        let expected = NewtonError::Membrane(MembraneError::WrongLength {
            what,
            given,
            expected,
        });
        assert_eq!(refused.unwrap_err(), expected);
    }
    assert_eq!(lu.solve_into(&mut [1.0; 3]), Err(NewtonError::NotFactored));

    struct Line;
    impl ResidualSystem for Line {
        fn len(&self) -> usize {
            2
        }
        fn residual_into(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), NewtonError> {
            out.copy_from_slice(x);
            Ok(())
        }
        fn factor(&mut self, _: &[f64]) -> Result<(), NewtonError> {
            Ok(())
        }
        fn solve_in_place(&mut self, _: &mut [f64]) -> Result<(), NewtonError> {
            Ok(())
        }
        fn residual_norm(&self, residual: &[f64]) -> f64 {
            residual[0].hypot(residual[1])
        }
        fn step_norm(&self, step: &[f64]) -> f64 {
            step[0].hypot(step[1])
        }
    }
    for mut x in [vec![], vec![1.0], vec![1.0; 3]] {
        let expected = NewtonError::Membrane(MembraneError::WrongLength {
            what: "unknowns",
            given: x.len(),
            expected: 2,
        });
        let refused = newton(&mut Line, &mut x, &NewtonOptions::default());
        assert_eq!(refused.unwrap_err(), expected);
    }
    let mut x = [1.0, 2.0];
    newton(&mut Line, &mut x, &NewtonOptions::default()).unwrap();
    assert_eq!(x, [0.0; 2]);
}

/// All measures of a curve are finite, but its total force overflows: an error, as for a volume that overflows.
#[test]
fn a_total_force_that_overflows_is_rejected() {
    // A tiny load for such a stiff membrane, with a surface of 1e162.
    let membrane = Membrane::new(ReferenceShape::balloon(8.5e80, 1.75e80).unwrap())
        .with_law(PressureLaw::TotalForce)
        .with_stiffness(Stiffness::constant(1e75).unwrap());
    let spectral = Discretisation::Spectral {
        degree: 12,
        per_piece: 1,
    };
    let solver = Solver::new(&membrane, spectral).unwrap();
    let solved = |f: f64| solver.solve(Control::Intensity(f), &NewtonOptions::default());
    assert!(solved(1e140).unwrap().load.is_finite());
    let refused = MembraneError::within("load", f64::INFINITY, f64::MIN, f64::MAX).unwrap_err();
    assert_eq!(solved(1e150).unwrap_err(), NewtonError::Membrane(refused));
}
