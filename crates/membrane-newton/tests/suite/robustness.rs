//! Random membranes under random controls: every case converges or gives the correct typed error, and the two discretisations agree.
//! `PROPTEST_CASES=10000` is the slow suite.

use std::f64::consts::{PI, TAU};

use membrane_newton::{
    Control, Discretisation, Equilibrium, Membrane, MembraneError, NewtonError, NewtonOptions,
    PressureLaw, ReferenceShape, Solver, Stiffness,
};
use proptest::prelude::*;

#[derive(Debug, Clone)]
struct Case {
    radius: f64,
    /// Cylinder length over radius; none for the disc.
    slenderness: Option<f64>,
    amplitude: f64,
    waves: usize,
    shift: f64,
    /// A node of every mesh at which the stiffness jumps, and the factor.
    jump: Option<(f64, f64)>,
    /// Stiffness between second neighbours, over that between neighbours without waves.
    second: Option<f64>,
    law: PressureLaw,
    control: Control,
}

impl Case {
    fn membrane(&self) -> Membrane {
        let rest = match self.slenderness {
            Some(ratio) => ReferenceShape::balloon(ratio * self.radius, self.radius),
            None => ReferenceShape::disc(self.radius),
        };
        let (a, waves, shift) = (self.amplitude, self.waves as f64, self.shift);
        let wave = move |s: f64| 1.0 + a * (TAU * (waves * s + shift)).cos();
        let stiffness = match self.jump {
            Some((at, factor)) => {
                Stiffness::function(move |s| wave(s) * if s < at { 1.0 } else { factor }, &[at])
            }
            None => Stiffness::function(wave, &[]),
        };
        let membrane = Membrane::new(rest.unwrap())
            .with_stiffness(stiffness.unwrap())
            .with_law(self.law);
        match self.second {
            Some(ratio) => membrane.with_second_neighbours(Stiffness::constant(ratio).unwrap()),
            None => membrane,
        }
    }

    /// Varying stiffness has a limit point in the load: the branch of inflated shapes turns back.
    /// Constant stiffness has none.
    fn may_have_a_limit(&self) -> bool {
        (self.waves > 0 && self.amplitude > 0.0) || self.jump.is_some()
    }
}

fn log_uniform(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

fn case() -> impl Strategy<Value = Case> {
    let law = prop_oneof![
        Just(PressureLaw::PerMaterialLength),
        Just(PressureLaw::TotalForce),
        Just(PressureLaw::PerCurrentLength),
    ];
    let shape = (
        log_uniform(0.1, 10.0),
        prop_oneof![1 => Just(None), 4 => log_uniform(0.1, 20.0).prop_map(Some)],
    );
    // half of the stiffness profiles are mirror-symmetric
    let profile = (
        0.0..0.9,
        0usize..3,
        prop_oneof![Just(0.0), Just(0.5), 0.0..1.0],
    );
    let jump = ((1usize..20), log_uniform(0.2, 5.0)).prop_map(|(k, by)| (k as f64 / 20.0, by));
    let jump = prop_oneof![3 => Just(None), 1 => jump.prop_map(Some)];
    let second = prop_oneof![3 => Just(None), 1 => log_uniform(1e-3, 1.0).prop_map(Some)];
    let control = prop_oneof![
        log_uniform(1e-3, 1e3).prop_map(Control::Intensity),
        log_uniform(1e-3, 20.0).prop_map(Control::VolumeGain),
        log_uniform(1e-3, 1e3).prop_map(Control::TotalForce),
        log_uniform(1e-3, 20.0).prop_map(Control::Area),
    ];
    (shape, profile, (jump, second), law, control).prop_map(
        |((radius, slenderness), (amplitude, waves, shift), (jump, second), law, control)| {
            // the law per current length ends at 2 pi: fractions and a few multiples of that
            let unit = if law == PressureLaw::PerCurrentLength {
                7e-3
            } else {
                1.0
            };
            let surface = TAU * radius * radius * (slenderness.unwrap_or(0.0) + 1.0);
            let control = match control {
                // the disc has no reference volume
                Control::VolumeGain(gain) if slenderness.is_none() => {
                    Control::Volume(gain * radius.powi(3))
                }
                Control::Intensity(f) => Control::Intensity(f * unit),
                Control::TotalForce(f) => Control::TotalForce(f * unit * surface),
                // the increase of the area, from 2 R (h + pi R / 4)
                Control::Area(gain) => {
                    let rest = slenderness.map_or(0.0, |ratio| 2.0 * ratio + PI / 2.0);
                    Control::Area((rest + gain * rest.max(1.0)) * radius * radius)
                }
                control => control,
            };
            Case {
                radius,
                slenderness,
                amplitude,
                waves,
                shift,
                jump,
                second,
                law,
                control,
            }
        },
    )
}

/// Bound of the error of coarse differences, from the changes when ds is halved once (`first`) and again (`second`): with an error a ds + b ds^2
/// these are a ds / 2 + 3 b ds^2 / 4 and a ds / 4 + 3 b ds^2 / 16, so the error is 2/3 of the first and 8/3 of the second. (Differences have first
/// order where stiffness and normal jump, because a node has one normal.) A margin of one half covers higher orders.
fn bound(first: f64, second: f64) -> f64 {
    1.5 * (2.0 / 3.0 * first.abs() + 8.0 / 3.0 * second.abs())
}

/// Curves agree to the accuracy of differences. The largest distance of any node does not vanish by accident, as the error of a volume may. Where the
/// curvature of the reference configuration jumps, an error of order ds^2 depends on the position within the cell, which finer nodes do not share: at
/// most 0.4 ds^2 of the length in 5 000 cases.
fn agree(case: &Case, exact: &Equilibrium, meshes: [&Equilibrium; 3]) -> Result<(), TestCaseError> {
    let positions = meshes[0].positions();
    let mut points = meshes.map(Equilibrium::points);
    for (k, points) in points.iter_mut().enumerate() {
        *points = points.iter().copied().step_by(1 << k).collect();
    }
    let distance = |a: &[[f64; 2]], b: &[[f64; 2]]| {
        let pairs = a.iter().zip(b);
        pairs
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .fold(0.0, f64::max)
    };
    let [coarse, fine, finest] = &points;
    let exactly: Vec<_> = positions.iter().map(|s| exact.at(*s).position).collect();
    let error = distance(&exactly, coarse);
    let (first, second) = (distance(coarse, fine), distance(fine, finest));
    let ds = 1.0 / (positions.len() - 1) as f64;
    let bend = case.slenderness.map_or(0.0, |_| ds * ds);
    let length = exact.measures.length;
    // the adaptive tolerance of 1e-10 is relative to the length
    prop_assert!(
        error <= bound(first, second) + (bend + 1e-8) * length,
        "{case:?}: error {error:e}, changes {first:e} and {second:e}, length {length}"
    );
    Ok(())
}

/// 48 cases unless PROPTEST_CASES is set.
fn cases() -> u32 {
    let asked = std::env::var("PROPTEST_CASES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(48)
}

/// Spectral elements, then differences on 400, 800 and 1 600 cells.
struct Solvers([Solver; 4]);

impl Solvers {
    fn new(case: &Case) -> Self {
        let membrane = case.membrane();
        let differences = |nodes| Discretisation::FiniteDifferences { nodes };
        let kinds = [
            Discretisation::SpectralAdaptive { tolerance: 1e-10 },
            differences(401),
            differences(801),
            differences(1601),
        ];
        Self(kinds.map(|kind| Solver::new(&membrane, kind).unwrap()))
    }

    fn each(&self, control: Control) -> [Result<Equilibrium, NewtonError>; 4] {
        let options = NewtonOptions::default();
        self.0
            .each_ref()
            .map(|solver| solver.solve(control, &options))
    }
}

/// Either all reach the control with the same curve, or none does, for the same cause.
fn check(case: &Case) -> Result<(), TestCaseError> {
    let solvers = Solvers::new(case);
    let outcomes = solvers.each(case.control);
    if let [Ok(exact), Ok(coarse), Ok(fine), Ok(finest)] = &outcomes {
        return agree(case, exact, [coarse, fine, finest]);
    }
    let past = |outcome: &Result<_, _>| {
        matches!(outcome, Err(NewtonError::Membrane(MembraneError::PastBlowUp { pressure, limit }))
            if pressure >= limit)
    };
    if outcomes.iter().all(past) {
        prop_assert!(case.law == PressureLaw::PerCurrentLength, "{case:?}");
        return Ok(());
    }
    // Soft parts under about a hundred lambda R intersect each other; at exactly that load not on every mesh.
    let collapsed = |outcome: &&Result<_, _>| matches!(outcome, Err(NewtonError::Collapsed { .. }));
    if outcomes.iter().filter(collapsed).count() > 1 {
        return Ok(());
    }
    let limit = |outcome: &Result<_, _>| match outcome {
        Err(NewtonError::LimitPoint { reached, .. }) => Some(*reached),
        _ => None,
    };
    let mut limits = outcomes.each_ref().map(limit);
    if outcomes.iter().all(|o| o.is_ok() || limit(o).is_some()) && limits.contains(&None) {
        // the control is between their limits: use a larger one
        limits = solvers.each(twice(case.control)).each_ref().map(limit);
    }
    let [Some(exact), Some(coarse), Some(fine), Some(finest)] = limits else {
        let outcomes = outcomes.map(|o| o.map(|e| (e.measures, e.report.load_steps)));
        return Err(TestCaseError::fail(format!("{case:?}: {outcomes:?}")));
    };
    prop_assert!(case.may_have_a_limit(), "{case:?}");
    // The limit has the order of accuracy of the curves, and each approaches it from below to 2e-4: 1e-3 bounds the remaining error of the estimate.
    prop_assert!(
        (exact - coarse).abs() <= bound(coarse - fine, fine - finest) + 1e-3 * exact.abs(),
        "{case:?}: limits {exact}, {coarse}, {fine}, {finest}"
    );
    Ok(())
}

fn twice(control: Control) -> Control {
    match control {
        Control::Intensity(value) => Control::Intensity(2.0 * value),
        Control::TotalForce(value) => Control::TotalForce(2.0 * value),
        Control::VolumeGain(value) => Control::VolumeGain(2.0 * value),
        Control::Volume(value) => Control::Volume(2.0 * value),
        Control::Area(value) => Control::Area(2.0 * value),
        other => other,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]

    #[test]
    fn every_case_converges_or_is_a_typed_error(case in case()) {
        check(&case)?;
    }
}

/// The ends stay where they are, exactly, and a change of the volume by its rounding changes the shape by no more than the stated error: the
/// tangent of many nodes has entries of 1e7, that of a fixed number 1.
#[test]
fn fixed_ends_do_not_move() {
    let membrane = Membrane::new(ReferenceShape::balloon(8.5, 1.75).unwrap());
    let (nodes, options) = (4001, NewtonOptions::default());
    let solver = Solver::new(&membrane, Discretisation::FiniteDifferences { nodes }).unwrap();
    let solves = [0.0, 1.0, 2.0, 3.0, 4.0].map(|k| {
        let gain = Control::VolumeGain(2.0 * (1.0 + k * f64::EPSILON));
        solver.solve(gain, &options).unwrap()
    });
    let first = solves[0].points();
    assert_eq!([first[0], first[nodes - 1]], [[0.0, 1.75], [0.0, -1.75]]);
    for solved in &solves {
        let pairs = solved.points().into_iter().zip(&first);
        let apart = pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) / solved.measures.length);
        let (apart, stated) = (apart.fold(0.0, f64::max), solved.report.iteration_error);
        // some roundings of positions
        assert!(apart <= stated && apart < 1e-15, "{apart:e}, {stated:e}");
        let intensity = (solved.intensity / solves[0].intensity - 1.0).abs();
        // the errors of two solves
        assert!(intensity < 2.0 * stated, "{intensity:e}, {stated:e}");
    }
}
