//! Limit points of branches of rubber: states beyond a limit are not results, even if stable; all controls just before it are solved.

use std::f64::consts::PI;

use membrane_newton::{
    Control, CurvePoint, Discretisation, Equilibrium, Membrane, NewtonError, NewtonOptions,
    ReferenceShape, Rubber, Solver, StrainEnergy, Thickness,
};

/// Half an ellipsoid of revolution of radius 1, `length` long.
fn cap(length: f64) -> ReferenceShape {
    let place = move |s: f64| {
        let (sin, cos) = (PI * s).sin_cos();
        CurvePoint {
            position: [length * sin, cos],
            first: [PI * length * cos, -PI * sin],
            second: [-PI * PI * length * sin, -PI * PI * cos],
        }
    };
    ReferenceShape::from_function(place, &[]).unwrap()
}

/// The limit does not depend on how far beyond it the pressure is.
#[test]
fn a_pressure_far_beyond_its_limit_has_the_same_limit() {
    for (mu, h) in [(1.0, 0.1), (0.4, 0.001)] {
        let rubber = Rubber::new(
            StrainEnergy::NeoHookean { mu },
            Thickness::constant(h).unwrap(),
        );
        let disc = Membrane::new(ReferenceShape::disc(1.0).unwrap()).with_rubber(rubber.unwrap());
        for solver in solvers(&disc) {
            let scale = mu * h;
            let near = limit(solve(&solver, Control::Load(3.0 * scale)));
            for factor in [1e3, 1e6, 1e9] {
                let found = solve(&solver, Control::Load(factor * scale));
                let said = found.as_ref().unwrap_err().to_string();
                assert!(
                    said.contains("pressure in the unit of the modulus"),
                    "{said}"
                );
                let far = limit(found);
                // that of the two searches for the same maximum
                assert!((far / near - 1.0).abs() < 1e-9, "{factor:e}: {far} {near}");
            }
        }
    }
}

/// Loose tolerances do not end a branch early: loads below the limit are solved, and the limit is the same.
#[test]
fn a_limit_does_not_depend_on_the_tolerances() {
    let neo = StrainEnergy::NeoHookean { mu: 1.0 };
    let disc = of(ReferenceShape::disc(1.0).unwrap(), neo, 0.0);
    for solver in &solvers(&disc)[1..4] {
        let most = limit(solve(solver, Control::Load(10.0)));
        for (residual, step) in [(1e-4, 1e-4), (1e-15, 1e-3), (1e-3, 1e-15), (0.1, 0.1)] {
            let options = NewtonOptions::default().with_tolerances(residual, step);
            let far = limit(solver.solve(Control::Load(10.0), &options));
            // that of the two searches for the same maximum
            assert!((far / most - 1.0).abs() < 1e-9, "{options:?}: {far} {most}");
            for fraction in [0.01, 0.3, 0.6, 0.99] {
                let load = Control::Load(fraction * most);
                let found = solver.solve(load, &options).unwrap();
                let exact = solve(solver, load).unwrap();
                let volume = found.measures.volume / exact.measures.volume - 1.0;
                // the largest tolerance, 1e-9 of the length 2, over the height, which is at least 0.1
                assert!(volume.abs() < 2e-8, "{options:?} {fraction}: {volume:e}");
            }
        }
    }
}

/// Rubber of thickness exp(`swing`) at the ring and exp(-`swing`) at the apex.
fn of(rest: ReferenceShape, energy: StrainEnergy, swing: f64) -> Membrane {
    let thickness = Thickness::function(move |s: f64| (swing * (2.0 * PI * s).cos()).exp(), &[]);
    let rubber = Rubber::new(energy, thickness.unwrap()).unwrap();
    Membrane::new(rest).with_rubber(rubber)
}

fn solvers(membrane: &Membrane) -> Vec<Solver> {
    [
        Discretisation::SpectralAdaptive { tolerance: 1e-7 },
        Discretisation::Spectral {
            degree: 12,
            per_piece: 1,
        },
        Discretisation::Spectral {
            degree: 24,
            per_piece: 4,
        },
        Discretisation::FiniteDifferences { nodes: 101 },
        Discretisation::FiniteDifferences { nodes: 401 },
    ]
    .map(|how| Solver::new(membrane, how).unwrap())
    .into()
}

fn solve(solver: &Solver, control: Control) -> Result<Equilibrium, NewtonError> {
    solver.solve(control, &NewtonOptions::default())
}

/// Where a limit point was found.
fn limit(found: Result<Equilibrium, NewtonError>) -> f64 {
    match found {
        Err(NewtonError::LimitPoint { reached, .. }) => reached,
        other => panic!("{other:?}"),
    }
}

fn stiffening() -> StrainEnergy {
    StrainEnergy::Ogden {
        terms: vec![[2.3169, 2.0757], [-0.17667, -1.8454], [0.025728, 3.3587]],
    }
}

/// The pressure rises, falls and rises again: states above the limit are solved under volume control and rejected under pressure control, at any
/// resolution. Newton's method alone converges to them from the reference configuration.
#[test]
fn a_pressure_beyond_its_limit_is_rejected_despite_stiffer_states() {
    let mooney = StrainEnergy::MooneyRivlin {
        c1: 480.0,
        c2: 32.0,
    };
    let uneven = StrainEnergy::Ogden {
        terms: vec![[2.2545, 1.69076], [-0.29757, -1.70215], [0.05368, 3.78783]],
    };
    for (rest, energy, swing, factors) in [
        (cap(0.5831), stiffening(), 0.0, [1.03, 1.2]),
        (
            ReferenceShape::disc(1.0).unwrap(),
            stiffening(),
            0.0,
            [1.03, 1.06],
        ),
        (
            ReferenceShape::disc(1.0).unwrap(),
            mooney,
            -0.75,
            [2.0, 2.03],
        ),
        (
            ReferenceShape::disc(1.0).unwrap(),
            uneven,
            -0.13,
            [2.1, 2.124],
        ),
    ] {
        let membrane = of(rest, energy.clone(), swing);
        let mut limits = Vec::new();
        for solver in solvers(&membrane) {
            let most = limit(solve(&solver, Control::Load(1e4 * energy.shear_modulus())));
            for factor in factors {
                let reached = limit(solve(&solver, Control::Load(factor * most)));
                // the limit is stationary: its own error is that of rounding
                assert!((reached / most - 1.0).abs() < 1e-9, "{energy:?}: {factor}");
            }
            limits.push(most);
        }
        for most in &limits {
            // differences on 101 nodes are accurate to about 1e-3
            assert!((most / limits[0] - 1.0).abs() < 3e-3, "{limits:?}");
        }
        let fine = &solvers(&membrane)[2];
        let beyond = solve(fine, Control::Volume(5e4)).unwrap();
        let more = beyond.intensity / limits[0];
        assert!(more > factors[0], "{energy:?}: {more}");
    }
}

/// Where the thickness varies the pressure hardly rises before its limit; yet pressures down to 1e-6 below it have a solution, on the rising side.
#[test]
fn a_pressure_a_millionth_below_the_limit_is_solved() {
    let neo = StrainEnergy::NeoHookean { mu: 1.0 };
    for length in [0.3, 0.55, 1.0, 2.0] {
        for swing in [-0.9, -0.4, 0.0, 0.4, 0.9] {
            let membrane = of(cap(length), neo.clone(), swing);
            let [adaptive, .., differences] = &solvers(&membrane)[..] else {
                panic!("five solvers");
            };
            for solver in [adaptive, differences] {
                let most = limit(solve(solver, Control::Load(100.0)));
                for below in [1e-2, 1e-4, 1e-5, 1e-6] {
                    let case = format!("{length} {swing} {below}");
                    let found = solve(solver, Control::Load(most * (1.0 - below)));
                    let found = found.unwrap_or_else(|error| panic!("{case}: {error}"));
                    let slope = found.sensitivity(Control::Volume(1.0)).unwrap().intensity;
                    assert!(slope > 0.0, "{case}: {slope}");
                }
            }
        }
    }
}

/// A bulge at the apex that grows while the remainder shrinks: the branch turns back in the volume, too. Both discretisations report where, for any
/// larger requested volume; it is no limit of extension, because this rubber has none.
#[test]
fn a_volume_beyond_its_limit_is_a_limit_point() {
    let energy = StrainEnergy::Ogden {
        terms: vec![
            [2.5875924, 1.2429773],
            [-0.0287692, -1.2347384],
            [0.0215733, 3.095678],
        ],
    };
    let membrane = of(cap(0.5831), energy, 0.0);
    let rest = 2.0 / 3.0 * PI * 0.5831;
    for solver in [&solvers(&membrane)[0], &solvers(&membrane)[4]] {
        let limits: Vec<f64> = (0..20)
            .map(|k| {
                limit(solve(
                    solver,
                    Control::Volume((4.0 + 0.2 * f64::from(k)) * rest),
                ))
            })
            .collect();
        for reached in &limits {
            // determined by steps, within about 1e-4; differences on 401 nodes are slightly less accurate
            assert!((reached / rest - 3.919).abs() < 4e-3, "{limits:?}");
        }
        let before = solve(solver, Control::Volume(3.9 * rest)).unwrap();
        let slope = before.sensitivity(Control::Volume(1.0)).unwrap().intensity;
        assert!(slope * rest < -0.2 * before.intensity, "{slope}");
    }
}

/// The pressure of Gent rubber near the longest stretch rises steeply, and a volume a little further has no equilibrium; near an inflection it hardly
/// rises. Neither is a limit.
#[test]
fn a_pressure_that_rises_everywhere_has_no_limit() {
    for jm in [23.92881, 23.95453, 23.97827] {
        let gent = StrainEnergy::Gent { mu: 1.0, jm };
        let membrane = of(ReferenceShape::balloon(1.0, 1.0).unwrap(), gent, 0.0);
        let polynomials = Discretisation::Spectral {
            degree: 16,
            per_piece: 2,
        };
        let solver = Solver::new(&membrane, polynomials).unwrap();
        let mut before = 0.0;
        for load in (38..64).map(f64::from) {
            let solved = solve(&solver, Control::Load(load)).unwrap();
            assert!(solved.measures.volume > before, "{jm}: {load}");
            before = solved.measures.volume;
        }
    }
}

/// Near the longest stretch of Gent rubber the pressure increases by orders of magnitude while the volume hardly changes.
#[test]
fn a_very_large_pressure_of_stiffening_rubber_is_solved() {
    let disc = ReferenceShape::disc(1.0).unwrap();
    let membrane = of(disc, StrainEnergy::Gent { mu: 0.1, jm: 30.0 }, 0.0);
    for solver in [1, 3].map(|k| solvers(&membrane).swap_remove(k)) {
        let volumes = [1e2, 1e4, 1e5, 1e6].map(|load| {
            let solved = solve(&solver, Control::Load(load)).unwrap();
            assert_eq!(solved.intensity, load);
            solved.measures.volume
        });
        assert!(volumes.is_sorted(), "{volumes:?}");
        // the relative distance from the largest volume is of the order of jm times modulus over pressure, 3e-4 at 1e4
        assert!(volumes[3] / volumes[1] - 1.0 < 1e-3, "{volumes:?}");
    }
}

/// The pressure of Gent rubber that is thick at the apex rises again far beyond its limit: from an equilibrium just below the limit, larger pressures
/// are not those of stiff states of ten times the volume.
#[test]
fn from_an_equilibrium_before_a_limit_no_stiffer_state_is_reached() {
    let balloon = ReferenceShape::balloon(8.5, 1.75).unwrap();
    let membrane = of(balloon, StrainEnergy::Gent { mu: 1.0, jm: 30.0 }, -0.3);
    let spectral = Discretisation::Spectral {
        degree: 16,
        per_piece: 1,
    };
    let solver = Solver::new(&membrane, spectral).unwrap();
    let near = solve(&solver, Control::Volume(224.0)).unwrap();
    let most = limit(solve(&solver, Control::Load(1.5 * near.load)));
    assert!(near.load < most && most < 1.1 * near.load);
    let stiff = solve(&solver, Control::Volume(4000.0)).unwrap();
    assert!(stiff.load > 2.0 * near.load, "{}", stiff.load);
    for factor in [1.1, 1.5, 2.0, 3.0] {
        let load = Control::Load(factor * near.load);
        let found = limit(solver.solve_from(&near, load, &NewtonOptions::default()));
        // that of two searches for the same maximum
        assert!(
            (found / most - 1.0).abs() < 1e-9,
            "{factor}: {found} {most}"
        );
    }
}

/// The pressure of a balloon thick at the ring has a shallow maximum, falls by 1e-5 to 6e-5 of it, and rises again: pressures beyond the maximum are not those of
/// the states after it, whose rates of change are similar.
#[test]
fn a_shallow_maximum_of_the_pressure_is_not_stepped_over() {
    let balloon = ReferenceShape::balloon(3.0, 1.0).unwrap();
    let mooney = StrainEnergy::MooneyRivlin { c1: 0.5, c2: 0.09 };
    let membrane = of(balloon, mooney, 0.2);
    for how in [
        Discretisation::Spectral {
            degree: 12,
            per_piece: 1,
        },
        Discretisation::FiniteDifferences { nodes: 41 },
    ] {
        let solver = Solver::new(&membrane, how).unwrap();
        let pressures: Vec<f64> = (0..60)
            .map(|k| Control::Volume(15.0 * 1.05f64.powi(k)))
            .map(|volume| solve(&solver, volume).unwrap().intensity)
            .collect();
        let falls = pressures.windows(2).position(|p| p[1] < p[0]).unwrap();
        let most = pressures[falls];
        assert!(pressures[falls + 2] > 0.9999 * most && pressures[59] > 1.04 * most);
        for factor in [1.01, 1.02, 1.05, 1.1, 1.2, 1.5] {
            let reached = limit(solve(&solver, Control::Load(factor * most)));
            // volumes in steps of 1.05 near a maximum where the pressure changes by 3e-5 from one to the next
            assert!(
                (reached / most - 1.0).abs() < 1e-5,
                "{factor}: {reached} {most}"
            );
        }
    }
}
