//! Unusual but valid membranes: any unit, few nodes, corners, jumps, second neighbours, displaced ends, suction. A result is finite, meets
//! its control and is an equilibrium of the whole curve; everything else is a typed error. `PROPTEST_CASES=10000` is the slow suite.

use std::f64::consts::PI;

use membrane_newton::membrane_forces::{DiscreteMembrane, FiniteDifferences};
use membrane_newton::{
    Control, CurvePoint, Discretisation, Equilibrium, Measures, Membrane, NewtonError,
    NewtonOptions, PressureLaw, ReferenceShape, Solver, Stiffness,
};
use proptest::prelude::*;

#[derive(Debug, Clone)]
enum Rest {
    Disc,
    Balloon(f64),
    Polyline(Vec<[f64; 2]>),
    /// A half circle with a third harmonic of this size along the axis.
    Wavy(f64),
}

#[derive(Debug, Clone)]
struct Case {
    rest: Rest,
    /// Powers of ten of the unit of length and of stiffness.
    units: (f64, f64),
    /// Stiffness jumps by this factor at this s.
    jump: (f64, f64),
    second: Option<f64>,
    /// Displacement of the fixed ends, in units.
    moved: Option<[[f64; 2]; 2]>,
    law: PressureLaw,
    discretisation: Discretisation,
    /// Kind, sign and size of the control.
    control: (usize, bool, f64),
}

fn log_uniform(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

fn case() -> impl Strategy<Value = Case> {
    let point = || [-0.2..0.8, -0.5..0.5];
    let rest = prop_oneof![
        Just(Rest::Disc),
        log_uniform(0.01, 100.0).prop_map(Rest::Balloon),
        prop::collection::vec(point(), 2..8).prop_map(Rest::Polyline),
        (0.0..0.3).prop_map(Rest::Wavy),
    ];
    let jump = (0.01..0.99, log_uniform(0.05, 20.0));
    let law = prop_oneof![
        Just(PressureLaw::PerMaterialLength),
        Just(PressureLaw::TotalForce),
        Just(PressureLaw::PerCurrentLength),
    ];
    let discretisation = prop_oneof![
        (3usize..10).prop_map(|nodes| Discretisation::FiniteDifferences { nodes }),
        (10usize..300).prop_map(|nodes| Discretisation::FiniteDifferences { nodes }),
        ((2usize..20), (1usize..4))
            .prop_map(|(degree, per_piece)| Discretisation::Spectral { degree, per_piece }),
        log_uniform(1e-12, 1e-4)
            .prop_map(|tolerance| Discretisation::SpectralAdaptive { tolerance }),
    ];
    (
        rest,
        (-40.0..40.0, -40.0..40.0),
        jump,
        prop::option::weighted(0.3, log_uniform(0.01, 2.0)),
        prop::option::weighted(0.2, [[-0.2..0.2, -0.2..0.2], [-0.2..0.2, -0.2..0.2]]),
        law,
        discretisation,
        (0usize..6, any::<bool>(), log_uniform(1e-3, 1e2)),
    )
        .prop_map(
            |(rest, units, jump, second, moved, law, discretisation, control)| Case {
                rest,
                units,
                jump,
                second,
                moved,
                law,
                discretisation,
                control,
            },
        )
}

impl Case {
    fn length(&self) -> f64 {
        10f64.powf(self.units.0)
    }

    fn stiffness(&self) -> f64 {
        10f64.powf(self.units.1)
    }

    /// None if the polyline crosses itself or encloses a negative volume, or if its ends are exchanged.
    fn membrane(&self) -> Option<Membrane> {
        let (unit, lambda, (at, factor)) = (self.length(), self.stiffness(), self.jump);
        let rest = match &self.rest {
            Rest::Disc => ReferenceShape::disc(unit),
            Rest::Balloon(ratio) => ReferenceShape::balloon(ratio * unit, unit),
            Rest::Polyline(points) => {
                let mut points: Vec<_> = points.iter().map(|p| p.map(|x| x * unit)).collect();
                let last = points.len() - 1;
                points[0][1] = points[0][1].abs();
                points[last][1] = -points[last][1].abs();
                ReferenceShape::polyline(&points)
            }
            &Rest::Wavy(a) => ReferenceShape::from_function(
                move |s| {
                    let ([x, y], third) = ([(PI * s).sin(), (PI * s).cos()], 3.0 * PI * s);
                    let scale = |p: [f64; 2], by: f64| p.map(|p| p * unit * by);
                    CurvePoint {
                        position: scale([x + a * third.sin(), y], 1.0),
                        first: scale([y + 3.0 * a * third.cos(), -x], PI),
                        second: scale([-x - 9.0 * a * third.sin(), -y], PI * PI),
                    }
                },
                &[],
            ),
        };
        let stiffness = move |s: f64| if s < at { lambda } else { lambda * factor };
        let mut membrane = Membrane::new(rest.ok()?)
            .with_stiffness(Stiffness::function(stiffness, &[at]).unwrap())
            .with_law(self.law);
        if let Some(ratio) = self.second {
            let second = Stiffness::constant(ratio * lambda).unwrap();
            membrane = membrane.with_second_neighbours(second);
        }
        if let Some(moved) = self.moved {
            let mut ends = membrane.ends();
            for (end, by) in ends.iter_mut().zip(moved) {
                *end = [end[0] + by[0] * unit, end[1] + by[1] * unit];
            }
            membrane = membrane.with_ends(ends).ok()?; // exchanged by chance
        }
        Some(membrane)
    }

    fn control(&self, start: &Measures) -> Control {
        let (kind, negative, size) = self.control;
        let (unit, size) = (self.length(), if negative { -size } else { size });
        let intensity = self.stiffness()
            * match self.law {
                PressureLaw::PerCurrentLength => 0.05,
                _ => unit,
            };
        match kind {
            0 if self.law == PressureLaw::TotalForce => {
                Control::Load(size * intensity * unit * unit)
            }
            0 => Control::Load(size * intensity),
            1 => Control::Intensity(size * intensity),
            2 => Control::TotalForce(size * intensity * unit * unit),
            3 => Control::Volume(start.volume + 0.1 * size * unit.powi(3)),
            4 => Control::VolumeGain(0.1 * size),
            _ => Control::Area(start.area + 0.1 * size * unit * unit),
        }
    }
}

/// The prescribed value, the value of the result, and the size to which its rounding refers.
fn prescribed(control: Control, start: &Measures, found: &Equilibrium) -> (f64, f64, f64) {
    let m = &found.measures;
    let (wanted, has, rounding) = match control {
        Control::Load(value) => (value, found.load, 0.0),
        Control::Intensity(value) => (value, found.intensity, 0.0),
        Control::TotalForce(value) => (value, found.intensity * m.surface, 0.0),
        Control::Volume(value) => (value, m.volume, m.length.powi(3)),
        Control::VolumeGain(gain) => (start.volume * (1.0 + gain), m.volume, m.length.powi(3)),
        Control::Area(value) => (value, m.area, m.length.powi(2)),
        other => panic!("{other:?} prescribes something new"),
    };
    (wanted, has, wanted.abs().max(rounding))
}

fn check(case: &Case) -> Result<(), TestCaseError> {
    let Some(membrane) = case.membrane() else {
        return Ok(());
    };
    let solver = match Solver::new(&membrane, case.discretisation) {
        Ok(solver) => solver,
        Err(NewtonError::Unresolved { .. }) => return Ok(()),
        Err(error) => return Err(TestCaseError::fail(format!("{case:?}: {error}"))),
    };
    let start = solver.start_measures();
    let control = case.control(&start);
    let found = match solver.solve(control, &NewtonOptions::default()) {
        Ok(found) => found,
        Err(error) => {
            let small = case.control.0 < 3 && case.control.2 < 0.1 && case.moved.is_none();
            let rounded = !matches!(case.rest, Rest::Polyline(_));
            prop_assert!(!(small && rounded), "{case:?}: {error}");
            return Ok(());
        }
    };
    let m = &found.measures;
    let numbers = [m.length, m.area, m.surface, m.volume, found.intensity];
    prop_assert!(numbers.iter().all(|x| x.is_finite()), "{case:?}: {m:?}");
    let (wanted, has, size) = prescribed(control, &start, &found);
    // steps of 1e-12 of the length, and of a load of its own size; a gain refers to the reference configuration
    // at the finest resolution, not the coarsest
    let tolerance = match (case.discretisation, control) {
        (Discretisation::SpectralAdaptive { tolerance }, Control::VolumeGain(_)) => tolerance,
        _ => 1e-11,
    };
    prop_assert!(
        (has - wanted).abs() <= tolerance.max(1e-11) * size,
        "{case:?}: {has:e} for {wanted:e}"
    );
    for k in 0..=8 {
        let at = found.at(f64::from(k) / 8.0).position;
        prop_assert!(at[0].is_finite() && at[1].is_finite(), "{case:?}");
    }
    if let Discretisation::FiniteDifferences { nodes } = case.discretisation {
        let whole = FiniteDifferences::new(&membrane, nodes).unwrap();
        let points = found.points();
        let x = points.as_flattened();
        let (mut elastic, mut pressure) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        whole.elastic_force_into(x, &mut elastic);
        whole
            .pressure_force_into(x, found.intensity, &mut pressure)
            .unwrap();
        let left = elastic.iter().zip(&pressure).map(|(e, p)| (e + p).abs());
        let left = left.fold(0.0, f64::max);
        // a spring over its cell multiplies an error of position by lambda / ds^2
        let size = whole.stiffness_scale() * m.length * (nodes as f64).powi(2);
        prop_assert!(left <= 1e-12 * size, "{case:?}: {left:e} of {size:e}");
    }
    Ok(())
}

fn cases() -> u32 {
    let asked = std::env::var("PROPTEST_CASES").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(256)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(cases()) })]

    #[test]
    fn a_result_is_an_equilibrium_that_meets_its_control(case in case()) {
        check(&case)?;
    }
}
