//! The limits of membranes: slack sheets, deflated rubber, intersecting walls, the end of extension.

use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, MembraneError, NewtonError, NewtonOptions,
    ReferenceShape, Rubber, Solver, StrainEnergy, Thickness,
};

fn of(rest: ReferenceShape, energy: StrainEnergy) -> Membrane {
    Membrane::new(rest).with_rubber(Rubber::new(energy, Thickness::UNIT).unwrap())
}

fn neo(rest: ReferenceShape) -> Membrane {
    of(rest, StrainEnergy::NeoHookean { mu: 1.0 })
}

/// The equilibria at these volumes, each solved from the previous one.
pub(crate) fn along(solver: &Solver, volumes: &[f64]) -> Result<Vec<Equilibrium>, NewtonError> {
    let options = NewtonOptions::default();
    let mut branch: Vec<Equilibrium> = Vec::new();
    for volume in volumes.iter().map(|volume| Control::Volume(*volume)) {
        branch.push(match branch.last() {
            Some(last) => solver.solve_from(last, volume, &options)?,
            None => solver.solve(volume, &options)?,
        });
    }
    Ok(branch)
}

fn solvers(membrane: &Membrane) -> [Solver; 2] {
    [
        Discretisation::Spectral {
            degree: 20,
            per_piece: 1,
        },
        Discretisation::FiniteDifferences { nodes: 201 },
    ]
    .map(|how| Solver::new(membrane, how).unwrap())
}

/// Föppl's flat membrane of incompressible rubber (nu = 1/2, E = 3 mu) under a small pressure: w and u of the radius r solve
/// N_r' + (N_r - N_t) / r = 0 and N_r w' = -p r / 2. Shooting from the axis by Runge and Kutta's fourth order; returns p / V^3 for
/// R = mu = h = 1.
fn foppl() -> f64 {
    // E h = 3; N_r = 4 (e_r + e_t / 2), N_t = 4 (e_t + e_r / 2); e_r = u' + w'^2 / 2, e_t = u / r; unknowns u, N_r under p = 1
    let rates = |r: f64, u: f64, tension: f64| {
        let slope = -0.5 * r / tension;
        let hoop = u / r;
        let along = 0.25 * tension - 0.5 * hoop;
        let around = 4.0 * (hoop + 0.5 * along);
        [
            along - 0.5 * slope * slope,
            (around - tension) / r,
            std::f64::consts::PI * r * r * -slope,
        ]
    };
    // edge displacement and volume for a tension at the axis, where e_r = e_t = N / 6
    let shoot = |tension: f64| {
        let (steps, first) = (4000, 1e-3);
        // near the axis u = N r / 6 and the volume is of the order r^4
        let mut y = [tension * first / 6.0, tension, 0.0];
        let h = (1.0 - first) / f64::from(steps);
        for k in 0..steps {
            let r = first + h * f64::from(k);
            let at = |by: f64, k: [f64; 3]| [y[0] + by * k[0], y[1] + by * k[1]];
            let k1 = rates(r, y[0], y[1]);
            let [u, n] = at(0.5 * h, k1);
            let k2 = rates(r + 0.5 * h, u, n);
            let [u, n] = at(0.5 * h, k2);
            let k3 = rates(r + 0.5 * h, u, n);
            let [u, n] = at(h, k3);
            let k4 = rates(r + h, u, n);
            for i in 0..3 {
                y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        y
    };
    let (mut low, mut high) = (0.2, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[0] > 0.0 {
            high = middle
        } else {
            low = middle
        }
    }
    // V scales as p^(1/3)
    1.0 / shoot(low)[2].powi(3)
}

/// The start of the integration off the axis costs 1e-6, differences on 201 nodes 7e-5.
const OF_FOPPL: [f64; 2] = [3e-6, 1e-4];

#[test]
fn a_flat_disc_at_tiny_volumes_and_loads_is_foppls() {
    let expected = foppl();
    assert!((expected - 3.3367).abs() < 5e-5, "{expected}");
    let options = NewtonOptions::default();
    let disc = neo(ReferenceShape::disc(1.0).unwrap());
    for (solver, tolerance) in solvers(&disc).iter().zip(OF_FOPPL) {
        for volume in [1e-3, 3.2e-4, 3.1e-4, 1e-5, 1e-6, 1e-12, 1e-40] {
            let solved = solver.solve(Control::Volume(volume), &options).unwrap();
            let ratio = solved.intensity / volume.powi(3);
            assert!(
                (ratio / expected - 1.0).abs() < tolerance,
                "{volume:e}: {ratio}"
            );
            assert!((solved.measures.volume / volume - 1.0).abs() < 1e-12);
            // dp / dV = 3 p / V, and all frequencies scale with the strain
            let slope = solved
                .sensitivity(Control::Volume(volume))
                .unwrap()
                .intensity;
            assert!(
                (slope * volume / (3.0 * solved.intensity) - 1.0).abs() < 1e-5,
                "{volume:e}: {slope:e}"
            );
            let lowest = solved.stability().unwrap().at_pressure.lowest / (volume * volume);
            let larger = solver.solve(Control::Volume(1e-2), &options).unwrap();
            let other = larger.stability().unwrap().at_pressure.lowest / 1e-4;
            // of the order of the strain, 1e-4
            assert!(
                (lowest / other - 1.0).abs() < 1e-3,
                "{volume:e}: {lowest} {other}"
            );
        }
        for load in [1e-24, 1e-12, 1e-9, -1e-24] {
            let solved = solver.solve(Control::Load(load), &options).unwrap();
            let ratio = load / solved.measures.volume.powi(3);
            assert!(
                (ratio / expected - 1.0).abs() < 10.0 * tolerance,
                "{load:e}: {ratio}"
            );
            assert_eq!(solved.intensity, load);
            let force = solver.solve(
                Control::TotalForce(solved.intensity * solved.measures.surface),
                &options,
            );
            let off = force.unwrap().measures.volume / solved.measures.volume - 1.0;
            assert!(off.abs() < 1e-6, "{load:e}: {off:e}");
        }
        // as a branch, from a tiny state to ordinary ones and back
        let volumes = [1e-9, 1e-3, 0.1, 1e-6];
        let branch = along(solver, &volumes).unwrap();
        for (solved, volume) in branch.iter().zip(volumes) {
            let strain = 2.0 * volume * volume;
            let ratio = solved.intensity / volume.powi(3);
            assert!(
                (ratio / expected - 1.0).abs() < tolerance + strain,
                "{volume:e}: {ratio}"
            );
        }
    }
}

/// A deflated balloon of springs narrows until its walls intersect; beyond that it encloses no body.
#[test]
fn intersecting_walls_are_an_error() {
    let options = NewtonOptions::default();
    for (radius, last, first) in [(1.0, -0.86, -0.87), (1.75, -0.88, -0.9)] {
        let balloon = Membrane::new(ReferenceShape::balloon(8.5, radius).unwrap());
        for solver in solvers(&balloon) {
            let narrow = solver.solve(Control::VolumeGain(last), &options).unwrap();
            // pi times the integral of y^2 over x of the upper half, here of the polyline
            let points = narrow.points();
            let half = &points[..=points.len() / 2];
            let cone = |p: &[[f64; 2]]| {
                let ([a, b], dx) = ([p[0][1], p[1][1]], p[1][0] - p[0][0]);
                std::f64::consts::PI / 3.0 * dx * (a * a + a * b + b * b)
            };
            let volume: f64 = half.windows(2).map(cone).sum();
            assert!(
                (volume / narrow.measures.volume - 1.0).abs() < 0.1,
                "{volume}"
            );
            assert!(half[..half.len() - 1].iter().all(|point| point[1] > 0.0));
            for gain in [first, -0.95, -0.99] {
                let met = solver.solve(Control::VolumeGain(gain), &options);
                assert!(
                    matches!(met, Err(NewtonError::Collapsed { s }) if s > 0.0 && s < 0.5),
                    "{gain}: {met:?}"
                );
            }
        }
        // not its own mirror image: the whole curve is solved
        let skewed = membrane_newton::Stiffness::function(|s| 1.0 + 0.1 * s, &[]).unwrap();
        for solver in solvers(&balloon.clone().with_stiffness(skewed)) {
            let met = solver.solve(Control::VolumeGain(-0.95), &options);
            assert!(matches!(met, Err(NewtonError::Collapsed { .. })), "{met:?}");
        }
    }
}

/// Deflated rubber has no equilibrium because it is compressed, not because of a limit point.
#[test]
fn deflated_rubber_is_slack() {
    let options = NewtonOptions::default();
    for rest in [
        ReferenceShape::balloon(8.5, 1.75).unwrap(),
        ReferenceShape::balloon(0.05, 1.0).unwrap(),
        ReferenceShape::balloon(1.0, 1.0).unwrap(),
    ] {
        for solver in solvers(&neo(rest)) {
            for control in [-0.001, -0.01, -0.2, -0.5].map(Control::VolumeGain) {
                let slack = solver.solve(control, &options);
                assert!(
                    matches!(slack, Err(NewtonError::Slack { tension }) if tension < 0.0),
                    "{control:?}: {slack:?}"
                );
            }
            for control in [-1e-5, -0.001, -0.1, -3.0].map(Control::Load) {
                let slack = solver.solve(control, &options);
                assert!(
                    matches!(slack, Err(NewtonError::Slack { tension }) if tension < 0.0),
                    "{control:?}: {slack:?}"
                );
            }
            // also from a taut state
            let taut = solver.solve(Control::VolumeGain(0.3), &options).unwrap();
            for control in [Control::VolumeGain(-0.2), Control::Load(-0.05)] {
                let slack = solver.solve_from(&taut, control, &options);
                assert!(
                    matches!(slack, Err(NewtonError::Slack { .. })),
                    "{control:?}: {slack:?}"
                );
            }
        }
    }
}

/// A flat disc of rubber is not slack under suction: its equilibria are the mirror images of those under pressure, also from equilibria on
/// either side, and so are its limits.
#[test]
fn a_flat_disc_under_suction_is_the_mirror_image() {
    let options = NewtonOptions::default();
    let is_mirror = |above: &Equilibrium, below: &Equilibrium, tolerance: f64| {
        let points = above.points().into_iter().zip(below.points());
        let apart = points.map(|(a, b)| (a[0] + b[0]).abs().max((a[1] - b[1]).abs()));
        assert!(apart.fold(0.0, f64::max) <= tolerance);
        assert!((above.load + below.load).abs() <= tolerance * above.load);
    };
    for solver in solvers(&neo(ReferenceShape::disc(1.0).unwrap())) {
        let solve = |control| solver.solve(control, &options).unwrap();
        for load in [1e-12, 1e-4, 0.01, 0.3, 0.9, 1.7] {
            for control in [Control::Load, Control::Intensity, Control::TotalForce] {
                is_mirror(&solve(control(load)), &solve(control(-load)), 0.0);
            }
        }
        is_mirror(&solve(Control::Area(0.5)), &solve(Control::Area(-0.5)), 0.0);
        for (near, to) in [(0.5, -1.2), (-0.5, -1.2), (-0.5, 1.2), (-1e-12, -1.2)] {
            let there = solver.solve_from(&solve(Control::Load(near)), Control::Load(to), &options);
            // two solves of one equilibrium
            is_mirror(&solve(Control::Load(1.2)), &solve(Control::Load(-1.2)), 0.0);
            let (there, direct) = (there.unwrap(), solve(Control::Load(to)));
            assert!((there.measures.volume - direct.measures.volume).abs() < 1e-9);
        }
        // past the limit of the pressure, about 3.6
        let limit = |load| match solver.solve(Control::Load(load), &options) {
            Err(NewtonError::LimitPoint {
                reached, wanted, ..
            }) if wanted == load => reached,
            other => panic!("{load}: {other:?}"),
        };
        assert_eq!(limit(8.0), -limit(-8.0));
        assert!(
            solver
                .solve(Control::Load(f64::NEG_INFINITY), &options)
                .is_err()
        );
    }
}

/// Rubber of little extension whose walk ends in a compressed state: the cause is slackness, not a limit of the volume.
#[test]
fn rubber_that_ends_compressed_is_slack() {
    let balloon = ReferenceShape::balloon(1.1837, 0.5317).unwrap();
    let gent = of(
        balloon,
        StrainEnergy::Gent {
            mu: 1.0,
            jm: 1.31875,
        },
    );
    for how in [
        Discretisation::Spectral {
            degree: 7,
            per_piece: 2,
        },
        Discretisation::FiniteDifferences { nodes: 18 },
    ] {
        let solver = Solver::new(&gent, how).unwrap();
        for volume in [0.0096, 0.003, 0.00096, 0.0003] {
            let slack = solver.solve(Control::Volume(volume), &NewtonOptions::default());
            assert!(
                matches!(slack, Err(NewtonError::Slack { tension }) if tension < 0.0),
                "{how:?}, {volume}: {slack:?}"
            );
        }
    }
}

/// The end of extension is the same from the reference configuration and along a branch; it is no limit point.
#[test]
fn past_extension_is_one_error_from_the_reference_and_along_a_branch() {
    let options = NewtonOptions::default();
    let balloon = ReferenceShape::balloon(8.5, 1.75).unwrap();
    for jm in [2.0, 5.0] {
        let gent = of(balloon.clone(), StrainEnergy::Gent { mu: 1.0, jm });
        for solver in solvers(&gent) {
            let rest = solver.start_measures().volume;
            for far in [21.0, 60.0] {
                let at_once = solver.solve(Control::Volume(far * rest), &options);
                let branch = along(&solver, &[1.5 * rest, 2.0 * rest, far * rest]);
                for error in [at_once.err(), branch.err()] {
                    assert!(
                        matches!(error, Some(NewtonError::Membrane(MembraneError::PastStretch { limit, .. })) if limit == 3.0 + jm),
                        "{jm} {far}: {error:?}"
                    );
                }
            }
        }
    }
}
