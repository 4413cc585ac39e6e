//! Forces, solvers and motions.

use super::{ODD, SIZES, back, pairs};
use membrane_forces::{
    BandMatrix, CurvePiece, CurvePoint, DiscreteMembrane, FiniteDifferences, LinearEquilibrium,
    Measure, Measures, Membrane, MembraneError, PressureLaw, ReferenceShape, SpectralElements,
    Stiffness,
};
use membrane_implicit::{
    Body, EvolvingOptions, ImplicitError, Load, LoadState, Motion, Scheme, Stop, TimeStep,
    Tolerance, evolve,
};
use membrane_newton::{
    BandedLu, Border, Control, Discretisation, NewtonError, NewtonOptions, Pair, Solver,
};

const MEASURES: [Measure; 4] = [
    Measure::Length,
    Measure::Area,
    Measure::Surface,
    Measure::Volume,
];

fn balloon() -> Membrane {
    Membrane::new(ReferenceShape::balloon(8.5, 1.75).expect("a balloon"))
}

#[test]
fn membrane_forces_accepts_any_input() {
    let mut rests = Vec::new();
    for [a, b] in pairs() {
        rests.extend(back(ReferenceShape::balloon(a, b)));
        rests.extend(back(ReferenceShape::polyline(&[
            [0.0, a],
            [b, 0.0],
            [0.0, -1.0],
        ])));
        rests.extend(back(ReferenceShape::from_function(
            move |s| CurvePoint {
                position: [a * s, 1.0 - 2.0 * s * b],
                first: [a, -2.0 * b],
                second: [b, a],
            },
            &[0.3],
        )));
        back(ReferenceShape::from_function(
            |s| CurvePoint {
                position: [s, 1.0 - 2.0 * s],
                first: [1.0, -2.0],
                second: [0.0; 2],
            },
            &[a, b],
        ));
        back(LinearEquilibrium::balloon(a, b, 0.0, 1.0));
        if let Some(circle) = back(LinearEquilibrium::circle(a, b)) {
            let _ = circle.measures();
            for s in ODD {
                let _ = circle.at(s);
            }
        }
        for c in [0.5, a, b] {
            if let Some(linear) = back(LinearEquilibrium::balloon(a, b, c, 1.0)) {
                let _ = linear.measures();
                let _ = linear.at(a);
            }
        }
        back(LinearEquilibrium::disc(a, b, 1.0));
        back(balloon().with_ends([[a, b], [0.0, -1.0]]));
        let piece = CurvePiece {
            from: a,
            to: b,
            x: vec![a],
            y: vec![],
        };
        let here = piece.at(a);
        let _ = here.tangent();
        let _ = here.curvature();
        let points = [[a, b], [b, a], [0.0, a]];
        for n in 0..=3 {
            let _ = Measures::of(&points[..n]);
            for measure in MEASURES {
                back(measure.rate(&points[..n], &points[..n]));
            }
        }
    }
    back(ReferenceShape::polyline(&[]));
    back(ReferenceShape::polyline(&[[0.0, 1.0]]));
    let mut stiffnesses = vec![Stiffness::UNIT];
    for a in ODD {
        back(ReferenceShape::disc(a));
        stiffnesses.extend(back(Stiffness::constant(a)));
        stiffnesses.extend(back(Stiffness::samples(&[1.0, a, 1.0])));
        stiffnesses.extend(back(Stiffness::function(move |s| a + s, &[])));
        stiffnesses.extend(back(Stiffness::function(|_| 1.0, &[a])));
    }
    back(Stiffness::samples(&[]));
    for stiffness in &stiffnesses {
        for s in ODD {
            back(stiffness.at(s));
        }
        let _ = stiffness.breakpoints();
    }
    for (k, rest) in rests.iter().enumerate() {
        for s in ODD {
            let _ = rest.at(s);
        }
        let stiffness = stiffnesses[k % stiffnesses.len()].clone();
        let law = [
            PressureLaw::PerMaterialLength,
            PressureLaw::TotalForce,
            PressureLaw::PerCurrentLength,
        ][k % 3];
        let membrane = Membrane::new(rest.clone())
            .with_second_neighbours(stiffness.clone())
            .with_stiffness(stiffness)
            .with_law(law);
        for n in [0, 1, 2, 3, 4, 5, 1 << 40, usize::MAX] {
            if let Some(d) = back(FiniteDifferences::new(&membrane, n)) {
                forces_of_differences(&d);
            }
            if let Some(d) = back(FiniteDifferences::half(&membrane, n)) {
                forces_of_differences(&d);
            }
            for per_piece in [0, 1, 2, usize::MAX] {
                if let Some(s) = back(SpectralElements::new(&membrane, n, per_piece)) {
                    forces_of_elements(&s);
                }
            }
        }
    }
    for n in SIZES {
        for width in SIZES {
            if let Some(mut band) = back(BandMatrix::zeros(n, width, 1)) {
                for i in SIZES {
                    for j in SIZES {
                        back(band.add(i, j, 1.0));
                        let _ = band.get(i, j);
                    }
                }
                band.rows().for_each(drop);
                band.clear();
                let x = vec![1.0; band.len()];
                band.mul_into(&x, &mut x.clone());
                let mut lu = BandedLu::for_matrix(&band);
                let mut b = vec![1.0; n];
                assert_eq!(lu.solve_into(&mut b), Err(NewtonError::NotFactored));
                let factored = back(lu.factor(&band)).is_some();
                assert_eq!(back(lu.solve_into(&mut b)).is_some(), factored);
                assert_eq!(lu.determinant_sign() != 0.0, factored);
            }
        }
    }
}

/// States of the correct length that are not curves, and states of wrong lengths.
fn forces_of_differences(d: &FiniteDifferences) {
    d.blow_up();
    d.stiffness_scale();
    let _ = d.ds();
    d.fixed();
    let n = d.start().len();
    let mut tangent = d.tangent();
    let mut a = vec![0.0; n];
    for value in ODD {
        let state = vec![value; n];
        back(d.measures(&state));
        back(d.points(&state));
        d.elastic_force_into(&state, &mut a);
        back(d.pressure_force_into(&state, value, &mut a));
        back(d.tangent_into(&state, value, &mut tangent));
        back(d.elastic_energy(&state));
        for measure in MEASURES {
            d.measure_gradient_into(measure, &state, &mut a);
        }
    }
    for length in [0, 1, n - 1, n + 2] {
        let state = vec![1.0; length];
        assert!(d.measures(&state).err().is_some_and(wrong));
        assert!(d.points(&state).err().is_some_and(wrong));
        assert!(d.measure(Measure::Area, &state).err().is_some_and(wrong));
    }
}

fn forces_of_elements(s: &SpectralElements) {
    s.blow_up();
    s.stiffness_scale();
    s.positions();
    let n = s.start().len();
    let (mut out, mut tangent) = (vec![0.0; n], s.tangent());
    for value in ODD {
        let state = vec![value; n];
        back(s.measures(&state));
        back(s.points(&state));
        back(s.pieces(&state));
        back(s.at(&state, value));
        s.elastic_force_into(&state, &mut out);
        back(s.pressure_force_into(&state, value, &mut out));
        back(s.tangent_into(&state, value, &mut tangent));
        for measure in MEASURES {
            s.measure_gradient_into(measure, &state, &mut out);
        }
    }
    for length in [0, 1, n - 1, n + 2] {
        let state = vec![1.0; length];
        assert!(s.measures(&state).err().is_some_and(wrong));
        assert!(s.points(&state).err().is_some_and(wrong));
        assert!(s.measure(Measure::Area, &state).err().is_some_and(wrong));
        assert!(s.pieces(&state).err().is_some_and(wrong));
        assert!(s.at(&state, 0.5).err().is_some_and(wrong));
    }
}

#[test]
fn membrane_newton_accepts_any_input() {
    let solvers: Vec<Solver> = [
        Discretisation::FiniteDifferences { nodes: 3 },
        Discretisation::FiniteDifferences { nodes: 8 },
        Discretisation::Spectral {
            degree: 2,
            per_piece: 1,
        },
        Discretisation::SpectralAdaptive { tolerance: 1e-2 },
    ]
    .into_iter()
    .filter_map(|discretisation| back(Solver::new(&balloon(), discretisation)))
    .collect();
    assert_eq!(solvers.len(), 4);
    for nodes in SIZES.map(|n| if n == 3 { 2 } else { n }) {
        let discretisation = Discretisation::FiniteDifferences { nodes };
        let refused = Solver::new(&balloon(), discretisation);
        assert!(match refused {
            Err(NewtonError::Membrane(MembraneError::TooFew { given, .. })) => given == nodes,
            Err(NewtonError::Membrane(MembraneError::TooMany { given, .. })) => given == nodes,
            _ => false,
        });
        for degree in SIZES {
            let spectral = Discretisation::Spectral {
                degree,
                per_piece: nodes,
            };
            back(Solver::new(&balloon(), spectral));
        }
    }
    let options = NewtonOptions::default()
        .with_max_iterations(8)
        .with_max_load_steps(4);
    let (mut near, mut second) = (solvers[1].start(), solvers[2].start());
    near.intensity = f64::NAN;
    second.load = f64::INFINITY;
    for value in ODD {
        back(Solver::new(
            &balloon(),
            Discretisation::SpectralAdaptive {
                tolerance: value.max(1e-3),
            },
        ));
        let controls = [
            Control::Load(value),
            Control::Intensity(value),
            Control::TotalForce(value),
            Control::Volume(value),
            Control::VolumeGain(value),
            Control::Area(value),
        ];
        for control in controls {
            for solver in &solvers {
                for outcome in [
                    solver.solve(control, &options),
                    solver.solve_from(&near, control, &options),
                    solver.solve_from(&second, control, &options),
                ] {
                    let Some(solved) = back(outcome) else {
                        continue;
                    };
                    assert!(solved.measures.volume.is_finite());
                    for s in ODD {
                        let _ = solved.at(s);
                    }
                    for control in controls {
                        back(solved.sensitivity(control));
                    }
                    let _ = solved.points();
                    let _ = solved.positions();
                    let _ = solved.pieces();
                }
            }
        }
        let odd = NewtonOptions::default().with_tolerances(value, value);
        back(solvers[0].solve(Control::VolumeGain(0.1), &odd.with_max_iterations(4)));
    }
    let never = options.with_max_iterations(0).with_max_load_steps(0);
    back(solvers[0].solve(Control::VolumeGain(0.1), &never));
    // Membranes in any order; a pair with exchanged parts and of different discretisations.
    for inner in &solvers {
        for outer in &solvers {
            back(Pair::new(inner.clone(), outer.clone()));
        }
    }
    let large = Membrane::new(ReferenceShape::balloon(8.5, 2.75).expect("a balloon"));
    let outer = Solver::new(&large, Discretisation::FiniteDifferences { nodes: 8 });
    let pair = Pair::new(solvers[2].clone(), outer.expect("nodes enough")).expect("a wall");
    let mut solved = pair.solve_gain(0.1, &options).expect("a small gain");
    std::mem::swap(&mut solved.inner, &mut solved.outer);
    back(pair.solve_from(&solved, Control::VolumeGain(0.2), &options));
    back(solved.sensitivity(Control::VolumeGain(0.1)));
    let mut border = Border::new(3);
    for corner in ODD {
        border.column_and_row_mut().1.fill(corner);
        assert_eq!(border.sign(), 0.0);
        let solve = |column: &mut [f64]| {
            column.fill(1.0);
            Ok(())
        };
        let eliminated = back(border.eliminate(corner, solve)).is_some();
        assert_eq!(
            back(border.correct(&mut [1.0; 3], corner)).is_some(),
            eliminated
        );
        let refused = border.correct(&mut [1.0; 7], corner);
        assert!(matches!(
            refused,
            Err(NewtonError::Membrane(MembraneError::WrongLength {
                given: 7,
                expected: 3,
                ..
            }))
        ));
    }
}

#[test]
fn membrane_implicit_accepts_any_input() {
    let body = || Body::springs(&balloon(), 5).expect("five nodes");
    for n in SIZES.map(|n| if n == 3 { 2 } else { n }) {
        let refused = Body::springs(&balloon(), n);
        assert!(matches!(
            refused,
            Err(ImplicitError::Membrane(
                MembraneError::TooFew { .. } | MembraneError::TooMany { .. }
            ))
        ));
    }
    let schemes = [
        Scheme::Splitting2,
        Scheme::Midpoint,
        Scheme::TrBdf2,
        Scheme::ImplicitSplitting2,
        Scheme::SemiImplicitEuler,
        Scheme::Splitting6,
    ];
    for value in ODD {
        back(body().with_mass(value));
        back(body().with_damping(value));
        for scheme in schemes {
            for load in [
                Load::intensity(move |_| value),
                Load::total_force(move |t| value * t),
                Load::volume(move |_| value),
                Load::volume_gain(&body(), move |t| value * t),
                Load::feedback(move |now: &LoadState| value * now.volume - now.volume_rate),
            ] {
                for (volume, volume_rate) in [(93.0, value), (value, 1.0)] {
                    let time = value;
                    back(load.at(&LoadState {
                        time,
                        volume,
                        volume_rate,
                    }));
                }
                let Some(mut motion) = back(Motion::new(body(), load, scheme)) else {
                    continue;
                };
                back(motion.step(value));
                back(motion.step(1e-3));
                let odd = Tolerance {
                    position: value,
                    velocity: 1e-3,
                    longest: 1.0,
                };
                back(motion.step_adaptive(&odd, 1.0));
                back(motion.step_adaptive(&Tolerance::uniform(1e-2), value));
                for stop in [
                    Stop::Time(value),
                    Stop::Volume(value),
                    Stop::Equilibrium {
                        force: value,
                        speed: value,
                    },
                ] {
                    let stops = [stop, Stop::Steps(3)];
                    back(motion.run(TimeStep::Fixed(0.01), &stops));
                    back(motion.run(TimeStep::Fixed(value), &stops));
                }
                back(motion.run(TimeStep::Fixed(0.01), &[]));
                let (mut points, mut velocities) = ([[0.0; 2]; 5], [[0.0; 2]; 5]);
                back(motion.at_into(value, &mut points, &mut velocities));
                back(motion.norms());
                let _ = motion.energy().imbalance();
                let _ = motion.state().volume();
                for n in [0, 4, 5, 6] {
                    let list = vec![[value; 2]; n];
                    back(motion.clone().with_state(value, &list, &list));
                    back(motion.clone().with_state(0.0, &list, &[[0.0; 2]; 5]));
                }
            }
        }
        let options = EvolvingOptions::default()
            .with_dt(value)
            .with_tolerance(value)
            .with_max_steps(3);
        back(evolve(&balloon(), 5, 1.0, &options));
        let few = EvolvingOptions::default().with_max_steps(2);
        if let Some(evolution) = back(evolve(&balloon(), 5, value, &few)) {
            let refused = evolution.distance_to(&[]);
            assert!(matches!(
                refused,
                Err(ImplicitError::Membrane(MembraneError::WrongLength {
                    given: 0,
                    expected: 5,
                    ..
                }))
            ));
            let _ = evolution.residual();
            let _ = evolution.is_monotone();
        }
    }
}

/// Whether the error is the length of a state.
fn wrong(error: membrane_forces::MembraneError) -> bool {
    matches!(error, membrane_forces::MembraneError::WrongLength { .. })
}

/// Options, reports and accounts through JSON; omitted options have their defaults, unknown ones are errors.
#[test]
fn membrane_options_and_reports_are_restored_from_files() {
    fn through_json<
        T: serde::Serialize + serde::de::DeserializeOwned + PartialEq + std::fmt::Debug,
    >(
        value: &T,
    ) {
        let text = serde_json::to_string(value).expect("a text");
        let read: T = serde_json::from_str(&text).expect("what was written");
        assert_eq!(&read, value);
    }
    let solver = Solver::new(&balloon(), Discretisation::FiniteDifferences { nodes: 21 });
    let options = NewtonOptions::default();
    let solver = solver.expect("nodes enough");
    let solved = solver.solve(Control::VolumeGain(0.3), &options);
    through_json(&options);
    through_json(&Control::VolumeGain(0.3));
    through_json(&Discretisation::SpectralAdaptive { tolerance: 1e-12 });
    through_json(&solved.expect("a small gain").report);
    // without an iteration the step and the error are infinite
    let failed = solver.solve(
        Control::VolumeGain(0.3),
        &options.with_max_iterations(0).with_max_load_steps(0),
    );
    match failed {
        Err(NewtonError::NotConverged { report, .. }) => {
            assert!(report.step.is_infinite() && report.iteration_error.is_infinite());
            through_json(&*report);
        }
        other => panic!("{other:?}"),
    }
    let more = r#"{"Spectral":{"degree":3,"per_piece":1,"nodes":2}}"#;
    assert!(serde_json::from_str::<Discretisation>(more).is_err());
    let more = r#"{"line_search":{"Natural":{"max_halvings":3,"most":2}}}"#;
    assert!(serde_json::from_str::<NewtonOptions>(more).is_err());
    let few: NewtonOptions = serde_json::from_str(r#"{"max_iterations":7}"#).expect("options");
    assert_eq!(few, options.with_max_iterations(7));
    assert!(serde_json::from_str::<NewtonOptions>(r#"{"iterations":7}"#).is_err());
    through_json(&EvolvingOptions::default());
    let body = Body::springs(&balloon(), 21).expect("nodes enough");
    let mut motion =
        Motion::new(body, Load::intensity(|_| 1.0), Scheme::TrBdf2).expect("a valid motion");
    motion.step(0.01).expect("a step");
    through_json(&motion.energy());
    through_json(&motion.work());
}
