//! Rubber in equilibrium: reference values, first integrals, limit points, pairs.
//!
//! The reference values of the disc and the balloon were computed outside of this project; a collocation code confirms the pressure of the
//! balloon (`benches/peers/rubber.py`).

use std::f64::consts::PI;

use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, MembraneError, NewtonError, NewtonOptions,
    Pair, PairEquilibrium, ReferenceShape, Rubber, Solver, StrainEnergy, Thickness,
};

use crate::slack::along;

const NEO: StrainEnergy = StrainEnergy::NeoHookean { mu: 1.0 };

fn of(rest: ReferenceShape, energy: StrainEnergy) -> Membrane {
    let rubber = Rubber::new(energy, Thickness::UNIT).unwrap();
    Membrane::new(rest).with_rubber(rubber)
}

fn balloon() -> Membrane {
    of(ReferenceShape::balloon(8.5, 1.75).unwrap(), NEO)
}

fn disc() -> Membrane {
    of(ReferenceShape::disc(1.0).unwrap(), NEO)
}

fn spectral(membrane: &Membrane, degree: usize, per_piece: usize) -> Solver {
    Solver::new(membrane, Discretisation::Spectral { degree, per_piece }).unwrap()
}

fn differences(membrane: &Membrane, nodes: usize) -> Solver {
    Solver::new(membrane, Discretisation::FiniteDifferences { nodes }).unwrap()
}

fn solve(solver: &Solver, control: Control) -> Equilibrium {
    solver.solve(control, &NewtonOptions::default()).unwrap()
}

#[test]
fn the_flat_disc_reaches_its_reference_values() {
    let solver = spectral(&disc(), 28, 1);
    let (p, volume) = (1.30986814766, 1.19181877167);
    let by_volume = solve(&solver, Control::Volume(volume));
    // given digits: half a unit of the last one, plus the effect of the volume's rounding
    assert!(
        (by_volume.intensity - p).abs() < 1e-10,
        "{}",
        by_volume.intensity
    );
    let apex = by_volume.at(0.5);
    assert!(
        (apex.position[0] - 0.63795620552).abs() < 1e-10,
        "{}",
        apex.position[0]
    );
    let stretched = by_volume.rubber_state(0.5).unwrap();
    assert!(matches!(
        by_volume.rubber_state(f64::NAN),
        Err(NewtonError::Membrane(MembraneError::OutOfRange { .. }))
    ));
    assert!((stretched.stretches[0] - 1.3).abs() < 1e-9, "{stretched:?}");
    let by_pressure = solve(&solver, Control::Load(p));
    assert!((by_pressure.measures.volume - volume).abs() < 1e-10);
    // finite differences converge to it with order two
    let off = |nodes| solve(&differences(&disc(), nodes), Control::Volume(volume)).intensity - p;
    let order = (off(101) / off(201)).log2();
    assert!((order - 2.0).abs() < 0.05, "{order}");
}

/// With lengths in units of 2^-20 or 2^20 and moduli in units of 2^-80 to 2^60 rubber has the same shapes, errors and eigenvalues to the last bit,
/// by the same iterations, and the same limits.
#[test]
fn equilibria_of_rubber_do_not_depend_on_units() {
    let solved = |[length, mu]: [f64; 2], is_disc: bool, how, control: Control| {
        let rest = match is_disc {
            true => ReferenceShape::disc(length).unwrap(),
            false => ReferenceShape::balloon(8.5 * length, 1.75 * length).unwrap(),
        };
        let thickness = Thickness::constant(0.25 * length).unwrap();
        let neo = StrainEnergy::NeoHookean { mu };
        let membrane = Membrane::new(rest).with_rubber(Rubber::new(neo, thickness).unwrap());
        let control = match control {
            Control::Load(pressure) => Control::Load(mu * pressure),
            Control::Volume(volume) => Control::Volume(length.powi(3) * volume),
            Control::Area(area) => Control::Area(length * length * area),
            other => other,
        };
        let solver = Solver::new(&membrane, how).unwrap();
        match solver.solve(control, &NewtonOptions::default()) {
            Ok(found) => {
                let points = found.points().as_flattened().to_vec();
                let points: Vec<f64> = points.iter().map(|x| x / length).collect();
                let modes = found.stability().unwrap();
                let modes = [modes.at_pressure, modes.at_volume];
                let lowest = modes.map(|of| (of.unstable, of.lowest * length * length / mu));
                let error = found.discretisation_error();
                Ok((points, found.intensity / mu, found.report, lowest, error))
            }
            Err(NewtonError::LimitPoint {
                reached, report, ..
            }) => Err((reached / mu, report)),
            Err(other) => panic!("{other}"),
        }
    };
    let polynomials = Discretisation::Spectral {
        degree: 16,
        per_piece: 1,
    };
    let differences = Discretisation::FiniteDifferences { nodes: 41 };
    for (is_disc, how, control) in [
        (true, polynomials, Control::Volume(1.2)),
        (true, differences, Control::Load(0.2)),
        (true, polynomials, Control::Area(1e-6)),
        // past the limit of the pressure, where one mode grows
        (true, differences, Control::Volume(8.0)),
        (false, polynomials, Control::VolumeGain(0.6)),
        (false, differences, Control::Load(0.1)),
        (false, polynomials, Control::Load(0.3)),
    ] {
        let in_units = |units: [i32; 2]| {
            let units = units.map(|power| 2f64.powi(power));
            solved(units, is_disc, how, control)
        };
        let expected = in_units([0, 0]);
        for units in [[-20, 40], [20, -40], [0, 60], [0, -80]] {
            assert_eq!(in_units(units), expected, "{units:?} {control:?}");
        }
    }
}

#[test]
fn the_balloon_of_the_paper_reaches_its_reference_values() {
    for solver in [
        spectral(&balloon(), 24, 1),
        Solver::new(
            &balloon(),
            Discretisation::SpectralAdaptive { tolerance: 1e-10 },
        )
        .unwrap(),
    ] {
        let solved = solve(&solver, Control::VolumeGain(0.3));
        assert!(
            (solved.intensity - 0.256444419246).abs() < 1e-10,
            "{}",
            solved.intensity
        );
        let apex = solved.at(0.5).position[0];
        assert!((apex - 10.4269328444).abs() < 1e-10, "{apex}");
    }
    // both numbers of nodes, with a node at the apex and without
    for (few, many) in [(101, 201), (100, 200)] {
        let off = |nodes| {
            solve(&differences(&balloon(), nodes), Control::VolumeGain(0.3)).intensity
                - 0.256444419246
        };
        let order = (off(few) / off(many)).log2();
        assert!((order - 2.0).abs() < 0.1, "{order}");
    }
}

/// Along a piece of constant r0 and h the energy W - l1 W_1 is constant, and along the whole meridian the axial component of the tension equals the
/// force of the pressure on the cross-section: 2 pi y T1 cos = p pi y^2.
#[test]
fn first_integrals_hold_along_the_curve() {
    for energy in [
        NEO,
        StrainEnergy::MooneyRivlin { c1: 0.4, c2: 0.1 },
        StrainEnergy::Ogden {
            terms: vec![[1.491, 1.3], [0.00284, 5.0], [-0.02367, -2.0]],
        },
        StrainEnergy::Gent { mu: 1.0, jm: 20.0 },
    ] {
        let membrane = of(ReferenceShape::balloon(8.5, 1.75).unwrap(), energy.clone());
        let solved = solve(&spectral(&membrane, 32, 2), Control::VolumeGain(0.5));
        let p = solved.intensity;
        let mut first = None;
        for k in 0..=400 {
            let s = 0.5 * f64::from(k) / 400.0;
            let (here, stretched) = (solved.at(s), solved.rubber_state(s).unwrap());
            let y = here.position[1];
            let cos = here.tangent()[0];
            let balance = 2.0 * PI * y * stretched.tensions[0] * cos - p * PI * y * y;
            assert!(
                balance.abs() < 1e-10 * p * PI * 1.75 * 1.75 * 4.0,
                "{energy:?} {s}: {balance:e}"
            );
            if s < 8.5 / (17.0 + PI * 1.75) {
                let [l1, l2, _] = stretched.stretches;
                let w = energy.at(l1, l2).unwrap();
                let integral = w.energy - l1 * w.by[0];
                let first = *first.get_or_insert(integral);
                assert!(
                    (integral - first).abs() < 1e-10,
                    "{energy:?} {s}: {:e}",
                    integral - first
                );
            }
        }
    }
}

/// The middle of a long tube with closed ends: p = h W_2 / (r0 l1 l2) and W_1 = p r0 l2^2 / (2 h).
#[test]
fn a_long_tube_is_that_of_the_closed_form() {
    let membrane = of(ReferenceShape::balloon(60.0, 1.0).unwrap(), NEO);
    let solved = solve(&spectral(&membrane, 24, 12), Control::VolumeGain(0.2));
    let [l1, l2, _] = solved.rubber_state(0.25).unwrap().stretches;
    let w = NEO.at(l1, l2).unwrap();
    assert!((w.by[1] / (l1 * l2) - solved.intensity).abs() < 1e-10);
    assert!((w.by[0] - 0.5 * solved.intensity * l2 * l2).abs() < 1e-10);
    // of a small strain e2: linear theory, p = 4 mu h e2 / r0 with e1 = 0 at nu = 1/2; the rest of second order
    let off = |gain: f64| {
        let solved = solve(&spectral(&membrane, 24, 12), Control::VolumeGain(gain));
        let l2 = solved.rubber_state(0.25).unwrap().stretches[1];
        solved.intensity - 4.0 * (l2 - 1.0)
    };
    let order = (off(0.02) / off(0.01)).abs().log2();
    assert!((order - 2.0).abs() < 0.05, "{order}");
}

#[test]
fn solves_start_from_the_reference_configuration() {
    for (membrane, degree) in [(balloon(), 24), (disc(), 24)] {
        for solver in [spectral(&membrane, degree, 1), differences(&membrane, 101)] {
            let unit = if solver.start_measures().volume > 0.0 {
                93.0
            } else {
                1.0
            };
            let mut last = 0.0;
            for gain in [1e-6, 1e-4, 1e-2, 0.1, 0.5] {
                let volume = solver.start_measures().volume + unit * gain;
                let solved = solve(&solver, Control::Volume(volume));
                assert!((solved.measures.volume / volume - 1.0).abs() < 1e-12);
                // the disc's pressure scales with the cube of its volume: at 1e-4 it is rounding compared with its stiffness
                if unit == 1.0 && gain < 1e-2 {
                    continue;
                }
                assert!(solved.intensity > last, "{gain}: {}", solved.intensity);
                last = solved.intensity;
                let again = solve(&solver, Control::Load(solved.intensity));
                let off = again.measures.volume - volume;
                assert!(off.abs() < 1e-8 * unit * gain.max(1e-3), "{gain}: {off:e}");
            }
        }
    }
    let none = solve(&spectral(&balloon(), 16, 1), Control::Load(0.0));
    assert_eq!(none.report.iterations, 0);
}

#[test]
fn the_limit_pressure_is_exact_to_rounding() {
    for solver in [
        spectral(&balloon(), 20, 2),
        differences(&balloon(), 201),
        spectral(&disc(), 20, 1),
    ] {
        let found = solver.solve(Control::Load(10.0), &NewtonOptions::default());
        let Err(NewtonError::LimitPoint {
            reached,
            wanted: 10.0,
            ..
        }) = found
        else {
            panic!("{found:?}");
        };
        // the slow reference: volumes increasingly near the zero of dp/dV
        let rest = solver.start_measures().volume;
        let unit = if rest > 0.0 { rest } else { 1.0 };
        let mut here = solve(&solver, Control::Volume(rest + 0.3 * unit));
        let slope = |at: &Equilibrium| at.sensitivity(Control::Volume(1.0)).unwrap().intensity;
        let options = NewtonOptions::default();
        let step = 0.1 * unit;
        while slope(&here) > 0.0 {
            let next = here.measures.volume + step;
            here = solver
                .solve_from(&here, Control::Volume(next), &options)
                .unwrap();
        }
        let (mut low, mut high) = (here.measures.volume - step, here.measures.volume);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            here = solver
                .solve_from(&here, Control::Volume(middle), &options)
                .unwrap();
            if slope(&here) > 0.0 {
                low = middle
            } else {
                high = middle
            }
        }
        let most = here.intensity;
        assert!((reached / most - 1.0).abs() < 1e-10, "{reached} {most}");
        // just below it there is an equilibrium, just above there is none
        let below = solve(&solver, Control::Load(reached * (1.0 - 1e-6)));
        assert!(below.measures.volume < here.measures.volume);
        let above = solver.solve(Control::Load(reached * (1.0 + 1e-6)), &options);
        assert!(matches!(above, Err(NewtonError::LimitPoint { .. })));
    }
}

#[test]
fn a_branch_continues_past_the_limit_and_reports_stability() {
    let solver = spectral(&disc(), 16, 1);
    let volumes: Vec<f64> = (1..=24).map(|k| 0.25 * f64::from(k)).collect();
    let points = along(&solver, &volumes).unwrap();
    let slopes: Vec<f64> = (points.iter().zip(&volumes))
        .map(|(point, volume)| point.sensitivity(Control::Volume(*volume)))
        .map(|slope| slope.unwrap().intensity)
        .collect();
    let past = slopes.iter().position(|slope| *slope < 0.0).unwrap();
    assert!(past > 2 && past < points.len() - 2);
    for (k, point) in points.iter().enumerate() {
        let stability = point.stability().unwrap();
        assert_eq!(
            stability.at_pressure.unstable,
            usize::from(k >= past),
            "{k}: {stability:?}"
        );
        assert!(stability.at_volume.lowest > 0.0);
        assert_eq!(slopes[k] > 0.0, k < past);
    }
    // against central differences of p(V)
    for k in 1..points.len() - 1 {
        let p = |k: usize| points[k].intensity;
        let slope = (p(k + 1) - p(k - 1)) / 0.5;
        assert!((slope - slopes[k]).abs() < 0.3 * slopes[0], "{k}");
    }
}

#[test]
fn a_pair_of_rubber_preserves_its_wall_volume() {
    let outer = of(ReferenceShape::balloon(8.5, 2.75).unwrap(), NEO);
    let pair = Pair::new(spectral(&balloon(), 20, 1), spectral(&outer, 20, 1)).unwrap();
    let options = NewtonOptions::default();
    for gain in [0.01, 0.3, 0.6] {
        let solved = pair.solve_gain(gain, &options).unwrap();
        assert!(
            solved.wall_volume_error.abs() < 1e-13,
            "{:e}",
            solved.wall_volume_error
        );
        let alone = solve(&spectral(&balloon(), 20, 1), Control::VolumeGain(gain));
        assert!((alone.intensity - solved.inner.intensity).abs() < 1e-11);
        assert!(solved.outer.intensity > 0.0 && solved.outer.intensity < solved.inner.intensity);
        let [inner, outer] = solved.sensitivity(Control::VolumeGain(gain)).unwrap();
        let e = 1e-5;
        let near = |by: f64| {
            pair.solve_from(&solved, Control::VolumeGain(gain + by), &options)
                .unwrap()
        };
        let (ahead, behind) = (near(e), near(-e));
        let slope = (ahead.inner.intensity - behind.inner.intensity) / (2.0 * e);
        assert!(
            (slope - inner.intensity).abs() < 1e-6 * inner.intensity.abs().max(1.0),
            "{slope}"
        );
        let slope = (ahead.outer.intensity - behind.outer.intensity) / (2.0 * e);
        assert!(
            (slope - outer.intensity).abs() < 1e-6 * outer.intensity.abs().max(1.0),
            "{slope}"
        );
    }
}

/// Two separately solved membranes are a pair only if the outer one encloses the inner one.
#[test]
fn a_combined_pair_has_a_wall() {
    let outer = of(ReferenceShape::balloon(8.5, 2.75).unwrap(), NEO);
    let [inner, outer] =
        [balloon(), outer].map(|m| solve(&spectral(&m, 12, 1), Control::VolumeGain(0.1)));
    let wall = outer.measures.volume - inner.measures.volume;
    let pair = PairEquilibrium::of(inner.clone(), outer.clone(), wall).unwrap();
    assert_eq!((pair.wall_volume, pair.wall_volume_error), (wall, 0.0));
    let expected = NewtonError::NotEnclosed {
        what: "volume in cm^3",
        inner: outer.measures.volume,
        outer: inner.measures.volume,
    };
    let swapped = PairEquilibrium::of(outer.clone(), inner.clone(), wall);
    assert_eq!(swapped.unwrap_err(), expected);
    let none = PairEquilibrium::of(inner, outer, -wall);
    assert!(
        matches!(
            none,
            Err(NewtonError::Membrane(MembraneError::OutOfRange { .. }))
        ),
        "{none:?}"
    );
}

#[test]
fn ends_may_be_fixed_elsewhere() {
    // a disc stretched to 1.5 times its radius: flat, l1 = l2 = 1.5 everywhere, T = W_1 / l2
    let drawn = disc().with_ends([[0.0, 1.5], [0.0, -1.5]]).unwrap();
    for solver in [spectral(&drawn, 12, 1), differences(&drawn, 401)] {
        let flat = solve(&solver, Control::Load(0.0));
        let here = flat.rubber_state(0.2).unwrap();
        let tension = NEO.at(1.5, 1.5).unwrap().by[0] / 1.5;
        assert!(
            (here.tensions[0] - tension).abs() < 1e-9 && (here.tensions[1] - tension).abs() < 1e-9
        );
        // a taut sheet under a small pressure in either direction: height p R^2 / (4 T)
        for p in [1e-4, -1e-4] {
            let pushed = solve(&solver, Control::Load(p));
            let height = p * 2.25 / (4.0 * tension);
            assert!((pushed.at(0.5).position[0] / height - 1.0).abs() < 1e-3);
        }
    }
}

#[test]
fn unsupported_uses_of_rubber_are_typed_errors() {
    let options = NewtonOptions::default();
    let gent = of(
        ReferenceShape::balloon(8.5, 1.75).unwrap(),
        StrainEnergy::Gent { mu: 1.0, jm: 2.0 },
    );
    for solver in [spectral(&gent, 16, 1), differences(&gent, 51)] {
        let past = solver.solve(Control::VolumeGain(20.0), &options);
        assert!(
            matches!(
                past,
                Err(NewtonError::Membrane(MembraneError::PastStretch { .. }))
            ),
            "{past:?}"
        );
        // up to there its pressure has no limit
        assert!(solver.solve(Control::Load(2.0), &options).is_ok());
    }
    for solver in [spectral(&balloon(), 16, 1), differences(&balloon(), 51)] {
        assert!(solver.solve(Control::VolumeGain(-0.2), &options).is_err());
        assert!(solver.solve(Control::Load(-0.1), &options).is_err());
    }
    let springs = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let solved = solve(&spectral(&springs, 8, 1), Control::Load(1.0));
    let (what, needs) = ("stretches", "rubber");
    let other = Err(MembraneError::OtherMaterial { what, needs }.into());
    assert_eq!(solved.rubber_state(0.1), other);
    assert!(solved.stability().is_err());
}

/// An element across the axis has no quadrature point on it.
#[test]
fn discs_are_solved_at_every_degree() {
    let disc = of(ReferenceShape::disc(1.0).unwrap(), NEO);
    for degree in 10..=20 {
        let discretisation = Discretisation::Spectral {
            degree,
            per_piece: 1,
        };
        let solver = Solver::new(&disc, discretisation).unwrap();
        let solved = solver.solve(Control::Load(0.5), &NewtonOptions::default());
        // All degrees agree to 1e-12.
        let volume = solved.unwrap().measures.volume;
        println!("{degree}: {volume:.12}");
        assert!(
            (volume - 0.639_799_692_1).abs() < 1e-9,
            "{degree}: {volume}"
        );
    }
}
