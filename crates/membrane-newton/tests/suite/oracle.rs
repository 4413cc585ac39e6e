//! Solved equilibria against reference values and closed forms.

use membrane_forces::{LinearEquilibrium, Membrane, PressureLaw, ReferenceShape};
use membrane_newton::{Control, Discretisation, NewtonOptions, Pair, Solver};

fn balloon(radius: f64, nodes: usize) -> Solver {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
    Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap()
}

#[test]
fn finite_difference_volumes_of_the_reference() {
    // Independent solver, f = 17.5. Its Newton stopped at a residual of about 1e-5, so that its volume is uncertain by 2e-7; ours converges
    // to rounding.
    for (nodes, volume) in [
        (101, 148.81284352),
        (201, 148.85374880),
        (401, 148.86404321),
        (801, 148.86662312),
    ] {
        let solved = balloon(1.75, nodes)
            .solve(Control::Load(17.5), &NewtonOptions::default())
            .unwrap();
        println!("{:?}", solved.report);
        assert!(
            (solved.measures.volume - volume).abs() < 2e-7,
            "{nodes}: {}",
            solved.measures.volume
        );
    }
}

#[test]
fn pair_at_gain_sixty_percent() {
    let pair = Pair::new(balloon(1.75, 201), balloon(2.75, 201)).unwrap();
    let solved = pair.solve_gain(0.6, &NewtonOptions::default()).unwrap();
    println!(
        "{} {} {:?}",
        solved.inner.intensity, solved.outer.intensity, solved.report
    );
    assert!(solved.wall_volume_error.abs() < 1e-13);
    assert!((solved.inner.intensity - 17.48357527761).abs() < 2e-2);
    assert!((solved.outer.intensity - 10.30942447850).abs() < 2e-2);
}

#[test]
fn disc_becomes_the_circle_with_order_two() {
    let circle = LinearEquilibrium::circle(1.0, 10.0).unwrap();
    let error = |nodes: usize| {
        let membrane = Membrane::new(ReferenceShape::disc(1.0).unwrap());
        let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap();
        let solved = solver
            .solve(Control::Load(10.0), &NewtonOptions::default())
            .unwrap();
        let last = (nodes - 1) as f64;
        solved
            .points()
            .iter()
            .enumerate()
            .map(|(n, p)| {
                let q = circle.at(n as f64 / last).position;
                (p[0] - q[0]).hypot(p[1] - q[1])
            })
            .fold(0.0, f64::max)
    };
    let order = (error(51) / error(101)).log2();
    assert!((order - 2.0).abs() < 0.05, "order {order}");
}

#[test]
fn spectral_reaches_the_reference_values() {
    // All digits of the reference; the volumes have 11 and 9 decimals.
    let solver = |radius| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        Solver::new(
            &membrane,
            Discretisation::Spectral {
                degree: 16,
                per_piece: 1,
            },
        )
        .unwrap()
    };
    let options = NewtonOptions::default();
    let dilated = solver(1.75)
        .solve(Control::VolumeGain(0.6), &options)
        .unwrap();
    assert!(
        (dilated.intensity - 17.48357527761).abs() < 2e-11,
        "{}",
        dilated.intensity
    );
    assert!((dilated.measures.volume / 148.80677202503 - 1.0).abs() < 1e-12);

    // f, V, A, S, L, x of the apex
    let table = [
        (
            1.75,
            17.5,
            148.86748016,
            44.9887665436,
            148.112065307,
            24.3812350137,
            10.9140638471,
        ),
        (
            1.75,
            60.0,
            365.382465735,
            75.4836836376,
            256.407785876,
            29.8986418211,
            12.7675907854,
        ),
        (
            2.75,
            17.5,
            344.925256641,
            71.9643554269,
            240.67789381,
            27.9296451031,
            12.0890136483,
        ),
    ];
    for (radius, f, volume, area, surface, length, apex) in table {
        let solved = solver(radius).solve(Control::Load(f), &options).unwrap();
        let m = solved.measures;
        for (found, expected, name) in [
            (m.volume, volume, "volume"),
            (m.area, area, "area"),
            (m.surface, surface, "surface"),
            (m.length, length, "length"),
            (solved.at(0.5).position[0], apex, "apex"),
        ] {
            // half a unit of the last digit that the table prints
            assert!(
                (found / expected - 1.0).abs() < 5e-12,
                "{name}: {found} for {expected}"
            );
        }
    }
    let solved = solver(1.75).solve(Control::Load(17.5), &options).unwrap();
    for (s, [x, y]) in [
        (0.1, [2.38118651, 2.09316833]),
        (0.25, [5.98395506, 2.28149237]),
        (0.4, [9.57869939, 2.00582667]),
    ] {
        let at = solved.at(s).position;
        assert!(
            (at[0] - x).abs() < 1e-8 && (at[1] - y).abs() < 1e-8,
            "{at:?}"
        );
    }
}

#[test]
fn pair_spectral_reaches_the_reference_values() {
    let solver = |radius| {
        let membrane = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        Solver::new(
            &membrane,
            Discretisation::Spectral {
                degree: 16,
                per_piece: 1,
            },
        )
        .unwrap()
    };
    let pair = Pair::new(solver(1.75), solver(2.75)).unwrap();
    let solved = pair.solve_gain(0.6, &NewtonOptions::default()).unwrap();
    assert!(
        solved.wall_volume_error.abs() < 1e-13,
        "{:e}",
        solved.wall_volume_error
    );
    assert!((solved.inner.intensity - 17.48357527761).abs() < 2e-11);
    assert!((solved.outer.intensity - 10.30942447850).abs() < 2e-11);
    assert!((solved.outer.measures.volume / 301.30491541802 - 1.0).abs() < 1e-12);
    assert!((solved.wall_volume / 152.49814339300 - 1.0).abs() < 1e-12);
}

#[test]
fn per_current_length_reaches_the_reference_values() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
        .with_law(PressureLaw::PerCurrentLength);
    let solver = Solver::new(
        &membrane,
        Discretisation::Spectral {
            degree: 16,
            per_piece: 1,
        },
    )
    .unwrap();
    for (kappa, volume, area, length) in [
        (1.0, 180.00034338, 50.244070193, 25.4308996664),
        (4.0, 2759.41056007, 264.37919694, 55.439401175),
    ] {
        let m = solver
            .solve(Control::Load(kappa), &NewtonOptions::default())
            .unwrap()
            .measures;
        assert!((m.volume / volume - 1.0).abs() < 5e-11, "{}", m.volume);
        assert!((m.area / area - 1.0).abs() < 5e-11, "{}", m.area);
        assert!((m.length / length - 1.0).abs() < 5e-11, "{}", m.length);
    }
}

/// Suction draws the cylinder across the axis from about kappa = -3: there the volume decreases on one side of it and increases on the other, and |y|
/// has a kink inside an element.
#[test]
fn suction_agrees_with_the_closed_form() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap())
        .with_law(PressureLaw::PerCurrentLength);
    let spectral = Discretisation::Spectral {
        degree: 24,
        per_piece: 1,
    };
    let spectral = Solver::new(&membrane, spectral).unwrap();
    let differences =
        Solver::new(&membrane, Discretisation::FiniteDifferences { nodes: 1601 }).unwrap();
    for kappa in [-0.3, -1.0, -1.5, -3.0, -4.0, -6.0] {
        let exact = LinearEquilibrium::balloon(8.5, 1.75, kappa, 1.0).unwrap();
        // intersecting walls are not a result
        let mut upper = (1..500).map(|k| exact.at(0.001 * f64::from(k)).position[1]);
        let collapsed = upper.any(|y| y < 0.0);
        assert_eq!(collapsed, kappa < -2.0);
        let exact = exact.measures();
        for (solver, tolerance) in [(&spectral, 1e-11), (&differences, 1e-4)] {
            let m = solver.solve(Control::Load(kappa), &NewtonOptions::default());
            eprintln!("{kappa} {:?}", m.as_ref().err());
            let Ok(m) = m.map(|m| m.measures) else {
                continue;
            };
            for (found, exact, size) in [
                (m.length, exact.length, exact.length),
                (m.area, exact.area, exact.length.powi(2)),
                (m.surface, exact.surface, exact.length.powi(2)),
                (m.volume, exact.volume, exact.length.powi(3)),
            ] {
                let off = (found - exact).abs() / size;
                assert!(off < tolerance, "{kappa}: {found} for {exact}, {off:e}");
            }
        }
    }
}

/// Gains up to 1e9, from the start, and from an equilibrium so close that rounding of the forces hides the difference: the
/// volume is the requested one.
#[test]
fn gains_of_any_size_are_met() {
    use membrane_forces::PressureLaw::{PerCurrentLength, PerMaterialLength};
    let options = NewtonOptions::default();
    let mut answered = 0;
    for (h, radius, law, degree, per_piece) in [
        (100.0, 0.2, PerMaterialLength, 64, 2),
        (100.0, 0.2, PerCurrentLength, 4, 64),
        (0.1, 3.0, PerCurrentLength, 24, 16),
        (8.5, 1.75, PerMaterialLength, 24, 16),
    ] {
        let membrane = Membrane::new(ReferenceShape::balloon(h, radius).unwrap()).with_law(law);
        let discretisation = Discretisation::Spectral { degree, per_piece };
        let solver = Solver::new(&membrane, discretisation).unwrap();
        let met = |volume: f64, gain: f64, what: &str| {
            let off = volume / (solver.start_measures().volume * (1.0 + gain)) - 1.0;
            // the tolerance for rounding: 1e-12, or a hundredth of that of the length cubed
            assert!(
                off.abs() < 1e-11,
                "{h} {law:?} gain {gain:e} {what}: {off:e}"
            );
        };
        for gain in [1e2, 1e5, 1e6, 1e7, 1e8, 1e9] {
            // some slender membranes are errors at the finest resolution; results are correct
            let Ok(solved) = solver.solve(Control::VolumeGain(gain), &options) else {
                continue;
            };
            answered += 1;
            met(solved.measures.volume, gain, "from the start");
            for change in [1e-6, 1e-8, 1e-9, 1e-10] {
                let gain = gain * (1.0 + change);
                let control = Control::VolumeGain(gain);
                let moved = solver.solve_from(&solved, control, &options).unwrap();
                met(moved.measures.volume, gain, "from nearby");
            }
        }
    }
    assert!(answered >= 18, "{answered} of 24");
    let pair = Pair::new(balloon(1.75, 5001), balloon(2.75, 5001)).unwrap();
    let solved = pair.solve_gain(10.0, &options).unwrap();
    let near = Control::VolumeGain(10.0 + 11.0 * 1e-9);
    let moved = pair.solve_from(&solved, near, &options).unwrap();
    let wanted = solved.inner.measures.volume * (1.0 + 1e-9);
    assert!((moved.inner.measures.volume / wanted - 1.0).abs() < 2e-12);
    // of the two volumes, whose difference is that of the wall
    let wall = moved.wall_volume - pair.wall_volume();
    assert!(wall.abs() < 1e-11 * moved.outer.measures.volume);
}
